"""Trucks ranked by evidence, not by value: the probability of an offset beyond the limit, and the false discovery rate.

A p-value is the probability, from the measurements alone, that the offset, or its last change, is within the limit. A
truck's p-value is twice the smaller of the two (Bonferroni: two tests). Benjamini and Hochberg (1995) then give the
length of the list: on average at most `SHARE_OF_FALSE_ALARMS` of the trucks on it are healthy, for any fleet size.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from oncenter.fleet.history import readings_of
from oncenter.fleet.offset_now import Offset, offset_of, with_priors
from oncenter.fleet.several_logs import as_drives
from oncenter.fleet.summaries import params_of_drive, row_of_drive
from oncenter.fleet.tables import OFFSET, QUANTITIES
from oncenter.fleet.undecided import would_decide
from oncenter.fleet.verdict import deciding_interval, second_line, state_of
from oncenter.signals import DEGREE
from oncenter.truck.events import Event, is_former
from oncenter.truck.fingerprint import Print, copies
from oncenter.truck.now import Change, Truck, truck_now, trucks_now, usable
from oncenter.truck.priors import priors_of
from oncenter.truck.zero import Zero
from oncenter.verdict.states import AT_FAULT, Code

Rows = Sequence[dict[str, Any]]

SHARE_OF_FALSE_ALARMS = 0.05
_SUSPICIOUS = 0.05  # p-value at or below which a truck is on watch
_SENSOR_AT_FAULT, _RELATIVE = "steering_wheel_angle_sensor_at_fault", "relative_angle_sensor"  # codes of findings

# Of an offset's change, by what changed with it.
_CAUSES = {"both": "play", "alignment": "wheel_alignment", "all": "play"}
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
    some = [one for one in trucks if one.rows]
    priors = [priors_of(one.params) for one in some]
    if some:
        for one, truck in zip(
            some, trucks_now([one.rows for one in some], priors, [one.events for one in some]), strict=True
        ):
            one.learned(truck)
    for one in trucks:
        yield one.history()


class OfTruck:
    """One truck: its drives' rows, and the result of its model.

    Args:
        name: of the truck.
        drives: their rows of the tables, in order of time, after `mark_copies`.
        limit_deg: the largest offset, either sign, that needs no calibration.
        events: what a person stated about the truck; drives of a former truck do not count.
    """

    def __init__(self, name: str, drives: Rows, limit_deg: float, events: Sequence[Event] = ()) -> None:
        drives = [d for d in drives if d.get("copy_of") is None and not is_former(d.get("start"), events)]
        self._name, self._limit_deg, self.events = name, limit_deg, events
        self._counts = _counts(name, drives)
        self._at_fault, self._is_relative = _newest_fault(drives), _newest_has(drives, _RELATIVE)
        self._readings = {q.name: readings_of(drives, q.value, q.sd, q.status) for q in QUANTITIES[1:]}
        self._used_s = sum(drive.get("used_s") or 0.0 for drive in drives)
        counted = [(d, row) for d in as_drives(drives, events) if (row := row_of_drive(d)) is not None]
        self.rows = usable((row for _, row in counted), events)
        self._drives = [drive for drive, row in counted if any(row is one for one in self.rows)]
        self.params = params_of_drive(self._drives[-1] if self._drives else {})
        self._has_unusable_offset = any(drive.get(OFFSET.value) is not None for drive in drives)
        self._offset: Offset | None = None

    def learned(self, truck: Truck) -> None:
        offset = offset_of(truck, self._drives, self.params, self._used_s)
        self._offset = with_priors(offset, self._by, self.params, self._limit_deg) if len(self.rows) > 1 else offset

    def _by(self, params: Mapping[str, float]) -> Truck:
        return truck_now(self.rows, self.events, priors_of(params))

    def history(self) -> History:
        found = self._offset.truck.changes if self._offset is not None and self._offset.truck.zero == "fixed" else ()
        changes = [self._change(one) for one in sorted(found, key=lambda one: one.kind == "play")]
        of_offset = [change for change in changes if change["quantity"] == "offset"]
        state = self._state()
        row = self._counts | {
            "told": len(self.rows),
            "changes": len(of_offset),
            "cause": of_offset[-1]["cause"] if of_offset else None,
            "verdict": state,
            "state": state,
            "watch": False,
            "second_line": second_line(state, self._offset, len(self.rows), self._limit_deg),
            "limit_deg": self._limit_deg,
        }
        for quantity in QUANTITIES[1:]:
            mean = self._readings[quantity.name].mean()
            row |= {quantity.value: mean and mean[0], quantity.sd: mean and mean[1]}
        if self._offset is not None:
            row |= _of_offset(self._offset)
            if self._has_fixed_zero():
                row |= _of_evidence(self._offset, self._limit_deg) | {"would_decide": self._would_decide()}
        return History(row, changes)

    def _change(self, one: Change) -> dict[str, Any]:
        is_play = one.kind == "play"
        quantity, start = QUANTITIES[1] if is_play else OFFSET, self.rows[one.at].start_s
        gyro = "gyro" if self._readings["yaw_rate_bias"].moved(start) else SENSOR_OR_ALIGNMENT
        sizes = {name: getattr(one, name) / DEGREE for name in ("before", "after", "size", "sd")}
        return {
            "truck": self._name,
            "quantity": quantity.name,
            "unit": quantity.unit,
            "after_drive": self.rows[one.at - 1].start_s,
            "by_drive": start,
            **sizes,
            "probability": one.probability,
            "cause": None if is_play else _CAUSES.get(one.kind, gyro),
        }

    def _state(self) -> Code:
        if self._offset is None and self._has_unusable_offset and self._at_fault is None and not self._is_relative:
            return "undecided"
        return state_of(self._at_fault, self._offset, self._zero(), self._limit_deg)

    def _zero(self) -> Zero:
        return "relative" if self._is_relative else "fixed" if self._offset is None else self._offset.truck.zero

    def _has_fixed_zero(self) -> bool:
        return self._offset is not None and self._zero() == "fixed"

    def _would_decide(self) -> str | None:
        """The advice on how to decide, or on how to find the number to set; None where neither is lacking."""
        assert self._offset is not None
        state = self._state()
        if state != "undecided" and (state != "over" or self._offset.is_valid):
            return None
        since = self.rows[self._offset.truck.since :]
        return would_decide(self._offset, sum(row.left_s for row in since), sum(row.right_s for row in since))


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
    return Print(
        row["fingerprint"], row.get("duration_s") or row.get("span_s") or 0.0, row["start"] if own_clock else math.nan
    )


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


def _of_evidence(offset: Offset, limit_deg: float) -> dict[str, float]:
    """Of an offset beyond the limit; there is none where no correction would hold."""
    beyond = within(offset.value, offset.sd, limit_deg)
    p_value, changes = beyond, [change for change in offset.truck.changes if change.kind != "play"]
    if changes and abs(changes[-1].after) > abs(changes[-1].before):  # a change toward zero is no alarm
        p_value = min(p_value, within(changes[-1].size / DEGREE, changes[-1].sd / DEGREE, limit_deg))
    return {"probability_beyond": 1.0 - beyond, "p_value": min(1.0, 2.0 * p_value)}


def _of_offset(offset: Offset) -> dict[str, Any]:
    truck, (low, high) = offset.truck, deciding_interval(offset)
    return {
        "offset_low_deg": low,
        "offset_high_deg": high,
        "offset_is_valid": offset.is_valid,
        OFFSET.value: offset.value,
        OFFSET.sd: offset.sd,
        "offset_spread_sd_deg": offset.spread_sd,
        "pull_m_s2": truck.pull,
        "pull_sd_m_s2": truck.pull_sd,
        "accelerometer_bias_m_s2": truck.accelerometer_bias,
        "accelerometer_bias_sd_m_s2": truck.accelerometer_bias_sd,
        "backlash_deg": truck.play / DEGREE,
        "backlash_sd_deg": truck.play_sd / DEGREE,
        "unloading_acceleration_m_s2": truck.neutral,
        "unloading_acceleration_sd_m_s2": truck.neutral_sd,
        "load_would_help": truck.load_would_help,
        "since": offset.since,
        "drift_deg_day": offset.drift and offset.drift[0],
        "drift_sd_deg_day": offset.drift and offset.drift[1],
    }


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
