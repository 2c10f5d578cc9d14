"""From signals, vehicle and params to an answer and its outputs: one run of the core per drive."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from oncenter import _core
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.estimates.by_priors import OffsetBy, by_priors
from oncenter.estimates.cause import by_layout
from oncenter.estimates.changes import Change, changes_of
from oncenter.estimates.estimates import DEFAULT_METHOD, METHODS, Method
from oncenter.findings import Finding
from oncenter.offset.answer import Answer
from oncenter.offset.assemble import answer_of, offset_by
from oncenter.offset.bias_course import BiasCourse
from oncenter.offset.coarse_recording import (
    Coarseness,
    coarse_recording_findings,
    coarseness_of,
    widened,
    with_coarse_yaw_rate,
    yaw_rate_step_of,
)
from oncenter.offset.course import NO_PAST, Course, Past, courses_of, outputs_over
from oncenter.offset.inputs import (
    check_dates,
    check_without,
    in_order,
    needed,
    params_of,
    with_torque,
    without_contradicted_statuses,
    without_copies,
    without_unfit_wheels,
)
from oncenter.offset.rear_axle import rear_axle_findings, with_fitting_bends, with_offsets_of_both_axles, with_rear_axle
from oncenter.offset.signal_fault import without_estimates
from oncenter.offset.signals_at_fault import without_faulty_estimates
from oncenter.offset.stated import without_contradicted, without_inverted_assistance
from oncenter.offset.traffic_side import with_traffic_side
from oncenter.offset.unknown_truck import SIDE_FORCE, lacks_axles, sd_by_layout
from oncenter.offset.vehicle_file import far_off, fitted_vehicle, size_of_angle
from oncenter.plausibility.grid_signals import GridSignals
from oncenter.plausibility.recording import recording_findings
from oncenter.plausibility.reversing import reversing
from oncenter.plausibility.signal_fault import SignalFault, finding_of, has_signal_fault, signal_fault
from oncenter.plausibility.values_left_out import values_left_out
from oncenter.read.whole_turns import without_whole_turns
from oncenter.signals import DEGREE, Signals, drives_of
from oncenter.truck.events import Event
from oncenter.truck.row import Row, row_of
from oncenter.vehicle import JOINT_DOES, UNKNOWN_TRUCK, Vehicle, core_of, core_params, require_truck, vehicle_of

if TYPE_CHECKING:
    from oncenter.offset.several_logs import Together

_GRADIENT_MIN, _GRADIENT_MAX = 0.1 * DEGREE, 1.0 * DEGREE  # rad/(m/s^2): wrong signs and scales are outside
_UNEXPLAINED_MAX = 1.5 * DEGREE  # rad, of a second: several times that of a healthy drive
_MAY_BE_ANOTHER_SIGNAL = ("drifting", "wrong_sign")  # a yaw rate of wrong sign or unit looks like these faults


def offset(
    signals: Signals | Sequence[Signals],
    vehicle: Vehicle | str | os.PathLike[str] | None = None,
    *,
    method: Method = DEFAULT_METHOD,
    params: Mapping[str, float] | None = None,
    before: Sequence[Row] = (),
    events: Sequence[Event] = (),
    short_stops: bool = True,
    progress: Callable[[float], None] | None = None,
) -> Answer:
    """The steering wheel angle offset from one drive, or from several of one truck.

    Args:
        signals: from `oncenter.read` or `oncenter.simulate`; several are put in order of time. The joint method answers
            each drive alone and combines the drives since the last change of the offset. Logs with stops of half an
            hour at most between are one drive.
        vehicle: from `oncenter.vehicle`, or the path of its file; its `[params]` apply. Without it, or without its
            wheelbase or steering ratio, the joint method estimates the product of both. Without its `traffic_side`
            the side is that of the log's positions, else that of the drives in `before`.
        method: "joint", offset, understeer gradient, play and gyro bias together; "thesis", (36) to (38) of
            docs/method.md; "wheel-speed", the same from the angle and the wheel speeds of one axle (the rear one
            where the log has it), whose track width the vehicle file must give.
        params: override the vehicle's; names and units as in core/truck/params.h.
        before: `Answer.rows` of other drives of this truck, answered with the same vehicle and params; of the joint
            method. The answer is the truck's by all drives. The first of these drives goes on with the last of those
            where the truck stood for half an hour at most; its row is then that of both.
        events: what a person states of the truck, see `oncenter.truck.events`; of the joint method.
        short_stops: whether logs with short stops between are one drive; not where their dates are those of files.
        progress: called with the fraction done.

    Raises:
        OncenterError: "missing_signal", "no_usable_second" (exit 1); "method", "params", "rates_differ",
            "track_width", "usage", "not_signals", "not_a_vehicle", "vehicle_file" (exit 2).
    """
    if method not in METHODS:
        raise OncenterError(
            f"method '{method}' does not exist; use one of {', '.join(METHODS)}", code="method", exit_code=WRONG_USAGE
        )
    if events and method != "joint":
        raise OncenterError(f"an event needs method 'joint', got '{method}'", code="usage", exit_code=WRONG_USAGE)
    vehicle = Vehicle(name=UNKNOWN_TRUCK) if vehicle is None else vehicle_of(vehicle, "offset")
    if method != "joint":
        require_truck(vehicle, f"method '{method}'", JOINT_DOES)
    logs = in_order(drives_of(signals, "offset"))
    check_dates(logs, events)
    recorded, of_copies = without_copies(logs)
    vehicle, of_side, side_notes = with_traffic_side(vehicle, recorded, before, events)
    recorded, contradicted = without_contradicted_statuses(recorded)
    given = {**vehicle.params, **core_params(params or {})}
    used_params = with_torque(params_of(vehicle, params), given, method, recorded)
    used_params = with_rear_axle(used_params, method, recorded)
    used_params = with_coarse_yaw_rate(used_params, given, yaw_rate_step_of(recorded))
    drives, unfit = without_unfit_wheels(recorded, vehicle)
    names = needed(method, drives, used_params)
    check_without(unfit, drives, names, vehicle)
    past = Past(tuple(before), tuple(events), short_stops)
    answer = _of_all(without_whole_turns(drives), vehicle, used_params, method, past, progress)
    answer = with_fitting_bends(with_offsets_of_both_axles(answer), recorded)
    return replace(
        answer,
        findings=(
            *answer.findings,
            *rear_axle_findings(answer, recorded),
            *of_side,
            *contradicted,
            *unfit,
            *_recording(recorded, names, vehicle),
        ),
        notes=(*answer.notes, *of_copies, *side_notes),
    )


def _of_all(
    logs: tuple[Signals, ...],
    vehicle: Vehicle,
    params: Mapping[str, float],
    method: Method,
    past: Past,
    progress: Callable[[float], None] | None,
) -> Answer:
    """The answer without what the vehicle file states and the drives contradict."""
    result = _result(logs, vehicle, params, method, past, progress)
    if method != "joint":
        return _whole(result, vehicle, method, params)

    def native_of(some: tuple[Signals, ...], other: Mapping[str, float]) -> _core.OcAnswer:
        return _longest(_result(some, vehicle, other, method, NO_PAST, None)).native

    by_status, inverted = without_inverted_assistance(
        _longest(result).native, logs, lambda some: native_of(some, params)
    )
    if inverted is not None:
        logs, result = by_status, _result(by_status, vehicle, params, method, past, None)
    in_force, contradicted = without_contradicted(
        _longest(result).native, params, vehicle, lambda other: native_of(logs, other)
    )
    if contradicted:
        params, result = in_force, _result(logs, vehicle, in_force, method, past, None)
    answer = _by_fitting_vehicle(result, logs, vehicle, params, past)
    findings = (*(() if inverted is None else (inverted,)), *contradicted, *answer.findings)
    return replace(answer, findings=findings)


def _by_fitting_vehicle(
    result: _Result, logs: tuple[Signals, ...], vehicle: Vehicle, params: Mapping[str, float], past: Past
) -> Answer:
    """The answer with the wheelbase that fits where the file's is wrong."""
    if vehicle.assumed:
        return _of_unknown(result, logs, vehicle, params, past)
    fitted = fitted_vehicle(
        result.native, logs, vehicle, params, lambda other: _result(logs, other, params, "joint", NO_PAST, None).native
    )
    if fitted is None:
        return _whole(result, vehicle, "joint", params)
    factor = size_of_angle(fitted, vehicle)
    if factor is not None:
        answer = _whole(result, vehicle, "joint", params)
        fault = SignalFault("scale", ("steering_wheel_angle", "yaw_rate"), factor, answer.sources, vehicle)
        return without_estimates(answer, fault)
    answer = _whole(_result(logs, fitted, params, "joint", past, None), fitted, "joint", params)
    return replace(answer, findings=(far_off(fitted, vehicle), *answer.findings))


def _of_unknown(
    result: _Result, logs: tuple[Signals, ...], vehicle: Vehicle, params: Mapping[str, float], past: Past
) -> Answer:
    """The answer with the uncertainty by an axle layout that is not given."""
    if not lacks_axles(vehicle, params):
        return _whole(result, vehicle, "joint", params)
    of_one_axle = _result(logs, vehicle, {**params, SIDE_FORCE: 0.0}, "joint", past, None)
    sd = sd_by_layout(result.native, of_one_axle.native)
    by_layout_of = result._replace(native=_wider(result.native, sd), layout_sd=sd)
    answer = _whole(by_layout_of, vehicle, "joint", params)
    if not answer.not_identifiable:
        return answer
    cause = by_layout(sd, answer.offset_per_acceleration)
    return replace(answer, not_identifiable=(*answer.not_identifiable, cause))


def _wider(native: _core.OcAnswer, sd: float) -> _core.OcAnswer:
    wider = native.copy()
    wider["offset"] = wider["offset"].copy()
    wider["offset"]["standard_deviation"] = math.hypot(wider["offset"]["standard_deviation"], sd)
    return wider


class _Run(NamedTuple):
    """One drive: the core's answer, wider for a coarse recording, the changes in it, its logs, and the core."""

    native: _core.OcAnswer
    changes: tuple[Change, ...]
    coarse: Coarseness
    logs: tuple[Signals, ...]
    course: Course

    def row(self, vehicle: Vehicle, params: Mapping[str, float]) -> Row:
        """The drive as evidence on its truck."""
        moved = [change for change in self.changes if change.size_rad is not None]
        size = sum(change.size_rad or 0.0 for change in moved)
        sd = math.hypot(*(change.sd_rad or 0.0 for change in moved))
        names, former = tuple(log.log for log in self.logs), self.course.former
        if former is not None:
            names, size, sd = (*former.logs, *names), size + former.moved, math.hypot(sd, former.moved_sd)
        start_s, end_s = self.course.span
        row = row_of(
            self.course.core,
            self.native,
            vehicle,
            params,
            start_s=start_s,
            length_s=self.native["duration"] if math.isnan(end_s) else end_s - start_s,
            moved=(size, sd),
            logs=names,
        )
        return replace(row, image=b"") if self.course.is_closed else row


class _Result(NamedTuple):
    """The core's answer, the logs that it is of, and the changes in them; of several drives also what only several can
    say. `runs` are of all drives without a signal fault, `layout_sd` (rad) of the offset by unknown axles."""

    native: _core.OcAnswer
    changes: tuple[Change, ...]
    coarse: Coarseness
    logs: tuple[Signals, ...]
    runs: Sequence[_Run]
    together: Together | None = None
    left_out: tuple[Finding, ...] = ()
    layout_sd: float = 0.0


def _result(
    logs: tuple[Signals, ...],
    vehicle: Vehicle,
    params: Mapping[str, float],
    method: Method,
    past: Past,
    progress: Callable[[float], None] | None,
) -> _Result:
    """By the joint method each drive is answered alone, and the truck's model combines them."""
    runs = [
        _answered(course, vehicle, params, method)
        for course in courses_of(logs, vehicle, params, method, past, progress)
    ]
    rows = [row for row in past.rows if not any(row is run.course.former for run in runs)]
    fit = [run for run in runs if not has_signal_fault(run.native)] or runs[-1:]
    left_out = tuple(_left_out(run.native, run.logs, vehicle) for run in runs if not any(run is each for each in fit))
    if len(fit) == 1 and not rows:
        return _Result(*fit[0][:4], fit, left_out=left_out)
    from oncenter.offset.several_logs import Drive, changes_of_all, combined  # late: one log needs no model

    answered: list[Drive] = []
    for run in fit:
        row = _row_of(run, rows, vehicle, params)
        is_part = any(row is each for each in rows)
        answered = [drive for drive in answered if drive.row is not row]
        answered.append(Drive(row, run.logs, run.native, run.changes, is_part))
    rows = [row for row in rows if not any(row is drive.row for drive in answered)]
    together = combined([*map(Drive, rows), *answered], params, past.events)
    since = tuple(log for drive in together.drives for log in drive.logs) or answered[-1].logs
    return _Result(together.native, changes_of_all(together), coarseness_of(since), since, fit, together, left_out)


def _longest(result: _Result) -> _Run:
    return max(result.runs, key=lambda run: run.native["used"])


def _offset_by(result: _Result, vehicle: Vehicle, params: Mapping[str, float]) -> OffsetBy | None:
    """The offset of this result by other priors: the same evidence, its equations solved anew."""
    if result.together is not None and result.together.truck is not None:
        return result.together.by(params, result.layout_sd)
    one = _longest(result)
    other = core_of(vehicle, one.logs[0].rate_hz, params=params)
    native = widened(one.course.core.answer_by(other), one.coarse, "joint", params)
    return offset_by(_wider(native, result.layout_sd))


def _left_out(native: _core.OcAnswer, logs: Sequence[Signals], vehicle: Vehicle) -> Finding:
    """The fault of a signal in one drive of several, which the answer is without."""
    effect = "The offset is estimated without this log"
    fault = finding_of(signal_fault(native, logs, vehicle)._replace(effect=effect))
    names = ", ".join(Path(log.log).name for log in logs)
    return replace(fault, severity="warning", text=f"{names}: {fault.text}")


def _row_of(run: _Run, rows: Sequence[Row], vehicle: Vehicle, params: Mapping[str, float]) -> Row:
    """Of a drive that is a part of a former one, the row of that: its evidence counts once."""
    own = run.row(vehicle, params)
    begin_s, end_s = run.course.span
    whole = (r for r in rows if len(r.logs) > len(own.logs) and {*own.logs} <= {*r.logs})
    return next((r for r in whole if r.start_s - 1.0 <= begin_s and end_s <= r.start_s + r.length_s + 1.0), own)


def _answered(course: Course, vehicle: Vehicle, params: Mapping[str, float], method: Method) -> _Run:
    logs = course.logs
    coarse = coarseness_of(logs)
    native = widened(course.core.answer(), coarse, method, params)
    if native["yaw_rate_bias_alarm_time"] > 0.0:
        native["yaw_rate_bias_moved"] = _bias_moved(course, vehicle, params, method)
    found_before = 0 if course.before is None else course.before["changes"]
    changes = changes_of(native, [end["changes"] for end in course.ends], logs, found_before)
    return _Run(native, changes, coarse, logs, course)


def _bias_moved(course: Course, vehicle: Vehicle, params: Mapping[str, float], method: Method) -> float:
    """By a second run with the outputs of all ticks: few drives have an alarm."""
    outputs, bias = outputs_over(course.logs, vehicle, params, method), BiasCourse()
    bias.take(outputs)
    return bias.moved_rad_s


def _whole(result: _Result, vehicle: Vehicle, method: Method, params: Mapping[str, float]) -> Answer:
    native, logs = result.native, result.logs
    answer = answer_of(native, result.changes, logs, vehicle, method, params)
    if has_signal_fault(native) and answer.sensor_fault == "none":
        return replace(answer, findings=(*answer.findings, *result.left_out))
    moves = answer.zero == "moves" or answer.sensor_fault in _MAY_BE_ANOTHER_SIGNAL
    if method == "joint" and answer.offset.value is not None:
        answer = replace(answer, by_priors=tuple(by_priors(lambda other: _offset_by(result, vehicle, other), params)))
    answer = without_faulty_estimates(answer, contradicts=moves or is_implausible(native))
    found = coarse_recording_findings(native, result.coarse, method, params)
    answer = replace(answer, findings=(*result.left_out, *answer.findings, *found))
    if result.together is None:
        return (
            replace(answer, rows=tuple(run.row(vehicle, params) for run in result.runs))
            if method == "joint"
            else answer
        )
    answer = replace(answer, rows=tuple(drive.row for drive in result.together.every))
    from oncenter.offset.several_logs import with_logs  # late, as above

    return with_logs(answer, result.together)


def _recording(drives: Sequence[Signals], names: Sequence[str], vehicle: Vehicle) -> list[Finding]:
    """Values left out of each recording, its gaps and ends, and reversing; with the log's name where there are more."""
    found = []
    for drive in drives:
        of_log = f"{Path(drive.log).name}: " if len(drives) > 1 else ""
        grid = GridSignals(drive, vehicle)
        reverses = reversing(grid.seems_to_reverse, grid.step_s, grid.has("reverse"))
        of_drive = [*values_left_out(drive, names), *recording_findings(drive, names), reverses]
        found += [replace(each, text=of_log + each.text) for each in of_drive if each is not None]
    return found


def is_implausible(native: _core.OcAnswer) -> bool:
    """Whether an oc_answer fits hardly any truck: its gradient is not that of a truck, or its angle is unexplained."""
    gradient = native["understeer_gradient"]
    at_most = gradient["value"] + 2.0 * gradient["standard_deviation"]
    beyond = at_most < _GRADIENT_MIN or gradient["value"] > _GRADIENT_MAX
    return bool(beyond or native["unexplained"] > _UNEXPLAINED_MAX)


def outputs_of(answer: Answer) -> npt.NDArray[np.void]:
    """The core's output at each tick of an answer's logs: oc_output, one row per row of all its drives, in order.
    Former drives of a memory are not in it."""
    logs, given = answer.drives, (answer.vehicle, answer.params, answer.method)
    drives = [logs] if len(logs) == 1 else [course.logs for course in courses_of(logs, *given, NO_PAST, None)]
    return np.concatenate([outputs_over(drive, *given) for drive in drives])
