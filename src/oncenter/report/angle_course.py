"""A drive's angle as people read it, in deg: measured and estimated, how far apart they are, what was found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from oncenter.report.thin import Floats, Indices
from oncenter.signals import DEGREE, Signals

if TYPE_CHECKING:
    import polars as pl

_HALF_WIDTH_95 = 1.96
MOVING_M_S = 1.0  # slower, motion says nothing
_OFFSET_FROM_S = 60.0  # the end of the valid sensor, from which its offset is taken
_HOLE_S = 1.0


@dataclass(frozen=True)
class Fault:
    name: str
    since_s: float  # from the drive's begin
    found_s: float
    until_s: float
    confidence: float


@dataclass(frozen=True)
class AngleCourse:
    """Columns of shape (n,), NaN where there is none; deg, s from the drive's begin, m/s, m/s^2."""

    time: Floats
    angle: Floats
    half_width: Floats  # 95 %
    reference: (
        Floats | None
    )  # the true angle, or measured less the offset as last learned; none where neither was there
    by_truth: bool
    error: Floats | None  # of the estimate from motion alone, against the reference, while that is valid
    without_sensor: np.ndarray[tuple[int], np.dtype[np.bool_]]
    speed: Floats
    lateral_acceleration: Floats  # r v
    faults: tuple[Fault, ...]
    holes: Indices


def angle_course(
    table: pl.DataFrame, signals: Signals, sensor_lost_at: float | None, true_rad: Floats | None
) -> AngleCourse:
    """The course from `oncenter.angle`'s table and its drive; `true_rad` of shape (n,) if a simulation gives it."""
    column = {name: table[name].to_numpy() for name in table.columns}
    time = column["time_s"] - (column["time_s"][0] if len(table) else 0.0)
    angle = column["steering_wheel_angle_rad"] / DEGREE
    lost = time >= (np.inf if sensor_lost_at is None else sensor_lost_at)
    fault = column["sensor_fault"] != "none"
    measured = column.get("measured_rad")
    known = np.zeros(len(time), bool) if measured is None else np.isfinite(measured)
    believed = known & ~lost & ~fault
    reference, trusted = _reference(column, believed, known & (believed | lost), true_rad)
    # beside its sensor the estimate is what motion alone says
    alone = np.where(believed, column["estimate_rad"] / DEGREE, angle)
    return AngleCourse(
        time=time,
        angle=angle,
        half_width=_HALF_WIDTH_95 * column["standard_deviation_rad"] / DEGREE,
        reference=reference,
        by_truth=true_rad is not None,
        error=None if reference is None else np.where(trusted, alone - reference, np.nan),
        without_sensor=~believed,
        speed=signals.columns["vehicle_speed_m_s"],
        lateral_acceleration=signals.columns["yaw_rate_rad_s"] * signals.columns["vehicle_speed_m_s"],
        faults=_faults(column, time),
        holes=np.flatnonzero(np.diff(time) > _HOLE_S) + 1,
    )


def _reference(
    column: dict[str, Floats],
    believed: np.ndarray[tuple[int], np.dtype[np.bool_]],
    trusted: np.ndarray[tuple[int], np.dtype[np.bool_]],
    true_rad: Floats | None,
) -> tuple[Floats | None, np.ndarray[tuple[int], np.dtype[np.bool_]]]:
    """The reference angle in deg, and where it is valid."""
    if true_rad is not None:
        return true_rad / DEGREE, np.isfinite(true_rad)
    if "measured_rad" not in column:
        return None, trusted
    rows = np.flatnonzero(believed)
    measured = column["measured_rad"]
    if not len(rows):  # its offset is not identifiable
        return measured / DEGREE, np.zeros_like(trusted)
    late = rows[column["time_s"][rows] > column["time_s"][rows[-1]] - _OFFSET_FROM_S]
    offset = float(np.median(measured[late] - column["steering_wheel_angle_rad"][late]))
    return (measured - offset) / DEGREE, trusted


def _faults(column: dict[str, Floats], time: Floats) -> tuple[Fault, ...]:
    name = column["sensor_fault"]
    begins = np.flatnonzero((name != "none") & (np.append("none", name[:-1]) != name))
    found = []
    for row in begins:
        others = np.flatnonzero(name[row:] != name[row])
        until = time[row + others[0]] if len(others) else time[-1]
        since = max(0.0, float(column["sensor_fault_since_s"][row] - column["time_s"][0]))
        confidence = float(column["sensor_fault_confidence"][row])
        found.append(Fault(str(name[row]), since, float(time[row]), float(until), confidence))
    return tuple(found)
