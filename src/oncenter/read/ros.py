"""ROS bags: `.bag` of ROS 1, `.mcap` and `.db3` of ROS 2, or the folder of a ROS 2 bag. A signal is `/topic.field`.

rosbags opens them, without ROS. `ros_messages.py` decodes messages by the definitions stored in the bag.
"""

from __future__ import annotations

import math
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import numpy.typing as npt

from oncenter.errors import OncenterError
from oncenter.files.extra import require_package
from oncenter.files.folder import BAG_PARTS, leads_out
from oncenter.files.regular_file import refuse_what_is_no_regular_file
from oncenter.read.channels import (
    Channel,
    Content,
    NoSamples,
    is_wanted,
    no_signal_recognised,
    not_there,
    samples_of,
    with_parts,
    without_zeros,
)
from oncenter.read.frames import Column
from oncenter.read.parts import parts_of
from oncenter.read.ros_batches import Batch, Places, at, bag_reader, batches, joined
from oncenter.read.ros_messages import Field, Layout, NotDecoded, Plan, Types
from oncenter.read.samples import Samples
from oncenter.read.wording import counted, damaged, reason_of
from oncenter.signals import SignalName

_PLANS_MAX = 16  # layouts of a topic's messages that are compared; with more, each message is decoded alone
_CLOCKS_AGREE_S = 5.0  # longer than the recorder's delay
_ZSTD = b"\x28\xb5\x2f\xfd"
_REMEDIES = {"not indexed": "repair it with: rosbag reindex", "end magic": "repair it with: mcap recover"}


@dataclass
class _Topic:
    """The messages of one type under one name.

    Attributes:
        sources: connections, each with its reader.
        layout: None if its messages cannot be decoded; `why` gives the reason.
        numbers: rows of messages, with the recorder's time in s, the stamp if they have one, and the wanted fields.
        damaged: number of messages that could not be decoded.
    """

    name: str
    kind: str
    sources: list[tuple[Any, Any]] = field(default_factory=list)
    layout: Layout | None = None
    why: str = ""
    numbers: list[Column] = field(default_factory=list)
    damaged: int = 0


def read(path: Path, names: Mapping[str, SignalName], notes: list[str]) -> list[Samples]:
    """Signals of a bag. `notes` receives which clock was used.

    Raises:
        OncenterError: it cannot be read, or no signal is recognised; "missing_extra".
    """
    with _opened(path, notes) as (readers, is_first):
        topics = _topics(readers, is_first)
        wanted = {topic.name + topic.kind: _wanted_fields(topic, names) for topic in topics}
        taken = [topic for topic in topics if wanted[topic.name + topic.kind]]
        _gather(readers, {id(topic): wanted[topic.name + topic.kind] for topic in taken}, taken)
    if not topics:
        raise OncenterError(f"{path.name} has no topics", code="empty_log")
    every = [Channel(each.path, topic.name, _never, "field") for topic in topics for each in _fields(topic)]
    given, clocks = [], []
    for topic in taken:
        fields = wanted[topic.name + topic.kind]
        time, clock, columns = _columns(topic, len(fields))
        if topic.damaged:
            notes.append(f"left out {counted(topic.damaged, 'damaged message')} of {topic.name} in {path.name}")
        clocks.append((clock, topic.name))
        channels = [
            Channel(
                each.path,
                topic.name,
                partial(_content, time, columns, place, each.unit, topic.damaged),
                "field",
                f"{clock} of {topic.name}",
            )
            for place, each in enumerate(fields)
        ]
        given += [one for channel in with_parts(path, channels, names) for one in samples_of(channel, names, notes)]
    missing = _not_there(every, taken, wanted, topics, names)
    if not given:
        raise no_signal_recognised(path, every, names, "field", [*notes, *missing])
    notes += [*missing, _of_clocks(clocks)]
    return given


def _never() -> Content:
    raise NoSamples("was not read")


def _fields(topic: _Topic) -> list[Field]:
    return [] if topic.layout is None else topic.layout.fields


def _wanted_fields(topic: _Topic, names: Mapping[str, SignalName]) -> list[Field]:
    """Fields that are signals, and elements of sequences named in `[signals]`."""
    if topic.layout is None:
        return []
    fields = [each for each in topic.layout.fields if is_wanted(Channel(each.path, topic.name, _never), names)]
    paths = {each.path for each in fields}
    for name in (name for entry in names.values() for name in (entry.name, *parts_of(entry).values())):
        path = name.removeprefix(f"{topic.name}.")
        if path not in paths and topic.layout.has(path):
            paths.add(path)
            fields.append(Field(path, ""))
    return fields


def _not_there(
    every: Sequence[Channel],
    taken: Sequence[_Topic],
    wanted: Mapping[str, Sequence[Field]],
    topics: Sequence[_Topic],
    names: Mapping[str, SignalName],
) -> list[str]:
    """Notes on names in `[signals]` that no topic has, or whose topic cannot be decoded."""
    elements = [Channel(each.path, topic.name, _never) for topic in taken for each in wanted[topic.name + topic.kind]]
    notes = []
    for note in not_there([*every, *elements], names, "field"):
        signal = note.split(":")[0]
        undecoded = [t for t in topics if t.layout is None and names[signal].name.startswith(f"{t.name}.")]
        notes += [f"{signal}: {topic.name} ({topic.kind}) {topic.why}" for topic in undecoded] or [note]
    return notes


# ---------------------------------------------------------------------------------------------------------------------
# Files
# ---------------------------------------------------------------------------------------------------------------------


@contextmanager
def _opened(path: Path, notes: list[str]) -> Iterator[tuple[list[Any], bool]]:
    """Opens its parts; gives their readers and whether ROS 1 wrote them. Errors of the library become one line."""
    require_package("rosbags", path.name)
    try:
        with ExitStack() as stack:
            readers = []
            for part in _parts(path):
                reader = _reader(part, notes)
                reader.open()
                stack.callback(_closed, reader)
                readers.append(reader)
            yield readers, path.suffix.lower() == ".bag" and not path.is_dir()
    except OncenterError:
        raise
    except Exception as error:  # rosbags raises index, key, assertion and struct errors for broken files
        reason = reason_of(error)
        remedy = next((remedy for sign, remedy in _REMEDIES.items() if sign in reason), "copy or export it again")
        raise damaged(path.name, reason, remedy) from None


def _closed(reader: Any) -> None:
    reader.close()


def _parts(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    parts = sorted((part for part in path.iterdir() if part.name.endswith(BAG_PARTS)), key=_by_number)
    packed = [part.name for part in parts if part.name.endswith(".zstd")]
    if packed:
        raise OncenterError(
            f"cannot read {path.name}: {packed[0]} is compressed as a whole; unpack it first: zstd -d {packed[0]}",
            code="unreadable_log",
        )
    for part in parts:
        refuse_what_is_no_regular_file(part, "part of a bag")
        if leads_out(os.fspath(part), [os.path.realpath(path)]):
            raise OncenterError(f"{part} is a link that leads out of the bag: copy the file", code="unreadable_log")
    return parts


def _by_number(part: Path) -> list[str | int]:
    """`drive_2` before `drive_10`."""
    return [int(text) if place % 2 else text for place, text in enumerate(re.split(r"(\d+)", part.name))]


def _reader(part: Path, notes: list[str]) -> Any:
    from rosbags.rosbag2.storage_mcap import McapReader
    from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

    suffix = part.suffix.lower()
    if suffix == ".bag":
        return bag_reader(part)
    if suffix == ".mcap":
        return McapReader(part)
    unsaved = Path(f"{part}-wal")
    if unsaved.exists() and unsaved.stat().st_size:
        notes.append(f"{unsaved.name} was not read: the recorder was not closed, so the last messages are missing")
    # the reader puts the name into a URI without quoting
    return Sqlite3Reader(Path(quote(os.fsencode(part), safe="/\\:")))


# ---------------------------------------------------------------------------------------------------------------------
# Topics
# ---------------------------------------------------------------------------------------------------------------------


def _topics(readers: Sequence[Any], is_first: bool) -> list[_Topic]:
    by_name: dict[tuple[str, str], _Topic] = {}
    for reader in readers:
        for connection in reader.connections:
            topic = by_name.setdefault(
                (connection.topic, connection.msgtype), _Topic(connection.topic, connection.msgtype)
            )
            topic.sources.append((reader, connection))
    layouts: dict[str, Layout | str] = {}
    for topic in by_name.values():
        if topic.kind not in layouts:
            layouts[topic.kind] = _layout(topic, is_first)
        layout = layouts[topic.kind]
        if isinstance(layout, Layout):
            topic.layout = layout
        else:
            topic.why = layout
    return list(by_name.values())


def _layout(topic: _Topic, is_first: bool) -> Layout | str:
    """The layout of a topic's messages, or why there is none."""
    connection = topic.sources[0][1]
    serialized = "ros1" if is_first else connection.ext.serialization_format
    if serialized not in ("ros1", "cdr"):
        return f"is serialized as {serialized}, which is not supported"
    try:
        return Layout(topic.kind, _types(connection), not is_first)
    except NotDecoded as why:
        return str(why)
    except Exception as error:  # rosbags raises assertion and recursion errors for broken definitions
        return f"has an invalid definition: {(str(error).splitlines() or [''])[0][:80]}"


def _types(connection: Any) -> Types:
    """Type definitions of a connection; a bag of an older ROS 2 contains none, then those of ROS 2 Humble."""
    from rosbags.interfaces import MessageDefinitionFormat
    from rosbags.typesys import get_types_from_idl, get_types_from_msg
    from rosbags.typesys.stores import empty, ros2_humble

    definition = connection.msgdef
    if definition.format == MessageDefinitionFormat.NONE:
        return ros2_humble.FIELDDEFS
    types = dict(empty.FIELDDEFS)
    if definition.format == MessageDefinitionFormat.MSG:
        types |= get_types_from_msg(definition.data, connection.msgtype)
        return types
    parts = definition.data.split("=" * 80 + "\n") if definition.data.startswith("=" * 80) else [definition.data]
    for part in filter(None, parts):
        types |= get_types_from_idl(part.partition("\n")[2] if part.startswith("IDL: ") else part)
    return types


# ---------------------------------------------------------------------------------------------------------------------
# Messages
# ---------------------------------------------------------------------------------------------------------------------


def _gather(readers: Sequence[Any], wanted: Mapping[int, Sequence[Field]], topics: Sequence[_Topic]) -> None:
    """Reads each file once, and appends the wanted numbers to the topics."""
    rows: dict[int, _Rows] = {}
    for topic in topics:
        assert topic.layout is not None
        stamps = [f"{topic.layout.stamp}.sec", f"{topic.layout.stamp}.nanosec"] if topic.layout.stamp else []
        paths = [*stamps, *(each.path for each in wanted[id(topic)])]
        rows[id(topic)] = _Rows(topic.layout.planner(paths), len(paths))
    for reader in readers:
        of_connection = {c.id: topic for topic in topics for owner, c in topic.sources if owner is reader}
        connections = [connection for connection in reader.connections if connection.id in of_connection]
        if not connections:
            continue
        for batch in batches(reader, connections):
            topic = of_connection[batch.connection]
            numbers, is_whole = rows[id(topic)].of(_unpacked(batch))
            topic.damaged += int(np.count_nonzero(~is_whole))
            topic.numbers.append(np.column_stack((batch.recorded_ns * 1e-9, numbers))[is_whole])


class _Rows:
    """The wanted numbers of a topic's messages."""

    def __init__(self, plan_of: Callable[[bytes], Plan], count: int) -> None:
        self._plan_of, self._count = plan_of, count
        self._plans: list[Plan] = []  # the latest ones

    def of(self, batch: Batch) -> tuple[Column, npt.NDArray[np.bool_]]:
        """A row a message, and whether the message could be decoded."""
        rows = np.full((len(batch.places), self._count), math.nan)
        is_whole = np.ones(len(rows), np.bool_)
        left = np.arange(len(rows))
        for plan in self._plans:
            left = _filled(plan, batch, rows, left)
        planned = 0
        while len(left):
            first = int(left[0])
            place = int(batch.places[first])
            message = batch.raw[place : place + int(batch.sizes[first])]
            try:
                plan = self._plan_of(message)
            except NotDecoded:
                is_whole[first], left = False, left[1:]
                continue
            if planned < _PLANS_MAX:
                left = _filled(plan, batch, rows, left)
                self._plans = [plan, *self._plans[: _PLANS_MAX - 1]]
                planned += 1
            else:  # each message has lengths of its own
                rows[first], left = plan.row(message, self._count), left[1:]
        return rows, is_whole


def _filled(plan: Plan, batch: Batch, rows: Column, left: Places) -> Places:
    """Fills the rows of the messages like the plan's; returns the places of the others in the batch."""
    alike = batch.sizes[left] == plan.size
    for place, form, value in plan.lengths:
        alike[alike] = at(batch.raw, form)[batch.places[left[alike]] + place] == value
    found = left[alike]
    if len(found):
        for slot, form, place in plan.numbers:
            rows[found, slot] = at(batch.raw, form)[batch.places[found] + place]
    others: Places = left[~alike]
    return others


def _unpacked(batch: Batch) -> Batch:
    """The messages; ROS 2 may compress each one."""
    is_packed = batch.sizes >= len(_ZSTD)
    first = at(batch.raw, "<I")
    is_packed[is_packed] = first[batch.places[is_packed]] == int.from_bytes(_ZSTD, "little")
    if not is_packed.any():
        return batch
    if sys.version_info >= (3, 14):
        from compression import zstd
    else:
        from backports import zstd

    parts = zip(batch.places.tolist(), batch.sizes.tolist(), is_packed.tolist(), strict=True)
    cut = ((batch.raw[place : place + size], packed) for place, size, packed in parts)
    messages = [bytes(zstd.decompress(message)) if packed else message for message, packed in cut]
    return joined(batch.connection, batch.recorded_ns, messages)


def _columns(topic: _Topic, count: int) -> tuple[Column, str, Column]:
    """Time in s, its source, and values by field, in order of time.

    A header's stamp is the time of measurement, the recorder's time that of arrival. A stamp that was not set, or that
    is of another clock than the recorder's, is not used: signals of several topics must share one clock.
    """
    assert topic.layout is not None
    before = 3 if topic.layout.stamp else 1
    table = np.concatenate([np.empty((0, before + count)), *topic.numbers])
    recorded, values = table[:, 0], table[:, before:]
    time, clock = recorded, "time of recording"
    if topic.layout.stamp and len(table):
        stamped = table[:, 1] + 1e-9 * table[:, 2]
        if np.abs(np.median(stamped - recorded)) <= _CLOCKS_AGREE_S:
            time, clock = stamped, topic.layout.stamp
    order = np.argsort(time, kind="stable")
    return time[order], clock, values[order]


def _content(time: Column, columns: Column, place: int, unit: str, damaged: int) -> Content:
    if len(time) < 2:
        raise NoSamples(f"has {len(time)} messages")
    values = np.ascontiguousarray(columns[:, place])
    infinite = np.isinf(values)
    values[infinite] = math.nan
    lost = without_zeros({"unreadable": damaged, "infinite": int(np.count_nonzero(infinite))})
    return Content(time, values, unit, lost)


def _of_clocks(clocks: Sequence[tuple[str, str]]) -> str:
    by_clock: dict[str, list[str]] = {}
    for clock, topic in clocks:
        by_clock.setdefault(clock, []).append(topic)
    used = "; ".join(f"{clock} for {', '.join(dict.fromkeys(topics))}" for clock, topics in by_clock.items())
    return f"time used: {used}"
