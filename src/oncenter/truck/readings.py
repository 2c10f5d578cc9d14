"""Readings of a truck's state by each drive: the equations of the model (docs/many_drives.md).

Of drive d, i the steering ratio, K_d the understeer gradient of its load, K their mean, s compliance's share of K:

    offset at neutral acceleration        o_d   = o + i (K + (1 - s) (K_d - K)) p + g_1 l + g_2 (l^2 - mean) + noise
    neutral lateral acceleration          a_0,d = b + p                                                      + noise
    free play                             B_d   = B                                                          + noise
    mean bank of its roads                m_d   = b + t (c + C)                                              + noise
    ground that it stood on               n_d   = b + h t (c + C)                                            + noise

with o the straight-ahead offset, b the accelerometer bias, p the pull, C the difference of the truck's road crown from
c, t the traffic side, l the load by K_d, g the steering effect of ride height. A pull changes o_d by i K_d; an
accelerometer bias does not. The steering compliance under the moment of a pull is in o at any load.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from oncenter.truck.drives import Numbers, Summaries
from oncenter.truck.priors import Priors

STATE = ("offset", "accelerometer_bias", "pull", "play", "crown", "load_steer", "load_steer_bent")
OFFSET, BIAS, PULL, PLAY, CROWN, LOAD_STEER, LOAD_STEER_BENT = range(len(STATE))

_GRADIENT_ERROR_MIN = 0.02  # share of the prior's mean, of a drive
_GRADIENT_MIN = 0.1  # share of the prior's mean
_SURE_GAIN = 0.8  # of a drive's own gradient, from which it is used to compare loads


@dataclass(frozen=True)
class Reading:
    """One number of each truck: its expectation is `row` (trucks, state) times the state, with this variance; only
    `places` of the row are not zero.

    `of_offset` is the error of the drive's offset per unit error of this reading: a drive with a wrong play has a wrong
    offset as well. None: it is the offset itself.
    """

    row: Numbers
    places: tuple[int, ...]
    value: Numbers
    variance: Numbers
    of_offset: float | Numbers | None = 0.0


@dataclass(frozen=True)
class Loads:
    """Loads of each truck, from its gradients; (trucks, drives), the means (trucks, 1).

    `gradient`, rad/(m/s^2), is that of each drive, shrunk to the mean of its truck, with its variance. `load` is its
    distance from that mean, in units of the scatter of loads.
    """

    gradient: Numbers
    variance: Numbers
    mean: Numbers
    load: Numbers
    load_squared_mean: Numbers
    sure: npt.NDArray[np.bool_]

    def differ_by(self) -> Numbers:
        """The excess of each truck's largest accurate gradient of a drive over the smallest, as a share."""
        largest = np.max(np.where(self.sure, self.gradient, 0.0), axis=1)
        smallest = np.min(np.where(self.sure, self.gradient, np.inf), axis=1)
        return np.where(largest > 0.0, largest / smallest - 1.0, 0.0)


def _summed(values: Numbers) -> Numbers:
    """Over the drives, one after the other: missing drives do not change a bit of the sum."""
    return np.cumsum(values, axis=1)[:, -1:]


def loads_of(drives: Summaries, priors: Priors) -> Loads:
    """A drive with an inaccurate gradient gets its truck's mean, in which the prior counts as half a drive."""
    has = np.isfinite(drives.gradient)
    prior = priors.gradient_mean_rad_m_s2
    value = np.where(has, np.maximum(drives.gradient, 0.0), prior)
    own = np.where(has, np.maximum(drives.gradient_sd, _GRADIENT_ERROR_MIN * prior), 1.0) ** 2
    at_first = (priors.load_spread_1 * prior) ** 2
    weight, weight_of_prior = np.where(has, 1.0 / (own + at_first), 0.0), 0.5 / at_first
    total = _summed(weight) + weight_of_prior
    mean = (_summed(weight * value) + weight_of_prior * prior) / total
    between = (priors.load_spread_1 * mean) ** 2
    gain = between / (between + own)
    gradient = np.maximum(mean + gain * (value - mean), _GRADIENT_MIN * prior)
    mean = _summed(weight * gradient) / _summed(weight)
    load = np.where(has, (gradient / mean - 1.0) / priors.load_spread_1, 0.0)
    squared = _summed(has * load**2) / _summed(has)
    return Loads(gradient, gain * own, mean, load, squared, has & (gain > _SURE_GAIN))


def readings(drives: Summaries, priors: Priors, d: int, loads: Loads, *, with_pull: bool = True) -> Iterator[Reading]:
    """The readings of drive `d` of each truck, independent of each other; the offset's comes last.

    Args:
        with_pull: False: the state's pull is held at zero, so that between loads it is scatter of the offset.
    """
    side = drives.side[:, d]
    crown = side * priors.crown_m_s2
    along = np.where(side == 0.0, 1.0, side)
    share = priors.standing_crown_share_1
    bank, standing = drives.bank[:, d] - crown, drives.standing[:, d] - share * crown
    yield _reading({BIAS: 1.0, CROWN: along}, bank, priors.road_sd_m_s2**2)
    yield _reading({BIAS: 1.0, CROWN: share * along}, standing, priors.standing_slope_sd_m_s2**2)
    alone = _without_priors(drives, priors, d)
    play = drives.play[:, d]
    mean, load = loads.mean[:, 0], loads.load[:, d]
    pulled = drives.ratio[:, d] * (mean + (1.0 - priors.compliance_share_1) * (loads.gradient[:, d] - mean))
    windy = alone.unloading_variance + priors.wind_sd_m_s2**2
    yield _reading({BIAS: 1.0, PULL: 1.0}, alone.unloading, windy, pulled)
    yield _reading({PLAY: 1.0}, play, alone.play_variance + priors.play_noise_sd_rad**2, 0.5)
    by_gradient = (drives.ratio[:, d] * priors.pull_sd_m_s2) ** 2 * loads.variance[:, d]
    by_load = 0.0 if with_pull else ((pulled - drives.ratio[:, d] * mean) * priors.pull_sd_m_s2) ** 2
    wide = 1.0 + alone.offset_variance / priors.wide_rad**2
    yield _reading(  # the offset given the other two, independent of their errors
        {
            OFFSET: 1.0,
            BIAS: -alone.per_unloading,
            PULL: pulled - alone.per_unloading,
            PLAY: -alone.per_play,
            LOAD_STEER: load,
            LOAD_STEER_BENT: load**2 - loads.load_squared_mean[:, 0],
        },
        alone.offset - alone.per_unloading * np.nan_to_num(alone.unloading) - alone.per_play * play,
        alone.offset_variance * wide + priors.offset_noise_sd_rad**2 + by_gradient + by_load,
        None,
    )


def _reading(
    of: Mapping[int, float | Numbers],
    value: Numbers,
    variance: float | Numbers,
    of_offset: float | Numbers | None = 0.0,
) -> Reading:
    """`of`: the coefficient of each place of the state in the value."""
    row = np.zeros((len(value), len(STATE)))
    for place, share in of.items():
        row[:, place] = share
    return Reading(row, tuple(of), value, np.broadcast_to(variance, value.shape), of_offset)


@dataclass(frozen=True)
class _Alone:
    """A drive without the core's priors, which count once, in the truck's state.

    `per_*` are the offset's slopes on the other two, `offset_variance` is given them.
    """

    offset: Numbers
    unloading: Numbers
    unloading_variance: Numbers
    play_variance: Numbers
    per_unloading: Numbers
    per_play: Numbers
    offset_variance: Numbers


def _without_priors(drives: Summaries, priors: Priors, d: int) -> _Alone:
    measured = np.isfinite(drives.unloading[:, d])
    unloading_variance = np.where(measured, drives.unloading_sd[:, d] ** 2, 1.0)
    play_variance = drives.play_sd[:, d] ** 2
    per_unloading = np.where(measured, drives.with_unloading[:, d], 0.0) / unloading_variance
    per_play = drives.with_play[:, d] / play_variance
    own = drives.offset_sd[:, d] ** 2
    rest = own - per_unloading**2 * unloading_variance - per_play**2 * play_variance
    mean, prior = _prior_bias(drives, priors, d)
    alone = _less_prior(unloading_variance, prior)
    moved = (drives.unloading[:, d] - mean) * alone / prior
    return _Alone(
        offset=drives.offset[:, d] + np.where(measured, per_unloading * moved, 0.0),
        unloading=drives.unloading[:, d] + moved,
        unloading_variance=alone,
        play_variance=_less_prior(play_variance, priors.play_sd_rad**2),
        per_unloading=per_unloading,
        per_play=per_play,
        offset_variance=np.maximum(rest, 0.05 * own),  # the core's covariances are of a mixture: rest may be negative
    )


def _less_prior(variance: Numbers, prior: Numbers | float) -> Numbers:
    """The variance of the evidence alone; at most a hundred times the variance with the prior."""
    return np.asarray(variance / np.maximum(1.0 - variance / prior, 0.01))


def _prior_bias(drives: Summaries, priors: Priors, d: int) -> tuple[Numbers, Numbers]:
    """Mean and variance of the accelerometer bias from its prior, the road bank and the standstill, without evidence
    from the steering: core/monitor/joint_method.c, prior_of."""
    side = drives.side[:, d]
    bias, crown = np.zeros_like(side), side * priors.crown_m_s2
    of_bias = np.full_like(side, priors.accelerometer_bias_sd_m_s2**2)
    of_crown = priors.crown_sd_m_s2**2 + np.where(side == 0.0, priors.crown_m_s2, 0.0) ** 2
    both = np.zeros_like(side)
    for reading, share, sd in (
        (drives.bank[:, d], 1.0, 0.0),
        (drives.standing[:, d], priors.standing_crown_share_1, priors.standing_slope_sd_m_s2),
    ):
        has = np.isfinite(reading)
        to_bias, to_crown = of_bias + share * both, both + share * of_crown
        total = to_bias + share * to_crown + sd**2
        innovation = np.where(has, reading - bias - share * crown, 0.0)
        bias, crown = bias + to_bias / total * innovation, crown + to_crown / total * innovation
        of_bias, of_crown, both = (
            np.where(has, of_bias - to_bias**2 / total, of_bias),
            np.where(has, of_crown - to_crown**2 / total, of_crown),
            np.where(has, both - to_bias * to_crown / total, both),
        )
    return bias, of_bias
