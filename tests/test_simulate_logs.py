"""Logs of simulated drives: every format has the sensors' values, and the same bytes in every run."""

from __future__ import annotations

import hashlib
import math
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import cantools
import numpy as np
import pytest
from drive_frames import DBC, database

import oncenter
from oncenter.cli import run
from oncenter.errors import OncenterError
from oncenter.files.log_formats import OF_FRAMES, WRITTEN
from oncenter.read import read
from oncenter.signals import SIGNALS
from oncenter.simulate import simulate, simulate_to_log, truth_files
from oncenter.simulate.can import BusFrames, four_bytes, frames
from oncenter.simulate.scenario import read_scenario
from oncenter.simulate.sensors import Sensed

FAULTY = """base = "thesis_drive"
about = "forty seconds with a receiver, a sensor without turns, and a gyro that fails"
[drive]
duration_s = 40.0
standing_at_start_s = 2.0
standing_at_end_s = 2.0
[sensors.gnss]
latitude_deg = 59.2
longitude_deg = 17.6
[sensors.steering_wheel_angle.relative]
turns = 1
[[sensors.steering_wheel_angle.relative.ignitions]]
begin_s = 20.0
off_s = 3.0
turns = -1
[[sensors.yaw_rate.failures]]
begin_s = 30.0
says = "error"
[[sensors.wheel_speed.failures]]
begin_s = 10.0
length_s = 2.0
says = "error"
[[sensors.gnss.failures]]
begin_s = 12.0
length_s = 2.0
[can]
"""
PUNCTUAL, LATE = "jitter_sd_ms = 0.0\n", "jitter_sd_ms = 0.3\n"
FRAME_LOGS = [suffix for suffix in WRITTEN if suffix in OF_FRAMES]

STAMP_S = 1e-6  # resolution of the stamps, after which the reader interpolates

# Half of J1939's resolution in SI and deg, and the number of ticks between two messages.
HALF_STEP = {
    "steering_wheel_angle": (1 / 2048, 1),
    "steering_wheel_angle_sensor_type": (0.0, 1),
    "yaw_rate": (1 / 16384, 1),
    "lateral_acceleration": (1 / 4096, 1),
    "longitudinal_acceleration": (0.05, 1),
    "vehicle_speed": (1 / 512 / 3.6, 10),
    **{f"wheel_speed_{c}": (1 / 512 / 3.6, 2) for c in ("front_left", "front_right", "rear_left", "rear_right")},
    "latitude": (0.5e-7, 10),
    "longitude": (0.5e-7, 10),
    "heading": (1 / 256, 10),
}


@pytest.fixture
def faulty(tmp_path: Path) -> Path:
    file = tmp_path / "faulty.toml"
    file.write_text(FAULTY + PUNCTUAL, encoding="utf-8")
    return file


@pytest.mark.parametrize("suffix", FRAME_LOGS)
def test_a_log_of_frames_reads_back_within_j1939_s_resolution(faulty: Path, tmp_path: Path, suffix: str) -> None:
    simulate_to_log(faulty, 2, tmp_path / f"drive{suffix}")
    said, _ = simulate(faulty, 2)
    again = read(tmp_path / f"drive{suffix}")
    assert again.rate_hz == 100.0
    assert set(again.sources) == set(said.sources) == set(HALF_STEP)
    assert again.table.height == said.table.height
    np.testing.assert_allclose(np.diff(again.table["time_s"]), 0.01, atol=2e-6)
    for name, (half_step, every) in HALF_STEP.items():
        there, back = (s.table[SIGNALS[name].column].to_numpy()[::every] for s in (said, again))
        error, change = (
            (difference + 180.0) % 360.0 - 180.0 if name == "heading" else difference
            for difference in (back - there, np.diff(there))
        )
        np.testing.assert_array_equal(np.isnan(back), np.isnan(there), err_msg=name)
        between = np.nanmax(np.abs(change)) * STAMP_S / (every * 0.01)
        assert np.nanmax(np.abs(error)) <= half_step + between + 1e-9, name


@pytest.mark.parametrize("suffix", [".csv", ".csv.gz", ".parquet"])
def test_a_table_reads_back_to_the_last_bit(faulty: Path, tmp_path: Path, suffix: str) -> None:
    simulate_to_log(faulty, 2, tmp_path / f"drive{suffix}")
    said, _ = simulate(faulty, 2)
    again = read(tmp_path / f"drive{suffix}").table
    assert set(again.columns) == set(said.table.columns)
    for column in again.columns:
        np.testing.assert_array_equal(again[column].to_numpy(), said.table[column].to_numpy(), err_msg=column)


@pytest.mark.slow
def test_two_processes_at_two_times_in_two_zones_and_folders_write_the_same_bytes(tmp_path: Path) -> None:
    (tmp_path / "faulty.toml").write_text(FAULTY + LATE, encoding="utf-8")
    code = (
        "import sys, time; from oncenter.simulate import simulate_to_log\n"
        "from oncenter.files.log_formats import WRITTEN\n"
        "real = time.time; time.time = lambda: real() + float(sys.argv[2])\n"
        "for suffix in WRITTEN: simulate_to_log(sys.argv[1], 7, 'drive' + suffix)\n"
    )
    digests = []
    for folder, zone, ahead_s, salt in (("here", "UTC", 0, "1"), ("there", "Asia/Tokyo", 1e6, "2")):
        (tmp_path / folder).mkdir()
        subprocess.run(
            [sys.executable, "-c", code, str(tmp_path / "faulty.toml"), str(ahead_s)],
            cwd=tmp_path / folder,
            env=os.environ
            | {"TZ": zone, "PYTHONHASHSEED": salt, "PYTHONPATH": str(Path(oncenter.__file__).parents[1])},
            check=True,
        )
        files = sorted((tmp_path / folder).iterdir())
        digests.append({file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files})
    assert digests[0] == digests[1]
    assert len(digests[0]) == len(WRITTEN) + 2  # and the truth's


def test_another_seed_changes_every_format(tmp_path: Path) -> None:
    (tmp_path / "faulty.toml").write_text(FAULTY + LATE, encoding="utf-8")
    for suffix in (".blf", ".mf4", ".csv.gz"):
        for seed in (1, 2):
            simulate_to_log(tmp_path / "faulty.toml", seed, tmp_path / f"{seed}{suffix}")
        assert (tmp_path / f"1{suffix}").read_bytes() != (tmp_path / f"2{suffix}").read_bytes()


def test_drives_of_different_seeds_are_of_different_days(tmp_path: Path) -> None:
    (tmp_path / "faulty.toml").write_text(FAULTY, encoding="utf-8")
    for suffix in (".log", ".asc", ".blf", ".mf4"):
        begin_s = []
        for seed in (1, 3):
            simulate_to_log(tmp_path / "faulty.toml", seed, tmp_path / f"{seed}{suffix}")
            begin_s.append(read(tmp_path / f"{seed}{suffix}").table["time_s"][0])
        assert begin_s[1] - begin_s[0] == pytest.approx(2 * 86_400, abs=0.1), suffix


def on_the_bus(tmp_path: Path) -> tuple[BusFrames, Sensed]:
    from oncenter.simulate import _simulate

    (tmp_path / "faulty.toml").write_text(FAULTY + LATE, encoding="utf-8")
    sensed, _ = _simulate(read_scenario(tmp_path / "faulty.toml"), 1)
    return frames(sensed, jitter_sd_s=0.0003, seed=1), sensed


def payloads(bus: BusFrames, pgn: int) -> np.ndarray:
    return bus.payload[(bus.identifier >> 8 & 0x3FFFF) == pgn]


def test_a_failed_sensor_sends_error_and_a_silent_one_not_available(tmp_path: Path) -> None:
    bus, _ = on_the_bus(tmp_path)
    vdc2 = payloads(bus, 61449)
    assert (vdc2[3000:, 3:5].view("<u2") == 0xFEFF).all()  # the yaw rate's error
    assert (vdc2[:3000, 3:5].view("<u2") < 0xFB00).all()
    assert (vdc2[2000:2300, 0:2].view("<u2") == 0xFFFF).all()  # the angle's silence
    assert (np.delete(vdc2, slice(2000, 2300), 0)[:, 0:2].view("<u2") < 0xFB00).all()
    assert (vdc2[:, 2] == 0x3F).all()  # a relative sensor, SPN 1812 is 0, without a turn counter
    assert (payloads(bus, 65134)[500:600].view("<u2") == 0xFEFF).all()  # all four wheels' error
    ebc2 = payloads(bus, 65215)
    assert (ebc2[100:120, 0:2].view("<u2") == 0xFEFF).all()
    assert (ebc2[100:120, 2:6] == 0xFE).all()
    assert (payloads(bus, 65267)[120:140] == 0xFF).all()  # the receiver's silence
    assert (payloads(bus, 65256)[120:140, :4] == 0xFF).all()


def test_every_message_has_the_sensors_values_by_the_shipped_dbc(tmp_path: Path) -> None:
    """Decoded by cantools, every hundredth frame."""
    bus, sensed = on_the_bus(tmp_path)
    table = sensed.signals.table
    speed = sensed.speed_over_ground_m_s
    assert speed is not None
    for name, pgn, every, says in (
        ("VP", 65267, 10, {"Latitude": table["latitude_deg"], "Longitude": table["longitude_deg"]}),
        ("VDS", 65256, 10, {"CompassBearing": table["heading_deg"], "NavigationBasedVehicleSpeed": speed * 3.6}),
        ("VDC2", 61449, 1, {"SteeringWheelAngle": table["steering_wheel_angle_rad"]}),
    ):
        message = database().get_message_by_name(name)
        for k, payload in list(enumerate(payloads(bus, pgn)))[:110:10]:
            decoded: Any = message.decode(payload.tobytes())
            for signal, values in says.items():
                step = message.get_signal_by_name(signal).scale
                off = decoded[signal] - values[k * every]
                assert min(abs(off), abs(360.0 - abs(off))) <= step * 0.501, (name, signal, k)


def test_the_receiver_gives_the_speed_over_ground(tmp_path: Path) -> None:
    _, sensed = on_the_bus(tmp_path)
    speed = sensed.signals.table["vehicle_speed_m_s"].to_numpy()
    assert sensed.speed_over_ground_m_s is not None
    assert np.nanmax(np.abs(sensed.speed_over_ground_m_s - speed)) < 0.1


def test_four_byte_codes_for_error_and_not_available_are_j1939_s() -> None:
    latitude = four_bytes(np.array([math.nan, math.inf, -211.0, -210.0, 59.2]), 1e-7, -210.0)
    raw = round((59.2 + 210.0) / 1e-7)
    assert latitude.tobytes().hex() == "ffffffff" + "fffffffe" * 2 + "00000000" + raw.to_bytes(4, "little").hex()


def test_the_mf4_is_bus_logging_that_other_tools_decode(faulty: Path, tmp_path: Path) -> None:
    from asammdf import MDF

    simulate_to_log(faulty, 2, tmp_path / "drive.mf4")
    said, _ = simulate(faulty, 2)
    with MDF(tmp_path / "drive.mf4") as mdf:
        decoded = mdf.extract_bus_logging({"CAN": [(str(DBC), 0)]})
        angle = decoded.get("SteeringWheelAngle", ignore_invalidation_bits=True)
    there = said.table["steering_wheel_angle_rad"].to_numpy()
    number = ~np.isnan(there)
    assert len(angle.samples) == len(there)
    np.testing.assert_allclose(angle.samples[number], there[number], atol=1 / 2048 * 1.001)


def test_position_and_heading_in_the_shipped_dbc_are_the_standard_s() -> None:
    loaded = cantools.database.load_file(DBC)
    for name, pgn, spns in (("VP", 65267, {584, 585}), ("VDS", 65256, {165, 517})):
        message = loaded.get_message_by_name(name)
        assert message.frame_id >> 8 & 0x3FFFF == pgn
        assert {signal.spn for signal in message.signals} == spns


def test_the_truth_files_have_the_log_s_name(tmp_path: Path) -> None:
    for name in ("drive.log", "drive.csv.gz", "drive.one.mf4"):
        stem = name.removesuffix(".log").removesuffix(".csv.gz").removesuffix(".mf4")
        table, summary = truth_files(tmp_path / name)
        assert (table.name, summary.name) == (f"{stem}.truth.parquet", f"{stem}.truth.toml")
        assert table.parent == summary.parent == tmp_path


def test_the_simulate_command_prints_the_files_it_wrote(
    faulty: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "drive.csv.gz"
    assert run(["simulate", str(faulty), "--seed", "4", "--output", str(log)]) == 0
    written = [log, tmp_path / "drive.truth.parquet", tmp_path / "drive.truth.toml"]
    assert capsys.readouterr().out.strip() == "wrote " + ", ".join(map(str, written))
    assert all(file.stat().st_size > 0 for file in written)
    assert run(["simulate", str(faulty), "--output", str(tmp_path / "drive.xls")]) == 2
    assert ".csv.gz" in capsys.readouterr().err


@pytest.mark.parametrize("suffix", WRITTEN)
def test_a_log_that_cannot_be_written_is_refused_in_one_line(faulty: Path, tmp_path: Path, suffix: str) -> None:
    full = tmp_path / f"full{suffix}"
    full.symlink_to("/dev/full")  # where every write fails
    folder = tmp_path / f"folder{suffix}"
    folder.mkdir()
    nowhere = tmp_path / "nowhere" / f"drive{suffix}"
    for log in (full, folder, nowhere):
        with pytest.raises(OncenterError, match=re.escape(str(log))) as refusal:
            simulate_to_log(faulty, 1, log)
        assert (refusal.value.code, refusal.value.exit_code) == ("output", 2)
    assert not nowhere.parent.exists()


def test_light_formats_are_written_without_heavy_libraries(faulty: Path, tmp_path: Path) -> None:
    code = (
        "import sys; from oncenter.simulate import simulate_to_log\n"
        f"for s in ('log', 'csv', 'parquet'): simulate_to_log({str(faulty)!r}, 1, {str(tmp_path)!r} + '/drive.' + s)\n"
        "print([m for m in ('can', 'cantools', 'asammdf', 'pandas', 'bokeh', 'matplotlib') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
