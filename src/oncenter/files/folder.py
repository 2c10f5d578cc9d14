"""Finds files below folders, and which of them are named like a log."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator, Sequence
from typing import Final, Literal, NamedTuple

from oncenter.files.packed_names import has_log_name
from oncenter.files.whole_file import UNFINISHED

_BAG_MARK = "metadata.yaml"
UNLISTED: Final = "unlisted"  # a folder that cannot be listed
OUTSIDE: Final = "outside"  # a link that leads out of the folder
Fault = Literal["", "unlisted", "outside"]
BAG_PARTS = (".mcap", ".db3", ".mcap.zstd", ".db3.zstd")


def is_log(name: str) -> bool:
    """Whether a file is a log, by its name, packed or not; a ZIP archive may hold some."""
    return has_log_name(name) and not name.startswith(UNFINISHED)


def is_bag_folder(path: str | os.PathLike[str]) -> bool:
    """Whether a folder is one ROS 2 recording: its parts beside their metadata."""
    try:
        names = os.listdir(path) if os.path.isdir(path) else []
    except (OSError, ValueError):  # reading reports the error
        return False
    return _BAG_MARK in names and any(name.endswith(BAG_PARTS) for name in names)


class Found(NamedTuple):
    """A file below a folder; with a fault a folder or a link that is not followed."""

    path: str
    fault: Fault = ""


def files_below(folders: Sequence[str]) -> Iterator[Found]:
    """All files at any depth, one folder in memory at a time.

    Each real folder is visited once, so that circular links end. Links are followed last, so that a file gets the name
    of its real folder if that is also found. A link that leads out of the folders is not followed: who may write into
    one of them may not choose what is read elsewhere.
    """
    waiting, links = list(folders), deque[str]()
    inside = [os.path.realpath(folder) for folder in folders]
    walked: set[tuple[int, int] | str] = set()
    while waiting or links:
        folder = waiting.pop() if waiting else links.popleft()
        try:
            status = os.stat(folder)
            # some network shares have no inode numbers
            own = (status.st_dev, status.st_ino) if status.st_ino else os.path.realpath(folder)
            if own in walked:
                continue
            walked.add(own)
            with os.scandir(folder) as listed:
                entries = sorted(listed, key=lambda entry: entry.name)
        except OSError:
            yield Found(folder, UNLISTED)
            continue
        for entry in entries:
            if entry.is_symlink() and leads_out(entry.path, inside):
                yield Found(entry.path, OUTSIDE)
            elif _is_folder(entry):
                (links if entry.is_symlink() else waiting).append(entry.path)
            else:
                yield Found(entry.path)


def leads_out(path: str, inside: Sequence[str]) -> bool:
    """Whether a path has its real place outside all of these folders, which are real themselves."""
    real = os.path.realpath(path)
    return not any(real.startswith(os.path.join(folder, "")) or real == folder for folder in inside)


def _is_folder(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_dir()
    except OSError:  # a link to itself
        return False
