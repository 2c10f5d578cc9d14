"""ASAM MDF 3 and 4 through asammdf: raw CAN frames of bus logging, and decoded channels at their own rates.

asammdf is used for stored values only. `conversions.py` computes physical values: asammdf would run a formula from the
file as code, and would skip one that it cannot run.
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
from oncenter.read.channels import Channel, Content, NoSamples, samples, samples_of, with_parts, without_zeros
from oncenter.read.conversions import NoNumbers, UnknownConversion, physical, shown
from oncenter.read.frames import BYTES_MAX, MORE, Column, Frames, Kept, Wanted, bus_code, keep
from oncenter.read.left_out import CutOff, left_out_frames
from oncenter.read.samples import Samples
from oncenter.read.set_back import pieces_of
from oncenter.read.spn import parameter_of
from oncenter.read.units import factors, unit_key
from oncenter.read.wording import ASSIGN_THEM, damaged, reason_of
from oncenter.signals import SignalName

if TYPE_CHECKING:
    from asammdf import MDF

FRAME_CHANNEL = "CAN_DataFrame"
_FRAMES_WITHOUT_DATA = {"CAN_ErrorFrame": "error_frame", "CAN_RemoteFrame": "remote_frame"}
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
        OncenterError: asammdf cannot read it, or it is shorter than its header says; "missing_extra": asammdf is not
            installed; "unknown_conversion": the conversion of a needed channel is not supported.
    """
    with _asammdf(path) as mdf:
        log = _Log(path, mdf)
        if _was_never_closed(path):
            notes.append(CutOff(f"the logger did not close {path.name}: it was read up to its last complete record"))
        no_data: Counter[str] = Counter()
        kept = keep(_frames(log, progress, no_data), wanted)
        notes += left_out_frames(path.name, no_data)
        decoded = _decoded(log, names, notes)
        if not decoded and not kept.total:
            raise _no_signal_recognised(path, mdf, notes)
    # the groups of a file are behind one another
    in_time = np.lexsort((kept.frames.time, pieces_of(kept.frames)))
    return Kept(kept.frames.where(in_time), kept.pgn_frames, kept.standard_frames), decoded


def channel_units(path: Path) -> dict[str, str]:
    """The unit of each channel of a decoded log, by the name that `[signals]` takes; none of frames.

    Raises:
        OncenterError: as `read`.
    """
    units: dict[str, str] = {}
    with _asammdf(path) as mdf:
        log = _Log(path, mdf)
        groups: list[Any] = list(mdf.groups)
        count = Counter(channel.name for group in _filled_groups(mdf) for channel in groups[group].channels)
        for group in _filled_groups(mdf):
            names = [channel.name for channel in groups[group].channels]
            if any(_is_of_frames(name) for name in names):
                continue
            label = _Group(log, group).label or f"group {group}"
            for index, name in enumerate(names):
                if index != mdf.masters_db.get(group):
                    units[f"{label}.{name}" if count[name] > 1 else name] = log.unit(group, index)
    return units


def _is_of_frames(channel: str) -> bool:
    return "Frame" in channel and channel.startswith(("CAN_", "LIN_", "FLX_", "ETH_"))


def _no_signal_recognised(path: Path, mdf: MDF, notes: list[str]) -> OncenterError:
    names = {channel.name for group in _filled_groups(mdf) for channel in mdf.groups[group].channels}
    channels = sorted(names - {"time", "t", "timestamps"})
    if not channels:
        return OncenterError(f"{path.name} has no samples", code="empty_log")
    more = f" and {len(channels) - 12} more" if len(channels) > 12 else ""
    shown = ", ".join(repr(name[:40]) for name in channels[:12]) + more
    return OncenterError(
        "; ".join(
            [
                f"no CAN data frames and no signal recognised in {path.name}",
                *notes,
                f"its channels are {shown}; {ASSIGN_THEM}",
            ]
        ),
        code="missing_signal",
        needs=("steering_wheel_angle", "yaw_rate", "vehicle_speed"),
    )


@contextlib.contextmanager
def _asammdf(path: Path) -> Iterator[MDF]:
    """Opens a file with asammdf.

    asammdf logs, prints and raises many kinds of errors: here its output is suppressed, and its errors become one kind.
    One thread at a time, because streams, warnings, garbage collection and asammdf are global to the process.
    """
    require_package("asammdf", path.name)
    with _ALONE, _quiet_asammdf(path):
        opened = _mdf_without_eval()
        # With bus logging asammdf would convert while opening, and would load a DBC that the log contains or names.
        with opened(path, process_bus_logging=False) as mdf:
            yield mdf


def _mdf_without_eval() -> Callable[..., MDF]:
    """asammdf's class, modified so that it cannot run a formula as code.

    asammdf passes formulas to numexpr, and to sympy if that fails; both pass them to Python's `eval`. No formula gets
    there, because `_Log` removes all conversions before anything is read. This is a second barrier, in case a code path
    was overlooked or a later asammdf adds one. It stays for the life of this process, which only reads logs.
    """
    if sys.modules.get("numexpr") is None:
        stand_in: Any = ModuleType("numexpr")
        stand_in.evaluate = _refuse_to_evaluate
        stand_in.__version__ = "0"  # pandas also imports numexpr, and ignores a version that is too old
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
        gc.freeze()  # the collection after a failure of asammdf then skips older objects
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
        reason = reason_of(error)
        _release(error)
        raise damaged(path.name, reason) from None
    finally:
        if not frozen_by_others:
            gc.unfreeze()
        logger.setLevel(level)


def _was_never_closed(path: Path) -> bool:
    """Whether the file is marked as unfinished: its logger lost power. Such a file is read up to its end."""
    with path.open("rb") as file:
        return file.read(8) == b"UnFinMF "


def _release(error: Exception) -> None:
    """Deletes asammdf's incomplete objects now, with the errors of their `__del__` suppressed."""
    before = sys.unraisablehook
    sys.unraisablehook = lambda unraisable: None
    try:
        traceback.clear_frames(error.__traceback__)
        error.__traceback__ = error.__context__ = error.__cause__ = None
        gc.collect()
    finally:
        sys.unraisablehook = before


def _filled_groups(mdf: MDF) -> list[int]:
    groups: list[Any] = list(mdf.groups)
    return [index for index, group in enumerate(groups) if group.channel_group.cycles_nr]


class _Log:
    """An open file. The conversions are removed from its channels, so that asammdf cannot apply them.

    Attributes:
        conversions: blocks by group and index of the channel; None for one that asammdf could not read.
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
        """The stored values of a channel, and which of them are invalid."""
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
                raise UnknownConversion("a damaged conversion block")
            return physical(block, raw)
        except UnknownConversion as error:
            name = self.mdf.groups[group].channels[index].name
            raise OncenterError(
                f"{self.path.name}: the conversion of channel {shown(name)} is not supported: {error}; export the log "
                "with physical values",
                code="unknown_conversion",
            ) from None

    def unit(self, group: int, index: int) -> str:
        """The unit of the channel, else of its conversion."""
        channel = self.mdf.groups[group].channels[index]
        return str(getattr(channel, "unit", "") or getattr(self.conversions.get((group, index)), "unit", "") or "")

    def time(self, group: int) -> Column:
        """Unix time in s of a group's records."""
        raw = np.asarray(self.mdf.get_master(group))
        group = self._group_of_time(group)
        index = self.mdf.masters_db.get(group)
        return (raw.astype(np.float64) if index is None else self.physical(group, index, raw)) + self.start

    def _group_of_time(self, group: int) -> int:
        """MDF 4.2 may store the time of a group in another group. asammdf has checked that the chain ends."""
        from asammdf.blocks.v4_constants import FLAG_CG_REMOTE_MASTER

        acquired: Any = self.mdf.groups[group].channel_group
        while getattr(acquired, "flags", 0) & FLAG_CG_REMOTE_MASTER:
            group = acquired.cg_master_index
            acquired = self.mdf.groups[group].channel_group
        return group


def _frames(log: _Log, progress: Callable[[float], None], no_data: Counter[str]) -> Iterator[Frames]:
    filled = _filled_groups(log.mdf)
    for done, group in enumerate(filled):
        progress(done / len(filled))
        channels = [channel.name for channel in log.mdf.groups[group].channels]
        for name, reason in _FRAMES_WITHOUT_DATA.items():
            no_data[reason] += log.mdf.groups[group].channel_group.cycles_nr if name in channels else 0
        if FRAME_CHANNEL in channels:
            yield _frames_of_group(log, group, channels, no_data)


def _frames_of_group(log: _Log, group: int, channels: list[str], no_data: Counter[str]) -> Frames:
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
    width = min(bytes_.shape[1], BYTES_MAX)
    length = np.clip(field("DataLength", width).astype(np.int64), 0, width)
    padded = np.full((len(fields), BYTES_MAX if width > 8 and length.max(initial=0) > 8 else 8), 0xFF, np.uint8)
    padded[:, :width] = bytes_[:, : padded.shape[1]]
    padded[np.arange(padded.shape[1]) >= length[:, None]] = 0xFF
    channel = field("BusChannel", 0).astype(np.int64)
    bus = np.zeros(len(fields), np.uint64)
    for number in np.unique(channel).tolist():
        bus[channel == number] = bus_code(f"CAN{number}")
    frames = Frames(
        log.time(group),
        identifier & np.uint32((1 << 29) - 1),
        extended,
        np.ascontiguousarray(padded[:, :8]).view("<u8")[:, 0],
        length.astype(np.uint8),
        bus,
        None if padded.shape[1] == 8 else np.ascontiguousarray(padded[:, 8:]).view(MORE)[:, 0],
    )
    without = {"remote_frame": field("RTR", 0).astype(bool)}
    if invalid is not None:
        without = {"invalid_bit": invalid, **without}
    chosen = np.ones(len(frames), bool)
    for reason, frames_without in without.items():
        no_data[reason] += int(np.count_nonzero(chosen & frames_without))
        chosen &= ~frames_without
    return frames.where(chosen)


def _field(log: _Log, group: int, index: int, stored: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Integers from 0 to 2^32 - 1; the stored ones where a conversion gives texts.

    Some loggers store a field that is constant in all frames only as a conversion.
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
            f"{log.path.name}: the conversion of {name} does not give integers from 0 to 2^32 - 1",
            code="unknown_conversion",
        )
    return values.astype(np.int64)


def _decoded(log: _Log, names: Mapping[str, SignalName], notes: list[str]) -> list[Samples]:
    mdf = log.mdf
    given: list[Samples] = []
    count = Counter(channel.name for group in _filled_groups(mdf) for channel in mdf.groups[group].channels)
    for group in _filled_groups(mdf):
        channels = [channel.name for channel in mdf.groups[group].channels]
        if any(_is_of_frames(name) for name in channels):
            continue
        reader = _Group(log, group)
        if not reader.label and any(count[name] > 1 for name in channels[1:]):
            reader.label = f"group {group}"  # distinguishes its channels from others with the same name
        of_group = [Channel(name, reader.label, partial(reader.content, k)) for k, name in enumerate(channels)]
        for channel in with_parts(log.path, of_group, names):
            given += samples_of(channel, names, notes)
        given += _j1939_channels(reader, channels, names, notes)
    return given


class _Group:
    """Channels of one rate. Their time is one array, by which the clock recognises that they share it."""

    def __init__(self, log: _Log, group: int) -> None:
        self._log, self._group = log, group
        self._time: Column | None = None
        acquired = log.mdf.groups[group].channel_group
        self.label = str(getattr(acquired, "acq_name", "") or "")

    def content(self, index: int) -> Content:
        """A channel, NaN where invalid.

        Raises:
            NoSamples: it contains no numbers.
        """
        raw, invalid = self._log.raw(self._group, index)
        try:
            values = self._log.physical(self._group, index, raw)
        except NoNumbers:
            raise NoSamples("contains no numbers") from None
        lost = {"no_number": int(np.count_nonzero(np.isnan(values) & _is_number(raw)))}
        if invalid is not None:
            lost["no_number"] -= int(np.count_nonzero(invalid & np.isnan(values) & _is_number(raw)))
            lost["invalid_bit"] = int(np.count_nonzero(invalid))
            values[invalid] = np.nan
        if self._time is None:
            self._time = self._log.time(self._group)
        if len(self._time) != len(values):
            raise ValueError(f"a channel has {len(values)} values for {len(self._time)} times")
        return Content(self._time, values, self._log.unit(self._group, index), without_zeros(lost))


def _is_number(raw: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """Which stored values are no NaN, which means that there is no sample."""
    return np.ones(len(raw), bool) if raw.dtype.kind != "f" else ~np.isnan(raw)


def _j1939_channels(
    reader: _Group, channels: list[str], names: Mapping[str, SignalName], notes: list[str]
) -> list[Samples]:
    """Channels with names of J1939 parameters, as a decoder with a J1939 DBC writes them."""
    by_message: dict[int, dict[int, Column]] = {}
    lost: dict[int, dict[str, int]] = {}  # by SPN
    time: Column | None = None
    for index, name in enumerate(channels):
        by_number = parameter_of(name)
        message, parameter = _PARAMETERS.get(name.rsplit(".", 1)[-1].lower(), (None, None))
        if message is None and by_number is not None and by_number.is_certain:
            message, parameter = by_number.message, by_number.parameter
        if message is None or parameter is None or parameter.signal is None:
            continue
        try:
            content = reader.content(index)
        except NoSamples:
            continue
        known = factors(parameter.signal)
        unit = unit_key(content.unit, known) if content.unit else parameter.unit
        if unit is None:
            notes.append(
                f"{parameter.signal}: channel {name} left out: it has unit {content.unit!r}, "
                f"expected {' or '.join(known)}"
            )
            continue
        time = content.time
        values = _in_range(content.values * (known[unit] / known[parameter.unit]), parameter)
        codes = int(np.count_nonzero(np.isnan(values) & ~np.isnan(content.values)))
        lost[parameter.spn] = content.lost | without_zeros({"error_code": codes})
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
            _lost_together(values, [lost[p.spn] for p in j1939.parts_of(message, signal) if p.spn in lost]),
        )
        for message in (j1939.MESSAGES[pgn] for pgn in by_message)
        for signal, values in j1939.signals_of(message, by_message[message.pgn]).items()
    ]


def _lost_together(values: Column, of_parts: list[dict[str, int]]) -> dict[str, int]:
    """The losses of a signal of one parameter; of several, which may fall together, all count for the first reason."""
    if len(of_parts) == 1:
        return of_parts[0]
    reasons = [reason for lost in of_parts for reason in lost]
    return {reasons[0]: int(np.count_nonzero(np.isnan(values)))} if reasons else {}


def _in_range(values: Column, parameter: j1939.Parameter) -> Column:
    """NaN where a decoder converted the codes for error and not available to numbers."""
    highest = parameter.offset + parameter.scale * (parameter.largest_number + 0.5)
    lowest = parameter.offset + parameter.scale * (parameter.smallest_number - 0.5)
    return np.where((values > highest) | (values < lowest), np.nan, values)


def _channel_name(message: j1939.Message, signal: str) -> str:
    own = [parameter.name for parameter in message.parameters if parameter.signal == signal]
    return own[0] if own else "mean wheel speed"
