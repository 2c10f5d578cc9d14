"""Progress of a run: logs done, rate and time left, in one line that is overwritten on a terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping
from typing import Any

_EVERY_S = 0.5
_EVERY_S_IN_A_FILE = 60.0


class Progress:
    """The progress on stderr. `done` counts logs of this run."""

    def __init__(self, to_do: int) -> None:
        self._to_do = to_do
        self._begin = self._shown = time.monotonic()
        self._terminal = sys.stderr.isatty()
        self._width = 0
        self.done = self.errors = self.copies = 0

    @property
    def seconds(self) -> float:
        return time.monotonic() - self._begin

    @property
    def rate(self) -> float:
        """Logs per second so far."""
        return self.done / max(self.seconds, 1e-9)

    def one_more(self, row: Mapping[str, Any]) -> None:
        """
        Args:
            row: of `tables.DRIVES`, or `drive.copy_of`.
        """
        self.done += 1
        self.errors += row.get("error_code") is not None
        self.copies += row.get("is_copy", False)
        every = _EVERY_S if self._terminal else _EVERY_S_IN_A_FILE
        if time.monotonic() - self._shown >= every:
            self._shown = time.monotonic()
            if self._terminal:
                self._write_over(self.line())
            else:
                print(self.line(), file=sys.stderr, flush=True)

    def line(self) -> str:
        left_s = round((self._to_do - self.done) / max(self.rate, 1e-9))
        left = f"{left_s // 3600}:{left_s // 60 % 60:02}:{left_s % 60:02}"
        failed = f", {self.errors} without an answer" if self.errors else ""
        return f"{self.done} of {self._to_do} logs, {self.rate:.1f}/s, {left} left{failed}"

    def end(self) -> None:
        if self._terminal and self.done:
            self._write_over("")
            print("\r", end="", file=sys.stderr, flush=True)

    def _write_over(self, line: str) -> None:
        """Writes over the line and pads with blanks: not every Windows console can clear the rest of a line."""
        print(f"\r{line:{self._width}}", end="", file=sys.stderr, flush=True)
        self._width = len(line)
