"""CAN frames as a table of text: CSV of SavvyCAN (GVRET), CSS Electronics, python-can, Cabana or Kvaser, and `.txt` of
the CLX000 loggers. The names of the columns say what they hold; whole columns are converted at once.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import polars as pl

from oncenter.errors import OncenterError
from oncenter.files.log_formats import FRAME_TABLE, HEAD_BYTES, as_utf_8
from oncenter.read.csv_text import csv_text, header_of, separator_of, without_cut_off_row
from oncenter.read.frames import BYTES_MAX, MORE, Column, Frames, bus_code
from oncenter.read.left_out import LeftOut, left_out_frames
from oncenter.read.wording import counted, damaged, reason_of

_COLUMNS = {  # by role, the names without other characters than letters and digits; the first that fits counts
    "time": r"(abs|rel|log)?time.*|t|ts",
    "identifier": r"(can|msg|message|frame|arbitration|arb)?(id|identifier|addr|address)(hex|dec)?",
    "data": r"(can|message|msg)?(data|payload)(bytes)?(hex)?",
    "extended": r"(is)?(extended|ide|xtd|ext|eff|extendedid|extid)",
    "remote": r"(is)?(remote|rtr)(frame)?",
    "error": r"(is)?(error|er)(frame)?",
    "length": r"datalength|len|length|dlc",
    "bus": r"bus|buschannel|channel|network",
}
_BYTE = re.compile(r"(?:d|b|db|data|byte|databyte)(\d\d?)")
_CLX = ["timestamp", "type", "id", "data"]
_UNIT = re.compile(r"[(\[_ ](ns|us|µs|ms|s|sec)[)\]]?$")
_UNITS_S = {"ns": 1e-9, "us": 1e-6, "µs": 1e-6, "ms": 1e-3, "s": 1.0, "sec": 1.0}
_USUAL_FRAMES_PER_S = 1000.0
_CLOCK = r"(?:(\d{4})[-/.](\d\d?)[-/.](\d\d?)[ T])?(\d\d?):(\d\d):(\d\d(?:[.,:]\d+)?)"
_OF_PYTHON_CAN = {"timestamp", "arbitration_id", "extended", "remote", "error", "dlc", "data"}  # base64
_HEX = {number: f"{number:02x}" for number in range(256)}
_DAY_S = 86_400.0
_IDENTIFIER_MAX, _STANDARD_MAX = (1 << 29) - 1, (1 << 11) - 1
_TRUE = ("1", "true", "t", "yes", "y", "x", "ext", "xtd", "extended")

Flags = npt.NDArray[np.bool_]


def chunks(path: Path, notes: list[str], progress: Callable[[float], None]) -> Iterator[Frames]:
    """Data frames of a table, all at once. `notes` receives what was left out.

    Raises:
        OncenterError: "unreadable_log": it has no column of times, or most of its rows are no frames.
    """
    table = _opened(path, notes)
    no_data: Counter[str] = Counter()
    wanted = ((table.cells("time") != "") | (table.cells("identifier") != "")).to_numpy().copy()
    for role, reason in (("error", "error_frame"), ("remote", "remote_frame")):
        marked = table.flags(role) & wanted
        no_data[reason] += int(np.count_nonzero(marked))
        wanted &= ~marked
    identifier, extended, good = _identifiers(table)
    octets, length, data_good = _octets(table)
    time = _seconds(table)
    good &= data_good & np.isfinite(time) & wanted
    unreadable = int(np.count_nonzero(wanted & ~good))
    if unreadable > len(good) / 2:
        raise damaged(path.name, f"{unreadable} of its {len(good)} rows are no CAN frames")
    progress(1.0)
    yield Frames(
        time,
        identifier,
        extended,
        np.ascontiguousarray(octets[:, :8]).view("<u8")[:, 0],
        length,
        _buses(table),
        np.ascontiguousarray(octets[:, 8:]).view(MORE)[:, 0] if octets.shape[1] > 8 else None,
    ).where(good)
    if unreadable:
        text = f"left out {counted(unreadable, 'row')} of {path.name} that are not CAN frames"
        notes.append(LeftOut(text, "unreadable", unreadable))
    notes += left_out_frames(path.name, no_data)


@dataclass(frozen=True)
class _Table:
    """A table of frames.

    Attributes:
        names: of the columns.
        rows: text without blanks around a cell; the columns are called "0", "1", ...
        places: of the columns, by role.
        octets: columns of single bytes in their order.
        preamble: the first lines of the file.
    """

    names: Sequence[str]
    rows: pl.DataFrame
    places: Mapping[str, int]
    octets: Sequence[int]
    preamble: str

    def cells(self, role: str) -> pl.Series:
        return self.rows[str(self.places[role])]

    def flags(self, role: str) -> Flags:
        if role not in self.places:
            return np.zeros(self.rows.height, bool)
        flags: Flags = self.cells(role).str.to_lowercase().is_in(_TRUE).to_numpy()
        return flags


def _opened(path: Path, notes: list[str]) -> _Table:
    """
    Raises:
        OncenterError: as `chunks`.
    """
    text = csv_text(path)
    header = FRAME_TABLE.search(text)
    if header is None:
        raise damaged(path.name, "it has no columns of identifiers and data")
    text = text[header.start() :]
    separator = separator_of(text)
    names = header_of(path, text, separator)
    text = without_cut_off_row(path, text, separator, notes)
    plain = [re.sub(r"[^a-z0-9]", "", name.lower()) for name in names]
    places = {role: place for role, pattern in _COLUMNS.items() if (place := _first(pattern, plain)) is not None}
    if "time" not in places:
        raise OncenterError(
            f"{path.name} is a table of CAN frames without a column of times: export it with the time of each frame",
            code="table_of_frames",
        )
    numbered = {int(found[1]): place for place, name in enumerate(plain) if (found := _BYTE.fullmatch(name))}
    octets = [numbered[number] for number in sorted(numbered)][:BYTES_MAX]
    if "data" not in places and not octets:
        raise damaged(path.name, "it has no column of data")
    numbers = separator.join(map(str, range(len(names)))).encode()  # names may be repeated
    try:
        rows = pl.read_csv(
            numbers + b"\n" + text.partition(b"\n")[2],
            separator=separator,
            infer_schema=False,
            encoding="utf8-lossy",
            truncate_ragged_lines=True,  # rows of some programs end with a separator
        )
    except (pl.exceptions.PolarsError, pl.exceptions.PanicException, ValueError) as error:
        raise damaged(path.name, reason_of(error)) from error
    if not rows.height:
        raise OncenterError(f"{path.name} is empty: it has no row below its header", code="empty_log")
    rows = rows.with_columns(pl.all().fill_null("").str.strip_chars(' "\r'))
    preamble = as_utf_8(path.read_bytes()[:HEAD_BYTES]).decode("utf-8", "replace")
    return _Table(names, rows, places, octets, preamble)


def _first(pattern: str, names: Sequence[str]) -> int | None:
    return next((place for place, name in enumerate(names) if re.fullmatch(pattern, name)), None)


def _identifiers(table: _Table) -> tuple[npt.NDArray[np.uint32], Flags, Flags]:
    """Identifiers, whether they have 29 bits, and which are possible."""
    cells = table.cells("identifier").str.to_lowercase()
    bare = cells.str.replace(r"^0x", "").str.replace(r"[xh]$", "")
    as_hex = bare.str.to_integer(base=16, strict=False)
    if _is_decimal(table.names[table.places["identifier"]], cells, as_hex):
        as_hex = bare.str.to_integer(base=10, strict=False)
    number = as_hex.fill_null(-1).to_numpy()
    extended = (number > _STANDARD_MAX) | table.flags("extended") | cells.str.ends_with("x").to_numpy()
    if "extended" not in table.places:
        extended |= (bare.str.len_chars() == 8).to_numpy()
    if _is_clx(table):
        extended |= table.rows["1"].str.contains("[13579]$").to_numpy()
    good = (number >= 0) & (number <= _IDENTIFIER_MAX)
    return np.where(good, number, 0).astype(np.uint32), extended, good


def _is_decimal(name: str, cells: pl.Series, as_hex: pl.Series) -> bool:
    """Whether identifiers are decimal: none has a letter, and some as hexadecimal number is larger than any."""
    if "dec" in name.lower():
        return True
    has_letter = bool(cells.str.contains("[a-f]|^0x").any())
    largest = as_hex.max()
    return not has_letter and isinstance(largest, int) and largest > _IDENTIFIER_MAX


def _octets(table: _Table) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.uint8], Flags]:
    """The bytes of each frame, 8 or 64 of them, missing ones 0xFF; their number; and which rows could be read."""
    if "data" in table.places:
        cells = table.cells("data")
        if {*table.names} >= _OF_PYTHON_CAN:
            cells = cells.str.decode("base64", strict=False).bin.encode("hex")
        digits = cells.str.to_lowercase().str.replace_all(r"0x|[^0-9a-z]", "")
    else:
        digits = _joined([table.rows[str(place)] for place in table.octets])
    good = digits.is_not_null().to_numpy()
    digits = digits.fill_null("")
    length = (digits.str.len_chars() // 2).to_numpy().astype(np.int64)
    good &= (digits.str.len_chars() % 2 == 0).to_numpy() & (length <= BYTES_MAX)
    if "length" in table.places:
        stated = table.cells("length").str.to_integer(strict=False).fill_null(BYTES_MAX).to_numpy()
        length = np.where((stated >= 0) & (stated <= 8), np.minimum(length, stated), length)
    width = BYTES_MAX if (length[good] > 8).any() else 8
    whole = digits.str.slice(0, 2 * width).str.pad_end(2 * width, "f").str.decode("hex", strict=False)
    good &= whole.is_not_null().to_numpy() & ((whole.bin.size() == width).fill_null(value=False).to_numpy())
    joined = b"".join(each if ok else bytes(width) for each, ok in zip(whole.to_list(), good.tolist(), strict=True))
    octets = np.frombuffer(joined, np.uint8).reshape(-1, width).copy()
    octets[np.arange(width) >= length[:, None]] = 0xFF
    return octets, np.clip(length, 0, BYTES_MAX).astype(np.uint8), good


def _joined(columns: Sequence[pl.Series]) -> pl.Series:
    """The hexadecimal digits of columns with a byte each; decimal ones have three somewhere, and no letter."""
    bare = [cells.str.to_lowercase().str.replace(r"^0x", "") for cells in columns]
    has_letter = any(cells.str.contains("[a-f]").any() for cells in bare)
    if not has_letter and any((cells.str.len_chars() == 3).any() for cells in bare):
        numbers = [cells.str.to_integer(strict=False).clip(0, 255) for cells in bare]
        bare = [number.replace_strict(_HEX, default="", return_dtype=pl.String).fill_null("") for number in numbers]
    padded = [pl.when(cells.str.len_chars() == 1).then("0" + cells).otherwise(cells) for cells in bare]
    return pl.select(pl.concat_str(padded)).to_series()


def _buses(table: _Table) -> npt.NDArray[np.uint64]:
    if "bus" not in table.places:
        return np.full(table.rows.height, bus_code("1"), np.uint64)
    cells = table.cells("bus")
    codes = {name: bus_code(name) for name in cells.unique().to_list()}
    found: npt.NDArray[np.uint64] = cells.replace_strict(codes, return_dtype=pl.UInt64).to_numpy()
    return found


def _is_clx(table: _Table) -> bool:
    return [name.lower() for name in table.names] == _CLX


def _seconds(table: _Table) -> Column:
    """Times in s, NaN where a cell has none; since 1970 where the table has dates."""
    cells = table.cells("time")
    if _is_clx(table):
        return _clx_seconds(cells, table.preamble)
    number = cells.str.replace(",", ".", literal=True).cast(pl.Float64, strict=False)
    if number.null_count() <= len(number) / 2:
        time: Column = number.fill_null(np.nan).to_numpy()
        in_s: Column = time * _unit_s(table.names[table.places["time"]], time)
        return in_s
    parts = cells.str.extract_groups(_CLOCK).struct.unnest()
    year, month, day, hour, minute, second = (
        parts[name].str.replace(r"[,:]", ".").cast(pl.Float64, strict=False).fill_null(np.nan).to_numpy()
        for name in parts.columns
    )
    of_day: Column = hour * 3600.0 + minute * 60.0 + second
    if np.isfinite(year).any():
        return _days(year, month, day) * _DAY_S + of_day
    return _unwrapped(of_day, _DAY_S)


def _unit_s(name: str, time: Column) -> float:
    """The unit of numbers: by the column's name, else by times since 1970, else the one by which the bus has about as
    many frames as usual."""
    stated = _UNIT.search(name.lower())
    if stated is not None:
        return _UNITS_S[stated[1]]
    finite = time[np.isfinite(time)]
    if len(finite) < 2 or not finite[-1] > finite[0]:
        return 1.0
    for unit, least in ((1e-9, 1e17), (1e-6, 1e14), (1e-3, 1e11), (1.0, 1e9)):
        if finite[0] > least:
            return unit
    rate = (len(finite) - 1) / (finite[-1] - finite[0])
    return min((1.0, 1e-3, 1e-6, 1e-9), key=lambda unit: abs(np.log(rate / unit / _USUAL_FRAMES_PER_S)))


def _clx_seconds(cells: pl.Series, preamble: str) -> Column:
    """Times as `20190526T201352118`, or only its last parts: the logger leaves out the first ones, and writes any
    separators. Its header has the date of the file."""
    bare = cells.str.replace_all(r"[^0-9T ]", "")
    of_day = bare.str.replace(r"^.*[T ]", "")
    number = of_day.str.to_integer(strict=False).fill_null(-1).to_numpy().astype(np.float64)
    number[number < 0] = np.nan
    digits = int(of_day.str.len_chars().max() or 0)  # type: ignore[arg-type]
    if digits > 9:
        return number / 1000.0  # since 1970
    places = [(1000.0, 100.0, 1.0), (1e5, 100.0, 60.0), (1e7, 100.0, 3600.0)]
    time = number % 1000.0 / 1000.0 + sum(number // at % modulo * unit for at, modulo, unit in places)
    begun = re.search(r"# Time: (\d{4})(\d\d)(\d\d)", preamble)
    of_file = [float(part) for part in begun.groups()] if begun else [1970.0, 1.0, 1.0]
    date = bare.str.extract(r"^(\d+)[T ]").str.to_integer(strict=False)
    if date.null_count() > len(date) / 2:
        period = {4: 10.0, 5: 60.0, 6: 3600.0, 7: 3600.0}.get(digits, _DAY_S)
        return _days(*(np.array([part]) for part in of_file)) * _DAY_S + _unwrapped(time, period)
    given = date.fill_null(0).to_numpy().astype(np.float64)
    year = np.where(given >= 1e4, given // 1e4, of_file[0])
    month = np.where(given >= 100, given // 100 % 100, of_file[1])
    found = _days(year, month, given % 100) * _DAY_S + time
    return _unwrapped(found, 28.0 * _DAY_S) if (given < 100).all() else found


def _days(year: Column, month: Column, day: Column) -> Column:
    """Days since 1970, NaN without a date."""
    known = np.isfinite(year) & np.isfinite(month) & np.isfinite(day) & (year >= 1) & (year <= 9999)
    months = np.where(known, (year - 1970.0) * 12.0 + month - 1.0, 0.0).astype(np.int64).astype("datetime64[M]")
    days = months.astype("datetime64[D]").astype(np.int64) + np.where(known, day, 0.0) - 1.0
    return np.where(known, days, np.nan)


def _unwrapped(time: Column, period_s: float) -> Column:
    """Times of a clock that begins again at zero after a period."""
    known = np.isfinite(time)
    steps = np.diff(time[known], prepend=time[known][:1])
    whole = time.copy()
    whole[known] += np.cumsum(steps < -period_s / 2.0) * period_s
    return whole
