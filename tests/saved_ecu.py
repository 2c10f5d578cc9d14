"""The core as in firmware, saved and restored, and days of driving for it."""

from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy as np
from random_drives import RATIO, WHEELBASE, Array, drive

from oncenter import _core
from oncenter._native import ffi, lib

RATE_HZ = 100.0
TRACK = 1.9  # m


class Ecu:
    """Coefficients and state as in firmware."""

    def __init__(self, method: str = "joint", rate_hz: float = RATE_HZ, angle_method: str = "observer") -> None:
        self.coefficients, self.state = ffi.new("oc_coefficients *"), ffi.new("oc_state *")
        vehicle = _core._vehicle(WHEELBASE, RATIO, TRACK, TRACK, 1.0)
        assert lib.oc_setup(self.coefficients, vehicle, _core._params({}, method, angle_method), rate_hz) == lib.OC_OK
        lib.oc_init(self.state)

    def run(self, columns: dict[str, Array], outputs: Any = None) -> Ecu:
        native = ffi.new("oc_columns *", {"count": len(columns["time_s"])})
        kept = {_core.COLUMNS[name]: np.ascontiguousarray(values) for name, values in columns.items()}
        for name, values in kept.items():
            setattr(native, name, ffi.from_buffer("double[]", values))
        target = ffi.NULL if outputs is None else ffi.from_buffer("oc_output[]", outputs, require_writable=True)
        lib.oc_run(self.state, self.coefficients, native, target)
        return self

    def save(self, sequence: int = 1) -> bytes:
        image = bytearray(lib.oc_save_size())
        assert lib.oc_save(self.state, self.coefficients, sequence, ffi.from_buffer(image), len(image)) == len(image)
        return bytes(image)

    def restore(self, image: bytes) -> str:
        fault = lib.oc_restore(self.state, self.coefficients, ffi.from_buffer(image), len(image), ffi.new("uint32_t *"))
        return _core.IMAGE_FAULTS[fault]

    def whole(self) -> Any:
        """A view of the native memory."""
        return np.frombuffer(ffi.buffer(self.state), _core.dtype_of(ffi.typeof("oc_state")))[0:1]

    def evidence(self) -> Any:
        return self.whole()["evidence"]

    def values(self) -> bytes:
        return _core._values(self.whole()[0])

    def answer(self) -> dict[str, Any]:
        native = ffi.new("oc_answer *")
        lib.oc_answer_get(self.state, self.coefficients, native)
        return _core._members(native)


FRESH = Ecu().values()


def legs(count: int, seconds: float = 150.0, seed: int = 1) -> dict[str, Array]:
    """Consecutive drives, each from standstill to standstill, with rear wheel speeds."""
    drives = [drive(seed + k, RATE_HZ, seconds) for k in range(count)]
    columns = {name: np.concatenate([d[name] for d in drives]) for name in drives[0]}
    columns["time_s"] = np.arange(len(columns["time_s"])) / RATE_HZ
    speed, turning = columns["vehicle_speed_m_s"], 0.5 * TRACK * columns["yaw_rate_rad_s"]
    return columns | {"wheel_speed_rear_left_m_s": speed - turning, "wheel_speed_rear_right_m_s": speed + turning}


def sliced(columns: dict[str, Array], begin: int, end: int) -> dict[str, Array]:
    return {name: values[begin:end] for name, values in columns.items()}


def sealed(image: bytes) -> bytes:
    """The image with a valid CRC-32."""
    return image[:-4] + struct.pack("<I", zlib.crc32(image[:-4]))
