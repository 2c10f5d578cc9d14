"""The benches that ask whom an answer accuses: their faults are what they say, and they count what they say."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from healthy_drive import ANGLE, SPEED, YAW_RATE, HealthyDrive, healthy_drive

sys.path.insert(0, str(Path(__file__).parents[1] / "bench"))

import frozen_signals
import healthy
import sensor_faults
from said import is_off, wrong


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> HealthyDrive:
    """Three minutes with wheel speeds."""
    return healthy_drive(6, tmp_path_factory.mktemp("healthy"), minutes=3.0)


def answer(
    value: float, half_width: float, status: str = "valid", state: str = "within", **more: Any
) -> dict[str, Any]:
    interval = [value - half_width, value + half_width]
    headline = {"within": "Within the limit: 1.0 deg.", "recalibrate": "Recalibrate: 1.0 deg."}.get(state, state)
    verdict = {"about": "straight-ahead offset", "state": state, "headline": headline, "action": "", "note": ""}
    offset = {"value": value, "ci95": interval, "ci95_drive": interval, "status": status}
    return {"offset": offset, "verdicts": [verdict], "findings": [], "notes": [], **more}


@pytest.mark.parametrize(
    ("said", "true_deg", "is_wrong"),
    [
        (answer(1.0, 0.1), [1.7], True),
        (answer(1.0, 0.1), [1.4], False),  # less than half a degree
        (answer(1.0, 0.8), [1.7], False),  # in the interval
        (answer(1.0, 0.1, status="converging"), [1.7], False),
        (answer(1.0, 0.1), [], True),  # no offset is right
        (answer(1.0, 0.1, state="No verdict: check the signal."), [], False),
        (answer(-359.0, 0.1, state="recalibrate"), [1.0], True),
        (answer(-359.0, 0.1, state="No correction: a whole turn."), [1.0], False),
        ({"code": "missing_signal", "message": "no angle"}, [1.0], False),
    ],
)
def test_a_valid_offset_is_wrong_outside_its_interval_and_half_a_degree(
    said: dict[str, Any], true_deg: list[float], is_wrong: bool
) -> None:
    assert is_off(said, true_deg) == is_wrong


def test_another_estimate_is_wrong_where_it_is_valid_and_its_interval_lacks_the_truth(drive: HealthyDrive) -> None:
    true = np.degrees(drive.truth.yaw_rate_bias_rad_s)
    bias = {"value": true + 0.4, "ci95": [true + 0.3, true + 0.5], "status": "valid"}
    said = answer(drive.offset_deg, 0.1, yaw_rate_bias=bias)
    assert list(wrong(said, [drive.offset_deg], drive.truth)) == ["yaw_rate_bias"]
    assert list(wrong(said, [drive.offset_deg], drive.truth, ["yaw_rate_bias"])) == []
    said["yaw_rate_bias"] = bias | {"status": "converging"}
    assert list(wrong(said, [drive.offset_deg], drive.truth)) == []


@pytest.mark.parametrize("name", sensor_faults.FAULTS)
def test_a_sensor_fault_begins_in_the_middle_of_the_drive(name: str, drive: HealthyDrive) -> None:
    column = sensor_faults.FAULTS[name].column
    before, after = (table[column].to_numpy() for table in (drive.signals.table, _spoiled(drive, name)))
    changed = ~np.isclose(before, after, equal_nan=True)
    assert 0.25 < np.argmax(changed) / len(changed) < 0.75
    others = [other for other in drive.columns if other != column]
    assert drive.signals.table.select(others).equals(_spoiled(drive, name).select(others))


def _spoiled(drive: HealthyDrive, name: str) -> Any:
    return sensor_faults.spoiled(drive.signals, name, 1).table


def test_a_fault_is_named_by_an_accusation_that_the_healthy_drive_lacks() -> None:
    worn = {"code": "steering_play", "severity": "warning", "text": "the steering has 15 deg of free play"}
    jumped = {"code": "at_fault", "severity": "error", "text": "the steering wheel angle jumped"}
    bias = {"code": "yaw_rate_bias", "severity": "info", "text": "the yaw rate sensor reads +0.1 deg/s"}
    healthy_one = answer(1.0, 0.1, findings=[worn, bias])
    assert not sensor_faults.names(healthy_one, healthy_one, "steering_wheel_angle")
    found = answer(1.0, 0.1, findings=[worn, bias, jumped])
    assert sensor_faults.names(found, healthy_one, "steering_wheel_angle")
    assert not sensor_faults.names(found, healthy_one, "yaw_rate")
    assert not sensor_faults.names(answer(1.0, 0.1, findings=[bias]), answer(1.0, 0.1), "yaw_rate")
    either = bias | {"text": "yaw rate: signal or sensor, check both"}
    assert sensor_faults.names(answer(1.0, 0.1, findings=[either]), answer(1.0, 0.1), "yaw_rate")


def test_every_row_that_is_left_out_as_unhealthy_exists() -> None:
    assert not set(healthy.NOT_HEALTHY) - set(healthy.ALL_ROWS)
    assert len(healthy.HEALTHY) == len(healthy.ALL_ROWS) - len(healthy.NOT_HEALTHY)


@pytest.mark.parametrize("kind", frozen_signals.KINDS)
def test_signals_are_others_from_a_third_of_the_drive_on(kind: str, drive: HealthyDrive) -> None:
    at = drive.signals.ticks // 3
    spoiled = frozen_signals.spoiled(drive.signals, kind, 1.0 / 3.0, 1).table
    assert spoiled.head(at).equals(drive.signals.table.head(at))
    changed = [name for name in drive.columns if not spoiled[name].equals(drive.signals.table[name])]
    assert len(changed) == (2 if "swapped" in kind else 1)


def test_desk_monitor_and_c_end_alike_on_a_healthy_drive(drive: HealthyDrive) -> None:
    ends = [end(drive.signals) for end in frozen_signals.ENDS.values()]
    assert len({end.status for end in ends}) == 1
    assert ends[1].value == pytest.approx(ends[2].value)
    assert {ANGLE, YAW_RATE, SPEED} <= drive.columns.keys()
