"""Inputs of an answer: params in force, drives in order and of one rate, their signals, and the track widths."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

from oncenter import _core
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.estimates.estimates import Method
from oncenter.findings import Finding
from oncenter.offset.rear_axle import WEIGHT
from oncenter.plausibility.axles import without_unfit_axles
from oncenter.plausibility.statuses import without_contradicted
from oncenter.signals import SIGNALS, Signals
from oncenter.truck.events import Event, is_former
from oncenter.truck.fingerprint import Print, copies, fingerprint_of
from oncenter.vehicle import Vehicle, core_params

_NEEDED = ("steering_wheel_angle", "yaw_rate", "vehicle_speed")
_TORQUE_SWITCH = "torque_for_accelerometer_1"
_AXLES = ("rear", "front")  # by whose wheel speeds the motion is estimated, the better one first
RATES_ALIKE = 0.01  # of the rate; clocks differ by less


def params_of(vehicle: Vehicle, params: Mapping[str, float] | None) -> dict[str, float]:
    try:
        return _core.default_params() | core_params(vehicle.params, params or {})
    except ValueError as error:
        raise OncenterError(str(error), code="params", exit_code=WRONG_USAGE) from None


def with_torque(
    params: Mapping[str, float], given: Mapping[str, float], method: Method, drives: Sequence[Signals]
) -> dict[str, float]:
    """The params in force: without an accelerometer, a torque signal of all drives takes its place.

    Args:
        params: from `params_of`.
        given: of the vehicle and the caller; a switch in them decides.
        method, drives: of the answer.
    """
    has_torque = all(SIGNALS["steering_wheel_torque"].column in drive.columns for drive in drives)
    if params["use_accelerometer"] or method != "joint" or not has_torque or _TORQUE_SWITCH in given:
        return dict(params)
    return {**params, _TORQUE_SWITCH: 1.0}


def in_order(drives: tuple[Signals, ...]) -> tuple[Signals, ...]:
    """The drives by their dates, else by their first time stamp; in the given order where they overlap, as logs do that
    all start at zero and have no date.

    Raises:
        OncenterError: "no_drive", exit code 2: there is none.
    """
    if not drives:
        raise OncenterError(
            "no drive was given: give at least one from oncenter.read", code="no_drive", exit_code=WRONG_USAGE
        )
    if all(drive.begin_s is not None for drive in drives):
        return tuple(sorted(drives, key=lambda drive: drive.begin_s or 0.0))
    by_time = sorted(drives, key=lambda drive: float(drive.columns["time_s"][0]))
    apart = all(
        float(before.columns["time_s"][-1]) < float(after.columns["time_s"][0]) for before, after in pairwise(by_time)
    )
    return tuple(by_time) if apart else drives


def refuse_two_trucks(drives: Sequence[Signals], events: Sequence[Event] = ()) -> None:
    """
    Raises:
        OncenterError: "different_trucks", exit code 2: two drives have different VINs, and a person did not state
            another truck between them.
    """
    named = [drive for drive in drives if drive.vin is not None and not is_former(drive.begin_s, events)]
    for drive in named:
        if drive.vin == named[0].vin:
            continue
        raise OncenterError(
            f"the logs are of different trucks: {named[0].log} has VIN {named[0].vin}, {drive.log} has VIN "
            f"{drive.vin}; give the logs of one truck, or --each for one answer per log",
            code="different_trucks",
            exit_code=WRONG_USAGE,
        )


_CONTINUES_S = 60.0  # between two logs of one clock: a logger began a new file
# s: between two logs of one drive, in which the ignition was off. A core that goes on has learned what two rows
# do not: half an hour in 20 logs has 2.1 times the half-width of one log, as rows 3.3 times. A truck is loaded
# in longer stops, and a change of the load is better between two rows: a median error of 0.17 deg, not 0.34
# (bench/one_truck.py, pieces; four of its loads, 40 min apart).
_STOP_MAX_S = 1800.0


def continues(before: Signals, log: Signals) -> bool:
    """Whether the log goes on from the one before on the same clock, without an ignition between."""
    return 0.0 < float(log.columns["time_s"][0]) - float(before.columns["time_s"][-1]) < _CONTINUES_S


# s: from the begin of a drive to the end of its last log. The longest shift: 24 h less a reduced daily rest of 9 h
# (Regulation (EC) 561/2006, article 8). A truck that never stands longer has a new drive then.
_DRIVE_MAX_S = 54000.0


def begin_of(log: Signals) -> float:
    """s since 1970; NaN where unknown."""
    return math.nan if log.begin_s is None else log.begin_s


def end_of(log: Signals) -> float:
    return begin_of(log) + log.duration_s


def stop_in_drive(drive: tuple[float, float], log: tuple[float, float], events: Sequence[Event] = ()) -> float:
    """s for which the truck stood between a drive and a log that goes on with it; NaN where it does not: after a longer
    stop or work on the truck, at the end of a shift, or where the logs overlap by more than a rounded second.

    Args:
        drive, log: begin and end, s since 1970; NaN where unknown.
    """
    stop_s = log[0] - drive[1]
    goes_on = -1.0 <= stop_s <= _STOP_MAX_S and log[1] - drive[0] <= _DRIVE_MAX_S
    is_worked_on = any(drive[1] <= event.time_s <= log[0] for event in events)
    return max(stop_s, 0.0) if goes_on and not is_worked_on else math.nan


def check_dates(drives: Sequence[Signals], events: Sequence[Event]) -> None:
    """
    Raises:
        OncenterError: exit code 2: "usage": an event cannot be before or after a log without a date;
            "different_trucks": as `refuse_two_trucks`.
    """
    undated = next((drive for drive in drives if drive.begin_s is None), None)
    if events and undated is not None:
        raise OncenterError(
            f"{undated.log} has no date, so it is unknown whether it is before or after {events[0]}: give logs with "
            "dates, or only those after the event",
            code="usage",
            exit_code=WRONG_USAGE,
        )
    refuse_two_trucks(drives, events)


def without_copies(logs: tuple[Signals, ...]) -> tuple[tuple[Signals, ...], tuple[str, ...]]:
    """The logs without copies and parts of others under another name, which would count twice, and notes on them."""
    if len(logs) < 2:
        return logs, ()
    found = copies([_print_of(log) for log in logs])
    notes = [
        f"{logs[k].log} has the same drive as {logs[whole].log}, or a part of it: it counts once"
        for k, whole in sorted(found.items())
    ]
    return tuple(log for k, log in enumerate(logs) if k not in found), tuple(notes)


def _print_of(log: Signals) -> Print:
    return Print(fingerprint_of(log), log.ticks / log.rate_hz, float(log.columns["time_s"][0]))


def pieces_in(logs: Sequence[Signals], events: Sequence[Event] = ()) -> list[tuple[Signals, ...]]:
    """The logs in order of time, those without an ignition or work on the truck between together."""
    pieces: list[tuple[Signals, ...]] = []
    for log in logs:
        last = pieces[-1][-1] if pieces else None
        worked_on = last is not None and any(begin_of(last) < event.time_s <= begin_of(log) for event in events)
        if last is not None and continues(last, log) and not worked_on:
            pieces[-1] = (*pieces[-1], log)
        else:
            pieces.append((log,))
    return pieces


def needed(method: Method, drives: Sequence[Signals], params: Mapping[str, float]) -> tuple[str, ...]:
    rear = ("rear_axle_angle",) if params[WEIGHT] else ()
    if method == "wheel-speed":
        return ("steering_wheel_angle", *_wheels(_axle(drives)), *rear)
    if params["use_accelerometer"]:
        return (*_NEEDED, "lateral_acceleration", *rear)
    torque = ("steering_wheel_torque",) if params[_TORQUE_SWITCH] and method == "joint" else ()
    return (*_NEEDED, *torque, *rear)


def _wheels(axle: str) -> tuple[str, str]:
    return f"wheel_speed_{axle}_left", f"wheel_speed_{axle}_right"


def _axle(drives: Sequence[Signals]) -> str:
    """The first axle with both wheel speeds in all drives; the first of all where there is none."""

    def has_both(axle: str) -> bool:
        return all(SIGNALS[wheel].column in drive.columns for drive in drives for wheel in _wheels(axle))

    return next(filter(has_both, _AXLES), _AXLES[0])


def track_widths(vehicle: Vehicle, method: Method, drives: Sequence[Signals]) -> dict[str, float]:
    """The core's track widths, 0 where not given; for method wheel-speed only that of the axle in use."""
    widths = {"front": vehicle.track_width_front_m or 0.0, "rear": vehicle.track_width_rear_m or 0.0}
    if method == "wheel-speed":
        axle = _axle(drives)
        if widths[axle] == 0.0:
            raise OncenterError(
                f"method 'wheel-speed' needs 'track_width_{axle}_m' in the vehicle file",
                code="track_width",
                exit_code=WRONG_USAGE,
                needs=(f"track_width_{axle}_m",),
            )
        if axle == "front":
            widths["rear"] = 0.0
    return {f"track_width_{axle}_m": width for axle, width in widths.items()}


def without_contradicted_statuses(
    drives: Sequence[Signals],
) -> tuple[tuple[Signals, ...], tuple[Finding, ...]]:
    """The drives without the statuses that they contradict, and the warnings about them."""
    judged = [without_contradicted(drive) for drive in drives]
    return tuple(drive for drive, _ in judged), tuple(dict.fromkeys(each for _, found in judged for each in found))


def without_unfit_wheels(
    drives: Sequence[Signals], vehicle: Vehicle
) -> tuple[tuple[Signals, ...], tuple[Finding, ...]]:
    """The drives without the wheel speeds that contradict the yaw rate, and the warnings about them."""
    judged = [without_unfit_axles(drive, vehicle) for drive in drives]
    findings = dict.fromkeys(unfit.finding for _, found in judged for unfit in found)
    return tuple(drive for drive, _ in judged), tuple(findings)


def check_without(unfit: Sequence[Finding], drives: Sequence[Signals], needed: Sequence[str], vehicle: Vehicle) -> None:
    """Checks as `check`; the error for a missing signal names the wheel speeds that were left out."""
    try:
        check(drives, needed, vehicle)
    except OncenterError as error:
        if error.code != "missing_signal" or not unfit:
            raise
        why = "; ".join(finding.text.partition(". ")[0] for finding in unfit)  # what was observed: no offset follows
        raise OncenterError(f"{error}; {why}", code=error.code, needs=error.needs) from None


def check(drives: Sequence[Signals], needed: Sequence[str], vehicle: Vehicle) -> None:
    for drive in drives:
        _require(drive, needed, drives, vehicle)
        if abs(drive.rate_hz / drives[0].rate_hz - 1) > RATES_ALIKE:
            raise OncenterError(
                f"{drive.log} has {drive.rate_hz:g} Hz and {drives[0].log} has {drives[0].rate_hz:g} Hz: "
                "logs in one call must have one rate; answer them one by one",
                code="rates_differ",
                exit_code=WRONG_USAGE,
            )


def _require(drive: Signals, needed: Sequence[str], drives: Sequence[Signals], vehicle: Vehicle) -> None:
    """Refuses a drive that lacks a signal; the message names a method that does not need it."""
    from oncenter.read import require

    try:
        require(drive, needed, vehicle)
    except OncenterError as error:
        instead = _instead(drives, error.needs)
        if not instead:
            raise
        raise OncenterError(f"{error}; {instead}", code=error.code, needs=error.needs) from None


def _instead(drives: Sequence[Signals], missing: Sequence[str]) -> str:
    """The way to answer all drives without them; empty where there is none."""
    if tuple(missing) == ("lateral_acceleration",):
        return (
            "without an accelerometer, use --no-accelerometer, or use_accelerometer = 0 in [params] of the vehicle file"
        )
    axle = _axle(drives)
    columns = {SIGNALS[wheel].column for wheel in _wheels(axle)}
    if "steering_wheel_angle" in missing or not all(columns <= set(drive.columns) for drive in drives):
        return ""
    return f"with its wheel speeds, use --method wheel-speed and give track_width_{axle}_m in the vehicle file"
