"""Plants each kept fault in a copy of the project and looks for the check that catches it: docs/faults.md.

A round that was stopped goes on where it was. `run.py NUMBER...` does some faults again.

Usage: run.py [NUMBER...]
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from checks import TEST, Caught, Copy, caught, end_all
from kept import ROOT, Fault, kept_faults
from page import PAGE, ROUND, made, row

Results = dict[str, dict[str, Any]]  # by the number of a fault

AT_A_TIME = 2
BEGUN = ROOT / "build" / "faults" / "round.json"
SHARE_MIN = 0.8  # of the faults that are not excused, in `make test`


class Round:
    """The results so far, kept after each fault."""

    def __init__(self, commit: str, date: str, spent_s: float = 0.0, results: Results | None = None) -> None:
        self.commit, self.date, self.results = commit, date, results or {}
        self._spent_before_s, self._began, self._writing = spent_s, time.monotonic(), threading.Lock()

    @classmethod
    def begun(cls) -> Round:
        """The one that was stopped in this commit, or a new one."""
        command = ["git", "describe", "--always", "--dirty", "--abbrev=10"]
        commit = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
        if BEGUN.is_file():
            stopped = cls(**json.loads(BEGUN.read_text(encoding="utf-8")))
            if stopped.commit == commit:
                return stopped
        return cls(commit, time.strftime("%Y-%m-%d"))

    @property
    def spent_s(self) -> int:
        return round(self._spent_before_s + time.monotonic() - self._began)

    def add(self, fault: Fault, found: Caught | None, seconds: float) -> None:
        result = {"check": found.check, "level": found.level} if found else {"check": "", "level": ""}
        with self._writing:
            self.results[str(fault.number)] = result | {"seconds": round(seconds)}
            self.keep(BEGUN)
            print(row(fault, result), flush=True)

    def keep(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        whole = {"commit": self.commit, "date": self.date, "spent_s": self.spent_s, "results": self.results}
        new = path.with_suffix(".new")
        new.write_text(json.dumps(whole, indent=1, ensure_ascii=False) + "\n", encoding="utf-8", newline="\n")
        new.replace(path)

    def ends_with_its_processes(self, folder: str) -> None:
        """Also when it is stopped; a check that is ended then has caught nothing."""

        def stop(*_: object) -> None:
            self._writing.acquire()
            end_all()
            shutil.rmtree(folder, ignore_errors=True)
            os._exit(1)

        signal.signal(signal.SIGINT, stop)
        signal.signal(signal.SIGTERM, stop)


def last_checks() -> dict[int, str]:
    """Which check caught each fault in the last complete round: it is tried first."""
    if not ROUND.is_file():
        return {}
    results = json.loads(ROUND.read_text(encoding="utf-8"))["results"]
    return {int(number): result["check"] for number, result in results.items()}


def copies(folder: Path) -> tuple[Copy, list[Copy]]:
    """One without any fault and some to plant faults in; in the first, what compiles and checks types is green."""
    control = Copy.made(folder / "control")
    red = control.compile() or control.types()
    if red:
        raise SystemExit(f"red without a fault:\n{red}")
    return control, [control.another(folder / f"copy{k}") for k in range(AT_A_TIME)]


def do(faults: list[Fault], round_: Round) -> None:
    waiting = iter(faults)  # of both copies
    with tempfile.TemporaryDirectory(prefix="faults-") as folder:
        round_.ends_with_its_processes(folder)
        control, others = copies(Path(folder))
        with ThreadPoolExecutor(AT_A_TIME) as pool:
            list(pool.map(lambda copy: work(waiting, copy, control, round_), others))


def work(waiting: Iterator[Fault], copy: Copy, control: Copy, round_: Round) -> None:
    last = last_checks()
    for fault in waiting:
        began = time.monotonic()
        found = caught(fault, copy, control, last.get(fault.number, ""))
        round_.add(fault, found, time.monotonic() - began)


def main() -> None:
    faults = [fault for fault in kept_faults() if not fault.excused]
    numbers = set(map(int, sys.argv[1:]))
    round_ = Round.begun()
    if numbers:
        do([fault for fault in faults if fault.number in numbers], round_)
        return
    do([fault for fault in faults if str(fault.number) not in round_.results], round_)
    round_.keep(ROUND)
    BEGUN.unlink()
    PAGE.write_text(made(), encoding="utf-8", newline="\n")
    print(f"{round_.spent_s / 60:.0f} min, load average {os.getloadavg()[0]:.1f}; see {PAGE.relative_to(ROOT)}")
    results = [round_.results[str(fault.number)] for fault in faults]
    survivors = [fault.number for fault in faults if not round_.results[str(fault.number)]["check"]]
    in_test = sum(result["level"] == TEST for result in results)
    if survivors or in_test < SHARE_MIN * len(faults):
        raise SystemExit(f"no check catches the faults {survivors}; make test catches {in_test} of {len(faults)}")


if __name__ == "__main__":
    main()
