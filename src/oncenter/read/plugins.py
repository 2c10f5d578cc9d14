"""Plug-ins: an installed package adds a log format by an entry point.

The group is `oncenter.readers`. An entry point's name is the suffix of the files that it reads, as `.acme`. A name
without a leading dot is for drives stored as folders: the name of a file or folder in them, as `processed_log`. A
plug-in is loaded only when such a log is read, and never for a format that this package reads itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from oncenter.errors import OncenterError
from oncenter.files.folder import is_bag_folder
from oncenter.files.log_formats import SUFFIXES, Format, format_of
from oncenter.signals import SignalName

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from oncenter.read.identity import Identity
    from oncenter.read.samples import Samples

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
        packages = " and ".join(map(_called, (first, *others)))
        raise OncenterError(f"{path.name} can be read by {packages}: uninstall all but one", code="plugin_ambiguous")
    return first


def suffixes_of_plugins() -> list[str]:
    return sorted({point.name for point in _installed() if point.name.startswith(".")})


def known_format(path: Path) -> Format:
    """
    Raises:
        OncenterError: "unknown_format": this package does not read such files.
    """
    found = format_of(path.name)
    if found is not None:
        return found
    known = ", ".join((*SUFFIXES, *suffixes_of_plugins()))
    raise OncenterError(
        f"cannot read {path.name or path}: unknown format; export the log as one of {known}",
        code="unknown_format",
    )


def read_plugin(
    path: Path, plugin: EntryPoint, names: Mapping[str, SignalName], notes: list[str]
) -> tuple[list[Samples], Identity]:
    """Signals of a log that a plug-in reads, and its truck, by the rules for CSV files.

    Raises:
        OncenterError: "plugin_failed": it raised, or returned no table; else as `oncenter.read` of a CSV file.
    """
    from oncenter.read.dataframe import NoTable, samples_of_frame

    try:
        frame: Any = plugin.load()(path)
    except (Exception, SystemExit) as error:
        first = (str(error).splitlines() or [""])[0][:200]
        what = str(error) if isinstance(error, OncenterError) else f"{type(error).__name__}: {first}"
        raise OncenterError(
            f"cannot read {path.name}: {_called(plugin)} failed: {what}", code="plugin_failed"
        ) from error
    try:
        return samples_of_frame(frame, path, names, notes)
    except NoTable as wrong:
        raise OncenterError(
            f"cannot read {path.name}: {_called(plugin)} returned no usable table: {wrong}", code="plugin_failed"
        ) from None


def _installed() -> tuple[EntryPoint, ...]:
    from importlib.metadata import entry_points  # late import: most logs need no plug-in

    return tuple(entry_points(group=GROUP))


def _is_of(mark: str, path: Path, name: str) -> bool:
    if mark.startswith("."):
        return name.endswith(mark.lower()) and not path.is_dir()
    return path.is_dir() and (path / mark).exists()


def _called(plugin: EntryPoint) -> str:
    package = plugin.dist.name if plugin.dist is not None else plugin.module
    return f"the plug-in {package}"
