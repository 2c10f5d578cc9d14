"""A truck's memory as a TOML file, in degrees and dates."""

from __future__ import annotations

import base64
import os
import zlib
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from oncenter.errors import OncenterError
from oncenter.files.file_name import printable
from oncenter.files.toml_file import read_toml, refusal
from oncenter.files.toml_text import entry
from oncenter.files.whole_file import write_whole
from oncenter.memory.truck import PastDrive, Remembered, TruckMemory
from oncenter.signals import DEGREE
from oncenter.truck.events import Event, event_of, with_stated
from oncenter.truck.row_columns import columns_of, row_in
from oncenter.utc import iso, utc

SCHEMA, _FORMER = "oncenter/truck-2", "oncenter/truck-1"
_CODE = "memory_file"  # of errors
_HEAD = "# Drives of this truck: `oncenter offset --memory` reads and updates this file.\n"

_IMAGE_MAX = 1 << 17  # bytes

_Text = Annotated[str, Field(max_length=1000)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _Product(_Table):
    value_m: Annotated[float, Field(ge=1, le=1200)]
    sd_m: Annotated[float, Field(gt=0, le=1200)]


class _Event(_Table):
    kind: _Text
    date: datetime
    by_deg: float | None = None

    def event(self) -> Event:
        """
        Raises:
            OncenterError: as `event_of`.
        """
        return event_of(self.kind, self.date.isoformat(), self.by_deg)


class _Drive(BaseModel):
    """Beside these keys a `[[drives]]` has the columns of `oncenter.truck.row_columns`."""

    model_config = ConfigDict(extra="allow", frozen=True)
    fingerprints: Annotated[list[_Text], Field(max_length=1000)]
    logs: Annotated[list[_Text], Field(max_length=1000)] = []
    settings: _Text
    date: datetime
    status: Annotated[str, Field(max_length=100)]
    core: Annotated[str, Field(max_length=100_000)] = ""

    def drive(self) -> PastDrive:
        """
        Raises:
            ValueError: a column is missing or out of range.
        """
        row = row_in(self.model_extra or {}, status=self.status, start_s=_seconds(self.date), logs=tuple(self.logs))
        return PastDrive(tuple(self.fingerprints), replace(row, image=_image_of(self.core)), self.settings)


class _File(_Table):
    schema_: Literal["oncenter/truck-2"] = Field(alias="schema")
    truck: str
    vin: Annotated[str, Field(max_length=200)] | None = None
    ratio_times_wheelbase: _Product | None = None
    events: list[_Event] = []
    drives: list[_Drive] = []


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
    if values.get("schema") == _FORMER:
        raise refusal(
            f"{what} is of a former version of oncenter, which kept estimates and no drives: name a new file, and give "
            "it the logs of the former drives again",
            _CODE,
        )
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
    try:
        product = file.ratio_times_wheelbase
        return TruckMemory(
            truck=file.truck,
            vin=file.vin,
            drives=tuple(each.drive() for each in file.drives),
            events=with_stated((), (each.event() for each in file.events)),
            ratio_times_wheelbase=None if product is None else Remembered(product.value_m, product.sd_m),
        )
    except (ValueError, OncenterError) as error:
        raise refusal(f"{what}: {error}", _CODE) from None
    except OverflowError as error:  # a date outside the calendar
        raise refusal(f"{what} has an impossible date: {error}", _CODE) from None


def _image_of(text: str) -> bytes:
    """
    Raises:
        ValueError: not base64 of compressed bytes.
    """
    try:
        return zlib.decompressobj().decompress(base64.b64decode(text, validate=True), _IMAGE_MAX)
    except (ValueError, zlib.error):
        raise ValueError(
            "'core' is damaged: delete its line, and a log soon after this drive counts as a drive"
        ) from None


def _seconds(date: datetime) -> float:
    return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()


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
    if memory.ratio_times_wheelbase is not None:
        yield "\n[ratio_times_wheelbase]"
        yield entry("value_m", _rounded(memory.ratio_times_wheelbase.value))
        yield entry("sd_m", _rounded(memory.ratio_times_wheelbase.sd))
    for event in memory.events:
        yield "\n[[events]]"
        yield entry("kind", event.kind)
        yield f"date = {iso(event.time_s)}"
        if event.by_rad is not None:
            yield entry("by_deg", _rounded(event.by_rad / DEGREE))
    for drive in memory.drives:
        yield "\n[[drives]]"
        yield from _drive_lines(drive)


def _drive_lines(drive: PastDrive) -> Iterator[str]:
    row = drive.row
    yield f"date = {utc(row.start_s).isoformat(timespec='milliseconds')}"
    yield entry("fingerprints", list(drive.key))
    yield entry("logs", [printable(log) for log in row.logs])
    yield entry("settings", printable(drive.settings))
    yield entry("status", printable(row.status))
    for name, value in columns_of(row).items():
        if value is not None:
            yield entry(name, _rounded(value) if isinstance(value, float) else value)
    if row.image:
        yield entry("core", base64.b64encode(zlib.compress(row.image)).decode())


def _rounded(value: Any) -> float:
    return float(f"{value:.6g}")
