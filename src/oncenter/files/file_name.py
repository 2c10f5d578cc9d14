"""File names are bytes and not trusted: how they are displayed, and how a file is named after any text."""

from __future__ import annotations

import hashlib
import os
import re
import sys
import unicodedata

# File systems allow 255 bytes for a name, Windows 260 for a path; leaves room for suffixes.
STEM_BYTES_MAX = 120 if sys.platform == "win32" else 200
_IGNORES_CASE = sys.platform in ("win32", "darwin")
# On Windows such a name is a device, with any suffix.
_OF_A_DEVICE = re.compile(r"(con|prn|aux|nul|com[\d¹²³]|lpt[\d¹²³])(?![^.])", re.IGNORECASE)
# Python's surrogates for invalid bytes; characters that control a terminal or reverse the text direction.
_NOT_PRINTABLE = re.compile("[\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


def printable(text: str) -> str:
    """Text that is safe for tables, pages and terminals: invalid bytes and control characters become `\\xff`."""
    return _NOT_PRINTABLE.sub(lambda found: _escaped(found[0]), text)


def printable_lines(text: str) -> str:
    """Text of several lines as in `printable`, with its line ends and tabs."""
    return _NOT_PRINTABLE.sub(lambda found: found[0] if found[0] in "\n\t" else _escaped(found[0]), text)


def printable_json(text: str) -> str:
    """The same JSON with escapes of its own for the characters that `printable` replaces."""
    return _NOT_PRINTABLE.sub(lambda found: found[0] if found[0] in "\n\t" else f"\\u{ord(found[0]):04x}", text)


def printable_name(name: str) -> str:
    r"""A name or path as in `printable`, unique for each name: `\x` in it becomes `\x5cx`. On Windows
    backslashes become slashes."""
    if sys.platform == "win32":
        return printable(name.replace("\\", "/"))
    return printable(name.replace(r"\x", r"\x5cx"))


def _escaped(character: str) -> str:
    return "".join(f"\\x{byte:02x}" for byte in character.encode("utf-8", sys.getfilesystemencodeerrors()))


def file_stem(text: str) -> str:
    """A file name unique for each text. Letters, digits, dash, point and underscore stay; every other byte becomes a
    percent sign and two hex digits, as does the first letter of a Windows device name. A long name is cut and gets a
    digest after `~`. On file systems that ignore case, all texts with capitals get the digest too."""
    encoded = re.sub(r"[^\w.-]", lambda found: "".join(f"%{byte:02X}" for byte in os.fsencode(found[0])), text)
    if _OF_A_DEVICE.match(encoded):
        encoded = f"%{ord(encoded[0]):02X}{encoded[1:]}"
    whole = os.fsencode(encoded)
    if len(whole) <= STEM_BYTES_MAX and not (_IGNORES_CASE and unicodedata.normalize("NFD", text).lower() != text):
        return encoded
    mark = f"~{hashlib.sha256(whole).hexdigest()}"
    return whole[: STEM_BYTES_MAX - len(mark)].decode(errors="ignore") + mark


def recognisable_name(text: str) -> str:
    """A file name for every system in which a person finds the own one again: letters, digits, spaces and some signs
    stay, each other character becomes an underscore. Two texts may get the same."""
    kept = re.sub(r"[^\w .()+,=-]", "_", text)
    return f"_{kept}" if _OF_A_DEVICE.match(kept) or kept.startswith((".", "-", " ")) else kept
