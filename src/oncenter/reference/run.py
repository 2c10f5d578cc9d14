"""Chapter 3: the offset measured by driving one straight both ways, without vehicle data or gyro.

Road crown and wind act to opposite sides on the way there and back. Their effect, and that of the play, cancels in the
midpoint of the mean angles of both ways. A pull by the wheel alignment does not cancel.
SI and rad; degrees appear in `Reference.to_dict` and in messages, which are for people and files.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from oncenter import _core
from oncenter.errors import OncenterError
from oncenter.estimates.estimate import Estimate
from oncenter.read.whole_turns import without_whole_turns
from oncenter.reference.passes import PLACE_M, Pass, by_place, passes_both_ways, places_of
from oncenter.reference.straights import (
    LENGTH_MIN_M,
    WITHIN_M,
    Column,
    Straight,
    along_and_aside_m,
    driven_back,
    plane_m,
    straights,
)
from oncenter.signals import DEGREE, Signals, drives_of

_NEEDED = ("steering_wheel_angle", "latitude", "longitude")
_ENDS_M = 30.0  # left out at both ends, where the truck turns in and aligns
_BATCHES = 8  # of the interval: each must be longer than a swing about the line, up to half a minute
_COMPASS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")


@dataclass(frozen=True)
class Way:
    """All passes in one direction: `heading_rad` clockwise from north, the angle's mean over all places and passes, and
    the standard deviation of its places' means."""

    heading_rad: float
    passes: tuple[Pass, ...]
    mean_rad: float
    standard_deviation_rad: float
    lateral_acceleration_m_s2: float | None

    @property
    def compass(self) -> str:
        return _COMPASS[round(self.heading_rad / (math.pi / 4.0)) % 8]

    def to_dict(self) -> dict[str, Any]:
        return {
            "heading_deg": self.heading_rad / DEGREE,
            "compass": self.compass,
            "mean": {"value": self.mean_rad / DEGREE, "unit": "deg"},
            "standard_deviation": {"value": self.standard_deviation_rad / DEGREE, "unit": "deg"},
            "lateral_acceleration": {"value": self.lateral_acceleration_m_s2, "unit": "m/s^2"},
            "passes": [
                {
                    "begin_s": p.begin_s,
                    "duration_s": p.duration_s,
                    "mean_speed_m_s": p.mean_speed_m_s,
                    "mean_deg": p.mean_rad / DEGREE,
                }
                for p in self.passes
            ],
        }


@dataclass(frozen=True)
class Reference:
    """The offset measured on a straight.

    Attributes:
        offset: midpoint of the two ways' means, with its 95 % interval.
        standard_deviation_rad: of that midpoint.
        place_standard_deviation_rad: of the two ways' half sums, place by place: chapter 3's "standard deviation".
        ways: there and back, in order of time.
        length_m: of the straight on which both ways are compared.
        residual_sd_m: of positions across the line fitted to all passes.
        apart_m: how far the way back lies to the side of the way there, left positive.
        profiles: one row per place of `PLACE_M`: `along_m`, `there_rad`, `back_rad`, `there_m`, `back_m` (to the left
            of the line as driven there).
    """

    version: str
    log: str
    offset: Estimate
    standard_deviation_rad: float
    place_standard_deviation_rad: float
    ways: tuple[Way, Way]
    length_m: float
    residual_sd_m: float
    apart_m: float
    profiles: dict[str, Column]
    notes: tuple[str, ...]

    def __str__(self) -> str:
        there, back = self.ways
        lines = [
            f"straight-ahead offset {self.offset}",
            "",
            *(
                f"  to the {way.compass:<12}{way.mean_rad / DEGREE:8.2f} deg, sd along the straight"
                f" {way.standard_deviation_rad / DEGREE:.2f} deg, {_count(way.passes)}"
                for way in self.ways
            ),
            f"  midpoint           {(there.mean_rad + back.mean_rad) / 2.0 / DEGREE:8.2f} deg, sd along the straight"
            f" {self.place_standard_deviation_rad / DEGREE:.2f} deg, sd of the midpoint"
            f" {self.standard_deviation_rad / DEGREE:.2f} deg",
            f"  straight of {self.length_m:.0f} m; sd of the positions across its line {self.residual_sd_m:.2f} m;"
            f" distance between the two ways {abs(self.apart_m):.2f} m",
        ]
        if there.lateral_acceleration_m_s2 is not None and back.lateral_acceleration_m_s2 is not None:
            lines.append(
                f"  lateral acceleration {there.lateral_acceleration_m_s2:+.2f} and"
                f" {back.lateral_acceleration_m_s2:+.2f} m/s^2: the road crown with opposite signs plus the sensor bias"
            )
        lines += [f"  note: {note}" for note in self.notes]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """The object of the schema oncenter/reference-1."""
        return {
            "schema": "oncenter/reference-1",
            "version": self.version,
            "log": self.log,
            "offset": {**self.offset.to_dict(), "standard_deviation": self.standard_deviation_rad / DEGREE},
            "place_standard_deviation": {"value": self.place_standard_deviation_rad / DEGREE, "unit": "deg"},
            "ways": [way.to_dict() for way in self.ways],
            "straight": {
                "length_m": self.length_m,
                "residual_sd_m": self.residual_sd_m,
                "ways_apart_m": self.apart_m,
            },
            "notes": list(self.notes),
        }

    def to_json(self) -> str:
        return json.dumps(self.to_dict(), ensure_ascii=False, allow_nan=False, indent=2)


def reference(signals: Signals) -> Reference:
    """The offset measured by driving one straight both ways, as in chapter 3.

    Args:
        signals: a drive with `steering_wheel_angle`, `latitude` and `longitude`; `heading` separates passes in reverse,
            `lateral_acceleration` shows the crown. The longest straight that was driven both ways is used.

    Raises:
        OncenterError: exit 1: "missing_signal"; "no_straight"; "not_both_ways", also for another lane back;
            "no_usable_second", no position or no angle.
    """
    from oncenter.read import require

    drives_of(signals, "reference")
    require(signals, _NEEDED)
    (drive,) = without_whole_turns((signals,))
    latitude_deg, longitude_deg = drive.columns["latitude_deg"], drive.columns["longitude_deg"]
    if not (np.isfinite(latitude_deg) & np.isfinite(longitude_deg)).any():
        raise OncenterError(f"{drive.log}: the log has no position", code="no_usable_second", needs=_NEEDED[1:])
    east_m, north_m = plane_m(latitude_deg, longitude_deg)
    straight, length_m = _both_ways(drive.log, straights(east_m, north_m))
    along_m, aside_m = along_and_aside_m(straight, east_m, north_m)
    groups, notes = passes_both_ways(drive, straight, along_m, aside_m, length_m)
    return _answer(drive, straight, length_m, groups, notes)


def _heading_rad(course_rad: float) -> float:
    """Clockwise from north, of a course counter-clockwise from east."""
    return (math.pi / 2.0 - course_rad) % (2.0 * math.pi)


def _both_ways(log: str, found: Sequence[Straight]) -> tuple[Straight, float]:
    """The part of a straight that was driven both ways, ends left out, and its length in whole places."""
    if not found:
        raise OncenterError(
            f"{log}: there is no straight of {LENGTH_MIN_M:g} m within {WITHIN_M:g} m; a reference needs one straight"
            " driven both ways",
            code="no_straight",
        )
    pair = driven_back(found)
    if pair is None:
        longest = max(found, key=lambda straight: straight.length_m)
        compass = _COMPASS[round(_heading_rad(longest.course_rad) / (math.pi / 4.0)) % 8]
        raise OncenterError(
            f"{log}: no straight of {LENGTH_MIN_M:g} m was driven both ways; the longest, {longest.length_m:.0f} m to"
            f" the {compass}, was not driven back",
            code="not_both_ways",
        )
    straight, back = pair
    ends_m, _ = along_and_aside_m(straight, *np.transpose([back.begin_m, back.end_m]))
    low = max(0.0, float(ends_m.min())) + _ENDS_M
    places = places_of(min(straight.length_m, float(ends_m.max())) - _ENDS_M - low)
    return _part(straight, low, low + places * PLACE_M), places * PLACE_M


def _part(straight: Straight, low_m: float, high_m: float) -> Straight:
    """The part of a straight from one coordinate along it to another."""
    cosine, sine = math.cos(straight.course_rad), math.sin(straight.course_rad)
    begin, end = (
        (straight.begin_m[0] + along_m * cosine, straight.begin_m[1] + along_m * sine) for along_m in (low_m, high_m)
    )
    return Straight(straight.first, straight.last, begin, end)


def _answer(
    drive: Signals, straight: Straight, length_m: float, groups: Sequence[Sequence[Pass]], notes: Sequence[str]
) -> Reference:
    residual_sd_m, apart_m, across = _line(groups, length_m)
    profiles: list[Column] = [np.stack([each.angle_rad for each in group]).mean(axis=0) for group in groups]
    half_sums = (profiles[0] + profiles[1]) / 2.0
    there, back = (_way(straight, group, profile) for group, profile in zip(groups, profiles, strict=True))
    offset, sd_rad = _midpoint(half_sums, sum(each.duration_s for group in groups for each in group))
    return Reference(
        version=_core.version(),
        log=drive.log,
        offset=offset,
        standard_deviation_rad=sd_rad,
        place_standard_deviation_rad=float(half_sums.std(ddof=1)),
        ways=(there, back),
        length_m=length_m,
        residual_sd_m=residual_sd_m,
        apart_m=apart_m,
        profiles={
            "along_m": (np.arange(places_of(length_m), dtype=np.float64) + 0.5) * PLACE_M,
            "there_rad": profiles[0],
            "back_rad": profiles[1],
            "there_m": across[0],
            "back_m": across[1],
        },
        notes=(*drive.notes, *notes),
    )


def _way(straight: Straight, group: Sequence[Pass], profile: Column) -> Way:
    passes = tuple(group)
    accelerations = [p.lateral_acceleration_m_s2 for p in passes if p.lateral_acceleration_m_s2 is not None]
    turn_rad = 0.0 if passes[0].forward else math.pi
    return Way(
        heading_rad=_heading_rad(straight.course_rad + turn_rad),
        passes=passes,
        mean_rad=float(profile.mean()),
        standard_deviation_rad=float(profile.std(ddof=1)),
        lateral_acceleration_m_s2=float(np.mean(accelerations)) if accelerations else None,
    )


def _line(groups: Sequence[Sequence[Pass]], length_m: float) -> tuple[float, float, list[Column]]:
    """The line fitted to all positions: their standard deviation across it, how far to the left of the way there the
    way back lies, and both ways' mean distance to the left of the line by place, m; frame of the way there."""
    towards = 1.0 if groups[0][0].forward else -1.0
    along_m = np.concatenate([each.along_m for group in groups for each in group])
    aside_m = np.concatenate([each.aside_m for group in groups for each in group])
    slope, level_m = np.polyfit(along_m, aside_m, 1)  # nearly along the abscissa: as good as total least squares
    residual_sd_m = float(np.std(aside_m - level_m - slope * along_m))
    across = []
    for group in groups:
        along = np.concatenate([each.along_m for each in group])
        residual = np.concatenate([each.aside_m for each in group]) - level_m - slope * along
        across.append(towards * by_place(along, residual, length_m))
    return residual_sd_m, float(np.nanmean(across[1]) - np.nanmean(across[0])), across


def _midpoint(half_sums: Column, seconds: float) -> tuple[Estimate, float]:
    """The mean over all places, and its interval from the scatter of the straight's parts."""
    means = np.array([part.mean() for part in np.array_split(half_sums, _BATCHES)])
    sd_rad = float(means.std(ddof=1) / math.sqrt(len(means)))
    half_width_rad = 1.96 * _core.few_batches_factor(len(means)) * sd_rad
    value = float(half_sums.mean())
    status = "valid" if half_width_rad <= _core.default_params()["offset_half_width_max_rad"] else "converging"
    return Estimate(value, (value - half_width_rad, value + half_width_rad), status, "rad", seconds), sd_rad


def _count(passes: Sequence[Pass]) -> str:
    return "1 pass" if len(passes) == 1 else f"{len(passes)} passes"
