"""A GNSS receiver with inertial sensors, as the thesis's RT3040 (chapter 3): position, heading, speed."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from oncenter.signals import DEGREE
from oncenter.simulate.chances import named_chances
from oncenter.simulate.sensor_sections import Gnss
from oncenter.simulate.sensors.reading import Array, delayed, fading, held
from oncenter.wgs84 import radii_of_curvature_m

_RECEIVED = ("east", "north", "heading", "vehicle_speed", "lateral_speed")


def sense_gnss(rows: npt.NDArray[np.void], sensor: Gnss, random: np.random.Generator) -> tuple[dict[str, Array], Array]:
    """Latitude, longitude and heading (clockwise from north) in deg by signal name, and the speed over ground, m/s."""

    def error(what: str, sd: float, time_s: float) -> Array:
        return fading(len(rows), named_chances(random, f"gnss {what}"), sd, time_s)

    true = {name: delayed(rows[name], sensor) for name in _RECEIVED}
    east_m = true["east"] + error("east", sensor.position_sd_m, sensor.position_time_s)
    north_m = true["north"] + error("north", sensor.position_sd_m, sensor.position_time_s)
    north_radius_m, east_radius_m = radii_of_curvature_m(sensor.latitude_deg)
    latitude_deg = sensor.latitude_deg + north_m / north_radius_m / DEGREE
    longitude_deg = sensor.longitude_deg + east_m / (east_radius_m * np.cos(latitude_deg * DEGREE)) / DEGREE
    heading_deg = 90.0 - true["heading"] / DEGREE + error("heading", sensor.heading_sd_deg, sensor.heading_time_s)
    columns = {
        "latitude": latitude_deg,
        "longitude": (longitude_deg + 180.0) % 360.0 - 180.0,
        "heading": heading_deg % 360.0,
    }
    over_ground = np.hypot(true["vehicle_speed"], true["lateral_speed"])
    columns = {name: held(received, sensor.hold_s) for name, received in columns.items()}
    return columns, held(over_ground, sensor.hold_s)
