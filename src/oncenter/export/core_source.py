"""The core as it lies in the package."""

from __future__ import annotations

from pathlib import Path

import oncenter

CORE = Path(oncenter.__file__).parent / "core"
LICENCE = Path(__file__).with_name("LICENSE")


def core_files() -> list[Path]:
    """All files of core/, by name."""
    return sorted(CORE.glob("*.[ch]"))
