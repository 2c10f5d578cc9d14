"""The verdicts on free play and sensors, by the thresholds of the findings and of Table 1.

Check and repair need a valid estimate whose whole 95 % interval is beyond the threshold.
"""

from __future__ import annotations

from oncenter.estimates.estimate import Estimate
from oncenter.estimates.estimates import Estimates
from oncenter.findings import PLAY_STANDARD_DEG
from oncenter.plausibility.zeros import TILTED_FROM_M_S2, YAW_RATE_BIAS_LARGE_DEG_S, ground_half_width
from oncenter.signals import DEGREE
from oncenter.verdict.accused import accused, finding_of, with_source
from oncenter.verdict.decision import standing
from oncenter.verdict.numbers import Shown, shown
from oncenter.verdict.offset import FAULTS, LOOSE, MOVES, NO_ACTION, check_both, fault_of
from oncenter.verdict.verdict import About, Verdict

_NO_PLAY_DEG = 0.5  # an interval that reaches below it may be of none: offset/answer.py
_LOOK = "Look at the sensor and its mounting."
_STAND_STILL = "Stand still for 1 s with the ignition on."


def angle_sensor(answer: Estimates) -> Verdict:
    about: About = "steering wheel angle sensor"
    if "steering wheel angle" in accused(answer) and fault_of(answer) == "check_signal":
        return _signal_at_fault(answer, about, "steering wheel angle")
    fault = answer.sensor_fault
    if fault != "none":
        return _faulty(about, answer)
    if answer.zero == "moves":
        return Verdict(about, "signal_or_sensor", MOVES, LOOSE)
    if answer.combined_offset is not None:
        return Verdict(about, "not_measured", "not checked: a rear axle steers.", NO_ACTION)
    if answer.zero == "relative":
        return Verdict(about, "ok", "no fault found; a relative sensor.", NO_ACTION)
    return Verdict(about, "ok", "it works (its offset is judged by itself).", NO_ACTION)


def _faulty(about: About, answer: Estimates) -> Verdict:
    code, (observed, check) = fault_of(answer), FAULTS[answer.sensor_fault]
    if code == "repair":
        return Verdict(about, code, f"the sensor {observed}.", check)
    if code == "signal_or_sensor":
        return Verdict(about, code, f"the steering wheel angle {observed}.", check_both(answer.sensor_fault))
    return Verdict(about, "not_measured", "not judged while another signal is at fault.", NO_ACTION)


def free_play(answer: Estimates) -> Verdict:
    """The verdict on free play by the maintenance standard of thesis 2.1."""
    about: About = "free play"
    if answer.method != "joint":
        action = "Use the method joint to measure it."
        return Verdict(about, "not_measured", f"not measured by the method {answer.method}.", action)
    found = _in(answer.backlash, DEGREE, PLAY_STANDARD_DEG, 1)
    if found is None or answer.backlash.ci95 is None or answer.backlash.status != "valid":
        return Verdict(about, "not_measured", "not identified so far.", "Drive bends to both sides.")
    limit = f"(maintenance limit of free play: {PLAY_STANDARD_DEG:g} deg)"
    size = f"{str(found)[1:]} {limit}."
    place = _place(answer.backlash, DEGREE, PLAY_STANDARD_DEG)
    if place == "over":
        return Verdict(about, "repair", f"free play {size}", "Look for worn joints in the steering.")
    if place == "undecided":
        return Verdict(about, "undecided", f"free play {size}", "Log another drive with bends to both sides.")
    low, high = answer.backlash.ci95
    is_none = low / DEGREE < _NO_PLAY_DEG
    return Verdict(about, "ok", f"at most {high / DEGREE:.1f} deg {limit}." if is_none else size, NO_ACTION)


def yaw_rate_sensor(answer: Estimates) -> Verdict:
    about: About = "yaw rate sensor"
    if "yaw rate" in accused(answer):
        return _signal_at_fault(answer, about, "yaw rate")
    if answer.method == "wheel-speed":
        return _not_used(about, answer)
    if finding_of(answer, "yaw_rate_bias_moves", "warning"):
        return Verdict(about, "check", "the bias changes during the drive.", _LOOK)
    bias, worst = answer.yaw_rate_bias, answer.vehicle.sensors.yaw_rate_bias_deg_s
    if bias.status == "invalid":
        return Verdict(about, "undecided", "the bias changes during the drive, or a tyre radius does.", _STAND_STILL)
    found = _in(bias, DEGREE, YAW_RATE_BIAS_LARGE_DEG_S, 2)
    if bias.value is None or found is None:
        return Verdict(about, "not_measured", "bias not identified.", _STAND_STILL)
    size = str(found).replace(" deg", " deg/s", 1)
    if bias.status != "valid":
        return Verdict(about, "not_measured", f"bias {size}, not exact enough.", _STAND_STILL)
    if _place(bias, DEGREE, worst) == "over":
        return Verdict(about, "repair", f"bias {size} (specified {worst:g} deg/s at most).", _LOOK)
    corrected = answer.method == "joint"
    if _place(bias, DEGREE, YAW_RATE_BIAS_LARGE_DEG_S) == "over":
        removed = ", corrected in the offset" if corrected else ""
        return Verdict(about, "check", f"bias {size}{removed}.", _LOOK)
    if not corrected and finding_of(answer, "yaw_rate_bias", "warning"):
        action = "Use the method joint, which corrects it."
        return Verdict(about, "check", f"bias {size}, not corrected in the offset.", action)
    return Verdict(about, "ok", f"bias {size}{', corrected' if corrected else ''}.", NO_ACTION)


def accelerometer(answer: Estimates) -> Verdict:
    about: About = "accelerometer"
    if "lateral acceleration" in accused(answer):
        return _signal_at_fault(answer, about, "lateral acceleration")
    if not answer.params["use_accelerometer"] or answer.method == "wheel-speed":
        return _not_used(about, answer)
    moved = finding_of(answer, "lateral_acceleration_moves", "warning")
    if moved is not None:
        said = f"the zero of the lateral acceleration moved by {moved.value:.1f} m/s^2 during the drive."
        return Verdict(about, "signal_or_sensor", said, "Check both, first the signals of the log.")
    tilted = _at_standstill(answer)
    if tilted is not None:
        return tilted
    neutral = finding_of(answer, "unloading_off_zero")
    if neutral is not None:
        said = f"the steering is without lateral force at {neutral.value:+.2f} m/s^2, not at zero."
        action = "Check the wheel alignment and the mounting of the sensor."
        note = "An accelerometer bias, a pull or a steady crosswind causes this; one drive cannot separate them."
        return Verdict(about, "check", said, action, note)
    return Verdict(about, "ok", "no fault found.", NO_ACTION)


def _at_standstill(answer: Estimates) -> Verdict | None:
    """Beyond all that the ground can do: the interval is of the slope of the ground on which trucks stop."""
    standing_still = finding_of(answer, "lateral_acceleration_at_standstill")
    if standing_still is None or standing_still.value is None:
        return None
    reading, ground = standing_still.value, ground_half_width(answer.params)
    worst = answer.vehicle.sensors.lateral_acceleration_bias_m_s2
    sure = abs(reading) - ground
    if sure < TILTED_FROM_M_S2:
        return None
    beside = f"specified {worst:.2f} m/s^2 at most" if sure > worst else "level ground gives 0"
    said = f"it reads {reading:+.2f} m/s^2 at standstill ({beside}; a slope of the ground can add ± {ground:.2f})."
    action = "Read it again on level ground; look at its mounting if the reading stays."
    return Verdict("accelerometer", "repair" if sure > worst else "check", said, action)


def _signal_at_fault(answer: Estimates, about: About, signal: str) -> Verdict:
    said = f"{with_source(answer, signal)} contradicts the others or stands still."
    return Verdict(about, "check_signal", said, "Correct the signal as the findings say.")


def _not_used(about: About, answer: Estimates) -> Verdict:
    by = f"the method {answer.method}" if answer.method == "wheel-speed" else "this answer"
    return Verdict(about, "not_measured", f"not used by {by}.", NO_ACTION)


def _in(estimate: Estimate, unit: float, limit: float, digits: int) -> Shown | None:
    """A value of a status that can be shown, in `unit`."""
    if estimate.value is None or estimate.ci95 is None or estimate.status not in ("valid", "converging"):
        return None
    half_width = 0.5 * (estimate.ci95[1] - estimate.ci95[0])
    return shown(estimate.value / unit, half_width / unit, limit, digits)


def _place(estimate: Estimate, unit: float, limit: float) -> str:
    """Where the interval is; "undecided" for an estimate that is not valid."""
    if estimate.ci95 is None or estimate.status != "valid":
        return "undecided"
    return standing((estimate.ci95[0] / unit, estimate.ci95[1] / unit), limit)
