"""Healthy drives stay silent; each fault that is planted in one is named, and only that one."""

import json
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from planted_faults import (
    RATE_HZ,
    TRUCK,
    WHEELS,
    Fault,
    both,
    changed,
    delayed,
    drive,
    in_degrees,
    only,
    scaled,
    shifted,
    wheels_swapped,
    without,
)
from real_data import real_drive

from oncenter.cli import run
from oncenter.offset.run import offset
from oncenter.plausibility import check
from oncenter.signals import DEGREE, Source
from oncenter.simulate import simulate


@pytest.mark.parametrize("seed", range(8))
def test_a_healthy_drive_has_no_finding_and_all_checks_are_judged(seed: int) -> None:
    judged = check(drive(seed), TRUCK)
    assert judged.findings == ()
    assert judged.cannot_tell == ()


def test_a_mirrored_healthy_drive_has_no_finding() -> None:
    turns = ("steering_wheel_angle", "yaw_rate", "lateral_acceleration")
    mirror = both(wheels_swapped, *(scaled(name, -1.0) for name in turns))
    assert check(mirror(drive()), TRUCK).findings == ()


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("steering_wheel_angle", "the sign of the steering wheel angle is reversed"),
        ("yaw_rate", "the sign of the yaw rate is reversed"),
        ("lateral_acceleration", "the sign of the lateral acceleration is reversed"),
    ],
)
def test_the_signal_with_reversed_sign_is_outvoted(name: str, said: str) -> None:
    finding = only(check(scaled(name, -1.0)(drive()), TRUCK).findings)
    assert finding.code == "sign_reversed"
    assert finding.text.startswith(said)


def test_swapped_wheels_are_a_reversed_sign() -> None:
    finding = only(check(wheels_swapped(drive()), TRUCK).findings)
    assert "left and right are exchanged in the front and rear wheel speeds" in finding.text


def test_with_two_signals_both_are_named_for_a_reversed_sign() -> None:
    pair = without(scaled("yaw_rate", -1.0)(drive()), *WHEELS, "lateral_acceleration")
    finding = check(pair, TRUCK).findings[0]
    assert finding.code == "sign_reversed"
    assert finding.text.startswith("the sign of either the ")


@pytest.mark.parametrize(
    ("name", "factor", "said"),
    [
        ("steering_wheel_angle", 1 / DEGREE, "steering wheel angle is too large by a factor of 57.3 (deg read as rad)"),
        ("steering_wheel_angle", DEGREE, "steering wheel angle is too small by a factor of 57.3 (rad read as deg)"),
        ("yaw_rate", 1 / DEGREE, "yaw rate is too large by a factor of 57.3 (deg/s read as rad/s)"),
        ("yaw_rate", DEGREE, "yaw rate is too small by a factor of 57.3 (rad/s read as deg/s)"),
        ("vehicle_speed", 3.6, "vehicle speed is too large by a factor of 3.6 (km/h read as m/s)"),
        ("vehicle_speed", 1 / 3.6, "vehicle speed is too small by a factor of 3.6 (m/s read as km/h)"),
        ("lateral_acceleration", 9.80665, "is too large by a factor of 9.81 (m/s^2 read as g)"),
        (
            "lateral_acceleration",
            1 / 9.80665,
            "is too small by a factor of 9.81 (g read as m/s^2)",
        ),
    ],
)
@pytest.mark.parametrize("wheels", [True, False], ids=["with wheel speeds", "without"])
def test_a_wrong_unit_is_named(name: str, factor: float, said: str, wheels: bool) -> None:
    whole = drive() if wheels else without(drive(), *WHEELS)
    scales = [f for f in check(scaled(name, factor)(whole), TRUCK).findings if f.code == "scale"]
    assert said in only(tuple(scales)).text
    assert ", or " not in scales[0].text


def test_wheel_speeds_in_km_h_are_named() -> None:
    fault = both(*(scaled(name, 3.6) for name in WHEELS))
    assert "wheel speeds are too large by a factor of 3.6" in only(check(fault(drive()), TRUCK).findings).text


def test_fifteen_degrees_of_play_are_no_wrong_scale_of_the_angle() -> None:
    play = simulate("heavy_play", seed=4)[0]  # in slow bends for half a minute the wheel turns 3.5 times as much
    assert "scale" not in [finding.code for finding in offset(play, TRUCK).findings]


def test_a_few_hard_turns_are_no_late_yaw_rate() -> None:
    assert "signal_late" not in [finding.code for finding in offset(simulate("hard_turn", seed=1)[0], TRUCK).findings]


def test_with_angle_and_yaw_rate_alone_both_units_are_named() -> None:
    pair = without(scaled("steering_wheel_angle", 1 / DEGREE)(drive()), *WHEELS, "lateral_acceleration")
    text = check(pair, TRUCK).findings[0].text
    assert "steering wheel angle is too large by a factor of 57.3" in text
    assert "yaw rate is too small by a factor of 57.3" in text


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


@pytest.mark.parametrize("worn", [-0.004, 0.004])
def test_unequal_tyre_wear_on_a_nearly_straight_road_is_no_wrong_unit_or_sign(worn: float) -> None:
    """4 per mille of the speed, which goes with the yaw rate where all bends are to one side."""
    gentle = drive(bends=0.03)
    speed = gentle.table["vehicle_speed_m_s"].to_numpy()
    turning = changed(gentle, "yaw_rate", lambda x, t: x + 0.0005 * speed)
    on_worn = changed(turning, "wheel_speed_rear_right", lambda x, t: x + (0.0005 * 1.83 + worn) * speed)
    assert not {"scale", "sign_reversed"} & {finding.code for finding in check(on_worn, TRUCK).findings}
    mixed_up = changed(changed(drive(), "wheel_speed_rear_right", lambda x, t: 1.004 * x), "yaw_rate", in_degrees)
    assert "scale" in {finding.code for finding in check(mixed_up, TRUCK).findings}


def test_wheel_speeds_above_the_vehicle_speed_are_reported() -> None:
    finding = only(check(both(*(scaled(name, 1.08) for name in WHEELS))(drive()), TRUCK).findings)
    assert finding.code == "wheel_speed"
    assert finding.value == pytest.approx(8.0, abs=0.2)


def test_a_vehicle_speed_that_stays_at_zero_while_the_wheels_turn_is_an_error() -> None:
    finding = only(check(scaled("vehicle_speed", 0.0)(drive(bends=0.0)), TRUCK).findings)
    assert (finding.code, finding.severity) == ("wheel_speed", "error")


def test_a_yaw_rate_at_standstill_is_reported() -> None:
    finding = only(check(shifted("yaw_rate", 0.25 * DEGREE)(drive()), TRUCK).findings)
    assert finding.code == "yaw_rate_bias"
    assert finding.value == pytest.approx(0.25, abs=0.02)
    assert "32127" not in finding.text


@pytest.mark.parametrize(("source", "named"), [("VDC2 from 0x3E", True), ("column yaw_rate_deg_s", False)])
def test_the_common_wrong_zero_of_vdc2_is_named_for_its_yaw_rate(source: str, named: bool) -> None:
    signals = shifted("yaw_rate", (32127 - 32112.64) / 8192)(drive())
    sources = {**signals.sources, "yaw_rate": Source(source, RATE_HZ, 1000, 0)}
    finding = only(check(replace(signals, sources=sources), TRUCK).findings)
    assert finding.value == pytest.approx(0.10, abs=0.01)
    assert ("32127" in finding.text) is named


def test_an_accelerometer_bias_is_reported_at_standstill_and_at_speed() -> None:
    findings = check(shifted("lateral_acceleration", -0.75)(drive()), TRUCK).findings
    assert {f.code for f in findings} == {"lateral_acceleration_at_standstill", "bank"}
    assert all(f.value == pytest.approx(-0.6, abs=0.05) for f in findings)


def test_a_relative_sensor_is_reported() -> None:
    finding = only(check(scaled("steering_wheel_angle_sensor_type", 0.0)(drive()), TRUCK).findings)
    assert finding.code == "relative_angle_sensor"


def test_a_whole_turn_in_the_angle_is_reported() -> None:
    finding = only(check(shifted("steering_wheel_angle", -2 * np.pi)(drive()), TRUCK).findings)
    assert finding.code == "whole_turns"
    assert finding.value == pytest.approx(-358, abs=4)


def test_on_a_straight_road_sign_scale_and_ratio_are_not_judged() -> None:
    judged = check(drive(bends=0.0), TRUCK)
    assert judged.findings == ()
    assert {"signs", "ratio times wheelbase"} <= {verdict.check for verdict in judged.cannot_tell}


def test_too_gentle_bends_are_named_as_the_missing_evidence() -> None:
    """A lag is not judged where the two signals hardly correlate, also in a long drive."""
    noise = np.random.default_rng(1).normal(0.0, 0.5, len(drive().table))
    judged = check(changed(drive(), "lateral_acceleration", lambda x, t: x + noise), TRUCK)
    why = {verdict.check: verdict.why for verdict in judged.cannot_tell}
    assert "that exceed play, road bank and noise" in why["lag of the lateral acceleration behind the yaw rate"]
    short = replace(drive(), table=drive().table.head(round(20 * RATE_HZ)))
    why = {verdict.check: verdict.why for verdict in check(short, TRUCK).cannot_tell}
    assert "needs 30 s" in why["lag of the lateral acceleration behind the yaw rate"]


@pytest.mark.parametrize("fault", [scaled("yaw_rate", -1.0), scaled("yaw_rate", 2.0)], ids=["sign", "factor"])
def test_on_a_straight_road_no_signal_is_blamed(fault: Fault) -> None:
    assert check(fault(drive(bends=0.0)), TRUCK).findings == ()


def test_one_glitch_does_not_decide_a_sign() -> None:
    def glitch(size: float) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
        return lambda x, t: x + size * ((t > 200) & (t < 202))

    signals = changed(drive(bends=0.0), "yaw_rate", glitch(0.2))
    judged = check(changed(signals, "steering_wheel_angle", glitch(-2.0)), TRUCK)
    assert "sign_reversed" not in {finding.code for finding in judged.findings}
    assert "signs" in {verdict.check for verdict in judged.cannot_tell}


def test_an_angle_that_changes_its_sign_midway_is_wrong_at_the_end() -> None:
    """The halves contradict each other; the core, which judges as the drive goes on, names both that may be wrong."""
    signals = without(drive(), *WHEELS, "lateral_acceleration")
    judged = check(changed(signals, "steering_wheel_angle", lambda x, t: np.where(t > 152, -x, x)), TRUCK)
    (reversed_sign,) = (finding.text for finding in judged.findings if finding.code == "sign_reversed")
    assert "steering wheel angle" in reversed_sign and "yaw rate" in reversed_sign
    assert "signs" in {verdict.check for verdict in judged.cannot_tell}


def test_a_rocking_cab_after_a_stop_is_not_a_bias() -> None:
    stopped = changed(drive(), "vehicle_speed", lambda x, t: np.where(t > 299.2, 0.0, np.maximum(x, 3.0)))
    rocking = changed(stopped, "yaw_rate", lambda x, t: np.where(t > 299.2, (t < 299.38) * 2.0 * DEGREE, x))
    judged = check(rocking, TRUCK)
    assert "yaw_rate_bias" not in {finding.code for finding in judged.findings}
    assert "zero of the yaw rate" not in {verdict.check for verdict in judged.cannot_tell}


def test_a_standing_truck_is_reported_as_not_moving() -> None:
    standing = scaled("vehicle_speed", 0.0)(both(*(scaled(name, 0.0) for name in WHEELS))(drive(bends=0.0)))
    judged = check(standing, TRUCK)
    assert judged.findings == ()
    assert "the vehicle does not move" in {verdict.why for verdict in judged.cannot_tell}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("rows", [2, 3, 11, 700, 4000])
@pytest.mark.parametrize("kind", ["noise", "constant", "nothing", "holes"])
def test_a_nearly_empty_log_is_not_judged_and_raises_no_error(rows: int, kind: str) -> None:
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
    assert [line for line in lines if line.startswith("info: the yaw rate sensor reads +0.2")]
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


def test_the_missing_evidence_of_a_standing_truck_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["signals", str(real_drive("j1939_truck_stationary/truck_stationary.mf4"))]) == 0
    said = capsys.readouterr().out
    assert "error: the log has no steering wheel angle" in said
    assert "EBC2 from 0x0B" in said


def test_the_verb_names_the_checks_that_a_drive_does_not_allow_once_for_each_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    without(drive(duration_s=30.0), *WHEELS).table.write_csv(tmp_path / "drive.csv")
    assert run(["signals", str(tmp_path / "drive.csv"), "--json", *VEHICLE]) == 0
    expected: dict[str, list[str]] = {}
    for given in json.loads(capsys.readouterr().out)["cannot_tell"]:
        expected.setdefault(given["why"], []).append(given["check"])
    assert run(["signals", str(tmp_path / "drive.csv"), *VEHICLE]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "vehicle speed against wheel speeds" in expected["no wheel speeds"]
    for why, checks in expected.items():
        assert said.count(f"not checked: {', '.join(checks)} ({why})") == 1


@pytest.mark.parametrize("rate_hz", [20.0, 50.0, 200.0])
def test_in_a_log_of_a_few_ticks_no_signal_is_blamed(rate_hz: float) -> None:
    whole = drive()
    for ticks in (2, 3, 7, 21, 50):
        short = replace(whole, table=whole.table[10_000 : 10_000 + ticks], rate_hz=rate_hz)
        judged = check(short, TRUCK)
        assert [finding for finding in judged.findings if finding.severity != "info"] == []
        assert judged.cannot_tell


@pytest.mark.parametrize("name", ["steering_wheel_angle", "yaw_rate", "vehicle_speed", "lateral_acceleration"])
@pytest.mark.parametrize("size", [1e250, -1.7e308])
def test_a_damaged_number_of_any_size_causes_no_numpy_warning(name: str, size: float) -> None:
    def damaged(values: np.ndarray, time: np.ndarray) -> np.ndarray:
        return np.where(np.isin(np.arange(len(values)), (3000, 3001, 9000)), size, values)

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        offset(changed(drive(), name, damaged), TRUCK)
