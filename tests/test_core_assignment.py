"""Whether each signal is what its name says: faults of a file, one at a time, in a healthy drive."""

from collections.abc import Callable

import numpy as np
import pytest
from random_drives import RATIO, WHEELBASE, Array
from test_core_reach import ACCELERATION, ANGLE, SPEED, YAW_RATE, core_of

from oncenter import _core
from oncenter.signals import DEGREE

RATE_HZ = 100.0
Columns = dict[str, Array]
REAR = ("wheel_speed_rear_left_m_s", "wheel_speed_rear_right_m_s")


def healthy(seed: int = 0, speed_m_s: float = 12.0, minutes: float = 6.0) -> Columns:
    """Bends to both sides, of a truck whose yaw rate lags the wheel by 0.2 s."""
    random = np.random.default_rng(seed)
    count = round(60.0 * minutes * RATE_HZ)
    t = np.arange(count) / RATE_HZ
    knots = np.arange(0.0, 60.0 * minutes + 8.0, 4.0)
    curvature = np.interp(
        t, knots, random.normal(0.0, 1.1 / speed_m_s**2, len(knots)) * (random.random(len(knots)) < 0.6)
    )
    curvature = np.convolve(curvature, np.full(60, 1.0 / 60.0), "same")
    speed = speed_m_s * (1.0 + 0.1 * np.sin(t / 17.0)) + 1e-3 * random.standard_normal(count)
    yaw_rate = speed * curvature
    ahead = np.concatenate([curvature[20:], np.zeros(20)])
    angle = RATIO * WHEELBASE * ahead * (1.0 + 0.002 * speed**2) + 2.0 * DEGREE
    columns = {
        "time_s": t,
        ANGLE: np.round((angle + 5e-4 * random.standard_normal(count)) * 1024.0) / 1024.0,
        YAW_RATE: np.round((yaw_rate + 5e-4 * random.standard_normal(count)) * 8192.0) / 8192.0,
        SPEED: speed,
        ACCELERATION: yaw_rate * speed + 0.2 + 0.05 * random.standard_normal(count),
    }
    for side, name in zip((-1.0, 1.0), REAR, strict=True):
        columns[name] = speed + side * 0.9 * yaw_rate + 0.02 * random.standard_normal(count)
    return columns


def judged(columns: Columns) -> tuple[str, set[str], str]:
    """The fault at the end, the signals that have it, and the status of the offset."""
    core = core_of()
    core.run(columns)
    answer = core.answer()
    signals = {name for name, bit in _core.SIGNAL_BITS.items() if answer["signals_at_fault"] & bit}
    return _core.SIGNAL_FAULTS[answer["signal_fault"]], signals, _core.status_of(answer["offset"])


def every_second(values: Array, number: float) -> Array:
    return np.where(np.arange(len(values)) % 2 == 0, values, number)


def at_random(values: Array, number: float) -> Array:
    return np.where(np.random.default_rng(1).random(len(values)) < 0.1, number, values)


def after_half(values: Array, number: float) -> Array:
    return np.where(np.arange(len(values)) < len(values) // 2, values, number)


def later(values: Array, s: float) -> Array:
    return np.roll(values, round(s * RATE_HZ))


def noise(values: Array) -> Array:
    return 0.4 * np.random.default_rng(2).standard_normal(len(values))


def torque(values: Array) -> Array:
    return 0.3 * np.sin(np.arange(len(values)) / 333.0)


FAULTS: list[tuple[str, str, str, Callable[[Array], Array]]] = [
    ("filled", "steering_wheel_angle", ANGLE, lambda x: every_second(x, 0.0)),
    ("filled", "steering_wheel_angle", ANGLE, lambda x: at_random(x, 0.0)),
    ("filled", "steering_wheel_angle", ANGLE, lambda x: at_random(x, 327.67 * DEGREE)),
    ("filled", "yaw_rate", YAW_RATE, lambda x: every_second(x, 0.0)),
    ("filled", "vehicle_speed", SPEED, lambda x: at_random(x, 0.0)),
    ("filled", "lateral_acceleration", ACCELERATION, lambda x: every_second(x, 0.0)),
    ("stuck", "steering_wheel_angle", ANGLE, lambda x: after_half(x, 0.1)),
    ("stuck", "yaw_rate", YAW_RATE, lambda x: after_half(x, 0.01)),
    ("stuck", "vehicle_speed", SPEED, lambda x: after_half(x, 12.3)),
    ("stuck", "lateral_acceleration", ACCELERATION, lambda x: after_half(x, 0.4)),
    ("clipped", "steering_wheel_angle", ANGLE, lambda x: np.clip(x, -0.3, 0.3)),
    ("noise", "yaw_rate", YAW_RATE, lambda x: noise(x)),
    ("jumps", "steering_wheel_angle", ANGLE, lambda x: np.mod(x, 2.0 * np.pi)),
    ("jumps", "steering_wheel_angle", ANGLE, lambda x: np.where(x < 0.0, x + 6553.6 * DEGREE, x)),
    ("magnitude", "steering_wheel_angle", ANGLE, lambda x: np.abs(x)),
    ("magnitude", "yaw_rate", YAW_RATE, lambda x: np.abs(x)),
    ("reversed", "steering_wheel_angle", ANGLE, lambda x: -x),
    ("reversed", "yaw_rate", YAW_RATE, lambda x: -x),
    ("reversed", "lateral_acceleration", ACCELERATION, lambda x: -x),
    ("scale", "steering_wheel_angle", ANGLE, lambda x: x / RATIO),
    ("scale", "yaw_rate", YAW_RATE, lambda x: 2.0 * x),
    ("scale", "vehicle_speed", SPEED, lambda x: x / 3.6),
    ("scale", "lateral_acceleration", ACCELERATION, lambda x: x / 9.81),
    ("late", "steering_wheel_angle", ANGLE, lambda x: later(x, 0.6)),
    ("late", "yaw_rate", YAW_RATE, lambda x: later(x, 0.6)),
    ("unrelated", "steering_wheel_angle", ANGLE, lambda x: torque(x)),
    ("unrelated", "lateral_acceleration", ACCELERATION, lambda x: torque(x)),
]


@pytest.mark.parametrize(("fault", "signal", "column", "spoil"), FAULTS, ids=[f"{f}-{s}" for f, s, *_ in FAULTS])
def test_a_fault_of_one_signal_is_named_and_nothing_is_valid(
    fault: str, signal: str, column: str, spoil: Callable[[Array], Array]
) -> None:
    columns = healthy()
    assert judged(columns | {column: spoil(columns[column])}) == (fault, {signal}, "invalid")


def found() -> set[int]:
    """The faults of these, by number."""
    columns = healthy()
    names = {judged(columns | {column: spoil(columns[column])})[0] for _, _, column, spoil in FAULTS}
    return {_core.SIGNAL_FAULTS.index(name) for name in {*names, judged(columns)[0]}}


@pytest.mark.parametrize("speed_m_s", [4.0, 12.0, 24.0])
def test_a_healthy_drive_has_none(speed_m_s: float) -> None:
    for seed in range(3):
        fault, signals, status = judged(healthy(seed, speed_m_s))
        assert (fault, signals) == ("none", set()) and status != "invalid"


def test_without_a_third_signal_two_that_contradict_each_other_are_both_named() -> None:
    columns = healthy()
    bare = {name: column for name, column in columns.items() if name in ("time_s", ANGLE, YAW_RATE, SPEED)}
    core = _core.Core(WHEELBASE, RATIO, {"use_accelerometer": 0.0}, RATE_HZ, method="joint")
    core.run(bare | {YAW_RATE: -bare[YAW_RATE]})
    answer = core.answer()
    assert _core.SIGNAL_FAULTS[answer["signal_fault"]] == "reversed"
    assert answer["signals_at_fault"] == _core.SIGNAL_BITS["steering_wheel_angle"] | _core.SIGNAL_BITS["yaw_rate"]


def test_a_fault_of_another_signal_accuses_no_angle_sensor() -> None:
    """The sensor check compares the angle with the motion, which is wrong then."""
    columns = healthy(minutes=12.0)
    half = len(columns["time_s"]) // 2
    columns[YAW_RATE][half:] *= -1.0
    core = core_of()
    core.run(columns)
    answer = core.answer()
    assert answer["signals_at_fault"] == _core.SIGNAL_BITS["yaw_rate"] and _core.FAULTS[answer["fault"]] == "none"


def test_a_new_ignition_judges_the_signals_anew() -> None:
    columns = healthy()
    core = core_of()
    core.run(columns | {ANGLE: -columns[ANGLE]})
    assert core.answer()["signals_at_fault"]
    core.restart()
    core.run(columns)
    assert not core.answer()["signals_at_fault"]


def test_an_angle_of_a_whole_turn_more_is_no_fault_of_its_size() -> None:
    columns = healthy()
    assert judged(columns | {ANGLE: columns[ANGLE] + 2.0 * np.pi})[0] == "none"


def test_fast_steering_in_a_yard_is_no_jump() -> None:
    t = np.arange(30_000) / RATE_HZ
    angle = 6.0 * np.sin(t / 2.5)  # up to 140 deg/s
    yaw_rate = angle * 3.0 / (RATIO * WHEELBASE)
    columns = {"time_s": t, ANGLE: angle, YAW_RATE: yaw_rate, SPEED: np.full(30_000, 3.0) + 1e-3 * np.sin(t * 9.0)}
    assert judged(columns | {ACCELERATION: 3.0 * yaw_rate})[0] == "none"


def test_wheels_that_cross_their_play_within_a_second_are_no_noise() -> None:
    columns = healthy(speed_m_s=22.0)
    t = columns["time_s"]
    crossing = np.where((t > 100.0) & (t < 240.0), 7.5 * DEGREE * np.sign(np.sin(2.0 * np.pi * t / 1.1)), 0.0)
    straight = np.where((t > 90.0) & (t < 250.0), 0.02, 1.0)
    bends = {name: columns[name] * straight for name in (ANGLE, YAW_RATE)}
    bends[ACCELERATION] = (columns[ACCELERATION] - 0.2) * straight + 0.2
    for name in REAR:
        bends[name] = columns[SPEED] + (columns[name] - columns[SPEED]) * straight
    assert judged(columns | bends | {ANGLE: bends[ANGLE] + crossing})[0] == "none"
