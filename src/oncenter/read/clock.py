"""Resamples signals of different rates to one table with a uniform tick. Gaps in the log stay gaps (NaN or no rows)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from oncenter.errors import OncenterError
from oncenter.read.frames import Column
from oncenter.read.samples import Samples, steps_of
from oncenter.read.units import TIME, unit_by_suffix
from oncenter.read.wording import counted
from oncenter.signals import SIGNALS

SLOWEST_HZ, FASTEST_HZ = 20.0, 200.0  # of a table: range of the core
RECORDED_MIN_HZ = 5.0  # of the angle in a log: it resolves steering up to 2 Hz, nearly all of normal driving
RATE_SLACK = 0.03  # tolerance for clocks that run slow
STEADY_JITTER = 0.05  # of the step
HOLE_S = 5.0  # a longer gap in all signals has no rows
BRIDGE_PERIODS, BRIDGE_MIN_S = 2.5, 0.05  # maximum distance of two samples for interpolation
SLOWER = 0.75  # of a table's rate: at least every second cell of the column is then empty
ON_TICK_S = 1e-6  # a sample this near to a tick is on it; epoch stamps resolve 0.24 us
LATEST_S = 1e11  # year 5138: a larger stamp is not in seconds
# Of a table. Cyclic messages in vehicles have periods from 1 ms; 20 Hz in minutes are 1200 Hz. Below, no steering is
# resolved in any unit of the time.
PLAUSIBLE_MAX_HZ, PLAUSIBLE_MIN_HZ = 1100.0, 0.5
_USUAL_HZ = 100.0  # of logs
BACKWARD_SHARE = 0.1  # of the steps; more mean that the column is not a time

_SET_BY_RATE = ("steering_wheel_angle", "yaw_rate")


def to_one_tick(chosen: Sequence[Samples], log: str, notes: list[str]) -> tuple[dict[str, Column], float]:
    """Columns as `oncenter.signals.Signals.columns` and their rate in Hz.

    A table with one steady time column for all signals is passed on unchanged. The core counts its repeated and
    backward stamps; backward ones also give a note. Exception: a table whose angle (or, without an angle, yaw rate) has
    a number in at most every second row is resampled. Frames are always resampled: on a live bus it is not predictable
    whether stamps stay steady, and a log must give the same result as the bus.

    Raises:
        OncenterError: too slow, too short, or time does not increase.
    """
    rate = _tick_rate(chosen, log)
    if _rows_are_ticks(chosen):
        notes += _backward_notes(chosen[0], log)
        every = math.ceil(rate / FASTEST_HZ - 1e-3)
        if every > 1:
            notes.append(f"recorded at {rate:.4g} Hz, reduced to {rate / every:.4g} Hz: one row in {every} is used")
        columns = {SIGNALS[s.signal].column: _bridged_if_slower(s, rate) for s in chosen}
        whole = {"time_s": chosen[0].time, **columns}
        return {name: np.ascontiguousarray(column[::every]) for name, column in whole.items()}, rate / every
    rate = resampling_rate(chosen, log)
    notes += slow_notes(chosen, rate)
    return _resampled([_in_order(samples, log, notes) for samples in chosen], rate), rate


def resampling_rate(chosen: Sequence[Samples], log: str) -> float:
    """Tick rate in Hz for signals of different rates.

    Raises:
        OncenterError: too slow, or time does not increase.
    """
    return min(max(_tick_rate(chosen, log), SLOWEST_HZ), FASTEST_HZ)


def is_too_slow_for_the_core(rate_hz: float) -> bool:
    """Whether samples of this rate are resampled; False for 0, no rate."""
    return 0.0 < rate_hz < SLOWEST_HZ * (1 - RATE_SLACK)


def slow_notes(chosen: Sequence[Samples], rate_hz: float) -> list[str]:
    """A note if the signal that sets the rate is slower than the ticks at `rate_hz`."""
    first = leading(chosen)
    if first.signal not in _SET_BY_RATE or not is_too_slow_for_the_core(first.rate_hz):
        return []
    return [f"recorded at {first.rate_hz:.3g} Hz, resampled to {rate_hz:.3g} Hz"]


def _tick_rate(chosen: Sequence[Samples], log: str) -> float:
    """The rate of the steering wheel angle, or without one of the best other signal; at least `SLOWEST_HZ`."""
    for samples in _first_of_each_time(chosen):
        _refuse_backward(samples, log)
    by_signal = {samples.signal: samples for samples in chosen}
    leading = next((by_signal[name] for name in _SET_BY_RATE if name in by_signal), None)
    if leading is None:
        return max(SLOWEST_HZ, *(samples.rate_hz for samples in chosen))
    rate = leading.rate_hz
    if rate < RECORDED_MIN_HZ * (1 - RATE_SLACK) and leading.signal == "steering_wheel_angle":
        raise OncenterError(
            f"steering_wheel_angle ({leading.description}) in {log} is recorded at {rate:.3g} Hz, "
            f"at least {RECORDED_MIN_HZ:.0f} Hz is needed: record it faster",
            code="rate_too_low",
            needs=("steering_wheel_angle",),
        )
    return max(rate, SLOWEST_HZ)


def refuse_time_out_of_range(candidates: Sequence[Samples], log: str) -> None:
    """
    Raises:
        OncenterError: a stamp is beyond `LATEST_S`, or the rate of a table beyond `PLAUSIBLE_MAX_HZ` or below
            `PLAUSIBLE_MIN_HZ`: its time is in another unit, or damaged.
    """
    for samples in _first_of_each_time(candidates):
        _refuse_implausible_rate(samples, log)
        first, last = _ends(samples)
        farthest = max(abs(first), abs(last))
        if farthest > LATEST_S:
            raise OncenterError(
                f"time of {samples.time_description} in {log} reaches {farthest:.3g} s, so its unit is not s: give "
                'its unit (ms, us, ns) in [signals]: time = { name = "...", unit = "ms" }',
                code="time_out_of_range",
                needs=("time",),
            )


def _refuse_implausible_rate(samples: Samples, log: str) -> None:
    """The rate of a table is a design choice, so an implausible one is that of a time in another unit."""
    rate = 0.0 if samples.of_frames or samples.steps is None else samples.steps.rate_hz
    if not rate or PLAUSIBLE_MIN_HZ <= rate <= PLAUSIBLE_MAX_HZ:
        return
    column = samples.time_description.removeprefix("column ")
    now = unit_by_suffix(column, dict(TIME.factors)) or "s"
    by_unit = {unit: rate * TIME.factors[now] / factor for unit, factor in TIME.factors.items()}
    likely, hz = min(by_unit.items(), key=lambda pair: abs(math.log(pair[1] / _USUAL_HZ)))
    if likely == now:
        return
    has = f"time of {samples.time_description} in {log} has {rate:,.6g} rows per second"
    entry = f'time = {{ name = "{column}", unit = "{likely}" }}'
    if rate < PLAUSIBLE_MIN_HZ:  # a telematics unit may record as slowly
        why = f"{has}, at least {RECORDED_MIN_HZ:.0f} are needed: record faster, or if its unit is not {now} but"
        raise OncenterError(
            f"{why} {likely} ({hz:.4g} Hz), give it in [signals]: {entry}", code="time_out_of_range", needs=("time",)
        )
    raise OncenterError(
        f"{has}, so its unit is not {now} but likely {likely} ({hz:.4g} Hz): give it in [signals]: {entry}",
        code="time_out_of_range",
        needs=("time",),
    )


def _ends(samples: Samples) -> tuple[float, float]:
    """The earliest and the latest stamp."""
    time = samples.time[[0, -1]] if _increases(samples) else samples.time
    return float(time.min()), float(time.max())


def _increases(samples: Samples) -> bool:
    """Whether each stamp is certainly later than the one before."""
    return samples.steps is not None and samples.steps.least_s > 0


def _first_of_each_time(given: Sequence[Samples]) -> list[Samples]:
    """One of the samples for each shared time array, so that each array is checked once; without empty ones."""
    firsts: dict[int, Samples] = {}
    for samples in given:
        firsts.setdefault(id(samples.time), samples)
    return [samples for samples in firsts.values() if len(samples.time)]


def _refuse_backward(samples: Samples, log: str) -> None:
    if _increases(samples):
        return
    steps = np.diff(samples.time)
    if not len(steps) or steps.min() > 0:
        return
    wrong = np.flatnonzero(~(steps > 0))
    if len(wrong) > max(1, BACKWARD_SHARE * len(steps)) or len(wrong) == len(steps) > 0:
        raise OncenterError(
            f"time does not increase in {log}: {len(wrong)} of {len(steps)} steps of {samples.time_description} are "
            f"zero or negative, the first after row {wrong[0] + 1}: check the time column, or sort the rows by time",
            code="time_backward",
            needs=("time",),
        )


def _rows_are_ticks(chosen: Sequence[Samples]) -> bool:
    """Whether all share one steady time, and the signal that sets the rate has numbers in over half of the rows."""
    if any(samples.of_frames for samples in chosen):
        return False
    time = chosen[0].time
    if not all(samples.time is time or np.array_equal(samples.time, time) for samples in chosen[1:]):
        return False
    if len(time) < 2:
        return False
    steps = chosen[0].steps or steps_of(time)
    first = leading(chosen)
    if steps.rate_hz < SLOWEST_HZ or (first.signal in _SET_BY_RATE and _is_slower(first, steps.rate_hz)):
        return False
    longest_s = 1.5 / steps.rate_hz
    if steps.least_s > 0 and steps.greatest_s < longest_s:
        return _is_steady(steps.least_s, steps.greatest_s, steps.rate_hz)
    within = np.diff(time)
    within = within[(within > 0) & (within < longest_s)]
    return not len(within) or _is_steady(float(within.min()), float(within.max()), steps.rate_hz)


def _is_steady(least_s: float, greatest_s: float, rate_hz: float) -> bool:
    return max(abs(least_s * rate_hz - 1), abs(greatest_s * rate_hz - 1)) < STEADY_JITTER


def _backward_notes(samples: Samples, log: str) -> list[str]:
    """Notes on backward time: a clock that was set back, or a repeated part. The core continues after it."""
    if _increases(samples):
        return []
    time = samples.time
    backward = np.flatnonzero(time[1:] < time[:-1])
    if not len(backward):
        repeated = int(np.count_nonzero(time[1:] == time[:-1]))
        return [f"left out {counted(repeated, 'row')} of {log} with the time of the row before"] if repeated else []
    farthest = float(np.max(np.maximum.accumulate(time) - time))
    times = "once" if len(backward) == 1 else f"{len(backward)} times"
    return [
        f"time of {log} runs backward {times}, by up to {farthest:.6g} s, first after row {backward[0] + 1}: a part "
        "that was recorded twice is used twice"
    ]


def _in_order(samples: Samples, log: str, notes: list[str]) -> Samples:
    """The samples without those whose time is not later than all times before."""
    latest = np.maximum.accumulate(samples.time)
    later = np.concatenate(([True], samples.time[1:] > latest[:-1]))
    if later.all():
        return samples
    dropped = len(later) - int(later.sum())
    if dropped > BACKWARD_SHARE * len(later):
        raise OncenterError(
            f"time jumps backward in {log}: {dropped} of {len(later)} stamps of {samples.time_description} are earlier "
            f"than a stamp before them, the first in row {int(np.flatnonzero(~later)[0]) + 1}: check the time column, "
            "or split the log",
            code="time_backward",
            needs=("time",),
        )
    notes.append(
        f"{samples.signal}: left out {counted(dropped, 'sample')} of {samples.description} "
        "with repeated or earlier time"
    )
    return replace(samples, time=samples.time[later], values=samples.values[later], steps=None)


def _resampled(chosen: Sequence[Samples], rate: float) -> dict[str, Column]:
    ticks = _ticks(chosen, rate)
    ways: dict[int, _Way] = {}  # shared by the signals of one message
    columns = {}
    for samples in chosen:
        columns[SIGNALS[samples.signal].column] = _at(samples, ticks, ways)
    return {"time_s": ticks, **columns}


def _ticks(chosen: Sequence[Samples], rate: float) -> Column:
    """Times k/rate after the leading signal's first sample, from the first to the last sample of any signal."""
    origin = leading(chosen).time[0]
    distinct = {id(samples.time): samples.time for samples in chosen}
    times = np.sort(np.concatenate(list(distinct.values())))
    ticks: Column = origin + tick_numbers(times, origin, rate) / rate
    return ticks


def leading(chosen: Sequence[Samples]) -> Samples:
    """The signal whose first sample is tick 0."""
    return min(chosen, key=lambda samples: (samples.signal not in _SET_BY_RATE, samples.signal))


def tick_numbers(times: Column, origin_s: float, rate_hz: float) -> npt.NDArray[np.int64]:
    """The k of all ticks at origin + k/rate during samples at `times`, s, ascending; none within a hole."""
    holes = np.flatnonzero(np.diff(times) > HOLE_S)
    first = times[np.concatenate(([0], holes + 1))]
    last = times[np.concatenate((holes, [len(times) - 1]))]
    from_tick = np.ceil((first - origin_s - ON_TICK_S) * rate_hz).astype(np.int64)
    to_tick = np.floor((last - origin_s + ON_TICK_S) * rate_hz).astype(np.int64)
    return np.concatenate([np.arange(a, b + 1) for a, b in zip(from_tick.tolist(), to_tick.tolist(), strict=True)])


def _bridged_if_slower(samples: Samples, rate: float) -> Column:
    """A column of a table at the table's rate; a slower signal's column, empty between its numbers, is interpolated."""
    if not _is_slower(samples, rate) or not np.all(np.diff(samples.time) > 0):
        return samples.values
    return _at(samples, samples.time, {})


def _is_slower(samples: Samples, rate: float) -> bool:
    return samples.rate_hz <= SLOWER * rate


@dataclass(frozen=True)
class _Way:
    """The way from samples to ticks: the sample before each tick, the next one's weight, whether to interpolate."""

    before: npt.NDArray[np.int64]
    weight: Column
    bridged: npt.NDArray[np.bool_]


def _at(samples: Samples, ticks: Column, ways: dict[int, _Way]) -> Column:
    """A signal at the ticks: linear between two samples near each other, NaN elsewhere."""
    available = ~np.isnan(samples.values)
    if int(available.sum()) < 2:
        return np.full(len(ticks), np.nan)
    span = bridge_s(samples)
    if not available.all():
        return at_ticks(samples.signal, samples.time[available], samples.values[available], ticks, span)
    if id(samples.time) not in ways:
        ways[id(samples.time)] = _way(samples.time, ticks, span)
    return _along(samples.signal, samples.values, ways[id(samples.time)])


def bridge_s(samples: Samples) -> float:
    """Maximum distance in s of two samples between which ticks are interpolated."""
    rate = samples.rate_hz
    return max(BRIDGE_PERIODS / rate, BRIDGE_MIN_S) if rate else BRIDGE_MIN_S


def at_ticks(signal: str, time: Column, values: Column, ticks: Column, span_s: float) -> Column:
    """The signal at the ticks, from at least two samples; NaN where they are farther apart than the span."""
    return _along(signal, values, _way(time, ticks, span_s))


def _along(signal: str, values: Column, way: _Way) -> Column:
    if signal == "steering_wheel_angle_sensor_type":
        found = values[way.before + (way.weight >= 0.5)]
    elif signal in ("heading", "course"):
        found = np.mod(_between(np.unwrap(values, period=360.0), way), 360.0)
    else:
        found = _between(values, way)
    found[~way.bridged] = np.nan
    return found


def _between(values: Column, way: _Way) -> Column:
    start = values[way.before]
    return start + way.weight * (values[way.before + 1] - start)


def _way(time: Column, ticks: Column, span: float) -> _Way:
    before = np.clip(np.searchsorted(time, ticks, side="right") - 1, 0, len(time) - 2)
    step = time[before + 1] - time[before]
    since = ticks - time[before]
    weight = since / step
    inside = (since > 0) & (since < step) & (step <= span * (1 + 1e-9))
    at_start = ~inside & (np.abs(since) <= ON_TICK_S)
    at_end = ~inside & (np.abs(since - step) <= ON_TICK_S)
    weight[at_start] = 0.0
    weight[at_end] = 1.0
    return _Way(before, weight, inside | at_start | at_end)
