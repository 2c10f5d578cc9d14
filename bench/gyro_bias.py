"""Error of the estimated yaw rate bias, its sd, and the share of time with a closed gate (5.3.1).

    python bench/gyro_bias.py [--seeds N] [--page]

Evaluated every minute from the third on, for simulated drives. `--page` writes the table of docs/method.md.
"""

from __future__ import annotations

import argparse
import dataclasses
import tempfile
from collections.abc import Callable
from functools import partial
from multiprocessing import Pool
from pathlib import Path

import numpy as np
import numpy.typing as npt
import polars as pl
from accuracy_rows import as_ebc2
from sections import between

from oncenter import _core
from oncenter.signals import DEGREE, Signals
from oncenter.simulate import simulate
from oncenter.vehicle import vehicle

PAGE = Path(__file__).parents[1] / "docs" / "method.md"
BEGIN, END = "<!-- bench/gyro_bias.py --page -->", "<!-- end -->"
FIRST_SEED = 101  # tuned on 1 to 12
MINUTE_S, FAST_M_S = 60.0, 15.0
HALF_A_DEGREE = 0.5 * DEGREE / 60.0  # rad/s^2: 0.5 deg/s a minute

Array = npt.NDArray[np.float64]
Drive = tuple[Signals, Array]  # and the bias, rad/s

LONG_STRAIGHT = """base = "motorway"
[road]
straight_length_m = [20000.0, 30000.0]
[driver]
speed_km_h = [84.0, 86.0]
[sensors.speed]
resolution_m_s = 0.001085 # 1/256 km/h
[sensors.wheel_speed]
resolution_m_s = 0.001085
[sensors.wheel_speed.radius_error_percent]
rear_left = 0.4
front_right = 0.3
"""
NOISELESS = LONG_STRAIGHT.replace("speed]\n", "speed]\nnoise_sd_m_s = 0.0\n")  # the vehicle's and the wheels'


def drifting(begin_s: float, end_s: float, drive: Drive) -> Drive:
    """Half a degree per second more each minute, from `begin_s` to `end_s`."""
    signals, bias = drive
    t = signals.table["time_s"].to_numpy()
    more = HALF_A_DEGREE * (np.clip(t - t[0], begin_s, end_s) - begin_s)
    table = signals.table.with_columns(yaw_rate_rad_s=pl.col("yaw_rate_rad_s") + more)
    return dataclasses.replace(signals, table=table), bias + more


def by_ebc2(drive: Drive) -> Drive:
    return as_ebc2(drive[0], np.random.default_rng(1)), drive[1]


def at_speed(drive: Drive) -> Drive:
    """The drive from the first fast second to the last: without a standstill to measure the bias."""
    signals, bias = drive
    fast = np.flatnonzero(signals.table["vehicle_speed_m_s"].to_numpy() > FAST_M_S)
    rows = slice(int(fast[0]), int(fast[-1]))
    return dataclasses.replace(signals, table=signals.table[rows]), bias[rows]


def without_wheels(drive: Drive) -> Drive:
    signals, bias = drive
    names = [name for name in signals.table.columns if not name.startswith("wheel_speed")]
    return dataclasses.replace(signals, table=signals.table.select(names)), bias


from_start, from_minute_ten = partial(drifting, 0.0, 1e9), partial(drifting, 600.0, 1200.0)
ROWS: dict[str, tuple[str, tuple[Callable[[Drive], Drive], ...]]] = {
    "thesis_drive": ('base = "thesis_drive"\n', ()),
    "motorway": ('base = "motorway"\n', ()),
    "drifting_gyro": ('base = "drifting_gyro"\n', ()),
    "straight_runs": ('base = "straight_runs"\n', ()),
    "country": ('base = "country"\n', ()),
    "town": ('base = "town"\n', ()),
    "thesis_drive, bias 3 deg/s": ('base = "thesis_drive"\n[sensors.yaw_rate]\nbias_deg_s = 3.0\n', ()),
    "thesis_drive, drift 0.1 deg/s/min": ('base = "thesis_drive"\n[sensors.yaw_rate]\ndrift_deg_s_min = 0.1\n', ()),
    "long straight, drift 0.5 deg/s/min from the start, HRW": (LONG_STRAIGHT, (from_start,)),
    "the same, EBC2": (LONG_STRAIGHT, (from_start, by_ebc2)),
    "long straight, drift 0.5 deg/s/min from minute 10 to 20, HRW": (LONG_STRAIGHT, (from_minute_ten,)),
    "the same from minute 10 to 20, EBC2": (LONG_STRAIGHT, (from_minute_ten, by_ebc2)),
    "the same, EBC2, wheels without any noise": (NOISELESS, (from_minute_ten, by_ebc2)),
    "motorway, EBC2": ('base = "motorway"\n', (by_ebc2,)),
    "motorway, no standstill, cut to begin and end at speed": ('base = "motorway"\n', (at_speed,)),
    "long straight at 85 km/h, no standstill, cut in the same way": (LONG_STRAIGHT, (at_speed,)),
    "drifting_gyro without wheel speeds, after one standstill": ('base = "drifting_gyro"\n', (without_wheels,)),
}


def looks(name: str, seed: int) -> Array:
    """The error and standard deviation of the bias minute by minute (rad/s), and whether the gate is shut for it."""
    text, changes = ROWS[name]
    with tempfile.TemporaryDirectory() as folder:
        scenario = Path(folder) / "drive.toml"
        scenario.write_text(text.replace("\n", "\n[drive]\nduration_s = 1800.0\n", 1), encoding="utf-8")
        signals, truth = simulate(scenario, seed)
    drive = signals, truth.table["yaw_rate_bias_rad_s"].to_numpy()
    for change in changes:
        drive = change(drive)
    signals, bias = drive
    truck = vehicle("scania_r730_4x2")
    core = _core.Core(
        truck.wheelbase_m,
        truck.ratio_near_centre,
        {},
        signals.rate_hz,
        track_width_front_m=truck.track_width_front_m or 0.0,
        track_width_rear_m=truck.track_width_rear_m or 0.0,
        traffic_side=truck.traffic_sign,
        method="joint",
    )
    outputs = np.zeros(signals.table.height, _core.OUTPUT_DTYPE)
    core.run({name: signals.table[name].to_numpy() for name in _core.COLUMNS if name in signals.table.columns}, outputs)
    minute = round(MINUTE_S * signals.rate_hz)
    rows = slice(3 * minute, None, minute)
    shut = outputs["reasons"] & _core.REASONS["yaw_rate_bias"] != 0
    return np.column_stack([outputs["yaw_rate_bias"] - bias, outputs["yaw_rate_bias_sd"], shut])[rows]


def table(seeds: int) -> str:
    lines = ["| drive | median | 95 % | in the interval | alarm |", "|---|--:|--:|--:|--:|"]
    with Pool() as pool:
        for name in ROWS:
            error, sd, shut = np.concatenate(pool.map(partial(looks, name), range(FIRST_SEED, FIRST_SEED + seeds))).T
            off = np.abs(error) / DEGREE
            lines.append(
                f"| {name} | {np.median(off):.3f} | {np.quantile(off, 0.95):.3f} | "
                f"{100 * np.mean(np.abs(error) < 1.96 * sd):.0f} % | {100 * shut.mean():.0f} % |"
            )
            print(lines[-1], flush=True)
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--page", action="store_true")
    given = parser.parse_args()
    written = table(given.seeds)
    if given.page:
        PAGE.write_text(between(PAGE.read_text(encoding="utf-8"), BEGIN, END, f"\n{written}\n"), encoding="utf-8")


if __name__ == "__main__":
    main()
