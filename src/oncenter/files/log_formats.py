"""The formats of logs, a row each. Code, help texts and docs/formats.md take from here what they say about formats.

Imports no reader, so that the command line starts fast.
"""

from __future__ import annotations

import re
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal

READER = "oncenter.read.child"  # reads logs in a child process, as `python -m` starts it


@dataclass(frozen=True)
class Format:
    """One format of logs.

    Attributes:
        suffixes: of its files, in lower case; the first is the usual one. Formats may share a suffix: the first row is
            its usual format.
        origin: what writes it, for docs/formats.md.
        content: "frames", also with decoded "channels"; or what carries a signal's name.
        reader: "module:function". For "frames" it takes path, notes and progress, and yields `Frames`; for "frames and
            channels" as `mf4.read`; for others path, names and notes, and returns a list of `Samples`, for "columns"
            with the table's `Identity`.
        here: this process reads it, with this package's code and numpy; others a child process, which may crash.
        extra: the extra that reading needs.
        begins: the first bytes of each file; empty if they vary.
        line: found among the first lines of each text of this format, and of no other one; None for a binary format,
            and for a table.
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
    line: re.Pattern[bytes] | None = None
    writer: str = ""
    writer_needs: str = ""
    limits: str = ""


def _line(*kinds: bytes) -> re.Pattern[bytes]:
    """A line of one of these kinds."""
    return re.compile(rb"^[ \t]*(?:" + b"|".join(kinds) + b")", re.MULTILINE | re.IGNORECASE)


HEAD_BYTES = 1 << 14  # of a file, by which its format is recognised
_STAMP = rb"(?:\d+\.\d+|\d{4}-\d\d-\d\d \d\d:\d\d:\d\d\.\d+)"
_CANDUMP = _line(rb"\(" + _STAMP + rb"\)[ \t]+\S+[ \t]+(?:[RT]X[ \t].*[ \t])?[0-9a-f]{3,8}(?:#|[ \t]+\[)")
_ASC = _line(
    rb"base +(?:hex|dec)\b",
    rb"begin +triggerblock\b",
    rb"\d+\.\d+ +\d+ +\S+ +[RT]x +[dr]\b",
    rb"\d+\.\d+ +CANFD +\d+ +[RT]x ",
)
_TRC = _line(rb";\$FILEVERSION=", rb"\d+\) +\d+\.?\d* +(?:\d +)?(?:[RT]x +)?[0-9a-f]{4,8} ")
_BUSMASTER = _line(rb"-?\*\*\*BUSMASTER ", rb"\*\*\*<Time>", rb"\d+:\d+:\d+:\d+ +[RT]x +\d+ +(?:0x)?[0-9a-f]+ +[sx]r? ")
_CANHACKER = _line(rb"Time +ID +DLC +Data", rb"\d+[.,]\d{3} +[0-9a-f]{3,8} +[0-8](?: +[0-9a-f]{2})*[ \t]*$")
_VBO = _line(rb"File created on \d", rb"\[column names\]")
_CELL = rb"(?:[^\n]*[,;\t])?[ \"]*"  # cells before one
_END = rb"[ \"]*\r?(?:[,;\t\n]|$)"
_IDENTIFIER = (
    rb"(?:can|msg|message|frame|arbitration|arb)?[ _]?(?:id|identifier|addr|address)[ _(\[]*(?:hex|dec)?[)\]]*"
)
_DATA = (
    rb"(?:can|message|msg)?[ _]?(?:data|payload)[ _(\[]*(?:bytes|hex)?[)\]]*|(?:d|b|db|data|byte|data ?byte)[ _]?[01]"
)
_SIGNAL = rb"[^\n]*(?:steering_wheel_angle|yaw_rate|vehicle_speed|lateral_acceleration)_"
FRAME_TABLE = _line(
    rb"(?!" + _SIGNAL + rb")(?=" + _CELL + rb"(?:" + _IDENTIFIER + rb")" + _END + rb")"
    rb"(?=" + _CELL + rb"(?:" + _DATA + rb")" + _END + rb")[^\n]*[,;\t]"
)
_READ, _WRITE = "oncenter.read.", "oncenter.simulate.write."

FORMATS = (
    Format(
        (".log",), "candump", "frames", f"{_READ}candump:chunks", here=True,
        line=_CANDUMP, writer=f"{_WRITE}candump:write_candump",
    ),
    Format(
        (".asc",), "Vector", "frames", f"{_READ}asc:chunks", here=True,
        line=_ASC, writer=f"{_WRITE}python_can:write_asc", writer_needs="can",
    ),
    Format(
        (".blf",), "Vector", "frames", f"{_READ}blf:chunks", here=True,
        begins=(b"LOGG",), writer=f"{_WRITE}python_can:write_blf", writer_needs="can",
    ),
    Format(
        (".trc",), "PEAK", "frames", f"{_READ}trc:chunks", here=True,
        line=_TRC, writer=f"{_WRITE}python_can:write_trc", writer_needs="can",
    ),
    Format(
        (".log",), "BUSMASTER", "frames", f"{_READ}busmaster:chunks", here=True, line=_BUSMASTER,
        limits="J1939 messages of more than 8 bytes are not read",
    ),
    Format((".trc",), "CANHacker", "frames", f"{_READ}canhacker:chunks", here=True, line=_CANHACKER),
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
    Format(
        (".csv", ".txt"), "SavvyCAN, CANedge, CLX000, python-can, Cabana, Kvaser",
        "frames", f"{_READ}frame_table:chunks", line=FRAME_TABLE, limits="only with a header",
    ),
    Format((".vbo",), "Racelogic VBOX", "columns", f"{_READ}vbo:read", line=_VBO),
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


_TABLE = next(row for row in FORMATS if row.suffixes == (".csv",))


ANY_TEXT = ".txt"  # suffix of logs and of other texts: only the content decides


def suffixes(*contents: str) -> tuple[str, ...]:
    """The suffixes whose usual format has one of these contents; without arguments all."""
    usual = {suffix: row for row in reversed(FORMATS) for suffix in row.suffixes if suffix != ANY_TEXT}
    listed = dict.fromkeys(suffix for row in FORMATS for suffix in row.suffixes if suffix in usual)
    return tuple(suffix for suffix in listed if not contents or usual[suffix].content in contents)


SUFFIXES = suffixes()
OF_FRAMES = suffixes("frames", "frames and channels")
OF_TABLES = suffixes("columns")
OF_BAGS = suffixes("fields")
READ_HERE = tuple(suffix for row in FORMATS if row.here for suffix in row.suffixes)  # usually
DATABASES = (".dbc", ".kcd", ".sym", ".arxml")  # of CAN networks: beside a log
WRITTEN = tuple(row.suffixes[0] for row in FORMATS if row.writer)


def format_of(name: str) -> Format | None:
    """The usual format of files with this name; None for an unknown one."""
    return next((row for row in FORMATS if name.lower().endswith(row.suffixes)), None)


def recognised(head: bytes, name: str) -> Format | None:
    """The format of a file to which its content belongs: by its first bytes, then by a line of its text.

    Args:
        head: the first `HEAD_BYTES` of the file.
        name: of the file; it decides between formats to which the content belongs.
    """
    named = _named(name)
    in_order = [*named, *(row for row in FORMATS if row not in named)]
    begun = next((row for row in in_order if row.begins and head.startswith(row.begins)), None)
    if begun is not None:
        return begun
    text = as_utf_8(head)
    return next((row for row in in_order if row.line is not None and row.line.search(text)), None)


def format_of_content(head: bytes, name: str) -> Format | None:
    """The format of a file by its content, else by its name, else as a table if it has columns."""
    by_name = (row for row in _named(name) if ANY_TEXT not in row.suffixes)
    return recognised(head, name) or next(by_name, _TABLE if _has_columns(as_utf_8(head)) else None)


def _named(name: str) -> list[Format]:
    """The formats with a file's suffix, also behind that of a packed file."""
    names = name.lower(), re.sub(r"\.(?:gz|bz2|xz|zstd?|zip)$", "", name.lower())
    return [row for row in FORMATS if any(each.endswith(row.suffixes) for each in names)]


def as_utf_8(head: bytes) -> bytes:
    """The begin of a text, with line feeds."""
    encoding = utf_16(head)
    text = head.decode(encoding, "replace").encode() if encoding else head
    return text.removeprefix(BOM_UTF8).replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def utf_16(head: bytes) -> str:
    """The encoding of a text that begins so if it is UTF-16, with or without a byte order mark; else ""."""
    if head.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        return "utf-16"
    zeros = "".join("0" if byte == 0 else "1" for byte in head[:4])
    return {"1010": "utf-16-le", "0101": "utf-16-be"}.get(zeros, "")


def _has_columns(text: bytes) -> bool:
    """Whether a text begins with the names of columns and a row as long."""
    lines = [line for line in text.split(b"\n")[:20] if line.strip() and not line.startswith((b"#", b"sep="))]
    if len(lines) < 3 or b"\0" in text:
        return False
    mark = max((b",", b";", b"\t"), key=lines[0].count)
    counts = {line.count(mark) for line in lines[:3]}
    return len(counts) == 1 and counts != {0}


def imported(function: str) -> Callable[..., Any]:
    """A row's reader or writer; its module is imported only when a log needs it."""
    module, _, name = function.partition(":")
    found: Callable[..., Any] = getattr(import_module(module), name)
    return found
