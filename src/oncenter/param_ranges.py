"""Within what the core accepts a param: read from the one table of ranges, in the core's own text."""

from __future__ import annotations

import re
from pathlib import Path


def param_ranges() -> dict[str, tuple[float, float]]:
    """Lowest and highest by the core's name and in its unit; where a range depends on another param, its widest."""
    source = (Path(__file__).parent / "core" / "params.c").read_text(encoding="utf-8")
    rows = re.findall(r"\{([^,{}]+)f, ([^,{}]+)f\}, /\* (\w+) \*/", source)
    return {name: (float(low), float(high)) for low, high, name in rows}
