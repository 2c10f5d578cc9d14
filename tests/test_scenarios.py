"""The library of scenarios: each is described, runs, keeps its lane and its stated values."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from oncenter.simulate import simulate
from oncenter.simulate.drive import run, tick_count
from oncenter.simulate.road import lay_road
from oncenter.simulate.road_sections import BendsRoad, OpenRoad, Patches, SectionsRoad
from oncenter.simulate.scenario import Scenario, read_scenario
from oncenter.simulate.truck_sections import LoadChange, OverlayMotor, Payload, Steering, Trailer, Truck, Tyres

FOLDER = Path(__file__).parents[1] / "scenarios"
NAMES = sorted(file.stem for file in FOLDER.glob("*.toml"))
README = (FOLDER / "README.md").read_text(encoding="utf-8")
MANOEUVRES = [name for name in NAMES if isinstance(read_scenario(name).road, OpenRoad)]
LANE_M = 1.1  # of the centre of gravity, from the lane's middle
TURNING_M = 1.5  # the same on roads with corners and turning places, which trucks cut
TIGHT_1_M = 1 / 60


def driven_alike(name: str) -> str:
    """The tables that determine the drive, without the sensors."""
    given = read_scenario(name)
    return repr([getattr(given, table) for table in type(given).model_fields if table not in _NOT_DRIVEN])


_NOT_DRIVEN = ("name", "about", "sensors", "can")
DRIVEN = sorted({driven_alike(name): name for name in reversed(NAMES)}.values())


def rows_of(of: Scenario, seed: int) -> Any:
    random = np.random.default_rng(seed)
    return run(of, lay_road(of, random), *random.standard_normal((3, tick_count(of))))


def widest_slope(of: Scenario) -> float:
    road = of.road
    percents = [abs(getattr(road, "crown_percent", 0.0)), 3.0 * road.rough_bank_sd_percent]
    if isinstance(road, BendsRoad):
        percents[0] = max(percents[0], road.superelevation_max_percent or 0.0)
    if isinstance(road, SectionsRoad):
        percents[0] = max(percents[0], *(abs(section.cross_slope_percent or 0.0) for section in road.sections))
    return sum(percents) / 100.0


def test_every_scenario_has_its_line_in_the_readme_and_every_line_its_scenario() -> None:
    rows = re.findall(r"^\| `(\w+)` \| (.+) \| (.+) \| (.+) \|$", README, re.M)
    assert sorted(name for name, *_ in rows) == NAMES
    assert all(len(what) > 3 for _, *whats in rows for what in whats)


def test_the_needed_scenarios_exist() -> None:
    assert {
        *("thesis_drive", "country", "motorway", "town", "bypass", "heavy_play", "pulling_truck", "drifting_gyro"),
        *("biased_accelerometer", "semitrailer_half", "semitrailer_full", "sensor_failure", "both_ways", "test_track"),
        *("friction_play", "worn_truck"),
    } <= set(NAMES)


def test_the_readme_or_the_thesis_drive_names_every_key_of_truck_and_steering() -> None:
    explained = README + (FOLDER / "thesis_drive.toml").read_text(encoding="utf-8")
    keys = {
        key
        for table in (Truck, Tyres, Payload, Trailer, LoadChange, Steering, OverlayMotor, Patches)
        for key in table.model_fields
    }
    assert {key for key in keys if not re.search(rf"\b{key}\b", explained)} == set()


@pytest.mark.parametrize("name", NAMES)
def test_a_scenario_s_name_and_purpose_are_its_own(name: str) -> None:
    given = read_scenario(name)
    assert given.name == name
    assert len(given.about) > 60
    others = [read_scenario(other).about for other in NAMES if other != name]
    assert given.about not in others


@pytest.mark.parametrize("seed", [2, pytest.param(3, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", DRIVEN)
def test_a_scenario_keeps_lane_speed_and_banks(name: str, seed: int) -> None:
    of = read_scenario(name)
    rows = rows_of(of, seed)
    if name not in MANOEUVRES:
        tight = np.abs(rows["curvature"]).max() > TIGHT_1_M
        assert np.abs(rows["lateral_error"]).max() < (TURNING_M if tight else LANE_M)
    speed_km_h = rows["vehicle_speed"] * 3.6
    assert speed_km_h.min() >= 0.0
    assert speed_km_h.max() < of.driver.speed_km_h[1] + 1.0
    assert np.abs(rows["cross_slope"]).max() <= widest_slope(of) + 1e-12
    assert np.abs(rows["lateral_acceleration"]).max() < 3.5
    assert (rows["vehicle_speed"][: round(of.drive.standing_at_start_s * 100)] == 0.0).all()
    assert (rows["vehicle_speed"][-round(of.drive.standing_at_end_s * 90) :] == 0.0).all()


@pytest.mark.parametrize("name", NAMES)
def test_a_scenario_s_sensors_report_its_drive(name: str) -> None:
    signals, truth = simulate(name, seed=1)
    assert len(signals.table) == len(truth.table) == tick_count(read_scenario(name))
    scales = {"yaw_rate_rad_s": 0.0, "vehicle_speed_m_s": read_scenario(name).sensors.speed.scale_error_percent / 100.0}
    for column, scale in scales.items():
        measured, true = signals.table[column].to_numpy(), truth.table[column].to_numpy()
        assert np.nanmean(np.abs(measured - (1.0 + scale) * true)) < 0.02


@pytest.mark.parametrize("name", ["town", "step_steer"])
def test_the_same_seed_gives_the_same_drive_and_another_seed_another(name: str) -> None:
    (a, true_a), (b, true_b), (c, _) = (simulate(name, seed) for seed in (5, 5, 6))
    assert a.table.equals(b.table, null_equal=True)
    assert true_a.table.equals(true_b.table, null_equal=True)
    assert not a.table.equals(c.table)
