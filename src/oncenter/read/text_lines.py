"""Prepares lines of `.asc` and `.trc` for python-can: drops a cut-off last line, makes times absolute."""

from __future__ import annotations

import io
import re
from typing import BinaryIO

from oncenter.errors import OncenterError

BASE = re.compile(r"\s*base\s+(hex|dec)(?:\s+timestamps\s+(absolute|relative))?", re.IGNORECASE)
_STAMP = re.compile(r"\d+\.?\d*")
_HEADS = ("date", "base", "internal", "no", "begin", "end", "//", "-")  # begins of lines without a time
_IDENTIFIER = re.compile(r"[0-9A-Fa-f]+x?", re.IGNORECASE)
_DECIMAL_IDENTIFIER = re.compile(r"\bID = (\d+)(x?)")


class TextLines(io.TextIOWrapper):
    """Iterates over the lines of a text log. A last line without a line end is left out, and sets `cut_off`.

    `strange` counts the lines that are not part of the format and that python-can skips silently; `first_strange` is
    the first one.
    """

    def __init__(self, file: BinaryIO) -> None:
        super().__init__(file, encoding="utf-8", errors="replace")
        self.cut_off = False
        self.strange = 0
        self.first_strange = ""

    def __next__(self) -> str:  # type: ignore[override]
        line = super().__next__()
        if not line.endswith("\n"):
            self.cut_off = bool(line.strip())
            raise StopIteration
        return line


def is_strange(words: list[str]) -> bool:
    """Whether a line of an .asc log has an unknown begin, or ends before a frame's identifier and direction."""
    if not words[0][:1].isdigit():
        return not words[0].lower().startswith(_HEADS)
    if not _STAMP.fullmatch(words[0]) or len(words) == 1:
        return True
    return words[1].isdigit() and len(words) < 5 and (len(words) == 2 or bool(_IDENTIFIER.fullmatch(words[2])))


class AscLines(TextLines):
    """The lines of a Vector log with absolute times, and with identifiers instead of message names."""

    def __init__(self, file: BinaryIO, name: str) -> None:
        super().__init__(file)
        self._name = name
        self._decimal = self._relative = False
        self._time = 0.0

    def __next__(self) -> str:  # type: ignore[override]
        line = super().__next__()
        base = BASE.match(line)
        if base:
            self._decimal = base[1].lower() == "dec"
            self._relative = (base[2] or "").lower() == "relative"
        elif line[:5].lower() == "begin":  # a trigger block has its own date
            self._time = 0.0
        words = line.split(None, 4)
        if words and is_strange(words):
            self.strange += 1
            self.first_strange = self.first_strange or line.strip()[:40]
        if len(words) < 2 or not words[0][:1].isdigit():
            return line
        line = self._in_absolute_time(line, words[0])
        return with_identifier(line, words, self._name, decimal=self._decimal)

    def _in_absolute_time(self, line: str, stamp: str) -> str:
        if not self._relative:
            return line
        try:
            self._time += float(stamp)
        except ValueError:
            return line
        return line.replace(stamp, f"{self._time:.9f}", 1)


def with_identifier(line: str, words: list[str], log: str, *, decimal: bool) -> str:
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
