"""A new vehicle file: its text from values, and proposals for `[signals]` from databases and a log."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from oncenter.errors import OncenterError
from oncenter.files.log_formats import OF_TABLES
from oncenter.files.toml_file import parsed_toml
from oncenter.read import refuse_unreadable
from oncenter.read.apart import names_in
from oncenter.read.named import Named
from oncenter.vehicle import vehicle_from
from oncenter.vehicle_file.by_log import decided_by_log
from oncenter.vehicle_file.check import NEEDED
from oncenter.vehicle_file.proposals import Proposal, proposals, time_proposal
from oncenter.vehicle_file.written import vehicle_text


def new_vehicle_file(output: Path, values: Mapping[str, Any], proposed: Sequence[Proposal]) -> str:
    """The text of a vehicle file.

    Args:
        output: the file to be, for messages and as the truck's name where `values` has none.
        values: as a vehicle file holds them, with paths of the current folder in "dbc".
        proposed: entries of `[signals]`.

    Raises:
        OncenterError: "vehicle_file", exit code 2: a value is missing or out of its range.
    """
    named = {"name": output.stem, **values}
    if "dbc" in named:
        named["dbc"] = [_from_folder(output.parent, path) for path in named["dbc"]]
    vehicle_from(named, str(output))
    text = vehicle_text(named, proposed)
    vehicle_from(parsed_toml(text, f"vehicle file {output}", code="vehicle_file"), str(output))  # as it will be read
    return text


def _from_folder(folder: Path, path: str) -> str:
    """A relative path of a vehicle file is relative to its folder."""
    return path if os.path.isabs(path) else Path(os.path.relpath(path, folder)).as_posix()


def proposals_for(
    databases: Sequence[Path],
    log: Path | None,
    given: Collection[str] = (),
    progress: Callable[[float], None] = lambda fraction: None,
) -> tuple[list[Proposal], list[str]]:
    """Proposals from the columns or channels of a log and from databases; with a log those that move in it as their
    quantity does.

    Args:
        given: signals that have an entry already.
        progress: called now and then while the log is read, each time from 0 to 1; what it raises ends the reading.

    Returns:
        The proposals, and notes for people.

    Raises:
        OncenterError: a file cannot be read.
    """
    if log is not None and not os.path.isdir(log):
        refuse_unreadable(log)
    columns = [] if log is None else names_in(log, "log")
    signals = [name for database in databases for name in names_in(database, "database")]
    if not columns and not signals:
        return [], []
    time = time_proposal(columns) if log is not None and log.name.lower().endswith(OF_TABLES) else None
    proposed = [*([] if time is None else [time]), *proposals([*columns, *signals])]
    if log is None:
        return proposed, _not_found({*given, *(each.signal for each in proposed)})
    return _in_log(log, databases, proposed, given, signals, progress, in_table=bool(columns))


def _not_found(found: Collection[str]) -> list[str]:
    missing = [name for name in NEEDED if name not in found]
    return [f"{', '.join(missing)}: no name fits; add an entry to [signals]"] if missing else []


def _in_log(
    log: Path,
    databases: Sequence[Path],
    proposed: list[Proposal],
    given: Collection[str],
    named: Sequence[Named],
    progress: Callable[[float], None],
    *,
    in_table: bool,
) -> tuple[list[Proposal], list[str]]:
    try:
        found, drive, notes = decided_by_log(log, databases, proposed, named, progress)
    except OncenterError as error:
        if in_table:
            return proposed, [f"{log.name} cannot be read with the proposed signals: {error}"]
        if error.code in ("missing_signal", "not_j1939"):
            return proposed, [f"{log.name} has none of the proposed signals: {error}"]
        raise
    names = [each.signal for each in found]
    unnamed = [signal for signal in drive.sources if signal not in names]
    notes += [f"{', '.join(unnamed)}: found in {log.name} without an entry in [signals]"] if unnamed else []
    return found, [*notes, *_not_found({*given, *names, *drive.sources})]
