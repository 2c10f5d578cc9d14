"""A second reader for each format, simple and slow, without code of `oncenter.read`: the oracle for its results.

It runs as a child process (`oncenter.files.child`), because such readers may crash, and writes a log's signals as a
table that oncenter reads.

It follows the same conventions, because a damaged log can be read in several ways: - lines that are not frames of the
format are left out, as are remote frames, error frames and CAN FD of more than 8 bytes; - of frames, a sample whose
stamp is not later than all before is left out, and a clock that is set back by over 1 s begins another piece; rows of a
table stay unchanged; - a signal comes from the first message of a fixed order, and among its senders from the one with
the most valid samples; - a signal is interpolated over at most 2.5 of its periods; in longer gaps it is NaN.
"""

from __future__ import annotations

import contextlib
import csv
import io
import math
import re
import zlib
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.parquet as pq

from oncenter.files.child import Send, serve

Column = npt.NDArray[np.float64]
NAN = math.nan

ANGLE = "steering_wheel_angle_rad"
SENSOR_TYPE = "steering_wheel_angle_sensor_type"


class Frame(NamedTuple):
    time: float  # s
    identifier: int
    extended: bool
    data: bytes
    bus: str


class Series(NamedTuple):
    """A signal of one sender at its own stamps."""

    time: Column
    values: Column


def answer(request: Mapping[str, Any], send: Send) -> None:
    columns = read(Path(request["log"]))
    pq.write_table(pa.table({name: pa.array(values) for name, values in columns.items()}), request["table"])
    send({"last": True})


def read(log: Path) -> dict[str, Column]:
    """Columns including `time_s`, all of one length, with units in their names."""
    name = log.name.lower()
    if name.endswith((".csv", ".csv.gz")):
        return _csv_columns(log.read_bytes())
    if name.endswith(".parquet"):
        return _parquet_columns(log)
    if name.endswith((".mf4", ".mdf", ".dat")):
        return _mdf_columns(log)
    if name.endswith(".vbo"):
        return _vbo_columns(log.read_bytes())
    if name.endswith(".mat"):
        return _mat_columns(log)
    if name.endswith((".bag", ".mcap", ".db3")):
        return _ros_columns(log)
    readers: dict[str, Callable[[Path], Iterable[Frame]]] = {
        ".log": _candump_frames,
        ".asc": _asc_frames,
        ".trc": _trc_frames,
        ".blf": _blf_frames,
    }
    return _columns_of_frames(readers[log.suffix.lower()](log))


# ---------------------------------------------------------------------------------------------------------------------
# J1939
# ---------------------------------------------------------------------------------------------------------------------

VDC2, EBC2, HRW, CCVS1, TCO1, VDS = 61449, 65215, 65134, 65265, 65132, 65256
VDC1, EBC1, ETC2 = 65103, 61441, 61445
STABILITY, ANTI_LOCK, REVERSE = "stability_control_active", "anti_lock_active", "reverse"
WHEELS = tuple(f"wheel_speed_{corner}_km_h" for corner in ("front_left", "front_right", "rear_left", "rear_right"))
_SPEED_FROM, _WHEELS_FROM, _REVERSE_FROM = (CCVS1, EBC2, TCO1, HRW, VDS), (HRW, EBC2), (ETC2, TCO1)


def _group(identifier: int) -> int:
    """The parameter group number; below PDU format 240 the next byte is a destination and not part of it."""
    group = identifier >> 8 & 0x3FFFF
    return group if group >> 8 & 0xFF >= 240 else group & 0x3FF00


def _two_bytes(data: bytes, byte: int, scale: float, offset: float) -> float:
    """Bytes count from 1."""
    raw = data[byte - 1] + 256 * data[byte]
    return raw * scale + offset if raw <= 0xFAFF else NAN


def _one_byte(data: bytes, byte: int, scale: float, offset: float) -> float:
    return data[byte - 1] * scale + offset if data[byte - 1] <= 0xFA else NAN


def _signals(group: int, data: bytes) -> dict[str, float]:
    """The values in one frame of a group; missing bytes are not available."""
    data = data.ljust(8, b"\xff")
    if group == VDC2:
        kind = data[2] >> 6
        return {
            ANGLE: _two_bytes(data, 1, 1 / 1024, -31.374),
            "yaw_rate_rad_s": _two_bytes(data, 4, 1 / 8192, -3.92),
            "lateral_acceleration_m_s2": _two_bytes(data, 6, 1 / 2048, -15.687),
            "longitudinal_acceleration_m_s2": _one_byte(data, 8, 0.1, -12.5),
            SENSOR_TYPE: float(kind) if kind <= 1 else NAN,
        }
    if group == EBC2:
        axle = _two_bytes(data, 1, 1 / 256, 0.0)
        wheels = (axle + _one_byte(data, byte, 1 / 16, -7.8125) for byte in range(3, 7))
        return {"vehicle_speed_km_h": axle, **dict(zip(WHEELS, wheels, strict=True))}
    if group == HRW:
        each = [_two_bytes(data, byte, 1 / 256, 0.0) for byte in (1, 3, 5, 7)]
        return {"vehicle_speed_km_h": sum(each) / 4, **dict(zip(WHEELS, each, strict=True))}
    if group == VDC1:
        return {STABILITY: _any(_two_bits(data[1] >> bit) for bit in (0, 2, 4, 6))}
    if group == EBC1:
        return {ANTI_LOCK: _two_bits(data[0] >> 4)}
    if group == ETC2:
        gear = data[3] - 125
        return {REVERSE: float(gear < 0) if -15 <= gear <= 25 else NAN}
    direction = {REVERSE: _two_bits(data[3] >> 6)} if group == TCO1 else {}
    speed_byte = {CCVS1: 2, TCO1: 7, VDS: 3}.get(group)
    return {} if speed_byte is None else {"vehicle_speed_km_h": _two_bytes(data, speed_byte, 1 / 256, 0.0)} | direction


def _two_bits(data: int) -> float:
    return float(data & 3) if data & 3 <= 1 else NAN


def _any(states: Iterable[float]) -> float:
    """1 where one is, 0 where one is known; NaN where none is."""
    return max((state for state in states if state == state), default=NAN)


def _columns_of_frames(frames: Iterable[Frame]) -> dict[str, Column]:
    rows: dict[tuple[int, int, str], list[tuple[float, dict[str, float]]]] = defaultdict(list)
    frames, pieces = _on_one_clock([frame for frame in frames if frame.extended])
    for frame in frames:
        if frame.extended:
            signals = _signals(_group(frame.identifier), frame.data)
            if signals:
                rows[_group(frame.identifier), frame.identifier & 0xFF, frame.bus].append((frame.time, signals))
    found: dict[str, list[tuple[int, int, Series]]] = defaultdict(list)  # by signal: rank, how many numbers
    for (group, _, _), sent in rows.items():
        time = np.array([stamp for stamp, _ in sent])
        for name in sent[0][1]:
            values = np.array([signals[name] for _, signals in sent])
            if np.isfinite(values).any():
                found[name].append((_rank(name, group), int(np.isfinite(values).sum()), Series(time, values)))
    chosen = {name: min(given, key=lambda each: (each[0], -each[1]))[2] for name, given in found.items()}
    columns = _at_angle({name: _increasing(series) for name, series in chosen.items()})
    for begin, shift in pieces:
        columns["time_s"] = np.where(columns["time_s"] >= begin, columns["time_s"] - shift, columns["time_s"])
    return columns


def _on_one_clock(frames: list[Frame]) -> tuple[list[Frame], list[tuple[float, float]]]:
    """Pieces between which the clock of the senders was set back by over 1 s, behind one another with 10 s between
    them; of each later piece, its begin and by how much its times are later than those of the piece before."""
    last: dict[tuple[int, str], float] = {}
    piece: dict[tuple[int, str], int] = defaultdict(int)
    of_frame = []
    for frame in frames:
        sender = frame.identifier, frame.bus
        piece[sender] += frame.time < last.get(sender, -math.inf) - 1.0
        last[sender] = frame.time
        of_frame.append(piece[sender])
    if not of_frame or not 0 < max(of_frame) <= 0.1 * len(of_frame) / len(last):
        return frames, []
    times = [[f.time for f, of in zip(frames, of_frame, strict=True) if of == k] for k in range(max(of_frame) + 1)]
    shifts, pieces = [0.0], []
    for before, after in pairwise(times):
        by = max(before) - min(after) + 10.0
        shifts.append(shifts[-1] + by)
        pieces.append((min(after) + shifts[-1], by))
    shifted = [f._replace(time=f.time + shifts[of]) for f, of in zip(frames, of_frame, strict=True)]
    return shifted, pieces[::-1]


def _rank(name: str, group: int) -> int:
    orders = {"vehicle_speed_km_h": _SPEED_FROM, REVERSE: _REVERSE_FROM, **dict.fromkeys(WHEELS, _WHEELS_FROM)}
    return orders.get(name, (group,)).index(group)


def _increasing(series: Series) -> Series:
    latest, kept = -math.inf, []
    for time in series.time.tolist():
        kept.append(time > latest)
        latest = max(latest, time)
    return Series(series.time[kept], series.values[kept])


def _at_angle(chosen: dict[str, Series]) -> dict[str, Column]:
    """All signals at the stamps of the steering wheel angle."""
    if ANGLE not in chosen:
        raise ValueError("no steering wheel angle")
    at = chosen[ANGLE].time
    return {"time_s": at, **{name: _interpolated(name, series, at) for name, series in chosen.items()}}


def _interpolated(name: str, series: Series, at: Column) -> Column:
    known = np.isfinite(series.values)
    time, values = series.time[known], series.values[known]
    if len(time) < 2:
        return np.full(len(at), NAN)
    after = np.clip(np.searchsorted(time, at), 1, len(time) - 1)
    gap = time[after] - time[after - 1]
    near = gap <= max(2.5 * float(np.median(np.diff(time))), 0.05)
    if name in (SENSOR_TYPE, STABILITY, ANTI_LOCK, REVERSE):
        found = np.where(at - time[after - 1] < time[after] - at, values[after - 1], values[after])
    else:
        found = np.interp(at, time, values)
    return np.where(near & (at >= time[0]) & (at <= time[-1]) | np.isin(at, time), found, NAN)


# ---------------------------------------------------------------------------------------------------------------------
# Logs of frames
# ---------------------------------------------------------------------------------------------------------------------

_CANDUMP = re.compile(
    r"\s*\((\d+\.\d+)\)\s+(\S+)\s+([0-9A-Fa-f]{8}|[0-9A-Fa-f]{3})#(?:#[0-9A-Fa-f])?((?:[0-9A-Fa-f]{2}){0,8})"
    r"(?:\s+[RT])?\s*"
)


def _candump_frames(log: Path) -> Iterator[Frame]:
    text = log.read_bytes().removeprefix(b"\xef\xbb\xbf").decode("latin-1")
    for line in text.split("\n"):
        found = _CANDUMP.fullmatch(line)
        if found and int(found[3], 16) < 1 << 29:
            yield Frame(float(found[1]), int(found[3], 16), len(found[3]) == 8, bytes.fromhex(found[4]), found[2])


def _whole_lines(log: Path) -> list[str]:
    """The lines, with any line ends; a last line without one is cut off and left out."""
    return re.split("\r\n|\r|\n", log.read_bytes().decode("utf-8", "replace"))[:-1]


_ASC_BASE = re.compile(r"base\s+(hex|dec)(?:\s+timestamps\s+(absolute|relative))?", re.IGNORECASE)
_ASC_BLOCK = re.compile(r"begin\s+triggerblock\s+\w+\s+(.+)", re.IGNORECASE)
_ASC_FRAME = re.compile(r"(\d+\.\d+)\s+(\d+)\s+(\w+?)(x?)\s+(?:Rx|Tx)\s+d\s+(\w+)((?:\s+\w+)*)", re.IGNORECASE)
_ASC_DATES = ("%b %d %I:%M:%S.%f %p %Y", "%b %d %I:%M:%S %p %Y", "%b %d %H:%M:%S.%f %Y", "%b %d %H:%M:%S %Y")


def _asc_frames(log: Path) -> Iterator[Frame]:
    radix, relative, begin, since = 16, False, 0.0, 0.0
    for line in map(str.strip, _whole_lines(log)):
        if base := _ASC_BASE.match(line):
            radix, relative = 10 if base[1].lower() == "dec" else 16, (base[2] or "").lower() == "relative"
        elif block := _ASC_BLOCK.match(line):
            begin, since = _asc_date(block[1]), 0.0
        elif relative and (stamp := re.match(r"\d+\.\d+", line)):
            since += float(stamp[0])
        if not (frame := _ASC_FRAME.match(line)):
            continue
        time = begin + (since if relative else float(frame[1]))
        with contextlib.suppress(ValueError):  # mangled
            length, written = int(frame[5], radix), frame[6].split()
            data = bytes(int(octet, radix) for octet in written[: min(length, 8)])
            yield Frame(time, int(frame[3], radix) & 0x1FFFFFFF, bool(frame[4]), data, frame[2])


def _asc_date(text: str) -> float:
    for form in _ASC_DATES:
        try:
            return datetime.strptime(text, form).replace(tzinfo=UTC).timestamp()
        except ValueError:
            continue
    raise ValueError(f"no date: {text[:60]}")


def _trc_frames(log: Path) -> Iterator[Frame]:
    """Versions 2.0 and 2.1, which name their columns."""
    places: dict[str, int] = {}
    for line in map(str.strip, _whole_lines(log)):
        if line.startswith(";$COLUMNS="):
            names = line.partition("=")[2].split(",")
            places = {name: place for place, name in enumerate(names)}
        if line.startswith(";") or not line:
            continue
        if not places:
            raise ValueError("a TRC file of a version that names no columns")
        cells = line.split(maxsplit=len(places) - 1)
        if len(cells) < len(places) - 1 or cells[places["T"]] != "DT":
            continue
        with contextlib.suppress(ValueError, IndexError):  # mangled
            yield _trc_frame(cells, places)


def _trc_frame(cells: Sequence[str], places: Mapping[str, int]) -> Frame:
    length = int(cells[places["L" if "L" in places else "l"]])
    data = bytes.fromhex(cells[places["D"]]) if length else b""
    identifier = cells[places["I"]]
    return Frame(
        float(cells[places["O"]]) / 1000.0,
        int(identifier, 16) & 0x1FFFFFFF,
        len(identifier) > 4,
        data[:8],
        cells[places["B"]] if "B" in places else "",
    )


def _blf_frames(log: Path) -> Iterator[Frame]:
    import can

    with can.BLFReader(log) as messages:
        for message in messages:
            if not (message.is_error_frame or message.is_remote_frame) and len(message.data) <= 8:
                data = bytes(message.data[:8])
                yield Frame(
                    message.timestamp, message.arbitration_id, message.is_extended_id, data, str(message.channel)
                )


# ---------------------------------------------------------------------------------------------------------------------
# MDF
# ---------------------------------------------------------------------------------------------------------------------


def _mdf_columns(log: Path) -> dict[str, Column]:
    from asammdf import MDF

    with MDF(log) as mdf:
        groups = [index for index, group in enumerate(mdf.groups) if group.channel_group.cycles_nr]
        names = {index: [channel.name for channel in mdf.groups[index].channels] for index in groups}
        of_frames = [index for index in groups if "CAN_DataFrame" in names[index]]
        if of_frames:
            frames = [frame for index in of_frames for frame in _mdf_frames(mdf.get("CAN_DataFrame", group=index))]
            return _columns_of_frames(sorted(frames, key=lambda frame: frame.time))
        found: dict[str, list[Series]] = defaultdict(list)
        for index in groups:
            for place, name in enumerate(names[index]):
                if _is_signal(name):
                    found[name].append(_mdf_series(mdf.get(group=index, index=place, ignore_invalidation_bits=True)))
    chosen = {name: max(given, key=lambda series: np.isfinite(series.values).sum()) for name, given in found.items()}
    times = [series.time for series in chosen.values()]
    if all(np.array_equal(time, times[0]) for time in times):
        return {"time_s": times[0], **{name: series.values for name, series in chosen.items()}}
    return _at_angle({name: _increasing(series) for name, series in chosen.items()})


def _mdf_frames(signal: Any) -> Iterator[Frame]:
    rows = signal.samples
    fields = {name.rpartition(".")[2]: rows[name] for name in rows.dtype.names}
    count = len(rows)
    nothing = np.zeros(count, np.uint8)
    identifiers, octets = fields["ID"].astype(np.int64), fields["DataBytes"]
    columns = (
        signal.timestamps.tolist(),
        identifiers.tolist(),
        (fields.get("IDE", nothing).astype(bool) | (identifiers >> 31 == 1)).tolist(),
        fields.get("DataLength", np.full(count, octets.shape[1])).tolist(),
        fields.get("BusChannel", nothing).tolist(),
        fields.get("EDL", nothing).tolist(),
    )
    for place, (time, identifier, extended, length, bus, flexible) in enumerate(zip(*columns, strict=True)):
        if not (flexible and length > 8):
            data = octets[place].tobytes()[: min(length, 8)]
            yield Frame(time, identifier & 0x1FFFFFFF, extended, data, str(bus))


def _mdf_series(signal: Any) -> Series:
    values = signal.samples.astype(np.float64)
    if signal.invalidation_bits is not None:
        values[np.asarray(signal.invalidation_bits, bool)] = NAN
    return Series(signal.timestamps.astype(np.float64), values)


# ---------------------------------------------------------------------------------------------------------------------
# Tables
# ---------------------------------------------------------------------------------------------------------------------

_OURS = ("time", "date", "steering_wheel", "yaw_rate", "vehicle_speed", "lateral_", "longitudinal_", "wheel_speed_")


def _is_signal(name: str) -> bool:
    return name.startswith(_OURS) and name != "time"


def _csv_columns(data: bytes) -> dict[str, Column]:
    text = _csv_text(_unpacked(data))
    header_line = text.split("\n", 1)[0]
    separator = max(",;\t", key=header_line.count)
    rows = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
    header = [name.strip() for name in next(rows)]
    body = [row for row in rows if row]
    if body and not text.endswith("\n") and len(body[-1]) < min(len(header), len(body[-2]) if body[1:] else 1 << 30):
        body.pop()  # the recording broke off
    if any(len(row) > len(header) for row in body):
        raise ValueError("a row is longer than the header")
    places = {name: place for place, name in reversed(list(enumerate(header))) if name.startswith(_OURS)}
    cells = {name: [row[place] if place < len(row) else "" for row in body] for name, place in places.items()}
    if separator != ",":
        cells = {name: _with_points(column) for name, column in cells.items()}
    return {name: np.array([_number(cell) for cell in column]) for name, column in cells.items()}


def _unpacked(data: bytes) -> bytes:
    """All members of a gzip file; other bytes as they are."""
    if not data.startswith(b"\x1f\x8b"):
        return data
    parts = []
    while data.strip(b"\0"):
        member = zlib.decompressobj(wbits=31)
        parts.append(member.decompress(data))
        if not member.eof:
            raise ValueError("cut off within a gzip member")
        data = member.unused_data
    return b"".join(parts)


def _csv_text(data: bytes) -> str:
    """The text from the header on."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        data = data.decode("utf-16", "replace").encode()
    text = data.decode("utf-8", "replace").lstrip("\ufeff")  # a mark may have been put before another
    if "\n" not in text:
        text = text.replace("\r", "\n")
    lines = iter(text.split("\n"))
    kept = next((line for line in lines if line.strip() and not line.startswith(("#", "sep="))), "")
    return "\n".join([kept, *lines])


def _with_points(column: list[str]) -> list[str]:
    return column if any("." in cell for cell in column) else [cell.replace(",", ".", 1) for cell in column]


def _number(cell: str) -> float:
    try:
        value = float(cell) if "_" not in cell else NAN
    except ValueError:
        return NAN
    return value if math.isfinite(value) else NAN


def _parquet_columns(log: Path) -> dict[str, Column]:
    file = pq.ParquetFile(log)
    names = [name for name in file.schema_arrow.names if name.startswith(_OURS)]
    table = file.read(columns=names)
    return {name: _floats(table[name]) for name in names}


def _floats(column: pa.ChunkedArray) -> Column:
    kind = column.type
    if pa.types.is_timestamp(kind):
        per_second = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}[kind.unit]
        return np.array([NAN if value is None else value / per_second for value in column.cast(pa.int64()).to_pylist()])
    if pa.types.is_string(kind) or pa.types.is_large_string(kind):
        return np.array([NAN if cell is None else _number(cell) for cell in column.to_pylist()])
    values = np.array([NAN if value is None else float(value) for value in column.to_pylist()])
    values[~np.isfinite(values)] = NAN
    return values


# ---------------------------------------------------------------------------------------------------------------------
# Racelogic, MATLAB, ROS: as tests/signal_logs.py writes them
# ---------------------------------------------------------------------------------------------------------------------

_VBO = {  # by column: as we call it, and the factor
    "velocity": ("vehicle_speed_km_h", 1.0),
    "Steering_Angle": (ANGLE, math.pi / 180.0),
    "Yaw_Rate": ("yaw_rate_rad_s", -math.pi / 180.0),
    "Y_Accel": ("lateral_acceleration_m_s2", 9.80665),
}


def _vbo_columns(data: bytes) -> dict[str, Column]:
    text = data.decode("utf-8", "replace").lstrip("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    head, body = text.split("\n[data]", 1)
    columns = next(line for line in head.split("[column names]")[1].split("\n") if line.strip()).split()
    lines = body.split("\n")[1:-1]
    rows = [row for row in map(str.split, lines) if len(row) == len(columns)]
    cells = {name: np.array([_number(row[place]) for row in rows]) for place, name in enumerate(columns)}
    stamp = cells["time"]
    time = stamp // 10_000 * 3600 + stamp // 100 % 100 * 60 + stamp % 100
    time += 86400.0 * np.cumsum(np.diff(time, prepend=time[0]) < -43200.0)
    kept = np.isfinite(time)
    found = {ours: cells[name][kept] * factor for name, (ours, factor) in _VBO.items() if name in cells}
    return {"time_s": time[kept], **found}


def _mat_columns(log: Path) -> dict[str, Column]:
    content = log.read_bytes()
    if b"\x89HDF\r\n\x1a\n" in content[:1024]:
        import h5py

        with h5py.File(log) as file:
            found = {name: np.ravel(file["s"][name][()]) for name in file["s"]}
    else:
        import scipy.io

        found = scipy.io.loadmat(io.BytesIO(content), simplify_cells=True)
    if "ScopeData" in found:
        scope = found["ScopeData"]
        found = {"time_s": scope["time"], **{each["label"]: each["values"] for each in scope["signals"]}}
    columns = {name: np.asarray(values, np.float64) for name, values in found.items() if name.startswith(_OURS)}
    kept = np.isfinite(columns["time_s"])
    return {name: np.where(np.isfinite(values), values, NAN)[kept] for name, values in columns.items()}


def _ros_columns(log: Path) -> dict[str, Column]:
    """rosbags decodes the messages, with code that it makes of the definitions."""
    from rosbags.rosbag1 import Reader as Rosbag1
    from rosbags.rosbag2 import Reader as Rosbag2
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    is_first = log.suffix == ".bag"
    store = get_typestore(Stores.EMPTY)
    rows: dict[str, list[tuple[float, float, Any]]] = defaultdict(list)
    with (Rosbag1 if is_first else Rosbag2)(log) as bag:
        for connection in bag.connections:
            types = get_types_from_msg(connection.msgdef.data, connection.msgtype)
            store.register({name: given for name, given in types.items() if name not in store.fielddefs})
        decode = store.deserialize_ros1 if is_first else store.deserialize_cdr
        for connection, recorded_ns, raw in bag.messages():
            try:
                message: Any = decode(raw, connection.msgtype)
            except Exception:  # a damaged message
                continue
            stamp = message.header.stamp
            rows[connection.topic].append((recorded_ns * 1e-9, stamp.sec + 1e-9 * stamp.nanosec, message))
    given = {}
    for topic, fields in _ROS_FIELDS.items():
        recorded, stamped = (np.array([row[place] for row in rows[topic]]) for place in (0, 1))
        time = stamped if abs(np.median(stamped - recorded)) <= 5.0 else recorded
        order = np.argsort(time, kind="stable")
        for name, value in fields.items():
            values = np.array([value(row[2]) for row in rows[topic]])[order]
            given[name] = _increasing(Series(time[order], np.where(np.isfinite(values), values, NAN)))
    return _at_angle(given)


_ROS_FIELDS: dict[str, dict[str, Callable[[Any], float]]] = {
    "/vehicle/steering": {ANGLE: lambda message: message.angle},
    "/imu/data": {
        "yaw_rate_rad_s": lambda message: message.angular_velocity.z,
        "lateral_acceleration_m_s2": lambda message: message.linear_acceleration.y,
    },
    "/vehicle/speed": {"vehicle_speed_m_s": lambda message: message.twist.linear.x},
}


if __name__ == "__main__":
    serve(answer)
