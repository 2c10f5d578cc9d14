"""Reads logs that need third-party libraries in a child process, and receives the result here.

The request is sent before this process imports anything heavy.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from oncenter.account import Account
from oncenter.files.child import ChildDied, Send, borrowed, limits_for
from oncenter.files.log_formats import READER
from oncenter.files.packed_names import packed_file
from oncenter.read.named import Named
from oncenter.signals import SignalName, Signals, Source

if TYPE_CHECKING:
    from oncenter.read.frames import Frames


def read_apart(
    path: Path,
    names: Mapping[str, SignalName],
    dbc: Sequence[str | os.PathLike[str]],
    take: Mapping[str, str],
    progress: Callable[[float], None],
    join: Sequence[Path] = (),
) -> Signals:
    """
    Args:
        join: other files of the same drive.

    Raises:
        OncenterError: as `oncenter.read`.
    """
    request = {
        "signals": os.fspath(path),
        "names": {signal: asdict(name) for signal, name in names.items()},
        "dbc": [os.fspath(file) for file in dbc],
        "take": dict(take),
        "join": [os.fspath(file) for file in join],
    }
    with borrowed(READER) as child, _named(path):
        answer = child.ask(request, limits_for(sum(map(_size, (path, *join, *dbc)))))
        import numpy  # noqa: F401 - it loads while the child reads

        for message in answer:
            if "progress" in message[0]:
                progress(message[0]["progress"])
    return _as_signals(*message)


def frames(path: Path, notes: list[str]) -> Generator[Frames, None, None]:
    """All frames of a log, many at a time. `notes` receives what was left out.

    Raises:
        OncenterError: as `oncenter.read`.
    """
    with unpacked(path) as file, borrowed(READER) as child, _named(path):
        for header, payload in child.ask({"frames": os.fspath(file)}, limits_for(_size(file))):
            notes += header.get("notes", ())
            if payload:
                yield _as_frames(header["count"], payload, is_long=header["is_long"])


def names_in(file: Path, kind: Literal["log", "database"]) -> list[Named]:
    """The columns of a log that is a table, or the signals of a database.

    Args:
        file: a regular file, or the folder of a bag.
        kind: what it is.

    Raises:
        OncenterError: as `oncenter.read`, for this file.
    """
    with unpacked(file) as whole, borrowed(READER) as child, _named(file):
        *_, (header, _) = child.ask({"names_in": os.fspath(whole), "kind": kind}, limits_for(_size(whole)))
    return [Named(**each) for each in header["names"]]


@contextlib.contextmanager
def unpacked(path: Path) -> Iterator[Path]:
    """The log itself; of a packed one a file of its name that holds it for a while, unpacked by the child.

    Raises:
        OncenterError: as `oncenter.read.packed.unpack`.
    """
    packed = packed_file(path)
    if packed is None:
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="oncenter-", ignore_cleanup_errors=True) as folder:
        request = {"unpack": os.fspath(packed[0]), "member": packed[1], "into": folder}
        with borrowed(READER) as child, _named(path):
            *_, (header, _) = child.ask(request, limits_for(_size(packed[0])))
        yield Path(header["log"])


def logs_of_archive(path: Path) -> list[str]:
    """The names of the logs in a ZIP archive, in order.

    Raises:
        OncenterError: as `oncenter.read.packed.logs_of_archive`.
    """
    with borrowed(READER) as child, _named(path):
        *_, (header, _) = child.ask({"logs_of": os.fspath(path)}, limits_for(_size(path)))
    return list(header["logs"])


@contextlib.contextmanager
def _named(path: Path) -> Iterator[None]:
    try:
        yield
    except ChildDied as died:
        raise died.of(path.name) from None


def _size(file: str | os.PathLike[str]) -> int:
    try:
        if os.path.isdir(file):
            return sum(
                os.stat(os.path.join(folder, name)).st_size for folder, _, names in os.walk(file) for name in names
            )
        return os.stat(file).st_size
    except (OSError, ValueError):  # the reader reports the error
        return 0


def sent(given: Signals, send: Send) -> None:
    """Sends signals as the last message."""
    import numpy as np

    header = {
        "columns": list(given.columns),
        "sources": {name: asdict(source) for name, source in given.sources.items()},
        "rate_hz": given.rate_hz,
        "log": given.log,
        "notes": given.notes,
        "vin": given.vin,
        "start_s": given.start_s,
        "account": None if given.account is None else given.account.to_dict(),
        "last": True,
    }
    send(header, *(np.ascontiguousarray(column, np.float64) for column in given.columns.values()))


def _as_signals(header: Mapping[str, Any], payload: bytes) -> Signals:
    import numpy as np

    names = header["columns"]
    columns = np.frombuffer(payload, np.float64).reshape(len(names), -1)
    return Signals(
        dict(zip(names, columns, strict=True)),
        {name: Source(**{**source, "others": tuple(source["others"])}) for name, source in header["sources"].items()},
        header["rate_hz"],
        header["log"],
        tuple(header["notes"]),
        header["vin"],
        header["start_s"],
        None if header["account"] is None else Account.of_dict(header["account"]),
    )


def sent_frames(given: Frames, send: Send) -> None:
    """Sends frames as one message."""
    import numpy as np

    from oncenter.read.frames import COLUMNS

    columns = [np.ascontiguousarray(getattr(given, name)) for name in COLUMNS]
    more = [] if given.more is None else [np.ascontiguousarray(given.more)]
    send({"count": len(given), "is_long": bool(more)}, *columns, *more)


_FRAME_TYPES = ("f8", "u4", "?", "u8", "u1", "u8")


def _as_frames(count: int, payload: bytes, *, is_long: bool) -> Frames:
    import numpy as np

    from oncenter.read.frames import MORE, Frames

    columns, start = [], 0
    for kind in (*map(np.dtype, _FRAME_TYPES), *((MORE,) if is_long else ())):
        columns.append(np.frombuffer(payload, kind, count, start))
        start += count * kind.itemsize
    return Frames(*columns)
