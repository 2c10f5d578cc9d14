"""Mutated vehicle files, scenarios, DBCs and logs: each is accepted, or refused in one line."""

from __future__ import annotations

import bz2
import gzip
import json
import lzma
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from drive_frames import START_S, Frame, candump, drive
from mutated_text import mutated
from test_estimate import steady_drive
from test_read_busmaster import busmaster, canhacker, j1939
from test_read_formats import asc
from test_read_frame_table import canedge, clx, gvret, python_can
from test_read_packed import archive, archive_of, zstd

from oncenter.cli import run as command
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.child import READER_DEATHS
from oncenter.read import read
from oncenter.signals import SignalName
from oncenter.simulate.scenario import read_scenario
from oncenter.vehicle import vehicle

ROOT = Path(__file__).parents[1]
VEHICLES = sorted([*ROOT.glob("vehicles/*.toml"), *ROOT.glob("examples/*.toml")])
SCENARIOS = sorted(ROOT.glob("scenarios/*.toml"))
DBCS = sorted(ROOT.glob("dbc/*.dbc"))
_LINE_MAX = 4500  # characters of a message

HAND_MADE = """VERSION ""
BU_: Vector__XXX
BO_ 256 ANGLE: 8 Vector__XXX
 SG_ page M : 0|4@1+ (1,0) [0|15] "" Vector__XXX
 SG_ wheel m0 : 15|16@0- (0.1,0) [-800|800] "deg" Vector__XXX
 SG_ turn_rate m1 : 32|32@1- (1,0) [-10|10] "rad/s" Vector__XXX
BO_ 257 SPEED: 8 Vector__XXX
 SG_ pace : 0|64@1- (1,0) [0|0] "km/h" Vector__XXX
 SG_ lateral_acceleration_m_s2 : 7|1@0+ (1,-0.5) [0|0] "m/s^2" Vector__XXX
CM_ SG_ 256 wheel "by hand";
SIG_VALTYPE_ 256 turn_rate : 1;
SG_MUL_VAL_ 256 turn_rate page 1-1, 3-5;
SIG_VALTYPE_ 257 pace : 2;
"""
NAMES = {
    "steering_wheel_angle": SignalName("wheel", None, 1),
    "yaw_rate": SignalName("ANGLE.turn_rate", None, -1),
    "vehicle_speed": SignalName("pace", "km_h", 1),
}


def one_line(refused: OncenterError) -> bool:
    message = str(refused)
    return message.isprintable() and len(message) < _LINE_MAX and refused.exit_code == WRONG_USAGE


def survivors(
    read_file: Callable[[Path], object], originals: list[bytes], seeds: range, folder: Path, suffix: str
) -> list[Path]:
    """The accepted mutants; anything other than a one-line error is raised."""
    taken = []
    for seed in seeds:
        file = folder / f"seed{seed}{suffix}"
        file.write_bytes(mutated(originals[seed % len(originals)], seed))
        try:
            read_file(file)
        except OncenterError as refused:
            assert one_line(refused), (seed, refused)
        else:
            taken.append(file)
    return taken


def test_a_mutated_scenario_is_a_scenario_or_refused_in_one_line(tmp_path: Path) -> None:
    originals = [file.read_bytes() for file in SCENARIOS]
    assert survivors(read_scenario, originals, range(300), tmp_path, ".toml")


def test_a_mutated_vehicle_file_is_a_vehicle_that_answers_or_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    originals = [file.read_bytes() for file in VEHICLES]
    log = tmp_path / "drive.parquet"
    steady_drive().table.head(1500).write_parquet(log)
    taken = survivors(vehicle, originals, range(500), tmp_path, ".toml")
    assert len(taken) > 50
    for file in taken[::20]:
        assert command(["offset", str(log), "--vehicle", str(file), "--json"]) in (0, 1, 2), file
        json.loads(capsys.readouterr().out)


def frames() -> list[Frame]:
    """The usual drive, and the same on the identifiers of the DBC made by hand."""
    given = []
    for tick in range(200):
        time = START_S + 0.01 * tick
        angle = int(100 * np.sin(0.1 * tick)) & 0xFFFF
        given += [
            Frame(time, 256, bytes([0]) + angle.to_bytes(2, "big") + bytes(5), extended=False),
            Frame(time + 1e-3, 256, bytes([1, 0, 0, 0]) + np.float32(0.1).tobytes(), extended=False),
            Frame(time + 2e-3, 257, np.float64(36.0).tobytes(), extended=False),
        ]
    return sorted([*drive(2.0), *given], key=lambda frame: frame.time)


def read_with(log: Path) -> Callable[[Path], object]:
    """Reads a log by a DBC. That the log lacks a signal then is no refusal of the DBC."""

    def read_by(dbc: Path) -> object:
        try:
            return read(log, names=NAMES, dbc=[dbc])
        except OncenterError as error:
            if error.exit_code == 1 and "\n" not in str(error):
                return None
            raise

    return read_by


def test_a_mutated_dbc_reads_a_log_or_is_refused_in_one_line(tmp_path: Path) -> None:
    log = tmp_path / "drive.log"
    log.write_text(candump(frames()))
    assert read(log, names=NAMES, dbc=[_hand_made(tmp_path)]).sources["yaw_rate"].description.startswith("ANGLE")
    originals = [*(file.read_bytes() for file in DBCS), HAND_MADE.encode(), HAND_MADE.encode()]
    assert survivors(read_with(log), originals, range(240), tmp_path, ".dbc")


def _hand_made(folder: Path) -> Path:
    file = folder / "by_hand.dbc"
    file.write_text(HAND_MADE)
    return file


def _logs() -> dict[str, bytes]:
    """A small log of each format and packing that only text or bytes mutate."""
    sent = list(drive(2.0))
    short = [*sent[:400], Frame(START_S + 3.0, 0x123, b"\x01\xff\x00", extended=False)]
    text = candump(sent).encode()
    flexible = [f"({START_S + 0.01 * k:.6f}) can0 18F0093E##1{bytes(range(k % 9 * 8)).hex()}\n" for k in range(300)]
    return {
        "savvycan.csv": gvret(short).encode(),
        "canedge.csv": canedge(short).encode(),
        "python_can.csv": python_can(short).encode(),
        "clx000.txt": clx(short).encode(),
        "busmaster.log": busmaster(short).encode(),
        "j1939.log": j1939(sent).encode(),
        "canhacker.trc": canhacker(short).encode(),
        "utf_16.asc": asc().encode("utf-16"),
        "can_fd.log": "".join(flexible).encode(),
        "drive.log.gz": gzip.compress(text),
        "drive.log.bz2": bz2.compress(text),
        "drive.log.xz": lzma.compress(text),
        "drive.log.zst": zstd(text),
        "drive.zip": archive(text),
        "drives.zip": archive_of({"a.log": text, "b/c.csv": canedge(sent).encode()}),
    }


LOGS = _logs()


@pytest.mark.slow
@pytest.mark.parametrize("name", LOGS)
def test_a_mutated_log_is_read_or_refused_in_one_line(name: str, tmp_path: Path) -> None:
    file, taken = tmp_path / name, 0
    for seed in range(500):
        file.write_bytes(mutated(LOGS[name], seed))
        began = time.monotonic()
        try:
            read(file)
        except OncenterError as refused:
            message = str(refused)
            assert message.isprintable() and len(message) < _LINE_MAX and refused.exit_code == 1, (seed, message)
            assert refused.code not in READER_DEATHS, (seed, message)
        else:
            taken += 1
        assert time.monotonic() - began < 20.0, seed
    assert taken > 10 or name == "drives.zip"
