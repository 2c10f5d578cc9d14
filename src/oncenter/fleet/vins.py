"""VINs in the logs of a truck: a drive of another VIN is named and counts for none."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

from oncenter.errors import OncenterError
from oncenter.files.file_name import printable
from oncenter.fleet.trucks import VIN
from oncenter.truck.events import ANOTHER_TRUCK, Event, is_former

Row = dict[str, Any]

_CODE = "different_trucks"
_OF_THE_LOG = (  # columns that a drive of another truck keeps
    *("log", "truck", "vehicle_file", "version", "key", "settings", "start", "start_source", "span_s", "vin"),
    "is_removed",
)


def refuse_other_vin(row: Row) -> None:
    """
    Raises:
        OncenterError: "different_trucks": the truck is named by a VIN, and the log has another one.
    """
    if row["vin"] is not None and row["vin"] != row["truck"] and VIN.fullmatch(row["truck"]):
        raise OncenterError(
            f"{row['log']} has VIN {row['vin']}, and its path names truck {row['truck']}: move it to its truck",
            code=_CODE,
        )


def without_other_vins(rows: list[Row], events: Sequence[Event]) -> list[Row]:
    """The rows of a truck, where drives whose VIN is not that of most of its drives are errors; all drives with a VIN,
    where two VINs are equally frequent. Drives of a former truck, before it was replaced, may have any VIN."""

    def is_named(row: Row) -> bool:
        has_vin = row.get("vin") is not None and row.get("error_code") is None
        return has_vin and not is_former(row.get("start"), events)

    count = Counter(row["vin"] for row in rows if is_named(row) and not row["is_removed"])
    return [_refused(row, count) if is_named(row) and _is_other(row["vin"], count) else row for row in rows]


def _is_other(vin: str, count: Counter[str]) -> bool:
    own = count[vin]
    return own > 0 and any(number >= own for other, number in count.items() if other != vin)


def _refused(row: Row, count: Counter[str]) -> Row:
    number, other = max((number, vin) for vin, number in count.items() if vin != row["vin"])
    truck, drives = row["truck"], "1 drive" if number == 1 else f"{number} drives"
    error = (
        f"{row['log']} has VIN {row['vin']}, and {drives} of truck {truck} VIN {other}: move the wrong logs to their "
        f"truck, or state when it was replaced: oncenter fleet event {truck} {ANOTHER_TRUCK} --date DATE"
    )
    return {name: row.get(name) for name in _OF_THE_LOG} | {"error_code": _CODE, "error": printable(error)}
