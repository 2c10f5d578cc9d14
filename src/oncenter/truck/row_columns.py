"""A drive's row of evidence as columns of a file: degrees in files, rad inside."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from oncenter.signals import DEGREE
from oncenter.truck.evidence import MODES, Numbers
from oncenter.truck.row import Row

EVIDENCE = "evidence"
ABOUT_EVIDENCE = (
    "up to four modes of offset, play, neutral acceleration, ten numbers each (SI, rad): level, information (lower "
    "triangle), vector"
)


@dataclass(frozen=True)
class Column:
    """A column, and its member of a `Row`; `unit` is the column's unit in units of the member, `least` its minimum."""

    name: str
    member: str
    unit: float
    about: str
    may_lack: bool = False
    least: float = -math.inf


_TINY = 1e-12
COLUMNS = (
    Column("gradient_deg_m_s2", "gradient", DEGREE, "understeer gradient at the road wheel"),
    Column("gradient_sd_deg_m_s2", "gradient_sd", DEGREE, "its standard deviation", least=_TINY),
    Column("wheelbase_1", "wheelbase", 1.0, "share by which the wheelbase that fits exceeds the vehicle file's", True),
    Column("wheelbase_sd_1", "wheelbase_sd", 1.0, "its standard deviation", True, _TINY),
    Column("friction_m_s2", "friction", 1.0, "friction of the king pins", least=0.0),
    Column("creep_deg_s_m_s2", "creep", DEGREE, "creep of the wheels in their play; 0: the king pins hold", least=0.0),
    Column("bank_m_s2", "bank", 1.0, "mean of lateral acceleration minus yaw rate times speed: road bank", True),
    Column("bank_variance_m2_s4", "bank_variance", 1.0, "its variance, large for a short drive", True, 0.0),
    Column("standing_m_s2", "standing", 1.0, "mean lateral acceleration at standstill; null: no standstill", True),
    Column("measured", "measured", 1.0, "1: an accelerometer measures the bank, 0: none does", least=0.0),
    Column("ratio", "ratio", 1.0, "steering ratio near the centre", least=_TINY),
    Column("side", "side", 1.0, "side of traffic: 1 right, -1 left, 0 not given", least=-1.0),
    Column("moved_deg", "moved", DEGREE, "change of the offset within the drive, which the evidence is after"),
    Column("moved_sd_deg", "moved_sd", DEGREE, "its standard deviation; 0: no change", least=0.0),
    Column("duration_s", "length_s", 1.0, "duration of the drive", least=0.0),
    Column("used_s", "used_s", 1.0, "time used for the offset", least=0.0),
    Column("side_force_left_s", "left_s", 1.0, "time with lateral force clearly to the left", least=0.0),
    Column("side_force_right_s", "right_s", 1.0, "time with lateral force clearly to the right", least=0.0),
)


def columns_of(row: Row) -> dict[str, float | str | None]:
    """None instead of NaN."""
    numbers = {column.name: float(getattr(row, column.member)) / column.unit for column in COLUMNS}
    found: dict[str, float | str | None] = {EVIDENCE: " ".join(f"{number:.12g}" for number in row.modes.ravel())}
    return found | {name: value if math.isfinite(value) else None for name, value in numbers.items()}


def row_in(columns: Mapping[str, Any], *, status: str, start_s: float, logs: tuple[str, ...]) -> Row:
    """
    Raises:
        ValueError: a column is missing, or has a value that no drive has; the text names it.
    """
    numbers: dict[str, Any] = {}
    for column in COLUMNS:
        value = columns.get(column.name)
        if value is None and column.may_lack:
            numbers[column.member] = math.nan
            continue
        if not isinstance(value, int | float) or not math.isfinite(value) or value < column.least:
            raise ValueError(f"'{column.name}' must be a number that a drive has, got {value!r}")
        numbers[column.member] = value * column.unit
    numbers["measured"] = bool(numbers["measured"])
    return Row(modes=_modes_in(columns.get(EVIDENCE)), status=status, start_s=start_s, logs=logs, **numbers)


def _modes_in(text: object) -> Numbers:
    try:
        modes = np.array(str(text).split(), np.float64).reshape(-1, 10)
    except ValueError:
        modes = np.full((1, 10), math.nan)
    if len(modes) > MODES or not np.all(np.isfinite(modes)):
        raise ValueError(f"'{EVIDENCE}' must have at most {MODES} modes of ten finite numbers")
    return modes
