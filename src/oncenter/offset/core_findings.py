"""Findings of all methods on an answer of the core: their conditions and texts.

Degrees here: findings are for people and files.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from oncenter import _core
from oncenter.estimates.estimates import HALF_TURN_RAD
from oncenter.findings import PLAY_STANDARD_DEG, Finding, Kind, demand, finding
from oncenter.offset.withheld import NOTHING, Withheld
from oncenter.plausibility.zeros import (
    TILTED_FROM_M_S2,
    YAW_RATE_BIAS_LARGE_DEG_S,
    YAW_RATE_BIAS_REPORTED_FROM_DEG_S,
    ground_half_width,
    lateral_acceleration_at_standstill,
    relative_angle_sensor,
    yaw_rate_at_standstill,
    yaw_rate_beside_wheels,
)
from oncenter.signals import DEGREE

# Minimum values that are reported; tuned, since a healthy truck shows less.
_BIAS_MOVED_FROM_RAD_S = 0.1 * DEGREE  # between two intervals: the half-width of a valid bias
_MISSING_REPORTED_FROM = 0.05  # of the duration
_FAULTS = {
    "stuck": "the steering wheel angle stays at one value while the truck turns",
    "jumped": "the steering wheel angle jumped and no longer agrees with the motion of the truck",
    "drifting": "the steering wheel angle is drifting away from the motion of the truck",
    "wrong_sign": "the sign of the steering wheel angle is reversed",
    "remounted": (
        "the steering wheel angle sensor has had another position since a stop, a gap in the log or a drift of its zero"
    ),
}
# Where a log with a wrong or a missing signal has the same data.
_CHECKS = {
    "lost": "Check both: first the message and the source of the signal, then the wiring and the supply of the sensor",
    "stuck": "Check both: first the message, the bits and the source of the signal, then whether the sensor turns",
    "wrong_sign": "Check both: first its sign in the [signals] table of the vehicle file, then how it is mounted",
}
_ALARM_PASSING_S = 30.0  # left out: a CUSUM's false alarm, 15 s on one healthy motorway drive of 14
_KM_H = 3.6


def findings_of(
    native: _core.OcAnswer,
    params: Mapping[str, float],
    relative_sensor: bool,
    *,
    method: str,
    yaw_rate_from_vdc2: bool,
    measures_banks: bool,
    limit_deg: float,
    of_both_axles: bool = False,
    angle_ends: str | None = None,
    withheld: Withheld = NOTHING,
    of_method: Iterable[Finding | None] = (),
) -> tuple[Finding, ...]:
    """All findings on one answer of the core.

    Args:
        native: the core's oc_answer as a dict, SI and rad.
        params: in force.
        relative_sensor: the angle sensor reports an arbitrary zero (SPN 1812 = 0).
        method: of the answer.
        yaw_rate_from_vdc2: a bias that a common mistake of VDC2 senders explains is reported with that mistake.
        measures_banks: there is an accelerometer, and it is used.
        limit_deg: of the offset, either sign.
        of_both_axles: the offset is the combined one of the front and the rear axle's sensors.
        withheld: time without a signal that the log has.
        angle_ends: time and log of the last steering wheel angle, in words; None where they are not available.
        of_method: findings of the method alone.
    """
    of_all = (
        _sensor_fault(native, angle_ends),
        _missing(native, withheld),
        _withheld(native, withheld),
        _gate_shut(native, params, method),
        None
        if of_both_axles
        else _offset(native, limit_deg, has_fixed_zero=not relative_sensor and not native["offset_walks"]),
        _yaw_rate_bias(native, method, yaw_rate_from_vdc2),
        _yaw_rate_bias_moves(native, method, measures_banks),
        _leak("rear", native["leaked_rear"]),
        _leak("front", native["leaked_front"]),
        _standing_acceleration(native, params, method, measures_banks),
        relative_angle_sensor() if relative_sensor else None,
        *of_method,
    )
    of_limits = (
        ()
        if method == "joint"
        else (
            _evidence(native, params),
            _understeer_by_wheels(native) if method == "wheel-speed" else _understeer(native, params),
            _play(native, params, method),
        )
    )
    return tuple(filter(None, (*of_all, *of_limits)))


@finding("steering_wheel_angle_sensor_at_fault", "error")
def _sensor_fault(found: Kind, native: _core.OcAnswer, angle_ends: str | None) -> Finding | None:
    """The sensor check found a fault: the offset is invalid."""
    if _core.status_of(native["offset"]) != "invalid" or native["fault"] == 0:
        return None
    fault = _core.FAULTS[int(native["fault"])]
    since = f" since {angle_ends}" if angle_ends is not None else " any more"
    what = f"there is no steering wheel angle{since} while the truck drives" if fault == "lost" else _FAULTS[fault]
    check = _CHECKS.get(fault, "Check the sensor, its mounting and its wiring")
    return found(f"{what}. The offset was estimated before this fault and is not valid now. {check}")


@finding("signals_not_available", "warning", "s")
def _missing(found: Kind, native: _core.OcAnswer, withheld: Withheld) -> Finding | None:
    """The log has no value of a signal for a good part of the duration."""
    missing_s = max(_rejected(native, "missing_signal") - withheld.time_s, 0.0)
    if not _is_long(missing_s, native):
        return None
    return found(
        f"a signal that the method needs is not available for {missing_s:.0f} s of {native['duration']:.0f} s. The "
        "offset does not use this time. Find the signal with oncenter signals, and check its sender and the logger",
        missing_s,
    )


@finding("signals_withheld", "info", "s")
def _withheld(found: Kind, native: _core.OcAnswer, withheld: Withheld) -> Finding | None:
    """The log has all signals, but oncenter itself did not use one of them for a good part of the duration."""
    if not _is_long(withheld.time_s, native):
        return None
    return found(
        f"the log has all signals, but oncenter did not use {withheld.signal} for {withheld.time_s:.0f} s of "
        f"{native['duration']:.0f} s: {withheld.why}. The offset does not use this time",
        withheld.time_s,
    )


def _is_long(time_s: float, native: _core.OcAnswer) -> bool:
    return bool(native["duration"] > 0.0 and time_s >= _MISSING_REPORTED_FROM * native["duration"])


def _rejected(native: _core.OcAnswer, reason: str) -> float:
    return dict(zip(_core.REASONS, native["rejected"], strict=True))[reason]


@finding("gate_shut", "warning", "m/s^2")
def _gate_shut(found: Kind, native: _core.OcAnswer, params: Mapping[str, float], method: str) -> Finding | None:
    """Fast for long enough, but no second passed the gate: the limit that rejects most, and the way out."""
    fast_s = native["bank_time"]
    of = "joint_" if method == "joint" else ""
    patience_s = params["joint_evidence_min_s"] if method == "joint" else params["clean_time_s"]
    if native["used"] > 0 or fast_s <= patience_s:
        return None
    limits = {
        "bank": (
            "bank limit",
            "joint_bank_change_max_m_s2" if of else "bank_max_m_s2",
            "m/s^2",
            "check the accelerometer",
        ),
        "curvature": ("curvature limit", f"{of}curvature_max_1_m", "1/m", "drive wider bends"),
        "longitudinal_acceleration": (
            "longitudinal acceleration limit",
            f"{of}longitudinal_acceleration_max_m_s2",
            "m/s^2",
            "drive at a steady speed",
        ),
        "lateral_acceleration": (
            "lateral acceleration limit",
            "joint_lateral_acceleration_max_m_s2",
            "m/s^2",
            "drive more slowly in bends",
        ),
    }
    reason = max(limits, key=lambda name: _rejected(native, name))
    assisted_s = _rejected(native, "steering_assist")
    if assisted_s > _rejected(native, reason):
        return found(
            f"none of the {fast_s:.0f} s above {km_h(params[f'{of}speed_min_m_s'])} can be used, so no offset is "
            f"estimated. A steering assistance is active for {assisted_s:.0f} s. Switch it off for some minutes",
            assisted_s,
            unit="s",
        )
    words, param, unit, instead = limits[reason]
    text = (
        f"none of the {fast_s:.0f} s above {km_h(params[f'{of}speed_min_m_s'])} can be used, so no offset is "
        f"estimated. Most are rejected by the {words} of {params[param]:g} {unit} ({param})"
    )
    if reason == "bank" and method != "joint":
        mean = native["bank_mean"]
        text += (
            f". Lateral acceleration minus yaw rate times speed is {mean:+.2f} m/s^2 on average, as with an "
            f"accelerometer bias. Check the accelerometer. Use --no-accelerometer, or raise {param} in [params]"
        )
        return found(text, mean)
    text += f". {instead.capitalize()}, or raise {param} in [params] of the vehicle file"
    return found(text, params[param], unit=unit)


def km_h(speed_m_s: float) -> str:
    return f"{speed_m_s * _KM_H:.0f} km/h"


@finding("steering_wheel_angle_offset", "warning", "deg")
def _offset(found: Kind, native: _core.OcAnswer, limit_deg: float, *, has_fixed_zero: bool) -> Finding | None:
    """Valid, and this drive's whole interval beyond the limit; where the zero moves, no calibration would hold."""
    value, half_width = native["offset"]["value"] / DEGREE, 1.96 * native["offset_parts"]["drive_sd"] / DEGREE
    is_near = _core.status_of(native["offset"]) != "valid" or abs(value) - half_width < limit_deg
    if is_near or not has_fixed_zero:
        return None
    reads = f"the steering wheel angle sensor reads {value:+.1f} deg (to the {'left' if value > 0 else 'right'})"
    if abs(value) * DEGREE >= HALF_TURN_RAD:
        rest = (
            "These are whole turns. Do not enter this number: set the zero of the sensor with the wheels straight ahead"
        )
        return found(f"{reads} when the truck drives straight ahead. {rest}", value)
    return found(
        f"{reads} when the truck drives straight ahead. This offset is valid and beyond the limit of {limit_deg:g} "
        "deg. The verdict says what to do. If the steering wheel itself is not level then, check the wheel alignment "
        "first",
        value,
    )


def _yaw_rate_bias(native: _core.OcAnswer, method: str, from_vdc2: bool) -> Finding | None:
    """The yaw rate bias with its effect on the offset."""
    bias, rolled_s = native["yaw_rate_bias"], native["yaw_rate_bias_wheel_time"]
    if _core.status_of(bias) not in ("valid", "converging"):
        return None
    half_width = 1.96 * bias["standard_deviation"]
    measured = (
        yaw_rate_beside_wheels(bias["value"], rolled_s, from_vdc2=from_vdc2, half_width=half_width)
        if rolled_s > 0
        else yaw_rate_at_standstill(bias["value"], bias["evidence"], from_vdc2=from_vdc2, half_width=half_width)
    )
    if measured is None:
        return None
    sure, large = (_is_sure(bias, least) for least in (YAW_RATE_BIAS_REPORTED_FROM_DEG_S, YAW_RATE_BIAS_LARGE_DEG_S))
    measured = replace(measured, severity="warning" if sure else "info")
    if method == "wheel-speed":
        return replace(measured, text=f"{measured.text}. The offset is not affected: this method uses no yaw rate")
    check = ". It is large: check the sensor and its mounting" if large else ""
    if native["used"] == 0:
        return replace(measured, text=f"{measured.text}. No offset is estimated from this drive{check}")
    if method == "joint":
        text = f"{measured.text}. The offset is corrected for this bias{check or '; no action is necessary'}"
        return replace(measured, text=text, severity="warning" if large else "info")
    if not sure:
        text = f"{measured.text}. The bias is not measured well enough to correct the offset. Stand still for 1 s"
        return replace(measured, text=text)
    effect = abs(native["offset_per_yaw_rate_bias"] * bias["value"]) / DEGREE
    side = "low" if bias["value"] > 0 else "high"
    text = (
        f"{measured.text}. This method does not correct the bias: the offset reads about {effect:.1f} deg too {side}. "
        "Use --method joint"
    )
    return replace(measured, text=text)


def _is_sure(bias: _core.OcEstimate, threshold_deg_s: float) -> bool:
    """Valid, and its whole 95 % interval beyond the threshold."""
    least = (abs(bias["value"]) - 1.96 * bias["standard_deviation"]) / DEGREE
    return _core.status_of(bias) == "valid" and least >= threshold_deg_s


@finding("yaw_rate_bias_moves", "warning", "s")
def _yaw_rate_bias_moves(found: Kind, native: _core.OcAnswer, method: str, measures_banks: bool) -> Finding | None:
    """Alarm of 5.3.1's CUSUM; info where it has passed, or where the bias has one value in all intervals of the drive.
    Without an accelerometer, road bank has the same effect on the wheel speeds."""
    moving_s = native["yaw_rate_bias_alarm_time"]
    if moving_s == 0:
        return None
    identified_again = _core.status_of(native["yaw_rate_bias"]) != "invalid"
    has_passed = method == "joint" and identified_again and (not measures_banks or moving_s <= _ALARM_PASSING_S)
    passing = has_passed or native.get("yaw_rate_bias_moved", 0.0) < _BIAS_MOVED_FROM_RAD_S
    moved = " or a tyre radius" if measures_banks else ", a tyre radius or the road bank (not measured)"
    unused = ". The offset does not use this time" if method == "joint" else ". This method does not allow for it"
    again = "" if identified_again else ". The bias is not identified again since then; the offset is less certain"
    check = "" if passing else ". Check the yaw rate sensor, the tyre sizes and the tyre pressures"
    return found(
        f"for {moving_s:.0f} s the yaw rate did not agree with the left and right wheel speeds: the zero of the yaw "
        f"rate sensor{moved} changed quickly{unused}{again}{check}",
        moving_s,
        severity="info" if passing else "warning",
    )


@finding("tyre_loses_air", "warning", "%")
def _leak(found: Kind, axle: str, leaked: float) -> Finding | None:
    """The rolling radii of one axle changed against each other during the drive, and those of the other did not."""
    if leaked == 0.0:
        return None
    smaller, larger = ("left", "right") if leaked < 0.0 else ("right", "left")
    return found(
        f"the {smaller} {axle} tyre became {100.0 * abs(leaked):.2f} % smaller against the {larger} one during the "
        "drive: it loses air, or the other one warms up. The offset is less certain. Check the tyre pressures",
        100.0 * leaked,
    )


def _standing_acceleration(
    native: _core.OcAnswer, params: Mapping[str, float], method: str, is_used: bool
) -> Finding | None:
    """`is_used`: the method uses the accelerometer. An info where the slope of the ground alone can be the cause."""
    reading = native["standstill_lateral_acceleration"]
    if _core.status_of(reading) != "valid":
        return None
    if not is_used or method == "wheel-speed":
        effect = "The offset is not affected: it is estimated without the accelerometer"
    elif method == "joint":
        effect = "The interval of the offset allows for both"
    else:
        effect = "This method does not correct the offset for a bias; --method joint does"
    found = lateral_acceleration_at_standstill(reading["value"], reading["evidence"], effect)
    if found is None or abs(reading["value"]) - ground_half_width(params) >= TILTED_FROM_M_S2:
        return found
    return replace(found, severity="info")


@finding("not_enough_evidence", "info", "s")
def _evidence(found: Kind, native: _core.OcAnswer, params: Mapping[str, float]) -> Finding | None:
    """Fewer usable seconds than the method needs."""
    lacking = params["offset_evidence_min_s"] - native["used"]
    if lacking <= 0 or (native["used"] == 0 and native["bank_time"] > params["clean_time_s"]):
        return None
    speed = km_h(params["speed_min_m_s"])
    return found(
        f"only {native['used']:.0f} s of nearly straight driving above {speed} can be used; this method needs "
        f"{params['offset_evidence_min_s']:g} s. There is no valid offset so far. "
        f"Drive at least {demand(lacking)} more on a straight road",
        lacking,
    )


@finding("understeer_gradient_unknown", "info", "s")
def _understeer(found: Kind, native: _core.OcAnswer, params: Mapping[str, float]) -> Finding | None:
    """The gradient is unobservable: taken as zero."""
    gradient = native["understeer_gradient"]
    if native["used"] == 0 or _core.status_of(gradient) != "unobservable":
        return None
    lacking = max(params["understeer_evidence_min_s"] - gradient["evidence"], 0.0)
    bends = (
        f"bends of {params['understeer_acceleration_min_m_s2']:g} to "
        f"{params['understeer_acceleration_max_m_s2']:g} m/s^2 lateral acceleration"
    )
    action = (
        f"Drive at least {demand(lacking)} more in {bends}; they count once the offset is accurate enough"
        if lacking > 0
        else f"Drive {bends} to both sides equally; an accelerometer bias makes them look one-sided"
    )
    return found(
        "the understeer gradient is not identified and is taken as zero. The interval of the offset allows for this. "
        f"{action}",
        lacking,
    )


@finding("understeer_gradient_unknown", "info")
def _understeer_by_wheels(found: Kind, native: _core.OcAnswer) -> Finding | None:
    """Always: the method takes it as zero."""
    if native["used"] == 0:
        return None
    return found(
        "the understeer gradient is taken as zero: without an accelerometer, a banked bend looks like a gentle one. "
        "The interval of the offset allows for this",
    )


@finding("play_not_seen", "info", "deg")
def _play(found: Kind, native: _core.OcAnswer, params: Mapping[str, float], method: str) -> Finding | None:
    """Whenever seconds were used."""
    if native["used"] == 0:
        return None
    if method == "wheel-speed":
        covered = "the wheel radii, the road bank and the understeer gradient"
        unidentified, besides, where = "free play", "", " where the log has a yaw rate"
    else:
        covered = "the yaw rate bias and the understeer gradient"
        unidentified, where = "free play or an accelerometer bias", ""
        besides = " and makes the understeer gradient read high"
    return found(
        f"the interval covers measurement scatter, {covered}{_gyro_not_measured(native, params, method)}. This method "
        f"does not identify {unidentified}. Free play of {PLAY_STANDARD_DEG:g} deg can shift the offset by up to "
        f"{PLAY_STANDARD_DEG / 2:g} deg{besides}. Use --method joint{where}",
        PLAY_STANDARD_DEG / 2,
    )


def _gyro_not_measured(native: _core.OcAnswer, params: Mapping[str, float], method: str) -> str:
    """The share of the yaw rate bias in the interval where neither standstill nor wheel speeds identify it."""
    if method == "wheel-speed" or _core.status_of(native["yaw_rate_bias"]) != "unobservable":
        return ""
    half_width = 1.96 * native["offset_per_yaw_rate_bias"] * params["yaw_rate_bias_sd_rad_s"] / DEGREE
    return f" (±{half_width:.1f} deg by the gyro bias, which was not measured: stand still for 1 s)"
