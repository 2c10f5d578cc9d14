"""Simulates the sensors: resolution, range, bias and noise (Table 1), and faults."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import polars as pl

from oncenter.signals import SIGNALS, Signals, Source
from oncenter.simulate.drive import RATE_HZ
from oncenter.simulate.interventions import wheel_slip
from oncenter.simulate.scenario import Scenario
from oncenter.simulate.sensor_sections import Gnss, Sensor
from oncenter.simulate.sensors.angle import sense_angle
from oncenter.simulate.sensors.faults import Fault, delays, silenced, silences
from oncenter.simulate.sensors.gnss import sense_gnss
from oncenter.simulate.sensors.inertial import sense_acceleration, sense_lateral_acceleration, sense_yaw_rate
from oncenter.simulate.sensors.reading import Array
from oncenter.simulate.sensors.status import sense_rear_axle_angle, true_statuses
from oncenter.simulate.sensors.torque import sense_torque
from oncenter.simulate.sensors.wheels import CORNERS, sense_vehicle_speed, sense_wheel_speeds

__all__ = ["Fault", "Sensed", "sense"]


@dataclass(frozen=True)
class Sensed:
    """A drive as its sensors report it.

    Attributes:
        signals: at `RATE_HZ`, NaN where a sensor gives no value.
        speed_over_ground_m_s: from a GNSS receiver; None without one.
        statuses: those that the bus sends, by name: 1, or 0.
        faults: all sensor faults, in order of time.
        offset_rad: of the steering wheel angle at the end of the drive, without the whole turns of a relative sensor.
        courses: sensor errors at every tick, by column of the truth.
    """

    signals: Signals
    speed_over_ground_m_s: Array | None
    statuses: Mapping[str, Array]
    faults: tuple[Fault, ...]
    offset_rad: float
    courses: Mapping[str, Array]


def sense(scenario: Scenario, rows: npt.NDArray[np.void], random: np.random.Generator) -> Sensed:
    """The drive as its sensors report it.

    The white noise of Table 1's sensors is always drawn completely, in this order, from `random`. Every other random
    effect draws from a child generator with its own name.
    """
    sensors = scenario.sensors
    columns: dict[str, Array] = {}
    faults: list[Fault] = []

    def take(signal: str, read: Array, sensor: Sensor, own: list[Fault]) -> None:
        """Adds a signal after the faults of its sensor, and those faults."""
        silent = silences(signal, sensor, len(rows), random)
        faults.extend([*own, *delays(signal, sensor, len(rows)), *silent])
        columns[signal] = silenced(read, [*own, *silent])

    angle, offset, offset_and_turns, of_angle = sense_angle(
        rows["steering_wheel_angle"], sensors.steering_wheel_angle, random
    )
    take("steering_wheel_angle", angle, sensors.steering_wheel_angle, of_angle)
    yaw_rate, yaw_rate_bias, of_yaw_rate = sense_yaw_rate(rows, sensors.yaw_rate, random)
    take("yaw_rate", yaw_rate, sensors.yaw_rate, of_yaw_rate)
    speed, of_speed = sense_vehicle_speed(rows["vehicle_speed"], sensors.speed, random)
    take("vehicle_speed", speed, sensors.speed, of_speed)
    biases = {}
    signal = "lateral_acceleration"
    acceleration, biases[signal], own = sense_lateral_acceleration(rows, sensors.lateral_acceleration, random)
    take(signal, acceleration, sensors.lateral_acceleration, own)
    signal, along = "longitudinal_acceleration", sensors.longitudinal_acceleration
    acceleration, biases[signal], own = sense_acceleration(signal, rows[signal], along, random)
    take(signal, acceleration, along, own)

    if sensors.steering_wheel_torque is not None:
        torque, of_torque = sense_torque(rows, sensors.steering_wheel_torque, random)
        take("steering_wheel_torque", torque, sensors.steering_wheel_torque, of_torque)
    faults += _take_wheels(columns, rows, scenario, random)
    absolute = float(sensors.steering_wheel_angle.relative is None)
    columns["steering_wheel_angle_sensor_type"] = np.full(len(rows), absolute)
    speed_over_ground, of_gnss = _take_gnss(columns, rows, sensors.gnss, random)
    faults += of_gnss
    if sensors.rear_axle_angle is not None:
        rear_angle, of_rear_axle = sense_rear_axle_angle(rows, sensors.rear_axle_angle, random)
        take("rear_axle_angle", rear_angle, sensors.rear_axle_angle, of_rear_axle)
    statuses: dict[str, Array] = {
        name: true for name, true in true_statuses(scenario, rows).items() if name in sensors.statuses
    }
    columns = {name: read for name, read in (columns | statuses).items() if name in SIGNALS}
    return Sensed(
        _signals(scenario.name, rows["time"], columns),
        speed_over_ground,
        statuses,
        tuple(sorted(faults, key=lambda fault: fault.begin_s)),
        float(offset[-1]),
        {
            "steering_wheel_angle_offset_rad": offset_and_turns,
            "yaw_rate_bias_rad_s": yaw_rate_bias,
            **{f"{signal}_bias_m_s2": bias for signal, bias in biases.items()},
        },
    )


def _take_wheels(
    columns: dict[str, Array], rows: npt.NDArray[np.void], scenario: Scenario, random: np.random.Generator
) -> list[Fault]:
    """Adds the four wheel speeds to the columns; returns their faults."""
    sensor = scenario.sensors.wheel_speed
    slips = None
    if scenario.interventions:
        slips = {corner: wheel_slip(scenario.interventions, k, rows["time"]) for k, corner in enumerate(CORNERS)}
    wheels, faults = sense_wheel_speeds(scenario.truck, rows, sensor, scenario.sensors.speed, random, slips)
    silent = silences("wheel_speed", sensor, len(rows), random)
    columns |= {wheel: silenced(read, silent) for wheel, read in wheels.items()}
    return faults + delays("wheel_speed", sensor, len(rows)) + silent


def _take_gnss(
    columns: dict[str, Array], rows: npt.NDArray[np.void], gnss: Gnss | None, random: np.random.Generator
) -> tuple[Array | None, list[Fault]]:
    """Adds a receiver's signals to the columns; returns its speed over ground and its faults."""
    if gnss is None:
        return None, []
    received, over_ground = sense_gnss(rows, gnss, random)
    silent = silences("gnss", gnss, len(rows), random)
    columns |= {signal: silenced(read, silent) for signal, read in received.items()}
    return silenced(over_ground, silent), delays("gnss", gnss, len(rows)) + silent


def _signals(name: str, time: Array, columns: Mapping[str, Array]) -> Signals:
    table = pl.DataFrame({"time_s": time, **{SIGNALS[signal].column: values for signal, values in columns.items()}})
    sources = {
        signal: Source(f"simulated by {name}", RATE_HZ, len(time), int(np.isnan(values).sum()))
        for signal, values in columns.items()
    }
    return Signals(table, sources, RATE_HZ, name)
