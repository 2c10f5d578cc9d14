"""Chapter 4: front wheel angles, the ratio both ways, the observer on motion whose steering is known, the judge."""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pytest
from oncenter._native import ffi, lib

from oncenter import _core

WHEELBASE, TRACK, RATIO = 3.7, 2.05, 19.3
RATE_HZ = 100.0
K_US = math.radians(0.4)  # rad/(m/s^2)
DEG = math.pi / 180.0
Array = npt.NDArray[np.float64]


def front_wheels(angle: float) -> tuple[float, float]:
    """Speeds of left and right front wheel that roll about a point on the rear axle's line, at 1 m/s of its middle."""
    rate = math.tan(angle) / WHEELBASE
    return tuple(math.hypot(1.0 - side * 0.5 * TRACK * rate, WHEELBASE * rate) for side in (1.0, -1.0))  # type: ignore[return-value]


@pytest.mark.parametrize("degrees", [-40.0, -10.0, -0.5, 0.0, 2.0, 25.0, 40.0])
def test_the_exact_formula_is_right_where_the_approximate_one_is_not(degrees: float) -> None:
    """(2), there and back; (3) is some 10 % off at 40 deg."""
    angle = degrees * DEG
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


def test_side_slip_and_steady_state_agree_on_the_front_wheels() -> None:
    """(23) with (24) against (22): the same truck in the same bend, its slip angles from its stiffness."""
    v, r, front_m, mass, front_n, rear_n = 15.0, 0.08, 1.3, 9000.0, 4.0e5, 3.5e5
    rear_m, a = WHEELBASE - front_m, v * r
    front_slip, rear_slip = -mass * a * rear_m / WHEELBASE / front_n, -mass * a * front_m / WHEELBASE / rear_n
    lateral = rear_slip * v + rear_m * r  # of the centre of gravity
    gradient = mass / WHEELBASE * (rear_m / front_n - front_m / rear_n)
    by_slip = lib.oc_front_wheel_by_side_slip(v, lateral, r, front_m, front_slip)
    assert by_slip == pytest.approx(lib.oc_front_wheel_by_yaw_rate(WHEELBASE, r, v, gradient, a), abs=1e-5)


def test_the_front_tyres_slip_is_learned_and_taken_away() -> None:
    """(23): a receiver turned by 0.5 deg, 1.3 m behind the front axle, on tyres that slip 0.4 deg per m/s^2."""
    turned, behind, slip, v = 0.5 * DEG, 1.3, 0.4 * DEG, 20.0
    evidence = ffi.new("oc_side_slip_evidence *")
    ticks = []
    for k in range(6000):
        r, a = 0.05 * math.sin(0.003 * k), math.sin(0.004 * k)  # by themselves, as bank and bends do
        front = 0.02 * math.sin(0.001 * k)
        v_y = v * (math.tan(front - turned - slip * a) - behind * r / v)
        tick = {"speed": v, "lateral_speed": v_y, "yaw_rate": r, "lateral_acceleration": a}
        ticks.append((ffi.new("oc_side_slip *", tick), front))
    for tick, front in ticks:
        lib.oc_side_slip_learn(evidence, tick, front, 1.0 / RATE_HZ, 600.0)
    found = [lib.oc_side_slip_front_wheel(evidence, tick, WHEELBASE) for tick, _ in ticks[::100]]
    assert found == pytest.approx([front for _, front in ticks[::100]], abs=0.1 * DEG)


@pytest.mark.parametrize("terms", [[], [0.0, 0.0518, 0.0, -0.0003], [0.001, 0.05, 1e-4, -2e-4, 1e-6]])
def test_the_ratio_goes_there_and_back(terms: list[float]) -> None:
    near_centre = 1.0 / terms[1] if terms else RATIO
    ratio = ffi.new("oc_ratio *", {"terms": len(terms), "coefficients": terms, "ratio": near_centre})
    for angle in np.linspace(-6.0, 6.0, 25):
        front = lib.oc_ratio_to_front_wheel(ratio, angle)
        assert lib.oc_ratio_to_steering_wheel(ratio, front) == pytest.approx(angle, abs=1e-7)


def truck(**members: float) -> dict[str, float]:
    known = {"known": True, "offset_sd": 0.005, "gradient": K_US, "gradient_sd": 0.0003, "creep": 1.7, "friction": 0.1}
    return known | members


def observe(
    yaw_rate: Array, speed: Array, acceleration: Array, sensor: Array, **members: float
) -> npt.NDArray[np.void]:
    """The observer over columns, NaN where there is no sensor; T of one second learned beforehand."""
    design = ffi.new("oc_angle_design *")
    lib.oc_angle_setup(design, lib.OC_ANGLE_OBSERVER, ffi.new("oc_ratio *", {"ratio": RATIO}), WHEELBASE, RATE_HZ)
    tracking, evidence = ffi.new("oc_angle_tracking *"), ffi.new("oc_angle_evidence *")
    given, out = ffi.new("oc_angle_truck *", truck(**members)), ffi.new("oc_angle *")
    found = np.zeros(len(yaw_rate), _core.dtype_of(ffi.typeof("oc_angle")))
    for k in range(len(yaw_rate)):
        tick = ffi.new(
            "oc_angle_tick *",
            {
                "tick_s": 1.0 / RATE_HZ,
                "yaw_rate": yaw_rate[k],
                "speed": speed[k],
                "lateral_acceleration": acceleration[k],
                "true_by_sensor": 0.0 if np.isnan(sensor[k]) else sensor[k],
                "has_sensor": not np.isnan(sensor[k]),
                "teaches": not np.isnan(sensor[k]),
                "has_motion": not np.isnan(yaw_rate[k]),
            },
        )
        lib.oc_angle_update(tracking, evidence, design, given, tick, out)
        found[k] = tuple(getattr(out, name) for name in found.dtype.names)
    return found


def bends(seconds: float, speed: float, backlash: float = 0.0) -> tuple[Array, Array, Array, Array]:
    """Slow bends both ways: yaw rate, speed, lateral acceleration and the steering wheel angle that goes with them."""
    t = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    r = 0.8 / speed * np.sin(2.0 * np.pi * t / 20.0)
    a = r * speed
    angle = RATIO * (WHEELBASE * r / speed + K_US * a) + 0.5 * backlash * np.sign(a)
    return r, np.full_like(t, speed), a, angle


def test_steady_bends_give_the_angle_with_its_play() -> None:
    for backlash in (0.0, 8.0 * DEG):
        r, v, a, angle = bends(40.0, 20.0, backlash)
        found = observe(r, v, a, np.full_like(r, np.nan), backlash=backlash)
        clear = np.abs(a) > 0.3
        assert np.abs(found["angle"] - angle)[clear][200:].max() < 1.0 * DEG


def test_without_a_sensor_ever_only_the_ackermann_angle_is_told_and_the_interval_says_so() -> None:
    """4.2."""
    r, v, a, angle = bends(40.0, 20.0)
    found = observe(r, v, a, np.full_like(r, np.nan), known=False)
    assert set(found["status"]) == {_core.STATUSES.index("unobservable")}
    ackermann = RATIO * WHEELBASE * r / v
    assert np.sqrt(np.mean((found["angle"] - ackermann)[500:] ** 2)) < 1.0 * DEG
    assert np.all(np.abs(found["angle"] - angle)[500:] < 1.96 * found["standard_deviation"][500:])


def test_an_offset_that_is_not_learned_yet_is_in_the_interval_of_what_the_sensor_says() -> None:
    r, v, a, angle = bends(20.0, 20.0)
    found = observe(r, v, a, angle, known=False)
    assert found["standard_deviation"][500:] == pytest.approx(5.0 * DEG, rel=1e-3)


def test_the_estimate_takes_over_without_a_jump() -> None:
    r, v, a, angle = bends(60.0, 20.0)
    sensor = angle + 3.0 * DEG
    sensor[3500:] = np.nan
    found = observe(r, v, a, sensor)
    assert np.abs(np.diff(found["angle"])).max() < 0.5 * DEG
    assert found["angle"][3400] == pytest.approx(sensor[3400], abs=1e-9)
    assert found["angle"][4200] == pytest.approx(angle[4200], abs=1.0 * DEG)


def test_at_a_standstill_the_angle_is_held_and_its_interval_opens() -> None:
    r, v, a, _ = bends(20.0, 10.0)
    r[1000:], v[1000:], a[1000:] = 0.0, 0.0, 0.0
    found = observe(r, v, a, np.full_like(r, np.nan))
    assert found["standard_deviation"][-1] > 1.0
    assert _core.STATUSES[found["status"][-1]] == "unobservable"
    assert np.ptp(found["angle"][1100:]) == pytest.approx(0.0, abs=1e-9)


def test_the_interval_has_what_no_sensor_could_have_said() -> None:
    """An offset that was not well known, and bends that take another angle with another load."""
    r, v, a, _ = bends(20.0, 20.0)
    sure, unsure, steep = (
        observe(r, v, a, np.full_like(r, np.nan), **members)["standard_deviation"]
        for members in ({}, {"offset_sd": 0.1}, {"gradient_sd": 0.005})
    )
    assert np.all(unsure[100:] > 0.1) and np.all(unsure[100:] > sure[100:])
    bend = np.abs(a) > 0.5
    assert np.all(steep[bend] ** 2 > sure[bend] ** 2 + 0.9 * (RATIO * 0.4 * 0.005) ** 2)


def test_a_flank_is_in_doubt_where_the_unloading_point_is() -> None:
    """Side force of 0.3 m/s^2 beyond friction 0.1: a flank for sure, unless a_0 may be off by as much."""
    v, a = np.full(2000, 20.0), np.full(2000, 0.4)
    sure, unsure = (
        observe(a / v, v, a, np.full_like(a, np.nan), backlash=15.0 * DEG, unloading_sd=sd)["standard_deviation"][-1]
        for sd in (0.02, 0.4)
    )
    assert unsure > 3.0 * sure


def test_large_angles_are_learned_where_proportion_ends() -> None:
    """The arctangent of (7) with a linkage that turns the wheels faster at its ends; learned from circles at 5 m/s."""
    t = np.arange(12_000) / RATE_HZ
    front = 0.3 * np.sin(2.0 * np.pi * t / 40.0)
    speed = np.full_like(t, 5.0)
    r = speed / WHEELBASE * np.tan(front)
    a = r * speed
    angle = RATIO * (front - 0.5 * front**3 + K_US * a)
    sensor = np.where(t < 60.0, angle, np.nan)
    untaught, taught = (observe(r, speed, a, column) for column in (np.full_like(t, np.nan), sensor))
    judged = (t > 70.0) & (np.abs(angle) > 200.0 * DEG)
    share, before = (np.abs(found["angle"][judged] / angle[judged] - 1.0).max() for found in (taught, untaught))
    assert before > 0.06
    assert share < 0.01
    assert np.all(np.abs(untaught["angle"] - angle)[judged] < 1.96 * untaught["standard_deviation"][judged])
    assert taught["standard_deviation"][judged].max() < 0.5 * untaught["standard_deviation"][judged].max()


def test_motion_that_is_missing_for_a_while_leaves_numbers() -> None:
    r, v, a, _ = bends(20.0, 15.0)
    r[700:720] = v[700:720] = a[700:720] = np.nan
    found = observe(r, v, a, np.full_like(r, np.nan))
    assert np.all(np.isfinite(found["angle"])) and np.all(np.isfinite(found["standard_deviation"]))


def test_reversing_with_a_signed_speed_keeps_the_sign_of_the_angle() -> None:
    forward = bends(20.0, 3.0)
    r, v, a, angle = forward
    found = observe(-r, -v, a, np.full_like(r, np.nan))
    assert np.corrcoef(found["angle"][300:], angle[300:])[0, 1] > 0.98


def judged(
    measured: Array,
    estimate: Array,
    sd: float = 1.0 * DEG,
    offset: float = 0.0,
    offset_sd: Array | None = None,
    hidden: float = 0.0,
    speed: Array | None = None,
    holes: Sequence[int] = (),
    before: str = "none",
) -> list[str]:
    """The sensor's fault at each tick; what is not known of the offset is a part of the sd, `sd` the rest of it.

    At 15 m/s where no speed is given; a hole before each tick of `holes`; `before` is the fault before this ignition.
    """
    unsure = np.zeros(len(estimate)) if offset_sd is None else offset_sd
    speed = np.full(len(estimate), 15.0) if speed is None else speed
    watch, kept = ffi.new("oc_fault_watch *"), ffi.new("oc_fault_evidence *", {"fault": _core.FAULTS.index(before)})
    names = []
    for k in range(len(estimate)):
        tick = ffi.new(
            "oc_fault_tick *",
            {
                "time": k / RATE_HZ,
                "tick_s": 1.0 / RATE_HZ,
                "measured": 0.0 if np.isnan(measured[k]) else measured[k],
                "offset": offset,
                "offset_sd": unsure[k],
                "estimate": estimate[k],
                "sd": np.hypot(sd, unsure[k]),
                "hidden": hidden,
                "speed": speed[k],
                "has_measured": not np.isnan(measured[k]),
                "after_hole": k in holes,
                "can_judge": True,
            },
        )
        names.append(ffi.string(lib.oc_fault_name(lib.oc_fault_update(watch, kept, tick))).decode())
    return names


def weaving() -> Array:
    t = np.arange(12_000) / RATE_HZ
    return 25.0 * DEG * np.sin(2.0 * np.pi * t / 11.0)


def test_a_healthy_sensor_is_left_alone_whatever_its_offset() -> None:
    true = weaving()
    noisy = true + np.random.default_rng(1).normal(0.0, 1.5 * DEG, len(true))
    assert set(judged(true + 7.0 * DEG, noisy, offset=7.0 * DEG)) == {"none"}


@pytest.mark.parametrize(
    ("name", "within_s"),
    [("lost", 0.2), ("stuck", 6.0), ("jumped", 3.0), ("drifting", 60.0), ("wrong_sign", 12.0), ("remounted", 8.0)],
)
def test_a_fault_is_found_and_called_by_its_name(name: str, within_s: float) -> None:
    true, at = weaving(), 4000
    after = np.arange(len(true)) >= at
    spoiled = {
        "lost": np.where(after, np.nan, true),
        "stuck": np.where(after, true[at], true),
        "jumped": true + np.where(after, 30.0 * DEG, 0.0),
        "drifting": true + np.maximum(np.arange(len(true)) - at, 0) / RATE_HZ * 0.4 * DEG,
        "wrong_sign": np.where(after, -true, true),
        "remounted": np.where(
            after & (np.arange(len(true)) < at + 300), np.nan, true + np.where(after, -25.0 * DEG, 0.0)
        ),
    }[name]
    names = judged(spoiled, true)
    assert set(names[:at]) == {"none"}
    told = names[at + round(within_s * RATE_HZ)]
    assert told == name
    assert names[-1] == name


def test_a_drift_that_play_hides_now_and_then_is_found_by_its_mean() -> None:
    """Never beyond the limit of 10 deg, and half of the time well within it; as far to both sides there is nothing."""
    true = weaving()
    off = np.where(np.arange(len(true)) // 100 % 2, 9.5 * DEG, 4.5 * DEG)
    names = judged(true + off, true)
    assert set(names[:2000]) == {"none"} and names[5000] == "drifting"
    assert set(judged(true + off - 7.0 * DEG, true)) == {"none"}


def test_a_drift_is_told_though_learning_follows_it_and_knows_less_and_less() -> None:
    true, at = weaving(), 2000
    drift = 0.2 * DEG * np.maximum(np.arange(len(true)) - at, 0) / RATE_HZ
    names = judged(true + drift, true, offset_sd=0.5 * DEG + 0.3 * drift)
    assert set(names[: at + 4000]) == {"none"} and names[at + 6000] == "drifting"
    # one that was not known so well before is within its limits
    assert set(judged(true + drift, true, offset_sd=np.full(len(true), 7.0 * DEG))) == {"none"}


def test_on_a_flank_that_was_hardly_seen_there_may_be_more_play() -> None:
    true = weaving()
    off = np.where(np.arange(len(true)) % 4000 > 3000, 11.0 * DEG, 0.0)
    assert set(judged(true + off, true, hidden=1.0)) == {"none"}
    assert "none" not in judged(true + off, true)[3600:4000]


def test_a_fault_that_is_over_is_forgotten_late() -> None:
    true = weaving()
    spoiled = true.copy()
    spoiled[2000:3000] += 30.0 * DEG
    names = judged(spoiled, true)
    assert names[2900] == "jumped" and names[3500] == "jumped" and names[-1] == "none"


def test_bends_of_a_few_degrees_show_that_left_is_right() -> None:
    """Never 10 deg off, but the other way round."""
    true = 0.16 * weaving()
    after = np.arange(len(true)) >= 4000
    names = judged(np.where(after, -true, true), true + np.random.default_rng(2).normal(0.0, 1.0 * DEG, len(true)))
    assert set(names[:4000]) == {"none"}
    assert names[-1] == "wrong_sign"


def test_a_wrong_sign_is_not_forgiven_on_a_straight() -> None:
    true = weaving()
    true[6000:] = np.random.default_rng(3).normal(0.0, 0.3 * DEG, 6000)  # a hand that is never still
    names = judged(np.where(np.arange(len(true)) >= 2000, -true, true), true)
    assert set(names[5900:]) == {"wrong_sign"}


@pytest.mark.parametrize("parked_deg", [-600.0, -100.0, 100.0])
def test_a_wheel_that_was_parked_turned_makes_no_wrong_sign_of_the_first_bend(parked_deg: float) -> None:
    true = weaving()
    true[:500] = parked_deg * DEG
    estimate, speed = np.where(np.arange(len(true)) < 500, 0.0, true), np.where(np.arange(len(true)) < 500, 0.0, 15.0)
    assert set(judged(true, estimate, speed=speed)) == {"none"}


def test_an_estimate_that_begins_anew_after_a_hole_makes_no_wrong_sign() -> None:
    true, holes = weaving(), range(500, 12_000, 500)
    estimate = true.copy()
    for k in holes:
        estimate[k : k + 30] *= np.linspace(-0.5, 1.0, 30)
    assert set(judged(true, estimate, holes=holes)) == {"none"}


@pytest.mark.parametrize("frozen", ["motion", "all"])
def test_what_follows_late_after_signals_that_stood_still_makes_no_wrong_sign(frozen: str) -> None:
    """Now the motion alone was not measured for some seconds, now a busy bus held every signal as a bend ended."""
    true = 0.3 * np.tile(weaving(), 3)
    begins, length = range(500, len(true) - 500, 1137), 300 if frozen == "motion" else 90
    for begin in begins:
        true[begin - 300 : begin + 45] += 60.0 * DEG * np.sin(np.linspace(0.0, 0.9 * np.pi, 345))
    measured, estimate, speed = true.copy(), true.copy(), np.full(len(true), 15.0)
    for begin in begins:
        still, late = slice(begin, begin + length), slice(begin + length, begin + length + 30)
        estimate[still] = true[begin]
        estimate[late] = np.linspace(true[begin], true[late.stop], 30)
        if frozen == "motion":
            speed[still] = 0.0
        else:
            measured[still] = true[begin]
    assert set(judged(measured, estimate, speed=speed)) == {"none"}


@pytest.mark.parametrize("missing", ["motion", "angle"])
def test_ticks_that_are_missing_one_by_one_hide_no_wrong_sign(missing: str) -> None:
    """A tick in 0.9 s, of a speed or of the angle, costs itself and not the second after it."""
    true = 0.3 * weaving()
    measured, speed = np.where(np.arange(len(true)) >= 4000, -true, true), np.full(len(true), 15.0)
    (speed if missing == "motion" else measured)[::90] = 0.0 if missing == "motion" else np.nan
    names = judged(measured, true + np.random.default_rng(2).normal(0.0, 1.0 * DEG, len(true)), speed=speed)
    assert set(names[:4000]) == {"none"}
    assert names[-1] == "wrong_sign"


def test_kerbs_and_a_stability_control_make_no_wrong_sign() -> None:
    """Each kicks the wheel by up to 40 deg and the truck as if by up to 30, both as they like."""
    random = np.random.default_rng(5)
    true = 0.3 * np.tile(weaving(), 5)
    measured, estimate = true.copy(), true + random.normal(0.0, 1.0 * DEG, len(true))
    for begin in range(500, len(true) - 200, 1000):
        kick = np.sin(np.linspace(0.0, np.pi, int(random.integers(20, 150)))) * DEG
        measured[begin : begin + len(kick)] += random.uniform(-40.0, 40.0) * kick
        estimate[begin : begin + len(kick)] += random.uniform(-30.0, 30.0) * kick
    assert set(judged(measured, estimate)) == {"none"}


def test_a_sensor_that_came_to_rest_after_a_drift_sits_elsewhere() -> None:
    t = np.arange(72_000) / RATE_HZ
    true = 25.0 * DEG * np.sin(2.0 * np.pi * t / 11.0) + np.random.default_rng(6).normal(0.0, 0.3 * DEG, len(t))
    for rate, end in [(0.4, "remounted"), (0.025, "drifting")]:  # deg/s; the second one never rests
        drift = np.minimum(rate * t, 24.0) * DEG
        names = judged(true + drift, true)
        assert names[-1] == end
        told = names.index("drifting")
        assert set(names[told : told + 29_000]) == {"drifting"}


def test_kerbs_and_bends_do_not_undo_that_a_sensor_has_come_to_rest() -> None:
    """A second in twenty is 8 deg further off, to either side; of one that is so every other second nothing rests."""
    t = np.arange(66_000) / RATE_HZ
    true = 25.0 * DEG * np.sin(2.0 * np.pi * t / 11.0) + np.random.default_rng(8).normal(0.0, 0.3 * DEG, len(t))
    drift = np.minimum(0.4 * t, 24.0) * DEG
    for period_s, end in [(20.0, "remounted"), (2.0, "drifting")]:
        kick = np.sin(np.pi * np.minimum(t % period_s, 1.0)) * np.where(t // period_s % 2.0 < 1.0, 1.0, -1.0)
        off = 8.0 * DEG * kick
        assert judged(true + drift + off, true)[-1] == end


def test_how_long_an_earlier_fault_rested_counts_for_no_later_one() -> None:
    t = np.arange(56_000) / RATE_HZ
    true = 25.0 * DEG * np.sin(2.0 * np.pi * t / 11.0) + np.random.default_rng(7).normal(0.0, 0.3 * DEG, len(t))
    drift = np.interp(t, [0.0, 60.0, 340.0, 345.0, 370.0, 500.0], [0.0, 8.0, 8.0, 4.5, 4.5, 26.0]) * DEG
    names = judged(true + drift, true)
    assert names[33_000] == "drifting" and names[37_000] == "none"
    assert "drifting" in names[40_000:] and "remounted" not in names


@pytest.mark.parametrize("before", ["stuck", "drifting", "wrong_sign"])
def test_a_sensor_that_was_replaced_is_another_one_mounted_elsewhere(before: str) -> None:
    true = np.tile(weaving(), 3)
    true += np.random.default_rng(4).normal(0.0, 0.3 * DEG, len(true))
    names = judged(true + 8.0 * DEG, true, before=before)
    assert names[0] == before and set(names[:29_000]) == {before} and names[-1] == "remounted"
    still_wrong = {"stuck": np.full(len(true), 0.3), "wrong_sign": -true}.get(before)
    if still_wrong is not None:
        assert "remounted" not in judged(still_wrong, true, before=before)


def test_no_hand_is_still_for_half_a_minute() -> None:
    names = judged(np.full(4000, 0.02), np.zeros(4000))
    assert names[2900] == "none" and names[3100] == "stuck"


def test_a_sensor_far_off_is_not_believed_before_it_has_a_fault() -> None:
    watch, kept = ffi.new("oc_fault_watch *"), ffi.new("oc_fault_evidence *")
    seen = []
    for k in range(3000):
        off = 12.0 * DEG if k >= 2000 else 0.0
        tick = {
            "time": k / RATE_HZ,
            "tick_s": 1.0 / RATE_HZ,
            "measured": off + 0.01 * (k % 7),
            "sd": DEG,
            "speed": 15.0,
        }
        fault = lib.oc_fault_update(
            watch, kept, ffi.new("oc_fault_tick *", tick | {"has_measured": True, "can_judge": True})
        )
        seen.append((fault, lib.oc_fault_beyond(watch), lib.oc_fault_suspected(watch)))
    assert seen[1990] == (lib.OC_FAULT_NONE, False, False)
    assert seen[2010] == (lib.OC_FAULT_NONE, True, True)
    assert seen[2400][:2] == (lib.OC_FAULT_JUMPED, True)
