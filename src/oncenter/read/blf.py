"""Vector's Binary Logging Format (.blf), some containers at a time.

A file is a header and objects. Objects of type 10 are containers: their contents, usually compressed, are objects
again. The contents continue from one container to the next, so an object may begin in one and end in another. Up to
four bytes of padding follow an object; their number depends on the writer, so the reader searches for the next object.

A file may be damaged or hostile. Every size in it is checked before use, and `MAX_CONTAINER_BYTES` limits the memory,
whatever the size of the file.
"""

from __future__ import annotations

import struct
import zlib
from bisect import bisect_right
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from oncenter.errors import OncenterError
from oncenter.read.frames import BYTES_MAX, MORE, Frames, bus_code, joined
from oncenter.read.left_out import CutOff, LeftOut, left_out_frames
from oncenter.read.wording import counted, damaged

BLOCK_BYTES = 1 << 20  # contents per step, so that their columns fit into the cache
MAX_CONTAINER_BYTES = 32 << 20  # of a container, packed or unpacked, and of an object; Vector's have 128 KiB
MAX_EXPANSION = 100  # unpacked bytes per byte of the file; recordings have 3 to 10, zlib's limit is 1032
ALWAYS_UNPACKED_BYTES = 64 << 20  # allowed for any file, however small

_FILE_HEADER = struct.Struct("<4sL8xQQLL8H16x")  # signature, header's size, file's size, ..., start as a SYSTEMTIME
_OBJECT = struct.Struct("<4sHHLL")  # signature, header's size and version, object's size and type
_CONTAINER = struct.Struct("<H6xL4x")  # compression, size of its contents
_SIGNATURE = b"LOBJ"
_PADDING = 4  # maximum bytes after an object
_STORED, _DEFLATED = 0, 2
_LOG_CONTAINER = 10
_HEADER_BYTES = np.array([0, 32, 40])  # of an object with time stamp, by header version
_TEN_MICROSECONDS = 1  # flag; every other flag means nanoseconds
_EXTENDED = 1 << 31
_FIRST_BYTES = np.array([(1 << 8 * n) - 1 for n in range(9)], np.uint64)  # mask of n bytes

Places = npt.NDArray[np.int64]
Numbers = npt.NDArray[np.unsignedinteger[Any]]


def chunks(path: Path, notes: list[str], progress: Callable[[float], None]) -> Iterator[Frames]:
    """Data frames, CAN and CAN FD, some containers at a time. `notes` receives what was left out.

    Raises:
        OncenterError: "unreadable_log": the file is damaged, cut off or of another format.
    """
    with path.open("rb") as file:
        log = _opened(file, path.name)
        if not log.closed:
            notes.append(CutOff(f"the logger did not close {path.name}: it was read up to its last complete part"))
        rest, left_out = _Contents(), _LeftOut()
        for parts in _blocks(log):
            contents = rest.followed_by(parts)
            at, used = _objects(log, contents)
            rest = contents.after(used)
            progress(min(file.tell() / log.size, 1.0))
            yield _frames(log, contents, at, left_out)
        if log.closed and _SIGNATURE in rest.data[: 2 * _PADDING]:
            raise log.damaged(f"the last object, in the container at byte {rest.place(0)}, is cut off")
    notes.extend(left_out.notes(path.name))


@dataclass(frozen=True)
class _Log:
    """An open file.

    Attributes:
        size: bytes in the file.
        header_size: bytes before the first object.
        closed: whether the logger completed the header at the end; only then must every object be complete.
        start_s: seconds since 1970, 0 without a date.
    """

    file: BinaryIO
    name: str
    size: int
    header_size: int
    closed: bool
    start_s: float

    def damaged(self, what: str) -> OncenterError:
        return damaged(self.name, what)


@dataclass(frozen=True)
class _Contents:
    """Contents of containers, joined.

    Attributes:
        begins: position in the data at which each container's contents begin, ascending; negative if the first part
            is consumed.
        places: position in the file at which each container begins.
    """

    data: bytes = b""
    begins: tuple[int, ...] = ()
    places: tuple[int, ...] = ()

    def followed_by(self, parts: list[tuple[int, bytes]]) -> _Contents:
        begins, end = [], len(self.data)
        for _, part in parts:
            begins.append(end)
            end += len(part)
        data = b"".join((self.data, *(part for _, part in parts)))
        return _Contents(data, (*self.begins, *begins), (*self.places, *(place for place, _ in parts)))

    def after(self, used: int) -> _Contents:
        first = max(bisect_right(self.begins, used) - 1, 0)
        return _Contents(self.data[used:], tuple(b - used for b in self.begins[first:]), self.places[first:])

    def place(self, at: int) -> int:
        return self.places[bisect_right(self.begins, at) - 1]


@dataclass
class _LeftOut:
    """Counts of frames left out."""

    no_data: Counter[str] = field(default_factory=Counter)
    unknown_header: int = 0

    def notes(self, name: str) -> Iterator[str]:
        yield from left_out_frames(name, self.no_data)
        if self.unknown_header:
            text = f"left out {counted(self.unknown_header, 'frame')} of {name} with an unknown object header"
            yield LeftOut(text, "unreadable", self.unknown_header)


def _opened(file: BinaryIO, name: str) -> _Log:
    size = file.seek(0, 2)
    file.seek(0)
    head = file.read(_FILE_HEADER.size)
    if len(head) < _FILE_HEADER.size or head[:4] != b"LOGG":
        raise damaged(name, "it has no BLF header")
    _, header_size, written, _, _, _, *start = _FILE_HEADER.unpack(head)
    if not _FILE_HEADER.size <= header_size <= size:
        raise damaged(name, f"its header has {header_size} bytes")
    if written > size:
        raise OncenterError(
            f"{name} is cut off: its header says {written} bytes, the file has {size}; copy it again from the logger",
            code="unreadable_log",
        )
    return _Log(file, name, size, header_size, size - written <= _PADDING, _seconds(start))


def _seconds(system_time: list[int]) -> float:
    """Seconds since 1970 of year, month, weekday, day, hour, minute, second, millisecond. The zone is not logged."""
    year, month, _, day, hour, minute, second, millisecond = system_time
    try:
        return datetime(year, month, day, hour, minute, second, millisecond * 1000, UTC).timestamp()
    except ValueError:
        return 0.0


def _blocks(log: _Log) -> Iterator[list[tuple[int, bytes]]]:
    """Contents with the positions of their containers, a block at a time; a large container fills several blocks."""
    parts: list[tuple[int, bytes]] = []
    held = total = 0
    for place, contents in _containers(log):
        total += len(contents)
        if total > max(MAX_EXPANSION * log.size, ALWAYS_UNPACKED_BYTES):
            raise log.damaged(f"its {log.size} bytes unpack to {total} bytes or more")
        for begin in range(0, len(contents), BLOCK_BYTES):
            part = contents[begin : begin + BLOCK_BYTES]
            parts.append((place, part))
            held += max(len(part), 1 << 10)  # limits a block to a thousand parts
            if held >= BLOCK_BYTES:
                yield parts
                parts, held = [], 0
    if parts:
        yield parts


def _containers(log: _Log) -> Iterator[tuple[int, bytes]]:
    """Position in the file and contents of each. Objects outside containers are skipped."""
    place = log.header_size
    while True:
        log.file.seek(place)
        head = log.file.read(_PADDING + _OBJECT.size)
        padding = 0 if place == log.header_size else _PADDING
        skipped = head.find(_SIGNATURE, 0, len(_SIGNATURE) + padding)
        if skipped < 0 and log.size - place < 2 * _PADDING:
            return
        if skipped < 0:
            raise log.damaged(f"no object begins at byte {place}")
        place += skipped
        if len(head) < skipped + _OBJECT.size and not log.closed:
            return
        if len(head) < skipped + _OBJECT.size:
            raise log.damaged(f"the object at byte {place} is cut off")
        _, _, _, size, kind = _OBJECT.unpack_from(head, skipped)
        if size < _OBJECT.size:
            raise log.damaged(f"the object at byte {place} has {size} bytes")
        if place + size > log.size and log.closed:
            raise log.damaged(f"the object at byte {place} has {size} bytes, the file ends before")
        if kind == _LOG_CONTAINER:
            yield place, _contents(log, place, size)
        place += size


def _contents(log: _Log, place: int, size: int) -> bytes:
    """Contents of a container; the available part if the file ends within it."""
    head_size = _OBJECT.size + _CONTAINER.size
    if not head_size <= size <= MAX_CONTAINER_BYTES:
        raise log.damaged(f"the container at byte {place} has {size} bytes")
    log.file.seek(place + _OBJECT.size)
    packed = log.file.read(min(size, log.size - place) - _OBJECT.size)  # a wrong size allocates nothing
    cut = len(packed) < size - _OBJECT.size
    if cut and log.closed:
        raise log.damaged(f"the container at byte {place} is cut off")
    if len(packed) < _CONTAINER.size:
        return b""
    method, unpacked_size = _CONTAINER.unpack_from(packed)
    if method == _STORED:
        return packed[_CONTAINER.size :]
    if method != _DEFLATED:
        raise log.damaged(f"the container at byte {place} has the unknown compression {method}")
    if unpacked_size > MAX_CONTAINER_BYTES:
        raise log.damaged(f"the container at byte {place} would unpack to {unpacked_size} bytes")
    unpacking = zlib.decompressobj()
    try:
        contents = unpacking.decompress(memoryview(packed)[_CONTAINER.size :], unpacked_size + 1)
    except zlib.error as error:
        raise log.damaged(f"the container at byte {place} does not unpack: {error}") from error
    whole = unpacking.eof and len(contents) == unpacked_size
    if len(contents) > unpacked_size or not (whole or cut):
        raise log.damaged(f"the container at byte {place} does not unpack to its {unpacked_size} bytes")
    return contents


def _objects(log: _Log, contents: _Contents) -> tuple[Places, int]:
    """Where the complete objects begin, and the end of the last one."""
    chained = _chained(contents.data)
    return _walked(log, contents) if chained is None else chained


def _chained(data: bytes) -> tuple[Places, int] | None:
    """All objects at once, if signatures occur only where objects begin, which is usual; else None."""
    characters = np.frombuffer(data, np.uint8)
    signed = np.ones(max(len(data) - _OBJECT.size + 1, 0), bool)
    for offset, character in enumerate(_SIGNATURE):
        signed &= characters[offset : offset + len(signed)] == character
    if not 0 < np.count_nonzero(signed) <= len(data) // _OBJECT.size:
        return None
    at = np.flatnonzero(signed)
    sizes = _field(data, at + 8, "<u4").astype(np.int64)
    ends = at + sizes
    gaps = at - np.concatenate(([0], ends[:-1]))
    if sizes.min() < _OBJECT.size or sizes.max() > MAX_CONTAINER_BYTES or gaps.min() < 0 or gaps.max() > _PADDING:
        return None
    if ends[-1] > len(data):
        return at[:-1], int(at[-1])
    return (at, int(ends[-1])) if len(data) - ends[-1] < 2 * _PADDING else None


def _walked(log: _Log, contents: _Contents) -> tuple[Places, int]:
    """One object after another: for data that contain the signature by chance, and to locate damage."""
    data, at, end = contents.data, [], 0
    size_at = struct.Struct("<8xL").unpack_from
    while True:
        begin = data.find(_SIGNATURE, end, end + 2 * _PADDING)
        if begin < 0 and end + 2 * _PADDING <= len(data):
            raise log.damaged(f"the container at byte {contents.place(end)} contains bytes outside any object")
        if begin < 0 or begin + _OBJECT.size > len(data):
            break
        (size,) = size_at(data, begin)
        if not _OBJECT.size <= size <= MAX_CONTAINER_BYTES:
            raise log.damaged(f"the container at byte {contents.place(begin)} contains an object of {size} bytes")
        if begin + size > len(data):
            break
        at.append(begin)
        end = begin + size
    return np.array(at, np.int64), end


def _field(data: bytes, places: Places, kind: str) -> Numbers:
    """Numbers at any byte, aligned or not."""
    width = np.dtype(kind).itemsize
    windows: npt.NDArray[np.void] = np.ndarray((max(len(data) - width + 1, 0),), f"V{width}", data, strides=(1,))
    found: Numbers = windows[places].view(kind)
    return found


@dataclass(frozen=True)
class _Layout:
    """Positions of the fields in an object with a frame, in bytes after the object's header.

    Attributes:
        kinds: object types.
        size: bytes, without data of variable length.
        channel: type of the channel number, at byte 0. The identifier is always at byte 4.
        remote: byte and bit that mark a remote frame.
        length: byte with the number of data bytes.
        data: first data byte.
    """

    kinds: tuple[int, ...]
    size: int
    channel: str
    remote: tuple[int, int]
    length: int
    data: int


_CLASSIC = _Layout((1, 86), 16, "<u2", (2, 0x80), 3, 8)
_FLEXIBLE = _Layout((100,), 84, "<u2", (2, 0x80), 14, 20)
_FLEXIBLE_64 = _Layout((101,), 40, "u1", (12, 0x10), 2, 40)
_ERROR_KINDS = (2, 73, 104)  # objects with an error frame


def _frames(log: _Log, contents: _Contents, at: Places, left_out: _LeftOut) -> Frames:
    """Data frames among the objects that begin at these positions."""
    data = contents.data
    kind = _field(data, at + 12, "<u4")
    bad = _field(data, at + 4, "<u2") > _field(data, at + 8, "<u4")
    if bad.any():
        raise _wrong_sizes(log, contents, int(at[np.argmax(bad)]))
    parts, places = [], []
    for layout in (_CLASSIC, _FLEXIBLE, _FLEXIBLE_64):
        here = at[np.isin(kind, layout.kinds)]
        if len(here):
            frames, begins = _frames_like(layout, log, contents, here, left_out)
            parts.append(frames)
            places.append(begins)
    if sum(map(len, places)) < len(at):
        left_out.no_data["error_frame"] += int(np.count_nonzero(np.isin(kind, _ERROR_KINDS)))
    if len(parts) < 2:
        return joined(parts)
    merged, order = joined(parts), np.argsort(np.concatenate(places))
    return merged.where(order)


def _frames_like(
    layout: _Layout, log: _Log, contents: _Contents, at: Places, left_out: _LeftOut
) -> tuple[Frames, Places]:
    """Data frames of one layout, and where their objects begin."""
    data = contents.data + bytes(8)  # eight bytes can then be read at any object's end
    version = _field(data, at + 6, "<u2")
    known = (version == 1) | (version == 2)
    left_out.unknown_header += int(np.count_nonzero(~known))
    at, header = at[known], _HEADER_BYTES[version[known]]
    sizes = _field(data, at + 8, "<u4").astype(np.int64)
    bad = (_field(data, at + 4, "<u2") != header) | (sizes < header + layout.size)
    if bad.any():
        raise _wrong_sizes(log, contents, int(at[np.argmax(bad)]))

    body = at + header
    byte, bit = layout.remote
    remote = _field(data, body + byte, "u1") & bit != 0
    length = _field(data, body + layout.length, "u1")
    # of classic CAN, length codes 9 to 15 mean 8
    length = np.minimum(length, 8 if layout is _CLASSIC else BYTES_MAX)
    left_out.no_data["remote_frame"] += int(np.count_nonzero(remote))
    ours = ~remote
    at, header, body, length, sizes = at[ours], header[ours], body[ours], length[ours], sizes[ours]
    there = length if layout is not _FLEXIBLE_64 else _there(log, contents, at, header, length, sizes)

    identifier, channel = _field(data, body + 4, "<u4"), _field(data, body, layout.channel)
    ticks, unit = _field(data, at + 24, "<u8"), _field(data, at + 16, "<u4")
    per_second = np.where(unit == _TEN_MICROSECONDS, 1e5, 1e9)
    is_long = bool(len(length)) and int(length.max()) > 8
    first, first_there = (np.minimum(length, 8), np.minimum(there, 8)) if is_long else (length, there)
    frames = Frames(
        ticks / per_second + log.start_s,
        identifier & np.uint32((1 << 29) - 1),
        identifier >= _EXTENDED,
        _field(data, body + layout.data, "<u8") & _FIRST_BYTES[first_there] | ~_FIRST_BYTES[first],
        length,
        _buses(channel),
        _more(data, body + layout.data + 8, length, there) if is_long else None,
    )
    return frames, at


def _more(data: bytes, begins: Places, length: Numbers, there: Places | Numbers) -> npt.NDArray[np.void]:
    """Bytes 9 to 64 of CAN FD frames; of those that are not there, trailing zeros."""
    count = np.arange(8, BYTES_MAX)
    octets = _field(data + bytes(BYTES_MAX), begins, MORE.str).view(np.uint8).reshape(-1, MORE.itemsize)
    octets = np.where(count < there[:, None], octets, 0)
    octets[count >= length[:, None]] = 0xFF
    more: npt.NDArray[np.void] = octets.view(MORE)[:, 0]
    return more


def _there(log: _Log, contents: _Contents, at: Places, header: Places, length: Numbers, sizes: Places) -> Places:
    """Number of data bytes stored in each object: fewer than the frame has if the logger left out trailing zeros.

    The data end at the extension, or at the end of the object.
    """
    head = header + _FLEXIBLE_64.size
    extension = _field(contents.data, at + header + 35, "u1").astype(np.int64)
    bad = (extension > sizes) | (extension > 0) & (extension < head)
    if bad.any():
        raise _wrong_sizes(log, contents, int(at[np.argmax(bad)]))
    there: Places = np.minimum(length, np.where(extension > 0, extension, sizes) - head)
    return there


def _wrong_sizes(log: _Log, contents: _Contents, at: int) -> OncenterError:
    _, header_size, version, size, kind = _OBJECT.unpack_from(contents.data, at)
    return log.damaged(
        f"the container at byte {contents.place(at)} contains an object of type {kind} with {size} bytes, "
        f"{header_size} of them for header version {version}"
    )


def _buses(channel: Numbers) -> npt.NDArray[np.uint64]:
    """BLF channels count from 1; bus numbers here count from 0, as in python-can."""
    there = np.bincount(channel)
    codes = np.zeros(len(there), np.uint64)
    for number in np.flatnonzero(there).tolist():
        codes[number] = bus_code(str(number - 1))
    return codes[channel]
