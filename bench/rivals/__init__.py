"""Published estimators and those of the thesis's further work (bins, rls), each reimplemented from its equations, and
their common result.

A rival gets the columns of a drive and the truck's data, and gives a value at the end of every minute. Angles are in
rad at the steering wheel; measured angle less offset is the true angle, as in oncenter.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

MINUTE_TICKS = 6000  # at 100 Hz
EVERY_TENTH = 10  # ticks per step of a rival that runs at 10 Hz


@dataclass(frozen=True)
class Known:
    """The truck's data for a rival: more than a vehicle file has, so that no rival loses by a missing value.

    Stiffnesses are of all front and of all rear tyres, steering compliance included.
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
    """The values of a method at the end of every minute.

    Attributes:
        value_rad: NaN without a value.
        sd_rad: standard deviation given by the method; NaN without one.
        valid: whether the method reports its value as valid.
        lean_rad: from the last value to the centre of its interval, whose sd is the last of `sd_rad`.
    """

    value_rad: Array
    sd_rad: Array
    valid: npt.NDArray[np.bool_]
    lean_rad: float = 0.0


def without_interval(value_rad: Array) -> Course:
    """The course of a method without sd, whose values are all valid."""
    return Course(value_rad, np.full(len(value_rad), np.nan), np.isfinite(value_rad))


Rival = Callable[[Mapping[str, Array], Known], Course]


def rivals() -> dict[str, Rival]:
    """Rivals by name, compiled at their first call."""
    from rivals.autoware import autoware
    from rivals.bins import bins
    from rivals.median import median
    from rivals.mode import mode
    from rivals.openpilot import openpilot
    from rivals.rls import rls

    return {"bins": bins, "rls": rls, "autoware": autoware, "openpilot": openpilot, "median": median, "mode": mode}
