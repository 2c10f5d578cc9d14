"""docs/simulink_carmaker.md: its tables are those of the FMU, and its recipe for a recording works."""

from __future__ import annotations

import json
import re
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from asammdf import MDF, Signal
from test_estimate import steady_drive

from oncenter import _core
from oncenter.cli import run
from oncenter.signals import PURE_NUMBER, SIGNALS

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "simulink_carmaker.md"


@pytest.fixture(scope="module")
def command() -> dict[str, Any]:
    return runpy.run_path(str(ROOT / "docs" / "make_fmu_table.py"))


def test_each_input_has_a_sign_and_each_sign_has_its_variable(command: dict[str, Any]) -> None:
    variables = {v.attrib["name"]: v.attrib["causality"] for v in command["described"]()}
    inputs = {name for name, role in variables.items() if role == "input" and not name.endswith("_available")}
    inputs -= {name for name, signal in SIGNALS.items() if signal.quantity is PURE_NUMBER}  # statuses
    assert inputs <= set(command["POSITIVE"]) <= set(variables)


def test_the_page_has_the_fmus_names_of_inputs_parameters_and_statuses(command: dict[str, Any]) -> None:
    names = {v.attrib["name"] for v in command["described"]()}
    prose = PAGE.read_text(encoding="utf-8").split(command["BEGIN"])[0]
    mapped = re.findall(r"^\| `(\w+)`", prose.split("## CANoe")[0], re.MULTILINE)
    assert len(mapped) > 5 and set(mapped) <= names
    assert set(re.findall(r"`(vehicle\.\w+)`", prose)) <= names
    assert ", ".join(f"{k} {name}" for k, name in enumerate(_core.STATUSES)) in prose
    assert "side-slip" in _core.ANGLE_METHODS


def test_a_recording_by_the_a2l_files_names_is_answered_with_the_pages_vehicle_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (signals,) = re.findall(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    Path("truck.toml").write_text(f"wheelbase_m = 3.7\nsteering_ratio = 19.3\n{signals}", encoding="utf-8")
    table = steady_drive().table
    columns = {
        "vehicle_speed": ("vehicle_speed_m_s", "m/s"),
        "lateral_acceleration": ("lateral_acceleration_m_s2", "m/s2"),
    }
    columns |= {"steering_wheel_angle": ("steering_wheel_angle_rad", "deg"), "yaw_rate": ("yaw_rate_rad_s", "deg/s")}
    time = table["time_s"].to_numpy() - table["time_s"][0]
    with MDF(version="4.10") as recording:
        for name, (column, unit) in columns.items():
            values = table[column].to_numpy()
            shown = np.degrees(values) if unit.startswith("deg") else values
            recording.append([Signal(shown, time, name=f"oncenter_tick.{name}", unit=unit)])
        recording.save("rec.mf4")
    assert run(["offset", "rec.mf4", "--vehicle", "truck.toml", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["offset"]["status"] != "unobservable"
    assert answer["offset"]["value"] is not None
