"""Reads drives of an invented logger: a mark of eight bytes, then records of twelve bytes."""

from pathlib import Path

import numpy as np

MARK = b"ACMELOG1"
RECORD = np.dtype(
    [
        ("time", "<u4"),  # ms
        ("angle", "<i2"),  # 0.1 deg, left positive
        ("yaw_rate", "<i2"),  # 0.01 deg/s, left positive
        ("speed", "<u2"),  # 0.01 km/h
        ("lateral", "<i2"),  # mm/s^2, left positive
    ]
)


def read(path: Path) -> dict[str, np.ndarray]:
    """Columns whose suffix is their unit."""
    content = path.read_bytes()
    if not content.startswith(MARK):
        raise ValueError("it does not begin with ACMELOG1")
    records = np.frombuffer(content[len(MARK) :], RECORD)
    return {
        "time_s": records["time"] / 1000,
        "steering_wheel_angle_deg": records["angle"] / 10,
        "yaw_rate_deg_s": records["yaw_rate"] / 100,
        "vehicle_speed_km_h": records["speed"] / 100,
        "lateral_acceleration_m_s2": records["lateral"] / 1000,
    }
