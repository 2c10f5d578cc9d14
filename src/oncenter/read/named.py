"""The names to which a `[signals]` table can refer: columns of a table, and signals of databases, with their units."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from oncenter.files.file_name import printable
from oncenter.files.log_formats import format_of

if TYPE_CHECKING:
    from cantools.database.can import Signal

_NAME_MAX, _UNIT_MAX, _COMMENT_MAX = 200, 40, 80  # characters; a longer name cannot be assigned


@dataclass(frozen=True)
class Named:
    """A signal of a database, or a column of a table, as its file names it."""

    name: str  # "ESP.YawRate", or the column
    unit: str  # as written in the file; empty where it has none
    comment: str = ""
    file: str = ""  # its file
    bits: int = 0  # 0: no signal of a database
    low: float = 0.0  # the least and the greatest value of the bits
    high: float = 0.0
    step: float = 0.0
    codes: int = 0  # values with names
    frame: int = -1  # identifier of its message, with bit 31 for 29 bits; -1: no message


def columns_of_log(log: Path) -> Iterator[Named]:
    """The columns of a CSV or Parquet file, or the channels of a decoded MDF file; none of another log.

    Raises:
        OncenterError: as `oncenter.read`.
    """
    from oncenter.read.mf4 import channel_units
    from oncenter.read.tabular import column_units

    log_format = format_of(log.name)
    units = channel_units if log_format is not None and log_format.content == "frames and channels" else column_units
    for name, unit in units(log).items():
        yield from _named(name, unit, "", log)


def signals_of(database: Path) -> Iterator[Named]:
    """All signals of a CAN database.

    Raises:
        OncenterError: as `oncenter.read.database_file.read_database`.
    """
    from oncenter.read.database_file import read_database

    for message in read_database(database).messages:
        for layout in message.signals:
            for named in _named(f"{message.name}.{layout.name}", layout.unit or "", layout.comment or "", database):
                low, high, step = _range(layout)
                codes = len(layout.choices or ())
                frame = message.frame_id | message.is_extended_frame << 31
                yield replace(named, bits=layout.length, low=low, high=high, step=step, codes=codes, frame=frame)


def _range(layout: Signal) -> tuple[float, float, float]:
    """The least and the greatest value of the bits, and the step between two values."""
    if layout.is_float:
        return -math.inf, math.inf, 0.0
    first = -(2.0 ** (layout.length - 1)) if layout.is_signed else 0.0
    ends = [(first + raw) * float(layout.scale) + float(layout.offset) for raw in (0.0, 2.0**layout.length - 1.0)]
    return min(ends), max(ends), abs(float(layout.scale))


def _named(name: str, unit: str, comment: str, file: Path) -> Iterator[Named]:
    """Without names that a vehicle file cannot hold."""
    if len(name) <= _NAME_MAX and name.isprintable():
        about = " ".join(comment.split())[:_COMMENT_MAX]
        yield Named(name, printable(unit[:_UNIT_MAX]), printable(about), printable(file.name))
