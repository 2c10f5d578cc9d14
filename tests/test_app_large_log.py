"""A log of 2 GB on the page of `oncenter app`: sent, cancelled half-way, sent whole and answered, in 1.5 GB of memory.

The log is five hours of a drive that is repeated, between seven frames of other messages for each of its own, as on
the bus of a truck.
"""

from __future__ import annotations

import http.client
import re
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import gettempdir

import numpy as np
import pytest
from test_app import Page, page

from oncenter.simulate import simulate_to_log

__all__ = ["page"]  # the fixture
pytestmark = [pytest.mark.slow, pytest.mark.linux]

_BYTES = 2_000_000_000
_OTHERS = 7  # frames of other messages for each of the drive's
_CHUNK = 1 << 20
_MEMORY_MAX_MB = 1500.0
_FRAME = re.compile(r" *(\d+)\.(\d{6}) 1  (\w+)x +Rx +d 8 (.{23})")
_ANSWER_S = 1500.0
_MAY_BE_CANCELLED_S = 10.0


def write_large(folder: Path) -> Path:
    """All lines are equally long, so that numpy writes the digits of all times at once."""
    simulate_to_log("weave", 1, folder / "short.asc")
    lines = (folder / "short.asc").read_text(encoding="ascii").splitlines()
    frames = [found.groups() for line in lines if (found := _FRAME.fullmatch(line))]
    own_us = np.array([int(s) * 1_000_000 + int(us) for s, us, _, _ in frames])
    steps = np.diff(own_us, append=own_us[-1] + 10_000) // (1 + _OTHERS)
    times_us = (own_us[:, None] + steps[:, None] * np.arange(1 + _OTHERS)).ravel()
    texts = []
    for _, _, name, data in frames:
        texts.append(f"000000.000000 1  {name + 'x':15} Rx   d 8 {data}\n")
        texts += [f"000000.000000 1  {f'18FF{other:02X}00x':15} Rx   d 8 {data}\n" for other in range(_OTHERS)]
    table = np.frombuffer("".join(texts).encode("ascii"), np.uint8).reshape(len(texts), -1).copy()
    with (folder / "large.asc").open("wb") as file:
        file.write("\n".join(lines[:4]).encode("ascii") + b"\n")
        for repeat in range(-(-_BYTES // table.size)):
            left = times_us + repeat * (own_us[-1] + 20_000)
            for place in (12, 11, 10, 9, 8, 7, 5, 4, 3, 2, 1, 0):
                left, digit = np.divmod(left, 10)
                table[:, place] = 48 + digit
            file.write(table)
    return folder / "large.asc"


def send(page: Page, key: str, log: Path, share: float = 1.0) -> http.client.HTTPConnection:
    """Sends this share of the log."""
    client = http.client.HTTPConnection("127.0.0.1", page.port, timeout=60)
    client.putrequest("PUT", f"/logs/{key}")
    for name, value in (("Content-Length", str(log.stat().st_size)), ("Cookie", f"oncenter-{page.port}={page.key}")):
        client.putheader(name, value)
    client.putheader("Origin", f"http://127.0.0.1:{page.port}")
    client.endheaders()
    left = int(share * log.stat().st_size)
    with log.open("rb") as file:
        while left and (chunk := file.read(min(_CHUNK, left))):
            client.send(chunk)
            left -= len(chunk)
    return client


@contextmanager
def memory_watched(server: int) -> Iterator[list[float]]:
    """The peak memory, MB, of the server and all processes that it started, together."""
    peak, ended = [0.0], threading.Event()

    def watch() -> None:
        while not ended.wait(0.05):
            peak[0] = max(peak[0], sum(map(memory_mb, family(server))))

    thread = threading.Thread(target=watch)
    thread.start()
    try:
        yield peak
    finally:
        ended.set()
        thread.join()


def family(pid: int) -> list[int]:
    try:
        children = [each.read_text().split() for each in Path(f"/proc/{pid}/task").glob("*/children")]
    except OSError:  # it has ended
        return []
    return [pid, *(other for line in children for child in line for other in family(int(child)))]


def memory_mb(pid: int) -> float:
    """Its own memory: the pages of files that it maps can be dropped."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return 0.0
    return sum(int(size) for size in re.findall(r"^Rss(?:Anon|Shmem):\s+(\d+) kB", status, re.MULTILINE)) / 1000.0


def server_of(page: Page) -> int:
    """The process with this trucks folder."""
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = entry.read_bytes().split(b"\0")
        except OSError:
            continue
        if str(page.trucks).encode() in words and b"app" in words:
            return int(entry.parent.name)
    raise AssertionError("the server is not there")


def test_a_log_of_2_gb_is_cancelled_and_answered_in_little_memory(page: Page, tmp_path: Path) -> None:
    log = write_large(tmp_path)
    size = log.stat().st_size
    assert size >= _BYTES
    with memory_watched(server_of(page)) as peak_mb:
        key = page.said("POST", "/logs", {"name": "large.asc", "size": size})["log"]
        cancelled = send(page, key, log, share=0.5)
        part = max(Path(gettempdir()).glob("oncenter-app-*/large.asc"), key=lambda entry: entry.stat().st_mtime)
        assert part.stat().st_size > 0.4 * size  # it is on the disk, not in memory
        page.said("DELETE", f"/logs/{key}")
        cancelled.close()
        until = time.monotonic() + _MAY_BE_CANCELLED_S
        while part.exists():
            assert time.monotonic() < until
            time.sleep(0.1)
        began = time.monotonic()
        key = page.said("POST", "/logs", {"name": "large.asc", "size": size})["log"]
        assert send(page, key, log).getresponse().status == 200
        assert [entry.name for entry in part.parent.glob("*large.asc")] == ["large.asc"]  # nothing is left of the first
        sent_s, sent_mb = time.monotonic() - began, peak_mb[0]
        log.unlink()
        began = time.monotonic()
        asked = {"group": "shipped", "name": "scania_r730_4x2", "logs": [key]}
        answer = page.said("POST", "/answers", asked)["answer"]
        while (said := page.said("GET", f"/answers/{answer}"))["state"] == "running":
            assert time.monotonic() - began < _ANSWER_S
            time.sleep(0.5)
    page.said("DELETE", f"/logs/{key}")  # the fixture kills the page, which leaves its files
    print(
        f"sent in {sent_s:.0f} s, {sent_mb:.0f} MB; answered in {time.monotonic() - began:.0f} s, {peak_mb[0]:.0f} MB"
    )
    assert said["state"] == "done", said
    assert page.ask("GET", f"/answers/{answer}/report")[0] == 200
    assert peak_mb[0] < _MEMORY_MAX_MB
