"""Vehicle and wheel speeds: what passes under each wheel, and what its control unit makes of the wheel's turning."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from oncenter.simulate.drive import RATE_HZ
from oncenter.simulate.sensor_sections import SpeedSensor, WheelSpeedSensors
from oncenter.simulate.sensors.faults import Fault, lasting
from oncenter.simulate.sensors.reading import Array, reading
from oncenter.simulate.truck import first_axle_distance_m
from oncenter.simulate.truck_sections import Truck

CORNERS = ("front_left", "front_right", "rear_left", "rear_right")
_PERCENT = 0.01


def sense_vehicle_speed(true_m_s: Array, sensor: SpeedSensor, random: np.random.Generator) -> tuple[Array, list[Fault]]:
    """The vehicle's speed as read, m/s, and what was wrong."""
    scale = sensor.scale_error_percent * _PERCENT
    faults = lasting("vehicle_speed", "scale_error", scale, "1", len(true_m_s))
    return _rolling(true_m_s * (1.0 + scale), sensor, random), faults


def sense_wheel_speeds(
    truck: Truck,
    rows: npt.NDArray[np.void],
    sensor: WheelSpeedSensors,
    as_fine_as: SpeedSensor,
    random: np.random.Generator,
) -> tuple[dict[str, Array], list[Fault]]:
    """The wheels' speeds as read, m/s by signal name, and what was wrong with them."""
    scale = sensor.scale_error_percent * _PERCENT
    faults = lasting("wheel_speed", "scale_error", scale, "1", len(rows))
    if sensor.load_transfer_percent_m_s2 > 0.0:
        shares = sensor.load_transfer_percent_m_s2 * _PERCENT * rows["lateral_acceleration"]
        faults += lasting("wheel_speed", "load_transfer", shares, "1", len(rows))
    columns = {}
    for name, speed in wheel_speeds(truck, rows).items():
        corner = name.removeprefix("wheel_speed_")
        larger = getattr(sensor.radius_error_percent, corner) * _PERCENT
        faults += lasting(name, "radius_error", larger, "1", len(rows))
        said = speed * (1.0 + scale) / (1.0 + larger)
        if sensor.load_transfer_percent_m_s2 > 0.0:  # the load goes to the right in a left turn and flattens its tyres
            said = said / (1.0 + shares if corner.endswith("left") else 1.0 - shares)
        if sensor.pulses_per_turn > 0:
            said = _by_pulses(said, sensor)
        columns[name] = _rolling(said, as_fine_as, random)
    return columns, faults


def wheel_speeds(truck: Truck, rows: npt.NDArray[np.void]) -> dict[str, Array]:
    """m/s by signal name: how fast the ground passes under each wheel, along the wheel."""
    v, r = rows["vehicle_speed"], rows["yaw_rate"]
    half_front, half_rear = truck.track_width_front_m / 2.0, truck.track_width_rear_m / 2.0
    cos, sin = np.cos(rows["front_wheel_angle"]), np.sin(rows["front_wheel_angle"])
    sideways = rows["lateral_speed"] + first_axle_distance_m(truck) * r
    return {
        "wheel_speed_front_left": (v - half_front * r) * cos + sideways * sin,
        "wheel_speed_front_right": (v + half_front * r) * cos + sideways * sin,
        "wheel_speed_rear_left": v - half_rear * r,
        "wheel_speed_rear_right": v + half_rear * r,
    }


def _by_pulses(speed: Array, sensor: WheelSpeedSensors) -> Array:
    """What a control unit says that times the teeth of a pole wheel: nought where none passed within its window."""
    per_pulse_m = 2.0 * np.pi * sensor.rolling_radius_m / sensor.pulses_per_turn
    time = np.arange(len(speed)) / RATE_HZ
    rolled = np.concatenate(([0.0], np.cumsum(np.abs(speed[:-1]) / RATE_HZ))) / per_pulse_m  # pulses and parts
    latest = np.floor(rolled)
    moving = np.concatenate(([True], np.diff(rolled) > 0.0))  # interpolation needs pulses that grow
    at = np.interp(latest, rolled[moving], time[moving])
    window = max(round(sensor.pulse_window_s * RATE_HZ), 1)
    before = np.maximum(np.arange(len(speed)) - window, 0)
    pulses, spent = latest - latest[before], at - at[before]
    return np.divide(pulses * per_pulse_m, spent, out=np.zeros_like(speed), where=(pulses > 0.0) & (spent > 0.0))


def _rolling(true: Array, sensor: SpeedSensor, random: np.random.Generator) -> Array:
    """A speed sensor counts teeth: it says nothing of a wheel that stands, and never less than nothing."""
    read = reading(true, random, sensor.noise_sd_m_s, sensor.resolution_m_s, np.inf)
    return np.where(true > 0.0, np.maximum(read, 0.0), 0.0)
