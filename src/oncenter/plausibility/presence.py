"""Whether each signal is available, fast enough, not stuck, and fine enough."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from oncenter.findings import Finding, Kind, finding
from oncenter.plausibility.check_result import SIGNALS_TABLE, words
from oncenter.plausibility.grid_signals import (
    MIN_TIME_S,
    NEEDED,
    ROLLING_M_S,
    USEFUL,
    Column,
    GridSignals,
    without_absurd,
)
from oncenter.read.clock import RATE_SLACK, RECORDED_MIN_HZ
from oncenter.signals import DEGREE, SIGNALS, Signals

_NOT_AVAILABLE = 0.05  # of the ticks
_SLOWEST_HZ = 9.5  # the 3 Hz low-pass of 5.1.1 needs more than twice its cut-off; EBC2 and CCVS1 come at 10

# s at exactly one value while rolling; a held wheel still moves by a bit of 1/1024 rad, a cruise control holds longer
_STUCK_S = {"steering_wheel_angle": 20.0, "yaw_rate": 20.0, "lateral_acceleration": 20.0, "vehicle_speed": 120.0}
_RATIO_TIMES_WHEELBASE_M = 80.0  # of a truck: 20 times 4 m
_FINE_M_S = 0.03  # a step of the vehicle speed: 0.1 km/h, where CCVS1 has 1/256
_WHEELS_M_S = 0.3  # of wheel speeds: noise and slip
_RECURRING_SHARE = 0.5  # of the values; fewer recur by chance, or while the truck stands
_STANDING_M_S = 0.5
_YAWS_RAD_S = 0.5 * DEGREE  # spread; a gyro's noise at standstill is a fifth of it
_HELD_STEPS = 3.0  # size of the change after a held value
_HELD_CHANGES_MIN = 30  # fewer are dropouts
_PIECES, _PIECE = 16, 1500  # rows: 24,000 at most
_MANY = 100  # different values, which show the resolution of a signal

# coarsest harmless step: angle, a share of Table 1's 2.5 deg; yaw rate, half of 5.3.1's 0.2 deg/s
_COARSEST = {
    "steering_wheel_angle": (1.05, DEGREE, "deg"),
    "yaw_rate": (0.105, DEGREE, "deg/s"),
    "lateral_acceleration": (0.105, 1.0, "m/s^2"),
    "vehicle_speed": (1.05, 1 / 3.6, "km/h"),
}


@finding("missing_signal", "error")
def missing(found: Kind, drive: GridSignals) -> list[Finding]:
    return [
        found(
            f"the log has no {words(name)}. "
            + (
                "No offset can be estimated"
                if name in NEEDED
                else "The offset can be estimated with --no-accelerometer only, and is less certain"
            ),
            severity="error" if name in NEEDED else "info",
        )
        for name in USEFUL
        if not drive.has(name)
    ]


def availability(drive: GridSignals) -> list[Finding]:
    found: list[Finding] = []
    for name in filter(drive.has, USEFUL):
        share = float(np.isnan(drive.ticks(name)).mean())
        if share > _NOT_AVAILABLE:
            found.append(_not_available(name, 100 * share))
        rate_hz = drive.signals.sources[name].rate_hz
        if 0 < rate_hz < _SLOWEST_HZ:
            found.append(_slow(name, rate_hz, f"comes at only {rate_hz:.3g} Hz, too slow to follow steering"))
        changes_hz = held_rate_hz(drive.signals, name)
        if changes_hz is not None:
            how = f"changes only {changes_hz:.2g} times a second and repeats its last value between"
            found.append(_slow(name, changes_hz, how))
    return found


@finding("signal_not_available", "warning", "%")
def _not_available(found: Kind, name: str, percent: float) -> Finding:
    return found(
        f"the {words(name)} has no value for {percent:.0f} % of the time. The offset does not use this "
        "time. Check its sender and the logger",
        percent,
        signals=(name,),
    )


@finding("signal_slow", "warning", "Hz")
def _slow(found: Kind, name: str, rate_hz: float, how: str) -> Finding:
    return found(f"the {words(name)} {how}. The offset is less certain. Record it faster", rate_hz, signals=(name,))


def held_rate_hz(signals: Signals, name: str) -> float | None:
    """Rate of change of a signal that is sent faster but repeats its last value; None where it is fast enough, or
    without enough changes.

    After a time without motion, or with motion below its resolution, a signal changes by one step. A held signal
    changes by all the motion in between. So only the time before changes of several steps counts.
    """
    column = SIGNALS[name].column
    if column not in signals.columns:
        return None
    values = without_absurd(signals.columns[column])
    values = values[np.isfinite(values)]
    if not len(values):
        return None
    by = np.abs(np.diff(values, prepend=values[0]))
    changes = np.flatnonzero(by)
    large = by[changes][1:] > _HELD_STEPS * (resolution(values) or 0.0)
    if large.sum() < _HELD_CHANGES_MIN:
        return None
    rate_hz = signals.rate_hz / float(np.median(np.diff(changes)[large]))
    return rate_hz if rate_hz < RECORDED_MIN_HZ * (1 - RATE_SLACK) else None


def stuck(drive: GridSignals) -> list[Finding]:
    found: list[Finding] = []
    if _yaws_while_standing(drive):
        found.append(_speed_zero((len(drive.ticks("vehicle_speed")) - 1) / drive.signals.rate_hz))
    for name in _STUCK_S:
        if name not in ("vehicle_speed", "yaw_rate") and _is_coarse(drive, name):
            continue  # one step can hide all motion on a straight road; `coarse` reports it
        runs = _runs_of_one_number(drive, name)
        if name == "vehicle_speed":
            runs = [run for run in runs if _must_have_changed(drive, run)]
        if name == "yaw_rate":
            runs = [run for run in runs if _turns_by_more_than_a_step(drive, run)]
        if runs:
            found.append(_stuck(drive, name, runs))
    return found


@finding("vehicle_speed_zero", "error", "s")
def _speed_zero(found: Kind, whole_s: float) -> Finding:
    return found(
        "the vehicle speed is zero in the whole log: this is wrong, because the yaw rate shows bends. No offset is "
        f"estimated. Check its name and source in {SIGNALS_TABLE}",
        whole_s,
        signals=("vehicle_speed",),
    )


def _runs_of_one_number(drive: GridSignals, name: str) -> list[slice]:
    """The runs in which the signal stays at one value for longer than its `_STUCK_S` while the vehicle rolls."""
    rolling = (drive.ticks("vehicle_speed") > ROLLING_M_S)[1:]
    return _runs((np.diff(drive.ticks(name)) == 0.0) & rolling, _STUCK_S[name] * drive.signals.rate_hz)


@finding("signal_stuck", "error", "s")
def _stuck(found: Kind, drive: GridSignals, name: str, runs: list[slice]) -> Finding:
    same_s = max(run.stop - run.start for run in runs) / drive.signals.rate_hz
    return found(
        f"the {words(name)} stays at one value for {same_s:.0f} s while the truck rolls. It seems stuck: the offset "
        "of this drive is not reliable. Check the sensor and the recording, and record again",
        same_s,
        signals=(name,),
    )


def _yaws_while_standing(drive: GridSignals) -> bool:
    available = np.isfinite(drive.speed + drive.yaw_rate)
    if available.sum() * drive.step_s < MIN_TIME_S:
        return False
    return bool(drive.speed[available].max() < _STANDING_M_S and np.std(drive.yaw_rate[available]) > _YAWS_RAD_S)


def _is_coarse(drive: GridSignals, name: str) -> bool:
    coarsest, factor, _ = _COARSEST[name]
    step = resolution(drive.ticks(name))
    return step is not None and step / factor > coarsest


def _must_have_changed(drive: GridSignals, run: slice) -> bool:
    """Whether the vehicle speed changed meanwhile by more than its resolution: by the wheel speeds, or because its
    steps are so fine that no cruise control stays within one. Wheel speeds that are stuck as well are no evidence."""
    step = _step_of(np.delete(drive.ticks("vehicle_speed"), run))
    spread = _wheels_spread(drive, run)
    if spread > 0.0 and (step is None or step >= _FINE_M_S):
        return spread > (step or 0.0) + _WHEELS_M_S
    return step is not None and step < _FINE_M_S


def _wheels_spread(drive: GridSignals, run: slice) -> float:
    """The spread of the wheel speeds meanwhile, m/s; 0 where they are stuck as well, or where there are too few."""
    wheels = drive.wheel_speed[run.start // drive.ticks_per_step : run.stop // drive.ticks_per_step]
    wheels = wheels[np.isfinite(wheels)]
    if len(wheels) * drive.step_s <= MIN_TIME_S:
        return 0.0
    slowest, fastest = np.quantile(wheels, (0.02, 0.98))
    return float(fastest - slowest)


def _turns_by_more_than_a_step(drive: GridSignals, run: slice) -> bool:
    """Whether the angle changed meanwhile by more than the resolution of the yaw rate; always where that is fine."""
    step = coarse_step(drive.signals, "yaw_rate")
    if step is None:
        return True
    by_angle = drive.ticks("steering_wheel_angle")[run] * drive.ticks("vehicle_speed")[run] / _RATIO_TIMES_WHEELBASE_M
    by_angle = by_angle[np.isfinite(by_angle)]
    if not len(by_angle):
        return False
    lowest, highest = np.quantile(by_angle, (0.02, 0.98))
    return bool(highest - lowest > 2.0 * step)


def _step_of(values: Column) -> float | None:
    """Resolution of a signal; 0 where its values hardly recur, None where there are too few of them."""
    step = resolution(values)
    many = len(np.unique(values[np.isfinite(values)])) > _MANY
    return 0.0 if step is None and many else step


def _runs(true: npt.NDArray[np.bool_], longer_than: float) -> list[slice]:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], true, [False])).astype(np.int8)))
    begins, ends = edges[::2], edges[1::2]
    long = ends - begins > longer_than
    return [slice(int(begin), int(end)) for begin, end in zip(begins[long], ends[long], strict=True)]


@finding("signal_coarse", "warning")
def coarse(found: Kind, drive: GridSignals) -> list[Finding]:
    each: list[Finding] = []
    for name, (_, factor, unit) in _COARSEST.items():
        step = coarse_step(drive.signals, name)
        if step is not None:
            text = (
                f"the {words(name)} comes in steps of {step / factor:.3g} {unit}, which is coarse. The offset is less "
                "certain. Record it in finer steps"
            )
            each.append(found(text, step / factor, unit=unit))
    return each


def coarse_step(signals: Signals, name: str) -> float | None:
    """Resolution of a signal in SI; None where it is fine enough, or where the signal shows none.

    Most rows of a signal slower than the table are interpolated, and between two samples a step apart half a step
    recurs as well. So the resolution is that of the rows that are samples.
    """
    column = SIGNALS[name].column
    if column not in signals.columns or name not in signals.sources:
        return None
    values = without_absurd(signals.columns[column])
    rate_hz = signals.sources[name].rate_hz
    every = max(1, round(signals.rate_hz / rate_hz)) if rate_hz > 0.0 else 1
    steps = [step for first in range(every) if (step := _step_between(values[first::every])) is not None]
    coarsest, factor, _ = _COARSEST[name]
    return max(steps) if steps and max(steps) > coarsest * factor else None


def _some_of(values: Column) -> Column:
    """The finite values, of a long column those of some pieces: they show its steps as well, and sort faster."""
    if len(values) > _PIECES * _PIECE:
        starts = np.linspace(0, len(values) - _PIECE, _PIECES).astype(np.int64)
        values = np.concatenate([values[start : start + _PIECE] for start in starts.tolist()])
    return values[np.isfinite(values)]


def _step_between(values: Column) -> float | None:
    """The `resolution`, also of a signal with only a few different values."""
    numbers, counts = np.unique(np.round(_some_of(values), 9), return_counts=True)
    recurring = counts >= 3
    if recurring.sum() < 2 or counts[recurring].sum() < _RECURRING_SHARE * counts.sum():
        return None
    return float(np.quantile(np.diff(numbers[recurring]), 0.1))


def resolution(values: Column) -> float | None:
    """Resolution of a signal in its unit; None where it shows none.

    Only recurring values count: measured values recur, interpolated ones hardly do.
    """
    numbers, counts = np.unique(np.round(_some_of(values), 9), return_counts=True)
    recurring = numbers[counts >= 3]
    return float(np.quantile(np.diff(recurring), 0.1)) if len(recurring) >= 5 else None
