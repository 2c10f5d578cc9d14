"""Steering wheel torque sensor: the driver's torque plus a zero error."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from oncenter.simulate.chances import named_chances
from oncenter.simulate.sensor_sections import SteeringWheelTorqueSensor
from oncenter.simulate.sensors.faults import Fault, lasting
from oncenter.simulate.sensors.reading import Array, delayed, held, reading


def sense_torque(
    rows: npt.NDArray[np.void], sensor: SteeringWheelTorqueSensor, random: np.random.Generator
) -> tuple[Array, list[Fault]]:
    """The measured torque, N m, left positive, and the faults."""
    chances = named_chances(random, "steering_wheel_torque")
    there = delayed(rows["hand_torque"], sensor) + sensor.zero_error_n_m
    read = reading(there, chances, sensor.noise_sd_n_m, sensor.resolution_n_m, sensor.range_n_m)
    faults = lasting("steering_wheel_torque", "zero_error", sensor.zero_error_n_m, "n_m", len(rows))
    return held(read, sensor.hold_s), faults
