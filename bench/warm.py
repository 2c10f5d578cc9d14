"""Readers in one warm process: oncenter's, the usual libraries for such logs, and the limit of the machine.

*Frames* or *rows* are columns of numbers; *signals* are decoded, resampled and ready for an answer.
"""

from __future__ import annotations

import struct
import time
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from cold import vehicle_of
from log_to_answer import decoded_frames, known_messages
from turns import best_of

import oncenter as oc
from oncenter.files.log_formats import OF_FRAMES
from oncenter.read.frames_of_log import frames_of_log
from oncenter.read.here import read_here

MDF = (".mf4", ".dat")
BAGS = (".bag", ".mcap")
TEXT = (".log", ".asc", ".trc", ".csv", ".vbo")
_NEWLINE = ord("\n")
CHUNK_BYTES = 1 << 20  # fits into the cache

Row = dict[str, Any]
Work = Callable[[], object]


def warm_table(logs: dict[str, Path], rounds: int) -> list[Row]:
    """The wall seconds by format and contender, best of the rounds, and the number of frames or rows."""
    rows: list[Row] = []
    for suffix, log in logs.items():
        data = log.read_bytes()
        limited_by, limit = _limit(suffix, data)
        field = {"limit": limit, "copy": _copy(data), **contenders(suffix, log)}
        best = best_of(field, rounds, time.perf_counter)
        count = field["python-can"]() if _has_frames(suffix) else read_to_signals(log).table.height
        rows.append({"log": suffix, "bytes": len(data), "count": count, "limited_by": limited_by, "s": best})
    return rows


def read_to_signals(log: Path) -> oc.Signals:
    """Reads in this process, with any library."""
    return read_here(log, oc.vehicle(vehicle_of(log)).signal_names, (), {}, lambda fraction: None)


def _has_frames(suffix: str) -> bool:
    return suffix in OF_FRAMES and suffix != ".dat"  # the bench's .dat has channels


def _frames(log: Path) -> Iterator[Any]:
    return frames_of_log(log, [], lambda fraction: None)


def contenders(suffix: str, log: Path) -> dict[str, Work]:
    field: dict[str, Work] = {"signals": lambda: read_to_signals(log)}
    if suffix in MDF:
        field["asammdf"] = lambda: _all_groups(log)
    if suffix == ".csv":
        field["polars"] = lambda: pl.read_csv(log)
        field["numpy"] = lambda: np.loadtxt(log, delimiter=",", skiprows=1)
    if suffix == ".csv.gz":
        field["polars"] = lambda: pl.read_csv(log)
    if suffix == ".parquet":
        field["polars"] = lambda: pl.read_parquet(log)
    if suffix == ".mat":
        import scipy.io

        field["scipy"] = lambda: scipy.io.loadmat(log)
    if suffix in BAGS:
        field["rosbags"] = lambda: _all_messages(log)
    if _has_frames(suffix):
        import can

        known = known_messages()
        field["frames"] = lambda: sum(map(len, _frames(log)))
        field["python-can"] = lambda: sum(1 for _ in can.LogReader(log))
        field["python-can + cantools"] = lambda: sum(1 for _ in decoded_frames(log, known))
    return field


def _all_groups(log: Path) -> int:
    from asammdf import MDF

    with MDF(log) as mdf:
        return sum(
            len(mdf.get(group=at, index=channel, raw=True, samples_only=True)[0])
            for at, group in enumerate(mdf.groups)
            for channel in range(len(group.channels))
        )


def _all_messages(log: Path) -> int:
    from rosbags.highlevel import AnyReader

    with AnyReader([log]) as reader:
        return sum(1 for connection, _, raw in reader.messages() if reader.deserialize(raw, connection.msgtype))


def _copy(data: bytes) -> Work:
    return np.frombuffer(data, np.uint8).copy


def _limit(suffix: str, data: bytes) -> tuple[str, Work]:
    """The minimum work of any reader of this format with its bytes in memory: a description, and a function that does
    it."""
    if suffix in TEXT:
        return "find the line ends", lambda: line_ends(data)
    if suffix == ".parquet":
        return "unpack, by polars", lambda: pl.read_parquet(data)
    parts = list(packed(suffix, data))
    if parts:
        return "inflate, by zlib", lambda: sum(len(zlib.decompress(part, zlib.MAX_WBITS | 32)) for part in parts)
    return "copy", _copy(data)


def line_ends(data: bytes) -> int:
    octets = np.frombuffer(data, np.uint8)
    return sum(np.count_nonzero(octets[k : k + CHUNK_BYTES] == _NEWLINE) for k in range(0, len(octets), CHUNK_BYTES))


def packed(suffix: str, data: bytes) -> Iterator[bytes]:
    """The compressed parts of a file."""
    if suffix == ".csv.gz":
        yield data
    elif suffix == ".blf":
        at = struct.unpack_from("<4sL", data)[1]
        while (at := data.find(b"LOBJ", at)) >= 0:
            _, _, _, size, _, compression = struct.unpack_from("<4sHHLLH", data, at)
            if compression == 2:
                yield data[at + 32 : at + size]
            at += size
    elif suffix == ".mf4":
        at = 0
        while (at := data.find(b"##DZ", at)) >= 0:
            size = struct.unpack_from("<Q", data, at + 40)[0]
            yield data[at + 48 : at + 48 + size]
            at += 48 + size
    elif suffix == ".mat" and data[124:128] == b"\x00\x01IM":
        at = 128
        while at < len(data):
            _, size = struct.unpack_from("<LL", data, at)
            yield data[at + 8 : at + 8 + size]
            at += 8 + size
