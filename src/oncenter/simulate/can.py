"""Writes a drive as the truck's J1939 bus would carry it: a candump log (`candump -L`).

VDC2 each 10 ms, HRW 20 ms, CCVS1 and EBC2 100 ms, and EEC1, which concerns nobody here, each 20 ms. A frame holds the
signals of the tick at which it was due and leaves a little late, each message by its own jitter.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from oncenter.signals import SIGNALS, Signals

Array = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]

START_S = 1_466_000_000  # of every simulated log, since 1970: one day in June 2016
_LATENCY_S = 0.001  # mean way from the sensor to the bus
_KM_H = 3.6  # per m/s
_LINES_AT_ONCE = 200_000  # some 50 MB of working memory

_NOT_AVAILABLE_1, _NOT_AVAILABLE_2 = 0xFF, 0xFFFF
_LARGEST_1, _LARGEST_2 = 0xFA, 0xFAFF
_ERROR_1, _ERROR_2 = 0xFE, 0xFEFF
_ABSOLUTE_ANGLE = 0x7F  # byte 3 of VDC2: no turn counter (SPN 1811), absolute sensor (SPN 1812 = 1)


@dataclass(frozen=True)
class _Message:
    identifier: int  # 29 bits
    period_s: float
    payload: Bytes  # one row of 8 bytes a frame


def write_candump(signals: Signals, path: str | os.PathLike[str], *, jitter_sd_s: float, seed: int) -> None:
    """Writes a candump log of one channel, `can0`, sorted by time.

    Args:
        signals: as sensors report them; needs angle, yaw rate, both accelerations, vehicle and wheel speeds.
        path: of the log, overwritten.
        jitter_sd_s: of each frame's delay, 0 to 0.002.
        seed: of the jitter.
    """
    random = np.random.default_rng(seed)
    seconds, identifiers, payloads = [], [], []
    for message in _messages(signals):
        count = len(message.payload)
        jitter = np.clip(jitter_sd_s * random.standard_normal(count), -_LATENCY_S, 4 * _LATENCY_S)
        seconds.append(np.arange(count) * message.period_s + _LATENCY_S + jitter)
        identifiers.append(np.full(count, message.identifier, np.uint32))
        payloads.append(message.payload)
    microseconds = np.round(np.concatenate(seconds) * 1e6).astype(np.int64)
    order = np.argsort(microseconds, kind="stable")
    identifier, payload = np.concatenate(identifiers), np.concatenate(payloads)
    with open(path, "wb") as log:
        for some in np.split(order, range(_LINES_AT_ONCE, len(order), _LINES_AT_ONCE)):
            log.write(_lines(microseconds[some], identifier[some], payload[some]).data)


def _messages(signals: Signals) -> Iterator[_Message]:
    column = {name: signals.table[SIGNALS[name].column].to_numpy() for name in signals.sources}
    corners = ("front_left", "front_right", "rear_left", "rear_right")
    wheels = [column[f"wheel_speed_{corner}"] * _KM_H for corner in corners]
    speed = column["vehicle_speed"] * _KM_H

    def each(period_s: float, values: Array) -> Array:
        return values[:: round(period_s * signals.rate_hz)]

    count = len(speed)
    vdc2 = np.full((count, 8), _ABSOLUTE_ANGLE, np.uint8)
    vdc2[:, 0:2] = two_bytes(column["steering_wheel_angle"], 1 / 1024, -31.374)
    vdc2[:, 3:5] = two_bytes(column["yaw_rate"], 1 / 8192, -3.92)
    vdc2[:, 5:7] = two_bytes(column["lateral_acceleration"], 1 / 2048, -15.687)
    vdc2[:, 7] = one_byte(column["longitudinal_acceleration"], 0.1, -12.5)
    yield _Message(0x18F0093E, 0.01, vdc2)  # PGN 61449 from the stability control

    hrw = np.hstack([two_bytes(each(0.02, wheel), 1 / 256, 0.0) for wheel in wheels])
    yield _Message(0x08FE6E0B, 0.02, hrw)  # PGN 65134 from the brakes

    slow = each(0.1, speed)
    ccvs1 = np.full((len(slow), 8), _NOT_AVAILABLE_1, np.uint8)
    ccvs1[:, 1:3] = two_bytes(slow, 1 / 256, 0.0)
    yield _Message(0x18FEF100, 0.1, ccvs1)  # PGN 65265 from the engine

    front_axle = (wheels[0] + wheels[1]) / 2.0
    ebc2 = np.full((len(slow), 8), _NOT_AVAILABLE_1, np.uint8)  # SPN 909, 910: there is no second rear axle
    ebc2[:, 0:2] = two_bytes(each(0.1, front_axle), 1 / 256, 0.0)
    for byte, wheel in enumerate(wheels, start=2):
        ebc2[:, byte] = one_byte(each(0.1, wheel - front_axle), 1 / 16, -7.8125)
    yield _Message(0x18FEBF0B, 0.1, ebc2)  # PGN 65215 from the brakes

    engine_rpm = 600.0 + 12.0 * each(0.02, speed)
    eec1 = np.full((len(engine_rpm), 8), _NOT_AVAILABLE_1, np.uint8)
    eec1[:, 3:5] = two_bytes(engine_rpm, 1 / 8, 0.0)
    yield _Message(0x0CF00400, 0.02, eec1)  # PGN 61444


def two_bytes(value: Array, scale: float, offset: float) -> Bytes:
    """J1939's little-endian two-byte encoding, shape (n, 2): NaN is not available, beyond the range is an error."""
    raw = _raw(value, scale, offset, _LARGEST_2, _ERROR_2, _NOT_AVAILABLE_2).astype("<u2")
    return raw.view(np.uint8).reshape(-1, 2)


def one_byte(value: Array, scale: float, offset: float) -> Bytes:
    """J1939's one-byte encoding, shape (n,), as `two_bytes`."""
    return _raw(value, scale, offset, _LARGEST_1, _ERROR_1, _NOT_AVAILABLE_1).astype(np.uint8)


def _raw(value: Array, scale: float, offset: float, largest: int, error: int, not_available: int) -> Array:
    raw = np.floor((value - offset) / scale + 0.5)
    raw = np.where((raw < 0) | (raw > largest), error, raw)
    return np.where(np.isnan(value), not_available, raw)


_HEX = np.frombuffer(b"0123456789ABCDEF", np.uint8)
_TEMPLATE = b"(0000000000.000000) can0 00000000#0000000000000000\n"
_SECONDS, _FRACTION, _IDENTIFIER, _PAYLOAD = slice(1, 11), slice(12, 18), slice(25, 33), slice(34, 50)


def _lines(microseconds: npt.NDArray[np.int64], identifiers: npt.NDArray[np.uint32], payloads: Bytes) -> Bytes:
    """The log's text, shape (n, 51): every line is as long as every other."""
    text = np.tile(np.frombuffer(_TEMPLATE, np.uint8), (len(microseconds), 1))
    text[:, _SECONDS] = _decimal(START_S + microseconds // 1_000_000, 10)
    text[:, _FRACTION] = _decimal(microseconds % 1_000_000, 6)
    text[:, _IDENTIFIER] = _hex(identifiers.astype(">u4").view(np.uint8).reshape(-1, 4))
    text[:, _PAYLOAD] = _hex(payloads)
    return text


def _decimal(number: npt.NDArray[np.int64], digits: int) -> Bytes:
    powers = 10 ** np.arange(digits - 1, -1, -1, dtype=np.int64)
    return (number[:, None] // powers % 10 + ord("0")).astype(np.uint8)


def _hex(octets: Bytes) -> Bytes:
    digits = np.empty((len(octets), 2 * octets.shape[1]), np.uint8)
    digits[:, 0::2] = _HEX[octets >> 4]
    digits[:, 1::2] = _HEX[octets & 15]
    return digits
