"""The frames of a bus log, many at a time, for every format."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from oncenter.files.log_formats import MDF
from oncenter.read.frames import Frames, Wanted


def frames_of_log(
    path: Path,
    notes: list[str],
    progress: Callable[[float], None],
    wanted: Wanted | None = None,
) -> Iterator[Frames]:
    """Reads in this process, with the library for that format.

    Args:
        path: a log of one of `log_formats.OF_FRAMES`.
        notes: receives what was left out.
        progress: called with the fraction read.
        wanted: frames to read of an MF4 log; None for those that carry J1939 signals.

    Raises:
        OncenterError: it cannot be read, or is shorter than its header says.
    """
    suffix = path.suffix.lower()
    if suffix == ".log":
        from oncenter.read import candump

        return candump.chunks(path, notes, progress)
    if suffix == ".blf":
        from oncenter.read import blf

        return blf.chunks(path, notes, progress)
    if suffix in MDF:
        from oncenter.read import mf4
        from oncenter.read.decode import wanted_by

        return iter((mf4.read(path, {}, wanted or wanted_by(()), notes, progress)[0].frames,))
    from oncenter.read import asc, trc

    return (asc if suffix == ".asc" else trc).chunks(path, notes, progress)
