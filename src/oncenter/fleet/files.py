"""Where logs lie: folders and files of this machine, or of an object store as `s3://bucket/folder`."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from blake3 import blake3

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.read import SUFFIXES
from oncenter.whole_file import UNFINISHED

if TYPE_CHECKING:
    from pyarrow.fs import FileInfo

_NO_LOGS = (".truth.parquet",)  # what the simulator knows, beside its logs
_BLOCK_BYTES = 1 << 18
_KEY_BYTES = 16


@dataclass(frozen=True)
class LogFile:
    """One log. `uri` is a path, or `s3://bucket/key` whose `options` (`scheme=http&endpoint_override=…`) open it."""

    uri: str
    options: str
    size: int
    modified_s: float


def find_logs(places: Sequence[str]) -> Iterator[LogFile]:
    """All logs below folders, by their suffix, and all files that are named themselves; one folder in memory at a time.

    Raises:
        OncenterError: "no_such_log", exit code 2: a place does not exist or cannot be listed, or a log's name cannot
            stand in a table.
    """
    for place in places:
        if place.startswith("s3://"):
            yield from _in_store(place)
        elif os.path.isdir(place):
            yield from _in_folder(place)
        else:
            _refuse_bytes(place)
            yield _local(place, place)


def _is_log(name: str) -> bool:
    lower = name.lower()
    return lower.endswith(SUFFIXES) and not lower.endswith(_NO_LOGS) and not name.startswith(UNFINISHED)


def _local(path: str, place: str) -> LogFile:
    try:
        status = os.stat(path)
    except (OSError, ValueError) as error:
        raise _missing(place, getattr(error, "strerror", None) or str(error)) from None
    return LogFile(path, "", status.st_size, status.st_mtime)


def _refuse_bytes(path: str) -> None:
    """Ledger and tables hold text."""
    try:
        path.encode()
    except UnicodeEncodeError:
        name = path.encode(errors="backslashreplace").decode()
        raise OncenterError(
            f"the name of log {name} holds bytes that are no text: rename it", code="no_such_log", exit_code=WRONG_USAGE
        ) from None


def _missing(place: str, why: str | None) -> OncenterError:
    return OncenterError(
        f"no logs at {place}: {why}; a file, a folder or s3://bucket/folder would do",
        code="no_such_log",
        exit_code=WRONG_USAGE,
    )


def _in_folder(folder: str) -> Iterator[LogFile]:
    try:
        entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
    except OSError as error:
        raise _missing(folder, error.strerror) from None
    for entry in entries:
        if entry.is_dir():
            yield from _in_folder(entry.path)
        elif _is_log(entry.name):
            _refuse_bytes(entry.path)
            try:
                yield _local(entry.path, folder)
            except OncenterError:  # gone since, or a link to nothing
                continue


def _in_store(place: str) -> Iterator[LogFile]:
    from pyarrow.fs import FileSelector, FileType

    bare, _, options = place.partition("?")
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
            infos = files.get_file_info(FileSelector(waiting.pop()))
            waiting += [info.path for info in infos if info.type == FileType.Directory]
            for info in infos:
                if info.type == FileType.File and _is_log(info.base_name):
                    yield _stored(info, options)
    except OSError as error:
        raise _missing(bare, " ".join(str(error).split())) from None


def _stored(info: FileInfo, options: str) -> LogFile:
    modified_s = 0.0 if info.mtime is None else info.mtime.timestamp()
    return LogFile(f"s3://{info.path}", options, info.size or 0, modified_s)


def _store(uri: str) -> tuple[Any, str]:
    """The file system of a URI, and the path in it; credentials as pyarrow finds them, AWS_* among others."""
    from pyarrow import ArrowInvalid
    from pyarrow.fs import FileSystem

    try:
        files, path = FileSystem.from_uri(uri)
    except ArrowInvalid as error:
        raise _missing(uri, " ".join(str(error).split())) from None
    return files, path


@contextmanager
def at_hand(log: LogFile) -> Iterator[tuple[Path, str]]:
    """The log as a file of this machine, for as long as it is read, and the key of its content.

    Raises:
        OncenterError: "unreadable_log": it cannot be read.
    """
    try:
        if log.uri.startswith("s3://"):
            with _fetched(log) as fetched:
                yield fetched
        else:
            with open(log.uri, "rb", buffering=0) as file:
                key = _key(_blocks(file))
            yield Path(log.uri), key
    except OSError as error:
        why = error.strerror or " ".join(str(error).split())
        raise OncenterError(f"cannot read {log.uri}: {why}", code="unreadable_log") from None


@contextmanager
def _fetched(log: LogFile) -> Iterator[tuple[Path, str]]:
    """A copy that has the log's name, for its suffix says its format."""
    files, path = _store(f"{log.uri}?{log.options}" if log.options else log.uri)
    with tempfile.TemporaryDirectory(prefix="oncenter-") as folder:
        copy = Path(folder) / path.rpartition("/")[2]
        with files.open_input_stream(path) as source, copy.open("wb") as target:
            key = _key(_copied(source, target))
        yield copy, key


def _blocks(file: FileIO) -> Iterator[memoryview]:
    """All in one place of memory: a new one for each takes longer than the key."""
    place = memoryview(bytearray(_BLOCK_BYTES))
    while count := file.readinto(place):
        yield place[:count]


def _copied(source: Any, target: Any) -> Iterator[bytes]:
    while block := source.read(_BLOCK_BYTES):
        target.write(block)
        yield block


def _key(blocks: Iterator[bytes] | Iterator[memoryview]) -> str:
    """Not hashlib's BLAKE2, which takes as long for a log as reading it."""
    hashed = blake3()
    for block in blocks:
        hashed.update(block)
    return hashed.hexdigest(length=_KEY_BYTES)
