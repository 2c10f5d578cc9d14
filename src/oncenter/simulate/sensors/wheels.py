"""Vehicle speed and wheel speeds: the true speed at each wheel, and the reading of the control unit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from oncenter.simulate.chances import named_chances
from oncenter.simulate.drive import RATE_HZ
from oncenter.simulate.sensor_sections import Sensor, SpeedSensor, WheelSpeedSensors
from oncenter.simulate.sensors.faults import Fault, lasting
from oncenter.simulate.sensors.reading import Array, aged, held, low_passed, reading, warming
from oncenter.simulate.truck import first_axle_distance_m
from oncenter.simulate.truck_sections import Truck

CORNERS = ("front_left", "front_right", "rear_left", "rear_right")
_PERCENT = 0.01
_TICKS_A_FRAME = round(0.02 * RATE_HZ)  # HRW is sent every 20 ms


def sense_vehicle_speed(true_m_s: Array, sensor: SpeedSensor, random: np.random.Generator) -> tuple[Array, list[Fault]]:
    """The measured vehicle speed, m/s, positive backwards as well, and its faults."""
    scale = sensor.scale_error_percent * _PERCENT
    faults = lasting("vehicle_speed", "scale_error", scale, "1", len(true_m_s))
    return _rolling(
        np.abs(true_m_s) * (1.0 + scale), sensor, random, sensor.noise_sd_m_s, sensor.resolution_m_s
    ), faults


def sense_wheel_speeds(
    truck: Truck,
    rows: npt.NDArray[np.void],
    sensor: WheelSpeedSensors,
    as_fine_as: SpeedSensor,
    random: np.random.Generator,
    slips: Mapping[str, Array] | None = None,
) -> tuple[dict[str, Array], list[Fault]]:
    """The measured wheel speeds, m/s by signal name, and their faults.

    Noise and resolution come from `as_fine_as` if their own section gives none. `slips` are shares of the speed, by
    corner.
    """
    noise_sd = as_fine_as.noise_sd_m_s if sensor.noise_sd_m_s is None else sensor.noise_sd_m_s
    resolution = as_fine_as.resolution_m_s if sensor.resolution_m_s is None else sensor.resolution_m_s
    scale = sensor.scale_error_percent * _PERCENT
    faults = lasting("wheel_speed", "scale_error", scale, "1", len(rows))
    if sensor.load_transfer_percent_m_s2 > 0.0:
        shares = sensor.load_transfer_percent_m_s2 * _PERCENT * rows["lateral_acceleration"]
        faults += lasting("wheel_speed", "load_transfer", shares, "1", len(rows))
    columns = {}
    for name, speed in wheel_speeds(truck, rows).items():
        corner = name.removeprefix("wheel_speed_")
        larger, of_radius = _radius_factor(name, corner, sensor, len(rows))
        faults += of_radius
        rolled = speed if slips is None else speed * (1.0 - slips[corner])
        measured = rolled * (1.0 + scale) / larger
        if sensor.load_transfer_percent_m_s2 > 0.0:  # a left turn loads the right tyres, whose radius decreases
            measured = measured / (1.0 + shares if corner.endswith("left") else 1.0 - shares)
        if sensor.pulses_per_turn > 0:
            measured = _by_pulses(measured, sensor)
        columns[name] = _rolling(measured, sensor, random, noise_sd, resolution)
    if sensor.repeat_share > 0.0:
        faults.append(Fault("wheel_speed", "repeats", 0.0, len(rows) / RATE_HZ))
        sent = _sent_at(len(rows), sensor.repeat_share, named_chances(random, "wheel_speed repeats"))
        columns = {name: read[sent] for name, read in columns.items()}
    return columns, faults


def wheel_speeds(truck: Truck, rows: npt.NDArray[np.void]) -> dict[str, Array]:
    """Ground speed at each wheel along the wheel's plane, m/s by signal name, positive backwards as well."""
    forwards = np.where(rows["vehicle_speed"] < 0.0, -1.0, 1.0)
    v, r = rows["vehicle_speed"], rows["yaw_rate"]
    half_front, half_rear = truck.track_width_front_m / 2.0, truck.track_width_rear_m / 2.0
    cos, sin = np.cos(rows["front_wheel_angle"]), np.sin(rows["front_wheel_angle"])
    sideways = rows["lateral_speed"] + first_axle_distance_m(truck) * r
    return {
        "wheel_speed_front_left": forwards * ((v - half_front * r) * cos + sideways * sin),
        "wheel_speed_front_right": forwards * ((v + half_front * r) * cos + sideways * sin),
        "wheel_speed_rear_left": forwards * (v - half_rear * r),
        "wheel_speed_rear_right": forwards * (v + half_rear * r),
    }


def _by_pulses(speed: Array, sensor: WheelSpeedSensors) -> Array:
    """The speed from timing the teeth of a pole wheel: 0 if no tooth passed within the window."""
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


def _radius_factor(name: str, corner: str, sensor: WheelSpeedSensors, count: int) -> tuple[Array, list[Fault]]:
    """Ratio of a wheel's actual radius to the control unit's value at every tick, and its faults."""
    error = getattr(sensor.radius_error_percent, corner) * _PERCENT
    growth = getattr(sensor.radius_warm_up_percent, corner) * _PERCENT
    begin_s = sensor.radius_warm_up_begin_s
    minutes = np.maximum(np.arange(count) / RATE_HZ - begin_s, 0.0) / 60.0
    grown = growth * (1.0 - warming(minutes, sensor.radius_warm_up_time_min))
    faults = lasting(name, "radius_error", error, "1", count)
    faults += lasting(name, "radius_warm_up", grown, "1", count, begin_s)
    return (1.0 + error) * (1.0 + grown), faults


def _sent_at(count: int, repeat_share: float, random: np.random.Generator) -> npt.NDArray[np.intp]:
    """The tick at which the values of each tick's frame were new: some frames repeat the one before."""
    frame = np.arange(count) // _TICKS_A_FRAME
    is_new = random.random(frame[-1] + 1) >= repeat_share
    is_new[0] = True
    newest = np.maximum.accumulate(np.where(is_new, np.arange(len(is_new)), 0))
    return newest[frame] * _TICKS_A_FRAME


def _rolling(true: Array, sensor: Sensor, random: np.random.Generator, noise_sd: float, resolution: float) -> Array:
    """A speed sensor counts teeth: it reads 0 at standstill, and never a negative speed.

    Without teeth the reading is 0 at once, even behind a low pass.
    """
    counted = aged(true, sensor.latency_s)
    read = reading(low_passed(counted, sensor.filter_time_s), random, noise_sd, resolution, np.inf)
    return held(np.where(counted > 0.0, np.maximum(read, 0.0), 0.0), sensor.hold_s)
