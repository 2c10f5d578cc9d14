"""Packed logs: one file that is unpacked into a folder before it is read, within bounds; and the logs of a ZIP archive.

A log of an archive with several is named as a file in a folder: `drives.zip/monday.log`.
"""

from __future__ import annotations

import bz2
import contextlib
import gzip
import lzma
import sys
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path, PurePosixPath
from typing import IO, Any, cast

from oncenter.errors import OncenterError
from oncenter.files.extra import is_installed, missing_extra
from oncenter.files.file_name import printable
from oncenter.files.log_formats import HEAD_BYTES, format_of_content
from oncenter.files.other_files import other_kind
from oncenter.files.packed_names import ZIP, has_log_name, head_of, packed_file, packing_of, without_packing
from oncenter.read.wording import cannot_read, damaged, reason_of

ALWAYS_UNPACKED_BYTES, MAX_EXPANSION = 512 << 20, 100  # logs have 3 to 30 bytes for each packed one
_BLOCK_BYTES = 1 << 20
_DEPTH_MAX = 2  # a packed log in an archive
_MEMBERS_MAX, _SHOWN = 10_000, 5
_XZ_MEMORY_BYTES = 256 << 20


@contextlib.contextmanager
def unpacked_here(path: Path) -> Iterator[Path]:
    """The log itself; of a packed one a file of its name that holds it for a while. For a process with limits.

    Raises:
        OncenterError: as `unpack`.
    """
    packed = packed_file(path)
    if packed is None:
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="oncenter-", ignore_cleanup_errors=True) as folder:
        yield unpack(*packed, Path(folder))


def unpack(path: Path, member: str, folder: Path) -> Path:
    """Unpacks a log into a folder, under its name without the packing: asammdf would unpack a `.zip` again.

    Args:
        path: of the packed file.
        member: of an archive with several logs; "" for the only one.

    Raises:
        OncenterError: "unreadable_log": it is damaged, too large, or encrypted; "several_logs": it holds several, and
            none is named; "empty_log": it holds none; "missing_extra": the package for .zst is not installed.
    """
    name = path.name
    try:
        left = max(ALWAYS_UNPACKED_BYTES, MAX_EXPANSION * path.stat().st_size)
        for depth in range(_DEPTH_MAX + 1):
            packing = packing_of(head_of(path), path.name)
            if not packing:
                return path
            if depth == _DEPTH_MAX:
                break
            target = folder / str(depth) / (PurePosixPath(member).name or without_packing(path.name))
            target.parent.mkdir()
            with _opened(path, packing, member) as packed, target.open("wb") as file:
                left = _copied(packed, file, left)
            path, member = target, ""
    except OncenterError:
        raise
    except OSError as error:
        if error.errno is None:  # of bz2 and gzip
            raise damaged(name, reason_of(error)) from error
        raise cannot_read(path, error) from error
    except Exception as error:  # each way of packing has errors of its own
        raise damaged(name, reason_of(error)) from error
    raise OncenterError(f"cannot read {name}: it is packed more than twice: unpack it", code="unreadable_log")


def logs_of_archive(path: Path) -> list[str]:
    """The names of the logs in a ZIP archive, in order.

    Raises:
        OncenterError: "unreadable_log": it is damaged or encrypted.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            return _logs(archive, path.name)
    except OncenterError:
        raise
    except Exception as error:  # of zipfile, zlib, bz2 or lzma
        raise damaged(path.name, reason_of(error)) from error


def _logs(archive: zipfile.ZipFile, name: str) -> list[str]:
    entries = [each for each in archive.infolist() if not each.is_dir() and _is_shown(each.filename)]
    if len(entries) > _MEMBERS_MAX:
        raise ValueError(f"it holds {len(entries)} files")
    if any(each.flag_bits & 1 for each in entries):
        raise OncenterError(f"cannot read {name}: it needs a password: unpack it first", code="unreadable_log")
    return sorted(each.filename for each in entries if _is_log(archive, each))


def _is_shown(name: str) -> bool:
    """Not of the files that macOS and editors hide, and named as a file can be."""
    parts = PurePosixPath(name).parts
    hidden = any(part.startswith((".", "__MACOSX")) for part in parts)
    return bool(parts) and not hidden and not name.startswith("/") and name.isprintable() and "\\" not in name


def _is_log(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> bool:
    name = PurePosixPath(entry.filename).name
    if name.lower().endswith(ZIP):
        return False
    if has_log_name(name):
        return True
    with archive.open(entry) as file:
        head = file.read(HEAD_BYTES)
    return not other_kind(head) and format_of_content(head, name) is not None


@contextlib.contextmanager
def _opened(path: Path, packing: str, member: str) -> Iterator[IO[bytes]]:
    if packing == "zip":
        with zipfile.ZipFile(path) as archive, archive.open(member or _only_log(archive, path.name)) as file:
            yield file
        return
    with contextlib.closing(_OPEN[packing](path)) as file:
        yield file


def _only_log(archive: zipfile.ZipFile, name: str) -> str:
    logs = _logs(archive, name)
    if not logs:
        there = ", ".join(printable(each.filename) for each in archive.infolist()[:_SHOWN]) or "nothing"
        raise OncenterError(f"no log in {name}: it holds {there}", code="empty_log")
    if len(logs) > 1:
        more = ", ..." if len(logs) > _SHOWN else ""
        raise OncenterError(
            f"{name} holds {len(logs)} logs: {', '.join(map(printable, logs[:_SHOWN]))}{more}; name one of them as "
            f"{name}/{printable(logs[0])}",
            code="several_logs",
        )
    return logs[0]


def _zstd(path: Path) -> IO[bytes]:
    if sys.version_info >= (3, 14):
        from compression import zstd
    else:
        if not is_installed("backports.zstd"):  # which rosbags brings
            raise missing_extra("ros", f"{path.name} needs backports.zstd")
        from backports import zstd
    return cast(IO[bytes], zstd.open(path))


def _xz(path: Path) -> IO[bytes]:
    return cast(IO[bytes], _Xz(path))


class _Xz:
    """An xz file whose dictionary cannot take all memory."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("rb")
        self._unpacking = lzma.LZMADecompressor(memlimit=_XZ_MEMORY_BYTES)

    def read(self, size: int) -> bytes:
        while not self._unpacking.eof:
            given = self._file.read(_BLOCK_BYTES) if self._unpacking.needs_input else b""
            if self._unpacking.needs_input and not given:
                raise EOFError("it ends too early")
            if found := self._unpacking.decompress(given, size):
                return found
        return b""

    def close(self) -> None:
        self._file.close()


_OPEN: dict[str, Callable[[Path], Any]] = {"gz": gzip.open, "bz2": bz2.open, "xz": _xz, "zst": _zstd}


def _copied(packed: IO[bytes], file: IO[bytes], left: int) -> int:
    """Copies a file; returns the number of bytes that may still be unpacked."""
    while block := packed.read(_BLOCK_BYTES):
        left -= len(block)
        if left < 0:
            raise ValueError("it unpacks to far more than a log would")
        file.write(block)
    return left
