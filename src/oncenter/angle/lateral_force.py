"""The lateral force of drives without an accelerometer: when yaw rate times speed is used, and the notes on it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from oncenter.offset.inputs import params_of
from oncenter.signals import SIGNALS, Signals
from oncenter.vehicle import Vehicle

_MISSING_REPORTED_FROM = 0.01  # share of a drive


def uses_yaw_rate(signals: Signals, taught_by: Sequence[Signals], sensor_lost_at: float | None) -> bool:
    """Whether yaw rate times speed replaces the lateral acceleration; the estimates hold for one of the two only.

    True where most of the time with a steering wheel angle has no lateral acceleration.
    """
    teaching = measured = 0
    for drive, until_s in ((signals, sensor_lost_at), *((teacher, None) for teacher in taught_by)):
        time = drive.columns["time_s"]
        teaches = _has(drive, "steering_wheel_angle") & (time < time[0] + (np.inf if until_s is None else until_s))
        teaching += int(np.sum(teaches))
        measured += int(np.sum(teaches & _has(drive, "lateral_acceleration")))
    return 2 * measured < teaching


def lateral_force_notes(
    signals: Signals, vehicle: Vehicle, taught_by: Sequence[Signals], sensor_lost_at: float | None
) -> tuple[str, ...]:
    """A note for each drive without a lateral acceleration; none where the vehicle does without it."""
    if not params_of(vehicle, None)["use_accelerometer"]:
        return ()
    by_yaw_rate = uses_yaw_rate(signals, taught_by, sensor_lost_at)
    notes = []
    for drive in (*taught_by, signals):
        missing = float(np.mean(~_has(drive, "lateral_acceleration")))
        name = Path(drive.log).name
        if by_yaw_rate and missing > 0.5:
            notes.append(
                f"no lateral acceleration in {name}: yaw rate times speed is used instead, without the road bank"
            )
        elif not by_yaw_rate and missing > _MISSING_REPORTED_FROM:
            missing_s = missing * drive.ticks / drive.rate_hz
            notes.append(
                f"no lateral acceleration for {missing_s:.0f} s of {name}: this time is not used for estimates, and "
                "the usual bank is assumed"
            )
    return tuple(dict.fromkeys(notes))


def _has(drive: Signals, name: str) -> npt.NDArray[np.bool_]:
    column = SIGNALS[name].column
    if column not in drive.columns:
        return np.zeros(drive.ticks, dtype=bool)
    measured: npt.NDArray[np.bool_] = np.isfinite(drive.columns[column])
    return measured
