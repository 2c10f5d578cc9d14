"""Plug-ins: an installed package adds a log format by an entry point.

The group is `oncenter.readers`. An entry point's name is the suffix of the files that it reads, as `.acme`. A name
without a leading dot is for drives stored as folders: the name of a file or folder in them, as `processed_log`. A
plug-in is loaded only when such a log is read, and never for a format that this package reads itself.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from oncenter.errors import OncenterError
from oncenter.files.folder import is_bag_folder
from oncenter.files.log_formats import FORMATS, HEAD_BYTES, SUFFIXES, Format, format_of_content, recognised
from oncenter.files.other_files import described, other_kind
from oncenter.files.regular_file import open_regular_file
from oncenter.read.wording import cannot_read

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "oncenter.readers"


def plugin_for(path: Path) -> EntryPoint | None:
    """The plug-in that reads a log; None if this package reads it, or if there is none.

    Raises:
        OncenterError: "plugin_ambiguous": two packages read it.
    """
    name = path.name.lower()
    if name.endswith(SUFFIXES) or is_bag_folder(path):
        return None
    having = [point for point in _installed() if _is_of(point.name, path, name)]
    if not having:
        return None
    longest = max(len(point.name) for point in having)
    first, *others = (point for point in having if len(point.name) == longest)
    if any(other.value != first.value for other in others):
        packages = " and ".join(map(called, (first, *others)))
        raise OncenterError(f"{path.name} can be read by {packages}: uninstall all but one", code="plugin_ambiguous")
    return first


def suffixes_of_plugins() -> list[str]:
    return sorted({point.name for point in _installed() if point.name.startswith(".")})


def known_format(path: Path) -> Format:
    """The format of a file, by its content before its name.

    Raises:
        OncenterError: "unknown_format": this package does not read such files; "unreadable_log": it cannot be opened.
    """
    try:
        with open_regular_file(path) as file:
            head = file.read(HEAD_BYTES)
    except (OSError, ValueError) as error:
        raise cannot_read(path, error) from error
    found = recognised(head, path.name)
    other = "" if found is not None else other_kind(head)
    found = found if found is not None or other else format_of_content(head, path.name)
    if found is not None:
        return found
    tried = ", ".join(dict.fromkeys(re.split(r"; |, without", row.origin)[0] for row in FORMATS))
    known = ", ".join((*SUFFIXES, *suffixes_of_plugins()))
    raise OncenterError(
        f"cannot read {path.name or path}: it seems to be {other or described(head)}, and is none of the logs that "
        f"oncenter recognises ({tried}); export the log as one of {known}",
        code="unknown_format",
    )


def _installed() -> tuple[EntryPoint, ...]:
    from importlib.metadata import entry_points  # late import: most logs need no plug-in

    return tuple(entry_points(group=GROUP))


def _is_of(mark: str, path: Path, name: str) -> bool:
    if mark.startswith("."):
        return name.endswith(mark.lower()) and not path.is_dir()
    return path.is_dir() and (path / mark).exists()


def called(plugin: EntryPoint) -> str:
    package = plugin.dist.name if plugin.dist is not None else plugin.module
    return f"the plug-in {package}"
