"""One signal from one source at its own rate, in SI: what every format gives and the clock takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oncenter.read.frames import Column

SHORTEST_STEP_S = 1e-9  # less is the same stamp, rounded


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
    """

    signal: str
    time: Column
    values: Column
    kind: str
    description: str
    rank: int = 0
    address: int | None = None
    labels: tuple[str, ...] = ()

    @property
    def not_available(self) -> int:
        return int(np.isnan(self.values).sum())

    @property
    def rate_hz(self) -> float:
        """Median rate of the source's own numbers; 0 below two. Cells that a table leaves empty are no samples."""
        available = ~np.isnan(self.values)
        return median_rate(self.time if available.all() else self.time[available])


def median_rate(time: Column) -> float:
    """Hz; from the steps near the median one, so that rounded stamps do not move it. 0 where there are none."""
    steps = np.diff(time)
    steps = steps[steps > SHORTEST_STEP_S]
    if not len(steps):
        return 0.0
    middle = (len(steps) - 1) // 2
    median = float(np.partition(steps, middle)[middle])  # a step that occurs, unlike the mean of two
    usual = steps[np.abs(steps - median) <= 0.2 * median]
    rate = 1.0 / float(np.mean(usual))
    whole = round(rate)
    return float(whole) if whole and abs(rate - whole) < 1e-3 * whole else rate
