"""One signal from one source at its own rate, in SI: the output of every format and the input of `clock`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from oncenter.read.frames import Column

SHORTEST_STEP_S = 1e-9  # smaller steps are rounding of equal stamps
RATE_S = 3.0  # of frames that give a sender's rate: on a live bus it must be settled after this time
_USUAL = 0.2  # of the median step: maximum deviation of the steps that count
_SILENCE_S = 1.25  # a longer step is a gap and does not count
_NOMINAL_HZ = (1000.0, 500.0, 200.0, 100.0, 50.0, 40.0, 25.0, 20.0, 10.0, 5.0, 4.0, 2.0, 1.0)  # usual design rates
_NEAR_NOMINAL = 0.1  # jitter and lost frames shift a rate by up to this share
_SHARP, _SHARP_SHARE = 0.05, 0.3  # if this share of the steps is this near to the median, the median is the rate


@dataclass(frozen=True)
class Steps:
    """Rate of at least two stamps, as `median_rate`, with the minimum and maximum step."""

    rate_hz: float
    least_s: float
    greatest_s: float


@dataclass(frozen=True)
class Beyond:
    """Values outside the range that a database states for a signal.

    Attributes:
        rows: which of the samples they are.
        name: of the signal in the database, "STEERING.ANGLE".
        low, high: the range, in `unit`.
    """

    rows: npt.NDArray[np.bool_]
    name: str
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Samples:
    """A signal from one source.

    Attributes:
        signal: key of `oncenter.signals.SIGNALS`.
        time: s, as recorded; signals of one message share one array.
        values: SI, as long as `time`; NaN where not available.
        kind: the message's name, or "column"; only sources of the same kind are compared.
        description: for messages, "VDC2 from 0x3E", "column swa_deg".
        rank: order of preference among kinds, the lowest is used.
        address: J1939 source address, if any.
        labels: lower-case names for `take`, besides the description.
        steps: of `time`, if already computed, as for the columns of a table.
        of_frames: `time` are stamps of frames on a bus, which have jitter.
        stamps: source of `time` for messages, if it is not the source itself: "column time_s".
        complete: no value is NaN; saves the check.
        lost: by reason of `oncenter.account.WORDS`, samples of the file that have no usable value: they are NaN in
            `values`, or not in the arrays. Other NaN are no samples, as empty cells of a table.
        in_file: samples of the file, where the reader counts them by itself.
        beyond: values outside the range of a database, see `database_range`.
        place: signal, bits and file of the database that decodes it, "STEERING.ANGLE 16|13@1- of truck.dbc".
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
    lost: Mapping[str, int] = field(default_factory=dict)
    in_file: int | None = None
    beyond: Beyond | None = None
    place: str = ""

    @property
    def time_description(self) -> str:
        """Source of `time`, for messages."""
        return self.stamps or self.description

    @cached_property
    def not_available(self) -> int:
        return 0 if self.complete else int(np.count_nonzero(np.isnan(self.values)))

    @cached_property
    def rate_hz(self) -> float:
        """Rate of the source's valid numbers; for frames the nominal rate; 0 for fewer than two.

        Empty cells of a table are not samples. A sender without any valid number has the rate of its frames.
        """
        rate_of = nominal_rate if self.of_frames else median_rate
        never = self.not_available == len(self.values)
        if self.not_available and not (never and self.of_frames):
            return rate_of(self.time[~np.isnan(self.values)])
        return rate_of(self.time) if self.steps is None else self.steps.rate_hz

    @property
    def rate_is_settled(self) -> bool:
        """Whether later frames can no longer change the rate."""
        return _first_steps(self.time[~np.isnan(self.values)])[1]


def median_rate(time: Column) -> float:
    """Hz, from the steps near the median, so that rounded stamps do not shift it; 0 without steps."""
    return steps_of(time).rate_hz if len(time) > 1 else 0.0


def steps_of(time: Column) -> Steps:
    """The steps of at least two stamps in s."""
    with np.errstate(over="ignore"):  # damaged stamps are rejected elsewhere
        steps = np.diff(time)
    least, greatest = float(steps.min()), float(steps.max())
    if not (least > SHORTEST_STEP_S and greatest < np.inf):
        steps = steps[(steps > SHORTEST_STEP_S) & (steps < np.inf)]
    return Steps(_whole_where_near(_usual_rate(steps)) if len(steps) else 0.0, least, greatest)


def nominal_rate(time: Column) -> float:
    """The design rate of a sender in Hz, from its first `RATE_S` only, so that later frames do not change it.

    It is the rate of `_NOMINAL_HZ` near the median rate, which lost frames do not change, or near the mean rate, which
    jitter and bursts do not change. Without one nearby it is the median rate.
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
    """Steps in s of the first `RATE_S` of a sender, without gaps, and whether there are that many."""
    count = 1000  # a log has millions of stamps, only the first ones matter
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
    """The nominal rate near a rate; 0 without one."""
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
    median = float(np.partition(steps, middle)[middle])  # an actual step, not the mean of two
    return steps[np.abs(steps - median) <= _USUAL * median]
