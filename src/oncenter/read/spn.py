"""Columns of a table with names of J1939 parameters, as decoders and loggers export them: "SPN 1807", "1807 - Steering
Wheel Angle [rad]", "VDC2.SteeringWheelAngle", "WheelBasedVehicleSpeed"."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from oncenter.errors import OncenterError
from oncenter.read import j1939
from oncenter.read.frames import Column
from oncenter.read.units import factors, unit_key
from oncenter.signals import STATUSES

_DIRECT = [
    (m, p)
    for m in j1939.MESSAGES.values()
    for p in m.parameters
    if p.signal is not None and not p.relative and p.signal not in STATUSES
]
_BY_SPN = {parameter.spn: (message, parameter) for message, parameter in _DIRECT}
_BY_NAME = {parameter.name.lower(): (message, parameter) for message, parameter in _DIRECT}
_SPN = re.compile(r"(?:^|[^a-z])spn[ _-]*(\d{2,6})(?!\d)|^(\d{2,6})[ _-]+[a-z]|[a-z][ _-](\d{2,6})$")
_UNIT = re.compile(r"\s*[\[(](?!spn)([^\])]{1,12})[\])]\s*$", re.IGNORECASE)
_MESSAGE = re.compile(f"^(?:{'|'.join(message.name.lower() for message in j1939.MESSAGES.values())})[._ :-]")
_OF_MANY = ("VDC2", "VP")  # messages whose parameters have names that other networks use as well
_COMPANIONS = 2  # parameters of such a message that show where the names are from
_BEYOND = 1.01  # times the largest code


@dataclass(frozen=True)
class Named:
    """A parameter that has a column's name.

    Attributes:
        is_certain: the name has its number or its message.
    """

    message: j1939.Message
    parameter: j1939.Parameter
    is_certain: bool

    @property
    def signal(self) -> str:
        return str(self.parameter.signal)

    @property
    def rank(self) -> int:
        """Behind names of [signals] and of oncenter."""
        return 2 + j1939.rank(self.signal, self.message.name)

    @property
    def highest_si(self) -> float:
        """Larger values are codes for error and not available."""
        highest = self.parameter.offset + self.parameter.scale * (self.parameter.largest_number + 0.5)
        return float(highest * factors(self.signal)[self.parameter.unit])

    @property
    def limit_si(self) -> float:
        """Beyond it no value is of this parameter in its unit."""
        codes = self.parameter.offset + self.parameter.scale * 2**self.parameter.bits
        limit = max(abs(codes), abs(self.parameter.offset)) * factors(self.signal)[self.parameter.unit]
        return float(limit * _BEYOND)


def parameters_in(columns: Sequence[str], units: Mapping[str, str]) -> list[tuple[str, str, float]]:
    """Column, signal and factor to SI of the columns with names of parameters. Without a unit they have J1939's, if the
    name is J1939's alone or other parameters of its message are beside it."""
    found = {column: named for column in columns if (named := parameter_of(column)) is not None}
    beside = [named.message.name for named in found.values()]
    given = []
    for column, named in found.items():
        in_name = _UNIT.search(column)
        written = units.get(column) or (in_name[1] if in_name else "")
        known = factors(named.signal)
        unit = unit_key(written, known) if written else named.parameter.unit
        is_alone = named.message.name in _OF_MANY and beside.count(named.message.name) < _COMPANIONS
        if unit is not None and (written or named.is_certain or not is_alone):
            given.append((column, named.signal, known[unit]))
    return given


def parameter_of(column: str) -> Named | None:
    """The parameter by its number, or by its name behind the message's or alone."""
    text = _UNIT.sub("", column).strip().lower()
    number = _SPN.search(text)
    spn = next((int(each) for each in number.groups() if each), 0) if number else 0
    name = re.sub(r"[\s_-]", "", re.sub(r"\(?spn[ _-]*\d+\)?|^\d+|\d+$", "", _MESSAGE.sub("", text)).rpartition(".")[2])
    if spn in _BY_SPN and ("spn" in text or name == _BY_SPN[spn][1].name.lower()):
        return Named(*_BY_SPN[spn], True)
    if name not in _BY_NAME:
        return None
    message, parameter = _BY_NAME[name]
    return Named(message, parameter, text.startswith(message.name.lower()))


def without_codes(path: Path, column: str, values: Column, named: Named) -> tuple[Column, int]:
    """A parameter's values without J1939's codes for error and not available, and their number.

    Raises:
        OncenterError: "unit_missing": the values are in another unit than J1939's.
    """
    if np.nanmax(np.abs(values), initial=0.0) > named.limit_si:
        raise OncenterError(
            f"column {column} of {path.name} has values beyond the range of SPN {named.parameter.spn} in "
            f"{named.parameter.unit}: give its unit in [signals]",
            code="unit_missing",
            needs=(named.signal,),
        )
    is_code = values > named.highest_si
    return np.where(is_code, np.nan, values), int(np.count_nonzero(is_code))
