"""Checks the elements of a MATLAB file, version 5 to 7, before scipy reads them.

scipy takes the type of an element as an index of a table, without a check, and counts a reference of the object that it
finds behind the table: it writes through any pointer. It reads the last of no dimensions as well. Each element that it
would read as numbers has a type of numbers here, and each matrix has dimensions and all of its elements.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator, Sequence

_HEAD = 128  # bytes before the first element; the last two give the byte order
_MATRIX, _COMPRESSED = 14, 15  # types of elements
_PLAIN = frozenset((1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18))  # numbers and text
_INTEGERS = (5, 6)
_CELL, _STRUCT, _OBJECT, _TEXT, _SPARSE, _LAST_NUMERIC, _OPAQUE = 1, 2, 3, 4, 5, 15, 17  # classes of matrices
_DIMENSIONS_MAX = 32
_COMPLEX = 0x800  # of the flags
_DEPTH_MAX = 64
_SMALL = 4  # bytes of data that fit into the tag


def check_elements(content: bytes) -> None:
    """
    Raises:
        ValueError: an element is cut off, or is none that a matrix has at its place.
        zlib.error: compressed data are damaged.
    """
    order = ">" if content[_HEAD - 2 : _HEAD] == b"MI" else "<"
    for kind, inner in _elements(memoryview(content)[_HEAD:], order, 1):
        if kind == _COMPRESSED:
            unpacked = memoryview(zlib.decompressobj().decompress(inner))
            for its_kind, its_inner in _elements(unpacked, order, 1):
                _check(its_kind, its_inner, order, 0)
        else:
            _check(kind, inner, order, 0)


def _elements(content: memoryview, order: str, multiple: int) -> Iterator[tuple[int, memoryview]]:
    """Types and data. An element of a matrix begins at a `multiple` of bytes."""
    place = 0
    while place + 8 <= len(content):
        kind, count = struct.unpack_from(f"{order}II", content, place)
        begin = place + 8
        if kind >> 16:
            kind, count, begin = kind & 0xFFFF, kind >> 16, place + 4
            if count > _SMALL:
                raise ValueError("a small element of more than 4 bytes")
        if begin + count > len(content):
            raise ValueError("an element is cut off")
        yield kind, content[begin : begin + count]
        place = max(place + 8, begin + count)
        place += -place % multiple


def _check(kind: int, content: memoryview, order: str, depth: int) -> None:
    if kind != _MATRIX:
        if kind not in _PLAIN or depth == 0:
            raise ValueError(f"an element of type {kind}")
        return
    if not content:  # an empty cell
        return
    if depth > _DEPTH_MAX:
        raise ValueError("too many matrices in each other")
    parts = list(_elements(content, order, 8))
    flags_kind, flags = parts[0] if parts else (0, content[:0])
    if flags_kind not in _INTEGERS or len(flags) != 8:
        raise ValueError("a matrix without flags")
    (word,) = struct.unpack_from(f"{order}I", flags)
    class_ = word & 0xFF
    if class_ != _OPAQUE:
        needed = _count(class_, bool(word & _COMPLEX), parts, order)
        if len(parts) < needed:
            raise ValueError("a matrix without all of its elements")
    for its_kind, inner in parts:
        if _TEXT <= class_ <= _LAST_NUMERIC and its_kind == _MATRIX:
            raise ValueError("a matrix in place of numbers")
        _check(its_kind, inner, order, depth + 1)


def _count(class_: int, is_complex: bool, parts: Sequence[tuple[int, memoryview]], order: str) -> int:
    """The number of elements that scipy reads of a matrix: it goes on in the next one where some are missing."""
    if len(parts) < 3 or parts[1][0] not in _INTEGERS or not 8 <= len(parts[1][1]) <= _DIMENSIONS_MAX * 4:
        raise ValueError("a matrix without dimensions")
    dimensions: tuple[int, ...] = struct.unpack_from(f"{order}{len(parts[1][1]) // 4}i", parts[1][1])
    if min(dimensions) < 0:
        raise ValueError("a matrix of a negative size")
    if class_ == _CELL:
        return 3 + math.prod(dimensions)
    if class_ in (_STRUCT, _OBJECT):
        head = 5 if class_ == _STRUCT else 6
        length = parts[head - 2][1] if len(parts) >= head else b""
        width = int(struct.unpack(f"{order}i", length)[0]) if len(length) == 4 else 0
        if width <= 0:
            raise ValueError("a struct without names")
        return head + math.prod(dimensions) * (len(parts[head - 1][1]) // width)
    return (6 if class_ == _SPARSE else 4) + is_complex
