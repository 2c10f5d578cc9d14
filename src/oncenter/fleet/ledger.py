"""Logs found and rows answered, on disk: the only data that must survive a power cut in the middle of a run.

A drive is the content of its log and its truck, whatever its files are called: `drive` has a row for each, `seen` each
file with the drive that is in it. A copy adds a file, a move replaces one, and neither is answered again. `left_out`
has drives that do not count: a person removed them, or their files are gone. `events` are stated by a person.

SQLite with a write-ahead log: a row is written completely or not at all. A query finds the missing rows, so memory does
not grow with the number of logs. At the end of a run the Parquet tables are written from it.
"""

from __future__ import annotations

import json
import os
import sqlite3
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.child import READER_DEATHS
from oncenter.files.file_name import printable_name
from oncenter.fleet.files import NOT_A_FILE, STORE, UNREADABLE_FOLDER, LogFile
from oncenter.fleet.ledger_file import NAME, is_damage, is_ledger, opened, set_apart_damaged_rows, store
from oncenter.fleet.start import own_outside, starts_outside, with_earliest
from oncenter.fleet.trucks import Trucks
from oncenter.truck.events import Event

LEDGER = "ledger.sqlite"  # in an output folder

_UNREAD = "unread "  # begins the key of a log that was not read
AGAIN = ("output", "stopped", "missing_extra", "unreadable_log")  # errors that may be gone in the next run
_KNOWN_MAX = 20  # drives with which a log of the same size is compared
_PLANS = """
CREATE TEMP TABLE planned (uri TEXT PRIMARY KEY, name BLOB, options TEXT, size INTEGER, modified REAL);
CREATE TEMP TABLE to_do (uri TEXT PRIMARY KEY, name BLOB, options TEXT, size INTEGER, modified REAL);
CREATE TEMP TABLE gone (uri TEXT PRIMARY KEY);
CREATE TEMP TABLE newly_gone (key TEXT, truck TEXT);
"""
_REMOVED, _GONE = "removed", "gone"  # why a drive is left out
_IS_LEFT_OUT = "(key, truck) IN (SELECT key, truck FROM left_out)"
_IS_GONE = f"(key, truck) IN (SELECT key, truck FROM left_out WHERE why = '{_GONE}')"


def _refusal(path: Path, error: sqlite3.Error) -> OncenterError:
    return OncenterError(
        f"cannot write {path}: {error}; --output takes a folder that is yours, that no other run is writing and whose "
        "ledger no other program has open",
        code="output",
        exit_code=WRONG_USAGE,
    )


def _may_go_well(row: dict[str, Any], kept: dict[str, Any] | None) -> bool:
    """Whether the next run may answer the same file, version and vehicle file: the log could not be opened, or its
    readers were killed from outside, and not so the last time: a log that itself takes all memory would do so each
    night.

    Args:
        kept: the former row of the log.
    """
    code = row.get("error_code")
    is_killed_anew = row.get("was_killed", False) and not (kept or {}).get("was_killed", False)
    return (code in AGAIN and (code != "unreadable_log" or not row["key"])) or is_killed_anew


class Ledger:
    """The record of one output folder, for one run at a time.

    Attributes:
        damaged: names of the rows that were damaged and set apart when it was opened.

    Raises:
        OncenterError: "output", exit code 2: it cannot be opened, another run has it, or a later version wrote it.
        sqlite3.DatabaseError: it is damaged, see `ledger_file.is_damage`.
    """

    def __init__(self, path: Path) -> None:
        try:
            self._file = opened(path)
        except sqlite3.Error as error:
            if is_damage(error):
                raise
            raise _refusal(path, error) from None
        try:
            self._listed: tuple[str, ...] = ()
            self._file.executescript(_PLANS)
            self._file.execute("BEGIN IMMEDIATE")
            self.damaged = set_apart_damaged_rows(self._file)
        except BaseException:
            self._file.close()
            raise

    def plan(
        self, logs: Iterable[LogFile], trucks: Trucks, retry: bool = False, places: Sequence[str] = ()
    ) -> tuple[int, int]:
        """Stores all logs; returns how many there are, and how many must be looked at.

        A log is left alone if name, size and time of last writing are unchanged and this version answered it with the
        same vehicle file. With `retry`, logs at which a reader crashed or was stopped are answered again.

        Args:
            places: places in which logs were searched.
        """
        if retry:
            deaths = ", ".join(f"'{code}'" for code in READER_DEATHS)
            self._file.execute(f"UPDATE drive SET again = 1 WHERE error_code IN ({deaths})")
        self._file.executemany(
            "INSERT OR IGNORE INTO planned VALUES (?, ?, ?, ?, ?)",
            ((printable_name(log.uri), log.uri.encode(*NAME), log.options, log.size, log.modified_s) for log in logs),
        )
        self._listed = tuple(filter(self._has_logs, map(_begin_of_names, places)))
        self._leave_out_gone()
        self._forget_what_is_no_log()
        self._forget_outdated(trucks)
        self._file.execute(
            "INSERT INTO to_do SELECT p.* FROM planned p WHERE NOT EXISTS (SELECT 1 FROM seen s JOIN drive d"
            " USING (key, truck) WHERE s.uri = p.uri AND s.size = p.size AND s.modified = p.modified AND NOT d.again)"
        )
        count = "SELECT (SELECT count(*) FROM planned), (SELECT count(*) FROM to_do)"
        all_logs, to_do = self._file.execute(count).fetchone()
        return int(all_logs), int(to_do)

    def _has_logs(self, begin: str) -> bool:
        """Whether a log was found there: a disk that is not mounted is an empty folder."""
        ends = (begin, f"{begin}\U0010ffff")
        return self._file.execute("SELECT 1 FROM planned WHERE uri BETWEEN ? AND ?", ends).fetchone() is not None

    def _leave_out_gone(self) -> None:
        """Drives none of whose files is in its place any more, where these places were searched. They count again when
        a file is back."""
        there = "SELECT key, truck FROM seen JOIN planned USING (uri)"
        self._file.execute(f"DELETE FROM left_out WHERE why = '{_GONE}' AND (key, truck) IN ({there})")
        missing = self._file.execute(
            f"SELECT uri, name FROM seen WHERE uri NOT IN (SELECT uri FROM planned) AND NOT {_IS_LEFT_OUT}"
        ).fetchall()
        gone = ((uri,) for uri, name in missing if uri.startswith(self._listed) and self._is_gone(uri, name))
        self._file.executemany("INSERT INTO gone VALUES (?)", gone)
        each_is_gone = "HAVING min(uri IN (SELECT uri FROM gone))"
        self._file.execute(f"INSERT INTO newly_gone SELECT key, truck FROM seen GROUP BY key, truck {each_is_gone}")
        self._file.execute(f"INSERT INTO left_out SELECT key, truck, '{_GONE}' FROM newly_gone")

    def gone(self) -> list[dict[str, str]]:
        """Drives that count no longer since this night, and were not moved."""
        rows = self._file.execute("SELECT log, truck FROM drive JOIN newly_gone USING (key, truck) ORDER BY 1, 2")
        return [{"log": log, "truck": truck} for log, truck in rows]

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
            "DELETE FROM drive WHERE key BETWEEN ? AND ? AND error_code IN (?, ?)"
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
                for uri, name, options, size, modified in rows:
                    if (uri in before) is last:
                        self._file.execute("INSERT OR IGNORE INTO begun VALUES (?)", (uri,))
                        self.commit()
                        yield LogFile(name.decode(*NAME), options, size, modified, self._known(size, modified))

    def _known(self, size: int, modified_s: float) -> tuple[tuple[str, str, bool], ...]:
        """Drives of files of this size, any of which the log may be a copy of: key, truck, and whether the answer
        holds. If many files have this size, those written at the same time, as a move or a rename leaves it. An error
        names its file, so its log is answered again."""
        drives = (
            "SELECT key, truck, NOT again AND error_code IS NULL FROM seen s JOIN drive USING (key, truck)"
            " WHERE s.size = ? AND truck != ''"
        )
        rows = self._file.execute(f"{drives} LIMIT ?", (size, _KNOWN_MAX + 1)).fetchall()
        if len(rows) > _KNOWN_MAX:
            same_time = (size, modified_s, _KNOWN_MAX)
            rows = self._file.execute(f"{drives} AND s.modified = ? LIMIT ?", same_time).fetchall()
        return tuple((key, truck, bool(holds)) for key, truck, holds in rows)

    def add(self, log: LogFile, row: dict[str, Any]) -> None:
        """One answered log. Whichever of several files with one content comes first, the row is the same: its start is
        the earliest that any of them gives.

        Args:
            row: of `tables.DRIVES`, or that of a copy, see `drive.copy_of`.
        """
        uri = printable_name(log.uri)
        key, truck = row["key"] or f"{_UNREAD}{uri}", str(row["truck"])
        if row.get("error_code") == "unknown_truck":
            truck = self._owner(key) or truck
        elif truck:
            self._give_to(truck, key)
        self._see(uri, log, key, truck)
        kept, again = self._kept(key, truck)
        if kept is None:
            if not row.get("is_copy"):  # else its original was damaged meanwhile: the next night answers it
                self._store(key, row, again=_may_go_well(row, kept))
        elif row.get("is_copy") or truck != row["truck"]:
            outside = starts_outside(log.uri, log.modified_s, kept.get("span_s"))
            self._store(key, with_earliest(kept, outside), again=again)
        else:
            self._store(key, self._joined(kept, again, row), again=_may_go_well(row, kept))
        self._file.execute("DELETE FROM begun WHERE uri = ?", (uri,))
        self.commit()

    def files_of(self, truck: str, keys: Sequence[str]) -> list[LogFile]:
        """A file of each drive that is in its place in this night."""
        sql = (
            "SELECT uri, p.name, p.options, p.size, p.modified FROM seen JOIN planned p USING (uri)"
            " WHERE key = ? AND truck = ? ORDER BY uri LIMIT 1"
        )
        found = (self._file.execute(sql, (key, truck)).fetchone() for key in keys)
        return [
            LogFile(name.decode(*NAME), options, size, modified, ((key, truck, False),))
            for key, (_, name, options, size, modified) in zip(keys, filter(None, found), strict=False)
        ]

    def add_drive(self, truck: str, keys: Sequence[str], row: dict[str, Any]) -> None:
        """The row of a drive of several logs with these keys, kept in that of the last one."""
        kept, again = self._kept(keys[-1], truck)
        if kept is not None:
            self._store(keys[-1], kept | {"drive": row | {"keys": list(keys)}}, again=again)
        self.commit()

    def _owner(self, key: str) -> str | None:
        """The truck of another file with this content, for one whose own is not named."""
        (truck,) = self._file.execute("SELECT min(truck) FROM drive WHERE key = ? AND truck != ''", (key,)).fetchone()
        return None if truck is None else str(truck)

    def _give_to(self, truck: str, key: str) -> None:
        self._file.execute("UPDATE seen SET truck = ? WHERE key = ? AND truck = ''", (truck, key))
        self._file.execute("DELETE FROM drive WHERE key = ? AND truck = ''", (key,))

    def _see(self, uri: str, log: LogFile, key: str, truck: str) -> None:
        """Records the file, and the drives that were in it or in files that have been moved here."""
        before = self._file.execute("SELECT key, truck FROM seen WHERE uri = ?", (uri,)).fetchall()
        self._file.execute(
            "INSERT OR REPLACE INTO seen VALUES (?, ?, ?, ?, ?, ?)",
            (uri, log.uri.encode(*NAME), log.size, log.modified_s, key, truck),
        )
        others = self._file.execute("SELECT uri, name, truck FROM seen WHERE key = ? AND uri != ?", (key, uri))
        for other, name, its_truck in others.fetchall():
            if self._is_gone(other, name):
                self._file.execute("DELETE FROM seen WHERE uri = ?", (other,))
                before.append((key, its_truck))
        for table in ("newly_gone", "left_out"):
            self._file.execute(f"DELETE FROM {table} WHERE key = ? AND truck = ? AND {_IS_GONE}", (key, truck))
        self._file.executemany("INSERT OR IGNORE INTO left_behind VALUES (?, ?)", before)

    def forget_left_behind(self) -> None:
        """Deletes drives whose files were moved to another truck or have another content now. Only after all logs are
        answered: a file found later may have the same drive."""
        self._file.execute(
            "DELETE FROM drive WHERE EXISTS (SELECT 1 FROM left_behind l WHERE l.key = drive.key AND l.truck ="
            " drive.truck) AND NOT EXISTS (SELECT 1 FROM seen s WHERE s.key = drive.key AND s.truck = drive.truck)"
        )
        self._file.execute("DELETE FROM left_behind")
        self.commit()

    def _is_gone(self, uri: str, name: bytes) -> bool:
        """Whether a file that held a drive is not there any more. Early versions stored relative paths."""
        if self._file.execute("SELECT 1 FROM planned WHERE uri = ?", (uri,)).fetchone() is not None:
            return False
        if uri.startswith(STORE):
            return uri.startswith(self._listed)
        with suppress(OSError, ValueError, TypeError, AttributeError):  # the last two: of a damaged row
            path = name.decode(*NAME)
            return not os.path.isabs(path) or not _is_there(path)
        return False

    def _kept(self, key: str, truck: str) -> tuple[dict[str, Any] | None, bool]:
        """The row of a drive, and whether it waits for a new answer."""
        found = self._file.execute("SELECT row, again FROM drive WHERE key = ? AND truck = ?", (key, truck)).fetchone()
        return (None, False) if found is None else (json.loads(found[0]), bool(found[1]))

    def _joined(self, kept: dict[str, Any], again: bool, row: dict[str, Any]) -> dict[str, Any]:
        """Of two answers on one drive: the new one if the other is outdated or its file is gone, else the one without
        an error, of equal ones that of the first file by name."""
        is_there = self._file.execute("SELECT 1 FROM seen WHERE uri = ?", (kept["log"],)).fetchone() is not None
        if again or not is_there:
            return with_earliest(row, own_outside(kept))
        first, second = sorted((kept, row), key=lambda each: (each.get("error_code") is not None, each["log"]))
        return with_earliest(first, own_outside(second))

    def _store(self, key: str, row: dict[str, Any], *, again: bool) -> None:
        """`log` of the table is the first by name of the drive's files; that in `row` is the one that was answered."""
        (first,) = self._file.execute(
            "SELECT min(uri) FROM seen WHERE key = ? AND truck = ?", (key, row["truck"])
        ).fetchone()
        store(self._file, key, row, log=first or row["log"], again=again)

    def commit(self) -> None:
        self._file.execute("COMMIT")
        self._file.execute("BEGIN IMMEDIATE")

    def count_trucks(self) -> int:
        (count,) = self._file.execute("SELECT count(DISTINCT truck) FROM drive WHERE truck != ''").fetchone()
        return int(count)

    def by_truck(self) -> Iterator[tuple[str, list[dict[str, Any]]]]:
        """Each truck's rows in order of time, one truck in memory at a time; first the rows without a truck. Drives
        that are gone are not among them, and `is_removed` is true for those that a person removed."""
        trucks = self._file.execute(f"SELECT DISTINCT truck FROM drive WHERE NOT {_IS_GONE} ORDER BY truck").fetchall()
        for (truck,) in trucks:
            rows = self._file.execute(
                f"SELECT row, log, {_IS_LEFT_OUT} FROM drive WHERE truck = ? AND NOT {_IS_GONE} ORDER BY start, key",
                (truck,),
            )
            yield truck, [json.loads(row) | {"log": log, "is_removed": removed} for row, log, removed in rows]

    def of_two_trucks(self) -> list[dict[str, Any]]:
        """Drives that count for several trucks: a log of one lies among those of another."""
        there = "SELECT min(uri) FROM seen s JOIN planned USING (uri) WHERE s.key = d.key AND s.truck = d.truck"
        drives = (
            f"SELECT key, truck, coalesce(({there}), log) AS log FROM drive d WHERE truck != '' AND error_code IS NULL"
            f" AND NOT {_IS_LEFT_OUT} ORDER BY key, truck"
        )
        rows = self._file.execute(
            f"SELECT min(log), json_group_array(json_object('log', log, 'truck', truck)) FROM ({drives})"
            " GROUP BY key HAVING count(*) > 1 ORDER BY 1"
        )
        both = [(log, json.loads(logs)) for log, logs in rows]
        return [{"log": log, "trucks": [each["truck"] for each in logs], "logs": logs} for log, logs in both]

    def remove(self, log: str) -> list[str]:
        """Leaves the drive of a log out, in every night; its trucks.

        Raises:
            OncenterError: "no_such_log", exit code 2: no drive has this log.
        """
        drives = self._drives_of(log)
        self._file.executemany(f"INSERT OR REPLACE INTO left_out VALUES (?, ?, '{_REMOVED}')", drives)
        return [truck for _, truck in drives]

    def take_back(self, log: str) -> list[str]:
        """Lets a drive count that was removed, or whose file is gone: that file is forgotten.

        Raises:
            OncenterError: "no_such_log", exit code 2: no drive has this log, or it is not left out.
        """
        drives = [
            drive
            for drive in self._drives_of(log)
            if self._file.execute("DELETE FROM left_out WHERE key = ? AND truck = ? RETURNING 1", drive).fetchall()
        ]
        if not drives:
            raise _wrong(f"the drive of {log} was not removed: it counts", "no_such_log")
        self._file.executemany("DELETE FROM seen WHERE key = ? AND truck = ?", drives)
        return [truck for _, truck in drives]

    def _drives_of(self, log: str) -> list[tuple[str, str]]:
        """Key and truck of each; a file that is gone may have had another drive before."""
        drives = self._file.execute(
            "SELECT key, truck FROM drive WHERE log = ? UNION SELECT key, truck FROM seen JOIN drive USING (key, truck)"
            " WHERE uri = ?",
            (log, log),
        ).fetchall()
        if not drives:
            raise _wrong(f"no drive of {log} in this ledger: the column log of drives.parquet names all", "no_such_log")
        return drives

    def events_of(self, truck: str) -> list[Event]:
        """In order of time."""
        rows = self._file.execute("SELECT time, kind, by_rad FROM events WHERE truck = ? ORDER BY time, kind", (truck,))
        return [Event(*row) for row in rows]

    def state(self, truck: str, event: Event) -> None:
        """Keeps an event, in place of one of the same kind and time."""
        self._file.execute(
            "INSERT OR REPLACE INTO events VALUES (?, ?, ?, ?, ?)",
            (truck, event.time_s, event.kind, event.by_rad, time.time()),
        )

    def forget(self, truck: str, event: Event) -> None:
        """Removes the event of this kind and time.

        Raises:
            OncenterError: "usage", exit code 2: there is none.
        """
        same = (truck, event.time_s, event.kind)
        sql = "DELETE FROM events WHERE truck = ? AND time = ? AND kind = ? RETURNING 1"
        if not self._file.execute(sql, same).fetchall():
            raise _wrong(f"no event {event} of truck {truck}: --list names those that there are", "usage")

    def require_truck(self, truck: str) -> None:
        """
        Raises:
            OncenterError: "usage", exit code 2: it has no drive.
        """
        if truck == "" or self._file.execute("SELECT 1 FROM drive WHERE truck = ?", (truck,)).fetchone() is None:
            raise _wrong(f"no truck {truck} in this ledger: oncenter fleet trucks names those that there are", "usage")

    def last_night(self, kind: str) -> dict[str, str]:
        """The results that the last night ended with, by name."""
        rows = self._file.execute("SELECT name, said FROM last_night WHERE kind = ?", (kind,))
        return {str(name): str(said) for name, said in rows}

    def say(self, of_kinds: Mapping[str, Mapping[str, str]]) -> None:
        """Keeps the results of this night for the next one."""
        self._file.execute("DELETE FROM last_night")
        for kind, said in of_kinds.items():
            self._file.executemany("INSERT INTO last_night VALUES (?, ?, ?)", ((kind, *each) for each in said.items()))
        self.commit()

    def close(self) -> None:
        """Keeps the rows added. If a full disk has ended the transaction, nothing is committed: its error stands."""
        try:
            if self._file.in_transaction:
                self._file.execute("COMMIT")
        finally:
            self._file.close()


@contextmanager
def ledger_in(folder: Path) -> Iterator[Ledger]:
    """The ledger of an output folder, to change what a person states.

    Raises:
        OncenterError: "output", exit code 2: there is none, it is damaged, or a run has it.
    """
    path = folder / LEDGER
    if not (path.is_file() and is_ledger(path)):
        raise _wrong(f"no ledger of a fleet in {folder}: name the --output folder of oncenter fleet run", "output")
    try:
        with closing(Ledger(path)) as ledger:
            yield ledger
    except sqlite3.Error as error:
        raise _wrong(f"cannot change {path}: {error}; oncenter fleet run sets damage apart", "output") from None


def _wrong(why: str, code: str) -> OncenterError:
    return OncenterError(why, code=code, exit_code=WRONG_USAGE)


def _begin_of_names(place: str) -> str:
    """Of all logs in a place."""
    if place.startswith(STORE):
        return f"{printable_name(unquote(place.partition('?')[0]).rstrip('/'))}/"  # as pyarrow decodes a URI
    return printable_name(os.path.join(place, ""))


def _is_there(path: str) -> bool:
    try:
        os.lstat(path)
    except (FileNotFoundError, NotADirectoryError):
        return False
    return True
