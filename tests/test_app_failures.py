"""What must fail on the page of `oncenter app`: each has a sentence that says it, nothing is lost, nobody gets in."""

from __future__ import annotations

import gzip
import http.client
import re
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from os import environ, kill
from pathlib import Path
from signal import SIG_IGN, SIGHUP, SIGTERM, getsignal
from typing import Any

import polars as pl
import pytest
from test_app import Page
from test_estimate import steady_drive

from oncenter.app.uploads import Uploads

pytest.importorskip("tornado", reason="tornado is not installed: pip install 'oncenter[report]'")
pytestmark = pytest.mark.linux  # memory and limits of the server

_MB = 1 << 20
_CHANGED_S = 10.0  # until the server has done what it does without an answer


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of uploads, answers and trucks."""
    return tmp_path_factory.mktemp("app")


@contextmanager
def served(folder: Path) -> Iterator[tuple[Page, int]]:
    """A page, and its process."""
    trucks = folder / "trucks"
    command = [sys.executable, "-m", "oncenter", "app", "--no-browser", "--trucks", str(trucks)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environ | {"TMPDIR": str(folder)}) as process:
        assert process.stdout is not None
        opened = re.search(r"http://127\.0\.0\.1:(\d+)/\?key=([\w-]+)", process.stdout.readline())
        assert opened is not None
        try:
            yield Page(int(opened[1]), opened[2], trucks), process.pid
        finally:
            process.kill()


@pytest.fixture(scope="module")
def server(folder: Path) -> Iterator[tuple[Page, int]]:
    with served(folder) as given:
        yield given


@pytest.fixture
def page(server: tuple[Page, int]) -> Page:
    return server[0]


def kept(folder: Path) -> list[str]:
    """The logs that the server has kept."""
    return sorted(path.name for path in folder.glob("oncenter-app-*/*") if path.suffix not in (".html", ".json"))


def dropped(page: Page, name: str, content: bytes) -> str:
    key = page.said("POST", "/logs", {"name": name, "size": len(content)})["log"]
    page.said("PUT", f"/logs/{key}", content)
    return str(key)


def begin_upload(page: Page, key: str, size: int) -> http.client.HTTPConnection:
    client = http.client.HTTPConnection("127.0.0.1", page.port, timeout=20)
    client.putrequest("PUT", f"/logs/{key}")
    for name, value in (("Content-Length", str(size)), ("Cookie", f"oncenter-{page.port}={page.key}")):
        client.putheader(name, value)
    client.putheader("Origin", f"http://127.0.0.1:{page.port}")
    client.endheaders()
    return client


def test_a_photograph_has_no_answer_by_any_name_and_the_sentence_names_it(page: Page) -> None:
    assert "photo.jpg is not a log" in page.refused("POST", "/logs", {"name": "photo.jpg", "size": 9})
    answer = page.answer(dropped(page, "photo.asc", b"\xff\xd8\xff\xe0\x00\x10JFIF" + bytes(range(256)) * 40))
    assert answer["state"] == "failed" and "photo.asc" in answer["said"]["message"]


def test_a_packed_log_that_unpacks_without_an_end_is_a_sentence_soon(page: Page) -> None:
    answer = page.answer(dropped(page, "bomb.asc.gz", gzip.compress(bytes(16 * _MB), 1) * 64))
    assert answer["state"] == "failed" and "bomb.asc.gz" in answer["said"]["message"]


def test_a_log_without_the_angle_has_no_answer_and_the_sentence_names_the_signal(page: Page, tmp_path: Path) -> None:
    steady_drive(minutes=0.5).table.drop("steering_wheel_angle_rad").write_parquet(tmp_path / "no angle.parquet")
    answer = page.answer(page.drop(tmp_path / "no angle.parquet"))
    assert answer["state"] == "failed"
    assert "no angle.parquet" in answer["said"]["message"] and "steering_wheel_angle" in answer["said"]["message"]


def test_the_log_of_another_truck_is_no_drive_after_the_repair(page: Page, tmp_path: Path) -> None:
    keys = []
    for name, vin in (("before", "YS2R4X20001234567"), ("after", "YS2R4X20007654321")):
        drive = steady_drive(minutes=0.5).table.with_columns(pl.lit(vin).alias("vin"))
        drive.write_parquet(tmp_path / f"{name}.parquet")
        asked = {"group": "shipped", "name": "scania_r730_4x2", "logs": [page.drop(tmp_path / f"{name}.parquet")]}
        keys.append(page.said("POST", "/answers", asked)["answer"])
    assert [page.ended(key)["state"] for key in keys] == ["done", "done"]
    comparison = page.ended(
        page.said("POST", "/comparisons", dict(zip(("before", "after"), keys, strict=True)))["answer"]
    )
    assert comparison["state"] == "failed" and comparison["said"]["code"] == "different_trucks"
    assert "are of two trucks (VIN YS2R4X20001234567 and YS2R4X20007654321)" in comparison["said"]["message"]


def test_a_name_stays_recognisable_and_is_none_that_a_system_reads(folder: Path, page: Page) -> None:
    before = set(kept(folder))
    names = (
        "Überführung (2).asc",
        "überführung (2).ASC",
        "../../etc/pass wd.log",
        "con.log",
        "-x.log",
        "木" * 300 + ".log",
    )
    for name in names:
        dropped(page, name, b"x")
    assert set(kept(folder)) - before == {
        "Überführung (2).asc",
        "2-überführung (2).ASC",
        "_.._.._etc_pass wd.log",
        "_con.log",
        "_-x.log",
        "木" * 56 + ".log",
    }


def test_a_log_that_windows_keeps_open_is_removed_and_may_come_again(monkeypatch: pytest.MonkeyPatch) -> None:
    def in_use(*_: Any, **__: Any) -> None:
        raise PermissionError(13, "another process uses the file")

    with Uploads() as uploads, monkeypatch.context() as patch:
        for name in ("drive.log", "2-drive.log"):
            upload = uploads.of(key := uploads.begin("drive.log", 1))
            assert upload is not None
            upload.write(b"x")
            assert upload.path.name == name
            patch.setattr(Path, "unlink", in_use)
            uploads.remove(key)
            patch.undo()


def test_nothing_is_kept_of_a_log_that_is_cut(page: Page, folder: Path) -> None:
    key = page.said("POST", "/logs", {"name": "cut.log", "size": 2 * _MB})["log"]
    client = begin_upload(page, key, 2 * _MB)
    client.send(bytes(_MB))
    wait_until(lambda: "cut.log" in kept(folder))
    client.close()
    wait_until(lambda: "cut.log" not in kept(folder))
    assert "Wait until all logs" in page.refused("POST", "/answers", {"group": "unknown", "logs": [key]})


def test_a_log_that_is_cancelled_on_its_way_does_not_come_back(page: Page, folder: Path) -> None:
    key = page.said("POST", "/logs", {"name": "away.log", "size": 2 * _MB})["log"]
    client = begin_upload(page, key, 2 * _MB)
    client.send(bytes(_MB))
    wait_until(lambda: "away.log" in kept(folder))
    page.said("DELETE", f"/logs/{key}")
    client.send(bytes(_MB))  # as it was under way
    client.getresponse()
    assert "away.log" not in kept(folder)


def test_a_terminal_that_is_closed_leaves_no_copy_of_a_log(tmp_path: Path) -> None:
    with served(tmp_path) as (page, pid):
        dropped(page, "copy.log", b"whole")
        assert kept(tmp_path) == ["copy.log"]
        kill(pid, SIGTERM if getsignal(SIGHUP) is SIG_IGN else SIGHUP)  # nohup of these tests
        wait_until(lambda: not list(tmp_path.glob("oncenter-app-*")))


def test_a_disk_that_fills_on_the_way_is_a_sentence_and_nothing_is_kept(server: tuple[Page, int], folder: Path) -> None:
    page, pid = server
    key = page.said("POST", "/logs", {"name": "full.log", "size": 3 * _MB})["log"]
    no_limit = resource.prlimit(pid, resource.RLIMIT_FSIZE)
    resource.prlimit(pid, resource.RLIMIT_FSIZE, (_MB, no_limit[1]))
    try:
        said = page.refused("PUT", f"/logs/{key}", bytes(3 * _MB))
    finally:
        resource.prlimit(pid, resource.RLIMIT_FSIZE, no_limit)
    assert "the log cannot be kept: File too large; make room on the disk, then drop it again" in said
    assert "full.log" not in kept(folder)
    dropped(page, "full.log", bytes(3 * _MB))
    assert "full.log" in kept(folder)


def test_of_two_tabs_neither_ends_the_other_s_answer_and_a_third_waits(page: Page) -> None:
    asked = {"group": "unknown", "logs": [dropped(page, "tabs.csv", b"time_s,speed\n1,2\n2,3\n")]}
    one, other = (page.said("POST", "/answers", asked)["answer"] for _ in range(2))
    assert "2 answers are being made" in page.refused("POST", "/answers", asked)
    page.said("DELETE", f"/answers/{one}")
    assert "tabs.csv" in page.ended(other)["said"]["message"]
    assert page.ended(one)["state"] == "cancelled"


def test_another_user_of_the_machine_can_read_no_log_and_has_no_key(page: Page, folder: Path) -> None:
    dropped(page, "mine.log", b"mine")
    page.said("POST", "/trucks", {"name": "mine", "traffic_side": "left"})
    places = [*folder.glob("oncenter-app-*"), page.trucks]
    assert len(places) == 3 and {place.stat().st_mode & 0o777 for place in places} == {0o700}
    for cookie in (
        f"oncenter-{page.port + 1}={page.key}",
        f"oncenter-{page.port}=",
        f"oncenter-{page.port}={page.key}x",
    ):
        assert page.ask("GET", "/", Cookie=cookie)[0] == 403


def test_fifty_logs_at_once_are_kept_in_little_memory_and_one_more_is_refused(
    server: tuple[Page, int], folder: Path
) -> None:
    page, pid = server
    others = len(kept(folder))
    keys = [page.said("POST", "/logs", {"name": f"{number}.log", "size": _MB})["log"] for number in range(50 - others)]
    assert "no more than 50 logs at once: remove some" in page.refused("POST", "/logs", {"name": "x.log", "size": 1})
    before = peak_mb(pid)
    with ThreadPoolExecutor(50) as threads:
        said = list(threads.map(lambda key: page.ask("PUT", f"/logs/{key}", bytes(_MB))[0], keys))
    assert said == [200] * len(keys) and len(kept(folder)) == 50
    assert peak_mb(pid) - before < 30.0 or "asan" in environ.get("LD_PRELOAD", "")  # which keeps what is freed
    for key in keys:
        page.said("DELETE", f"/logs/{key}")
    assert len(kept(folder)) == others


def test_a_log_is_taken_from_one_request_alone(page: Page, folder: Path) -> None:
    key = page.said("POST", "/logs", {"name": "once.log", "size": 10})["log"]
    client = begin_upload(page, key, 10)
    page.ask("GET", "/")  # the server has read the header
    assert "announced" in page.refused("PUT", f"/logs/{key}", b"another on")
    client.send(b"0123456789")
    assert client.getresponse().status == 200
    assert next(folder.glob("oncenter-app-*/once.log")).read_bytes() == b"0123456789"


def peak_mb(pid: int) -> float:
    found = re.search(r"VmHWM:\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text())
    assert found is not None
    return int(found[1]) / 1024.0


def wait_until(done: Any) -> None:
    until = time.monotonic() + _CHANGED_S
    while not done():
        assert time.monotonic() < until
        time.sleep(0.01)
