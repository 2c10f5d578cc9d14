"""BUSMASTER's `.log`, of CAN and of J1939, a block of text at a time.

A line of its header names the columns. Times are h:m:s:digits: of the day, since the start, or since the line before.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from datetime import datetime
from itertools import islice, pairwise
from pathlib import Path

import numpy as np

from oncenter.read.fields import Fields, Layout, Lines
from oncenter.read.frames import Column, Frames
from oncenter.read.left_out import CutOff
from oncenter.read.other_lines import OtherLines, Row, row
from oncenter.read.text_blocks import TextBlocks

_SESSION = re.compile(rb"\n(?=\*\*\*\[START LOGGING)")
_SESSIONS_MAX = 100  # in a block
_START = re.compile(r"\*\*\*START DATE AND TIME (\d+):(\d+):(\d+) (\d+):(\d+):(\d+):(\d+)\*\*\*")
_COLUMNS = ("Time", "Tx/Rx", "Channel", "CAN ID", "Type", "DLC", "DataBytes")
_CLOCK_FIELDS = 4  # h m s and digits, once their colons are blanks
_BLANKS = bytes.maketrans(b":", b" ")
_DAY_S = 86_400.0
_HOURS_MAX = 10_000  # of a measurement
_DIRECTIONS = (b"Rx", b"Tx")


def chunks(path: Path, notes: list[str], progress: Callable[[float], None]) -> Iterator[Frames]:
    """Data frames, a block of text at a time. `notes` receives what was left out.

    Raises:
        OncenterError: "unreadable_log": most lines are no frames.
    """
    size = max(path.stat().st_size, 1)
    with path.open("rb") as file:
        text, log = TextBlocks(file), _Log(OtherLines(path.name))
        for block in text:
            progress(min(file.tell() / size, 1.0))
            sessions = islice(_SESSION.finditer(block), _SESSIONS_MAX)
            for begin, end in pairwise([0, *(found.end() for found in sessions), len(block)]):
                yield log.frames(block[begin:end])
    if text.cut_off:
        notes.append(CutOff(f"the last line of {path.name} is cut off and was left out", number=1))
    notes += log.others.notes("that are not CAN frames")


@dataclass
class _Log:
    """The header that applies to the following lines.

    Attributes:
        others: lines that are not ordinary frames.
        places: of the columns, in fields.
        decimal: whether identifiers and data are decimal numbers.
        mode: "SYSTEM", "ABSOLUTE" or "RELATIVE".
        start_s: since 1970, of the day in system mode, else of the session.
        last_s: the last time as in the file, without days before it; in relative mode the sum of all.
        days_s: of midnights since the start.
    """

    others: OtherLines
    places: dict[str, int] = field(default_factory=lambda: _places(_COLUMNS))
    decimal: bool = False
    mode: str = "SYSTEM"
    start_s: float = 0.0
    last_s: float = 0.0
    days_s: float = 0.0

    def frames(self, block: bytes) -> Frames:
        """
        Raises:
            OncenterError: as `chunks`.
        """
        for line in re.findall(rb"^\*\*\*.*", block, re.MULTILINE):
            self._head(line.decode("utf-8", "replace").strip())
        fields = Fields(block.translate(_BLANKS).replace(b" 0x", b" "))
        at = self.places
        types = () if "PGN" in at else ((at["Type"], (b"s", b"x", b"S", b"X")),)
        layout = Layout(
            time=2,
            identifier=at["CAN ID"],
            length=at["DLC"],
            data=at["DataBytes"],
            words=((at["Tx/Rx"], _DIRECTIONS), *types),
            bus=at["Channel"],
            decimal=self.decimal,
        )
        lines = fields.frames(layout)
        rows = np.flatnonzero(lines.is_frame)
        extended = np.ones(len(rows), bool) if "PGN" in at else fields.begins_with(rows, at["Type"], b"xX")
        ours = replace(lines.frames, time=fields.clock(rows, 0), extended=extended)
        frames, _ = self.others.frames(Lines(fields, lines.is_frame, ours), self._row)
        return replace(frames, time=self._since_1970(frames.time))

    def _head(self, line: str) -> None:
        if "START LOGGING SESSION" in line:
            self.last_s = self.days_s = 0.0
        start = _START.fullmatch(line)
        if start is not None:
            day, month, year, hour, minute, second, _ = map(int, start.groups())
            try:
                self.start_s = datetime(year, month, day, hour, minute, second).timestamp()
            except (ValueError, OverflowError, OSError):
                self.start_s = 0.0
            self._of_day_s = hour * 3600.0 + minute * 60.0 + second
        elif line in ("***HEX***", "***DEC***"):
            self.decimal = line == "***DEC***"
        elif line.endswith(" MODE***"):
            self.mode = line.removeprefix("***").partition(" ")[0]
        elif line.startswith("***<Time>"):
            columns = re.findall(r"<([^<>]+)>", line)
            places = _places(columns)
            if {*_COLUMNS[1:4], *_COLUMNS[5:]} <= places.keys() and ("Type" in places or "PGN" in places):
                self.places = places

    _of_day_s: float = 0.0

    def _since_1970(self, time: Column) -> Column:
        if not len(time):
            return time
        if self.mode == "RELATIVE":
            time = np.round(self.last_s + np.cumsum(time), 9)
            self.last_s = float(time[-1])
            return time + self.start_s
        begun_s = self.start_s - (self._of_day_s if self.mode == "SYSTEM" and self.start_s else 0.0)
        days_s = self.days_s + np.cumsum(np.diff(time, prepend=self.last_s) < -_DAY_S / 2.0) * _DAY_S
        self.last_s, self.days_s = float(time[-1]), float(days_s[-1])
        whole: Column = time + days_s + begun_s
        return whole

    def _row(self, line: str) -> Row | None:
        """
        Raises:
            ValueError: the line starts like a frame but cannot be parsed.
        """
        words, at = line.split(), self.places
        if line.startswith("***"):
            return None
        if not words[0].isdigit() or words[at["Tx/Rx"]] not in ("Rx", "Tx"):
            self.others.leave_out(line)
            return None
        kind = words[at["Type"]].lower() if "PGN" not in at else "x"
        if kind.endswith("r"):
            self.others.count_no_data("remote_frame")
            return None
        hour, minute, second = map(int, words[:3])
        if max(hour, minute, second) > _HOURS_MAX:
            raise ValueError("not a time")
        time = hour * 3600 + minute * 60 + second + float(f"0.{words[3]}")
        count, base = int(words[at["DLC"]]), 10 if self.decimal else 16
        if "PGN" in at and count > 8:  # joined of several frames
            return None
        data = bytes(int(words[at["DataBytes"] + k], base) for k in range(count))
        return row(time, int(words[at["CAN ID"]], base), kind[:1] == "x", data, int(words[at["Channel"]]))


def _places(columns: tuple[str, ...] | list[str]) -> dict[str, int]:
    """The first field of each column: the time has four."""
    return {name: place + (_CLOCK_FIELDS - 1 if place else 0) for place, name in enumerate(columns)}
