"""Both parts of the offset's interval: how often each holds the truth, and how wide it is for its errors.

    python bench/two_parts.py [--drives N] [--rows a,b] [--jobs N] [--tuning] [--page]

Rows of accuracy_rows.py, 400 drives each. On rows without pull and wind the drive's own interval (`ci95_drive`) is
judged; on `population`, whose pulls are as believed, the whole one (`ci95`), and the drive's on the error less what
pull and wind did. Seeds from 10001 on are for reporting, those from 20001 on (--tuning) for whoever tunes.
"""

from __future__ import annotations

import argparse
import multiprocessing
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from accuracy import BUILD, names_of, progress
from accuracy_rows import ROWS, drive

import oncenter as oc
from oncenter.signals import DEGREE

REPORTED_FROM, TUNING_FROM = 10_001, 20_001
ASKED = ("ordinary", "motorway", "country", "trailer_half", "play_15_aligning", "population")
Record = dict[str, Any]


def record(row: str, seed: int, folder: Path) -> Record:
    """One drive; angles in deg."""
    driven = drive(ROWS[row], seed, folder)
    answer = oc.offset(driven.signals, driven.vehicle)
    truth = driven.truth
    unloads = truth.unloading_acceleration_m_s2
    shift = (0.0 if np.isnan(unloads) else unloads) + driven.wind_m_s2
    value, target = answer.offset.value, float(driven.target_rad[-1])
    parts = answer.native["offset_parts"]
    return {
        "row": row,
        "seed": seed,
        "status": answer.offset.status,
        "error": (value - target) / DEGREE,
        "shift_m_s2": shift,
        "per": parts["per_acceleration"] / DEGREE,
        "drive_sd": parts["drive_sd"] / DEGREE,
        "pull_sd": parts["pull_sd"] / DEGREE,
        "wind_sd": parts["wind_sd"] / DEGREE,
        "set_up_sd": parts["set_up_sd"] / DEGREE,
        "sd": answer.native["offset"]["standard_deviation"] / DEGREE,
        "lean": answer.native["offset"]["lean"] / DEGREE,
        "a0": answer.native["unloading_acceleration"]["value"],
        "a0_sd": answer.native["unloading_acceleration"]["standard_deviation"],
        "a0_true": truth.lateral_acceleration_bias_m_s2 + shift,
        "b_true": truth.lateral_acceleration_bias_m_s2,
        "K": answer.native["understeer_gradient"]["value"] / DEGREE,
        "K_sd": answer.native["understeer_gradient"]["standard_deviation"] / DEGREE,
        "K_true": truth.understeer_gradient / DEGREE,
        "play": answer.native["backlash"]["value"] / DEGREE,
        "play_sd": answer.native["backlash"]["standard_deviation"] / DEGREE,
        "play_true": (truth.backlash_rad + truth.windup_rad) / DEGREE,
        "i": driven.vehicle.ratio_near_centre,
        "left": answer.side_force_s[0],
        "right": answer.side_force_s[1],
        "gyro_sd": answer.native["offset_per_yaw_rate_bias"]
        * answer.native["yaw_rate_bias"]["standard_deviation"]
        / DEGREE,
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
    parser.add_argument("--rows", default=",".join(ASKED), help="by name, with commas between")
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--tuning", action="store_true", help="seeds from 20001 on instead of the reported ones")
    given = parser.parse_args()
    rows = names_of(given.rows, list(ROWS), "row")
    first = TUNING_FROM if given.tuning else REPORTED_FROM
    table = run(rows, range(first, first + given.drives), given.jobs)
    BUILD.mkdir(parents=True, exist_ok=True)
    table.write_parquet(BUILD / f"two_parts{'_tuning' if given.tuning else ''}.parquet")
    print_table(table)


def figures(part: pl.DataFrame) -> Record:
    """Of some drives of one row: coverage of both intervals, and how wide they are for their errors."""
    own = np.abs((part["error"] - part["shift_m_s2"] * part["per"]).to_numpy())
    drive = 1.96 * part["drive_sd"].to_numpy()
    middle = np.abs((part["error"] + part["lean"]).to_numpy())
    whole = 1.96 * np.sqrt(part["sd"].to_numpy() ** 2 - part["lean"].to_numpy() ** 2)
    said: Record = {"drives": len(part)}
    for name, error, half_width in (("drive", own, drive), ("whole", middle, whole)):
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
