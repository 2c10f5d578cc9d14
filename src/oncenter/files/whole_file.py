"""Writes a file atomically: completely or not at all.

The new content is written to a hidden file beside the path, flushed to the disk, and renamed to the path. After a full
disk, a kill or a power cut the path therefore holds the complete old or the complete new file. A kill may leave the
hidden file behind; `remove_unfinished` deletes such files in a folder that no other process writes to.

A symbolic link at the path is refused, not followed: in a shared folder it may be another user's, and lead to any file.

Windows does not rename over a file that is open in a program: the old file then stays, and the error says so.
"""

from __future__ import annotations

import os
import secrets
import shutil
import stat
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.regular_file import O_BINARY, O_NONBLOCK

UNFINISHED = ".unfinished-"  # prefix of hidden files
_TAIL = 32  # last characters of the name kept in the hidden file's name, because writers check the suffix
_STDOUT = 1
_RENAME_AGAIN_S = (0.02, 0.05, 0.1, 0.2, 0.4, 0.8)  # a virus scanner or indexer may keep a new file open briefly


def check_place(path: str | os.PathLike[str]) -> None:
    """Refuses a path that cannot be written, before a result is computed.

    Raises:
        OncenterError: "output", exit code 2.
    """
    try:
        there = _status(path)
        if there is not None:
            _check_existing(path, there)
        if there is None or stat.S_ISREG(there.st_mode):
            _check_folder(path)
    except (OSError, ValueError) as error:
        raise _refusal(path, error) from None


@contextmanager
def whole_file(path: str | os.PathLike[str], *, suffix: bool = True) -> Iterator[Path]:
    """Gives the path of a new empty file, whose content replaces the file at `path` when the block ends.

    If the block raises, the file at `path` stays unchanged. An existing file keeps its owner and mode. For a pipe with
    a reader, a character device or this process's standard output, the content is copied, since they cannot be
    replaced by a rename.

    Args:
        path: of the file to write.
        suffix: whether the given path ends in the suffix of `path`, by which a library chooses the format.

    Raises:
        OncenterError: "output", exit code 2: the file cannot be written; also for an OSError or PolarsError raised in
            the block.
    """
    check_place(path)
    try:
        there = _status(path)
        is_renamed_over = there is None or (stat.S_ISREG(there.st_mode) and not _is_stdout(there))
        with _beside(Path(path), suffix) if is_renamed_over else _copied_through(Path(path)) as unfinished:
            yield unfinished
    except Exception as error:
        import polars as pl  # late import: it takes longer than writing most files

        if isinstance(error, (OSError, pl.exceptions.PolarsError)):
            raise _refusal(path, error) from None
        raise


def write_whole(path: str | os.PathLike[str], content: bytes | str) -> None:
    """Writes a file as `whole_file` does, the unfinished one without suffix; text as UTF-8, with invalid characters
    escaped.

    Raises:
        OncenterError: "output", exit code 2: the file cannot be written.
    """
    with whole_file(path, suffix=False) as unfinished:
        unfinished.write_bytes(content.encode("utf-8", "backslashreplace") if isinstance(content, str) else content)


def remove_unfinished(folder: Path) -> None:
    """Deletes the remains of killed writers in a folder that no other process writes to."""
    for left in folder.glob(f"{UNFINISHED}*"):
        with suppress(OSError):  # harmless if it stays
            left.unlink()


def _refusal(path: str | os.PathLike[str], error: Exception | str) -> OncenterError:
    number = error.errno if isinstance(error, OSError) else None  # its text is shorter than that of some libraries
    text, *_ = " ".join(str(error).split()).split(" (os error ")  # polars appends the hidden file's name
    why = os.strerror(number) if number and not isinstance(error, _IsOpen) else text
    return OncenterError(f"cannot write {os.fspath(path)}: {why}", code="output", exit_code=WRONG_USAGE)


class _IsOpen(PermissionError):
    """A file that cannot be replaced because a program has it open, on Windows."""


def _status(path: str | os.PathLike[str]) -> os.stat_result | None:
    """None where nothing is. Of links only one to a device, a pipe or standard output is followed, as /dev/stdout, and
    only if it is this user's or the system's.

    Raises:
        OncenterError: another link.
    """
    try:
        own = os.lstat(path)
    except FileNotFoundError:
        return None
    if not stat.S_ISLNK(own.st_mode):
        return own
    target = os.path.realpath(path)
    with suppress(FileNotFoundError):
        there = os.stat(path)
        is_regular = stat.S_ISREG(there.st_mode) and not _is_stdout(there)
        if not is_regular and (sys.platform == "win32" or own.st_uid in (0, os.geteuid())):
            return there
    raise _refusal(path, f"it is a link; name the file to which it leads: {target}")


def _check_existing(path: str | os.PathLike[str], there: os.stat_result) -> None:
    if stat.S_ISDIR(there.st_mode):
        raise _refusal(path, "it is a folder; name a file")
    if not (stat.S_ISREG(there.st_mode) or stat.S_ISFIFO(there.st_mode) or stat.S_ISCHR(there.st_mode)):
        raise _refusal(path, "it is not a file, pipe or character device; name a file")
    if not os.access(path, os.W_OK):
        raise _refusal(path, "it is write-protected; name another file")


def _check_folder(path: str | os.PathLike[str]) -> None:
    folder = Path(path).parent
    if not folder.exists():
        raise _refusal(path, f"there is no folder {folder}")
    if not folder.is_dir():
        raise _refusal(path, f"{folder} is not a folder")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise _refusal(path, f"{folder} is write-protected; name a folder that you may write to")


@contextmanager
def _beside(target: Path, suffix: bool) -> Iterator[Path]:
    """A hidden file in the same folder, since a rename does not cross file systems."""
    tail = f"-{target.name[-_TAIL:]}" if suffix else ""
    unfinished = target.with_name(f"{UNFINISHED}{secrets.token_hex(4)}{tail}")
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | O_BINARY
    os.close(os.open(unfinished, flags, 0o666))  # its mode follows the umask
    try:
        mode = stat.S_IMODE(unfinished.stat().st_mode)
        yield unfinished
        _finish(unfinished, mode, _status(target))
        _rename(unfinished, target)
    except BaseException:  # also for an interrupt
        with suppress(OSError):
            unfinished.unlink()
        raise
    _sync_folder(target.parent)


def _finish(unfinished: Path, mode: int, replaced: os.stat_result | None) -> None:
    """Sets owner and mode and flushes the content before the rename: else a power cut may leave an empty file."""
    file = os.open(unfinished, os.O_RDWR | O_BINARY)
    try:
        if sys.platform != "win32":  # there a file inherits the rights of its folder
            if replaced is not None:
                mode = stat.S_IMODE(replaced.st_mode)
                with suppress(OSError):  # only root may change the owner
                    os.fchown(file, replaced.st_uid, replaced.st_gid)
            os.fchmod(file, mode)
        os.fsync(file)
    finally:
        os.close(file)


def _rename(unfinished: Path, target: Path) -> None:
    for again_s in _RENAME_AGAIN_S if sys.platform == "win32" else ():
        with suppress(PermissionError):
            os.replace(unfinished, target)
            return
        time.sleep(again_s)
    try:
        os.replace(unfinished, target)
    except PermissionError:
        if sys.platform == "win32":
            raise _IsOpen("another program has it open: close it there, or name another file") from None
        raise


def _sync_folder(folder: Path) -> None:
    """Makes the rename survive a power cut. Not possible on Windows, and not needed there."""
    if sys.platform == "win32":
        return
    try:
        file = os.open(folder, os.O_RDONLY)
    except PermissionError:  # a folder may be writable but not readable; the file is complete either way
        return
    try:
        os.fsync(file)
    finally:
        os.close(file)


def _is_stdout(there: os.stat_result) -> bool:
    try:
        # on Windows all devices have inode 0
        return there.st_ino != 0 and os.path.samestat(there, os.fstat(_STDOUT))
    except OSError:  # closed
        return False


@contextmanager
def _copied_through(special: Path) -> Iterator[Path]:
    with os.fdopen(_opened(special), "wb") as file, tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        unfinished = Path(folder) / f"{UNFINISHED}{special.name}"  # on Windows NUL is a device in any folder
        unfinished.touch()
        yield unfinished
        with unfinished.open("rb") as content:
            shutil.copyfileobj(content, file)


def _opened(special: Path) -> int:
    """Opens without waiting for a pipe's reader. Standard output is duplicated, so that later output follows."""
    if _is_stdout(special.stat()):
        return os.dup(_STDOUT)
    try:
        file = os.open(special, os.O_WRONLY | O_NONBLOCK | O_BINARY)
    except OSError as error:
        if stat.S_ISFIFO(special.stat().st_mode):
            raise _refusal(special, f"this pipe has no reader ({error.strerror})") from None
        raise
    if sys.platform != "win32":
        os.set_blocking(file, True)  # for a slow reader
    return file
