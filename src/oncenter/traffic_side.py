"""The side of the road on which traffic keeps, by the positions of a drive.

`traffic_sides.txt` has the side by cells of half a degree. Positions are inputs only: no answer contains them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np

from oncenter.signals import DEGREE, SIGNALS, Signals
from oncenter.wgs84 import radii_of_curvature_m

Side = Literal["right", "left"]
_SIDES: dict[str, Side] = {"R": "right", "L": "left"}
_CELL_DEG = 0.5
_POSITION = tuple(SIGNALS[name].column for name in ("latitude", "longitude"))
_SPEED = SIGNALS["vehicle_speed"].column
_STEP_S = 30.0  # between the positions that are looked up: 0.75 km on a motorway
_DRIVEN_MIN_M = 50.0  # of such a step: more than the scatter of a receiver, and of sensors at standstill
_MOVED = 0.5, 1.5  # of the driven distance: bends are longer than the straight way, a receiver may lag by seconds
_NO_ZERO_DEG = 1e-6  # a receiver without a fix may send zeros: nearer to the equator or to Greenwich than 0.1 m


def side_at(latitude_deg: float, longitude_deg: float) -> Side | None:
    """The side of traffic at a position; None at sea, near a border between both sides, and for no position."""
    if not (abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0):
        return None
    rows = _rows()
    row = int((90.0 - latitude_deg) / _CELL_DEG)
    cell = int((longitude_deg + 180.0) / _CELL_DEG)
    for count, side in re.findall(r"(\d+)([LR.])", rows[row] if row < len(rows) else ""):
        cell -= int(count)
        if cell < 0:
            return _SIDES.get(side)
    return None


@cache
def _rows() -> list[str]:
    text = Path(__file__).with_name("traffic_sides.txt").read_text(encoding="utf-8")
    return [line for line in text.splitlines() if not line.startswith("#")]


def side_of(drives: Iterable[Signals]) -> Side | None:
    """The side of traffic at all positions of the drives; None where there is no position, or one is not surely of
    that side."""
    sides = {side_at(*position) for drive in drives for position in _driven(drive)}
    return sides.pop() if len(sides) == 1 else None


def _driven(drive: Signals) -> Iterator[tuple[float, float]]:
    """Positions each half a minute, at both ends of a step as long as the truck drove. Others are frozen, have
    jumped, or are those of a ferry or train."""
    if not {*_POSITION, _SPEED} <= set(drive.columns):
        return
    every = max(round(_STEP_S * drive.rate_hz), 1)
    latitude, longitude = (drive.columns[name][::every] for name in _POSITION)
    speed = np.nan_to_num(np.abs(drive.columns[_SPEED]))
    driven_m = np.add.reduceat(speed, np.arange(0, drive.ticks, every))[:-1] / drive.rate_hz
    for k in np.flatnonzero(driven_m > _DRIVEN_MIN_M):
        ends = [(float(latitude[end]), float(longitude[end])) for end in (k, k + 1)]
        low, high = _MOVED
        if low * driven_m[k] < _distance_m(*ends) < high * driven_m[k]:
            yield from ends


def _distance_m(begin: tuple[float, float], end: tuple[float, float]) -> float:
    """Between two positions near each other; NaN where one is not a position."""
    if min(map(abs, (*begin, *end))) < _NO_ZERO_DEG or not max(abs(begin[0]), abs(end[0])) <= 90.0:
        return math.nan
    north_m, east_m = radii_of_curvature_m(begin[0])
    north_m *= (end[0] - begin[0]) * DEGREE
    east_m *= (end[1] - begin[1]) * DEGREE * math.cos(begin[0] * DEGREE)
    return math.hypot(north_m, east_m)
