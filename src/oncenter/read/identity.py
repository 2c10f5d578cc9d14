"""The truck and the start time of a log, where the log contains them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from oncenter.errors import OncenterError
from oncenter.files.log_formats import OF_FRAMES
from oncenter.read.frames import Frames, Wanted, pgn_of, with_groups
from oncenter.read.frames_of_log import frames_of_log

if TYPE_CHECKING:
    import polars as pl

_VEHICLE_IDENTIFICATION = 65260  # J1939 VI: the VIN, closed by '*'
_CONNECTION, _TRANSFER = 0xEC00, 0xEB00  # J1939-21's transport protocol
_ANNOUNCED = (0x20, 0x10)  # control bytes of a broadcast and of a request to send to one address
_PER_PACKET = 7  # bytes
PGNS = frozenset((_VEHICLE_IDENTIFICATION, _CONNECTION, _TRANSFER))
_OF_COLUMNS = (".csv", ".csv.gz", ".parquet")
_START_NAMES = ("start_time", "start_time_s")


def vin_of(path: Path) -> str | None:
    """The vehicle identification number in a log; None without one, or if the log cannot be read.

    Frames: from VI, PGN 65260, in one frame or in packets. Parquet: metadata `vin` or column `vin`. CSV: column `vin`.
    """
    name = path.name.lower()
    try:
        if name.endswith(_OF_COLUMNS):
            return _plain(_stated(path, ("vin", "VIN")))
        if not name.endswith(OF_FRAMES):
            return None
        return assembled(frames_of_log(path, [], lambda fraction: None, Wanted(PGNS)))
    except (OncenterError, OSError, ValueError):
        return None  # reading its signals reports the error


def start_of(path: Path) -> float | None:
    """Start of a table in seconds since 1970, from its metadata or column `start_time`; None without one.

    It may be an ISO date (UTC if it names no zone), or seconds since 1970.
    """
    if not path.name.lower().endswith(_OF_COLUMNS):
        return None
    try:
        stated = _stated(path, _START_NAMES)
        if stated is None:
            return None
        try:
            return float(stated)
        except ValueError:
            given = datetime.fromisoformat(stated)
            return (given if given.tzinfo else given.replace(tzinfo=UTC)).timestamp()
    except (OSError, ValueError):
        return None


def _stated(path: Path, names: tuple[str, ...]) -> str | None:
    """A value from a table's metadata, or from the first cell of a column; None if the table cannot be read."""
    import polars as pl  # late import: frames do not need it

    from oncenter.read.tabular import for_polars

    source = for_polars(path)
    try:
        if path.suffix.lower() != ".parquet":
            return _first_cell(pl.read_csv(source, n_rows=1, infer_schema=False), names)
        metadata: Mapping[str, str] = pl.read_parquet_metadata(source)
        for name in names:
            if metadata.get(name):
                return metadata[name]
        columns = [name for name in names if name in pl.read_parquet_schema(source)]
        return _first_cell(pl.read_parquet(source, columns=columns, n_rows=1), names) if columns else None
    except pl.exceptions.PolarsError:
        return None


def _first_cell(table: pl.DataFrame, names: tuple[str, ...]) -> str | None:
    cells = [table[name][0] for name in names if name in table.columns and table.height]
    return None if not cells or cells[0] is None else str(cells[0]).strip() or None


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
    """The VIN without terminator and padding; None unless letters and digits are left."""
    text = (vin or "").split("*")[0].strip("\0 \xff").strip()
    return text if text and text.isascii() and text.isalnum() else None
