"""A truck over time: when its offset changed and by how much, where it stands now, whether it drifts.

A drive's row is all that is needed of it, so a log that comes late takes its place in time and none is read again.

A drive's standard deviation counts what is the same in all drives of a truck (the accelerometer's bias, a pull) and
what is not (road, wind, load). Only the latter makes drives differ, so changes are judged by it alone (`Noise`), and
what is common is added where the offset itself is meant. All numbers are in the tables' units.
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
_DRIFT_MIN = 4  # drives of a slope
_AS_IT_SHOULD = 2.0  # drives, taken to scatter as they should beside those there are: two alone say little of it
_DAY_S = 86400.0


@dataclass(frozen=True)
class Noise:
    """How a quantity scatters between drives of a truck that nobody touched.

    A drive on roads that tell little (a motorway that shows one flank of the play only) has a large standard deviation,
    and a truck's drives on such roads are wrong alike: one error of the truck, times `common` of each drive's width,
    that no number of them averages out. Widths are the drives' standard deviations, of which little is left below
    `knee`: there they hold what all drives have in common.

    Attributes:
        floor, share: a drive scatters by hypot(floor, share * width), one sd.
        common: per width, one sd; 0 where there is none.
        knee: in the quantity's unit; 0 where there is none.
        least: smaller changes are not told.
        threshold: standard deviations by which the means before and after must differ.
    """

    floor: float
    share: float
    common: float
    knee: float
    least: float
    threshold: float

    def width(self, sd: Numbers) -> Numbers:
        return np.asarray(np.where(sd < self.knee, sd * (sd / (self.knee or 1.0)) ** 2, sd))

    def scatter(self, sd: Numbers) -> Numbers:
        return np.hypot(self.floor, self.share * self.width(sd))


# Tuned on simulated trucks whose seeds bench/fleet.py does not use: see docs/fleet.md.
NOISE = {
    "offset": Noise(floor=0.25, share=0.45, common=0.7, knee=1.0, least=1.0, threshold=4.5),
    "backlash": Noise(floor=0.3, share=1.0, common=0.0, knee=0.0, least=1.5, threshold=8.0),
    "unloading_acceleration": Noise(floor=0.03, share=1.0, common=0.0, knee=0.0, least=0.15, threshold=6.0),
    "yaw_rate_bias": Noise(floor=0.05, share=1.0, common=0.0, knee=0.0, least=0.2, threshold=6.0),
}


@dataclass(frozen=True)
class Told:
    """One quantity of one truck, drive by drive in order of time: each of shape (n,).

    `start_s` since 1970; `sd` the drive's own.
    """

    start_s: Numbers
    value: Numbers
    sd: Numbers


@dataclass(frozen=True)
class Break:
    """Between drives `at - 1` and `at`; proved by drive `found`."""

    at: int
    found: int
    before: float
    after: float
    size: float
    sd: float


@dataclass(frozen=True)
class Mean:
    """Of some drives: `spread_sd` against other means of this truck, `sd` with what all its drives have in common."""

    value: float
    spread_sd: float
    sd: float


def breaks(told: Told, noise: Noise) -> list[Break]:
    """Changes in order of time, found as the drives came: none of a later drive moves one that was found.

    At each drive the likeliest place of a change since the last one is asked: where the means on both sides differ
    most, in standard deviations of their difference. Each mean's is widened by what its drives scatter more than they
    should (Birge's ratio, squared and not below one). What is left of a change must still show, at `_WITHOUT_ONE`
    standard deviations, whichever drive is left out.
    """
    if not len(told.value):
        return []
    sides = _Sides(told, noise)
    places, since = [], 0
    for last in range(len(told.value)):
        at = _proved(sides, since, last, noise)
        if at is not None:
            places.append((at, last))
            since = at
    begins = np.array([0, *(at for at, _ in places)])
    ends = np.array([*(at for at, _ in places), len(told.value)])
    means = sides.means(begins, ends)
    sizes, sds = _difference(means.part(slice(None, -1)), means.part(slice(1, None)))
    return [
        Break(at, found, float(means.value[k]), float(means.value[k + 1]), float(sizes[k]), float(sds[k]))
        for k, (at, found) in enumerate(places)
    ]


def _proved(sides: _Sides, since: int, last: int, noise: Noise) -> int | None:
    at = np.arange(since + _SIDE_MIN, last + 2 - _SIDE_MIN)
    if not len(at):
        return None
    before, after = sides.means(np.full_like(at, since), at), sides.means(at, np.full_like(at, last + 1))
    size, sd = _difference(before, after)
    evidence = np.where(np.abs(size) >= noise.least, np.abs(size) / sd, 0.0)
    best = int(np.argmax(evidence))
    if evidence[best] < noise.threshold:
        return None
    place, direction = int(at[best]), np.sign(size[best])
    for one, other in (
        (sides.without_one(since, place), after.part(slice(best, best + 1))),
        (before.part(slice(best, best + 1)), sides.without_one(place, last + 1)),
    ):
        left, its_sd = _difference(one, other)
        if np.min(direction * left / its_sd) < _WITHOUT_ONE:
            return None
    return place


@dataclass(frozen=True)
class _Means:
    """Of runs of drives: their weighted means, the variances of those, and how much of a common error is in them."""

    value: Numbers
    variance: Numbers
    common: Numbers

    def part(self, chosen: slice) -> _Means:
        return _Means(self.value[chosen], self.variance[chosen], self.common[chosen])


def _difference(before: _Means, after: _Means) -> tuple[Numbers, Numbers]:
    """After less before, and its standard deviation: an error that is in both alike is not in it."""
    variance = before.variance + after.variance + (after.common - before.common) ** 2
    return after.value - before.value, np.sqrt(variance)


class _Sides:
    """Means of any run of drives, by sums up to each."""

    def __init__(self, told: Told, noise: Noise) -> None:
        weight = noise.scatter(told.sd) ** -2.0
        self._middle = float(np.median(told.value))  # so that squares lose no digits
        x = told.value - self._middle
        self._terms = np.stack((weight, weight * x, weight * x**2, weight * noise.common * noise.width(told.sd)))
        self._sums = np.concatenate((np.zeros((4, 1)), np.cumsum(self._terms, axis=1)), axis=1)

    def means(self, begin: Places, end: Places) -> _Means:
        """Of drives `begin` up to before `end`."""
        return self._means(self._sums[:, end] - self._sums[:, begin], end - begin)

    def without_one(self, begin: int, end: int) -> _Means:
        """Of the same, each of them left out in turn."""
        whole = self._sums[:, [end]] - self._sums[:, [begin]]
        return self._means(whole - self._terms[:, begin:end], np.array(end - begin - 1))

    def _means(self, sums: Numbers, count: Places) -> _Means:
        weight, first, second, common = sums
        mean = first / weight
        excess = (second - first * mean + _AS_IT_SHOULD) / (count - 1 + _AS_IT_SHOULD)
        return _Means(mean + self._middle, np.maximum(excess, 1.0) / weight, common / weight)


def now(told: Told, since: int, noise: Noise) -> Mean | None:
    """The mean of all drives from `since` on; None without any."""
    if since >= len(told.value):
        return None
    present = Told(told.start_s[since:], told.value[since:], told.sd[since:])
    scatter = noise.scatter(present.sd)
    mean = _Sides(present, noise).means(np.array([0]), np.array([len(scatter)]))
    variance = float(mean.variance[0])
    common = np.maximum(present.sd**2 - scatter**2, 0.0)
    total = variance + float(np.average(common, weights=scatter**-2.0))
    return Mean(float(mean.value[0]), math.sqrt(variance), math.sqrt(total))


def drift(told: Told, since: int, noise: Noise) -> tuple[float, float] | None:
    """Slope per day of all drives from `since` on, and its standard deviation; None below four drives."""
    value, days = told.value[since:], (told.start_s[since:] - told.start_s[-1]) / _DAY_S
    if len(value) < _DRIFT_MIN or np.ptp(days) == 0.0:
        return None
    weight = noise.scatter(told.sd[since:]) ** -2
    centred = days - np.average(days, weights=weight)
    squares = float(np.sum(weight * centred**2))
    slope = float(np.sum(weight * centred * value)) / squares
    rest = value - np.average(value, weights=weight) - slope * centred
    excess = max(1.0, float(np.sum(weight * rest**2)) / (len(value) - 2))
    return slope, math.sqrt(excess / squares)


def told_of(rows: Sequence[dict[str, object]], value: str, sd: str, status: str) -> tuple[Told, list[int]]:
    """A quantity of a truck's rows (order of time), and which rows told it: what their prior decided does not count."""
    kept = [k for k, row in enumerate(rows) if row.get(status) in ("valid", "converging") and row.get(sd)]

    def column(name: str) -> Numbers:
        return np.array([rows[k][name] for k in kept], np.float64)

    return Told(column("start"), column(value), column(sd)), kept
