"""The verdicts: words and decision agree, no healthy truck is accused, and an undecided answer names the driving."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from typing import Any

import polars as pl
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import oncenter
from oncenter.cli import run
from oncenter.cli.offset import as_table
from oncenter.errors import OncenterError
from oncenter.estimates.cause import Cause, Prior, Pull
from oncenter.estimates.changes import Change
from oncenter.estimates.estimate import Estimate
from oncenter.findings import Finding
from oncenter.offset.answer import Answer
from oncenter.plausibility.signal_fault import SignalFault, finding_of
from oncenter.signals import DEGREE, Signals
from oncenter.vehicle import vehicle_from
from oncenter.verdict import LIMIT_DEG, Verdict, verdicts_of

TRUCK = oncenter.vehicle("scania_r730_4x2")


@pytest.fixture(scope="module")
def drive() -> Signals:
    return oncenter.simulate("thesis_drive", seed=1)[0]


@cache
def some_answer() -> Answer:
    """An answer for tests whose fixture would be one for all of hypothesis's examples; no prior decides it."""
    return replace(oncenter.offset(oncenter.simulate("step_steer", seed=1)[0], TRUCK), by_priors=())


@pytest.fixture(scope="module")
def answer(drive: Signals) -> Answer:
    return oncenter.offset(drive, TRUCK)


def estimate(value_deg: float, half_width_deg: float, status: str = "valid") -> Estimate:
    around = (value_deg - half_width_deg, value_deg + half_width_deg)
    return Estimate(value_deg * DEGREE, (around[0] * DEGREE, around[1] * DEGREE), status, "rad")


def with_offset(
    answer: Answer, value_deg: float, drive_deg: float = 0.1, whole_deg: float = 0.1, status: str = "valid"
) -> Answer:
    """An answer with this offset and half-widths, and a pull as the cause of what the drive does not separate."""
    pull = Cause("pull", 0.05, (whole_deg - drive_deg) * DEGREE / 1.96, Prior(0.05, ""))
    of_drive = ((value_deg - drive_deg) * DEGREE, (value_deg + drive_deg) * DEGREE)
    offset = estimate(value_deg, whole_deg, status)
    return replace(answer, offset=offset, offset_ci95_drive=of_drive, not_identifiable=(pull,), findings=(), changes=())


def about_offset(answer: Answer, limit_deg: float | None = None) -> Verdict:
    return verdicts_of(answer, limit_deg)[0]


def about(answer: Answer, what: str) -> Verdict:
    return next(each for each in verdicts_of(answer) if each.about == what)


def with_finding(answer: Answer, code: str, value: float | None = None, severity: str = "warning") -> Answer:
    text = f"the text of {code}"
    return replace(answer, findings=(Finding(code, severity, text, value),))


def test_an_offset_whose_whole_interval_is_beyond_the_limit_is_recalibrated(answer: Answer) -> None:
    found = about_offset(with_offset(answer, 2.46))
    assert found.state == "recalibrate"
    assert found.headline == "Recalibrate: straight-ahead offset +2.5 deg ± 0.1 (limit 2 deg)."
    assert found.action == "Add -2.5 deg."


def test_an_offset_with_the_limit_inside_its_interval_is_undecided_and_needs_another_drive(answer: Answer) -> None:
    found = about_offset(with_offset(answer, 1.96))
    assert found.state == "undecided"
    assert found.headline == (
        "Undecided: straight-ahead offset +2.0 deg ± 0.1 is too close to the limit of 2 deg to decide."
    )
    assert found.action == "Log another drive, and give both logs to oncenter together."


def test_an_offset_below_the_limit_needs_nothing(answer: Answer) -> None:
    found = about_offset(with_offset(answer, 0.4))
    assert found.state == "within"
    assert found.headline == "Within the limit: straight-ahead offset +0.4 deg ± 0.1 (limit 2 deg)."
    assert (found.action, found.note) == ("No action.", "")


@given(
    value=st.floats(-6.0, 6.0),
    half_width=st.floats(0.01, 0.5),
    limit=st.sampled_from([0.5, 1.0, 1.95, 2.0, 2.04, 3.0]),
)
@example(value=0.0, half_width=0.49999999999999994, limit=0.5)
def test_printed_numbers_and_decision_never_disagree(value: float, half_width: float, limit: float) -> None:
    found = about_offset(with_offset(some_answer(), value, half_width, half_width), limit)
    printed = found.headline.partition("± ")[2].split()[0]
    shown, around = float(found.headline.partition("offset ")[2].split()[0]), float(printed)
    digits = len(printed.partition(".")[2])
    low, high = (round(shown + sign * around, digits) for sign in (-1, 1))
    place = "over" if low >= limit or high <= -limit else "within" if max(-low, high) < limit else "undecided"
    assert found.state in ({"over": ("recalibrate", "over")}.get(place, (place,)))
    assert found.state != "recalibrate" or f"Add {-shown + 0.0:+.{digits}f} deg" in found.action


@given(status=st.sampled_from(["converging", "unobservable", "invalid"]), value=st.floats(-30.0, 30.0))
def test_only_a_valid_offset_is_recalibrated(status: str, value: float) -> None:
    assert about_offset(with_offset(some_answer(), value, status=status)).state != "recalibrate"


def test_a_pull_that_is_only_possible_is_a_second_line_and_does_not_decide(answer: Answer) -> None:
    found = about_offset(with_offset(answer, 2.5, 0.1, 0.9))
    assert found.state == "recalibrate"
    assert found.note == (
        "When the truck drives straight ahead, the sensor reads 2.5 deg to the left. A pull, which one drive cannot "
        "separate, could add ± 0.8 deg."
    )
    assert about_offset(with_offset(answer, 1.5, 0.1, 0.9)).state == "within"
    assert "could add ± 0.8 deg" in about_offset(with_offset(answer, 1.5, 0.1, 0.9)).note
    assert "could add" not in about_offset(with_offset(answer, 4.0, 0.1, 0.9)).note


def test_a_strong_wind_is_named_where_it_would_explain_an_offset_over_the_limit(answer: Answer) -> None:
    """0.2 m/s^2 at 7.5 deg per m/s^2: 1.5 deg."""
    wind = Cause("mean_wind", 0.02, 0.1 * DEGREE, Prior(0.02, ""))
    windy = {"not_identifiable": (wind,), "offset_per_acceleration": 7.5 * DEGREE}
    named = "A strong wind from one side during the whole drive, or a large pull, could explain it (± 1.5 deg)"
    for value, is_named in ((3.4, True), (-3.4, True), (3.7, False), (1.0, False)):
        found = about_offset(replace(with_offset(answer, value, 0.1, 0.15), **windy))
        assert (named in found.note) == is_named, value
        assert found.state == ("within" if value == 1.0 else "recalibrate")


def test_a_measured_pull_says_align_first(answer: Answer) -> None:
    pulling = replace(with_offset(answer, 2.5, 0.1, 0.9), pull=Pull(0.2, 0.03, 1.6))
    found = about_offset(pulling)
    assert found.state == "recalibrate"
    assert found.action == "Align the wheels before you recalibrate. Add -2.5 deg."
    assert "Align first: the truck pulls by +0.20 ± 0.06 m/s^2, which moves the offset by 1.6 deg." in found.note
    unsure = replace(pulling, pull=Pull(0.05, 0.03, 0.4))
    assert "Align" not in about_offset(unsure).words() and "could add" in about_offset(unsure).note


def test_an_offset_that_a_pull_alone_explains_is_not_recalibrated(answer: Answer) -> None:
    found = about_offset(with_offset(answer, 2.5, 0.1, 2.6))
    assert found.state == "over" and "pulls to one side" in found.action


def test_a_correction_that_is_applied_already_is_not_added_twice(answer: Answer) -> None:
    corrected = replace(answer, vehicle=TRUCK.model_copy(update={"offset_applied_deg": 1.5}))
    found = about_offset(with_offset(corrected, 3.04))
    assert found.action == "Add -3.0 deg to the +1.5 deg that is applied already: set -1.5 deg."


COLUMNS = [
    f"{words}{end}"
    for words in ("yaw rate", "steering wheel angle", "vehicle speed", "wheel speed", "the yaw rate sensor")
    for end in (" ay", ": ay", "_ay", ". Then ay")
]


@pytest.mark.parametrize("column", COLUMNS)
def test_the_name_of_a_column_accuses_no_other_signal(answer: Answer, column: str) -> None:
    """The accelerometer's own column has the name of another signal: only the accelerometer is accused."""
    sources = {**answer.sources, "lateral_acceleration": f"column {column}"}
    fault = finding_of(SignalFault("reversed", ("lateral_acceleration",), 0.0, sources, TRUCK))
    found = replace(with_offset(answer, 3.0, status="invalid"), sources=sources, findings=(fault,))
    assert column in fault.text and column in about(found, "accelerometer").said
    accused = {verdict.about for verdict in verdicts_of(found) if verdict.state == "check_signal"}
    assert accused - {"straight-ahead offset"} == {"accelerometer"}


@pytest.mark.parametrize(
    ("applied_deg", "own", "left_positive"),
    [
        (0.0, "add +3.0 deg.", "-3.0 deg."),
        (
            -1.5,
            "add +3.0 deg to the +1.5 deg that is applied already: set +4.5 deg.",
            "-3.0 deg to the -1.5 deg that is applied already: set -4.5 deg.",
        ),
    ],
)
def test_a_network_that_counts_right_as_positive_gets_the_correction_in_its_own_count_first(
    answer: Answer, applied_deg: float, own: str, left_positive: str
) -> None:
    entry = {"steering_wheel_angle": {"name": "EPS.Angle", "unit": "deg", "sign": -1}}
    truck = vehicle_from({"wheelbase_m": 3.7, "steering_ratio": 19.3, "signals": entry}, "t.toml")
    truck = truck.model_copy(update={"offset_applied_deg": applied_deg})
    found = about_offset(with_offset(replace(answer, vehicle=truck), 3.04))
    assert found.action == f"In the count of this truck's network, where right is positive, {own}"
    assert "reads 3.0 deg to the left. A tool whose angle falls in a turn to the right counts left" in found.note
    assert f"as positive, and needs {left_positive}" in found.note
    to_right = about_offset(with_offset(replace(answer, vehicle=truck), -3.04))
    assert "where right is positive, add -3.0 deg" in to_right.action and "3.0 deg to the right" in to_right.note
    not_reversed = about_offset(with_offset(answer, 3.04))
    assert not_reversed.action.startswith("Add -3.0 deg") and "A tool" not in not_reversed.note


def test_an_interval_beyond_the_limit_says_so_before_it_is_exact(answer: Answer) -> None:
    far = replace(with_offset(answer, 6.0, 1.5, 1.96, "converging"), missing_loading_s=(0.0, 2.0))
    found = about_offset(far)
    assert found.state == "over"
    assert found.headline == (
        "Over the limit: at least 4.0 deg; drive 1 more minute of right-hand bends before you recalibrate."
    )
    assert about_offset(with_offset(answer, 3.0, 1.5, 1.96, "converging")).state == "undecided"


@pytest.mark.parametrize(
    ("missing_s", "wanted"),
    [
        ((0.0, 2.0), "drive 1 more minute of right-hand bends"),
        ((70.0, 0.0), "drive 2 more minutes of left-hand bends"),
        ((20.0, 20.0), "drive 1 more minute of left-hand bends and 1 more minute of right-hand bends"),
    ],
)
def test_a_side_that_was_never_loaded_is_the_driving_that_is_missing(
    answer: Answer, missing_s: tuple[float, float], wanted: str
) -> None:
    one_sided = replace(with_offset(answer, 1.0, 4.0, 4.0, "converging"), missing_loading_s=missing_s)
    found = about_offset(one_sided)
    assert (found.state, found.headline) == ("undecided", f"Undecided: {wanted}.")
    assert "+1.0 deg ± 4.0 (limit 2 deg)" in found.note and "both logs" in found.action


def test_a_wide_interval_requests_the_driving_that_narrows_it_most(answer: Answer) -> None:
    wide = with_offset(answer, 1.0, 1.0, 1.2, "converging")
    stand = replace(wide, next_driving=("stand still for 1 s", "drive 60 s more like this"))
    assert about_offset(stand).headline.startswith("Undecided: stand still for 1 s")
    more = replace(wide, next_driving=("drive at least 60 s of left-hand bends, or give the play in the vehicle file",))
    assert about_offset(more).headline == "Undecided: drive at least 60 s of left-hand bends."
    assert "10 more minutes" in about_offset(replace(wide, next_driving=())).headline


def test_a_truck_that_was_too_slow_is_asked_to_go_faster(drive: Signals) -> None:
    parking = oncenter.offset(replace(drive, table=drive.table[:1500]), TRUCK)
    found = about_offset(parking)
    assert found.headline == "Not determined: drive 1 more minute faster than 11 km/h, with bends to both sides."


def test_driving_that_the_gate_rejected_is_asked_for_in_the_way_that_the_gate_takes(answer: Answer) -> None:
    lacks = replace(
        with_offset(answer, 1.0, 3.0, 3.0, "converging"), used_s=5.0, missing_loading_s=(0.0, 0.0), findings=()
    )
    for reason, wanted in {
        "speed": "faster than",
        "lateral_acceleration": "more slowly in bends",
        "longitudinal_acceleration": "at a steady speed",
        "curvature": "in wider bends",
    }.items():
        found = about_offset(replace(lacks, rejected_s={"speed": 10.0, reason: 100.0}))
        assert wanted in found.headline, reason
        assert ("faster" in found.headline) == (reason == "speed")


def test_little_driving_requests_more(answer: Answer) -> None:
    little = replace(with_offset(answer, 1.0, 3.0, 3.0, "converging"), used_s=20.0, rejected_s={})
    assert about_offset(little).headline.startswith("Undecided: drive 1 more minute faster than 11 km/h")
    assert "Only 20 s" in about_offset(little).note


@pytest.mark.parametrize(
    ("code", "wanted"),
    [
        ("gate_shut", "check the signals"),
        ("lateral_acceleration_moves", "check the accelerometer"),
        ("no_understeer", "drive 5 more minutes with tighter bends"),
    ],
)
def test_the_cause_that_no_driving_of_the_same_kind_cures_comes_first(answer: Answer, code: str, wanted: str) -> None:
    found = about_offset(with_finding(with_offset(answer, 1.0, 1.0, 1.2, "converging"), code, 0.5))
    assert found.headline.startswith(f"Undecided: {wanted}")


@pytest.mark.parametrize("fault", ["drifting", "remounted"])
def test_a_sensor_at_fault_is_repaired_and_its_offset_not_used(answer: Answer, fault: str) -> None:
    broken = replace(with_offset(answer, 3.0, status="invalid"), sensor_fault=fault)
    found = about_offset(broken)
    assert found.state == "repair" and found.headline.startswith("Repair: the steering wheel angle sensor ")
    assert found.note == "The straight-ahead offset +3.0 deg ± 0.1 is from before the fault: do not use it."
    assert about(broken, "steering wheel angle sensor").state == "repair"


@pytest.mark.parametrize("fault", ["lost", "stuck", "wrong_sign"])
def test_data_that_a_file_can_give_as_well_as_a_sensor_needs_a_check_of_both_and_no_repair(
    answer: Answer, fault: str
) -> None:
    broken = replace(with_offset(answer, 3.0, status="invalid"), sensor_fault=fault)
    for found in (about_offset(broken), about(broken, "steering wheel angle sensor")):
        assert found.state == "signal_or_sensor"
        assert found.headline.startswith("Signal or sensor: ") and found.action.startswith("Check both: first its ")
        assert "epair" not in found.words() and "replace" not in found.words()
    stuck = Finding(
        "signal_stuck", "error", "the steering wheel angle stays at one value", signals=("steering_wheel_angle",)
    )
    with_error = about_offset(replace(broken, findings=(stuck,)))
    assert with_error.state == "signal_or_sensor"


def test_an_error_in_a_signal_outranks_a_fault_of_the_sensor(answer: Answer) -> None:
    jumped = replace(with_offset(answer, 3.0, status="invalid"), sensor_fault="jumped")
    error = Finding("scale", "error", "the yaw rate is 57 times too large: check its unit", signals=("yaw_rate",))
    found = replace(jumped, findings=(error,))
    assert about_offset(found).state == "check_signal" and about(found, "yaw rate sensor").state == "check_signal"
    assert about(found, "steering wheel angle sensor").state == "not_measured"


def test_a_reversed_angle_is_no_sensor_fault_where_the_signals_contradict_each_other(answer: Answer) -> None:
    """The sensor check trusts the yaw rate; the mistake may be there, or in an entry of the vehicle file."""
    text = "the sign of either the yaw rate or the steering wheel angle is reversed: left turns must be positive"
    both = ("yaw_rate", "steering_wheel_angle")
    broken = replace(with_offset(answer, 3.0, status="invalid"), sensor_fault="wrong_sign")
    sources = {"steering_wheel_angle": "angle", "yaw_rate": "gyro"}
    found = about_offset(
        replace(broken, sources=sources, findings=(Finding("sign_reversed", "error", text, signals=both),))
    )
    assert (found.state, found.headline) == (
        "check_signal",
        "Check the signal: steering wheel angle (angle) and yaw rate (gyro).",
    )
    assert about_offset(broken).action.startswith("Check both: first its sign in the [signals] table of the vehicle")


def test_signals_that_contradict_each_other_name_the_one_at_fault(drive: Signals) -> None:
    reversed_yaw_rate = drive.table.with_columns(-pl.col("yaw_rate_rad_s"))
    found = oncenter.offset(replace(drive, table=reversed_yaw_rate), TRUCK)
    verdict = about_offset(found)
    assert verdict.state == "check_signal"
    assert verdict.headline == f"Check the signal: yaw rate ({found.sources['yaw_rate']})."
    assert about(found, "yaw rate sensor").state == "check_signal"
    assert about(found, "accelerometer").state != "check" and about(found, "steering wheel angle sensor").state == "ok"


def test_a_relative_sensor_gets_no_correction() -> None:
    relative = oncenter.offset(oncenter.simulate("relative_angle", seed=1)[0], TRUCK)
    found = about_offset(relative, 1.0)
    assert found.state == "no_correction" and "Do not store a correction" in found.action


@pytest.mark.parametrize("method", ["thesis", "wheel-speed"])
def test_a_method_without_free_play_in_its_interval_never_recalibrates(answer: Answer, method: Any) -> None:
    found = about_offset(replace(with_offset(answer, 3.0), method=method))
    assert found.state == "over" and "does not include free play" in found.note and "7.5 deg" in found.note
    assert "does not include free play" in about_offset(replace(with_offset(answer, 1.0), method=method)).note
    assert about(replace(answer, method=method), "free play").state == "not_measured"


def test_after_a_change_the_value_is_the_one_after_it(answer: Answer) -> None:
    change = Change("offset", 0, "a.log", 903.0, 900.0, 2 * DEGREE, -3 * DEGREE, -5 * DEGREE, 0.1 * DEGREE)
    changed = replace(with_offset(answer, -3.0), changes=(change,))
    assert about_offset(changed).note == (
        "When the truck drives straight ahead, the sensor reads 3.0 deg to the right. The offset changed by -5.0 deg "
        "15.0 min into a.log, from +2.0 to -3.0 deg: use the value after."
    )
    passing = replace(change, size_rad=0.1 * DEGREE, sd_rad=0.2 * DEGREE)
    assert "changed" not in about_offset(replace(changed, changes=(passing,))).note


def test_several_logs_are_given_together_again(answer: Answer) -> None:
    two = replace(with_offset(answer, 1.0, 1.0, 1.2, "converging"), drives=answer.drives * 2)
    assert "all logs" in about_offset(two).action


@pytest.mark.parametrize(
    ("width", "around", "status", "state"),
    [
        (3.0, 0.4, "valid", "ok"),
        (14.5, 0.4, "valid", "ok"),
        (14.96, 0.4, "valid", "undecided"),
        (15.4, 0.5, "valid", "undecided"),
        (17.0, 0.5, "valid", "repair"),
        (17.0, 0.5, "converging", "not_measured"),
    ],
)
def test_free_play_is_judged_by_the_maintenance_standard(
    answer: Answer, width: float, around: float, status: str, state: str
) -> None:
    found = about(replace(answer, backlash=estimate(width, around, status)), "free play")
    assert found.state == state
    assert state == "not_measured" or "(maintenance limit of free play: 15 deg)" in found.headline


def test_play_that_may_be_none_is_given_as_at_most(answer: Answer) -> None:
    assert "at most 0.9 deg" in about(replace(answer, backlash=estimate(0.5, 0.4)), "free play").headline


@pytest.mark.parametrize(("bias_deg_s", "state"), [(0.05, "ok"), (-0.4, "ok"), (0.8, "check"), (-3.5, "repair")])
def test_the_yaw_rate_sensor_is_judged_by_its_bias(answer: Answer, bias_deg_s: float, state: str) -> None:
    biased = replace(answer, yaw_rate_bias=replace(estimate(bias_deg_s, 0.01), unit="rad/s"))
    found = about(biased, "yaw rate sensor")
    assert found.state == state and f"{bias_deg_s:+.2f} deg/s" in found.headline


def test_a_yaw_rate_bias_that_nothing_measured_or_that_moves_is_no_ok(answer: Answer) -> None:
    unmeasured = replace(answer, yaw_rate_bias=Estimate(None, None, "unobservable", "rad/s"))
    assert about(unmeasured, "yaw rate sensor").state == "not_measured"
    assert about(with_finding(answer, "yaw_rate_bias_moves", 60.0), "yaw rate sensor").state == "check"
    assert about(with_finding(answer, "yaw_rate_bias_moves", 20.0, "info"), "yaw rate sensor").state == "ok"


@pytest.mark.parametrize(
    ("code", "value", "state"),
    [
        ("lateral_acceleration_at_standstill", 0.44, "ok"),  # ground that slopes by 4 % gives the same
        ("lateral_acceleration_at_standstill", 0.9, "check"),
        ("lateral_acceleration_at_standstill", -1.5, "repair"),
        ("lateral_acceleration_moves", 1.4, "signal_or_sensor"),
        ("unloading_off_zero", -0.15, "check"),
    ],
)
def test_the_accelerometer_is_judged_by_the_findings(answer: Answer, code: str, value: float, state: str) -> None:
    assert about(with_finding(answer, code, value), "accelerometer").state == state
    assert about(replace(answer, findings=()), "accelerometer").state == "ok"


def test_each_verdict_is_about_another_thing_and_says_what_to_do(answer: Answer) -> None:
    found = verdicts_of(answer)
    assert len({each.about for each in found}) == len(found) == 5
    assert all(each.headline.endswith(".") and each.action.endswith(".") for each in found)


def test_the_limit_is_the_vehicle_files_unless_another_is_given(answer: Answer) -> None:
    assert TRUCK.offset_limit_deg == LIMIT_DEG == 2.0
    strict = oncenter.vehicle("scania_r730_4x2").model_copy(update={"offset_limit_deg": 0.3})
    one = with_offset(replace(answer, vehicle=strict), 0.4)
    assert about_offset(one).state == "recalibrate" and about_offset(one, 1.0).state == "within"


def test_json_has_verdicts_and_limit_in_the_present_schema_alone(answer: Answer) -> None:
    given = json.loads(answer.to_json())
    assert given["limit_deg"] == 2.0
    assert [each["about"] for each in given["verdicts"]] == [each.about for each in verdicts_of(answer)]
    assert {"about", "state", "word", "headline", "action", "note"} == set(given["verdicts"][0])
    assert not {"verdicts", "limit_deg"} & set(json.loads(answer.to_json("offset-1")))


def test_the_command_line_gives_another_limit(drive: Signals, tmp_path: Any, capsys: Any) -> None:
    log = tmp_path / "drive.parquet"
    drive.table.write_parquet(log)
    offset = ["offset", str(log), "--vehicle", "scania_r730_4x2"]
    assert run([*offset, "--limit", "3"]) == 0
    assert capsys.readouterr().out.startswith("Within the limit: straight-ahead offset +2.0 deg ± 0.1 (limit 3 deg).")
    for bad in ("0", "31", "nan"):
        assert run([*offset, "--limit", bad]) == 2
        assert f"--limit must be 0.1 to 30 deg, got {bad}" in capsys.readouterr().err


def test_a_limit_out_of_range_in_a_vehicle_file_is_refused_by_name(tmp_path: Any) -> None:
    file = tmp_path / "truck.toml"
    file.write_text("wheelbase_m = 3.7\nsteering_ratio = 20.0\noffset_limit_deg = 0\n")
    with pytest.raises(OncenterError, match="offset_limit_deg"):
        oncenter.vehicle(file)


def test_the_side_that_was_loaded_is_named_as_the_reason(answer: Answer) -> None:
    one_sided = replace(with_offset(answer, 1.0, 4.0, 4.0, "converging"), missing_loading_s=(0.0, 2.0))
    assert "Only left-hand bends loaded the steering so far." in about_offset(one_sided).note


def test_a_signal_that_is_missing_matters_until_enough_was_driven(answer: Answer) -> None:
    missing = {"missing_signal": 0.8 * answer.duration_s}
    wide = replace(with_offset(answer, 1.0, 1.0, 1.2, "converging"), rejected_s=missing)
    assert "log all signals" in about_offset(replace(wide, used_s=20.0)).headline
    assert "log all signals" not in about_offset(wide).headline


def test_an_accelerometer_is_accused_with_its_signal_and_not_judged_where_it_is_not_used(answer: Answer) -> None:
    reversed_sign = Finding("sign_reversed", "error", "...", signals=("lateral_acceleration",))
    assert about(replace(answer, findings=(reversed_sign,)), "accelerometer").state == "check_signal"
    without = replace(answer, params={**answer.params, "use_accelerometer": 0.0})
    assert about(without, "accelerometer").headline == "Not measured: not used by this answer."


def test_a_bias_that_the_method_leaves_in_the_offset_or_that_moves_is_to_be_checked(answer: Answer) -> None:
    small = replace(answer, yaw_rate_bias=replace(estimate(0.1, 0.01), unit="rad/s"))
    assert about(with_finding(small, "yaw_rate_bias", 0.1), "yaw rate sensor").state == "ok"
    by_thesis = replace(with_finding(small, "yaw_rate_bias", 0.1), method="thesis")
    assert "not corrected" in about(by_thesis, "yaw rate sensor").headline
    moving = replace(small, yaw_rate_bias=replace(small.yaw_rate_bias, status="invalid"))
    assert about(moving, "yaw rate sensor").state == "undecided"


@pytest.mark.parametrize(
    ("bias_deg_s", "half_width", "status", "state"),
    [
        (0.78, 1.03, "converging", "not_measured"),  # of a real car
        (0.78, 1.03, "valid", "ok"),
        (0.58, 0.05, "valid", "check"),
        (0.52, 0.05, "valid", "ok"),
        (3.02, 0.05, "valid", "check"),
        (3.2, 0.05, "valid", "repair"),
    ],
)
def test_a_yaw_rate_bias_is_accused_only_beyond_its_whole_interval(
    answer: Answer, bias_deg_s: float, half_width: float, status: str, state: str
) -> None:
    bias = replace(estimate(bias_deg_s, half_width, status), unit="rad/s")
    assert about(replace(answer, yaw_rate_bias=bias), "yaw rate sensor").state == state


def test_no_action_never_stands_above_a_verdict_that_needs_one(answer: Answer) -> None:
    worn = replace(with_offset(answer, 0.4), backlash=estimate(17.0, 0.5))
    found = about_offset(worn)
    assert found.state == "within"
    assert found.action == "No recalibration is needed; see below about the free play."
    assert "No action" not in found.words()


def test_whole_turns_are_the_zero_of_the_sensor_and_never_a_number_to_enter(answer: Answer) -> None:
    turned = with_offset(answer, 362.0)
    found = about_offset(turned)
    assert found.state == "over" and turned.correction is None
    assert found.action == (
        "Set the zero of the sensor with the wheels straight ahead. It reads +1 whole turn and +2.0 deg: do not enter "
        "this as a correction."
    )
    assert "Add" not in found.words() and "Add" not in str(turned)


def test_a_narrow_interval_that_is_not_valid_is_not_called_too_wide(answer: Answer) -> None:
    change = Change("offset", 0, "a.log", 903.0, 900.0, 2 * DEGREE, -3 * DEGREE, -5 * DEGREE, 0.1 * DEGREE)
    late = replace(with_offset(answer, -3.0, 0.1, 0.9, status="converging"), changes=(change,))
    note = about_offset(late).note
    assert "too wide" not in note and "changed late in the drive" in note
    assert "still moves" in about_offset(replace(late, changes=())).note


def test_an_answer_prints_the_verdict_that_the_command_line_prints(answer: Answer) -> None:
    small = with_offset(answer, 0.7)
    assert str(small).startswith("Within the limit: straight-ahead offset +0.7 deg ± 0.1 (limit 2 deg). No action.")
    assert "recalibrate" not in str(small) and as_table(small).splitlines()[0] == str(small).splitlines()[0]
