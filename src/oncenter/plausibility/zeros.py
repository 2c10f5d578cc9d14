"""Zero errors of the sensors: at standstill, on average at speed, and straight ahead."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from oncenter.findings import Finding, Kind, finding
from oncenter.plausibility.check_result import CannotTell, CheckResult, lacks, words
from oncenter.plausibility.grid_signals import DRIVING_M_S, MIN_TIME_S, NEEDED, GridSignals
from oncenter.signals import DEGREE, STANDARD_GRAVITY

_NEARLY_STRAIGHT_1_M = 1 / 500
YAW_RATE_BIAS_LARGE_DEG_S = 0.5  # a larger one is corrected as well, but the sensor needs a check
# Minimum values that are reported; tuned, since a healthy truck shows less.
YAW_RATE_BIAS_REPORTED_FROM_DEG_S = 0.05
_VDC2_ZERO_RAD_S = (32127 - 32112.64) / 8192  # SPN 1808 of a sender whose zero is raw 32127
_VDC2_ZERO_WITHIN_RAD_S = 0.015 * DEGREE  # two bits of 1/8192 rad/s
TILTED_FROM_M_S2 = 0.25  # a 2.5 % slope of the ground
_JOINT_ALLOWS_FOR_IT = "The interval of the offset allows for both (method joint)"
_GYRO_EFFECT = (
    "The method joint corrects the offset for this bias. "
    f"Check the sensor if the bias is above {YAW_RATE_BIAS_LARGE_DEG_S:g} deg/s"
)


def yaw_rate_at_standstill(
    bias: float, standing_s: float, *, from_vdc2: bool, half_width: float | None = None
) -> Finding | None:
    """The bias (rad/s, mean over `standing_s` s) where it is not small; `from_vdc2`: J1939's VDC2 is its source;
    `half_width`: of its 95 % interval, None where it is not estimated."""
    return _yaw_rate(bias, half_width, f"at standstill (mean of {standing_s:.1f} s)", from_vdc2=from_vdc2)


def yaw_rate_beside_wheels(bias: float, rolled_s: float, *, from_vdc2: bool, half_width: float) -> Finding | None:
    """The bias (rad/s, at the end, from `rolled_s` s of wheel speeds) where it is not small."""
    when = f"when the truck does not turn (from {rolled_s:.0f} s of wheel speeds)"
    return _yaw_rate(bias, half_width, when, from_vdc2=from_vdc2)


@finding("yaw_rate_bias", "warning", "deg/s")
def _yaw_rate(found: Kind, bias: float, half_width: float | None, when: str, *, from_vdc2: bool) -> Finding | None:
    """The yaw rate bias is not small."""
    if abs(bias) < YAW_RATE_BIAS_REPORTED_FROM_DEG_S * DEGREE:
        return None
    around = "" if half_width is None else f" ±{max(half_width / DEGREE, 0.01):.2f}"
    text = f"the yaw rate sensor reads {bias / DEGREE:+.2f}{around} deg/s {when}"
    if from_vdc2 and abs(bias - _VDC2_ZERO_RAD_S) < _VDC2_ZERO_WITHIN_RAD_S:
        text += ". A sender of VDC2 that uses raw 32127 as zero, instead of 32112.64, reads +0.10 deg/s"
    return found(text, bias / DEGREE)


def ground_half_width(params: Mapping[str, float]) -> float:
    """95 % half-width of the reading by the slope of the ground on which trucks stop, m/s^2."""
    by_crown = params["standing_crown_share_1"] * params["crown_m_s2"]
    return 1.96 * math.hypot(params["standing_slope_sd_m_s2"], by_crown)


@finding("lateral_acceleration_at_standstill", "warning", "m/s^2")
def lateral_acceleration_at_standstill(
    found: Kind, reading: float, standing_s: float, effect: str = _JOINT_ALLOWS_FOR_IT
) -> Finding | None:
    """The reading (m/s^2, mean over `standing_s` s) is not small; `effect` on the offset in words."""
    if abs(reading) < TILTED_FROM_M_S2:
        return None
    slope = abs(reading) / STANDARD_GRAVITY * 100.0
    return found(
        f"the accelerometer reads {reading:+.2f} m/s^2 at standstill (mean of {standing_s:.1f} s). The cause is its "
        f"bias, or ground that slopes down to the {'right' if reading > 0 else 'left'} (by {slope:.1f} %), or both. "
        f"{effect}. Park the truck on level ground and record again",
        reading,
    )


@finding("relative_angle_sensor", "info")
def relative_angle_sensor(found: Kind) -> Finding:
    """The angle sensor reports that its zero is arbitrary."""
    return found(
        "the steering wheel angle sensor is a relative one: its zero can change at each ignition. Whole turns of the "
        "steering wheel are left out of the offset. The offset is valid for this ignition only. Do not store it as a "
        "correction",
    )


def yaw_rate(drive: GridSignals) -> CheckResult:
    standing = _at_standstill(drive, "yaw_rate")
    if standing is None:
        return CannotTell("zero of the yaw rate", _lacks_standing(drive, "yaw_rate"))
    source = drive.signals.sources["yaw_rate"]
    bias = yaw_rate_at_standstill(*standing, from_vdc2="VDC2" in source.description)
    if bias is None:
        return None
    is_large = abs(standing[0]) / DEGREE > YAW_RATE_BIAS_LARGE_DEG_S
    # The joint method corrects a bias, and gives a small one the same severity.
    return replace(bias, text=f"{bias.text}. {_GYRO_EFFECT}", severity=bias.severity if is_large else "info")


def lateral_acceleration(drive: GridSignals) -> CheckResult:
    standing = _at_standstill(drive, "lateral_acceleration")
    if standing is None:
        return CannotTell("zero of the lateral acceleration", _lacks_standing(drive, "lateral_acceleration"))
    return lateral_acceleration_at_standstill(*standing)


def _at_standstill(drive: GridSignals, name: str) -> tuple[float, float] | None:
    """Mean reading, and the time used for it in s."""
    values = drive.ticks(name)[_standing(drive)]
    values = values[np.isfinite(values)]
    time_s = len(values) / drive.signals.rate_hz
    return (float(values.mean()), time_s) if time_s >= drive.params["standstill_time_min_s"] else None


def _standing(drive: GridSignals) -> npt.NDArray[np.bool_]:
    """Ticks at standstill, after the cab has settled."""
    slow = drive.ticks("vehicle_speed") < drive.params["standstill_speed_max_m_s"]
    settling = round(drive.params["standstill_settling_s"] * drive.signals.rate_hz)
    since_moving = np.arange(len(slow)) - np.maximum.accumulate(np.where(slow, -1, np.arange(len(slow))))
    return np.asarray(slow & (since_moving > settling))


def _lacks_standing(drive: GridSignals, name: str) -> str:
    if not drive.has(name):
        return f"no {words(name)}"
    return f"needs {drive.params['standstill_time_min_s']:g} s at standstill"


@finding("bank", "warning", "m/s^2")
def bank(found: Kind, drive: GridSignals, comparable: bool) -> CheckResult:
    """(33) averaged over all fast driving: banked bends cancel, a crown is some 0.2 m/s^2, the rest is bias."""
    banks = (drive.lateral_acceleration - drive.centripetal)[drive.speed > drive.params["speed_min_m_s"]]
    banks = banks[np.isfinite(banks)]
    subject = "mean of a_y - r*v"
    if len(banks) * drive.step_s < MIN_TIME_S:
        fast = f"needs {MIN_TIME_S:.0f} s above {drive.params['speed_min_m_s']:g} m/s"
        return CannotTell(subject, lacks(drive, ("lateral_acceleration", "yaw_rate", "vehicle_speed"), fast))
    limit = drive.params["bank_max_m_s2"]
    mean = float(banks.mean())
    if not comparable or abs(mean) <= limit:
        return None
    return found(
        f"lateral acceleration minus yaw rate times speed is {mean:+.2f} m/s^2 on average; the bank limit is {limit:g} "
        "m/s^2 (bank_max_m_s2). The accelerometer has a bias. The interval of the offset allows for this with --method "
        "joint; --method thesis rejects most of this drive. Use --method joint, or check the accelerometer",
        mean,
    )


def relative_sensor(drive: GridSignals) -> CheckResult:
    relative = bool(np.any(drive.ticks("steering_wheel_angle_sensor_type") == 0))
    return relative_angle_sensor() if relative else None


@finding("whole_turns", "warning", "deg")
def whole_turns(found: Kind, drive: GridSignals, comparable: bool) -> CheckResult:
    """The angle is more than half a turn off zero straight ahead."""
    straight = drive.angle[(drive.speed > DRIVING_M_S) & (np.abs(drive.curvature) < _NEARLY_STRAIGHT_1_M)]
    straight = straight[np.isfinite(straight)]
    if len(straight) * drive.step_s < 2.0:
        return CannotTell("whole turns of the angle", lacks(drive, NEEDED, "needs 2 s of nearly straight driving"))
    middle_deg = float(np.median(straight)) / DEGREE
    if not comparable or abs(middle_deg) < 180:
        return None
    turns = round(middle_deg / 360.0)
    return found(
        f"the steering wheel angle reads {middle_deg:+.0f} deg when the truck drives straight ahead. That is "
        f"{turns:+d} turn{'' if abs(turns) == 1 else 's'} and {middle_deg - 360.0 * turns:+.0f} deg, and the offset "
        "contains both. Do not enter this number: set the zero of the sensor with the wheels straight ahead",
        middle_deg,
    )
