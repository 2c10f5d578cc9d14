"""Trucks by evidence, not by value: how likely an offset beyond the limit is, and how many of those named are healthy.

A p-value is the probability, from what was measured alone, that the offset, or its last change, is within the limit;
a truck's is twice the smaller one, for it was asked twice. Benjamini and Hochberg (1995) then say how far down the list
one may go so that on average at most `SHARE_OF_FALSE_ALARMS` of those named are healthy, however many trucks there are.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from oncenter.fleet.history import NOISE, Break, Mean, Numbers, Told, breaks, now, told_of
from oncenter.fleet.offset_now import Offset, offset_of
from oncenter.fleet.summaries import known_of_row, summary_of_row
from oncenter.fleet.tables import OFFSET, QUANTITIES
from oncenter.fleet.undecided import BEYOND, UNDECIDED, WITHIN, Driven, standing, would_decide
from oncenter.truck.drives import together
from oncenter.truck.model import Trucks, learn
from oncenter.truck.priors import Priors, priors_of

Rows = Sequence[dict[str, Any]]

SHARE_OF_FALSE_ALARMS = 0.05
_SUSPICIOUS = 0.05  # p-value from which on a truck is watched
_MOVED_TOO = 3.0  # standard deviations by which another quantity must have changed to be a cause

# What an offset's change that comes with one of these is put down to, the first that fits.
_CAUSES = {
    "unloading_acceleration": "wheel_alignment",
    "yaw_rate_bias": "gyro",
    "backlash": "play",
}
SENSOR_OR_ALIGNMENT = "sensor_or_alignment"


@dataclass(frozen=True)
class History:
    """What a truck's rows say together: its row of `tables.TRUCKS` without rank, and its changes."""

    truck: dict[str, Any]
    changes: list[dict[str, Any]]


def within(mean: float, sd: float, limit: float) -> float:
    """Probability that a normal number is within plus and minus a limit, 0 to 1."""
    return 0.5 * (math.erf((limit - mean) / (sd * math.sqrt(2.0))) + math.erf((limit + mean) / (sd * math.sqrt(2.0))))


def histories(trucks: Sequence[OfTruck], limit_deg: float) -> Iterator[History]:
    """Of each truck; `limit_deg` is what an offset may be. The trucks that are given together are computed together,
    and each comes out as if it were alone."""
    alike: dict[Priors, list[OfTruck]] = {}
    for one in trucks:
        if one.summaries:
            alike.setdefault(one.priors, []).append(one)
    for priors, some in alike.items():
        model = learn(together([one.summaries for one in some]), priors)
        for place, one in enumerate(some):
            one.learned(model, place)
    for one in trucks:
        yield one.history(limit_deg)


class OfTruck:
    """What one truck's drives said, from their rows, which are in order of time, and what its model made of that."""

    def __init__(self, name: str, rows: Rows) -> None:
        self._name = name
        self._counts = _counts(name, rows)
        self._told = {q.name: told_of(rows, q.value, q.sd, q.status) for q in QUANTITIES[1:]}
        told = [(row, summary) for row in rows if (summary := summary_of_row(row)) is not None]
        self.summaries = [summary for _, summary in told]
        self.priors = priors_of(known_of_row(told[-1][0]) if told else None)
        self._starts = np.array([row["start"] for row, _ in told])
        self._drives = [row for row, _ in told]
        self._offset: Offset | None = None

    def learned(self, model: Trucks, place: int) -> None:
        self._offset = offset_of(model, place, self._starts)

    def history(self, limit_deg: float) -> History:
        told = self._told
        found = {name: breaks(told[name], noise) for name, noise in NOISE.items()}
        of_offset = self._offset.changes if self._offset is not None else []
        changes = [
            _change(self._name, "offset", "deg", self._starts, one)
            | {"cause": _cause(told, float(self._starts[one.at]))}
            for one in of_offset
        ]
        changes += [
            _change(self._name, q.name, q.unit, told[q.name].start_s, one)
            for q in QUANTITIES[1:]
            for one in found.get(q.name, ())
        ]
        row = self._counts | {
            "told": len(self.summaries),
            "changes": len(of_offset),
            "cause": changes[len(of_offset) - 1]["cause"] if of_offset else None,
            "verdict": "unknown",
        }
        for quantity in QUANTITIES[1:]:
            mean = _mean_now(told[quantity.name], found.get(quantity.name, []), quantity.name)
            row |= {quantity.value: mean and mean.value, quantity.sd: mean and mean.sd}
        if self._offset is not None:
            row |= _of_offset(self._offset, limit_deg) | {"would_decide": self._would_decide(limit_deg)}
        return History(row, changes)

    def _would_decide(self, limit_deg: float) -> str | None:
        """For people; None where the interval does not hold the limit."""
        assert self._offset is not None
        if standing(self._offset.value, self._offset.sd, limit_deg) != UNDECIDED:
            return None
        since = [row for row in self._drives if row["start"] >= self._offset.since]
        left_s, right_s = (sum(row.get(f"side_force_{side}_s") or 0.0 for row in since) for side in ("left", "right"))
        own = [sd for row in since if (sd := row.get("offset_drive_sd_deg"))]
        return would_decide(self._offset, Driven(own, left_s, right_s))


def _counts(name: str, rows: Rows) -> dict[str, Any]:
    starts = [row["start"] for row in rows if row.get("start") is not None]
    return {
        "truck": name,
        "drives": len(rows),
        "errors": sum(row.get("error_code") is not None for row in rows),
        "first_drive": min(starts, default=None),
        "last_drive": max(starts, default=None),
        "vehicle_file": next((r["vehicle_file"] for r in reversed(rows) if r.get("vehicle_file")), None),
    }


def _mean_now(told: Told, found: Sequence[Break], name: str) -> Mean | None:
    noise = NOISE.get(name)
    if noise is not None:
        return now(told, found[-1].at if found else 0, noise)
    if not len(told.value):
        return None
    weight = told.sd**-2.0  # what changes with every load is no more than a mean
    return Mean(float(np.average(told.value, weights=weight)), float(np.sqrt(np.average(told.sd**2, weights=weight))))


def _of_offset(offset: Offset, limit_deg: float) -> dict[str, Any]:
    beyond = within(offset.value, offset.sd, limit_deg)
    p_value, last = beyond, offset.changes[-1] if offset.changes else None
    if last is not None and abs(last.after) > abs(last.before):  # one that takes it out again is no alarm
        p_value = min(p_value, within(last.size, last.sd, limit_deg))
    return {
        OFFSET.value: offset.value,
        OFFSET.sd: offset.sd,
        "offset_spread_sd_deg": offset.spread_sd,
        "pull_m_s2": offset.pull,
        "pull_sd_m_s2": offset.pull_sd,
        "accelerometer_bias_m_s2": offset.accelerometer_bias,
        "accelerometer_bias_sd_m_s2": offset.accelerometer_bias_sd,
        "load_would_help": offset.load_would_help,
        "since": offset.since,
        "drift_deg_day": offset.drift and offset.drift[0],
        "drift_sd_deg_day": offset.drift and offset.drift[1],
        "probability_beyond": 1.0 - beyond,
        "p_value": min(1.0, 2.0 * p_value),
    }


def _change(truck: str, name: str, unit: str, starts: Numbers, one: Break) -> dict[str, Any]:
    return {
        "truck": truck,
        "quantity": name,
        "unit": unit,
        "after_drive": float(starts[one.at - 1]),
        "by_drive": float(starts[one.at]),
        "found": float(starts[one.found]),
        "drives_to_find": one.found - one.at + 1,
        "before": one.before,
        "after": one.after,
        "size": one.size,
        "sd": one.sd,
        "cause": None,
    }


def _cause(told: dict[str, Told], at_s: float) -> str:
    """What else is another since that time, with half of what alone would be told as a change."""
    for name, cause in _CAUSES.items():
        noise, of_it = NOISE[name], told[name]
        before = of_it.start_s < at_s
        if not before.any() or before.all():
            continue
        (value_b, sd_b), (value_a, sd_a) = (
            (mean.value, mean.sd)
            for part in (before, ~before)
            if (mean := now(Told(of_it.start_s[part], of_it.value[part], of_it.sd[part]), 0, noise)) is not None
        )
        moved = abs(value_a - value_b)
        if moved > noise.smallest / 2.0 and moved > _MOVED_TOO * math.hypot(sd_a, sd_b):
            return cause
    return SENSOR_OR_ALIGNMENT


def rank(trucks: Sequence[dict[str, Any]], limit_deg: float) -> list[dict[str, Any]]:
    """The trucks with `rank`, `q_value` and `verdict`, the strongest evidence first; those of which nothing is known
    last."""
    known = sorted((row for row in trucks if row.get("p_value") is not None), key=_strongest_first)
    unknown = sorted((row for row in trucks if row.get("p_value") is None), key=lambda row: str(row["truck"]))
    q_values = _benjamini_hochberg([row["p_value"] for row in known])
    ranked = [
        row | {"rank": place, "q_value": q, "verdict": _verdict(row, q, limit_deg)}
        for place, (row, q) in enumerate(zip(known, q_values, strict=True), 1)
    ]
    return ranked + [row | {"rank": len(known) + place} for place, row in enumerate(unknown, 1)]


def _strongest_first(row: dict[str, Any]) -> tuple[float, float, str]:
    """Where both are certain, by how many standard deviations."""
    return row["p_value"], -abs(row[OFFSET.value]) / row[OFFSET.sd], str(row["truck"])


def _benjamini_hochberg(p_values: Sequence[float]) -> list[float]:
    """Of p-values in ascending order: the smallest share of false alarms at which each would be named."""
    count = len(p_values)
    q_values, smallest = [1.0] * count, 1.0
    for place in range(count, 0, -1):
        smallest = min(smallest, p_values[place - 1] * count / place)
        q_values[place - 1] = smallest
    return q_values


def _verdict(row: dict[str, Any], q_value: float, limit_deg: float) -> str:
    """`calibrate` and `fine` have the whole 95 % interval on one side of the limit; a truck whose last change alone is
    beyond the limit is one to watch."""
    stands = standing(row[OFFSET.value], row[OFFSET.sd], limit_deg)
    if stands == BEYOND and q_value <= SHARE_OF_FALSE_ALARMS:
        return "calibrate"
    if row["p_value"] <= _SUSPICIOUS:
        return "watch"
    return "fine" if stands == WITHIN else "undecided"
