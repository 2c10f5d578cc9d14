"""A drive's summary goes into its row and comes back; a row without one tells its truck nothing."""

from __future__ import annotations

import math
from dataclasses import astuple, fields, replace
from typing import Any

import numpy as np
import pytest

from oncenter import _core
from oncenter.fleet.offset_now import offset_of
from oncenter.fleet.ranking import OfTruck, histories
from oncenter.fleet.summaries import COLUMNS, columns_of, summary_of_row
from oncenter.signals import DEGREE
from oncenter.truck.drives import Summary, together
from oncenter.truck.model import learn
from oncenter.truck.priors import priors_of

SUMMARY = Summary(
    offset=0.03,
    offset_sd=0.002,
    gradient=0.4 * DEGREE,
    gradient_sd=0.02 * DEGREE,
    unloading=0.05,
    unloading_sd=0.01,
    play=0.1,
    play_sd=0.004,
    with_unloading=1e-6,
    with_play=-2e-6,
    bank=0.2,
    standing=math.nan,
    ratio=19.3,
    side=1.0,
)
NOTHING_KNOWN = _core.default_params()
OF_OFFSET = {"offset_status": "valid", "start": 1.7e9}


def test_a_summary_comes_back_from_its_columns() -> None:
    columns = columns_of(SUMMARY, NOTHING_KNOWN)
    assert list(columns) == list(COLUMNS) and len(columns) == len(fields(Summary)) + 5
    assert columns["summary_standing_m_s2"] is None and columns["summary_play_deg"] == pytest.approx(0.1 / DEGREE)
    back = summary_of_row({**columns, **OF_OFFSET})
    assert back is not None and math.isnan(back.standing)
    assert astuple(replace(back, standing=0.0)) == pytest.approx(astuple(replace(SUMMARY, standing=0.0)))


@pytest.mark.parametrize(
    "lacking",
    [
        {"offset_status": "unobservable"},
        {"offset_status": "invalid"},
        {"offset_status": None},
        {"start": None},
        {"summary_gradient_deg_m_s2": 0.05},  # play passes for a gradient
        {"summary_gradient_deg_m_s2": None},  # of version 0.1
        {"summary_ratio": None},
    ],
)
def test_a_drive_without_information_on_its_truck_has_no_summary(lacking: dict[str, Any]) -> None:
    assert summary_of_row({**columns_of(SUMMARY, NOTHING_KNOWN), **OF_OFFSET, **lacking}) is None


def test_a_truck_whose_rows_are_of_version_0_1_is_unknown_until_they_are_answered_anew() -> None:
    old = {"log": "a.parquet", "key": "a", "offset_deg": 3.0, "offset_sd_deg": 0.2, **OF_OFFSET}
    (history,) = histories([OfTruck("truck", [dict(old), dict(old)], 2.0)])
    assert history.truck["verdict"] == "undecided" and history.truck["told"] == 0 and history.changes == []
    assert history.truck.get("offset_deg") is None


def test_a_row_of_trucks_is_what_the_model_says_of_it_in_degrees() -> None:
    rows = [
        {**columns_of(SUMMARY, NOTHING_KNOWN), **OF_OFFSET, "start": 1.7e9 + 86400.0 * day, "log": str(day)}
        for day in range(6)
    ]
    history, alone = histories([OfTruck("many", rows, 2.0), OfTruck("one", rows[:1], 2.0)])
    model = learn(together([[SUMMARY] * 6]), priors_of())
    assert history.truck["offset_deg"] == pytest.approx(model.offset[0] / DEGREE)
    assert history.truck["pull_m_s2"] == pytest.approx(model.pull[0])
    assert history.truck["load_would_help"] is True and history.truck["since"] == 1.7e9
    assert alone.truck["offset_sd_deg"] > history.truck["offset_sd_deg"]


def test_changes_lead_from_each_offset_to_the_next() -> None:
    drives = [
        replace(SUMMARY, offset=0.03 + 3.0 * DEGREE * (day >= 6) - 2.0 * DEGREE * (day >= 12)) for day in range(18)
    ]
    model = learn(together([drives]), priors_of())
    offset = offset_of(model, 0, 1.7e9 + 86400.0 * np.arange(18), [{}] * 18)
    first, second = offset.changes
    assert (first.at, second.at) == (6, 12)
    assert first.after == pytest.approx(second.before) and second.after == pytest.approx(offset.value)
    assert (first.size, second.size) == (pytest.approx(3.0, abs=0.1), pytest.approx(-2.0, abs=0.1))
    assert offset.since == 1.7e9 + 86400.0 * 12


def test_a_truck_s_model_has_the_spread_of_pulls_that_a_fleet_taught() -> None:
    learned = {**NOTHING_KNOWN, "pull_sd_m_s2": 0.02}
    row = {**columns_of(SUMMARY, learned), **OF_OFFSET}
    assert OfTruck("truck", [row], 2.0).priors == priors_of(learned)
    del row["summary_pull_sd_m_s2"]  # of a version before
    assert OfTruck("truck", [row], 2.0).priors == priors_of()


def test_a_known_pull_is_taken_off_once() -> None:
    """The core took it off the offset; a summary's accelerations are less what is known, and its sd is the prior's."""
    known = {**NOTHING_KNOWN, "known_pull_m_s2": 0.15, "known_pull_sd_m_s2": 0.005}
    rows = [
        {**columns_of(replace(SUMMARY, unloading=0.0, bank=0.2), known), **OF_OFFSET, "start": 1.7e9 + k}
        for k in range(8)
    ]
    (history,) = histories([OfTruck("truck", rows, 2.0)])
    assert history.truck["offset_deg"] == pytest.approx(SUMMARY.offset / DEGREE, abs=0.05)
    assert history.truck["offset_sd_deg"] < 0.15
