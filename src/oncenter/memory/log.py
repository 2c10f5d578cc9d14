"""Begin of a drive's log."""

from __future__ import annotations

import os
import time

from oncenter.signals import Signals
from oncenter.utc import LAST_S


def start_of_drive(drive: Signals, path: str | os.PathLike[str] | None = None) -> float:
    """`Signals.begin_s`, else the file's last change less the drive's length; the present time without a file."""
    start = drive.begin_s
    if start is None:
        first, last = float(drive.columns["time_s"][0]), float(drive.columns["time_s"][-1])
        try:
            written = time.time() if path is None else os.stat(path).st_mtime
        except (OSError, ValueError):
            written = time.time()
        start = written - (last - first)
    return min(max(start, 0.0), LAST_S)
