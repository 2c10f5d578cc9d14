"""Quantities of a truck's drives beside its model: means, a change of the gyro's bias, the offset's drift.

All numbers are in the tables' units.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Numbers = npt.NDArray[np.float64]

_DRIFT_MIN = 4  # drives that a slope needs
_DAY_S = 86400.0
# Of a gyro's bias between drives, deg/s: tuned on simulated trucks with other seeds than those of bench/fleet.py.
_GYRO_SCATTER, _GYRO_MOVED = 0.05, 0.1
_MOVED_SDS = 3.0


@dataclass(frozen=True)
class Readings:
    """One quantity of one truck, drive by drive in order of time: each of shape (n,).

    `start_s` since 1970; `sd` of this drive alone.
    """

    start_s: Numbers
    value: Numbers
    sd: Numbers

    def mean(self) -> tuple[float, float] | None:
        """Of all drives, with the standard deviation of one; None without a drive."""
        if not len(self.value):
            return None
        weight = self.sd**-2.0
        return float(np.average(self.value, weights=weight)), math.sqrt(np.average(self.sd**2, weights=weight))

    def moved(self, at_s: float) -> bool:
        """Whether a gyro's mean bias from that time on differs from the one before."""
        sides = [self.value[side] for side in (self.start_s < at_s, self.start_s >= at_s) if side.any()]
        if len(sides) < 2:
            return False
        size = abs(float(sides[1].mean() - sides[0].mean()))
        sd = math.hypot(*(math.hypot(_GYRO_SCATTER, float(side.std())) / math.sqrt(len(side)) for side in sides))
        return size > _GYRO_MOVED and size > _MOVED_SDS * sd


def drift(readings: Readings, since: int) -> tuple[float, float] | None:
    """Slope per day of all drives from `since` on, and its standard deviation; None below four drives."""
    value, days = readings.value[since:], (readings.start_s[since:] - readings.start_s[-1]) / _DAY_S
    if len(value) < _DRIFT_MIN or np.ptp(days) == 0.0:
        return None
    weight = readings.sd[since:] ** -2
    centred = days - np.average(days, weights=weight)
    squares = float(np.sum(weight * centred**2))
    slope = float(np.sum(weight * centred * value)) / squares
    rest = value - np.average(value, weights=weight) - slope * centred
    excess = max(1.0, float(np.sum(weight * rest**2)) / (len(value) - 2))
    return slope, math.sqrt(excess / squares)


def readings_of(rows: Sequence[dict[str, object]], value: str, sd: str, status: str) -> Readings:
    """A quantity of a truck's rows (order of time). Values that are only a prior, and drives without a start time, are
    left out."""
    kept = [
        row
        for row in rows
        if row.get(status) in ("valid", "converging") and row.get(sd) and row.get("start") is not None
    ]

    def column(name: str) -> Numbers:
        return np.array([row[name] for row in kept], np.float64)

    return Readings(column("start"), column(value), column(sd))
