"""ASAM MDF 3 and 4 through asammdf: raw CAN frames of bus logging, and decoded channels at their own rasters.

asammdf hands out stored numbers only. Conversions to physical ones are in `conversions.py`: asammdf would run a formula
of the file as code, and would leave out one that it cannot run.
"""

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
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from oncenter.errors import OncenterError
from oncenter.files.extra import require_package
from oncenter.read import j1939
from oncenter.read.channels import Channel, NoSamples, samples, samples_of
from oncenter.read.conversions import NoNumbers, UnknownConversion, physical, shown
from oncenter.read.cut_off import CutOff
from oncenter.read.frames import Column, Frames, Kept, Wanted, bus_code, keep
from oncenter.read.samples import Samples
from oncenter.read.units import factors, unit_key
from oncenter.signals import SignalName

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
        OncenterError: asammdf cannot read it, or it is shorter than it says; "missing_extra": asammdf is not installed;
            "unknown_conversion": that of a channel that is needed is not understood.
    """
    with _asammdf(path) as mdf:
        log = _Log(path, mdf)
        if _was_never_closed(path):
            notes.append(CutOff(f"{path.name} was never closed by its logger: read up to its last whole record"))
        kept = keep(_frames(log, progress), wanted)
        decoded = _decoded(log, names, notes)
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
def _asammdf(path: Path) -> Iterator[MDF]:
    """A file that asammdf has opened.

    asammdf logs, prints and lets many kinds of errors through: it is quiet here, and has one error.
    One thread at a time: streams, warnings, garbage and asammdf are the whole process's.
    """
    require_package("asammdf", path.name)
    with _ALONE, _quiet_asammdf(path):
        opened = _mdf_without_eval()
        # Bus logging: asammdf would convert while it opens the file, and would load a DBC that the log holds or names.
        with opened(path, process_bus_logging=False) as mdf:
            yield mdf


def _mdf_without_eval() -> Callable[..., MDF]:
    """asammdf's class, in which nothing can run a formula as code.

    asammdf hands formulas to numexpr, and those that fail there to sympy; both hand them to Python's `eval`. No formula
    gets that far, because a `_Log` takes all conversions off before anything is read. This is a second wall, for a
    place that we overlooked or that a later asammdf has. It stands until this process ends, which only reads logs.
    """
    if sys.modules.get("numexpr") is None:
        stand_in: Any = ModuleType("numexpr")
        stand_in.evaluate = _refuse_to_evaluate
        stand_in.__version__ = "0"  # pandas asks for numexpr as well, and does without one that is too old
        sys.modules["numexpr"] = stand_in
    from asammdf import MDF
    from asammdf.blocks import v2_v3_blocks, v4_blocks

    modules: tuple[Any, ...] = (v2_v3_blocks, v4_blocks)
    for module in modules:
        module.evaluate = module.lambdify = module.symbols = _refuse_to_evaluate
    return MDF


def _refuse_to_evaluate(*arguments: object, **options: object) -> None:
    raise RuntimeError("asammdf would have run a formula of the file as code")


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


class _Log:
    """An open file whose conversions are taken off its channels, so that asammdf has none to apply.

    Attributes:
        conversions: blocks by group and index of the channel; None for a block that asammdf could not read.
    """

    def __init__(self, path: Path, mdf: MDF) -> None:
        self.path, self.mdf = path, mdf
        self.start = mdf.start_time.timestamp()
        self.conversions: dict[tuple[int, int], Any] = {}
        groups: list[Any] = list(mdf.groups)
        for group, content in enumerate(groups):
            for index, channel in enumerate(content.channels):
                if channel.conversion is not None or channel.conversion_addr:
                    self.conversions[group, index] = channel.conversion
                channel.conversion = None

    def raw(self, group: int, index: int) -> tuple[npt.NDArray[Any], npt.NDArray[np.bool_] | None]:
        """What a channel stores, and which of it is invalid."""
        stored, invalid = self.mdf.get(
            group=group, index=index, raw=True, samples_only=True, ignore_invalidation_bits=True
        )
        return stored, None if invalid is None else np.asarray(invalid, bool)

    def physical(self, group: int, index: int, raw: npt.NDArray[Any]) -> Column:
        """Raises: NoNumbers."""
        try:
            if (group, index) not in self.conversions:
                return physical(None, raw)
            block = self.conversions[group, index]
            if block is None:
                raise UnknownConversion("a conversion block that is damaged")
            return physical(block, raw)
        except UnknownConversion as error:
            name = self.mdf.groups[group].channels[index].name
            raise OncenterError(
                f"{self.path.name}: the conversion of channel {shown(name)} is not understood: {error}",
                code="unknown_conversion",
            ) from None

    def unit(self, group: int, index: int) -> str:
        """The channel's own, or else its conversion's."""
        channel = self.mdf.groups[group].channels[index]
        return str(getattr(channel, "unit", "") or getattr(self.conversions.get((group, index)), "unit", "") or "")

    def time(self, group: int) -> Column:
        """Unix time in s of a group's records."""
        raw = np.asarray(self.mdf.get_master(group))
        group = self._group_of_time(group)
        index = self.mdf.masters_db.get(group)
        return (raw.astype(np.float64) if index is None else self.physical(group, index, raw)) + self.start

    def _group_of_time(self, group: int) -> int:
        """MDF 4.2 may keep the time of a group in another; asammdf has followed that before, so that it ends."""
        from asammdf.blocks.v4_constants import FLAG_CG_REMOTE_MASTER

        acquired: Any = self.mdf.groups[group].channel_group
        while getattr(acquired, "flags", 0) & FLAG_CG_REMOTE_MASTER:
            group = acquired.cg_master_index
            acquired = self.mdf.groups[group].channel_group
        return group


def _frames(log: _Log, progress: Callable[[float], None]) -> Iterator[Frames]:
    filled = _filled_groups(log.mdf)
    for done, group in enumerate(filled):
        progress(done / len(filled))
        channels = [channel.name for channel in log.mdf.groups[group].channels]
        if FRAME_CHANNEL in channels:
            yield _frames_of_group(log, group, channels)


def _frames_of_group(log: _Log, group: int, channels: list[str]) -> Frames:
    fields, invalid = log.raw(group, channels.index(FRAME_CHANNEL))

    def field(name: str, otherwise: int) -> npt.NDArray[Any]:
        full = f"{FRAME_CHANNEL}.{name}"
        if full not in (fields.dtype.names or ()):
            return np.full(len(fields), otherwise)
        return _field(log, group, channels.index(full), np.asarray(fields[full]))

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
        log.time(group),
        identifier & np.uint32((1 << 29) - 1),
        extended,
        padded.view("<u8")[:, 0],
        length.astype(np.uint8),
        bus,
    )
    chosen = ~field("EDL", 0).astype(bool)  # not CAN FD
    if invalid is not None:
        chosen &= ~invalid
    return frames if chosen.all() else frames.where(chosen)


def _field(log: _Log, group: int, index: int, stored: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Whole numbers from 0 to 2^32 - 1, the stored ones where a conversion has texts for them.

    Some loggers store no bit of what is the same in all frames: then a conversion gives it.
    """
    if (group, index) not in log.conversions:
        return stored
    try:
        values = log.physical(group, index, stored)
    except NoNumbers:
        return stored
    values = np.where(np.isnan(values), stored, values)
    if not ((values >= 0) & (values < 1 << 32) & (values % 1 == 0)).all():
        name = log.mdf.groups[group].channels[index].name
        raise OncenterError(
            f"{log.path.name}: the conversion of {name} does not give whole numbers from 0 to 2^32 - 1",
            code="unknown_conversion",
        )
    return values.astype(np.int64)


def _decoded(log: _Log, names: Mapping[str, SignalName], notes: list[str]) -> list[Samples]:
    mdf = log.mdf
    given: list[Samples] = []
    count = Counter(channel.name for group in _filled_groups(mdf) for channel in mdf.groups[group].channels)
    for group in _filled_groups(mdf):
        channels = [channel.name for channel in mdf.groups[group].channels]
        if any("Frame" in name and name.startswith(("CAN_", "LIN_", "FLX_", "ETH_")) for name in channels):
            continue
        reader = _Group(log, group)
        if not reader.label and any(count[name] > 1 for name in channels[1:]):
            reader.label = f"group {group}"  # or else its channels could not be told from others of their name
        for index, name in enumerate(channels):
            given += samples_of(Channel(name, reader.label, partial(reader.content, index)), names, notes)
        given += _j1939_channels(reader, channels, names, notes)
    return given


class _Group:
    """Channels of one raster; its time is one array, so that the clock sees that they share it."""

    def __init__(self, log: _Log, group: int) -> None:
        self._log, self._group = log, group
        self._time: Column | None = None
        acquired = log.mdf.groups[group].channel_group
        self.label = str(getattr(acquired, "acq_name", "") or "")

    def content(self, index: int) -> tuple[Column, Column, str]:
        """Time, values and unit of a channel, NaN where invalid.

        Raises:
            NoSamples: it holds no numbers.
        """
        raw, invalid = self._log.raw(self._group, index)
        try:
            values = self._log.physical(self._group, index, raw)
        except NoNumbers:
            raise NoSamples("holds no numbers") from None
        if invalid is not None:
            values[invalid] = np.nan
        if self._time is None:
            self._time = self._log.time(self._group)
        if len(self._time) != len(values):
            raise ValueError(f"{len(values)} values at {len(self._time)} times")
        return self._time, values, self._log.unit(self._group, index)


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
        try:
            content = reader.content(index)
        except NoSamples:
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
        samples(
            _channel_name(message, signal),
            ", ".join(filter(None, (message.name, reader.label))),
            signal,
            time,
            values,
            message.name,
            2 + j1939.rank(signal, message.name),
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
