"""Chapter 4: front wheel angles, the ratio both ways, the observer on motion with given steering."""

import math

import numpy as np
import numpy.typing as npt
import pytest

from oncenter import _core
from oncenter._native import ffi, lib
from oncenter.signals import DEGREE

WHEELBASE, TRACK, RATIO = 3.7, 2.05, 19.3
RATE_HZ = 100.0
K_US = math.radians(0.4)  # rad/(m/s^2)
Array = npt.NDArray[np.float64]


def front_wheels(angle: float) -> tuple[float, float]:
    """Speeds of the front wheels for a turn about a point on the rear axle's line, at 1 m/s of its centre."""
    rate = math.tan(angle) / WHEELBASE
    return tuple(math.hypot(1.0 - side * 0.5 * TRACK * rate, WHEELBASE * rate) for side in (1.0, -1.0))  # type: ignore[return-value]


@pytest.mark.parametrize("degrees", [-40.0, -10.0, -0.5, 0.0, 2.0, 25.0, 40.0])
def test_the_exact_formula_is_right_where_the_approximate_one_is_not(degrees: float) -> None:
    """(2) in both directions; (3) has an error of 10 % at 40 deg."""
    angle = degrees * DEGREE
    found = lib.oc_front_wheel_exact(WHEELBASE, TRACK, *front_wheels(angle), 0.0)
    assert found == pytest.approx(angle, abs=1e-9)
    left, right = front_wheels(angle)
    assert lib.oc_front_wheel_exact(WHEELBASE, TRACK, left / 1.004, right, 0.004) == pytest.approx(angle, abs=1e-9)


def test_a_left_turn_is_positive_by_every_formula() -> None:
    left, right = front_wheels(0.1)
    assert lib.oc_front_wheel_exact(WHEELBASE, TRACK, left, right, 0.0) > 0.0
    assert lib.oc_wheel_speed_front_angle(WHEELBASE, TRACK, left, right, 0.0) > 0.0
    assert lib.oc_front_wheel_by_yaw_rate(WHEELBASE, 0.1, 10.0, K_US, 1.0) > 0.0
    assert lib.oc_front_wheel_by_side_slip(10.0, 0.0, 0.1, WHEELBASE, -0.01) > 0.0


def test_side_slip_and_steady_state_agree_on_the_front_wheel_angle() -> None:
    """(23) with (24) against (22): the same truck in the same bend, slip angles by tyre stiffness."""
    v, r, front_m, mass, front_n, rear_n = 15.0, 0.08, 1.3, 9000.0, 4.0e5, 3.5e5
    rear_m, a = WHEELBASE - front_m, v * r
    front_slip, rear_slip = -mass * a * rear_m / WHEELBASE / front_n, -mass * a * front_m / WHEELBASE / rear_n
    lateral = rear_slip * v + rear_m * r  # of the centre of gravity
    gradient = mass / WHEELBASE * (rear_m / front_n - front_m / rear_n)
    by_slip = lib.oc_front_wheel_by_side_slip(v, lateral, r, front_m, front_slip)
    assert by_slip == pytest.approx(lib.oc_front_wheel_by_yaw_rate(WHEELBASE, r, v, gradient, a), abs=1e-5)


def test_the_front_tyres_slip_is_learned_and_subtracted() -> None:
    """(23): a receiver misaligned by 0.5 deg, 1.3 m behind the front axle; tyre slip of 0.4 deg per m/s^2."""
    turned, behind, slip, v = 0.5 * DEGREE, 1.3, 0.4 * DEGREE, 20.0
    evidence = ffi.new("oc_side_slip_evidence *")
    ticks = []
    for k in range(6000):
        r, a = 0.05 * math.sin(0.003 * k), math.sin(0.004 * k)  # independent, as bank and bends are
        front = 0.02 * math.sin(0.001 * k)
        v_y = v * (math.tan(front - turned - slip * a) - behind * r / v)
        tick = {"speed": v, "lateral_speed": v_y, "yaw_rate": r, "lateral_acceleration": a}
        ticks.append((ffi.new("oc_side_slip *", tick), front))
    for tick, front in ticks:
        lib.oc_side_slip_learn(evidence, tick, front, 1.0 / RATE_HZ, 600.0)
    found = [lib.oc_side_slip_front_wheel(evidence, tick, WHEELBASE) for tick, _ in ticks[::100]]
    assert found == pytest.approx([front for _, front in ticks[::100]], abs=0.1 * DEGREE)


@pytest.mark.parametrize("terms", [[], [0.0, 0.0518, 0.0, -0.0003], [0.001, 0.05, 1e-4, -2e-4, 1e-6]])
def test_the_ratio_goes_there_and_back(terms: list[float]) -> None:
    near_centre = 1.0 / terms[1] if terms else RATIO
    ratio = ffi.new("oc_ratio *", {"terms": len(terms), "coefficients": terms, "ratio": near_centre})
    for angle in np.linspace(-6.0, 6.0, 25):
        front = lib.oc_ratio_to_front_wheel(ratio, angle)
        assert lib.oc_ratio_to_steering_wheel(ratio, front) == pytest.approx(angle, abs=1e-7)


def truck(**members: float) -> dict[str, float]:
    truck = {
        "identified": True,
        "offset_sd": 0.005,
        "gradient": K_US,
        "gradient_sd": 0.0003,
        "creep": 1.7,
        "friction": 0.1,
    }
    return truck | members


def observe(
    yaw_rate: Array, speed: Array, acceleration: Array, sensor: Array, **members: float
) -> npt.NDArray[np.void]:
    """Runs the observer on columns, NaN without a sensor; T of one second is learned before."""
    design = ffi.new("oc_angle_design *")
    lib.oc_angle_setup(design, lib.OC_ANGLE_OBSERVER, ffi.new("oc_ratio *", {"ratio": RATIO}), WHEELBASE, RATE_HZ)
    tracking, evidence = ffi.new("oc_angle_tracking *"), ffi.new("oc_angle_evidence *")
    given, out = ffi.new("oc_angle_truck *", truck(**members)), ffi.new("oc_angle *")
    found = np.zeros(len(yaw_rate), _core.dtype_of(ffi.typeof("oc_angle")))
    for k in range(len(yaw_rate)):
        tick = ffi.new(
            "oc_angle_tick *",
            {
                "yaw_rate": yaw_rate[k],
                "speed": speed[k],
                "lateral_acceleration": acceleration[k],
                "true_by_sensor": 0.0 if np.isnan(sensor[k]) else sensor[k],
                "has_sensor": not np.isnan(sensor[k]),
                "can_learn": not np.isnan(sensor[k]),
                "has_motion": not np.isnan(yaw_rate[k]),
            },
        )
        lib.oc_angle_filter(tracking, design, tick)
        lib.oc_angle_update(tracking, evidence, design, given, tick, out)
        found[k] = tuple(getattr(out, name) for name in found.dtype.names)
    return found


def bends(seconds: float, speed: float, backlash: float = 0.0) -> tuple[Array, Array, Array, Array]:
    """Slow bends both ways: yaw rate, speed, lateral acceleration and the matching steering wheel angle."""
    t = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    r = 0.8 / speed * np.sin(2.0 * np.pi * t / 20.0)
    a = r * speed
    angle = RATIO * (WHEELBASE * r / speed + K_US * a) + 0.5 * backlash * np.sign(a)
    return r, np.full_like(t, speed), a, angle


def test_steady_bends_give_the_angle_including_the_play() -> None:
    for backlash in (0.0, 8.0 * DEGREE):
        r, v, a, angle = bends(40.0, 20.0, backlash)
        found = observe(r, v, a, np.full_like(r, np.nan), backlash=backlash)
        clear = np.abs(a) > 0.3
        assert np.abs(found["angle"] - angle)[clear][200:].max() < 1.0 * DEGREE


def weave(frequency_hz: float, inertia_s: float = 1.0) -> tuple[Array, Array, Array, Array]:
    """As `bends`, by sines of about 15 deg at 20 m/s; `inertia_s` of steering wheel angle per yaw acceleration."""
    t = np.arange(int(30.0 * RATE_HZ)) / RATE_HZ
    r, v = 2.5 * DEGREE * np.sin(2.0 * np.pi * frequency_hz * t), np.full_like(t, 20.0)
    angle = RATIO * (WHEELBASE * r / v + K_US * r * v) + inertia_s * np.gradient(r) * RATE_HZ
    return r, v, r * v, angle


def lag_s(found: Array, true: Array, frequency_hz: float) -> float:
    turn = np.exp(-2j * np.pi * frequency_hz * np.arange(len(true)) / RATE_HZ)
    return float(np.angle(np.sum(true * turn) / np.sum(found * turn)) / (2.0 * np.pi * frequency_hz))


@pytest.mark.parametrize("frequency_hz", [0.3, 0.5])
def test_the_estimate_of_a_weave_is_on_time(frequency_hz: float) -> None:
    r, v, a, angle = weave(frequency_hz)
    found = observe(r, v, a, np.full_like(r, np.nan))[1000:]
    assert abs(lag_s(found["angle"], angle[1000:], frequency_hz)) < 0.02
    assert found["delay"].max() < 0.04


def test_slow_steering_within_the_gyro_noise_is_late_and_says_so() -> None:
    """0.45 deg/s^2 of noise in the yaw acceleration; sines with 8 deg/s^2 and with 0.16."""
    noise = {"yaw_rate_noise": (0.01 * DEGREE) ** 2}
    for frequency_hz, late in ((0.5, False), (0.01, True)):
        r, v, a, angle = weave(frequency_hz)
        found = observe(r, v, a, np.full_like(r, np.nan), **noise)[1000:]
        assert (found["delay"].mean() > 0.1) == late
        if not late:
            assert abs(lag_s(found["angle"], angle[1000:], frequency_hz)) < 0.05
    sensor = observe(r, v, a, angle, **noise)
    assert np.all(sensor["delay"] == 0.0)


def test_the_interval_contains_the_lag_of_a_truck_that_turns_more_slowly() -> None:
    r, v, a, angle = weave(0.5, inertia_s=1.8)
    found = observe(r, v, a, np.full_like(r, np.nan))
    error = np.abs(found["angle"] - angle)
    assert error[50:].max() > 3.0 * DEGREE
    assert np.mean(error[50:200] < 1.96 * found["standard_deviation"][50:200]) > 0.95  # in the first sine
    assert np.mean(error[200:] < 1.96 * found["standard_deviation"][200:]) > 0.95


def test_a_driver_who_has_just_steered_may_steer_again() -> None:
    r, v, a, _ = weave(0.5)
    rested = np.zeros_like(r)
    r[2000:], a[2000:] = 0.0, 0.0
    active, calm = (observe(rate, v, rate * v, np.full_like(r, np.nan))["standard_deviation"] for rate in (r, rested))
    assert active[2300] > 2.0 * calm[2300]  # 3 s later, when the yaw acceleration is forgotten


def test_without_any_sensor_the_angle_is_ackermanns_with_a_wide_interval() -> None:
    """4.2."""
    r, v, a, angle = bends(40.0, 20.0)
    found = observe(r, v, a, np.full_like(r, np.nan), identified=False)
    assert set(found["status"]) == {_core.STATUSES.index("unobservable")}
    ackermann = RATIO * WHEELBASE * r / v
    assert np.sqrt(np.mean((found["angle"] - ackermann)[500:] ** 2)) < 1.0 * DEGREE
    assert np.all(np.abs(found["angle"] - angle)[500:] < 1.96 * found["standard_deviation"][500:])


def test_before_learning_the_interval_of_the_measured_angle_includes_the_offset() -> None:
    r, v, a, angle = bends(20.0, 20.0)
    found = observe(r, v, a, angle, identified=False)
    assert found["standard_deviation"][500:] == pytest.approx(5.0 * DEGREE, rel=1e-3)


def test_the_angle_does_not_jump_when_the_sensor_is_lost() -> None:
    r, v, a, angle = bends(60.0, 20.0)
    sensor = angle + 3.0 * DEGREE
    sensor[3500:] = np.nan
    found = observe(r, v, a, sensor)
    assert np.abs(np.diff(found["angle"])).max() < 0.5 * DEGREE
    assert found["angle"][3400] == pytest.approx(sensor[3400], abs=1e-9)
    assert found["angle"][4200] == pytest.approx(angle[4200], abs=1.0 * DEGREE)


def test_at_standstill_the_angle_is_held_and_its_interval_widens() -> None:
    r, v, a, _ = bends(20.0, 10.0)
    r[1000:], v[1000:], a[1000:] = 0.0, 0.0, 0.0
    found = observe(r, v, a, np.full_like(r, np.nan))
    assert found["standard_deviation"][-1] > 1.0
    assert _core.STATUSES[found["status"][-1]] == "unobservable"
    assert np.ptp(found["angle"][1100:]) == pytest.approx(0.0, abs=1e-9)


def test_the_interval_includes_the_errors_of_the_learned_truck() -> None:
    """An uncertain offset, and bends that need another angle after a change of load."""
    r, v, a, _ = bends(20.0, 20.0)
    sure, unsure, steep = (
        observe(r, v, a, np.full_like(r, np.nan), **members)["standard_deviation"]
        for members in ({}, {"offset_sd": 0.1}, {"gradient_sd": 0.005})
    )
    assert np.all(unsure[100:] > 0.1) and np.all(unsure[100:] > sure[100:])
    bend = np.abs(a) > 0.5
    assert np.all(steep[bend] ** 2 > sure[bend] ** 2 + 0.9 * (RATIO * 0.4 * 0.005) ** 2)


def test_a_flank_is_uncertain_where_the_neutral_acceleration_is_uncertain() -> None:
    """Lateral force of 0.3 m/s^2 with friction of 0.1: a certain flank, unless a_0 has an sd of as much."""
    v, a = np.full(2000, 20.0), np.full(2000, 0.4)
    sure, unsure = (
        observe(a / v, v, a, np.full_like(a, np.nan), backlash=15.0 * DEGREE, unloading_sd=sd)["standard_deviation"][-1]
        for sd in (0.02, 0.4)
    )
    assert unsure > 3.0 * sure


def test_the_flattening_at_large_angles_is_learned() -> None:
    """The arctangent of (7) and a progressive linkage; learned from circles at 5 m/s."""
    t = np.arange(12_000) / RATE_HZ
    front = 0.3 * np.sin(2.0 * np.pi * t / 40.0)
    speed = np.full_like(t, 5.0)
    r = speed / WHEELBASE * np.tan(front)
    a = r * speed
    angle = RATIO * (front - 0.5 * front**3 + K_US * a) + 0.7 * np.gradient(r) * RATE_HZ  # 0.7 s of yaw inertia
    sensor = np.where(t < 60.0, angle, np.nan)
    untaught, taught = (observe(r, speed, a, column) for column in (np.full_like(t, np.nan), sensor))
    judged = (t > 70.0) & (np.abs(angle) > 200.0 * DEGREE)
    share, before = (np.abs(found["angle"][judged] / angle[judged] - 1.0).max() for found in (taught, untaught))
    assert before > 0.06
    assert share < 0.01
    assert np.all(np.abs(untaught["angle"] - angle)[judged] < 1.96 * untaught["standard_deviation"][judged])
    assert taught["standard_deviation"][judged].max() < 0.5 * untaught["standard_deviation"][judged].max()


def test_missing_motion_gives_finite_numbers() -> None:
    r, v, a, _ = bends(20.0, 15.0)
    r[700:720] = v[700:720] = a[700:720] = np.nan
    found = observe(r, v, a, np.full_like(r, np.nan))
    assert np.all(np.isfinite(found["angle"])) and np.all(np.isfinite(found["standard_deviation"]))


def test_reversing_with_a_signed_speed_keeps_the_sign_of_the_angle() -> None:
    forward = bends(20.0, 3.0)
    r, v, a, angle = forward
    found = observe(-r, -v, a, np.full_like(r, np.nan))
    assert np.corrcoef(found["angle"][300:], angle[300:])[0, 1] > 0.98
