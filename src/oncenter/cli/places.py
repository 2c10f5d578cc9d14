"""The logs of a command line, named directly or by their folder."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from oncenter.cli.standard_input import STANDARD_INPUT
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.folder import OUTSIDE, files_below, is_bag_folder, is_log
from oncenter.files.log_formats import ANY_TEXT, HEAD_BYTES, SUFFIXES, format_of_content
from oncenter.files.other_files import other_kind
from oncenter.files.packed_names import has_log_name, packing_of
from oncenter.files.regular_file import open_regular_file
from oncenter.read.plugins import plugin_for

_ENDINGS_SHOWN = 5
_DIGITS = re.compile(r"(\d+)")


@dataclass(frozen=True)
class Places:
    """The logs that a command line names.

    Attributes:
        logs: each once; of folders in order of their names, numbers in them by value.
        has_folder: whether a folder was named, so that the user gave no order.
        twice: logs that are named more than once.
        unlisted: errors for folders that cannot be listed, and for links that lead out of the folders.
        notes: on files that were skipped.
    """

    logs: tuple[Path, ...]
    has_folder: bool
    twice: tuple[Path, ...]
    unlisted: tuple[OncenterError, ...]
    notes: tuple[str, ...]


def logs_named(given: Sequence[Path]) -> Places:
    """The logs of an option that takes no folders."""
    return Places(tuple(dict.fromkeys(given)), False, _twice(given), (), ())


def logs_at(names: Sequence[str]) -> Places:
    """All logs in folders, at any depth, and those that are named directly.

    Raises:
        OncenterError: "no_such_log": only folders are given, and they hold no log; "usage", exit code 2: a name is
            empty, which as a path would be the current folder.
    """
    if "" in names:
        raise OncenterError(
            "a LOG has an empty name, for example from a shell variable that is not set; for the current folder give .",
            code="usage",
            exit_code=WRONG_USAGE,
        )
    given = [Path(name) for name in names]
    folders = [place for place in given if os.path.isdir(place) and not (is_bag_folder(place) or plugin_for(place))]
    named = [log for place in given if place not in folders for log in _in_archive(place)]
    below = list(files_below([os.fspath(folder) for folder in folders]))
    unlisted = tuple(_outside(path) if fault == OUTSIDE else _unlisted(path) for path, fault in below if fault)
    files = [path for path, fault in below if not fault]
    are_logs = {path: is_log(os.path.basename(path)) or _is_text_log(path) for path in files}
    in_folders = [log for path, is_one in are_logs.items() if is_one for log in _in_archive(Path(path))]
    found = sorted(in_folders, key=_by_name)
    skipped = [Path(path) for path, is_one in are_logs.items() if not is_one]
    logs = [log for log in named if not _is_other_file(log)]
    skipped += [log for log in named if _is_other_file(log)]
    if not logs and not found:
        if not folders:  # reading gives the reason for each
            return logs_named(named)
        raise _without_logs(folders, len(skipped), unlisted)
    has_folder = bool(folders) or len(logs) > len(given)
    every = sorted({*logs, *found}, key=_by_name) if has_folder else list(dict.fromkeys(logs))
    return Places(tuple(every), has_folder, _twice(logs), unlisted, _notes(skipped))


def _in_archive(path: Path) -> list[Path]:
    """The logs of a ZIP archive with several; else the path itself."""
    if path == STANDARD_INPUT or not os.path.isfile(path) or packing_of(_head_of(path), path.name) != "zip":
        return [path]
    from oncenter.read.apart import logs_of_archive  # late import: few logs are in archives

    try:
        logs = logs_of_archive(path)
    except OncenterError:  # reading reports it
        return [path]
    return [path / log for log in logs] if len(logs) > 1 else [path]


def _by_name(path: Path) -> list[str | int]:
    """`drive2` before `drive10`."""
    return [int(part) if place % 2 else part for place, part in enumerate(_DIGITS.split(str(path)))]


def _is_other_file(path: Path) -> bool:
    is_file = path != STANDARD_INPUT and os.path.isfile(path)
    if not is_file or has_log_name(path.name) or plugin_for(path) is not None:
        return False
    head = _head_of(path)
    if packing_of(head, path.name):
        return False
    return bool(other_kind(head)) or format_of_content(head, path.name) is None


def _is_text_log(path: str) -> bool:
    """Whether a file of a folder with the usual ending of any text is a log by its content."""
    if not path.lower().endswith(ANY_TEXT):
        return False
    found = format_of_content(_head_of(Path(path)), path)
    return found is not None and found.suffixes[0] != ".csv"


def _head_of(path: Path) -> bytes:
    """The first bytes of a file; none of one that cannot be read, for which reading gives the reason."""
    try:
        with open_regular_file(path) as file:
            return file.read(HEAD_BYTES)
    except (OSError, ValueError):
        return b""


def _twice(named: Sequence[Path]) -> tuple[Path, ...]:
    return tuple(log for k, log in enumerate(named) if log in named[:k])


def _unlisted(folder: str) -> OncenterError:
    try:
        os.scandir(folder).close()
        why = ""
    except OSError as error:
        why = f": {error.strerror}"
    return OncenterError(f"cannot list the folder {folder}{why}", code="unreadable_folder")


def _outside(link: str) -> OncenterError:
    return OncenterError(
        f"{link} is a link that leads out of its folder: name {os.path.realpath(link)} as well", code="not_a_file"
    )


def _without_logs(folders: Sequence[Path], others: int, unlisted: Sequence[OncenterError]) -> OncenterError:
    if unlisted:
        return unlisted[0]
    there = f" among {others} {_files(others)}" if others else ""
    names = ", ".join(str(folder) for folder in folders)
    return OncenterError(f"no logs in {names}{there}: oncenter reads {', '.join(SUFFIXES)}", code="no_such_log")


def _notes(skipped: Sequence[Path]) -> tuple[str, ...]:
    if not skipped:
        return ()
    endings = sorted({_ending(path.name) for path in skipped})
    more = ", …" if len(endings) > _ENDINGS_SHOWN else ""
    count = len(skipped)
    verb = "is not a log and was" if count == 1 else "are not logs and were"
    return (f"{count} {_files(count)} {verb} skipped: {', '.join(endings[:_ENDINGS_SHOWN])}{more}",)


def _ending(name: str) -> str:
    return f".{name.lower().rpartition('.')[2]}" if "." in name else name


def _files(count: int) -> str:
    return "file" if count == 1 else "files"
