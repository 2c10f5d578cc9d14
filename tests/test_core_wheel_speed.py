"""5.5.4: curvature, front wheel angle and offset by wheel speeds, and the effect of the radii."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from rolling import RATE_HZ, RATIO, TRACK_FRONT, TRACK_REAR, WHEELBASE, Array, Truth, core_of, rolling

from oncenter import _core
from oncenter._native import lib

NO_GYRO = ("yaw_rate_rad_s", "lateral_acceleration_m_s2", "vehicle_speed_m_s")
MISMATCH = 0.004


def front_wheels(angle: float) -> tuple[float, float]:
    """Speeds of left and right wheel of an axle steered by Ackermann about a point on the rear axle's line."""
    rate = math.tan(angle) / WHEELBASE  # rad/s at 1 m/s

    def speed(side: float) -> float:
        return math.hypot(1.0 - side * 0.5 * TRACK_FRONT * rate, WHEELBASE * rate)

    return speed(1.0), speed(-1.0)


def by_wheels(columns: Mapping[str, Array], *without: str, **core: Any) -> dict[str, Any]:
    monitor = core_of("wheel-speed", **core)
    monitor.run({name: column for name, column in columns.items() if name not in without})
    return monitor.answer()


@pytest.mark.parametrize("degrees", [-10.0, -2.0, 0.0, 0.1, 5.0, 20.0])
def test_the_front_wheel_speeds_give_the_angle(degrees: float) -> None:
    """(21) in both directions. It assumes concentric paths of the wheels: 2 % of error at 20 deg."""
    angle = math.radians(degrees)
    found = lib.oc_wheel_speed_front_angle(WHEELBASE, TRACK_FRONT, *front_wheels(angle), 0.0)
    assert found == pytest.approx(angle, rel=0.03 * abs(degrees) / 20 + 1e-4)
    left, right = front_wheels(angle)
    unequal = lib.oc_wheel_speed_front_angle(WHEELBASE, TRACK_FRONT, left / (1 + MISMATCH), right, MISMATCH)
    assert unequal == pytest.approx(found, abs=1e-12)
    curvature = lib.oc_wheel_speed_front_curvature(WHEELBASE, TRACK_FRONT, *front_wheels(angle), 0.0)
    assert curvature == pytest.approx(math.tan(angle) / WHEELBASE, rel=0.04 * abs(degrees) / 20 + 1e-4)


@pytest.mark.parametrize("curvature", [-0.02, 0.0, 1e-4, 0.02])
def test_the_rear_wheel_speeds_give_the_curvature(curvature: float) -> None:
    left, right = (20.0 * (1 + side * 0.5 * TRACK_REAR * curvature) for side in (-1, 1))
    assert lib.oc_wheel_speed_rear_curvature(TRACK_REAR, left, right, 0.0) == pytest.approx(curvature, abs=1e-15)
    unequal = left / (1 + MISMATCH)  # a larger wheel reads less
    assert lib.oc_wheel_speed_rear_curvature(TRACK_REAR, unequal, right, MISMATCH) == pytest.approx(
        curvature, abs=1e-15
    )


def test_standing_wheels_give_no_curvature() -> None:
    for speeds in ((0.0, 0.0), (-1.0, 1.0), (-2.0, 1.0)):
        assert lib.oc_wheel_speed_rear_curvature(TRACK_REAR, *speeds, 0.0) == 0.0
        assert lib.oc_wheel_speed_front_angle(WHEELBASE, TRACK_FRONT, *speeds, 0.0) == 0.0


def test_left_is_positive() -> None:
    assert lib.oc_wheel_speed_front_angle(WHEELBASE, TRACK_FRONT, 19.0, 20.0, 0.0) > 0


def flat(seed: int, **truth: float) -> dict[str, Array]:
    """A drive without crown, which wheels do not measure, and without understeer, as in rolling()."""
    return rolling(seed, truth=Truth(load=0.0, **truth))


@pytest.mark.parametrize("axle", ["rear", "front"])
def test_angle_and_two_wheels_are_enough(axle: str) -> None:
    """Wheels of equal radius, and a prior of equal radii."""
    other = [f"wheel_speed_{'front' if axle == 'rear' else 'rear'}_{side}_m_s" for side in ("left", "right")]
    columns = flat(1, mismatch_rear=0.0, mismatch_front=0.0)
    answer = by_wheels(
        columns, *NO_GYRO, *other, rear=TRACK_REAR if axle == "rear" else 0.0, wheel_radius_mismatch_sd_1=1e-5
    )
    assert answer["used"] > 100
    assert answer["offset"]["value"] == pytest.approx(0.035, abs=math.radians(0.1))


def test_with_perfect_wheels_the_result_is_that_of_the_thesiss_method_without_accelerometer() -> None:
    """Two derivations of the same motion: a gyro without bias, and wheels of equal radius."""
    columns = flat(2, bias=0.0, mismatch_rear=0.0, mismatch_front=0.0, gyro_noise=0.0, wheel_noise=0.0)
    gyro = core_of("thesis", use_accelerometer=0, understeer_evidence_min_s=1e5)
    gyro.run(columns)
    wheels = by_wheels(columns, *NO_GYRO, wheel_radius_mismatch_sd_1=0.0)
    assert wheels["offset"]["value"] == pytest.approx(gyro.answer()["offset"]["value"], abs=1e-6)
    assert wheels["used"] == pytest.approx(gyro.answer()["used"], abs=0.5)


def test_a_gyro_identifies_the_radii() -> None:
    """0.4 % is a bend of 460 m, or 9 deg of steering wheel angle: unidentified it closes the gate."""
    columns = flat(3)
    identified = by_wheels(columns)
    assert identified["used"] > 100
    assert identified["offset"]["value"] == pytest.approx(0.035, abs=math.radians(0.3))
    unidentified = by_wheels(columns, *NO_GYRO, wheel_radius_mismatch_sd_1=1e-6)
    assert unidentified["used"] < identified["used"] / 2


def test_a_late_radius_applies_to_all_evidence() -> None:
    """The evidence does not include the mismatch of its time; only the gate uses it."""
    columns = flat(4, mismatch_rear=3e-4, mismatch_front=0.0)
    wide = {"curvature_max_1_m": 0.1}
    answers = [by_wheels(columns, *NO_GYRO, wheel_radius_mismatch_sd_1=sd, **wide) for sd in (1e-6, 0.005)]
    assert answers[0]["used"] == answers[1]["used"]
    moved = answers[1]["offset"]["value"] - answers[0]["offset"]["value"]
    left, right = (columns[f"wheel_speed_rear_{side}_m_s"] for side in ("left", "right"))
    net = np.sum(right - left) / np.sum(0.5 * (left + right))
    way = np.sum(0.5 * (left + right)) / RATE_HZ
    by_turn = TRACK_REAR * 2 * math.pi / way
    believed = [net * sd**2 / (sd**2 + by_turn**2) for sd in (1e-6, 0.005)]
    assert moved == pytest.approx(RATIO * WHEELBASE / TRACK_REAR * (believed[1] - believed[0]), rel=1e-3)


def test_without_a_gyro_the_interval_includes_the_radii_and_the_net_turn() -> None:
    held, widths = 0, []
    for seed in range(20):
        mismatch = float(np.random.default_rng(seed).normal(0, 0.004))
        columns = flat(seed, mismatch_rear=mismatch)
        answer = by_wheels(columns, *NO_GYRO, curvature_max_1_m=0.02)
        sd = answer["offset"]["standard_deviation"]
        held += abs(answer["offset"]["value"] - 0.035) < 1.96 * sd
        widths.append(sd)
    assert held >= 18
    assert min(widths) > math.radians(2.0)
    longer = by_wheels(rolling(0, 1600.0, Truth(load=0.0)), *NO_GYRO, curvature_max_1_m=0.02)
    assert longer["offset"]["standard_deviation"] < 0.6 * min(widths)


def test_without_an_accelerometer_the_interval_includes_the_crown() -> None:
    """5.3.2: 0.2 m/s^2 of bank at K_us/g 0.4 deg/(m/s^2) and a ratio of 19.3 are 1.5 deg."""
    answer = by_wheels(flat(1))
    assert answer["offset"]["standard_deviation"] > math.radians(1.5)
    assert _core.STATUSES[answer["understeer_gradient"]["status"]] == "unobservable"
    given = by_wheels(flat(1), bank_sd_m_s2=0.0)
    assert given["offset"]["standard_deviation"] < math.radians(0.7)


def test_the_wheel_speeds_method_needs_a_track_width() -> None:
    with pytest.raises(ValueError, match="vehicle"):
        core_of("wheel-speed", rear=0.0, front=0.0)


def test_a_wheel_without_signal_is_a_missing_signal() -> None:
    columns = flat(1)
    answer = by_wheels(columns, "wheel_speed_rear_left_m_s")
    assert answer["rejected"][0] == answer["duration"]
    columns["wheel_speed_rear_right_m_s"][5000] = math.nan
    assert by_wheels(columns)["rejected"][0] == pytest.approx(1 / RATE_HZ)
