"""What the page shows of one truck, as a small script beside it that is loaded when the truck is clicked."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.file_name import file_stem
from oncenter.files.whole_file import write_whole
from oncenter.fleet.ranking import History
from oncenter.fleet.tables import OFFSET

FOLDER = "trucks"
_DIGITS = 3


def script_name(truck: str) -> str:
    return f"{file_stem(truck)}.js"


def write_truck(folder: Path, of_truck: History, drives: Sequence[dict[str, Any]]) -> None:
    """`trucks/NAME.js` of an output folder, left as it is where it says the same already; `drives` by `drive_data`.

    Raises:
        OncenterError: "output", exit code 2: it cannot be written.
    """
    truck = str(of_truck.truck["truck"])
    data = {
        "truck": truck,
        "now": _rounded(of_truck.truck.get(OFFSET.value)),
        "together": _together(of_truck.truck),
        "drives": drives,
        "changes": [_change(change) for change in of_truck.changes],
    }
    # within a string of the page's language no text of a log can end the script
    text = f"show({json.dumps(data, ensure_ascii=True, allow_nan=False).replace('<', chr(92) + 'u003c')});\n"
    path = folder / FOLDER / script_name(truck)
    try:
        path.parent.mkdir(exist_ok=True)
        if path.is_file() and path.read_bytes() == text.encode():
            return
    except OSError as error:
        raise OncenterError(f"cannot write {path}: {error.strerror}", code="output", exit_code=WRONG_USAGE) from None
    write_whole(path, text)


def _together(truck: Mapping[str, Any]) -> str:
    """Offset and pull by all drives, in words; empty where there is no offset."""
    if truck.get(OFFSET.value) is None:
        return ""
    said = (
        f"straight-ahead offset {truck[OFFSET.value]:+.1f} ± {1.96 * truck[OFFSET.sd]:.1f} deg by all drives;"
        f" pull {truck['pull_m_s2']:+.2f} ± {1.96 * truck['pull_sd_m_s2']:.2f} m/s²"
    )
    return said + ("; drives at another load would narrow both" if truck["load_would_help"] else "")


def drive_data(folder: Path, row: dict[str, Any]) -> dict[str, Any]:
    """What the page shows of one drive's row."""
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
    times = {name: _milliseconds(change[name]) for name in ("after_drive", "by_drive", "found")}
    numbers = {name: _rounded(change[name]) for name in ("before", "after", "size", "sd")}
    return {"quantity": change["quantity"], "unit": change["unit"], "cause": change["cause"], **times, **numbers}


def _milliseconds(time_s: float | None) -> int | None:
    return None if time_s is None else round(time_s * 1000.0)


def _rounded(number: float | None) -> float | None:
    return None if number is None else round(number, _DIGITS)
