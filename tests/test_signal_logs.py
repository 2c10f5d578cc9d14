"""MATLAB, ROS, Racelogic and INCA: the drive that was saved is read, by each verb, and what cannot be is one line."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import polars as pl
import pytest
import scipy.io
import signal_logs
from drive_frames import truth
from planted_faults import drive
from rosbags.rosbag2 import StoragePlugin

from oncenter.cli import run
from oncenter.errors import OncenterError
from oncenter.fleet import run as fleet_run
from oncenter.read import read, require
from oncenter.read.here import read_here
from oncenter.signals import DEGREE, SignalName, Signals

COLUMNS = ("steering_wheel_angle_rad", "yaw_rate_rad_s", "vehicle_speed_m_s", "lateral_acceleration_m_s2")
VEHICLE = """wheelbase_m = 3.7
steering_ratio = 19.3
track_width_rear_m = 1.83

"""
WRITERS: dict[str, Callable[[pl.DataFrame, Path], None]] = {
    **{f"drive{suffix}": writer for suffix, writer in signal_logs.WRITERS.items()},
    "version_4.mat": signal_logs.mat_4,
    "version_73.mat": signal_logs.mat_hdf5,
    "scope.mat": signal_logs.simulink,
    "mcap_folder": signal_logs.ros_folder,
    "db3_folder": lambda table, folder: signal_logs.ros_folder(table, folder, StoragePlugin.SQLITE3),
}


def short() -> pl.DataFrame:
    t = np.arange(400) / 100
    return pl.DataFrame({"time_s": t, **truth(t)})


def names_of(log: Path) -> dict[str, SignalName]:
    return signal_logs.names_for(log.suffix or ".bag")


def refusal(log: Path, names: dict[str, SignalName] | None = None) -> OncenterError:
    with pytest.raises(OncenterError) as refused:
        read(log, names=names)
    assert "\n" not in str(refused.value) and log.name in str(refused.value)
    return refused.value


def mat(folder: Path, **variables: object) -> Path:
    scipy.io.savemat(folder / "x.mat", variables)
    return folder / "x.mat"


# ---------------------------------------------------------------------------------------------------------------------
# There and back
# ---------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", WRITERS)
def test_a_drive_comes_back_as_it_was_saved(name: str, tmp_path: Path) -> None:
    table, log = short(), tmp_path / name
    WRITERS[name](table, log)
    signals = read(log, names=names_of(log))
    assert (signals.rate_hz, signals.table.height) == (100.0, 400)
    since = signals.table["time_s"].to_numpy() - signals.table["time_s"][0]
    for column in COLUMNS:
        exact = np.interp(since, table["time_s"], table[column])
        assert np.abs(signals.table[column].to_numpy() - exact).max() < 1e-6, column


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], dict[str, object]]:
    """What `oncenter offset --json` says of a drive of five minutes that was saved under a name."""
    folder = tmp_path_factory.mktemp("drives")
    table = drive().table.select("time_s", *COLUMNS)

    def answer(name: str) -> dict[str, object]:
        log = folder / name
        table.write_csv(log) if name.endswith(".csv") else WRITERS[name](table, log)
        truck = folder / f"{name}.toml"
        entries = (
            f'{signal} = {{ name = "{entry.name}"' + (f', unit = "{entry.unit}" }}' if entry.unit else " }")
            for signal, entry in names_of(log).items()
        )
        truck.write_text(VEHICLE + ("" if name.endswith(".csv") else "[signals]\n" + "\n".join(entries)))
        ended = subprocess.run(
            [sys.executable, "-m", "oncenter", "offset", log, "--vehicle", truck, "--json"],
            capture_output=True,
            text=True,
            check=True,
        )
        given: dict[str, object] = json.loads(ended.stdout)
        return given

    return answer


NUMBERS = ("offset", "understeer_gradient", "backlash", "yaw_rate_bias", "lateral_acceleration_bias", "time")


@pytest.mark.parametrize("name", WRITERS)
def test_the_offset_is_that_of_the_same_drive_as_csv(
    name: str, answers: Callable[[str], dict[str, object]], request: pytest.FixtureRequest
) -> None:
    by_csv = request.config.cache.get("by_csv", None) if False else answers("drive.csv")
    other = answers(name)
    for number in NUMBERS:
        assert same(by_csv[number], other[number]), (number, by_csv[number], other[number])


def same(one: object, other: object) -> bool:
    """Of numbers, to what is left of them in a text or beside a date."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, float) and isinstance(other, int | float):
        return abs(one - other) <= 2e-3 * max(1.0, abs(one))
    return one == other
