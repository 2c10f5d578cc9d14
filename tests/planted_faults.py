"""A drive without faults, and faults to plant in it."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl

from oncenter.findings import Finding
from oncenter.signals import DEGREE, SIGNALS, Signals, Source
from oncenter.vehicle import Vehicle

EXAMPLES = Path(__file__).parents[1] / "examples"
RATE_HZ = 50.0
TRUCK = Vehicle(wheelbase_m=3.7, steering_ratio=19.3, track_width_rear_m=1.83)
K_US = 0.86 * DEGREE  # rad/(m/s^2) at the road wheel

Fault = Callable[[Signals], Signals]


def drive(
    seed: int = 1,
    duration_s: float = 300.0,
    bends: float = 1.0,
    play_deg: float = 3.0,
    lag_s: float = 0.15,
    swing: float = 9.5,
) -> Signals:
    """A truck with offset, understeer, play, lag and noise: stands, then goes at 12.5 m/s and up to `swing` off."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, duration_s, 1 / RATE_HZ)
    v = np.where(t < 5, 0.0, 12.5 + swing * np.sin(2 * np.pi * (t - 5) / 110 - np.pi / 2))
    road = sum(np.sin(2 * np.pi * t / period + rng.uniform(0, 6)) for period in (7.0, 19.0, 31.0)) / 1.7
    a_y = bends * 1.6 * road * np.minimum((v / 10) ** 2, 1.0)
    curvature = a_y / np.maximum(v, 1.0) ** 2
    wheel = 19.3 * (3.7 * curvature + K_US * a_y)
    play = np.clip(a_y / 0.1, -1, 1) * play_deg / 2 * DEGREE
    angle = later(wheel + play, -lag_s, t) + 2.0 * DEGREE + 0.1 * DEGREE * rng.standard_normal(len(t))
    r = curvature * v
    columns = {
        "steering_wheel_angle": np.round(angle * 1024) / 1024,
        "yaw_rate": np.round((r + 0.1 * DEGREE * rng.standard_normal(len(t))) * 8192) / 8192,
        "vehicle_speed": v,
        "lateral_acceleration": r * v + 0.15 + 0.1 * rng.standard_normal(len(t)),
        "wheel_speed_front_left": v - r * 1.02,
        "wheel_speed_front_right": v + r * 1.02,
        "wheel_speed_rear_left": v - r * 0.915 + 0.01 * rng.standard_normal(len(t)),
        "wheel_speed_rear_right": v + r * 0.915 + 0.01 * rng.standard_normal(len(t)),
        "steering_wheel_angle_sensor_type": np.ones_like(t),
    }
    table = pl.DataFrame({"time_s": t, **{SIGNALS[name].column: values for name, values in columns.items()}})
    sources = {name: Source("VDC2 from 0x3E", RATE_HZ, len(t), 0) for name in columns}
    return Signals(table, sources, RATE_HZ, "synthetic")


def later(x: np.ndarray, by_s: float, t: np.ndarray) -> np.ndarray:
    return np.interp(t - by_s, t, x)


def changed(signals: Signals, name: str, change: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Signals:
    """One signal put through `change(values, time)`."""
    column = SIGNALS[name].column
    new = change(signals.table[column].to_numpy(), signals.table["time_s"].to_numpy())
    return replace(signals, table=signals.table.with_columns(pl.Series(column, new)))


def without(signals: Signals, *names: str) -> Signals:
    kept = {name: source for name, source in signals.sources.items() if name not in names}
    return replace(signals, table=signals.table.drop(SIGNALS[name].column for name in names), sources=kept)


def wheels_swapped(signals: Signals) -> Signals:
    """Swaps left and right."""
    other = {"left": "right", "right": "left"}
    swap = {name: re.sub("left|right", lambda side: other[side[0]], name) for name in signals.table.columns}
    return replace(signals, table=signals.table.rename(swap))


def _axle(signals: Signals, axle: str, change: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Signals:
    """An axle whose difference, right less left, is put through `change(values, time)`; its mean stays."""
    left, right = (SIGNALS[f"wheel_speed_{axle}_{side}"].column for side in ("left", "right"))
    table = signals.table
    mean = 0.5 * (table[left] + table[right]).to_numpy()
    half = 0.5 * change((table[right] - table[left]).to_numpy(), table["time_s"].to_numpy())
    columns = pl.Series(left, mean - half), pl.Series(right, mean + half)
    return replace(signals, table=table.with_columns(*columns))


def axle_locked(axle: str) -> Fault:
    """Left and right turn alike, as with a locked differential."""
    return lambda signals: _axle(signals, axle, lambda x, t: 0.0 * x)


def axle_leads(axle: str, by_s: float) -> Fault:
    return lambda signals: _axle(signals, axle, lambda x, t: later(x, -by_s, t))


def axle_turns(axle: str, factor: float) -> Fault:
    """Its difference times `factor`: 1.7 by load transfer, -1 where left and right are swapped."""
    return lambda signals: _axle(signals, axle, lambda x, t: factor * x)


def axle_in_steps(axle: str, step: float) -> Fault:
    """Both wheels relative to their mean in steps, as EBC2 has them."""
    return lambda signals: _axle(signals, axle, lambda x, t: 2.0 * np.round(0.5 * x / step) * step)


def scaled(name: str, factor: float) -> Fault:
    return lambda signals: changed(signals, name, lambda x, t: x * factor)


def delayed(name: str, by_s: float) -> Fault:
    return lambda signals: changed(signals, name, lambda x, t: later(x, by_s, t))


def shifted(name: str, by: float) -> Fault:
    return lambda signals: changed(signals, name, lambda x, t: x + by)


def in_steps(name: str, step: float) -> Fault:
    return lambda signals: changed(signals, name, lambda x, t: np.round(x / step) * step)


def held(name: str, from_s: float) -> Fault:
    return lambda signals: changed(signals, name, lambda x, t: np.where(t > from_s, x[np.argmax(t > from_s)], x))


def both(*faults: Fault) -> Fault:
    def apply(signals: Signals) -> Signals:
        for fault in faults:
            signals = fault(signals)
        return signals

    return apply


def only(findings: tuple[Finding, ...]) -> Finding:
    assert len(findings) == 1, [finding.text for finding in findings]
    return findings[0]


WHEELS = tuple(name for name in SIGNALS if name.startswith("wheel_speed"))


def in_degrees(x: np.ndarray, t: np.ndarray) -> np.ndarray:
    return x / DEGREE


def dead(x: np.ndarray, t: np.ndarray) -> np.ndarray:
    return 0.05 * np.random.default_rng(5).standard_normal(len(x))


def noisy(signals: Signals) -> Signals:
    """A vehicle speed without repeated values, as after interpolation."""
    noise = 0.01 * np.random.default_rng(3).standard_normal(signals.table.height)
    return changed(signals, "vehicle_speed", lambda x, t: np.where(x > 0.0, x + noise, x))


def wheels_held(signals: Signals, from_s: float) -> Signals:
    return both(*(held(name, from_s) for name in WHEELS))(signals)
