"""CAN frames as columns, the same for every file format, and the selection kept while a log is read."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

PGN_COUNT = 1 << 18
STANDARD_ID_COUNT = 1 << 11
_FIRST_EIGHT = (1 << 64) - 1

Column = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Frames:
    """Data frames in the order of the log, one row each.

    Attributes:
        time: s, as recorded.
        identifier: 29 or 11 bits.
        extended: whether the identifier has 29 bits.
        data: the first eight bytes as a little-endian number; missing bytes are 0xFF, "not available".
        length: data bytes, 0 to 64.
        bus: name of the bus, see `bus_code`.
        more: bytes 9 to 64 of CAN FD frames, missing ones 0xFF; None if no frame has more than eight.
    """

    time: Column
    identifier: npt.NDArray[np.uint32]
    extended: npt.NDArray[np.bool_]
    data: npt.NDArray[np.uint64]
    length: npt.NDArray[np.uint8]
    bus: npt.NDArray[np.uint64]
    more: npt.NDArray[np.void] | None = None

    def __len__(self) -> int:
        return len(self.time)

    def where(self, chosen: npt.NDArray[np.bool_] | npt.NDArray[np.int64]) -> Frames:
        """The frames chosen by a mask, or at the given positions."""
        if chosen.dtype == bool:
            if chosen.all():
                return self
            chosen = np.flatnonzero(chosen)  # faster than a mask for each column
        columns = [getattr(self, column)[chosen] for column in COLUMNS]
        return Frames(*[*columns, None if self.more is None else self.more[chosen]])

    def after_eight(self) -> npt.NDArray[np.void]:
        """`more`, also where no frame has more than eight bytes."""
        return np.full(len(self), _NO_MORE) if self.more is None else self.more


COLUMNS = tuple(name for name in Frames.__dataclass_fields__ if name != "more")
BYTES_MAX = 64  # of a CAN FD frame
MORE = np.dtype(f"V{BYTES_MAX - 8}")
_NO_MORE = np.void(b"\xff" * MORE.itemsize)


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
    more = None
    if any(part.more is not None for part in parts):
        more = np.concatenate([part.after_eight() for part in parts])
    columns: list[Any] = [np.concatenate([getattr(part, column) for part in parts]) for column in COLUMNS]
    return Frames(*[*columns, more])


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
    """Frames from rows of their attributes in order, the data as a number of up to 64 bytes; there may be none."""
    columns = list(zip(*rows, strict=True)) if rows else [()] * 6
    more, data = None, columns[3]
    if max(columns[4], default=0) > 8:
        rest = [(number >> 64).to_bytes(MORE.itemsize, "little") for number in data]
        more = np.array(rest, MORE)
        more[np.array(columns[4]) <= 8] = _NO_MORE
        data = tuple(number & _FIRST_EIGHT for number in data)
    return Frames(
        np.array(columns[0], np.float64),
        np.array(columns[1], np.uint32),
        np.array(columns[2], bool),
        np.array(data, np.uint64),
        np.array(columns[4], np.uint8),
        np.array(columns[5], np.uint64),
        more,
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
