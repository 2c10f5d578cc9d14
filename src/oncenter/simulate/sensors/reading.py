"""The way from a true value to a reading: latency, low pass, noise, range, resolution, hold, correlated errors."""

from __future__ import annotations

from itertools import accumulate

import numpy as np
import numpy.typing as npt

from oncenter.simulate.drive import RATE_HZ
from oncenter.simulate.sensor_sections import Sensor

Array = npt.NDArray[np.float64]

_SETTLED = 3.0  # time constants until 5 % is left
_ROUNDING = 1e-9  # of a quotient or product that is a whole number


def delayed(true: Array, sensor: Sensor) -> Array:
    """The true value after the sensor's latency and low pass.

    Before the drive the value is that of the first tick.
    """
    return low_passed(aged(true, sensor.latency_s), sensor.filter_time_s)


def aged(values: Array, latency_s: float) -> Array:
    """The values `latency_s` earlier, linear between ticks."""
    if latency_s == 0.0:
        return values
    time = np.arange(len(values)) / RATE_HZ
    return np.interp(time - latency_s, time, values)


def low_passed(values: Array, time_s: float) -> Array:
    """First-order low pass, exact for values that are linear between ticks: a ramp lags by `time_s`."""
    if time_s == 0.0:
        return values
    tick = 1.0 / (RATE_HZ * time_s)
    keep = np.exp(-tick)
    share = (1.0 - keep) / tick
    pushes = (1.0 - share) * values[1:] + (share - keep) * values[:-1]
    followed = accumulate(pushes.tolist(), lambda last, push: keep * last + push, initial=float(values[0]))
    return np.fromiter(followed, np.float64, len(values))


def held(read: Array, hold_s: float) -> Array:
    """A new reading only every `hold_s`, from the first tick on."""
    if hold_s * RATE_HZ <= 1.0:
        return read
    tick = np.arange(len(read))
    number = np.floor(tick / RATE_HZ / hold_s + _ROUNDING)
    return read[np.minimum(np.ceil(number * hold_s * RATE_HZ - _ROUNDING).astype(np.intp), tick)]


def reading(value: Array, random: np.random.Generator, noise_sd: float, resolution: float, range_: float) -> Array:
    """Adds noise, clips to the range, rounds to the resolution (0: no rounding); all in one unit."""
    noisy = np.clip(value + noise_sd * random.standard_normal(len(value)), -range_, range_)
    return np.round(noisy / resolution) * resolution if resolution > 0.0 else noisy


def warming(minutes: Array, time_min: float) -> Array:
    """The remaining share of a warm-up: 5 % after `time_min`."""
    return np.exp(-_SETTLED * minutes / time_min)


def fading(count: int, random: np.random.Generator, sd: float, time_s: float) -> Array:
    """A first-order Gauss-Markov error, whose correlation falls to 1/e in `time_s`.

    Drawn at most ten times per correlation time and interpolated linearly: a receiver's errors are smooth.
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
    """The ticks of an interval; to the end of the drive without a length."""
    begin = round(begin_s * RATE_HZ)
    return slice(begin, None if length_s is None else begin + round(length_s * RATE_HZ))
