"""The command line: an answer and exit code 0, or one line on stderr, the right exit code, with --json an object."""

import gzip
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from real_data import real_drive
from test_estimate import steady_drive

from oncenter.cli import run

TRUCK = "scania_r730_4x2"


@pytest.fixture(scope="module")
def drive_csv(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("drive") / "drive.csv"
    steady_drive().table.write_csv(path)
    return path


def test_offset_prints_the_answer_in_words_first(drive_csv: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["offset", str(drive_csv), "--vehicle", TRUCK]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("offset 2.0")
    assert err == ""


def test_offset_with_json_prints_one_object(drive_csv: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["offset", str(drive_csv), "--vehicle", TRUCK, "--json"]) == 0
    given = json.loads(capsys.readouterr().out)
    assert given["offset"]["value"] == pytest.approx(2.0, abs=0.05)
    assert given["signals"]["yaw_rate"]


def test_offset_writes_a_report_that_loads_nothing(drive_csv: Path, tmp_path: Path) -> None:
    page = tmp_path / "out.html"
    assert run(["offset", str(drive_csv), "--vehicle", TRUCK, "--report", str(page)]) == 0
    assert page.stat().st_size > 10_000


def test_leaving_the_accelerometer_out_needs_no_accelerometer(
    drive_csv: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    blind = tmp_path / "blind.csv"
    steady_drive().table.drop("lateral_acceleration_m_s2").write_csv(blind)
    assert run(["offset", str(blind), "--vehicle", TRUCK]) == 1
    assert "lateral acceleration" in capsys.readouterr().err
    assert run(["offset", str(blind), "--vehicle", TRUCK, "--no-accelerometer"]) == 0


def bad_inputs(folder: Path) -> dict[str, tuple[Path, int]]:
    """A file for each way in which a log can be wrong, and the exit code it earns."""
    header = "time_s,steering_wheel_angle_deg,yaw_rate_deg_s,vehicle_speed_m_s,lateral_acceleration_m_s2\n"
    row = "{:.2f},1.0,0.1,20.0,0.1\n"
    rows = [row.format(k / 100) for k in range(500)]
    files = {
        "empty.csv": b"",
        "empty.log": b"",
        "empty.mf4": b"",
        "empty.blf": b"",
        "empty.parquet": b"",
        "truncated.blf": b"LOGG\x90\x00\x00\x00" + bytes(60),
        "truncated.mf4": b"MDF     4.10    " + bytes(40),
        "truncated.csv.gz": gzip.compress((header + "".join(rows)).encode())[:300],
        "no_units.csv": b"time_s,steering_wheel_angle,yaw_rate,vehicle_speed\n0.0,1,2,3\n0.01,1,2,3\n",
        "text.csv": (header + "".join(rows) + "5.0,left,0.1,20.0,0.1\n").encode(),
        "backward.csv": (header + "".join(reversed(rows))).encode(),
        "no_time.csv": b"steering_wheel_angle_deg,yaw_rate_deg_s\n1,2\n1,2\n",
        "other_protocol.log": b"".join(b"(%.3f) can0 123#0102030405060708\n" % (k / 100) for k in range(300)),
        "words.log": b"this is no candump\nat all\n",
        "unknown.xyz": b"1 2 3",
    }
    for name, content in files.items():
        (folder / name).write_bytes(content)
    (folder / "folder.csv").mkdir()
    cases = {name: (folder / name, 1) for name in (*files, "folder.csv")}
    cases["not_there.csv"] = (folder / "not_there.csv", 1)
    return cases


BAD_INPUTS = (
    "empty.csv empty.log empty.mf4 empty.blf empty.parquet truncated.blf truncated.mf4 truncated.csv.gz no_units.csv "
    "text.csv backward.csv no_time.csv other_protocol.log words.log unknown.xyz folder.csv not_there.csv"
).split()


@pytest.mark.parametrize("name", BAD_INPUTS)
@pytest.mark.parametrize("verb", ["offset", "signals"])
def test_a_bad_log_is_one_line_and_with_json_the_error_object(
    name: str, verb: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    log, exit_code = bad_inputs(tmp_path)[name]
    assert run([verb, str(log), "--vehicle", TRUCK, "--json"]) == exit_code
    out, err = capfd.readouterr()
    given = json.loads(out)
    assert given["schema"] == "oncenter/error-1"
    assert {"code", "message", "needs"} <= set(given)
    assert err.count("\n") == 1
    assert name in err
    assert "Traceback" not in err


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["offset"], "LOG"),
        (["offset", "{log}"], "--vehicle"),
        (["offset", "{log}", "--vehicle", "no_such.toml"], "no_such.toml"),
        (["offset", "{log}", "--vehicle", "{zero}"], "wheelbase_m"),
        (["offset", "{log}", "--vehicle", TRUCK, "--method", "guess"], "guess"),
        (["offset", "{frames}", "--vehicle", TRUCK, "--dbc", "{empty_dbc}"], "empty.dbc"),
        (["offset", "{log}", "--vehicle", TRUCK, "--source", "yaw_rate"], "yaw_rate"),
        (["offset", "{log}", "--vehicle", TRUCK, "--report", "{folder}/none/out.html"], "out.html"),
        (["simulate", "no_such_scenario", "--output", "{folder}/x.log"], "no_such_scenario"),
        (["simulate", "thesis_drive", "--output", "{folder}/x.xyz"], "x.xyz"),
        (["fly"], "fly"),
        (["offset", "{log}", "--vehicle", TRUCK, "--nonsense"], "--nonsense"),
    ],
)
def test_wrong_usage_is_one_line_and_exit_code_2(
    arguments: list[str], named: str, drive_csv: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "zero.toml").write_text("wheelbase_m = 0\nsteering_ratio = 19.3\n")
    (tmp_path / "empty.dbc").write_text("")
    (tmp_path / "frames.log").write_text(
        "(0.00) can0 18F0093E#697D7F637D577F7D\n(0.01) can0 18F0093E#697D7F637D577F7D\n"
    )
    places = {
        "log": drive_csv,
        "zero": tmp_path / "zero.toml",
        "frames": tmp_path / "frames.log",
        "empty_dbc": tmp_path / "empty.dbc",
        "folder": tmp_path,
    }
    assert run([argument.format(**places) for argument in arguments]) == 2
    err = capfd.readouterr().err
    assert err.count("\n") == 1
    assert named in err


def test_a_bug_of_ours_is_one_line_and_exit_code_70(
    drive_csv: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from oncenter import _core

    monkeypatch.setattr(_core.Core, "run", lambda *_: 1 / 0)
    assert run(["offset", str(drive_csv), "--vehicle", TRUCK]) == 70
    assert capsys.readouterr().err.count("\n") == 1
    with pytest.raises(ZeroDivisionError):
        run(["--debug", "offset", str(drive_csv), "--vehicle", TRUCK])


HEAVY = ("can", "cantools", "asammdf", "pandas", "bokeh", "matplotlib")


@pytest.mark.parametrize("arguments", [["--help"], ["offset", "--help"], ["offset", "{log}", "--vehicle", TRUCK]])
def test_help_and_offset_on_csv_load_nothing_heavy(arguments: list[str], drive_csv: Path) -> None:
    program = (
        "import sys; from oncenter.cli import run; run(sys.argv[1:]); "
        f"print([name for name in {HEAVY} if name in sys.modules], file=sys.stderr)"
    )
    filled = [argument.format(log=drive_csv) for argument in arguments]
    done = subprocess.run([sys.executable, "-c", program, *filled], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"


def test_output_cut_short_by_its_reader_is_no_error(drive_csv: Path) -> None:
    command = f'"{sys.executable}" -m oncenter offset "{drive_csv}" --vehicle {TRUCK} --json | head -c 1'
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=True, env=dict(os.environ))
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("name", ["cpg_fast_lap", "cpg_slow_lap"])
def test_table_4_passes_nothing_of_the_genesis_and_says_why(
    name: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    log = real_drive(f"genesis/{name}.csv.gz")
    genesis = Path(__file__).parent.parent / "examples" / "genesis.toml"
    table_4 = tmp_path / "table_4.toml"
    table_4.write_text(genesis.read_text().split("[params]")[0])
    assert run(["offset", str(log), "--vehicle", str(table_4), "--json"]) == 0
    given = json.loads(capsys.readouterr().out)
    assert given["offset"]["status"] == "unobservable"
    shut = next(f for f in given["findings"] if f["code"] == "gate_shut")
    assert "bank" in shut["text"]
    assert shut["value"] == pytest.approx(-0.65, abs=0.15)


@pytest.mark.parametrize(("name", "oxts_deg"), [("cpg_fast_lap", 0.27), ("cpg_slow_lap", 0.34)])
def test_the_genesis_is_answered_with_its_raw_gyro_and_its_biases_are_told(
    name: str, oxts_deg: float, capsys: pytest.CaptureFixture[str]
) -> None:
    log = real_drive(f"genesis/{name}.csv.gz")
    genesis = Path(__file__).parent.parent / "examples" / "genesis.toml"
    assert run(["offset", str(log), "--vehicle", str(genesis), "--json"]) == 0
    given = json.loads(capsys.readouterr().out)
    assert given["offset"]["value"] == pytest.approx(oxts_deg - 1.0, abs=0.5)  # the raw gyro costs about 1 deg
    found = {f["code"]: f["value"] for f in given["findings"]}
    assert found["yaw_rate_bias"] == pytest.approx(0.27, abs=0.05)
    assert found["lateral_acceleration_at_standstill"] == pytest.approx(-0.6, abs=0.05)


def test_a_truck_that_stands_and_has_no_angle_is_told_what_is_missing(capfd: pytest.CaptureFixture[str]) -> None:
    log = real_drive("j1939_truck_stationary/truck_stationary.mf4")
    assert run(["offset", str(log), "--vehicle", TRUCK, "--json"]) == 1
    given = json.loads(capfd.readouterr().out)
    assert given["code"] == "missing_signal"
    assert "steering_wheel_angle" in given["needs"]
    assert "61449" in given["message"]
    assert "1807" in given["message"]
    assert "vehicle_speed" in given["message"] or "vehicle speed" in given["message"]
