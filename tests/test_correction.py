"""The correction to set: what remains, and the total with what the ECU applies already; neither counts twice."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import polars as pl
import pytest

import oncenter as oc
from oncenter.signals import DEGREE, Signals
from oncenter.vehicle import vehicle_from

TRUCK = {"wheelbase_m": 3.7, "steering_ratio": 19.3, "track_width_front_m": 2.05, "track_width_rear_m": 1.83}


@pytest.fixture(scope="module")
def signals() -> Signals:
    return oc.simulate("thesis_drive", 1)[0]


def answered(signals: Signals, **values: Any) -> oc.Answer:
    return oc.offset(signals, vehicle_from({**TRUCK, **values}, "truck.toml"))


def test_applied_and_remaining_correction_remove_the_offset(signals: Signals) -> None:
    """A sensor that reads o too much, of which an ECU took c out, logs o + c: in the end it must add -o."""
    applied_deg = -1.5
    column = "steering_wheel_angle_rad"
    corrected = replace(signals, table=signals.table.with_columns(pl.col(column) + applied_deg * DEGREE))
    raw, logged = answered(signals), answered(corrected, offset_applied_deg=applied_deg)
    assert raw.offset.value is not None and raw.correction is not None and logged.correction is not None
    assert raw.correction.total == raw.correction.remaining == pytest.approx(-raw.offset.value)
    assert logged.correction.total == pytest.approx(-raw.offset.value, abs=0.1 * DEGREE)
    assert logged.correction.remaining == pytest.approx(-raw.offset.value + 1.5 * DEGREE, abs=0.1 * DEGREE)


def test_json_has_the_applied_the_remaining_and_the_total_correction(signals: Signals) -> None:
    given = answered(signals, offset_applied_deg=0.5).to_dict()
    assert given["offset"]["applied_deg"] == 0.5
    assert given["correction"]["remaining_deg"] == pytest.approx(-given["offset"]["value"])
    assert given["correction"]["total_deg"] == pytest.approx(0.5 - given["offset"]["value"])


def test_no_correction_is_given_while_the_offset_is_not_valid() -> None:
    answer = answered(oc.simulate("bypass", 1)[0])
    assert answer.offset.status == "converging"
    assert answer.to_dict()["correction"] == {"remaining_deg": None, "total_deg": None}
    assert "Add " not in str(answer)


def test_no_correction_is_given_for_a_relative_sensor(signals: Signals) -> None:
    relative = replace(signals, table=signals.table.with_columns(steering_wheel_angle_sensor_type=pl.lit(0.0)))
    assert answered(relative).correction is None


def test_a_correction_is_advised_beyond_the_limit_only(signals: Signals) -> None:
    answer = answered(signals, offset_limit_deg=1.5)
    assert answer.offset.value is not None and "Add -2.0 deg." in str(answer)
    column = "steering_wheel_angle_rad"
    right = replace(signals, table=signals.table.with_columns(pl.col(column) - answer.offset.value))
    assert "Add " not in str(answered(right, offset_limit_deg=1.5))
