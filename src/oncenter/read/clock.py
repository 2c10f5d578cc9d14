"""Resamples signals of different rates to one table with a uniform tick. Gaps in the log stay gaps (NaN or no rows)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from oncenter.account import SignalAccount
from oncenter.errors import OncenterError
from oncenter.read.frames import Column
from oncenter.read.samples import Samples, steps_of
from oncenter.read.set_back import HOLE_S, SetBack, on_one_clock
from oncenter.read.units import TIME, unit_by_suffix
from oncenter.read.wording import counted
from oncenter.signals import PURE_NUMBER, SIGNALS

SLOWEST_HZ, FASTEST_HZ = 20.0, 200.0  # of a table: range of the core
RECORDED_MIN_HZ = 5.0  # of the angle in a log: it resolves steering up to 2 Hz, nearly all of normal driving
RATE_SLACK = 0.03  # tolerance for clocks that run slow
STEADY_JITTER = 0.05  # of the step
BRIDGE_PERIODS, BRIDGE_MIN_S = 2.5, 0.05  # maximum distance of two samples for interpolation
SLOWER = 0.75  # of a table's rate: at least every second cell of the column is then empty
ON_TICK_S = 1e-6  # a sample this near to a tick is on it; epoch stamps resolve 0.24 us
LATEST_S = 1e11  # year 5138: a larger stamp is not in seconds
# Of a table. Cyclic messages in vehicles have periods from 1 ms; 20 Hz in minutes are 1200 Hz. Below, no steering is
# resolved in any unit of the time.
PLAUSIBLE_MAX_HZ, PLAUSIBLE_MIN_HZ = 1100.0, 0.5
_USUAL_HZ = 100.0  # of logs
BACKWARD_SHARE = 0.1  # of the steps; more mean that the column is not a time
_BURST_MIN = 2.5  # samples of one stamp, in the mean
DISORDER_SHARE = 0.5  # of the frames of a sender; more mean that they are in no order

_SET_BY_RATE = ("steering_wheel_angle", "yaw_rate")


class Ticks(NamedTuple):
    """Columns as `oncenter.signals.Signals.columns`, their rate, and what became of each signal's samples."""

    columns: dict[str, Column]
    rate_hz: float
    accounts: dict[str, SignalAccount]


def to_one_tick(chosen: Sequence[Samples], log: str, notes: list[str], set_back: SetBack | None = None) -> Ticks:
    """The signals at common ticks. Where the clock was set back, times run backward in the table.

    A table with one steady time column for all signals is passed on unchanged. The core counts its repeated and
    backward stamps; backward ones also give a note. Exception: a table whose angle (or, without an angle, yaw rate) has
    a number in at most every second row is resampled. Frames are always resampled: on a live bus it is not predictable
    whether stamps stay steady, and a log must give the same result as the bus.

    Args:
        set_back: of frames, whose times are on one clock.

    Raises:
        OncenterError: too slow, too short, or time does not increase.
    """
    chosen = [_without_bursts(samples, notes) for samples in chosen]
    rate = _tick_rate(chosen, log)
    if _rows_are_ticks(chosen):
        notes += _backward_notes(chosen[0], log)
        every = math.ceil(rate / FASTEST_HZ - 1e-3)
        if every > 1:
            notes.append(f"recorded at {rate:.4g} Hz, reduced to {rate / every:.4g} Hz: one row in {every} is used")
        return _of_rows(chosen, rate, every)
    if set_back is None:
        chosen, set_back = on_one_clock(chosen)
    rate = resampling_rate(chosen, log)
    notes += [*set_back.notes(log), *slow_notes(chosen, rate)]
    ticks = _resampled([_in_order(samples, log, notes) for samples in chosen], rate)
    ticks.columns["time_s"] = set_back.recorded(ticks.columns["time_s"])
    return ticks


def _of_rows(chosen: Sequence[Samples], rate: float, every: int) -> Ticks:
    """The rows of a table, or one row in `every`. A row with the time of the row before is no tick: the core rejects
    it."""
    time = chosen[0].time
    columns, accounts = {"time_s": np.ascontiguousarray(time[::every])}, {}
    repeated = None if _increases(chosen[0]) else np.diff(time[::every], prepend=np.nan) == 0.0
    for samples in chosen:
        if _is_bridged(samples, rate):
            column, account = _at(samples, columns["time_s"], {})
        else:
            column, account = samples.values[::every], _account_of_rows(samples, every, repeated)
        columns[SIGNALS[samples.signal].column] = np.ascontiguousarray(column)
        accounts[samples.signal] = account
    return Ticks(columns, rate / every, accounts)


def _account_of_rows(samples: Samples, every: int, repeated: npt.NDArray[np.bool_] | None) -> SignalAccount:
    number = len(samples.values) - samples.not_available
    rows = samples.values[::every]
    at_rows = len(rows) if samples.complete else int(np.count_nonzero(~np.isnan(rows)))
    twice = ticks_twice = 0
    if repeated is not None:
        twice, ticks_twice = int(np.count_nonzero(repeated & ~np.isnan(rows))), int(np.count_nonzero(repeated))
    ticks, used = len(rows) - ticks_twice, at_rows - twice
    lost = _with(samples.lost, "time_not_later", twice)
    return account_of(samples, used, number - at_rows, lost, (ticks, used, 0, ticks - used))


def _with(lost: Mapping[str, int], reason: str, count: int) -> dict[str, int]:
    return {**lost, reason: lost.get(reason, 0) + count} if count else dict(lost)


def samples_in_file(samples: Samples) -> int:
    return len(samples.values) - samples.not_available + sum(samples.lost.values())


def rows_not_later(samples: Samples) -> int:
    """Rows whose time is not later than all times before, on one clock."""
    if _increases(samples):
        return 0
    time = on_one_clock([samples])[0][0].time
    return len(time) - int(np.count_nonzero(_is_later(time)))


def _is_later(time: Column) -> npt.NDArray[np.bool_]:
    """Whether each time is later than all before it."""
    return np.concatenate(([True], time[1:] > np.maximum.accumulate(time)[:-1]))


def account_of(
    samples: Samples,
    used: int,
    superseded: int,
    lost: Mapping[str, int],
    ticks: tuple[int, int, int, int] = (0, 0, 0, 0),
) -> SignalAccount:
    """The account of a signal.

    Args:
        samples: before any was left out for its time.
        lost: all counts by reason, with those of `samples`.
        ticks: all, fresh, held, missing.
    """
    in_file = samples_in_file(samples) if samples.in_file is None else samples.in_file
    beyond = 0 if samples.beyond is None else int(np.count_nonzero(samples.beyond.rows))
    return SignalAccount(in_file, used, superseded, dict(lost), *ticks, outside_range=beyond)


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
        if farthest > LATEST_S and samples.of_frames:
            raise OncenterError(
                f"the time stamps of {samples.description} in {log} reach {farthest:.3g} s, which no clock has: copy "
                "or export the log again",
                code="time_out_of_range",
                needs=("time",),
            )
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
    if samples.of_frames and len(wrong) == len(steps):
        raise OncenterError(
            f"the time stamps of {samples.description} in {log} never increase: record the log with the time of each "
            "frame",
            code="time_backward",
            needs=("time",),
        )
    if samples.of_frames:
        return
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
    later = _is_later(samples.time)
    if later.all():
        return samples
    dropped = len(later) - int(later.sum())
    _refuse_disorder(samples, later, log)
    note = f"left out {counted(dropped, 'sample')} of {samples.description} with repeated or earlier time"
    if note not in notes:
        notes.append(note)
    numbers = dropped if samples.complete else int(np.count_nonzero(~np.isnan(samples.values[~later])))
    lost = _with(samples.lost, "time_not_later", numbers)
    beyond = None if samples.beyond is None else replace(samples.beyond, rows=samples.beyond.rows[later])
    time, values = samples.time[later], samples.values[later]
    return replace(samples, time=time, values=values, steps=None, lost=lost, beyond=beyond)


def _without_bursts(samples: Samples, notes: list[str]) -> Samples:
    """Frames with the time of the logger's buffer in place of their own: each burst is spread over the time before it.

    A bus that is recorded twice has each stamp twice, so bursts are of three on.
    """
    time = samples.time
    steps = np.diff(time)
    if not samples.of_frames or not len(steps) or not steps.min() >= 0:
        return samples
    begin = np.flatnonzero(np.concatenate([[True], steps > 0]))
    size = np.diff(begin, append=len(time))
    if len(begin) < 2 or len(time) < _BURST_MIN * len(begin):
        return samples
    usual_s = float(np.median(np.diff(time[begin])))
    before_s = np.minimum(np.diff(time[begin], prepend=time[0] - usual_s), 2.0 * usual_s)
    of_burst = np.repeat(np.arange(len(begin)), size)
    later = begin[of_burst] + size[of_burst] - 1 - np.arange(len(time))  # samples of the burst after this one
    bursts = f"the time stamps of {samples.description} come in bursts of {len(time) / len(begin):.0f}"
    note = f"{bursts}: its samples are spread evenly over the time between them"
    if note not in notes:
        notes.append(note)
    return replace(samples, time=time - later * (before_s / size)[of_burst], steps=None)


def _refuse_disorder(samples: Samples, later: npt.NDArray[np.bool_], log: str) -> None:
    """
    Raises:
        OncenterError: many times are earlier than a time before them; of frames, repeated ones are no objection.
    """
    wrong = ~later
    if samples.of_frames:
        wrong &= samples.time < np.maximum.accumulate(samples.time)
    count = int(np.count_nonzero(wrong))
    if count <= (DISORDER_SHARE if samples.of_frames else BACKWARD_SHARE) * len(wrong):
        return
    first = int(np.argmax(wrong)) + 1
    remedy = "sort its frames by time" if samples.of_frames else "check the time column, or split the log"
    raise OncenterError(
        f"time jumps backward in {log}: {count} of {len(wrong)} stamps of {samples.time_description} are earlier than "
        f"a stamp before them, the first in {'frame' if samples.of_frames else 'row'} {first}: {remedy}",
        code="time_backward",
        needs=("time",),
    )


def _resampled(chosen: Sequence[Samples], rate: float) -> Ticks:
    ticks = _ticks(chosen, rate)
    ways: dict[int, _Way] = {}  # shared by the signals of one message
    columns, accounts = {"time_s": ticks}, {}
    for samples in chosen:
        column = SIGNALS[samples.signal].column
        columns[column], accounts[samples.signal] = _at(samples, ticks, ways)
    return Ticks(columns, rate, accounts)


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


def _is_bridged(samples: Samples, rate: float) -> bool:
    """Whether a table's column is interpolated: that of a slower signal, which is empty between its numbers."""
    return _is_slower(samples, rate) and bool(np.all(np.diff(samples.time) > 0))


def _is_slower(samples: Samples, rate: float) -> bool:
    return samples.rate_hz <= SLOWER * rate


@dataclass(frozen=True)
class _Way:
    """The way from samples to ticks: the sample before each tick, the next one's weight, whether to interpolate."""

    before: npt.NDArray[np.int64]
    weight: Column
    snapped: Column  # the weight, whole where the tick is on a sample
    bridged: npt.NDArray[np.bool_]
    near: npt.NDArray[np.bool_]  # by sample, whether the next one is near

    @cached_property
    def is_whole(self) -> bool:
        """Whether all ticks are interpolated."""
        return bool(self.bridged.all())

    @cached_property
    def counts(self) -> _Counts:
        at, weight = self.before, self.weight
        if not self.is_whole:
            at, weight = at[self.bridged], weight[self.bridged]
        used = np.zeros(len(self.near) + 1, bool)
        if ((weight == 0.0) | (weight == 1.0)).any():
            used[at[weight < 1.0]] = True
            used[at[weight > 0.0] + 1] = True
        else:
            used[at] = used[at + 1] = True
        lonely = ~used
        lonely[:-1] &= ~self.near
        lonely[1:] &= ~self.near
        nearest = at + (weight >= 0.5)
        fresh = int(np.count_nonzero(nearest[1:] != nearest[:-1])) + (len(nearest) > 0)
        return _Counts(int(np.count_nonzero(used)), int(np.count_nonzero(lonely)), fresh, len(at) - fresh)


class _Counts(NamedTuple):
    """Samples that decide a tick, and samples too far from all others; ticks with a new sample, and without."""

    used: int
    lonely: int
    fresh: int
    held: int


def _at(samples: Samples, ticks: Column, ways: dict[int, _Way]) -> tuple[Column, SignalAccount]:
    """A signal at the ticks: linear between two samples near each other, NaN elsewhere."""
    number = len(samples.values) - samples.not_available
    if number < 2:
        account = account_of(samples, 0, 0, _with(samples.lost, "no_neighbour", number), (len(ticks), 0, 0, len(ticks)))
        return np.full(len(ticks), np.nan), account
    time, values = samples.time, samples.values
    if number < len(values):
        available = ~np.isnan(values)
        time, values = time[available], values[available]
        way = _way(time, ticks, bridge_s(samples))
    else:
        if id(time) not in ways:
            ways[id(time)] = _way(time, ticks, bridge_s(samples))
        way = ways[id(time)]
    column, counts = _along(samples.signal, values, way), way.counts
    lost = _with(samples.lost, "no_neighbour", counts.lonely)
    missing = 0 if way.is_whole else int(np.count_nonzero(np.isnan(column)))
    of_ticks = len(ticks), counts.fresh, counts.held, missing
    return column, account_of(samples, counts.used, number - counts.used - counts.lonely, lost, of_ticks)


def bridge_s(samples: Samples) -> float:
    """Maximum distance in s of two samples between which ticks are interpolated."""
    rate = samples.rate_hz
    return max(BRIDGE_PERIODS / rate, BRIDGE_MIN_S) if rate else BRIDGE_MIN_S


def at_ticks(signal: str, time: Column, values: Column, ticks: Column, span_s: float) -> Column:
    """The signal at the ticks, from at least two samples; NaN where they are farther apart than the span."""
    return _along(signal, values, _way(time, ticks, span_s))


def _along(signal: str, values: Column, way: _Way) -> Column:
    if SIGNALS[signal].quantity is PURE_NUMBER:  # a state, which has nothing between two values
        found = values[way.before + (way.weight >= 0.5)]
    elif signal in ("heading", "course"):
        found = np.mod(_between(np.unwrap(values, period=360.0), way), 360.0)
    else:
        found = _between(values, way)
    if not way.is_whole:
        found[~way.bridged] = np.nan
    return found


def _between(values: Column, way: _Way) -> Column:
    start = values[way.before]
    return start + way.snapped * (values[way.before + 1] - start)


def _way(time: Column, ticks: Column, span: float) -> _Way:
    before = np.clip(np.searchsorted(time, ticks, side="right") - 1, 0, len(time) - 2)
    step = time[before + 1] - time[before]
    since = ticks - time[before]
    weight = since / step
    near = np.diff(time) <= span * (1 + 1e-9)
    inside = (since > 0) & (since < step) & near[before]
    on_start, on_end = np.abs(since) <= ON_TICK_S, np.abs(since - step) <= ON_TICK_S
    at_start, at_end = ~inside & on_start, ~inside & on_end
    weight[at_start] = 0.0
    weight[at_end] = 1.0
    # Between two samples too: the remainder of a step of a coarse signal would be taken for its resolution.
    snapped = weight.copy()
    snapped[on_end] = 1.0
    snapped[on_start] = 0.0
    return _Way(before, weight, snapped, inside | at_start | at_end, near)
