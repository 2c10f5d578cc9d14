"""The bench's rivals against their equations, implemented here a second time or solved by hand."""

import math
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

sys.path.insert(0, str(Path(__file__).parents[1] / "bench"))

from rivals import Array, Course, Known, Rival
from rivals.autoware import autoware
from rivals.bins import bins
from rivals.in_cpp import compiled, compiler
from rivals.median import median
from rivals.mode import mode
from rivals.openpilot import STATES, WANDER, body_of, observe, openpilot, predict
from rivals.rls import KEPT, forgetting, rls
from rivals.straight import filtered, lowpass, mean_group_delay_s, slope, straight, understeer_gradient

import oncenter as oc

KNOWN = Known(
    wheelbase_m=3.7,
    steering_ratio=19.3,
    mass_kg=8100.0,
    yaw_inertia_kg_m2=24000.0,
    front_axle_distance_m=1.005,
    front_cornering_stiffness_n_rad=384000.0,
    rear_cornering_stiffness_n_rad=235000.0,
)
OFFSET = math.radians(2.0)
VEHICLE = Path(__file__).parents[1] / "vehicles" / "scania_r730_4x2.toml"
G = 9.80665


def curvature_of(minutes: int) -> tuple[Array, Array]:
    """Time in s and curvature of gentle bends, 1/m, at 100 Hz."""
    t = np.arange(minutes * 6000) / 100.0
    return t, 5e-4 * np.sin(t / 3.0) + 3e-4 * np.sin(t / 1.3)


def kinematic_drive(minutes: int, speed: float = 20.0) -> dict[str, Array]:
    """A truck without slip, sensors without noise, and an angle offset of OFFSET."""
    t, curvature = curvature_of(minutes)
    return {
        "time_s": t,
        "steering_wheel_angle_rad": KNOWN.steering_ratio * KNOWN.wheelbase_m * curvature + OFFSET,
        "yaw_rate_rad_s": curvature * speed,
        "vehicle_speed_m_s": np.full(len(t), speed),
        "lateral_acceleration_m_s2": curvature * speed**2,
    }


def test_on_a_truck_without_slip_autoware_s_filter_ends_where_its_least_squares_do() -> None:
    columns = kinematic_drive(2)
    course = autoware(columns, KNOWN)
    # By hand, as a sum over what its gates let in. Its process noise of 1e-6 is left out: 0.3 % over these minutes.
    delta, r = columns["steering_wheel_angle_rad"] / KNOWN.steering_ratio, columns["yaw_rate_rad_s"]
    rate = (delta[10::10] - delta[:-10:10]) / 0.1
    good = (abs(r[10::10]) <= 0.02) & (abs(delta[10::10]) <= 0.03) & (abs(rate) <= 0.02)
    phi = 20.0 / KNOWN.wheelbase_m
    y = (r[10::10] - phi * delta[10::10])[good]
    theta = phi * y.sum() / 0.5 / (1.0 / 0.5 + good.sum() * phi**2 / 0.5)
    assert course.value_rad[-1] == pytest.approx(-theta * KNOWN.steering_ratio, rel=5e-3)
    assert course.value_rad[-1] == pytest.approx(OFFSET, rel=5e-3)


def test_autoware_s_sd_settles_where_new_information_equals_forgetting() -> None:
    claimed = autoware(kinematic_drive(10), KNOWN).sd_rad[-1] / KNOWN.steering_ratio
    phi = 20.0 / KNOWN.wheelbase_m
    before = (1e-6 + math.sqrt(1e-12 + 4.0 * 1e-6 * 0.5 / phi**2)) / 2.0  # P- of the scalar Riccati equation
    assert claimed**2 == pytest.approx(before - 1e-6, rel=1e-3)


def test_autoware_does_not_update_in_bends() -> None:
    columns = kinematic_drive(1)
    columns["yaw_rate_rad_s"] = np.full(6000, 0.021)
    assert np.isnan(autoware(columns, KNOWN).value_rad).all()


@pytest.mark.skipif(compiler() is None, reason="there is no C++ compiler, in whose language these rivals run")
@pytest.mark.parametrize(("name", "in_numba"), [("autoware", autoware), ("openpilot", openpilot)])
def test_a_rival_in_c_plus_plus_gives_the_offset_that_its_numba_version_gives(
    name: str, in_numba: Rival, tmp_path: Path
) -> None:
    random, columns = np.random.default_rng(3), kinematic_drive(4)
    for column, sd in (("steering_wheel_angle_rad", 0.01), ("yaw_rate_rad_s", 2e-3), ("vehicle_speed_m_s", 0.02)):
        columns[column] += random.normal(0.0, sd, 24000)
        columns[column][random.integers(0, 24000, 200)] = np.nan
    columns["vehicle_speed_m_s"][3000:3500] = 0.0  # a stop
    wanted = in_numba(columns, KNOWN).value_rad[-1]
    assert abs(wanted) > 1e-3
    assert compiled(tmp_path)[name](columns, KNOWN) == pytest.approx(wanted, rel=1e-9)


def literal_step(x: Array, dt: float) -> Array:
    """openpilot's single-track model as its source writes it, in plain numbers."""
    s, ratio, slow, fast, u, v, r, angle, roll = x
    a, b = KNOWN.front_axle_distance_m, KNOWN.wheelbase_m - KNOWN.front_axle_distance_m
    front, rear = s * KNOWN.front_cornering_stiffness_n_rad, s * KNOWN.rear_cornering_stiffness_n_rad
    front_force = front * ((angle - slow - fast) / ratio - (v + a * r) / u)
    rear_force = rear * -(v - b * r) / u
    v_rate = (front_force + rear_force) / KNOWN.mass_kg - u * r - G * roll
    r_rate = (a * front_force - b * rear_force) / KNOWN.yaw_inertia_kg_m2
    return np.array([s, ratio, slow, fast, u, v + dt * v_rate, r + dt * r_rate, angle, roll])


def some_state(seed: int) -> tuple[Array, Array]:
    random = np.random.default_rng(seed)
    x = np.array([1.1, 18.0, 0.02, -0.01, 17.0, 0.3, 0.05, 0.2, 0.02]) * random.uniform(0.5, 1.5, STATES)
    root = random.normal(size=(STATES, STATES))
    return x, root @ root.T


@pytest.mark.parametrize("seed", range(5))
def test_openpilot_s_prediction_moves_by_axle_forces_and_spreads_by_their_numerical_jacobian(seed: int) -> None:
    x, P = some_state(seed)
    dt, step = 0.01, 1e-6
    jacobian = np.column_stack(
        [(literal_step(x + h, dt) - literal_step(x - h, dt)) / (2.0 * step) for h in step * np.eye(STATES)]
    )
    wanted_x, wanted_P = literal_step(x, dt), jacobian @ P @ jacobian.T + dt * np.diag(WANDER**2)
    predict(x, P, body_of(KNOWN), dt)
    np.testing.assert_allclose(x, wanted_x, rtol=1e-12)
    np.testing.assert_allclose(P, wanted_P, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("which", range(STATES))
def test_an_observation_of_openpilot_s_filter_is_one_of_more_information(which: int) -> None:
    """P^-1 gains 1/R at the observed state, and the state moves to the minimum of both squares."""
    x, P = some_state(7)
    before, information = x.copy(), np.linalg.inv(P)
    seen = np.zeros((STATES, STATES))
    seen[which, which] = 1.0 / 0.3**2
    observe(x, P, which, 1.7, 0.3)
    np.testing.assert_allclose(np.linalg.inv(P), information + seen, rtol=1e-6, atol=1e-6)
    wanted = np.linalg.solve(information + seen, information @ before + seen[which] * 1.7)
    np.testing.assert_allclose(x, wanted, rtol=1e-8)


def test_on_its_own_model_openpilot_s_filter_finds_the_offset() -> None:
    t, curvature = curvature_of(10)
    x = np.array([1.0, KNOWN.steering_ratio, 0.0, 0.0, 20.0, 0.0, 0.0, 0.0, 0.0])
    angle = 1.5 * KNOWN.steering_ratio * KNOWN.wheelbase_m * curvature
    v, r = np.zeros(len(t)), np.zeros(len(t))
    for k in range(len(t) - 1):
        x[7] = angle[k]
        v[k], r[k] = x[5], x[6]
        x = literal_step(x, 0.01)
    v[-1], r[-1] = x[5], x[6]
    v_rate = np.gradient(v, 0.01)
    columns = {
        "steering_wheel_angle_rad": angle + OFFSET,
        "yaw_rate_rad_s": r,
        "vehicle_speed_m_s": np.full(len(t), 20.0),
        "lateral_acceleration_m_s2": v_rate + 20.0 * r,
    }
    course = openpilot(columns, KNOWN)
    assert course.value_rad[-1] == pytest.approx(OFFSET, rel=0.1)
    assert course.valid[-1]


def test_the_median_is_of_the_latest_2000_angles_read_nearly_straight() -> None:
    columns = kinematic_drive(10)
    columns["steering_wheel_angle_rad"] += 0.01 * np.random.default_rng(1).normal(size=60000)
    columns["yaw_rate_rad_s"][::3] = 0.1  # a bend, which is rejected
    taken = columns["steering_wheel_angle_rad"][::10][np.arange(0, 60000, 10) % 3 != 0]
    assert len(taken) > 2000
    assert median(columns, KNOWN).value_rad[-1] == pytest.approx(np.median(taken[-2000:]), abs=1e-15)


def test_the_median_of_fewer_than_200_angles_is_not_given() -> None:
    columns = kinematic_drive(1)
    columns["yaw_rate_rad_s"][:] = 0.1
    columns["yaw_rate_rad_s"][:1990] = 0.0
    assert np.isnan(median(columns, KNOWN).value_rad[0])
    columns["yaw_rate_rad_s"][:2000] = 0.0
    assert np.isfinite(median(columns, KNOWN).value_rad[0])


def test_the_mode_is_the_most_frequent_half_degree_of_the_latest_ten_minutes() -> None:
    columns = kinematic_drive(15)
    random = np.random.default_rng(3)
    columns["steering_wheel_angle_rad"] = np.radians(random.normal(3.0, 2.0, 90000))
    columns["steering_wheel_angle_rad"][:45000] = np.radians(-20.0)  # most frequent of all, but half of it is gone
    columns["steering_wheel_angle_rad"][45000:70000] = np.radians(7.4)
    columns["steering_wheel_angle_rad"][70000:] += np.radians(1.0)
    latest = np.degrees(columns["steering_wheel_angle_rad"][::10][-6000:])
    ((bin_of_most, _),) = Counter(np.floor(latest / 0.5 + 0.5).astype(int).tolist()).most_common(1)
    assert mode(columns, KNOWN).value_rad[-1] == pytest.approx(math.radians(0.5 * bin_of_most))


def test_the_mode_ignores_a_truck_that_hardly_moves() -> None:
    assert np.isnan(mode(kinematic_drive(2, speed=9.9), KNOWN).value_rad).all()


def play_drive(left_s: float, right_s: float, minutes: int, play: float) -> dict[str, Array]:
    """Alternating bends of 2000 m with given lengths to the left and right, whose lateral force moves the wheels to the
    flanks of a play; the only sensor error is OFFSET."""
    t = np.arange(minutes * 6000) / 100.0
    to_left = t % (left_s + right_s) < left_s
    speed, curvature = 20.0, np.where(to_left, 1.0, -1.0) / 2000.0
    i, L = KNOWN.steering_ratio, KNOWN.wheelbase_m
    a_y = curvature * speed**2
    angle = i * (L * curvature + understeer_gradient(KNOWN) * a_y) + play / 2.0 * np.sign(a_y) + OFFSET
    return {
        "time_s": t,
        "steering_wheel_angle_rad": angle,
        "yaw_rate_rad_s": curvature * speed,
        "vehicle_speed_m_s": np.full(len(t), speed),
        "lateral_acceleration_m_s2": a_y,
    }


@pytest.mark.parametrize("method", [bins, rls])
def test_sorting_by_turn_finds_mid_play_for_uneven_turns(method: Callable[..., Course]) -> None:
    play = math.radians(8.0)
    columns = play_drive(600.0, 200.0, 20, play)
    assert straight(columns, KNOWN).residual_rad.mean() - OFFSET > play / 5.0  # where a mean over all would be
    # An estimation during which the truck turned to either side goes to one of them.
    assert method(columns, KNOWN).value_rad[-1] == pytest.approx(OFFSET, abs=play / 20.0)


@pytest.mark.parametrize("method", [bins, rls])
def test_with_turns_to_one_side_only_mid_play_is_not_given(method: Callable[..., Course]) -> None:
    course = method(play_drive(1e9, 1.0, 5, math.radians(8.0)), KNOWN)
    assert np.isnan(course.value_rad).all()
    assert not course.valid.any()


def test_without_play_the_gated_angle_is_the_offset_with_2_s_delay() -> None:
    columns = play_drive(30.0, 20.0, 5, play=0.0)
    seen = straight(columns, KNOWN)
    before = np.roll(columns["lateral_acceleration_m_s2"], 200)
    steady = seen.passed & (np.abs(before - np.roll(before, 100)) + np.abs(before - np.roll(before, -100)) < 1e-9)
    assert steady.sum() > 15000
    np.testing.assert_allclose(seen.turning_m_s2[steady], before[steady], rtol=1e-3)
    np.testing.assert_allclose(seen.residual_rad[steady], OFFSET, rtol=1e-3)


def test_a_bin_estimate_takes_20_s_and_is_sorted_by_the_net_turn() -> None:
    columns = play_drive(13.0, 31.0, 10, math.radians(6.0))
    seen = straight(columns, KNOWN)
    residual, turning = seen.residual_rad[seen.passed], seen.turning_m_s2[seen.passed]
    whole = len(residual) // 2000 * 2000
    residual_of, turning_of = (x[:whole].reshape(-1, 2000).mean(axis=1) for x in (residual, turning))
    wanted = 0.5 * (residual_of[turning_of > 0.0].mean() + residual_of[turning_of <= 0.0].mean())
    assert bins(columns, KNOWN).value_rad[-1] == pytest.approx(wanted, rel=1e-12)


def test_least_squares_that_forget_minimise_squares_weighted_by_their_age() -> None:
    values = np.random.default_rng(2).normal(size=2500)
    said = forgetting(values)
    for n in (1, 2, 700, 2500):
        weights = KEPT ** np.arange(n - 1, -1, -1.0)
        assert said[n - 1] == pytest.approx(np.sum(weights * values[:n]) / np.sum(weights), abs=1e-12)


def test_the_gate_of_the_bins_filters_as_scipy_does() -> None:
    values = np.random.default_rng(4).normal(size=1000)
    b, a = signal.butter(2, 3.0, fs=100.0)
    b0, a1, a2 = lowpass(3.0)
    np.testing.assert_allclose(
        filtered(values, b0, a1, a2),
        signal.lfilter(b, a, values, zi=signal.lfilter_zi(b, a) * values[0])[0],
        atol=1e-12,
    )
    ramp = np.arange(2000) / 100.0
    assert slope(3.0 * ramp)[-1] == pytest.approx(3.0)
    late = mean_group_delay_s(b0, a1, a2, 0.01)  # at next to no frequency: how far a filtered ramp lags
    assert (ramp - filtered(ramp, b0, a1, a2))[-1] == pytest.approx(late, rel=1e-4)


def test_the_gate_of_the_bins_passes_the_same_ticks_as_the_thesis_s() -> None:
    signals, _ = oc.simulate("thesis_drive", seed=3)
    columns = {name: signals.table[name].to_numpy() for name in signals.table.columns}
    answer = oc.offset(signals, oc.vehicle(VEHICLE), method="thesis")
    passed = straight(columns, KNOWN).passed.sum() / 100.0
    assert answer.used_s > 60.0
    assert passed == pytest.approx(answer.used_s, rel=0.02)  # the core takes whole blocks of 0.1 s


def test_the_configured_gradient_is_that_of_equal_tyres_on_both_axles() -> None:
    """(10): front slip less rear slip for each m/s^2, each from its load and stiffness."""
    a, b = KNOWN.front_axle_distance_m, KNOWN.wheelbase_m - KNOWN.front_axle_distance_m
    front_kg, rear_kg = KNOWN.mass_kg * b / KNOWN.wheelbase_m, KNOWN.mass_kg * a / KNOWN.wheelbase_m
    slips = front_kg / KNOWN.front_cornering_stiffness_n_rad - rear_kg / KNOWN.rear_cornering_stiffness_n_rad
    assert understeer_gradient(KNOWN) == pytest.approx(slips, rel=1e-12)
