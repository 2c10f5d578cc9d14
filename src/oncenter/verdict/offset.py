"""The verdict on the straight-ahead offset: recalibrate or not, or the driving that decides it."""

from __future__ import annotations

import math

from oncenter.estimates.estimate import Estimate
from oncenter.estimates.estimates import Estimates
from oncenter.findings import capitalised
from oncenter.signals import DEGREE
from oncenter.truck.row import GRADIENT_MIN
from oncenter.verdict.accused import accused, errors_of_signals, finding_of, only_stuck, with_source
from oncenter.verdict.decision import Case, at_fault, decide, is_whole_turns, standing
from oncenter.verdict.left_out import first_loss, is_angle_lost_in_file
from oncenter.verdict.next_driving import is_narrow, next_driving
from oncenter.verdict.numbers import Shown, joined, shown
from oncenter.verdict.second_line import align_first, by_priors, by_pull, in_deg, last_change, without_play
from oncenter.verdict.states import Code
from oncenter.verdict.verdict import Verdict

_OFFSET, _ANGLE = "straight-ahead offset", "steering wheel angle"
FAULTS = {  # of the angle sensor, by the core's names: observation, and what to check
    "lost": ("has no signal", "its connector, its wiring and its supply"),
    "stuck": ("always reads the same", "whether it turns with the column"),
    "jumped": ("jumped during the drive", "its mounting and its connector"),
    "drifting": ("is drifting", "Check its mounting; replace it if it is tight."),
    "wrong_sign": ("has its sign reversed", "how it is mounted"),
    "remounted": ("reads differently since a stop", "Check its mounting, and calibrate it."),
}
MOVES = "the zero of the steering wheel angle moves."
LOOSE = "Check both: first its message, bits and source, then the mounting of the sensor and of the steering wheel."
NO_ACTION = "No action."


def offset(answer: Estimates, limit_deg: float) -> Verdict:
    """About the straight-ahead offset; `limit_deg` in deg, either sign."""
    code = decide(case_of(answer), limit_deg)
    if code == "signal_or_sensor":
        return _moves(answer, limit_deg) if answer.sensor_fault == "none" else _signal_or_sensor(answer, limit_deg)
    if code == "repair":
        return _repair(answer, limit_deg)
    if code == "check_signal":
        return _check_signal(answer)
    if code == "no_correction":
        return _no_correction(answer, limit_deg)
    if code == "no_offset" and answer.combined_offset is not None and answer.combined_offset.ci95 is not None:
        return _of_both_axles(answer.combined_offset, limit_deg)
    if code == "no_offset":
        return _not_valid(answer, "no_offset", limit_deg)
    if code != "within" and answer.offset.status != "valid":
        return _not_valid(answer, code, limit_deg)
    return _decided(answer, code, limit_deg)


def case_of(answer: Estimates) -> Case:
    own, whole, now = answer.offset_ci95_drive, answer.offset.ci95, answer.offset_now
    return Case(
        at_fault=fault_of(answer),
        zero=answer.zero,
        is_valid=answer.offset.status == "valid",
        has_evidence=has_evidence(answer),
        own=None if own is None else in_deg(own),
        whole=None if whole is None else in_deg(whole),
        has_play=answer.method == "joint",
        own_by_priors=tuple(
            in_deg((now + moves).ci95_drive)
            for each in answer.by_priors
            if now is not None and each.inside_drive
            for moves in (each.halved, each.doubled)
        ),
    )


def has_evidence(answer: Estimates) -> bool:
    """Enough driving, by a truck that understeers, with an accelerometer that can be used: the interval holds, even
    where it is too wide for a valid offset."""
    at_wheel, is_joint = answer.understeer_at_steering_wheel.value, answer.method == "joint"
    if answer.offset.status == "valid":
        return True
    understeers = at_wheel is not None and at_wheel >= GRADIENT_MIN * answer.vehicle.ratio_near_centre
    is_enough = answer.used_s >= answer.params["joint_evidence_min_s"] and not is_narrow(answer)
    return is_joint and understeers and is_enough and not finding_of(answer, "lateral_acceleration_moves", "warning")


def fault_of(answer: Estimates) -> Code | None:
    if _is_lost_in_file(answer):
        return "check_signal"
    return at_fault(
        answer.sensor_fault,
        answer.offset.status == "invalid",
        signals=bool(errors_of_signals(answer)),
        stuck_only=only_stuck(answer),
    )


def shown_offset(answer: Estimates, limit_deg: float) -> Shown | None:
    """The offset with this drive's part of its interval; None without one."""
    if answer.offset.value is None or answer.offset_half_width_rad is None:
        return None
    return shown(answer.offset.value / DEGREE, answer.offset_half_width_rad / DEGREE, limit_deg)


def _verdict(code: Code, said: str, action: str, *notes: str) -> Verdict:
    return Verdict("straight-ahead offset", code, said, action, " ".join(filter(None, notes)))


def _before_the_fault(answer: Estimates, limit_deg: float) -> str:
    found = shown_offset(answer, limit_deg)
    return "" if found is None else f"The {_OFFSET} {found} is from before the fault: do not use it."


def _repair(answer: Estimates, limit_deg: float) -> Verdict:
    observed, check = FAULTS[answer.sensor_fault]
    said, note = f"the {_ANGLE} sensor {observed}.", _before_the_fault(answer, limit_deg)
    return _verdict("repair", said, f"{check} Then drive again.", note)


def _signal_or_sensor(answer: Estimates, limit_deg: float) -> Verdict:
    observed, _ = FAULTS[answer.sensor_fault]
    said = f"the {with_source(answer, _ANGLE)} {observed}."
    action = f"{check_both(answer.sensor_fault)} Then drive again."
    return _verdict("signal_or_sensor", said, action, _before_the_fault(answer, limit_deg))


def check_both(fault: str) -> str:
    """The signal first: a wrong entry or a lost message gives the same data as the sensor."""
    first = (
        "its sign in the [signals] table of the vehicle file"
        if fault == "wrong_sign"
        else "its message, bits and source (oncenter signals LOG)"
    )
    return f"Check both: first {first}, then {FAULTS[fault][1]}."


def _check_signal(answer: Estimates) -> Verdict:
    if _is_lost_in_file(answer):
        return _lost_in_file(answer)
    names = [with_source(answer, name) for name in accused(answer)]
    said = f"{joined(names)}." if names else "the signals of this log cannot give an offset."
    errors = errors_of_signals(answer) or [each for each in answer.findings if each.severity == "error"]
    note = f"{capitalised(errors[0].text)}." if errors else ""
    return _verdict("check_signal", said, "Correct the signal, then read the log again.", note)


def _lost_in_file(answer: Estimates) -> Verdict:
    said = "the log has steering wheel angles that cannot be used."
    return _verdict("check_signal", said, "Correct the log or its database, then read it again.", first_loss(answer))


def _is_lost_in_file(answer: Estimates) -> bool:
    return answer.sensor_fault == "lost" and is_angle_lost_in_file(answer)


def _found(answer: Estimates, limit_deg: float, which: str) -> str:
    """A sentence with the offset's value; empty without one."""
    found = shown_offset(answer, limit_deg)
    return "" if found is None else f"The {which} is {found} (limit {limit_deg:g} deg)."


def _no_correction(answer: Estimates, limit_deg: float) -> Verdict:
    found = _found(answer, limit_deg, f"{_OFFSET} of this drive")
    return _verdict(
        "no_correction",
        f"the {_ANGLE} sensor is relative, without a fixed zero. {found}".rstrip(),
        "Do not store a correction: the zero of this sensor changes at each ignition.",
        last_change(answer),
    )


def _of_both_axles(combined: Estimate, limit_deg: float) -> Verdict:
    """Yaw shows only the sum of both sensors' effects: neither of them is to be calibrated by this number."""
    assert combined.ci95 is not None
    is_over = combined.status == "valid" and standing(in_deg(combined.ci95), limit_deg) == "over"
    said = (
        "the steering wheel angle sensor and the rear axle's sensor together have an offset of "
        f"{combined} at the steering wheel (limit {limit_deg:g} deg)."
    )
    action = "Lock or align the rear axle, and calibrate its sensor. Then drive again."
    note = "This drive does not show which of both sensors has the offset: set neither of them by this number."
    return _verdict("over" if is_over else "undecided", said, action, note)


def _moves(answer: Estimates, limit_deg: float) -> Verdict:
    last = _found(answer, limit_deg, f"last {_OFFSET}")
    return _verdict("signal_or_sensor", MOVES, f"{LOOSE} Then drive again.", last)


def _not_valid(answer: Estimates, code: Code, limit_deg: float) -> Verdict:
    """Converging, or not observable: the driving that is missing."""
    driving = next_driving(answer)
    logs = "both logs" if len(answer.drives) == 1 else "all logs"
    log_it = f"Log the new drive, and give {logs} to oncenter together."
    said = f"{driving.wanted}." if code != "over" else f"{_at_least(answer)}; {driving.wanted} before you recalibrate."
    so_far = _found(answer, limit_deg, f"{_OFFSET} so far")
    pull = (by_pull(answer, limit_deg), by_priors(answer, limit_deg)) if has_evidence(answer) else ()
    return _verdict(code, said, log_it, so_far, driving.why, *pull, without_play(answer), last_change(answer))


def _at_least(answer: Estimates) -> str:
    """The least size of an offset in the interval, rounded down."""
    assert answer.offset.ci95 is not None
    return f"at least {math.floor(10.0 * min(map(abs, in_deg(answer.offset.ci95)))) / 10.0:.1f} deg"


def _decided(answer: Estimates, code: Code, limit_deg: float) -> Verdict:
    """A valid offset, or one whose whole interval is within the limit."""
    found = shown_offset(answer, limit_deg)
    assert found is not None
    said = f"{_OFFSET} {found} (limit {limit_deg:g} deg)."
    notes = (by_pull(answer, limit_deg), by_priors(answer, limit_deg), without_play(answer), last_change(answer))
    if code == "within":
        return _verdict(code, said, NO_ACTION, *notes)
    if code == "undecided":
        own = answer.offset_ci95_drive
        is_inside = own is None or standing(in_deg(own), limit_deg) == "undecided"
        why = "" if is_inside else ": by another prior the limit is inside the interval"
        close = f"{_OFFSET} {found} is too close to the limit of {limit_deg:g} deg to decide{why}."
        return _verdict(code, close, _narrower(answer), *notes)
    if code == "over":
        return _verdict(code, said, _instead(answer, found), *notes)
    first = "Align the wheels before you recalibrate. " if align_first(answer.pull) else ""
    add = f"{first}{_correction(answer, found)}"
    return _verdict(code, said, add, _direction(found), _with_left_positive(answer, found), *notes)


def _narrower(answer: Estimates) -> str:
    logs = "both logs" if len(answer.drives) == 1 else "all logs"
    return f"Log another drive, and give {logs} to oncenter together."


def _instead(answer: Estimates, found: Shown) -> str:
    """What to do about an offset beyond the limit, which must not be set."""
    if is_whole_turns(found.value):
        return f"Set the zero of the sensor with the wheels straight ahead. {turns_words(found.value)}"
    if answer.method != "joint":
        return "Answer the drive by the method joint, or measure the free play, before you recalibrate."
    return "Check whether the truck pulls to one side, or drive again on another day, before you recalibrate."


def turns_words(offset_deg: float) -> str:
    """The reading in whole turns of the steering wheel and the rest; no number to enter."""
    turns = round(offset_deg / 360.0)
    rest = round(offset_deg - 360.0 * turns, 1) + 0.0
    return (
        f"It reads {turns:+d} whole turn{'' if abs(turns) == 1 else 's'} and {rest:+.1f} deg: do not enter this as a "
        "correction."
    )


def _direction(found: Shown) -> str:
    """The sign in words, for a tool with the opposite sign."""
    side = "left" if found.value > 0.0 else "right"
    size = f"{abs(found.value):.{found.digits}f}"
    return f"When the truck drives straight ahead, the sensor reads {size} deg to the {side}."


def _correction(answer: Estimates, found: Shown) -> str:
    """The sum to add, as rounded in the headline, in the count of the truck's own network; with a correction that is
    applied already, also the sum of both."""
    if answer.vehicle.angle_sign > 0:
        return f"Add {_sum(answer, found, 1.0)}."
    return f"In the count of this truck's network, where right is positive, add {_sum(answer, found, -1.0)}."


def _sum(answer: Estimates, found: Shown, sign: float) -> str:
    remaining, applied = -sign * found.value + 0.0, round(sign * answer.vehicle.offset_applied_deg, 3) + 0.0
    add = f"{remaining:+.{found.digits}f} deg"
    if applied == 0.0:
        return add
    total = round(applied + remaining, 3) + 0.0
    return f"{add} to the {applied:+.4g} deg that is applied already: set {total:+.4g} deg"


def _with_left_positive(answer: Estimates, found: Shown) -> str:
    """The sum with the opposite sign, for a tool that does not count as the network."""
    if answer.vehicle.angle_sign > 0:
        return ""
    needs = _sum(answer, found, 1.0)
    return f"A tool whose angle falls in a turn to the right counts left as positive, and needs {needs}."
