"""Converts live frames of a bus to ticks, identical to those that `read` gives for a log of the same frames.

At first the stream only listens. Then it fixes sources and rates, and gives out each tick as soon as no later frame can
change it: each signal has a sample after the tick, or a gap too long for interpolation. If a signal starts later, ticks
wait again until its source and rate are fixed.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from oncenter.errors import OncenterError
from oncenter.read import choose, clock, j1939
from oncenter.read import dbc as databases
from oncenter.read.database_range import NONE, Trusted, within_signal, within_signals
from oncenter.read.decode import decode, wanted_by
from oncenter.read.frames import Column, Frames, Kept, bus_name, joined, pgn_of
from oncenter.read.samples import RATE_S, Samples
from oncenter.read.set_back import CLOCK_SET_BACK_S
from oncenter.signals import SIGNALS, SignalName, Source

LISTEN_S = 5.0  # settles the rates of senders that start in the first 2 s (RATE_S)
LISTEN_LONGER_S = 5.0  # maximum extension for senders that start later
LISTEN_AGAIN_S = 1.0  # until the next attempt if a needed signal is missing
LISTENED_FRAMES_MAX = 50_000  # with signals; the oldest are dropped while needed signals are missing
LATE_S = 0.1  # maximum delay of a frame behind one with a later stamp
# In place of the message of a signal that no J1939 message has.
_NO_HOME = "no J1939 message has it: name it in [signals], or delete rear_axle_steers from the vehicle file"

# Slow signals that a live estimate does not use: not waited for, not given out.
_LEFT_OUT = ("latitude", "longitude", "heading", "course", "lateral_speed")

Ticks = dict[str, Column]  # by column, time_s first; all of one length


@dataclass
class _Sender:
    """One signal of one source, with the samples that may still be needed."""

    samples: Samples  # from the listening phase; identifies the source
    bridge_s: float
    followed: bool  # False: used only to detect gaps of the whole bus
    time: Column = field(default_factory=lambda: np.empty(0))
    values: Column = field(default_factory=lambda: np.empty(0))
    first_s: float = math.nan  # of all its samples, valid or not
    latest_s: float = -math.inf
    numbered: bool = False
    trusted: Trusted = NONE

    def is_of(self, samples: Samples, bus: str) -> bool:
        own = self.samples
        same = (own.signal, own.kind, own.address) == (samples.signal, samples.kind, samples.address)
        return same and (len(own.labels) < 3 or own.labels[2] == bus)

    def take(self, samples: Samples) -> Column:
        """Adds samples later than all before; earlier ones are left out, as in `clock`. Returns the times added."""
        samples, self.trusted = within_signal(samples, self.trusted)
        latest = np.maximum.accumulate(np.concatenate(([self.latest_s], samples.time)))
        later = samples.time > latest[:-1]
        good = later & ~np.isnan(samples.values)
        self.first_s = float(samples.time[0]) if math.isnan(self.first_s) else self.first_s
        self.latest_s = float(latest[-1])
        self.numbered = self.numbered or bool(good.any())
        if self.followed:
            self.time = np.concatenate((self.time, samples.time[good]))
            self.values = np.concatenate((self.values, samples.values[good]))
        return samples.time[later]

    def begin_anew(self) -> None:
        self.time, self.values, self.first_s, self.latest_s = np.empty(0), np.empty(0), math.nan, -math.inf
        self.trusted = NONE

    def undecided_from_s(self, received_s: float) -> float:
        """Ticks before this time no longer change, whatever arrives after `received_s`."""
        newest = float(self.time[-1]) if len(self.time) else -math.inf
        certain = max(received_s - LATE_S, self.latest_s)
        if certain > newest + self.bridge_s * (1 + 1e-6):
            return max(newest, certain - 2 * clock.ON_TICK_S)
        return newest

    def at(self, ticks: Column, *, to_the_end: bool) -> Column:
        """The signal at the ticks. `to_the_end`: no further frames; else a far sample stands for the next one."""
        time, values = self.time, self.values
        if not to_the_end and len(time):
            time, values = np.append(time, time[-1] + 1e6), np.append(values, values[-1])
        if len(time) < 2:
            return np.full(len(ticks), np.nan)
        return clock.at_ticks(self.samples.signal, time, values, ticks, self.bridge_s)

    def forget_before(self, time_s: float) -> None:
        first = max(int(np.searchsorted(self.time, time_s, side="right")) - 2, 0)
        self.time, self.values = self.time[first:], self.values[first:]


class Stream:
    """One bus.

    Args:
        name: for messages.
        needed: signals that must be present before the first tick.
        names, dbc, take: as for `oncenter.read`.

    Attributes:
        sources: by signal; empty while listening.
        rate_hz: of the ticks; 0 while listening.
        notes: one line each about choices made.
        last_s: stamp of the newest frame with a signal; -inf before the first.
        paused: while listening, why it cannot start although all needed signals are present: sources disagree, a source
            given in `take` is missing, or the angle is too slow. None otherwise. It retries continuously.

    Raises:
        OncenterError: from the constructor, a database that cannot be read, or a source named for a signal that does
            not exist.
    """

    def __init__(
        self,
        name: str,
        needed: Sequence[str],
        *,
        names: Mapping[str, SignalName] | None = None,
        dbc: Sequence[str | os.PathLike[str]] = (),
        take: Mapping[str, str] | None = None,
    ) -> None:
        self.name = name
        self._needed = needed
        self.sources: Mapping[str, Source] = {}
        self.rate_hz = 0.0
        self.notes: list[str] = []
        self.last_s = -math.inf
        self.paused: OncenterError | None = None
        self._take = take or {}
        choose.refuse_unknown_signals(self._take)
        self._described = databases.definitions(dbc, names or {}, self.notes)
        wanted = wanted_by(self._described)
        self._pgns = np.array(sorted(wanted.pgns), np.uint32)
        self._standard_ids = np.array(sorted(wanted.standard_ids), np.uint32)
        self._listened: list[Frames] = []
        self._settle_s = self._settle_at_last_s = -math.inf
        self._silent: dict[str, Source] = {}  # of signals without a valid sample so far
        self._new: list[Frames] = []  # since a signal started that is not followed
        self._new_from_s = math.inf
        self._never: set[str] = set(_LEFT_OUT)  # signals that are never followed
        self._pgns_received: dict[int, int] = {}
        self._senders: list[_Sender] = []
        self._origin_s = math.nan
        self._next_tick = 0
        self._waiting = np.empty(0, np.int64)  # ticks not yet decided
        self._sampled_to_s = -math.inf  # newest sample of a chosen signal

    @property
    def listening(self) -> bool:
        return not self._senders

    def missing(self) -> str:
        """The missing and the received signals while listening, or why it is paused; empty if nothing is missing."""
        if self.paused is not None:
            return f"paused: {self.paused}"
        if not self.listening or not self._pgns_received:
            return ""
        found = {samples.signal for samples in self._candidates(joined(self._listened))}
        lacking = [
            f"no {name.replace('_', ' ')} ({j1939.home(name) or _NO_HOME})"
            for name in self._needed
            if name not in found
        ]
        received = sorted(self._pgns_received, key=lambda pgn: -self._pgns_received[pgn])[:8]
        groups = ", ".join(f"{pgn} {j1939.NAMES[pgn]}" if pgn in j1939.NAMES else str(pgn) for pgn in received)
        return f"{'; '.join(lacking)}; on the bus: PGN {groups}" if lacking else ""

    def add(self, frames: Frames) -> Ticks:
        """Adds frames in their order of arrival. Returns the ticks that are now decided, possibly none."""
        frames = self._with_signals(frames)
        if not len(frames):
            return self._none()
        if self.listening and self.clock_was_set_back(frames):
            self._listened, self._settle_s, self._settle_at_last_s = [], -math.inf, -math.inf
        self.last_s = float(frames.time[-1])
        if not self.listening:
            self._sort_in(frames)
            return self._decided()
        self._listened.append(frames)
        self._count_groups(frames)
        if math.isinf(self._settle_s):
            self._settle_s = float(frames.time[0]) + LISTEN_S
        if self.last_s < self._settle_s:
            return self._none()
        everything = joined(self._listened)
        if not self._settle(everything):
            self._settle_s = self.last_s + LISTEN_AGAIN_S
            return self._none()
        self._listened = []
        self._sort_in(everything)
        return self._decided()

    def finish(self) -> Ticks:
        """The remaining ticks, when no further frames follow. The next frame starts a new time."""
        if self.listening:
            return self._none()
        if self._new:
            self._take_in_new(now=True)
        ticks = self._at(self._waiting, to_the_end=True)
        self._begin_anew()
        return ticks

    def pieces(self, frames: Frames) -> list[Frames]:
        """The frames in their order of arrival, parted where the clock was set back among them."""
        backward = np.flatnonzero(np.diff(frames.time) < -CLOCK_SET_BACK_S) + 1
        return [frames.where(rows) for rows in np.split(np.arange(len(frames)), backward)]

    def clock_was_set_back(self, frames: Frames) -> bool:
        return bool(len(frames)) and float(frames.time.max()) < self.last_s - CLOCK_SET_BACK_S

    def newest(self, signal: str) -> tuple[float, float]:
        """Time in s and value in SI of a signal's last valid sample; NaN without one."""
        for sender in self._senders:
            if sender.samples.signal == signal and len(sender.time):
                return float(sender.time[-1]), float(sender.values[-1])
        return math.nan, math.nan

    def _with_signals(self, frames: Frames) -> Frames:
        wanted = frames.extended & np.isin(pgn_of(frames.identifier), self._pgns)
        if len(self._standard_ids):
            wanted |= ~frames.extended & np.isin(frames.identifier, self._standard_ids)
        if self.listening:
            self._count_groups(frames.where(frames.extended & ~wanted))
        in_range = np.isfinite(frames.time) & (np.abs(frames.time) < clock.LATEST_S)
        return frames.where(wanted & in_range)

    def _count_groups(self, frames: Frames) -> None:
        for pgn, count in zip(*np.unique(pgn_of(frames.identifier), return_counts=True), strict=True):
            if len(self._pgns_received) < 1000 or int(pgn) in self._pgns_received:
                self._pgns_received[int(pgn)] = self._pgns_received.get(int(pgn), 0) + int(count)

    def _candidates(self, frames: Frames) -> list[Samples]:
        return decode(_kept(frames), self._described)

    def _settle(self, frames: Frames) -> bool:
        """Fixes sources and rates once all needed signals are present."""
        candidates = within_signals(self._candidates(frames), [])
        numbered = {s.signal for s in candidates if len(s.values) - s.not_available >= 2}
        if not numbered.issuperset(self._needed):
            self._listened = [frames.where(np.arange(len(frames)) >= len(frames) - LISTENED_FRAMES_MAX)]
            return False
        try:
            return self._settle_with(candidates)
        except OncenterError as reason:  # of these sources: others may appear, or these may agree later
            self.paused = reason
            self._listened = [frames.where(frames.time > self.last_s - LISTEN_S)]
            return False

    def _settle_with(self, candidates: Sequence[Samples]) -> bool:
        chosen, sources, left_out = self._chosen(candidates, self._take)
        if math.isinf(self._settle_at_last_s):
            self._settle_at_last_s = self.last_s + LISTEN_LONGER_S
        unsettled = [s for s in chosen if s.signal not in _LEFT_OUT and not s.rate_is_settled]
        if unsettled and self.last_s < self._settle_at_last_s:
            self.paused = None
            return False
        self.rate_hz, self.sources = clock.resampling_rate(chosen, self.name), sources
        self.paused = None
        self.notes += clock.slow_notes(chosen, self.rate_hz)
        self._leave_out(left_out)
        silent = choose.without_number(candidates)
        self._silent = {samples.signal: source for samples, source in silent}
        self._follow([*chosen, *(samples for samples, _ in silent)])
        return True

    def _chosen(
        self, candidates: Sequence[Samples], take: Mapping[str, str]
    ) -> tuple[list[Samples], dict[str, Source], dict[str, str]]:
        """The choice of `choose`, and the signals that it left out although they have valid samples, with a note."""
        notes: list[str] = []
        chosen, sources = choose.choose(candidates, take, self.name, notes)
        numbered = {samples.signal for samples in candidates if samples.not_available < len(samples.values)}
        by_signal = {note.split(":")[0]: note for note in notes}
        return chosen, sources, {signal: by_signal[signal] for signal in numbered - set(sources)}

    def _leave_out(self, signals: Mapping[str, str]) -> None:
        self.notes += signals.values()
        self._never |= set(signals)

    def _follow(self, chosen: Sequence[Samples]) -> list[_Sender]:
        added = [_Sender(s, clock.bridge_s(s), s.signal not in _LEFT_OUT) for s in chosen]
        self._senders = sorted([*self._senders, *added], key=lambda s: list(SIGNALS).index(s.samples.signal))
        return added

    def _take_in_new(self, *, now: bool = False) -> None:
        """Follows signals that started later, once their rates are settled."""
        held = joined(self._new)
        waited = self.last_s - self._new_from_s
        now = now or waited >= LISTEN_S or len(held) > LISTENED_FRAMES_MAX
        if not now and waited < RATE_S:
            return
        candidates = [samples for samples in self._candidates(held) if self._is_new(samples.signal)]
        if not now and not all(samples.rate_is_settled for samples in candidates):
            return
        self._new, self._new_from_s = [], math.inf
        signals = {samples.signal for samples in candidates}
        take = {signal: source for signal, source in self._take.items() if signal in signals}
        try:
            chosen, sources, left_out = self._chosen(candidates, take)
        except OncenterError as disagreement:  # the other signals continue
            self._leave_out(dict.fromkeys(signals, str(disagreement)))
            return
        self._leave_out(left_out)
        silent = choose.without_number(candidates)
        self._silent |= {samples.signal: source for samples, source in silent}
        self.sources = _in_order({**self.sources, **sources})
        self._give(self._follow([*chosen, *(samples for samples, _ in silent)]), held)

    def _is_new(self, signal: str) -> bool:
        return signal not in self._never and all(sender.samples.signal != signal for sender in self._senders)

    def _begin_anew(self) -> None:
        for sender in self._senders:
            sender.begin_anew()
        self._origin_s, self._next_tick, self._waiting = math.nan, 0, np.empty(0, np.int64)
        self._sampled_to_s = self.last_s = -math.inf
        self._new, self._new_from_s = [], math.inf

    def _sort_in(self, frames: Frames) -> None:
        self._give(self._senders, frames)
        if self._new_from_s < math.inf:
            self._new.append(frames)
            self._take_in_new()

    def _give(self, senders: Sequence[_Sender], frames: Frames) -> None:
        times: list[Column] = [np.empty(0)]
        for bus in np.unique(frames.bus):
            name = bus_name(int(bus)).lower()
            for samples in self._candidates(frames.where(frames.bus == bus)):
                for sender in senders:
                    if sender.is_of(samples, name):
                        times.append(sender.take(samples))
                if self._is_new(samples.signal):
                    self._new_from_s = min(self._new_from_s, float(samples.time[0]))
        self._count_ticks(np.sort(np.concatenate(times)))
        self._add_sources()

    def _add_sources(self) -> None:
        for name in [s.samples.signal for s in self._senders if s.numbered and s.samples.signal in self._silent]:
            self.sources = _in_order({**self.sources, name: self._silent.pop(name)})

    def _count_ticks(self, times: Column) -> None:
        """Adds the ticks near which any signal has a sample."""
        if math.isnan(self._origin_s):
            first = clock.leading([sender.samples for sender in self._senders])
            self._origin_s = next(sender.first_s for sender in self._senders if sender.samples is first)
            if math.isnan(self._origin_s) or not len(times):
                return  # samples before the leading signal's first one are ignored
            self._next_tick = math.ceil((float(times[0]) - self._origin_s - clock.ON_TICK_S) * self.rate_hz)
        times = times[times > self._sampled_to_s]
        if not len(times):
            return
        since = times if math.isinf(self._sampled_to_s) else np.concatenate(([self._sampled_to_s], times))
        self._sampled_to_s = float(times[-1])
        numbers = clock.tick_numbers(since, self._origin_s, self.rate_hz)
        numbers = numbers[numbers >= self._next_tick]
        if len(numbers):
            self._next_tick = int(numbers[-1]) + 1
            self._waiting = np.concatenate((self._waiting, numbers))

    def _decided(self) -> Ticks:
        if not len(self._waiting):
            return self._none()
        undecided = (sender.undecided_from_s(self._sampled_to_s) for sender in self._senders if sender.followed)
        before_s = min(*undecided, self._new_from_s - 2 * clock.ON_TICK_S)
        done = int(np.searchsorted(self._origin_s + self._waiting / self.rate_hz, before_s, side="left"))
        ticks = self._at(self._waiting[:done], to_the_end=False)
        self._waiting = self._waiting[done:]
        if done:
            for sender in self._senders:
                sender.forget_before(float(ticks["time_s"][-1]))
        return ticks

    def _at(self, numbers: npt.NDArray[np.int64], *, to_the_end: bool) -> Ticks:
        if not len(numbers):
            return self._none()
        time = self._origin_s + numbers / self.rate_hz
        columns = {
            SIGNALS[sender.samples.signal].column: sender.at(time, to_the_end=to_the_end)
            for sender in self._senders
            if sender.followed and sender.numbered
        }
        return {"time_s": time, **columns}

    def _none(self) -> Ticks:
        return {"time_s": np.empty(0)}


def _in_order(sources: Mapping[str, Source]) -> dict[str, Source]:
    return {signal: sources[signal] for signal in SIGNALS if signal in sources}


def _kept(frames: Frames) -> Kept:
    return Kept(frames, np.empty(0, np.int64), 0)
