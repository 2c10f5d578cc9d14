"""The time of a table: selects its column, and converts numbers, dates or times of day to seconds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import polars as pl

from oncenter.errors import OncenterError
from oncenter.read.frames import Column
from oncenter.read.numbers import in_si, numbers
from oncenter.read.units import TIME, named_unit, unit_key
from oncenter.signals import SignalName

_WITH_UNIT = tuple(f"time_{unit}" for unit in TIME.factors)
_WITHOUT_UNIT = ("time", "timestamp", "datetime", "date_time")  # dates need none
_DAY_S = 86400.0
_DATE = r"^\s*\d{4}-\d\d-\d\d[T ]\d\d:\d\d"
_TIME_OF_DAY = r"^\s*\d{1,2}:\d\d:\d\d"
_SECONDS_PER = {"ms": 1e-3, "us": 1e-6, "ns": 1e-9}


def time_column(path: Path, columns: Sequence[str], names: Mapping[str, SignalName]) -> str:
    """The column named in [signals], else one with a unit, else one that may contain dates.

    Raises:
        OncenterError: there is no such column.
    """
    named = (names["time"].name,) if "time" in names else ()
    for column in (*named, *_WITH_UNIT):
        if column in columns:
            return str(column)
    for column in columns:
        if column.lower() in _WITHOUT_UNIT:
            return column
    wanted = named[0] if named else "time_s"
    shown = ", ".join(repr(name[:40]) for name in columns[:12])
    more = f" and {len(columns) - 12} more" if len(columns) > 12 else ""
    raise OncenterError(
        f"no time column {wanted!r} in {path.name}: its columns are {shown}{more}; rename the time column, or assign "
        'it in [signals]: time = { name = "...", unit = "s" }',
        code="missing_time",
        needs=("time_s",),
    )


def seconds(path: Path, column: pl.Series, names: Mapping[str, SignalName], unit_in_file: str | None) -> Column:
    """The time column in s, NaN where it is empty; dates since 1970 (UTC if they name no zone).

    Raises:
        OncenterError: it contains neither numbers with a unit nor dates nor times of day.
    """
    dated = _dates(path, column)
    if dated is not None:
        return dated
    return in_si(numbers(path, column), _factor(path, column.name, names, unit_in_file))


def _dates(path: Path, column: pl.Series) -> Column | None:
    """Seconds of dates or times of day, as text or as date types; None for anything else."""
    if isinstance(column.dtype, pl.Datetime | pl.Duration):
        return _filled(column.cast(pl.Int64)) * _SECONDS_PER[column.dtype.time_unit]
    if column.dtype == pl.Time:
        return _unwrapped(_filled(column.cast(pl.Int64)) * 1e-9)
    if column.dtype != pl.String:
        return None
    text = column.str.strip_chars()
    first = text.filter(text.is_not_null() & (text != "")).head(1)
    if first.str.contains(_DATE).any():
        return _filled(_read(path, text, _of_date(text)).cast(pl.Int64)) * 1e-9
    if first.str.contains(_TIME_OF_DAY).any():
        of_day = text.str.to_time("%H:%M:%S%.f", strict=False)
        return _unwrapped(_filled(_read(path, text, of_day).cast(pl.Int64)) * 1e-9)
    return None


def _of_date(text: pl.Series) -> pl.Series:
    """Parses dates; those without a zone are UTC."""
    given = pl.col("text").str.replace(" ", "T").str.replace(r"\s*[Zz]$", "+00:00")
    given = given.str.replace(r"\s*([+-]\d\d):?(\d\d)$", "$1:$2")
    zoned = pl.when(given.str.contains(r"[+-]\d\d:\d\d$")).then(given).otherwise(given + "+00:00")
    parsed = zoned.str.to_datetime("%Y-%m-%dT%H:%M:%S%.f%:z", time_unit="ns", strict=False)
    return pl.DataFrame({"text": text}).select(parsed).to_series()


def _read(path: Path, text: pl.Series, parsed: pl.Series) -> pl.Series:
    wrong = parsed.is_null() & text.is_not_null() & (text != "")
    if wrong.any():
        row = wrong.arg_max() or 0
        raise OncenterError(
            f"column {text.name}, row {row + 1} of {path.name}: {text[row][:40]!r} is neither an ISO date and time nor "
            "hh:mm:ss",
            code="not_a_time",
        )
    return parsed


def _unwrapped(of_day: Column) -> Column:
    """Adds a day after each midnight."""
    known = np.isfinite(of_day)
    steps = np.diff(of_day[known], prepend=of_day[known][:1])
    of_day[known] += _DAY_S * np.cumsum(np.where(steps < -_DAY_S / 2, 1.0, 0.0))
    return of_day


def _factor(path: Path, column: str, names: Mapping[str, SignalName], unit_in_file: str | None) -> float:
    """Factor to seconds. A unit in [signals] applies only to the column named there."""
    known = dict(TIME.factors)
    entry = names.get("time")
    if entry is not None and entry.name == column:
        return known[named_unit("time", entry, known, unit_in_file)]
    if column in _WITH_UNIT:
        return known[column.removeprefix("time_")]
    unit = unit_key(unit_in_file or "", known)
    if unit is None:
        raise OncenterError(
            f"column {column} of {path.name} has no unit: rename it to {' or '.join(_WITH_UNIT)}, "
            "or give its unit in [signals]",
            code="unit_missing",
            needs=_WITH_UNIT,
        )
    return known[unit]


def _filled(column: pl.Series) -> Column:
    return column.cast(pl.Float64).fill_null(float("nan")).to_numpy().astype(np.float64, copy=True)
