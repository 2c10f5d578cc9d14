"""Trucks ranked by evidence, not by value: the probability of an offset beyond the limit, and the false discovery rate.

A p-value is the probability, from the measurements alone, that the offset, or its last change, is within the limit. A
truck's p-value is twice the smaller of the two (Bonferroni: two tests). Benjamini and Hochberg (1995) then give the
length of the list: on average at most `SHARE_OF_FALSE_ALARMS` of the trucks on it are healthy, for any fleet size.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from oncenter.fleet.history import NOISE, Break, Mean, Numbers, Readings, breaks, now, readings_of
from oncenter.fleet.offset_now import Offset, offset_of
from oncenter.fleet.summaries import priors_of_row, summary_of_row
from oncenter.fleet.tables import OFFSET, QUANTITIES
from oncenter.fleet.undecided import Driven, would_decide
from oncenter.fleet.verdict import deciding_interval, second_line, state_of
from oncenter.truck.drives import together
from oncenter.truck.fingerprint import Print, copies
from oncenter.truck.model import Trucks, learn
from oncenter.truck.priors import Priors, priors_of
from oncenter.truck.zero import Zero
from oncenter.verdict.states import AT_FAULT, Code

Rows = Sequence[dict[str, Any]]

SHARE_OF_FALSE_ALARMS = 0.05
_SUSPICIOUS = 0.05  # p-value at or below which a truck is on watch
_MOVED_TOO = 3.0  # standard deviations by which another quantity must have changed to be a cause
_SENSOR_AT_FAULT, _RELATIVE = "steering_wheel_angle_sensor_at_fault", "relative_angle_sensor"  # codes of findings

# Cause of an offset's change, by the quantity that changed with it; the first one that fits.
_CAUSES = {
    "unloading_acceleration": "wheel_alignment",
    "yaw_rate_bias": "gyro",
    "backlash": "play",
}
SENSOR_OR_ALIGNMENT = "sensor_or_alignment"


@dataclass(frozen=True)
class History:
    """The result of a truck's rows together: its row of `tables.TRUCKS` without rank, and its changes."""

    truck: dict[str, Any]
    changes: list[dict[str, Any]]


def within(mean: float, sd: float, limit: float) -> float:
    """Probability that a normal number is within plus and minus a limit, 0 to 1."""
    return 0.5 * (math.erf((limit - mean) / (sd * math.sqrt(2.0))) + math.erf((limit + mean) / (sd * math.sqrt(2.0))))


def histories(trucks: Sequence[OfTruck]) -> Iterator[History]:
    """One per truck, in the same order. Trucks given together are computed together; the result does not depend on
    that."""
    alike: dict[Priors, list[OfTruck]] = {}
    for one in trucks:
        if one.summaries:
            alike.setdefault(one.priors, []).append(one)
    for priors, some in alike.items():
        model = learn(together([one.summaries for one in some]), priors)
        for place, one in enumerate(some):
            one.learned(model, place)
    for one in trucks:
        yield one.history()


class OfTruck:
    """One truck: its drives' rows, and the result of its model.

    Args:
        name: of the truck.
        rows: of its drives, in order of time, after `mark_copies`.
        limit_deg: the largest offset, either sign, that needs no calibration.
    """

    def __init__(self, name: str, rows: Rows, limit_deg: float) -> None:
        rows = [row for row in rows if row.get("copy_of") is None]
        self._name, self._limit_deg = name, limit_deg
        self._counts = _counts(name, rows)
        self._at_fault, self._is_relative = _newest_fault(rows), _newest_has(rows, _RELATIVE)
        self._readings = {q.name: readings_of(rows, q.value, q.sd, q.status) for q in QUANTITIES[1:]}
        usable = [(row, summary) for row in rows if (summary := summary_of_row(row)) is not None]
        self.summaries = [summary for _, summary in usable]
        self.priors = priors_of(priors_of_row(usable[-1][0]) if usable else None)
        self._starts = np.array([row["start"] for row, _ in usable])
        self._drives = [row for row, _ in usable]
        self._has_unusable_offset = any(row.get(OFFSET.value) is not None for row in rows)
        self._offset: Offset | None = None

    def learned(self, model: Trucks, place: int) -> None:
        self._offset = offset_of(model, place, self._starts, self._drives)

    def history(self) -> History:
        readings = self._readings
        found = {name: breaks(readings[name], noise) for name, noise in NOISE.items()}
        of_offset = self._offset.changes if self._offset is not None else []
        changes = [
            _change(self._name, "offset", "deg", self._starts, one)
            | {"cause": _cause(readings, float(self._starts[one.at]))}
            for one in of_offset
        ]
        changes += [
            _change(self._name, q.name, q.unit, readings[q.name].start_s, one)
            for q in QUANTITIES[1:]
            for one in found.get(q.name, ())
        ]
        state = self._state()
        row = self._counts | {
            "told": len(self.summaries),
            "changes": len(of_offset),
            "cause": changes[len(of_offset) - 1]["cause"] if of_offset else None,
            "verdict": state,
            "state": state,
            "watch": False,
            "second_line": second_line(state, self._offset, len(self.summaries), self._limit_deg),
            "limit_deg": self._limit_deg,
        }
        for quantity in QUANTITIES[1:]:
            mean = _mean_now(readings[quantity.name], found.get(quantity.name, []), quantity.name)
            row |= {quantity.value: mean and mean.value, quantity.sd: mean and mean.sd}
        if self._offset is not None:
            row |= _of_offset(self._offset)
            if self._has_fixed_zero():
                row |= _of_evidence(self._offset, self._limit_deg) | {"would_decide": self._would_decide()}
        return History(row, changes)

    def _state(self) -> Code:
        if self._offset is None and self._has_unusable_offset and self._at_fault is None and not self._is_relative:
            return "undecided"
        return state_of(self._at_fault, self._offset, self._zero(), self._limit_deg)

    def _zero(self) -> Zero:
        return "relative" if self._is_relative else "fixed" if self._offset is None else self._offset.zero

    def _has_fixed_zero(self) -> bool:
        return self._offset is not None and self._zero() == "fixed"

    def _would_decide(self) -> str | None:
        """The advice on how to decide, or on how to find the number to set; None where neither is lacking."""
        assert self._offset is not None
        state = self._state()
        if state != "undecided" and (state != "over" or self._offset.is_valid):
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
        "vehicle_file": vehicle_file_of(rows),
    }


def vehicle_file_of(rows: Rows) -> str | None:
    """The vehicle file of the newest drive that has one."""
    return next((row["vehicle_file"] for row in reversed(rows) if row.get("vehicle_file")), None)


def mark_copies(rows: Rows) -> None:
    """Sets `copy_of` in rows of one truck that are copies or parts of other drives, which would count twice; rows of
    former versions have no fingerprint."""
    known = [k for k, row in enumerate(rows) if row.get("fingerprint")]
    for copy, whole in copies([_print_of(rows[k]) for k in known]).items():
        rows[known[copy]]["copy_of"] = rows[known[whole]]["key"]


def _print_of(row: dict[str, Any]) -> Print:
    own_clock = row.get("start_source") in ("log", "metadata")
    return Print(row["fingerprint"], row.get("duration_s") or 0.0, row["start"] if own_clock else math.nan)


def _newest_has(rows: Rows, code: str) -> bool:
    """Whether the newest drive with an answer has this finding."""
    answered = [row for row in rows if row.get("start") is not None and row.get("error_code") is None]
    return bool(answered) and code in (answered[-1].get("findings") or "").split()


def _newest_fault(rows: Rows) -> Code | None:
    """The fault of the newest drive with an answer, as its own verdict names it."""
    answered = [row for row in rows if row.get("start") is not None and row.get("error_code") is None]
    if not answered:
        return None
    verdict = answered[-1].get("verdict")
    if verdict is None:  # a row of a former version
        return "signal_or_sensor" if _newest_has(rows, _SENSOR_AT_FAULT) else None
    return next((code for code in AT_FAULT if code == verdict), None)


def _mean_now(readings: Readings, found: Sequence[Break], name: str) -> Mean | None:
    noise = NOISE.get(name)
    if noise is not None:
        return now(readings, found[-1].at if found else 0, noise)
    if not len(readings.value):
        return None
    weight = readings.sd**-2.0  # a quantity that changes with every load has only a mean
    variance = np.average(readings.sd**2, weights=weight)
    return Mean(float(np.average(readings.value, weights=weight)), float(np.sqrt(variance)))


def _of_evidence(offset: Offset, limit_deg: float) -> dict[str, float]:
    """Of an offset beyond the limit; there is none where no correction would hold."""
    beyond = within(offset.value, offset.sd, limit_deg)
    p_value, last = beyond, offset.changes[-1] if offset.changes else None
    if last is not None and abs(last.after) > abs(last.before):  # a change toward zero is no alarm
        p_value = min(p_value, within(last.size, last.sd, limit_deg))
    return {"probability_beyond": 1.0 - beyond, "p_value": min(1.0, 2.0 * p_value)}


def _of_offset(offset: Offset) -> dict[str, Any]:
    low, high = deciding_interval(offset)
    return {
        "offset_low_deg": low,
        "offset_high_deg": high,
        "offset_is_valid": offset.is_valid,
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


def _cause(readings: dict[str, Readings], at_s: float) -> str:
    """The quantity whose mean changed at that time, by at least half of the smallest change that would be reported
    alone."""
    for name, cause in _CAUSES.items():
        noise, of_it = NOISE[name], readings[name]
        before = of_it.start_s < at_s
        if not before.any() or before.all():
            continue
        (value_b, sd_b), (value_a, sd_a) = (
            (mean.value, mean.sd)
            for part in (before, ~before)
            if (mean := now(Readings(of_it.start_s[part], of_it.value[part], of_it.sd[part]), 0, noise)) is not None
        )
        moved = abs(value_a - value_b)
        if moved > noise.smallest / 2.0 and moved > _MOVED_TOO * math.hypot(sd_a, sd_b):
            return cause
    return SENSOR_OR_ALIGNMENT


def rank(trucks: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The trucks with `rank`, `q_value` and `watch`, the strongest evidence first; trucks without an offset last."""
    estimated = sorted((row for row in trucks if row.get("p_value") is not None), key=_strongest_first)
    others = sorted((row for row in trucks if row.get("p_value") is None), key=lambda row: str(row["truck"]))
    q_values = _benjamini_hochberg([row["p_value"] for row in estimated])
    ranked = [
        row | {"rank": place, "q_value": q, "watch": _is_to_watch(row, q)}
        for place, (row, q) in enumerate(zip(estimated, q_values, strict=True), 1)
    ]
    return ranked + [row | {"rank": len(estimated) + place} for place, row in enumerate(others, 1)]


def _strongest_first(row: dict[str, Any]) -> tuple[float, float, str]:
    """The sort key: the p-value; where several are zero, standard deviations from zero."""
    return row["p_value"], -abs(row[OFFSET.value]) / row[OFFSET.sd], str(row["truck"])


def _benjamini_hochberg(p_values: Sequence[float]) -> list[float]:
    """q-values of p-values in ascending order: the smallest false discovery rate at which each would be listed."""
    count = len(p_values)
    q_values, smallest = [1.0] * count, 1.0
    for place in range(count, 0, -1):
        smallest = min(smallest, p_values[place - 1] * count / place)
        q_values[place - 1] = smallest
    return q_values


def _is_to_watch(row: dict[str, Any], q_value: float) -> bool:
    """A truck beyond the limit that may be a false alarm, by q, or one within it whose last change exceeds it."""
    if row["state"] in ("recalibrate", "over"):
        return q_value > SHARE_OF_FALSE_ALARMS
    return bool(row["p_value"] <= _SUSPICIOUS)
