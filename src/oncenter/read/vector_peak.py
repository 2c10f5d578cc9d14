"""Vector `.asc` and PEAK `.trc`: with the own readers, or with python-can for layouts unknown to them."""

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
    """Data frames of classic CAN, many at a time. `notes` receives what was left out.

    Args:
        by_library: whether python-can may be used; only in a process that may crash.

    Raises:
        NeedsLibrary: python-can is needed and not allowed.
        OncenterError: the log cannot be read.
    """
    own_notes, given = list[str](), 0
    try:
        for frames in (asc if suffix == ".asc" else trc).chunks(path, own_notes, progress):
            given += len(frames)
            yield frames
    except NeedsLibrary as why:
        if not by_library:
            raise
        notes.append(f"{path.name} was read with python-can, which is slower: {why}")
    else:
        notes += own_notes
        return
    from oncenter.read import python_can

    yield from _after(given, python_can.chunks(path, suffix, notes, progress))


def _after(count: int, chunks: Iterator[Frames]) -> Iterator[Frames]:
    """The frames without the first `count`."""
    for frames in chunks:
        yield frames.where(np.arange(len(frames)) >= count)
        count -= min(len(frames), count)
