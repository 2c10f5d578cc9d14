"""What the truck's sensors make of what is true: Table 1's resolution, range, bias and noise."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import polars as pl

from oncenter.signals import DEGREE, SIGNALS, Signals, Source
from oncenter.simulate.drive import RATE_HZ
from oncenter.simulate.scenario import Accelerometer, Scenario, SpeedSensor, Truck

Array = npt.NDArray[np.float64]


def sense(scenario: Scenario, rows: npt.NDArray[np.void], random: np.random.Generator) -> Signals:
    """The drive as its sensors report it, at `RATE_HZ`."""
    sensors = scenario.sensors
    angle, gyro = sensors.steering_wheel_angle, sensors.yaw_rate
    columns = {
        "steering_wheel_angle": DEGREE
        * _reading(
            rows["steering_wheel_angle"] / DEGREE + angle.offset_deg,
            random,
            angle.noise_sd_deg,
            angle.resolution_deg,
            angle.range_deg,
        ),
        "yaw_rate": DEGREE
        * _reading(
            rows["yaw_rate"] / DEGREE + gyro.bias_deg_s,
            random,
            gyro.noise_sd_deg_s,
            gyro.resolution_deg_s,
            gyro.range_deg_s,
        ),
        "vehicle_speed": _rolling(rows["vehicle_speed"], sensors.speed, random),
        "lateral_acceleration": _acceleration(rows["lateral_acceleration"], sensors.lateral_acceleration, random),
        "longitudinal_acceleration": _acceleration(
            rows["longitudinal_acceleration"], sensors.longitudinal_acceleration, random
        ),
    }
    for wheel, speed in wheel_speeds(scenario.truck, rows).items():
        columns[wheel] = _rolling(speed, sensors.speed, random)
    table = pl.DataFrame({"time_s": rows["time"], **{SIGNALS[name].column: values for name, values in columns.items()}})
    source = Source(f"simulated by {scenario.name}", RATE_HZ, len(rows), 0)
    return Signals(table, dict.fromkeys(columns, source), RATE_HZ, scenario.name)


def wheel_speeds(truck: Truck, rows: npt.NDArray[np.void]) -> dict[str, Array]:
    """m/s by signal name: how fast the ground passes under each wheel, along the wheel."""
    v, r = rows["vehicle_speed"], rows["yaw_rate"]
    half_front, half_rear = truck.track_width_front_m / 2.0, truck.track_width_rear_m / 2.0
    cos, sin = np.cos(rows["front_wheel_angle"]), np.sin(rows["front_wheel_angle"])
    sideways = rows["lateral_speed"] + truck.front_axle_distance_m * r
    return {
        "wheel_speed_front_left": (v - half_front * r) * cos + sideways * sin,
        "wheel_speed_front_right": (v + half_front * r) * cos + sideways * sin,
        "wheel_speed_rear_left": v - half_rear * r,
        "wheel_speed_rear_right": v + half_rear * r,
    }


def _acceleration(true: Array, sensor: Accelerometer, random: np.random.Generator) -> Array:
    return _reading(true + sensor.bias_m_s2, random, sensor.noise_sd_m_s2, sensor.resolution_m_s2, sensor.range_m_s2)


def _rolling(true: Array, sensor: SpeedSensor, random: np.random.Generator) -> Array:
    """A speed sensor counts teeth: it says nothing of a wheel that stands, and never less than nothing."""
    read = _reading(true, random, sensor.noise_sd_m_s, sensor.resolution_m_s, np.inf)
    return np.where(true > 0.0, np.maximum(read, 0.0), 0.0)


def _reading(value: Array, random: np.random.Generator, noise_sd: float, resolution: float, range_: float) -> Array:
    """Noisy, within the range, in whole steps of the resolution (0: no steps); all in one unit."""
    noisy = np.clip(value + noise_sd * random.standard_normal(len(value)), -range_, range_)
    return np.round(noisy / resolution) * resolution if resolution > 0.0 else noisy
