"""A Kalman filter over each truck's drives, many trucks side by side, with a test of a step before every drive.

A step of the offset is detected by its signature in all innovations since (Willsky and Jones, A generalized likelihood
ratio approach to the detection and estimation of jumps in linear systems, IEEE Transactions on Automatic Control 21,
1976). No reading has more than `_INFLUENCE` standard deviations of influence, so that no single drive makes a step.
Sums over the state are written out, so that the results of a truck do not depend on the other trucks of the call.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from oncenter.signals import DEGREE
from oncenter.truck.drives import Numbers, Summaries
from oncenter.truck.priors import Priors
from oncenter.truck.readings import (
    BIAS,
    CROWN,
    LOAD_STEER,
    LOAD_STEER_BENT,
    OFFSET,
    PLAY,
    PULL,
    STATE,
    Reading,
    loads_of,
    readings,
)

Truths = npt.NDArray[np.bool_]
Places = npt.NDArray[np.int64]

# Tuned on seeds 1 to 120 of bench/trucks.py, and on its months 1 to 100.
_INFLUENCE = 5.0  # standard deviations of one reading's innovation
_THRESHOLD = 4.5  # standard deviations of a step
_SMALLEST_RAD = 0.5 * DEGREE  # a smaller step is not reported
_DRIVES_BEFORE = _DRIVES_AFTER = 2
_CONTRADICTS = 2.0  # standard deviations
_WITHOUT_ONE = 1.5  # standard deviations of a step without any one of its drives
_NEAR, _MOVED_SDS = 10, 4.0  # drives on either side of a step for the neutral accelerations, and their difference in sd
_AGES = (0, 1, 2, 3, 4, 5, 7, 10, 14, 20, 28, 40, 57, 80, 113, 160)  # drives since a step that is tested
_ANYWHERE_RAD = 0.5  # sd of the offset before a truck's first drives
_FIRST_DRIVES, _FIRST_SD_RAD = 5, 1.0 * DEGREE


def _first_guess(offset: Numbers, sd: Numbers) -> tuple[Numbers, Numbers]:
    """The weighted median of the first drives, and a wide standard deviation about it, so that one wrong first drive
    does not make the next ones look wrong. With one or two drives the standard deviation has no limit."""
    offset, sd = offset[:, :_FIRST_DRIVES], sd[:, :_FIRST_DRIVES]
    has = np.isfinite(offset)
    weight = np.where(has, 1.0 / (sd**2 + _FIRST_SD_RAD**2), 0.0)

    def median(values: Numbers) -> Numbers:
        order = np.argsort(np.where(has, values, np.inf), axis=1)
        share = np.cumsum(np.take_along_axis(weight, order, axis=1), axis=1)
        middle = np.argmax(share >= 0.5 * share[:, -1:], axis=1)
        return np.take_along_axis(values, np.take_along_axis(order, middle[:, None], axis=1), axis=1)[:, 0]

    guess = median(offset)
    spread = 3.0 * median(np.abs(offset - guess[:, None])) + _FIRST_SD_RAD
    return guess, np.where(np.sum(has, axis=1) > 2, spread, _ANYWHERE_RAD)


@dataclass(frozen=True)
class Step:
    """A step of the offset of truck `truck`, between drives `at - 1` and `at`, detected at drive `found`; rad."""

    truck: int
    at: int
    found: int
    size: float
    sd: float


def neutral_moved(drives: Summaries, priors: Priors, step: Step, end: int) -> bool:
    """Whether the neutral lateral acceleration changed with the offset, as after a wheel alignment; from drives before
    `end`."""
    sides = []
    for some in (slice(max(step.at - _NEAR, 0), step.at), slice(step.at, min(step.at + _NEAR, end))):
        value, sd = drives.unloading[step.truck, some], drives.unloading_sd[step.truck, some]
        sure = np.isfinite(value) & (sd < priors.wind_sd_m_s2)
        if not np.any(sure):
            return False
        variance = sd[sure] ** 2 + priors.wind_sd_m_s2**2
        mean = float(np.average(value[sure], weights=1.0 / variance))
        sides.append((mean, 1.0 / float(np.sum(1.0 / variance))))
    (before, before_variance), (after, after_variance) = sides
    return abs(after - before) > _MOVED_SDS * float(np.sqrt(before_variance + after_variance))


def _times(vector: Numbers, row: Numbers, places: Sequence[int] = range(len(STATE))) -> Numbers:
    """Sum over the last axis, in which only these places of the row are not zero."""
    total = vector[..., places[0]] * row[..., places[0]]
    for k in places[1:]:
        total += vector[..., k] * row[..., k]
    return np.asarray(total)


class Filter:
    """The trucks' states after the drives taken so far: `state` (trucks, 7), `covariance` (trucks, 7, 7), and
    `likelihood`, the log likelihood of the drives (trucks,).

    Args:
        load_steer_sd: rad, at the road wheels.
        steps: (trucks, drives), true at the first drive of a new offset; None: steps are tested, and found in `steps`.
        aligned: the same for a new pull.
        with_pull: False: the pull is held at zero, and counts as accelerometer bias, as in one drive.
    """

    def __init__(
        self,
        drives: Summaries,
        priors: Priors,
        load_steer_sd: float,
        steps: Truths | None = None,
        aligned: Truths | None = None,
        *,
        with_pull: bool = True,
    ) -> None:
        self._drives, self._priors, self._given, self._aligned = drives, priors, steps, aligned
        self._with_pull = with_pull
        self._loads = loads_of(drives, priors)
        n = len(drives.ratio)
        side = drives.side[:, 0]
        unknown_side = np.where(side == 0.0, priors.crown_m_s2, 0.0)
        self.state = np.zeros((n, len(STATE)))
        self.state[:, PLAY] = priors.play_mean_rad
        self.state[:, PULL] = priors.pull_mean_m_s2 * side if with_pull else 0.0
        self.state[:, OFFSET], offset_sd = _first_guess(drives.offset, drives.offset_sd)
        self.covariance = np.zeros((n, len(STATE), len(STATE)))
        for place, sd in (
            (OFFSET, offset_sd),
            (BIAS, priors.accelerometer_bias_sd_m_s2),
            (PULL, priors.pull_sd_m_s2 if with_pull else 0.0),
            (PLAY, priors.play_sd_rad),
            (CROWN, np.hypot(priors.region_sd_m_s2, unknown_side)),
            (LOAD_STEER, load_steer_sd * drives.ratio[:, 0]),
            (LOAD_STEER_BENT, load_steer_sd * drives.ratio[:, 0]),
        ):
            self.covariance[:, place, place] = np.asarray(sd) ** 2
        self.likelihood = np.zeros(n)
        self.steps: list[Step] = []
        self._since_step = np.zeros(n, np.int64)
        # the offset's reading of each drive, with its equation
        shape = drives.offset.shape
        self._rows = np.zeros((*shape, len(STATE)))
        self._values, self._variances = np.full(shape, np.nan), np.full(shape, np.nan)
        self._candidates = _Candidates(n)
        self.drives_most = drives.offset.shape[1]

    def take(self, d: int) -> None:
        """Takes drive `d` of all trucks with such a drive."""
        has = np.isfinite(self._drives.offset[:, d])
        self.covariance[has, BIAS, BIAS] += self._priors.bias_wander_sd_m_s2**2
        if self._given is None:
            self._candidates.open(d, has, self._since_step >= _DRIVES_BEFORE)
        else:
            self._guess_offset(d, has & self._given[:, d])
            if self._aligned is not None and self._with_pull:
                self._forget_pull(has & self._aligned[:, d])
        doubt = np.zeros(len(has))
        for reading in readings(self._drives, self._priors, d, self._loads, with_pull=self._with_pull):
            variance = reading.variance
            if reading.of_offset is None:
                variance = variance + doubt
                self._rows[:, d], self._values[:, d], self._variances[:, d] = reading.row, reading.value, variance
            else:
                doubt = doubt + np.square(reading.of_offset) * self._missed(reading)
            self._update(reading, variance, has)
        self._since_step[has] += 1
        if self._given is None:
            self._prove(d, has)

    def _guess_offset(self, d: int, chosen: Truths) -> None:
        """Anew, from this drive on."""
        guess, sd = _first_guess(self._drives.offset[chosen, d:], self._drives.offset_sd[chosen, d:])
        self.state[chosen, OFFSET] = guess
        self.covariance[chosen, OFFSET, :] = self.covariance[chosen, :, OFFSET] = 0.0
        self.covariance[chosen, OFFSET, OFFSET] = sd**2

    def _forget_pull(self, chosen: Truths) -> None:
        self.state[chosen, PULL] = 0.0
        self.covariance[chosen, PULL, :] = self.covariance[chosen, :, PULL] = 0.0
        self.covariance[chosen, PULL, PULL] = self._priors.pull_sd_m_s2**2

    def _missed(self, reading: Reading) -> Numbers:
        """Square of a reading's innovation beyond `_CONTRADICTS` standard deviations."""
        row, places = reading.row, reading.places
        expected = _times(_times(self.covariance, row[:, None, :], places), row, places) + reading.variance
        apart = reading.value - _times(self.state, row, places)
        return np.nan_to_num(np.maximum(apart**2 - _CONTRADICTS**2 * expected, 0.0))

    def _update(self, reading: Reading, variance: Numbers, has: Truths) -> None:
        has = has & np.isfinite(reading.value) & np.isfinite(variance)
        row, places = np.where(has[:, None], reading.row, 0.0), reading.places
        gain = _times(self.covariance, row[:, None, :], places)
        spread = np.where(has, _times(gain, row, places) + variance, 1.0)
        innovation = np.where(has, reading.value - _times(self.state, row, places), 0.0)
        beyond = np.maximum(1.0, np.abs(innovation) / (_INFLUENCE * np.sqrt(spread)))
        self.likelihood -= np.where(has, 0.5 * (innovation**2 / (spread * beyond**2) + np.log(spread)), 0.0)
        spread = spread * beyond**2
        per = np.where(has, 1.0 / spread, 0.0)
        weighted = gain * per[:, None]
        if self._given is None:
            self._candidates.update(row, places, innovation, per, weighted)
        self.state += weighted * innovation[:, None]
        self.covariance -= weighted[:, :, None] * gain[:, None, :]

    def _prove(self, d: int, has: Truths) -> None:
        score, size = self._candidates.scores()
        proved = has[:, None] & (np.abs(size) > _SMALLEST_RAD) & (score > _THRESHOLD)
        best = np.argmax(np.where(proved, score, 0.0), axis=1)
        for n in np.nonzero(np.any(proved, axis=1))[0]:
            at, step, variance, apart = self._candidates.of(int(n), int(best[n]))
            begin = d + 1 - int(self._since_step[n])
            if not self._stands_without_any(int(n), begin, at, d + 1, np.sign(step)):
                continue
            self.state[n] += step * apart
            self.covariance[n] += variance * np.outer(apart, apart)
            self.steps.append(Step(int(n), at, d, step, float(np.sqrt(variance))))
            if neutral_moved(self._drives, self._priors, self.steps[-1], d + 1):
                self._forget_pull(np.arange(len(has)) == n)
            self._candidates.close(int(n))
            self._since_step[n] = d + 1 - at

    def offsets(self) -> tuple[Numbers, Numbers]:
        """Each drive's own offset, given the other estimates of its truck, and its standard deviation: shape
        (trucks, drives)."""
        rest = self.state.copy()
        rest[:, OFFSET] = 0.0
        return self._values - _times(self._rows, rest[:, None, :]), np.sqrt(self._variances)

    def _stands_without_any(self, truck: int, begin: int, at: int, end: int, sign: float) -> bool:
        """Whether drives `at` to `end` differ from those since `begin` without any one drive of either: a single wrong
        drive makes no step. Without the effect of the loads, which such a drive can have distorted."""
        rest = self.state[truck].copy()
        rest[[OFFSET, LOAD_STEER, LOAD_STEER_BENT]] = 0.0
        value = self._values[truck, begin:end] - _times(self._rows[truck, begin:end], rest[None, :])
        weight = 1.0 / self._variances[truck, begin:end]
        before, after = slice(None, at - begin), slice(at - begin, None)
        if at - begin < _DRIVES_BEFORE or end - at < _DRIVES_AFTER:
            return False

        def apart(weight: Numbers) -> float:
            low, high = weight[before], weight[after]
            size = np.average(value[after], weights=high) - np.average(value[before], weights=low)
            return float(sign * size / np.sqrt(1.0 / np.sum(low) + 1.0 / np.sum(high)))

        return all(apart(np.where(np.arange(len(weight)) == k, 0.0, weight)) > _WITHOUT_ONE for k in range(len(weight)))


class _Candidates:
    """Possible steps at the `_AGES` of each truck: `begins` is the first drive after the step, -1 none; `signature` the
    effect of a unit step on the state so far; `information` and `evidence` of its size."""

    def __init__(self, trucks: int) -> None:
        self.begins = np.full((trucks, len(_AGES)), -1)
        self.signature = np.zeros((trucks, len(_AGES), len(STATE)))
        self.information = np.zeros((trucks, len(_AGES)))
        self.evidence = np.zeros((trucks, len(_AGES)))

    def open(self, d: int, has: Truths, enough: Truths) -> None:
        """Opens a candidate at this drive; the older the others are, the fewer of them stay."""
        free = np.full(len(has), True)  # the last place takes any candidate
        for k in range(len(_AGES) - 1, 0, -1):  # one that is old enough moves on, or is dropped if the place is taken
            old = has & (self.begins[:, k - 1] >= 0) & (d - self.begins[:, k - 1] >= _AGES[k])
            moves = old & free
            for array in (self.begins, self.signature, self.information, self.evidence):
                array[moves, k] = array[moves, k - 1]
            self.begins[old, k - 1] = -1
            free = self.begins[:, k - 1] < 0
        self.begins[has, 0] = np.where(enough[has], d, -1)
        for array in (self.signature, self.information, self.evidence):
            array[has, 0] = 0.0

    def update(self, row: Numbers, places: Sequence[int], innovation: Numbers, per: Numbers, weighted: Numbers) -> None:
        """Adds a reading of the filter: the innovation of a unit step is its part that the state does not contain."""
        expected = row[:, None, OFFSET] - _times(self.signature, row[:, None, :], places)
        self.information += expected * expected * per[:, None]
        self.evidence += expected * (innovation * per)[:, None]
        self.signature += expected[:, :, None] * weighted[:, None, :]

    def scores(self) -> tuple[Numbers, Numbers]:
        """Standard deviations of each step, and its size."""
        information = np.where((self.begins >= 0) & (self.information > 0.0), self.information, np.inf)
        return np.abs(self.evidence) / np.sqrt(information), self.evidence / information

    def of(self, truck: int, k: int) -> tuple[int, float, float, Numbers]:
        """Drive, size, variance, and the effect of a unit step on the state that it does not contain so far."""
        information = float(self.information[truck, k])
        apart = -self.signature[truck, k]
        apart[OFFSET] += 1.0
        return int(self.begins[truck, k]), float(self.evidence[truck, k]) / information, 1.0 / information, apart

    def close(self, truck: int) -> None:
        self.begins[truck] = -1
        self.signature[truck] = self.information[truck] = self.evidence[truck] = 0.0
