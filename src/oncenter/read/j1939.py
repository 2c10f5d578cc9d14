"""The J1939 messages with the signals that oncenter uses: layout, decoding of whole columns, signals of each message.

Layouts from public documentation. `dbc/oncenter_j1939.dbc` describes them for other tools.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from oncenter.read.frames import Column, Frames, Kept, bus_name, pgn_of
from oncenter.read.samples import Samples
from oncenter.read.units import factors
from oncenter.signals import STATUSES


@dataclass(frozen=True)
class Parameter:
    """A suspect parameter (SPN) in its message: bytes and bits count from 1, the lowest byte comes first.

    `signal` is the signal that it gives: directly, or, with `relative`, after the message's first parameter is added,
    or by `means`. A status is true where one of its parameters is. `numbers` are the raw values that a truck can have,
    where not all are.
    """

    spn: int
    name: str
    byte: int
    bit: int
    bits: int
    scale: float
    offset: float
    unit: str
    signal: str | None = None
    relative: bool = False
    means: Callable[[Column], Column] | None = None
    numbers: tuple[int, int] | None = None

    @property
    def shift(self) -> int:
        return 8 * (self.byte - 1) + self.bit - 1

    @property
    def largest_number(self) -> int:
        """The largest valid number. Above it, by top byte: 0xFB to 0xFD reserved, 0xFE error, 0xFF not available."""
        if self.numbers is not None:
            return self.numbers[1]
        return {32: 0xFAFFFFFF, 16: 0xFAFF, 8: 0xFA, 6: 0x3D, 2: 1}[self.bits]

    @property
    def smallest_number(self) -> int:
        return 0 if self.numbers is None else self.numbers[0]


@dataclass(frozen=True)
class Message:
    pgn: int
    name: str
    about: str
    parameters: tuple[Parameter, ...]


def _speed(spn: int, name: str, byte: int, signal: str | None) -> Parameter:
    return Parameter(spn, name, byte, 1, 16, 1 / 256, 0.0, "km_h", signal)


def _relative_speed(spn: int, name: str, byte: int, signal: str | None) -> Parameter:
    return Parameter(spn, name, byte, 1, 8, 1 / 16, -7.8125, "km_h", signal, relative=True)


def _is_negative(values: Column) -> Column:
    return np.where(np.isnan(values), values, values < 0.0)


def _state(spn: int, name: str, byte: int, bit: int, signal: str) -> Parameter:
    """00 is passive, 01 active, 10 an error, 11 not available."""
    return Parameter(spn, name, byte, bit, 2, 1.0, 0.0, "1", signal)


VDC2 = Message(
    61449,
    "VDC2",
    "Vehicle Dynamic Stability Control 2",
    (
        Parameter(1807, "SteeringWheelAngle", 1, 1, 16, 1 / 1024, -31.374, "rad", "steering_wheel_angle"),
        Parameter(1811, "SteeringWheelTurnCounter", 3, 1, 6, 1.0, -32.0, "turns"),
        Parameter(1812, "SteeringWheelAngleSensorType", 3, 7, 2, 1.0, 0.0, "1", "steering_wheel_angle_sensor_type"),
        Parameter(1808, "YawRate", 4, 1, 16, 1 / 8192, -3.92, "rad_s", "yaw_rate"),
        Parameter(1809, "LateralAcceleration", 6, 1, 16, 1 / 2048, -15.687, "m_s2", "lateral_acceleration"),
        Parameter(1810, "LongitudinalAcceleration", 8, 1, 8, 0.1, -12.5, "m_s2", "longitudinal_acceleration"),
    ),
)
EBC2 = Message(
    65215,
    "EBC2",
    "Wheel Speed Information",
    (
        _speed(904, "FrontAxleSpeed", 1, "vehicle_speed"),
        _relative_speed(905, "RelativeSpeedFrontAxleLeftWheel", 3, "wheel_speed_front_left"),
        _relative_speed(906, "RelativeSpeedFrontAxleRightWheel", 4, "wheel_speed_front_right"),
        _relative_speed(907, "RelativeSpeedRearAxle1LeftWheel", 5, "wheel_speed_rear_left"),
        _relative_speed(908, "RelativeSpeedRearAxle1RightWheel", 6, "wheel_speed_rear_right"),
        _relative_speed(909, "RelativeSpeedRearAxle2LeftWheel", 7, None),
        _relative_speed(910, "RelativeSpeedRearAxle2RightWheel", 8, None),
    ),
)
HRW = Message(
    65134,
    "HRW",
    "High Resolution Wheel Speed",
    (
        _speed(1592, "FrontAxleLeftWheelSpeed", 1, "wheel_speed_front_left"),
        _speed(1593, "FrontAxleRightWheelSpeed", 3, "wheel_speed_front_right"),
        _speed(1594, "RearAxleLeftWheelSpeed", 5, "wheel_speed_rear_left"),
        _speed(1595, "RearAxleRightWheelSpeed", 7, "wheel_speed_rear_right"),
    ),
)
CCVS1 = Message(
    65265,
    "CCVS1",
    "Cruise Control/Vehicle Speed 1",
    (_speed(84, "WheelBasedVehicleSpeed", 2, "vehicle_speed"),),
)
TCO1 = Message(  # bits of SPN 1619 by the FMS standard: 00 forward, 01 reverse
    65132,
    "TCO1",
    "Tachograph",
    (
        _state(1619, "TachographDirectionIndicator", 4, 7, "reverse"),
        _speed(1624, "TachographVehicleSpeed", 7, "vehicle_speed"),
    ),
)
# Layouts of the next three as in several public decoders: byte and bit of SPN 561 to 563, 523, 1813 to 1819.
VDC1 = Message(
    65103,
    "VDC1",
    "Vehicle Dynamic Stability Control 1",
    (
        _state(1816, "ROPEngineControlActive", 2, 1, "stability_control_active"),  # ROP: roll-over prevention
        _state(1818, "ROPBrakeControlActive", 2, 3, "stability_control_active"),
        _state(1817, "YCEngineControlActive", 2, 5, "stability_control_active"),  # YC: yaw control
        _state(1819, "YCBrakeControlActive", 2, 7, "stability_control_active"),
    ),
)
EBC1 = Message(
    61441,
    "EBC1",
    "Electronic Brake Controller 1",
    (_state(563, "AntiLockBrakingActive", 1, 5, "anti_lock_active"),),
)
# Gears of trucks are -6 to 18; a controller that fills its frame with zeros would be in gear -125. 251 is park.
_GEARS = (125 - 15, 125 + 25)
ETC2 = Message(
    61445,
    "ETC2",
    "Electronic Transmission Controller 2",
    (
        Parameter(
            523, "TransmissionCurrentGear", 4, 1, 8, 1.0, -125.0, "1", "reverse", means=_is_negative, numbers=_GEARS
        ),
    ),
)
VP = Message(
    65267,
    "VP",
    "Vehicle Position",
    (
        Parameter(584, "Latitude", 1, 1, 32, 1e-7, -210.0, "deg", "latitude"),
        Parameter(585, "Longitude", 5, 1, 32, 1e-7, -210.0, "deg", "longitude"),
    ),
)
VDS = Message(
    65256,
    "VDS",
    "Vehicle Direction/Speed",
    (
        Parameter(165, "CompassBearing", 1, 1, 16, 1 / 128, 0.0, "deg", "heading"),
        _speed(517, "NavigationBasedVehicleSpeed", 3, "vehicle_speed"),
    ),
)
MESSAGES = {message.pgn: message for message in (VDC2, EBC2, HRW, CCVS1, TCO1, VDC1, EBC1, ETC2, VP, VDS)}

# The first available message is used: for the speed the one filtered for driving, for wheel speeds the one with the
# finest resolution, for the direction the gear, since not every tachograph's sensor has a direction.
PREFERENCE = {
    "vehicle_speed": ("CCVS1", "EBC2", "TCO1", "HRW", "VDS"),
    "reverse": ("ETC2", "TCO1"),
    **{f"wheel_speed_{wheel}": ("HRW", "EBC2") for wheel in ("front_left", "front_right", "rear_left", "rear_right")},
}

# Names of frequent parameter groups, to describe a log in which no signal is recognised.
NAMES = {
    0: "TSC1",
    1024: "XBR",
    61440: "ERC1",
    61442: "ETC1",
    61443: "EEC2",
    61444: "EEC1",
    61447: "FLI1",
    65136: "CVW",
    65198: "AIR1",
    65217: "VDHR",
    65226: "DM1",
    65247: "EEC3",
    65248: "VD",
    65253: "HOURS",
    65254: "TD",
    65258: "VW",
    65262: "ET1",
    65263: "EFL/P1",
    65266: "LFE1",
    65269: "AMB",
    65270: "IC1",
    65271: "VEP1",
    65276: "DD",
    **{pgn: message.name for pgn, message in MESSAGES.items()},
}


def home(signal: str) -> str:
    """The place of a signal in J1939, for messages: "PGN 61449 VDC2, SPN 1807". Empty if nowhere."""
    found = [
        (message, parameter)
        for message in MESSAGES.values()
        for parameter in message.parameters
        if parameter.signal == signal
    ]
    order = PREFERENCE.get(signal, ())
    found.sort(key=lambda pair: order.index(pair[0].name) if pair[0].name in order else 0)
    return "; ".join(f"PGN {message.pgn} {message.name}, SPN {parameter.spn}" for message, parameter in found)


def decode(parameter: Parameter, frames: Frames) -> Column:
    """A parameter of many frames in its own unit, NaN where it is not a valid number."""
    mask = np.uint64((1 << parameter.bits) - 1)
    raw = (frames.data >> np.uint64(parameter.shift)) & mask
    values = raw.astype(np.float64) * parameter.scale + parameter.offset
    values[(raw > parameter.largest_number) | (raw < parameter.smallest_number)] = np.nan
    return values


def why_no_number(parameters: Sequence[Parameter], frames: Frames) -> dict[str, int]:
    """By reason, the number of frames in which one of the parameters is no valid number: of the first such one."""
    reasons = np.zeros(len(frames), np.int64)
    for parameter in parameters:
        raw = (frames.data >> np.uint64(parameter.shift)) & np.uint64((1 << parameter.bits) - 1)
        top = (raw >> np.uint64(max(parameter.bits - 8, 0))).astype(np.int64)
        error = (1 << min(parameter.bits, 8)) - 2  # all ones mean not available, one less an error
        code = np.where(top > error, 1, np.where(top == error, 2, 3))
        code[frames.length.astype(np.int64) * 8 < parameter.shift + parameter.bits] = 4
        code[(raw <= parameter.largest_number) & (raw >= parameter.smallest_number)] = 0
        reasons = np.where(reasons == 0, code, reasons)
    counts = np.bincount(reasons, minlength=5)[1:].tolist()
    return {reason: count for reason, count in zip(_REASONS, counts, strict=True) if count}


_REASONS = ("not_available", "error_code", "reserved_code", "frame_too_short")


def parts_of(message: Message, signal: str) -> tuple[Parameter, ...]:
    """The parameters that a signal of the message needs."""
    own = tuple(parameter for parameter in message.parameters if parameter.signal == signal)
    if not own:  # the mean of HRW's wheels
        return message.parameters
    return (message.parameters[0], *own) if own[0].relative else own


def signals_of(message: Message, values: Mapping[int, Column]) -> dict[str, Column]:
    """The signals in SI of a message's parameters (by SPN, in their units)."""
    given: dict[str, Column] = {}
    base = message.parameters[0]
    for parameter in message.parameters:
        if parameter.signal is None or parameter.spn not in values:
            continue
        value = values[parameter.spn]
        if parameter.relative:
            if base.spn not in values:
                continue
            value = value + values[base.spn]
        value = value if parameter.means is None else parameter.means(value)
        value = value * factors(parameter.signal)[parameter.unit]
        several = parameter.signal in STATUSES and parameter.signal in given
        given[parameter.signal] = np.fmax(given[parameter.signal], value) if several else value
    wheels = [column for signal, column in given.items() if signal.startswith("wheel_speed_")]
    if message is HRW and len(wheels) == len(HRW.parameters):
        given["vehicle_speed"] = np.mean(wheels, axis=0)
    return given


def rank(signal: str, message: str) -> int:
    """Position of a message in `PREFERENCE` for a signal; 0 is used first."""
    order = PREFERENCE.get(signal, ())
    return order.index(message) if message in order else len(order)


def samples(kept: Kept) -> list[Samples]:
    """Every signal of every source (message, address, bus) in a log."""
    frames = kept.frames.where(kept.frames.extended)
    key = pgn_of(frames.identifier).astype(np.uint64) << np.uint64(8) | frames.identifier & np.uint64(0xFF)
    given = []
    buses = np.unique(frames.bus)
    for source in np.unique(key).tolist():
        message = MESSAGES.get(source >> 8)
        if message is None:
            continue
        from_source = key == source
        its_buses = [int(bus) for bus in buses if bool(np.any(frames.bus[from_source] == bus))]
        for bus in its_buses:
            on_bus = (
                frames.where(from_source & (frames.bus == bus)) if len(its_buses) > 1 else frames.where(from_source)
            )
            name = bus_name(bus) if len(its_buses) > 1 else ""
            given += _samples_of_source(message, source & 0xFF, name, on_bus)
    return given


def _samples_of_source(message: Message, address: int, bus: str, frames: Frames) -> list[Samples]:
    values = {parameter.spn: decode(parameter, frames) for parameter in message.parameters}
    description = f"{message.name} from 0x{address:02X}" + (f" on {bus}" if bus else "")
    given = []
    for signal, column in signals_of(message, values).items():
        gone = np.isnan(column)
        lost = why_no_number(parts_of(message, signal), frames.where(gone)) if gone.any() else {}
        samples = Samples(
            signal,
            frames.time,
            column,
            message.name,
            description,
            rank(signal, message.name),
            address,
            (message.name.lower(), f"0x{address:02x}", *([bus.lower()] if bus else [])),
            of_frames=True,
            complete=not lost,
            lost=lost,
            in_file=len(frames),
        )
        given.append(samples)
    return given


def found_groups(kept: Kept) -> str:
    """The parameter groups of a log, the most frequent first, for messages."""
    pgns = np.flatnonzero(kept.pgn_frames)
    pgns = pgns[np.argsort(-kept.pgn_frames[pgns], kind="stable")]
    shown = [f"{pgn} {NAMES[pgn]}" if pgn in NAMES else str(pgn) for pgn in pgns.tolist()]
    more = f" and {len(shown) - 12} more" if len(shown) > 12 else ""
    return ", ".join(shown[:12]) + more
