"""The core's files in the package."""

from __future__ import annotations

from pathlib import Path

from oncenter.files.shipped import shipped

CORE = shipped("core")
LICENCE = shipped("LICENSE")


def core_files() -> list[Path]:
    """All C files of core/, by name: no two have the same."""
    return sorted(CORE.glob("*/*.[ch]"), key=lambda file: file.name)
