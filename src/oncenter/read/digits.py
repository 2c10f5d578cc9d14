"""Parses digits in text, many at once: eight characters form one 64-bit word, the first one its lowest byte."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Words = npt.NDArray[np.uint64]
Places = npt.NDArray[np.int64]
Bytes = npt.NDArray[np.uint8]


def eight(values: Bytes, places: Places) -> Words:
    """Eight neighbouring bytes from each place on, the first one lowest."""
    windows: npt.NDArray[np.void] = np.ndarray((len(values) - 7,), "V8", values, strides=(1,))
    return windows[places].view("<u8")


def packed(nibbles: Words) -> Words:
    """Eight hexadecimal digits, one a byte, as four bytes in their order."""
    pairs = (nibbles << np.uint64(4) | nibbles >> np.uint64(8)) & np.uint64(0x00FF00FF00FF00FF)
    pairs = (pairs | pairs >> np.uint64(8)) & np.uint64(0x0000FFFF0000FFFF)
    return (pairs | pairs >> np.uint64(16)) & np.uint64(0xFFFFFFFF)


def without_first(digits: Words, bits: Words | np.uint64) -> Words:
    """Clears the first `bits` bits; two shifts, because one shift by 64 is undefined."""
    half = bits >> np.uint64(1)
    rest = bits - half
    shifted = digits >> half >> rest
    without: Words = np.left_shift(np.left_shift(shifted, half), rest, dtype=np.uint64)
    return without


def decimal(digits: Words) -> Words:
    """Eight decimal digits, one a byte, the first one lowest, as a number."""
    pairs = (digits * np.uint64(10) + (digits >> np.uint64(8))) & np.uint64(0x00FF00FF00FF00FF)
    fours = (pairs * np.uint64(100) + (pairs >> np.uint64(16))) & np.uint64(0x0000FFFF0000FFFF)
    return (fours * np.uint64(10000) + (fours >> np.uint64(32))) & np.uint64(0xFFFFFFFF)


def all_decimal(digits: Words) -> npt.NDArray[np.bool_]:
    """Whether each of the eight bytes is 0 to 9."""
    good: npt.NDArray[np.bool_] = (digits + np.uint64(0x0606060606060606)) & np.uint64(0xF0F0F0F0F0F0F0F0) == 0
    return good
