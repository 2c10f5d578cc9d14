"""Ratio times wheelbase: correct where it is reported, and not blamed for other faults."""

import re

import numpy as np
import pytest
from planted_faults import (
    RATE_HZ,
    TRUCK,
    Fault,
    changed,
    dead,
    drive,
    held,
    only,
    scaled,
    shifted,
    without,
)

import oncenter
from oncenter.plausibility import check
from oncenter.signals import DEGREE

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("scenario", ["thesis_drive", "town", "country", "motorway", "heavy_play"])
@pytest.mark.parametrize("seed", [1, 2])
def test_a_healthy_truck_has_no_finding_on_ratio_or_lag(scenario: str, seed: int) -> None:
    """Side slip makes the accelerometer lead r*v in town, and a crown hangs the wheels on one flank of the play."""
    signals, _ = oncenter.simulate(scenario, seed)
    codes = {finding.code for finding in check(signals, oncenter.vehicle("scania_r730_4x2")).findings}
    assert not codes & {"ratio_times_wheelbase", "lag_yaw_rate", "lag_lateral_acceleration"}


@pytest.mark.parametrize("name", ["yaw_rate", "lateral_acceleration"])
def test_a_doubled_or_halved_signal_is_reported_and_no_ratio_is_blamed(name: str) -> None:
    factor = 2.0 if name == "yaw_rate" else 0.5
    for scenario in ("thesis_drive", "town", "country"):
        signals = scaled(name, factor)(oncenter.simulate(scenario, 1)[0])
        codes = {finding.code for finding in check(signals, oncenter.vehicle("scania_r730_4x2")).findings}
        assert "scale" in codes and "ratio_times_wheelbase" not in codes


@pytest.mark.parametrize(
    "fault",
    [
        lambda signals: without(signals, "lateral_acceleration"),
        lambda signals: changed(signals, "lateral_acceleration", lambda x, t: np.full_like(x, np.nan)),
        lambda signals: changed(signals, "lateral_acceleration", dead),
        held("lateral_acceleration", 600.0),
        lambda signals: changed(signals, "lateral_acceleration", lambda x, t: x + 1.5 * t / t[-1]),
    ],
    ids=["not in the log", "no number", "dead", "stuck", "drifting"],
)
def test_no_ratio_is_blamed_for_a_missing_or_faulty_accelerometer(fault: Fault) -> None:
    for scenario, seed in (("country", 1), ("country", 2), ("town", 1)):
        signals = fault(oncenter.simulate(scenario, seed)[0])
        codes = {finding.code for finding in check(signals, oncenter.vehicle("scania_r730_4x2")).findings}
        assert "ratio_times_wheelbase" not in codes


def test_ratio_times_wheelbase_is_found_with_an_accelerometer_and_in_town_without() -> None:
    truck = oncenter.vehicle("scania_r730_4x2")
    on_country, in_town = oncenter.simulate("country", 1)[0], oncenter.simulate("town", 1)[0]
    for signals in (shifted("lateral_acceleration", 0.4)(on_country), without(in_town, "lateral_acceleration")):
        shown = [each for each in check(signals).findings if each.code == "ratio_times_wheelbase"]
        assert only(tuple(shown)).value == pytest.approx(truck.ratio_near_centre * truck.wheelbase_m, rel=0.03)


def test_a_drive_on_a_crown_gives_ratio_times_wheelbase_within_three_per_cent() -> None:
    truck = oncenter.vehicle("scania_r730_4x2")
    for seed in (1, 2, 3, 4):
        signals, _ = oncenter.simulate("country", seed)
        shown = [each for each in check(signals).findings if each.code == "ratio_times_wheelbase"]
        assert only(tuple(shown)).value == pytest.approx(truck.ratio_near_centre * truck.wheelbase_m, rel=0.03)


@pytest.mark.parametrize("ratio", [14.0, 17.0, 22.0])
def test_a_wrong_ratio_in_the_vehicle_file_is_reported_with_the_right_one(ratio: float) -> None:
    finding = only(check(drive(), TRUCK.model_copy(update={"steering_ratio": ratio})).findings)
    assert finding.code == "ratio_times_wheelbase"
    assert finding.severity == "warning"
    assert finding.value == pytest.approx(19.3 * 3.7, rel=0.05)
    pair = re.search(r"steering ratio \(the file has (\S+), (\S+) fits\)", finding.text)
    assert float(pair[1]) == ratio and float(pair[2]) == pytest.approx(19.3, rel=0.05)
    assert ("lifted axle" in finding.text) == (abs(19.3 / ratio - 1.0) < 0.2)


@pytest.mark.parametrize("habit", [{"play_deg": 15.0}, {"lag_s": 0.4}, {"lag_s": 0.0}], ids=str)
@pytest.mark.parametrize("seed", range(4))
def test_play_and_lag_do_not_change_the_ratio(seed: int, habit: dict[str, float]) -> None:
    finding = only(check(drive(seed, **habit)).findings)
    assert finding.code == "ratio_times_wheelbase"
    assert finding.value == pytest.approx(19.3 * 3.7, rel=0.015)


def test_a_gyro_bias_does_not_change_the_ratio() -> None:
    biased = shifted("yaw_rate", 1.0 * DEGREE)(drive(duration_s=100.0))
    shown = [finding for finding in check(biased).findings if finding.code == "ratio_times_wheelbase"]
    assert only(tuple(shown)).value == pytest.approx(19.3 * 3.7, rel=0.015)


def test_at_one_speed_the_ratio_is_not_judged_because_of_understeer() -> None:
    judged = check(drive(swing=0.5), TRUCK)
    assert judged.findings == ()
    assert "ratio times wheelbase" in {verdict.check for verdict in judged.cannot_tell}


def test_a_noisy_ratio_is_not_judged() -> None:
    noise = np.random.default_rng(2).standard_normal(round(60 * RATE_HZ)) * 6.0 * DEGREE
    blurred = changed(drive(duration_s=60.0), "yaw_rate", lambda x, t: x + noise)
    judged = check(blurred, TRUCK.model_copy(update={"steering_ratio": 30.0}))
    assert "ratio_times_wheelbase" not in {finding.code for finding in judged.findings}
    assert "ratio times wheelbase" in {verdict.check for verdict in judged.cannot_tell}


def test_without_a_vehicle_file_ratio_times_wheelbase_is_reported() -> None:
    finding = only(check(drive()).findings)
    assert finding.severity == "info"
    assert finding.value == pytest.approx(19.3 * 3.7, rel=0.05)
