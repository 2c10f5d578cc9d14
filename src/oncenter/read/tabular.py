"""CSV and Parquet: columns whose names say their units, or that a `[signals]` table names."""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import polars as pl

from oncenter.errors import OncenterError
from oncenter.read.frames import Column
from oncenter.read.samples import Samples
from oncenter.read.units import TIME, columns_that_would_do, factors, named_unit, unit_by_suffix
from oncenter.signals import PURE_NUMBER, SIGNALS, SignalName

_NO_NUMBER = ("", "na", "n/a", "nan", "null", "none")  # what CSV writers put for "not available"
_POLARS_ERRORS = (pl.exceptions.PolarsError, pl.exceptions.PanicException, OSError, ValueError)


def read_csv(path: Path, names: Mapping[str, SignalName], notes: list[str]) -> list[Samples]:
    """Signals of a `.csv` or `.csv.gz`; separators , ; tab; a decimal comma where ; separates."""
    text = _csv_text(path)
    header = text.lstrip(b"\xef\xbb\xbf\r\n ").split(b"\n", 1)[0]
    if not header.strip():
        raise OncenterError(f"{path.name} is empty", code="empty_log")
    separator = max(",;\t", key=lambda mark: header.count(mark.encode()))
    try:
        frame = pl.read_csv(text, separator=separator, infer_schema=False, encoding="utf8-lossy")
    except _POLARS_ERRORS as error:
        raise _unreadable(path, error) from error
    frame = frame.rename({name: name.strip() for name in frame.columns}) if _distinct(frame.columns) else frame
    if separator == ";":
        frame = frame.with_columns(pl.all().str.replace(",", ".", literal=True))
    time_column, wanted = _columns(path, frame.columns, names, notes)
    return _samples(path, frame, time_column, wanted, names, notes)


def read_parquet(path: Path, names: Mapping[str, SignalName], notes: list[str]) -> list[Samples]:
    """Signals of a `.parquet`."""
    try:
        columns = list(pl.read_parquet_schema(path))
        time_column, wanted = _columns(path, columns, names, notes)
        needed = dict.fromkeys([time_column, *(column for column, _, _ in wanted)])
        frame = pl.read_parquet(path, columns=list(needed))
    except _POLARS_ERRORS as error:
        raise _unreadable(path, error) from error
    return _samples(path, frame, time_column, wanted, names, notes)


def _distinct(columns: Sequence[str]) -> bool:
    return len({name.strip() for name in columns}) == len(columns)


def _csv_text(path: Path) -> bytes:
    data = path.read_bytes()
    if not path.name.lower().endswith(".gz"):
        return data
    try:
        return gzip.decompress(data)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise _unreadable(path, error) from error


def _unreadable(path: Path, error: BaseException) -> OncenterError:
    reason = (str(error).strip().splitlines() or [type(error).__name__])[0]
    return OncenterError(f"cannot read {path.name}: {reason}", code="unreadable_log")


def _samples(
    path: Path,
    frame: pl.DataFrame,
    time_column: str,
    wanted: Sequence[tuple[str, str, float]],
    names: Mapping[str, SignalName],
    notes: list[str],
) -> list[Samples]:
    """Columns in SI; `wanted` is column, signal and factor."""
    time = _numbers(path, frame[time_column]) * _time_factor(time_column, names)
    stamped = np.isfinite(time)
    if not stamped.all():
        notes.append(f"{int((~stamped).sum())} rows of {path.name} have no time and were left out")
    time = time[stamped]
    if len(time) < 2:
        raise OncenterError(f"{path.name} has {len(time)} rows with a time, at least 2 are needed", code="too_short")
    given = []
    for column, signal, factor in wanted:
        values = _numbers(path, frame[column])[stamped] * factor
        values[~np.isfinite(values)] = np.nan
        rank = 0 if signal in names and names[signal].name == column else 1
        given.append(Samples(signal, time, values, "column", f"column {column}", rank, labels=(column.lower(),)))
    return given


def _columns(
    path: Path, columns: Sequence[str], names: Mapping[str, SignalName], notes: list[str]
) -> tuple[str, list[tuple[str, str, float]]]:
    """The time column, and column, signal and factor to SI (with sign) of every column that is a signal."""
    wanted = []
    for signal in SIGNALS:
        named = names.get(signal)
        if named is not None and named.name in columns:
            known = factors(signal)
            wanted.append((named.name, signal, named.sign * known[named_unit(signal, named, known)]))
            continue
        if named is not None:
            notes.append(f"{signal}: no column {named.name!r}, which [signals] names")
        suffixed = _unit_suffixed(path, columns, signal)
        if not suffixed:
            notes += _nearly(columns, signal)
        wanted += suffixed
    if not wanted:
        raise OncenterError(
            f"no known signal in {path.name}: its columns are {_listed(columns)}; name them in a [signals] table, or "
            "call them steering_wheel_angle_deg, yaw_rate_deg_s, vehicle_speed_km_h, ...",
            code="missing_signal",
            needs=("steering_wheel_angle", "yaw_rate", "vehicle_speed"),
        )
    for signal in {signal for column, signal, _ in wanted if _is_wheel_rate(column, signal, names)}:
        notes.append(f"{signal}: rad/s taken as speed with a nominal wheel radius of 0.5 m")
    return _time_column(path, columns, names), wanted


def _is_wheel_rate(column: str, signal: str, names: Mapping[str, SignalName]) -> bool:
    if not signal.startswith("wheel_speed_"):
        return False
    named = names.get(signal)
    entry = named if named is not None and named.name == column else SignalName(column)
    return named_unit(signal, entry, factors(signal)) == "rad_s"


def _unit_suffixed(path: Path, columns: Sequence[str], signal: str) -> list[tuple[str, str, float]]:
    """Columns of a signal that are called as the contract says.

    Raises:
        OncenterError: the signal's column has no unit.
    """
    known = factors(signal)
    if SIGNALS[signal].quantity is PURE_NUMBER:
        return [(signal, signal, 1.0)] if signal in columns else []
    found = [(f"{signal}_{unit}", signal, factor) for unit, factor in known.items() if f"{signal}_{unit}" in columns]
    if not found and signal in columns:
        would_do = columns_that_would_do(signal)
        raise OncenterError(
            f"column {signal} of {path.name} has no unit: call it {' or '.join(would_do)}",
            code="unit_missing",
            needs=would_do,
        )
    return found


def _nearly(columns: Sequence[str], signal: str) -> list[str]:
    """Notes on columns that are called like the signal, with a unit that nobody knows."""
    strange = [
        column
        for column in columns
        if column.startswith(f"{signal}_") and column not in SIGNALS and not unit_by_suffix(column, factors(signal))
    ]
    would_do = " or ".join(columns_that_would_do(signal))
    return [f"{signal}: column {column} has no known unit, {would_do} would do" for column in strange]


def _time_column(path: Path, columns: Sequence[str], names: Mapping[str, SignalName]) -> str:
    named = names["time"].name if "time" in names else "time_s"
    for column in (named, "time_s"):
        if column in columns:
            return column
    raise OncenterError(
        f"no time column {named!r} in {path.name}: its columns are {_listed(columns)}",
        code="missing_time",
        needs=("time_s",),
    )


def _time_factor(column: str, names: Mapping[str, SignalName]) -> float:
    """To seconds; the unit that [signals] gives is that of the column it names."""
    entry = names.get("time")
    if entry is None or entry.name != column:
        return 1.0
    return TIME.factors[named_unit("time", entry, dict(TIME.factors))]


def _numbers(path: Path, column: pl.Series) -> Column:
    """A column as numbers, NaN where empty.

    Raises:
        OncenterError: text where a number belongs.
    """
    if column.dtype.is_numeric() or column.dtype in (pl.Boolean, pl.Null):
        return _filled(column.cast(pl.Float64))
    if column.dtype != pl.String:
        raise OncenterError(
            f"column {column.name} of {path.name} is {column.dtype}, numbers are needed", code="not_a_number"
        )
    text = column.str.strip_chars()
    numbers = text.cast(pl.Float64, strict=False)
    wrong = numbers.is_null() & text.is_not_null() & ~text.str.to_lowercase().is_in(_NO_NUMBER)
    if wrong.any():
        row = wrong.arg_max() or 0
        raise OncenterError(
            f"column {column.name}, row {row + 1} of {path.name}: {text[row][:40]!r} is not a number",
            code="not_a_number",
        )
    return _filled(numbers)


def _filled(column: pl.Series) -> Column:
    return column.fill_null(float("nan")).to_numpy().astype(np.float64, copy=True)


def _listed(columns: Sequence[str]) -> str:
    shown = ", ".join(repr(name[:40]) for name in columns[:12])
    return shown + (f" and {len(columns) - 12} more" if len(columns) > 12 else "")
