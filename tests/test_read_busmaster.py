"""BUSMASTER's `.log` and CANHacker's `.trc`."""

from __future__ import annotations

import re
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from drive_frames import START_S, Frame, candump, drive
from test_read_can_fd import octets

from oncenter.errors import OncenterError
from oncenter.read import read, text_blocks
from oncenter.read.frames import Frames, joined
from oncenter.read.frames_of_log import frames_of_log


def clock(seconds: float) -> str:
    tenths = round(seconds * 1e4)
    return f"{tenths // 36_000_000:02d}:{tenths // 600_000 % 60:02d}:{tenths // 10_000 % 60:02d}:{tenths % 10_000:04d}"


def head(mode: str = "SYSTEM", base: str = "HEX", columns: str = "") -> list[str]:
    begun = datetime.fromtimestamp(START_S)
    date = f"{begun.day}:{begun.month}:{begun.year} {begun.hour}:{begun.minute}:{begun.second}:000"
    return [
        "***BUSMASTER Ver 3.2.2***", f"***PROTOCOL {'J1939' if columns else 'CAN'}***",
        "***NOTE: PLEASE DO NOT EDIT THIS DOCUMENT***",
        "***[START LOGGING SESSION]***", f"***START DATE AND TIME {date}***", f"***{base}***", f"***{mode} MODE***",
        "***START CHANNEL BAUD RATE***", "***CHANNEL 1 - Kvaser - 250000 bps***", "***END CHANNEL BAUD RATE***",
        "***START DATABASE FILES***", "***END OF DATABASE FILES***",
        columns or "***<Time><Tx/Rx><Channel><CAN ID><Type><DLC><DataBytes>***",
    ]  # fmt: skip


def busmaster(frames: list[Frame], mode: str = "SYSTEM", base: str = "HEX", begin_s: float | None = None) -> str:
    begun = datetime.fromtimestamp(START_S)
    of_day = begun.hour * 3600 + begun.minute * 60 + begun.second if begin_s is None else begin_s
    lines, last = head(mode, base), START_S
    for k, f in enumerate(frames):
        since = f.time - START_S
        stamp = {"SYSTEM": (of_day + since) % 86_400, "ABSOLUTE": since, "RELATIVE": f.time - last}[mode]
        last = f.time
        number = f"0x{f.identifier:03X}" if base == "HEX" else f"{f.identifier:03d}"
        data = " ".join(f"{byte:02X}" if base == "HEX" else f"{byte:03d}" for byte in f.data)
        lines.append(
            f"{clock(stamp)} {'Rx' if k % 2 else 'Tx'} 1 {number} {'x' if f.extended else 's'} {len(f.data)} {data} "
        )
    return "\r\n".join([*lines, "***END DATE AND TIME 1:1:2024 1:1:1:1***", "***[STOP LOGGING SESSION]***", ""])


def j1939(frames: list[Frame]) -> str:
    columns = "***<Time><Channel><CAN ID><PGN><Type><Source Node><Destination Node><Priority><Tx/Rx><DLC><DataBytes>***"
    lines = head("ABSOLUTE", columns=columns)
    for f in frames:
        lines.append(
            f"{clock(f.time - START_S)} 1 0x{f.identifier:08X} 0x{f.identifier >> 8 & 0x3FFFF:05X} BRC 0x3E --- 6 Rx "
            f"{len(f.data)} {f.data.hex(' ').upper()}"
        )
    return "\n".join([*lines, ""])


def canhacker(frames: list[Frame], point: str = ".") -> str:
    """Its clock begins again after a minute."""
    lines = ["Time   ID     DLC Data                    Comment"]
    for f in frames:
        stamp = f"{(f.time - START_S + 58.0) % 60.0:06.3f}".replace(".", point)
        number = f"{f.identifier:08X}" if f.extended else f"{f.identifier:03X}     "
        lines.append(f"{stamp} {number} {len(f.data)} {f.data.hex(' ').upper()} ")
    return "\r\n".join([*lines, ""])


SHORT = Frame(START_S, 0x123, b"\x01\xff\x00", extended=False)
SENT = [SHORT, *drive(), Frame(START_S + 5.0, 0x7FF, b"", extended=False)]
LOGS = {
    "system": ("drive.log", busmaster(SENT)),
    "absolute": ("drive.log", busmaster(SENT, "ABSOLUTE")),
    "relative": ("drive.log", busmaster(SENT, "RELATIVE")),
    "decimal": ("drive.log", busmaster(SENT, base="DEC")),
    "midnight": ("drive.log", busmaster(SENT, begin_s=86_398.0)),
    "J1939": ("drive.log", j1939([f for f in SENT if f.extended])),
    "CANHacker": ("drive.trc", canhacker(SENT)),
    "CANHacker with commas": ("drive.trc", canhacker(SENT, ",")),
}


def frames_in(path: Path, notes: list[str] | None = None) -> Frames:
    return joined(list(frames_of_log(path, [] if notes is None else notes, lambda fraction: None)))


@pytest.mark.parametrize("block_bytes", [1 << 20, 500])
@pytest.mark.parametrize("kind", LOGS)
def test_a_log_has_the_frames_that_were_sent(
    kind: str, block_bytes: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(text_blocks, "BLOCK_BYTES", block_bytes)
    name, text = LOGS[kind]
    (tmp_path / name).write_text(text)
    sent = [f for f in SENT if f.extended or kind != "J1939"]
    notes: list[str] = []
    ours = frames_in(tmp_path / name, notes)
    assert notes == []
    assert ours.identifier.tolist() == [frame.identifier for frame in sent]
    assert ours.extended.tolist() == [frame.extended for frame in sent]
    assert octets(ours) == [frame.data for frame in sent]
    np.testing.assert_allclose(ours.time - ours.time[0], [f.time - sent[0].time for f in sent], atol=2e-3)
    if kind in ("system", "absolute", "relative", "J1939"):
        assert ours.time[0] == pytest.approx(START_S, abs=0.02)


@pytest.mark.parametrize("kind", ["system", "CANHacker"])
def test_its_signals_are_those_of_candump_whatever_its_name(kind: str, tmp_path: Path) -> None:
    (tmp_path / "usual.log").write_text(candump(drive()))
    usual = read(tmp_path / "usual.log")
    for name in (LOGS[kind][0], "drive.txt"):
        (tmp_path / name).write_text(LOGS[kind][1])
        ours = read(tmp_path / name)
        assert ours.sources.keys() == usual.sources.keys()
        for column in usual.columns.keys() - {"time_s"}:
            np.testing.assert_allclose(ours.columns[column][5:395], usual.columns[column][5:395], atol=0.02)


@pytest.mark.parametrize("kind", ["system", "CANHacker"])
def test_a_log_in_utf_16_is_that_in_utf_8(kind: str, tmp_path: Path) -> None:
    name, text = LOGS[kind]
    for encoding in ("utf-16", "utf-16-le"):
        (tmp_path / name).write_bytes(text.encode(encoding))
        assert octets(frames_in(tmp_path / name)) == [frame.data for frame in SENT], encoding


def test_two_sessions_in_a_file_keep_their_dates(tmp_path: Path) -> None:
    later = re.sub(r"DATE AND TIME \d+:", "DATE AND TIME 20:", busmaster(SENT))
    (tmp_path / "drive.log").write_text(busmaster(SENT) + later)
    time = frames_in(tmp_path / "drive.log").time
    assert time[-1] - time[0] > 86_000.0


def test_remote_frames_are_counted_and_damaged_lines_left_out(tmp_path: Path) -> None:
    for kind, lines in {
        "system": ["11:49:12:9420 Rx 1 0x023 sr 0", "11:49:12:9420 Rx 1", "garbage", "11:49:12:9420 Rx 1 0x023 s 1 zz"],
        "CANHacker": ["00.100 301      8 RTR", "00.100", "garbage", "00.100 301      1 zz"],
    }.items():
        name, text = LOGS[kind]
        every = text.splitlines()
        every[50:50] = lines
        (tmp_path / name).write_text("\n".join([*every, ""]))
        notes: list[str] = []
        assert len(frames_in(tmp_path / name, notes)) == len(SENT)
        assert [note[:21] for note in notes] == [f"left out 3 lines of {name[:1]}", "left out 1 remote fra"]


@pytest.mark.parametrize("kind", ["system", "CANHacker"])
def test_a_log_that_is_cut_off_is_read_with_a_note_and_an_empty_one_refused(kind: str, tmp_path: Path) -> None:
    name, text = LOGS[kind]
    (tmp_path / name).write_text(text[: text.index("\n", len(text) // 2) - 4])
    assert "is cut off" in " ".join(read(tmp_path / name).notes)
    (tmp_path / name).write_text("\n".join([*text.splitlines()[:1], ""]))
    with pytest.raises(OncenterError) as refused:
        read(tmp_path / name)
    assert refused.value.code == "empty_log"
