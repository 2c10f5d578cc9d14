"""(7), (10), (31) in the core, and the ranges of a vehicle's values."""

import math

import pytest

from oncenter import _core
from oncenter._native import lib

L = 3.9  # m


def front_wheel(curvature: float, speed: float, gradient: float) -> float:
    """rad, in a steady state on a level road."""
    yaw_rate = curvature * speed
    return float(lib.oc_front_wheel_by_yaw_rate(L, yaw_rate, speed, gradient, yaw_rate * speed))


def test_at_walking_speed_the_front_wheel_angle_is_ackermanns() -> None:
    assert front_wheel(1 / 50.0, 0.01, 0.007) == pytest.approx(L / 50.0, rel=1e-4)
    assert front_wheel(1 / 50.0, 15.0, 0.0) == pytest.approx(L / 50.0, rel=1e-6)


def test_an_understeered_truck_needs_more_angle_the_faster_it_turns() -> None:
    """(31) with the figures of 4.2: 0.4 deg/(m/s^2), 2 m/s^2, ratio 1:19.3 are some 15 deg more at the wheel."""
    R, v = 200.0, 20.0
    angle = 19.3 * front_wheel(1 / R, v, math.radians(0.4))
    assert math.degrees(angle - 19.3 * L / R) == pytest.approx(19.3 * 0.4 * 2.0, rel=1e-4)


def test_left_is_positive_and_right_its_mirror() -> None:
    left = front_wheel(0.001, 20.0, 0.007)
    assert left > 0
    assert front_wheel(-0.001, 20.0, 0.007) == -left


@pytest.mark.parametrize(
    ("wheelbase", "ratio", "named"),
    [
        (1.0, 60.0, None), (20.0, 1.0, None), (0.0, 19.0, "wheelbase"), (0.999, 19.0, "wheelbase"),
        (20.01, 19.0, "wheelbase"), (math.nan, 19.0, "wheelbase"), (-3.7, 19.0, "wheelbase"),
        (3.7, 0.99, "steering_ratio"), (3.7, 60.1, "steering_ratio"), (3.7, math.nan, "steering_ratio"),
        (3.7, math.inf, "steering_ratio"),
    ],
)  # fmt: skip
def test_a_vehicle_out_of_range_is_refused_by_name(wheelbase: float, ratio: float, named: str | None) -> None:
    assert _core.bad_vehicle(wheelbase, ratio) == named
    if named:
        with pytest.raises(ValueError, match="vehicle"):
            _core.Core(wheelbase, ratio, {}, 100.0)
