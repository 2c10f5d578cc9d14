"""Real cars: their biases are reported, and so are faults that are planted in their logs."""

import pytest
from planted_faults import (
    EXAMPLES,
    Fault,
    only,
    scaled,
)
from real_data import real_drive

import oncenter
from oncenter.plausibility import check
from oncenter.signals import DEGREE, Signals
from oncenter.vehicle import Vehicle


def genesis(name: str) -> tuple[Signals, Vehicle]:
    log = real_drive(f"genesis/{name}.csv.gz")
    vehicle = oncenter.vehicle(EXAMPLES / "genesis.toml")
    return oncenter.read(log, names=vehicle.signal_names), vehicle


LAPS = ("cpg_fast_lap", "cpg_slow_lap")
YARD = tuple(f"rfs_2018-06-20_path{k}" for k in (1, 2, 3))
BIASES = {"yaw_rate_bias", "lateral_acceleration_at_standstill"}


@pytest.mark.parametrize("name", LAPS)
def test_a_real_car_shows_its_biases_and_nothing_else(name: str) -> None:
    findings = {finding.code: finding for finding in check(*genesis(name)).findings}
    assert set(findings) == BIASES
    assert findings["yaw_rate_bias"].value == pytest.approx(0.27, abs=0.03)
    assert findings["lateral_acceleration_at_standstill"].value == pytest.approx(-0.6, abs=0.05)


@pytest.mark.parametrize("name", LAPS)
def test_ratio_times_wheelbase_is_found_in_a_real_car(name: str) -> None:
    signals, _ = genesis(name)
    shown = [finding for finding in check(signals).findings if finding.code == "ratio_times_wheelbase"]
    assert only(tuple(shown)).value == pytest.approx(14.0 * 3.01, rel=0.05)


@pytest.mark.parametrize("name", LAPS)
def test_an_accelerometer_bias_is_reported_by_the_signal_check(name: str) -> None:
    signals, vehicle = genesis(name)
    codes = {finding.code for finding in check(signals, vehicle.model_copy(update={"params": {}})).findings}
    assert codes == {*BIASES, "bank"}


@pytest.mark.parametrize("name", YARD)
def test_no_unit_sign_or_ratio_is_blamed_in_a_slow_minute_on_a_yard(name: str) -> None:
    assert {finding.code for finding in check(*genesis(name)).findings} <= BIASES


@pytest.mark.parametrize("name", [*LAPS, *YARD])
@pytest.mark.parametrize(
    ("fault", "code"),
    [
        (scaled("yaw_rate", DEGREE), "scale"),
        (scaled("steering_wheel_angle", 1 / DEGREE), "scale"),
        (scaled("steering_wheel_angle", -1.0), "sign_reversed"),
    ],
    ids=["rad for deg", "deg for rad", "sign"],
)
def test_a_fault_planted_in_a_real_drive_is_an_error(name: str, fault: Fault, code: str) -> None:
    signals, vehicle = genesis(name)
    first = check(fault(signals), vehicle).findings[0]
    assert (first.code, first.severity) == (code, "error")
