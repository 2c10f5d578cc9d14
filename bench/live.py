"""A bus of 2,000 frames/s over udp_multicast into `oncenter live`, recorded, with one browser and one slow viewer.

    python bench/live.py --seconds 600 --page   # renews the figures in docs/live.md

Prints what was sent and recorded, how long a frame takes to the page, and what memory is needed over the time.
"""

from __future__ import annotations

import argparse
import base64
import json
import os
import platform
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can
import numpy as np

import oncenter as oc
from oncenter.read import candump
from oncenter.read.frames import Frames, joined, pgn_of
from oncenter.simulate import simulate_to_log

GROUP = "239.74.163.2"
PORT = 5016
FRAMES_PER_S = 2000
BURST_S = 0.002
SLOW_BYTES_PER_S = 20_000
MARK = "<!-- below: written by bench/live.py -->"
DOCS = Path(__file__).parents[1] / "docs" / "live.md"


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--seconds", type=int, default=60)
    arguments.add_argument("--page", action="store_true", help="write the figures into docs/live.md")
    arguments.add_argument("--send", type=Path, help=argparse.SUPPRESS)  # the sender's own process
    chosen = arguments.parse_args()
    if chosen.send:
        send(chosen.send, chosen.seconds)
        return
    with tempfile.TemporaryDirectory() as folder:
        figures = run(Path(folder), chosen.seconds)
    print(figures)
    if chosen.page:
        text = DOCS.read_text(encoding="utf-8").split(MARK)[0]
        DOCS.write_text(f"{text}{MARK}\n\n{figures}", encoding="utf-8")


def run(folder: Path, seconds: int) -> str:
    drive = folder / "drive.log"
    simulate_to_log("thesis_drive", 1, drive)
    kept = folder / "kept.log"
    command = [sys.executable, "-m", "oncenter", "live", GROUP, "--interface", "udp_multicast", "--web"]
    command += ["--port", str(PORT), "--record", str(kept), "--state", str(folder / "state")]
    command += ["--vehicle", "scania_r730_4x2", "--json"]
    live = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for_page()
    sender = subprocess.Popen(
        [sys.executable, __file__, "--send", str(drive), "--seconds", str(seconds)], stdout=subprocess.PIPE, text=True
    )
    memory: list[tuple[float, float]] = []
    watching = threading.Event()
    threads = [
        threading.Thread(target=watch_memory, args=(live.pid, memory, watching)),
        threading.Thread(target=slow_viewer, args=(watching,)),
    ]
    for thread in threads:
        thread.start()
    shown = browser(sender)
    cpu_s = sum(os.sysconf("SC_CLK_TCK") ** -1 * int(x) for x in stat(live.pid)[11:13])
    watching.set()
    live.send_signal(signal.SIGINT)
    given, said = live.communicate(timeout=60)
    for thread in threads:
        thread.join()
    sent = int(sender.stdout.read()) if sender.stdout else 0
    frames = joined(list(candump.chunks(kept, [], lambda fraction: None)))
    signals = oc.read(kept)
    offline = oc.offset(signals, oc.vehicle("scania_r730_4x2")).to_dict()["offset"]
    online = json.loads(given)["offset"]
    answers = f"{in_words(online)}; {in_words(offline)} at {signals.rate_hz:.4g} Hz"
    return table(seconds, sent, frames, latencies(frames, shown), memory, cpu_s, answers, online == offline, said)


def in_words(offset: dict[str, Any]) -> str:
    if offset["value"] is None:
        return str(offset["status"])
    low, high = offset["ci95"]
    return f"{offset['value']:.3f} deg, {low:.3f} to {high:.3f}"


def send(drive: Path, seconds: int) -> None:
    """Frames of a drive at their time, and others' between them; prints how many in all."""
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
        while count < now * FRAMES_PER_S:
            bus.send(next(others))
            count += 1
        time.sleep(BURST_S)
    bus.shutdown()
    print(count)


def message(frames: Frames, k: int) -> can.Message:
    data = int(frames.data[k]).to_bytes(8, "little")
    return can.Message(arbitration_id=int(frames.identifier[k]), is_extended_id=True, data=data)


def fillers(chances: np.random.Generator) -> Iterator[can.Message]:
    """What else is on a bus: groups that are not ours, for ever."""
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


def wait_for_page() -> None:
    until_s = time.monotonic() + 60
    while time.monotonic() < until_s:
        try:
            urllib.request.urlopen(f"http://127.0.0.1:{PORT}/", timeout=5).read()
            return
        except OSError:
            time.sleep(0.2)
    raise SystemExit("the page did not come")


def stat(pid: int) -> list[str]:
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()


def watch_memory(pid: int, memory: list[tuple[float, float]], enough: threading.Event) -> None:
    begin_s = time.monotonic()
    while not enough.wait(1.0):
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
        memory.append((time.monotonic() - begin_s, pages * os.sysconf("SC_PAGE_SIZE") / 1e6))


def slow_viewer(enough: threading.Event) -> None:
    """Takes the socket as the page does, and reads it slower than it is written."""
    page = urllib.request.urlopen(f"http://127.0.0.1:{PORT}/", timeout=30).read().decode()
    token = re.search(r'"token":"([^"]+)"', page)
    assert token
    with socket.socket() as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8192)
        connection.connect(("127.0.0.1", PORT))
        own = f"127.0.0.1:{PORT}"
        key = base64.b64encode(b"0123456789abcdef").decode()
        connection.sendall(
            f"GET /ws HTTP/1.1\r\nHost: {own}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: {key}"
            f"\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: bokeh, {token[1]}\r\nOrigin: http://{own}\r\n\r\n"
            "".encode()
        )
        while not enough.wait(0.1):
            if not connection.recv(SLOW_BYTES_PER_S // 10):
                raise SystemExit("the slow viewer was cut off")


def browser(sender: subprocess.Popen[str]) -> np.ndarray:
    """What was shown until the sender ends: wall time, s, and the stamp of the frame; shape (n, 2)."""
    from playwright.sync_api import sync_playwright

    keep = "window.kept = []; addEventListener('shown', (e) => window.kept.push([Date.now() / 1000, e.detail.frame_s]))"
    rows: list[list[float]] = []
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        view = opened.new_context(bypass_csp=True).new_page()
        view.add_init_script(keep)
        view.goto(f"http://127.0.0.1:{PORT}/")
        while sender.poll() is None:
            time.sleep(1.0)
            rows += view.evaluate("window.kept.splice(0)")
        opened.close()
    return np.array([row for row in rows if row[1] is not None])


def latencies(frames: Frames, shown: np.ndarray) -> np.ndarray:
    """Of each frame with an angle, the time until the page shows it or a newer one, s. The first seconds, in which the
    bus is listened to, are left out."""
    angle = frames.time[frames.extended & (pgn_of(frames.identifier) == 61449)]
    angle = angle[(angle > shown[0, 0] + 5.0) & (angle < shown[-1, 1])]
    newest = np.maximum.accumulate(shown[:, 1])
    return shown[np.searchsorted(newest, angle - 1e-6), 0] - angle


def table(
    seconds: int,
    sent: int,
    frames: Frames,
    late: np.ndarray,
    memory: list[tuple[float, float]],
    cpu_s: float,
    answers: str,
    alike: bool,
    said: str,
) -> str:
    time_s, used = np.array(memory).T
    at = [used[np.searchsorted(time_s, share * time_s[-1])] for share in (0.1, 0.25, 0.5, 0.75, 1.0)]
    later = time_s > 0.5 * time_s[-1]
    slope = float(np.polyfit(time_s[later], used[later], 1)[0]) * 60.0
    dropped = sent - len(frames)
    p50, p99 = 1000 * np.percentile(late, [50, 99])
    lines = [line for line in said.splitlines() if "offset" not in line and "page is at" not in line]
    rows = [
        ("frames sent", f"{sent:,} in {seconds} s", ""),
        ("frames not recorded", f"{dropped}", "0: " + ("met" if dropped == 0 else "missed")),
        ("frame to page, median", f"{p50:.0f} ms", ""),
        ("frame to page, 99th percentile", f"{p99:.0f} ms", "below 200 ms: " + ("met" if p99 < 200 else "missed")),
        ("frame to page, longest", f"{1000 * late.max():.0f} ms", ""),
        ("memory after a tenth, a quarter … all of it", ", ".join(f"{x:.1f}" for x in at) + " MB", "flat"),
        ("its slope in the second half", f"{slope:+.2f} MB/min", ""),
        ("processor time of all of it", f"{100 * cpu_s / time_s[-1]:.0f} % of one core", ""),
        ("offset live; of its record offline", answers, "the same: " + ("met" if alike else "missed")),
        ("lines said", "; ".join(lines) or "none", ""),
    ]
    shared = f"{os.cpu_count()} CPUs shared with other work (load {os.getloadavg()[1]:.1f}), at nice {os.nice(0)}"
    head = f"{processor()}, {shared}; Python {platform.python_version()}."
    body = "\n".join(f"| {name} | {value} | {asked} |" for name, value, asked in rows)
    return f"{head}\n\n| | measured | asked |\n|---|---|---|\n{body}\n"


def processor() -> str:
    found = re.search(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text())
    return found[1].strip() if found else platform.machine()


if __name__ == "__main__":
    main()
