"""Logs in folders: all logs of one truck together, or each by itself, and none of another truck."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from drive_frames import candump, drive, identifier
from test_estimate import steady_drive

from oncenter.cli import run
from oncenter.cli.places import logs_at
from oncenter.errors import OncenterError
from oncenter.files.own_file import metadata

TRUCK = "scania_r730_4x2"
VIN, OTHER_VIN = "YS2R4X20001234567", "YS2R4X20007654321"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of one truck: two halves of a drive, one in a subfolder, an unreadable log, and other files."""
    table = steady_drive().table
    (tmp_path / "logs" / "tuesday").mkdir(parents=True)
    table[6000:].write_csv(tmp_path / "logs" / "a.csv")
    table[:6000].write_csv(tmp_path / "logs" / "tuesday" / "b.csv")
    (tmp_path / "logs" / "bad.csv").write_text("nothing\nhere\n")
    (tmp_path / "logs" / "notes.txt").write_text("drove well\n")
    table.write_parquet(tmp_path / "logs" / "true.parquet", metadata=metadata("truth"))
    monkeypatch.chdir(tmp_path)
    return tmp_path / "logs"


def with_vin(vin: str | None, path: Path, start_s: float = 0.0) -> str:
    table = steady_drive(start_s=start_s).table
    (table if vin is None else table.with_columns(vin=pl.lit(vin))).write_csv(path)
    return str(path)


def answered(arguments: list[str], capfd: pytest.CaptureFixture[str], exit_code: int = 0) -> dict[str, Any]:
    assert run(["offset", *arguments, "--vehicle", TRUCK, "--json"]) == exit_code
    given: dict[str, Any] = json.loads(capfd.readouterr().out)
    return given


def test_a_folder_gives_one_answer_for_all_its_logs(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    given = answered([str(folder)], capfd)
    assert given["schema"] == "oncenter/offset-2"
    assert given["time"]["duration_s"] == pytest.approx(240.0)
    (left_out,) = [finding["text"] for finding in given["findings"] if finding["code"] == "log_left_out"]
    assert "bad.csv" in left_out
    (own,) = [finding["text"] for finding in given["findings"] if finding["code"] == "no_log_left_out"]
    assert "true.parquet is not a log: it holds the true values of a simulated drive" in own
    assert any("1 file is not a log and was skipped: .txt" in note for note in given["notes"])


def test_logs_of_a_folder_are_in_order_of_start_time_or_else_of_name(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """`tuesday/b.csv` begins at zero, `a.csv` two minutes later: such time stamps give no order."""
    for name in ("drive10.csv", "drive2.csv"):
        steady_drive().table.write_csv(folder / "tuesday" / name)
    names = [path.name for path in logs_at([str(folder)]).logs]
    assert names == ["a.csv", "bad.csv", "true.parquet", "b.csv", "drive2.csv", "drive10.csv"]
    dated = folder / "dated"
    dated.mkdir()
    for hours, name in ((3, "first.parquet"), (2, "second.parquet"), (1, "third.parquet")):
        metadata = {"start_time": f"2026-03-02T{hours:02}:00:00"}
        steady_drive(radius_m=400.0 + 10.0 * hours).table.write_parquet(dated / name, metadata=metadata)
    given = answered([str(dated)], capfd)
    order = [given["log"].index(name) for name in ("third", "second", "first")]
    assert order == sorted(order)


def test_each_log_of_a_folder_is_a_line_with_its_answer_or_its_error(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(["offset", str(folder), "--vehicle", TRUCK, "--each"]) == 0
    out, err = capfd.readouterr()
    first, bad, true, second, note = out.splitlines()
    assert first.startswith(str(folder / "a.csv")) and second.startswith(str(folder / "tuesday" / "b.csv"))
    for line in (first, second):
        assert " deg (" in line and " ± " in line and "converging" in line
    assert "no answer" in bad and "no signal recognised in bad.csv" in bad and "deg (" not in bad
    assert "no answer" in true and "true.parquet is not a log" in true
    assert note.startswith("note: 1 file is not a log") and err == ""


def test_each_with_json_is_one_object_of_answers_and_errors(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    given = answered([str(folder), "--each"], capfd)
    assert given["schema"] == "oncenter/offsets-1"
    schemas = ["offset-2", "error-1", "error-1", "offset-2"]
    assert [one["schema"] for one in given["answers"]] == [f"oncenter/{schema}" for schema in schemas]
    assert [Path(one["log"]).name for one in given["answers"]] == ["a.csv", "bad.csv", "true.parquet", "b.csv"]
    assert [given["answers"][k]["code"] for k in (1, 2)] == ["missing_signal", "not_a_log"]


def test_the_exit_code_is_1_if_no_log_can_be_answered(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    given = answered([str(folder / "bad.csv"), "--each"], capfd, exit_code=1)
    assert [one["code"] for one in given["answers"]] == ["missing_signal"]


def test_a_source_that_one_log_lacks_is_an_error_of_that_log(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    steady_drive().table.write_csv(tmp_path / "a.csv")
    (tmp_path / "b.log").write_text(candump(drive()))
    take = ["--each", "--source", "yaw_rate=0x3E"]
    assert run(["offset", str(tmp_path), "--vehicle", TRUCK, *take]) == 0
    first, second = capfd.readouterr().out.splitlines()
    assert "no answer" in first and "0x3E" in first and "no answer" not in second
    answered([str(tmp_path / "a.csv"), *take], capfd, exit_code=2)


@pytest.mark.parametrize("option", ["--report page.html", "--memory truck.toml", "--event repaired@2026-03-02"])
def test_each_refuses_options_for_a_single_answer(option: str, folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["offset", str(folder), "--vehicle", TRUCK, "--each", *option.split()]) == 2
    out, err = capfd.readouterr()
    assert out == "" and err.count("\n") == 1 and "--each" in err and option.split()[0] in err


def test_the_error_of_logs_of_two_trucks_names_two_logs_and_their_vins(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    logs = [with_vin(None, tmp_path / "silent.csv"), with_vin(VIN, tmp_path / "a.csv")]
    assert run(["offset", *logs, "--vehicle", TRUCK]) == 0
    capfd.readouterr()
    logs.append(with_vin(OTHER_VIN, tmp_path / "b.csv"))
    for arguments in (logs, [str(tmp_path)]):
        assert run(["offset", *arguments, "--vehicle", TRUCK, "--json"]) == 2
        out, err = capfd.readouterr()
        assert err.count("\n") == 1
        assert all(named in err for named in ("a.csv", VIN, "b.csv", OTHER_VIN, "--each"))
        assert json.loads(out)["code"] == "different_trucks"
    assert run(["offset", *logs, "--vehicle", TRUCK, "--each"]) == 0


def test_a_vin_in_the_frames_of_a_log_is_compared_too(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for name, vin in (("a.log", "SHORT1*"), ("b.log", "SHORT2*")):
        frames = drive()
        frames.insert(3, type(frames[0])(frames[0].time + 0.001, identifier(65260, 0), vin.encode().ljust(8, b"\xff")))
        (tmp_path / name).write_text(candump(frames))
    assert run(["offset", str(tmp_path), "--vehicle", TRUCK]) == 2
    err = capfd.readouterr().err
    assert "a.log has VIN SHORT1" in err and "b.log has VIN SHORT2" in err


def test_other_files_among_logs_are_skipped_and_counted(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    given = answered([str(folder / "a.csv"), str(folder / "notes.txt")], capfd)
    assert any("1 file is not a log and was skipped: .txt" in note for note in given["notes"])
    assert not any(finding["code"] == "log_left_out" for finding in given["findings"])


def test_a_log_that_lacks_a_signal_does_not_stop_the_others(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    steady_drive().table.drop("yaw_rate_rad_s").write_csv(folder / "blind.csv")
    given = answered([str(folder)], capfd)
    texts = [finding["text"] for finding in given["findings"] if finding["code"] == "log_left_out"]
    assert any("blind.csv" in text and "yaw rate" in text for text in texts)
    assert given["time"]["duration_s"] == pytest.approx(240.0)


def test_a_folder_without_a_log_is_one_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "photo.jpg").write_text("no log")
    assert run(["offset", str(tmp_path), "--vehicle", TRUCK, "--json"]) == 1
    out, err = capfd.readouterr()
    assert err.count("\n") == 1 and "no logs in" in err and "1 file" in err and ".parquet" in err
    assert json.loads(out)["code"] == "no_such_log"


def test_an_empty_name_is_not_the_current_folder(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["offset", "", "--vehicle", TRUCK]) == 2
    assert "a LOG has an empty name" in capfd.readouterr().err
    assert run(["offset", ".", "--vehicle", TRUCK]) == 0


def test_a_circle_of_links_ends_and_each_folder_is_read_once(folder: Path) -> None:
    os.symlink(folder, folder / "tuesday" / "again")
    assert len(logs_at([str(folder), str(folder / "tuesday")]).logs) == 4
    with pytest.raises(OncenterError, match="no logs in"):
        (folder / "empty").mkdir()
        logs_at([str(folder / "empty")])


def test_a_link_that_leads_out_of_the_folder_is_named_and_not_read(
    folder: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (folder / "link.csv").symlink_to(__file__)
    (folder / "away").symlink_to(Path(__file__).parent)
    found = logs_at([str(folder)])
    assert len(found.logs) == 4
    whys = [str(error) for error in found.unlisted]
    assert len(whys) == 2 and all(f"leads out of its folder: name {Path(__file__).parent}" in why for why in whys)


def test_an_output_in_the_folder_that_is_one_of_its_logs_is_refused(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(["offset", str(folder), "--vehicle", TRUCK, "--report", str(folder / "a.csv")]) == 2
    assert "would overwrite" in capfd.readouterr().err


def test_the_help_says_that_subfolders_are_read(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["offset", "--help"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "all logs in it and in its subfolders, in order of their start times" in said
