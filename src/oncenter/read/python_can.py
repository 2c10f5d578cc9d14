"""Vector `.asc` and `.blf` and PEAK `.trc`, frame by frame through python-can."""

from __future__ import annotations

import contextlib
import io
import logging
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from oncenter.errors import OncenterError
from oncenter.read.frames import Frames, bus_code

if TYPE_CHECKING:
    import can

FRAMES_PER_CHUNK = 100_000


def chunks(path: Path, suffix: str, progress: Callable[[float], None]) -> Iterator[Frames]:
    """Frames of a log, many at a time.

    Raises:
        OncenterError: python-can cannot read it, or it is shorter than it says.
    """
    size = max(path.stat().st_size, 1)
    with path.open("rb") as file, _quiet():
        messages = _messages(path, suffix, file, size)
        while frames := _some(path, messages):
            progress(1.0 if file.closed else min(file.tell() / size, 1.0))
            yield frames


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """What python-can logs about a damaged file is in the error we raise."""
    logger = logging.getLogger("can")
    before, logger.disabled = logger.disabled, True
    try:
        yield
    finally:
        logger.disabled = before


def _messages(path: Path, suffix: str, file: io.BufferedReader, size: int) -> Iterator[can.Message]:
    from can.io import asc, blf, trc

    try:
        if suffix == ".blf":
            reader = blf.BLFReader(file)
            if reader.file_size > size:
                raise OncenterError(
                    f"{path.name} is cut off: {size} of {reader.file_size} bytes are there", code="unreadable_log"
                )
            return iter(reader)
        text = io.TextIOWrapper(file, encoding="utf-8", errors="replace")
        return iter(trc.TRCReader(text) if suffix == ".trc" else asc.ASCReader(text, relative_timestamp=False))
    except OncenterError:
        raise
    except Exception as error:  # python-can's readers let struct, zlib, value and index errors through
        raise _unreadable(path, error) from error


def _some(path: Path, messages: Iterator[can.Message]) -> Frames | None:
    """The next frames, or None at the end of the log."""
    rows = []
    try:
        for message in messages:
            if message.is_error_frame or message.is_remote_frame or message.is_fd:
                continue
            rows.append(
                (message.timestamp, message.arbitration_id, message.is_extended_id, message.data, message.channel)
            )
            if len(rows) == FRAMES_PER_CHUNK:
                break
        return _frames(rows) if rows else None
    except Exception as error:  # as above
        raise _unreadable(path, error) from error


def _frames(rows: Iterable[tuple[Any, ...]]) -> Frames:
    time, identifier, extended, data, channel = zip(*rows, strict=True)
    codes = {name: bus_code(str(name)) for name in set(channel)}
    return Frames(
        np.array(time, np.float64),
        np.array(identifier, np.uint32),
        np.array(extended, bool),
        np.frombuffer(b"".join(bytes(d[:8]).ljust(8, b"\xff") for d in data), "<u8"),
        np.array([len(d) for d in data], np.uint8),
        np.array([codes[name] for name in channel], np.uint64),
    )


def _unreadable(path: Path, error: Exception) -> OncenterError:
    reason = (str(error).strip().splitlines() or [""])[0] or type(error).__name__
    return OncenterError(
        f"cannot read {path.name}, it is damaged or of another format: {reason[:160]}", code="unreadable_log"
    )
