"""Lines of a text log that are not frames as usual: rare frames among them, and what is left out, counted."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from oncenter.errors import NeedsLibrary
from oncenter.read.digits import Places
from oncenter.read.fields import Lines
from oncenter.read.frames import Frames, bus_code, frames_of_rows, joined

MANGLED_SHARE = 0.01  # more than that is not a log with a scratch, but one that is written in another way
_LEFT_OUT_MAX = 10_000  # of another file; one by one they take long, which a child process may not
_MANGLED_ANYWAY = 100  # in a log of which only the beginning is known

Row = tuple[float, int, bool, int, int, int]  # columns of `Frames`, the time as written


def row(time: float, identifier: int, extended: bool, data: bytes, bus: int) -> Row:
    """
    Raises:
        ValueError: no frame has such an identifier or so many bytes.
    """
    if not 0 <= identifier < 1 << 32 or len(data) > 8:
        raise ValueError("no frame")
    return time, identifier, extended, int.from_bytes(data.ljust(8, b"\xff"), "little"), len(data), bus_code(str(bus))


@dataclass
class OtherLines:
    """Counts of what is left out.

    Attributes:
        log: its name, for people.
        flexible: frames of CAN FD.
        left_out: lines that are neither a frame nor an event of a log; `first` is the first one.
        mangled: those among them that begin as a frame.
    """

    log: str
    flexible: int = 0
    left_out: int = 0
    first: str = ""
    mangled: int = 0
    lines: int = 0

    def leave_out(self, line: str) -> None:
        self.left_out += 1
        self.first = self.first or line.strip()[:40]

    def frames(self, lines: Lines, read: Callable[[str], Row | None]) -> tuple[Frames, Places]:
        """All frames of a block with times as written, and the lines in which they stand.

        Args:
            lines: with the frames that were read already.
            read: gives the frame of another line, or None; raises ValueError where it begins as a frame and is none,
                IndexError where it ends too early.

        Raises:
            NeedsLibrary: more lines than by accident begin as a frame and are none, or most are none.
        """
        numbers, rows = [], []
        for number in np.flatnonzero(~lines.is_frame & (lines.fields.counts > 0)).tolist():
            line = lines.fields.line(number)
            try:
                found = read(line)
            except (IndexError, ValueError) as error:
                self.mangled += isinstance(error, ValueError)
                self.leave_out(line)
                continue
            if found is not None:
                numbers.append(number)
                rows.append(found)
        self.lines += len(lines.is_frame)
        self._refuse_mangled(_MANGLED_ANYWAY)
        if self.left_out > _LEFT_OUT_MAX and self.left_out > self.lines / 2:
            raise NeedsLibrary(f"most of its lines are no frames, the first reads {self.first!r}")
        if not rows:
            return lines.frames, np.flatnonzero(lines.is_frame)
        merged = joined([lines.frames, frames_of_rows(rows)])
        places = np.concatenate((np.flatnonzero(lines.is_frame), np.array(numbers, np.int64)))
        order = np.argsort(places, kind="stable")
        return merged.where(order), places[order]

    def _refuse_mangled(self, anyway: int) -> None:
        if self.mangled > anyway + MANGLED_SHARE * self.lines:
            raise NeedsLibrary(f"{self.mangled} lines are written as no frames are, the first reads {self.first!r}")

    def notes(self, left_out: str) -> Iterator[str]:
        """At the end of the log.

        Args:
            left_out: what became of the lines that are left out.

        Raises:
            NeedsLibrary: more lines than by accident begin as a frame and are none.
        """
        self._refuse_mangled(0)
        if self.left_out:
            yield f"{self.left_out} lines of {self.log} {left_out}, the first reads {self.first!r}"
        if self.flexible:
            yield f"{self.flexible} CAN FD frames of {self.log} are not read"
