"""From a CSV file's bytes to its header and rows: compression, encoding, line ends, preamble, cut-off rows."""

from __future__ import annotations

import codecs
import csv
import gzip
import io
import re
import zlib
from pathlib import Path

import numpy as np
import numpy.typing as npt

from oncenter.errors import OncenterError
from oncenter.read.left_out import CutOff
from oncenter.read.units import is_unit
from oncenter.read.wording import damaged, reason_of

_SHORT_ROWS_SHARE = 0.01  # of the rows; more mean that the program leaves out empty cells, not damage
_GZIP = b"\x1f\x8b"
_QUOTED = re.compile(rb'"[^"]*"?')
_HEAD_BYTES, _HEAD_LINES = 65_536, 200  # in which the names of the columns are looked for
_ROWS_ALIKE = 3  # rows with the same number of cells that make a table
_NUMBER = re.compile(r"\s*[+-]?[\d.,:/Ee+-]*\d[\d.,:/ Ee+-]*\s*")  # or a date, or a time
_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def csv_text(path: Path) -> bytes:
    """UTF-8 from the header on, lines ending in a line feed. Compressed or not is decided by content, not by name.

    Raises:
        OncenterError: cut off, not text, or empty.
    """
    data = path.read_bytes()
    if data.startswith(_GZIP):
        data = _unpacked(path, data)
    if data.startswith(_UTF_16):
        data = data.decode("utf-16", "replace").encode()
    data = data.removeprefix(codecs.BOM_UTF8)
    if b"\n" not in data:
        data = data.replace(b"\r", b"\n")
    text = _from_header(data)
    header = text.split(b"\n", 1)[0]
    if not header.strip():
        raise OncenterError(f"{path.name} is empty: it has no header line", code="empty_log")
    if b"\0" in header:
        raise OncenterError(
            f"cannot read {path.name}: its first line contains zero bytes, so it is not text, or UTF-16 without a byte "
            "order mark; save it as UTF-8",
            code="unreadable_log",
        )
    return text


def separator_of(text: bytes) -> str:
    """The column separator: the most frequent of , ; tab in the header."""
    header = text.split(b"\n", 1)[0]
    return max(",;\t", key=lambda mark: header.count(mark.encode()))


def header_of(path: Path, text: bytes, separator: str) -> list[str]:
    """The names of the columns.

    Raises:
        OncenterError: a name has a carriage return, or more than 131,072 characters.
    """
    header = text.split(b"\n", 1)[0].decode("utf-8", "replace")
    try:
        return [name.strip() for name in next(csv.reader([header], delimiter=separator), [])]
    except csv.Error as error:
        raise damaged(path.name, f"header line: {reason_of(error)}") from None


def with_header_as_long_as_rows(text: bytes, separator: str) -> bytes:
    """Adds a separator to the header if only the rows end with one, as some programs write."""
    mark = separator.encode()
    header, *rest = text.split(b"\n", 2)
    first = rest[0].rstrip(b"\r") if rest else b""
    if first.endswith(mark) and first.count(mark) == header.count(mark) + 1:
        return header.rstrip(b"\r") + mark + text[len(header.rstrip(b"\r")) :]
    return text


def without_cut_off_row(path: Path, text: bytes, separator: str, notes: list[str]) -> bytes:
    """Drops a last row without line end and with missing cells: the recording broke off, its last number may be cut."""
    end = text.rfind(b"\n")
    last = text[end + 1 :]
    if end < 0 or not last.strip():
        return text
    header, before = text[: text.index(b"\n")], text[text.rfind(b"\n", 0, end) + 1 : end]
    rows = (header, before) if before.strip() else (header,)  # some programs leave out empty cells at rows' ends
    if _cells(last, separator) >= min(_cells(row, separator) for row in rows):
        return text
    notes.append(CutOff(f"the last line of {path.name} is cut off and was left out", number=1))
    return text[: end + 1]


def whole_rows(text: bytes, separator: str) -> npt.NDArray[np.bool_] | None:
    """Whether each row has as many cells as the header. None if quotes prevent counting, or if so many rows are short
    that the program evidently leaves out empty cells."""
    if b'"' in text:
        return None
    characters = np.frombuffer(text if text.endswith(b"\n") else text + b"\n", np.uint8)
    ends = np.flatnonzero(characters == ord("\n"))
    marks = np.flatnonzero(characters == ord(separator))
    cells = np.diff(np.searchsorted(marks, ends), prepend=0) + 1
    starts = np.concatenate(([0], ends[:-1] + 1))
    blank = (ends == starts) | ((ends == starts + 1) & (characters[starts] == ord("\r")))
    whole: npt.NDArray[np.bool_] = cells[~blank][1:] >= cells[0]
    return whole if np.count_nonzero(~whole) <= _SHORT_ROWS_SHARE * len(whole) else None


def too_long_row(path: Path, text: bytes, separator: str) -> OncenterError | None:
    """The error for the first row with more cells than the header; None without one."""
    lines = iter(io.BytesIO(text))
    cells_of_header = _cells(next(lines), separator)
    for row, line in enumerate(lines, 1):
        cells = _cells(line, separator)
        if cells > cells_of_header:
            return OncenterError(
                f"cannot read {path.name}: row {row} has {cells} cells, the header has {cells_of_header} (decimal "
                "commas need ; or tabs between columns)",
                code="unreadable_log",
            )
    return None


def _cells(line: bytes, separator: str) -> int:
    """Number of cells; separators in quotes do not count."""
    return _QUOTED.sub(b"", line).count(separator.encode()) + 1


def _unpacked(path: Path, data: bytes) -> bytes:
    try:
        return gzip.decompress(data)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise damaged(path.name, str(error)) from error


def _from_header(data: bytes) -> bytes:
    """The data without leading empty lines, comments and Excel's `sep=;`."""
    while data:
        line, _, rest = data.partition(b"\n")
        if line.strip() and not line.startswith((b"#", b"sep=")):
            return _without_preamble(data)
        data = rest
    return data


def _without_preamble(data: bytes) -> bytes:
    """The data from the line with the names of the columns on: some programs write lines about the recording before.

    This line has a name in each column, and all later lines have as many cells.
    """
    lines = data[:_HEAD_BYTES].split(b"\n")[:_HEAD_LINES]
    if len(data) > _HEAD_BYTES:
        lines.pop()  # may be cut
    places = [place for place, line in enumerate(lines) if line.strip()]
    rows = [lines[place] for place in places[-_ROWS_ALIKE:]]
    counts = {mark: {_cells(row, mark) for row in rows} for mark in "\t;,"}
    separator = next((mark for mark, found in counts.items() if len(found) == 1 and min(found) > 1), "")
    if not separator or len(rows) < _ROWS_ALIKE:
        return data
    columns = min(counts[separator])
    has_empty_end = rows[-1].rstrip(b"\r").endswith(separator.encode())
    table = len(places)
    while table and _cells(lines[places[table - 1]], separator) == columns:
        table -= 1
    for place in (places[0], *places[table:]):
        if _is_header(lines[place], separator, columns - has_empty_end):
            return data[sum(len(line) + 1 for line in lines[:place]) :]
    return data


def _is_header(line: bytes, separator: str, columns: int) -> bool:
    """Whether each cell has a name except the first, which is empty above the numbers of rows."""
    try:
        cells = next(csv.reader([line.decode("latin-1").rstrip("\r")], delimiter=separator), [])
    except csv.Error:
        return False
    names = [cell.strip() for cell in cells[1:columns]]
    is_named = all(name and not _NUMBER.fullmatch(name) for name in names)
    return len(names) == columns - 1 and is_named and sum(map(is_unit, cells)) < 2
