"""Where logs are: folders and files of this machine, or an object store as `s3://bucket/folder`."""

from __future__ import annotations

import errno
import os
import re
import stat
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from io import FileIO
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from blake3 import blake3

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.extra import require_package
from oncenter.files.file_name import file_stem, printable_name
from oncenter.files.folder import OUTSIDE, files_below, is_log
from oncenter.files.regular_file import open_regular_file, refuse_sparse
from oncenter.files.whole_file import UNFINISHED
from oncenter.read.plugins import suffixes_of_plugins

if TYPE_CHECKING:
    from pyarrow.fs import FileInfo

STORE = "s3://"  # before bucket and key
NOT_A_FILE, UNREADABLE_FOLDER = "not_a_file", "unreadable_folder"  # error codes
_NOWHERE = (errno.ENOENT, errno.ENOTDIR, errno.ELOOP)  # the target of a link does not exist
# Before the path. A bucket's name has neither @ nor colon; a secret may contain a slash.
_CREDENTIALS = re.compile(r"[a-z][a-z0-9+.-]*://[^/?#]*[@:]", re.IGNORECASE)
_NAME_LENGTH = 60  # last characters of a key in the name of its copy; `file_stem` keeps the suffix of so short a name
_BLOCK_BYTES = 1 << 18
_KEY_BYTES = 16


@dataclass(frozen=True)
class LogFile:
    """One log. `uri` is a path (bytes that are no text are escaped by `os.fsdecode`), or `s3://bucket/key` with the key
    as it is: it may hold any character, so it is a name and no URI to be parsed. `options` open its store
    (`scheme=http&endpoint_override=…`); of a file of this machine they are empty, or `folder.OUTSIDE`. `known` are
    drives that it may be a copy of: key, truck, and whether their answers hold. `former` are the logs before this one
    in the same drive, where that is to be answered as a whole."""

    uri: str
    options: str
    size: int
    modified_s: float
    known: tuple[tuple[str, str, bool], ...] = ()
    former: tuple[LogFile, ...] = ()


def refuse_credentials(places: Sequence[str]) -> None:
    """Refuses a URI that contains a secret, since command lines are public, and does not repeat it.

    Raises:
        OncenterError: "credentials", exit code 2.
    """
    for number, place in enumerate(places, 1):
        if _CREDENTIALS.match(place):
            raise OncenterError(
                f"log {number} is a URI that contains credentials: set them as AWS_ACCESS_KEY_ID and "
                "AWS_SECRET_ACCESS_KEY in the environment, and name the place as s3://bucket/folder",
                code="credentials",
                exit_code=WRONG_USAGE,
            )


def find_logs(places: Sequence[str]) -> Iterator[LogFile]:
    """All logs below the folders, by their suffix, and all files named directly; one folder in memory at a time.

    The suffixes of installed reader plug-ins count as well; their formats that are folders do not. Entries with a
    log's name that are no files, and folders that cannot be listed, are among them: see `refuse_no_file`.

    Raises:
        OncenterError: "no_such_log", exit code 2: a place does not exist.
    """
    folders, suffixes = [], tuple(name.lower() for name in suffixes_of_plugins())
    for place in places:
        if place.startswith(STORE):
            yield from _in_store(place, suffixes)
        elif os.path.isdir(place):
            folders.append(place)
        else:
            try:
                os.lstat(place)
            except (OSError, ValueError) as error:
                raise _missing(place, getattr(error, "strerror", None) or str(error)) from None
            yield _local(place)
    yield from _in_folders(folders, suffixes)


def _local(path: str, *looks: Callable[[str], os.stat_result]) -> LogFile:
    """Size and time of last writing show later changes: the link's own if its target is missing, zero if unreadable."""
    for look in looks or (os.stat, os.lstat):
        with suppress(OSError):
            status = look(path)
            return LogFile(path, "", status.st_size, status.st_mtime)
    return LogFile(path, "", 0, 0.0)


def _missing(place: str, why: str | None) -> OncenterError:
    return OncenterError(
        f"no logs at {printable_name(place)}: {why}; name a file, a folder or s3://bucket/folder",
        code="no_such_log",
        exit_code=WRONG_USAGE,
    )


def _in_folders(folders: Sequence[str], suffixes: tuple[str, ...]) -> Iterator[LogFile]:
    """A folder that cannot be listed gets a row of its own."""
    for path, fault in files_below(folders):
        if fault == OUTSIDE:
            if _is_log(os.path.basename(path), suffixes) or os.path.isdir(path):
                yield replace(_local(path, os.lstat), options=OUTSIDE)
        elif fault or _is_log(os.path.basename(path), suffixes):
            yield _local(path)


def _is_log(name: str, suffixes: tuple[str, ...]) -> bool:
    """`suffixes` are those of plug-ins."""
    return is_log(name) or (name.lower().endswith(suffixes) and not name.startswith(UNFINISHED))


def refuse_no_file(log: LogFile) -> None:
    """Refuses an entry among the logs that is not a file, without opening it.

    Raises:
        OncenterError: "not_a_file": a pipe, a device, a socket, a link without a target or out of its folder, a path
            that is too long, or an object of which a part of the key is no name;
            "unreadable_folder": one that cannot be listed; "unreadable_log": it is gone, has no readable status, or is
            sparse.
    """
    name = printable_name(log.uri)
    if log.uri.startswith(STORE):
        if not {"", ".", ".."}.isdisjoint(log.uri.removeprefix(STORE).split("/")):
            raise OncenterError(
                f"{name} has a key with an empty part, . or .. between slashes, which names another object: rename it",
                code=NOT_A_FILE,
            )
        return
    try:
        status = os.stat(log.uri)
    except OSError as error:
        if error.errno in _NOWHERE and os.path.islink(log.uri):
            raise OncenterError(f"{name} is a link whose target does not exist", code=NOT_A_FILE) from None
        code = NOT_A_FILE if error.errno == errno.ENAMETOOLONG else "unreadable_log"
        raise OncenterError(f"cannot read {name}: {error.strerror}", code=code) from None
    mode = status.st_mode
    if log.options == OUTSIDE and (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        where = printable_name(os.path.realpath(log.uri))
        raise OncenterError(f"{name} is a link that leads out of its folder: name {where} as well", code=NOT_A_FILE)
    if stat.S_ISDIR(mode):
        raise OncenterError(f"cannot list the folder {name}{_why_not(log.uri)}", code=UNREADABLE_FOLDER)
    if not stat.S_ISREG(mode):
        raise OncenterError(f"{name} is a pipe, a socket or a device, not a file", code=NOT_A_FILE)
    refuse_sparse(name, status)


def _why_not(folder: str) -> str:
    try:
        os.scandir(folder).close()
    except OSError as error:
        return f": {error.strerror}"
    return " while logs were searched"


def _in_store(place: str, suffixes: tuple[str, ...]) -> Iterator[LogFile]:
    """A part of a key may be empty: pyarrow lists that folder under the name of the folder around it, and cannot open
    its objects. They get one row."""
    require_package("pyarrow", "s3://")
    from pyarrow.fs import FileSelector, FileType

    bare, _, options = place.partition("?")
    if "#" in place:
        raise _missing(bare, "write %23 in place of #, which ends a URI")
    try:
        files, path = _store(place)
        waiting = [path.rstrip("/")]
        first = files.get_file_info(waiting[0])
        if first.type == FileType.File:
            yield _stored(first, options)
            return
        if first.type == FileType.NotFound:
            raise _missing(bare, "there is no such bucket or folder")
        while waiting:
            folder = waiting.pop()
            for info in files.get_file_info(FileSelector(folder)):
                if info.type == FileType.Directory and info.path.rstrip("/") == folder:
                    yield LogFile(f"{STORE}{folder}//", options, 0, 0.0)
                elif info.type == FileType.Directory:
                    waiting.append(info.path)
                elif info.type == FileType.File and _is_log(info.base_name, suffixes):
                    yield _stored(info, options)
    except (OSError, ValueError) as error:
        raise _missing(bare, " ".join(str(error).split())) from None


def _stored(info: FileInfo, options: str) -> LogFile:
    modified_s = 0.0 if info.mtime is None else info.mtime.timestamp()
    return LogFile(f"{STORE}{info.path}", options, info.size or 0, modified_s)


def _store(uri: str) -> tuple[Any, str]:
    """The file system of a URI that the user gave, and the path in it; pyarrow takes credentials from AWS_* and its
    other sources."""
    from pyarrow.fs import FileSystem

    files, path = FileSystem.from_uri(uri)
    return files, path


@contextmanager
def at_hand(log: LogFile) -> Iterator[tuple[Path, str]]:
    """The log as a file of this machine while it is read, and the hash of its content.

    Raises:
        OncenterError: "unreadable_log": it cannot be read.
    """
    try:
        if log.uri.startswith(STORE):
            with _fetched(log) as fetched:
                yield fetched
        else:
            with open_regular_file(log.uri) as file:
                key = _key(_blocks(file))
            yield Path(log.uri), key
    except (OSError, ValueError) as error:  # of pyarrow also for a key, of this machine for a zero byte in a name
        why = getattr(error, "strerror", None) or " ".join(str(error).split())
        raise OncenterError(f"cannot read {printable_name(log.uri)}: {why}", code="unreadable_log") from None


@contextmanager
def _fetched(log: LogFile) -> Iterator[tuple[Path, str]]:
    """A copy with the log's name, whose suffix gives the format."""
    path = log.uri.removeprefix(STORE)
    files, _ = _store(f"{STORE}{quote(path.partition('/')[0], safe='')}?{log.options}")
    with tempfile.TemporaryDirectory(prefix="oncenter-", ignore_cleanup_errors=True) as folder:
        copy = Path(folder) / file_stem(path.rpartition("/")[2][-_NAME_LENGTH:])
        with files.open_input_stream(path) as source, copy.open("wb") as target:
            key = _key(_copied(source, target))
        yield copy, key


def _blocks(file: FileIO) -> Iterator[memoryview]:
    """The file's blocks in one buffer: a new buffer for each block takes longer than hashing."""
    place = memoryview(bytearray(_BLOCK_BYTES))
    while count := file.readinto(place):
        yield place[:count]


def _copied(source: Any, target: Any) -> Iterator[bytes]:
    while block := source.read(_BLOCK_BYTES):
        target.write(block)
        yield block


def _key(blocks: Iterator[bytes] | Iterator[memoryview]) -> str:
    """BLAKE3: hashlib's BLAKE2 takes as long for a log as reading it."""
    hashed = blake3()
    for block in blocks:
        hashed.update(block)
    return hashed.hexdigest(length=_KEY_BYTES)
