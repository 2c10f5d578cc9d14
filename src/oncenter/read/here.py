"""Reads a log into a `Signals` in this process. Each format has its module."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from oncenter.errors import OncenterError
from oncenter.files.folder import is_bag_folder
from oncenter.files.log_formats import OF_BAGS, Format, format_of, imported
from oncenter.read import dbc as databases
from oncenter.read import identity, j1939
from oncenter.read.as_signals import FrameCount, as_signals
from oncenter.read.database_range import within_signals
from oncenter.read.decode import decode, wanted_by, with_signals, without_long
from oncenter.read.frames import Kept, keep, with_groups
from oncenter.read.frames_of_log import frames_of_log
from oncenter.read.identity import NOT_STATED, Identity
from oncenter.read.joined import WITHOUT_SIGNALS, Content, joined
from oncenter.read.left_out import short_frames_notes
from oncenter.read.mdf_comment import vin_in_header
from oncenter.read.plugins import known_format, plugin_for
from oncenter.read.samples import Samples
from oncenter.read.set_back import frames_on_one_clock
from oncenter.read.wording import cannot_read
from oncenter.signals import STATUSES, SignalName, Signals


def read_here(
    path: Path,
    names: Mapping[str, SignalName],
    dbc: Sequence[str | os.PathLike[str]],
    take: Mapping[str, str],
    progress: Callable[[float], None],
) -> Signals:
    """Reads as `read`, but always in this process, with the library for that format.

    Raises:
        OncenterError: as `read`.
    """
    notes: list[str] = []
    content = _content(path, names, dbc, notes, progress)
    signals = as_signals(path, content.candidates, take, notes, content.about, content.frames, content.set_back)
    progress(1.0)
    return signals


def read_joined(
    paths: Sequence[Path],
    names: Mapping[str, SignalName],
    dbc: Sequence[str | os.PathLike[str]],
    take: Mapping[str, str],
    progress: Callable[[float], None],
) -> Signals:
    """Reads files of one drive, as of buses that were recorded each in a file, and puts their signals together by time.

    Raises:
        OncenterError: as `read`; no file has a signal; "different_trucks"; "no_common_time".
    """
    notes: list[str] = []
    refused, contents = [], []
    for path in paths:
        try:
            contents.append((path, _content(path, names, dbc, notes, lambda fraction: None)))
        except OncenterError as error:
            if error.code not in WITHOUT_SIGNALS:
                raise
            refused.append(error)
        progress((len(contents) + len(refused)) / len(paths))
    if not contents:
        raise refused[0]
    notes += map(str, refused)
    content = joined(contents, take, notes)
    return as_signals(paths[0], content.candidates, take, notes, content.about, content.frames, content.set_back)


def _content(
    path: Path,
    names: Mapping[str, SignalName],
    dbc: Sequence[str | os.PathLike[str]],
    notes: list[str],
    progress: Callable[[float], None],
) -> Content:
    plugin = plugin_for(path)
    before = path.stat()
    progress(0.0)
    log_format = None if plugin is not None else _format_of_bags() if is_bag_folder(path) else known_format(path)
    if log_format is not None and log_format.content in ("frames", "frames and channels"):
        content = _from_bus(path, log_format, names, dbc, notes, progress)
    elif plugin is not None:
        from oncenter.read.plugin_log import read_plugin  # late import of polars

        content = Content(*read_plugin(path, plugin, names, notes))
    else:
        assert log_format is not None
        content = Content(*_not_of_frames(path, log_format, names, notes))
    _note_a_change(path, before, notes)
    return content


def _format_of_bags() -> Format:
    found = format_of(OF_BAGS[0])
    assert found is not None
    return found


def _note_a_change(path: Path, before: os.stat_result, notes: list[str]) -> None:
    """
    Raises:
        OncenterError: the file became shorter during reading, so a part of it was not read.
    """
    try:
        after = path.stat()
    except OSError as error:
        raise cannot_read(path, error) from error
    if after.st_size < before.st_size:
        raise OncenterError(
            f"{path.name} became shorter during reading, from {before.st_size} to {after.st_size} bytes: read it again",
            code="unreadable_log",
        )
    if (after.st_size, after.st_mtime_ns, after.st_ino) != (before.st_size, before.st_mtime_ns, before.st_ino):
        notes.append(f"{path.name} changed during reading: read it again for the rest")


def _not_of_frames(
    path: Path, log_format: Format, names: Mapping[str, SignalName], notes: list[str]
) -> tuple[list[Samples], Identity]:
    read = imported(log_format.reader)
    if log_format.content == "columns":
        found: tuple[list[Samples], Identity] = read(path, names, notes)
        return found
    return read(path, names, notes), NOT_STATED


def _from_bus(
    path: Path,
    log_format: Format,
    names: Mapping[str, SignalName],
    dbc: Sequence[str | os.PathLike[str]],
    notes: list[str],
    progress: Callable[[float], None],
) -> Content:
    """Signals of a log of frames. A database replaces the J1939 layout of the messages it describes."""
    described = databases.definitions(dbc, names, notes)
    wanted = wanted_by(described)
    others = identity.PGNS - wanted.pgns
    both = replace(wanted, pgns=wanted.pgns | others)
    decoded: list[Samples] = []
    if log_format.content == "frames":
        kept = keep(frames_of_log(path, notes, progress), both)
    else:
        kept, decoded = imported(log_format.reader)(path, names, both, notes, progress)
    kept, long = without_long(kept, described, path.name, notes)
    of_truck = with_groups(kept.frames, identity.PGNS)
    vin = identity.assembled((kept.frames.where(of_truck),)) or vin_in_header(path)
    if others:
        kept = replace(kept, frames=kept.frames.where(~with_groups(kept.frames, others)))
    notes += short_frames_notes(kept.frames, path.name)
    frames, set_back = frames_on_one_clock(kept.frames)
    kept = replace(kept, frames=frames)
    candidates = within_signals(decode(kept, described, decoded), notes)
    if not candidates or (not described and all(samples.signal in STATUSES for samples in candidates)):
        raise _no_signal_recognised(path, log_format, kept, described, notes)
    if not kept.total:
        return Content(candidates, Identity(vin))
    count = FrameCount(kept.total - long, with_signals(frames, described))
    return Content(candidates, Identity(vin), count, None if decoded and not len(frames) else set_back)


def _no_signal_recognised(
    path: Path, log_format: Format, kept: Kept, described: Sequence[databases.Definition], notes: Sequence[str]
) -> OncenterError:
    if kept.total == 0:
        limits = f" ({log_format.limits})" if log_format.limits and not notes else ""
        why = f": {'; '.join(notes)}" if notes else ""
        return OncenterError(f"no CAN data frames in {path.name}{limits}{why}", code="empty_log")
    if described:
        messages = ", ".join(f"{d.message.name} (0x{d.message.frame_id:X})" for d in described)
        why = f"{path.name} has none of the messages that the database describes: {messages}"
        return OncenterError(
            "; ".join([why, "check that the database is of this network", *notes]),
            code="missing_signal",
            needs=("steering_wheel_angle", "yaw_rate", "vehicle_speed"),
        )
    if kept.standard_frames == kept.total:
        why = (
            f"{path.name} has only 11-bit identifiers ({kept.total} frames), so it is not J1939, and no frame has a "
            "steering wheel angle"
        )
        remedy = "give the network's DBC with --dbc and assign its signals in the [signals] table of a vehicle file"
        return OncenterError("; ".join([f"{why}: {remedy}", *notes]), code="not_j1939")
    why = (
        f"no frame has a steering wheel angle ({j1939.home('steering_wheel_angle')}) or another signal of oncenter in "
        f"{path.name}; found: PGN {j1939.found_groups(kept)}"
    )
    return OncenterError(
        "; ".join([why, "if one of them has the angle, describe it in a DBC (--dbc)", *notes]),
        code="missing_signal",
        needs=("steering_wheel_angle", "yaw_rate", "vehicle_speed"),
    )
