"""The file of a ledger: its tables and their version, the migration from an earlier one, and damage.

A row has a checksum. A row that does not match it is set apart, and its log is answered again. If SQLite cannot read
the file, the file is set apart, and a new one gets the rows that can be read.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import sqlite3
import zlib
from collections.abc import Iterator
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.file_name import printable, printable_name
from oncenter.files.whole_file import UNFINISHED
from oncenter.fleet.start import valid_start
from oncenter.signals import DEGREE
from oncenter.truck.events import CALIBRATED, KINDS
from oncenter.utc import LAST_S
from oncenter.vehicle_keys import APPLIED_MAX_DEG

NAME = ("utf-8", "surrogatepass")  # of a log in bytes: keeps every name that Python can hold

_VERSION = 3  # 1: a row for each content of a log, whichever trucks it is of; 2: without the tables of `_SINCE_3`
_COLUMNS = "key, truck, log, start, settings, vehicle_file, error_code, row"  # that the checksum is of
_DRIVE = "key TEXT, truck TEXT, log TEXT, start REAL, settings TEXT, vehicle_file TEXT, error_code TEXT, row TEXT"
# `uri` is the log's name after `printable_name`; `name` is its bytes, which need not be text.
_SINCE_3 = (
    "CREATE TABLE left_out (key TEXT, truck TEXT, why TEXT, PRIMARY KEY (key, truck))",
    "CREATE TABLE events (truck TEXT, time REAL, kind TEXT, by_rad REAL, recorded REAL,"
    " PRIMARY KEY (truck, time, kind))",
    f"PRAGMA user_version = {_VERSION}",
)
_TABLES = (
    f"CREATE TABLE drive ({_DRIVE}, checksum INTEGER, again INTEGER, PRIMARY KEY (key, truck))",
    "CREATE INDEX in_time ON drive (truck, start, key)",
    "CREATE TABLE seen (uri TEXT PRIMARY KEY, name BLOB, size INTEGER, modified REAL, key TEXT, truck TEXT)",
    "CREATE INDEX of_drive ON seen (key, truck)",
    "CREATE INDEX of_size ON seen (size, modified)",
    "CREATE TABLE begun (uri TEXT PRIMARY KEY)",
    "CREATE TABLE left_behind (key TEXT, truck TEXT, PRIMARY KEY (key, truck))",
    "CREATE TABLE last_night (kind TEXT, name TEXT, said TEXT, PRIMARY KEY (kind, name))",
    f"CREATE TABLE damaged ({_DRIVE}, checksum INTEGER, again INTEGER)",
    *_SINCE_3,
)
_KEPT_OF_DAMAGED = {  # beside the drives
    "seen": "uri, name, size, modified, key, truck",
    "last_night": "kind, name, said",
    "left_out": "key, truck, why",
    "events": "truck, time, kind, by_rad, recorded",
}
_WAL = "-wal"  # what is not yet in the file
_STORE = f"INSERT OR REPLACE INTO drive ({_COLUMNS}, checksum, again) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"
_WELL_TYPED = (
    "typeof(uri) = 'text' AND typeof(size) = 'integer' AND typeof(modified) = 'real' AND typeof(key) = 'text'"
    " AND typeof(truck) = 'text'"
)
_EVENT_OF_VALUE = (  # the limits of `event_of`
    f"typeof(truck) = 'text' AND typeof(time) = 'real' AND time BETWEEN 0 AND {LAST_S} AND kind IN {KINDS}"
    f" AND (by_rad IS NULL OR kind = '{CALIBRATED}' AND typeof(by_rad) = 'real'"
    f" AND abs(by_rad) <= {APPLIED_MAX_DEG * DEGREE})"
)

Row = dict[str, Any]


def is_ledger(path: Path) -> bool:
    """Whether a run made it: it has the ledger's tables, or the run was killed before it had any. A file that is
    damaged is one if a table of a run lies beside it."""
    if not path.is_file():
        return False
    try:
        with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)) as file:
            file.text_factory = _text
            tables = {name for (name,) in file.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    except sqlite3.OperationalError:  # not readable, or held by another run: opening it reports that
        return True
    except (sqlite3.DatabaseError, UnicodeDecodeError):  # the latter of a message that quotes damage
        return _has_tables_of_a_run(path.parent)
    return not tables or {"drive", "seen"} <= tables or _has_tables_of_a_run(path.parent)


def _has_tables_of_a_run(folder: Path) -> bool:
    there = [path for name in ("drives", "trucks", "changes") if (path := folder / f"{name}.parquet").is_file()]
    return any(map(_is_of_a_run, there))


def _is_of_a_run(path: Path) -> bool:
    import polars as pl  # late: a night needs it for this only where its ledger is damaged

    from oncenter.files.own_file import KEY

    try:
        return pl.read_parquet_metadata(path).get(KEY) == "fleet"
    except (OSError, pl.exceptions.PolarsError):
        return False


class Damaged(sqlite3.DatabaseError):
    """A file that SQLite can read, without the tables of its version, or with indexes that contradict them."""


def is_damage(error: sqlite3.Error) -> bool:
    """Whether SQLite cannot read the file, rather than write it or have it alone."""
    damage = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB)
    return isinstance(error, Damaged) or getattr(error, "sqlite_errorcode", 0) & 0xFF in damage


def opened(path: Path, *, is_new: bool = False) -> sqlite3.Connection:
    """The file with the tables of this version, for this process alone.

    Args:
        is_new: the file of a folder whose former one was set apart.

    Raises:
        sqlite3.Error: it cannot be opened, another process has it, or it is damaged.
        OncenterError: "output", exit code 2: a later version wrote it.
    """
    file = sqlite3.connect(path, timeout=1.0, isolation_level=None)
    try:
        file.text_factory = _text
        file.execute("PRAGMA locking_mode = EXCLUSIVE")  # no other run comes between two rows
        file.execute("PRAGMA journal_mode = WAL")
        file.execute("PRAGMA synchronous = NORMAL")
        file.execute("PRAGMA temp_store = FILE")
        file.execute("BEGIN IMMEDIATE")
        _bring_up_to_date(file, path, is_new)
        file.execute("COMMIT")
    except UnicodeDecodeError as error:  # of a message that quotes damage
        file.close()
        raise Damaged(str(error)) from None
    except BaseException:
        file.close()
        raise
    return file


def _text(damaged_or_not: bytes) -> str:
    return damaged_or_not.decode(errors="replace")


def _bring_up_to_date(file: sqlite3.Connection, path: Path, is_new: bool) -> None:
    (version,) = file.execute("PRAGMA user_version").fetchone()
    if version > _VERSION:
        raise OncenterError(
            f"{path} is of a later version of oncenter (its tables have version {version}, this one reads up to "
            f"{_VERSION}): update oncenter, or name another --output",
            code="output",
            exit_code=WRONG_USAGE,
        )
    if version == 2:
        for statement in _SINCE_3:
            file.execute(statement)
    if version >= 2:
        statements = {sql for (sql,) in file.execute("SELECT sql FROM sqlite_master")}
        if not {statement for statement in _TABLES if statement.startswith("CREATE")} <= statements:
            raise Damaged(f"{path.name} has other tables than those of its version")
        (first,) = file.execute("PRAGMA integrity_check(1)").fetchone()  # an index may have a row that its table lacks
        if first != "ok":
            raise Damaged(f"{path.name} contradicts itself: {first}")
        return
    is_of_version_1 = file.execute("SELECT 1 FROM sqlite_master WHERE name = 'drive'").fetchone() is not None
    if not (is_of_version_1 or is_new) and _has_tables_of_a_run(path.parent):
        raise Damaged(f"{path.name} is empty, but its run wrote tables")
    if is_of_version_1:
        for table in ("drive", "seen"):
            file.execute(f"ALTER TABLE {table} RENAME TO {table}_1")
        for old in ("INDEX IF EXISTS in_time", "INDEX IF EXISTS of_key", "TABLE IF EXISTS begun"):
            file.execute(f"DROP {old}")
    for statement in _TABLES:
        file.execute(statement)
    if is_of_version_1:
        _take_from_version_1(file)


def _take_from_version_1(file: sqlite3.Connection) -> None:
    """Its rows, and its files with the trucks of their rows. Damaged rows are set apart by the next check."""
    from oncenter.fleet.tables import DRIVES

    for key, truck, log, text, again in file.execute("SELECT key, truck, log, row, again FROM drive_1"):
        row = _row_of_version_1(text, DRIVES)
        if row is None:
            file.execute(_STORE, (key, truck, log, *(None,) * 4, text, None, 1))
        else:
            store(file, str(key), row, log=row["log"], again=bool(again))
    file.execute(
        "INSERT INTO seen SELECT s.uri, CAST(s.uri AS BLOB), s.size, s.modified, s.key, d.truck"
        " FROM seen_1 s JOIN drive_1 d ON d.key = s.key"
    )
    file.execute("DROP TABLE drive_1")
    file.execute("DROP TABLE seen_1")


_PYTHON_TYPES: dict[str, tuple[type, ...]] = {
    "text": (str,),
    "number": (float, int),
    "time": (float, int),
    "count": (int,),
    "truth": (bool,),
}


def _row_of_version_1(text: Any, columns: dict[str, tuple[str, str]]) -> Row | None:
    """The row if it is whole; it may have any start, and NaN, which this version does not store."""
    try:
        row = json.loads(text)
    except (TypeError, ValueError, RecursionError):
        return None
    if not isinstance(row, dict) or not all(isinstance(row.get(name), str) for name in ("truck", "log", "settings")):
        return None
    row = {
        name: None if isinstance(value, float) and not math.isfinite(value) else value for name, value in row.items()
    }
    for name, (kind, _) in columns.items():
        if row.get(name) is not None and not isinstance(row[name], _PYTHON_TYPES[kind]):
            return None
    return row if valid_start(row.get("start")) is not None else row | {"start": None, "start_source": None}


def store(file: sqlite3.Connection, key: str, row: Row, *, log: str, again: bool) -> None:
    """Writes a row with its checksum in place of that of the same key and truck."""
    start = row.get("start")
    columns = (
        key,
        row["truck"],
        log,
        None if start is None else float(start),
        row["settings"],
        row.get("vehicle_file"),
        row.get("error_code"),
        json.dumps(row),
    )
    file.execute(_STORE, (*columns, _checksum(columns), again))


def _checksum(columns: tuple[Any, ...]) -> int:
    return zlib.crc32(repr(columns).encode("utf-8", "backslashreplace"))


def set_apart_damaged_rows(file: sqlite3.Connection) -> list[str]:
    """Moves rows that do not match their checksum to the table `damaged`, from which nothing is read; their names."""
    damaged = [
        (place, _name(columns))
        for place, checksum, *columns in file.execute(f"SELECT rowid, checksum, {_COLUMNS} FROM drive")
        if checksum != _checksum(tuple(columns))
    ]
    for place, _ in damaged:
        file.execute(f"INSERT INTO damaged SELECT {_COLUMNS}, checksum, again FROM drive WHERE rowid = ?", (place,))
        file.execute("DELETE FROM drive WHERE rowid = ?", (place,))
    file.execute(f"DELETE FROM seen WHERE NOT ({_WELL_TYPED})")  # such a log is hashed again
    odd = file.execute("SELECT uri, name FROM seen WHERE CAST(uri AS BLOB) IS NOT name").fetchall()
    file.executemany("DELETE FROM seen WHERE uri = ?", ((uri,) for uri, name in odd if uri != _printed(name)))
    file.execute("DELETE FROM begun WHERE typeof(uri) != 'text'")
    events = file.execute(f"DELETE FROM events WHERE NOT ({_EVENT_OF_VALUE}) RETURNING truck").fetchall()
    return sorted([*(name for _, name in damaged), *(f"event of truck {truck}" for (truck,) in events)])


def _printed(name: Any) -> str | None:
    try:
        return printable_name(name.decode(*NAME))
    except (AttributeError, ValueError):
        return None


def _name(columns: list[Any]) -> str:
    key, truck, log, *_ = columns
    return printable(next((text for text in (log, key, truck) if isinstance(text, str) and text), "a row without name"))


def set_apart(path: Path) -> tuple[Path, int]:
    """Copies a damaged file to another name, and replaces it by a new one with all of its rows that can be read; the
    other name, and the number of rows. If it is stopped, the damaged file is still there."""
    number = 1
    while (aside := path.with_name(f"{path.stem}-damaged-{number}{path.suffix}")).exists():
        number += 1
    for part in ("", _WAL):
        with suppress(FileNotFoundError):
            shutil.copyfile(f"{path}{part}", f"{aside}{part}")
    unfinished = path.with_name(f"{UNFINISHED}{path.name}")
    for part in ("", _WAL):
        Path(f"{unfinished}{part}").unlink(missing_ok=True)
    with closing(opened(unfinished, is_new=True)) as new:
        new.execute("BEGIN IMMEDIATE")
        for row in _readable(aside, f"{_COLUMNS}, checksum, again", "drive"):
            if row[-2] == _checksum(row[:-2]):
                new.execute(_STORE, row)
        for table, columns in _KEPT_OF_DAMAGED.items():
            for row in _readable(aside, columns, table):
                new.execute(f"INSERT OR IGNORE INTO {table} VALUES ({', '.join('?' * len(row))})", row)
        (kept,) = new.execute("SELECT count(*) FROM drive").fetchone()
        new.execute("COMMIT")
    for part in (_WAL, "-shm"):  # SQLite would take them for those of the new file
        Path(f"{path}{part}").unlink(missing_ok=True)
    os.replace(unfinished, path)
    return aside, int(kept)


def _readable(path: Path, columns: str, table: str) -> Iterator[tuple[Any, ...]]:
    """Its rows from either end as far as they can be read; some come twice."""
    for order in ("ASC", "DESC"):
        with suppress(sqlite3.Error, UnicodeDecodeError), closing(sqlite3.connect(path, isolation_level=None)) as file:
            file.text_factory = _text
            yield from file.execute(f"SELECT {columns} FROM {table} NOT INDEXED ORDER BY rowid {order}")
