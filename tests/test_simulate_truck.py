"""The simulated truck against closed forms: (4) to (7), (10), (13), Winkler's wheelbase, Lagrange's equations."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from layouts import FULL_LOAD, SEMITRAILER, TRUCKS, scenario, steered_by_machine
from scipy.linalg import expm

from oncenter.errors import OncenterError
from oncenter.signals import DEGREE, STANDARD_GRAVITY
from oncenter.simulate import simulate_to_log
from oncenter.simulate.drive import ffi, lib, run, tick_count
from oncenter.simulate.road import lay_road
from oncenter.simulate.sensors import sense
from oncenter.simulate.truck import (
    check_holdable,
    equivalent_wheelbase_m,
    load_changed,
    native_truck,
    steered_stiffness_n_rad,
    understeer_gradient,
)
from oncenter.simulate.truth import truth_of
from oncenter.vehicle import vehicle

STEP_S = 0.0025


def thesis_truck(**changes: float) -> Any:
    settings = scenario()
    truck = native_truck(settings.truck, settings.steering)
    for member, value in changes.items():
        setattr(truck, member, value)
    return truck


def acting(angle: float, speed: float, to_left: float = 0.0, wind: float = 0.0, arm: float = 0.0) -> Any:
    return ffi.new("sim_truck_input *", [angle, speed, to_left, wind, arm])


def settled(truck: Any, given: Any, seconds: float = 20.0) -> Any:
    state = ffi.new("sim_truck_state *")
    for _ in range(round(seconds / STEP_S)):
        lib.sim_truck_step(state, truck, given, STEP_S)
    return state


def specific_force(state: Any, truck: Any, given: Any) -> float:
    return float(lib.sim_truck_lateral_acceleration(state, truck, given))


# Steady bends


@pytest.mark.parametrize("layout", TRUCKS)
@pytest.mark.parametrize(("speed", "angle", "to_left"), [(4.0, 0.05, 0.0), (12.0, -0.02, 0.3), (22.0, 0.01, -0.7)])
def test_a_steady_bend_takes_the_angle_of_equation_10_with_winklers_wheelbase(
    layout: str, speed: float, angle: float, to_left: float
) -> None:
    """Articulation adds cosines that are not in (10): a few 1e-4 with the semitrailer."""
    settings = scenario(layout=layout)
    truck, given = native_truck(settings.truck, settings.steering), acting(angle, speed, to_left)
    state = settled(truck, given, 60.0)
    a_y = specific_force(state, truck, given)
    L_e = equivalent_wheelbase_m(settings.truck, settings.steering)
    K = understeer_gradient(settings.truck, settings.steering)
    assert a_y == pytest.approx(speed * state.yaw_rate - to_left, abs=1e-9)
    exact = 2e-3 if layout == "semitrailer" else 1e-9
    assert angle == pytest.approx(L_e * state.yaw_rate / speed + K * a_y, rel=exact)


@pytest.mark.parametrize("layout", ["4x2", "6x2", "6x4"])
def test_the_equivalent_wheelbase_is_winklers_closed_form(layout: str) -> None:
    """L (1 + T/L^2 (1 + C_r/C_f)) of [8], L to the middle of the rear axles by stiffness, T = sum of C d^2 over C_r,
    and dual tyres as if the axles were as much further apart as their scrubbing is worth."""
    settings = scenario(layout=layout)
    truck = native_truck(settings.truck, settings.steering)
    front, *rear = (truck.axles[k] for k in range(truck.axle_count))
    C_f = lib.sim_axle_stiffness(ffi.addressof(front))
    C = [axle.tyre.cornering_stiffness for axle in rear]
    behind = [front.distance - axle.distance for axle in rear]
    C_r = sum(C)
    L = sum(c * x for c, x in zip(C, behind, strict=True)) / C_r
    T = sum(c * (x - L) ** 2 + axle.scrub_stiffness for c, x, axle in zip(C, behind, rear, strict=True)) / C_r
    L_e = L * (1 + T / L**2 * (1 + C_r / C_f))
    assert equivalent_wheelbase_m(settings.truck, settings.steering) == pytest.approx(L_e, rel=1e-12)
    assert L_e == pytest.approx(L, rel=1e-12) if layout == "4x2" else L_e > L + 0.1


def test_two_equal_rear_axles_have_the_tandem_factor_of_half_their_spacing_squared() -> None:
    settings = scenario({"truck": {"dual_tyre_spacing_m": None, "dual_tyre_longitudinal_stiffness_n": None}}, "6x4")
    C_f, L = steered_stiffness_n_rad(settings.truck, settings.steering), 3.9 + 1.37 / 2
    truck = native_truck(settings.truck, settings.steering)
    C_r = sum(truck.axles[k].tyre.cornering_stiffness for k in (1, 2))
    L_e = L * (1 + (1.37 / 2) ** 2 / L**2 * (1 + C_r / C_f))
    assert equivalent_wheelbase_m(settings.truck, settings.steering) == pytest.approx(L_e, rel=1e-12)


def test_on_two_axles_the_understeer_gradient_is_equation_10_s() -> None:
    settings = scenario()
    truck, m, L, l_f = settings.truck, 8100.0, 3.7, 1.005
    compliance = settings.steering.compliance_deg_kn_m * DEGREE / 1000 * settings.steering.trail_m
    C_f = 1 / (1 / truck.front_cornering_stiffness_n_rad + compliance)
    K = m / L * ((L - l_f) / C_f - l_f / truck.rear_cornering_stiffness_n_rad)
    assert understeer_gradient(truck, settings.steering) == pytest.approx(K, rel=1e-12)
    assert equivalent_wheelbase_m(truck, settings.steering) == pytest.approx(L, rel=1e-12)


def test_the_second_steered_axle_points_to_the_same_centre_of_the_bend() -> None:
    """With one rear axle instead of two nothing scrubs, so that the equivalent wheelbase is the true one."""
    settings = scenario(layout="8x4")
    truck = native_truck(settings.truck, settings.steering)
    middle = (truck.axles[2].distance + truck.axles[3].distance) / 2
    truck.axle_count = 3
    truck.axles[2].distance, truck.axles[2].scrub_stiffness = middle, 0.0
    L_e = lib.sim_truck_stance(truck, 1.0, 0.0).front_wheel_angle
    assert L_e == pytest.approx(5.1 + 1.37 / 2, rel=1e-12)
    assert truck.axles[1].steer_share == pytest.approx((L_e - 1.94) / L_e, rel=1e-12)


# Transients


def test_a_step_of_the_wheels_is_answered_as_equation_13_says() -> None:
    truck = thesis_truck()
    for k in range(2):
        truck.axles[k].relaxation_length = 0.0
    v, delta, steps = 22.0, 0.01, 200
    m, I_z, l_f, l_r = truck.mass, truck.yaw_inertia, truck.axles[0].distance, -truck.axles[1].distance
    C_f, C_r = (lib.sim_axle_stiffness(ffi.addressof(truck.axles[k])) for k in range(2))  # of both tyres, hence no 2
    A = np.array(
        [
            [-(C_f * l_f**2 + C_r * l_r**2) / (v * I_z), -(C_f * l_f - C_r * l_r) / I_z],
            [-1 - (C_f * l_f - C_r * l_r) / (m * v**2), -(C_f + C_r) / (m * v)],
        ]
    )
    b = np.array([C_f * l_f / I_z, C_f / (m * v)]) * delta

    state = ffi.new("sim_truck_state *")
    for k in range(1, steps + 1):
        lib.sim_truck_step(state, truck, acting(delta, v), STEP_S)
        r, beta = np.linalg.solve(A, (expm(A * k * STEP_S) - np.eye(2)) @ b)
        assert state.yaw_rate == pytest.approx(r, abs=1e-8)
        assert state.lateral_speed / v == pytest.approx(beta, abs=1e-8)


def test_a_tyre_has_rolled_its_relaxation_length_when_63_percent_of_the_force_is_there() -> None:
    truck = thesis_truck(mass=1e12, yaw_inertia=1e12)  # does not budge, so the slip angle stays
    front, v, delta = truck.axles[0], 15.0, 0.01
    front.compliance = 0.0
    state = ffi.new("sim_truck_state *")
    for k in range(1, 60):
        lib.sim_truck_step(state, truck, acting(delta, v), STEP_S)
        rolled_in = -math.expm1(-v * k * STEP_S / front.relaxation_length)  # (5) and (6)
        assert state.axle_forces[0] == pytest.approx(front.tyre.cornering_stiffness * delta * rolled_in, rel=1e-4)


def test_compliance_makes_the_axle_softer_and_its_lag_shorter() -> None:
    """delta - c F - alpha = F/C is delta - alpha = F (1/C + c), and the relaxation length shrinks as the stiffness does
    (Pacejka's effective axle characteristic)."""
    spring, soft = thesis_truck(), thesis_truck()
    front = soft.axles[0]
    softening = 1 + front.compliance * front.tyre.cornering_stiffness
    front.tyre.cornering_stiffness /= softening
    front.relaxation_length /= softening
    front.compliance = 0.0
    a, b, given = ffi.new("sim_truck_state *"), ffi.new("sim_truck_state *"), acting(0.01, 20.0)
    for _ in range(400):
        lib.sim_truck_step(a, spring, given, STEP_S)
        lib.sim_truck_step(b, soft, given, STEP_S)
        assert a.axle_forces[0] == pytest.approx(b.axle_forces[0], rel=1e-9)
    assert softening > 1.1


@pytest.mark.parametrize("layout", TRUCKS)
def test_from_standstill_to_walking_speed_and_back_the_truck_follows_its_wheels_smoothly(
    layout: str,
) -> None:
    settings, angle, to_left = scenario(layout=layout), 0.03, -0.7
    truck, state = native_truck(settings.truck, settings.steering), ffi.new("sim_truck_state *")
    L_e = equivalent_wheelbase_m(settings.truck, settings.steering)
    speeds = np.r_[np.linspace(0, 5, 8000), np.linspace(5, 0, 8000), np.zeros(400)]
    yaw_rate = np.empty_like(speeds)
    for k, speed in enumerate(speeds):
        lib.sim_truck_step(state, truck, acting(angle, speed, to_left), STEP_S)
        yaw_rate[k] = state.yaw_rate
    assert np.abs(yaw_rate - speeds * angle / L_e)[speeds < 0.5].max() < 3e-4  # (7)
    assert np.abs(np.diff(yaw_rate)).max() / STEP_S < 0.005  # rad/s^2, of which the ramp itself takes 0.002
    assert yaw_rate[-1] == pytest.approx(0.0, abs=1e-6)
    carried = sum(state.axle_forces[k] for k in range(truck.axle_count))
    at_hitch = lib.sim_trailer_load_of(ffi.addressof(truck, "trailer")) if layout == "semitrailer" else None
    borne = 0.7 * (truck.mass + at_hitch.mass) if at_hitch else 0.7 * truck.mass
    borne += at_hitch.scrub * angle / L_e if at_hitch else 0.0
    assert carried == pytest.approx(borne, rel=1e-3)


# Tyres


def test_a_brush_tyre_begins_linear_and_slides_at_three_times_friction_over_stiffness() -> None:
    C, D = 400e3, 40e3
    tyre = ffi.new("sim_tyre *", {"model": lib.SIM_TYRE_BRUSH, "cornering_stiffness": C, "D": D})
    assert lib.sim_tyre_force(tyre, 1e-7) == pytest.approx(C * 1e-7, rel=1e-5)
    assert lib.sim_tyre_force(tyre, 1.5 * D / C) == pytest.approx(0.875 * D, rel=1e-12)  # half way to sliding
    assert lib.sim_tyre_force(tyre, -3.0 * D / C) == pytest.approx(-D, rel=1e-12)
    assert lib.sim_tyre_force(tyre, 1.0) == D


def test_a_magic_formula_tyre_has_slope_BCD_and_peak_D() -> None:
    cornering, D, C, E = 400e3, 40e3, 1.3, -1.0
    tyre = ffi.new(
        "sim_tyre *", {"model": lib.SIM_TYRE_MAGIC_FORMULA, "cornering_stiffness": cornering, "D": D, "C": C, "E": E}
    )
    forces = np.array([lib.sim_tyre_force(tyre, x) for x in np.linspace(-0.9, 0.9, 20001)])
    assert lib.sim_tyre_force(tyre, 1e-7) == pytest.approx(cornering * 1e-7, rel=1e-5)
    assert forces.max() == pytest.approx(D, rel=1e-6)
    np.testing.assert_allclose(forces, -forces[::-1], atol=1e-9)


@pytest.mark.parametrize(
    "tyres",
    [{"model": "brush", "friction": 0.8}, {"model": "magic_formula", "friction": 0.8, "C": 1.3, "E": -1.0}],
    ids=["brush", "magic_formula"],
)
def test_saturating_tyres_are_linear_on_centre_and_hold_no_more_than_friction(tyres: dict[str, Any]) -> None:
    settings = scenario({"truck": {"tyres": tyres}})
    linear, bounded, speed = thesis_truck(), native_truck(settings.truck, settings.steering), 20.0
    on_centre = [settled(truck, acting(1e-4, speed)).yaw_rate for truck in (linear, bounded)]
    assert on_centre[1] == pytest.approx(on_centre[0], rel=5e-3)
    largest = [settled(truck, acting(0.2, speed), 1.0).axle_forces[0] for truck in (linear, bounded)]
    D = bounded.axles[0].tyre.D
    assert pytest.approx(0.8 * 8100 * STANDARD_GRAVITY * 2.695 / 3.7, rel=1e-9) == D
    assert largest[0] > D >= largest[1] > 0.9 * D


def test_rear_tyres_of_less_friction_saturate_first_and_the_truck_runs_wide_at_its_rear() -> None:
    settings = scenario({"truck": {"tyres": {"model": "brush", "friction": 0.8, "rear_friction": 0.4}}})
    truck = native_truck(settings.truck, settings.steering)
    front, rear = truck.axles[0].tyre.D, truck.axles[1].tyre.D
    assert front / rear == pytest.approx(2.0 * 2.695 / 1.005)
    turning = settled(truck, acting(0.12, 12.0), 1.5)
    shares = [turning.axle_forces[0] / front, turning.axle_forces[1] / rear]
    assert shares[1] > 0.95 > 1.5 * shares[0]


def test_a_trailer_s_tyres_keep_the_friction_of_the_steered_ones() -> None:
    tyres = {"model": "brush", "friction": 0.8}
    both = [scenario({"truck": {"tyres": tyres | rear}}, "semitrailer") for rear in ({}, {"rear_friction": 0.4})]
    alike, apart = (native_truck(settings.truck, settings.steering) for settings in both)
    assert apart.trailer.axles[0].tyre.D == alike.trailer.axles[0].tyre.D
    assert apart.axles[1].tyre.D == 0.5 * alike.axles[1].tyre.D


def test_stiffness_grows_with_the_load_by_its_power() -> None:
    trucks = []
    for exponent in (0.0, 0.5, 1.0):
        settings = scenario({"truck": {"stiffness_load_exponent": exponent}}, "semitrailer")
        trucks.append(native_truck(settings.truck, settings.steering))
    for k in range(2):
        fixed, half, full = (truck.axles[k].tyre.cornering_stiffness for truck in trucks)
        assert half == pytest.approx(math.sqrt(fixed * full), rel=1e-12)
        assert full > 1.2 * fixed


# Payload, lift axle, body roll, wind


def test_payload_moves_mass_centre_of_gravity_and_inertia_as_a_row_of_points_would() -> None:
    settings = scenario({"truck": {"payload": {"mass_kg": 4000.0, "distance_m": 2.9, "length_m": 3.0}}})
    truck = native_truck(settings.truck, settings.steering)
    goods = 2.9 + (np.arange(20000) + 0.5) / 20000 * 3.0 - 1.5
    masses, places = np.r_[8100.0, np.full(20000, 0.2)], np.r_[1.005, goods]
    centre = (masses * places).sum() / masses.sum()
    assert truck.mass == pytest.approx(masses.sum())
    assert truck.axles[0].distance == pytest.approx(centre)
    assert truck.axles[0].distance - truck.axles[1].distance == pytest.approx(3.7)
    assert truck.yaw_inertia == pytest.approx(24000.0 + (masses * (places - centre) ** 2).sum(), rel=1e-6)


def test_with_its_last_axle_up_a_6x2_is_a_4x2_and_turns_more_sharply_for_the_same_angle() -> None:
    change = {"truck": {"lift_axle_up_s": [[55.0, 200.0]]}, "steering": {"backlash_deg": 0.0}}
    turn = {"kind": "profile", "time_s": [0.0, 20.0, 22.0, 90.0], "angle_deg": [0.0, 0.0, 40.0, 40.0]}
    rows, settings = steered_by_machine(turn, 90.0, 36.0, change, "6x2"), scenario(change, "6x2")
    v, r, wheels, lift = (rows[c] for c in ("vehicle_speed", "yaw_rate", "front_wheel_angle", "second_truck"))
    for at, lifted in ((5400, False), (8990, True)):
        L_e = equivalent_wheelbase_m(settings.truck, settings.steering, lifted=lifted)
        K = understeer_gradient(settings.truck, settings.steering, lifted=lifted)
        assert lift[at] == lifted
        assert wheels[at] == pytest.approx(L_e * r[at] / v[at] + K * v[at] * r[at], rel=1e-6)
        assert L_e == pytest.approx(4.6, rel=1e-12) if lifted else L_e > 5.3
    assert r[8990] > 1.1 * r[5400]
    assert np.abs(np.diff(r))[5000:].max() < 1e-3  # without a jolt


def changing_load(percent: float, **truck: Any) -> dict[str, Any]:
    change = {"begin_s": 200.0, "load_percent": percent, "ride_height_steer_deg": 3.0}
    return {
        "drive": {"duration_s": 500.0, "standing_s": [[150.0, 250.0]]},
        "truck": {"load_change": change, "relaxation_length_m": 0.5, **truck},
    }


def group_loads_kg(truck: Any) -> tuple[float, float]:
    """The loads by moments about the axles of a 4x2; D is friction times load."""
    front, rear = (truck.axles[k].tyre.D / STANDARD_GRAVITY for k in range(2))
    return front, rear


@pytest.mark.parametrize("layout", ["4x2", "semitrailer"])
@pytest.mark.parametrize("exponent", [0.85, 1.0])
def test_a_load_change_changes_rear_axle_load_and_stiffness(layout: str, exponent: float) -> None:
    changes = changing_load(-35.0, tyres={"model": "brush", "friction": 1.0}, stiffness_load_exponent=exponent)
    settings = scenario(changes, layout)
    before, after = settings.truck, load_changed(settings.truck)
    native = [native_truck(truck, settings.steering) for truck in (before, after)]
    loads = [group_loads_kg(truck) for truck in native]
    assert loads[1][1] == pytest.approx(0.65 * loads[0][1], rel=1e-9)
    if layout == "4x2":
        assert loads[1][0] == pytest.approx(loads[0][0], rel=1e-9)
        assert native[1].mass == pytest.approx(8100.0 - 0.35 * loads[0][1])
    else:
        assert native[1].trailer.mass < native[0].trailer.mass
    rear = [truck.axles[1].tyre.cornering_stiffness for truck in native]
    assert rear[1] == pytest.approx(0.65**exponent * rear[0], rel=1e-9)


def test_a_load_change_equals_a_payload_over_the_rear_axle() -> None:
    """Both ways to say it give the same truck."""
    settings = scenario(changing_load(50.0, stiffness_load_exponent=0.8))
    rear_kg = 8100.0 * 1.005 / 3.7
    payload = {"mass_kg": 0.5 * rear_kg, "distance_m": 3.7, "length_m": 1e-6}
    laden = scenario({"truck": {"payload": payload, "stiffness_load_exponent": 0.8}})
    a, b = native_truck(load_changed(settings.truck), settings.steering), native_truck(laden.truck, laden.steering)
    assert (a.mass, a.yaw_inertia) == pytest.approx((b.mass, b.yaw_inertia), rel=1e-9)
    for k in range(2):
        assert a.axles[k].distance == pytest.approx(b.axles[k].distance, rel=1e-9)
        assert a.axles[k].tyre.cornering_stiffness == pytest.approx(b.axles[k].tyre.cornering_stiffness, rel=1e-9)


def test_after_a_load_change_the_truck_understeers_by_the_formula_s_new_gradient() -> None:
    """K_us/g = (m_f/C_f - m_r/C_r) with the compliance of the steering: only the rear axle's part changes."""
    exponent = 0.6
    settings = scenario(changing_load(-35.0, stiffness_load_exponent=exponent))
    rear = 8100.0 * 1.005 / 3.7 / 235000.0
    before = understeer_gradient(settings.truck, settings.steering)
    after = understeer_gradient(load_changed(settings.truck), settings.steering)
    assert after - before == pytest.approx(rear * (1.0 - 0.65 ** (1.0 - exponent)), rel=1e-9)
    turn = {"kind": "profile", "time_s": [0.0, 260.0, 262.0, 300.0], "angle_deg": [0.0, 0.0, 30.0, 30.0]}
    changes = changing_load(-35.0, stiffness_load_exponent=exponent)
    changes["drive"].pop("duration_s")
    rows = steered_by_machine(turn, 300.0, 60.0, changes | {"steering": {"backlash_deg": 0.0}})
    v, r, wheels, share = (rows[-1][c] for c in ("vehicle_speed", "yaw_rate", "front_wheel_angle", "second_truck"))
    assert share == 1.0
    assert wheels == pytest.approx(3.7 * r / v + after * v * r, rel=1e-5)
    assert wheels == pytest.approx((30.0 - 3.0) * DEGREE / 19.3, rel=1e-9)


def test_the_truth_has_values_and_time_of_a_load_change() -> None:
    settings = scenario(changing_load(-35.0, stiffness_load_exponent=0.6))
    normals = np.random.default_rng(1).standard_normal((2, tick_count(settings)))
    rows = run(settings, lay_road(settings, np.random.default_rng(1)), *normals)
    truth = truth_of(settings, 1, rows, sense(settings, rows, np.random.default_rng(2)))
    assert truth.load_changed_understeer_gradient == understeer_gradient(
        load_changed(settings.truck), settings.steering
    )
    straight_deg = truth.table["straight_ahead_rad"].to_numpy() / DEGREE
    assert list(np.flatnonzero(np.diff(straight_deg))) == [19999]
    assert (straight_deg[0], straight_deg[-1]) == pytest.approx((0.0, 3.0))
    assert truth.straight_ahead_rad / DEGREE == pytest.approx(3.0)
    assert truth.table["axle_lift"].max() == 0.0
    assert np.abs(rows["lateral_error"]).max() < 1.2


def test_the_truth_s_summary_has_what_a_load_change_patches_and_a_torsion_bar_make(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(
        """
        about = "unloads, on a wet road"
        base = "thesis_drive"
        [drive]
        duration_s = 300.0
        standing_s = [[100.0, 140.0]]
        [truck]
        stiffness_load_exponent = 0.7
        load_change = {begin_s = 120.0, load_percent = -35.0, ride_height_steer_deg = 3.0}
        [steering]
        torsion_bar_twist_deg = 1.5
        torsion_bar_half_moment_n_m = 60.0
        overlay_motor = {lash_deg = 6.0, carries_s = [[30.0, 80.0]]}
        bump_steer_sd_deg = 0.02
        [road.patches]
        spacing_m = [100.0, 300.0]
        length_m = [50.0, 200.0]
        front_stiffness_percent = -35.0
        rear_stiffness_percent = -25.0
        """,
        encoding="utf-8",
    )
    truth = simulate_to_log(tmp_path / "mine.toml", 1, tmp_path / "drive.csv")
    said = tomllib.loads((tmp_path / "drive.truth.toml").read_text(encoding="utf-8"))
    assert said["backlash_deg"] == pytest.approx(9.0)
    assert said["torsion_bar_deg"] == pytest.approx(3.0)
    assert said["straight_ahead_deg"] == pytest.approx(3.0)
    assert truth.load_changed_understeer_gradient is not None
    assert truth.patch_understeer_gradient is not None
    for key, value in (
        ("load_changed_understeer_gradient_deg_m_s2", truth.load_changed_understeer_gradient),
        ("patch_understeer_gradient_deg_m_s2", truth.patch_understeer_gradient),
    ):
        assert said[key] == pytest.approx(value / DEGREE, rel=1e-8)
        assert said[key] > said["understeer_gradient_deg_m_s2"]
    assert {"place_in_lash", "motor_carries", "load_change", "straight_ahead_rad", "road_patch"} <= set(
        truth.table.columns
    )


def test_body_roll_adds_gravity_to_the_accelerometer() -> None:
    settings = scenario({"truck": {"roll_deg_m_s2": 0.5}})
    truck, given = native_truck(settings.truck, settings.steering), acting(0.02, 20.0)
    state = settled(truck, given)
    a_y = specific_force(state, truck, given)
    assert state.roll == pytest.approx(0.5 * DEGREE * a_y, rel=1e-6)
    assert state.roll > 0.0  # right side down in a bend to the left
    turn = {"kind": "profile", "time_s": [0.0, 20.0, 22.0, 40.0], "angle_deg": [0.0, 0.0, 25.0, 25.0]}
    last = steered_by_machine(turn, 40.0, 60.0, {"truck": {"roll_deg_m_s2": 0.5}})[-1]
    a_y, felt = last["lateral_acceleration"], last["felt_lateral_acceleration"]
    assert a_y > 1.0
    assert felt == pytest.approx(a_y * (1 + 0.5 * DEGREE * STANDARD_GRAVITY), rel=1e-3)


def test_a_crosswind_balanced_by_the_tyres_is_not_measured() -> None:
    truck, speed, push, arm = thesis_truck(), 20.0, 2000.0, 0.8
    bends = [settled(truck, given).yaw_rate for given in (acting(1e-3, speed), acting(0.0, speed, 0.0, push, arm))]
    against = -bends[1] / bends[0] * 1e-3  # the front wheel angle that holds it straight
    given = acting(against, speed, 0.0, push, arm)
    state = settled(truck, given)
    front, rear = state.axle_forces[0], state.axle_forces[1]
    assert specific_force(state, truck, given) == pytest.approx(0.0, abs=1e-9)
    assert front + rear == pytest.approx(-push, rel=1e-9)
    assert truck.axles[0].distance * front + truck.axles[1].distance * rear == pytest.approx(-push * arm, rel=1e-9)


# The semitrailer


@dataclass
class Lagrange:
    """Tractor and semitrailer by Lagrange's equations in the plane's own axes, all angles small, tyres without lag.

    q = (y, psi, psi_t): the tractor's centre of gravity across its first direction, and both headings; the trailer's is
    y + h psi - c psi_t. An axle's slip angle is its heading (and steering) less the direction that its place moves in.
    """

    truck: Any
    v: float

    @property
    def mass(self) -> np.ndarray:
        t, s = self.truck, self.truck.trailer
        tractor = np.diag([t.mass, t.yaw_inertia, s.yaw_inertia])
        arm = np.array([1.0, t.hitch_distance, -s.gravity_centre_distance])
        return tractor + s.mass * np.outer(arm, arm)

    @property
    def axles(self) -> list[tuple[Any, np.ndarray, int]]:
        """Each with how its place moves over q, and which heading it has."""
        t, s = self.truck, self.truck.trailer
        front = [(t.axles[k], np.array([1.0, t.axles[k].distance, 0.0]), 1) for k in range(t.axle_count)]
        behind = [(s.axles[k], np.array([1.0, t.hitch_distance, s.axles[k].distance]), 2) for k in range(s.axle_count)]
        return front + behind

    def system(self) -> tuple[np.ndarray, np.ndarray]:
        """x' = A x + b delta for x = (q, q')."""
        damping, stiffness, input_ = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3)
        for axle, moves, heading in self.axles:
            C = lib.sim_axle_stiffness(ffi.addressof(axle))
            damping -= C / self.v * np.outer(moves, moves)
            stiffness[:, heading] += C * moves
            input_ += C * axle.steer_share * moves
            damping[heading, heading] -= axle.scrub_stiffness / self.v
        inverse = np.linalg.inv(self.mass)
        A = np.block([[np.zeros((3, 3)), np.eye(3)], [inverse @ stiffness, inverse @ damping]])
        return A, np.r_[np.zeros(3), inverse @ input_]


def semitrailer(payload: dict[str, Any] | None = FULL_LOAD, **trailer: Any) -> Any:
    settings = scenario({"truck": {"trailer": SEMITRAILER | {"payload": payload} | trailer}})
    return native_truck(settings.truck, settings.steering)


@pytest.mark.parametrize("payload", [None, FULL_LOAD | {"mass_kg": 12500.0}, FULL_LOAD], ids=["empty", "half", "full"])
@pytest.mark.parametrize("speed", [8.0, 25.0])
def test_a_semitrailer_swings_by_lagrange_s_equations(payload: dict[str, Any] | None, speed: float) -> None:
    truck, delta = semitrailer(payload), 1e-5
    for axles, count in ((truck.axles, truck.axle_count), (truck.trailer.axles, truck.trailer.axle_count)):
        for k in range(count):
            axles[k].relaxation_length = 0.0
    A, b = Lagrange(truck, speed).system()
    step = expm(np.block([[A, b[:, None] * delta], [np.zeros((1, 7))]]) * STEP_S)
    x, state = np.r_[np.zeros(6), 1.0], ffi.new("sim_truck_state *")
    for _ in range(1600):
        lib.sim_truck_step(state, truck, acting(delta, speed), STEP_S)
        x = step @ x
        assert state.yaw_rate == pytest.approx(x[4], abs=2e-6 * delta)
        assert state.trailer.yaw_rate == pytest.approx(x[5], abs=2e-6 * delta)
        assert state.trailer.articulation == pytest.approx(x[1] - x[2], abs=2e-6 * delta)


@pytest.mark.parametrize("articulation", [-1.2, -0.3, 0.0, 0.7, 1.3])
def test_at_any_articulation_hitch_and_trailer_move_together_and_newton_holds(articulation: float) -> None:
    """Across the trailer: its own axis is turned by the articulation against the truck's, in which the hitch moves."""
    truck, slope = semitrailer(), ffi.new("sim_trailer_state *")
    trailer = ffi.addressof(truck, "trailer")
    side_forces = [3000.0, -2000.0, 5000.0]
    state = ffi.new("sim_trailer_state *", [0.2, articulation, side_forces])
    hitch = {"speed": 5.0, "lateral_speed": 1.5, "yaw_rate": 0.6, "lateral_acceleration": 2.0, "gravity_to_left": 0.3}
    pull = lib.sim_trailer_slope(state, trailer, ffi.new("sim_hitch *", hitch | {"mobility": 1 / 9000.0}), slope)

    sine, cosine = np.sin(articulation), np.cos(articulation)
    of_hitch = (
        cosine * (hitch["lateral_acceleration"] - pull / 9000.0) - sine * hitch["lateral_speed"] * hitch["yaw_rate"]
    )
    c = trailer.gravity_centre_distance
    moved = of_hitch - c * slope.yaw_rate - cosine * hitch["gravity_to_left"]
    at_hitch = pull / cosine
    assert trailer.mass * moved == pytest.approx(sum(side_forces) + at_hitch, rel=1e-9)
    turning = sum((trailer.axles[k].distance + c) * side_forces[k] for k in range(3))
    assert trailer.yaw_inertia * slope.yaw_rate == pytest.approx(turning + c * at_hitch, rel=1e-9)
    assert slope.articulation == pytest.approx(hitch["yaw_rate"] - 0.2)


def test_a_semitrailer_in_a_steady_bend_hangs_as_the_static_equations_say() -> None:
    """Unknown: front wheel angle, direction, articulation, hitch force. Known: the bend, the speed and all axles."""
    truck, speed, curvature = semitrailer(), 15.0, 1e-4
    trailer, h, a_y = truck.trailer, truck.hitch_distance, 1e-4 * 15.0**2
    rows, right = np.zeros((4, 4)), np.array([truck.mass * a_y, 0.0, trailer.mass * a_y, 0.0])
    rows[0, 3], rows[1, 3], rows[2, 3], rows[3, 3] = -1.0, -h, 1.0, trailer.gravity_centre_distance
    for k in range(truck.axle_count):
        axle, x = truck.axles[k], truck.axles[k].distance
        C = lib.sim_axle_stiffness(ffi.addressof(axle))
        for row, arm in ((0, 1.0), (1, x)):
            rows[row, :2] += arm * C * np.array([axle.steer_share, -1.0])
            right[row] += arm * C * x * curvature
    for k in range(trailer.axle_count):
        axle, e = trailer.axles[k], -trailer.axles[k].distance
        C = lib.sim_axle_stiffness(ffi.addressof(axle))
        for row, arm in ((2, 1.0), (3, trailer.gravity_centre_distance - e)):  # moves at direction + h/R + angle - e/R
            rows[row, 1:3] -= arm * C
            right[row] += arm * C * (h - e) * curvature
    angle, direction, articulation, hitch_force = np.linalg.solve(rows, right)
    state = settled(truck, acting(angle, speed), 60.0)
    assert state.yaw_rate == pytest.approx(speed * curvature, rel=1e-6)
    assert state.lateral_speed == pytest.approx(speed * direction, rel=1e-5)
    assert state.trailer.articulation == pytest.approx(articulation, rel=1e-5)
    of_axles = sum(state.trailer.axle_forces[k] for k in range(3))
    assert trailer.mass * a_y - of_axles == pytest.approx(hitch_force, rel=1e-5)


def test_at_walking_speed_a_one_axle_trailer_cuts_the_corner_by_its_geometry() -> None:
    """All axles point to one centre: articulation and off-tracking follow from the lengths alone."""
    truck, angle = semitrailer(axle_count=1), 0.25
    state = settled(truck, acting(angle, 0.4), 300.0)
    R = truck.axles[0].distance - truck.axles[1].distance
    R /= angle  # of the rear axle: the wheels' tangent is their angle here
    ahead = truck.hitch_distance - truck.axles[1].distance
    at_hitch = math.hypot(R, ahead)
    articulation = math.asin(7.7 / at_hitch) - math.atan(ahead / R)
    assert 28 * DEGREE < articulation < 30 * DEGREE
    assert state.trailer.articulation == pytest.approx(articulation, rel=1e-5)
    cut_m = R - math.sqrt(at_hitch**2 - 7.7**2)
    assert cut_m == pytest.approx(2.1, abs=0.2)
    assert state.yaw_rate == pytest.approx(state.trailer.yaw_rate, rel=1e-5)


def one_step(truck: Any, speed: float, x: np.ndarray) -> np.ndarray:
    """The state of motions and side forces (in MN) after one step."""
    state = ffi.new("sim_truck_state *")
    trailer = state.trailer
    state.lateral_speed, state.yaw_rate, trailer.yaw_rate, trailer.articulation = x[:4]
    state.axle_forces[0:2], trailer.axle_forces[0:3] = list(x[4:6] * 1e6), list(x[6:9] * 1e6)
    lib.sim_truck_step(state, truck, acting(0.0, speed), STEP_S)
    motion = [state.lateral_speed, state.yaw_rate, trailer.yaw_rate, trailer.articulation]
    return np.r_[motion, np.array([*state.axle_forces[0:2], *trailer.axle_forces[0:3]]) / 1e6]


@pytest.mark.parametrize("payload", [None, FULL_LOAD], ids=["empty", "full"])
def test_a_semitrailer_s_swing_dies_away_and_the_sooner_the_slower_it_drives(payload: dict[str, Any] | None) -> None:
    damping = []
    for speed in (15.0, 25.0):
        truck, tiny = semitrailer(payload), 1e-6
        jacobian = np.stack([one_step(truck, speed, tiny * unit) / tiny for unit in np.eye(9)], axis=1)
        poles = np.log(np.linalg.eigvals(jacobian)) / STEP_S
        assert (poles.real < 0).all()
        damping.append(float((-poles.real / np.abs(poles)).min()))
    assert 0.2 < damping[1] < damping[0]


def test_a_semitrailer_changes_the_tractor_s_understeer_gradient() -> None:
    alone = scenario()
    laden = scenario(layout="semitrailer")
    gradients = [understeer_gradient(s.truck, s.steering) for s in (alone, laden)]
    assert gradients[0] / DEGREE == pytest.approx(0.40, abs=0.01)
    assert gradients[1] != pytest.approx(gradients[0], rel=0.02)


# The fifth wheel's friction


def test_fifth_wheel_friction_dissipates_friction_times_angle_in_each_swing() -> None:
    """Dahl: over each way of 2 A the share goes from -1 to 1 as 1 - 2 exp(-x / z), so that it costs M (2 A - 2 z)."""
    truck, amplitude, M = semitrailer(fifth_wheel_friction_n_m=8000.0), 5 * DEGREE, 8000.0
    trailer = ffi.addressof(truck, "trailer")
    state, slope = ffi.new("sim_trailer_state *"), ffi.new("sim_trailer_state *")
    steps, spent = 40_000, []
    for k in range(2 * steps):
        rate = amplitude * 2 * np.pi / steps * np.cos(2 * np.pi * k / steps)
        hitch = ffi.new("sim_hitch *", {"speed": 10.0, "yaw_rate": rate, "mobility": 1e-4})
        lib.sim_trailer_slope(state, trailer, hitch, slope)
        spent.append(lib.sim_trailer_friction(state, trailer) * rate)
        state.friction_share += slope.friction_share
        assert abs(state.friction_share) <= 1.0
    assert sum(spent[steps:]) == pytest.approx(2 * M * (2 * amplitude - 2 * 0.0035), rel=1e-3)


def straight_on_after(truck: Any, bend: float) -> tuple[float, float]:
    """Front wheel angle that drives straight on after a bend by another, and the friction that is left, N m."""
    state, angle, speed = ffi.new("sim_truck_state *"), bend, 20.0
    for k in range(round(60.0 / STEP_S)):
        time_s = k * STEP_S
        angle = bend * min(1.0, max(0.0, (15.0 - time_s) / 5.0)) if time_s < 15.0 else angle
        angle -= 0.2 * state.yaw_rate * STEP_S if time_s >= 15.0 else 0.0
        lib.sim_truck_step(state, truck, acting(angle, speed), STEP_S)
    assert state.yaw_rate == pytest.approx(0.0, abs=1e-6)
    return angle, lib.sim_trailer_friction(ffi.addressof(state, "trailer"), ffi.addressof(truck, "trailer"))


def test_after_a_bend_the_fifth_wheel_s_friction_holds_the_truck_as_the_static_equations_say() -> None:
    """The trailer's axles take M/d, the hitch hands that to the truck, whose axles balance it together with M."""
    truck = semitrailer(fifth_wheel_friction_n_m=8000.0)
    after = [straight_on_after(truck, bend) for bend in (0.03, -0.03)]
    assert after[0] == pytest.approx([-value for value in after[1]], rel=1e-6)
    angle, M = after[0]
    assert -8000.0 <= M < -6000.0  # the trailer that straightens turns the truck to the left after a bend to the left
    C = [lib.sim_axle_stiffness(ffi.addressof(truck.axles[k])) for k in range(2)]
    x = [truck.axles[k].distance for k in range(2)]
    of_hitch = -M * lib.sim_trailer_load_of(ffi.addressof(truck, "trailer")).per_moment
    forces = np.linalg.solve([[1.0, 1.0], x], [of_hitch, truck.hitch_distance * of_hitch + M])
    assert angle < -0.05 * DEGREE
    assert angle == pytest.approx(forces[0] / C[0] - forces[1] / C[1], rel=1e-3)
    assert straight_on_after(semitrailer(), 0.03) == pytest.approx((0.0, 0.0), abs=1e-6)


def test_from_a_bend_to_a_stop_the_fifth_wheel_keeps_its_friction_without_a_jolt() -> None:
    truck, state = semitrailer(fifth_wheel_friction_n_m=8000.0), ffi.new("sim_truck_state *")
    forces, shares = [], []
    for speed in np.r_[np.linspace(0, 5, 8000), np.linspace(5, 0, 8000), np.zeros(800)]:
        lib.sim_truck_step(state, truck, acting(0.03, speed), STEP_S)
        forces.append(state.axle_forces[0])
        shares.append(state.trailer.friction_share)
    assert shares[-1] == pytest.approx(shares[-400], abs=1e-6)
    assert shares[-1] > 0.5
    assert np.abs(np.diff(forces)).max() < 60.0
    without = settled(semitrailer(), acting(0.03, 0.0))
    carried = [sum(s.axle_forces[k] for k in range(2)) + sum(s.trailer.axle_forces[0:3]) for s in (state, without)]
    assert carried[0] == pytest.approx(carried[1], abs=1.0)  # what it takes from one axle it gives to others
    assert abs(state.axle_forces[0] - without.axle_forces[0]) > 500.0


# What is refused, and what is shipped


@pytest.mark.parametrize(
    ("layout", "changes", "names"),
    [
        ("4x2", {"mass_kg": -1.0}, "truck.mass_kg"),
        ("4x2", {"rear_axle_spacing_m": 1.3}, "rear_axle_spacing_m"),
        ("6x4", {"rear_axle_spacing_m": None}, "rear_axle_spacing_m"),
        ("8x4", {"front_axle_spacing_m": 6.0}, "front_axle_spacing_m"),
        ("6x4", {"axle_layout": "6x6"}, "truck.axle_layout"),
        ("6x4", {"second_axle_steer_share": 0.5}, "second_axle_steer_share"),
        ("6x4", {"lift_axle_up_s": [[10.0, 20.0]]}, "lift_axle_up_s"),
        ("6x2", {"lift_axle_up_s": [[10.0, 12.0]]}, "lift_axle_up_s"),
        ("6x4", {"dual_tyre_spacing_m": 0.0}, "dual_tyre_spacing_m"),
        ("4x2", {"tyres": {"model": "brush", "friction": 0.8}, "relaxation_length_m": 0.0}, "relaxation_length_m"),
        ("4x2", {"tyres": {"model": "brush", "friction": 0.8, "C": 1.3}}, "'C'"),
        ("4x2", {"tyres": {"model": "magic_formula", "friction": 0.8, "C": 1.3}}, "'E'"),
        ("4x2", {"payload": {"mass_kg": 9000.0, "distance_m": 9.0, "length_m": 2.0}}, "payload"),
        ("4x2", {"payload": {"mass_kg": -9.0, "distance_m": 2.0, "length_m": 2.0}}, "truck.payload.mass_kg"),
        ("semitrailer", {"trailer": SEMITRAILER | {"gravity_centre_m": 8.0}}, "truck.trailer"),
        ("semitrailer", {"trailer": SEMITRAILER | {"hitch_m": 12.0, "payload": FULL_LOAD}}, "has an axle without load"),
        ("semitrailer", {"trailer": SEMITRAILER | {"axle_count": 4}}, "truck.trailer.axle_count"),
        ("4x2", {"load_change": {"begin_s": 5.0, "load_percent": -90.0}}, "truck.load_change.load_percent"),
        ("4x2", {"load_change": {"begin_s": 900.0, "load_percent": -30.0}}, "must be within a standstill"),
        (
            "6x2",
            {"load_change": {"begin_s": 5.0, "load_percent": -30.0}, "lift_axle_up_s": [[10.0, 20.0]]},
            "cannot be given together",
        ),
        (
            "semitrailer",
            {"trailer": SEMITRAILER, "load_change": {"begin_s": 5.0, "load_percent": -30.0}},
            "removes .* kg, but 'truck.trailer.payload' has only",
        ),
        ("semitrailer", {"trailer": SEMITRAILER | {"fifth_wheel_friction_n_m": -1.0}}, "fifth_wheel_friction_n_m"),
    ],
)
def test_an_impossible_truck_is_refused_by_name(layout: str, changes: dict[str, Any], names: str) -> None:
    with pytest.raises(OncenterError, match=names) as refusal:
        check_holdable(scenario({"truck": changes}, layout))
    assert refusal.value.exit_code == 2
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("layout", ["6x2", "6x4", "8x4"])
def test_a_shipped_vehicle_file_has_the_equivalent_wheelbase_of_its_layout(layout: str) -> None:
    settings, shipped = scenario(layout=layout), vehicle(f"rigid_{layout}")
    assert shipped.axle_layout == layout
    assert shipped.wheelbase_m == pytest.approx(equivalent_wheelbase_m(settings.truck, settings.steering), abs=0.005)
