"""The truck and the start time of a log, where the log contains them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from oncenter.errors import OncenterError
from oncenter.read.frames import Frames, pgn_of, with_groups

if TYPE_CHECKING:
    import polars as pl

_VEHICLE_IDENTIFICATION = 65260  # J1939 VI: the VIN, closed by '*'
_CONNECTION, _TRANSFER = 0xEC00, 0xEB00  # J1939-21's transport protocol
_ANNOUNCED = (0x20, 0x10)  # control bytes of a broadcast and of a request to send to one address
_PER_PACKET = 7  # bytes
PGNS = frozenset((_VEHICLE_IDENTIFICATION, _CONNECTION, _TRANSFER))
_VIN_NAME = "vin"
_VIN_MAX = 200  # characters, by J1939-71 (SPN 237); ISO 3779 has 17
_START_NAMES = ("start_time", "start_time_s")


@dataclass(frozen=True)
class Identity:
    """The truck of a log, and the begin of its drive in s since 1970 where the log states it beside its time."""

    vin: str | None = None
    start_s: float | None = None


NOT_STATED = Identity()


def identity_of_columns(path: Path, columns: Sequence[str], content: Callable[[str], pl.Series]) -> Identity:
    """The identity in columns `vin` and `start_time`, of any case: of each the first cell that is not empty.

    Raises:
        OncenterError: "different_trucks": the column has two VINs.
    """
    by_name = {name.strip().lower(): name for name in reversed(columns)}
    vin = None
    if _VIN_NAME in by_name:
        vins = {_plain(str(cell)) for cell in content(by_name[_VIN_NAME]).drop_nulls().unique()} - {None}
        if len(vins) > 1:
            raise OncenterError(
                f"{path.name} has rows of different trucks: VIN {', '.join(sorted(filter(None, vins))[:3])}; split "
                f"it by column {by_name[_VIN_NAME]}",
                code="different_trucks",
            )
        vin = next(iter(vins), None)
    start = next((by_name[name] for name in _START_NAMES if name in by_name), None)
    cells = [] if start is None else content(start).drop_nulls().head(1).to_list()
    return Identity(vin, _seconds(str(cells[0])) if cells else None)


def identity_of_metadata(metadata: Mapping[str, str], otherwise: Identity) -> Identity:
    """The identity in a file's metadata; each part that it lacks from `otherwise`."""
    by_name = {name.strip().lower(): text for name, text in metadata.items()}
    start = next((by_name[name] for name in _START_NAMES if by_name.get(name)), "")
    return Identity(_plain(by_name.get(_VIN_NAME)) or otherwise.vin, _seconds(start) or otherwise.start_s)


def _seconds(stated: str) -> float | None:
    """Seconds since 1970 of a number or an ISO date; None of anything else."""
    try:
        return float(stated)
    except ValueError:
        pass
    try:
        given = datetime.fromisoformat(stated.strip())
        return (given if given.tzinfo else given.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        return None


def assembled(chunks: Iterable[Frames]) -> str | None:
    """The first complete VIN in frames of `PGNS`, others ignored. Packets are joined by source and destination."""
    open_messages: dict[int, tuple[int, dict[int, bytes]]] = {}  # by source and destination: length, packets
    for frames in chunks:
        pgns = pgn_of(frames.identifier)
        for place in np.flatnonzero(with_groups(frames, PGNS)).tolist():
            data = int(frames.data[place]).to_bytes(8, "little")
            vin = _taken(int(pgns[place]), int(frames.identifier[place]) & 0xFFFF, data, open_messages)
            if vin is not None:
                return vin
    return None


def _taken(pgn: int, between: int, data: bytes, open_messages: dict[int, tuple[int, dict[int, bytes]]]) -> str | None:
    """Adds one frame to the open messages; returns a VIN that it completes."""
    if pgn == _VEHICLE_IDENTIFICATION:  # short enough for one frame
        return _plain(data.rstrip(b"\xff").decode("latin-1"))
    if pgn == _CONNECTION:
        if data[0] in _ANNOUNCED and int.from_bytes(data[5:8], "little") == _VEHICLE_IDENTIFICATION:
            open_messages[between] = (int.from_bytes(data[1:3], "little"), {})
        elif data[0] in _ANNOUNCED:
            open_messages.pop(between, None)
        return None
    if between not in open_messages:
        return None
    length, packets = open_messages[between]
    packets[data[0]] = data[1:]
    needed = range(1, -(-length // _PER_PACKET) + 1)
    if any(number not in packets for number in needed):
        return None
    del open_messages[between]
    return _plain(b"".join(packets[number] for number in needed)[:length].decode("latin-1"))


def _plain(vin: str | None) -> str | None:
    """The VIN without terminator and padding; None unless letters and digits are left, as many as a truck may send."""
    text = (vin or "").split("*")[0].strip("\0 \xff").strip()
    return text if text.isascii() and text.isalnum() and len(text) <= _VIN_MAX else None
