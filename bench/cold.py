"""`oncenter offset` on one drive in each format, each time in a new process: seconds on the wall and of processors.

    python bench/cold.py [--scenario NAME] [--rounds N] [--formats .log,.asc] [--json]

Seconds of processors count the child process that reads a log by other people's libraries as well. Formats take turns;
the first round, in which Python compiles what it imports, does not count.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

MAX_S = {".log": 0.5, ".csv": 0.5, ".parquet": 0.5, ".mf4": 0.8, ".blf": 0.7, ".asc": 0.7, ".trc": 0.7}  # asked of us
_SUBREAPER = 36  # of prctl: a reader that outlives its parent is ours to wait for


def oncenter(*arguments: str) -> None:
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    subprocess.run(
        [sys.executable, "-m", "oncenter", *arguments], check=True, stdout=subprocess.DEVNULL, env=environment
    )


def timed(log: Path) -> tuple[float, float]:
    """Seconds on the wall and of processors."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    oncenter("offset", str(log), "--vehicle", "scania_r730_4x2")
    wall = time.perf_counter() - began
    with contextlib.suppress(ChildProcessError):
        while True:
            os.waitpid(-1, 0)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenario", default="thesis_drive")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--formats", default=",".join(MAX_S))
    parser.add_argument("--json", action="store_true", help="print an object instead of a table")
    given = parser.parse_args()
    with contextlib.suppress(OSError, AttributeError):  # Linux alone has it
        ctypes.CDLL(None).prctl(_SUBREAPER, 1, 0, 0, 0)
    seconds: dict[str, list[tuple[float, float]]] = {suffix: [] for suffix in given.formats.split(",")}
    with tempfile.TemporaryDirectory() as folder:
        for suffix in seconds:
            oncenter("simulate", given.scenario, "--output", str(Path(folder) / f"drive{suffix}"))
        for _ in range(given.rounds + 1):
            for suffix, rounds in seconds.items():
                rounds.append(timed(Path(folder) / f"drive{suffix}"))
    rows = [
        {
            "log": suffix,
            "wall_s": statistics.median(wall for wall, _ in rounds[1:]),
            "cpu_s": statistics.median(cpu for _, cpu in rounds[1:]),
            "least_cpu_s": min(cpu for _, cpu in rounds[1:]),
            "asked_s": MAX_S[suffix],
        }
        for suffix, rounds in seconds.items()
    ]
    if given.json:
        print(json.dumps({"scenario": given.scenario, "load": os.getloadavg(), "logs": rows}, indent=2))
        return
    print(f"{given.scenario}, median of {given.rounds}; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} CPUs\n")
    print("| log | wall, s | asked, s | processors, s | least |\n|---|--:|--:|--:|--:|")
    for row in rows:
        times = " | ".join(f"{row[name]:.2f}" for name in ("wall_s", "asked_s", "cpu_s", "least_cpu_s"))
        print(f"| {row['log']} | {times} |")


if __name__ == "__main__":
    main()
