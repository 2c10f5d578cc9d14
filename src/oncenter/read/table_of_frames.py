"""Recognises a table whose rows are CAN frames: its values are bytes, so no column can be assigned to a signal."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from oncenter.errors import OncenterError
from oncenter.signals import SIGNALS

_IDENTIFIER = re.compile(r"(can|msg|message|frame|arbitration)?(id|identifier)(hex)?")
_DATA = re.compile(r"(can)?(data|payload)(bytes|hex)?")
_BYTE = re.compile(r"(d|b|db|data|byte|databyte)\d")
_BYTES_MIN = 4  # columns of single bytes


def refuse_frames(path: Path, columns: Sequence[str]) -> None:
    """
    Raises:
        OncenterError: "table_of_frames": the columns are an identifier and data bytes.
    """
    plain = {name: re.sub(r"[^a-z0-9]", "", name.lower()) for name in columns}
    identifier = next((name for name in columns if _IDENTIFIER.fullmatch(plain[name])), None)
    whole = [name for name in columns if _DATA.fullmatch(plain[name])]
    single = [name for name in columns if _BYTE.fullmatch(plain[name])]
    data = whole or (single if len(single) >= _BYTES_MIN else [])
    if identifier is None or not data or any(name.startswith(tuple(SIGNALS)) for name in columns):
        return
    how = "export the recording as .csv, .asc, .blf, .trc, .mf4 or .log (candump) with the program that wrote it"
    raise OncenterError(
        f"{path.name} is a table of CAN frames (columns {identifier!r} and {data[0]!r}), not of signals: {how}",
        code="table_of_frames",
    )
