"""A truck's memory: a row of evidence for each drive, once; the answer is that of all drives together."""

from __future__ import annotations

import json
import math
import os
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from test_known_truck import drive, half_width, holds, offset_to_find, truck

import oncenter as oc
from oncenter.cli import run
from oncenter.estimates.estimate import Estimate
from oncenter.files.toml_file import BYTES_MAX
from oncenter.memory import TruckMemory, offset_with_memory, read_memory, write_memory
from oncenter.memory.file import text_of
from oncenter.memory.log import start_of_drive
from oncenter.memory.truck import DRIVES_MAX, PastDrive, Remembered
from oncenter.signals import DEGREE, Signals
from oncenter.truck.events import Event
from oncenter.truck.now import truck_now
from oncenter.truck.priors import priors_of
from oncenter.truck.row import Row
from oncenter.truck.row_columns import COLUMNS, Column, columns_of, row_in

NOW_S = 1_750_000_000.0
DAY_S = 86400.0
ROW = Row(
    modes=np.array([[-1.5, 1e5, 2e4, 3e4, -1e3, 50.0, 2e3, 3e3, 400.0, -20.0]]),
    status="valid",
    gradient=0.4 * DEGREE,
    gradient_sd=0.03 * DEGREE,
    wheelbase=0.01,
    wheelbase_sd=0.02,
    friction=0.1,
    creep=1.5,
    bank=0.2,
    bank_variance=1e-3,
    standing=math.nan,
    measured=True,
    ratio=19.3,
    side=1.0,
    start_s=NOW_S,
    length_s=900.0,
    used_s=700.0,
    left_s=300.0,
    right_s=40.0,
    moved=1.0 * DEGREE,
    moved_sd=0.1 * DEGREE,
    logs=('a "log".asc',),
)
FULL = TruckMemory(
    'a "truck"',
    vin="YS2R4X20001234567",
    drives=(
        PastDrive(("0123", "4567"), ROW, "settings"),
        PastDrive(("89ab",), replace(ROW, status="invalid", modes=np.zeros((0, 10))), "settings"),
    ),
    events=(Event(NOW_S, "calibrated", -2.0 * DEGREE), Event(NOW_S, "repaired")),
    ratio_times_wheelbase=Remembered(71.4, 0.5),
)


def numbers(row: Row) -> list[float]:
    return [value for field in fields(row) if isinstance(value := getattr(row, field.name), float)]


def test_a_memory_survives_writing_and_reading(tmp_path: Path) -> None:
    write_memory(tmp_path / "m.toml", FULL)
    again = read_memory(tmp_path / "m.toml", FULL.truck)
    for drive_before, drive_after in zip(FULL.drives, again.drives, strict=True):
        assert numbers(drive_after.row) == pytest.approx(numbers(drive_before.row), rel=1e-5, nan_ok=True)
        assert drive_after.row.modes == pytest.approx(drive_before.row.modes, rel=1e-11)
        assert drive_after.key == drive_before.key and drive_after.row.logs == drive_before.row.logs
    assert [each.row.is_usable for each in again.drives] == [True, False]
    assert again.vin == FULL.vin and again.ratio_times_wheelbase == FULL.ratio_times_wheelbase
    assert [str(event) for event in again.events] == [str(event) for event in FULL.events]
    assert text_of(again) == (tmp_path / "m.toml").read_text(encoding="utf-8")


def test_a_truck_without_a_file_has_an_empty_memory(tmp_path: Path) -> None:
    assert read_memory(tmp_path / "none.toml", "truck") == TruckMemory("truck")


def test_a_memory_keeps_the_newest_drives_so_that_it_can_always_be_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    newest = days_of(drive(tmp_path, "thesis_drive", 1, 300.0, "backlash_deg = 8.0")[0], 2000.0)
    found = oc.offset(newest, truck())
    monkeypatch.setattr("oncenter.memory.answer.offset", lambda *_, **__: found)
    row = replace(ROW, modes=np.repeat(found.rows[0].modes[:1], 4, axis=0))
    days = [(365 * k) % 1009 for k in range(1000)]  # not in order of time
    drives = tuple(PastDrive(("0123" * 48,), replace(row, start_s=NOW_S + day * DAY_S), "settings") for day in days)
    _, after = offset_with_memory([newest], truck(), TruckMemory("truck", drives=drives))
    kept = {id(one) for one in sorted(drives, key=lambda one: one.row.start_s)[1 - DRIVES_MAX :]}
    assert after.drives[:-1] == tuple(one for one in drives if id(one) in kept)
    assert after.drives[-1].row is found.rows[0]
    write_memory(tmp_path / "m.toml", after)
    assert len(read_memory(tmp_path / "m.toml", "truck").drives) == DRIVES_MAX
    assert (tmp_path / "m.toml").stat().st_size < BYTES_MAX / 2


def test_events_in_a_memory_file_are_read_in_order_of_time_and_each_once(tmp_path: Path) -> None:
    """A person may write them."""
    stated = [EVENT.format("calibrated", size) for size in (1.0, 2.0, 3.0)]
    (tmp_path / "m.toml").write_text(HEAD + "".join((*stated[:2], stated[2].replace("2026", "2025"))))
    events = read_memory(tmp_path / "m.toml", "truck").events
    assert [str(event) for event in events] == [
        "calibrated@2025-01-01T00:00:00Z=3",
        "calibrated@2026-01-01T00:00:00Z=2",
    ]


HEAD = 'schema = "oncenter/truck-2"\ntruck = "truck"\n'
EVENT = '[[events]]\nkind = "{}"\ndate = 2026-01-01T00:00:00Z\nby_deg = {}\n'
DRIVE = "\n".join(text_of(replace(FULL, drives=FULL.drives[:1], events=())).splitlines()[4:])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('schema = "oncenter/truck-2"\ntruck = "other"\n', "belongs to truck 'other', not to 'truck'"),
        ('schema = "oncenter/truck-1"\ntruck = "truck"\n', "is of a former version of oncenter"),
        ('schema = "oncenter/truck-3"\ntruck = "truck"\n', "instead of 'oncenter/truck-2'"),
        ("wheelbase_m = 3.7\n", "instead of 'oncenter/truck-2'"),
        (f"{HEAD}plays = 1\n", "'plays'"),
        (HEAD + DRIVE.replace("used_s = 700.0", "used_s = nan"), "'used_s'"),
        (HEAD + DRIVE.replace("gradient_sd_deg_m_s2 = 0.03", "gradient_sd_deg_m_s2 = 0"), "'gradient_sd_deg_m_s2'"),
        (HEAD + DRIVE.replace("ratio = 19.3", ""), "'ratio'"),
        (HEAD + DRIVE.replace('evidence = "-1.5 ', 'evidence = "'), "'evidence'"),
        (HEAD + DRIVE.replace('evidence = "-1.5 ', 'evidence = "nan '), "'evidence'"),
        (HEAD + '[[events]]\nkind = "washed"\ndate = 2026-01-01T00:00:00Z\n', "'washed' is no kind of event"),
        (HEAD + EVENT.format("repaired", "1.0"), "an angle of 1 deg was given with 'repaired'"),
        (HEAD + EVENT.format("calibrated", "1e300"), "a calibration adds -720 to 720 deg, got 1e+300"),
        (HEAD + EVENT.format("calibrated", "nan"), "a calibration adds -720 to 720 deg, got nan"),
        (HEAD + EVENT.format("calibrated", "1.0").replace("2026", "1926"), "write a year from 1970"),
        (HEAD + DRIVE.replace("date = 2025", 'date = "soon" # '), "'drives.0.date'"),
        ("schema = ", "is not TOML"),
    ],
)
def test_a_memory_of_another_truck_is_refused_in_one_line(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "m.toml"
    path.write_text(text)
    with pytest.raises(oc.OncenterError) as refused:
        read_memory(path, "truck")
    assert refused.value.exit_code == 2 and refused.value.code == "memory_file"
    assert str(refused.value).startswith(f"memory file {path}")
    assert said in str(refused.value) and "\n" not in str(refused.value)
    assert path.read_text() == text


BEYOND = ("1e300", "-1e300")
MODE = DRIVE.partition('evidence = "')[2].partition('"')[0].split()


@pytest.mark.parametrize("beyond", BEYOND)
@pytest.mark.parametrize("name", [column.name for column in COLUMNS])
def test_a_number_that_no_drive_has_is_refused_with_its_column(tmp_path: Path, name: str, beyond: str) -> None:
    lines = [line for line in DRIVE.splitlines() if not line.startswith(f"{name} = ")]
    refused_with(tmp_path, "\n".join([*lines, f"{name} = {beyond}"]), name)


@pytest.mark.parametrize("beyond", BEYOND)
@pytest.mark.parametrize("place", range(10))
def test_a_mode_that_no_drive_has_is_refused(tmp_path: Path, place: int, beyond: str) -> None:
    numbers = " ".join([*MODE[:place], beyond, *MODE[place + 1 :]])
    refused_with(tmp_path, DRIVE.replace(" ".join(MODE), numbers), "evidence")


@pytest.mark.parametrize("place", [1, 3, 6])
def test_negative_information_is_refused(tmp_path: Path, place: int) -> None:
    numbers = " ".join([*MODE[:place], f"-{MODE[place]}", *MODE[place + 1 :]])
    refused_with(tmp_path, DRIVE.replace(" ".join(MODE), numbers), "evidence")


def refused_with(folder: Path, drive: str, column: str) -> None:
    path = folder / "m.toml"
    path.write_text(HEAD + drive)
    with pytest.raises(oc.OncenterError, match=f"memory file {path}: '{column}' must ") as refused:
        read_memory(path, "truck")
    assert (refused.value.code, refused.value.exit_code) == ("memory_file", 2)


@pytest.mark.parametrize("column", COLUMNS, ids=lambda column: column.name)
def test_each_number_within_its_limits_gives_a_finite_offset(column: Column) -> None:
    for limit in (column.minimum, column.maximum):
        given = row_in({**columns_of(ROW), column.name: limit}, status="valid", start_s=NOW_S, logs=())
        rows = [row for row in (ROW, given, replace(ROW, start_s=NOW_S + DAY_S)) if row.is_usable]
        assert math.isfinite(truck_now(rows, (), priors_of()).offset)


@pytest.mark.parametrize("fault", [{"sensor_fault": "stuck"}, {"offset": Estimate(None, None, "invalid", "rad")}])
def test_a_drive_whose_signals_are_at_fault_adds_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: dict[str, Any]
) -> None:
    signals, _ = drive(tmp_path, "thesis_drive", 1, 300.0, "backlash_deg = 8.0")
    found = replace(oc.offset(signals, truck()), **fault)
    monkeypatch.setattr("oncenter.memory.answer.offset", lambda *_, **__: found)
    answer, after = offset_with_memory([signals], truck(), TruckMemory("truck"))
    assert after == TruckMemory("truck") and any("was not added" in note for note in answer.notes)


def test_drives_of_another_version_or_vehicle_file_do_not_count_and_are_named(tmp_path: Path) -> None:
    signals, _ = drive(tmp_path, "thesis_drive", 1, 300.0, "backlash_deg = 8.0")
    alone = oc.offset(signals, truck())
    other = TruckMemory("truck", drives=(PastDrive(("0123",), ROW, "oncenter 0.1.0"),))
    answer, after = offset_with_memory([signals], truck(), other)
    assert answer.offset == alone.offset
    assert any("1 drive of the truck's memory" in note for note in answer.notes)
    assert after.drives[0].settings == "oncenter 0.1.0" and len(after.drives) == 2


def days_of(signals: Signals, day: float) -> Signals:
    return replace(signals, table=signals.table.with_columns(pl.col("time_s") + NOW_S + day * DAY_S), log=f"day{day}")


def test_logs_one_after_another_give_the_same_as_all_at_once(tmp_path: Path) -> None:
    """And in whatever order they are given."""
    some = [days_of(drive(tmp_path, "thesis_drive", seed, 400.0, "backlash_deg = 8.0")[0], seed) for seed in (1, 2, 3)]
    together = oc.offset(some, truck())
    for order in ((0, 1, 2), (2, 0, 1)):
        memory = TruckMemory("truck")
        for k in order:
            answer, memory = offset_with_memory([some[k]], truck(), memory)
        assert str(answer.offset) == str(together.offset) and answer.offset.status == together.offset.status
        assert answer.offset_ci95_drive == pytest.approx(together.offset_ci95_drive, abs=1e-6)


def test_a_drive_that_says_nothing_leaves_the_truck_s_answer_as_it_was(tmp_path: Path) -> None:
    signals, other = (drive(tmp_path, "thesis_drive", seed, 400.0, "backlash_deg = 8.0")[0] for seed in (1, 2))
    first, second = days_of(signals, 1), days_of(replace(other, table=other.table.head(1500)), 2)
    before, memory = offset_with_memory([first], truck(), TruckMemory("truck"))
    after, _ = offset_with_memory([second], truck(), memory)
    assert before.offset.value is not None and oc.offset(second, truck()).offset.status == "unobservable"
    assert after.offset.value == pytest.approx(before.offset.value, abs=0.05 * DEGREE)
    assert before.offset_half_width_rad is not None and after.offset_half_width_rad is not None
    assert 1.0 <= after.offset_half_width_rad / before.offset_half_width_rad < 2.0
    assert after.understeer_gradient.status == "unobservable" and after.understeer_gradient.value is None


def test_drives_of_one_truck_narrow_the_offset_and_contain_the_truth(tmp_path: Path) -> None:
    """Short motorway drives that mostly see one flank of 8 deg of play; each its own offset."""
    alone, together, held = [], [], 0
    for first in (11, 21, 31):
        memory = TruckMemory("truck")
        for seed in range(first, first + 5):
            signals, truth = drive(tmp_path, "motorway", seed, 600.0, "backlash_deg = 8.0")
            later = signals.table.with_columns(pl.col("time_s") + NOW_S + seed * DAY_S)
            answer, memory = offset_with_memory([replace(signals, table=later)], truck(), memory)
            if seed >= first + 2:
                alone.append(half_width(oc.offset(signals, truck())))
                together.append(half_width(answer))
                held += holds(answer, offset_to_find(truth))
    assert np.median(together) < 0.6 * np.median(alone)
    assert held >= 8  # of nine


def test_a_jump_of_the_offset_shows_in_the_next_drive(tmp_path: Path) -> None:
    memory = TruckMemory("truck")
    offsets = []
    for seed, jump_deg in ((1, 0.0), (2, 0.0), (3, 4.0)):
        signals, _ = drive(tmp_path, "thesis_drive", seed, 600.0, "backlash_deg = 8.0")
        moved = signals.table.with_columns(pl.col("steering_wheel_angle_rad") + jump_deg * DEGREE)
        answer, memory = offset_with_memory([replace(signals, table=moved)], truck(), memory)
        offsets.append(answer.offset.value or 0.0)
    assert offsets[2] - offsets[1] == pytest.approx(4.0 * DEGREE, abs=0.4 * DEGREE)


def test_the_date_of_a_drive_is_from_its_log_or_its_file() -> None:
    def at(start_s: float) -> Signals:
        times = np.arange(0.0, 10.0, 0.01) + start_s
        return Signals(pl.DataFrame({"time_s": times}), {}, 100.0, "drive")

    assert start_of_drive(at(NOW_S)) == NOW_S
    written = os.stat(__file__).st_mtime
    assert start_of_drive(at(0.0), __file__) == pytest.approx(written - 9.99)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "drive.parquet"
    drive(path.parent, "thesis_drive", 1, 600.0, "backlash_deg = 8.0")[0].table.write_parquet(path)
    return path


def test_the_command_makes_the_memory_and_the_same_log_twice_leaves_the_same_file(
    tmp_path: Path, log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "truck.toml"
    command = ["offset", str(log), "--vehicle", "scania_r730_4x2", "--memory", str(path), "--json"]
    assert run(command) == 0
    first, answer = path.read_bytes(), json.loads(capsys.readouterr().out)
    assert b'schema = "oncenter/truck-2"' in first and b"[[drives]]" in first
    assert run(command) == 0
    again = json.loads(capsys.readouterr().out)
    assert path.read_bytes() == first
    assert again["offset"] == answer["offset"]
    assert any("in the truck's memory already" in note for note in again["notes"])
    other = tmp_path / "other.toml"
    assert run([*command[:-2], str(other), "--json"]) == 0
    assert other.read_bytes() == first


def test_the_command_never_overwrites_its_inputs_with_the_memory(
    log: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    before = log.read_bytes()
    assert run(["offset", str(log), "--vehicle", "scania_r730_4x2", "--memory", str(log)]) == 2
    assert "--memory" in capsys.readouterr().err
    assert log.read_bytes() == before
    page = tmp_path / "m.toml"
    page.touch()
    both = ["--memory", str(page), "--report", str(page)]
    assert run(["offset", str(log), "--vehicle", "scania_r730_4x2", *both]) == 2


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--memory", "m.toml", "--method", "thesis"], "a memory needs method 'joint'"),
        (["--event", "repaired@2026-03-02", "--method", "thesis"], "an event needs method 'joint', got 'thesis'"),
        (["--memory", "no/such/folder/m.toml"], "no folder"),
        (["--applied", "1e9"], "--applied must be -720 to 720"),
        (["--applied", "nan"], "--applied must be -720 to 720"),
    ],
)
def test_an_impossible_option_is_refused_in_one_line(
    tmp_path: Path, log: Path, capsys: pytest.CaptureFixture[str], options: list[str], said: str
) -> None:
    here = [str(tmp_path / value) if value.endswith(".toml") else value for value in options]
    assert run(["offset", str(log), "--vehicle", "scania_r730_4x2", *here]) == 2
    err = capsys.readouterr().err
    assert said in err and err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_the_applied_correction_of_the_command_comes_before_the_vehicle_files(
    tmp_path: Path, log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    vehicle = tmp_path / "truck.toml"
    vehicle.write_text("wheelbase_m = 3.7\nsteering_ratio = 19.3\noffset_applied_deg = 1.0\n")
    for options, applied in (([], 1.0), (["--applied", "-2.5"], -2.5)):
        assert run(["offset", str(log), "--vehicle", str(vehicle), "--json", *options]) == 0
        assert json.loads(capsys.readouterr().out)["offset"]["applied_deg"] == applied
