"""The VIN in the header comment of an MDF 4 file, where its logger wrote one."""

from __future__ import annotations

import re
from pathlib import Path

_MAGIC = (b"MDF ", b"UnFinMF ")
_HEADER = 64  # place of the HD block
_COMMENT_LINK = _HEADER + 24 + 5 * 8  # the sixth link of the HD block
_COMMENT_MAX = 1 << 20  # bytes
_VIN = re.compile(r"\bvin\b\W{1,12}([A-HJ-NPR-Z0-9]{17})(?![A-Z0-9])", re.IGNORECASE)  # <e name="VIN">YS2...


def vin_in_header(path: Path) -> str | None:
    """None without one, and for any other file."""
    try:
        with path.open("rb") as file:
            if not file.read(8).startswith(_MAGIC):
                return None
            file.seek(_COMMENT_LINK)
            place = int.from_bytes(file.read(8), "little")
            if not place:
                return None
            file.seek(place)
            block = file.read(24)
            length = int.from_bytes(block[8:16], "little")
            if block[:4] not in (b"##MD", b"##TX") or not 24 < length <= _COMMENT_MAX:
                return None
            found = _VIN.search(file.read(length - 24).decode("utf-8", "replace"))
    except (OSError, OverflowError, ValueError):  # reading its signals reports the error
        return None
    return found[1].upper() if found else None
