"""File names are bytes, and strangers choose them: how they are shown, and how a file is named after any text."""

from __future__ import annotations

import hashlib
import os
import re
import sys

STEM_BYTES_MAX = 200  # of the 255 that file systems allow a name, with room for what is appended
# Python's stand-ins for bytes that are no text; characters that a terminal obeys or that reverse what follows.
_NOT_PRINTABLE = re.compile("[\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


def printable(text: str) -> str:
    """Text that any table, page and terminal takes: bytes that are no text, and control characters, become `\\xff`."""
    return _NOT_PRINTABLE.sub(lambda found: _escaped(found[0]), text)


def printable_name(name: str) -> str:
    r"""A name or path as `printable` shows it, where no two names look the same: `\x` in it becomes `\x5cx`."""
    return printable(name.replace(r"\x", r"\x5cx"))


def _escaped(character: str) -> str:
    return "".join(f"\\x{byte:02x}" for byte in character.encode("utf-8", sys.getfilesystemencodeerrors()))


def file_stem(text: str) -> str:
    """A name for the files of this text and of no other: letters, digits, dash, point and underscore stay, every other
    byte becomes a percent sign and two hex digits. A long one is cut; its digest, after a sign that no other name has,
    tells it from its like."""
    encoded = re.sub(r"[^\w.-]", lambda found: "".join(f"%{byte:02X}" for byte in os.fsencode(found[0])), text)
    whole = os.fsencode(encoded)
    if len(whole) <= STEM_BYTES_MAX:
        return encoded
    mark = f"~{hashlib.sha256(whole).hexdigest()}"
    return whole[: STEM_BYTES_MAX - len(mark)].decode(errors="ignore") + mark
