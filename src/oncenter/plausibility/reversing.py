"""Time in which a truck seems to reverse: with an unsigned speed it then yaws against its steering wheel angle."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from oncenter.findings import Finding, Kind, finding
from oncenter.tuned import TUNED

Column = npt.NDArray[np.float64]
Steps = npt.NDArray[np.bool_]

_SPEED_MAX_M_S = TUNED["assignment.reverse_speed_max"]
TURN_MIN_RAD_S = TUNED["assignment.reverse_yaw_rate_min"]
USUAL_PRODUCT_M = 70.0  # ratio times wheelbase, between cars and heavy trucks: only the size of a turn depends on it
_MOVES_M_S = 0.3
_AGAINST_MIN_S = 2.0  # s: turns against the angle between two stops
_AGAINST_SHARE = 0.8  # of all turns between them
_REVERSED_SHARE_MAX = 0.5  # of the time in motion: a truck that seems to reverse more has a reversed signal


def seems_to_reverse(
    angle: Column, yaw_rate: Column, speed: Column, step_s: float, ratio_times_wheelbase_m: float | None
) -> Steps:
    """By steps of a grid: slow from one stop to the next, and turning against the angle."""
    none = np.zeros(len(speed), bool)
    if not np.isfinite(angle).any():
        return none
    by_angle = (angle - np.nanmedian(angle)) * speed / (ratio_times_wheelbase_m or USUAL_PRODUCT_M)
    turns = np.minimum(np.abs(by_angle), np.abs(yaw_rate)) > TURN_MIN_RAD_S
    against = turns & (by_angle * yaw_rate < 0.0)
    moves = speed > _MOVES_M_S
    ends = np.flatnonzero(np.diff(np.concatenate(([False], moves, [False])).astype(np.int8)))
    found = none.copy()
    for begin, end in ends.reshape(-1, 2):
        count = np.count_nonzero(against[begin:end])
        is_slow = np.max(speed[begin:end]) < _SPEED_MAX_M_S
        if is_slow and count * step_s > _AGAINST_MIN_S and count > _AGAINST_SHARE * turns[begin:end].sum():
            found[begin:end] = True
    return found if found.sum() < _REVERSED_SHARE_MAX * moves.sum() else none


@finding("seems_to_reverse", "info", "s")
def reversing(found: Kind, seems: Steps, step_s: float, has_status: bool) -> Finding | None:
    """Time in which the truck seems to reverse while its speed has no sign, and a status, if any, says forward."""
    if not seems.any():
        return None
    time_s, since_min = float(seems.sum()) * step_s, float(np.argmax(seems)) * step_s / 60.0
    tell = (
        "The signal 'reverse' does not say so: check its true_when in the [signals] table, and its sender"
        if has_status
        else "Record the signal 'reverse' to confirm it: the gear of ETC2 or the direction of TCO1"
    )
    return found(
        f"for {time_s:.0f} s, from {since_min:.1f} min on, the truck turns against its steering wheel angle at low "
        "speed: it seems to reverse, and its speed has no sign. Signals are not compared in this time, and the offset "
        f"stays as it is. {tell}",
        time_s,
    )
