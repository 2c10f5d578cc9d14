"""Scenario files: everything a simulated drive is made of, each value under a name that says its unit.

The keys are explained in scenarios/thesis_drive.toml, where each has a value that goes with the others, and in
scenarios/README.md. A file with a `base` says only what is different from that one.
"""

from __future__ import annotations

import os
import tomllib
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    ValidationError,
    model_validator,
)

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.signals import DEGREE

_Number = Annotated[float, Field(allow_inf_nan=False)]
_Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
_NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


def _in_order(interval: tuple[float, float]) -> tuple[float, float]:
    if interval[0] > interval[1]:
        raise ValueError(f"must be [low, high], got [{interval[0]:g}, {interval[1]:g}]")
    return interval


_PositiveRange = Annotated[tuple[_Positive, _Positive], AfterValidator(_in_order)]


_CrossSlope = Annotated[float, Field(ge=-15, le=15)]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Drive(_Section):
    duration_s: Annotated[float, Field(ge=1, le=36000)]
    standing_at_start_s: _NotNegative
    standing_at_end_s: _NotNegative

    @model_validator(mode="after")
    def _drives_at_all(self) -> Drive:
        if self.standing_at_start_s + self.standing_at_end_s >= self.duration_s:
            raise ValueError(f"'duration_s' must exceed the time standing, got {self.duration_s:g}")
        return self


class Truck(_Section):
    mass_kg: _Positive
    yaw_inertia_kg_m2: _Positive
    wheelbase_m: Annotated[float, Field(ge=1, le=20)]
    front_axle_distance_m: _Positive
    front_cornering_stiffness_n_rad: _Positive
    rear_cornering_stiffness_n_rad: _Positive
    relaxation_length_m: Annotated[float, Field(ge=0, le=5)]
    track_width_front_m: _Positive
    track_width_rear_m: _Positive

    @model_validator(mode="after")
    def _stands_on_both_axles(self) -> Truck:
        if self.front_axle_distance_m >= self.wheelbase_m:
            raise ValueError(f"'front_axle_distance_m' must be below the wheelbase, got {self.front_axle_distance_m:g}")
        return self


class Steering(_Section):
    steering_ratio: Annotated[float, Field(ge=1, le=60)]
    backlash_deg: Annotated[float, Field(ge=0, le=30)]
    king_pin_friction_n_m: _NotNegative
    trail_m: _NotNegative
    creep_deg_s_n_m: _NotNegative
    compliance_deg_kn_m: _NotNegative


class _Road(_Section):
    """What every road has."""

    heading_deg: Annotated[float, Field(ge=0, lt=360)] = 0.0
    rough_bank_sd_percent: Annotated[float, Field(ge=0, le=2)] = 0.0
    rough_bank_length_m: Annotated[float, Field(ge=5, le=1000)] = 40.0


class BendsRoad(_Road):
    """Straights and bends by chance, without end."""

    kind: Literal["bends"] = "bends"
    crown_percent: _CrossSlope
    superelevation_max_percent: Annotated[float, Field(ge=0, le=8)] | None = None
    straight_length_m: _PositiveRange
    bend_radius_m: Annotated[tuple[float, float], Field(), AfterValidator(_in_order)]
    bend_angle_deg: _PositiveRange
    bend_side: Literal["left", "right", "both"] = "both"
    clothoid_length_m: _PositiveRange

    @model_validator(mode="after")
    def _can_be_steered(self) -> BendsRoad:
        if self.bend_radius_m[0] < 15:
            raise ValueError(f"'bend_radius_m' must be at least 15, got {self.bend_radius_m[0]:g}")
        if self.bend_angle_deg[1] > 180:
            raise ValueError(f"'bend_angle_deg' must be at most 180, got {self.bend_angle_deg[1]:g}")
        return self


class RoadSection(_Section):
    length_m: _Positive
    turn_deg: Annotated[float, Field(ge=-360, le=360)] = 0.0
    cross_slope_percent: _CrossSlope | None = None
    speed_km_h: _Positive | None = None


class SectionsRoad(_Road):
    """Straights and bends one after the other as given, once or again and again."""

    kind: Literal["sections"]
    crown_percent: _CrossSlope
    clothoid_length_m: _Positive
    repeat: bool
    sections: Annotated[tuple[RoadSection, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _can_be_steered(self) -> SectionsRoad:
        for number, section in enumerate(self.sections, start=1):
            if section.length_m < 2.0 * self.clothoid_length_m:
                raise ValueError(f"'sections' number {number} must be longer than both its clothoids together")
            radius_m = (section.length_m - self.clothoid_length_m) / max(abs(section.turn_deg) * DEGREE, 1e-9)
            if radius_m < 10:
                raise ValueError(f"'sections' number {number} must not bend closer than 10 m, got {radius_m:.1f} m")
        return self


class CsvRoad(_Road):
    """As measured: a CSV file with station_m, curvature_1_m, cross_slope_1 and speed_m_s."""

    kind: Literal["csv"]
    file: Path


class OpenRoad(_Road):
    """Open ground without lanes, for a machine that steers."""

    kind: Literal["open"]
    crown_percent: _CrossSlope


_ROAD_KINDS = ("bends", "sections", "csv", "open")
_KINDS = {*_ROAD_KINDS, "profile", "ramp", "weave"}  # no keys of a file, but parts of pydantic's locations


def _kind_of_road(values: Any) -> str:
    return str(values.get("kind", "bends") if isinstance(values, dict) else getattr(values, "kind", "bends"))


Road = Annotated[
    Annotated[BendsRoad, Tag("bends")]
    | Annotated[SectionsRoad, Tag("sections")]
    | Annotated[CsvRoad, Tag("csv")]
    | Annotated[OpenRoad, Tag("open")],
    Discriminator(
        _kind_of_road,
        custom_error_type="value_error",
        custom_error_message=f"'kind' must be one of {', '.join(_ROAD_KINDS)}",
    ),
]


class Stops(_Section):
    """Where the road makes the truck stop and stand."""

    spacing_m: _PositiveRange
    duration_s: _PositiveRange


class Wind(_Section):
    """Blows over open land; its force acts in front of the centre of gravity."""

    mean_m_s: Annotated[float, Field(ge=0, le=30)]
    from_deg: Annotated[float, Field(ge=0, lt=360)]
    gust_sd_m_s: Annotated[float, Field(ge=0, le=10)]
    gust_time_s: _Positive
    side_area_m2: _Positive
    side_force_coefficient: Annotated[float, Field(gt=0, le=3)]
    force_arm_m: Annotated[float, Field(ge=-10, le=10)]


_MachineAngle = Annotated[float, Field(ge=-1000, le=1000)]


class ProfileManoeuvre(_Section):
    """Steering wheel angles at given times, straight lines between them."""

    kind: Literal["profile"]
    time_s: Annotated[tuple[_NotNegative, ...], Field(min_length=2)]
    angle_deg: tuple[_MachineAngle, ...]

    @model_validator(mode="after")
    def _is_a_course(self) -> ProfileManoeuvre:
        if len(self.angle_deg) != len(self.time_s):
            raise ValueError(f"'angle_deg' must be as many as 'time_s', got {len(self.angle_deg)}")
        if any(after <= before for before, after in pairwise(self.time_s)):
            raise ValueError("'time_s' must ascend")
        return self


class RampManoeuvre(_Section):
    """From zero to one angle, held, and on to another, both at one rate: Figure 12; a step steer when from zero."""

    kind: Literal["ramp"]
    begin_s: _NotNegative
    from_deg: _MachineAngle
    hold_s: _NotNegative
    to_deg: _MachineAngle
    rate_deg_s: Annotated[float, Field(gt=0, le=2000)]


class WeaveManoeuvre(_Section):
    """Sines, one frequency after the other."""

    kind: Literal["weave"]
    begin_s: _NotNegative
    amplitude_deg: Annotated[float, Field(gt=0, le=500)]
    frequency_hz: Annotated[tuple[Annotated[float, Field(gt=0, le=5)], ...], Field(min_length=1)]
    cycles: Annotated[int, Field(ge=1, le=1000)]
    pause_s: _NotNegative


Manoeuvre = Annotated[ProfileManoeuvre | RampManoeuvre | WeaveManoeuvre, Field(discriminator="kind")]


class Driver(_Section):
    speed_km_h: Annotated[tuple[_Positive, Annotated[float, Field(le=150)]], AfterValidator(_in_order)]
    speed_section_length_m: _PositiveRange
    bend_lateral_acceleration_max_m_s2: Annotated[float, Field(gt=0, le=4)]
    acceleration_max_m_s2: Annotated[float, Field(gt=0, le=5)]
    deceleration_max_m_s2: Annotated[float, Field(gt=0, le=8)]
    preview_time_s: Annotated[float, Field(ge=0.5, le=10)]
    preview_gain: Annotated[float, Field(gt=0, le=2)]
    trim_time_s: _Positive
    reaction_time_s: Annotated[float, Field(ge=0, le=1)]
    arm_frequency_rad_s: Annotated[float, Field(ge=1, le=100)]
    lane_wander_sd_m: _NotNegative
    lane_wander_time_s: _Positive
    hand_motion_sd_deg: _NotNegative
    hand_motion_time_s: _Positive


class SteeringWheelAngleSensor(_Section):
    offset_deg: _Number
    noise_sd_deg: _NotNegative
    resolution_deg: _NotNegative
    range_deg: _Positive


class YawRateSensor(_Section):
    bias_deg_s: _Number
    noise_sd_deg_s: _NotNegative
    resolution_deg_s: _NotNegative
    range_deg_s: _Positive


class Accelerometer(_Section):
    bias_m_s2: _Number
    noise_sd_m_s2: _NotNegative
    resolution_m_s2: _NotNegative
    range_m_s2: _Positive


class SpeedSensor(_Section):
    noise_sd_m_s: _NotNegative
    resolution_m_s: _NotNegative


class Sensors(_Section):
    steering_wheel_angle: SteeringWheelAngleSensor
    yaw_rate: YawRateSensor
    lateral_acceleration: Accelerometer
    longitudinal_acceleration: Accelerometer
    speed: SpeedSensor


class Can(_Section):
    jitter_sd_ms: Annotated[float, Field(ge=0, le=2)]


class Scenario(_Section):
    """A drive as a scenario file describes it: units as the names say, lateral quantities positive to the left."""

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
    sensors: Sensors
    can: Can

    @model_validator(mode="after")
    def _has_a_lane_or_a_machine(self) -> Scenario:
        if (self.manoeuvre is None) == (self.road.kind == "open"):
            raise ValueError("'manoeuvre' goes with 'road.kind' = \"open\", and only with that")
        return self

    @model_validator(mode="after")
    def _speeds_are_the_driver_s(self) -> Scenario:
        fastest = self.driver.speed_km_h[1]
        for number, section in enumerate(getattr(self.road, "sections", ()), start=1):
            if section.speed_km_h is not None and section.speed_km_h > fastest:
                raise ValueError(
                    f"'road.sections' number {number} is faster than 'driver.speed_km_h': {section.speed_km_h:g}"
                )
        return self


def read_scenario(scenario: str | os.PathLike[str]) -> Scenario:
    """A scenario by the name it is shipped under, or from a TOML file.

    Raises:
        OncenterError: "scenario_file", exit code 2: there is none, it is no TOML, or a value is missing, unknown or
            impossible; the message names it.
    """
    file = _find(scenario)
    values = _values(file, ())
    return scenario_from({"name": file.stem, **values}, f"scenario {scenario}")


def _values(file: Path, heirs: tuple[Path, ...]) -> dict[str, Any]:
    """What the file says, on top of what its `base` says: a shipped scenario or a file beside it."""
    try:
        values = tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise _refusal(f"scenario file {file} cannot be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise _refusal(f"scenario file {file} is not TOML: {error}") from None
    if isinstance(road := values.get("road"), dict) and isinstance(road.get("file"), str):
        road["file"] = str(file.parent / road["file"])
    base = values.pop("base", None)
    if base is None:
        return values
    if not isinstance(base, str):
        raise _refusal(f"scenario file {file}: 'base' must be the name of a scenario, got {base!r}")
    heirs = (*heirs, file.resolve())
    beneath = _find(str(file.parent / base) if base.endswith(".toml") else base)
    if beneath.resolve() in heirs:
        raise _refusal(f"scenario file {file}: 'base' must not lead back to itself, got {base!r}")
    return _laid_over(_values(beneath, heirs), values)


def _laid_over(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    """Table by table and key by key; a table that names a kind of its own takes nothing from below."""
    result = dict(below)
    for key, value in above.items():
        beneath = result.get(key)
        both_tables = isinstance(value, dict) and isinstance(beneath, dict)
        result[key] = _laid_over(beneath, value) if both_tables and "kind" not in value else value
    return result


def scenario_from(values: dict[str, Any], origin: str) -> Scenario:
    """A scenario from a mapping as a scenario file holds it; raises as `read_scenario` does, naming `origin`."""
    try:
        return Scenario.model_validate(values)
    except ValidationError as error:
        raise _refusal(f"{origin}: {_first_error(error)}") from None


def _find(scenario: str | os.PathLike[str]) -> Path:
    shipped = _shipped()
    if isinstance(scenario, str) and scenario in shipped:
        return shipped[scenario]
    file = Path(scenario)
    if file.suffix == ".toml":
        return file
    raise _refusal(f"no scenario '{scenario}': give a .toml file or one of {', '.join(sorted(shipped))}")


def _shipped() -> dict[str, Path]:
    """By name. The package carries a link to the folder at the repository's root."""
    package = Path(__file__).parents[1]
    folder = next((f for f in (package / "scenarios", package.parents[1] / "scenarios") if f.is_dir()), None)
    return {} if folder is None else {file.stem: file for file in folder.glob("*.toml")}


def _first_error(error: ValidationError) -> str:
    """The first complaint in one line, by the key as the file has it."""
    first = error.errors()[0]
    key = ".".join(str(part) for part in first["loc"] if part not in _KINDS)
    if first["type"] == "missing":
        return f"'{key}' is missing"
    if first["type"] == "extra_forbidden":
        return f"'{key}' is not known"
    if first["type"] == "value_error":
        message = str(first["msg"]).removeprefix("Value error, ")
        return f"[{key}] {message}" if message.startswith("'") else f"'{key}' {message}"
    return f"'{key}': {first['msg']}, got {first['input']!r}"


def _refusal(message: str) -> OncenterError:
    return OncenterError(message, code="scenario_file", exit_code=WRONG_USAGE)
