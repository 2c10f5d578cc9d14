"""The tables of a scenario file for road, stops, wind, driver and steering machine."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from oncenter.signals import DEGREE
from oncenter.simulate.section import (
    Length,
    LengthRange,
    NotNegative,
    Number,
    Positive,
    PositiveRange,
    Range,
    Section,
    Whole,
    in_order,
)

CrossSlope = Annotated[Number, Field(ge=-15, le=15)]


_LessStiffness = Annotated[Number, Field(ge=-80, le=0)]


class Patches(Section):
    """Wet or snowy patches, in which the tyres' cornering stiffness is lower."""

    spacing_m: LengthRange  # from the end of one to the begin of the next
    length_m: LengthRange
    front_stiffness_percent: _LessStiffness  # change of the steered tyres' cornering stiffness
    rear_stiffness_percent: _LessStiffness  # change for all other tyres, trailer included


class _Road(Section):
    """The keys common to all roads."""

    heading_deg: Annotated[Number, Field(ge=0, lt=360)] = 0.0
    rough_bank_sd_percent: Annotated[Number, Field(ge=0, le=2)] = 0.0
    rough_bank_length_m: Annotated[Number, Field(ge=5, le=1000)] = 40.0
    patches: Patches | None = None


class BendsRoad(_Road):
    """Random straights and bends, as long as the drive."""

    kind: Literal["bends"] = "bends"
    crown_percent: CrossSlope
    superelevation_max_percent: Annotated[Number, Field(ge=0, le=8)] | None = None
    straight_length_m: LengthRange
    bend_radius_m: Range
    bend_angle_deg: PositiveRange
    bend_side: Literal["left", "right", "both"] = "both"
    clothoid_length_m: PositiveRange

    @model_validator(mode="after")
    def _can_be_steered(self) -> BendsRoad:
        if self.bend_radius_m[0] < 15:
            raise ValueError(f"'bend_radius_m' must be at least 15, got {self.bend_radius_m[0]:g}")
        if self.bend_angle_deg[1] > 180:
            raise ValueError(f"'bend_angle_deg' must be at most 180, got {self.bend_angle_deg[1]:g}")
        return self


class RoadSection(Section):
    length_m: Length
    turn_deg: Annotated[Number, Field(ge=-360, le=360)] = 0.0
    cross_slope_percent: CrossSlope | None = None
    speed_km_h: Positive | None = None


class SectionsRoad(_Road):
    """Straights and bends one after the other as given, once or again and again."""

    kind: Literal["sections"]
    crown_percent: CrossSlope
    clothoid_length_m: Positive
    repeat: Annotated[bool, Field(strict=True)]
    sections: Annotated[tuple[RoadSection, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _can_be_steered(self) -> SectionsRoad:
        for number, section in enumerate(self.sections, start=1):
            if section.length_m < 2.0 * self.clothoid_length_m:
                raise ValueError(f"'sections' number {number} must be longer than its two clothoids together")
            radius_m = (section.length_m - self.clothoid_length_m) / max(abs(section.turn_deg) * DEGREE, 1e-9)
            if radius_m < 10:
                raise ValueError(
                    f"'sections' number {number} must have a radius of at least 10 m, got {radius_m:.1f} m"
                )
        return self


class CsvRoad(_Road):
    """A measured road: a CSV file with station_m, curvature_1_m, cross_slope_1 and speed_m_s."""

    kind: Literal["csv"]
    file: Path


class OpenRoad(_Road):
    """Open ground without lanes, for a steering machine."""

    kind: Literal["open"]
    crown_percent: CrossSlope

    @model_validator(mode="after")
    def _is_alike_everywhere(self) -> OpenRoad:
        if self.patches is not None:
            raise ValueError("'patches' cannot be given for kind \"open\": open ground has no stations")
        return self


_ROAD_KINDS = ("bends", "sections", "csv", "open")


def _kind_of_road(values: Any) -> str:
    return str(values.get("kind", "bends") if isinstance(values, dict) else getattr(values, "kind", "bends"))


Road = Annotated[
    Annotated[BendsRoad, Tag("bends")]
    | Annotated[SectionsRoad, Tag("sections")]
    | Annotated[CsvRoad, Tag("csv")]
    | Annotated[OpenRoad, Tag("open")],
    Discriminator(
        _kind_of_road,
        custom_error_type="road_kind",
        custom_error_message=f"'kind' must be one of {', '.join(_ROAD_KINDS)}",
    ),
]


class Stops(Section):
    """Stops on the road, with times of standing."""

    spacing_m: LengthRange
    duration_s: PositiveRange


class Wind(Section):
    """Wind on open stretches; its force acts in front of the centre of gravity."""

    mean_m_s: Annotated[Number, Field(ge=0, le=30)]
    from_deg: Annotated[Number, Field(ge=0, lt=360)]
    gust_sd_m_s: Annotated[Number, Field(ge=0, le=10)]
    gust_time_s: Positive
    side_area_m2: Positive
    side_force_coefficient: Annotated[Number, Field(gt=0, le=3)]
    force_arm_m: Annotated[Number, Field(ge=-10, le=10)]
    open_share: Annotated[Number, Field(ge=0.05, le=1)] = 1.0  # of the distance; forest and cuttings shelter the rest
    open_length_m: LengthRange | None = None  # of an open stretch
    from_side: Annotated[bool, Field(strict=True)] = False  # `from_deg` is clockwise from the truck's nose

    @model_validator(mode="after")
    def _alternates_with_shelter(self) -> Wind:
        if (self.open_share < 1.0) != (self.open_length_m is not None):
            raise ValueError("'open_length_m' must be given exactly if 'open_share' is below 1")
        return self


_MachineAngle = Annotated[Number, Field(ge=-1000, le=1000)]


class ProfileManoeuvre(Section):
    """Steering wheel angles at given times, linear between them."""

    kind: Literal["profile"]
    time_s: Annotated[tuple[NotNegative, ...], Field(min_length=2)]
    angle_deg: tuple[_MachineAngle, ...]

    @model_validator(mode="after")
    def _is_a_course(self) -> ProfileManoeuvre:
        if len(self.angle_deg) != len(self.time_s):
            raise ValueError(f"'angle_deg' must have as many values as 'time_s', got {len(self.angle_deg)}")
        if any(after <= before for before, after in pairwise(self.time_s)):
            raise ValueError("'time_s' must ascend")
        return self


class RampManoeuvre(Section):
    """A ramp from zero to a first angle, a hold, a ramp to a second (Figure 12); with from_deg = 0 a step steer."""

    kind: Literal["ramp"]
    begin_s: NotNegative
    from_deg: _MachineAngle
    hold_s: NotNegative
    to_deg: _MachineAngle
    rate_deg_s: Annotated[Number, Field(gt=0, le=2000)]


class WeaveManoeuvre(Section):
    """Sines, one frequency after the other."""

    kind: Literal["weave"]
    begin_s: NotNegative
    amplitude_deg: Annotated[Number, Field(gt=0, le=500)]
    frequency_hz: Annotated[tuple[Annotated[Number, Field(gt=0, le=5)], ...], Field(min_length=1)]
    cycles: Annotated[Whole, Field(ge=1, le=1000)]
    pause_s: NotNegative


Manoeuvre = Annotated[ProfileManoeuvre | RampManoeuvre | WeaveManoeuvre, Field(discriminator="kind")]


_DrivenSpeed = Annotated[Number, Field(ge=1, le=150)]


class Driver(Section):
    speed_km_h: Annotated[tuple[_DrivenSpeed, _DrivenSpeed], AfterValidator(in_order)]
    speed_section_length_m: LengthRange
    bend_lateral_acceleration_max_m_s2: Annotated[Number, Field(ge=0.1, le=4)]
    acceleration_max_m_s2: Annotated[Number, Field(ge=0.05, le=5)]
    deceleration_max_m_s2: Annotated[Number, Field(ge=0.05, le=8)]
    preview_time_s: Annotated[Number, Field(ge=0.5, le=10)]
    preview_gain: Annotated[Number, Field(gt=0, le=2)]
    trim_time_s: Annotated[Number, Field(ge=1, le=1000)]
    reaction_time_s: Annotated[Number, Field(ge=0, le=1)]
    arm_frequency_rad_s: Annotated[Number, Field(ge=1, le=100)]
    lane_wander_sd_m: Annotated[Number, Field(ge=0, le=1)]
    lane_wander_time_s: Positive
    hand_motion_sd_deg: Annotated[Number, Field(ge=0, le=10)]
    hand_motion_time_s: Positive
