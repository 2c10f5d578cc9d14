"""The former drives of a truck: their list, their common offset, and the evidence that leaves with a forgotten one."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from test_fleet_summaries import of_drive
from truck_rows import drive_row

import oncenter as oc
from oncenter.app.drives import Drives
from oncenter.errors import OncenterError
from oncenter.fleet.ranking import OfTruck, histories
from oncenter.memory import TruckMemory, offset_with_memory, read_memory, write_memory
from oncenter.memory.truck import PastDrive, settings_of
from oncenter.signals import Signals
from oncenter.truck.row import Row
from oncenter.vehicle import Vehicle

TRUCK = oc.vehicle("scania_r730_4x2")
DAY_S, MONDAY_S = 86400.0, 1_772_000_000.0


@pytest.fixture(scope="module")
def logs() -> list[Signals]:
    """On three days."""
    names = ("step_steer", "mid_speed_manoeuvre", "hard_turn")
    return [
        replace(oc.simulate(name)[0], log=f"{name}.log", start_s=MONDAY_S + k * DAY_S) for k, name in enumerate(names)
    ]


def answered(drives: Drives, log: Signals) -> None:
    before = drives.begin()
    answer, after = offset_with_memory([log], TRUCK, read_memory(drives.memory, TRUCK.name))
    write_memory(drives.memory, after)
    drives.keep(before, answer.to_dict())


def kept(drives: Drives) -> dict[str, str]:
    """The number of each drive by its log, newest first."""
    return {drive["log"].removesuffix(".log"): drive["drive"] for drive in drives.listed()["drives"]}


@pytest.fixture
def drives(logs: list[Signals], tmp_path: Path) -> Drives:
    drives = Drives(tmp_path / "truck", TRUCK)
    for log in logs:
        answered(drives, log)
    return drives


def test_each_drive_is_listed_once_by_the_time_of_its_log(drives: Drives, logs: list[Signals], tmp_path: Path) -> None:
    assert [*kept(drives)] == ["hard_turn", "mid_speed_manoeuvre", "step_steer"]
    answered(drives, logs[0])
    assert len(kept(drives)) == 3
    backward = Drives(tmp_path / "backward", TRUCK)
    for log in reversed(logs):
        answered(backward, log)
    assert [*kept(backward)] == [*kept(drives)]


def test_the_common_offset_is_that_of_all_drives(drives: Drives) -> None:
    common = drives.listed()["common"]
    low, high = common["interval"]
    assert low < 2.0 < high and common["count"] == 3 and common["state"] == "undecided"


@pytest.mark.parametrize("place", [0, 2])
def test_the_memory_after_a_drive_is_forgotten_is_that_without_it(
    drives: Drives, logs: list[Signals], place: int
) -> None:
    without = Drives(drives.memory.parents[1] / "without", TRUCK)
    for log in (log for k, log in enumerate(logs) if k != place):
        answered(without, log)
    drives.forget(kept(drives)[logs[place].log.removesuffix(".log")])
    texts = (each.memory.read_text() for each in (drives, without))
    one, other = ([line for line in text.splitlines() if not line.startswith("core = ")] for text in texts)
    assert one == other
    answered(drives, logs[place])
    assert len(kept(drives)) == 3


def test_logs_of_one_drive_are_forgotten_together(drives: Drives, logs: list[Signals]) -> None:
    end_s = MONDAY_S + 2 * DAY_S + logs[2].duration_s
    soon_after, _ = oc.simulate("mid_speed_manoeuvre", seed=9)
    answered(drives, replace(soon_after, log="soon after.log", start_s=end_s + 600.0))
    drives.forget(kept(drives)["soon after"])
    assert [*kept(drives)] == ["mid_speed_manoeuvre", "step_steer"]
    assert len(read_memory(drives.memory, TRUCK.name).drives) == 2


def test_no_estimate_keeps_the_evidence_of_a_forgotten_drive(drives: Drives) -> None:
    drives.forget(kept(drives)["step_steer"])
    drives.forget(kept(drives)["hard_turn"])
    memory = read_memory(drives.memory, TRUCK.name)
    assert len(memory.drives) == 1
    assert replace(memory, drives=()) == read_memory(drives.memory.with_name("none.toml"), TRUCK.name)
    assert [*kept(drives)] == ["mid_speed_manoeuvre"]
    drives.forget("000999")
    assert [*kept(drives)] == ["mid_speed_manoeuvre"]


def test_a_drive_that_the_memory_drops_leaves_the_list(
    logs: list[Signals], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("oncenter.memory.truck.DRIVES_MAX", 2)
    drives = Drives(tmp_path / "truck", TRUCK)
    for log in (logs[1], logs[0], logs[2]):
        answered(drives, log)
    assert [*kept(drives)] == ["hard_turn", "mid_speed_manoeuvre"]


def test_a_memory_without_answers_has_no_common_offset(drives: Drives) -> None:
    for file in drives.memory.parent.glob("*.json"):
        file.unlink()
    assert drives.listed() == {"drives": [], "common": None, "events": []}


@pytest.mark.parametrize(
    ("offset_deg", "more"),
    [(6.0, {"used_s": 10.0}), (1.28, {"bank": 0.9, "bank_variance": 0.01}), (6.0, {})],
    ids=["too little driving", "decided by a prior", "clear"],
)
def test_the_common_offset_has_the_verdict_of_a_fleet(tmp_path: Path, offset_deg: float, more: dict[str, Any]) -> None:
    rows = [drive_row(day, offset_deg, sds=(0.05, 0.3, 0.02), **more) for day in range(3)]
    (history,) = histories([OfTruck("truck", [of_drive(row) for row in rows], 2.0)])
    assert with_rows(tmp_path, rows).listed()["common"]["state"] == history.truck["state"]


def with_rows(folder: Path, rows: Sequence[Row], truck: Vehicle = TRUCK) -> Drives:
    """After drives with these rows."""
    settings, drives = settings_of(truck, None), Drives(folder, truck)
    past = tuple(PastDrive((f"{day:06}",), row, settings) for day, row in enumerate(rows))
    write_memory(drives.memory, TruckMemory(truck.name, drives=past))
    offset = {"value": 0.0, "ci95_drive": None}
    said = {"start_time": None, "log": "a", "offset": offset, "verdicts": [{"state": "within"}], "limit_deg": 2.0}
    (folder / "000001.json").write_text(json.dumps({"said": said, "keys": []}), encoding="utf-8")
    return drives


DIFFERS = [drive_row(day, offset_deg, sds=(0.05, 0.3, 0.02)) for day, offset_deg in enumerate((3.0, 3.0, 3.0, 0.2))]


def test_a_last_drive_that_differs_is_asked_about_until_it_is_stated(tmp_path: Path) -> None:
    assert not with_rows(tmp_path, DIFFERS[:3]).listed()["common"]["asks"]
    drives = with_rows(tmp_path, DIFFERS)
    before = drives.listed()
    assert before["common"]["asks"] and before["common"]["state"] == "undecided"
    drives.state("calibrated")
    after = drives.listed()
    assert not after["common"]["asks"] and after["common"]["state"] == "within" and after["common"]["count"] == 1
    assert [event["kind"] for event in after["events"]] == ["calibrated"]
    drives.take_back(0)
    assert drives.listed() == before


def test_only_a_known_kind_of_a_truck_with_drives_can_be_stated(tmp_path: Path) -> None:
    for drives, kind in ((with_rows(tmp_path, DIFFERS), "painted"), (Drives(tmp_path / "none", TRUCK), "repaired")):
        with pytest.raises(OncenterError, match=f"'{kind}' cannot be stated"):
            drives.state(kind)
