"""What errors of a truck's sensors cost the thesis's offset: (47) and (48) for any truck, and what to mend first.

(48) lets the yaw rate's bias act through K_us as well. With an accelerometer that is not so: (33) takes r*v away and
(37) adds it again, so that what acts through K_us is the measured lateral acceleration alone. As printed it holds
without an accelerometer, the road's bank in the place of its bias. SI and rad; degrees appear in text and JSON.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from typing import Any

from oncenter import _core
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.offset.findings import PLAY_STANDARD_DEG
from oncenter.signals import DEGREE
from oncenter.vehicle import Vehicle

MEAN_SPEED_M_S = 15.0  # Figure 16
BACKLASH_RAD = PLAY_STANDARD_DEG * DEGREE
_SPEEDS_M_S = (1.0, 60.0)
_BACKLASH_MAX_RAD = 60.0 * DEGREE
_GOAL_RAD = 1.5 * DEGREE  # 5.3.1
_WORTH_TELLING = 0.95  # of a total: a smaller gain is none


@dataclass(frozen=True)
class Truck:
    """What (48) needs to know. `understeer_gradient` is K_us/g at the road wheel, rad/(m/s^2); `mean_speed_m_s` is the
    true one; `speed_scale` is lambda of (45), by how much the measured speed is too high."""

    steering_ratio: float
    wheelbase_m: float
    understeer_gradient: float
    mean_speed_m_s: float
    speed_scale: float


def as_printed_rad(truck: Truck, yaw_rate_bias_rad_s: float, acceleration_bias_m_s2: float) -> float:
    """(48): the offset's error."""
    i, L, K, v = truck.steering_ratio, truck.wheelbase_m, truck.understeer_gradient, truck.mean_speed_m_s
    scale = 1.0 + truck.speed_scale
    return i * (L / (v * scale) + v * K * scale) * yaw_rate_bias_rad_s + i * K * acceleration_bias_m_s2


def as_corrected_rad(truck: Truck, yaw_rate_bias_rad_s: float, acceleration_bias_m_s2: float) -> float:
    """The offset's error with (33) and (37) taken together, the accelerometer's bias in the place of the bank's."""
    i, L, K, v = truck.steering_ratio, truck.wheelbase_m, truck.understeer_gradient, truck.mean_speed_m_s
    return i * L * yaw_rate_bias_rad_s / (v * (1.0 + truck.speed_scale)) + i * K * acceleration_bias_m_s2


def speed_scale_rad(truck: Truck, mean_curvature_1_m: float) -> float:
    """What (48) leaves out of (47): a wrong speed makes bends too wide or too narrow; nothing where they are even."""
    scale = truck.speed_scale
    return abs(truck.steering_ratio * truck.wheelbase_m * scale / (1.0 + scale) * mean_curvature_1_m)


@dataclass(frozen=True)
class Contribution:
    """One error and what it does to the offset.

    Attributes:
        name: snake_case.
        sensor: whose error; None for the steering's play.
        size, unit: as files give them.
        printed_rad: by (48), or the text; corrected_rad: as it is.
        enough: of the sensor that costs most and more than the 1.5 deg of 5.3.1: the size, in `unit`, at which it costs
            no more than that or than the next one; None of all others.
    """

    name: str
    sensor: str | None
    size: float
    unit: str
    printed_rad: float
    corrected_rad: float
    enough: float | None = None

    def to_dict(self) -> dict[str, Any]:
        return {
            "size": {"value": self.size, "unit": self.unit},
            "sensor": self.sensor,
            "as_printed": {"value": self.printed_rad / DEGREE, "unit": "deg"},
            "as_corrected": {"value": self.corrected_rad / DEGREE, "unit": "deg"},
            "enough": None if self.enough is None else {"value": self.enough, "unit": self.unit},
        }


@dataclass(frozen=True)
class Budget:
    """What each error contributes to the offset of (36) and (37).

    `total_*` are roots of the sums of squares; `without_accelerometer_rad` is the total when r*v stands for the lateral
    acceleration and a usual crown is not seen; `learned_bias_rad` what a yaw rate bias leaves that the joint method
    calls valid. `next_sensor` is the one that would lessen the total most, None where none leads to more than 1.5 deg.
    """

    version: str
    vehicle: str
    truck: Truck
    contributions: tuple[Contribution, ...]
    total_printed_rad: float
    total_corrected_rad: float
    without_accelerometer_rad: float
    learned_bias_rad: float
    next_sensor: str | None
    notes: tuple[str, ...]

    def __str__(self) -> str:
        speed_km_h = self.truck.mean_speed_m_s * 3.6
        rows = [
            (c.name.replace("_", " "), f"{c.size:.3g} {c.unit}", c.printed_rad, c.corrected_rad)
            for c in self.contributions
        ]
        rows.append(("together, root of squares", "", self.total_printed_rad, self.total_corrected_rad))
        lines = [
            f"what {self.vehicle}'s sensors may cost (36)'s offset at {speed_km_h:.0f} km/h",
            "",
            f"  {'error':33}{'size':>12}{'(48), printed':>17}{'corrected':>13}",
            *(f"  {name:33}{size:>12}{p / DEGREE:13.2f} deg{c / DEGREE:9.2f} deg" for name, size, p, c in rows),
            "",
            *self.advice(),
            *(f"note: {note}" for note in self.notes),
        ]
        return "\n".join(lines)

    def advice(self) -> list[str]:
        """What to do about it, a line each."""
        lines = []
        leading = next((c for c in self.contributions if c.sensor is not None and c.sensor == self.next_sensor), None)
        if leading is None:
            lines.append(f"next: no sensor costs more than {_GOAL_RAD / DEGREE:g} deg")
        else:
            lines.append(
                f"next: a better {leading.sensor}: within {leading.enough:.2g} {leading.unit} it costs no more than"
                f" {_GOAL_RAD / DEGREE:g} deg, or than the next sensor does"
            )
        if self.next_sensor == "yaw rate sensor":
            lines.append(
                "or none: half a second standing still, or wheel speeds, tell its bias; where the joint method calls"
                f" that valid, {self.learned_bias_rad / DEGREE:.2f} deg are left"
            )
        if self.without_accelerometer_rad < _WORTH_TELLING * self.total_corrected_rad:
            lines.append(
                "the accelerometer costs more than it gives: without it, and with a usual crown of the road, all"
                f" together is {self.without_accelerometer_rad / DEGREE:.2f} deg"
            )
        return lines

    def to_dict(self) -> dict[str, Any]:
        """The object of the schema oncenter/budget-1."""
        return {
            "schema": "oncenter/budget-1",
            "version": self.version,
            "vehicle": self.vehicle,
            "mean_speed": {"value": self.truck.mean_speed_m_s * 3.6, "unit": "km/h"},
            "understeer_gradient": {"value": self.truck.understeer_gradient / DEGREE, "unit": "deg/(m/s^2)"},
            "contributions": {c.name: c.to_dict() for c in self.contributions},
            "total_as_printed": {"value": self.total_printed_rad / DEGREE, "unit": "deg"},
            "total_as_corrected": {"value": self.total_corrected_rad / DEGREE, "unit": "deg"},
            "total_without_accelerometer": {"value": self.without_accelerometer_rad / DEGREE, "unit": "deg"},
            "next_sensor": self.next_sensor,
            "advice": self.advice(),
            "notes": list(self.notes),
        }

    def to_json(self) -> str:
        return json.dumps(self.to_dict(), ensure_ascii=False, allow_nan=False, indent=2)


def budget(
    vehicle: Vehicle,
    *,
    mean_speed_m_s: float = MEAN_SPEED_M_S,
    backlash_rad: float = BACKLASH_RAD,
) -> Budget:
    """What each sensor error contributes to the offset by (36) and (37), for a truck and its sensors.

    Args:
        vehicle: what `oncenter.vehicle` gave; its `[sensors]` say how far off they may be. Without
            `understeer_gradient_deg_m_s2` the core's prior is taken.
        mean_speed_m_s: of driving, true, 1 to 60.
        backlash_rad: the steering's play, full width, 0 to 60 deg; the maintenance standard unless said otherwise.

    Raises:
        OncenterError: "mean_speed", "backlash" (exit 2).
    """
    _check(mean_speed_m_s, backlash_rad)
    params = _core.default_params() | dict(vehicle.params)
    given = vehicle.understeer_gradient_deg_m_s2
    gradient = params["understeer_sd_rad_m_s2"] if given is None else given * DEGREE
    speed_scale = vehicle.sensors.speed_scale_percent / 100.0
    truck = Truck(vehicle.ratio_near_centre, vehicle.wheelbase_m, gradient, mean_speed_m_s, speed_scale)
    contributions = _with_enough(_contributions(truck, vehicle, backlash_rad, params["curvature_max_1_m"]))
    corrected = {c.name: c.corrected_rad for c in contributions}
    bias_rad_s = vehicle.sensors.yaw_rate_bias_deg_s * DEGREE
    unseen = corrected | {
        "yaw_rate_bias": as_printed_rad(truck, bias_rad_s, 0.0),
        "lateral_acceleration_bias": as_printed_rad(truck, 0.0, params["crown_m_s2"]),
    }
    notes = []
    if given is None:
        notes.append(
            f"K_us/g is taken as {gradient / DEGREE:.2f} deg/(m/s^2); 'understeer_gradient_deg_m_s2' in the vehicle"
            " file would say it"
        )
    return Budget(
        version=_core.version(),
        vehicle=vehicle.name,
        truck=truck,
        contributions=contributions,
        total_printed_rad=_root_of_squares(*(c.printed_rad for c in contributions)),
        total_corrected_rad=_root_of_squares(*corrected.values()),
        without_accelerometer_rad=_root_of_squares(*unseen.values()),
        learned_bias_rad=as_corrected_rad(truck, params["gyro_bias_half_width_max_rad_s"], 0.0),
        next_sensor=_next_sensor(contributions),
        notes=tuple(notes),
    )


def _check(mean_speed_m_s: float, backlash_rad: float) -> None:
    if not _SPEEDS_M_S[0] <= mean_speed_m_s <= _SPEEDS_M_S[1]:
        low, high = (f"{speed * 3.6:g}" for speed in _SPEEDS_M_S)
        message = f"the mean speed must be {low} to {high} km/h, got {mean_speed_m_s * 3.6:g}"
        raise OncenterError(message, code="mean_speed", exit_code=WRONG_USAGE)
    if not 0.0 <= backlash_rad <= _BACKLASH_MAX_RAD:
        message = f"the play must be 0 to {_BACKLASH_MAX_RAD / DEGREE:g} deg, got {backlash_rad / DEGREE:g}"
        raise OncenterError(message, code="backlash", exit_code=WRONG_USAGE)


def _contributions(
    truck: Truck, vehicle: Vehicle, backlash_rad: float, curvature_max_1_m: float
) -> tuple[Contribution, ...]:
    """Magnitudes. Play is at most its half, (51); the speed's scale at most what bends all to one side, each as close
    as the gate lets in, make of it."""
    sensors = vehicle.sensors
    bias_rad_s, bias_m_s2 = sensors.yaw_rate_bias_deg_s * DEGREE, sensors.lateral_acceleration_bias_m_s2
    hysteresis_deg = sensors.steering_wheel_angle_hysteresis_deg

    def magnitudes(yaw_rate_bias_rad_s: float, acceleration_bias_m_s2: float) -> tuple[float, float]:
        return (
            abs(as_printed_rad(truck, yaw_rate_bias_rad_s, acceleration_bias_m_s2)),
            abs(as_corrected_rad(truck, yaw_rate_bias_rad_s, acceleration_bias_m_s2)),
        )

    return (
        Contribution(
            "yaw_rate_bias", "yaw rate sensor", sensors.yaw_rate_bias_deg_s, "deg/s", *magnitudes(bias_rad_s, 0.0)
        ),
        Contribution("lateral_acceleration_bias", "accelerometer", bias_m_s2, "m/s^2", *magnitudes(0.0, bias_m_s2)),
        Contribution(
            "speed_scale",
            "speed sensor",
            abs(sensors.speed_scale_percent),
            "%",
            0.0,
            speed_scale_rad(truck, curvature_max_1_m),
        ),
        Contribution(
            "steering_wheel_angle_hysteresis",
            "steering wheel angle sensor",
            hysteresis_deg,
            "deg",
            hysteresis_deg * DEGREE,
            hysteresis_deg * DEGREE,
        ),
        Contribution("backlash", None, backlash_rad / DEGREE, "deg", backlash_rad / 2.0, backlash_rad / 2.0),
    )


def _with_enough(contributions: tuple[Contribution, ...]) -> tuple[Contribution, ...]:
    """All are in proportion to their sizes, but for the speed's scale, which is nearly so."""
    whole = []
    for this in contributions:
        others_rad = [other.corrected_rad for other in contributions if other.sensor not in (None, this.sensor)]
        bound_rad = max(*others_rad, _GOAL_RAD)
        leads = this.sensor is not None and this.corrected_rad > bound_rad
        whole.append(replace(this, enough=this.size * bound_rad / this.corrected_rad if leads else None))
    return tuple(whole)


def _next_sensor(contributions: tuple[Contribution, ...]) -> str | None:
    """The one whose absence lessens the root of squares most."""
    return next((c.sensor for c in contributions if c.enough is not None), None)


def _root_of_squares(*values: float) -> float:
    return math.sqrt(math.fsum(value * value for value in values))
