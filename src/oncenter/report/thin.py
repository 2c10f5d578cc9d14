"""Fewer points that look the same: a screen has some thousand columns, a drive a million ticks."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]


def extremes(values: Floats, bins: int) -> Indices:
    """Rows that keep the outline of a series: the lowest and the highest of each bin, in order.

    Args:
        values: shape (n,); NaN is left out, but a bin of nothing else gives one NaN, so that the line breaks there.
        bins: of equal length in rows; all rows are returned when there are at most two a bin.

    Returns:
        Row numbers, ascending, at most 2 * bins.
    """
    n = len(values)
    if n <= 2 * bins:
        return np.arange(n)
    starts = np.linspace(0, n, bins, endpoint=False).astype(np.intp)
    lowest = _extreme_rows(values, starts, np.fmin)
    highest = _extreme_rows(values, starts, np.fmax)
    return np.unique(np.concatenate([lowest, highest]))


def _extreme_rows(values: Floats, starts: Indices, better: np.ufunc) -> Indices:
    """The first row of each bin that holds the bin's extreme; the bin's first row where all are NaN."""
    lengths = np.diff(np.append(starts, len(values)))
    extreme = np.repeat(better.reduceat(values, starts), lengths)
    rows = np.where(values == extreme, np.arange(len(values)), len(values))
    first = np.minimum.reduceat(rows, starts)
    return np.where(first < len(values), first, starts).astype(np.intp)


def broken_at_holes(
    x: Floats, rows: Indices, holes: Indices, columns: dict[str, Floats]
) -> tuple[Floats, dict[str, Floats]]:
    """The chosen rows, with a NaN put into every hole between two of them, so that no line bridges it.

    Args:
        x: shape (n,), ascending.
        rows: those chosen of the n, ascending.
        holes: rows before which there is a hole, ascending.
        columns: each of shape (n,).

    Returns:
        x and columns at the chosen rows, with rows put in.
    """
    after = np.unique(np.searchsorted(rows, holes))
    after = after[(after > 0) & (after < len(rows))]
    middle = (x[rows[after - 1]] + x[rows[after]]) / 2.0
    return (
        np.insert(x[rows], after, middle),
        {name: np.insert(column[rows], after, np.nan) for name, column in columns.items()},
    )


def sample(rows: Indices, count: int) -> Indices:
    """A sample of at most `count` rows, picked at random but always the same, in order."""
    if len(rows) <= count:
        return rows
    return np.sort(np.random.default_rng(1).choice(rows, count, replace=False))
