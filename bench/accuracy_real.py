"""The offset of each method for a car on a proving ground, with a reference offset from a GNSS/INS heading."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import oncenter as oc
from oncenter.errors import OncenterError
from oncenter.estimates.estimates import METHODS

ROOT = Path(__file__).parents[1]
REAL_DATA = Path(os.environ.get("ONCENTER_REAL_DATA", ROOT / ".." / "shared" / "data"))
# deg, fitted in bends to the OxTS heading instead of the gyro; from the drives' README.
OXTS_OFFSET_DEG = {"cpg_fast_lap": 0.27, "cpg_slow_lap": 0.34}


@dataclass(frozen=True)
class RealOffset:
    """A method's offset of a real drive, deg; `refusal` is the reason if there is no answer."""

    drive: str
    method: str
    oxts_deg: float
    value_deg: float | None = None
    half_width_deg: float | None = None
    status: str = ""
    refusal: str = ""


def real_drives() -> Iterator[RealOffset]:
    """Results by drive and method; empty if the drives are not available."""
    vehicle = oc.vehicle(ROOT / "examples" / "genesis.toml")
    for drive, oxts_deg in OXTS_OFFSET_DEG.items():
        log = REAL_DATA / "genesis" / f"{drive}.csv.gz"
        if not log.exists():
            continue
        signals = oc.read(log, names=vehicle.signal_names)
        for method in METHODS:
            try:
                offset = oc.offset(signals, vehicle, method=method).offset.to_dict()
            except OncenterError as error:
                lacks = ", ".join(error.needs)
                yield RealOffset(drive, method, oxts_deg, refusal=f"lacks {lacks}" if lacks else error.code)
                continue
            half_width = None if offset["ci95"] is None else (offset["ci95"][1] - offset["ci95"][0]) / 2.0
            yield RealOffset(drive, method, oxts_deg, offset["value"], half_width, offset["status"])
