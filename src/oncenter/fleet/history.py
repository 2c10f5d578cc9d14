"""What a truck's drives say together of each other quantity than the offset: its mean now, and when it changed.

The offset's are of the truck's model (oncenter.truck). Here a quantity is a mean with scatter; changes of it say what
an offset's change came with. All numbers are in the tables' units.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Numbers = npt.NDArray[np.float64]
Places = npt.NDArray[np.int64]

_SIDE_MIN = 2  # drives on either side of a change: one that is off alone is none
_WITHOUT_ONE = 2.0  # standard deviations that a change must have left without any one drive
_AS_IT_SHOULD = 2.0  # drives, taken to scatter as they should beside those there are: two alone say little of it
_DRIFT_MIN = 4  # drives of a slope
_DAY_S = 86400.0


@dataclass(frozen=True)
class Told:
    """One quantity of one truck, drive by drive in order of time: each of shape (n,).

    `start_s` since 1970; `sd` the drive's own.
    """

    start_s: Numbers
    value: Numbers
    sd: Numbers


@dataclass(frozen=True)
class Noise:
    """How a quantity scatters between drives of a truck that nobody touched.

    Attributes:
        floor: a drive scatters by hypot(floor, its own), one sd.
        smallest: smaller changes are not told.
        threshold: standard deviations by which the means before and after must differ.
    """

    floor: float
    smallest: float
    threshold: float

    def scatter(self, sd: Numbers) -> Numbers:
        return np.hypot(self.floor, sd)


# Tuned on simulated trucks whose seeds bench/fleet.py does not use: see docs/fleet.md.
NOISE = {
    "backlash": Noise(floor=0.3, smallest=1.5, threshold=8.0),
    "unloading_acceleration": Noise(floor=0.03, smallest=0.15, threshold=6.0),
    "yaw_rate_bias": Noise(floor=0.05, smallest=0.2, threshold=6.0),
}


@dataclass(frozen=True)
class Break:
    """Between drives `at - 1` and `at`; proved by drive `found`. `before` and `after` are the drives' means."""

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


def breaks(told: Told, noise: Noise) -> list[Break]:
    """Changes in order of time, found as the drives came: none of a later drive moves one that was found.

    At each drive the likeliest place of a change since the last one is asked: where the means on both sides differ
    most, in standard deviations of their difference. Each mean's is widened by what its drives scatter more than they
    should (Birge's ratio, squared and not below one). What is left of a change must still show, at `_WITHOUT_ONE`
    standard deviations, whichever drive is left out.
    """
    if not len(told.value) or float(np.ptp(told.value)) < noise.smallest:
        return []
    places, since = [], 0
    runs = _Runs(told, noise)
    for last in range(2 * _SIDE_MIN - 1, len(told.value)):
        if last + 1 - since < 2 * _SIDE_MIN:
            continue
        at = _proved(runs, since, last, noise)
        if at is not None:
            places.append((at, last))
            since = at
    begins = np.array([0, *(at for at, _ in places)])
    ends = np.array([*(at for at, _ in places), len(told.value)])
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
    """Means of any runs of drives and their variances, by sums up to each."""

    def __init__(self, told: Told, noise: Noise) -> None:
        weight = noise.scatter(told.sd) ** -2.0
        self._near = float(told.value[0])  # so that squares lose no digits
        x = told.value - self._near
        self._terms = weight * np.stack((np.ones_like(x), x, x * x))
        self._sums = np.concatenate((np.zeros((3, 1)), np.cumsum(self._terms, axis=1)), axis=1)

    def of(self, begin: Places, end: Places) -> tuple[Numbers, Numbers]:
        """Drives `begin` up to before `end`."""
        return self._mean(self._sums[:, end] - self._sums[:, begin], (end - begin).astype(np.float64))

    def without_one(self, begin: int, end: int) -> tuple[Numbers, Numbers]:
        """The same, each of them left out in turn."""
        whole = self._sums[:, [end]] - self._sums[:, [begin]]
        return self._mean(whole - self._terms[:, begin:end], np.full(end - begin, end - begin - 1.0))

    def _mean(self, sums: Numbers, count: Numbers) -> tuple[Numbers, Numbers]:
        weight, x, xx = sums
        mean = x / weight
        excess = (xx - x * mean + _AS_IT_SHOULD) / (count - 1 + _AS_IT_SHOULD)
        return mean + self._near, np.maximum(excess, 1.0) / weight


def now(told: Told, since: int, noise: Noise) -> Mean | None:
    """The mean of all drives from `since` on; None without any."""
    if since >= len(told.value):
        return None
    runs = _Runs(Told(told.start_s[since:], told.value[since:], told.sd[since:]), noise)
    mean, variance = runs.of(np.array([0]), np.array([len(told.value) - since]))
    return Mean(float(mean[0]), math.sqrt(variance[0]))


def drift(told: Told, since: int) -> tuple[float, float] | None:
    """Slope per day of all drives from `since` on, and its standard deviation; None below four drives."""
    value, days = told.value[since:], (told.start_s[since:] - told.start_s[-1]) / _DAY_S
    if len(value) < _DRIFT_MIN or np.ptp(days) == 0.0:
        return None
    weight = told.sd[since:] ** -2
    centred = days - np.average(days, weights=weight)
    squares = float(np.sum(weight * centred**2))
    slope = float(np.sum(weight * centred * value)) / squares
    rest = value - np.average(value, weights=weight) - slope * centred
    excess = max(1.0, float(np.sum(weight * rest**2)) / (len(value) - 2))
    return slope, math.sqrt(excess / squares)


def told_of(rows: Sequence[dict[str, object]], value: str, sd: str, status: str) -> Told:
    """A quantity of a truck's rows (order of time). Neither what their prior decided counts nor a drive without a
    begin."""
    kept = [
        row
        for row in rows
        if row.get(status) in ("valid", "converging") and row.get(sd) and row.get("start") is not None
    ]

    def column(name: str) -> Numbers:
        return np.array([row[name] for row in kept], np.float64)

    return Told(column("start"), column(value), column(sd))
