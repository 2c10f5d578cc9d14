"""Reads a log into a `Signals`: in this process (`here`) or in a child process that may crash (`apart`).

This module imports nothing heavy: the child process starts reading while this process still imports.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from oncenter.errors import OncenterError
from oncenter.files.folder import is_bag_folder
from oncenter.files.log_formats import SUFFIXES
from oncenter.files.own_file import HEAD_BYTES, refuse_own_text
from oncenter.files.packed_names import packed_file
from oncenter.files.regular_file import open_regular_file, refuse_sparse, refuse_what_is_no_regular_file
from oncenter.read.plugins import known_format, plugin_for
from oncenter.read.units import possible_columns
from oncenter.read.wording import FOUND, cannot_read
from oncenter.signals import SIGNALS, SignalName, Signals

if TYPE_CHECKING:
    from oncenter.vehicle import Vehicle

_NO_FRAMES = ("column ", "variable ", "field ")  # sources of files without frames

__all__ = ["SUFFIXES", "read", "read_joined", "refuse_unreadable", "require"]


def read(
    path: str | os.PathLike[str],
    *,
    vehicle: Vehicle | str | os.PathLike[str] | None = None,
    names: Mapping[str, SignalName] | None = None,
    dbc: Sequence[str | os.PathLike[str]] = (),
    take: Mapping[str, str] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Signals:
    """Reads the signals of a log, as many of `oncenter.signals.SIGNALS` as it has.

    Args:
        path: a log in one of the formats of docs/formats.md, or the folder of a ROS 2 bag; or a file or folder that an
            installed plug-in reads (examples/README.md).
        vehicle: from `oncenter.vehicle`, or the path of its file. Its `[signals]` table and its `dbc` apply where
            `names` and `dbc` are not given.
        names: by signal, or "time", its name in this log, where it differs from oncenter's.
        dbc: databases of the network, in addition to the built-in J1939 messages.
        take: by signal, or "all", the source to use: an address "0x3E", a message "VDC2", or both.
        progress: called now and then with the fraction read, 0 to 1.

    Raises:
        OncenterError: the log cannot be read, no signal is recognised, or two sources of a signal disagree;
            "reader_crashed", "reader_time", "reader_memory": a library crashed on the file or was stopped;
            "plugin_failed", "plugin_ambiguous"; "missing_extra": the package that reads such files is not installed;
            "vehicle_file", exit code 2: a database named in the vehicle file does not exist.
    """
    if isinstance(vehicle, str | os.PathLike):
        from oncenter.vehicle import vehicle_of

        vehicle = vehicle_of(vehicle, "read")
    if vehicle is not None:
        names = vehicle.signal_names if names is None else names
        dbc = dbc or vehicle.databases()
    given = Path(path)
    if packed_file(given) is not None:
        from oncenter.read.apart import unpacked

        with unpacked(given) as file:
            return _read(file, names or {}, dbc, take or {}, progress).replaced(log=os.fspath(given))
    return _read(given, names or {}, dbc, take or {}, progress)


def _read(
    path: Path,
    names: Mapping[str, SignalName],
    dbc: Sequence[str | os.PathLike[str]],
    take: Mapping[str, str],
    progress: Callable[[float], None] | None,
) -> Signals:
    if not os.path.isdir(path):  # without permission, Path.is_dir raises
        refuse_unreadable(path)
    is_read_here = False
    if not is_bag_folder(path) and plugin_for(path) is None:
        refuse_what_is_no_regular_file(path)
        is_read_here = known_format(path).here
    given = path, names, dbc, take, progress or (lambda fraction: None)
    if is_read_here and not dbc:
        from oncenter.read.here import read_here

        return read_here(*given)
    from oncenter.read.apart import read_apart

    return read_apart(*given)


def read_joined(
    paths: Sequence[Path],
    vehicle: Vehicle,
    dbc: Sequence[str | os.PathLike[str]] = (),
    take: Mapping[str, str] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Signals:
    """Reads files of one drive, which `read` can read, as one log.

    Raises:
        OncenterError: as `read`; "different_trucks"; "no_common_time": some have times since 1970, others do not.
    """
    from oncenter.read.apart import read_apart

    given = vehicle.signal_names, dbc or vehicle.databases(), take or {}, progress or (lambda fraction: None)
    return read_apart(paths[0], *given, paths[1:])


def require(signals: Signals, needed: Sequence[str], vehicle: Vehicle | None = None) -> None:
    """Checks that a log has the signals needed.

    Args:
        vehicle: where it has a `dbc`, the message names its [signals] table in place of J1939 messages.

    Raises:
        OncenterError: code "missing_signal"; names each missing signal, its usual source, and the signals found.
    """
    missing = [name for name in needed if SIGNALS[name].column not in signals.columns]
    if not missing:
        return
    log = Path(signals.log).name
    found = _found(signals)
    columns = any(source.description.startswith(_NO_FRAMES) for source in signals.sources.values())
    why = [note for note in signals.notes if note.split(":")[0] in missing]
    if vehicle is not None and vehicle.dbc and not columns:
        homes = "; ".join(f"no {_spoken(name)}" for name in missing)
        assign = f"assign {', '.join(missing)} in [signals] of {vehicle.origin or 'the vehicle file'}"
    else:
        homes = "; ".join(f"no {_spoken(name)} ({_home(name, columns)})" for name in missing)
        what = "assign columns" if columns else "give the network's DBC with --dbc and assign its signals"
        assign = f"{what} in the [signals] table of a vehicle file"
    remedy = [] if why else [assign]
    raise OncenterError(
        "; ".join([f"{homes} in {log}", *why, f"{FOUND}{found}", *remedy]),
        code="missing_signal",
        needs=tuple(missing),
    )


def _found(signals: Signals) -> str:
    by_source: dict[str, list[str]] = {}
    for name, source in signals.sources.items():
        by_source.setdefault(source.description, []).append(name)
    return "; ".join(f"{', '.join(names)} from {description}" for description, names in by_source.items())


def _spoken(signal: str) -> str:
    return signal.replace("_", " ")


def _home(signal: str, in_columns: bool) -> str:
    from oncenter.read import j1939  # late import: it builds its tables, and few logs lack a signal

    in_j1939 = "" if in_columns else j1939.home(signal)
    return in_j1939 or "column " + " or ".join(possible_columns(signal))


def refuse_unreadable(path: Path) -> None:
    """Refuses a folder, a device, a pipe, a file that cannot be opened, is empty or hardly written, and text that
    oncenter wrote."""
    refuse_what_is_no_regular_file(path)
    try:
        with open_regular_file(path) as file:
            refuse_sparse(path.name, os.fstat(file.fileno()))
            head = file.read(HEAD_BYTES)
            if not head:
                raise OncenterError(f"{path.name} is empty (0 bytes)", code="empty_log")
            refuse_own_text(path, head)
    except (OSError, ValueError) as error:
        raise cannot_read(path, error) from error
