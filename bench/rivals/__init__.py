"""Published estimators and those of the thesis's further work (bins, rls), each reimplemented from its equations, and
their common result.

A rival gets the columns of a drive and the truck's data, and gives a value at the end of every minute. Angles are in
rad at the steering wheel; measured angle less offset is the true angle, as in oncenter. docs/howto/compare_estimator.md
says how to add one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

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


NAMES = ("bins", "rls", "autoware", "openpilot", "median", "mode")  # of this folder; numba compiles them


class RivalError(Exception):
    """A rival does not exist, or gives something else than values; one line."""


def rival(name: str) -> Rival:
    """A rival of this folder, or any other function by "module:function".

    Raises:
        RivalError: there is none.
    """
    module, is_own, function = name.partition(":")
    if not is_own:
        found: Rival = getattr(import_module(f"rivals.{name}"), name)
        return found
    try:
        own = getattr(import_module(module), function, None)
    except ModuleNotFoundError as error:
        if error.name != module.partition(".")[0]:
            raise
        raise RivalError(f"no module {module}: run `python -m bench.accuracy` in the folder with {module}.py") from None
    if not callable(own):
        raise RivalError(f"{module} has no function {function or '(name it after the colon)'}")
    return lambda columns, known: _course_of(name, own(columns, known), len(columns["time_s"]) // MINUTE_TICKS)


def _course_of(name: str, given: Any, minutes: int) -> Course:
    """The course by the values of each minute, rad, or by a pair of them and their standard deviations."""
    value, sd = given if isinstance(given, tuple) else (given, np.nan)
    value_rad, sd_rad = np.asarray(value, np.float64), np.asarray(sd, np.float64)
    if value_rad.shape != (minutes,) or sd_rad.shape not in ((), (minutes,)):
        raise RivalError(
            f"{name} must give one value for each of {minutes} minutes, or a pair of these and their standard "
            f"deviations; it gives the shapes {value_rad.shape} and {sd_rad.shape}"
        )
    return Course(value_rad, np.broadcast_to(sd_rad, value_rad.shape), np.isfinite(value_rad))
