"""Which logs are one drive: a core goes on from one log to the next, with an ignition between."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from oncenter import _core
from oncenter.estimates.estimates import Method
from oncenter.offset.inputs import begin_of, continues, end_of, pieces_in, stop_in_drive, track_widths
from oncenter.plausibility.signal_fault import has_signal_fault
from oncenter.signals import DEGREE, Signals
from oncenter.truck.events import Event
from oncenter.truck.row import Row
from oncenter.vehicle import Vehicle, core_of

_ROWS_AT_ONCE = 1_000_000  # between two reports of progress
# A log that goes on with a drive. Of 1,600 logs of 18 trucks that nobody touched (bench/one_truck.py, pieces) none
# moves the offset by two sd, and one in 25 makes it 1.5 times less certain; of logs after a change of 4 deg, where the
# offset was identified to 1 deg, four in five do.
_CONTRADICTS_SDS, _BETWEEN_LOGS_SD, _LESS_CERTAIN = 2.0, 0.2 * DEGREE, 1.5


class Past(NamedTuple):
    """The truck before these drives: rows of other drives, and events that a person stated. `has_short_stops`: a log
    soon after a drive goes on with it."""

    rows: tuple[Row, ...] = ()
    events: tuple[Event, ...] = ()
    has_short_stops: bool = True


NO_PAST = Past()


class Course(NamedTuple):
    """A core on a drive: its logs, and its answer at the end of each; the row of the drive's logs of former calls, and
    the answer after those. `is_closed`: it contradicts the drive before, and no log goes on with it, so that the logs
    after a change are several drives, which decide together."""

    core: _core.Core
    logs: tuple[Signals, ...] = ()
    ends: tuple[_core.OcAnswer, ...] = ()
    former: Row | None = None
    before: _core.OcAnswer | None = None
    is_closed: bool = False

    @property
    def span(self) -> tuple[float, float]:
        """Begin and end, s since 1970."""
        if self.former is None:
            return begin_of(self.logs[0]), end_of(self.logs[-1])
        end_s = end_of(self.logs[-1]) if self.logs else self.former.start_s + self.former.length_s
        return self.former.start_s, end_s

    def is_spoilt(self, before: Course) -> bool:
        """Whether the logs since then contradict it or make it less certain, or a signal is at fault: the truck's model
        decides on a change between two drives, since a sensor may have another zero at each start."""
        was, now = before.ends[-1] if before.ends else before.before, self.ends[-1]
        assert was is not None
        sds = was["offset_parts"]["drive_sd"], now["offset_parts"]["drive_sd"]
        moved = abs(now["offset"]["value"] - was["offset"]["value"])
        contradicts = moved > _CONTRADICTS_SDS * math.hypot(*sds, _BETWEEN_LOGS_SD)
        is_less_certain = sds[1] > _LESS_CERTAIN * sds[0]
        was_usable, is_usable = (_core.status_of(each["offset"]) in ("valid", "converging") for each in (was, now))
        is_worse = was_usable and (not is_usable or contradicts or is_less_certain)
        return is_worse or any(map(has_signal_fault, self.ends[len(before.ends) :]))


def courses_of(
    logs: tuple[Signals, ...],
    vehicle: Vehicle,
    params: Mapping[str, float],
    method: Method,
    past: Past,
    progress: Callable[[float], None] | None,
) -> list[Course]:
    """One for each drive. A log soon after a drive, of these logs or of the past, goes on with it."""
    widths, done = track_widths(vehicle, method, logs), 0
    rows = sum(log.ticks for log in logs)

    def report(ticks: int) -> None:
        nonlocal done
        done += ticks
        if progress is not None:
            progress(min(done / rows, 1.0))

    def core_at(rate_hz: float) -> _core.Core:
        return core_of(vehicle, rate_hz, method=method, params=params, track_widths=widths)

    courses: list[Course] = []
    for piece in pieces_in(logs, past.events) if method == "joint" else [logs]:
        begun = _begun(piece, courses[-1:], past, core_at) if past.has_short_stops else None
        course = None if begun is None else _further(begun, piece, report)
        if begun is None or course is None or course.is_spoilt(begun):
            alone = Course(core_at(piece[0].rate_hz), is_closed=begun is not None)
            course = _further(alone, piece, report)
        if courses and course.logs[0] is courses[-1].logs[0]:
            courses.pop()
        courses.append(course)
    return courses


def _begun(
    piece: Sequence[Signals], last: Sequence[Course], past: Past, core_at: Callable[[float], _core.Core]
) -> Course | None:
    """The drive with which these logs go on, after an ignition; None where they begin one."""
    span = begin_of(piece[0]), end_of(piece[-1])
    for course in last:
        stop_s = stop_in_drive(course.span, span, past.events)
        if stop_s >= 0.0 and not course.is_closed and not has_signal_fault(course.ends[-1]):
            core = core_at(course.logs[0].rate_hz)
            core.copy_state_from(course.core)
            core.restart(stop_s)
            return course._replace(core=core)
    for row in past.rows:
        stop_s = stop_in_drive((row.start_s, row.start_s + row.length_s), span, past.events)
        if not (row.image and stop_s >= 0.0):
            continue
        core = core_at(piece[0].rate_hz)
        if core.restore(row.image)[0] == "ok":  # else of another truck or rate
            before = core.answer()
            core.restart(stop_s)
            return Course(core, former=row, before=before)
    return None


def _further(course: Course, piece: tuple[Signals, ...], report: Callable[[int], None]) -> Course:
    ends = _run(course.core, piece, None, report)
    return course._replace(logs=(*course.logs, *piece), ends=(*course.ends, *ends))


def outputs_over(
    logs: tuple[Signals, ...], vehicle: Vehicle, params: Mapping[str, float], method: Method
) -> npt.NDArray[np.void]:
    """Of one drive."""
    outputs = np.zeros(sum(log.ticks for log in logs), _core.OUTPUT_DTYPE)
    widths = track_widths(vehicle, method, logs)
    core = core_of(vehicle, logs[0].rate_hz, method=method, params=params, track_widths=widths)
    _run(core, logs, outputs, lambda ticks: None)
    return outputs


def _run(
    core: _core.Core,
    logs: Sequence[Signals],
    outputs: npt.NDArray[np.void] | None,
    report: Callable[[int], None],
) -> list[_core.OcAnswer]:
    """Runs the core over all logs; returns its answer at the end of each. Fills `outputs`, one row per tick, when
    given. Between two logs that do not continue each other the ignition was off."""
    done = 0
    ends = []
    for before, drive in zip((None, *logs), logs, strict=False):
        if before is not None and not continues(before, drive):
            stop_s = begin_of(drive) - end_of(before)
            core.restart(stop_s if stop_s > 0.0 else 0.0)
        columns = {name: drive.columns[name] for name in _core.COLUMNS if name in drive.columns}
        for start in range(0, drive.ticks, _ROWS_AT_ONCE):
            part = {name: column[start : start + _ROWS_AT_ONCE] for name, column in columns.items()}
            count = len(part["time_s"])
            core.run(part, None if outputs is None else outputs[done : done + count])
            done += count
            report(count)
        ends.append(core.answer())
    return ends
