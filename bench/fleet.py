"""Measures the requirements on a nightly fleet run with simulated drives.

    python bench/fleet.py FOLDER [--part changes|speed|ray|memory|kill …] [--page | --smoke]

If FOLDER has no fleet, one is made (fleet_drives.py, 4.5 GB, six minutes on two cores): 2,000 drives of 100 trucks,
half of them without any change, with seed 11, which was not used for tuning (101, 1, 2, 21 and 22 were). Outputs stay
in FOLDER/out. `--page` writes the results into docs/fleet_figures.md; parts that were not measured keep their text.
`--smoke` only checks that the bench runs: a few drives, one round.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import polars as pl
from fleet_drives import fleet, write_fleet

from oncenter.fleet.summaries import row_of_drive
from oncenter.truck.now import truck_now
from oncenter.truck.priors import priors_of

SEED, DRIVES_A_MONTH = 11, 20
FOUND_WITHIN = 3  # drives
LEAST_DEG = 2.0
PAGE = Path(__file__).parents[1] / "docs" / "fleet_figures.md"
MARK = "<!-- below: written by bench/fleet.py --page -->\n"


@dataclass(frozen=True)
class Sizes:
    trucks: int
    drives: int  # of each
    rounds: int
    ray_turns: int
    kills: int


FULL, SMOKE = Sizes(100, DRIVES_A_MONTH, 3, 7, 10), Sizes(2, 3, 1, 1, 1)


def make(folder: Path, sizes: Sizes) -> None:
    if not (folder / "planted").is_dir():
        print(f"making {folder / 'planted'}", file=sys.stderr, flush=True)
        write_fleet(folder / "planted", *fleet(sizes.trucks, sizes.drives, SEED), os.cpu_count() or 1)


def night(given: Path, output: Path, *, logs: list[str] | None = None, more: tuple[str, ...] = ()) -> dict[str, Any]:
    """One run in its own process: its metrics, and wall and CPU seconds including children."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begin = time.perf_counter()
    places = logs or [str(given / "logs")]
    command = [*places, "--vehicles", str(given / "vehicles"), "--output", str(output), "--json", *more]
    done = subprocess.run(
        [sys.executable, "-m", "oncenter", "fleet", "run", *command], stdout=subprocess.PIPE, text=True, check=True
    )
    wall_s = time.perf_counter() - begin
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return json.loads(done.stdout) | {"wall_s": wall_s, "cpu_s": cpu_s}


def some(given: Path, count: int) -> list[str]:
    """Logs evenly from all trucks, so that every folder is represented."""
    logs = sorted(map(str, (given / "logs").rglob("*.parquet")))
    return logs[:: max(1, len(logs) // count)][:count]


def changes(folder: Path, work: Path, sizes: Sizes) -> list[str]:
    """Planted changes found and false ones."""
    given = folder / "planted"
    night(given, work)
    counted, standing = _judged(given, work), _standing(given, work)
    others = _others(work)
    lines = ["| changes of the offset | planted | found within 3 drives | later or never |", "|---|--:|--:|--:|"]
    for kind, planted, found in counted["kinds"]:
        lines.append(f"| {kind} | {planted} | {found} | {planted - found} |")
    months, false = counted["drives"] / DRIVES_A_MONTH, counted["false"]
    rate = 100.0 * false / months
    named = [truck for truck in standing if truck["named"]]
    wrong = sum(not truck["deserved"] for truck in named)
    missed = sum(truck["deserved"] and not truck["named"] for truck in standing)
    covered = sum(truck["covered"] for truck in standing)
    return [
        *lines,
        "",
        f"False alarms: {false} in {months:.0f} truck-months of 20 drives, {rate:.2f} %; asked: 1 %. "
        f"Of other quantities, where none was planted: {others or 'none'}.",
        "",
        f"The 95 % interval of the offset that a truck has now holds the truth for {covered} of {len(standing)} "
        f"trucks. {len(named)} are named, with a q of at most 5 %; of {wrong} of them neither offset nor change is "
        f"beyond 2 deg, and {missed} of which one is are not named.",
    ]


def _others(output: Path) -> dict[str, int]:
    """False alarms of other quantities."""
    found = pl.read_parquet(output / "changes.parquet").filter(pl.col("quantity") != "offset").to_dicts()
    return dict(sorted(Counter(each["quantity"] for each in found).items()))


def _standing(given: Path, output: Path) -> list[dict[str, Any]]:
    """The standing of each truck: whether its q reports it, whether the interval of its offset contains the truth, and
    whether offset or change exceeds the limit."""
    truth = pl.read_csv(given / "drives.csv").sort("drive").group_by("truck").last()
    planted = {change["truck"]: change for change in json.loads((given / "planted.json").read_text())}
    rows = []
    for row in pl.read_parquet(output / "trucks.parquet").join(truth, on="truck", suffix="_true").to_dicts():
        change = planted.get(row["truck"], {"kind": "gyro", "size": 0.0})
        moved = 0.0 if change["kind"] == "gyro" else abs(change["size"])
        error = row["offset_deg"] - row["offset_deg_true"]
        rows.append(
            {
                "named": row["q_value"] <= 0.05,
                "covered": abs(error) < 1.96 * row["offset_sd_deg"],
                "deserved": max(abs(row["offset_deg_true"]), moved) > LEAST_DEG,
            }
        )
    return rows


def _judged(given: Path, output: Path) -> dict[str, Any]:
    """A change matches the planted one of its truck if it is at most three drives from its time; all others are false.
    It was found in time if the drives until then have it."""
    planted = {change["truck"]: change for change in json.loads((given / "planted.json").read_text())}
    found = pl.read_parquet(output / "changes.parquet").filter(quantity="offset")
    drives = pl.read_parquet(output / "drives.parquet")
    kinds: dict[str, list[bool]] = {}
    false = 0
    for (truck,), rows in drives.sort("start").group_by("truck", maintain_order=True):
        starts = rows["start"].to_list()
        change = planted.get(str(truck))
        of_truck = found.filter(truck=truck).to_dicts()
        ours = []
        if change is not None and change["kind"] != "gyro":
            at = change["drive"]
            ours = [each for each in of_truck if abs(starts.index(each["by_drive"]) - at) <= FOUND_WITHIN]
            size = "of 2 deg or more" if abs(change["size"]) >= LEAST_DEG else "of 0.5 to 2 deg"
            known = [
                row for drive in rows.head(at + FOUND_WITHIN).to_dicts() if (row := row_of_drive(drive)) is not None
            ]
            soon = any(one.kind != "play" for one in truck_now(known, (), priors_of()).changes)
            kinds.setdefault(f"{change['kind']} {size}", []).append(soon)
        false += len(of_truck) - len(ours[:1])
    return {
        "drives": len(drives),
        "false": false,
        "kinds": [(kind, len(hits), sum(hits)) for kind, hits in sorted(kinds.items())],
    }


def speed(folder: Path, work: Path, sizes: Sizes) -> list[str]:
    """The same logs on one core and on all cores in turn, for the whole command: the slowest and the fastest round.
    Then all logs on all cores, as in a nightly run."""
    every = some(folder / "planted", sizes.trucks * sizes.drives)
    logs = some(folder / "planted", 500)
    _touch(logs)
    cores = sorted(os.sched_getaffinity(0))
    lines = [
        "| processes | rounds | drives/s, from start to page | while answering | CPU ms a drive |",
        "|---|--:|--:|--:|--:|",
    ]
    measured: dict[tuple[int, int], list[tuple[float, float, float]]] = {}
    for round_ in range(sizes.rounds):
        for used in (cores[:1], cores):
            measured.setdefault((len(used), len(logs)), []).append(_rates(folder, work, logs, used, round_))
    _touch(every)
    for round_ in range(sizes.rounds):
        measured.setdefault((len(cores), len(every)), []).append(_rates(folder, work, every, cores, round_))
    for (count, drives), rounds in measured.items():
        columns = [f"{min(column):.0f} to {max(column):.0f}" for column in zip(*rounds, strict=True)]
        named = f"{count} {'core' if count == 1 else 'cores'}, {drives:,} drives"
        lines.append(f"| {named} | {len(rounds)} | {' | '.join(columns)} |")
    return [
        *lines,
        "",
        "The rounds differ by what else the machine's host does: the core alone is up to half as fast again from one "
        "minute to the next.",
    ]


def _rates(folder: Path, work: Path, logs: list[str], cores: list[int], round_: int) -> tuple[float, float, float]:
    """Drives per second from start to page and while answering, and CPU ms per drive."""
    os.sched_setaffinity(0, cores)
    metrics = night(folder / "planted", work / f"cores{len(cores)}_{len(logs)}_{round_}", logs=logs)
    return len(logs) / metrics["wall_s"], metrics["logs_per_second"], 1000.0 * metrics["cpu_s"] / len(logs)


def _touch(logs: list[str]) -> None:
    """Reads the logs once, so that the disk does not count."""
    for log in logs:
        Path(log).read_bytes()


def on_ray(folder: Path, work: Path, sizes: Sizes) -> list[str]:
    """Ray compared with processes on this machine's cores, taking turns, 500 drives: time, and equality of the
    tables."""
    logs = some(folder / "planted", 500)
    _touch(logs)
    engines: dict[str, tuple[str, ...]] = {"processes": (), "ray": ("--engine", "ray")}
    for engine, more in engines.items():  # a warm-up run that does not count
        night(folder / "planted", work / engine, logs=logs[:100], more=more)
    turns: list[dict[str, dict[str, Any]]] = []
    for _ in range(sizes.ray_turns):
        for engine in engines:
            shutil.rmtree(work / engine)
        turns.append({each: night(folder / "planted", work / each, logs=logs, more=engines[each]) for each in engines})
    ratios = sorted(turn["ray"]["wall_s"] / turn["processes"]["wall_s"] for turn in turns)
    same = _same(work / "processes", work / "ray")
    return [
        f"| {len(logs)} drives, median of {sizes.ray_turns} runs by turns | s, from start to page | "
        "drives/s while answering |",
        "|---|--:|--:|",
        f"| processes | {_median(turns, 'processes', 'wall_s'):.1f} | "
        f"{_median(turns, 'processes', 'logs_per_second'):.1f} |",
        f"| Ray, its start and end included | {_median(turns, 'ray', 'wall_s'):.1f} | "
        f"{_median(turns, 'ray', 'logs_per_second'):.1f} |",
        "",
        f"Ray takes {median(ratios):.2f} times as long ({ratios[0]:.2f} to {ratios[-1]:.2f}; asked: 1.5); to begin and "
        f"end with nothing to do, Ray and its Python alone take {_idle_ray_s():.1f} s. Tables "
        f"{'are the same bytes' if same else 'DIFFER'}.",
    ]


def _median(turns: list[dict[str, dict[str, Any]]], engine: str, quantity: str) -> float:
    return median(turn[engine][quantity] for turn in turns)


def _idle_ray_s() -> float:
    """Seconds for starting and ending Ray without work."""
    begin = time.perf_counter()
    idle = "import ray; ray.init(include_dashboard=False, log_to_driver=False); ray.shutdown()"
    subprocess.run([sys.executable, "-c", idle], check=True, stderr=subprocess.DEVNULL)
    return time.perf_counter() - begin


def _same(one: Path, other: Path) -> bool:
    names = ["drives.parquet", "trucks.parquet", "changes.parquet"]
    return all((one / name).read_bytes() == (other / name).read_bytes() for name in names)


def memory(folder: Path, work: Path, sizes: Sizes) -> list[str]:
    lines = ["| logs | peak memory of a process, MB |", "|--:|--:|"]
    for count in (25, 100, 400, sizes.trucks * sizes.drives):
        logs = some(folder / "planted", count)
        metrics = night(folder / "planted", work / f"memory{count}", logs=logs)
        lines.append(f"| {len(logs):,} | {metrics['peak_memory_mb']:.0f} |")
    return lines


def kill(folder: Path, work: Path, sizes: Sizes) -> list[str]:
    """Kills the run ten times, then lets it finish: the tables must equal those of an undisturbed run."""
    logs = some(folder / "planted", 700)
    undisturbed_s = night(folder / "planted", work / "undisturbed", logs=logs)["wall_s"]
    start_s = night(folder / "planted", work / "one", logs=logs[:1])["wall_s"]
    waits = random.Random(1)
    command = [
        "fleet",
        "run",
        *logs,
        "--vehicles",
        str(folder / "planted" / "vehicles"),
        "--output",
        str(work / "killed"),
    ]
    killed = 0
    for _ in range(sizes.kills):
        process = subprocess.Popen([sys.executable, "-m", "oncenter", *command], stdout=subprocess.DEVNULL)
        time.sleep(start_s + waits.uniform(0.0, 0.1) * undisturbed_s)
        process.send_signal(signal.SIGKILL)
        killed += process.wait() == -signal.SIGKILL
    last = night(folder / "planted", work / "killed", logs=logs)
    same = _same(work / "undisturbed", work / "killed")
    return [
        f"Killed {killed} times within {len(logs)} drives, {last['logs_answered']} of which were left to the last run: "
        f"tables {'are the same bytes as undisturbed' if same else 'DIFFER from those of an undisturbed run'}, and "
        f"{len(last['poisonous']) or 'no'} logs are called poisonous."
    ]


PARTS: dict[str, tuple[str, Callable[[Path, Path, Sizes], list[str]]]] = {
    "changes": ("Changes found, and false ones", changes),
    "speed": ("Speed", speed),
    "ray": ("Ray", on_ray),
    "memory": ("Memory", memory),
    "kill": ("Killed in the middle", kill),
}


def write_page(measured: dict[str, list[str]]) -> None:
    above, _, below = PAGE.read_text(encoding="utf-8").partition(MARK)
    stood = dict(part.split("\n", 1) for part in below.split("### ")[1:])
    titles = [title for title, _ in PARTS.values()]
    new = {title: stood.get(title, "\nNot measured.\n").strip() for title in titles}
    new |= {PARTS[name][0]: "\n".join(lines) for name, lines in measured.items()}
    PAGE.write_text(
        above + MARK + "".join(f"\n### {title}\n\n{text}\n" for title, text in new.items()), encoding="utf-8"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--part", nargs="+", choices=PARTS, default=list(PARTS))
    shape = parser.add_mutually_exclusive_group()
    shape.add_argument("--page", action="store_true")
    shape.add_argument("--smoke", action="store_true")
    given = parser.parse_args()
    sizes = SMOKE if given.smoke else FULL
    make(given.folder, sizes)
    measured = {}
    for name in given.part:
        work = given.folder / "out" / name
        shutil.rmtree(work, ignore_errors=True)  # else answers of an older core with the same version would stay
        work.mkdir(parents=True, exist_ok=True)
        measured[name] = PARTS[name][1](given.folder, work, sizes)
        print(f"\n### {PARTS[name][0]}\n\n" + "\n".join(measured[name]), flush=True)
    if given.page:
        write_page(measured)


if __name__ == "__main__":
    main()
