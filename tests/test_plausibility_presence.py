"""Missing, stuck, coarse and slow signals are reported; signals that change slowly are not."""

from dataclasses import replace

import numpy as np
import pytest
from planted_faults import (
    RATE_HZ,
    TRUCK,
    WHEELS,
    both,
    changed,
    drive,
    held,
    in_steps,
    noisy,
    only,
    wheels_held,
    without,
)

from oncenter.plausibility import check
from oncenter.plausibility.presence import resolution
from oncenter.signals import DEGREE, SIGNALS, Source


@pytest.mark.parametrize("name", ["steering_wheel_angle", "yaw_rate", "lateral_acceleration"])
def test_a_stuck_signal_is_an_error(name: str) -> None:
    codes = {finding.code for finding in check(held(name, 200.0)(drive()), TRUCK).findings}
    assert "signal_stuck" in codes


@pytest.mark.parametrize("fine", [True, False])
@pytest.mark.parametrize("unheard", [(), WHEELS])
def test_a_stuck_vehicle_speed_is_found_by_the_wheels_or_by_its_fine_steps(
    unheard: tuple[str, ...], fine: bool
) -> None:
    signals = noisy(drive()) if fine else in_steps("vehicle_speed", 1 / 256 / 3.6)(drive())
    stuck = without(held("vehicle_speed", 150.0)(signals), *unheard)
    assert "signal_stuck" in {finding.code for finding in check(stuck, TRUCK).findings}


def test_a_stuck_vehicle_speed_is_found_beside_stuck_or_steady_wheels() -> None:
    steady = drive(swing=0.1)
    for stuck in (
        wheels_held(held("vehicle_speed", 150.0)(noisy(drive())), 150.0),
        held("vehicle_speed", 150.0)(noisy(steady)),
    ):
        assert "signal_stuck" in {finding.code for finding in check(stuck, TRUCK).findings}


@pytest.mark.parametrize("unheard", [(), WHEELS])
def test_a_cruise_control_that_stays_within_a_coarse_step_is_not_stuck(unheard: tuple[str, ...]) -> None:
    """45 km/h and 0.2 off, in steps of 1 km/h."""
    signals = without(in_steps("vehicle_speed", 1 / 3.6)(drive(swing=0.05)), *unheard)
    assert len(np.unique(signals.table["vehicle_speed_m_s"].to_numpy()[500:])) == 1
    assert "signal_stuck" not in {finding.code for finding in check(signals, TRUCK).findings}


@pytest.mark.parametrize(("name", "step"), [("steering_wheel_angle", 2.0), ("yaw_rate", 0.25)])
def test_a_coarse_signal_is_reported_with_its_step(name: str, step: float) -> None:
    coarse = [f for f in check(in_steps(name, step * DEGREE)(drive()), TRUCK).findings if f.code == "signal_coarse"]
    assert only(tuple(coarse)).value == pytest.approx(step)


def test_resolution_is_the_step_of_the_encoding() -> None:
    fine = np.random.default_rng(0).normal(size=5000)
    assert resolution(np.round(fine * 64) / 64) == pytest.approx(1 / 64)
    assert resolution(fine) is None
    assert resolution(np.zeros(100)) is None


def test_a_coarse_signal_is_reported_after_resampling_as_well() -> None:
    sampled = np.arange(0.0, 300.0, 0.02)
    fault = both(
        in_steps("steering_wheel_angle", 2.0 * DEGREE),
        lambda signals: changed(
            signals, "steering_wheel_angle", lambda x, t: np.interp(t, sampled + 0.003 * np.sin(sampled), x)
        ),
    )
    coarse = [f for f in check(fault(drive()), TRUCK).findings if f.code == "signal_coarse"]
    assert only(tuple(coarse)).value == pytest.approx(2.0)


def test_a_slow_signal_is_reported() -> None:
    signals = drive()
    sources = {**signals.sources, "yaw_rate": Source("VDC2 from 0x3E", 5.0, 1500, 0)}
    finding = only(check(replace(signals, sources=sources), TRUCK).findings)
    assert (finding.code, finding.value, finding.unit) == ("signal_slow", 5.0, "Hz")


@pytest.mark.parametrize("name", ["steering_wheel_angle", "yaw_rate", "vehicle_speed"])
def test_a_missing_necessary_signal_is_an_error(name: str) -> None:
    findings = check(without(drive(), name), TRUCK).findings
    assert [f.code for f in findings if f.severity == "error"] == ["missing_signal"]
    assert SIGNALS[name].name.replace("_", " ") in findings[0].text


def test_often_unavailable_signals_are_reported_and_the_rest_is_judged() -> None:
    signals = changed(drive(), "yaw_rate", lambda x, t: np.where((t + 5) % 10 < 1, np.nan, x))
    sources = {**signals.sources, "yaw_rate": Source("VDC2 from 0x3E", RATE_HZ, 1000, 100)}
    finding = only(check(replace(signals, sources=sources), TRUCK).findings)
    assert finding.code == "signal_not_available"
    assert finding.value == pytest.approx(10.0)
