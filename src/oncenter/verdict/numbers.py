"""Numbers as a verdict prints them: exact numbers decide, and as many digits are printed as show the same decision."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from oncenter.verdict.decision import FINEST_DIGITS, standing


class Shown(NamedTuple):
    """A value and its half-width, rounded to `digits`; the half-width is at least one in the last of them."""

    value: float
    half_width: float
    digits: int

    def __str__(self) -> str:
        """ "+2.0 deg ± 0.1"."""
        return f"{self.value:+.{self.digits}f} deg ± {self.half_width:.{self.digits}f}"


def shown(value: float, half_width: float, limit: float, digits: int = 1) -> Shown:
    """A value with its 95 % half-width, both in the unit of the limit, with `digits` or as many more as the decision
    needs: 1.96 ± 0.02 is within a limit of 2, and 2.0 ± 0.1 would not be."""
    exact = standing((value - half_width, value + half_width), limit)
    for count in range(digits, FINEST_DIGITS + 1):
        found = Shown(round(value, count) + 0.0, max(round(half_width, count), 10.0**-count), count)
        ends = (round(found.value + sign * found.half_width, count) for sign in (-1, 1))
        if standing((next(ends), next(ends)), limit) == exact:
            break
    return found


def between(value: float, low: float, high: float, limit: float) -> tuple[str, str]:
    """A value, "+2.1", and its interval, "+2.0 to +2.3", with as many digits as `shown`."""
    exact = standing((low, high), limit)
    for count in range(1, FINEST_DIGITS + 1):
        first, last = (round(end, count) + 0.0 for end in (low, high))
        if standing((first, last), limit) == exact:
            break
    return f"{round(value, count) + 0.0:+.{count}f}", f"{first:+.{count}f} to {last:+.{count}f}"


def joined(parts: Sequence[str]) -> str:
    """ "a, b and c"."""
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
