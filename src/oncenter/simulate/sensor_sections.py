"""The `[sensors]` tables of a scenario file: properties and faults of each sensor.

Noise, resolution and repeated frames have defaults measured on two real trucks' loggers and a car; the ranges are
J1939's. All other keys default to no fault.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from oncenter.signals import DEGREE, STANDARD_GRAVITY
from oncenter.simulate.section import NotNegative, Number, Positive, PositiveRange, Section, Whole

_Percent = Annotated[Number, Field(ge=-20, le=20)]
_SpeedStep = Annotated[Number, Field(ge=0, le=5)]
_MountingAngle = Annotated[Number, Field(ge=-10, le=10)]  # deg
_Turns = Annotated[Whole, Field(ge=-4, le=4)]
_TURN_DEG = 360.0
_KM_H = 3.6  # per m/s


class Dropouts(Section):
    """Short random gaps without a value."""

    rate_1_h: Annotated[Number, Field(gt=0, le=3600)]
    length_s: PositiveRange


class Failure(Section):
    """No valid value from a time on: for a while, or to the end."""

    begin_s: NotNegative
    length_s: Positive | None = None
    says: Literal["not_available", "error"] = "not_available"


class Stuck(Section):
    """The last value is repeated from a time on: for a while, or to the end."""

    begin_s: NotNegative
    length_s: Positive | None = None


class Sensor(Section):
    """The faults that every sensor may have."""

    latency_s: Annotated[Number, Field(ge=0, le=0.5)] = 0.0  # age of the true value in the reading
    filter_time_s: Annotated[Number, Field(ge=0, le=5)] = 0.0  # time constant of a first-order low pass
    hold_s: Annotated[Number, Field(ge=0, le=5)] = 0.0  # between new readings; the last one is held
    dropouts: Dropouts | None = None
    failures: tuple[Failure, ...] = ()
    stuck: tuple[Stuck, ...] = ()


def _check_reads_zero(range_: float, resolution: float, farthest: float, unit: str) -> None:
    """Checks that zero stays within the range and can be resolved, whatever the faults add."""
    if farthest >= range_:
        raise ValueError(f"'range_{unit}' must be larger than all offsets and steps together, {farthest:g}")
    if resolution >= range_:
        raise ValueError(f"'resolution_{unit}' must be below the range, got {resolution:g}")


class AngleRemount(Section):
    begin_s: NotNegative
    step_deg: Number


class SelfCorrection(Section):
    """A stability control that estimates the offset and subtracts it from the angle it sends, gradually or at once."""

    begin_s: NotNegative
    length_s: NotNegative = 0.0
    share: Annotated[Number, Field(gt=0, le=1)] = 1.0


class Ignition(Section):
    """Ignition off for some seconds; afterwards the angle has another number of whole turns."""

    begin_s: NotNegative
    off_s: Positive
    turns: _Turns


class RelativeAngle(Section):
    """A relative sensor, SPN 1812 = 0: its angle is ambiguous by whole turns."""

    turns: _Turns = 0
    ignitions: tuple[Ignition, ...] = ()

    @model_validator(mode="after")
    def _is_off_before_it_is_off_again(self) -> RelativeAngle:
        if any(after.begin_s < before.begin_s + before.off_s for before, after in pairwise(self.ignitions)):
            raise ValueError("'ignitions' must be in order of time, each after the end of the one before")
        return self


class SteeringWheelAngleSensor(Sensor):
    offset_deg: Number = 0.0
    noise_sd_deg: NotNegative = 0.02  # measured on two real trucks' loggers and a car
    resolution_deg: NotNegative = 0.11  # the same
    range_deg: Positive = 1797.6  # SPN 1807: -31.374 to 31.374 rad
    hysteresis_deg: Annotated[Number, Field(ge=0, le=20)] = 0.0
    remounts: tuple[AngleRemount, ...] = ()
    self_correction: SelfCorrection | None = None
    relative: RelativeAngle | None = None

    @model_validator(mode="after")
    def _reads_straight_ahead(self) -> SteeringWheelAngleSensor:
        """Straight ahead stays within the range."""
        turns = 0
        if self.relative is not None:
            turns = max(abs(t) for t in (self.relative.turns, *(i.turns for i in self.relative.ignitions)))
        farthest = abs(self.offset_deg) + sum(abs(r.step_deg) for r in self.remounts) + turns * _TURN_DEG
        _check_reads_zero(self.range_deg, self.resolution_deg, farthest, "deg")
        return self


class YawRateRemount(Section):
    begin_s: NotNegative
    step_deg_s: Number


class YawRateSensor(Sensor):
    bias_deg_s: Number = 0.0
    noise_sd_deg_s: NotNegative = 0.025  # measured on two real trucks' loggers and a car
    resolution_deg_s: NotNegative = 0.028  # the same: 1/2048 rad/s
    range_deg_s: Positive = 224.0  # SPN 1808: -3.92 to 3.92 rad/s
    drift_deg_s_min: Number = 0.0
    drift_ends_min: Positive | None = None  # the bias is constant afterwards; None: drifts to the end of the drive
    random_walk_sd_deg_s_min: NotNegative = 0.0  # of the bias's change in one minute
    warm_up_deg_s: Number = 0.0  # added to the bias at switch-on
    warm_up_time_min: Positive = 15.0  # until 5 % of it remains, 2.5
    scale_error_percent: _Percent = 0.0
    scale_warm_up_percent: _Percent = 0.0  # added to the scale error at switch-on; decays as warm_up_deg_s
    bank_shift_mrad_s_percent: Annotated[Number, Field(ge=-1, le=1)] = 0.0  # of cross slope, 2.5: 0.05
    remounts: tuple[YawRateRemount, ...] = ()

    @model_validator(mode="after")
    def _reads_standing(self) -> YawRateSensor:
        farthest = abs(self.bias_deg_s) + abs(self.warm_up_deg_s) + sum(abs(r.step_deg_s) for r in self.remounts)
        _check_reads_zero(self.range_deg_s, self.resolution_deg_s, farthest, "deg_s")
        return self


class AccelerometerRemount(Section):
    begin_s: NotNegative
    step_m_s2: Number


class Accelerometer(Sensor):
    """The longitudinal accelerometer; base of the lateral one."""

    bias_m_s2: Number = 0.0
    noise_sd_m_s2: NotNegative = 0.1  # measured on two real trucks' loggers and a car
    resolution_m_s2: NotNegative = 0.1  # SPN 1810
    range_m_s2: Positive = 12.5  # SPN 1810
    drift_m_s2_min: Number = 0.0
    drift_ends_min: Positive | None = None  # the bias is constant afterwards; None: drifts to the end of the drive
    random_walk_sd_m_s2_min: NotNegative = 0.0
    warm_up_m_s2: Number = 0.0
    warm_up_time_min: Positive = 15.0
    remounts: tuple[AccelerometerRemount, ...] = ()

    @property
    def constants_m_s2(self) -> dict[str, float]:
        """Constant additions to the reading, by kind."""
        return {"bias": self.bias_m_s2}

    @model_validator(mode="after")
    def _reads_standing(self) -> Self:
        farthest = sum(map(abs, (*self.constants_m_s2.values(), self.warm_up_m_s2)))
        farthest += sum(abs(r.step_m_s2) for r in self.remounts)
        _check_reads_zero(self.range_m_s2, self.resolution_m_s2, farthest, "m_s2")
        return self


class LateralAccelerometer(Accelerometer):
    """An accelerometer with its mounting. Angles are small: the lateral acceleration itself is read in full."""

    resolution_m_s2: NotNegative = 1.0 / 2048.0  # SPN 1809
    range_m_s2: Positive = 15.687  # SPN 1809
    ahead_of_gravity_centre_m: Annotated[Number, Field(ge=-15, le=15)] = 0.0
    tilt_deg: _MountingAngle = 0.0  # about the longitudinal axis; positive: gravity raises the reading
    turned_deg: _MountingAngle = 0.0  # about the vertical axis; positive: speeding up raises the reading
    roll_share: Annotated[Number, Field(ge=0, le=1)] = 1.0  # of the body's roll; 0: on the unsprung frame

    @property
    def constants_m_s2(self) -> dict[str, float]:
        return {"bias": self.bias_m_s2, "tilt": STANDARD_GRAVITY * math.sin(self.tilt_deg * DEGREE)}


class SteeringWheelTorqueSensor(Sensor):
    zero_error_n_m: Annotated[Number, Field(ge=-5, le=5)] = 0.0
    noise_sd_n_m: NotNegative = 0.05  # assumed, as the next two
    resolution_n_m: NotNegative = 0.02
    range_n_m: Positive = 20.0

    @model_validator(mode="after")
    def _reads_zero(self) -> Self:
        _check_reads_zero(self.range_n_m, self.resolution_n_m, abs(self.zero_error_n_m), "n_m")
        return self


class RearAxleAngleSensor(Sensor):
    """At a steered rear axle: the road wheels' angle."""

    offset_deg: Annotated[Number, Field(ge=-10, le=10)] = 0.0
    noise_sd_deg: NotNegative = 0.02  # assumed, as the next two
    resolution_deg: NotNegative = 0.02
    range_deg: Positive = 45.0

    @model_validator(mode="after")
    def _reads_straight_ahead(self) -> Self:
        _check_reads_zero(self.range_deg, self.resolution_deg, abs(self.offset_deg), "deg")
        return self


Status = Literal["stability_control_active", "anti_lock_active", "steering_assist_active", "reverse", "axle_lifted"]


class SpeedSensor(Sensor):
    noise_sd_m_s: NotNegative = 0.01  # measured on two real trucks' loggers and a car
    resolution_m_s: _SpeedStep = 1.0 / 256.0 / _KM_H  # SPN 84
    scale_error_percent: _Percent = 0.0


class RadiusErrors(Section):
    """The share by which each wheel's rolling radius exceeds the control unit's value; a larger wheel reads less."""

    front_left: _Percent = 0.0
    front_right: _Percent = 0.0
    rear_left: _Percent = 0.0
    rear_right: _Percent = 0.0


class WheelSpeedSensors(Sensor):
    """The four wheel speeds as in HRW, measured on two real trucks' loggers and a car.

    For noise or resolution None, the value of `[sensors.speed]` applies.
    """

    noise_sd_m_s: NotNegative | None = 0.04  # of each wheel: left less right has 0.05 to 0.065
    resolution_m_s: _SpeedStep | None = 0.125 / _KM_H
    repeat_share: Annotated[Number, Field(ge=0, lt=1)] = 0.3  # of frames that repeat all four last values
    scale_error_percent: _Percent = 0.0
    radius_error_percent: RadiusErrors = RadiusErrors()
    radius_warm_up_percent: RadiusErrors = RadiusErrors()  # growth of the radius by sun or running
    radius_warm_up_time_min: Positive = 10.0  # until 95 % of the growth has happened
    radius_warm_up_begin_s: NotNegative = 0.0
    load_transfer_percent_m_s2: Annotated[Number, Field(ge=0, le=2)] = 0.0  # of the radius, per lateral acceleration
    pulses_per_turn: Annotated[Whole, Field(ge=0, le=1000)] = 0  # 0: speed without pulses
    rolling_radius_m: Annotated[Number, Field(ge=0.1, le=2)] = 0.5
    pulse_window_s: Annotated[Number, Field(ge=0.01, le=1)] = 0.02  # in which pulses are counted and timed


class Gnss(Sensor):
    """A receiver with inertial sensors, as the thesis's RT3040; errors with given correlation times."""

    latitude_deg: Annotated[Number, Field(ge=-80, le=80)]  # at the start of the drive
    longitude_deg: Annotated[Number, Field(ge=-180, le=180)]
    position_sd_m: NotNegative = 0.5
    position_time_s: Positive = 60.0
    heading_sd_deg: NotNegative = 0.1
    heading_time_s: Positive = 10.0


class Sensors(Section):
    steering_wheel_angle: SteeringWheelAngleSensor = SteeringWheelAngleSensor()
    yaw_rate: YawRateSensor = YawRateSensor()
    lateral_acceleration: LateralAccelerometer = LateralAccelerometer()
    longitudinal_acceleration: Accelerometer = Accelerometer()
    steering_wheel_torque: SteeringWheelTorqueSensor | None = None
    speed: SpeedSensor = SpeedSensor()
    wheel_speed: WheelSpeedSensors = WheelSpeedSensors()
    gnss: Gnss | None = None
    rear_axle_angle: RearAxleAngleSensor | None = None
    statuses: tuple[Status, ...] = ()  # that the bus sends


class Can(Section):
    jitter_sd_ms: Annotated[Number, Field(ge=0, le=2)]


def begins_s(section: Section, name: str) -> Iterator[tuple[str, float]]:
    """The begin of each sensor event, by its key in the file: "sensors.yaw_rate.stuck.begin_s", 600.0."""
    for key in type(section).model_fields:
        value = getattr(section, key)
        if key.endswith("begin_s"):
            yield f"{name}.{key}", value
        for part in value if isinstance(value, tuple) else (value,):
            if isinstance(part, Section):
                yield from begins_s(part, f"{name}.{key}")
