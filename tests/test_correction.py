"""The correction to set: what remains, and the total with what the ECU applies already; neither counts twice."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import polars as pl
import pytest

import oncenter as oc
from oncenter.estimates.correction import Correction
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


@pytest.mark.parametrize(
    ("applied", "remaining", "said"),
    [
        (0.0, -2.04, "recalibrate: add -2.0 deg"),
        (1.5, -0.5, "recalibrate: add -0.5 deg to the applied correction of +1.5 deg, so set +1 deg"),
        (1.25, -0.46, "recalibrate: add -0.5 deg to the applied correction of +1.25 deg, so set +0.75 deg"),
        (-2.0, 2.0, "recalibrate: add +2.0 deg to the applied correction of -2 deg, so set +0 deg"),
    ],
)
def test_the_words_add_up(applied: float, remaining: float, said: str) -> None:
    assert Correction(applied * DEGREE, remaining * DEGREE).words() == said


def test_json_has_the_applied_the_remaining_and_the_total_correction(signals: Signals) -> None:
    given = answered(signals, offset_applied_deg=0.5).to_dict()
    assert given["offset"]["applied_deg"] == 0.5
    assert given["correction"]["remaining_deg"] == pytest.approx(-given["offset"]["value"])
    assert given["correction"]["total_deg"] == pytest.approx(0.5 - given["offset"]["value"])


def test_no_correction_is_given_while_the_offset_is_not_valid() -> None:
    answer = answered(oc.simulate("bypass", 1)[0])
    assert answer.offset.status == "converging"
    assert answer.to_dict()["correction"] == {"remaining_deg": None, "total_deg": None}
    assert "recalibrate" not in answer.words()


def test_no_correction_is_given_for_a_relative_sensor(signals: Signals) -> None:
    relative = replace(signals, table=signals.table.with_columns(steering_wheel_angle_sensor_type=pl.lit(0.0)))
    assert answered(relative).correction is None


def test_no_correction_is_recommended_where_the_interval_contains_zero(signals: Signals) -> None:
    answer = answered(signals)
    assert answer.offset.value is not None and "recalibrate" in answer.words()
    column = "steering_wheel_angle_rad"
    right = replace(signals, table=signals.table.with_columns(pl.col(column) - answer.offset.value))
    assert "recalibrate" not in answered(right).words()
