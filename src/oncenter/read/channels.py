"""Signals from files with many channels at several rates: MDF, MATLAB (variables), ROS (fields of topics)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from oncenter.errors import OncenterError
from oncenter.nearest_name import did_you_mean, in_order_of_likeness
from oncenter.read.frames import Column
from oncenter.read.parts import as_status, combined, missing_part, parts_of, true_numbers, unit_of_plus
from oncenter.read.samples import Samples
from oncenter.read.units import factors, named_unit, unit_by_suffix, unit_key
from oncenter.read.wording import ASSIGN_THEM
from oncenter.signals import PURE_NUMBER, SIGNALS, SignalName

_LISTED_MAX = 12  # names in an error message
_NEEDED = ("steering_wheel_angle", "yaw_rate", "vehicle_speed", "lateral_acceleration")


class NoSamples(Exception):
    """A channel cannot be used; the text gives the reason, as "contains no numbers"."""


class Content(NamedTuple):
    """
    Attributes:
        time: s, one shared array for channels of one rate.
        values: in the unit, NaN where not available.
        unit: empty if the file has none.
        lost: samples without a usable value, by reason, as in `Samples`.
    """

    time: Column
    values: Column
    unit: str
    lost: dict[str, int]


def without_zeros(counts: Mapping[str, int]) -> dict[str, int]:
    return {reason: count for reason, count in counts.items() if count}


@dataclass(frozen=True)
class Channel:
    """One channel of a file.

    Attributes:
        name: in the file, within `label`.
        label: name of the group, struct or topic that contains it; may be empty.
        content: gives its samples. Raises `NoSamples`.
        called: the format's word for it: "channel", "variable", "field".
        stamps: source of the time, for messages, if it is not the channel itself.
        alias: another name of it in the file.
    """

    name: str
    label: str
    content: Callable[[], Content]
    called: str = "channel"
    stamps: str = ""
    alias: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        return (self.name, self.full_name, *filter(None, (self.alias,)))

    def has_time(self, time: str | None) -> bool:
        """Whether its time is the variable of this name, or in the group of this name; any for None."""
        return time is None or time in (self.label, self.stamps.partition(" ")[2])

    @property
    def full_name(self) -> str:
        return f"{self.label}.{self.name}" if self.label else self.name


def with_parts(path: Path, channels: Sequence[Channel], names: Mapping[str, SignalName]) -> list[Channel]:
    """The channels; one whose `[signals]` entry has further parts gives the whole signal.

    Raises:
        OncenterError: "missing_part": the file does not have one of them; "unknown_unit".
    """
    entries = {entry.name: (signal, entry) for signal, entry in names.items() if signal in SIGNALS and parts_of(entry)}
    if not entries:
        return list(channels)
    whole = []
    for channel in channels:
        found = next((entries[name] for name in channel.names[::-1] if name in entries), None)
        if found is None:
            whole.append(channel)
            continue
        signal, entry = found
        parts = {key: _part(path, channels, channel, signal, key, name) for key, name in parts_of(entry).items()}
        whole.append(replace(channel, content=partial(_whole, channel, parts, signal, entry)))
    return whole


def _part(path: Path, channels: Sequence[Channel], main: Channel, signal: str, key: str, name: str) -> Channel:
    """The channel of a part, from the group of the main one if that has it."""
    having = [each for each in channels if name in each.names]
    if not having:
        raise missing_part(signal, key, name, path.name, (each.full_name for each in channels))
    return next((each for each in having if each.label == main.label), having[0])


def _whole(main: Channel, parts: Mapping[str, Channel], signal: str, entry: SignalName) -> Content:
    """Content of a channel with its other parts, in the unit of the main one."""
    time, values, written, lost = main.content()
    given: dict[str, Column] = {}
    for key, part in parts.items():
        its_time, its_values, its_unit, _ = part.content()
        if its_time is not time and not np.array_equal(its_time, time):
            raise NoSamples(f"has other times than {key} = {part.full_name}")
        given[key] = its_values
        if key == "plus":
            known = factors(signal)
            unit = named_unit(signal, entry, known, written)
            own = unit_of_plus(signal, entry, unit, its_unit, written, known)
            given[key] = its_values * (known[own] / known[unit])
    return Content(time, combined(values, given.get("plus"), given.get("sign_by")), written, lost)


def samples_of(channel: Channel, names: Mapping[str, SignalName], notes: list[str]) -> list[Samples]:
    """Samples of a channel named in `[signals]`, or with the name of a signal. `notes` receives what was left out.

    Raises:
        OncenterError: a channel named in `[signals]` has no unit, or a unit that does not fit the signal.
    """
    given = []
    for signal in SIGNALS:
        is_named, suffix = _match(channel, signal, names)
        if not is_named and suffix is None:
            continue
        try:
            time, values, written, lost = channel.content()
        except NoSamples as why:
            notes.append(f"{signal}: {channel.called} {channel.name} {why}")
            continue
        known = factors(signal)
        if is_named:
            factor = names[signal].factor * known[named_unit(signal, names[signal], known, written)]
        else:
            unit = suffix or unit_key(written, known) or ("1" if SIGNALS[signal].quantity is PURE_NUMBER else None)
            if unit is None:
                possible = " or ".join(known)
                notes.append(
                    f"{signal}: {channel.called} {channel.name} left out: it has unit {written!r}, expected {possible}"
                )
                continue
            factor = known[unit]
        entry = names[signal] if is_named else None
        stated = as_status(signal, values * factor, true_numbers(signal, entry, {}, f"{channel.called} {channel.name}"))
        codes = int(np.count_nonzero(np.isnan(stated) & ~np.isnan(values)))
        values, lost = stated, {**lost, "not_available": lost.get("not_available", 0) + codes} if codes else lost
        rank = 0 if is_named else 1
        name, label, called, stamps = channel.name, channel.label, channel.called, channel.stamps
        given.append(samples(name, label, signal, time, values, name, rank, lost, called, stamps))
    return given


def samples(
    name: str,
    label: str,
    signal: str,
    time: Column,
    values: Column,
    kind: str,
    rank: int,
    lost: Mapping[str, int],
    called: str = "channel",
    stamps: str = "",
) -> Samples:
    """A channel's samples of one signal; `values` in SI."""
    description = f"{called} {name}" + (f" ({label})" if label else "")
    labels = (name.lower(), kind.lower(), label.lower())
    return Samples(signal, time, values, kind, description, rank, labels=labels, stamps=stamps, lost=lost)


def is_wanted(channel: Channel, names: Mapping[str, SignalName]) -> bool:
    """Whether its name is that of a signal, before any of its data are read."""
    return any(_match(channel, signal, names) != (False, None) for signal in SIGNALS)


def _match(channel: Channel, signal: str, names: Mapping[str, SignalName]) -> tuple[bool, str | None]:
    """Whether `[signals]` names it, and the unit at the end of its name: "" if the name is the signal's alone, None for
    any other name."""
    entry = names.get(signal)
    is_named = entry is not None and entry.name in channel.names and channel.has_time(entry.time)
    suffix = unit_by_suffix(channel.name, factors(signal))
    if suffix is not None and channel.name == f"{signal}_{suffix}":
        return is_named, suffix
    return is_named, "" if channel.name == signal else None


def not_there(channels: Sequence[Channel], names: Mapping[str, SignalName], called: str) -> list[str]:
    """A note for each name in `[signals]` that no channel has."""
    known = dict.fromkeys(name for channel in channels for name in channel.names)
    full = [channel.full_name for channel in channels]
    return [
        f"{signal}: [signals] names {called} {entry.name!r}, which does not exist{did_you_mean(entry.name, full)}"
        for signal, entry in names.items()
        if signal in SIGNALS and entry.name not in known
    ]


def no_signal_recognised(
    path: Path, channels: Sequence[Channel], names: Mapping[str, SignalName], called: str, notes: Sequence[str]
) -> OncenterError:
    """The error for a file without a recognised signal. It lists the channels, the most similar names first."""
    wanted = [entry.name for signal, entry in names.items() if signal in SIGNALS] or _NEEDED
    every = list(dict.fromkeys(channel.full_name for channel in channels))
    shown = ", ".join(repr(name[:80]) for name in in_order_of_likeness(every, wanted)[:_LISTED_MAX])
    more = f" and {len(every) - _LISTED_MAX} more" if len(every) > _LISTED_MAX else ""
    there = f"its {called}s are {shown}{more}; {ASSIGN_THEM}" if every else f"it has no {called}s with numbers"
    return OncenterError(
        "; ".join([f"no signal recognised in {path.name}", *notes, there]),
        code="missing_signal",
        needs=("steering_wheel_angle", "yaw_rate", "vehicle_speed"),
    )
