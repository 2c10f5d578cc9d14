"""The command line: an answer and exit code 0, or one line on stderr, the right exit code, with --json an object."""

import gzip
import json
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from drive_frames import candump, drive
from real_data import real_drive
from test_estimate import steady_drive

import oncenter as oc
from oncenter.cli import run
from oncenter.signals import SignalName

TRUCK = "scania_r730_4x2"


@pytest.fixture(scope="module")
def drive_csv(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("drive") / "drive.csv"
    steady_drive().table.write_csv(path)
    return path


def test_offset_prints_the_verdict_first(drive_csv: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["offset", str(drive_csv), "--vehicle", TRUCK, "--method", "thesis"]) == 0
    out, err = capsys.readouterr()
    verdict, _, words, *_ = out.splitlines()
    assert verdict.startswith("Undecided: straight-ahead offset +2.0")
    assert words.startswith("straight-ahead offset 2.0")
    assert err == ""


def test_the_readme_says_what_the_demo_says(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["demo", "--output", str(tmp_path / "demo")]) == 0
    verdict, _, words, *_, truth, _, again = capsys.readouterr().out.splitlines()
    readme = (Path(__file__).parent.parent / "README.md").read_text(encoding="utf-8")
    assert verdict.startswith("Recalibrate: straight-ahead offset +2.0 deg ± 0.1 (limit 1.5 deg). Add -2.0 deg.")
    assert all(part in readme for part in words.split("; "))
    assert "2.04 deg" in truth and "2.04 deg" in readme
    assert again.endswith(f"offset {tmp_path / 'demo' / 'drive.log'} --vehicle scania_r730_4x2 --limit 1.5")
    assert verdict in readme
    assert (tmp_path / "demo" / "report.html").stat().st_size > 1e6


@pytest.mark.parametrize(
    ("scenario", "method", "said", "quoted"),
    [
        (
            "heavy_play",
            "joint",
            r"offset (\d\S+) deg.* has (\S+) deg of play",
            "(`heavy_play`): {} deg, and {} deg of play",
        ),
        ("heavy_play", "thesis", r"offset (\d\S+) deg ± ([\d.]+)", "(`--method thesis`) says {} ± {} deg:"),
        ("bypass", "joint", r"offset (\d\S+) deg ± (\S+) from this drive \(converging\)", "`converging`, {} ± {} deg"),
    ],
)
def test_the_readme_says_what_offset_says_of_scenarios(
    scenario: str, method: str, said: str, quoted: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = str(tmp_path / f"{scenario}.log")
    assert run(["simulate", scenario, "--output", log]) == 0
    assert run(["offset", log, "--vehicle", TRUCK, "--method", method]) == 0
    found = re.search(said, capsys.readouterr().out)
    assert found is not None
    readme = (Path(__file__).parent.parent / "README.md").read_text(encoding="utf-8")
    assert quoted.format(*found.groups()) in " ".join(readme.split())


def test_the_first_schema_is_still_printed_on_request(drive_csv: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for options, parts in (["--schema", "offset-1"], False), ([], True):
        assert run(["offset", str(drive_csv), "--vehicle", TRUCK, "--json", *options]) == 0
        given = json.loads(capsys.readouterr().out)
        assert given["schema"] == ("oncenter/offset-2" if parts else "oncenter/offset-1")
        assert ({"ci95_drive", "not_identifiable"} <= set(given["offset"])) is parts
    assert run(["offset", str(drive_csv), "--vehicle", TRUCK, "--json", "--schema", "offset-3"]) == 2


@pytest.mark.system
def test_offset_with_json_prints_one_object(drive_csv: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["offset", str(drive_csv), "--vehicle", TRUCK, "--json"]) == 0
    given = json.loads(capsys.readouterr().out)
    assert given["method"] == "joint"
    low, high = given["offset"]["ci95"]
    assert low < 2.0 < high
    assert given["signals"]["yaw_rate"]


def test_offset_writes_a_report_that_loads_nothing(drive_csv: Path, tmp_path: Path) -> None:
    page = tmp_path / "out.html"
    assert run(["offset", str(drive_csv), "--vehicle", TRUCK, "--report", str(page)]) == 0
    assert page.stat().st_size > 10_000


def test_without_the_accelerometer_option_needs_no_accelerometer_signal(
    drive_csv: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    blind = tmp_path / "blind.csv"
    steady_drive().table.drop("lateral_acceleration_m_s2").write_csv(blind)
    assert run(["offset", str(blind), "--vehicle", TRUCK]) == 1
    assert "lateral acceleration" in capsys.readouterr().err
    assert run(["offset", str(blind), "--vehicle", TRUCK, "--no-accelerometer"]) == 0


@pytest.mark.parametrize(("missing", "would_do"), [("yaw_rate", True), ("steering_wheel_angle", False)])
def test_a_log_with_wheel_speeds_but_no_yaw_rate_names_the_method_for_it(
    missing: str, would_do: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, speed = tmp_path / "lame.csv", pl.col("vehicle_speed_m_s")
    wheels = {f"wheel_speed_rear_{side}_m_s": speed for side in ("left", "right")}
    steady_drive().table.with_columns(**wheels).drop(f"{missing}_rad{'_s' if would_do else ''}").write_csv(log)
    assert run(["offset", str(log), "--vehicle", TRUCK]) == 1
    assert ("--method wheel-speed" in capsys.readouterr().err) == would_do
    assert run(["offset", str(log), "--vehicle", TRUCK, "--method", "wheel-speed"]) == (0 if would_do else 1)
    assert "--method wheel-speed" not in capsys.readouterr().err


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
        (["angle", "{log}"], "--vehicle"),
        (["offset", "{log}", "--vehicle", "no_such.toml"], "no_such.toml"),
        (["offset", "{log}", "--vehicle", "{zero}"], "wheelbase_m"),
        (["offset", "{log}", "--vehicle", TRUCK, "--method", "guess"], "guess"),
        (["offset", "{frames}", "--vehicle", TRUCK, "--dbc", "{empty_dbc}"], "empty.dbc"),
        (["offset", "{log}", "--vehicle", TRUCK, "--source", "yaw_rate"], "yaw_rate"),
        (["offset", "{log}", "--vehicle", TRUCK, "--report", "{folder}/none/out.html"], "out.html"),
        (["simulate", "no_such_scenario", "--output", "{folder}/x.log"], "no_such_scenario"),
        (["simulate", "thesis_drive", "--output", "{folder}/x.xyz"], "x.xyz"),
        (["fly"], "fly"),
        (["drive.asc"], "oncenter offset drive.asc"),
        (["report"], "--report drive.html"),
        (["offset", "{log}", "--vehicle", TRUCK, "--limit", "2,5"], "2.5, with a point"),
        (["offset", "{log}", "--vehicle", "{truth}"], "holds oncenter/truth-1, and no vehicle"),
        (["offset", "{log}", "--vehicle", TRUCK, "--nonsense"], "--nonsense"),
    ],
)
def test_wrong_usage_is_one_line_and_exit_code_2(
    arguments: list[str], named: str, drive_csv: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "zero.toml").write_text("wheelbase_m = 0\nsteering_ratio = 19.3\n")
    (tmp_path / "truth.toml").write_text('schema = "oncenter/truth-1"\nyaw_rate_bias_deg_s = 0.05\n')
    (tmp_path / "empty.dbc").write_text("")
    (tmp_path / "frames.log").write_text(
        "(0.00) can0 18F0093E#697D7F637D577F7D\n(0.01) can0 18F0093E#697D7F637D577F7D\n"
    )
    places = {
        "log": drive_csv,
        "zero": tmp_path / "zero.toml",
        "truth": tmp_path / "truth.toml",
        "frames": tmp_path / "frames.log",
        "empty_dbc": tmp_path / "empty.dbc",
        "folder": tmp_path,
    }
    assert run([argument.format(**places) for argument in arguments]) == 2
    err = capfd.readouterr().err
    assert err.count("\n") == 1
    assert named in err


@pytest.mark.system
def test_an_internal_error_is_one_line_and_exit_code_70(
    drive_csv: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from oncenter import _core

    monkeypatch.setattr(_core.Core, "run", lambda *_: 1 / 0)
    assert run(["offset", str(drive_csv), "--vehicle", TRUCK]) == 70
    assert capsys.readouterr().err.count("\n") == 1
    with pytest.raises(ZeroDivisionError):
        run(["--debug", "offset", str(drive_csv), "--vehicle", TRUCK])


HEAVY = ("can", "cantools", "asammdf", "pandas", "bokeh", "matplotlib")


@pytest.mark.parametrize(
    "arguments",
    [["--help"], ["offset", "--help"]]
    + [
        [verb, f"drive.{suffix}", "--vehicle", TRUCK]
        for verb in ("offset", "signals")
        for suffix in ("csv", "parquet", "log")
    ],
)
def test_help_and_light_formats_load_nothing_heavy(arguments: list[str], tmp_path: Path) -> None:
    steady_drive(minutes=0.5).table.write_csv(tmp_path / "drive.csv")
    steady_drive(minutes=0.5).table.write_parquet(tmp_path / "drive.parquet")
    (tmp_path / "drive.log").write_text(candump(drive()))
    assert not loaded_of(HEAVY, arguments, tmp_path)


@pytest.mark.parametrize("verb", ["offset", "signals"])
def test_a_log_of_frames_needs_no_table_and_no_other_command(verb: str, tmp_path: Path) -> None:
    (tmp_path / "drive.log").write_text(candump(drive()))
    unneeded = ("polars", "rich", "asyncio", "concurrent.futures", "oncenter.cli.live", "oncenter.truck.model")
    assert not loaded_of(unneeded, [verb, "drive.log", "--vehicle", TRUCK], tmp_path)


def loaded_of(names: Sequence[str], arguments: Sequence[str], folder: Path) -> list[str]:
    """Those of the modules that a process loads for a command line."""
    program = (
        "import sys; from oncenter.cli import run; assert run(sys.argv[1:]) == 0; "
        f"print(*[name for name in {names} if name in sys.modules], file=sys.stderr)"
    )
    command = [sys.executable, "-c", program, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=folder)
    return done.stderr.split()


@pytest.mark.system
def test_a_closed_pipe_is_not_an_error(drive_csv: Path) -> None:
    command = f'"{sys.executable}" -m oncenter offset "{drive_csv}" --vehicle {TRUCK} --json | head -c 1'
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=True, env=dict(os.environ))
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("name", ["cpg_fast_lap", "cpg_slow_lap"])
def test_the_gate_of_table_4_rejects_all_of_the_genesis_and_says_why(
    name: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    log = real_drive(f"genesis/{name}.csv.gz")
    genesis = Path(__file__).parent.parent / "examples" / "genesis.toml"
    table_4 = tmp_path / "table_4.toml"
    table_4.write_text(genesis.read_text().split("[params]")[0])
    assert run(["offset", str(log), "--vehicle", str(table_4), "--method", "thesis", "--json"]) == 0
    given = json.loads(capsys.readouterr().out)
    assert given["offset"]["status"] == "unobservable"
    shut = next(f for f in given["findings"] if f["code"] == "gate_shut")
    assert "bank" in shut["text"]
    assert shut["value"] == pytest.approx(-0.65, abs=0.15)


@pytest.mark.parametrize(("name", "oxts_deg"), [("cpg_fast_lap", 0.27), ("cpg_slow_lap", 0.34)])
def test_the_offset_of_the_genesis_agrees_with_its_oxts_and_its_biases_are_found(
    name: str, oxts_deg: float, capsys: pytest.CaptureFixture[str]
) -> None:
    log = real_drive(f"genesis/{name}.csv.gz")
    genesis = Path(__file__).parent.parent / "examples" / "genesis.toml"
    assert run(["offset", str(log), "--vehicle", str(genesis), "--json"]) == 0
    given = json.loads(capsys.readouterr().out)
    assert given["offset"]["value"] == pytest.approx(oxts_deg, abs=0.3)  # with the raw gyro it is about 1 deg less
    found = {f["code"]: f["value"] for f in given["findings"]}
    assert found["yaw_rate_bias"] == pytest.approx(0.27, abs=0.05)
    assert found["lateral_acceleration_at_standstill"] == pytest.approx(-0.6, abs=0.05)


def test_the_error_of_a_standing_truck_without_an_angle_names_the_missing_signals(
    capfd: pytest.CaptureFixture[str],
) -> None:
    pytest.importorskip("asammdf", reason="the log is MF4")
    log = real_drive("j1939_truck_stationary/truck_stationary.mf4")
    assert run(["offset", str(log), "--vehicle", TRUCK, "--json"]) == 1
    given = json.loads(capfd.readouterr().out)
    assert given["code"] == "missing_signal"
    assert "steering_wheel_angle" in given["needs"]
    assert "61449" in given["message"]
    assert "1807" in given["message"]
    assert "vehicle_speed" in given["message"] or "vehicle speed" in given["message"]


def parts_of(drive_csv: Path, folder: Path, *rows: tuple[int, int], since: float = 0.0) -> list[str]:
    """Logs with those rows of the drive each."""
    table = steady_drive().table.with_columns(pl.col("time_s") + since)
    paths = [folder / f"part{k}.csv" for k in range(len(rows))]
    for path, (first, last) in zip(paths, rows, strict=True):
        table[first:last].write_csv(path)
    return [str(path) for path in paths]


def test_a_bad_log_among_good_ones_is_named_and_the_others_are_answered(
    drive_csv: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "bad.csv").write_text("nothing\nhere\n")
    (tmp_path / "blind.csv").write_text(steady_drive().table.drop("steering_wheel_angle_rad").write_csv())
    first, second = parts_of(drive_csv, tmp_path, (0, 6000), (6000, 12000))
    missing = str(tmp_path / "none.csv")
    logs = [second, str(tmp_path / "bad.csv"), missing, first, str(tmp_path / "blind.csv")]
    assert run(["offset", *logs, "--vehicle", TRUCK, "--json"]) == 0
    out, err = capfd.readouterr()
    given = json.loads(out)
    left_out = [finding["text"] for finding in given["findings"] if finding["code"] == "log_left_out"]
    assert [name in text for name, text in zip(("bad.csv", missing, "blind.csv"), left_out, strict=True)] == [True] * 3
    assert given["time"]["duration_s"] == pytest.approx(240.0)
    low, high = given["offset"]["ci95"]
    assert low < 2.0 < high
    assert err == ""


def test_several_logs_of_which_none_can_be_read_are_one_error(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.csv").write_text("nothing\nhere\n")
    (tmp_path / "b.csv").write_text("")
    assert run(["offset", str(tmp_path / "a.csv"), str(tmp_path / "b.csv"), "--vehicle", TRUCK, "--json"]) == 1
    out, err = capfd.readouterr()
    assert err.count("\n") == 1 and "a.csv" in err and "b.csv is empty" in err
    assert json.loads(out)["code"] == "missing_signal"


def test_logs_that_overlap_or_are_given_twice_are_findings(
    drive_csv: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    first, second = parts_of(drive_csv, tmp_path, (0, 7000), (6000, 12000), since=1.7e9)
    assert run(["offset", second, first, second, "--vehicle", TRUCK, "--json"]) == 0
    given = json.loads(capfd.readouterr().out)
    found = {finding["code"]: finding["text"] for finding in given["findings"]}
    assert "part1.csv is given twice" in found["log_given_twice"]
    assert "part0.csv and" in found["logs_overlap"] and "for 20 s" in found["logs_overlap"]
    assert given["time"]["duration_s"] == pytest.approx(260.0)


@pytest.mark.system
def test_a_path_without_permission_is_one_line(
    drive_csv: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Root may read every path, and tests often run as root: the operating system's answer is replaced."""
    seen = os.stat

    def forbidden(path: Any, **options: Any) -> os.stat_result:
        if not isinstance(path, int) and "secret" in Path(os.fsdecode(path)).parts:
            raise PermissionError(13, "Permission denied", os.fsdecode(path))
        return seen(path, **options)

    monkeypatch.setattr(os, "stat", forbidden)
    secret = tmp_path / "secret"
    for exit_code, arguments in (
        (1, ["offset", f"{secret}/drive.csv", "--vehicle", TRUCK]),
        (1, ["signals", f"{secret}/drive.csv"]),
        (2, ["offset", str(drive_csv), "--vehicle", f"{secret}/truck.toml"]),
        (2, ["offset", str(drive_csv), "--vehicle", TRUCK, "--report", f"{secret}/out.html"]),
    ):
        assert run(arguments) == exit_code, arguments
        err = capfd.readouterr().err
        assert err.count("\n") == 1 and "Permission denied" in err and "internal error" not in err


@pytest.mark.system
def test_a_directory_a_pipe_and_an_unmatched_pattern_are_not_logs(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "logs").mkdir()
    os.mkfifo(tmp_path / "pipe.csv")
    cases = (("signals", "logs", "a directory"), ("offset", "pipe.csv", "a pipe"), ("offset", "*.csv", "No such file"))
    for verb, name, said in cases:
        assert run([verb, str(tmp_path / name), "--vehicle", TRUCK]) == 1
        err = capfd.readouterr().err
        assert err.count("\n") == 1 and said in err and name in err


@pytest.mark.system
@pytest.mark.parametrize("arguments", [["offset"], ["fleet", "run"]], ids=" ".join)
def test_an_interruption_is_one_line_and_with_json_the_error_object(
    arguments: list[str], drive_csv: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture
) -> None:
    from oncenter import _core
    from oncenter.fleet import night

    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(_core.Core, "run", interrupted)
    monkeypatch.setattr(night, "_write_tables", interrupted)
    of_verb = ["--vehicle", TRUCK]
    if arguments[0] == "fleet":
        of_verb = ["--vehicles", str(Path(__file__).parents[1] / "vehicles"), "--output", str(tmp_path / "out")]
    assert run([*arguments, str(drive_csv), *of_verb, "--json"]) == 130
    out, err = capfd.readouterr()
    assert json.loads(out)["code"] == "interrupted"
    assert err.startswith("oncenter: interrupted") and err.count("\n") == 1


@pytest.mark.system
def test_an_interruption_during_loading_leaves_no_traceback(tmp_path: Path) -> None:
    (tmp_path / "typer.py").write_text("raise KeyboardInterrupt\n")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
    command = [sys.executable, "-m", "oncenter", "offset", "drive.log", "--vehicle", TRUCK, "--json"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert (done.returncode, done.stderr) == (130, "oncenter: interrupted\n")
    assert json.loads(done.stdout)["code"] == "interrupted"


FULL = Path("/dev/full")


def in_a_shell(words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """`oncenter` there is this Python's."""
    program = f'oncenter() {{ "{sys.executable}" -m oncenter "$@"; }}; {words}'
    return subprocess.run(["sh", "-c", program], capture_output=True, text=True, cwd=folder, env=dict(os.environ))


@pytest.mark.system
@pytest.mark.parametrize(
    "words",
    [
        f"oncenter offset drive.csv --vehicle {TRUCK} > /dev/full",
        f"oncenter offset drive.csv --vehicle {TRUCK} --json > /dev/full",
        "oncenter signals none.csv --json > /dev/full",
        "oncenter --help > /dev/full",
        f"oncenter offset drive.csv --vehicle {TRUCK} >&-",
    ],
)
def test_an_output_that_cannot_be_written_is_not_an_internal_error(words: str, drive_csv: Path, tmp_path: Path) -> None:
    (tmp_path / "drive.csv").symlink_to(drive_csv)
    done = in_a_shell(words, tmp_path)
    assert done.returncode == 2
    said = done.stderr.splitlines()[-1]
    assert "cannot" in said and ("No space left" in said or "closed" in said)
    assert "internal error" not in done.stderr and "Exception" not in done.stderr


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        pytest.param("offset --report full.html", "understeer gradient", marks=pytest.mark.slow),
        ("angle --output full.csv", "of the drive, half of it within"),
        ("angle --output full.parquet", "of the drive, half of it within"),
        pytest.param("angle --report full.html", "of the drive, half of it within", marks=pytest.mark.slow),
    ],
)
def test_an_answer_is_printed_even_if_its_file_cannot_be_written(
    words: str, answer: str, drive_csv: Path, tmp_path: Path
) -> None:
    (tmp_path / "drive.csv").symlink_to(drive_csv)
    verb, option, name = words.split()
    (tmp_path / name).symlink_to(FULL)
    done = in_a_shell(f"oncenter {verb} drive.csv --vehicle {TRUCK} {option} {name}", tmp_path)
    assert done.returncode == 1
    assert answer in done.stdout
    assert done.stderr == f"oncenter: cannot write {name}: No space left on device\n"


@pytest.mark.system
def test_the_answer_is_the_only_object_if_its_report_cannot_be_written(drive_csv: Path, tmp_path: Path) -> None:
    (tmp_path / "drive.csv").symlink_to(drive_csv)
    (tmp_path / "full.html").symlink_to(FULL)
    done = in_a_shell(f"oncenter offset drive.csv --vehicle {TRUCK} --json --report full.html", tmp_path)
    assert done.returncode == 1
    assert json.loads(done.stdout)["schema"].startswith("oncenter/offset")
    assert done.stderr == "oncenter: cannot write full.html: No space left on device\n"


def test_an_answer_is_printed_before_its_report_is_written(
    drive_csv: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    out: list[str] = []
    monkeypatch.setattr("oncenter.report", lambda answer, path: out.append(capfd.readouterr().out))
    assert run(["offset", str(drive_csv), "--vehicle", TRUCK, "--json", "--report", str(tmp_path / "page.html")]) == 0
    assert json.loads(out[0])["schema"].startswith("oncenter/offset")
    assert capfd.readouterr().out == ""


@pytest.mark.system
def test_an_interruption_after_the_answer_adds_no_second_object(
    drive_csv: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("oncenter.report", interrupted)
    arguments = ["offset", str(drive_csv), "--vehicle", TRUCK, "--json", "--report", str(tmp_path / "page.html")]
    assert run(arguments) == 130
    out, err = capfd.readouterr()
    assert json.loads(out)["schema"].startswith("oncenter/offset")
    assert err == "oncenter: interrupted\n"


@pytest.mark.system
@pytest.mark.parametrize("option", ["offset --report", "angle --report", "angle --output"])
def test_an_output_that_is_not_a_file_path_is_refused_before_anything_is_read(
    option: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The log is missing, which reading would say."""
    verb, name = option.split()
    (tmp_path / "folder.csv").mkdir()
    for path, why in (("nowhere/out.csv", "there is no folder"), ("folder.csv", "it is a folder")):
        assert run([verb, "none.log", "--vehicle", TRUCK, name, str(tmp_path / path)]) == 2
        out, err = capfd.readouterr()
        assert out == "" and err.count("\n") == 1 and why in err and path in err


@pytest.mark.system
def test_a_log_whose_name_is_not_valid_text_is_answered_like_any_other(drive_csv: Path, tmp_path: Path) -> None:
    name = os.fsdecode(b"bad\xff.csv")
    (tmp_path / name).symlink_to(drive_csv)
    answer = f"oncenter offset bad*.csv --vehicle {TRUCK} --report page.html"
    assert in_a_shell(answer, tmp_path).returncode == 0
    assert "bad\\udcff.csv" in (tmp_path / "page.html").read_text(encoding="utf-8")
    done = in_a_shell(f"{answer} --json", tmp_path)
    assert json.loads(done.stdout)["log"] == name


_CONTROL = "\x1b]0;owned\x07\x9b31m\N{RIGHT-TO-LEFT OVERRIDE}"
_TITLE = r"\x1b]0;owned\x07\xc2\x9b31m\xe2\x80\xae"  # as it is printed


@pytest.mark.system
@pytest.mark.posix
@pytest.mark.parametrize(
    "words",
    [
        "signals LOG",
        "signals LOG --json",
        f"offset LOG --vehicle {TRUCK} --json",
        f"offset LOG LOG --vehicle {TRUCK} --each",
        f"offset LOG LOG --vehicle {TRUCK} --each --json",
        f"angle LOG --vehicle {TRUCK}",
        "reference LOG",
        f"compare LOG LOG --vehicle {TRUCK}",
        "explain LOG",
        "LOG",
    ],
)
def test_a_name_can_neither_control_a_terminal_nor_begin_a_line(
    words: str, drive_csv: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / f"log{_CONTROL}\nwarning: forged.csv"
    log.symlink_to(drive_csv)
    run([str(log) if word == "LOG" else word for word in words.split()])
    out, err = capsys.readouterr()
    assert not re.search("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202e]", out + err)
    assert not any(line.startswith("warning: forged") for line in (out + err).splitlines())
    if "--json" in words:
        given = json.loads(out)
        assert str(log) in (given.get("log"), *(each["log"] for each in given.get("answers", ())))
    elif words.startswith(("signals", "offset")):
        assert _TITLE in out


@pytest.mark.system
def test_a_column_can_not_control_a_terminal(drive_csv: Path, tmp_path: Path) -> None:
    column = f"yaw{_CONTROL}\nwarning: forged"
    pl.read_csv(drive_csv).rename({"yaw_rate_rad_s": column}).write_csv(tmp_path / "odd.csv")
    drive = oc.read(tmp_path / "odd.csv", names={"yaw_rate": SignalName(column, "rad_s")})
    assert drive.sources["yaw_rate"].description == rf"column yaw{_TITLE}\x0awarning: forged"
