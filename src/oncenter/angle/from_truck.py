"""A truck by its former drives, for a drive whose angle sensor is lost before or soon after its start."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from oncenter import _core
from oncenter.param_table import params as param_table
from oncenter.truck.events import Event
from oncenter.truck.now import truck_now, usable
from oncenter.truck.priors import Priors, priors_of
from oncenter.truck.row import Row
from oncenter.tuned import BETWEEN_DRIVES
from oncenter.vehicle import Vehicle


def known_by(rows: Sequence[Row], events: Sequence[Event], params: Mapping[str, float]) -> dict[str, float]:
    """Priors of the next drive as params of the core; empty without a usable row."""
    counted = usable(rows, events)
    if not counted:
        return {}
    truck = truck_now(counted, events, priors_of(params))
    gradient, gradient_sd = _gradient(counted, priors_of(params))
    wheelbase, wheelbase_sd = _wheelbase(counted)
    found = {
        "known_play{}_rad": (truck.play, math.hypot(truck.play_sd, BETWEEN_DRIVES["PLAY"][0])),
        "known_understeer_gradient{}_rad_m_s2": (gradient, gradient_sd),
        "known_wheelbase_share{}_1": (wheelbase, wheelbase_sd),
        "known_accelerometer_bias{}_m_s2": (truck.accelerometer_bias, truck.accelerometer_bias_sd),
    }
    return {
        name.format(part): _in_range(name.format(part), value)
        for name, values in found.items()
        if not params.get(name.format("_sd"))
        for part, value in zip(("", "_sd"), values, strict=True)
    }


def _in_range(name: str, value: float) -> float:
    """A truck by its rows may be outside what a user may configure."""
    row = param_table()[name]
    return min(max(value, row.low), row.high)


def teach(
    core: _core.Core, rows: Sequence[Row], events: Sequence[Event], vehicle: Vehicle, params: Mapping[str, float]
) -> None:
    """Gives the core the truck's offset, play, gradient, wheelbase and neutral acceleration by its rows."""
    counted = usable(rows, events)
    if not counted:
        return
    priors = priors_of(params)
    truck = truck_now(counted, events, priors)
    gradient, gradient_sd = _gradient(counted, priors)
    wheelbase, wheelbase_sd = _wheelbase(counted)
    neutral_sd = math.hypot(truck.neutral_sd, priors.wind_sd_m_s2)
    joint = core.coefficients()["joint"]
    share = joint["tyre_share"]
    core.teach(
        {
            "offset": (truck.offset, truck.own_sd),
            "understeer_gradient": (gradient, gradient_sd),
            "backlash": (truck.play, truck.play_sd),
            "unloading_acceleration": (truck.neutral, neutral_sd),
            "equivalent_wheelbase": (vehicle.wheelbase_m * (1.0 + wheelbase), vehicle.wheelbase_m * wheelbase_sd),
        },
        {
            "offset_sd": truck.own_sd,
            "gradient": share * gradient,
            "gradient_sd": share * gradient_sd,
            "wheelbase": wheelbase,
            "backlash": truck.play,
            "unloading": truck.neutral / share,
            "unloading_sd": neutral_sd / share,
            "tandem": joint["tandem"] / share,
            "friction": counted[-1].friction / share,
            "creep": counted[-1].creep * share,
            "left_s": sum(row.left_s for row in counted),
            "right_s": sum(row.right_s for row in counted),
            "identified": 1,
        },
    )


def _gradient(rows: Sequence[Row], priors: Priors) -> tuple[float, float]:
    """Of a drive at an unknown load: the mean of the drives so far, with the scatter of loads."""
    values = np.array([row.gradient for row in rows])
    weights = np.array([row.gradient_sd for row in rows]) ** -2.0
    mean = float(np.average(values, weights=weights))
    own = float(np.average((values - mean) ** 2, weights=weights))
    return mean, math.sqrt(own + 1.0 / float(np.sum(weights)) + (priors.load_spread_1 * mean) ** 2 / len(rows))


def _wheelbase(rows: Sequence[Row]) -> tuple[float, float]:
    values = np.array([row.wheelbase for row in rows])
    weights = np.array([row.wheelbase_sd for row in rows]) ** -2.0
    sd = math.hypot(float(np.sum(weights)) ** -0.5, BETWEEN_DRIVES["WHEELBASE"][0])
    return float(np.average(values, weights=weights)), sd
