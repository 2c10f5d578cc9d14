"""The offset without a vehicle file, beside the same drives with one.

    python bench/unknown_truck.py [--drives N] [--rows a,b] [--seeds tuning|reported] [--jobs N] [--smoke]

Rows: `country`, `town`, `motorway`, `thesis_drive`, and `pull`, thesis_drive with an alignment that pulls. Trucks are
4x2, 6x2, 6x4 and 8x4 in turn, with a steering ratio of 15 to 26; all else is drawn from population.py. Each drive is
answered with its vehicle file (`known`), with none (`unknown`), and with traffic side and axle layout alone (`asked
for`). The error is less that of the pull. Asked: 270 of 300 intervals hold the truth and 51 of 60 in each row, a median
error of at most 1.2 times that of `known`, 3 points fewer valid, and no valid answer wrong by more than 1.5 deg.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
import multiprocessing
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

import polars as pl
from accuracy import BUILD, REPORTED_FROM, TUNING_FROM, names_of, progress
from accuracy_rows import ROWS, Drive, Row, drive
from population import Uniform

import oncenter as oc
from oncenter.signals import DEGREE
from oncenter.vehicle import Vehicle, vehicle_from

RATIO = Uniform(15.0, 26.0)
ROW_OF = {"4x2": "ordinary", "6x2": "rigid_6x2", "6x4": "rigid_6x4", "8x4": "rigid_8x4"}
NAMES = ("country", "town", "motorway", "thesis_drive", "pull")
HOLDS, HOLDS_IN_ROW, ERROR_TIMES, FEWER_VALID, WRONG_DEG = 0.9, 0.85, 1.2, 0.03, 1.5


def row_of(name: str, seed: int) -> Row:
    layout = list(ROW_OF)[seed % len(ROW_OF)]
    of_layout = ROWS[ROW_OF[layout]]
    return dataclasses.replace(
        of_layout,
        name=f"unknown {name} {layout}",
        base="thesis_drive" if name == "pull" else name,
        fixed={**of_layout.fixed, "steering_ratio": RATIO},
        pulls=name == "pull",
    )


def records(name: str, seed: int, folder: Path) -> list[dict[str, object]]:
    """One drive, answered in each way; angles in deg."""
    driven = drive(row_of(name, seed), seed, folder)
    known = driven.vehicle
    asked_for = {"traffic_side": known.traffic_side, "axle_layout": known.axle_layout}
    ways = {"known": known, "unknown": Vehicle(), "asked for": vehicle_from(asked_for, "asked for")}
    found = []
    for way, vehicle in ways.items():
        answer = oc.offset(driven.signals, vehicle)
        value, interval, of_drive = answer.offset.value, answer.offset.ci95, answer.offset_half_width_rad
        assert value is not None and interval is not None and of_drive is not None
        scored = _scored(driven, value, interval, answer.offset_per_acceleration, of_drive)
        found.append({**scored, "way": way, "status": answer.offset.status, "m": answer.ratio_times_wheelbase.value})
    true_m = known.ratio_times_wheelbase_m
    return [
        {"row": name, "seed": seed, **each, "product_off": math.nan if each["m"] is None else each["m"] / true_m - 1.0}
        for each in found
    ]


def _scored(
    driven: Drive, value: float, interval: tuple[float, float], per_acceleration: float, of_drive: float
) -> dict[str, object]:
    unloads, target = driven.truth.unloading_acceleration_m_s2, float(driven.target_rad[-1])
    by_pull = per_acceleration * ((0.0 if math.isnan(unloads) else unloads) + driven.wind_m_s2)
    return {
        "error": abs(value - target) / DEGREE,
        "error_less_pull": abs(value - target - by_pull) / DEGREE,
        "half_width": 0.5 * (interval[1] - interval[0]) / DEGREE,
        "holds": interval[0] <= target <= interval[1],
        "holds_drive": abs(value - target - by_pull) < of_drive,
    }


def run(rows: Sequence[str], seeds: range, jobs: int) -> pl.DataFrame:
    wanted = [(row, seed) for row in rows for seed in seeds]
    spawn = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory() as name, ProcessPoolExecutor(jobs, spawn) as pool:
        running = {pool.submit(records, *key, Path(name)): key for key in wanted}
        done: dict[tuple[str, int], list[dict[str, object]]] = {}
        for future in as_completed(running):
            done[running[future]] = future.result()
            progress(len(done), len(wanted))
    return pl.DataFrame([each for key in wanted for each in done[key]], infer_schema_length=None)


def lines(table: pl.DataFrame) -> Iterator[str]:
    yield (
        "| row | way | drives | error: median | 95 % | half-width | holds | drive's holds | valid | valid and wrong "
        "| product: 95 % |"
    )
    yield "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
    for row in [*dict.fromkeys(table["row"]), "all"]:
        for way in dict.fromkeys(table["way"]):
            part = table.filter((pl.col("way") == way) & ((pl.col("row") == row) | (row == "all")))
            valid = part.filter(pl.col("status") == "valid")
            wrong = (valid["error_less_pull"] > WRONG_DEG).sum()
            error, off = part["error_less_pull"], part["product_off"].fill_nan(None).abs().quantile(0.95)
            cells = [
                f"{error.median():.2f}",
                f"{error.quantile(0.95):.2f}",
                f"{part['half_width'].median():.2f}",
                f"{part['holds'].sum()}",
                f"{part['holds_drive'].sum()}",
                f"{len(valid)}",
                f"{wrong}",
                "-" if off is None else f"{100.0 * off:.1f} %",
            ]
            yield f"| {row} | {way} | {len(part)} | {' | '.join(cells)} |"
    yield ""
    for way in ("unknown", "asked for"):
        missed = list(_missed(table, way))
        yield f"{way}: {'as asked' if not missed else 'misses: ' + '; '.join(missed)}"


def _missed(table: pl.DataFrame, way: str) -> Iterator[str]:
    """What is asked of a way, beside `known`, and is not so."""
    of, known = table.filter(pl.col("way") == way), table.filter(pl.col("way") == "known")
    if of["holds"].mean() < HOLDS:
        yield f"{of['holds'].sum()} of {len(of)} hold"
    for (row,), part in of.group_by("row", maintain_order=True):
        if part["holds"].mean() < HOLDS_IN_ROW:
            yield f"{row}: {part['holds'].sum()} of {len(part)} hold"
    times = of["error_less_pull"].median() / known["error_less_pull"].median()
    if times > ERROR_TIMES:
        yield f"median error {times:.2f} times"
    fewer = (known["status"] == "valid").mean() - (of["status"] == "valid").mean()
    if fewer > FEWER_VALID:
        yield f"{100.0 * fewer:.1f} points fewer valid"
    wrong = of.filter((pl.col("status") == "valid") & (pl.col("error_less_pull") > WRONG_DEG))
    if len(wrong):
        yield f"{len(wrong)} valid and wrong"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drives", type=int, default=60, help="of each row (60)")
    parser.add_argument("--rows", default="", help="names separated by commas; default: all")
    parser.add_argument(
        "--seeds", choices=("tuning", "reported"), default="reported", help="from 1 on, or from 1001 on"
    )
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--smoke", action="store_true", help="one drive of one row: whether the bench runs")
    given = parser.parse_args()
    rows = ["country"] if given.smoke else names_of(given.rows, list(NAMES), "row")
    first = TUNING_FROM if given.seeds == "tuning" else REPORTED_FROM
    table = run(rows, range(first, first + (1 if given.smoke else given.drives)), given.jobs)
    BUILD.mkdir(parents=True, exist_ok=True)
    table.write_parquet(BUILD / f"unknown_truck_{given.seeds}.parquet")
    print("\n".join(lines(table)))


if __name__ == "__main__":
    main()
