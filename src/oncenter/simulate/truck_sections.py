"""The `[truck]` and `[steering]` tables of a scenario file: axles, payload, trailer, and imperfections of the steering.

Every key beyond a plain 4x2 tractor has a neutral default.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from oncenter.signals import DEGREE
from oncenter.simulate.section import NotNegative, Number, Positive, Section, Whole
from oncenter.steering_ratio import SteeringRatio, near_centre, polynomial_of

LIFTING_S = 4.0  # duration of lifting or lowering an axle

_Percent = Annotated[Number, Field(ge=-15, le=15)]
_Mass = Annotated[Number, Field(ge=500, le=100_000)]
_Stiffness = Annotated[Number, Field(ge=10_000, le=5_000_000)]
_TrackWidth = Annotated[Number, Field(ge=1, le=3)]
_GYRATION_MIN_M, _GYRATION_MAX_M = 0.5, 6.0  # radii of gyration that a truck or a trailer can have
_RELAXATION_MIN_M = 0.05  # a shorter tyre lag would be below the integration step


def _check_inertia(mass_kg: float, yaw_inertia_kg_m2: float) -> None:
    radius_m = math.sqrt(yaw_inertia_kg_m2 / mass_kg)
    if not _GYRATION_MIN_M <= radius_m <= _GYRATION_MAX_M:
        raise ValueError(
            f"'yaw_inertia_kg_m2' does not fit 'mass_kg': the radius of gyration must be {_GYRATION_MIN_M:g} to "
            f"{_GYRATION_MAX_M:g} m, got {radius_m:.3g}"
        )


class Payload(Section):
    """Payload as a box of uniform density."""

    mass_kg: Annotated[Number, Field(gt=0, le=100_000)]
    distance_m: Annotated[
        Number, Field(ge=-5, le=20)
    ]  # of its middle behind the truck's first axle, or the trailer's hitch
    length_m: Annotated[Number, Field(gt=0, le=20)]


class Tyres(Section):
    """Limits of the lateral force. B of the Magic Formula follows from the axle's stiffness, which is B C D."""

    model: Literal["brush", "magic_formula"]
    friction: Annotated[Number, Field(gt=0, le=2)]  # times the load: the maximum lateral force, D of the Magic Formula
    rear_friction: Annotated[Number, Field(gt=0, le=2)] | None = None  # of the truck's tyres not steered; as `friction`
    C: Annotated[Number, Field(ge=1, le=2)] | None = None  # shape, magic_formula only; trucks some 1.3
    E: Annotated[Number, Field(ge=-10, le=1)] | None = None  # curvature, magic_formula only; trucks some -1

    @model_validator(mode="after")
    def _has_its_shape(self) -> Tyres:
        for key, value in (("C", self.C), ("E", self.E)):
            if (value is None) != (self.model == "brush"):
                raise ValueError(f"'{key}' must be given exactly if 'model' is \"magic_formula\"")
        return self


class Trailer(Section):
    """A semitrailer, without its payload; its lengths are behind its hitch."""

    hitch_m: Annotated[Number, Field(gt=0, le=20)]  # behind the tractor's first axle
    mass_kg: _Mass
    yaw_inertia_kg_m2: Positive
    gravity_centre_m: Positive
    axle_count: Annotated[Whole, Field(ge=1, le=3)]
    axles_m: Annotated[Number, Field(ge=1, le=20)]  # to the middle of its axles
    axle_spacing_m: Annotated[Number, Field(gt=0, le=3)] = 1.31
    cornering_stiffness_n_rad: _Stiffness  # all tyres, empty
    fifth_wheel_friction_n_m: Annotated[Number, Field(ge=0, le=30_000)] = 0.0  # dry, against articulation
    payload: Payload | None = None

    @model_validator(mode="after")
    def _follows_its_hitch(self) -> Trailer:
        _check_inertia(self.mass_kg, self.yaw_inertia_kg_m2)
        foremost_m = self.axles_m - (self.axle_count - 1) / 2 * self.axle_spacing_m
        if foremost_m < 1.0:
            raise ValueError(f"'axles_m' must put every axle at least 1 m behind the hitch, got {foremost_m:.3g}")
        return self


class LoadChange(Section):
    """Loading or unloading at standstill: above the rear axles, or at the trailer's payload."""

    begin_s: NotNegative
    load_percent: Annotated[Number, Field(ge=-60, le=60)]  # change of the load on all rear axles
    ride_height_steer_deg: Annotated[Number, Field(ge=-20, le=20)] = 0.0  # change of straight-ahead angle


class RearSteering(Section):
    """The last axle steers against the front wheels: a tag axle to one turning centre with them, or by a share."""

    share: Annotated[Number, Field(ge=-1, lt=0)] | None = None  # of the front wheel angle; None, 6x2: by geometry
    locks_above_km_h: Annotated[Number, Field(ge=10, le=100)] | None = None  # fades over the last quarter before


class Intervention(Section):
    """Brakes that a control applies: their yaw moment is none that the steering explains."""

    kind: Literal["stability_control", "anti_lock"]
    begin_s: NotNegative
    length_s: Annotated[Number, Field(gt=0, le=60)]
    yaw_moment_n_m: Annotated[Number, Field(ge=-50_000, le=50_000)] = 0.0  # to the left; rises and falls within 0.2 s
    deceleration_m_s2: Annotated[Number, Field(ge=0, le=8)] = 0.0
    wheel_slip_percent: Annotated[Number, Field(ge=0, le=50)] = 0.0  # maximum; each wheel's speed falls by it in turn


_FrontAndRearAxles = {"4x2": (1, 1), "6x2": (1, 2), "6x4": (1, 2), "8x4": (2, 2)}


class Truck(Section):
    """Mass, inertia, centre of gravity and stiffness are without payload and trailer, all axles on the road."""

    mass_kg: _Mass
    yaw_inertia_kg_m2: Positive  # about the centre of gravity
    wheelbase_m: Annotated[Number, Field(ge=1, le=20)]  # from the first axle to the first that is not steered
    front_axle_distance_m: Positive  # from the centre of gravity to the first axle
    front_cornering_stiffness_n_rad: _Stiffness  # all steered tyres
    rear_cornering_stiffness_n_rad: _Stiffness  # all tyres that are not steered
    relaxation_length_m: Annotated[Number, Field(ge=0, le=5)]
    track_width_front_m: _TrackWidth
    track_width_rear_m: _TrackWidth
    axle_layout: Literal["4x2", "6x2", "6x4", "8x4"] = "4x2"
    front_axle_spacing_m: Annotated[Number, Field(gt=0, le=5)] | None = None  # 8x4: to the second steered axle
    rear_axle_spacing_m: Annotated[Number, Field(gt=0, le=5)] | None = None  # 6x2, 6x4, 8x4: between the last two axles
    last_axle_load_share: Annotated[Number, Field(gt=0, lt=1)] = 0.5  # of load and stiffness of the last two axles
    second_axle_steer_share: Annotated[Number, Field(gt=0, le=1)] | None = None  # of the first's angle; by geometry
    rear_steering: RearSteering | None = None
    lift_axle_up_s: tuple[tuple[NotNegative, NotNegative], ...] = ()  # 6x2: times up and down again of the last axle
    dual_tyre_spacing_m: Annotated[Number, Field(ge=0, le=0.6)] = 0.0  # middle to middle; a tag axle has single tyres
    dual_tyre_longitudinal_stiffness_n: NotNegative = 0.0  # of one tyre, N per unit of slip
    stiffness_load_exponent: Annotated[Number, Field(ge=0, le=1)] = 1.0  # 1: stiffness in proportion to load, 2.3
    roll_deg_m_s2: Annotated[Number, Field(ge=0, le=5)] = 0.0  # body roll in a steady bend
    roll_frequency_hz: Annotated[Number, Field(gt=0, le=5)] = 0.7
    roll_damping: Annotated[Number, Field(gt=0, le=2)] = 0.3  # share of critical
    tyres: Tyres | None = None  # None: linear (4)
    payload: Payload | None = None
    trailer: Trailer | None = None
    load_change: LoadChange | None = None

    @property
    def front_axle_count(self) -> int:
        return _FrontAndRearAxles[self.axle_layout][0]

    @property
    def rear_axle_count(self) -> int:
        return _FrontAndRearAxles[self.axle_layout][1]

    @model_validator(mode="after")
    def _stands_on_both_axles(self) -> Truck:
        _check_inertia(self.mass_kg, self.yaw_inertia_kg_m2)
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
        if self.rear_steering is not None:
            if self.axle_layout not in ("4x2", "6x2"):
                raise ValueError(f"'rear_steering' needs axle_layout 4x2 or 6x2, got {self.axle_layout}")
            if self.rear_steering.share is None and self.axle_layout != "6x2":
                raise ValueError(f"'rear_steering.share' must be given for axle_layout {self.axle_layout}")
        if self.lift_axle_up_s and self.axle_layout != "6x2":
            raise ValueError(f"'lift_axle_up_s' needs axle_layout 6x2, got {self.axle_layout}")
        if any(after - before < LIFTING_S for before, after in pairwise(sum(self.lift_axle_up_s, ()))):
            raise ValueError(
                f"'lift_axle_up_s' must ascend by at least {LIFTING_S:g} s, the time for lifting or lowering"
            )
        if self.lift_axle_up_s and self.load_change is not None:
            raise ValueError("'load_change' and 'lift_axle_up_s' cannot be given together")
        return self

    @model_validator(mode="after")
    def _has_tyres_of_one_kind(self) -> Truck:
        if (self.dual_tyre_spacing_m > 0) != (self.dual_tyre_longitudinal_stiffness_n > 0):
            raise ValueError("'dual_tyre_spacing_m' and 'dual_tyre_longitudinal_stiffness_n' must be given together")
        if self.tyres is not None and self.relaxation_length_m <= 0:
            raise ValueError("'relaxation_length_m' must be positive with 'tyres', got 0")
        if 0.0 < self.relaxation_length_m < _RELAXATION_MIN_M:
            raise ValueError(
                f"'relaxation_length_m' must be 0 or at least {_RELAXATION_MIN_M:g}, got {self.relaxation_length_m:g}"
            )
        return self


_PLAY_AT_THE_WHEELS_MAX_DEG = 2.0  # with more, the driver cannot keep the lane
_Compliance = Annotated[Number, Field(ge=0, le=10)]
_PullForce = Annotated[Number, Field(ge=-20_000, le=20_000)]
_MomentPerAcceleration = Annotated[Number, Field(ge=-1000, le=1000)]


class OverlayMotor(Section):
    """A motor at the gear for lane keeping or dynamic steering, with lash between it and the steering wheel."""

    lash_deg: Annotated[Number, Field(ge=0, le=20)]  # full width, between steering wheel and gear
    carries_s: tuple[tuple[NotNegative, NotNegative], ...] = ()  # [begin, end] of the times when the motor steers
    dead_band_deg: Annotated[Number, Field(ge=0, le=5)] = 0.0  # to either side, at the gear: the motor stays within it
    # Of a hand that rests on the rim while the motor steers, left positive. Chosen: an arm's weight of some 5 to 10 N
    # at a radius of 0.22 m; beyond the column's friction it keeps the wheel on one side of the lash.
    resting_torque_n_m: Annotated[Number, Field(ge=-10, le=10)] = 0.0
    hands_off_s: tuple[tuple[NotNegative, NotNegative], ...] = ()  # [begin, end] of the times without that hand

    @model_validator(mode="after")
    def _carries_in_order(self) -> OverlayMotor:
        for key in ("carries_s", "hands_off_s"):
            if any(after <= before for before, after in pairwise(sum(getattr(self, key), ()))):
                raise ValueError(f"'{key}' must be [begin, end] pairs, ascending")
        return self


class Steering(Section):
    """Moments are about the king pins, both wheels together; pulls are positive to the left."""

    # a number; or a polynomial's coefficients from the steering wheel angle to the front wheel angle, both in rad,
    # lowest power first
    steering_ratio: SteeringRatio
    backlash_deg: Annotated[Number, Field(ge=0, le=20)]  # full width of the play, at the steering wheel
    king_pin_friction_n_m: NotNegative  # the aligning moment must exceed it to move the wheels through the play
    trail_m: Annotated[Number, Field(ge=0, le=0.5)]  # lateral force times trail is the aligning moment
    creep_deg_s_n_m: NotNegative  # speed of the wheels through the play: deg/s per N m above friction
    compliance_deg_kn_m: _Compliance  # of the front wheels, column and linkages together, under a moment
    windup_deg: Annotated[Number, Field(ge=0, le=5)] = 0.0  # of the column against friction, to either side
    active_return_1_s: Annotated[Number, Field(ge=0, le=10)] = 0.0  # return rate of the twist by a motor
    pull_n_m: Annotated[Number, Field(ge=-2000, le=2000)] = 0.0  # constant moment of a misalignment
    pull_n: _PullForce = 0.0  # lateral force of a misalignment (toe, camber) at zero slip
    unloads_on_crown_percent: _Percent = 0.0  # road crown for which the axle is adjusted to zero moment
    brake_pull_n_m_per_m_s2: _MomentPerAcceleration = 0.0  # moment per deceleration
    torque_steer_n_m_per_m_s2: _MomentPerAcceleration = 0.0  # moment per acceleration
    ratio_right_error_percent: Annotated[Number, Field(ge=-10, le=10)] = 0.0  # of the ratio in right turns
    universal_joint_ripple_deg: Annotated[Number, Field(ge=0, le=5)] = 0.0  # amplitude, twice a turn of the gear
    universal_joint_phase_deg: Annotated[Number, Field(ge=-180, le=180)] = 0.0  # gear angle of its rising zero
    torsion_bar_twist_deg: Annotated[Number, Field(ge=0, le=10)] = 0.0  # maximum lead of the steering wheel
    torsion_bar_half_moment_n_m: Annotated[Number, Field(ge=5, le=5000)] | None = None  # about the king pins
    brake_steer_deg_m_s2: Annotated[Number, Field(ge=-1, le=1)] = 0.0  # of the front wheels per deceleration
    roll_steer_deg_deg: Annotated[Number, Field(ge=-0.5, le=0.5)] = 0.0  # of the front wheels per body roll
    bump_steer_sd_deg: Annotated[Number, Field(ge=0, le=1)] = 0.0  # of the front wheels, by spring travel
    bump_steer_time_s: Annotated[Number, Field(ge=0.02, le=60)] = 0.3  # its correlation time
    overlay_motor: OverlayMotor | None = None
    # Ratio of the whole moment to the driver's part of it. With 10, about 2 N m at the steering wheel hold 1 m/s^2 with
    # the thesis's truck. Assumed: 1 to 3 N m are usual on centre.
    assistance: Annotated[Number, Field(ge=1, le=100)] = 10.0
    column_friction_n_m: Annotated[Number, Field(ge=0, le=5)] = 0.3  # at the steering wheel; assumed

    @property
    def ratio_polynomial(self) -> tuple[float, ...]:
        return polynomial_of(self.steering_ratio)

    @property
    def ratio_near_centre(self) -> float:
        """The ratio near centre in left turns, including the ripple of the universal joints."""
        ripple_rad = self.universal_joint_ripple_deg * DEGREE
        slope = 1.0 + 2.0 * ripple_rad * math.cos(2.0 * self.universal_joint_phase_deg * DEGREE)
        return near_centre(self.steering_ratio) / slope

    @property
    def ratio_right_share(self) -> float:
        """Front wheel angle in right turns over that in left turns."""
        return 1.0 / (1.0 + self.ratio_right_error_percent / 100.0)

    @property
    def lash_deg(self) -> float:
        return self.overlay_motor.lash_deg if self.overlay_motor is not None else 0.0

    @property
    def carries_s(self) -> tuple[tuple[float, float], ...]:
        return self.overlay_motor.carries_s if self.overlay_motor is not None else ()

    @model_validator(mode="after")
    def _has_a_torsion_bar_or_none(self) -> Steering:
        if (self.torsion_bar_twist_deg > 0.0) != (self.torsion_bar_half_moment_n_m is not None):
            raise ValueError("'torsion_bar_twist_deg' and 'torsion_bar_half_moment_n_m' must be given together")
        return self

    @model_validator(mode="after")
    def _leaves_the_wheels_to_the_driver(self) -> Steering:
        largest_deg = _PLAY_AT_THE_WHEELS_MAX_DEG * self.ratio_near_centre
        if self.backlash_deg + self.lash_deg > largest_deg:
            with_lash = " together with 'overlay_motor.lash_deg'" if self.lash_deg > 0.0 else ""
            raise ValueError(
                f"'backlash_deg'{with_lash} must be at most {largest_deg:.3g} with this 'steering_ratio', "
                f"got {self.backlash_deg + self.lash_deg:g}"
            )
        return self
