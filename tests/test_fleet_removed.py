"""Logs that are gone, copied to another truck or left out by a person, and events that a person states."""

from __future__ import annotations

import contextlib
import os
import shutil
from pathlib import Path

import polars as pl
import pytest
from test_fleet_ledger import Fleet, as_version_2

from oncenter.cli import run as command
from oncenter.fleet import page
from oncenter.fleet.end_of_run import in_words
from oncenter.fleet.ledger import LEDGER, Ledger
from oncenter.signals import DEGREE
from oncenter.truck.events import Event

pytestmark = pytest.mark.usefixtures("answered_here")

OF_A = [("a", f"a/day{day}.parquet") for day in range(3)]
MONDAY_S = 1_772_409_600.0  # 2026-03-02, 0:00 UTC


@pytest.fixture
def trucks(fleet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Fleet:
    monkeypatch.setattr(page, "_page", lambda contents: "")  # drawing takes long
    return Fleet(tmp_path, fleet / "logs" / "depot-7")


def copied(trucks: Fleet) -> tuple[Path, Path]:
    """A log of a, and its copy in b's folder."""
    one, other = trucks.logs / "a" / "day1.parquet", trucks.logs / "b" / "wrong.parquet"
    shutil.copy(one, other)
    return one, other


# -- copies and removed files


def test_a_copy_in_another_truck_s_folder_names_both_paths_and_both_trucks(trucks: Fleet) -> None:
    one, other = copied(trucks)
    summary = trucks.night()
    logs = [{"log": str(one), "truck": "a"}, {"log": str(other), "truck": "b"}]
    (twice,) = summary.in_two_trucks
    assert twice["trucks"] == ["a", "b"] and twice["logs"] == logs
    (said,) = [line for line in in_words(summary).splitlines() if str(other) in line]
    assert f"{one} of truck a and {other} of truck b" in said and "remove the wrong one" in said


@pytest.mark.parametrize("wrong", [0, 1])
def test_whichever_of_two_copies_is_removed_counts_no_longer_for_its_truck(trucks: Fleet, wrong: int) -> None:
    logs = copied(trucks)
    trucks.night()
    logs[wrong].unlink()
    summary = trucks.night()
    left = [*OF_A, ("b", "b/wrong.parquet")]
    del left[(1, 3)[wrong]]
    assert trucks.rows() == left and summary.in_two_trucks == () and trucks.answered == []
    assert summary.gone == ({"log": str(logs[wrong]), "truck": "ab"[wrong]},)
    assert f"no longer counts for truck {'ab'[wrong]}, since its log was removed: {logs[wrong]}" in in_words(summary)
    assert trucks.night().gone == () and trucks.rows() == left


def test_a_removed_log_that_comes_back_counts_again_without_another_answer(trucks: Fleet, tmp_path: Path) -> None:
    trucks.night()
    path = trucks.logs / "a" / "day1.parquet"
    before = (trucks.output / "trucks.parquet").read_bytes()
    path.rename(tmp_path / "elsewhere")
    trucks.night()
    assert len(trucks.rows()) == 2
    (tmp_path / "elsewhere").rename(path)
    trucks.night()
    assert (trucks.output / "trucks.parquet").read_bytes() == before and trucks.answered == []


def test_a_removed_log_with_a_copy_of_the_same_truck_counts(trucks: Fleet) -> None:
    shutil.copy(trucks.logs / "a" / "day1.parquet", trucks.logs / "a" / "copy.parquet")
    trucks.night()
    (trucks.logs / "a" / "day1.parquet").unlink()
    assert trucks.night().gone == () and len(trucks.rows()) == 3


@pytest.mark.parametrize("why", ["another place", "empty", "not mounted", "not listed"])
def test_a_log_whose_folder_was_not_searched_or_not_listed_still_counts(
    trucks: Fleet, why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copy(trucks.logs / "a" / "day0.parquet", trucks.logs / "b" / "day0.parquet")
    places = [str(trucks.logs / truck) for truck in "ab"]
    trucks.night(*places)
    before = trucks.rows()
    if why == "another place":
        (trucks.logs / "a" / "day1.parquet").unlink()
        places = places[1:]
    elif why == "empty":
        for log in (trucks.logs / "a").iterdir():
            log.unlink()
    elif why == "not mounted":
        (trucks.logs / "a").rename(trucks.logs / "elsewhere")
        (trucks.logs / "a").mkdir()
    else:  # root may list every folder
        lstat = os.lstat

        def refused(path: str, **options: int) -> os.stat_result:
            if "day1" in str(path):
                raise PermissionError(13, "Permission denied")
            return lstat(path, **options)

        (trucks.logs / "a" / "day1.parquet").rename(trucks.logs / "elsewhere")
        monkeypatch.setattr(os, "lstat", refused)
    assert trucks.night(*places).gone == () and trucks.rows() == before


# -- what a person removes


def test_a_drive_that_a_person_removes_counts_in_no_night_until_it_is_taken_back(
    trucks: Fleet, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor do its copies."""
    trucks.night()
    before = trucks.trucks()
    path = trucks.logs / "a" / "day1.parquet"
    monkeypatch.chdir(path.parent)
    of_day1 = ["fleet", "remove", path.name, "--output", str(trucks.output)]
    assert command(of_day1) == 0
    assert f"{path} no longer counts for truck a" in capsys.readouterr().out
    pl.read_parquet(path).write_csv(path.with_name("other.csv"))
    shutil.copy(path, path.with_name("copy.parquet"))
    for _ in range(2):
        trucks.night()
        assert trucks.rows() == [OF_A[0], OF_A[2]]
    path.with_name("other.csv").unlink()
    assert command([*of_day1, "--undo"]) == 0
    trucks.night()
    assert trucks.trucks() == before
    for arguments, why in (
        ([*of_day1, "--undo"], "was not removed"),
        ([*of_day1[:2], "none", *of_day1[3:]], "no drive"),
    ):
        capsys.readouterr()
        assert command(arguments) == 2
        err = capsys.readouterr().err
        assert err.count("\n") == 1 and why in err


def test_a_drive_whose_log_was_deleted_to_save_space_can_be_taken_back(trucks: Fleet) -> None:
    trucks.night()
    path = trucks.logs / "a" / "day1.parquet"
    path.unlink()
    trucks.night()
    assert command(["fleet", "remove", str(path), "--output", str(trucks.output), "--undo"]) == 0
    for _ in range(2):
        assert trucks.night().gone == () and trucks.rows() == OF_A


# -- events


def test_a_fleet_keeps_the_events_that_a_person_states(trucks: Fleet, capsys: pytest.CaptureFixture[str]) -> None:
    trucks.night()
    output = ["--output", str(trucks.output)]
    for kind, more in (("repaired", []), ("calibrated", ["--by", "-3.4"])):
        assert command(["fleet", "event", "a", kind, "--date", "2026-03-02", *more, *output]) == 0
    capsys.readouterr()
    assert command(["fleet", "event", "a", "--list", *output]) == 0
    assert capsys.readouterr().out == ("calibrated@2026-03-02T00:00:00Z=-3.4\nrepaired@2026-03-02T00:00:00Z\n")
    assert trucks.night().events == 2
    assert command(["fleet", "event", "a", "repaired", "--date", "2026-03-02", "--remove", *output]) == 0
    with contextlib.closing(Ledger(trucks.output / LEDGER)) as ledger:
        assert ledger.events_of("a") == [Event(MONDAY_S, "calibrated", -3.4 * DEGREE)]
        assert ledger.events_of("b") == []


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        ("event x calibrated --date 2026-03-02", "no truck x in "),
        ("event a mended --date 2026-03-02", "'mended' is no kind of event"),
        ("event a calibrated --date yesterday", "'yesterday' is no date"),
        ("event a calibrated", "--date DATE"),
        ("event a", "calibrated, repaired, changed, another_truck"),
        ("event a repaired --date 2026-03-02 --by 1", "only 'calibrated'"),
        ("event a repaired --date 2026-03-02 --remove", "no event repaired@2026-03-02T00:00:00Z of truck a"),
        ("event a repaired --date 2026-03-02 --output OTHER", "no ledger of a fleet"),
        ("remove a/day0.parquet --output OTHER", "no ledger of a fleet"),
    ],
)
def test_a_wrong_event_is_refused_in_one_line(
    trucks: Fleet, arguments: str, why: str, capsys: pytest.CaptureFixture[str]
) -> None:
    trucks.night()
    output = [] if "OTHER" in arguments else ["--output", str(trucks.output)]
    assert command(["fleet", *arguments.replace("OTHER", str(trucks.logs)).split(), *output]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and why in err
    assert not (trucks.logs / LEDGER).exists()


def test_what_a_person_stated_survives_a_damaged_ledger_and_is_named_if_it_is_damaged_itself(trucks: Fleet) -> None:
    trucks.night()
    output = ["--output", str(trucks.output)]
    assert command(["fleet", "event", "a", "repaired", "--date", "2026-03-02", *output]) == 0
    assert command(["fleet", "remove", str(trucks.logs / "a" / "day1.parquet"), *output]) == 0
    path = trucks.output / LEDGER
    content = bytearray(path.read_bytes())
    content[:16] = b"\xa5" * 16
    path.write_bytes(content)
    assert command(["fleet", "event", "a", "--list", *output]) == 2  # a night sets it apart
    content[:16] = b"SQLite format 3\0"
    path.write_bytes(content)
    with trucks.ledger() as ledger:
        ledger.execute("CREATE TABLE other (x)")
        ledger.execute("DROP INDEX of_size")
    assert len(trucks.night().damaged) == 1
    assert trucks.rows() == [OF_A[0], OF_A[2]]
    with contextlib.closing(Ledger(path)) as kept:
        assert kept.events_of("a") == [Event(MONDAY_S, "repaired", None)]
    with trucks.ledger() as ledger:
        ledger.execute("INSERT INTO events VALUES ('a', x'ff', 'repaired', NULL, 0.0)")
        ledger.execute("INSERT INTO events VALUES ('b', 1.0, 'mended', NULL, 0.0)")
        for truck, time, kind, by_rad in (
            ("c", "1e300", "repaired", "NULL"),
            ("d", "-1.0", "repaired", "NULL"),
            ("e", "1.0", "repaired", "0.1"),
            ("f", "1.0", "calibrated", "-1e300"),
            ("g", "1.0", "calibrated", "9e999"),
        ):
            ledger.execute(f"INSERT INTO events VALUES ('{truck}', {time}, '{kind}', {by_rad}, 0.0)")
    assert trucks.night().damaged == tuple(f"event of truck {truck}" for truck in "abcdefg")
    assert trucks.night().events == 1


def test_a_ledger_of_version_2_is_taken_over_as_it_is(trucks: Fleet) -> None:
    trucks.night()
    before = trucks.trucks()
    as_version_2(trucks)
    assert trucks.night().damaged == () and trucks.trucks() == before and trucks.answered == []
    assert command(["fleet", "event", "a", "repaired", "--date", "2026-03-02", "--output", str(trucks.output)]) == 0
