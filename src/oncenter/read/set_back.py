"""A log whose clock was set back, or wrapped, falls into pieces. Here they are put behind one another on one clock, so
that all steps of reading see increasing times; `SetBack.recorded` gives the recorded times of the result.

Wrapped counters (2^32 us after 71.6 min), midnight, a receiver's time and logs behind one another are all alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from oncenter.read.frames import Column, Frames
from oncenter.read.samples import Samples

CLOCK_SET_BACK_S = 1.0  # a larger backward step between two samples of a sender; a smaller one is a late sample
HOLE_S = 5.0  # a longer gap in all signals has no rows
_BETWEEN_S = 2.0 * HOLE_S  # between two pieces on the one clock
_SHARE_MAX = 0.1  # of the steps; more backward steps mean that the column is not a time
_Positions = npt.NDArray[np.int64]


@dataclass(frozen=True)
class SetBack:
    """The pieces after the first.

    Attributes:
        begins_s: their first times on the one clock, ascending.
        shifts_s: the time on the one clock less the recorded time, of each.
    """

    begins_s: tuple[float, ...] = ()
    shifts_s: tuple[float, ...] = ()

    def recorded(self, time: Column) -> Column:
        """The recorded times; the same array where the clock was never set back."""
        if not self.begins_s:
            return time
        pieces = np.searchsorted(np.array(self.begins_s) - _BETWEEN_S / 2.0, time, side="right")
        recorded: Column = time - np.array((0.0, *self.shifts_s))[pieces]
        return recorded

    def notes(self, log: str) -> list[str]:
        if not self.begins_s:
            return []
        times = "once" if len(self.begins_s) == 1 else f"{len(self.begins_s)} times"
        steps = np.diff((0.0, *self.shifts_s)) - _BETWEEN_S
        return [
            f"the clock of {log} was set back or wrapped {times}, by up to {float(steps.max()):.6g} s: the log is used "
            f"in {len(self.begins_s) + 1} pieces; a part that was recorded twice is used twice"
        ]


def frames_on_one_clock(frames: Frames) -> tuple[Frames, SetBack]:
    """Frames in the order of the log, with times on one clock.

    The clock was set back where the frames of one sender step back. Senders behind one another in a file, as of two
    buses, are no such place.
    """
    if len(frames) < 2 or np.diff(frames.time).min() >= -CLOCK_SET_BACK_S:
        return frames, SetBack()
    time, steps = _by_sender(frames)
    cuts = _cuts(frames.time, steps)
    if not cuts:
        return replace(frames, time=time), SetBack()
    pieces = np.zeros(len(time), np.int64)
    pieces[cuts] = 1
    (shifted,), set_back = _behind_one_another([time], [np.cumsum(pieces)])
    return replace(frames, time=shifted), set_back


def pieces_of(frames: Frames) -> _Positions:
    """For each frame, how often the clock was set back before it, by the other frames of its sender."""
    pieces = np.zeros(len(frames), np.int64)
    if len(frames) < 2 or np.diff(frames.time).min() >= -CLOCK_SET_BACK_S:
        return pieces
    for rows in _senders(frames):
        backward = _steps_back(frames.time[rows])[1]
        pieces[rows] = np.searchsorted(backward, np.arange(len(rows)), side="right")
    return pieces


def on_one_clock(given: Sequence[Samples]) -> tuple[list[Samples], SetBack]:
    """Samples of a file with channels or columns, with times on one clock. Samples may share a time array."""
    firsts = {id(samples.time): samples.time for samples in given if len(samples.time) > 1}
    found = {key: _steps_back(time) for key, time in firsts.items()}
    if not any(len(backward) for _, backward in found.values()):
        return list(given), SetBack()
    pieces = [np.searchsorted(found[key][1], np.arange(len(time)), side="right") for key, time in firsts.items()]
    shifted, set_back = _behind_one_another([time for time, _ in found.values()], pieces)
    by_key = dict(zip(firsts, shifted, strict=True))
    return [
        replace(samples, time=by_key.get(id(samples.time), samples.time), steps=None) for samples in given
    ], set_back


def _by_sender(frames: Frames) -> tuple[Column, list[tuple[int, int]]]:
    """The times without wrong single stamps, and for each backward step of a sender the positions around it."""
    time, steps = frames.time.copy(), []
    for rows in _senders(frames):
        own, backward = _steps_back(frames.time[rows])
        time[rows] = own
        steps += [(int(rows[k - 1]), int(rows[k])) for k in backward.tolist()]
    return time, steps


def _senders(frames: Frames) -> list[_Positions]:
    """The positions of the frames of each sender."""
    order = np.lexsort((np.arange(len(frames)), frames.bus, frames.identifier))
    other = (np.diff(frames.identifier[order]) != 0) | (np.diff(frames.bus[order]) != 0)
    return np.split(order, np.flatnonzero(other) + 1)


def _steps_back(time: Column) -> tuple[Column, _Positions]:
    """The times of one sender without wrong single stamps, which get the time of the sample before and so are left out
    later, and where the clock was set back. Too many steps mean that the column is not a time."""
    none = np.empty(0, np.int64)
    if len(time) < 2 or np.diff(time).min() >= -CLOCK_SET_BACK_S:
        return time, none
    wrong = np.zeros(len(time), bool)
    across = time[2:] - time[:-2]
    beside = (time[1:-1] < time[:-2] - CLOCK_SET_BACK_S) | (time[1:-1] > time[2:] + CLOCK_SET_BACK_S)
    wrong[1:-1] = (across > 0.0) & (across < HOLE_S) & beside
    wrong[1:] &= ~wrong[:-1]
    right = np.flatnonzero(~wrong)
    backward = right[1:][np.diff(time[right]) < -CLOCK_SET_BACK_S]
    if len(backward) > _SHARE_MAX * len(time):
        return time, none
    own = time.copy()
    own[wrong] = time[np.flatnonzero(wrong) - 1]
    return own, backward


def _cuts(time: Column, steps: Sequence[tuple[int, int]]) -> list[int]:
    """The first frames of the pieces: each step of a sender has one cut between its two frames, and a cut is where the
    log steps back most."""
    cuts: list[int] = []
    begin, end = -1, -1
    for before, after in sorted(steps, key=lambda step: step[1]):
        if before < end:
            begin = max(begin, before)
            continue
        if end >= 0:
            cuts.append(_largest_step_back(time, begin, end))
        begin, end = before, after
    if end >= 0:
        cuts.append(_largest_step_back(time, begin, end))
    return cuts


def _largest_step_back(time: Column, after: int, last: int) -> int:
    """The position from `after` + 1 to `last` with the largest backward step before it."""
    return after + 1 + int(np.argmin(np.diff(time[after : last + 1])))


def _behind_one_another(times: Sequence[Column], pieces: Sequence[_Positions]) -> tuple[list[Column], SetBack]:
    """Times with each piece after the one before."""
    count = 1 + max(int(each.max()) for each in pieces)
    begins, ends = np.full(count, np.inf), np.full(count, -np.inf)
    for time, of in zip(times, pieces, strict=True):
        np.minimum.at(begins, of, time)
        np.maximum.at(ends, of, time)
    shifts = [0.0]
    for k in range(1, count):
        shifts.append(shifts[-1] + float(ends[k - 1]) - float(begins[k]) + _BETWEEN_S)
    all_shifts = np.array(shifts)
    shifted = [time + all_shifts[of] for time, of in zip(times, pieces, strict=True)]
    return shifted, SetBack(tuple((begins + all_shifts)[1:].tolist()), tuple(shifts[1:]))
