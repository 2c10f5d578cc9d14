"""Least squares with an interval for correlated samples, by leaving out one part of the drive at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from oncenter.plausibility.grid_signals import Column

_PARTS = 12  # of the drive
_STUDENT_T = 2.20  # 97.5 %, _PARTS - 1 degrees of freedom


@dataclass(frozen=True)
class Normal:
    """Normal equations of each part of a drive: sums of squares and products."""

    squares: Column  # (parts, unknowns, unknowns)
    toward: Column  # (parts, unknowns)
    target_squares: Column  # (parts,)


def normal_equations(unknowns: Column, y: Column) -> Normal:
    """The normal equations of y (n,) over the columns of unknowns (n, m)."""
    parts = list(zip(np.array_split(unknowns, _PARTS), np.array_split(y, _PARTS), strict=True))
    return Normal(
        np.array([a.T @ a for a, _ in parts]),
        np.array([a.T @ b for a, b in parts]),
        np.array([b @ b for _, b in parts]),
    )


def first_with_interval(guesses: Sequence[Normal]) -> tuple[float, float]:
    """The first coefficient of the guess with the smallest residual, and its 95 % half-width. The interval includes
    that another guess may be best without a part of the drive."""
    without = np.array([_first(guesses, left_out) for left_out in range(_PARTS)])
    variance = (_PARTS - 1) / _PARTS * float(np.sum((without - without.mean()) ** 2))
    return _first(guesses, None), _STUDENT_T * variance**0.5


def _first(guesses: Sequence[Normal], left_out: int | None) -> float:
    kept = [part for part in range(_PARTS) if part != left_out]
    return min(_left_and_first(guess, kept) for guess in guesses)[1]


def _left_and_first(guess: Normal, kept: Sequence[int]) -> tuple[float, float]:
    """Sum of squared residuals, and the first coefficient."""
    toward = guess.toward[kept].sum(axis=0)
    found = np.linalg.lstsq(guess.squares[kept].sum(axis=0), toward, rcond=None)[0]
    return float(guess.target_squares[kept].sum() - toward @ found), float(found[0])
