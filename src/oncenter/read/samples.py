"""One signal from one source at its own rate, in SI: what every format gives and the clock takes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from oncenter.read.frames import Column

SHORTEST_STEP_S = 1e-9  # less is the same stamp, rounded
_USUAL = 0.2  # of the median step, how far others may be from it to count


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
        time_rate_hz: `median_rate(time)` where it is known, as by a table whose columns share their time.
    """

    signal: str
    time: Column
    values: Column
    kind: str
    description: str
    rank: int = 0
    address: int | None = None
    labels: tuple[str, ...] = ()
    time_rate_hz: float | None = None

    @property
    def not_available(self) -> int:
        return int(np.isnan(self.values).sum())

    @cached_property
    def rate_hz(self) -> float:
        """Median rate of the source's own numbers; 0 below two. Cells that a table leaves empty are no samples."""
        available = ~np.isnan(self.values)
        if not available.all():
            return median_rate(self.time[available])
        return median_rate(self.time) if self.time_rate_hz is None else self.time_rate_hz


def median_rate(time: Column) -> float:
    """Hz; from the steps near the median one, so that rounded stamps do not move it. 0 where there are none."""
    steps = np.diff(time)
    steps = steps[steps > SHORTEST_STEP_S]
    if not len(steps):
        return 0.0
    usual = steps if np.ptp(steps) <= _USUAL * float(steps.min()) else _near_median(steps)
    rate = 1.0 / float(np.mean(usual))
    whole = round(rate)
    return float(whole) if whole and abs(rate - whole) < 1e-3 * whole else rate


def _near_median(steps: Column) -> Column:
    middle = (len(steps) - 1) // 2
    median = float(np.partition(steps, middle)[middle])  # a step that occurs, unlike the mean of two
    return steps[np.abs(steps - median) <= _USUAL * median]
