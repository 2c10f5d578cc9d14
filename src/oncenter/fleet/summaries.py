"""A drive's row of evidence, the input of its truck's model, as columns of the tables: degrees in files, rad inside."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import Any

from oncenter import _core
from oncenter.truck.priors import PARAMS
from oncenter.truck.row import Row
from oncenter.truck.row_columns import ABOUT_EVIDENCE, EVIDENCE, row_in
from oncenter.truck.row_columns import COLUMNS as ROW
from oncenter.truck.row_columns import columns_of as of_row

_PREFIX, _PARAMS = "summary_", "summary_params"
_OF_TABLE = {"duration_s", "used_s", "side_force_left_s", "side_force_right_s"}  # the tables have them for themselves
_NAMES = {EVIDENCE: _PREFIX + EVIDENCE} | {
    column.name: column.name if column.name in _OF_TABLE else _PREFIX + column.name for column in ROW
}
COLUMNS: Mapping[str, tuple[str, str]] = {
    _PREFIX + EVIDENCE: ("text", f"for the truck's model: {ABOUT_EVIDENCE}"),
    **{_NAMES[c.name]: ("number", f"for the truck's model: {c.about}") for c in ROW if c.name not in _OF_TABLE},
    _PARAMS: ("text", "for the truck's model: params of its priors that are not the defaults, NAME=VALUE; SI, rad"),
}


def columns_of(row: Row | None, params: Mapping[str, float]) -> dict[str, float | str | None]:
    """Columns of a drive; `params` are the core's. Empty without evidence; null instead of NaN."""
    if row is None or not len(row.modes):
        return {}
    defaults = _core.default_params()
    given = [f"{name}={params[name]!r}" for name in PARAMS if params[name] != defaults[name]]
    values = {_NAMES[name]: value for name, value in of_row(row).items() if name not in _OF_TABLE}
    return values | {_PARAMS: " ".join(given) or None}


def params_of_drive(drive: Mapping[str, Any]) -> dict[str, float]:
    """The params of the truck's model when the drive was answered."""
    given = (each.partition("=") for each in (drive.get(_PARAMS) or "").split())
    return _core.default_params() | {name: float(value) for name, _, value in given}


def row_of_drive(drive: Mapping[str, Any]) -> Row | None:
    """The row; None where the drive adds nothing to its truck: no answer, no start time, a fault, a drive
    that a former version answered."""
    start = drive.get("start")
    if start is None or drive.get(_PREFIX + EVIDENCE) is None:
        return None
    try:
        row = row_in(
            {name: drive.get(of_drive) for name, of_drive in _NAMES.items()},
            status=str(drive.get("offset_status")),
            start_s=start.timestamp() if isinstance(start, datetime) else start,
            logs=(drive["log"],) if drive.get("log") else (),
        )
    except ValueError:
        return None
    return row if row.is_usable else None
