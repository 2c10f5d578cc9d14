"""Writes a candump log (`candump -L`) with one channel, `can0`, many lines at once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from oncenter.simulate.can import BusFrames, Bytes

_LINES_AT_ONCE = 200_000  # some 50 MB of working memory


def write_candump(frames: BusFrames, path: Path) -> None:
    with path.open("wb") as log:
        for begin in range(0, len(frames.microseconds), _LINES_AT_ONCE):
            log.write(_lines(frames, slice(begin, begin + _LINES_AT_ONCE)).data)


_HEX = np.frombuffer(b"0123456789ABCDEF", np.uint8)
_TEMPLATE = b"(0000000000.000000) can0 00000000#0000000000000000\n"
_SECONDS, _FRACTION, _IDENTIFIER, _PAYLOAD = slice(1, 11), slice(12, 18), slice(25, 33), slice(34, 50)


def _lines(frames: BusFrames, some: slice) -> Bytes:
    """The log's text, shape (n, 51): all lines have the same length."""
    microseconds = frames.microseconds[some]
    text = np.tile(np.frombuffer(_TEMPLATE, np.uint8), (len(microseconds), 1))
    text[:, _SECONDS] = _decimal(frames.start_s + microseconds // 1_000_000, 10)
    text[:, _FRACTION] = _decimal(microseconds % 1_000_000, 6)
    text[:, _IDENTIFIER] = _hex(frames.identifier[some].astype(">u4").view(np.uint8).reshape(-1, 4))
    text[:, _PAYLOAD] = _hex(frames.payload[some])
    return text


def _decimal(number: npt.NDArray[np.int64], digits: int) -> Bytes:
    powers = 10 ** np.arange(digits - 1, -1, -1, dtype=np.int64)
    return (number[:, None] // powers % 10 + ord("0")).astype(np.uint8)


def _hex(octets: Bytes) -> Bytes:
    digits = np.empty((len(octets), 2 * octets.shape[1]), np.uint8)
    digits[:, 0::2] = _HEX[octets >> 4]
    digits[:, 1::2] = _HEX[octets & 15]
    return digits
