"""A log that has holes, or a signal that is not there at its ends, is answered and says so in seconds."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from planted_faults import RATE_HZ, TRUCK, drive, without

import oncenter as oc
from oncenter.cli import run
from oncenter.findings import Finding
from oncenter.plausibility import check
from oncenter.plausibility.recording import recorded
from oncenter.signals import SIGNALS, Signals

VEHICLE = "wheelbase_m = 3.7\nsteering_ratio = 19.3\ntrack_width_rear_m = 1.83\n"
NEEDED = ("steering_wheel_angle", "yaw_rate", "vehicle_speed", "lateral_acceleration")


def cut(signals: Signals, name: str, *, late_s: float = 0.0, early_s: float = 0.0) -> Signals:
    """A signal that begins late or ends early."""
    time = signals.table["time_s"].to_numpy()
    silent = (time < time[0] + late_s - 1e-6) | (time > time[-1] - early_s + 1e-6)
    column = SIGNALS[name].column
    values = np.where(silent, np.nan, signals.table[column].to_numpy())
    return replace(signals, table=signals.table.with_columns(pl.Series(column, values)))


NOT_USED = "That time is not used; the offset is not affected"


def test_a_signal_that_is_absent_for_a_good_part_of_the_log_affects_the_offset() -> None:
    (found,) = of_code(check(cut(drive(), "yaw_rate", early_s=60.0), TRUCK).findings, "signal_ended_early")
    assert "The offset uses only the time with this signal" in found.text and "not affected" not in found.text


def with_holes(signals: Signals, every_s: float, length_s: float) -> Signals:
    """The signals without the last `length_s` of each `every_s` seconds."""
    since = (pl.col("time_s") - pl.col("time_s").first()) % every_s
    return replace(signals, table=signals.table.filter(since < every_s - length_s))


def of_code(findings: tuple[Finding, ...], code: str) -> list[Finding]:
    return [finding for finding in findings if finding.code == code]


@pytest.mark.parametrize(("early_s", "written"), [(0.16, "0.16"), (1.0, "1.0")])
@pytest.mark.parametrize("name", NEEDED)
def test_a_signal_that_ends_before_its_log_is_reported_in_seconds(name: str, early_s: float, written: str) -> None:
    ended = cut(drive(), name, early_s=early_s)
    for findings in (check(ended, TRUCK).findings, oc.offset(ended, TRUCK).findings):
        (found,) = of_code(findings, "signal_ended_early")
        assert (
            found.text == f"the {name.replace('_', ' ')} signal stops {written} s before the end of the log. {NOT_USED}"
        )
        assert (found.severity, found.unit) == ("info", "s")
        assert found.value == pytest.approx(early_s)


def test_a_signal_that_begins_after_its_log_is_reported_with_its_seconds() -> None:
    late = cut(drive(), "yaw_rate", late_s=2.0)
    for findings in (check(late, TRUCK).findings, oc.offset(late, TRUCK).findings):
        (found,) = of_code(findings, "signal_began_late")
        assert found.text == f"the yaw rate signal starts 2.0 s after the start of the log. {NOT_USED}"


def test_a_slow_signal_that_ends_within_its_period_is_no_finding() -> None:
    signals = cut(drive(), "vehicle_speed", early_s=0.2)
    slow = {**signals.sources, "vehicle_speed": replace(signals.sources["vehicle_speed"], rate_hz=10.0)}
    assert not of_code(check(replace(signals, sources=slow), TRUCK).findings, "signal_ended_early")


def test_an_unnecessary_signal_that_ends_early_is_no_finding() -> None:
    ended = cut(drive(), "wheel_speed_front_left", early_s=5.0)
    assert not of_code(oc.offset(ended, TRUCK).findings, "signal_ended_early")


def test_a_log_without_gaps_has_no_finding_on_them() -> None:
    signals = drive()
    assert recorded(signals).holes_s == ()
    assert not of_code(check(signals, TRUCK).findings, "recording_has_holes")
    assert not of_code(oc.offset(signals, TRUCK).findings, "recording_has_holes")


def test_a_log_with_gaps_is_reported_with_its_recorded_time() -> None:
    holed = with_holes(drive(duration_s=1300.0), 40.0, 10.0)
    for findings in (check(holed, TRUCK).findings, oc.offset(holed, TRUCK).findings):
        (found,) = of_code(findings, "recording_has_holes")
        assert found.text == (
            "16 of 22 minutes are recorded; there are 32 gaps of up to 10 s. The offset uses the recorded time only. "
            "Check the logger"
        )
        assert found.severity == "warning"
        assert found.value == pytest.approx(320.0)


def test_rows_without_a_number_are_not_recorded() -> None:
    signals = without(drive(), *(name for name in drive().sources if name not in NEEDED))
    time = signals.table["time_s"].to_numpy()
    for name in NEEDED:
        values = signals.table[SIGNALS[name].column].to_numpy().copy()
        values[(time > 100.0) & (time < 104.0)] = np.nan
        signals = replace(signals, table=signals.table.with_columns(pl.Series(SIGNALS[name].column, values)))
    (hole_s,) = recorded(signals).holes_s
    assert hole_s == pytest.approx(4.0, abs=2 / RATE_HZ)


def test_the_log_with_the_gap_is_named_among_several() -> None:
    whole = replace(drive(), log="a/whole.csv")
    later = pl.col("time_s") + 1000.0
    holed = replace(whole, table=with_holes(whole, 400.0, 150.0).table.with_columns(later), log="a/holed.csv")
    holed = replace(holed, table=holed.table.filter((pl.col("time_s") < 1100.0) | (pl.col("time_s") > 1150.0)))
    (found,) = of_code(oc.offset([whole, holed], TRUCK).findings, "recording_has_holes")
    assert found.text.startswith("holed.csv: 3.3 of 4.2 minutes are recorded")


def test_the_command_line_reports_gaps_in_words_and_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    holed = cut(with_holes(drive(duration_s=600.0), 40.0, 10.0), "steering_wheel_angle", early_s=1.0)
    log, truck = tmp_path / "drive.csv", tmp_path / "truck.toml"
    holed.table.write_csv(log)
    truck.write_text(VEHICLE)
    for verb in ("signals", "offset"):
        said = printed([verb, str(log), "--vehicle", str(truck)], capsys)
        assert "7.5 of 9.8 minutes are recorded; there are 14 gaps of up to 10 s" in said
        assert "steering wheel angle signal stops 1.0 s before the end of the log" in said
        codes = {
            each["code"]
            for each in json.loads(printed([verb, str(log), "--vehicle", str(truck), "--json"], capsys))["findings"]
        }
        assert {"recording_has_holes", "signal_ended_early"} <= codes
    words = printed(["signals", str(log)], capsys)
    assert " 24%  " in next(line for line in words.splitlines() if line.startswith("yaw_rate"))
    whole = json.loads(printed(["signals", str(log), "--json"], capsys))
    assert whole["holes"] == 14 and whole["recorded_s"] == pytest.approx(450.0, abs=1.0)


def printed(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    capsys.readouterr()
    assert run(arguments) == 0
    return capsys.readouterr().out


def test_the_report_has_the_finding(tmp_path: Path) -> None:
    oc.report(oc.offset(cut(drive(), "steering_wheel_angle", early_s=1.0), TRUCK), tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")
    assert "teering wheel angle signal stops 1.0 s before the end of the log" in page
