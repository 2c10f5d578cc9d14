"""Spells of a drive, tick by tick; of brakes that a control applies: yaw moment, deceleration, wheel slip, status."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from oncenter.simulate.truck_sections import Intervention

Array = npt.NDArray[np.float64]

_RISES_S = 0.2  # of pneumatic brakes; chosen
_SLIP_CYCLE_S = 0.4  # of the anti-lock brake: pressure falls and rises 2 to 3 times a second; chosen


def within(spells_s: Sequence[tuple[float, float]], time_s: Array) -> Array:
    """1 at each time in one of the spells [begin, end], else 0."""
    inside = np.zeros(len(time_s))
    for begin_s, end_s in spells_s:
        inside[(time_s >= begin_s) & (time_s < end_s)] = 1.0
    return inside


def brake_moment_n_m(interventions: Sequence[Intervention], time_s: Array) -> Array:
    """Yaw moment at each time, to the left."""
    return sum((each.yaw_moment_n_m * _share(each, time_s) for each in interventions), np.zeros(len(time_s)))


def braked_m_s2(interventions: Sequence[Intervention], time_s: Array) -> Array:
    """Deceleration at each time; 0 without an intervention."""
    return sum((each.deceleration_m_s2 * _share(each, time_s) for each in interventions), np.zeros(len(time_s)))


def wheel_slip(interventions: Sequence[Intervention], wheel: int, time_s: Array) -> Array:
    """Share by which the speed of wheel 0 to 3 is below that of its rolling: one after the other in each cycle."""
    cycle = 0.5 - 0.5 * np.cos(2.0 * np.pi * (time_s / _SLIP_CYCLE_S - wheel / 4.0))
    slips = (each.wheel_slip_percent / 100.0 * _share(each, time_s) for each in interventions)
    return cycle * sum(slips, np.zeros(len(time_s)))


def at_work(interventions: Sequence[Intervention], kind: str, time_s: Array) -> Array:
    """1 at each time at which a control of this kind brakes, else 0."""
    shares = (_share(each, time_s) for each in interventions if each.kind == kind)
    return (sum(shares, np.zeros(len(time_s))) > 0.0).astype(np.float64)


def _share(each: Intervention, time_s: Array) -> Array:
    """0 to 1: a trapezoid."""
    rises_s = min(_RISES_S, each.length_s / 2.0)
    since_s = time_s - each.begin_s
    return np.clip(np.minimum(since_s, each.length_s - since_s) / rises_s, 0.0, 1.0)
