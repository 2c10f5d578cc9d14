"""A short drive as J1939 frames, encoded by cantools with the shipped DBC, and the expected signals."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cantools
import numpy as np
from cantools.database.can import Database

DBC = Path(__file__).parents[1] / "dbc" / "oncenter_j1939.dbc"
START_S = 1_700_000_000.0


@dataclass(frozen=True)
class Frame:
    time: float  # s
    identifier: int
    data: bytes
    extended: bool = True


@cache
def database() -> Database:
    loaded = cantools.database.load_file(DBC)
    assert isinstance(loaded, Database)
    return loaded


def identifier(pgn: int, address: int, priority: int = 6) -> int:
    return priority << 26 | pgn << 8 | address


def truth(time: np.ndarray) -> dict[str, np.ndarray]:
    """The drive in SI at any time since its start, s."""
    return {
        "steering_wheel_angle_rad": 0.4 * np.sin(0.8 * time),
        "yaw_rate_rad_s": 0.05 * np.sin(0.8 * time),
        "vehicle_speed_m_s": 15.0 + 2.0 * np.sin(0.3 * time),
        "lateral_acceleration_m_s2": 0.8 * np.sin(0.8 * time),
    }


def vdc2(
    time: float, angle: float, yaw_rate: float, acceleration: float, address: int = 0x3E, forward: float = 0.0
) -> Frame:
    values = {
        "SteeringWheelAngle": angle,
        "SteeringWheelTurnCounter": 0,
        "SteeringWheelAngleSensorType": 1,
        "YawRate": yaw_rate,
        "LateralAcceleration": acceleration,
        "LongitudinalAcceleration": forward,
    }
    return Frame(time, identifier(61449, address), bytes(database().encode_message("VDC2", values)))


def ccvs1(time: float, speed_m_s: float, address: int = 0x00) -> Frame:
    data = bytearray(database().encode_message("CCVS1", {"WheelBasedVehicleSpeed": speed_m_s * 3.6}, padding=True))
    return Frame(time, identifier(65265, address), bytes(data))


def drive(duration_s: float = 4.0) -> list[Frame]:
    """VDC2 at 100 Hz, CCVS1 at 10 Hz, EEC1 and an 11-bit frame between them; stamps in whole microseconds."""
    frames = []
    for tick in range(round(duration_s * 100)):
        since = tick / 100
        at = {name: float(value) for name, value in truth(np.array(since)).items()}
        frames.append(
            vdc2(
                START_S + since,
                at["steering_wheel_angle_rad"],
                at["yaw_rate_rad_s"],
                at["lateral_acceleration_m_s2"],
            )
        )
        frames.append(Frame(START_S + since + 0.0005, identifier(61444, 0x00, 3), b"\x11\x22\x33\x44\x55\x66\x77\x88"))
        if tick % 10 == 0:
            speed = float(truth(np.array(since + 0.001))["vehicle_speed_m_s"])
            frames.append(ccvs1(START_S + since + 0.001, speed))
            frames.append(Frame(START_S + since + 0.002, 0x123, b"\x01\x02\x03", extended=False))
    return frames


def candump(frames: list[Frame], bus: str = "can0") -> str:
    """The frames in the layout of candump -L."""
    return "".join(
        f"({frame.time:.6f}) {bus} {frame.identifier:0{8 if frame.extended else 3}X}#{frame.data.hex().upper()}\n"
        for frame in frames
    )
