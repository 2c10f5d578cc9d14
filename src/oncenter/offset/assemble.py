"""The core's answer becomes an `Answer`, with the findings and with the notes on logs and sources."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from oncenter import _core
from oncenter.errors import OncenterError
from oncenter.estimates.bounds import Bounded, bounded
from oncenter.estimates.by_priors import OffsetBy
from oncenter.estimates.cause import Cause, Pull, causes_of
from oncenter.estimates.changes import Change, changes_of
from oncenter.estimates.estimate import Estimate
from oncenter.estimates.estimates import Method
from oncenter.findings import Finding
from oncenter.offset.answer import Answer
from oncenter.offset.core_findings import findings_of
from oncenter.offset.inputs import needed
from oncenter.offset.joint_findings import joint_findings, moves_within, next_driving
from oncenter.offset.rear_axle import (
    is_combined,
    rear_axle_findings,
    with_fitting_bends,
    with_offsets_of_both_axles,
)
from oncenter.offset.signal_fault import without_estimates
from oncenter.offset.withheld import Gaps, gaps_in, withheld_by_oncenter
from oncenter.plausibility.signal_fault import has_signal_fault, signal_fault
from oncenter.read.whole_turns import is_relative
from oncenter.signals import DEGREE, SIGNALS, Signals
from oncenter.truck.zero import Zero
from oncenter.vehicle import Vehicle

_WHOLE_FROM_ROWS = 3  # a core that still receives ticks has the first and the last row only


def answer_so_far(
    native: _core.OcAnswer, received: Signals, vehicle: Vehicle, params: Mapping[str, float], gaps: Gaps
) -> Answer:
    """The joint method's answer of a core that still receives ticks.

    Args:
        native: its oc_answer as a dict.
        received: log, rate and sources; the first and the last row of its table are enough.
        vehicle: of the core.
        params: in force.
        gaps: in all ticks received.

    Raises:
        OncenterError: "no_usable_second".
    """
    changes = changes_of(native, [native["changes"]], (received,))
    answer = answer_of(native, changes, (received,), vehicle, "joint", params, gaps)
    answer = with_fitting_bends(with_offsets_of_both_axles(answer), (received,))
    return replace(answer, findings=(*answer.findings, *rear_axle_findings(answer, (received,))))


def answer_of(
    native: _core.OcAnswer,
    changes: tuple[Change, ...],
    drives: tuple[Signals, ...],
    vehicle: Vehicle,
    method: Method,
    params: Mapping[str, float],
    gaps: Gaps | None = None,
) -> Answer:
    rejected_s = dict(zip(_core.REASONS, native["rejected"], strict=True))
    if native["duration"] <= rejected_s["missing_signal"]:
        raise OncenterError(
            f"{drives[0].log}: no usable second, since its signals are never available at the same time",
            code="no_usable_second",
            needs=needed(method, drives, params),
        )
    answer = Answer(
        version=_core.version(),
        log=", ".join(drive.log for drive in drives),
        vehicle=vehicle,
        method=method,
        params=params,
        sources={name: source.description for drive in drives for name, source in drive.sources.items()},
        notes=notes_of(drives),
        offset=_of(native, "offset", "rad"),
        offset_ci95_drive=_ci95_drive(native),
        not_identifiable=_not_identifiable(native, vehicle, method, params),
        offset_per_acceleration=native["offset_parts"]["per_acceleration"],
        understeer_gradient=_of_ratio(_of(native, "understeer_gradient", "rad/(m/s^2)"), vehicle),
        backlash=_not_negative(_of(native, "backlash", "rad")),
        unloading_acceleration=_of(native, "unloading_acceleration", "m/s^2"),
        equivalent_wheelbase=_of_ratio(_of(native, "equivalent_wheelbase", "m"), vehicle),
        ratio_times_wheelbase=_product(native, vehicle),
        understeer_at_steering_wheel=_times_ratio(_of(native, "understeer_gradient", "rad/(m/s^2)"), vehicle),
        yaw_rate_bias=_of(native, "yaw_rate_bias", "rad/s"),
        lateral_acceleration_bias=Estimate(None, None, "unobservable", "m/s^2"),
        wheel_radius_mismatch_rear=_of(native, "wheel_radius_mismatch_rear", "1"),
        wheel_radius_mismatch_front=_of(native, "wheel_radius_mismatch_front", "1"),
        variance_if_independent_rad2=None if method == "joint" else native["offset_variance_if_independent"],
        side_force_s=(native["loaded_left_s"], native["loaded_right_s"]),
        missing_loading_s=(native["lacking_to_left"], native["lacking_to_right"]),
        changes=changes,
        sensor_fault=_core.FAULTS[native["fault"]],
        duration_s=native["duration"],
        used_s=native["used"],
        unused_s=native["unused"],
        rejected_s=rejected_s,
        findings=_findings(native, changes, drives, vehicle, method, params, gaps),
        drives=drives,
        next_driving=next_driving(native, params, vehicle) if method == "joint" else (),
        zero=_zero(native, changes, drives),
        pull=_given_pull(params, native["offset_parts"]["per_acceleration"]),
    )
    if has_signal_fault(native) and answer.sensor_fault == "none":
        return without_estimates(answer, signal_fault(native, drives, vehicle))
    return answer


def _of_ratio(estimate: Estimate, vehicle: Vehicle) -> Estimate:
    """The estimate, without its value where the steering ratio by which it was divided is only assumed."""
    return (
        replace(estimate, value=None, ci95=None, status="unobservable")
        if "steering_ratio" in vehicle.assumed
        else estimate
    )


def _times_ratio(estimate: Estimate, vehicle: Vehicle) -> Estimate:
    """The estimate at the steering wheel; the core gives it at the road wheels of the vehicle's ratio."""
    if estimate.value is None or estimate.ci95 is None:
        return estimate
    ratio, (low, high) = vehicle.ratio_near_centre, estimate.ci95
    return replace(estimate, value=ratio * estimate.value, ci95=(ratio * low, ratio * high))


def _product(native: _core.OcAnswer, vehicle: Vehicle) -> Estimate:
    """Ratio times wheelbase. Of an unknown truck also where the drive hardly identifies it."""
    found = native["equivalent_wheelbase"]
    if vehicle.assumed and _core.status_of(found) == "unobservable" and native["used"] > 0.0:
        found = {**found, "status": _core.STATUSES.index("converging")}
    return _times_ratio(bounded("equivalent_wheelbase", _estimate(found, "m")), vehicle)


def _given_pull(params: Mapping[str, float], per_acceleration: float) -> Pull | None:
    """Of the vehicle file."""
    value, sd = params["known_pull_m_s2"], params["known_pull_sd_m_s2"]
    return Pull(value, sd, abs(value) * per_acceleration / DEGREE) if sd > 0.0 else None


def _findings(
    native: _core.OcAnswer,
    changes: tuple[Change, ...],
    drives: tuple[Signals, ...],
    vehicle: Vehicle,
    method: Method,
    params: Mapping[str, float],
    gaps: Gaps | None,
) -> tuple[Finding, ...]:
    names = needed(method, drives, params)
    has_acceleration = any(SIGNALS["lateral_acceleration"].column in drive.columns for drive in drives)
    return findings_of(
        native,
        params,
        any(is_relative(drive) for drive in drives),
        method=method,
        yaw_rate_from_vdc2=all(
            "yaw_rate" in drive.sources and "VDC2" in drive.sources["yaw_rate"].description for drive in drives
        ),
        limit_deg=vehicle.offset_limit_deg,
        of_both_axles=is_combined(params),
        angle_ends=_angle_ends(drives) if _core.FAULTS[native["fault"]] == "lost" else None,
        withheld=withheld_by_oncenter(native, gaps or gaps_in(drives, names), names),
        measures_banks=bool(params["use_accelerometer"]) and (method != "wheel-speed" or has_acceleration),
        of_method=joint_findings(native, params, changes, vehicle) if method == "joint" else (),
    )


def _zero(native: _core.OcAnswer, changes: tuple[Change, ...], drives: tuple[Signals, ...]) -> Zero:
    if any(map(is_relative, drives)):
        return "relative"
    return "moves" if moves_within(native, changes) else "fixed"


def _angle_ends(drives: Iterable[Signals]) -> str | None:
    """Time and log of the last steering wheel angle; None where the tables do not have all rows."""
    found = None
    for drive in drives:
        column = SIGNALS["steering_wheel_angle"].column
        if column not in drive.columns or drive.ticks < _WHOLE_FROM_ROWS:
            continue
        time, angle = drive.columns["time_s"], drive.columns[column]
        available = np.flatnonzero(np.isfinite(angle))
        if len(available):
            found = f"{(time[available[-1]] - time[0]) / 60.0:.1f} min into {Path(drive.log).name}"
    return found


def notes_of(drives: Iterable[Signals]) -> tuple[str, ...]:
    """How logs were read: the sources that were used, and the parts that were left out."""
    return tuple(dict.fromkeys(note for drive in drives for note in (*_choices(drive), *drive.notes)))


def _choices(drive: Signals) -> list[str]:
    """The source that was used, for core signals with several sources; one line per choice."""
    chosen: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    for name, source in drive.sources.items():
        if source.others and SIGNALS[name].column in _core.COLUMNS:
            chosen.setdefault((source.description, source.others), []).append(name)
    return [
        f"{', '.join(names)} {'is' if len(names) == 1 else 'are'} taken from {source}, not from {', '.join(others)}"
        for (source, others), names in chosen.items()
    ]


def _estimate(native: _core.OcEstimate, unit: str) -> Estimate:
    status = _core.status_of(native)
    if status == "unobservable":
        return Estimate(None, None, status, unit, native["evidence"])
    return Estimate(native["value"], _core.ci95(native), status, unit, native["evidence"])


def _of(native: _core.OcAnswer, name: Bounded, unit: str) -> Estimate:
    return bounded(name, _estimate(native[name], unit))


def _ci95_drive(native: _core.OcAnswer) -> tuple[float, float] | None:
    if _core.status_of(native["offset"]) == "unobservable":
        return None
    value, half_width = native["offset"]["value"], 1.96 * native["offset_parts"]["drive_sd"]
    return value - half_width, value + half_width


def offset_by(native: _core.OcAnswer) -> OffsetBy | None:
    """The offset of an oc_answer with both intervals; None where it is not observable."""
    value, own, whole = native["offset"]["value"], _ci95_drive(native), _of(native, "offset", "rad").ci95
    return None if own is None or whole is None else OffsetBy(value, own, whole)


def _not_identifiable(
    native: _core.OcAnswer, vehicle: Vehicle, method: Method, params: Mapping[str, float]
) -> tuple[Cause, ...]:
    """Empty for the other methods, whose interval does not separate them, and for an unobservable offset."""
    if method != "joint" or _core.status_of(native["offset"]) == "unobservable":
        return ()
    return tuple(causes_of(native["offset_parts"], params, native["traffic_side"], vehicle.learned))


def _not_negative(estimate: Estimate) -> Estimate:
    """The estimate with an interval that ends at zero, for a quantity that cannot be negative."""
    if estimate.value is None or estimate.ci95 is None:
        return estimate
    low, high = estimate.ci95
    return replace(estimate, value=max(estimate.value, 0.0), ci95=(max(low, 0.0), max(high, 0.0)))
