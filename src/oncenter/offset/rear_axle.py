"""A steered rear axle: its zero, read while the axle is locked, and the offsets of both axles' sensors."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from oncenter.errors import OncenterError
from oncenter.estimates.estimate import Estimate, number
from oncenter.findings import Finding, Kind, finding
from oncenter.signals import DEGREE, SIGNALS, Signals

if TYPE_CHECKING:
    from oncenter.estimates.estimates import Method
    from oncenter.offset.answer import Answer

WEIGHT, _ZERO, _ZERO_SD = "rear_axle_weight_1", "known_rear_axle_zero_rad", "known_rear_axle_zero_sd_rad"
_REAR, _ANGLE, _SPEED = (SIGNALS[name].column for name in ("rear_axle_angle", "steering_wheel_angle", "vehicle_speed"))
# Tuned on bench/effects.py, rows `rear_locks_country_with_status` and `counter_phase_country_with_status`.
_WINDOW_S = 10  # in which an axle follows the steering wheel, or not
_MOVING_M_S = 3.0
_STEERED_RAD = 10.0 * DEGREE  # the steering wheel turns by at least this much within a window that is judged
_FOLLOWS_SHARE = 0.2  # of the usual motion per steering wheel angle; a locked axle moves less
_LOCKED_WINDOWS_MIN = 6  # one minute
_SPREAD_MAX_RAD = 0.03 * DEGREE  # of a locked axle's readings, but one in ten
_SHARE_MAX = 2.0  # of the front wheels' angle: no rear axle steers more than the front axle
_STEERS_RAD = 1.0 * DEGREE  # standard deviation: less may be noise
_TICKS_MIN = 100
_LIMIT_RAD = 1.5  # the core ignores more
_LOCKED_SD_RAD = 0.005 * DEGREE  # of their median: resolution, and how straight the lock holds the axle


def is_combined(params: Mapping[str, float]) -> bool:
    """Whether the core's offset is the combined one of the front and the rear axle's sensors."""
    return params[WEIGHT] > 0.0 and params[_ZERO_SD] == 0.0


def by_zero_sd(params: Mapping[str, float], steering_ratio: float) -> float:
    """Standard deviation of the offset by that of the rear axle's zero, rad."""
    return steering_ratio * params[WEIGHT] * params[_ZERO_SD]


def with_rear_axle(params: Mapping[str, float], method: Method, drives: Sequence[Signals]) -> dict[str, float]:
    """The params in force: without the rear axle's angle in all drives the front axle alone is taken to steer. The
    joint method takes the zero of an axle that is locked at times."""
    if params[WEIGHT] == 0.0:
        return dict(params)
    if not all(_REAR in drive.columns for drive in drives):
        return {**params, WEIGHT: 0.0}
    for drive in drives:
        reading = drive.columns[_REAR][np.isfinite(drive.columns[_REAR])]
        if len(reading) > 0 and np.median(np.abs(reading)) > _LIMIT_RAD:
            raise OncenterError(
                f"{drive.log}: rear_axle_angle is {np.median(reading) / DEGREE:.0f} deg in the middle, "
                "more than any axle steers: check its unit, in the [signals] table or at the end of its column's name",
                code="no_usable_second",
            )
    if method != "joint":
        return {**params, _ZERO: 0.0, _ZERO_SD: 0.0}
    zero_rad = None if params[_ZERO_SD] > 0.0 else locked_at(drives)
    return dict(params) if zero_rad is None else {**params, _ZERO: zero_rad, _ZERO_SD: _LOCKED_SD_RAD}


def locked_at(drives: Sequence[Signals]) -> float | None:
    """Reading of the rear axle's angle in bends in which the axle does not follow the steering wheel, and after which
    it does, rad; None where this is too rare, or differs."""
    windows = np.concatenate([_windows(drive) for drive in drives])
    if len(windows) == 0:
        return None
    reading, follows = windows[:, 0], windows[:, 1]
    still = follows <= _FOLLOWS_SHARE * np.quantile(follows, 0.9)
    last_followed = np.max(np.flatnonzero(~still), initial=0)
    locked = reading[:last_followed][still[:last_followed]]  # a reading that never changes again may be a stuck one
    if len(locked) < _LOCKED_WINDOWS_MIN or np.ptp(np.quantile(locked, (0.05, 0.95))) > _SPREAD_MAX_RAD:
        return None
    return float(np.median(locked))


def _windows(drive: Signals) -> npt.NDArray[np.float64]:
    """A row per window in which the steering wheel turns: mean of the rear axle's angle, and its range over that of
    the steering wheel; both of means of a second."""
    per_s = max(round(drive.rate_hz), 1)
    count = drive.ticks // (per_s * _WINDOW_S)
    if count == 0 or not {_REAR, _ANGLE, _SPEED} <= set(drive.columns):
        return np.zeros((0, 2))
    rear, angle, speed = (
        drive.columns[name][: count * per_s * _WINDOW_S].reshape(count, _WINDOW_S, per_s).mean(axis=2)
        for name in (_REAR, _ANGLE, _SPEED)
    )
    turned = np.ptp(angle, axis=1)
    judged = (turned > _STEERED_RAD) & (speed.min(axis=1) > _MOVING_M_S) & np.isfinite(rear).all(axis=1)
    reading, moved = rear[judged].mean(axis=1), np.ptp(rear[judged], axis=1)
    return np.stack([reading, moved / turned[judged]], axis=1)


def with_offsets_of_both_axles(answer: Answer) -> Answer:
    """The answer with the combined offset; with both sensors' offsets where the rear axle's zero is given or read."""
    weight, zero, zero_sd = (answer.params[name] for name in (WEIGHT, _ZERO, _ZERO_SD))
    if weight == 0.0:
        return answer
    status = "invalid" if answer.offset.status == "invalid" else "unobservable"
    unknown = Estimate(None, None, status, "rad")
    if is_combined(answer.params):
        return replace(
            answer,
            offset=unknown,
            offset_ci95_drive=None,
            not_identifiable=(),
            combined_offset=answer.offset,
            rear_axle_offset=unknown,
        )
    rear = Estimate(zero, (zero - 1.96 * zero_sd, zero + 1.96 * zero_sd), "valid", "rad")
    by_rear = answer.vehicle.ratio_near_centre * weight * zero
    offset = answer.offset
    if offset.value is None or offset.ci95 is None:
        return replace(answer, combined_offset=offset, rear_axle_offset=rear)
    by_sd = 1.96 * by_zero_sd(answer.params, answer.vehicle.ratio_near_centre)  # in the front offset alone
    low, high = (math.sqrt(max((end - offset.value) ** 2 - by_sd**2, 0.0)) for end in offset.ci95)
    value = offset.value - by_rear
    combined = replace(offset, value=value, ci95=(value - low, value + high))
    return replace(answer, combined_offset=combined, rear_axle_offset=rear)


def with_fitting_bends(answer: Answer, drives: Sequence[Signals]) -> Answer:
    """The vehicle file is not to be corrected where bends contradict it by the rear axle: by its angle, as one of a
    wrong sign or unit does, or by its lack."""
    by_bends = [finding for finding in answer.findings if finding.code == "wheelbase_or_ratio"]
    if not answer.vehicle.params.get(WEIGHT, 0.0) > 0.0:
        return answer
    others = tuple(finding for finding in answer.findings if finding not in by_bends)
    if answer.combined_offset is None:  # `rear_axle_findings` names the signal that is missing
        return replace(answer, findings=others)
    share = max((_share_of_front(drive, answer.vehicle.ratio_near_centre) for drive in drives), default=0.0)
    if share > _SHARE_MAX:
        others = (*others, _contradicts(f"rear_axle_angle turns {share:.0f} times as far as the front wheels do"))
    elif by_bends:
        others = (*others, _contradicts("bends need another steering wheel angle than calculated from rear_axle_angle"))
    answer = replace(answer, findings=others)
    if share <= _SHARE_MAX and not any(finding.severity == "warning" for finding in by_bends):
        return answer
    none = Estimate(None, None, "invalid", "rad")
    return replace(answer, offset=none, offset_ci95_drive=None, not_identifiable=(), combined_offset=none)


def _share_of_front(drive: Signals, steering_ratio: float) -> float:
    """How far the rear wheels turn over how far the front wheels do; 0 of a rear axle that hardly steers."""
    if not {_REAR, _ANGLE} <= set(drive.columns):
        return 0.0
    both = np.isfinite(drive.columns[_REAR]) & np.isfinite(drive.columns[_ANGLE])
    if np.count_nonzero(both) < _TICKS_MIN:
        return 0.0
    rear, front = np.std(drive.columns[_REAR][both]), np.std(drive.columns[_ANGLE][both]) / steering_ratio
    return float(rear / front) if rear > _STEERS_RAD and front > 0.0 else 0.0


def rear_axle_findings(answer: Answer, drives: Sequence[Signals]) -> Iterator[Finding]:
    """Findings on the angle of a steered rear axle, or on its absence."""
    given = answer.vehicle.params.get(WEIGHT, 0.0) > 0.0
    if answer.combined_offset is not None:
        yield _both_axles(answer)
    elif given:
        yield _no_rear_axle_angle()
    elif all(_REAR in drive.columns for drive in drives):
        yield _not_in_vehicle_file()


@finding("rear_axle_steers", "info", "deg")
def _both_axles(found: Kind, answer: Answer) -> Finding:
    """The answer uses the angle of a steered rear axle."""
    combined, rear = answer.combined_offset, answer.rear_axle_offset
    assert combined is not None and rear is not None
    per_rear = answer.vehicle.ratio_near_centre * answer.params[WEIGHT]
    is_sum = f"the offset of the front sensor less {per_rear:.1f} times that of the rear axle's sensor"
    without_angle = "The sensor check and the angle without the sensor are not available for this truck"
    if rear.value is not None:
        is_given = answer.vehicle.params.get(_ZERO_SD, 0.0) > 0.0
        source = "as the vehicle file gives it" if is_given else "as it reads in bends while the axle is locked"
        return found(
            f"the sensor of the steered rear axle reads {number(rear.value, 2)} deg with that axle straight, {source}. "
            f"The offset is that of the steering wheel angle sensor alone. {without_angle}",
            rear.value / DEGREE,
        )
    shown = "not identified so far" if combined.value is None else f"{number(combined.value, 1)} deg"
    return found(
        f"the rear axle steers, and yaw shows only the combined offset of both sensors: {is_sum}. It is {shown}. "
        "Neither sensor's own offset is identifiable from this drive. Give rear_axle_zero_deg in the vehicle file, or "
        f"log a minute of bends with the rear axle locked, and then some in which it steers. {without_angle}",
        None if combined.value is None else combined.value / DEGREE,
    )


@finding("rear_axle_steers", "warning")
def _contradicts(found: Kind, how: str) -> Finding:
    """Bends contradict the vehicle file and the angle of a steered rear axle."""
    return found(
        f"{how}. Check the sign and the unit of rear_axle_angle (left is positive, road wheels) and the key "
        "rear_axle_steers first, then wheelbase and steering ratio"
    )


@finding("rear_axle_steers", "warning")
def _no_rear_axle_angle(found: Kind) -> Finding:
    """The vehicle file says that a rear axle steers, and the log has no angle of it."""
    return found(
        "the vehicle file says that a rear axle steers, but the log has no rear_axle_angle. Bends then need another "
        "angle than the model predicts, and the understeer gradient is wrong. Name the signal in the [signals] table"
    )


@finding("rear_axle_steers", "warning")
def _not_in_vehicle_file(found: Kind) -> Finding:
    """The log has the angle of a rear axle that does not steer by the vehicle file."""
    return found(
        "the log has the angle of a steered rear axle, which the offset does not use: the vehicle file does not say "
        "which axle it is. Give rear_axle_steers in the vehicle file"
    )
