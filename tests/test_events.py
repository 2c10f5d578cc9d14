"""Events between a truck's drives: how a person states them, and how a fleet keeps them."""

from __future__ import annotations

import pytest

from oncenter.errors import OncenterError
from oncenter.signals import DEGREE
from oncenter.truck.events import Event, parse_event, with_stated

MONDAY_S = 1_772_409_600.0  # 2026-03-02, 0:00 UTC


@pytest.mark.parametrize(
    ("text", "event"),
    [
        ("calibrated@2026-03-02", Event(MONDAY_S, "calibrated", None)),
        ("calibrated@2026-03-02T07:00=-3.4", Event(MONDAY_S + 7 * 3600.0, "calibrated", -3.4 * DEGREE)),
        ("calibrated@2026-03-02T07:00:00Z=0", Event(MONDAY_S + 7 * 3600.0, "calibrated", 0.0)),
        ("repaired@2026-03-02T07:00+01:00", Event(MONDAY_S + 6 * 3600.0, "repaired", None)),
        ("changed@20260302", Event(MONDAY_S, "changed", None)),
        ("another_truck@2026-03-02 00:00", Event(MONDAY_S, "another_truck", None)),
    ],
)
def test_an_event_is_a_kind_a_date_and_of_a_calibration_the_angle_that_it_added(text: str, event: Event) -> None:
    assert parse_event(text) == event == parse_event(str(event))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "'' is no event: write KIND@DATE"),
        ("calibrated", "'calibrated' is no event: write KIND@DATE"),
        ("mended@2026-03-02", "'mended' is no kind of event: calibrated, repaired, changed, another_truck"),
        ("calibrated@", "'' is no date: write 2026-03-02"),
        ("calibrated@2.3.2026", "'2.3.2026' is no date: write 2026-03-02"),
        ("calibrated@0001-01-01T00:00+14:00", "is no date"),
        ("calibrated@1969-12-31", "write a year from 1970 to 9891"),
        ("calibrated@9999-12-31", "is no date of a drive"),
        ("calibrated@2026-03-02=3,4", "'3,4' in 'calibrated@2026-03-02=3,4' is not a number of degrees"),
        ("calibrated@2026-03-02=", "'' in 'calibrated@2026-03-02=' is not a number of degrees"),
        ("calibrated@2026-03-02=nan", "a calibration adds -720 to 720 deg, got nan"),
        ("calibrated@2026-03-02=-1e9", "a calibration adds -720 to 720 deg, got -1e+09"),
        ("repaired@2026-03-02=1", "an angle of 1 deg was given with 'repaired': only 'calibrated' adds one"),
    ],
)
def test_what_is_no_event_is_refused_in_one_line_with_the_form(text: str, why: str) -> None:
    with pytest.raises(OncenterError) as refused:
        parse_event(text)
    assert why in str(refused.value) and "\n" not in str(refused.value)
    assert (refused.value.code, refused.value.exit_code) == ("usage", 2)


def test_events_are_in_order_of_time_and_kind_and_a_new_one_replaces_one_of_the_same_kind_and_time() -> None:
    first, other = Event(MONDAY_S, "calibrated", 0.1), Event(MONDAY_S, "repaired")
    earlier, corrected = Event(MONDAY_S - 1.0, "repaired"), Event(MONDAY_S, "calibrated", 0.2)
    assert with_stated((other, first), (earlier,)) == with_stated((first,), (other, earlier)) == (earlier, first, other)
    assert with_stated((first, other), (corrected,)) == (corrected, other)
