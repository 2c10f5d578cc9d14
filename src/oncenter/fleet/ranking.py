"""Trucks by evidence, not by value: how likely an offset beyond the limit is, and how many of those named are healthy.

A p-value is the probability, from what was measured alone, that the offset, or its last change, is within the limit;
a truck's is twice the smaller one, for it was asked twice. Benjamini and Hochberg (1995) then say how far down the list
one may go so that on average at most `SHARE_OF_FALSE_ALARMS` of those named are healthy, however many trucks there are.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from oncenter.fleet.history import NOISE, Break, Mean, breaks, drift, now, told_of
from oncenter.fleet.known_play import Told, play_of, with_known_play
from oncenter.fleet.tables import OFFSET, QUANTITIES

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


def history(truck: str, rows: Sequence[dict[str, Any]], limit_deg: float) -> History:
    """A truck from its drives' rows, which are in order of time; `limit_deg` is what an offset may be."""
    told, found = {}, {}
    for quantity in QUANTITIES:
        told[quantity.name], kept = told_of(rows, quantity.value, quantity.sd, quantity.status)
        noise = NOISE.get(quantity.name)
        play = play_of(rows, kept, NOISE["backlash"].floor) if quantity is OFFSET else None
        found[quantity.name] = [] if noise is None else breaks(told[quantity.name], noise, play)
        if play is not None:
            told[quantity.name] = with_known_play(told[quantity.name], play)
    of_offset = found["offset"]
    since = of_offset[-1].at if of_offset else 0
    offset = now(told["offset"], since, NOISE["offset"])
    changes = [
        _change(truck, quantity.name, quantity.unit, told, broken)
        for quantity in QUANTITIES
        for broken in found[quantity.name]
    ]
    starts = [row["start"] for row in rows if row.get("start") is not None]
    row: dict[str, Any] = {
        "truck": truck,
        "drives": len(rows),
        "errors": sum(row.get("error_code") is not None for row in rows),
        "told": len(told["offset"].value),
        "first_drive": min(starts, default=None),
        "last_drive": max(starts, default=None),
        "changes": len(of_offset),
        "cause": next((change["cause"] for change in reversed(changes) if change["quantity"] == "offset"), None),
        "vehicle_file": next((row["vehicle_file"] for row in reversed(rows) if row.get("vehicle_file")), None),
        "verdict": "unknown",
    }
    for quantity in QUANTITIES[1:]:
        mean = _mean_now(told[quantity.name], found[quantity.name], quantity.name)
        row |= {quantity.value: None, quantity.sd: None} if mean is None else {}
        row |= {} if mean is None else {quantity.value: mean.value, quantity.sd: mean.sd}
    if offset is not None:
        slope = drift(told["offset"], since, NOISE["offset"])
        row |= _of_offset(offset, of_offset, limit_deg)
        row |= {"since": float(told["offset"].start_s[since])}
        row |= {} if slope is None else {"drift_deg_day": slope[0], "drift_sd_deg_day": slope[1]}
    return History(row, changes)


def _mean_now(told: Told, found: Sequence[Break], name: str) -> Mean | None:
    noise = NOISE.get(name)
    if noise is not None:
        return now(told, found[-1].at if found else 0, noise)
    if not len(told.value):
        return None
    weight = told.sd**-2.0  # what changes with every load is no more than a mean
    return Mean(
        float(np.average(told.value, weights=weight)), 0.0, float(np.sqrt(np.average(told.sd**2, weights=weight)))
    )


def _of_offset(offset: Mean, found: Sequence[Break], limit_deg: float) -> dict[str, Any]:
    p_value = within(offset.value, offset.sd, limit_deg)
    last = found[-1] if found else None
    if last is not None and abs(last.after) > abs(last.before):  # one that takes it out again is no alarm
        p_value = min(p_value, within(last.size, last.sd, limit_deg))
    return {
        OFFSET.value: offset.value,
        OFFSET.sd: offset.sd,
        "offset_spread_sd_deg": offset.spread_sd,
        "probability_beyond": 1.0 - within(offset.value, offset.sd, limit_deg),
        "p_value": min(1.0, 2.0 * p_value),
    }


def _change(truck: str, name: str, unit: str, told: dict[str, Told], broken: Break) -> dict[str, Any]:
    start_s = told[name].start_s
    return {
        "truck": truck,
        "quantity": name,
        "unit": unit,
        "after_drive": float(start_s[broken.at - 1]),
        "by_drive": float(start_s[broken.at]),
        "found": float(start_s[broken.found]),
        "drives_to_find": broken.found - broken.at + 1,
        "before": broken.before,
        "after": broken.after,
        "size": broken.size,
        "sd": broken.sd,
        "cause": _cause(told, float(start_s[broken.at])) if name == "offset" else None,
    }


def _cause(told: dict[str, Told], at_s: float) -> str:
    """What else is another since that time, with half of what alone would be told as a change."""
    for name, cause in _CAUSES.items():
        noise, of_it = NOISE[name], told[name]
        before = of_it.start_s < at_s
        if not before.any() or before.all():
            continue
        (value_b, sd_b), (value_a, sd_a) = (
            (mean.value, mean.spread_sd)
            for part in (before, ~before)
            if (mean := now(Told(of_it.start_s[part], of_it.value[part], of_it.sd[part]), 0, noise)) is not None
        )
        moved = abs(value_a - value_b)
        if moved > noise.least / 2.0 and moved > _MOVED_TOO * math.hypot(sd_a, sd_b):
            return cause
    return SENSOR_OR_ALIGNMENT


def rank(trucks: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The trucks with `rank`, `q_value` and `verdict`, the strongest evidence first; those of which nothing is known
    last."""
    known = sorted((row for row in trucks if row.get("p_value") is not None), key=_strongest_first)
    unknown = sorted((row for row in trucks if row.get("p_value") is None), key=lambda row: str(row["truck"]))
    q_values = _benjamini_hochberg([row["p_value"] for row in known])
    ranked = [
        row | {"rank": place, "q_value": q, "verdict": _verdict(row["p_value"], q)}
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


def _verdict(p_value: float, q_value: float) -> str:
    if q_value <= SHARE_OF_FALSE_ALARMS:
        return "calibrate"
    return "watch" if p_value <= _SUSPICIOUS else "fine"
