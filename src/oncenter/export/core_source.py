"""The core as it lies in the package: its files, and what its own text says of the params.

The header's comments are the one description of a param and are read here, so that no description file repeats them.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import oncenter
from oncenter import _core
from oncenter.param_ranges import param_ranges

CORE = Path(oncenter.__file__).parent / "core"
LICENCE = Path(__file__).with_name("LICENSE")

# What a name ends in, and the unit that is; the longest first.
_UNITS = {
    "_rad_m_s2": "rad/(m/s2)",
    "_rad_s2": "rad/s2",
    "_rad_s": "rad/s",
    "_m2_s2": "m2/s2",
    "_s2_m": "s2/m",
    "_m_s2": "m/s2",
    "_m_s": "m/s",
    "_1_m": "1/m",
    "_rad": "rad",
    "_hz": "Hz",
    "_m": "m",
    "_s": "s",
    "_1": "1",
}


@dataclass(frozen=True)
class Param:
    """One double of oc_params: its unit, what its header says of it, and the range that the core accepts."""

    name: str
    unit: str
    about: str
    low: float
    high: float


def core_files() -> list[Path]:
    """All files of core/, by name."""
    return sorted(CORE.glob("*.[ch]"))


def params() -> list[Param]:
    """The doubles of oc_params in the order of the struct; where a range depends on another param, its widest."""
    about = _comments((CORE / "params.h").read_text(encoding="utf-8"))
    ranges = param_ranges()
    names = [name for name in _core.default_params() if name != "use_accelerometer"]
    return [Param(name, _unit(name), about.get(name, ""), *ranges[name]) for name in names]


def _unit(name: str) -> str:
    return next(unit for ending, unit in _UNITS.items() if name.endswith(ending))


def _comments(header: str) -> dict[str, str]:
    """By member, the comment that begins on its line."""
    found = re.findall(r"^ +\w+ (\w+);[ \t]*/\*(.*?)\*/", header, re.MULTILINE | re.DOTALL)
    return {name: re.sub(r"\s*\n\s*\* ?|\s+", " ", text).strip() for name, text in found}
