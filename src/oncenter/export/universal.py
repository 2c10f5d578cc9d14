"""Shared libraries for several processors in one file that macOS loads: a universal binary."""

from __future__ import annotations

import struct
from collections.abc import Sequence

_MACH_O_64 = 0xFEEDFACF
_UNIVERSAL = 0xCAFEBABE
_PAGE_BITS = 14  # 16 KiB, the larger page of the two processors


def universal(libraries: Sequence[bytes]) -> bytes:
    """The libraries one after the other, each on a page of its own, after a table of their processors and positions.

    Raises:
        ValueError: one of them is no 64-bit Mach-O file.
    """
    page = 1 << _PAGE_BITS
    table = struct.pack(">2I", _UNIVERSAL, len(libraries))
    body = b""
    for library in libraries:
        magic, processor, variant = struct.unpack_from("<3I", library)
        if magic != _MACH_O_64:
            raise ValueError("no 64-bit Mach-O file")
        body = body.ljust(-(-len(body) // page) * page, b"\0")
        table += struct.pack(">5I", processor, variant, page + len(body), len(library), _PAGE_BITS)
        body += library
    return table.ljust(page, b"\0") + body
