"""Values outside the range that a database states for a signal.

Many databases have a placeholder there, as [0|1] or [0|255]. So the range alone removes nothing: a value beyond it is
used where it continues the signal, and left out where the signal jumps to it, as to a code for an error that the
database does not name. The rule looks back only, so that a bus and its log give the same result.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from oncenter.read.samples import Samples
from oncenter.signals import ACCELERATION, ANGLE, ANGULAR_RATE, PURE_NUMBER, SIGNALS, SPEED, TORQUE

# By SI unit, the fastest change of a road vehicle's signal, per s; twice a driver's or a collision's.
_FASTEST: Mapping[str, float] = {
    ANGLE.unit: 35.0,  # 2000 deg/s
    ANGULAR_RATE.unit: 20.0,
    SPEED.unit: 50.0,
    ACCELERATION.unit: 500.0,
    TORQUE.unit: 2000.0,
    "deg": 1.0,
}
_STEP_MIN_S = 0.05  # frames come in bursts: their stamps may be nearer to each other
_REMEMBERED_S = 2.0  # after a longer time without a trusted value, the next one is trusted


@dataclass(frozen=True)
class Trusted:
    """The last value of a signal that continues it."""

    time_s: float = -np.inf
    value: float = np.nan


NONE = Trusted()


def within_signals(given: Sequence[Samples], notes: list[str]) -> list[Samples]:
    """The samples of a log without those that jump beyond their range. `notes` receives which ranges are exceeded."""
    kept = [within_signal(samples)[0] for samples in given]
    notes += [_note(samples) for samples in kept if samples.beyond is not None and samples.beyond.rows.any()]
    return kept


def _note(samples: Samples) -> str:
    assert samples.beyond is not None
    beyond, count = samples.beyond, int(np.count_nonzero(samples.beyond.rows))
    return (
        f"{samples.signal}: {count} of {len(samples.values)} values of {beyond.name} are outside the range of its "
        f"database, {beyond.low:g} to {beyond.high:g}{f' {beyond.unit}' if beyond.unit else ''}: they continue the "
        "signal and are used; correct the range in the database"
    )


def within_signal(samples: Samples, last: Trusted = NONE) -> tuple[Samples, Trusted]:
    """The samples without those that jump beyond their range, and the last value that continues the signal.

    Args:
        last: of the samples before.
    """
    number = ~np.isnan(samples.values)
    if samples.beyond is None or not (samples.beyond.rows & number).any():
        return samples, _last(samples, number, last)
    rows = np.flatnonzero(number)
    trusted = _continues(samples, rows, last)
    rejected = rows[~trusted]
    beyond = samples.beyond.rows & number
    if not len(rejected):
        return replace(samples, beyond=replace(samples.beyond, rows=beyond)), _last(samples, number, last)
    values, lost = samples.values.copy(), dict(samples.lost)
    values[rejected] = np.nan
    beyond[rejected] = number[rejected] = False
    lost["outside_range"] = lost.get("outside_range", 0) + len(rejected)
    found = replace(samples, values=values, lost=lost, complete=False, beyond=replace(samples.beyond, rows=beyond))
    return found, _last(found, number, last)


def _last(samples: Samples, number: npt.NDArray[np.bool_], last: Trusted) -> Trusted:
    rows = np.flatnonzero(number)
    return Trusted(float(samples.time[rows[-1]]), float(samples.values[rows[-1]])) if len(rows) else last


def _continues(samples: Samples, rows: npt.NDArray[np.int64], last: Trusted) -> npt.NDArray[np.bool_]:
    """Which of the numbers continue the signal: those in the range, and others without a jump since such a one."""
    assert samples.beyond is not None
    quantity = SIGNALS[samples.signal].quantity
    inside = ~samples.beyond.rows[rows]
    if quantity is PURE_NUMBER:
        return inside
    fastest = _FASTEST[quantity.unit]
    time, values = samples.time[rows], samples.values[rows]
    jumps = np.abs(np.diff(values)) > fastest * np.clip(np.diff(time), _STEP_MIN_S, _REMEMBERED_S)
    trusted = inside.copy()
    edges = [0, *(np.flatnonzero(jumps) + 1).tolist(), len(rows)]
    for begin, end in pairwise(edges):
        first = begin if _follows(last, time[begin], values[begin], fastest) else _first(inside, begin, end)
        trusted[first:end] = True
        if first < end:
            last = Trusted(float(time[end - 1]), float(values[end - 1]))
    return trusted


def _follows(last: Trusted, time_s: float, value: float, fastest: float) -> bool:
    """Whether a value continues the last one; after a long time any value does."""
    since_s = time_s - last.time_s
    return not 0.0 <= since_s <= _REMEMBERED_S or abs(value - last.value) <= fastest * max(since_s, _STEP_MIN_S)


def _first(inside: npt.NDArray[np.bool_], begin: int, end: int) -> int:
    """The first row within the range; `end` without one."""
    found = np.flatnonzero(inside[begin:end])
    return begin + int(found[0]) if len(found) else end
