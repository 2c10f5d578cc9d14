"""(47) and (48): what errors of sensors do to the offset, against the estimator itself."""

import json
import math
from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_estimate import steady_drive

import oncenter as oc
from oncenter.cli import run
from oncenter.offset.budget import Truck, as_corrected_rad, as_printed_rad, speed_scale_rad
from oncenter.signals import DEGREE
from oncenter.vehicle import vehicle_from

TRACTOR = {"wheelbase_m": 3.7, "steering_ratio": 19.0, "understeer_gradient_deg_m_s2": 0.53}


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


def residual_mean(truck: Truck, bias: float, acceleration_bias: float, *, accelerometer: bool, bank: float) -> float:
    """(36) and (37) with (33) as they stand, of samples that wind evenly to both sides, less the truth."""
    v = truck.mean_speed_m_s
    yaw_rate = v / 1000.0 * np.sin(np.linspace(0.0, 2.0 * math.pi, 1001)[:-1])
    true_angle = truck.steering_ratio * (
        truck.wheelbase_m * yaw_rate / v + truck.understeer_gradient * (yaw_rate * v + bank)
    )
    r, speed = yaw_rate + bias, v * (1.0 + truck.speed_scale)
    a_g = yaw_rate * v + bank + acceleration_bias - r * speed if accelerometer else 0.0
    model = truck.steering_ratio * (truck.wheelbase_m * r / speed + truck.understeer_gradient * (r * speed + a_g))
    return float(np.mean(model - true_angle))


trucks = st.builds(Truck, numbers(10, 25), numbers(3, 7), numbers(-0.002, 0.012), numbers(10, 25), numbers(-0.1, 0.1))


@given(trucks, numbers(-0.05, 0.05), numbers(-1, 1), numbers(-0.5, 0.5))
def test_the_corrected_formula_agrees_with_33_and_37(truck: Truck, bias: float, off: float, bank: float) -> None:
    seen = residual_mean(truck, bias, off, accelerometer=True, bank=bank)
    assert seen == pytest.approx(as_corrected_rad(truck, bias, off), abs=1e-9)


@given(trucks, numbers(-0.05, 0.05), numbers(-0.5, 0.5))
def test_the_printed_formula_agrees_with_them_without_an_accelerometer(truck: Truck, bias: float, bank: float) -> None:
    seen = residual_mean(truck, bias, 0.0, accelerometer=False, bank=bank)
    assert seen == pytest.approx(as_printed_rad(truck, bias, -bank), abs=1e-9)


def test_the_error_of_the_estimator_is_that_of_the_corrected_formula() -> None:
    """A truck that follows (37) exactly, 20 m/s; the gates stand open, or Table 4's would shut at such a bias."""
    vehicle = vehicle_from({"wheelbase_m": 3.7, "steering_ratio": 19.3}, "truck.toml")
    wide = {"bank_max_m_s2": 2.0, "curvature_max_1_m": 1 / 200}
    drive = steady_drive(minutes=6.0)
    biased = drive.table.with_columns(
        pl.col("yaw_rate_rad_s") + 1.0 * DEGREE,
        pl.col("lateral_acceleration_m_s2") + 0.3,
        pl.col("vehicle_speed_m_s") * 1.05,
    )
    straight, off = (
        oc.offset(replace(drive, table=table), vehicle, method="thesis", params=wide).offset.value
        for table in (drive.table, biased)
    )
    truck = Truck(19.3, 3.7, 0.4 * DEGREE, 20.0, 0.05)
    wanted = as_corrected_rad(truck, 1.0 * DEGREE, 0.3)
    assert straight - off == pytest.approx(wanted, rel=0.05)
    assert abs(as_printed_rad(truck, 1.0 * DEGREE, 0.3) / wanted - 1.0) > 0.3  # so that the test distinguishes the two


def test_table_1s_sensors_have_the_errors_of_48() -> None:
    given = oc.budget(vehicle_from(TRACTOR, "tractor.toml"))
    by_name = {c.name: c for c in given.contributions}
    L, K, v, scale = 3.7, 0.53 * DEGREE, 15.0, 1.05
    bias = by_name["yaw_rate_bias"]
    assert bias.printed_rad / DEGREE == pytest.approx(19.0 * (L / (v * scale) + v * K * scale) * 3.0)
    assert bias.corrected_rad / DEGREE == pytest.approx(19.0 * L / (v * scale) * 3.0)
    assert by_name["lateral_acceleration_bias"].corrected_rad / DEGREE == pytest.approx(19.0 * 0.53 * 0.980665)
    assert by_name["backlash"].corrected_rad / DEGREE == pytest.approx(7.5)  # (51)
    assert by_name["steering_wheel_angle_hysteresis"].corrected_rad / DEGREE == pytest.approx(2.5)
    assert by_name["speed_scale"].corrected_rad == pytest.approx(speed_scale_rad(given.truck, 1 / 800))
    assert given.total_corrected_rad == pytest.approx(math.hypot(*(c.corrected_rad for c in given.contributions)))


def test_the_next_sensor_has_the_largest_effect_until_it_is_good_enough() -> None:
    sensors = {"yaw_rate_bias_deg_s": 3.0}
    first = oc.budget(vehicle_from({**TRACTOR, "sensors": sensors}, "t.toml"))
    assert first.next_sensor == "yaw rate sensor"
    enough = next(c.enough for c in first.contributions if c.sensor == first.next_sensor)
    assert 0.0 < enough < 3.0
    better = oc.budget(vehicle_from({**TRACTOR, "sensors": {"yaw_rate_bias_deg_s": 0.99 * enough}}, "t.toml"))
    assert better.next_sensor == "accelerometer"
    good = {
        "yaw_rate_bias_deg_s": 0.1,
        "lateral_acceleration_bias_m_s2": 0.05,
        "steering_wheel_angle_hysteresis_deg": 0.5,
    }
    assert oc.budget(vehicle_from({**TRACTOR, "sensors": good}, "t.toml")).next_sensor is None


def test_a_bad_accelerometer_beside_a_good_gyro_is_better_left_out() -> None:
    sensors = {"yaw_rate_bias_deg_s": 0.1, "lateral_acceleration_bias_m_s2": 1.0}
    bad = oc.budget(vehicle_from({**TRACTOR, "sensors": sensors}, "t.toml"), backlash_rad=0.0)
    assert any("do not use this accelerometer" in line for line in bad.advice())
    good = oc.budget(
        vehicle_from({**TRACTOR, "sensors": {**sensors, "lateral_acceleration_bias_m_s2": 0.02}}, "t.toml"),
        backlash_rad=0.0,
    )
    assert not any("do not use this accelerometer" in line for line in good.advice())


@pytest.mark.parametrize(
    ("sensors", "named"),
    [
        ({"yaw_rate_bias": 1.0}, "yaw_rate_bias_deg_s"),
        ({"yaw_rate_bias_deg_s": -1.0}, "sensors.yaw_rate_bias_deg_s"),
        ({"speed_scale_percent": 50.0}, "sensors.speed_scale_percent"),
        ({"lateral_acceleration_bias_m_s2": math.nan}, "sensors.lateral_acceleration_bias_m_s2"),
    ],
)
def test_a_wrong_sensor_is_refused_by_name(sensors: dict[str, float], named: str) -> None:
    with pytest.raises(oc.OncenterError) as refusal:
        vehicle_from({**TRACTOR, "sensors": sensors}, "t.toml")
    assert named in str(refusal.value)
    assert refusal.value.exit_code == 2


def test_the_verb_prints_what_the_function_gives(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["budget", "--vehicle", "scania_r730_4x2"]) == 0
    words = capsys.readouterr().out
    assert "next: a better yaw rate sensor" in words
    assert "understeer_gradient_deg_m_s2" in words  # the file has none, and what was taken is said
    assert run(["budget", "--vehicle", "scania_r730_4x2", "--speed-km-h", "90", "--backlash-deg", "0", "--json"]) == 0
    given = json.loads(capsys.readouterr().out)
    assert (given["schema"], given["mean_speed"]["value"]) == ("oncenter/budget-1", 90.0)
    assert given["contributions"]["backlash"]["as_corrected"]["value"] == 0.0
    for wrong, code in (("--speed-km-h=0", "mean_speed"), ("--backlash-deg=-1", "backlash")):
        assert run(["budget", "--vehicle", "scania_r730_4x2", wrong, "--json"]) == 2
        assert json.loads(capsys.readouterr().out)["code"] == code
