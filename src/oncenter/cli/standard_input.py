"""A log from standard input, `-` on the command line, kept as a file because readers read it twice."""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.log_formats import format_of_content

STANDARD_INPUT = Path("-")


@contextmanager
def as_file(log: Path) -> Iterator[Path]:
    """The log itself; for standard input a file that holds it while it is read.

    Raises:
        OncenterError: "usage", exit code 2: standard input is a terminal; "unreadable_log": it cannot be stored.
    """
    if log != STANDARD_INPUT:
        yield log
        return
    if sys.stdin is None or sys.stdin.isatty():
        raise OncenterError(
            "- reads a log from standard input: candump -ta can0 | oncenter offset - --vehicle FILE",
            code="usage",
            exit_code=WRONG_USAGE,
        )
    with tempfile.TemporaryDirectory(prefix="oncenter-", ignore_cleanup_errors=True) as folder:
        yield _kept(sys.stdin.buffer, Path(folder))


def _kept(given: BinaryIO, folder: Path) -> Path:
    try:
        first = given.read(1 << 16)
        found = format_of_content(first, ".csv")
        suffix = ".csv" if found is None else found.suffixes[0]
        path = folder / f"standard input{suffix}"
        with path.open("wb") as file:
            file.write(first)
            shutil.copyfileobj(given, file)
    except OSError as error:
        raise OncenterError(f"cannot store standard input: {error.strerror}", code="unreadable_log") from None
    return path
