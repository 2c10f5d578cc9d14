"""Both parts of the offset's interval: how often each holds the truth, and how wide it is for its errors.

    python bench/two_parts.py [--drives N] [--rows a,b] [--jobs N] [--tuning] [--page]

Rows of accuracy_rows.py, 400 drives each. On rows without pull and wind the drive's own interval (`ci95_drive`) is
judged; on `population`, whose pulls follow the prior, the whole one (`ci95`), and the drive's on the error less what
the pull did. Seeds from 10001 on are for reporting, those from 20001 on (--tuning) for whoever tunes.
"""

from __future__ import annotations

import argparse
import multiprocessing
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from accuracy import BUILD, names_of, progress
from accuracy_rows import ROWS, drive
from sections import TWO_PARTS, with_section

import oncenter as oc
from oncenter.signals import DEGREE

REPORTED_FROM, TUNING_FROM = 10_001, 20_001
DEFAULT_ROWS = ("ordinary", "motorway", "country", "trailer_half", "play_15_aligning", "population")
COVERED, RATIO = (0.92, 0.98), (0.25, 0.45)
PAGE = Path(__file__).parents[1] / "docs" / "accuracy.md"
Record = dict[str, Any]


def record(row: str, seed: int, folder: Path) -> Record:
    """One drive; angles in deg."""
    driven = drive(ROWS[row], seed, folder)
    answer = oc.offset(driven.signals, driven.vehicle)
    truth = driven.truth
    unloads = truth.unloading_acceleration_m_s2
    shift = 0.0 if np.isnan(unloads) else unloads
    assert answer.offset.value is not None and answer.offset.ci95 is not None
    low, high = answer.offset.ci95
    target = float(driven.target_rad[-1])
    return {
        "row": row,
        "seed": seed,
        "status": answer.offset.status,
        "error": (answer.offset.value - target) / DEGREE,
        "error_middle": (0.5 * (low + high) - target) / DEGREE,
        "half_width": 0.5 * (high - low) / DEGREE,
        "error_drive": (answer.offset.value - target - answer.offset_per_acceleration * shift) / DEGREE,
        "half_width_drive": (answer.offset_half_width_rad or 0.0) / DEGREE,
    }


def run(rows: Sequence[str], seeds: range, jobs: int) -> pl.DataFrame:
    """All records, in the order of rows and seeds."""
    wanted = [(row, seed) for row in rows for seed in seeds]
    spawn = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory() as name, ProcessPoolExecutor(jobs, spawn) as pool:
        running = {pool.submit(record, *key, Path(name)): key for key in wanted}
        done: dict[tuple[str, int], Record] = {}
        for future in as_completed(running):
            done[running[future]] = future.result()
            progress(len(done), len(wanted))
    return pl.DataFrame([done[key] for key in wanted], infer_schema_length=None)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drives", type=int, default=400, help="of each row (400)")
    parser.add_argument("--rows", default=",".join(DEFAULT_ROWS), help="by name, with commas between")
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--tuning", action="store_true", help="seeds from 20001 on instead of the reported ones")
    parser.add_argument("--page", action="store_true", help="write the section of docs/accuracy.md")
    given = parser.parse_args()
    if given.page and given.tuning:
        parser.error("--page reports on the seeds for it")
    rows = names_of(given.rows, list(ROWS), "row")
    first = TUNING_FROM if given.tuning else REPORTED_FROM
    table = run(rows, range(first, first + given.drives), given.jobs)
    BUILD.mkdir(parents=True, exist_ok=True)
    table.write_parquet(BUILD / f"two_parts{'_tuning' if given.tuning else ''}.parquet")
    print_table(table)
    if given.page:
        before = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(with_section(before, "\n".join(section(table, given.drives))), encoding="utf-8")


def section(table: pl.DataFrame, drives: int) -> Iterator[str]:
    low, high = (f"{share:.0%}" for share in COVERED)
    yield f"""{TWO_PARTS}

Written by `bench/two_parts.py --page`: {drives} drives a row, seeds from {REPORTED_FROM} on. `ci95_drive` is judged on
the error minus the effect of the pull; `ci95`, of both parts, on the error. Error over half-width: median / 95th
percentile over the drives; 0.34 and 1.00 are expected for a normal error. Required without a pull: {low} to {high} of
the `ci95_drive` contain the truth, with a median of {RATIO[0]} to {RATIO[1]}. Required of `ci95`: the same
share in `population`, whose pulls follow the prior. **Bold** misses it.

| row | drives | n | `ci95_drive`: covered | error / half-width | half-width, deg | error, deg |\
 `ci95`: covered | error / half-width | half-width, deg |
|---|---|--:|--:|--:|--:|--:|--:|--:|--:|"""
    for (row,), part in table.group_by("row", maintain_order=True):
        for name, some in (("all", part), ("valid", part.filter(pl.col("status") == "valid"))):
            said = figures(some)
            own = row != "population" and name == "all"
            cells = [
                _marked(f"{said['drive_covered']:.1%}", not own or _within(said["drive_covered"], COVERED)),
                _marked(f"{said['drive_ratio'][0]:.2f}", not own or _within(said["drive_ratio"][0], RATIO))
                + f" / {said['drive_ratio'][1]:.2f}",
                f"{said['drive_half_width']:.2f}",
                f"{said['drive_error'][0]:.2f} / {said['drive_error'][1]:.2f}",
                _marked(
                    f"{said['whole_covered']:.1%}",
                    row != "population" or name != "all" or _within(said["whole_covered"], COVERED),
                ),
                f"{said['whole_ratio'][0]:.2f} / {said['whole_ratio'][1]:.2f}",
                f"{said['whole_half_width']:.2f}",
            ]
            yield f"| `{row}` | {name} | {said['drives']} | {' | '.join(cells)} |"
    yield ""


def _within(value: float, bounds: tuple[float, float]) -> bool:
    return bounds[0] <= value <= bounds[1]


def _marked(cell: str, met: bool) -> str:
    return cell if met else f"**{cell}**"


def figures(part: pl.DataFrame) -> Record:
    """The coverage of both intervals on some drives of one row, and how wide they are for their errors."""
    said: Record = {"drives": len(part)}
    for name, error_of, width_of in (
        ("drive", "error_drive", "half_width_drive"),
        ("whole", "error_middle", "half_width"),
    ):
        error, half_width = np.abs(part[error_of].to_numpy()), part[width_of].to_numpy()
        ratio = error / half_width
        said |= {
            f"{name}_covered": float(np.mean(ratio < 1.0)),
            f"{name}_ratio": [float(np.quantile(ratio, q)) for q in (0.5, 0.95)],
            f"{name}_error": [float(np.quantile(error, q)) for q in (0.5, 0.95)],
            f"{name}_half_width": float(np.median(half_width)),
        }
    return said


def print_table(table: pl.DataFrame) -> None:
    for (row,), part in table.group_by("row", maintain_order=True):
        for name, some in (("all", part), ("valid", part.filter(pl.col("status") == "valid"))):
            said = figures(some)
            words = [
                f"{which} covers {said[f'{which}_covered']:6.1%} ratio {said[f'{which}_ratio'][0]:.2f}"
                f" {said[f'{which}_ratio'][1]:.2f} error {said[f'{which}_error'][0]:.2f}"
                f" {said[f'{which}_error'][1]:.2f} half-width {said[f'{which}_half_width']:.2f}"
                for which in ("drive", "whole")
            ]
            print(f"{row:18}{name:6}{said['drives']:5} | {' | '.join(words)}")


if __name__ == "__main__":
    main()
