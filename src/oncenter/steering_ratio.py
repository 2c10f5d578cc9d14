"""The steering ratio in files: a number, or a polynomial from the steering wheel angle to the front wheel angle.

Both angles of a polynomial are in rad; its coefficients begin with the lowest power.
"""

from __future__ import annotations

import sys
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator

from oncenter import _core
from oncenter.signals import DEGREE

_MIN, _MAX = 1.0, 60.0  # limits of the core, steering wheel angle per front wheel angle
_UNTURNED_MAX_DEG = 2.0  # front wheel angle with the steering wheel at 0 deg
_TURNED_MAX_RAD = 3.0  # steering wheel angle up to which a polynomial must be valid


def _checked_numbers(value: object) -> object:
    """Runs before pydantic, which would accept text and booleans as numbers, and name both kinds of ratio."""
    terms = list(value) if isinstance(value, list | tuple) else [0.0, value]
    if not all(_is_finite(term) for term in terms):
        raise ValueError(f"must be a finite number, or a polynomial of such, got {value!r}")
    if not 2 <= len(terms) <= _core.RATIO_TERMS_MAX:
        raise ValueError(
            f"must be a number, or a polynomial of 2 to {_core.RATIO_TERMS_MAX} terms, [constant, per_rad, ...], got "
            f"{len(terms)} terms"
        )
    return value


def _is_finite(term: object) -> bool:
    return isinstance(term, int | float) and not isinstance(term, bool) and abs(term) <= sys.float_info.max


def _checked_range(ratio: float | tuple[float, ...]) -> float | tuple[float, ...]:
    if not isinstance(ratio, tuple):
        if not _MIN <= ratio <= _MAX:
            raise ValueError(f"must be {_MIN:g} to {_MAX:g}, got {ratio:g}")
        return ratio
    if abs(ratio[0]) > _UNTURNED_MAX_DEG * DEGREE:
        raise ValueError(
            f"must give front wheels within {_UNTURNED_MAX_DEG:g} deg at a steering wheel angle of 0 deg, and gives "
            f"{ratio[0] / DEGREE:.3g} deg"
        )
    slope = [power * a for power, a in enumerate(ratio)][1:]
    for turned in (k * _TURNED_MAX_RAD / 50 for k in range(-50, 51)):
        per_turned = sum(a * turned**power for power, a in enumerate(slope))
        if not 1.0 / _MAX <= per_turned <= 1.0 / _MIN:
            raise ValueError(
                f"must be a ratio of {_MIN:g} to {_MAX:g} as far as the steering wheel turns, and is not at "
                f"{turned / DEGREE:.0f} deg"
            )
    return ratio


SteeringRatio = Annotated[float | tuple[float, ...], BeforeValidator(_checked_numbers), AfterValidator(_checked_range)]


def polynomial_of(ratio: float | tuple[float, ...]) -> tuple[float, ...]:
    """The polynomial from the steering wheel angle to the front wheel angle, rad, lowest power first."""
    return ratio if isinstance(ratio, tuple) else (0.0, 1.0 / ratio)


def near_centre(ratio: float | tuple[float, ...]) -> float:
    """Steering wheel angle per front wheel angle at a steering wheel angle of 0 deg."""
    return 1.0 / ratio[1] if isinstance(ratio, tuple) else ratio
