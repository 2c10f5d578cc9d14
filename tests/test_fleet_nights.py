"""Many nights over one fleet: whatever moves, and whatever fails, the last night's tables are those of a quiet fleet.

`python tests/test_fleet_nights.py` does it with 2,000 drives of 200 trucks, of which 5 % move, and in 30 nights with a
fault each. Drives are of 100 s at 20 Hz: real logs, really answered, of 60 kB.
"""

from __future__ import annotations

import json
import os
import random
import resource
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from test_estimate import steady_drive
from two_trucks import DAY_S, MONDAY_S, tables

from oncenter.fleet import Summary, run
from oncenter.fleet.ledger import LEDGER

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("nights")]

SOME_TRUCKS, SOME_DRIVES = 8, 5
ALL_TRUCKS, ALL_DRIVES = 200, 10
MOVED_SHARE = 0.05
SEED = 2026
_EVERY = 5  # of 100 Hz

# A night that may have a clock that is a day behind, and that prints a line for each row.
NIGHT = """
import sys, time
from oncenter.fleet import engines, run

logs, vehicles, output, behind_s = sys.argv[1:]
now, now_ns = time.time, time.time_ns
time.time = lambda: now() - float(behind_s)
time.time_ns = lambda: now_ns() - int(float(behind_s) * 1e9)

def reporting(work, waiting):
    for done in engines.processes(work, waiting):
        yield done
        print(flush=True)

run(logs.split(), vehicles, output, engine=reporting)
"""


@dataclass(frozen=True)
class Fleet:
    root: Path

    @property
    def logs(self) -> Path:
        return self.root / "logs"

    def night(self, *places: str, output: str = "out") -> Summary:
        return run(places or [str(self.logs)], self.root / "vehicles", self.root / output)

    def paths(self) -> list[Path]:
        return sorted(self.logs.rglob("*.parquet"))


def written(root: Path, trucks: int, drives: int) -> Fleet:
    """A quarter of the trucks is known by the VIN in their logs, the others by their folders; one drive a day."""
    (root / "vehicles").mkdir()
    text = "wheelbase_m = 3.7\nsteering_ratio = 19.3\n"
    (root / "vehicles" / "YS2R4X2.toml").write_text(text)
    fleet = Fleet(root)
    for number in range(trucks):
        by_vin = number % 4 == 0
        name = f"YS2R4X2{number:010}" if by_vin else f"depot-{number}"
        folder = fleet.logs / ("pool" if by_vin else name)
        folder.mkdir(parents=True, exist_ok=True)
        if not by_vin:
            (root / "vehicles" / f"{name}.toml").write_text(text)
        for day in range(drives):
            table = drive(number, day, remounted=number % 10 == 1 and 2 * day >= drives)
            table.write_parquet(folder / f"{number}-{day}.parquet", metadata={"vin": name} if by_vin else {})
    return fleet


def drive(number: int, day: int, *, remounted: bool) -> pl.DataFrame:
    random = np.random.default_rng((SEED, number, day))
    offset_deg = (number % 7 - 3.0) / 2.0 + (4.0 if remounted else 0.0)
    table = steady_drive(offset_deg=offset_deg, minutes=100.0 / 60.0, start_s=MONDAY_S + day * DAY_S).table
    table = table.gather_every(_EVERY)
    noise = random.normal(0.0, 0.003, table.height)
    return table.with_columns(pl.col("steering_wheel_angle_rad") + noise, pl.col("yaw_rate_rad_s") + noise / 20.0)


def trucks_of(output: Path) -> bytes:
    return b"".join((output / f"{name}.parquet").read_bytes() for name in ("trucks", "changes"))


def moved(fleet: Fleet, some: Sequence[Path], seed: int) -> None:
    """Copies, moves, renames by turns; a log that its folder names stays below one of that name."""
    for number, path in enumerate(some):
        other = fleet.logs / f"disk{seed}-{number % 3}" / path.parent.name
        other.mkdir(parents=True, exist_ok=True)
        copy, move, rename = shutil.copy, shutil.move, path.rename
        kind = number % 4
        if kind == 0:
            copy(path, path.with_name(f"copy-{seed}-{path.name}"))
        elif kind == 1:
            move(path, other / path.name)
        elif kind == 2:
            rename(path.with_name(f"{seed}-renamed {path.name}"))
        else:
            copy(path, other / path.name)


def moved_fleet_is_the_same(fleet: Fleet) -> str:
    """What was measured, as a line; raises AssertionError where a truck differs."""
    first = fleet.night()
    assert first.refused == {} and first.logs_answered == first.drives
    before = trucks_of(fleet.root / "out")
    some = random.Random(SEED).sample(fleet.paths(), max(4, round(MOVED_SHARE * first.drives)))
    moved(fleet, some, 1)
    (fleet.root / "link").symlink_to(fleet.logs)
    here = os.getcwd()
    os.chdir(fleet.root)
    try:
        for places in (["logs"], ["./logs", "link/pool"], [str(fleet.logs / ".." / "logs")], ["link"]):
            summary = fleet.night(*places)
            assert (summary.logs_answered, summary.drives, summary.copies) == (0, first.drives, 0), places
            assert trucks_of(fleet.root / "out") == before, places
    finally:
        os.chdir(here)
    anew = fleet.night(output="anew")
    assert anew.logs_answered + anew.logs_copied == anew.logs_found and trucks_of(fleet.root / "anew") == before
    return (
        f"{first.drives} drives of {first.trucks} trucks, {len(some)} of them copied, moved or renamed, then given by"
        f" four paths: trucks and changes are the same bytes, 0 answered again; first night {first.seconds:.0f} s, the"
        f" last {summary.seconds:.1f} s"
    )


# -- faults


@dataclass
class Nights:
    """Nights that each get new logs and have a fault."""

    fleet: Fleet
    arriving: list[Path]
    random: random.Random

    def arrive(self, count: int) -> None:
        for path in self.arriving[:count]:
            target = self.fleet.logs / path.relative_to(self.fleet.root / "later")
            target.parent.mkdir(parents=True, exist_ok=True)
            path.rename(target)
        del self.arriving[:count]

    def begun(self, places: str = "", behind_s: float = 0.0, **options: Any) -> subprocess.Popen[bytes]:
        given = [places or str(self.fleet.logs), str(self.fleet.root / "vehicles"), str(self.output), str(behind_s)]
        return subprocess.Popen(
            [sys.executable, "-c", NIGHT, *given], stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options
        )

    @property
    def output(self) -> Path:
        return self.fleet.root / "out"

    def killed(self) -> int:
        night = self.begun()
        assert night.stdout is not None
        for _ in range(self.random.randrange(1, 6)):
            night.stdout.readline()
        time.sleep(self.random.random() * 0.3)
        night.kill()
        return ended(night)

    def disk_is_full(self) -> int:
        """No file grows beyond a size: writing fails as on a full disk."""
        size = self.random.randrange(1, 200_000)
        return ended(self.begun(preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))))

    def worker_is_lost(self) -> int:
        night = self.begun()
        assert night.stdout is not None
        night.stdout.readline()
        # one: a log whose second reader is killed as well waits for the next night
        os.kill(self.random.choice(children_of(night.pid)), signal.SIGKILL)
        return ended(night)

    def row_is_damaged(self) -> int:
        damage = self.random.choice(("row = '{'", "truck = NULL", "start = 'x'", "row = x'ff'", "log = NULL"))
        with closing(sqlite3.connect(self.output / LEDGER)) as file, file:
            file.execute(
                f"UPDATE drive SET {damage} WHERE rowid IN (SELECT rowid FROM drive ORDER BY random() LIMIT 2)"
            )
        return ended(self.begun())

    def ledger_is_damaged(self) -> int:
        path = self.output / LEDGER
        content = bytearray(path.read_bytes())
        for _ in range(self.random.randrange(1, 4)):
            at = self.random.randrange(len(content))
            content[at : at + 700] = self.random.randbytes(len(content[at : at + 700]))
        path.write_bytes(content)
        return ended(self.begun())

    def clock_is_behind(self) -> int:
        return ended(self.begun(behind_s=DAY_S * self.random.randrange(1, 400)))

    def bucket_is_not_readable(self) -> int:
        bucket = "s3://none/logs?scheme=http&endpoint_override=127.0.0.1:9&connect_timeout=1&request_timeout=1"
        environment = os.environ | {"AWS_ACCESS_KEY_ID": "a", "AWS_SECRET_ACCESS_KEY": "b", "AWS_MAX_ATTEMPTS": "1"}
        return ended(self.begun(f"{self.fleet.logs} {bucket}", env=environment))


def ended(night: subprocess.Popen[bytes]) -> int:
    _, err = night.communicate(timeout=300)
    # the script has no command line that makes one line of an error
    assert b"OncenterError" in err or b"Traceback" not in err, err.decode()
    return night.returncode


def children_of(pid: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()] + [
        int(child)
        for task in Path(f"/proc/{pid}/task").iterdir()
        if task.name != str(pid)
        for child in (task / "children").read_text().split()
    ]


FAULTS: tuple[Callable[[Nights], int], ...] = (
    Nights.killed,
    Nights.disk_is_full,
    Nights.worker_is_lost,
    Nights.row_is_damaged,
    Nights.clock_is_behind,
    Nights.bucket_is_not_readable,
    Nights.ledger_is_damaged,
)


def faulty_nights_end_as_quiet_ones(fleet: Fleet, count: int) -> str:
    """What was measured; raises AssertionError where the last night's tables differ."""
    fleet.night(output="quiet")
    quiet = tables(fleet.root / "quiet")
    later = fleet.root / "later"
    fleet.logs.rename(later)
    nights = Nights(fleet, sorted(later.rglob("*.parquet"), key=lambda path: path.name), random.Random(SEED))
    each = len(nights.arriving) // (count + 1)
    nights.arrive(each)
    fleet.night()
    codes: dict[str, list[int]] = {}
    for number in range(count):
        nights.arrive(each)
        fault = FAULTS[number % len(FAULTS)]
        codes.setdefault(fault.__name__, []).append(fault(nights))
    nights.arrive(len(nights.arriving))
    last = fleet.night()
    assert tables(fleet.root / "out") == quiet
    asides = len(list(nights.output.glob("ledger-damaged-*.sqlite")))
    return (
        f"{count} nights with a fault each over {last.drives} drives: the last night's tables are the same bytes; exit "
        f"codes {json.dumps(codes)}; {asides} ledgers set apart"
    )


def test_logs_that_are_copied_moved_renamed_and_given_by_other_paths_change_no_truck(tmp_path: Path) -> None:
    moved_fleet_is_the_same(written(tmp_path, SOME_TRUCKS, SOME_DRIVES))


@pytest.mark.linux
def test_nights_with_a_fault_each_end_as_quiet_ones(tmp_path: Path) -> None:
    faulty_nights_end_as_quiet_ones(written(tmp_path, SOME_TRUCKS, SOME_DRIVES), len(FAULTS))


def show() -> None:
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        (root / "moved").mkdir()
        print(moved_fleet_is_the_same(written(root / "moved", ALL_TRUCKS, ALL_DRIVES)), flush=True)
        (root / "nights").mkdir()
        print(faulty_nights_end_as_quiet_ones(written(root / "nights", 16, 6), 30))


if __name__ == "__main__":
    show()
