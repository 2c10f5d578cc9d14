"""A relative steering wheel angle sensor (SPN 1812 = 0) does not know its turn: what ignitions did to it is undone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import polars as pl

from oncenter.signals import Signals

_TURN_RAD = 2 * np.pi
_IGNITION_S = 1.0  # without an angle; a shorter silence is a lost message
_JUMP_RAD = _TURN_RAD / 4  # from one sample to the next, faster than any hand: 1800 deg/s at 20 Hz
_DRIVING_M_S = 10.0  # below it wheels are turned by more than half a turn of the steering wheel
_DRIVEN_S = 1.0  # at that speed, after which a stream's turn is known
_TOLD = 5  # stretches in the note

Column = npt.NDArray[np.float64]


@dataclass(frozen=True)
class _Stretch:
    """Rows of one drive within which the sensor kept its turn; `usual_rad` is the median angle, driving if it did."""

    rows: slice
    driving_rows: int
    usual_rad: float


def is_relative(drive: Signals) -> bool:
    """Whether the sensor says of itself that its zero is arbitrary."""
    column = "steering_wheel_angle_sensor_type"
    return column in drive.table.columns and bool((drive.table[column] == 0.0).any())


def without_whole_turns(drives: Sequence[Signals]) -> tuple[Signals, ...]:
    """Drives of one truck in which a relative angle sensor has kept one turn throughout.

    A sensor may be off by another number of whole turns after each ignition: in each stretch without one, as many are
    taken away as bring its usual angle nearest to that of the longest stretch of all, and this one nearest to zero. So
    the angle is right but for a whole turn that all stretches share. A note says what was taken away.
    """
    stretches = [_stretches(drive) if is_relative(drive) else [] for drive in drives]
    longest = max((s for of_drive in stretches for s in of_drive), key=lambda s: s.driving_rows, default=None)
    if longest is None:
        return tuple(drives)
    usual_rad = longest.usual_rad - _TURN_RAD * round(longest.usual_rad / _TURN_RAD)
    return tuple(_brought_near(drive, found, usual_rad) for drive, found in zip(drives, stretches, strict=True))


class TurnsOfStream:
    """The same for ticks as they come: the angle is not available until the truck has driven for a second after each
    ignition, since nobody knows the turn before; then it is the turn that brings the usual angle nearest to zero.

    Attributes:
        turns: taken away now; None while nobody knows.
    """

    def __init__(self, rate_hz: float) -> None:
        self.turns: int | None = None
        self._ticks_driven = round(_DRIVEN_S * rate_hz)
        self._driving: list[float] = []
        self._last_s = self._last_rad = float("nan")

    def taken_out(self, time: Column, angle: Column, speed: Column) -> Column:
        """The angle of further ticks, rad; all of shape (n,), s, rad and m/s."""
        given = np.full_like(angle, np.nan)
        for k in np.flatnonzero(np.isfinite(angle)).tolist():
            if time[k] - self._last_s > _IGNITION_S or abs(angle[k] - self._last_rad) > _JUMP_RAD:
                self.turns, self._driving = None, []
            self._last_s, self._last_rad = float(time[k]), float(angle[k])
            if self.turns is None:
                self._look(float(angle[k]), float(speed[k]))
            if self.turns is not None:
                given[k] = angle[k] - self.turns * _TURN_RAD
        return given

    def _look(self, angle: float, speed: float) -> None:
        if speed > _DRIVING_M_S:
            self._driving.append(angle)
        if len(self._driving) >= self._ticks_driven:
            self.turns = round(float(np.median(self._driving)) / _TURN_RAD)


def _stretches(drive: Signals) -> list[_Stretch]:
    time, angle = (drive.table[name].to_numpy() for name in ("time_s", "steering_wheel_angle_rad"))
    known = np.flatnonzero(np.isfinite(angle))
    if not len(known):
        return []
    breaks = (np.diff(time[known]) > _IGNITION_S) | (np.abs(np.diff(angle[known])) > _JUMP_RAD)
    firsts = known[np.concatenate(([True], breaks))]
    ends = [*firsts[1:].tolist(), len(angle)]
    driving = np.zeros(len(angle), bool)
    if "vehicle_speed_m_s" in drive.table.columns:
        driving = drive.table["vehicle_speed_m_s"].to_numpy() > _DRIVING_M_S
    return [_stretch(slice(first, end), angle, driving) for first, end in zip(firsts.tolist(), ends, strict=True)]


def _stretch(rows: slice, angle: Column, driving: npt.NDArray[np.bool_]) -> _Stretch:
    known = np.isfinite(angle[rows])
    fast = known & driving[rows]
    return _Stretch(rows, int(fast.sum()), float(np.median(angle[rows][fast if fast.any() else known])))


def _brought_near(drive: Signals, stretches: Sequence[_Stretch], usual_rad: float) -> Signals:
    turns = [round((stretch.usual_rad - usual_rad) / _TURN_RAD) for stretch in stretches]
    if not any(turns):
        return drive
    angle = drive.table["steering_wheel_angle_rad"].to_numpy().copy()
    for stretch, count in zip(stretches, turns, strict=True):
        angle[stretch.rows] -= count * _TURN_RAD
    table = drive.table.with_columns(pl.Series("steering_wheel_angle_rad", angle))
    return replace(drive, table=table, notes=(*drive.notes, _note(drive, stretches, turns)))


def _note(drive: Signals, stretches: Sequence[_Stretch], turns: Sequence[int]) -> str:
    since = drive.table["time_s"].to_numpy() - drive.table["time_s"][0]
    changes = [k for k in range(len(turns)) if k == 0 or turns[k] != turns[k - 1]]
    told = [f"{turns[k]:+d} from {since[stretches[k].rows.start]:.0f} s on" for k in changes]
    more = f" and {len(told) - _TOLD} more times" if len(told) > _TOLD else ""
    return (
        f"whole turns were taken from the relative steering wheel angle in {drive.log}: {', '.join(told[:_TOLD])}{more}"
    )
