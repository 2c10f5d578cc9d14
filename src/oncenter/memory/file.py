"""A truck's memory as a TOML file, in degrees and dates."""

from __future__ import annotations

import os
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from oncenter.errors import OncenterError
from oncenter.files.file_name import printable
from oncenter.files.toml_file import read_toml, refusal
from oncenter.files.toml_text import entry
from oncenter.files.whole_file import write_whole
from oncenter.memory.truck import Load, PastDrive, Remembered, TruckMemory
from oncenter.signals import DEGREE
from oncenter.utc import iso

SCHEMA = "oncenter/truck-1"
_CODE = "memory_file"  # of errors
_HEAD = "# Estimates of oncenter for this truck: `oncenter offset --memory` reads and updates this file.\n"

_Value = Annotated[float, Field(allow_inf_nan=False)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _Play(_Table):
    value_deg: Annotated[_Value, Field(ge=0, le=34)]
    sd_deg: Annotated[_Value, Field(gt=0, le=34)]
    date: datetime

    def remembered(self) -> Remembered:
        return Remembered(self.value_deg * DEGREE, self.sd_deg * DEGREE, _seconds(self.date))


class _YawRateBias(_Table):
    value_deg_s: Annotated[_Value, Field(ge=-11, le=11)]
    sd_deg_s: Annotated[_Value, Field(gt=0, le=57)]
    date: datetime

    def remembered(self) -> Remembered:
        return Remembered(self.value_deg_s * DEGREE, self.sd_deg_s * DEGREE, _seconds(self.date))


class _Accelerometer(_Table):
    value_m_s2: Annotated[_Value, Field(ge=-0.9, le=0.9)]
    sd_m_s2: Annotated[_Value, Field(gt=0, le=10)]
    date: datetime

    def remembered(self) -> Remembered:
        return Remembered(self.value_m_s2, self.sd_m_s2, _seconds(self.date))


class _Wheelbase(_Table):
    value_m: Annotated[_Value, Field(ge=0.6, le=30)]
    sd_m: Annotated[_Value, Field(gt=0, le=10)]
    date: datetime

    def remembered(self) -> Remembered:
        return Remembered(self.value_m, self.sd_m, _seconds(self.date))


class _Product(_Table):
    value_m: Annotated[_Value, Field(ge=1, le=1200)]
    sd_m: Annotated[_Value, Field(gt=0, le=1200)]
    date: datetime

    def remembered(self) -> Remembered:
        return Remembered(self.value_m, self.sd_m, _seconds(self.date))


class _Gradient(_Table):
    value_deg_m_s2: Annotated[_Value, Field(ge=-5, le=5)]
    sd_deg_m_s2: Annotated[_Value, Field(gt=0, le=5)]
    date: datetime
    drives: Annotated[int, Field(ge=1, le=1_000_000_000)]

    def remembered(self) -> Remembered:
        return Remembered(self.value_deg_m_s2 * DEGREE, self.sd_deg_m_s2 * DEGREE, _seconds(self.date))


class _PastDrive(_Table):
    log: Annotated[str, Field(max_length=200)]
    date: datetime
    offset_deg: _Value | None = None
    offset_sd_deg: Annotated[_Value, Field(gt=0)] | None = None
    status: Annotated[str, Field(max_length=100)]

    def drive(self) -> PastDrive:
        return PastDrive(self.log, _seconds(self.date), _rad(self.offset_deg), _rad(self.offset_sd_deg), self.status)


class _File(_Table):
    schema_: Literal["oncenter/truck-1"] = Field(alias="schema")
    truck: str
    vin: Annotated[str, Field(max_length=200)] | None = None
    play: _Play | None = None
    yaw_rate_bias: _YawRateBias | None = None
    accelerometer_bias: _Accelerometer | None = None
    equivalent_wheelbase: _Wheelbase | None = None
    ratio_times_wheelbase: _Product | None = None
    understeer_gradient: list[_Gradient] = []
    drives: list[_PastDrive] = []


def read_memory(path: str | os.PathLike[str], truck: str) -> TruckMemory:
    """A truck's memory; empty where there is no file.

    Args:
        path: a TOML file of at most 1 MiB.
        truck: the vehicle file's name.

    Raises:
        OncenterError: "memory_file", exit code 2: unreadable, another schema, another truck, or a value out of range.
    """
    what, truck = f"memory file {os.fspath(path)}", printable(truck)
    if not Path(path).exists():
        return TruckMemory(truck)
    values = read_toml(path, what, code=_CODE)
    if values.get("schema") != SCHEMA:
        raise refusal(f"{what} has schema {values.get('schema')!r} instead of {SCHEMA!r}", _CODE)
    try:
        file = _File.model_validate(values)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        raise refusal(f"{what}: '{key}': {first['msg']}", _CODE) from None
    if file.truck != truck:
        raise refusal(
            f"{what} belongs to truck '{file.truck}', not to '{truck}': give this truck its own memory file", _CODE
        )
    return _memory_of(file, what)


def _memory_of(file: _File, what: str) -> TruckMemory:
    try:
        return TruckMemory(
            file.truck,
            None if file.play is None else file.play.remembered(),
            None if file.yaw_rate_bias is None else file.yaw_rate_bias.remembered(),
            None if file.accelerometer_bias is None else file.accelerometer_bias.remembered(),
            None if file.equivalent_wheelbase is None else file.equivalent_wheelbase.remembered(),
            tuple(Load(each.remembered(), each.drives) for each in file.understeer_gradient),
            tuple(each.drive() for each in file.drives),
            None if file.ratio_times_wheelbase is None else file.ratio_times_wheelbase.remembered(),
            file.vin,
        )
    except OverflowError as error:  # a date outside the calendar
        raise _noiso(what, error) from None


def _noiso(what: str, error: Exception) -> OncenterError:
    return refusal(f"{what} has an impossible date: {error}", _CODE)


def _seconds(date: datetime) -> float:
    return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()


def _rad(angle_deg: float | None) -> float | None:
    return None if angle_deg is None else angle_deg * DEGREE


def write_memory(path: str | os.PathLike[str], memory: TruckMemory) -> None:
    """Replaces the file as a whole, or leaves it unchanged.

    Raises:
        OncenterError: "output", exit code 2: it cannot be written.
    """
    write_whole(path, text_of(memory))


def text_of(memory: TruckMemory) -> str:
    return _HEAD + "\n".join(_lines(memory)) + "\n"


def _lines(memory: TruckMemory) -> Iterator[str]:
    yield entry("schema", SCHEMA)
    yield entry("truck", printable(memory.truck))
    if memory.vin is not None:
        yield entry("vin", printable(memory.vin))
    for name, remembered, unit, factor in (
        ("play", memory.play, "deg", DEGREE),
        ("yaw_rate_bias", memory.yaw_rate_bias, "deg_s", DEGREE),
        ("accelerometer_bias", memory.accelerometer_bias, "m_s2", 1.0),
        ("equivalent_wheelbase", memory.equivalent_wheelbase, "m", 1.0),
        ("ratio_times_wheelbase", memory.ratio_times_wheelbase, "m", 1.0),
    ):
        if remembered is not None:
            yield f"\n[{name}]"
            yield from _value_lines(remembered, unit, factor)
    for load in memory.loads:
        yield "\n[[understeer_gradient]]"
        yield from _value_lines(load.gradient, "deg_m_s2", DEGREE)
        yield entry("drives", load.drives)
    for drive in memory.drives:
        yield "\n[[drives]]"
        yield entry("log", printable(drive.key))
        yield f"date = {iso(drive.start_s)}"
        if drive.offset is not None and drive.offset_sd is not None:
            yield entry("offset_deg", _rounded(drive.offset / DEGREE))
            yield entry("offset_sd_deg", _rounded(drive.offset_sd / DEGREE))
        yield entry("status", printable(drive.status))


def _value_lines(remembered: Remembered, unit: str, factor: float) -> Iterator[str]:
    yield entry(f"value_{unit}", _rounded(remembered.value / factor))
    yield entry(f"sd_{unit}", _rounded(remembered.sd / factor))
    yield f"date = {iso(remembered.date_s)}"


def _rounded(value: Any) -> float:
    return float(f"{value:.6g}")
