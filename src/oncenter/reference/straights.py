"""Straights in the positions of a drive, and whether they were driven back."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from oncenter.signals import DEGREE
from oncenter.wgs84 import radii_of_curvature_m

Column = npt.NDArray[np.float64]

WITHIN_M = 3.0  # of a straight line: motion within a lane and receiver error, but no bend of less than some kilometres
LENGTH_MIN_M = 300.0  # on a shorter one the steering does not settle, 5.5.1
_STEP_M = 5.0  # between the positions used: more than the receiver's scatter at standstill
_PARALLEL_RAD = 2.0 * DEGREE
BESIDE_M = 20.0  # a straight at a larger lateral distance is another road


@dataclass(frozen=True)
class Straight:
    """First and last row of a straight part of a drive, and their positions (m, plane)."""

    first: int
    last: int
    begin_m: tuple[float, float]
    end_m: tuple[float, float]

    @property
    def length_m(self) -> float:
        return math.dist(self.begin_m, self.end_m)

    @property
    def course_rad(self) -> float:
        """Counter-clockwise from east."""
        return math.atan2(self.end_m[1] - self.begin_m[1], self.end_m[0] - self.begin_m[0])


def plane_m(latitude_deg: Column, longitude_deg: Column) -> tuple[Column, Column]:
    """Metres east and north of the median of all positions; NaN where there is none."""
    latitude_0_deg, longitude_0_deg = float(np.nanmedian(latitude_deg)), float(np.nanmedian(longitude_deg))
    north_radius_m, east_radius_m = radii_of_curvature_m(latitude_0_deg)
    east_rad = (longitude_deg - longitude_0_deg + 180.0) % 360.0 - 180.0
    return (
        east_rad * DEGREE * east_radius_m * np.cos(latitude_deg * DEGREE),
        (latitude_deg - latitude_0_deg) * DEGREE * north_radius_m,
    )


def straights(east_m: Column, north_m: Column) -> list[Straight]:
    """All straights of a drive in order, by Douglas and Peucker's method, each at least `LENGTH_MIN_M` long."""
    rows = _moved(east_m, north_m)
    path = np.column_stack((east_m[rows], north_m[rows]))
    found = []
    waiting = [(0, len(rows) - 1)] if len(rows) > 1 else []
    while waiting:
        first, last = waiting.pop()
        farthest = _farthest(path, first, last)
        if farthest is not None:
            waiting += [(farthest, last), (first, farthest)]
            continue
        begin, end = ((float(path[k, 0]), float(path[k, 1])) for k in (first, last))
        found.append(Straight(rows[first], rows[last], begin, end))
    return [straight for straight in found if straight.length_m >= LENGTH_MIN_M]


def driven_back(among: Sequence[Straight]) -> tuple[Straight, Straight] | None:
    """The straight with the longest part driven both ways, and the one back; None where there is none."""
    best: tuple[float, Straight, Straight] | None = None
    begin_m = np.array([straight.begin_m for straight in among]).reshape(-1, 2)
    end_m = np.array([straight.end_m for straight in among]).reshape(-1, 2)
    course_rad = np.array([straight.course_rad for straight in among])
    for straight in among:
        opposite = np.abs(np.angle(-np.exp(1j * (course_rad - straight.course_rad)))) < _PARALLEL_RAD
        begin_along_m, begin_aside_m = along_and_aside_m(straight, begin_m[:, 0], begin_m[:, 1])
        end_along_m, end_aside_m = along_and_aside_m(straight, end_m[:, 0], end_m[:, 1])
        common_m = np.minimum(begin_along_m, straight.length_m) - np.maximum(end_along_m, 0.0)
        beside = np.abs(begin_aside_m + end_aside_m) / 2.0 < BESIDE_M
        common_m[~(opposite & beside)] = 0.0
        other = int(np.argmax(common_m))
        if common_m[other] >= max(LENGTH_MIN_M, 0.0 if best is None else best[0] + 1e-6):
            best = float(common_m[other]), straight, among[other]
    return None if best is None else best[1:]


def along_and_aside_m(straight: Straight, east_m: Column, north_m: Column) -> tuple[Column, Column]:
    """Coordinates along the straight from its begin, and to its left."""
    cosine, sine = math.cos(straight.course_rad), math.sin(straight.course_rad)
    east_m, north_m = east_m - straight.begin_m[0], north_m - straight.begin_m[1]
    return east_m * cosine + north_m * sine, north_m * cosine - east_m * sine


def _moved(east_m: Column, north_m: Column) -> list[int]:
    """Rows, each `_STEP_M` from the one before."""
    rows: list[int] = []
    east_0_m = north_0_m = math.inf
    for row, (east, north) in enumerate(zip(east_m.tolist(), north_m.tolist(), strict=True)):
        if (east - east_0_m) ** 2 + (north - north_0_m) ** 2 >= _STEP_M**2:  # not so for NaN
            rows.append(row)
            east_0_m, north_0_m = east, north
    return rows


def _farthest(path: npt.NDArray[np.float64], first: int, last: int) -> int | None:
    """The position farthest from the line between two positions; None where all are within `WITHIN_M` of it."""
    way = path[last] - path[first]
    length_m = math.hypot(way[0], way[1])
    offset = path[first : last + 1] - path[first]
    if length_m < _STEP_M:  # a loop: there is no line
        distance_m = np.hypot(offset[:, 0], offset[:, 1])
    else:
        along_m = np.clip((offset @ way) / length_m, 0.0, length_m)
        nearest = along_m[:, None] * way / length_m
        distance_m = np.hypot(*(offset - nearest).T)
    farthest = int(np.argmax(distance_m))
    return None if distance_m[farthest] <= WITHIN_M else first + farthest
