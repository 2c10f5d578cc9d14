"""CANHacker's `.trc`, a block of text at a time: seconds, identifier, number of bytes, bytes, and a comment."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from oncenter.read.fields import Fields, Layout
from oncenter.read.frames import Column, Frames
from oncenter.read.left_out import CutOff
from oncenter.read.other_lines import OtherLines, Row, row
from oncenter.read.text_blocks import TextBlocks

_LAYOUT = Layout(time=0, identifier=1, length=2, data=3)
_MINUTE_S = 60.0  # the adapter's clock begins again after a minute


def chunks(path: Path, notes: list[str], progress: Callable[[float], None]) -> Iterator[Frames]:
    """Data frames, a block of text at a time. `notes` receives what was left out.

    Raises:
        OncenterError: "unreadable_log": most lines are no frames.
    """
    size = max(path.stat().st_size, 1)
    others, clock = OtherLines(path.name), _Clock()
    with path.open("rb") as file:
        text = TextBlocks(file)
        for block in text:
            progress(min(file.tell() / size, 1.0))
            fields = Fields(block.replace(b",", b"."))
            frames, _ = others.frames(fields.frames(_LAYOUT), lambda line: _row(line, others))
            yield replace(frames, time=clock.unwrapped(frames.time))
    if text.cut_off:
        notes.append(CutOff(f"the last line of {path.name} is cut off and was left out", number=1))
    notes += others.notes("that are not CAN frames")


class _Clock:
    """A clock that begins again after a minute, as long as none of its times is later than a minute."""

    def __init__(self) -> None:
        self._last_s = self._minutes_s = 0.0
        self._is_of_a_minute = True

    def unwrapped(self, time: Column) -> Column:
        if not len(time):
            return time
        self._is_of_a_minute &= bool(time.max() < _MINUTE_S + 1.0)
        if not self._is_of_a_minute:
            return time + self._minutes_s
        back = np.diff(time, prepend=self._last_s) < -_MINUTE_S / 2.0
        whole: Column = time + self._minutes_s + np.cumsum(back) * _MINUTE_S
        self._last_s, self._minutes_s = float(time[-1]), float(self._minutes_s + back.sum() * _MINUTE_S)
        return whole


def _row(line: str, others: OtherLines) -> Row | None:
    """
    Raises:
        ValueError: the line starts like a frame but cannot be parsed.
    """
    words = line.split()
    if not words[0][:1].isdigit():
        if words[0] != "Time":
            others.leave_out(line)
        return None
    if "RTR" in words[2:]:
        others.count_no_data("remote_frame")
        return None
    count = int(words[2])
    data = bytes(int(words[3 + k], 16) for k in range(count))
    return row(float(words[0]), int(words[1], 16), len(words[1]) > 4, data, 1)
