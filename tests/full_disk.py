"""Runs command lines while each call that takes room on the disk fails once; test_full_disk.py looks at what is left.

`python full_disk.py FOLDER` prints an object: by case, what came of its runs. It is a program of its own, because
full_disk.c is preloaded when a process begins. It is one process for all, because there are hundreds of runs.
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
from pathlib import Path
from typing import Any

from test_estimate import steady_drive
from two_trucks import write_fleet

from oncenter.cli import run

TRUCK = "scania_r730_4x2"
SUFFIXES = ("log", "asc", "blf", "trc", "mf4", "csv", "csv.gz", "parquet")
SCENARIO = """about = "short"
base = "thesis_drive"
[drive]
duration_s = 6.0
standing_at_start_s = 2.0
standing_at_end_s = 2.0
"""
OLD = b"what stood there before\n"
WATCHED = "out"  # the folder below which calls fail
OF_A_RUN = ("seconds", "logs_per_second", "peak_memory_mb")  # metrics that differ from run to run

Run = dict[str, Any]


def main(root: Path) -> dict[str, list[Run]]:
    """By case, a run that nothing disturbs, and then a run for each of its calls, which fails in it."""
    (root / "short.toml").write_text(SCENARIO)
    steady_drive(minutes=0.5).table.write_parquet(root / "drive.parquet")
    write_fleet(root)
    without_what_is_slow(root)
    out = root / WATCHED
    drive = f"{root}/drive.parquet --vehicle {TRUCK}"
    seen = {
        f"simulate .{suffix}": every_call_fails(
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
        seen[name] = every_call_fails(words, lambda file=file: put_old(out, [file]), out)
    seen["export c"] = every_call_fails(f"export c --output {out}/c", lambda: put_old(out, []), out)
    seen["fleet run"] = most_calls_fail(*of_fleet(root, out), out)
    return seen


def without_what_is_slow(root: Path) -> None:
    """Computed once; all of it is written in every run. The core as C is some of its files."""
    from oncenter.export import c_folder, fmu
    from oncenter.fleet import engines
    from oncenter.fleet import page as fleet_page
    from oncenter.report import angle_page, page

    def once(function: Callable[..., Any]) -> Callable[..., Any]:
        given: list[Any] = []

        def first(*arguments: Any) -> Any:
            if not given:
                given.append(function(*arguments))
            return given[0]

        return first

    simulate = import_module("oncenter.simulate")  # oncenter.simulate is the function
    simulate._simulate = once(simulate._simulate)
    fmu._compile = once(fmu._compile)
    page.page, angle_page.angle_page = once(page.page), once(angle_page.angle_page)
    contents = c_folder._contents()
    few = {name: contents[name] for name in ("README.md", "core/mean.c", "ecu/oncenter.a2l", "test/vectors.h")}
    c_folder._contents = lambda: few
    fleet_page._page = lambda ranked, changes, drives, *_: f"{ranked}\n{changes}\n{drives}\n" * 100
    engines._cores = lambda: 0  # one thread: a run's calls are the next one's


def of_fleet(root: Path, out: Path) -> tuple[str, Callable[[], None]]:
    """A night with one new log, after one that answered all others."""
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


def every_call_fails(words: str, begin: Callable[[], None], out: Path) -> list[Run]:
    begin()
    before = digests(out)
    undisturbed = one_run(words, 0, out)
    seen = [undisturbed]
    for failing in range(1, undisturbed["count"] + 1):
        begin()
        seen.append(one_run(words, failing, out))
    return [{"before": before} | run for run in seen]


def most_calls_fail(words: str, begin: Callable[[], None], out: Path) -> list[Run]:
    """Of a table's many small writes every twentieth; and what is there after one more run, which nothing disturbs."""
    begin()
    before = digests(out)
    undisturbed = one_run(words, 0, out)
    seen, writes = [undisturbed | {"again": undisturbed["files"]}], 0
    for failing, call in enumerate(undisturbed["calls"], 1):
        writes += call.startswith("write") and call.endswith(".parquet")
        if call.startswith("write") and call.endswith(".parquet") and writes % 20 != 1:
            continue
        begin()
        seen.append(one_run(words, failing, out))
        one_run(words, 0, out)
        seen[-1]["again"] = digests(out)
    return [{"before": before} | run for run in seen]


def one_run(words: str, failing: int, out: Path) -> Run:
    disk = ctypes.CDLL(None)
    disk.full_disk_calls.restype = ctypes.c_char_p
    said, complained = io.StringIO(), io.StringIO()
    disk.full_disk_watch(os.fsencode(out), failing)
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(complained):
        exit_code = run(words.split())
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
    """Of each file but the ledger, which SQLite keeps whole."""
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
