"""The bank of hypotheses on simulated drives: what it finds, what it must not claim, and what it must live through."""

import itertools
import math

import numpy as np
import pytest
from joint_drives import (
    ANGLE,
    CREEPING,
    DEGREE,
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

# What it finds


@pytest.mark.parametrize(
    ("steering", "within_deg"),
    [(CREEPING, 0.2), (RUBBING, 0.5), ("", 0.2)],
    ids=["creeping", "rubbing", "little play"],
)
def test_offset_play_and_gradient_are_found_together(steering: str, within_deg: float) -> None:
    for seed in (1, 2, 3):
        columns, truth = driven(steering, seed)
        found = answer_of(columns, truth)
        assert found["offset"]["value"] == pytest.approx(truth.offset_rad, abs=within_deg * DEGREE)
        assert found["backlash"]["value"] == pytest.approx(truth.backlash_rad, abs=0.3 * DEGREE)
        assert found["understeer_gradient"]["value"] == pytest.approx(truth.understeer_gradient, rel=0.12)
        assert holds(found["offset"], truth.offset_rad)
        # where nothing unloads, the accelerometer's zero is left: 1.5 deg by the truck's gradient
        assert (status(found["offset"]) == "valid") == (steering != RUBBING)


def test_play_and_where_it_is_left_lie_within_their_own_intervals() -> None:
    """A truck that yaws after its wheel seemed to play by a quarter of a degree more, and to know it to a tenth."""
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
def test_only_the_joint_method_lets_the_angle_wait_for_the_truck_to_yaw(method: str, lag_s: float) -> None:
    design = core_for(driven()[1], method=method)._coefficients.preprocess
    waits_s = (design.delay_ticks + design.delay_fraction) / RATE_HZ
    assert waits_s - lib.oc_lowpass_delay(3.0, 2.0, RATE_HZ) == pytest.approx(lag_s, abs=1e-12)


def test_some_seconds_on_the_other_flank_do_not_show_that_there_is_no_play() -> None:
    """As of roundabouts that are entered to the right alone, where 9 deg of play passed for none and half of it for
    offset; that play which was found has another flank takes no more than that."""
    columns, truth = driven(CREEPING, 1)
    core = core_for(truth)
    core.run(columns)
    joint = core._state.evidence.joint
    joint.hypotheses[0] = joint.hypotheses[joint.best]
    best, joint.best, joint.count = 0, 0, 1  # as if all were of one mind
    sds = {}
    for play_deg in (0.2, 8.0):
        joint.hypotheses[best].play.half_width = 0.5 * play_deg * DEGREE
        for seen_s in (1.0, 15.0, 1000.0):
            joint.loaded_left_s, joint.loaded_right_s = 1000.0, seen_s
            joint.hypotheses[best].left_before = joint.hypotheses[best].right_before = 0.0
            answer = core.answer()
            sds[play_deg, seen_s] = answer["offset"]["standard_deviation"]
            needed_s = 20.0 if play_deg < 2.0 else 1.0 if seen_s > 1.0 else 2.0
            assert answer["lacking_to_right"] == pytest.approx(max(needed_s - seen_s, 0.0))
    assert sds[0.2, 15.0] > 3.0 * sds[0.2, 1000.0]
    assert sds[8.0, 15.0] == pytest.approx(sds[8.0, 1000.0])
    assert sds[0.2, 1.0] > sds[0.2, 15.0]
    assert sds[8.0, 1.0] > sds[8.0, 15.0]


def test_side_slip_that_changes_in_short_bends_is_not_taken_for_less_understeer() -> None:
    """Where a_y - r*v came a second late, the gradient was 2 to 5 % too small."""
    shares = []
    for seed in range(1, 9):
        columns, truth = driven('base = "country"\n', seed)
        shares.append(answer_of(columns, truth)["understeer_gradient"]["value"] / truth.understeer_gradient)
    assert np.mean(shares) == pytest.approx(1.0, abs=0.012)


@pytest.mark.parametrize("bias", [0.3, -0.3])
def test_an_accelerometers_bias_is_told_from_the_offset_by_where_the_play_is_left(bias: float) -> None:
    """The thesis's method takes it for offset, play on top."""
    columns, truth = driven(CREEPING + accelerometer_bias(bias), 4)
    found = answer_of(columns, truth)
    assert found["unloading_acceleration"]["value"] == pytest.approx(bias, abs=0.05)
    assert found["offset"]["value"] == pytest.approx(truth.offset_rad, abs=0.3 * DEGREE)
    by_mean = answer_of(columns, truth, method="thesis")["offset"]
    assert abs(by_mean["value"] - truth.offset_rad) > 2.0 * DEGREE


def test_play_is_not_talked_out_of_where_it_is_left_by_a_road_that_falls_to_the_wrong_side() -> None:
    """Traffic told to keep left on roads that fall to the right: the accelerometer seems 0.4 m/s^2 off."""
    held = found_right = 0
    for seed in range(1, 25):
        columns, truth = driven(CREEPING, seed)
        found = answer_of(columns, truth, traffic_side=-1.0)
        held += holds(found["offset"], truth.offset_rad)
        left_at = found["unloading_acceleration"]["value"] - truth.unloading_acceleration_m_s2
        found_right += abs(left_at) < 0.05 and abs(found["offset"]["value"] - truth.offset_rad) < 0.2 * DEGREE
    assert held >= 22
    assert found_right >= 18


def test_a_mirrored_drive_has_the_mirrored_answer() -> None:
    """Hypotheses stand in another order then, and are renewed in another one: not to the last digit."""
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


# What it must not claim


def test_with_one_flank_seen_the_offset_is_not_called_valid() -> None:
    """8 deg of play, all bends to the left, on a crown to the right: where the other flank is nobody knows."""
    for seed in (1, 2, 3):
        columns, truth = driven('base = "bypass"\n', seed)
        outputs = ran(columns, core_for(truth))
        assert not (outputs["offset_status"] == _core.STATUSES.index("valid")).any()
        late = outputs[12_000:]
        assert (np.abs(late["offset"] - truth.offset_rad) < 1.96 * late["offset_sd"]).all()


def test_a_middle_that_the_accelerometers_zero_decides_is_not_called_valid_however_wide_an_interval_may_be() -> None:
    """A prior decides it, whatever the user asks for; a steering that side force moves is called valid then."""
    wide = {"offset_half_width_max_rad": 3.0 * DEGREE}
    for steering, expected in ((RUBBING, "converging"), (CREEPING, "valid")):
        columns, truth = driven(steering, 2)
        core = core_for(truth, params=wide)
        core.run(columns)
        found = core.answer()["offset"]
        assert 1.96 * found["standard_deviation"] < wide["offset_half_width_max_rad"]
        assert status(found) == expected


def test_a_play_whose_other_flank_showed_for_a_moment_is_not_told_to_a_degree() -> None:
    """14 deg of play in towns on a crown of 4 %, tight bends left out: plays of 8 to 14 deg explain the drive alike,
    the offset by 3 deg."""
    for seed in (1, 2, 3):
        steering = "[steering]\nbacklash_deg = 14.0\nking_pin_friction_n_m = 60.0\n"
        town = f'base = "town"\n{steering}[road]\ncrown_percent = 4.0\n'
        found = answer_of(
            *driven(town, seed, 1200.0), params={"joint_speed_min_m_s": 8.0, "joint_curvature_max_1_m": 0.01}
        )
        assert found["lacking_to_right"] <= 2.0
        assert found["backlash"]["standard_deviation"] > 1.3 * DEGREE
        assert found["offset"]["standard_deviation"] > 0.7 * DEGREE


def test_a_truck_that_seems_to_oversteer_is_found_but_not_called_valid() -> None:
    """Of trucks that seem so on motorways most do not: play was taken for gradient."""
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


def test_without_an_accelerometer_banked_bends_show_neither_a_flank_nor_the_gradient() -> None:
    """8 deg of play on motorways that lean into their bends: what turns to the other side hardly leaves its flank, and
    what takes no angle seems to be a truck that does not understeer."""
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
    ("method", "hears", "borne", "doubt"), [("joint", 1, 1.0, 25.0), ("joint", 0, 0.7, 1.0), ("thesis", 0, 1.0, 25.0)]
)
def test_only_the_joint_method_without_an_accelerometer_takes_bends_for_banked(
    method: str, hears: int, borne: float, doubt: float
) -> None:
    """And then lets no flank that banks may feign doubt where the roads' crown is."""
    _, truth = driven()
    design = core_for(truth, method=method, params={"use_accelerometer": hears})._coefficients.joint
    assert design.tyre_share == pytest.approx(borne)
    assert design.hypothesis.prior_discount_max == doubt


@pytest.mark.parametrize(("unseen", "lacking_s"), [(0.0, 0.0), (1.0, 0.5)])
def test_play_that_was_found_shows_a_flank_that_was_hardly_seen_unless_banks_are_not_seen(
    unseen: float, lacking_s: float
) -> None:
    joint, design = ffi.new("oc_joint *"), ffi.new("oc_joint_design *")
    joint.hypotheses[0].play.half_width = 3.0 * DEGREE
    joint.loaded_right_s, design.bank_unmeasured = 1.5, unseen
    assert lib.oc_joint_flank_lacking(joint, design, -1) == lacking_s
    assert lib.oc_joint_flank_lacking(joint, design, 1) == 2.0


def test_without_play_the_interval_covers_what_an_accelerometers_bias_hides() -> None:
    errors = []
    for seed, bias in enumerate((0.2, -0.2, 0.1, -0.1), 1):
        columns, truth = driven(TIGHT + accelerometer_bias(bias) + "[road]\ncrown_percent = 3.0\n", seed)
        found = answer_of(columns, truth)
        assert holds(found["offset"], truth.offset_rad)
        floor = truth.steering_ratio * truth.understeer_gradient * 0.08  # crown and bias, each 0.1 m/s^2
        assert found["offset"]["standard_deviation"] > floor
        errors.append(found["offset"]["value"] - truth.offset_rad)
    assert max(map(abs, errors)) > 0.3 * DEGREE  # or there was nothing to cover


# What it must live through


def test_it_does_not_matter_in_how_many_pieces_a_drive_arrives() -> None:
    columns, truth = driven(CREEPING, 1)
    whole, pieces = core_for(truth), core_for(truth)
    whole.run(columns)
    for start, end in itertools.pairwise((0, 7, 30_011, 30_012, 61_234, len(columns["time_s"]))):
        pieces.run({name: column[start:end] for name, column in columns.items()})
    assert pieces.state_bytes() == whole.state_bytes()


def test_an_ignition_in_mid_drive_loses_little() -> None:
    """A second or two by itself; when a change is suspected thereafter decides on another half minute either way."""
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
        assert back["offset"]["value"] == pytest.approx(there["offset"]["value"], abs=0.05 * DEGREE)
    assert min(used) > 0.93 * there["used"] and max(used) > 0.99 * there["used"]


def test_values_that_are_missing_and_holes_in_time_cost_what_they_took() -> None:
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


def test_a_gyro_that_is_off_otherwise_after_an_ignition_moves_nothing_of_what_was_learned() -> None:
    """What corrects it holds since the ignition: taken for the drive before, it would move the offset by a degree."""
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
def test_a_gyro_that_is_known_late_moves_the_banks_that_were_measured(has_banks: bool, moved_m_s2: float) -> None:
    joint = ffi.new("oc_joint *", {"started": 1, "speed_mean": 20.0})
    tracking, design = ffi.new("oc_joint_tracking *"), ffi.new("oc_joint_design *")
    assert lib.oc_joint_correct(joint, tracking, design, 0.04, has_banks)
    assert joint.bank_mean == pytest.approx(moved_m_s2)


def test_a_gyro_that_is_known_late_moves_no_bank_that_nobody_measured() -> None:
    """5 deg/s off, without wheel speeds or an accelerometer: known once the truck stands."""
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


def test_a_gyro_that_jumps_moves_nothing_of_what_was_learned() -> None:
    columns, truth = driven(CREEPING, 1)
    jumping = columns | {YAW_RATE: columns[YAW_RATE] + np.where(columns["time_s"] > 500.0, 0.6 * DEGREE, 0.0)}
    core = core_for(truth)
    outputs = ran(jumping, core)
    assert (outputs["reasons"] & _core.REASONS["yaw_rate_bias"] > 0).any()
    assert np.abs(outputs["offset"] - truth.offset_rad)[50_000:].max() < 0.3 * DEGREE
    assert core.answer()["changes"] == 0


def test_a_day_of_driving_leaves_all_numbers_finite_and_the_answer_where_it_was() -> None:
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
def test_signals_without_any_noise_leave_numbers(steering_deg: float) -> None:
    """As benches and FMUs send them: after a quarter of an hour nothing is left to explain, and no variance."""
    t = np.arange(0.0, 3_600.0, 1.0 / RATE_HZ)
    angle = steering_deg * DEGREE * np.sin(t / 3.0)
    core = _core.Core(3.7, 19.3, {}, RATE_HZ, method="joint", track_width_rear_m=1.8)
    v, r = np.full_like(t, 22.0), 22.0 * angle / (19.3 * 3.7)
    core.run({"time_s": t, ANGLE: angle, YAW_RATE: r, "vehicle_speed_m_s": v, "lateral_acceleration_m_s2": v * r})
    assert all(math.isfinite(number) for number in numbers(state_of(core)))
    assert math.isfinite(core.answer()["offset"]["value"])


def test_priors_far_apart_leave_numbers() -> None:
    columns, truth = driven(CREEPING, 1)
    odd = {"accelerometer_bias_sd_m_s2": 10.0, "crown_sd_m_s2": 0.001, "joint_speed_min_m_s": 1.0}
    core = core_for(truth, params=odd)
    core.run(columns)
    assert all(math.isfinite(number) for number in numbers(state_of(core)))


@pytest.mark.parametrize("rate_hz", [20.0, 22.0, 24.9, 25.0, 50.0, 100.0, 200.0])
def test_one_hypothesis_takes_its_turn_at_a_time_and_all_have_had_theirs_before_the_next_second(rate_hz: float) -> None:
    columns, truth = driven(CREEPING, 1)
    times = np.arange(30.0, 45.0, 1.0 / rate_hz)
    ticks = {name: np.interp(times, columns["time_s"], column) for name, column in columns.items()}
    core = core_for(truth, rate_hz=rate_hz)
    turns, collected = [], []
    for k in range(len(times)):
        core.step({name: float(column[k]) for name, column in ticks.items()})
        tracking = state_of(core)["tracking"]["joint"]
        turns.append(int(tracking["turns"]))
        collected.append(int(tracking["filling"]["count"]))
    steps = np.diff(turns)
    begins = np.flatnonzero(steps > 1)
    at_once = rate_hz < 50.0  # a hypothesis takes in and solves in one tick then, else in two
    assert (np.delete(steps, begins) >= (-2 if at_once else -1)).all()
    assert all(turns[k] == 0 and collected[k + 1] == 0 for k in begins)
    assert len(begins) >= 11
    assert state_of(core)["evidence"]["joint"]["second"]["used_s"] >= 10.0


def test_equations_are_solved_each_second_at_first_then_every_fourth_and_of_newborns_every_second_one() -> None:
    """Seen by the model's constant, which moves with each solving, from tick to tick."""
    columns, truth = driven(CREEPING, 1)
    core = core_for(truth)
    of_age: dict[str, list[int]] = {"first": [], "newborn": [], "elder": []}
    before: dict[int, tuple[float, float]] = {}
    solved_at: dict[int, float] = {}
    for start in range(0, len(columns["time_s"]), 25):
        core.run({name: column[start : start + 25] for name, column in columns.items()})
        joint = state_of(core)["evidence"]["joint"]
        used_s, probation_s = float(joint["second"]["used_s"]), float(joint["second"]["probation_s"])
        for k, hypothesis in enumerate(joint["hypotheses"][: joint["count"]]):
            age, constant = float(hypothesis["age"]), float(hypothesis["constant"])
            if k not in before or age < before[k][0] or age < 3.0 or joint["solves_all"]:
                solved_at.pop(k, None)  # another one's place now, or a bias that was known late
            elif constant != before[k][1]:
                kind = "first" if used_s < 119.0 else "newborn" if age < min(probation_s, 59.0) else "elder"
                seconds = round(age - solved_at[k]) if k in solved_at else 0
                of_age[kind] += [seconds] if seconds else []
                solved_at[k] = age
            before[k] = (age, constant)
    usual = {kind: int(np.median(seconds)) for kind, seconds in of_age.items()}
    assert usual == {"first": 1, "newborn": 2, "elder": 4}
    assert min(map(len, of_age.values())) > 50


def test_a_bank_that_has_settled_is_joined_by_others_half_as_often() -> None:
    columns, truth = driven(CREEPING, 1, 1500.0)
    core = core_for(truth)
    births: list[float] = []
    born = 0
    for start in range(0, len(columns["time_s"]), 200):
        core.run({name: column[start : start + 200] for name, column in columns.items()})
        joint = state_of(core)["evidence"]["joint"]
        if joint["next_start"] != born:
            births.append(float(joint["second"]["used_s"]))
            born = int(joint["next_start"])
    times = np.array(births)
    assert np.diff(times[times < 600.0]).min() == pytest.approx(40.0, abs=4.0)
    assert np.diff(times[times > 640.0]) == pytest.approx(80.0, abs=4.0)
    assert (times > 640.0).sum() >= 5


def test_who_began_after_a_flank_was_seen_knows_no_middle_of_the_play_and_leads_nobody_astray() -> None:
    core = core_for(driven(CREEPING)[1])
    core.run(driven(CREEPING)[0])
    joint = core._state.evidence.joint
    before = core.answer()["offset"]
    elder = joint.best
    other = max(set(range(joint.count)) - {elder}, key=lambda k: joint.hypotheses[k].age)
    for name in ("cost", "age", "variances"):
        setattr(joint.hypotheses[other], name, getattr(joint.hypotheses[elder], name))
    joint.hypotheses[other].offset = joint.hypotheses[elder].offset + 3.0 * DEGREE
    as_good = core.answer()["offset"]
    joint.hypotheses[other].right_before = joint.loaded_right_s
    late = core.answer()["offset"]
    for k in range(joint.count):
        joint.hypotheses[k].right_before = joint.loaded_right_s
    unseen = core.answer()["offset"]
    assert as_good["value"] - before["value"] > 1.0 * DEGREE
    assert late["value"] == pytest.approx(before["value"], abs=0.1 * DEGREE)
    assert unseen["standard_deviation"] > as_good["standard_deviation"] > late["standard_deviation"]


def test_what_was_seen_before_a_hypothesis_began_is_marked_as_long_as_seconds_can_be_counted() -> None:
    """In single precision 0.1 s is nothing beyond 24 days of them: a mark would then never be left behind."""
    columns, truth = driven(CREEPING, 1, 1200.0)
    for seen_s, marks in ((0.0, True), (2.0**21, False)):
        core = core_for(truth)
        core.run({name: column[:80_000] for name, column in columns.items()})
        joint = core._state.evidence.joint
        joint.loaded_left_s, joint.loaded_right_s = joint.loaded_left_s + seen_s, joint.loaded_right_s + seen_s
        core.run({name: column[80_000:] for name, column in columns.items()})
        newest = min(joint.hypotheses[0 : joint.count], key=lambda h: h.age)
        assert newest.age < 350.0
        assert (newest.left_before > 100.0, newest.right_before > 10.0) == (marks, marks)
