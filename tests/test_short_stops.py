"""Logs with short stops between are one drive, whether they are given together or night after night."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from test_several_logs import TRUTH_DEG, vehicle

import oncenter as oc
from oncenter.errors import OncenterError
from oncenter.memory import TruckMemory, offset_with_memory, read_memory, write_memory
from oncenter.memory.truck import PastDrive
from oncenter.offset.inputs import stop_in_drive
from oncenter.signals import DEGREE, Signals
from oncenter.truck.events import Event
from oncenter.vehicle import core_of

BEGIN_S, LOG_S = 1_772_434_800.0, 300.0


@cache
def pieces() -> tuple[Signals, ...]:
    """A drive of 15 min as three logs, each with a clock of its own."""
    signals, _ = oc.simulate("thesis_drive", seed=3)
    count = round(LOG_S * signals.rate_hz)
    tables = [signals.table[k * count : (k + 1) * count] for k in range(3)]
    return tuple(
        replace(signals, table=table.with_columns(pl.col("time_s") - k * LOG_S), log=f"log{k}.parquet")
        for k, table in enumerate(tables)
    )


def logs(*stops_s: float) -> list[Signals]:
    """The pieces with these stops between."""
    starts = BEGIN_S + np.cumsum([0.0, *(LOG_S + stop_s for stop_s in stops_s)])
    return [replace(log, start_s=float(start)) for log, start in zip(pieces(), starts, strict=False)]


def one_by_one(given: list[Signals], path: Path) -> tuple[oc.Answer, TruckMemory]:
    """Each from the file that the one before has left."""
    for log in given:
        answer, memory = offset_with_memory([log], vehicle(), read_memory(path, "truck"))
        write_memory(path, memory)
    return answer, read_memory(path, "truck")


def test_short_stops_are_ignitions_of_one_core() -> None:
    given = logs(600.0, 60.0)
    core = core_of(vehicle(), given[0].rate_hz)
    for stop_s, log in zip((None, 600.0, 60.0), given, strict=True):
        if stop_s is not None:
            core.restart(stop_s)
        core.run({name: log.columns[name] for name in oc._core.COLUMNS if name in log.columns})
    answer = oc.offset(given, vehicle())
    assert answer.offset.value == pytest.approx(core.answer()["offset"]["value"], abs=1e-6)
    (row,) = answer.rows
    assert row.logs == ("log0.parquet", "log1.parquet", "log2.parquet")
    assert row.start_s == BEGIN_S and row.length_s == pytest.approx(3 * LOG_S + 660.0, abs=0.1)


def test_short_stops_cost_less_than_days_between() -> None:
    shift, days = oc.offset(logs(600.0, 600.0), vehicle()), oc.offset(logs(86400.0, 86400.0), vehicle())
    assert len(shift.rows) == 1 and len(days.rows) == 3
    assert (shift.offset_half_width_rad or 0.0) < 0.8 * (days.offset_half_width_rad or 0.0)


def test_logs_one_by_one_are_the_same_drive_as_together(tmp_path: Path) -> None:
    given = logs(1750.0, 120.0)
    together = oc.offset(given, vehicle())
    answer, memory = one_by_one(given, tmp_path / "memory.toml")
    assert (str(answer.offset), answer.offset.status) == (str(together.offset), together.offset.status)
    assert answer.offset_ci95_drive == pytest.approx(together.offset_ci95_drive, abs=1e-6)
    (drive,) = memory.drives
    assert len(drive.key) == 3 and drive.row.logs == together.rows[0].logs


def test_only_the_newest_drive_keeps_its_core(tmp_path: Path) -> None:
    _, memory = one_by_one(logs(7200.0, 7200.0), tmp_path / "memory.toml")
    assert [bool(drive.row.image) for drive in memory.drives] == [False, False, True]
    assert (tmp_path / "memory.toml").stat().st_size < 40_000


@pytest.mark.parametrize("event", [None, Event(BEGIN_S + LOG_S + 300.0, "calibrated")], ids=["long stop", "calibrated"])
def test_a_long_stop_or_work_on_the_truck_ends_a_drive(event: Event | None, tmp_path: Path) -> None:
    given, events = logs(2000.0 if event is None else 600.0), [] if event is None else [event]
    assert len(oc.offset(given, vehicle(), events=events).rows) == 2
    memory = TruckMemory("truck")
    for log in given:
        _, memory = offset_with_memory([log], vehicle(), memory, events=events)
    assert len(memory.drives) == 2


def test_a_log_of_the_drive_that_is_given_again_changes_nothing(tmp_path: Path) -> None:
    given = logs(600.0, 600.0)
    _, memory = one_by_one(given, tmp_path / "memory.toml")
    together = oc.offset(given, vehicle())
    longer = replace(given[1], table=pl.concat([given[1].table, given[2].table.with_columns(pl.col("time_s") + LOG_S)]))
    for again in ([given[0]], [given[1]], given, [longer]):
        answer, after = offset_with_memory(again, vehicle(), memory)
        assert after == memory and any("in the truck's memory already" in note for note in answer.notes)
        assert answer.offset.value == pytest.approx(together.offset.value, abs=0.05 * DEGREE)
        assert answer.offset_half_width_rad == pytest.approx(together.offset_half_width_rad, rel=0.5)


def test_of_known_and_new_logs_only_the_new_ones_are_added(tmp_path: Path) -> None:
    given = logs(600.0, 600.0)
    _, memory = one_by_one(given[:2], tmp_path / "memory.toml")
    answer, after = offset_with_memory(given[1:], vehicle(), memory)
    assert str(answer.offset) == str(oc.offset(given, vehicle()).offset)
    assert [len(drive.key) for drive in after.drives] == [3]


def test_a_longer_recording_of_a_known_drive_takes_its_place(tmp_path: Path) -> None:
    (whole,) = logs()
    part = replace(whole, table=whole.table.head(20_000))
    _, memory = one_by_one([part], tmp_path / "memory.toml")
    answer, after = offset_with_memory([whole], vehicle(), memory)
    assert [drive.row.length_s for drive in after.drives] == [pytest.approx(LOG_S, abs=0.1)]
    assert str(answer.offset) == str(oc.offset(whole, vehicle()).offset)


def test_two_logs_of_one_name_keep_their_own_fingerprints() -> None:
    given = [replace(log, log="log.parquet") for log in logs(7200.0)]
    _, memory = offset_with_memory(given, vehicle(), TruckMemory("truck"))
    assert len({drive.key for drive in memory.drives}) == 2


def test_another_drive_with_the_same_start_is_not_the_same_drive() -> None:
    """As where a log has only the day."""
    memory = TruckMemory("truck")
    for log in pieces()[:2]:
        _, memory = offset_with_memory([replace(log, start_s=BEGIN_S)], vehicle(), memory)
    assert [drive.row.logs for drive in memory.drives] == [("log0.parquet",), ("log1.parquet",)]


def test_logs_without_dates_are_drives_of_their_own(tmp_path: Path) -> None:
    """The time of the last write, which a memory takes in place of a date, does not show a stop."""
    given = []
    for k, log in enumerate(pieces()):
        path = tmp_path / f"log{k}"
        path.touch()
        os.utime(path, (BEGIN_S + k * (LOG_S + 600.0),) * 2)
        given.append(replace(log, log=str(path)))
    _, memory = offset_with_memory(given, vehicle(), TruckMemory("truck"))
    assert len(memory.drives) == 3 and not any(drive.row.image for drive in memory.drives)


def test_a_drive_ends_with_the_shift() -> None:
    begin, end_s = BEGIN_S, BEGIN_S + 14.9 * 3600.0
    assert stop_in_drive((begin, end_s), (end_s + 60.0, end_s + 300.0)) == 60.0
    assert math.isnan(stop_in_drive((begin, end_s), (end_s + 60.0, end_s + 400.0)))


def test_a_memory_of_many_logs_can_be_read(tmp_path: Path) -> None:
    row = replace(
        oc.offset(pieces()[0], vehicle()).rows[0], image=b"", logs=tuple(f"a name of a log {k}" for k in range(90))
    )
    drives = tuple(
        PastDrive(tuple(f"{90 * day + k:0192x}" for k in range(90)), replace(row, start_s=BEGIN_S + 86400.0 * day), "")
        for day in range(60)
    )
    kept = TruckMemory("truck", drives=drives).of_newest()
    write_memory(tmp_path / "memory.toml", kept)
    assert kept.drives == drives[-22:] and len(read_memory(tmp_path / "memory.toml", "truck").drives) == 22


def test_an_event_between_two_files_of_one_clock_ends_the_drive() -> None:
    first, second = ({"time_s": pl.col("time_s") + BEGIN_S + k * (LOG_S + 30.0)} for k in range(2))
    given = [
        replace(log, table=log.table.with_columns(**time)) for log, time in zip(pieces(), (first, second), strict=False)
    ]
    assert len(oc.offset(given, vehicle()).rows) == 1
    assert len(oc.offset(given, vehicle(), events=[Event(BEGIN_S + LOG_S + 10.0, "calibrated")]).rows) == 2


@cache
def with_another_zero_at_each_start() -> tuple[Signals, ...]:
    found = []
    for k, zero_deg in enumerate((0.0, 5.0, -6.0, 3.0, -4.0, 6.0)):
        signals, _ = oc.simulate("thesis_drive", seed=k + 1)
        angle = pl.col("steering_wheel_angle_rad") + zero_deg * DEGREE
        table = signals.table.head(60_000).with_columns(angle)
        found.append(replace(signals, table=table, log=f"start{k}.parquet", start_s=BEGIN_S + 1200.0 * k))
    return tuple(found)


def test_a_truck_that_was_calibrated_in_a_short_stop_has_its_new_offset(tmp_path: Path) -> None:
    """Two logs before it and two after: the former ones are one drive, the others decide as two."""
    given = [
        replace(log, table=log.table.with_columns(pl.col("steering_wheel_angle_rad") + zero_deg * DEGREE))
        for log, zero_deg in zip(same_zero(), (0.0, 0.0, 4.0, 4.0), strict=True)
    ]
    for answer in (oc.offset(given, vehicle()), one_by_one(given, tmp_path / "memory.toml")[0]):
        assert answer.offset.status == "valid" and answer.offset.value is not None
        assert answer.offset.value / DEGREE == pytest.approx(TRUTH_DEG + 4.0, abs=0.4)


@cache
def same_zero() -> tuple[Signals, ...]:
    """Four logs of ten minutes with stops of 20."""
    found = [oc.simulate("thesis_drive", seed=seed)[0] for seed in (3, 4, 5, 6)]
    return tuple(
        replace(log, table=log.table.head(60_000), log=f"log{k}", start_s=BEGIN_S + 1800.0 * k)
        for k, log in enumerate(found)
    )


@pytest.mark.slow
def test_a_sensor_with_another_zero_at_each_start_is_named_after_short_stops(tmp_path: Path) -> None:
    given = list(with_another_zero_at_each_start())
    assert oc.offset(given, vehicle()).zero == "relative"
    assert one_by_one(given, tmp_path / "memory.toml")[0].zero == "relative"


def test_a_signal_fault_spoils_only_its_log() -> None:
    given = logs(600.0, 600.0)
    yaw_rate = pl.lit(0.0).alias("yaw_rate_rad_s")
    given[1] = replace(given[1], table=given[1].table.with_columns(yaw_rate))
    answer = oc.offset(given, vehicle())
    assert [row.logs for row in answer.rows] == [("log0.parquet",), ("log2.parquet",)]
    sound = logs(600.0, 600.0)
    stuck = replace(sound[2], table=sound[2].table.with_columns(yaw_rate))
    both = oc.offset([*sound[:2], stuck], vehicle())
    assert [row.logs for row in both.rows] == [("log0.parquet", "log1.parquet")]
    assert any("without this log" in finding.text for finding in answer.findings)


def test_a_change_in_a_former_log_is_not_found_again(tmp_path: Path) -> None:
    signals, _ = oc.simulate("thesis_drive", seed=3)
    moved = pl.col("steering_wheel_angle_rad") + pl.when(pl.col("time_s") > 900.0).then(4.0 * DEGREE).otherwise(0.0)
    count = signals.ticks * 2 // 3
    first, second = (
        replace(signals, table=table.with_columns(pl.col("time_s") - table["time_s"][0]), log=name, start_s=start_s)
        for table, name, start_s in (
            (signals.table.with_columns(moved)[:count], "first", BEGIN_S),
            (signals.table.with_columns(moved)[count:], "second", BEGIN_S + 3000.0),
        )
    )
    answer, memory = one_by_one([first, second], tmp_path / "memory.toml")
    assert [change.log for change in oc.offset([first, second], vehicle()).changes] == ["first"]
    assert answer.changes == ()
    assert memory.drives[0].row.moved / DEGREE == pytest.approx(4.0, abs=0.5)


def test_a_core_of_another_rate_is_not_continued(tmp_path: Path) -> None:
    first, second = logs(600.0)
    _, memory = one_by_one([first], tmp_path / "memory.toml")
    slower = replace(second, table=second.table.gather_every(2), rate_hz=0.5 * second.rate_hz)
    answer, after = offset_with_memory([slower], vehicle(), memory)
    assert answer.offset.value is not None and len(after.drives) == 2


def test_a_damaged_core_in_the_memory_file_is_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "memory.toml"
    one_by_one(logs(), path)
    text = path.read_text()
    path.write_text(text.replace('core = "', 'core = "*'))
    with pytest.raises(OncenterError, match=r"memory\.toml.*'core' is damaged"):
        read_memory(path, "truck")
