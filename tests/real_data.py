"""The location of the recorded drives; skips a test whose drive is missing."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(os.environ.get("ONCENTER_REAL_DATA", Path(__file__).parents[1] / ".." / "shared" / "data"))


def real_drive(name: str) -> Path:
    """Path of a recorded drive such as "genesis/cpg_fast_lap.csv.gz"; skips the test if it is missing."""
    path = ROOT / name
    if not path.exists():
        pytest.skip(f"real drive {name} is not in {ROOT}; set ONCENTER_REAL_DATA to the folder that has it")
    return path
