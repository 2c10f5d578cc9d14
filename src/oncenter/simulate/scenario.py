"""Scenario files: all parameters of a simulated drive. The name of each key contains its unit.

scenarios/thesis_drive.toml (a consistent set of values) and scenarios/README.md explain the keys. A file with a `base`
contains only the differences from that one.
"""

from __future__ import annotations

import math
import os
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

from pydantic import (
    Field,
    ValidationError,
    model_validator,
)

from oncenter.errors import OncenterError
from oncenter.files.shipped import shipped
from oncenter.files.toml_file import read_toml, refusal
from oncenter.simulate.road_sections import Driver, Manoeuvre, Road, Stops, Wind
from oncenter.simulate.section import NotNegative, Number, Section
from oncenter.simulate.sensor_sections import Can, Sensors, begins_s
from oncenter.simulate.truck_sections import Intervention, Steering, Truck

_CODE = "scenario_file"  # of errors
_BASES_MAX = 16  # files, each the `base` of the one before
_SHIFTING_S = 4.0  # standing, before and after driving backwards
_REVERSING_MIN_S = 20.0  # with both


class Drive(Section):
    duration_s: Annotated[Number, Field(ge=1, le=36000)]
    standing_at_start_s: NotNegative
    standing_at_end_s: NotNegative
    standing_s: tuple[tuple[NotNegative, NotNegative], ...] = ()
    reverse_s: tuple[tuple[NotNegative, NotNegative], ...] = ()  # [begin, end], standing at both
    reverse_speed_km_h: Annotated[Number, Field(ge=1, le=8)] = 6.0
    reverse_swing_m: Annotated[Number, Field(ge=0, le=1.5)] = 0.0  # to either side, each 30 m, as for a dock

    @property
    def all_standing_s(self) -> tuple[tuple[float, float], ...]:
        """Begin and end of each standstill: before the start, breaks, before and after backwards, after the end."""
        end_s = self.duration_s - self.standing_at_end_s
        before = [(begin, begin + _SHIFTING_S) for begin, _ in self.reverse_s]
        after = [(end - _SHIFTING_S, end) for _, end in self.reverse_s]
        breaks = sorted((*self.standing_s, *before, *after)) if before else self.standing_s
        return (-1.0, self.standing_at_start_s), *breaks, (end_s, math.inf)

    @model_validator(mode="after")
    def _drives_at_all(self) -> Drive:
        if self.standing_at_start_s + self.standing_at_end_s >= self.duration_s:
            raise ValueError(
                f"'duration_s' must be longer than the standstill at start and end, got {self.duration_s:g}"
            )
        if any(end - begin < _REVERSING_MIN_S for begin, end in self.reverse_s):
            raise ValueError(f"'reverse_s' must be [begin, end] pairs of at least {_REVERSING_MIN_S:g} s")
        if any(after <= before for before, after in pairwise(sum(self.all_standing_s, ()))):
            raise ValueError(
                "'standing_s' and 'reverse_s' must be [begin, end] pairs, ascending and apart, between the standstill "
                "at start and at end"
            )
        return self


class Scenario(Section):
    """A scenario file: the names contain the units, lateral quantities are positive to the left."""

    name: str
    about: str
    drive: Drive
    truck: Truck
    steering: Steering
    road: Road
    stops: Stops | None = None
    wind: Wind | None = None
    driver: Driver
    manoeuvre: Manoeuvre | None = None
    interventions: tuple[Intervention, ...] = ()
    sensors: Sensors = Sensors()
    can: Can

    @model_validator(mode="after")
    def _nothing_happens_to_sensors_after_the_drive(self) -> Scenario:
        for key, begin_s in begins_s(self.sensors, "sensors"):
            if begin_s >= self.drive.duration_s:
                raise ValueError(f"'{key}' must be below 'drive.duration_s', got {begin_s:g}")
        return self

    @model_validator(mode="after")
    def _lifts_its_axle_during_the_drive(self) -> Scenario:
        lifts_s = self.truck.lift_axle_up_s
        if lifts_s and lifts_s[-1][0] >= self.drive.duration_s:
            raise ValueError(f"'truck.lift_axle_up_s' must begin before 'drive.duration_s', got {lifts_s[-1][0]:g}")
        return self

    @model_validator(mode="after")
    def _reverses_alone_on_a_road(self) -> Scenario:
        if not self.drive.reverse_s:
            return self
        if self.manoeuvre is not None:
            raise ValueError("'drive.reverse_s' needs a driver, not a 'manoeuvre'")
        if self.truck.trailer is not None:
            raise ValueError("'drive.reverse_s' cannot be given with 'truck.trailer': it would jack-knife")
        return self

    @model_validator(mode="after")
    def _has_the_rear_axle_that_it_measures(self) -> Scenario:
        if self.sensors.rear_axle_angle is not None and self.truck.rear_steering is None:
            raise ValueError("'sensors.rear_axle_angle' needs 'truck.rear_steering'")
        return self

    @model_validator(mode="after")
    def _has_shelter_beside_a_road(self) -> Scenario:
        if self.wind is not None and self.wind.open_share < 1.0 and self.road.kind == "open":
            raise ValueError("'wind.open_share' must be 1 for 'road.kind' = \"open\"")
        return self

    @model_validator(mode="after")
    def _changes_its_load_in_a_standstill(self) -> Scenario:
        change = self.truck.load_change
        if change is None:
            return self
        stands = any(from_s <= change.begin_s <= until_s for from_s, until_s in self.drive.all_standing_s)
        if not stands or change.begin_s >= self.drive.duration_s:
            raise ValueError(
                "'truck.load_change.begin_s' must be within a standstill (see 'drive.standing_s'), "
                f"got {change.begin_s:g}"
            )
        return self

    @model_validator(mode="after")
    def _has_a_motor_that_carries_during_the_drive(self) -> Scenario:
        carries_s = self.steering.carries_s
        if carries_s and carries_s[-1][0] >= self.drive.duration_s:
            raise ValueError(
                f"'steering.overlay_motor.carries_s' must begin before 'drive.duration_s', got {carries_s[-1][0]:g}"
            )
        if carries_s and self.manoeuvre is not None:
            raise ValueError("'steering.overlay_motor.carries_s' needs a driver, not a 'manoeuvre'")
        return self

    @model_validator(mode="after")
    def _has_a_lane_or_a_machine(self) -> Scenario:
        if (self.manoeuvre is None) == (self.road.kind == "open"):
            raise ValueError("'manoeuvre' must be given exactly if 'road.kind' is \"open\"")
        return self

    @model_validator(mode="after")
    def _speeds_are_the_driver_s(self) -> Scenario:
        fastest = self.driver.speed_km_h[1]
        for number, section in enumerate(getattr(self.road, "sections", ()), start=1):
            if section.speed_km_h is not None and section.speed_km_h > fastest:
                raise ValueError(
                    f"'road.sections' number {number} is faster than the maximum of 'driver.speed_km_h': "
                    f"{section.speed_km_h:g}"
                )
        return self


def read_scenario(scenario: str | os.PathLike[str]) -> Scenario:
    """A shipped scenario by its name, or one from a TOML file.

    Raises:
        OncenterError: "scenario_file", exit code 2: it does not exist, is not TOML, or a value is missing, unknown or
            invalid; the message names it.
    """
    file = _find(scenario)
    values = _values(file, ())
    return scenario_from({"name": file.stem, **values}, f"scenario {scenario}")


def _values(file: Path, heirs: tuple[Path, ...]) -> dict[str, Any]:
    """The values of a file over those of its `base`, a shipped scenario or a file beside it."""
    values = read_toml(file, f"scenario file {file}", code=_CODE)
    if isinstance(road := values.get("road"), dict) and isinstance(road.get("file"), str):
        road["file"] = str(file.parent / road["file"])
    base = values.pop("base", None)
    if base is None:
        return values
    if not isinstance(base, str):
        raise _refusal(f"scenario file {file}: 'base' must be the name of a scenario, got {base!r}")
    heirs = (*heirs, file.resolve())
    if len(heirs) > _BASES_MAX:
        raise _refusal(f"scenario file {file}: more than {_BASES_MAX} files, each the 'base' of the one before")
    below = _find(str(file.parent / base) if base.endswith(".toml") else base)
    if below.resolve() in heirs:
        raise _refusal(f"scenario file {file}: 'base' {base!r} leads back to this file: remove one of the 'base' keys")
    return _merged(_values(below, heirs), values)


def _merged(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    """Merges table by table and key by key; a table of another kind replaces the one below."""
    result = dict(below)
    for key, value in above.items():
        beneath = result.get(key)
        result[key] = value
        if isinstance(value, dict) and isinstance(beneath, dict):
            kind = beneath.get("kind")
            if value.get("kind", kind) == kind:
                result[key] = _merged(beneath, value)
    return result


def scenario_from(values: dict[str, Any], origin: str) -> Scenario:
    """A scenario from the content of a scenario file; raises as `read_scenario`, naming `origin`."""
    try:
        return Scenario.model_validate(values)
    except ValidationError as error:
        raise _refusal(f"{origin}: {_first_error(error)}") from None


def _find(scenario: str | os.PathLike[str]) -> Path:
    by_name = _shipped()
    if isinstance(scenario, str) and scenario in by_name:
        return by_name[scenario]
    file = Path(scenario)
    if file.suffix == ".toml":
        return file
    raise _refusal(f"no scenario called '{scenario}': give a .toml file or one of {', '.join(sorted(by_name))}")


def _shipped() -> dict[str, Path]:
    """The shipped scenarios by name."""
    return {file.stem: file for file in shipped("scenarios").glob("*.toml")}


def _in_file(location: tuple[int | str, ...]) -> list[str]:
    """A location without the kind that pydantic inserts after a table with several kinds."""
    parts = [str(part) for part in location]
    return parts[:1] + parts[2:] if parts[:1] in (["road"], ["manoeuvre"]) else parts


def _first_error(error: ValidationError) -> str:
    """The first error in one line, with the key as in the file."""
    first = error.errors()[0]
    key = ".".join(_in_file(first["loc"]))
    if first["type"] == "missing":
        return f"'{key}' is missing"
    if first["type"] == "extra_forbidden":
        return f"'{key}' is not a key of a scenario file"
    if first["type"] == "road_kind":
        return f"[{key}] {first['msg']}"
    if first["type"] == "value_error":
        message = str(first["msg"]).removeprefix("Value error, ")
        if not message.startswith("'"):
            return f"'{key}' {message}"
        return f"[{key}] {message}" if key else message
    return f"'{key}': {first['msg']}, got {first['input']!r}"


def _refusal(message: str) -> OncenterError:
    return refusal(message, _CODE)
