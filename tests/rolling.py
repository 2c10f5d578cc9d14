"""Drives for the gyro's filter: wheel speeds and yaw rate, with given bias and radii."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from oncenter import _core

Array = npt.NDArray[np.float64]

RATE_HZ = 100.0
WHEELBASE, RATIO = 3.7, 19.3
TRACK_FRONT, TRACK_REAR = 2.05, 1.83
CORNERS = ("front_left", "front_right", "rear_left", "rear_right")


@dataclass(frozen=True)
class Truth:
    bias: float = 0.005  # rad/s
    drift: float = 0.0  # rad/s^2
    drift_from_s: float = 0.0
    mismatch_rear: float = 0.004  # r_l/r_r - 1
    mismatch_front: float = -0.003
    load: float = 0.001  # s^2/m, what the lateral acceleration adds to it
    gyro_noise: float = 0.002  # rad/s
    wheel_noise: float = 0.01  # m/s


def course(t: Array, truth: Truth) -> Array:
    """The gyro's bias over time, rad/s."""
    return truth.bias + truth.drift * np.clip(t - truth.drift_from_s, 0.0, None)


def rolling(
    seed: int,
    duration_s: float = 400.0,
    truth: Truth | None = None,
    *,
    standing_s: float = 5.0,
    speeds_m_s: tuple[float, float] = (12.0, 24.0),
    turning: float = 1.0,
    banked: float = 0.0,
) -> dict[str, Array]:
    """Columns by table name: standstill, then slowly varying speed on a winding road. `banked`: share of r v that the
    bends' bank takes."""
    truth = truth or Truth()
    rng = np.random.default_rng(seed)
    count = int(duration_s * RATE_HZ)
    t = np.arange(count) / RATE_HZ
    low, high = speeds_m_s
    cruise = low + (high - low) * (0.5 - 0.5 * np.cos(2 * np.pi * t / 180.0 + seed))
    v = np.where(t < standing_s, 0.0, np.minimum(cruise, 1.0 * (t - standing_s))) if standing_s > 0 else cruise

    def knots(every_s: float) -> Array:
        at = np.arange(0.0, duration_s + 2 * every_s, every_s)
        return np.interp(t, at, rng.standard_normal(len(at)))

    bends, lane = knots(8.0), knots(1.5)
    r = turning * v * (0.0012 * bends + 0.0002 * lane)
    a_y = (1.0 - banked) * r * v + 0.2 * (v > 0)
    wheels = {}
    for axle, track, mismatch in (
        ("front", TRACK_FRONT, truth.mismatch_front),
        ("rear", TRACK_REAR, truth.mismatch_rear),
    ):
        larger = 0.5 * (mismatch + truth.load * a_y)
        cos = np.cos(np.where(v > 1, WHEELBASE * r / np.maximum(v, 1), 0.0)) if axle == "front" else 1.0
        wheels[f"{axle}_left"] = (v - 0.5 * track * r * cos) / (1.0 + larger)
        wheels[f"{axle}_right"] = (v + 0.5 * track * r * cos) / (1.0 - larger)
    noisy = {c: np.abs(w + truth.wheel_noise * rng.standard_normal(count)) for c, w in wheels.items()}
    return {
        "time_s": t,
        "steering_wheel_angle_rad": RATIO * WHEELBASE * r / np.maximum(v, 1.0) + 0.035,
        "yaw_rate_rad_s": r + course(t, truth) + truth.gyro_noise * rng.standard_normal(count),
        "vehicle_speed_m_s": v,
        "lateral_acceleration_m_s2": a_y,
    } | {f"wheel_speed_{c}_m_s": np.where(v > 0, noisy[c], 0.0) for c in CORNERS}


def core_of(
    method: str = "thesis", *, rear: float = TRACK_REAR, front: float = TRACK_FRONT, **params: float
) -> _core.Core:
    return _core.Core(
        WHEELBASE, RATIO, params, RATE_HZ, track_width_front_m=front, track_width_rear_m=rear, method=method
    )


def as_ebc2(columns: dict[str, Array]) -> dict[str, Array]:
    """Every 100 ms: front axle speed in steps of 1/256 km/h, relative wheel speeds in steps of 1/16; linear between."""
    rows = np.arange(len(columns["time_s"]))
    sent = rows[::10]
    km_h = {c: 3.6 * columns[f"wheel_speed_{c}_m_s"][sent] for c in CORNERS}
    axle = 0.5 * (km_h["front_left"] + km_h["front_right"])
    coarse = {c: np.round(256 * axle) / 256 + np.round(16 * (km_h[c] - axle)) / 16 for c in CORNERS}
    return columns | {f"wheel_speed_{c}_m_s": np.interp(rows, sent, coarse[c] / 3.6) for c in CORNERS}
