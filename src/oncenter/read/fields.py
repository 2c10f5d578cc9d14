"""Parses lines with one frame each and fields separated by blanks: a block at once, without a loop over lines.

One pass over the block finds the begin and end of all fields. A field is then read from all lines at once, eight
characters as one number. Lines with other content are left to the caller.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from oncenter.read.digits import Bytes, Places, Words, all_decimal, decimal, eight, packed, without_first
from oncenter.read.frames import Column, Frames, bus_code

_PAD = b" " * 32  # before and after a block, so that reads around a position stay inside
_BLANK, _LINE_END, _OTHER = (
    0x40,
    0x60,
    0x80,
)  # codes of other characters than hexadecimal digits; a line end is also blank
_NO_DIGIT = np.uint64(0xC0C0C0C0C0C0C0C0)
_BLANKS = np.uint64(0x4040404040404040)
_HEX = "0123456789abcdefABCDEF"
_KINDS = bytes(
    int(chr(c), 16) if chr(c) in _HEX else {" ": _BLANK, "\t": _BLANK, "\n": _LINE_END}.get(chr(c), _OTHER)
    for c in range(256)
)
_FIRST_BYTES = np.array([(1 << 8 * n) - 1 for n in range(9)], np.uint64)  # mask of n bytes
_MOST_BUSES = 100
_BUSES = np.array([bus_code(str(number)) for number in range(_MOST_BUSES)], np.uint64)
_EXACT_DIGITS = 15  # of a number that a double holds exactly
_ID_DIGITS, _DECIMAL_ID_DIGITS = 8, 9
_IDENTIFIERS = 1 << 29

Flags = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Layout:
    """The meaning of each field of a line; fields count from 0.

    Attributes:
        words: by field, the words of one or two letters that a frame may have there.
        bus: None for lines without a bus: it is bus 1.
        first_bus: the number in the file of bus 0.
        data: the first data field; `length` gives their number.
        decimal: identifiers and data are decimal numbers, else hexadecimal.
        marked: 29-bit identifiers end in x; else they have more than four digits.
        ends_with_data: no further field may follow.
    """

    time: int
    identifier: int
    length: int
    data: int
    words: tuple[tuple[int, tuple[bytes, ...]], ...] = ()
    bus: int | None = None
    first_bus: int = 0
    decimal: bool = False
    marked: bool = False
    ends_with_data: bool = False

    @property
    def head_fields(self) -> int:
        """Minimum number of fields of a frame without data."""
        return 1 + max(self.time, self.identifier, self.length, self.bus or 0, *(place for place, _ in self.words))


@dataclass(frozen=True)
class Lines:
    """The lines of a block, and the frames among them.

    Attributes:
        is_frame: for each line, whether it is one of the frames.
        frames: with times as in the file.
    """

    fields: Fields
    is_frame: Flags
    frames: Frames


class Fields:
    """The positions of the fields in a block of complete lines."""

    def __init__(self, block: bytes) -> None:
        self.text = _PAD + block + _PAD
        self.characters = np.frombuffer(self.text, np.uint8)
        self.kinds = np.frombuffer(self.text.translate(_KINDS), np.uint8)
        self.line_ends = np.flatnonzero(self.kinds == _LINE_END)
        self.line_begins = np.concatenate(([len(_PAD)], self.line_ends[:-1] + 1))
        blank = self.kinds & _BLANK != 0
        # fields begin after the 1st, 3rd, ... edge, and end with the 2nd, 4th, ...
        edges = np.flatnonzero(blank[:-1] != blank[1:])
        self._before, self._last = edges[0::2], edges[1::2]
        self._first = np.searchsorted(self._before, self.line_begins - 1)
        self.counts = np.diff(np.append(self._first, len(self._before)))  # of fields

    def line(self, number: int) -> str:
        return self.text[self.line_begins[number] : self.line_ends[number]].decode("utf-8", "replace")

    def lines_that_begin_with(self, letters: bytes) -> list[int]:
        rows = np.flatnonzero(self.counts)
        first = self.characters[self._field(rows, 0)[0]]
        found: list[int] = rows[np.isin(first, np.frombuffer(letters, np.uint8))].tolist()
        return found

    def frames(self, layout: Layout) -> Lines:
        rows = np.flatnonzero(self.counts >= layout.head_fields)
        time, good = self._number(rows, layout.time)
        identifier, extended, identifier_good = self._identifier(rows, layout)
        length, length_good = self._length(rows, layout.length)
        data, data_good = (self._decimal_data if layout.decimal else self._data)(rows, layout.data, length)
        good &= identifier_good & (identifier < _IDENTIFIERS) & length_good & data_good
        bus = np.full(len(rows), _BUSES[1])
        if layout.bus is not None:
            bus, bus_good = self._bus(rows, layout.bus, layout.first_bus)
            good &= bus_good
        for field, words in layout.words:
            good &= self._is_one_of(rows, field, words)
        if layout.ends_with_data:
            good &= self.counts[rows] == layout.data + length.astype(np.int64)
        is_frame = np.zeros(len(self.line_ends), bool)
        is_frame[rows] = good
        frames = Frames(time, identifier, extended, data, length, bus)
        return Lines(self, is_frame, frames if good.all() else frames.where(good))

    def clock(self, rows: Places, field: int) -> Column:
        """Seconds of four fields: hours, minutes, seconds and the digits behind the point."""
        hour, minute, second, digits = (self._whole(*self._field(rows, field + k))[0] for k in range(4))
        begins, ends = self._field(rows, field + 3)
        whole = hour * np.uint64(3600) + minute * np.uint64(60) + second
        time: Column = whole.astype(np.float64) + digits.astype(np.float64) / 10.0 ** np.minimum(ends - begins, 16)
        return time

    def begins_with(self, rows: Places, field: int, letters: bytes) -> Flags:
        return np.isin(self.characters[self._field(rows, field)[0]], np.frombuffer(letters, np.uint8))

    def _field(self, rows: Places, number: int) -> tuple[Places, Places]:
        at = self._first[rows] + number
        return self._before[at] + 1, self._last[at] + 1

    def _number(self, rows: Places, field: int) -> tuple[Column, Flags]:
        """Numbers with as many decimals as the first line has, and whether each is such a number."""
        begins, ends = self._field(rows, field)
        behind = self._decimals(begins, ends)
        before = ends - behind - (behind > 0)
        whole, good = self._whole(begins, before)
        good &= before - begins <= _EXACT_DIGITS - behind
        if not behind:
            return whole.astype(np.float64), good
        fraction, fraction_good = self._whole(before + 1, ends)
        good &= fraction_good & (self.characters[before] == ord("."))
        return (whole * np.uint64(10**behind) + fraction).astype(np.float64) / 10.0**behind, good

    def _decimals(self, begins: Places, ends: Places) -> int:
        for begin, end in zip(begins[:100].tolist(), ends[:100].tolist(), strict=True):
            whole, point, fraction = self.text[begin:end].partition(b".")
            if whole.isdigit() and (fraction.isdigit() or not point) and len(fraction) < _EXACT_DIGITS:
                return len(fraction)
        return 0

    def _whole(self, begins: Places, ends: Places) -> tuple[Words, Flags]:
        """Numbers of 1 to 16 decimal digits."""
        width = ends - begins
        good = (width > 0) & (width <= 16)
        low_missing = (np.clip(8 - width, 0, 8) * 8).astype(np.uint64)
        low = without_first(eight(self.kinds, ends - 8), low_missing)
        good &= all_decimal(low)
        value = decimal(low)
        if len(width) and int(width.max()) > 8:
            high = without_first(eight(self.kinds, ends - 16), (np.clip(16 - width, 0, 8) * 8).astype(np.uint64))
            good &= all_decimal(high)
            value = value + decimal(high) * np.uint64(10**8)
        return value, good

    def _identifier(self, rows: Places, layout: Layout) -> tuple[npt.NDArray[np.uint32], Flags, Flags]:
        """Identifiers, whether they have 29 bits, and whether they are valid numbers."""
        begins, ends = self._field(rows, layout.identifier)
        width = ends - begins
        extended = width > 4
        if layout.marked:
            extended = self.characters[ends - 1] | np.uint8(0x20) == ord("x")
            ends, width = ends - extended, width - extended
        if layout.decimal:
            number, good = self._whole(begins, ends)
            return number.astype(np.uint32), extended, good & (width <= _DECIMAL_ID_DIGITS)
        missing = (np.clip(8 - width, 0, 8) * 8).astype(np.uint64)
        digits = without_first(eight(self.kinds, ends - 8), missing)
        good = (digits & _NO_DIGIT == 0) & (width > 0) & (width <= _ID_DIGITS)
        return packed(digits).astype(np.uint32).byteswap(), extended, good

    def _length(self, rows: Places, field: int) -> tuple[Bytes, Flags]:
        """One digit up to 8, and whether it is one; 8 if not."""
        begins, ends = self._field(rows, field)
        digit = self.kinds[begins]
        return np.minimum(digit, np.uint8(8)), (ends - begins == 1) & (digit <= 8)

    def _bus(self, rows: Places, field: int, first: int) -> tuple[Words, Flags]:
        """Codes of buses, numbers of up to two digits, and whether they are valid."""
        begins, ends = self._field(rows, field)
        width, digit = ends - begins, self.kinds[begins]
        good = (width <= 2) & (digit <= 9)
        if not (width == 1).all():
            second = self.kinds[begins + 1]
            good &= (width == 1) | (second <= 9)
            digit = np.where(width == 1, digit, digit * np.uint8(10) + second)
        number = digit.astype(np.int64) - first
        good &= (number >= 0) & (number < _MOST_BUSES)
        return _BUSES[np.where(good, number, 0)], good

    def _is_one_of(self, rows: Places, field: int, words: tuple[bytes, ...]) -> Flags:
        begins, ends = self._field(rows, field)
        good = np.zeros(len(rows), bool)
        first, second = self.characters[begins], self.characters[begins + 1]
        for word in words:
            same = (ends - begins == len(word)) & (first == word[0])
            good |= same & (second == word[1]) if len(word) > 1 else same
        return good

    def _data(self, rows: Places, field: int, length: Bytes) -> tuple[Words, Flags]:
        """Bytes of two hexadecimal digits separated by one blank; bytes beyond the length are 0xFF."""
        begins = self._before[np.minimum(self._first[rows] + field, len(self._before) - 1)] + 1
        begins = np.where(length > 0, begins, len(_PAD))
        windows: npt.NDArray[np.void] = np.ndarray((len(self.kinds) - 23,), "V24", self.kinds, strides=(1,))
        places = windows[np.minimum(begins, len(windows) - 1)].view(np.uint8).reshape(-1, 8, 3)
        high, low, between = (np.ascontiguousarray(places[:, :, k]) for k in range(3))
        there = _FIRST_BYTES[length]
        good = _words(high | low) & _NO_DIGIT & there == 0
        good &= _words(between) & _BLANKS & there == _BLANKS & there
        good &= begins + 3 * length.astype(np.int64) - 1 <= np.where(length > 0, self.line_ends[rows], begins)
        return _words(high << np.uint8(4) | low) & there | ~there, good

    def _decimal_data(self, rows: Places, field: int, length: Bytes) -> tuple[Words, Flags]:
        """Bytes of up to three decimal digits; bytes beyond the length are 0xFF."""
        good = self.counts[rows] >= field + length.astype(np.int64)
        last = len(self._before) - 1
        data = np.zeros(len(rows), np.uint64)
        for k in range(8):
            at = np.minimum(self._first[rows] + field + k, last)
            number, number_good = self._whole(self._before[at] + 1, self._last[at] + 1)
            good &= (number_good & (number <= 0xFF)) | (length <= k)
            data |= (number & np.uint64(0xFF)) << np.uint64(8 * k)
        there = _FIRST_BYTES[length]
        return data & there | ~there, good


def _words(bytes_of_rows: Bytes) -> Words:
    return bytes_of_rows.view("<u8").reshape(-1)
