"""Begin of a drive's log."""

from __future__ import annotations

import os
import time

from oncenter.signals import Signals
from oncenter.utc import EPOCH_S

_LAST_S = 2.5e11  # year 9892; a file system can have any time


def start_in_log(drive: Signals) -> float | None:
    """s since 1970: by the log's own time stamps, or by a table's `start_time`; None where it has neither."""
    first = float(drive.columns["time_s"][0])
    return first if EPOCH_S < first < _LAST_S else drive.start_s


def start_of_drive(drive: Signals, path: str | os.PathLike[str] | None = None) -> float:
    """The `start_in_log`, else the file's last change less the drive's length; the present time without a file."""
    start = start_in_log(drive)
    if start is None:
        first, last = float(drive.columns["time_s"][0]), float(drive.columns["time_s"][-1])
        try:
            written = time.time() if path is None else os.stat(path).st_mtime
        except (OSError, ValueError):
            written = time.time()
        start = written - (last - first)
    return min(max(start, 0.0), _LAST_S)
