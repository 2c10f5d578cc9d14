"""One truck's offset as its model has it, in the tables' units: what it is now, what changed, how it drifts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from oncenter.fleet.history import Break, Numbers, Told, drift
from oncenter.signals import DEGREE
from oncenter.truck.kalman import Step
from oncenter.truck.model import Trucks


@dataclass(frozen=True)
class Offset:
    """Of the drives since the last change, deg, at the truck's mean load; `since` is the begin of the first of them.

    `sd` is all that the drives leave open; `spread_sd` without pull and accelerometer bias, which all have in common.
    `drift` is deg a day and its standard deviation, None below four drives. Accelerations in m/s^2.
    """

    value: float
    sd: float
    spread_sd: float
    since: float
    pull: float
    pull_sd: float
    accelerometer_bias: float
    accelerometer_bias_sd: float
    load_would_help: bool
    drift: tuple[float, float] | None
    changes: list[Break]


def offset_of(trucks: Trucks, place: int, starts: Numbers) -> Offset:
    """Of the truck at that place, whose drives began at `starts`, s since 1970."""
    steps = [step for step in trucks.steps if step.truck == place]
    since = steps[-1].at if steps else 0
    value = float(trucks.offset[place]) / DEGREE
    count = len(starts)
    told = Told(starts, trucks.offsets[place, :count] / DEGREE, trucks.offset_sds[place, :count] / DEGREE)
    return Offset(
        value=value,
        sd=float(trucks.offset_sd[place]) / DEGREE,
        spread_sd=float(trucks.spread_sd[place]) / DEGREE,
        since=float(starts[since]),
        pull=float(trucks.pull[place]),
        pull_sd=float(trucks.pull_sd[place]),
        accelerometer_bias=float(trucks.accelerometer_bias[place]),
        accelerometer_bias_sd=float(trucks.accelerometer_bias_sd[place]),
        load_would_help=bool(trucks.load_would_help[place]),
        drift=drift(told, since),
        changes=_changes(steps, value),
    )


def _changes(steps: Sequence[Step], value: float) -> list[Break]:
    """From the last one, which led to what the offset is now, back to the first."""
    changes: list[Break] = []
    for step in reversed(steps):
        size = step.size / DEGREE
        changes.insert(0, Break(step.at, step.found, value - size, value, size, step.sd / DEGREE))
        value -= size
    return changes
