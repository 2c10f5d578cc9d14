"""What a night leaves for people and machines in the morning: words, an exit code, numbers, tables in any form."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import os
import re
import shutil
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from two_trucks import VIN

from oncenter.cli import run as command
from oncenter.errors import OncenterError
from oncenter.fleet import night as fleet_night
from oncenter.fleet import run
from oncenter.fleet.ledger import LEDGER, Ledger
from oncenter.fleet.listing import as_lines
from oncenter.fleet.metrics import as_prometheus, write_metrics
from oncenter.fleet.news import KINDS, keep_for_next_night, news_of

pytestmark = pytest.mark.usefixtures("answered_here")
Arguments = list[str]


@pytest.fixture
def night(fleet: Path, tmp_path: Path) -> Arguments:
    """A command line over two logs of depot-7, of which one is none."""
    folder = tmp_path / "logs" / "depot-7"
    folder.mkdir(parents=True)
    shutil.copy(fleet / "logs" / "depot-7" / "day0.parquet", folder)
    (folder / "broken.parquet").write_bytes(b"PAR1 and then nothing")
    vehicles, output = str(fleet / "vehicles"), str(tmp_path / "out")
    return ["fleet", "run", str(tmp_path / "logs"), "--vehicles", vehicles, "--output", output]


def test_a_night_names_each_log_without_an_answer_with_its_reason_and_marks_new_ones(
    night: Arguments, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = tmp_path / "logs" / "depot-7" / "broken.parquet"
    assert command(night) == 0
    first = capsys.readouterr().out
    assert f"unreadable_log  {broken}\n" in first and "cannot read broken.parquet: the file is damaged" in first
    assert "new since last night" not in first  # there was none
    assert command(night) == 0
    again = capsys.readouterr().out
    assert f"unreadable_log  {broken}\n" in again and "new since last night: nothing" in again
    broken.with_name("another.parquet").write_bytes(b"PAR1 and then nothing else")
    assert command(night) == 0
    out = capsys.readouterr().out
    assert "1 log without an answer is new" in out and "another.parquet  (new)" in out and f"{broken}\n" in out


def test_a_night_says_which_trucks_and_verdicts_are_new(
    fleet: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["fleet", "run", str(fleet / "logs" / "depot-7"), "--vehicles", str(fleet / "vehicles")]
    arguments += ["--output", str(tmp_path)]
    assert command(arguments) == 0
    capsys.readouterr()
    arguments[2] = str(fleet / "logs")
    assert command([*arguments, "--limit", "0.5"]) == 0
    out = capsys.readouterr().out
    assert "new since last night:\n  depot-7: Within the limit → Undecided\n" in out and f"  {VIN}: new truck\n" in out


def ranked(**verdicts: str) -> list[dict[str, Any]]:
    """Rows of trucks by name and verdict; `watch` after it."""
    return [
        {"truck": truck, "state": verdict.split()[0], "watch": verdict.endswith("watch")}
        for truck, verdict in verdicts.items()
    ]


def test_a_truck_is_new_to_calibrate_once_and_not_while_it_may_be_a_false_alarm(tmp_path: Path) -> None:
    nights = [
        (ranked(a="recalibrate", b="within", c="recalibrate watch", d="repair"), ("a",), ("d",)),
        (ranked(a="recalibrate", b="recalibrate", c="recalibrate", d="repair", e="recalibrate"), ("b", "c", "e"), ()),
        (ranked(a="within", b="recalibrate", c="recalibrate", d="check_signal"), (), ("d",)),
        (ranked(a="recalibrate", b="recalibrate", c="recalibrate", d="within"), ("a",), ()),
    ]
    for rows, calibrate, fault in nights:
        with contextlib.closing(Ledger(tmp_path / LEDGER)) as ledger:
            news = news_of(ledger, rows, [])
            keep_for_next_night(ledger, rows, [])
        assert (news.calibrate, news.fault) == (calibrate, fault)
        assert news.is_first_night == (rows is nights[0][0])
    assert news.verdicts == (
        {"truck": "a", "before": "within", "now": "recalibrate"},
        {"truck": "d", "before": "check_signal", "now": "within"},
    )


def test_a_night_fails_on_logs_without_an_answer_but_not_on_oncenter_s_own_files(
    night: Arguments, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command([*night, "--fail-on", "new-unread, unread"]) == 3
    broken = tmp_path / "logs" / "depot-7" / "broken.parquet"
    assert capsys.readouterr().err == "".join(
        f"oncenter: --fail-on: 1 {kind}: {broken}\n" for kind in ("unread", "new-unread")
    )
    assert command([*night, "--fail-on", "new-unread"]) == 0
    (tmp_path / "logs" / "depot-7" / "broken.parquet").unlink()
    shutil.copy(tmp_path / "out" / "trucks.parquet", tmp_path / "logs" / "depot-7" / "broken.parquet")
    assert command([*night, "--fail-on", "new-unread,unread"]) == 0


def test_a_night_that_fails_names_the_trucks_that_made_it_fail(
    night: Arguments, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Here 22 trucks are to be calibrated."""
    trucks = [f"T{number:02}" for number in range(22)]
    verdicts = ranked(**dict.fromkeys(trucks, "recalibrate"), healthy="within")
    monkeypatch.setattr(fleet_night, "news_of", lambda ledger, _, unread: news_of(ledger, verdicts, unread))
    assert command([*night, "--fail-on", "new-calibrate,damaged"]) == 3
    named = ", ".join(trucks[:20])
    assert capsys.readouterr().err == f"oncenter: --fail-on: 22 new-calibrate: {named} and 2 more\n"
    kinds = json.loads((tmp_path / "out" / "metrics.json").read_text())["kinds"]
    assert kinds["new-calibrate"] == {"count": 22, "names": trucks} and kinds["damaged"] == {"count": 0, "names": []}


def test_a_kind_to_fail_on_that_is_none_is_refused_before_the_night(
    night: Arguments, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command([*night, "--fail-on", "calibrate"]) == 2
    assert f"--fail-on takes {', '.join(KINDS)}, separated by commas; got 'calibrate'" in capsys.readouterr().err
    assert command([*night, "--metrics", str(tmp_path / "none" / "a.prom")]) == 2
    assert not (tmp_path / "out").exists()


_SAMPLE = re.compile(r'(oncenter_fleet_[a-z_]+)(\{[a-z]+="[^"\\\n]*"\})? (-?[0-9.e+-]+)')


def samples(text: str) -> dict[str, float]:
    """The values of a text of Prometheus by name and labels; each name is described before its values."""
    found: dict[str, float] = {}
    described = ""
    assert text.endswith("\n")
    for line in text.splitlines():
        if line.startswith("# HELP "):
            described = line.split()[2]
        elif line.startswith("# TYPE "):
            assert line == f"# TYPE {described} gauge"
        else:
            sample = _SAMPLE.fullmatch(line)
            assert sample is not None and sample[1] == described, line
            found[sample[1] + (sample[2] or "")] = float(sample[3])
    return found


def test_the_numbers_of_a_night_are_a_file_for_prometheus_that_a_rename_replaces(
    night: Arguments, tmp_path: Path
) -> None:
    prom = tmp_path / "oncenter.prom"
    prom.write_text("old")
    with prom.open() as reader:
        assert command([*night, "--metrics", str(prom)]) == 0
        assert reader.read() == "old"
    assert [path.name for path in tmp_path.glob("*.prom*")] == ["oncenter.prom"]
    given = samples(prom.read_text())
    summary = json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert given['oncenter_fleet_logs{result="answered"}'] == summary["logs_answered"] == 1
    assert given['oncenter_fleet_unread_logs{reason="unreadable_log"}'] == given["oncenter_fleet_new_unread"] == 1
    verdicts = {name: value for name, value in given.items() if name.startswith("oncenter_fleet_trucks{")}
    assert sum(verdicts.values()) == 1 and len(verdicts) == len(summary["verdicts"])
    assert {f"oncenter_fleet_{kind.replace('-', '_')}" for kind in KINDS} <= set(given)


@pytest.mark.posix
def test_the_numbers_of_a_night_pass_through_a_pipe_that_stays_one(fleet: Path, tmp_path: Path) -> None:
    summary = run([str(fleet / "logs" / "depot-7" / "day0.parquet")], fleet / "vehicles", tmp_path / "out")
    pipe = tmp_path / "numbers.prom"
    os.mkfifo(pipe)
    with os.fdopen(os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)) as reader:
        write_metrics(pipe, summary)
        assert samples(reader.read())["oncenter_fleet_drives"] == 1
    assert pipe.is_fifo()


def test_numbers_of_a_night_that_cannot_be_written_are_one_line(
    fleet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    summary = run([str(fleet / "logs" / "depot-7" / "day0.parquet")], fleet / "vehicles", tmp_path / "out")

    def no_space(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", no_space)
    with pytest.raises(OncenterError, match=r"^cannot write .*numbers\.prom: No space left on device$"):
        write_metrics(tmp_path / "numbers.prom", summary)
    assert not list(tmp_path.glob("*.prom*"))


def test_a_version_with_quotes_is_no_other_metric(fleet: Path, tmp_path: Path) -> None:
    from dataclasses import replace

    summary = run([str(fleet / "logs" / "depot-7" / "day0.parquet")], fleet / "vehicles", tmp_path)
    text = as_prometheus(replace(summary, version='1" \\\n2'), 0.0)
    assert 'oncenter_fleet_info{version="1\\" \\\\\\n2"} 1\n' in text


# -- queries

SQL = "SELECT truck, offset_deg, since FROM trucks ORDER BY truck"


def ask(output: Path, *options: str, sql: str = SQL) -> int:
    return command(["fleet", "query", sql, "--output", str(output), *options])


def test_a_query_is_a_table_where_it_fits_and_records_where_it_does_not_and_cuts_nothing(
    undisturbed: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    assert ask(undisturbed) == 0
    head, first, second = capsys.readouterr().out.splitlines()
    assert (
        head.split() == ["truck", "offset_deg", "since"] and first.split()[0] == VIN and second.split()[0] == "depot-7"
    )
    assert ask(undisturbed, sql="SELECT * FROM drives ORDER BY log") == 0
    lines = capsys.readouterr().out.splitlines()
    drives = pl.read_parquet(undisturbed / "drives.parquet").sort("log")
    assert lines[0] == "-- row 1" and len(lines) == drives.height * (1 + drives.width)
    logs = [line.split()[1] for line in lines if re.match(r"log ", line)]
    assert logs == drives["log"].to_list()


def test_what_a_table_holds_is_shown_without_control_characters() -> None:
    rows = [{"a": "x\x1b[31m", "b": None}, {"a": "y", "b": 1.23456789}]
    assert as_lines(rows, ["a", "b"], 30) == ["a                b", r"x\x1b[31m        -", "y          1.23457"]
    assert as_lines([], ["a", "bc"], 30) == ["a  bc"]


def test_a_query_writes_csv_parquet_and_json_with_the_same_values(
    undisturbed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    expected = pl.read_parquet(undisturbed / "trucks.parquet").sort("truck").select("truck", "offset_deg", "since")
    assert ask(undisturbed, "--parquet", str(tmp_path / "a.parquet")) == 0
    assert pl.read_parquet(tmp_path / "a.parquet").equals(expected)
    assert ask(undisturbed, "--csv", str(tmp_path / "a.csv")) == ask(undisturbed, "--csv", "-") == 0
    out = capsys.readouterr().out
    assert (tmp_path / "a.csv").read_bytes() == b"\xef\xbb\xbf" + out.replace("\n", "\r\n").encode()
    rows: list[dict[str, Any]] = list(csv.DictReader(io.StringIO(out)))
    assert ask(undisturbed, "--json") == 0
    given = json.loads(capsys.readouterr().out)["rows"]
    for row, of_json, exact in zip(rows, given, expected.to_dicts(), strict=True):
        assert row["truck"] == of_json["truck"] == exact["truck"]
        assert float(row["offset_deg"]) == pytest.approx(exact["offset_deg"], rel=1e-5)
        assert of_json["offset_deg"] == exact["offset_deg"]


def test_a_query_without_rows_has_its_columns_in_csv(undisturbed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert ask(undisturbed, "--csv", "-", sql=f"{SQL.split(' ORDER')[0]} WHERE truck = 'none'") == 0
    assert capsys.readouterr().out == "truck,offset_deg,since\n"


def test_a_query_has_one_form_at_a_time_and_its_parquet_file_is_refused_as_a_log(
    undisturbed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert ask(undisturbed, "--json", "--csv", "-") == 2
    assert ask(undisturbed, "--parquet", str(tmp_path / "a.parquet")) == 0
    capsys.readouterr()
    assert command(["signals", str(tmp_path / "a.parquet")]) == 1
    assert "is not a log: it holds a table of oncenter fleet" in capsys.readouterr().err
