"""Play, neutral lateral acceleration and gyro bias over a truck's drives: the mean now, and changes.

The offset comes from the truck's model (oncenter.truck). Here a quantity is a mean with scatter. Its changes give the
cause of an offset's change. All numbers are in the tables' units.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Numbers = npt.NDArray[np.float64]
Places = npt.NDArray[np.int64]

_SIDE_MIN = 2  # drives on either side of a change: a single outlier is no change
_WITHOUT_ONE = 2.0  # standard deviations that a change must keep when any one drive is left out
_AS_IT_SHOULD = 2.0  # prior weight, in drives, of the nominal scatter: two drives do not identify a scatter
_DRIFT_MIN = 4  # drives that a slope needs
_DAY_S = 86400.0


@dataclass(frozen=True)
class Readings:
    """One quantity of one truck, drive by drive in order of time: each of shape (n,).

    `start_s` since 1970; `sd` of this drive alone.
    """

    start_s: Numbers
    value: Numbers
    sd: Numbers


@dataclass(frozen=True)
class Noise:
    """How a quantity scatters between drives of an untouched truck.

    Attributes:
        floor: the sd of a drive is hypot(floor, its own sd).
        smallest: smaller changes are not reported.
        threshold: standard deviations by which the means before and after must differ.
    """

    floor: float
    smallest: float
    threshold: float

    def scatter(self, sd: Numbers) -> Numbers:
        return np.hypot(self.floor, sd)


# Tuned on simulated trucks with other seeds than those of bench/fleet.py: see docs/fleet.md.
NOISE = {
    "backlash": Noise(floor=0.3, smallest=1.5, threshold=8.0),
    "unloading_acceleration": Noise(floor=0.03, smallest=0.15, threshold=6.0),
    "yaw_rate_bias": Noise(floor=0.05, smallest=0.2, threshold=6.0),
}


@dataclass(frozen=True)
class Break:
    """A change between drives `at - 1` and `at`, detected at drive `found`; `before` and `after` are means."""

    at: int
    found: int
    before: float
    after: float
    size: float
    sd: float


@dataclass(frozen=True)
class Mean:
    value: float
    sd: float


def breaks(readings: Readings, noise: Noise) -> list[Break]:
    """Changes in order of time, detected drive by drive: a later drive never moves a change that was detected.

    At each drive the most likely place of a change since the last one is tested: where the means on both sides differ
    most, in standard deviations of their difference. Where a side's drives scatter more than nominally, its variance
    is scaled by Birge's ratio squared, at least 1. With any one drive left out, `_WITHOUT_ONE` standard deviations of
    the change must remain.
    """
    if not len(readings.value) or float(np.ptp(readings.value)) < noise.smallest:
        return []
    places, since = [], 0
    runs = _Runs(readings, noise)
    for last in range(2 * _SIDE_MIN - 1, len(readings.value)):
        if last + 1 - since < 2 * _SIDE_MIN:
            continue
        at = _proved(runs, since, last, noise)
        if at is not None:
            places.append((at, last))
            since = at
    begins = np.array([0, *(at for at, _ in places)])
    ends = np.array([*(at for at, _ in places), len(readings.value)])
    mean, variance = runs.of(begins, ends)
    return [
        Break(
            at,
            found,
            float(mean[k]),
            float(mean[k + 1]),
            float(mean[k + 1] - mean[k]),
            math.sqrt(variance[k] + variance[k + 1]),
        )
        for k, (at, found) in enumerate(places)
    ]


def _proved(runs: _Runs, since: int, last: int, noise: Noise) -> int | None:
    at = np.arange(since + _SIDE_MIN, last + 2 - _SIDE_MIN)
    before, after = runs.of(np.full_like(at, since), at), runs.of(at, np.full_like(at, last + 1))
    size = after[0] - before[0]
    evidence = np.where(np.abs(size) >= noise.smallest, np.abs(size) / np.sqrt(before[1] + after[1]), 0.0)
    best = int(np.argmax(evidence))
    if evidence[best] < noise.threshold:
        return None
    place, direction = int(at[best]), np.sign(size[best])
    of_before, of_after = ((mean[best], variance[best]) for mean, variance in (before, after))
    for low, high in ((runs.without_one(since, place), of_after), (of_before, runs.without_one(place, last + 1))):
        if np.min(direction * (high[0] - low[0]) / np.sqrt(low[1] + high[1])) < _WITHOUT_ONE:
            return None
    return place


class _Runs:
    """Means and variances of runs of consecutive drives, from cumulative sums."""

    def __init__(self, readings: Readings, noise: Noise) -> None:
        weight = noise.scatter(readings.sd) ** -2.0
        self._near = float(readings.value[0])  # keeps the digits of the squares
        x = readings.value - self._near
        self._terms = weight * np.stack((np.ones_like(x), x, x * x))
        self._sums = np.concatenate((np.zeros((3, 1)), np.cumsum(self._terms, axis=1)), axis=1)

    def of(self, begin: Places, end: Places) -> tuple[Numbers, Numbers]:
        """Drives `begin` to `end - 1`."""
        return self._mean(self._sums[:, end] - self._sums[:, begin], (end - begin).astype(np.float64))

    def without_one(self, begin: int, end: int) -> tuple[Numbers, Numbers]:
        """The same, with each drive left out in turn."""
        whole = self._sums[:, [end]] - self._sums[:, [begin]]
        return self._mean(whole - self._terms[:, begin:end], np.full(end - begin, end - begin - 1.0))

    def _mean(self, sums: Numbers, count: Numbers) -> tuple[Numbers, Numbers]:
        weight, x, xx = sums
        mean = x / weight
        excess = (xx - x * mean + _AS_IT_SHOULD) / (count - 1 + _AS_IT_SHOULD)
        return mean + self._near, np.maximum(excess, 1.0) / weight


def now(readings: Readings, since: int, noise: Noise) -> Mean | None:
    """The mean of all drives from `since` on; None if there are none."""
    if since >= len(readings.value):
        return None
    runs = _Runs(Readings(readings.start_s[since:], readings.value[since:], readings.sd[since:]), noise)
    mean, variance = runs.of(np.array([0]), np.array([len(readings.value) - since]))
    return Mean(float(mean[0]), math.sqrt(variance[0]))


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
