"""One truck's offset from its model, in the tables' units: the value now, its changes, its drift."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from oncenter.fleet.history import Break, Numbers, Readings, drift
from oncenter.signals import DEGREE
from oncenter.truck.kalman import Step
from oncenter.truck.model import Trucks
from oncenter.truck.zero import Zero


@dataclass(frozen=True)
class Offset:
    """The offset since the last change, deg, at the truck's mean load; `since` is the start of the drive after it.

    `zero` is that of the sensor; where it is not fixed the offset is that of the last drive, and no change is listed.
    `sd` is the whole standard deviation; `spread_sd` leaves out pull and accelerometer bias, which are common to all
    drives. `drift` is deg a day and its standard deviation, None below four drives. Accelerations in m/s^2.
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
    zero: Zero
    drift: tuple[float, float] | None
    changes: list[Break]


def offset_of(trucks: Trucks, place: int, starts: Numbers) -> Offset:
    """The offset of the truck at that place in the model; its drives began at `starts`, s since 1970."""
    zero, since = trucks.zero[place], trucks.since[place]
    steps = [step for step in trucks.steps if step.truck == place and zero == "fixed"]
    value = float(trucks.offset[place]) / DEGREE
    count = len(starts)
    readings = Readings(starts, trucks.offsets[place, :count] / DEGREE, trucks.offset_sds[place, :count] / DEGREE)
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
        zero=zero,
        drift=drift(readings, since),
        changes=_changes(steps, value),
    )


def _changes(steps: Sequence[Step], value: float) -> list[Break]:
    """The changes in order of time; computed backward from the last one, which led to the offset now."""
    changes: list[Break] = []
    for step in reversed(steps):
        size = step.size / DEGREE
        changes.insert(0, Break(step.at, step.found, value - size, value, size, step.sd / DEGREE))
        value -= size
    return changes
