"""A fleet of two trucks, six drives each, and what of a run must not depend on how it went."""

from __future__ import annotations

import base64
import gzip
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from test_estimate import steady_drive

VIN = "YS2R4X20001234567"
DAY_S = 86400.0
MONDAY_S = 1_772_434_800.0  # 2026-03-02, 7:00 UTC
OFFSETS_DEG = {VIN: (0.3, 0.3, 0.3, 5.3, 5.3, 5.3), "depot-7": (-0.4,) * 6}
_TABLES = ("drives", "trucks", "changes")


def write_fleet(root: Path) -> None:
    """`vehicles` and `logs` of one truck that is known by its VIN, of a model that a file describes, and was remounted
    by 5 deg, and of one that is known by its folder's name."""
    (root / "vehicles").mkdir()
    for stem in ("YS2R4X2", "depot-7"):
        text = "wheelbase_m = 3.7\nsteering_ratio = 19.3\ntrack_width_rear_m = 1.83\n"
        (root / "vehicles" / f"{stem}.toml").write_text(text)
    for truck, offsets in OFFSETS_DEG.items():
        (root / "logs" / truck).mkdir(parents=True)
        for day, offset in enumerate(offsets):
            table = steady_drive(offset_deg=offset, start_s=MONDAY_S + day * DAY_S).table
            noise = np.random.default_rng(day).normal(0.0, 0.003, table.height)
            table = table.with_columns(pl.col("steering_wheel_angle_rad") + noise)
            table.write_parquet(root / "logs" / truck / f"day{5 - day}.parquet")  # names are not in order of time


def tables(output: Path) -> dict[str, bytes]:
    """All that must not depend on how a run went."""
    return {name: (output / name).read_bytes() for name in (*(f"{name}.parquet" for name in _TABLES), "index.html")}


def histories(page: Path) -> dict[str, Any]:
    """The trucks' histories that a page holds, by truck."""
    found = re.search(r'<script type="text/plain" id="data">([^<]*)</script>', page.read_text(encoding="utf-8"))
    assert found is not None
    unpacked: dict[str, Any] = json.loads(gzip.decompress(base64.b64decode(found[1])))
    return unpacked
