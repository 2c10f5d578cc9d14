"""The frames of a bus log, many at a time, for every format."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from oncenter.files.log_formats import imported
from oncenter.read.frames import Frames, Wanted
from oncenter.read.plugins import known_format


def frames_of_log(
    path: Path,
    notes: list[str],
    progress: Callable[[float], None],
    wanted: Wanted | None = None,
) -> Iterator[Frames]:
    """Reads in this process.

    Args:
        path: a log of one of `log_formats.OF_FRAMES`.
        notes: receives what was left out.
        progress: called with the fraction read.
        wanted: frames to read of an MF4 log; None for those that carry J1939 signals.

    Raises:
        OncenterError: it cannot be read, or is shorter than its header says.
    """
    log_format = known_format(path)
    if log_format.content == "frames":
        chunks: Iterator[Frames] = imported(log_format.reader)(path, notes, progress)
        return chunks
    from oncenter.read.decode import wanted_by

    return iter((imported(log_format.reader)(path, {}, wanted or wanted_by(()), notes, progress)[0].frames,))
