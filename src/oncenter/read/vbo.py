"""Racelogic's `.vbo`: sections of text, then rows of numbers separated by blanks.

From Racelogic's description of the format: latitude and longitude are in minutes, longitude is positive to the west,
the time is hhmmss.ss UTC, and the listed units belong to the last channels: the standard channels have none. Other
programs write degrees, units for all channels, or no [column names].
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

import numpy as np
import polars as pl

from oncenter.errors import OncenterError
from oncenter.read.identity import Identity, identity_of_columns
from oncenter.read.left_out import CutOff, LeftOut
from oncenter.read.numbers import numbers
from oncenter.read.samples import Samples
from oncenter.read.tabular import SECOND, Wanted, columns_of, samples_of
from oncenter.read.units import factors, is_unit, unit_key
from oncenter.read.wording import counted
from oncenter.signals import SIGNALS, SignalName

_HEADER, _UNITS, _NAMES = b"[header]", b"[channel units]", b"[column names]"
_DATA = re.compile(rb"^\[data\][^\n]*\n?", re.IGNORECASE | re.MULTILINE)
_CREATED = re.compile(rb"File created on (?:(\d\d)[/.](\d\d)[/.](\d{4})|(\d{4})-(\d\d)-(\d\d))")
_KM_H_PER = {"kmh": 1.0, "km/h": 1.0, "kph": 1.0, "mph": 1.609344, "m/s": 3.6, "mps": 3.6, "knots": 1.852, "kts": 1.852}
_DAY_S = 86400.0
_TIME = "time_s"
_NO_UNIT = ("", "(null)")
_BLANK_MAX = 8  # blank lines below the units, which may be empty units or not
_POSITIONS = {"latitude": 90.0, "longitude": 180.0}  # maximum in deg; whatever unit is stated, the values decide
_SURE = 0.5  # share of the path that has to agree with the course before it decides the sign of the longitude


# Standard channels, as `_plain` gives them.
_STANDARD = frozenset(
    "sats satellites time lat latitude long longitude velocity heading height vertvel verticalvelocity tsample "
    "sampleperiod solutiontype avifileindex avitime avisynctime event1 event1time longacc latacc pordistance distance "
    "date".split()
)


@dataclass(frozen=True)
class _Known:
    """A channel recognised by its name.

    Attributes:
        signal: that it gives.
        unit: if the file gives no unit.
        names: in files, as `_plain` gives them; the first available one is used.
        sign: -1 if it is positive to the right.
        note: for the user, if the meaning is not certain.
    """

    signal: str
    unit: str
    names: tuple[str, ...]
    sign: int = 1
    note: str = ""


_KNOWN = (
    _Known("latitude", "deg", ("lat", "latitude")),
    _Known("longitude", "deg", ("long", "longitude", "lon")),
    _Known("course", "deg", ("heading",)),  # direction of the velocity: one antenna does not measure heading
    _Known("vehicle_speed", "", ("velocity", "speed")),
    _Known(
        "yaw_rate",
        "deg_s",
        ("imuyawrate", "yawrateimu", "yawrate"),
        -1,
        "is read as positive clockwise, as Racelogic's sensors give it; if left is positive, assign it in [signals]",
    ),
    _Known("lateral_acceleration", "g", ("imuyaccel", "yaccel", "yacceleration")),
    _Known(
        "lateral_acceleration",
        "g",
        ("latacc", "lataccel", "lateralacceleration"),
        note="is computed from GNSS speed and course, so it does not contain the road bank",
    ),
    _Known("longitudinal_acceleration", "g", ("imuxaccel", "xaccel", "xacceleration")),
    _Known("steering_wheel_angle", "deg", ("steeringwheelangle", "steeringangle")),
)
_ACCELEROMETERS = ("xaccel", "yaccel", "xacceleration", "yacceleration", "imuxaccel", "imuyaccel")


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
    frame = _with_time(path, _rows(path, body, file.columns, notes), file.midnight_s)
    named = {signal: entry for signal, entry in names.items() if signal != "time"}
    units = _units_by_column(path, file, named, notes)
    named = {
        signal: replace(entry, unit=entry.unit or units.get(entry.name) or None) for signal, entry in named.items()
    }
    known = _recognised(path, frame, file, units, named, notes)
    taken = {entry.name for entry in named.values()}
    columns = [name for name in frame.columns if name not in SIGNALS or name in taken]  # a latitude is in minutes
    wanted = columns_of(path, columns, named, {}, notes, known)
    about = identity_of_columns(path, file.columns, frame.get_column)
    return samples_of(path, frame, _TIME, wanted, named, {}, notes), about


def _parted(path: Path) -> tuple[list[bytes], bytes]:
    """Lines before the rows, and the rows."""
    content = path.read_bytes().removeprefix(b"\xef\xbb\xbf")
    if b"\n" not in content:
        content = content.replace(b"\r", b"\n")
    mark = _DATA.search(content)
    if not mark:
        raise _unreadable(path, "it has no [data] section: the file is cut off or has another format")
    return [line.strip() for line in content[: mark.start()].split(b"\n")], content[mark.end() :].lstrip()


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
    file.columns = file.columns or list(file.header)  # some programs write the titles only
    if not file.columns:
        raise _unreadable(path, "it has no [column names] section")
    file.columns = _with_seconds(file.columns)
    return file


def _with_seconds(columns: Sequence[str]) -> list[str]:
    """The names as polars changes them: the second of the same name has a suffix, and is refused where it is used."""
    count: Counter[str] = Counter()
    found = []
    for name in columns:
        found.append(f"{name}{SECOND[:-1]}{count[name] - 1}" if count[name] else name)
        count[name] += 1
    return found


def _midnight(created: re.Match[bytes]) -> float:
    day, month, year = created.group(1, 2, 3) if created[1] else created.group(6, 5, 4)
    try:
        return datetime(int(year), int(month), int(day), tzinfo=UTC).timestamp()
    except ValueError:
        return 0.0


def _is_utf8(line: bytes) -> bool:
    try:
        line.decode()
    except UnicodeDecodeError:
        return False
    return True


# ---------------------------------------------------------------------------------------------------------------------
# Units
# ---------------------------------------------------------------------------------------------------------------------


def _units_by_column(path: Path, file: _File, named: Mapping[str, SignalName], notes: list[str]) -> dict[str, str]:
    """Units by column: of [channel units], else of the channel's title in the header ("velocity kmh").

    By Racelogic each channel that is not standard has one unit, which may be blank. Programs differ in which channels
    are standard, and in blank lines below, but the last unit is that of the last channel, unless a list for all
    channels or without blank lines fits better.
    """
    titles = zip(file.columns, file.header, strict=True) if len(file.header) == len(file.columns) else ()
    units = {name: unit for name, title in titles if (unit := _title(title)[1])}
    signal_of = {name: known.signal for name in file.columns for known in _KNOWN if _title(name)[0] in known.names}
    signal_of |= {entry.name: signal for signal, entry in named.items()}
    moving = {name: signal for name, signal in signal_of.items() if signal not in _POSITIONS}

    def misfits(given: Mapping[str, str]) -> int:
        return sum(_unit_of(moving[name], unit) is None for name, unit in given.items() if name in moving)

    special = [name for name in file.columns if _plain(name) not in _STANDARD]
    filled = len(file.units)
    while filled and len(file.units) - filled < _BLANK_MAX and not file.units[filled - 1]:
        filled -= 1
    lists = [file.units[:end] for end in range(len(file.units), filled - 1, -1)]
    possible = [
        {name: unit for name, unit in zip(of[-len(given) :], given, strict=True) if unit not in _NO_UNIT}
        for of in (special, file.columns)
        for given in sorted(lists, key=lambda given: abs(len(given) - len(special)))
        if 0 < len(given) <= len(of)
    ]
    if not any(file.units):
        return units
    best = min(possible, key=misfits, default={})
    if len(file.units) != len(special) and (not possible or misfits(best)):
        notes.append(
            f"{path.name} has {len(file.units)} [channel units] for {len(special)} channels: the units were ignored, "
            "give them in [signals]"
        )
        return units
    return units | best


@cache
def _title(title: str) -> tuple[str, str]:
    """The plain name and the unit of a channel's title, "velocity kmh" or "Yaw rate (deg/s)"; "" without a unit."""
    name, _, last = title.strip().replace("(", " ").replace(")", "").rpartition(" ")
    is_unit_of_one = last.lower() in _KM_H_PER or is_unit(last)
    return (_plain(name), last) if name and is_unit_of_one else (_plain(title), "")


def _unit_of(signal: str, written: str) -> float | None:
    """Factor to SI of a unit of the file, also after the channel's name ("velocity kmh"); None if it does not fit."""
    of_file = factors(signal)
    for text in (written, written.split(" ")[-1]):
        key = unit_key(text, of_file)
        if key is not None:
            return of_file[key]
        if signal == "vehicle_speed" and text.lower() in _KM_H_PER:
            return _KM_H_PER[text.lower()] * of_file["km_h"]
    return None


def _plain(name: str) -> str:
    """Without case, blanks, _, - and points."""
    return re.sub(r"[ _.-]", "", name).lower()


# ---------------------------------------------------------------------------------------------------------------------
# Rows
# ---------------------------------------------------------------------------------------------------------------------


def _rows(path: Path, body: bytes, columns: Sequence[str], notes: list[str]) -> pl.DataFrame:
    """All cells as numbers, or as text if one is not. Rows with another number of cells are left out with a note."""
    if b"," in body:
        body = body.replace(b",", b".")
    blanks = len(columns) - 1
    before, _, last = body.rpartition(b"\n")
    if last.strip() and len(last.split()) <= len(columns):  # its last number may be cut and still look valid
        body = before + b"\n"
        notes.append(CutOff(f"the last line of {path.name} is cut off and was left out", number=1))
    frame = _cells(path, body, columns)
    if not _is_whole(frame, body, blanks):
        lines = [b" ".join(cells) for line in body.split(b"\n") if (cells := line.split())]
        whole = [line for line in lines if line.count(b" ") == blanks]
        if len(whole) < len(lines):
            rows = counted(len(lines) - len(whole), "row")
            text = f"left out {rows} of {path.name} without all {len(columns)} columns"
            notes.append(LeftOut(text, "short_row", len(lines) - len(whole)))
        frame = _cells(path, b"\n".join(whole), columns)
    if not frame.height:
        raise OncenterError(f"{path.name} has no rows", code="empty_log")
    return frame


def _is_whole(frame: pl.DataFrame, body: bytes, blanks: int) -> bool:
    """Whether each row has all cells, with one blank between two."""
    return body.count(b" ") == blanks * frame.height and not frame[frame.columns[-1]].null_count()


def _cells(path: Path, rows: bytes, columns: Sequence[str]) -> pl.DataFrame:
    if rows.count(b" ", 0, rows.find(b"\n") % (len(rows) + 1)) != len(columns) - 1:
        return pl.DataFrame(schema=dict.fromkeys(columns, pl.String))
    for kind in (pl.Float64, pl.String):
        try:
            return pl.read_csv(
                rows,
                separator=" ",
                has_header=False,
                schema=dict.fromkeys(columns, kind),
                quote_char=None,
                encoding="utf8-lossy" if kind is pl.String else "utf8",
                truncate_ragged_lines=True,
            )
        except (pl.exceptions.PolarsError, pl.exceptions.PanicException, OSError, ValueError) as error:
            why = error
    raise _unreadable(path, (str(why).splitlines() or [type(why).__name__])[0]) from why


def _with_time(path: Path, frame: pl.DataFrame, midnight_s: float) -> pl.DataFrame:
    """Converts hhmmss.ss UTC to seconds since 1970 if the file has a date; continues past midnight."""
    column = next((name for name in frame.columns if _plain(name) in ("time", "utctime", "utc")), None)
    if column is None:
        raise OncenterError(f"{path.name} has no column 'time'", code="missing_time", needs=("time_s",))
    text = frame[column]
    stamp = numbers(path, text.str.replace_all(":", "", literal=True) if ":" in str(text[0]) else text)
    hours, minutes, seconds = stamp // 10_000, stamp // 100 % 100, stamp % 100
    is_time = (stamp >= 0) & (hours < 24) & (minutes < 60) & (seconds < 61)
    if not is_time[np.isfinite(stamp)].all():
        row = int(np.argmax(~is_time & np.isfinite(stamp)))
        raise OncenterError(
            f"column {column}, row {row + 1} of {path.name}: {str(text[row])[:40]!r} is not a time hhmmss.ss",
            code="not_a_time",
        )
    of_day = hours * 3600 + minutes * 60 + seconds
    known = np.isfinite(of_day)
    steps = np.diff(of_day[known], prepend=of_day[known][:1])
    of_day[known] += _DAY_S * np.cumsum(np.where(steps < -_DAY_S / 2, 1.0, 0.0))
    return frame.with_columns(pl.Series(_TIME, of_day + midnight_s))


# ---------------------------------------------------------------------------------------------------------------------
# Channels
# ---------------------------------------------------------------------------------------------------------------------


def _recognised(
    path: Path,
    frame: pl.DataFrame,
    file: _File,
    units: Mapping[str, str],
    named: Mapping[str, SignalName],
    notes: list[str],
) -> list[Wanted]:
    """The columns of signals that neither `[signals]` nor a name with a unit gives."""
    given = {signal for signal, entry in named.items() if entry.name in file.columns}
    given |= {signal for signal in SIGNALS if any(f"{signal}_{unit}" in file.columns for unit in factors(signal))}
    positions = _positions(path, frame, file)
    wanted: list[Wanted] = []
    for known in _KNOWN:
        columns = _columns_of(known, file.columns) if known.signal not in given else []
        for column in columns:
            factor = positions.get(known.signal) or _factor(path, known, column, units, notes)
            if factor is not None:
                wanted.append((column, known.signal, known.sign * factor))
                notes += [f"{known.signal}: column {column} {known.note}"] if known.note else []
                given.add(known.signal)
    return wanted


def _columns_of(known: _Known, columns: Sequence[str]) -> list[str]:
    """The columns of a channel. Several have the same name except for case and _; the one beside an accelerometer is
    the IMU's, as a unit with two antennas computes a yaw rate as well."""
    plain = [_title(name)[0] for name in columns]
    having = next((name for name in known.names if name in plain), None)
    places = [place for place, name in enumerate(plain) if name == having]
    beside = [place for place in places if {*plain[max(place - 1, 0) : place + 2]} & {*_ACCELEROMETERS}]
    return [columns[place] for place in (beside if len(places) > 1 and len(beside) == 1 else places)]


def _factor(path: Path, known: _Known, column: str, units: Mapping[str, str], notes: list[str]) -> float | None:
    """Factor to SI by the file's unit, else by the usual one; None with a note for one that does not fit."""
    if column in units:
        factor = _unit_of(known.signal, units[column])
        if factor is None:
            choices = " or ".join(factors(known.signal))
            notes.append(f"{known.signal}: column {column} left out: it has unit {units[column]!r}, expected {choices}")
        return factor
    if not known.unit:
        notes.append(
            f"{known.signal}: the [header] of {path.name} has no unit of {column}: assign {column} in [signals] with "
            "its unit"
        )
        return None
    return factors(known.signal)[known.unit]


def _positions(path: Path, frame: pl.DataFrame, file: _File) -> dict[str, float]:
    """Degrees to the north and to the east per unit of the file, which has minutes, or degrees if all positions are in
    their range. A longitude in minutes is positive to the west, in degrees to the east, unless the course contradicts.
    """
    having = ((known.signal, _columns_of(known, file.columns)) for known in _KNOWN if known.signal in _POSITIONS)
    found = {signal: numbers(path, frame[columns[0]]) for signal, columns in having if columns}
    is_degrees = all(np.nanmax(np.abs(values), initial=0.0) <= _POSITIONS[signal] for signal, values in found.items())
    factor, east = (1.0, 1.0) if is_degrees else (1 / 60, -1.0)
    course = next((name for name in file.columns if _plain(name) == "heading"), None)
    if course is not None and "longitude" in found:
        along = np.diff(found["longitude"]) * np.sin(np.radians(numbers(path, frame[course])[1:]))
        along = along[np.abs(along) < 1.0]  # finite, and without the jump to the first fix
        if abs(along.sum()) > _SURE * np.abs(along).sum():
            east = math.copysign(1.0, along.sum())
    return {signal: factor * (east if signal == "longitude" else 1.0) for signal in found}


def _unreadable(path: Path, reason: str) -> OncenterError:
    return OncenterError(f"cannot read {path.name}: {reason}", code="unreadable_log")
