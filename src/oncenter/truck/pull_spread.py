"""The spread of pulls over the trucks of a fleet, and the trucks outside it: an empirical Bayes estimate.

A truck's pull is only an estimate with an error, and the spread of estimates is larger than that of pulls. The marginal
likelihood of all drives by the truck's model has no such bias (H. Robbins, An empirical Bayes approach to statistics,
1956). The pull of a truck is a mixture:

    p ~ (1 - s - o) N(0, sd^2) + s N(crown_m_s2 on the side of traffic, sd^2) + o N(0, (0.4 m/s^2)^2)

s: share of axles set up for the crown; o: of outliers, which so have no say on the sd. The scatter of drives and the
spreads of crowns and of the steering by ride height are the fleet's own: a scatter given too large hides the pulls.
Crown identifies a pull only together with the region's, loads only together with that steering; only pulls make both
alike. All are integrated over, so that the standard error contains them. Near zero the likelihood has no maximum with
a curvature, so the estimate is the mean of the sd's distribution, and the standard error that distribution's sd.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from oncenter import _core
from oncenter.signals import DEGREE
from oncenter.truck.events import Event
from oncenter.truck.evidence import Numbers
from oncenter.truck.loads import loads_of
from oncenter.truck.now import CROWN, PULL, priors_of_filter, table_of
from oncenter.truck.priors import Priors
from oncenter.truck.row import Row

# Tuned with bench/fleet_pulls.py --tuning, rows of sd 0.1 m/s^2: outliers of 0.3 m/s^2 take 5 % of 200 trucks' spread,
# those of 0.5 are named less often. A share of 0.03, or a probability of 0.5, names half of the outliers of 60 trucks.
_OUTLIER_SD_M_S2 = 0.4
_OUTLIER_PROBABILITY = 0.05  # prior mean of their share
_OUTLIER_MIN = 0.25  # probability from which a truck is named
_SDS_M_S2 = np.geomspace(0.005, 0.3, 36)
_REGION_SDS_M_S2 = (0.03, 0.05, 0.07, 0.1, 0.14)
_STEER_SDS_RAD = tuple(sd * DEGREE for sd in (0.0, 0.0015, 0.003, 0.006, 0.012))  # at the road wheels
_STEER_WEIGHTS = (0.5, 0.125, 0.125, 0.125, 0.125)  # ride height steers in one type of trucks of two
_SCATTERS_RAD = np.geomspace(0.03, 0.3, 7) * DEGREE  # of a drive's offset beyond its own; where the search begins
_TYPICAL = 2  # place in both spreads, at which the scatter is searched
_SET_UP_SHARES = np.array([0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8])
_OUTLIER_SHARES = np.array([0.0, 0.01, 0.02, 0.05, 0.1])
_NEGLIGIBLE = 12.0  # log probability below the largest, from which spreads are left out
_SCATTER_LOG_SD_MAX = 0.5  # of a scatter that is hardly identified
_NEVER, _FIXED = (0.0,) * len(_core.TRUCK_CHANGES), (1.0, 0.0, 0.0)  # changes beside those that were found; zeros


class Outlier(NamedTuple):
    """A truck whose pull the fleet's spread does not explain; m/s^2. `at` is its place among the trucks."""

    at: int
    pull: float
    pull_sd: float


class Pulls(NamedTuple):
    """Mean and sd of the distribution of the pulls' sd (m/s^2), and of the share of axles set up for the crown, None
    where no side of traffic is given."""

    sd: tuple[float, float]
    set_up: tuple[float, float] | None
    outliers: tuple[Outlier, ...]


@dataclass(frozen=True)
class _Fleet:
    """The filter's inputs, in which each pull has an outlier's prior. `shifts` are the mean pulls, of trucks by
    column; `shares` those of mixtures by row: usual ones, axles set up, outliers; `log_prior` is of each mixture."""

    table: npt.NDArray[np.void]
    counts: Sequence[int]
    of_trucks: npt.NDArray[np.void]
    own_noise: Numbers
    own_crown: Numbers
    ratios: Numbers
    shifts: Numbers
    shares: Numbers
    log_prior: Numbers


class _Spreads(NamedTuple):
    """sd of a drive's offset (rad), of the regions' crowns (m/s^2), and of the steering by ride height (rad), and their
    probability before the first truck."""

    scatter: float
    region: float
    steer: float
    weight: float = 1.0


class _Evidence(NamedTuple):
    """Log weight, and mean and variance of the pull, in each history: (trucks, histories); for all trucks together the
    log likelihood, with pulls as of outliers."""

    log_weight: Numbers
    mean: Numbers
    variance: Numbers
    log_likelihood: float


def pulls_of(
    trucks: Sequence[Sequence[Row]], events: Sequence[Sequence[Event]], priors: Priors, probability: float
) -> Pulls:
    """The spread of the pulls of trucks with drives at several loads.

    Args:
        events: changes of each truck.
        probability: of an axle set up for the crown, before these trucks.
    """
    fleet = _fleet(trucks, events, priors, probability)
    steers = zip(_STEER_SDS_RAD, _STEER_WEIGHTS, strict=True)
    spreads = product(_scatters(fleet), _REGION_SDS_M_S2, steers)
    evidence = [_evidence(fleet, _Spreads(scatter, region, *steer)) for scatter, region, steer in spreads]
    at_first = np.array([_at_first(fleet, one) for one in evidence])
    chosen = np.flatnonzero(at_first > at_first.max() - _NEGLIGIBLE).tolist()
    logs = np.array([_log_probability(fleet, evidence[k]) for k in chosen])
    probable = np.exp(logs - logs.max())
    probable /= probable.sum()  # (spreads, mixtures, sds)
    sd = _moments(probable.sum(axis=(0, 1)), _SDS_M_S2)
    of_mixtures = probable.sum(axis=(0, 2))
    best = evidence[chosen[int(np.argmax(probable.sum(axis=(1, 2))))]]
    set_up = _moments(of_mixtures, fleet.shares[:, 1]) if len(fleet.shifts) > 1 else None
    return Pulls(sd, set_up, tuple(_outliers(fleet, best, sd[0], of_mixtures @ fleet.shares)))


def _fleet(
    trucks: Sequence[Sequence[Row]], events: Sequence[Sequence[Event]], priors: Priors, probability: float
) -> _Fleet:
    some = replace(priors, changes_per_day=_NEVER, zero_probabilities=_FIXED)
    loads = [loads_of(drives, priors) for drives in trucks]
    table = np.concatenate([table_of(*one) for one in zip(trucks, [some] * len(trucks), events, loads, strict=True)])
    of_trucks = np.array([priors_of_filter(some, drives) for drives in trucks], _core.TRUCK_PRIORS)
    of_trucks["variant_probability"] = 1.0, 0.0, 0.0
    of_trucks["variant_pull"] = _OUTLIER_SD_M_S2**2
    of_trucks["variance"][:, PULL] = _OUTLIER_SD_M_S2**2
    sides = np.array([drives[0].side for drives in trucks])
    has_set_up = probability > 0.0 and bool(np.any(sides != 0.0))
    set_up, of_set_up = _shares(_SET_UP_SHARES, probability) if has_set_up else (np.zeros(1), np.zeros(1))
    outlier, of_outlier = _shares(_OUTLIER_SHARES, _OUTLIER_PROBABILITY)
    a, b = (each.ravel() for each in np.meshgrid(set_up, outlier, indexing="ij"))
    return _Fleet(
        table=table,
        counts=[len(drives) for drives in trucks],
        of_trucks=of_trucks,
        own_noise=table["noise"][:, 0] - priors.offset_noise_sd_rad**2,
        own_crown=of_trucks["variance"][:, CROWN] - priors.region_sd_m_s2**2,
        ratios=np.array([drives[0].ratio for drives in trucks]),
        shifts=np.array([0.0 * sides, priors.crown_m_s2 * sides])[: 1 + has_set_up],
        shares=np.stack([1.0 - a - b, a, b] if has_set_up else [1.0 - b, b], axis=1),
        log_prior=np.add.outer(of_set_up, of_outlier).ravel(),
    )


def _shares(points: Numbers, mean: float) -> tuple[Numbers, Numbers]:
    """The shares, and their log probability by a beta distribution of this mean, which is highest at zero."""
    return points, (1.0 / mean - 2.0) * np.log1p(-points) + np.log(_widths(points))


def _widths(points: Numbers) -> Numbers:
    """Of the intervals from zero to the last point, about each point."""
    edges = [0.0, *(0.5 * (points[1:] + points[:-1])), points[-1]]
    return np.asarray(np.diff(edges), np.float64)


def _evidence(fleet: _Fleet, spreads: _Spreads) -> _Evidence:
    fleet.table["noise"][:, 0] = fleet.own_noise + spreads.scatter**2
    fleet.of_trucks["variance"][:, CROWN] = fleet.own_crown + spreads.region**2
    fleet.of_trucks["variant_steer"] = (spreads.steer * fleet.ratios[:, None]) ** 2
    found = _core.truck_histories(fleet.table, fleet.counts, fleet.of_trucks)
    histories = found["history"][:, : np.max(found["count"])]
    is_there = np.arange(histories.shape[1]) < found["count"][:, None]
    variance = histories["covariance"].reshape(*histories.shape, 7, 7)[..., PULL, PULL]
    return _Evidence(
        log_weight=np.where(is_there, histories["log_weight"], -math.inf),
        mean=histories["mean"][..., PULL],
        variance=np.where(is_there, variance, 1.0),
        log_likelihood=float(np.sum(found["log_likelihood"])) + math.log(spreads.weight),
    )


def _relative(fleet: _Fleet, evidence: _Evidence, sds: Numbers) -> Numbers:
    """Log likelihoods (parts of the mixture, sds, trucks) relative to that of an outlier, which is the last part. The
    posterior density of the pull over its prior, times the other prior, integrates to a ratio of likelihoods."""
    _, mean, variance, _ = evidence
    parts = np.zeros((len(fleet.shifts) + 1, len(sds), len(mean)))
    prior = np.square(sds)[:, None, None] ** -1.0
    information = 1.0 / variance + prior - _OUTLIER_SD_M_S2**-2.0
    level = evidence.log_weight - 0.5 * (mean**2 / variance + np.log(information * variance / prior))
    for part, shift in zip(parts, fleet.shifts[:, :, None], strict=False):
        vector = mean / variance + shift * prior
        part[:] = np.logaddexp.reduce(level + 0.5 * (vector**2 / information - shift**2 * prior), axis=-1)
    parts[:-1] += math.log(_OUTLIER_SD_M_S2)
    return parts


def _log_probability(fleet: _Fleet, evidence: _Evidence) -> Numbers:
    """Of each mixture and sd, (mixtures, sds), with a uniform prior of the sd."""
    parts = _relative(fleet, evidence, _SDS_M_S2)
    top = np.max(parts, axis=0)
    mixed = np.einsum("mp,pst->mst", fleet.shares, np.exp(parts - top), optimize=True)
    of_sds = np.log(_widths(_SDS_M_S2)) + np.sum(top, axis=1) + evidence.log_likelihood
    return np.asarray(np.sum(np.log(mixed), axis=2) + of_sds + fleet.log_prior[:, None], np.float64)


def _at_first(fleet: _Fleet, evidence: _Evidence) -> float:
    """Log probability at the shares expected before these trucks."""
    prior = np.exp(fleet.log_prior - np.max(fleet.log_prior))
    usual = replace(fleet, shares=(prior @ fleet.shares / prior.sum())[None], log_prior=np.zeros(1))
    return float(np.logaddexp.reduce(_log_probability(usual, evidence)[0]))


def _scatters(fleet: _Fleet) -> Numbers:
    """Three scatters of a drive's offset, the most probable one and those one sd (of its log) below and above."""
    region, steer = _REGION_SDS_M_S2[_TYPICAL], _STEER_SDS_RAD[_TYPICAL]
    at = np.log(_SCATTERS_RAD)
    for _ in range(3):
        probable = [_at_first(fleet, _evidence(fleet, _Spreads(math.exp(each), region, steer))) for each in at]
        middle, sd = _peak(at, np.array(probable))
        at = middle + sd * np.array([-1.0, 0.0, 1.0])
    return np.exp(at)


def _peak(at: Numbers, log_probability: Numbers) -> tuple[float, float]:
    """Mean and sd of the normal distribution through the three points about the highest."""
    k = min(max(int(np.argmax(log_probability)), 1), len(at) - 2)
    near = slice(k - 1, k + 2)
    bend, slope, _ = np.polyfit(at[near] - at[k], log_probability[near], 2)
    if bend >= 0.0:
        return float(at[np.argmax(log_probability)]), _SCATTER_LOG_SD_MAX
    moved = float(np.clip(-0.5 * slope / bend, -_SCATTER_LOG_SD_MAX, _SCATTER_LOG_SD_MAX))
    return float(at[k]) + moved, min((-2.0 * bend) ** -0.5, _SCATTER_LOG_SD_MAX)


def _moments(weights: Numbers, values: Numbers) -> tuple[float, float]:
    mean = float(weights @ values)
    return mean, math.sqrt(float(weights @ (values - mean) ** 2))


def _outliers(fleet: _Fleet, evidence: _Evidence, sd: float, shares: Numbers) -> Iterator[Outlier]:
    """By the evidence at the most probable spreads, and the mean sd and shares."""
    likely = shares[:, None] * np.exp(_relative(fleet, evidence, np.array([sd]))[:, 0])
    for at in np.flatnonzero(likely[-1] > _OUTLIER_MIN * likely.sum(axis=0)).tolist():
        weights = np.exp(evidence.log_weight[at])
        pull, scatter = _moments(weights, evidence.mean[at])
        yield Outlier(at, pull, math.sqrt(float(weights @ evidence.variance[at]) + scatter**2))
