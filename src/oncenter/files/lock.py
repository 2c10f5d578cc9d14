"""An exclusive lock on a file, released when the file is closed or the process ends."""

from __future__ import annotations

import os
import sys

_LOCKED_BYTE = 1 << 30  # far beyond any content: on Windows others cannot read a locked byte


def take(file: int) -> bool:
    """Locks the open file; False if another process holds the lock.

    Raises:
        OSError: the file system has no locks.
    """
    if sys.platform == "win32":
        import msvcrt

        os.lseek(file, _LOCKED_BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
        except PermissionError:
            return False
        finally:
            os.lseek(file, 0, os.SEEK_SET)
    else:
        import fcntl

        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
    return True
