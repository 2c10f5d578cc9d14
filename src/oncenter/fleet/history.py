"""A truck over time: when its offset changed and by how much, where it stands now, whether it drifts.

A drive's row is all that is needed of it, so a log that comes late takes its place in time and none is read again.

A drive's standard deviation counts what is the same in all drives of a truck (the accelerometer's bias, a pull) and
what is not (road, wind, load). Only the latter makes drives differ, so changes are judged by it alone (`Noise`), and
what is common is added where the offset itself is meant. Play that a drive has seen on one flank only is told apart
from its offset by the truck's other drives first (known_play.py). All numbers are in the tables' units.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from oncenter.fleet.known_play import AS_IT_SHOULD, Numbers, Play, Told, with_known_play

Places = npt.NDArray[np.int64]

_SIDE_MIN = 2  # drives on either side of a change: one that is off alone is none
_WITHOUT_ONE = 2.0  # standard deviations that a change must have left without any one drive
_DRIFT_MIN = 4  # drives of a slope
_DAY_S = 86400.0


@dataclass(frozen=True)
class Noise:
    """How a quantity scatters between drives of a truck that nobody touched.

    A drive on roads that tell little (a motorway that shows one flank of the play only) has a large standard deviation,
    and a truck's drives on such roads are wrong alike: one error of the truck, times `common` of each drive's width,
    that no number of them averages out; drives of different widths tell it. Widths are the drives' standard deviations,
    of which little is left below `knee`: there they hold what all drives have in common.

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
    "offset": Noise(floor=0.25, share=0.45, common=0.7, knee=0.7, least=1.0, threshold=4.5),
    "backlash": Noise(floor=0.3, share=1.0, common=0.0, knee=0.0, least=1.5, threshold=8.0),
    "unloading_acceleration": Noise(floor=0.03, share=1.0, common=0.0, knee=0.0, least=0.15, threshold=6.0),
    "yaw_rate_bias": Noise(floor=0.05, share=1.0, common=0.0, knee=0.0, least=0.2, threshold=6.0),
}


@dataclass(frozen=True)
class Break:
    """Between drives `at - 1` and `at`; proved by drive `found`.

    `before` and `after` are the drives' means; `size` is their difference without what drives of different widths are
    wrong alike.
    """

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


def breaks(told: Told, noise: Noise, play: Play | None = None) -> list[Break]:
    """Changes in order of time, found as the drives came: none of a later drive moves one that was found.

    At each drive the likeliest place of a change since the last one is asked: where the means on both sides differ
    most, in standard deviations of their difference. Each mean's is widened by what its drives scatter more than they
    should (Birge's ratio, squared and not below one). What is left of a change must still show, at `_WITHOUT_ONE`
    standard deviations, whichever drive is left out. Of `play` so much is known at each drive as was told until then.
    """
    if not len(told.value) or (play is None and _all_alike(told, noise)):
        return []
    places, since = [], 0
    whole = _Runs(told if play is None else with_known_play(told, play), noise)
    for last in range(2 * _SIDE_MIN - 1, len(told.value)):
        if last + 1 - since < 2 * _SIDE_MIN:
            continue
        so_far = whole if play is None else _Runs(_known_until(told, play, last + 1), noise)
        at = _proved(so_far, since, last, noise)
        if at is not None:
            places.append((at, last))
            since = at
    begins = np.array([0, *(at for at, _ in places)])
    ends = np.array([*(at for at, _ in places), len(told.value)])
    runs = whole.of(begins, ends)
    sizes, sds = _difference(runs.part(slice(None, -1)), runs.part(slice(1, None)))
    return [
        Break(at, found, float(runs.mean[k]), float(runs.mean[k + 1]), float(sizes[k]), float(sds[k]))
        for k, (at, found) in enumerate(places)
    ]


def _all_alike(told: Told, noise: Noise) -> bool:
    """Whether no two means can be far enough apart: drives are not, and what they have in common moves none of them."""
    return noise.common == 0.0 and float(np.ptp(told.value)) < noise.least


def _known_until(told: Told, play: Play, end: int) -> Told:
    until = slice(None, end)
    return with_known_play(told.part(until), play.part(until))


def _proved(runs: _Runs, since: int, last: int, noise: Noise) -> int | None:
    at = np.arange(since + _SIDE_MIN, last + 2 - _SIDE_MIN)
    before, after = runs.of(np.full_like(at, since), at), runs.of(at, np.full_like(at, last + 1))
    size, sd = _difference(before, after)
    evidence = np.where(np.abs(size) >= noise.least, np.abs(size) / sd, 0.0)
    best = int(np.argmax(evidence))
    if evidence[best] < noise.threshold:
        return None
    place, direction, this = int(at[best]), np.sign(size[best]), slice(best, best + 1)
    for one, other in (
        (runs.without_one(since, place), after.part(this)),
        (before.part(this), runs.without_one(place, last + 1)),
    ):
        left, its_sd = _difference(one, other)
        if np.min(direction * left / its_sd) < _WITHOUT_ONE:
            return None
    return place


@dataclass(frozen=True)
class _Run:
    """Runs of drives, each a number of these arrays.

    `common` is how much of the truck's common error is in the mean; the last three are weighted sums of products of
    deviations from the means, of values x and of each drive's share c in that error.
    """

    count: Numbers
    weight: Numbers
    mean: Numbers
    common: Numbers
    xx: Numbers
    cx: Numbers
    cc: Numbers

    def part(self, chosen: slice) -> _Run:
        of = (self.count, self.weight, self.mean, self.common, self.xx, self.cx, self.cc)
        return _Run(*(member[chosen] for member in of))

    def variance(self, error: Numbers | float = 0.0) -> Numbers:
        """Of the mean, when the common error is as given."""
        left = self.xx - error * (2.0 * self.cx - error * self.cc)
        excess = (left + AS_IT_SHOULD) / (self.count - 1 + AS_IT_SHOULD)
        return np.asarray(np.maximum(excess, 1.0) / self.weight)


def _difference(before: _Run, after: _Run) -> tuple[Numbers, Numbers]:
    """After less before, and its standard deviation.

    The common error, 0 +- 1 before any drive, is told by how drives of different widths differ on the same side; what
    is left of it is in the difference as far as the sides' widths differ.
    """
    information = 1.0 + before.cc + after.cc
    error = (before.cx + after.cx) / information
    apart = after.common - before.common
    variance = before.variance(error) + after.variance(error) + apart**2 / information
    return after.mean - before.mean - error * apart, np.sqrt(variance)


class _Runs:
    """Any run of drives, by sums up to each."""

    def __init__(self, told: Told, noise: Noise) -> None:
        weight = noise.scatter(told.sd) ** -2.0
        self._near = float(told.value[0])  # so that squares lose no digits
        x, c = told.value - self._near, noise.common * noise.width(told.sd)
        self._terms = weight * np.stack((np.ones_like(x), x, c, x * x, c * x, c * c))
        self._sums = np.concatenate((np.zeros((6, 1)), np.cumsum(self._terms, axis=1)), axis=1)

    def of(self, begin: Places, end: Places) -> _Run:
        """Drives `begin` up to before `end`."""
        return self._run(self._sums[:, end] - self._sums[:, begin], (end - begin).astype(np.float64))

    def without_one(self, begin: int, end: int) -> _Run:
        """The same, each of them left out in turn."""
        whole = self._sums[:, [end]] - self._sums[:, [begin]]
        return self._run(whole - self._terms[:, begin:end], np.full(end - begin, end - begin - 1.0))

    def _run(self, sums: Numbers, count: Numbers) -> _Run:
        weight, x, c, xx, cx, cc = sums
        mean, common = x / weight, c / weight
        return _Run(count, weight, mean + self._near, common, xx - x * mean, cx - c * mean, cc - c * common)


def now(told: Told, since: int, noise: Noise) -> Mean | None:
    """The mean of all drives from `since` on; None without any."""
    if since >= len(told.value):
        return None
    present = told.part(slice(since, None))
    scatter = noise.scatter(present.sd)
    run = _Runs(present, noise).of(np.array([0]), np.array([len(scatter)]))
    variance = float(run.variance()[0])
    common = np.maximum(present.sd**2 - scatter**2, 0.0)
    total = variance + float(np.average(common, weights=scatter**-2.0))
    return Mean(float(run.mean[0]), math.sqrt(variance), math.sqrt(total))


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
    """A quantity of a truck's rows (order of time), and which rows told it. Neither what their prior decided counts nor
    a drive without a begin."""
    kept = [
        k
        for k, row in enumerate(rows)
        if row.get(status) in ("valid", "converging") and row.get(sd) and row.get("start") is not None
    ]

    def column(name: str) -> Numbers:
        return np.array([rows[k][name] for k in kept], np.float64)

    return Told(column("start"), column(value), column(sd)), kept
