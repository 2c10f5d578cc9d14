"""Removes whole turns from a relative steering wheel angle (SPN 1812 = 0), which may change at each ignition."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from oncenter.signals import Signals

TURN_RAD = 2 * np.pi
_IGNITION_S = 1.0  # without an angle; a shorter gap is a lost message
_JUMP_RAD = TURN_RAD / 4  # between samples; 1800 deg/s at 20 Hz, faster than any driver
_FAST_M_S = 10.0  # at lower speeds, bends may need half a turn of the steering wheel
_DRIVING_M_S = 5.0
_STRAIGHT_PER_M = 1.0 / 200.0  # below it a truck's steering wheel angle is less than 60 deg
_DRIVEN_S = 0.5  # of fast or straight driving that determine the turn
_NOTED_MAX = 5  # changes in the note

_ANGLE, _TYPE = "steering_wheel_angle_rad", "steering_wheel_angle_sensor_type"
_SPEED, _YAW_RATE = "vehicle_speed_m_s", "yaw_rate_rad_s"

Column = npt.NDArray[np.float64]


class WholeTurns:
    """Removes whole turns from ticks in order, so that a bus and its log give the same result.

    After each ignition the sensor may have another number of whole turns. The number is determined once the truck has
    driven fast or straight; until then the angle is not available (NaN). It is the number that brings the median angle
    of that driving nearest to that of the ignitions before, in the first ignition nearest to zero. The result is
    correct up to one number of whole turns common to all ignitions. Ticks before the sensor reports that it is relative
    stay unchanged.

    Attributes:
        relative: whether the sensor has reported that it is relative.
        turns: now subtracted; None while not determined.
        taken: for each determination, time in s and turns.
    """

    def __init__(self, rate_hz: float) -> None:
        self.relative = False
        self.turns: int | None = None
        self.taken: list[tuple[float, int]] = []
        self._usual_rad = 0.0
        self._ticks_driven = round(_DRIVEN_S * rate_hz)
        self._driving = np.empty(0)
        self._last_s = self._last_rad = float("nan")

    def ignition(self) -> None:
        """The following ticks are another drive."""
        self.turns, self._driving = None, np.empty(0)
        self._last_s = self._last_rad = float("nan")

    def taken_out(self, ticks: Mapping[str, Column]) -> Column:
        """The corrected angle of further ticks, rad; they have a time, an angle and a sensor type."""
        time, angle = ticks["time_s"], ticks[_ANGLE]
        reported = np.flatnonzero(ticks[_TYPE] == 0.0)
        if not self.relative and not len(reported):
            return angle
        begin = 0 if self.relative else int(reported[0])
        self.relative = True
        given, within_half_turn = angle.copy(), _is_within_half_turn(ticks)
        valid = begin + np.flatnonzero(np.isfinite(angle[begin:]))
        if not len(valid):
            return given
        jumps = np.abs(np.diff(angle[valid], prepend=self._last_rad)) > _JUMP_RAD
        ignitions = np.flatnonzero((np.diff(time[valid], prepend=self._last_s) > _IGNITION_S) | jumps)
        for number, rows in enumerate(np.split(valid, ignitions)):
            if number:
                self.ignition()
            given[rows] = self._of_one_ignition(time[rows], angle[rows], within_half_turn[rows])
        self._last_s, self._last_rad = float(time[valid[-1]]), float(angle[valid[-1]])
        return given

    def _of_one_ignition(self, time: Column, angle: Column, within_half_turn: npt.NDArray[np.bool_]) -> Column:
        first = 0
        if self.turns is None:
            driving = np.flatnonzero(within_half_turn)[: self._ticks_driven - len(self._driving)]
            self._driving = np.concatenate((self._driving, angle[driving]))
            if len(self._driving) < self._ticks_driven:
                return np.full(len(angle), np.nan)
            first = int(driving[-1])
            self._determine(float(time[first]))
        assert self.turns is not None
        given = angle - self.turns * TURN_RAD
        given[:first] = np.nan
        return given

    def _determine(self, time_s: float) -> None:
        usual_rad = float(np.median(self._driving))
        self.turns = round((usual_rad - self._usual_rad) / TURN_RAD)
        self._usual_rad = usual_rad - self.turns * TURN_RAD
        self.taken.append((time_s, self.turns))


def _is_within_half_turn(ticks: Mapping[str, Column]) -> npt.NDArray[np.bool_]:
    """Whether the true angle is certainly below half a turn: fast or straight. Without a speed: everywhere."""
    if _SPEED not in ticks:
        return np.ones(len(ticks["time_s"]), bool)
    speed = ticks[_SPEED]
    yaw_rate = ticks.get(_YAW_RATE, np.full(len(speed), np.nan))
    straight = (speed > _DRIVING_M_S) & (np.abs(yaw_rate) < _STRAIGHT_PER_M * speed)
    return straight | (speed > _FAST_M_S)


def is_relative(drive: Signals) -> bool:
    """Whether the sensor reports that its zero is arbitrary."""
    return _TYPE in drive.columns and bool((drive.columns[_TYPE] == 0.0).any())


def without_whole_turns(drives: Sequence[Signals]) -> tuple[Signals, ...]:
    """Drives of one truck, in order, with whole turns removed from a relative angle as `WholeTurns` does.

    A note says what was subtracted.
    """
    turns: WholeTurns | None = None
    given = []
    for drive in drives:
        if is_relative(drive) and _ANGLE in drive.columns:
            turns = turns or WholeTurns(drive.rate_hz)
            given.append(_without(drive, turns))
        else:
            given.append(drive)
    return tuple(given)


def _without(drive: Signals, turns: WholeTurns) -> Signals:
    names = [name for name in ("time_s", _ANGLE, _TYPE, _SPEED, _YAW_RATE) if name in drive.columns]
    before = len(turns.taken)
    turns.ignition()
    kept = turns.taken_out({name: drive.columns[name] for name in names})
    taken = turns.taken[before:]
    notes = (*drive.notes, _note(drive, taken)) if any(count for _, count in taken) else drive.notes
    columns = {**drive.columns, _ANGLE: kept}
    return drive.replaced(columns, notes=notes)


def _note(drive: Signals, taken: Sequence[tuple[float, int]]) -> str:
    first_s = float(drive.columns["time_s"][0])
    changes = [k for k in range(len(taken)) if k == 0 or taken[k][1] != taken[k - 1][1]]
    listed = [f"{taken[k][1]:+d} from {taken[k][0] - first_s:.0f} s on" for k in changes]
    more = f" and {len(listed) - _NOTED_MAX} more times" if len(listed) > _NOTED_MAX else ""
    return (
        f"the angle sensor is relative: whole turns were subtracted from the angle in {drive.log}: "
        f"{', '.join(listed[:_NOTED_MAX])}{more}"
    )
