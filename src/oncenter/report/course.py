"""All drives of an answer on one axis of driving time, in the page's units: what the plots are drawn from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from oncenter import _core
from oncenter.report.thin import Floats, Indices
from oncenter.signals import CLOCK_STEP_S, DEGREE, Signals

if TYPE_CHECKING:
    from oncenter.offset.answer import Answer

Mask = npt.NDArray[np.bool_]

# of all driving time
_PAUSE = 0.01  # between drives: enough to be seen
_VISIBLE = 0.0005  # a narrower hole is less than a column of the screen
_BIAS_KNOWN = 0.5  # of its prior's sd: a smaller sd comes from the drive
_SAMPLE_S = 0.1  # the joint method learns from seconds of samples, the last of which may be so late


@dataclass(frozen=True)
class Course:
    """One row per tick of all drives in order. Angles in deg at the steering wheel unless said otherwise.

    Attributes:
        time: driving time in `time_unit`, ascending; drives follow each other after a short pause.
        time_unit: "s" or "min".
        holes: rows before which there is a hole in the log wide enough to be seen, or a new drive.
        starts: time at which each drive starts.
        measured, speed, yaw_rate, lateral_acceleration: as the table has them: deg, m/s, deg/s, m/s^2; NaN where not
            available, None where a log has none.
        expected: i*L*r/v + i*K_us*(a_y - a_0) + (B/2)*place, what a sensor without offset would read; NaN below the
            gate's speed limit, where (10) is poor. By the joint method r is corrected, B the play and a_0 the side
            force, as measured, without lateral force in the steering; else both are 0.
        yaw_rate_times_speed: r*v in m/s^2; what an accelerometer without bias reads on a level road.
        residual: measured less i*L*r/v, filtered.
        filtered_lateral_acceleration: m/s^2, belongs to `residual`.
        place: in the play, 1 on the flank of a left turn, -1 on that of a right turn; 0 before it is learned.
        reasons: bits; 0 is clean.
        used: clean, and the estimator learned from it.
        offset, offset_low, offset_high: as learned up to then, 95 %; NaN before there is one.
        offset_half_width_drive: the part of that interval that the drive leaves open.
        understeer_gradient: deg/(m/s^2) at the road wheel; NaN before it is learned.
        yaw_rate_bias, yaw_rate_bias_half_width: deg/s, 95 %; NaN before there is more than a prior.
        changes: time of each of the answer's changes.
        begin_of_offset: time since which the offset is what it is: before its last change the cloud lay elsewhere.
        unloading_acceleration: m/s^2, neutral lateral acceleration as measured; 0 where play is not estimated.
    """

    time: Floats
    time_unit: str
    holes: Indices
    starts: tuple[float, ...]
    measured: Floats | None
    speed: Floats | None
    yaw_rate: Floats | None
    lateral_acceleration: Floats | None
    expected: Floats
    yaw_rate_times_speed: Floats
    residual: Floats
    filtered_lateral_acceleration: Floats
    place: Floats
    reasons: npt.NDArray[np.uint32]
    used: Mask
    offset: Floats
    offset_low: Floats
    offset_high: Floats
    offset_half_width_drive: Floats
    understeer_gradient: Floats
    yaw_rate_bias: Floats
    yaw_rate_bias_half_width: Floats
    changes: tuple[float, ...]
    begin_of_offset: float
    unloading_acceleration: float


def course(answer: Answer, rows: npt.NDArray[Any]) -> Course:
    """The course of an answer's drives; `rows` is their trace, one row per table row of all drives in order."""
    seconds, starts = _driving_time([drive.columns["time_s"] for drive in answer.drives])
    unit, per_unit = ("min", 60.0) if len(seconds) and seconds[-1] > 300.0 else ("s", 1.0)
    motion = rows["motion"]
    speed = rows["vehicle_speed"]
    jointly = answer.method == "joint"
    unloading = float(rows["unloading_acceleration"][-1]) if len(rows) else 0.0
    changes = tuple((starts[change.drive] + change.into_log_s) / per_unit for change in answer.changes)
    known = (rows["reasons"] & (_core.REASONS["missing_signal"] | _core.REASONS["time"])) == 0
    moving = known & (speed > answer.params["joint_speed_min_m_s" if jointly else "speed_min_m_s"])
    bias_sd = rows["yaw_rate_bias_sd"]
    has_bias = bias_sd < _BIAS_KNOWN * answer.params["gyro_bias_sd_rad_s"]
    has_offset = (rows["offset_status"] != _core.STATUSES.index("unobservable")) & np.isfinite(rows["offset_sd"])
    offset = np.where(has_offset, rows["offset"] / DEGREE, np.nan)
    low, high = _core.interval_95(rows["offset"], rows["offset_sd"], rows["offset_lean"])
    measured = _column(answer.drives, "steering_wheel_angle_rad", 1.0 / DEGREE)
    return Course(
        time=seconds / per_unit,
        time_unit=unit,
        holes=_holes(seconds, answer),
        starts=tuple(start / per_unit for start in starts),
        measured=measured,
        speed=_column(answer.drives, "vehicle_speed_m_s", 1.0),
        yaw_rate=_column(answer.drives, "yaw_rate_rad_s", 1.0 / DEGREE),
        lateral_acceleration=_column(answer.drives, "lateral_acceleration_m_s2", 1.0),
        expected=np.where(moving, _expected_rad(answer, rows, unloading) / DEGREE, np.nan),
        # the core takes the curvature at 1 m/s below that
        yaw_rate_times_speed=np.where(known, motion["curvature"] * np.maximum(speed, 1.0) * speed, np.nan),
        residual=motion["residual"] / DEGREE,
        filtered_lateral_acceleration=motion["lateral_acceleration"],
        reasons=rows["reasons"],
        place=rows["place"],
        used=_learned_from(rows, answer.drives)
        if jointly
        else _used(rows["reasons"] == 0, answer.drives, answer.params["clean_time_s"]),
        offset=offset,
        offset_low=np.where(has_offset, low / DEGREE, np.nan),
        offset_high=np.where(has_offset, high / DEGREE, np.nan),
        offset_half_width_drive=np.where(has_offset, 1.96 * rows["offset_parts"]["drive_sd"] / DEGREE, np.nan),
        understeer_gradient=np.where(rows["understeer_gradient"] != 0.0, rows["understeer_gradient"] / DEGREE, np.nan),
        yaw_rate_bias=np.where(has_bias, rows["yaw_rate_bias"] / DEGREE, np.nan),
        yaw_rate_bias_half_width=np.where(has_bias, 1.96 * bias_sd / DEGREE, np.nan),
        changes=changes,
        begin_of_offset=max(
            (time for time, change in zip(changes, answer.changes, strict=True) if change.size_rad is not None),
            default=0.0,
        ),
        unloading_acceleration=unloading,
    )


def _expected_rad(answer: Answer, rows: npt.NDArray[Any], unloading: float) -> npt.NDArray[np.float64]:
    """The angle that (10) and the play ask for in the motion that was."""
    motion = rows["motion"]
    lateral_force = motion["lateral_acceleration"] - unloading
    by_force = (answer.understeer_at_steering_wheel.value or 0.0) * lateral_force
    expected: npt.NDArray[np.float64] = answer.vehicle.ratio_times_wheelbase_m * motion["curvature"] + by_force
    return expected + 0.5 * (answer.backlash.value or 0.0) * rows["place"]


def _driving_time(times: list[Floats]) -> tuple[Floats, list[float]]:
    """Seconds of driving, drive after drive with a short pause between, and where each starts."""
    driven = [_since_start(t) if len(t) else t for t in times]
    spans = [float(t[-1]) if len(t) else 0.0 for t in driven]
    pause = _PAUSE * sum(spans)
    starts = [sum(spans[:k]) + k * pause for k in range(len(times))]
    shifted = [t + start for t, start in zip(driven, starts, strict=True) if len(t)]
    return (np.concatenate(shifted) if shifted else np.empty(0)), starts


def _since_start(time: Floats) -> Floats:
    """Seconds since the first one; steps of the clock count as nothing."""
    steps = np.diff(time)
    of_clock = (steps < 0.0) | (steps > CLOCK_STEP_S)
    since: Floats = time - time[0]
    return np.concatenate(([0.0], np.cumsum(np.where(of_clock, 0.0, steps)))) if of_clock.any() else since


def _holes(seconds: Floats, answer: Answer) -> Indices:
    ticks = (1.0 / drive.rate_hz for drive in answer.drives)
    if not len(seconds):
        return np.empty(0, np.intp)
    narrowest = max(answer.params["gap_max_s"], *(1.5 * tick for tick in ticks), _VISIBLE * float(seconds[-1]))
    return np.flatnonzero(np.diff(seconds) > narrowest) + 1


def _column(drives: tuple[Signals, ...], name: str, factor: float) -> Floats | None:
    """A table column of all drives, times factor; NaN for a drive that lacks it, None if all do."""
    if not any(name in drive.columns for drive in drives):
        return None
    parts = [drive.columns[name] if name in drive.columns else np.full(drive.ticks, np.nan) for drive in drives]
    return factor * np.concatenate(parts)


def _used(clean: Mask, drives: tuple[Signals, ...], clean_time_s: float) -> Mask:
    """Clean ticks after which all is clean for t1, to within one of the core's blocks."""
    used = np.zeros_like(clean)
    first = 0
    for drive in drives:
        part = clean[first : first + drive.ticks]
        n = len(part)
        unclean = np.where(part, n, np.arange(n))
        next_unclean = np.minimum.accumulate(unclean[::-1])[::-1]
        used[first : first + n] = part & (next_unclean - np.arange(n) > clean_time_s * drive.rate_hz)
        first += n
    return used


def _learned_from(rows: npt.NDArray[Any], drives: tuple[Signals, ...]) -> Mask:
    """Clean ticks of the seconds by which the joint method's evidence grew."""
    edges = np.zeros(len(rows) + 1)
    first = 0
    for drive in drives:
        evidence = rows["evidence"][first : first + drive.ticks]
        grown = np.diff(evidence, prepend=evidence[:1])
        ends = np.flatnonzero(grown > 0)
        length = np.round((grown[ends] + _SAMPLE_S) * drive.rate_hz).astype(np.intp)
        np.add.at(edges, first + np.maximum(ends + 1 - length, 0), 1)
        np.add.at(edges, first + ends + 1, -1)
        first += drive.ticks
    learned_from: Mask = (np.cumsum(edges[:-1]) > 0) & (rows["reasons"] == 0)
    return learned_from
