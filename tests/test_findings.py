"""What is said of a drive beyond its numbers: each finding where the world has it, and none where it has not."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from real_data import real_drive
from test_estimate import steady_drive

import oncenter as oc
from oncenter import _core
from oncenter.offset import coarse_recording, core_findings, several_logs, vehicle_file
from oncenter.offset import joint_findings as joint_findings_room
from oncenter.offset.changes import Change
from oncenter.offset.core_findings import findings_of
from oncenter.offset.findings import TABLE, Finding
from oncenter.offset.joint_findings import joint_findings
from oncenter.signals import DEGREE, Signals

TRUCK = oc.vehicle("scania_r730_4x2")
PARAMS = _core.default_params()


def estimate(value: float, sd: float, status: str = "valid") -> dict[str, Any]:
    return {
        "value": value,
        "standard_deviation": sd,
        "lean": 0.0,
        "evidence": 1000.0,
        "status": _core.STATUSES.index(status),
    }


def parts(drive: float, pull: float = 0.37, wind: float = 0.15, set_up: float = 0.0) -> dict[str, float]:
    """Standard deviations in deg as oc_offset_parts has them."""
    sds = {"drive_sd": drive, "pull_sd": pull, "wind_sd": wind, "set_up_sd": set_up}
    return {name: sd * DEGREE for name, sd in sds.items()} | {"per_acceleration": 7.5 * DEGREE}


def core_says(**others: Any) -> dict[str, Any]:
    """What the core says of a healthy truck after half an hour, but for `others`."""
    return {
        "offset": estimate(0.3 * DEGREE, 0.4 * DEGREE),
        "offset_parts": parts(0.1),
        "understeer_gradient": estimate(0.4 * DEGREE, 0.01 * DEGREE),
        "backlash": estimate(3.0 * DEGREE, 0.1 * DEGREE),
        "unloading_acceleration": estimate(0.02, 0.005),
        "equivalent_wheelbase": estimate(3.72, 0.02),
        "yaw_rate_bias": estimate(0.01 * DEGREE, 0.01 * DEGREE),
        "yaw_rate_bias_wheel_time": 1700.0,
        "yaw_rate_bias_alarm_time": 0.0,
        "standstill_lateral_acceleration": estimate(0.0, 0.01),
        "lacking_to_left": 0.0,
        "lacking_to_right": 0.0,
        "offset_per_yaw_rate_bias": 4.0,
        "side_force_to_left": 200.0,
        "side_force_to_right": 300.0,
        "unexplained": 0.3 * DEGREE,
        "bank_mean": 0.2,
        "bank_time": 1700.0,
        "bank_low": 0.1,
        "bank_high": 0.3,
        "accelerometer_runs_away": 0,
        "accelerometer_wanders": 0,
        "duration": 1800.0,
        "used": 1700.0,
        "rejected": [0.0] * len(_core.REASONS),
    } | others


def told(*changes: Change, traffic_sign: float = 0.0, accelerometer: bool = True, **others: Any) -> dict[str, Finding]:
    """The joint method's findings by code."""
    native, params = core_says(**others), PARAMS | {"use_accelerometer": int(accelerometer)}
    truck = {"steering_ratio": 19.3, "wheelbase_m": 3.7}
    of_method = joint_findings(native, params, changes, **truck, traffic_sign=traffic_sign)
    about = {"method": "joint", "yaw_rate_from_vdc2": False, "sees_banks": accelerometer, "of_method": of_method}
    found = findings_of(native, params, False, **about)
    return {finding.code: finding for finding in found}


def simulated(name: str, seed: int = 1) -> Signals:
    return oc.simulate(name, seed=seed)[0]


def by_code(answer: oc.Answer) -> dict[str, Finding]:
    return {finding.code: finding for finding in answer.findings}


def changed(before_deg: float, after_deg: float, kind: str = "offset", sd_deg: float = 0.05) -> Change:
    size = None if kind == "bends" else (after_deg - before_deg) * DEGREE
    return Change(
        kind=kind,
        drive=0,
        log="drive.log",
        time_s=900.0,
        into_log_s=900.0,
        offset_before_rad=before_deg * DEGREE,
        offset_after_rad=after_deg * DEGREE,
        size_rad=size,
        sd_rad=None if size is None else sd_deg * DEGREE,
    )


def test_of_a_healthy_truck_there_is_nothing_to_tell_but_whence_the_interval_comes() -> None:
    assert set(told()) == {"interval"}


def test_every_finding_has_a_severity_a_value_and_its_unit() -> None:
    for finding in (*told(changed(2, -3)).values(), *told(changed(2, 2, "bends")).values()):
        assert finding.severity in ("info", "warning", "error")
        assert finding.value is not None and finding.unit


def test_a_gyro_that_was_corrected_is_told_and_is_no_alarm_unless_it_is_far_off() -> None:
    some = told(yaw_rate_bias=estimate(0.2 * DEGREE, 0.01 * DEGREE))["yaw_rate_bias"]
    assert some.severity == "info" and "it was corrected" in some.text
    assert some.value == pytest.approx(0.2)
    much = told(yaw_rate_bias=estimate(-3.0 * DEGREE, 0.01 * DEGREE))["yaw_rate_bias"]
    assert much.severity == "warning" and "look at the sensor" in much.text


def test_a_gyro_that_runs_away_is_told_with_the_seconds_that_were_left_out() -> None:
    moved = told(yaw_rate_bias_alarm_time=120.0)["yaw_rate_bias_moves"]
    assert (moved.value, moved.unit, moved.severity) == (120.0, "s", "warning")
    assert "not learned from them" in moved.text


def test_a_moment_in_which_the_gyro_seemed_to_run_away_is_no_alarm_once_its_bias_is_known_again() -> None:
    known, lost = estimate(0.2 * DEGREE, 0.01 * DEGREE), estimate(0.2 * DEGREE, 0.01 * DEGREE, "invalid")
    for bias, severity in ((known, "info"), (lost, "warning")):
        assert told(yaw_rate_bias_alarm_time=15.0, yaw_rate_bias=bias)["yaw_rate_bias_moves"].severity == severity


def test_wheels_that_lean_on_banks_that_nobody_measured_are_no_alarm() -> None:
    moved = told(yaw_rate_bias_alarm_time=600.0, accelerometer=False)["yaw_rate_bias_moves"]
    assert moved.severity == "info" and "the road's bank, which is not measured" in moved.text


@pytest.mark.parametrize(("play_deg", "says"), [(14.8, None), (15.1, "is about"), (16.0, "is beyond")])
def test_play_beyond_the_maintenance_standard_is_told_as_hysteresis(play_deg: float, says: str | None) -> None:
    found = told(backlash=estimate(play_deg * DEGREE, 0.2 * DEGREE)).get("steering_play")
    assert (found is None) == (says is None)
    if found is not None and says is not None:
        assert says in found.text and "friction wind-up" in found.text
        assert found.value == pytest.approx(play_deg)


def test_play_that_is_not_sure_is_no_finding() -> None:
    assert "steering_play" not in told(backlash=estimate(20 * DEGREE, 5 * DEGREE, "converging"))


def test_steering_that_unloads_off_zero_names_all_that_may_be_behind_it() -> None:
    found = told(unloading_acceleration=estimate(0.25, 0.01))["unloading_off_zero"]
    assert (found.value, found.unit) == (0.25, "m/s^2")
    for cause in ("bias", "alignment", "wind"):
        assert cause in found.text
    assert "crown" not in found.text
    assert "unloading_off_zero" not in told(unloading_acceleration=estimate(0.25, 0.1))
    assert "unloading_off_zero" not in told(unloading_acceleration=estimate(0.25, 0.01, "unobservable"))


def test_without_an_accelerometer_nothing_is_said_of_what_it_reads() -> None:
    found = told(accelerometer=False, unloading_acceleration=estimate(-0.25, 0.01))
    assert set(found) == {"interval"} and "accelerometer" not in found["interval"].text


def test_an_axle_that_unloads_on_the_crown_is_a_cause_where_the_side_of_traffic_is_known() -> None:
    unloads = estimate(0.2, 0.01)
    right = told(unloading_acceleration=unloads, traffic_sign=1.0)["unloading_off_zero"].text
    assert "crown" in right and f"{19.3 * 0.4 * 0.2:.1f} deg less" in right
    assert "crown" not in told(unloading_acceleration=unloads, traffic_sign=-1.0)["unloading_off_zero"].text
    falls = {"unloading_acceleration": estimate(-0.2, 0.01), "bank_mean": -0.2}
    left = told(traffic_sign=-1.0, **falls)["unloading_off_zero"].text
    assert "1.5 deg more" in left


def test_roads_that_fall_to_the_other_side_than_traffic_has_them_are_told() -> None:
    """By where the steering unloads: the accelerometer's own zero moves both alike."""
    for zero in (0.0, 0.3):
        falls = {"bank_mean": zero - 0.2, "unloading_acceleration": estimate(zero, 0.01)}
        all_found = told(traffic_sign=1.0, **falls)
        assert zero == 0.0 or "crown" not in all_found["unloading_off_zero"].text
        found = all_found["roads_fall_to_other_side"]
        assert (found.value, found.unit) == (pytest.approx(-2.04, abs=0.01), "%")
        assert "to the left, by 2.0 +-1.1 %" in found.text and "'traffic_side'" in found.text
        for sign in (0.0, -1.0):
            assert "roads_fall_to_other_side" not in told(traffic_sign=sign, **falls)
    little = {"bank_mean": -0.1, "unloading_acceleration": estimate(0.0, 0.01)}
    assert "roads_fall_to_other_side" not in told(traffic_sign=1.0, **little)
    unsure = {"bank_mean": -0.2, "unloading_acceleration": estimate(0.0, 0.1)}
    assert "roads_fall_to_other_side" not in told(traffic_sign=1.0, **unsure)
    unseen = {"bank_mean": -0.2, "unloading_acceleration": estimate(0.0, 0.01, "unobservable")}
    assert "roads_fall_to_other_side" not in told(traffic_sign=1.0, **unseen)
    assert "roads_fall_to_other_side" not in told(traffic_sign=1.0, accelerometer=False, **falls)
    unbiased = {"yaw_rate_bias": estimate(0.0, 1.0, "unobservable")}
    assert "roads_fall_to_other_side" not in told(traffic_sign=1.0, **unbiased, **falls)


def test_an_accelerometer_whose_zero_moves_by_more_than_roads_bank_is_told() -> None:
    for wanders in (0, 1):
        minutes = {"bank_low": -0.8, "bank_high": 0.6, "accelerometer_runs_away": 1}
        found = told(**minutes, accelerometer_wanders=wanders)["lateral_acceleration_moves"]
        assert (found.severity, found.unit) == ("warning", "m/s^2") and found.value == pytest.approx(1.4)
        assert "1.4 m/s^2" in found.text and "look at the sensor" in found.text


def test_a_zero_that_seems_to_wander_is_an_info_where_minutes_read_otherwise_as_well() -> None:
    found = told(bank_low=0.0, bank_high=0.5, accelerometer_wanders=1)["lateral_acceleration_moves"]
    assert (found.severity, found.unit) == ("info", "m/s^2") and found.value == pytest.approx(0.5)
    assert "warms up" in found.text and "wind" in found.text


@pytest.mark.parametrize(
    "given",
    [
        {"bank_low": -0.4, "bank_high": 0.7},
        {"bank_low": 0.0, "bank_high": 0.3, "accelerometer_wanders": 1},
        {"bank_low": -0.8, "bank_high": 0.6, "accelerometer_runs_away": 1, "accelerometer": False},
    ],
    ids=["roads", "minutes_alike", "not_used"],
)
def test_an_accelerometer_that_only_feels_roads_or_is_not_used_is_no_finding(given: dict[str, Any]) -> None:
    assert "lateral_acceleration_moves" not in told(**given)


def test_a_change_of_the_offset_is_told_with_its_time_and_its_size() -> None:
    found = told(changed(2.0, -3.0))["offset_changed"]
    assert found.value == pytest.approx(-5.0)
    assert "15.0 min into drive.log" in found.text and "-5.0 +-0.1 deg" in found.text
    assert "from +2.0 to -3.0" in found.text


def test_a_small_change_names_load_and_ride_height_and_accuses_nobody() -> None:
    found = told(changed(2.0, 1.0, "straight_ahead"))
    assert "offset_changed" not in found
    assert found["straight_ahead_moved"].severity == "info"
    assert "ride height" in found["straight_ahead_moved"].text and "wind" in found["straight_ahead_moved"].text


def test_a_change_that_did_not_last_is_no_finding() -> None:
    assert set(told(changed(2.0, 2.3, sd_deg=0.5))) == {"interval"}


@pytest.mark.parametrize(
    ("before_deg", "after_deg", "code"),
    [
        (2.0, 0.1, "offset_corrected_by_sender"),
        (-2.0, -0.1, "offset_corrected_by_sender"),
        (4.0, 0.7, "offset_changed"),
        (0.9, 0.0, "offset_changed"),
    ],
)
def test_an_offset_that_goes_away_by_itself_is_the_senders_own_correction(
    before_deg: float, after_deg: float, code: str
) -> None:
    assert code in told(changed(before_deg, after_deg))


def test_bends_that_change_leave_the_offset_alone() -> None:
    found = told(changed(2.0, 2.0, "bends"))["bends_changed"]
    assert found.severity == "info"
    assert "lifting an axle" in found.text and "not affected" in found.text


def test_too_little_driving_says_how_much_is_lacking_and_of_what() -> None:
    found = told(used=20.0, bank_time=30.0)["not_enough_evidence"]
    assert found.value == pytest.approx(PARAMS["joint_evidence_min_s"] - 20.0)
    assert f"above {PARAMS['joint_speed_min_m_s']:g} m/s" in found.text
    assert "40 s more" in found.text


def test_one_flank_says_to_which_side_the_next_bends_must_go() -> None:
    found = told(lacking_to_right=3.2)["one_flank_seen"]
    assert "4 s of bends" in found.text and "to the right" in found.text and "left" not in found.text
    both = told(lacking_to_left=4.0, lacking_to_right=4.0)["one_flank_seen"]
    assert "neither flank" in both.text and "left" in both.text and "right" in both.text


def test_a_truck_that_seems_to_oversteer_says_what_would_tell_it_from_play() -> None:
    oversteers = {"understeer_gradient": estimate(-0.15 * DEGREE, 0.05 * DEGREE)}
    found = told(**oversteers)["no_understeer"]
    assert (found.severity, found.unit) == ("warning", "deg/(m/s^2)") and found.value == pytest.approx(-0.15)
    assert "play" in found.text and "bends" in found.text
    assert "no_understeer" not in told(**oversteers, used=PARAMS["joint_evidence_min_s"] - 1.0)


@pytest.mark.parametrize(
    ("reason", "limit"),
    [
        ("curvature", "joint_curvature_max_1_m"),
        ("longitudinal_acceleration", "joint_longitudinal_acceleration_max_m_s2"),
        ("lateral_acceleration", "joint_lateral_acceleration_max_m_s2"),
        ("bank", "joint_bank_change_max_m_s2"),
    ],
)
def test_a_gate_that_stays_shut_names_the_limit_of_its_own_method(reason: str, limit: str) -> None:
    rejected = [1000.0 if name == reason else 0.0 for name in _core.REASONS]
    found = told(used=0.0, rejected=rejected)["gate_shut"]
    assert f"{PARAMS[limit]:g}" in found.text and f"({limit})" in found.text
    assert found.value == PARAMS[limit]


def interval(*, traffic_sign: float = 0.0, accelerometer: bool = True, **others: Any) -> str:
    return told(traffic_sign=traffic_sign, accelerometer=accelerometer, **others)["interval"].text


def test_the_interval_is_told_by_its_two_parts_the_largest_contribution_first() -> None:
    found = told(offset=estimate(2 * DEGREE, 0.43 * DEGREE))["interval"]
    assert found.value == pytest.approx(1.96 * 0.43)
    assert found.text.startswith("uncertainty ±0.8 deg: ±0.2 from this drive (±0.1 measurement scatter")
    assert "not identifiable from one drive: ±0.7 a pull by the wheel alignment, ±0.3 mean crosswind" in found.text


def test_a_prior_that_is_wide_is_no_scatter_of_the_measurement() -> None:
    for traffic_sign in (0.0, 1.0):
        text = interval(offset_parts=parts(0.1, pull=1.4), traffic_sign=traffic_sign)
        assert "±2.7 a pull by the wheel alignment" in text and "±0.1 measurement scatter" in text


def test_an_axle_set_up_for_the_crown_is_a_cause_where_the_side_of_traffic_is_known() -> None:
    axle = parts(0.1, pull=0.3, set_up=0.9)
    assert "±1.8 an axle set up to unload on the road's crown, ±0.6 a pull" in interval(
        offset_parts=axle, traffic_sign=1.0
    )
    assert "axle" not in interval(offset_parts=axle, traffic_sign=0.0)


def test_what_the_drive_leaves_open_is_named_by_its_cause() -> None:
    wide = {"offset_parts": parts(3.0)}
    assert "(±5.9 measurement scatter)" in interval(**wide)
    assert "(±5.5 gyro bias, ±2.1 measurement scatter)" in interval(yaw_rate_bias=estimate(0.0, 0.7 * DEGREE), **wide)
    zero = estimate(0.0, 0.38, "unobservable")
    assert "(±5.7 accelerometer zero" in interval(unloading_acceleration=zero, **wide)
    assert "(±5.7 road bank, which was not measured" in interval(
        unloading_acceleration=zero, accelerometer=False, **wide
    )
    play = {"backlash": estimate(3.0 * DEGREE, 5.9 * DEGREE, "converging"), **wide}
    assert "(±5.8 free play" in interval(**play)
    assert "free play because only left-hand loading occurred" in interval(lacking_to_right=4.0, **play)
    assert "free play because neither flank was loaded" in interval(lacking_to_left=4.0, lacking_to_right=4.0, **play)
    # a gyro that nothing identified is behind what the scatter of the seconds does not explain
    assert "(±5.9 gyro bias)" in interval(yaw_rate_bias=estimate(0.0, 0.0, "unobservable"), **wide)


def test_the_interval_says_what_would_narrow_it_and_by_how_much() -> None:
    settled = interval(yaw_rate_bias=estimate(0.0, 0.0), offset_parts=parts(0.045))
    assert "to narrow" not in settled
    gyro = interval(yaw_rate_bias=estimate(0.0, 0.3 * DEGREE, "converging"), offset_parts=parts(1.3))
    assert gyro.endswith("to narrow this drive's part: stand still for 1 s (to ±1.0)")
    play = {"backlash": estimate(3.0 * DEGREE, 2.0 * DEGREE), "offset_parts": parts(1.1)}
    assert "another minute of bends to the left, or a known play (to ±0.9)" in interval(**play)
    assert "12 s of bends to the right, or a known play (to ±0.9)" in interval(lacking_to_right=12.0, **play)
    short = interval(used=60.0, offset_parts=parts(1.0))
    assert "another minute of such driving (to ±1.4)" in short
    assert "another minute" not in interval(used=600.0, offset_parts=parts(1.0))


def test_standing_shows_the_accelerometers_zero_to_a_truck_that_has_not_stood() -> None:
    zero = {"unloading_acceleration": estimate(0.0, 0.5, "unobservable"), "offset_parts": parts(3.9)}
    never = {"standstill_lateral_acceleration": estimate(0.0, 0.0, "unobservable")}
    ground = np.hypot(PARAMS["standing_slope_sd_m_s2"], PARAMS["standing_crown_share_1"] * PARAMS["crown_sd_m_s2"])
    left = 1.96 * np.sqrt(3.9**2 - (19.3 * 0.4 * 0.5) ** 2 * 0.5**2 / (0.5**2 + ground**2))
    assert f"stand still for 1 s (to ±{left:.1f})" in interval(traffic_sign=1.0, **zero, **never)
    assert "stand still" not in interval(traffic_sign=1.0, **zero)
    assert "stand still" not in interval(accelerometer=False, **zero, **never)


def never_standing(name: str, seed: int, seconds: float) -> Signals:
    """The part of a drive from its first fast second on, without wheel speeds; stops are cut out."""
    drive = simulated(name, seed)
    rolling = drive.table.filter(pl.col("vehicle_speed_m_s") > 3.0).head(round(seconds * drive.rate_hz))
    wheels = [column for column in rolling.columns if column.startswith("wheel_speed")]
    clock = (pl.int_range(pl.len()) / drive.rate_hz).alias("time_s")
    sources = {signal: source for signal, source in drive.sources.items() if not signal.startswith("wheel_speed")}
    return replace(drive, table=rolling.drop(wheels).with_columns(clock), sources=sources)


@pytest.mark.parametrize("seed", [3, 4])
@pytest.mark.parametrize(("name", "seconds"), [("motorway", 600.0), ("country", 300.0), ("town", 1800.0)])
def test_a_drive_without_standing_names_the_gyro_and_asks_to_stand_still(name: str, seconds: float, seed: int) -> None:
    drive = never_standing(name, seed, seconds)
    answer = oc.offset(drive, TRUCK)
    assert answer.yaw_rate_bias.status == "unobservable"
    text = by_code(answer)["interval"].text
    assert "gyro bias" in text and "stand still for 1 s (to ±" in text
    thesis = oc.offset(drive, TRUCK, method="thesis")
    assert "by the gyro bias, which nothing measured: stand still for 1 s" in by_code(thesis)["play_not_seen"].text
    stood = oc.offset(simulated("thesis_drive"), TRUCK, method="thesis")
    assert "stand still" not in by_code(stood)["play_not_seen"].text


@pytest.mark.parametrize("path", ["path1", "path2"])
def test_a_real_minute_without_standing_names_the_gyro_and_asks_to_stand_still(path: str) -> None:
    car = oc.vehicle(Path(__file__).parents[1] / "examples" / "genesis.toml")
    answer = oc.offset(oc.read(real_drive(f"genesis/rfs_2018-06-20_{path}.csv.gz"), names=car.signal_names), car)
    text = by_code(answer)["interval"].text
    assert "gyro bias" in text and "stand still for 1 s (to ±" in text


def test_caveats_of_the_thesis_are_not_the_joint_methods() -> None:
    drive = steady_drive()
    assert {"play_not_seen"} <= set(by_code(oc.offset(drive, TRUCK, method="thesis")))
    assert not {"play_not_seen", "understeer_gradient_unknown"} & set(by_code(oc.offset(drive, TRUCK)))
    assert not {"interval", "one_flank_seen"} & set(by_code(oc.offset(drive, TRUCK, method="thesis")))


def test_a_sensor_remounted_in_the_second_log_is_dated_there() -> None:
    table = simulated("thesis_drive").table.with_columns(pl.col("time_s") + 1.7e9)
    jump = pl.when(pl.col("time_s") > 1.7e9 + 1200.0).then(-4.0 * DEGREE).otherwise(0.0)
    table = table.with_columns(pl.col("steering_wheel_angle_rad") + jump)
    whole = simulated("thesis_drive")
    first, second = (
        replace(whole, table=part, log=name)
        for name, part in (("first.log", table[:90000]), ("second.log", table[90000:]))
    )
    answer = oc.offset([second, first], TRUCK)
    [change] = answer.changes
    assert (change.kind, change.drive, change.log) == ("offset", 1, "second.log")
    assert change.into_log_s == pytest.approx(300.0, abs=20.0)
    assert change.time_s == pytest.approx(1.7e9 + 1200.0, abs=20.0)
    assert change.size_rad == pytest.approx(-4.0 * DEGREE, abs=0.3 * DEGREE)
    assert answer.offset.value == pytest.approx(change.offset_after_rad)
    assert f"{change.into_log_s / 60:.1f} min into second.log" in by_code(answer)["offset_changed"].text
    given = answer.to_dict()["changes"][0]
    assert given["value"] == pytest.approx(-4.0, abs=0.3) and given["log"] == "second.log"


def test_a_bypass_driven_one_way_is_not_believed_and_asks_for_the_other_side() -> None:
    answer = oc.offset(simulated("bypass"), TRUCK)
    assert answer.offset.status != "valid"
    assert "to the right" in by_code(answer)["one_flank_seen"].text
    to_left_s, to_right_s = answer.missing_loading_s
    assert to_left_s == 0.0 and to_right_s > 0.0


def test_a_truck_that_pulls_is_told_from_its_play() -> None:
    answer = oc.offset(simulated("pulling_truck"), TRUCK)
    assert by_code(answer)["unloading_off_zero"].value == pytest.approx(-0.14, abs=0.05)


@pytest.mark.parametrize(("wrong", "says"), [(1.08, "less"), (0.92, "more")])
def test_a_wrong_wheelbase_in_the_vehicle_file_is_named_and_costs_no_offset(wrong: float, says: str) -> None:
    """8 % off: the bends tell the right wheelbase, or the ratio that would do as well. Where a young hypothesis is as
    good as the others the drive does not tell, and says so."""
    named = 0
    for name, seed in (("country", 3), ("country", 4), ("thesis_drive", 1)):
        drive, truth = oc.simulate(name, seed=seed)
        answer = oc.offset(drive, TRUCK.model_copy(update={"wheelbase_m": wrong * TRUCK.wheelbase_m}))
        assert answer.offset.value == pytest.approx(truth.offset_rad, abs=0.2 * DEGREE)
        assert "wheelbase_or_ratio" not in by_code(oc.offset(drive, TRUCK))
        if answer.equivalent_wheelbase.status == "valid":
            assert answer.equivalent_wheelbase.value == pytest.approx(truth.equivalent_wheelbase_m, rel=0.02)
            assert f"% {says} angle than" in by_code(answer)["wheelbase_or_ratio"].text
            named += 1
    assert named >= 2


FAR_OFF = [
    ("wheelbase_m", 1.9),
    ("steering_ratio", 1.9),
    ("wheelbase_m", 0.5),
    ("steering_ratio", 0.5),
    ("wheelbase_m", 3.0),
    ("steering_ratio", 3.0),
]


@pytest.mark.parametrize(("key", "wrong"), FAR_OFF)
def test_a_vehicle_file_that_is_far_off_is_named_first_and_accuses_no_sensor(key: str, wrong: float) -> None:
    """The drive shows ratio times wheelbase, and the offset is as with the right file."""
    for name, seed in (("country", 3), ("thesis_drive", 1), ("semitrailer_half", 1)):
        drive, truth = oc.simulate(name, seed=seed)
        answer = oc.offset(drive, TRUCK.model_copy(update={key: wrong * getattr(TRUCK, key)}))
        first = answer.findings[0]
        assert (first.code, first.severity) == ("wheelbase_or_ratio", "warning")
        assert f"the vehicle file says {wrong * TRUCK.wheelbase_m * TRUCK.steering_ratio:.0f} m" in first.text
        shown = float(re.findall(r"in the bends of this drive is (\d+) m", first.text)[0])
        assert shown == pytest.approx(TRUCK.steering_ratio * truth.equivalent_wheelbase_m, rel=0.06)
        assert answer.changes == () and answer.sensor_fault == "none"
        assert not {"offset_changed", "straight_ahead_moved", "bends_changed"} & set(by_code(answer))
        assert answer.offset.status == "valid"
        assert answer.offset.value == pytest.approx(truth.offset_rad, abs=0.3 * DEGREE)


@pytest.mark.parametrize("wrong", [0.85, 1.15])
def test_a_lifted_axle_is_no_error_of_the_vehicle_file(wrong: float) -> None:
    drive, _ = oc.simulate("country", seed=3)
    answer = oc.offset(drive, TRUCK.model_copy(update={"wheelbase_m": wrong * TRUCK.wheelbase_m}))
    assert by_code(answer)["wheelbase_or_ratio"].severity == "info"
    assert answer.vehicle.wheelbase_m == wrong * TRUCK.wheelbase_m


@pytest.mark.parametrize("fault", [("vehicle_speed_m_s", 3.6), ("steering_wheel_angle_rad", 1.0 / DEGREE)])
def test_a_unit_that_is_mixed_up_is_no_error_of_the_vehicle_file(fault: tuple[str, float]) -> None:
    column, factor = fault
    drive, _ = oc.simulate("country", seed=3)
    answer = oc.offset(replace(drive, table=drive.table.with_columns(pl.col(column) * factor)), TRUCK)
    assert answer.vehicle == TRUCK and answer.findings[0].severity == "error"


def test_each_row_of_the_table_has_a_rule_and_each_rule_a_row() -> None:
    rooms = (core_findings, joint_findings_room, several_logs, coarse_recording, vehicle_file)
    rules = [Path(room.__file__).read_text(encoding="utf-8") for room in rooms]
    codes = [code for text in rules for code in re.findall(r'from_table\(\s*"(\w+)"', text)]
    assert set(codes) == set(TABLE)
    assert not [text for text in rules if re.search(r"\bFinding\(", text)]
