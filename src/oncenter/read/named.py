"""The names to which a `[signals]` table can refer: columns of a table, and signals of databases, with their units."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from oncenter.files.file_name import printable

_NAME_MAX, _UNIT_MAX, _COMMENT_MAX = 200, 40, 80  # characters; a longer name cannot be assigned


@dataclass(frozen=True)
class Named:
    """A signal of a database, or a column of a table, as its file names it."""

    name: str  # "ESP.YawRate", or the column
    unit: str  # as written in the file; empty where it has none
    comment: str = ""
    file: str = ""  # its file


def columns_of_log(log: Path) -> Iterator[Named]:
    """The columns of a CSV or Parquet file; none of another log.

    Raises:
        OncenterError: as `oncenter.read`.
    """
    from oncenter.read.tabular import column_units

    for name, unit in column_units(log).items():
        yield from _named(name, unit, "", log)


def signals_of(database: Path) -> Iterator[Named]:
    """All signals of a CAN database.

    Raises:
        OncenterError: as `oncenter.read.database_file.read_database`.
    """
    from oncenter.read.database_file import read_database

    for message in read_database(database).messages:
        for layout in message.signals:
            yield from _named(f"{message.name}.{layout.name}", layout.unit or "", layout.comment or "", database)


def _named(name: str, unit: str, comment: str, file: Path) -> Iterator[Named]:
    """Without names that a vehicle file cannot hold."""
    if len(name) <= _NAME_MAX and name.isprintable():
        about = " ".join(comment.split())[:_COMMENT_MAX]
        yield Named(name, printable(unit[:_UNIT_MAX]), printable(about), printable(file.name))
