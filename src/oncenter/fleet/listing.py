"""The ranking of the trucks for people: as lines of a terminal, and as CSV for a spreadsheet."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import polars as pl

from oncenter.files.file_name import printable
from oncenter.files.own_file import metadata
from oncenter.files.whole_file import whole_file, write_whole
from oncenter.fleet.sql import result_of
from oncenter.fleet.tables import TRUCKS
from oncenter.utc import utc
from oncenter.verdict.numbers import between
from oncenter.verdict.states import STATES

BYTE_ORDER_MARK = "\ufeff"  # by which Excel recognises UTF-8
_TRUCK_SHOWN = 22  # characters
_FORMULA = ("=", "+", "-", "@", "\t", "\r")  # a spreadsheet computes a cell that begins so; an apostrophe makes it text


def ranked(output: Path) -> list[dict[str, Any]]:
    """The rows of `trucks.parquet`, by rank.

    Raises:
        OncenterError: "output", exit code 2: the folder has no tables of a run.
    """
    return result_of("SELECT * FROM trucks ORDER BY rank", output).to_dicts()


def as_text(rows: Sequence[dict[str, Any]]) -> str:
    """One line a truck, and below it the next step of an undecided one; at most 100 characters wide."""
    lines = [f"{'rank':>5}  {'truck':24}{'verdict':18}{'offset, 95 %':>25}  {'since':12}{'q':>8}"]
    for row in rows:
        lines.append(_line(row).rstrip())
        lines += [f"       {line}" for line in next_lines(row)]
    return "\n".join(lines)


def offset_words(row: Mapping[str, Any]) -> tuple[str, str]:
    """Offset and the interval that decides, deg, with the digits that the decision needs."""
    if row.get("offset_low_deg") is None:  # a former version wrote it
        value, half = row["offset_deg"], 1.96 * row["offset_sd_deg"]
        return between(value, value - half, value + half, row["limit_deg"])
    return between(row["offset_deg"], row["offset_low_deg"], row["offset_high_deg"], row["limit_deg"])


def next_lines(row: Mapping[str, Any]) -> list[str]:
    """Below the verdict: the drive that decides, a pull, and the reason to look again."""
    needs = f"needs {row['would_decide']}" if row.get("would_decide") else ""
    return [line for line in (needs, row.get("second_line") or "", _watched(row)) if line]


def _watched(row: Mapping[str, Any]) -> str:
    if not row.get("watch"):
        return ""
    return "watch: its last change exceeds the limit" if row["state"] == "within" else "watch: may be a false alarm"


def _line(row: dict[str, Any]) -> str:
    offset, since, q = "-", "", ""
    if row.get("offset_deg") is not None:
        value, interval = offset_words(row)
        offset = f"{value} deg, {interval}"
        since = _day(row["since"]) if row["changes"] else "first drive"
        q = "" if row.get("q_value") is None else f"{row['q_value']:.2g}"
    truck = row["truck"] if len(row["truck"]) <= _TRUCK_SHOWN else f"{row['truck'][: _TRUCK_SHOWN - 1]}…"
    return f"{row['rank']:5}  {truck:24}{STATES[row['state']].word:18}{offset:>25}  {since:12}{q:>8}"


def as_csv(rows: Sequence[dict[str, Any]], line_end: str = "\r\n", columns: Sequence[str] = tuple(TRUCKS)) -> str:
    """All columns by RFC 4180: comma, CRLF, decimal point; times as `2026-03-02 07:00:00`, UTC.

    Args:
        columns: their names, where there are no rows.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator=line_end)
    writer.writerow(rows[0] if rows else columns)
    writer.writerows([_cell(value) for value in row.values()] for row in rows)
    return text.getvalue()


def write_csv(path: Path, rows: Sequence[dict[str, Any]], columns: Sequence[str] = tuple(TRUCKS)) -> None:
    """Writes the rows as `as_csv` gives them, in UTF-8 with a byte order mark.

    Raises:
        OncenterError: "output", exit code 2: it cannot be written.
    """
    write_whole(path, BYTE_ORDER_MARK + as_csv(rows, columns=columns))


def write_parquet(path: Path, table: pl.DataFrame) -> None:
    """Writes the result of a query.

    Raises:
        OncenterError: "output", exit code 2: it cannot be written.
    """
    with whole_file(path) as unfinished:
        table.write_parquet(unfinished, metadata=metadata("fleet"))


def as_lines(rows: Sequence[Mapping[str, Any]], columns: Sequence[str], width: int) -> list[str]:
    """A table where all of it fits into the width; else each row as a record, a column a line. Nothing is cut."""
    cells = [[printable(_shown(value)) for value in row.values()] for row in rows]
    names = [printable(name) for name in columns]
    widths = [max(map(len, column)) for column in zip(names, *cells, strict=True)]
    if sum(widths) + 2 * len(widths) - 2 <= width:
        is_number = [all(isinstance(row[name], int | float | None) for row in rows) for name in columns]
        lines = [names, *cells]
        return ["  ".join(map(_aligned, line, widths, is_number)).rstrip() for line in lines]
    longest = max(map(len, names))
    lines_of = [[f"{name:{longest}}  {cell}".rstrip() for name, cell in zip(names, row, strict=True)] for row in cells]
    return [line for number, record in enumerate(lines_of, 1) for line in (f"-- row {number}", *record)]


def _aligned(cell: str, width: int, is_number: bool) -> str:
    return f"{cell:>{width}}" if is_number else f"{cell:{width}}"


def _shown(value: Any) -> str:
    if isinstance(value, str):
        return value
    return "-" if value is None else str(_cell(value))


def _cell(value: Any) -> Any:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, datetime):
        return f"{value:%Y-%m-%d %H:%M:%S}"
    if isinstance(value, str) and value.startswith(_FORMULA):
        return f"'{value}"
    return value


def _day(time: datetime | float) -> str:
    """`time` as the table or, in s since 1970, as a run has it."""
    return f"{time if isinstance(time, datetime) else utc(time):%Y-%m-%d}"
