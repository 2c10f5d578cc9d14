"""A drive's summary goes into its row and comes back; a row without one tells its truck nothing."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import pytest
from truck_rows import DAY_S, MONDAY_S, drive_row

from oncenter import _core
from oncenter.fleet.ranking import OfTruck, histories
from oncenter.fleet.summaries import COLUMNS, columns_of, params_of_drive, row_of_drive
from oncenter.signals import DEGREE
from oncenter.truck.events import Event
from oncenter.truck.now import truck_now
from oncenter.truck.priors import priors_of
from oncenter.truck.row import Row

ROW = drive_row(0.0, 1.7, neutral=0.05, with_play_deg2=-0.01, moved=0.01, moved_sd=0.002, logs=("0",))
REPLACED = Event(MONDAY_S + 4.0 * DAY_S, "another_truck")
NOTHING_KNOWN = _core.default_params()


def of_drive(row: Row, params: dict[str, float] = NOTHING_KNOWN, **more: Any) -> dict[str, Any]:
    """A drive as a row of the tables."""
    return {
        **columns_of(row, params),
        "offset_status": row.status,
        "start": row.start_s,
        "log": "0",
        "duration_s": row.length_s,
        "used_s": row.used_s,
        "side_force_left_s": row.left_s,
        "side_force_right_s": row.right_s,
        "offset_deg": 1.7,
        "offset_drive_sd_deg": 0.2,
        "offset_low_deg": 0.5,
        "offset_high_deg": 2.9,
        "evidence_enough": True,
        **more,
    }


def test_a_row_of_evidence_comes_back_from_its_columns() -> None:
    columns = columns_of(ROW, NOTHING_KNOWN)
    assert [name for name in columns if name.startswith("summary_")] == list(COLUMNS)
    assert columns["summary_standing_m_s2"] is None and columns["summary_ratio"] == 19.3
    assert columns["summary_moved_deg"] == pytest.approx(0.01 / DEGREE)
    back = row_of_drive(of_drive(ROW))
    assert back is not None
    for name in (field.name for field in fields(Row)):
        value, expected = getattr(back, name), getattr(ROW, name)
        if isinstance(expected, str | tuple | bytes):
            assert value == expected, name
        else:
            assert value == pytest.approx(expected, rel=1e-9, nan_ok=True), name


@pytest.mark.parametrize(
    "lacking",
    [
        {"offset_status": "unobservable"},
        {"offset_status": "invalid"},
        {"offset_status": None},
        {"start": None},
        {"summary_evidence": None},  # of a former version
        {"summary_gradient_deg_m_s2": None},
        {"summary_ratio": None},
    ],
)
def test_a_drive_without_information_on_its_truck_has_no_row(lacking: dict[str, Any]) -> None:
    assert row_of_drive(of_drive(ROW, **lacking)) is None


def test_a_truck_whose_rows_are_of_version_0_1_is_unknown_until_they_are_answered_anew() -> None:
    old = {
        "log": "a.parquet",
        "key": "a",
        "offset_deg": 3.0,
        "offset_sd_deg": 0.2,
        "offset_status": "valid",
        "start": MONDAY_S,
    }
    (history,) = histories([OfTruck("truck", [dict(old), dict(old)], 2.0)])
    assert history.truck["verdict"] == "undecided" and history.truck["told"] == 0 and history.changes == []
    assert history.truck.get("offset_deg") is None


def test_a_row_of_trucks_is_what_the_model_says_of_it_in_degrees() -> None:
    rows = [drive_row(day, 1.7 + 0.1 * (day % 2), neutral=0.05) for day in range(6)]
    history, alone = histories(
        [OfTruck("many", [of_drive(row) for row in rows], 2.0), OfTruck("one", [of_drive(rows[0])], 2.0)]
    )
    truck = truck_now(rows, (), priors_of())
    assert history.truck["offset_deg"] == pytest.approx(truck.offset / DEGREE)
    assert history.truck["pull_m_s2"] == pytest.approx(truck.pull)
    assert history.truck["backlash_deg"] == pytest.approx(truck.play / DEGREE)
    assert history.truck["load_would_help"] is True and history.truck["since"] == MONDAY_S
    assert history.truck["offset_is_valid"] is True
    assert (alone.truck["offset_low_deg"], alone.truck["offset_deg"]) == (pytest.approx(1.7 - 1.96 * 0.2), 1.7)


def test_a_truck_that_was_replaced_has_only_the_drives_since_then() -> None:
    """Its number of drives, newest fault, time and other quantities as well."""
    former = [of_drive(drive_row(day, 1.7), yaw_rate_bias_deg_s=0.5, yaw_rate_bias_sd_deg_s=0.01) for day in range(3)]
    former[-1] |= {"verdict": "repair", "yaw_rate_bias_status": "valid"}
    present = [of_drive(drive_row(day, 6.0, used_s=10.0)) for day in (5, 6)]
    for drives in (present, present[:0]):
        given = [OfTruck("truck", [*some, *drives], 2.0, (REPLACED,)) for some in (former, [])]
        with_former, alone = histories(given)
        assert with_former == alone


def test_changes_lead_from_each_offset_to_the_next() -> None:
    rows = [drive_row(day, 1.7 + 3.0 * (day >= 6) - 2.0 * (day >= 12)) for day in range(18)]
    (history,) = histories([OfTruck("truck", [of_drive(row) for row in rows], 2.0)])
    first, second = history.changes
    assert (first["by_drive"], second["by_drive"]) == (rows[6].start_s, rows[12].start_s)
    assert (first["after_drive"], second["after_drive"]) == (rows[5].start_s, rows[11].start_s)
    assert first["after"] == pytest.approx(second["before"])
    assert second["after"] == pytest.approx(history.truck["offset_deg"], abs=0.1)
    assert (first["size"], second["size"]) == (pytest.approx(3.0, abs=0.1), pytest.approx(-2.0, abs=0.1))
    assert history.truck["since"] == rows[12].start_s and history.truck["changes"] == 2


def test_a_repaired_play_is_a_change_of_the_play_and_the_cause_of_an_offset_that_changed_with_it() -> None:
    for offset, cause in ((0.0, None), (3.0, "play")):
        rows = [drive_row(day, offset * (day >= 4), play_deg=10.0 if day < 4 else 3.0) for day in range(8)]
        (history,) = histories([OfTruck("truck", [of_drive(row) for row in rows], 2.0)])
        play = history.changes[-1]
        assert (play["quantity"], play["unit"], play["by_drive"]) == ("backlash", "deg", rows[4].start_s)
        assert (play["before"], play["after"]) == (pytest.approx(10.0, abs=0.5), pytest.approx(3.0, abs=0.5))
        assert history.truck["backlash_deg"] == pytest.approx(3.0, abs=0.5) and history.truck["cause"] == cause
        assert history.truck["changes"] == len(history.changes) - 1


@pytest.mark.parametrize(("before", "after"), [(1, 3), (1, 6)])
def test_a_truck_that_was_calibrated_is_beyond_the_limit_it_reads_now(before: int, after: int) -> None:
    """Drives of -0.15 deg, then of -3.4: nothing between is right."""
    rows = [drive_row(day, -0.15 if day < before else -3.4, sds=(0.07, 0.3, 0.02)) for day in range(before + after)]
    (history,) = histories([OfTruck("truck", [of_drive(row) for row in rows], 2.0)])
    assert history.truck["verdict"] in ("recalibrate", "over")
    assert history.truck["offset_deg"] == pytest.approx(-3.4, abs=0.15)
    assert history.truck["since"] == rows[before].start_s


def test_two_drives_that_contradict_each_other_decide_nothing_until_a_calibration_is_stated() -> None:
    rows = [drive_row(0.0, 3.5, sds=(0.07, 0.3, 0.02)), drive_row(1.0, 0.1, sds=(0.07, 0.3, 0.02))]
    drives = [of_drive(row) for row in rows]
    (alone,) = histories([OfTruck("truck", drives, 2.0)])
    assert alone.truck["offset_is_valid"] is False and alone.truck["verdict"] != "recalibrate"
    stated = Event(MONDAY_S + 0.5 * DAY_S, "calibrated", -3.4 * DEGREE)
    (history,) = histories([OfTruck("truck", drives, 2.0, (stated,))])
    assert history.truck["offset_is_valid"] is True and history.truck["verdict"] == "within"
    assert history.truck["offset_deg"] == pytest.approx(0.1, abs=0.15)


def test_a_truck_does_not_depend_on_the_others_of_the_call() -> None:
    random = np.random.default_rng(3)
    fleet = [
        [of_drive(drive_row(day, random.normal(1.0, 0.2))) for day in range(int(random.integers(1, 9)))]
        for _ in range(12)
    ]
    together = list(histories([OfTruck(str(k), drives, 2.0) for k, drives in enumerate(fleet)]))
    for k, drives in enumerate(fleet):
        assert list(histories([OfTruck(str(k), drives, 2.0)])) == [together[k]]


def test_a_truck_s_model_has_the_spread_of_pulls_that_a_fleet_taught() -> None:
    learned = {**NOTHING_KNOWN, "pull_sd_m_s2": 0.02}
    drive = of_drive(ROW, learned)
    assert OfTruck("truck", [drive], 2.0).params == params_of_drive(drive) == learned
    assert priors_of(OfTruck("truck", [drive], 2.0).params).pull_sd_m_s2 == 0.02


def test_a_known_pull_is_taken_off_once() -> None:
    """A row's evidence is without what was known: the pull is in its neutral acceleration and in its offset."""
    known = {**NOTHING_KNOWN, "known_pull_m_s2": 0.15, "known_pull_sd_m_s2": 0.005}
    by_pull = 19.3 * 0.42 * 0.15  # deg
    rows = [drive_row(k, 1.7 + by_pull, neutral=0.15) for k in range(8)]
    (history,) = histories([OfTruck("truck", [of_drive(row, known) for row in rows], 2.0)])
    assert history.truck["offset_deg"] == pytest.approx(1.7, abs=0.05)
    assert history.truck["offset_sd_deg"] < 0.15
