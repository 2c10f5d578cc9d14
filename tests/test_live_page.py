"""The live page: who may see it, that a slow viewer costs nobody, and that a browser shows what is known."""

import asyncio
import base64
import http.client
import multiprocessing
import re
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from bokeh.document import Document
from bokeh.models import ColumnDataSource
from bokeh.util.token import generate_jwt_token
from browser import note_errors
from live_drive import TRUCK, cut, drive_log, frames_of_log, until
from tornado.netutil import bind_sockets

import oncenter as oc
from oncenter.errors import OncenterError
from oncenter.live import page as live_page
from oncenter.live import serve as live_serve
from oncenter.live import words
from oncenter.live.history import Strip
from oncenter.live.learner import Learner, needed
from oncenter.live.pictures import Pictures
from oncenter.live.replay import Replay
from oncenter.live.session import Notices, Session
from oncenter.live.snapshot import Dropped, Snapshot
from oncenter.live.web import NEXT, READY, Hello, Page, names_of
from oncenter.offset.inputs import params_of
from oncenter.read.frames import Frames
from oncenter.read.stream import Stream

PARAMS = params_of(oc.vehicle(TRUCK), None)
SIZES = {"phone": (400, 850), "dashboard": (800, 480), "desk": (1280, 900)}


def session_of(log: Path, speed: float) -> Session:
    truck = oc.vehicle(TRUCK)
    replay = Replay(log, speed)
    return Session(replay, Learner(Stream(replay.name, needed(truck)), truck), "truck", Notices())


@pytest.fixture(scope="module")
def log() -> Path:
    return drive_log()


@pytest.fixture(scope="module")
def served(log: Path) -> Iterator[Page]:
    """A page of a session that has not begun."""
    with Page(session_of(log, 1.0), PARAMS, "127.0.0.1", 0, print) as page:
        yield page


def status(page: Any, headers: dict[str, str], path: str = "/") -> int:
    connection = http.client.HTTPConnection("127.0.0.1", page.port, timeout=10)
    try:
        connection.putrequest("GET", path, skip_host=True)
        for name, value in headers.items():
            connection.putheader(name, value)
        connection.endheaders()
        return connection.getresponse().status
    finally:
        connection.close()


def token_of(page: Any) -> str:
    connection = http.client.HTTPConnection("127.0.0.1", page.port, timeout=10)
    connection.request("GET", "/")
    found = re.search(r'"token":"([^"]+)"', connection.getresponse().read().decode())
    connection.close()
    assert found
    return found[1]


def handshake(page: Any, origin: str, host: str) -> tuple[str, socket.socket]:
    """The status line that a page from `origin` gets who asks for the socket, and the connection."""
    connection = socket.socket()
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    connection.settimeout(10)
    connection.connect(("127.0.0.1", page.port))
    key = base64.b64encode(b"0123456789abcdef").decode()
    connection.sendall(
        f"GET /ws HTTP/1.1\r\nHost: {host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: {key}\r\n"
        f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: bokeh, {token_of(page)}\r\n"
        f"Origin: {origin}\r\n\r\n".encode()
    )
    return connection.recv(12).decode(), connection


def test_its_own_names_are_let_in(served: Page) -> None:
    for name in ("127.0.0.1", "localhost", "LOCALHOST"):
        assert status(served, {"Host": f"{name}:{served.port}"}) == 200
    assert status(served, {"Host": f"127.0.0.1:{served.port}", "Origin": served.url.rstrip("/")}) == 200


@pytest.mark.parametrize("path", ["/", "/static/js/bokeh.min.js", "/ws", "/metadata", "/autoload.js"])
def test_a_name_that_was_bent_to_this_machine_is_refused_everywhere(served: Page, path: str) -> None:
    for host in (f"evil.example:{served.port}", f"127.0.0.1.evil.example:{served.port}", "127.0.0.1:1", "[", ""):
        assert status(served, {"Host": host}, path) in (400, 403)
    assert status(served, {"Host": f"127.0.0.1:{served.port}", "Origin": "http://evil.example"}, path) == 403
    assert status(served, {"Host": f"127.0.0.1:{served.port}", "Origin": "null"}, path) == 403
    frame = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Dest": "iframe"}
    assert status(served, {"Host": f"127.0.0.1:{served.port}", **frame}, path) == 403


def test_only_its_own_page_gets_the_socket(served: Page, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BOKEH_ALLOW_WS_ORIGIN", "*")  # not even so
    own = f"127.0.0.1:{served.port}"
    for origin in (
        "http://evil.example",
        f"https://{own}",
        f"http://localhost:{served.port}",
        f"http://{own}.evil.example",
    ):
        line, connection = handshake(served, origin, own)
        connection.close()
        assert line == "HTTP/1.1 403"
    line, connection = handshake(served, f"http://{own}", own)
    connection.close()
    assert line == "HTTP/1.1 101"


def test_it_listens_at_no_other_address(served: Page) -> None:
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.2", served.port), timeout=5)  # of this machine as well, and not the page's


def test_with_an_address_it_answers_to_that_address() -> None:
    assert names_of("127.0.0.1") == {"127.0.0.1", "localhost"}
    assert names_of("192.0.2.2") == {"192.0.2.2"}
    assert names_of("truck.example") == {"truck.example"}
    assert names_of("0.0.0.0") is None
    with Page(session_of(drive_log(), 1.0), PARAMS, "0.0.0.0", 0, print) as page:
        assert status(page, {"Host": f"127.0.0.1:{page.port}"}) == 200
        assert status(page, {"Host": f"evil.example:{page.port}"}) == 403


def test_a_port_that_is_taken_is_one_line(served: Page) -> None:
    with pytest.raises(OncenterError, match=rf"127\.0\.0\.1:{served.port}: .*in use; name another --port"):
        Page(SimpleNamespace(), PARAMS, "127.0.0.1", served.port, print)


@pytest.mark.parametrize("address", ["300.1.1.1", "192.0.2.77", "a..b"])
def test_an_address_that_is_none_of_this_machine_is_named_as_such(address: str) -> None:
    with pytest.raises(OncenterError, match=r"name another --address, of this machine") as refusal:
        Page(SimpleNamespace(), PARAMS, address, 0, print)
    assert refusal.value.exit_code == 2


@pytest.mark.slow
def test_a_port_is_free_again_once_the_page_has_ended(log: Path) -> None:
    with Page(session_of(log, 1.0), PARAMS, "127.0.0.1", 0, print) as page:
        assert status(page, {"Host": f"127.0.0.1:{page.port}"}) == 200
    with Page(session_of(log, 1.0), PARAMS, "127.0.0.1", page.port, print) as again:
        assert status(again, {"Host": f"127.0.0.1:{again.port}"}) == 200


def test_a_page_whose_process_dies_is_said_and_the_session_goes_on(log: Path) -> None:
    notices: list[str] = []
    session = session_of(log, 20.0)
    with Page(session, PARAMS, "127.0.0.1", 0, notices.append) as page:
        session.start()
        page._process.kill()
        until(lambda: notices != [])
        begun = session.snapshot.number
        until(lambda: session.snapshot.number > begun + 10)
        session.stop()
        session.join()
    assert session.failure is None
    code = page._process.wait()
    assert notices == [f"the page has ended: its process ended with code {code}; the session continues"]


@pytest.mark.slow
def test_the_page_s_process_ends_with_the_session_s() -> None:
    """Whatever ended it: the pipe is closed then."""
    begin = (
        "import os, signal; from oncenter.live.web import Page; from test_live_page import *\n"
        "with Page(session_of(drive_log(60.0), 1.0), PARAMS, '127.0.0.1', 0, print) as page:\n"
        "    print(page._process.pid, flush=True)\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    child = subprocess.run([sys.executable, "-c", begin], capture_output=True, text=True, cwd=Path(__file__).parent)
    until(lambda: _has_ended(int(child.stdout)))


def _has_ended(pid: int) -> bool:
    stat = Path(f"/proc/{pid}/stat")
    try:
        return stat.read_text().rpartition(")")[2].split()[0] == "Z"  # nobody here waits for it
    except OSError:
        return True


@pytest.mark.slow
def test_without_a_viewer_the_session_does_nothing_for_the_page(log: Path) -> None:
    session = session_of(log, 20.0)
    with Page(session, PARAMS, "127.0.0.1", 0, print) as page:
        sent: list[int] = []
        send = page._pipe.send
        page._pipe.send = lambda snapshot: (sent.append(snapshot.number), send(snapshot))
        session.start()
        for _ in range(20):
            token_of(page)  # a request for the page is no viewer
        until(lambda: session.snapshot.number > 20)
        assert sent == []
        own = f"127.0.0.1:{page.port}"
        _, connection = handshake(page, f"http://{own}", own)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        until(lambda: connection.recv(1 << 16) != b"" and len(sent) > 10)
        connection.close()
        time.sleep(1.0)
        sent_before = len(sent)
        time.sleep(1.0)
        assert len(sent) <= sent_before + 1
        session.stop()
        session.join()


def test_the_last_minutes_of_the_gate_have_a_row_for_each_reason_so_far(log: Path) -> None:
    snapshot, pictures, heights_px = session_of(log, 1.0).snapshot, Pictures(ColumnDataSource()), []
    _, strip, _ = pictures.figures
    for number, reason in enumerate(("gap", "speed", "gap", "time")):
        last_s = Strip((0.0, 1.0), (1.0, 0.5), {reason: (0.0, 0.5)})
        for _ in pictures.figures:
            pictures.show_next(replace(snapshot, pictures=replace(snapshot.pictures, number=number, strip=last_s)))
        heights_px.append(strip.height)
    assert strip.y_range.factors == ["time", "speed", "gap", "used"]
    assert np.diff(heights_px).tolist() == [20, 0, 20]


def test_driving_that_nobody_records_is_not_said_to_be_recorded(log: Path) -> None:
    now = replace(session_of(log, 1.0).snapshot, phase="running")
    assert words.gate(now) == (True, "this driving is used")


class Served:
    """The page's server in this process, on a loop that a test runs."""

    def __init__(self, snapshot: Snapshot, made: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
        own_page = live_serve.page
        monkeypatch.setattr(live_serve, "page", lambda doc, news: (made.append(doc), own_page(doc, news)))
        ours, theirs = multiprocessing.Pipe()
        self.pipe = ours
        (listening,) = bind_sockets(0, "127.0.0.1")
        self.port = listening.getsockname()[1]
        self.url = f"http://127.0.0.1:{self.port}/"
        ours.send(Hello(snapshot, PARAMS, names_of("127.0.0.1")))
        self.thread = threading.Thread(target=live_serve.serve, args=(theirs, [listening]), daemon=True)
        self.thread.start()
        assert ours.recv_bytes() == READY

    def end(self) -> None:
        self.pipe.close()
        self.thread.join()


@pytest.fixture
def here(log: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Served, list[Any]]]:
    made: list[Any] = []
    served = Served(session_of(log, 1.0).snapshot, made, monkeypatch)
    yield served, made
    served.end()


def test_a_page_that_is_asked_for_makes_no_document_before_its_socket_is_open(here: tuple[Served, list[Any]]) -> None:
    served, made = here
    tokens = {token_of(served) for _ in range(50)}
    for path in ("/metadata", "/autoload.js?bokeh-autoload-element=1", "/favicon.ico", "/nothing"):
        assert status(served, {"Host": f"127.0.0.1:{served.port}"}, path) == 404
    assert len(tokens) == 50 and made == []
    own = f"127.0.0.1:{served.port}"
    line, connection = handshake(served, f"http://{own}", own)
    assert line == "HTTP/1.1 101"
    until(lambda: len(made) == 1)
    connection.close()
    until(lambda: made[0].session_context is None)  # it is gone with its viewer


def test_a_token_that_this_page_did_not_give_opens_nothing(
    here: tuple[Served, list[Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    served, made = here
    monkeypatch.setattr(sys.modules[__name__], "token_of", lambda page: generate_jwt_token("mine"))
    own = f"127.0.0.1:{served.port}"
    _, connection = handshake(served, f"http://{own}", own)
    until(lambda: connection.recv(1 << 16) == b"")
    assert made == []


def test_viewers_beyond_the_limit_get_a_message(
    here: tuple[Served, list[Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    served, made = here
    monkeypatch.setattr(live_serve, "VIEWERS_MAX", 2)
    own = f"127.0.0.1:{served.port}"
    first, _ = (handshake(served, f"http://{own}", own)[1] for _ in range(2))
    until(lambda: len(made) == 2)
    connection = http.client.HTTPConnection("127.0.0.1", served.port, timeout=10)
    connection.request("GET", "/")
    answer = connection.getresponse()
    assert answer.status == 503
    assert answer.read() == b"oncenter: the limit of 2 viewers is reached: try again later\n"
    first.close()
    until(lambda: status(served, {"Host": own}) == 200)


def test_requests_beyond_the_limit_wait_and_are_refused(
    here: tuple[Served, list[Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    served, _ = here
    own = f"127.0.0.1:{served.port}"
    monkeypatch.setattr(live_serve.Allowance, "take", lambda self, address: address != "127.0.0.1")
    begin_s = time.monotonic()
    assert status(served, {"Host": own}) == 429
    assert time.monotonic() - begin_s >= live_serve.REFUSAL_S


def test_each_address_has_an_allowance_of_its_own_that_comes_back_with_time() -> None:
    now = 0.0
    allowance = live_serve.Allowance(2.0, 4.0, lambda: now)
    assert [allowance.take("a") for _ in range(5)] == [True] * 4 + [False]
    assert allowance.take("b")
    now = 1.0
    assert [allowance.take("a") for _ in range(3)] == [True, True, False]
    for k in range(3 * live_serve.ADDRESSES_MAX):
        allowance.take(str(k))
    assert len(allowance._left) == live_serve.ADDRESSES_MAX


def test_nothing_is_made_for_a_viewer_who_does_not_read(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = []

    def much(now: Any, params: Any) -> str:
        made.append(now.number)
        return "x" * (4 << 20)

    session = session_of(log, 1.0)
    monkeypatch.setattr(live_page, "as_json", much)
    served = Served(session.snapshot, [], monkeypatch)
    own = f"127.0.0.1:{served.port}"
    line, connection = handshake(served, f"http://{own}", own)
    assert line == "HTTP/1.1 101"
    requests = 0
    while served.pipe.poll(2.0):  # until the viewer is stuck, nothing is requested
        assert served.pipe.recv_bytes() == NEXT
        requests += 1
        served.pipe.send(replace(session.snapshot, number=1000 + requests))
        assert requests < 10
    stuck = len(made)
    while not served.pipe.poll(0.0):  # he is still there: once he reads, there is more for him
        assert connection.recv(1 << 20)
    assert len(made) == stuck
    connection.close()
    served.end()


def test_a_viewer_who_left_in_a_quiet_time_is_not_a_failure(log: Path) -> None:
    class Left(Document):
        """The document of a session that was destroyed before its viewer's task woke."""

        session_context = None

    snapshot, begun = session_of(log, 1.0).snapshot, []

    async def follow() -> None:
        news, doc = live_page.News(snapshot, PARAMS, lambda: None), Left()
        doc.add_next_tick_callback = begun.append
        live_page.page(doc, news)
        begun[0]()
        (following,) = news.followers
        await asyncio.sleep(0)
        news.update(snapshot)
        await asyncio.wait_for(following, 5.0)

    asyncio.run(follow())
    assert begun


def test_a_slow_viewer_gets_the_last_state_as_well(log: Path) -> None:
    """An update is on its way when the session ends: the last one follows it."""
    first = session_of(log, 1.0).snapshot
    shown: list[int] = []

    class Slow:
        """A viewer who takes a while for each update."""

        async def with_locked_document(self, look: Any) -> None:
            await asyncio.sleep(0.1)
            await look(None)
            shown.append(news.snapshot.number)

    class Followed(Document):
        session_context = Slow()

    async def follow() -> None:
        doc, begun = Followed(), []
        doc.add_next_tick_callback = begun.append
        live_page.page(doc, news)
        begun[0]()
        await asyncio.sleep(0)
        news.update(replace(first, number=first.number + 1))
        await asyncio.sleep(0.05)
        news.update(replace(first, number=first.number + 2))
        await news.end()

    news = live_page.News(first, PARAMS, lambda: None)
    asyncio.run(follow())
    assert shown[-1] == first.number + 2


class Driven:
    """A log that is played up to `to_s`."""

    def __init__(self, log: Path) -> None:
        self.name, self.dropped, self.ended, self.to_s = log.name, Dropped(), False, 0.0
        self._frames, self._given = frames_of_log(log), 0

    def take(self, timeout_s: float) -> Frames:
        time.sleep(timeout_s)
        begin = self._given
        self._given = int(np.searchsorted(self._frames.time - self._frames.time[0], self.to_s))
        return cut(self._frames, begin, self._given)

    def close(self) -> None:
        pass


@pytest.mark.browser
def test_in_a_browser_the_wheel_turns_the_interval_shrinks_and_findings_appear(log: Path, browser: Any) -> None:
    truck, driven = oc.vehicle(TRUCK), Driven(log)
    session = Session(driven, Learner(Stream("bus", needed(truck)), truck), "truck", Notices())
    with Page(session, PARAMS, "127.0.0.1", 0, print) as page:
        view = browser.new_page(viewport={"width": 1280, "height": 900})
        requested, wrong = [], []
        view.on("request", lambda request: requested.append(request.url))
        note_errors(view, wrong)
        view.goto(page.url)
        session.start()
        view.wait_for_selector("#truck:not(:empty)")
        assert view.text_content("#gate") == "Listening to the bus"
        assert view.text_content("#missing").startswith("Listening")

        def width() -> float:
            sign, half_width, *rest = view.text_content("#interval").split()
            assert (sign, rest) == ("±", ["deg", "from", "this", "drive"])
            return float(half_width)

        turned, widths = set(), []
        for minutes in (1, 2, 4, 8):
            driven.to_s = 60.0 * minutes + 1.0
            until(lambda minutes=minutes: f"driven {minutes} min" in view.text_content("#traffic"))
            until(lambda: "±" in view.text_content("#interval"))
            turned.add(view.get_attribute("#wheel-turned", "transform"))
            widths.append(width())
            units = {"converging": "deg, still converging", "valid": "deg"}
            until(lambda units=units: view.text_content("#offset-unit") == units[view.text_content("#status")])
            until(lambda: view.get_attribute("#offset", "class") == f"offset {view.text_content('#status')}")
        assert len(turned) == 4
        until(lambda: width() < 0.6 * widths[0])
        until(lambda: view.text_content("#gate") == "This driving is used")
        view.wait_for_selector("#findings li.info")
        assert "No single drive can identify" in view.text_content("#findings")
        assert "a pull or crosswind, which one drive cannot separate from the offset" in view.text_content("#beside")
        assert view.text_content("#flank-left-share") == "100 %"
        assert view.locator("canvas").count() >= 3
        _fits(view)
        assert view.text_content("#verdict").startswith(session.snapshot.verdict.headline[:9])
        assert view.is_hidden("#finished")
        assert wrong == []
        session.stop()
        session.join()
        assert session.failure is None
        last = session.snapshot
    view.wait_for_selector("#finished:not([hidden])")
    assert view.text_content("#finished") == words.sentence(words.finished(last))
    verdict = last.verdict
    assert view.text_content("#verdict") == words.signed(verdict.headline + verdict.action)
    time.sleep(4.0)  # longer than a page waits for news before it is lost
    assert view.is_hidden("#lost") and view.is_hidden("#gate")
    assert [fault for fault in wrong if fault.startswith("page error")] == []  # the console shows the lost connection
    assert requested and all(url.startswith(page.url) for url in requested)
    view.close()


@pytest.mark.browser
def test_a_page_whose_server_is_gone_says_that_the_last_values_are_shown(log: Path, browser: Any) -> None:
    session = session_of(log, 20.0)
    with Page(session, PARAMS, "127.0.0.1", 0, lambda line: None) as page:
        view = browser.new_page()
        view.goto(page.url)
        session.start()
        view.wait_for_selector("#truck:not(:empty)")
        page._process.kill()
        view.wait_for_selector("#lost:not([hidden])")
        assert re.match(r"Connection to oncenter lost at \d\d:\d\d:\d\d: the last", view.text_content("#lost"))
        assert view.is_hidden("#finished")
        session.stop()
        session.join()
    view.close()


def _fits(view: Any) -> None:
    for width, height in SIZES.values():
        view.set_viewport_size({"width": width, "height": height})
        time.sleep(0.2)
        for box in (part.bounding_box() for part in view.locator("main section, main header, main svg").all()):
            assert box["x"] >= 0 and box["x"] + box["width"] <= width
