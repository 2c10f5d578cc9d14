"""Random drives with straights and bends, crown, noise, offsets, holes and standstill.

They follow (10) with noise. For a truck with dynamics use the simulator.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

WHEELBASE = 3.9  # m
RATIO = 19.3


@dataclass(frozen=True)
class Truth:
    offset: float = 0.035  # rad
    understeer: float = 0.007  # rad/(m/s^2)
    yaw_rate_bias: float = 0.0  # rad/s
    crown: float = 0.1  # m/s^2, positive where the road falls to the right


def smooth(rng: np.random.Generator, count: int, rate_hz: float, memory_s: float) -> Array:
    """Noise of unit standard deviation with the correlation time memory_s, the same at every rate."""
    knots = rng.standard_normal(int(count / rate_hz / memory_s) + 4)
    return np.interp(np.arange(count) / rate_hz / memory_s, np.arange(len(knots)), knots)


def drive(seed: int, rate_hz: float, duration_s: float = 240.0, truth: Truth | None = None) -> dict[str, Array]:
    """Columns by table name: standstill at start and end, straights and bends to both sides in between."""
    truth = truth or Truth()
    rng = np.random.default_rng(seed)
    count = int(duration_s * rate_hz)
    t = np.arange(count) / rate_hz
    v = np.interp(t, [0, 3, 18, duration_s - 20, duration_s - 5, duration_s], [0, 0, 22, 22, 0, 0])
    v = v + np.where(v > 5, smooth(rng, count, rate_hz, 20.0), 0.0)
    bends = np.clip(smooth(rng, count, rate_hz, 6.0) - 0.7, 0, None) - np.clip(
        smooth(rng, count, rate_hz, 6.0) - 0.7, 0, None
    )
    curvature = 0.003 * bends + 1e-4 * smooth(rng, count, rate_hz, 2.0)
    curvature *= np.clip(v / 2.0, 0.0, 1.0)  # it stands with straight wheels: turned ones might creep through a turn
    r = v * curvature
    a_y = r * v + truth.crown * (1 + 0.5 * smooth(rng, count, rate_hz, 15.0)) * (v > 0.5)
    angle = RATIO * (WHEELBASE * curvature + truth.understeer * a_y) + truth.offset
    return {
        "time_s": t,
        "steering_wheel_angle_rad": angle + 0.01 * smooth(rng, count, rate_hz, 1.0),
        "yaw_rate_rad_s": r + truth.yaw_rate_bias + 0.002 * rng.standard_normal(count),
        "vehicle_speed_m_s": np.where(v > 0, np.abs(v + 0.02 * rng.standard_normal(count)), 0.0),
        "lateral_acceleration_m_s2": a_y + 0.05 * rng.standard_normal(count),
    }


def damaged(columns: dict[str, Array], seed: int) -> dict[str, Array]:
    """The same drive with NaN, absurd values, lost rows, repeated and backward time stamps."""
    rng = np.random.default_rng(seed)
    hurt = {name: values.copy() for name, values in columns.items()}
    count = len(hurt["time_s"])

    def places(how_many: int, longest: int) -> list[slice]:
        starts = rng.integers(0, count - longest, how_many)
        return [slice(int(s), int(s + n)) for s, n in zip(starts, rng.integers(1, longest, how_many), strict=True)]

    for name in list(hurt)[1:]:
        for piece in places(4, 30):
            hurt[name][piece] = rng.choice([np.nan, np.inf, -1e9])
    for piece in places(3, 4):
        hurt["time_s"][piece] = hurt["time_s"][piece.start]  # stands still
    for piece in places(3, 4):
        hurt["time_s"][piece] -= 1.0  # runs backward
    hurt["time_s"][places(1, 2)[0]] = np.nan
    kept = np.ones(count, bool)
    for piece in places(3, 60):
        kept[piece] = False
    return {name: values[kept] for name, values in hurt.items()}
