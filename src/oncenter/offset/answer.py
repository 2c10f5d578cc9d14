"""The answer of a drive, or of several of one truck: quantities with interval and status, in words and as JSON.

SI and rad inside; degrees appear in `Answer.words`, `Answer.to_json` and in findings, which are for people and files.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from oncenter.offset.cause import Cause, in_words, together_rad
from oncenter.offset.changes import Change
from oncenter.offset.correction import NO_CORRECTION, Correction
from oncenter.offset.findings import Finding
from oncenter.read.whole_turns import is_relative
from oncenter.signals import DEGREE, Signals
from oncenter.truck.drives import Summary
from oncenter.vehicle import Vehicle

Method = Literal["thesis", "joint", "wheel-speed"]
METHODS: tuple[Method, ...] = ("thesis", "joint", "wheel-speed")
DEFAULT_METHOD: Method = "joint"

Schema = Literal["offset-1", "offset-2"]
SCHEMAS: tuple[Schema, ...] = ("offset-1", "offset-2")
DEFAULT_SCHEMA: Schema = "offset-2"

# By status, the words beside an offset that must not be set. An invalid offset with a value was estimated before the
# fault of the angle sensor.
NOT_YET_OR_NO_MORE: Mapping[str, str] = {"converging": "still converging", "invalid": "before the fault"}
_NO_PLAY_DEG = 0.5  # an interval that reaches below it includes no play at all
_CORRECTION_REPORTED_FROM_RAD_S = 0.05 * DEGREE


@dataclass(frozen=True)
class Estimate:
    """A quantity with its 95 % interval and status; `value` and `ci95` are None where the drive gives none.

    `unit` is the SI unit of value and ci95. The interval need not be centred on the value. `evidence_s` are the seconds
    of driving used for it.
    """

    value: float | None
    ci95: tuple[float, float] | None
    status: str
    unit: str
    evidence_s: float = 0.0

    def to_dict(self) -> dict[str, Any]:
        """As in files: degrees instead of radians."""
        factor, unit = _file_unit(self.unit)
        return {
            "value": None if self.value is None else self.value / factor,
            "unit": unit,
            "ci95": None if self.ci95 is None else [bound / factor for bound in self.ci95],
            "status": self.status,
        }

    def __str__(self) -> str:
        given = self.to_dict()
        if given["value"] is None or given["ci95"] is None:
            return self.status
        low, high = given["ci95"]
        digits = 1 if high - low > 0.4 else 2 if high - low > 0.04 else 3
        value, low, high = (round(number, digits) + 0.0 for number in (given["value"], low, high))  # no -0.0
        return (
            f"{value:.{digits}f} {given['unit']}, {low:.{digits}f} to {high:.{digits}f}"
            f"{'' if self.status == 'valid' else f' ({self.status})'}"
        )


@dataclass(frozen=True, repr=False)
class Answer:
    """The answer of a drive, or of several of one truck, on its steering wheel angle sensor.

    `str(answer)` is the answer in words, `to_json` the contract's object. Times are in seconds of ticks;
    duration_s = used_s + unused_s, and the reasons in `rejected_s` overlap. `drives` are the tables answered, so that
    `trace` can run them again. The wheel radius mismatch of an axle is its left radius over its right less one;
    `unloading_acceleration` is the neutral lateral acceleration: the measured one at which the steering carries no
    load. `equivalent_wheelbase` is the one of (10) that fits the bends; it contains an error of the steering ratio.
    `side_force_s` are the seconds of lateral force clearly to the left and to the right, which load the left and the
    right flank of the play; of the joint method.
    `missing_loading_s` are the seconds of lateral force to the left and to the right that the joint method still needs
    before it can separate play and offset there; zero where enough was driven, and for the other methods.
    `changes` are those found in the drive, in order of time; the core keeps only the last ones.
    `sensor_fault` is the fault of the angle sensor at the end, "none" or one of the core's names. With a fault the
    offset is `invalid`: it was estimated before the fault.

    `offset` is the straight-ahead offset. Its `ci95` has two parts: `offset_ci95_drive` is this drive's part, and
    `not_identifiable` lists the causes that no single drive identifies. The other methods do not separate them: their
    list is empty and both intervals are one. `offset_per_acceleration` is the change of the offset by a pull or a mean
    crosswind, rad/(m/s^2).

    `next_driving` is the driving that would narrow this drive's part of the offset's interval, in words, the most
    useful first; of the joint method.
    """

    version: str
    log: str
    vehicle: Vehicle
    method: Method
    params: Mapping[str, float]
    sources: Mapping[str, str]
    notes: tuple[str, ...]
    offset: Estimate
    offset_ci95_drive: tuple[float, float] | None
    not_identifiable: tuple[Cause, ...]
    offset_per_acceleration: float
    understeer_gradient: Estimate
    backlash: Estimate
    unloading_acceleration: Estimate
    equivalent_wheelbase: Estimate
    yaw_rate_bias: Estimate
    lateral_acceleration_bias: Estimate
    wheel_radius_mismatch_rear: Estimate
    wheel_radius_mismatch_front: Estimate
    variance_if_independent_rad2: float | None
    side_force_s: tuple[float, float]
    missing_loading_s: tuple[float, float]
    changes: tuple[Change, ...]
    sensor_fault: str
    duration_s: float
    used_s: float
    unused_s: float
    rejected_s: Mapping[str, float]
    findings: tuple[Finding, ...]
    drives: tuple[Signals, ...]
    summary: Summary | None
    next_driving: tuple[str, ...] = ()

    @property
    def correction(self) -> Correction | None:
        """None unless the offset is valid; None for a relative sensor, whose zero changes at each ignition."""
        if self.offset.value is None or self.offset.status != "valid" or any(map(is_relative, self.drives)):
            return None
        return Correction(self.vehicle.offset_applied_deg * DEGREE, -self.offset.value)

    def words(self) -> str:
        """The answer in one paragraph."""
        parts = [self.offset_words(), *self._correction_words()]
        if self.backlash.value is not None:
            parts.append(f"the steering has {_play(self.backlash)} of play")
        bias = self.yaw_rate_bias.value if self.yaw_rate_bias.status in ("valid", "converging") else None
        if self.method == "joint" and bias is not None and abs(bias) > _CORRECTION_REPORTED_FROM_RAD_S:
            parts.append(f"corrected for a gyro bias of {bias / DEGREE:.2g} deg/s")
        return "; ".join([*parts, self._driven()])

    def offset_words(self) -> str:
        """The straight-ahead offset with both parts of its interval."""
        value, drive = self.offset.value, self.offset_half_width_rad
        if value is None or drive is None:
            return f"straight-ahead offset {self.offset.status}"
        more = 1.96 * together_rad(self.not_identifiable)
        digits = 1 if drive >= 0.095 * DEGREE else 2
        of_drive = f" from {'this drive' if len(self.drives) == 1 else 'these logs'}" if self.method == "joint" else ""
        status = "" if self.offset.status in ("valid", "invalid") else f" ({self.offset.status})"
        begin = f"invalid; {NOT_YET_OR_NO_MORE['invalid']} " if self.offset.status == "invalid" else ""
        words = f"straight-ahead offset {begin}{number(value, digits)} deg ± {number(drive, digits)}{of_drive}{status}"
        causes = in_words(self.not_identifiable)
        if not causes:
            return words
        return f"{words}; {causes} can add ± {number(more, digits)} deg"

    @property
    def quantities(self) -> dict[str, Estimate]:
        """By name, for people."""
        return {
            "straight-ahead offset": self.offset,
            "understeer gradient": self.understeer_gradient,
            "free play": self.backlash,
            "neutral lateral acceleration": self.unloading_acceleration,
            "yaw rate bias": self.yaw_rate_bias,
            "lateral acceleration bias": self.lateral_acceleration_bias,
        }

    @property
    def offset_half_width_rad(self) -> float | None:
        """Of `offset_ci95_drive`."""
        return None if self.offset_ci95_drive is None else 0.5 * (self.offset_ci95_drive[1] - self.offset_ci95_drive[0])

    def _correction_words(self) -> list[str]:
        """Empty where the interval contains zero: a correction could then increase the error."""
        ci95 = self.offset.ci95
        if self.correction is None or ci95 is None or ci95[0] <= 0.0 <= ci95[1]:
            return []
        return [self.correction.words()]

    def _driven(self) -> str:
        """The usable part of the drive, and the most frequent reasons for the rest."""
        unit, per_unit = ("minutes", 60.0) if self.duration_s >= 120.0 else ("seconds", 1.0)
        digits = 0 if self.duration_s / per_unit >= 10.0 else 1
        worst = sorted(((s, name) for name, s in self.rejected_s.items() if s > 0.05 * self.duration_s), reverse=True)
        rejected = [f"{s / per_unit:.{digits}f} rejected for {name.replace('_', ' ')}" for s, name in worst[:3]]
        usable = f"{self.used_s / per_unit:.{digits}f} of {self.duration_s / per_unit:.{digits}f} {unit} usable"
        return ", ".join([usable, *rejected])

    def __repr__(self) -> str:
        return f"Answer({self.log!r}, offset {self.offset}, {len(self.findings)} findings)"

    def _repr_html_(self) -> str:
        from oncenter.notebook import answer_table

        return answer_table(self)

    def __str__(self) -> str:
        lines = [self.words()]
        lines += [finding.line() for finding in self.findings]
        return "\n".join(lines)

    def to_dict(self, schema: Schema = DEFAULT_SCHEMA) -> dict[str, Any]:
        """The object of the schema oncenter/offset-2, or of offset-1, which lacks the parts of the interval."""
        return {
            "schema": f"oncenter/{schema}",
            "version": self.version,
            "log": self.log,
            "vehicle": self.vehicle.name,
            "method": self.method,
            "params": dict(self.params),
            "signals": dict(self.sources),
            "offset": {
                **self.offset.to_dict(),
                "variance_if_independent_deg2": None
                if self.offset.value is None or self.variance_if_independent_rad2 is None
                else self.variance_if_independent_rad2 / DEGREE**2,
                **({} if schema == "offset-1" else self._parts()),
            },
            **({} if schema == "offset-1" else self._correction()),
            **({} if schema == "offset-1" else self._verdicts()),
            "understeer_gradient": self.understeer_gradient.to_dict(),
            "backlash": self.backlash.to_dict(),
            "unloading_acceleration": self.unloading_acceleration.to_dict(),
            "equivalent_wheelbase": self.equivalent_wheelbase.to_dict(),
            "yaw_rate_bias": self.yaw_rate_bias.to_dict(),
            "lateral_acceleration_bias": self.lateral_acceleration_bias.to_dict(),
            "wheel_radius_mismatch_rear": self.wheel_radius_mismatch_rear.to_dict(),
            "wheel_radius_mismatch_front": self.wheel_radius_mismatch_front.to_dict(),
            "changes": [change.to_dict() for change in self.changes],
            "time": {
                "duration_s": self.duration_s,
                "used_s": self.used_s,
                "unused_s": self.unused_s,
                "rejected_s": {name: s for name, s in self.rejected_s.items() if s > 0},
            },
            "findings": [finding.to_dict() for finding in self.findings],
            "notes": list(self.notes),
        }

    def _parts(self) -> dict[str, Any]:
        drive = self.offset_ci95_drive
        return {
            "applied_deg": self.vehicle.offset_applied_deg,
            "ci95_drive": None if drive is None else [bound / DEGREE for bound in drive],
            "not_identifiable": [cause.to_dict() for cause in self.not_identifiable],
        }

    def _correction(self) -> dict[str, Any]:
        return {"correction": NO_CORRECTION if self.correction is None else self.correction.to_dict()}

    def _verdicts(self) -> dict[str, Any]:
        from oncenter.verdict import verdicts_of

        verdicts = [verdict.to_dict() for verdict in verdicts_of(self)]
        return {"limit_deg": self.vehicle.offset_limit_deg, "verdicts": verdicts}

    def to_json(self, schema: Schema = DEFAULT_SCHEMA) -> str:
        return json.dumps(self.to_dict(schema), ensure_ascii=False, allow_nan=False, indent=2)


def number(value_rad: float, digits: int) -> str:
    """In degrees; never -0.0."""
    return f"{round(value_rad / DEGREE, digits) + 0.0:.{digits}f}"


def _file_unit(unit: str) -> tuple[float, str]:
    """The factor to SI, and the name, of the unit in which files give an SI unit."""
    return (DEGREE, unit.replace("rad", "deg")) if unit.startswith("rad") else (1.0, unit)


def _play(play: Estimate) -> str:
    """Its width in words, with the interval where that is wide."""
    assert play.value is not None and play.ci95 is not None
    low, high = (bound / DEGREE for bound in play.ci95)
    if low < _NO_PLAY_DEG:
        return f"at most {high:.1f} deg"
    return f"{play.value / DEGREE:.1f} deg" + (f" ({low:.1f} to {high:.1f})" if high - low > 1.0 else "")
