"""The vehicle files that come with oncenter."""

from __future__ import annotations

from pathlib import Path

from oncenter.files.shipped import shipped


def shipped_files() -> list[Path]:
    """The shipped files in order of their names."""
    return sorted(shipped("vehicles").glob("*.toml"))


def shipped_names() -> list[str]:
    """The names that `--vehicle` takes."""
    return [path.stem for path in shipped_files()]
