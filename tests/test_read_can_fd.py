"""CAN FD: frames of up to 64 bytes in every format of frames, with a database."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import can
import cantools
import numpy as np
import pytest
from drive_frames import START_S

from oncenter.read import read
from oncenter.read.frames import Frames, Wanted, joined
from oncenter.read.frames_of_log import frames_of_log
from oncenter.signals import SignalName

# A little-endian angle across bytes 8 and 9, a big-endian yaw rate in bytes 20 and 21, a speed in the last two.
NETWORK = """VERSION ""
BU_: ECU
BO_ 800 MOTION: 64 ECU
 SG_ Angle : 68|16@1- (0.1,0) [-1500|1500] "deg" ECU
 SG_ Turn : 167|16@0- (0.01,0) [-300|300] "deg/s" ECU
 SG_ Pace : 496|16@1+ (0.01,0) [0|600] "km/h" ECU
BA_DEF_ BO_ "VFrameFormat" ENUM "StandardCAN","ExtendedCAN","StandardCAN_FD","ExtendedCAN_FD";
BA_ "VFrameFormat" BO_ 800 2;
"""
NAMES = {
    "steering_wheel_angle": SignalName("Angle"),
    "yaw_rate": SignalName("Turn"),
    "vehicle_speed": SignalName("Pace"),
}
LENGTHS = {12: 9, 16: 10, 20: 11, 24: 12, 32: 13, 48: 14, 64: 15}


def messages() -> list[can.Message]:
    given = []
    for k in range(200):
        angle, turn = 90.0 * np.sin(0.05 * k), 8.0 * np.cos(0.05 * k)
        data = _data(angle, turn, 50.0 + 0.01 * k)
        given += [
            can.Message(START_S + 0.01 * k, 800, is_extended_id=False, is_fd=True, data=data, channel=1),
            can.Message(START_S + 0.01 * k + 0.002, 801, is_extended_id=False, is_fd=True, data=data[:8], channel=1),
            can.Message(START_S + 0.01 * k + 0.004, 802, is_extended_id=False, data=data[:3], channel=1),
        ]
    return given


def _data(angle_deg: float, turn_deg_s: float, pace_km_h: float) -> bytes:
    data = bytearray(range(64))
    data[8:11] = ((round(angle_deg / 0.1) & 0xFFFF) << 4).to_bytes(3, "little")
    data[20:22] = (round(turn_deg_s / 0.01) & 0xFFFF).to_bytes(2, "big")
    data[62:64] = round(pace_km_h / 0.01).to_bytes(2, "little")
    return bytes(data)


def with_writer(writer: type[can.Listener]) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        with writer(path) as log:  # type: ignore[call-arg,attr-defined]
            for message in messages():
                log.on_message_received(message)

    return write


def trc(path: Path) -> None:
    lines = [";$FILEVERSION=2.1", ";$STARTTIME=45413.5", ";$COLUMNS=N,O,T,B,I,d,R,L,D"]
    for k, each in enumerate(messages(), 1):
        kind = "FB" if each.is_fd else "DT"
        code = LENGTHS.get(len(each.data), len(each.data))
        when = 1000 * (each.timestamp - START_S)
        lines.append(f"{k:7} {when:13.3f} {kind} 2 {each.arbitration_id:04X} Rx -  {code:<4} {each.data.hex(' ')}")
    path.write_text("\n".join([*lines, ""]))


def console(path: Path) -> None:
    """candump -ta, which writes the number of bytes with two digits for CAN FD."""
    path.write_text(
        "".join(
            f" ({m.timestamp:.6f})  1  {m.arbitration_id:03X}  [{len(m.data):02d}]  {m.data.hex(' ')}\n"
            for m in messages()
        )
    )


WRITE = {
    "drive.log": with_writer(can.CanutilsLogWriter),
    "console.log": console,
    "drive.asc": with_writer(can.ASCWriter),
    "drive.blf": with_writer(can.BLFWriter),
    "drive.mf4": with_writer(can.MF4Writer),
    "drive.trc": trc,
}


def octets(frames: Frames) -> list[bytes]:
    rest = frames.after_eight()
    return [
        (int(first).to_bytes(8, "little") + bytes(more))[:length]
        for first, more, length in zip(frames.data, rest, frames.length.tolist(), strict=True)
    ]


@pytest.mark.parametrize("name", WRITE)
def test_frames_of_64_bytes_have_the_bytes_that_were_sent(name: str, tmp_path: Path) -> None:
    WRITE[name](tmp_path / name)
    wanted = Wanted(frozenset(), frozenset((800, 801, 802)))
    frames = joined(list(frames_of_log(tmp_path / name, [], lambda fraction: None, wanted)))
    sent = messages()
    assert frames.identifier.tolist() == [each.arbitration_id for each in sent]
    assert octets(frames) == [bytes(each.data) for each in sent]
    np.testing.assert_allclose(np.diff(frames.time), np.diff([each.timestamp for each in sent]), atol=2e-4)


@pytest.mark.parametrize("name", WRITE)
def test_signals_behind_the_eighth_byte_have_the_values_that_cantools_decodes(name: str, tmp_path: Path) -> None:
    WRITE[name](tmp_path / name)
    dbc = tmp_path / "network.dbc"
    dbc.write_text(NETWORK)
    signals = read(tmp_path / name, names=NAMES, dbc=[dbc])
    motion = cantools.database.load_string(NETWORK, "dbc").get_message_by_name("MOTION")
    sent = [motion.decode(bytes(m.data)) for m in messages() if m.arbitration_id == 800]
    for column, signal in (("angle_rad", "Angle"), ("yaw_rate_rad_s", "Turn")):
        ours = np.rad2deg(next(values for key, values in signals.columns.items() if key.endswith(column)))
        np.testing.assert_allclose(ours[5:-5], [float(each[signal]) for each in sent][5:-5], atol=0.05)
    assert signals.columns["vehicle_speed_m_s"][-1] == pytest.approx(51.99 / 3.6, abs=0.01)


def test_a_signal_behind_the_end_of_its_can_fd_message_is_left_out_by_name(tmp_path: Path) -> None:
    console(tmp_path / "drive.log")
    beyond = ' SG_ Beyond : 500|20@1+ (1,0) [0|0] "" ECU\n'
    (tmp_path / "network.dbc").write_text(NETWORK.replace("BA_DEF_", beyond + "BA_DEF_", 1))
    names = NAMES | {"lateral_acceleration": SignalName("Beyond", "m_s2")}
    notes = read(tmp_path / "drive.log", names=names, dbc=[tmp_path / "network.dbc"]).notes
    assert "lateral_acceleration: MOTION.Beyond ends after the last byte and was left out" in notes


def test_a_j1939_message_of_more_than_eight_bytes_is_none(tmp_path: Path) -> None:
    """12 bytes of CAN FD with VDC2's identifier are no VDC2; a frame of eight bytes is."""
    frame = "(1700000000.{:06d}) can0 18F0093E##1697D7F637D577F7D{}\n"
    lines = [frame.format(10_000 * k, "00112233" if k % 10 == 5 else "") for k in range(100)]
    (tmp_path / "drive.log").write_text("".join(lines))
    signals = read(tmp_path / "drive.log")
    assert signals.sources["yaw_rate"].samples == 90
    assert signals.account is not None
    assert signals.account.file.left_out == {"can_fd": 10}
    assert signals.account.file.in_file == 100
