"""The table that `oncenter offset` prints, as CSV: a row for each quantity."""

from __future__ import annotations

from typing import Any

from oncenter.fleet.listing import BYTE_ORDER_MARK, as_csv


def csv_of(said: dict[str, Any]) -> str:
    """Args: said: the JSON of the answer. The units are those of its column."""
    of_drive = {
        "truck": said["vehicle"],
        "log": said["log"],
        "start_time": said["start_time"],
        "verdict": said["verdicts"][0]["word"],
    }
    estimates = {name: each for name, each in said.items() if isinstance(each, dict) and "ci95" in each}
    rows = []
    for name, each in estimates.items():
        low, high = each["ci95"] or (None, None)
        numbers = {"value": each["value"], "ci95_low": low, "ci95_high": high}
        rows.append({**of_drive, "quantity": name, **numbers, "unit": each["unit"], "status": each["status"]})
    return BYTE_ORDER_MARK + as_csv(rows)
