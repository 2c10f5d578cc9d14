"""Signals by a database (DBC, KCD, SYM, ARXML): its layouts decode whole columns of frames."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from oncenter.files.file_name import printable
from oncenter.nearest_name import did_you_mean, in_order_of_likeness
from oncenter.read import j1939
from oncenter.read.database_file import Database, bad_database, not_read_note, read_database
from oncenter.read.database_parts import NotRead
from oncenter.read.frames import BYTES_MAX, Column, Frames, Kept, bus_name, pgn_of
from oncenter.read.parts import as_status, combined, missing_part, parts_of, true_numbers, unit_of_plus
from oncenter.read.samples import Beyond, Samples
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
    true_when: tuple[float, ...] | None = None

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
        OncenterError: a file is not a database, or a signal named in `[signals]` has no unit or cannot be read;
            "missing_extra": cantools is not installed.
    """
    found: list[Definition] = []
    there: dict[str, str] = {}  # "Message.Signal": "Signal"
    not_read: dict[str, tuple[Path, NotRead]] = {}  # by the names of its signals
    for path in paths:
        before = len(found)
        database = _database(Path(path))
        messages = database.messages
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
        if database.not_read:
            notes.append(f"{Path(path).name}: left out, as it cannot be read: {not_read_note(database.not_read)}")
        not_read |= {name: (Path(path), each) for each in database.not_read for name in _names_inside(each)}
    _refuse_not_read(not_read, {*there, *there.values()}, names)
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
        (
            *(part.name, part.start, part.length, part.byte_order, part.is_signed, part.scale, part.offset),
            *(field.signal, field.true_when),
        )
        for field in definition.fields
        for part in field.layouts
    ]
    return message.frame_id, message.is_extended_frame, definition.name, *layouts


def _names_inside(part: NotRead) -> Iterator[str]:
    for name in part.inside:
        yield from (name, name.rpartition(".")[2])


def _refuse_not_read(
    not_read: Mapping[str, tuple[Path, NotRead]], known: Collection[str], names: Mapping[str, SignalName]
) -> None:
    """
    Raises:
        OncenterError: "bad_dbc", exit code 2: `[signals]` names a signal whose definition cannot be read.
    """
    for signal, entry in names.items():
        if signal in SIGNALS and entry.name in not_read and entry.name not in known:
            path, part = not_read[entry.name]
            raise bad_database(
                f"the database {path.name} describes {entry.name}, which [signals] names for {signal}, in a way that "
                f"cannot be read: {not_read_note([part])}"
            )


def _database(path: Path) -> Database:
    """Parsed once while the file does not change: a fleet's child process reads many logs with it."""
    try:
        status = os.stat(path)
    except (OSError, ValueError):  # read_database reports the error
        return read_database(path)
    return _parsed(path, (status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns))


@lru_cache(maxsize=4)
def _parsed(path: Path, state: tuple[int, ...]) -> Database:
    return read_database(path)


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
        why = _impossible(message, part, _selectors(message, part))
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
        plus = part, entry.factor * known[own]
    sign_by = None if entry.sign_by is None else by_name[entry.sign_by]
    of_names = {str(name): code * _float(layout.scale) + _float(layout.offset) for code, name in _choices(layout)}
    true = true_numbers(signal, entry, of_names, f"{message.name}.{layout.name} in the database")
    is_true = None if true is None else tuple(true)
    for value in is_true or ():
        if not _has_value(layout, value):
            raise bad_database(
                f"[signals] {signal}: true_when = {value:g} is no value that {message.name}.{layout.name} can have: it "
                f"has {layout.length} bits, scale {_float(layout.scale):g} and offset {_float(layout.offset):g}"
            )
    return Field(layout, entry.factor * known[unit], signal, plus=plus, sign_by=sign_by, true_when=is_true)


def _has_value(layout: Signal, value: float) -> bool:
    """Whether a whole number of the signal's bits gives this value."""
    if layout.is_float:
        return True
    code = (value - _float(layout.offset)) / _float(layout.scale)
    low = -(2 ** (layout.length - 1)) if layout.is_signed else 0
    return abs(code - round(code)) < 1e-3 and low <= round(code) < low + 2**layout.length


def _choices(layout: Signal) -> list[tuple[int, object]]:
    return list((layout.choices or {}).items())


def _impossible(message: Message, layout: Signal, selectors: Sequence[Signal] | None) -> str | None:
    """Why a signal, or a multiplexer that selects it, cannot be in a frame of its message; None if it can."""
    if selectors is None:
        return "refers to a multiplexer that its message does not have"
    for part in (layout, *selectors):
        if not 1 <= part.length <= 64:
            return f"has {part.length} bits"
        if part.start < 0:
            return f"begins at bit {part.start}"
        place = _place(part)
        if place.end > 8 * (message.length if 8 < message.length <= BYTES_MAX else 8):
            return "ends after the eighth byte" if message.length <= 8 else "ends after the last byte"
        if place.shift < 0:
            return "lies in nine bytes"
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
    given: list[Samples] = []
    for definition in found:
        given += _samples_of(definition, kept.frames.where(matching(definition, kept.frames, found)))
    return given


def matching(definition: Definition, frames: Frames, found: Sequence[Definition]) -> npt.NDArray[np.bool_]:
    """Which frames are of the message. Of several messages of one parameter group, a frame belongs to the one of its
    source address, else to the one for any source address."""
    its_identifier: npt.NDArray[np.bool_] = frames.identifier == definition.message.frame_id
    if definition.pgn is None:
        return ~frames.extended & its_identifier
    of_group: npt.NDArray[np.bool_] = frames.extended & (pgn_of(frames.identifier) == definition.pgn)
    addresses = [_address(other) for other in found if other.pgn == definition.pgn]
    if len(addresses) == 1:
        return of_group
    own = _address(definition)
    if addresses.count(own) > 1:  # they differ in the priority
        return of_group & its_identifier
    address = frames.identifier & np.uint32(0xFF)
    of_others = [other for other in addresses if other not in (own, *_ANY)]
    return of_group & (~np.isin(address, of_others) if own in _ANY else address == own)


def _address(definition: Definition) -> int:
    return int(definition.message.frame_id) & 0xFF


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
        has_rival = definition.pgn in _PROPRIETARY or _address(definition) in address
        farther = int(_is_of_another_sender(definition, source) and has_rival)
        given += [
            Samples(
                each.signal,
                each.time,
                each.values,
                definition.name,
                description,
                each.rank + farther,
                source if message.is_extended_frame else None,
                labels,
                of_frames=True,
                lost=each.lost,
                in_file=len(on_bus),
                beyond=each.beyond,
                place=each.place,
            )
            for each in _values(definition, on_bus)
        ]
    return given


def _is_of_another_sender(definition: Definition, source: int) -> bool:
    """Whether the database describes the message for another source address, and not for any."""
    return definition.message.is_extended_frame and _address(definition) not in (source, *_ANY)


def _sender(definition: Definition, source: int) -> str:
    """The message and its sender; the name of a message often names the control unit that it is described for."""
    if not definition.message.is_extended_frame:
        return f"{definition.name} (0x{definition.message.frame_id:X})"
    if _is_of_another_sender(definition, source):
        return f"PGN {definition.pgn} from 0x{source:02X} (as {definition.name})"
    return f"{definition.name} from 0x{source:02X}"


class _Values(NamedTuple):
    """A signal of one source, in SI."""

    signal: str
    time: Column
    values: Column
    rank: int
    lost: dict[str, int]
    beyond: Beyond | None
    place: str


def _values(definition: Definition, frames: Frames) -> list[_Values]:
    """Signals of one source. Signals named in `[signals]` rank first."""
    message, direct = definition.message, []
    groups: dict[int, dict[int, Decoded]] = {}
    for field in definition.fields:
        having = np.all([_has(message, part, frames) for part in field.layouts], axis=0)
        if field.signal is not None and having.any():  # else its multiplexer never selects it
            direct.append(_direct(definition, field, frames.where(having), len(frames)))
        if field.parameter is not None and field.group is not None:
            found = decoded(field.layout, frames)
            possible = _is_possible(found.values * field.factor, field.parameter)
            found.why[~possible & (found.why == 0)] = _RESERVED
            found.values[~having | ~possible] = np.nan
            found.why[~having] = _REASONS.index("other_multiplexer_page")
            found = found._replace(values=found.values * field.factor, beyond=found.beyond & having)
            groups.setdefault(field.group.pgn, {})[field.parameter.spn] = found
    of_groups = (_of_group(definition, j1939.MESSAGES[pgn], by_spn, frames) for pgn, by_spn in groups.items())
    return [*direct, *(each for group in of_groups for each in group)]


def _is_possible(values: Column, parameter: j1939.Parameter) -> npt.NDArray[np.bool_]:
    """Which values a truck can have, in the parameter's unit; all where J1939 does not restrict them."""
    if parameter.numbers is None:
        return np.ones(len(values), bool)
    low, high = (number * parameter.scale + parameter.offset for number in parameter.numbers)
    return np.isnan(values) | ((values >= low) & (values <= high))


def _direct(definition: Definition, field: Field, frames: Frames, in_file: int) -> _Values:
    assert field.signal is not None
    found, lost = _whole(field, frames), {}
    values = as_status(field.signal, found.values, field.true_when)
    found.why[np.isnan(values) & (found.why == 0)] = _NOT_AVAILABLE
    found = found._replace(values=values, beyond=found.beyond & ~np.isnan(values))
    if len(frames) < in_file:
        lost["other_multiplexer_page"] = in_file - len(frames)
    beyond = _beyond(definition.message, field.layout, found.beyond)
    place = _place_of(definition, field.layouts)
    return _Values(field.signal, frames.time, found.values, -1, lost | _counts(found.why), beyond, place)


def _place_of(definition: Definition, layouts: Sequence[Signal]) -> str:
    """Signals and bits, as the database's file writes them, and the file."""
    bits = [
        f"{layout.start}|{layout.length}@{int(layout.byte_order == 'little_endian')}{'-' if layout.is_signed else '+'}"
        for layout in layouts
    ]
    named = [f"{definition.message.name}.{layout.name} {of}" for layout, of in zip(layouts, bits, strict=True)]
    return f"{', '.join(named)} of {Path(definition.file).name}"


def _of_group(
    definition: Definition, group: j1939.Message, by_spn: Mapping[int, Decoded], frames: Frames
) -> list[_Values]:
    """The signals of J1939 parameters, some of which need several."""
    layouts = {field.parameter.spn: field.layout for field in definition.fields if field.parameter is not None}
    given = []
    for signal, values in j1939.signals_of(group, {spn: each.values for spn, each in by_spn.items()}).items():
        parts = [parameter.spn for parameter in j1939.parts_of(group, signal)]
        why = by_spn[parts[0]].why
        for spn in parts[1:]:
            why = np.where(why == 0, by_spn[spn].why, why)
        why = np.where(np.isnan(values), why, 0)
        rows = np.logical_or.reduce([by_spn[spn].beyond for spn in parts])
        beyond = _beyond(definition.message, layouts[parts[-1]], rows)
        rank = j1939.rank(signal, group.name)
        place = _place_of(definition, [layouts[spn] for spn in parts])
        given.append(_Values(signal, frames.time, values, rank, _counts(why), beyond, place))
    return given


def _counts(why: npt.NDArray[np.uint8]) -> dict[str, int]:
    counts = np.bincount(why, minlength=len(_REASONS)).tolist()
    return {reason: count for reason, count in zip(_REASONS[1:], counts[1:], strict=True) if count}


def _beyond(message: Message, layout: Signal, rows: npt.NDArray[np.bool_]) -> Beyond | None:
    if not rows.any():
        return None
    name, unit = printable(f"{message.name}.{layout.name}"), printable(layout.unit or "")
    return Beyond(rows, name, _float(layout.minimum), _float(layout.maximum), unit)


def _whole(field: Field, frames: Frames) -> Decoded:
    """A field's values in SI, from all its parts; the reason of the first part without a value."""
    found = decoded(field.layout, frames)
    plus = None if field.plus is None else decoded(field.plus[0], frames)
    sign = None if field.sign_by is None else decoded(field.sign_by, frames)
    why = found.why
    for part in (plus, sign):
        why = why if part is None else np.where(why == 0, part.why, why)
    of_plus = None if plus is None or field.plus is None else plus.values * field.plus[1]
    values = combined(found.values * field.factor, of_plus, None if sign is None else sign.values)
    return found._replace(values=values, why=why)


def _has(message: Message, layout: Signal, frames: Frames) -> npt.NDArray[np.bool_]:
    """Which frames contain a signal, by their multiplexers."""
    has = np.ones(len(frames), bool)
    for part, selector in pairwise([layout, *(_selectors(message, layout) or ())]):
        has &= np.isin(_raw(selector, frames), part.multiplexer_ids or [])
    return has


_REASONS = (
    "",
    "not_available",
    "error_code",
    "reserved_code",
    "frame_too_short",
    "other_multiplexer_page",
)
_NOT_AVAILABLE, _ERROR, _RESERVED, _TOO_SHORT = 1, 2, 3, 4
_NAMED_CODES = re.compile(r"(?<!\bno )\b(sna|n/?a|not[ _]?available|invalid|error|fault|undefined)\b", re.IGNORECASE)
_CODES_FROM_BITS = 6  # shorter signals have hardly room for a code


class Decoded(NamedTuple):
    """Values in the unit of the database, NaN for none; `why` is then a place in `_REASONS`, else 0; `beyond`: outside
    the range of the database, and no code."""

    values: Column
    why: npt.NDArray[np.uint8]
    beyond: npt.NDArray[np.bool_]


def decode(layout: Signal, frames: Frames) -> Column:
    """The values of `decoded`."""
    return decoded(layout, frames).values


def decoded(layout: Signal, frames: Frames) -> Decoded:
    """A database signal of many frames.

    No number is a code that J1939 reserves in 29-bit messages (top byte 0xFB and above), a code that the database names
    as invalid, and, outside the range of the database, a code at the end of the bits: all ones, one less, or all zeros.
    A range is often a placeholder, so it alone makes no value invalid.
    """
    raw = _raw(layout, frames)
    values = _number(raw, layout) * float(layout.scale) + float(layout.offset)
    beyond = _outside(layout, values)
    why = np.zeros(len(values), np.uint8)
    why[np.isnan(values)] = _NOT_AVAILABLE
    if beyond.any():
        why[beyond & np.isin(raw, _codes_at_ends(layout, _ERROR))] = _ERROR
        why[beyond & np.isin(raw, _codes_at_ends(layout, _NOT_AVAILABLE))] = _NOT_AVAILABLE
    if layout.choices:
        mask = (1 << layout.length) - 1
        named = [int(code) & mask for code, name in layout.choices.items() if _NAMED_CODES.search(_words_of(name))]
        why[np.isin(raw, np.array(named, np.uint64))] = _ERROR
    if layout.length in (8, 16, 32) and not layout.is_signed and not layout.is_float:
        top = raw >> np.uint64(layout.length - 8)
        for least, most, reason in ((0xFB, 0xFD, _RESERVED), (0xFE, 0xFE, _ERROR), (0xFF, 0xFF, _NOT_AVAILABLE)):
            why[(top >= least) & (top <= most) & frames.extended] = reason
    why[frames.length.astype(np.int64) * 8 < _place(layout).end] = _TOO_SHORT
    values[why != 0] = np.nan
    return Decoded(values, why, beyond & (why == 0))


def _words_of(name: object) -> str:
    """A value's name with words apart: `Signal_Not_Available`, `SNA`."""
    return str(name).replace("_", " ")


def _outside(layout: Signal, values: Column) -> npt.NDArray[np.bool_]:
    low, high = _float(layout.minimum), _float(layout.maximum)
    if layout.minimum is None or layout.maximum is None or not high > low:
        return np.zeros(len(values), bool)
    slack = abs(float(layout.scale))
    return (values < low - slack) | (values > high + slack)


def _codes_at_ends(layout: Signal, reason: int) -> npt.NDArray[np.uint64]:
    """Raw values at the ends of the bits. All zeros are a code only where they do not mean zero."""
    if layout.is_float or layout.length < _CODES_FROM_BITS:
        return np.empty(0, np.uint64)
    ones = (1 << layout.length) - 1
    if layout.is_signed:
        highest, lowest = ones >> 1, (ones >> 1) + 1
        codes = [highest, lowest] if reason == _NOT_AVAILABLE else [highest - 1, lowest + 1]
    else:
        codes = [ones] if reason == _NOT_AVAILABLE else [ones - 1, *([0] if layout.offset else [])]
    return np.array(codes, np.uint64)


def _raw(layout: Signal, frames: Frames) -> npt.NDArray[np.uint64]:
    place = _place(layout)
    words = frames.data if not place.byte else _eight_bytes(frames, place.byte)
    words = words if layout.byte_order == "little_endian" else words.byteswap()
    return (words >> np.uint64(place.shift)) & np.uint64((1 << layout.length) - 1)


def _eight_bytes(frames: Frames, first: int) -> npt.NDArray[np.uint64]:
    """Eight bytes of each frame from this one on."""
    octets = np.ascontiguousarray(frames.after_eight()).view(np.uint8).reshape(-1, BYTES_MAX - 8)
    every = np.hstack((np.ascontiguousarray(frames.data).view(np.uint8).reshape(-1, 8), octets))
    return np.ascontiguousarray(every[:, first : first + 8]).view("<u8")[:, 0]


class _Place(NamedTuple):
    """Of a signal: the first of eight bytes around it, its shift in these in its byte order (negative if they are too
    few), and the number of the frame's bits up to its end."""

    byte: int
    shift: int
    end: int


def _place(layout: Signal) -> _Place:
    # Big-endian: the start is the most significant bit, counted 7..0 in byte 0, 15..8 in byte 1, ...
    little = layout.byte_order == "little_endian"
    first = layout.start if little else 8 * (layout.start // 8) + 7 - layout.start % 8
    end = first + layout.length
    byte = 0 if end <= 64 else min(first // 8, BYTES_MAX - 8)
    behind = 64 + 8 * byte - end  # bits
    return _Place(byte, first - 8 * byte if little and behind >= 0 else behind, end)


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
