"""A night answers every good log of a fleet, names every poisonous one, and ends so however often it is killed.

`python tests/test_fleet_poison.py` shows what comes of each kind, and kills ten nights of child processes and of Ray.
"""

from __future__ import annotations

import importlib.util
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from poison_fleet import ANSWERED, NAMED, POISON, kind_of, write_poison_fleet
from two_trucks import tables
from watched import Ended, oncenter, watch

from oncenter.files.child import READER_DEATHS
from oncenter.fleet import engines, run
from oncenter.fleet.files import LogFile

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("poison")]  # one process makes the fleet

# Rows that are put down in each night before it is killed.
ROWS_BEFORE_KILLS = (0, 1, 2, 3, 4, 4, 4, 4, 4, 4)
SOME_KILLS = (0, 2, 4, 4)
NIGHT_S, NIGHT_MIB = 300.0, 8192.0  # on a machine that has other work

# A night that says when it begins to answer, and when each row is put down.
NIGHT = """
import sys
from oncenter.fleet import engines, run

logs, vehicles, output, engine = sys.argv[1:]
answer = engines.on_ray(None, workers=2) if engine == "ray" else engines.processes
engines._LOGS_WHILE_RAY_BEGINS, engines._LOGS_WHILE_RAY_ENDS = 6, 6  # those between are Ray's

def reporting(work, waiting):
    print(flush=True)
    for done in answer(work, waiting):
        yield done
        print(flush=True)

run([logs], vehicles, output, engine=reporting)
"""


def places(fleet: Path) -> list[str]:
    return [str(fleet / "logs"), "--vehicles", str(fleet / "vehicles")]


def night(fleet: Path, output: Path, *options: str) -> Ended:
    command = oncenter("fleet", "run", *places(fleet), "--output", output, *options)
    return watch(command, kill_s=NIGHT_S, kill_mib=NIGHT_MIB)


def killed_nights(fleet: Path, output: Path, rows_before_kills: Sequence[int], engine: str) -> None:
    """Each is killed in the middle of its reading, by turns with all its children and without them."""
    for number, rows in enumerate(rows_before_kills):
        command = [sys.executable, "-c", NIGHT, str(fleet / "logs"), str(fleet / "vehicles"), str(output), engine]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, start_new_session=True)
        assert process.stdout is not None
        with process.stdout as said:
            for _ in range(1 + rows):
                assert said.readline() == b"\n"
            time.sleep(0.05 * number)  # in other places of a log
            (os.kill if number % 2 else os.killpg)(process.pid, signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL


def rows_by_log(output: Path) -> dict[str, dict[str, Any]]:
    return {row["log"]: row for row in pl.read_parquet(output / "drives.parquet").to_dicts()}


def page_and_tables(output: Path) -> dict[str, bytes]:
    return tables(output) | {"index.html": (output / "index.html").read_bytes()}


def noting(logs_read: list[str]) -> Callable[..., Iterator[tuple[LogFile, dict[str, Any]]]]:
    """An engine that notes which logs it is given to read."""

    def engine(
        work: Callable[[LogFile], dict[str, Any]], logs: Iterable[LogFile]
    ) -> Iterator[tuple[LogFile, dict[str, Any]]]:
        def noted() -> Iterator[LogFile]:
            for log in logs:
                logs_read.append(log.uri)
                yield log

        return engines.processes(work, noted())

    return engine


@pytest.fixture(scope="module")
def poisoned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("poisoned")
    write_poison_fleet(root)
    return root


@pytest.fixture(scope="module")
def first(poisoned: Path) -> tuple[Path, Ended]:
    """What a night makes of it that nothing disturbs."""
    output = poisoned / "first"
    return output, night(poisoned, output)


def test_all_good_logs_are_answered_and_each_poisonous_one_is_named_with_its_reason(
    poisoned: Path, first: tuple[Path, Ended]
) -> None:
    output, ended = first
    assert (ended.code, ended.err.count("Traceback")) == (0, 0)
    assert f"{ANSWERED + NAMED} logs: {ANSWERED} answered now, {NAMED} without an answer" in ended.out
    rows = rows_by_log(output)
    assert len(rows) == ANSWERED + NAMED
    named = {log: row for log, row in rows.items() if row["error_code"] is not None}
    assert len(named) == NAMED == len(POISON)
    for log, row in named.items():
        kind = kind_of(log)
        assert kind is not None and row["error_code"] == kind.code, (log, row["error"])
        assert Path(log).name in row["error"] and row["offset_deg"] is None
    assert all(row["offset_deg"] is not None for log, row in rows.items() if log not in named)
    died = {log: row["error"] for log, row in named.items() if row["error_code"] in READER_DEATHS}
    assert {row["error_code"] for row in named.values()} >= set(READER_DEATHS)
    assert all(error in ended.out for error in died.values())
    assert {
        each["log"]: each["error"] for each in json.loads((output / "metrics.json").read_text())["poisonous"]
    } == died
    assert not Path("CODE_RAN").exists()


def test_the_next_night_says_the_same_and_reads_none_and_retry_reads_those_whose_readers_died(
    poisoned: Path, first: tuple[Path, Ended]
) -> None:
    output, _ = first
    before, logs_read = page_and_tables(output), list[str]()
    summary = run([str(poisoned / "logs")], poisoned / "vehicles", output, engine=noting(logs_read))
    assert logs_read == [] and (summary.logs_answered, summary.logs_refused) == (0, 0)
    assert page_and_tables(output) == before
    died = sorted(log for log, row in rows_by_log(output).items() if row["error_code"] in READER_DEATHS)
    assert [each["log"] for each in sorted(summary.poisonous, key=lambda each: each["log"])] == died
    summary = run([str(poisoned / "logs")], poisoned / "vehicles", output, engine=noting(logs_read), retry=True)
    assert sorted(logs_read) == died and summary.logs_refused == len(died)
    assert page_and_tables(output) == before


def test_nights_that_are_killed_and_one_that_is_not_end_as_one_undisturbed(
    poisoned: Path, first: tuple[Path, Ended]
) -> None:
    output = poisoned / "killed"
    killed_nights(poisoned, output, SOME_KILLS, "processes")
    ended = night(poisoned, output)
    assert ended.code == 0
    summary = json.loads((output / "metrics.json").read_text())
    assert summary["logs_answered"] + summary["logs_refused"] <= ANSWERED + NAMED - sum(SOME_KILLS)
    assert page_and_tables(output) == page_and_tables(first[0])


def test_a_night_of_ray_ends_as_one_of_child_processes(poisoned: Path, first: tuple[Path, Ended]) -> None:
    pytest.importorskip("ray", reason="Ray is not installed: pip install 'oncenter[ray]'")
    if "libasan" in os.environ.get("LD_PRELOAD", ""):
        pytest.skip("Ray's processes do not always begin under the sanitizers; what they call is tested without Ray")
    output = poisoned / "ray"
    command = [sys.executable, "-c", NIGHT, str(poisoned / "logs"), str(poisoned / "vehicles"), str(output), "ray"]
    assert watch(command, kill_s=NIGHT_S, kill_mib=NIGHT_MIB).code == 0
    assert page_and_tables(output) == page_and_tables(first[0])


def show() -> None:
    """What came of each kind of poison, and whether nights that are killed end alike."""
    with tempfile.TemporaryDirectory() as folder:
        fleet = Path(folder)
        write_poison_fleet(fleet)
        output = fleet / "first"
        ended = night(fleet, output)
        print(ended.out)
        print(f"exit code {ended.code}, {ended.seconds:.0f} s, at most {ended.peak_mib:.0f} MiB at once\n")
        rows = rows_by_log(output)
        for log, row in sorted(rows.items(), key=lambda each: Path(each[0]).name):
            kind = kind_of(log)
            if kind is not None or row["error_code"] is not None:
                about = kind.about if kind else "GOOD"
                print(
                    f"{about:34} {row['error_code'] or 'ANSWERED':20} {(row['error'] or '').replace(folder, '')[:120]}"
                )
        for engine in ("processes", *(("ray",) if importlib.util.find_spec("ray") else ())):
            killed = fleet / f"killed-{engine}"
            killed_nights(fleet, killed, ROWS_BEFORE_KILLS, engine)
            last = night(fleet, killed, "--engine", engine)
            same = page_and_tables(killed) == page_and_tables(output)
            print(f"\n{engine}: killed {len(ROWS_BEFORE_KILLS)} times, then {last.out.splitlines()[0]}")
            print("the same bytes as undisturbed" if same else "OTHER BYTES than undisturbed")


if __name__ == "__main__":
    show()
