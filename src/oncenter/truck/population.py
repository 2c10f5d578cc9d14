"""The spread of pull, free play and understeer gradient over the trucks of a fleet.

Loads identify a pull only beside the steering by ride height, crown only beside that of the region (`pull_spread.py`).
So trucks with one load do not count.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from oncenter.truck.events import CALIBRATED, CHANGED, REPAIRED, Event
from oncenter.truck.evidence import Numbers
from oncenter.truck.loads import LOADS_DIFFER, loads_of
from oncenter.truck.now import of_one_side, trucks_now
from oncenter.truck.priors import Priors
from oncenter.truck.pull_spread import Outlier, pulls_of
from oncenter.truck.row import Row
from oncenter.tuned import PRIORS

Drives = Sequence[Row]  # of a truck, in order of time

TRUCKS_MIN = 10  # with several loads: fewer cannot replace a prior
_EVIDENCE_SHARE_MIN = 0.1  # of a value's weight, against a division by zero
_ROUNDS = 30  # of Fisher's scoring
# Plays and gradients: sds of the usual ones in that of the far ones, and the share of these at first. 300 fleets of 200
# plays with an sd of 1.5 deg and 5 % at +10 deg: 12 gives 1.46, 5 gives 1.41; without far ones 2.65.
_FAR_1, _FAR_SHARE = 12.0, 0.05
_EVENTS = {"offset": CALIBRATED, "alignment": CHANGED}  # of a change; of every other one REPAIRED


@dataclass(frozen=True)
class Learned:
    """A quantity of the population with its standard error and the number of trucks."""

    value: float
    error: float
    trucks: int


@dataclass(frozen=True)
class Population:
    """SI and rad. `set_up` is the share of axles set up for the crown, None where no side of traffic is given;
    `outliers` are the trucks that do not count for `pull_sd`."""

    pull_sd: Learned
    play_mean: Learned
    play_sd: Learned
    gradient_mean: Learned
    gradient_sd: Learned
    set_up: Learned | None
    outliers: tuple[Outlier, ...] = ()


def has_several_loads(drives: Drives, priors: Priors) -> bool:
    """Whether the gradients of a truck's drives differ as those of different payloads do: a fifth of them from another
    one, so that a single wrong gradient makes no load."""
    loads = loads_of(drives, priors)
    low, high = np.quantile(loads.gradient[loads.sure], (0.2, 0.8)) if np.any(loads.sure) else (1.0, 1.0)
    return bool(high >= (1.0 + LOADS_DIFFER) * low)


def population_of(
    trucks: Sequence[Drives], priors: Priors, set_up_probability: float, stated: Sequence[Sequence[Event]] = ()
) -> Population:
    """Of trucks with drives at several loads.

    Args:
        stated: what a person stated about each truck.
    """
    trucks, count = list(map(of_one_side, trucks)), len(trucks)
    found = trucks_now(trucks, [priors] * count, stated)
    events = [
        [Event(drives[one.at].start_s, _EVENTS.get(one.kind, REPAIRED)) for one in truck.changes]
        for truck, drives in zip(found, trucks, strict=True)
    ]
    pulls = pulls_of(trucks, events, priors, set_up_probability)
    mean, sd = PRIORS["GRADIENT"]
    rows = [row for drives in trucks for row in drives]
    gradient = _less_prior(*_columns((row.gradient, row.gradient_sd) for row in rows), mean, sd)
    play = _less_prior(
        *_columns((truck.play, truck.play_sd) for truck in found), priors.play_mean_rad, priors.play_sd_rad
    )
    set_up = None if pulls.set_up is None else Learned(*pulls.set_up, count)
    return Population(
        Learned(*pulls.sd, count), *_normal(*play, count), *_normal(*gradient, count), set_up, pulls.outliers
    )


def _columns(pairs: Iterable[tuple[float, float]]) -> tuple[Numbers, Numbers]:
    values, sds = np.array(list(pairs)).T
    return values, sds**2


def _less_prior(value: Numbers, variance: Numbers, mean: float, sd: float) -> tuple[Numbers, Numbers]:
    """Value and variance of the evidence alone."""
    share = np.maximum(1.0 - variance / sd**2, _EVIDENCE_SHARE_MIN)
    some = np.isfinite(value)
    return mean + (value[some] - mean) / share[some], variance[some] / share[some]


def _normal(value: Numbers, variance: Numbers, trucks: int) -> tuple[Learned, Learned]:
    """Mean and sd of a normal population by maximum likelihood, of values with errors of these variances. A share of
    the values, which is free, is of a far wider population."""
    own, mean = max(float(np.var(value) - np.mean(variance)), 0.0), float(np.median(value))
    usual, information = 1.0 - _FAR_SHARE, 0.0
    for _ in range(_ROUNDS):  # Fisher's scoring
        total, square = own + variance, (value - mean) ** 2
        near = usual * _density(square, total)
        likely = near / (near + (1.0 - usual) * _density(square, _FAR_1**2 * own + variance))
        usual = float(np.mean(likely))
        weight = likely / total
        mean = float(np.sum(weight * value) / np.sum(weight))
        score = 0.5 * float(np.sum(weight * ((value - mean) ** 2 / total - 1.0)))
        information = 0.5 * float(np.sum(weight / total))
        own = max(own + score / information, 0.0)
    per_truck = len(value) / trucks
    error = math.sqrt(per_truck / information)
    sd = math.sqrt(own)
    of_mean = Learned(mean, math.sqrt(per_truck / float(np.sum(weight))), trucks)
    return of_mean, Learned(sd, math.sqrt(own + error) - sd if own < error else 0.5 * error / sd, trucks)


def _density(square: Numbers, variance: Numbers) -> Numbers:
    """Of a normal distribution, times a constant."""
    return np.asarray(np.exp(-0.5 * square / variance) / np.sqrt(variance), np.float64)
