"""What the bus says of stability control, ABS, reverse gear, a steering assistance and a lifted axle."""

import numpy as np
import polars as pl
import pytest
from random_drives import RATIO, WHEELBASE, Array, drive
from saved_ecu import Ecu, legs
from test_core_reach import ACCELERATION, ANGLE, SPEED, YAW_RATE, core_of, steady
from test_core_sensor_fault import judged

import oncenter as oc
from oncenter import _core
from oncenter._native import ffi, lib
from oncenter.findings import Finding
from oncenter.plausibility import check
from oncenter.plausibility.grid_signals import GridSignals
from oncenter.plausibility.reversing import reversing
from oncenter.signals import DEGREE, SIGNALS, STATUSES, Signals, Source

RATE_HZ = 100.0
Columns = dict[str, Array]


def outputs_of(columns: Columns, core: _core.Core | None = None) -> np.ndarray:
    outputs = np.zeros(len(columns["time_s"]), _core.OUTPUT_DTYPE)
    (core or core_of()).run(columns, outputs)
    return outputs


def has(outputs: np.ndarray, reason: str) -> np.ndarray:
    return np.asarray((outputs["reasons"] & _core.REASONS[reason]) != 0)


def during(begin_s: float, end_s: float, count: int = 6000) -> Array:
    t = np.arange(count) / RATE_HZ
    return ((t >= begin_s) & (t < end_s)).astype(float)


def in_a_yard(begin_s: float = 110.0, end_s: float = 250.0, backward_m_s: float = 6.0) -> tuple[Columns, Array]:
    """Six minutes in bends, part of them backward, with speeds as most buses have them: without sign."""
    random, t = np.random.default_rng(1), np.arange(36_000) / RATE_HZ
    knots = np.arange(0.0, 368.0, 4.0)
    bends = np.interp(t, knots, random.normal(0.0, 0.02, len(knots)) * (random.random(len(knots)) < 0.6))
    curvature = np.convolve(bends, np.full(60, 1.0 / 60.0), "same")
    turns = [begin_s, begin_s + 10.0, begin_s + 20.0, end_s - 20.0, end_s - 10.0, end_s]
    v = np.interp(t, turns, [7.0, 0.0, -backward_m_s, -backward_m_s, 0.0, 7.0])
    yaw_rate = v * curvature
    columns = {
        "time_s": t,
        ANGLE: RATIO * WHEELBASE * curvature + 2.0 * DEGREE + 5e-4 * random.standard_normal(len(t)),
        YAW_RATE: yaw_rate + 5e-4 * random.standard_normal(len(t)),
        SPEED: np.abs(v) * (1.0 + 1e-4 * random.standard_normal(len(t))),
        ACCELERATION: yaw_rate * v + 0.2 + 0.05 * random.standard_normal(len(t)),
    }
    for side, name in zip((-1.0, 1.0), ("left", "right"), strict=True):
        wheel = np.abs(v + side * 0.9 * yaw_rate)
        columns[f"wheel_speed_rear_{name}_m_s"] = wheel + 0.02 * random.standard_normal(len(t)) * (wheel > 0.1)
    return columns, (v < 0.0).astype(float)


@pytest.mark.parametrize("method", _core.METHODS)
def test_statuses_that_are_not_available_change_no_bit(method: str) -> None:
    columns = legs(1, 60.0)
    unknown = {status: np.full(len(columns["time_s"]), np.nan) for status in STATUSES}
    without, with_unknown = (np.zeros(len(columns["time_s"]), _core.OUTPUT_DTYPE) for _ in range(2))
    ends = [Ecu(method).run(columns, without).values(), Ecu(method).run(columns | unknown, with_unknown).values()]
    assert ends[0] == ends[1] and _core._values(without) == _core._values(with_unknown)


@pytest.mark.parametrize("status", STATUSES)
def test_a_status_that_is_neither_true_nor_false_is_unknown(status: str) -> None:
    columns = drive(1, RATE_HZ, 60.0)
    ends = [Ecu().run(columns | {status: np.full(6000, value)}).values() for value in (np.nan, 2.0, 3.0)]
    assert len(set(ends)) == 1


@pytest.mark.parametrize("status", ["stability_control_active", "anti_lock_active"])
def test_an_intervention_closes_the_gate_and_one_second_more(status: str) -> None:
    core = core_of()
    shut = has(outputs_of(steady(**{status: during(20.0, 22.0)}), core), "intervention")
    begin_s = np.argmax(shut) / RATE_HZ
    assert 20.2 < begin_s < 20.3 and np.array_equal(shut, during(begin_s, begin_s + 3.0) > 0.5)
    rejected = dict(zip(_core.REASONS, core.answer()["rejected"], strict=True))
    assert rejected["intervention"] == pytest.approx(3.0)


@pytest.mark.parametrize("status", STATUSES)
@pytest.mark.parametrize("is_true", [0.0, 1.0])
def test_a_status_with_wrong_messages_is_that_without_them(status: str, is_true: float) -> None:
    """Two of 100 ms in a row, a second later one, and single ticks."""
    columns, settled = legs(1, 60.0), np.full(6000, is_true)
    wrong = settled.copy()
    for begin, end in ((1000, 1020), (1120, 1130), *((k, k + 1) for k in range(2000, 6000, 50))):
        wrong[begin:end] = 1.0 - is_true
    ends = [Ecu().run(columns | {status: values}).evidence() for values in (settled, wrong)]
    assert _core._values(ends[0]) == _core._values(ends[1])


@pytest.mark.parametrize("status", ["stability_control_active", "anti_lock_active"])
def test_an_intervention_that_does_not_end_is_none(status: str) -> None:
    shut = has(outputs_of(steady(**{status: during(10.0, 60.0)})), "intervention")
    assert 30.0 < shut.sum() / RATE_HZ < 31.5 and not shut[-500:].any()


def test_the_angle_without_its_sensor_is_less_sure_while_brakes_turn_the_truck() -> None:
    columns = drive(1, RATE_HZ, 200.0)
    columns[ANGLE][10_000:] = np.nan
    braked = during(120.0, 122.0, len(columns["time_s"]))
    sd = [outputs_of(columns | more)["angle"]["standard_deviation"] for more in ({}, {"anti_lock_active": braked})]
    assert (sd[1][12_040:12_290] > 9.0 * DEGREE).all() and (sd[0][12_040:12_290] < 9.0 * DEGREE).all()
    assert np.array_equal(sd[0][:12_000], sd[1][:12_000])


def test_a_truck_that_backs_up_accuses_no_sensor() -> None:
    columns, backward = in_a_yard()
    accused = [outputs_of(columns | more)["signal_fault"] for more in ({}, {"reverse": backward})]
    assert accused[0].any() and not accused[1].any()


@pytest.mark.parametrize("has_status", [False, True])
def test_a_yard_in_which_a_truck_mostly_backs_up_reverses_a_sign_without_its_status_only(has_status: bool) -> None:
    columns, backward = in_a_yard(40.0, 350.0)
    columns |= {"reverse": backward} if has_status else {}
    sources = {name: Source("bus", RATE_HZ, 36_000, 0) for name, of in SIGNALS.items() if of.column in columns}
    truck = oc.Vehicle(wheelbase_m=WHEELBASE, steering_ratio=RATIO)
    found = check(Signals(columns, sources, RATE_HZ, "yard"), truck).findings
    assert bool(found) is not has_status


def test_a_truck_that_backs_up_slowly_accuses_no_sensor_though_the_bus_does_not_say_so() -> None:
    columns, backward = in_a_yard(backward_m_s=3.0)
    tight = np.where(backward > 0.5, 4.0, 1.0)  # as towards a dock
    wheels = {name: 3.0 + tight * (columns[name] - 3.0) for name in columns if "wheel_speed" in name}
    columns |= {ANGLE: tight * columns[ANGLE], YAW_RATE: tight * columns[YAW_RATE]} | wheels
    assert not outputs_of(columns)["signal_fault"].any()


def backing_up(columns: Columns) -> Finding | None:
    drive = GridSignals(oc.from_dataframe(pl.DataFrame(columns)), None)
    found: Finding | None = reversing(drive.seems_to_reverse, drive.step_s, drive.has("reverse"))
    return found


def test_a_truck_that_seems_to_back_up_is_said_with_its_time_unless_the_bus_says_so() -> None:
    columns, backward = in_a_yard(backward_m_s=3.0)
    columns |= {YAW_RATE: columns[YAW_RATE] * 2.0, ANGLE: columns[ANGLE] * 2.0}
    assert backing_up(columns | {"reverse": backward}) is None
    found = backing_up(columns)
    assert found is not None and found.value == pytest.approx(backward.sum() / RATE_HZ, abs=5.0)
    assert found.text.startswith(f"for {found.value:.0f} s, from 2.0 min on, the truck turns against its steering")
    never = backing_up(columns | {"reverse": 0.0 * backward})
    assert never is not None and "'reverse' does not say so: check its true_when" in never.text


def test_a_reversed_sign_is_no_backing_up() -> None:
    columns, _ = in_a_yard(backward_m_s=3.0)
    reversed_sign = columns | {YAW_RATE: -columns[YAW_RATE]}
    assert backing_up(reversed_sign) is None


def test_backing_up_is_a_reason_and_its_speed_is_negative_whether_the_bus_has_its_sign_or_not() -> None:
    columns, backward = in_a_yard()
    columns |= {"reverse": np.maximum(np.roll(backward, -60), np.roll(backward, -40))}  # settled within a stop
    signs = np.where(backward > 0.5, -1.0, 1.0)
    signed = {name: values * (signs if "speed" in name else 1.0) for name, values in columns.items()}
    by_size, by_sign = outputs_of(columns), outputs_of(signed)
    rolls = columns[SPEED] > 0.5
    assert np.array_equal(has(by_size, "reverse")[rolls], backward[rolls] > 0.5)
    assert by_size["vehicle_speed"].min() < -5.0
    assert _core._values(by_size) == _core._values(by_sign)


def test_the_angle_by_motion_has_its_side_in_reverse_if_the_bus_says_so() -> None:
    columns, backward = in_a_yard()
    rolls = (backward > 0.5) & (columns[SPEED] > 3.0)
    found = [outputs_of(columns | more)["angle"]["estimate"][rolls] for more in ({}, {"reverse": backward})]
    likeness = [np.corrcoef(columns[ANGLE][rolls], estimate)[0, 1] for estimate in found]
    assert likeness[0] < -0.5 and likeness[1] > 0.9
    error = columns[ANGLE][rolls] - 2.0 * DEGREE - found[1]
    assert np.sqrt(np.mean(error**2)) < 3.5 * DEGREE  # forward 2.4 deg


def test_a_status_of_reverse_at_the_speed_of_a_motorway_is_wrong_and_changes_no_bit() -> None:
    ends = [Ecu().run(steady(**more)).evidence() for more in ({}, {"reverse": 1.0})]
    assert _core._values(ends[0]) == _core._values(ends[1])


def test_the_place_in_the_play_is_unknown_after_a_steering_assistance() -> None:
    columns = drive(1, RATE_HZ, 100.0)
    assisted = during(50.0, 60.0, len(columns["time_s"]))
    ecu = Ecu().run(
        {name: values[:5900] for name, values in columns.items()} | {"steering_assist_active": assisted[:5900]}
    )
    assert ecu.evidence()["joint"]["lost"][0] == 1
    assert has(outputs_of(columns | {"steering_assist_active": assisted}), "steering_assist").sum() == 1000
    ends = [Ecu().run(columns | {"steering_assist_active": assisted}).evidence(), Ecu().run(columns).evidence()]
    assert ends[0]["joint"]["lost"][0] == 0
    assert ends[0]["joint"]["second"]["used_s"][0] < ends[1]["joint"]["second"]["used_s"][0] - 9.0


def test_a_wheel_that_rests_while_a_motor_steers_is_not_stuck() -> None:
    """Behind the lash of a column: the truck takes bends of 6 deg, the hand holds the wheel."""
    t = np.arange(6000) / RATE_HZ
    bends, still = 6.0 * DEGREE * np.sin(2.0 * np.pi * t / 9.0), np.zeros(6000)
    assert "stuck" in judged(still, bends)
    assert set(judged(still, bends, assisted=True)) == {"none"}


def test_a_learned_truck_is_less_sure_of_its_wheel_while_a_motor_steers() -> None:
    design, truck = (
        ffi.new("oc_angle_design *"),
        ffi.new("oc_angle_truck *", {"backlash": 8.0 * DEGREE, "creep": 1.0, "identified": 1}),
    )
    lib.oc_angle_setup(design, lib.OC_ANGLE_OBSERVER, ffi.new("oc_ratio *", {"ratio": RATIO}), WHEELBASE, RATE_HZ)
    sds = []
    for assisted in (False, True):
        tracking, evidence, out = (ffi.new(f"oc_angle{name} *") for name in ("_tracking", "_evidence", ""))
        tick = ffi.new("oc_angle_tick *", {"speed": 20.0, "yaw_rate": 0.02, "lateral_acceleration": 0.4})
        tick.has_motion, tick.assisted = True, assisted
        for _ in range(500):
            lib.oc_angle_filter(tracking, design, tick)
            lib.oc_angle_update(tracking, evidence, design, truck, tick, out)
        sds.append(out.estimate_sd)
    assert sds[1] ** 2 - sds[0] ** 2 == pytest.approx((4.0 * DEGREE) ** 2 * 0.7 * 2.0, rel=0.1)
