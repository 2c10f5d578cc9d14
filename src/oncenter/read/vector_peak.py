"""Vector `.asc` and PEAK `.trc`: by our own code, and by python-can where that does not know how one is written."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from oncenter.errors import NeedsLibrary
from oncenter.read import asc, trc
from oncenter.read.frames import Frames


def chunks(
    path: Path, suffix: str, notes: list[str], progress: Callable[[float], None], *, by_library: bool
) -> Iterator[Frames]:
    """Data frames of classic CAN, many at a time; notes say what is left out.

    Args:
        by_library: whether python-can may be used; it needs a process that may crash.

    Raises:
        NeedsLibrary: it may not, and would be needed.
        OncenterError: the log cannot be read.
    """
    ours, given = list[str](), 0
    try:
        for frames in (asc if suffix == ".asc" else trc).chunks(path, ours, progress):
            given += len(frames)
            yield frames
    except NeedsLibrary as why:
        if not by_library:
            raise
        notes.append(f"{path.name} was read by python-can, which takes longer: {why}")
    else:
        notes += ours
        return
    from oncenter.read import python_can

    yield from _after(given, python_can.chunks(path, suffix, notes, progress))


def _after(count: int, chunks: Iterator[Frames]) -> Iterator[Frames]:
    """Without the first so many frames."""
    for frames in chunks:
        yield frames.where(np.arange(len(frames)) >= count)
        count -= min(len(frames), count)
