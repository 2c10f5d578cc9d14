"""Messages of ROS bags, many at a time: whole chunks of MCAP and ROS 1, in which the places of messages are columns.

rosbags finds the chunks and unpacks them. It gives each message as an object, which takes most of the time of reading.
"""

from __future__ import annotations

import struct
from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

Places = npt.NDArray[np.int64]

_MESSAGES_MAX = 10_000  # of a batch that is joined from single messages
_OF_MCAP = 31  # bytes of a message's record before its data: op, size, channel, sequence, two times
_MCAP_MESSAGE, _BAG_MESSAGE, _BAG_CONNECTION = 5, 2, 7  # types of records
_NS_PER_S = 1_000_000_000


class Batch(NamedTuple):
    """Messages of one connection.

    Attributes:
        connection: its id.
        recorded_ns: the recorder's times.
        raw: bytes that contain them.
        places, sizes: of the messages, in `raw`.
    """

    connection: int
    recorded_ns: Places
    raw: bytes
    places: Places
    sizes: Places


def at(raw: bytes, form: str) -> npt.NDArray[Any]:
    """The numbers of a `struct` format that begin at each byte."""
    kind = np.dtype(form)
    return np.ndarray((max(len(raw) - kind.itemsize + 1, 0),), kind, raw, 0, (1,))


def batches(reader: Any, connections: Collection[Any]) -> Iterator[Batch]:
    """The messages of these connections of one reader of rosbags.

    Raises:
        Exception: of any kind: the bag is damaged.
    """
    wanted = {connection.id for connection in connections}
    if hasattr(reader, "entries"):
        yield from _of_bag(reader, wanted)
    elif getattr(reader, "chunks", None):
        yield from _of_mcap(reader, wanted)
    else:
        yield from _of_messages(reader, connections)


# ---------------------------------------------------------------------------------------------------------------------
# ROS 1
# ---------------------------------------------------------------------------------------------------------------------


def bag_reader(path: Path) -> Any:
    """rosbags' reader, which keeps the index as columns."""
    from rosbags.rosbag1 import reader

    class Bag(reader.Reader):
        """
        Attributes:
            entries: by position of the chunk: connection; second, nanosecond and offset of each message.
        """

        def __init__(self, path: Path) -> None:
            super().__init__(path)
            self.entries: dict[int, list[tuple[int, npt.NDArray[np.uint32]]]] = defaultdict(list)

        def read_index_data(self, pos: int, indexes: object) -> None:
            assert self.bio
            header = reader.Header.read(self.bio, reader.RecordType.IDXDATA)
            if header.get_uint32("ver") != 1:
                raise ValueError(f"IDXDATA version {header.get_uint32('ver')} is not supported")
            count = header.get_uint32("count")
            data = reader.read_bytes(self.bio, reader.read_uint32(self.bio))
            table = np.frombuffer(data, "<u4").reshape(count, 3)
            self.entries[pos].append((header.get_uint32("conn"), table))

    return Bag(path)


def _of_bag(reader: Any, wanted: Collection[int]) -> Iterator[Batch]:
    for info in reader.chunk_infos:
        entries = [(conn, table) for conn, table in reader.entries[info.pos] if conn in wanted and len(table)]
        if not entries:
            continue
        chunk = reader.chunks[info.pos]
        reader.bio.seek(chunk.datapos)
        packed = reader.bio.read(chunk.datasize)
        if len(packed) != chunk.datasize:
            raise ValueError(f"a chunk of {chunk.datasize} bytes is cut off")
        raw = chunk.decompressor(packed)
        for conn, table in entries:
            columns = table.astype(np.int64)
            recorded_ns = columns[:, 0] * _NS_PER_S + columns[:, 1]
            yield Batch(conn, recorded_ns, raw, *_data_of_bag(raw, conn, columns))


def _data_of_bag(raw: bytes, conn: int, table: Places) -> tuple[Places, Places]:
    """Places and sizes of messages' data; the header of each has to be that of its entry in the index."""
    words = at(raw, "<u4")
    headers = table[:, 2] + 4
    if int(headers.max()) >= len(words):
        raise ValueError("the index points beyond its chunk")
    sizes = words[headers - 4].astype(np.int64)
    fields = _fields(raw, int(headers[0]), int(sizes[0]))
    alike = sizes == sizes[0]
    ends = headers + sizes
    alike &= ends < len(words)
    if {b"op", b"conn", b"time"} <= fields.keys():
        own = headers[alike]
        of_op, of_conn, of_time = fields[b"op"], fields[b"conn"], fields[b"time"]
        is_message = at(raw, "u1")[own + of_op] == _BAG_MESSAGE
        is_message &= words[own + of_conn] == conn
        is_message &= (words[own + of_time] == table[alike, 0]) & (words[own + of_time + 4] == table[alike, 1])
        alike[alike] = is_message
    else:
        alike[:] = False
    for odd in np.flatnonzero(~alike):
        headers[odd], ends[odd] = _after_connections(raw, int(headers[odd]) - 4, conn)
    sizes = words[ends].astype(np.int64)
    if bool((ends + 4 + sizes > len(raw)).any()):
        raise ValueError("a message ends beyond its chunk")
    return ends + 4, sizes


def _fields(raw: bytes, place: int, size: int) -> dict[bytes, int]:
    """By name the place of each field's value after the begin of the header."""
    found, end, begin = {}, place + size, place
    while place + 4 <= end:
        (length,) = struct.unpack_from("<I", raw, place)
        name, mark, _ = raw[place + 4 : min(place + 4 + length, end)].partition(b"=")
        if not mark:
            raise ValueError("a header has a field without a name")
        found[name] = place + 4 + len(name) + 1 - begin
        place += 4 + length
    return found


def _after_connections(raw: bytes, place: int, conn: int) -> tuple[int, int]:
    """Begin and end of the header of the first message at or after `place`."""
    while True:
        (size,) = struct.unpack_from("<I", raw, place)
        fields = _fields(raw, place + 4, size)
        begin, end = place + 4, place + 4 + size
        kind = raw[begin + fields[b"op"]]
        (length,) = struct.unpack_from("<I", raw, end)
        if kind == _BAG_MESSAGE and struct.unpack_from("<I", raw, begin + fields[b"conn"])[0] == conn:
            return begin, end
        if kind != _BAG_CONNECTION:
            raise ValueError("the index points to no message of its topic")
        place = end + 4 + length


# ---------------------------------------------------------------------------------------------------------------------
# MCAP
# ---------------------------------------------------------------------------------------------------------------------


def _of_mcap(reader: Any, wanted: Collection[int]) -> Iterator[Batch]:
    from rosbags.rosbag2.storage_mcap import decompress

    for chunk in reader.chunks:
        if chunk.channel_count and not any(chunk.channel_count.get(channel, 0) for channel in wanted):
            continue
        reader.bio.seek(chunk.chunk_start_offset + 9 + 24)
        (crc,) = struct.unpack("<I", reader.bio.read(4))
        reader.bio.seek(chunk.chunk_start_offset + 9 + 40 + len(chunk.compression))
        raw = decompress(reader.bio.read(chunk.compressed_size), chunk.compression, chunk.uncompressed_size, crc)
        for channel, records in _records(raw).items():
            if channel in wanted:
                places = np.array(records, np.int64)
                sizes = at(raw, "<u8")[places + 1].astype(np.int64) - (_OF_MCAP - 9)
                yield Batch(channel, at(raw, "<u8")[places + 15].astype(np.int64), raw, places + _OF_MCAP, sizes)


def _records(raw: bytes) -> dict[int, list[int]]:
    """By channel the places of the records of messages."""
    found: dict[int, list[int]] = defaultdict(list)
    head, end, place = struct.Struct("<BQH").unpack_from, len(raw), 0
    padded = raw + b"\0\0"  # the last record may have no channel
    while place < end:
        kind, size, channel = head(padded, place)
        if kind == _MCAP_MESSAGE:
            if size < _OF_MCAP - 9:
                raise ValueError(f"a message has a record of {size} bytes")
            found[channel].append(place)
        place += 9 + size
    if place > end:
        raise ValueError("a record ends beyond its chunk")
    return found


# ---------------------------------------------------------------------------------------------------------------------
# Others
# ---------------------------------------------------------------------------------------------------------------------


def _of_messages(reader: Any, connections: Collection[Any]) -> Iterator[Batch]:
    """Joins single messages, as SQLite and MCAP without chunks have them."""
    times: dict[int, list[int]] = defaultdict(list)
    data: dict[int, list[bytes]] = defaultdict(list)
    for connection, recorded_ns, message in reader.messages(connections):
        times[connection.id].append(recorded_ns)
        data[connection.id].append(message)
        if len(times[connection.id]) >= _MESSAGES_MAX:
            yield joined(connection.id, times.pop(connection.id), data.pop(connection.id))
    for connection_id in times:
        yield joined(connection_id, times[connection_id], data[connection_id])


def joined(connection: int, recorded_ns: Sequence[int] | Places, messages: Sequence[bytes]) -> Batch:
    sizes = np.array([len(message) for message in messages], np.int64)
    return Batch(connection, np.asarray(recorded_ns, np.int64), b"".join(messages), np.cumsum(sizes) - sizes, sizes)
