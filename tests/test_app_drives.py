"""The former drives of a truck: their list, their common offset, and the evidence that leaves with a forgotten one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import oncenter as oc
from oncenter.app.drives import Drives
from oncenter.memory import offset_with_memory, read_memory, write_memory
from oncenter.offset.common_offset import Reading, common_offset
from oncenter.signals import DEGREE, Signals

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


def test_several_drives_are_more_certain_than_one() -> None:
    readings = [Reading(offset * DEGREE, 0.4 * DEGREE, 0.1, 0.05) for offset in (1.6, 2.2, 2.4, 1.8)]
    common = common_offset(readings, TRUCK)
    assert common is not None and common.own_sd < 0.3 * DEGREE < common.whole_sd
    assert common.value == pytest.approx(2.0 * DEGREE, abs=0.01 * DEGREE)


def test_after_a_correction_the_common_offset_is_that_since_it() -> None:
    readings = [Reading(offset * DEGREE, 0.1 * DEGREE, 0.1, 0.05) for offset in (3.0, 3.1, 0.1)]
    assert common_offset(readings[:1], TRUCK) is None
    common = common_offset(readings, TRUCK)
    assert common is not None and common.since == 2
    assert common.value == pytest.approx(0.1 * DEGREE, abs=0.02 * DEGREE)


@pytest.mark.parametrize(
    ("offsets_deg", "since"),
    [
        ((1.6, 1.7, 5.0, 1.7, 1.6), 0),
        ((1.6, 1.7, 1.8, 1.7, 1.6, 5.0, 1.7), 0),
        ((2.1, 2.0, 2.2, 2.1, 0.1, 0.0, 0.1), 4),
    ],
    ids=["one wrong drive", "the last but one wrong", "a correction"],
)
def test_one_wrong_drive_among_many_is_no_new_offset(offsets_deg: tuple[float, ...], since: int) -> None:
    common = common_offset([Reading(each * DEGREE, 0.1 * DEGREE, 0.1, 0.05) for each in offsets_deg], TRUCK)
    assert common is not None and common.since == since


def test_the_memory_after_the_newest_drive_is_forgotten_is_that_before_it(drives: Drives, logs: list[Signals]) -> None:
    before = Drives(drives.memory.parents[1] / "before", TRUCK)
    for log in logs[:2]:
        answered(before, log)
    drives.forget(kept(drives)["hard_turn"])
    assert drives.memory.read_text() == before.memory.read_text()
    answered(drives, logs[2])
    assert len(kept(drives)) == 3


def test_no_estimate_keeps_the_evidence_of_a_forgotten_drive(drives: Drives) -> None:
    drives.forget(kept(drives)["step_steer"])
    drives.forget(kept(drives)["hard_turn"])  # whose memory before it had the evidence of the first one, too
    memory = read_memory(drives.memory, TRUCK.name)
    assert len(memory.drives) == 1
    assert replace(memory, drives=()) == read_memory(drives.memory.with_name("none.toml"), TRUCK.name)
    assert [*kept(drives)] == ["mid_speed_manoeuvre"]
    drives.forget("000999")
    assert [*kept(drives)] == ["mid_speed_manoeuvre"]
