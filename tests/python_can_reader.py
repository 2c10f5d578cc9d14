"""Vector's `.asc` and PEAK's `.trc` by python-can, an independent reader of their frames.

`_AscLines` adds relative times and messages with names, which python-can does not read.
"""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import BinaryIO

from can.io.asc import ASCReader
from can.io.trc import TRCReader

from oncenter.live.bus import data_frames
from oncenter.read.frames import Frames

_BASE = re.compile(r"\s*base\s+(hex|dec)(?:\s+timestamps\s+(absolute|relative))?", re.IGNORECASE)
_NAMED = re.compile(r"(\s*\S+\s+\d+\s+)(?![0-9A-Fa-f]+[xX]?\s)\S+(\s+(?:Rx|Tx)\s+d .*\bID = (\d+)(x?).*)", re.DOTALL)


class _Lines(io.TextIOWrapper):
    """The lines of a text log, without a last line that has no line end."""

    def __init__(self, file: BinaryIO) -> None:
        super().__init__(file, encoding="utf-8", errors="replace")

    def __next__(self) -> str:
        line = super().__next__()
        if not line.endswith("\n"):
            raise StopIteration
        return line


class _AscLines(_Lines):
    def __init__(self, file: BinaryIO) -> None:
        super().__init__(file)
        self._decimal = self._relative = False
        self._time = 0.0

    def __next__(self) -> str:
        line = super().__next__()
        if base := _BASE.match(line):
            self._decimal, self._relative = base[1].lower() == "dec", (base[2] or "").lower() == "relative"
        elif line[:5].lower() == "begin":  # a trigger block has its own date
            self._time = 0.0
        words = line.split(None, 1)
        if self._relative and len(words) == 2 and re.fullmatch(r"\d+(\.\d*)?", words[0]):
            self._time += float(words[0])
            line = line.replace(words[0], f"{self._time:.9f}", 1)
        if named := _NAMED.fullmatch(line):
            number = int(named[3])
            line = f"{named[1]}{number if self._decimal else f'{number:X}'}{named[4]}{named[2]}"
        return line


def python_can_frames(path: Path) -> Frames:
    """
    Raises:
        Exception: of any type: a line is damaged.
    """
    with path.open("rb") as file:
        if path.suffix == ".asc":
            return data_frames(ASCReader(_AscLines(file), relative_timestamp=False))
        return data_frames(TRCReader(_Lines(file)))
