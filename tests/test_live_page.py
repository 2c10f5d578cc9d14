"""The live page: who may see it, that a slow viewer costs nobody, and that a browser shows what is known."""

import asyncio
import contextlib
import http.client
import json
import math
import multiprocessing
import re
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import psutil
import pytest
from browser import note_errors
from live_drive import TRUCK, cut, drive_log, frames_of_log, until
from tornado.iostream import StreamClosedError
from tornado.netutil import bind_sockets

import oncenter as oc
from oncenter import _core
from oncenter.app import guard
from oncenter.app.guard import names_of
from oncenter.app.texts import ENGLISH, LIVE
from oncenter.errors import OncenterError
from oncenter.live import page as live_page
from oncenter.live import serve as live_serve
from oncenter.live import words
from oncenter.live.history import Course, Strip
from oncenter.live.learner import Learner, needed
from oncenter.live.pictures import Pictures
from oncenter.live.replay import Replay
from oncenter.live.session import Notices, Session
from oncenter.live.snapshot import Dropped, Snapshot
from oncenter.live.web import NEXT, READY, Hello, Page
from oncenter.offset.inputs import params_of
from oncenter.read.frames import Frames
from oncenter.read.stream import Stream
from oncenter.verdict import Verdict

PARAMS = params_of(oc.vehicle(TRUCK), None)
# Lists the figures without a number in one of their sources.
_UNDRAWN = """() => ["course", "strip", "flanks"].filter((name) => {
  const models = Bokeh.documents.map((document) => document.get_model_by_name(name)).find((model) => model);
  const sources = [...models.references()].filter((model) => model.type === "ColumnDataSource");
  return !sources.every((source) => Object.values(source.data).some((column) => column.some(Number.isFinite)));
})"""
NEWS_IN_A_MINUTE = 3_000  # one each 0.02 s
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


def own(page: Any, **headers: str | None) -> dict[str, str]:
    """The headers of the page's own requests, some replaced, or left out by None."""
    host = f"127.0.0.1:{page.port}"
    given = {"Host": host, "Cookie": f"oncenter-{page.port}={key_of(page)}"} | headers
    return {name: value for name, value in given.items() if value is not None}


def key_of(page: Any) -> str:
    return page.url.partition("?key=")[2]


def status(page: Any, headers: dict[str, str] | None = None, path: str = "/", method: str = "GET") -> int:
    connection = http.client.HTTPConnection("127.0.0.1", page.port, timeout=10)
    try:
        connection.putrequest(method, path, skip_host=True)
        for name, value in (own(page) if headers is None else headers).items():
            connection.putheader(name, value)
        connection.endheaders()
        return connection.getresponse().status
    finally:
        connection.close()


def statuses(page: Any, requests: list[tuple[dict[str, str], str]]) -> set[int]:
    """Of requests at once, since a refusal takes its time."""
    with ThreadPoolExecutor(len(requests)) as pool:
        return set(pool.map(lambda request: status(page, *request), requests))


def opened(page: Any, **headers: str) -> tuple[str, socket.socket]:
    """The status line of a request for the page's events, and the connection, which takes little before it is read."""
    connection = socket.socket()
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    connection.settimeout(10)
    connection.connect(("127.0.0.1", page.port))
    lines = "".join(f"{name}: {value}\r\n" for name, value in own(page, **headers).items())
    connection.sendall(f"GET /events HTTP/1.1\r\n{lines}\r\n".encode())
    return connection.recv(12).decode(), connection


def test_its_own_names_are_let_in(served: Page) -> None:
    for name in ("127.0.0.1", "localhost", "LOCALHOST"):
        assert status(served, own(served, Host=f"{name}:{served.port}")) == 200
    assert status(served, own(served, Origin=f"http://127.0.0.1:{served.port}")) == 200


def test_the_address_that_is_printed_opens_the_page_and_no_other_key_does(served: Page) -> None:
    assert status(served, own(served, Cookie=None), f"/?key={key_of(served)}") == 302
    own_cookie = f"oncenter-{served.port}"
    cookies = (None, f"{own_cookie}=guessed", f"{own_cookie}=", "é; =")
    paths = ("/", "/?key=guessed", "/?key=", "/events", "/bokeh.js", "/nothing")
    keyless = [(own(served, Cookie=cookie), path) for cookie in cookies for path in paths]
    assert statuses(served, keyless) == {403}


def test_a_name_that_was_bent_to_this_machine_and_a_foreign_page_are_refused_everywhere(served: Page) -> None:
    names = (f"evil.example:{served.port}", f"127.0.0.1.evil.example:{served.port}", "127.0.0.1:1", "[", "")
    foreign = [own(served, Host=host) for host in names]
    address = f"127.0.0.1:{served.port}"
    for origin in ("http://evil.example", "null", f"https://{address}", f"http://{address}.evil.example"):
        foreign.append(own(served, Origin=origin))
    foreign.append(own(served, **{"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Dest": "iframe"}))
    requests = [(headers, path) for headers in foreign for path in ("/", "/bokeh.js", "/page.js", "/events", "/no")]
    assert statuses(served, requests) <= {400, 403}
    line, connection = opened(served, Origin=f"http://{address}")
    connection.close()
    assert line == "HTTP/1.1 200"


def test_the_page_takes_no_request_that_would_change_anything(served: Page) -> None:
    for origin, refusal in ((None, 403), (f"http://127.0.0.1:{served.port}", 405)):
        assert status(served, own(served, Origin=origin, **{"Content-Length": "0"}), method="POST") == refusal


@pytest.mark.parametrize("path", ["/%00", "/bokeh.js%00", "/static/%00", "/static/js/bokeh.min.js", "/events/", "//"])
def test_any_other_path_is_not_found(served: Page, path: str) -> None:
    assert status(served, own(served), path) == 404


def test_no_script_runs_that_is_not_a_file_of_the_page(served: Page) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", served.port, timeout=10)
    connection.request("GET", "/", headers=own(served))
    answer = connection.getresponse()
    page = answer.read().decode()
    policy = dict(part.strip().split(" ", 1) for part in answer.headers["Content-Security-Policy"].split(";"))
    connection.close()
    assert (policy["default-src"], policy["script-src"], policy["connect-src"]) == ("'none'", "'self'", "'self'")
    scripts = re.findall(r"<script([^>]*)>", page)
    assert len(scripts) == 4 and all(" src=" in script or "application/json" in script for script in scripts)
    assert not re.search(r"<[^>]* on\w+=", page)


def test_it_listens_at_no_other_address(served: Page) -> None:
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.2", served.port), timeout=5)  # of this machine as well, and not the page's


def test_with_an_address_it_answers_to_that_address() -> None:
    assert names_of("127.0.0.1") == {"127.0.0.1", "localhost"}
    assert names_of("192.0.2.2") == {"192.0.2.2"}
    assert names_of("truck.example") == {"truck.example"}
    assert names_of("0.0.0.0") is None
    with Page(session_of(drive_log(), 1.0), PARAMS, "0.0.0.0", 0, print) as page:
        assert status(page) == 200
        assert status(page, own(page, Host=f"evil.example:{page.port}")) == 403


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
        assert status(page) == 200
    with Page(session_of(log, 1.0), PARAMS, "127.0.0.1", page.port, print) as again:
        assert status(again) == 200


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
            assert status(page) == 200  # a request for the page is no viewer
        until(lambda: session.snapshot.number > 20)
        assert sent == []
        _, connection = opened(page)
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
    snapshot, pictures, heights_px = session_of(log, 1.0).snapshot, Pictures(), []
    _, strip, _ = pictures.figures
    for number, reason in enumerate(("gap", "speed", "gap", "time")):
        last_s = Strip((0.0, 1.0), (1.0, 0.5), {reason: (0.0, 0.5)})
        pictures.json(1, replace(snapshot, pictures=replace(snapshot.pictures, number=number, strip=last_s)))
        heights_px.append(strip.height)
    assert strip.y_range.factors == ["time", "speed", "gap", "used"]
    assert np.diff(heights_px).tolist() == [20, 0, 20]


def test_a_figure_is_made_once_for_all_viewers_and_has_null_for_what_is_not_available(log: Path) -> None:
    snapshot, pictures = session_of(log, 1.0).snapshot, Pictures()
    course = Course((60.0, 120.0), (1.23456, math.nan), (0.0, math.nan), (2.0, math.nan), (0.5, math.nan))
    now = replace(snapshot, pictures=replace(snapshot.pictures, course=course))
    made = pictures.json(0, now)
    (data,) = (values["data"] for values in json.loads(made).values() if "data" in values)
    assert (data["x"], data["offset"], data["inner_high"]) == ([1.0, 2.0], [1.2346, None], [1.7346, None])
    assert pictures.json(0, now) is made


def test_driving_that_nobody_records_is_not_said_to_be_recorded(log: Path) -> None:
    now = replace(session_of(log, 1.0).snapshot, phase="running")
    assert words.gate(now) == (False, "not used: a signal is not available")  # no frame has come
    assert words.gate(replace(now, reasons=())) == (True, "this driving is used")


def test_a_session_that_ends_without_an_offset_has_no_result(log: Path) -> None:
    nothing = Verdict("offset", "no_offset", "No offset.", "Drive.")
    now = replace(session_of(log, 1.0).snapshot, phase="ended", ended_s=0.0)
    for verdict, result in ((None, "no"), (nothing, "no"), (replace(nothing, state="within"), "final")):
        assert words.finished(replace(now, verdict=verdict)).endswith(f" of signals: {result} result.")


def test_each_reason_of_the_core_for_which_driving_is_not_used_has_words(log: Path) -> None:
    now = replace(session_of(log, 1.0).snapshot, phase="running")
    for name in _core.REASONS:
        assert words.gate(replace(now, reasons=(name,))) == (False, f"not used: {LIVE[name]}")


def test_a_silent_bus_has_no_angle_at_this_time(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session = session_of(log, 1.0)
    monkeypatch.setattr(session._learner.stream, "newest", lambda name: (1.0, 0.5))
    assert session._angles().measured_rad == 0.5
    session._silent = True
    assert math.isnan(session._angles().measured_rad) and math.isnan(session._angles().frame_s)


def test_a_pause_is_not_said_to_be_recorded_when_nothing_is(log: Path) -> None:
    session = session_of(log, 1.0)
    session._learner.stream.paused = OncenterError("two senders", code="ambiguous")
    session._watch_pause()
    assert [notice.text for notice in session._notices.all()] == ["the estimate is paused: two senders"]


@pytest.mark.parametrize("room", ["app", "live"])
def test_each_text_of_a_page_stands_in_the_table_that_a_translation_replaces(room: str) -> None:
    template = files(f"oncenter.{room}").joinpath("page.html").read_text(encoding="utf-8")
    literal = re.sub(r"\{%.*?%\}|\{\{.*?\}\}|<!DOCTYPE html>", "", template)
    named = re.findall(r'(?:aria-label|title|placeholder|alt)="([^"]*)"', literal)
    assert re.findall(r"[A-Za-z]{2,}", " ".join([*named, re.sub(r"<[^>]*>", " ", literal)])) == []
    script = files(f"oncenter.{room}").joinpath(f"{'app' if room == 'app' else 'page'}.js").read_text(encoding="utf-8")
    table = ENGLISH if room == "app" else LIVE
    assert set(re.findall(r"\btexts\.(\w+)", template + script)) <= table.keys()


class Served:
    """The page's server in this process, on a loop that a test runs."""

    def __init__(self, snapshot: Snapshot) -> None:
        ours, theirs = multiprocessing.Pipe()
        self.pipe = ours
        (listening,) = bind_sockets(0, "127.0.0.1")
        self.port = listening.getsockname()[1]
        self.url = f"http://127.0.0.1:{self.port}/?key=the-key"
        ours.send(Hello(snapshot, PARAMS, "127.0.0.1", "the-key"))
        self.thread = threading.Thread(target=live_serve.serve, args=(theirs, [listening]), daemon=True)
        self.thread.start()
        assert ours.recv_bytes() == READY

    def end(self) -> None:
        self.pipe.close()
        self.thread.join()


@pytest.fixture
def here(log: Path) -> Iterator[Served]:
    served = Served(session_of(log, 1.0).snapshot)
    yield served
    served.end()


def test_viewers_beyond_the_limit_get_a_message(here: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_serve, "VIEWERS_MAX", 2)
    first, second = opened(here)[1], opened(here)[1]
    connection = http.client.HTTPConnection("127.0.0.1", here.port, timeout=10)
    connection.request("GET", "/", headers=own(here, Accept="text/html,*/*"))
    answer = connection.getresponse()
    assert answer.status == 503
    assert answer.read() == b"oncenter: the limit of 2 viewers is reached: try again later\n"
    assert opened(here)[0] == "HTTP/1.1 503"
    first.close()
    until(lambda: status(here) == 200)
    second.close()


@pytest.mark.parametrize("request_line", [b"", b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 9\r\n\r\n", b"GET /"])
def test_unfinished_requests_lock_nobody_out(
    here: Served, monkeypatch: pytest.MonkeyPatch, request_line: bytes
) -> None:
    """Neither a viewer who is there, nor one who comes."""
    monkeypatch.setattr(guard, "CONNECTIONS_MAX", 16)
    viewer = opened(here)[1]
    unfinished = [socket.create_connection(("127.0.0.1", here.port)) for _ in range(40)]
    for connection in unfinished:
        with contextlib.suppress(ConnectionError):
            connection.sendall(request_line)
    assert status(here) == 200
    line, another = opened(here)
    assert line == "HTTP/1.1 200"
    assert here.pipe.recv_bytes() == NEXT
    here.pipe.send(replace(session_of(drive_log(), 1.0).snapshot, number=77))
    until(lambda: b'"number": 77' in viewer.recv(1 << 16))
    for connection in (*unfinished, viewer, another):
        connection.close()


@pytest.mark.parametrize(
    "begin", [b"POST / HTTP/1.1\r\n", b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 9\r\n\r\n1234"]
)
def test_a_request_that_stays_unfinished_is_closed(log: Path, monkeypatch: pytest.MonkeyPatch, begin: bytes) -> None:
    monkeypatch.setattr(guard, "REQUEST_S", 0.1)
    served = Served(session_of(log, 1.0).snapshot)
    with socket.create_connection(("127.0.0.1", served.port), timeout=10) as connection:
        connection.sendall(begin)
        assert connection.recv(100) == b""
    served.end()


def test_a_request_without_the_key_waits_for_its_refusal(here: Served) -> None:
    begin_s = time.monotonic()
    assert status(here, own(here, Cookie=None)) == 403
    assert time.monotonic() - begin_s >= guard.REFUSAL_S


def test_a_viewer_who_does_not_read_costs_the_memory_of_one_event(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Once he reads, he gets the newest one."""
    made = []

    def much(now: Any, params: Any) -> str:
        made.append(now.number)
        return "x" * (1 << 20)

    session = session_of(log, 1.0)
    monkeypatch.setattr(live_page, "as_json", much)
    served = Served(session.snapshot)
    line, connection = opened(served)
    assert line == "HTTP/1.1 200"
    for number in range(100, 120):
        served.pipe.send(replace(session.snapshot, number=number))
    assert not served.pipe.poll(0.2) and made == [1]  # the first is on its way: no other one is requested
    connection.setblocking(False)
    while not served.pipe.poll(0.001):
        with contextlib.suppress(BlockingIOError):
            assert connection.recv(1 << 20)
    assert served.pipe.recv_bytes() == NEXT and made == [1, 119]
    connection.close()
    served.end()


def test_scripts_that_nobody_reads_cost_little_memory(here: Served) -> None:
    connections, before_mb = [], _memory_mb()
    headers = "".join(f"{name}: {value}\r\n" for name, value in own(here).items())
    for _ in range(64):
        connection = socket.create_connection(("127.0.0.1", here.port))
        connection.sendall(f"GET /bokeh.js HTTP/1.1\r\n{headers}\r\n".encode())
        connections.append(connection)
    for connection in connections:
        assert connection.recv(12) == b"HTTP/1.1 200"
    assert _memory_mb() - before_mb < 30.0  # of 80
    for connection in connections:
        connection.close()


def _memory_mb() -> float:
    return float(psutil.Process().memory_info().rss / 1e6)


@pytest.mark.slow
def test_ten_viewers_who_read_nothing_cost_less_than_5_mb_a_minute(log: Path) -> None:
    """So less than 50 MB in ten minutes. Another viewer takes all news, and the ten are not cut off meanwhile."""
    session = session_of(log, 100.0)
    session.start()
    session.join()
    last = replace(session.snapshot, phase="running", ended_s=None)
    with Page(session, PARAMS, "127.0.0.1", 0, print) as page:
        reader, process = opened(page)[1], psutil.Process(page._process.pid)
        reader.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        stopped: list[socket.socket] = []
        for number in range(500 + NEWS_IN_A_MINUTE):
            pictures = replace(last.pictures, number=number // 50)
            session.snapshot = replace(last, number=1000 + number, pictures=pictures)
            session.when_shown()
            while f'"number": {1000 + number},'.encode() not in reader.recv(1 << 20):
                pass
            if number == 499:
                before_mb = process.memory_info().rss / 1e6
                stopped = [opened(page)[1] for _ in range(10)]
        assert process.memory_info().rss / 1e6 - before_mb < 5.0
        for connection in (reader, *stopped):
            connection.close()


def test_a_viewer_who_does_not_read_for_long_is_cut_off(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_serve, "SLOW_S", 0.1)
    monkeypatch.setattr(live_serve, "VIEWERS_MAX", 1)
    monkeypatch.setattr(live_page, "as_json", lambda now, params: "x" * (1 << 20))
    served = Served(session_of(log, 1.0).snapshot)
    _, connection = opened(served)
    until(lambda: status(served) == 200)
    connection.close()
    served.end()


def test_a_slow_viewer_gets_each_figure_and_the_last_state(log: Path) -> None:
    """An event is on its way when the session ends: the last one follows it, with all figures that are outdated."""
    first = session_of(log, 1.0).snapshot
    sent: list[str] = []

    def at(number: int) -> Snapshot:
        return replace(first, number=number, pictures=replace(first.pictures, number=number))

    async def send(event: bytes) -> None:
        """A viewer who takes a while for each event, in which new pictures come."""
        sent.append(event.decode())
        await asyncio.sleep(0.02)
        if len(sent) < 6:
            news.update(at(1 + len(sent)))
        elif len(sent) == 6:
            news.update(replace(at(100), phase="ended", ended_s=0.0))
            ending.append(asyncio.create_task(news.end()))

    async def follow() -> None:
        await asyncio.wait_for(news.begin(send), 5.0)
        await ending[0]

    news, ending = live_page.News(first, PARAMS, lambda: None), []
    asyncio.run(follow())
    figures = [[figure.id for figure in news.pictures.figures if f'"{figure.id}"' in event] for event in sent]
    each = [[figure.id] for figure in news.pictures.figures]
    assert figures == [*each, *each, [figure for (figure,) in each]]
    assert '"number": 100' in sent[-1] and sent[-1].startswith('data: {"number": 100')


def test_a_viewer_who_leaves_is_forgotten_at_once(log: Path) -> None:
    async def leave() -> None:
        news = live_page.News(session_of(log, 1.0).snapshot, PARAMS, lambda: None)

        async def send(event: bytes) -> None:
            raise StreamClosedError

        with pytest.raises(StreamClosedError):
            await news.begin(send)
        waiting = news.begin(lambda event: asyncio.sleep(0))
        await asyncio.sleep(0)
        waiting.cancel()
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        assert news._followers == set()

    asyncio.run(leave())


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
        assert view.text_content("#gate") == "Listening: no driving is used so far"
        assert view.text_content("#missing").startswith("Listening")

        def width() -> float:
            sign, half_width, *rest = view.text_content("#interval").split()
            assert (sign, rest) == ("±", ["deg", "from", "the", "driving"])
            return float(half_width)

        turned, widths = set(), []
        for minutes in (1, 2, 4, 8):
            driven.to_s = 60.0 * minutes + 1.0
            until(lambda minutes=minutes: f"; {minutes} min" in view.text_content("#traffic"))
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
        assert (
            "a pull, crosswind or axle set up for the crown, which one drive cannot separate from the offset"
            in view.text_content("#beside")
        )
        assert view.text_content("#flank-left-share") == "100 %"
        until(lambda: view.evaluate(_UNDRAWN) == [])
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
    assert requested and all(url.startswith(page.url.partition("?")[0]) for url in requested)
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
        assert re.match(r"No news from oncenter since \d\d:\d\d:\d\d: the last", view.text_content("#lost"))
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
