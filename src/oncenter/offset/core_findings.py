"""What an answer of the core says of the drive, by any method: when, and in which words.

Degrees here: findings are for people and files.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from oncenter import _core
from oncenter.offset.findings import PLAY_STANDARD_DEG, Finding, from_table, gravest_first
from oncenter.signals import DEGREE

# Thresholds for speaking up, ours; a finding below them would be noise on healthy trucks.
_OFFSET_WORTH_TELLING_DEG = 2.5  # Table 1: what a healthy sensor's hysteresis may show
_YAW_RATE_BIAS_WORTH_TELLING_RAD_S = 0.05 * DEGREE
_VDC2_ZERO_RAD_S = (32127 - 32112.64) / 8192  # SPN 1808: what a sender reads that takes raw 32127 for zero
_VDC2_ZERO_WITHIN_RAD_S = 0.015 * DEGREE  # two bits of 1/8192 rad/s
_STANDING_ACCELERATION_WORTH_TELLING_M_S2 = 0.25  # a 2.5 % slope of the ground
_MISSING_WORTH_TELLING = 0.05  # of the duration
_FAULTS = {
    "lost": "sends no value any more",
    "stuck": "always reads the same, whatever the truck does",
    "jumped": "has been off since it jumped",
    "drifting": "is more and more off",
    "wrong_sign": "takes left for right",
    "remounted": "sits elsewhere since a stop, a hole in the log or a drift",
}
YAW_RATE_BIAS_LARGE_DEG_S = 0.5  # beyond it a corrected one is worth a look at the sensor
_ALARM_PASSING_S = 30.0  # left out: a CUSUM's chance, 15 s on one healthy motorway drive of 14


def yaw_rate_at_standstill(bias: float, seen_s: float, *, from_vdc2: bool) -> Finding | None:
    """None where the bias (rad/s, mean over `seen_s` s) is small; `from_vdc2` when J1939's VDC2 brought it."""
    return _yaw_rate(bias, f"at standstill (seen for {seen_s:.1f} s)", from_vdc2=from_vdc2)


def yaw_rate_beside_wheels(bias: float, seen_s: float, *, from_vdc2: bool) -> Finding | None:
    """None where the bias (rad/s, now, after `seen_s` s of wheel speeds) is small."""
    return _yaw_rate(bias, f"when nothing turns, by {seen_s:.0f} s of wheel speeds", from_vdc2=from_vdc2)


def _yaw_rate(bias: float, when: str, *, from_vdc2: bool) -> Finding | None:
    if abs(bias) < _YAW_RATE_BIAS_WORTH_TELLING_RAD_S:
        return None
    text = f"the yaw rate reads {bias / DEGREE:+.2f} deg/s {when}"
    if from_vdc2 and abs(bias - _VDC2_ZERO_RAD_S) < _VDC2_ZERO_WITHIN_RAD_S:
        text += "; a sender that takes raw 32127 for zero in VDC2, where 32112.64 is, reads +0.10 deg/s"
    return from_table("yaw_rate_bias", text, bias / DEGREE)


def lateral_acceleration_at_standstill(reading: float, seen_s: float) -> Finding | None:
    """None where the reading (m/s^2, mean over `seen_s` s) is small."""
    if abs(reading) < _STANDING_ACCELERATION_WORTH_TELLING_M_S2:
        return None
    text = (
        f"the accelerometer reads {reading:+.2f} m/s^2 at standstill (seen for {seen_s:.1f} s): "
        "its bias, or the slope of the ground"
    )
    return from_table("lateral_acceleration_at_standstill", text, reading)


def relative_angle_sensor() -> Finding:
    """For an angle sensor that says of itself that its zero is arbitrary."""
    return from_table(
        "relative_angle_sensor",
        "the angle sensor is a relative one (SPN 1812 = 0): its zero may be off by whole turns after each ignition, "
        "so the offset is told modulo 360 deg",
    )


def findings_of(
    native: Mapping[str, Any],
    params: Mapping[str, float],
    relative_sensor: bool,
    *,
    method: str,
    yaw_rate_from_vdc2: bool,
    sees_banks: bool,
    of_method: Iterable[Finding | None] = (),
) -> tuple[Finding, ...]:
    """All findings on one answer of the core, the gravest kind first.

    Args:
        native: the core's oc_answer as a dict, SI and rad.
        params: in force.
        relative_sensor: the angle sensor says of itself that its zero is arbitrary (SPN 1812 = 0).
        method: whose answer it is.
        yaw_rate_from_vdc2: then a bias that a known mistake of VDC2 senders explains is told with it.
        sees_banks: there is an accelerometer, and it is used.
        of_method: what the method's own room has to tell.
    """
    found = [
        _sensor_fault(native),
        _missing(native),
        _gate_shut(native, params, method),
        _offset(native),
        _yaw_rate_bias(native, method, yaw_rate_from_vdc2),
        _yaw_rate_bias_moves(native, method, sees_banks),
        _standing_acceleration(native),
        relative_angle_sensor() if relative_sensor else None,
        *of_method,
    ]
    if method != "joint":
        found += [
            _evidence(native, params),
            _understeer_by_wheels(native) if method == "wheel-speed" else _understeer(native, params),
            _play(native, params, method),
        ]
    return gravest_first(finding for finding in found if finding is not None)


def status_of(estimate: Mapping[str, Any]) -> str:
    return _core.STATUSES[int(estimate["status"])]


def _sensor_fault(native: Mapping[str, Any]) -> Finding | None:
    if status_of(native["offset"]) != "invalid":
        return None
    what = _FAULTS[_core.FAULTS[int(native["fault"])]]
    text = f"the steering wheel angle sensor {what}: the offset is what was learned before, and does not hold"
    return from_table("steering_wheel_angle_sensor_at_fault", text)


def _missing(native: Mapping[str, Any]) -> Finding | None:
    missing_s = _rejected(native, "missing_signal")
    share = missing_s / native["duration"] if native["duration"] > 0 else 0.0
    if share < _MISSING_WORTH_TELLING:
        return None
    return from_table(
        "signals_not_available",
        f"for {missing_s:.0f} s of {native['duration']:.0f} s a signal is not available",
        missing_s,
    )


def _rejected(native: Mapping[str, Any], reason: str) -> float:
    seconds: float = dict(zip(_core.REASONS, native["rejected"], strict=True))[reason]
    return seconds


def _gate_shut(native: Mapping[str, Any], params: Mapping[str, float], method: str) -> Finding | None:
    """Fast enough, and yet nothing usable: by which limit, and what may be behind it."""
    fast_s = native["bank_time"]
    of = "joint_" if method == "joint" else ""
    patience_s = params["joint_evidence_min_s"] if method == "joint" else params["clean_time_s"]
    if native["used"] > 0 or fast_s <= patience_s:
        return None
    limits = {
        "bank": ("bank limit", "joint_bank_change_max_m_s2" if of else "bank_max_m_s2", "m/s^2"),
        "curvature": ("curvature limit", f"{of}curvature_max_1_m", "1/m"),
        "longitudinal_acceleration": (
            "longitudinal acceleration limit",
            f"{of}longitudinal_acceleration_max_m_s2",
            "m/s^2",
        ),
        "lateral_acceleration": ("lateral acceleration limit", "joint_lateral_acceleration_max_m_s2", "m/s^2"),
    }
    reason = max(limits, key=lambda name: _rejected(native, name))
    words, param, unit = limits[reason]
    text = (
        f"no second of {fast_s:.0f} s above {params[f'{of}speed_min_m_s']:g} m/s passes the gate; "
        f"most is rejected by the {words} of {params[param]:g} {unit} ({param})"
    )
    if reason == "bank" and method != "joint":
        mean = native["bank_mean"]
        text += (
            f": a_y - r*v averages {mean:+.2f} m/s^2, as with an accelerometer bias of {mean:+.2f} m/s^2; "
            f"raise {param} in [params] of the vehicle file, or leave the accelerometer out (--no-accelerometer)"
        )
        return from_table("gate_shut", text, mean)
    return from_table("gate_shut", text, params[param], unit=unit)


def _offset(native: Mapping[str, Any]) -> Finding | None:
    value = native["offset"]["value"] / DEGREE
    half_width = 1.96 * native["offset"]["standard_deviation"] / DEGREE
    if status_of(native["offset"]) != "valid" or abs(value) - half_width < _OFFSET_WORTH_TELLING_DEG:
        return None
    return from_table(
        "steering_wheel_angle_offset",
        f"the steering wheel angle sensor reads {value:+.1f} deg when driving straight: calibrate it, "
        "or look at the wheel alignment if the steering wheel itself stands crooked",
        value,
    )


def _yaw_rate_bias(native: Mapping[str, Any], method: str, from_vdc2: bool) -> Finding | None:
    """With what the bias does to the offset."""
    bias, rolled_s = native["yaw_rate_bias"], native["yaw_rate_bias_wheel_time"]
    if status_of(bias) not in ("valid", "converging"):
        return None
    finding = (
        yaw_rate_beside_wheels(bias["value"], rolled_s, from_vdc2=from_vdc2)
        if rolled_s > 0
        else yaw_rate_at_standstill(bias["value"], bias["evidence"], from_vdc2=from_vdc2)
    )
    if finding is None or native["used"] == 0 or method == "wheel-speed":
        return finding
    if method == "joint":
        large = abs(bias["value"]) / DEGREE > YAW_RATE_BIAS_LARGE_DEG_S
        text = f"{finding.text}; it was corrected" + (": look at the sensor and its mounting" if large else "")
        return replace(finding, text=text, severity="warning" if large else "info")
    effect = abs(native["offset_per_yaw_rate_bias"] * bias["value"]) / DEGREE
    side = "low" if bias["value"] > 0 else "high"
    text = f"{finding.text}; this method does not correct the bias: the offset reads about {effect:.1f} deg too {side}"
    return replace(finding, text=text)


def _yaw_rate_bias_moves(native: Mapping[str, Any], method: str, sees_banks: bool) -> Finding | None:
    """5.3.1's CUSUM has spoken; banks that no accelerometer tells do the same to the wheels."""
    moving_s = native["yaw_rate_bias_alarm_time"]
    if moving_s == 0:
        return None
    known_again = status_of(native["yaw_rate_bias"]) != "invalid"
    passing = method == "joint" and known_again and (not sees_banks or moving_s <= _ALARM_PASSING_S)
    moved = "or a wheel's radius," if sees_banks else "a wheel's radius or the road's bank, which is not measured,"
    return from_table(
        "yaw_rate_bias_moves",
        f"for {moving_s:.0f} s the yaw rate's bias, {moved} moved faster than the wheel speeds can follow"
        + ("; the offset was not learned from them" if method == "joint" else "")
        + ("" if known_again else "; it is not known again yet"),
        moving_s,
        severity="info" if passing else "warning",
    )


def _standing_acceleration(native: Mapping[str, Any]) -> Finding | None:
    reading = native["standstill_lateral_acceleration"]
    if status_of(reading) != "valid":
        return None
    return lateral_acceleration_at_standstill(reading["value"], reading["evidence"])


def _evidence(native: Mapping[str, Any], params: Mapping[str, float]) -> Finding | None:
    lacking = params["offset_evidence_min_s"] - native["used"]
    if lacking <= 0 or (native["used"] == 0 and native["bank_time"] > params["clean_time_s"]):
        return None
    return from_table(
        "not_enough_evidence",
        f"not enough evidence yet: needs {math.ceil(lacking)} s more nearly straight ahead above "
        f"{params['speed_min_m_s']:g} m/s",
        lacking,
    )


def _understeer(native: Mapping[str, Any], params: Mapping[str, float]) -> Finding | None:
    gradient = native["understeer_gradient"]
    if native["used"] == 0 or status_of(gradient) != "unobservable":
        return None
    lacking = max(params["understeer_evidence_min_s"] - gradient["evidence"], 0.0)
    bends = (
        f"bends of {params['understeer_acceleration_min_m_s2']:g} to "
        f"{params['understeer_acceleration_max_m_s2']:g} m/s^2"
    )
    needs = (
        f"{math.ceil(lacking)} s more in {bends} once the offset is accurate enough"
        if lacking > 0
        else f"{bends} to both sides in like measure (an accelerometer bias makes them look one-sided)"
    )
    return from_table(
        "understeer_gradient_unknown", f"the understeer gradient is taken as zero: it needs {needs}", lacking
    )


def _understeer_by_wheels(native: Mapping[str, Any]) -> Finding | None:
    if native["used"] == 0:
        return None
    return from_table(
        "understeer_gradient_unknown",
        "the understeer gradient is taken as zero: without an accelerometer a banked bend looks like an easy one",
    )


def _play(native: Mapping[str, Any], params: Mapping[str, float], method: str) -> Finding | None:
    if native["used"] == 0:
        return None
    if method == "wheel-speed":
        counted = "the wheels' radii, the road's bank and the understeer gradient"
        unseen, besides = "play in the steering is", ""
    else:
        counted = "the yaw rate's bias and the understeer gradient"
        unseen = "play in the steering and an accelerometer bias are"
        besides = ", and play makes the understeer gradient read high"
    return from_table(
        "play_not_seen",
        f"the interval counts the measurement scatter, {counted}{_gyro_not_measured(native, params, method)}; "
        f"{unseen} not seen by this method: "
        f"{PLAY_STANDARD_DEG:g} deg of play can shift the offset by up to {PLAY_STANDARD_DEG / 2:g} deg{besides}",
        PLAY_STANDARD_DEG / 2,
    )


def _gyro_not_measured(native: Mapping[str, Any], params: Mapping[str, float], method: str) -> str:
    """What the yaw rate's bias does to the interval where neither standstill nor wheel speeds measured it."""
    if method == "wheel-speed" or status_of(native["yaw_rate_bias"]) != "unobservable":
        return ""
    half_width = 1.96 * native["offset_per_yaw_rate_bias"] * params["yaw_rate_bias_sd_rad_s"] / DEGREE
    return f" (±{half_width:.1f} deg by the gyro bias, which nothing measured: stand still for 1 s)"
