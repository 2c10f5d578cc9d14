"""How far off the steering wheel angle without its sensor is: the observer beside the thesis's estimators.

    python bench/angle.py [--drives N] [--tuning] [--only WORD,...]

Ordinary drives of ten minutes with and an hour without the sensor, the manoeuvres of Figures 10, 11, 12 and 14, a
payload that changed, real cars, sensors that fail, and the speed. Seeds from 101 on are for reporting, those from 1 on
(--tuning) for whoever tunes.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
from angle_drives import (
    LEARNING_S,
    RAMP_BEGIN_S,
    RAMP_FROM_DEG,
    RAMP_TO_DEG,
    Array,
    Drive,
    hard_turn,
    named,
    ordinary,
    payload_changed,
)
from population import Uniform

import oncenter as oc
from oncenter.angle import METHODS
from oncenter.signals import DEGREE, Signals

TUNING_FROM, REPORTED_FROM = 1, 101
FAST_M_S = 8.0
NAMED_AFTER_TICKS = 1000  # a sign shows in bends only
REAL = Path(os.environ.get("ONCENTER_REAL_DATA", Path(__file__).parents[1] / ".." / "shared" / "data"))


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def estimated(drive: Drive, method: str = "observer", **options: object) -> tuple[Array, Array]:
    """Error and standard deviation, deg."""
    table = oc.angle(drive.signals, drive.vehicle, method=method, **options)
    error = (table["steering_wheel_angle_rad"].to_numpy() - drive.true_rad) / DEGREE
    return error, table["standard_deviation_rad"].to_numpy() / DEGREE


def ordinary_rows(seeds: range, folder: Path) -> Iterator[str]:
    rows: dict[str, Uniform | float] = {"play 0 to 4 deg": Uniform(0.0, 4.0), "play 15 deg": 15.0}
    for name, play in rows.items():
        errors: dict[str, list[float]] = {method: [] for method in (*METHODS, "smooth")}
        covered, half_widths, scatter = [], [], []
        for seed in seeds:
            drive = ordinary(seed, folder, play)
            after = (np.arange(len(drive.true_rad)) >= 100 * LEARNING_S) & (drive.speed_m_s > FAST_M_S)
            for method in METHODS:
                error, sd = estimated(drive, method, sensor_lost_at=LEARNING_S)
                errors[method].append(rms(error[after]))
                if method == "observer":
                    covered.append(float(np.mean(np.abs(error[after]) < 1.96 * sd[after])))
                    scatter.append(float(np.std(error[after])))
                    half_widths.append(1.96 * float(np.median(sd[after])))
            error, _ = estimated(drive, sensor_lost_at=LEARNING_S, smooth=True)
            errors["smooth"].append(rms(error[after]))
        for method, values in errors.items():
            yield f"{name:18}{method:22} RMS deg: median {np.median(values):5.2f}, worst {max(values):5.2f}"
        # what is left where the learned offset is not off
        yield f"{name:18}observer about its mean RMS deg: median {np.median(scatter):5.2f}, worst {max(scatter):5.2f}"
        yield (
            f"{name:18}interval covers {np.mean(covered):.3f} of all, worst drive {min(covered):.3f}, half-width "
            f"{np.median(half_widths):.2f} deg (median)"
        )


def payload_rows(seeds: range, folder: Path) -> Iterator[str]:
    covered, errors = [], []
    for seed in seeds:
        before, after = payload_changed(seed, folder)
        fast = after.speed_m_s > FAST_M_S
        error, sd = estimated(replace(after, vehicle=before.vehicle), taught_by=(before.signals,), sensor_lost_at=0.0)
        covered.append(float(np.mean(np.abs(error[fast]) < 1.96 * sd[fast])))
        errors.append(rms(error[fast]))
    told = f"covers {np.mean(covered):.3f}, worst drive {min(covered):.3f}; RMS {np.median(errors):.2f} deg"
    yield f"payload +-50 %: {told}"


def manoeuvre_rows(seeds: range, folder: Path) -> Iterator[str]:
    teachers = {seed: _first(named("thesis_drive", seed).signals, LEARNING_S) for seed in seeds}
    for figure, scenario in (("10", "low_speed_manoeuvre"), ("11, 14", "mid_speed_manoeuvre")):
        found: dict[str, list[tuple[float, float, float]]] = {method: [] for method in METHODS}
        for seed in seeds:
            drive = named(scenario, seed)
            for method in METHODS:
                error, _ = estimated(drive, method, taught_by=(teachers[seed],), sensor_lost_at=0.0)
                found[method].append(_of_manoeuvre(drive, error))
        for method, rows in found.items():
            large, small, bias = np.asarray(rows).T
            yield (
                f"Fig. {figure:7}{method:20} > 200 deg {100 * np.median(large):4.1f} % (worst {100 * max(large):.1f}), "
                f"below RMS {np.median(small):5.2f} deg (worst {max(small):.2f}), bias {np.median(bias):5.2f} deg "
                f"(worst {max(np.abs(bias)):.2f})"
            )
    for lag_s in (0.0, 0.1):
        if lag_s:
            teachers = {seed: _first(named("thesis_drive", seed, lag_s).signals, LEARNING_S) for seed in seeds}
        turns = {seed: hard_turn(seed, folder, lag_s) for seed in seeds}
        for method in ("observer", "yaw-rate", "yaw-rate-understeer"):
            times, overshoots = np.asarray([_of_turn(turns[seed], method, teachers[seed]) for seed in seeds]).T
            yield (
                f"Fig. 12 lag {lag_s:.1f} s {method:20} 90 % after {np.median(times):.2f} s (worst {max(times):.2f}), "
                f"overshoot {100 * np.median(overshoots):.1f} % (worst {100 * max(overshoots):.1f})"
            )


def _of_manoeuvre(drive: Drive, error: Array) -> tuple[float, float, float]:
    """Relative error where more than 200 deg are steered, RMS in deg elsewhere, and bias in deg toward more angle in
    bends beyond 0.8 m/s^2; 0 where there is none of it."""
    moving = (np.arange(len(error)) > 2500) & (drive.speed_m_s > 1.0)
    deg = drive.true_rad / DEGREE
    turned, bends = moving & (np.abs(deg) > 200.0), moving & (np.abs(drive.lateral_acceleration_m_s2) > 0.8)
    large = rms(error[turned] / deg[turned]) if turned.any() else 0.0
    bias = float(np.mean(error[bends] * np.sign(deg[bends]))) if bends.any() else 0.0
    return large, rms(error[moving & ~turned]), bias


def _of_turn(drive: Drive, method: str, teacher: Signals) -> tuple[float, float]:
    """Seconds from the turn's begin until 90 % of it, and the overshoot as its share."""
    table = oc.angle(drive.signals, drive.vehicle, method=method, taught_by=(teacher,), sensor_lost_at=0.0)
    begin = round(100 * RAMP_BEGIN_S)
    found = table["steering_wheel_angle_rad"].to_numpy()[begin : begin + 300] / DEGREE
    reached = np.flatnonzero(found <= RAMP_FROM_DEG + 0.9 * (RAMP_TO_DEG - RAMP_FROM_DEG))
    overshoot = (RAMP_TO_DEG - found.min()) / (RAMP_FROM_DEG - RAMP_TO_DEG)
    return (reached[0] / 100 if len(reached) else float("inf")), float(overshoot)


def _first(signals: Signals, seconds: float) -> Signals:
    return replace(signals, table=signals.table.head(round(seconds * signals.rate_hz)))


def real_rows(seeds: range, folder: Path) -> Iterator[str]:
    car = oc.vehicle(Path(__file__).parents[1] / "examples" / "genesis.toml")
    files = sorted((REAL / "genesis").glob("*.csv.gz"))
    if not files:
        yield f"no real drives in {REAL}"
        return
    drives = {file.name.removesuffix(".csv.gz"): oc.read(file, names=car.signal_names) for file in files}
    for name, drive in drives.items():
        # the whole drive with its sensor says what measured less offset is
        told_by = [other for key, other in drives.items() if key != name] if name.startswith("rfs") else []
        lost_at = 0.0 if told_by else 0.5 * len(drive.table) / drive.rate_hz
        for method in ("observer", "yaw-rate", "yaw-rate-understeer"):
            table = oc.angle(drive, car, method=method, sensor_lost_at=lost_at, taught_by=told_by)
            whole = oc.angle(drive, car, taught_by=told_by)
            measured = whole["measured_rad"].to_numpy()
            offset = np.nanmedian(measured - whole["steering_wheel_angle_rad"].to_numpy())
            after = np.arange(len(table)) >= 100 * lost_at
            after &= (drive.table["vehicle_speed_m_s"].to_numpy() > 3.0) & np.isfinite(measured)
            error = (table["steering_wheel_angle_rad"].to_numpy() - (measured - offset))[after] / DEGREE
            sd = table["standard_deviation_rad"].to_numpy()[after] / DEGREE
            covered = np.mean(np.abs(error) < 1.96 * sd)
            yield f"{name:24}{method:22} RMS {rms(error):5.2f} deg, mean {error.mean():5.2f}, covers {covered:.2f}"


def _stuck(measured: Array, at: int, random: np.random.Generator) -> Array:
    return np.where(np.arange(len(measured)) >= at, measured[at], measured)


def _jumped(measured: Array, at: int, random: np.random.Generator) -> Array:
    size = random.choice([-1, 1]) * random.uniform(20.0, 60.0) * DEGREE
    return measured + np.where(np.arange(len(measured)) >= at, size, 0.0)


def _drifting(measured: Array, at: int, random: np.random.Generator) -> Array:
    rate = random.choice([-1, 1]) * random.uniform(0.1, 1.0) * DEGREE
    return measured + rate * np.maximum(np.arange(len(measured)) - at, 0) / 100.0


def _wrong_sign(measured: Array, at: int, random: np.random.Generator) -> Array:
    return np.where(np.arange(len(measured)) >= at, -measured, measured)


def _remounted(measured: Array, at: int, random: np.random.Generator) -> Array:
    size = random.choice([-1, 1]) * random.uniform(20.0, 60.0) * DEGREE
    changed = measured + np.where(np.arange(len(measured)) >= at, size, 0.0)
    changed[at - 500 : at] = np.nan
    return changed


FAULTS: dict[str, Callable[[Array, int, np.random.Generator], Array]] = {
    "stuck": _stuck,
    "jumped": _jumped,
    "drifting": _drifting,
    "wrong_sign": _wrong_sign,
    "remounted": _remounted,
}


def fault_rows(seeds: range, folder: Path) -> Iterator[str]:
    """Found how long after being wrong by the larger of 10 deg and 5.5 sd, above 8 m/s; and alarms with no fault."""
    late: dict[str, list[float]] = {name: [] for name in FAULTS}
    names: dict[str, list[str]] = {name: [] for name in FAULTS}
    hours, alarms = 0.0, 0
    for seed in seeds:
        random = np.random.default_rng([seed, 7])
        drive = ordinary(seed, folder, Uniform(0.0, 15.0))
        healthy = oc.angle(drive.signals, drive.vehicle)
        hours += len(healthy) / 360_000.0
        fault = healthy["sensor_fault"].to_numpy() != "none"
        alarms += int(np.sum(fault[1:] & ~fault[:-1]))
        sd = oc.angle(drive.signals, drive.vehicle, sensor_lost_at=LEARNING_S)["standard_deviation_rad"].to_numpy()
        measured = drive.signals.table["steering_wheel_angle_rad"].to_numpy()
        for name, spoil in FAULTS.items():
            at = int(random.integers(70_000, 200_000))
            spoiled = spoil(measured, at, random)
            table = drive.signals.table.with_columns(steering_wheel_angle_rad=pl.Series(spoiled))
            found = oc.angle(replace(drive.signals, table=table), drive.vehicle)
            wrong = np.abs(spoiled - measured) > np.maximum(10.0 * DEGREE, 5.5 * sd)
            wrong &= (drive.speed_m_s > FAST_M_S) & (np.arange(len(wrong)) >= at)
            kinds = found["sensor_fault"].to_numpy()
            told = np.flatnonzero((kinds != "none") & (kinds != "lost") & (np.arange(len(kinds)) >= at))
            # seconds of being wrong before it was found
            first = told[0] if len(told) else len(wrong)
            late[name].append(float(np.sum(wrong[at:first])) / 100.0)
            named_at = min(first + NAMED_AFTER_TICKS, len(kinds) - 1)
            names[name].append(str(kinds[named_at]) if len(told) else "not found")
    yield f"healthy: {alarms} false alarms in {hours:.0f} h"
    for name, values in late.items():
        named_right = np.mean([told == name for told in names[name]])
        within = np.mean(np.asarray(values) <= 5.0)
        missed = sum(told == "not found" for told in names[name])
        yield (
            f"{name:12} found after {np.median(values):.1f} s of being wrong (worst {max(values):.1f}), within 5 s "
            f"{within:.2f}, not at all {missed}, by its name {named_right:.2f}, else {sorted({*names[name]} - {name})}"
        )


def speed_rows(seeds: range, folder: Path) -> Iterator[str]:
    drive = ordinary(seeds[0], folder, 4.0)
    for name, lost_at in (("without its sensor", 0.0), ("with it, learning", None)):
        took = []
        for _ in range(3):
            began = time.process_time()
            oc.angle(drive.signals, drive.vehicle, sensor_lost_at=lost_at)
            took.append(time.process_time() - began)
        yield f"{name}: {len(drive.true_rad) / min(took) / 1e6:.1f} M samples/s, table and all"


SECTIONS: dict[str, Callable[[range, Path], Iterator[str]]] = {
    "manoeuvres": manoeuvre_rows,
    "ordinary": ordinary_rows,
    "payload": payload_rows,
    "real": real_rows,
    "faults": fault_rows,
    "speed": speed_rows,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drives", type=int, default=40)
    parser.add_argument("--tuning", action="store_true")
    parser.add_argument("--only", default=",".join(SECTIONS))
    given = parser.parse_args()
    first = TUNING_FROM if given.tuning else REPORTED_FROM
    seeds = range(first, first + given.drives)
    with tempfile.TemporaryDirectory() as folder:
        for name in given.only.split(","):
            print(f"-- {name}, seeds {seeds[0]} to {seeds[-1]}", flush=True)
            for line in SECTIONS[name](seeds, Path(folder)):
                print(line, flush=True)


if __name__ == "__main__":
    main()
