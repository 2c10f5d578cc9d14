"""Signals, vehicle and params become an answer: one run of the core per drive, then its numbers in words.

SI and rad inside; degrees appear in `Answer.words`, `Answer.to_json` and in findings, which are for people and files.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from oncenter import _core
from oncenter.changes import Change, changes_of
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.findings import Finding, findings_of
from oncenter.joint_findings import joint_findings
from oncenter.read.whole_turns import is_relative, without_whole_turns
from oncenter.signals import DEGREE, SIGNALS, Signals
from oncenter.vehicle import Vehicle, core_params

REASONS = _core.REASONS
Method = Literal["thesis", "joint", "wheel-speed"]
METHODS: tuple[Method, ...] = ("thesis", "joint", "wheel-speed")
DEFAULT_METHOD: Method = "joint"

_NEEDED = ("steering_wheel_angle", "yaw_rate", "vehicle_speed")
_AXLES = ("rear", "front")  # whose wheel speeds stand for the motion, the better one first
_ROWS_AT_ONCE = 1_000_000  # between two reports of progress
_RATES_ALIKE = 0.01  # of the rate; clocks differ by less
_DRIVING_M_S = 8.0
_HELD_S, _HELD_RAD = 1.0, 0.25 * DEGREE  # what stays as much the same for so long may be stuck: as core/sensor_fault.c
_GRADIENT_ODD = 0.1 * DEGREE  # rad/(m/s^2): a sensor of the wrong sign has less
_UNEXPLAINED_ODD = 1.5 * DEGREE  # rad, of a second: several times what a healthy one leaves
_NO_PLAY_DEG = 0.5  # an interval that reaches below it may be of none
_CORRECTION_WORTH_TELLING_RAD_S = 0.05 * DEGREE


@dataclass(frozen=True)
class Estimate:
    """A quantity with its interval and standing; `value` and `ci95` are None where the drive gives none.

    `unit` is the SI unit of value and ci95; `evidence_s` the seconds of driving behind it.
    """

    value: float | None
    ci95: tuple[float, float] | None
    status: str
    unit: str
    evidence_s: float = 0.0

    def to_dict(self) -> dict[str, Any]:
        """As files hold it: degrees for radians."""
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


@dataclass(frozen=True)
class Answer:
    """What a drive, or several of one truck, say of its steering wheel angle sensor.

    `str(answer)` is the answer in words, `to_json` the contract's object. Times are in seconds of ticks;
    duration_s = used_s + unused_s, and the reasons in `rejected_s` overlap. `drives` are the tables answered, so that
    `trace` can run them again. The wheel radius mismatch of an axle is its left radius over its right less one;
    `unloading_acceleration` is the lateral acceleration, as measured, at which the steering is without side force;
    `equivalent_wheelbase` the one of (10) that bends ask for, an error of the steering ratio counted as one of it.
    `side_force_s` are the seconds of side force clearly to the left and to the right: which flank of the play was seen,
    and for how long; of the joint method.
    `changes` are those that the drive proved, the first one first; of more than the core keeps, the last.
    `sensor_fault` is what is wrong with the angle sensor in the end, "none" or one of the core's names: the offset is
    `invalid` then and tells what was learned before.
    """

    version: str
    log: str
    vehicle: Vehicle
    method: Method
    params: Mapping[str, float]
    sources: Mapping[str, str]
    notes: tuple[str, ...]
    offset: Estimate
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
    changes: tuple[Change, ...]
    sensor_fault: str
    duration_s: float
    used_s: float
    unused_s: float
    rejected_s: Mapping[str, float]
    findings: tuple[Finding, ...]
    drives: tuple[Signals, ...]

    def words(self) -> str:
        """The answer in one paragraph."""
        parts = [f"offset {self.offset}"]
        if self.backlash.value is not None:
            parts.append(f"the steering has {_play(self.backlash)} of play")
        bias = self.yaw_rate_bias.value
        if self.method == "joint" and bias is not None and abs(bias) > _CORRECTION_WORTH_TELLING_RAD_S:
            parts.append(f"the gyro is off by {bias / DEGREE:.2g} deg/s and was corrected")
        return "; ".join([*parts, self._driven()])

    def _driven(self) -> str:
        """How much of the drive was of use, and what took the most of the rest."""
        unit, per_unit = ("minutes", 60.0) if self.duration_s >= 120.0 else ("seconds", 1.0)
        digits = 0 if self.duration_s / per_unit >= 10.0 else 1
        worst = sorted(((s, name) for name, s in self.rejected_s.items() if s > 0.05 * self.duration_s), reverse=True)
        rejected = [f"{s / per_unit:.{digits}f} rejected for {name.replace('_', ' ')}" for s, name in worst[:3]]
        driven = f"driven {self.used_s / per_unit:.{digits}f} of {self.duration_s / per_unit:.{digits}f} {unit} usable"
        return ", ".join([driven, *rejected])

    def __str__(self) -> str:
        lines = [self.words()]
        lines += [f"{finding.severity}: {finding.text}" for finding in self.findings]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """The object of the schema oncenter/offset-1."""
        return {
            "schema": "oncenter/offset-1",
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
            },
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

    def to_json(self) -> str:
        return json.dumps(self.to_dict(), ensure_ascii=False, allow_nan=False, indent=2)


def offset(
    signals: Signals | Sequence[Signals],
    vehicle: Vehicle,
    *,
    method: Method = DEFAULT_METHOD,
    params: Mapping[str, float] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Answer:
    """The steering wheel angle offset from one drive, or from several of one truck.

    Args:
        signals: what `oncenter.read` or `oncenter.simulate` gave; several are put in order of time.
        vehicle: what `oncenter.vehicle` gave; its `[params]` apply.
        method: "joint", offset, understeer gradient, play and the gyro's bias together; "thesis", (36) to (38) of
            docs/method.md; "wheel-speed", the same from the angle and the wheel speeds of one axle (the rear one's
            where the log has them), whose track width the vehicle must tell.
        params: over the vehicle's; names and units as in core/params.h.
        progress: called with the fraction done.

    Raises:
        OncenterError: "missing_signal", "no_usable_second" (exit 1); "method", "params", "rates_differ",
            "track_width" (exit 2).
    """
    if method not in METHODS:
        raise OncenterError(
            f"method '{method}' is not known; known are {', '.join(METHODS)}", code="method", exit_code=WRONG_USAGE
        )
    drives = _in_order((signals,) if isinstance(signals, Signals) else tuple(signals))
    used_params = _params_of(vehicle, params)
    _check(drives, _needed(method, drives, used_params))
    drives = without_whole_turns(drives)
    core, changes_found = _run(drives, vehicle, used_params, method, progress, None)
    native = core.answer()
    if method == "joint" and (is_odd(native) or _is_held_at_the_end(drives[-1])):
        core, found = _run(drives, vehicle, used_params, method, None, None, judge_sensor=True)
        if offset_is_invalid(judged := core.answer()):
            native, changes_found = judged, found
    return _answer(native, changes_of(native, changes_found, drives), drives, vehicle, method, used_params)


def is_odd(native: Mapping[str, Any]) -> bool:
    """Whether an angle sensor at fault could have given that oc_answer: then it is worth the time to judge it."""
    unsettled = native["changes"] and _core.STATUSES[native["offset"]["status"]] != "valid"
    gradient = native["understeer_gradient"]
    at_most = gradient["value"] + 2.0 * gradient["standard_deviation"]
    return bool(unsettled or at_most < _GRADIENT_ODD or native["unexplained"] > _UNEXPLAINED_ODD)


def _is_held_at_the_end(drive: Signals) -> bool:
    """Whether the angle has last said the same while driving, or nothing: what was learned before may well be valid."""
    angle, speed = (drive.table[name].to_numpy() for name in ("steering_wheel_angle_rad", "vehicle_speed_m_s"))
    if np.isnan(angle[-1]):
        return True
    last = angle[-int(_HELD_S * drive.rate_hz) - 1 :]  # as a rule it moved there, and the rest need not be looked at
    if len(last) < len(angle) and _moved(last).any():
        return False
    moved = np.flatnonzero(_moved(angle))
    since = int(moved[-1]) + 1 if len(moved) else 0
    return bool(np.count_nonzero(speed[since:] > _DRIVING_M_S) / drive.rate_hz > _HELD_S)


def _moved(angle: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """By row, whether the angle (rad) was another than in the last one, or none."""
    same: npt.NDArray[np.bool_] = np.abs(angle - angle[-1]) <= _HELD_RAD
    return ~same


def offset_is_invalid(native: Mapping[str, Any]) -> bool:
    """Whether an oc_answer says that the sensor is at fault."""
    return bool(_core.STATUSES[native["offset"]["status"]] == "invalid")


def answer_so_far(native: Mapping[str, Any], seen: Signals, vehicle: Vehicle, params: Mapping[str, float]) -> Answer:
    """The joint method's answer of a core that is still being fed.

    Args:
        native: its oc_answer as a dict.
        seen: tells log, rate and sources; of its table the first and the last row are enough.
        vehicle: whose core it is.
        params: all that are in force.

    Raises:
        OncenterError: "no_usable_second".
    """
    changes = changes_of(native, [native["changes"]], (seen,))
    return _answer(native, changes, (seen,), vehicle, "joint", params)


def trace(answer: Answer) -> npt.NDArray[np.void]:
    """What each tick of an answer gave: the core's oc_output, one row per row of all its drives, in order."""
    outputs = np.zeros(sum(drive.table.height for drive in answer.drives), _core.OUTPUT_DTYPE)
    judge_sensor = answer.sensor_fault != "none"
    _run(answer.drives, answer.vehicle, answer.params, answer.method, None, outputs, judge_sensor=judge_sensor)
    return outputs


def _params_of(vehicle: Vehicle, params: Mapping[str, float] | None) -> dict[str, float]:
    try:
        return _core.default_params() | core_params({**vehicle.params, **(params or {})})
    except ValueError as error:
        raise OncenterError(str(error), code="params", exit_code=WRONG_USAGE) from None


def _in_order(drives: tuple[Signals, ...]) -> tuple[Signals, ...]:
    """By their first time stamp, unless they overlap, as logs do that all start at zero: then as they were given."""
    by_time = sorted(drives, key=lambda drive: float(drive.table["time_s"][0]))
    apart = all(
        float(before.table["time_s"][-1]) < float(after.table["time_s"][0]) for before, after in pairwise(by_time)
    )
    return tuple(by_time) if apart else drives


def _needed(method: Method, drives: Sequence[Signals], params: Mapping[str, float]) -> tuple[str, ...]:
    if method == "wheel-speed":
        return ("steering_wheel_angle", *_wheels(_axle(drives)))
    return (*_NEEDED, "lateral_acceleration") if params["use_accelerometer"] else _NEEDED


def _wheels(axle: str) -> tuple[str, str]:
    return f"wheel_speed_{axle}_left", f"wheel_speed_{axle}_right"


def _axle(drives: Sequence[Signals]) -> str:
    """The first axle of which all drives have both wheels; the first of all where none has."""

    def has_both(axle: str) -> bool:
        return all(SIGNALS[wheel].column in drive.table.columns for drive in drives for wheel in _wheels(axle))

    return next(filter(has_both, _AXLES), _AXLES[0])


def _track_widths(vehicle: Vehicle, method: Method, drives: Sequence[Signals]) -> dict[str, float]:
    """As the core takes them, 0 where unknown; for wheel speeds alone only the axle's that is used."""
    widths = {"front": vehicle.track_width_front_m or 0.0, "rear": vehicle.track_width_rear_m or 0.0}
    if method == "wheel-speed":
        axle = _axle(drives)
        if widths[axle] == 0.0:
            raise OncenterError(
                f"method 'wheel-speed' needs 'track_width_{axle}_m' in the vehicle file",
                code="track_width",
                exit_code=WRONG_USAGE,
                needs=(f"track_width_{axle}_m",),
            )
        if axle == "front":
            widths["rear"] = 0.0
    return {f"track_width_{axle}_m": width for axle, width in widths.items()}


def _check(drives: tuple[Signals, ...], needed: Sequence[str]) -> None:
    from oncenter.read import require

    for drive in drives:
        require(drive, needed)
        if abs(drive.rate_hz / drives[0].rate_hz - 1) > _RATES_ALIKE:
            raise OncenterError(
                f"{drive.log} has {drive.rate_hz:g} Hz and {drives[0].log} {drives[0].rate_hz:g} Hz: "
                "logs in one call must have one rate; answer them one by one",
                code="rates_differ",
                exit_code=WRONG_USAGE,
            )


def _run(
    drives: Sequence[Signals],
    vehicle: Vehicle,
    params: Mapping[str, float],
    method: Method,
    progress: Callable[[float], None] | None,
    outputs: npt.NDArray[np.void] | None,
    *,
    judge_sensor: bool = False,
) -> tuple[_core.Core, list[int]]:
    """The core after all drives, and how many changes it had found when each ended; fills `outputs`, one row a tick,
    when given."""
    widths = _track_widths(vehicle, method, drives)
    core = _core.Core(
        vehicle.wheelbase_m,
        vehicle.ratio_near_centre,
        params,
        drives[0].rate_hz,
        method=method,
        angle_method="observer" if judge_sensor else "none",
        traffic_side=vehicle.traffic_sign,
        track_width_front_m=widths["track_width_front_m"],
        track_width_rear_m=widths["track_width_rear_m"],
    )
    rows = sum(drive.table.height for drive in drives)
    done = 0
    changes_found = []
    for drive in drives:
        core.restart()
        columns = {name: drive.table[name].to_numpy() for name in _core.COLUMNS if name in drive.table.columns}
        for start in range(0, drive.table.height, _ROWS_AT_ONCE):
            part = {name: column[start : start + _ROWS_AT_ONCE] for name, column in columns.items()}
            count = len(part["time_s"])
            core.run(part, None if outputs is None else outputs[done : done + count])
            done += count
            if progress is not None:
                progress(done / rows)
        changes_found.append(core.answer()["changes"])
    return core, changes_found


def _answer(
    native: Mapping[str, Any],
    changes: tuple[Change, ...],
    drives: tuple[Signals, ...],
    vehicle: Vehicle,
    method: Method,
    params: Mapping[str, float],
) -> Answer:
    rejected_s = dict(zip(REASONS, native["rejected"], strict=True))
    if native["duration"] <= rejected_s["missing_signal"]:
        raise OncenterError(
            f"{drives[0].log}: no usable second, at no time are all of its signals available together",
            code="no_usable_second",
            needs=_needed(method, drives, params),
        )
    relative = any(is_relative(drive) for drive in drives)
    yaw_rate_from_vdc2 = all(
        "yaw_rate" in drive.sources and "VDC2" in drive.sources["yaw_rate"].description for drive in drives
    )
    return Answer(
        version=_core.version(),
        log=", ".join(drive.log for drive in drives),
        vehicle=vehicle,
        method=method,
        params=params,
        sources={name: source.description for drive in drives for name, source in drive.sources.items()},
        notes=tuple(dict.fromkeys(note for drive in drives for note in (*_choices(drive), *drive.notes))),
        offset=_estimate(native["offset"], "rad"),
        understeer_gradient=_estimate(native["understeer_gradient"], "rad/(m/s^2)"),
        backlash=_not_negative(_estimate(native["backlash"], "rad")),
        unloading_acceleration=_estimate(native["unloading_acceleration"], "m/s^2"),
        equivalent_wheelbase=_estimate(native["equivalent_wheelbase"], "m"),
        yaw_rate_bias=_estimate(native["yaw_rate_bias"], "rad/s"),
        lateral_acceleration_bias=Estimate(None, None, "unobservable", "m/s^2"),
        wheel_radius_mismatch_rear=_estimate(native["wheel_radius_mismatch_rear"], "1"),
        wheel_radius_mismatch_front=_estimate(native["wheel_radius_mismatch_front"], "1"),
        variance_if_independent_rad2=None if method == "joint" else native["offset_variance_if_independent"],
        side_force_s=(native["side_force_to_left"], native["side_force_to_right"]),
        changes=changes,
        sensor_fault=_core.FAULTS[native["fault"]],
        duration_s=native["duration"],
        used_s=native["used"],
        unused_s=native["unused"],
        rejected_s=rejected_s,
        findings=findings_of(
            native,
            params,
            relative,
            method=method,
            yaw_rate_from_vdc2=yaw_rate_from_vdc2,
            of_method=_joint_findings(native, params, changes, vehicle) if method == "joint" else (),
        ),
        drives=drives,
    )


def _joint_findings(
    native: Mapping[str, Any], params: Mapping[str, float], changes: tuple[Change, ...], vehicle: Vehicle
) -> Iterable[Finding | None]:
    return joint_findings(
        native,
        params,
        changes,
        steering_ratio=vehicle.ratio_near_centre,
        wheelbase_m=vehicle.wheelbase_m,
        traffic_sign=vehicle.traffic_sign,
    )


def _choices(drive: Signals) -> list[str]:
    """Which source was believed, of the signals that the core reads and several sources had; one line a choice."""
    chosen: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    for name, source in drive.sources.items():
        if source.others and SIGNALS[name].column in _core.COLUMNS:
            chosen.setdefault((source.description, source.others), []).append(name)
    return [
        f"{', '.join(names)} {'is' if len(names) == 1 else 'are'} taken from {source}, not from {', '.join(others)}"
        for (source, others), names in chosen.items()
    ]


def _estimate(native: Mapping[str, Any], unit: str) -> Estimate:
    status = _core.STATUSES[native["status"]]
    if status == "unobservable":
        return Estimate(None, None, status, unit, native["evidence"])
    value = native["value"]
    half_width = 1.96 * native["standard_deviation"]
    return Estimate(value, (value - half_width, value + half_width), status, unit, native["evidence"])


def _file_unit(unit: str) -> tuple[float, str]:
    """The factor to SI, and the name, of the unit in which files give an SI unit."""
    return (DEGREE, unit.replace("rad", "deg")) if unit.startswith("rad") else (1.0, unit)


def _not_negative(estimate: Estimate) -> Estimate:
    """With an interval that ends at zero, for what cannot be less."""
    if estimate.value is None or estimate.ci95 is None:
        return estimate
    low, high = estimate.ci95
    return replace(estimate, value=max(estimate.value, 0.0), ci95=(max(low, 0.0), max(high, 0.0)))


def _play(play: Estimate) -> str:
    """Its width in words, with the interval where that is more than a detail."""
    assert play.value is not None and play.ci95 is not None
    low, high = (bound / DEGREE for bound in play.ci95)
    if low < _NO_PLAY_DEG:
        return f"at most {high:.1f} deg"
    return f"{play.value / DEGREE:.1f} deg" + (f" ({low:.1f} to {high:.1f})" if high - low > 1.0 else "")
