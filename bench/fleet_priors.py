"""What a fleet teaches about its trucks' pulls (`oncenter fleet priors`), and its value for trucks outside this fleet.

    python bench/fleet_priors.py FOLDER [--trucks N] [--fleets N] [--fresh N] [--jobs N] [--tuning] [--page | --smoke]

Trucks of one type with eight drives at three loads, their pulls drawn from a normal distribution with an sd of 0.02,
0.05 or 0.1 m/s^2. FOLDER keeps the summaries, one small file per truck, so that a stopped run can continue: 0.3 s of a
core per drive. Each fleet's file of priors then answers one drive of fresh trucks. Seeds from 20001 on (fresh trucks:
from 25001 on) are for reporting, those from 1 and 5001 on (--tuning) for tuning.
"""

from __future__ import annotations

import argparse
import multiprocessing
import tempfile
import tomllib
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from sections import between
from truck_drives import DRIVES, KINDS, PULL_SDS_M_S2, truck_drives
from trucks import make

import oncenter as oc
from oncenter.errors import OncenterError
from oncenter.fleet.priors import Taught, write_taught
from oncenter.fleet.summaries import row_of_drive
from oncenter.signals import DEGREE
from oncenter.truck.row import Row
from oncenter.vehicle import vehicle_from

REPORTED_FROM, TUNING_FROM = 20001, 1
FRESH_AFTER = 5000
OF_ONE_LOAD = 10  # trucks
TYPE = "rigid"  # the name of their vehicle file
PAGE = Path(__file__).parents[1] / "docs" / "fleet_figures.md"
BEGIN = "<!-- priors: written by bench/fleet_priors.py --page -->"
END = "<!-- priors: end -->"
Record = dict[str, Any]


def learned(table: pl.DataFrame, file: Path) -> str:
    """Writes the priors of these trucks, and returns the command's lines."""
    trucks: dict[int, list[Row]] = {}
    for drive in table.to_dicts():
        row = row_of_drive(drive)
        if row is not None:
            trucks.setdefault(drive["seed"], []).append(row)
    return write_taught([Taught(f"truck-{seed}", TYPE, drives) for seed, drives in trucks.items()], file)


def taught(table: pl.DataFrame, file: Path) -> Record:
    """What a fleet has taught, and the sd of its trucks' true pulls; m/s^2."""
    print(learned(table, file), flush=True)
    values = tomllib.loads(file.read_text(encoding="utf-8"))["priors"]
    pulls = table.group_by("seed").agg(pl.col("pull").first())["pull"].to_numpy()
    return {
        "drawn": float(np.sqrt(np.mean(pulls**2))),
        "value": values["pull_sd_m_s2"],
        "error": values["pull_sd_error_m_s2"],
    }


def answers(kind: str, files: Sequence[Path], seed: int) -> Record:
    """A drive of a fresh truck by the built-in priors and by those of a fleet; half-widths in deg. Nothing of a drive
    without an interval."""
    with tempfile.TemporaryDirectory() as folder:
        _, _, driven = next(truck_drives(KINDS[kind], kind, seed, Path(folder)))
    file = files[seed % len(files)]
    values = driven.vehicle.model_dump(exclude_unset=True) | {"priors": {"from": file.name}}
    found: Record = {}
    for name, truck in (
        ("built_in", driven.vehicle),
        ("learned", vehicle_from(values, f"{TYPE}.toml", file.parent)),
    ):
        offset = oc.offset(driven.signals, truck).offset
        if offset.ci95 is None:
            return {}
        low, high = offset.ci95
        found |= {
            f"{name}_covered": bool(low <= driven.target_rad[-1] <= high),
            f"{name}_half_width": 0.5 * (high - low) / DEGREE,
            f"{name}_valid": offset.status == "valid",
        }
    return found


def table_of(fleets: Mapping[float, Sequence[Record]], fresh: Mapping[float, pl.DataFrame]) -> str:
    """A row for each sd of pulls."""
    lines = [
        "| pull sd, m/s² | of the trucks drawn | learned, by fleet | standard error | other trucks |"
        " `ci95` covers, learned | built-in | median half-width, deg, learned | built-in | valid, learned |"
        " built-in |",
        "|--:|---|---|---|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for sd, found in fleets.items():
        drives = fresh[sd]
        drawn, value, error = (", ".join(f"{one[key]:.3f}" for one in found) for key in ("drawn", "value", "error"))
        pairs = [(f"learned_{key}", f"built_in_{key}") for key in ("covered", "half_width", "valid")]
        covered, widths, valid = ([drives[name] for name in pair] for pair in pairs)
        lines.append(
            f"| {sd:g} | {drawn} | {value} | {error} | {len(drives)} | {covered[0].sum()} | {covered[1].sum()} |"
            f" {widths[0].median():.2f} | {widths[1].median():.2f} | {valid[0].sum()} | {valid[1].sum()} |"
        )
    return "\n".join(lines)


def at_one_load(table: pl.DataFrame, file: Path) -> str:
    """What the command says of trucks at one load each."""
    try:
        return learned(table, file)
    except OncenterError as error:
        return f"{error.code}: {error}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="of the trucks' summaries and the files of priors")
    parser.add_argument("--trucks", type=int, default=200, help="of each fleet (200)")
    parser.add_argument("--fleets", type=int, default=3, help="of each sd of pulls (3)")
    parser.add_argument("--fresh", type=int, default=100, help="trucks of each sd of pulls (100)")
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--tuning", action="store_true", help="seeds from 1 on instead of the reported ones")
    parser.add_argument("--smoke", action="store_true", help="a fleet of ten trucks: whether the bench runs")
    parser.add_argument("--page", action="store_true", help="write the table of docs/fleet_figures.md")
    given = parser.parse_args()
    if given.page and (given.tuning or given.smoke):
        parser.error("--page reports on the seeds for it")
    sds = PULL_SDS_M_S2[:1] if given.smoke else PULL_SDS_M_S2
    trucks, fleets, fresh = (10, 1, 1) if given.smoke else (given.trucks, given.fleets, given.fresh)
    of_one_load = 1 if given.smoke else OF_ONE_LOAD
    first = TUNING_FROM if given.tuning else REPORTED_FROM
    wanted = {f"type_{sd:g}": range(first, first + trucks * fleets) for sd in sds}
    tables = make(wanted | {"type_one": range(first, first + of_one_load)}, given.folder, given.jobs)
    found: dict[float, list[Record]] = {}
    answered: dict[float, pl.DataFrame] = {}
    for sd in sds:
        kind = f"type_{sd:g}"
        files = [given.folder / f"priors_{sd:g}_{fleet}.toml" for fleet in range(fleets)]
        parts = tables[kind].iter_slices(trucks * DRIVES)
        found[sd] = [taught(part, file) for part, file in zip(parts, files, strict=True)]
        seeds = range(first + FRESH_AFTER, first + FRESH_AFTER + fresh)
        with ProcessPoolExecutor(given.jobs, multiprocessing.get_context("spawn")) as pool:
            answered[sd] = pl.DataFrame([one for one in pool.map(partial(answers, kind, files), seeds) if one])
    print(at_one_load(tables["type_one"], given.folder / "priors_one.toml"))
    counts = f"Fleets of {trucks} trucks, seeds from {first} on; other trucks: seeds from {first + FRESH_AFTER} on."
    written = f"{counts}\n\n{table_of(found, answered)}"
    print(written)
    if given.page:
        PAGE.write_text(between(PAGE.read_text(encoding="utf-8"), BEGIN, END, f"\n{written}\n"), encoding="utf-8")


if __name__ == "__main__":
    main()
