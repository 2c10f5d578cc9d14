"""The ranking of the trucks for people: as lines of a terminal, and as CSV for a spreadsheet."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from oncenter.files.whole_file import write_whole
from oncenter.fleet.sql import query
from oncenter.fleet.undecided import STATE_WORDS
from oncenter.utc import utc

_BYTE_ORDER_MARK = "\ufeff"  # by which Excel recognises UTF-8
_TRUCK_SHOWN = 22  # characters


def ranked(output: Path) -> list[dict[str, Any]]:
    """The rows of `trucks.parquet`, by rank.

    Raises:
        OncenterError: "output", exit code 2: the folder has no tables of a run.
    """
    return query("SELECT * FROM trucks ORDER BY rank", output).to_dicts()


def as_text(rows: Sequence[dict[str, Any]]) -> str:
    """One line a truck, and below it the next step of an undecided one; at most 100 characters wide."""
    lines = [f"{'rank':>5}  {'truck':24}{'verdict':18}{'offset, 95 %':>25}  {'since':12}{'q':>8}"]
    for row in rows:
        lines.append(_line(row).rstrip())
        if row["state"] == "undecided" and row.get("would_decide"):
            lines.append(f"       needs {row['would_decide']}")
    return "\n".join(lines)


def _line(row: dict[str, Any]) -> str:
    offset, since, q = "-", "", ""
    if row.get("offset_deg") is not None:
        value, half = row["offset_deg"], 1.96 * row["offset_sd_deg"]
        offset = f"{value:+.1f} deg, {value - half:+.1f} to {value + half:+.1f}"
        since = _day(row["since"]) if row["changes"] else "first drive"
        q = f"{row['q_value']:.2g}"
    truck = row["truck"] if len(row["truck"]) <= _TRUCK_SHOWN else f"{row['truck'][: _TRUCK_SHOWN - 1]}…"
    return f"{row['rank']:5}  {truck:24}{STATE_WORDS[row['state']]:18}{offset:>25}  {since:12}{q:>8}"


def as_csv(rows: Sequence[dict[str, Any]], line_end: str = "\r\n") -> str:
    """All columns of `tables.TRUCKS` by RFC 4180: comma, CRLF, decimal point; times as `2026-03-02 07:00:00`, UTC."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator=line_end)
    if rows:
        writer.writerow(rows[0])
    writer.writerows([_cell(value) for value in row.values()] for row in rows)
    return text.getvalue()


def write_csv(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Writes the rows as `as_csv` gives them, in UTF-8 with a byte order mark.

    Raises:
        OncenterError: "output", exit code 2: it cannot be written.
    """
    write_whole(path, _BYTE_ORDER_MARK + as_csv(rows))


def _cell(value: Any) -> Any:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, datetime):
        return f"{value:%Y-%m-%d %H:%M:%S}"
    return value


def _day(time: datetime | float) -> str:
    """`time` as the table or, in s since 1970, as a run has it."""
    return f"{time if isinstance(time, datetime) else utc(time):%Y-%m-%d}"
