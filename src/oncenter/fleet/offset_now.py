"""One truck's offset from its model, in the tables' units: the value now, its changes, its drift."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from oncenter import _core
from oncenter.fleet.history import Break, Numbers, Readings, drift
from oncenter.signals import DEGREE
from oncenter.truck.kalman import Step
from oncenter.truck.model import Trucks
from oncenter.truck.zero import Zero


@dataclass(frozen=True)
class Offset:
    """The offset since the last change, deg, at the truck's mean load; `since` is the start of the drive after it.

    `low` and `high` are the ends of the whole 95 % interval; `pull_effect` is what the pull adds to the offset, and
    `not_identifiable_sd` the part of `sd` that the drives do not identify, deg.
    `zero` is that of the sensor; where it is not fixed the offset is that of the last drive, and no change is listed.
    `sd` is the whole standard deviation; `spread_sd` leaves out pull and accelerometer bias, which are common to all
    drives. `drift` is deg a day and its standard deviation, None below four drives. Accelerations in m/s^2.
    """

    value: float
    sd: float
    spread_sd: float
    low: float
    high: float
    is_valid: bool
    has_evidence: bool
    since: float
    pull: float
    pull_sd: float
    pull_effect: float
    not_identifiable_sd: float
    accelerometer_bias: float
    accelerometer_bias_sd: float
    load_would_help: bool
    zero: Zero
    drift: tuple[float, float] | None
    changes: list[Break]


def offset_of(trucks: Trucks, place: int, starts: Numbers, rows: Sequence[Mapping[str, Any]]) -> Offset:
    """The offset of the truck at that place in the model, from the rows of its drives, which began at `starts`, s
    since 1970. Of one drive it is the drive's own, as `oncenter offset` gives it."""
    zero, since = trucks.zero[place], trucks.since[place]
    steps = [step for step in trucks.steps if step.truck == place and zero == "fixed"]
    value = float(trucks.offset[place]) / DEGREE
    count = len(starts)
    readings = Readings(starts, trucks.offsets[place, :count] / DEGREE, trucks.offset_sds[place, :count] / DEGREE)
    sd, spread_sd = (float(sds[place]) / DEGREE for sds in (trucks.offset_sd, trucks.spread_sd))
    offset = Offset(
        value=value,
        sd=sd,
        spread_sd=spread_sd,
        low=value - 1.96 * sd,
        high=value + 1.96 * sd,
        is_valid=_has_evidence(rows[since:]) and _is_narrow(1.96 * spread_sd),
        has_evidence=_has_evidence(rows[since:]),
        since=float(starts[since]),
        pull=float(trucks.pull[place]),
        pull_sd=float(trucks.pull_sd[place]),
        not_identifiable_sd=math.sqrt(max(sd**2 - spread_sd**2, 0.0)),
        pull_effect=abs(value - float(trucks.less_pull[place]) / DEGREE),
        accelerometer_bias=float(trucks.accelerometer_bias[place]),
        accelerometer_bias_sd=float(trucks.accelerometer_bias_sd[place]),
        load_would_help=bool(trucks.load_would_help[place]),
        zero=zero,
        drift=drift(readings, since),
        changes=_changes(steps, value),
    )
    return _of_one(offset, rows[0]) if count == 1 else offset


def _has_evidence(rows: Sequence[Mapping[str, Any]]) -> bool:
    """As of several logs."""
    return sum(row.get("used_s") or 0.0 for row in rows) >= _core.default_params()["joint_evidence_min_s"]


def _is_narrow(half_width_deg: float) -> bool:
    return half_width_deg * DEGREE <= _core.default_params()["offset_drive_half_width_max_rad"]


def _of_one(offset: Offset, row: Mapping[str, Any]) -> Offset:
    low, high, own_sd = (row.get(name) for name in ("offset_low_deg", "offset_high_deg", "offset_drive_sd_deg"))
    if low is None or high is None or own_sd is None:  # a row of a former version
        return offset
    return replace(
        offset,
        value=row["offset_deg"],
        sd=(high - low) / (2.0 * 1.96),
        spread_sd=own_sd,
        not_identifiable_sd=row.get("offset_not_identifiable_sd_deg") or 0.0,
        low=low,
        high=high,
        is_valid=row["offset_status"] == "valid",
        has_evidence=row["evidence_enough"],
    )


def _changes(steps: Sequence[Step], value: float) -> list[Break]:
    """The changes in order of time; computed backward from the last one, which led to the offset now."""
    changes: list[Break] = []
    for step in reversed(steps):
        size = step.size / DEGREE
        changes.insert(0, Break(step.at, step.found, value - size, value, size, step.sd / DEGREE))
        value -= size
    return changes
