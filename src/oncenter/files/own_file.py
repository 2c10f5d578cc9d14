"""Files that oncenter writes and that are no logs: each says so inside, whatever its name."""

from __future__ import annotations

import codecs
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from oncenter.errors import OncenterError

NOT_A_LOG = "not_a_log"  # code of the error
KEY = "oncenter"  # of a Parquet file's metadata; the value is a key of `_CONTENTS`
HEAD_BYTES = 4096  # of a text file: its schema is among them

_CONTENTS = {
    "truth": "the true values of a simulated drive; the log is the other file of oncenter simulate",
    "angle": "the angle that oncenter angle estimated; its LOG is the log",
    "fleet": "a table of oncenter fleet; oncenter fleet query reads it",
}
# Columns by which a table is recognised that has lost its metadata, as every CSV file.
_SIGNATURES = (
    ("truth", {"place_in_play", "front_wheel_angle_rad"}),
    ("angle", {"standard_deviation_deg", "estimate_deg", "status"}),
    ("angle", {"standard_deviation_rad", "estimate_rad", "status"}),
    ("fleet", {"truck", "log", "start_source"}),
    ("fleet", {"truck", "rank", "verdict"}),
    ("fleet", {"truck", "quantity", "by_drive"}),
)
_SCHEMA = re.compile(r'(?:\s|#[^\n]*\n)*\{?\s*"?schema"?\s*[:=]\s*"(oncenter/([a-z]+)-\d+)"')
_OF_SCHEMA = {
    "truck": "the memory of a truck; it follows --memory",
    "truth": _CONTENTS["truth"],
    "offset": "an answer; oncenter compare takes it",
}
_VEHICLE = "# Vehicle file of oncenter"


def metadata(content: str) -> dict[str, str]:
    """The metadata of a Parquet file with this content, a key of `_CONTENTS`."""
    return {KEY: content}


def refuse_own_table(path: Path, columns: Sequence[str], stated: Mapping[str, str] | None = None) -> None:
    """
    Args:
        stated: metadata of a Parquet file.

    Raises:
        OncenterError: "not_a_log": oncenter wrote the table, by its metadata or its columns.
    """
    content = (stated or {}).get(KEY) or next((name for name, its in _SIGNATURES if its <= {*columns}), None)
    if content is not None:
        raise _not_a_log(path, _CONTENTS.get(content, content))


def refuse_own_text(path: Path, head: bytes) -> None:
    """
    Args:
        head: the first `HEAD_BYTES` of the file.

    Raises:
        OncenterError: "not_a_log": oncenter wrote this JSON or TOML.
    """
    text = _decoded(head)
    if text.startswith(_VEHICLE):
        raise _not_a_log(path, "a vehicle file; it follows --vehicle")
    found = _SCHEMA.match(text)
    if found is not None:
        raise _not_a_log(path, _OF_SCHEMA.get(found[2], f"a result of oncenter ({found[1]})"))


def _decoded(head: bytes) -> str:
    """UTF-8, or UTF-16 as PowerShell's `>` writes it."""
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return head.decode("utf-16", "replace")
    return head.removeprefix(codecs.BOM_UTF8).decode("utf-8", "replace")


def _not_a_log(path: Path, what: str) -> OncenterError:
    return OncenterError(f"{path.name} is not a log: it holds {what}", code=NOT_A_LOG)
