"""The simulated steering: play, column twist, pull and ratio, one at a time, then in whole manoeuvres."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from layouts import THESIS_DRIVE, scenario, steered_by_machine

from oncenter.errors import OncenterError
from oncenter.signals import DEGREE, STANDARD_GRAVITY
from oncenter.simulate.drive import ROW_DTYPE, ffi, lib, run, tick_count
from oncenter.simulate.driver import native_driver
from oncenter.simulate.road import lay_road
from oncenter.simulate.sensors import sense
from oncenter.simulate.steering import (
    native_steering,
    set_moment_n_m,
    straight_ahead_rad,
    unloading_acceleration_m_s2,
)
from oncenter.simulate.truck import equivalent_wheelbase_m, native_truck, steered_force_n, understeer_gradient
from oncenter.simulate.truth import truth_of

TICK_S, STEP_S = 0.01, 0.0025
RATIO = 19.3
NO_PLAY = {"backlash_deg": 0.0}
FRICTION_PLAY = {"backlash_deg": 8.0, "king_pin_friction_n_m": 1e6}
ALIGNING_PLAY = {"backlash_deg": 8.0, "king_pin_friction_n_m": 0.0, "creep_deg_s_n_m": 100.0}


def steering(**changes: Any) -> Any:
    settings = scenario({"steering": changes})
    return native_steering(settings.steering, settings.truck)


def turn_to(state: Any, system: Any, angle: float, force: float = 0.0, a_x: float = 0.0, seconds: float = 0.01) -> Any:
    """Holds a steering wheel angle, a lateral force and a longitudinal acceleration."""
    for _ in range(round(seconds / TICK_S)):
        lib.sim_steering_step(state, system, ffi.new("sim_steering_input *", [angle, force, a_x]), TICK_S)
    return state


# The play


def test_within_the_play_the_inner_element_rests_and_at_the_ends_it_follows() -> None:
    play = ffi.new("oc_backlash *", {"half_width": 0.5})
    state = ffi.new("oc_backlash_state *")
    outer = np.r_[np.linspace(0, 3, 61), np.linspace(3, -3, 121)[1:], np.linspace(-3, 0, 61)[1:]]
    inner, place = np.empty_like(outer), np.empty_like(outer)
    for k, angle in enumerate(outer):
        place[k] = lib.oc_backlash_step(state, play, angle, 0.0, 0.01)
        inner[k] = state.inner
    up, down = slice(20, 61), slice(81, 181)
    np.testing.assert_allclose(inner[up], outer[up] - 0.5, atol=1e-12)
    np.testing.assert_allclose(inner[down], outer[down] + 0.5, atol=1e-12)
    np.testing.assert_allclose(outer[80] - outer[60], -1.0)  # the full width passes before the inner one moves back
    assert inner[80] == inner[60]
    assert place[60] == 1.0
    assert place[180] == -1.0


def test_the_play_operator_stays_in_its_play_and_never_moves_against_the_input() -> None:
    play = ffi.new("oc_backlash *", {"half_width": 0.03, "friction": 35.0, "creep": 0.005})
    state = ffi.new("oc_backlash_state *")
    random = np.random.default_rng(7)
    for angle in np.cumsum(0.01 * random.standard_normal(5000)):
        before = state.inner
        place = lib.oc_backlash_step(state, play, angle, random.uniform(-30, 30), 0.01)
        assert -1.0 <= place <= 1.0
        moved = state.inner - before
        assert moved == 0.0 or (moved > 0) == (place > 0)
        assert angle - state.inner == pytest.approx(0.03 * place, abs=1e-12)


@pytest.mark.parametrize(("load", "place"), [(80.0, 1.0), (-80.0, -1.0), (30.0, 0.0), (-30.0, 0.0)])
def test_an_aligning_moment_above_king_pin_friction_moves_the_wheels_to_the_flank(load: float, place: float) -> None:
    play = ffi.new("oc_backlash *", {"half_width": 0.03, "friction": 35.0, "creep": 0.005})
    state = ffi.new("oc_backlash_state *")
    for _ in range(100):
        reached = lib.oc_backlash_step(state, play, 0.0, load, 0.01)
    assert reached == place


# Ratio and compliance


def test_a_polynomial_turns_the_wheels_as_it_says_and_a_number_by_its_ratio() -> None:
    polynomial = (0.0, 0.0518, 0.0004, -0.0003)
    state, angle = ffi.new("sim_steering_state *"), 2.5
    curved = turn_to(state, steering(steering_ratio=polynomial, **NO_PLAY), angle).front_wheel_angle
    assert curved == pytest.approx(np.polynomial.Polynomial(polynomial)(angle), rel=1e-12)
    straight = turn_to(state, steering(**NO_PLAY), angle).front_wheel_angle
    assert straight == pytest.approx(angle / RATIO, rel=1e-12)
    assert scenario({"steering": {"steering_ratio": polynomial}}).steering.ratio_near_centre == pytest.approx(
        1 / 0.0518
    )


# Twist of the column


def test_wind_up_follows_the_hands_and_unwinds_only_when_they_turn_back() -> None:
    system, state = steering(windup_deg=2.0, **NO_PLAY), ffi.new("sim_steering_state *")
    assert turn_to(state, system, 10 * DEGREE).place_in_windup == pytest.approx(1.0)
    assert state.front_wheel_angle == pytest.approx(8 * DEGREE / RATIO)
    turn_to(state, system, 9 * DEGREE)
    assert state.front_wheel_angle == pytest.approx(8 * DEGREE / RATIO)
    assert turn_to(state, system, -10 * DEGREE).place_in_windup == pytest.approx(-1.0)
    assert state.front_wheel_angle == pytest.approx(-8 * DEGREE / RATIO)


def test_active_return_winds_the_column_to_the_outer_side_of_any_bend() -> None:
    """Hands that come back to a small angle leave the gear further out; active return takes it back in."""
    angles = []
    for active_return in (0.0, 2.0):
        system = steering(windup_deg=2.0, active_return_1_s=active_return, **NO_PLAY)
        state = turn_to(ffi.new("sim_steering_state *"), system, 20 * DEGREE)
        angles.append(turn_to(state, system, 17 * DEGREE, seconds=5.0).front_wheel_angle * RATIO / DEGREE)
    assert angles == pytest.approx([18.0, 15.0], abs=0.01)
    state = turn_to(ffi.new("sim_steering_state *"), system, 1.0 * DEGREE, seconds=10.0)
    assert state.front_wheel_angle == pytest.approx(0.0, abs=1e-6)  # within the twist, straight ahead


# Pull


def aligning(force: float, **changes: Any) -> float:
    """Place in the play for a lateral force, without king-pin friction."""
    system = steering(**(ALIGNING_PLAY | changes))
    return float(turn_to(ffi.new("sim_steering_state *"), system, 0.0, force, seconds=5.0).place_in_play)


def test_a_pull_shifts_the_neutral_lateral_acceleration() -> None:
    settings = scenario({"steering": ALIGNING_PLAY | {"pull_n_m": 60.0}})
    a_0 = unloading_acceleration_m_s2(settings.truck, settings.steering)
    force = steered_force_n(settings.truck, settings.steering, a_0)
    assert force == pytest.approx(60.0 / 0.06)
    assert a_0 == pytest.approx(1000.0 / (8100.0 * 2.695 / 3.7), rel=1e-9)
    assert aligning(1.01 * force, pull_n_m=60.0) == 1.0
    assert aligning(0.99 * force, pull_n_m=60.0) == -1.0
    assert aligning(1.0) == 1.0
    assert aligning(-1.0) == -1.0


def test_an_axle_adjusted_for_the_crown_is_neutral_on_that_crown() -> None:
    settings = scenario({"steering": ALIGNING_PLAY | {"unloads_on_crown_percent": 2.0}})
    crown = 0.02 * STANDARD_GRAVITY
    assert unloading_acceleration_m_s2(settings.truck, settings.steering) == pytest.approx(crown, rel=1e-12)
    force = steered_force_n(settings.truck, settings.steering, crown)
    places = [aligning(share * force, unloads_on_crown_percent=2.0) for share in (0.0, 0.9, 1.1)]
    assert places == [-1.0, -1.0, 1.0]


@pytest.mark.parametrize(
    "changes",
    [
        {"pull_n_m": 80.0},
        {"pull_n": -500.0},
        {"steering_ratio": (0.002, 0.0518)},
        {"pull_n": 0.0},
        {"pull_n": 500.0, "ratio_right_error_percent": 6.0},
        {"unloads_on_crown_percent": 2.0, "torsion_bar_twist_deg": 1.5, "torsion_bar_half_moment_n_m": 60.0},
    ],
)
def test_the_truth_has_the_straight_ahead_angle_on_a_level_road(changes: dict[str, Any]) -> None:
    settings = scenario({"steering": NO_PLAY | changes})
    truck, system = native_truck(settings.truck, settings.steering), native_steering(settings.steering, settings.truck)
    angle = straight_ahead_rad(settings.truck, settings.steering)
    car, wheels = ffi.new("sim_truck_state *"), ffi.new("sim_steering_state *")
    for _ in range(4000):
        force = lib.sim_truck_steered_force(car, truck)
        lib.sim_steering_step(wheels, system, ffi.new("sim_steering_input *", [angle, force]), STEP_S)
        given = ffi.new("sim_truck_input *", [wheels.front_wheel_angle, 20.0, 0.0, 0.0, 0.0])
        lib.sim_truck_step(car, truck, given, STEP_S)
    assert car.yaw_rate == pytest.approx(0.0, abs=1e-9)
    assert (angle == 0.0) == (changes == {"pull_n": 0.0})
    if "pull_n_m" in changes:  # it pulls to the left, so that the driver holds against it
        assert angle / DEGREE == pytest.approx(-0.43e-3 * 80.0 * RATIO, rel=1e-9)
        assert set_moment_n_m(settings.truck, settings.steering) == 80.0


def test_braking_and_driving_have_different_pulls() -> None:
    system = steering(brake_pull_n_m_per_m_s2=50.0, torque_steer_n_m_per_m_s2=-20.0, **NO_PLAY)
    state, compliance = ffi.new("sim_steering_state *"), 0.43e-3 * DEGREE
    for a_x, moment in ((-2.0, 100.0), (0.0, 0.0), (1.5, -30.0)):
        assert turn_to(state, system, 0.0, 0.0, a_x).front_wheel_angle == pytest.approx(compliance * moment, abs=1e-15)
    assert aligning(1000.0) == 1.0
    flank = steering(**(ALIGNING_PLAY | {"brake_pull_n_m_per_m_s2": 50.0}))
    state = turn_to(ffi.new("sim_steering_state *"), flank, 0.0, 1000.0, -2.0, seconds=5.0)
    assert state.place_in_play == -1.0  # 60 N m of aligning moment against 100 of brake pull


# Manoeuvres


def weave(changes: dict[str, Any], frequencies_hz: list[float], amplitude_deg: float) -> Any:
    begin_s, pause_s, cycles = 45.0, 5.0, 3
    manoeuvre = {
        "kind": "weave",
        "begin_s": begin_s,
        "amplitude_deg": amplitude_deg,
        "frequency_hz": frequencies_hz,
        "cycles": cycles,
        "pause_s": pause_s,
    }
    lengths = [cycles / f for f in frequencies_hz]
    rows = steered_by_machine(manoeuvre, begin_s + sum(lengths) + pause_s * len(lengths), 60.0, {"steering": changes})
    runs, begin = [], begin_s
    for length in lengths:
        runs.append(rows[round((begin + length / cycles) * 100) : round((begin + length) * 100)])  # without the first
        begin += length + pause_s
    return runs


def loop_width_deg(run: Any, over: str) -> float:
    """Steering wheel angle where the other column goes up through zero, less where it comes down; at its mean."""
    column, angle = run[over], run["steering_wheel_angle"] / DEGREE
    crossings: dict[bool, list[float]] = {True: [], False: []}
    for k in np.flatnonzero(np.diff(np.sign(column)) != 0):
        if column[k + 1] == column[k]:
            continue
        share = -column[k] / (column[k + 1] - column[k])
        crossings[bool(column[k + 1] > column[k])].append(angle[k] + share * (angle[k + 1] - angle[k]))
    return float(np.mean(crossings[True]) - np.mean(crossings[False]))


def test_in_a_weave_play_is_as_wide_at_any_frequency_and_lag_widens_with_it() -> None:
    frequencies = [0.1, 0.2, 0.4]
    loose, tight = (weave(changes, frequencies, 20.0) for changes in (FRICTION_PLAY, NO_PLAY))
    play = [loop_width_deg(run, "front_wheel_angle") for run in loose]
    assert play == pytest.approx([8.0] * 3, abs=0.05)
    assert [loop_width_deg(run, "front_wheel_angle") for run in tight] == pytest.approx([0.0] * 3, abs=1e-6)
    lag = [loop_width_deg(run, "yaw_rate") for run in tight]
    assert lag[0] > 1.0
    assert lag[1] / lag[0] == pytest.approx(2.0, rel=0.05)
    assert lag[2] / lag[0] == pytest.approx(4.0, rel=0.15)
    both = [loop_width_deg(run, "yaw_rate") for run in loose]
    assert [b - a for a, b in zip(lag, both, strict=True)] == pytest.approx([8.0] * 3, abs=1.2)


def splits_deg(changes: dict[str, Any]) -> tuple[float, float]:
    """Steps of the residual with the sign of steering rate and of lateral force, in a slow weave without its ends."""
    settings = scenario({"steering": changes})
    (run,) = weave(changes, [0.02], 20.0)
    L_e = equivalent_wheelbase_m(settings.truck, settings.steering)
    K = understeer_gradient(settings.truck, settings.steering)
    a_y, angle = run["lateral_acceleration"], run["steering_wheel_angle"]
    residual = (angle - RATIO * (L_e * run["yaw_rate"] / run["vehicle_speed"] + K * a_y)) / DEGREE
    between = (np.abs(angle) < 10.0 * DEGREE) & (np.abs(a_y) > 0.02)
    halves = np.stack([np.ones(len(a_y)), np.sign(np.gradient(angle)) / 2, np.sign(a_y) / 2], axis=1)
    _, by_rate, by_force = np.linalg.lstsq(halves[between], residual[between])[0]
    return float(by_rate), float(by_force)


@pytest.fixture(scope="module")
def lag_deg() -> float:
    """What the tyres' and the truck's lag alone splits by the steering rate."""
    by_rate, by_force = splits_deg(NO_PLAY)
    assert by_force == pytest.approx(0.0, abs=0.05)
    return by_rate


def test_friction_play_splits_the_residual_by_the_steering_rate(lag_deg: float) -> None:
    by_rate, by_force = splits_deg(FRICTION_PLAY)
    assert by_rate - lag_deg == pytest.approx(8.0, abs=0.1)
    assert by_force == pytest.approx(0.0, abs=0.5)


def test_aligning_moment_play_splits_the_residual_by_the_lateral_force(lag_deg: float) -> None:
    by_rate, by_force = splits_deg(ALIGNING_PLAY)
    assert by_force == pytest.approx(8.0, abs=0.1)
    assert by_rate - lag_deg == pytest.approx(0.0, abs=1.0)


def test_column_wind_up_looks_like_friction_play_of_twice_its_size(lag_deg: float) -> None:
    by_rate, by_force = splits_deg(NO_PLAY | {"windup_deg": 2.0})
    assert by_rate - lag_deg == pytest.approx(4.0, abs=0.1)
    assert by_force == pytest.approx(0.0, abs=0.5)


# Ratio in right turns, universal joints, torsion bar


def test_right_turns_may_have_another_ratio() -> None:
    system = steering(ratio_right_error_percent=4.0, **NO_PLAY)
    left, right = (turn_to(ffi.new("sim_steering_state *"), system, angle).front_wheel_angle for angle in (2.0, -2.0))
    assert left == pytest.approx(2.0 / RATIO, rel=1e-12)
    assert right == pytest.approx(-2.0 / (1.04 * RATIO), rel=1e-12)


@pytest.mark.parametrize("phase_deg", [0.0, 30.0, -70.0])
def test_universal_joints_ripple_twice_a_turn_about_nothing_straight_ahead(phase_deg: float) -> None:
    ripple = {"universal_joint_ripple_deg": 2.0, "universal_joint_phase_deg": phase_deg}
    system, angles = steering(**ripple, **NO_PLAY), np.linspace(-2 * math.pi, 2 * math.pi, 721)
    wheels = np.array([turn_to(ffi.new("sim_steering_state *"), system, a).front_wheel_angle for a in angles])
    added_deg = (wheels * RATIO - angles) / DEGREE
    phase = phase_deg * DEGREE
    np.testing.assert_allclose(added_deg, 2.0 * (np.sin(2 * (angles - phase)) + np.sin(2 * phase)), atol=1e-9)
    assert added_deg[360] == pytest.approx(0.0, abs=1e-12)
    settings = scenario({"steering": ripple})
    slope = (wheels[361] - wheels[359]) / (angles[361] - angles[359])
    assert settings.steering.ratio_near_centre == pytest.approx(1.0 / slope, rel=1e-3)


TORSION = {"torsion_bar_twist_deg": 2.0, "torsion_bar_half_moment_n_m": 50.0}


@pytest.mark.parametrize("force", [-3000.0, -400.0, 0.0, 400.0, 3000.0])
def test_the_steering_wheel_leads_the_gear_by_the_torsion_bar_s_twist(force: float) -> None:
    system = steering(pull_n_m=20.0, **TORSION, **NO_PLAY)
    state = turn_to(ffi.new("sim_steering_state *"), system, 0.0, force, seconds=5.0)
    lead = 2.0 * DEGREE * math.tanh((0.06 * force - 20.0) / 50.0)
    assert -state.lash.inner == pytest.approx(lead, rel=1e-9)


def test_without_hands_the_torsion_bar_untwists_and_nothing_jumps() -> None:
    system = steering(**TORSION, **NO_PLAY)
    state = turn_to(ffi.new("sim_steering_state *"), system, 10 * DEGREE, 3000.0, seconds=5.0)
    gear = state.lash.inner
    assert gear == pytest.approx((10 - 2 * math.tanh(3.6)) * DEGREE)
    carried_by_motor(state, system, gear, 3000.0, seconds=STEP_S)
    assert state.steering_wheel_angle == pytest.approx(10 * DEGREE, abs=0.11 * DEGREE)
    assert carried_by_motor(state, system, gear, 3000.0).steering_wheel_angle == pytest.approx(gear, rel=1e-6)
    turn_to(state, system, state.steering_wheel_angle, 3000.0)
    assert state.lash.inner == pytest.approx(gear, abs=0.41 * DEGREE)


# Brake steer and bump steer


def test_braking_turns_the_front_wheels_and_driving_does_not() -> None:
    system, state = steering(brake_steer_deg_m_s2=0.1, **NO_PLAY), ffi.new("sim_steering_state *")
    angles = [turn_to(state, system, 0.0, 0.0, a_x).front_wheel_angle / DEGREE for a_x in (-3.0, 0.0, 2.0)]
    assert angles == pytest.approx([0.3, 0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize("roll_steer", [-0.15, 0.1])
def test_roll_steer_changes_the_understeer_gradient_in_proportion_to_roll(roll_steer: float) -> None:
    changes = {
        "truck": {"roll_deg_m_s2": 0.6},
        "steering": {"roll_steer_deg_deg": roll_steer, "backlash_deg": 0.0},
    }
    settings = scenario(changes)
    K, plain = (understeer_gradient(s.truck, s.steering) for s in (settings, scenario()))
    assert K - plain == pytest.approx(-roll_steer * 0.6 * DEGREE, rel=1e-9)
    turn = {"kind": "profile", "time_s": [0.0, 30.0, 32.0, 60.0], "angle_deg": [0.0, 0.0, 20.0, 20.0]}
    last = steered_by_machine(turn, 60.0, 60.0, changes)[-1]
    v, r = last["vehicle_speed"], last["yaw_rate"]
    assert pytest.approx(3.7 * r / v + K * v * r, rel=1e-5) == 20.0 * DEGREE / RATIO


def test_bump_steer_varies_randomly_while_the_truck_moves() -> None:
    machine = {"kind": "profile", "time_s": [0.0, 1000.0], "angle_deg": [0.0, 0.0]}
    changes: dict[str, Any] = {
        "drive": {"duration_s": 1100.0, "standing_at_start_s": 100.0, "standing_at_end_s": 0.0},
        "road": dict.fromkeys(THESIS_DRIVE["road"]) | {"kind": "open", "crown_percent": 0.0},
        "manoeuvre": machine,
        "steering": {"bump_steer_sd_deg": 0.2, "bump_steer_time_s": 0.5, "backlash_deg": 0.0},
    }
    settings = scenario(changes)
    random = np.random.default_rng(3)
    normals = random.standard_normal((4, tick_count(settings)))
    rows = run(settings, lay_road(settings, random), *normals)
    angle = rows["front_wheel_angle"] / DEGREE
    assert not angle[:10000].any()
    moving = angle[12000:]
    assert moving.std() == pytest.approx(0.2, rel=0.1)
    alike = np.mean(moving[50:] * moving[:-50]) / moving.var()
    assert alike == pytest.approx(math.exp(-1.0), abs=0.1)


# The overlay motor


MOTOR_PLAY = {"backlash_deg": 4.0, "king_pin_friction_n_m": 0.0, "creep_deg_s_n_m": 100.0}


def carried_by_motor(state: Any, system: Any, gear_angle: float, force: float, seconds: float = 1.0) -> Any:
    for _ in range(round(seconds / STEP_S)):
        given = ffi.new("sim_steering_input *", [gear_angle, force, 0.0, 1])
        lib.sim_steering_step(state, system, given, STEP_S)
    return state


def test_while_the_driver_steers_the_lateral_force_moves_the_gear_through_lash_and_play() -> None:
    system, state = steering(**MOTOR_PLAY, overlay_motor={"lash_deg": 6.0}), ffi.new("sim_steering_state *")
    angles = [turn_to(state, system, 0.0, force, seconds=5.0).front_wheel_angle for force in (2000.0, -2000.0)]
    assert (angles[1] - angles[0]) * RATIO / DEGREE == pytest.approx(10.0, rel=1e-9)
    assert (state.place_in_lash, state.place_in_play) == (-1.0, -1.0)
    assert state.steering_wheel_angle == 0.0


def test_while_the_motor_steers_the_steering_wheel_follows_the_gear_and_not_the_lateral_force() -> None:
    system, state = steering(**MOTOR_PLAY, overlay_motor={"lash_deg": 6.0}), ffi.new("sim_steering_state *")
    carried_by_motor(state, system, 10 * DEGREE, 2000.0)
    assert state.steering_wheel_angle == pytest.approx(7 * DEGREE)  # dragged along by the flank, half a lash behind
    assert state.front_wheel_angle * RATIO == pytest.approx(8 * DEGREE)  # the play follows the aligning moment
    carried_by_motor(state, system, 10 * DEGREE, -2000.0, seconds=20.0)
    assert state.steering_wheel_angle == pytest.approx(7 * DEGREE)
    assert state.front_wheel_angle * RATIO == pytest.approx(12 * DEGREE)
    carried_by_motor(state, system, 5 * DEGREE, -2000.0)
    assert state.steering_wheel_angle == pytest.approx(7 * DEGREE)  # inside the lash it rests
    assert carried_by_motor(state, system, 2 * DEGREE, -2000.0).steering_wheel_angle == pytest.approx(5 * DEGREE)
    assert state.place_in_lash == pytest.approx(1.0)


def test_the_motor_drags_a_wound_up_column_along_as_it_is() -> None:
    system = steering(windup_deg=2.0, **MOTOR_PLAY, overlay_motor={"lash_deg": 6.0})
    state = turn_to(ffi.new("sim_steering_state *"), system, 10 * DEGREE, 2000.0, seconds=5.0)
    assert state.lash.inner == pytest.approx(5 * DEGREE)
    carried_by_motor(state, system, 5 * DEGREE, -2000.0)
    assert state.steering_wheel_angle == pytest.approx(10 * DEGREE)
    assert carried_by_motor(state, system, 0.0, -2000.0).steering_wheel_angle == pytest.approx(5 * DEGREE)


@pytest.fixture(scope="module")
def carried_drive() -> Any:
    changes = {
        "drive": {"duration_s": 600.0},
        "steering": {"overlay_motor": {"lash_deg": 8.0, "carries_s": [[100.0, 200.0], [300.0, 450.0]]}},
    }
    settings = scenario(changes)
    normals = np.random.default_rng(5).standard_normal((2, tick_count(settings)))
    return run(settings, lay_road(settings, np.random.default_rng(5)), *normals)


def test_neither_steering_wheel_nor_front_wheels_jump_when_motor_and_driver_take_over(carried_drive: Any) -> None:
    carries = carried_drive["motor_carries"]
    taken_over = np.flatnonzero(np.diff(carries))
    assert list(taken_over + 1) == [10000, 20000, 30000, 45000]
    for column, largest_deg in (("steering_wheel_angle", 0.5), ("front_wheel_angle", 0.5 / RATIO)):
        steps_deg = np.abs(np.diff(carried_drive[column])) / DEGREE
        assert steps_deg[taken_over].max() < largest_deg
    assert np.abs(carried_drive["lateral_error"]).max() < 1.0


def test_a_drive_steered_by_the_motor_equals_one_without_lash() -> None:
    rows = []
    for lash_deg in (0.0, 8.0):
        motor = {"lash_deg": lash_deg, "carries_s": [[0.0, 200.0]]}
        settings = scenario({"drive": {"duration_s": 200.0}, "steering": {"overlay_motor": motor}})
        normals = np.random.default_rng(5).standard_normal((2, tick_count(settings)))
        rows.append(run(settings, lay_road(settings, np.random.default_rng(5)), *normals))
    np.testing.assert_array_equal(rows[0]["front_wheel_angle"], rows[1]["front_wheel_angle"])
    dragged_deg = np.abs(rows[0]["steering_wheel_angle"] - rows[1]["steering_wheel_angle"]) / DEGREE
    assert dragged_deg.max() == pytest.approx(4.0)


def test_at_a_takeover_by_the_motor_the_driver_s_lash_compensation_ends_at_once() -> None:
    settings = scenario({"steering": {"overlay_motor": {"lash_deg": 8.0}}})
    driver, road = native_driver(settings, TICK_S), ffi.new("sim_road *", {"count": 2, "spacing": 1e5})
    columns = {name: ffi.new("double[]", [value, value]) for name, value in (("curvature", 2e-3), ("cross_slope", 0.0))}
    road.curvature, road.cross_slope = columns["curvature"], columns["cross_slope"]
    wanted = []
    for carries in (0, 1):
        state = ffi.new("sim_driver_state *", {"speed": 20.0})
        for tick in range(200):
            view = ffi.new("sim_view *", {"yaw_rate": 0.04, "motor_carries": carries * (tick == 199)})
            lib.sim_driver_decide(state, driver, road, view, 0.0, 0.0)
        wanted.append(state.wanted_angle)
    assert (wanted[0] - wanted[1]) / DEGREE == pytest.approx(4.0, rel=0.05)  # the flank is fairly sure at 0.8 m/s^2


def test_the_steering_wheel_stays_within_the_lash(carried_drive: Any) -> None:
    place, force, carries = (carried_drive[c] for c in ("place_in_lash", "front_force", "motor_carries"))
    assert np.abs(place).max() <= 1.0 + 1e-9
    loaded = np.abs(force) > 1500.0
    follows = [
        np.mean(np.sign(force)[loaded & (carries == by)] == np.sign(place)[loaded & (carries == by)])
        for by in (0.0, 1.0)
    ]
    assert follows[0] > 0.9 > follows[1]


def test_play_to_be_found_includes_the_lash() -> None:
    settings = scenario({"steering": {"overlay_motor": {"lash_deg": 8.0}}})
    truth = truth_of(
        settings, 1, np.zeros(1, ROW_DTYPE), sense(settings, np.zeros(1, ROW_DTYPE), np.random.default_rng(1))
    )
    assert truth.backlash_rad / DEGREE == pytest.approx(11.0)


# What is refused


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        ({"backlash_deg": 21.0}, "steering.backlash_deg"),
        ({"backlash_deg": 15.0, "steering_ratio": 6.0}, "backlash_deg"),
        ({"steering_ratio": 0.5}, "steering_ratio"),
        ({"steering_ratio": (0.0, -0.05)}, "steering_ratio"),
        ({"steering_ratio": (0.0, 0.05, 0.0, -0.004)}, "steering_ratio"),
        ({"steering_ratio": (0.0,)}, "steering.steering_ratio"),
        ({"windup_deg": -1.0}, "steering.windup_deg"),
        ({"pull_n_m": math.inf}, "steering.pull_n_m"),
        ({"active_return_1_s": 100.0}, "steering.active_return_1_s"),
        ({"backlash_deg": 19.0, "overlay_motor": {"lash_deg": 20.0}}, "overlay_motor.lash_deg"),
        ({"overlay_motor": {"lash_deg": -1.0}}, "steering.overlay_motor.lash_deg"),
        ({"torsion_bar_twist_deg": 1.0}, "torsion_bar_half_moment_n_m"),
        ({"torsion_bar_half_moment_n_m": 50.0}, "torsion_bar_twist_deg"),
        ({"universal_joint_ripple_deg": 6.0}, "steering.universal_joint_ripple_deg"),
        ({"ratio_right_error_percent": 20.0}, "steering.ratio_right_error_percent"),
        ({"bump_steer_sd_deg": -0.1}, "steering.bump_steer_sd_deg"),
        ({"overlay_motor": {"lash_deg": 1.0, "carries_s": [[20.0, 10.0]]}}, "carries_s"),
        ({"overlay_motor": {"lash_deg": 1.0, "carries_s": [[1e5, 2e5]]}}, "carries_s"),
    ],
)
def test_an_impossible_steering_is_refused_by_name(changes: dict[str, Any], names: str) -> None:
    with pytest.raises(OncenterError, match=names) as refusal:
        scenario({"steering": changes})
    assert refusal.value.exit_code == 2
    assert "\n" not in str(refusal.value)
