"""CAN frames as tables of text: the three usual kinds of CSV, and `.txt` of the CLX000 loggers."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import can
import numpy as np
import pytest
from drive_frames import START_S, Frame, candump, drive
from test_read_can_fd import octets

from oncenter.errors import OncenterError
from oncenter.read import read
from oncenter.read.frames import Frames, joined
from oncenter.read.frames_of_log import frames_of_log


def gvret(frames: list[Frame]) -> str:
    """SavvyCAN: us, a comma at each end, and cells only for the bytes that are there."""
    head = "Time Stamp,ID,Extended,Dir,Bus,LEN," + ",".join(f"D{k}" for k in range(1, 9))
    rows = [
        f"{round(1e6 * (f.time - START_S)) + 166064000},{f.identifier:08X},{str(f.extended).lower()},Rx,0,"
        f"{len(f.data)}," + "".join(f"{byte:02X}," for byte in f.data)
        for f in frames
    ]
    return "\n".join([head, *rows, ""])


def canedge(frames: list[Frame], data_bytes: int = 8) -> str:
    head = "TimestampEpoch;BusChannel;ID;IDE;DLC;DataLength;Dir;EDL;BRS;ESI;RTR;DataBytes"
    rows = [
        f"{f.time:.6f};1;{f.identifier:X};{int(f.extended)};{len(f.data)};{len(f.data)};0;0;0;0;0;{f.data.hex().upper()}"
        for f in frames
    ]
    return "\n".join([head, *rows, ""])


def python_can(frames: list[Frame]) -> str:
    text = io.StringIO()
    writer = can.CSVWriter(text)
    for f in frames:
        writer.on_message_received(
            can.Message(timestamp=f.time, arbitration_id=f.identifier, is_extended_id=f.extended, data=f.data)
        )
    return text.getvalue()


def cabana(frames: list[Frame]) -> str:
    return "\n".join(
        ["time,addr,bus,data", *(f"{f.time - START_S!r},{f.identifier:#x},0,0x{f.data.hex()}" for f in frames), ""]
    )


def kvaser(frames: list[Frame]) -> str:
    """Decimal numbers and a preamble."""
    head = "Kvaser Memorator\n\nTime,Channel,ID,Flags,DLC," + ",".join(f"Data{k}" for k in range(8)) + ",Counter"
    rows = [
        f"{f.time - START_S:.6f},1,{f.identifier},,{len(f.data)},{','.join(map(str, f.data.ljust(8, bytes(1))))},{k}"
        for k, f in enumerate(frames)
    ]
    return "\n".join([head, *rows, ""])


def dated(frames: list[Frame]) -> str:
    rows = [
        f'"{datetime.fromtimestamp(f.time, UTC):%Y-%m-%d %H:%M:%S.%f}"\t{f.identifier:X}\t{f.data.hex("-")}'
        for f in frames
    ]
    return "\r\n".join(["Time\tCAN ID (hex)\tData (hex)", *rows, ""])


def clx(frames: list[Frame], style: str = "%Y%m%dT%H%M%S") -> str:
    begun = datetime.fromtimestamp(START_S, UTC)
    head = [
        "# Logger type: CL2000", "# HW rev: 8.1x", "# FW rev: 5.85", "# Logger ID: id0001", "# Session No.: 29",
        "# Split No.: 4", f"# Time: {begun:%Y%m%dT%H%M%S}", '# Value separator: ";"', "# Time format: 4",
        '# Time separator: ""', '# Time separator ms: ""', '# Date separator: ""', '# Time and date separator: "T"',
        "# Bit-rate: 250000", "# Silent mode: false", "# Cyclic mode: false", "Timestamp;Type;ID;Data",
    ]  # fmt: skip
    rows = []
    for f in frames:
        when = datetime.fromtimestamp(round(f.time, 3), UTC)
        stamp = f"{when:{style}}{when.microsecond // 1000:03d}"
        rows.append(f"{stamp};{int(f.extended)};{f.identifier:x};{f.data.hex()}")
    return "\n".join([*head, *rows, ""])


KINDS: dict[str, tuple[str, Callable[[list[Frame]], str], float]] = {  # name, writer, step of the stamps in s
    "SavvyCAN": ("drive.csv", gvret, 1e-6),
    "CANedge": ("drive.csv", canedge, 1e-6),
    "python-can": ("drive.csv", python_can, 1e-6),
    "Cabana": ("drive.csv", cabana, 1e-6),
    "Kvaser": ("drive.csv", kvaser, 1e-6),
    "dates": ("drive.txt", dated, 1e-6),
    "CLX000": ("00000001.TXT", clx, 1e-3),
    "CLX000, day and time": ("00000001.TXT", lambda frames: clx(frames, "%dT%H%M%S"), 1e-3),
    "CLX000, time": ("00000001.TXT", lambda frames: clx(frames, "%H:%M:%S."), 1e-3),
}


def frames_in(path: Path, notes: list[str] | None = None) -> Frames:
    return joined(list(frames_of_log(path, [] if notes is None else notes, lambda fraction: None)))


@pytest.mark.parametrize("kind", KINDS)
def test_a_table_of_frames_has_the_frames_that_were_sent(kind: str, tmp_path: Path) -> None:
    name, write, step_s = KINDS[kind]
    short = Frame(START_S, 0x123, b"\x01\xff\x00", extended=False)
    sent = [short, *drive(), replace(short, time=START_S + 5.0)]
    (tmp_path / name).write_text(write(sent))
    notes: list[str] = []
    ours = frames_in(tmp_path / name, notes)
    assert notes == []
    assert ours.identifier.tolist() == [frame.identifier for frame in sent]
    assert ours.extended.tolist() == [frame.extended for frame in sent]
    assert octets(ours) == [frame.data for frame in sent]
    np.testing.assert_allclose(ours.time - ours.time[0], [f.time - sent[0].time for f in sent], atol=step_s)
    if kind not in ("SavvyCAN", "Cabana", "Kvaser"):
        assert ours.time[0] == pytest.approx(START_S, abs=0.01)


@pytest.mark.parametrize("kind", KINDS)
def test_the_signals_of_a_table_of_frames_are_those_of_candump(kind: str, tmp_path: Path) -> None:
    name, write, step_s = KINDS[kind]
    (tmp_path / name).write_text(write(list(drive())))
    (tmp_path / "drive.log").write_text(candump(drive()))
    ours, usual = read(tmp_path / name), read(tmp_path / "drive.log")
    assert ours.sources == usual.sources
    for column in usual.columns.keys() - {"time_s"}:
        np.testing.assert_allclose(ours.columns[column][5:395], usual.columns[column][5:395], atol=20 * step_s + 1e-9)


def test_a_table_by_python_can_has_the_frames_that_python_can_reads(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    with can.CSVWriter(path) as writer:
        for k in range(40):
            about = {"timestamp": START_S + k, "arbitration_id": 0x18F0093E}
            writer.on_message_received(can.Message(**about, data=bytes(range(k % 9))))
            writer.on_message_received(can.Message(**about, is_fd=True, data=bytes(range(64))))
            writer.on_message_received(can.Message(**about, is_remote_frame=True, dlc=3))
            writer.on_message_received(can.Message(timestamp=START_S + k, is_error_frame=True))
    notes: list[str] = []
    ours = frames_in(path, notes)
    with can.CSVReader(path) as reader:
        theirs = [m for m in reader if not (m.is_remote_frame or m.is_error_frame)]
    assert octets(ours) == [bytes(m.data) for m in theirs]
    assert ours.time.tolist() == [m.timestamp for m in theirs]
    assert notes == ["left out 40 error frames in drive.csv", "left out 40 remote frames in drive.csv"]


def test_a_unit_of_the_times_is_found_by_the_number_of_frames_in_a_second(tmp_path: Path) -> None:
    for unit_s in (1.0, 1e-3, 1e-6, 1e-9):
        rows = [f"{(f.time - START_S) / unit_s:.6f},{f.identifier:X},{f.data.hex()}" for f in drive()]
        (tmp_path / "drive.csv").write_text("\n".join(["Timestamp,ID,Data", *rows, ""]))
        assert np.ptp(frames_in(tmp_path / "drive.csv").time) == pytest.approx(4.0, abs=0.05), unit_s


def test_a_clock_of_the_day_goes_on_after_midnight(tmp_path: Path) -> None:
    rows = [f"{time}.5,123,0{k}" for k, time in enumerate(("23:59:58", "23:59:59", "0:00:00"))]
    (tmp_path / "drive.csv").write_text("\n".join(["time,id,data", *rows, ""]))
    assert np.diff(frames_in(tmp_path / "drive.csv").time).tolist() == [1.0, 1.0]


def test_rows_that_are_no_frames_are_left_out_and_counted(tmp_path: Path) -> None:
    lines = gvret(list(drive())).splitlines()
    lines[50:50] = ["garbage", "1,zz,true,Rx,0,1,05,", "x,123,false,Rx,0,1,05,", "5,123,false,Rx,0,2,0g,01,", ""]
    (tmp_path / "drive.csv").write_text("\n".join([*lines, ""]))
    notes: list[str] = []
    assert len(frames_in(tmp_path / "drive.csv", notes)) == len(list(drive()))
    assert notes == ["left out 4 rows of drive.csv that are not CAN frames"]


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("id,data\n123,00\n", "table_of_frames"),
        ("time,id,data\n", "empty_log"),
        ("time,id,data\n" + "1,q,r\n" * 9, "unreadable_log"),
        ("time,id,data\n" + '1,123,"00\n' * 9, "unreadable_log"),
    ],
)
def test_a_table_without_frames_is_refused_in_one_line(text: str, code: str, tmp_path: Path) -> None:
    (tmp_path / "drive.csv").write_text(text)
    with pytest.raises(OncenterError) as refused:
        read(tmp_path / "drive.csv")
    assert refused.value.code == code
    assert "drive.csv" in str(refused.value) and "\n" not in str(refused.value)
