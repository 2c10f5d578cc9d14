"""A vehicle file names the DBC of its truck's logs, and every command and function reads logs with it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from drive_frames import Frame, candump
from test_estimate import steady_drive

import oncenter as oc
from oncenter.cli import run
from oncenter.errors import OncenterError
from oncenter.fleet import run as fleet_run
from oncenter.read import dbc
from oncenter.signals import DEGREE

OWN = """VERSION ""
BU_: Vector__XXX
BO_ 291 STEER: 8 Vector__XXX
 SG_ Wheel : 0|16@1- (0.01,0) [0|0] "deg" Vector__XXX
 SG_ Turning : 16|16@1- (0.001,0) [0|0] "deg/s" Vector__XXX
 SG_ Pace : 32|16@1+ (0.001,0) [0|0] "m/s" Vector__XXX
 SG_ Sideways : 48|16@1- (0.001,0) [0|0] "m/s^2" Vector__XXX
"""
VEHICLE = """name = "own"
wheelbase_m = 3.7
steering_ratio = 19.3
dbc = {dbc}
[signals]
steering_wheel_angle = {{ name = "STEER.Wheel" }}
yaw_rate = {{ name = "STEER.Turning" }}
vehicle_speed = {{ name = "STEER.Pace" }}
lateral_acceleration = {{ name = "STEER.Sideways" }}
"""
_FACTORS = {
    "steering_wheel_angle_rad": 0.01 * DEGREE,
    "yaw_rate_rad_s": 0.001 * DEGREE,
    "vehicle_speed_m_s": 0.001,
    "lateral_acceleration_m_s2": 0.001,
}


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """`logs/own/drive.log` of a truck that is not J1939, `trucks/own.toml` with its DBC; the user is elsewhere."""
    for name in ("logs/own", "trucks/dbc", "elsewhere"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "trucks" / "dbc" / "own.dbc").write_text(OWN)
    (tmp_path / "trucks" / "own.toml").write_text(VEHICLE.format(dbc='"dbc/own.dbc"'))
    table = steady_drive().table
    columns = [np.round(table[name].to_numpy() / factor).astype("<i2") for name, factor in _FACTORS.items()]
    rows = np.stack(columns, axis=1)
    frames = [
        Frame(1.7e9 + time, 291, row.tobytes(), extended=False) for time, row in zip(table["time_s"], rows, strict=True)
    ]
    (tmp_path / "logs" / "own" / "drive.log").write_text(candump(frames))
    monkeypatch.chdir(tmp_path / "elsewhere")
    return tmp_path


@pytest.mark.parametrize("verb", ["offset", "angle", "signals", "live"])
def test_every_command_reads_with_the_dbc_of_the_vehicle_file(
    verb: str, desk: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    log = ["--replay", "../logs/own/drive.log", "--speed", "100"] if verb == "live" else ["../logs/own/drive.log"]
    assert run([verb, *log, "--vehicle", "../trucks/own.toml"]) == 0, capfd.readouterr().err
    out = capfd.readouterr().out
    assert {"angle": "of the drive" in out, "signals": "STEER (0x123)" in out}.get(verb, "straight-ahead offset" in out)


def test_a_reference_is_read_with_the_dbc_of_the_vehicle_file(desk: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """The log lacks positions, but the DBC was read."""
    assert run(["reference", "../logs/own/drive.log", "--vehicle", "../trucks/own.toml"]) == 1
    err = capfd.readouterr().err
    assert "11-bit" not in err and "latitude" in err


def test_the_python_function_reads_with_the_dbc_of_a_vehicle(desk: Path) -> None:
    truck = oc.vehicle("../trucks/own.toml")
    signals = oc.read("../logs/own/drive.log", vehicle=truck)
    assert signals.sources["yaw_rate"].description == "STEER (0x123)"
    direct = oc.offset(steady_drive(), truck).offset.value
    assert oc.offset(signals, truck).offset.value == pytest.approx(direct, abs=0.1 * DEGREE)
    with pytest.raises(OncenterError, match="11-bit"):
        oc.read("../logs/own/drive.log")


def test_a_fleet_whose_logs_need_a_dbc_is_answered(desk: Path) -> None:
    fleet_run(["../logs"], "../trucks", "out")
    (row,) = pl.read_parquet("out/drives.parquet").to_dicts()
    alone = oc.offset(steady_drive(), oc.vehicle("../trucks/own.toml")).offset.value
    assert row["error"] is None and alone is not None
    assert row["offset_deg"] == pytest.approx(alone / DEGREE, abs=0.1)
    assert fleet_run(["../logs"], "../trucks", "out").logs_answered == 0


def test_a_dbc_is_parsed_once_for_many_logs_and_again_when_it_changed(
    desk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    parsed = []
    database = dbc.read_database
    monkeypatch.setattr(dbc, "read_database", lambda path: parsed.append(path) or database(path))
    file, names = desk / "trucks" / "dbc" / "own.dbc", oc.vehicle("../trucks/own.toml").signal_names
    for _ in range(3):
        (found,) = dbc.definitions([file], names, [])
    assert len(parsed) == 1 and found.message.name == "STEER"
    file.write_text(OWN.replace("STEER", "WHEELS").replace("(0.01,0)", "(0.002,0)"))
    renamed = {key: replace(name, name=name.name.replace("STEER", "WHEELS")) for key, name in names.items()}
    assert dbc.definitions([file], renamed, [])[0].message.name == "WHEELS"


@pytest.mark.slow
def test_a_fleet_answers_its_logs_again_after_a_change_of_the_dbc(desk: Path) -> None:
    fleet_run(["../logs"], "../trucks", "out")
    (desk / "trucks" / "dbc" / "own.dbc").write_text(OWN.replace("(0.01,0)", "(0.02,0)"))
    assert fleet_run(["../logs"], "../trucks", "out").logs_answered == 1


def test_the_dbc_of_the_command_line_replaces_that_of_the_vehicle_file(
    desk: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (desk / "trucks" / "own.toml").write_text(VEHICLE.format(dbc='"gone.dbc"'))
    verb = ["offset", "../logs/own/drive.log", "--vehicle", "../trucks/own.toml"]
    assert run([*verb, "--json"]) == 2
    out, err = capfd.readouterr()
    assert err.count("\n") == 1 and "../trucks/own.toml" in err and "../trucks/gone.dbc" in err
    assert json.loads(out)["code"] == "vehicle_file"
    assert run([*verb, "--dbc", "../trucks/dbc/own.dbc"]) == 0


def test_a_fleet_names_the_vehicle_file_whose_dbc_does_not_exist(desk: Path) -> None:
    (desk / "trucks" / "dbc" / "own.dbc").unlink()
    fleet_run(["../logs"], "../trucks", "out")
    (row,) = pl.read_parquet("out/drives.parquet").to_dicts()
    assert row["error_code"] == "vehicle_file" and "own.toml" in row["error"] and "own.dbc" in row["error"]


def test_several_dbcs_are_a_list_and_a_value_that_is_not_a_path_is_refused(
    desk: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    other = OWN.replace("291 STEER", "292 OTHER").replace("Wheel", "None1").replace("Turning", "None2")
    (desk / "trucks" / "other.dbc").write_text(other)
    file = desk / "trucks" / "own.toml"
    file.write_text(VEHICLE.format(dbc='["other.dbc", "dbc/own.dbc"]'))
    assert run(["offset", "../logs/own/drive.log", "--vehicle", str(file)]) == 0
    capfd.readouterr()
    for given in ("3", '["a.dbc", 3]', "{ file = 'a.dbc' }"):
        file.write_text(VEHICLE.format(dbc=given))
        assert run(["offset", "../logs/own/drive.log", "--vehicle", str(file)]) == 2
        err = capfd.readouterr().err
        assert err.count("\n") == 1 and "'dbc' is a path or a list of paths" in err


def test_a_report_does_not_overwrite_the_dbc_of_the_vehicle(desk: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (desk / "trucks" / "own.html").write_text(OWN)
    (desk / "trucks" / "own.toml").write_text(VEHICLE.format(dbc='"own.html"'))
    verb = ["offset", "../logs/own/drive.log", "--vehicle", "../trucks/own.toml", "--report", "../trucks/own.html"]
    assert run(verb) == 2
    assert "would overwrite" in capfd.readouterr().err
