"""Packed logs by their names and first bytes. Imports nothing heavy."""

from __future__ import annotations

import contextlib
import os
import zlib
from pathlib import Path
from typing import Literal

from oncenter.files.log_formats import HEAD_BYTES, OF_TABLES, SUFFIXES, format_of_content
from oncenter.files.regular_file import open_regular_file

Packing = Literal["gz", "bz2", "xz", "zst", "zip", ""]
ZIP = ".zip"
SINGLE = (".gz", ".bz2", ".xz", ".zst", ".zstd")  # of one file each
_BEGINS: dict[bytes, Packing] = {
    b"\x1f\x8b": "gz",
    b"BZh": "bz2",
    b"\xfd7zXZ\0": "xz",
    b"\x28\xb5\x2f\xfd": "zst",
    b"PK\x03\x04": "zip",
}
_OFFICE = (b"[Content_Types].xml", b"mimetypeapplication/", b"META-INF/")  # begin of a document that is a ZIP archive


def has_log_name(name: str) -> bool:
    """Whether a file is a log, by its name, packed or not; a ZIP archive may hold some."""
    name = name.lower()
    return name.endswith((*SUFFIXES, ZIP)) or without_packing(name).endswith(SUFFIXES)


def without_packing(name: str) -> str:
    """The name of the file that a packed one holds."""
    packed = next((suffix for suffix in (*SINGLE, ZIP) if name.lower().endswith(suffix)), "")
    return name[: len(name) - len(packed)]


def packing_of(head: bytes, name: str) -> Packing:
    """How a file with these first bytes is packed; "" where its reader unpacks it, as `.csv.gz`, or if it is not."""
    packing: Packing = next((packing for begin, packing in _BEGINS.items() if head.startswith(begin)), "")
    if packing == "zip" and any(mark in head[:100] for mark in _OFFICE):
        return ""
    return "" if packing == "gz" and _is_table(head, name) else packing


def _is_table(head: bytes, name: str) -> bool:
    try:
        begin = zlib.decompressobj(31).decompress(head, HEAD_BYTES)
    except zlib.error:
        begin = b""
    if any(begin.startswith(other) for other in _BEGINS):
        return False
    found = format_of_content(begin, without_packing(name))
    return found is not None and found.content == "columns" and found.suffixes[0] in OF_TABLES[:2]


def packed_file(path: Path) -> tuple[Path, str] | None:
    """The packed file of a log, and its name in it, "" for the only one; None for a log that is not packed."""
    with contextlib.suppress(OSError, ValueError):
        if os.path.isfile(path):
            return (path, "") if packing_of(head_of(path), path.name) else None
        if not os.path.lexists(path):
            archive = next((parent for parent in path.parents if os.path.isfile(parent)), None)
            if archive is not None and packing_of(head_of(archive), archive.name) == "zip":
                return archive, path.relative_to(archive).as_posix()
    return None


def head_of(path: Path) -> bytes:
    """
    Raises:
        OSError: the file cannot be read.
        ValueError: the path holds a zero byte.
    """
    with open_regular_file(path) as file:
        return file.read(HEAD_BYTES)
