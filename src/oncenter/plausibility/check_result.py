"""Result of a check: a finding, None, or not judged, with the missing evidence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oncenter.findings import Finding
from oncenter.plausibility.grid_signals import MIN_TIME_S, ROLLING_M_S, GridSignals

NO_OFFSET = "The offset cannot be estimated with it"
SIGNALS_TABLE = "the [signals] table of the vehicle file"
BENDS = f"needs {MIN_TIME_S:.0f} s with bends to both sides"


@dataclass(frozen=True)
class CannotTell:
    """A check that is not judged, and the evidence that it needs."""

    check: str
    why: str


CheckResult = Finding | CannotTell | None


def lacks(drive: GridSignals, names: tuple[str, ...], rolling: str) -> str:
    """The first reason why a check on these signals is not judged; `rolling` where the vehicle moves."""
    missing = [words(name) for name in names if not drive.has(name)]
    if missing:
        return f"no {', no '.join(missing)}"
    if not np.any(drive.speed > ROLLING_M_S):
        return "the vehicle does not move"
    return rolling


def words(name: str) -> str:
    return name.replace("_", " ")
