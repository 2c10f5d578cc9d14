"""A log becomes a `Signals`, and nothing else. One format a file; `clock` brings many rates to one tick."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from oncenter.errors import OncenterError
from oncenter.read import candump, choose, clock, j1939, mf4, python_can, tabular
from oncenter.read import dbc as databases
from oncenter.read.frames import Kept, Wanted, keep
from oncenter.read.samples import Samples
from oncenter.read.units import columns_that_would_do
from oncenter.signals import SIGNALS, SignalName, Signals

SUFFIXES = (".log", ".asc", ".blf", ".trc", ".mf4", ".mdf", ".csv", ".csv.gz", ".parquet")

__all__ = ["SUFFIXES", "read", "require"]


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
    suffix = _suffix(path)
    _refuse_unreadable(path)
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


def _refuse_unreadable(path: Path) -> None:
    try:
        if path.is_dir():
            raise OncenterError(f"{path} is a directory, not a log", code="unreadable_log")
        with path.open("rb") as file:
            if not file.read(1):
                raise OncenterError(f"{path.name} is empty", code="empty_log")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise OncenterError(f"cannot read {path}: {reason}", code="unreadable_log") from error


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
    described_pgns = frozenset(definition.pgn for definition in described if definition.pgn is not None)
    standard_ids = frozenset(definition.message.frame_id for definition in described if definition.pgn is None)
    wanted = Wanted(frozenset(j1939.MESSAGES) | described_pgns, standard_ids)
    decoded: list[Samples] = []
    if suffix == ".log":
        kept = keep(candump.chunks(path, notes, tell), wanted)
    elif suffix in (".mf4", ".mdf"):
        kept, decoded = mf4.read(path, names, wanted, notes, tell)
    else:
        kept = keep(python_can.chunks(path, suffix, tell), wanted)
    by_dbc = databases.samples(kept, described)
    described_signals = {(samples.signal, samples.kind) for samples in by_dbc}
    known = [samples for samples in j1939.samples(kept) if (samples.signal, samples.kind) not in described_signals]
    candidates = by_dbc + decoded + known
    if not candidates:
        raise _nothing_known(path, kept)
    return candidates


def _nothing_known(path: Path, kept: Kept) -> OncenterError:
    if kept.total == 0:
        return OncenterError(f"no CAN data frames in {path.name}", code="empty_log")
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
    notes += _about_sensor_type(chosen)
    table, rate = clock.to_one_tick(chosen, path.name, notes)
    if table.height < 2:
        raise OncenterError(f"{path.name} has {table.height} ticks, at least 2 are needed", code="too_short")
    return Signals(table, sources, rate, os.fspath(path), tuple(notes))


def _about_sensor_type(chosen: Sequence[Samples]) -> list[str]:
    for samples in chosen:
        if samples.signal == "steering_wheel_angle_sensor_type" and (samples.values == 0).any():
            return [
                "the steering wheel angle sensor is relative (SPN 1812 is 0): its angle may be off by whole turns "
                "after each ignition, so the offset is known modulo 360 deg only"
            ]
    return []
