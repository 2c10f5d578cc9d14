"""CAN frames as columns, the same for every file format, and the selection kept while a log is read."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

PGN_COUNT = 1 << 18
STANDARD_ID_COUNT = 1 << 11

Column = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Frames:
    """Data frames in the order of the log, one row each.

    Attributes:
        time: s, as recorded.
        identifier: 29 or 11 bits.
        extended: whether the identifier has 29 bits.
        data: eight bytes as a little-endian number; missing bytes are 0xFF, "not available".
        length: data bytes, 0 to 8.
        bus: name of the bus, see `bus_code`.
    """

    time: Column
    identifier: npt.NDArray[np.uint32]
    extended: npt.NDArray[np.bool_]
    data: npt.NDArray[np.uint64]
    length: npt.NDArray[np.uint8]
    bus: npt.NDArray[np.uint64]

    def __len__(self) -> int:
        return len(self.time)

    def where(self, chosen: npt.NDArray[np.bool_] | npt.NDArray[np.int64]) -> Frames:
        """The frames chosen by a mask, or at the given positions."""
        if chosen.dtype == bool:
            if chosen.all():
                return self
            chosen = np.flatnonzero(chosen)  # faster than a mask for each column
        return Frames(*(getattr(self, column)[chosen] for column in self.__dataclass_fields__))


def joined(parts: list[Frames]) -> Frames:
    """Frames one after another."""
    if not parts:
        return Frames(
            np.empty(0),
            np.empty(0, np.uint32),
            np.empty(0, bool),
            np.empty(0, np.uint64),
            np.empty(0, np.uint8),
            np.empty(0, np.uint64),
        )
    return Frames(
        *(np.concatenate([getattr(part, column) for part in parts]) for column in Frames.__dataclass_fields__)
    )


def bus_code(name: str) -> int:
    """A bus name as a number, from its last eight characters, so that the column holds numbers."""
    return int.from_bytes(name.encode("ascii", "replace")[-8:].ljust(8, b"\0"), "little")


def bus_name(code: int) -> str:
    return code.to_bytes(8, "little").strip(b"\0").decode("ascii", "replace")


def pgn_of(identifier: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint32]:
    """Parameter group numbers of 29-bit identifiers. Below PDU format 240 the next byte is a destination (PDU1)."""
    has_destination = (identifier >> np.uint32(16)) & np.uint32(0xFF) < 240
    pgn = (identifier >> np.uint32(8)) & np.uint32(PGN_COUNT - 1)
    return np.where(has_destination, pgn & np.uint32(0x3FF00), pgn)


@dataclass(frozen=True)
class Wanted:
    """Which frames to keep: by parameter group, and by 11-bit identifier."""

    pgns: frozenset[int]
    standard_ids: frozenset[int] = frozenset()


def with_groups(frames: Frames, pgns: Collection[int]) -> npt.NDArray[np.bool_]:
    """Which frames belong to one of the parameter groups."""
    return frames.extended & np.isin(pgn_of(frames.identifier), list(pgns))


@dataclass(frozen=True)
class Kept:
    """The wanted frames of a log, and a count of all frames.

    Attributes:
        frames: the wanted frames.
        pgn_frames: shape (2^18,), number of extended frames by parameter group.
        standard_frames: number of frames with 11-bit identifiers.
        notes: about frames and lines that could not be used.
    """

    frames: Frames
    pgn_frames: npt.NDArray[np.int64]
    standard_frames: int
    notes: list[str] = field(default_factory=list)

    @property
    def total(self) -> int:
        return int(self.pgn_frames.sum()) + self.standard_frames


def frames_of_rows(rows: Sequence[tuple[float, int, bool, int, int, int]]) -> Frames:
    """Frames from rows of their attributes in order; there may be none."""
    columns = list(zip(*rows, strict=True)) if rows else [()] * 6
    return Frames(
        np.array(columns[0], np.float64),
        np.array(columns[1], np.uint32),
        np.array(columns[2], bool),
        np.array(columns[3], np.uint64),
        np.array(columns[4], np.uint8),
        np.array(columns[5], np.uint64),
    )


def keep(chunks: Iterable[Frames] | Iterator[Frames], wanted: Wanted) -> Kept:
    """Reads a log once and keeps only the wanted frames."""
    is_wanted_pgn = np.zeros(PGN_COUNT, bool)
    is_wanted_pgn[list(wanted.pgns)] = True
    is_wanted_id = np.zeros(STANDARD_ID_COUNT, bool)
    is_wanted_id[list(wanted.standard_ids)] = True
    pgn_frames = np.zeros(PGN_COUNT, np.int64)
    standard_frames = 0
    parts = []
    for frames in chunks:
        pgn = pgn_of(frames.identifier)
        standard = ~frames.extended
        of_extended = np.bincount(pgn[frames.extended])
        pgn_frames[: len(of_extended)] += of_extended
        standard_frames += int(standard.sum())
        chosen = is_wanted_pgn[pgn] & frames.extended
        if wanted.standard_ids:
            chosen |= is_wanted_id[frames.identifier & np.uint32(STANDARD_ID_COUNT - 1)] & standard
        parts.append(frames.where(chosen))
    return Kept(joined(parts), pgn_frames, standard_frames)
