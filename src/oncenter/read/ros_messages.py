"""Decodes numbers in serialized ROS messages by the definitions stored in a bag.

The library that opens bags decodes messages with code that it generates and runs. Here a definition becomes a list of
steps that read bytes, so that nothing from a bag is run as code.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

_EACH_MAX = 16  # arrays up to this length have one field per element
_DEPTH_MAX, _STEPS_MAX = 32, 20_000  # of nested types
_FORMATS = {
    **{"bool": "B", "byte": "B", "char": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H"},
    **{"int32": "i", "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d"},
}
_TIME, _DURATION, _HEADER = "builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration", "std_msgs/msg/Header"
_NO_SIGNALS = (_TIME, _DURATION, _HEADER)
_INDEX = re.compile(r"\[(\d{1,6})\]$")

# Units in the documentation of ROS's standard messages; for other messages [signals] gives the unit.
_UNITS = {
    ("sensor_msgs/msg/Imu", "angular_velocity"): "rad/s",
    ("sensor_msgs/msg/Imu", "linear_acceleration"): "m/s2",
    ("sensor_msgs/msg/NavSatFix", "latitude"): "deg",
    ("sensor_msgs/msg/NavSatFix", "longitude"): "deg",
    ("geometry_msgs/msg/Twist", "linear"): "m/s",
    ("geometry_msgs/msg/Twist", "angular"): "rad/s",
    ("geometry_msgs/msg/Accel", "linear"): "m/s2",
}

Types = Mapping[str, tuple[Any, Sequence[tuple[str, Any]]]]  # by name: constants, and fields with their descriptions


class NotDecoded(Exception):
    """A definition or a message cannot be decoded; the text gives the reason."""


@dataclass(frozen=True)
class Field:
    """A number in a message; `unit` is empty if unknown."""

    path: str
    unit: str


class Layout:
    """A message type.

    Args:
        name: of the type, as `sensor_msgs/msg/Imu`.
        types: all definitions.
        aligned: True for ROS 2's serialization (CDR); ROS 1 does not align.

    Attributes:
        fields: its numbers; for a sequence only the first.
        stamp: path of the time of measurement; empty without one.

    Raises:
        NotDecoded: a definition is missing, or is not supported.
    """

    def __init__(self, name: str, types: Types, aligned: bool) -> None:
        self._name, self._types, self._aligned = name, types, aligned
        compiler = _Compiler(types, aligned, "<", {})
        compiler.of_type(name, "", "")
        self.fields = compiler.fields
        own = {field: description[1] for field, description in types[name][1]}
        headers = [f"{field}.stamp" for field, kind in own.items() if kind == _HEADER]
        self.stamp = next(iter(headers), "stamp" if own.get("stamp") == _TIME else "")

    def has(self, path: str) -> bool:
        """Whether the path is that of a number; elements of sequences may have any index."""
        first = _INDEX.sub("[0]", path)
        return any(path == field.path or first == field.path for field in self.fields)

    def planner(self, paths: Sequence[str]) -> Callable[[bytes], Plan]:
        """A function that finds the numbers at these paths in a message.

        It raises `NotDecoded` for a message that is shorter than its definition, or serialized in another way.
        """
        slots = {path: place for place, path in enumerate(paths)}
        steps = {order: _Compiler(self._types, self._aligned, order, slots).up_to_last(self._name) for order in "<>"}

        def plan_of(message: bytes) -> Plan:
            plan = Plan(len(message), 4 if self._aligned else 0)
            data, order, place = memoryview(message)[plan.head :], "<", 0
            if self._aligned:
                if len(message) < 4 or message[0] != 0 or message[1] > 1:
                    raise NotDecoded("is not serialized as plain CDR")
                order = "<" if message[1] else ">"
                plan.lengths.append((0, "<H", message[0] + 256 * message[1]))
            try:
                for step in steps[order]:
                    place = step.read(data, place, plan)
            except (struct.error, OverflowError):
                raise NotDecoded("is shorter than its definition") from None
            return plan

        return plan_of

    def decoder(self, paths: Sequence[str]) -> Callable[[bytes], list[float]]:
        """A function that decodes one message to the numbers at these paths, as `planner`."""
        plan_of = self.planner(paths)
        return lambda message: plan_of(message).row(message, len(paths))


@dataclass
class Plan:
    """Where the numbers of a message are; also of each other message of the same size with the same lengths.

    Attributes:
        size: of the message.
        head: bytes before the first field.
        lengths: of texts and sequences, and what gives the order of bytes: place, format and value.
        numbers: place in the row, `struct` format and place in the message; none where a sequence is too short.
    """

    size: int
    head: int
    lengths: list[tuple[int, str, int]] = field(default_factory=list)
    numbers: list[tuple[int, str, int]] = field(default_factory=list)

    def length(self, data: memoryview, form: str, place: int) -> int:
        """Reads a length."""
        (value,) = struct.unpack_from(form, data, place)
        self.lengths.append((self.head + place, form, value))
        return int(value)

    def number(self, data: memoryview, slot: int, form: str, place: int) -> None:
        if place + struct.calcsize(form) > len(data):
            raise struct.error
        self.numbers.append((slot, form, self.head + place))

    def row(self, message: bytes, count: int) -> list[float]:
        """The numbers, NaN where a sequence is too short."""
        row = [math.nan] * count
        for slot, form, place in self.numbers:
            row[slot] = float(struct.unpack_from(form, message, place)[0])
        return row


class _Step:
    """Reads a part of a message.

    Attributes:
        keeps: whether it finds a number for the row.
    """

    keeps = False

    def read(self, data: memoryview, place: int, plan: Plan) -> int:
        """Reads at `place` and adds to the plan; returns the place after it.

        Raises:
            struct.error: the message ends within it.
        """
        raise NotImplementedError


class _Number(_Step):
    def __init__(self, form: str, aligned: bool, slot: int | None) -> None:
        self._form, self._size, self._slot, self.keeps = form, struct.calcsize(form), slot, slot is not None
        self._align = self._size if aligned else 1

    def read(self, data: memoryview, place: int, plan: Plan) -> int:
        place += -place % self._align
        if self._slot is not None:
            plan.number(data, self._slot, self._form, place)
        return place + self._size


class _Skipped(_Step):
    def __init__(self, align: int, size: int) -> None:
        self._align, self._size = align, size

    def read(self, data: memoryview, place: int, plan: Plan) -> int:
        return place + -place % self._align + self._size


class _Text(_Step):
    def __init__(self, order: str, aligned: bool) -> None:
        self._length, self._align = f"{order}I", 4 if aligned else 1

    def read(self, data: memoryview, place: int, plan: Plan) -> int:
        place += -place % self._align
        return place + 4 + plan.length(data, self._length, place)


class _Numbers(_Step):
    """A sequence of numbers; `slots` maps the indices to keep to places in the row."""

    def __init__(self, form: str, aligned: bool, slots: Mapping[int, int]) -> None:
        self._length, self._form, self._size = f"{form[0]}I", form, struct.calcsize(form)
        self._aligned, self._slots, self.keeps = aligned, slots, bool(slots)

    def read(self, data: memoryview, place: int, plan: Plan) -> int:
        place += -place % 4 if self._aligned else 0
        count = plan.length(data, self._length, place)
        place += 4
        if count and self._aligned:
            place += -place % self._size
        for index, slot in self._slots.items():
            if index < count:
                plan.number(data, slot, self._form, place + index * self._size)
        return place + count * self._size


class _Repeated(_Step):
    """An array (or a sequence if `count` is None) of elements without a fixed size."""

    def __init__(self, steps: Sequence[_Step], count: int | None, order: str, aligned: bool) -> None:
        self._steps, self._count = steps, count
        self._length, self._align = f"{order}I", 4 if aligned else 1

    def read(self, data: memoryview, place: int, plan: Plan) -> int:
        count = self._count
        if count is None:
            place += -place % self._align
            count = plan.length(data, self._length, place)
            place += 4
        for _ in range(count):
            before = place
            for step in self._steps:
                place = step.read(data, place, plan)
            if place > len(data):
                raise struct.error
            if place == before:  # empty elements
                break
        return place


class _Compiler:
    """Compiles definitions to steps. A path of None means that the number is not addressable.

    Attributes:
        fields: the numbers found.
    """

    def __init__(self, types: Types, aligned: bool, order: str, slots: Mapping[str, int]) -> None:
        self._types, self._aligned, self._order, self._slots = types, aligned, order, slots
        self.fields: list[Field] = []
        self._depth = self._steps = 0

    def up_to_last(self, name: str) -> list[_Step]:
        """The steps up to the last one that keeps a value."""
        steps = self.of_type(name, "", "")
        return steps[: max((place + 1 for place, step in enumerate(steps) if step.keeps), default=0)]

    def of_type(self, name: str, path: str | None, unit: str) -> list[_Step]:
        if name not in self._types:
            raise NotDecoded(f"has no definition of {name}")
        self._depth += 1
        if self._depth > _DEPTH_MAX:
            raise NotDecoded(f"has types nested deeper than {_DEPTH_MAX} levels")
        steps: list[_Step] = []
        for inner, description in self._types[name][1]:
            within = None if path is None or inner.endswith("covariance") else f"{path}.{inner}" if path else inner
            steps += self._of_field(description, within, _UNITS.get((name, inner), unit))
            if len(steps) + self._steps > _STEPS_MAX:
                raise NotDecoded("has too many fields")
        self._depth -= 1
        self._steps += len(steps)
        return steps or ([_Skipped(1, 1)] if self._aligned else [])

    def _of_field(self, description: Any, path: str | None, unit: str) -> list[_Step]:
        kind, detail = description[0].name, description[1]
        if kind == "BASE":
            return [self._of_base(detail[0], path, unit)]
        if kind == "NAME":
            return self._of_named(detail, path, unit)
        inner, count = detail
        form = self._form(inner)
        if kind == "SEQUENCE" and form:
            return [self._of_sequence(form, path, unit)]
        if kind == "SEQUENCE":
            return [_Repeated(self._of_field(inner, None, ""), None, self._order, self._aligned)]
        if count < 0:
            raise NotDecoded("has an array of negative length")
        if count <= _EACH_MAX:
            each = (self._of_field(inner, None if path is None else f"{path}[{k}]", unit) for k in range(count))
            return [step for steps in each for step in steps]
        if form:
            size = struct.calcsize(form)
            return [_Skipped(size if self._aligned else 1, size * count)]
        return [_Repeated(self._of_field(inner, None, ""), count, self._order, self._aligned)]

    def _of_named(self, name: str, path: str | None, unit: str) -> list[_Step]:
        before = len(self.fields)
        steps = self.of_type(name, path, unit)
        if name in _NO_SIGNALS:
            del self.fields[before:]
        return steps

    def _form(self, description: Any) -> str:
        """The `struct` format of a number; empty for other types."""
        is_base = description[0].name == "BASE"
        return self._order + _FORMATS[description[1][0]] if is_base and description[1][0] in _FORMATS else ""

    def _of_base(self, kind: str, path: str | None, unit: str) -> _Step:
        if kind == "string":
            return _Text(self._order, self._aligned)
        if kind not in _FORMATS:
            raise NotDecoded(f"has fields of type {kind}, which is not supported")
        if path is not None:
            self.fields.append(Field(path, unit))
        return _Number(self._order + _FORMATS[kind], self._aligned, self._slots.get(path or ""))

    def _of_sequence(self, form: str, path: str | None, unit: str) -> _Step:
        if path is None:
            return _Numbers(form, self._aligned, {})
        self.fields.append(Field(f"{path}[0]", unit))
        found = ((_INDEX.search(wanted), wanted, slot) for wanted, slot in self._slots.items())
        slots = {int(index[1]): slot for index, wanted, slot in found if index and _INDEX.sub("", wanted) == path}
        return _Numbers(form, self._aligned, slots)
