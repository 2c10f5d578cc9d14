"""The simple estimate of mid-play in 5.5.1: estimates over 20 s each, sorted by the side to which the truck turned. The
offset is the midpoint of the means of both sides; there is no value before both sides occurred."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numba import njit

from rivals import MINUTE_TICKS, Array, Course, Known, without_interval
from rivals.straight import RATE_HZ, straight

ESTIMATION_TICKS = round(20.0 * RATE_HZ)  # with open gate: 300 m at 15 m/s


def bins(columns: Mapping[str, Array], known: Known) -> Course:
    seen = straight(columns, known)
    return without_interval(_course(seen.passed, seen.residual_rad, seen.turning_m_s2))


@njit(cache=True)
def _course(passed, residual, turning):
    value = np.full(len(passed) // MINUTE_TICKS, np.nan)
    sums, counts = np.zeros(2), np.zeros(2)  # of estimates with turns to the right and to the left
    residual_sum, turning_sum, ticks = 0.0, 0.0, 0
    for k in range(len(passed)):
        if passed[k]:
            residual_sum += residual[k]
            turning_sum += turning[k]
            ticks += 1
        if ticks == ESTIMATION_TICKS:
            side = 1 if turning_sum > 0.0 else 0
            sums[side] += residual_sum / ticks
            counts[side] += 1.0
            residual_sum, turning_sum, ticks = 0.0, 0.0, 0
        if (k + 1) % MINUTE_TICKS == 0 and counts[0] > 0.0 and counts[1] > 0.0:
            value[k // MINUTE_TICKS] = 0.5 * (sums[0] / counts[0] + sums[1] / counts[1])
    return value
