"""Signals that contradict each other: they are named, and no number rests on them."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

import oncenter as oc
from oncenter.findings import Finding
from oncenter.plausibility import check, faults, signs_and_units
from oncenter.plausibility.grid_signals import GridSignals
from oncenter.signals import SIGNALS, Signals
from oncenter.vehicle import vehicle_from

ANGLE, YAW_RATE, SPEED = "steering_wheel_angle_rad", "yaw_rate_rad_s", "vehicle_speed_m_s"
ACCELERATION = "lateral_acceleration_m_s2"
LEARNED = ("offset", "understeer_gradient", "backlash", "unloading_acceleration", "equivalent_wheelbase")


@pytest.fixture(scope="module")
def truck() -> oc.Vehicle:
    return oc.vehicle("scania_r730_4x2")


@pytest.fixture(scope="module")
def drive() -> Signals:
    return oc.simulate("thesis_drive", 3)[0]


def spoiled(signals: Signals, name: str, change: Callable[[pl.Expr], pl.Expr]) -> Signals:
    return replace(signals, table=signals.table.with_columns(change(pl.col(name)).alias(name)))


@pytest.mark.parametrize(
    ("name", "change", "code"),
    [
        (ACCELERATION, lambda a: -a, "sign_reversed"),
        (YAW_RATE, lambda r: -r, "sign_reversed"),
        (ANGLE, lambda d: -d, "sign_reversed"),
        (ACCELERATION, lambda a: a / 9.81, "scale"),
        (YAW_RATE, lambda r: r * 180.0 / np.pi, "scale"),
        (SPEED, lambda v: v * 3.6, "scale"),
        (ACCELERATION, lambda a: 0.0 * a, "signal_stuck"),
    ],
)
def test_a_signal_that_contradicts_the_others_is_named_and_estimates_are_invalid(
    name: str, change: Callable[[pl.Expr], pl.Expr], code: str, drive: Signals, truck: oc.Vehicle
) -> None:
    names = [column for column in drive.table.columns if not column.startswith("wheel_speed")]
    alone = replace(spoiled(drive, name, change), table=spoiled(drive, name, change).table.select(names))
    answer = oc.offset(alone, truck)
    assert (answer.findings[0].code, answer.findings[0].severity) == (code, "error")
    assert {getattr(answer, quantity).status for quantity in LEARNED} == {"invalid"}
    assert all(getattr(answer, quantity).value is None for quantity in LEARNED)
    assert answer.words().startswith("straight-ahead offset invalid; ")
    assert '"value": null' in answer.to_json()
    assert (answer.offset_ci95_drive, answer.not_identifiable) == (None, ())


def test_a_stuck_sensor_leaves_the_estimates_from_before(drive: Signals, truck: oc.Vehicle) -> None:
    angle = drive.table[ANGLE].to_numpy().copy()
    angle[100_000:] = angle[100_000]
    answer = oc.offset(replace(drive, table=drive.table.with_columns(pl.Series(ANGLE, angle))), truck)
    healthy = oc.offset(drive, truck)
    assert (answer.offset.status, answer.sensor_fault) == ("invalid", "stuck")
    assert answer.offset.value is not None and healthy.offset.value is not None
    assert abs(answer.offset.value - healthy.offset.value) < np.radians(0.5)


def test_no_signal_of_a_healthy_drive_is_blamed(drive: Signals, truck: oc.Vehicle) -> None:
    answer = oc.offset(drive, truck)
    assert answer.offset.status == "valid"
    assert not [finding for finding in answer.findings if finding.severity == "error"]


@pytest.mark.parametrize(("beyond", "severity"), [(1.1, "warning"), (2.0, "error")])
def test_a_scale_slightly_beyond_the_usual_range_is_no_fault(
    beyond: float, severity: str, drive: Signals, truck: oc.Vehicle
) -> None:
    """Much play on straight roads spreads the angle as much; a larger factor is another unit or gain."""
    spread, _, usual = signs_and_units._relations(GridSignals(drive, truck))["angle"]
    odd = spoiled(drive, ANGLE, lambda angle: angle * (beyond * usual / spread))
    scale = signs_and_units.units(GridSignals(odd, truck))
    assert isinstance(scale, Finding)
    assert (scale.code, scale.severity, scale.value) == ("scale", severity, None)
    assert [fault.code for fault in faults(odd, truck)] == ["scale"] * (severity == "error")


@pytest.mark.parametrize(
    ("scenario", "name", "change", "code"),
    [
        ("country", YAW_RATE, lambda r: -r, "sign_reversed"),
        ("town", YAW_RATE, lambda r: -r, "sign_reversed"),
        ("motorway", YAW_RATE, lambda r: -r, "sign_reversed"),
        ("country", YAW_RATE, lambda r: r * 180.0 / np.pi, "scale"),
        ("town", YAW_RATE, lambda r: r * np.pi / 180.0, "scale"),
        ("country", SPEED, lambda v: 0.0 * v, "vehicle_speed_zero"),
    ],
)
def test_the_angle_sensor_is_not_blamed_for_another_signals_fault(
    scenario: str, name: str, change: Callable[[pl.Expr], pl.Expr], code: str, truck: oc.Vehicle
) -> None:
    drive = oc.simulate(scenario, 1)[0]
    names = [column for column in drive.table.columns if not column.startswith("wheel_speed")]
    answer = oc.offset(replace(drive, table=spoiled(drive, name, change).table.select(names)), truck)
    assert answer.findings[0].code == code and answer.offset.status == "invalid"
    said = {finding.code for finding in answer.findings}
    named = "steering wheel angle" in answer.findings[0].text  # two witnesses alone cannot say who is reversed
    assert "steering_wheel_angle_sensor_at_fault" not in said or named
    assert not {"gate_shut", "yaw_rate_bias", "yaw_rate_bias_moves", "lateral_acceleration_moves"} & said


def test_a_coarse_yaw_rate_is_not_called_stuck(drive: Signals) -> None:
    step = np.radians(1.0)
    assert faults(spoiled(drive, YAW_RATE, lambda r: (r / step).round() * step)) == ()


@pytest.mark.parametrize("name", ["yaw_rate", "steering_wheel_angle", "lateral_acceleration"])
def test_a_sign_that_the_vehicle_file_reverses_wrongly_is_to_be_removed(
    name: str, drive: Signals, truck: oc.Vehicle
) -> None:
    entry = oc.vehicle("scania_r730_4x2").model_dump() | {"signals": {name: {"name": "X", "sign": -1}}}
    wrong = vehicle_from({key: value for key, value in entry.items() if value is not None}, "t.toml")
    answer = oc.offset(spoiled(drive, f"{name}_{SIGNALS[name].quantity.unit}", lambda x: -x), wrong)
    errors = [finding for finding in answer.findings if finding.severity == "error"]
    assert [finding.code for finding in errors] == ["sign_reversed"]
    assert errors[0].text.startswith(f"the sign of the {name.replace('_', ' ')}")
    assert errors[0].text.endswith("Remove sign = -1 for it in the [signals] table of the vehicle file")
    assert (answer.sensor_fault == "none") == (name != "steering_wheel_angle")


@pytest.mark.parametrize("with_vehicle", [True, False])
@pytest.mark.parametrize(
    ("name", "change", "code"),
    [
        (ANGLE, lambda d: pl.when(pl.int_range(pl.len()) % 2 == 0).then(0.0).otherwise(d), "signal_filled"),
        (YAW_RATE, lambda r: pl.when(pl.int_range(pl.len()) % 2 == 0).then(0.0).otherwise(r), "signal_filled"),
        (YAW_RATE, lambda r: r.abs(), "signal_magnitude"),
        (ANGLE, lambda d: d.shift(70, fill_value=0.0), "signal_late"),
    ],
)
def test_signals_says_what_offset_says_of_a_signal(
    name: str, change: Callable[[pl.Expr], pl.Expr], code: str, with_vehicle: bool, drive: Signals, truck: oc.Vehicle
) -> None:
    wrong = spoiled(drive, name, change)
    judged = check(wrong, truck if with_vehicle else None).findings
    assert code in {finding.code for finding in judged if finding.severity == "error"}
    assert oc.offset(wrong, truck).findings[0].code == code


def test_one_log_of_two_with_a_wrong_signal_is_left_out_by_name(drive: Signals, truck: oc.Vehicle) -> None:
    later = replace(drive, log="later.csv", table=drive.table.with_columns(pl.col("time_s") + 50_000.0))
    answer = oc.offset([drive, spoiled(later, YAW_RATE, lambda r: -r)], truck)
    (found,) = [each for each in answer.findings if each.code == "sign_reversed"]
    assert found.severity == "warning" and found.text.startswith("later.csv: the sign of the yaw rate")
    assert ". The offset is estimated without this log. " in found.text and "cannot be estimated" not in found.text
    assert answer.offset.value == pytest.approx(oc.offset(drive, truck).offset.value)


@pytest.mark.parametrize(("name", "step"), [(ANGLE, 0.005), (YAW_RATE, 0.002), (SPEED, 0.1), (ACCELERATION, 0.1)])
def test_a_signal_that_goes_to_and_fro_at_each_tick_is_not_filled(
    drive: Signals, truck: oc.Vehicle, name: str, step: float
) -> None:
    """A coarse signal that vibrates, or two senders in turn: no sample is missing, and none is 0."""
    turns = step * np.where(np.arange(drive.ticks) % 2, 1.0, -1.0)
    answer = oc.offset(spoiled(drive, name, lambda values: values + turns), truck)
    assert answer.offset.status == "valid"
    assert not [each for each in answer.findings if each.severity == "error"]
