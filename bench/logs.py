"""Writes a drive as CAN logs of a busy J1939 bus: 600 frames/s, of which 17 in 60 carry used signals."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import drives
import numpy as np
import numpy.typing as npt

FRAMES_PER_PERIOD, TICKS_PER_PERIOD, PERIOD_S = 60, 10, 0.1
EPOCH_S = 1.7e9

VDC2, HRW, EBC2, CCVS1 = 0x18F0090B, 0x08FE6E0B, 0x18FEBF0B, 0x18FEF100
EEC1, ETC1, EEC2 = 0x0CF00400, 0x0CF00203, 0x0CF00300  # engine and gearbox, most of the traffic on a truck's bus
OTHERS = (0x18FEF200, 0x18FEDF00, 0x18F00029, 0x18FEEE00, 0x0C000003, 0x18FEF700, 0x10FE6F2A, 0x18FF2127)

Raw = npt.NDArray[np.uint64]


@dataclass(frozen=True)
class Frames:
    time: npt.NDArray[np.float64]  # s since EPOCH_S
    identifier: npt.NDArray[np.uint32]  # 29 bits
    data: Raw  # eight bytes, the first the lowest


def identifiers() -> npt.NDArray[np.uint32]:
    """Identifiers of the frames in one period, in order."""
    slots = np.array([OTHERS[k % len(OTHERS)] for k in range(FRAMES_PER_PERIOD)], np.uint32)
    slots[0::6], slots[1::12], slots[2], slots[3] = VDC2, HRW, EBC2, CCVS1
    slots[4::6], slots[5::6], slots[[8, 38]] = EEC1, ETC1, EEC2
    return slots


def raw(values: drives.Column, scale: float, offset: float, bits: int, first_bit: int) -> Raw:
    """J1939 raw values at their bit position; not available is all ones."""
    none = (1 << bits) - 1
    number = np.where(np.isnan(values), none, np.rint((values - offset) / scale))
    return number.astype(np.uint64) << np.uint64(first_bit)


def frames(count: int) -> Frames:
    """The frames, at least `count`, in whole periods."""
    periods = math.ceil(count / FRAMES_PER_PERIOD)
    ticks = drives.ticks(periods * TICKS_PER_PERIOD)
    identifier = np.tile(identifiers(), periods)
    data = np.random.default_rng(2).integers(0, 1 << 63, len(identifier), np.uint64)
    speed = np.nan_to_num(ticks["vehicle_speed_m_s"]).clip(0) * 3.6

    data[identifier == VDC2] = (
        raw(ticks["steering_wheel_angle_rad"], 1 / 1024, -31.374, 16, 0)
        | np.uint64(0x7F << 16)  # turn counter 31, absolute sensor
        | raw(ticks["yaw_rate_rad_s"], 1 / 8192, -3.92, 16, 24)
        | raw(ticks["lateral_acceleration_m_s2"], 1 / 2048, -15.687, 16, 40)
        | np.uint64(0xFF << 56)
    )
    wheel = [raw(speed[::2], 1 / 256, 0.0, 16, first_bit) for first_bit in (0, 16, 32, 48)]
    data[identifier == HRW] = wheel[0] | wheel[1] | wheel[2] | wheel[3]
    data[identifier == EBC2] = raw(speed[::10], 1 / 256, 0.0, 16, 0) | np.uint64(0x7D7D7D7D7D7D << 16)
    data[identifier == CCVS1] = raw(speed[::10], 1 / 256, 0.0, 16, 8) | np.uint64(0xFFFFFFFFFF0000FF)
    return Frames(np.arange(len(identifier)) * (PERIOD_S / FRAMES_PER_PERIOD), identifier, data)


def write_candump(path: Path, frames: Frames) -> None:
    columns = (frames.time + EPOCH_S).tolist(), frames.identifier.tolist(), frames.data.byteswap().tolist()
    with path.open("w") as file:
        file.writelines(f"({t:.6f}) can0 {i:08X}#{d:016X}\n" for t, i, d in zip(*columns, strict=True))


def write_asc(path: Path, frames: Frames) -> None:
    """Writes frames in the layout of Vector's tools and python-can's writer."""
    columns = frames.time.tolist(), frames.identifier.tolist(), frames.data.tolist()
    with path.open("w") as file:
        file.write("date Tue Nov 14 22:13:20.000 2023\nbase hex  timestamps absolute\ninternal events logged\n")
        file.writelines(
            f"{t:9.6f} 1  {i:X}x       Rx   d 8 {d.to_bytes(8, 'little').hex(' ').upper()}\n"
            for t, i, d in zip(*columns, strict=True)
        )


def write_trc(path: Path, frames: Frames) -> None:
    """Version 2.1, in the layout of PEAK's tools and python-can's writer."""
    columns = frames.time.tolist(), frames.identifier.tolist(), frames.data.tolist()
    with path.open("w", newline="\r\n") as file:
        file.write(f";$FILEVERSION=2.1\n;$STARTTIME={25569 + EPOCH_S / 86400}\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n")
        file.writelines(
            f"{k:7d} {1000 * t:13.3f} DT  1 {i:08X} Rx -  8    {d.to_bytes(8, 'little').hex(' ').upper()}\n"
            for k, (t, i, d) in enumerate(zip(*columns, strict=True), 1)
        )


def write_blf(path: Path, frames: Frames) -> None:
    from can import BLFWriter, Message

    octets = frames.data.tobytes()
    with BLFWriter(path) as writer:
        for k, (t, i) in enumerate(zip((frames.time + EPOCH_S).tolist(), frames.identifier.tolist(), strict=True)):
            data = octets[8 * k : 8 * k + 8]
            writer.on_message_received(Message(timestamp=t, arbitration_id=i, data=data, channel=0))


def write_mf4(path: Path, frames: Frames) -> None:
    """ASAM bus logging: one structured channel CAN_DataFrame."""
    from asammdf import MDF, Signal
    from asammdf.blocks.v4_blocks import SourceInformation
    from asammdf.blocks.v4_constants import BUS_TYPE_CAN, SOURCE_BUS

    members = [("BusChannel", "u1"), ("ID", "u4"), ("IDE", "u1"), ("DLC", "u1"), ("DataLength", "u1"),
               ("DataBytes", "(8,)u1"), ("Dir", "u1"), ("EDL", "u1"), ("BRS", "u1"), ("ESI", "u1")]  # fmt: skip
    rows = np.zeros(len(frames.time), [(f"CAN_DataFrame.{name}", kind) for name, kind in members])
    for name, values in (("BusChannel", 1), ("ID", frames.identifier), ("IDE", 1), ("DLC", 8), ("DataLength", 8)):
        rows[f"CAN_DataFrame.{name}"] = values
    rows["CAN_DataFrame.DataBytes"] = frames.data.view(np.uint8).reshape(-1, 8)
    bus = SourceInformation(source_type=SOURCE_BUS, bus_type=BUS_TYPE_CAN)
    with MDF(version="4.10") as log:
        log.append(Signal(rows, frames.time, name="CAN_DataFrame", source=bus))
        log.save(path, overwrite=True)


WRITERS: dict[str, Callable[[Path, Frames], None]] = {
    ".log": write_candump,
    ".mf4": write_mf4,
    ".blf": write_blf,
    ".asc": write_asc,
    ".trc": write_trc,
}
