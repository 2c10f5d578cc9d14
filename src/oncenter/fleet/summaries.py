"""A drive's summary, the input of its truck's model, as columns of a row: degrees in files, rad inside."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from oncenter.signals import DEGREE
from oncenter.truck.drives import Summary, is_usable


@dataclass(frozen=True)
class _Column:
    """A column of a row, and its member of a `Summary`; `unit` is the column's unit in units of the member."""

    name: str
    member: str
    unit: float
    about: str


_DEGREES = DEGREE
_COLUMNS = (
    _Column("offset_deg", "offset", _DEGREES, "the offset, as offset_deg, at the neutral lateral acceleration"),
    _Column("offset_sd_deg", "offset_sd", _DEGREES, "its standard deviation from this drive, without pull and wind"),
    _Column("gradient_deg_m_s2", "gradient", _DEGREES, "understeer gradient at the road wheel"),
    _Column("gradient_sd_deg_m_s2", "gradient_sd", _DEGREES, "its standard deviation"),
    _Column("unloading_m_s2", "unloading", 1.0, "neutral lateral acceleration, estimated or prior"),
    _Column("unloading_sd_m_s2", "unloading_sd", 1.0, "its standard deviation"),
    _Column("play_deg", "play", _DEGREES, "free play, column wind-up included, full width"),
    _Column("play_sd_deg", "play_sd", _DEGREES, "its standard deviation"),
    _Column(
        "with_unloading_deg_m_s2",
        "with_unloading",
        _DEGREES,
        "covariance of offset and neutral acceleration",
    ),
    _Column("with_play_deg2", "with_play", _DEGREES**2, "covariance of the offset and the play"),
    _Column("bank_m_s2", "bank", 1.0, "mean of lateral acceleration minus yaw rate times speed: road bank"),
    _Column("standing_m_s2", "standing", 1.0, "mean lateral acceleration at standstill; null: no standstill"),
    _Column("ratio", "ratio", 1.0, "steering ratio near the centre"),
    _Column("side", "side", 1.0, "side of traffic: 1 right, -1 left, 0 not given"),
)
_PREFIX = "summary_"
_MAY_LACK = ("bank", "standing", "unloading", "unloading_sd", "with_unloading")

# Priors in force: values given in the vehicle file, 0 where it gives none, and the sd of pulls. Column, param of the
# core, unit, meaning.
_GIVEN = (
    (
        "known_pull_sd_m_s2",
        "known_pull_sd_m_s2",
        1.0,
        "sd of the pull in the vehicle file; 0: not given",
    ),
    (
        "known_bias_sd_m_s2",
        "known_accelerometer_bias_sd_m_s2",
        1.0,
        "sd of the bias there; 0: not given",
    ),
    ("known_play_deg", "known_play_rad", _DEGREES, "free play in the vehicle file"),
    ("known_play_sd_deg", "known_play_sd_rad", _DEGREES, "its standard deviation; 0: not given"),
    ("pull_sd_m_s2", "pull_sd_m_s2", 1.0, "prior sd of the pull where none is given: the default, or a fleet's"),
)
COLUMNS: Mapping[str, tuple[str, str]] = {
    _PREFIX + name: ("number", f"for the truck's model: {about}")
    for name, about in (
        *((column.name, column.about) for column in _COLUMNS),
        *((name, about) for name, _, _, about in _GIVEN),
    )
}


def columns_of(summary: Summary | None, params: Mapping[str, float]) -> dict[str, float | None]:
    """Columns of a drive's row; `params` are the core's. Empty without a summary; null instead of NaN."""
    if summary is None:
        return {}
    values = {column.name: getattr(summary, column.member) / column.unit for column in _COLUMNS}
    values |= {name: params[param] / unit for name, param, unit, _ in _GIVEN}
    return {_PREFIX + name: value if math.isfinite(value) else None for name, value in values.items()}


def priors_of_row(row: Mapping[str, Any]) -> dict[str, float]:
    """The params when the drive was answered, without those that its row lacks: one of a version before."""
    values = ((param, row.get(_PREFIX + name), unit) for name, param, unit, _ in _GIVEN)
    return {param: value * unit for param, value, unit in values if value is not None}


def summary_of_row(row: Mapping[str, Any]) -> Summary | None:
    """The summary; None where the drive adds nothing to its truck: no answer, no start time, a fault, no gradient, a
    row of a version before 0.2."""
    values = {column.member: row.get(_PREFIX + column.name) for column in _COLUMNS}
    numbers = {
        column.member: math.nan if (value := values[column.member]) is None else value * column.unit
        for column in _COLUMNS
    }
    is_whole = all(math.isfinite(number) for name, number in numbers.items() if name not in _MAY_LACK)
    usable = is_whole and is_usable(str(row.get("offset_status")), numbers["gradient"])
    return Summary(**numbers) if usable and row.get("start") is not None else None
