"""Statuses that the drive itself contradicts, most often because their sense is inverted. They are not used.

A lifted axle is not judged: only the changes of its status count, which an inverted one has as well.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from oncenter.findings import Finding, Kind, finding
from oncenter.plausibility.check_result import SIGNALS_TABLE
from oncenter.plausibility.grid_signals import DRIVING_M_S, MIN_TIME_S
from oncenter.plausibility.reversing import TURN_MIN_RAD_S, USUAL_PRODUCT_M
from oncenter.signals import SIGNALS, STATUSES, Signals
from oncenter.tuned import TUNED

Column = npt.NDArray[np.float64]

_STANDS_M_S = 0.1
_STANDING_MIN_S = 2.0
_MOVES_M_S = 0.3
_MOST = 0.5
_NEARLY_ALL = 0.9  # an assistance for traffic jams may stay active in stops
_INTERVENING_MAX = 0.25  # of the time in motion: stability control and ABS work for 1 to 3 % in bench/effects.py
_FAST_M_S = TUNED["monitor.backward_speed_max"]


def without_contradicted(signals: Signals) -> tuple[Signals, tuple[Finding, ...]]:
    """The drive without the statuses that it contradicts, and the warnings about them."""
    found = {name: said for name in STATUSES if (said := _contradiction(signals, name)) is not None}
    return without(signals, tuple(found)), tuple(found.values())


def without(signals: Signals, names: tuple[str, ...]) -> Signals:
    """The drive without these signals."""
    if not names:
        return signals
    gone = {SIGNALS[name].column for name in names}
    kept = {name: source for name, source in signals.sources.items() if name not in names}
    rest = {name: column for name, column in signals.columns.items() if name not in gone}
    return signals.replaced(rest, kept)


def _contradiction(signals: Signals, name: str) -> Finding | None:
    column, speed = signals.columns.get(SIGNALS[name].column), signals.columns.get(SIGNALS["vehicle_speed"].column)
    if column is None or speed is None:
        return None
    available = np.isfinite(column) & np.isfinite(speed)
    is_true, size, step_s = column[available] > 0.5, np.abs(speed[available]), 1.0 / signals.rate_hz
    if name in ("stability_control_active", "anti_lock_active"):
        share = _share(is_true, size > DRIVING_M_S, MIN_TIME_S / step_s)
        return None if share < _INTERVENING_MAX else _status(name, 100.0 * share, "in motion", "Interventions are rare")
    if name == "steering_assist_active":
        share = _share(is_true, size < _STANDS_M_S, _STANDING_MIN_S / step_s)
        return (
            None
            if share < _NEARLY_ALL
            else _status(name, 100.0 * share, "at standstill", "No motor steers a truck that stands")
        )
    if name == "reverse":
        share = _share(is_true, size > _MOVES_M_S, MIN_TIME_S / step_s)
        forward = share > _MOST and not _turns_against(signals, is_true, available)
        why = "The truck turns as in forward driving"
        return _status(name, 100.0 * share, "in motion", why) if forward else None
    return None


def _share(is_true: npt.NDArray[np.bool_], among: npt.NDArray[np.bool_], ticks_min: float) -> float:
    """Of the ticks among which a status is true; 0 where there are too few."""
    count = np.count_nonzero(among)
    return float(np.count_nonzero(is_true & among) / count) if count >= ticks_min else 0.0


def _turns_against(signals: Signals, is_true: npt.NDArray[np.bool_], available: npt.NDArray[np.bool_]) -> bool:
    """Whether most turns are against the steering wheel angle while the status says reverse, below the speed at which
    no truck reverses."""
    names = ("steering_wheel_angle", "yaw_rate", "vehicle_speed")
    if not all(SIGNALS[name].column in signals.columns for name in names):
        return False
    angle, yaw_rate, speed = (signals.columns[SIGNALS[name].column][available] for name in names)
    size = np.abs(speed)
    by_angle = (angle - np.nanmedian(angle)) * size / USUAL_PRODUCT_M
    turns = is_true & (np.minimum(np.abs(by_angle), np.abs(yaw_rate)) > TURN_MIN_RAD_S) & (size < _FAST_M_S)
    return bool(np.count_nonzero(turns & (by_angle * yaw_rate < 0.0)) > _MOST * np.count_nonzero(turns))


@finding("status_contradicted", "warning", "%")
def _status(found: Kind, name: str, percent: float, when: str, why: str) -> Finding:
    """A status is true for a share of the time in which it cannot be."""
    return found(
        f"the status '{name}' is true for {percent:.0f} % of the time {when}. {why}, so its sense seems inverted. The "
        f"offset does not use this status. Check its 'true_when' in {SIGNALS_TABLE}, and its sender",
        percent,
    )
