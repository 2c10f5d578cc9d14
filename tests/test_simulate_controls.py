"""Simulated drives with controls at work: a motor and a resting hand, brakes, a steered rear axle, backwards; and their
statuses on the bus."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from layouts import scenario, steered_by_machine

from oncenter.signals import DEGREE
from oncenter.simulate import _simulate
from oncenter.simulate.can import frames
from oncenter.simulate.drive import ROW_DTYPE, ffi, lib, run, tick_count
from oncenter.simulate.interventions import at_work, brake_moment_n_m, wheel_slip
from oncenter.simulate.road import lay_road
from oncenter.simulate.scenario import Scenario
from oncenter.simulate.sensor_sections import RearAxleAngleSensor
from oncenter.simulate.sensors import sense
from oncenter.simulate.sensors.status import sense_rear_axle_angle
from oncenter.simulate.steering import native_steering
from oncenter.simulate.truck import (
    equivalent_wheelbase_m,
    native_truck,
    rear_steer_share,
    rear_steer_weight,
    understeer_gradient,
)
from oncenter.simulate.truck_sections import Intervention

STEP_S = 0.0025
RATIO = 19.3
STATUSES = ["stability_control_active", "anti_lock_active", "steering_assist_active", "reverse", "axle_lifted"]


def driven(settings: Scenario, seed: int = 5) -> Any:
    normals = np.random.default_rng(seed).standard_normal((2, tick_count(settings)))
    return run(settings, lay_road(settings, np.random.default_rng(seed)), *normals)


def settled(truck: Any, seconds: float = 60.0, **given: float) -> Any:
    state = ffi.new("sim_truck_state *")
    acting = ffi.new("sim_truck_input *", given)
    for _ in range(round(seconds / STEP_S)):
        lib.sim_truck_step(state, truck, acting, STEP_S)
    return state, lib.sim_truck_lateral_acceleration(state, truck, acting)


# A steered rear axle

COUNTER_PHASE = ("4x2", {"share": -0.25})
TAG_AXLE = ("6x2", {"locks_above_km_h": 40.0})


def with_rear_steering(layout: str, rear: dict[str, float]) -> tuple[Scenario, Any]:
    settings = scenario({"truck": {"rear_steering": rear}}, layout)
    truck = native_truck(settings.truck, settings.steering)
    truck.axles[truck.axle_count - 1].steer_share = rear_steer_share(settings.truck)
    return settings, truck


@pytest.mark.parametrize(("layout", "rear"), [COUNTER_PHASE, TAG_AXLE], ids=["counter phase", "tag axle"])
@pytest.mark.parametrize(("speed", "angle", "to_left"), [(4.0, 0.05, 0.0), (10.0, -0.02, 0.3)])
def test_a_steady_bend_takes_the_front_angle_less_the_weighted_rear_angle_of_the_locked_truck(
    layout: str, rear: dict[str, float], speed: float, angle: float, to_left: float
) -> None:
    settings, truck = with_rear_steering(layout, rear)
    state, a_y = settled(truck, front_wheel_angle=angle, speed=speed, gravity_to_left=to_left)
    L_e = equivalent_wheelbase_m(settings.truck, settings.steering)
    K = understeer_gradient(settings.truck, settings.steering)
    rear_angle = rear_steer_share(settings.truck) * angle
    weight = rear_steer_weight(settings.truck, settings.steering)
    assert angle - weight * rear_angle == pytest.approx(L_e * state.yaw_rate / speed + K * a_y, rel=1e-9)


def test_on_two_axles_the_rear_axle_has_the_weight_one_and_as_a_tag_axle_less() -> None:
    weights = []
    for layout, rear in (COUNTER_PHASE, TAG_AXLE):
        settings, _ = with_rear_steering(layout, rear)
        weights.append(rear_steer_weight(settings.truck, settings.steering))
    assert weights[0] == pytest.approx(1.0, rel=1e-12)
    assert 0.4 < weights[1] < 0.8


def test_a_tag_axle_that_points_to_the_turning_centre_leaves_the_wheelbase_to_the_drive_axle() -> None:
    """No tyre slips then: Ackermann's angle, from the geometry alone."""
    _, truck = with_rear_steering(*TAG_AXLE)
    stance = lib.sim_truck_stance(truck, 0.02, 0.0)
    assert stance.front_wheel_angle == pytest.approx(0.02 * 4.6, rel=1e-12)
    assert stance.steered_force == pytest.approx(0.0, abs=1e-6)


def test_a_tag_axle_steers_below_its_locking_speed_and_is_straight_above_it() -> None:
    turn = {"kind": "profile", "time_s": [60.0, 62.0], "angle_deg": [0.0, 40.0]}
    for speed_km_h, share in ((20.0, -1.35 / 4.6), (35.0, -0.5 * 1.35 / 4.6), (45.0, 0.0)):
        truck = {"truck": {"rear_steering": {"locks_above_km_h": 40.0}}}
        rows = steered_by_machine(turn, 70.0, speed_km_h, truck, "6x2")
        assert rows["vehicle_speed"][-1] * 3.6 == pytest.approx(speed_km_h, rel=1e-3)
        assert rows["rear_axle_angle"][-1] == pytest.approx(share * rows["front_wheel_angle"][-1], rel=1e-2)


def test_the_rear_axle_s_sensor_reads_the_true_angle_and_its_offset() -> None:
    rows = np.zeros(2000, ROW_DTYPE)
    rows["rear_axle_angle"] = np.linspace(-4.0, 4.0, 2000) * DEGREE
    sensor = RearAxleAngleSensor(offset_deg=3.0, noise_sd_deg=0.1)
    read, faults = sense_rear_axle_angle(rows, sensor, np.random.default_rng(1))
    assert np.mean(read - rows["rear_axle_angle"]) / DEGREE == pytest.approx(3.0, abs=0.02)
    assert np.std(read - rows["rear_axle_angle"]) / DEGREE == pytest.approx(0.1, rel=0.1)
    assert [(fault.kind, fault.size) for fault in faults] == [("offset", pytest.approx(3.0 * DEGREE))]


# A hand that rests on the rim


def by_motor(state: Any, system: Any, gear_deg: float, resting_torque: float, seconds: float = 1.0) -> Any:
    given = {"angle": gear_deg * DEGREE, "motor_carries": 1, "resting_torque": resting_torque}
    for _ in range(round(seconds / STEP_S)):
        lib.sim_steering_step(state, system, ffi.new("sim_steering_input *", given), STEP_S)
    return state


def system_with_lash(**changes: Any) -> Any:
    settings = scenario({"steering": {"overlay_motor": {"lash_deg": 3.0}, **changes}})
    return native_steering(settings.steering, settings.truck)


@pytest.mark.parametrize(("torque", "place"), [(1.0, 1.0), (-1.0, -1.0)])
def test_a_resting_hand_keeps_the_wheel_on_its_side_of_the_lash_whatever_the_motor_turns(
    torque: float, place: float
) -> None:
    system, state = system_with_lash(), ffi.new("sim_steering_state *")
    for gear_deg in (10.0, -10.0, 4.0, 0.0):
        by_motor(state, system, gear_deg, torque)
        assert state.place_in_lash == pytest.approx(place)
        assert state.steering_wheel_angle == pytest.approx((gear_deg + 1.5 * place) * DEGREE)
        assert state.hand_torque == torque


def test_a_hand_below_the_column_s_friction_or_none_leaves_the_wheel_to_the_motor() -> None:
    for torque in (0.0, 0.2):
        system, state = system_with_lash(), ffi.new("sim_steering_state *")
        angles = [by_motor(state, system, gear, torque).steering_wheel_angle / DEGREE for gear in (10.0, -10.0)]
        assert angles == pytest.approx([8.5, -8.5])


def test_a_resting_hand_twists_the_torsion_bar_to_its_side() -> None:
    bar = {"torsion_bar_twist_deg": 1.0, "torsion_bar_half_moment_n_m": 300.0}
    system, state = system_with_lash(**bar), ffi.new("sim_steering_state *")
    by_motor(state, system, 0.0, 1.3)
    carried = 1.0 * RATIO * 10.0  # N m about the king pins, by the torque beyond the friction of 0.3 N m
    assert state.twist == pytest.approx(np.tanh(carried / 300.0) * DEGREE, rel=1e-3)


def lash_places(**motor: Any) -> tuple[Any, Any]:
    carries = {"lash_deg": 3.0, "carries_s": [[60.0, 300.0]], **motor}
    settings = scenario({"drive": {"duration_s": 320.0}, "steering": {"overlay_motor": carries}})
    rows = driven(settings)
    return rows, rows["place_in_lash"]


def test_in_a_drive_the_flank_stays_with_the_hand_and_alternates_without() -> None:
    _, alone = lash_places()
    _, rested = lash_places(resting_torque_n_m=-1.0, hands_off_s=[[200.0, 210.0]])
    steers = slice(7000, 20000)
    assert min(np.mean(alone[steers] > 0.99), np.mean(alone[steers] < -0.99)) > 0.1
    assert np.mean(rested[steers] < -0.99) > 0.95
    assert np.array_equal(alone[:6000], rested[:6000])


def test_within_its_dead_band_the_motor_stays_and_no_further() -> None:
    exact, _ = lash_places()
    coarse, _ = lash_places(dead_band_deg=0.5)
    steers = slice(7000, 30000)
    still = [np.mean(np.diff(rows["front_wheel_angle"][steers]) == 0.0) for rows in (exact, coarse)]
    assert still[1] > still[0] + 0.15
    assert np.abs(coarse["lateral_error"]).max() < 1.0


# Brakes of a control


def test_a_yaw_moment_turns_the_truck_as_two_equations_of_equilibrium_say() -> None:
    settings = scenario()
    truck, v, M = native_truck(settings.truck, settings.steering), 20.0, 8000.0
    state, _ = settled(truck, 20.0, speed=v, brake_moment=M)
    C = [lib.sim_axle_stiffness(ffi.addressof(truck.axles[k])) for k in range(2)]
    x = [truck.axles[k].distance for k in range(2)]
    # of lateral speed and yaw rate: sum of forces = m v r, sum of moments = 0
    forces = [[-sum(C) / v, -(C[0] * x[0] + C[1] * x[1]) / v - truck.mass * v]]
    moments = [[-(C[0] * x[0] + C[1] * x[1]) / v, -(C[0] * x[0] ** 2 + C[1] * x[1] ** 2) / v]]
    lateral_speed, yaw_rate = np.linalg.solve(np.array(forces + moments), [0.0, -M])
    assert yaw_rate > 0.0
    assert state.yaw_rate == pytest.approx(yaw_rate, rel=1e-9)
    assert state.lateral_speed == pytest.approx(lateral_speed, rel=1e-9)


def test_an_intervention_has_its_moment_within_its_time_and_its_status_with_it() -> None:
    spells = (
        Intervention(kind="stability_control", begin_s=10.0, length_s=3.0, yaw_moment_n_m=-9000.0),
        Intervention(kind="anti_lock", begin_s=20.0, length_s=2.0, wheel_slip_percent=20.0),
    )
    time_s = np.arange(3000) / 100.0
    moment = brake_moment_n_m(spells, time_s)
    assert moment[1100] == -9000.0
    assert np.count_nonzero(moment) == np.count_nonzero(at_work(spells, "stability_control", time_s)) == 299
    slips = [wheel_slip(spells, wheel, time_s) for wheel in range(4)]
    at = at_work(spells, "anti_lock", time_s) > 0.0
    assert 0.19 < max(slip[at].max() for slip in slips) <= 0.2
    assert not any(slip[~at].any() for slip in slips)
    assert not np.array_equal(slips[0], slips[2])


def braked_drive(**intervention: Any) -> Any:
    spell = {"begin_s": 100.0, "length_s": 3.0, **intervention}
    return driven(scenario({"drive": {"duration_s": 130.0, "standing_at_end_s": 0.0}, "interventions": [spell]}))


def test_the_driver_of_a_drive_with_an_intervention_is_the_same_before_it() -> None:
    rows = braked_drive(kind="stability_control", yaw_moment_n_m=9000.0, deceleration_m_s2=2.0)
    plain = driven(scenario({"drive": {"duration_s": 130.0, "standing_at_end_s": 0.0}}))
    for column in rows.dtype.names:
        assert np.array_equal(rows[column][:10000], plain[column][:10000], equal_nan=True), column
    assert rows["longitudinal_acceleration"][10100:10250].min() == pytest.approx(-2.0, rel=0.1)
    turned = rows["yaw_rate"] - plain["yaw_rate"]
    assert turned[10000:10100].max() > 0.5 * DEGREE
    assert np.abs(rows["lateral_error"]).max() < 2.0


# Backwards


def reversing(**sensors: Any) -> Scenario:
    drive = {"duration_s": 200.0, "standing_at_end_s": 0.0, "reverse_s": [[90.0, 150.0]], "reverse_speed_km_h": 7.0}
    bends = {"straight_length_m": [20.0, 40.0], "bend_radius_m": [40.0, 60.0], "clothoid_length_m": [10.0, 15.0]}
    speed = {"speed_km_h": [15.0, 25.0]}
    return scenario({"drive": drive, "road": bends, "driver": speed, "sensors": sensors})


@pytest.fixture(scope="module")
def there_and_back() -> Any:
    return driven(reversing())


def test_backwards_the_yaw_rate_is_speed_times_curvature_and_changes_its_sign() -> None:
    settings = scenario(layout="6x4")
    truck, angle = native_truck(settings.truck, settings.steering), 0.1
    rates = [settled(truck, 5.0, front_wheel_angle=angle, speed=v)[0].yaw_rate for v in (0.4, -0.4)]
    L_e = equivalent_wheelbase_m(settings.truck, settings.steering)
    assert rates == pytest.approx([0.4 * angle / L_e, -0.4 * angle / L_e], rel=1e-6)


def test_a_truck_backs_up_on_the_road_it_came_from_to_where_it_was(there_and_back: Any) -> None:
    backwards = there_and_back["vehicle_speed"] < 0.0
    assert there_and_back["vehicle_speed"].min() * 3.6 == pytest.approx(-7.0, rel=0.02)
    assert np.flatnonzero(backwards)[[0, -1]] / 100.0 == pytest.approx([94.0, 146.0], abs=5.0)
    there = slice(int(np.argmin(there_and_back["station"][:9000])), int(np.flatnonzero(backwards)[0]))
    back = there_and_back[backwards]
    columns = ("east", "north", "heading")
    came = [np.interp(back["station"], there_and_back["station"][there], there_and_back[c][there]) for c in columns]
    assert np.ptp(back["station"]) > 70.0
    away_m = np.hypot(back["east"] - came[0], back["north"] - came[1])
    assert away_m.max() < 1.5
    assert np.abs(back["heading"] - came[2]).max() < 10.0 * DEGREE
    assert np.ptp(back["heading"]) > 20.0 * DEGREE  # over a bend


def test_a_truck_that_swings_backwards_keeps_to_its_swing_by_large_angles() -> None:
    drive = {"duration_s": 160.0, "standing_at_end_s": 0.0, "reverse_s": [[60.0, 150.0]], "reverse_swing_m": 1.0}
    rows = driven(scenario({"drive": drive, "driver": {"lane_wander_sd_m": 0.0}}))
    back = rows[rows["vehicle_speed"] < -1.5][1000:]
    swing = np.sin(2.0 * np.pi * (back["station"] - (3.7 - 1.005)) / 30.0)
    assert np.corrcoef(back["lateral_error"], swing)[0, 1] > 0.8
    assert 1.5 < np.ptp(back["lateral_error"]) < 3.0
    assert np.abs(back["steering_wheel_angle"]).max() > 100.0 * DEGREE


def test_backwards_angle_and_yaw_rate_fit_with_the_negative_speed_only(there_and_back: Any) -> None:
    settings = reversing()
    steady = there_and_back["vehicle_speed"] < -1.5
    rows = there_and_back[steady]
    turned = rows["vehicle_speed"] * rows["front_wheel_angle"]
    turned /= equivalent_wheelbase_m(settings.truck, settings.steering)
    assert np.abs(turned).max() > 2.0 * DEGREE
    assert np.abs(rows["yaw_rate"] - turned).max() < 1.0 * DEGREE
    np.testing.assert_allclose(np.gradient(there_and_back["heading"], 0.01)[steady], rows["yaw_rate"], atol=0.01)


def test_backwards_speeds_are_read_without_sign_and_the_status_has_it(there_and_back: Any) -> None:
    settings = reversing(statuses=["reverse"])
    sensed = sense(settings, there_and_back, np.random.default_rng(2))
    true = there_and_back["vehicle_speed"]
    fast = np.abs(true) > 1.0
    for column in ("vehicle_speed_m_s", "wheel_speed_rear_left_m_s", "wheel_speed_front_right_m_s"):
        read = sensed.signals.columns[column][fast]
        assert np.abs(read - np.abs(true[fast])).max() < 0.5, column
    assert np.array_equal(sensed.statuses["reverse"] > 0.0, true < 0.0)


# Statuses on the bus


@pytest.fixture(scope="module")
def with_all_statuses() -> Any:
    """Ever each of the five is active."""
    changes = {
        "drive": {"duration_s": 150.0, "standing_at_end_s": 0.0, "reverse_s": [[90.0, 120.0]]},
        "truck": {"lift_axle_up_s": [[40.0, 60.0]]},
        "steering": {"overlay_motor": {"lash_deg": 3.0, "carries_s": [[130.0, 140.0]]}},
        "interventions": [
            {"kind": "stability_control", "begin_s": 70.0, "length_s": 2.0},
            {"kind": "anti_lock", "begin_s": 80.0, "length_s": 2.0},
        ],
    }
    sensed = [_simulate(scenario({**changes, "sensors": {"statuses": sent}}, "6x2"), 4)[0] for sent in ([], STATUSES)]
    return *sensed, frames(sensed[1], jitter_sd_s=0.0, seed=4)


def test_a_bus_that_sends_statuses_sends_all_other_signals_as_before(with_all_statuses: Any) -> None:
    without, sent, _ = with_all_statuses
    assert without.statuses == {}
    assert set(sent.statuses) == set(STATUSES)
    assert all(0.0 < status.mean() < 0.5 for status in sent.statuses.values())
    for name, values in without.signals.columns.items():
        assert np.array_equal(values, sent.signals.columns[name], equal_nan=True), name


@pytest.mark.parametrize(
    ("status", "pgn", "byte", "bit", "every"),
    [
        ("stability_control_active", 65103, 2, 7, 10),
        ("anti_lock_active", 61441, 1, 5, 10),
        ("axle_lifted", 65114, 5, 7, 10),
        ("reverse", 65132, 4, 7, 5),
    ],
)
def test_a_status_stands_in_its_two_bits_of_j1939(
    with_all_statuses: Any, status: str, pgn: int, byte: int, bit: int, every: int
) -> None:
    _, sent, bus = with_all_statuses
    payload = bus.payload[(bus.identifier >> 8 & 0x3FFFF) == pgn]
    assert np.array_equal(payload[:, byte - 1] >> (bit - 1) & 3, sent.statuses[status][::every])


def test_the_gear_is_below_zero_backwards_alone(with_all_statuses: Any) -> None:
    _, sent, bus = with_all_statuses
    etc2 = bus.payload[(bus.identifier >> 8 & 0x3FFFF) == 61445]
    gear = etc2[:, 3].astype(int) - 125
    assert np.array_equal(gear < 0, sent.statuses["reverse"][::10] > 0.0)
    assert gear.max() <= 12
    assert (etc2[:, [1, 2, 4, 5, 6, 7]] == 0xFF).all()


# Wind from one side


def test_wind_from_one_side_stays_there_whatever_the_heading() -> None:
    forces = []
    for heading in (0.0, 1.0, -2.0):
        wind = ffi.new("sim_wind *", {"mean": 8.0, "from": -90.0 * DEGREE, "force_constant": 6.0, "with_truck": 1})
        state = ffi.new("sim_wind_state *")
        given = ffi.new("sim_wind_input *", {"heading": heading, "speed": 20.0, "exposure": 1.0})
        lib.sim_wind_blow(state, wind, given)
        forces.append(state.lateral_force)
    assert forces == pytest.approx([6.0 * np.hypot(20.0, 8.0) * 8.0] * 3)  # from the right, so to the left
