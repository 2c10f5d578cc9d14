"""Names that a shell completes for arguments and options. Each is called while a user types: it must be quick."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator

from oncenter.files.shipped import shipped
from oncenter.signals import SIGNALS


def vehicle_files(incomplete: str) -> list[str]:
    """Shipped vehicle files by name, and vehicle files by path."""
    return [*_shipped("vehicles", incomplete), *_toml_files(incomplete)]


def scenarios(incomplete: str) -> list[str]:
    """Shipped scenarios by name, and scenario files by path."""
    return [*_shipped("scenarios", incomplete), *_toml_files(incomplete)]


def signal_names(incomplete: str) -> list[str]:
    """Signals, each with the = that its value follows."""
    return _beginning((f"{name}=" for name in SIGNALS), incomplete)


def explained_codes(incomplete: str) -> list[str]:
    """Codes of findings and errors, from the headings of their page."""
    try:
        page = shipped("docs/reference/findings.md").read_text(encoding="utf-8")
    except OSError:
        return []
    return _beginning(dict.fromkeys(re.findall(r"^## (\w+)$", page, re.MULTILINE)), incomplete)


def _beginning(names: Iterable[str], incomplete: str) -> list[str]:
    return sorted(name for name in names if name.startswith(incomplete))


def _shipped(folder: str, incomplete: str) -> list[str]:
    return _beginning((path.stem for path in shipped(folder).glob("*.toml")), incomplete)


def _toml_files(incomplete: str) -> list[str]:
    """A single folder is replaced by its content: else the shell would end the word behind the folder's name."""
    found = sorted(_paths(incomplete))
    while len(found) == 1 and found[0].endswith(os.sep):
        inside = sorted(_paths(found[0]))
        if not inside:
            break
        found = inside
    return found


def _paths(incomplete: str) -> Iterator[str]:
    folder, begin = os.path.split(incomplete)
    try:
        with os.scandir(folder or ".") as entries:
            for entry in entries:
                if not entry.name.startswith(begin) or (entry.name.startswith(".") and not begin):
                    continue
                path = os.path.join(folder, entry.name)
                if entry.is_dir():
                    yield path + os.sep
                elif entry.name.endswith(".toml"):
                    yield path
    except OSError:  # no such folder, or not ours to list: nothing to complete
        return
