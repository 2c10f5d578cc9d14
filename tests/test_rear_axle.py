"""Trucks whose rear axle steers: yaw shows the offsets of both axles' sensors together."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import polars as pl
import pytest
from test_core_motion import motion_of
from test_estimate import RATE_HZ, steady_drive

import oncenter as oc
from oncenter import _core
from oncenter.cli import run
from oncenter.estimates.estimate import Estimate
from oncenter.live.learner import Known
from oncenter.live.snapshot import Snapshot
from oncenter.live.words import still_missing
from oncenter.offset.assemble import answer_so_far
from oncenter.offset.compare import compared, offset_of
from oncenter.offset.inputs import params_of
from oncenter.offset.withheld import Gaps
from oncenter.signals import DEGREE, Signals, Source
from oncenter.vehicle import Vehicle, core_of, vehicle_from
from oncenter.verdict import verdicts_of

RATIO, FRONT_DEG, REAR_DEG, SHARE = 19.3, 2.0, 3.0, -0.25
BY_REAR_DEG = RATIO * REAR_DEG  # two axles: weight 1


def truck(**given: Any) -> Vehicle:
    values = {"wheelbase_m": 3.7, "steering_ratio": RATIO, "traffic_side": "right", "rear_axle_steers": "rear"}
    return vehicle_from({**values, **given}, "truck.toml")


def counter_phase(*, locked_s: tuple[float, float] = (0.0, 0.0), known: slice | None = None) -> Signals:
    """`steady_drive` with a rear axle that steers by -0.25 times the front angle except while it is locked. Its sensor
    reads 3 deg too much, in the rows of `known` only."""
    drive = steady_drive(offset_deg=FRONT_DEG, minutes=8.0, radius_m=200.0)
    time = drive.columns["time_s"]
    by_motion = (drive.columns["steering_wheel_angle_rad"] - FRONT_DEG * DEGREE) / RATIO
    rear = np.where((time < locked_s[0]) | (time > locked_s[1]), SHARE / (1.0 - SHARE) * by_motion, 0.0)
    read = rear + REAR_DEG * DEGREE
    if known is not None:
        read = np.where(np.isin(np.arange(len(time)), np.arange(len(time))[known]), read, np.nan)
    table = drive.table.with_columns(
        steering_wheel_angle_rad=pl.Series(RATIO * (by_motion + rear) + FRONT_DEG * DEGREE),
        rear_axle_angle_rad=pl.Series(read),
    )
    sources = {**drive.sources, "rear_axle_angle": Source("made up", RATE_HZ, len(time), 0)}
    return dataclasses.replace(drive, table=table, sources=sources)


def without_rear_angle(drive: Signals) -> Signals:
    sources = {name: source for name, source in drive.sources.items() if name != "rear_axle_angle"}
    return dataclasses.replace(drive, table=drive.table.drop("rear_axle_angle_rad"), sources=sources)


def front_deg() -> float:
    """The offset of the same drive, as a truck has it whose rear axle does not steer."""
    drive = steady_drive(offset_deg=FRONT_DEG, minutes=8.0, radius_m=200.0)
    return deg(oc.offset(drive, truck(rear_axle_steers=None)).offset)


def deg(estimate: Estimate | None) -> float:
    assert estimate is not None and estimate.value is not None
    return estimate.value / DEGREE


def texts_of(answer: oc.Answer) -> list[str]:
    return [finding.text for finding in answer.findings if finding.code == "rear_axle_steers"]


def test_the_rear_axle_turns_the_truck_as_the_front_axle_does_by_its_weight() -> None:
    alone, with_rear = motion_of(0.02, 20.0, angle=0.5), motion_of(0.02, 20.0, angle=0.5, rear=0.01)
    assert with_rear.rear_part == pytest.approx(0.12)
    assert with_rear.residual == pytest.approx(alone.residual - 0.12)


def test_yaw_shows_the_front_offset_less_ratio_times_weight_times_the_rear_one_and_neither_alone() -> None:
    answer = oc.offset(counter_phase(), truck())
    assert deg(answer.combined_offset) == pytest.approx(front_deg() - BY_REAR_DEG, abs=0.2)
    assert answer.rear_axle_offset is not None
    assert answer.offset.status == answer.rear_axle_offset.status == "unobservable"
    assert answer.correction is None
    verdict = verdicts_of(answer)[0]
    assert verdict.state != "recalibrate" and "rear axle's sensor" in verdict.said
    assert verdicts_of(answer)[1].state == "not_measured"
    assert answer.to_dict()["combined_offset"]["value"] == deg(answer.combined_offset)
    (text,) = texts_of(answer)
    assert "19.3 times" in text and "Neither sensor's own offset is identifiable" in text


def test_both_offsets_are_estimated_where_the_rear_axle_is_locked_for_a_part_of_the_drive() -> None:
    answer = oc.offset(counter_phase(locked_s=(240.0, 420.0)), truck())
    assert deg(answer.offset) == pytest.approx(front_deg(), abs=0.4)
    assert deg(answer.rear_axle_offset) == pytest.approx(REAR_DEG, abs=1e-3)
    assert deg(answer.combined_offset) == pytest.approx(deg(answer.offset) - BY_REAR_DEG, abs=0.02)


def test_a_rear_axle_that_never_steers_again_is_not_taken_for_locked_since_its_sensor_may_be_stuck() -> None:
    answer = oc.offset(counter_phase(locked_s=(300.0, np.inf)), truck())
    assert answer.rear_axle_offset is not None and answer.rear_axle_offset.status == "unobservable"


def test_a_given_zero_of_the_rear_axle_gives_the_front_offset_and_widens_its_interval_by_its_own() -> None:
    widths, combined = [], []
    for sd_deg in (0.001, 0.1):
        answer = oc.offset(counter_phase(), truck(rear_axle_zero_deg=REAR_DEG, rear_axle_zero_sd_deg=sd_deg))
        assert deg(answer.offset) == pytest.approx(front_deg(), abs=0.4)
        assert answer.offset_half_width_rad is not None
        widths.append(answer.offset_half_width_rad / DEGREE)
        assert answer.combined_offset is not None and answer.combined_offset.ci95 is not None
        combined.append(np.ptp(answer.combined_offset.ci95))
    assert combined[0] == pytest.approx(combined[1], rel=0.02)
    assert answer.next_driving[0].startswith("measure the zero of the rear axle's sensor")
    assert np.hypot(widths[0], 1.96 * RATIO * 0.1) == pytest.approx(widths[1], rel=0.01)


def test_ticks_without_the_rear_axle_s_angle_count_as_missing() -> None:
    answer = oc.offset(counter_phase(known=slice(6000, None)), truck())
    assert answer.rejected_s["missing_signal"] == pytest.approx(6000 / RATE_HZ, abs=0.1)


def with_rear_rad(drive: Signals, scale: float) -> Signals:
    return dataclasses.replace(drive, table=drive.table.with_columns(pl.col("rear_axle_angle_rad") * scale))


def test_a_rear_axle_s_angle_in_a_wrong_unit_is_named() -> None:
    drive = counter_phase()
    in_deg = with_rear_rad(drive, 1.0 / DEGREE)
    with pytest.raises(oc.OncenterError, match=r"rear_axle_angle is 171 deg in the middle.*check its unit"):
        oc.offset(in_deg, truck())
    straight = in_deg.table["rear_axle_angle_rad"] - REAR_DEG
    answer = oc.offset(dataclasses.replace(drive, table=drive.table.with_columns(straight)), truck())
    assert answer.combined_offset is not None and answer.combined_offset.status == "invalid"
    assert "times as far as the front wheels" in " ".join(texts_of(answer))


def test_a_log_without_the_rear_axle_s_angle_is_answered_by_the_front_axle_with_a_warning() -> None:
    answer = oc.offset(without_rear_angle(counter_phase()), truck())
    assert answer.combined_offset is None
    assert deg(answer.offset) == pytest.approx(front_deg(), abs=0.8)
    (text,) = texts_of(answer)
    assert "the log has no rear_axle_angle" in text


def test_a_rear_axle_s_angle_without_an_axle_in_the_vehicle_file_is_not_used_and_the_key_is_named() -> None:
    answer = oc.offset(counter_phase(), truck(rear_axle_steers=None))
    assert answer.combined_offset is None
    (text,) = texts_of(answer)
    assert "Give rear_axle_steers" in text


def test_the_angle_without_its_sensor_is_not_available_while_the_rear_axle_s_zero_is_unknown() -> None:
    assert oc.angle(counter_phase(), truck())["status"].unique().to_list() == ["unobservable"]


def test_an_angle_that_is_not_available_names_the_rear_axle_as_its_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    counter_phase().table.write_parquet(tmp_path / "drive.parquet")
    lines = 'wheelbase_m = 3.7\nsteering_ratio = 19.3\nrear_axle_steers = "rear"\n'
    (tmp_path / "truck.toml").write_text(lines)
    assert run(["angle", str(tmp_path / "drive.parquet"), "--vehicle", str(tmp_path / "truck.toml")]) == 0
    said = capsys.readouterr().out
    assert "a rear axle steers, and the zero of its sensor is not given" in said and "truck stands" not in said


def test_a_live_answer_has_the_findings_on_the_rear_axle_and_requires_no_more_driving() -> None:
    drive, vehicle = counter_phase(), truck()
    core = core_of(vehicle, RATE_HZ)
    core.run({name: column for name, column in drive.columns.items() if name in _core.COLUMNS})
    answer = answer_so_far(core.answer(), drive, vehicle, params_of(vehicle, None), Gaps(0.0, 0.0))
    assert texts_of(answer)
    now = SimpleNamespace(phase="running", known=Known(answer, {}, 0.0), is_changing=False, verdict=None)
    assert still_missing(cast("Snapshot", now), {}) == []  # more driving separates no sensors


def test_a_comparison_of_combined_offsets_needs_the_zero_of_the_rear_axle_s_sensor() -> None:
    before = offset_of(oc.offset(counter_phase(), truck()).to_dict(), "before.json")
    action = compared(before, dataclasses.replace(before, log="after", drives=()), 2.0).action
    assert "give rear_axle_zero_deg" in action and "Drive on" not in action


def test_no_tick_publishes_a_combined_offset_as_that_of_the_angle_sensor() -> None:
    alone = oc.trace(oc.offset(counter_phase(), truck()))["offset_status"]
    given = oc.trace(oc.offset(counter_phase(), truck(rear_axle_zero_deg=REAR_DEG, rear_axle_zero_sd_deg=0.001)))
    assert set(alone) == {"unobservable"} and given["offset_status"][-1] == "converging"


def test_a_simulated_rear_axle_in_counter_phase_gives_the_combined_offset_and_by_a_wrong_sign_none(
    tmp_path: Path,
) -> None:
    scenario = tmp_path / "drive.toml"
    scenario.write_text(
        'base = "country"\n[drive]\nduration_s = 300.0\n[truck]\nrear_steering = { share = -0.25 }\n'
        "[sensors.rear_axle_angle]\noffset_deg = -3.0\n"
    )
    signals, truth = oc.simulate(scenario, 4)
    given = truck(wheelbase_m=truth.equivalent_wheelbase_m, steering_ratio=truth.steering_ratio)
    combined = oc.offset(signals, given).combined_offset
    target = truth.offset_rad + truth.straight_ahead_rad + truth.steering_ratio * 3.0 * DEGREE
    assert combined is not None and combined.ci95 is not None and combined.value is not None
    assert combined.ci95[0] < target < combined.ci95[1]
    assert abs(combined.value - target) < 0.5 * DEGREE
    wrong = oc.offset(with_rear_rad(signals, -1.0), given)
    assert wrong.combined_offset is not None and wrong.combined_offset.status == wrong.offset.status == "invalid"
    assert "Check the sign and the unit of rear_axle_angle" in " ".join(texts_of(wrong))
    assert not any(finding.code == "wheelbase_or_ratio" for finding in wrong.findings)
    lacks = oc.offset(without_rear_angle(signals), given)
    assert not any(finding.code == "wheelbase_or_ratio" for finding in lacks.findings)
