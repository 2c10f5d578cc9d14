"""Each time that a truck went over one straight, in either direction and in the same lane."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from oncenter.errors import OncenterError
from oncenter.reference.straights import BESIDE_M, WITHIN_M, Column, Straight
from oncenter.signals import DEGREE, Signals

PLACE_M = 10.0  # over which an angle is a mean, so that no place counts more for being driven slowly
_WHOLE = 0.95  # of the straight, to count as a pass
_LANE_M = 2.0  # between passes: more is another lane, whose crown may fall to the other side

_Rows = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Pass:
    """Once over a straight.

    Attributes:
        forward: from the straight's begin to its end.
        rows: of the drive, the first and the last.
        begin_s, duration_s: begin by the drive's clock.
        mean_speed_m_s: along the straight, not negative.
        lateral_acceleration_m_s2: mean; None where the drive has none.
        angle_rad: the steering wheel's as measured, by place; NaN where it is missing.
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
    """All passes there and all back in one lane, the way first that was driven first; and what is told of the others.

    Args:
        drive: with its `steering_wheel_angle`; a `heading` tells passes in reverse apart.
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
        message = f"{drive.log}: {where} was driven one way only, but for passes in reverse or not over all of it"
        raise OncenterError(message, code="not_both_ways")
    known = _kept(ahead, lambda each: not np.isnan(each.angle_rad).any())
    if not _both_ways(known):
        message = (
            f"{drive.log}: there is no pass each way over {where} with a steering wheel angle at each of its places"
        )
        raise OncenterError(message, code="no_usable_second", needs=("steering_wheel_angle",))
    lane = _in_one_lane(known)
    if not _both_ways(lane):
        raise OncenterError(
            f"{drive.log}: {where} was driven back {_nearest_apart_m(known):.1f} m beside the way there; only in the"
            " same lane does its crown fall to the other hand",
            code="not_both_ways",
        )
    left_out = {
        "in reverse": len(found) - len(ahead),
        "without a steering wheel angle throughout": len(ahead) - len(known),
        "in another lane": len(known) - len(lane),
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
    """How many whole ones a straight has."""
    return int(length_m / PLACE_M)


def _crossings(along_m: Column, aside_m: Column, length_m: float) -> list[_Rows]:
    """Rows of each time that the truck went over the straight from one end to the other."""
    known = np.flatnonzero(np.isfinite(along_m))
    beside = np.abs(aside_m[known]) < BESIDE_M + WITHIN_M
    on_it = (along_m[known] >= 0.0) & (along_m[known] < length_m) & beside
    edges = np.flatnonzero(np.diff(np.concatenate(([False], on_it, [False])).astype(np.int8)))
    stretches = [known[first:end] for first, end in zip(edges[::2], edges[1::2], strict=True)]
    return [rows for rows in stretches if abs(along_m[rows[-1]] - along_m[rows[0]]) >= _WHOLE * length_m]


def _pass(drive: Signals, rows: _Rows, along_m: Column, aside_m: Column, length_m: float) -> Pass:
    angle = drive.table["steering_wheel_angle_rad"].to_numpy()[rows]
    known = np.isfinite(angle)
    time = drive.table["time_s"].to_numpy()[rows]
    duration_s, way_m = float(time[-1] - time[0]), float(along_m[rows[-1]] - along_m[rows[0]])
    return Pass(
        forward=way_m > 0.0,
        rows=(int(rows[0]), int(rows[-1])),
        begin_s=float(time[0]),
        duration_s=duration_s,
        mean_speed_m_s=abs(way_m) / duration_s,
        lateral_acceleration_m_s2=_mean_lateral_acceleration_m_s2(drive, rows),
        angle_rad=by_place(along_m[rows][known], angle[known], length_m),
        along_m=along_m[rows],
        aside_m=aside_m[rows],
    )


def _mean_lateral_acceleration_m_s2(drive: Signals, rows: _Rows) -> float | None:
    if "lateral_acceleration_m_s2" not in drive.table.columns:
        return None
    values = drive.table["lateral_acceleration_m_s2"].to_numpy()[rows]
    return float(np.nanmean(values)) if np.isfinite(values).any() else None


def _kept(passes: Sequence[Pass], holds: Callable[[Pass], bool]) -> list[Pass]:
    return [each for each in passes if holds(each)]


def _both_ways(passes: Sequence[Pass]) -> bool:
    return len({each.forward for each in passes}) == 2


def _reversed(drive: Signals, straight: Straight, each: Pass) -> bool:
    """Whether the truck pointed the other way than it went, where a heading tells."""
    if "heading_deg" not in drive.table.columns:
        return False
    heading = drive.table["heading_deg"].to_numpy()[each.rows[0] : each.rows[1] + 1] * DEGREE
    course = math.pi / 2.0 - straight.course_rad + (0.0 if each.forward else math.pi)
    return bool(np.nansum(np.cos(heading - course)) < 0.0)


def _in_one_lane(passes: Sequence[Pass]) -> list[Pass]:
    """Those in the lane that was driven most often both ways."""

    def lane_of(one: Pass) -> list[Pass]:
        return [each for each in passes if abs(_apart_m(one, each)) < _LANE_M]

    def least(lane: Sequence[Pass]) -> int:
        forward = sum(each.forward for each in lane)
        return min(forward, len(lane) - forward)

    return max((lane_of(one) for one in passes), key=least)


def _apart_m(one: Pass, other: Pass) -> float:
    return float(other.aside_m.mean() - one.aside_m.mean())


def _nearest_apart_m(passes: Sequence[Pass]) -> float:
    there, back = ([each for each in passes if each.forward is forward] for forward in (True, False))
    return min(abs(_apart_m(one, other)) for one in there for other in back)
