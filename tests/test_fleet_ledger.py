"""A drive is the content of its log and its truck, and damage costs no more than what is damaged."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import sqlite3
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from two_trucks import VIN, tables

from oncenter.cli import run as command
from oncenter.errors import OncenterError
from oncenter.files.child import ChildDied
from oncenter.files.file_name import printable_name
from oncenter.fleet import Summary, page, run
from oncenter.fleet.drive import Work, copy_of
from oncenter.fleet.files import LogFile, find_logs
from oncenter.fleet.ledger import LEDGER, Ledger
from oncenter.fleet.trucks import Trucks
from oncenter.fleet.watched import Watched

DAY_S = 86400.0

# The tables of version 1, which had no version number.
VERSION_1 = """
CREATE TABLE drive (key TEXT PRIMARY KEY, log TEXT, truck TEXT, start REAL, settings TEXT,
                    vehicle_file TEXT, again INTEGER, row TEXT);
CREATE INDEX in_time ON drive (truck, start, key);
CREATE TABLE seen (uri TEXT PRIMARY KEY, size INTEGER, modified REAL, key TEXT);
CREATE INDEX of_key ON seen (key);
CREATE TABLE begun (uri TEXT PRIMARY KEY);
"""

pytestmark = pytest.mark.usefixtures("answered_here")


class Fleet:
    """Two trucks a and b with a vehicle file each, and nights over their logs that note which are read."""

    def __init__(self, root: Path, days: Path) -> None:
        self.logs, self.vehicles, self.output = root / "logs", root / "vehicles", root / "out"
        self.vehicles.mkdir()
        for truck in "ab":
            (self.logs / truck).mkdir(parents=True)
            (self.vehicles / f"{truck}.toml").write_text("wheelbase_m = 3.7\nsteering_ratio = 19.3\n")
        for day in range(3):
            shutil.copy(days / f"day{day}.parquet", self.logs / "a" / f"day{day}.parquet")
        self.answered: list[str] = []

    def night(self, *places: str, **options: Any) -> Summary:
        self.answered.clear()

        def engine(
            work: Callable[[LogFile], dict[str, Any]], logs: Iterable[LogFile]
        ) -> Iterator[tuple[LogFile, dict[str, Any]]]:
            answer = Work(Trucks(self.vehicles))  # in this process, which is faster
            for log in logs:
                row = answer(log)
                if not row.get("is_copy"):
                    self.answered.append(Path(log.uri).name)
                yield log, row

        return run(places or [str(self.logs)], self.vehicles, self.output, engine=engine, **options)

    def rows(self) -> list[tuple[str, str]]:
        """Truck and place of each drive."""
        drives = pl.read_parquet(self.output / "drives.parquet")
        places = [os.path.relpath(log, self.logs) for log in drives["log"]]
        return sorted(zip(drives["truck"].to_list(), places, strict=True))

    def trucks(self) -> bytes:
        return b"".join((self.output / f"{name}.parquet").read_bytes() for name in ("trucks", "changes"))

    @contextlib.contextmanager
    def ledger(self) -> Iterator[sqlite3.Connection]:
        with contextlib.closing(sqlite3.connect(self.output / LEDGER)) as file, file:
            yield file


@pytest.fixture
def trucks(fleet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Fleet:
    monkeypatch.setattr(page, "_page", lambda contents: f"{contents.ranked}\n{contents.changes}")  # drawing takes long
    return Fleet(tmp_path, fleet / "logs" / "depot-7")


# -- copied, moved, renamed


def test_a_log_that_is_moved_to_the_right_truck_is_a_drive_of_that_truck_alone(trucks: Fleet) -> None:
    trucks.night()
    shutil.move(trucks.logs / "a" / "day1.parquet", trucks.logs / "b" / "z.parquet")
    trucks.night()
    assert trucks.rows() == [("a", "a/day0.parquet"), ("a", "a/day2.parquet"), ("b", "b/z.parquet")]


def test_a_copy_among_another_truck_s_logs_removes_no_drive_and_is_named(
    trucks: Fleet, capsys: pytest.CaptureFixture[str]
) -> None:
    (trucks.vehicles / "b.toml").write_text("wheelbase_m = 4.1\nsteering_ratio = 20.0\n")  # other settings
    trucks.night()
    shutil.copy(trucks.logs / "a" / "day1.parquet", trucks.logs / "b" / "day1.parquet")
    summary = trucks.night()
    assert trucks.rows() == [*(("a", f"a/day{k}.parquet") for k in range(3)), ("b", "b/day1.parquet")]
    assert [each["trucks"] for each in summary.in_two_trucks] == [["a", "b"]]


def test_a_log_that_is_copied_moved_or_renamed_is_not_answered_again_and_changes_no_truck(trucks: Fleet) -> None:
    trucks.night()
    before = trucks.trucks()
    shutil.copy(trucks.logs / "a" / "day0.parquet", trucks.logs / "a" / "copy.parquet")
    shutil.move(trucks.logs / "a" / "day1.parquet", trucks.logs / "a" / "renamed.parquet")
    (trucks.logs / "archive" / "a").mkdir(parents=True)
    shutil.move(trucks.logs / "a" / "day2.parquet", trucks.logs / "archive" / "a" / "day2.parquet")
    summary = trucks.night()
    assert (trucks.answered, summary.logs_copied, summary.logs_answered, summary.drives) == ([], 3, 0, 3)
    assert trucks.trucks() == before
    places = ["a/copy.parquet", "a/renamed.parquet", "archive/a/day2.parquet"]
    assert trucks.rows() == [("a", place) for place in places]


def test_a_log_that_is_moved_to_where_nothing_names_its_truck_stays_its_drive(trucks: Fleet) -> None:
    trucks.night()
    (trucks.logs / "archive").mkdir()
    shutil.move(trucks.logs / "a" / "day1.parquet", trucks.logs / "archive" / "x.parquet")
    trucks.night()
    drives = [("a", "a/day0.parquet"), ("a", "a/day2.parquet"), ("a", "archive/x.parquet")]
    assert (trucks.rows(), trucks.answered) == (drives, [])
    (trucks.vehicles / "a.toml").write_text("wheelbase_m = 3.8\nsteering_ratio = 19.3\n")
    trucks.night()
    assert trucks.rows() == drives and len(trucks.answered) == 3


@pytest.mark.parametrize("folder", ["logs", "my%20logs", "%C3%BC%1b", "a%252520b"])
def test_a_log_that_is_moved_in_a_bucket_leaves_its_truck_whatever_its_folder_is_called(
    trucks: Fleet, tmp_path: Path, folder: str
) -> None:
    pyarrow_fs = pytest.importorskip("pyarrow.fs", reason="pyarrow is not installed: pip install 'oncenter[s3]'")
    place = f"s3://nightly/{folder}/?scheme=http&endpoint_override=127.0.0.1:9&region=none"
    _, path = pyarrow_fs.FileSystem.from_uri(place)
    vehicles = Trucks(trucks.vehicles)
    for truck in "ab":
        log = LogFile(f"s3://{path.rstrip('/')}/{truck}/day.parquet", "", 1, 0.0)
        row = {"key": "k", "truck": truck, "log": printable_name(log.uri), "settings": vehicles.settings(truck)}
        with contextlib.closing(Ledger(tmp_path / LEDGER)) as ledger:
            assert ledger.plan([log], vehicles, places=[place]) == (1, 1)
            ledger.add(log, row)
            ledger.forget_left_behind()
            assert [name for name, _ in ledger.by_truck()] == [truck]


@pytest.mark.parametrize("first", ["a", "nowhere"])
def test_a_copy_whose_truck_is_not_named_is_the_drive_of_the_other_in_any_order(trucks: Fleet, first: str) -> None:
    (trucks.logs / "nowhere").mkdir()
    shutil.copy(trucks.logs / "a" / "day0.parquet", trucks.logs / "nowhere" / "x.parquet")
    trucks.night(str(trucks.logs / first))
    summary = trucks.night()
    assert trucks.rows() == [("a", f"a/day{k}.parquet") for k in range(3)] and summary.refused == {}


def test_the_same_logs_by_a_relative_path_are_not_looked_at_again(
    trucks: Fleet, monkeypatch: pytest.MonkeyPatch
) -> None:
    trucks.night()
    before = tables(trucks.output)
    for folder, place in ((trucks.logs, "."), (trucks.logs.parent, "logs"), (trucks.logs / "a", "../../logs")):
        monkeypatch.chdir(folder)
        summary = trucks.night(place)
        assert (trucks.answered, summary.logs_copied, summary.logs_found) == ([], 0, 3)
        assert tables(trucks.output) == before


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_of_copies_without_a_start_in_the_log_the_drive_has_the_best_start_of_any(
    trucks: Fleet, order: tuple[int, int]
) -> None:
    table = pl.read_parquet(trucks.logs / "a" / "day0.parquet").with_columns(
        pl.col("time_s") - pl.col("time_s").first()
    )
    shutil.rmtree(trucks.logs / "a")
    places = [trucks.logs / "a" / name for name in ("2026-03-02_07-00/x.parquet", "2026-03-01_08-00.parquet")]
    for path in places:
        path.parent.mkdir(parents=True, exist_ok=True)
        table.write_parquet(path)
    for place in order:
        trucks.night(str(places[place]))
    [row] = pl.read_parquet(trucks.output / "drives.parquet").to_dicts()
    assert (row["start_source"], f"{row['start']:%d %H}") == ("name", "01 08")
    shutil.move(places[1], trucks.logs / "a" / "moved.parquet")
    trucks.night()
    [row] = pl.read_parquet(trucks.output / "drives.parquet").to_dicts()
    assert f"{row['start']:%d %H}" == "01 08"


def test_a_copy_in_another_format_does_not_count_for_its_truck_and_names_the_original(trucks: Fleet) -> None:
    trucks.night()
    before = trucks.trucks()
    pl.read_parquet(trucks.logs / "a" / "day0.parquet").write_csv(trucks.logs / "a" / "other.csv")
    summary = trucks.night()
    assert (summary.drives, summary.copies) == (4, 1) and trucks.trucks() == before
    drives = pl.read_parquet(trucks.output / "drives.parquet")
    name_of = {row["key"]: Path(row["log"]).name for row in drives.to_dicts()}
    copies = {name_of[row["key"]]: name_of[row["copy_of"]] for row in drives.to_dicts() if row["copy_of"]}
    assert set(copies) | set(copies.values()) == {"day0.parquet", "other.csv"} and len(copies) == 1


def test_a_log_is_compared_with_few_of_many_files_of_its_size(trucks: Fleet, tmp_path: Path) -> None:
    logs = [LogFile(str(trucks.logs / "a" / f"{k:03}.parquet"), "", 7, float(k)) for k in range(100)]
    moved = LogFile(str(trucks.logs / "a" / "z.parquet"), "", 7, 50.0)
    row = {"truck": "a", "vehicle_file": "a", "settings": "s"}
    with contextlib.closing(Ledger(tmp_path / LEDGER)) as ledger:
        ledger.plan([*logs, moved], Trucks(trucks.vehicles))
        for log in logs:
            ledger.add(log, row | {"log": log.uri, "key": log.uri})
        assert next(log for log in ledger.to_do() if log.uri == moved.uri).known == ((logs[50].uri, "a", True),)
    with contextlib.closing(Ledger(tmp_path / "few.sqlite")) as ledger:
        ledger.plan([logs[0], moved], Trucks(trucks.vehicles))
        ledger.add(logs[0], row | {"log": logs[0].uri, "key": "first"})
        assert next(log for log in ledger.to_do() if log.uri == moved.uri).known == (("first", "a", True),)


def test_a_file_that_gets_another_content_leaves_its_drive_to_a_copy_that_is_found_later(
    trucks: Fleet, tmp_path: Path
) -> None:
    """Whichever of the two is answered first."""
    path = trucks.logs / "a" / "day0.parquet"
    log = LogFile(str(path), "", 1, 2.0)
    copy = LogFile(str(trucks.logs / "a" / "z.parquet"), "", 1, 3.0)
    row = {"log": log.uri, "truck": "a", "vehicle_file": "a", "settings": "s", "key": "old"}
    with contextlib.closing(Ledger(tmp_path / LEDGER)) as ledger:
        ledger.plan([log, copy], Trucks(trucks.vehicles))
        ledger.add(log, row)
        ledger.add(log, row | {"key": "new"})
        ledger.add(copy, copy_of("old", "a"))
        ledger.forget_left_behind()
        [(_, rows)] = ledger.by_truck()
    assert {each["key"]: each["log"] for each in rows} == {"old": copy.uri, "new": log.uri}


# -- damage

DAMAGES = {
    "no JSON": "row = '{'",
    "a list": "row = '[]'",
    "null": "row = NULL",
    "bytes": "row = x'ff00'",
    "another number": "row = replace(row, '\"offset_deg\": ', '\"offset_deg\": 1')",
    "no truck": "truck = NULL",
    "a start that is text": "start = 'yesterday'",
    "a log that is no text": "log = x'ff'",
    "endless": "row = '{\"a\": ' || hex(zeroblob(100000)) || '}'",
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_damaged_row_is_set_apart_and_named_and_its_log_is_answered_again(trucks: Fleet, damage: str) -> None:
    trucks.night()
    before = tables(trucks.output)
    with trucks.ledger() as ledger:
        ledger.execute(f"UPDATE drive SET {damage} WHERE log LIKE '%day1%'")
    summary = trucks.night()
    assert trucks.answered == ["day1.parquet"] and len(summary.damaged) == 1
    assert tables(trucks.output) == before
    assert trucks.night().damaged == ()
    with trucks.ledger() as ledger:
        assert ledger.execute("SELECT count(*) FROM damaged").fetchone() == (1,)


def test_a_damaged_row_without_its_log_costs_this_drive_and_fails_a_night_that_is_to_fail(
    trucks: Fleet, capsys: pytest.CaptureFixture[str]
) -> None:
    trucks.night()
    (trucks.logs / "a" / "day1.parquet").unlink()
    with trucks.ledger() as ledger:
        ledger.execute("UPDATE drive SET row = '{' WHERE log LIKE '%day1%'")
    arguments = ["fleet", "run", str(trucks.logs), "--vehicles", str(trucks.vehicles), "--output", str(trucks.output)]
    assert command([*arguments, "--fail-on", "damaged"]) == 3
    out, err = capsys.readouterr()
    assert str(trucks.logs / "a" / "day1.parquet") in out and err.startswith("oncenter: --fail-on: 1 damaged: ")
    assert err.count("\n") == 1 and "day1.parquet" in err
    assert trucks.rows() == [("a", "a/day0.parquet"), ("a", "a/day2.parquet")]


@pytest.mark.parametrize("column", ["uri", "size", "modified", "key", "truck"])
@pytest.mark.parametrize("value", ["NULL", "x'ff'", "'text'"])
def test_a_damaged_record_of_a_file_costs_a_look_at_the_file(trucks: Fleet, column: str, value: str) -> None:
    trucks.night()
    before = tables(trucks.output)
    with trucks.ledger() as ledger:
        ledger.execute(f"UPDATE seen SET {column} = {value} WHERE uri LIKE '%day1%'")
        ledger.execute("INSERT INTO begun VALUES (x'ff')")
    trucks.night()
    assert tables(trucks.output) == before


@pytest.mark.parametrize("place", ["head", "middle", "all", "nothing left"])
def test_a_ledger_that_cannot_be_read_is_set_apart_and_the_night_goes_on(trucks: Fleet, place: str) -> None:
    trucks.night()
    before = tables(trucks.output)
    path = trucks.output / LEDGER
    content = bytearray(path.read_bytes())
    begin, end = {"head": (0, 100), "middle": (4096, len(content) - 4096)}.get(place, (0, len(content)))
    content[begin:end] = b"\xa5" * (end - begin)
    path.write_bytes(b"" if place == "nothing left" else content)
    [named] = trucks.night().damaged
    assert "ledger-damaged-1.sqlite" in named and (trucks.output / "ledger-damaged-1.sqlite").is_file()
    assert tables(trucks.output) == before
    assert trucks.night().damaged == () and trucks.answered == []


def test_a_ledger_whose_schema_is_no_text_is_set_apart(trucks: Fleet) -> None:
    """SQLite quotes it in its error."""
    trucks.night()
    before = tables(trucks.output)
    content = (trucks.output / LEDGER).read_bytes()
    (trucks.output / LEDGER).write_bytes(content.replace(b"CREATE INDEX of_drive ON", b"CREATE IND\xe9X of_drive ON"))
    assert len(trucks.night().damaged) == 1 and tables(trucks.output) == before


def test_an_index_that_contradicts_its_table_counts_no_drive_twice(trucks: Fleet) -> None:
    trucks.night()
    before = tables(trucks.output)
    with trucks.ledger() as ledger:
        (page,) = ledger.execute(
            "SELECT rootpage FROM sqlite_master WHERE name LIKE 'sqlite_autoindex_drive%'"
        ).fetchone()
        (key,) = ledger.execute("SELECT key FROM drive WHERE log LIKE '%day1%'").fetchone()
    content = bytearray((trucks.output / LEDGER).read_bytes())
    at = content.index(key.encode(), 4096 * (page - 1), 4096 * page)
    content[at] ^= 1
    (trucks.output / LEDGER).write_bytes(content)
    (trucks.vehicles / "a.toml").touch()
    shutil.copy(trucks.logs / "a" / "day1.parquet", trucks.logs / "a" / "x.parquet")
    [named] = trucks.night().damaged
    assert named.endswith(": 3 rows were kept") and tables(trucks.output) == before


def test_rows_that_can_be_read_of_a_damaged_ledger_are_kept_without_their_logs(trucks: Fleet) -> None:
    trucks.night()
    before = trucks.trucks()
    path = trucks.output / LEDGER
    with contextlib.closing(sqlite3.connect(path)) as file:
        (page,) = file.execute("SELECT rootpage FROM sqlite_master WHERE name = 'in_time'").fetchone()
    content = bytearray(path.read_bytes())
    content[4096 * (page - 1) : 4096 * page] = b"\xa5" * 4096
    path.write_bytes(content)
    shutil.rmtree(trucks.logs / "a")
    [named] = trucks.night().damaged
    assert named.endswith(": 3 rows were kept") and trucks.trucks() == before


def test_a_file_of_somebody_s_own_in_place_of_the_ledger_is_left_as_it_is(trucks: Fleet) -> None:
    trucks.output.mkdir()
    (trucks.output / LEDGER).write_bytes(b"mine, and no database" * 100)
    with pytest.raises(OncenterError, match="is not from a fleet run and would be overwritten"):
        trucks.night()
    assert (trucks.output / LEDGER).read_bytes() == b"mine, and no database" * 100


# -- readers that are killed


@pytest.mark.parametrize(("by_kill", "attempts"), [(True, [2, 2, 0]), (False, [1, 0, 0])])
def test_a_log_whose_readers_are_killed_from_outside_is_read_again_in_the_next_night_and_one_that_crashes_is_not(
    trucks: Fleet, monkeypatch: pytest.MonkeyPatch, by_kill: bool, attempts: list[int]
) -> None:
    """What takes all memory by itself must not take it in every night."""
    attempted: list[str] = []

    def dies(_: Watched, log: LogFile) -> dict[str, Any]:
        attempted.append(log.uri)
        raise ChildDied("reader_crashed", "its reader crashed", by_kill=by_kill)

    monkeypatch.setattr(Watched, "_answered", dies)
    counts: list[int] = []
    for _ in attempts:
        attempted.clear()
        summary = run([str(trucks.logs / "a" / "day0.parquet")], trucks.vehicles, trucks.output)
        counts.append(len(attempted))
        assert summary.refused == {"reader_crashed": 1}
    assert counts == attempts


def test_a_log_whose_readers_were_killed_from_outside_once_is_answered_in_the_next_night(
    trucks: Fleet, monkeypatch: pytest.MonkeyPatch
) -> None:
    def dies(_: Watched, __: LogFile) -> dict[str, Any]:
        raise ChildDied("reader_crashed", "its reader crashed", by_kill=True)

    with monkeypatch.context() as killed:
        killed.setattr(Watched, "_answered", dies)
        assert run([str(trucks.logs)], trucks.vehicles, trucks.output).refused == {"reader_crashed": 3}
    summary = trucks.night()
    assert (summary.logs_answered, summary.refused, summary.drives) == (3, {}, 3)


# -- versions


def as_version_1(fleet: Fleet, **changed: Any) -> None:
    """The ledger as the version before wrote it; `changed` are values of the rows of day1."""
    path = fleet.output / LEDGER
    with fleet.ledger() as ledger:
        drives = ledger.execute("SELECT key, log, truck, settings, vehicle_file, again, row FROM drive").fetchall()
        seen = ledger.execute("SELECT uri, size, modified, key FROM seen").fetchall()
    path.unlink()
    with contextlib.closing(sqlite3.connect(path)) as ledger, ledger:
        ledger.executescript(VERSION_1)
        for key, log, truck, settings, file, again, text in drives:
            row = json.loads(text)
            row.pop("span_s")
            if "day1" in log:
                row |= changed
            given = (key, log, truck, row.get("start"), settings, file, again, json.dumps(row))
            ledger.execute("INSERT INTO drive VALUES (?, ?, ?, ?, ?, ?, ?, ?)", given)
        ledger.executemany("INSERT INTO seen VALUES (?, ?, ?, ?)", seen)


def as_version_2(fleet: Fleet) -> None:
    with fleet.ledger() as ledger:
        ledger.executescript("DROP TABLE left_out; DROP TABLE events; PRAGMA user_version = 2;")


def test_a_ledger_of_the_version_before_is_taken_over_without_answering_a_log_again(trucks: Fleet) -> None:
    trucks.night()
    before = tables(trucks.output)
    as_version_1(trucks)
    summary = trucks.night()
    assert (trucks.answered, summary.damaged) == ([], ()) and tables(trucks.output) == before
    with trucks.ledger() as ledger:
        assert ledger.execute("PRAGMA user_version").fetchone() == (3,)
        names = {name for (name,) in ledger.execute("SELECT name FROM sqlite_master")}
    assert not {"drive_1", "seen_1", "of_key"} & names


def test_a_damaged_row_of_the_version_before_is_set_apart(trucks: Fleet) -> None:
    trucks.night()
    before = tables(trucks.output)
    as_version_1(trucks, offset_deg="many")
    summary = trucks.night()
    assert trucks.answered == ["day1.parquet"] and len(summary.damaged) == 1
    assert tables(trucks.output) == before


@pytest.mark.parametrize("start", [float("nan"), float("inf"), -1e14, 1e300])
def test_a_start_that_the_version_before_put_down_ends_no_night(trucks: Fleet, start: float) -> None:
    trucks.night()
    as_version_1(trucks, start=start)
    summary = trucks.night(retry=True)
    assert (summary.logs_answered, summary.drives, summary.damaged) == (0, 3, ())
    drives = pl.read_parquet(trucks.output / "drives.parquet")
    assert drives.filter(pl.col("log").str.contains("day1"))["start"].to_list() == [None]
    assert pl.read_parquet(trucks.output / "trucks.parquet")["told"].to_list() == [2]


def test_a_ledger_of_a_later_version_is_refused_and_stays_as_it_is(
    trucks: Fleet, capsys: pytest.CaptureFixture[str]
) -> None:
    trucks.night()
    with trucks.ledger() as ledger:
        ledger.execute("PRAGMA user_version = 4")
    before = (trucks.output / LEDGER).read_bytes()
    arguments = ["fleet", "run", str(trucks.logs), "--vehicles", str(trucks.vehicles), "--output", str(trucks.output)]
    assert command(arguments) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and "later version of oncenter" in err
    assert (trucks.output / LEDGER).read_bytes() == before


def test_a_vin_in_the_log_names_the_truck_of_a_moved_log(fleet: Path, tmp_path: Path) -> None:
    table = pl.read_parquet(fleet / "logs" / VIN / "day0.parquet")
    (tmp_path / "in").mkdir()
    table.write_parquet(tmp_path / "in" / "x.parquet", metadata={"vin": VIN})
    output = tmp_path / "out"
    run([str(tmp_path / "in")], fleet / "vehicles", output)
    shutil.move(tmp_path / "in" / "x.parquet", tmp_path / "in" / "y.parquet")
    summary = run([str(tmp_path / "in")], fleet / "vehicles", output)
    assert (summary.logs_copied, summary.logs_answered, summary.drives) == (1, 0, 1)
    assert [log.uri for log in find_logs([str(tmp_path / "in")])] == pl.read_parquet(output / "drives.parquet")[
        "log"
    ].to_list()
