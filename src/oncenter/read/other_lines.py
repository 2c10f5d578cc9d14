"""Lines of a text log that are not ordinary frames: parses unusual frames, and counts what is left out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from oncenter.read.digits import Places
from oncenter.read.fields import Lines
from oncenter.read.frames import BYTES_MAX, Frames, bus_code, frames_of_rows, joined
from oncenter.read.left_out import LeftOut, left_out_frames
from oncenter.read.wording import counted, damaged

MANGLED_SHARE = 0.01  # more mean another layout, not local damage
_LEFT_OUT_MAX = 10_000  # parsing more lines one by one would take minutes
_MANGLED_ANYWAY = 100  # accepted before the share is meaningful

Row = tuple[float, int, bool, int, int, int]  # columns of `Frames`, the time as in the file


def row(time: float, identifier: int, extended: bool, data: bytes | bytearray, bus: object) -> Row:
    """
    Raises:
        ValueError: the identifier or the number of bytes is impossible.
    """
    if not 0 <= identifier < 1 << 32 or len(data) > BYTES_MAX:
        raise ValueError("not a frame")
    padded = data.ljust(8 if len(data) <= 8 else BYTES_MAX, b"\xff")
    return time, identifier, extended, int.from_bytes(padded, "little"), len(data), bus_code(str(bus))


@dataclass
class OtherLines:
    """Counts of lines left out.

    Attributes:
        log: its name, for messages.
        no_data: frames without usable data, by reason.
        left_out: lines that are neither a frame nor an event; `first` is the first of them.
        mangled: those of them that start like a frame.
    """

    log: str
    no_data: Counter[str] = field(default_factory=Counter)
    left_out: int = 0
    first: str = ""
    mangled: int = 0
    lines: int = 0

    def leave_out(self, line: str) -> None:
        self.left_out += 1
        self.first = self.first or line.strip()[:40]

    def count_no_data(self, reason: str | None) -> None:
        """Counts a frame without usable data; None for a line that is no frame."""
        if reason is not None:
            self.no_data[reason] += 1

    def frames(self, lines: Lines, read: Callable[[str], Row | None]) -> tuple[Frames, Places]:
        """All frames of a block with times as in the file, and their line numbers.

        Args:
            lines: with the frames parsed so far.
            read: gives the frame of another line, or None; raises ValueError if the line starts like a frame but cannot
                be parsed, IndexError if it ends too early.

        Raises:
            OncenterError: too many lines start like a frame but cannot be parsed, or most lines are not frames.
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
            raise damaged(self.log, f"most of its lines are not frames, the first of them reads {self.first!r}")
        if not rows:
            return lines.frames, np.flatnonzero(lines.is_frame)
        merged = joined([lines.frames, frames_of_rows(rows)])
        places = np.concatenate((np.flatnonzero(lines.is_frame), np.array(numbers, np.int64)))
        order = np.argsort(places, kind="stable")
        return merged.where(order), places[order]

    def _refuse_mangled(self, anyway: int) -> None:
        if self.mangled > anyway + MANGLED_SHARE * self.lines:
            raise damaged(self.log, f"{self.mangled} lines have an unknown layout, the first reads {self.first!r}")

    def notes(self, which: str) -> Iterator[str]:
        """Notes at the end of the log.

        Args:
            which: describes the lines left out, as "that are not CAN frames".

        Raises:
            OncenterError: too many lines start like a frame but cannot be parsed.
        """
        self._refuse_mangled(0)
        if self.left_out:
            text = f"left out {counted(self.left_out, 'line')} of {self.log} {which}, the first reads {self.first!r}"
            yield LeftOut(text, "unreadable", self.left_out)
        yield from left_out_frames(self.log, self.no_data)
