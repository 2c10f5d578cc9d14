"""Faulty and healthy sensors, for bench/angle.py."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
from accuracy_rows import with_kicks
from angle_drives import LEARNING_S, Array, healthy, ordinary
from angle_lines import Line
from population import Uniform

import oncenter as oc
from oncenter.signals import DEGREE

FAST_M_S = 8.0
WITHIN_S = 5.0
LIMIT_DEG, LIMIT_SDS = 10.0, 5.5
KICKED_ONE_IN = 9  # includes every kind of drive
NAMED_AFTER_TICKS = 1000  # a reversed sign is detectable only in bends


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


def _lost(measured: Array, at: int, random: np.random.Generator) -> Array:
    return np.where(np.arange(len(measured)) >= at, np.nan, measured)


FAULTS: dict[str, Callable[[Array, int, np.random.Generator], Array]] = {
    "stuck": _stuck,
    "jumped": _jumped,
    "drifting": _drifting,
    "wrong_sign": _wrong_sign,
    "remounted": _remounted,
    "lost": _lost,
}


def fault_lines(seeds: range, folder: Path) -> Iterator[Line]:
    """Detection time after an error above the larger of 10 deg and 5.5 sd, above 8 m/s."""
    late: dict[str, list[float]] = {name: [] for name in FAULTS}
    names: dict[str, list[str]] = {name: [] for name in FAULTS}
    shown: dict[str, int] = dict.fromkeys(FAULTS, 0)
    for seed in seeds:
        random = np.random.default_rng([seed, 7])
        drive = ordinary(seed, folder, Uniform(0.0, 15.0))
        sd = oc.angle(drive.signals, drive.vehicle, sensor_lost_at=LEARNING_S)["standard_deviation_rad"].to_numpy()
        limit = np.maximum(LIMIT_DEG * DEGREE, LIMIT_SDS * sd)
        measured = drive.signals.table["steering_wheel_angle_rad"].to_numpy()
        for name, spoil in FAULTS.items():
            at = int(random.integers(70_000, 200_000))
            spoiled = spoil(measured, at, random)
            table = drive.signals.table.with_columns(steering_wheel_angle_rad=pl.Series(spoiled))
            kinds = oc.angle(replace(drive.signals, table=table), drive.vehicle)["sensor_fault"].to_numpy()
            after = np.arange(len(kinds)) >= at
            wrong = after & (np.isnan(spoiled) | (np.abs(spoiled - measured) > limit)) & (drive.speed_m_s > FAST_M_S)
            reported = np.flatnonzero(after & (kinds != "none") & ((kinds != "lost") | (name == "lost")))
            first = reported[0] if len(reported) else len(wrong)
            late[name].append(float(np.sum(wrong[:first])) / 100.0)
            shown[name] += bool(wrong.any())
            named_at = min(first + NAMED_AFTER_TICKS, len(kinds) - 1)
            names[name].append(str(kinds[named_at]) if len(reported) else "not found")
    for name, values in late.items():
        within = int(np.sum(np.asarray(values) <= WITHIN_S))
        called = np.mean([kind == name for kind in names[name]])
        missed = sum(kind == "not found" for kind in names[name])
        yield Line(
            name.replace("_", " "),
            "",
            f"{within} of {len(values)} within 5 s of being wrong, median {np.median(values):.1f} s, worst "
            f"{max(values):.1f} s; wrong at all in {shown[name]}, not found {missed}, by its name {called:.0%}",
            "all within 5 s",
            within == len(values),
        )


def healthy_lines(seeds: range, folder: Path) -> Iterator[Line]:
    """All healthy drives, and one in nine also with kerbs and interventions of a stability control."""
    alarms: list[str] = []
    kicked_alarms: list[str] = []
    hours = kicked_hours = 0.0
    for seed in seeds:
        drive = healthy(seed, folder)
        driven_h = (drive.signals.table.height / drive.signals.rate_hz - LEARNING_S) / 3600.0
        hours += driven_h
        alarms += _alarms(seed, drive.signals, drive.vehicle)
        if seed % KICKED_ONE_IN == 0:
            kicked = with_kicks(drive.signals, np.random.default_rng([seed, 11]))
            kicked_hours += driven_h
            kicked_alarms += _alarms(seed, kicked, drive.vehicle)
    yield Line(
        f"{hours:.0f} h, all kinds of drives in turn",
        "",
        _in_words(alarms),
        "at most 1 in 100 h",
        len(alarms) <= max(1.0, hours / 100.0),
    )
    yield Line(f"{kicked_hours:.0f} h of them, with kerbs and a stability control", "", _in_words(kicked_alarms))


def _alarms(seed: int, signals: oc.Signals, vehicle: oc.Vehicle) -> list[str]:
    table = oc.angle(signals, vehicle)
    fault = table["sensor_fault"].to_numpy() != "none"
    begins = np.flatnonzero(fault[1:] & ~fault[:-1])
    return [f"drive {seed} {table['sensor_fault'][int(k) + 1]} at {k / 100.0:.0f} s" for k in begins]


def _in_words(alarms: list[str]) -> str:
    examples = f" ({'; '.join(alarms[:8])}{'; …' if len(alarms) > 8 else ''})" if alarms else ""
    return f"{len(alarms)} false alarms in {len({alarm.split()[1] for alarm in alarms})} drives{examples}"
