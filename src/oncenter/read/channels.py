"""Signals of files with many channels at several rasters: of MDF, of MATLAB (variables), of ROS (fields of topics)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from oncenter.errors import OncenterError
from oncenter.nearest_name import did_you_mean, in_order_of_likeness
from oncenter.read.frames import Column
from oncenter.read.samples import Samples
from oncenter.read.units import factors, named_unit, unit_by_suffix, unit_key
from oncenter.signals import PURE_NUMBER, SIGNALS, SignalName

_LISTED_MAX = 12  # names in an error message
_NEEDED = ("steering_wheel_angle", "yaw_rate", "vehicle_speed", "lateral_acceleration")


class NoSamples(Exception):
    """A channel cannot be taken; the message says why, as "holds no numbers"."""


@dataclass(frozen=True)
class Channel:
    """One channel of a file.

    Attributes:
        name: as the file calls it within `label`.
        label: of the group, struct or topic that it is in; may be empty.
        content: its time in s, which channels of one raster share as one array, its values in its unit, NaN where not
            available, and that unit, empty where the file tells none. Raises `NoSamples`.
        called: what the file's own tools call it: "channel", "variable", "field".
        stamps: what the time is from, for people, where not from the channel itself.
    """

    name: str
    label: str
    content: Callable[[], tuple[Column, Column, str]]
    called: str = "channel"
    stamps: str = ""

    @property
    def full_name(self) -> str:
        return f"{self.label}.{self.name}" if self.label else self.name


def samples_of(channel: Channel, names: Mapping[str, SignalName], notes: list[str]) -> list[Samples]:
    """Of a channel that `[signals]` names, or that is called as our signals are; notes say what was left out.

    Raises:
        OncenterError: a channel that `[signals]` names has no unit, or none of its signal.
    """
    given = []
    for signal in SIGNALS:
        is_named, suffix = _match(channel, signal, names)
        if not is_named and suffix is None:
            continue
        try:
            time, values, written = channel.content()
        except NoSamples as why:
            notes.append(f"{signal}: {channel.called} {channel.name} {why}")
            continue
        known = factors(signal)
        if is_named:
            factor = names[signal].sign * known[named_unit(signal, names[signal], known, written)]
        else:
            unit = suffix or unit_key(written, known) or ("1" if SIGNALS[signal].quantity is PURE_NUMBER else None)
            if unit is None:
                would_do = " or ".join(known)
                notes.append(f"{signal}: {channel.called} {channel.name} has unit {written!r}, {would_do} would do")
                continue
            factor = known[unit]
        values = values * factor
        rank = 0 if is_named else 1
        name, label, called, stamps = channel.name, channel.label, channel.called, channel.stamps
        given.append(samples(name, label, signal, time, values, name, rank, called, stamps))
    return given


def samples(
    name: str,
    label: str,
    signal: str,
    time: Column,
    values: Column,
    kind: str,
    rank: int,
    called: str = "channel",
    stamps: str = "",
) -> Samples:
    """A channel's samples of one signal; `values` in SI."""
    description = f"{called} {name}" + (f" ({label})" if label else "")
    labels = (name.lower(), kind.lower(), label.lower())
    return Samples(signal, time, values, kind, description, rank, labels=labels, stamps=stamps)


def is_wanted(channel: Channel, names: Mapping[str, SignalName]) -> bool:
    """Whether it is a signal of ours by its name, before anything of it is read."""
    return any(_match(channel, signal, names) != (False, None) for signal in SIGNALS)


def _match(channel: Channel, signal: str, names: Mapping[str, SignalName]) -> tuple[bool, str | None]:
    """Whether `[signals]` names it, and the unit that its name ends with: "" where it is called as the signal alone,
    None where it is called otherwise."""
    entry = names.get(signal)
    is_named = entry is not None and entry.name in (channel.name, channel.full_name)
    suffix = unit_by_suffix(channel.name, factors(signal))
    if suffix is not None and channel.name == f"{signal}_{suffix}":
        return is_named, suffix
    return is_named, "" if channel.name == signal else None


def not_there(channels: Sequence[Channel], names: Mapping[str, SignalName], called: str) -> list[str]:
    """A note on each name of `[signals]` that no channel has."""
    known = dict.fromkeys(name for channel in channels for name in (channel.full_name, channel.name))
    full = [channel.full_name for channel in channels]
    return [
        f"{signal}: no {called} {entry.name!r}, which [signals] names{did_you_mean(entry.name, full)}"
        for signal, entry in names.items()
        if signal in SIGNALS and entry.name not in known
    ]


def nothing_known(
    path: Path, channels: Sequence[Channel], names: Mapping[str, SignalName], called: str, notes: Sequence[str]
) -> OncenterError:
    """The refusal of a file in which no signal was found; it lists channels, those first that are called most like the
    ones that are sought."""
    wanted = [entry.name for signal, entry in names.items() if signal in SIGNALS] or _NEEDED
    every = list(dict.fromkeys(channel.full_name for channel in channels))
    shown = ", ".join(repr(name[:80]) for name in in_order_of_likeness(every, wanted)[:_LISTED_MAX])
    more = f" and {len(every) - _LISTED_MAX} more" if len(every) > _LISTED_MAX else ""
    there = f"its {called}s are {shown}{more}" if every else f"it has no {called}s with numbers"
    return OncenterError(
        f"{'; '.join(['no known signal', *notes])} in {path.name}: {there}; name them in a [signals] table",
        code="missing_signal",
        needs=("steering_wheel_angle", "yaw_rate", "vehicle_speed"),
    )
