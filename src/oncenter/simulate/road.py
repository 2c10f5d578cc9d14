"""A road from a seeded generator: straights and bends with clothoids, a crown, and the speed it is driven at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from oncenter.signals import DEGREE
from oncenter.simulate.scenario import Scenario

Array = npt.NDArray[np.float64]

SPACING_M = 5.0
_DECELERATION_SHARE = 0.6  # of the driver's limit is planned with: feet answer late


@dataclass(frozen=True)
class LaidRoad:
    """Columns over the road's length, at every `SPACING_M`."""

    curvature_1_m: Array  # left positive
    cross_slope: Array  # sine of the bank, positive where the road falls to the right
    speed_m_s: Array

    @property
    def mirrored(self) -> LaidRoad:
        """The same road with left and right exchanged."""
        return LaidRoad(-self.curvature_1_m, -self.cross_slope, self.speed_m_s)


def lay_road(scenario: Scenario, random: np.random.Generator) -> LaidRoad:
    """A road long enough for the whole drive."""
    length_m = scenario.driver.speed_km_h[1] / 3.6 * scenario.drive.duration_s
    station_m = np.arange(0.0, length_m + 2 * SPACING_M, SPACING_M)
    curvature = _curvature(scenario, station_m, random)
    cross_slope = np.full_like(station_m, scenario.road.crown_percent / 100.0)
    return LaidRoad(curvature, cross_slope, _speed(scenario, station_m, curvature, random))


def _curvature(scenario: Scenario, station_m: Array, random: np.random.Generator) -> Array:
    """1/m: trapezoids of either sign between straights."""
    road = scenario.road
    knots_m, knots_1_m, end_m = [0.0], [0.0], 0.0
    while end_m < station_m[-1]:
        radius_m = np.exp(random.uniform(*np.log(road.bend_radius_m)))
        turn_m = random.uniform(*road.bend_angle_deg) * DEGREE * radius_m  # angle = (clothoid + arc) / radius
        clothoid_m = min(random.uniform(*road.clothoid_length_m), turn_m)
        curvature_1_m = random.choice((-1.0, 1.0)) / radius_m
        begin_m = end_m + random.uniform(*road.straight_length_m)
        end_m = begin_m + turn_m + clothoid_m
        knots_m += [begin_m, begin_m + clothoid_m, end_m - clothoid_m, end_m]
        knots_1_m += [0.0, curvature_1_m, curvature_1_m, 0.0]
    return np.interp(station_m, knots_m, knots_1_m)


def _speed(scenario: Scenario, station_m: Array, curvature_1_m: Array, random: np.random.Generator) -> Array:
    """m/s: sections of even speed, slower where a bend asks for it, and braking in time for both."""
    driver = scenario.driver
    ends_m, speeds_m_s = [], []
    end_m = 0.0
    while end_m < station_m[-1]:
        end_m += random.uniform(*driver.speed_section_length_m)
        ends_m.append(end_m)
        speeds_m_s.append(random.uniform(*driver.speed_km_h) / 3.6)
    section = np.asarray(speeds_m_s)[np.searchsorted(ends_m, station_m)]
    squared = np.minimum(
        section**2, driver.bend_lateral_acceleration_max_m_s2 / np.maximum(np.abs(curvature_1_m), 1e-9)
    )
    braking = 2.0 * _DECELERATION_SHARE * driver.deceleration_max_m_s2 * station_m  # v^2 + braking may not rise
    return np.sqrt(np.minimum.accumulate((squared + braking)[::-1])[::-1] - braking)
