"""What coarse steps of the yaw rate leave open: an error that no number of seconds averages away.

A reading is off by up to half a step. At standstill and on straights it stays within one step, so that its seconds are
not independent and their scatter, which the core goes by, does not show the error: its standard deviation is that of a
number rounded to the step, step/sqrt(12), however long the drive. It acts on the offset as a bias of the yaw rate does.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from oncenter import _core
from oncenter.offset.answer import Method
from oncenter.offset.findings import Finding, from_table
from oncenter.plausibility.presence import coarse_step
from oncenter.signals import DEGREE, Signals

_LIMIT = "gyro_bias_half_width_max_rad_s"
ROUNDED_SD = 1.0 / math.sqrt(12.0)  # of the step


def coarse_yaw_rate_step(drives: Sequence[Signals]) -> float:
    """The coarsest of the drives, rad/s; 0 where the steps are too fine to matter."""
    return max((coarse_step(drive, "yaw_rate") or 0.0 for drive in drives), default=0.0)


def with_coarse_yaw_rate(params: Mapping[str, float], given: Mapping[str, float], step: float) -> dict[str, float]:
    """The params in force: how well the yaw rate's bias need be known follows the steps (rad/s), else the core would
    reject most of the drive because wheel speeds and rounded yaw rate differ. What `given` has stays.
    """
    limit = 1.96 * ROUNDED_SD * step
    if _LIMIT in given or limit <= params[_LIMIT]:
        return dict(params)
    return {**params, _LIMIT: limit}


def widened(native: Mapping[str, Any], step: float, method: Method, params: Mapping[str, float]) -> dict[str, Any]:
    """An oc_answer with offset and yaw rate's bias as uncertain as such steps (rad/s) of the yaw rate leave them."""
    answer = dict(native)
    if step <= 0.0 or method == "wheel-speed":
        return answer
    bias_sd = ROUNDED_SD * step
    offset_sd = abs(answer["offset_per_yaw_rate_bias"]) * bias_sd
    parts = dict(answer["offset_parts"])
    parts["drive_sd"] = math.hypot(parts["drive_sd"], offset_sd)
    answer["offset_parts"] = parts
    answer["yaw_rate_step_sd"] = bias_sd
    if method == "joint":
        half_width_max, judged_sd = params["offset_drive_half_width_max_rad"], parts["drive_sd"]
    else:
        half_width_max, judged_sd = params["offset_half_width_max_rad"], None
    answer["offset"] = _wider(answer["offset"], offset_sd, half_width_max, judged_sd)
    answer["yaw_rate_bias"] = _wider(answer["yaw_rate_bias"], bias_sd, params[_LIMIT])
    return answer


def _wider(
    estimate: Mapping[str, Any], sd: float, half_width_max: float, judged_sd: float | None = None
) -> dict[str, Any]:
    """With a standard deviation more; no longer valid where `judged_sd`, or else its own, exceeds the limit."""
    wider = dict(estimate)
    wider["standard_deviation"] = math.hypot(wider["standard_deviation"], sd)
    half_width = 1.96 * (wider["standard_deviation"] if judged_sd is None else judged_sd)
    if _core.STATUSES[wider["status"]] == "valid" and half_width > half_width_max:
        wider["status"] = _core.STATUSES.index("converging")
    return wider


def coarse_yaw_rate_finding(native: Mapping[str, Any], step: float, method: Method) -> Finding | None:
    """None where the steps are fine, or the method does without the yaw rate."""
    if step <= 0.0 or method == "wheel-speed":
        return None
    text = f"the yaw rate comes in steps of {step / DEGREE:.2g} deg/s"
    wider_deg = 1.96 * abs(native["offset_per_yaw_rate_bias"]) * ROUNDED_SD * step / DEGREE
    if wider_deg > 0.0:
        text += f": the offset's interval counts ±{wider_deg:.1f} deg for them, which longer driving does not narrow"
    return from_table("yaw_rate_coarse", f"{text}; log the yaw rate in finer steps", step / DEGREE)
