"""Every example runs and says what its README says."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from real_data import ROOT as REAL_DATA
from real_data import real_drive

import oncenter as oc

EXAMPLES = Path(__file__).parents[1] / "examples"
DRIVE_OF = {"comma2k19.py": "comma2k19_example/processed_log"}


def example(name: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "ONCENTER_REAL_DATA": str(REAL_DATA)}
    command = [sys.executable, str(EXAMPLES / name), *arguments]
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize("name", sorted(path.name for path in EXAMPLES.glob("*.py")))
def test_an_example_runs(name: str) -> None:
    real_drive(DRIVE_OF[name])
    run = example(name)
    assert run.returncode == 0, run.stderr
    assert run.stdout


def test_every_example_is_in_their_readme() -> None:
    page = (EXAMPLES / "README.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| `(.+?)`", page, re.MULTILINE)) == {
        path.name for path in EXAMPLES.iterdir() if path.suffix in (".py", ".toml")
    }


def test_a_minute_nearly_straight_gives_an_offset_and_no_understeer_gradient() -> None:
    real_drive("comma2k19_example")
    said = example("comma2k19.py").stdout
    offset, half_width = map(float, re.match(r"straight-ahead offset (\S+) deg ± ([^\s;]+)", said).groups())
    assert abs(offset - -0.13) < half_width  # the mean angle while driving straight
    assert abs(offset - -0.13) < 0.5
    assert said.splitlines()[-1] == "understeer gradient: unobservable"


def test_an_example_without_its_drive_says_what_it_needs(tmp_path: Path) -> None:
    run = example("comma2k19.py", str(tmp_path))
    assert run.returncode == 1
    assert "Traceback" not in run.stderr
    assert "comma2k19 segment" in run.stderr


# Fitted in bends against the GNSS/INS heading instead of the gyro, see the drives' own README.
@pytest.mark.parametrize(("name", "offset_deg"), [("cpg_fast_lap", 0.27), ("cpg_slow_lap", 0.34)])
def test_the_car_on_the_proving_ground_answers_as_its_oxts_would(name: str, offset_deg: float) -> None:
    vehicle = oc.vehicle(EXAMPLES / "genesis.toml")
    answer = oc.offset(oc.read(real_drive(f"genesis/{name}.csv.gz"), names=vehicle.signal_names), vehicle)
    assert answer.offset.to_dict()["value"] == pytest.approx(offset_deg, abs=0.2)
    assert {"yaw_rate_bias", "lateral_acceleration_at_standstill"} <= {finding.code for finding in answer.findings}


@pytest.mark.parametrize(("name", "offset_deg"), [("cpg_fast_lap", 0.27), ("cpg_slow_lap", 0.34)])
def test_by_the_thesis_it_is_off_by_what_its_gyro_is_off(name: str, offset_deg: float) -> None:
    vehicle = oc.vehicle(EXAMPLES / "genesis.toml")
    signals = oc.read(real_drive(f"genesis/{name}.csv.gz"), names=vehicle.signal_names)
    answer = oc.offset(signals, vehicle, method="thesis")
    assert answer.offset.status in ("valid", "converging")  # its accelerometer makes the interval wide
    assert answer.offset.to_dict()["value"] - offset_deg == pytest.approx(-1.0, abs=0.5)
    assert {"yaw_rate_bias", "lateral_acceleration_at_standstill"} <= {finding.code for finding in answer.findings}


@pytest.mark.parametrize("name", ["cpg_fast_lap", "cpg_slow_lap"])
def test_with_the_limits_of_table_4_its_biased_accelerometer_shuts_the_gate(name: str) -> None:
    vehicle = oc.vehicle(EXAMPLES / "genesis.toml")
    signals = oc.read(real_drive(f"genesis/{name}.csv.gz"), names=vehicle.signal_names)
    answer = oc.offset(signals, vehicle.model_copy(update={"params": {}}), method="thesis")
    assert answer.offset.status == "unobservable"
    assert "bank_max_m_s2" in next(finding.text for finding in answer.findings if finding.code == "gate_shut")
