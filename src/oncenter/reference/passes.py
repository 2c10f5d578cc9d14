"""The passes of a truck over one straight, in both directions and in the same lane."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from oncenter.errors import OncenterError
from oncenter.reference.straights import BESIDE_M, WITHIN_M, Column, Straight
from oncenter.signals import DEGREE, Signals

PLACE_M = 10.0  # of one mean angle, so that a slow part of the straight has no more weight
_WHOLE = 0.95  # of the straight, to count as a pass
_LANE_M = 2.0  # between passes: more is another lane, whose crown can slope to the other side

_Rows = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Pass:
    """One pass over a straight.

    Attributes:
        forward: from the straight's begin to its end.
        rows: of the drive, the first and the last.
        begin_s, duration_s: begin by the drive's clock.
        mean_speed_m_s: along the straight, not negative.
        lateral_acceleration_m_s2: mean; None where not available.
        angle_rad: steering wheel angle as measured, by place; NaN where not available.
        along_m, aside_m: of each row, from the straight's begin, along it and to its left.
    """

    forward: bool
    rows: tuple[int, int]
    begin_s: float
    duration_s: float
    mean_speed_m_s: float
    lateral_acceleration_m_s2: float | None
    angle_rad: Column
    along_m: Column
    aside_m: Column

    @property
    def mean_rad(self) -> float:
        return float(self.angle_rad.mean())


def passes_both_ways(
    drive: Signals, straight: Straight, along_m: Column, aside_m: Column, length_m: float
) -> tuple[list[list[Pass]], list[str]]:
    """All passes of both directions in one lane, in order of their first pass; and notes on the other passes.

    Args:
        drive: with its `steering_wheel_angle`; a `heading` separates passes in reverse.
        straight: of `length_m`.
        along_m, aside_m: all rows' coordinates from the straight's begin, along it and to its left.

    Raises:
        OncenterError: "not_both_ways", "no_usable_second" (exit 1).
    """
    where = f"the straight of {length_m:.0f} m"
    crossings = _crossings(along_m, aside_m, length_m)
    found = [_pass(drive, rows, along_m, aside_m, length_m) for rows in crossings]
    ahead = _kept(found, lambda each: not _reversed(drive, straight, each))
    if not _both_ways(ahead):
        message = f"{drive.log}: {where} was driven one way only (without passes in reverse or over a part of it)"
        raise OncenterError(message, code="not_both_ways")
    complete = _kept(ahead, lambda each: not np.isnan(each.angle_rad).any())
    if not _both_ways(complete):
        message = f"{drive.log}: {where} has no pass in each direction with a steering wheel angle all along"
        raise OncenterError(message, code="no_usable_second", needs=("steering_wheel_angle",))
    lane = _in_one_lane(complete)
    if not _both_ways(lane):
        raise OncenterError(
            f"{drive.log}: {where} was driven back {_nearest_apart_m(complete):.1f} m beside the way there; drive both"
            " ways in the same lane, so that the road crown cancels",
            code="not_both_ways",
        )
    left_out = {
        "in reverse": len(found) - len(ahead),
        "without a steering wheel angle all along": len(ahead) - len(complete),
        "in another lane": len(complete) - len(lane),
    }
    notes = [f"left out: {count} of {len(found)} passes {why}" for why, count in left_out.items() if count]
    ways = [[each for each in lane if each.forward is forward] for forward in (True, False)]
    return sorted(ways, key=lambda way: way[0].begin_s), notes


def by_place(along_m: Column, values: Column, length_m: float) -> Column:
    """Means of values over each `PLACE_M` of the straight; NaN where there is none."""
    count = places_of(length_m)
    places = np.clip((along_m / PLACE_M).astype(np.int64), 0, count - 1)
    weight = np.bincount(places, minlength=count)
    means: Column = np.full(count, np.nan)
    np.divide(np.bincount(places, values, minlength=count), weight, out=means, where=weight > 0)
    return means


def places_of(length_m: float) -> int:
    """Number of whole places of a straight."""
    return int(length_m / PLACE_M)


def _crossings(along_m: Column, aside_m: Column, length_m: float) -> list[_Rows]:
    """Rows of each pass from one end of the straight to the other."""
    located = np.flatnonzero(np.isfinite(along_m))
    beside = np.abs(aside_m[located]) < BESIDE_M + WITHIN_M
    on_it = (along_m[located] >= 0.0) & (along_m[located] < length_m) & beside
    edges = np.flatnonzero(np.diff(np.concatenate(([False], on_it, [False])).astype(np.int8)))
    stretches = [located[first:end] for first, end in zip(edges[::2], edges[1::2], strict=True)]
    return [rows for rows in stretches if abs(along_m[rows[-1]] - along_m[rows[0]]) >= _WHOLE * length_m]


def _pass(drive: Signals, rows: _Rows, along_m: Column, aside_m: Column, length_m: float) -> Pass:
    angle = drive.columns["steering_wheel_angle_rad"][rows]
    measured = np.isfinite(angle)
    time = drive.columns["time_s"][rows]
    duration_s, way_m = float(time[-1] - time[0]), float(along_m[rows[-1]] - along_m[rows[0]])
    return Pass(
        forward=way_m > 0.0,
        rows=(int(rows[0]), int(rows[-1])),
        begin_s=float(time[0]),
        duration_s=duration_s,
        mean_speed_m_s=abs(way_m) / duration_s,
        lateral_acceleration_m_s2=_mean_lateral_acceleration_m_s2(drive, rows),
        angle_rad=by_place(along_m[rows][measured], angle[measured], length_m),
        along_m=along_m[rows],
        aside_m=aside_m[rows],
    )


def _mean_lateral_acceleration_m_s2(drive: Signals, rows: _Rows) -> float | None:
    if "lateral_acceleration_m_s2" not in drive.columns:
        return None
    values = drive.columns["lateral_acceleration_m_s2"][rows]
    return float(np.nanmean(values)) if np.isfinite(values).any() else None


def _kept(passes: Sequence[Pass], holds: Callable[[Pass], bool]) -> list[Pass]:
    return [each for each in passes if holds(each)]


def _both_ways(passes: Sequence[Pass]) -> bool:
    return len({each.forward for each in passes}) == 2


def _reversed(drive: Signals, straight: Straight, each: Pass) -> bool:
    """Whether the heading is opposite to the motion; False without a heading."""
    if "heading_deg" not in drive.columns:
        return False
    heading = drive.columns["heading_deg"][each.rows[0] : each.rows[1] + 1] * DEGREE
    course = math.pi / 2.0 - straight.course_rad + (0.0 if each.forward else math.pi)
    return bool(np.nansum(np.cos(heading - course)) < 0.0)


def _in_one_lane(passes: Sequence[Pass]) -> list[Pass]:
    """Those in the lane with the most passes in both directions."""

    def lane_of(one: Pass) -> list[Pass]:
        return [each for each in passes if abs(_apart_m(one, each)) < _LANE_M]

    def pairs(lane: Sequence[Pass]) -> int:
        forward = sum(each.forward for each in lane)
        return min(forward, len(lane) - forward)

    return max((lane_of(one) for one in passes), key=pairs)


def _apart_m(one: Pass, other: Pass) -> float:
    return float(other.aside_m.mean() - one.aside_m.mean())


def _nearest_apart_m(passes: Sequence[Pass]) -> float:
    there, back = ([each for each in passes if each.forward is forward] for forward in (True, False))
    return min(abs(_apart_m(one, other)) for one in there for other in back)
