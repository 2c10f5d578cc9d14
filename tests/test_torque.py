"""A steering wheel torque sensor: what it reads, what it adds to an answer, and what it cannot."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from joint_drives import core_for, driven

import oncenter as oc
from oncenter._native import lib
from oncenter.plausibility import check
from oncenter.signals import DEGREE, SIGNALS, STANDARD_GRAVITY, SignalName, Signals
from oncenter.simulate.scenario import read_scenario
from oncenter.simulate.steering import hand_torque_n_m_per_m_s2
from oncenter.simulate.truck import steered_force_n, steered_stiffness_n_rad, understeer_gradient
from oncenter.simulate.truth import Truth
from oncenter.vehicle import Vehicle

TORQUE = "steering_wheel_torque_nm"
SENSOR = "[sensors.steering_wheel_torque]\n"
IDEAL_SENSOR = SENSOR + "noise_sd_n_m = 0.0\nresolution_n_m = 0.0\n"
TRUCK = Vehicle(
    name="t",
    wheelbase_m=3.7,
    steering_ratio=19.3,
    track_width_front_m=2.05,
    track_width_rear_m=1.83,
    traffic_side="right",
)


def simulated(folder: Path, tables: str, duration_s: float = 600.0, seed: int = 1) -> tuple[Signals, Truth]:
    file = folder / "torque.toml"
    head = f'base = "thesis_drive"\nabout = "A drive with a torque sensor."\n[drive]\nduration_s = {duration_s}\n'
    file.write_text(head + tables, encoding="utf-8")
    return oc.simulate(file, seed)


def ideal(rows: Truth) -> tuple[np.ndarray, ...]:
    names = ("hand_torque_nm", "aligning_moment_nm", "place_in_play", "lateral_acceleration_m_s2")
    return tuple(rows.table[name].to_numpy() for name in names)


def test_hands_hold_the_moment_about_the_king_pins_through_ratio_and_assistance(tmp_path: Path) -> None:
    smooth = "[steering]\nking_pin_friction_n_m = 0.0\ncolumn_friction_n_m = 0.0\nassistance = 8.0\npull_n_m = 30.0\n"
    signals, truth = simulated(tmp_path, smooth + IDEAL_SENSOR, 120.0)
    torque, moment, place, _ = ideal(truth)
    left, right = place >= 1.0 - 1e-6, place <= -1.0 + 1e-6
    flank = (left & (moment > 31.0)) | (right & (moment < 29.0))
    assert flank[1:].mean() > 0.5
    # a row's moment is of the step before its torque's
    held = (moment[:-1][flank[1:]] - 30.0) / (19.3 * 8.0)
    assert torque[1:][flank[1:]] == pytest.approx(held, abs=0.02)
    assert signals.table[TORQUE].to_numpy() == pytest.approx(torque, abs=1e-9)


def test_within_the_play_hands_hold_the_columns_friction_alone(tmp_path: Path) -> None:
    play = "[steering]\nbacklash_deg = 12.0\ncolumn_friction_n_m = 0.3\nking_pin_friction_n_m = 200.0\n"
    _, truth = simulated(tmp_path, play + IDEAL_SENSOR, 120.0)
    torque, _, place, _ = ideal(truth)
    inside = np.abs(place) < 0.9
    assert inside.mean() > 0.1
    assert np.abs(torque[inside]).max() <= 0.3 + 1e-9
    assert np.abs(torque).max() > 0.5


def test_friction_opposes_the_wheel_so_that_a_turn_to_the_left_takes_more_torque(tmp_path: Path) -> None:
    rubs = "[steering]\nbacklash_deg = 0.0\nking_pin_friction_n_m = 0.0\ncolumn_friction_n_m = 0.5\n"
    _, truth = simulated(tmp_path, rubs + IDEAL_SENSOR, 200.0)
    torque, moment, _, _ = ideal(truth)
    beside = torque[1:] - moment[:-1] / (19.3 * 10.0)
    turned = np.gradient(truth.table["steering_wheel_angle_rad"].to_numpy())[1:] / DEGREE * 100.0
    assert np.median(beside[turned > 3.0]) > 0.4
    assert np.median(beside[turned < -3.0]) < -0.4
    assert np.abs(beside).max() < 0.55


def test_some_two_newton_metres_hold_one_metre_per_second_squared(tmp_path: Path) -> None:
    scenario = read_scenario("thesis_drive")
    assert 1.0 < hand_torque_n_m_per_m_s2(scenario.truck, scenario.steering) < 3.0


def test_a_torque_sensor_moves_no_other_signal(tmp_path: Path) -> None:
    with_it, _ = simulated(tmp_path, SENSOR, 60.0)
    without, truth = simulated(tmp_path, "", 60.0)
    assert TORQUE not in without.table.columns
    assert "hand_torque_nm" not in truth.table.columns
    assert with_it.table.drop(TORQUE).equals(without.table)


def test_a_log_without_torque_is_answered_as_if_there_were_none() -> None:
    columns, truth = driven("[steering]\nbacklash_deg = 8.0\n")
    silent = {**columns, TORQUE: np.full(len(columns["time_s"]), np.nan)}
    ends = []
    for log in (columns, silent):
        core = core_for(truth)
        core.run(log)
        ends.append(core.state_bytes())
    assert ends[0] == ends[1]


def test_the_torque_shows_the_neutral_point_without_an_accelerometer(tmp_path: Path) -> None:
    play = "[steering]\nbacklash_deg = 6.0\n" + SENSOR + "zero_error_n_m = 0.1\n"
    signals, truth = simulated(tmp_path, play, 1200.0)
    blind = dataclasses.replace(signals, table=signals.table.drop("lateral_acceleration_m_s2"))
    deaf = dataclasses.replace(blind, table=blind.table.drop(TORQUE))
    params = {"use_accelerometer": 0.0}
    answer, without = (oc.offset(log, TRUCK, params=params) for log in (blind, deaf))
    error, its_error = ((a.offset.value - truth.offset_rad) / DEGREE for a in (answer, without))
    half, its_half = (a.offset_half_width_rad / DEGREE for a in (answer, without))
    assert abs(error) < half < 0.5 * its_half
    assert abs(error) < 0.5, its_error


def test_an_accelerometer_that_drifts_is_held_by_the_torque(tmp_path: Path) -> None:
    """In some drives the drift of 1.2 m/s^2 hides which flank is loaded: then the answer is not valid."""
    drift = "[steering]\nbacklash_deg = 6.0\n" + SENSOR + "[sensors.lateral_acceleration]\ndrift_m_s2_min = 0.06\n"
    valid = 0
    for seed in range(1, 9):
        signals, truth = simulated(tmp_path, drift, 1200.0, seed)
        answer = oc.offset(signals, TRUCK)
        valid += answer.offset.status == "valid"
        assert answer.offset.status != "valid" or abs(answer.offset.value - truth.offset_rad) < 0.7 * DEGREE
    assert valid >= 3


def test_a_dead_torque_sensor_is_left_out() -> None:
    columns, truth = driven("[steering]\nbacklash_deg = 8.0\n")
    core, dead = core_for(truth), core_for(truth)
    core.run(columns)
    dead.run({**columns, TORQUE: np.zeros(len(columns["time_s"]))})
    assert dead.state()["evidence"]["torque"]["terms"][1] < 0.4
    difference = dead.answer()["offset"]["value"] - core.answer()["offset"]["value"]
    assert abs(difference) < 0.1 * DEGREE


def test_the_torque_bit_is_its_own() -> None:
    assert lib.OC_HAS_STEERING_WHEEL_TORQUE == 512


@pytest.mark.parametrize(("unit", "column", "sign"), [("N m", "torque", 1), ("Nm", "T_driver", -1)])
def test_a_torque_is_read_by_name_unit_and_sign(tmp_path: Path, unit: str, column: str, sign: int) -> None:
    signals, _ = simulated(tmp_path, SENSOR, 60.0)
    table = signals.table.select("time_s", "steering_wheel_angle_rad", "yaw_rate_rad_s", "vehicle_speed_m_s", TORQUE)
    table.with_columns(pl.col(TORQUE) * sign).rename({TORQUE: column}).write_csv(tmp_path / "drive.csv")
    read = oc.read(tmp_path / "drive.csv", names={"steering_wheel_torque": SignalName(column, unit, sign)})
    assert read.table[TORQUE].to_numpy() == pytest.approx(signals.table[TORQUE].to_numpy(), abs=1e-6)


def test_a_torque_of_reversed_sign_is_named(tmp_path: Path) -> None:
    signals, _ = simulated(tmp_path, SENSOR)
    assert not [f for f in check(signals, TRUCK).findings if "torque" in f.text]
    reversed_ = dataclasses.replace(signals, table=signals.table.with_columns(-pl.col(TORQUE)))
    (named,) = [f for f in check(reversed_, TRUCK).findings if "torque" in f.text]
    assert named.code == "sign_reversed"
    assert named.text.startswith("the sign of the steering wheel torque is reversed")


def test_a_torque_in_another_unit_is_named(tmp_path: Path) -> None:
    signals, _ = simulated(tmp_path, SENSOR)
    large = dataclasses.replace(signals, table=signals.table.with_columns(pl.col(TORQUE) * 1000.0))
    (named,) = [f for f in check(large, TRUCK).findings if "torque" in f.text]
    assert named.code == "scale"
    assert "torque_slope_n_m_m_s2" in named.text


def test_no_signal_separates_a_pull_from_an_accelerometer_bias(tmp_path: Path) -> None:
    """More bias, less crown and less pull: another straight-ahead angle, and the same log, the torque included."""
    e = 0.15  # m/s^2
    scenario = read_scenario("thesis_drive")
    truck, steering = scenario.truck, scenario.steering
    force_n = steered_force_n(truck, steering, e)
    by_compliance_rad = steering.compliance_deg_kn_m * DEGREE / 1000.0 * steering.trail_m * force_n
    set_rad = by_compliance_rad - understeer_gradient(truck, steering) * e
    exact = "noise_sd_m_s2 = 0.0\nresolution_m_s2 = 0.0\n"

    def drive(share: float) -> tuple[Signals, Truth]:
        tables = (
            f"[steering]\nbacklash_deg = 0.0\npull_n_m = {-share * steering.trail_m * force_n}\n"
            f"pull_n = {share * set_rad * steered_stiffness_n_rad(truck, steering)}\n"
            f"[road]\ncrown_percent = {2.0 - 100.0 * share * e / STANDARD_GRAVITY}\n"
            f"[sensors.lateral_acceleration]\nbias_m_s2 = {0.02 + share * e}\n{exact}"
        )
        return simulated(tmp_path, tables + IDEAL_SENSOR, 300.0)

    (signals, truth), (others, its_truth) = drive(0.0), drive(1.0)
    apart_deg = (its_truth.straight_ahead_rad - truth.straight_ahead_rad) / DEGREE
    assert apart_deg == pytest.approx(0.40 * 19.3 * e, rel=0.03)
    same = {"steering_wheel_angle_rad": 0.03 * DEGREE, "lateral_acceleration_m_s2": 0.01, TORQUE: 0.03}
    for name, tolerance in same.items():
        difference = (signals.table[name] - others.table[name]).to_numpy()[12_000:]
        assert abs(difference.mean()) < tolerance, name
        assert np.sqrt(np.mean(difference**2)) < 6.0 * tolerance, name
    assert SIGNALS["steering_wheel_torque"].column == TORQUE
