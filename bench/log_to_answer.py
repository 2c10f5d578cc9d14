"""One log to one answer in its own process: `log_to_answer.py ours|rival LOG` prints seconds, peak memory, offset.

The clock starts after all imports. The rival is a usual loop with python-can and cantools: read a frame, decode it if
its message is in the database. Both use the same core, so they differ only in reading.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import drives
import numpy as np

import oncenter as oc
from oncenter._core import Core

ROOT = Path(__file__).parent.parent


def ours(log: Path) -> Callable[[], float]:
    import oncenter.offset.run
    import oncenter.read
    import oncenter.vehicle  # noqa: F401

    if log.suffix == ".mf4":
        import asammdf  # noqa: F401

    def answer() -> float:
        found = oc.offset(oc.read(log), oc.vehicle("scania_r730_4x2"), method="thesis").offset.value
        return math.nan if found is None else found

    return answer


def rival(log: Path) -> Callable[[], float]:
    import can  # noqa: F401

    known = known_messages()
    dynamics, speed = known[0xF009], known[0xFEF1]

    def answer() -> float:
        decoded: dict[str, list[tuple[float, dict[str, Any]]]] = {message.name: [] for message in known.values()}
        for time_s, name, values in decoded_frames(log, known):
            decoded[name].append((time_s, values))
        return offset_of(decoded[dynamics.name], decoded[speed.name])

    return answer


def known_messages() -> dict[int, Any]:
    """cantools' messages by parameter group."""
    import cantools

    database: Any = cantools.database.load_file(ROOT / "dbc" / "oncenter_j1939.dbc")
    return {message.frame_id >> 8 & 0x3FFFF: message for message in database.messages}


def decoded_frames(log: Path, known: dict[int, Any]) -> Iterator[tuple[float, str, dict[str, Any]]]:
    """Time stamp, name and values of every message in the database, from python-can and cantools."""
    import can

    for frame in can.LogReader(log):
        message = known.get(frame.arbitration_id >> 8 & 0x3FFFF)
        if message is not None:
            yield frame.timestamp, message.name, message.decode(frame.data, decode_choices=False)


def offset_of(dynamics: list[tuple[float, dict[str, Any]]], speed: list[tuple[float, dict[str, Any]]]) -> float:
    t = np.array([at for at, _ in dynamics])
    angle = np.array([values["SteeringWheelAngle"] for _, values in dynamics])
    columns = {
        "time_s": t - t[0],
        "steering_wheel_angle_rad": np.where(angle > 31.374, np.nan, angle),
        "yaw_rate_rad_s": np.array([values["YawRate"] for _, values in dynamics]),
        "lateral_acceleration_m_s2": np.array([values["LateralAcceleration"] for _, values in dynamics]),
        "vehicle_speed_m_s": np.interp(
            t, [at for at, _ in speed], [values["WheelBasedVehicleSpeed"] / 3.6 for _, values in speed]
        ),
    }
    core = Core(drives.WHEELBASE_M, drives.STEERING_RATIO, {}, drives.RATE_HZ)
    core.run(columns)
    return float(core.answer()["offset"]["value"])


def peak_mb() -> float:
    """Peak memory of this process alone; getrusage would include the parent's memory at the start."""
    import resource

    status = Path("/proc/self/status")
    if status.exists():
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return int(line.split()[1]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1 << 20 if sys.platform == "darwin" else 1 << 10)


def main() -> None:
    who, log = sys.argv[1], Path(sys.argv[2])
    answer = {"ours": ours, "rival": rival}[who](log)
    imported_mb = peak_mb()
    start = time.perf_counter()
    offset = answer()
    seconds = time.perf_counter() - start
    found = {"s": seconds, "imported_mb": imported_mb, "peak_mb": peak_mb(), "offset_deg": math.degrees(offset)}
    print(json.dumps(found))


if __name__ == "__main__":
    main()
