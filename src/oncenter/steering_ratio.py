"""The steering ratio as files give it: a number, or a polynomial from steering wheel angle to front wheel angle.

Of a polynomial both angles are in rad, its coefficients lowest power first.
"""

from __future__ import annotations

import sys
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator

from oncenter import _core
from oncenter.signals import DEGREE

_LEAST, _MOST = 1.0, 60.0  # of steering wheel angle to front wheel angle, as the core takes them
_UNTURNED_MAX_DEG = 2.0  # front wheel angle of a gear that stands in its middle
_TURNED_MAX_RAD = 3.0  # steering wheel angle to which a polynomial must hold


def _is_of_numbers(value: object) -> object:
    """Before pydantic would take text and truth values for numbers, or name both kinds of ratio at once."""
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


def _turns_the_wheels_one_way(ratio: float | tuple[float, ...]) -> float | tuple[float, ...]:
    if not isinstance(ratio, tuple):
        if not _LEAST <= ratio <= _MOST:
            raise ValueError(f"must be {_LEAST:g} to {_MOST:g}, got {ratio:g}")
        return ratio
    if abs(ratio[0]) > _UNTURNED_MAX_DEG * DEGREE:
        raise ValueError(
            f"must leave the front wheels within {_UNTURNED_MAX_DEG:g} deg where the steering wheel is at 0 deg, and "
            f"they are at {ratio[0] / DEGREE:.3g} deg"
        )
    slope = [power * a for power, a in enumerate(ratio)][1:]
    for turned in (k * _TURNED_MAX_RAD / 50 for k in range(-50, 51)):
        per_turned = sum(a * turned**power for power, a in enumerate(slope))
        if not 1.0 / _MOST <= per_turned <= 1.0 / _LEAST:
            raise ValueError(
                f"must be a ratio of {_LEAST:g} to {_MOST:g} as far as the steering wheel turns, and is not at "
                f"{turned / DEGREE:.0f} deg"
            )
    return ratio


SteeringRatio = Annotated[
    float | tuple[float, ...], BeforeValidator(_is_of_numbers), AfterValidator(_turns_the_wheels_one_way)
]


def polynomial_of(ratio: float | tuple[float, ...]) -> tuple[float, ...]:
    """From the steering wheel angle to the front wheel angle, rad, lowest power first."""
    return ratio if isinstance(ratio, tuple) else (0.0, 1.0 / ratio)


def near_centre(ratio: float | tuple[float, ...]) -> float:
    """Steering wheel angle per front wheel angle where the steering wheel is at 0 deg."""
    return 1.0 / ratio[1] if isinstance(ratio, tuple) else ratio
