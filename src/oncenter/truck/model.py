"""One model over a truck's drives: the quantities that stay with the truck, and the steps of its offset.

It runs twice: with a small and with a large steering effect of ride height. The results are weighted by likelihood.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oncenter.truck.drives import Numbers, Summaries
from oncenter.truck.kalman import Filter, Step, neutral_moved
from oncenter.truck.priors import Priors
from oncenter.truck.readings import BIAS, OFFSET, PLAY, PULL, loads_of

_LOADS_DIFFER = 0.2  # of the largest gradient above the smallest: tuned, twice the scatter of one load


@dataclass(frozen=True)
class Trucks:
    """The trucks after their last drives, each member of shape (trucks,); SI and rad.

    `offset` is the straight-ahead offset of the drives since the last step, at the truck's mean load, with the standard
    deviation, pull and crown included; `spread_sd` is without these: of the drives since the last step alone.
    `load_would_help`: drives at another load would separate a pull from the accelerometer's bias. `steps` are all that
    were found, by truck and time.
    """

    offset: Numbers
    offset_sd: Numbers
    accelerometer_bias: Numbers
    accelerometer_bias_sd: Numbers
    pull: Numbers
    pull_sd: Numbers
    play: Numbers
    play_sd: Numbers
    spread_sd: Numbers
    load_would_help: np.ndarray[tuple[int], np.dtype[np.bool_]]
    steps: tuple[Step, ...]
    offsets: Numbers  # (trucks, drives): each drive's own, given the other estimates of its truck, and its sd
    offset_sds: Numbers


def learn(drives: Summaries, priors: Priors) -> Trucks:
    """All trucks of `drives`; each has a first drive."""
    steps = _run(Filter(drives, priors, priors.step_load_steer_sd_rad)).steps
    stepped = np.zeros(drives.offset.shape, np.bool_)
    aligned = np.zeros(drives.offset.shape, np.bool_)
    for step in steps:
        stepped[step.truck, step.at] = True
        aligned[step.truck, step.at] = neutral_moved(drives, priors, step, drives.offset.shape[1])
    both = [_run(Filter(drives, priors, sd, stepped, aligned)) for sd in priors.load_steer_sds_rad]
    shares = _shares(both, priors)

    def mixed(place: int) -> tuple[Numbers, Numbers]:
        means = [one.state[:, place] for one in both]
        mean = shares[0] * means[0] + shares[1] * means[1]
        variance = sum(
            share * (one.covariance[:, place, place] + (own - mean) ** 2)
            for share, one, own in zip(shares, both, means, strict=True)
        )
        return mean, np.sqrt(variance)

    pull, pull_sd = mixed(PULL)
    offsets, offset_sds = both[0].offsets()
    return Trucks(
        *mixed(OFFSET),
        *mixed(BIAS),
        pull,
        pull_sd,
        *mixed(PLAY),
        spread_sd=_spread(offset_sds, steps),
        load_would_help=loads_of(drives, priors).differ_by() < _LOADS_DIFFER,
        steps=tuple(sorted(steps, key=lambda step: (step.truck, step.at))),
        offsets=offsets,
        offset_sds=offset_sds,
    )


def _run(one: Filter) -> Filter:
    for d in range(one.drives_most):
        one.take(d)
    return one


def _shares(both: list[Filter], priors: Priors) -> tuple[Numbers, Numbers]:
    """Probability of each result, by Bayes."""
    prior_little, prior_much = priors.load_steer_weights
    apart = np.clip(both[1].likelihood - both[0].likelihood, -50.0, 50.0)
    much = prior_much * np.exp(apart) / (prior_little + prior_much * np.exp(apart))
    return 1.0 - much, much


def _spread(offset_sds: Numbers, steps: list[Step]) -> Numbers:
    """Standard deviation of each truck's mean over its drives since the last step."""
    since = np.zeros(len(offset_sds), np.int64)
    for step in steps:
        since[step.truck] = max(since[step.truck], step.at)
    counts = np.isfinite(offset_sds) & (np.arange(offset_sds.shape[1])[None, :] >= since[:, None])
    information = np.cumsum(np.where(counts, offset_sds, np.inf) ** -2.0, axis=1)[:, -1]  # see readings._summed
    return np.asarray(np.where(information > 0.0, information, 1.0) ** -0.5)
