"""What a truck may change between two drives, and how its drives are combined: see docs/truck_over_time.md."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from truck_rows import drive_row

import oncenter as oc
from oncenter import _core
from oncenter._native import lib
from oncenter.memory import TruckMemory, offset_with_memory
from oncenter.signals import DEGREE, Signals
from oncenter.simulate import simulate_to_log
from oncenter.truck.fingerprint import Print, are_same, copies, fingerprint_of
from oncenter.truck.now import truck_now
from oncenter.truck.priors import priors_of
from oncenter.tuned import BETWEEN_DRIVES
from oncenter.vehicle import vehicle_from

TRUE_DEG = 2.04  # of thesis_drive
TRUCK = vehicle_from(
    {"wheelbase_m": 3.7, "steering_ratio": 19.3, "track_width_front_m": 2.05, "track_width_rear_m": 1.83}, "truck"
)
ANGLE = "steering_wheel_angle_rad"
LEFT = ("wheel_speed_front_left_m_s", "wheel_speed_rear_left_m_s")


@pytest.fixture(scope="module")
def drives() -> list[Signals]:
    """Six drives of one truck, with the clock of no day."""
    return [
        dataclasses.replace(oc.simulate("thesis_drive", seed)[0], log=f"log{seed}.parquet") for seed in range(201, 207)
    ]


def turned(drive: Signals, by_deg: float) -> Signals:
    return with_columns(drive, (pl.col(ANGLE) + by_deg * DEGREE))


def with_columns(drive: Signals, *columns: pl.Expr) -> Signals:
    return dataclasses.replace(drive, table=drive.table.with_columns(*columns))


def codes(answer: oc.Answer) -> set[str]:
    return {finding.code for finding in answer.findings}


def holds(answer: oc.Answer, true_deg: float = TRUE_DEG) -> bool:
    assert answer.offset_ci95_drive is not None
    low, high = answer.offset_ci95_drive
    return low < true_deg * DEGREE < high


def test_twelve_or_six_logs_are_no_further_from_the_truth_than_one(drives: list[Signals]) -> None:
    """They share the crown of their region, and it is not the one of the vehicle file's prior."""
    together = oc.offset(drives, TRUCK)
    alone = [oc.offset(drive, TRUCK).offset.value for drive in drives]
    mean_deg = float(np.mean([value / DEGREE for value in alone if value is not None]))
    assert together.offset.value is not None and holds(together)
    assert together.offset.value / DEGREE == pytest.approx(mean_deg, abs=0.08)
    assert together.duration_s == pytest.approx(sum(drive.ticks for drive in drives) / 100.0)


@pytest.mark.parametrize("percent", [0.1, 0.3, 1.0])
def test_larger_tyres_on_one_side_move_neither_the_offset_nor_a_sensor(drives: list[Signals], percent: float) -> None:
    short = dataclasses.replace(drives[1], table=drives[1].table.head(8 * 6000))
    changed = with_columns(short, *(pl.col(wheel) / (1.0 + percent / 100.0) for wheel in LEFT))
    answer = oc.offset([drives[0], changed], TRUCK)
    assert holds(answer)
    assert not codes(answer) & {"offset_changed", "straight_ahead_moved", "yaw_rate_bias_moves", "zero_moves"}


@pytest.mark.parametrize("percent", [0.1, 0.3, 1.0])
def test_a_core_that_was_off_takes_other_tyres_for_tyres(drives: list[Signals], percent: float) -> None:
    changed = with_columns(drives[1], *(pl.col(wheel) / (1.0 + percent / 100.0) for wheel in LEFT))
    core = ran(ran(None, drives[0]), changed)
    answer = core.answer()
    assert answer["offset"]["value"] / DEGREE == pytest.approx(TRUE_DEG, abs=0.2)
    assert answer["offset_parts"]["drive_sd"] < 0.1 * DEGREE
    assert answer["changes"] == 0 and _core.FAULTS[answer["fault"]] == "none"
    assert answer["wheel_radius_mismatch_rear"]["value"] == pytest.approx(percent / 100.0, abs=0.002)


def ran(core: _core.Core | None, drive: Signals, elapsed_s: float = 3600.0) -> _core.Core:
    """Another ignition of the core, or its first."""
    from oncenter.offset.inputs import params_of, track_widths
    from oncenter.vehicle import core_of

    if core is None:
        widths = track_widths(TRUCK, "joint", [drive])
        core = core_of(TRUCK, 100.0, method="joint", params=params_of(TRUCK, None), track_widths=widths)
    else:
        core.restart(elapsed_s)
    core.run({name: drive.columns[name] for name in _core.COLUMNS if name in drive.columns})
    return core


def test_what_may_change_between_two_drives_grows_with_the_time_between_them() -> None:
    quantities = {name: getattr(lib, f"OC_BETWEEN_{name}") for name in BETWEEN_DRIVES}
    assert len(quantities) == lib.OC_BETWEEN_COUNT
    for name, quantity in quantities.items():
        at_ignition, per_root_day = BETWEEN_DRIVES[name]
        for days in (0.0, 1.0, 30.0):
            expected = at_ignition**2 + per_root_day**2 * days
            assert lib.oc_variance_between_drives(quantity, days * 86400.0) == pytest.approx(expected, rel=1e-5), name
        for unknown in (-1.0, math.nan, -math.inf):
            assert lib.oc_variance_between_drives(quantity, unknown) == pytest.approx(at_ignition**2, rel=1e-5), name
        assert lib.oc_variance_between_drives(quantity, math.inf) < 100.0


def test_a_month_without_ignition_leaves_a_truck_less_certain_than_an_hour(drives: list[Signals]) -> None:
    short = dataclasses.replace(drives[1], table=drives[1].table.head(6000))
    sds = []
    for elapsed_s in (0.0, 3600.0, 30 * 86400.0):
        answer = ran(ran(None, drives[0]), short, elapsed_s).answer()
        sds.append([answer[name]["standard_deviation"] for name in ("offset", "backlash")])
    before = ran(None, drives[0]).answer()
    for k, name in enumerate(("offset", "backlash")):
        assert sds[0][k] <= sds[1][k] * 1.02 < sds[2][k] * 1.05, name
    assert sds[2][1] > before["backlash"]["standard_deviation"]


def test_an_ignition_before_the_first_tick_changes_nothing(drives: list[Signals]) -> None:
    short = dataclasses.replace(drives[0], table=drives[0].table.head(12_000))
    never_off = ran(None, short)
    off = ran(None, dataclasses.replace(short, table=short.table.head(0)))
    assert ran(off, short, 1e6).save(1) == never_off.save(1)


def test_logs_that_continue_each_other_are_one_drive(drives: list[Signals]) -> None:
    """A logger that begins a new file: ten seconds are missing, the clock runs on."""
    whole = drives[0].table
    parts = [
        dataclasses.replace(drives[0], table=part, log=f"part{k}")
        for k, part in enumerate((whole.head(40_000), whole.slice(41_000)))
    ]
    gap = dataclasses.replace(drives[0], table=pl.concat([part.table for part in parts]))
    both, one = oc.offset(parts, TRUCK), oc.offset(gap, TRUCK)
    assert both.offset == one.offset and both.offset_ci95_drive == one.offset_ci95_drive


def test_a_copy_of_a_drive_or_a_part_of_it_counts_once(drives: list[Signals]) -> None:
    alone = oc.offset(drives[0], TRUCK)
    part = dataclasses.replace(drives[0], table=drives[0].table.slice(30_017, 60_000), log="part.parquet")
    for log in (dataclasses.replace(drives[0], log="copy.parquet"), part):
        for logs in ([drives[0], log], [log, drives[0]]):
            answer = oc.offset(logs, TRUCK)
            assert answer.offset == alone.offset and answer.used_s == alone.used_s
            assert any("it counts once" in note for note in answer.notes)


def test_a_fingerprint_is_that_of_a_copy_a_part_and_another_format_but_of_no_other_drive(
    drives: list[Signals], tmp_path: Path
) -> None:
    prints = [fingerprint_of(drive) for drive in drives]
    assert not any(are_same(one, other) for k, one in enumerate(prints) for other in prints[:k])
    simulate_to_log("thesis_drive", 201, tmp_path / "drive.log")
    lines = (tmp_path / "drive.log").read_text(encoding="utf-8").splitlines(keepends=True)
    (tmp_path / "half.log").write_text("".join(lines[len(lines) // 3 :]), encoding="utf-8")
    for name in ("drive.log", "half.log"):
        assert are_same(fingerprint_of(oc.read(tmp_path / name)), prints[0]), name
    remounted = fingerprint_of(turned(drives[0], 3.0))
    assert not are_same(remounted, prints[0])


def test_two_drives_on_circles_are_no_copies() -> None:
    """They have no turns, and each sample equals the others."""
    left, right = (
        Signals(
            pl.DataFrame({"time_s": np.arange(6000) / 100.0, "yaw_rate_rad_s": np.full(6000, rate), ANGLE: rate}),
            {},
            100.0,
            "circle",
        )
        for rate in (0.1, -0.2)
    )
    assert are_same(fingerprint_of(left), fingerprint_of(left))
    assert not are_same(fingerprint_of(left), fingerprint_of(right))


def test_the_same_samples_on_two_days_are_two_drives() -> None:
    days = [Print("abcdef" * 3, 600.0, 1.8e9 + day * 86400.0) for day in range(3)]
    assert copies(days) == {}
    assert copies([dataclasses.replace(day, start_s=math.nan) for day in days]) == {1: 0, 2: 0}
    assert copies([days[0], dataclasses.replace(days[0], length_s=60.0)]) == {1: 0}


STARTS_DEG = (6.1, -0.7, 11.0, -4.4, 3.0, -7.5)


def test_a_sensor_with_another_zero_at_each_start_is_a_relative_one_and_needs_no_calibration(
    drives: list[Signals],
) -> None:
    logs = [turned(drive, by_deg) for drive, by_deg in zip(drives, STARTS_DEG, strict=True)]
    answer = oc.offset(logs, TRUCK)
    assert answer.zero == "relative" and answer.correction is None
    assert "zero_differs_at_starts" in codes(answer) and "offset_changed" not in codes(answer)
    assert "steering_wheel_angle_offset" not in codes(answer)
    assert holds(answer, TRUE_DEG + STARTS_DEG[-1])
    assert answer.to_dict()["verdicts"][0]["state"] == "no_correction"
    before, after = (oc.offset(with_columns(log, pl.lit(0.0).alias(TYPE)), TRUCK) for log in logs[:2])
    assert oc.compare(before, after).state == "no_correction"
    assert "steering_wheel_angle_offset" not in codes(before)


TYPE = "steering_wheel_angle_sensor_type"


def test_the_memory_of_a_truck_names_a_relative_sensor_at_the_third_drive(drives: list[Signals]) -> None:
    memory, zeros = TruckMemory("truck"), []
    for drive, by_deg in zip(drives[:5], STARTS_DEG, strict=False):
        answer, memory = offset_with_memory([turned(drive, by_deg)], TRUCK, memory)
        zeros.append(answer.zero)
    assert zeros == ["fixed"] * 2 + ["relative"] * 3
    again, unchanged = offset_with_memory([turned(drives[0], STARTS_DEG[0])], TRUCK, memory)
    assert unchanged == memory and any("already" in note for note in again.notes)


def test_a_sensor_that_was_remounted_once_has_the_offset_since(drives: list[Signals]) -> None:
    logs = [turned(drive, 0.0 if k < 3 else 4.0) for k, drive in enumerate(drives)]
    answer = oc.offset(logs, TRUCK)
    assert answer.zero == "fixed" and {"offset_changed"} <= codes(answer)
    assert holds(answer, TRUE_DEG + 4.0)
    assert [log.log for log in answer.drives] == [f"log{seed}.parquet" for seed in range(204, 207)]


@pytest.mark.parametrize(
    ("offsets_deg", "zero"),
    [
        ((2.0, 2.1, 1.9, 2.0, 2.1, 2.0), "fixed"),
        ((2.0, 2.1, 9.0, 2.0, 2.1, 2.0), "fixed"),  # one wrong drive
        ((2.0, 2.1, 1.9, 5.0, 5.1, 5.0), "fixed"),
        ((2.0, 2.1, 5.0, 5.1, 2.0, 2.1), "fixed"),  # remounted, then calibrated
        ((2.0, 2.1, 2.9, 3.6, 3.7, 4.8, 5.5, 5.6), "moves"),
        ((2.0, 2.7, 3.4, 4.1, 4.8, 5.5, 6.2, 6.9), "moves"),
        ((6.1, -0.7, 11.0, -4.4), "relative"),
        ((6.1, -0.7, 11.0, -4.4, 3.0, -7.5), "relative"),
        ((6.1, -0.7, 11.0), "relative"),
        ((6.1, -0.7), "fixed"),  # a step
    ],
)
def test_drives_that_exclude_each_other_have_the_cause_that_fits(offsets_deg: tuple[float, ...], zero: str) -> None:
    rows = [drive_row(day, offset) for day, offset in enumerate(offsets_deg)]
    assert truck_now(rows, (), priors_of()).zero == zero


def test_a_drive_that_is_not_sure_contradicts_nobody() -> None:
    offsets_deg, sds = (2.0, 2.1, 9.0, 2.0, -6.0, 2.1), (0.1, 0.1, 3.0, 0.1, 3.0, 0.1)
    rows = [drive_row(day, by, sds=(sd, 0.3, 0.02)) for day, (by, sd) in enumerate(zip(offsets_deg, sds, strict=True))]
    truck = truck_now(rows, (), priors_of())
    assert truck.zero == "fixed" and truck.changes == ()


def test_a_sensor_that_slips_again_and_again_is_named_and_its_interval_has_the_last_value(
    drives: list[Signals],
) -> None:
    time = drives[0].table["time_s"].to_numpy()
    slipped_deg = sum(1.0 * (time > minute * 60.0) for minute in (7.0, 10.0, 13.0, 16.0))
    answer = oc.offset(with_columns(drives[0], pl.col(ANGLE) + pl.Series(slipped_deg * DEGREE)), TRUCK)
    assert answer.zero == "moves" and "zero_moves" in codes(answer)
    assert holds(answer, TRUE_DEG + 4.0)
    assert answer.correction is None
    offset, sensor = answer.to_dict()["verdicts"][:2]
    assert offset["state"] == sensor["state"] == "signal_or_sensor"


@pytest.mark.parametrize("wheel", ["front_left", "front_right", "rear_left", "rear_right"])
def test_a_slow_puncture_is_named_and_does_not_move_the_yaw_rate_bias(drives: list[Signals], wheel: str) -> None:
    """1 % of the radius an hour, from the fifth minute on: 0.42 % in the drive."""
    time = drives[0].table["time_s"].to_numpy()
    radius = 1.0 - 0.01 * np.maximum(time - 300.0, 0.0) / 3600.0
    leaking = with_columns(drives[0], pl.col(f"wheel_speed_{wheel}_m_s") / pl.Series(radius))
    answer, healthy = oc.offset(leaking, TRUCK), oc.offset(drives[0], TRUCK)
    [leak] = [finding for finding in answer.findings if finding.code == "tyre_loses_air"]
    axle, side = wheel.split("_")
    assert f"the {side} {axle} tyre" in leak.text and "Check the tyre pressures" in leak.text
    assert leak.value is not None and abs(leak.value) == pytest.approx(0.42, abs=0.07)
    assert "tyre_loses_air" not in codes(healthy)
    assert answer.offset.value is not None
    assert answer.offset.value / DEGREE == pytest.approx(TRUE_DEG, abs=0.3)
    assert answer.yaw_rate_bias.value is not None and healthy.yaw_rate_bias.value is not None
    assert abs(answer.yaw_rate_bias.value - healthy.yaw_rate_bias.value) < 0.1 * DEGREE


def test_a_wheel_that_was_changed_between_two_ignitions_is_no_puncture(drives: list[Signals]) -> None:
    changed = with_columns(drives[1], pl.col("wheel_speed_rear_left_m_s") / 1.003)
    assert ran(ran(None, drives[0]), changed).answer()["leaked_rear"] == 0.0
