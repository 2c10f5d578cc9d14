"""The pages that oncenter writes, opened in a browser: no error, no request to the network, every picture drawn, and
nothing wider than a telephone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import browser as browsing
import polars as pl
import pytest
from browser import faults_of
from two_trucks import DAY_S, MONDAY_S, VIN

import oncenter as oc
from oncenter.fleet.page import Contents, write_page
from oncenter.fleet.page_data import PageData
from oncenter.report import report, report_angle
from oncenter.signals import DEGREE, Signals
from oncenter.thesis import write
from oncenter.verdict.states import OF_OFFSET

pytestmark = pytest.mark.browser

TRUCK = oc.vehicle("scania_r730_4x2")


@pytest.fixture(scope="module")
def drive() -> Signals:
    return oc.simulate("thesis_drive", seed=1)[0]


def test_each_kind_of_fault_is_named(browser: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(browsing, "_LOOKS", 1)
    page = tmp_path / "page.html"
    page.write_text(
        '<meta name="viewport" content="width=device-width"><p data-root-id="p1" id="figure-1">Nothing</p>'
        '<img src="http://192.0.2.77/x.png"><svg aria-label="empty"></svg>'
        '<p id="wide" style="width: 500px">Wide</p><script>console.error("said"); undefined_function()</script>'
    )
    faults = "\n".join(faults_of(browser, page.as_uri()))
    for fault in (
        "page error: undefined_function is not defined",
        "console: said",
        "request to the network: http://192.0.2.77/x.png",
        "1280 px, light: figure figure-1 is blank",
        "1280 px, dark: SVG empty is blank",
        "400 px, light: image http://192.0.2.77/x.png is missing",
        '400 px, dark: wider than the window: <p id="wide"',
    ):
        assert fault in faults
    assert "1280 px, dark: wider" not in faults


def test_the_page_of_a_fleet_draws_each_picture_and_the_truck_that_a_reader_names(
    browser: Any, undisturbed: Path
) -> None:
    def name_a_truck(page: Any) -> None:
        page.fill("#name", VIN)
        page.press("#name", "Enter")
        page.wait_for_selector("#history:not([hidden])")
        assert "6 drives, 6 with an offset" in page.text_content("#summary")
        assert page.locator("#drives tbody tr").count() == 6
        assert page.locator("#changes tbody tr").count() == 1

    assert faults_of(browser, (undisturbed / "index.html").as_uri(), name_a_truck) == []


def test_a_fleet_with_trucks_of_each_state_and_long_names_fits_a_telephone(browser: Any, tmp_path: Path) -> None:
    drives = {"first_drive": MONDAY_S, "last_drive": MONDAY_S + DAY_S, "since": MONDAY_S}
    offset = {"offset_deg": 2.2, "offset_sd_deg": 0.3, "p_value": 0.04, "q_value": 0.2, "limit_deg": 2.0}
    trucks = [
        {
            "truck": f"truck {k} of the northern depot, line 7",
            "rank": k,
            "state": state,
            "verdict": state,
            "watch": True,
        }
        | drives
        | {"second_line": "A pull could add ± 0.8 deg.", "offset_low_deg": 1.9, "offset_high_deg": 2.5}
        | {"would_decide": "another drive with bends both ways"}
        | (offset if state != "no_offset" else {"limit_deg": 2.0})
        for k, state in enumerate(OF_OFFSET, 1)
    ]
    write_page(tmp_path / "index.html", Contents(trucks, [], 5, {"no_speed": 3}, PageData(len(trucks))))
    assert faults_of(browser, (tmp_path / "index.html").as_uri()) == []


def test_the_report_of_a_drive_and_of_two_seconds_of_parking_draw_each_picture(
    browser: Any, drive: Signals, tmp_path: Path
) -> None:
    page = tmp_path / "report.html"
    for signals in (drive, replace(drive, table=drive.table.head(200))):
        report(oc.offset(signals, TRUCK), page)
        assert faults_of(browser, page.as_uri()) == []


def test_the_page_of_an_angle_without_its_sensor_draws_each_picture(
    browser: Any, drive: Signals, tmp_path: Path
) -> None:
    page = tmp_path / "angle.html"
    time, angle = pl.col("time_s"), pl.col("steering_wheel_angle_rad")
    jumped = drive.table.head(90_000).with_columns(angle + 40.0 * DEGREE * (time - time.first() >= 700.0))
    signals = replace(drive, table=jumped)
    report_angle(oc.angle(signals, TRUCK, sensor_lost_at=800.0), signals, TRUCK, page, sensor_lost_at=800.0)
    assert faults_of(browser, page.as_uri()) == []


def test_the_page_of_the_thesis_draws_each_figure(browser: Any, tmp_path: Path) -> None:
    page = write(tmp_path, groups={"schematics": 1.0, "geometry": 1.0, "tables": 1.0})
    assert faults_of(browser, page.as_uri()) == []
