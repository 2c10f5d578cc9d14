"""All numbers of a drive, or of several of one truck. Verdicts and JSON are made from them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from oncenter.estimates.by_priors import ByPrior, OffsetBy
from oncenter.estimates.cause import Cause, Pull
from oncenter.estimates.changes import Change
from oncenter.estimates.correction import Correction
from oncenter.estimates.estimate import Estimate
from oncenter.findings import Finding, most_severe_first
from oncenter.signals import DEGREE, Signals
from oncenter.truck.row import Row
from oncenter.truck.zero import Zero
from oncenter.vehicle import Vehicle

Method = Literal["thesis", "joint", "wheel-speed"]
METHODS: tuple[Method, ...] = ("thesis", "joint", "wheel-speed")
DEFAULT_METHOD: Method = "joint"
HALF_TURN_RAD = math.pi  # from here on an offset contains whole turns of the steering wheel


@dataclass(frozen=True, repr=False)
class Estimates:
    """All that a drive, or several of one truck, says about its steering wheel angle sensor.

    Times are in seconds of ticks; duration_s = used_s + unused_s, and the reasons in `rejected_s` overlap. `drives` are
    the tables answered, so that `trace` can run them again. The wheel radius mismatch of an axle is its left radius
    over its right less one; `unloading_acceleration` is the neutral lateral acceleration: the measured one at which the
    steering carries no load. `equivalent_wheelbase` is the one of (10) that fits the bends; it contains an error of the
    steering ratio. Where the vehicle's ratio is only assumed, `understeer_gradient` and `equivalent_wheelbase` are
    unobservable: `ratio_times_wheelbase` and `understeer_at_steering_wheel` need no ratio.
    `side_force_s` are the seconds of lateral force clearly to the left and to the right, which load the left and the
    right flank of the play; of the joint method.
    `missing_loading_s` are the seconds of lateral force to the left and to the right that the joint method still needs
    before it can separate play and offset there; zero where enough was driven, and for the other methods.
    `changes` are those found in the drive, in order of time; the core keeps only the last ones. `findings` are put in
    order, the most severe first.
    `sensor_fault` is the fault of the angle sensor at the end, "none" or one of the core's names. With a fault the
    offset is `invalid`: it was estimated before the fault.

    `offset` is the straight-ahead offset. Its `ci95` has two parts: `offset_ci95_drive` is this drive's part, and
    `not_identifiable` lists the causes that no single drive identifies. The other methods do not separate them: their
    list is empty and both intervals are one. `offset_per_acceleration` is the change of the offset by a pull or a mean
    crosswind, rad/(m/s^2).

    Of a truck whose rear axle steers, yaw shows only `combined_offset`: the front axle's offset less ratio times weight
    times the rear axle's, at the steering wheel. `offset` and `rear_axle_offset` (of the road wheels) are then
    unobservable, unless the rear axle's zero is given or was read while that axle was locked. Both are None for other
    trucks, and without that axle's angle.

    `zero` of the angle sensor: "fixed"; "relative", another at each start, as the sensor says or several drives show;
    "moves", changed several times or drifting.

    `rows` are what each drive says of its truck alone, in order of time; of the joint method.

    `by_priors` is the offset by halved and doubled priors; of the joint method, where an answer has an offset.

    `next_driving` is the driving that would narrow this drive's part of the offset's interval, in words, the most
    useful first; of the joint method. `pull` is the one that several logs identify or the vehicle file gives.
    """

    version: str
    log: str
    vehicle: Vehicle
    method: Method
    params: Mapping[str, float]
    sources: Mapping[str, str]
    notes: tuple[str, ...]
    offset: Estimate
    offset_ci95_drive: tuple[float, float] | None
    not_identifiable: tuple[Cause, ...]
    offset_per_acceleration: float
    understeer_gradient: Estimate
    backlash: Estimate
    unloading_acceleration: Estimate
    equivalent_wheelbase: Estimate
    ratio_times_wheelbase: Estimate
    understeer_at_steering_wheel: Estimate
    yaw_rate_bias: Estimate
    lateral_acceleration_bias: Estimate
    wheel_radius_mismatch_rear: Estimate
    wheel_radius_mismatch_front: Estimate
    variance_if_independent_rad2: float | None
    side_force_s: tuple[float, float]
    missing_loading_s: tuple[float, float]
    changes: tuple[Change, ...]
    sensor_fault: str
    duration_s: float
    used_s: float
    unused_s: float
    rejected_s: Mapping[str, float]
    findings: tuple[Finding, ...]
    drives: tuple[Signals, ...]
    next_driving: tuple[str, ...] = ()
    zero: Zero = "fixed"
    pull: Pull | None = None
    combined_offset: Estimate | None = None
    rear_axle_offset: Estimate | None = None
    by_priors: tuple[ByPrior, ...] = ()
    rows: tuple[Row, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "findings", most_severe_first(self.findings))

    @property
    def correction(self) -> Correction | None:
        """The correction of a valid offset; None for a zero that is not fixed, since no correction would hold, and for
        whole turns, which are the zero of the sensor and no correction."""
        if self.offset.value is None or self.offset.status != "valid" or self.zero != "fixed":
            return None
        if abs(self.offset.value) >= HALF_TURN_RAD:
            return None
        return Correction(self.vehicle.offset_applied_deg * DEGREE, -self.offset.value)

    @property
    def vin(self) -> str | None:
        """Of the truck, where a log has it."""
        return next((drive.vin for drive in self.drives if drive.vin is not None), None)

    @property
    def begin_s(self) -> float | None:
        """Begin of the first drive in s since 1970; None where no log has it."""
        return min((drive.begin_s for drive in self.drives if drive.begin_s is not None), default=None)

    @property
    def offset_now(self) -> OffsetBy | None:
        """The offset with both intervals; None without one."""
        value, own, whole = self.offset.value, self.offset_ci95_drive, self.offset.ci95
        return None if value is None or own is None or whole is None else OffsetBy(value, own, whole)

    @property
    def offset_half_width_rad(self) -> float | None:
        """Half the width of `offset_ci95_drive`."""
        return None if self.offset_ci95_drive is None else 0.5 * (self.offset_ci95_drive[1] - self.offset_ci95_drive[0])
