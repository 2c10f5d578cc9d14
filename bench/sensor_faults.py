"""Drives with a true fault of a sensor: whether the answer names it, as a fault or as "signal or sensor".

    python bench/sensor_faults.py [--drives N] [--seeds tuning|reported] [--jobs N] [--against FILE] [--smoke]

Each of N drives (tests/healthy_drive.py) has one fault after another, from 30 to 70 % of the drive on. A fault is named
if the answer has a warning, an error or a verdict about its sensor that the answer on the healthy drive lacks. All
records go to build/accuracy/sensor_faults.json; with --against, an earlier copy of that file, also the share of the
drives named there that are named now. Asked: 95 %.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import sys
import tempfile
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from accuracy import BUILD, REPORTED_FROM, TUNING_FROM
from angle_faults import FAULTS as ANGLE_FAULTS
from said import SIGNAL_OR_SENSOR, Answer, statements

import oncenter as oc
from oncenter.errors import OncenterError
from oncenter.signals import DEGREE, Signals

sys.path.append(str(Path(__file__).parents[1] / "tests"))

from healthy_drive import ANGLE, LATERAL, SPEED, TRUCK, WHEELS, YAW_RATE, Array, HealthyDrive, healthy_drive

Record = dict[str, Any]
Spoil = Callable[[Array, int, np.random.Generator], Array]  # of a signal, from that row on

STILL_NAMED_MIN = 0.95


@dataclass(frozen=True)
class SensorFault:
    """`signal` is the name in `said.SIGNAL_WORDS` of the sensor that is at fault."""

    signal: str
    column: str
    spoil: Spoil


def _steps(low: float, high: float) -> Spoil:
    """A step of that size to either side."""

    def spoil(measured: Array, at: int, random: np.random.Generator) -> Array:
        size = random.choice([-1.0, 1.0]) * random.uniform(low, high)
        return measured + np.where(np.arange(len(measured)) >= at, size, 0.0)

    return spoil


def _scaled(factor: float) -> Spoil:
    return lambda measured, at, random: np.where(np.arange(len(measured)) >= at, factor * measured, measured)


FAULTS: Mapping[str, SensorFault] = {
    **{f"angle_{name}": SensorFault("steering_wheel_angle", ANGLE, spoil) for name, spoil in ANGLE_FAULTS.items()},
    "angle_slipped": SensorFault("steering_wheel_angle", ANGLE, _steps(3.0 * DEGREE, 8.0 * DEGREE)),
    "yaw_rate_bias_step": SensorFault("yaw_rate", YAW_RATE, _steps(1.0 * DEGREE, 3.0 * DEGREE)),
    "yaw_rate_stuck": SensorFault("yaw_rate", YAW_RATE, ANGLE_FAULTS["stuck"]),
    "accelerometer_zero_moved": SensorFault("lateral_acceleration", LATERAL, _steps(0.5, 1.5)),
    "speed_stuck": SensorFault("vehicle_speed", SPEED, ANGLE_FAULTS["stuck"]),
    "wheel_speed_low": SensorFault("wheel_speed", WHEELS[2], _scaled(0.8)),
}


def spoiled(signals: Signals, name: str, seed: int) -> Signals:
    fault = FAULTS[name]
    random = np.random.default_rng([seed, zlib.crc32(name.encode())])
    values = signals.table[fault.column].to_numpy()
    at = int(random.uniform(0.3, 0.7) * len(values))
    column = pl.Series(fault.column, fault.spoil(values, at, random))
    return replace(signals, table=signals.table.with_columns(column))


def answered(signals: Signals) -> Answer:
    """The object of the answer, or of the error."""
    try:
        return oc.offset(signals, oc.vehicle(TRUCK)).to_dict()
    except OncenterError as error:
        return {"code": error.code, "message": str(error)}


def names(answer: Answer, healthy: Answer, signal: str) -> bool:
    """Whether an accusation that the healthy drive lacks is about the signal."""
    before = {(each.severity, each.code) for each in statements(healthy)}
    new = [each for each in statements(answer) if (each.severity, each.code) not in before]
    return any((each.accuses or SIGNAL_OR_SENSOR.search(each.text)) and each.names(signal) for each in new)


def records(seed: int, minutes: float) -> list[Record]:
    """All faults of one drive; a fault of the wheel speeds where it has some."""
    with tempfile.TemporaryDirectory() as folder:
        drive = healthy_drive(seed, Path(folder), minutes=minutes)
    healthy = answered(drive.signals)
    faults = [name for name, fault in FAULTS.items() if fault.column in drive.signals.table.columns]
    return [_record(name, drive, healthy) for name in faults]


def _record(name: str, drive: HealthyDrive, healthy: Answer) -> Record:
    answer = answered(spoiled(drive.signals, name, drive.seed))
    return {
        "fault": name,
        "seed": drive.seed,
        "road": drive.road,
        "named": names(answer, healthy, FAULTS[name].signal),
        "status": answer["offset"]["status"] if "offset" in answer else answer["code"],
        "said": [f"{each.severity} {each.code}: {each.text}" for each in statements(answer)],
    }


def run_all(seeds: Sequence[int], minutes: float, jobs: int) -> list[Record]:
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        waiting = [pool.submit(records, seed, minutes) for seed in seeds]
        return [record for future in waiting for record in future.result()]


def lines(found: Sequence[Record], before: Sequence[Record]) -> Iterator[str]:
    yield "| fault | drives | named | valid at the end | named before | of these still |"
    yield "|---|--:|--:|--:|--:|--:|"
    named_before = {(record["fault"], record["seed"]) for record in before if record["named"]}
    for name in [*dict.fromkeys(record["fault"] for record in found), "all"]:
        some = [record for record in found if name in (record["fault"], "all")]
        named = sum(record["named"] for record in some)
        valid = sum(record["status"] == "valid" for record in some)
        of_before = [record["named"] for record in some if (record["fault"], record["seed"]) in named_before]
        yield f"| {name} | {len(some)} | {named} | {valid} | {len(of_before)} | {sum(of_before)} |"
    if before:
        yield ""
        yield f"still named: {sum(of_before) / max(len(of_before), 1):.1%} (asked: at least {STILL_NAMED_MIN:.0%})"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drives", type=int, default=27, help="each with all faults (27: 311 logs)")
    parser.add_argument(
        "--seeds", choices=("tuning", "reported"), default="reported", help="from 1 on, or from 1001 on"
    )
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--against", type=Path, help="records of an earlier run")
    parser.add_argument("--smoke", action="store_true", help="one drive of 3 minutes: whether the bench runs")
    given = parser.parse_args()
    first = TUNING_FROM if given.seeds == "tuning" else REPORTED_FROM
    seeds = range(first, first + (1 if given.smoke else given.drives))
    before = json.loads(given.against.read_text(encoding="utf-8")) if given.against else []
    found = run_all(seeds, 3.0 if given.smoke else 20.0, given.jobs)
    BUILD.mkdir(parents=True, exist_ok=True)
    (BUILD / "sensor_faults.json").write_text(json.dumps(found, indent=1), encoding="utf-8")
    print("\n".join(lines(found, before)))


if __name__ == "__main__":
    main()
