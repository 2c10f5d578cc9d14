"""One model over a truck's drives: the quantities that stay with the truck, and the steps of its offset.

It runs four times: to find the steps; with a small and with a large steering effect of ride height, whose results are
weighted by likelihood; and without a pull, for the drives' common reading.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from oncenter.truck.drives import Numbers, Summaries
from oncenter.truck.kalman import Filter, Step, Truths, neutral_moved
from oncenter.truck.priors import Priors
from oncenter.truck.readings import BIAS, OFFSET, PLAY, PULL, loads_of
from oncenter.truck.zero import Zero, zero_of

LOADS_DIFFER = 0.2  # of the largest gradient above the smallest: tuned, twice the scatter of one load


@dataclass(frozen=True)
class Trucks:
    """The trucks after their last drives, each member of shape (trucks,); SI and rad.

    `offset` is the straight-ahead offset of the drives since the last step, at the truck's mean load, with a pull
    counted as accelerometer bias, as one drive counts it; `spread_sd` is its standard deviation by these drives alone.
    `less_pull` is the same less the effect of the pull that loads and roads show, with the standard deviation of both.
    `neutral` is the neutral lateral acceleration. `since` is the first drive of the present offset, `zero` whether the
    drives agree on one; where they do not, the offset is that of the last drive.
    `load_would_help`: drives at another load would separate a pull from the accelerometer's bias. `steps` are all that
    were found, by truck and time.
    """

    offset: Numbers
    spread_sd: Numbers
    less_pull: Numbers
    less_pull_sd: Numbers
    accelerometer_bias: Numbers
    accelerometer_bias_sd: Numbers
    pull: Numbers
    pull_sd: Numbers
    play: Numbers
    play_sd: Numbers
    neutral: Numbers
    neutral_sd: Numbers
    load_would_help: np.ndarray[tuple[int], np.dtype[np.bool_]]
    steps: tuple[Step, ...]
    since: tuple[int, ...]
    zero: tuple[Zero, ...]
    offsets: Numbers  # (trucks, drives): each drive's own, given the other estimates of its truck, and its sd
    offset_sds: Numbers

    @property
    def offset_sd(self) -> Numbers:
        """Of `offset`, pull and crown included."""
        return np.hypot(np.maximum(self.less_pull_sd, self.spread_sd), self.offset - self.less_pull)


def learn(drives: Summaries, priors: Priors, changed: Truths | None = None) -> Trucks:
    """All trucks of `drives`; each has a first drive.

    Args:
        changed: (trucks, drives): the offset changed before or in this drive. Steps beside it are not
            searched for.
    """
    steps = _run(Filter(drives, priors, priors.step_load_steer_sd_rad)).steps
    known = np.zeros(drives.offset.shape, np.bool_) if changed is None else changed
    steps = [step for step in steps if not np.any(known[step.truck, max(step.at - 1, 0) : step.at + 2])]
    stepped, aligned = known.copy(), np.zeros(drives.offset.shape, np.bool_)
    for step in steps:
        stepped[step.truck, step.at] = True
        aligned[step.truck, step.at] = neutral_moved(drives, priors, step, drives.offset.shape[1])
    both = [_run(Filter(drives, priors, sd, stepped, aligned)) for sd in priors.load_steer_sds_rad]
    straight = _run(Filter(drives, priors, priors.load_steer_sds_rad[0], stepped, with_pull=False))
    shares = _shares(both, priors)

    def mixed(place: int) -> tuple[Numbers, Numbers]:
        means = [one.state[:, place] for one in both]
        mean = shares[0] * means[0] + shares[1] * means[1]
        variance = sum(
            share * (one.covariance[:, place, place] + (own - mean) ** 2)
            for share, one, own in zip(shares, both, means, strict=True)
        )
        return mean, np.sqrt(variance)

    def of(place: int) -> tuple[Numbers, Numbers]:
        return straight.state[:, place], np.sqrt(straight.covariance[:, place, place])

    offset, spread_sd = of(OFFSET)
    offsets, offset_sds = straight.offsets()
    trucks = Trucks(
        offset,
        np.hypot(spread_sd, _common_sd(drives, priors)),
        *mixed(OFFSET),
        *mixed(BIAS),
        *mixed(PULL),
        *of(PLAY),
        *of(BIAS),
        load_would_help=loads_of(drives, priors).differ_by() < LOADS_DIFFER,
        steps=tuple(sorted(steps, key=lambda step: (step.truck, step.at))),
        since=tuple(int(np.flatnonzero(one)[-1]) if one.any() else 0 for one in stepped),
        zero=tuple(_zero(one, own, sd) for one, own, sd in zip(stepped, offsets, offset_sds, strict=True)),
        offsets=offsets,
        offset_sds=offset_sds,
    )
    return _with_the_last_drives(trucks)


def _common_sd(drives: Summaries, priors: Priors) -> Numbers:
    """Of the offset, rad, by what all drives of a truck share; without an accelerometer their region's crown."""
    per_acceleration = drives.ratio[:, 0] * loads_of(drives, priors).mean[:, 0]
    unmeasured = np.all(np.isnan(drives.unloading), axis=1)
    return np.hypot(priors.offset_common_sd_rad, np.where(unmeasured, per_acceleration * priors.region_sd_m_s2, 0.0))


def _zero(stepped: Truths, offsets: Numbers, sds: Numbers) -> Zero:
    """Of one truck."""
    count = int(np.isfinite(offsets).sum())
    return zero_of(offsets[:count], sds[:count], np.flatnonzero(stepped[:count]).tolist())


def _with_the_last_drives(trucks: Trucks) -> Trucks:
    """Where the zero is not fixed, a truck's offset is that of its last drive; a moving one may move on by as much as
    it did from drive to drive."""
    differs = np.array([zero != "fixed" for zero in trucks.zero])
    if not differs.any():
        return trucks
    count = np.isfinite(trucks.offsets).sum(axis=1)
    rows = np.arange(len(count))
    last, last_sd = trucks.offsets[rows, count - 1], trucks.offset_sds[rows, count - 1]
    before = trucks.offsets[rows, np.maximum(count - 2, 0)]
    moved = np.where([zero == "moves" for zero in trucks.zero], np.abs(last - before), 0.0)
    apart = np.where(differs, last - trucks.offset, 0.0)
    return replace(
        trucks,
        offset=trucks.offset + apart,
        spread_sd=np.where(differs, np.hypot(last_sd, moved), trucks.spread_sd),
        less_pull=trucks.less_pull + apart,
        since=tuple(int(n - 1) if k else at for n, k, at in zip(count, differs, trucks.since, strict=True)),
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
