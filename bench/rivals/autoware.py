"""Autoware's steering offset estimator: a scalar Kalman filter over the kinematic single-track model, at 10 Hz.

phi = v/L, y = r - phi delta, theta += K (y - phi theta); delta at the tyre, offset = -theta.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numba import njit

from rivals import EVERY_TENTH, MINUTE_TICKS, Array, Course, Known

P_FIRST_RAD2 = 0.5
Q_RAD2 = 1e-6  # per step
R_RAD2_S2 = 0.5
SPEED_MIN_M_S = 1.0
YAW_RATE_MAX_RAD_S = 0.02
ANGLE_MAX_RAD = 0.03  # at the tyre
ANGLE_RATE_MAX_RAD_S = 0.02  # at the tyre
STEP_S = 0.1


def autoware(columns: Mapping[str, Array], known: Known) -> Course:
    value, sd = _course(
        columns["steering_wheel_angle_rad"] / known.steering_ratio,
        columns["yaw_rate_rad_s"],
        columns["vehicle_speed_m_s"],
        known.wheelbase_m,
    )
    return Course(value * known.steering_ratio, sd * known.steering_ratio, np.isfinite(value))


@njit(cache=True)
def _course(delta, r, v, L):
    minutes = len(delta) // MINUTE_TICKS
    value, sd = np.full(minutes, np.nan), np.full(minutes, np.nan)
    theta, P, updates = 0.0, P_FIRST_RAD2, 0
    for k in range(len(delta)):
        if k % EVERY_TENTH == 0 and k >= EVERY_TENTH:
            rate = (delta[k] - delta[k - EVERY_TENTH]) / STEP_S
            if (
                v[k] >= SPEED_MIN_M_S
                and abs(r[k]) <= YAW_RATE_MAX_RAD_S
                and abs(delta[k]) <= ANGLE_MAX_RAD
                and abs(rate) <= ANGLE_RATE_MAX_RAD_S
            ):
                phi = v[k] / L
                P += Q_RAD2
                gain = P * phi / (R_RAD2_S2 + phi * phi * P)
                theta += gain * (r[k] - phi * delta[k] - phi * theta)
                P *= 1.0 - gain * phi
                updates += 1
        if (k + 1) % MINUTE_TICKS == 0 and updates > 0:
            value[k // MINUTE_TICKS], sd[k // MINUTE_TICKS] = -theta, np.sqrt(P)
    return value, sd
