"""The simulated truck against closed forms: (4) to (7), (10), (13), Winkler's equivalent wheelbase, Lagrange's equations."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from layouts import FULL_LOAD, SEMITRAILER, TRUCKS, scenario
from scipy.linalg import expm

from oncenter.errors import OncenterError
from oncenter.signals import DEGREE, STANDARD_GRAVITY
from oncenter.simulate import simulate
from oncenter.simulate.drive import ffi, lib
from oncenter.simulate.truck import (
    check_holdable,
    equivalent_wheelbase_m,
    native_truck,
    steered_stiffness_n_rad,
    understeer_gradient,
)
from oncenter.vehicle import vehicle

STEP_S = 0.0025
SHARED = {"wheelbase_m": 3.7, "front_axle_distance_m": 1.005}


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
    """Articulation makes cosines of which (10) knows nothing: a few 1e-4 with the semitrailer."""
    settings = scenario(layout=layout)
    truck, given = native_truck(settings.truck, settings.steering), acting(angle, speed, to_left)
    state = settled(truck, given)
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
    front, *rear = list(native_truck(settings.truck, settings.steering).axles)[: 2 if layout == "4x2" else 3]
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
    C_r = sum(native_truck(settings.truck, settings.steering).axles[k].tyre.cornering_stiffness for k in (1, 2))
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
def test_from_standstill_to_walking_speed_and_back_the_truck_rolls_where_its_wheels_point_without_a_jolt(
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


@pytest.mark.parametrize("tyres", [{"model": "brush", "friction": 0.8}, {"model": "magic_formula", "friction": 0.8, "C": 1.3, "E": -1.0}])
def test_saturating_tyres_are_linear_on_centre_and_hold_no_more_than_friction(tyres: dict[str, Any]) -> None:
    linear, bounded = scenario(), scenario({"truck": {"tyres": tyres}})
    speed = 20.0
    yaw_rates = []
    for angle in (1e-4, 0.05):
        for settings in (linear, bounded):
            truck = native_truck(settings.truck, settings.steering)
            yaw_rates.append(settled(truck, acting(angle, speed)).yaw_rate)
    assert yaw_rates[1] == pytest.approx(yaw_rates[0], rel=5e-3)
    assert speed * yaw_rates[2] > 7.0
    assert speed * yaw_rates[3] < 0.8 * STANDARD_GRAVITY


def test_stiffness_grows_with_the_load_by_its_power() -> None:
    axles = {}
    for exponent in (0.0, 0.5, 1.0):
        settings = scenario({"truck": {"stiffness_load_exponent": exponent}}, "semitrailer")
        axles[exponent] = native_truck(settings.truck, settings.steering).axles
    for k in range(2):
        fixed, half, full = (axles[e][k].tyre.cornering_stiffness for e in (0.0, 0.5, 1.0))
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
    profile = {"kind": "profile", "time_s": [0.0, 20.0, 22.0, 90.0], "angle_deg": [0.0, 0.0, 20.0, 20.0]}
    settings = scenario(
        {
            "drive": {"duration_s": 90.0, "standing_at_start_s": 0.0, "standing_at_end_s": 0.0},
            "truck": {"lift_axle_up_s": [[55.0, 200.0]]},
            "road": None or {"kind": "open", **dict.fromkeys(OF_BENDS)},
            "driver": {"speed_km_h": [36.0, 36.0], "acceleration_max_m_s2": 2.0},
            "steering": {"backlash_deg": 0.0},
            "manoeuvre": profile,
        },
        "6x2",
    )
    table = driven(settings).table
    assert equivalent_wheelbase_m(settings.truck, settings.steering, lifted=True) == pytest.approx(4.6, rel=1e-12)
    r, v, wheels, lift = (
        table[c].to_numpy() for c in ("yaw_rate_rad_s", "vehicle_speed_m_s", "front_wheel_angle_rad", "axle_lift")
    )
    gains = []
    for at, lifted in ((5400, False), (8990, True)):
        L_e = equivalent_wheelbase_m(settings.truck, settings.steering, lifted=lifted)
        K = understeer_gradient(settings.truck, settings.steering, lifted=lifted)
        assert lift[at] == lifted
        a_y = v[at] * r[at] - STANDARD_GRAVITY * -0.02
        assert wheels[at] == pytest.approx(L_e * r[at] / v[at] + K * a_y, rel=1e-4)
        gains.append(r[at])
    assert gains[1] > 1.1 * gains[0]
    assert np.abs(np.diff(r)).max() < 0.002  # no jolt
