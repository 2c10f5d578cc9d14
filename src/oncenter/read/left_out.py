"""Notes on the parts of a log that were left out, each with its reason and count for the account."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Self

import numpy as np

from oncenter.read.frames import Frames, pgn_of
from oncenter.read.wording import counted


class LeftOut(str):
    """A note on a part that was left out.

    Attributes:
        reason: a key of `oncenter.account.WORDS`.
        number: of frames, lines or rows; 0 where they were not counted.
    """

    reason: str
    number: int

    def __new__(cls, text: str, reason: str, number: int) -> Self:
        note = super().__new__(cls, text)
        note.reason, note.number = reason, number
        return note


class CutOff(LeftOut):
    """A note that the end of a log is missing."""

    def __new__(cls, text: str, reason: str = "cut_off", number: int = 0) -> Self:
        return super().__new__(cls, text, reason, number)


def left_out_frames(log: str, counts: Counter[str]) -> list[LeftOut]:
    """Notes on frames that carry no data that can be used.

    Args:
        counts: by reason: "can_fd", "error_frame", "remote_frame", "invalid_bit".
    """
    nouns = {
        "can_fd": ("CAN FD frame", " of more than 8 bytes, which no database describes,"),
        "error_frame": ("error frame", ""),
        "remote_frame": ("remote frame", ""),
        "invalid_bit": ("frame", " that the logger marks as invalid"),
    }
    return [
        LeftOut(f"left out {counted(counts[reason], noun)}{which} in {log}", reason, counts[reason])
        for reason, (noun, which) in nouns.items()
        if counts[reason]
    ]


def counts_of(notes: Sequence[str]) -> dict[str, int]:
    """The frames, lines or rows that were left out, by reason."""
    counts: Counter[str] = Counter()
    for note in notes:
        if isinstance(note, LeftOut) and note.number:
            counts[note.reason] += note.number
    return dict(counts)


def with_seconds(notes: Sequence[str], duration_s: float) -> tuple[str, ...]:
    """The notes; those on a cut-off log are completed by the duration read."""
    return tuple(f"{note}; {duration_s:.1f} s were read" if isinstance(note, CutOff) else note for note in notes)


def short_frames_notes(frames: Frames, log: str) -> list[str]:
    """Notes on frames with fewer bytes than the longest of their identifier, as in a line that was cut."""
    if not len(frames) or int(frames.length.min()) == int(frames.length.max()):
        return []
    notes = []
    for identifier in np.unique(frames.identifier):
        lengths = frames.length[frames.identifier == identifier]
        short = int(np.count_nonzero(lengths < lengths.max()))
        if short:
            extended = bool(frames.extended[frames.identifier == identifier][0])
            name = f"PGN {int(pgn_of(np.array([identifier]))[0])}" if extended else f"0x{int(identifier):X}"
            which = f"{counted(short, 'frame')} of {name} in {log}"
            notes.append(f"{which} with fewer bytes than others: the missing bytes count as not available")
    return notes
