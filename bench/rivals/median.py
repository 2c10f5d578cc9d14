"""Agricultural autosteer: the median of the latest angles read while driving nearly straight."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numba import njit

from rivals import EVERY_TENTH, MINUTE_TICKS, Array, Course, Known, without_interval

ANGLES_MAX, ANGLES_MIN = 2000, 200  # at 10 Hz
CURVATURE_MAX_1_M = 1.0 / 800.0  # limit for nearly straight in the thesis, Table 4
SPEED_MIN_M_S = 2.0 / 3.6


def median(columns: Mapping[str, Array], known: Known) -> Course:
    return without_interval(
        _course(columns["steering_wheel_angle_rad"], columns["yaw_rate_rad_s"], columns["vehicle_speed_m_s"])
    )


@njit(cache=True)
def _course(angle, r, v):
    value = np.full(len(angle) // MINUTE_TICKS, np.nan)
    ring, count = np.zeros(ANGLES_MAX), 0
    for k in range(len(angle)):
        straight = v[k] >= SPEED_MIN_M_S and abs(r[k]) <= CURVATURE_MAX_1_M * v[k]
        if k % EVERY_TENTH == 0 and straight and not np.isnan(angle[k]):
            ring[count % ANGLES_MAX] = angle[k]
            count += 1
        if (k + 1) % MINUTE_TICKS == 0 and count >= ANGLES_MIN:
            value[k // MINUTE_TICKS] = np.median(ring[: min(count, ANGLES_MAX)])
    return value
