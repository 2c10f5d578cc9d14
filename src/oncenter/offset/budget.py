"""Error budget of the thesis's offset: (47) and (48) for any truck, and the sensor to improve first.

In (48) the yaw rate bias also acts through K_us. With an accelerometer it does not: (33) subtracts r*v and (37) adds it
again, so that only the measured lateral acceleration acts through K_us. As printed, (48) holds without an
accelerometer, with the road bank in place of its bias. SI and rad; degrees appear in text and JSON.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from typing import Any

from oncenter import _core
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.findings import PLAY_STANDARD_DEG
from oncenter.signals import DEGREE
from oncenter.vehicle import Vehicle, require_truck

MEAN_SPEED_M_S = 15.0  # Figure 16
BACKLASH_RAD = PLAY_STANDARD_DEG * DEGREE
_SPEEDS_M_S = (1.0, 60.0)
_BACKLASH_MAX_RAD = 60.0 * DEGREE
_GOAL_RAD = 1.5 * DEGREE  # 5.3.1
_GAIN_REPORTED_BELOW = 0.95  # of a total: a smaller gain is not relevant


@dataclass(frozen=True)
class Truck:
    """Inputs of (48). `understeer_gradient` is K_us/g at the road wheel, rad/(m/s^2); `mean_speed_m_s` is the true one;
    `speed_scale` is lambda of (45), the share by which the measured speed is too high."""

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
    """The offset's error with (33) and (37) combined, with the accelerometer bias in place of that of the bank."""
    i, L, K, v = truck.steering_ratio, truck.wheelbase_m, truck.understeer_gradient, truck.mean_speed_m_s
    return i * L * yaw_rate_bias_rad_s / (v * (1.0 + truck.speed_scale)) + i * K * acceleration_bias_m_s2


def speed_scale_rad(truck: Truck, mean_curvature_1_m: float) -> float:
    """The part of (47) that (48) omits: a wrong speed changes the curvature; zero for bends to both sides equally."""
    scale = truck.speed_scale
    return abs(truck.steering_ratio * truck.wheelbase_m * scale / (1.0 + scale) * mean_curvature_1_m)


@dataclass(frozen=True)
class Contribution:
    """One sensor error and its effect on the offset.

    Attributes:
        name: snake_case.
        sensor: with this error; None for the play of the steering.
        size, unit: as in files.
        printed_rad: by (48), or the thesis's text; corrected_rad: by the corrected equation.
        enough: for the sensor with the largest effect, where that exceeds the 1.5 deg of 5.3.1: the size, in `unit`, at
            which its effect is no larger than that limit or the next sensor's; None for all others.
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
    """Effect of each error on the offset of (36) and (37).

    `total_*` are roots of the sums of squares. `without_accelerometer_rad` is the total with r*v as lateral
    acceleration on roads with a usual crown. `learned_bias_rad` is the effect of the remaining yaw rate bias that the
    joint method accepts as valid. `next_sensor` is the sensor with the largest effect, None where no effect exceeds
    1.5 deg.
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
        rows.append(("total (root of squares)", "", self.total_printed_rad, self.total_corrected_rad))
        lines = [
            f"error budget of the offset (36) for the sensors of {self.vehicle} at {speed_km_h:.0f} km/h",
            "",
            f"  {'error':33}{'size':>12}{'(48), printed':>17}{'corrected':>13}",
            *(f"  {name:33}{size:>12}{p / DEGREE:13.2f} deg{c / DEGREE:9.2f} deg" for name, size, p, c in rows),
            "",
            *self.advice(),
            *(f"note: {note}" for note in self.notes),
        ]
        return "\n".join(lines)

    def advice(self) -> list[str]:
        """Recommended actions, a line each."""
        lines = []
        leading = next((c for c in self.contributions if c.sensor is not None and c.sensor == self.next_sensor), None)
        if leading is None:
            lines.append(f"next: no sensor adds more than {_GOAL_RAD / DEGREE:g} deg")
        else:
            lines.append(
                f"next: a better {leading.sensor}: with an error of at most {leading.enough:.2g} {leading.unit} it adds"
                f" no more than {_GOAL_RAD / DEGREE:g} deg or than the next sensor"
            )
        if self.next_sensor == "yaw rate sensor":
            lines.append(
                "instead of a better sensor: half a second at standstill, or wheel speeds, identify its bias; a valid"
                f" estimate of the joint method leaves {self.learned_bias_rad / DEGREE:.2f} deg"
            )
        if self.without_accelerometer_rad < _GAIN_REPORTED_BELOW * self.total_corrected_rad:
            lines.append(
                "do not use this accelerometer (--no-accelerometer): without it, on a usual road crown, the total is"
                f" {self.without_accelerometer_rad / DEGREE:.2f} deg"
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
    """Effect of each sensor error on the offset by (36) and (37), for a truck and its sensors.

    Args:
        vehicle: from `oncenter.vehicle`; its `[sensors]` table gives the errors of its sensors. Without
            `understeer_gradient_deg_m_s2` the core's prior is used.
        mean_speed_m_s: true mean speed, 1 to 60.
        backlash_rad: play of the steering, full width, 0 to 60 deg; the default is the maintenance standard.

    Raises:
        OncenterError: "mean_speed", "backlash", "vehicle_file" (exit 2).
    """
    require_truck(vehicle, "the error budget")
    _check(mean_speed_m_s, backlash_rad)
    params = _core.default_params() | dict(vehicle.params)
    given = vehicle.understeer_gradient_deg_m_s2
    gradient = params["understeer_sd_rad_m_s2"] if given is None else given * DEGREE
    speed_scale = vehicle.sensors.speed_scale_percent / 100.0
    truck = Truck(vehicle.ratio_near_centre, vehicle.wheelbase_m, gradient, mean_speed_m_s, speed_scale)
    contributions = _with_enough(_contributions(truck, vehicle, backlash_rad, params["curvature_max_1_m"]))
    corrected = {c.name: c.corrected_rad for c in contributions}
    bias_rad_s = vehicle.sensors.yaw_rate_bias_deg_s * DEGREE
    without = corrected | {
        "yaw_rate_bias": as_printed_rad(truck, bias_rad_s, 0.0),
        "lateral_acceleration_bias": as_printed_rad(truck, 0.0, params["crown_m_s2"]),
    }
    notes = []
    if given is None:
        notes.append(
            f"the understeer gradient is assumed to be {gradient / DEGREE:.2f} deg/(m/s^2); give"
            " 'understeer_gradient_deg_m_s2' in the vehicle file"
        )
    return Budget(
        version=_core.version(),
        vehicle=vehicle.name,
        truck=truck,
        contributions=contributions,
        total_printed_rad=_root_of_squares(*(c.printed_rad for c in contributions)),
        total_corrected_rad=_root_of_squares(*corrected.values()),
        without_accelerometer_rad=_root_of_squares(*without.values()),
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
    """Magnitudes. Play has at most the effect of its half, (51). The speed scale has its largest effect in bends that
    are all to one side and as tight as the gate accepts."""
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
    """Each effect is in proportion to its size; that of the speed scale nearly."""
    whole = []
    for this in contributions:
        others_rad = [other.corrected_rad for other in contributions if other.sensor not in (None, this.sensor)]
        bound_rad = max(*others_rad, _GOAL_RAD)
        leads = this.sensor is not None and this.corrected_rad > bound_rad
        whole.append(replace(this, enough=this.size * bound_rad / this.corrected_rad if leads else None))
    return tuple(whole)


def _next_sensor(contributions: tuple[Contribution, ...]) -> str | None:
    """The sensor with the largest effect above the goal."""
    return next((c.sensor for c in contributions if c.enough is not None), None)


def _root_of_squares(*values: float) -> float:
    return math.sqrt(math.fsum(value * value for value in values))
