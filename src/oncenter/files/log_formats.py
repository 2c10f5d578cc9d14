"""The formats of logs, a row each. Code, help texts and docs/formats.md take from here what they say about formats.

Imports no reader, so that the command line starts fast.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal

READER = "oncenter.read.child"  # reads logs in a child process, as `python -m` starts it


@dataclass(frozen=True)
class Format:
    """One format of logs.

    Attributes:
        suffixes: of its files, in lower case; the first is the usual one.
        origin: what writes it, for docs/formats.md.
        content: "frames", also with decoded "channels"; or what carries a signal's name.
        reader: "module:function". For "frames" it takes path, notes and progress, and yields `Frames`; for "frames and
            channels" as `mf4.read`; for others path, names and notes, and returns a list of `Samples`, for "columns"
            with the table's `Identity`.
        here: this process reads it, with this package's code and numpy; others a child process, which may crash.
        extra: the extra that reading needs.
        begins: the first bytes of each file; empty if they vary.
        writer: of `oncenter simulate`, "module:function"; takes `BusFrames`, or for "columns" the table, and a path.
        writer_needs: the package that the writer imports.
        limits: what is not read, in a short sentence.
    """

    suffixes: tuple[str, ...]
    origin: str
    content: Literal["frames", "frames and channels", "columns", "variables", "fields"]
    reader: str
    here: bool = False
    extra: str = ""
    begins: tuple[bytes, ...] = ()
    writer: str = ""
    writer_needs: str = ""
    limits: str = ""


_CANDUMP = re.compile(rb"\(\d+\.\d+\) \S+ [0-9A-Fa-f]{3,8}#")
_READ, _WRITE = "oncenter.read.", "oncenter.simulate.write."

FORMATS = (
    Format(
        (".log",), "candump", "frames", f"{_READ}candump:chunks", here=True,
        begins=(b"(",), writer=f"{_WRITE}candump:write_candump",
    ),
    Format(
        (".asc",), "Vector", "frames", f"{_READ}asc:chunks", here=True,
        begins=(b"date ",), writer=f"{_WRITE}python_can:write_asc", writer_needs="can",
    ),
    Format(
        (".blf",), "Vector", "frames", f"{_READ}blf:chunks", here=True,
        begins=(b"LOGG",), writer=f"{_WRITE}python_can:write_blf", writer_needs="can",
    ),
    Format(
        (".trc",), "PEAK", "frames", f"{_READ}trc:chunks", here=True,
        begins=(b";$FILEVERSION",), writer=f"{_WRITE}python_can:write_trc", writer_needs="can",
    ),
    Format(
        (".mf4", ".mdf", ".dat"), "ASAM MDF 3 and 4; INCA calls MDF 3 `.dat`", "frames and channels",
        f"{_READ}mf4:read", extra="mf4",
        begins=(b"MDF ", b"UnFinMF "), writer=f"{_WRITE}mf4:write_mf4", writer_needs="asammdf",
    ),
    Format((".csv",), "tables", "columns", f"{_READ}tabular:read_csv", writer=f"{_WRITE}tabular:write_csv"),
    Format(
        (".csv.gz",), "tables", "columns", f"{_READ}tabular:read_csv",
        begins=(b"\x1f\x8b",), writer=f"{_WRITE}tabular:write_csv_gz",
    ),
    Format(
        (".parquet",), "tables", "columns", f"{_READ}tabular:read_parquet",
        begins=(b"PAR1",), writer=f"{_WRITE}tabular:write_parquet",
    ),
    Format((".vbo",), "Racelogic VBOX", "columns", f"{_READ}vbo:read", begins=(b"File created on ",)),
    Format(
        (".mat",), "MATLAB, version 4 to 7.3", "variables", f"{_READ}mat:read", extra="mat", begins=(b"MATLAB ",),
        limits="objects are not read",
    ),
    Format((".bag",), "ROS 1, without ROS", "fields", f"{_READ}ros:read", extra="ros", begins=(b"#ROSBAG V2.0",)),
    Format(
        (".mcap",), "ROS 2, without ROS; also the folder of a bag", "fields", f"{_READ}ros:read", extra="ros",
        begins=(b"\x89MCAP0\r\n",),
    ),
    Format(
        (".db3",), "ROS 2, without ROS; also the folder of a bag", "fields", f"{_READ}ros:read", extra="ros",
        begins=(b"SQLite format 3\0",),
    ),
)  # fmt: skip


def suffixes(*contents: str) -> tuple[str, ...]:
    """The suffixes of formats with one of these contents; without arguments of all formats."""
    return tuple(suffix for row in FORMATS if not contents or row.content in contents for suffix in row.suffixes)


SUFFIXES = suffixes()
OF_FRAMES = suffixes("frames", "frames and channels")
OF_TABLES = suffixes("columns")
OF_BAGS = suffixes("fields")
READ_HERE = tuple(suffix for row in FORMATS if row.here for suffix in row.suffixes)
WRITTEN = tuple(row.suffixes[0] for row in FORMATS if row.writer)


def format_of(name: str) -> Format | None:
    """The format of a file's name; None for an unknown one."""
    return next((row for row in FORMATS if name.lower().endswith(row.suffixes)), None)


def format_of_content(head: bytes) -> Format | None:
    """The format of a file's first bytes, where they are of no other one; None for text of any kind."""
    if _CANDUMP.match(head):
        return FORMATS[0]
    certain = (row for row in FORMATS if row.suffixes[0] not in (".asc", ".vbo", ".csv.gz"))  # begin with words
    return next(
        (row for row in certain if any(len(begin) > 3 and head.startswith(begin) for begin in row.begins)), None
    )


def imported(function: str) -> Callable[..., Any]:
    """A row's reader or writer; its module is imported only when a log needs it."""
    module, _, name = function.partition(":")
    found: Callable[..., Any] = getattr(import_module(module), name)
    return found
