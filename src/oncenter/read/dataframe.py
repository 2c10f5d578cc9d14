"""Tables in memory (pandas, polars, pyarrow, plain arrays), by the rules for CSV files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.read.as_signals import as_signals
from oncenter.read.identity import Identity, identity_of_columns
from oncenter.read.samples import Samples
from oncenter.read.tabular import columns_of, parts_named, samples_of
from oncenter.read.time_column import time_column
from oncenter.signals import SignalName, Signals
from oncenter.vehicle import Vehicle

_NAME = Path("dataframe")  # in messages
_INDEX_NAME = "time"  # of an index of dates without a name
_Columns = dict[str, Callable[[], Any]]  # by name, a function that gives the values: only needed ones are converted


def from_dataframe(frame: object, vehicle: Vehicle | None = None) -> Signals:
    """The signals of a table in memory, as `oncenter.read` gives them for a CSV file.

    Args:
        frame: a DataFrame of pandas or polars, a table of pyarrow, any object with Arrow's PyCapsule interface or the
            dataframe interchange protocol, or a dict of arrays. The suffix of a column is its unit: `time_s`,
            `steering_wheel_angle_deg`, `yaw_rate_deg_s`, `vehicle_speed_km_h`, `lateral_acceleration_m_s2`. The time
            may also be a column of dates, or pandas' index of dates.
        vehicle: its `[signals]` table assigns columns with other names.

    Raises:
        OncenterError: "not_a_table", exit code 2; else as `oncenter.read`.
    """
    notes: list[str] = []
    try:
        samples, about = samples_of_frame(frame, _NAME, {} if vehicle is None else vehicle.signal_names, notes)
    except NoTable as wrong:
        raise OncenterError(f"from_dataframe: {wrong}", code="not_a_table", exit_code=WRONG_USAGE) from None
    return as_signals(_NAME, samples, {}, notes, about)


class NoTable(Exception):
    """The object given is not a table; the text gives the reason in one line."""


def samples_of_frame(
    frame: object, name: Path, names: Mapping[str, SignalName], notes: list[str]
) -> tuple[list[Samples], Identity]:
    """The signals of a table in memory, and its truck.

    Args:
        frame: as for `from_dataframe`.
        name: its name in messages.
        names: a vehicle's `[signals]` table.
        notes: receives what was left out.

    Raises:
        NoTable: it is not a table.
        OncenterError: as `oncenter.read` of a CSV file.
    """
    by_name = _columns(frame)
    wanted = columns_of(name, list(by_name), names, {}, notes)
    when = time_column(name, list(by_name), names)
    parts = parts_named(name, list(by_name), names)
    needed = dict.fromkeys([when, *(column for column, _, _ in wanted), *parts])
    series = [_series(column, by_name[column]()) for column in needed]
    if len({len(each) for each in series}) > 1:
        lengths = ", ".join(f"{each.name} {len(each)}" for each in series)
        raise NoTable(f"all columns must have the same length, got {lengths}")
    about = identity_of_columns(name, list(by_name), lambda column: _series(column, by_name[column]()))
    return samples_of(name, pl.DataFrame(series), when, wanted, names, {}, notes), about


def _columns(frame: object) -> _Columns:
    given: Any = frame
    if isinstance(given, pl.LazyFrame):
        given = given.collect()
    if isinstance(given, Mapping):
        return {str(name): partial(given.__getitem__, name) for name in given}
    if isinstance(given, pl.DataFrame):
        return _of_polars(given)
    if hasattr(given, "iloc") and hasattr(given, "columns") and hasattr(given, "index"):
        return _of_pandas(given)
    try:
        if hasattr(given, "__arrow_c_stream__"):
            return _of_polars(pl.DataFrame(given))
        if hasattr(given, "__dataframe__"):
            return _of_polars(pl.from_dataframe(given))
    except (pl.exceptions.PolarsError, ImportError, TypeError, ValueError) as error:
        raise NoTable((str(error).splitlines() or [type(error).__name__])[0]) from error
    raise NoTable(f"expected a DataFrame, an Arrow table or a dict of arrays, got {type(given).__name__}")


def _of_polars(frame: pl.DataFrame) -> _Columns:
    return {name: partial(frame.get_column, name) for name in frame.columns}


def _of_pandas(frame: Any) -> _Columns:
    """Works without importing pandas or pyarrow. An index with a name, or of dates, counts as a column."""
    columns: _Columns = {}
    for position, name in enumerate(frame.columns):
        if str(name) in columns:
            raise NoTable(f"two columns are called {name}: rename or delete one")
        columns[str(name)] = partial(frame.iloc.__getitem__, (slice(None), position))
    index = frame.index
    is_of_dates = str(getattr(index, "dtype", "")).startswith(("datetime64", "timedelta64"))
    index_name = getattr(index, "name", None) or (_INDEX_NAME if is_of_dates else None)
    if index_name is not None and str(index_name) not in columns:
        columns[str(index_name)] = partial(getattr, frame, "index")
    return columns


def _series(name: str, values: Any) -> pl.Series:
    """A column as a polars series, from any kind of array."""
    if isinstance(values, pl.Series):
        return values.alias(name)
    try:
        return _of_array(name, values)
    except (pl.exceptions.PolarsError, TypeError, ValueError, OverflowError) as error:
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise NoTable(f"column {name}: {reason}") from error


def _of_array(name: str, values: Any) -> pl.Series:
    kind = str(getattr(values, "dtype", ""))
    if kind.startswith(("datetime64", "timedelta64")):  # pandas keeps dates with a time zone in UTC
        return pl.Series(name, np.asarray(values, dtype=f"{kind[: kind.index('64')]}64[ns]"))
    array = np.asarray(values)
    if array.ndim != 1:
        raise ValueError(f"expected one number per row, got an array of shape {array.shape}")
    if array.dtype != object:
        return pl.Series(name, array)
    if all(isinstance(value, str) or value is None for value in array):
        return pl.Series(name, array.tolist(), pl.String)
    missing = [type(value).__name__ == "NAType" or value is None or value != value for value in array]
    return pl.Series(name, [None if gone else value for gone, value in zip(missing, array, strict=True)])
