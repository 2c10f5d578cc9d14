"""One session: a thread takes frames from a bus or a log through the learner, records and saves.

Displays read `snapshot`; the session never waits for them.
"""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from oncenter import _core
from oncenter.live import words
from oncenter.live.bus import data_frames
from oncenter.live.history import History
from oncenter.live.learner import Known, Learner, Stepped
from oncenter.live.snapshot import Angles, Dropped, Notice, Pictures, Snapshot
from oncenter.live.steady_verdict import SteadyVerdict
from oncenter.read.frames import Frames
from oncenter.signals import DEGREE
from oncenter.verdict import Verdict, verdicts_of

if TYPE_CHECKING:
    from oncenter.live.bus import Bus
    from oncenter.live.memory import Memory
    from oncenter.live.record import Recorder
    from oncenter.live.replay import Replay
    from oncenter.live.trace import Trace

SHOW_EVERY_S = 0.02  # smooth for a needle
KNOW_EVERY_S = 0.2
PICTURE_EVERY_S = 1.0
SAVE_EVERY_S = 60.0
SILENT_S = 3.0
LOSSES_OVER_S = 60.0  # without a lost frame, after which the next loss is reported again
NOTICES_MAX = 100
ESTIMATE_SD_MAX_RAD = 10.0 * DEGREE  # wider is no estimate: at standstill the motion has no steering angle in it
_TAKE_S = 0.01


class Session(threading.Thread):
    """Runs until `stop`, or until a replayed log ends; then saves and writes everything.

    Args:
        source: a bus or a log, open.
        learner: of the truck.
        truck: its key, for display.
        notices: lines for people, earlier ones and those of the session.
        memory, recorder, trace: optional.

    Attributes:
        snapshot: the newest; replaced, never modified.
        when_shown: called from the session's thread for each new snapshot; must return at once.
        failure: the exception that ended the session, if any.
    """

    def __init__(
        self,
        source: Bus | Replay,
        learner: Learner,
        truck: str,
        notices: Notices,
        *,
        memory: Memory | None = None,
        recorder: Recorder | None = None,
        trace: Trace | None = None,
    ) -> None:
        super().__init__(name="oncenter learner", daemon=True)
        self.failure: BaseException | None = None
        self.when_shown: Callable[[], None] = lambda: None
        self._source, self._learner, self._truck, self._notices = source, learner, truck, notices
        self._memory, self._recorder, self._trace = memory, recorder, trace
        self._history = History()
        self._stopping = threading.Event()
        self._frames = 0
        self._rate = _Rate()
        self._driven_s = 0.0
        self._known: Known = learner.known()
        self._steady = SteadyVerdict()
        self._missing = ""
        self._last_frame_s = time.monotonic()
        self._silent = False
        self._reported_paused = ""
        self._reported_dropped = Dropped()
        self._loss_s = -math.inf  # when the last frame was lost
        self._due = {"show": 0.0, "know": 0.0, "picture": 0.0, "save": time.monotonic() + SAVE_EVERY_S}
        self._pictures = Pictures(0, self._history.course(), self._history.strip(), self._history.cloud())
        self._number = 0
        self.snapshot = self._show("listening")

    def stop(self) -> None:
        self._stopping.set()

    def run(self) -> None:
        try:
            while not self._stopping.is_set() and not getattr(self._source, "ended", False):
                self._turn()
        except BaseException as failure:
            self.failure = failure
        finally:
            self._end()

    def _turn(self) -> None:
        frames = self._take()
        now = time.monotonic()
        self._watch_silence(len(frames), now)
        self._rate.count(len(frames), now)
        for stepped in self._learner.take(frames) if len(frames) else []:
            self._keep(stepped)
        self._watch_pause()
        self._refresh(now)

    def _take(self) -> Frames:
        taken = self._source.take(_TAKE_S)
        if isinstance(taken, Frames):
            self._frames += len(taken)
            return taken
        self._frames += len(taken)
        if taken and self._recorder is not None:
            self._recorder.take(taken)
        time.sleep(_TAKE_S if taken else 0.0)  # a batch costs little more than one frame
        return data_frames(taken)

    def _keep(self, stepped: Stepped) -> None:
        self._driven_s += len(stepped) / self._learner.stream.rate_hz
        self._history.take(stepped)
        if self._trace is not None:
            self._trace.take(stepped)

    def _watch_silence(self, count: int, now: float) -> None:
        if count:
            if self._silent:
                self._notices.say(f"frames again after {now - self._last_frame_s:.0f} s")
            self._silent, self._last_frame_s = False, now
        elif not self._silent and now - self._last_frame_s > SILENT_S:
            self._silent = True
            self._notices.say(
                f"no frame on {self._source.name} for {SILENT_S:.0f} s: check cable, ignition and bitrate"
            )

    def _watch_pause(self) -> None:
        paused = self._learner.stream.paused
        before, self._reported_paused = self._reported_paused, "" if paused is None else str(paused)
        if self._reported_paused and not before:
            recorded = "" if self._recorder is None else ", recording continues"
            self._notices.say(f"the estimate is paused{recorded}: {paused}")
        if before and not self._reported_paused:
            self._notices.say("the estimate continues")

    def _watch_losses(self, dropped: Dropped, now: float) -> None:
        if dropped.lost == self._reported_dropped.lost:
            return
        if now - self._loss_s > LOSSES_OVER_S:
            self._notices.say(f"frames are being lost: {words.losses(dropped)}")
        self._loss_s, self._reported_dropped = now, dropped

    def _refresh(self, now: float) -> None:
        if self._is_due("know", KNOW_EVERY_S, now):
            self._known = self._learner.known()
            self._steady.update(self._verdict(), self._driven_s)
        if self._is_due("picture", PICTURE_EVERY_S, now):
            self._picture()
        if self._is_due("save", SAVE_EVERY_S, now):
            self._save()
        if self._is_due("show", SHOW_EVERY_S, now):
            self.snapshot = self._show(self._phase())
            self.when_shown()

    def _phase(self) -> str:
        stream = self._learner.stream
        if stream.listening:
            return "listening" if stream.paused is None else "paused"
        return "silent" if self._silent else "running"

    def _is_due(self, what: str, every_s: float, now: float) -> bool:
        if now < self._due[what]:
            return False
        self._due[what] = now + every_s
        return True

    def _picture(self) -> None:
        history, number = self._history, self._pictures.number + 1
        self._pictures = Pictures(number, history.course(), history.strip(), history.cloud())
        self._missing = self._learner.stream.missing()

    def _save(self) -> None:
        if self._memory is not None and self._learner.core:
            self._memory.save(self._learner.core)

    def _show(self, phase: str) -> Snapshot:
        self._number += 1
        dropped = self._dropped()
        self._watch_losses(dropped, time.monotonic())
        return Snapshot(
            number=self._number,
            bus=self._source.name,
            truck=self._truck,
            phase=phase,
            missing=self._missing,
            frames=self._frames,
            frames_per_s=self._rate.per_s,
            dropped=dropped,
            driven_s=self._driven_s,
            angles=self._angles(),
            reasons=self._reasons(),
            fault="none" if self._learner.last is None else _core.FAULTS[self._learner.last.outputs["fault"][-1]],
            known=self._known,
            pictures=self._pictures,
            notices=self._notices.all(),
            verdict=self._steady.shown,
            is_changing=self._steady.is_changing,
        )

    def _verdict(self) -> Verdict | None:
        return None if self._known.answer is None else verdicts_of(self._known.answer)[0]

    def _dropped(self) -> Dropped:
        lost = 0 if self._recorder is None else self._recorder.lost
        return replace(self._source.dropped, recording=lost)

    def _angles(self) -> Angles:
        if self._silent:
            return Angles()
        last, stream = self._learner.last, self._learner.stream
        frame_s, measured = stream.newest("steering_wheel_angle")
        if last is None:
            return Angles(frame_s=frame_s, measured_rad=measured)
        offset, angle = last.outputs[-1], last.outputs[-1]["angle"]
        has_offset = _core.STATUSES[offset["offset_status"]] != "unobservable"
        sd = float(angle["estimate_sd"])
        is_estimated = _core.STATUSES[angle["status"]] != "unobservable" and sd < ESTIMATE_SD_MAX_RAD
        return Angles(
            frame_s=frame_s,
            measured_rad=measured,
            corrected_rad=measured - self._learner.turned_rad - float(offset["offset"]) if has_offset else math.nan,
            estimated_rad=float(angle["estimate"]) if is_estimated else math.nan,
            estimated_sd_rad=sd if is_estimated else math.nan,
            vehicle_speed_m_s=stream.newest("vehicle_speed")[1],
        )

    def _reasons(self) -> tuple[str, ...]:
        if self._learner.last is None:
            return ("missing_signal",)
        bits = int(self._learner.last.outputs[-1]["reasons"])
        return _core.reasons_of(bits)

    def _end(self) -> None:
        """Drains, saves and closes; a step that fails does not stop the next."""
        for step in (self._source.close, self._drain, self._save, self._close_others):
            try:
                step()
            except BaseException as failure:
                self.failure = self.failure or failure
        self._report_losses()
        final = replace(self._show("ended"), verdict=self._verdict(), is_changing=False)
        self.snapshot = replace(final, ended_s=time.time())
        self.when_shown()

    def _report_losses(self) -> None:
        dropped = words.losses(self._dropped())
        if dropped:
            self._notices.say(f"of {self._frames} frames in all, {dropped}")

    def _drain(self) -> None:
        frames = self._take()
        for stepped in [*(self._learner.take(frames) if len(frames) else []), *self._learner.finish()]:
            self._keep(stepped)
        self._known = self._learner.known()
        self._picture()

    def _close_others(self) -> None:
        for kept in (self._recorder, self._trace, self._memory):
            if kept is not None:
                kept.close()


class Notices:
    """Lines for people from any thread; keeps the newest `NOTICES_MAX`."""

    def __init__(self) -> None:
        self._lines: deque[Notice] = deque(maxlen=NOTICES_MAX)
        self._lock = threading.Lock()
        self._number = 0

    def say(self, text: str) -> None:
        with self._lock:
            self._number += 1
            self._lines.append(Notice(self._number, time.time(), text))

    def all(self) -> tuple[Notice, ...]:
        with self._lock:
            return tuple(self._lines)


class _Rate:
    """Frames per second, over the last seconds."""

    def __init__(self) -> None:
        self.per_s = 0.0
        self._begin_s = time.monotonic()
        self._count = 0

    def count(self, frames: int, now: float) -> None:
        self._count += frames
        passed = now - self._begin_s
        if passed >= 1.0:
            self.per_s, self._begin_s, self._count = self._count / passed, now, 0
