"""The time from log to answer, format by format, beside peers and the limit: docs/speed.md.

    python bench/speed_page.py [--scenario NAME] [--formats .log,.csv] [--ticks N] [--rounds N] [--page]

Contenders take turns. What starts a new process is a median of the rounds, everything else the best of them.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cold import FLOORS, STEPS
from drive_logs import BY_OTHERS, write_logs
from filters import NO_COMPILER, filters_table
from rivals.in_cpp import compiler
from spent import spent
from warm import warm_table

from oncenter.files.log_formats import SUFFIXES

HERE = Path(__file__).parent
PAGE = HERE.parent / "docs" / "speed.md"
SHOWN_FILES = 3  # of a format's time
ALONE = ("asammdf", "polars", "numpy", "scipy", "rosbags")  # libraries that read a format by themselves

Row = dict[str, Any]
Spent = tuple[float, dict[str, float]]  # see spent.py


def cold_table(logs: dict[str, Path], rounds: int) -> list[Row]:
    """The table of new processes, started by a process that holds little, see cold.py."""
    folder = next(iter(logs.values())).parent
    command = [HERE / "cold.py", "--json", "--folder", folder, "--rounds", str(rounds), "--formats", ",".join(logs)]
    done = subprocess.run([sys.executable, *command], stdout=subprocess.PIPE, check=True)
    return list(json.loads(done.stdout)["logs"])


def table(head: str, rows: Iterator[tuple[object, ...]]) -> str:
    """A table of Markdown; all columns but the first are numbers, or words as short."""
    names = head.split(" | ")
    lines = [f"| {head} |", "|---|" + "--:|" * (len(names) - 1)]
    return "\n".join([*lines, *("| " + " | ".join(map(str, row)) + " |" for row in rows)])


def page(
    given: argparse.Namespace, cold: list[Row], warm: list[Row], filters: list[Row], used: dict[str, Spent]
) -> str:
    parts = [
        _head(given, warm),
        *_cold(cold, given.rounds),
        *_readers(warm, given.rounds),
        *_filters(filters, given),
        *_limit(warm),
        *_left(cold, used),
    ]
    return "\n\n".join(parts) + "\n"


def _head(given: argparse.Namespace, warm: list[Row]) -> str:
    frames = max((row["count"] for row in warm if "frames" in row["s"]), default=0)
    missing = ", ".join(f"`{suffix}`" for suffix in BY_OTHERS if suffix not in SUFFIXES)
    not_read, load = f"\nNot read yet: {missing}." if missing else "", f"{os.getloadavg()[0]:.1f}"
    return f"""# Speed

How long does an answer take? For half an hour of driving, about a second in most formats, start of Python included.

Written by `python bench/speed_page.py --page` with the drive `{given.scenario}` in each format: {frames:,} frames of a
bus, or the same signals as a table at 100 Hz. All programs in a table take turns in one run. Compare figures within a
table: another machine has others. {os.cpu_count()} CPUs, Python {platform.python_version()}, load {load}.{not_read}
[bench/README.md](../bench/README.md) has the core in more detail, and logs of a busier
bus."""


def _cold(rows: list[Row], rounds: int) -> Iterator[str]:
    yield f"""## Log to answer, in a new process

`python -m oncenter offset LOG --vehicle scania_r730_4x2`, median of {rounds}. *Processors* adds up all its processes:
a child process reads the formats of third-party libraries. The first rows are the time to start Python and to
import its two largest packages."""
    yield table("log | MB | wall, s | processors, s | MB/s", map(_cold_row, rows))
    yield """The steps of the same command, from separate runs. *Start* is Python, all imports and the end;
*reading* includes the wait for the child process. *Peak* is the memory of all processes together in the runs above."""
    yield table(
        "log | start, s | reading, s | answering, s | peak, MB",
        (
            (row["log"], *(f"{row[step]:.2f}" for step in STEPS), f"{row['peak_mb']:.0f}")
            for row in rows
            if row["bytes"]
        ),
    )


def _cold_row(row: Row) -> tuple[str, ...]:
    mb = row["bytes"] / 1e6 if row["bytes"] else None
    size, rate = ("", "") if mb is None else (f"{mb:.1f}", f"{mb / row['wall_s']:.1f}")
    return row["log"], size, f"{row['wall_s']:.2f}", f"{row['cpu_s']:.2f}", rate


def _readers(rows: list[Row], rounds: int) -> Iterator[str]:
    yield f"""## Readers, in a warm process

One process, best of {rounds}, by the clock on the wall. Frames as columns of numbers, in M frames/s; of `.mf4` ours are
those with signals that oncenter uses:"""
    yield table("log | ours | python-can | times faster", _beside(rows, "frames", "python-can"))
    yield "The same messages decoded, in M frames/s; ours are resampled to one clock, checked and ready for an answer:"
    yield table("log | ours | python-can + cantools | times faster", _beside(rows, "signals", "python-can + cantools"))
    yield """Libraries that only read the file, in M frames/s or M rows/s; ours up to signals as above. If ours uses
the same library, a ratio below 1 is the cost of checks, units and one clock:"""
    yield table(
        "log | by | ours | alone | times faster",
        (
            (row["log"], who, _per_s(row, "signals"), _per_s(row, who), _times(row, "signals", who))
            for row in rows
            for who in ALONE
            if who in row["s"]
        ),
    )


def _beside(rows: list[Row], ours: str, rival: str) -> Iterator[tuple[object, ...]]:
    return (
        (row["log"], _per_s(row, ours), _per_s(row, rival), _times(row, ours, rival))
        for row in rows
        if rival in row["s"]
    )


def _per_s(row: Row, who: str) -> str:
    return f"{row['count'] / row['s'][who] / 1e6:.2f}"


def _times(row: Row, ours: str, rival: str) -> str:
    return f"{row['s'][rival] / row['s'][ours]:.1f}"


def _filters(rows: list[Row], given: argparse.Namespace) -> Iterator[str]:
    yield f"""## Filters

One thread over a drive of some {given.ticks:,} ticks at 100 Hz, by processor time, best of {given.rounds}.
`bench/rivals/filters.cpp` has Autoware's and openpilot's filters in the language that they run in, by `g++ -O2`;
each gives the same offset as its numba version. Autoware's estimates one number at every tenth tick. openpilot's is a
Kalman filter with nine states, here without most products with zeros of the full matrices. *oncenter* also
estimates the angle without its sensor and checks the sensor at every tick."""
    if compiler() is None:
        yield NO_COMPILER
    yield table(
        "filter | language | M ticks/s | of oncenter, joint",
        ((row["who"], row["language"], f"{row['mticks_s']:.1f}", f"{row['of_joint']:.2f}") for row in rows),
    )


def _limit(rows: list[Row]) -> Iterator[str]:
    copied = sum(row["bytes"] for row in rows) / sum(row["s"]["copy"] for row in rows) / 1e9
    yield f"""## The limit

The minimum work of any reader of a format on this machine, with the file in memory, beside ours from file to signals,
warm. A copy of the bytes runs at {copied:.1f} GB/s. Finding the line ends is one pass over them. Inflating is done by
zlib, unpacking Parquet by polars."""
    yield table(
        "log | limited by | limit, ms | ours, ms | times",
        (
            (row["log"], row["limited_by"], f"{1e3 * row['s']['limit']:.1f}", f"{1e3 * row['s']['signals']:.0f}",
             f"{row['s']['signals'] / row['s']['limit']:.0f}")
            for row in rows
        ),
    )  # fmt: skip


def _left(cold: list[Row], used: dict[str, Spent]) -> Iterator[str]:
    floor = next(row for row in cold if row["log"] == list(FLOORS)[-1])["wall_s"]
    whole = {row["log"]: sum(row[step] for step in STEPS) for row in cold if row["bytes"]}
    of = {row["log"]: row for row in cold}
    slowest, fastest = max(whole, key=whole.__getitem__), min(whole, key=whole.__getitem__)
    start = sum(of[log]["start_s"] for log in whole) / sum(whole.values())
    yield f"""## Where the time goes

**Start.** Over all formats {start:.0%} of the time of a new process is start: Python and imports. Python with only
numpy and pydantic takes {floor:.2f} s, which is {floor / whole[fastest]:.0%} of `{fastest}`, the fastest format.
A fleet's process starts once for many logs.

**Reading.** The slowest format is `{slowest}`: {of[slowest]["reading_s"]:.2f} of {whole[slowest]:.2f} s are reading,
and {of[slowest]["answering_s"]:.2f} s answering.

**A warm process.** From log to answer by the clock on the wall, over all formats: {_of_room(used, "read/"):.0%} goes to
reading, which finds numbers in text or frames and resamples all signals to one clock,
{_of_room(used, "plausibility/"):.0%} to the checks whether the signals fit together, and
{_of_room(used, "_core.py"):.0%} to the core in C. By format, the files of `src/oncenter` that take
most; the time of a library counts for its caller:"""
    lines = ["| log | ms | of it |", "|---|--:|---|"]
    for suffix, (seconds, shares) in used.items():
        files = ", ".join(f"`{file}` {share:.0%}" for file, share in list(shares.items())[:SHOWN_FILES])
        lines.append(f"| {suffix} | {1e3 * seconds:.0f} | {files} |")
    yield "\n".join(lines)


def _of_room(used: dict[str, Spent], room: str) -> float:
    """Share of a folder, or of a file, in the time of all formats."""
    spent_s = ((seconds * share, file) for seconds, shares in used.values() for file, share in shares.items())
    return sum(part for part, file in spent_s if file.startswith(room)) / sum(seconds for seconds, _ in used.values())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", default="thesis_drive", help="the drive; thirty minutes")
    parser.add_argument("--formats", default="", help="with commas between; all that are read")
    parser.add_argument("--ticks", type=int, default=1_800_000, help="of the filters' drive, at least 24000")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--page", action="store_true", help="write docs/speed.md")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        logs = write_logs(given.scenario, Path(folder), tuple(filter(None, given.formats.split(","))))
        cold = cold_table(logs, given.rounds)
        warm = warm_table(logs, given.rounds)
        used = {suffix: spent(log, given.rounds) for suffix, log in logs.items()}
    text = page(given, cold, warm, filters_table(given.ticks, given.rounds), used)
    print(text)
    if given.page:
        PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
