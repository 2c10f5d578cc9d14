"""Every example runs and gives the results in the README."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from installed_plugins import installed
from real_data import real_drive

import oncenter as oc

EXAMPLES = Path(__file__).parents[1] / "examples"


def test_every_example_is_in_their_readme() -> None:
    page = (EXAMPLES / "README.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| `(.+?)`", page, re.MULTILINE)) == {
        path.name
        for path in EXAMPLES.iterdir()
        if path.suffix == ".toml" or (path / "pyproject.toml").is_file() or (path / "truck.toml").is_file()
    }


@pytest.mark.slow
def test_a_log_of_an_own_dbc_gives_the_offset_that_was_simulated(tmp_path: Path) -> None:
    folder, log = EXAMPLES / "own_dbc", tmp_path / "own.log"
    written = subprocess.run(
        [sys.executable, folder / "write_log.py", log], capture_output=True, text=True, timeout=120, check=True
    )
    assert written.stdout == f"wrote {log}; the true offset is 2.04 deg\n"
    truck = oc.vehicle(folder / "truck.toml")
    signals = oc.read(log, vehicle=truck)
    assert set(signals.sources) == set(truck.signals)
    answer = oc.offset(signals, truck).offset.to_dict()
    assert answer["status"] == "valid"
    assert answer["value"] == pytest.approx(2.04, abs=0.1)


def test_the_writer_of_a_log_of_an_own_dbc_explains_its_arguments() -> None:
    command = [sys.executable, EXAMPLES / "own_dbc" / "write_log.py", "--help"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0 and "LOG" in done.stdout and "SCENARIO" in done.stdout


def test_a_minute_nearly_straight_gives_an_offset_and_no_understeer_gradient(tmp_path: Path) -> None:
    segment, rav4 = str(real_drive("comma2k19_example")), str(EXAMPLES / "rav4.toml")
    run = installed(tmp_path, "comma2k19_reader")("offset", segment, "--vehicle", rav4, "--method", "thesis", "--json")
    assert run.returncode == 0, run.stderr
    answer = json.loads(run.stdout)
    low, high = answer["offset"]["ci95"]
    assert low < -0.13 < high  # the mean angle while driving straight
    assert abs(answer["offset"]["value"] - -0.13) < 0.5
    assert answer["understeer_gradient"]["status"] == "unobservable"


# Fitted in bends against the GNSS/INS heading instead of the gyro, see the drives' own README.
@pytest.mark.parametrize(("name", "offset_deg"), [("cpg_fast_lap", 0.27), ("cpg_slow_lap", 0.34)])
def test_the_car_on_the_proving_ground_has_the_offset_of_its_oxts(name: str, offset_deg: float) -> None:
    vehicle = oc.vehicle(EXAMPLES / "genesis.toml")
    answer = oc.offset(oc.read(real_drive(f"genesis/{name}.csv.gz"), names=vehicle.signal_names), vehicle)
    assert answer.offset.to_dict()["value"] == pytest.approx(offset_deg, abs=0.3)
    assert {"yaw_rate_bias", "lateral_acceleration_at_standstill"} <= {finding.code for finding in answer.findings}


@pytest.mark.parametrize(("name", "offset_deg"), [("cpg_fast_lap", 0.27), ("cpg_slow_lap", 0.34)])
def test_with_the_thesis_method_the_gyro_bias_shifts_the_offset(name: str, offset_deg: float) -> None:
    vehicle = oc.vehicle(EXAMPLES / "genesis.toml")
    signals = oc.read(real_drive(f"genesis/{name}.csv.gz"), names=vehicle.signal_names)
    answer = oc.offset(signals, vehicle, method="thesis")
    assert answer.offset.status in ("valid", "converging")  # its accelerometer makes the interval wide
    assert answer.offset.to_dict()["value"] - offset_deg == pytest.approx(-1.0, abs=0.5)
    assert {"yaw_rate_bias", "lateral_acceleration_at_standstill"} <= {finding.code for finding in answer.findings}


@pytest.mark.parametrize("name", ["cpg_fast_lap", "cpg_slow_lap"])
def test_with_the_limits_of_table_4_its_biased_accelerometer_closes_the_gate(name: str) -> None:
    vehicle = oc.vehicle(EXAMPLES / "genesis.toml")
    signals = oc.read(real_drive(f"genesis/{name}.csv.gz"), names=vehicle.signal_names)
    answer = oc.offset(signals, vehicle.model_copy(update={"params": {}}), method="thesis")
    assert answer.offset.status == "unobservable"
    assert "bank_max_m_s2" in next(finding.text for finding in answer.findings if finding.code == "gate_shut")
