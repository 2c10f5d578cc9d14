"""Signals of different rates are resampled to one tick, and gaps stay gaps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oncenter.errors import OncenterError
from oncenter.read.clock import at_ticks, to_one_tick
from oncenter.read.samples import Samples, nominal_rate


def samples(signal: str, time: np.ndarray, values: np.ndarray) -> Samples:
    return Samples(signal, time, values, "test", f"{signal} of the test")


def one_tick(*chosen: Samples) -> tuple[dict[str, np.ndarray], float]:
    columns, rate_hz, _ = to_one_tick(chosen, "test", [])
    return columns, rate_hz


def test_one_steady_time_column_is_passed_on_unchanged() -> None:
    rng = np.random.default_rng(1)
    time = 1.7e9 + np.arange(500) * 0.01
    angle, speed = rng.normal(size=500), rng.normal(size=500)
    angle[7] = np.nan
    table, rate = one_tick(samples("steering_wheel_angle", time, angle), samples("vehicle_speed", time.copy(), speed))
    assert rate == 100.0
    assert np.array_equal(table["time_s"], time)
    assert np.array_equal(table["steering_wheel_angle_rad"], angle, equal_nan=True)
    assert np.array_equal(table["vehicle_speed_m_s"], speed)


def test_a_single_sample_of_every_signal_is_one_tick() -> None:
    table, _ = one_tick(samples("yaw_rate", np.zeros(1), np.ones(1)), samples("vehicle_speed", np.zeros(1), np.ones(1)))
    assert table["time_s"].tolist() == [0.0]


def test_repeated_and_backward_stamps_of_a_steady_table_are_left_for_the_core_to_count() -> None:
    time = np.arange(500) * 0.01
    time[100] = time[99]
    time[200] = time[150]
    table, rate = one_tick(samples("steering_wheel_angle", time, time * 0))
    assert rate == 100.0
    assert np.array_equal(table["time_s"], time)


@given(
    slope=st.floats(-5, 5),
    level=st.floats(-5, 5),
    late=st.lists(st.floats(-0.2, 0.2), min_size=60, max_size=60),
    rate=st.sampled_from([7.0, 10.0, 20.0, 50.0, 93.0]),
)
def test_a_straight_line_stays_straight_at_any_rates(
    slope: float, level: float, late: list[float], rate: float
) -> None:
    fast = np.arange(500) / 100
    slow = (np.arange(60) + np.array(late)) / rate
    table, _ = one_tick(
        samples("steering_wheel_angle", fast, slope * fast + level),
        samples("vehicle_speed", slow, slope * slow + level),
    )
    exact = slope * table["time_s"] + level
    speed = table["vehicle_speed_m_s"]
    known = ~np.isnan(speed)
    # A first or last sample counts for a tick within 1 us; between samples the line is exact.
    between = known & (table["time_s"] > slow[0] + 1e-5) & (table["time_s"] < slow[-1] - 1e-5)
    assert np.allclose(speed[between], exact[between], atol=1e-9)
    assert np.allclose(speed[known], exact[known], atol=6e-6)
    inside = (table["time_s"] >= slow[0]) & (table["time_s"] <= slow[-1])
    assert known[inside].all()
    assert not known[~inside & ((table["time_s"] < slow[0] - 1e-5) | (table["time_s"] > slow[-1] + 1e-5))].any()


@given(
    start=st.integers(20, 200),
    gap=st.integers(1, 100),
    silence=st.booleans(),
)
def test_no_number_appears_inside_a_gap(start: int, gap: int, silence: bool) -> None:
    """The gap is of missing messages or of "not available": samples over 2.5 periods apart are not interpolated."""
    fast, slow = np.arange(3000) / 100, np.arange(300) / 10
    values = np.sin(slow)
    lost = np.zeros(300, bool)
    lost[start : start + gap] = True
    kept = slow[~lost] if silence else slow
    seen = values[~lost] if silence else np.where(lost, np.nan, values)
    table, _ = one_tick(samples("steering_wheel_angle", fast, fast), samples("vehicle_speed", kept, seen))
    time, speed = table["time_s"], table["vehicle_speed_m_s"]
    before, after = slow[start - 1], slow[min(start + gap, 299)]
    within = (time > before + 1e-5) & (time < after - 1e-5)
    if gap >= 2:
        assert np.isnan(speed[within]).all()
    else:
        assert not np.isnan(speed[within]).any()  # one lost message of three is bridged
    outside = (time <= before) | ((time >= after) & (time <= slow[~lost][-1]))
    assert not np.isnan(speed[outside]).any()


def test_a_long_gap_in_all_signals_has_no_rows() -> None:
    time = np.concatenate((np.arange(300) / 100, 60 + np.arange(300) / 100))
    slow = np.concatenate((np.arange(30) / 10, 60 + np.arange(30) / 10))
    table, _ = one_tick(samples("steering_wheel_angle", time, time), samples("vehicle_speed", slow, slow))
    ticks = table["time_s"]
    assert len(ticks) == 600
    assert not ((ticks > 3.0) & (ticks < 60.0)).any()
    assert np.allclose(table["steering_wheel_angle_rad"], ticks)
    assert np.isclose(np.diff(ticks), 0.01).sum() == 598


def test_a_jittering_clock_is_put_on_a_uniform_tick() -> None:
    rng = np.random.default_rng(2)
    time = np.arange(1000) / 100 + rng.uniform(-0.003, 0.003, 1000)
    table, rate = one_tick(samples("steering_wheel_angle", time, 2 * time), samples("yaw_rate", time, 3 * time))
    assert rate == pytest.approx(100, rel=0.01)
    assert np.allclose(np.diff(table["time_s"]), 1 / rate)
    assert np.allclose(table["yaw_rate_rad_s"], 3 * table["time_s"], atol=1e-9)


def test_a_fast_angle_is_thinned_to_at_most_200_hz() -> None:
    time = np.arange(5000) / 1000
    table, rate = one_tick(samples("steering_wheel_angle", time, time))
    assert rate == 200.0
    assert np.array_equal(table["time_s"], time[::5])
    table, rate = one_tick(samples("steering_wheel_angle", time, time), samples("vehicle_speed", time[::7], time[::7]))
    assert rate == 200.0
    assert np.allclose(table["steering_wheel_angle_rad"], table["time_s"])


@pytest.mark.parametrize("rate", [5.0, 7.0, 10.0, 19.0])
def test_an_angle_of_at_least_5_hz_is_resampled_to_a_rate_of_the_core(rate: float) -> None:
    time, notes = np.arange(100) / rate, []
    angle = samples("steering_wheel_angle", time, 0.1 * time)
    table, rate_hz, _ = to_one_tick([angle], "test", notes)
    assert rate_hz == 20.0
    assert notes == [f"recorded at {rate:g} Hz, resampled to 20 Hz"]
    assert np.allclose(np.diff(table["time_s"]), 0.05)
    assert np.allclose(table["steering_wheel_angle_rad"], 0.1 * table["time_s"])


def test_an_angle_slower_than_5_hz_is_refused_with_its_rate() -> None:
    time = np.arange(100) / 4
    with pytest.raises(OncenterError, match=r"4 Hz.*at least 5 Hz") as refused:
        one_tick(samples("steering_wheel_angle", time, time))
    assert refused.value.code == "rate_too_low"


def test_a_nominal_20_hz_clock_that_runs_slow_is_still_20_hz() -> None:
    time = np.arange(200) / 19.7
    _, rate = one_tick(samples("steering_wheel_angle", time, time))
    assert rate == 20.0


@pytest.mark.parametrize("time", [np.arange(300)[::-1] / 100, np.zeros(300), np.repeat(np.arange(150) / 50, 2)])
def test_time_that_does_not_increase_is_refused(time: np.ndarray) -> None:
    with pytest.raises(OncenterError, match="time does not increase") as refused:
        one_tick(samples("steering_wheel_angle", time, time))
    assert refused.value.code == "time_backward"


@pytest.mark.parametrize("state", ["steering_wheel_angle_sensor_type", "reverse"])
def test_a_state_is_never_interpolated(state: str) -> None:
    time, rare = np.arange(300) / 100, np.arange(60) / 20
    kind = (np.arange(60) >= 30).astype(float)
    table, _ = one_tick(samples("steering_wheel_angle", time, time), samples(state, rare, kind))
    seen = table[state]
    assert set(seen[~np.isnan(seen)]) == {0.0, 1.0}


def test_a_heading_across_north_is_interpolated_across_north() -> None:
    time, slow = np.arange(300) / 100, np.arange(30) / 10
    table, _ = one_tick(
        samples("steering_wheel_angle", time, time), samples("heading", slow, np.mod(350 + 10 * slow, 360))
    )
    heading = table["heading_deg"]
    known = ~np.isnan(heading)
    assert np.allclose(heading[known], np.mod(350 + 10 * table["time_s"][known], 360))


def stamps(hz: float, trouble: str, duration_s: float = 8.0) -> np.ndarray:
    rng = np.random.default_rng(7)
    time = 1.7e9 + np.arange(round(duration_s * hz)) / hz
    if trouble == "trembling":
        return np.sort(time + rng.normal(0.0, 0.2 / hz, len(time)))
    if trouble == "in fours":
        return np.repeat(time[3::4], 4) + np.tile(0.0004 * np.arange(4), len(time) // 4)
    if trouble == "a third lost":
        return time[rng.random(len(time)) > 1 / 3]
    if trouble == "silent":
        return time[(time < time[0] + 0.2) | (time > time[0] + 4.0)]
    if trouble == "earlier stamps":
        return time - np.where(np.arange(len(time)) % 50 == 49, 3.5 / hz, 0.0)
    return time


@pytest.mark.parametrize("hz", [200.0, 100.0, 50.0, 40.0, 25.0, 20.0, 10.0])
@pytest.mark.parametrize(
    "trouble", ["none", "trembling", "in fours", "a third lost", "silent", "earlier stamps", "slow by 3 %"]
)
def test_a_sender_has_its_nominal_rate_for_any_disturbance_of_its_stamps(hz: float, trouble: str) -> None:
    assert nominal_rate(stamps(0.97 * hz if "slow" in trouble else hz, trouble)) == hz


@settings(max_examples=30)
@given(st.integers(0, 1000), st.floats(11.0, 190.0), st.sampled_from(["none", "trembling", "a third lost", "silent"]))
def test_a_settled_rate_does_not_change_with_later_frames(more: int, hz: float, trouble: str) -> None:
    time = stamps(hz, trouble, 20.0)
    sender = Samples("yaw_rate", time, np.zeros(len(time)), "VDC2", "VDC2 from 0x3E", of_frames=True)
    settled = next(
        n for n in range(10, len(time), 7) if replace(sender, time=time[:n], values=np.zeros(n)).rate_is_settled
    )
    some = time[: min(settled + more, len(time))]
    assert nominal_rate(some) == sender.rate_hz


def test_a_tick_on_a_sample_takes_its_value_though_epoch_stamps_are_rounded() -> None:
    """Else the remainders of steps of a coarse signal look like a finer resolution, and its steps like jumps."""
    time = 1.7e9 + np.arange(100) / 50.0
    values = np.round(np.arange(100) / 10.0)
    ticks = time + np.where(np.arange(100) % 2, 3e-7, -3e-7)
    assert np.isin(at_ticks("steering_wheel_angle", time, values, ticks[1:-1], 1.0), values).all()
