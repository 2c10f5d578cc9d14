"""A table's column as numbers."""

from __future__ import annotations

from pathlib import Path

import polars as pl

from oncenter.errors import OncenterError
from oncenter.read.frames import Column

_NO_NUMBER = ("", "na", "n/a", "#n/a", "nan", "null", "none", "-", "--")  # CSV writers' "not available"


def numbers(path: Path, column: pl.Series) -> Column:
    """A column as numbers, NaN where empty. Do not modify the result: it may share memory with the column.

    Raises:
        OncenterError: a cell is text.
    """
    if column.dtype.is_numeric() or column.dtype in (pl.Boolean, pl.Null):
        return _filled(column.rechunk().cast(pl.Float64))  # joins the parts before the cast, while they are narrow
    if column.dtype != pl.String:
        raise OncenterError(
            f"column {column.name} of {path.name} has type {column.dtype}, expected numbers", code="not_a_number"
        )
    text = column.str.strip_chars()
    read = text.cast(pl.Float64, strict=False)
    wrong = read.is_null() & text.is_not_null() & ~text.str.to_lowercase().is_in(_NO_NUMBER)
    if wrong.any():
        row = wrong.arg_max() or 0
        raise OncenterError(
            f"column {column.name}, row {row + 1} of {path.name}: {text[row][:40]!r} is not a number",
            code="not_a_number",
        )
    return _filled(read)


def _filled(column: pl.Series) -> Column:
    filled = column.fill_null(float("nan")) if column.null_count() else column
    return filled.rechunk().to_numpy()


def in_si(values: Column, factor: float) -> Column:
    """Multiplies by a factor; returns the same array for a factor of 1."""
    return values if factor == 1.0 else values * factor
