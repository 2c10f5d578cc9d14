"""Raw frames on disk in candump's format: one line per frame, whole lines only, even if the program is killed.

Not MF4: an MF4 file is valid only after it is closed. A power cut costs one second of a candump log.
"""

from __future__ import annotations

import io
import os
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.regular_file import O_BINARY

if TYPE_CHECKING:
    import can

WAITING_MAX_BYTES = 64 << 20  # while the disk is full: 15 min of 2,000 frames/s
_EVERY_S = 0.2
_SYNC_EVERY_S = 1.0  # the loss at a power cut
_AGAIN_S = 1.0


class Recorder:
    """Writes in its own thread, so that a slow or full disk delays no frame.

    Args:
        path: of a new log.
        say: called with one line when the disk is full, and when writing continues.

    Attributes:
        lost: frames missing in the file, so far.

    Raises:
        OncenterError: "output", exit code 2: the file is there already, or cannot be made.
    """

    def __init__(self, path: Path, say: Callable[[str], None]) -> None:
        from can.io.canutils import CanutilsLogWriter

        if path.suffix != ".log":
            raise OncenterError(
                f"--record takes a .log file (candump's), got {path.name}", code="output", exit_code=WRONG_USAGE
            )
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | O_BINARY, 0o644)
        except OSError as error:
            raise OncenterError(
                f"cannot record to {path}: {error.strerror}", code="output", exit_code=WRONG_USAGE
            ) from None
        self._path, self._say = path, say
        self._text = io.StringIO()
        self._writer = CanutilsLogWriter(self._text)
        self._lock = threading.Lock()
        self._given: list[can.Message] = []
        self._pending = bytearray()  # whole lines; of the first line a part may be written
        self.lost = 0
        self._reported_lost = 0
        self._full = False
        self._next_sync_s = 0.0
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="oncenter record", daemon=True)
        self._thread.start()

    def take(self, messages: Sequence[can.Message]) -> None:
        with self._lock:
            self._given.extend(messages)

    def close(self) -> None:
        self._stopping.set()
        self._thread.join()
        os.close(self._file)
        if self._pending:
            last = self._pending.count(10)
            self.lost += last
            self._say(f"{self._path}: the last {last} frames were not recorded")

    def _run(self) -> None:
        while not self._stopping.wait(_AGAIN_S if self._full else _EVERY_S):
            self._write()
        self._write()

    def _write(self) -> None:
        with self._lock:
            given, self._given = self._given, []
        self._format(given)
        try:
            while self._pending:
                del self._pending[: os.write(self._file, self._pending[: 1 << 20])]
            if time.monotonic() >= self._next_sync_s:
                os.fsync(self._file)
                self._next_sync_s = time.monotonic() + _SYNC_EVERY_S
        except OSError as error:
            self._report_full(error)
            return
        if self._full:
            self._full = False
            missing = self.lost - self._reported_lost
            self._reported_lost = self.lost
            lost = f", {missing} frames are missing" if missing else ", nothing is missing"
            self._say(f"{self._path} is recorded again{lost}")

    def _format(self, messages: Sequence[can.Message]) -> None:
        if len(self._pending) > WAITING_MAX_BYTES:
            self.lost += len(messages)
            return
        for message in messages:
            self._writer.on_message_received(message)
        self._pending += self._text.getvalue().encode("ascii", "replace")
        self._text.seek(0)
        self._text.truncate()

    def _report_full(self, error: OSError) -> None:
        if not self._full:
            self._full = True
            self._say(
                f"cannot record to {self._path}: {error.strerror}; frames are kept in memory, the estimate continues"
            )
