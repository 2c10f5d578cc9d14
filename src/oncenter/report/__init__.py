"""One page for people about one answer: a single file that loads nothing from anywhere."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from oncenter.errors import WRONG_USAGE, OncenterError

if TYPE_CHECKING:
    from oncenter.estimate import Answer


def check_path(path: str | os.PathLike[str]) -> None:
    """Refuses, before an answer is worked out, a path to which no page could be written.

    Raises:
        OncenterError: "output", exit code 2.
    """
    folder = Path(path).parent
    try:
        if Path(path).is_dir() or not folder.is_dir() or not os.access(folder, os.W_OK):
            raise _unwritable(path, "no such folder" if not folder.exists() else "not a file that can be written")
    except OSError as error:
        raise _unwritable(path, error.strerror) from None


def _unwritable(path: str | os.PathLike[str], why: str | None) -> OncenterError:
    return OncenterError(
        f"report {os.fspath(path)} cannot be written: {why}; name a file in a folder that exists and is yours",
        code="output",
        exit_code=WRONG_USAGE,
    )


def report(answer: Answer, path: str | os.PathLike[str]) -> None:
    """Writes the page: the answer in words, the drive, the gate, the offset over time, where it came from.

    Args:
        answer: as `oncenter.offset` gives it.
        path: of the HTML file, some 2 MB; overwritten where it exists.

    Raises:
        OncenterError: "output", exit code 2: the file cannot be written.
    """
    # late: bokeh takes longer to load than most answers take to find
    from oncenter.estimate import trace
    from oncenter.report.page import page

    text = page(answer, trace(answer))
    try:
        Path(path).write_text(text, encoding="utf-8")
    except OSError as error:
        raise _unwritable(path, error.strerror) from None
