"""File names are bytes, and strangers choose them: how they are shown, and how a file is named after any text."""

from __future__ import annotations

import hashlib
import os
import re
import sys
import unicodedata

# File systems allow a name 255, Windows a whole path 260; with room for what is appended.
STEM_BYTES_MAX = 120 if sys.platform == "win32" else 200
_IGNORES_CASE = sys.platform in ("win32", "darwin")
# Windows takes such a name for a device, whatever suffix follows.
_OF_A_DEVICE = re.compile(r"(con|prn|aux|nul|com[\d¹²³]|lpt[\d¹²³])(?![^.])", re.IGNORECASE)
# Python's stand-ins for bytes that are no text; characters that a terminal obeys or that reverse what follows.
_NOT_PRINTABLE = re.compile("[\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


def printable(text: str) -> str:
    """Text that any table, page and terminal takes: bytes that are no text, and control characters, become `\\xff`."""
    return _NOT_PRINTABLE.sub(lambda found: _escaped(found[0]), text)


def printable_name(name: str) -> str:
    r"""A name or path as `printable` shows it, where no two names look the same: `\x` in it becomes `\x5cx`, and the
    backslashes between Windows' folders become slashes, which mean the same."""
    if sys.platform == "win32":
        return printable(name.replace("\\", "/"))
    return printable(name.replace(r"\x", r"\x5cx"))


def _escaped(character: str) -> str:
    return "".join(f"\\x{byte:02x}" for byte in character.encode("utf-8", sys.getfilesystemencodeerrors()))


def file_stem(text: str) -> str:
    """A name for the files of this text and of no other: letters, digits, dash, point and underscore stay, every other
    byte becomes a percent sign and two hex digits, as does the first letter of what Windows takes for a device. A long
    one is cut; its digest, after a sign that no other name has, tells it from its like. So it is, where file systems
    take a capital for a small letter, of all texts but those in small letters."""
    encoded = re.sub(r"[^\w.-]", lambda found: "".join(f"%{byte:02X}" for byte in os.fsencode(found[0])), text)
    if _OF_A_DEVICE.match(encoded):
        encoded = f"%{ord(encoded[0]):02X}{encoded[1:]}"
    whole = os.fsencode(encoded)
    if len(whole) <= STEM_BYTES_MAX and not (_IGNORES_CASE and unicodedata.normalize("NFD", text).lower() != text):
        return encoded
    mark = f"~{hashlib.sha256(whole).hexdigest()}"
    return whole[: STEM_BYTES_MAX - len(mark)].decode(errors="ignore") + mark
