"""The result message as others on the bus read it; the core alone writes it. dbc/oncenter_result.dbc says the same."""

from __future__ import annotations

import math
from dataclasses import dataclass

from oncenter import _core
from oncenter.errors import OncenterError

PGN = _core.MESSAGE_PGN


@dataclass(frozen=True)
class Message:
    """SI and rad; None is not available.

    `angle_rad` is to be used as it is: where `angle_source` is "compensated" the offset beside it has been taken off,
    where it is "measured" none has, "estimated" is without the sensor. `measured_rad` is what the sensor said.
    """

    angle_rad: float | None
    angle_sd_rad: float | None
    angle_source: str
    offset_rad: float | None
    offset_sd_rad: float | None
    offset_status: str
    sensor_fault: str
    measured_rad: float | None
    counter: int


def decode(payload: bytes) -> Message:
    """What `Monitor.message` gave.

    Raises:
        OncenterError: "message", where it is none.
    """
    native = _core.decoded_message(payload)
    if native is None:
        raise OncenterError(f"'{payload.hex()}' is no result message of oncenter: 8 bytes would do", code="message")

    def told(name: str) -> float | None:
        value = float(native[name])
        return value if math.isfinite(value) else None

    return Message(
        angle_rad=told("angle"),
        angle_sd_rad=told("angle_sd"),
        angle_source=_core.ANGLE_SOURCES[native["source"]],
        offset_rad=told("offset"),
        offset_sd_rad=told("offset_sd"),
        offset_status=_core.STATUSES[native["offset_status"]],
        sensor_fault=_core.FAULTS[native["fault"]],
        measured_rad=told("measured"),
        counter=int(native["counter"]),
    )
