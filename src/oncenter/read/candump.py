"""candump's two output styles: the log file (-l) and the console with time stamps (-ta).

The log style is parsed a block at a time without a loop over lines: first the positions of line ends, brackets and '#',
then eight characters at once as one number. All other lines go through a regular expression, one by one.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import numpy.typing as npt

from oncenter.errors import OncenterError
from oncenter.read.digits import Places, Words, all_decimal, decimal, eight, packed, without_first
from oncenter.read.frames import Frames, frames_of_rows, joined
from oncenter.read.left_out import CutOff, LeftOut, left_out_frames
from oncenter.read.other_lines import Row, row
from oncenter.read.text_blocks import utf_8
from oncenter.read.wording import counted

BLOCK_BYTES = 1 << 20  # text per step, so that its columns fit into the cache
_FULL_FRAME = 8  # bytes
PAD = b"\0" * 32  # before and after a block, so that reads around a position stay inside
BAD_LINES_SHARE = 0.01  # more bad lines mean another format, not local damage

_NIBBLE = bytes(int(chr(c), 16) if chr(c) in "0123456789abcdefABCDEF" else 0xFF for c in range(256))
_LOG_LINE = re.compile(  # two #, then a digit of flags, of CAN FD
    rb"\s*\((\d+\.\d+)\)\s+(\S+)\s+([0-9A-Fa-f]{8}|[0-9A-Fa-f]{3})#(?:#[0-9A-Fa-f])?((?:[0-9A-Fa-f]{2}){0,64})"
    rb"(?:\s+[RT])?\s*"
)
_STAMP = rb"(\d+\.\d+|\d{4}-\d\d-\d\d \d\d:\d\d:\d\d\.\d+)"
_CONSOLE_LINE = re.compile(
    rb"\s*\(" + _STAMP + rb"\)\s+(\S+)\s+(?:[RT]X\s+\S+\s+\S+\s+)?([0-9A-Fa-f]{8}|[0-9A-Fa-f]{3})\s+\[\d{1,2}\]"
    rb"\s*((?:[0-9A-Fa-f]{2}\s*){0,64})(?:'.*')?\s*"
)
_NO_DATA_LINE = re.compile(
    rb".*(?:(?P<remote_frame>#R\d?|remote request)|(?P<error_frame>ERRORFRAME))"
    rb"(?:\s+[RT])?\s*|\t[a-z-]+(?:\{.*\})?\s*",
    re.DOTALL,
)


def chunks(path: Path, notes: list[str], progress: Callable[[float], None]) -> Iterator[Frames]:
    """Frames of a candump log, a block of text at a time.

    Raises:
        OncenterError: more than one line in a hundred is not candump's.
    """
    size = max(path.stat().st_size, 1)
    lines = bad_lines = done = 0
    no_data: Counter[str] = Counter()
    first_bad = ""
    with path.open("rb") as file:
        rest, given = b"", utf_8(file)
        while block := given.read(BLOCK_BYTES):
            done += len(block)
            whole, newline, rest = (rest + block).rpartition(b"\n")
            if not newline:
                if len(rest) > BLOCK_BYTES:
                    raise _not_candump(path, _quoted(1, rest))
                continue
            frames, bad, count = _parse(whole + newline, no_data)
            if bad and not first_bad:
                first_bad = _quoted(lines + bad[0][0] + 1, bad[0][1])
            bad_lines += len(bad)
            lines += count
            if bad_lines > 100 + BAD_LINES_SHARE * lines:
                raise _not_candump(path, first_bad)
            progress(done / size)
            yield frames
    if rest.strip():
        frames, bad, count = _parse(rest + b"\n", no_data)
        lines += count
        # a short frame without a line end was probably cut
        if bad or (len(frames) and frames.length[-1] < _FULL_FRAME):
            frames = frames.where(np.zeros(len(frames), bool))
            notes.append(CutOff(f"the last line of {path.name} is cut off and was left out", number=1))
        yield frames
    if bad_lines > BAD_LINES_SHARE * lines:
        raise _not_candump(path, first_bad)
    notes += left_out_frames(path.name, no_data)
    if bad_lines:
        text = f"left out {counted(bad_lines, 'line')} of {path.name} not in candump format, first: {first_bad}"
        notes.append(LeftOut(text, "unreadable", bad_lines))


def _not_candump(path: Path, line: str) -> OncenterError:
    return OncenterError(
        f"{path.name} is not a candump log with time stamps: {line}; record with candump -l or candump -ta",
        code="unreadable_log",
    )


def _quoted(line: int, text: bytes) -> str:
    shown = text[:40].decode("latin-1").strip()
    return f"line {line} reads {shown!r}"


def _parse(block: bytes, no_data: Counter[str]) -> tuple[Frames, list[tuple[int, bytes]], int]:
    """The frames in complete lines, the lines without a frame (number, text), and the number of lines. `no_data` counts
    frames without usable data."""
    text = PAD + block + PAD
    characters = np.frombuffer(text, np.uint8)
    ends = np.flatnonzero(characters[: len(PAD) + len(block)] == ord("\n"))
    starts = np.concatenate(([len(PAD)], ends[:-1] + 1))
    frames, read = _parse_log_style(text, characters, starts, ends)
    if read.all():
        return frames, [], len(ends)
    others, places, bad = _parse_one_by_one(text, starts, ends, np.flatnonzero(~read), no_data)
    merged = joined([frames, others])
    order = np.argsort(np.concatenate((np.flatnonzero(read), places)), kind="stable")
    return merged.where(order), bad, len(ends)


def _parse_log_style(
    text: bytes, characters: npt.NDArray[np.uint8], starts: Places, ends: Places
) -> tuple[Frames, npt.NDArray[np.bool_]]:
    """Frames as `(1700000000.123456) can0 18F0093E#697D7F637D577F7D`, and which lines have this form."""
    nibbles = np.frombuffer(text.translate(_NIBBLE), np.uint8)
    bracket = _first_in_line(characters, ord(")"), starts, ends)
    hashed = _first_in_line(characters, ord("#"), starts, ends)

    standard = characters[hashed - 4] == ord(" ")
    extended = (characters[hashed - 9] == ord(" ")) & ~standard
    micros, time_good = _time(nibbles, starts, bracket)
    begins = hashed + 1
    if b"##" in text:  # CAN FD: another # and a digit of flags
        begins = begins + 2 * (characters[begins] == ord("#"))
    data_low, data_high = eight(nibbles, begins), eight(nibbles, begins + 8)
    data, digits = _data(data_low, data_high)
    identifier_digits = eight(nibbles, hashed - 8)
    identifier = packed(np.where(extended, identifier_digits, identifier_digits & _FULL << np.uint64(40)))
    after = characters[begins + digits]
    bus_end = hashed - np.where(extended, 9, 4)
    good = (
        (characters[starts] == ord("("))
        & (characters[bracket - 7] == ord("."))
        & (characters[bracket + 1] == ord(" "))
        & (bracket + 2 < bus_end)
        & time_good
        & (extended | standard)
        & (identifier_digits & np.where(extended, _NO_NIBBLE, _NO_NIBBLE << np.uint64(40)) == 0)
        & (digits % 2 == 0)
        & ((after == ord("\n")) | (after == ord("\r")) | (after == ord(" ")) & (digits > 0))
    )
    numbers = identifier.astype(np.uint32).byteswap()
    good &= numbers < 1 << 29
    names = eight(characters, bus_end - 8)
    # The name starts after the bracket and a blank; earlier characters are shifted out.
    missing = np.clip(8 - (bus_end - bracket - 2), 0, 7).astype(np.uint64) * np.uint64(8)
    frames = Frames(
        micros.astype(np.float64) / 1e6,
        numbers,
        extended,
        data,
        (digits // 2).astype(np.uint8),
        names >> missing,
    )
    return (frames if good.all() else frames.where(good)), good


def _first_in_line(characters: npt.NDArray[np.uint8], wanted: int, starts: Places, ends: Places) -> Places:
    """Position of the first such character in each line; the line's end without one."""
    places = np.flatnonzero(characters == wanted)
    if len(places) == len(ends) and bool(np.all(places < ends)) and bool(np.all(places >= starts)):
        return places
    following = np.append(places, len(characters) - 1)[np.searchsorted(places, starts)]
    first: Places = np.minimum(following, ends)
    return first


_FULL = np.uint64(0xFFFFFFFFFFFFFFFF)
_NO_NIBBLE = np.uint64(0x8080808080808080)  # set in bytes that are not hexadecimal digits
_ALL_F = np.uint64(0x0F0F0F0F0F0F0F0F)


def _data(low: Words, high: Words) -> tuple[Words, npt.NDArray[np.int64]]:
    """Up to sixteen digits as eight bytes, missing bytes as 0xFF, and the number of digits."""
    kept_low = _before_first_other(low)
    kept_high = np.where(kept_low == _FULL, _before_first_other(high), np.uint64(0))
    digits = _bytes_kept(kept_low) + _bytes_kept(kept_high)
    low = low & kept_low | _ALL_F & ~kept_low
    high = high & kept_high | _ALL_F & ~kept_high
    return packed(low) | packed(high) << np.uint64(32), digits


def _bytes_kept(kept: Words) -> npt.NDArray[np.int64]:
    """Number of full bytes in each word: the product sums all bytes of the word into the highest one."""
    ones = np.uint64(0x0101010101010101)
    return ((kept & ones) * ones >> np.uint64(56)).astype(np.int64)


def _before_first_other(nibbles: Words) -> Words:
    """All bits of the bytes before the first one that is not a digit."""
    other = nibbles & _NO_NIBBLE
    lowest = other & (~other + np.uint64(1))
    return (lowest >> np.uint64(7)) - np.uint64(1)


def _time(nibbles: npt.NDArray[np.uint8], starts: Places, bracket: Places) -> tuple[Words, npt.NDArray[np.bool_]]:
    """Microseconds of `(seconds.microseconds)`, and whether the stamp has this form."""
    width = bracket - 7 - (starts + 1)  # of the seconds
    missing = (np.clip(16 - width, 0, 16) * 8).astype(np.uint64)
    low_missing = np.minimum(missing, np.uint64(64))
    high = without_first(eight(nibbles, bracket - 23), low_missing)
    low = without_first(eight(nibbles, bracket - 15), missing - low_missing)
    fraction = without_first(eight(nibbles, bracket - 8), np.uint64(16))
    good = (width >= 1) & (width <= 12)
    for digits in (high, low, fraction):
        good &= all_decimal(digits)
    seconds = decimal(high) * np.uint64(100_000_000) + decimal(low)
    return seconds * np.uint64(1_000_000) + decimal(fraction), good


def _seconds(stamp: bytes) -> float:
    """The time of seconds or of a date (`candump -tA`), read as UTC: its zone is unknown, only differences count."""
    if b"-" not in stamp:
        return float(stamp)
    return datetime.fromisoformat(stamp.decode()).replace(tzinfo=UTC).timestamp()


def _parse_one_by_one(
    text: bytes, starts: Places, ends: Places, lines: Places, no_data: Counter[str]
) -> tuple[Frames, Places, list[tuple[int, bytes]]]:
    """The frames in the given lines, their line numbers, and the lines without a frame."""
    rows: list[Row] = []
    places: list[int] = []
    bad: list[tuple[int, bytes]] = []
    for line in lines.tolist():
        written = text[starts[line] : ends[line]]
        found = _LOG_LINE.fullmatch(written) or _CONSOLE_LINE.fullmatch(written)
        if found is None:
            other = _NO_DATA_LINE.fullmatch(written)
            if other is not None and other.lastgroup is not None:
                no_data[other.lastgroup] += 1
            elif other is None and written.strip():
                bad.append((line, written))
            continue
        stamp, bus, identifier, digits = found.groups()
        data = bytes.fromhex(digits.decode())
        number = int(identifier, 16)
        if number >= 1 << 29:
            no_data["error_frame"] += 1
            continue
        rows.append(row(_seconds(stamp), number, len(identifier) == 8, data, bus.decode("latin-1")))
        places.append(line)
    return frames_of_rows(rows), np.array(places, np.int64), bad
