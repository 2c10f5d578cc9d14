"""The hypothesis set on simulated drives: accuracy, validity, robustness."""

import itertools
import math

import numpy as np
import pytest
from joint_drives import (
    ANGLE,
    CREEPING,
    DURATION_S,
    MIRRORED,
    RATE_HZ,
    RUBBING,
    TIGHT,
    YAW_RATE,
    accelerometer_bias,
    answer_of,
    core_for,
    driven,
    holds,
    numbers,
    ran,
    state_of,
    status,
)

from oncenter import _core
from oncenter._native import ffi, lib
from oncenter.signals import DEGREE

# Accuracy


@pytest.mark.long
@pytest.mark.parametrize(
    ("steering", "within_deg"),
    [(CREEPING, 0.2), (RUBBING, 0.5), ("", 0.2)],
    ids=["creeping", "rubbing", "little play"],
)
def test_offset_play_and_gradient_are_estimated_together(steering: str, within_deg: float) -> None:
    for seed in (1, 2, 3):
        columns, truth = driven(steering, seed)
        found = answer_of(columns, truth)
        assert found["offset"]["value"] == pytest.approx(truth.offset_rad, abs=within_deg * DEGREE)
        assert found["backlash"]["value"] == pytest.approx(truth.backlash_rad, abs=0.3 * DEGREE)
        assert found["understeer_gradient"]["value"] == pytest.approx(truth.understeer_gradient, rel=0.12)
        assert holds(found["offset"], truth.offset_rad)
        # a rubbing play does not identify the accelerometer's zero: 1.5 deg by the truck's gradient
        assert (status(found["offset"]) == "valid") == (steering != RUBBING)


def test_a_motor_that_steers_behind_lash_while_a_hand_rests_makes_the_offset_less_certain() -> None:
    spells = "carries_s = [[100.0, 330.0], [400.0, 690.0], [750.0, 890.0]]"
    motor = f"lash_deg = 3.0\ndead_band_deg = 0.5\nresting_torque_n_m = 1.5\n{spells}\n"
    columns, truth = driven(f"{CREEPING}\n[steering.overlay_motor]\n{motor}", 3, 900.0)
    found = answer_of(columns, truth)
    assert found["steered_by"] > 2.0 * DEGREE and 300.0 < found["steered_since_s"] < 900.0
    assert status(found["offset"]) != "valid" and holds(found["offset"], truth.offset_rad)
    assert answer_of(*driven(CREEPING, 1))["steered_s"] == 0.0


@pytest.mark.long
def test_the_intervals_of_play_and_neutral_acceleration_hold_the_truth() -> None:
    """Without the lag of the yaw rate the play was 0.25 deg too large, with an sd of 0.1 deg."""
    play, unloading, wider = [], [], []
    for seed in range(1, 13):
        columns, truth = driven('base = "country"\n' + CREEPING, seed)
        found = answer_of(columns, truth)
        play.append(holds(found["backlash"], truth.backlash_rad))
        zero = truth.unloading_acceleration_m_s2 + truth.lateral_acceleration_bias_m_s2
        unloading.append(holds(found["unloading_acceleration"], zero))
        wider.append(found["backlash"]["value"] - truth.backlash_rad)
    assert sum(play) >= 11
    assert sum(unloading) >= 10
    assert np.median(wider) < 0.2 * DEGREE


@pytest.mark.parametrize(("method", "lag_s"), [("joint", 0.04), ("thesis", 0.0), ("wheel-speed", 0.0)])
def test_only_the_joint_method_delays_the_angle_by_the_lag_of_the_yaw_rate(method: str, lag_s: float) -> None:
    design = core_for(driven()[1], method=method)._coefficients.preprocess
    delay_s = (design.delay_ticks + design.delay_fraction) / RATE_HZ
    assert delay_s - lib.oc_lowpass_delay(3.0, 2.0, RATE_HZ) == pytest.approx(lag_s, abs=1e-12)


def test_a_few_seconds_on_the_other_flank_do_not_exclude_play() -> None:
    """Entries of roundabouts are such: 9 deg of play were once estimated as none, and half of it as offset. Where play
    was identified, a few seconds suffice."""
    columns, truth = driven(CREEPING, 1)
    core = core_for(truth)
    core.run(columns)
    joint = core._state.evidence.joint
    joint.hypotheses[0] = joint.hypotheses[joint.best]
    best, joint.best, joint.count = 0, 0, 1  # a set of one hypothesis
    sds = {}
    for play_deg in (0.2, 8.0):
        joint.hypotheses[best].play.half_width = 0.5 * play_deg * DEGREE
        for loaded_s in (1.0, 15.0, 1000.0):
            joint.loaded_left_s, joint.loaded_right_s = 1000.0, loaded_s
            joint.hypotheses[best].left_before = joint.hypotheses[best].right_before = 0.0
            answer = core.answer()
            sds[play_deg, loaded_s] = answer["offset"]["standard_deviation"]
            needed_s = 20.0 if play_deg < 2.0 else 1.0 if loaded_s > 1.0 else 2.0
            assert answer["lacking_to_right"] == pytest.approx(max(needed_s - loaded_s, 0.0))
    assert sds[0.2, 15.0] > 3.0 * sds[0.2, 1000.0]
    assert sds[8.0, 15.0] == pytest.approx(sds[8.0, 1000.0])
    assert sds[0.2, 1.0] > sds[0.2, 15.0]
    assert sds[8.0, 1.0] > sds[8.0, 15.0]


@pytest.mark.long
def test_side_slip_in_short_bends_does_not_reduce_the_gradient() -> None:
    """With a smoothed bank that lags by a second the gradient was 2 to 5 % too small."""
    shares = []
    for seed in range(1, 9):
        columns, truth = driven('base = "country"\n', seed)
        shares.append(answer_of(columns, truth)["understeer_gradient"]["value"] / truth.understeer_gradient)
    assert np.mean(shares) == pytest.approx(1.0, abs=0.012)


@pytest.mark.parametrize("bias", [0.3, -0.3])
def test_play_separates_the_accelerometer_bias_from_the_offset(bias: float) -> None:
    """The thesis's method attributes it to the offset, and play as well."""
    columns, truth = driven(CREEPING + accelerometer_bias(bias), 4)
    found = answer_of(columns, truth)
    assert found["unloading_acceleration"]["value"] == pytest.approx(bias, abs=0.05)
    assert found["offset"]["value"] == pytest.approx(truth.offset_rad, abs=0.3 * DEGREE)
    by_mean = answer_of(columns, truth, method="thesis")["offset"]
    assert abs(by_mean["value"] - truth.offset_rad) > 2.0 * DEGREE


@pytest.mark.slow
def test_a_wrong_prior_of_the_crown_does_not_move_the_neutral_acceleration_of_a_play() -> None:
    """Left-hand traffic is given, the roads fall to the right: an apparent accelerometer bias of 0.4 m/s^2."""
    held = accurate = 0
    for seed in range(1, 25):
        columns, truth = driven(CREEPING, seed)
        found = answer_of(columns, truth, traffic_side=-1.0)
        held += holds(found["offset"], truth.offset_rad)
        neutral_error = found["unloading_acceleration"]["value"] - truth.unloading_acceleration_m_s2
        accurate += abs(neutral_error) < 0.05 and abs(found["offset"]["value"] - truth.offset_rad) < 0.2 * DEGREE
    assert held >= 22
    assert accurate >= 18


def test_a_mirrored_drive_has_the_mirrored_answer() -> None:
    """The answers differ in the last digits, since the order of the hypotheses and of their replacements differs."""
    columns, truth = driven(CREEPING, 2)
    mirrored = {n.replace("left", "?").replace("right", "left").replace("?", "right"): c for n, c in columns.items()}
    mirrored |= {name: -columns[name] for name in MIRRORED}
    there, back = answer_of(columns, truth), answer_of(mirrored, truth, traffic_side=-1.0)
    assert back["offset"]["value"] == pytest.approx(-there["offset"]["value"], abs=0.05 * DEGREE)
    assert back["unloading_acceleration"]["value"] == pytest.approx(-there["unloading_acceleration"]["value"], abs=5e-3)
    for name in ("offset", "understeer_gradient", "backlash"):
        sd = there[name]["standard_deviation"]
        assert abs(back[name]["value"]) == pytest.approx(abs(there[name]["value"]), abs=0.5 * sd)
    sd = there["offset"]["standard_deviation"]
    assert back["offset"]["standard_deviation"] == pytest.approx(sd, rel=0.02)


@pytest.mark.parametrize("rate_hz", [20.0, 50.0, 200.0])
def test_the_sample_rate_does_not_decide(rate_hz: float) -> None:
    columns, truth = driven(CREEPING, 2)
    t = columns["time_s"]
    other_t = np.arange(t[0], t[-1], 1.0 / rate_hz)
    others = {name: np.interp(other_t, t, column) for name, column in columns.items()} | {"time_s": other_t}
    there, back = answer_of(columns, truth), answer_of(others, truth, rate_hz=rate_hz)
    assert back["offset"]["value"] == pytest.approx(there["offset"]["value"], abs=0.2 * DEGREE)
    sd = there["offset"]["standard_deviation"]
    assert back["offset"]["standard_deviation"] == pytest.approx(sd, rel=0.1)
    assert back["backlash"]["value"] == pytest.approx(there["backlash"]["value"], abs=0.4 * DEGREE)
    assert back["understeer_gradient"]["value"] == pytest.approx(there["understeer_gradient"]["value"], rel=0.03)
    assert back["used"] == pytest.approx(there["used"], rel=0.05)


# Validity


def test_with_one_flank_loaded_the_offset_is_not_valid() -> None:
    """8 deg of play, left-hand bends only, crown to the right: the other flank is not identifiable."""
    for seed in (1, 2, 3):
        columns, truth = driven('base = "bypass"\n', seed)
        outputs = ran(columns, core_for(truth))
        assert not (outputs["offset_status"] == _core.STATUSES.index("valid")).any()
        late = outputs[12_000:]
        assert (np.abs(late["offset"] - truth.offset_rad) < 1.96 * late["offset_sd"]).all()


def test_an_offset_that_the_prior_of_the_accelerometer_decides_is_not_valid_whatever_the_limit() -> None:
    """In a rubbing steering the prior decides; a creeping one is valid with the same limit."""
    wide = {"offset_half_width_max_rad": 3.0 * DEGREE}
    for steering, expected in ((RUBBING, "converging"), (CREEPING, "valid")):
        columns, truth = driven(steering, 2)
        core = core_for(truth, params=wide)
        core.run(columns)
        found = core.answer()["offset"]
        assert 1.96 * found["standard_deviation"] < wide["offset_half_width_max_rad"]
        assert status(found) == expected


def test_a_moment_on_the_other_flank_does_not_give_a_narrow_interval_of_the_play() -> None:
    """14 deg of play in towns on a crown of 4 %, without tight bends: plays of 8 to 14 deg fit equally well, and the
    offset differs by 3 deg."""
    for seed in (1, 2, 3):
        steering = "[steering]\nbacklash_deg = 14.0\nking_pin_friction_n_m = 60.0\n"
        town = f'base = "town"\n{steering}[road]\ncrown_percent = 4.0\n'
        found = answer_of(
            *driven(town, seed, 1200.0), params={"joint_speed_min_m_s": 8.0, "joint_curvature_max_1_m": 0.01}
        )
        assert found["lacking_to_right"] <= 2.0
        assert found["backlash"]["standard_deviation"] > 1.3 * DEGREE
        assert found["offset"]["standard_deviation"] > 0.7 * DEGREE


def test_an_apparently_oversteering_truck_is_not_valid() -> None:
    """On motorways most such estimates are wrong: play is attributed to the gradient."""
    columns, truth = driven(CREEPING, 1)
    turning = np.nan_to_num(columns[YAW_RATE] * columns["vehicle_speed_m_s"])
    measured = columns["lateral_acceleration_m_s2"] - truth.lateral_acceleration_bias_m_s2
    carried = turning + np.nanmean(measured - turning)
    for understeers, expected in ((1.0, "valid"), (-0.3, "converging")):
        less = (1.0 - understeers) * truth.steering_ratio * truth.understeer_gradient * carried
        found = answer_of(columns | {ANGLE: columns[ANGLE] - less}, truth)
        assert math.copysign(1.0, found["understeer_gradient"]["value"]) == math.copysign(1.0, understeers)
        assert status(found["offset"]) == status(found["understeer_gradient"]) == expected
        assert holds(found["offset"], truth.offset_rad)


def test_without_an_accelerometer_banked_bends_identify_neither_flanks_nor_gradient() -> None:
    """8 deg of play on motorways with banked bends: bends to the other side hardly change the flank, and a bend that
    needs little angle looks like a small gradient."""
    gradients_held = flanks_lacking = 0
    for seed in range(1, 7):
        columns, truth = driven('base = "motorway"\n' + CREEPING, seed)
        found = answer_of(columns, truth, params={"use_accelerometer": 0.0})
        assert status(found["offset"]) == "converging" and status(found["understeer_gradient"]) == "converging"
        assert holds(found["offset"], truth.offset_rad)
        flanks_lacking += found["lacking_to_left"] + found["lacking_to_right"] > 0.0
        gradients_held += holds(found["understeer_gradient"], truth.understeer_gradient)
    assert gradients_held >= 5
    assert flanks_lacking >= 5


@pytest.mark.parametrize(
    ("method", "uses_accelerometer", "tyre_share", "discount_max"),
    [("joint", 1, 1.0, 25.0), ("joint", 0, 0.7, 1.0), ("thesis", 0, 1.0, 25.0)],
)
def test_only_the_joint_method_without_an_accelerometer_assumes_banked_bends(
    method: str, uses_accelerometer: int, tyre_share: float, discount_max: float
) -> None:
    """It then does not discount the prior of the crown, since banked bends can imitate a flank."""
    _, truth = driven()
    design = core_for(truth, method=method, params={"use_accelerometer": uses_accelerometer})._coefficients.joint
    assert design.tyre_share == pytest.approx(tyre_share)
    assert design.hypothesis.prior_discount_max == discount_max


@pytest.mark.parametrize(("bank_unmeasured", "lacking_s"), [(0.0, 0.0), (1.0, 0.5)])
def test_identified_play_needs_only_a_moment_on_a_flank_if_the_bank_is_measured(
    bank_unmeasured: float, lacking_s: float
) -> None:
    joint, design = ffi.new("oc_joint *"), ffi.new("oc_joint_design *")
    joint.hypotheses[0].play.half_width = 3.0 * DEGREE
    joint.loaded_right_s, design.bank_unmeasured = 1.5, bank_unmeasured
    assert lib.oc_joint_flank_lacking(joint, design, -1) == lacking_s
    assert lib.oc_joint_flank_lacking(joint, design, 1) == 2.0


def test_superelevated_bends_do_not_hide_the_crown_of_the_straights() -> None:
    columns, truth = driven('base = "country"\n[road]\ncrown_percent = 1.4\n', 11)
    core = core_for(truth, traffic_side=0.0)
    core.run(columns)
    crown = float(state_of(core)["evidence"]["joint"]["crown_bank"]) - truth.lateral_acceleration_bias_m_s2
    assert crown == pytest.approx(1.4 * 0.0980665, abs=0.01)


def test_the_crown_of_few_straights_may_be_far_from_the_usual_one() -> None:
    columns, truth = driven('base = "country"\n[road]\ncrown_percent = 1.4\n', 11)
    core, sd = core_for(truth, traffic_side=0.0), []
    for part in (slice(0, 2_000), slice(2_000, None)):
        core.run({name: column[part] for name, column in columns.items()})
        sd.append(float(state_of(core)["tracking"]["joint"]["prior"]["bank_sd"]))
    assert sd[0] > 0.2 and sd[1] == pytest.approx(0.1, rel=0.05)


def test_superelevated_bends_show_whether_an_axle_is_set_up_for_the_crown() -> None:
    """Half of the usual crown, by which alone both axles are equally probable."""
    for unloads_on, expected in ((0.0, "valid"), (2.0, "converging")):
        steering = f"[steering]\nunloads_on_crown_percent = {unloads_on}\n"
        columns, truth = driven(f'base = "country"\n[road]\ncrown_percent = 1.0\n{steering}', 3)
        found = answer_of(columns, truth, traffic_side=0.0)["offset"]
        assert status(found) == expected
        assert holds(found, truth.offset_rad + truth.straight_ahead_rad)


def test_without_play_the_interval_includes_the_effect_of_the_accelerometer_bias() -> None:
    errors = []
    for seed, bias in enumerate((0.2, -0.2, 0.1, -0.1), 1):
        columns, truth = driven(TIGHT + accelerometer_bias(bias) + "[road]\ncrown_percent = 3.0\n", seed)
        found = answer_of(columns, truth)
        assert holds(found["offset"], truth.offset_rad)
        floor = truth.steering_ratio * truth.understeer_gradient * 0.08  # crown and bias, each 0.1 m/s^2
        assert found["offset"]["standard_deviation"] > floor
        errors.append(found["offset"]["value"] - truth.offset_rad)
    assert max(map(abs, errors)) > 0.3 * DEGREE  # else the test has no effect to cover


# Robustness


def test_the_chunks_of_a_drive_do_not_matter() -> None:
    columns, truth = driven(CREEPING, 1)
    whole, pieces = core_for(truth), core_for(truth)
    whole.run(columns)
    for start, end in itertools.pairwise((0, 7, 30_011, 30_012, 61_234, len(columns["time_s"]))):
        pieces.run({name: column[start:end] for name, column in columns.items()})
    assert pieces.state_bytes() == whole.state_bytes()


def test_an_ignition_during_a_drive_loses_a_few_seconds() -> None:
    """A second or two. A suspected change afterwards may cost half a minute more or less. The truck may have changed
    (docs/truck_over_time.md), so that the drive after it counts for more."""
    columns, truth = driven(CREEPING, 1)
    whole = core_for(truth)
    whole.run(columns)
    there, used = whole.answer(), []
    for cut in (20_000, 30_000, 40_000, 50_000, 60_000):
        parted = core_for(truth)
        for start, end in ((0, cut), (cut, len(columns["time_s"]))):
            parted.restart()
            parted.run({name: column[start:end] for name, column in columns.items()})
        back = parted.answer()
        used.append(back["used"])
        assert back["offset"]["value"] == pytest.approx(there["offset"]["value"], abs=0.1 * DEGREE)
    assert min(used) > 0.93 * there["used"] and max(used) > 0.99 * there["used"]


def test_missing_values_and_holes_cost_only_their_own_time() -> None:
    columns, truth = driven(CREEPING, 2)
    hurt = {name: column.copy() for name, column in columns.items()}
    rng = np.random.default_rng(1)
    for name in (ANGLE, YAW_RATE, "lateral_acceleration_m_s2", "vehicle_speed_m_s"):
        for start in rng.integers(2_000, 80_000, 8):
            hurt[name][start : start + rng.integers(1, 300)] = np.nan
    hurt["time_s"][50_000:] += 30.0
    core = core_for(truth)
    outputs = ran(hurt, core)
    assert all(math.isfinite(number) for number in numbers(state_of(core)))
    assert np.isfinite(outputs["offset"]).all()
    found = core.answer()
    assert found["offset"]["value"] == pytest.approx(truth.offset_rad, abs=0.3 * DEGREE)
    assert found["changes"] == 0


def test_a_new_gyro_bias_after_an_ignition_does_not_change_the_evidence_before_it() -> None:
    """Its correction holds since the ignition. Applied to the drive before, it would move the offset by a degree."""
    before, truth = driven(CREEPING, 1)
    after = driven(CREEPING, 5)[0]
    courses = []
    for bias in (0.0, 0.5 * DEGREE):
        core = core_for(truth)
        core.run(before)
        core.restart()
        courses.append(ran(after | {YAW_RATE: after[YAW_RATE] + bias}, core)["offset"])
        assert core.answer()["changes"] == 0
    np.testing.assert_allclose(courses[1], courses[0], atol=0.07 * DEGREE)


@pytest.mark.parametrize(("has_banks", "moved_m_s2"), [(True, 0.8), (False, 0.0)])
def test_a_late_gyro_bias_corrects_measured_banks(has_banks: bool, moved_m_s2: float) -> None:
    joint = ffi.new("oc_joint *", {"started": 1, "speed_mean": 20.0})
    tracking, design = ffi.new("oc_joint_tracking *"), ffi.new("oc_joint_design *")
    assert lib.oc_joint_correct(joint, tracking, design, 0.04, has_banks)
    assert joint.bank_mean == pytest.approx(moved_m_s2)


def test_a_late_gyro_bias_does_not_change_an_unmeasured_bank() -> None:
    """A bias of 5 deg/s without wheel speeds or accelerometer, identified at the next standstill."""
    columns, truth = driven(CREEPING, 1)
    moving = columns["vehicle_speed_m_s"] > 8.0
    driving = {name: columns[name][moving][:30_000] for name in (ANGLE, YAW_RATE, "vehicle_speed_m_s")}
    standing = {name: np.full(6_000, column[-1]) for name, column in driving.items()}
    standing[YAW_RATE][:] = standing["vehicle_speed_m_s"][:] = 0.0
    whole = {name: np.concatenate([driving[name], standing[name], driving[name]]) for name in driving}
    whole[YAW_RATE] += 5.0 * DEGREE
    whole["time_s"] = np.arange(len(whole[YAW_RATE])) / RATE_HZ
    core = core_for(truth, params={"use_accelerometer": 0})
    assert abs(ran(whole, core)["yaw_rate_bias"][-1] - 5.0 * DEGREE) < 0.1 * DEGREE
    assert state_of(core)["evidence"]["joint"]["bank_mean"] == 0.0


def test_a_jump_of_the_gyro_bias_does_not_change_the_evidence() -> None:
    columns, truth = driven(CREEPING, 1)
    jumping = columns | {YAW_RATE: columns[YAW_RATE] + np.where(columns["time_s"] > 500.0, 0.6 * DEGREE, 0.0)}
    core = core_for(truth)
    outputs, calm = ran(jumping, core), ran(columns, core_for(truth))
    assert (outputs["reasons"] & _core.REASONS["yaw_rate_bias"] > 0).any()
    assert np.abs(outputs["offset"] - calm["offset"])[50_000:].max() < 0.3 * DEGREE
    assert abs(outputs["offset"][-1] - truth.offset_rad) < 0.3 * DEGREE
    assert core.answer()["changes"] == 0


@pytest.mark.long
def test_after_a_day_of_driving_all_numbers_are_finite_and_the_answer_is_unchanged() -> None:
    columns, truth = driven(CREEPING, 1)
    core = core_for(truth)
    for k in range(96):
        core.run(columns | {"time_s": columns["time_s"] + k * DURATION_S})
    found = core.answer()
    assert found["duration"] == pytest.approx(86_400.0)
    assert all(math.isfinite(number) for number in numbers(state_of(core)))
    assert found["offset"]["value"] == pytest.approx(truth.offset_rad, abs=0.2 * DEGREE)
    assert found["changes"] == 0


@pytest.mark.parametrize("steering_deg", [0.0, 20.0], ids=["a hand that never moves", "one that weaves"])
def test_signals_without_noise_give_finite_numbers(steering_deg: float) -> None:
    """Benches and FMUs give such signals: after 15 minutes the residual has no variance."""
    t = np.arange(0.0, 3_600.0, 1.0 / RATE_HZ)
    angle = steering_deg * DEGREE * np.sin(t / 3.0)
    core = _core.Core(3.7, 19.3, {}, RATE_HZ, method="joint", track_width_rear_m=1.8)
    v, r = np.full_like(t, 22.0), 22.0 * angle / (19.3 * 3.7)
    core.run({"time_s": t, ANGLE: angle, YAW_RATE: r, "vehicle_speed_m_s": v, "lateral_acceleration_m_s2": v * r})
    assert all(math.isfinite(number) for number in numbers(state_of(core)))
    assert math.isfinite(core.answer()["offset"]["value"])


def test_contradicting_priors_give_finite_numbers() -> None:
    columns, truth = driven(CREEPING, 1)
    odd = {"accelerometer_bias_sd_m_s2": 10.0, "crown_sd_m_s2": 0.001, "joint_speed_min_m_s": 1.0}
    core = core_for(truth, params=odd)
    core.run(columns)
    assert all(math.isfinite(number) for number in numbers(state_of(core)))


@pytest.mark.parametrize("rate_hz", [20.0, 22.0, 24.9, 25.0, 50.0, 100.0, 200.0])
def test_hypotheses_take_turns_and_complete_the_round_before_the_next_second(rate_hz: float) -> None:
    columns, truth = driven(CREEPING, 1)
    times = np.arange(30.0, 45.0, 1.0 / rate_hz)
    ticks = {name: np.interp(times, columns["time_s"], column) for name, column in columns.items()}
    core = core_for(truth, rate_hz=rate_hz)
    due, collected = [], []
    for k in range(len(times)):
        core.step({name: float(column[k]) for name, column in ticks.items()})
        tracking = state_of(core)["tracking"]["joint"]
        due.append(int(tracking["due"]))
        collected.append(int(tracking["filling"]["count"]))
    begins = np.flatnonzero(np.diff(due) > 0)
    assert all(due[k] == 0 and collected[k + 1] == 0 for k in begins)
    assert len(begins) >= 11
    assert state_of(core)["evidence"]["joint"]["second"]["used_s"] >= 10.0


def test_equations_are_solved_each_second_at_first_then_every_fourth_and_on_probation_every_second_one() -> None:
    """Observed by the model's constant, which changes with each solution."""
    columns, truth = driven(CREEPING, 1)
    core = core_for(truth)
    of_age: dict[str, list[int]] = {"first": [], "on probation": [], "old": []}
    before: dict[int, tuple[float, float]] = {}
    solved_at: dict[int, float] = {}
    for start in range(0, len(columns["time_s"]), 25):
        core.run({name: column[start : start + 25] for name, column in columns.items()})
        joint = state_of(core)["evidence"]["joint"]
        used_s, probation_s = float(joint["second"]["used_s"]), float(joint["second"]["probation_s"])
        for k, hypothesis in enumerate(joint["hypotheses"][: joint["count"]]):
            age, constant = float(hypothesis["age"]), float(hypothesis["constant"])
            if k not in before or age < before[k][0] or age < 3.0 or joint["solves_all"]:
                solved_at.pop(k, None)  # replaced, or corrected by a late bias
            elif constant != before[k][1]:
                kind = "first" if used_s < 119.0 else "on probation" if age < min(probation_s, 59.0) else "old"
                seconds = round(age - solved_at[k]) if k in solved_at else 0
                of_age[kind] += [seconds] if seconds else []
                solved_at[k] = age
            before[k] = (age, constant)
    usual = {kind: int(np.median(seconds)) for kind, seconds in of_age.items()}
    assert usual == {"first": 1, "on probation": 2, "old": 4}
    assert min(map(len, of_age.values())) > 50


def test_a_converged_hypothesis_set_gets_new_hypotheses_half_as_often() -> None:
    columns, truth = driven(CREEPING, 1, 1500.0)
    core = core_for(truth)
    starts: list[float] = []
    taken: list[int] = []
    next_start = 0
    for start in range(0, len(columns["time_s"]), 200):
        core.run({name: column[start : start + 200] for name, column in columns.items()})
        joint = state_of(core)["evidence"]["joint"]
        if joint["next_start"] != next_start:
            starts.append(float(joint["second"]["used_s"]))
            taken.append(next_start)
            next_start = int(joint["next_start"])
    times = np.array(starts)
    assert np.diff(times[times < 600.0]).min() == pytest.approx(40.0, abs=4.0)
    assert np.diff(times[times > 640.0]) == pytest.approx(80.0, abs=4.0)
    assert (times > 640.0).sum() >= 5
    assert taken == [k % lib.OC_JOINT_LATER_STARTS for k in range(len(taken))], "each start in its turn"


def test_a_hypothesis_started_after_a_flank_was_loaded_has_little_weight() -> None:
    core = core_for(driven(CREEPING)[1])
    core.run(driven(CREEPING)[0])
    joint = core._state.evidence.joint
    before = core.answer()["offset"]
    oldest = joint.best
    other = max(set(range(joint.count)) - {oldest}, key=lambda k: joint.hypotheses[k].age)
    for name in ("cost", "age", "variances"):
        setattr(joint.hypotheses[other], name, getattr(joint.hypotheses[oldest], name))
    joint.hypotheses[other].offset = joint.hypotheses[oldest].offset + 3.0 * DEGREE
    as_good = core.answer()["offset"]
    joint.hypotheses[other].right_before = joint.loaded_right_s
    late = core.answer()["offset"]
    for k in range(joint.count):
        joint.hypotheses[k].right_before = joint.loaded_right_s
    one_flank = core.answer()["offset"]
    assert as_good["value"] - before["value"] > 1.0 * DEGREE
    assert late["value"] == pytest.approx(before["value"], abs=0.1 * DEGREE)
    assert one_flank["standard_deviation"] > as_good["standard_deviation"] > late["standard_deviation"]


def test_the_flank_times_at_a_start_are_stored_up_to_the_limit_of_single_precision() -> None:
    """Beyond 24 days, single precision loses 0.1 s, and the time since the start would stay zero."""
    columns, truth = driven(CREEPING, 1, 1200.0)
    for loaded_s, stored in ((0.0, True), (2.0**21, False)):
        core = core_for(truth)
        core.run({name: column[:80_000] for name, column in columns.items()})
        joint = core._state.evidence.joint
        joint.loaded_left_s, joint.loaded_right_s = joint.loaded_left_s + loaded_s, joint.loaded_right_s + loaded_s
        core.run({name: column[80_000:] for name, column in columns.items()})
        newest = min(joint.hypotheses[0 : joint.count], key=lambda h: h.age)
        assert newest.age < 350.0
        assert (newest.left_before > 100.0, newest.right_before > 10.0) == (stored, stored)
