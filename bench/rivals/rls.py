"""The faster estimate of mid-play in 5.5.1: recursive least squares with forgetting in place of the mean (36); where
its value is steady, it is sorted by the side to which the truck turns. The thesis gives no values for memory and
steadiness: the ones here are assumed."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numba import njit

from oncenter.signals import DEGREE
from rivals import MINUTE_TICKS, Array, Course, Known, without_interval
from rivals.straight import RATE_HZ, straight

MEMORY_TICKS = round(5.0 * RATE_HZ)
KEPT = math.exp(-1.0 / MEMORY_TICKS)  # weight factor of older values per tick
STANDS_RAD = 0.5 * DEGREE  # maximum change within one memory time


def rls(columns: Mapping[str, Array], known: Known) -> Course:
    seen = straight(columns, known)
    return without_interval(_course(seen.passed, seen.residual_rad, seen.turning_m_s2))


@njit(cache=True)
def forgetting(values):
    """Least squares of a constant with forgetting factor KEPT: its value after each input."""
    said, information, x = np.empty(len(values)), 0.0, 0.0
    for k in range(len(values)):
        information = KEPT * information + 1.0
        x += (values[k] - x) / information
        said[k] = x
    return said


@njit(cache=True)
def _course(passed, residual, turning):
    value = np.full(len(passed) // MINUTE_TICKS, np.nan)
    offset, side_force = forgetting(residual[passed]), forgetting(turning[passed])
    sums, counts = np.zeros(2), np.zeros(2)  # to the right and to the left
    n = -1
    for k in range(len(passed)):
        if passed[k]:
            n += 1
            if n >= 2 * MEMORY_TICKS and abs(offset[n] - offset[n - MEMORY_TICKS]) <= STANDS_RAD:
                side = 1 if side_force[n] > 0.0 else 0
                sums[side] += offset[n]
                counts[side] += 1.0
        if (k + 1) % MINUTE_TICKS == 0 and counts[0] > 0.0 and counts[1] > 0.0:
            value[k // MINUTE_TICKS] = 0.5 * (sums[0] / counts[0] + sums[1] / counts[1])
    return value
