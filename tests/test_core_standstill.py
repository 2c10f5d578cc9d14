"""5.3.1 at standstill: zero errors of the sensors."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from oncenter import _core
from oncenter._native import ffi, lib

RATE_HZ = 100.0


def stood(
    speed: npt.NDArray[np.float64], yaw_rate: npt.NDArray[np.float64], settling_ticks: int = 20, has: int = 1
) -> Any:
    state = ffi.new("oc_standstill *")
    for v, r in zip(speed.tolist(), yaw_rate.tolist(), strict=True):
        lib.oc_standstill_update(state, settling_ticks, v, 0.1, r, 10 * r, has, 0.0)
    return state


def test_the_bias_is_the_mean_at_standstill() -> None:
    r = np.random.default_rng(0).normal(0.004, 0.001, 500)
    v = np.where(np.arange(500) < 300, 0.0, 5.0)
    bias = lib.oc_standstill_yaw_rate(stood(v, r), 1 / RATE_HZ, 0.5)
    assert bias.value == pytest.approx(np.mean(r[20:300]), rel=1e-12)
    assert bias.evidence == pytest.approx(2.8)
    assert bias.status == lib.OC_VALID
    assert abs(bias.value - 0.004) < 1.96 * bias.standard_deviation
    tilt = lib.oc_standstill_lateral_acceleration(stood(v, r), 1 / RATE_HZ, 0.5)
    assert tilt.value == pytest.approx(10 * bias.value)


def test_half_a_second_is_the_minimum() -> None:
    zeros = np.zeros(70)
    for ticks, enough in ((69, False), (70, True)):
        bias = lib.oc_standstill_yaw_rate(stood(zeros[:ticks], zeros[:ticks] + 0.004), 1 / RATE_HZ, 0.5)
        assert (bias.status == lib.OC_VALID) is enough
        assert bias.value == (pytest.approx(0.004) if enough else 0.0)


def test_every_stop_settles_again() -> None:
    v = np.tile(np.repeat([0.0, 3.0], [30, 5]), 4)
    state = stood(v, np.ones(len(v)))
    assert state.yaw_rate.weight == 4 * 10


def test_rolling_backward_is_no_standstill() -> None:
    assert stood(np.full(100, -0.2), np.ones(100)).yaw_rate.weight == 0
    assert stood(np.full(100, -0.1), np.ones(100), settling_ticks=0).yaw_rate.weight == 100


def test_without_an_accelerometer_the_yaw_rate_bias_is_still_identified() -> None:
    state = stood(np.zeros(100), np.full(100, 0.004), has=0)
    assert lib.oc_standstill_yaw_rate(state, 1 / RATE_HZ, 0.5).status == lib.OC_VALID
    assert lib.oc_standstill_lateral_acceleration(state, 1 / RATE_HZ, 0.5).status == lib.OC_UNOBSERVABLE


def standing(rate_hz: float) -> dict[str, npt.NDArray[np.float64]]:
    """2 s of standstill; gyro bias 0.25 deg/s, accelerometer bias -0.6 m/s^2."""
    t = np.arange(int(2 * rate_hz)) / rate_hz
    zero = np.zeros_like(t)
    return {
        "time_s": t,
        "steering_wheel_angle_rad": zero,
        "yaw_rate_rad_s": zero + np.radians(0.25),
        "vehicle_speed_m_s": zero,
        "lateral_acceleration_m_s2": zero - 0.6,
    }


@pytest.mark.parametrize("rate_hz", [20.0, 100.0, 200.0])
def test_a_standing_truck_gives_biases_and_no_offset(rate_hz: float) -> None:
    core = _core.Core(3.9, 19.3, {}, rate_hz)
    core.run(standing(rate_hz))
    answer = core.answer()
    assert answer["yaw_rate_bias"]["value"] == pytest.approx(np.radians(0.25))
    assert answer["standstill_lateral_acceleration"]["value"] == pytest.approx(-0.6)
    assert answer["offset"]["status"] == answer["understeer_gradient"]["status"] == lib.OC_UNOBSERVABLE
