"""The page of an angle without its sensor: what it says is what was found, and it loads nothing."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import oncenter as oc
from oncenter.cli import run
from oncenter.report.angle_course import angle_course
from oncenter.report.angle_page import angle_page
from oncenter.report.angle_plots import angle_figures
from oncenter.signals import DEGREE, Signals

TRUCK = oc.vehicle("scania_r730_4x2")
LOST_S, JUMPED_S = 600.0, 700.0


@pytest.fixture(scope="module")
def drive() -> Signals:
    signals, _ = oc.simulate("thesis_drive", 3)
    return replace(signals, table=signals.table.head(90_000))


def page_of(signals: Signals, lost_at: float | None = None) -> str:
    course = angle_course(oc.angle(signals, TRUCK, sensor_lost_at=lost_at), signals, lost_at, None)
    return angle_page(course, signals, TRUCK, "observer", False)


def jumped(signals: Signals) -> Signals:
    measured = signals.table["steering_wheel_angle_rad"].to_numpy()
    off = np.where(np.arange(len(measured)) >= 100 * JUMPED_S, 40.0 * DEGREE, 0.0)
    return replace(signals, table=signals.table.with_columns(steering_wheel_angle_rad=pl.Series(measured + off)))


def test_the_page_loads_nothing_and_every_picture_has_its_place(drive: Signals) -> None:
    blind = replace(drive, table=drive.table.drop("steering_wheel_angle_rad"))
    short = replace(drive, table=drive.table.head(300))
    for signals, lost_at, pictures in (
        (drive, LOST_S, 5),
        (drive, None, 4),
        (jumped(drive), None, 5),
        (blind, None, 1),
    ):
        text = page_of(signals, lost_at)
        [render_items] = re.findall(r"render_items = (\[.*\]);", text)
        places = set(json.loads(render_items)[0]["roots"].values())
        assert len(places) == pictures
        assert all(f'id="{place}"' in text for place in places)
        assert not re.search(r"<(script|link|img)[^>]*(src|href)=", text)
        assert "default-src 'none'" in text
    assert "NaN" not in re.sub(r"<script.*?</script>", "", page_of(short), flags=re.DOTALL)


def test_names_from_a_log_stay_text(drive: Signals) -> None:
    nasty = "<img src=http://x/y>\"'&.log"
    sources = {name: replace(source, description=nasty) for name, source in drive.sources.items()}
    short = replace(drive, table=drive.table.head(3000), sources=sources, log=nasty)
    text = page_of(short)
    assert "<img src=http" not in text
    assert text.count("&lt;img src=http") >= len(sources) + 1  # each source, and the log


def test_the_figures_are_those_of_the_table(drive: Signals) -> None:
    table = oc.angle(drive, TRUCK, sensor_lost_at=LOST_S)
    course = angle_course(table, drive, LOST_S, None)
    assert course.error is not None
    fast = course.without_sensor & (course.speed > 8.0)
    assert np.flatnonzero(fast)[0] == 100 * LOST_S
    known = oc.angle(drive, TRUCK)
    offset = (known["measured_rad"] - known["steering_wheel_angle_rad"])[100 * round(LOST_S) - 1]
    expected = (table["steering_wheel_angle_rad"] - table["measured_rad"]).to_numpy()[fast] + offset
    error_deg = np.sqrt(np.mean(course.error[fast] ** 2))
    assert error_deg == pytest.approx(np.sqrt(np.mean(expected**2)) / DEGREE, rel=0.1)
    assert f"{error_deg:.2f} deg" in page_of(drive, LOST_S)


def test_the_picture_of_the_angle_contains_the_largest_one(drive: Signals) -> None:
    table = oc.angle(drive, TRUCK)
    turn = table["time_s"].is_between(500.0, 500.5)  # less than 0.1 % of the drive
    table = table.with_columns(steering_wheel_angle_rad=pl.col("steering_wheel_angle_rad") + 300.0 * DEGREE * turn)
    course = angle_course(table, drive, None, None)
    shown = angle_figures(course)["angle"].y_range
    assert shown.start < np.nanmin(course.angle) and np.nanmax(course.angle) < shown.end


def test_a_fault_is_reported_in_words_with_its_time(drive: Signals) -> None:
    text = page_of(jumped(drive))
    assert f"The sensor jumped at {JUMPED_S:.1f} s" in text
    assert "nothing was found wrong" in page_of(drive)


def test_the_command_writes_the_page_and_refuses_where_it_cannot(drive: Signals, tmp_path: Path) -> None:
    log, page = tmp_path / "drive.parquet", tmp_path / "out.html"
    drive.table.head(20_000).write_parquet(log)
    arguments = ["angle", str(log), "--vehicle", "scania_r730_4x2", "--report"]
    assert run([*arguments, str(page)]) == 0
    assert page.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert run([*arguments, str(tmp_path / "nowhere" / "out.html")]) == 2
