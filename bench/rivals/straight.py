"""The output of the thesis's gate for the estimators of its further work (5.5.1): filtered as in 5.1.1, gated by (34),
(35) and v > 10 m/s, less the model (37).

The yaw rate is used without correction. K_us is given, not estimated, which is an advantage over the thesis.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import njit

from oncenter import _core
from rivals import MINUTE_TICKS, Array, Known

RATE_HZ = MINUTE_TICKS / 60.0
SLOPE_POINTS, SLOPE_EVERY = 11, 10  # dv/dt: the line through speeds 0.1 s apart


@dataclass(frozen=True)
class Straight:
    """One element per tick: the tick t1 earlier, if the gate accepts it.

    Attributes:
        passed: whether it is accepted.
        residual_rad: measured angle less (37) without offset.
        turning_m_s2: r v, left positive: the side to which the truck turned.
    """

    passed: npt.NDArray[np.bool_]
    residual_rad: Array
    turning_m_s2: Array


def straight(columns: Mapping[str, Array], known: Known) -> Straight:
    limits = _core.default_params()
    i, L, K = known.steering_ratio, known.wheelbase_m, understeer_gradient(known)
    b0, a1, a2 = lowpass(limits["cutoff_hz"])
    r, v, a_y = (
        filtered(columns[name], b0, a1, a2)
        for name in ("yaw_rate_rad_s", "vehicle_speed_m_s", "lateral_acceleration_m_s2")
    )
    n = np.arange(len(v), dtype=float)
    late = mean_group_delay_s(b0, a1, a2, limits["delay_band_hz"]) * RATE_HZ
    angle = np.interp(n - late, n, columns["steering_wheel_angle_rad"])
    per_m = r / np.maximum(v, 1.0)
    clean = (
        (n >= SLOPE_POINTS * SLOPE_EVERY)
        & (v > limits["speed_min_m_s"])
        & (np.abs(per_m) < limits["curvature_max_1_m"])
        & (np.abs(slope(v)) < limits["longitudinal_acceleration_max_m_s2"])
        & (np.abs(a_y - r * v) < limits["bank_max_m_s2"])
    )
    t1 = round(limits["clean_time_s"] * RATE_HZ)
    residual = angle - i * (L * per_m + K * a_y)
    return Straight(clean_for(clean, t1 + 1), np.roll(residual, t1), np.roll(r * v, t1))


def understeer_gradient(known: Known) -> float:
    """K_us/g of (10), rad/(m/s^2) at the road wheel, from the stiffnesses."""
    a, b = known.front_axle_distance_m, known.wheelbase_m - known.front_axle_distance_m
    slip = b / known.front_cornering_stiffness_n_rad - a / known.rear_cornering_stiffness_n_rad
    return known.mass_kg / known.wheelbase_m * slip


def lowpass(cutoff_hz: float) -> tuple[float, float, float]:
    """b0, a1, a2 of b0 (1 + z^-1)^2/(1 + a1 z^-1 + a2 z^-2), maximally flat, bilinear and prewarped."""
    c = math.tan(math.pi * cutoff_hz / RATE_HZ)
    below = 1.0 + math.sqrt(2.0) * c + c * c
    return c * c / below, 2.0 * (c * c - 1.0) / below, (1.0 - math.sqrt(2.0) * c + c * c) / below


def mean_group_delay_s(b0: float, a1: float, a2: float, band_hz: float) -> float:
    """Delay in s from 0 to band_hz: minus the phase at band_hz over its angular frequency."""
    z = cmath.exp(-2j * math.pi * band_hz / RATE_HZ)
    return -cmath.phase(b0 * (1.0 + z) ** 2 / (1.0 + a1 * z + a2 * z * z)) / (2.0 * math.pi * band_hz)


def slope(speed: Array) -> Array:
    """dv/dt in m/s^2 of every SLOPE_EVERY-th speed, held in between; nothing before SLOPE_POINTS of them."""
    seconds = (np.arange(SLOPE_POINTS) - SLOPE_POINTS // 2) * SLOPE_EVERY / RATE_HZ
    kept = np.concatenate([np.full(SLOPE_POINTS - 1, speed[0]), speed[::SLOPE_EVERY]])
    slopes = np.convolve(kept, seconds[::-1] / np.sum(seconds**2), mode="valid")
    return np.repeat(slopes, SLOPE_EVERY)[: len(speed)]


@njit(cache=True)
def filtered(values, b0, a1, a2):
    """Filters from the steady state of the first value."""
    out = np.empty(len(values))
    s2 = (b0 - a2) * values[0]
    s1 = s2 + (2.0 * b0 - a1) * values[0]
    for k in range(len(values)):
        out[k] = b0 * values[k] + s1
        s1 = s2 + 2.0 * b0 * values[k] - a1 * out[k]
        s2 = b0 * values[k] - a2 * out[k]
    return out


@njit(cache=True)
def clean_for(clean, ticks):
    """Whether the last so many ticks, including this one, were clean."""
    result, run = np.zeros(len(clean), np.bool_), 0
    for k in range(len(clean)):
        run = run + 1 if clean[k] else 0
        result[k] = run >= ticks
    return result
