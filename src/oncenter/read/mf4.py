"""ASAM MDF 3 and 4 through asammdf: raw CAN frames of bus logging, and decoded channels at their own rasters."""

from __future__ import annotations

import contextlib
import gc
import io
import logging
import sys
import threading
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from oncenter.errors import OncenterError
from oncenter.read import j1939
from oncenter.read.frames import Column, Frames, Kept, Wanted, bus_code, keep
from oncenter.read.samples import Samples
from oncenter.read.units import factors, named_unit, unit_by_suffix, unit_key
from oncenter.signals import PURE_NUMBER, SIGNALS, SignalName

if TYPE_CHECKING:
    from asammdf import MDF

FRAME_CHANNEL = "CAN_DataFrame"
_ALONE = threading.Lock()
_PARAMETERS = {p.name.lower(): (m, p) for m in j1939.MESSAGES.values() for p in m.parameters}


def read(
    path: Path,
    names: Mapping[str, SignalName],
    wanted: Wanted,
    notes: list[str],
    progress: Callable[[float], None],
) -> tuple[Kept, list[Samples]]:
    """Wanted frames, in order of time, and signals of decoded channels.

    Raises:
        OncenterError: asammdf cannot read it, or it is shorter than it says.
    """
    with _asammdf(path):
        from asammdf import MDF

        with MDF(path) as mdf:
            if _was_never_closed(path):
                notes.append(f"{path.name} was never closed by its logger: read up to its last whole record")
            start = mdf.start_time.timestamp()
            kept = keep(_frames(mdf, start, progress), wanted)
            decoded = _decoded(mdf, start, names, notes)
            if not decoded and not kept.total:
                raise _nothing_known(path, mdf, notes)
    in_time = np.argsort(kept.frames.time, kind="stable")
    frames = Frames(*(getattr(kept.frames, column)[in_time] for column in Frames.__dataclass_fields__))
    return Kept(frames, kept.pgn_frames, kept.standard_frames), decoded


def _nothing_known(path: Path, mdf: MDF, notes: list[str]) -> OncenterError:
    names = {channel.name for group in _filled_groups(mdf) for channel in mdf.groups[group].channels}
    channels = sorted(names - {"time", "t", "timestamps"})
    if not channels:
        return OncenterError(f"{path.name} has no samples", code="empty_log")
    more = f" and {len(channels) - 12} more" if len(channels) > 12 else ""
    shown = ", ".join(repr(name[:40]) for name in channels[:12]) + more
    return OncenterError(
        f"{'; '.join(['no CAN data frames and no known signal', *notes])} in {path.name}: its channels are {shown}; "
        "name them in a [signals] table",
        code="missing_signal",
        needs=("steering_wheel_angle", "yaw_rate", "vehicle_speed"),
    )


@contextlib.contextmanager
def _asammdf(path: Path) -> Iterator[None]:
    """asammdf logs, prints and lets many kinds of errors through: it is quiet here, and has one error.

    One thread at a time: streams, warnings and garbage are the whole process's.
    """
    with _ALONE, _quiet_asammdf(path):
        yield


@contextlib.contextmanager
def _quiet_asammdf(path: Path) -> Iterator[None]:
    logger = logging.getLogger("asammdf")
    level = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    frozen_by_others = gc.get_freeze_count() > 0
    if not frozen_by_others:
        gc.freeze()  # what was there before need not be searched when asammdf fails
    try:
        with (
            warnings.catch_warnings(),
            contextlib.redirect_stdout(io.StringIO()),
            contextlib.redirect_stderr(io.StringIO()),
        ):
            warnings.simplefilter("ignore")
            yield
    except OncenterError:
        raise
    except Exception as error:
        reason = (str(error).strip().splitlines() or [""])[0] or type(error).__name__
        _let_go(error)
        raise OncenterError(
            f"cannot read {path.name}, it is damaged or of another format: {reason[:160]}", code="unreadable_log"
        ) from None
    finally:
        if not frozen_by_others:
            gc.unfreeze()
        logger.setLevel(level)


def _was_never_closed(path: Path) -> bool:
    """Loggers that lose power leave files whose end nobody knows; MDF has a name for them, and they are read."""
    with path.open("rb") as file:
        return file.read(8) == b"UnFinMF "


def _let_go(error: Exception) -> None:
    """Drops asammdf's half-made objects now, while nobody hears that their `__del__` fails on what they lack."""
    heard = sys.unraisablehook
    sys.unraisablehook = lambda unraisable: None
    try:
        traceback.clear_frames(error.__traceback__)
        error.__traceback__ = error.__context__ = error.__cause__ = None
        gc.collect()
    finally:
        sys.unraisablehook = heard


def _filled_groups(mdf: MDF) -> list[int]:
    groups: list[Any] = list(mdf.groups)
    return [index for index, group in enumerate(groups) if group.channel_group.cycles_nr]


def _frames(mdf: MDF, start: float, progress: Callable[[float], None]) -> Iterator[Frames]:
    filled = _filled_groups(mdf)
    for done, group in enumerate(filled):
        progress(done / len(filled))
        if any(channel.name == FRAME_CHANNEL for channel in mdf.groups[group].channels):
            yield _frames_of_group(mdf, group, start)


def _frames_of_group(mdf: MDF, group: int, start: float) -> Frames:
    signal = mdf.get(FRAME_CHANNEL, group=group)
    fields = signal.samples

    def field(name: str, otherwise: int) -> npt.NDArray[Any]:
        full = f"{FRAME_CHANNEL}.{name}"
        if full in (fields.dtype.names or ()):
            return np.asarray(fields[full])
        return np.full(len(fields), otherwise)

    identifier = field("ID", 0).astype(np.uint32)
    # Without an IDE field, bit 31 of the identifier says that it is extended.
    extended = field("IDE", 0).astype(bool) | (identifier >> np.uint32(31) == 1)
    bytes_ = np.asarray(fields[f"{FRAME_CHANNEL}.DataBytes"])
    width = min(bytes_.shape[1], 8)
    length = np.minimum(field("DataLength", width).astype(np.int64), 8)
    padded = np.full((len(fields), 8), 0xFF, np.uint8)
    padded[:, :width] = bytes_[:, :width]
    padded[np.arange(8) >= length[:, None]] = 0xFF
    channel = field("BusChannel", 0).astype(np.int64)
    bus = np.zeros(len(fields), np.uint64)
    for number in np.unique(channel).tolist():
        bus[channel == number] = bus_code(f"CAN{number}")
    frames = Frames(
        signal.timestamps + start,
        identifier & np.uint32((1 << 29) - 1),
        extended,
        padded.view("<u8")[:, 0],
        length.astype(np.uint8),
        bus,
    )
    flexible = field("EDL", 0).astype(bool)  # CAN FD
    return frames.where(~flexible) if flexible.any() else frames


def _decoded(mdf: MDF, start: float, names: Mapping[str, SignalName], notes: list[str]) -> list[Samples]:
    given: list[Samples] = []
    count = Counter(channel.name for group in _filled_groups(mdf) for channel in mdf.groups[group].channels)
    for group in _filled_groups(mdf):
        channels = [channel.name for channel in mdf.groups[group].channels]
        if any("Frame" in name and name.startswith(("CAN_", "LIN_", "FLX_", "ETH_")) for name in channels):
            continue
        reader = _Group(mdf, group, start)
        if not reader.label and any(count[name] > 1 for name in channels[1:]):
            reader.label = f"group {group}"  # or else its channels could not be told from others of their name
        for index, name in enumerate(channels):
            given += _named_channel(reader, index, name, names, notes)
        given += _j1939_channels(reader, channels, names, notes)
    return given


class _Group:
    """Channels of one raster; its time is one array, so that the clock sees that they share it."""

    def __init__(self, mdf: MDF, group: int, start: float) -> None:
        self._mdf, self._group, self._start = mdf, group, start
        self._time: Column | None = None
        acquired = mdf.groups[group].channel_group
        self.label = str(getattr(acquired, "acq_name", "") or "")

    def channel(self, index: int) -> tuple[Column, Column, str] | None:
        """Time, values and unit of a channel, NaN where invalid; None when it holds no numbers."""
        signal = self._mdf.get(group=self._group, index=index, ignore_invalidation_bits=True)
        if signal.samples.ndim != 1 or signal.samples.dtype.kind not in "iufb":
            return None
        values = signal.samples.astype(np.float64)
        if signal.invalidation_bits is not None:
            values[np.asarray(signal.invalidation_bits, bool)] = np.nan
        if self._time is None:
            self._time = signal.timestamps.astype(np.float64) + self._start
        values[~np.isfinite(values)] = np.nan
        return self._time, values, str(signal.unit or "")


def _named_channel(
    reader: _Group, index: int, name: str, names: Mapping[str, SignalName], notes: list[str]
) -> list[Samples]:
    """A channel that `[signals]` names, or that is called as our signals are."""
    given = []
    for signal in SIGNALS:
        entry = names.get(signal)
        by_name = entry is not None and entry.name in (name, f"{reader.label}.{name}")
        known = factors(signal)
        suffixed = unit_by_suffix(name, known)
        ours = name == signal or (suffixed is not None and name == f"{signal}_{suffixed}")
        if not by_name and not ours:
            continue
        content = reader.channel(index)
        if content is None:
            notes.append(f"{signal}: channel {name} holds no numbers")
            continue
        time, values, written = content
        if entry is not None and by_name:
            factor = entry.sign * known[named_unit(signal, entry, known, written)]
        else:
            unit = suffixed or unit_key(written, known) or ("1" if SIGNALS[signal].quantity is PURE_NUMBER else None)
            if unit is None:
                notes.append(f"{signal}: channel {name} has unit {written!r}, {' or '.join(known)} would do")
                continue
            factor = known[unit]
        given.append(_sample(signal, time, values * factor, name, reader.label, 0 if by_name else 1, name))
    return given


def _j1939_channels(
    reader: _Group, channels: list[str], names: Mapping[str, SignalName], notes: list[str]
) -> list[Samples]:
    """Channels that are called as J1939 parameters are, as a decoder with a J1939 DBC writes them."""
    by_message: dict[int, dict[int, Column]] = {}
    time: Column | None = None
    for index, name in enumerate(channels):
        message, parameter = _PARAMETERS.get(name.rsplit(".", 1)[-1].lower(), (None, None))
        if message is None or parameter is None or parameter.signal is None:
            continue
        content = reader.channel(index)
        if content is None:
            continue
        known = factors(parameter.signal)
        unit = unit_key(content[2], known) if content[2] else parameter.unit
        if unit is None:
            notes.append(f"{parameter.signal}: channel {name} has unit {content[2]!r}, {' or '.join(known)} would do")
            continue
        time = content[0]
        values = _in_range(content[1] * (known[unit] / known[parameter.unit]), parameter)
        by_message.setdefault(message.pgn, {})[parameter.spn] = values
    if time is None:
        return []
    return [
        _sample(
            signal,
            time,
            values,
            message.name,
            ", ".join(filter(None, (message.name, reader.label))),
            2 + j1939.rank(signal, message.name),
            _channel_name(message, signal),
        )
        for message in (j1939.MESSAGES[pgn] for pgn in by_message)
        for signal, values in j1939.signals_of(message, by_message[message.pgn]).items()
    ]


def _in_range(values: Column, parameter: j1939.Parameter) -> Column:
    """NaN where a decoder took error and not available for numbers."""
    highest = parameter.offset + parameter.scale * (parameter.largest_number + 0.5)
    lowest = parameter.offset - parameter.scale * 0.5
    return np.where((values > highest) | (values < lowest), np.nan, values)


def _channel_name(message: j1939.Message, signal: str) -> str:
    own = [parameter.name for parameter in message.parameters if parameter.signal == signal]
    return own[0] if own else "mean wheel speed"


def _sample(signal: str, time: Column, values: Column, kind: str, label: str, rank: int, channel: str) -> Samples:
    description = f"channel {channel}" + (f" ({label})" if label else "")
    return Samples(signal, time, values, kind, description, rank, labels=(channel.lower(), kind.lower(), label.lower()))
