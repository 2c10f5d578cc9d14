"""Trucks with several drives: values that belong to the truck, to its load, and to each drive."""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from accuracy_rows import Drive, Row, drive, laid_over
from population import CROWN_M_S2, CROWN_SD_M_S2, PERCENT_PER_M_S2, PRIORS, PULL_SD_M_S2, Normal, Random, Uniform

ROADS = ("thesis_drive", "country", "motorway", "town")
DRIVES = 8
LOADS = 3
# Drawn for each drive; all other priors belong to the truck.
OF_DRIVE = (
    "yaw_rate_bias_deg_s",
    "wind_m_s",
    "gust_sd_m_s",
    "rough_bank_sd_percent",
    "heading_deg",
    "standing_at_start_s",
)
OF_TRUCK = {
    "lateral_acceleration_bias_m_s2": Normal(0.0, 0.1),
    "backlash_deg": Uniform(2.0, 12.0),
    "king_pin_friction_m_s2": Uniform(0.02, 0.1),
    "pull_n": Normal(0.0, 0.0),
}
# Half of the variance of a road's crown is that of its region, which all drives of a truck share.
CROWN_OF_REGION = Normal(CROWN_M_S2 * PERCENT_PER_M_S2, CROWN_SD_M_S2 * PERCENT_PER_M_S2 * math.sqrt(0.5))
STIFFER = (1.0, 1.35, 1.8)  # understeer gradient of a load relative to the lightest


@dataclass(frozen=True)
class Kind:
    """`loads` of each truck in turn (`shuffled`: in random order), the bump steer angle of each load's ride height (sd,
    deg at the road wheels), the number of drives, the sd of the pull (m/s^2), and what all trucks have in common."""

    loads: int = LOADS
    bump_steer_deg: float = 0.0
    drives: int = DRIVES
    shuffled: bool = False
    pull_sd_m_s2: float = 0.06
    of_type: Mapping[str, float] = field(default_factory=dict)


TYPE = {"wheelbase_m": 4.5, "steering_ratio": 20.0}
PULL_SDS_M_S2 = (0.02, 0.05, 0.1)
KINDS = {
    "three": Kind(),
    "one": Kind(loads=1),
    "bump": Kind(bump_steer_deg=0.03),
    "month": Kind(drives=20, shuffled=True),
    "logs_three": Kind(drives=12, pull_sd_m_s2=PULL_SD_M_S2),
    "logs_one": Kind(loads=1, drives=12, pull_sd_m_s2=PULL_SD_M_S2),
    "logs_three_straight": Kind(drives=12, pull_sd_m_s2=0.0),
    "logs_one_straight": Kind(loads=1, drives=12, pull_sd_m_s2=0.0),
    "type_one": Kind(loads=1, of_type=TYPE),
} | {f"type_{sd:g}": Kind(pull_sd_m_s2=sd, of_type=TYPE) for sd in PULL_SDS_M_S2}


def truck_drives(kind: Kind, name: str, seed: int, folder: Path) -> Iterator[tuple[int, float, Drive]]:
    """Load, angle by bump steer (deg at the steering wheel), and drive, in order of time."""
    random = np.random.default_rng([seed, zlib.crc32(name.encode())])
    fixed: dict[str, Any] = {
        key: OF_TRUCK.get(key, prior).draw(random) for key, (prior, _) in PRIORS.items() if key not in OF_DRIVE
    }
    fixed |= kind.of_type
    fixed["pull_m_s2"] = float(random.normal(0.0, kind.pull_sd_m_s2))
    fixed["crown_percent"] = Normal(CROWN_OF_REGION.draw(random), CROWN_OF_REGION.sd)
    lightest = float(random.uniform(0.25, 0.45))
    bump_deg = random.normal(0.0, kind.bump_steer_deg, LOADS) * fixed["steering_ratio"]
    wheels_percent = [float(random.normal(0.0, 0.3)) for _ in range(4)]
    first = int(random.integers(LOADS))
    for k in range(kind.drives):
        load = (first + k) % LOADS if kind.loads > 1 else first
        if kind.shuffled:
            load = int(random.integers(LOADS))
        fixed["understeer_gradient_deg_m_s2"] = lightest * STIFFER[load]
        stands = random.random() < 0.6
        row = Row(
            f"{name}_{k}",
            "",
            base=str(random.choice(ROADS)),
            fixed=fixed | {"offset_deg": fixed["offset_deg"] + bump_deg[load]},
            extra=_extra(wheels_percent, stands),
            wind=True,
            pulls=True,
        )
        yield load, float(bump_deg[load]), drive(row, seed, folder)


def _extra(wheels_percent: list[float], stands: bool) -> Any:
    corners = ("front_left", "front_right", "rear_left", "rear_right")
    values: dict[str, Any] = {
        "sensors": {"wheel_speed": {"radius_error_percent": dict(zip(corners, wheels_percent, strict=True))}}
    }
    if not stands:
        values = laid_over(values, {"drive": {"standing_at_start_s": 0.0}})

    def extra(random: Random) -> dict[str, Any]:
        return values

    return extra
