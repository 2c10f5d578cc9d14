"""The answer to a simulated drive: its quantities, units, words and statuses."""

import functools
import json
import math
import pickle
import re
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

import oncenter as oc
from oncenter import _core
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.estimates.cause import Cause, Prior, in_words
from oncenter.estimates.estimate import Estimate
from oncenter.estimates.estimates import Method
from oncenter.read.whole_turns import without_whole_turns
from oncenter.signals import DEGREE, Signals, Source
from oncenter.vehicle import vehicle_from

TRUCK = vehicle_from({"wheelbase_m": 3.7, "steering_ratio": 19.3}, "truck.toml")
RATE_HZ = 50.0


TABLE_2 = oc.vehicle("scania_r730_4x2")


def thesis_drive(yaw_rate_bias_deg_s: float = 0.0) -> Signals:
    """The shipped scenario, 3 deg of play, with so much more gyro bias than its 0.05 deg/s."""
    drive = _thesis_drive()
    biased = pl.col("yaw_rate_rad_s") + yaw_rate_bias_deg_s * DEGREE
    return replace(drive, table=drive.table.with_columns(biased))


@functools.cache
def _thesis_drive() -> Signals:
    return oc.simulate("thesis_drive", seed=1)[0]


def steady_drive(
    *,
    offset_deg: float = 2.0,
    yaw_rate_bias_deg_s: float = 0.0,
    acceleration_bias_m_s2: float = 0.0,
    minutes: float = 4.0,
    start_s: float = 0.0,
    bends: bool = True,
    radius_m: float = 400.0,
) -> Signals:
    """A truck without play that follows (37) exactly: 3 s of standing, 20 m/s, a minute straight, a minute of bends."""
    time = np.arange(0.0, 60 * minutes, 1 / RATE_HZ)
    speed = np.clip((time - 3.0) * 1.0, 0.0, 20.0)
    bend = np.clip(4 * np.sin(2 * math.pi * time / 30.0), -1, 1) * (time // 60 % 2 == 1)
    curvature = (0.7 / radius_m if bends else 1e-5) * bend
    yaw_rate = curvature * speed
    a_y = yaw_rate * speed + 0.1
    angle = 19.3 * (3.7 * curvature + 0.4 * DEGREE * a_y) + offset_deg * DEGREE
    table = pl.DataFrame(
        {
            "time_s": time + start_s,
            "steering_wheel_angle_rad": angle,
            "yaw_rate_rad_s": yaw_rate + yaw_rate_bias_deg_s * DEGREE,
            "vehicle_speed_m_s": speed,
            "lateral_acceleration_m_s2": a_y + acceleration_bias_m_s2,
        }
    )
    sources = {
        name: Source("made up", RATE_HZ, len(time), 0)
        for name in ("steering_wheel_angle", "yaw_rate", "vehicle_speed", "lateral_acceleration")
    }
    return Signals(table, sources, RATE_HZ, "made up")


def by_thesis(drives: Signals | list[Signals], params: dict[str, float] | None = None) -> oc.Answer:
    return oc.offset(drives, TRUCK, method="thesis", params=params)


def codes(answer: oc.Answer) -> set[str]:
    return {finding.code for finding in answer.findings}


def test_a_truck_that_follows_the_model_gives_its_offset_and_gradient_back() -> None:
    answer = by_thesis(steady_drive())
    assert answer.offset.status == "valid"
    assert answer.offset.value == pytest.approx(2.0 * DEGREE, abs=0.05 * DEGREE)
    assert answer.understeer_gradient.value == pytest.approx(0.4 * DEGREE, abs=0.01 * DEGREE)


def test_used_and_unused_seconds_are_the_drive() -> None:
    answer = by_thesis(steady_drive())
    assert answer.used_s + answer.unused_s == pytest.approx(answer.duration_s)
    assert answer.duration_s == pytest.approx(240.0)
    assert sum(answer.rejected_s.values()) >= answer.unused_s - 1e-9


def test_a_yaw_rate_bias_at_standstill_is_reported_with_its_effect() -> None:
    biased = by_thesis(steady_drive(yaw_rate_bias_deg_s=0.25))
    plain = by_thesis(steady_drive())
    finding = next(f for f in biased.findings if f.code == "yaw_rate_bias")
    assert finding.value == pytest.approx(0.25, abs=1e-6)
    assert plain.offset.value is not None and biased.offset.value is not None
    moved_deg = (plain.offset.value - biased.offset.value) / DEGREE
    # the effect in the words, (48)'s first term, and the shift that the core shows are one number
    assert moved_deg == pytest.approx(19.3 * 3.7 / 20.0 * 0.25, abs=0.1)
    assert f"about {moved_deg:.1f} deg too low" in finding.text
    assert biased.offset.ci95 is not None and biased.offset.ci95[1] > 2.0 * DEGREE - 0.05 * DEGREE


def test_an_accelerometer_bias_beyond_table_4_rejects_all_driving_and_is_named() -> None:
    answer = by_thesis(steady_drive(acceleration_bias_m_s2=-0.6))
    assert (answer.offset.status, answer.offset.value, answer.offset.ci95) == ("unobservable", None, None)
    finding = next(f for f in answer.findings if f.code == "gate_shut")
    assert finding.value == pytest.approx(-0.5, abs=0.01)  # bias and the road's 0.1
    assert "bank_max_m_s2" in finding.text
    assert "lateral_acceleration_at_standstill" in codes(answer)


def test_without_the_accelerometer_its_bias_does_not_matter() -> None:
    a = by_thesis(steady_drive(acceleration_bias_m_s2=-0.6), params={"use_accelerometer": 0})
    b = by_thesis(steady_drive(acceleration_bias_m_s2=+0.6), params={"use_accelerometer": 0})
    assert a.offset.value is not None
    assert a.offset.value == b.offset.value


def test_on_a_straight_road_the_understeer_gradient_is_unobservable() -> None:
    answer = by_thesis(steady_drive(bends=False))
    assert answer.understeer_gradient.status == "unobservable"
    assert answer.understeer_gradient.value is None
    assert "understeer_gradient_unknown" in codes(answer)


def test_two_logs_of_one_truck_have_one_answer_in_any_order() -> None:
    first, second = steady_drive(), steady_drive(start_s=1000.0, radius_m=420.0)
    there = oc.offset([first, second], TRUCK)
    back = oc.offset([second, first], TRUCK)
    assert there.offset == back.offset
    assert there.duration_s == pytest.approx(480.0)
    alone_s = oc.offset(first, TRUCK).used_s
    assert there.used_s == pytest.approx(2 * alone_s, abs=12.0)  # an angle as still as here is doubted at first


def test_logs_that_all_start_at_zero_are_used_in_the_given_order() -> None:
    twice = oc.offset([steady_drive(), steady_drive(radius_m=420.0)], TRUCK)
    assert twice.rejected_s["time"] == 0.0
    assert twice.duration_s == pytest.approx(480.0)


def test_a_relative_angle_sensor_is_judged_modulo_one_turn() -> None:
    drive = steady_drive(offset_deg=2.0 + 720.0)
    relative = replace(drive, table=drive.table.with_columns(steering_wheel_angle_sensor_type=pl.lit(0.0)))
    answer = by_thesis(relative)
    assert answer.offset.value == pytest.approx(2.0 * DEGREE, abs=0.05 * DEGREE)
    assert "relative_angle_sensor" in codes(answer)


def test_the_json_object_keeps_the_contract() -> None:
    given = json.loads(by_thesis(steady_drive()).to_json())
    assert given["schema"] == "oncenter/offset-2"
    assert given["version"] == oc.__version__
    units = {
        "offset": "deg",
        "understeer_gradient": "deg/(m/s^2)",
        "backlash": "deg",
        "yaw_rate_bias": "deg/s",
        "lateral_acceleration_bias": "m/s^2",
    }
    for name, unit in units.items():
        assert given[name]["unit"] == unit
        assert {"value", "ci95", "status"} <= set(given[name])
        assert (given[name]["value"] is None) == (given[name]["ci95"] is None)
    assert {"log", "vehicle", "method", "params", "signals", "time", "findings"} <= set(given)
    assert {"duration_s", "used_s", "unused_s", "rejected_s"} == set(given["time"])
    assert given["offset"]["value"] == pytest.approx(2.0, abs=0.05)


def test_the_joint_answer_adds_its_quantities_to_the_json_and_takes_none_away() -> None:
    thesis, joint = (oc.offset(thesis_drive(), TABLE_2, method=m).to_dict() for m in ("thesis", "joint"))
    assert set(thesis) == set(joint)
    assert set(thesis["offset"]) == set(joint["offset"])
    assert joint["offset"]["variance_if_independent_deg2"] is None
    assert joint["unloading_acceleration"]["unit"] == "m/s^2"
    assert joint["equivalent_wheelbase"]["unit"] == "m"
    assert joint["equivalent_wheelbase"]["value"] == pytest.approx(3.7, rel=0.02)
    assert thesis["equivalent_wheelbase"]["value"] is None
    assert joint["unloading_acceleration"]["value"] == pytest.approx(0.02, abs=0.02)  # the accelerometer's bias
    assert joint["backlash"]["value"] == pytest.approx(3.0, abs=0.2)
    assert (thesis["unloading_acceleration"]["value"], thesis["backlash"]["value"]) == (None, None)
    assert thesis["changes"] == joint["changes"] == []


def test_the_first_schema_is_the_second_without_the_parts_of_the_interval() -> None:
    answer = oc.offset(steady_drive(), TRUCK)
    first, second = (json.loads(answer.to_json(schema)) for schema in ("offset-1", "offset-2"))
    assert (first.pop("schema"), second.pop("schema")) == ("oncenter/offset-1", "oncenter/offset-2")
    assert list(first["offset"]) == ["value", "unit", "ci95", "status", "variance_if_independent_deg2"]
    for name in ("ci95_drive", "not_identifiable", "by_priors"):
        assert second["offset"].pop(name)
    assert second["offset"].pop("applied_deg") == 0.0 and set(second.pop("correction")) == {
        "remaining_deg",
        "total_deg",
    }
    assert second.pop("limit_deg") == 2.0 and second.pop("verdicts")
    assert (second.pop("accounts"), second.pop("vin"), second.pop("start_time")) == ([], None, None)
    assert second.pop("assumed") == [] and [drive["log"] for drive in second.pop("drives")] == ["made up"]
    for name in ("ratio_times_wheelbase", "understeer_at_steering_wheel"):
        assert second.pop(name)
    assert second.pop("traffic_side") == {"side": None, "by": None}
    assert first == second


def test_the_parts_of_the_interval_sum_to_it_by_their_squares() -> None:
    answer = oc.offset(thesis_drive(), TABLE_2)
    (low, high), drive = answer.offset.ci95, answer.offset_half_width_rad
    value, sd = answer.offset.value, (high - low) / 3.92
    about_value = math.hypot(sd, 0.5 * (low + high) - value)
    parts = [drive / 1.96, *(cause.sd_rad for cause in answer.not_identifiable)]
    for cause in answer.not_identifiable:
        assert cause.sd_rad == pytest.approx(cause.sd_m_s2 * answer.offset_per_acceleration)
        assert cause.sd_m_s2 != cause.prior.sd_m_s2
    assert math.hypot(*parts) == pytest.approx(about_value, rel=1e-4)
    assert sum(answer.offset_ci95_drive) / 2 == pytest.approx(value)


def test_each_cause_not_identifiable_from_one_drive_comes_with_its_prior() -> None:
    truck = TABLE_2.model_copy(update={"traffic_side": "right"})
    given = oc.offset(thesis_drive(), truck).to_dict()["offset"]["not_identifiable"]
    priors = {cause["cause"]: cause["prior"] for cause in given}
    assert list(priors) == ["pull", "mean_wind", "axle_set_up"]
    params = _core.default_params()
    for cause, param in (("pull", "pull_sd_m_s2"), ("mean_wind", "wind_sd_m_s2")):
        assert priors[cause]["sd_m_s2"] == params[param]
        assert priors[cause]["source"].endswith(f"the default, parameter {param}")
    pull, wind = given[0], given[1]
    assert pull["sd_m_s2"] == pytest.approx(params["pull_sd_m_s2"], rel=0.3)  # the lean is in it
    assert pull["sd_deg"] / wind["sd_deg"] == pytest.approx(params["pull_sd_m_s2"] / params["wind_sd_m_s2"])
    configured = TABLE_2.model_copy(
        update={"params": {"pull_sd_m_s2": 0.0, "wind_sd_m_s2": 0.03}, "traffic_side": None}
    )
    wind, _ = oc.offset(thesis_drive(), configured).to_dict()["offset"]["not_identifiable"]
    assert (wind["cause"], wind["prior"]["sd_m_s2"]) == ("mean_wind", 0.03)
    assert wind["prior"]["source"].endswith("given, parameter wind_sd_m_s2")


def test_without_play_a_pull_has_no_effect_on_the_offset_and_is_not_mentioned() -> None:
    answer = oc.offset(steady_drive(), TRUCK)
    pull = answer.not_identifiable[0]
    assert answer.offset_per_acceleration < 0.1 * DEGREE
    assert pull.sd_rad < 0.03 * DEGREE
    assert "can add" not in answer.words()


def test_the_methods_that_do_not_separate_the_parts_have_one_interval() -> None:
    answer = by_thesis(steady_drive())
    assert answer.not_identifiable == ()
    assert answer.offset_ci95_drive == pytest.approx(answer.offset.ci95)
    assert "from this drive" not in answer.words() and "can add" not in answer.words()


def test_joint_is_the_default_method() -> None:
    assert oc.offset(steady_drive(), TRUCK).method == "joint"


def test_the_words_begin_with_the_offset_and_its_uncertainty() -> None:
    answer = oc.offset(thesis_drive(yaw_rate_bias_deg_s=0.2), TABLE_2)
    said = re.fullmatch(
        r"straight-ahead offset (\S+) deg ± (\S+) from this drive; "
        r"a pull, crosswind or axle set up for the crown can add ± (\S+) deg; "
        r"the steering has (\S+) deg of play; "
        r"corrected for a gyro bias of (\S+) deg/s; (\d+) of 30 minutes usable(, \d+ rejected for .+)?",
        answer.words(),
    )
    assert said is not None, answer.words()
    offset, drive, more, play, bias, minutes = map(float, said.groups()[:6])
    assert drive < 0.5 < more and abs(offset - 2.04) < 0.3
    assert (play, bias) == (pytest.approx(3.0, abs=0.2), pytest.approx(0.25, abs=0.03))
    assert minutes == pytest.approx(answer.used_s / 60, abs=0.5)


def test_a_gyro_without_bias_is_not_mentioned() -> None:
    assert "gyro" not in oc.offset(thesis_drive(yaw_rate_bias_deg_s=-0.05), TABLE_2).words()


def test_a_number_that_rounds_to_zero_has_no_sign() -> None:
    assert str(Estimate(-1e-5, (-0.02, 0.0), "valid", "rad")) == "0.0 deg, -1.1 to 0.0"


def test_play_that_may_be_zero_is_given_as_an_upper_limit() -> None:
    answer = oc.offset(steady_drive(), TRUCK)
    assert answer.backlash.ci95 is not None and 0.0 <= answer.backlash.ci95[0] < 0.5 * DEGREE
    assert f"at most {answer.backlash.ci95[1] / DEGREE:.1f} deg of play" in answer.words()


def test_without_play_the_neutral_lateral_acceleration_is_unobservable() -> None:
    answer = oc.offset(steady_drive(), TRUCK)
    assert (answer.unloading_acceleration.value, answer.unloading_acceleration.status) == (None, "unobservable")


@pytest.mark.parametrize("minute", [6, 14, 23])
def test_a_drive_cut_in_two_by_an_ignition_has_nearly_the_same_answer(minute: int) -> None:
    drive = thesis_drive()
    row = int(60 * minute * drive.rate_hz)
    one, two = oc.offset(drive, TABLE_2), oc.offset(cut(drive, row), TABLE_2)
    assert one.offset.value is not None and two.offset.value is not None
    assert two.offset.value == pytest.approx(one.offset.value, abs=0.1 * DEGREE)
    assert two.backlash.value == pytest.approx(one.backlash.value, abs=0.2 * DEGREE)
    assert two.used_s == pytest.approx(one.used_s, abs=45.0)  # a suspicion that only one of them had lasts 30 s
    assert two.offset.status == "valid" and two.changes == ()


def cut(drive: Signals, row: int) -> list[Signals]:
    return [replace(drive, table=drive.table[:row]), replace(drive, table=drive.table[row:])]


def test_the_trace_ends_where_the_answer_stands() -> None:
    answer = oc.offset(steady_drive(), TRUCK)
    trace = oc.trace(answer)
    assert len(trace) == answer.drives[0].table.height
    assert trace["offset_rad"][-1] == answer.offset.value
    assert trace["evidence_s"][-1] == answer.used_s
    rejected_s = sum("curvature" in reasons.split(", ") for reasons in trace["reasons"]) / RATE_HZ
    assert rejected_s == pytest.approx(answer.rejected_s["curvature"])


def test_the_monitor_fed_tick_by_tick_gives_the_answer_of_the_log() -> None:
    drive = steady_drive(minutes=2.0)
    monitor = oc.Monitor(TRUCK, rate_hz=RATE_HZ)
    for row in drive.table.iter_rows(named=True):
        now = monitor.step(oc.Tick(**row))
    answer = oc.offset(drive, TRUCK)
    assert now.offset_rad == answer.offset.value
    assert now.offset_status == answer.offset.status
    assert now.backlash_rad == answer.backlash.value


def test_the_monitor_gives_the_angle_of_the_log_also_after_its_sensor_is_lost() -> None:
    drive, lost_s = steady_drive(minutes=2.0), 60.0
    table = oc.angle(drive, TRUCK, sensor_lost_at=lost_s)
    monitor = oc.Monitor(TRUCK, rate_hz=RATE_HZ)
    sources = set()
    for row, angle in zip(drive.table.iter_rows(named=True), table.iter_rows(named=True), strict=True):
        is_lost = row["time_s"] >= drive.table["time_s"][0] + lost_s
        now = monitor.step(oc.Tick(**(row | {"steering_wheel_angle_rad": math.nan} if is_lost else row)))
        assert now.angle_rad == angle["steering_wheel_angle_rad"]
        assert now.angle_rate_rad_s == angle["steering_wheel_angle_rate_rad_s"]
        assert now.angle_sd_rad == angle["standard_deviation_rad"]
        assert now.angle_status == angle["status"]
        assert now.angle_delay_s == angle["delay_s"]
        assert now.angle_estimate_rad == angle["estimate_rad"]
        sources.add((is_lost, now.angle_source))
        if is_lost:
            assert now.angle_estimate_sd_rad == now.angle_sd_rad
    assert sources == {(False, "compensated"), (True, "estimated")}
    assert now.sensor_fault == "lost"


def test_the_monitor_names_the_reason_for_an_unused_tick() -> None:
    monitor = oc.Monitor(TRUCK)
    now = monitor.step(oc.Tick(0.0, 0.0, 0.0, 2.0, 0.0))
    assert set(now.reasons) == {"settling", "speed"}
    assert now.offset_rad is None
    assert monitor.step(oc.Tick(0.01, math.nan, 0.0, 5.0, 0.0)).reasons == ("missing_signal",)


def test_a_call_without_drives_is_refused() -> None:
    with pytest.raises(oc.OncenterError, match="no drive was given") as refused:
        oc.offset([], TRUCK)
    assert (refused.value.code, refused.value.exit_code) == ("no_drive", WRONG_USAGE)


@pytest.mark.parametrize("method", ["joint", "thesis"])
def test_the_error_for_a_missing_accelerometer_names_the_option_for_it(method: Method) -> None:
    drive = steady_drive()
    blind = replace(drive, table=drive.table.drop("lateral_acceleration_m_s2"))
    with pytest.raises(oc.OncenterError, match=r"--no-accelerometer, or use_accelerometer = 0") as refused:
        oc.offset(blind, TRUCK, method=method)
    assert (refused.value.code, refused.value.needs) == ("missing_signal", ("lateral_acceleration",))
    oc.offset(blind, TRUCK, method=method, params={"use_accelerometer": 0})
    with pytest.raises(oc.OncenterError, match=r"^(?!.*--no-accelerometer)"):  # of no use there
        oc.offset(replace(drive, table=blind.table.drop("yaw_rate_rad_s")), TRUCK, method=method)


def test_a_missing_signal_is_named() -> None:
    drive = steady_drive()
    blind = replace(drive, table=drive.table.drop("yaw_rate_rad_s"))
    with pytest.raises(oc.OncenterError, match="yaw rate") as refused:
        oc.offset(blind, TRUCK)
    assert (refused.value.code, refused.value.exit_code) == ("missing_signal", 1)
    assert refused.value.needs == ("yaw_rate",)


def test_a_log_in_which_no_tick_has_all_its_signals_has_no_answer() -> None:
    drive = steady_drive()
    dark = replace(drive, table=drive.table.with_columns(yaw_rate_rad_s=pl.lit(math.nan)))
    with pytest.raises(oc.OncenterError) as refused:
        oc.offset(dark, TRUCK)
    assert (refused.value.code, refused.value.exit_code) == ("no_usable_second", 1)


def test_logs_of_different_rates_are_refused_together() -> None:
    drive = steady_drive()
    with pytest.raises(oc.OncenterError, match="one rate"):
        oc.offset([drive, replace(drive, rate_hz=100.0)], TRUCK)


def relative(drive: Signals, turns: np.ndarray) -> Signals:
    """The drive of a relative angle sensor whose zero is shifted by so many whole turns."""
    angle = drive.table["steering_wheel_angle_rad"].to_numpy() + 2 * math.pi * turns
    return replace(
        drive,
        table=drive.table.with_columns(
            pl.Series("steering_wheel_angle_rad", angle), steering_wheel_angle_sensor_type=pl.lit(0.0)
        ),
    )


@pytest.mark.parametrize("break_s", [0.0, 20.0])
@pytest.mark.parametrize("offset_deg", [2.0, -170.0, 175.0])
def test_whole_turns_added_at_ignitions_do_not_change_the_offset(break_s: float, offset_deg: float) -> None:
    drive = steady_drive(offset_deg=offset_deg)
    time = drive.table["time_s"].to_numpy()
    breaks = ((time >= 90.0) & (time < 90.0 + break_s)) | ((time >= 170.0) & (time < 170.0 + break_s))
    off = np.where(breaks, math.nan, 0.0)
    turns = np.where(time < 90.0, -1, np.where(time < 170.0, 2, 0))
    unknown = [(time >= 90.0) & (time < 90.48), (time >= 170.0) & (time < 170.48)]  # the turn, after a mere jump
    known = off + np.where(np.any(unknown, axis=0), math.nan, 0.0)
    jumped, absolute = oc.offset(relative(drive, turns + off), TRUCK), oc.offset(relative(drive, known), TRUCK)
    assert jumped.offset.value == pytest.approx(absolute.offset.value, abs=1e-9)
    assert jumped.offset.ci95 == pytest.approx(absolute.offset.ci95, abs=1e-9)
    note = next(note for note in jumped.notes if "whole turns" in note)
    begin = 90 + round(break_s), 170 + round(break_s)
    assert note.endswith(f": -1 from 8 s on, +2 from {begin[0]} s on, +0 from {begin[1]} s on")
    assert not any("whole turns" in note for note in absolute.notes)
    assert np.nanmax(np.abs(oc.trace(jumped)["offset_rad"] - oc.trace(absolute)["offset_rad"])) < 1e-9


def test_logs_with_different_whole_turns_have_one_offset() -> None:
    first, second = steady_drive(), steady_drive(start_s=1000.0)
    ones = np.ones(first.table.height)
    answer = by_thesis([relative(first, 3 * ones), relative(second, -2 * ones)])
    assert answer.offset.value == pytest.approx(2.0 * DEGREE, abs=0.05 * DEGREE)
    assert answer.offset.status == "valid"
    assert sum("whole turns" in note for note in answer.notes) == 2


def test_an_absolute_sensor_keeps_its_whole_turns() -> None:
    answer = by_thesis(steady_drive(offset_deg=362.0))
    assert answer.offset.value == pytest.approx(362.0 * DEGREE, abs=0.05 * DEGREE)
    assert answer.notes == ()


def test_whole_turns_are_removed_from_a_drive_without_vehicle_speed() -> None:
    drive = steady_drive()
    turns = np.where(drive.table["time_s"].to_numpy() < 90.0, -1, 2)
    blind = replace(relative(drive, turns), table=relative(drive, turns).table.drop("vehicle_speed_m_s"))
    [kept] = without_whole_turns([blind])
    off = kept.table["steering_wheel_angle_rad"] - drive.table["steering_wheel_angle_rad"]
    assert off.abs().max() == pytest.approx(0.0, abs=1e-9)


def test_an_error_from_another_process_arrives_unchanged() -> None:
    sent = OncenterError("no drive", code="no_drive", exit_code=2, needs=("yaw_rate",))
    came = pickle.loads(pickle.dumps(sent))
    assert (str(came), came.code, came.exit_code, came.needs) == ("no drive", "no_drive", 2, ("yaw_rate",))


def cause(name: str, sd_deg: float) -> Cause:
    return Cause(name, 0.05, sd_deg * DEGREE, Prior(0.05, "assumed"))


@pytest.mark.parametrize(
    ("sds", "said"),
    [
        ({"pull": 0.4, "mean_wind": 0.15}, "a pull or crosswind"),
        ({"pull": 0.4, "mean_wind": 0.05}, "a pull"),
        ({"pull": 0.4, "mean_wind": 0.2, "axle_set_up": 0.5}, "a pull, crosswind or axle set up for the crown"),
        ({"pull": 0.1, "axle_set_up": 0.9}, "an axle set up for the crown"),
        ({"pull": 0.02, "mean_wind": 0.01}, ""),
        ({}, ""),
    ],
)
def test_the_words_name_the_causes_that_matter(sds: dict[str, float], said: str) -> None:
    causes = tuple(cause(name, sd) for name, sd in sds.items())
    assert in_words(causes) == said
    answer = replace(oc.offset(steady_drive(), TRUCK), not_identifiable=causes)
    more = 1.96 * math.hypot(*sds.values())
    assert (f"; {said} can add ± {more:.1f} deg" in answer.words()) is bool(said)


@pytest.mark.parametrize(
    ("half_width_deg", "said"), [(0.123, "2.0 deg ± 0.1"), (0.05, "2.00 deg ± 0.05"), (3.0, "2.0 deg ± 3.0")]
)
def test_a_half_width_is_never_printed_as_zero(half_width_deg: float, said: str) -> None:
    given = oc.offset(steady_drive(), TRUCK)
    drive = tuple((2.0 + sign * half_width_deg) * DEGREE for sign in (-1.0, 1.0))
    answer = replace(given, offset=replace(given.offset, value=2.0 * DEGREE), offset_ci95_drive=drive)
    assert answer.words().startswith(f"straight-ahead offset {said} from this drive")
