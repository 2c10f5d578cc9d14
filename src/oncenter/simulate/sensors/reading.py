"""What every sensor does with what it measures: noise, range, whole steps, and errors that fade."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from oncenter.simulate.drive import RATE_HZ

Array = npt.NDArray[np.float64]

_SETTLED = 3.0  # time constants until 5 % is left


def reading(value: Array, random: np.random.Generator, noise_sd: float, resolution: float, range_: float) -> Array:
    """Noisy, within the range, in whole steps of the resolution (0: no steps); all in one unit."""
    noisy = np.clip(value + noise_sd * random.standard_normal(len(value)), -range_, range_)
    return np.round(noisy / resolution) * resolution if resolution > 0.0 else noisy


def warming(minutes: Array, time_min: float) -> Array:
    """The share of a warm-up that is still to come: 5 % after its time."""
    return np.exp(-_SETTLED * minutes / time_min)


def fading(count: int, random: np.random.Generator, sd: float, time_s: float) -> Array:
    """An error whose correlation falls to 1/e in `time_s` (Gauss-Markov, first order).

    Drawn at most ten times per correlation time and joined by straight lines: a receiver's errors are smooth.
    """
    step_s = max(time_s / 10.0, 1.0 / RATE_HZ)
    keep = np.exp(-step_s / time_s)
    knots = int(count / RATE_HZ / step_s) + 2
    shocks = random.standard_normal(knots) * np.sqrt(1.0 - keep**2)
    errors = np.empty(knots)
    errors[0] = last = shocks[0] / np.sqrt(1.0 - keep**2)
    for k in range(1, knots):
        errors[k] = last = keep * last + shocks[k]
    return sd * np.interp(np.arange(count) / RATE_HZ, np.arange(knots) * step_s, errors)


def ticks(begin_s: float, length_s: float | None) -> slice:
    """The ticks of a time, to the drive's end where there is no length."""
    begin = round(begin_s * RATE_HZ)
    return slice(begin, None if length_s is None else begin + round(length_s * RATE_HZ))
