"""The core's files in the package."""

from __future__ import annotations

from pathlib import Path

from oncenter.files.shipped import shipped

CORE = shipped("core")
LICENCE = shipped("LICENSE")


def core_files() -> list[Path]:
    """All files of core/, by name."""
    return sorted(CORE.glob("*.[ch]"))
