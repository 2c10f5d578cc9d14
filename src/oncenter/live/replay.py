"""A log of frames, replayed at its own speed or faster, in place of a bus."""

from __future__ import annotations

import time
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.log_formats import OF_FRAMES
from oncenter.live.snapshot import Dropped
from oncenter.read import refuse_unreadable
from oncenter.read.apart import frames, unpacked
from oncenter.read.frames import Frames, joined
from oncenter.read.plugins import known_format
from oncenter.read.set_back import HOLE_S

SLOWEST, FASTEST = 1.0, 100.0


class Replay:
    """A log's frames at their times. Pauses longer than a few seconds are skipped.

    Args:
        log: a log of CAN frames.
        speed: 1 to 100 times that of the log.

    Raises:
        OncenterError: "replay", exit code 2: no log of frames, or another speed; exit code 1 as for `oncenter.read`:
            the log is missing or cannot be read.
    """

    def __init__(self, log: Path, speed: float) -> None:
        if not SLOWEST <= speed <= FASTEST:
            raise OncenterError(f"--speed must be 1 to 100, got {speed:g}", code="replay", exit_code=WRONG_USAGE)
        refuse_unreadable(log)
        self._unpacked = ExitStack()
        file = self._unpacked.enter_context(unpacked(log))
        if known_format(file).content not in ("frames", "frames and channels"):
            raise OncenterError(
                f"--replay takes a log of CAN frames ({' '.join(OF_FRAMES)}), got {log.name}: "
                "for a table use oncenter offset",
                code="replay",
                exit_code=WRONG_USAGE,
            )
        self.name = str(log)
        self.notes: list[str] = []
        self.dropped = Dropped()
        self.ended = False
        self._speed = speed
        self._chunks = frames(file, self.notes)
        self._waiting = joined([])
        self._started_s = self._log_time_s = 0.0  # the log time at that wall time
        self._load()
        if len(self._waiting):
            self._started_s, self._log_time_s = time.monotonic(), float(self._waiting.time[0])

    def take(self, timeout_s: float) -> Frames:
        """The frames that are due after the timeout; none after the end."""
        time.sleep(timeout_s)
        due_s = self._log_time_s + (time.monotonic() - self._started_s) * self._speed
        return self._until(due_s)

    def close(self) -> None:
        self._chunks.close()
        self._unpacked.close()

    def _until(self, due_s: float) -> Frames:
        parts = []
        while not self.ended:
            if len(self._waiting) and self._waiting.time[0] - due_s > HOLE_S:
                self._started_s, self._log_time_s = time.monotonic(), float(self._waiting.time[0])
                break
            due = np.logical_and.accumulate(self._waiting.time <= due_s)
            parts.append(self._waiting.where(due))
            self._waiting = self._waiting.where(~due)
            if len(self._waiting):
                break
            self._load()
        return joined(parts)

    def _load(self) -> None:
        self._waiting = next((frames for frames in self._chunks if len(frames)), joined([]))
        self.ended = not len(self._waiting)
