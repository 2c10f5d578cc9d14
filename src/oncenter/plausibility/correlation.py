"""Correlation of two signals of a turn: whether one follows the other, and with which lag.

A verdict needs both halves of the drive, so that no single event decides.
"""

from __future__ import annotations

import math

import numpy as np

from oncenter.plausibility.grid_signals import GRID_HZ, MIN_TIME_S, Column

_CORRELATION = 0.6  # a smaller one is no evidence
_LAG_SEARCHED_S = 2.0
_LAG_CORRELATION = 0.8


def agreement(x: Column, y: Column) -> int:
    """1 where two signals follow each other, -1 where they do so with opposite sign, 0 without enough evidence."""
    return agreement_of_means(x, y, _CORRELATION, round(MIN_TIME_S * GRID_HZ))


def agreement_of_means(x: Column, y: Column, correlation: float, count: int) -> int:
    """The same for any means; needs `count` pairs with a correlation of at least `correlation`."""
    both = np.isfinite(x) & np.isfinite(y)
    if both.sum() < count:
        return 0
    halves = zip(np.array_split(x[both], 2), np.array_split(y[both], 2), strict=True)
    first, second = (_correlation(a, b) for a, b in halves)
    if min(abs(first), abs(second)) < correlation or first * second < 0:
        return 0
    return 1 if first > 0 else -1


def _correlation(x: Column, y: Column) -> float:
    spread = float(np.std(x) * np.std(y))
    return float(np.mean((x - x.mean()) * (y - y.mean()))) / spread if spread > 0 else 0.0


def lags_s(
    early: Column, late: Column, step_s: float, searched_s: float = _LAG_SEARCHED_S
) -> tuple[float, float] | None:
    """`lag_s` in each half of the drive; None unless both have one."""
    middle = len(early) // 2
    first = lag_s(early[:middle], late[:middle], step_s, searched_s)
    second = lag_s(early[middle:], late[middle:], step_s, searched_s)
    return None if first is None or second is None else (first, second)


def lag_s(early: Column, late: Column, step_s: float, searched_s: float = _LAG_SEARCHED_S) -> float | None:
    """The delay of `late` behind `early`, where their changes correlate most; None where they do not correlate."""
    x, y = _increments(early), _increments(late)
    if np.isfinite(x * y).sum() * step_s < MIN_TIME_S / 2:
        return None
    furthest = round(searched_s / step_s)
    likeness = _likenesses(x, np.pad(y, furthest, constant_values=np.nan))
    best = int(np.argmax(likeness))
    if likeness[best] < _LAG_CORRELATION or best in (0, 2 * furthest):
        return None
    before, peak, after = likeness[best - 1 : best + 2]
    between = 0.5 * (before - after) / (before - 2 * peak + after)  # summit of the parabola
    return (best - furthest + between) * step_s


def _likenesses(x: Column, y: Column) -> list[float]:
    """At each shift of the shorter `x` along `y`: 0 to 1, independent of sign, over the common samples."""
    has_x, has_y = np.isfinite(x).astype(np.float64), np.isfinite(y).astype(np.float64)
    x, y = np.where(has_x > 0, x, 0.0), np.where(has_y > 0, y, 0.0)
    x_squared, y_squared, given = x * x, y * y, []
    for shift in range(len(y) - len(x) + 1):
        there = slice(shift, shift + len(x))
        energy = math.sqrt(_product(x_squared, has_y[there]) * _product(has_x, y_squared[there]))
        given.append(abs(_product(x, y[there])) / energy if energy > 0 else 0.0)
    return given


def _product(x: Column, y: Column) -> float:
    """Without `np.dot`: on busy cores its threads wait for each other a hundred times as long as the product takes."""
    return float(np.einsum("i,i->", x, y))


def _increments(values: Column) -> Column:
    """Changes over 0.5 s of means over 0.2 s: without level and drift, with little noise."""
    if len(values) < 4 + 10:
        return np.empty(0)
    smooth = np.convolve(values, np.full(4, 0.25), mode="valid")
    return np.asarray(smooth[10:] - smooth[:-10])
