"""The report: one page that says the answer first, tells the truth about what it does not know, and loads nothing."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import replace
from datetime import UTC, datetime
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, get_args

import numpy as np
import polars as pl
import pytest
from bokeh.models import Label, Line, Scatter, Segment, Span
from bokeh.plotting import figure
from hypothesis import given
from hypothesis import strategies as st

import oncenter
from oncenter import _core
from oncenter.errors import OncenterError
from oncenter.estimates.estimate import Estimate
from oncenter.estimates.estimates import DEFAULT_METHOD, Method
from oncenter.live import words
from oncenter.offset.answer import Answer
from oncenter.offset.run import outputs_of
from oncenter.report import document
from oncenter.report.canvas import plain
from oncenter.report.course import Course, course
from oncenter.report.origin import Origin, origin_of
from oncenter.report.page import page
from oncenter.report.plots import STRIP_NAMES, figures
from oncenter.report.thin import broken_at_holes, extremes
from oncenter.report.verdict_part import verdict_header
from oncenter.signals import DEGREE, Signals
from oncenter.verdict import STATES, About, Verdict

TRUCK = oncenter.vehicle("scania_r730_4x2")
PARKING_S = 15  # the thesis drive's first seconds are too slow to tell anything


class Parsed(HTMLParser):
    """What a browser would find: tags with attributes, the text a reader sees, and the style sheets."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.visible = self.style = ""
        self._inside = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self._inside = tag

    def handle_endtag(self, tag: str) -> None:
        self._inside = ""

    def handle_data(self, data: str) -> None:
        if self._inside == "style":
            self.style += data
        elif self._inside != "script":
            self.visible += data


def answer_to(*drives: Signals, method: Method = DEFAULT_METHOD, **params: float) -> Answer:
    return oncenter.offset(list(drives), TRUCK, method=method, params=params)


def page_of(answer: Answer) -> str:
    """With usual spaces."""
    return page(answer, outputs_of(answer)).replace("\N{NO-BREAK SPACE}", " ")


def course_of(answer: Answer) -> Course:
    return course(answer, outputs_of(answer))


@pytest.fixture(scope="module")
def drive() -> Signals:
    return oncenter.simulate("thesis_drive", seed=1)[0]


@pytest.fixture(scope="module")
def answer(drive: Signals) -> Answer:
    return answer_to(drive)


@pytest.fixture(scope="module")
def text(answer: Answer) -> str:
    return page_of(answer)


@pytest.fixture(scope="module")
def parking(drive: Signals) -> Answer:
    return answer_to(replace(drive, table=drive.table[: int(PARKING_S * drive.rate_hz)]))


def parts(drive: Signals, *slices: slice) -> list[Signals]:
    return [replace(drive, table=drive.table[part]) for part in slices]


def test_the_page_loads_nothing_from_anywhere(text: str) -> None:
    found = Parsed(text)
    loading = ("src", "href", "srcset", "data", "poster", "action", "background", "xlink:href")
    assert [a[name] for _, a in found.tags for name in loading if name in a] == []
    assert "url(" not in found.style and "@import" not in found.style
    policies = [a["content"] for tag, a in found.tags if tag == "meta" and a.get("http-equiv")]
    assert len(policies) == 1 and "default-src 'none'" in str(policies[0]) and "http" not in str(policies[0])


def test_a_reader_meets_verdict_and_action_before_anything_else(answer: Answer, text: str) -> None:
    header = text[text.index("<header") : text.index("</header>")]
    assert text.index("<header") == text.index("<main>") + len("<main>\n")
    assert '<span class="state undecided"><i aria-hidden="true">?</i> Undecided</span>' in header
    assert "<h1>Straight-ahead offset +2.0 deg ± 0.1 is too close to the limit of 2 deg to decide.</h1>" in header
    assert '<p class="action">Log another drive, and give both logs to oncenter together.</p>' in header
    for finding in answer.findings:
        assert finding.text[1:].replace("+-", "±") in Parsed(text).visible


def test_every_state_is_a_word_and_not_a_colour_alone(answer: Answer) -> None:
    for state in STATES:
        for about in get_args(About):
            header = Parsed(verdict_header([Verdict(about, state, "A headline.", "An action.")] * 2, "a truck")).visible
            assert len(re.findall(r"[A-Z][a-zA-Z ]+", header)) >= 4  # the state's word, the headline and the action


def test_the_other_verdicts_stand_below_it_with_what_to_do_where_something_is_to_do(answer: Answer) -> None:
    play = Estimate(17.0 * DEGREE, (16.5 * DEGREE, 17.5 * DEGREE), "valid", "rad")
    visible = " ".join(Parsed(page_of(replace(answer, backlash=play))).visible.split())
    assert (
        "! Repair Free play: Free play 17.0 deg ± 0.5 (maintenance limit of free play: 15 deg). Look for worn joints"
        in visible
    )
    assert "✓ OK Accelerometer: No fault found. Truck and drive" in visible


def rows_of(text: str) -> dict[str, str]:
    """The rows of the table about truck and drive on the screen."""
    section = text[text.index('<section class="truck">') :]
    rows = re.findall(r'<tr><th scope="row">(.*?)</th><td>(.*?)</td></tr>', section[: section.index("print-only")])
    return {name: re.sub("</?time>", "", value).replace("\N{NO-BREAK SPACE}", " ") for name, value in rows}


def test_the_page_says_which_truck_when_and_how_far_and_not_where(answer: Answer, drive: Signals) -> None:
    first = pl.col("time_s") == pl.col("time_s").first()
    position = (
        pl.when(first).then(58.1).otherwise(-58.2).alias("latitude_deg"),
        pl.lit(-11.25).alias("longitude_deg"),
    )
    speed = pl.when(first).then(float("nan")).otherwise(pl.col("vehicle_speed_m_s")).alias("vehicle_speed_m_s")
    there = replace(drive, table=drive.table.with_columns(*position, speed))
    origin = Origin(
        "YS2R4X20001234567", datetime(2026, 3, 1, 7, 5, tzinfo=UTC), "anna", datetime(2026, 3, 2, tzinfo=UTC)
    )
    known = replace(answer, drives=(there,))
    rows = rows_of(page(known, outputs_of(known), origin))
    driven_km = np.nansum(there.table["vehicle_speed_m_s"].to_numpy()) / drive.rate_hz / 1000
    assert rows["VIN"] == "YS2R4X20001234567" and rows["Vehicle"] == TRUCK.name
    assert rows["Truck data"] == ("wheelbase 3.7 m, steering ratio near the centre 19.3, axles 4x2, limit 2 deg")
    assert rows["Vehicle file"] == "scania_r730_4x2" and rows["Start"] == "2026-03-01 07:05 UTC"
    assert "Place" not in rows and "11.25" not in str(rows)
    assert rows["Driven"] == f"{driven_km:.1f} km in 30 min 0 s"
    assert rows["Report"] == f"oncenter {oncenter.__version__} by anna, 2026-03-02 00:00 UTC"


def test_a_page_leaves_out_what_no_log_has(answer: Answer, text: str) -> None:
    assert not {"VIN", "Start"} & set(rows_of(text))


def test_in_print_there_are_lines_for_what_no_log_has_and_for_a_signature(answer: Answer) -> None:
    vin = page(answer, outputs_of(answer), Origin("YS2R4X20001234567"))
    left = ["Plate, if other", "Mileage"]
    for text, names in ((page_of(answer), ["VIN", *left, "Start"]), (vin, [*left, "Start"])):
        by_hand = text[text.index('<div class="print-only">') : text.index("</section>")]
        assert re.findall(r'<th scope="row">([\w, ]+)</th><td><span class="line"></span></td>', by_hand) == names
        assert re.findall(r'<span class="line"></span><br>([\w, ]+)', by_hand) == ["Place, date", "Name, signature"]


def test_a_file_is_asked_for_the_truck_and_the_start_that_its_signals_lack(drive: Signals, tmp_path: Path) -> None:
    file = tmp_path / "drive.parquet"
    known = {"vin": "YS2R4X20001234567", "start_time": "2026-03-01T07:05:00Z"}
    drive.table[:2000].write_parquet(file, metadata=known)
    origin = origin_of([oncenter.read(file)])
    assert origin.vin == "YS2R4X20001234567" and origin.start == datetime(2026, 3, 1, 7, 5, tzinfo=UTC)
    assert origin.written is not None and abs((datetime.now(UTC) - origin.written).total_seconds()) < 60.0
    in_memory = origin_of([replace(drive, log="no such file")])
    assert (in_memory.vin, in_memory.start) == (None, None)
    on_the_clock = drive.table.with_columns(pl.col("time_s") + 1.7e9)
    assert origin_of([replace(drive, table=on_the_clock)]).start == datetime.fromtimestamp(1.7e9, UTC)


def test_the_terms_of_the_figures_are_explained_with_a_drawing_each(text: str) -> None:
    found = Parsed(text)
    drawings = [a["aria-label"] for tag, a in found.tags if tag == "svg"]
    assert drawings == ["Free play", "Flank of the play", "Neutral lateral acceleration"]


def test_the_page_names_what_produced_it(answer: Answer, text: str) -> None:
    visible = Parsed(text).visible
    for said in (answer.log, TRUCK.name, f"oncenter {oncenter.__version__}", "offset_half_width_max_deg", "3.7 m"):
        assert said in visible
    assert all(source in visible for source in answer.sources.values())


def test_every_picture_has_its_place_in_every_answer(drive: Signals, answer: Answer, parking: Answer) -> None:
    [minute] = parts(drive, slice(60000, 66000))
    nothing = Estimate(None, None, "unobservable", "rad")
    zero = Estimate(0.0, (-0.001, 0.001), "valid", "rad/(m/s^2)")
    for one in (
        answer,
        parking,
        answer_to(minute),
        replace(answer, understeer_gradient=nothing),
        replace(answer, offset=nothing),
        replace(answer_to(minute), offset=answer.offset, understeer_gradient=zero),
    ):
        text = page_of(one)
        places = {a.get("id") for tag, a in Parsed(text).tags if tag == "div"}
        [render_items] = re.findall(r"render_items = (\[.*\]);", text)
        assert set(json.loads(render_items)[0]["roots"].values()) <= places


def test_an_unobservable_quantity_is_a_dash_with_its_status_in_words(parking: Answer) -> None:
    assert parking.offset.value is None
    text = page_of(parking)
    visible = Parsed(text).visible
    assert '<th scope="row">Straight-ahead offset</th><td class="number">—' in text
    assert "unobservable" in visible and "not observable in this drive" in visible
    assert re.search(r"\b(nan|inf|None)\b", visible, re.IGNORECASE) is None


def lines_of(picture: figure) -> list[Line]:
    return [renderer.glyph for renderer in picture.renderers if isinstance(renderer.glyph, Line)]


def test_the_play_is_drawn_as_two_lines_as_far_apart_as_it_is_wide(answer: Answer) -> None:
    """The simulator's truth: 3 deg."""
    upper, lower = (r for r in figures(answer, course_of(answer))["cloud"].renderers if isinstance(r.glyph, Line))
    apart = np.asarray(upper.data_source.data["y"]) - np.asarray(lower.data_source.data["y"])
    assert apart == pytest.approx([3.0, 3.0], abs=0.2)


def test_points_lie_on_the_flank_of_their_colour(answer: Answer) -> None:
    drive = course_of(answer)
    assert answer.offset.value is not None and answer.backlash.value is not None
    slope = TRUCK.ratio_near_centre * (answer.understeer_gradient.value or 0.0)
    side_force = drive.filtered_lateral_acceleration - drive.unloading_acceleration
    left_over = drive.residual - (answer.offset.value + slope * side_force) / DEGREE
    for flank in (1.0, -1.0):
        there = drive.used & (drive.place * flank > 0.95)
        assert there.sum() > 1000
        assert left_over[there].mean() == pytest.approx(flank * 0.5 * answer.backlash.value / DEGREE, abs=0.2)


def test_offset_and_neutral_acceleration_are_drawn_between_the_flanks(answer: Answer) -> None:
    drive = course_of(answer)
    cross, of_drive = [r for r in figures(answer, drive)["cloud"].renderers if isinstance(r.glyph, Segment)]
    x, y, x_end, y_end = (np.asarray(cross.data_source.data[name]) for name in ("x0", "y0", "x1", "y1"))
    assert answer.offset.ci95 is not None and answer.unloading_acceleration.ci95 is not None
    assert (x[0], x_end[0]) == (drive.unloading_acceleration,) * 2
    assert (y[0], y_end[0]) == pytest.approx([bound / DEGREE for bound in answer.offset.ci95])
    assert (x[1], x_end[1]) == pytest.approx(answer.unloading_acceleration.ci95)
    ends = (of_drive.data_source.data[name][0] for name in ("y0", "y1"))
    assert tuple(ends) == pytest.approx([bound / DEGREE for bound in answer.offset_ci95_drive])


def test_the_page_gives_both_parts_of_the_offsets_interval_with_what_was_assumed(answer: Answer, text: str) -> None:
    visible = Parsed(text).visible
    of_drive = answer.offset_half_width_rad / DEGREE
    assert f"from this drive, without a pull± {of_drive:.2f}" in visible
    pull = answer.not_identifiable[0]
    assert f"by a pull, not identifiable from one drive± {1.96 * pull.sd_rad / DEGREE:.2f}" in visible
    assert "assumed: 0.05 m/s²" in visible
    drive = course_of(answer)
    assert drive.offset_half_width_drive[-1] == pytest.approx(of_drive, rel=1e-3)


def test_a_page_of_a_method_that_does_not_separate_the_parts_speaks_of_one_interval(drive: Signals) -> None:
    visible = Parsed(page_of(answer_to(drive, method="thesis"))).visible
    assert "from this drive" not in visible and "inner band" not in visible


def test_the_tools_of_a_picture_stand_above_its_data_and_take_none_of_its_height() -> None:
    with_tools, without = plain(200, "pan,reset"), plain(200, "")
    assert not with_tools.toolbar_inner and with_tools.toolbar_location == "above"
    assert with_tools.height > without.height == 200


def limits_drawn(picture: Any) -> list[tuple[float, str]]:
    lines = [item.location for item in picture.center if isinstance(item, Span) and item.dimension == "width"]
    return list(zip(lines, (item.text for item in picture.center if isinstance(item, Label)), strict=True))


def test_the_limits_are_drawn_with_their_numbers_unless_they_would_squash_the_course(answer: Answer) -> None:
    """The offset is 2.0 deg, ± 0.8 at the end."""
    within, drive = {}, course_of(answer)
    for limit_deg in (1.0, 3.0, 20.0):
        truck = TRUCK.model_copy(update={"offset_limit_deg": limit_deg})
        judged = replace(answer, vehicle=truck)
        picture = figures(judged, drive)["offset"]
        within[limit_deg] = limits_drawn(picture)
        height = picture.y_range
        assert height.end - height.start < 12.0
    assert within == {
        1.0: [(-1.0, "limit −1 deg"), (1.0, "limit +1 deg")],
        3.0: [(-3.0, "limit −3 deg"), (3.0, "limit +3 deg")],
        20.0: [],
    }
    assert "limit ±20 deg, outside the picture" in page_of(judged)


def test_a_change_is_marked_where_it_came_and_the_cloud_is_of_what_came_after(drive: Signals) -> None:
    jump = pl.when(pl.col("time_s") > 900.0).then(-5.0 * DEGREE).otherwise(0.0)
    remounted = replace(drive, table=drive.table.with_columns(pl.col("steering_wheel_angle_rad") + jump))
    first, second = parts(remounted, slice(0, 60000), slice(60000, None))
    changed = answer_to(first, second)
    there = course_of(changed)
    drawn = figures(changed, there)
    marks = [item.location for item in drawn["offset"].center if isinstance(item, Span)]
    pause = there.starts[1] - 10.0
    assert 15.0 + pause == pytest.approx(there.changes[0], abs=0.2)
    assert there.changes[0] in marks
    points = [r for r in drawn["cloud"].renderers if isinstance(r.glyph, Scatter)]
    after = there.residual[there.time > 15.0 + pause - 0.2].astype(np.float32)
    assert np.isin(np.concatenate([r.data_source.data["y"] for r in points[:3]]), after).all()
    assert "since the offset last changed" in Parsed(page_of(changed)).visible


def test_a_bias_that_moves_is_drawn_and_one_that_stays_is_a_number(answer: Answer) -> None:
    moving = answer_to(oncenter.simulate("drifting_gyro", seed=1)[0])
    assert "yaw_rate_bias" in figures(moving, course_of(moving))
    assert "yaw_rate_bias" not in figures(answer, course_of(answer))


def test_every_reason_of_the_gate_has_a_row_and_a_meaning(answer: Answer) -> None:
    assert set(STRIP_NAMES) == set(_core.REASONS)
    rejected = dict.fromkeys(_core.REASONS, 10.0)
    visible = Parsed(page_of(replace(answer, rejected_s=rejected))).visible
    assert all(name in visible for name in STRIP_NAMES.values())


def test_the_thesiss_page_draws_its_mean_and_its_line(drive: Signals) -> None:
    thesis = answer_to(drive, method="thesis")
    cloud = figures(thesis, course_of(thesis))["cloud"]
    assert len(lines_of(cloud)) == 1
    assert "Not clean for 2 s on end" in Parsed(page_of(thesis)).visible
    used = course_of(thesis).used.sum() / drive.rate_hz
    assert used == pytest.approx(thesis.used_s, rel=0.02)


def test_the_picture_of_the_angle_contains_the_largest_one_of_fast_driving(answer: Answer) -> None:
    drive = course_of(answer)
    assert drive.measured is not None
    measured = np.where(
        np.arange(len(drive.time)) == np.flatnonzero(np.isfinite(drive.expected))[500], 300.0, drive.measured
    )
    assert figures(answer, replace(drive, measured=measured))["angle"].y_range.end > 300.0


def test_a_drive_without_a_clean_tick_still_gives_a_page_that_says_so(parking: Answer) -> None:
    pictures = figures(parking, course_of(parking))
    assert {"angle", "gate"} <= set(pictures) and not {"offset", "cloud", "bends", "understeer"} & set(pictures)
    assert "no tick passed the gate" in Parsed(page_of(parking)).visible


def test_a_drive_without_an_accelerometer_gives_a_page(drive: Signals) -> None:
    table = drive.table[:60000].drop("lateral_acceleration_m_s2")
    without = answer_to(replace(drive, table=table), use_accelerometer=0)
    assert "in place of an accelerometer" in Parsed(page_of(without)).visible


def test_the_strip_says_used_where_the_core_used(drive: Signals) -> None:
    three = answer_to(*parts(drive, slice(0, 45000), slice(60000, 90000), slice(95000, None)))
    used = course_of(three).used
    assert used.sum() / drive.rate_hz == pytest.approx(three.used_s, rel=0.005)
    assert not used[course_of(three).reasons != 0].any()


def test_the_strip_of_two_seconds_has_no_gaps(drive: Signals) -> None:
    short = answer_to(replace(drive, table=drive.table.head(int(2 * drive.rate_hz))))
    gate = figures(short, course_of(short))["gate"]
    grounds, _, too_slow, *_ = [strip.data_source.data for strip in gate.renderers]
    for strip in (grounds, too_slow):
        assert set(strip["left"]) == {0.0}
        assert set(strip["right"]) == {np.float32(gate.x_range.end)}


def test_the_course_ends_at_the_answer_in_degrees(answer: Answer) -> None:
    drive = course_of(answer)
    assert answer.offset.value is not None and answer.offset.ci95 is not None
    assert drive.offset[-1] == pytest.approx(answer.offset.value / DEGREE)
    # the trace's interval is as of the last final block; the answer's knows of the standstill behind it, too
    interval = tuple(bound / DEGREE for bound in answer.offset.ci95)
    assert (drive.offset_low[-1], drive.offset_high[-1]) == pytest.approx(interval, rel=0.02)


def test_the_expected_angle_is_the_measured_one_less_the_offset(answer: Answer) -> None:
    drive = course_of(answer)
    assert drive.measured is not None
    gap = (drive.measured - drive.expected)[drive.used]
    assert float(gap.mean()) == pytest.approx(answer.offset.value / DEGREE, abs=0.1)  # type: ignore[operator]


def test_several_drives_follow_each_other_in_driving_time(drive: Signals) -> None:
    first, second = parts(drive, slice(0, 30000), slice(90000, 120000))
    both = course_of(answer_to(first, second))
    assert np.all(np.diff(both.time) > 0) and len(both.starts) == 2
    assert both.time[-1] == pytest.approx(10.0, rel=0.03)  # minutes, though 15 lie between them on the clock
    assert 30000 in both.holes


def test_a_relative_sensor_is_drawn_without_whole_turns_once_they_are_identified(drive: Signals) -> None:
    angle = pl.col("steering_wheel_angle_rad")
    relative = pl.lit(0.0).alias("steering_wheel_angle_sensor_type")
    there = course_of(answer_to(replace(drive, table=drive.table.with_columns(angle - 720.0 * DEGREE, relative))))
    assert there.measured is not None
    known = np.isfinite(there.measured)
    first = int(np.argmax(known))
    assert known[first:].all() and 0.5 < first / drive.rate_hz < 60.0  # once it drives
    table = drive.table.with_columns(pl.when(pl.Series(known)).then(angle).otherwise(float("nan")))
    here = course_of(answer_to(replace(drive, table=table)))
    assert here.measured is not None and np.allclose(there.measured, here.measured, atol=1e-6, equal_nan=True)
    assert np.allclose(there.residual[there.used], here.residual[there.used], atol=1e-6)
    assert there.offset[-1] == pytest.approx(here.offset[-1], abs=1e-6)


@pytest.mark.slow
def test_three_hours_make_no_larger_page_than_half_an_hour(drive: Signals, text: str) -> None:
    table = pl.concat([drive.table] * 6)
    long = replace(drive, table=table.with_columns(pl.Series("time_s", np.arange(table.height) / drive.rate_hz)))
    size = len(page_of(answer_to(long)).encode())
    assert size < 4e6 and size < 1.2 * len(text.encode())


def test_a_minute_is_drawn_tick_by_tick_in_seconds(drive: Signals) -> None:
    [minute] = parts(drive, slice(60000, 60000 + int(20 * drive.rate_hz)))
    short = course_of(answer_to(minute))
    assert short.time_unit == "s" and short.time[-1] == pytest.approx(20.0, abs=0.1)
    assert len(extremes(short.residual, 1200)) == len(short.time)


@given(
    st.lists(st.one_of(st.floats(-1e6, 1e6), st.just(float("nan"))), min_size=1, max_size=400),
    st.integers(1, 40),
)
def test_thinning_keeps_the_highest_and_the_lowest_and_the_order(values: list[float], bins: int) -> None:
    series = np.array(values)
    rows = extremes(series, bins)
    assert np.all(np.diff(rows) > 0) and len(rows) <= max(2 * bins, 1)
    if np.isfinite(series).any():
        assert np.nanmax(series[rows]) == np.nanmax(series) and np.nanmin(series[rows]) == np.nanmin(series)


def test_no_line_bridges_a_hole() -> None:
    x = np.concatenate([np.arange(100.0), np.arange(200.0, 300.0)])
    rows = np.arange(0, 200, 7)
    at, columns = broken_at_holes(x, rows, np.array([100]), {"y": np.ones(200)})
    joined = np.isfinite(columns["y"][1:]) & np.isfinite(columns["y"][:-1])
    assert np.diff(at)[joined].max() < 50 and np.all(np.diff(at) > 0)


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("the gyro is off", "The gyro is off."),
        ("understeer-like: no", "Understeer-like: no."),
        ("s_remounted.log and b.log overlap", "s_remounted.log and b.log overlap."),
        ("logs/a.csv is given twice", "logs/a.csv is given twice."),
        ("yaw_rate: 3 samples", "yaw_rate: 3 samples."),
        ("", "."),
    ],
)
def test_a_sentence_begins_with_a_capital_but_a_name_stays_as_it_is(text: str, shown: str) -> None:
    assert document.sentence(text) == words.sentence(text) == shown


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("offset +2.3 deg ± 0.2 (limit 2 deg).", "offset +2.3_deg_±_0.2 (limit 2_deg)."),
        ("bias -0.14 deg/s +- 0.02, 95 % of 12 min 5 s", "bias −0.14_deg/s_±_0.02, 95_% of 12_min 5_s"),
        ("2 metres, 3 drives, at ±0.1", "2 metres, 3 drives, at_±0.1"),
    ],
)
def test_no_line_ends_within_a_number_with_its_unit(text: str, shown: str) -> None:
    assert document.typeset(text).replace("\N{NO-BREAK SPACE}", "_") == shown


def test_the_written_file_is_the_page(parking: Answer, tmp_path: Path) -> None:
    file = tmp_path / "drive.html"
    oncenter.report(parking, file)
    assert file.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")


def test_a_path_that_cannot_be_written_is_wrong_usage_in_one_line(parking: Answer, tmp_path: Path) -> None:
    with pytest.raises(OncenterError) as refused:
        oncenter.report(parking, tmp_path / "no" / "such" / "folder.html")
    assert refused.value.exit_code == 2 and "folder.html" in str(refused.value) and "\n" not in str(refused.value)


def test_bokeh_is_not_loaded_before_a_report_is_asked_for() -> None:
    program = "import sys, oncenter; oncenter.report; sys.exit('bokeh' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
