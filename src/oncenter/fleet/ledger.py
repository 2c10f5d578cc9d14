"""Logs found and rows answered, on disk: the only data that must survive a power cut in the middle of a run.

SQLite with a write-ahead log: a row is written completely or not at all. A query finds the missing rows, so memory does
not grow with the number of logs. At the end of a run the Parquet tables are written from it.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.child import READER_DEATHS
from oncenter.files.file_name import printable_name
from oncenter.fleet.files import NOT_A_FILE, UNREADABLE_FOLDER, LogFile
from oncenter.fleet.start import valid_start
from oncenter.fleet.trucks import Trucks

LEDGER = "ledger.sqlite"  # in an output folder

_UNREAD = "unread "  # begins the key of a log that was not read
_NAME = ("utf-8", "surrogatepass")  # keeps every name that Python can hold
# An early version wrote NaN, which SQLite does not accept as JSON.
_ERROR_CODE = "CASE WHEN json_valid(row) THEN json_extract(row, '$.error_code') END"
_AGAIN = ("output", "stopped", "missing_extra")  # errors that may be gone in the next run
# `uri` is the log's name after `printable_name`; `name` is its bytes, which need not be text.
_TABLES = """
CREATE TABLE IF NOT EXISTS drive (key TEXT PRIMARY KEY, log TEXT, truck TEXT, start REAL, settings TEXT,
                                  vehicle_file TEXT, again INTEGER, row TEXT);
CREATE INDEX IF NOT EXISTS in_time ON drive (truck, start, key);
CREATE TABLE IF NOT EXISTS seen (uri TEXT PRIMARY KEY, size INTEGER, modified REAL, key TEXT);
CREATE INDEX IF NOT EXISTS of_key ON seen (key);
CREATE TABLE IF NOT EXISTS begun (uri TEXT PRIMARY KEY);
CREATE TEMP TABLE planned (uri TEXT PRIMARY KEY, name BLOB, options TEXT, size INTEGER, modified REAL);
CREATE TEMP TABLE to_do (uri TEXT PRIMARY KEY, name BLOB, options TEXT, size INTEGER, modified REAL);
"""


def is_ledger(path: Path) -> bool:
    """Whether a run made it: it has the ledger's tables, or the run was killed before it had any."""
    if not path.is_file():
        return False
    try:
        with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)) as file:
            tables = {name for (name,) in file.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    except sqlite3.OperationalError:  # not readable, or held by another run: opening it reports that
        return True
    except sqlite3.DatabaseError:
        return False
    return not tables or {"drive", "seen"} <= tables


def _refusal(path: Path, error: sqlite3.Error) -> OncenterError:
    return OncenterError(
        f"cannot write {path}: {error}; --output takes a folder that is yours, that no other run is writing and whose "
        "ledger no other program has open",
        code="output",
        exit_code=WRONG_USAGE,
    )


def _may_go_well(row: dict[str, Any]) -> bool:
    """Whether the next run may answer the same file, version and vehicle file: the log could not be opened."""
    code = row.get("error_code")
    return code in _AGAIN or (code == "unreadable_log" and not row["key"])


def _with_valid_start(row: dict[str, Any]) -> dict[str, Any]:
    """Earlier versions wrote any start, valid or not."""
    return row if valid_start(row.get("start")) is not None else row | {"start": None, "start_source": None}


class Ledger:
    """The record of one output folder, for one run at a time.

    Raises:
        OncenterError: "output", exit code 2: it cannot be opened, or another run has it.
    """

    def __init__(self, path: Path) -> None:
        try:
            self._file = sqlite3.connect(path, timeout=1.0, isolation_level=None)
        except sqlite3.Error as error:
            raise _refusal(path, error) from None
        try:
            self._file.execute("PRAGMA locking_mode = EXCLUSIVE")  # no other run comes between two rows
            self._file.execute("PRAGMA journal_mode = WAL")
            self._file.execute("PRAGMA synchronous = NORMAL")
            self._file.execute("PRAGMA temp_store = FILE")
            self._file.executescript(_TABLES)
            self._file.execute("BEGIN IMMEDIATE")
        except sqlite3.Error as error:
            self._file.close()
            raise _refusal(path, error) from None

    def plan(self, logs: Iterable[LogFile], trucks: Trucks, retry: bool = False) -> tuple[int, int]:
        """Stores all logs; returns how many there are, and how many must be answered.

        A log need not be answered again if name, size and time of last writing are unchanged and this version answered
        it with the same vehicle file. With `retry`, logs at which a reader crashed or was stopped are answered again.
        """
        if retry:
            deaths = ", ".join(f"'{code}'" for code in READER_DEATHS)
            self._file.execute(f"UPDATE drive SET again = 1 WHERE {_ERROR_CODE} IN ({deaths})")
        self._file.executemany(
            "INSERT OR IGNORE INTO planned VALUES (?, ?, ?, ?, ?)",
            ((printable_name(log.uri), log.uri.encode(*_NAME), log.options, log.size, log.modified_s) for log in logs),
        )
        self._forget_what_is_no_log()
        self._forget_outdated(trucks)
        self._file.execute(
            "INSERT INTO to_do SELECT p.* FROM planned p WHERE NOT EXISTS (SELECT 1 FROM seen s JOIN drive d"
            " ON d.key = s.key WHERE s.uri = p.uri AND s.size = p.size AND s.modified = p.modified AND NOT d.again)"
        )
        count = "SELECT (SELECT count(*) FROM planned), (SELECT count(*) FROM to_do)"
        all_logs, to_do = self._file.execute(count).fetchone()
        return int(all_logs), int(to_do)

    def _forget_outdated(self, trucks: Trucks) -> None:
        """Rows stay in the tables until their logs are answered again."""
        pairs = self._file.execute("SELECT DISTINCT vehicle_file, settings FROM drive WHERE NOT again").fetchall()
        for vehicle_file, settings in pairs:
            if settings != trucks.settings(vehicle_file):
                self._file.execute(
                    "UPDATE drive SET again = 1 WHERE vehicle_file IS ? AND settings = ?", (vehicle_file, settings)
                )

    def _forget_what_is_no_log(self) -> None:
        """Rows of entries that were no log files, and that are gone or are folders that can be listed now."""
        self._file.execute(
            f"DELETE FROM drive WHERE key BETWEEN ? AND ? AND {_ERROR_CODE} IN (?, ?)"
            " AND substr(key, ?) NOT IN (SELECT uri FROM planned)",
            (_UNREAD, f"{_UNREAD}\U0010ffff", NOT_A_FILE, UNREADABLE_FOLDER, len(_UNREAD) + 1),
        )

    def to_do(self) -> Iterator[LogFile]:
        """Planned logs without an answer, by name; last those that were being read when an earlier run was ended.

        Each is stored as begun before it is given out. So a log that brings the machine down comes after all others in
        the next run.
        """
        before = {uri for (uri,) in self._file.execute("SELECT uri FROM begun")}
        for last in (False, True):
            after = ""
            while rows := self._file.execute(
                "SELECT uri, name, options, size, modified FROM to_do WHERE uri > ? ORDER BY uri LIMIT 500", (after,)
            ).fetchall():
                after = rows[-1][0]
                for uri, name, *rest in rows:
                    if (uri in before) is last:
                        self._file.execute("INSERT OR IGNORE INTO begun VALUES (?)", (uri,))
                        self.commit()
                        yield LogFile(name.decode(*_NAME), *rest)

    def add(self, log: LogFile, row: dict[str, Any]) -> None:
        """One answered log. Of several copies of one drive the first by name is kept, in whichever order they come."""
        uri = printable_name(log.uri)
        key = row["key"] or f"{_UNREAD}{uri}"
        kept = self._file.execute("SELECT log, settings, again FROM drive WHERE key = ?", (key,)).fetchone()
        if kept is None or kept[2] or kept[1] != row["settings"] or row["log"] < kept[0]:
            self._file.execute(
                "INSERT OR REPLACE INTO drive VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
                (
                    key,
                    row["log"],
                    row["truck"],
                    row.get("start"),
                    row["settings"],
                    row.get("vehicle_file"),
                    _may_go_well(row),
                    json.dumps(row),
                ),
            )
        self._see(uri, log, key)
        self._file.execute("DELETE FROM begun WHERE uri = ?", (uri,))
        self.commit()

    def _see(self, uri: str, log: LogFile, key: str) -> None:
        """Records the file; deletes the row of an earlier content of it, unless a copy has that content."""
        before = self._file.execute("SELECT key FROM seen WHERE uri = ?", (uri,)).fetchone()
        self._file.execute("INSERT OR REPLACE INTO seen VALUES (?, ?, ?, ?)", (uri, log.size, log.modified_s, key))
        if before is not None and before[0] != key:
            self._file.execute(
                "DELETE FROM drive WHERE key = ? AND NOT EXISTS (SELECT 1 FROM seen WHERE seen.key = drive.key)", before
            )

    def commit(self) -> None:
        self._file.execute("COMMIT")
        self._file.execute("BEGIN IMMEDIATE")

    def count_trucks(self) -> int:
        (count,) = self._file.execute("SELECT count(DISTINCT truck) FROM drive WHERE truck != ''").fetchone()
        return int(count)

    def by_truck(self) -> Iterator[tuple[str, list[dict[str, Any]]]]:
        """Each truck's rows in order of time, one truck in memory at a time; first the rows without a truck."""
        trucks = [name for (name,) in self._file.execute("SELECT DISTINCT truck FROM drive ORDER BY truck")]
        for truck in trucks:
            rows = self._file.execute("SELECT row FROM drive WHERE truck = ? ORDER BY start, key", (truck,))
            yield truck, [_with_valid_start(json.loads(row)) for (row,) in rows]

    def close(self) -> None:
        """Keeps the rows added. If a full disk has ended the transaction, nothing is committed: its error stands."""
        if self._file.in_transaction:
            self._file.execute("COMMIT")
        self._file.close()
