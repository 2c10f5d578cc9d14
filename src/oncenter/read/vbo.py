"""Racelogic's `.vbo`: sections of text, then rows of numbers separated by blanks.

From Racelogic's description of the format: latitude and longitude are in minutes, longitude is positive to the west,
the time is hhmmss.ss UTC, and the listed units belong to the last channels: the standard channels have none.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import polars as pl

from oncenter.errors import OncenterError
from oncenter.read.identity import Identity, identity_of_columns
from oncenter.read.left_out import CutOff, LeftOut
from oncenter.read.numbers import numbers
from oncenter.read.samples import Samples
from oncenter.read.tabular import columns_of, samples_of
from oncenter.read.units import factors, unit_key
from oncenter.read.wording import counted
from oncenter.signals import SIGNALS, SignalName

_HEADER, _UNITS, _NAMES, _DATA = b"[header]", b"[channel units]", b"[column names]", b"[data]"
_CREATED = re.compile(rb"File created on (\d\d)/(\d\d)/(\d{4})")
_BLANKS = re.compile(rb"[ \t]+")
_SPEED = re.compile(r"velocity[ _(]*(kmh|km/h|mph|m/s|knots|kts)\b")
_KM_H_PER = {"kmh": 1.0, "km/h": 1.0, "mph": 1.609344, "m/s": 3.6, "knots": 1.852, "kts": 1.852}
_DAY_S = 86400.0
_TIME = "time_s"
_NO_UNIT = ("", "(null)")


# Standard channels, without case, blanks, _ and -.
_STANDARD = frozenset(
    "sats time lat long velocity heading height vertvel verticalvelocity tsample sampleperiod solutiontype "
    "avifileindex avitime avisynctime event1 event1time longacc latacc pordistance distance date".split()
)


@dataclass(frozen=True)
class _Known:
    """A channel recognised by its name.

    Attributes:
        signal: that it gives.
        unit: if the file gives no unit.
        names: in files, without case, blanks, _ and -; the first available one is used.
        sign: -1 if it is positive to the right, or to the west.
        per_unit: `unit` per unit of the file.
        note: for the user, if the meaning is not certain.
    """

    signal: str
    unit: str
    names: tuple[str, ...]
    sign: int = 1
    per_unit: float = 1.0
    note: str = ""


_KNOWN = (
    _Known("latitude", "deg", ("lat", "latitude"), 1, 1 / 60),
    _Known("longitude", "deg", ("long", "longitude"), -1, 1 / 60),
    _Known("course", "deg", ("heading",)),  # direction of the velocity: one antenna does not measure heading
    _Known(
        "yaw_rate",
        "deg_s",
        ("yawrate", "imuyawrate", "yawrateimu"),
        -1,
        note="is read as positive clockwise, as Racelogic's IMU gives it; if left is positive, assign it in [signals]",
    ),
    _Known("lateral_acceleration", "g", ("yaccel", "yacceleration", "imuyaccel")),
    _Known(
        "lateral_acceleration",
        "g",
        ("latacc", "lataccel", "lateralacceleration"),
        note="is computed from GNSS speed and course, so it does not contain the road bank",
    ),
    _Known("longitudinal_acceleration", "g", ("xaccel", "xacceleration", "imuxaccel")),
    _Known("steering_wheel_angle", "deg", ("steeringwheelangle", "steeringangle")),
)


@dataclass
class _File:
    """The sections before the rows."""

    header: list[str] = field(default_factory=list)
    units: list[str] = field(default_factory=list)
    columns: list[str] = field(default_factory=list)
    midnight_s: float = 0.0  # since 1970, of the day on which the file was made


def read(path: Path, names: Mapping[str, SignalName], notes: list[str]) -> tuple[list[Samples], Identity]:
    """Signals of a `.vbo`, and its truck: standard channels by name, all others by `[signals]`.

    Raises:
        OncenterError: it is not a .vbo file, has no rows, or as for a CSV file.
    """
    head, body = _parted(path)
    file = _described(path, head)
    units = _units_by_column(path, file, notes)
    frame = _with_time(path, _rows(path, body, file.columns, notes), file.midnight_s)
    named = {signal: _with_unit(entry, units) for signal, entry in names.items() if signal != "time"}
    frame = _with_known(path, frame, file, units, named, notes)
    wanted = columns_of(path, frame.columns, named, {}, notes)
    about = identity_of_columns(path, frame.columns, frame.get_column)
    return samples_of(path, frame, _TIME, wanted, named, {}, notes), about


def _with_unit(entry: SignalName, units: Mapping[str, str]) -> SignalName:
    """Adds the unit from the file if `[signals]` gives none."""
    return replace(entry, unit=entry.unit or units.get(entry.name) or None)


def _parted(path: Path) -> tuple[list[bytes], bytes]:
    """Lines before the rows, and the rows."""
    content = path.read_bytes().removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    head, mark, body = content.partition(b"\n" + _DATA)
    if not mark:
        raise _unreadable(path, "it has no [data] section: the file is cut off or has another format")
    return [line.strip() for line in head.split(b"\n")], body.partition(b"\n")[2]


def _described(path: Path, head: Sequence[bytes]) -> _File:
    file, section = _File(), b""
    for line in head:
        created = _CREATED.match(line)
        if created:
            file.midnight_s = _midnight(created)
        if line.startswith(b"["):
            if section == _UNITS and file.units and not file.units[-1]:
                file.units.pop()  # the blank line between sections
            section = line.lower()
            continue
        text = line.decode("utf-8", "replace") if _is_utf8(line) else line.decode("cp1252", "replace")
        if section == _HEADER and line:
            file.header.append(text)
        elif section == _UNITS:
            file.units.append(text)
        elif section == _NAMES:
            file.columns += text.split()
    if not file.columns:
        raise _unreadable(path, "it has no [column names] section")
    if len(set(file.columns)) < len(file.columns):
        twice = next(name for name in file.columns if file.columns.count(name) > 1)
        raise OncenterError(
            f"two columns of {path.name} are called {twice}: rename or delete one", code="ambiguous_column"
        )
    return file


def _units_by_column(path: Path, file: _File, notes: list[str]) -> dict[str, str]:
    """Units by column. Each channel that is not standard has one line, which may be blank."""
    columns = [name for name in file.columns if _plain(name) not in _STANDARD]
    units = list(file.units)
    while len(units) > len(columns) and not units[-1]:
        units.pop()
    if not any(units):
        return {}
    if len(units) != len(columns):
        notes.append(
            f"{path.name} has {len(units)} [channel units] for {len(columns)} channels: the units were ignored, "
            "give them in [signals]"
        )
        return {}
    return {name: unit for name, unit in zip(columns, units, strict=True) if unit not in _NO_UNIT}


def _is_utf8(line: bytes) -> bool:
    try:
        line.decode()
    except UnicodeDecodeError:
        return False
    return True


def _midnight(created: re.Match[bytes]) -> float:
    day, month, year = (int(part) for part in created.groups())
    try:
        return datetime(year, month, day, tzinfo=UTC).timestamp()
    except ValueError:
        return 0.0


def _rows(path: Path, body: bytes, columns: Sequence[str], notes: list[str]) -> pl.DataFrame:
    """All cells as text. Rows with another number of cells are left out with a note."""
    ends_whole = body.endswith(b"\n")
    lines = [line for line in (_BLANKS.sub(b" ", line.strip()) for line in body.split(b"\n")) if line]
    if lines and not ends_whole and lines[-1].count(b" ") + 1 <= len(columns):
        lines.pop()  # its last number may be cut and still look valid
        notes.append(CutOff(f"the last line of {path.name} is cut off and was left out", number=1))
    whole = [line for line in lines if line.count(b" ") + 1 == len(columns)]
    if len(whole) < len(lines):
        rows = counted(len(lines) - len(whole), "row")
        text = f"left out {rows} of {path.name} without all {len(columns)} columns"
        notes.append(LeftOut(text, "short_row", len(lines) - len(whole)))
    if not whole:
        raise OncenterError(f"{path.name} has no rows", code="empty_log")
    try:
        return pl.read_csv(
            b"\n".join(whole),
            separator=" ",
            has_header=False,
            new_columns=list(columns),
            infer_schema=False,
            quote_char=None,
            encoding="utf8-lossy",
        )
    except (pl.exceptions.PolarsError, pl.exceptions.PanicException, OSError, ValueError) as error:
        raise _unreadable(path, (str(error).splitlines() or [type(error).__name__])[0]) from error


def _with_time(path: Path, frame: pl.DataFrame, midnight_s: float) -> pl.DataFrame:
    """Converts hhmmss.ss UTC to seconds since 1970 if the file has a date; continues past midnight."""
    if "time" not in frame.columns:
        raise OncenterError(f"{path.name} has no column 'time'", code="missing_time", needs=("time_s",))
    stamp = numbers(path, frame["time"]).copy()
    hours, minutes, seconds = stamp // 10_000, stamp // 100 % 100, stamp % 100
    is_time = (stamp >= 0) & (hours < 24) & (minutes < 60) & (seconds < 61)
    if not is_time[np.isfinite(stamp)].all():
        row = int(np.argmax(~is_time & np.isfinite(stamp)))
        raise OncenterError(
            f"column time, row {row + 1} of {path.name}: {frame['time'][row][:40]!r} is not a time hhmmss.ss",
            code="not_a_time",
        )
    of_day = hours * 3600 + minutes * 60 + seconds
    known = np.isfinite(of_day)
    steps = np.diff(of_day[known], prepend=of_day[known][:1])
    of_day[known] += _DAY_S * np.cumsum(np.where(steps < -_DAY_S / 2, 1.0, 0.0))
    return frame.with_columns(pl.Series(_TIME, of_day + midnight_s))


def _with_known(
    path: Path,
    frame: pl.DataFrame,
    file: _File,
    units: Mapping[str, str],
    named: Mapping[str, SignalName],
    notes: list[str],
) -> pl.DataFrame:
    """Adds columns for recognised channels, except for signals assigned in `[signals]`."""
    by_plain = {_plain(name): name for name in file.columns}
    for known in (*_KNOWN, *_speed(file)):
        column = f"{known.signal}_{known.unit}"
        name = next((by_plain[name] for name in known.names if name in by_plain), None)
        is_named = known.signal in named and named[known.signal].name in file.columns
        if name is None or is_named or column in frame.columns:
            continue
        of_file = factors(known.signal)
        unit = unit_key(units[name], of_file) if name in units else known.unit
        if unit is None:
            notes.append(
                f"{known.signal}: column {name} left out: it has unit {units[name]!r}, expected {' or '.join(of_file)}"
            )
            continue
        factor = known.sign * known.per_unit * of_file[unit] / of_file[known.unit]
        frame = frame.with_columns(pl.Series(column, numbers(path, frame[name]) * factor))
        if known.note:
            notes.append(f"{known.signal}: column {name} {known.note}")
    if "velocity" in by_plain and not _speed(file) and "vehicle_speed" not in named:
        notes.append(
            f"vehicle_speed: the [header] of {path.name} has no unit of velocity: "
            "assign velocity in [signals] with its unit"
        )
    taken = {entry.name for entry in named.values()}
    misleading = [name for name in SIGNALS if name in frame.columns and name not in taken]  # in minutes, not in degrees
    return frame.drop(misleading)


def _plain(name: str) -> str:
    return re.sub(r"[ _-]", "", name).lower()


def _speed(file: _File) -> list[_Known]:
    """The speed channel, with its unit from the header: velocity kmh."""
    stated = next((found for line in file.header if (found := _SPEED.match(line.lower()))), None)
    return [] if stated is None else [_Known("vehicle_speed", "km_h", ("velocity", "speed"), 1, _KM_H_PER[stated[1]])]


def _unreadable(path: Path, reason: str) -> OncenterError:
    return OncenterError(f"cannot read {path.name}: {reason}", code="unreadable_log")
