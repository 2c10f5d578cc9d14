"""The report as PDF: two A4 pages with the figures drawn, or one line that says what is lacking."""

from __future__ import annotations

import os
import re
import shutil
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest
from test_estimate import steady_drive

import oncenter as oc
from oncenter.cli import run
from oncenter.errors import OncenterError
from oncenter.report import browser

TRUCK = "scania_r730_4x2"


def pages_of(pdf: bytes) -> int:
    return len(re.findall(rb"/Type\s*/Page\b", pdf))


def stand_in(folder: Path, script: str) -> Path:
    """A program that is started as the browser is."""
    program = folder / "chromium"
    program.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    return program


@pytest.mark.browser
def test_a_report_prints_on_two_a4_pages_with_its_figures(tmp_path: Path) -> None:
    log, pdf = tmp_path / "drive.log", tmp_path / "drive.pdf"
    assert run(["simulate", "bypass", "--output", str(log)]) == 0  # Bokeh's empty elements made a third page
    assert run(["offset", str(log), "--vehicle", TRUCK, "--report", str(pdf)]) == 0
    printed = pdf.read_bytes()
    assert pages_of(printed) == 2
    [box] = set(re.findall(rb"/MediaBox\s*\[([^\]]*)\]", printed))
    width, height = (float(number) / 72 * 25.4 for number in box.split()[2:])
    assert (width, height) == (pytest.approx(210, abs=1), pytest.approx(297, abs=1))
    assert b"/Subtype /Image" in printed or b"/Subtype/Image" in printed  # the figures, drawn by script
    assert sorted(path.name for path in tmp_path.iterdir() if path.suffix in (".pdf", "") or path.is_dir()) == [
        "drive.pdf"
    ]


@pytest.mark.browser
@pytest.mark.skipif(shutil.which("pdftotext") is None, reason="no pdftotext on this machine (poppler-utils)")
def test_the_first_page_has_verdict_truck_and_numbers_and_the_second_the_figures(tmp_path: Path) -> None:
    truck = oc.vehicle(TRUCK).model_copy(update={"offset_limit_deg": 3.0})
    oc.report(oc.offset(oc.simulate("heavy_play", seed=1)[0], truck), tmp_path / "x.pdf")
    text = subprocess.run(["pdftotext", "-layout", tmp_path / "x.pdf", "-"], capture_output=True, check=True).stdout
    first, second, *_ = text.decode().split("\f")
    for said in (
        "Within the limit",
        "Straight-ahead offset +1.9 deg",
        "free play",
        "Log another drive",
        "Vehicle",
        "Findings",
    ):
        assert said in first, said
    assert all(by_hand in first for by_hand in ("VIN", "Plate", "Mileage", "Name, signature"))
    assert "page 1 of 2" in first and "page 2 of 2" in second and "Flank of the play" in second
    assert "Provenance" not in text.decode() and "The gate" not in text.decode()


def test_without_a_browser_one_line_says_what_to_install_before_any_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(browser, "find_browser", lambda: None)
    assert run(["offset", "none.log", "--vehicle", TRUCK, "--report", str(tmp_path / "x.pdf")]) == 1
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "x.pdf needs Chromium, Chrome or Edge" in err and "write the page x.html" in err


def test_a_browser_is_looked_for_on_path_and_then_at_its_usual_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = tmp_path / "msedge"
    monkeypatch.setattr(browser, "_usual_places", lambda: iter((tmp_path / "none", place)))
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert browser.find_browser() is None
    place.touch()
    assert browser.find_browser() == place
    monkeypatch.setattr(shutil, "which", lambda name: "/bin/chrome" if name == "google-chrome" else None)
    assert browser.find_browser() == Path("/bin/chrome")


@pytest.mark.parametrize(
    ("platform", "last_parts"),
    [("win32", "Microsoft/Edge/Application/msedge.exe"), ("darwin", "Google Chrome.app/Contents/MacOS/Google Chrome")],
)
def test_windows_and_macos_have_their_usual_places(
    platform: str, last_parts: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.setenv("PROGRAMFILES", "/programs")
    places = [place.as_posix().replace("\\", "/") for place in browser._usual_places()]
    assert any(place.endswith(last_parts) for place in places)


@pytest.mark.posix  # the stand-in for a browser is a shell script
def test_a_browser_that_hangs_is_stopped_with_its_children_and_named(tmp_path: Path) -> None:
    hanging = stand_in(tmp_path, f"sleep 300 & echo $! > {tmp_path}/child; wait")
    begun = time.monotonic()
    with pytest.raises(OncenterError) as refused:
        browser.pdf_of("<p>", hanging, tmp_path / "x.pdf", timeout_s=0.5)
    assert time.monotonic() - begun < 10.0
    assert str(refused.value) == (
        f"cannot print {tmp_path / 'x.pdf'}: chromium did not end within 0.5 s; write the page x.html instead, which "
        "any browser prints"
    )
    with pytest.raises(ProcessLookupError):
        for _ in range(100):
            os.kill(int((tmp_path / "child").read_text()), 0)
            time.sleep(0.02)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["child", "chromium"]


@pytest.mark.posix  # the stand-in for a browser is a shell script
@pytest.mark.parametrize(("script", "why"), [("exit 3", "ended with code 3"), ("exit 0", "wrote no PDF")])
def test_a_browser_that_fails_is_named_in_one_line(script: str, why: str, tmp_path: Path) -> None:
    with pytest.raises(OncenterError, match=f"chromium {why}; write the page x.html") as refused:
        browser.pdf_of("<p>", stand_in(tmp_path, script), tmp_path / "x.pdf")
    assert (refused.value.code, refused.value.exit_code) == ("browser", 1)


@pytest.mark.posix  # the stand-in for a browser is a shell script
def test_the_sandbox_is_left_out_for_root_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said = stand_in(tmp_path, f'echo "$@" > {tmp_path}/options')
    for user, is_left_out in ((0, True), (1000, False)):
        monkeypatch.setattr(os, "geteuid", lambda user=user: user)
        with pytest.raises(OncenterError):
            browser.pdf_of("<p>", said, tmp_path / "x.pdf")
        assert ("--no-sandbox" in (tmp_path / "options").read_text()) is is_left_out


def test_a_report_in_html_needs_no_browser(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(browser, "find_browser", lambda: None)
    oc.report(oc.offset(steady_drive(), oc.vehicle(TRUCK)), tmp_path / "x.html")
    assert (tmp_path / "x.html").read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
