"""The status signals of a drive, 1 or 0 at each tick, and the angle of a steered rear axle."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from oncenter.signals import DEGREE
from oncenter.simulate.chances import named_chances
from oncenter.simulate.interventions import at_work
from oncenter.simulate.scenario import Scenario
from oncenter.simulate.sensor_sections import RearAxleAngleSensor
from oncenter.simulate.sensors.faults import Fault, lasting
from oncenter.simulate.sensors.reading import Array, delayed, held, reading

_LIFTED_SHARE = 0.5  # of the way up, at which the switch of a lift axle closes


def true_statuses(scenario: Scenario, rows: npt.NDArray[np.void]) -> dict[str, Array]:
    """Each status by its name, as a bus sends it."""
    time_s, lifts = rows["time"], bool(scenario.truck.lift_axle_up_s)
    return {
        "stability_control_active": at_work(scenario.interventions, "stability_control", time_s),
        "anti_lock_active": at_work(scenario.interventions, "anti_lock", time_s),
        "steering_assist_active": np.ascontiguousarray(rows["motor_carries"]),
        "reverse": (rows["vehicle_speed"] < 0.0).astype(np.float64),
        "axle_lifted": (rows["second_truck"] > _LIFTED_SHARE).astype(np.float64) * lifts,
    }


def sense_rear_axle_angle(
    rows: npt.NDArray[np.void], sensor: RearAxleAngleSensor, random: np.random.Generator
) -> tuple[Array, list[Fault]]:
    """The measured angle of the rear road wheels, rad, left positive, and the faults."""
    chances = named_chances(random, "rear_axle_angle")
    there_deg = delayed(rows["rear_axle_angle"] / DEGREE, sensor) + sensor.offset_deg
    read_deg = reading(there_deg, chances, sensor.noise_sd_deg, sensor.resolution_deg, sensor.range_deg)
    faults = lasting("rear_axle_angle", "offset", sensor.offset_deg * DEGREE, "rad", len(rows))
    return held(DEGREE * read_deg, sensor.hold_s), faults
