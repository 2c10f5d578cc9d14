"""A truck's memory: each drive starts from it and adds to it once; it ages, and the offset is found anew each time."""

from __future__ import annotations

import json
import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from test_known_truck import drive, half_width, holds, offset_to_find, truck

import oncenter as oc
from oncenter.cli import run
from oncenter.estimates.estimate import Estimate
from oncenter.memory import TruckMemory, offset_with_memory, read_memory, write_memory
from oncenter.memory.drive import priors, with_drive
from oncenter.memory.file import text_of
from oncenter.memory.log import start_of_drive
from oncenter.memory.truck import DAY_S, Load, PastDrive, Remembered
from oncenter.signals import DEGREE, Signals

NOW_S = 1_750_000_000.0
FULL = TruckMemory(
    'a "truck"',
    play=Remembered(8.0 * DEGREE, 0.4 * DEGREE, NOW_S),
    yaw_rate_bias=Remembered(-0.2 * DEGREE, 0.01 * DEGREE, NOW_S),
    accelerometer_bias=Remembered(0.1, 0.15, NOW_S),
    equivalent_wheelbase=Remembered(3.75, 0.05, NOW_S),
    loads=(
        Load(Remembered(0.3 * DEGREE, 0.02 * DEGREE, NOW_S), 3),
        Load(Remembered(0.5 * DEGREE, 0.03 * DEGREE, NOW_S), 1),
    ),
    vin="YS2R4X20001234567",
    drives=(
        PastDrive("0123", NOW_S, 2.0 * DEGREE, 0.4 * DEGREE, "valid"),
        PastDrive("4567", NOW_S, None, None, "converging"),
    ),
)


@pytest.fixture(scope="module")
def answered(tmp_path_factory: pytest.TempPathFactory) -> oc.Answer:
    signals, _ = drive(tmp_path_factory.mktemp("drive"), "thesis_drive", 1, 900.0, "backlash_deg = 8.0")
    return oc.offset(signals, truck())


def numbers(memory: TruckMemory) -> list[float]:
    known = [memory.play, memory.yaw_rate_bias, memory.accelerometer_bias, memory.equivalent_wheelbase]
    known += [load.gradient for load in memory.loads]
    return [value for each in known if each is not None for value in (each.value, each.sd, each.date_s)]


def with_gradient(answer: oc.Answer, gradient_deg: float, half_width_deg: float = 0.05) -> oc.Answer:
    interval = ((gradient_deg - half_width_deg) * DEGREE, (gradient_deg + half_width_deg) * DEGREE)
    return replace(answer, understeer_gradient=Estimate(gradient_deg * DEGREE, interval, "valid", "rad/(m/s^2)"))


def test_a_memory_survives_writing_and_reading(tmp_path: Path) -> None:
    write_memory(tmp_path / "m.toml", FULL)
    again = read_memory(tmp_path / "m.toml", FULL.truck)
    assert numbers(again) == pytest.approx(numbers(FULL), rel=1e-5)
    assert [load.drives for load in again.loads] == [3, 1]
    assert [(each.key, each.status) for each in again.drives] == [("0123", "valid"), ("4567", "converging")]
    assert again.drives[1].offset is None
    assert text_of(again) == (tmp_path / "m.toml").read_text(encoding="utf-8")


def test_a_truck_without_a_file_has_an_empty_memory_that_changes_nothing(tmp_path: Path) -> None:
    memory = read_memory(tmp_path / "none.toml", "truck")
    assert memory == TruckMemory("truck")
    assert priors(memory, truck(), NOW_S) == {}


HEAD = 'schema = "oncenter/truck-1"\ntruck = "truck"\n'
PLAY = f"{HEAD}[play]\ndate = 2026-01-01T00:00:00Z\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('schema = "oncenter/truck-1"\ntruck = "other"\n', "belongs to truck 'other', not to 'truck'"),
        ('schema = "oncenter/truck-2"\ntruck = "truck"\n', "instead of 'oncenter/truck-1'"),
        ("wheelbase_m = 3.7\n", "instead of 'oncenter/truck-1'"),
        (f"{HEAD}plays = 1\n", "'plays'"),
        (f"{PLAY}value_deg = nan\nsd_deg = 1\n", "'play.value_deg'"),
        (f"{PLAY}value_deg = 800\nsd_deg = 1\n", "'play.value_deg'"),
        (f"{PLAY}value_deg = 8\nsd_deg = 0\n", "'play.sd_deg'"),
        (f"{PLAY}value_deg = 8\n", "'play.sd_deg'"),
        (f'{HEAD}[play]\nvalue_deg = 8\nsd_deg = 1\ndate = "soon"', "'play.date'"),
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


def test_remembered_values_become_less_accurate_with_time() -> None:
    today, later = (priors(FULL, truck(), NOW_S + days * DAY_S) for days in (0.0, 400.0))
    spreads = [name for name in today if "_sd_" in name]
    assert len(spreads) == 5
    grown = {name: later[name] / today[name] for name in spreads if name in later}
    assert grown.pop("known_understeer_gradient_sd_rad_m_s2") > 1.0  # mostly of loads that differ
    assert min(grown.values()) > 1.05
    assert later["known_play_rad"] == today["known_play_rad"]
    assert priors(FULL, truck(), NOW_S - 400.0 * DAY_S) == later  # nor is it known long before


def test_the_offset_is_no_prior_of_the_next_drive() -> None:
    other = replace(FULL, drives=(replace(FULL.drives[0], offset=20.0 * DEGREE),))
    assert priors(other, truck(), NOW_S) == priors(FULL, truck(), NOW_S)


def test_a_vehicle_files_own_value_comes_before_the_memory() -> None:
    given = truck(play_deg=3.0, play_sd_deg=0.2)
    assert not any(name.startswith("known_play") for name in priors(FULL, given, NOW_S))


def test_the_wheelbase_of_a_truck_with_a_lift_axle_is_no_prior() -> None:
    lifts = truck().model_copy(update={"axle_layout": "6x2"})
    assert "known_wheelbase_share_1" not in priors(FULL, lifts, NOW_S)
    assert priors(FULL, truck(), NOW_S)["known_wheelbase_share_1"] == pytest.approx(3.75 / 3.7 - 1.0)


def test_another_load_begins_another_gradient_and_the_same_load_improves_it(answered: oc.Answer) -> None:
    memory = TruckMemory("truck")
    for day, gradient_deg in enumerate([0.40, 0.41, 0.60, 0.39, 0.61]):
        at_s = NOW_S + day * DAY_S
        memory = with_drive(memory, with_gradient(answered, gradient_deg), {answered.log: str(day)}, at_s, {})
    assert sorted(load.drives for load in memory.loads) == [2, 3]
    values = sorted(load.gradient.value / DEGREE for load in memory.loads)
    assert values == pytest.approx([0.40, 0.605], abs=0.01)
    first = with_drive(TruckMemory("truck"), with_gradient(answered, 0.40), {answered.log: "0"}, NOW_S, {})
    assert min(load.gradient.sd for load in memory.loads) < first.loads[0].gradient.sd


def test_the_next_drives_gradient_may_be_that_of_any_load() -> None:
    """0.3 thrice, 0.5 once and the model's prior once: mean and spread of that mixture."""
    found = priors(FULL, truck(), NOW_S)
    assert found["known_understeer_gradient_rad_m_s2"] == pytest.approx((3 * 0.3 + 0.5 + 0.4) / 5 * DEGREE)
    assert 0.15 * DEGREE < found["known_understeer_gradient_sd_rad_m_s2"] < 0.3 * DEGREE


def test_a_prior_is_removed_from_a_gradient_before_it_is_added(answered: oc.Answer) -> None:
    """Otherwise the memory's prior would come back as if it were evidence of the drive."""
    prior = {
        "known_understeer_gradient_rad_m_s2": 0.8 * DEGREE,
        "known_understeer_gradient_sd_rad_m_s2": 0.05 * DEGREE,
    }
    both = with_gradient(answered, 0.6, 1.96 * 0.05 / math.sqrt(2.0))  # of two that are equally sure: 0.8 and 0.4
    found = with_drive(TruckMemory("truck"), both, {answered.log: "0"}, NOW_S, prior).loads[0].gradient
    assert found.value == pytest.approx(0.4 * DEGREE, rel=1e-6)
    assert found.sd == pytest.approx(0.05 * DEGREE, rel=1e-6)


def test_a_less_accurate_drive_does_not_change_the_memory(answered: oc.Answer) -> None:
    wide = replace(answered, backlash=Estimate(7.0 * DEGREE, (5.0 * DEGREE, 9.0 * DEGREE), "valid", "rad"))
    memory = replace(FULL, truck="truck")
    assert with_drive(memory, wide, {answered.log: "0"}, NOW_S + DAY_S, {}).play == memory.play


def test_a_repaired_play_replaces_the_remembered_one(answered: oc.Answer) -> None:
    tight = replace(answered, backlash=Estimate(2.0 * DEGREE, (1.0 * DEGREE, 3.0 * DEGREE), "valid", "rad"))
    after = with_drive(replace(FULL, truck="truck"), tight, {answered.log: "0"}, NOW_S + DAY_S, {}).play
    assert after is not None and after.value == pytest.approx(2.0 * DEGREE)


@pytest.mark.parametrize("fault", [{"sensor_fault": "stuck"}, {"offset": Estimate(None, None, "invalid", "rad")}])
def test_a_drive_whose_signals_are_at_fault_adds_nothing(answered: oc.Answer, fault: dict[str, Any]) -> None:
    assert with_drive(FULL, replace(answered, **fault), {answered.log: "0"}, NOW_S, {}) == FULL


def test_many_standstills_keep_the_uncertainty_of_the_yards_slope(answered: oc.Answer) -> None:
    memory = TruckMemory("truck")
    for day in range(30):
        memory = with_drive(memory, answered, {answered.log: str(day)}, NOW_S + day * DAY_S, {})
    assert memory.accelerometer_bias is not None
    assert memory.accelerometer_bias.sd > 0.139


def test_the_drives_that_are_listed_are_the_last_fifty(answered: oc.Answer) -> None:
    memory = TruckMemory("truck")
    for day in range(60):
        memory = with_drive(memory, answered, {answered.log: str(day)}, NOW_S + day * DAY_S, {})
    assert [each.key for each in memory.drives] == [str(day) for day in range(10, 60)]


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
    assert b'schema = "oncenter/truck-1"' in first and b"[play]" in first
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
