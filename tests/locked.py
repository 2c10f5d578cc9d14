"""The versions that a lock pins, by canonical names."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]


def pinned(lock: str) -> dict[str, str]:
    text = (ROOT / lock).read_text(encoding="utf-8")
    return dict(re.findall(r"^([\w.-]+)==([\w.]+)", text, re.MULTILINE))
