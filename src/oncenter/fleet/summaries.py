"""A drive's row of evidence, the input of its truck's model, as columns of the tables: degrees in files, rad inside."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from oncenter import _core
from oncenter.signals import DEGREE
from oncenter.truck.priors import PARAMS
from oncenter.truck.row import Row, modes_as_text, modes_in


@dataclass(frozen=True)
class _Column:
    """A column, and its member of a `Row`; `unit` is the column's unit in units of the member."""

    name: str
    member: str
    unit: float
    about: str
    may_lack: bool = False


_COLUMNS = (
    _Column("gradient_deg_m_s2", "gradient", DEGREE, "understeer gradient at the road wheel"),
    _Column("gradient_sd_deg_m_s2", "gradient_sd", DEGREE, "its standard deviation"),
    _Column("wheelbase_1", "wheelbase", 1.0, "share by which the wheelbase that fits exceeds the vehicle file's", True),
    _Column("wheelbase_sd_1", "wheelbase_sd", 1.0, "its standard deviation", True),
    _Column("friction_m_s2", "friction", 1.0, "friction of the king pins"),
    _Column("creep_deg_s_m_s2", "creep", DEGREE, "creep of the wheels in their play; 0: the king pins hold them"),
    _Column("bank_m_s2", "bank", 1.0, "mean of lateral acceleration minus yaw rate times speed: road bank", True),
    _Column("bank_variance_m2_s4", "bank_variance", 1.0, "its variance, large for a short drive", True),
    _Column("standing_m_s2", "standing", 1.0, "mean lateral acceleration at standstill; null: no standstill", True),
    _Column("measured", "measured", 1.0, "1: an accelerometer measures the bank, 0: none does"),
    _Column("ratio", "ratio", 1.0, "steering ratio near the centre"),
    _Column("side", "side", 1.0, "side of traffic: 1 right, -1 left, 0 not given"),
    _Column("moved_deg", "moved", DEGREE, "change of the offset within the drive, which the evidence is after"),
    _Column("moved_sd_deg", "moved_sd", DEGREE, "its standard deviation; 0: no change"),
)
_SIDES = {"left_s": "side_force_left_s", "right_s": "side_force_right_s"}
_OF_TABLE = {"length_s": "duration_s", "used_s": "used_s", **_SIDES}
_PREFIX, _EVIDENCE, _PARAMS = "summary_", "summary_evidence", "summary_params"
COLUMNS: Mapping[str, tuple[str, str]] = {
    _EVIDENCE: (
        "text",
        "for the truck's model: up to four modes of offset, play, neutral acceleration, ten numbers each (SI, rad): "
        "level, information (lower triangle), vector",
    ),
    **{_PREFIX + column.name: ("number", f"for the truck's model: {column.about}") for column in _COLUMNS},
    _PARAMS: ("text", "for the truck's model: params of its priors that are not the defaults, NAME=VALUE; SI, rad"),
}


def columns_of(row: Row | None, params: Mapping[str, float]) -> dict[str, float | str | None]:
    """Columns of a drive; `params` are the core's. Empty without evidence; null instead of NaN."""
    if row is None or not len(row.modes):
        return {}
    values = {_PREFIX + column.name: getattr(row, column.member) / column.unit for column in _COLUMNS}
    found: dict[str, float | str | None] = {_EVIDENCE: modes_as_text(row.modes)}
    found |= {name: value if math.isfinite(value) else None for name, value in values.items()}
    defaults = _core.default_params()
    given = [f"{name}={params[name]!r}" for name in PARAMS if params[name] != defaults[name]]
    return found | {_PARAMS: " ".join(given) or None}


def params_of_drive(drive: Mapping[str, Any]) -> dict[str, float]:
    """The params of the truck's model when the drive was answered."""
    given = (each.partition("=") for each in (drive.get(_PARAMS) or "").split())
    return _core.default_params() | {name: float(value) for name, _, value in given}


def row_of_drive(drive: Mapping[str, Any]) -> Row | None:
    """The row; None where the drive adds nothing to its truck: no answer, no start time, a fault, no gradient, a drive
    that a former version answered."""
    values = {column.member: (drive.get(_PREFIX + column.name), column) for column in _COLUMNS}
    start = drive.get("start")
    lacks = any(value is None and not column.may_lack for value, column in values.values())
    if lacks or start is None or drive.get(_EVIDENCE) is None:
        return None
    of_row: dict[str, Any] = {
        name: math.nan if value is None else value * column.unit for name, (value, column) in values.items()
    }
    of_row |= {member: drive.get(name) or 0.0 for member, name in _OF_TABLE.items()}
    row = Row(
        **of_row | {"measured": bool(of_row["measured"])},
        modes=modes_in(drive[_EVIDENCE]),
        status=str(drive.get("offset_status")),
        logs=(drive["log"],) if drive.get("log") else (),
        start_s=start.timestamp() if isinstance(start, datetime) else start,
    )
    return row if row.is_usable else None
