"""The verdict on the straight-ahead offset: recalibrate or not, or the driving that decides it."""

from __future__ import annotations

from oncenter.estimates.cause import in_words
from oncenter.estimates.changes import Change
from oncenter.estimates.estimates import Estimates
from oncenter.findings import PLAY_STANDARD_DEG, capitalised
from oncenter.verdict.accused import accused, errors_of_signals, is_sensor_fault
from oncenter.verdict.left_out import first_loss, is_angle_lost_in_file
from oncenter.verdict.next_driving import next_driving
from oncenter.verdict.numbers import floor_of_size, half_width, joined, plus_minus, rounded
from oncenter.verdict.verdict import State, Verdict

_OFFSET = "straight-ahead offset"
FAULTS = {  # of the angle sensor, by the core's names: what happens, and the check
    "lost": ("sends no signal", "Check its connector, its wiring and its supply."),
    "stuck": ("always reads the same", "Check that it turns with the column; replace it if it does."),
    "jumped": ("jumped during the drive", "Check its mounting and its connector."),
    "drifting": ("is drifting", "Check its mounting; replace it if it is tight."),
    "wrong_sign": (
        "has its sign reversed",
        "Check its sign in the [signals] table of the vehicle file, then how it is mounted.",
    ),
    "remounted": ("reads differently since a stop", "Check its mounting, and calibrate it."),
}


LOOSE = "Check the mounting of the sensor and of the steering wheel."


def offset(answer: Estimates, limit_deg: float) -> Verdict:
    """About the straight-ahead offset; `limit_deg` in deg, either sign."""
    if answer.sensor_fault == "lost" and is_angle_lost_in_file(answer):
        return _lost_in_file(answer)
    if is_sensor_fault(answer):
        return _repair(answer)
    if answer.offset.status == "invalid":
        return _no_verdict(answer)
    if answer.zero == "relative":
        return _no_correction(answer, limit_deg)
    if answer.zero == "moves":
        return _moves(answer, limit_deg)
    if answer.offset.status != "valid" or answer.offset.value is None or answer.offset_half_width_rad is None:
        return _not_exact(answer, limit_deg)
    return _exact(answer, limit_deg)


def _verdict(state: State, headline: str, action: str, *notes: str) -> Verdict:
    return Verdict("straight-ahead offset", state, headline, action, " ".join(filter(None, notes)))


def _repair(answer: Estimates) -> Verdict:
    what, check = FAULTS[answer.sensor_fault]
    value, half_width_rad = answer.offset.value, answer.offset_half_width_rad
    note = ""
    if value is not None and half_width_rad is not None:
        note = f"The {_OFFSET} {plus_minus(value, half_width_rad)} is from before the fault: do not use it."
    return _verdict("repair", f"Repair: the steering wheel angle sensor {what}.", f"{check} Then drive again.", note)


def _no_verdict(answer: Estimates) -> Verdict:
    names = accused(answer)
    check = f"the {joined(names)} signal{'' if len(names) == 1 else 's'}" if names else "the signals"
    errors = errors_of_signals(answer)
    note = f"{capitalised(errors[0].text)}." if errors else ""
    return _verdict("no_verdict", f"No verdict: check {check}.", "Correct the signal, then read the log again.", note)


def _lost_in_file(answer: Estimates) -> Verdict:
    headline = "No verdict: the log has steering wheel angles that cannot be used."
    return _verdict("no_verdict", headline, "Correct the log or its database, then read it again.", first_loss(answer))


def _found(answer: Estimates, limit_deg: float, which: str) -> str:
    """A sentence with the offset's value; empty without one."""
    value, half_width_rad = answer.offset.value, answer.offset_half_width_rad
    if value is None or half_width_rad is None:
        return ""
    return f"The {which} is {plus_minus(value, half_width_rad)} (limit {limit_deg:g} deg)."


def _no_correction(answer: Estimates, limit_deg: float) -> Verdict:
    found = _found(answer, limit_deg, f"{_OFFSET} of this drive")
    return _verdict(
        "no_correction",
        f"No correction: the steering wheel angle sensor is relative, without a fixed zero. {found}".rstrip(),
        "Do not store a correction: the zero of this sensor changes at each ignition.",
        _change(answer),
    )


def _moves(answer: Estimates, limit_deg: float) -> Verdict:
    last = _found(answer, limit_deg, f"last {_OFFSET}")
    return _verdict(
        "repair", "Repair: the zero of the steering wheel angle sensor moves.", f"{LOOSE} Then drive again.", last
    )


def _not_exact(answer: Estimates, limit_deg: float) -> Verdict:
    """Converging, or not observable."""
    driving = next_driving(answer)
    logs = "both logs" if len(answer.drives) == 1 else "all logs"
    log_it = f"Log the new drive, and give {logs} to oncenter together."
    value, half_width_rad, ci95 = answer.offset.value, answer.offset_half_width_rad, answer.offset.ci95
    if value is None or half_width_rad is None or ci95 is None:
        return _verdict("undecided", f"Undecided: {driving.wanted}.", log_it, driving.why)
    so_far = f"The {_OFFSET} so far is {plus_minus(value, half_width_rad)} (limit {limit_deg:g} deg)."
    at_least = floor_of_size(*ci95)
    notes = (driving.why, _play_is_left_out(answer), _change(answer))
    if at_least >= limit_deg:
        headline = f"Over the limit (at least {at_least:.1f} deg): {driving.wanted} before you recalibrate."
        return _verdict("over", headline, log_it, so_far, *notes)
    return _verdict("undecided", f"Undecided: {driving.wanted}.", log_it, so_far, *notes)


def _exact(answer: Estimates, limit_deg: float) -> Verdict:
    """A valid offset. An offset whose whole interval holds zero is not set, since that might make it worse."""
    value, half_width_rad, ci95 = answer.offset.value, answer.offset_half_width_rad, answer.offset.ci95
    assert value is not None and half_width_rad is not None and ci95 is not None
    found = f"{_OFFSET} {plus_minus(value, half_width_rad)} (limit {limit_deg:g} deg)."
    notes = (_straddles(answer, limit_deg), _play_is_left_out(answer), _change(answer))
    if abs(rounded(value)) < limit_deg:
        return _verdict("within", f"Within the limit: {found}", "No action.", *notes)
    if answer.method != "joint":
        action = "Answer the drive by the method joint, or measure the free play, before you recalibrate."
        return _verdict("over", f"Over the limit: {found}", action, *notes)
    if ci95[0] <= 0.0 <= ci95[1]:
        action = "Check whether the truck pulls to one side, or drive again on another day, before you recalibrate."
        return _verdict("over", f"Over the limit: {found}", action, *notes)
    return _verdict(
        "recalibrate", f"Recalibrate: {found}", _correction(answer), _in_own_count(answer), _direction(value), *notes
    )


def _direction(offset_rad: float) -> str:
    """The sign in words, for a tool with the opposite sign."""
    side = "left" if offset_rad > 0.0 else "right"
    return f"When the truck drives straight ahead, the sensor reads {abs(rounded(offset_rad)):.1f} deg to the {side}."


def _correction(answer: Estimates) -> str:
    """The sum to add, as rounded in the headline; with a correction that is applied already, also the sum of both."""
    assert answer.offset.value is not None
    remaining, applied = -rounded(answer.offset.value) + 0.0, round(answer.vehicle.offset_applied_deg, 3)
    if applied == 0.0:
        return f"Add {remaining:+.1f} deg."
    total = round(applied + remaining, 3) + 0.0
    return f"Add {remaining:+.1f} deg to the {applied:+.4g} deg that is applied already: set {total:+.4g} deg."


def _in_own_count(answer: Estimates) -> str:
    """The sum with the opposite sign, for the network or ECU whose own values are positive to the right."""
    assert answer.offset.value is not None
    entry = answer.vehicle.signals.get("steering_wheel_angle")
    if entry is None or entry.sign == 1:
        return ""
    remaining, applied = rounded(answer.offset.value), -round(answer.vehicle.offset_applied_deg, 3)
    total = f" to {applied:+.4g} deg: set {round(applied + remaining, 3) + 0.0:+.4g} deg" if applied else ""
    return f"The network counts right as positive: in its own count, add {remaining:+.1f} deg{total}."


def _straddles(answer: Estimates, limit_deg: float) -> str:
    """The interval on both sides of the limit: this drive's part of it, or only the part that no drive separates."""
    value, half_width_rad, ci95 = answer.offset.value, answer.offset_half_width_rad, answer.offset.ci95
    assert value is not None and half_width_rad is not None and ci95 is not None
    middle, around = rounded(value), half_width(half_width_rad)
    is_over = abs(middle) >= limit_deg
    of_drive = _crossing(middle - around, middle + around, limit_deg, is_over)
    if of_drive:
        return f"{'Close to the limit: the' if is_over else 'The'} interval {of_drive}."
    causes = in_words(answer.not_identifiable)
    whole = _crossing(rounded(ci95[0]), rounded(ci95[1]), limit_deg, is_over)
    if not causes or not whole:
        return ""
    return f"With {causes}, which one drive cannot separate from the offset, the interval {whole}."


def _crossing(low: float, high: float, limit_deg: float, is_over: bool) -> str:
    """ "1.9 to 2.1 deg reaches below the limit", the smaller size first; empty where all of it is on one side."""
    first, last = (low, high) if abs(low) <= abs(high) else (high, low)
    least = 0.0 if low <= 0.0 <= high else abs(first)
    if is_over and round(least, 1) < limit_deg:
        return f"{first:.1f} to {last:.1f} deg reaches below the limit"
    if not is_over and round(abs(last), 1) >= limit_deg:
        return f"{first:.1f} to {last:.1f} deg reaches the limit"
    return ""


def _play_is_left_out(answer: Estimates) -> str:
    if answer.method == "joint":
        return ""
    return (
        f"The interval of the method {answer.method} does not include free play: {PLAY_STANDARD_DEG:g} deg of play can "
        f"shift the offset by up to {PLAY_STANDARD_DEG / 2:g} deg."
    )


def _change(answer: Estimates) -> str:
    """The last change of the offset that lasted."""
    lasting = [change for change in answer.changes if _has_lasted(change)]
    if not lasting:
        return ""
    last = lasting[-1]
    assert last.size_rad is not None
    when = f"{last.into_log_s / 60:.1f} min into" if last.into_log_s > 0.0 else "before"
    before, after = rounded(last.offset_before_rad), rounded(last.offset_after_rad)
    return (
        f"The offset changed by {rounded(last.size_rad):+.1f} deg {when} {last.log}, from {before:+.1f} to "
        f"{after:+.1f} deg: use the value after."
    )


def _has_lasted(change: Change) -> bool:
    return change.size_rad is not None and abs(change.size_rad) >= 1.96 * (change.sd_rad or 0.0)
