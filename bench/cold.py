"""`oncenter offset` on one drive in each format, each time in a new process: wall time, CPU time, memory, and steps.

    python bench/cold.py [--scenario NAME] [--formats .log,.asc] [--rounds N] [--folder FOLDER] [--json]

CPU time and memory include child processes, which read the formats of third-party libraries. Formats take turns; the
first round, in which Python compiles its imports, does not count. Steps are from separate runs with `cold_steps.py`.
This process imports nothing heavy, because a child's peak memory starts at its parent's.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

MAX_S = {".log": 0.5, ".csv": 0.5, ".parquet": 0.5, ".mf4": 0.8, ".blf": 0.7, ".asc": 0.7, ".trc": 0.7}  # requirements
FLOORS = {  # minimum imports of every answer
    "Python": "pass",
    "Python with numpy and pydantic": "import numpy; from pydantic import BaseModel",
}
STEPS = ("start_s", "reading_s", "answering_s")
TRUCK = "scania_r730_4x2"
_HERE = Path(__file__).parent
_SUBREAPER = 36  # of prctl: makes this process the parent of readers that outlive theirs

Row = dict[str, Any]


@dataclass(frozen=True)
class Spent:
    """Resources of a process and its children."""

    wall_s: float
    cpu_s: float
    peak_mb: float


def timed(*command: str) -> Spent:
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    others = _children()
    began = time.perf_counter()
    process = subprocess.Popen([sys.executable, *command], stdout=subprocess.DEVNULL, env=environment)
    _, status, used = os.wait4(process.pid, 0)
    wall = time.perf_counter() - began
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        sys.exit(f"{' '.join(command)}: exit code {process.returncode}")
    every = [used]
    while left := _children() - others:
        every += [os.wait4(child, 0)[2] for child in left]
    per_mb = 1 << 20 if sys.platform == "darwin" else 1 << 10
    return Spent(
        wall,
        sum(each.ru_utime + each.ru_stime for each in every),
        sum(each.ru_maxrss for each in every) / per_mb,
    )


def _children() -> set[int]:
    """The children of this process; none without /proc."""
    return {int(child) for file in Path("/proc/self/task").glob("*/children") for child in file.read_text().split()}


def own_vehicle(log: Path) -> Path:
    """The vehicle file beside a log whose signals have other names."""
    return log.with_name(f"{log.name}.toml")


def vehicle_of(log: Path) -> str:
    """A vehicle file, or the name of a shipped one."""
    own = own_vehicle(log)
    return str(own) if own.exists() else TRUCK


def arguments_of(log: Path) -> tuple[str, ...]:
    return ("offset", str(log), "--vehicle", vehicle_of(log))


def steps(log: Path, said: Path) -> dict[str, float]:
    """Seconds for start and imports, for reading, and for the answer; together the total."""
    spent = timed(str(_HERE / "cold_steps.py"), str(said), *arguments_of(log))
    found: dict[str, float] = json.loads(said.read_text(encoding="utf-8"))
    return {"start_s": spent.wall_s - found["reading_s"] - found["answering_s"], **found}


def table(logs: dict[str, Path], rounds: int, folder: Path) -> list[Row]:
    """Medians of the rounds, by format and for the minimum imports."""
    commands = {name: ("-c", code) for name, code in FLOORS.items()}
    commands |= {suffix: ("-m", "oncenter", *arguments_of(log)) for suffix, log in logs.items()}
    spent: dict[str, list[Spent]] = {name: [] for name in commands}
    of_steps: dict[str, list[dict[str, float]]] = {suffix: [] for suffix in logs}
    for _ in range(rounds + 1):
        for name, command in commands.items():
            spent[name].append(timed(*command))
        for suffix, log in logs.items():
            of_steps[suffix].append(steps(log, folder / "steps.json"))
    return [
        {
            "log": name,
            "bytes": logs[name].stat().st_size if name in logs else None,
            "wall_s": statistics.median(each.wall_s for each in every[1:]),
            "cpu_s": statistics.median(each.cpu_s for each in every[1:]),
            "least_cpu_s": min(each.cpu_s for each in every[1:]),
            "peak_mb": statistics.median(each.peak_mb for each in every[1:]),
            "asked_s": MAX_S.get(name),
            **{step: statistics.median(each[step] for each in of_steps[name][1:]) for step in STEPS if name in logs},
        }
        for name, every in spent.items()
    ]


def simulated(scenario: str, suffixes: list[str], folder: Path) -> dict[str, Path]:
    logs = {suffix: folder / f"drive{suffix}" for suffix in suffixes}
    for log in logs.values():
        timed("-m", "oncenter", "simulate", scenario, "--output", str(log))
    return logs


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", default="thesis_drive")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--formats", default=",".join(MAX_S))
    parser.add_argument("--folder", type=Path, help="with logs drive.log, drive.csv, … of those formats")
    parser.add_argument("--json", action="store_true", help="print an object instead of a table")
    given = parser.parse_args()
    with contextlib.suppress(OSError, AttributeError):  # only on Linux
        ctypes.CDLL(None).prctl(_SUBREAPER, 1, 0, 0, 0)
    suffixes = given.formats.split(",")
    with tempfile.TemporaryDirectory() as name:
        folder = given.folder
        logs = (
            simulated(given.scenario, suffixes, Path(name))
            if folder is None
            else {suffix: folder / f"drive{suffix}" for suffix in suffixes}
        )
        rows = table(logs, given.rounds, Path(name))
    if given.json:
        print(json.dumps({"scenario": given.scenario, "load": os.getloadavg(), "logs": rows}, indent=2))
        return
    print(f"{given.scenario}, median of {given.rounds}; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} CPUs\n")
    print("| log | wall, s | asked, s | processors, s | least |\n|---|--:|--:|--:|--:|")
    for row in rows:
        required_s = "" if row["asked_s"] is None else f"{row['asked_s']:.2f}"
        print(f"| {row['log']} | {row['wall_s']:.2f} | {required_s} | {row['cpu_s']:.2f} | {row['least_cpu_s']:.2f} |")


if __name__ == "__main__":
    main()
