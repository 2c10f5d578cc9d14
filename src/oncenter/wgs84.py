"""The ellipsoid of satellite positions, WGS 84."""

from __future__ import annotations

import math

from oncenter.signals import DEGREE

_EQUATOR_M, _FLATTENING = 6_378_137.0, 1 / 298.257223563


def radii_of_curvature_m(latitude_deg: float) -> tuple[float, float]:
    """The radii of the WGS 84 ellipsoid: along the meridian, and across it."""
    eccentricity_squared = _FLATTENING * (2.0 - _FLATTENING)
    squashed = 1.0 - eccentricity_squared * math.sin(latitude_deg * DEGREE) ** 2
    return _EQUATOR_M * (1.0 - eccentricity_squared) / squashed**1.5, _EQUATOR_M / math.sqrt(squashed)
