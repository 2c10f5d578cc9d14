"""Roads: random, by sections, from a file, or open ground; with banks, stops and driven speeds."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import polars as pl

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.regular_file import read_regular_file
from oncenter.signals import DEGREE
from oncenter.simulate.chances import named_chances
from oncenter.simulate.road_sections import BendsRoad, CsvRoad, OpenRoad, SectionsRoad, Stops, Wind
from oncenter.simulate.scenario import Scenario

Array = npt.NDArray[np.float64]

_COARSE_M, _FINE_M = 5.0, 1.0  # between the points of a road
_FINE_BELOW_RADIUS_M = 100.0
_DECELERATION_SHARE = 0.6  # of the driver's limit used for planning, because the driver reacts late
_CSV_BYTES_MAX = 64 << 20  # a road of 1000 km with a row a metre
_CSV_COLUMNS = ("station_m", "curvature_1_m", "cross_slope_1", "speed_m_s")
_CSV_RANGES = {"curvature_1_m": (-0.1, 0.1), "cross_slope_1": (-0.15, 0.15), "speed_m_s": (0.5, 42.0)}


@dataclass(frozen=True)
class LaidRoad:
    """Columns along the road at every `spacing_m`, and the stops on it."""

    curvature_1_m: Array  # left positive
    cross_slope: Array  # sine of the bank, positive where the road falls to the right
    speed_m_s: Array
    spacing_m: float
    stop_station_m: Array
    stop_duration_s: Array
    length_m: float  # infinite for a road made as long as the drive needs
    patch: Array | None = None  # 0 for good grip, 1 in a patch; None: good everywhere
    exposure: Array | None = None  # 0 for sheltered from the wind, 1 for open; None: open everywhere

    @property
    def mirrored(self) -> LaidRoad:
        """The same road with left and right swapped."""
        return replace(self, curvature_1_m=-self.curvature_1_m, cross_slope=-self.cross_slope)


def lay_road(scenario: Scenario, random: np.random.Generator) -> LaidRoad:
    """The road of a scenario, long enough for the whole drive unless the scenario gives its length.

    Raises:
        OncenterError: "scenario_file", exit code 2: its CSV file cannot be used.
    """
    road = scenario.road
    if isinstance(road, BendsRoad):
        laid = _bends(scenario, road, random)
    elif isinstance(road, SectionsRoad):
        laid = _sections(scenario, road, random)
    elif isinstance(road, CsvRoad):
        laid = _measured(scenario, road)
    else:
        laid = _open(scenario, road)
    if road.patches is not None:
        lengths_m = road.patches.spacing_m, road.patches.length_m
        laid = replace(laid, patch=_stretches(laid, *lengths_m, named_chances(random, "patches")))
    if scenario.wind is not None and scenario.wind.open_length_m is not None:
        laid = replace(laid, exposure=_exposure(laid, scenario.wind, named_chances(random, "shelter")))
    laid = replace(laid, cross_slope=laid.cross_slope + _rough_bank(scenario, laid, named_chances(random, "bank")))
    return laid if scenario.stops is None else _with_stops(laid, scenario.stops, named_chances(random, "stops"))


def _reach_m(scenario: Scenario) -> float:
    """Distance of the whole drive at maximum speed."""
    return scenario.driver.speed_km_h[1] / 3.6 * scenario.drive.duration_s


def _without_stops(
    curvature_1_m: Array, cross_slope: Array, speed_m_s: Array, spacing_m: float, length_m: float = math.inf
) -> LaidRoad:
    return LaidRoad(curvature_1_m, cross_slope, speed_m_s, spacing_m, np.empty(0), np.empty(0), length_m)


def _bends(scenario: Scenario, road: BendsRoad, random: np.random.Generator) -> LaidRoad:
    spacing_m = _COARSE_M if road.bend_radius_m[0] >= _FINE_BELOW_RADIUS_M else _FINE_M
    station_m = np.arange(0.0, _reach_m(scenario) + 2 * spacing_m, spacing_m)
    curvature = _random_curvature(road, station_m, random)
    speed = _random_speed(scenario, station_m, random)
    return _without_stops(
        curvature, _bank(road, curvature), _braked_in_time(scenario, station_m, curvature, speed), spacing_m
    )


def _random_curvature(road: BendsRoad, station_m: Array, random: np.random.Generator) -> Array:
    """1/m: trapezoids between straights."""
    sides = {"left": (1.0,), "right": (-1.0,), "both": (-1.0, 1.0)}[road.bend_side]
    knots_m, knots_1_m, end_m = [0.0], [0.0], 0.0
    while end_m < station_m[-1]:
        radius_m = np.exp(random.uniform(*np.log(road.bend_radius_m)))
        turn_m = random.uniform(*road.bend_angle_deg) * DEGREE * radius_m  # angle = (clothoid + arc) / radius
        clothoid_m = min(random.uniform(*road.clothoid_length_m), turn_m)
        curvature_1_m = random.choice(sides) / radius_m
        begin_m = end_m + random.uniform(*road.straight_length_m)
        end_m = begin_m + turn_m + clothoid_m
        knots_m += [begin_m, begin_m + clothoid_m, end_m - clothoid_m, end_m]
        knots_1_m += [0.0, curvature_1_m, curvature_1_m, 0.0]
    return np.interp(station_m, knots_m, knots_1_m)


def _bank(road: BendsRoad, curvature_1_m: Array) -> Array:
    """The crown, blended into superelevation toward the inside of a bend, fully at the smallest radius."""
    crown = np.full_like(curvature_1_m, road.crown_percent / 100.0)
    if road.superelevation_max_percent is None:
        return crown
    sharpness = curvature_1_m * road.bend_radius_m[0]  # -1 to 1
    return (1.0 - np.abs(sharpness)) * crown - sharpness * road.superelevation_max_percent / 100.0


def _random_speed(scenario: Scenario, station_m: Array, random: np.random.Generator) -> Array:
    """m/s: stretches of constant speed."""
    driver = scenario.driver
    ends_m, speeds_m_s = [], []
    end_m = 0.0
    while end_m < station_m[-1]:
        end_m += random.uniform(*driver.speed_section_length_m)
        ends_m.append(end_m)
        speeds_m_s.append(random.uniform(*driver.speed_km_h) / 3.6)
    return np.asarray(speeds_m_s)[np.searchsorted(ends_m, station_m)]


def _braked_in_time(scenario: Scenario, station_m: Array, curvature_1_m: Array, speed_m_s: Array) -> Array:
    """m/s: reduced in bends, and before slower stretches for braking."""
    driver = scenario.driver
    squared = np.minimum(
        speed_m_s**2, driver.bend_lateral_acceleration_max_m_s2 / np.maximum(np.abs(curvature_1_m), 1e-9)
    )
    braking = 2.0 * _DECELERATION_SHARE * driver.deceleration_max_m_s2 * station_m  # v^2 + braking may not rise
    return np.sqrt(np.minimum.accumulate((squared + braking)[::-1])[::-1] - braking)


def _sections(scenario: Scenario, road: SectionsRoad, random: np.random.Generator) -> LaidRoad:
    """Each section starts and ends with zero curvature, over a clothoid."""
    round_m = sum(section.length_m for section in road.sections)
    rounds = math.ceil((_reach_m(scenario) + 2 * _FINE_M) / round_m) if road.repeat else 1
    knots_m, knots_1_m, slope_m, slope, ends_m, speeds_m_s = [0.0], [0.0], [0.0], [], [], []
    end_m, clothoid_m = 0.0, road.clothoid_length_m
    for section in road.sections * rounds:
        begin_m, end_m = end_m, end_m + section.length_m
        curvature_1_m = section.turn_deg * DEGREE / (section.length_m - clothoid_m)
        knots_m += [begin_m, begin_m + clothoid_m, end_m - clothoid_m, end_m]
        knots_1_m += [0.0, curvature_1_m, curvature_1_m, 0.0]
        percent = road.crown_percent if section.cross_slope_percent is None else section.cross_slope_percent
        slope_m += [begin_m + clothoid_m, end_m - clothoid_m]
        slope += [percent / 100.0] * 2
        ends_m.append(end_m)
        drawn_km_h = random.uniform(*scenario.driver.speed_km_h)
        speeds_m_s.append((drawn_km_h if section.speed_km_h is None else section.speed_km_h) / 3.6)
    station_m = np.arange(0.0, end_m, _FINE_M)
    curvature = np.interp(station_m, knots_m, knots_1_m)
    speed = np.asarray(speeds_m_s)[np.searchsorted(ends_m, station_m, side="right")]
    return _without_stops(
        curvature,
        np.interp(station_m, slope_m[1:], slope),
        _braked_in_time(scenario, station_m, curvature, speed),
        _FINE_M,
        math.inf if road.repeat else end_m,
    )


def _measured(scenario: Scenario, road: CsvRoad) -> LaidRoad:
    """The road in the file, linear between its rows, limited to the driver's maximum speed."""
    station_m, *columns = _read_csv(road.file)
    length_m = station_m[-1] - station_m[0]
    at_m = np.arange(0.0, min(length_m, _reach_m(scenario)) + _FINE_M, _FINE_M)
    curvature, cross_slope, speed = (np.interp(at_m, station_m - station_m[0], column) for column in columns)
    fastest_m_s = scenario.driver.speed_km_h[1] / 3.6
    return _without_stops(curvature, cross_slope, np.minimum(speed, fastest_m_s), _FINE_M, length_m)


def _read_csv(file: Path) -> list[Array]:
    try:
        table = pl.read_csv(
            read_regular_file(file, _CSV_BYTES_MAX), schema_overrides=dict.fromkeys(_CSV_COLUMNS, pl.Float64)
        )
    except (OSError, ValueError) as error:  # the latter for a zero byte in the path
        raise _refusal(file, f"cannot be read: {getattr(error, 'strerror', None) or error}") from None
    except pl.exceptions.PolarsError as error:
        raise _refusal(file, f"is not a table of numbers: {str(error).splitlines()[0]}") from None
    for column in _CSV_COLUMNS:
        if column not in table.columns:
            raise _refusal(file, f"has no column '{column}'; needed are {', '.join(_CSV_COLUMNS)}")
        if not np.isfinite(table[column].to_numpy()).all():
            raise _refusal(file, f"has a row without a number in '{column}'")
    if len(table) < 2 or (np.diff(table["station_m"].to_numpy()) <= 0.0).any():
        raise _refusal(file, "must have at least two rows, with 'station_m' ascending")
    for column, (low, high) in _CSV_RANGES.items():
        if not table[column].is_between(low, high).all():
            raise _refusal(file, f"has '{column}' outside {low:g} to {high:g}")
    return [table[column].to_numpy() for column in _CSV_COLUMNS]


def _refusal(file: Path, reason: str) -> OncenterError:
    return OncenterError(f"'road.file' {file} {reason}", code="scenario_file", exit_code=WRONG_USAGE)


def _open(scenario: Scenario, road: OpenRoad) -> LaidRoad:
    slope = np.full(2, road.crown_percent / 100.0)
    return _without_stops(np.zeros(2), slope, np.full(2, scenario.driver.speed_km_h[1] / 3.6), _COARSE_M)


def _rough_bank(scenario: Scenario, laid: LaidRoad, random: np.random.Generator) -> Array:
    """Cross slope from wear and repairs: a random walk about zero, clipped at three standard deviations."""
    road = scenario.road
    sd, count = road.rough_bank_sd_percent / 100.0, len(laid.cross_slope)
    if sd == 0.0:
        return np.zeros(count)
    keep = math.exp(-laid.spacing_m / road.rough_bank_length_m)
    memory = keep ** np.arange(math.ceil(7.0 * road.rough_bank_length_m / laid.spacing_m))
    normals = random.standard_normal(count + len(memory) - 1)
    wander = sd * math.sqrt(1.0 - keep**2) * np.convolve(normals, memory, mode="valid")
    return np.clip(wander, -3.0 * sd, 3.0 * sd)


def _exposure(laid: LaidRoad, wind: Wind, random: np.random.Generator) -> Array:
    assert wind.open_length_m is not None
    shortest_m, longest_m = wind.open_length_m
    sheltered = (1.0 - wind.open_share) / wind.open_share  # sheltered metres per open metre
    return _stretches(laid, (sheltered * shortest_m, sheltered * longest_m), wind.open_length_m, random)


def _stretches(
    laid: LaidRoad, between_m: tuple[float, float], length_m: tuple[float, float], random: np.random.Generator
) -> Array:
    """1 on stretches of random length, 0 between them."""
    station_m = np.arange(len(laid.curvature_1_m)) * laid.spacing_m
    count = math.ceil(station_m[-1] / (between_m[0] + length_m[0])) + 1
    lengths_m = random.uniform(*length_m, size=count)
    ends_m = np.cumsum(random.uniform(*between_m, size=count) + lengths_m)
    at = np.searchsorted(ends_m, station_m, side="right")
    inside: Array = (station_m >= (ends_m - lengths_m)[at]).astype(np.float64)
    return inside


def _with_stops(laid: LaidRoad, stops: Stops, random: np.random.Generator) -> LaidRoad:
    end_m = len(laid.speed_m_s) * laid.spacing_m
    station_m = np.cumsum(random.uniform(*stops.spacing_m, size=math.ceil(end_m / stops.spacing_m[0])))
    duration_s = random.uniform(*stops.duration_s, size=len(station_m))
    return replace(laid, stop_station_m=station_m, stop_duration_s=duration_s)
