"""A log becomes a `Signals`, and nothing else. One format a file; `clock` brings many rates to one tick."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from oncenter.errors import OncenterError
from oncenter.read import blf, candump, choose, clock, j1939, mf4, python_can, tabular
from oncenter.read import dbc as databases
from oncenter.read.decode import decode, wanted_by
from oncenter.read.frames import Kept, keep
from oncenter.read.samples import Samples
from oncenter.read.units import columns_that_would_do
from oncenter.signals import SIGNALS, SignalName, Signals

SUFFIXES = (".log", ".asc", ".blf", ".trc", ".mf4", ".mdf", ".csv", ".csv.gz", ".parquet")

__all__ = ["SUFFIXES", "read", "refuse_unreadable", "refuse_what_is_no_file", "require"]


def read(
    path: str | os.PathLike[str],
    *,
    names: Mapping[str, SignalName] | None = None,
    dbc: Sequence[str | os.PathLike[str]] = (),
    take: Mapping[str, str] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Signals:
    """The signals of a log, as many of `oncenter.signals.SIGNALS` as it has.

    Args:
        path: a candump `.log`, `.asc`, `.blf`, `.trc`, `.mf4`, `.mdf`, `.csv`, `.csv.gz` or `.parquet`.
        names: how this log calls signals and "time", where not as we do (a vehicle file's `[signals]` table).
        dbc: databases beside the J1939 messages that are known anyway.
        take: by signal, or "all", the source to take: an address "0x3E", a message "VDC2", or both.
        progress: is told the fraction read, 0 to 1, now and then.

    Raises:
        OncenterError: the log cannot be read, has no known signal, or has two that disagree.
    """
    path = Path(path)
    refuse_what_is_no_file(path)
    suffix = _suffix(path)
    refuse_unreadable(path)
    tell = progress or (lambda fraction: None)
    notes: list[str] = []
    tell(0.0)
    if suffix in (".csv", ".csv.gz"):
        candidates = tabular.read_csv(path, names or {}, notes)
    elif suffix == ".parquet":
        candidates = tabular.read_parquet(path, names or {}, notes)
    else:
        candidates = _from_bus(path, suffix, names or {}, dbc, notes, tell)
    signals = _signals(path, candidates, take or {}, notes)
    tell(1.0)
    return signals


def require(signals: Signals, needed: Sequence[str]) -> None:
    """Refuses a log that lacks a signal.

    Raises:
        OncenterError: code "missing_signal"; names each missing signal, where it would be, and what there is.
    """
    missing = [name for name in needed if SIGNALS[name].column not in signals.table.columns]
    if not missing:
        return
    log = Path(signals.log).name
    found = _found(signals)
    columns = any(source.description.startswith("column ") for source in signals.sources.values())
    homes = "; ".join(f"no {_spoken(name)} ({_home(name, columns)})" for name in missing)
    why = [note for note in signals.notes if note.split(":")[0] in missing]
    raise OncenterError(
        "; ".join([f"{homes} in {log}", *why, f"found: {found}"]),
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
    in_j1939 = "" if in_columns else j1939.home(signal)
    return in_j1939 or "column " + " or ".join(columns_that_would_do(signal))


def _suffix(path: Path) -> str:
    name = path.name.lower()
    for suffix in SUFFIXES:
        if name.endswith(suffix):
            return suffix
    raise OncenterError(
        f"{path.name or path} is no log that can be read: known are {', '.join(SUFFIXES)}", code="unknown_format"
    )


def refuse_what_is_no_file(path: Path) -> None:
    """A directory, a device, or a pipe, in which no reader could go back."""
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError) as error:
        raise _cannot_read(path, error) from error
    if not stat.S_ISREG(mode):
        what = "is a directory, not a log" if stat.S_ISDIR(mode) else "is a device or a pipe, not a file"
        raise OncenterError(f"{path} {what}", code="unreadable_log")


def refuse_unreadable(path: Path) -> None:
    """A file that cannot be opened, or is empty."""
    try:
        with path.open("rb") as file:
            if not file.read(1):
                raise OncenterError(f"{path.name} is empty", code="empty_log")
    except (OSError, ValueError) as error:
        raise _cannot_read(path, error) from error


def _cannot_read(path: Path, error: Exception) -> OncenterError:
    reason = getattr(error, "strerror", None) or str(error)
    return OncenterError(f"cannot read {path}: {reason}", code="unreadable_log")


def _from_bus(
    path: Path,
    suffix: str,
    names: Mapping[str, SignalName],
    dbc: Sequence[str | os.PathLike[str]],
    notes: list[str],
    tell: Callable[[float], None],
) -> list[Samples]:
    """Signals of a log of frames: what a DBC says about a message comes before what we know about it."""
    described = databases.definitions(dbc, names, notes)
    wanted = wanted_by(described)
    decoded: list[Samples] = []
    if suffix == ".log":
        kept = keep(candump.chunks(path, notes, tell), wanted)
    elif suffix == ".blf":
        kept = keep(blf.chunks(path, notes, tell), wanted)
    elif suffix in (".mf4", ".mdf"):
        kept, decoded = mf4.read(path, names, wanted, notes, tell)
    else:
        kept = keep(python_can.chunks(path, suffix, notes, tell), wanted)
    candidates = decode(kept, described, decoded)
    if not candidates:
        raise _nothing_known(path, kept, described, notes)
    return candidates


def _nothing_known(
    path: Path, kept: Kept, described: Sequence[databases.Definition], notes: Sequence[str]
) -> OncenterError:
    if kept.total == 0:
        flexible = "" if path.suffix.lower() == ".blf" else " (CAN FD is not read)"
        why = f": {'; '.join(notes)}" if notes else ""
        return OncenterError(f"no CAN data frames in {path.name}{flexible}{why}", code="empty_log")
    if described:
        messages = ", ".join(f"{d.message.name} (0x{d.message.frame_id:X})" for d in described)
        return OncenterError(
            f"{path.name} has none of the messages in which the DBC has our signals: {messages}",
            code="missing_signal",
            needs=("steering_wheel_angle", "yaw_rate", "vehicle_speed"),
        )
    if kept.standard_frames == kept.total and notes:
        return OncenterError(f"no known signal in {path.name}: {'; '.join(notes)}", code="not_j1939")
    if kept.standard_frames == kept.total:
        return OncenterError(
            f"{path.name} has only 11-bit identifiers ({kept.total} frames): that is not J1939; give a DBC with --dbc",
            code="not_j1939",
        )
    return OncenterError(
        f"no steering wheel angle ({j1939.home('steering_wheel_angle')}) and no other known signal in {path.name}; "
        f"found: PGN {j1939.found_groups(kept)}",
        code="missing_signal",
        needs=("steering_wheel_angle", "yaw_rate", "vehicle_speed"),
    )


def _signals(path: Path, candidates: Sequence[Samples], take: Mapping[str, str], notes: list[str]) -> Signals:
    clock.refuse_time_out_of_range(candidates, path.name)
    chosen, sources = choose.choose(candidates, take, path.name, notes)
    if not chosen:
        raise OncenterError(
            f"no signal in {path.name} ever has a number: {'; '.join(notes)}",
            code="missing_signal",
            needs=tuple(dict.fromkeys(samples.signal for samples in candidates)),
        )
    table, rate = clock.to_one_tick(chosen, path.name, notes)
    if table.height < 2:
        raise OncenterError(f"{path.name} has {table.height} ticks, at least 2 are needed", code="too_short")
    return Signals(table, sources, rate, os.fspath(path), tuple(notes))
