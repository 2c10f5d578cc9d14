"""One truck's offset from its model, in the tables' units."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from oncenter import _core
from oncenter.estimates.by_priors import INSIDE_DRIVE, OffsetBy, by_priors
from oncenter.fleet.history import Readings, drift
from oncenter.signals import DEGREE
from oncenter.truck.now import Truck
from oncenter.verdict.decision import Interval

_NEAR_DEG = 0.5  # of the limit: farther from it no prior of the accelerometer's bias moves an interval across


@dataclass(frozen=True)
class Offset:
    """The offset since the last change, deg, at the truck's mean load, with its 95 % intervals from the driving and
    with all causes; `since` is the start of the first drive with it.

    `not_identifiable_sd` is the part that the drives do not identify. `drift` is deg a day and its standard deviation,
    None below four drives. `own_by_priors`: `own` by other priors, where it is near the limit.
    """

    truck: Truck
    value: float
    own: Interval
    whole: Interval
    is_valid: bool
    has_evidence: bool
    not_identifiable_sd: float
    since: float
    drift: tuple[float, float] | None = None
    own_by_priors: tuple[Interval, ...] = ()

    @property
    def sd(self) -> float:
        return (self.whole[1] - self.whole[0]) / (2.0 * 1.96)

    @property
    def spread_sd(self) -> float:
        return (self.own[1] - self.own[0]) / (2.0 * 1.96)


def offset_of(truck: Truck, drives: Sequence[Mapping[str, Any]], params: Mapping[str, float], used_s: float) -> Offset:
    """The offset of a truck whose usable drives have these rows of the tables; `used_s` is of all its drives. Of one
    drive it is the drive's own, as `oncenter offset` gives it."""
    starts = np.array([drive["start"] for drive in drives])
    if len(drives) == 1:
        return _of_one(truck, drives[0])
    low, high = _core.interval_95(truck.offset, truck.whole_sd, truck.lean)
    readings = Readings(starts, truck.offsets / DEGREE, truck.offset_sds / DEGREE)
    return Offset(
        truck=truck,
        value=truck.offset / DEGREE,
        own=_in_deg(truck.own),
        whole=_in_deg((low, high)),
        is_valid=truck.is_valid(params),
        has_evidence=truck.has_evidence(params, used_s),
        not_identifiable_sd=max(truck.whole_sd**2 - truck.own_sd**2, 0.0) ** 0.5 / DEGREE,
        since=float(starts[truck.since]),
        drift=drift(readings, truck.since),
    )


def _of_one(truck: Truck, drive: Mapping[str, Any]) -> Offset:
    value, own_sd = drive["offset_deg"], drive["offset_drive_sd_deg"]
    return Offset(
        truck=truck,
        value=value,
        own=(value - 1.96 * own_sd, value + 1.96 * own_sd),
        whole=(drive["offset_low_deg"], drive["offset_high_deg"]),
        is_valid=drive["offset_status"] == "valid",
        has_evidence=drive["evidence_enough"],
        not_identifiable_sd=drive.get("offset_not_identifiable_sd_deg") or 0.0,
        since=drive["start"],
    )


def with_priors(
    offset: Offset, solved: Callable[[Mapping[str, float]], Truck], params: Mapping[str, float], limit_deg: float
) -> Offset:
    """The offset with its interval by other priors, as `oncenter offset` has it; `solved` is the truck by params."""
    if not offset.is_valid or all(abs(abs(end) - limit_deg) > _NEAR_DEG for end in offset.own):
        return offset

    def by(other: Mapping[str, float]) -> OffsetBy:
        truck = offset.truck if other is params else solved(other)  # the truck is by these params already
        return OffsetBy(truck.offset, truck.own, truck.whole)

    now = by(params)
    moved = [move for each in by_priors(by, params, INSIDE_DRIVE) for move in (each.halved, each.doubled)]
    return replace(offset, own_by_priors=tuple(_in_deg((now + move).ci95_drive) for move in moved))


def _in_deg(interval: Interval) -> Interval:
    return float(interval[0]) / DEGREE, float(interval[1]) / DEGREE
