"""Missing parts of a damaged log are reported with a count, or with the seconds that were read."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from test_read_formats import written

from oncenter.cli import run
from oncenter.read import read
from oncenter.signals import Signals

Lines = list[bytes]
HEADER = b"time_s,steering_wheel_angle_deg,yaw_rate_deg_s,vehicle_speed_km_h"


def csv_lines() -> Lines:
    time = np.arange(1000) * 0.01
    return [HEADER, *(f"{t:.2f},{np.sin(t):.9f},{np.cos(t):.9f},{50 + t:.9f}".encode() for t in time), b""]


def damaged(folder: Path, suffix: str, change: Callable[[Lines, int], object]) -> tuple[str, ...]:
    """The notes on a log whose middle line, one of VDC2, is damaged by `change`."""
    whole = csv_lines() if suffix == ".csv" else written(folder, suffix).read_bytes().split(b"\n")
    assert read_back(folder, suffix, whole).notes == ()
    middle = next(
        k for k, line in enumerate(whole) if k >= len(whole) // 2 and (b"18F0093E" in line or suffix == ".csv")
    )
    change(whole, middle)
    return read_back(folder, suffix, whole).notes


def read_back(folder: Path, suffix: str, lines: Lines) -> Signals:
    (folder / f"d{suffix}").write_bytes(b"\n".join(lines))
    return read(folder / f"d{suffix}")


def garbage(lines: Lines, k: int) -> None:
    lines[k] = b"\x00\xff garbage"


def zeros(lines: Lines, k: int) -> None:
    lines[k] = b"\0" * 300


def half(lines: Lines, k: int) -> None:
    lines[k] = lines[k][: len(lines[k]) // 2]


def less(lines: Lines, k: int) -> None:
    lines[k] = lines[k].rstrip()[:-30] if b"Length" in lines[k] else lines[k].rstrip()[:-4]


def again(lines: Lines, k: int) -> None:
    lines[k:k] = [lines[k]] * 3


@pytest.mark.parametrize(
    ("suffix", "change", "words"),
    [
        (".log", garbage, "left out 1 line of d.log not in candump format"),
        (".log", half, "left out 1 line of d.log not in candump format"),
        (
            ".log",
            less,
            "1 frame of PGN 61449 in d.log with fewer bytes than others: the missing bytes count as not available",
        ),
        (".asc", garbage, "left out 1 line of d.asc that are not CAN frames, the first reads "),
        (".asc", zeros, "left out 1 line of d.asc that are not CAN frames, the first reads "),
        (".asc", half, "left out 1 line of d.asc that are not CAN frames, the first reads "),
        (".trc", garbage, "left out 1 line of d.trc"),
        (".trc", zeros, "left out 1 line of d.trc"),
        (".csv", half, "left out 1 row of d.csv with fewer cells than the header, first row 501"),
        (".csv", zeros, "left out 1 row of d.csv with fewer cells than the header, first row 501"),
        (".csv", again, "left out 3 rows of d.csv with the time of the row before"),
    ],
)
def test_a_damaged_line_gives_a_note(
    suffix: str, change: Callable[[Lines, int], object], words: str, tmp_path: Path
) -> None:
    assert [note for note in damaged(tmp_path, suffix, change) if note.startswith(words)]


def test_the_last_number_of_a_cut_row_is_not_used(tmp_path: Path) -> None:
    """50.123456789 km/h may have become 5."""

    def cut(lines: Lines, k: int) -> None:
        lines[k] = b"5.00,0.5,5"

    damaged(tmp_path, ".csv", cut)
    yaw_rate = read(tmp_path / "d.csv").table["yaw_rate_rad_s"].to_numpy()
    assert len(yaw_rate) == 999 and np.abs(yaw_rate).max() < 0.02


@pytest.mark.parametrize("suffix", [".log", ".asc", ".trc", ".csv"])
def test_a_cut_off_log_gives_the_seconds_that_were_read(suffix: str, tmp_path: Path) -> None:
    lines = csv_lines() if suffix == ".csv" else written(tmp_path, suffix).read_bytes().split(b"\n")
    begun = [*lines[: len(lines) // 2], lines[len(lines) // 2].rstrip()[:-8]]
    if suffix == ".csv":
        begun[-1] = begun[-1].rpartition(b",")[0]
    signals = read_back(tmp_path, suffix, begun)
    seconds = signals.table["time_s"][-1] - signals.table["time_s"][0]
    (note,) = [note for note in signals.notes if "cut off" in note]
    assert note == f"the last line of d{suffix} is cut off and was left out; {seconds:.1f} s were read"


def test_an_unclosed_binary_log_gives_the_seconds_that_were_read(tmp_path: Path) -> None:
    content = bytearray(written(tmp_path, ".blf").read_bytes())
    content[16:24] = bytes(8)  # its size, which the logger writes last
    (tmp_path / "open.blf").write_bytes(content)
    (note,) = read(tmp_path / "open.blf").notes
    assert note == "the logger did not close open.blf: it was read up to its last complete part; 4.0 s were read"


LONG_CAN_FD = {
    ".log": b"(1700000002.000300) can0 18F0093E##1697D7F637D577F7D00112233",
    ".asc": b"   2.000300 CANFD   1 Rx 18F0093Ex   1 0 9  12 69 7D 7F 63 7D 57 7F 7D 0 0 0 0 130000 130 3000 0 0 0 0",
    ".trc": b"      2      2000.300 FB  1 18F0093E Rx -  9    69 7D 7F 63 7D 57 7F 7D 00 00 00 00",
}


@pytest.mark.parametrize("suffix", LONG_CAN_FD)
def test_long_can_fd_frames_are_counted(suffix: str, tmp_path: Path) -> None:
    notes = damaged(tmp_path, suffix, lambda lines, k: lines.insert(k, LONG_CAN_FD[suffix]))
    assert notes == (f"left out 1 CAN FD frame of more than 8 bytes, which no database describes, in d{suffix}",)


def test_cut_off_notes_are_in_text_and_json_of_both_commands(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "d.csv"
    log.write_bytes(b"\n".join([*csv_lines()[:-1], b"10.00,0.5,0.1"]))
    for verb in (["signals", str(log)], ["offset", str(log), "--vehicle", "scania_r730_4x2", "--method", "thesis"]):
        arguments = [*verb, *(["--no-accelerometer"] if verb[0] == "offset" else [])]
        assert run(arguments) == 0
        said = " ".join(capsys.readouterr().out.split())
        assert "note: the last line of d.csv is cut off and was left out; 10.0 s were read" in said
        assert run([*arguments, "--json"]) == 0
        assert "10.0 s were read" in json.loads(capsys.readouterr().out)["notes"][0]
