"""The params of the core from core/params.toml, the table from which its C code is written, too."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache

from oncenter.files.shipped import shipped


@dataclass(frozen=True)
class Param:
    """One double of oc_params.

    Attributes:
        about: meaning, default and source.
        low, high: limits of the core, in `unit`; if a limit depends on another param, the widest.
    """

    name: str
    unit: str
    about: str
    low: float
    high: float


@cache
def params() -> dict[str, Param]:
    """The params by name, in the order of the struct."""
    table = (shipped("core") / "params.toml").read_text(encoding="utf-8")
    rows = [row for group in tomllib.loads(table).values() for row in group.items() if row[0] != "title"]
    return {
        name: Param(name, row["unit"], f"{row['meaning']}. {row['default']}, {row['source']}", *row["range"])
        for name, row in rows
    }
