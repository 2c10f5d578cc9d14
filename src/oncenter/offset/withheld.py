"""Time in which oncenter itself did not use a signal that the log has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from oncenter import _core
from oncenter.signals import SIGNALS, Signals

if TYPE_CHECKING:
    from oncenter.signals import Columns

_ANGLE = "steering_wheel_angle"
_FAULT_WORDS = {
    "stuck": "the sensor check finds it stuck at one value",
    "drifting": "the sensor check finds it drifting",
    "wrong_sign": "the sensor check finds its sign reversed",
}


@dataclass(frozen=True)
class Withheld:
    """`signal` and `why` in words, for a finding."""

    time_s: float = 0.0
    signal: str = ""
    why: str = ""


NOTHING = Withheld()


class Gaps(NamedTuple):
    """Seconds without a value of a needed signal in the log, and seconds with an angle whose whole turns are not
    identified."""

    absent_s: float
    turns_s: float


def gaps_in(drives: Sequence[Signals], needed: Sequence[str]) -> Gaps:
    """
    Args:
        drives: as the core received them, without whole turns of a relative sensor.
        needed: signals of the method.
    """
    turns_s = sum(_turning_ticks(drive) / drive.rate_hz for drive in drives)
    absent_s = sum(absent_ticks(drive.columns, needed) / drive.rate_hz for drive in drives)
    return Gaps(max(absent_s - turns_s, 0.0), turns_s)


def withheld_by_oncenter(native: _core.OcAnswer, gaps: Gaps, needed: Sequence[str]) -> Withheld:
    """The time without a signal for the core, less that without a value in the log.

    Args:
        native: the core's oc_answer as a dict.
    """
    missing_s = dict(zip(_core.REASONS, native["rejected"], strict=True))["missing_signal"]
    time_s = max(missing_s - gaps.absent_s, 0.0)
    if gaps.turns_s > 0.5 * time_s:
        return Withheld(time_s, "the steering wheel angle", "the whole turns of the relative sensor are not identified")
    if "steering_wheel_torque" in needed:
        return Withheld(time_s, "the steering wheel torque", "it is not proportional to the lateral force")
    fault = _FAULT_WORDS.get(_core.FAULTS[int(native["fault"])], "the sensor check suspected the sensor in this time")
    return Withheld(time_s, "the steering wheel angle", fault)


def absent_ticks(columns: Columns, needed: Sequence[str]) -> int:
    """Ticks at which a needed signal has no value."""
    absent = np.zeros(len(columns["time_s"]), bool)
    for name in needed:
        column = SIGNALS[name].column
        if column in columns:
            absent |= np.isnan(columns[column])
    return int(np.count_nonzero(absent))


def _turning_ticks(drive: Signals) -> int:
    """Ticks at which the log has an angle, but its whole turns are not identified."""
    account = None if drive.account is None else drive.account.signals.get(_ANGLE)
    if account is None or SIGNALS[_ANGLE].column not in drive.columns:
        return 0
    return max(int(np.count_nonzero(np.isnan(drive.columns[SIGNALS[_ANGLE].column]))) - account.missing, 0)
