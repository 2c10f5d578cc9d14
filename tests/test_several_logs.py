"""Several logs in one answer: a step between two of them is found, and none where there is none."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import polars as pl
import pytest
from test_findings import example_on_page

import oncenter as oc
from oncenter.offset.several_logs import drives_differ, play_changed
from oncenter.signals import DEGREE, Signals
from oncenter.truck.events import Event
from oncenter.truck.now import Change
from oncenter.vehicle import Vehicle, vehicle_from

DAY_S, MONDAY_S = 86400.0, 1_772_434_800.0
TRUTH_DEG = 2.04  # of the scenario thesis_drive


def vehicle(**known: Any) -> Vehicle:
    return vehicle_from(
        {
            **known,
            "wheelbase_m": 3.7,
            "steering_ratio": 19.3,
            "track_width_front_m": 2.0,
            "track_width_rear_m": 1.8,
            "traffic_side": "right",
        },
        "truck",
    )


@cache
def drive_of(day: int) -> Signals:
    signals, _ = oc.simulate("thesis_drive", seed=day + 1)
    table = signals.table.head(90_000).with_columns(pl.col("time_s") + day * DAY_S)
    return replace(signals, table=table, log=f"day{day}.parquet")


def days(count: int) -> tuple[Signals, ...]:
    """A drive a day of one truck that nobody touched."""
    return tuple(drive_of(day) for day in range(count))


@cache
def answer_of_nine() -> oc.Answer:
    return oc.offset(list(days(9)), vehicle())


def moved(drives: tuple[Signals, ...], at: int, by_deg: float) -> list[Signals]:
    """The drives as if the sensor had been mounted otherwise before drive `at`."""
    angle = pl.col("steering_wheel_angle_rad")
    return [
        drive if day < at else replace(drive, table=drive.table.with_columns(angle + by_deg * DEGREE))
        for day, drive in enumerate(drives)
    ]


@pytest.mark.slow
def test_after_a_step_between_two_of_nine_logs_the_answer_uses_those_since() -> None:
    answer = oc.offset(moved(days(9), 5, 1.9), vehicle())
    assert answer.offset.value is not None and answer.offset.ci95 is not None
    assert answer.offset.value / DEGREE == pytest.approx(TRUTH_DEG + 1.9, abs=0.4)
    assert [drive.log for drive in answer.drives] == [f"day{day}.parquet" for day in range(5, 9)]
    (change,) = answer.changes
    assert change.log == "day5.parquet" and change.size_rad is not None
    assert change.size_rad / DEGREE == pytest.approx(1.9, abs=0.3)
    assert any("between day4.parquet and day5.parquet" in finding.text for finding in answer.findings)


@pytest.mark.slow
def test_a_step_is_found_wherever_it_is_between_nine_logs() -> None:
    for at in range(2, 8):
        answer = oc.offset(moved(days(9), at, -3.0), vehicle())
        assert [change.log for change in answer.changes] == [f"day{at}.parquet"], at


def test_nine_logs_of_a_truck_that_nobody_touched_have_no_step() -> None:
    answer = answer_of_nine()
    assert answer.changes == () and len(answer.drives) == 9
    assert answer.offset.ci95 is not None
    low, high = answer.offset.ci95
    assert low < TRUTH_DEG * DEGREE < high


def test_two_valid_logs_that_differ_by_three_degrees_are_not_blended() -> None:
    answer = oc.offset(moved(days(2), 1, 3.0), vehicle())
    assert [change.log for change in answer.changes] == ["day1.parquet"]
    assert answer.offset.value is not None
    assert answer.offset.value / DEGREE == pytest.approx(TRUTH_DEG + 3.0, abs=0.4)
    assert oc.offset(list(days(2)), vehicle()).changes == ()


@pytest.mark.slow
@pytest.mark.parametrize(("count", "at", "into_s"), [(4, 3, 100.0), (5, 4, 0.0), (8, 7, 0.0), (4, 3, 500.0)], ids=str)
def test_a_new_offset_in_the_last_log_is_not_treated_as_an_outlier(count: int, at: int, into_s: float) -> None:
    """Whether it changed in the last log or before it: the old offset is never printed as valid."""
    drives = [*days(count)]
    late = pl.col("time_s") - pl.col("time_s").first() >= into_s
    angle = pl.col("steering_wheel_angle_rad") + pl.when(late).then(4.0 * DEGREE).otherwise(0.0)
    drives[at] = replace(drives[at], table=drives[at].table.with_columns(angle))
    answer = oc.offset(drives, vehicle())
    assert answer.offset.value is not None and answer.offset.ci95 is not None
    if answer.offset.status == "valid":
        assert answer.offset.value / DEGREE == pytest.approx(TRUTH_DEG + 4.0, abs=1.0)
    else:
        assert answer.offset.ci95[0] < (TRUTH_DEG + 4.0) * DEGREE


def test_the_drives_part_is_never_wider_than_the_whole_interval() -> None:
    for side in ({}, {"params": {"use_accelerometer": False}}):
        answer = oc.offset(list(days(5)), vehicle(**side))
        assert answer.offset.ci95 is not None and answer.offset_half_width_rad is not None
        assert answer.offset_half_width_rad <= 0.5 * (answer.offset.ci95[1] - answer.offset.ci95[0]) + 1e-9


def test_several_logs_have_no_wider_interval_than_the_best_of_them() -> None:
    def half_width(answer: oc.Answer) -> float:
        assert answer.offset.ci95 is not None
        return 0.5 * (answer.offset.ci95[1] - answer.offset.ci95[0])

    alone = [half_width(oc.offset(drive, vehicle())) for drive in days(9)]
    assert half_width(answer_of_nine()) < 1.05 * min(alone)


def test_for_logs_at_one_load_another_load_is_recommended() -> None:
    answer = answer_of_nine()
    assert "another_load_would_help" in {finding.code for finding in answer.findings}
    assert "from these logs" in answer.words()


def test_a_log_without_evidence_is_no_step() -> None:
    """It has a minute, beside eight whole ones."""
    drives = [*days(8)]
    drives[3] = replace(drives[3], table=drives[3].table.head(6_000))
    assert oc.offset(drives, vehicle()).changes == ()


def test_a_last_log_that_alone_differs_is_not_valid_and_needs_one_more_drive() -> None:
    """Until a person states the calibration, or the next drive shows it."""
    dated = [replace(drive, table=drive.table.with_columns(pl.col("time_s") + MONDAY_S)) for drive in days(5)]
    logs, event = moved(tuple(dated[:4]), 3, -2.0), Event(MONDAY_S + 2.5 * DAY_S, "calibrated", -2.0 * DEGREE)
    answer = oc.offset(logs, vehicle())
    assert answer.offset.status == "converging"
    assert "drives_differ" in {finding.code for finding in answer.findings}
    assert str(answer).startswith("Undecided: drive once more"), str(answer)[:200]
    stated = oc.offset(logs, vehicle(), events=[event])
    decided = oc.offset(moved(tuple(dated), 3, -2.0), vehicle())
    for other in (stated, decided):
        assert other.offset.status == "valid" and other.offset.value is not None
        assert other.offset.value / DEGREE == pytest.approx(TRUTH_DEG - 2.0, abs=0.4)
        assert "drives_differ" not in {finding.code for finding in other.findings}


def test_a_former_truck_adds_nothing_to_the_present_one() -> None:
    both = moved(days(2), 1, 5.0)
    former, present = (replace(drive, start_s=MONDAY_S + day * DAY_S) for day, drive in enumerate(both))
    answer = oc.offset([former, present], vehicle(), events=[Event(MONDAY_S + 0.9 * DAY_S, "another_truck")])
    assert answer.offset == oc.offset(present, vehicle()).offset
    assert [drive.log for drive in answer.drives] == [present.log]


def test_an_event_beside_a_log_without_a_date_is_refused_in_one_line() -> None:
    with pytest.raises(oc.OncenterError, match=r"day0.parquet has no date.*calibrated@"):
        oc.offset(list(days(2)), vehicle(), events=[Event(MONDAY_S, "calibrated")])


def test_the_page_of_findings_quotes_what_several_logs_say() -> None:
    of_play = Change(1, "play", 10.0 * DEGREE, 3.0 * DEGREE, -7.0 * DEGREE, 0.3 * DEGREE, 1.0)
    assert example_on_page("drives_differ") == drives_differ([3.5 * DEGREE, 0.1 * DEGREE]).text
    assert example_on_page("play_changed") == play_changed(of_play, ["monday.asc"], ["tuesday.asc"]).text


def test_a_wrong_log_before_the_last_one_is_no_new_offset() -> None:
    drives = [*days(6)]
    drives[4] = moved(days(6), 0, 4.0)[4]
    answer = oc.offset(drives, vehicle())
    assert answer.changes == () and len(answer.drives) == 6
    assert answer.offset.value is not None
    assert answer.offset.value / DEGREE == pytest.approx(TRUTH_DEG, abs=0.4)


@pytest.mark.slow
def test_a_configured_pull_narrows_several_logs_and_is_subtracted_once() -> None:
    """The scenario's truck does not pull: a configured pull of 0.05 shifts the offset by i K 0.05."""
    answer = oc.offset(list(days(9)), vehicle(pull_m_s2=0.0, pull_sd_m_s2=0.01))
    without = answer_of_nine()
    wrong = oc.offset(list(days(9)), vehicle(pull_m_s2=0.05, pull_sd_m_s2=0.001))
    assert answer.offset.ci95 is not None and without.offset.ci95 is not None
    assert answer.offset.ci95[1] - answer.offset.ci95[0] < 0.7 * (without.offset.ci95[1] - without.offset.ci95[0])
    assert answer.offset.value is not None and wrong.offset.value is not None
    assert answer.offset.value / DEGREE == pytest.approx(TRUTH_DEG, abs=0.2)
    assert (answer.offset.value - wrong.offset.value) / DEGREE == pytest.approx(19.3 * 0.4 * 0.05, abs=0.15)
