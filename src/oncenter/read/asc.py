"""Vector's `.asc` logs, a block of text at a time.

Ordinary frames of classic CAN are parsed many at once. Every other line is parsed by itself: events are skipped, and an
unusual frame gives the same result as python-can.
"""

from __future__ import annotations

import contextlib
import re
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from datetime import datetime
from itertools import islice, pairwise
from pathlib import Path

import numpy as np

from oncenter.errors import OncenterError
from oncenter.read.digits import Places
from oncenter.read.fields import Fields, Layout
from oncenter.read.frames import Column, Frames
from oncenter.read.left_out import CutOff
from oncenter.read.other_lines import OtherLines, Row, row
from oncenter.read.text_blocks import TextBlocks

_LAYOUTS = {
    decimal: Layout(
        time=0,
        bus=1,
        first_bus=1,
        identifier=2,
        words=((3, (b"Rx", b"Tx")), (4, (b"d",))),
        length=5,
        data=6,
        decimal=decimal,
        marked=True,
    )
    for decimal in (False, True)
}
_MESSAGE = re.compile(  # as in python-can
    r"\d+\.\d+\s+(\d+\s+(\w+\s+(Tx|Rx)|ErrorFrame)|CANFD)", re.ASCII | re.IGNORECASE
)
_HEADS = b"bBdD"  # first letters of header lines: base, begin, date
_BASE = re.compile(r"base\s+(hex|dec)(?:\s+timestamps\s+(absolute|relative))?", re.IGNORECASE)
_BEFORE_BASE = re.compile(rb"\n(?=[ \t]*base\s)", re.IGNORECASE)
_BASES_MAX = 100  # in a block, each of which is parsed by itself
_STAMP = re.compile(r"\d+\.?\d*")
_WITHOUT_TIME = ("date", "base", "internal", "no", "begin", "end", "//", "-")  # begins of lines
_IDENTIFIER = re.compile(r"[0-9A-Fa-f]+x?", re.IGNORECASE)
_DECIMAL_IDENTIFIER = re.compile(r"\bID = (\d+)(x?)")
_DATE = re.compile(r"(?:date|begin\s+triggerblock)\s+\S+\s+(.+)", re.IGNORECASE)
_MONTHS = {name: k for k, name in enumerate("jan feb mar apr may jun jul aug sep oct nov dec".split(), 1)} | {
    "mär": 3,
    "mai": 5,
    "okt": 10,
    "dez": 12,
}
_DAY = re.compile(
    r"(\w+\.?)\s+(\d\d?)\s+(\d\d?):(\d\d?):(\d\d?)(?:\.(\d{1,6}))?(?:\s+([ap])m)?\s+(\d{4})", re.IGNORECASE
)


def chunks(path: Path, notes: list[str], progress: Callable[[float], None]) -> Iterator[Frames]:
    """Data frames, CAN and CAN FD, a block of text at a time. `notes` receives what was left out.

    Raises:
        OncenterError: "unreadable_log": messages have names instead of identifiers, or the layout is unknown.
    """
    size = max(path.stat().st_size, 1)
    with path.open("rb") as file:
        text, log = TextBlocks(file), _Log(OtherLines(path.name))
        for block in text:
            progress(min(file.tell() / size, 1.0))
            # The first base line is that of all lines before it, too. Logs behind one another may have another base.
            bases = islice(_BEFORE_BASE.finditer(block), int(log.base is None), _BASES_MAX)
            for begin, end in pairwise([0, *(found.end() for found in bases), len(block)]):
                yield log.frames(block[begin:end])
    if text.cut_off:
        notes.append(CutOff(f"the last line of {path.name} is cut off and was left out", number=1))
    notes += log.others.notes("that are not CAN frames")


@dataclass
class _Log:
    """The header state that applies to the following lines.

    Attributes:
        others: lines that are not ordinary frames.
        base: whether numbers are decimal, and whether times are relative to the line before; None before a `base` line.
        start_s: origin of the times, s since 1970.
        passed_s: sum of the relative times so far.
        starts: for the current block, the lines at which the time origin changes.
    """

    others: OtherLines
    base: tuple[bool, bool] | None = None
    start_s: float = 0.0
    passed_s: float = 0.0
    starts: list[tuple[int, float]] = field(default_factory=list)

    def frames(self, block: bytes) -> Frames:
        """
        Raises:
            OncenterError: as `chunks`.
        """
        fields = Fields(block)
        self.starts = [(0, self.start_s)]
        for number in fields.lines_that_begin_with(_HEADS):
            self._head(fields.line(number).strip(), number)
        decimal, relative = self.base or (False, False)
        frames, numbers = self.others.frames(fields.frames(_LAYOUTS[decimal]), self._row)
        time = self._since_start(fields, frames.time, numbers) if relative else frames.time
        return replace(frames, time=time + self._start_at(numbers))

    def _head(self, line: str, number: int) -> None:
        base = _BASE.match(line)
        if base is not None:
            self.base = (base[1].lower() == "dec", (base[2] or "").lower() == "relative")
            return
        date = _DATE.fullmatch(line)
        if date is not None:
            self.start_s = _seconds(date[1]) or self.start_s
        if date is not None or line[:5].lower() == "begin":
            self.starts.append((number, self.start_s))

    def _start_at(self, numbers: Places) -> Column | float:
        """The time origin of each line."""
        if len(self.starts) == 1:
            return self.start_s
        lines, starts = (np.array(column) for column in zip(*self.starts, strict=True))
        given: Column = starts[np.searchsorted(lines, numbers, side="right") - 1]
        return given

    def _since_start(self, fields: Fields, steps: Column, numbers: Places) -> Column:
        """Absolute times from steps relative to the line before, frame or not. `begin` restarts them."""
        every = np.zeros(len(fields.line_ends))
        every[numbers] = steps
        is_frame = np.zeros(len(every), bool)
        is_frame[numbers] = True
        for number in np.flatnonzero(~is_frame).tolist():
            every[number] = _step(fields.line(number))
        since = np.empty(len(every))
        for begin, end in pairwise([*(number for number, _ in self.starts), len(every)]):
            since[begin:end] = np.cumsum(np.concatenate(([self.passed_s], every[begin:end])))[1:]
            self.passed_s = 0.0
        self.passed_s = float(since[-1])
        return np.round(since, 9)[numbers]

    def _row(self, line: str) -> Row | None:
        """The frame in a line, parsed as python-can does; None if it has none.

        Raises:
            OncenterError: as `chunks`.
            ValueError: it starts like a frame but cannot be parsed.
        """
        words = line.split(None, 4)
        if not words:
            return None
        if _is_strange(words):
            self.others.leave_out(line)
            return None
        decimal = bool(self.base and self.base[0])
        if len(words) > 1 and words[0][:1].isdigit():
            line = _with_identifier(line, words, self.others.log, decimal=decimal)
        line = line.strip()
        if not _MESSAGE.match(line):
            return None
        time, bus, rest = line.split(None, 2)
        base = 10 if decimal else 16
        if bus == "CANFD":
            return _flexible(float(time), rest, base, self.others.no_data)
        if not bus.isdigit():
            return None
        return _classic(float(time), int(bus) - 1, rest, base, self.others.no_data)


def _is_strange(words: list[str]) -> bool:
    """Whether a line of an .asc log has an unknown begin, or ends before a frame's identifier and direction."""
    if not words[0][:1].isdigit():
        return not words[0].lower().startswith(_WITHOUT_TIME)
    if not _STAMP.fullmatch(words[0]) or len(words) == 1:
        return True
    return words[1].isdigit() and len(words) < 5 and (len(words) == 2 or bool(_IDENTIFIER.fullmatch(words[2])))


def _with_identifier(line: str, words: list[str], log: str, *, decimal: bool) -> str:
    """An .asc line, split into `words`, with a numeric identifier: with message names, Vector writes it at the line's
    end, in decimal.

    Raises:
        OncenterError: the line has a message name and no identifier.
    """
    is_frame = len(words) == 5 and words[1].isdigit() and words[3] in ("Rx", "Tx") and words[4][:2] == "d "
    if not is_frame or _IDENTIFIER.fullmatch(words[2]):
        return line
    written = _DECIMAL_IDENTIFIER.search(words[4])
    if written is None:
        raise OncenterError(
            f"{log} has message names ({words[2][:40]!r}) instead of identifiers: export it with numeric identifiers",
            code="unreadable_log",
        )
    number = int(written[1])
    return line.replace(words[2], (f"{number}" if decimal else f"{number:X}") + written[2], 1)


def _flexible(time: float, text: str, base: int, no_data: Counter[str]) -> Row | None:
    """A CAN FD frame; None for an error frame, or one without data, which python-can reads as a remote frame.

    Raises:
        ValueError: it cannot be parsed.
    """
    bus, _, rest = text.split(None, 2)
    if rest[:10].lower() == "errorframe":
        no_data["error_frame"] += 1
        return None
    identifier, name_or_switch, rest = rest.split(None, 2)
    words = rest.split()
    _, _, length, *data = words if name_or_switch.isdigit() else words[1:]
    count, (number, extended) = int(length), _number(identifier, base)
    if not count:
        no_data["remote_frame"] += 1
        return None
    if len(data) < count:
        raise IndexError("the line ends before its data")
    return row(time, number, extended, _octets(data[:count], base), int(bus) - 1)


def _octets(words: list[str], base: int) -> bytes:
    """
    Raises:
        ValueError: a word is no byte.
    """
    if base == 16:
        with contextlib.suppress(ValueError):  # a byte of one digit
            octets = bytes.fromhex(" ".join(words))
            if len(octets) == len(words):
                return octets
    return bytes(int(byte, base) for byte in words)


def _number(identifier: str, base: int) -> tuple[int, bool]:
    """An identifier, and whether it has 29 bits."""
    extended = identifier[-1:].lower() == "x"
    return int(identifier[:-1] if extended else identifier, base), extended


def _classic(time: float, bus: int, text: str, base: int, no_data: Counter[str]) -> Row | None:
    """A frame of classic CAN; None for an error frame or a remote frame.

    Raises:
        ValueError: it cannot be parsed.
    """
    if text[:10].lower() == "errorframe":
        no_data["error_frame"] += 1
        return None
    identifier, _, rest = text.split(None, 2)
    number, extended = _number(identifier, base)
    if rest[0].lower() == "r":
        no_data["remote_frame"] += 1
        return None
    _, length, *data = rest.split()
    count = int(length, base)
    if count < 0:
        raise ValueError("a negative length")
    return row(time, number, extended, bytes(int(byte, base) for byte in data[: min(count, 8)]), bus)


def _step(line: str) -> float:
    """s since the line before; 0 for a line without time."""
    words = line.split(None, 1)
    if len(words) < 2 or not words[0][:1].isdigit():
        return 0.0
    try:
        return float(words[0])
    except ValueError:
        return 0.0


def _seconds(date: str) -> float:
    """Seconds since 1970 of `Jun 15 02:13:20.000 pm 2016`; 0 for a date in another language or order, because only
    differences of the frames' times matter. The format means local time.
    """
    found = _DAY.fullmatch(date)
    if found is None:
        return 0.0
    month, day, hour, minute, second, fraction, half, year = found.groups()
    hours, months = int(hour), _MONTHS.get(month.lower().rstrip("."), 0)
    if half is not None and 1 <= hours <= 12:  # some tools write "15:06:13 pm"
        hours = hours % 12 + (12 if half.lower() == "p" else 0)
    micros = int((fraction or "0").ljust(6, "0"))
    try:
        months = months or int(month)
        return datetime(int(year), months, int(day), hours, int(minute), int(second), micros).timestamp()
    except (ValueError, OverflowError, OSError):
        return 0.0
