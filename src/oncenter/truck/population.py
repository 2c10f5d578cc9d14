"""The spread of pull, free play and understeer gradient over the trucks of a fleet: an empirical Bayes estimate.

A truck's pull is only an estimate with an error, and the spread of estimates is larger than that of pulls. The marginal
likelihood of all drives by the truck's model has no such bias: its maximum over the pull's standard deviation is the
estimate (H. Robbins, An empirical Bayes approach to statistics, 1956). The spreads of the regions' crowns and of the
steering by ride height are free. Crown identifies a pull only together with the region's, loads only together
with that steering; only pulls make both alike. So trucks with one load do not count.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from oncenter.signals import DEGREE
from oncenter.truck.drives import Numbers, Summaries
from oncenter.truck.kalman import Filter, neutral_moved
from oncenter.truck.model import LOADS_DIFFER, learn
from oncenter.truck.priors import Priors
from oncenter.truck.readings import CROWN, OFFSET, loads_of
from oncenter.tuned import PRIORS

TRUCKS_MIN = 10  # with several loads: fewer cannot replace a prior
_PULL_SDS_M_S2 = np.geomspace(0.005, 0.3, 12)
_REGION_SDS_M_S2 = (0.03, 0.05, 0.07, 0.1, 0.14)
_STEER_SDS_RAD = tuple(sd * DEGREE for sd in (0.0005, 0.003, 0.01))  # at the road wheels
_ANY_OFFSET_RAD = 0.5
_EVIDENCE_SHARE_MIN = 0.1  # of a value's weight, against a division by zero
_PRIOR_TRUCKS = 20.0  # that the prior of an axle set-up is worth
_ROUNDS = 30  # of the mixture's weights


@dataclass(frozen=True)
class Learned:
    """A quantity of the population with its standard error and the number of trucks."""

    value: float
    error: float
    trucks: int


@dataclass(frozen=True)
class Population:
    """SI and rad. `set_up` is the share of axles set up for the crown, None where no side of traffic is given."""

    pull_sd: Learned
    play_mean: Learned
    play_sd: Learned
    gradient_mean: Learned
    gradient_sd: Learned
    set_up: Learned | None


def trucks_of_several_loads(drives: Summaries, priors: Priors) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Whether the gradients of a truck's drives differ as those of different payloads do: a fifth of them from another
    one, so that a single wrong gradient makes no load."""
    loads = loads_of(drives, priors)
    found = np.zeros(len(drives.ratio), np.bool_)
    for k, sure in enumerate(loads.sure):
        if np.any(sure):
            low, high = np.quantile(loads.gradient[k, sure], (0.2, 0.8))
            found[k] = high >= (1.0 + LOADS_DIFFER) * low
    return found


def population_of(drives: Summaries, priors: Priors, set_up_probability: float) -> Population:
    """Of trucks with drives at several loads."""
    trucks = learn(drives, priors)
    stepped, aligned = np.zeros(drives.offset.shape, np.bool_), np.zeros(drives.offset.shape, np.bool_)
    for step in trucks.steps:
        stepped[step.truck, step.at] = True
        aligned[step.truck, step.at] = neutral_moved(drives, priors, step, drives.offset.shape[1])
    pull_sd, set_up = _pulls(drives, priors, set_up_probability, stepped, aligned)
    mean, sd = PRIORS["GRADIENT"]
    gradient, variance = _less_prior(drives.gradient, drives.gradient_sd**2, mean, sd)
    play, play_variance = _less_prior(trucks.play, trucks.play_sd**2, priors.play_mean_rad, priors.play_sd_rad)
    n = len(drives.ratio)
    return Population(pull_sd, *_normal(play, play_variance, n), *_normal(gradient, variance, n), set_up)


def _pulls(
    drives: Summaries,
    priors: Priors,
    probability: float,
    stepped: np.ndarray[tuple[int, ...], np.dtype[np.bool_]],
    aligned: np.ndarray[tuple[int, ...], np.dtype[np.bool_]],
) -> tuple[Learned, Learned | None]:
    """The sd of pulls, and the share of axles set up for the crown."""
    sides = np.all((drives.side == 0.0) | np.isnan(drives.side))
    shifts = (0.0,) if sides or probability == 0.0 else (0.0, priors.crown_m_s2)
    by_sd, shares = [], []
    for sd in _PULL_SDS_M_S2:
        likelihood, share = -math.inf, 0.0
        for region_sd, steer_sd in product(_REGION_SDS_M_S2, _STEER_SDS_RAD):
            parts = [
                _likelihood(
                    drives,
                    replace(priors, pull_sd_m_s2=float(sd), pull_mean_m_s2=shift),
                    region_sd,
                    steer_sd,
                    stepped,
                    aligned,
                )
                for shift in shifts
            ]
            likelihood, share = max((likelihood, share), _mixed(np.array(parts), probability))
        by_sd.append(likelihood)
        shares.append(share)
    pull_sd, error = _maximum(_PULL_SDS_M_S2, np.array(by_sd))
    trucks = len(drives.ratio)
    if len(shifts) == 1:
        return Learned(pull_sd, error, trucks), None
    share = float(np.interp(pull_sd, _PULL_SDS_M_S2, shares))
    return Learned(pull_sd, error, trucks), Learned(share, math.sqrt(share * (1.0 - share) / trucks), trucks)


def _likelihood(
    drives: Summaries,
    priors: Priors,
    region_sd: float,
    steer_sd: float,
    stepped: np.ndarray[tuple[int, ...], np.dtype[np.bool_]],
    aligned: np.ndarray[tuple[int, ...], np.dtype[np.bool_]],
) -> Numbers:
    """The log likelihood of each truck's drives."""
    one = Filter(drives, priors, steer_sd, stepped, aligned)
    one.covariance[:, OFFSET, OFFSET] = _ANY_OFFSET_RAD**2  # the filter's guess is of the drives, pull included
    unknown_side = np.where(drives.side[:, 0] == 0.0, priors.crown_m_s2, 0.0)
    one.covariance[:, CROWN, CROWN] = region_sd**2 + unknown_side**2  # the drives' own prior stays that of the core
    for d in range(one.drives_most):
        one.take(d)
    return one.likelihood


def _mixed(parts: Numbers, probability: float) -> tuple[float, float]:
    """The log likelihood of the fleet at the most likely share of axles set up for the crown, and this share.

    Args:
        parts: log likelihoods (set-up or not, trucks).
    """
    if len(parts) == 1:
        return float(np.sum(parts)), 0.0
    most, trucks, set_up = np.max(parts, axis=0), parts.shape[1], probability
    usual, other = np.exp(parts - most)
    for _ in range(_ROUNDS):
        likely = set_up * other / ((1.0 - set_up) * usual + set_up * other)
        set_up = (float(np.sum(likely)) + _PRIOR_TRUCKS * probability) / (trucks + _PRIOR_TRUCKS)
    return float(np.sum(np.log((1.0 - set_up) * usual + set_up * other) + most)), set_up


def _maximum(at: Numbers, likelihood: Numbers) -> tuple[float, float]:
    """The most likely value, and half the interval in which the log likelihood is within 0.5 of it."""
    fine = np.geomspace(at[0], at[-1], 2000)
    course = np.interp(np.log(fine), np.log(at), likelihood)
    k = int(np.argmax(likelihood))
    if 0 < k < len(at) - 1:  # a parabola through the three highest
        course = np.where(
            (fine > at[k - 1]) & (fine < at[k + 1]),
            np.polyval(np.polyfit(np.log(at[k - 1 : k + 2]), likelihood[k - 1 : k + 2], 2), np.log(fine)),
            course,
        )
    near = fine[course > course.max() - 0.5]
    return float(fine[int(np.argmax(course))]), float(0.5 * (near[-1] - near[0]))


def _less_prior(value: Numbers, variance: Numbers, mean: float, sd: float) -> tuple[Numbers, Numbers]:
    """Value and variance of the evidence alone."""
    share = np.maximum(1.0 - variance / sd**2, _EVIDENCE_SHARE_MIN)
    some = np.isfinite(value)
    return mean + (value[some] - mean) / share[some], variance[some] / share[some]


def _normal(value: Numbers, variance: Numbers, trucks: int) -> tuple[Learned, Learned]:
    """Mean and sd of a normal population by maximum likelihood, of values with errors of these variances."""
    own, mean, information = max(float(np.var(value) - np.mean(variance)), 0.0), 0.0, 0.0
    for _ in range(_ROUNDS):  # Fisher's scoring
        weight = 1.0 / (own + variance)
        mean = float(np.sum(weight * value) / np.sum(weight))
        score = 0.5 * float(np.sum((weight * (value - mean)) ** 2 - weight))
        information = 0.5 * float(np.sum(weight**2))
        own = max(own + score / information, 0.0)
    per_truck = len(value) / trucks
    error = math.sqrt(per_truck / information)
    sd = math.sqrt(own)
    of_mean = Learned(mean, math.sqrt(per_truck / float(np.sum(weight))), trucks)
    return of_mean, Learned(sd, math.sqrt(own + error) - sd if own < error else 0.5 * error / sd, trucks)
