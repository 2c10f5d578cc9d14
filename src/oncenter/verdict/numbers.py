"""Numbers as a verdict prints them: a verdict compares these, so that text and decision agree."""

from __future__ import annotations

import math

from oncenter.signals import DEGREE


def rounded(value_rad: float) -> float:
    """The angle in deg to 0.1 deg; never -0.0."""
    return round(value_rad / DEGREE, 1) + 0.0


def half_width(half_width_rad: float) -> float:
    """The half-width in deg to 0.1 deg, and at least that."""
    return max(rounded(half_width_rad), 0.1)


def floor_of_size(first_rad: float, last_rad: float) -> float:
    """The least size of an angle in an interval, deg, rounded down to 0.1; 0 where the interval holds zero."""
    if first_rad <= 0.0 <= last_rad:
        return 0.0
    return math.floor(10.0 * min(abs(first_rad), abs(last_rad)) / DEGREE) / 10.0


def plus_minus(value_rad: float, half_width_rad: float) -> str:
    """ "+2.0 deg ± 0.1"."""
    return f"{rounded(value_rad):+.1f} deg ± {half_width(half_width_rad):.1f}"


def joined(parts: list[str]) -> str:
    """ "a, b and c"."""
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
