"""Runs commands while each call that needs disk space fails once; test_full_disk.py checks the resulting files.

`python full_disk.py FOLDER [--every-call]` prints an object: by case, the results of its runs. It is a separate
program, because full_disk.c is preloaded at the start of a process, and one process for all of the hundreds of runs.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import hashlib
import io
import json
import os
import shutil
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from itertools import groupby
from pathlib import Path
from typing import Any

from test_estimate import steady_drive
from two_trucks import write_fleet

from oncenter import cli
from oncenter.files.log_formats import WRITTEN

TRUCK = "scania_r730_4x2"
SUFFIXES = tuple(suffix[1:] for suffix in WRITTEN)
SCENARIO = """about = "short"
base = "thesis_drive"
[drive]
duration_s = 6.0
standing_at_start_s = 2.0
standing_at_end_s = 2.0
"""
EVERY_CALL = "--every-call"  # hours instead of seconds
OLD = b"what stood there before\n"
WATCHED = "out"  # the folder below which calls fail
OF_A_RUN = ("seconds", "logs_per_second", "peak_memory_mb")  # metrics that differ from run to run

Run = dict[str, Any]


def main(root: Path) -> dict[str, list[Run]]:
    """The runs of each case: an undisturbed one, then one for each of its calls, in which that call fails."""
    (root / "short.toml").write_text(SCENARIO)
    steady_drive(minutes=0.5).table.write_parquet(root / "drive.parquet")
    write_fleet(root)
    without_what_is_slow(root)
    out = root / WATCHED
    drive = f"{root}/drive.parquet --vehicle {TRUCK}"
    seen = {
        f"simulate .{suffix}": calls_fail(
            f"simulate {root}/short.toml --output {out}/x.{suffix}",
            lambda names=(f"x.{suffix}", "x.truth.parquet", "x.truth.toml"): put_old(out, names),
            out,
        )
        for suffix in SUFFIXES
    }
    for name, words, file in (
        ("angle .csv", f"angle {drive} --output {out}/y.csv", "y.csv"),
        ("angle .parquet", f"angle {drive} --output {out}/y.parquet", "y.parquet"),
        ("angle --report", f"angle {drive} --report {out}/y.html", "y.html"),
        ("offset --report", f"offset {drive} --report {out}/z.html", "z.html"),
        ("offset --json --report", f"offset {drive} --json --report {out}/z.html", "z.html"),
        ("export fmu", f"export fmu --vehicle {TRUCK} --output {out}/t.fmu", "t.fmu"),
    ):
        seen[name] = calls_fail(words, lambda file=file: put_old(out, [file]), out)
    seen["export c"] = calls_fail(f"export c --output {out}/c", lambda: put_old(out, []), out)
    seen["fleet run"] = calls_fail(*of_fleet(root, out), out, and_then=True)
    return seen


def without_what_is_slow(root: Path) -> None:
    """Computed once; all of it is written in every run. The core as C is some of its files."""
    from oncenter.export import c_folder, fmu
    from oncenter.fleet import engines, watched
    from oncenter.fleet import page as fleet_page
    from oncenter.read import apart
    from oncenter.report import angle_page, page

    def once(function: Callable[..., Any]) -> Callable[..., Any]:
        given: dict[str, Any] = {}

        def first(what: Any, *others: Any, **named: Any) -> Any:
            if str(what) not in given:
                given[str(what)] = function(what, *others, **named)
            return given[str(what)]

        return first

    contents = c_folder._contents()  # simulates a drive of its own
    writing = import_module("oncenter.simulate.write")
    simulate = import_module("oncenter.simulate")  # oncenter.simulate is the function
    simulate._simulate, writing.frames = once(simulate._simulate), once(writing.frames)
    fmu._compile = lambda *_: b"compiled"
    cli._begin_reader = lambda _: None
    apart.read_apart = once(apart.read_apart)
    answer_anew = watched.Watched.__call__
    answers = once(lambda log, watched: answer_anew(watched, log))
    watched.Watched.__call__ = lambda self, log: answers(log, self)
    page.page, angle_page.angle_page = once(page.page), once(angle_page.angle_page)
    few = {name: contents[name] for name in ("README.md", "core/mean.c", "ecu/oncenter.a2l", "test/vectors.h")}
    c_folder._contents = lambda: few
    fleet_page._page = lambda contents: f"{contents.ranked}\n{contents.changes}\n" * 100
    engines._cores = lambda: 0  # one thread: a run's calls are the next one's


def of_fleet(root: Path, out: Path) -> tuple[str, Callable[[], None]]:
    """A fleet run with one new log, after one that read all others."""
    words = f"fleet run {root}/logs --vehicles {root}/vehicles --output {out}"
    new, aside = root / "logs" / "depot-7" / "day0.parquet", root / "aside.parquet"
    new.rename(aside)
    put_old(out, [])
    one_run(words, 0, out)
    shutil.move(out, root / "before")
    aside.rename(new)

    def begin() -> None:
        shutil.rmtree(out, ignore_errors=True)
        shutil.copytree(root / "before", out)

    return words, begin


def put_old(out: Path, names: Sequence[str]) -> None:
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    for name in names:
        (out / name).write_bytes(OLD)


def calls_fail(words: str, begin: Callable[[], None], out: Path, *, and_then: bool = False) -> list[Run]:
    """An undisturbed run, then one for each failing call; `and_then`: a further run after each."""
    begin()
    before = digests(out)
    undisturbed = one_run(words, 0, out)
    seen = [undisturbed | {"again": undisturbed["files"]}]
    for failing in (every if EVERY_CALL in sys.argv else chosen)(undisturbed["calls"]):
        begin()
        seen.append(one_run(words, failing, out))
        if and_then:
            one_run(words, 0, out)
            seen[-1]["again"] = digests(out)
    return [{"before": before} | run for run in seen]


def every(calls: Sequence[str]) -> Sequence[int]:
    return range(1, len(calls) + 1)


def chosen(calls: Sequence[str]) -> list[int]:
    """Every call; of many equal calls in a row only the first, the middle and the last: a text log has thousands of
    writes."""
    numbers = []
    for _, same in groupby(every(calls), key=lambda number: calls[number - 1]):
        run = list(same)
        numbers += sorted({run[0], run[len(run) // 2], run[-1]})
    return numbers


def one_run(words: str, failing: int, out: Path) -> Run:
    disk = ctypes.CDLL(None)
    disk.full_disk_calls.restype = ctypes.c_char_p
    said, complained = io.StringIO(), io.StringIO()
    disk.full_disk_watch(os.fsencode(out), failing)
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(complained):
        exit_code = cli.run(words.split())
        count, calls = disk.full_disk_count(), disk.full_disk_calls().decode().splitlines()
        disk.full_disk_watch(b"", 0)
        if failing:
            gc.collect(0)  # a file left open complains when it goes
    return {
        "exit_code": exit_code,
        "out": said.getvalue(),
        "err": complained.getvalue(),
        "count": count,
        "calls": calls,
        "failed": calls[failing - 1] if 0 < failing <= count else None,
        "files": digests(out),
    }


def digests(out: Path) -> dict[str, str]:
    """The content of each file, except the ledger, which SQLite protects."""
    return {
        str(path.relative_to(out)): digest(path)
        for path in sorted(out.rglob("*"))
        if path.is_file() and "ledger.sqlite" not in path.name
    }


def digest(path: Path) -> str:
    content = path.read_bytes()
    if path.name == "metrics.json":
        metrics = json.loads(content)
        content = json.dumps({name: metrics[name] for name in metrics if name not in OF_A_RUN}).encode()
    return hashlib.sha256(content).hexdigest()[:16]


if __name__ == "__main__":
    result = json.dumps(main(Path(sys.argv[1])))
    print(result)
