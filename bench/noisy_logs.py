"""Slow and noisy logs of healthy trucks: does the interval of a valid answer hold at every rate and noise?

    python bench/noisy_logs.py FOLDER [--cells REGEX] [--scenarios a,b] [--drives N] [--seeds KIND] [--jobs N] [--page]

Three shipped scenarios of 30 minutes, which stay in FOLDER. A cell is a rate and what the logger does: it adds white
noise to yaw rate or acceleration, rounds, thins the signals by storing each n-th tick, holds these values at 100 Hz, or
filters before. Asked: of the valid answers at most 7 % miss their drive's interval in each scenario, at most 5 of 30 in
a cell. --page writes the table into docs/real_logs.md.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import re
import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from accuracy import BUILD, REPORTED_FROM, TUNING_FROM, names_of, progress
from one_truck_drives import Driven, Garage, said_of
from rivals import Array
from sections import between

import oncenter as oc
from oncenter.errors import OncenterError
from oncenter.signals import DEGREE

Record = dict[str, Any]
SCENARIOS = ("thesis_drive", "heavy_play", "motorway")
BASE_HZ, RATES_HZ = 100, (5, 10, 20, 50, 100)
YAW_RATE_NOISE_DEG_S, ACCELERATION_NOISE_M_S2 = (0.0, 0.1, 0.2, 0.4, 0.8), (0.05, 0.1, 0.2, 0.4)
STEPS = (0.1, 0.5, 1.0)  # deg of the angle, deg/s of the yaw rate
ANGLE, YAW_RATE, ACCELERATION = "steering_wheel_angle_rad", "yaw_rate_rad_s", "lateral_acceleration_m_s2"
PAGE = Path(__file__).parents[1] / "docs" / "real_logs.md"
BEGIN, END = "<!-- slow and noisy logs: written by bench/noisy_logs.py --page -->", "<!-- slow and noisy logs: end -->"


@dataclass(frozen=True)
class Cell:
    """What a logger does. Noise is white, and is added before the rest; steps are of angle and yaw rate."""

    rate_hz: int
    yaw_rate_noise_deg_s: float = 0.0
    acceleration_noise_m_s2: float = 0.0
    angle_step_deg: float = 0.0
    yaw_rate_step_deg_s: float = 0.0
    holds: bool = False
    filters: bool = False

    @property
    def name(self) -> str:
        sizes = {
            "yaw rate noise {:g} deg/s": self.yaw_rate_noise_deg_s,
            "acceleration noise {:g} m/s²": self.acceleration_noise_m_s2,
            "angle in steps of {:g} deg": self.angle_step_deg,
            "yaw rate in steps of {:g} deg/s": self.yaw_rate_step_deg_s,
        }
        ways = {"held at 100 Hz": self.holds, "filtered before": self.filters}
        words = [text.format(size) for text, size in sizes.items() if size] + [
            text for text, does in ways.items() if does
        ]
        return ", ".join([f"{self.rate_hz} Hz", *words])


def cells() -> Iterator[Cell]:
    for rate in RATES_HZ:
        yield from (Cell(rate, noise) for noise in YAW_RATE_NOISE_DEG_S)
        yield from (Cell(rate, 0.0, noise) for noise in ACCELERATION_NOISE_M_S2)
        yield Cell(rate, 0.2, 0.2)
        yield from (Cell(rate, angle_step_deg=step) for step in STEPS)
        yield from (Cell(rate, yaw_rate_step_deg_s=step) for step in STEPS)
        if rate < BASE_HZ:
            yield from (Cell(rate, 0.2, holds=True), Cell(rate, 0.4, 0.2, filters=True))


def recorded(driven: Driven, cell: Cell, seed: int) -> pl.DataFrame:
    random = np.random.default_rng([seed, zlib.crc32(cell.name.encode())])
    table, every = driven.signals.table, BASE_HZ // cell.rate_hz
    columns = {name: table[name].to_numpy().copy() for name in table.columns}
    columns[YAW_RATE] += random.normal(0.0, cell.yaw_rate_noise_deg_s * DEGREE, len(table))
    columns[ACCELERATION] += random.normal(0.0, cell.acceleration_noise_m_s2, len(table))
    time = columns.pop("time_s")
    if cell.filters:
        columns = {name: averaged(values, every) for name, values in columns.items()}
    for name, step in ((ANGLE, cell.angle_step_deg * DEGREE), (YAW_RATE, cell.yaw_rate_step_deg_s * DEGREE)):
        if step:
            columns[name] = np.round(columns[name] / step) * step
    at = np.arange(len(time)) // every * every if cell.holds else np.arange(0, len(time), every)
    return pl.DataFrame(
        {"time_s": time if cell.holds else time[at], **{k: values[at] for k, values in columns.items()}}
    )


def averaged(values: Array, count: int) -> Array:
    """Mean of the ticks about each one."""
    padded = np.pad(values, (count // 2, count - 1 - count // 2), mode="edge")
    return np.convolve(padded, np.full(count, 1.0 / count), mode="valid")


def records(folder: Path, scenario: str, seed: int, wanted: Sequence[Cell]) -> list[Record]:
    """One drive in all cells; angles in deg."""
    driven, found = Garage(folder, seed).scenario(scenario), []
    for cell in wanted:
        one: Record = {"scenario": scenario, "seed": seed, "cell": cell.name}
        try:
            answer = oc.offset(oc.from_dataframe(recorded(driven, cell, seed)), driven.vehicle)
        except OncenterError as error:
            found.append(one | {"status": error.code, "codes": [error.code]})
            continue
        found.append(one | said_of(answer, driven.offset_deg, driven.pull_m_s2))
    return found


def run(folder: Path, scenarios: Sequence[str], seeds: range, wanted: Sequence[Cell], jobs: int) -> list[Record]:
    found: list[Record] = []
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        tasks = [pool.submit(records, folder, scenario, seed, wanted) for seed in seeds for scenario in scenarios]
        for k, task in enumerate(as_completed(tasks), 1):
            found += task.result()
            progress(k, len(tasks))
    places = {cell.name: k for k, cell in enumerate(wanted)}
    return sorted(found, key=lambda each: (places[each["cell"]], each["scenario"], each["seed"]))


def lines(found: Sequence[Record]) -> Iterator[str]:
    yield "| recording | drives | valid | of these missed | error, median / 95 %, deg | half-width, deg | warnings |"
    yield "|---|--:|--:|--:|--:|--:|---|"
    for name in [*dict.fromkeys(each["cell"] for each in found), *sorted({each["scenario"] for each in found}), "all"]:
        some = [each for each in found if name in (each["cell"], each["scenario"], "all")]
        valid = [each for each in some if each["status"] == "valid"]
        errors = [abs(each["error"]) for each in valid]
        missed = sum(abs(each["error"]) > each["half_width"] for each in valid)
        said = Counter(code for each in some for code in each["codes"]).most_common(3)
        sizes = f"{np.median(errors):.2f} / {np.quantile(errors, 0.95):.2f}" if errors else "-"
        width = f"{np.median([each['half_width'] for each in valid]):.2f}" if valid else "-"
        words = ", ".join(f"`{code}` {count}" for code, count in said)
        yield f"| {name} | {len(some)} | {len(valid)} | {missed} | {sizes} | {width} | {words} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="of the drives")
    parser.add_argument("--cells", default="", help="regular expression of their names; default: all")
    parser.add_argument("--scenarios", default="", help="names separated by commas; default: all")
    parser.add_argument("--drives", type=int, default=10, help="of each scenario (10)")
    parser.add_argument(
        "--seeds", choices=("tuning", "reported"), default="reported", help="from 1 on, or from 1001 on"
    )
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--page", action="store_true", help="write the table into docs/real_logs.md")
    parser.add_argument("--smoke", action="store_true", help="one drive in two cells: whether the bench runs")
    given = parser.parse_args()
    if given.page and given.seeds != "reported":
        parser.error("--page reports on the seeds for it")
    first = TUNING_FROM if given.seeds == "tuning" else REPORTED_FROM
    pattern = r"^(20|50) Hz$" if given.smoke else given.cells
    wanted = [cell for cell in cells() if re.search(pattern, cell.name)]
    scenarios = names_of("thesis_drive" if given.smoke else given.scenarios, SCENARIOS, "scenario")
    seeds = range(first, first + (1 if given.smoke else given.drives))
    found = run(given.folder, scenarios, seeds, wanted, given.jobs)
    BUILD.mkdir(parents=True, exist_ok=True)
    (BUILD / "noisy_logs.json").write_text(json.dumps(found, indent=1), encoding="utf-8")
    written = "\n".join(lines(found))
    print(written)
    if given.page:
        PAGE.write_text(between(PAGE.read_text(encoding="utf-8"), BEGIN, END, written), encoding="utf-8")


if __name__ == "__main__":
    main()
