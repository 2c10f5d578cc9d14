"""5.1.1 in the core: low-pass, the angle's delay, dv/dt, against scipy and against signals with a given result."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy import signal

from oncenter._native import ffi, lib

Array = npt.NDArray[np.float64]
RATES = (20.0, 50.0, 100.0, 128.7, 200.0)


def design_of(
    rate_hz: float, cutoff_hz: float = 3.0, band_hz: float = 2.0, window_s: float = 1.0, lag_s: float = 0.0
) -> Any:
    design = ffi.new("oc_preprocess *")
    lib.oc_preprocess_design(design, cutoff_hz, band_hz, window_s, lag_s, rate_hz)
    return design


def filtered(design: Any, angle: Array, yaw_rate: Array, speed: Array, acceleration: Array) -> Iterator[Any]:
    """Each tick as an oc_filtered, after a restart at the first, and whether the filters have settled."""
    state = ffi.new("oc_preprocess_state *")
    lib.oc_preprocess_restart(state, design, angle[0], yaw_rate[0], speed[0], acceleration[0], 0.0)
    for tick in zip(angle.tolist(), yaw_rate.tolist(), speed.tolist(), acceleration.tolist(), strict=True):
        out = lib.oc_preprocess_update(state, design, *tick, 0.0)
        yield out, lib.oc_preprocess_settled(state, design)


@pytest.mark.parametrize("rate_hz", RATES)
@pytest.mark.parametrize("cutoff_hz", [1.0, 3.0, 8.9])
def test_the_low_pass_is_a_butterworth(rate_hz: float, cutoff_hz: float) -> None:
    ours = lib.oc_lowpass_design(cutoff_hz, rate_hz)
    b, a = signal.butter(2, cutoff_hz, fs=rate_hz)
    assert [ours.b0, 2 * ours.b0, ours.b0] == pytest.approx(b, rel=1e-12)
    assert [1.0, ours.a1, ours.a2] == pytest.approx(a, rel=1e-11, abs=1e-13)
    _, response = signal.freqz([ours.b0, 2 * ours.b0, ours.b0], [1.0, ours.a1, ours.a2], [0.0, cutoff_hz], fs=rate_hz)
    assert np.abs(response) == pytest.approx([1.0, np.sqrt(0.5)], rel=1e-12)


@pytest.mark.parametrize("rate_hz", RATES)
def test_the_angle_is_delayed_by_the_filters_mean_group_delay(rate_hz: float) -> None:
    b, a = signal.butter(2, 3.0, fs=rate_hz)
    frequencies = np.linspace(1e-6, 2.0, 20_001)
    _, delay_ticks = signal.group_delay((b, a), frequencies, fs=rate_hz)
    mean = float(np.trapezoid(delay_ticks, frequencies) / 2.0)
    assert lib.oc_lowpass_delay(3.0, 2.0, rate_hz) * rate_hz == pytest.approx(mean, rel=1e-6)
    design = design_of(rate_hz)
    assert design.delay_ticks + design.delay_fraction == pytest.approx(mean, rel=1e-6)
    assert 0.0 <= design.delay_fraction < 1.0


@pytest.mark.parametrize("rate_hz", RATES)
def test_every_signal_but_the_angle_passes_the_same_filter(rate_hz: float) -> None:
    rng = np.random.default_rng(1)
    noise = rng.standard_normal((3, 400)) + 5.0
    b, a = signal.butter(2, 3.0, fs=rate_hz)
    expected = [signal.lfilter(b, a, x, zi=signal.lfilter_zi(b, a) * x[0])[0] for x in noise]
    outs = [out for out, _ in filtered(design_of(rate_hz), np.zeros(400), *noise)]
    assert [o.yaw_rate for o in outs] == pytest.approx(expected[0], rel=1e-11)
    assert [o.vehicle_speed for o in outs] == pytest.approx(expected[1], rel=1e-11)
    assert [o.lateral_acceleration for o in outs] == pytest.approx(expected[2], rel=1e-11)


@pytest.mark.parametrize("rate_hz", RATES)
def test_constant_signals_stay_constant(rate_hz: float) -> None:
    value = np.full(300, 17.3)
    for out, _ in filtered(design_of(rate_hz), value, value, value, value):
        assert [out.steering_wheel_angle, out.yaw_rate, out.vehicle_speed] == pytest.approx([17.3] * 3, rel=1e-13)
        assert abs(out.longitudinal_acceleration) < 1e-12


@pytest.mark.parametrize("lag_s", [0.0, 0.06])
@pytest.mark.parametrize(("rate_hz", "cutoff_hz"), [(20.0, 3.0), (128.7, 3.0), (200.0, 1.0), (100.0, 8.0)])
def test_a_turning_wheel_is_delayed_to_the_fraction_of_a_tick(rate_hz: float, cutoff_hz: float, lag_s: float) -> None:
    design = design_of(rate_hz, cutoff_hz, 0.99 * cutoff_hz, lag_s=lag_s)
    assert design.delay_ticks + 1 < lib.OC_DELAY_MAX
    ramp = np.arange(500) / rate_hz * 0.7
    zero = np.zeros(500)
    delay = lib.oc_lowpass_delay(cutoff_hz, 0.99 * cutoff_hz, rate_hz) + lag_s
    for k, (out, settled) in enumerate(filtered(design, ramp, zero, zero, zero)):
        if settled:
            assert out.steering_wheel_angle == pytest.approx(0.7 * (k / rate_hz - delay), abs=1e-12)


@pytest.mark.parametrize("rate_hz", RATES)
@pytest.mark.parametrize("window_s", [0.2, 1.0, 4.3])
def test_the_slope_of_a_steady_braking_is_exact(rate_hz: float, window_s: float) -> None:
    count = int(rate_hz * (window_s + 4))
    speed: Array = 25.0 - 0.8 * np.arange(count, dtype=np.float64) / rate_hz
    zero = np.zeros(count)
    last = list(filtered(design_of(rate_hz, window_s=window_s), zero, zero, speed, zero))[-1][0]
    assert last.longitudinal_acceleration == pytest.approx(-0.8, abs=1e-6)  # the filter's transient


@pytest.mark.parametrize("rate_hz", [20.0, 100.0, 128.7])
def test_the_slope_is_the_least_squares_line_through_eleven_kept_speeds(rate_hz: float) -> None:
    speed = 20 + np.cumsum(np.random.default_rng(2).standard_normal(600)) * 0.05
    zero = np.zeros(600)
    design = design_of(rate_hz)
    outs = list(filtered(design, zero, zero, speed, zero))
    smooth = np.array([out.vehicle_speed for out, _ in outs])
    every = design.slope_every
    assert every == max(1, round(rate_hz / 10))
    for k in range(10 * every, 600):
        kept = np.arange(k // every - 10, k // every + 1) * every
        line = np.polyfit(kept / rate_hz, smooth[kept], 1)
        assert outs[k][0].longitudinal_acceleration == pytest.approx(line[0], abs=1e-10)


@pytest.mark.parametrize("rate_hz", RATES)
def test_the_filters_settle_when_all_members_have_settled(rate_hz: float) -> None:
    design = design_of(rate_hz)
    zero = np.zeros(300)
    settled = [s for _, s in filtered(design, zero, zero, zero, zero)]
    assert settled.index(True) == 10 * design.slope_every + design.delay_ticks
    assert all(settled[settled.index(True) :])


def test_a_restart_clears_the_filters() -> None:
    design = design_of(100.0)
    fresh, used = ffi.new("oc_preprocess_state *"), ffi.new("oc_preprocess_state *")
    lib.oc_preprocess_restart(used, design, 9.0, 9.0, 9.0, 9.0, 9.0)
    for _ in range(123):
        lib.oc_preprocess_update(used, design, 3.0, -2.0, 30.0, 1.0, 0.5)
    for state in (fresh, used):
        lib.oc_preprocess_restart(state, design, 0.1, 0.2, 20.0, 0.3, 0.0)
    assert bytes(ffi.buffer(fresh)) == bytes(ffi.buffer(used))
