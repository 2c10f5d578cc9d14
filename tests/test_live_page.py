"""The live page: who may see it, that a slow viewer costs nobody, and that a browser shows what is known."""

import asyncio
import base64
import http.client
import re
import shutil
import socket
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from live_drive import TRUCK, cut, drive_log, frames_of_log, until

import oncenter as oc
from oncenter.errors import OncenterError
from oncenter.inputs import params_of
from oncenter.live import page as live_page
from oncenter.live.learner import Learner, needed
from oncenter.live.replay import Replay
from oncenter.live.session import Sayings, Session
from oncenter.live.web import Page, names_of
from oncenter.read.frames import Frames
from oncenter.read.stream import Stream

PARAMS = params_of(oc.vehicle(TRUCK), None)
SIZES = {"phone": (400, 850), "dashboard": (800, 480), "desk": (1280, 900)}


def session_of(log: Path, speed: float) -> Session:
    truck = oc.vehicle(TRUCK)
    replay = Replay(log, speed)
    return Session(replay, Learner(Stream(replay.name, needed(truck)), truck), "truck", Sayings())


@pytest.fixture(scope="module")
def log() -> Path:
    return drive_log()


@pytest.fixture(scope="module")
def served(log: Path) -> Iterator[Page]:
    """A page of a session that has not begun."""
    with Page(session_of(log, 1.0), PARAMS, "127.0.0.1", 0) as page:
        yield page


def status(page: Page, headers: dict[str, str], path: str = "/") -> int:
    connection = http.client.HTTPConnection("127.0.0.1", page.port, timeout=10)
    try:
        connection.putrequest("GET", path, skip_host=True)
        for name, value in headers.items():
            connection.putheader(name, value)
        connection.endheaders()
        return connection.getresponse().status
    finally:
        connection.close()


def token_of(page: Page) -> str:
    connection = http.client.HTTPConnection("127.0.0.1", page.port, timeout=10)
    connection.request("GET", "/")
    found = re.search(r'"token":"([^"]+)"', connection.getresponse().read().decode())
    connection.close()
    assert found
    return found[1]


def handshake(page: Page, origin: str, host: str) -> tuple[str, socket.socket]:
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


def test_another_host_does_not_reach_it(served: Page) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.77", 9))  # sends nothing: it only asks for the way
        except OSError:
            pytest.skip("this machine has no address but its own")
        address = probe.getsockname()[0]
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((address, served.port), timeout=5)


def test_told_otherwise_it_answers_to_the_address_that_was_named() -> None:
    assert names_of("127.0.0.1") == {"127.0.0.1", "localhost"}
    assert names_of("192.0.2.2") == {"192.0.2.2"}
    assert names_of("truck.example") == {"truck.example"}
    assert names_of("0.0.0.0") is None
    with Page(session_of(drive_log(), 1.0), PARAMS, "0.0.0.0", 0) as page:
        assert status(page, {"Host": f"127.0.0.1:{page.port}"}) == 200
        assert status(page, {"Host": f"evil.example:{page.port}"}) == 403


def test_a_port_that_is_taken_is_one_line(served: Page) -> None:
    with pytest.raises(OncenterError, match=rf"127\.0\.0\.1:{served.port}: .*in use; name another --port"):
        Page(SimpleNamespace(), PARAMS, "127.0.0.1", served.port)


@pytest.mark.parametrize("address", ["300.1.1.1", "192.0.2.77", "a..b"])
def test_an_address_that_is_none_of_this_machine_is_named_as_such(address: str) -> None:
    with pytest.raises(OncenterError, match=r"name another --address, of this machine") as refusal:
        Page(SimpleNamespace(), PARAMS, address, 0)
    assert refusal.value.exit_code == 2


def test_nothing_is_made_for_a_viewer_who_does_not_read(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = []

    def much(now: Any, params: Any) -> str:
        made.append(now.number)
        return "x" * (4 << 20)

    monkeypatch.setattr(live_page, "as_json", much)
    session = session_of(log, 20.0)
    with Page(session, PARAMS, "127.0.0.1", 0) as page:
        own = f"127.0.0.1:{page.port}"
        line, connection = handshake(page, f"http://{own}", own)
        assert line == "HTTP/1.1 101"
        session.start()
        until(lambda: session.snapshot.number > 20)
        stuck = len(made)
        begun = session.snapshot.number
        until(lambda: session.snapshot.number > begun + 15)
        assert len(made) <= stuck + 1 < 20
        while len(made) <= stuck + 1:  # he is still there: once he reads, there is more for him
            assert connection.recv(1 << 20)
        connection.close()
        session.stop()
        session.join()
        assert session.failure is None


def test_a_viewer_who_left_while_there_was_nothing_to_tell_is_no_failure(log: Path) -> None:
    from bokeh.document import Document

    class Left(Document):
        """As of a session that was destroyed before its viewer's task woke."""

        session_context = None

    session, begun = session_of(log, 1.0), []

    async def told() -> None:
        news, doc = live_page.News(), Left()
        doc.add_next_tick_callback = begun.append
        live_page.page(doc, session, PARAMS, news)
        begun[0]()
        (following,) = news.followers
        await asyncio.sleep(0)
        news.tell()
        await asyncio.wait_for(following, 5.0)

    asyncio.run(told())
    assert begun


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("no chromium on this machine")
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv(
            "LD_PRELOAD", raising=False
        )  # the sanitizers, with which these tests run too, are not the browser's
        running = playwright.sync_playwright().start()
        opened = running.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
    yield opened
    opened.close()
    running.stop()


class Driven:
    """A log that is played as far as it is told."""

    def __init__(self, log: Path) -> None:
        self.name, self.dropped, self.ended, self.to_s = log.name, 0, False, 0.0
        self._frames, self._given = frames_of_log(log), 0

    def take(self, timeout_s: float) -> Frames:
        time.sleep(timeout_s)
        begin = self._given
        self._given = int(np.searchsorted(self._frames.time - self._frames.time[0], self.to_s))
        return cut(self._frames, begin, self._given)

    def close(self) -> None:
        pass


def test_in_a_browser_the_wheel_turns_the_interval_shrinks_and_findings_appear(log: Path, browser: Any) -> None:
    truck, driven = oc.vehicle(TRUCK), Driven(log)
    session = Session(driven, Learner(Stream("bus", needed(truck)), truck), "truck", Sayings())
    with Page(session, PARAMS, "127.0.0.1", 0) as page:
        view = browser.new_page(viewport={"width": 1280, "height": 900})
        asked, wrong = [], []
        view.on("request", lambda request: asked.append(request.url))
        view.on("pageerror", lambda error: wrong.append(str(error)))
        view.goto(page.url)
        session.start()
        view.wait_for_selector("#truck:not(:empty)")
        assert view.text_content("#gate") == "Listening to the bus"
        assert view.text_content("#missing").startswith("Listening")

        def width() -> float:
            low, _, high, _ = view.text_content("#interval").replace("−", "-").split()
            return float(high) - float(low)

        turned, widths = set(), []
        for minutes in (1, 2, 4, 8):
            driven.to_s = 60.0 * minutes + 1.0
            until(lambda minutes=minutes: f"driven {minutes} min" in view.text_content("#traffic"))
            until(lambda: " to " in view.text_content("#interval"))
            turned.add(view.get_attribute("#wheel-turned", "transform"))
            widths.append(width())
        assert len(turned) == 4
        until(lambda: width() < 0.6 * widths[0])
        until(lambda: view.text_content("#gate") == "This counts")
        view.wait_for_selector("#findings li.info")
        assert "interval" in view.text_content("#findings")
        assert view.text_content("#flank-left-share") == "100 %"
        assert view.locator("canvas").count() >= 3
        _fits(view)
        session.stop()
        session.join()
        assert session.failure is None
    view.wait_for_selector("#lost:not([hidden])")
    assert wrong == []
    assert asked and all(url.startswith(page.url) for url in asked)
    view.close()


def _fits(view: Any) -> None:
    for width, height in SIZES.values():
        view.set_viewport_size({"width": width, "height": height})
        time.sleep(0.2)
        for box in (part.bounding_box() for part in view.locator("main section, main header, main svg").all()):
            assert box["x"] >= 0 and box["x"] + box["width"] <= width
