"""5.3.1: the gyro's bias and the wheels' radii, estimated together, and their intervals."""

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from real_data import real_drive
from rolling import CORNERS, RATE_HZ, TRACK_REAR, Array, Truth, as_ebc2, core_of, course, rolling

from oncenter import _core
from oncenter._native import ffi, lib
from oncenter.read import read
from oncenter.signals import DEGREE
from oncenter.simulate import simulate, simulate_to_log

YAW_RATE = "yaw_rate_rad_s"
WHEELS = [f"wheel_speed_{corner}_m_s" for corner in CORNERS]
MINUTE = int(60 * RATE_HZ)
NOTHING_WANDERS = {
    "gyro_bias_wander_sd_rad_s": 0.0,
    "wheel_radius_wander_sd_1": 0.0,
    "gyro_bias_drift_first_sd_rad_s2": 0.0,
    "gyro_bias_drift_sd_rad_s2": 0.0,
    "gyro_bias_drift_standing_sd_rad_s2": 0.0,
}


def ran(core: _core.Core, columns: Mapping[str, Array]) -> tuple[_core.Core, np.ndarray[Any, Any]]:
    outputs = np.zeros(len(columns["time_s"]), _core.OUTPUT_DTYPE)
    core.run(columns, outputs)
    return core, outputs


def bias_of(columns: Mapping[str, Array], core: _core.Core | None = None) -> dict[str, Any]:
    return dict(ran(core or core_of(), columns)[0].answer()["yaw_rate_bias"])


def status(estimate: Mapping[str, Any]) -> str:
    return _core.STATUSES[estimate["status"]]


def holds(estimate: Mapping[str, Any], truth: float, by: float = 1.96) -> bool:
    return abs(estimate["value"] - truth) < by * estimate["standard_deviation"]


def test_bias_and_radii_are_estimated_together() -> None:
    for seed in range(5):
        answer = ran(core_of(), rolling(seed))[0].answer()
        assert answer["yaw_rate_bias"]["value"] == pytest.approx(0.005, abs=0.05 * DEGREE)
        assert answer["wheel_radius_mismatch_rear"]["value"] == pytest.approx(0.004, abs=1.5e-4)
        assert answer["wheel_radius_mismatch_front"]["value"] == pytest.approx(-0.003, abs=1.5e-4)
        assert status(answer["yaw_rate_bias"]) == "valid"


def test_the_filter_agrees_with_least_squares_over_the_whole_drive() -> None:
    """Two derivations: without random walks the recursion gives the result of all blocks at once."""
    columns = rolling(3, standing_s=0.0)
    rear_only = {name: c for name, c in columns.items() if "front" not in name}
    answer = ran(core_of(**NOTHING_WANDERS), rear_only)[0].answer()

    def blocks(values: Array) -> Array:
        return values.reshape(-1, int(RATE_HZ)).mean(axis=1)

    left, right = (columns[f"wheel_speed_rear_{side}_m_s"] for side in ("left", "right"))
    v, r = blocks(0.5 * (left + right)), blocks(columns[YAW_RATE])
    reading = r - blocks(right - left) / TRACK_REAR
    bank = 0.2  # m/s^2; the filter subtracts it once the bias is identified; its constant part is in the mismatch
    v_a = v * (blocks(columns["lateral_acceleration_m_s2"]) - bank)
    H = np.column_stack([np.ones_like(v), -v / TRACK_REAR, -v_a / TRACK_REAR, -(r - 0.005)])
    prior = np.diag([1.5 * DEGREE, 0.005, 0.003, 0.02]) ** 2
    noise = (2 * 0.01**2 / TRACK_REAR**2 + 0.002**2) / RATE_HZ + 2e-4**2
    P = np.linalg.inv(np.linalg.inv(prior) + H.T @ H / noise)
    x = P @ (H.T @ reading) / noise
    sd = math.sqrt(P[0, 0])
    assert answer["yaw_rate_bias"]["value"] == pytest.approx(x[0], abs=1.5 * sd)  # the bank was unknown at first
    assert answer["yaw_rate_bias"]["standard_deviation"] == pytest.approx(sd, rel=0.7)
    level = x[1] - bank * x[2]
    assert answer["wheel_radius_mismatch_rear"]["value"] == pytest.approx(level, abs=3.0 * math.sqrt(P[1, 1]))


def test_a_mirrored_drive_has_the_mirrored_bias() -> None:
    columns = rolling(1)
    other = {name.replace("left", "?").replace("right", "left").replace("?", "right"): c for name, c in columns.items()}
    mirrored = other | {n: -columns[n] for n in (YAW_RATE, "lateral_acceleration_m_s2", "steering_wheel_angle_rad")}
    there, back = ran(core_of(), columns)[0].answer(), ran(core_of(), mirrored)[0].answer()
    for name in ("yaw_rate_bias", "wheel_radius_mismatch_rear", "wheel_radius_mismatch_front"):
        assert back[name]["value"] == -there[name]["value"] != 0.0
        assert back[name]["standard_deviation"] == there[name]["standard_deviation"]


def test_half_a_second_of_standstill_identifies_the_bias() -> None:
    columns = {name: c[:80] for name, c in rolling(0).items()}
    outputs = ran(core_of(), columns)[1]
    assert outputs["yaw_rate_bias_sd"][60] > DEGREE
    assert outputs["yaw_rate_bias"][75] == pytest.approx(0.005, abs=0.05 * DEGREE)
    assert outputs["yaw_rate_bias_sd"][75] < 0.06 * DEGREE


def test_a_long_standstill_is_hardly_more_accurate_than_a_short_one() -> None:
    """Errors by quantisation and mounting do not average out."""
    quiet = rolling(0, truth=Truth(gyro_noise=1e-4), standing_s=60.0)
    standing = {name: c[:6000] for name, c in quiet.items()}
    outputs = ran(core_of(**NOTHING_WANDERS), standing)[1]
    assert 0.004 * DEGREE < outputs["yaw_rate_bias_sd"][-1] < 0.02 * DEGREE


def test_rolling_wheels_are_no_standstill_whatever_the_vehicle_speed() -> None:
    columns = {name: c[-500:] for name, c in rolling(0).items()}
    columns["vehicle_speed_m_s"] = np.zeros(500)
    columns |= {name: np.full(500, 1.0) for name in WHEELS}
    assert bias_of(columns)["evidence"] == pytest.approx(4.8)  # the thesis's standstill uses the vehicle speed
    outputs = ran(core_of(), columns)[1]
    assert outputs["yaw_rate_bias_sd"][-1] > DEGREE


def test_at_constant_speed_without_standstill_bias_and_radii_are_not_separable() -> None:
    """r - (v_r - v_l)/T is then one equation for two unknowns: the interval stays wide."""
    columns = rolling(2, standing_s=0.0, speeds_m_s=(22.0, 22.0))
    outputs = ran(core_of(), columns)[1]
    assert outputs["yaw_rate_bias_sd"][-1] > 0.5 * DEGREE
    assert abs(outputs["yaw_rate_bias"][-1] - 0.005) < 1.96 * outputs["yaw_rate_bias_sd"][-1]
    assert status(bias_of(columns)) == "unobservable"


def test_noise_in_the_wheels_does_not_narrow_the_track() -> None:
    """A constant bend with much noise would bias a track fitted to the wheels' difference, and with it the bias."""
    columns = rolling(4, truth=Truth(wheel_noise=0.2))
    speed = np.maximum(columns["vehicle_speed_m_s"], 0.0)
    more = 0.002 * speed
    columns[YAW_RATE] = columns[YAW_RATE] + more
    for axle, track in (("front", 2.05), ("rear", TRACK_REAR)):
        columns[f"wheel_speed_{axle}_left_m_s"] = columns[f"wheel_speed_{axle}_left_m_s"] - 0.5 * track * more
        columns[f"wheel_speed_{axle}_right_m_s"] = columns[f"wheel_speed_{axle}_right_m_s"] + 0.5 * track * more
    found = bias_of(columns)
    assert found["value"] == pytest.approx(0.005, abs=0.08 * DEGREE)
    assert holds(found, 0.005)


def test_without_a_track_width_the_wheels_still_identify_the_bias() -> None:
    found = bias_of(rolling(1), core_of(rear=0.0, front=0.0))
    assert found["value"] == pytest.approx(0.005, abs=0.05 * DEGREE)


@pytest.mark.parametrize("axle", ["front", "rear"])
def test_one_axle_is_enough(axle: str) -> None:
    columns = {name: c for name, c in rolling(1).items() if not name.startswith("wheel") or axle in name}
    found = bias_of(columns)
    assert found["value"] == pytest.approx(0.005, abs=0.06 * DEGREE)
    assert holds(found, 0.005)


def hurt(columns: dict[str, Array], how: str) -> dict[str, Array]:
    rng = np.random.default_rng(1)
    t = columns["time_s"]
    result = {name: c.copy() for name, c in columns.items()}
    if how == "stuck":
        result[WHEELS[2]][t > 100.0] = 0.0
    if how == "gaps":
        for begin in range(50, 350, 30):
            for name in WHEELS:
                result[name][(t > begin) & (t < begin + 15)] = np.nan
    if how == "slip":
        for begin in rng.uniform(30.0, 390.0, 25):
            slipping = (t > begin) & (t < begin + rng.uniform(0.2, 2.0))
            result[rng.choice(WHEELS)][slipping] *= 1 - rng.uniform(0.01, 0.3)
    return result


@pytest.mark.parametrize("how", ["stuck", "gaps", "slip"])
def test_a_faulty_wheel_speed_does_not_affect_the_bias(how: str) -> None:
    found = bias_of(hurt(rolling(5), how))
    assert found["value"] == pytest.approx(0.005, abs=0.06 * DEGREE)
    assert holds(found, 0.005, 2.5)


def test_a_jump_of_the_bias_is_detected_and_followed() -> None:
    columns = rolling(6)
    columns[YAW_RATE][20_000:] += 0.6 * DEGREE
    core, outputs = ran(core_of("joint"), columns)
    alarmed = outputs["reasons"] & lib.OC_REASON_YAW_RATE_BIAS > 0
    assert not alarmed[:20_000].any()
    assert alarmed[20_000:21_000].any()
    assert not alarmed[-5_000:].any()
    assert core.answer()["yaw_rate_bias"]["value"] == pytest.approx(0.005 + 0.6 * DEGREE, abs=0.06 * DEGREE)
    assert core.answer()["yaw_rate_bias_alarm_time"] == pytest.approx(np.sum(alarmed) / RATE_HZ, abs=1.1)
    assert _core.STATUSES[core.answer()["yaw_rate_bias"]["status"]] == "valid"
    meanwhile = 1 + int(np.flatnonzero(alarmed)[200])
    core, _ = ran(core_of("joint"), {name: column[:meanwhile] for name, column in columns.items()})
    assert _core.STATUSES[core.answer()["yaw_rate_bias"]["status"]] == "invalid"


def test_the_thesiss_method_does_not_use_wheel_speeds() -> None:
    """The same offset bit for bit with and without them, whatever the gyro's bias."""
    columns = rolling(6)
    columns[YAW_RATE][20_000:] += 0.6 * DEGREE
    without = {name: c for name, c in columns.items() if name not in WHEELS}
    there, back = ran(core_of(), columns)[0].answer(), ran(core_of(), without)[0].answer()
    about_the_gyro = {name for name in there if name.startswith(("yaw_rate", "wheel"))}
    assert {k: v for k, v in there.items() if k not in about_the_gyro} == {
        k: v for k, v in back.items() if k not in about_the_gyro
    }


def test_a_pressure_loss_is_not_attributed_to_the_gyro() -> None:
    """One wheel of four: the other axle keeps the bias."""
    columns = rolling(7)
    columns[WHEELS[2]][20_000:] *= 1.003
    found = ran(core_of(), columns)[0].answer()
    assert found["yaw_rate_bias"]["value"] == pytest.approx(0.005, abs=0.1 * DEGREE)
    assert found["wheel_radius_mismatch_rear"]["value"] == pytest.approx(0.001, abs=4e-4)


FIGURE_17 = """
base = "motorway"
[drive]
duration_s = 900.0
[road]
straight_length_m = [20000.0, 30000.0]
[driver]
speed_km_h = [84.0, 86.0]
[sensors.yaw_rate]
drift_deg_s_min = 0.5
[sensors.speed]
resolution_m_s = 0.001085 # 1/256 km/h
[sensors.wheel_speed]
resolution_m_s = 0.001085
[sensors.wheel_speed.radius_error_percent]
rear_left = 0.4
front_right = 0.3
"""


def errors(outputs: np.ndarray[Any, Any], true: Array) -> tuple[Array, Array]:
    """Error and standard deviation every 10 s from the third minute on, in deg/s."""
    rows = slice(3 * MINUTE, None, int(10 * RATE_HZ))
    return (outputs["yaw_rate_bias"] - true)[rows] / DEGREE, outputs["yaw_rate_bias_sd"][rows] / DEGREE


def test_a_bias_that_drifts_on_a_long_straight_is_followed(tmp_path: Path) -> None:
    """Figure 17, half a degree per second per minute, with HRW's fine wheel speeds."""
    (tmp_path / "straight.toml").write_text(FIGURE_17)
    for seed in (31, 32):
        signals, truth = simulate(tmp_path / "straight.toml", seed=seed)
        columns = {name: signals.table[name].to_numpy() for name in _core.COLUMNS if name in signals.table.columns}
        error, sd = errors(ran(core_of(), columns)[1], truth.table["yaw_rate_bias_rad_s"].to_numpy())
        assert np.abs(error).max() < 0.1
        assert np.mean(np.abs(error) < 1.96 * sd) > 0.9


def test_with_coarse_wheel_speeds_a_late_drift_is_followed_or_raises_an_alarm() -> None:
    """EBC2: steps of half a degree per second. The filter lags until the CUSUM's alarm, and only for a short time."""
    late = Truth(drift=0.5 * DEGREE / 60, drift_from_s=400.0)
    for seed in range(3):
        columns = as_ebc2(rolling(seed, 900.0, late, speeds_m_s=(22.0, 24.0), turning=0.3))
        outputs = ran(core_of("joint"), columns)[1]
        off = np.abs(outputs["yaw_rate_bias"] - course(columns["time_s"], late)) / DEGREE
        silent = outputs["reasons"] & lib.OC_REASON_YAW_RATE_BIAS == 0
        driving = columns["time_s"] > 120.0
        assert off[driving & silent].max() < 0.35
        assert np.mean(off[driving & silent] > 0.15) < 0.1
        assert off[-1] < 0.2


@pytest.mark.parametrize(("share", "within_deg_s"), [(0.002, 0.12), (-0.005, 0.3)])
def test_a_slow_pressure_loss_is_not_attributed_to_a_gyro_drift(share: float, within_deg_s: float) -> None:
    """A rear radius shrinks over ten minutes: the axles contradict each other, and both mismatches get variance."""
    off = []
    for seed in range(6):
        columns = rolling(seed, 900.0)
        columns["wheel_speed_rear_left_m_s"] *= 1.0 + share * np.clip((columns["time_s"] - 200.0) / 600.0, 0.0, 1.0)
        off.append(abs(bias_of(columns, core_of("joint"))["value"] - 0.005) / DEGREE)
    assert np.median(off) < within_deg_s, off


@pytest.mark.parametrize("banked", [0.0, 0.6])
def test_gaps_of_the_accelerometer_cost_their_ticks_and_add_no_bias(banked: float) -> None:
    off = []
    for seed in range(6):
        columns = rolling(seed, 600.0, banked=banked)
        t = columns["time_s"]
        columns["lateral_acceleration_m_s2"][(t > 60.0) & (t % 20.0 < 6.0)] = np.nan
        off.append(abs(bias_of(columns, core_of("joint"))["value"] - 0.005) / DEGREE)
    assert max(off) < 0.03, off


@pytest.mark.parametrize("method", ["joint", "wheel-speed"])
def test_without_an_accelerometer_the_yaw_rate_gives_the_load_transfer(method: str) -> None:
    """Both for an unused accelerometer and for none."""
    off = []
    for seed in range(6):
        columns = rolling(seed, 600.0)
        core = core_of(method, use_accelerometer=0)
        bias = bias_of(columns, core)
        off.append(abs(bias["value"] - 0.005) / DEGREE)
        assert core.answer()["yaw_rate_bias_alarm_time"] == 0.0
        del columns["lateral_acceleration_m_s2"]
        assert bias_of(columns, core_of(method, use_accelerometer=0)) == bias
    assert max(off) < 0.06, off


def test_the_wheels_are_used_without_an_accelerometer_since_ignition_or_for_minutes() -> None:
    for ignition in (True, False):
        core = core_of("joint")
        core.run(rolling(1, 300.0))
        columns = rolling(2, 400.0, Truth(bias=0.008) if ignition else None, standing_s=5.0 if ignition else 0.0)
        columns["lateral_acceleration_m_s2"][:] = np.nan
        if ignition:
            core.restart()
        else:
            columns["time_s"] += 300.0
        before = core.answer()["yaw_rate_bias"]["evidence"]
        found = bias_of(columns, core)
        assert abs(found["value"] - (0.008 if ignition else 0.005)) < 0.06 * DEGREE
        assert found["evidence"] > before + (300.0 if ignition else 200.0)


@pytest.mark.parametrize("uses_accelerometer", [0, 1])
def test_without_a_lateral_acceleration_the_wheel_speeds_method_uses_the_yaw_rate(uses_accelerometer: int) -> None:
    columns = rolling(1, 600.0)
    del columns["lateral_acceleration_m_s2"]
    bias = bias_of(columns, core_of("wheel-speed", use_accelerometer=uses_accelerometer))
    assert bias["value"] == pytest.approx(0.005, abs=0.06 * DEGREE)


def test_the_interval_includes_a_persistent_rounding_error() -> None:
    """Noise-free wheels with EBC2's steps of half a degree per second: the same error for seconds."""
    for seed in range(6):
        rough = rolling(seed, 600.0, Truth(wheel_noise=0.0), speeds_m_s=(22.0, 22.5), turning=0.1)
        outputs = ran(core_of(), as_ebc2(rough))[1]
        off = np.abs(outputs["yaw_rate_bias"] - 0.005)[MINUTE::1000]
        assert np.mean(off < 1.96 * outputs["yaw_rate_bias_sd"][MINUTE::1000]) > 0.9
        assert outputs["yaw_rate_bias_sd"][-1] > 0.05 * DEGREE


def test_a_log_of_frames_gives_the_same_bias_by_either_message(tmp_path: Path) -> None:
    """HRW's and EBC2's wheel speeds of one drive, written to a CAN log and read."""
    scenario = tmp_path / "drive.toml"
    scenario.write_text('base = "thesis_drive"\n[drive]\nduration_s = 500.0\n')
    log = tmp_path / "drive.log"
    truth = simulate_to_log(scenario, 33, log)
    frames = log.read_text().splitlines(keepends=True)
    for source, other, within in (("HRW", "18FEBF0B", 0.05), ("EBC2", "08FE6E0B", 0.12)):
        log.write_text("".join(line for line in frames if other not in line))
        signals = read(log)
        assert source in signals.sources["wheel_speed_rear_left"].description
        columns = {name: signals.table[name].to_numpy() for name in _core.COLUMNS if name in signals.table.columns}
        found = bias_of({name: c[: -20 * int(RATE_HZ)] for name, c in columns.items()})  # before the next standstill
        assert found["value"] / DEGREE == pytest.approx(truth.yaw_rate_bias_rad_s / DEGREE, abs=within)
        assert holds(found, truth.yaw_rate_bias_rad_s, 2.5)


def test_the_intervals_hold_the_truth_at_their_nominal_rate() -> None:
    inside = total = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        truth = dataclasses.replace(
            Truth(),
            bias=rng.normal(0, DEGREE),
            mismatch_rear=rng.normal(0, 0.004),
            mismatch_front=rng.normal(0, 0.004),
            drift=rng.normal(0, 0.1 * DEGREE / 60),
        )
        columns = rolling(seed, 300.0, truth, standing_s=5.0 if seed % 2 else 0.0)
        outputs = ran(core_of(), columns)[1]
        rows = slice(3000, None, 1500)
        off = outputs["yaw_rate_bias"] - course(columns["time_s"], truth)
        inside += int(np.sum((np.abs(off) < 1.96 * outputs["yaw_rate_bias_sd"])[rows]))
        total += len(off[rows])
    assert inside > 0.9 * total, inside / total


def test_without_wheels_the_uncertainty_grows_after_the_last_standstill() -> None:
    columns = {name: c for name, c in rolling(0).items() if name not in WHEELS}
    outputs = ran(core_of(), columns)[1]
    sd = outputs["yaw_rate_bias_sd"] / DEGREE
    assert sd[500] < 0.03
    assert (np.diff(sd[600::100]) > 0).all()
    assert sd[-1] > 0.05
    assert outputs["yaw_rate_bias"][-1] == pytest.approx(0.005, abs=0.02 * DEGREE)


def test_an_ignition_adds_uncertainty_to_the_bias() -> None:
    core, outputs = ran(core_of(), rolling(0))
    before = outputs["yaw_rate_bias_sd"][-1]
    core.restart()
    columns = {name: c[-100:] for name, c in rolling(0).items()}
    columns["time_s"] = columns["time_s"] - 1e6
    after = ran(core, columns)[1]
    assert after["yaw_rate_bias_sd"][0] == pytest.approx(math.hypot(before, 0.1 * DEGREE), rel=0.05)
    assert after["yaw_rate_bias"][0] == pytest.approx(0.005, abs=0.05 * DEGREE)
    assert core.answer()["wheel_radius_mismatch_rear"]["value"] == pytest.approx(0.004, abs=2e-4)


def test_a_run_is_its_steps_with_wheels_as_well() -> None:
    columns = {name: c[::3][:2500] for name, c in hurt(rolling(1, 100.0), "gaps").items()}
    whole, steps = core_of("joint"), core_of("joint")
    outputs = ran(whole, columns)[1]
    rows = np.column_stack(list(columns.values())).tolist()
    singly = [steps.step(dict(zip(columns, row, strict=True))) for row in rows]
    assert whole.state_bytes() == steps.state_bytes()
    assert [tick["yaw_rate_bias"] for tick in singly] == outputs["yaw_rate_bias"].tolist()


ODD = st.sampled_from([math.nan, math.inf, -math.inf, 1e308, -1e308, 0.0, 149.0, -149.0, 5e-324, 20.0, 20.001, 3.0])
OF_WHEELS = [name for name in _core.COLUMNS if name not in ("time_s", "lateral_speed_m_s", "steering_wheel_torque_nm")]


@settings(max_examples=100)
@given(rows=st.lists(st.tuples(*[ODD] * len(OF_WHEELS)), min_size=1, max_size=20), repeats=st.integers(1, 200))
def test_no_wheel_speed_gives_a_nan(rows: list[tuple[float, ...]], repeats: int) -> None:
    table = np.repeat(np.array(rows), repeats, axis=0)
    columns = {"time_s": np.arange(len(table)) / RATE_HZ} | dict(zip(OF_WHEELS, table.T, strict=True))
    for method in ("joint", "wheel-speed"):
        core, outputs = ran(core_of(method, gyro_bias_sd_rad_s=1e-4), columns)
        assert np.isfinite(outputs["yaw_rate_bias"]).all()
        assert np.isfinite(outputs["yaw_rate_bias_sd"]).all()
        answer = core.answer()
        for name in ("offset", "yaw_rate_bias", "wheel_radius_mismatch_rear", "wheel_radius_mismatch_front"):
            assert all(map(math.isfinite, answer[name].values())), name


@pytest.mark.parametrize(
    ("name", "bias"), [("cpg_fast_lap", 0.253), ("cpg_slow_lap", 0.292), ("rfs_2018-06-20_path3", 0.278)]
)
def test_a_second_of_standstill_of_a_real_car_identifies_its_bias(name: str, bias: float) -> None:
    """deg/s; by the OxTS heading 0.257, 0.297 and 0.295."""
    table = pl.read_csv(real_drive(f"genesis/{name}.csv.gz"))
    columns = {
        "time_s": table["t_s"].to_numpy(),
        YAW_RATE: table["yaw_rate_dps"].to_numpy() * DEGREE,
        "vehicle_speed_m_s": table["speed_ref_mps"].to_numpy(),
    }
    outputs = ran(core_of(), columns)[1]
    assert outputs["yaw_rate_bias"][-1] / DEGREE == pytest.approx(bias, abs=0.02)
    assert outputs["yaw_rate_bias_sd"][-1] < 0.05 * DEGREE


def test_the_state_is_small_enough_for_any_control_unit() -> None:
    assert ffi.sizeof("oc_gyro_bias") <= 1200  # bytes, of the 16 KiB that all states may have
