"""A bus of 2,000 frames/s over udp_multicast into `oncenter live`, recorded, with one browser and one slow viewer.

    python bench/live.py --seconds 600 --page           # renews the figures in docs/live.md
    python bench/live.py --seconds 600 --page --crowd   # renews those of the crowd

Prints frames sent and recorded, the delay from frame to page, and the memory over time. With --crowd: a bus of 4,000
frames/s, twenty viewers in total, and a client without the key that requests the page continuously.
"""

from __future__ import annotations

import argparse
import asyncio
import http.client
import json
import os
import platform
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import can
import numpy as np

import oncenter as oc
from oncenter.read import candump
from oncenter.read.frames import Frames, joined, pgn_of
from oncenter.report.browser import find_browser
from oncenter.simulate import simulate_to_log

GROUP = "239.74.163.2"
PORT = 5016
LINE_MAX_BYTES = 1 << 20  # a figure in one line
FRAMES_PER_S, CROWD_FRAMES_PER_S = 2000, 4000
CROWD = 18  # viewers beside the browser and the slow one
FLOOD = 8  # connections of the client that requests continuously
LOST_MAX = 0.001  # of the frames, in the crowd
BURST_S = 0.002
SLOW_BYTES_PER_S = 20_000
MARK = "<!-- below: written by bench/live.py -->"
CROWD_MARK = "<!-- below: written by bench/live.py --crowd -->"
DOCS = Path(__file__).parents[1] / "docs" / "live.md"


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--seconds", type=int, default=60)
    arguments.add_argument("--page", action="store_true", help="write the figures into docs/live.md")
    arguments.add_argument("--crowd", action="store_true", help="twice the frames, twenty viewers, a flood of requests")
    arguments.add_argument("--send", type=Path, help=argparse.SUPPRESS)  # the sender's own process
    arguments.add_argument("--visit", metavar="KEY", help=argparse.SUPPRESS)  # the crowd's own process
    chosen = arguments.parse_args()
    if chosen.send:
        send(chosen.send, chosen.seconds, CROWD_FRAMES_PER_S if chosen.crowd else FRAMES_PER_S)
        return
    if chosen.visit:
        asyncio.run(visit(chosen.seconds, chosen.visit))
        return
    with tempfile.TemporaryDirectory() as folder:
        figures = run(Path(folder), chosen.seconds, chosen.crowd)
    print(figures)
    if chosen.page:
        write(CROWD_MARK if chosen.crowd else MARK, figures)


def write(mark: str, figures: str) -> None:
    """Replaces the figures between that mark and the next one."""
    before, _, after = DOCS.read_text(encoding="utf-8").partition(mark)
    _, marked, rest = after.partition(CROWD_MARK if mark == MARK else "\0")
    DOCS.write_text(f"{before}{mark}\n\n{figures}{chr(10) if marked else ''}{marked}{rest}", encoding="utf-8")


def run(folder: Path, seconds: int, crowd: bool) -> str:
    if find_browser() is None:
        raise SystemExit("needs a browser: sudo apt-get install chromium")
    drive = folder / "drive.log"
    simulate_to_log("thesis_drive", 1, drive)
    kept = folder / "kept.log"
    command = [sys.executable, "-m", "oncenter", "live", GROUP, "--interface", "udp_multicast", "--web"]
    command += ["--port", str(PORT), "--record", str(kept), "--state", str(folder / "state")]
    command += ["--vehicle", "scania_r730_4x2", "--json"]
    with (folder / "said").open("w") as said_file:
        live = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=said_file, text=True)
    key = key_of_page(folder / "said")
    page = page_process_of(live.pid)
    watching = threading.Event()
    slow = threading.Thread(target=slow_viewer, args=(watching, key), daemon=True)
    slow.start()
    own = [sys.executable, __file__, "--seconds", str(seconds)] + (["--crowd"] if crowd else [])
    visitors = subprocess.Popen([*own, "--visit", key], stdout=subprocess.PIPE, text=True) if crowd else None
    memory: list[tuple[float, float]] = []
    watcher = threading.Thread(target=watch_memory, args=(live.pid, memory, watching), daemon=True)
    watcher.start()
    with subprocess.Popen([*own, "--send", str(drive)], stdout=subprocess.PIPE, text=True) as sender:
        shown, losses_shown = browser(sender, key)
        sent = int(sender.stdout.read()) if sender.stdout else 0
    visited = json.loads(visitors.communicate()[0]) if visitors is not None else None
    cpu_s = {"all but the page": cpu_s_of(live.pid), "the page's process": cpu_s_of(page)}
    watching.set()
    live.send_signal(signal.SIGINT)
    given, _ = live.communicate(timeout=60)
    said = (folder / "said").read_text()
    slow.join()
    watcher.join()
    frames = joined(list(candump.chunks(kept, [], lambda fraction: None)))
    signals = oc.read(kept)
    offline = oc.offset(signals, oc.vehicle("scania_r730_4x2")).to_dict()["offset"]
    online = json.loads(given)["offset"]
    answers = f"{in_words(online)}; {in_words(offline)} at {signals.rate_hz:.4g} Hz"
    rows = [
        *(rows_of_crowd(sent, len(frames), said, losses_shown, visited) if visited is not None else []),
        *rows_of(seconds, sent, frames, latencies(frames, shown), memory, cpu_s, answers, online == offline, said),
    ]
    return table(rows)


def rows_of_crowd(sent: int, kept: int, said: str, shown: str, visited: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Results for the frames, the viewers and the client."""
    lost = sent - kept
    last = next((line for line in reversed(said.splitlines()) if "frames in all" in line), "")
    counted = sum(int(count) for count in re.findall(r"(\d+) (?:before oncenter|in oncenter|not recorded)", last))
    share = lost / sent
    per_s = ", ".join(f"{rate:.0f}" for rate in sorted(visited["pictures_per_s"]))
    return [
        ("frames lost", f"{lost} ({100 * share:.3f} %)", "at most 0.1 %: " + verdict(share <= LOST_MAX)),
        ("of them counted", str(counted), "all: " + verdict(counted == lost)),
        ("shown on the page at the end", shown or "nothing", "what was lost: " + verdict(bool(shown) == bool(lost))),
        ("viewers", f"{CROWD} that read at once, a browser, a slow one", ""),
        ("states that each of them got a second", per_s, ""),
        ("continuous requests for the page", f"{visited['asked']:,}, of which {visited['refused']:,} refused", ""),
    ]


def verdict(is_so: bool) -> str:
    return "met" if is_so else "missed"


async def visit(seconds: int, key: str) -> None:
    """Viewers that read like a browser without painting, and a stranger that requests the page continuously."""
    viewers = [asyncio.create_task(view(seconds, key)) for _ in range(CROWD)]
    await asyncio.sleep(2.0)
    with ThreadPoolExecutor(FLOOD) as pool:  # asyncio's default pool has fewer threads, which would delay some clients
        clients = [asyncio.get_running_loop().run_in_executor(pool, ask, seconds) for _ in range(FLOOD)]
        states = await asyncio.gather(*viewers)
        requests, refused = map(sum, zip(*await asyncio.gather(*clients), strict=True))
    per_s = [count / seconds for count in states]
    print(json.dumps({"pictures_per_s": per_s, "asked": requests, "refused": refused}))


async def view(seconds: int, key: str) -> int:
    """How many states came."""
    reader, writer = await asyncio.open_connection("127.0.0.1", PORT, limit=LINE_MAX_BYTES)
    writer.write(events(key))
    count, until_s = 0, time.monotonic() + seconds
    while time.monotonic() < until_s:
        line = await asyncio.wait_for(reader.readline(), 10.0)
        if not line:
            raise SystemExit("a viewer was cut off")
        count += line.startswith(b'data: {"number"')
    writer.close()
    return count


def ask(seconds: int) -> tuple[int, int]:
    """Number of requests without the key, and of those refused."""
    requests = refused = 0
    until_s = time.monotonic() + seconds
    connection = http.client.HTTPConnection("127.0.0.1", PORT, timeout=60)
    while time.monotonic() < until_s:
        connection.request("GET", "/")
        answer = connection.getresponse()
        answer.read()
        requests += 1
        refused += answer.status != 200
    connection.close()
    return requests, refused


def page_process_of(pid: int) -> int:
    (child,) = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return int(child)


def cpu_s_of(pid: int) -> float:
    return sum(int(ticks) for ticks in stat(pid)[11:13]) / os.sysconf("SC_CLK_TCK")


def in_words(offset: dict[str, Any]) -> str:
    if offset["value"] is None:
        return str(offset["status"])
    low, high = offset["ci95"]
    return f"{offset['value']:.3f} deg, {low:.3f} to {high:.3f}"


def send(drive: Path, seconds: int, frames_per_s: int) -> None:
    """Sends the frames of a drive at their time and unrelated frames between them; prints the total number."""
    bus = can.Bus(interface="udp_multicast", channel=GROUP)
    ours = joined(list(candump.chunks(drive, [], lambda fraction: None)))
    since = ours.time - ours.time[0]
    others = fillers(np.random.default_rng(1))
    begin_s, count, sent_ours = time.monotonic(), 0, 0
    while (now := time.monotonic() - begin_s) < seconds:
        due = int(np.searchsorted(since, now, side="right"))
        for k in range(sent_ours, due):
            bus.send(message(ours, k))
        count += due - sent_ours
        sent_ours = due
        while count < now * frames_per_s:
            bus.send(next(others))
            count += 1
        time.sleep(BURST_S)
    bus.shutdown()
    print(count)


def message(frames: Frames, k: int) -> can.Message:
    data = int(frames.data[k]).to_bytes(8, "little")
    return can.Message(arbitration_id=int(frames.identifier[k]), is_extended_id=True, data=data)


def fillers(chances: np.random.Generator) -> Iterator[can.Message]:
    """Endless unrelated frames: parameter groups that oncenter does not use."""
    groups = [0, 61440, 61441, 61443, 61444, 61445, 65247, 65248, 65262, 65263, 65266, 65269, 65270, 65271]
    some = [
        can.Message(
            arbitration_id=0x18000000 | groups[k % len(groups)] << 8 | k % 250,
            is_extended_id=True,
            data=chances.bytes(8),
        )
        for k in range(5000)
    ]
    while True:
        yield from some


def key_of_page(said: Path) -> str:
    """Of the address that is printed once the page is served."""
    until_s = time.monotonic() + 60
    while time.monotonic() < until_s:
        if found := re.search(r"\?key=(\S+)", said.read_text()):
            return found[1]
        time.sleep(0.2)
    raise SystemExit("the page did not come")


def events(key: str) -> bytes:
    """The request of the page for its events."""
    return f"GET /events HTTP/1.1\r\nHost: 127.0.0.1:{PORT}\r\nCookie: oncenter-{PORT}={key}\r\n\r\n".encode()


def stat(pid: int) -> list[str]:
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()


def watch_memory(pid: int, memory: list[tuple[float, float]], enough: threading.Event) -> None:
    begin_s = time.monotonic()
    while not enough.wait(1.0):
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
        memory.append((time.monotonic() - begin_s, pages * os.sysconf("SC_PAGE_SIZE") / 1e6))


def slow_viewer(enough: threading.Event, key: str) -> None:
    """Asks for the events as the page does, and reads them slower than they are written."""
    with socket.socket() as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8192)
        connection.connect(("127.0.0.1", PORT))
        connection.sendall(events(key))
        while not enough.wait(0.1):
            if not connection.recv(SLOW_BYTES_PER_S // 10):
                raise SystemExit("the slow viewer was cut off")


def browser(sender: subprocess.Popen[str], key: str) -> tuple[np.ndarray, str]:
    """Wall time in s and frame stamp of everything shown until the sender ends, shape (n, 2); and the page's text on
    lost frames at the end."""
    from playwright.sync_api import sync_playwright

    keep = "window.kept = []; addEventListener('shown', (e) => window.kept.push([Date.now() / 1000, e.detail.frame_s]))"
    rows: list[list[float]] = []
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=find_browser(), args=["--no-sandbox"])
        view = opened.new_context(bypass_csp=True).new_page()
        view.add_init_script(keep)
        view.goto(f"http://127.0.0.1:{PORT}/?key={key}")
        while sender.poll() is None:
            time.sleep(1.0)
            rows += view.evaluate("window.kept.splice(0)")
        losses = view.text_content("#losses") or ""
        opened.close()
    return np.array([row for row in rows if row[1] is not None]), losses


def latencies(frames: Frames, shown: np.ndarray) -> np.ndarray:
    """The time in s until the page shows each frame with an angle, or a newer one. The first seconds, in which
    oncenter only listens, are left out."""
    angle = frames.time[frames.extended & (pgn_of(frames.identifier) == 61449)]
    angle = angle[(angle > shown[0, 0] + 5.0) & (angle < shown[-1, 1])]
    newest = np.maximum.accumulate(shown[:, 1])
    return shown[np.searchsorted(newest, angle - 1e-6), 0] - angle


def rows_of(
    seconds: int,
    sent: int,
    frames: Frames,
    late: np.ndarray,
    memory: list[tuple[float, float]],
    cpu_s: dict[str, float],
    answers: str,
    alike: bool,
    said: str,
) -> list[tuple[str, str, str]]:
    time_s, used = np.array(memory).T
    at = [used[np.searchsorted(time_s, share * time_s[-1])] for share in (0.1, 0.25, 0.5, 0.75, 1.0)]
    later = time_s > 0.5 * time_s[-1]
    slope = float(np.polyfit(time_s[later], used[later], 1)[0]) * 60.0
    dropped = sent - len(frames)
    p50, p99 = 1000 * np.percentile(late, [50, 99])
    lines = [line for line in said.splitlines() if "offset" not in line and "page is at" not in line]
    shares = ", ".join(f"{where} {100 * used_s / time_s[-1]:.0f} %" for where, used_s in cpu_s.items())
    return [
        ("frames sent", f"{sent:,} in {seconds} s", ""),
        ("frames not recorded", f"{dropped}", "0: " + ("met" if dropped == 0 else "missed")),
        ("frame to page, median", f"{p50:.0f} ms", ""),
        ("frame to page, 99th percentile", f"{p99:.0f} ms", "below 200 ms: " + ("met" if p99 < 200 else "missed")),
        ("frame to page, longest", f"{1000 * late.max():.0f} ms", ""),
        ("memory after a tenth, a quarter … all of it", ", ".join(f"{x:.1f}" for x in at) + " MB", "flat"),
        ("its slope in the second half", f"{slope:+.2f} MB/min", ""),
        ("processor time, of one core", shares, ""),
        ("offset live; of its record offline", answers, "the same: " + ("met" if alike else "missed")),
        ("lines said", "; ".join(lines) or "none", ""),
    ]


def table(rows: list[tuple[str, str, str]]) -> str:
    shared = f"{os.cpu_count()} CPUs shared with other work (load {os.getloadavg()[1]:.1f}), at nice {os.nice(0)}"
    head = f"{processor()}, {shared}; Python {platform.python_version()}."
    body = "\n".join(f"| {name} | {value} | {required} |" for name, value, required in rows)
    return f"{head}\n\n| | measured | asked |\n|---|---|---|\n{body}\n"


def processor() -> str:
    found = re.search(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text())
    return found[1].strip() if found else platform.machine()


if __name__ == "__main__":
    main()
