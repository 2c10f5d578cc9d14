"""What a drive's offset is once the truck's other drives have told how much play its steering has.

A drive that has seen one flank of the play, as on a motorway whose crown always pushes to one side, knows where that
flank is, the offset plus or minus half the play, and knows neither alone: what it errs in the play it errs half as much
in the offset, and says so in both standard deviations (core/joint_answer.c). The play stays with the truck.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

Numbers = npt.NDArray[np.float64]

AS_IT_SHOULD = 2.0  # drives, taken to scatter as they should beside those there are: two alone say little of it
_LEARNED = 0.7  # of the play's part in an offset's variance: on such roads drives are off in other ways, too
_CONTRADICTS = 2.0  # standard deviations between a drive's play and the truck's
_OF_PLAY = 0.95  # the largest share of an offset's variance that can be the play's


@dataclass(frozen=True)
class Told:
    """One quantity of one truck, drive by drive in order of time: each of shape (n,).

    `start_s` since 1970; `sd` the drive's own.
    """

    start_s: Numbers
    value: Numbers
    sd: Numbers

    def part(self, chosen: slice) -> Told:
        return Told(self.start_s[chosen], self.value[chosen], self.sd[chosen])


@dataclass(frozen=True)
class Play:
    """What the drives that told an offset say of the play: each of shape (n,), in the offset's unit.

    `flank` is the one on which the drive mostly was: 1 of a left turn, -1 of a right one, 0 not known. `scatter` is one
    sd of how drives of a truck differ in the play when all have seen it.
    """

    width: Numbers
    sd: Numbers
    flank: Numbers
    scatter: float

    def part(self, chosen: slice) -> Play:
        return replace(self, width=self.width[chosen], sd=self.sd[chosen], flank=self.flank[chosen])


def with_known_play(told: Told, play: Play) -> Told:
    """The drives' offsets given the play that all of them together found: values moved along what each drive knows, and
    standard deviations without what it did not.

    The truck's play is the drives' weighted mean, believed no more than the drive that knows it best. A drive learns
    from it what it knows less than that one does: what one flank cannot tell no number of drives tells. One that is
    surer of another play than it should be has taken play for offset: by what is beyond two standard deviations its
    own is widened.
    """
    if not np.any(play.flank):
        return told
    variance = play.sd**2
    weight = 1.0 / (variance + play.scatter**2)
    truck = float(np.average(play.width, weights=weight))
    excess = (float(np.sum(weight * (play.width - truck) ** 2)) + AS_IT_SHOULD) / (
        np.count_nonzero(weight) - 1 + AS_IT_SHOULD
    )
    best = float(np.min(variance))
    doubt = max(max(excess, 1.0) / float(np.sum(weight)), best) + play.scatter**2
    unseen = np.where(play.flank == 0.0, 0.0, np.minimum(variance - best, 4.0 * _OF_PLAY * told.sd**2))
    share = unseen / (variance + doubt)
    apart = play.width - truck
    missed = np.maximum(apart**2 - _CONTRADICTS**2 * (variance + doubt), 0.0)
    return Told(
        told.start_s,
        told.value + 0.5 * play.flank * share * apart,
        np.sqrt(told.sd**2 + 0.25 * (missed - _LEARNED * unseen * share)),
    )


def play_of(rows: Sequence[dict[str, object]], kept: Sequence[int], scatter: float) -> Play:
    """Of a truck's rows those that are `kept`. One that does not say what it saw of the play has flank 0 and an
    infinite standard deviation."""

    def column(name: str) -> Numbers:
        return np.array([rows[k].get(name) for k in kept], np.float64)  # None becomes NaN

    width, sd = column("backlash_deg"), column("backlash_sd_deg")
    flank = np.sign(column("side_force_left_s") - column("side_force_right_s"))
    told = np.isfinite(width) & np.isfinite(flank) & (sd > 0.0)
    return Play(np.where(told, width, 0.0), np.where(told, sd, np.inf), np.where(told, flank, 0.0), scatter)
