"""A run: finds new logs, has each answered, stores the rows as they come, then writes tables, ranking and page.

This process only supervises while child processes read: nothing heavy is imported before the tables are written.
"""

from __future__ import annotations

import json
import os
import sqlite3
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from oncenter import _core
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.child import READER_DEATHS, end_idle
from oncenter.files.whole_file import remove_unfinished, write_whole
from oncenter.fleet.engines import Engine, processes
from oncenter.fleet.files import STORE, LogFile, find_logs, refuse_credentials
from oncenter.fleet.ledger import AGAIN, LEDGER, Ledger
from oncenter.fleet.ledger_file import is_damage, is_ledger
from oncenter.fleet.ledger_file import set_apart as set_apart_file
from oncenter.fleet.news import Kind, News, keep_for_next_night, kinds_of, news_of
from oncenter.fleet.progress import Progress
from oncenter.fleet.trucks import Trucks
from oncenter.fleet.watched import ANSWERER, Watched
from oncenter.truck.events import Event

_DRIVES_AT_ONCE = 150_000  # of trucks whose models are computed together: about 200 MB
_UNREAD_MAX = 1000  # logs named in metrics.json for one reason
_PAGE, _METRICS = "index.html", "metrics.json"
_WRITTEN = (_PAGE, _METRICS, *(f"{name}.parquet" for name in ("drives", "trucks", "changes")))


@dataclass(frozen=True)
class Summary:
    """Counts of a run, and of the tables after it; `metrics.json` holds the same.

    `limit_deg` is the limit given to the run, None where each truck has the limit of its vehicle file. `logs_copied`
    counts logs that were copied, moved or renamed, whose answers stand. `seconds` is the duration of the run,
    `logs_per_second` the rate while logs were answered, `peak_memory_mb` that of the largest process. `copies` of the
    `drives` are copies or parts of another one and do not count for their trucks. `refused` counts logs without an
    answer by error code, `unread` names the first 1,000 of them, and `poisonous` those at which a reader crashed or was
    stopped, in this run or earlier. `new` is what differs from the last night, and `kinds` has the trucks and logs by
    kind of `--fail-on`. `damaged` names what of the ledger was damaged and set apart, and `in_two_trucks` logs that
    count for several trucks. `gone` are the first 1,000 drives that count no longer since this night, because their
    logs were removed. `events` counts those that a person stated of the trucks. `verdicts` and `states` count trucks,
    see `tables.TRUCKS`. `worst` are the first ten trucks' rows of that table.
    """

    version: str
    output: str
    limit_deg: float | None
    logs_found: int
    logs_answered: int
    logs_refused: int
    logs_copied: int
    seconds: float
    logs_per_second: float
    peak_memory_mb: float | None
    drives: int
    copies: int
    refused: dict[str, int]
    unread: tuple[dict[str, Any], ...]
    poisonous: tuple[dict[str, str], ...]
    new: News
    kinds: dict[str, Kind]
    damaged: tuple[str, ...]
    in_two_trucks: tuple[dict[str, Any], ...]
    gone: tuple[dict[str, str], ...]
    events: int
    trucks: int
    changes_of_offset: int
    verdicts: dict[str, int]
    states: dict[str, int]
    worst: tuple[dict[str, Any], ...]


def run(
    logs: Sequence[str],
    vehicles: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    engine: Engine = processes,
    limit_deg: float | None = None,
    reports: bool = False,
    retry: bool = False,
) -> Summary:
    """Answers all logs that have no answer yet, and writes `drives.parquet`, `trucks.parquet`, `changes.parquet`,
    `index.html` and `metrics.json`.

    A run may be stopped at any time, by any means: the next run answers the missing logs.

    Args:
        logs: files, folders, and s3://bucket/folder.
        vehicles: folder of vehicle files, see `oncenter.fleet.trucks.Trucks`.
        output: folder; made if missing.
        engine: see `oncenter.fleet.engines`.
        limit_deg: an offset beyond it, either sign, needs a calibration; above 0 deg. None: `offset_limit_deg` of each
            truck's vehicle file.
        reports: whether each drive answered gets a page of its own, about 2 MB.
        retry: whether logs at which a reader crashed or was stopped are read again.

    Raises:
        OncenterError: exit code 2: "no_such_log", "credentials", "vehicle_file", "output", "limit", "ray".
    """
    if limit_deg is not None and not limit_deg > 0.0:
        raise OncenterError(f"'limit_deg' must be positive, got {limit_deg:g}", code="limit", exit_code=WRONG_USAGE)
    refuse_credentials(logs)
    begin = time.monotonic()
    places = list(map(absolute, logs))
    trucks = Trucks(Path(vehicles))
    _check_is_ours_or_empty(Path(output))
    folder = _made(Path(output))
    work = Watched(trucks, _made(folder / "reports") if reports else None)

    def one_night(set_apart: tuple[str, ...]) -> Summary:
        with closing(Ledger(folder / LEDGER)) as ledger:
            for part in (folder, *filter(Path.is_dir, folder.iterdir())):  # the lock is ours: no other run writes here
                remove_unfinished(part)
            found, to_do = ledger.plan(find_logs(places), trucks, retry, places)
            progress = Progress(to_do)
            rate = _answer_all(ledger, work, engine, progress)
            _answer_drives(ledger, Watched(trucks), engine, retry)
            try:
                tables = _write_tables(folder, ledger, trucks, limit_deg)
            except OncenterError as error:
                raise _stopped(str(error)) from None
            new, damaged = news_of(ledger, tables.ranked, tables.unread), (*set_apart, *ledger.damaged)
            summary = Summary(
                version=_core.version(),
                output=str(folder),
                limit_deg=limit_deg,
                logs_found=found,
                logs_answered=progress.done - progress.errors - progress.copies,
                logs_refused=progress.errors,
                logs_copied=progress.copies,
                seconds=time.monotonic() - begin,
                logs_per_second=rate,
                peak_memory_mb=_peak_memory_mb(),
                unread=tuple(tables.unread[:_UNREAD_MAX]),
                new=new,
                kinds=kinds_of(new, tables.unread, damaged),
                damaged=damaged,
                in_two_trucks=tuple(ledger.of_two_trucks()),
                gone=tuple(ledger.gone()[:_UNREAD_MAX]),
                **tables.counts,
            )
            write_whole(folder / _METRICS, json.dumps(asdict(summary), indent=1, ensure_ascii=False) + "\n")
            keep_for_next_night(ledger, tables.ranked, tables.unread)
        return summary

    try:
        try:
            return one_night(())
        except sqlite3.DatabaseError as error:
            if not is_damage(error):
                raise
        aside, rows = set_apart_file(folder / LEDGER)
        return one_night((f"{LEDGER}, which is {aside.name} now: {rows} rows were kept",))
    except (sqlite3.Error, OSError) as error:  # usually a full disk
        raise _stopped(f"cannot write {folder}: {error}") from None


def absolute(place: str) -> str:
    """The same place from any folder, so that a log has one name; links stay, except before a `..`."""
    if place.startswith(STORE):
        return place
    try:
        path = Path.cwd() / place
        return os.fspath(path.resolve() if ".." in path.parts else path)
    except (OSError, ValueError, RuntimeError):  # searching for logs gives the reason
        return place


def _answer_all(ledger: Ledger, work: Watched, engine: Engine, progress: Progress) -> float:
    """Logs per second while answering: tables and page take the same time for any number of new logs."""
    try:
        for log, row in engine(work, ledger.to_do()):
            ledger.add(log, row)
            progress.one_more(row)
        rate = progress.rate
    finally:  # also of an interrupted run: its message begins a new line
        progress.end()
    ledger.forget_left_behind()
    return rate


def _answer_drives(ledger: Ledger, work: Watched, engine: Engine, retry: bool) -> None:
    """Drives of several logs, each as a whole, see `oncenter.fleet.several_logs`."""
    to_do = {log.uri: (log, truck, keys) for log, truck, keys in _drives_without_answer(ledger, retry)}
    progress = Progress(len(to_do))
    try:
        for log, row in engine(work, (log for log, _, _ in to_do.values())):
            ledger.add_drive(*to_do[log.uri][1:], row)
            progress.one_more(row)
    finally:
        progress.end()
    end_idle(ANSWERER)


def _drives_without_answer(ledger: Ledger, retry: bool) -> Iterator[tuple[LogFile, str, list[str]]]:
    """The last log of each with the former ones, its truck, and the keys of all."""
    from oncenter.fleet.several_logs import has_answer, in_one_drive

    for truck, rows in ledger.by_truck():
        events = ledger.events_of(truck)
        counted = [row for row in that_count(rows, events) if row.get("copy_of") is None]
        for group in in_one_drive(counted, events):
            if len(group) == 1 or has_answer(group, AGAIN if not retry else (*AGAIN, *READER_DEATHS)):
                continue
            keys = [row["key"] for row in group]
            files = ledger.files_of(truck, keys)
            if len(files) == len(keys):
                yield replace(files[-1], former=tuple(files[:-1])), truck, keys


def _stopped(why: str) -> OncenterError:
    return OncenterError(
        f"{why}; the answers so far are kept, the next run continues from there",
        code="output",
        exit_code=WRONG_USAGE,
    )


def _check_is_ours_or_empty(folder: Path) -> None:
    """Refuses a folder with files that a run would overwrite and that no run wrote.

    Raises:
        OncenterError: "output", exit code 2.
    """
    if is_ledger(folder / LEDGER):
        return
    there = [name for name in (LEDGER, *_WRITTEN) if (folder / name).exists()]
    if there:
        raise OncenterError(
            f"--output {folder}: its {there[0]} is not from a fleet run and would be overwritten; name another folder",
            code="output",
            exit_code=WRONG_USAGE,
        )


def _made(folder: Path) -> Path:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OncenterError(f"cannot make {folder}: {error.strerror}", code="output", exit_code=WRONG_USAGE) from None
    return folder


@dataclass(frozen=True)
class _Tables:
    """Of the tables of a run: their part of the summary, the trucks by rank, and the logs without an answer."""

    counts: dict[str, Any]
    ranked: list[dict[str, Any]]
    unread: list[dict[str, Any]]


def _write_tables(folder: Path, ledger: Ledger, vehicles: Trucks, limit_deg: float | None) -> _Tables:
    """All tables and the page from the ledger, truck by truck."""
    from oncenter.fleet.page import Contents, write_page
    from oncenter.fleet.page_data import PageData, drive_data
    from oncenter.fleet.ranking import OfTruck, histories, rank, vehicle_file_of
    from oncenter.fleet.tables import CHANGES, DRIVES, TRUCKS, TableFile
    from oncenter.verdict.states import OF_OFFSET

    data = PageData(ledger.count_trucks())
    trucks: list[dict[str, Any]] = []
    refused: dict[str, int] = {}
    unread: list[dict[str, Any]] = []
    changes: list[dict[str, Any]] = []
    count = copies = stated = 0

    def finish(some: Sequence[tuple[OfTruck, list[dict[str, Any]]]]) -> None:
        for of_truck, (_, of_page) in zip(histories([one for one, _ in some]), some, strict=True):
            trucks.append(of_truck.truck)
            changes.extend(of_truck.changes)
            data.add(of_truck, of_page)

    with (
        TableFile(folder / "drives.parquet", DRIVES) as drives,
        TableFile(folder / "changes.parquet", CHANGES) as table,
    ):
        waiting: list[tuple[OfTruck, list[dict[str, Any]]]] = []
        held = 0
        for truck, rows in ledger.by_truck():
            events = ledger.events_of(truck)
            rows = that_count(rows, events)
            stated += len(events)
            for row in rows:
                drives.add(row)
                code = row.get("error_code")
                if code is not None:
                    refused[code] = refused.get(code, 0) + 1
                    unread.append({name: row[name] for name in ("log", "truck", "error_code", "error")})
            count += len(rows)
            copies += sum(row.get("copy_of") is not None for row in rows)
            if truck and rows:
                limit = limit_deg or vehicles.offset_limit_deg(vehicle_file_of(rows))
                newest = rows[-data.drives_of_a_truck :]
                waiting.append((OfTruck(truck, rows, limit, events), [drive_data(folder, row) for row in newest]))
                held += len(rows)
            if held >= _DRIVES_AT_ONCE:
                finish(waiting)
                waiting, held = [], 0
        finish(waiting)
        for change in changes:
            table.add(change)
    ranked = rank(trucks)
    with TableFile(folder / "trucks.parquet", TRUCKS) as table:
        for row in ranked:
            table.add(row)
    write_page(folder / _PAGE, Contents(ranked, changes, count, refused, data))
    states = {str(state): sum(row["state"] == state for row in ranked) for state in OF_OFFSET}
    counts = {
        "drives": count,
        "copies": copies,
        "events": stated,
        "refused": dict(sorted(refused.items())),
        "poisonous": tuple(
            {"log": row["log"], "error": row["error"]} for row in unread if row["error_code"] in READER_DEATHS
        ),
        "trucks": len(ranked),
        "changes_of_offset": sum(change["quantity"] == "offset" for change in changes),
        "verdicts": states,
        "states": states,
        "worst": tuple(ranked[:10]),
    }
    return _Tables(counts, ranked, unread)


def that_count(rows: list[dict[str, Any]], events: Sequence[Event]) -> list[dict[str, Any]]:
    """A truck's rows without those of another VIN and those that a person removed; copies are marked."""
    from oncenter.fleet.ranking import mark_copies
    from oncenter.fleet.vins import without_other_vins

    rows = without_other_vins(rows, events)
    mark_copies(rows)
    return _without_removed(rows)


def _without_removed(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows without drives that a person removed, and without their copies and parts."""
    removed = {_whole(row) for row in rows if row["is_removed"]} - {""}
    return [row for row in rows if not row["is_removed"] and _whole(row) not in removed]


def _whole(row: dict[str, Any]) -> str:
    """The key of a drive, or of that of which it is a copy; empty of a log that was not read."""
    return str(row.get("copy_of") or row["key"])


def _peak_memory_mb() -> float | None:
    """The peak memory of the largest process of the run; None on Windows, which does not report it."""
    if sys.platform == "win32":
        return None
    import resource

    ours = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    unit = 1024.0**2 if sys.platform == "darwin" else 1024.0  # bytes there, KiB elsewhere
    return max(resource.getrusage(who).ru_maxrss for who in ours) / unit
