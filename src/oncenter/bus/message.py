"""Decoder of the result message on the bus, which the core writes; dbc/oncenter_result.dbc has the same layout."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from oncenter import _core
from oncenter.errors import OncenterError

PGN = _core.MESSAGE_PGN
PARTS_PGN = _core.MESSAGE_PARTS_PGN


@dataclass(frozen=True)
class Message:
    """SI and rad; None is not available.

    Use `angle_rad` directly: "compensated" in `angle_source` means that the offset is subtracted already, "measured"
    that it is not, "estimated" that the angle is from the motion alone. `measured_rad` is the reading of the sensor.
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


@dataclass(frozen=True)
class MessageParts:
    """The parts of the offset's standard deviation, rad; None is not available. `counter` is that of the message it
    belongs to.

    `drive_sd_rad` is this drive's part, the others are not identifiable from one drive: a pull, the mean wind, an axle
    set up for the road crown.
    """

    drive_sd_rad: float | None
    pull_sd_rad: float | None
    wind_sd_rad: float | None
    set_up_sd_rad: float | None
    counter: int


def decode_parts(payload: bytes) -> MessageParts:
    """The second frame, of PGN `PARTS_PGN`: `Monitor.message_parts`.

    Raises:
        OncenterError: "message": the payload is not one.
    """
    native = _checked(payload, _core.decoded_message_parts(payload))
    return MessageParts(
        drive_sd_rad=_finite(native["drive_sd"]),
        pull_sd_rad=_finite(native["pull_sd"]),
        wind_sd_rad=_finite(native["wind_sd"]),
        set_up_sd_rad=_finite(native["set_up_sd"]),
        counter=int(native["counter"]),
    )


def decode(payload: bytes) -> Message:
    """The result of `Monitor.message`.

    Raises:
        OncenterError: "message": the payload is not one.
    """
    native = _checked(payload, _core.decoded_message(payload))

    def available(name: str) -> float | None:
        return _finite(native[name])

    return Message(
        angle_rad=available("angle"),
        angle_sd_rad=available("angle_sd"),
        angle_source=_core.ANGLE_SOURCES[native["source"]],
        offset_rad=available("offset"),
        offset_sd_rad=available("offset_sd"),
        offset_status=_core.STATUSES[native["offset_status"]],
        sensor_fault=_core.FAULTS[native["fault"]],
        measured_rad=available("measured"),
        counter=int(native["counter"]),
    )


def _checked(payload: bytes, native: dict[str, Any] | None) -> dict[str, Any]:
    if native is None:
        raise OncenterError(f"'{payload.hex()}' is not a result message of oncenter, which has 8 bytes", code="message")
    return native


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
