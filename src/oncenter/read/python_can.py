"""Vector `.asc` and PEAK `.trc` with layouts that `asc` and `trc` do not support, frame by frame through python-can."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from oncenter.errors import OncenterError
from oncenter.files.extra import require_package
from oncenter.read import counted, damaged, reason_of
from oncenter.read.cut_off import CutOff
from oncenter.read.frames import Frames, bus_code
from oncenter.read.text_lines import AscLines, TextLines

if TYPE_CHECKING:
    import can

FRAMES_PER_CHUNK = 100_000


def chunks(path: Path, suffix: str, notes: list[str], progress: Callable[[float], None]) -> Iterator[Frames]:
    """Frames of a log, many at a time. `notes` receives what was left out.

    Raises:
        OncenterError: python-can cannot read it; "missing_extra": it is not installed.
    """
    size = max(path.stat().st_size, 1)
    with path.open("rb") as file, _complaints() as complaints:
        text = AscLines(file, path.name) if suffix == ".asc" else TextLines(file)
        messages = _messages(path, text)
        skipped = _Skipped()
        while frames := _some(path, messages, skipped):
            progress(1.0 if file.closed else min(file.tell() / size, 1.0))
            yield frames
    if text.cut_off:
        notes.append(CutOff(f"the last line of {path.name} is cut off and was left out"))
    if text.strange:
        first = f"the first reads {text.first_strange!r}"
        notes.append(f"left out {counted(text.strange, 'line')} of {path.name} that are not CAN frames, {first}")
    if skipped.flexible:
        notes.append(f"left out {counted(skipped.flexible, 'CAN FD frame')} of {path.name}")
    if complaints:
        notes.append(
            f"python-can left out {counted(len(complaints), 'line')} of {path.name}, its first message: {complaints[0]}"
        )


class _Complaints(logging.Handler):
    """Collects python-can's log messages about lines that it leaves out."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.messages: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.messages.append(record.getMessage()[:100])


@contextlib.contextmanager
def _complaints() -> Iterator[list[str]]:
    """Redirects python-can's log messages from the terminal to the notes."""
    logger, handler = logging.getLogger("can"), _Complaints()
    before, logger.propagate = logger.propagate, False
    logger.addHandler(handler)
    try:
        yield handler.messages
    finally:
        logger.removeHandler(handler)
        logger.propagate = before


def _messages(path: Path, text: TextLines) -> Iterator[can.Message]:
    require_package("can", path.name)
    from can.io import asc, trc

    try:
        if isinstance(text, AscLines):
            return iter(asc.ASCReader(text, relative_timestamp=False))
        return iter(trc.TRCReader(text))
    except OncenterError:
        raise
    except Exception as error:  # python-can's readers raise value and index errors
        raise damaged(path.name, reason_of(error)) from error


@dataclass
class _Skipped:
    """Counts of frames left out."""

    flexible: int = 0


def _some(path: Path, messages: Iterator[can.Message], skipped: _Skipped) -> Frames | None:
    """The next frames, or None at the end of the log."""
    some = []
    try:
        for message in messages:
            if not is_data(message):
                skipped.flexible += message.is_fd
                continue
            some.append(message)
            if len(some) == FRAMES_PER_CHUNK:
                break
        return frames_of(some) if some else None
    except OncenterError:
        raise
    except Exception as error:  # as above
        raise damaged(path.name, reason_of(error)) from error


def is_data(message: can.Message) -> bool:
    """Whether it is a data frame of classic CAN: no error frame, remote frame or CAN FD."""
    return not (message.is_error_frame or message.is_remote_frame or message.is_fd)


def frames_of(messages: Iterable[can.Message]) -> Frames:
    """Data frames, at least one, as columns."""
    time, identifier, extended, data, channel = zip(
        *((m.timestamp, m.arbitration_id, m.is_extended_id, m.data, m.channel) for m in messages), strict=True
    )
    codes = {name: bus_code(str(name)) for name in set(channel)}
    return Frames(
        np.array(time, np.float64),
        np.array(identifier, np.uint32),
        np.array(extended, bool),
        np.frombuffer(b"".join(bytes(d[:8]).ljust(8, b"\xff") for d in data), "<u8"),
        np.array([len(d) for d in data], np.uint8),
        np.array([codes[name] for name in channel], np.uint64),
    )
