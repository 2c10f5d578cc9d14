"""Lags between the signals of a turn: the yaw rate after the angle, the lateral acceleration with the yaw rate."""

from __future__ import annotations

import numpy as np

from oncenter.findings import Kind, finding
from oncenter.plausibility.check_result import BENDS, CannotTell, CheckResult, lacks
from oncenter.plausibility.correlation import lags_s
from oncenter.plausibility.grid_signals import MIN_TIME_S, NEEDED, Column, GridSignals

_ANGLE_TO_YAW_S = (-0.05, 0.5)  # tyres, chassis and play delay it, on a loaded truck at speed by some 0.3 s
_YAW_TO_ACCELERATION_S = (-0.2, 0.2)  # depends on the sensor's position along the vehicle and the roll of the cab
_ALIKE = "needs bends in both halves of the drive that exceed play, road bank and noise"
_AHEAD_M = 4.0  # of the rear axle, without a vehicle file


@finding("lag_yaw_rate", "warning", "ms")
def yaw_rate(found: Kind, drive: GridSignals) -> CheckResult:
    """Behind the angle, beyond the limits in both halves of the drive."""
    subject = "lag of the yaw rate behind the angle"
    found_s = lags_s(drive.driven(drive.angle), drive.curvature, drive.step_s)
    if found_s is None:
        return CannotTell(subject, lacks(drive, NEEDED, _why(drive, drive.angle, drive.curvature)))
    beyond = _beyond(subject, found_s, _ANGLE_TO_YAW_S)
    return beyond and found(*beyond, signals=("yaw_rate",))


@finding("lag_lateral_acceleration", "warning", "ms")
def lateral_acceleration(found: Kind, drive: GridSignals) -> CheckResult:
    """Behind the yaw rate, beyond the limits in both halves of the drive."""
    subject = "lag of the lateral acceleration behind the yaw rate"
    found_s = lags_s(drive.driven(drive.centripetal), drive.lateral_acceleration, drive.step_s)
    if found_s is None:
        why = _why(drive, drive.centripetal, drive.lateral_acceleration)
        return CannotTell(subject, lacks(drive, ("lateral_acceleration", "yaw_rate", "vehicle_speed"), why))
    earliest_s, latest_s = _YAW_TO_ACCELERATION_S
    beyond = _beyond(subject, found_s, (earliest_s - _led_s(drive), latest_s))
    return beyond and found(*beyond, signals=("yaw_rate", "lateral_acceleration"))


def _why(drive: GridSignals, early: Column, late: Column) -> str:
    """The missing evidence for a lag that is not judged."""
    both_s = float(np.isfinite(drive.driven(early) * late).sum()) * drive.step_s
    return BENDS if both_s < MIN_TIME_S else _ALIKE


def _led_s(drive: GridSignals) -> float:
    """The lead of a measurement at the front axle over r*v: the rear axle follows later, at low speed much later."""
    ahead_m = _AHEAD_M if drive.vehicle is None else drive.vehicle.wheelbase_m
    return ahead_m / float(np.nanmedian(drive.driven(drive.speed)))


def _beyond(subject: str, found_s: tuple[float, float], limits: tuple[float, float]) -> tuple[str, float] | None:
    """Text and lag in ms where both halves of the drive lie beyond the limits on the same side."""
    low, high = limits
    if max(found_s) >= low and min(found_s) <= high:
        return None
    lag_ms = 1e3 * sum(found_s) / 2
    text = (
        f"the {subject} is {lag_ms:.0f} ms; {1e3 * low:.0f} to {1e3 * high:.0f} ms is plausible. The offset is less "
        "certain. Check the time stamps and the filters of the sensors"
    )
    return text, lag_ms
