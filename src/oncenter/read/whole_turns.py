"""A relative steering wheel angle sensor (SPN 1812 = 0) does not know its turn: what ignitions did to it is undone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import polars as pl

from oncenter.signals import Signals

TURN_RAD = 2 * np.pi
_IGNITION_S = 1.0  # without an angle; a shorter silence is a lost message
_JUMP_RAD = TURN_RAD / 4  # from one sample to the next, faster than any hand: 1800 deg/s at 20 Hz
_FAST_M_S = 10.0  # below it bends may need half a turn of the steering wheel
_DRIVING_M_S = 5.0
_STRAIGHT_PER_M = 1.0 / 200.0  # a truck's steering wheel is turned by less than 60 deg
_DRIVEN_S = 0.5  # fast or straight, after which the turn is known
_TOLD = 5  # stretches in the note

_ANGLE, _TYPE = "steering_wheel_angle_rad", "steering_wheel_angle_sensor_type"
_SPEED, _YAW_RATE = "vehicle_speed_m_s", "yaw_rate_rad_s"

Column = npt.NDArray[np.float64]


class WholeTurns:
    """Takes them out of ticks as they come, so that a bus and its log give the same.

    A sensor may be off by another number of whole turns after each ignition, and nobody knows the turn before the truck
    has driven fast or straight: until then the angle is not available. Then it is the turn that brings the usual angle
    nearest to that of the ignitions before, and in the first one nearest to zero. So the angle is right but for a whole
    turn that all ignitions share. Ticks before the sensor said that it is relative stay as they are.

    Attributes:
        relative: whether it has said so.
        turns: taken away now; None while nobody knows.
        taken: time, s, and turns, as they became known.
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
        """What comes next is another drive."""
        self.turns, self._driving = None, np.empty(0)
        self._last_s = self._last_rad = float("nan")

    def taken_out(self, ticks: Mapping[str, Column]) -> Column:
        """The angle of further ticks, rad; they have a time, an angle and a sensor type."""
        time, angle = ticks["time_s"], ticks[_ANGLE]
        said = np.flatnonzero(ticks[_TYPE] == 0.0)
        if not self.relative and not len(said):
            return angle
        begin = 0 if self.relative else int(said[0])
        self.relative = True
        given, telling = angle.copy(), _telling(ticks)
        known = begin + np.flatnonzero(np.isfinite(angle[begin:]))
        if not len(known):
            return given
        jumps = np.abs(np.diff(angle[known], prepend=self._last_rad)) > _JUMP_RAD
        ignitions = np.flatnonzero((np.diff(time[known], prepend=self._last_s) > _IGNITION_S) | jumps)
        for number, rows in enumerate(np.split(known, ignitions)):
            if number:
                self.ignition()
            given[rows] = self._of_one_ignition(time[rows], angle[rows], telling[rows])
        self._last_s, self._last_rad = float(time[known[-1]]), float(angle[known[-1]])
        return given

    def _of_one_ignition(self, time: Column, angle: Column, telling: npt.NDArray[np.bool_]) -> Column:
        first = 0
        if self.turns is None:
            driving = np.flatnonzero(telling)[: self._ticks_driven - len(self._driving)]
            self._driving = np.concatenate((self._driving, angle[driving]))
            if len(self._driving) < self._ticks_driven:
                return np.full(len(angle), np.nan)
            first = int(driving[-1])
            self._know(float(time[first]))
        assert self.turns is not None
        given = angle - self.turns * TURN_RAD
        given[:first] = np.nan
        return given

    def _know(self, time_s: float) -> None:
        usual_rad = float(np.median(self._driving))
        self.turns = round((usual_rad - self._usual_rad) / TURN_RAD)
        self._usual_rad = usual_rad - self.turns * TURN_RAD
        self.taken.append((time_s, self.turns))


def _telling(ticks: Mapping[str, Column]) -> npt.NDArray[np.bool_]:
    """Where the steering wheel cannot be half a turn away. A drive that does not know its speed always drives."""
    if _SPEED not in ticks:
        return np.ones(len(ticks["time_s"]), bool)
    speed = ticks[_SPEED]
    yaw_rate = ticks.get(_YAW_RATE, np.full(len(speed), np.nan))
    straight = (speed > _DRIVING_M_S) & (np.abs(yaw_rate) < _STRAIGHT_PER_M * speed)
    return straight | (speed > _FAST_M_S)


def is_relative(drive: Signals) -> bool:
    """Whether the sensor says of itself that its zero is arbitrary."""
    return _TYPE in drive.table.columns and bool((drive.table[_TYPE] == 0.0).any())


def without_whole_turns(drives: Sequence[Signals]) -> tuple[Signals, ...]:
    """Drives of one truck, in order, in which a relative angle sensor has kept one turn throughout.

    As `WholeTurns` says, ignition by ignition; a note says what was taken away.
    """
    turns: WholeTurns | None = None
    given = []
    for drive in drives:
        if is_relative(drive) and _ANGLE in drive.table.columns:
            turns = turns or WholeTurns(drive.rate_hz)
            given.append(_without(drive, turns))
        else:
            given.append(drive)
    return tuple(given)


def _without(drive: Signals, turns: WholeTurns) -> Signals:
    names = [name for name in ("time_s", _ANGLE, _TYPE, _SPEED, _YAW_RATE) if name in drive.table.columns]
    before = len(turns.taken)
    turns.ignition()
    kept = turns.taken_out({name: drive.table[name].to_numpy() for name in names})
    taken = turns.taken[before:]
    notes = (*drive.notes, _note(drive, taken)) if any(count for _, count in taken) else drive.notes
    return replace(drive, table=drive.table.with_columns(pl.Series(_ANGLE, kept)), notes=notes)


def _note(drive: Signals, taken: Sequence[tuple[float, int]]) -> str:
    first_s = float(drive.table["time_s"][0])
    changes = [k for k in range(len(taken)) if k == 0 or taken[k][1] != taken[k - 1][1]]
    told = [f"{taken[k][1]:+d} from {taken[k][0] - first_s:.0f} s on" for k in changes]
    more = f" and {len(told) - _TOLD} more times" if len(told) > _TOLD else ""
    return (
        f"whole turns were taken from the relative steering wheel angle in {drive.log}: {', '.join(told[:_TOLD])}{more}"
    )
