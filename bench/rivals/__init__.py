"""The estimators that are out there and those of the thesis's further work (bins, rls), each written anew from its
equations, and how a course of theirs is handed on.

A rival gets the columns of a drive and what is known of the truck, and says at the end of every minute what it thinks.
Angles are in rad at the steering wheel; measured less offset is true, as with ours.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

MINUTE_TICKS = 6000  # at 100 Hz
EVERY_TENTH = 10  # ticks between two of a rival that works at 10 Hz


@dataclass(frozen=True)
class Known:
    """What a rival is told of the truck: more than a vehicle file says, so that none loses for want of a number.

    Stiffnesses are of all tyres of the front and of all the rear axles, the steering's compliance included.
    """

    wheelbase_m: float
    steering_ratio: float
    mass_kg: float
    yaw_inertia_kg_m2: float
    front_axle_distance_m: float  # from the centre of gravity
    front_cornering_stiffness_n_rad: float
    rear_cornering_stiffness_n_rad: float


@dataclass(frozen=True)
class Course:
    """What a method says at the end of every minute.

    Attributes:
        value_rad: NaN where it says nothing.
        sd_rad: standard deviation that it claims; NaN where it claims none.
        valid: where it calls its value good.
        lean_rad: from the last value to the middle of its interval, whose sd is the last of `sd_rad`.
    """

    value_rad: Array
    sd_rad: Array
    valid: npt.NDArray[np.bool_]
    lean_rad: float = 0.0


def without_interval(value_rad: Array) -> Course:
    """Of a method that claims no spread, and calls good what it says at all."""
    return Course(value_rad, np.full(len(value_rad), np.nan), np.isfinite(value_rad))


Rival = Callable[[Mapping[str, Array], Known], Course]


def rivals() -> dict[str, Rival]:
    """By name, compiled at their first call."""
    from rivals.autoware import autoware
    from rivals.bins import bins
    from rivals.median import median
    from rivals.mode import mode
    from rivals.openpilot import openpilot
    from rivals.rls import rls

    return {"bins": bins, "rls": rls, "autoware": autoware, "openpilot": openpilot, "median": median, "mode": mode}
