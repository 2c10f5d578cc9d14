"""The frames of a log of a bus, many at a time, whichever program wrote it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from oncenter.files.log_formats import MDF
from oncenter.read.frames import Frames, Wanted


def frames_of_log(
    path: Path,
    notes: list[str],
    tell: Callable[[float], None],
    wanted: Wanted | None = None,
    *,
    by_library: bool = True,
) -> Iterator[Frames]:
    """In this process, by whatever library reads that format.

    Args:
        path: of one of `log_formats.OF_FRAMES`.
        notes: get what is left out.
        tell: is told the fraction read.
        wanted: of an MF4 log only these are given; None: those that carry signals of J1939.

        by_library: whether python-can may read what our own code does not know of an .asc or .trc log.

    Raises:
        NeedsLibrary: it may not, and would be needed.
        OncenterError: it cannot be read, or is shorter than it says.
    """
    suffix = path.suffix.lower()
    if suffix == ".log":
        from oncenter.read import candump

        return candump.chunks(path, notes, tell)
    if suffix == ".blf":
        from oncenter.read import blf

        return blf.chunks(path, notes, tell)
    if suffix in MDF:
        from oncenter.read import mf4
        from oncenter.read.decode import wanted_by

        return iter((mf4.read(path, {}, wanted or wanted_by(()), notes, tell)[0].frames,))
    from oncenter.read import vector_peak

    return vector_peak.chunks(path, suffix, notes, tell, by_library=by_library)
