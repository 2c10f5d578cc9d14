"""A drive as frames on the truck's J1939 bus, each message at its own rate.

VDC2 every 10 ms, HRW every 20 ms, CCVS1 and EBC2 every 100 ms, VP and VDS every 100 ms with a GNSS receiver; EEC1 every
20 ms as an unrelated message. A bus that sends statuses has their messages, too. A frame contains the signals at its
due time and is sent a little later, with jitter.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from oncenter.signals import SIGNALS
from oncenter.simulate.drive import RATE_HZ
from oncenter.simulate.sensors import Sensed
from oncenter.simulate.sensors.reading import ticks
from oncenter.simulate.sensors.wheels import CORNERS

Array = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]

START_S = 1_466_000_000  # of a simulated log with seed 1, since 1970: one day in June 2016
_DAY_S, _DAYS = 86_400, 3_650
_LATENCY_S = 0.001  # mean delay from the sensor to the bus
_KM_H = 3.6  # per m/s

_NOT_AVAILABLE_1, _NOT_AVAILABLE_2, _NOT_AVAILABLE_4 = 0xFF, 0xFFFF, 0xFFFFFFFF
_LARGEST_1, _LARGEST_2, _LARGEST_4 = 0xFA, 0xFAFF, 0xFAFFFFFF
_ERROR_1, _ERROR_2, _ERROR_4 = 0xFE, 0xFEFF, 0xFEFFFFFF
_NO_TURN_COUNTER = 0x3F  # SPN 1811, in byte 3 of VDC2
_SENSOR_TYPE_BIT = 6  # SPN 1812, two bits of the same byte
_GEARS, _KM_H_PER_GEAR = 12, 7.0  # of the gearbox, forwards


@dataclass(frozen=True)
class BusFrames:
    """The frames on the bus in order of time: 29-bit identifiers, eight bytes each.

    Attributes:
        start_s: since 1970, of the drive.
        microseconds: since `start_s`, not negative, ascending.
        identifier: with priority, parameter group and source address.
        payload: shape (n, 8).
    """

    start_s: int
    microseconds: npt.NDArray[np.int64]
    identifier: npt.NDArray[np.uint32]
    payload: Bytes


@dataclass(frozen=True)
class _Message:
    identifier: int  # 29 bits
    period_s: float
    payload: Bytes  # one row of 8 bytes a frame


def _start_s(seed: int) -> int:
    """When a simulated drive begins, in s since 1970: each seed on a day of its own, so that drives of one truck do not
    overlap. The days are repeated after ten years."""
    return START_S + _DAY_S * ((seed - 1) % _DAYS)


def frames(sensed: Sensed, *, jitter_sd_s: float, seed: int) -> BusFrames:
    """The drive on the bus.

    Args:
        sensed: the sensors' output; its faults decide between the codes for error and not available.
        jitter_sd_s: standard deviation of each frame's delay, 0 to 0.002.
        seed: of the jitter, and of the day.
    """
    random = np.random.default_rng(seed)
    seconds, identifiers, payloads = [], [], []
    for message in _messages(sensed):
        count = len(message.payload)
        jitter = np.clip(jitter_sd_s * random.standard_normal(count), -_LATENCY_S, 4 * _LATENCY_S)
        seconds.append(np.arange(count) * message.period_s + _LATENCY_S + jitter)
        identifiers.append(np.full(count, message.identifier, np.uint32))
        payloads.append(message.payload)
    microseconds = np.round(np.concatenate(seconds) * 1e6).astype(np.int64)
    order = np.argsort(microseconds, kind="stable")
    identifier, payload = np.concatenate(identifiers), np.concatenate(payloads)
    return BusFrames(_start_s(seed), microseconds[order], identifier[order], payload[order])


def _messages(sensed: Sensed) -> Iterator[_Message]:
    column = _columns(sensed)
    wheels = [column[f"wheel_speed_{corner}"] * _KM_H for corner in CORNERS]
    speed = column["vehicle_speed"] * _KM_H

    vdc2 = np.empty((len(speed), 8), np.uint8)
    vdc2[:, 0:2] = two_bytes(column["steering_wheel_angle"], 1 / 1024, -31.374)
    sensor_type = column["steering_wheel_angle_sensor_type"].astype(np.uint8)
    vdc2[:, 2] = sensor_type << _SENSOR_TYPE_BIT | _NO_TURN_COUNTER
    vdc2[:, 3:5] = two_bytes(column["yaw_rate"], 1 / 8192, -3.92)
    vdc2[:, 5:7] = two_bytes(column["lateral_acceleration"], 1 / 2048, -15.687)
    vdc2[:, 7] = one_byte(column["longitudinal_acceleration"], 0.1, -12.5)
    yield _Message(0x18F0093E, 0.01, vdc2)  # PGN 61449 from the stability control

    hrw = np.hstack([two_bytes(_each(0.02, wheel), 1 / 256, 0.0) for wheel in wheels])
    yield _Message(0x08FE6E0B, 0.02, hrw)  # PGN 65134 from the brakes

    slow = _each(0.1, speed)
    ccvs1 = _empty(len(slow))
    ccvs1[:, 1:3] = two_bytes(slow, 1 / 256, 0.0)
    yield _Message(0x18FEF100, 0.1, ccvs1)  # PGN 65265 from the engine

    front_axle = _each(0.1, (wheels[0] + wheels[1]) / 2.0)
    no_number = ~np.isfinite(front_axle)  # the wheels then have the same code as their axle
    ebc2 = _empty(len(slow))  # SPN 909, 910: there is no second rear axle
    ebc2[:, 0:2] = two_bytes(front_axle, 1 / 256, 0.0)
    for byte, wheel in enumerate(wheels, start=2):
        relative = np.subtract(_each(0.1, wheel), front_axle, out=front_axle.copy(), where=~no_number)
        ebc2[:, byte] = one_byte(relative, 1 / 16, -7.8125)
    yield _Message(0x18FEBF0B, 0.1, ebc2)  # PGN 65215 from the brakes

    engine_rpm = 600.0 + 12.0 * _each(0.02, speed)
    eec1 = _empty(len(engine_rpm))
    eec1[:, 3:5] = two_bytes(engine_rpm, 1 / 8, 0.0)
    yield _Message(0x0CF00400, 0.02, eec1)  # PGN 61444

    if "heading" in column:
        yield from _gnss_messages(column)
    yield from _status_messages(sensed.statuses, speed)


def _gnss_messages(column: Mapping[str, Array]) -> Iterator[_Message]:
    places = [four_bytes(_each(0.1, column[name]), 1e-7, -210.0) for name in ("latitude", "longitude")]
    yield _Message(0x18FEF3FB, 0.1, np.hstack(places))  # PGN 65267 from the data logger

    heading = _each(0.1, column["heading"])
    vds = _empty(len(heading))
    vds[:, 0:2] = two_bytes(heading, 1 / 128, 0.0)
    vds[:, 2:4] = two_bytes(_each(0.1, column["speed_over_ground"]) * _KM_H, 1 / 256, 0.0)
    yield _Message(0x18FEE8FB, 0.1, vds)  # PGN 65256 from the data logger


def _status_messages(statuses: Mapping[str, Array], speed_km_h: Array) -> Iterator[_Message]:
    """Layouts as in public headers and databases of J1939-71: bytes and bits count from 1, the lowest bit first."""
    if "stability_control_active" in statuses:
        vdc1 = _empty(len(_each(0.1, speed_km_h)))
        vdc1[:, 0] = 0xC4  # SPN 1813 no information, 1814 fully operational, 1815 no brake light
        # SPN 1816, 1818, 1817, 1819 in byte 2, bits 1, 3, 5, 7: roll-over by engine, brakes; yaw by engine, brakes
        vdc1[:, 1] = _two_bits(_each(0.1, statuses["stability_control_active"])) << 6
        yield _Message(0x18FE4F3E, 0.1, vdc1)  # PGN 65103 from the stability control
    if "anti_lock_active" in statuses:
        ebc1 = _empty(len(_each(0.1, speed_km_h)))
        ebc1[:, 0] = 0xCF | _two_bits(_each(0.1, statuses["anti_lock_active"])) << 4  # SPN 563 in byte 1, bits 5 and 6
        yield _Message(0x18F0010B, 0.1, ebc1)  # PGN 61441 from the brakes
    if "axle_lifted" in statuses:
        asc1 = _empty(len(_each(0.1, speed_km_h)))
        asc1[:, 4] = 0x3F | _two_bits(_each(0.1, statuses["axle_lifted"])) << 6  # lift axle 1 in byte 5, bits 7 and 8
        yield _Message(0x18FE5A2F, 0.1, asc1)  # PGN 65114 from the suspension
    if "reverse" in statuses:
        yield from _direction_messages(statuses["reverse"], speed_km_h)


def _direction_messages(reverse: Array, speed_km_h: Array) -> Iterator[_Message]:
    slow, backwards = _each(0.1, speed_km_h), _each(0.1, reverse)
    forwards = np.clip(np.ceil(slow / _KM_H_PER_GEAR), 0.0, _GEARS)
    etc2 = _empty(len(slow))
    etc2[:, 0] = etc2[:, 3] = one_byte(np.where(backwards > 0.0, -1.0, forwards), 1.0, -125.0)  # SPN 524 and 523
    yield _Message(0x18F00503, 0.1, etc2)  # PGN 61445 from the transmission

    speed = _each(0.05, speed_km_h)
    tco1 = _empty(len(speed))
    tco1[:, 3] = 0x3F | _two_bits(_each(0.05, reverse)) << 6  # SPN 1619 in byte 4, bits 7 and 8: 0 forward, 1 reverse
    tco1[:, 6:8] = two_bytes(speed, 1 / 256, 0.0)  # SPN 1624
    yield _Message(0x0CFE6CEE, 0.05, tco1)  # PGN 65132 from the tachograph


def _each(period_s: float, values: Array) -> Array:
    return values[:: round(period_s * RATE_HZ)]


def _empty(count: int) -> Bytes:
    return np.full((count, 8), _NOT_AVAILABLE_1, np.uint8)


def _two_bits(status: Array) -> Bytes:
    """0, 1, or 3 for a status that is not available."""
    return np.where(np.isnan(status), 3.0, status).astype(np.uint8)


def _columns(sensed: Sensed) -> dict[str, Array]:
    """Signals by name, infinite where the sensor reports an error."""
    column = {name: sensed.signals.columns[SIGNALS[name].column] for name in sensed.signals.sources}
    if sensed.speed_over_ground_m_s is not None:
        column["speed_over_ground"] = sensed.speed_over_ground_m_s
    for fault in sensed.faults:
        if fault.kind == "error":
            for name in _columns_of(fault.signal):
                column[name] = column[name].copy()
                column[name][ticks(fault.begin_s, fault.end_s - fault.begin_s)] = np.inf
    return column


def _columns_of(signal: str) -> list[str]:
    """The columns of one signal, of the four wheels, or of the receiver."""
    if signal == "gnss":
        return ["latitude", "longitude", "heading", "speed_over_ground"]
    return [f"wheel_speed_{corner}" for corner in CORNERS] if signal == "wheel_speed" else [signal]


def two_bytes(value: Array, scale: float, offset: float) -> Bytes:
    """J1939's little-endian two-byte encoding, shape (n, 2): NaN becomes not available, beyond the range error."""
    raw = _raw(value, scale, offset, _LARGEST_2, _ERROR_2, _NOT_AVAILABLE_2).astype("<u2")
    return raw.view(np.uint8).reshape(-1, 2)


def one_byte(value: Array, scale: float, offset: float) -> Bytes:
    """J1939's one-byte encoding, shape (n,), as `two_bytes`."""
    return _raw(value, scale, offset, _LARGEST_1, _ERROR_1, _NOT_AVAILABLE_1).astype(np.uint8)


def four_bytes(value: Array, scale: float, offset: float) -> Bytes:
    """J1939's little-endian four-byte encoding, shape (n, 4), as `two_bytes`."""
    raw = _raw(value, scale, offset, _LARGEST_4, _ERROR_4, _NOT_AVAILABLE_4).astype("<u4")
    return raw.view(np.uint8).reshape(-1, 4)


def _raw(value: Array, scale: float, offset: float, largest: int, error: int, not_available: int) -> Array:
    raw = np.floor((value - offset) / scale + 0.5)
    raw = np.where((raw < 0) | (raw > largest), error, raw)
    return np.where(np.isnan(value), not_available, raw)
