"""Mean error of the yaw rates used so far, by later estimates of the gyro's bias: a recursive smoother."""

import math

import numpy as np
import pytest
from rolling import RATE_HZ, Array, Truth, as_ebc2, rolling
from saved_ecu import Ecu

from oncenter import _core
from oncenter._native import ffi, lib

STATES = lib.OC_GYRO_BIAS_STATES
BIAS, DRIFT = 0, 1
KEPT = 0.98  # of the drift from one reading to the next


def random_system(seed: int, readings: int) -> tuple[Array, Array, Array, Array, Array]:
    """A drifting bias, six constant states, and readings: transition, its noise, prior, regressors and their noise."""
    rng = np.random.default_rng(seed)
    F = np.eye(STATES)
    F[BIAS, DRIFT], F[DRIFT, DRIFT] = 1.0, KEPT
    Q = np.diag([4e-4, 1e-4, *[0.0] * (STATES - 2)])
    P = np.diag(rng.uniform(0.5, 2.0, STATES))
    H = rng.standard_normal((readings, STATES)) * [1.0, 0.0, *[0.7] * (STATES - 2)]
    H[:, BIAS] = 1.0
    return F, Q, P, H, rng.uniform(0.3, 0.6, readings)


def fading(used_s: Array, memory_s: float) -> Array:
    """Weights in the mean: equal up to the memory, then older ones fade."""
    share, so_far = np.zeros(len(used_s)), 0.0
    for k in np.flatnonzero(used_s):
        so_far = min(so_far + used_s[k], memory_s)
        share *= 1.0 - used_s[k] / so_far
        share[k] = used_s[k] / so_far
    return share


@pytest.mark.parametrize("memory_s", [0.0, 15.0], ids=["all", "fading"])
@pytest.mark.parametrize("seed", range(5))
def test_the_mean_is_that_of_all_readings_at_once(seed: int, memory_s: float) -> None:
    """Two derivations: a recursion in fixed memory, and the mean's distribution given all readings at once."""
    readings, rng = 40, np.random.default_rng(100 + seed)
    F, Q, P, H, R = random_system(seed, readings)
    used_s = rng.integers(0, 3, readings)  # between some none
    truth = np.linalg.cholesky(P) @ rng.standard_normal(STATES)
    x, past = np.zeros(STATES), ffi.new("oc_past_bias *", {"memory_s": memory_s})
    # all at once: the biases in use and the readings, as linear functions of all random numbers
    numbers = STATES * (readings + 1)
    state = np.zeros((STATES, numbers))
    state[:, :STATES] = np.linalg.cholesky(P)
    roots, in_use, taken_off, of_reading, z = np.sqrt(Q), [], [], [], []
    for k in range(readings):
        past.waiting_s = float(used_s[k])
        in_use.append(state[BIAS].copy())
        taken_off.append(x[BIAS])
        lib.oc_past_bias_grow(past, ffi.from_buffer("double[]", P[BIAS].copy()))
        covariance = F @ np.array(list(past.covariance))
        for j in range(STATES):
            past.covariance[j] = covariance[j]
        truth = F @ truth + roots @ rng.standard_normal(STATES)
        state = F @ state
        place = slice(STATES * (k + 1), STATES * (k + 2))
        state[:, place] = roots
        x, P = F @ x, F @ P @ F.T + Q
        z.append(H[k] @ truth + math.sqrt(R[k]) * rng.standard_normal())
        of_reading.append(H[k] @ state)
        Ph, S = P @ H[k], H[k] @ P @ H[k] + R[k]
        lib.oc_past_bias_correct(
            past, H[k] @ covariance, ffi.from_buffer("double[]", Ph.copy()), z[k] - H[k] @ x, 1.0 / S
        )
        x, P = x + Ph / S * (z[k] - H[k] @ x), P - np.outer(Ph, Ph) / S
    share = fading(used_s, memory_s or math.inf)
    mean, A = share @ np.array(in_use), np.array(of_reading)
    gain = np.linalg.solve(A @ A.T + np.diag(R), A @ mean)
    assert past.bias == pytest.approx(gain @ z - share @ taken_off, abs=1e-4)
    assert past.variance == pytest.approx(mean @ mean - gain @ (A @ mean), rel=1e-3)
    assert past.variance < 0.5 * P[BIAS, BIAS]  # the smoother is better than the filter


def used(columns: dict[str, Array]) -> tuple[float, float, float]:
    """rad/s: true mean error of all yaw rates, the core's final estimate of it, and its standard deviation."""
    ecu = Ecu()
    design, params = ffi.addressof(ecu.coefficients, "gyro_bias"), ffi.addressof(ecu.coefficients, "params")
    gyro = ffi.addressof(ecu.state, "evidence", "gyro_bias")
    tick = ffi.new("oc_signals *", {"valid": 0xFF})
    names = [name for name in columns if name in _core.COLUMNS]
    taken_off = []
    for row in zip(*(columns[name].tolist() for name in names), strict=True):
        for name, value in zip(names, row, strict=True):
            setattr(tick, _core.COLUMNS[name], value)
        taken_off.append(gyro.x[BIAS])
        gyro.past.waiting_s += 1.0 / RATE_HZ
        if gyro.due > 0:
            lib.oc_gyro_bias_work(gyro, design, params)
        lib.oc_gyro_bias_update(gyro, design, params, tick, 0.0)
    past = ffi.addressof(gyro, "past")
    return Truth().bias - float(np.mean(taken_off)), past.bias, lib.oc_past_bias_sd(past, gyro.sd)


def test_a_late_identification_by_wheels_gives_the_mean_error_before_it() -> None:
    """The wheel speeds are EBC2's coarse ones, without standstill; the reference is the true mean error."""
    off, left, sd = np.array([used(as_ebc2(rolling(seed, 240.0, standing_s=0.0))) for seed in range(8)]).T
    rms = np.sqrt(np.mean(np.square([off, off - left, (off - left) / sd]), axis=1))
    assert rms[1] < 0.5 * rms[0]
    assert 0.3 < rms[2] < 1.6
