"""One signal from one source at its own rate, in SI: what every format gives and the clock takes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from oncenter.read.frames import Column

SHORTEST_STEP_S = 1e-9  # less is the same stamp, rounded
RATE_S = 3.0  # of a sender's frames tell its rate: who listens to a bus knows no more of it than that
_USUAL = 0.2  # of the median step, how far others may be from it to count
_SILENCE_S = 1.25  # a longer step tells nothing of a sender's rate
_NOMINAL_HZ = (1000.0, 500.0, 200.0, 100.0, 50.0, 40.0, 25.0, 20.0, 10.0, 5.0, 4.0, 2.0, 1.0)  # as senders are built
_NEAR_NOMINAL = 0.1  # stamps that tremble and frames that are lost move a rate by so much
_SHARP, _SHARP_SHARE = 0.05, 0.3  # of the steps so many are so near the usual one: it is no accident


@dataclass(frozen=True)
class Steps:
    """How stamps follow each other: their rate as `median_rate` has it, and the least and the greatest step; at least
    two stamps."""

    rate_hz: float
    least_s: float
    greatest_s: float


@dataclass(frozen=True)
class Samples:
    """A signal as one source has it.

    Attributes:
        signal: key of `oncenter.signals.SIGNALS`.
        time: s, as logged; signals of one message share one array.
        values: SI, as long as `time`; NaN where not available.
        kind: what sources must share to be compared: the message's name, or "column".
        description: for people, "VDC2 from 0x3E", "column swa_deg".
        rank: place in the stated order of kinds, the first is taken.
        address: J1939 source address where there is one.
        labels: what `take` may call this source besides its description, in lower case.
        steps: of `time` where they are known, as by a table whose columns share their time.
        of_frames: `time` are stamps of frames on a bus, which tremble.
        stamps: what `time` is from, for people, where not from the source itself: "column time_s".
        complete: whoever made it knows that no value is NaN.
    """

    signal: str
    time: Column
    values: Column
    kind: str
    description: str
    rank: int = 0
    address: int | None = None
    labels: tuple[str, ...] = ()
    steps: Steps | None = None
    of_frames: bool = False
    stamps: str = ""
    complete: bool = False

    @property
    def time_description(self) -> str:
        """Where `time` is from, for people."""
        return self.stamps or self.description

    @cached_property
    def not_available(self) -> int:
        return 0 if self.complete else int(np.count_nonzero(np.isnan(self.values)))

    @cached_property
    def rate_hz(self) -> float:
        """Rate of the source's own numbers, of frames the nominal one; 0 below two.

        Cells that a table leaves empty are no samples. A sender that never had a number has the rate of its frames.
        """
        rate_of = nominal_rate if self.of_frames else median_rate
        never = self.not_available == len(self.values)
        if self.not_available and not (never and self.of_frames):
            return rate_of(self.time[~np.isnan(self.values)])
        return rate_of(self.time) if self.steps is None else self.steps.rate_hz

    @property
    def rate_is_told(self) -> bool:
        """Whether the rate stays the same whatever frames come later."""
        return _first_steps(self.time[~np.isnan(self.values)])[1]


def median_rate(time: Column) -> float:
    """Hz; from the steps near the median one, so that rounded stamps do not move it. 0 where there are none."""
    return steps_of(time).rate_hz if len(time) > 1 else 0.0


def steps_of(time: Column) -> Steps:
    """Of at least two stamps, s."""
    with np.errstate(over="ignore"):  # damaged stamps are refused elsewhere
        steps = np.diff(time)
    least, greatest = float(steps.min()), float(steps.max())
    if not (least > SHORTEST_STEP_S and greatest < np.inf):
        steps = steps[(steps > SHORTEST_STEP_S) & (steps < np.inf)]
    return Steps(_whole_where_near(_usual_rate(steps)) if len(steps) else 0.0, least, greatest)


def nominal_rate(time: Column) -> float:
    """Hz at which a sender was built to send, from its first `RATE_S`: the same whether more has come by now or not.

    The usual nominal rate that is near the rate of the usual step, which lost frames do not change, or near the mean
    rate, which trembling and bursts do not; of a sender that keeps to none of them what it keeps to.
    """
    steps, _ = _first_steps(time)
    if not len(steps):
        return median_rate(time)
    mean, median = 1.0 / float(np.mean(steps)), _usual_rate(steps)
    if not mean <= median <= 2.0 * mean:  # frames come in bursts
        median = mean
    sharp = float(np.mean(np.abs(steps * median - 1.0) < _SHARP)) > _SHARP_SHARE
    near = (_nominal_near(rate) for rate in ((median, mean) if sharp else (mean, median)))
    return next((rate for rate in near if rate), None) or _whole_where_near(median)


def _first_steps(time: Column) -> tuple[Column, bool]:
    """Steps, s, until a sender was heard for `RATE_S`, its silences left out; whether it was for so long."""
    count = 1000  # of stamps to look at: a log has millions, of which the first tell
    while True:
        steps = np.diff(np.maximum.accumulate(time[:count]))
        steps = steps[(steps > SHORTEST_STEP_S) & (steps <= _SILENCE_S)]
        enough = int(np.searchsorted(np.cumsum(steps), RATE_S))
        if enough < len(steps):
            return steps[: enough + 1], True
        if count >= len(time):
            return steps, False
        count *= 4


def _nominal_near(rate: float) -> float:
    """The nominal rate that another may be meant to be; 0 where there is none."""
    nominal = min(_NOMINAL_HZ, key=lambda hz: abs(np.log(hz / rate)))
    return nominal if abs(rate / nominal - 1.0) <= _NEAR_NOMINAL else 0.0


def _whole_where_near(rate: float) -> float:
    whole = round(rate)
    return float(whole) if whole and abs(rate - whole) < 1e-3 * whole else rate


def _usual_rate(steps: Column) -> float:
    least = float(steps.min())
    usual = steps if float(steps.max()) - least <= _USUAL * least else _near_median(steps)
    return 1.0 / float(np.mean(usual))


def _near_median(steps: Column) -> Column:
    middle = (len(steps) - 1) // 2
    median = float(np.partition(steps, middle)[middle])  # a step that occurs, unlike the mean of two
    return steps[np.abs(steps - median) <= _USUAL * median]
