"""Scenario files: everything a simulated drive is made of, each value under a name that says its unit.

The keys are explained in scenarios/thesis_drive.toml, where each has a value that goes with the others.
"""

from __future__ import annotations

import os
import tomllib
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator

from oncenter.errors import WRONG_USAGE, OncenterError

_Number = Annotated[float, Field(allow_inf_nan=False)]
_Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
_NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


def _in_order(interval: tuple[float, float]) -> tuple[float, float]:
    if interval[0] > interval[1]:
        raise ValueError(f"must be [low, high], got [{interval[0]:g}, {interval[1]:g}]")
    return interval


_PositiveRange = Annotated[tuple[_Positive, _Positive], AfterValidator(_in_order)]


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


class Road(_Section):
    crown_percent: Annotated[float, Field(ge=-15, le=15)]
    straight_length_m: _PositiveRange
    bend_radius_m: Annotated[tuple[float, float], Field(), AfterValidator(_in_order)]
    bend_angle_deg: _PositiveRange
    clothoid_length_m: _PositiveRange

    @model_validator(mode="after")
    def _can_be_steered(self) -> Road:
        if self.bend_radius_m[0] < 30:
            raise ValueError(f"'bend_radius_m' must be at least 30, got {self.bend_radius_m[0]:g}")
        if self.bend_angle_deg[1] > 180:
            raise ValueError(f"'bend_angle_deg' must be at most 180, got {self.bend_angle_deg[1]:g}")
        return self


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
    driver: Driver
    sensors: Sensors
    can: Can


def read_scenario(scenario: str | os.PathLike[str]) -> Scenario:
    """A scenario by the name it is shipped under, or from a TOML file.

    Raises:
        OncenterError: "scenario_file", exit code 2: there is none, it is no TOML, or a value is missing, unknown or
            impossible; the message names it.
    """
    file = _find(scenario)
    try:
        values = tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise _refusal(f"scenario file {file} cannot be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise _refusal(f"scenario file {file} is not TOML: {error}") from None
    return scenario_from({"name": file.stem, **values}, f"scenario {scenario}")


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
    key = ".".join(str(part) for part in first["loc"])
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
