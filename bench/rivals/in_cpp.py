"""Autoware's and openpilot's filters in their original language C++: `filters.cpp`, compiled when used."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from rivals import Array, Known
from rivals.openpilot import body_of

Offset = Callable[[Mapping[str, Array], Known], float]  # after the last tick, rad at the steering wheel


def compiler() -> str | None:
    return shutil.which(os.environ.get("CXX", "g++"))


def compiled(folder: Path) -> dict[str, Offset]:
    """The functions by rival name. Needs a `compiler`."""
    library, gxx = folder / "filters.so", compiler()
    assert gxx is not None, "needs a C++ compiler"
    source = Path(__file__).with_name("filters.cpp")
    options = ["-O2", "-std=c++17", "-Wall", "-shared", "-fPIC"]
    subprocess.run([gxx, *options, "-o", library, source], check=True)
    functions = ctypes.CDLL(str(library))

    def called(name: str, columns: list[Array], numbers: list[float]) -> float:
        function = getattr(functions, name)
        function.restype = ctypes.c_double
        doubles = [np.ascontiguousarray(column, np.float64) for column in columns]
        pointers = [column.ctypes.data_as(ctypes.c_void_p) for column in doubles]
        return float(function(ctypes.c_size_t(len(doubles[0])), *pointers, *map(ctypes.c_double, numbers)))

    def motion(columns: Mapping[str, Array]) -> list[Array]:
        return [columns[name] for name in ("steering_wheel_angle_rad", "yaw_rate_rad_s", "vehicle_speed_m_s")]

    def autoware(columns: Mapping[str, Array], known: Known) -> float:
        return called("autoware_offset", motion(columns), [known.wheelbase_m, known.steering_ratio])

    def openpilot(columns: Mapping[str, Array], known: Known) -> float:
        given = [*motion(columns), columns["lateral_acceleration_m_s2"], body_of(known)]
        return called("openpilot_offset", given, [known.steering_ratio])

    return {"autoware": autoware, "openpilot": openpilot}
