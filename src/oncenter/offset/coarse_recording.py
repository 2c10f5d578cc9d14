"""Uncertainty from a coarse recording: large steps of the yaw rate, and few samples a second.

**Steps.** A reading has an error of up to half a step. At standstill and on straights it stays within one step. The
errors of its seconds are then not independent, and their scatter, which the core uses, does not contain the error. Its
standard deviation is that of rounding to the step, step/sqrt(12), independent of the length of the drive. It acts on
the offset like a bias of the yaw rate.

**Rate.** With fewer samples in a second, more sensor noise remains in its mean, which flattens the fitted slopes. The
core measures and corrects that (sensor_noise.c), and its interval includes what remains. Interpolated values of a rate
below the core's are no measurements.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from oncenter import _core
from oncenter.estimates.estimates import Method
from oncenter.findings import Finding, Kind, finding
from oncenter.plausibility.presence import coarse_step, held_rate_hz
from oncenter.read.clock import is_too_slow_for_the_core
from oncenter.signals import DEGREE, Signals
from oncenter.tuned import TUNED

_LIMIT = "gyro_bias_half_width_max_rad_s"
_ROUNDED_SD = 1.0 / math.sqrt(12.0)  # of the step
# Tuned: in 78 of 79 simulated drives of 30 minutes at 5 and 10 Hz (scenarios motorway, thesis_drive, heavy_play) the
# drive's part of the interval contains the true offset; without these constants in 70 %.
_FLATTENED_DEG_HZ = 1.5  # sd of the offset times the rate
_SCATTER_HZ = 10.0  # the drive's sd grows by this over the rate


@dataclass(frozen=True)
class Coarseness:
    """`yaw_rate_step` in rad/s, 0 where it is fine; `rate_hz` of the samples, 0 where the core takes that rate."""

    yaw_rate_step: float
    rate_hz: float


def yaw_rate_step_of(drives: Sequence[Signals]) -> float:
    """The coarsest of the drives, rad/s; 0 where it is fine."""
    return max((coarse_step(drive, "yaw_rate") or 0.0 for drive in drives), default=0.0)


def coarseness_of(drives: Sequence[Signals]) -> Coarseness:
    """The worst of the drives."""
    rates = [
        drive.sources["steering_wheel_angle"].rate_hz for drive in drives if "steering_wheel_angle" in drive.sources
    ]
    rates += [held_rate_hz(drive, name) or 0.0 for drive in drives for name in ("steering_wheel_angle", "yaw_rate")]
    return Coarseness(yaw_rate_step_of(drives), min(filter(is_too_slow_for_the_core, rates), default=0.0))


def with_coarse_yaw_rate(params: Mapping[str, float], given: Mapping[str, float], step: float) -> dict[str, float]:
    """The params in force: the limit on the yaw rate bias follows the steps (rad/s). With the default limit the core
    would reject most of the drive, since wheel speeds and a rounded yaw rate differ. A limit in `given` stays.
    """
    limit = 1.96 * _ROUNDED_SD * step
    if _LIMIT in given or limit <= params[_LIMIT]:
        return dict(params)
    return {**params, _LIMIT: limit}


def widened(native: _core.OcAnswer, coarse: Coarseness, method: Method, params: Mapping[str, float]) -> _core.OcAnswer:
    """An oc_answer with the uncertainty of offset and yaw rate bias increased for a coarse recording."""
    answer = native.copy()
    bias_sd = 0.0 if method == "wheel-speed" else _ROUNDED_SD * coarse.yaw_rate_step
    if bias_sd == 0.0 and coarse.rate_hz == 0.0:
        return answer
    before = answer["offset_parts"]["drive_sd"] if method == "joint" else answer["offset"]["standard_deviation"]
    by_step, by_rate = _offset_sds(answer, bias_sd, before, coarse.rate_hz)
    drive_sd = math.hypot(before, by_step, by_rate)
    if method == "joint":
        answer["offset_parts"] = {**answer["offset_parts"], "drive_sd": drive_sd}
        half_width_max = params["offset_drive_half_width_max_rad"]
    else:
        half_width_max = params["offset_half_width_max_rad"]
    answer["offset"] = _wider(answer["offset"], math.hypot(by_step, by_rate), drive_sd, half_width_max)
    if bias_sd > 0.0:
        answer["yaw_rate_step_sd"] = bias_sd
        wider_bias_sd = math.hypot(answer["yaw_rate_bias"]["standard_deviation"], bias_sd)
        answer["yaw_rate_bias"] = _wider(answer["yaw_rate_bias"], bias_sd, wider_bias_sd, params[_LIMIT])
    return answer


def _offset_sds(answer: _core.OcAnswer, bias_sd: float, before: float, rate_hz: float) -> tuple[float, float]:
    """Standard deviations of the offset from steps and from the rate, rad; they add in squares."""
    by_step = abs(answer["offset_per_yaw_rate_bias"]) * bias_sd
    if rate_hz == 0.0:
        return by_step, 0.0
    more_scatter = before * math.sqrt((1.0 + _SCATTER_HZ / rate_hz) ** 2 - 1.0)
    return by_step, math.hypot(more_scatter, _FLATTENED_DEG_HZ * DEGREE / rate_hz)


def _wider(estimate: _core.OcEstimate, more_sd: float, judged_sd: float, half_width_max: float) -> _core.OcEstimate:
    """The estimate with `more_sd` added in squares; no longer valid where `judged_sd` exceeds the limit."""
    wider = estimate.copy()
    wider["standard_deviation"] = math.hypot(wider["standard_deviation"], more_sd)
    if _core.status_of(wider) == "valid" and 1.96 * judged_sd > half_width_max:
        wider["status"] = _core.STATUSES.index("converging")
    return wider


def coarse_recording_findings(
    native: _core.OcAnswer, coarse: Coarseness, method: Method, params: Mapping[str, float]
) -> list[Finding]:
    """The findings on a recording that is too coarse or too noisy for the method."""
    of_steps = coarse.yaw_rate_step > 0.0 and method != "wheel-speed"
    found = [_of_steps(native, coarse.yaw_rate_step)] if of_steps else []
    if coarse.rate_hz > 0.0:
        found.append(_of_rate(coarse.rate_hz))
    if method == "joint" and _noise_decides(native, params):
        found.append(_of_noise(native))
    return found


def _sd_by_noise(native: _core.OcAnswer) -> float:
    """rad, part of the offset's standard deviation (joint_answer.c)."""
    return TUNED["joint_answer.per_yaw_rate_noise"] * native["yaw_rate_noise"]


def _noise_decides(native: _core.OcAnswer, params: Mapping[str, float]) -> bool:
    """Whether the offset would be accurate enough without the noise of the yaw rate."""
    limit, sd = params["offset_drive_half_width_max_rad"] / 1.96, native["offset_parts"]["drive_sd"]
    return limit**2 < sd**2 < limit**2 + _sd_by_noise(native) ** 2


@finding("recorded_slowly", "warning", "Hz")
def _of_rate(found: Kind, rate_hz: float) -> Finding:
    """The angle was recorded below 20 Hz, and resampled."""
    return found(
        f"recorded at {rate_hz:.3g} Hz, which is too slow to identify the sensor noise. The interval of the "
        f"offset is therefore {1.0 + _SCATTER_HZ / rate_hz:.2g} times as wide. Record at 100 Hz",
        rate_hz,
    )


@finding("yaw_rate_noisy", "warning", "deg/s")
def _of_noise(found: Kind, native: _core.OcAnswer) -> Finding:
    """The noise of the yaw rate keeps the offset from being accurate enough."""
    noise_deg_s = native["yaw_rate_noise"] / DEGREE
    return found(
        f"the yaw rate has a noise of {noise_deg_s:.2g} deg/s in the mean of a second, which adds "
        f"±{1.96 * _sd_by_noise(native) / DEGREE:.1f} deg to the interval of the offset. The offset is not accurate "
        "enough with it. Record at a higher rate, or low-pass the signals before they are thinned",
        noise_deg_s,
    )


@finding("yaw_rate_coarse", "warning", "deg/s")
def _of_steps(found: Kind, native: _core.OcAnswer, step: float) -> Finding:
    """The steps of the yaw rate are coarse."""
    text = f"the yaw rate is recorded in steps of {step / DEGREE:.2g} deg/s"
    wider_deg = 1.96 * abs(native["offset_per_yaw_rate_bias"]) * _ROUNDED_SD * step / DEGREE
    if wider_deg > 0.0:
        text += f". They add ±{wider_deg:.1f} deg to the interval of the offset, which longer driving does not reduce"
    else:
        text += ". The offset is less certain"
    return found(f"{text}. Record the yaw rate in finer steps", step / DEGREE)
