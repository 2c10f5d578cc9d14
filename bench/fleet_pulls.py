"""Whether the spread of pulls that a fleet teaches holds within its own standard error, and whether outliers are named.

    python bench/fleet_pulls.py [--fleets N] [--jobs N] [--tuning] [--page | --smoke]

Fleets of 30, 60 and 200 trucks by the equations of the truck's model, not simulated: a simulated fleet takes an hour.
Six drives each at three loads; pulls from a normal distribution, 5 % of them +-0.4 m/s^2 in every second row. Further
rows have other drives. Seeds from 20001 on are for reporting, those from 1 on (--tuning) for tuning.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
from sections import between

sys.path.append(str(Path(__file__).parents[1] / "tests"))

from fleet_rows import THREE_LOADS, Driving, fleet_of

from oncenter import _core
from oncenter.truck.population import Learned, population_of
from oncenter.truck.priors import priors_of

REPORTED_FROM, TUNING_FROM = 20001, 1
SDS_M_S2, TRUCKS, OUTLIERS = (0.02, 0.05, 0.1), (30, 60, 200), 0.05
PAGE = Path(__file__).parents[1] / "docs" / "fleet_figures.md"
BEGIN = "<!-- pulls: written by bench/fleet_pulls.py --page -->"
END = "<!-- pulls: end -->"


class Cell(NamedTuple):
    """A row of the table; its pulls in m/s^2."""

    sd: float
    trucks: int
    outliers: int
    driving: Driving = THREE_LOADS
    words: str = "6 drives"


class Found(NamedTuple):
    """Of one fleet: its pulls' sd, and how many outliers and other trucks are named."""

    sd: Learned
    named: int
    others: int


def cells() -> Iterator[Cell]:
    for sd, trucks, share in product(SDS_M_S2, TRUCKS, (0.0, OUTLIERS)):
        yield Cell(sd, trucks, round(share * trucks))
    for driving, words in (
        (Driving(drives=4), "4 drives"),
        (Driving(drives=8), "8 drives"),
        (Driving(scatter_deg=0.2), "scatter 0.2 deg instead of 0.12"),
        (Driving(steer_deg=0.3), "ride height steers by 0.3 deg"),
    ):
        for sd in SDS_M_S2[:2]:
            yield Cell(sd, 60, 0, driving, words)


def found(cell: Cell, seed: int) -> Found:
    trucks = fleet_of(cell.sd, cell.trucks, cell.driving, outliers=cell.outliers, seed=seed)
    taught = population_of(trucks, priors_of(), _core.default_params()["set_up_probability_1"])
    named = sum(one.at < cell.outliers for one in taught.outliers)
    return Found(taught.pull_sd, named, len(taught.outliers) - named)


def row_of(cell: Cell, fleets: Sequence[Found]) -> str:
    values, errors = np.array([(one.sd.value, one.sd.error) for one in fleets]).T
    within = int(np.sum(np.abs(values - cell.sd) <= 2.0 * errors))
    named = f"{sum(one.named for one in fleets)} of {cell.outliers * len(fleets)}" if cell.outliers else ""
    others = f"{sum(one.others for one in fleets)} of {(cell.trucks - cell.outliers) * len(fleets)}"
    return (
        f"| {cell.sd:g} | {cell.trucks} | {cell.outliers} | {cell.words} | {values.mean():.3f} | {values.min():.3f} to"
        f" {values.max():.3f} | {errors.mean():.3f} | {within} of {len(fleets)} | {named} | {others} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fleets", type=int, default=40, help="of each row (40)")
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--tuning", action="store_true", help="seeds from 1 on instead of the reported ones")
    parser.add_argument("--smoke", action="store_true", help="one fleet of 30 trucks: whether the bench runs")
    parser.add_argument("--page", action="store_true", help="write the table of docs/fleet_figures.md")
    given = parser.parse_args()
    if given.page and (given.tuning or given.smoke):
        parser.error("--page reports on the seeds for it")
    first = TUNING_FROM if given.tuning else REPORTED_FROM
    chosen, fleets = ([Cell(0.05, 30, 2)], 1) if given.smoke else (list(cells()), given.fleets)
    lines = [
        f"Rows of {fleets} fleets each, seeds from {first} on.",
        "",
        "| pull sd, m/s² | trucks | of them outliers | each | learned, mean | of the fleets | standard error, mean |"
        " true sd within two of them | outliers named | other trucks named |",
        "|--:|--:|--:|---|--:|---|--:|--:|--:|--:|",
    ]
    with ProcessPoolExecutor(given.jobs, multiprocessing.get_context("spawn")) as pool:
        for cell in chosen:
            lines.append(row_of(cell, list(pool.map(partial(found, cell), range(first, first + fleets)))))
            print(lines[-1], flush=True)
    written = "\n".join(lines)
    if given.page:
        PAGE.write_text(between(PAGE.read_text(encoding="utf-8"), BEGIN, END, f"\n{written}\n"), encoding="utf-8")


if __name__ == "__main__":
    main()
