"""Estimates over several drives of a truck: offset with and without load changes, and steps between drives.

    python bench/trucks.py FOLDER [--trucks N] [--months N] [--jobs N] [--tuning] [--page | --smoke]

FOLDER keeps the summaries, one small file per truck, so that a stopped run can continue: 60 trucks of eight
drives at three loads, 60 at one load, 60 whose ride height steers by 0.03 deg with each load, 60 of each of four kinds
with twelve, and 1,000 truck-months of 20 drives (80 minutes of one core per thousand). A step is planted into the
summaries, since a remounted sensor only shifts the offset. Seeds from 1001 on (months: from 1301 on) are for reporting,
those from 1 on (--tuning) for tuning.
"""

from __future__ import annotations

import argparse
import multiprocessing
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from accuracy import progress
from truck_drives import KINDS, truck_drives

import oncenter as oc
from oncenter.signals import DEGREE
from oncenter.truck.drives import GRADIENT_MIN, Summaries, Summary
from oncenter.truck.model import Trucks, learn
from oncenter.truck.priors import priors_of

REPORTED_FROM, TUNING_FROM = 1001, 1
MONTHS_FROM = 1301  # those from 1001 to 1300 were looked at while the threshold of a step was chosen
PAGE = Path(__file__).parents[1] / "docs" / "many_drives.md"
MARK = "<!-- below: written by bench/trucks.py --page -->\n"
FOUND_WITHIN = 3  # drives
TWELVE = {
    "logs_three": "three loads, pull by its prior",
    "logs_one": "one load, pull by its prior",
    "logs_three_straight": "three loads, no pull",
    "logs_one_straight": "one load, no pull",
}
AT_ONCE = 500  # trucks of 300 drives, as fleet/night.py takes them
MEMBERS = [field.name for field in fields(Summary)]
Numbers = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
Record = dict[str, Any]


def records(kind: str, seed: int) -> list[Record]:
    """A truck's drives in order of time; SI and rad."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for load, _, driven in truck_drives(KINDS[kind], kind, seed, Path(folder)):
            answer = oc.offset(driven.signals, driven.vehicle)
            assert answer.summary is not None
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
                    **{name: getattr(answer.summary, name) for name in MEMBERS},
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
    """A kind's trucks: `place` says which drive of the truck each column of `drives` is."""

    drives: Summaries
    place: np.ndarray[tuple[int, int], np.dtype[np.int64]]
    target: Numbers  # (trucks,), rad: the mean over its drives
    pulled: Numbers  # rad, the effect of the pull on the readings, the same mean
    single: Numbers  # (trucks, drives), rad
    single_half_width: Numbers


def fleet_of(table: pl.DataFrame, step: Numbers | None = None) -> Fleet:
    """`step` (trucks, drives), rad, is what the sensor reads more."""
    trucks = table["seed"].n_unique()

    def column(name: str) -> Numbers:
        return table[name].cast(pl.Float64).fill_null(np.nan).to_numpy().reshape(trucks, -1)

    moved = np.zeros_like(column("offset")) if step is None else step
    values = {name: column(name) for name in MEMBERS}
    unusable = np.isnan(column("single")) | (values["gradient"] < GRADIENT_MIN)
    values["offset"] = np.where(unusable, np.nan, values["offset"] + moved)
    place = np.argsort(np.isnan(values["offset"]), axis=1, kind="stable")
    return Fleet(
        drives=Summaries(**{name: np.take_along_axis(value, place, axis=1) for name, value in values.items()}),
        place=place,
        target=np.mean(column("target"), axis=1),
        pulled=np.mean(column("pulled"), axis=1),
        single=column("single"),
        single_half_width=0.5 * (column("single_high") - column("single_low")),
    )


def offsets(kind: str, table: pl.DataFrame) -> Record:
    """The errors and intervals of trucks that nobody touched, and of their single drives, deg: of the common reading
    with the effect of the pull, which it has, and of the offset less the pull that the drives show."""
    fleet = fleet_of(table)
    answer = learn(fleet.drives, priors_of())
    read, spread = np.abs(answer.offset - fleet.target - fleet.pulled), 1.96 * answer.spread_sd
    error = np.abs(answer.less_pull - fleet.target) / DEGREE
    half_width = 1.96 * answer.less_pull_sd / DEGREE
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
        "load_would_help": int(np.sum(answer.load_would_help)),
        "steps": len(answer.steps),
    }


def twelve(kind: str, table: pl.DataFrame) -> Record:
    """Twelve logs in one call: the common reading, and the mean of the single valid ones, deg, with the pull's effect;
    `ratio` is the median error over half-width."""
    fleet = fleet_of(table)
    answer = learn(fleet.drives, priors_of())
    target = fleet.target + fleet.pulled
    error, half_width = np.abs(answer.offset - target), 1.96 * answer.spread_sd
    is_valid = (table["status"] == "valid").to_numpy().reshape(fleet.single.shape)
    single = np.abs(np.nanmean(np.where(is_valid, fleet.single, np.nan), axis=1) - target)
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
    answer = learn(fleet.drives, priors_of())
    in_time, ever, others = _found(answer, fleet, at)
    now = fleet.target + size
    return {
        "low": low_deg,
        "high": high_deg,
        "drives": count,
        "trucks": trucks,
        "in_time": len(in_time),
        "ever": len(ever),
        "others": others,
        "size_error": float(np.median([abs(step.size - size[step.truck]) for step in ever.values()])) / DEGREE,
        "error_now": float(np.median(np.abs(answer.offset - now))) / DEGREE,
        "covered_now": int(np.sum(np.abs(answer.offset - now) < 1.96 * answer.offset_sd)),
    }


def false_steps(table: pl.DataFrame) -> int:
    return len(learn(fleet_of(table).drives, priors_of()).steps)


def _found(answer: Trucks, fleet: Fleet, at: Numbers) -> tuple[dict[int, Any], dict[int, Any], int]:
    """Steps by truck that were found in time, and ever, at the right boundary give or take a drive; how many others."""
    in_time, ever, others = {}, {}, 0
    for step in answer.steps:
        n = step.truck
        begins, found = fleet.place[n, step.at], fleet.place[n, step.found]
        before = int(np.sum(fleet.place[n, : step.at + 1] < at[n]))  # drives of it that came before the planted one
        if found < at[n] or abs(begins - at[n]) > 1 + (step.at - before):
            others += 1
            continue
        ever[n] = step
        if found < at[n] + FOUND_WITHIN:
            in_time[n] = step
    return in_time, ever, others


def speed(table: pl.DataFrame, trucks: int, drives: int) -> Record:
    """Seconds for so many trucks, put together from the drives that there are."""
    random = np.random.default_rng(1)
    whole = fleet_of(table).drives
    has = np.isfinite(whole.offset).sum(axis=1)
    which = random.integers(0, len(has), trucks)
    column = (random.random((trucks, drives)) * has[which][:, None]).astype(int)
    begin = time.perf_counter()
    for first in range(0, trucks, AT_ONCE):
        some = slice(first, first + AT_ONCE)
        learn(
            Summaries(**{name: getattr(whole, name)[which[some, None], column[some]] for name in MEMBERS}), priors_of()
        )
    return {"trucks": trucks, "drives": drives, "seconds": time.perf_counter() - begin}


def page(found: dict[str, Any]) -> str:
    names = {"three": "three loads", "one": "one load", "bump": "three loads, ride height steers 0.03 deg"}
    lines = [
        "### A truck's offset by eight drives of 20 minutes",
        "",
        "The reading is `offset.value` with `ci95_drive`, judged with the pull's effect, which it has; the offset is"
        " the middle of `ci95`, less the pull that the drives show.",
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
    parser.add_argument("folder", type=Path, help="of the trucks' summaries")
    parser.add_argument("--trucks", type=int, default=60, help="of each kind with eight drives (60)")
    parser.add_argument("--months", type=int, default=1000, help="truck-months of 20 drives (1000)")
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--tuning", action="store_true", help="seeds from 1 on instead of the reported ones")
    parser.add_argument("--smoke", action="store_true", help="one truck of each kind: whether the bench runs")
    parser.add_argument("--page", action="store_true", help="write docs/many_drives.md")
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
        "speed": speed(tables["month"], 20 if given.smoke else 10_000, 300),
    }
    text = page(found)
    print(text)
    if given.page:
        before = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(before.split(MARK)[0] + MARK + "\n" + text, encoding="utf-8")


if __name__ == "__main__":
    main()
