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
    """A column, and its member of a `Row`; `unit` is the column's unit in units of the member. Beyond `minimum` and
    `maximum` are numbers that no drive has: far from any truck, they keep the model's numbers finite."""

    name: str
    member: str
    unit: float
    about: str
    minimum: float
    maximum: float
    may_lack: bool = False


_TINY = 1e-12
_LONG_S = 1e8  # three years
COLUMNS = (
    Column("gradient_deg_m_s2", "gradient", DEGREE, "understeer gradient at the road wheel", -1e2, 1e2),
    Column("gradient_sd_deg_m_s2", "gradient_sd", DEGREE, "its standard deviation", _TINY, 1e3),
    Column(
        "wheelbase_1",
        "wheelbase",
        1.0,
        "share by which the wheelbase that fits exceeds the vehicle file's",
        -1e3,
        1e3,
        True,
    ),
    Column("wheelbase_sd_1", "wheelbase_sd", 1.0, "its standard deviation", _TINY, 1e3, True),
    Column("friction_m_s2", "friction", 1.0, "friction of the king pins", 0.0, 1e3),
    Column("creep_deg_s_m_s2", "creep", DEGREE, "creep of the wheels in their play; 0: the king pins hold", 0.0, 1e6),
    Column(
        "bank_m_s2", "bank", 1.0, "mean of lateral acceleration minus yaw rate times speed: road bank", -1e3, 1e3, True
    ),
    Column("bank_variance_m2_s4", "bank_variance", 1.0, "its variance, large for a short drive", 0.0, 1e6, True),
    Column(
        "standing_m_s2",
        "standing",
        1.0,
        "mean lateral acceleration at standstill; null: no standstill",
        -1e3,
        1e3,
        True,
    ),
    Column("measured", "measured", 1.0, "1: an accelerometer measures the bank, 0: none does", 0.0, 1.0),
    Column("ratio", "ratio", 1.0, "steering ratio near the centre", 1e-3, 1e3),
    Column("side", "side", 1.0, "side of traffic: 1 right, -1 left, 0 not given", -1.0, 1.0),
    Column(
        "moved_deg", "moved", DEGREE, "change of the offset within the drive, which the evidence is after", -1e3, 1e3
    ),
    Column("moved_sd_deg", "moved_sd", DEGREE, "its standard deviation; 0: no change", 0.0, 1e2),
    Column("duration_s", "length_s", 1.0, "duration of the drive", 0.0, _LONG_S),
    Column("used_s", "used_s", 1.0, "time used for the offset", 0.0, _LONG_S),
    Column("side_force_left_s", "left_s", 1.0, "time with lateral force clearly to the left", 0.0, _LONG_S),
    Column("side_force_right_s", "right_s", 1.0, "time with lateral force clearly to the right", 0.0, _LONG_S),
)
# Of each number of a mode, SI and rad. Its offset has an sd of 0.04 deg or more (joint_answer.offset_error), hence
# information below 2.1e6, and is below two turns, hence a level below 2e8. The filter overflows from 1e12 on.
_MODE_MAX = 1e9


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
        if not isinstance(value, int | float) or not column.minimum <= value <= column.maximum:
            raise ValueError(f"'{column.name}' must be a number that a drive has, got {value!r}")
        numbers[column.member] = value * column.unit
    numbers["measured"] = bool(numbers["measured"])
    return Row(modes=_modes_in(columns.get(EVIDENCE)), status=status, start_s=start_s, logs=logs, **numbers)


def _modes_in(text: object) -> Numbers:
    try:
        modes = np.array(str(text).split(), np.float64).reshape(-1, 10)
    except ValueError:
        modes = np.full((1, 10), math.nan)
    if len(modes) > MODES or not np.all(np.abs(modes) <= _MODE_MAX) or not _are_densities(modes):
        raise ValueError(f"'{EVIDENCE}' must have at most {MODES} modes of ten numbers that a drive has")
    return modes


def _are_densities(modes: Numbers) -> bool:
    """Whether the information of each mode is positive semidefinite, except for rounding."""
    row, column = np.tril_indices(3)
    information = np.zeros((len(modes), 3, 3))
    information[:, row, column] = information[:, column, row] = modes[:, 1:7]
    values = np.linalg.eigvalsh(information)
    return bool(np.all(values[:, 0] >= -1e-9 * values[:, 2]))
