"""The page of `oncenter app` in a browser: from the drop to the saved PDF, with each kind of log, and for everybody."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from asammdf import MDF, Signal
from browser import note_errors
from test_app import Page, served
from test_app_drives import DIFFERS, with_rows
from test_live_page import PARAMS, session_of

import oncenter as oc
from oncenter.fleet.page import Contents, write_page
from oncenter.fleet.page_data import PageData
from oncenter.live.web import Page as LivePage
from oncenter.signals import DEGREE
from oncenter.simulate import simulate_to_log
from oncenter.verdict.states import OF_OFFSET

pytestmark = pytest.mark.browser

CHANGED = "Something was changed: estimate again."
EXAMPLE = "scania_r730_4x2"
DRIVES = ("mid_speed_manoeuvre", "hard_turn", "step_steer")  # of two minutes
GRAVE = ("serious", "critical")  # of axe's impacts
WIDTH, PHONE = 1280, 400  # px
CHANNELS = {  # of the MF4, by column: unit, and its size in SI
    "steering_wheel_angle_rad": ("SteeringWheelAngle", "deg", DEGREE),
    "yaw_rate_rad_s": ("YawRate", "deg/s", DEGREE),
    "vehicle_speed_m_s": ("VehicleSpeed", "km/h", 1.0 / 3.6),
    "lateral_acceleration_m_s2": ("LateralAcceleration", "m/s2", 1.0),
}


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The drives as Parquet, and the first as .asc, as MF4 with named channels and as CSV with decimal commas."""
    folder = tmp_path_factory.mktemp("logs")
    for name in DRIVES:
        simulate_to_log(name, 1, folder / f"{name}.parquet")
    simulate_to_log(DRIVES[0], 1, folder / "drive.asc")
    table = pl.read_parquet(folder / f"{DRIVES[0]}.parquet")
    table.write_csv(folder / "drive.csv", separator=";", decimal_comma=True)
    time_s = table["time_s"].to_numpy() - table["time_s"][0]
    with MDF() as mdf:
        for column, (name, unit, size) in CHANNELS.items():
            mdf.append(Signal(table[column].to_numpy() / size, time_s, name=name, unit=unit))
        mdf.save(folder / "drive.mf4")
    return folder


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    with served(tmp_path_factory.mktemp("app") / "trucks") as page:
        yield page


@pytest.fixture
def opened(page: Page, browser: Any) -> Iterator[Any]:
    """The page in a window; its scripts make no error."""
    faults: list[str] = []
    with browser.new_context(viewport={"width": WIDTH, "height": 900}) as context:
        context.set_default_timeout(60_000)  # ms; a busy machine
        view = context.new_page()
        note_errors(view, faults)
        view.on("dialog", lambda dialog: dialog.accept())
        view.goto(f"http://127.0.0.1:{page.port}/?key={page.key}")
        yield view
    assert faults == []


def drop(view: Any, *logs: Path) -> None:
    view.set_input_files("#files", logs)
    view.wait_for_selector(f"#logs li:has-text('ready') >> nth={len(logs) - 1}")


def answer(view: Any) -> str:
    view.click("#begin")
    view.wait_for_selector("#answer .verdict, #answer .wrong")
    return str(view.text_content("#answer .verdict h3"))


def saved(view: Any) -> bytes:
    with view.expect_download() as download:
        view.click("#answer >> text=Save as PDF")
    return Path(download.value.path()).read_bytes()


def keep_truck(view: Any, name: str) -> None:
    view.click("#other summary")
    for field, written in {"name": name, "wheelbase_m": "3700 mm", "steering_ratio": "19,3 : 1"}.items():
        view.fill(f"#{field}", written)
    view.check("[name=axle_layout][value='4x2']")
    view.click("form button")
    view.wait_for_selector("#signals:not([hidden]), #other:not([open])")
    if view.is_visible("#keep"):  # the names of its log
        view.click("#keep")
    view.wait_for_selector("#other:not([open])")


def serious(view: Any) -> list[str]:
    """The serious barriers that axe finds, by rule and place."""
    from axe_playwright_python.sync_playwright import Axe  # of the browser's tests alone, as playwright is

    found = Axe().run(view).response["violations"]
    return [f"{each['id']}: {each['nodes'][0]['html'][:120]}" for each in found if each["impact"] in GRAVE]


def barriers_of(view: Any) -> list[str]:
    """At a desk by day and on a telephone at night, where a page that is wider than the telephone is one, too."""
    found = []
    for scheme, width in (("dark", PHONE), ("light", WIDTH)):
        view.emulate_media(color_scheme=scheme)
        view.set_viewport_size({"width": width, "height": 900})
        found += [f"{scheme}, {width} px: {fault}" for fault in serious(view)]
        if view.evaluate("document.documentElement.scrollWidth") > width:
            found.append(f"wider than {width} px")
    return found


# axe takes seconds a page: the journey is one of the gate, the search for barriers on its way one of the night.
AT_NIGHT = pytest.mark.parametrize(
    "barriers", [lambda view: [], pytest.param(barriers_of, marks=pytest.mark.slow)], ids=["journey", "barriers"]
)


@pytest.mark.parametrize("files", [["drive.asc"], [f"{name}.parquet" for name in DRIVES]], ids=["asc", "three"])
def test_logs_of_an_example_truck_become_a_pdf(opened: Any, logs: Path, files: Sequence[str]) -> None:
    opened.select_option("#truck", EXAMPLE)
    drop(opened, *(logs / name for name in files))
    assert "bends" in answer(opened)
    assert saved(opened).startswith(b"%PDF")
    assert "not kept" in opened.text_content("#drives")


@pytest.mark.parametrize("file", ["drive.mf4", "drive.csv"])
def test_a_log_with_names_of_its_own_becomes_a_pdf(opened: Any, logs: Path, file: str) -> None:
    drop(opened, logs / file)
    keep_truck(opened, file)
    assert "bends" in answer(opened)
    assert saved(opened).startswith(b"%PDF")


@AT_NIGHT
def test_before_and_after_become_a_certificate_without_barriers(
    opened: Any, logs: Path, barriers: Callable[[Any], list[str]]
) -> None:
    keep_truck(opened, "M-AB 12")
    for name in DRIVES[:2]:
        drop(opened, logs / f"{name}.parquet")
        answer(opened)
        assert opened.text_content("#answer .verdict small") == f"M-AB 12 · {name}.parquet"
        assert opened.locator("#answer select").count() == (name == DRIVES[1])  # no drive before the first one
        opened.wait_for_selector(f"#drives >> text={name}")
        if name == DRIVES[0]:
            opened.click("text=Another log")
    opened.click("#other summary")
    opened.fill("#wheelbase_m", "12")
    opened.press("#wheelbase_m", "Tab")
    opened.wait_for_selector("text=trucks have 2.5 to 8 m")
    assert barriers(opened) == []
    with opened.context.expect_page() as report:
        opened.click("#answer >> text=Open the report")
    report.value.wait_for_selector("canvas")
    assert barriers(report.value) == []
    opened.click("button:has-text('Before and after')")
    opened.wait_for_selector("text=Open the certificate")
    assert opened.is_visible("text=Open the report")
    with opened.expect_download() as download:
        opened.click("#answer [aria-live] >> text=Save as PDF")
    assert Path(download.value.path()).read_bytes().startswith(b"%PDF")
    with opened.context.expect_page() as certificate:
        opened.click("text=Open the certificate")
    certificate.value.wait_for_selector("text=signature")
    assert barriers(certificate.value) == []
    opened.click("[aria-label^='forget: ']")
    opened.wait_for_selector("#drives li >> nth=1", state="detached")
    opened.click("text=Forget this truck")
    opened.wait_for_selector("#drives:empty", state="attached")
    assert opened.text_content("#answer") == CHANGED  # it was of the truck that is gone


@AT_NIGHT
def test_a_drive_that_differs_is_asked_about_and_the_answer_counts(
    opened: Any, page: Page, tmp_path: Path, barriers: Callable[[Any], list[str]]
) -> None:
    name = tmp_path.name
    keep_truck(opened, name)
    folder = page.trucks / "drives" / name
    folder.mkdir(parents=True)
    with_rows(folder, DIFFERS, oc.vehicle(page.trucks / f"{name}.toml"))
    opened.reload()
    opened.select_option("#truck", name)
    opened.wait_for_selector("text=Was something done to the truck")
    assert barriers(opened) == []
    opened.click("text=The sensor was calibrated")
    opened.wait_for_selector("#drives h3:has-text('Done to the truck')")
    assert "Within the limit" in opened.text_content("#drives") and not opened.is_visible("text=Was something done")
    assert barriers(opened) == []
    opened.click("[aria-label$='The sensor was calibrated']")
    opened.wait_for_selector("text=Was something done to the truck")


@AT_NIGHT
def test_a_failure_says_what_to_do_and_has_a_way_back(
    opened: Any, tmp_path: Path, barriers: Callable[[Any], list[str]]
) -> None:
    (tmp_path / "empty.csv").write_text("time_s,speed\n1,2\n", encoding="utf-8")
    (tmp_path / "network.dbc").write_text("VERSION", encoding="utf-8")
    opened.select_option("#truck", EXAMPLE)
    drop(opened, tmp_path / "empty.csv")
    opened.click("#begin")
    opened.wait_for_selector("text=empty.csv")
    opened.click("#answer summary")
    opened.wait_for_selector(".explained p:has-text('What it means')")
    assert barriers(opened) == []
    assert not re.search(r"--\w|\[signals\]", opened.text_content("#answer .wrong"))
    opened.click("summary:has-text('Limit and correction')")
    opened.fill("#applied", "2")
    opened.press("#applied", "Tab")
    assert opened.text_content("#answer") == CHANGED  # it was without this correction
    opened.click("#begin")
    opened.wait_for_selector("#answer .wrong")
    opened.set_input_files("#files", tmp_path / "network.dbc")
    opened.wait_for_selector("text=network.dbc: this describes a network")
    assert opened.evaluate("document.getElementById('databases').files[0].name") == "network.dbc"
    opened.click("text=Start again")
    assert opened.evaluate("document.activeElement.id") == "files"
    assert opened.input_value("#applied") == "" and opened.input_value("#databases") == ""
    assert opened.locator("#logs li").count() == 0 and opened.text_content("#answer") == ""


def test_an_unknown_truck_is_answered_by_the_keyboard_alone(opened: Any, logs: Path) -> None:
    keys = opened.keyboard

    def tab_to(selector: str) -> None:
        for _ in range(40):
            if opened.evaluate(f"document.activeElement.matches({selector!r})"):
                return
            keys.press("Tab")
        raise AssertionError(f"no way to {selector} by Tab")

    tab_to("#files")
    with opened.expect_file_chooser() as chooser:
        keys.press("Space")
    chooser.value.set_files(logs / "drive.asc")
    opened.wait_for_selector("text=ready")
    tab_to("#truck")
    keys.type("I don")
    tab_to("#begin")
    keys.press("Enter")
    opened.wait_for_selector("#answer .verdict")
    assert opened.evaluate("document.activeElement.id") == "begin"
    tab_to("#answer button")
    with opened.expect_download() as download:
        keys.press("Enter")
    assert Path(download.value.path()).read_bytes().startswith(b"%PDF")
    tab_to("[download='oncenter.csv']")
    with opened.expect_download() as table:
        keys.press("Enter")
    assert re.search(rb"offset,-?\d", Path(table.value.path()).read_bytes())


@pytest.mark.slow
def test_the_pages_of_a_fleet_and_of_a_bus_have_no_barriers(browser: Any, logs: Path, tmp_path: Path) -> None:
    offset = {"offset_deg": 2.2, "offset_sd_deg": 0.3, "offset_low_deg": 1.9, "offset_high_deg": 2.5}
    row = offset | {"p_value": 0.04, "q_value": 0.2, "second_line": None, "would_decide": "another drive"}
    row |= {"first_drive": 1.77e9, "last_drive": 1.77e9, "since": 1.77e9, "limit_deg": 2.0, "watch": True}
    trucks = [
        row | {"truck": f"{k}", "rank": k, "state": state, "verdict": state} for k, state in enumerate(OF_OFFSET, 1)
    ]
    write_page(tmp_path / "index.html", Contents(trucks, [], 5, {"no_speed": 3}, PageData(len(trucks))))
    with browser.new_page() as fleet:
        fleet.goto((tmp_path / "index.html").as_uri())
        assert barriers_of(fleet) == []
    session = session_of(logs / "drive.asc", 1.0)
    with LivePage(session, PARAMS, "127.0.0.1", 0, print) as live, browser.new_page() as view:
        view.goto(live.url)
        session.start()
        view.wait_for_selector("#truck:not(:empty)")
        assert barriers_of(view) == []
        session.stop()
        session.join()
