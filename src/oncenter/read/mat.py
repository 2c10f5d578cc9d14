"""MATLAB's `.mat`: vectors, structs of vectors, timeseries and "Structure with time", by the rules for CSV files.

A value in a struct is called `struct.field`. Versions 4 to 7 are read by scipy; 7.3 is HDF5, see `mat_hdf5.py`.
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import polars as pl

from oncenter.errors import OncenterError
from oncenter.files.extra import require_package
from oncenter.files.regular_file import open_regular_file
from oncenter.read.channels import (
    Channel,
    Content,
    NoSamples,
    no_signal_recognised,
    not_there,
    samples,
    samples_of,
    with_parts,
    without_zeros,
)
from oncenter.read.frames import Column
from oncenter.read.mat_elements import check_elements
from oncenter.read.mat_values import Budget, Opaque, Value
from oncenter.read.samples import Samples
from oncenter.read.spn import parameter_of, parameters_in, without_codes
from oncenter.read.time_column import seconds, time_column
from oncenter.read.units import TIME, unit_by_suffix
from oncenter.read.wording import damaged, reason_of
from oncenter.signals import SignalName

_HDF5 = b"\x89HDF\r\n\x1a\n"
_OF_GROUP, _OF_GROUPS_TIME = re.compile(r"DG(\d+)_(.+)"), re.compile(r"DGM(\d+)_timestamps")  # as asammdf writes them
_TIME_WORD = re.compile(r"(?:^|(?<=_))(?:time|timestamps?|zeit|t)(?=_|\d|$)|^DGM\d+_timestamps", re.IGNORECASE)
_USER_BLOCK = 512  # bytes before HDF5 in what MATLAB writes
_COLUMNS_MAX = 64  # of a matrix that is read as a table
_HOW_TO_SAVE = (
    "save its columns as numbers: s.time_s = seconds(tt.Time); s.yaw_rate_deg_s = tt.YawRate; "
    "save('drive.mat', '-struct', 's')"
)


def read(path: Path, names: Mapping[str, SignalName], notes: list[str]) -> list[Samples]:
    """Signals of a `.mat`.

    Raises:
        OncenterError: it cannot be read, its time is missing or has no unit, or as for a CSV file; "matlab_object": it
            contains only MATLAB objects; "missing_extra".
    """
    variables = _variables(path)
    objects = sorted({value.kind for value in _every(variables) if isinstance(value, Opaque)})
    channels = with_parts(path, list(_Walk(path, names).channels("", variables, None)), names)
    if not channels:
        raise _without_channels(path, variables, objects, names)
    given = [each for channel in channels for each in samples_of(channel, names, notes)]
    given += _parameters(path, channels, {each.signal for each in given})
    missing = not_there(channels, names, "variable")
    if objects:
        missing.append(f"{_objects(path, objects)} they were left out; {_HOW_TO_SAVE}")
    if not given:
        raise no_signal_recognised(path, channels, names, "variable", [*notes, *missing])
    notes += missing
    return given


def _parameters(path: Path, channels: Sequence[Channel], found: Collection[str]) -> Iterator[Samples]:
    """Vectors with names of J1939 parameters, of signals that were not found by other names."""
    by_name = {channel.name: channel for channel in channels}
    for column, signal, factor in parameters_in(list(by_name), {}):
        channel, named = by_name[column], parameter_of(column)
        try:
            time, values, _, lost = channel.content()
        except NoSamples:
            continue
        if signal not in found and named is not None:
            values, codes = without_codes(path, column, values * factor, named)
            lost = lost | without_zeros({"error_code": codes})
            yield samples(
                column, channel.label, signal, time, values, column, named.rank, lost, "variable", channel.stamps
            )


def _variables(path: Path) -> dict[str, Value]:
    with open_regular_file(path) as file:
        is_hdf5 = _HDF5 in file.read(_USER_BLOCK + len(_HDF5))
    if is_hdf5:
        from oncenter.read.mat_hdf5 import variables

        return variables(path)
    require_package("scipy", path.name)
    import scipy.io

    try:
        content = path.read_bytes()
        if 0 not in content[:4]:  # version 4 begins with a number
            check_elements(content)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            loaded = scipy.io.loadmat(io.BytesIO(content), struct_as_record=True, chars_as_strings=True)
        budget = Budget()
        return {str(name): _of_scipy(value, budget) for name, value in loaded.items() if not _is_of_scipy(str(name))}
    except OncenterError:
        raise
    except Exception as error:  # scipy raises value, type, index and zlib errors for broken files
        raise damaged(path.name, reason_of(error)) from None


def _is_of_scipy(name: str) -> bool:
    return name in ("__header__", "__version__", "__globals__", "__function_workspace__")


def _of_scipy(value: Any, budget: Budget) -> Value:
    from scipy.io.matlab import MatlabFunction, MatlabOpaque

    if isinstance(value, MatlabFunction) or not isinstance(value, np.ndarray):
        return None
    if isinstance(value, MatlabOpaque):
        called = set(value.dtype.names or ()) & {"s2", "_Class"}  # the latter from scipy 1.18 on
        return Opaque(_text(value[called.pop()]) if called else "")
    if value.dtype.names:
        with budget.deeper(value.size):
            each = [{name: _of_scipy(one[name], budget) for name in value.dtype.names} for one in value.flat]
        return each[0] if len(each) == 1 else each
    if value.dtype.kind in "US":
        return _text(value)
    return value if value.dtype.kind in "biuf" else None


def _text(value: Any) -> str:
    first = np.asarray(value).flat[0] if np.asarray(value).size else ""
    return first.decode("utf-8", "replace") if isinstance(first, bytes) else str(first)


def _every(value: Value) -> Iterator[Value]:
    yield value
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    for each in inner:
        yield from _every(each)


def _objects(path: Path, objects: Sequence[str]) -> str:
    kinds = ", ".join(filter(None, objects))
    return f"{path.name} has MATLAB objects ({kinds or 'of unknown class'}) that only MATLAB can read;"


def _without_channels(
    path: Path, variables: Mapping[str, Value], objects: Sequence[str], names: Mapping[str, SignalName]
) -> OncenterError:
    if objects:
        return OncenterError(f"{_objects(path, objects)} {_HOW_TO_SAVE}", code="matlab_object")
    if not variables:
        return OncenterError(f"{path.name} has no variables", code="empty_log")
    try:
        time_column(path, list(variables), names)
    except OncenterError as error:
        return error
    return OncenterError(
        f"{path.name} has no vectors with the same length as a time vector: {_HOW_TO_SAVE}", code="missing_signal"
    )


class _Time:
    """A time vector shared by channels. Its errors are raised only when such a channel is read.

    Args:
        name: of the variable, for messages.
        rows: number of stamps.
        in_s: gives the stamps in s.
    """

    def __init__(self, name: str, rows: int, in_s: Callable[[], Column]) -> None:
        self.name, self.rows, self._in_s = name, rows, in_s

    @cached_property
    def kept(self) -> npt.NDArray[np.bool_]:
        """Which stamps are finite."""
        return np.isfinite(self._all)

    @cached_property
    def seconds(self) -> Column:
        """The finite stamps in s."""
        if np.count_nonzero(self.kept) < 2:
            raise NoSamples(f"has no time: {self.name} has fewer than two valid stamps")
        return self._all[self.kept]

    @cached_property
    def _all(self) -> Column:
        return self._in_s()


class _Walk:
    """Variables and struct fields as channels, each with the time of its struct or of the next enclosing one."""

    def __init__(self, path: Path, names: Mapping[str, SignalName]) -> None:
        self._path, self._names = path, names

    def channels(self, label: str, fields: Mapping[str, Value], around: _Time | None) -> Iterator[Channel]:
        """
        Args:
            label: of the struct with these fields; empty for variables.
            around: the time of the enclosing struct.
        """
        simulink, series = _simulink(fields), _timeseries(fields)
        if simulink is not None:
            yield from self._columns(label, simulink, _of_seconds(f"{label}.time", fields["time"]))
            return
        if series is not None:
            outer, _, name = label.rpartition(".")
            time = _of_seconds(f"{label}.Time", fields["Time"])
            yield from self._columns(outer, {name: fields["Data"]}, time, series)
            return
        nearest = self._time(label, fields) or around
        vectors = _vectors(fields)
        own = self._own_times(label, vectors, nearest)
        for name, time in own.items():
            yield from self._columns(label, {name: vectors[name]}, time)
        others = {name: value for name, value in vectors.items() if name not in own}
        if nearest is not None:
            yield from self._columns(label, others, nearest)
        else:
            yield from _pairs(label, others)
        for name, value in fields.items():
            for place, struct in _structs(value):
                yield from self.channels(_full(label, name) + place, struct, nearest)

    def _columns(self, label: str, values: Mapping[str, Any], time: _Time, unit: str = "") -> Iterator[Channel]:
        """A vector is one channel; a matrix with a row or column per stamp is several, indexed as in MATLAB."""
        for name, value in values.items():
            for place, column in _columns_of(value, time.rows):
                if _full(label, name) + place != time.name:
                    content = partial(_content, column, time, unit)
                    of_group = _OF_GROUP.match(name)
                    called = of_group[2] if of_group else name
                    alias = _full(label, name) + place if of_group else ""
                    yield Channel(called + place, label, content, "variable", f"variable {time.name}", alias)

    def _time(self, label: str, fields: Mapping[str, Value]) -> _Time | None:
        """The time among these fields, by the rules for CSV files; None without one."""
        vectors = _vectors(fields)
        names = self._names
        if label and "time" in names and names["time"].name.startswith(f"{label}."):
            names = {**names, "time": replace(names["time"], name=names["time"].name.removeprefix(f"{label}."))}
        by_name = {name + place: column for name, value in vectors.items() for place, column in _columns_of(value, 0)}
        try:
            name = time_column(self._path, list(by_name), names)
        except OncenterError:
            return None
        column = by_name[name]
        series = pl.Series(name, column.astype(np.float64))
        return _Time(_full(label, name), len(column), partial(seconds, self._path, series, names, None))

    def _own_times(self, label: str, vectors: Mapping[str, Any], nearest: _Time | None) -> dict[str, _Time]:
        """The times of vectors that have another one than the rest: as `[signals]` names it, by asammdf's groups, by
        name (`t_can` for `can_angle`, `angle_t` for `angle`), or as the only one of the same length."""
        times = _Times.among(vectors)
        named = {each.name.removeprefix(f"{label}."): each for each in self._names.values() if each.time is not None}
        found: dict[str, _Time] = {}
        for name, value in vectors.items():
            entry = named.get(name)
            when = entry.time.removeprefix(f"{label}.") if entry is not None and entry.time is not None else ""
            if entry is not None and when in vectors:
                found[name] = self._time_of(label, when, vectors[when], entry.time_unit)
            elif name not in times.stamps and (when := times.of(name, value, nearest)):
                found[name] = self._time_of(label, when, vectors[when], None)
        return found

    def _time_of(self, label: str, name: str, value: Any, unit: str | None) -> _Time:
        stamps = np.ravel(value).astype(np.float64)
        if _OF_GROUPS_TIME.match(name):
            return _Time(_full(label, name), len(stamps), lambda: stamps)
        series = pl.Series(name, stamps)
        unit = unit or unit_by_suffix(name, dict(TIME.factors))
        common = self._names.get("time")
        entry = SignalName(name, unit or (common.unit if common is not None else None))
        return _Time(_full(label, name), len(stamps), partial(seconds, self._path, series, {"time": entry}, None))


def _is_time(value: Any) -> bool:
    stamps = np.ravel(value)
    return stamps.dtype.kind in "iuf" and bool(np.all(np.diff(stamps.astype(np.float64)) >= 0.0))


class _Times(NamedTuple):
    """The vectors of a struct that may be times.

    Attributes:
        stamps: number of stamps, by name.
        rests: by name the rest of the name, "can" for "t_can".
        groups: name by asammdf's number of the group.
    """

    stamps: dict[str, int]
    rests: dict[str, str]
    groups: dict[str, str]

    @classmethod
    def among(cls, vectors: Mapping[str, Any]) -> _Times:
        stamps = {name: each.size for name, each in vectors.items() if _TIME_WORD.search(name) and _is_time(each)}
        rests = {name: _TIME_WORD.sub("", name).strip("_").lower() for name in stamps}
        groups = {found[1]: name for name in stamps if (found := _OF_GROUPS_TIME.match(name))}
        return cls(stamps, {name: rest for name, rest in rests.items() if rest}, groups)

    def of(self, name: str, value: Any, nearest: _Time | None) -> str:
        """The vector with the times of another one; empty for that of the struct."""
        of_group = _OF_GROUP.match(name)
        if of_group or not self.stamps:
            return self.groups.get(of_group[1], "") if of_group else ""
        rows = nearest.rows if nearest is not None else 0
        size = len(_columns_of(value, rows)[0][1]) if _columns_of(value, rows) else 0
        fitting = [each for each, stamps in self.stamps.items() if stamps == size]
        related = [each for each in fitting if _are_related(name.lower(), self.rests.get(each, ""))]
        if related:
            return max(related, key=lambda each: len(self.rests[each]))
        return fitting[0] if len(fitting) == 1 and size != rows else ""


def _are_related(name: str, rest: str) -> bool:
    """Whether the rest of a time's name is a part of another name: "can" of "can_angle", "2" of "angle2"."""
    if rest.isdigit():
        return name.endswith(rest) and not name.removesuffix(rest)[-1:].isdigit()
    return bool(rest) and f"_{rest}_" in f"_{name}_"


def _pairs(label: str, values: Mapping[str, Any]) -> Iterator[Channel]:
    """Matrices of two columns without a time beside them: Vector's tools write each signal as times in s and values."""
    for name, value in values.items():
        if value.ndim == 2 and value.shape[1] == 2 and _is_time(value[:, 0]):
            time = _of_seconds(f"{_full(label, name)}(:,1)", value[:, 0])
            content = partial(_content, value[:, 1], time, "")
            yield Channel(name, label, content, "variable", f"variable {time.name}")


def _of_seconds(name: str, value: Any) -> _Time:
    stamps = np.ravel(value).astype(np.float64)
    return _Time(name, len(stamps), lambda: stamps)


def _full(label: str, name: str) -> str:
    return f"{label}.{name}" if label else name


def _vectors(fields: Mapping[str, Value]) -> dict[str, Any]:
    return {name: value for name, value in fields.items() if isinstance(value, np.ndarray) and value.size > 1}


def _structs(value: Value) -> Iterator[tuple[str, Mapping[str, Value]]]:
    """A struct, or the elements of a struct array with their MATLAB index."""
    if isinstance(value, dict):
        yield "", value
    elif isinstance(value, list):
        for place, struct in enumerate(value, 1):
            yield f"({place})", struct


def _simulink(fields: Mapping[str, Value]) -> dict[str, Any] | None:
    """Values by label of Simulink's "Structure with time": `time` in s and one struct per signal; else None."""
    signals = fields.get("signals")
    if not isinstance(fields.get("time"), np.ndarray) or not isinstance(signals, dict | list):
        return None
    values: dict[str, Any] = {}
    for place, signal in enumerate([signals] if isinstance(signals, dict) else signals, 1):
        label = signal.get("label")
        name = label if isinstance(label, str) and label and label not in values else f"signals({place})"
        values[name] = signal.get("values")
    return _vectors(values)


def _timeseries(fields: Mapping[str, Value]) -> str | None:
    """The unit of a timeseries saved as a struct (`Time` in s, `Data`); "" without a unit, None for other structs."""
    if not isinstance(fields.get("Time"), np.ndarray) or not isinstance(fields.get("Data"), np.ndarray):
        return None
    info = fields.get("DataInfo")
    unit = info.get("Units") if isinstance(info, dict) else None
    return unit if isinstance(unit, str) else ""


def _columns_of(value: Any, rows: int) -> list[tuple[str, Any]]:
    """Columns with their MATLAB index. If no side has `rows` elements, the longer side of a matrix is the time."""
    if value.size == rows or value.ndim != 2 or min(value.shape) == 1:
        return [("", np.ravel(value))]
    high, wide = value.shape
    if high == rows or (wide != rows and high >= wide):
        return [(f"(:,{k + 1})", value[:, k]) for k in range(wide)] if wide <= _COLUMNS_MAX else []
    return [(f"({k + 1},:)", value[k]) for k in range(high)] if high <= _COLUMNS_MAX else []


def _content(column: Any, time: _Time, unit: str) -> Content:
    if len(column) != time.rows:
        raise NoSamples(f"has {len(column)} values, but {time.name} has {time.rows}")
    cells = column.astype(np.float64)
    values = cells[time.kept]
    lost = {
        "without_time": int(np.count_nonzero(~np.isnan(cells[~time.kept]))),
        "infinite": int(np.count_nonzero(np.isinf(values))),
    }
    return Content(time.seconds, np.where(np.isfinite(values), values, np.nan), unit, without_zeros(lost))
