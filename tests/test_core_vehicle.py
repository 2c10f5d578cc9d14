"""(7), (10), (31) in the core, and the ranges in which a vehicle is believed."""

import math

import pytest
from oncenter._native import ffi, lib

from oncenter import _core

TRUCK = ffi.new("oc_vehicle *", {"wheelbase": 3.9, "steering_ratio": 19.3})


def test_at_walking_pace_the_wheels_point_along_the_ackermann_angle() -> None:
    assert lib.oc_ackermann_angle(TRUCK, 1 / 50.0) == pytest.approx(3.9 / 50.0)
    assert lib.oc_steady_state_angle(TRUCK, 1 / 50.0, 0.007, 0.0) == pytest.approx(19.3 * 3.9 / 50.0)


def test_an_understeered_truck_needs_more_angle_the_faster_it_turns() -> None:
    """(31) with the figures of 4.2: 0.4 deg/(m/s^2), 2 m/s^2, ratio 1:19.3 are some 15 deg more at the wheel."""
    R, v = 200.0, 20.0
    angle = lib.oc_steady_state_angle(TRUCK, 1 / R, math.radians(0.4), v * v / R)
    assert math.degrees(angle - 19.3 * 3.9 / R) == pytest.approx(19.3 * 0.4 * 2.0)


def test_left_is_positive_and_right_its_mirror() -> None:
    left = lib.oc_steady_state_angle(TRUCK, 0.001, 0.007, 0.4)
    assert left > 0
    assert lib.oc_steady_state_angle(TRUCK, -0.001, 0.007, -0.4) == -left


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
