"""The trucks' histories in the page: one compressed JSON object inside its HTML, so that the page is one file.

The page's script unpacks it at the first click on a truck.
"""

from __future__ import annotations

import base64
import gzip
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from oncenter.fleet.ranking import History
from oncenter.fleet.tables import OFFSET

# All drives of the page together: about 23 bytes each, so that the page of 10,000 trucks has 6 MB and can be mailed.
_DRIVES_MAX = 200_000
_DRIVES_OF_A_TRUCK_MIN = 20
_DIGITS = 3


class PageData:
    """Takes one truck after the other; only compressed bytes stay in memory.

    Args:
        trucks: how many there will be.

    Attributes:
        drives_of_a_truck: the newest drives that the page holds of each truck.
    """

    def __init__(self, trucks: int) -> None:
        self.drives_of_a_truck = max(_DRIVES_OF_A_TRUCK_MIN, _DRIVES_MAX // max(trucks, 1))
        self._bytes = io.BytesIO()
        self._compressed = gzip.GzipFile(fileobj=self._bytes, mode="wb", mtime=0)  # the same bytes for the same rows
        self._separator = "{"

    def add(self, of_truck: History, drives: Sequence[Mapping[str, Any]]) -> None:
        """One truck with its newest drives, see `drive_data`."""
        row = of_truck.truck
        data = {
            "now": _rounded(row.get(OFFSET.value)),
            "limit": row["limit_deg"],
            "all": row["drives"],
            "together": _together(row),
            "drives": drives,
            "changes": [_change(change) for change in of_truck.changes],
        }
        entry = json.dumps({row["truck"]: data}, allow_nan=False, separators=(",", ":"))
        self._compressed.write(f"{self._separator}{entry[1:-1]}".encode())
        self._separator = ","

    def text(self) -> str:
        """All of it, in letters that no HTML parser stops at (base64). Nothing can be added afterwards."""
        self._compressed.write(b"{}" if self._separator == "{" else b"}")
        self._compressed.close()
        return base64.b64encode(self._bytes.getvalue()).decode()


def _together(truck: Mapping[str, Any]) -> str:
    """Offset and pull from all drives, in words; empty where there is no offset."""
    if truck.get(OFFSET.value) is None:
        return ""
    offset, pull = (
        f"{number:+.{digits}f}".replace("-", "−")
        for number, digits in ((truck[OFFSET.value], 1), (truck["pull_m_s2"], 2))
    )
    words = (
        f"straight-ahead offset from all drives {offset}, {_interval(truck)} deg;"
        f" pull {pull} ± {1.96 * truck['pull_sd_m_s2']:.2f} m/s²"
    )
    return words + ("; drives at another load would narrow both" if truck["load_would_help"] else "")


def _interval(truck: Mapping[str, Any]) -> str:
    """The one that decides."""
    low, high = (f"{truck[f'offset_{end}_deg']:+.1f}".replace("-", "−") for end in ("low", "high"))
    return f"{low} to {high}"


def drive_data(folder: Path, row: dict[str, Any]) -> dict[str, Any]:
    """One drive's row for the page."""
    report = f"reports/{row['key']}.html"
    return {
        "start": _milliseconds(row.get("start")),
        "log": row["log"],
        "offset": _rounded(row.get(OFFSET.value)),
        "sd": _rounded(row.get(OFFSET.sd)),
        "status": row.get(OFFSET.status),
        "error": row.get("error"),
        "report": report if row["key"] and (folder / report).is_file() else None,
    }


def _change(change: dict[str, Any]) -> dict[str, Any]:
    times = {name: _milliseconds(change[name]) for name in ("after_drive", "by_drive")}
    numbers = {name: _rounded(change[name]) for name in ("before", "after", "size", "sd")}
    return {"quantity": change["quantity"], "unit": change["unit"], "cause": change["cause"], **times, **numbers}


def _milliseconds(time_s: float | None) -> int | None:
    return None if time_s is None else round(time_s * 1000.0)


def _rounded(number: float | None) -> float | None:
    return None if number is None else round(number, _DIGITS)
