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
from oncenter.offset.inputs import (
    begin_of,
    check_dates,
    check_without,
    continues,
    drives_in,
    in_order,
    is_short,
    needed,
    params_of,
    pieces_in,
    stop_between,
    track_widths,
    with_torque,
    without_copies,
    without_unfit_wheels,
)
from oncenter.offset.rear_axle import rear_axle_findings, with_fitting_bends, with_offsets_of_both_axles, with_rear_axle
from oncenter.offset.signal_fault import without_estimates
from oncenter.offset.signals_at_fault import without_faulty_estimates
from oncenter.offset.unknown_truck import SIDE_FORCE, lacks_axles, sd_by_layout, with_fitted_product
from oncenter.offset.vehicle_file import far_off, fitted_vehicle, size_of_angle
from oncenter.plausibility.check_result import NO_OFFSET
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

_ROWS_AT_ONCE = 1_000_000  # between two reports of progress
_PASSES_MAX = 4  # over the logs of an unknown truck; one more is nearly always enough
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
    progress: Callable[[float], None] | None = None,
) -> Answer:
    """The steering wheel angle offset from one drive, or from several of one truck.

    Args:
        signals: from `oncenter.read` or `oncenter.simulate`; several are put in order of time. The joint method answers
            each drive alone and combines the drives since the last change of the offset. Logs with stops of half an
            hour at most between are one drive.
        vehicle: from `oncenter.vehicle`, or the path of its file; its `[params]` apply. Without it, or without its
            wheelbase or steering ratio, the joint method estimates the product of both.
        method: "joint", offset, understeer gradient, play and gyro bias together; "thesis", (36) to (38) of
            docs/method.md; "wheel-speed", the same from the angle and the wheel speeds of one axle (the rear one
            where the log has it), whose track width the vehicle file must give.
        params: override the vehicle's; names and units as in core/truck/params.h.
        before: `Answer.rows` of other drives of this truck, answered with the same vehicle and params; of the joint
            method. The answer is the truck's by all drives. The first of these drives goes on with the last of those
            where the truck stood for half an hour at most; its row is then that of both.
        events: what a person states of the truck, see `oncenter.truck.events`; of the joint method.
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
    given = {**vehicle.params, **core_params(params or {})}
    used_params = with_torque(params_of(vehicle, params), given, method, recorded)
    used_params = with_rear_axle(used_params, method, recorded)
    used_params = with_coarse_yaw_rate(used_params, given, yaw_rate_step_of(recorded))
    drives, unfit = without_unfit_wheels(recorded, vehicle)
    names = needed(method, drives, used_params)
    check_without(unfit, drives, names, vehicle)
    past = _Past(tuple(before), tuple(events))
    answer = _of_all(without_whole_turns(drives), vehicle, used_params, method, past, progress)
    answer = with_fitting_bends(with_offsets_of_both_axles(answer), recorded)
    return replace(
        answer,
        findings=(
            *answer.findings,
            *rear_axle_findings(answer, recorded),
            *unfit,
            *_recording(recorded, names, vehicle),
        ),
        notes=(*answer.notes, *of_copies),
    )


def _of_all(
    logs: tuple[Signals, ...],
    vehicle: Vehicle,
    params: Mapping[str, float],
    method: Method,
    past: _Past,
    progress: Callable[[float], None] | None,
) -> Answer:
    """The answer with the wheelbase that fits where the file's is wrong."""
    result = _result(logs, vehicle, params, method, past, progress)
    if method != "joint":
        return _whole(result, vehicle, method, params)
    if vehicle.assumed:
        return _of_unknown(result, logs, vehicle, params, past)
    fitted = fitted_vehicle(
        result.native, logs, vehicle, params, lambda other: _result(logs, other, params, method, _NO_PAST, None).native
    )
    if fitted is None:
        return _whole(result, vehicle, method, params)
    factor = size_of_angle(fitted, vehicle)
    if factor is not None:
        answer = _whole(result, vehicle, method, params)
        fault = SignalFault("scale", ("steering_wheel_angle", "yaw_rate"), factor, answer.sources, vehicle)
        return without_estimates(answer, fault)
    answer = _whole(_result(logs, fitted, params, method, past, None), fitted, method, params)
    return replace(answer, findings=(far_off(fitted, vehicle), *answer.findings))


def _of_unknown(
    result: _Result, logs: tuple[Signals, ...], vehicle: Vehicle, params: Mapping[str, float], past: _Past
) -> Answer:
    """The answer of further passes with the ratio times wheelbase that the drives show."""
    for _ in range(_PASSES_MAX - 1):
        fitted = with_fitted_product(result.native, vehicle, params)
        if fitted is None:
            break
        vehicle, result = fitted, _result(logs, fitted, params, "joint", past, None)
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


class _Past(NamedTuple):
    """The truck before these drives: rows of other drives, and what a person stated."""

    rows: tuple[Row, ...] = ()
    events: tuple[Event, ...] = ()


_NO_PAST = _Past()


class _Run(NamedTuple):
    """One drive: the core's answer, wider for a coarse recording, the changes in it, its logs, and the core; `former`
    is the row of the same drive's former logs. `had_fault`: a signal was at fault at the end of one of the logs."""

    native: _core.OcAnswer
    changes: tuple[Change, ...]
    coarse: Coarseness
    logs: Sequence[Signals]
    core: _core.Core
    former: Row | None = None
    had_fault: bool = False

    def row(self, vehicle: Vehicle, params: Mapping[str, float]) -> Row:
        """The drive as evidence on its truck."""
        moved = [change for change in self.changes if change.size_rad is not None]
        size = sum(change.size_rad or 0.0 for change in moved)
        sd = math.hypot(*(change.sd_rad or 0.0 for change in moved))
        start_s, names = begin_of(self.logs[0]), tuple(log.log for log in self.logs)
        if self.former is not None:
            start_s, names = self.former.start_s, (*self.former.logs, *names)
            size, sd = size + self.former.moved, math.hypot(sd, self.former.moved_sd)
        length_s = begin_of(self.logs[-1]) + self.logs[-1].duration_s - start_s
        return row_of(
            self.core,
            self.native,
            vehicle,
            params,
            start_s=start_s,
            length_s=self.native["duration"] if math.isnan(length_s) else length_s,
            moved=(size, sd),
            logs=names,
        )


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
    past: _Past,
    progress: Callable[[float], None] | None,
) -> _Result:
    """By the joint method each drive is answered alone, and the truck's model combines them."""
    drives = drives_in(logs, past.events) if method == "joint" else (logs,)
    runs = _runs_over(drives[0], vehicle, params, method, progress, past)
    for drive in drives[1:]:
        runs += _runs_over(drive, vehicle, params, method, progress)
    rows = [row for row in past.rows if row is not runs[0].former]
    fit = [run for run in runs if not has_signal_fault(run.native)] or runs[-1:]
    left_out = tuple(_left_out(run.native, run.logs, vehicle) for run in runs if not any(run is each for each in fit))
    if len(fit) == 1 and not rows:
        return _Result(*fit[0][:3], tuple(fit[0].logs), fit, left_out=left_out)
    from oncenter.offset.several_logs import Drive, changes_of_all, combined  # late: one log needs no model

    answered = [Drive(run.row(vehicle, params), tuple(run.logs), run.native, run.changes) for run in fit]
    together = combined([*map(Drive, rows), *answered], params, past.events)
    since = tuple(log for drive in together.drives for log in drive.logs) or answered[-1].logs
    return _Result(together.native, changes_of_all(together), coarseness_of(since), since, fit, together, left_out)


def _offset_by(result: _Result, vehicle: Vehicle, params: Mapping[str, float]) -> OffsetBy | None:
    """The offset of this result by other priors: the same evidence, its equations solved anew."""
    if result.together is not None and result.together.truck is not None:
        return result.together.by(params, result.layout_sd)
    one = result.runs[0] if result.together is None else max(result.runs, key=lambda run: run.native["used"])
    other = core_of(vehicle, one.logs[0].rate_hz, params=params)
    native = widened(one.core.answer_by(other), one.coarse, "joint", params)
    return offset_by(_wider(native, result.layout_sd))


def _left_out(native: _core.OcAnswer, logs: Sequence[Signals], vehicle: Vehicle) -> Finding:
    """The fault of a signal in one drive of several, which the answer is without."""
    fault = finding_of(signal_fault(native, logs, vehicle))
    names = ", ".join(Path(log.log).name for log in logs)
    text = fault.text.replace(f"{NO_OFFSET}.", "The offset is estimated without this log.")
    return replace(fault, severity="warning", text=f"{names}: {text}")


def _runs_over(
    logs: tuple[Signals, ...],
    vehicle: Vehicle,
    params: Mapping[str, float],
    method: Method,
    progress: Callable[[float], None] | None,
    past: _Past = _NO_PAST,
) -> list[_Run]:
    """One drive, which may go on with one of the past; a signal fault in one of its logs spoils only that log."""
    run, parts = _run_over(logs, vehicle, params, method, progress, past), pieces_in(logs)
    if not run.had_fault or (len(parts) == 1 and run.former is None):
        return [run]
    return [_run_over(part, vehicle, params, method, None) for part in parts]


def _run_over(
    logs: Sequence[Signals],
    vehicle: Vehicle,
    params: Mapping[str, float],
    method: Method,
    progress: Callable[[float], None] | None,
    past: _Past = _NO_PAST,
) -> _Run:
    core, former = _begun(logs, vehicle, params, method, past)
    found_before = 0 if former is None else core.answer()["changes"]
    ends = _run(core, logs, progress, None)
    coarse = coarseness_of(logs)
    native = widened(core.answer(), coarse, method, params)
    if native["yaw_rate_bias_alarm_time"] > 0.0:
        native["yaw_rate_bias_moved"] = _bias_moved(_begun(logs, vehicle, params, method, past)[0], logs)
    changes = changes_of(native, [end["changes"] for end in ends], logs, found_before)
    return _Run(native, changes, coarse, logs, core, former, any(map(has_signal_fault, ends)))


def _bias_moved(core: _core.Core, logs: Sequence[Signals]) -> float:
    """By a second run with the outputs of all ticks: few drives have an alarm."""
    outputs, course = np.zeros(sum(log.ticks for log in logs), _core.OUTPUT_DTYPE), BiasCourse()
    _run(core, logs, None, outputs)
    course.take(outputs)
    return course.moved_rad_s


def _whole(result: _Result, vehicle: Vehicle, method: Method, params: Mapping[str, float]) -> Answer:
    native, logs = result.native, result.logs
    answer = answer_of(native, result.changes, logs, vehicle, method, params)
    if has_signal_fault(native) and answer.sensor_fault == "none":
        return replace(answer, findings=(*answer.findings, *result.left_out))
    moves = answer.zero == "moves" or answer.sensor_fault in _MAY_BE_ANOTHER_SIGNAL
    if method == "joint" and answer.offset.value is not None:
        answer = replace(answer, by_priors=tuple(by_priors(lambda other: _offset_by(result, vehicle, other), params)))
    answer = without_faulty_estimates(answer, contradicts=moves or is_implausible(native))
    found = coarse_recording_findings(native, result.coarse, method)
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
    """The core's output at each tick of an answer: oc_output, one row per row of all its drives, in order."""
    drives = drives_in(answer.drives) if answer.method == "joint" else (answer.drives,)
    outputs = []
    for logs in drives:
        outputs.append(np.zeros(sum(log.ticks for log in logs), _core.OUTPUT_DTYPE))
        _run(_begun(logs, answer.vehicle, answer.params, answer.method)[0], logs, None, outputs[-1])
    return np.concatenate(outputs)


def _begun(
    logs: Sequence[Signals], vehicle: Vehicle, params: Mapping[str, float], method: Method, past: _Past = _NO_PAST
) -> tuple[_core.Core, Row | None]:
    """A core before these logs, and the row of the same drive's former logs, with which it goes on after an ignition.
    A core with another truck or rate cannot go on with it."""
    widths = track_widths(vehicle, method, logs)
    core = core_of(vehicle, logs[0].rate_hz, method=method, params=params, track_widths=widths)
    for row in past.rows:
        stop_s = stop_between(row.start_s + row.length_s, begin_of(logs[0]), past.events)
        if row.image and is_short(stop_s) and core.restore(row.image)[0] == "ok":
            core.restart(stop_s)
            return core, row
    return core, None


def _run(
    core: _core.Core,
    logs: Sequence[Signals],
    progress: Callable[[float], None] | None,
    outputs: npt.NDArray[np.void] | None,
) -> list[_core.OcAnswer]:
    """Runs the core over all logs; returns its answer at the end of each. Fills `outputs`, one row per tick, when
    given. Between two logs that do not continue each other the ignition was off."""
    rows = sum(log.ticks for log in logs)
    done = 0
    ends = []
    for before, drive in zip((None, *logs), logs, strict=False):
        if before is not None and not continues(before, drive):
            stop_s = begin_of(drive) - begin_of(before) - before.duration_s
            core.restart(stop_s if stop_s > 0.0 else 0.0)
        columns = {name: drive.columns[name] for name in _core.COLUMNS if name in drive.columns}
        for start in range(0, drive.ticks, _ROWS_AT_ONCE):
            part = {name: column[start : start + _ROWS_AT_ONCE] for name, column in columns.items()}
            count = len(part["time_s"])
            core.run(part, None if outputs is None else outputs[done : done + count])
            done += count
            if progress is not None:
                progress(done / rows)
        ends.append(core.answer())
    return ends
