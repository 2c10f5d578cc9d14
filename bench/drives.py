"""The drive of the benches: columns of ticks with a known offset.

Made of a few sinusoids so that every branch of the core is taken: straights, bends, stops, missing values, gaps.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Column = npt.NDArray[np.float64]

RATE_HZ = 100.0
WHEELBASE_M, STEERING_RATIO = 3.7, 19.3  # Table 2
OFFSET_RAD = 0.0356  # 2.04 deg
UNDERSTEER_GRADIENT = 0.007  # rad/(m/s^2), 0.4 deg/(m/s^2)
CROWN_M_S2 = 0.12


def ticks(count: int, seed: int = 1) -> dict[str, Column]:
    """Input columns of the core, `count` rows at RATE_HZ."""
    noise = np.random.default_rng(seed).normal
    t = np.arange(count) / RATE_HZ
    speed = np.clip(15 + 10 * np.sin(t / 90) + 6 * np.sin(t / 37) + 1.2 * np.sin(t / 4), 0, 25)
    curvature = 0.004 * np.sin(t / 7.5) ** 7
    yaw_rate = curvature * speed
    acceleration = yaw_rate * speed + CROWN_M_S2 + 0.1 * np.sin(t / 61)
    road_wheel_angle = WHEELBASE_M * curvature + UNDERSTEER_GRADIENT * acceleration
    columns = {
        "time_s": t,
        "steering_wheel_angle_rad": OFFSET_RAD + STEERING_RATIO * road_wheel_angle + noise(0, 0.01, count),
        "yaw_rate_rad_s": yaw_rate + noise(0, 0.002, count),
        "vehicle_speed_m_s": np.where(speed > 0, speed + noise(0, 0.02, count), 0.0),
        "lateral_acceleration_m_s2": acceleration + noise(0, 0.1, count),
    }
    columns["time_s"] += np.arange(count) // 60_000  # a gap of one second every ten minutes
    columns["time_s"][40_000::60_000] = columns["time_s"][39_999 : count - 1 : 60_000]  # a repeated time stamp
    columns["steering_wheel_angle_rad"][np.arange(count) % 20_000 < 5] = np.nan
    return columns
