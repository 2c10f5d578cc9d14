"""The time of a table: selects its column, and converts numbers, dates or times of day to seconds."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import chain
from pathlib import Path

import numpy as np
import polars as pl

from oncenter.errors import OncenterError
from oncenter.read.frames import Column
from oncenter.read.numbers import in_si, numbers
from oncenter.read.units import TIME, named_unit, unit_key
from oncenter.signals import SignalName

_WITH_UNIT = tuple(f"time_{unit}" for unit in TIME.factors)
_WITHOUT_UNIT = ("time", "timestamp", "datetime", "date_time", "timestamps")  # dates need none
_DAY_S, _HOUR_S = 86400.0, 3600.0
_DATE = r"^\s*\d{4}-\d\d-\d\d[T ]\d\d:\d\d"
_OF_ASAMMDF = "timestamps"  # in s
_SECONDS = r"(\d\d(?:[.,:]\d+)?)"
_HALF = r"\s*(?:([AaPp])\.?[Mm]\.?)?$"
_OTHER_DATE = r"^(\d{1,4})([./-])(\d{1,2}|\p{L}{3})\.?[./-](\d{1,4})[ T,;]+(\d{1,2}):(\d\d):" + _SECONDS + _HALF
_TIME_OF_DAY = r"^(\d{1,3}):(\d\d):" + _SECONDS + _HALF
_OF_HOUR = r"^(\d{1,2}):(\d\d[.,]\d+)$"  # Excel's "mm:ss.0"
_MONTHS = ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"]
_GERMAN_MONTHS = {"m\u00e4r": "mar", "mrz": "mar", "mai": "may", "okt": "oct", "dez": "dec"}
_SECONDS_PER = {"ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_EXCEL_DAYS, _MATLAB_DAYS = 25569.0, 719529.0  # of 1970-01-01; Excel counts from the end of 1899, MATLAB from year 0
_FIRST_EXCEL_DAY, _FIRST_MATLAB_DAY = 35569.0, 700_000.0  # 1997, or 2067 since 1970; year 1916
_LAST_EXCEL_DAY = 80_000.0  # year 2119
_STEP_MAX_D = 1.2e-5  # 1 s: a number without a unit and with longer steps is not a day

# A time by its name: "Time [s]", "time_2", "t3 (ms)", "timestamp_duplicated_0", as polars calls a second column.
_NAMED = re.compile(
    r"(?P<stem>time|timestamps?|zeit|t)(?:[ _.-]?(?P<number>\d{1,3}))?"
    r"(?:[ _]?[\[(](?P<unit>[^\])]{1,12})[\])]|_(?P<suffix>" + "|".join(TIME.factors) + r"))?"
    r"(?P<again>_duplicated_\d+|\.\d+)?",
    re.IGNORECASE,
)


def time_column(path: Path, columns: Sequence[str], names: Mapping[str, SignalName]) -> str:
    """The column named in [signals], else one with a unit, else one that may contain dates.

    Raises:
        OncenterError: there is no such column.
    """
    found = _usual(columns, names)
    if found is not None:
        return found
    wanted = names["time"].name if "time" in names else "time_s"
    shown = ", ".join(repr(name[:40]) for name in columns[:12])
    more = f" and {len(columns) - 12} more" if len(columns) > 12 else ""
    raise OncenterError(
        f"no time column {wanted!r} in {path.name}: its columns are {shown}{more}; rename the time column, or assign "
        'it in [signals]: time = { name = "...", unit = "s" }',
        code="missing_time",
        needs=("time_s",),
    )


def _usual(columns: Sequence[str], names: Mapping[str, SignalName]) -> str | None:
    named = (names["time"].name,) if "time" in names else ()
    by_name = (column for column in (*named, *_WITH_UNIT) if column in columns)
    without_unit = (column for column in columns if column.lower() in _WITHOUT_UNIT)
    return next(chain(by_name, without_unit, filter(_unit_in_name, columns)), None)


def _unit_in_name(column: str) -> str | None:
    """The key of the unit in the name of a time column, "ms" for "Time [ms]" or "time_2_ms"; None without one."""
    named = _NAMED.fullmatch(column.strip())
    return None if named is None else unit_key(named["unit"] or named["suffix"] or "", dict(TIME.factors))


def times_of_groups(columns: Sequence[str], names: Mapping[str, SignalName]) -> dict[str, str]:
    """By column its time column, in a table in which each group of columns begins with a time of its own: `time_1, a,
    b, time_2, c`. Empty for a table with one time.

    Their names differ in a number only. `[signals] time` may name one of them.
    """
    usual = _usual(columns, names) or next(filter(_NAMED.fullmatch, columns), None)
    times = [column for column in columns if usual is not None and _are_alike(column, usual)]
    found: dict[str, str] = {}
    when = None
    for column in columns:
        if column in times:
            when = column
        elif when is not None:
            found[column] = when
    return found if len(times) > 1 and set(found.values()) == set(times) else {}


def _are_alike(column: str, other: str) -> bool:
    """Whether two names of time columns differ in a number only."""
    return _without_number(column) == _without_number(other)


def _without_number(column: str) -> str:
    named = _NAMED.fullmatch(column.strip())
    if named is None:
        return re.sub(r"(\d+|_duplicated_\d+)$", "", column)
    return f"{named['stem']}|{named['unit'] or named['suffix'] or ''}"


def seconds(path: Path, column: pl.Series, names: Mapping[str, SignalName], unit_in_file: str | None) -> Column:
    """The time column in s, NaN where it is empty; dates since 1970 (UTC if they name no zone).

    Raises:
        OncenterError: it contains neither numbers with a unit nor dates nor times of day.
    """
    dated = _dates(path, column)
    if dated is not None:
        return dated
    values = numbers(path, column)
    factor = _factor(path, column.name, names, unit_in_file, values)
    return in_si(values - _first_day(values) if factor == _DAY_S else values, factor)


def _first_day(days: Column) -> float:
    """1970-01-01 in the calendar of these days: of MATLAB, of Excel, or 0 for others."""
    known = days[np.isfinite(days)]
    least = float(known.min()) if len(known) else 0.0
    if least >= _FIRST_MATLAB_DAY:
        return _MATLAB_DAYS
    return _EXCEL_DAYS if _FIRST_EXCEL_DAY <= least < _LAST_EXCEL_DAY else 0.0


def _are_days(values: Column) -> bool:
    """Whether numbers without a unit can only be days of a calendar: seconds with such steps would be 80 kHz."""
    known = values[np.isfinite(values)]
    return len(known) > 2 and _first_day(known) > 0.0 and 0.0 < float(np.median(np.diff(known))) < _STEP_MAX_D


def _dates(path: Path, column: pl.Series) -> Column | None:
    """Seconds of dates or times of day, as text or as date types; None for anything else."""
    if isinstance(column.dtype, pl.Datetime | pl.Duration):
        return _filled(column.cast(pl.Int64)) * _SECONDS_PER[column.dtype.time_unit]
    if column.dtype == pl.Time:
        return _unwrapped(_filled(column.cast(pl.Int64)) * 1e-9, _DAY_S)
    if column.dtype != pl.String:
        return None
    text = column.str.strip_chars()
    first = text.filter(text.is_not_null() & (text != "")).head(1)
    if first.str.contains(_DATE).any():
        return _filled(_read(path, text, _of_date(text)).cast(pl.Int64)) * 1e-9
    if first.str.contains(_OTHER_DATE).any():
        day, month, year, *time = _groups(path, text, _OTHER_DATE, (1, 3, 4, 5, 6, 7, 8))
        return _of_day(*time) + _DAY_S * _days(path, text, day, month, year, first.item())
    if first.str.contains(_TIME_OF_DAY).any():
        return _unwrapped(_of_day(*_groups(path, text, _TIME_OF_DAY, (1, 2, 3, 4))), _DAY_S)
    if first.str.contains(_OF_HOUR).any():
        minutes, of_minute = _groups(path, text, _OF_HOUR, (1, 2))
        return _unwrapped(60.0 * minutes + of_minute, _HOUR_S)
    return None


def _groups(path: Path, text: pl.Series, pattern: str, places: Sequence[int]) -> list[Column]:
    """Parts of each text as numbers: months by name from 1, "a" and "p" of am and pm as 0 and 12, else as NaN.

    Raises:
        OncenterError: "not_a_time": a text has another form.
    """
    groups = text.str.extract_groups(pattern).struct
    _read(path, text, groups.field("1"))
    found = []
    for place in places:
        part = groups.field(str(place)).str.to_lowercase().str.replace("[,:]", ".")
        if part.str.contains(r"^\p{L}").any():
            part = part.replace(_GERMAN_MONTHS)
            part = part.replace({name: str(number) for number, name in enumerate(_MONTHS, 1)})
            part = part.replace({"a": "0", "p": "12"})
        found.append(_filled(part.cast(pl.Float64, strict=False)))
    return found


def _of_day(hours: Column, minutes: Column, of_minute: Column, half: Column) -> Column:
    """Seconds since midnight."""
    hours = np.where(np.isnan(half), hours, hours % 12.0 + half)
    return np.asarray(3600.0 * hours + 60.0 * minutes + of_minute, np.float64)


def _days(path: Path, text: pl.Series, first: Column, second: Column, third: Column, written: str) -> Column:
    """Days since 1970 of dates in three numbers. With slashes the month or the day comes first, as gives dates at all;
    of two ways the one that takes less time, else the month first.

    Raises:
        OncenterError: "not_a_time": one is not a date.
    """
    ways = [(third, second, first)]
    if re.match(r"\d{3}", written):
        ways = [(first, second, third)]
    elif "/" in written:
        ways.insert(0, (third, first, second))
    possible = []
    for year, month, day in ways:
        is_date = (month >= 1) & (month <= 12) & (day >= 1) & (day <= 31) & (year >= 0)
        whole = np.where(year < 100, year + 2000, year) - 1970.0
        months = np.where(is_date, 12.0 * whole + month - 1.0, 0.0).astype(np.int64).astype("datetime64[M]")
        days = months.astype("datetime64[D]").astype(np.float64) + np.where(is_date, day - 1.0, np.nan)
        known = days[np.isfinite(days)]
        possible.append((len(known), -float(np.ptp(known)) if len(known) else 0.0, days))
    best = max(possible, key=lambda each: each[:2])[2]
    _read(path, text, pl.Series(best, nan_to_null=True))
    return best


def _of_date(text: pl.Series) -> pl.Series:
    """Parses dates; those without a zone are UTC."""
    given = pl.col("text").str.replace(" ", "T").str.replace(",", ".").str.replace(r"\s*[Zz]$", "+00:00")
    given = given.str.replace(r"\s*([+-]\d\d):?(\d\d)$", "$1:$2")
    zoned = pl.when(given.str.contains(r"[+-]\d\d:\d\d$")).then(given).otherwise(given + "+00:00")
    parsed = zoned.str.to_datetime("%Y-%m-%dT%H:%M:%S%.f%:z", time_unit="ns", strict=False)
    return pl.DataFrame({"text": text}).select(parsed).to_series()


def _read(path: Path, text: pl.Series, parsed: pl.Series) -> pl.Series:
    wrong = parsed.is_null() & text.is_not_null() & (text != "")
    if wrong.any():
        row = wrong.arg_max() or 0
        raise OncenterError(
            f"column {text.name}, row {row + 1} of {path.name}: {text[row][:40]!r} is neither a date and time (ISO, "
            "dd.mm.yyyy or mm/dd/yyyy) nor hh:mm:ss",
            code="not_a_time",
        )
    return parsed


def _unwrapped(of_period: Column, period_s: float) -> Column:
    """Adds a day after each midnight, or an hour after each full one."""
    known = np.isfinite(of_period)
    steps = np.diff(of_period[known], prepend=of_period[known][:1])
    of_period[known] += period_s * np.cumsum(np.where(steps < -period_s / 2, 1.0, 0.0))
    return of_period


def _factor(
    path: Path, column: str, names: Mapping[str, SignalName], unit_in_file: str | None, values: Column
) -> float:
    """Factor to seconds. A unit in [signals] applies only to the column named there, and to those of its kind."""
    known = dict(TIME.factors)
    entry = names.get("time")
    in_name = _unit_in_name(column)
    if entry is not None and _are_alike(column, entry.name):
        return known[named_unit("time", entry, known, unit_in_file or in_name)]
    unit = in_name or unit_key(unit_in_file or "", known)
    if unit is None and column.lower() == _OF_ASAMMDF:
        return 1.0
    if unit is None and _are_days(values):
        return _DAY_S
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
