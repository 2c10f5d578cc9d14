"""Notes on logs that were cut off, with the duration that was read."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from oncenter.read.frames import Frames, pgn_of
from oncenter.read.wording import counted


class CutOff(str):
    """A note that the end of a log is missing."""


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
