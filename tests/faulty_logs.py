"""Logs of healthy drives, each with one fault of the file: a row of `FAULTS` a kind.

The truck and its sensors have no fault in any of them. `kind` is what a reader of the answer has to learn; where the
same data could come from a sensor as well, `is_ambiguous`.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np
import own_network
from healthy_drive import (
    ANGLE,
    LATERAL,
    LONGITUDINAL,
    SPEED,
    STEERING_RATIO,
    TRUCK,
    WHEELBASE_M,
    WHEELS,
    YAW_RATE,
    Array,
    HealthyDrive,
    written,
)

from oncenter.signals import DEGREE, STANDARD_GRAVITY
from oncenter.simulate.can import BusFrames, frames
from oncenter.simulate.sensors import Sensed
from oncenter.simulate.truth import write_truth
from oncenter.simulate.write.candump import write_candump

Random = np.random.Generator
Columns = dict[str, Array]
Kind = Literal[
    "value in gaps",
    "magnitude",
    "byte order",
    "wrong bits",
    "wrong signal",
    "other unit",
    "scale",
    "sign",
    "stuck",
    "lag",
    "time stamps",
    "clock set back",
    "speed at standstill",
    "database range",
    "wrapped",
    "end of the range",
    "whole turn",
    "two trucks",
    "truth",
    "two senders",
    "CAN FD",
]


@dataclass(frozen=True)
class Given:
    """What the user gives to `oncenter offset`, and the offsets that are right for it, deg: none where every offset is
    wrong, as for two trucks."""

    arguments: tuple[str, ...]
    offsets_deg: tuple[float, ...]


@dataclass(frozen=True)
class FileFault:
    """A kind of fault.

    Attributes:
        name: of the row.
        kind: what is wrong with the file.
        column: of the signal that it spoils; "time_s" or "" where it is none.
        make: writes the log into a folder.
        is_ambiguous: a fault of the sensor gives the same data.
        can_be_undone: the values are all in the file, so that a right answer is as good as a named fault.
    """

    name: str
    kind: Kind
    column: str
    make: Callable[[HealthyDrive, Random, Path], Given]
    is_ambiguous: bool = False
    can_be_undone: bool = False

    def given(self, drive: HealthyDrive, folder: Path) -> Given:
        folder.mkdir(parents=True, exist_ok=True)
        return self.make(drive, np.random.default_rng([drive.seed, zlib.crc32(self.name.encode())]), folder)


# Tables ---------------------------------------------------------------------------------------------------------------


Change = Callable[[Array, Array, Random], Array]  # of a signal's values, with the time of each, s


def _table(columns: Mapping[str, Array], drive: HealthyDrive, folder: Path) -> Given:
    log = written(columns, folder / "drive.parquet")
    return Given((str(log), "--vehicle", TRUCK), (drive.offset_deg,))


def of_column(column: str, change: Change, drive: HealthyDrive, random: Random, folder: Path) -> Given:
    columns = drive.columns
    columns[column] = change(columns[column], columns["time_s"], random)
    return _table(columns, drive, folder)


def of_table(change: Callable[[Columns, HealthyDrive], Columns], drive: HealthyDrive, _: Random, folder: Path) -> Given:
    return _table(change(drive.columns, drive), drive, folder)


def in_every_second_row(value: float, values: Array, time: Array, random: Random) -> Array:
    return np.where(np.arange(len(values)) % 2 == int(random.integers(2)), value, values)


def at_random(filler: tuple[float, ...], values: Array, time: Array, random: Random) -> Array:
    """One value of `filler` in 10 % of the rows."""
    return np.where(random.random(len(values)) < 0.1, random.choice(filler), values)


def in_blocks(values: Array, time: Array, random: Random) -> Array:
    """0 in a sixth of the time, for 0.5 to 5 s each."""
    return np.where(_gaps(time, random, (0.5, 5.0)), 0.0, values)


def last_value_held(values: Array, time: Array, random: Random) -> Array:
    """The last value before each gap, in a sixth of the time, for 5 to 20 s each."""
    row = np.where(_gaps(time, random, (5.0, 20.0)), 0, np.arange(len(values)))
    return values[np.maximum.accumulate(row)]


def _gaps(time: Array, random: Random, length_s: tuple[float, float]) -> np.ndarray:
    gap = np.zeros(len(time), bool)
    end = float(random.uniform(0.0, 5.0 * length_s[1]))
    while end < time[-1]:
        length = float(random.uniform(*length_s))
        begin = end + 5.0 * length * float(random.uniform(0.5, 1.5))
        end = begin + length
        gap |= (time >= begin) & (time < end)
    return gap


def magnitude(values: Array, time: Array, random: Random) -> Array:
    return np.abs(values)


def scaled(factor: float, values: Array, time: Array, random: Random) -> Array:
    return factor * values


def one_of_two_units(factor: float, values: Array, time: Array, random: Random) -> Array:
    return values * factor ** random.choice([-1.0, 1.0])


def stuck(values: Array, time: Array, random: Random) -> Array:
    """From 30 to 70 % of the drive on."""
    begin = int(random.uniform(0.3, 0.7) * len(values))
    return np.where(np.arange(len(values)) < begin, values, values[begin])


def late(low_s: float, high_s: float, values: Array, time: Array, random: Random) -> Array:
    return np.interp(time - random.uniform(low_s, high_s), time, values)


def wrapped(values: Array, time: Array, random: Random) -> Array:
    """0 to 360 deg."""
    return np.mod(values, 2.0 * np.pi)


def saturated(values: Array, time: Array, random: Random) -> Array:
    """At the ends of a field that holds nine tenths of the values."""
    end = float(np.quantile(np.abs(values), 0.9))
    return np.clip(values, -end, end)


def a_turn_off(values: Array, time: Array, random: Random) -> Array:
    return values + random.choice([-1.0, 1.0]) * 2.0 * np.pi


def torque_as_angle(columns: Columns, drive: HealthyDrive) -> Columns:
    """N m called deg."""
    return columns | {ANGLE: drive.torque_n_m * DEGREE}


def lateral_acceleration_as_yaw_rate(columns: Columns, drive: HealthyDrive) -> Columns:
    """m/s^2 called deg/s."""
    return columns | {YAW_RATE: columns[LATERAL] * DEGREE}


def longitudinal_as_lateral(columns: Columns, drive: HealthyDrive) -> Columns:
    return columns | {LATERAL: columns[LONGITUDINAL]}


def engine_speed_as_speed(columns: Columns, drive: HealthyDrive) -> Columns:
    """Gears a factor of 1.3 apart, 1000 to 1300 rpm: SPN 190's eighths of a rpm read as SPN 84's 1/256 km/h."""
    speed = np.maximum(columns[SPEED], 1.0)
    rpm = np.where(columns[SPEED] < 1.0, 600.0, 1000.0 * 1.3 ** np.mod(np.log(speed) / np.log(1.3), 1.0))
    return columns | {SPEED: rpm * 8.0 / 256.0 / 3.6}


def time_in(seconds: float, columns: Columns, drive: HealthyDrive) -> Columns:
    """A unit of so many seconds, called s."""
    return columns | {"time_s": columns["time_s"] / seconds}


def whole_seconds(columns: Columns, drive: HealthyDrive) -> Columns:
    return columns | {"time_s": np.floor(columns["time_s"])}


# Standstill -----------------------------------------------------------------------------------------------------------

_CREEP_S, _RAMP_S = 45.0, 5.0
_CREEP_M_S = 0.25
_DEAD_ZONE_M_S = 2.0 / 3.6
_STEP_M_S = 1.0 / 3.6


def with_creep(drive: HealthyDrive, random: Random) -> Columns:
    """The drive after 45 s in which the truck creeps through a turn. In every second one it has never stood before."""
    columns = drive.columns
    time = columns["time_s"]
    if random.random() < 0.5:
        kept = time >= time[np.argmax(columns[SPEED] > 0.3)]
        columns, time = {name: values[kept] for name, values in columns.items()}, time[kept]
    count = round(_CREEP_S * drive.signals.rate_hz)
    since = np.arange(count) / drive.signals.rate_hz
    yaw_rate = random.choice([-1.0, 1.0]) * random.uniform(0.5, 1.0) * DEGREE
    there = np.interp(since, [0.0, _RAMP_S, _CREEP_S - _RAMP_S, _CREEP_S], [0.0, 1.0, 1.0, 0.0])
    turns = STEERING_RATIO * WHEELBASE_M * yaw_rate / _CREEP_M_S
    creeping = {
        ANGLE: turns * there + drive.truth.offset_rad,
        YAW_RATE: yaw_rate * there + drive.truth.yaw_rate_bias_rad_s + 0.1 * DEGREE * random.standard_normal(count),
        LATERAL: yaw_rate * _CREEP_M_S * there + 0.2 + 0.1 * random.standard_normal(count),
        **{name: np.full(count, _CREEP_M_S) for name in (SPEED, *WHEELS)},
    }
    before = {name: creeping.get(name, np.full(count, values[0])) for name, values in columns.items()}
    before["time_s"] = time[0] - _CREEP_S + since
    return {name: np.concatenate([before[name], values]) for name, values in columns.items()}


def creeping(read: Callable[[Array], Array], drive: HealthyDrive, random: Random, folder: Path) -> Given:
    """A creeping truck whose speeds are `read` of the true ones."""
    columns = with_creep(drive, random)
    speeds = [name for name in (SPEED, *WHEELS) if name in columns]
    return _table(columns | {name: read(columns[name]) for name in speeds}, drive, folder)


def dead_zone(speed: Array) -> Array:
    return np.where(speed < _DEAD_ZONE_M_S, 0.0, speed)


def whole_km_h(speed: Array) -> Array:
    return np.floor(speed / _STEP_M_S) * _STEP_M_S


# Frames ---------------------------------------------------------------------------------------------------------------


def by_database(
    drive: HealthyDrive,
    random: Random,
    folder: Path,
    *,
    bits: Mapping[str, str] | None = None,
    ranges: Mapping[str, tuple[str, ...]] | None = None,
) -> Given:
    """Frames of the truck's own network, read with a DBC that describes it wrongly; of `ranges` one is chosen."""
    chosen = {column: str(random.choice(some)) for column, some in (ranges or {}).items()}
    columns = drive.columns
    truck = own_network.truck_file(folder, own_network.dbc(bits, chosen), has_wheels=WHEELS[0] in columns)
    log = own_network.candump(columns, folder / "drive.log")
    return Given((str(log), "--vehicle", str(truck)), (drive.offset_deg,))


_VDC2, _USED = 0xF009, (0xF009, 0xFE6E, 0xFEF1)  # parameter groups: VDC2, HRW, CCVS1
_JITTER_S = 3e-4


def j1939(drive: HealthyDrive) -> BusFrames:
    """VDC2, CCVS1, and HRW where the drive has wheel speeds."""
    table = drive.signals.table.with_columns(
        **{name: drive.signals.table[SPEED] for name in WHEELS if name not in drive.signals.table.columns}
    )
    signals = replace(
        drive.signals,
        table=table,
        sources={
            **drive.signals.sources,
            **{name.removesuffix("_m_s"): drive.signals.sources["vehicle_speed"] for name in WHEELS},
        },
    )
    sent = frames(Sensed(signals, None, {}, (), 0.0, {}), jitter_sd_s=_JITTER_S, seed=drive.seed)
    groups = sent.identifier >> 8 & 0xFFFF
    has_wheels = WHEELS[0] in drive.signals.table.columns
    return _some(sent, np.isin(groups, [group for group in _USED if has_wheels or group != _USED[1]]))


def _some(sent: BusFrames, kept: np.ndarray) -> BusFrames:
    return BusFrames(sent.start_s, sent.microseconds[kept], sent.identifier[kept], sent.payload[kept])


def _candump(sent: BusFrames, drive: HealthyDrive, folder: Path) -> Given:
    log = folder / "drive.log"
    write_candump(sent, log)
    return Given((str(log), "--vehicle", TRUCK), (drive.offset_deg,))


def clock_set_back(drive: HealthyDrive, random: Random, folder: Path) -> Given:
    """A counter of 2^32 us wraps, or the clock is set back by 2 s to an hour, at 20 to 80 % of the drive."""
    sent = j1939(drive)
    at = int(random.uniform(0.2, 0.8) * sent.microseconds[-1])
    back = int(random.choice([2, 60, 3600])) * 1_000_000
    microseconds = sent.microseconds + 4_000_000_000
    if random.random() < 0.5:
        microseconds = np.mod(sent.microseconds + 2**32 - at, 2**32)
    else:
        microseconds = np.where(sent.microseconds < at, microseconds, microseconds - back)
    return _candump(replace(sent, microseconds=microseconds), drive, folder)


def stamps_in_bursts(drive: HealthyDrive, random: Random, folder: Path) -> Given:
    """The logger takes the time of its buffer, every 50 or 100 ms, in place of the time of each frame."""
    sent = j1939(drive)
    buffer_us = int(random.choice([50_000, 100_000]))
    return _candump(replace(sent, microseconds=-(-sent.microseconds // buffer_us) * buffer_us), drive, folder)


def two_senders(drive: HealthyDrive, random: Random, folder: Path) -> Given:
    """A second VDC2 whose angle is 0.8 deg more, from a higher or a lower address."""
    sent = j1939(drive)
    other = _some(sent, sent.identifier >> 8 & 0xFFFF == _VDC2)
    raw = other.payload[:, :2].copy().view("<u2").astype(np.int64)
    more = round(random.choice([-1.0, 1.0]) * 0.8 * DEGREE * 1024)
    payload = np.hstack([(raw + more).astype("<u2").view(np.uint8), other.payload[:, 2:]])
    address = int(random.choice([0x13, 0x4C]))
    identifier = (other.identifier & np.uint32(0xFFFFFF00)) | np.uint32(address)
    microseconds = np.concatenate([sent.microseconds, other.microseconds + 200])
    order = np.argsort(microseconds, kind="stable")
    both = BusFrames(
        sent.start_s,
        microseconds[order],
        np.concatenate([sent.identifier, identifier])[order],
        np.concatenate([sent.payload, payload])[order],
    )
    return replace(_candump(both, drive, folder), offsets_deg=())


def can_fd(drive: HealthyDrive, random: Random, folder: Path) -> Given:
    """VDC2 as CAN FD frames of eight bytes."""
    from asammdf import MDF

    from oncenter.simulate.write.mf4 import write_mf4

    sent = j1939(drive)
    plain, log = folder / "plain.mf4", folder / "drive.mf4"
    write_mf4(sent, plain)
    with MDF(plain) as classic:
        (signal,) = classic.select(["CAN_DataFrame"], raw=True)
        signal.samples["CAN_DataFrame.EDL"][sent.identifier >> 8 & 0xFFFF == _VDC2] = 1
        with MDF(version="4.10") as marked:
            marked.start_time = classic.start_time
            marked.append(signal)
            marked.save(log)
    plain.unlink()
    return Given((str(log), "--vehicle", TRUCK), (drive.offset_deg,))


# Several files --------------------------------------------------------------------------------------------------------

_VINS = ("YS2R4X20001234567", "YS2R4X20007654321")
_DIALECTS = (";", "tab", "UTF-16", "units", "comment", "brackets")


def two_trucks(drive: HealthyDrive, random: Random, folder: Path) -> Given:
    """Tables at 20 Hz with a VIN, of two trucks whose sensors are 3 deg apart, in one dialect of CSV."""
    dialect = _DIALECTS[int(random.integers(len(_DIALECTS)))]
    thin = {name: values[::5] for name, values in drive.columns.items()}
    logs = []
    for k, vin in enumerate(_VINS):
        columns = thin | {ANGLE: thin[ANGLE] + 3.0 * DEGREE * k}
        log = written(columns, folder / f"drive{f'[{k}]' if dialect == 'brackets' else k}.csv", vin=vin)
        _say_in(dialect, log)
        logs.append(str(log))
    return Given((*logs, "--vehicle", TRUCK), ())


def _say_in(dialect: str, log: Path) -> None:
    text = log.read_text(encoding="utf-8")
    if dialect in (";", "tab"):
        text = text.replace(",", "\t" if dialect == "tab" else ";")
    if dialect == "units":
        head, _, rows = text.partition("\n")
        text = f"{head}\n{','.join('s' if name == 'time_s' else '-' for name in head.split(','))}\n{rows}"
    if dialect == "comment":
        text = "# measured on the way home\n" + text
    log.write_text(text, encoding="utf-16" if dialect == "UTF-16" else "utf-8")


def truth_as_log(drive: HealthyDrive, random: Random, folder: Path) -> Given:
    """What a simulation writes beside its log, taken as one more log."""
    log = written(drive.columns, folder / "drive.parquet")
    truth = folder / "drive.truth.parquet"
    write_truth(drive.truth, truth, folder / "drive.truth.toml")
    return Given((str(log), str(truth), "--vehicle", TRUCK), (drive.offset_deg,))


# The rows -------------------------------------------------------------------------------------------------------------


def _of(
    name: str, kind: Kind, column: str, change: Change, *, ambiguous: bool = False, undone: bool = False
) -> FileFault:
    return FileFault(name, kind, column, partial(of_column, column, change), ambiguous, undone)


def _other_table(
    name: str, kind: Kind, column: str, change: Callable[..., Columns], *, undone: bool = False
) -> FileFault:
    return FileFault(name, kind, column, partial(of_table, change), can_be_undone=undone)


def _bits(name: str, kind: Kind, column: str, bits: str) -> FileFault:
    return FileFault(name, kind, column, partial(by_database, bits={column: bits}))


def _range(name: str, column: str, ranges: tuple[str, ...]) -> FileFault:
    make = partial(by_database, ranges={column: ranges})
    return FileFault(name, "database range", column, make, can_be_undone=True)


_RANGES = ("0|1", "0|255", "0|65535", "-3|655")
_ZERO, _OTHERS_DEG = (0.0,), (-1.0, 327.67, 655.35)
_SENTINELS = tuple(value * DEGREE for value in _OTHERS_DEG)

_ROWS = (
    _of("angle_zero_every_second_row", "value in gaps", ANGLE, partial(in_every_second_row, 0.0)),
    _of("angle_zero_at_random", "value in gaps", ANGLE, partial(at_random, _ZERO)),
    _of("angle_zero_in_blocks", "value in gaps", ANGLE, in_blocks),
    _of("angle_sentinel_at_random", "value in gaps", ANGLE, partial(at_random, _SENTINELS)),
    _of("yaw_rate_zero_every_second_row", "value in gaps", YAW_RATE, partial(in_every_second_row, 0.0)),
    _of("yaw_rate_zero_at_random", "value in gaps", YAW_RATE, partial(at_random, _ZERO)),
    _of("yaw_rate_sentinel_at_random", "value in gaps", YAW_RATE, partial(at_random, _SENTINELS)),
    _of("speed_zero_at_random", "value in gaps", SPEED, partial(at_random, _ZERO)),
    _of("speed_zero_in_blocks", "value in gaps", SPEED, in_blocks),
    _of("lateral_zero_every_second_row", "value in gaps", LATERAL, partial(in_every_second_row, 0.0)),
    _of("angle_held_in_gaps", "stuck", ANGLE, last_value_held, ambiguous=True),
    _of("angle_magnitude", "magnitude", ANGLE, magnitude),
    _of("yaw_rate_magnitude", "magnitude", YAW_RATE, magnitude),
    _of("lateral_magnitude", "magnitude", LATERAL, magnitude),
    _bits("angle_byte_order", "byte order", ANGLE, "7|16@0- (0.1,0)"),
    _bits("yaw_rate_byte_order", "byte order", YAW_RATE, "23|16@0- (0.01,0)"),
    _bits("angle_one_bit_off", "wrong bits", ANGLE, "1|16@1- (0.1,0)"),
    _bits("angle_unsigned", "wrong bits", ANGLE, "0|16@1+ (0.1,0)"),
    _bits("yaw_rate_other_bits", "wrong bits", YAW_RATE, "28|16@1- (0.01,0)"),
    _other_table("angle_is_torque", "wrong signal", ANGLE, torque_as_angle),
    _other_table("yaw_rate_is_lateral", "wrong signal", YAW_RATE, lateral_acceleration_as_yaw_rate),
    _other_table("lateral_is_longitudinal", "wrong signal", LATERAL, longitudinal_as_lateral),
    _other_table("speed_is_engine_speed", "wrong signal", SPEED, engine_speed_as_speed),
    _of("angle_rad_as_deg", "other unit", ANGLE, partial(scaled, DEGREE)),
    _of("yaw_rate_other_unit", "other unit", YAW_RATE, partial(one_of_two_units, DEGREE)),
    _of("speed_other_unit", "other unit", SPEED, partial(one_of_two_units, 3.6)),
    _of("lateral_other_unit", "other unit", LATERAL, partial(one_of_two_units, STANDARD_GRAVITY)),
    _of("angle_at_road_wheel", "scale", ANGLE, partial(scaled, 1.0 / STEERING_RATIO)),
    _of("angle_doubled", "scale", ANGLE, partial(scaled, 2.0)),
    _of("yaw_rate_doubled", "scale", YAW_RATE, partial(scaled, 2.0)),
    _of("angle_sign", "sign", ANGLE, partial(scaled, -1.0), ambiguous=True),
    _of("yaw_rate_sign", "sign", YAW_RATE, partial(scaled, -1.0), ambiguous=True),
    _of("lateral_sign", "sign", LATERAL, partial(scaled, -1.0), ambiguous=True),
    _of("angle_always_zero", "stuck", ANGLE, partial(scaled, 0.0), ambiguous=True),
    _of("angle_stuck", "stuck", ANGLE, stuck, ambiguous=True),
    _of("yaw_rate_stuck", "stuck", YAW_RATE, stuck, ambiguous=True),
    _of("speed_stuck", "stuck", SPEED, stuck, ambiguous=True),
    _of("angle_late", "lag", ANGLE, partial(late, 0.3, 1.0)),
    _of("yaw_rate_late", "lag", YAW_RATE, partial(late, 0.4, 1.0)),
    _other_table("time_in_ms", "time stamps", "time_s", partial(time_in, 0.001)),
    _other_table("time_in_minutes", "time stamps", "time_s", partial(time_in, 60.0)),
    _other_table("time_in_whole_seconds", "time stamps", "time_s", whole_seconds, undone=True),
    FileFault("stamps_in_bursts", "time stamps", "time_s", stamps_in_bursts, can_be_undone=True),
    FileFault("clock_set_back", "clock set back", "time_s", clock_set_back, can_be_undone=True),
    FileFault("speed_dead_zone", "speed at standstill", SPEED, partial(creeping, dead_zone), can_be_undone=True),
    FileFault("speed_whole_km_h", "speed at standstill", SPEED, partial(creeping, whole_km_h), can_be_undone=True),
    _range("angle_placeholder_range", ANGLE, _RANGES),
    _range("yaw_rate_placeholder_range", YAW_RATE, _RANGES),
    _range("lateral_placeholder_range", LATERAL, _RANGES),
    _of("angle_wrapped", "wrapped", ANGLE, wrapped, undone=True),
    _of("angle_saturated", "end of the range", ANGLE, saturated),
    _of("angle_a_turn_off", "whole turn", ANGLE, a_turn_off, undone=True),
    FileFault("two_trucks", "two trucks", "", two_trucks),
    FileFault("truth_as_log", "truth", "", truth_as_log, can_be_undone=True),
    FileFault("two_senders", "two senders", ANGLE, two_senders),
    FileFault("can_fd", "CAN FD", ANGLE, can_fd, can_be_undone=True),
)
FAULTS = {row.name: row for row in _ROWS}
