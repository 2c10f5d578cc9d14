"""The widest 95 % interval with which a quantity is called valid; docs/verdicts.md has the table.

The core judges most of them by its parameters, per tick and with hysteresis. A coarse recording, several logs and
quantities without a bound in the core can have a valid status with an interval that decides nothing: such an answer is
converging, whatever the core says.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

from oncenter.estimates.estimate import Estimate
from oncenter.signals import DEGREE

Bounded = Literal[
    "offset",
    "understeer_gradient",
    "backlash",
    "unloading_acceleration",
    "equivalent_wheelbase",
    "yaw_rate_bias",
    "wheel_radius_mismatch_rear",
    "wheel_radius_mismatch_front",
]


@dataclass(frozen=True)
class Bound:
    """`half_width` in the SI unit of the quantity; `why` completes "since"."""

    half_width: float
    unit: str
    why: str

    @property
    def in_files(self) -> float:
        """In the unit of files, degrees instead of radians."""
        return self.half_width / DEGREE if self.unit.startswith("deg") else self.half_width


BOUNDS: Mapping[Bounded, Bound] = {
    "offset": Bound(
        5.0 * DEGREE, "deg", "a usual pull and wind add less than 2 deg; the drive's part has its own bound"
    ),
    "understeer_gradient": Bound(0.3 * DEGREE, "deg/(m/s^2)", "trucks have 0.1 to 1"),
    "backlash": Bound(2.0 * DEGREE, "deg", "the maintenance limit of free play is 15 deg, and a good steering has 3"),
    "unloading_acceleration": Bound(0.3, "m/s^2", "a usual crown is 0.2, the bank limit 0.3"),
    "equivalent_wheelbase": Bound(0.5, "m", "tyres, payload and a lifted axle change it by up to 15 %"),
    "yaw_rate_bias": Bound(0.5 * DEGREE, "deg/s", "the sensor is checked from 0.5 on"),
    "wheel_radius_mismatch_rear": Bound(0.005, "1", "a tyre without air changes it by 0.01"),
    "wheel_radius_mismatch_front": Bound(0.005, "1", "a tyre without air changes it by 0.01"),
}


def bounded(name: Bounded, estimate: Estimate) -> Estimate:
    """The estimate; converging where its interval is wider than the bound of a valid one."""
    if estimate.status != "valid" or estimate.ci95 is None:
        return estimate
    half_width = 0.5 * (estimate.ci95[1] - estimate.ci95[0])
    return estimate if half_width <= BOUNDS[name].half_width else replace(estimate, status="converging")
