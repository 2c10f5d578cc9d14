"""PEAK's `.trc` logs of all versions, a block of text at a time.

Ordinary frames of classic CAN are parsed many at once. Every other line is parsed by itself: events are skipped, and an
unusual frame gives the same result as python-can.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

from oncenter.read.fields import Fields, Layout
from oncenter.read.frames import Frames
from oncenter.read.left_out import CutOff
from oncenter.read.other_lines import OtherLines, Row, row
from oncenter.read.text_blocks import TextBlocks
from oncenter.read.wording import damaged

_FIRST = {"identifier": 2, "length": 3, "data": 4}  # positions of fields in version 1.0, and in unknown ones
_OLD = {  # in other versions 1
    "1.1": {"kind": 2, "identifier": 3, "length": 4, "data": 5},
    "1.2": {"bus": 2, "kind": 3, "identifier": 4, "length": 5, "data": 6},
    "1.3": {"bus": 2, "kind": 3, "identifier": 4, "length": 6, "data": 7},
}
_DIRECTIONS = (b"Rx", b"Tx")
_BUS_INFORMATION = "FFFFFFFF"  # in version 1.0 in place of an identifier
_NEEDED = "OTIdD"  # columns of versions 2: time, type, identifier, direction, data
_DATA, _FLEXIBLE = "DT", ("FD", "FB", "FE", "BI")  # frame types that are read
_NO_DATA = {"RR": "remote_frame", "ER": "error_frame"}  # frame types that are counted
_OLD_NO_DATA = {"Error": "error_frame"}  # the same in versions 1
_DAY_0 = datetime(1899, 12, 30, tzinfo=UTC)


def chunks(path: Path, notes: list[str], progress: Callable[[float], None]) -> Iterator[Frames]:
    """Data frames, CAN and CAN FD, a block of text at a time. `notes` receives what was left out.

    Raises:
        OncenterError: "unreadable_log": the layout is unknown.
    """
    size = max(path.stat().st_size, 1)
    head, log = _Head(), None
    others = OtherLines(path.name)
    with path.open("rb") as file:
        text = TextBlocks(file)
        for block in text:
            rest = block if log else head.without(block)
            if not rest:
                continue
            log = log or head.log(others)
            progress(min(file.tell() / size, 1.0))
            yield log.frames(rest)
    if text.cut_off:
        notes.append(CutOff(f"the last line of {path.name} is cut off and was left out", number=1))
    notes += others.notes("that are not CAN frames")


@dataclass
class _Head:
    """The header, the lines before the first frame."""

    version: str = "1.0"  # the only version without a $FILEVERSION line
    start: str = ""
    columns: str = ""

    def without(self, block: bytes) -> bytes:
        """The block from the first frame on; empty if all of it is header."""
        begin = 0
        while begin < len(block):
            end = block.index(b"\n", begin) + 1
            line = block[begin:end].strip()
            if line and not line.startswith(b";"):
                return block[begin:]
            name, _, value = line.decode("utf-8", "replace").partition("=")
            attribute = {";$FILEVERSION": "version", ";$STARTTIME": "start", ";$COLUMNS": "columns"}.get(name)
            if attribute:
                setattr(self, attribute, value)
            begin = end
        return b""

    def log(self, others: OtherLines) -> _Version1 | _Version2:
        """
        Raises:
            OncenterError: unknown columns or start time.
        """
        if self.version in _OLD:
            return _Version1(others, _OLD[self.version], self._start_s(others.log))
        if self.version.startswith(("2.", "3.")):
            return _Version2(others, self._places(others.log), self._start_s(others.log))
        return _Version1(others, _FIRST, 0.0)

    def _start_s(self, log: str) -> float:
        """Seconds since 1970; the format counts days since 1899-12-30."""
        if not self.start:
            return 0.0
        try:
            return (_DAY_0 + timedelta(days=float(self.start))).timestamp()
        except (ValueError, OverflowError) as error:
            raise damaged(log, f"its start time {self.start[:40]!r} is not a number of days") from error

    def _places(self, log: str) -> dict[str, int]:
        columns = self.columns.split(",")
        lacks = [name for name in _NEEDED if name not in columns] or ("l" not in columns and "L" not in columns)
        if lacks or columns[-1] != "D" or len(set(columns)) < len(columns):
            raise damaged(log, f"its columns {self.columns[:40]!r} are in an unknown order")
        return {name: place for place, name in enumerate(columns)}


def _in_seconds(frames: Frames, start_s: float) -> Frames:
    """Converts times from ms since the start to s since 1970."""
    return replace(frames, time=frames.time / 1000 + start_s)


class _Version1:
    """Lines of versions 1, whose length field gives the number of data bytes."""

    def __init__(self, others: OtherLines, places: dict[str, int], start_s: float) -> None:
        self._others, self._places, self._start_s = others, places, start_s
        self._layout = Layout(
            time=1,
            identifier=places["identifier"],
            length=places["length"],
            data=places["data"],
            words=((places["kind"], _DIRECTIONS),) if "kind" in places else (),
            bus=places.get("bus"),
        )

    def frames(self, block: bytes) -> Frames:
        """
        Raises:
            OncenterError: as `OtherLines.frames`.
        """
        return _in_seconds(self._others.frames(Fields(block).frames(self._layout), self._row)[0], self._start_s)

    def _row(self, line: str) -> Row | None:
        words, at = line.split(), self._places
        if not words or words[0].startswith(";"):
            return None
        if "kind" in at and words[at["kind"]] not in ("Rx", "Tx"):
            self._others.count_no_data(_OLD_NO_DATA.get(words[at["kind"]]))
            return None
        identifier = words[at["identifier"]]
        if "kind" not in at and identifier == _BUS_INFORMATION:
            return None
        count, data = int(words[at["length"]]), words[at["data"] :]
        if data[:1] == ["RTR"]:
            self._others.count_no_data("remote_frame")
            return None
        octets = bytes(int(data[k], 16) for k in range(count))
        bus = int(words[at["bus"]]) if "bus" in at else 1
        return row(float(words[1]), int(identifier, 16), len(identifier) > 4, octets, bus)


class _Version2:
    """Lines of versions 2, with the columns given in the header, data last."""

    def __init__(self, others: OtherLines, places: dict[str, int], start_s: float) -> None:
        self._others, self._places, self._start_s = others, places, start_s
        self._length = places["l"] if "l" in places else places["L"]
        self._layout = Layout(
            time=places["O"],
            identifier=places["I"],
            length=self._length,
            data=places["D"],
            words=((places["T"], (_DATA.encode(),)),),
            bus=places.get("B"),
            ends_with_data=True,
        )

    def frames(self, block: bytes) -> Frames:
        """
        Raises:
            OncenterError: as `OtherLines.frames`.
        """
        return _in_seconds(self._others.frames(Fields(block).frames(self._layout), self._row)[0], self._start_s)

    def _row(self, line: str) -> Row | None:
        at = self._places
        words = line.split(maxsplit=at["D"])
        if not words or words[0].startswith(";"):
            return None
        kind = words[at["T"]]
        if kind != _DATA and kind not in _FLEXIBLE:
            self._others.count_no_data(_NO_DATA.get(kind))
            return None
        identifier, count = words[at["I"]], int(words[self._length])
        data = bytes.fromhex(words[at["D"]]) if count else b""
        bus = int(words[at["B"]]) if "B" in at else 1
        return row(float(words[at["O"]]), int(identifier, 16), len(identifier) > 4, data, bus)
