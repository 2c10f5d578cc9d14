"""Signals by a database (DBC, KCD, SYM, ARXML): its layouts decode whole columns of frames."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from oncenter.nearest_name import did_you_mean, in_order_of_likeness
from oncenter.read import j1939
from oncenter.read.database_file import messages_of, printable
from oncenter.read.frames import PGN_COUNT, Column, Frames, Kept, bus_name, pgn_of
from oncenter.read.parts import combined, missing_part, parts_of, unit_of_plus
from oncenter.read.samples import Samples
from oncenter.read.units import factors, named_unit, unit_by_suffix, unit_key
from oncenter.read.wording import ASSIGN_THEM
from oncenter.signals import PURE_NUMBER, SIGNALS, SignalName

if TYPE_CHECKING:
    from cantools.database.can import Message, Signal

_LISTED_MAX = 12  # signals in an error message
_ANY = (0xFE, 0xFF)  # source addresses in databases that mean any sender
_PROPRIETARY = frozenset(
    (0xEF00, 0x1EF00, *range(0xFF00, 0x10000), *range(0x1FF00, 0x20000))
)  # PGNs, a layout a sender
_NUMBER_MAX = 1e30  # of a scale or an offset

_BY_SPN = {p.spn: (m, p) for m in j1939.MESSAGES.values() for p in m.parameters}
_BY_NAME = {p.name.lower(): (m, p) for m in j1939.MESSAGES.values() for p in m.parameters}


@dataclass(frozen=True)
class Field:
    """A database signal that oncenter uses, directly or as a J1939 parameter of which a signal is computed.

    `plus` is added with its own factor; where `sign_by` is not zero, the value is negative.
    """

    layout: Signal
    factor: float  # to SI with sign, or to the J1939 parameter's unit
    signal: str | None = None
    parameter: j1939.Parameter | None = None
    group: j1939.Message | None = None
    plus: tuple[Signal, float] | None = None
    sign_by: Signal | None = None

    @property
    def layouts(self) -> tuple[Signal, ...]:
        return (self.layout, *(part for part in (self.plus and self.plus[0], self.sign_by) if part is not None))


@dataclass(frozen=True)
class Definition:
    """A database message with at least one signal that oncenter uses.

    `name` is the message's, with its identifier or its file where another definition has the same name.
    """

    message: Message
    fields: tuple[Field, ...]
    name: str
    file: str

    @property
    def pgn(self) -> int | None:
        if not self.message.is_extended_frame:
            return None
        return int(pgn_of(np.array([self.message.frame_id], np.uint32))[0])


def definitions(
    paths: Sequence[str | os.PathLike[str]], names: Mapping[str, SignalName], notes: list[str]
) -> list[Definition]:
    """The messages of the databases that oncenter uses: signals are found by `[signals]`, else by SPN, else by name.

    Raises:
        OncenterError: a file is not a database, or a signal named in `[signals]` has no unit; "missing_extra": cantools
            is not installed.
    """
    found: list[Definition] = []
    there: dict[str, str] = {}  # "Message.Signal": "Signal"
    for path in paths:
        before = len(found)
        messages = _messages_of(Path(path))
        there |= {f"{message.name}.{layout.name}": layout.name for message in messages for layout in message.signals}
        for message in messages:
            fields = [field for layout in message.signals for field in _fields(message, layout, names, notes)]
            if fields:
                found.append(Definition(message, tuple(fields), message.name, Path(path).name))
        if len(found) == before:
            notes.append(
                f"no signal recognised in the database {Path(path).name}: it has {_signals_listed(messages)}; "
                f"{ASSIGN_THEM}"
            )
    if paths:
        notes += _not_there(there, names, ", ".join(Path(path).name for path in paths))
    return _distinct(found)


def _distinct(found: Sequence[Definition]) -> list[Definition]:
    """The definitions with names by which a user can select one of them; of equal ones the first."""
    once = {_content(each): each for each in reversed(found)}
    named = [
        replace(each, name=f"{each.name}-0x{each.message.frame_id:X}") if count > 1 else each
        for each in reversed(once.values())
        for count in [sum(other.name == each.name for other in once.values())]
    ]
    return [
        replace(each, name=f"{each.name}-{each.file}") if count > 1 else each
        for each in named
        for count in [sum(other.name == each.name for other in named)]
    ]


def _content(definition: Definition) -> tuple[object, ...]:
    """All that decoding depends on: cantools compares signals by identity."""
    message = definition.message
    layouts = [
        (part.name, part.start, part.length, part.byte_order, part.is_signed, part.scale, part.offset, field.signal)
        for field in definition.fields
        for part in field.layouts
    ]
    return message.frame_id, message.is_extended_frame, definition.name, *layouts


def _messages_of(path: Path) -> list[Message]:
    """Parsed once while the file does not change: a fleet's child process reads many logs with it."""
    try:
        status = os.stat(path)
    except (OSError, ValueError):  # messages_of reports the error
        return messages_of(path)
    return _parsed(path, (status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns))


@lru_cache(maxsize=4)
def _parsed(path: Path, state: tuple[int, ...]) -> list[Message]:
    return messages_of(path)


def _not_there(there: Mapping[str, str], names: Mapping[str, SignalName], files: str) -> list[str]:
    """A note for each name in `[signals]` that no database has."""
    known = {*there, *there.values()}
    return [
        f"{signal}: [signals] names {entry.name!r}, which {files} does not have{did_you_mean(entry.name, known)}"
        for signal, entry in names.items()
        if signal in SIGNALS and entry.name not in known
    ]


def _signals_listed(messages: Sequence[Message]) -> str:
    """Signals with units, those with names most similar to the needed signals first."""
    units = {f"{message.name}.{layout.name}": layout.unit or "" for message in messages for layout in message.signals}
    wanted = ("steering_wheel_angle", "yaw_rate", "vehicle_speed", "lateral_acceleration")
    names = in_order_of_likeness(units, wanted)[:_LISTED_MAX]
    shown = ", ".join(f"{name} [{units[name]}]" if units[name] else name for name in names)
    more = len(units) - len(names)
    return printable(shown + (f" and {more} more" if more else "")) or "no signals at all"


def _fields(message: Message, layout: Signal, names: Mapping[str, SignalName], notes: list[str]) -> list[Field]:
    """The uses of a database signal; usually none."""
    by_names = [
        _named(message, layout, signal, entry)
        for signal, entry in names.items()
        if signal in SIGNALS and entry.name in (layout.name, f"{message.name}.{layout.name}")
    ]
    fields = by_names or _by_spn_or_name(layout, notes)
    for part in (part for field in fields for part in field.layouts):
        why = _impossible(part, _selectors(message, part))
        if why is not None:
            notes.append(f"{fields[0].signal or layout.name}: {message.name}.{part.name} {why} and was left out")
            return []
    return fields


def _named(message: Message, layout: Signal, signal: str, entry: SignalName) -> Field:
    """The use of a database signal by its `[signals]` entry, with its other parts.

    Raises:
        OncenterError: "missing_part": its message does not have one of them.
    """
    known = factors(signal)
    unit = named_unit(signal, entry, known, layout.unit)
    by_name = {name: each for each in message.signals for name in (each.name, f"{message.name}.{each.name}")}
    for key, name in parts_of(entry).items():
        if name not in by_name:
            there = [f"{message.name}.{each.name}" for each in message.signals]
            raise missing_part(signal, key, name, f"message {message.name} of the database", there)
    plus = None
    if entry.plus is not None:
        part = by_name[entry.plus]
        own = unit_of_plus(signal, entry, unit, part.unit or "", layout.unit or "", known)
        plus = part, entry.sign * known[own]
    sign_by = None if entry.sign_by is None else by_name[entry.sign_by]
    return Field(layout, entry.sign * known[unit], signal, plus=plus, sign_by=sign_by)


def _impossible(layout: Signal, selectors: Sequence[Signal] | None) -> str | None:
    """Why a signal, or a multiplexer that selects it, cannot be in a frame of eight bytes; None if it can."""
    if selectors is None:
        return "refers to a multiplexer that its message does not have"
    for part in (layout, *selectors):
        if not 1 <= part.length <= 64:
            return f"has {part.length} bits"
        if part.start < 0:
            return f"begins at bit {part.start}"
        if _place(part)[1] > 64:
            return "ends after the eighth byte"
        if part.is_float and part.length not in (16, 32, 64):
            return f"is a floating-point number of {part.length} bits"
    if not 0.0 < abs(_float(layout.scale)) < _NUMBER_MAX or not abs(_float(layout.offset)) < _NUMBER_MAX:
        return "has an unusable scale or offset"
    return None


def _float(number: float | None) -> float:
    """Cantools may give integers of any size."""
    try:
        return float(number or 0.0)
    except OverflowError:
        return math.inf


def _selectors(message: Message, layout: Signal) -> list[Signal] | None:
    """The multiplexers that select a signal, the nearest first; None if one is missing or they form a circle."""
    by_name = {signal.name: signal for signal in message.signals}
    selectors: list[Signal] = []
    part: Signal | None = layout
    while part is not None and part.multiplexer_ids and part.multiplexer_signal is not None:
        part = by_name.get(part.multiplexer_signal)
        if part is None or part in selectors or part is layout:
            return None
        selectors.append(part)
    return selectors


def _by_spn_or_name(layout: Signal, notes: list[str]) -> list[Field]:
    group, parameter = _BY_SPN.get(layout.spn or -1) or _BY_NAME.get(layout.name.lower()) or (None, None)
    if group is not None and parameter is not None and parameter.signal is not None:
        known = factors(parameter.signal)
        unit = unit_key(layout.unit, known) if layout.unit else parameter.unit
        if unit is None:
            notes.append(
                f"{parameter.signal}: {layout.name} left out: it has unit {layout.unit!r}, "
                f"expected {' or '.join(known)}"
            )
            return []
        return [Field(layout, known[unit] / known[parameter.unit], None, parameter, group)]
    for signal in SIGNALS:
        known = factors(signal)
        suffixed = unit_by_suffix(layout.name, known)
        if layout.name.lower() not in (signal, f"{signal}_{suffixed}"):
            continue
        unit = (
            unit_key(layout.unit or "", known) or suffixed or ("1" if SIGNALS[signal].quantity is PURE_NUMBER else None)
        )
        if unit is None:
            notes.append(
                f"{signal}: {layout.name} left out: it has unit {layout.unit!r}, expected {' or '.join(known)}"
            )
            return []
        return [Field(layout, known[unit], signal)]
    return []


def samples(kept: Kept, found: Sequence[Definition]) -> list[Samples]:
    """Every signal of every source described by the databases."""
    pgn = np.where(kept.frames.extended, pgn_of(kept.frames.identifier), PGN_COUNT)
    given: list[Samples] = []
    for definition in found:
        message = definition.message
        if definition.pgn is None:
            matching = ~kept.frames.extended & (kept.frames.identifier == message.frame_id)
        else:
            # Two messages of one parameter group differ only in the rest of the identifier.
            rivals = sum(other.pgn == definition.pgn for other in found)
            matching = pgn == definition.pgn
            if rivals > 1:
                matching &= kept.frames.identifier == message.frame_id
        given += _samples_of(definition, kept.frames.where(matching))
    return given


def _samples_of(definition: Definition, frames: Frames) -> list[Samples]:
    message = definition.message
    address = frames.identifier & np.uint32(0xFF) if message.is_extended_frame else np.zeros(len(frames), np.uint32)
    given = []
    for source, bus in sorted(set(zip(address.tolist(), frames.bus.tolist(), strict=True))):
        on_bus = frames.where((address == source) & (frames.bus == bus))
        several = len(np.unique(frames.bus[address == source])) > 1
        description = _sender(definition, source) + (f" on {bus_name(bus)}" if several else "")
        label = f"0x{source if message.is_extended_frame else message.frame_id:02x}"
        labels = (message.name.lower(), label, bus_name(bus).lower(), definition.name.lower())
        farther = int(_is_of_another_sender(definition, source) and definition.pgn in _PROPRIETARY)
        given += [
            Samples(
                signal,
                time,
                values,
                definition.name,
                description,
                rank + farther,
                source if message.is_extended_frame else None,
                labels,
                of_frames=True,
            )
            for signal, time, values, rank in _values(definition, on_bus)
        ]
    return given


def _is_of_another_sender(definition: Definition, source: int) -> bool:
    """Whether the database describes the message for another source address, and not for any."""
    return definition.message.is_extended_frame and definition.message.frame_id & 0xFF not in (source, *_ANY)


def _sender(definition: Definition, source: int) -> str:
    """The message and its sender; the name of a message often names the control unit that it is described for."""
    if not definition.message.is_extended_frame:
        return f"{definition.name} (0x{definition.message.frame_id:X})"
    if _is_of_another_sender(definition, source):
        return f"PGN {definition.pgn} from 0x{source:02X} (as {definition.name})"
    return f"{definition.name} from 0x{source:02X}"


def _values(definition: Definition, frames: Frames) -> list[tuple[str, Column, Column, int]]:
    """Signals of one source: name, time, values in SI, and rank. Signals named in `[signals]` rank first."""
    message, direct = definition.message, []
    for field in definition.fields:
        if field.signal is not None:
            having = frames.where(np.all([_has(message, part, frames) for part in field.layouts], axis=0))
            if not len(having):  # its multiplexer never selects it
                continue
            direct.append((field.signal, having.time, _whole(field, having), -1))
    groups: dict[int, dict[int, Column]] = {}
    for field in definition.fields:
        if field.parameter is not None and field.group is not None:
            values = decode(field.layout, frames) * field.factor
            values[~_has(message, field.layout, frames)] = np.nan
            groups.setdefault(field.group.pgn, {})[field.parameter.spn] = values
    return direct + [
        (signal, frames.time, values, j1939.rank(signal, j1939.MESSAGES[pgn].name))
        for pgn, by_spn in groups.items()
        for signal, values in j1939.signals_of(j1939.MESSAGES[pgn], by_spn).items()
    ]


def _whole(field: Field, frames: Frames) -> Column:
    """A field's values in SI, from all its parts."""
    plus = None if field.plus is None else decode(field.plus[0], frames) * field.plus[1]
    sign = None if field.sign_by is None else decode(field.sign_by, frames)
    return combined(decode(field.layout, frames) * field.factor, plus, sign)


def _has(message: Message, layout: Signal, frames: Frames) -> npt.NDArray[np.bool_]:
    """Which frames contain a signal, by their multiplexers."""
    has = np.ones(len(frames), bool)
    for part, selector in pairwise([layout, *(_selectors(message, layout) or ())]):
        has &= np.isin(_raw(selector, frames), part.multiplexer_ids or [])
    return has


def decode(layout: Signal, frames: Frames) -> Column:
    """A database signal of many frames in its unit; NaN where the frame is too short or the value is invalid.

    Invalid are, in 29-bit messages, the values that J1939 reserves (top byte 0xFB and above), and values outside the
    range in the database.
    """
    raw = _raw(layout, frames)
    values = _number(raw, layout) * float(layout.scale) + float(layout.offset)
    values[frames.length.astype(np.int64) * 8 < _place(layout)[1]] = np.nan
    if layout.length in (8, 16, 32) and not layout.is_signed and not layout.is_float:
        reserved = raw >> np.uint64(layout.length - 8) > 0xFA
        values[reserved & frames.extended] = np.nan
    low, high = _float(layout.minimum), _float(layout.maximum)
    if layout.minimum is not None and layout.maximum is not None and high > low:
        slack = abs(float(layout.scale))
        values[(values < low - slack) | (values > high + slack)] = np.nan
    return values


def _raw(layout: Signal, frames: Frames) -> npt.NDArray[np.uint64]:
    words = frames.data if layout.byte_order == "little_endian" else frames.data.byteswap()
    shift, _ = _place(layout)
    return (words >> np.uint64(shift)) & np.uint64((1 << layout.length) - 1)


def _place(layout: Signal) -> tuple[int, int]:
    """The shift of a signal in its eight bytes read in its byte order, and the number of bits up to its end."""
    if layout.byte_order == "little_endian":
        return layout.start, layout.start + layout.length
    # Big-endian: the start is the most significant bit, counted 7..0 in byte 0, 15..8 in byte 1, ...
    first = 8 * (layout.start // 8) + 7 - layout.start % 8
    return 64 - first - layout.length, first + layout.length


def _number(raw: npt.NDArray[np.uint64], layout: Signal) -> Column:
    if layout.is_float:
        whole = raw.astype(f"<u{layout.length // 8}")
        with np.errstate(invalid="ignore"):  # from signalling NaNs
            numbers = whole.view(f"<f{layout.length // 8}").astype(np.float64)
        return np.where(np.isfinite(numbers), numbers, np.nan)
    if layout.is_signed:
        shift = np.uint64(64 - layout.length)
        return ((raw << shift).view(np.int64) >> np.int64(64 - layout.length)).astype(np.float64)
    return raw.astype(np.float64)
