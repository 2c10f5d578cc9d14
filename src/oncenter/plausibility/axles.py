"""Whether the wheel speeds of an axle agree with the yaw rate: their difference, right less left, against it.

Other wheel speeds would give the core a wrong yaw rate bias. So the core does not get them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from oncenter.findings import Finding, Kind, finding
from oncenter.plausibility.check_result import SIGNALS_TABLE
from oncenter.plausibility.correlation import lags_s
from oncenter.plausibility.grid_signals import MIN_TIME_S, ROLLING_M_S, Column, GridSignals
from oncenter.plausibility.jackknife import first_with_interval, normal_equations
from oncenter.plausibility.presence import resolution
from oncenter.plausibility.signs_and_units import confirming_yaw_rate
from oncenter.signals import DEGREE, SIGNALS, Signals
from oncenter.vehicle import Vehicle

Axle = Literal["front", "rear"]
AXLES: tuple[Axle, ...] = ("front", "rear")

# Of track width times yaw rate: 1.7 with load transfer (tests/test_simulate_multibody.py), less with coarse steps.
_PER_TRACK = (0.5, 2.2)
_TRACKS_M = (1.6, 2.1)  # where the vehicle file has none
_LAG_MAX_S = 0.2  # twice that of EBC2's messages and a filter
_LAG_SEARCHED_S = 0.8  # either way
_LAGS_ALIKE_S = 0.1  # of two axles
_TURNING_MIN_RAD_S = 0.3 * DEGREE  # spread of the yaw rate; its noise hardly lowers the slope then
_STEPS_MIN = 1.5  # of the difference, as spread of the expected one: rounding can hide a smaller one
_EBC2_STEP_M_S = 1.0 / 16.0 / 3.6
_MEAN_PER_SPEED = (0.8, 1.25)  # tyre size and wear change far less
_KM_H = 3.6
_KM_H_WITHIN = 0.1
_NEARLY_SAME = 0.2  # share of the expected difference

_Kind = Literal["unit", "reversed", "small", "large", "lag"]


@dataclass(frozen=True)
class _Mismatch:
    """`value` is a lag in s, the mean over the vehicle speed, or the slope over track times yaw rate."""

    axle: Axle
    kind: _Kind
    value: float


@dataclass(frozen=True)
class Unfit:
    """Axles whose wheel speeds must not be used, and the warning about them."""

    axles: tuple[Axle, ...]
    finding: Finding


def columns(axle: Axle) -> tuple[str, str]:
    """Left and right."""
    return SIGNALS[f"wheel_speed_{axle}_left"].column, SIGNALS[f"wheel_speed_{axle}_right"].column


def without_unfit_axles(signals: Signals, vehicle: Vehicle | None) -> tuple[Signals, tuple[Unfit, ...]]:
    """The drive without the wheel speeds that contradict the yaw rate, and their axles.

    An axle is judged only where another signal confirms the yaw rate and the truck turns enough.
    """
    if not any(_has_both(signals, axle) for axle in AXLES):
        return signals, ()
    found = unfit(GridSignals(signals, vehicle))
    for each in found:
        signals = _without(signals, each.axles)
    return signals, found


def _has_both(signals: Signals, axle: Axle) -> bool:
    return all(column in signals.columns for column in columns(axle))


def _without(signals: Signals, axles: tuple[Axle, ...]) -> Signals:
    gone = [column for axle in axles for column in columns(axle)]
    kept = {name: source for name, source in signals.sources.items() if SIGNALS[name].column not in gone}
    rest = {name: column for name, column in signals.columns.items() if name not in gone}
    return signals.replaced(rest, kept)


def unfit(drive: GridSignals) -> tuple[Unfit, ...]:
    """The axles that `without_unfit_axles` leaves out; those with the same mismatch together."""
    axles = [axle for axle in AXLES if _has_both(drive.signals, axle)]
    confirming = confirming_yaw_rate(drive) if axles else frozenset()
    if not confirming:
        return ()
    found = [mismatch for axle in axles if (mismatch := _mismatch(drive, axle)) is not None]
    if len(axles) == 2 and len(found) == 1 and found[0].kind == "lag":
        found = [
            replace(found[0], axle=axle) for axle in axles if axle == found[0].axle or _shares(drive, axle, found[0])
        ]
    if len(found) == len(axles) and not ("acceleration" in confirming and all(map(_is_certain, found))):
        found = [each for each in found if each.kind != "unit"]
    if len(found) == 2 and _alike(*found):
        return (Unfit(AXLES, _finding(found)),)
    return tuple(Unfit((each.axle,), _finding([each])) for each in found)


def _alike(one: _Mismatch, other: _Mismatch) -> bool:
    return one.kind == other.kind and (one.kind != "lag" or abs(one.value - other.value) < _LAGS_ALIKE_S)


def _is_certain(mismatch: _Mismatch) -> bool:
    """Whether the factor is surely a wrong unit, where no other axle confirms the vehicle speed."""
    if mismatch.kind != "unit":
        return True
    factor = max(mismatch.value, 1.0 / max(mismatch.value, 1e-3))
    return factor > 2.0 * _KM_H or abs(factor / _KM_H - 1.0) < _KM_H_WITHIN


def _shares(drive: GridSignals, axle: Axle, late: _Mismatch) -> bool:
    """Whether the difference of another axle has the lag of `late`, although it is too noisy to estimate its own: with
    this lag the yaw rate explains more of it in both halves of the drive."""
    left, right = drive.wheels(axle)
    difference = drive.driven(right - left)
    steps = round(late.value / drive.step_s)
    shifted = np.full_like(drive.yaw_rate, np.nan)
    if steps > 0:
        shifted[steps:] = drive.yaw_rate[:-steps]
    else:
        shifted[:steps] = drive.yaw_rate[-steps:]
    used = np.isfinite(difference * shifted * drive.yaw_rate)
    halves = np.array_split(np.flatnonzero(used), 2)
    return all(
        _unexplained(difference[half], shifted[half], drive.speed[half])
        < _unexplained(difference[half], drive.yaw_rate[half], drive.speed[half])
        for half in halves
    )


def _unexplained(difference: Column, yaw_rate: Column, speed: Column) -> float:
    """Sum of squared residuals after a fit of the unknowns of `_slope`."""
    unknowns = np.column_stack([yaw_rate, speed, np.ones_like(speed)])
    found = np.linalg.lstsq(unknowns, difference, rcond=None)[0]
    return float(np.sum((difference - unknowns @ found) ** 2))


def _mismatch(drive: GridSignals, axle: Axle) -> _Mismatch | None:
    """The first one found; None for an axle without mismatch, or with too little evidence."""
    left, right = drive.wheels(axle)
    per_speed = _mean_per_speed(drive, 0.5 * (left + right))
    low, high = _MEAN_PER_SPEED
    if per_speed is not None and not low <= per_speed <= high:
        return _Mismatch(axle, "unit", per_speed)
    difference = drive.driven(right - left)
    slope = _slope(drive, difference)
    if slope is None:
        return None
    track_low, track_high = _tracks_m(drive, axle)
    (value, half_width), track = slope, 0.5 * (track_low + track_high)
    if value + half_width < -_PER_TRACK[0] * track_low:
        return _Mismatch(axle, "reversed", value / track)
    if value + half_width < _PER_TRACK[0] * track_low and _turns_enough(drive, axle, difference):
        return _Mismatch(axle, "small", value / track)
    if value - half_width > _PER_TRACK[1] * track_high:
        return _Mismatch(axle, "large", value / track)
    lags = lags_s(drive.driven(drive.yaw_rate), difference, drive.step_s, _LAG_SEARCHED_S)
    if lags is None or min(map(abs, lags)) <= _LAG_MAX_S or lags[0] * lags[1] < 0.0:
        return None
    return _Mismatch(axle, "lag", sum(lags) / 2)


def _mean_per_speed(drive: GridSignals, mean: Column) -> float | None:
    both = np.isfinite(mean) & (drive.speed > ROLLING_M_S)
    if both.sum() * drive.step_s < MIN_TIME_S:
        return None
    return float(np.median(mean[both]) / np.median(drive.speed[both]))


def _turns_enough(drive: GridSignals, axle: Axle, difference: Column) -> bool:
    """Whether the truck turns enough for the difference to be visible over steps and noise."""
    used = np.isfinite(difference * drive.yaw_rate)
    if not used.any():
        return False
    turning = float(np.std(drive.yaw_rate[used]))
    yaw_rate_step = resolution(drive.ticks("yaw_rate")) or 0.0
    enough = max(_TURNING_MIN_RAD_S, yaw_rate_step)
    return turning > enough and _tracks_m(drive, axle)[0] * turning > _STEPS_MIN * _step_m_s(drive, axle)


def _step_m_s(drive: GridSignals, axle: Axle) -> float:
    """Resolution of the difference. EBC2 gives both wheels relative to the front axle, whose own steps are finer."""
    names = [f"wheel_speed_{axle}_{side}" for side in ("left", "right")]
    sources = [drive.signals.sources[name].description for name in names if name in drive.signals.sources]
    if any("EBC2" in source for source in sources):
        return _EBC2_STEP_M_S
    left, right = map(drive.ticks, names)
    return max(resolution(values) or 0.0 for values in (left, right, right - left))


def _slope(drive: GridSignals, difference: Column) -> tuple[float, float] | None:
    """The slope of the difference over the yaw rate, m, with its 95 % half-width; tyre radii and a yaw rate bias are
    further unknowns."""
    used = np.isfinite(difference * drive.yaw_rate)
    if used.sum() * drive.step_s < MIN_TIME_S:
        return None
    unknowns = np.column_stack([drive.yaw_rate, drive.speed, np.ones_like(drive.speed)])[used]
    return first_with_interval([normal_equations(unknowns, difference[used])])


def _tracks_m(drive: GridSignals, axle: Axle) -> tuple[float, float]:
    vehicle = drive.vehicle
    track = None if vehicle is None else getattr(vehicle, f"track_width_{axle}_m")
    return _TRACKS_M if track is None else (track, track)


_NOT_USED = "The offset is estimated from the other signals, without these wheel speeds"


@finding("wheel_speeds_of_axle", "warning")
def _finding(found: Kind, mismatches: list[_Mismatch]) -> Finding:
    """The finding on one axle, or on both with the same mismatch."""
    value = sum(each.value for each in mismatches) / len(mismatches)
    axles = " and ".join(each.axle for each in mismatches)
    text, number, unit = _WORDS[mismatches[0].kind](axles, value)
    signals = tuple(f"wheel_speed_{each.axle}_{side}" for each in mismatches for side in ("left", "right"))
    return found(text.format(_NOT_USED), number, unit=unit, signals=signals)


def _unit(axles: str, value: float) -> tuple[str, float, str]:
    for factor, mistake in ((_KM_H, "km/h read as m/s"), (1.0 / _KM_H, "m/s read as km/h")):
        if abs(value / factor - 1.0) < _KM_H_WITHIN:
            size = f"too {'large' if factor > 1.0 else 'small'} by a factor of {_KM_H:g} ({mistake})"
            return f"the {axles} wheel speeds are {size}. {{}}. Correct their unit in {SIGNALS_TABLE}", value, "1"
    text = f"the {axles} wheel speeds are {value:.3g} times the vehicle speed. {{}}. Check their unit, e.g. rpm"
    return text, value, "1"


def _reversed(axles: str, value: float) -> tuple[str, float, str]:
    text = (
        f"left and right are exchanged in the {axles} wheel speeds: the sign of their difference is reversed. {{}}. "
        f"Exchange their names in {SIGNALS_TABLE}"
    )
    return text, value, "1"


def _small(axles: str, value: float) -> tuple[str, float, str]:
    same = "are nearly the same" if value < _NEARLY_SAME else "differ too little"
    text = (
        f"the left and right {axles} wheel speeds {same} in bends ({max(100 * value, 0):.0f} % of the expected "
        "difference). A locked differential, or one speed sent for both wheels, causes this. {}. With a locked "
        "differential, no action is necessary"
    )
    return text, value, "1"


def _large(axles: str, value: float) -> tuple[str, float, str]:
    text = (
        f"the left-right difference of the {axles} wheel speeds is {value:.1f} times the expected one in bends. {{}}. "
        "Check their unit, and the track width in the vehicle file"
    )
    return text, value, "1"


def _lag(axles: str, value: float) -> tuple[str, float, str]:
    order = "after" if value > 0.0 else "before"
    text = (
        f"the left-right difference of the {axles} wheel speeds comes {1e3 * abs(value):.0f} ms {order} the yaw "
        f"rate; at most {1e3 * _LAG_MAX_S:.0f} ms is plausible. {{}}. Check the time stamps and filters of both"
    )
    return text, 1e3 * value, "ms"


_WORDS = {"unit": _unit, "reversed": _reversed, "small": _small, "large": _large, "lag": _lag}
