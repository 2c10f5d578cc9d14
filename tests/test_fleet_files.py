"""What may lie among a fleet's logs: nothing of it ends the night, and all of it is named."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import socket
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from two_trucks import MONDAY_S, VIN, histories, tables
from watched import oncenter, watch

from oncenter.cli import run as command
from oncenter.errors import OncenterError
from oncenter.files.log_formats import WRITTEN
from oncenter.fleet import Summary, engines, run, watched
from oncenter.fleet.files import LogFile, at_hand, find_logs
from oncenter.fleet.ledger import LEDGER
from oncenter.fleet.trucks import Trucks
from oncenter.simulate import simulate_to_log

pytestmark = pytest.mark.slow

Night = Callable[[], Summary]


@pytest.fixture
def logs(fleet: Path, tmp_path: Path) -> Path:
    """One good log of depot-7."""
    folder = tmp_path / "logs" / "depot-7"
    folder.mkdir(parents=True)
    shutil.copy(fleet / "logs" / "depot-7" / "day0.parquet", folder / "good.parquet")
    return folder


@pytest.fixture
def night(fleet: Path, tmp_path: Path, logs: Path) -> Night:
    return lambda: run([str(logs)], fleet / "vehicles", tmp_path / "out")


def rows(output: Path) -> dict[str, dict[str, Any]]:
    """The rows of drives.parquet by the file's name."""
    return {Path(row["log"]).name: row for row in pl.read_parquet(output / "drives.parquet").to_dicts()}


def put_what_is_no_log(folder: Path) -> dict[str, str]:
    """Files that are no logs; for each name a part of its error."""
    os.mkfifo(folder / "pipe.log")
    (folder / "zeros.log").symlink_to("/dev/zero")
    (folder / "nowhere.log").symlink_to(folder / "none")
    (folder / "itself.log").symlink_to("itself.log")
    with contextlib.closing(socket.socket(socket.AF_UNIX)) as listening, contextlib.chdir(folder):
        listening.bind("socket.log")
    device, link = "is a pipe, a socket or a device", "is a link whose target does not exist"
    said = {"pipe.log": device, "zeros.log": device, "socket.log": device}
    return said | {"nowhere.log": link, "itself.log": link}


def too_deep(folder: Path) -> Path:
    """Folders in each other, so many that no call takes the path of the last; the first of them."""
    at = os.open(folder, os.O_RDONLY)
    for depth in range(20):
        name = f"{depth:02}" + "x" * 248
        os.mkdir(name, dir_fd=at)
        below = os.open(name, os.O_RDONLY, dir_fd=at)
        os.close(at)
        at = below
    os.close(at)
    return folder / ("00" + "x" * 248)


# -- the walk


def test_folders_that_link_to_each_other_are_walked_once(tmp_path: Path) -> None:
    (tmp_path / "b" / "c").mkdir(parents=True)
    (tmp_path / "elsewhere").mkdir()
    for folder in ("b/c", "elsewhere"):
        (tmp_path / folder / "day.csv").write_text("x")
    (tmp_path / "b" / "c" / "up").symlink_to(tmp_path / "b")
    (tmp_path / "b" / "a link").symlink_to(tmp_path / "b" / "c")  # comes before c by name, after it in the walk
    (tmp_path / "b" / "out").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "b" / "self").symlink_to("self")
    found = [log.uri for log in find_logs([str(tmp_path / "b"), str(tmp_path / "elsewhere")])]
    assert sorted(found) == [str(tmp_path / "b" / "c" / "day.csv"), str(tmp_path / "elsewhere" / "day.csv")]


def test_a_link_that_leads_out_of_the_folder_is_a_row_that_names_its_target_and_shows_nothing_of_it(
    fleet: Path, logs: Path, night: Night, tmp_path: Path
) -> None:
    (tmp_path / "elsewhere").mkdir()
    secret = tmp_path / "elsewhere" / "secret.csv"
    secret.write_text("root:x:0:0\n")
    (logs / "a.csv").symlink_to(secret)
    (logs / "b").symlink_to(secret.parent)
    (logs / "c.parquet").symlink_to(logs / "good.parquet")
    summary = night()
    assert (summary.logs_answered, summary.refused) == (2, {"not_a_file": 2})
    given = rows(tmp_path / "out")
    for name, target in (("a.csv", secret), ("b", secret.parent)):
        assert given[name]["error"] == f"{logs / name} is a link that leads out of its folder: name {target} as well"
    assert night().logs_refused == 0
    both = run([str(logs), str(secret.parent)], fleet / "vehicles", tmp_path / "out")
    assert (both.logs_answered, both.refused) == (0, {"missing_signal": 1})  # of the truck whose folder has the link


def test_a_thousand_folders_in_each_other_are_walked(tmp_path: Path) -> None:
    (tmp_path / "stays").touch()
    folder = tmp_path
    for _ in range(1200):
        folder /= "d"
        folder.mkdir()
    log = folder / "day.csv"
    log.write_text("x")
    try:
        assert [found.uri for found in find_logs([str(tmp_path)])] == [str(log)]
    finally:  # nobody else can remove so deep a tree
        log.unlink()
        os.removedirs(folder)


def test_an_entry_named_like_a_log_that_is_not_a_file_is_a_row_without_a_process(
    logs: Path, night: Night, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (logs / "good.parquet").unlink()
    said = put_what_is_no_log(logs)
    monkeypatch.setattr(watched, "borrowed", lambda module: pytest.fail("a child process was started"))
    assert night().refused == {"not_a_file": len(said)}
    given = rows(tmp_path / "out")
    assert {name: row["truck"] for name, row in given.items()} == dict.fromkeys(said, "depot-7")
    for name, why in said.items():
        assert given[name]["error"] == f"{logs / name} {why}" + (", not a file" if "device" in why else "")
    before = tables(tmp_path / "out")
    summary = night()
    assert (summary.logs_found, summary.logs_refused) == (len(said), 0)
    assert tables(tmp_path / "out") == before


def test_a_pipe_that_is_named_itself_is_a_row_as_well(fleet: Path, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.log")
    assert run([str(tmp_path / "a.log")], fleet / "vehicles", tmp_path / "out").refused == {"not_a_file": 1}


def test_what_was_no_log_is_no_row_when_it_is_gone_and_a_drive_when_it_is_one(
    fleet: Path, logs: Path, night: Night, tmp_path: Path
) -> None:
    os.mkfifo(logs / "gone.log")
    os.mkfifo(logs / "other.parquet")
    (logs / "later.parquet").symlink_to(logs / "to be")
    assert night().refused == {"not_a_file": 3}
    (logs / "gone.log").unlink()
    (logs / "other.parquet").unlink()
    for day, log in ((1, logs / "other.parquet"), (2, logs / "to be")):
        shutil.copy(fleet / "logs" / "depot-7" / f"day{day}.parquet", log)
    summary = night()
    assert (summary.logs_answered, summary.refused) == (2, {})
    assert set(rows(tmp_path / "out")) == {"good.parquet", "other.parquet", "later.parquet"}


def test_a_folder_that_cannot_be_listed_is_a_row_until_it_can(
    fleet: Path, logs: Path, night: Night, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    locked = logs / "locked"
    locked.mkdir()
    shutil.copy(fleet / "logs" / "depot-7" / "day1.parquet", locked)
    scandir = os.scandir

    def refused(folder: str) -> Any:
        if Path(folder) == locked:
            raise PermissionError(13, "Permission denied")
        return scandir(folder)

    with monkeypatch.context() as context:
        context.setattr(os, "scandir", refused)
        summary = night()
        assert (summary.logs_answered, summary.refused) == (1, {"unreadable_folder": 1})
        assert rows(tmp_path / "out")["locked"]["error"] == f"cannot list the folder {locked}: Permission denied"
        assert night().logs_refused == 0
    summary = night()
    assert (summary.logs_answered, summary.refused, summary.drives) == (1, {}, 2)


def test_a_log_that_is_gone_when_its_turn_comes_is_its_own_row(
    fleet: Path, logs: Path, night: Night, tmp_path: Path
) -> None:
    gone = logs / "a gone one.parquet"
    shutil.copy(fleet / "logs" / "depot-7" / "day1.parquet", gone)

    def engine(work: Any, waiting: Any) -> Iterator[tuple[LogFile, dict[str, Any]]]:
        gone.unlink(missing_ok=True)
        return engines.processes(work, waiting)

    summary = run([str(logs)], fleet / "vehicles", tmp_path / "out", engine=engine)
    assert (summary.logs_answered, summary.refused) == (1, {"unreadable_log": 1})
    assert rows(tmp_path / "out")[gone.name]["error"] == f"cannot read {gone}: No such file or directory"


def test_a_device_is_not_at_hand(tmp_path: Path) -> None:
    device = tmp_path / "a.log"
    device.symlink_to(os.devnull)
    with pytest.raises(OncenterError, match="not a file"), at_hand(LogFile(str(device), "", 0, 0.0)):
        pass


def test_a_vehicle_file_that_is_a_pipe_holds_up_no_night(fleet: Path, tmp_path: Path, logs: Path) -> None:
    vehicles = shutil.copytree(fleet / "vehicles", tmp_path / "vehicles")
    (vehicles / "depot-7.toml").unlink()
    os.mkfifo(vehicles / "depot-7.toml")
    ended = watch(oncenter("fleet", "run", logs, "--vehicles", vehicles, "--output", tmp_path / "out"))
    assert (ended.harm, ended.code) == ("", 0)
    assert rows(tmp_path / "out")["good.parquet"]["error_code"] == "vehicle_file"


# -- names are bytes


@pytest.mark.posix
def test_a_log_whose_name_is_no_text_is_answered_and_shown(
    fleet: Path, undisturbed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, vehicles, output = tmp_path / os.fsdecode(b"\xfe"), tmp_path / "vehicles", tmp_path / "out"
    folder.mkdir()
    vehicles.mkdir()
    (vehicles / os.fsdecode(b"truck\xff.toml")).write_bytes((fleet / "vehicles" / "depot-7.toml").read_bytes())
    day = fleet / "logs" / "depot-7" / "day0.parquet"
    shutil.copy(day, folder / os.fsdecode(b"truck\xff.parquet"))
    pl.read_parquet(day).head(6000).write_csv(tmp_path / "day.csv")
    shutil.move(tmp_path / "day.csv", folder / os.fsdecode(b"truck\xff_2.csv"))
    (folder / os.fsdecode(b"truck\xff_3.csv")).write_text("nothing\n")
    (folder / r"truck\xff_3.csv").write_text("nothing else\n")  # looks like it
    arguments = ["fleet", "run", str(folder), "--vehicles", str(vehicles), "--output", str(output), "--json"]
    assert command(arguments) == 0
    given = json.loads(capsys.readouterr().out)
    assert (given["logs_answered"], given["logs_refused"], given["trucks"]) == (2, 2, 1)
    found = rows(output)
    assert set(found) == {r"truck\xff.parquet", r"truck\xff_2.csv", r"truck\xff_3.csv", r"truck\x5cxff_3.csv"}
    assert {row["truck"] for row in found.values()} == {r"truck\xff", ""}
    usual = pl.read_parquet(undisturbed / "drives.parquet").filter(log=str(day))
    assert [found[r"truck\xff.parquet"]["offset_deg"]] == usual["offset_deg"].to_list()
    assert r"\xfe/truck\xff_3.csv" in found[r"truck\xff_3.csv"]["log"]
    page = (output / "index.html").read_text(encoding="utf-8")
    assert r'<option value="truck\xff"' in page
    with contextlib.closing(sqlite3.connect(output / LEDGER)) as ledger:
        seen = [uri for (uri,) in ledger.execute("SELECT uri FROM seen")]
    assert sorted(seen) == sorted(row["log"] for row in found.values())
    assert command(arguments) == 0
    given = json.loads(capsys.readouterr().out)
    assert (given["logs_answered"], given["logs_refused"]) == (0, 0)


@pytest.mark.parametrize("suffix", WRITTEN)
def test_every_format_is_read_whatever_bytes_its_name_holds(fleet: Path, tmp_path: Path, suffix: str) -> None:
    scenario = tmp_path / "scenario.toml"
    scenario.write_text('about = "Half a minute."\nbase = "thesis_drive"\n[drive]\nduration_s = 30.0\n')
    simulate_to_log(scenario, 1, tmp_path / f"log{suffix}")
    log = tmp_path / "depot-7" / os.fsdecode(b"\xff\x1b" + suffix.encode())
    log.parent.mkdir()
    shutil.move(tmp_path / f"log{suffix}", log)
    assert run([str(log)], fleet / "vehicles", tmp_path / "out").logs_answered == 1
    assert set(rows(tmp_path / "out")) == {rf"\xff\x1b{suffix}"}


# -- credentials


@pytest.mark.parametrize(
    "place",
    [
        "s3://AKIA:hunter2@bucket/a",
        "s3://AKIA:hunt/er2@bucket/a",
        "S3://AKIA:hunter2@bucket",
        "ftp://me:hunter2@host/a",
    ],
)
def test_credentials_in_a_uri_are_refused_and_not_repeated(
    place: str, fleet: Path, logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "out"
    arguments = [str(logs), place, "--vehicles", str(fleet / "vehicles"), "--output", str(output), "--json"]
    assert command(["fleet", "run", *arguments]) == 2
    out, err = capsys.readouterr()
    assert err.count("\n") == 1 and "log 2" in err and json.loads(out)["code"] == "credentials"
    assert not any(secret in out + err for secret in ("AKIA", "hunt", "er2", "me:"))
    assert not output.exists()


# -- when a drive began

BAD_STARTS = ("nan", "inf", "-inf", "1e300", "1e14", "-1e14")


@pytest.mark.parametrize("start", BAD_STARTS)
def test_a_start_that_no_calendar_has_is_none(
    start: str, fleet: Path, logs: Path, night: Night, tmp_path: Path
) -> None:
    table = pl.read_parquet(logs / "good.parquet")
    table = table.with_columns(pl.col("time_s") - table["time_s"][0])
    table.write_parquet(logs / "good.parquet", metadata={"start_time": start})
    os.utime(logs / "good.parquet", (MONDAY_S, MONDAY_S))
    assert night().logs_answered == 1
    row = rows(tmp_path / "out")["good.parquet"]
    assert row["start_source"] == "modified"
    assert row["start"].timestamp() == pytest.approx(MONDAY_S - 240.0, abs=0.1)


def test_a_drive_that_lasts_longer_than_the_calendar_has_no_start_and_no_place_in_a_history(
    logs: Path, night: Night, tmp_path: Path
) -> None:
    """Its time jumps by 9e10 s."""
    table = pl.read_parquet(logs / "good.parquet")
    ticks = pl.int_range(pl.len())
    jump = pl.when(ticks > table.height // 2).then(9e10).otherwise(0.0)
    table.with_columns(pl.col("time_s") - table["time_s"][0] + jump).write_parquet(logs / "good.parquet")
    assert night().logs_answered == 1
    row = rows(tmp_path / "out")["good.parquet"]
    assert (row["start"], row["start_source"], row["error"]) == (None, None, None)
    assert pl.read_parquet(tmp_path / "out" / "trucks.parquet")["told"].to_list() == [0]


# -- names that oncenter makes


def test_files_named_after_a_truck_bear_any_vin_and_any_vehicle_file(fleet: Path, logs: Path, tmp_path: Path) -> None:
    vehicles, output = shutil.copytree(fleet / "vehicles", tmp_path / "vehicles"), tmp_path / "out"
    umlauts = "\N{LATIN SMALL LETTER U WITH DIAERESIS}" * 100
    shutil.copy(vehicles / "depot-7.toml", vehicles / f"{umlauts}.toml")
    vin = VIN + "A" * 180  # J1939 has up to 200 characters
    trucks = [vin, vin + "B", umlauts]
    for truck, day in zip(trucks, ("day1", "day2", "day3"), strict=True):
        table = pl.read_parquet(fleet / "logs" / "depot-7" / f"{day}.parquet")
        metadata = {"vin": truck} if truck != umlauts else {}
        table.write_parquet(tmp_path / "logs" / f"{umlauts if truck == umlauts else day}.parquet", metadata=metadata)
    summary = run([str(tmp_path / "logs")], vehicles, output, reports=True)
    assert (summary.logs_answered, summary.trucks) == (4, 4)
    page = (output / "index.html").read_text(encoding="utf-8")
    assert set(histories(output / "index.html")) == {"depot-7", *trucks}
    assert all(f'<option value="{truck}">' in page for truck in trucks)


# -- all at once


def test_a_night_among_all_of_these_ends_and_the_next_has_nothing_to_do(
    fleet: Path, logs: Path, tmp_path: Path
) -> None:
    put_what_is_no_log(logs)
    deep = too_deep(logs)
    (logs / "circle").symlink_to(logs.parent)
    shutil.copy(fleet / "logs" / "depot-7" / "day1.parquet", logs / os.fsdecode(b"bad\xff.parquet"))
    table = pl.read_parquet(fleet / "logs" / "depot-7" / "day2.parquet")
    table.with_columns(pl.col("time_s") - MONDAY_S).write_parquet(logs / "nan.parquet", metadata={"start_time": "nan"})
    arguments = [logs.parent, "--vehicles", fleet / "vehicles", "--output", tmp_path / "out", "--json"]
    try:
        first, second = (watch(oncenter("fleet", "run", *arguments)) for _ in range(2))
    finally:
        shutil.rmtree(deep)
    for ended, answered, refused in ((first, 3, 6), (second, 0, 0)):
        assert (ended.harm, ended.code) == ("", 0), ended.err
        given = json.loads(ended.out)
        assert (given["logs_answered"], given["logs_refused"]) == (answered, refused)
        assert given["refused"] == {"not_a_file": 6}


def test_settings_of_a_fleet_do_not_depend_on_bytes_being_text(tmp_path: Path) -> None:
    (tmp_path / os.fsdecode(b"\xff.toml")).write_bytes(b"\xff")
    assert Trucks(tmp_path).settings(None) != Trucks(tmp_path).settings(r"\xff")
