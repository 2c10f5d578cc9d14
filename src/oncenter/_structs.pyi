"""Structs of the core as dicts; core/*/*.h documents the members. docs/make_structs.py writes this file."""

from typing import NotRequired, TypedDict

class OcEstimate(TypedDict):
    value: float
    standard_deviation: float
    evidence: float
    status: int
    lean: float

class OcOffsetParts(TypedDict):
    drive_sd: float
    pull_sd: float
    wind_sd: float
    set_up_sd: float
    per_acceleration: float

class OcOffsetCovariances(TypedDict):
    understeer_gradient: float
    unloading_acceleration: float
    backlash: float

class OcChange(TypedDict):
    kind: int
    size: float
    size_sd: float
    seconds: float

class OcChanged(TypedDict):
    time: float
    before: float
    before_sd: float
    change: OcChange

class OcAnswer(TypedDict):
    offset: OcEstimate
    offset_parts: OcOffsetParts
    offset_covariances: OcOffsetCovariances
    offset_temporary: float
    offset_variance_if_independent: float
    understeer_gradient: OcEstimate
    backlash: OcEstimate
    unloading_acceleration: OcEstimate
    equivalent_wheelbase: OcEstimate
    fault: int
    signal_fault: int
    signals_at_fault: int
    signal_fault_value: float
    changes: int
    changed: list[OcChanged]
    yaw_rate_bias: OcEstimate
    yaw_rate_bias_wheel_time: float
    yaw_rate_bias_alarm_time: float
    wheel_radius_mismatch_rear: OcEstimate
    wheel_radius_mismatch_front: OcEstimate
    leaked_rear: float
    leaked_front: float
    standstill_lateral_acceleration: OcEstimate
    loaded_left_s: float
    loaded_right_s: float
    lacking_to_left: float
    lacking_to_right: float
    unexplained: float
    yaw_rate_noise: float
    steered_s: float
    steered_since_s: float
    steered_by: float
    offset_per_yaw_rate_bias: float
    bank_mean: float
    traffic_side: float
    bank_time: float
    bank_low: float
    bank_high: float
    accelerometer_wanders: int
    offset_walks: int
    accelerometer_runs_away: int
    duration: float
    used: float
    unused: float
    rejected: list[float]
    yaw_rate_step_sd: NotRequired[float]  # offset.coarse_recording.widened
    yaw_rate_bias_moved: NotRequired[float]  # offset.bias_course.BiasCourse

class OcMotion(TypedDict):
    curvature: float
    longitudinal_acceleration: float
    bank: float
    lateral_acceleration: float
    rear_part: float
    residual: float

class OcAngle(TypedDict):
    angle: float
    rate: float
    standard_deviation: float
    estimate: float
    estimate_sd: float
    delay: float
    by_sensor: bool
    status: int

class OcOutput(TypedDict):
    time: float
    vehicle_speed: float
    motion: OcMotion
    reasons: int
    offset_lean: float
    offset_status: int
    offset: float
    offset_sd: float
    offset_parts: OcOffsetParts
    understeer_gradient: float
    backlash: float
    place: float
    unloading_acceleration: float
    evidence: float
    yaw_rate_bias: float
    yaw_rate_bias_sd: float
    angle: OcAngle
    fault: int
    fault_since: float
    fault_confidence: float
    signal_fault: int
    signals_at_fault: int
