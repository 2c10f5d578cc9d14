from __future__ import annotations
from pathlib import Path
from typing import Any
def multibody_drive(seed: int, k: int, folder: Path, minutes: float) -> Any:
    raise NotImplementedError
