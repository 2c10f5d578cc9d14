"""Healthy drives stay silent; each fault that is planted in one is named, and only that one."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from real_data import real_drive

import oncenter
from oncenter.cli import run
from oncenter.findings import Finding
from oncenter.plausibility import check
from oncenter.plausibility.presence import resolution
from oncenter.signals import DEGREE, SIGNALS, Signals, Source
from oncenter.vehicle import Vehicle

EXAMPLES = Path(__file__).parents[1] / "examples"
RATE_HZ = 50.0
TRUCK = Vehicle(wheelbase_m=3.7, steering_ratio=19.3, track_width_rear_m=1.83)
K_US = 0.86 * DEGREE  # rad/(m/s^2) at the road wheel

Fault = Callable[[Signals], Signals]


def drive(
    seed: int = 1,
    duration_s: float = 300.0,
    bends: float = 1.0,
    play_deg: float = 3.0,
    lag_s: float = 0.15,
    swing: float = 9.5,
) -> Signals:
    """A truck with offset, understeer, play, lag and noise: stands, then goes at 12.5 m/s and up to `swing` off."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, duration_s, 1 / RATE_HZ)
    v = np.where(t < 5, 0.0, 12.5 + swing * np.sin(2 * np.pi * (t - 5) / 110 - np.pi / 2))
    road = sum(np.sin(2 * np.pi * t / period + rng.uniform(0, 6)) for period in (7.0, 19.0, 31.0)) / 1.7
    a_y = bends * 1.6 * road * np.minimum((v / 10) ** 2, 1.0)
    curvature = a_y / np.maximum(v, 1.0) ** 2
    wheel = 19.3 * (3.7 * curvature + K_US * a_y)
    play = np.clip(a_y / 0.1, -1, 1) * play_deg / 2 * DEGREE
    angle = later(wheel + play, -lag_s, t) + 2.0 * DEGREE + 0.1 * DEGREE * rng.standard_normal(len(t))
    r = curvature * v
    columns = {
        "steering_wheel_angle": np.round(angle * 1024) / 1024,
        "yaw_rate": np.round((r + 0.1 * DEGREE * rng.standard_normal(len(t))) * 8192) / 8192,
        "vehicle_speed": v,
        "lateral_acceleration": r * v + 0.15 + 0.1 * rng.standard_normal(len(t)),
        "wheel_speed_front_left": v - r * 1.02,
        "wheel_speed_front_right": v + r * 1.02,
        "wheel_speed_rear_left": v - r * 0.915 + 0.01 * rng.standard_normal(len(t)),
        "wheel_speed_rear_right": v + r * 0.915 + 0.01 * rng.standard_normal(len(t)),
        "steering_wheel_angle_sensor_type": np.ones_like(t),
    }
    table = pl.DataFrame({"time_s": t, **{SIGNALS[name].column: values for name, values in columns.items()}})
    sources = {name: Source("VDC2 from 0x3E", RATE_HZ, len(t), 0) for name in columns}
    return Signals(table, sources, RATE_HZ, "synthetic")


def later(x: np.ndarray, by_s: float, t: np.ndarray) -> np.ndarray:
    return np.interp(t - by_s, t, x)


def changed(signals: Signals, name: str, change: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Signals:
    """One signal put through `change(values, time)`."""
    column = SIGNALS[name].column
    new = change(signals.table[column].to_numpy(), signals.table["time_s"].to_numpy())
    return replace(signals, table=signals.table.with_columns(pl.Series(column, new)))


def without(signals: Signals, *names: str) -> Signals:
    kept = {name: source for name, source in signals.sources.items() if name not in names}
    return replace(signals, table=signals.table.drop(SIGNALS[name].column for name in names), sources=kept)


def wheels_swapped(signals: Signals) -> Signals:
    """Left for right."""
    other = {"left": "right", "right": "left"}
    swap = {name: re.sub("left|right", lambda side: other[side[0]], name) for name in signals.table.columns}
    return replace(signals, table=signals.table.rename(swap))


def scaled(name: str, factor: float) -> Fault:
    return lambda signals: changed(signals, name, lambda x, t: x * factor)


def delayed(name: str, by_s: float) -> Fault:
    return lambda signals: changed(signals, name, lambda x, t: later(x, by_s, t))


def shifted(name: str, by: float) -> Fault:
    return lambda signals: changed(signals, name, lambda x, t: x + by)


def in_steps(name: str, step: float) -> Fault:
    return lambda signals: changed(signals, name, lambda x, t: np.round(x / step) * step)


def held(name: str, from_s: float) -> Fault:
    return lambda signals: changed(signals, name, lambda x, t: np.where(t > from_s, x[np.argmax(t > from_s)], x))


def both(*faults: Fault) -> Fault:
    def apply(signals: Signals) -> Signals:
        for fault in faults:
            signals = fault(signals)
        return signals

    return apply


def only(findings: tuple[Finding, ...]) -> Finding:
    assert len(findings) == 1, [finding.text for finding in findings]
    return findings[0]


WHEELS = tuple(name for name in SIGNALS if name.startswith("wheel_speed"))


@pytest.mark.parametrize("seed", range(8))
def test_a_healthy_drive_is_silent_and_all_is_judged(seed: int) -> None:
    judged = check(drive(seed), TRUCK)
    assert judged.findings == ()
    assert judged.cannot_tell == ()


def test_a_healthy_drive_seen_in_a_mirror_is_silent() -> None:
    turns = ("steering_wheel_angle", "yaw_rate", "lateral_acceleration")
    mirror = both(wheels_swapped, *(scaled(name, -1.0) for name in turns))
    assert check(mirror(drive()), TRUCK).findings == ()


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("steering_wheel_angle", "the steering wheel angle has its sign reversed"),
        ("yaw_rate", "the yaw rate has its sign reversed"),
        ("lateral_acceleration", "the lateral acceleration has its sign reversed"),
    ],
)
def test_the_reversed_witness_is_outvoted(name: str, said: str) -> None:
    finding = only(check(scaled(name, -1.0)(drive()), TRUCK).findings)
    assert finding.code == "sign_reversed"
    assert finding.text.startswith(said)


def test_swapped_wheels_are_a_reversed_sign() -> None:
    finding = only(check(wheels_swapped(drive()), TRUCK).findings)
    assert "rear wheel speeds has its sign reversed" in finding.text


def test_two_witnesses_alone_cannot_say_who_is_reversed() -> None:
    pair = without(scaled("yaw_rate", -1.0)(drive()), *WHEELS, "lateral_acceleration")
    finding = check(pair, TRUCK).findings[0]
    assert finding.code == "sign_reversed"
    assert finding.text.startswith("either the ")


@pytest.mark.parametrize(
    ("name", "factor", "said"),
    [
        ("steering_wheel_angle", 1 / DEGREE, "steering wheel angle is too large by 57.3 (deg taken for rad)"),
        ("steering_wheel_angle", DEGREE, "steering wheel angle is too small by 57.3 (rad taken for deg)"),
        ("yaw_rate", 1 / DEGREE, "yaw rate is too large by 57.3 (deg/s taken for rad/s)"),
        ("yaw_rate", DEGREE, "yaw rate is too small by 57.3 (rad/s taken for deg/s)"),
        ("vehicle_speed", 3.6, "vehicle speed is too large by 3.6 (km/h taken for m/s)"),
        ("vehicle_speed", 1 / 3.6, "vehicle speed is too small by 3.6 (m/s taken for km/h)"),
        ("lateral_acceleration", 9.80665, "lateral acceleration is too large by 9.81 (m/s^2 taken for g)"),
        ("lateral_acceleration", 1 / 9.80665, "lateral acceleration is too small by 9.81 (g taken for m/s^2)"),
    ],
)
@pytest.mark.parametrize("wheels", [True, False], ids=["with wheel speeds", "without"])
def test_a_unit_mix_up_is_named(name: str, factor: float, said: str, wheels: bool) -> None:
    whole = drive() if wheels else without(drive(), *WHEELS)
    scales = [f for f in check(scaled(name, factor)(whole), TRUCK).findings if f.code == "scale"]
    assert said in only(tuple(scales)).text
    assert ", or " not in scales[0].text


def test_wheel_speeds_in_km_h_are_named() -> None:
    fault = both(*(scaled(name, 3.6) for name in WHEELS))
    assert "wheel speeds are too large by 3.6" in only(check(fault(drive()), TRUCK).findings).text


def test_angle_and_yaw_rate_alone_share_the_blame() -> None:
    pair = without(scaled("steering_wheel_angle", 1 / DEGREE)(drive()), *WHEELS, "lateral_acceleration")
    text = check(pair, TRUCK).findings[0].text
    assert "steering wheel angle is too large by 57.3" in text
    assert "yaw rate is too small by 57.3" in text


@pytest.mark.parametrize(
    ("name", "by_s", "code", "lag_ms"),
    [
        ("steering_wheel_angle", 0.425, "lag_yaw_rate", -275),
        ("lateral_acceleration", 0.5, "lag_lateral_acceleration", 500),
        ("lateral_acceleration", -0.8, "lag_lateral_acceleration", -800),
    ],
)
def test_a_late_signal_is_named_with_its_lag(name: str, by_s: float, code: str, lag_ms: float) -> None:
    finding = only(check(delayed(name, by_s)(drive()), TRUCK).findings)
    assert finding.code == code
    assert finding.unit == "ms"
    assert finding.value == pytest.approx(lag_ms, abs=15)


@pytest.mark.parametrize("scenario", ["thesis_drive", "town", "country", "motorway", "heavy_play"])
@pytest.mark.parametrize("seed", [1, 2])
def test_a_healthy_truck_is_told_neither_another_ratio_nor_a_lag(scenario: str, seed: int) -> None:
    """Side slip makes the accelerometer lead r*v in town, and a crown hangs the wheels on one flank of the play."""
    signals, _ = oncenter.simulate(scenario, seed)
    codes = {finding.code for finding in check(signals, oncenter.vehicle("scania_r730_4x2")).findings}
    assert not codes & {"ratio_times_wheelbase", "lag_yaw_rate", "lag_lateral_acceleration"}


@pytest.mark.parametrize("worn", [-0.004, 0.004])
def test_tyres_worn_unlike_on_a_road_that_hardly_bends_are_no_mix_up_of_units_or_signs(worn: float) -> None:
    """4 per mille of the speed, which goes with the yaw rate where all bends are to one side."""
    gentle = drive(bends=0.03)
    speed = gentle.table["vehicle_speed_m_s"].to_numpy()
    turning = changed(gentle, "yaw_rate", lambda x, t: x + 0.0005 * speed)
    on_worn = changed(turning, "wheel_speed_rear_right", lambda x, t: x + (0.0005 * 1.83 + worn) * speed)
    assert not {"scale", "sign_reversed"} & {finding.code for finding in check(on_worn, TRUCK).findings}
    mixed_up = changed(changed(drive(), "wheel_speed_rear_right", lambda x, t: 1.004 * x), "yaw_rate", in_degrees)
    assert "scale" in {finding.code for finding in check(mixed_up, TRUCK).findings}


def in_degrees(x: np.ndarray, t: np.ndarray) -> np.ndarray:
    return x / DEGREE


@pytest.mark.parametrize("name", ["yaw_rate", "lateral_acceleration"])
def test_a_signal_twice_or_half_as_large_is_told_and_no_ratio_is_blamed(name: str) -> None:
    factor = 2.0 if name == "yaw_rate" else 0.5
    for scenario in ("thesis_drive", "town", "country"):
        signals = scaled(name, factor)(oncenter.simulate(scenario, 1)[0])
        codes = {finding.code for finding in check(signals, oncenter.vehicle("scania_r730_4x2")).findings}
        assert "scale" in codes and "ratio_times_wheelbase" not in codes


def dead(x: np.ndarray, t: np.ndarray) -> np.ndarray:
    return 0.05 * np.random.default_rng(5).standard_normal(len(x))


@pytest.mark.parametrize(
    "fault",
    [
        lambda signals: without(signals, "lateral_acceleration"),
        lambda signals: changed(signals, "lateral_acceleration", lambda x, t: np.full_like(x, np.nan)),
        lambda signals: changed(signals, "lateral_acceleration", dead),
        held("lateral_acceleration", 600.0),
        lambda signals: changed(signals, "lateral_acceleration", lambda x, t: x + 1.5 * t / t[-1]),
    ],
    ids=["not in the log", "no number", "dead", "stuck", "drifting"],
)
def test_no_ratio_is_blamed_for_an_accelerometer_that_is_missing_or_at_fault(fault: Fault) -> None:
    for scenario, seed in (("country", 1), ("country", 2), ("town", 1)):
        signals = fault(oncenter.simulate(scenario, seed)[0])
        codes = {finding.code for finding in check(signals, oncenter.vehicle("scania_r730_4x2")).findings}
        assert "ratio_times_wheelbase" not in codes


def test_ratio_times_wheelbase_is_told_wherever_the_accelerometer_has_its_zero_and_in_town_without_one() -> None:
    truck = oncenter.vehicle("scania_r730_4x2")
    on_country, in_town = oncenter.simulate("country", 1)[0], oncenter.simulate("town", 1)[0]
    for signals in (shifted("lateral_acceleration", 0.4)(on_country), without(in_town, "lateral_acceleration")):
        shown = [each for each in check(signals).findings if each.code == "ratio_times_wheelbase"]
        assert only(tuple(shown)).value == pytest.approx(truck.ratio_near_centre * truck.wheelbase_m, rel=0.03)


def test_a_drive_on_a_crown_tells_ratio_times_wheelbase_within_three_per_cent() -> None:
    truck = oncenter.vehicle("scania_r730_4x2")
    for seed in (1, 2, 3, 4):
        signals, _ = oncenter.simulate("country", seed)
        shown = [each for each in check(signals).findings if each.code == "ratio_times_wheelbase"]
        assert only(tuple(shown)).value == pytest.approx(truck.ratio_near_centre * truck.wheelbase_m, rel=0.03)


@pytest.mark.parametrize("ratio", [14.0, 17.0, 22.0])
def test_a_wrong_ratio_in_the_vehicle_file_is_told_with_the_right_one(ratio: float) -> None:
    finding = only(check(drive(), TRUCK.model_copy(update={"steering_ratio": ratio})).findings)
    assert finding.code == "ratio_times_wheelbase"
    assert finding.severity == "warning"
    assert finding.value == pytest.approx(19.3 * 3.7, rel=0.05)
    assert float(finding.text.split()[-1]) == pytest.approx(19.3, rel=0.05)


@pytest.mark.parametrize("habit", [{"play_deg": 15.0}, {"lag_s": 0.4}, {"lag_s": 0.0}], ids=str)
@pytest.mark.parametrize("seed", range(4))
def test_neither_play_nor_lag_is_taken_for_another_ratio(seed: int, habit: dict[str, float]) -> None:
    finding = only(check(drive(seed, **habit)).findings)
    assert finding.code == "ratio_times_wheelbase"
    assert finding.value == pytest.approx(19.3 * 3.7, rel=0.015)


def test_a_gyro_bias_is_not_taken_for_another_ratio() -> None:
    biased = shifted("yaw_rate", 1.0 * DEGREE)(drive(duration_s=100.0))
    shown = [finding for finding in check(biased).findings if finding.code == "ratio_times_wheelbase"]
    assert only(tuple(shown)).value == pytest.approx(19.3 * 3.7, rel=0.015)


def test_at_one_speed_the_ratio_cannot_be_told_from_understeer() -> None:
    judged = check(drive(swing=0.5), TRUCK)
    assert judged.findings == ()
    assert "ratio times wheelbase" in {verdict.check for verdict in judged.cannot_tell}


def test_a_ratio_that_noise_blurs_is_not_judged() -> None:
    noise = np.random.default_rng(2).standard_normal(round(60 * RATE_HZ)) * 6.0 * DEGREE
    blurred = changed(drive(duration_s=60.0), "yaw_rate", lambda x, t: x + noise)
    judged = check(blurred, TRUCK.model_copy(update={"steering_ratio": 30.0}))
    assert "ratio_times_wheelbase" not in {finding.code for finding in judged.findings}
    assert "ratio times wheelbase" in {verdict.check for verdict in judged.cannot_tell}


def test_without_a_vehicle_file_the_drive_tells_ratio_times_wheelbase() -> None:
    finding = only(check(drive()).findings)
    assert finding.severity == "info"
    assert finding.value == pytest.approx(19.3 * 3.7, rel=0.05)


def test_wheels_that_turn_faster_than_the_vehicle_goes_are_told() -> None:
    finding = only(check(both(*(scaled(name, 1.08) for name in WHEELS))(drive()), TRUCK).findings)
    assert finding.code == "wheel_speed"
    assert finding.value == pytest.approx(8.0, abs=0.2)


def test_a_vehicle_speed_that_stays_at_zero_while_the_wheels_turn_is_an_error() -> None:
    finding = only(check(scaled("vehicle_speed", 0.0)(drive(bends=0.0)), TRUCK).findings)
    assert (finding.code, finding.severity) == ("wheel_speed", "error")


def test_a_yaw_rate_that_is_not_zero_at_standstill_is_told() -> None:
    finding = only(check(shifted("yaw_rate", 0.25 * DEGREE)(drive()), TRUCK).findings)
    assert finding.code == "yaw_rate_bias"
    assert finding.value == pytest.approx(0.25, abs=0.02)
    assert "32127" not in finding.text


@pytest.mark.parametrize(("source", "named"), [("VDC2 from 0x3E", True), ("column yaw_rate_deg_s", False)])
def test_the_known_zero_of_vdc2_is_named_where_the_yaw_rate_is_from_there(source: str, named: bool) -> None:
    signals = shifted("yaw_rate", (32127 - 32112.64) / 8192)(drive())
    sources = {**signals.sources, "yaw_rate": Source(source, RATE_HZ, 1000, 0)}
    finding = only(check(replace(signals, sources=sources), TRUCK).findings)
    assert finding.value == pytest.approx(0.10, abs=0.01)
    assert ("32127" in finding.text) is named


def test_an_accelerometer_bias_is_told_at_standstill_and_at_speed() -> None:
    findings = check(shifted("lateral_acceleration", -0.75)(drive()), TRUCK).findings
    assert {f.code for f in findings} == {"lateral_acceleration_at_standstill", "bank"}
    assert all(f.value == pytest.approx(-0.6, abs=0.05) for f in findings)


@pytest.mark.parametrize("name", ["steering_wheel_angle", "yaw_rate", "lateral_acceleration"])
def test_a_stuck_signal_is_told(name: str) -> None:
    codes = {finding.code for finding in check(held(name, 200.0)(drive()), TRUCK).findings}
    assert "signal_stuck" in codes


def noisy(signals: Signals) -> Signals:
    """A vehicle speed of which no number recurs, as an interpolated one."""
    noise = 0.01 * np.random.default_rng(3).standard_normal(signals.table.height)
    return changed(signals, "vehicle_speed", lambda x, t: np.where(x > 0.0, x + noise, x))


def wheels_held(signals: Signals, from_s: float) -> Signals:
    return both(*(held(name, from_s) for name in WHEELS))(signals)


@pytest.mark.parametrize("fine", [True, False])
@pytest.mark.parametrize("unheard", [(), WHEELS])
def test_a_stuck_vehicle_speed_is_told_by_the_wheels_or_where_it_has_fine_steps(
    unheard: tuple[str, ...], fine: bool
) -> None:
    signals = noisy(drive()) if fine else in_steps("vehicle_speed", 1 / 256 / 3.6)(drive())
    stuck = without(held("vehicle_speed", 150.0)(signals), *unheard)
    assert "signal_stuck" in {finding.code for finding in check(stuck, TRUCK).findings}


def test_a_stuck_vehicle_speed_is_told_where_the_wheels_are_stuck_with_it_or_go_steadily() -> None:
    steady = drive(swing=0.1)
    for stuck in (
        wheels_held(held("vehicle_speed", 150.0)(noisy(drive())), 150.0),
        held("vehicle_speed", 150.0)(noisy(steady)),
    ):
        assert "signal_stuck" in {finding.code for finding in check(stuck, TRUCK).findings}


@pytest.mark.parametrize("unheard", [(), WHEELS])
def test_a_cruise_control_that_stays_within_a_coarse_step_is_not_stuck(unheard: tuple[str, ...]) -> None:
    """45 km/h and 0.2 off, in steps of 1 km/h."""
    signals = without(in_steps("vehicle_speed", 1 / 3.6)(drive(swing=0.05)), *unheard)
    assert len(np.unique(signals.table["vehicle_speed_m_s"].to_numpy()[500:])) == 1
    assert "signal_stuck" not in {finding.code for finding in check(signals, TRUCK).findings}


@pytest.mark.parametrize(("name", "step"), [("steering_wheel_angle", 2.0), ("yaw_rate", 0.25)])
def test_a_coarse_signal_is_told_with_its_step(name: str, step: float) -> None:
    coarse = [f for f in check(in_steps(name, step * DEGREE)(drive()), TRUCK).findings if f.code == "signal_coarse"]
    assert only(tuple(coarse)).value == pytest.approx(step)


def test_resolution_is_the_step_of_the_encoding() -> None:
    fine = np.random.default_rng(0).normal(size=5000)
    assert resolution(np.round(fine * 64) / 64) == pytest.approx(1 / 64)
    assert resolution(fine) is None
    assert resolution(np.zeros(100)) is None


def test_a_coarse_signal_is_told_also_when_it_was_brought_to_another_clock() -> None:
    sampled = np.arange(0.0, 300.0, 0.02)
    fault = both(
        in_steps("steering_wheel_angle", 2.0 * DEGREE),
        lambda signals: changed(
            signals, "steering_wheel_angle", lambda x, t: np.interp(t, sampled + 0.003 * np.sin(sampled), x)
        ),
    )
    coarse = [f for f in check(fault(drive()), TRUCK).findings if f.code == "signal_coarse"]
    assert only(tuple(coarse)).value == pytest.approx(2.0)


def test_a_relative_sensor_is_told() -> None:
    finding = only(check(scaled("steering_wheel_angle_sensor_type", 0.0)(drive()), TRUCK).findings)
    assert finding.code == "relative_angle_sensor"


def test_an_angle_off_by_a_whole_turn_is_told() -> None:
    finding = only(check(shifted("steering_wheel_angle", -2 * np.pi)(drive()), TRUCK).findings)
    assert finding.code == "whole_turns"
    assert finding.value == pytest.approx(-358, abs=4)


def test_a_straight_road_tells_neither_sign_nor_scale_nor_ratio_and_says_so() -> None:
    judged = check(drive(bends=0.0), TRUCK)
    assert judged.findings == ()
    assert {"signs", "ratio times wheelbase"} <= {verdict.check for verdict in judged.cannot_tell}


@pytest.mark.parametrize("fault", [scaled("yaw_rate", -1.0), scaled("yaw_rate", 2.0)], ids=["sign", "factor"])
def test_a_straight_road_accuses_nobody(fault: Fault) -> None:
    assert check(fault(drive(bends=0.0)), TRUCK).findings == ()


def test_one_glitch_does_not_decide_a_sign() -> None:
    def glitch(size: float) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
        return lambda x, t: x + size * ((t > 200) & (t < 202))

    signals = changed(drive(bends=0.0), "yaw_rate", glitch(0.2))
    judged = check(changed(signals, "steering_wheel_angle", glitch(-2.0)), TRUCK)
    assert "sign_reversed" not in {finding.code for finding in judged.findings}
    assert "signs" in {verdict.check for verdict in judged.cannot_tell}


def test_an_angle_that_turns_its_sign_midway_accuses_nobody() -> None:
    signals = without(drive(), *WHEELS, "lateral_acceleration")
    judged = check(changed(signals, "steering_wheel_angle", lambda x, t: np.where(t > 152, -x, x)), TRUCK)
    assert "sign_reversed" not in {finding.code for finding in judged.findings}
    assert "signs" in {verdict.check for verdict in judged.cannot_tell}


def test_a_cab_that_still_rocks_after_stopping_is_not_a_bias() -> None:
    stopped = changed(drive(), "vehicle_speed", lambda x, t: np.where(t > 299.2, 0.0, np.maximum(x, 3.0)))
    rocking = changed(stopped, "yaw_rate", lambda x, t: np.where(t > 299.2, (t < 299.38) * 2.0 * DEGREE, x))
    judged = check(rocking, TRUCK)
    assert "yaw_rate_bias" not in {finding.code for finding in judged.findings}
    assert "zero of the yaw rate" not in {verdict.check for verdict in judged.cannot_tell}


def test_a_signal_that_comes_too_seldom_is_told() -> None:
    signals = drive()
    sources = {**signals.sources, "yaw_rate": Source("VDC2 from 0x3E", 5.0, 1500, 0)}
    finding = only(check(replace(signals, sources=sources), TRUCK).findings)
    assert (finding.code, finding.value, finding.unit) == ("signal_slow", 5.0, "Hz")


def test_a_truck_that_stands_says_that_it_does_not_move() -> None:
    standing = scaled("vehicle_speed", 0.0)(both(*(scaled(name, 0.0) for name in WHEELS))(drive(bends=0.0)))
    judged = check(standing, TRUCK)
    assert judged.findings == ()
    assert "the vehicle does not move" in {verdict.why for verdict in judged.cannot_tell}


@pytest.mark.parametrize("name", ["steering_wheel_angle", "yaw_rate", "vehicle_speed"])
def test_a_signal_that_is_needed_and_missing_is_an_error(name: str) -> None:
    findings = check(without(drive(), name), TRUCK).findings
    assert [f.code for f in findings if f.severity == "error"] == ["missing_signal"]
    assert SIGNALS[name].name.replace("_", " ") in findings[0].text


def test_signals_that_are_often_not_available_are_told_and_the_rest_is_still_judged() -> None:
    signals = changed(drive(), "yaw_rate", lambda x, t: np.where(t % 10 < 1, np.nan, x))
    sources = {**signals.sources, "yaw_rate": Source("VDC2 from 0x3E", RATE_HZ, 1000, 100)}
    finding = only(check(replace(signals, sources=sources), TRUCK).findings)
    assert finding.code == "signal_not_available"
    assert finding.value == pytest.approx(10.0)


def genesis(name: str) -> tuple[Signals, Vehicle]:
    log = real_drive(f"genesis/{name}.csv.gz")
    vehicle = oncenter.vehicle(EXAMPLES / "genesis.toml")
    return oncenter.read(log, names=vehicle.signal_names), vehicle


LAPS = ("cpg_fast_lap", "cpg_slow_lap")
YARD = tuple(f"rfs_2018-06-20_path{k}" for k in (1, 2, 3))
BIASES = {"yaw_rate_bias", "lateral_acceleration_at_standstill"}


@pytest.mark.parametrize("name", LAPS)
def test_a_real_car_shows_its_biases_and_nothing_else(name: str) -> None:
    findings = {finding.code: finding for finding in check(*genesis(name)).findings}
    assert set(findings) == BIASES
    assert findings["yaw_rate_bias"].value == pytest.approx(0.27, abs=0.03)
    assert findings["lateral_acceleration_at_standstill"].value == pytest.approx(-0.6, abs=0.05)


@pytest.mark.parametrize("name", LAPS)
def test_a_real_car_tells_its_ratio_times_wheelbase(name: str) -> None:
    signals, _ = genesis(name)
    shown = [finding for finding in check(signals).findings if finding.code == "ratio_times_wheelbase"]
    assert only(tuple(shown)).value == pytest.approx(14.0 * 3.01, rel=0.05)


@pytest.mark.parametrize("name", LAPS)
def test_a_biased_accelerometer_is_told_before_the_gate_shuts_on_it(name: str) -> None:
    signals, vehicle = genesis(name)
    codes = {finding.code for finding in check(signals, vehicle.model_copy(update={"params": {}})).findings}
    assert codes == {*BIASES, "bank"}


@pytest.mark.parametrize("name", YARD)
def test_a_slow_minute_on_a_yard_accuses_no_unit_sign_or_ratio(name: str) -> None:
    assert {finding.code for finding in check(*genesis(name)).findings} <= BIASES


@pytest.mark.parametrize("name", [*LAPS, *YARD])
@pytest.mark.parametrize(
    ("fault", "code"),
    [
        (scaled("yaw_rate", DEGREE), "scale"),
        (scaled("steering_wheel_angle", 1 / DEGREE), "scale"),
        (scaled("steering_wheel_angle", -1.0), "sign_reversed"),
    ],
    ids=["rad for deg", "deg for rad", "sign"],
)
def test_a_fault_planted_in_a_real_drive_is_an_error(name: str, fault: Fault, code: str) -> None:
    signals, vehicle = genesis(name)
    first = check(fault(signals), vehicle).findings[0]
    assert (first.code, first.severity) == (code, "error")


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("rows", [2, 3, 11, 700, 4000])
@pytest.mark.parametrize("kind", ["noise", "constant", "nothing", "holes"])
def test_a_log_of_nearly_nothing_is_not_judged_and_breaks_nothing(rows: int, kind: str) -> None:
    rng = np.random.default_rng(rows)
    signals = drive(duration_s=rows / RATE_HZ)
    values = {
        "noise": lambda x, t: rng.standard_normal(len(x)),
        "constant": lambda x, t: np.full(len(x), 7.0),
        "nothing": lambda x, t: np.full(len(x), np.nan),
        "holes": lambda x, t: np.where(rng.random(len(x)) < 0.5, x, np.nan),
    }[kind]
    for name in signals.sources:
        signals = changed(signals, name, values)
    codes = {finding.code for finding in check(signals, TRUCK).findings}
    assert not codes & {"sign_reversed", "scale", "lag_yaw_rate", "lag_lateral_acceleration", "ratio_times_wheelbase"}


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("drive") / "drive.csv"
    late_and_biased = both(shifted("yaw_rate", 0.25 * DEGREE), delayed("steering_wheel_angle", 0.4))(drive())
    late_and_biased.table.write_csv(path)
    return path


VEHICLE = ("--vehicle", "scania_r730_4x2")


def test_the_verb_prints_a_table_of_100_columns_and_then_words(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["signals", str(log), *VEHICLE]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 100
    rows = {line.split()[0]: line for line in lines[3 : lines.index("", 3)] if not line.startswith(" ")}
    assert set(rows) == set(drive().sources)
    assert rows["vehicle_speed"].split()[1:] == ["50", "Hz", "15000", "0%", "0%", "0.0..79.2", "km/h"]
    assert "    column vehicle_speed_m_s" in lines
    assert [line for line in lines if line.startswith("warning: the yaw rate reads +0.2")]
    assert [line for line in lines if line.startswith("warning: the lag of the yaw rate behind the angle is -2")]


def test_the_verb_gives_one_json_object_in_file_units(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["signals", str(log), "--json", *VEHICLE]) == 0
    given = json.loads(capsys.readouterr().out, parse_constant=lambda constant: pytest.fail(constant))
    assert given["schema"] == "oncenter/signals-1"
    assert {"version", "log", "signals", "findings"} <= set(given)
    speed = given["signals"]["vehicle_speed"]
    assert speed["unit"] == "km/h"
    assert speed["max"] == pytest.approx(22 * 3.6)
    assert speed["samples"] == drive().table.height
    assert speed["not_available"] == 0
    assert {finding["code"] for finding in given["findings"]} == {"yaw_rate_bias", "lag_yaw_rate"}
    assert all(set(finding) == {"code", "severity", "text", "value", "unit"} for finding in given["findings"])


def test_the_verb_works_without_a_vehicle_file(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["signals", str(log)]) == 0
    assert "ratio times wheelbase is 7" in capsys.readouterr().out


def test_a_standing_truck_without_an_angle_is_told_what_it_lacks(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["signals", str(real_drive("j1939_truck_stationary/truck_stationary.mf4"))]) == 0
    said = capsys.readouterr().out
    assert "error: no steering wheel angle" in said
    assert "EBC2 from 0x0B" in said


@pytest.mark.parametrize("rate_hz", [20.0, 50.0, 200.0])
def test_a_log_of_a_few_ticks_tells_nothing_and_accuses_nobody(rate_hz: float) -> None:
    whole = drive()
    for ticks in (2, 3, 7, 21, 50):
        short = replace(whole, table=whole.table[10_000 : 10_000 + ticks], rate_hz=rate_hz)
        judged = check(short, TRUCK)
        assert [finding for finding in judged.findings if finding.severity != "info"] == []
        assert judged.cannot_tell
