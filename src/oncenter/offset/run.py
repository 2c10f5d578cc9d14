"""Signals, vehicle and params become an answer and its trace: one run of the core per drive."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from oncenter import _core
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.offset.answer import DEFAULT_METHOD, METHODS, Answer, Method
from oncenter.offset.assemble import answer_of
from oncenter.offset.changes import changes_of
from oncenter.offset.inputs import check, in_order, needed, params_of, track_widths
from oncenter.offset.signals_at_fault import without_what_faults_taught
from oncenter.read.whole_turns import without_whole_turns
from oncenter.signals import DEGREE, Signals
from oncenter.vehicle import Vehicle

_ROWS_AT_ONCE = 1_000_000  # between two reports of progress
_DRIVING_M_S = 8.0
_HELD_S, _HELD_RAD = 1.0, 0.25 * DEGREE  # what stays as much the same for so long may be stuck: as core/sensor_fault.c
_GRADIENT_ODD = 0.1 * DEGREE  # rad/(m/s^2): a sensor of the wrong sign has less
_UNEXPLAINED_ODD = 1.5 * DEGREE  # rad, of a second: several times what a healthy one leaves


def offset(
    signals: Signals | Sequence[Signals],
    vehicle: Vehicle,
    *,
    method: Method = DEFAULT_METHOD,
    params: Mapping[str, float] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Answer:
    """The steering wheel angle offset from one drive, or from several of one truck.

    Args:
        signals: what `oncenter.read` or `oncenter.simulate` gave; several are put in order of time.
        vehicle: what `oncenter.vehicle` gave; its `[params]` apply.
        method: "joint", offset, understeer gradient, play and the gyro's bias together; "thesis", (36) to (38) of
            docs/method.md; "wheel-speed", the same from the angle and the wheel speeds of one axle (the rear one's
            where the log has them), whose track width the vehicle must tell.
        params: over the vehicle's; names and units as in core/params.h.
        progress: called with the fraction done.

    Raises:
        OncenterError: "missing_signal", "no_usable_second" (exit 1); "method", "params", "rates_differ",
            "track_width" (exit 2).
    """
    if method not in METHODS:
        raise OncenterError(
            f"method '{method}' is not known; known are {', '.join(METHODS)}", code="method", exit_code=WRONG_USAGE
        )
    drives = in_order((signals,) if isinstance(signals, Signals) else tuple(signals))
    used_params = params_of(vehicle, params)
    check(drives, needed(method, drives, used_params))
    drives = without_whole_turns(drives)
    core, changes_found = _run(drives, vehicle, used_params, method, progress, None)
    native = core.answer()
    if method == "joint" and (is_odd(native) or _is_held_at_the_end(drives[-1])):
        core, found = _run(drives, vehicle, used_params, method, None, None, judge_sensor=True)
        if offset_is_invalid(judged := core.answer()):
            native, changes_found = judged, found
    answer = answer_of(native, changes_of(native, changes_found, drives), drives, vehicle, method, used_params)
    return without_what_faults_taught(answer) if is_of_no_truck(native) else answer


def is_odd(native: Mapping[str, Any]) -> bool:
    """Whether an angle sensor at fault could have given that oc_answer: then it is worth the time to judge it."""
    unsettled = native["changes"] and _core.STATUSES[native["offset"]["status"]] != "valid"
    return bool(unsettled) or is_of_no_truck(native)


def is_of_no_truck(native: Mapping[str, Any]) -> bool:
    """Whether hardly any truck drives as an oc_answer has it: it steers out of bends, or its angle is not explained."""
    gradient = native["understeer_gradient"]
    at_most = gradient["value"] + 2.0 * gradient["standard_deviation"]
    return bool(at_most < _GRADIENT_ODD or native["unexplained"] > _UNEXPLAINED_ODD)


def _is_held_at_the_end(drive: Signals) -> bool:
    """Whether the angle has last said the same while driving, or nothing: what was learned before may well be valid."""
    angle, speed = (drive.table[name].to_numpy() for name in ("steering_wheel_angle_rad", "vehicle_speed_m_s"))
    if np.isnan(angle[-1]):
        return True
    held = speed[len(speed) - _rows_held(angle) :]
    return bool(np.count_nonzero(held > _DRIVING_M_S) / drive.rate_hz > _HELD_S)


def _rows_held(angle: npt.NDArray[np.float64]) -> int:
    """How many of the last rows say the same angle (rad) as the last one; sought from the end, where it moved soon."""
    rows = 100
    while True:
        last = angle[-rows:]
        moved = np.flatnonzero(~(np.abs(last - last[-1]) <= _HELD_RAD))  # or said nothing
        if len(moved):
            return len(last) - 1 - int(moved[-1])
        if rows >= len(angle):
            return len(angle)
        rows *= 8


def offset_is_invalid(native: Mapping[str, Any]) -> bool:
    """Whether an oc_answer says that the sensor is at fault."""
    return bool(_core.STATUSES[native["offset"]["status"]] == "invalid")


def trace(answer: Answer) -> npt.NDArray[np.void]:
    """What each tick of an answer gave: the core's oc_output, one row per row of all its drives, in order."""
    outputs = np.zeros(sum(drive.table.height for drive in answer.drives), _core.OUTPUT_DTYPE)
    judge_sensor = answer.sensor_fault != "none"
    _run(answer.drives, answer.vehicle, answer.params, answer.method, None, outputs, judge_sensor=judge_sensor)
    return outputs


def _run(
    drives: Sequence[Signals],
    vehicle: Vehicle,
    params: Mapping[str, float],
    method: Method,
    progress: Callable[[float], None] | None,
    outputs: npt.NDArray[np.void] | None,
    *,
    judge_sensor: bool = False,
) -> tuple[_core.Core, list[int]]:
    """The core after all drives, and how many changes it had found when each ended; fills `outputs`, one row a tick,
    when given."""
    widths = track_widths(vehicle, method, drives)
    try:
        core = _core.Core(
            vehicle.wheelbase_m,
            vehicle.ratio_near_centre,
            params,
            drives[0].rate_hz,
            method=method,
            angle_method="observer" if judge_sensor else "none",
            traffic_side=vehicle.traffic_sign,
            track_width_front_m=widths["track_width_front_m"],
            track_width_rear_m=widths["track_width_rear_m"],
        )
    except ValueError as error:  # a param that goes with another rate only
        raise OncenterError(str(error), code="params", exit_code=WRONG_USAGE) from None
    rows = sum(drive.table.height for drive in drives)
    done = 0
    changes_found = []
    for drive in drives:
        core.restart()
        columns = {name: drive.table[name].to_numpy() for name in _core.COLUMNS if name in drive.table.columns}
        for start in range(0, drive.table.height, _ROWS_AT_ONCE):
            part = {name: column[start : start + _ROWS_AT_ONCE] for name, column in columns.items()}
            count = len(part["time_s"])
            core.run(part, None if outputs is None else outputs[done : done + count])
            done += count
            if progress is not None:
                progress(done / rows)
        changes_found.append(core.answer()["changes"])
    return core, changes_found
