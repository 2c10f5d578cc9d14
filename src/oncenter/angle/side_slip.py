"""Lateral speed over ground from a GNSS receiver or an inertial system: (24).

Left positive. Side slip is a degree or two: the receiver needs heading and course to some 0.1 deg.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from oncenter.errors import OncenterError
from oncenter.signals import DEGREE, SIGNALS, Signals

Floats = npt.NDArray[np.float64]

EARTH_RADIUS_M = 6_371_000.0
SPEED_MIN_M_S = 2.0  # below, positions give no course
COURSE_OVER_S = 1.0  # between the two positions of a course

_LATERAL_SPEED = SIGNALS["lateral_speed"].column


def with_lateral_speed(signals: Signals) -> Signals:
    """The drive with `lateral_speed_m_s`: its own, or from heading and course, or from heading and positions.

    Raises:
        OncenterError: "missing_signal", exit code 1.
    """
    if _LATERAL_SPEED in signals.columns:
        return signals
    course = _course_deg(signals)
    heading = _column(signals, "heading")
    if course is None or heading is None:
        raise OncenterError(
            f"method 'side-slip' needs 'lateral_speed_m_s', or 'heading_deg' with 'course_deg' or with 'latitude_deg' "
            f"and 'longitude_deg'; {signals.log} has none of these",
            code="missing_signal",
            needs=("lateral_speed",),
        )
    speed = signals.columns["vehicle_speed_m_s"]
    slip_deg = np.mod(heading - course + 180.0, 360.0) - 180.0
    lateral = np.where((speed > SPEED_MIN_M_S) & (np.abs(slip_deg) < 45.0), speed * np.tan(slip_deg * DEGREE), np.nan)
    columns = {**signals.columns, _LATERAL_SPEED: lateral}
    return signals.replaced(columns)


def _column(signals: Signals, name: str) -> Floats | None:
    return signals.columns.get(SIGNALS[name].column)


def _course_deg(signals: Signals) -> Floats | None:
    """Clockwise from north."""
    course, latitude, longitude = (_column(signals, name) for name in ("course", "latitude", "longitude"))
    if course is not None or latitude is None or longitude is None:
        return course
    half = max(1, round(0.5 * COURSE_OVER_S * signals.rate_hz))
    north, east = _over(latitude, half), _over(longitude, half) * np.cos(latitude * DEGREE)
    metres = EARTH_RADIUS_M * DEGREE * np.hypot(north, east)
    return np.where(metres > SPEED_MIN_M_S * COURSE_OVER_S, np.arctan2(east, north) / DEGREE, np.nan)


def _over(values: Floats, half: int) -> Floats:
    """The difference over `half` rows to both sides, NaN where there are none."""
    difference = np.full(len(values), np.nan)
    if len(values) > 2 * half:
        difference[half:-half] = values[2 * half :] - values[: -2 * half]
    return difference
