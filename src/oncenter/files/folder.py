"""Finds files below folders, and which of them are named like a log."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator, Sequence

from oncenter.files.log_formats import SUFFIXES
from oncenter.files.whole_file import UNFINISHED

_BAG_MARK = "metadata.yaml"
BAG_PARTS = (".mcap", ".db3", ".mcap.zstd", ".db3.zstd")


def is_log(name: str) -> bool:
    """Whether a file is a log, by its name."""
    return name.lower().endswith(SUFFIXES) and not name.startswith(UNFINISHED)


def is_bag_folder(path: str | os.PathLike[str]) -> bool:
    """Whether a folder is one ROS 2 recording: its parts beside their metadata."""
    try:
        names = os.listdir(path) if os.path.isdir(path) else []
    except (OSError, ValueError):  # reading reports the error
        return False
    return _BAG_MARK in names and any(name.endswith(BAG_PARTS) for name in names)


def files_below(folders: Sequence[str]) -> Iterator[tuple[str, bool]]:
    """The paths of all files at any depth, each with False, one folder in memory at a time; with True, a folder that
    cannot be listed.

    Each real folder is visited once, so that circular links end. Links are followed last, so that a file gets the name
    of its real folder if that is also found.
    """
    waiting, links = list(folders), deque[str]()
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
            yield folder, True
            continue
        for entry in entries:
            if _is_folder(entry):
                (links if entry.is_symlink() else waiting).append(entry.path)
            else:
                yield entry.path, False


def _is_folder(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_dir()
    except OSError:  # a link to itself
        return False
