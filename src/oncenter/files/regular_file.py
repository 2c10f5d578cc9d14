"""Opens regular files only: a named pipe or a device can block for ever or never end."""

from __future__ import annotations

import errno
import os
import stat
from io import FileIO

from oncenter.errors import LOG_CANNOT_BE_ANSWERED, OncenterError

_SPARSE_FROM = 64 << 20  # bytes; a smaller file is read soon
_WRITTEN_MIN = 0.01  # of a file; a log takes more, also where the file system packs it
_AnyPath = str | os.PathLike[str]

O_BINARY = getattr(os, "O_BINARY", 0)  # without it Windows converts line ends, and treats Ctrl-Z as end of file
O_NOFOLLOW = getattr(os, "O_NOFOLLOW", 0)  # a symbolic link is an error
O_NONBLOCK = getattr(os, "O_NONBLOCK", 0)  # opening a pipe without a partner returns at once


def open_regular_file(path: _AnyPath) -> FileIO:
    """Opens a regular file, unbuffered, for reading.

    The type is checked before opening, because opening a device can have side effects, and after opening, because the
    file may have been replaced in between.

    Raises:
        OSError: it is a directory, a device or a pipe, or cannot be opened; `strerror` says which.
        ValueError: the path holds a zero byte.
    """
    refuse_mode(os.stat(path).st_mode, "a file")
    file = FileIO(os.open(path, os.O_RDONLY | O_NONBLOCK | O_BINARY), "rb")
    try:
        refuse_mode(os.fstat(file.fileno()).st_mode, "a file")
    except OSError:
        file.close()
        raise
    return file


def read_regular_file(path: _AnyPath, bytes_max: int) -> bytes:
    """The whole content of a regular file of at most `bytes_max` bytes.

    Raises:
        OSError: as `open_regular_file`, or the file is larger.
        ValueError: the path holds a zero byte.
    """
    with open_regular_file(path) as file:
        content = bytearray()
        while len(content) <= bytes_max and (block := file.read(bytes_max + 1 - len(content))):
            content += block
    if len(content) > bytes_max:
        raise OSError(errno.EFBIG, f"is larger than {bytes_max} bytes")
    return bytes(content)


def refuse_what_is_no_regular_file(
    path: _AnyPath, what: str = "log", *, code: str = "unreadable_log", exit_code: int = LOG_CANNOT_BE_ANSWERED
) -> None:
    """Refuses a directory, a device, a pipe, or a path that does not exist, without opening it.

    Args:
        path: of the file.
        what: the expected kind of file for the message: "log", "DBC".
        code, exit_code: of the error.

    Raises:
        OncenterError: one line that names the path.
    """
    try:
        mode = os.stat(path).st_mode
    except (OSError, ValueError) as error:
        why = f"cannot read {os.fspath(path)}: {getattr(error, 'strerror', None) or error}"
        raise OncenterError(why, code=code, exit_code=exit_code) from None
    try:
        refuse_mode(mode, f"a {what}")
    except OSError as error:
        raise OncenterError(f"{os.fspath(path)} {error.strerror}", code=code, exit_code=exit_code) from None


def refuse_mode(mode: int, wanted: str) -> None:
    """
    Raises:
        OSError: the mode is not of a regular file; `strerror` says of what, and that it is not `wanted`.
    """
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, f"is a directory, not {wanted}")
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "is a device or a pipe, not a file")


def refuse_sparse(name: str, status: os.stat_result) -> None:
    """Refuses a large file of which almost nothing was written: reading its zeros takes minutes, and finds no signal.

    Args:
        name: for the message.
        status: of the file.

    Raises:
        OncenterError: "unreadable_log".
    """
    written = 512 * getattr(status, "st_blocks", status.st_size)  # Windows does not state it
    if status.st_size > _SPARSE_FROM and written < _WRITTEN_MIN * status.st_size:
        raise OncenterError(
            f"cannot read {name}: only {written} of its {status.st_size} bytes were written, the rest is a hole; copy "
            "it again",
            code="unreadable_log",
        )
