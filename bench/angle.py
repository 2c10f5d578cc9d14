"""Error of the steering wheel angle without its sensor: the observer compared with the thesis's estimators.

    python bench/angle.py [--drives N] [--tuning] [--only WORD,...] [--page]

Ordinary drives of ten minutes with and an hour without the sensor, the manoeuvres of Figures 10, 11, 12 and 14, a
changed payload, real cars, faulty and healthy sensors, and the speed. Seeds from 101 on are for reporting, seeds from 1
on (--tuning) for tuning. --page writes the results into docs/angle.md.
"""

from __future__ import annotations

import argparse
import math
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from angle_drives import (
    LEARNING_S,
    RAMP_BEGIN_S,
    RAMP_FROM_DEG,
    RAMP_TO_DEG,
    AngleDrive,
    Array,
    hard_turn,
    named,
    ordinary,
    payload_changed,
)
from angle_faults import FAST_M_S, fault_lines, healthy_lines
from angle_lines import Line, write_tables
from population import Uniform

import oncenter as oc
from oncenter.angle.run import METHODS
from oncenter.signals import DEGREE, SignalName, Signals

TUNING_FROM, REPORTED_FROM = 1, 101
FLANK_S = 5.0  # of the ten minutes: minimum time on each flank of the play to identify mid-play
HEALTHY_FROM, HEALTHY_DRIVES = 2001, 100
PAGE = Path(__file__).parents[1] / "docs" / "angle.md"
REAL = Path(os.environ.get("ONCENTER_REAL_DATA", Path(__file__).parents[1] / ".." / "shared" / "data"))


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def estimated(drive: AngleDrive, method: str = "observer", **options: object) -> tuple[Array, Array]:
    """Error and standard deviation, deg."""
    table = oc.angle(drive.signals, drive.vehicle, method=method, **options)
    error = (table["steering_wheel_angle_rad"].to_numpy() - drive.true_rad) / DEGREE
    return error, table["standard_deviation_rad"].to_numpy() / DEGREE


def ordinary_lines(seeds: range, folder: Path) -> Iterator[Line]:
    rows: dict[str, tuple[Uniform | float, float]] = {
        "play 0 to 4 deg": (Uniform(0.0, 4.0), 1.5),
        "play 15 deg": (15.0, 3.0),
    }
    for name, (play, required_deg) in rows.items():
        errors: dict[str, list[float]] = {method: [] for method in (*METHODS, "observer, --smooth", "always straight")}
        covered, half_widths, scatter, saw_both = [], [], [], []
        for seed in seeds:
            drive = ordinary(seed, folder, play)
            saw_both.append(min(oc.offset(_first(drive.signals, LEARNING_S), drive.vehicle).side_force_s) >= FLANK_S)
            after = (np.arange(len(drive.true_rad)) >= 100 * LEARNING_S) & (drive.speed_m_s > FAST_M_S)
            for method in METHODS:
                error, sd = estimated(drive, method, sensor_lost_at=LEARNING_S)
                errors[method].append(rms(error[after]))
                if method == "observer":
                    covered.append(float(np.mean(np.abs(error[after]) < 1.96 * sd[after])))
                    scatter.append(float(np.std(error[after])))
                    half_widths.append(1.96 * float(np.median(sd[after])))
            error, _ = estimated(drive, sensor_lost_at=LEARNING_S, smooth=True)
            errors["observer, --smooth"].append(rms(error[after]))
            errors["always straight"].append(rms(drive.true_rad[after] / DEGREE))
        for method, values in errors.items():
            within = sum(value <= required_deg for value in values)
            required = (
                {"required": f"at most {required_deg:g} deg", "met": within == len(values)}
                if method == "observer"
                else {}
            )
            yield Line(
                name,
                method,
                f"RMS {np.median(values):.2f} deg (median), {max(values):.2f} (worst), in {within} "
                f"of {len(values)} at most {required_deg:g}",
                **required,
            )
        both = [value for value, saw in zip(errors["observer"], saw_both, strict=True) if saw]
        accuracy = f"RMS {np.median(both):.2f} deg (median), {max(both, default=math.nan):.2f} (worst)"
        within = sum(value <= required_deg for value in both)
        yield Line(
            name,
            "observer",
            f"where the ten minutes showed both flanks of the play, {FLANK_S:g} s each: {accuracy}, in {within} of "
            f"{len(both)} at most {required_deg:g}",
        )
        # the error without that of the estimated offset
        scatter_words = f"about its own mean RMS {np.median(scatter):.2f} deg (median), {max(scatter):.2f} (worst)"
        yield Line(name, "observer", scatter_words)
        mean = float(np.mean(covered))
        yield Line(
            name,
            "observer",
            f"interval covers {mean:.1%} of all ticks, {min(covered):.0%} of the worst drive's; half-width "
            f"{np.median(half_widths):.1f} deg (median)",
            "92 to 99 %",
            0.92 <= mean <= 0.99,
        )


def payload_lines(seeds: range, folder: Path) -> Iterator[Line]:
    covered, errors = [], []
    for seed in seeds:
        before, after = payload_changed(seed, folder)
        fast = after.speed_m_s > FAST_M_S
        error, sd = estimated(replace(after, vehicle=before.vehicle), taught_by=(before.signals,), sensor_lost_at=0.0)
        covered.append(float(np.mean(np.abs(error[fast]) < 1.96 * sd[fast])))
        errors.append(rms(error[fast]))
    mean = float(np.mean(covered))
    yield Line(
        "payload +-50 %",
        "observer",
        f"covers {mean:.1%}, worst drive {min(covered):.0%}; RMS {np.median(errors):.2f} deg (median), "
        f"{max(errors):.2f} (worst)",
        "at least 85 %",
        mean >= 0.85,
    )


def manoeuvre_lines(seeds: range, folder: Path) -> Iterator[Line]:
    teachers = {seed: _first(named("thesis_drive", seed).signals, LEARNING_S) for seed in seeds}
    yield from _of_scenario("Fig. 10, 17 km/h", "low_speed_manoeuvre", seeds, teachers)
    yield from _of_scenario("Figs. 11, 14, 46 km/h", "mid_speed_manoeuvre", seeds, teachers)
    for lag_s in (0.0, 0.1):
        if lag_s:
            teachers = {seed: _first(named("thesis_drive", seed, lag_s).signals, LEARNING_S) for seed in seeds}
        turns = {seed: hard_turn(seed, folder, lag_s) for seed in seeds}
        for method in ("observer", "yaw-rate", "yaw-rate-understeer"):
            times, overshoots = np.asarray([_of_turn(turns[seed], method, teachers[seed]) for seed in seeds]).T
            met = bool(max(times) <= 0.60 and max(overshoots) <= 0.10)
            required = {"required": "0.60 s, 10 %", "met": met} if method == "observer" else {}
            yield Line(
                f"Fig. 12, lag {lag_s:.1f} s",
                method,
                f"90 % after {np.median(times):.2f} s (worst {max(times):.2f}), overshoot "
                f"{100 * np.median(overshoots):.0f} % (worst {100 * max(overshoots):.0f})",
                **required,
            )


def _of_scenario(name: str, scenario: str, seeds: range, teachers: dict[int, Signals]) -> Iterator[Line]:
    drives = {seed: named(scenario, seed) for seed in seeds}
    for method in METHODS:
        rows = []
        for seed, drive in drives.items():
            error, _ = estimated(drive, method, taught_by=(teachers[seed],), sensor_lost_at=0.0)
            rows.append(_of_manoeuvre(drive, error))
        large, small, bias = np.asarray(rows).T
        parts = [f"below 200 deg RMS {np.median(small):.2f} deg (worst {max(small):.2f})"]
        required, met = "RMS at most 5 deg below 200 deg, 3 % above", bool(max(small) <= 5.0 and max(large) <= 0.03)
        if large.any():
            parts.insert(0, f"above 200 deg {100 * np.median(large):.1f} % (worst {100 * max(large):.1f})")
        else:
            parts.append(f"bias in bends {np.median(bias):.2f} deg (worst {max(np.abs(bias)):.2f})")
            required, met = "bias at most 2 deg", bool(max(np.abs(bias)) <= 2.0)
        given = {"required": required, "met": met} if method == "observer" else {}
        yield Line(name, method, ", ".join(parts), **given)


def _of_manoeuvre(drive: AngleDrive, error: Array) -> tuple[float, float, float]:
    """Relative error above 200 deg, RMS error in deg below, and bias in deg toward larger angles in bends above
    0.8 m/s^2; 0 without such ticks."""
    moving = (np.arange(len(error)) > 2500) & (drive.speed_m_s > 1.0)
    deg = drive.true_rad / DEGREE
    turned, bends = moving & (np.abs(deg) > 200.0), moving & (np.abs(drive.lateral_acceleration_m_s2) > 0.8)
    large = rms(error[turned] / deg[turned]) if turned.any() else 0.0
    bias = float(np.mean(error[bends] * np.sign(deg[bends]))) if bends.any() else 0.0
    return large, rms(error[moving & ~turned]), bias


def _of_turn(drive: AngleDrive, method: str, teacher: Signals) -> tuple[float, float]:
    """Seconds from the begin of the turn until 90 % of it, and the relative overshoot."""
    table = oc.angle(drive.signals, drive.vehicle, method=method, taught_by=(teacher,), sensor_lost_at=0.0)
    begin = round(100 * RAMP_BEGIN_S)
    found = table["steering_wheel_angle_rad"].to_numpy()[begin : begin + 300] / DEGREE
    reached = np.flatnonzero(found <= RAMP_FROM_DEG + 0.9 * (RAMP_TO_DEG - RAMP_FROM_DEG))
    overshoot = (RAMP_TO_DEG - found.min()) / (RAMP_FROM_DEG - RAMP_TO_DEG)
    return (reached[0] / 100 if len(reached) else float("inf")), float(overshoot)


def _first(signals: Signals, seconds: float) -> Signals:
    return replace(signals, table=signals.table.head(round(seconds * signals.rate_hz)))


def real_lines(seeds: range, folder: Path) -> Iterator[Line]:
    car = oc.vehicle(Path(__file__).parents[1] / "examples" / "genesis.toml")
    names = {**car.signal_names, "lateral_speed": SignalName("vy_ref_mps", "m_s")}
    files = sorted((REAL / "genesis").glob("*.csv.gz"))
    if not files:
        yield Line("real drives", "", f"none in {REAL.name}")
        return
    drives = {file.name.removesuffix(".csv.gz"): oc.read(file, names=names) for file in files}
    for name, drive in drives.items():
        # the offset from the whole drive with its sensor gives the reference angle
        teachers = [other for key, other in drives.items() if key != name] if name.startswith("rfs") else []
        lost_at = 0.0 if teachers else 0.5 * len(drive.table) / drive.rate_hz
        required_deg = 3.0 if teachers else 2.5
        whole = oc.angle(drive, car, taught_by=teachers)
        measured = whole["measured_rad"].to_numpy()
        offset = np.nanmedian(measured - whole["steering_wheel_angle_rad"].to_numpy())
        after = np.arange(len(whole)) >= 100 * lost_at
        after &= (drive.table["vehicle_speed_m_s"].to_numpy() > 3.0) & np.isfinite(measured)
        for method in ("observer", "yaw-rate", "yaw-rate-understeer", "side-slip"):
            table = oc.angle(drive, car, method=method, sensor_lost_at=lost_at, taught_by=teachers)
            error = (table["steering_wheel_angle_rad"].to_numpy() - (measured - offset))[after] / DEGREE
            sd = table["standard_deviation_rad"].to_numpy()[after] / DEGREE
            found = (
                f"RMS {rms(error):.2f} deg, mean {error.mean():.2f}, covers {np.mean(np.abs(error) < 1.96 * sd):.0%}"
            )
            met = (
                {"required": f"at most {required_deg:g} deg", "met": rms(error) <= required_deg}
                if method == "observer"
                else {}
            )
            yield Line(name, method, found, **met)


def speed_lines(seeds: range, folder: Path) -> Iterator[Line]:
    drive = ordinary(seeds[0], folder, 4.0)
    for name, lost_at in (("without its sensor", 0.0), ("with it, learning", None)):
        took = []
        for _ in range(12):
            began = time.process_time()
            oc.angle(drive.signals, drive.vehicle, sensor_lost_at=lost_at)
            took.append(time.process_time() - began)
        slowest, fastest = (len(drive.true_rad) / each / 1e6 for each in (max(took), min(took)))
        found = f"{slowest:.1f} to {fastest:.1f} M samples/s in 12 rounds on one core, table and all"
        yield Line(name, "", found, "at least 3 M", fastest >= 3.0)


SECTIONS: dict[str, tuple[str, Callable[[range, Path], Iterator[Line]]]] = {
    "manoeuvres": ("The thesis's manoeuvres", manoeuvre_lines),
    "ordinary": ("An hour after the loss, above 8 m/s", ordinary_lines),
    "payload": ("Another load after the loss", payload_lines),
    "real": ("Real cars, above 3 m/s", real_lines),
    "faults": ("Sensors that fail, above 8 m/s, play 0 to 15 deg", fault_lines),
    "healthy": ("Sensors that do not", healthy_lines),
    "speed": ("Speed", speed_lines),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drives", type=int, default=40)
    parser.add_argument("--tuning", action="store_true")
    parser.add_argument("--only", default=",".join(SECTIONS))
    parser.add_argument("--page", action="store_true")
    given = parser.parse_args()
    first = TUNING_FROM if given.tuning else REPORTED_FROM
    found: dict[str, list[Line]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name in given.only.split(","):
            seeds = range(first, first + given.drives)
            if name == "healthy" and not given.tuning:
                seeds = range(HEALTHY_FROM, HEALTHY_FROM + HEALTHY_DRIVES)
            title, lines = SECTIONS[name]
            many = name not in ("real", "speed")
            print(f"-- {title}, seeds {seeds[0]} to {seeds[-1]}" if many else f"-- {title}", flush=True)
            kept = found.setdefault(f"{title}, {len(seeds)} drives" if many else title, [])
            for line in lines(seeds, Path(folder)):
                print(line, flush=True)
                kept.append(line)
    if given.page:
        write_tables(PAGE, found)


if __name__ == "__main__":
    main()
