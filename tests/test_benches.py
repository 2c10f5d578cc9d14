"""Every bench runs, with sizes too small for meaningful figures, and without writing a page."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from browser import skip_without_browser

BENCH = Path(__file__).parents[1] / "bench"
SMALL = {
    "accuracy": "--tuning --drives 1 --rows ordinary,no_play --methods joint,thesis,rls",
    "angle": "--tuning --drives 1 --only ordinary,payload,faults",
    "angle_lag": "--smoke --jobs 1",
    "by_database": "--scenario mid_speed_manoeuvre --only _steering_sensors_c",
    "compare": "--tuning --pairs 1 --jobs 1",
    "effects": "--tuning --drives 1 --rows none,pull --jobs 1",
    "file_faults": "--smoke --jobs 1",
    "flanks": "FOLDER --smoke --jobs 1",
    "fleet": "FOLDER --smoke --part changes kill",
    "fleet_priors": "FOLDER --smoke --jobs 1",
    "fleet_pulls": "--smoke --jobs 1",
    "frozen_signals": "--smoke --jobs 1",
    "gyro_bias": "--seeds 1",
    "healthy": "--smoke --jobs 1",
    "live": "--seconds 20",
    "noisy_logs": "FOLDER --smoke --jobs 1",
    "one_truck": "FOLDER --smoke --jobs 1",
    "sensitivity": "FOLDER RESULTS --smoke --jobs 1",
    "sensor_faults": "--smoke --jobs 1",
    "simulate": "--minutes 0.5 --rounds 1",
    "unknown_truck": "--smoke --jobs 1",
    "torque": "--drives 1 --rows ordinary --seconds 120",
    "trucks": "FOLDER --smoke --jobs 1",
    "wrong_statements": "FOLDER --smoke",
    "drives_that_differ": "--smoke --jobs 1",
    "two_parts": "--tuning --drives 1 --rows ordinary,population --jobs 1",
    "speed": "--ticks 20000 --frames 20000 --rounds 1",
    "speed_page": "--scenario mid_speed_manoeuvre --formats .log,.mf4,.csv.gz --ticks 24000 --rounds 1",
}
CALLED_BY_OTHERS = {"cold", "cold_steps", "fleet_drives", "log_to_answer"}


def test_no_bench_is_left_out() -> None:
    commands = {file.stem for file in BENCH.glob("*.py") if "__main__" in file.read_text(encoding="utf-8")}
    assert commands == SMALL.keys() | CALLED_BY_OTHERS


@pytest.mark.slow
@pytest.mark.parametrize("name", SMALL)
def test_a_bench_runs(name: str, tmp_path: Path) -> None:
    if name == "live":
        skip_without_browser()
    arguments = (
        SMALL[name].replace("FOLDER", str(tmp_path / "fleet")).replace("RESULTS", str(tmp_path / "results")).split()
    )
    done = subprocess.run(
        [sys.executable, BENCH / f"{name}.py", *arguments], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert re.search(r"\d", done.stdout), "no figure"
