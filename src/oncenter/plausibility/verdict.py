"""What a check says: a finding, nothing, or that the drive does not tell, with what it lacks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oncenter.offset.findings import Finding
from oncenter.plausibility.drive import MIN_TIME_S, ROLLING_M_S, Drive

BENDS = f"needs {MIN_TIME_S:.0f} s with bends to both sides"


@dataclass(frozen=True)
class CannotTell:
    """A check that the drive does not decide, and what it would need."""

    check: str
    why: str


Verdict = Finding | CannotTell | None


def lacks(drive: Drive, names: tuple[str, ...], rolling: str) -> str:
    """Why a check that takes these signals of a rolling vehicle is not judged, the plainest reason first."""
    missing = [words(name) for name in names if not drive.has(name)]
    if missing:
        return f"no {', no '.join(missing)}"
    if not np.any(drive.speed > ROLLING_M_S):
        return "the vehicle does not move"
    return rolling


def words(name: str) -> str:
    return name.replace("_", " ")
