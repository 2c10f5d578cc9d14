"""The `[truck]` and `[steering]` of a scenario file, with payload, trailer and all that a steering does besides steering.

What a file does not say does not happen: every key beyond a plain 4x2 tractor has a neutral default.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from oncenter.signals import DEGREE
from oncenter.simulate.section import NotNegative, Number, Positive, Section

LIFTING_S = 4.0  # an axle on its way up or down

_Percent = Annotated[float, Field(ge=-15, le=15)]


class Payload(Section):
    """Goods as an even box; its place is behind the first axle of a truck, behind the hitch of a trailer."""

    mass_kg: Positive
    distance_m: Annotated[float, Field(ge=-5, le=20)]
    length_m: Annotated[float, Field(gt=0, le=20)]


class Tyres(Section):
    """What bounds the side force: friction times load is the Magic Formula's D, B follows from the stiffness."""

    model: Literal["brush", "magic_formula"]
    friction: Annotated[float, Field(gt=0, le=2)]
    C: Annotated[float, Field(ge=1, le=2)] | None = None
    E: Annotated[float, Field(ge=-10, le=1)] | None = None

    @model_validator(mode="after")
    def _has_its_shape(self) -> Tyres:
        for key, value in (("C", self.C), ("E", self.E)):
            if (value is None) != (self.model == "brush"):
                raise ValueError(f"'{key}' is of the magic_formula, and must be given there")
        return self


class Trailer(Section):
    """A semitrailer; lengths are behind its hitch, `hitch_m` is behind the tractor's first axle."""

    hitch_m: Annotated[float, Field(gt=0, le=20)]
    mass_kg: Positive
    yaw_inertia_kg_m2: Positive
    gravity_centre_m: Positive
    axle_count: Annotated[int, Field(ge=1, le=3)]
    axles_m: Annotated[float, Field(ge=1, le=20)]
    axle_spacing_m: Annotated[float, Field(gt=0, le=3)] = 1.31
    cornering_stiffness_n_rad: Positive
    payload: Payload | None = None


_FrontAndRearAxles = {"4x2": (1, 1), "6x2": (1, 2), "6x4": (1, 2), "8x4": (2, 2)}


class Truck(Section):
    """Without payload and trailer. The wheelbase is from the first axle to the first that is not steered; front and rear
    stiffness are of all tyres in front and all behind."""

    mass_kg: Positive
    yaw_inertia_kg_m2: Positive
    wheelbase_m: Annotated[float, Field(ge=1, le=20)]
    front_axle_distance_m: Positive
    front_cornering_stiffness_n_rad: Positive
    rear_cornering_stiffness_n_rad: Positive
    relaxation_length_m: Annotated[float, Field(ge=0, le=5)]
    track_width_front_m: Positive
    track_width_rear_m: Positive
    axle_layout: Literal["4x2", "6x2", "6x4", "8x4"] = "4x2"
    front_axle_spacing_m: Annotated[float, Field(gt=0, le=5)] | None = None
    rear_axle_spacing_m: Annotated[float, Field(gt=0, le=5)] | None = None
    last_axle_load_share: Annotated[float, Field(gt=0, lt=1)] = 0.5
    second_axle_steer_share: Annotated[float, Field(gt=0, le=1)] | None = None
    lift_axle_up_s: tuple[tuple[NotNegative, NotNegative], ...] = ()
    dual_tyre_spacing_m: Annotated[float, Field(ge=0, le=0.6)] = 0.0
    dual_tyre_longitudinal_stiffness_n: NotNegative = 0.0
    stiffness_load_exponent: Annotated[float, Field(ge=0, le=1)] = 1.0
    roll_deg_m_s2: Annotated[float, Field(ge=0, le=5)] = 0.0
    roll_frequency_hz: Annotated[float, Field(gt=0, le=5)] = 0.7
    roll_damping: Annotated[float, Field(gt=0, le=2)] = 0.3
    tyres: Tyres | None = None
    payload: Payload | None = None
    trailer: Trailer | None = None

    @property
    def front_axle_count(self) -> int:
        return _FrontAndRearAxles[self.axle_layout][0]

    @property
    def rear_axle_count(self) -> int:
        return _FrontAndRearAxles[self.axle_layout][1]

    @model_validator(mode="after")
    def _stands_on_both_axles(self) -> Truck:
        if self.front_axle_distance_m >= self.wheelbase_m:
            raise ValueError(f"'front_axle_distance_m' must be below the wheelbase, got {self.front_axle_distance_m:g}")
        return self

    @model_validator(mode="after")
    def _has_the_axles_of_its_layout(self) -> Truck:
        for key, count in (
            ("front_axle_spacing_m", self.front_axle_count),
            ("rear_axle_spacing_m", self.rear_axle_count),
        ):
            if (getattr(self, key) is None) != (count == 1):
                needs = "must be given" if count > 1 else "cannot be given"
                raise ValueError(f"'{key}' {needs} for axle_layout {self.axle_layout}")
        if self.front_axle_spacing_m is not None and self.front_axle_spacing_m >= self.wheelbase_m:
            raise ValueError(f"'front_axle_spacing_m' must be below the wheelbase, got {self.front_axle_spacing_m:g}")
        if self.second_axle_steer_share is not None and self.front_axle_count == 1:
            raise ValueError(f"'second_axle_steer_share' cannot be given for axle_layout {self.axle_layout}")
        if self.lift_axle_up_s and self.axle_layout != "6x2":
            raise ValueError(f"'lift_axle_up_s' needs axle_layout 6x2, got {self.axle_layout}")
        if any(after - before < LIFTING_S for before, after in pairwise(sum(self.lift_axle_up_s, ()))):
            raise ValueError(f"'lift_axle_up_s' must ascend by at least {LIFTING_S:g} s, which a way up or down takes")
        return self

    @model_validator(mode="after")
    def _has_tyres_of_one_kind(self) -> Truck:
        if (self.dual_tyre_spacing_m > 0) != (self.dual_tyre_longitudinal_stiffness_n > 0):
            raise ValueError("'dual_tyre_spacing_m' and 'dual_tyre_longitudinal_stiffness_n' go together")
        if self.tyres is not None and self.relaxation_length_m <= 0:
            raise ValueError("'relaxation_length_m' must be positive where 'tyres' saturate, got 0")
        return self


_Ratio = Annotated[float, Field(ge=1, le=60)]
_PLAY_AT_THE_WHEELS_MAX_DEG = 2.0  # beyond it nobody keeps a lane
_TURNED_MAX_RAD = 3.0  # steering wheel angle to which a ratio's polynomial must hold


class Steering(Section):
    """`steering_ratio` is a number, or a polynomial's coefficients from steering wheel angle to front wheel angle, both
    in rad, lowest power first. Moments are about the king pins; whatever pulls does so to the left where positive."""

    steering_ratio: _Ratio | Annotated[tuple[Number, ...], Field(min_length=2, max_length=8)]
    backlash_deg: Annotated[float, Field(ge=0, le=20)]
    king_pin_friction_n_m: NotNegative
    trail_m: NotNegative
    creep_deg_s_n_m: NotNegative
    compliance_deg_kn_m: NotNegative
    windup_deg: Annotated[float, Field(ge=0, le=5)] = 0.0
    active_return_1_s: Annotated[float, Field(ge=0, le=10)] = 0.0
    pull_n_m: Number = 0.0
    pull_n: Number = 0.0
    unloads_on_crown_percent: _Percent = 0.0
    brake_pull_n_m_per_m_s2: Number = 0.0
    torque_steer_n_m_per_m_s2: Number = 0.0

    @property
    def ratio_polynomial(self) -> tuple[float, ...]:
        ratio = self.steering_ratio
        return ratio if isinstance(ratio, tuple) else (0.0, 1.0 / ratio)

    @property
    def ratio_near_centre(self) -> float:
        ratio = self.steering_ratio
        return 1.0 / ratio[1] if isinstance(ratio, tuple) else ratio

    @model_validator(mode="after")
    def _turns_the_wheels_one_way(self) -> Steering:
        slope = [power * a for power, a in enumerate(self.ratio_polynomial)][1:]
        for turned in (k * _TURNED_MAX_RAD / 50 for k in range(-50, 51)):
            if not 1.0 <= 1.0 / (sum(a * turned**power for power, a in enumerate(slope)) or math.inf) <= 60.0:
                raise ValueError(f"'steering_ratio' must be 1 to 60, and is not at {turned / DEGREE:.0f} deg")
        return self

    @model_validator(mode="after")
    def _leaves_the_wheels_to_the_driver(self) -> Steering:
        largest_deg = _PLAY_AT_THE_WHEELS_MAX_DEG * self.ratio_near_centre
        if self.backlash_deg > largest_deg:
            raise ValueError(
                f"'backlash_deg' must be at most {largest_deg:.3g} with this 'steering_ratio', got {self.backlash_deg:g}"
            )
        return self
