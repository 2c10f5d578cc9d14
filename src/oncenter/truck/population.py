"""The spread of pull, free play and understeer gradient over the trucks of a fleet: an empirical Bayes estimate.

A truck's pull is only an estimate with an error, and the spread of estimates is larger than that of pulls. The marginal
likelihood of all drives by the truck's model has no such bias: its maximum over the pull's standard deviation is the
estimate (H. Robbins, An empirical Bayes approach to statistics, 1956). The spreads of the regions' crowns and of the
steering by ride height are free. Crown identifies a pull only together with the region's, loads only together
with that steering; only pulls make both alike. So trucks with one load do not count.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from oncenter import _core
from oncenter.signals import DEGREE
from oncenter.truck.events import CALIBRATED, CHANGED, REPAIRED, Event
from oncenter.truck.evidence import Numbers
from oncenter.truck.loads import LOADS_DIFFER, loads_of
from oncenter.truck.now import CROWN, PULL, of_one_side, priors_of_filter, table_of, trucks_now
from oncenter.truck.priors import Priors
from oncenter.truck.row import Row
from oncenter.tuned import PRIORS

Drives = Sequence[Row]  # of a truck, in order of time

TRUCKS_MIN = 10  # with several loads: fewer cannot replace a prior
_PULL_SDS_M_S2 = np.geomspace(0.005, 0.3, 12)
_REGION_SDS_M_S2 = (0.03, 0.05, 0.07, 0.1, 0.14)
_STEER_SDS_RAD = tuple(sd * DEGREE for sd in (0.0005, 0.003, 0.01))  # at the road wheels
_EVIDENCE_SHARE_MIN = 0.1  # of a value's weight, against a division by zero
_PRIOR_TRUCKS = 20.0  # that the prior of an axle set-up is worth
_ROUNDS = 30  # of the mixture's weights
_EVENTS = {"offset": CALIBRATED, "alignment": CHANGED}  # of a change; of every other one REPAIRED


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


def has_several_loads(drives: Drives, priors: Priors) -> bool:
    """Whether the gradients of a truck's drives differ as those of different payloads do: a fifth of them from another
    one, so that a single wrong gradient makes no load."""
    loads = loads_of(drives, priors)
    low, high = np.quantile(loads.gradient[loads.sure], (0.2, 0.8)) if np.any(loads.sure) else (1.0, 1.0)
    return bool(high >= (1.0 + LOADS_DIFFER) * low)


def population_of(trucks: Sequence[Drives], priors: Priors, set_up_probability: float) -> Population:
    """Of trucks with drives at several loads."""
    trucks = list(map(of_one_side, trucks))
    found = trucks_now(trucks, [priors] * len(trucks))
    events = [
        [Event(drives[one.at].start_s, _EVENTS.get(one.kind, REPAIRED)) for one in truck.changes]
        for truck, drives in zip(found, trucks, strict=True)
    ]
    pull_sd, set_up = _pulls(trucks, events, priors, set_up_probability)
    mean, sd = PRIORS["GRADIENT"]
    rows = [row for drives in trucks for row in drives]
    gradient = _less_prior(*_columns((row.gradient, row.gradient_sd) for row in rows), mean, sd)
    play = _less_prior(
        *_columns((truck.play, truck.play_sd) for truck in found), priors.play_mean_rad, priors.play_sd_rad
    )
    return Population(pull_sd, *_normal(*play, len(trucks)), *_normal(*gradient, len(trucks)), set_up)


def _columns(pairs: Iterable[tuple[float, float]]) -> tuple[Numbers, Numbers]:
    values, sds = np.array(list(pairs)).T
    return values, sds**2


def _pulls(
    trucks: Sequence[Drives], events: Sequence[Sequence[Event]], priors: Priors, probability: float
) -> tuple[Learned, Learned | None]:
    """The sd of pulls, and the share of axles set up for the crown."""
    sides = np.array([drives[0].side for drives in trucks])
    has_set_up = probability > 0.0 and bool(np.any(sides != 0.0))
    loads = [loads_of(drives, priors) for drives in trucks]
    by_sd, shares = [], []
    for sd in _PULL_SDS_M_S2:
        some = replace(priors, pull_sd_m_s2=float(sd), changes_per_day=_NEVER, zero_probabilities=_FIXED)
        table = np.concatenate(
            [table_of(*one) for one in zip(trucks, [some] * len(trucks), events, loads, strict=True)]
        )
        of_trucks = np.array([priors_of_filter(some, drives) for drives in trucks], _core.TRUCK_PRIORS)
        of_trucks["variant_probability"] = 1.0, 0.0, 0.0
        usual, ratio = (
            of_trucks["variance"][:, CROWN] - some.region_sd_m_s2**2,
            np.array([drives[0].ratio for drives in trucks]),
        )
        likelihood, share = -math.inf, 0.0
        for region_sd, steer_sd in product(_REGION_SDS_M_S2, _STEER_SDS_RAD):
            of_trucks["variance"][:, CROWN] = usual + region_sd**2
            of_trucks["variant_steer"] = (steer_sd * ratio[:, None]) ** 2
            parts = []
            for shift in (0.0, priors.crown_m_s2) if has_set_up else (0.0,):
                of_trucks["mean"][:, PULL] = shift * sides
                found = _core.truck_histories(table, [len(drives) for drives in trucks], of_trucks)
                parts.append(found["log_likelihood"].copy())
            likelihood, share = max((likelihood, share), _mixed(np.array(parts), probability))
        by_sd.append(likelihood)
        shares.append(share)
    pull_sd, error = _maximum(_PULL_SDS_M_S2, np.array(by_sd))
    if not has_set_up:
        return Learned(pull_sd, error, len(trucks)), None
    share = float(np.interp(pull_sd, _PULL_SDS_M_S2, shares))
    of_share = math.sqrt(share * (1.0 - share) / len(trucks))
    return Learned(pull_sd, error, len(trucks)), Learned(share, of_share, len(trucks))


_NEVER, _FIXED = (0.0,) * len(_core.TRUCK_CHANGES), (1.0, 0.0, 0.0)  # changes beside those that were found; zeros


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
