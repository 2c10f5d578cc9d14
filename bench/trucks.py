"""Estimates over several drives of a truck: offset with and without load changes, and steps between drives.

    python bench/trucks.py FOLDER [--trucks N] [--months N] [--jobs N] [--tuning] [--page | --smoke]

FOLDER keeps the rows of evidence, one small file per truck, so that a stopped run can continue: 60 trucks of eight
drives at three loads, 60 at one load, 60 whose ride height steers by 0.03 deg with each load, 60 of each of four kinds
with twelve, and 1,000 truck-months of 20 drives (80 minutes of one core per thousand). A step is planted into the
rows, since a remounted sensor only shifts the offset. Seeds from 1001 on (months: from 1301 on) are for reporting,
those from 1 on (--tuning) for tuning.
"""

from __future__ import annotations

import argparse
import multiprocessing
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from accuracy import progress
from truck_drives import KINDS, truck_drives

import oncenter as oc
from oncenter.fleet.summaries import COLUMNS, columns_of, row_of_drive
from oncenter.signals import DEGREE
from oncenter.truck.now import Change, Truck, trucks_now
from oncenter.truck.priors import priors_of
from oncenter.truck.row import Row

REPORTED_FROM, TUNING_FROM = 1001, 1
MONTHS_FROM = 1301  # those from 1001 to 1300 were looked at while the threshold of a step was chosen
PAGE = Path(__file__).parents[1] / "docs" / "truck_over_time_figures.md"
MARK = "<!-- below: written by bench/trucks.py --page -->\n"
FOUND_WITHIN = 3  # drives
TWELVE = {
    "logs_three": "three loads, pull by its prior",
    "logs_one": "one load, pull by its prior",
    "logs_three_straight": "three loads, no pull",
    "logs_one_straight": "one load, no pull",
}
AT_ONCE = 500  # trucks, as fleet/night.py takes them
DAY_S = 86400.0
Numbers = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
Record = dict[str, Any]


def records(kind: str, seed: int) -> list[Record]:
    """A truck's drives in order of time; SI and rad."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for day, (load, _, driven) in enumerate(truck_drives(KINDS[kind], kind, seed, Path(folder))):
            answer = oc.offset(driven.signals, driven.vehicle)
            low, high = answer.offset.ci95 or (None, None)
            found.append(
                {
                    "kind": kind,
                    "seed": seed,
                    "load": load,
                    "target": float(driven.target_rad[-1]),
                    "pull": driven.truth.unloading_acceleration_m_s2,
                    "pulled": driven.angle_per_m_s2 * driven.truth.unloading_acceleration_m_s2,
                    "status": answer.offset.status,
                    "single": answer.offset.value,
                    "single_low": low,
                    "single_high": high,
                    "start": DAY_S * day,
                    "offset_status": answer.offset.status,
                    "duration_s": answer.duration_s,
                    "used_s": answer.used_s,
                    "side_force_left_s": answer.side_force_s[0],
                    "side_force_right_s": answer.side_force_s[1],
                    **dict.fromkeys(COLUMNS),
                    **columns_of(answer.rows[0] if answer.rows else None, answer.params),
                }
            )
    return found


def made(kind: str, seed: int, folder: Path) -> Path:
    """The file of one truck, made where there is none."""
    path = folder / f"{kind}_{seed}.parquet"
    if not path.exists():
        unfinished = path.with_suffix(".part")
        pl.DataFrame(records(kind, seed), infer_schema_length=None).write_parquet(unfinished)
        unfinished.rename(path)
    return path


def make(wanted: dict[str, range], folder: Path, jobs: int) -> dict[str, pl.DataFrame]:
    """The drives of all trucks by kind."""
    folder.mkdir(parents=True, exist_ok=True)
    pairs = [(kind, seed) for kind, seeds in wanted.items() for seed in seeds]
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        running = {pool.submit(made, *pair, folder): pair for pair in pairs}
        files = {}
        for future in as_completed(running):
            files[running[future]] = future.result()
            progress(len(files), len(pairs))
    return {kind: pl.concat([pl.read_parquet(files[kind, seed]) for seed in seeds]) for kind, seeds in wanted.items()}


@dataclass(frozen=True)
class Fleet:
    """A kind's trucks: `place` says which drive of the truck each of its usable `rows` is."""

    rows: list[list[Row]]
    place: list[list[int]]
    target: Numbers  # (trucks,), rad: the mean over its drives
    pulled: Numbers  # rad, the effect of the pull on the readings, the same mean
    single: Numbers  # (trucks, drives), rad
    single_half_width: Numbers

    def learned(self) -> list[Truck]:
        return trucks_now(self.rows, [priors_of()] * len(self.rows))


def fleet_of(table: pl.DataFrame, step: Numbers | None = None) -> Fleet:
    """`step` (trucks, drives), rad, is what the sensor reads more."""
    trucks = table["seed"].n_unique()

    def column(name: str) -> Numbers:
        return table[name].cast(pl.Float64).fill_null(np.nan).to_numpy().reshape(trucks, -1)

    moved = np.zeros_like(column("single")) if step is None else step
    every = [row_of_drive(record) for record in table.to_dicts()]
    drives = [every[k * moved.shape[1] : (k + 1) * moved.shape[1]] for k in range(trucks)]
    usable = [[(d, row) for d, row in enumerate(some) if row is not None] for some in drives]
    return Fleet(
        rows=[[shifted(row, float(moved[k, d])) for d, row in some] for k, some in enumerate(usable)],
        place=[[d for d, _ in some] for some in usable],
        target=np.mean(column("target"), axis=1),
        pulled=np.mean(column("pulled"), axis=1),
        single=column("single"),
        single_half_width=0.5 * (column("single_high") - column("single_low")),
    )


def shifted(row: Row, by: float) -> Row:
    """The row as if the sensor had read so much more, rad."""
    if by == 0.0:
        return row
    modes = row.modes.copy()
    of_offset = modes[:, [1, 2, 4]]  # information of the offset with itself, play, neutral acceleration
    modes[:, 0] -= modes[:, 7] * by + 0.5 * of_offset[:, 0] * by**2
    modes[:, 7:] += of_offset * by
    return replace(row, modes=modes)


def _judged(answers: Sequence[Truck], target: Numbers, pulled: Numbers) -> tuple[Numbers, Numbers]:
    """Error of the offset less any share of the pull's effect, and half-width from the driving."""
    error = np.array([one.offset for one in answers]) - target
    left = np.clip(error, np.minimum(pulled, 0.0), np.maximum(pulled, 0.0))
    return np.abs(error - left), np.array([1.96 * one.own_sd for one in answers])


def _whole(answers: Sequence[Truck]) -> tuple[Numbers, Numbers]:
    low, high = np.array([one.whole for one in answers]).T
    return 0.5 * (low + high), 0.5 * (high - low)


def offsets(kind: str, table: pl.DataFrame) -> Record:
    """The errors and intervals of trucks that nobody touched, and of their single drives, deg: of the common reading
    with the effect of the pull, which it has, and of the offset less the pull that the drives show."""
    fleet = fleet_of(table)
    answers = fleet.learned()
    read, spread = _judged(answers, fleet.target, fleet.pulled)
    middle, half_width = _whole(answers)
    error, half_width = np.abs(middle - fleet.target) / DEGREE, half_width / DEGREE
    narrowest = np.nanargmin(fleet.single_half_width, axis=1)
    rows = np.arange(len(error))
    of_narrowest = np.abs(fleet.single[rows, narrowest] - fleet.target) / DEGREE
    narrow = fleet.single_half_width[rows, narrowest] / DEGREE
    single = np.nanmedian(fleet.single_half_width, axis=1) / DEGREE
    return {
        "kind": kind,
        "trucks": len(error),
        "error": [float(np.quantile(error, q)) for q in (0.5, 0.95, 1.0)],
        "covered": int(np.sum(error < half_width)),
        "read_error": [float(np.quantile(read, q)) / DEGREE for q in (0.5, 0.95)],
        "read_covered": int(np.sum(read < spread)),
        "read_half_width": float(np.median(spread)) / DEGREE,
        "half_width": float(np.median(half_width)),
        "of_single": float(np.median(half_width / single)),
        "narrowest_error": [float(np.quantile(of_narrowest, q)) for q in (0.5, 0.95)],
        "of_narrowest": float(np.median(half_width / narrow)),
        "wider_than_narrowest": int(np.sum(half_width > narrow)),
        "load_would_help": sum(one.load_would_help for one in answers),
        "steps": sum(len(steps_of(one)) for one in answers),
    }


def twelve(kind: str, table: pl.DataFrame) -> Record:
    """Twelve logs in one call: the common reading, and the mean of the single valid ones, deg, with the pull's effect;
    `ratio` is the median error over half-width."""
    fleet = fleet_of(table)
    error, half_width = _judged(fleet.learned(), fleet.target, fleet.pulled)
    is_valid = (table["status"] == "valid").to_numpy().reshape(fleet.single.shape)
    single = np.abs(np.nanmean(np.where(is_valid, fleet.single, np.nan), axis=1) - fleet.target - fleet.pulled)
    return {
        "kind": kind,
        "trucks": len(error),
        "error": [float(np.quantile(error, q)) / DEGREE for q in (0.5, 0.95)],
        "covered": int(np.sum(error < half_width)),
        "half_width": float(np.median(half_width)) / DEGREE,
        "ratio": float(np.median(error / half_width)),
        "of_mean": float(np.median(single)) / DEGREE,
    }


def steps(table: pl.DataFrame, low_deg: float, high_deg: float, seed: int) -> Record:
    """One step a truck of `low` to `high` deg, after its third drive at the earliest and before its last three."""
    trucks = table["seed"].n_unique()
    count = len(table) // trucks
    random = np.random.default_rng(seed)
    at = random.integers(3, count - FOUND_WITHIN + 1, trucks)
    size = random.uniform(low_deg, high_deg, trucks) * random.choice([-1.0, 1.0], trucks) * DEGREE
    moved = np.where(np.arange(count)[None, :] >= at[:, None], size[:, None], 0.0)
    fleet = fleet_of(table, moved)
    answers = fleet.learned()
    counts = [int(np.searchsorted(place, at[n] + FOUND_WITHIN)) for n, place in enumerate(fleet.place)]
    soon = trucks_now([rows[:count] for rows, count in zip(fleet.rows, counts, strict=True)], [priors_of()] * trucks)
    in_time = [n for n in range(trucks) if _matching(soon[n], fleet.place[n], at[n])]
    ever = {n: found[0] for n in range(trucks) if (found := _matching(answers[n], fleet.place[n], at[n]))}
    others = sum(len(steps_of(one)) for one in answers) - len(ever)
    middle, half_width = _whole(answers)
    now = np.abs(middle - fleet.target - size)
    return {
        "low": low_deg,
        "high": high_deg,
        "drives": count,
        "trucks": trucks,
        "in_time": len(in_time),
        "ever": len(ever),
        "others": others,
        "size_error": float(np.median([abs(step.size - size[n]) for n, step in ever.items()])) / DEGREE,
        "error_now": float(np.median(now)) / DEGREE,
        "covered_now": int(np.sum(now < half_width)),
    }


def steps_of(truck: Truck) -> list[Change]:
    return [change for change in truck.changes if change.kind != "play"]


def false_steps(table: pl.DataFrame) -> int:
    return sum(len(steps_of(one)) for one in fleet_of(table).learned())


def _matching(truck: Truck, place: Sequence[int], at: int) -> list[Change]:
    """Steps at the planted boundary give or take a drive; drives without an answer do not count."""
    planted = int(np.searchsorted(place, at))
    return [step for step in steps_of(truck) if abs(step.at - planted) <= 1]


def speed(table: pl.DataFrame, trucks: int, drives: int) -> Record:
    """Seconds for so many trucks, put together from the drives that there are, one a day."""
    random = np.random.default_rng(1)
    whole = fleet_of(table).rows
    given = [
        [replace(rows[d], start_s=DAY_S * day) for day, d in enumerate(random.integers(0, len(rows), drives).tolist())]
        for rows in (whole[k] for k in random.integers(0, len(whole), trucks).tolist())
    ]
    begin = time.process_time()
    for first in range(0, trucks, AT_ONCE):
        some = given[first : first + AT_ONCE]
        trucks_now(some, [priors_of()] * len(some))
    return {"trucks": trucks, "drives": drives, "seconds": time.process_time() - begin}


def page(found: dict[str, Any]) -> str:
    names = {"three": "three loads", "one": "one load", "bump": "three loads, ride height steers 0.03 deg"}
    lines = [
        "### A truck's offset by eight drives of 20 minutes",
        "",
        "The reading is `offset.value` with `ci95_drive`, judged less any share of the pull's effect, which it may"
        " have; the offset is the middle of `ci95`, less the pull that the drives show.",
        "",
        "| trucks | n | reading's error, median | 95 % | covered | half-width | offset's error, median | 95 % | max |"
        " covered | half-width | of a single drive's | of the narrowest drive's | the narrowest drive's error, median |"
        " 95 % | another load would help |",
        "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for one in found["offsets"]:
        middle, high, worst = one["error"]
        lines.append(
            f"| {names[one['kind']]} | {one['trucks']} | {one['read_error'][0]:.2f} | {one['read_error'][1]:.2f} |"
            f" {one['read_covered']} | {one['read_half_width']:.2f} |"
            f" {middle:.2f} | {high:.2f} | {worst:.2f} | {one['covered']} |"
            f" {one['half_width']:.2f} | {one['of_single']:.2f} | {one['of_narrowest']:.2f} |"
            f" {one['narrowest_error'][0]:.2f} | {one['narrowest_error'][1]:.2f} | {one['load_would_help']} |"
        )
    lines += ["", "Angles in deg.", "", "### Twelve logs in one call", ""]
    lines += [
        "| trucks | n | reading's error, median | 95 % | covered | half-width | error / half-width, median |"
        " error of the mean of the single valid answers, median |",
        "|---|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for one in found["twelve"]:
        middle, high = one["error"]
        lines.append(
            f"| {TWELVE[one['kind']]} | {one['trucks']} | {middle:.3f} | {high:.2f} | {one['covered']} |"
            f" {one['half_width']:.2f} | {one['ratio']:.2f} | {one['of_mean']:.3f} |"
        )
    lines += ["", "### Steps between drives", ""]
    lines += [
        "| planted | drives | trucks | found within three drives | ever | others | error of the size, median |"
        " offset now, error | covered |",
        "|---|--:|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for one in found["steps"]:
        lines.append(
            f"| {one['low']:g} to {one['high']:g} deg | {one['drives']} | {one['trucks']} | {one['in_time']} |"
            f" {one['ever']} |"
            f" {one['others']} | {one['size_error']:.2f} | {one['error_now']:.2f} | {one['covered_now']} |"
        )
    false = found["false"]
    lines += [
        "",
        f"Of trucks that nobody touched, in {false['months']:,} months of 20 drives: {false['steps']} false steps; in"
        f" the first nine drives of each, as logs of one `oncenter offset`: {false['steps_of_nine']}.",
        "",
        "### Speed",
        "",
        f"{found['speed']['trucks']:,} trucks of {found['speed']['drives']} drives each:"
        f" {found['speed']['seconds']:.0f} s of one core.",
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="of the trucks' rows")
    parser.add_argument("--trucks", type=int, default=60, help="of each kind with eight drives (60)")
    parser.add_argument("--months", type=int, default=1000, help="truck-months of 20 drives (1000)")
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--tuning", action="store_true", help="seeds from 1 on instead of the reported ones")
    parser.add_argument("--smoke", action="store_true", help="one truck of each kind: whether the bench runs")
    parser.add_argument("--page", action="store_true", help="write docs/truck_over_time_figures.md")
    given = parser.parse_args()
    if given.page and (given.tuning or given.smoke):
        parser.error("--page reports on the seeds for it")
    first = TUNING_FROM if given.tuning else REPORTED_FROM
    trucks, months = (1, 1) if given.smoke else (given.trucks, given.months)
    wanted = {kind: range(first, first + trucks) for kind in ("three", "one", "bump")}
    logs = {kind: range(first, first + trucks) for kind in TWELVE}
    begin = TUNING_FROM if given.tuning else MONTHS_FROM
    tables = make(wanted | logs | {"month": range(begin, begin + months)}, given.folder, given.jobs)
    nine = tables["month"].group_by("seed", maintain_order=True).head(9)
    some = [table.filter(pl.col("seed") < begin + 100) for table in (tables["month"], nine)]
    found = {
        "offsets": [offsets(kind, tables[kind]) for kind in wanted],
        "twelve": [twelve(kind, tables[kind]) for kind in TWELVE],
        "false": {"months": months, "steps": false_steps(tables["month"]), "steps_of_nine": false_steps(nine)},
        "steps": [steps(table, low, high, 1) for table in some for low, high in ((1.0, 2.0), (1.0, 6.0), (2.0, 6.0))],
        "speed": speed(tables["month"], 20 if given.smoke else 10_000, 30),
    }
    text = page(found)
    print(text)
    if given.page:
        before = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(before.split(MARK)[0] + MARK + "\n" + text, encoding="utf-8")


if __name__ == "__main__":
    main()
