"""Writes Vector `.asc` and `.blf` and PEAK `.trc` through python-can, without the machine's time zone or paths."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from oncenter.simulate.can import BusFrames

if TYPE_CHECKING:
    import can

_CHANNEL = 1


def write_asc(frames: BusFrames, path: Path) -> None:
    """The header is in UTC: the format has no time zone, and python-can would use local time."""
    from can.io.asc import ASCWriter

    class OfTheDrive(ASCWriter):
        def _format_header_datetime(self, dt: datetime) -> str:
            return super()._format_header_datetime(datetime.fromtimestamp(frames.start_s, UTC))

    with path.open("w", encoding="ascii", newline="\n") as file, OfTheDrive(file, channel=_CHANNEL) as writer:
        for message in _messages(frames):
            writer.on_message_received(message)


def write_blf(frames: BusFrames, path: Path) -> None:
    from can.io.blf import BLFWriter

    with path.open("wb") as file, BLFWriter(file, channel=_CHANNEL) as writer:
        for message in _messages(frames):
            writer.on_message_received(message)


def write_trc(frames: BusFrames, path: Path) -> None:
    """The header contains a fixed file name; python-can would write the path on this machine."""
    from can.io.trc import TRCWriter

    with path.open("w", encoding="ascii", newline="\n") as file, TRCWriter(file, channel=_CHANNEL) as writer:
        writer.filepath = "drive.trc"
        for message in _messages(frames):
            writer.on_message_received(message)


def _messages(frames: BusFrames) -> Iterator[can.Message]:
    from can import Message

    for microseconds, identifier, payload in zip(
        frames.microseconds.tolist(), frames.identifier.tolist(), frames.payload, strict=True
    ):
        yield Message(
            timestamp=frames.start_s + microseconds / 1e6,
            arbitration_id=identifier,
            is_extended_id=True,
            data=payload.tobytes(),
            dlc=8,
        )
