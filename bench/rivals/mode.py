"""Larsén 2017 (SE541512C2): the most frequent angle above a minimum speed in a moving window, without vehicle data."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numba import njit

from oncenter.signals import DEGREE
from rivals import EVERY_TENTH, MINUTE_TICKS, Array, Course, Known, without_interval

SPEED_MIN_M_S = 10.0  # the thesis's, 5.1
BIN_RAD = 0.5 * DEGREE
BINS = 721  # up to 180 deg to either side
WINDOW = 6000  # angles at 10 Hz, ten minutes above the minimum speed
ANGLES_MIN = 200


def mode(columns: Mapping[str, Array], known: Known) -> Course:
    return without_interval(_course(columns["steering_wheel_angle_rad"], columns["vehicle_speed_m_s"]))


@njit(cache=True)
def _course(angle, v):
    value = np.full(len(angle) // MINUTE_TICKS, np.nan)
    counts, ring, count = np.zeros(BINS, np.int64), np.zeros(WINDOW, np.int64), 0
    for k in range(len(angle)):
        if k % EVERY_TENTH == 0 and v[k] >= SPEED_MIN_M_S and abs(angle[k]) < BINS // 2 * BIN_RAD:
            if count >= WINDOW:
                counts[ring[count % WINDOW]] -= 1
            which = int(np.floor(angle[k] / BIN_RAD + 0.5)) + BINS // 2
            ring[count % WINDOW] = which
            counts[which] += 1
            count += 1
        if (k + 1) % MINUTE_TICKS == 0 and count >= ANGLES_MIN:
            value[k // MINUTE_TICKS] = (np.argmax(counts) - BINS // 2) * BIN_RAD
    return value
