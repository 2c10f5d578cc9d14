"""Logs that the page sends: each is written to a file while it comes, in a folder of this process, under its own name
without what a file system or a terminal reads from it."""

from __future__ import annotations

import secrets
import shutil
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain, count
from pathlib import Path
from typing import BinaryIO

from oncenter.errors import OncenterError
from oncenter.files.file_name import printable_name, recognisable_name
from oncenter.files.log_formats import DATABASES, SUFFIXES
from oncenter.files.packed_names import SINGLE

TAKEN = (*SUFFIXES, *SINGLE, ".zip")  # a packed log may have any name: its content decides
AT_ONCE_MAX = 50  # logs that are not removed
_FREE_BYTES_MIN = 1 << 28  # of the disk, for others
_NAME_LENGTH = 60  # of up to four bytes each: a file system takes 255


@dataclass
class Upload:
    """A log that is coming, or is whole.

    Attributes:
        path: its name is the user's, without what a file system or a terminal reads from it.
        size: bytes that it will have.
        is_taken: a request sends it, or has sent it.
        is_removed: what is still on its way is dropped.
    """

    path: Path
    size: int
    is_taken: bool = False
    is_removed: bool = False
    _file: BinaryIO | None = None
    written: int = 0

    @property
    def is_whole(self) -> bool:
        return self.written == self.size

    def write(self, chunk: bytes) -> None:
        """Raises OSError where the disk is full."""
        if self.is_removed:
            return
        if self._file is None:
            self._file = self.path.open("xb")
        self._file.write(chunk)
        self.written += len(chunk)
        if self.is_whole:
            self.close()

    def close(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None


class Uploads:
    """All logs of the page, in a temporary folder that is deleted when its context ends."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="oncenter-app-", ignore_cleanup_errors=True)
        self._of: dict[str, Upload] = {}

    def __enter__(self) -> Uploads:
        return self

    def __exit__(self, *_: object) -> None:
        for upload in self._of.values():
            upload.close()
        self._folder.cleanup()

    def begin(self, name: str, size: int) -> str:
        """The key of a log that will come.

        Raises:
            OncenterError: "page": it cannot be taken.
        """
        shown = printable_name(name)
        if not name.lower().endswith((*TAKEN, *DATABASES)):
            raise OncenterError(f"{shown} is not a log: oncenter reads {', '.join(SUFFIXES)}", code="page")
        if size <= 0:
            raise OncenterError(f"{shown} is empty (0 bytes)", code="page")
        if len(self._of) >= AT_ONCE_MAX:
            raise OncenterError(f"no more than {AT_ONCE_MAX} logs at once: remove some", code="page")
        waiting = sum(upload.size - upload.written for upload in self._of.values())
        free = shutil.disk_usage(self._folder.name).free
        if size + waiting > free - _FREE_BYTES_MIN:
            raise OncenterError(
                f"{shown} has {size / 1e6:.0f} MB, and the disk of {self._folder.name} has {free / 1e6:.0f} MB left: "
                "make room, or set TMPDIR to a folder on another disk",
                code="page",
            )
        key = secrets.token_urlsafe(12)
        self._of[key] = Upload(self._free_path(recognisable_name(name[-_NAME_LENGTH:])), size)
        return key

    def _free_path(self, name: str) -> Path:
        """Two logs of different folders may have the same name, or differ in capitals, which some systems ignore."""
        folder = Path(self._folder.name)
        there = [*folder.iterdir(), *(upload.path for upload in self._of.values())]
        taken = {path.name.lower() for path in there}
        numbered = (f"{number}-{name}" for number in count(2))
        return folder / next(each for each in chain([name], numbered) if each.lower() not in taken)

    def of(self, key: str) -> Upload | None:
        return self._of.get(key)

    def remove(self, key: str) -> None:
        upload = self._of.pop(key, None)
        if upload is not None:
            upload.is_removed = True
            upload.close()
            with suppress(PermissionError):  # Windows keeps it while an answer reads it; the folder goes at the end
                upload.path.unlink(missing_ok=True)
