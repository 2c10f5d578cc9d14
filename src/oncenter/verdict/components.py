"""The verdicts on free play and sensors: ok, check or repair, by the thresholds of the findings and of Table 1."""

from __future__ import annotations

from oncenter.estimates.estimates import Estimates
from oncenter.findings import PLAY_STANDARD_DEG
from oncenter.plausibility.zeros import YAW_RATE_BIAS_LARGE_DEG_S
from oncenter.signals import DEGREE
from oncenter.verdict.accused import accused, finding_of, is_sensor_fault
from oncenter.verdict.numbers import half_width, rounded
from oncenter.verdict.offset import FAULTS, LOOSE
from oncenter.verdict.verdict import About, State, Verdict

_NO_PLAY_DEG = 0.5  # an interval that reaches below it may be of none: offset/answer.py
_NO_ACTION = "No action."
_LOOK = "Look at the sensor and its mounting."


def angle_sensor(answer: Estimates) -> Verdict:
    about: About = "steering wheel angle sensor"
    if is_sensor_fault(answer):
        what, check = FAULTS[answer.sensor_fault]
        return Verdict(about, "repair", f"Repair: the sensor {what}.", check)
    if "steering wheel angle" in accused(answer):
        return _signal_at_fault(about, "steering wheel angle")
    if answer.zero == "moves":
        return Verdict(about, "repair", "Repair: the zero of the sensor moves.", LOOSE)
    if answer.zero == "relative":
        return Verdict(about, "ok", "No fault found; a relative sensor.", _NO_ACTION)
    return Verdict(about, "ok", "No fault found.", _NO_ACTION)


def free_play(answer: Estimates) -> Verdict:
    """The verdict on free play by the maintenance standard of thesis 2.1."""
    about: About = "free play"
    if answer.method != "joint":
        action = "Use the method joint to measure it."
        return Verdict(about, "undecided", f"Not measured by the method {answer.method}.", action)
    value, ci95 = answer.backlash.value, answer.backlash.ci95
    if answer.backlash.status != "valid" or value is None or ci95 is None:
        return Verdict(about, "undecided", "Not measured yet.", "Drive bends to both sides.")
    width, around = rounded(value), half_width(0.5 * (ci95[1] - ci95[0]))
    standard = f"(standard {PLAY_STANDARD_DEG:g} deg)"
    if width < PLAY_STANDARD_DEG:
        is_none = ci95[0] / DEGREE < _NO_PLAY_DEG
        size = f"At most {rounded(ci95[1]):.1f} deg" if is_none else f"{width:.1f} deg ± {around:.1f}"
        return Verdict(about, "ok", f"{size} {standard}.", _NO_ACTION)
    found = f"free play {width:.1f} deg ± {around:.1f} {standard}."
    action = "Look for worn joints in the steering."
    if round(width - around, 1) > PLAY_STANDARD_DEG:
        return Verdict(about, "repair", f"Repair: {found}", action)
    return Verdict(about, "check", f"Check: {found}", action)


def yaw_rate_sensor(answer: Estimates) -> Verdict:
    about: About = "yaw rate sensor"
    if "yaw rate" in accused(answer):
        return _signal_at_fault(about, "yaw rate")
    if answer.method == "wheel-speed":
        return _not_used(about, answer)
    if finding_of(answer, "yaw_rate_bias_moves", "warning") or answer.yaw_rate_bias.status == "invalid":
        return Verdict(about, "check", "Check: the bias changes during the drive.", _LOOK)
    bias_rad_s = answer.yaw_rate_bias.value
    if bias_rad_s is None:
        return Verdict(about, "undecided", "Bias not measured.", "Stand still for 1 s with the ignition on.")
    bias = round(bias_rad_s / DEGREE, 2) + 0.0
    worst = answer.vehicle.sensors.yaw_rate_bias_deg_s
    if abs(bias) > worst:
        return Verdict(about, "repair", f"Repair: bias {bias:+.2f} deg/s (specified {worst:g} deg/s at most).", _LOOK)
    corrected = answer.method == "joint"
    if abs(bias) > YAW_RATE_BIAS_LARGE_DEG_S:
        removed = ", corrected in the offset" if corrected else ""
        return Verdict(about, "check", f"Check: bias {bias:+.2f} deg/s{removed}.", _LOOK)
    if not corrected and finding_of(answer, "yaw_rate_bias"):
        action = "Use the method joint, which corrects it."
        return Verdict(about, "check", f"Check: bias {bias:+.2f} deg/s, not corrected in the offset.", action)
    return Verdict(about, "ok", f"Bias {bias:+.2f} deg/s{', corrected' if corrected else ''}.", _NO_ACTION)


def accelerometer(answer: Estimates) -> Verdict:
    about: About = "accelerometer"
    if "lateral acceleration" in accused(answer):
        return _signal_at_fault(about, "lateral acceleration")
    if not answer.params["use_accelerometer"] or answer.method == "wheel-speed":
        return _not_used(about, answer)
    moved = finding_of(answer, "lateral_acceleration_moves", "warning")
    if moved is not None:
        return Verdict(about, "repair", f"Repair: its zero moved by {moved.value:.1f} m/s^2 during the drive.", _LOOK)
    standing = finding_of(answer, "lateral_acceleration_at_standstill")
    if standing is not None and standing.value is not None:
        return _standing(about, standing.value, answer.vehicle.sensors.lateral_acceleration_bias_m_s2)
    neutral = finding_of(answer, "unloading_off_zero")
    if neutral is not None:
        headline = f"Check: the steering is without lateral force at {neutral.value:+.2f} m/s^2, not at zero."
        action = "Check the wheel alignment and the mounting of the sensor."
        note = "An accelerometer bias, a pull or a steady crosswind causes this; one drive cannot separate them."
        return Verdict(about, "check", headline, action, note)
    return Verdict(about, "ok", "No fault found.", _NO_ACTION)


def _standing(about: About, reading: float, worst: float) -> Verdict:
    """The verdict by Table 1's largest bias, since no ground that a truck parks on slopes as much."""
    state: State = "repair" if abs(reading) > worst else "check"
    beside = f"specified {worst:.2f} m/s^2 at most" if state == "repair" else "level ground gives 0"
    headline = f"{state.capitalize()}: it reads {reading:+.2f} m/s^2 at standstill ({beside})."
    action = "Read it again on level ground; look at its mounting if the reading stays."
    return Verdict(about, state, headline, action)


def _signal_at_fault(about: About, signal: str) -> Verdict:
    headline = f"Check: the {signal} signal contradicts the others or stands still."
    return Verdict(about, "check", headline, "Correct the signal as the findings say.")


def _not_used(about: About, answer: Estimates) -> Verdict:
    by = f"the method {answer.method}" if answer.method == "wheel-speed" else "this answer"
    return Verdict(about, "undecided", f"Not used by {by}.", _NO_ACTION)
