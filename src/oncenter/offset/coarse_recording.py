"""What a coarse recording leaves open: steps of the yaw rate, and few samples a second.

**Steps.** A reading is off by up to half a step. At standstill and on straights it stays within one step, so that its
seconds are not independent and their scatter, which the core goes by, does not show the error: its standard deviation
is that of a number rounded to the step, step/sqrt(12), however long the drive. It acts on the offset as a bias of the
yaw rate does.

**Rate.** The fewer samples a second has, the more of the sensors' noise is in its mean, which flattens the slopes that
are fitted to it; the core corrects that from 80 Hz up (core/sensor_noise.c), since vibration hides the noise of slower
ticks. What interpolation adds between two samples is no measurement either, nor is a value that is repeated.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from oncenter import _core
from oncenter.offset.answer import Method
from oncenter.offset.findings import Finding, from_table
from oncenter.plausibility.presence import coarse_step, held_rate_hz
from oncenter.read.clock import is_too_slow_for_the_core
from oncenter.signals import DEGREE, Signals

_LIMIT = "gyro_bias_half_width_max_rad_s"
_ROUNDED_SD = 1.0 / math.sqrt(12.0)  # of the step
# Tuned: of 79 simulated drives of 30 minutes at 5 and 10 Hz (scenarios motorway, thesis_drive, heavy_play) the drive's
# part of the interval holds the true offset of 78; without these it held that of 70 %.
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
    """The params in force: how well the yaw rate's bias need be known follows the steps (rad/s), else the core would
    reject most of the drive because wheel speeds and rounded yaw rate differ. What `given` has stays.
    """
    limit = 1.96 * _ROUNDED_SD * step
    if _LIMIT in given or limit <= params[_LIMIT]:
        return dict(params)
    return {**params, _LIMIT: limit}


def widened(
    native: Mapping[str, Any], coarse: Coarseness, method: Method, params: Mapping[str, float]
) -> dict[str, Any]:
    """An oc_answer with offset and yaw rate's bias as uncertain as so coarse a recording leaves them."""
    answer = dict(native)
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


def _offset_sds(answer: Mapping[str, Any], bias_sd: float, before: float, rate_hz: float) -> tuple[float, float]:
    """What steps and rate add to the offset's standard deviation, in squares, rad."""
    by_step = abs(answer["offset_per_yaw_rate_bias"]) * bias_sd
    if rate_hz == 0.0:
        return by_step, 0.0
    more_scatter = before * math.sqrt((1.0 + _SCATTER_HZ / rate_hz) ** 2 - 1.0)
    return by_step, math.hypot(more_scatter, _FLATTENED_DEG_HZ * DEGREE / rate_hz)


def _wider(estimate: Mapping[str, Any], more_sd: float, judged_sd: float, half_width_max: float) -> dict[str, Any]:
    """With a standard deviation more; no longer valid where `judged_sd` exceeds the limit."""
    wider = dict(estimate)
    wider["standard_deviation"] = math.hypot(wider["standard_deviation"], more_sd)
    if _core.STATUSES[wider["status"]] == "valid" and 1.96 * judged_sd > half_width_max:
        wider["status"] = _core.STATUSES.index("converging")
    return wider


def coarse_recording_findings(native: Mapping[str, Any], coarse: Coarseness, method: Method) -> list[Finding]:
    """Nothing where the recording is fine, or the method does without the yaw rate whose steps are coarse."""
    found = []
    if coarse.yaw_rate_step > 0.0 and method != "wheel-speed":
        found.append(_of_steps(native, coarse.yaw_rate_step))
    if coarse.rate_hz > 0.0:
        times = 1.0 + _SCATTER_HZ / coarse.rate_hz
        text = (
            f"recorded at {coarse.rate_hz:.3g} Hz: too few samples to tell the sensors' noise, so that the offset's "
            f"interval is made {times:.2g} times as wide; log at 100 Hz"
        )
        found.append(from_table("recorded_slowly", text, coarse.rate_hz))
    return found


def _of_steps(native: Mapping[str, Any], step: float) -> Finding:
    text = f"the yaw rate comes in steps of {step / DEGREE:.2g} deg/s"
    wider_deg = 1.96 * abs(native["offset_per_yaw_rate_bias"]) * _ROUNDED_SD * step / DEGREE
    if wider_deg > 0.0:
        text += f": the offset's interval counts ±{wider_deg:.1f} deg for them, which longer driving does not narrow"
    return from_table("yaw_rate_coarse", f"{text}; log the yaw rate in finer steps", step / DEGREE)
