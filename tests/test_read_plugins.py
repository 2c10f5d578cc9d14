"""An unknown logger's files are read by a plug-in of its maker; its faults give one line."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest
from installed_plugins import EXAMPLES, add_metadata, command_line, installed
from planted_faults import drive

from oncenter.signals import DEGREE

TRUCK = "scania_r730_4x2"


def acme_log(path: Path) -> None:
    """A healthy drive in the format of the invented logger."""
    spec = importlib.util.spec_from_file_location("acme_reader", EXAMPLES / "acme_reader" / "acme_reader.py")
    assert spec is not None and spec.loader is not None
    acme = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(acme)
    table = drive().table
    records = np.zeros(table.height, acme.RECORD)
    records["time"] = np.round(table["time_s"].to_numpy() * 1000)
    records["angle"] = np.round(table["steering_wheel_angle_rad"].to_numpy() / DEGREE * 10)
    records["yaw_rate"] = np.round(table["yaw_rate_rad_s"].to_numpy() / DEGREE * 100)
    records["speed"] = np.round(table["vehicle_speed_m_s"].to_numpy() * 3.6 * 100)
    records["lateral"] = np.round(table["lateral_acceleration_m_s2"].to_numpy() * 1000)
    path.write_bytes(acme.MARK + records.tobytes())


def plugin(site: Path, body: str, mark: str = ".acme", package: str = "broken-reader") -> None:
    module = package.replace("-", "_")
    (site / f"{module}.py").write_text(body)
    add_metadata(site, package, {mark: f"{module}:read"})


def refused(site: Path, log: Path, code: str) -> str:
    run = command_line(site)("signals", str(log), "--json")
    assert run.returncode == 1, run.stderr
    assert run.stderr.count("\n") == 1 and "Traceback" not in run.stderr
    error = json.loads(run.stdout)
    assert error["code"] == code
    return str(error["message"])


@pytest.mark.slow
def test_a_plugin_format_works_in_every_command(tmp_path: Path) -> None:
    log = tmp_path / "drive.ACME"
    acme_log(log)
    oncenter = installed(tmp_path, "acme_reader")
    said = json.loads(oncenter("offset", str(log), "--vehicle", TRUCK, "--json").stdout)
    low, high = said["offset"]["ci95"]
    assert low < 2.0 < high and said["signals"]["yaw_rate"] == "column yaw_rate_deg_s"
    signals = json.loads(oncenter("signals", str(log), "--json").stdout)
    assert signals["rate_hz"] == 50.0 and len(signals["signals"]) == 4


@pytest.mark.slow
def test_a_fleet_run_collects_a_plugins_logs_from_folders(tmp_path: Path) -> None:
    logs, vehicles = tmp_path / "logs" / "truck-1", tmp_path / "vehicles"
    logs.mkdir(parents=True)
    vehicles.mkdir()
    acme_log(logs / "drive.ACME")
    (logs / "notes.txt").write_text("no log")
    (vehicles / "truck-1.toml").write_text("wheelbase_m = 3.71\nsteering_ratio = 19.3\n")
    oncenter = installed(tmp_path, "acme_reader")
    given = "--vehicles", str(vehicles), "--output", str(tmp_path / "out"), "--json"
    ended = oncenter("fleet", "run", str(logs.parent), *given)
    assert ended.returncode == 0, ended.stderr
    metrics = json.loads(ended.stdout)
    assert (metrics["logs_found"], metrics["logs_answered"], metrics["trucks"]) == (1, 1, 1)


def test_a_folder_is_a_drive_by_its_content(tmp_path: Path) -> None:
    folder = tmp_path / "segment"
    for array, axes in (("CAN/steering_angle", 1), ("CAN/speed", 1), ("CAN/wheel_speed", 4)):
        write_array(folder, array, axes)
    for array in ("IMU/gyro", "IMU/accelerometer"):
        write_array(folder, array, 3)
    oncenter = installed(tmp_path, "comma2k19_reader")
    signals = json.loads(oncenter("signals", str(folder), "--json").stdout)
    assert signals["rate_hz"] == 100.0 and len(signals["signals"]) == 9
    (tmp_path / "other").mkdir()
    run = oncenter("signals", str(tmp_path / "other"))
    assert run.returncode == 1 and "is a directory, not a log" in run.stderr


def write_array(segment: Path, array: str, axes: int) -> None:
    place = segment / "processed_log" / array
    place.mkdir(parents=True)
    time = 1000.0 + np.arange(500) / 83.0
    with (place / "t").open("wb") as file:
        np.save(file, time)
    with (place / "value").open("wb") as file:
        np.save(file, np.ones((len(time), axes)))


@pytest.mark.parametrize(
    ("body", "says"),
    [
        (
            "def read(path): raise KeyError('no channel 7')",
            "the plug-in broken-reader failed: KeyError: 'no channel 7'",
        ),
        ("def read(path): raise SystemExit(3)", "the plug-in broken-reader failed: SystemExit: 3"),
        (
            "import nothing_of_that_name",
            "the plug-in broken-reader failed: ModuleNotFoundError: No module named 'nothing",
        ),
        ("x = 1", "the plug-in broken-reader failed: AttributeError: "),
        (
            "def read(path): return None",
            "the plug-in broken-reader returned no usable table: expected a DataFrame",
        ),
        ("def read(path): return {'time_s': [0, 1]}", "no signal recognised in d.acme: its columns are 'time_s'"),
        ("def read(path): return {'time_s': [0, 1], 'yaw_rate': [0, 1]}", "column yaw_rate of d.acme has no unit"),
        ("import os\ndef read(path): os.abort()", "cannot read d.acme: its reader crashed (SIGABRT)"),
    ],
)
def test_a_plugin_that_fails_is_named_in_one_line(tmp_path: Path, body: str, says: str) -> None:
    log = tmp_path / "d.acme"
    log.write_bytes(b"x")
    plugin(tmp_path, body)
    code = (
        "missing_signal"
        if "no signal" in says
        else "unit_missing"
        if "no unit" in says
        else "reader_crashed"
        if "crashed" in says
        else "plugin_failed"
    )
    assert says in refused(tmp_path, log, code)


def test_a_plugin_never_replaces_a_built_in_format_and_is_loaded_only_if_needed(tmp_path: Path) -> None:
    plugin(tmp_path, "raise SystemExit('loaded')", ".csv")
    plugin(tmp_path, "raise SystemExit('loaded')", ".acme", "other-reader")
    drive().table.write_csv(tmp_path / "d.csv")
    run = command_line(tmp_path)("signals", str(tmp_path / "d.csv"))
    assert run.returncode == 0 and "loaded" not in run.stdout + run.stderr


def test_two_plugins_of_one_suffix_are_refused_by_name(tmp_path: Path) -> None:
    for package in ("one-reader", "two-reader"):
        plugin(tmp_path, "def read(path): return {}", package=package)
    (tmp_path / "d.acme").write_bytes(b"x")
    said = refused(tmp_path, tmp_path / "d.acme", "plugin_ambiguous")
    assert "one-reader" in said and "two-reader" in said and said.endswith("uninstall all but one")


def test_an_unknown_suffix_is_refused_with_the_suffixes_of_plugins(tmp_path: Path) -> None:
    (tmp_path / "d.xyz").write_bytes(b"x")
    plugin(tmp_path, "")
    assert refused(tmp_path, tmp_path / "d.xyz", "unknown_format").endswith(".db3, .acme")


def test_an_empty_log_of_a_plugin_is_empty(tmp_path: Path) -> None:
    (tmp_path / "d.acme").touch()
    plugin(tmp_path, "")
    assert refused(tmp_path, tmp_path / "d.acme", "empty_log") == "d.acme is empty (0 bytes)"
