"""CSV and Parquet: the unit of a column comes from its name, a `[signals]` table, or a row of units."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from oncenter.errors import OncenterError
from oncenter.files.own_file import refuse_own_table
from oncenter.nearest_name import did_you_mean
from oncenter.read.csv_text import (
    csv_text,
    header_of,
    separator_of,
    too_long_row,
    whole_rows,
    with_header_as_long_as_rows,
    without_cut_off_row,
)
from oncenter.read.frames import Column
from oncenter.read.identity import Identity, identity_of_columns, identity_of_metadata
from oncenter.read.left_out import LeftOut
from oncenter.read.numbers import in_si, numbers
from oncenter.read.parts import as_status, combined, missing_part, parts_of, true_numbers, unit_of_plus
from oncenter.read.plugins import known_format
from oncenter.read.samples import Samples, steps_of
from oncenter.read.spn import parameter_of, parameters_in, without_codes
from oncenter.read.table_of_frames import refuse_frames
from oncenter.read.time_column import seconds, time_column, times_of_groups
from oncenter.read.units import (
    NOMINAL_WHEEL_RADIUS_M,
    factors,
    is_unit,
    named_unit,
    possible_columns,
    unit_by_suffix,
    unit_key,
)
from oncenter.read.wording import ASSIGN_THEM, counted, damaged, reason_of
from oncenter.signals import PURE_NUMBER, SIGNALS, SignalName

_POLARS_ERRORS = (pl.exceptions.PolarsError, pl.exceptions.PanicException, OSError, ValueError)
_ROWS_OF_WORDS = 4  # below the header, with units or comments
_ROAD_WHEEL = re.compile(r"(road|front|steered)[ _]?wheels?[ _]?(steer(ing)?[ _]?)?angle|(tire|tyre)[ _]?angle", re.I)
SECOND = "_duplicated_0"  # polars' suffix for a repeated column name
Wanted = tuple[str, str, float]  # column, signal, factor to SI with sign


@dataclass(frozen=True)
class Table:
    """A CSV file: its rows as text, units by column (empty without a row of units), and its truck."""

    frame: pl.DataFrame
    units: Mapping[str, str]
    identity: Identity


def read_csv(path: Path, names: Mapping[str, SignalName], notes: list[str]) -> tuple[list[Samples], Identity]:
    """Signals of a `.csv` or `.csv.gz`, and its truck."""
    table = csv_table(path, notes)
    columns = table.frame.columns
    wanted = columns_of(path, columns, names, table.units, notes)
    times = _times(path, columns, names, wanted)
    return _samples_by_time(path, table.frame, times, wanted, names, table.units, notes), table.identity


def csv_table(path: Path, notes: list[str]) -> Table:
    """A `.csv` or `.csv.gz`: separators , ; tab; decimal commas only with ; or tab.

    Raises:
        OncenterError: it cannot be read, has rows of two trucks, or "not_a_log".
    """
    text = csv_text(path)
    separator = separator_of(text)
    header = header_of(path, text, separator)
    refuse_own_table(path, header)
    refuse_frames(path, header)
    text = with_header_as_long_as_rows(text, separator)
    text = without_cut_off_row(path, text, separator, notes)
    try:
        frame = pl.read_csv(text, separator=separator, infer_schema=False, encoding="utf8-lossy")
    except _POLARS_ERRORS as error:
        raise too_long_row(path, text, separator) or _unreadable(path, error) from error
    frame = frame.rename({name: name.strip() for name in frame.columns}) if _distinct(frame.columns) else frame
    frame = _without_short_rows(path, frame, text, separator, notes)
    frame, units = _without_units_row(frame)
    if separator != ",":
        frame = _with_decimal_points(frame)
    return Table(frame, units, identity_of_columns(path, frame.columns, frame.get_column))


def read_parquet(path: Path, names: Mapping[str, SignalName], notes: list[str]) -> tuple[list[Samples], Identity]:
    """Signals of a `.parquet`, and its truck."""
    table, columns, identity = _opened_parquet(path)
    wanted = columns_of(path, columns, names, {}, notes)
    times = _times(path, columns, names, wanted)
    needed = dict.fromkeys([*times.values(), *times, *parts_named(path, columns, names)])
    try:
        frame = table.select(*needed).collect()
    except _POLARS_ERRORS as error:
        raise damaged(path.name, reason_of(error)) from error
    return _samples_by_time(path, frame, times, wanted, names, {}, notes), identity


def column_units(path: Path) -> dict[str, str]:
    """The unit of each column by a row of units, else ""; empty for a file that is neither CSV nor Parquet.

    Raises:
        OncenterError: as `read_csv` and `read_parquet`.
    """
    if os.path.isdir(path):
        return {}
    reader = known_format(path).reader
    if reader.endswith("read_parquet"):
        return dict.fromkeys(_opened_parquet(path)[1], "")
    if not reader.endswith("read_csv"):
        return {}
    table = csv_table(path, [])
    return {column: table.units.get(column, "") for column in table.frame.columns}


def identity_of_table(path: Path) -> Identity:
    """The truck of a CSV or Parquet file, by the parser of its signals.

    Raises:
        OncenterError: as `read_csv` and `read_parquet`.
    """
    is_parquet = known_format(path).reader.endswith("read_parquet")
    return _opened_parquet(path)[2] if is_parquet else csv_table(path, []).identity


def _opened_parquet(path: Path) -> tuple[pl.LazyFrame, list[str], Identity]:
    """A Parquet file, not yet read: its columns, and its truck by metadata, else by columns."""
    source = for_polars(path)
    try:
        table = pl.scan_parquet(source, glob=False)  # opened once for both its schema and its columns
        columns = list(table.collect_schema())
        metadata = pl.read_parquet_metadata(source)
        refuse_own_table(path, columns, metadata)
        refuse_frames(path, columns)
        in_columns = identity_of_columns(path, columns, lambda name: table.select(name).collect().to_series())
    except _POLARS_ERRORS as error:
        raise damaged(path.name, reason_of(error)) from error
    return table, columns, identity_of_metadata(metadata, in_columns)


def for_polars(path: Path) -> Path | bytes:
    """The path, or the content if the path is not valid text, which polars needs."""
    try:
        os.fspath(path).encode()
    except UnicodeEncodeError:
        return path.read_bytes()
    return path


def _distinct(columns: Sequence[str]) -> bool:
    return len({name.strip() for name in columns}) == len(columns)


def _without_short_rows(path: Path, frame: pl.DataFrame, text: bytes, separator: str, notes: list[str]) -> pl.DataFrame:
    """The table without rows that were cut: their last number may also be cut and still look valid."""
    if not frame.width or not frame[frame.columns[-1]].null_count():
        return frame
    whole = whole_rows(text, separator)
    if whole is None or len(whole) != frame.height or whole.all():
        return frame
    short = np.flatnonzero(~whole)
    rows = counted(len(short), "row")
    text_of_note = f"left out {rows} of {path.name} with fewer cells than the header, first row {short[0] + 1}"
    notes.append(LeftOut(text_of_note, "short_row", len(short)))
    return frame.filter(pl.Series(whole))


def _without_units_row(frame: pl.DataFrame) -> tuple[pl.DataFrame, dict[str, str]]:
    """Separates the row of units that some loggers write below the header, with rows of comments above and below: the
    other rows, and units by column."""
    head = frame.head(_ROWS_OF_WORDS)
    numbered = head.select(pl.any_horizontal(pl.all().cast(pl.Float64, strict=False).is_not_null())).to_series()
    for place in range(numbered.arg_max() or 0 if numbered.any() else head.height):
        units = {name: (cell or "").strip().strip("[]()") for name, cell in head.row(place, named=True).items()}
        if sum(is_unit(unit) for unit in units.values()) >= 2:
            below = head.to_series(0).slice(place + 1).str.contains(r"\d").fill_null(True)
            return frame.slice(place + 1 + (below.arg_max() or 0 if below.any() else 0)), units
    return frame, {}


def _with_decimal_points(frame: pl.DataFrame) -> pl.DataFrame:
    """Replaces decimal commas by points, except in columns that also have points: there a comma groups thousands."""
    pointed = frame.select(pl.all().str.contains(".", literal=True).any()).row(0) if frame.height else ()
    commas = [name for name, has_point in zip(frame.columns, pointed, strict=False) if not has_point]
    return frame.with_columns(pl.col(commas).str.replace(",", ".", literal=True))


def _unreadable(path: Path, error: BaseException) -> OncenterError:
    return OncenterError(f"cannot read {path.name}: {reason_of(error)}", code="unreadable_log")


def _times(
    path: Path, columns: Sequence[str], names: Mapping[str, SignalName], wanted: Sequence[Wanted]
) -> dict[str, str]:
    """The time column of each wanted column: as `[signals]` names it, of its group, or the table's.

    Raises:
        OncenterError: "missing_time": there is no such column.
    """
    groups = times_of_groups(columns, names)
    times: dict[str, str] = {}
    for column, signal, _ in wanted:
        entry = names.get(signal)
        if entry is None or entry.name != column or entry.time is None:
            times[column] = groups.get(column) or time_column(path, columns, names)
            continue
        if entry.time not in columns:
            raise missing_part(signal, "time", entry.time, path.name, columns)
        times[column] = entry.time
    return times


def _samples_by_time(
    path: Path,
    frame: pl.DataFrame,
    times: Mapping[str, str],
    wanted: Sequence[Wanted],
    names: Mapping[str, SignalName],
    units: Mapping[str, str],
    notes: list[str],
) -> list[Samples]:
    """Columns in SI, each with its time."""
    whens = list(dict.fromkeys(times.values()))
    if len(whens) == 1:
        return samples_of(path, frame, whens[0], wanted, _with_time(names, times, whens[0]), units, notes)
    given, short = [], None
    parts = parts_named(path, frame.columns, names)
    for when in whens:
        own = [each for each in wanted if times[each[0]] == when]
        group = frame.select(*dict.fromkeys([when, *(column for column, _, _ in own), *parts]))
        try:
            given += samples_of(
                path, group, when, own, _with_time(names, times, when), units, notes, f"column by {when}"
            )
        except OncenterError as error:
            if error.code != "too_short":
                raise
            short = error
            notes += [
                f"{signal}: column {column} left out: fewer than two rows have {when}" for column, signal, _ in own
            ]
    if short is not None and not given:
        raise short
    return given


def _with_time(names: Mapping[str, SignalName], times: Mapping[str, str], when: str) -> Mapping[str, SignalName]:
    """The names with the unit of a time that an entry gives."""
    units = (entry.time_unit for entry in names.values() if times.get(entry.name) == when)
    unit = next(filter(None, units), None)
    return names if unit is None else {**names, "time": SignalName(when, unit)}


def samples_of(
    path: Path,
    frame: pl.DataFrame,
    when: str,
    wanted: Sequence[Wanted],
    names: Mapping[str, SignalName],
    units: Mapping[str, str],
    notes: list[str],
    kind: str = "column",
) -> list[Samples]:
    """Columns in SI, which all have the time of `when`."""
    for column in (when, *(column for column, _, _ in wanted), *parts_named(path, frame.columns, names)):
        if column + SECOND in frame.columns:
            raise OncenterError(
                f"two columns of {path.name} are called {column}: rename or delete one", code="ambiguous_column"
            )
    time = seconds(path, frame[when], names, units.get(when))
    stamped = np.isfinite(time)
    empty = len(time) - int(np.count_nonzero(stamped))
    if empty:
        filled = int(frame.filter(~stamped).select(pl.any_horizontal(_has_content(frame)).sum()).item())
        if filled and kind == "column":
            text = f"left out {counted(filled, 'row')} of {path.name} without a time"
            notes.append(LeftOut(text, "without_time", filled))
    time = time[stamped] if empty else time
    if len(time) < 2:
        raise OncenterError(
            f"{path.name} is too short: at least 2 rows with a time are needed, got {len(time)}", code="too_short"
        )
    steps = steps_of(time)
    given = []
    for column, signal, factor in wanted:
        cells = in_si(numbers(path, frame[column]), factor)
        entry = names.get(signal)
        if entry is not None and entry.name == column and parts_of(entry):
            cells = _whole(path, frame, cells, signal, entry, factor, units)
        own = entry if entry is not None and entry.name == column else None
        stated = as_status(signal, cells, true_numbers(signal, own, {}, f"column {column} of {path.name}"))
        codes = 0 if stated is cells else int(np.count_nonzero(np.isnan(stated) & ~np.isnan(cells)))
        cells = stated
        values = cells[stamped] if empty else cells
        finite = np.isfinite(values)
        complete = bool(finite.all())
        lost = {"without_time": int(np.count_nonzero(~np.isnan(cells[~stamped])))} if empty else {}
        lost["not_available"] = codes
        if not complete:
            lost["infinite"] = int(np.count_nonzero(np.isinf(values)))
            values = np.where(finite, values, np.nan)
        rank = 0 if signal in names and names[signal].name == column else 1
        parameter = parameter_of(column) if rank and not column.startswith(f"{signal}_") else None
        if parameter is not None and parameter.signal == signal:
            rank = parameter.rank
            values, codes = without_codes(path, column, values, parameter)
            complete = complete and not codes
            lost["error_code"] = codes
        labels = (column.lower(),)
        given.append(
            Samples(
                signal,
                time,
                values,
                kind,
                f"column {column}",
                rank,
                labels=labels,
                steps=steps,
                stamps=f"column {when}",
                complete=complete,
                lost={reason: count for reason, count in lost.items() if count},
            )
        )
    return given


def _whole(
    path: Path,
    frame: pl.DataFrame,
    values: Column,
    signal: str,
    entry: SignalName,
    factor: float,
    units: Mapping[str, str],
) -> Column:
    """A column in SI with its other parts, of which `factor` is that of the column."""
    known = factors(signal)
    plus = sign = None
    if entry.plus is not None:
        unit = named_unit(signal, entry, known, units.get(entry.name))
        written = units.get(entry.plus, "") or unit_by_suffix(entry.plus, known) or ""
        own = unit_of_plus(signal, entry, unit, written, units.get(entry.name, ""), known)
        plus = in_si(numbers(path, frame[entry.plus]), entry.factor * known[own])
    if entry.sign_by is not None:
        sign = numbers(path, frame[entry.sign_by])
    return combined(values, plus, sign)


def parts_named(path: Path, columns: Sequence[str], names: Mapping[str, SignalName]) -> list[str]:
    """The columns of further parts that `[signals]` names.

    Raises:
        OncenterError: "missing_part": the table does not have one of them.
    """
    found = []
    for signal, entry in names.items():
        for key, name in parts_of(entry).items() if entry.name in columns else ():
            if name not in columns:
                raise missing_part(signal, key, name, path.name, columns)
            found.append(name)
    return found


def _has_content(frame: pl.DataFrame) -> list[pl.Expr]:
    """Whether a cell has content, for each column: an empty line of a CSV file is not a row."""
    return [pl.col(name).is_not_null() for name in frame.columns]


def columns_of(
    path: Path,
    columns: Sequence[str],
    names: Mapping[str, SignalName],
    units: Mapping[str, str],
    notes: list[str],
    of_format: Sequence[Wanted] = (),
) -> list[Wanted]:
    """The columns that are signals; `of_format` are those that the format itself defines."""
    wanted: list[Wanted] = list(of_format)
    for signal in SIGNALS:
        named = names.get(signal)
        if named is not None and named.name in columns:
            known = factors(signal)
            unit = named_unit(signal, named, known, units.get(named.name))
            wanted.append((named.name, signal, named.factor * known[unit]))
            continue
        if named is not None:
            meant = did_you_mean(named.name, columns)
            notes.append(f"{signal}: [signals] names column {named.name!r}, which does not exist{meant}")
        suffixed = _unit_suffixed(path, columns, signal, units)
        if not suffixed:
            notes += _nearly(columns, signal)
        wanted += suffixed
    found = {signal for _, signal, _ in wanted}
    wanted += [parameter for parameter in parameters_in(columns, units) if parameter[1] not in found]
    if "steering_wheel_angle" not in {signal for _, signal, _ in wanted}:
        notes += [
            f"steering_wheel_angle: column {column} has the name of a road wheel angle: assign it in [signals] with "
            "road_wheel = true"
            for column in columns
            if _ROAD_WHEEL.search(column)
        ][:1]
    if not wanted:
        raise OncenterError(
            f"no signal recognised in {path.name}: its columns are {_listed(columns)}; {ASSIGN_THEM}, or rename them "
            "to steering_wheel_angle_deg, yaw_rate_deg_s, vehicle_speed_km_h, ...",
            code="missing_signal",
            needs=("steering_wheel_angle", "yaw_rate", "vehicle_speed"),
        )
    for signal in {signal for column, signal, _ in wanted if _is_wheel_rate(column, signal, names)}:
        notes.append(f"{signal}: converted from rad/s with a nominal wheel radius of {NOMINAL_WHEEL_RADIUS_M:g} m")
    return wanted


def _is_wheel_rate(column: str, signal: str, names: Mapping[str, SignalName]) -> bool:
    if not signal.startswith("wheel_speed_"):
        return False
    named = names.get(signal)
    entry = named if named is not None and named.name == column else SignalName(column)
    return named_unit(signal, entry, factors(signal)) == "rad_s"


def _unit_suffixed(path: Path, columns: Sequence[str], signal: str, units: Mapping[str, str]) -> list[Wanted]:
    """Columns of a signal with its name and unit, or with its name alone if the row of units has the unit.

    Raises:
        OncenterError: the signal's column has no unit, or two contradictory units.
    """
    known = factors(signal)
    if SIGNALS[signal].quantity is PURE_NUMBER:
        return [(signal, signal, 1.0)] if signal in columns else []
    found = [(f"{signal}_{unit}", signal, factor) for unit, factor in known.items() if f"{signal}_{unit}" in columns]
    for column, _, factor in found:
        written = unit_key(units.get(column, ""), known)
        if written is not None and known[written] != factor:
            raise OncenterError(
                f"column {column} of {path.name} has {units[column]!r} in the row of units, which contradicts its "
                "name: correct one of them",
                code="unit_ambiguous",
            )
    if found or signal not in columns:
        return found
    written = unit_key(units.get(signal, ""), known)
    if written is not None:
        return [(signal, signal, known[written])]
    possible = possible_columns(signal)
    raise OncenterError(
        f"column {signal} of {path.name} has no unit: rename it to {' or '.join(possible)}, "
        "or give its unit in [signals]",
        code="unit_missing",
        needs=possible,
    )


def _nearly(columns: Sequence[str], signal: str) -> list[str]:
    """Notes on columns with the signal's name and an unknown unit."""
    strange = [
        column
        for column in columns
        if column.startswith(f"{signal}_") and column not in SIGNALS and not unit_by_suffix(column, factors(signal))
    ]
    possible = " or ".join(possible_columns(signal))
    return [f"{signal}: column {column} left out: its unit is unknown, rename it to {possible}" for column in strange]


def _listed(columns: Sequence[str]) -> str:
    shown = ", ".join(repr(name[:40]) for name in columns[:12])
    return shown + (f" and {len(columns) - 12} more" if len(columns) > 12 else "")
