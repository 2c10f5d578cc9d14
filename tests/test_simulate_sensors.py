"""Sensors and their faults: the readings show exactly the faults listed in the truth."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from oncenter.errors import OncenterError
from oncenter.signals import DEGREE, Signals
from oncenter.simulate import Truth, sensor_sections, simulate, simulate_to_log
from oncenter.simulate.can import one_byte, two_bytes
from oncenter.simulate.drive import ROW_DTYPE
from oncenter.simulate.scenario import Scenario, read_scenario, scenario_from
from oncenter.simulate.section import Section
from oncenter.simulate.sensor_sections import (
    Accelerometer,
    Gnss,
    LateralAccelerometer,
    Sensors,
    SpeedSensor,
    SteeringWheelAngleSensor,
    WheelSpeedSensors,
    YawRateSensor,
)
from oncenter.simulate.sensors import sense
from oncenter.simulate.sensors.angle import sense_angle
from oncenter.simulate.sensors.gnss import sense_gnss
from oncenter.simulate.sensors.inertial import sense_acceleration, sense_lateral_acceleration, sense_yaw_rate
from oncenter.simulate.sensors.wheels import sense_vehicle_speed, sense_wheel_speeds, wheel_speeds

DRIVE = """base = "thesis_drive"
about = "a minute and a half"
[drive]
duration_s = 90.0
standing_at_start_s = 2.0
standing_at_end_s = 2.0
"""
WITHOUT_NOISE = {"noise_sd_deg": 0.0, "resolution_deg": 0.0, "range_deg": 2000.0}

Drive = Callable[[str], tuple[Signals, Truth]]


@pytest.fixture
def scenario(tmp_path: Path) -> Callable[[str], Path]:
    def write(extra: str) -> Path:
        file = tmp_path / "faulty.toml"
        file.write_text(DRIVE + extra, encoding="utf-8")
        return file

    return write


@pytest.fixture
def drive(scenario: Callable[[str], Path]) -> Drive:
    return lambda extra: simulate(scenario(extra), seed=3)


@pytest.fixture(scope="module")
def faultless(tmp_path_factory: pytest.TempPathFactory) -> tuple[Signals, Truth]:
    file = tmp_path_factory.mktemp("faultless") / "faulty.toml"
    file.write_text(DRIVE, encoding="utf-8")
    return simulate(file, seed=3)


def rows(count: int, **columns: Any) -> np.ndarray:
    made = np.zeros(count, ROW_DTYPE)
    made["time"] = np.arange(count) / 100
    for name, values in columns.items():
        made[name] = values
    return made


def column(signals: Signals, name: str) -> np.ndarray:
    return signals.table[name].to_numpy()


def chances(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(seed))


# All of them

FAULTS = {
    "steering_wheel_angle_rad": [
        "[sensors.steering_wheel_angle]\nhysteresis_deg = 2.0",
        "[[sensors.steering_wheel_angle.remounts]]\nbegin_s = 30.0\nstep_deg = 5.0",
        "[sensors.steering_wheel_angle.self_correction]\nbegin_s = 30.0\nlength_s = 20.0",
        "[sensors.steering_wheel_angle.dropouts]\nrate_1_h = 400.0\nlength_s = [0.1, 2.0]",
    ],
    "yaw_rate_rad_s": [
        "[sensors.yaw_rate]\nrandom_walk_sd_deg_s_min = 1.0",
        "[sensors.yaw_rate]\ndrift_deg_s_min = 0.5\nwarm_up_deg_s = 2.0\nbank_shift_mrad_s_percent = 0.05",
        "[sensors.yaw_rate]\nscale_error_percent = 2.0",
        "[sensors.yaw_rate]\nscale_warm_up_percent = 2.0",
        "[sensors.yaw_rate]\nlatency_s = 0.1",
        "[sensors.yaw_rate]\nfilter_time_s = 0.1",
        "[sensors.yaw_rate]\nhold_s = 0.05",
        "[[sensors.yaw_rate.stuck]]\nbegin_s = 30.0\nlength_s = 20.0",
    ],
    "lateral_acceleration_m_s2": [
        "[sensors.lateral_acceleration]\ndrift_m_s2_min = 0.3\nrandom_walk_sd_m_s2_min = 0.2",
        "[sensors.lateral_acceleration]\nahead_of_gravity_centre_m = 3.0",
        "[sensors.lateral_acceleration]\ntilt_deg = -1.0",
        "[sensors.lateral_acceleration]\nturned_deg = 5.0",
    ],
    "wheel_speed_": [
        "[sensors.wheel_speed]\nscale_error_percent = 1.0\npulses_per_turn = 100",
        "[sensors.wheel_speed]\nrepeat_share = 0.3",
        "[sensors.wheel_speed.radius_warm_up_percent]\nfront_left = 0.2\nfront_right = 0.2\nrear_left = 0.2\n"
        "rear_right = 0.2",
    ],
    "vehicle_speed_m_s": ["[[sensors.speed.failures]]\nbegin_s = 80.0", "[sensors.speed]\nlatency_s = 0.2"],
    "none": ["[sensors.gnss]\nlatitude_deg = 59.2\nlongitude_deg = 17.6"],
}


@pytest.mark.parametrize(("of", "extra"), [(of, extra) for of, extras in FAULTS.items() for extra in extras])
def test_a_fault_of_one_sensor_leaves_every_other_reading_as_it_was(
    drive: Drive, faultless: tuple[Signals, Truth], of: str, extra: str
) -> None:
    signals, truth = drive(extra)
    known, known_truth = faultless
    for name in known.table.columns:
        same = np.array_equal(column(signals, name), column(known, name), equal_nan=True)
        assert same != name.startswith(of), name
    assert len(truth.faults) > len(known_truth.faults) or of == "none"


def test_without_faults_the_truth_lists_offset_and_biases_only(faultless: tuple[Signals, Truth]) -> None:
    signals, truth = faultless
    assert [(f.signal, f.kind) for f in truth.faults] == [
        ("steering_wheel_angle", "offset"),
        ("yaw_rate", "bias"),
        ("lateral_acceleration", "bias"),
    ]
    assert [f.size for f in truth.faults] == pytest.approx([2.04 * DEGREE, 0.05 * DEGREE, 0.02])
    assert truth.table["steering_wheel_angle_offset_rad"].unique().to_list() == [2.04 * DEGREE]
    assert not np.isnan(signals.table.to_numpy()).any()
    assert all(source.not_available == 0 for source in signals.sources.values())


def test_every_gap_is_in_the_truth_and_every_gap_in_the_truth_is_in_the_signal(drive: Drive) -> None:
    signals, truth = drive(
        "[sensors.yaw_rate.dropouts]\nrate_1_h = 1200.0\nlength_s = [0.05, 0.4]\n"
        '[[sensors.yaw_rate.failures]]\nbegin_s = 70.0\nlength_s = 5.0\nsays = "error"\n'
        "[[sensors.yaw_rate.failures]]\nbegin_s = 85.0\n"
    )
    time = column(signals, "time_s")
    silent = np.zeros(len(time), bool)
    dropouts = [f for f in truth.faults if f.kind == "not_available"]
    for fault in (*dropouts, *(f for f in truth.faults if f.kind == "error")):
        silent |= (time > fault.begin_s - 0.001) & (time < fault.end_s - 0.001)
    np.testing.assert_array_equal(np.isnan(column(signals, "yaw_rate_rad_s")), silent)
    assert signals.sources["yaw_rate"].not_available == silent.sum()
    lengths_s = [f.end_s - f.begin_s for f in dropouts if (f.begin_s, f.end_s) != (85.0, 90.0)]
    assert len(lengths_s) == len(dropouts) - 1
    assert 15 < len(lengths_s) < 50  # 30 are expected
    assert all(0.0 < length < 0.41 for length in lengths_s)  # the drive's end may cut the last one off


def test_a_stuck_sensor_repeats_its_last_value_and_then_recovers(
    drive: Drive, faultless: tuple[Signals, Truth]
) -> None:
    signals, truth = drive("[[sensors.wheel_speed.stuck]]\nbegin_s = 30.0\nlength_s = 10.0\n")
    stuck, lively = (column(s, "wheel_speed_rear_left_m_s") for s in (signals, faultless[0]))
    assert (stuck[3000:4000] == lively[3000]).all()
    assert len(np.unique(lively[3000:4000])) > 100
    np.testing.assert_array_equal(np.delete(stuck, slice(3000, 4000)), np.delete(lively, slice(3000, 4000)))
    assert ("wheel_speed", "stuck", 30.0, 40.0) in [(f.signal, f.kind, f.begin_s, f.end_s) for f in truth.faults]


def read_by_each(moving: np.ndarray, late: dict[str, float]) -> dict[str, np.ndarray]:
    """Readings of sensors without noise for the same true value, in its unit."""
    fine = read_scenario("thesis_drive").sensors
    still = {"bias_deg_s": 0.0, "noise_sd_deg_s": 0.0, "resolution_deg_s": 0.0, "range_deg_s": 2000.0}
    yaw_rate, *_ = sense_yaw_rate(moving, YawRateSensor(**still, **late), chances())
    angle, *_ = sense_angle(
        moving["steering_wheel_angle"], SteeringWheelAngleSensor(offset_deg=0.0, **WITHOUT_NOISE, **late), chances()
    )
    still = {"bias_m_s2": 0.0, "noise_sd_m_s2": 0.0, "resolution_m_s2": 0.0, "range_m_s2": 1000.0}
    acceleration, *_ = sense_acceleration(
        "longitudinal_acceleration", moving["longitudinal_acceleration"], Accelerometer(**still, **late), chances()
    )
    speed, _ = sense_vehicle_speed(
        moving["vehicle_speed"], SpeedSensor(noise_sd_m_s=0.0, resolution_m_s=0.0, **late), chances()
    )
    straight = moving.copy()
    straight["yaw_rate"] = straight["steering_wheel_angle"] = 0.0
    exact = WheelSpeedSensors(noise_sd_m_s=0.0, resolution_m_s=0.0, repeat_share=0.0, **late)
    wheels, _ = sense_wheel_speeds(read_scenario("thesis_drive").truck, straight, exact, fine.speed, chances())
    _, over_ground = sense_gnss(moving, Gnss(**HERE, **late), chances())
    return {
        "yaw_rate": yaw_rate,
        "angle": angle,
        "acceleration": acceleration,
        "speed": speed,
        "wheel": wheels["wheel_speed_rear_left"],
        "over_ground": over_ground,
    }


def ramp(count: int = 3000) -> np.ndarray:
    """1 m/s^2, 1 rad/s^2 and so on, from the third second on."""
    rising = np.maximum(np.arange(count) / 100.0 - 3.0, 0.0)
    names = ("yaw_rate", "steering_wheel_angle", "longitudinal_acceleration", "vehicle_speed")
    return rows(count, **dict.fromkeys(names, rising))


@pytest.mark.parametrize("late", [{"latency_s": 0.123}, {"filter_time_s": 0.123}])
def test_latency_and_low_pass_both_delay_a_ramp_by_their_time(late: dict[str, float]) -> None:
    true = np.arange(3000) / 100.0 - 3.0
    for name, read in read_by_each(ramp(), late).items():
        np.testing.assert_allclose(read[600:2000], true[600:2000] - 0.123, atol=1e-9, err_msg=name)
        assert read[0] == 0.0, name


def test_a_low_pass_reaches_63_percent_of_a_step_after_its_time_constant() -> None:
    step = rows(1000, yaw_rate=np.r_[np.zeros(300), np.ones(700)])
    read = read_by_each(step, {"filter_time_s": 0.5})["yaw_rate"]
    assert read[300 + 50] == pytest.approx(1.0 - np.exp(-1.0), abs=0.005)
    assert read[-1] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(("hold_s", "new_at"), [(0.05, [5, 10, 15]), (0.025, [3, 5, 8]), (0.1, [10, 20, 30])])
def test_a_holding_sensor_gives_a_new_value_only_every_hold_time(hold_s: float, new_at: list[int]) -> None:
    moving = ramp()
    for name, read in read_by_each(moving, {"hold_s": hold_s}).items():
        changes = np.flatnonzero(np.diff(read)) + 1
        after_s3 = changes[changes >= 300 + new_at[0]] - 300
        assert after_s3[:3].tolist() == new_at, name
        np.testing.assert_allclose(read[changes], moving["vehicle_speed"][changes], atol=1e-12, err_msg=name)


def test_a_delayed_speed_sensor_reads_zero_without_teeth() -> None:
    speed = np.r_[np.zeros(100), np.full(500, 5.0), np.zeros(400)]
    sensor = SpeedSensor(noise_sd_m_s=0.05, resolution_m_s=0.0, latency_s=0.1, filter_time_s=0.3)
    read, _ = sense_vehicle_speed(speed, sensor, chances())
    assert (read[:110] == 0.0).all()
    assert (read[610:] == 0.0).all()
    assert (read[140:610] > 0.0).all()


def test_a_delayed_receiver_gives_the_earlier_position_and_heading() -> None:
    seconds = np.arange(3000) / 100.0
    moving = rows(3000, north=20.0 * seconds, heading=0.01 * seconds)
    exact = {"position_sd_m": 0.0, "heading_sd_deg": 0.0}
    on_time, _ = sense_gnss(moving, Gnss(**HERE, **exact), chances())
    late, _ = sense_gnss(moving, Gnss(**HERE, **exact, latency_s=0.2), chances())
    holding, _ = sense_gnss(moving, Gnss(**HERE, **exact, hold_s=0.2), chances())
    for name in ("latitude", "longitude", "heading"):
        np.testing.assert_allclose(late[name][20:], on_time[name][:-20], rtol=1e-12, err_msg=name)
        np.testing.assert_array_equal(holding[name], np.repeat(on_time[name][::20], 20), err_msg=name)


@pytest.mark.parametrize(
    ("section", "signal"),
    [
        ("steering_wheel_angle", "steering_wheel_angle"),
        ("speed", "vehicle_speed"),
        ("wheel_speed", "wheel_speed"),
        ("gnss", "gnss"),
    ],
)
def test_the_truth_lists_the_delays_of_a_sensor(drive: Drive, section: str, signal: str) -> None:
    place = "latitude_deg = 59.2\nlongitude_deg = 17.6\n" if section == "gnss" else ""
    _, truth = drive(f"[sensors.{section}]\n{place}latency_s = 0.1\nfilter_time_s = 0.3\nhold_s = 0.1\n")
    late = [(f.kind, f.begin_s, f.end_s, f.size) for f in truth.faults if f.signal == signal and f.kind != "offset"]
    assert late == [(kind, 0.0, 90.0, None) for kind in ("latency", "filter", "hold")]


# The angle


def test_measured_angle_less_current_offset_is_the_true_angle_under_all_faults(drive: Drive) -> None:
    signals, truth = drive(
        "[[sensors.steering_wheel_angle.remounts]]\nbegin_s = 20.0\nstep_deg = -7.0\n"
        "[sensors.steering_wheel_angle.self_correction]\nbegin_s = 40.0\nlength_s = 10.0\nshare = 0.5\n"
        "[sensors.steering_wheel_angle.relative]\nturns = 1\n"
        "[[sensors.steering_wheel_angle.relative.ignitions]]\nbegin_s = 60.0\noff_s = 3.0\nturns = -1\n"
    )
    measured, offset = column(signals, "steering_wheel_angle_rad"), truth.table["steering_wheel_angle_offset_rad"]
    error_deg = (measured - offset.to_numpy() - truth.table["steering_wheel_angle_rad"].to_numpy()) / DEGREE
    assert np.nanmax(np.abs(error_deg)) < 0.15
    np.testing.assert_array_equal(np.isnan(error_deg), (np.arange(9000) >= 6000) & (np.arange(9000) < 6300))
    at_deg = [offset[int(100 * s)] / DEGREE for s in (0, 19.99, 20, 40, 45, 50, 59.99, 60, 89.99)]
    expected = [362.04, 362.04, 355.04, 355.04, 356.28, 357.52, 357.52, -362.48, -362.48]
    assert at_deg == pytest.approx(expected, abs=1e-9)
    assert truth.offset_rad / DEGREE == pytest.approx(-2.48, abs=1e-9)  # without the whole turns
    assert (signals.table["steering_wheel_angle_sensor_type"] == 0).all()
    listed = {(f.kind, f.begin_s, f.end_s): f.size / DEGREE for f in truth.faults if f.unit == "rad"}
    assert listed == pytest.approx(
        {
            ("offset", 0.0, 90.0): 2.04,
            ("whole_turns", 0.0, 60.0): 360.0,
            ("remount", 20.0, 90.0): -7.0,
            ("self_correction", 40.0, 90.0): 2.48,
            ("whole_turns", 60.0, 90.0): -360.0,
        }
    )


def test_a_sensor_with_hysteresis_lags_by_half_its_width() -> None:
    turns_deg = np.r_[np.linspace(0, 20, 401), np.linspace(20, -20, 801)[1:]]
    sensor = SteeringWheelAngleSensor(offset_deg=0.0, hysteresis_deg=3.0, **WITHOUT_NOISE)
    read, *_ = sense_angle(turns_deg * DEGREE, sensor, chances())
    behind_deg = read / DEGREE - turns_deg
    np.testing.assert_allclose(behind_deg[40:401], -1.5, atol=1e-9)
    np.testing.assert_allclose(behind_deg[470:], 1.5, atol=1e-9)
    np.testing.assert_allclose(read[400:450] / DEGREE, 18.5, atol=1e-9)  # the play is being used up


def test_an_angle_beyond_the_sensor_s_range_reads_the_limit() -> None:
    sensor = SteeringWheelAngleSensor(offset_deg=0.0, noise_sd_deg=0.0, resolution_deg=0.1, range_deg=750.0)
    read, *_ = sense_angle(np.array([-800.0, -12.34, 12.36, 800.0]) * DEGREE, sensor, chances())
    np.testing.assert_allclose(read / DEGREE, [-750.0, -12.3, 12.4, 750.0], atol=1e-9)


# The yaw rate


def gyro(**keys: float) -> YawRateSensor:
    return YawRateSensor(bias_deg_s=0.2, noise_sd_deg_s=0.0, resolution_deg_s=0.0, range_deg_s=50.0, **keys)


def test_a_bias_drifts_linearly_settles_while_warming_up_and_jumps_when_remounted() -> None:
    minutes = np.arange(180_000) / 6000
    sensor = YawRateSensor.model_validate(
        gyro(drift_deg_s_min=0.5, warm_up_deg_s=5.0).model_dump()
        | {"remounts": [{"begin_s": 600.0, "step_deg_s": -1.0}]}
    )
    read, bias, faults = sense_yaw_rate(rows(180_000), sensor, chances())
    expected = 0.2 + 0.5 * minutes + 5.0 * np.exp(-minutes / 5.0) - (minutes >= 10.0)
    np.testing.assert_allclose(read / DEGREE, expected, atol=1e-9)
    np.testing.assert_array_equal(read, bias)
    rate = np.diff(5.0 * np.exp(-minutes / 5.0)) * 6000
    assert rate[0] == pytest.approx(-1.0, rel=1e-3)  # deg/s/min, which 2.5 calls not uncommon
    sizes = {f.kind: f.size / DEGREE for f in faults}
    assert sizes == pytest.approx({"bias": 0.2, "drift": 15.0, "warm_up": 5.0, "remount": -1.0}, rel=1e-4)


def test_a_random_walk_has_its_sd_after_one_minute_and_twice_that_after_four() -> None:
    still, sensor = rows(24_001), gyro(random_walk_sd_deg_s_min=0.3)
    walks = np.array([sense_yaw_rate(still, sensor, chances(seed))[1] for seed in range(300)]) / DEGREE
    assert walks[:, 6000].std() == pytest.approx(0.3, rel=0.12)
    assert walks[:, 24_000].std() == pytest.approx(0.6, rel=0.12)


@pytest.mark.parametrize(("slope_percent", "shift_mrad_s"), [(2.0, 0.1), (7.0, 0.35), (-4.0, -0.2)])
def test_a_banked_road_shifts_the_yaw_rate(slope_percent: float, shift_mrad_s: float) -> None:
    """2.5: 0.1 to 0.3 mrad/s at 2 to 7 %."""
    read, _, faults = sense_yaw_rate(
        rows(100, cross_slope=slope_percent / 100), gyro(bank_shift_mrad_s_percent=0.05), chances()
    )
    assert read * 1000 == pytest.approx(0.2 * DEGREE * 1000 + shift_mrad_s, abs=1e-9)
    assert faults[-1].kind == "bank_shift"
    assert faults[-1].size == pytest.approx(shift_mrad_s / 1000)


def test_a_cold_gyro_s_scale_error_decays_and_does_not_affect_a_straight_drive() -> None:
    sensor = gyro(scale_error_percent=-1.0, scale_warm_up_percent=3.0, warm_up_time_min=5.0)
    turning, _, faults = sense_yaw_rate(rows(60_000, yaw_rate=10.0 * DEGREE), sensor, chances())
    ratio = (turning / DEGREE - 0.2) / 10.0
    assert ratio[0] == pytest.approx(1.02)
    assert ratio[30_000] == pytest.approx(0.99 + 0.03 * 0.05, abs=1e-4)
    assert (np.diff(ratio) < 0.0).all()
    straight, bias, _ = sense_yaw_rate(rows(60_000), sensor, chances())
    np.testing.assert_array_equal(straight, bias)
    sizes = {f.kind: f.size for f in faults if f.unit == "1"}
    assert sizes == pytest.approx({"scale_error": -0.01, "scale_warm_up": 0.03})


# The accelerometer


def felt_by(moving: np.ndarray, **mounted: float) -> tuple[np.ndarray, np.ndarray, dict[str, float]]:
    """Readings of a lateral accelerometer without noise, its bias, and its fault sizes by kind."""
    exact = {"bias_m_s2": 0.1, "noise_sd_m_s2": 0.0, "resolution_m_s2": 0.0, "range_m_s2": 15.0}
    read, bias, faults = sense_lateral_acceleration(moving, LateralAccelerometer(**exact, **mounted), chances())
    return read, bias, {f.kind: f.size for f in faults}


def test_an_accelerometer_ahead_of_the_gravity_centre_measures_yaw_acceleration() -> None:
    swinging = rows(2000, yaw_rate=0.2 * np.sin(2.0 * np.arange(2000) / 100.0), felt_lateral_acceleration=0.5)
    read, bias, sizes = felt_by(swinging, ahead_of_gravity_centre_m=1.5)
    yaw_acceleration = 0.4 * np.cos(2.0 * np.arange(2000) / 100.0)
    np.testing.assert_allclose(read[1:-1], (0.6 + 1.5 * yaw_acceleration)[1:-1], atol=1e-3)
    assert (bias == 0.1).all()
    assert sizes == pytest.approx({"bias": 0.1, "ahead_of_gravity_centre": 0.6}, abs=2e-3)
    behind, *_ = felt_by(swinging, ahead_of_gravity_centre_m=-1.5)
    np.testing.assert_allclose(behind + read, 1.2, atol=1e-9)


def test_a_tilted_accelerometer_measures_gravity_as_part_of_its_bias() -> None:
    read, bias, sizes = felt_by(rows(100, felt_lateral_acceleration=0.5), tilt_deg=1.0)
    np.testing.assert_allclose(read, 0.6 + 9.80665 * np.sin(np.deg2rad(1.0)))
    np.testing.assert_allclose(read - bias, 0.5)
    assert sizes == pytest.approx({"bias": 0.1, "tilt": 0.171150}, rel=1e-4)


def test_a_turned_accelerometer_measures_longitudinal_acceleration() -> None:
    speeding_up = rows(200, longitudinal_acceleration=np.r_[np.full(100, 1.0), np.full(100, -2.0)])
    read, bias, sizes = felt_by(speeding_up, turned_deg=3.0)
    np.testing.assert_allclose(read[[0, 150]], 0.1 + np.sin(np.deg2rad(3.0)) * np.array([1.0, -2.0]))
    assert (bias == 0.1).all()
    assert sizes == pytest.approx({"bias": 0.1, "turned": -2.0 * np.sin(np.deg2rad(3.0))})


@pytest.mark.parametrize(("roll_share", "felt"), [(1.0, 2.4), (0.0, 2.0), (0.25, 2.1)])
def test_an_accelerometer_on_the_frame_does_not_measure_body_roll(roll_share: float, felt: float) -> None:
    leaning = rows(100, lateral_acceleration=2.0, felt_lateral_acceleration=2.4)
    read, bias, sizes = felt_by(leaning, roll_share=roll_share)
    np.testing.assert_allclose(read - bias, felt)
    assert sizes.get("roll_share", 0.0) == pytest.approx(felt - 2.4)


# The wheels


def wheels_of(sensor: WheelSpeedSensors, moving: np.ndarray) -> dict[str, np.ndarray]:
    """The wheel speeds, without noise, steps and repeats where the sensor's section gives none."""
    scenario = read_scenario("thesis_drive")
    ideal = {"noise_sd_m_s": 0.0, "resolution_m_s": 0.0, "repeat_share": 0.0}
    exact = WheelSpeedSensors.model_validate(ideal | sensor.model_dump(exclude_unset=True))
    read, _ = sense_wheel_speeds(scenario.truck, moving, exact, scenario.sensors.speed, chances())
    return {name.removeprefix("wheel_speed_"): speed for name, speed in read.items()}


def test_each_wheel_has_the_speed_of_its_position() -> None:
    truck, r, v = read_scenario("thesis_drive").truck, 0.1, 10.0
    angle = np.arctan(3.7 * r / v)  # rolls about a point on the rear axle's line
    turning = rows(1, vehicle_speed=v, yaw_rate=r, lateral_speed=r * (3.7 - 1.005), front_wheel_angle=angle)
    speed = {name: float(values[0]) for name, values in wheel_speeds(truck, turning).items()}
    radius = v / r
    for side, sign in (("left", -1), ("right", 1)):
        assert speed[f"wheel_speed_rear_{side}"] == pytest.approx(r * (radius + sign * 1.83 / 2), rel=1e-9)
        own = np.hypot(radius + sign * 2.05 / 2, 3.7)
        assert speed[f"wheel_speed_front_{side}"] == pytest.approx(r * own, rel=1e-3)  # its angle is the middle's


def test_a_larger_wheel_reads_less_and_in_a_left_turn_the_loaded_right_ones_read_more() -> None:
    straight, left = rows(10, vehicle_speed=20.0), rows(10, vehicle_speed=20.0, lateral_acceleration=2.0)
    larger = WheelSpeedSensors.model_validate({"radius_error_percent": {"front_left": 1.0}, "scale_error_percent": 2.0})
    read = wheels_of(larger, straight)
    assert read["front_left"] == pytest.approx(20.0 * 1.02 / 1.01)
    assert read["rear_right"] == pytest.approx(20.0 * 1.02)
    soft = WheelSpeedSensors(load_transfer_percent_m_s2=0.1)
    assert wheels_of(soft, straight)["rear_left"] == pytest.approx(20.0)
    read = wheels_of(soft, left)
    assert read["rear_right"] == pytest.approx(20.0 / 0.998)
    assert read["rear_left"] == pytest.approx(20.0 / 1.002)


def test_a_pole_wheel_counts_every_pulse_and_reads_zero_without_one_in_its_window() -> None:
    sensor = WheelSpeedSensors(pulses_per_turn=100, rolling_radius_m=0.5, pulse_window_s=0.02)
    speed = np.r_[np.zeros(100), np.linspace(0, 25, 2000), np.full(1000, 25.0), np.linspace(25, 0, 1000), np.zeros(100)]
    read = wheels_of(sensor, rows(len(speed), vehicle_speed=speed))["rear_left"]
    per_pulse_m = 2 * np.pi * 0.5 / 100
    assert (read[speed == 0] == 0).all()
    fast = speed > 2 * per_pulse_m / 0.02
    assert np.abs(read - speed)[fast].max() < 1.0  # 25 m/s^2 times the window's age
    assert np.abs(read[2200:3000] - 25.0).max() < 1e-9  # pulses are timed, so a steady speed is exact
    assert (read[(speed > 0) & (speed < 0.3 * per_pulse_m / 0.02)] == 0).mean() > 0.5
    assert read.sum() == pytest.approx(speed.sum(), rel=0.01)


def test_a_warming_wheel_grows_and_reads_less_with_its_time_constant() -> None:
    sensor = WheelSpeedSensors.model_validate(
        {"radius_warm_up_percent": {"rear_left": 0.4}, "radius_warm_up_time_min": 2.0, "radius_warm_up_begin_s": 60.0}
        | {"repeat_share": 0.0}
    )
    moving, scenario = rows(30_000, vehicle_speed=20.0), read_scenario("thesis_drive")
    read = wheels_of(sensor, moving)
    np.testing.assert_allclose(read["rear_right"], 20.0, rtol=1e-12)
    grown_percent = 100.0 * (20.0 / read["rear_left"] - 1.0)
    assert (np.abs(grown_percent[:6001]) < 1e-9).all()
    assert grown_percent[18_000] == pytest.approx(0.4 * 0.95, abs=0.001)  # two minutes later
    assert (np.diff(grown_percent[6000:]) > 0.0).all()
    _, faults = sense_wheel_speeds(scenario.truck, moving, sensor, scenario.sensors.speed, chances())
    assert [(f.signal, f.kind, f.begin_s) for f in faults] == [("wheel_speed_rear_left", "radius_warm_up", 60.0)]
    assert faults[0].size == pytest.approx(0.004, rel=0.01)


def test_a_share_of_frames_repeats_all_four_wheels_at_once_and_the_others_are_new() -> None:
    moving, noisy = rows(20_000, vehicle_speed=20.0), {"noise_sd_m_s": 0.04, "resolution_m_s": 0.0}
    fresh = wheels_of(WheelSpeedSensors.model_validate(noisy), moving)
    read = wheels_of(WheelSpeedSensors.model_validate(noisy | {"repeat_share": 0.3}), moving)
    repeats = {name: speed[2::2] == speed[:-2:2] for name, speed in read.items()}  # by frame
    for name, speed in read.items():
        np.testing.assert_array_equal(speed[::2], speed[1::2])  # nothing changes between two frames
        np.testing.assert_array_equal(repeats[name], repeats["front_left"])
        np.testing.assert_array_equal(speed[2::2][~repeats[name]], fresh[name][2::2][~repeats[name]])
    assert repeats["front_left"].mean() == pytest.approx(0.3, abs=0.02)


def test_wheel_noise_and_resolution_come_from_their_own_table_or_else_from_the_speed_s() -> None:
    moving = rows(20_000, vehicle_speed=20.0)
    speed = read_scenario("thesis_drive").sensors.speed.model_copy(update={"noise_sd_m_s": 0.1, "resolution_m_s": 0.5})
    truck = read_scenario("thesis_drive").truck
    own = WheelSpeedSensors(noise_sd_m_s=0.04, resolution_m_s=0.01, repeat_share=0.0)
    wheel = sense_wheel_speeds(truck, moving, own, speed, chances())[0]["wheel_speed_front_left"]
    assert wheel.std() == pytest.approx(0.04, rel=0.05)
    np.testing.assert_allclose(wheel / 0.01, np.round(wheel / 0.01), atol=1e-6)
    read, _ = sense_wheel_speeds(
        truck, moving, WheelSpeedSensors(noise_sd_m_s=None, resolution_m_s=None), speed, chances()
    )
    assert set(np.unique(read["wheel_speed_front_left"])) <= {19.5, 20.0, 20.5}


# The satellite receiver

HERE = {"latitude_deg": 59.2, "longitude_deg": 17.6}


def test_latitude_longitude_and_heading_lead_along_the_road_driven(drive: Drive) -> None:
    """Against integrated speed and yaw rate, and the definition of the ellipsoid."""
    signals, truth = drive(
        "[sensors.gnss]\nlatitude_deg = 59.2\nlongitude_deg = 17.6\nposition_sd_m = 0.0\nheading_sd_deg = 0.0\n"
    )
    r, v, v_y = (truth.table[c].to_numpy() for c in ("yaw_rate_rad_s", "vehicle_speed_m_s", "lateral_speed_m_s"))
    heading = np.pi / 2 - np.deg2rad(column(signals, "heading_deg")[0]) + np.cumsum(r) / 100
    over_ground = (v + 1j * v_y) * np.exp(1j * heading)
    path = np.cumsum(over_ground) / 100

    def earth_centred(latitude_deg: np.ndarray, longitude_deg: np.ndarray) -> np.ndarray:
        a, e2 = 6_378_137.0, 0.00669437999014
        phi, lam = np.deg2rad(latitude_deg), np.deg2rad(longitude_deg)
        n = a / np.sqrt(1 - e2 * np.sin(phi) ** 2)
        return np.stack([n * np.cos(phi) * np.cos(lam), n * np.cos(phi) * np.sin(lam), n * (1 - e2) * np.sin(phi)])

    moved = earth_centred(column(signals, "latitude_deg"), column(signals, "longitude_deg"))
    phi, lam = np.deg2rad(59.2), np.deg2rad(17.6)
    moved = moved - moved[:, :1]
    east = np.array([-np.sin(lam), np.cos(lam), 0.0]) @ moved
    north = np.array([-np.sin(phi) * np.cos(lam), -np.sin(phi) * np.sin(lam), np.cos(phi)]) @ moved
    assert np.abs(path).max() > 500
    np.testing.assert_allclose(east, path.real, atol=0.5)
    np.testing.assert_allclose(north, path.imag, atol=0.5)
    turned = np.angle(np.exp(1j * (np.pi / 2 - np.deg2rad(column(signals, "heading_deg")) - heading)))
    assert np.abs(turned).max() < 0.05 * DEGREE


def test_the_receiver_is_as_good_as_the_thesis_s() -> None:
    """RT3040: 0.1 deg and 0.5 m to one standard deviation, and errors that stay for a while."""
    still = rows(360_000)
    received = [sense_gnss(still, Gnss(**HERE), chances(seed))[0] for seed in range(10)]
    north_m = np.array([(r["latitude"] - 59.2) * 111_400 for r in received])
    heading_deg = np.array([(r["heading"] - 90.0 + 180) % 360 - 180 for r in received])
    assert north_m.std() == pytest.approx(0.5, rel=0.15)
    assert heading_deg.std() == pytest.approx(0.1, rel=0.1)
    for errors, lag in ((north_m, 6000), (heading_deg, 1000)):  # their correlation times
        assert np.mean(errors[:, lag:] * errors[:, :-lag]) / errors.var() == pytest.approx(np.exp(-1), abs=0.12)


# Real sensors


def without_sensors() -> Scenario:
    """The thesis's drive in a file that has no [sensors]."""
    values = tomllib.loads((Path(__file__).parents[1] / "scenarios" / "thesis_drive.toml").read_text(encoding="utf-8"))
    del values["sensors"]
    return scenario_from({"name": "real", **values}, "here")


def test_a_file_without_sensors_has_those_of_a_real_truck() -> None:
    turning = np.linspace(-1.0, 1.0, 40_000)  # the wheel: its noise alone would hardly reach the next step
    sensed = sense(without_sensors(), rows(40_000, vehicle_speed=20.0, steering_wheel_angle=turning), chances())
    assert [(f.signal, f.kind) for f in sensed.faults] == [("wheel_speed", "repeats")]
    steps = {
        "steering_wheel_angle_rad": 0.11 * DEGREE,
        "yaw_rate_rad_s": 0.028 * DEGREE,
        "lateral_acceleration_m_s2": 1 / 2048,
        "longitudinal_acceleration_m_s2": 0.1,
        "vehicle_speed_m_s": 1 / 256 / 3.6,
        "wheel_speed_rear_left_m_s": 0.125 / 3.6,
    }
    sds = dict(zip(steps, (0.02 * DEGREE, 0.025 * DEGREE, 0.1, 0.1, 0.01, 0.04), strict=True))
    for name, step in steps.items():
        read = column(sensed.signals, name)
        np.testing.assert_allclose(read / step, np.round(read / step), atol=1e-6, err_msg=name)
        true = turning if name.startswith("steering") else 20.0 if "speed" in name else 0.0
        assert (read - true).mean() == pytest.approx(0.0, abs=0.003), name
        rounded = np.hypot(sds[name], step / np.sqrt(12))
        assert (read - true).std() == pytest.approx(rounded, rel=0.05), name
    wheels = [column(sensed.signals, f"wheel_speed_rear_{side}_m_s")[::2] for side in ("left", "right")]
    assert 0.05 < (wheels[0] - wheels[1]).std() < 0.065  # as measured
    repeats = (np.diff(wheels[0]) == 0.0) & (np.diff(wheels[1]) == 0.0)
    assert 0.3 < repeats.mean() < 0.45  # some new values are the last ones again


def test_j1939_has_a_code_for_all_that_a_real_sensor_reads() -> None:
    sensors = without_sensors().sensors
    for farthest, scale, offset in (
        (sensors.steering_wheel_angle.range_deg * DEGREE, 1 / 1024, -31.374),
        (sensors.yaw_rate.range_deg_s * DEGREE, 1 / 8192, -3.92),
        (sensors.lateral_acceleration.range_m_s2, 1 / 2048, -15.687),
    ):
        sent = two_bytes(np.array([-farthest, farthest]), scale, offset).view("<u2")[:, 0] * scale + offset
        np.testing.assert_allclose(sent, [-farthest, farthest], atol=scale)
    ends = one_byte(np.array([-1.0, 1.0]) * sensors.longitudinal_acceleration.range_m_s2, 0.1, -12.5)
    np.testing.assert_allclose(ends * 0.1 - 12.5, [-12.5, 12.5])


# What is written and what is refused


def test_the_truth_file_lists_every_fault_with_time_and_size_in_degrees(
    scenario: Callable[[str], Path], tmp_path: Path
) -> None:
    truth = simulate_to_log(
        scenario(
            "[sensors.wheel_speed.radius_error_percent]\nrear_left = 0.4\n"
            "[[sensors.yaw_rate.remounts]]\nbegin_s = 30.0\nstep_deg_s = 1.5\n"
            "[[sensors.lateral_acceleration.failures]]\nbegin_s = 50.0\nlength_s = 10.0\n"
        ),
        1,
        tmp_path / "drive.csv.gz",
    )
    listed = tomllib.loads((tmp_path / "drive.truth.toml").read_text(encoding="utf-8"))["faults"]
    assert len(listed) == len(truth.faults)
    for entry in (
        {"signal": "wheel_speed_rear_left", "kind": "radius_error", "begin_s": 0.0, "end_s": 90.0, "size_percent": 0.4},
        {"signal": "yaw_rate", "kind": "remount", "begin_s": 30.0, "end_s": 90.0, "size_deg_s": 1.5},
        {"signal": "lateral_acceleration", "kind": "not_available", "begin_s": 50.0, "end_s": 60.0},
    ):
        assert entry in listed
    assert (tmp_path / "drive.truth.parquet").exists()


def test_the_scenarios_page_names_every_key_of_every_sensor() -> None:
    page = (Path(__file__).parents[1] / "scenarios" / "README.md").read_text(encoding="utf-8")
    base = (Path(__file__).parents[1] / "scenarios" / "thesis_drive.toml").read_text(encoding="utf-8")
    sections = [s for s in vars(sensor_sections).values() if isinstance(s, type) and issubclass(s, Section)]
    keys = {key for section in sections if section is not Sensors for key in section.model_fields}
    assert len(keys) > 40
    assert [key for key in sorted(keys) if f"`{key}`" not in page and f"\n{key} = " not in base] == []


@pytest.mark.parametrize(
    ("extra", "names"),
    [
        ("[[sensors.yaw_rate.failures]]\nbegin_s = 95.0", "sensors.yaw_rate.failures.begin_s"),
        ("[sensors.steering_wheel_angle.self_correction]\nbegin_s = 90.0", "self_correction.begin_s"),
        ("[sensors.steering_wheel_angle.self_correction]\nbegin_s = 9.0\nshare = 1.5", "self_correction.share"),
        ("[sensors.steering_wheel_angle.relative]\nturns = 3", "range_deg"),
        ("[sensors.steering_wheel_angle]\nhysteresis_deg = -1.0", "steering_wheel_angle.hysteresis_deg"),
        ("[sensors.yaw_rate]\nwarm_up_time_min = 0.0", "yaw_rate.warm_up_time_min"),
        ("[sensors.yaw_rate.dropouts]\nrate_1_h = 10.0\nlength_s = [3.0, 1.0]", "dropouts.length_s"),
        ("[[sensors.yaw_rate.failures]]\nbegin_s = 9.0\nsays = 'nothing'", "failures.0.says"),
        ("[sensors.wheel_speed.radius_error_percent]\nmiddle_left = 1.0", "radius_error_percent.middle_left"),
        ("[sensors.speed]\nlatency_s = 0.6", "speed.latency_s"),
        ("[sensors.yaw_rate]\nfilter_time_s = -0.1", "yaw_rate.filter_time_s"),
        ("[sensors.yaw_rate]\nscale_error_percent = 21.0", "yaw_rate.scale_error_percent"),
        ("[sensors.yaw_rate]\nscale_warm_up_percent = -21.0", "yaw_rate.scale_warm_up_percent"),
        ("[sensors.lateral_acceleration]\nroll_share = 1.1", "lateral_acceleration.roll_share"),
        ("[sensors.lateral_acceleration]\ntilt_deg = 11.0", "lateral_acceleration.tilt_deg"),
        ("[sensors.lateral_acceleration]\nturned_deg = -11.0", "lateral_acceleration.turned_deg"),
        ("[sensors.lateral_acceleration]\nahead_of_gravity_centre_m = 16.0", "ahead_of_gravity_centre_m"),
        ("[sensors.lateral_acceleration]\ntilt_deg = 5.0\nbias_m_s2 = 9.0", "range_m_s2"),
        ("[sensors.longitudinal_acceleration]\ntilt_deg = 1.0", "longitudinal_acceleration.tilt_deg"),
        ("[sensors.yaw_rate]\nhold_s = 6.0", "yaw_rate.hold_s"),
        ("[sensors.wheel_speed]\nrepeat_share = 1.0", "wheel_speed.repeat_share"),
        ("[sensors.wheel_speed]\nresolution_m_s = 9.0", "wheel_speed.resolution_m_s"),
        ("[sensors.wheel_speed]\nradius_warm_up_time_min = 0.0", "wheel_speed.radius_warm_up_time_min"),
        ("[sensors.wheel_speed]\nradius_warm_up_begin_s = 90.0", "sensors.wheel_speed.radius_warm_up_begin_s"),
        ("[sensors.wheel_speed.radius_warm_up_percent]\nrear_left = 30.0", "radius_warm_up_percent.rear_left"),
        ("[sensors.wheel_speed]\npulses_per_turn = -3", "wheel_speed.pulses_per_turn"),
        ("[sensors.gnss]\nlatitude_deg = 59.2", "gnss.longitude_deg"),
        ("[sensors.gnss]\nlatitude_deg = 95.0\nlongitude_deg = 0.0", "gnss.latitude_deg"),
        ("[sensors.compass]\nbias_deg = 1.0", "sensors.compass"),
    ],
)
def test_an_impossible_sensor_is_refused_by_name(drive: Drive, extra: str, names: str) -> None:
    with pytest.raises(OncenterError, match=re.escape(names)) as refusal:
        drive(extra + "\n")
    assert refusal.value.exit_code == 2
    assert "\n" not in str(refusal.value)
