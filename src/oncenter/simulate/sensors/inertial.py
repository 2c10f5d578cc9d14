"""Yaw rate sensor and accelerometers: a bias with drift, random walk, warm-up and steps (2.5)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from oncenter.signals import DEGREE
from oncenter.simulate.chances import named_chances
from oncenter.simulate.drive import RATE_HZ
from oncenter.simulate.sensor_sections import Accelerometer, LateralAccelerometer, YawRateSensor
from oncenter.simulate.sensors.faults import Fault, lasting
from oncenter.simulate.sensors.reading import Array, delayed, held, reading, ticks, warming

_PERCENT = 0.01


@dataclass(frozen=True)
class _Bias:
    """A bias in the sensor's own unit; times `si` it is in `unit`."""

    signal: str
    constants: Mapping[str, float]  # by kind
    drift_1_min: float
    drift_ends_min: float | None
    random_walk_sd_min: float
    warm_up: float
    warm_up_time_min: float
    steps: tuple[tuple[float, float], ...]  # time in s, and size
    unit: str
    si: float


def sense_yaw_rate(
    rows: npt.NDArray[np.void], sensor: YawRateSensor, random: np.random.Generator
) -> tuple[Array, Array, list[Fault]]:
    """The measured yaw rate and its bias, rad/s, and the faults."""
    bias_deg_s, faults = _course(
        _Bias(
            "yaw_rate",
            {"bias": sensor.bias_deg_s},
            sensor.drift_deg_s_min,
            sensor.drift_ends_min,
            sensor.random_walk_sd_deg_s_min,
            sensor.warm_up_deg_s,
            sensor.warm_up_time_min,
            tuple((remount.begin_s, remount.step_deg_s) for remount in sensor.remounts),
            "rad_s",
            DEGREE,
        ),
        len(rows),
        random,
    )
    if sensor.bank_shift_mrad_s_percent != 0.0:
        shift_rad_s = sensor.bank_shift_mrad_s_percent / 1000.0 * 100.0 * rows["cross_slope"]
        bias_deg_s = bias_deg_s + shift_rad_s / DEGREE
        faults += lasting("yaw_rate", "bank_shift", shift_rad_s, "rad_s", len(rows))
    scale, of_scale = _scale(sensor, len(rows))
    read_deg_s = reading(
        delayed(rows["yaw_rate"] / DEGREE, sensor) * scale + bias_deg_s,
        random,
        sensor.noise_sd_deg_s,
        sensor.resolution_deg_s,
        sensor.range_deg_s,
    )
    return held(DEGREE * read_deg_s, sensor.hold_s), DEGREE * bias_deg_s, faults + of_scale


def _scale(sensor: YawRateSensor, count: int) -> tuple[Array, list[Fault]]:
    """Scale factor of the gyro at every tick, which changes with temperature, and its faults."""
    minutes = np.arange(count) / RATE_HZ / 60.0
    error = sensor.scale_error_percent * _PERCENT
    cold = sensor.scale_warm_up_percent * _PERCENT * warming(minutes, sensor.warm_up_time_min)
    faults = lasting("yaw_rate", "scale_error", error, "1", count)
    return 1.0 + error + cold, faults + lasting("yaw_rate", "scale_warm_up", cold, "1", count)


def sense_lateral_acceleration(
    rows: npt.NDArray[np.void], sensor: LateralAccelerometer, random: np.random.Generator
) -> tuple[Array, Array, list[Fault]]:
    """The measured lateral acceleration and its bias, m/s^2, and the faults, including those of the mounting."""
    felt = rows["felt_lateral_acceleration"]
    added = {}
    if sensor.roll_share < 1.0:
        added["roll_share"] = (1.0 - sensor.roll_share) * (rows["lateral_acceleration"] - felt)
    if sensor.ahead_of_gravity_centre_m != 0.0:
        added["ahead_of_gravity_centre"] = sensor.ahead_of_gravity_centre_m * np.gradient(rows["yaw_rate"]) * RATE_HZ
    if sensor.turned_deg != 0.0:
        added["turned"] = np.sin(sensor.turned_deg * DEGREE) * rows["longitudinal_acceleration"]
    there = sum(added.values(), felt)
    read, bias, faults = sense_acceleration("lateral_acceleration", there, sensor, random)
    for kind, part in added.items():
        faults += lasting("lateral_acceleration", kind, part, "m_s2", len(rows))
    return read, bias, faults


def sense_acceleration(
    signal: str, true_m_s2: Array, sensor: Accelerometer, random: np.random.Generator
) -> tuple[Array, Array, list[Fault]]:
    """The measured acceleration and its bias, m/s^2, and the faults."""
    bias, faults = _course(
        _Bias(
            signal,
            sensor.constants_m_s2,
            sensor.drift_m_s2_min,
            sensor.drift_ends_min,
            sensor.random_walk_sd_m_s2_min,
            sensor.warm_up_m_s2,
            sensor.warm_up_time_min,
            tuple((remount.begin_s, remount.step_m_s2) for remount in sensor.remounts),
            "m_s2",
            1.0,
        ),
        len(true_m_s2),
        random,
    )
    felt = delayed(true_m_s2, sensor)
    read = reading(felt + bias, random, sensor.noise_sd_m_s2, sensor.resolution_m_s2, sensor.range_m_s2)
    return held(read, sensor.hold_s), bias, faults


def _course(bias: _Bias, count: int, random: np.random.Generator) -> tuple[Array, list[Fault]]:
    """The bias at every tick, and its parts as faults."""
    minutes = np.arange(count) / RATE_HZ / 60.0
    parts = {kind: np.full(count, constant) for kind, constant in bias.constants.items()}
    if bias.drift_1_min != 0.0:
        parts["drift"] = bias.drift_1_min * np.minimum(minutes, bias.drift_ends_min or np.inf)
    if bias.random_walk_sd_min > 0.0:
        steps = named_chances(random, f"{bias.signal} random walk").standard_normal(count)
        parts["random_walk"] = np.cumsum(steps) * bias.random_walk_sd_min * np.sqrt(minutes[1])
    if bias.warm_up != 0.0:
        parts["warm_up"] = bias.warm_up * warming(minutes, bias.warm_up_time_min)
    faults = [f for kind, part in parts.items() for f in lasting(bias.signal, kind, bias.si * part, bias.unit, count)]
    total = sum(parts.values(), np.zeros(count))
    for begin_s, step in bias.steps:
        total[ticks(begin_s, None)] += step
        faults += lasting(bias.signal, "remount", bias.si * step, bias.unit, count, begin_s)
    return total, faults
