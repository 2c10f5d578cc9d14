"""Roads, wind, the driver and the machine that steers: what the scenario says is what is driven."""

from __future__ import annotations

import math
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl
import pytest

from oncenter.errors import OncenterError
from oncenter.signals import DEGREE, STANDARD_GRAVITY
from oncenter.simulate import simulate
from oncenter.simulate.drive import ffi, lib, run, tick_count
from oncenter.simulate.road import LaidRoad, lay_road
from oncenter.simulate.scenario import Scenario, read_scenario, scenario_from
from oncenter.simulate.truck import on_patch, understeer_gradient
from oncenter.simulate.wind import native_wind

SCENARIOS = Path(__file__).parents[1] / "scenarios"
THESIS_DRIVE = tomllib.loads((SCENARIOS / "thesis_drive.toml").read_text(encoding="utf-8"))

LEVEL_STRAIGHT = {
    "kind": "sections",
    "crown_percent": 0.0,
    "clothoid_length_m": 20.0,
    "repeat": True,
    "sections": [{"length_m": 1000.0}],
}
OPEN = {"kind": "open", "crown_percent": 0.0}
SHORT = {"duration_s": 120.0}
EVEN_60 = {"speed_km_h": [60.0, 60.0]}
STEADY_WIND = {
    "mean_m_s": 10.0,
    "from_deg": 270.0,
    "gust_sd_m_s": 0.0,
    "gust_time_s": 3.0,
    "side_area_m2": 9.0,
    "side_force_coefficient": 1.2,
    "force_arm_m": 0.4,
}


def scenario(**tables: Any) -> Scenario:
    """The thesis drive with the given tables laid over its own, or instead where they name a kind."""
    values: dict[str, Any] = {"name": "here", **THESIS_DRIVE}
    for name, table in tables.items():
        values[name] = table if "kind" in table else {**values.get(name, {}), **table}
    return scenario_from(values, "here")


def laid(of: Scenario, seed: int = 1) -> LaidRoad:
    return lay_road(of, np.random.default_rng(seed))


def driven(of: Scenario, seed: int = 1) -> npt.NDArray[np.void]:
    normals = np.random.default_rng(seed + 100).standard_normal((3, tick_count(of)))
    return run(of, laid(of, seed), *normals)


def after(rows: npt.NDArray[np.void], time_s: float) -> npt.NDArray[np.void]:
    return rows[rows["time"] >= time_s]


# Banks


def test_without_superelevation_the_crown_is_constant() -> None:
    np.testing.assert_array_equal(laid(scenario()).cross_slope, 0.02)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_bends_are_banked_inward_up_to_the_maximum_superelevation(seed: int) -> None:
    road = laid(scenario(road={"superelevation_max_percent": 8.0, "bend_radius_m": [200.0, 900.0]}), seed)
    assert np.abs(road.cross_slope).max() <= 0.08
    assert np.abs(road.cross_slope).max() > 0.06
    sharp = np.abs(road.curvature_1_m) > 1 / 350
    assert (road.cross_slope[sharp] * road.curvature_1_m[sharp] < 0).all()  # a left bend falls to the left
    np.testing.assert_allclose(road.cross_slope[road.curvature_1_m == 0.0], 0.02, rtol=1e-12)


def test_a_rough_bank_has_its_sd_and_length_and_stays_within_three_sd() -> None:
    rough = {"rough_bank_sd_percent": 0.5, "rough_bank_length_m": 50.0}
    wander = laid(scenario(road=rough)).cross_slope - laid(scenario()).cross_slope
    assert wander.std() == pytest.approx(0.005, rel=0.1)
    assert np.abs(wander).max() <= 0.015 + 1e-15
    apart = round(50.0 / 5.0)
    assert np.corrcoef(wander[apart:], wander[:-apart])[0, 1] == pytest.approx(math.exp(-1), abs=0.08)


def test_a_rough_bank_leaves_bends_and_speeds_as_they_were() -> None:
    smooth, rough = laid(scenario()), laid(scenario(road={"rough_bank_sd_percent": 1.0}))
    np.testing.assert_array_equal(rough.curvature_1_m, smooth.curvature_1_m)
    np.testing.assert_array_equal(rough.speed_m_s, smooth.speed_m_s)


def test_the_accelerometer_measures_a_bank_by_equation_19() -> None:
    rows = driven(scenario(drive=SHORT, road={**LEVEL_STRAIGHT, "crown_percent": 7.0}, driver=EVEN_60))
    assert after(rows, 50.0)["lateral_acceleration"][:4000].mean() == pytest.approx(0.07 * STANDARD_GRAVITY, abs=0.01)


# Bends and rounds


@pytest.mark.parametrize(("side", "sign"), [("left", 1.0), ("right", -1.0)])
def test_a_one_sided_road_bends_to_no_other_side(side: str, sign: float) -> None:
    curvature = laid(scenario(road={"bend_side": side})).curvature_1_m * sign
    assert curvature.min() == 0.0
    assert curvature.max() > 1 / 2000


def path(road: LaidRoad, length_m: float) -> tuple[float, float, float]:
    """East, north and heading (rad, from the begin's) of a road's end, by plain summation."""
    step_m = 0.01
    station_m = np.arange(0.0, length_m, step_m) + step_m / 2
    points_m = np.arange(len(road.curvature_1_m)) * road.spacing_m
    heading = np.cumsum(np.interp(station_m, points_m, road.curvature_1_m)) * step_m
    return float(np.cos(heading).sum() * step_m), float(np.sin(heading).sum() * step_m), float(heading[-1])


@pytest.mark.parametrize("name", ["both_ways", "straight_runs", "test_track"])
def test_a_lap_ends_at_its_start_with_the_same_heading(name: str) -> None:
    of = read_scenario(name)
    along, across, heading = path(laid(of), sum(section.length_m for section in of.road.sections))
    assert math.hypot(along, across) < 1.0
    assert math.cos(heading) == pytest.approx(1.0, abs=1e-5)


def test_after_the_turn_the_way_back_is_the_same_line() -> None:
    of = read_scenario("both_ways")
    turned_m = sum(section.length_m for section in of.road.sections[:4])
    _, across, heading = path(laid(of), turned_m)
    assert across == pytest.approx(0.0, abs=0.1)
    assert heading == pytest.approx(math.pi, abs=1e-4)


def test_a_section_has_its_angle_bank_and_speed() -> None:
    sections = [
        {"length_m": 300.0},
        {"length_m": 200.0, "turn_deg": -60.0, "cross_slope_percent": 5.0, "speed_km_h": 36},
    ]
    road = laid(scenario(drive=SHORT, road={**LEVEL_STRAIGHT, "sections": sections}))
    assert road.curvature_1_m[300:501].sum() == pytest.approx(-60.0 * DEGREE, rel=1e-9)
    assert road.cross_slope[400] == 0.05
    assert road.cross_slope[150] == 0.0
    assert road.speed_m_s[400] == 10.0
    assert road.length_m == math.inf


# A road from a file


def csv_road(folder: Path, **columns: Any) -> Path:
    columns = {
        "station_m": [100.0, 600.0, 700.0, 3000.0],
        "curvature_1_m": [0.0, 0.0, 0.002, 0.0],
        "cross_slope_1": [0.02, 0.02, -0.03, 0.02],
        "speed_m_s": [15.0, 15.0, 12.0, 15.0],
    } | columns
    pl.DataFrame({name: values for name, values in columns.items() if values is not None}).write_csv(folder / "r.csv")
    return folder / "r.csv"


def test_a_road_from_a_file_has_the_file_s_values(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    csv_road(tmp_path)
    file.write_text(
        'about = "a road of my own"\nbase = "thesis_drive"\n[drive]\nduration_s = 150.0\n'
        '[road]\nkind = "csv"\nfile = "r.csv"\n',
        encoding="utf-8",
    )
    _, truth = simulate(file)
    table = truth.table.filter(pl.col("station_m") > 5.0)
    for column, values in (
        ("road_curvature_1_m", [0.0, 0.0, 0.002, 0.0]),
        ("road_cross_slope", [0.02, 0.02, -0.03, 0.02]),
    ):
        expected = np.interp(table["station_m"].to_numpy(), [0.0, 500.0, 600.0, 2900.0], values)
        np.testing.assert_allclose(table[column].to_numpy(), expected, atol=1e-12)
    assert truth.table["vehicle_speed_m_s"].max() == pytest.approx(15.0, abs=0.3)


@pytest.mark.parametrize(
    ("columns", "names"),
    [
        ({"cross_slope_1": None}, "cross_slope_1"),
        ({"station_m": [0.0, 20.0, 10.0, 30.0]}, "station_m"),
        ({"curvature_1_m": [0.0, 0.0, 0.5, 0.0]}, "curvature_1_m"),
        ({"curvature_1_m": [0.0, math.nan, 0.0, 0.0]}, "curvature_1_m"),
        ({"speed_m_s": [15.0, 0.0, 15.0, 15.0]}, "speed_m_s"),
        ({"speed_m_s": ["fast", "slow", "slow", "fast"]}, "numbers"),
    ],
)
def test_a_road_file_that_cannot_be_driven_is_refused_by_name(tmp_path: Path, columns: Any, names: str) -> None:
    of = scenario(drive=SHORT, road={"kind": "csv", "file": str(csv_road(tmp_path, **columns))})
    with pytest.raises(OncenterError, match=names) as refusal:
        laid(of)
    assert "r.csv" in str(refusal.value)
    assert refusal.value.exit_code == 2
    assert "\n" not in str(refusal.value)


def test_a_missing_or_empty_road_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "empty.csv").touch()
    for name in ("none.csv", "empty.csv"):
        with pytest.raises(OncenterError, match=re.escape(name)) as refusal:
            laid(scenario(drive=SHORT, road={"kind": "csv", "file": str(tmp_path / name)}))
        assert refusal.value.exit_code == 2


def test_a_road_shorter_than_the_drive_is_refused_by_name(tmp_path: Path) -> None:
    once = {**LEVEL_STRAIGHT, "repeat": False}
    for road in (once, {"kind": "csv", "file": str(csv_road(tmp_path))}):
        with pytest.raises(OncenterError, match=r"'road' is shorter than the drive") as refusal:
            driven(scenario(drive={"duration_s": 400.0}, road=road))
        assert refusal.value.exit_code == 2


# Wind


@pytest.mark.parametrize(
    ("from_deg", "heading_deg", "push"),
    [(270.0, 0.0, -1), (270.0, 180.0, 1), (0.0, 0.0, 0), (180.0, 0.0, 0), (0.0, 270.0, 1), (90.0, 0.0, 1)],
)
def test_the_wind_force_follows_from_compass_direction_and_heading(
    from_deg: float, heading_deg: float, push: int
) -> None:
    of = scenario(wind={**STEADY_WIND, "from_deg": from_deg})
    state = ffi.new("sim_wind_state *")
    given = ffi.new("sim_wind_input *", [(90.0 - heading_deg) * DEGREE, 20.0, 1.0])
    lib.sim_wind_blow(state, native_wind(of.wind, 0.01), given)
    force_n = 0.5 * 1.225 * 9.0 * 1.2 * math.hypot(20.0, 10.0) * 10.0  # dynamic pressure * area * coefficient * sine
    assert state.lateral_force == pytest.approx(push * force_n, abs=1e-9 * force_n)


def test_mean_wind_changes_the_angle_and_not_the_accelerometer() -> None:
    drive, calm = {"duration_s": 300.0}, {"lane_wander_sd_m": 0.0, "hand_motion_sd_deg": 0.0}
    means = []
    for wind in ({}, {"wind": STEADY_WIND}):
        of = scenario(drive=drive, road=LEVEL_STRAIGHT, driver=calm | EVEN_60, steering={"backlash_deg": 0.0}, **wind)
        rows = after(driven(of), 150.0)[:9000]
        means.append([rows[name].mean() for name in ("steering_wheel_angle", "lateral_acceleration", "wind_force")])
    (still_angle, still_a_y, still_force), (angle, a_y, force) = means
    assert still_force == 0.0
    assert force < -500.0  # a westerly from the left on the way north
    assert angle - still_angle > 0.5 * DEGREE
    assert a_y == pytest.approx(still_a_y, abs=1e-3)


def test_gusts_have_their_strength_and_their_length() -> None:
    of = scenario(wind={**STEADY_WIND, "mean_m_s": 0.0, "gust_sd_m_s": 2.0})
    state, wind = ffi.new("sim_wind_state *"), native_wind(of.wind, 0.01)
    gusts = np.empty(100_000)
    for k, normal in enumerate(np.random.default_rng(5).standard_normal(len(gusts))):
        lib.sim_wind_blow(state, wind, ffi.new("sim_wind_input *", [0.0, 20.0, 1.0, normal]))
        gusts[k] = state.gust
    assert gusts.std() == pytest.approx(2.0, rel=0.15)
    assert np.corrcoef(gusts[300:], gusts[:-300])[0, 1] == pytest.approx(math.exp(-1), abs=0.12)


def test_gusts_do_not_change_the_random_road_and_driver() -> None:
    calm, windy = simulate("motorway")[1].table[:3000], simulate("cross_wind")[1].table[:3000]
    for column in ("road_curvature_1_m", "road_cross_slope"):
        np.testing.assert_allclose(windy[column].to_numpy(), calm[column].to_numpy(), atol=1e-4)
    assert windy["wind_side_force_n"].std() > 50.0


# The driver


def test_the_truck_stands_at_each_stop_for_its_duration() -> None:
    of = scenario(
        drive={"duration_s": 600.0},
        road=LEVEL_STRAIGHT,
        stops={"spacing_m": [900.0, 900.0], "duration_s": [20.0, 20.0]},
        driver={"speed_km_h": [50.0, 50.0]},
    )
    rows = driven(of)
    rows = rows[(rows["time"] > 20.0) & (rows["time"] < 560.0)]
    stands = rows["vehicle_speed"] == 0.0
    begins, ends = np.flatnonzero(np.diff(stands.astype(int)) == 1), np.flatnonzero(np.diff(stands.astype(int)) == -1)
    assert len(begins) >= 4
    for k, begin in enumerate(begins[: len(ends)]):
        assert (ends[k] - begin) / 100.0 == pytest.approx(20.0, abs=0.1)
        assert 900.0 * (k + 1) - rows["station"][begin + 1] == pytest.approx(2.0, abs=2.0)
    assert rows["vehicle_speed"].max() == pytest.approx(50.0 / 3.6, abs=0.1)
    assert rows["longitudinal_acceleration"].min() >= -0.8


def test_the_truck_stands_through_its_breaks() -> None:
    of = scenario(drive={"duration_s": 300.0, "standing_s": [[100.0, 150.0]]}, road=LEVEL_STRAIGHT)
    speed = driven(of)["vehicle_speed"]
    assert (speed[10_000:15_000] == 0.0).all()
    assert speed[8000] > 5.0
    assert speed[17_000] > 5.0


def test_a_slow_bend_is_not_left_faster_than_it_allows() -> None:
    sections = [{"length_m": 300.0}, {"length_m": 60.0, "turn_deg": 90.0}]
    road = {**LEVEL_STRAIGHT, "sections": sections}
    rows = driven(scenario(drive={"duration_s": 300.0}, road=road, driver={"speed_km_h": [50.0, 50.0]}))
    in_bend = np.abs(rows["curvature"]) > 0.9 / 25.5
    assert np.abs(rows["vehicle_speed"] ** 2 * rows["curvature"])[in_bend].max() < 1.7 * 1.25


@pytest.mark.parametrize("backlash_deg", [0.0, 15.0, 20.0])
@pytest.mark.parametrize("name", ["motorway", "town", "both_ways", "semitrailer_full"])
def test_the_driver_keeps_the_lane_with_heavy_play_in_strong_wind(name: str, backlash_deg: float) -> None:
    given = read_scenario(name)
    gale = {**STEADY_WIND, "mean_m_s": 12.0, "gust_sd_m_s": 4.0, "gust_time_s": 2.0, "from_deg": 200.0}
    of = given.model_copy(
        update={
            "drive": given.drive.model_copy(update={"duration_s": 600.0}),
            "steering": given.steering.model_copy(update={"backlash_deg": backlash_deg}),
            "wind": scenario(wind=gale).wind,
        }
    )
    assert np.abs(driven(of)["lateral_error"]).max() < 1.3


def test_the_path_follows_heading_and_speed() -> None:
    of = scenario(drive={"duration_s": 300.0}, road={"heading_deg": 120.0})
    rows = driven(of)
    assert rows["heading"][0] == pytest.approx(-30.0 * DEGREE)
    turned = np.concatenate([[0.0], np.cumsum((rows["yaw_rate"][1:] + rows["yaw_rate"][:-1]) / 200.0)])
    np.testing.assert_allclose(rows["heading"] - rows["heading"][0], turned, atol=3e-4)
    driven_m = np.hypot(np.diff(rows["east"]), np.diff(rows["north"])).sum()
    assert driven_m == pytest.approx(rows["vehicle_speed"].sum() / 100.0, rel=1e-3)
    first = np.flatnonzero(rows["station"] > 20.0)[0]
    assert math.atan2(rows["north"][first], rows["east"][first]) == pytest.approx(-30.0 * DEGREE, abs=0.02)


# There and back


def test_there_and_back_the_acceleration_is_mirrored_and_the_angle_s_means_straddle_the_offset() -> None:
    """Chapter 3 and Figure 9, which has 3.60 and 0.48 deg about 2.04, with a deviation of 1.19."""
    signals, truth = simulate("both_ways")
    station = truth.table["station_m"].to_numpy()
    slope = truth.table["road_cross_slope"].to_numpy()
    moving = truth.table["vehicle_speed_m_s"].to_numpy() > 2.7
    settled = (station % 1641.0 > 100.0) & (station % 1641.0 < 1450.0)
    there, back = moving & settled & (slope > 0.0119), moving & settled & (slope < -0.0119)

    a_y = signals.table["lateral_acceleration_m_s2"].to_numpy() - truth.lateral_acceleration_bias_m_s2
    assert a_y[there].mean() == pytest.approx(0.012 * STANDARD_GRAVITY, abs=0.01)
    assert a_y[back].mean() == pytest.approx(-0.012 * STANDARD_GRAVITY, abs=0.01)

    wheel = signals.table["steering_wheel_angle_rad"].to_numpy() / DEGREE
    upper, lower = wheel[there].mean(), wheel[back].mean()
    assert lower + 1.0 < 2.04 < upper - 1.0
    assert (upper + lower) / 2 == pytest.approx(2.04, abs=0.15)
    assert upper - lower == pytest.approx(3.12, abs=0.5)
    assert wheel[there].std() == pytest.approx(1.19, abs=0.5)

    north_west = truth.table["heading_rad"].to_numpy() / DEGREE
    assert north_west[there].mean() % 360.0 == pytest.approx(135.0, abs=0.5)
    line = truth.table["east_m"].to_numpy() + truth.table["north_m"].to_numpy()  # across north-west, times sqrt(2)
    assert np.abs(line[there | back]).max() < 2.5


# Manoeuvres


def machine(name: str) -> tuple[Any, Any]:
    of = read_scenario(name)
    return of, driven(of)


def test_a_hard_turn_goes_from_60_to_minus_50_degrees_at_260_degrees_a_second() -> None:
    of, rows = machine("hard_turn")
    wheel = rows["steering_wheel_angle"] / DEGREE
    assert wheel.max() == pytest.approx(60.0, abs=1e-6)
    turning = (wheel < 58.0) & (wheel > -48.0) & (rows["time"] > of.manoeuvre.begin_s + 3.0)
    np.testing.assert_allclose(np.diff(wheel[turning]), -2.6, atol=1e-6)
    assert rows["vehicle_speed"][turning] * 3.6 == pytest.approx(72.0, abs=0.5)
    yaw_rate = rows["yaw_rate"]
    begin = np.flatnonzero(turning)[0]
    assert yaw_rate[begin] > 0.1
    assert yaw_rate[begin + 200] < -0.1


def test_a_step_is_a_ramp_from_zero() -> None:
    of, rows = machine("step_steer")
    wheel, begin = rows["steering_wheel_angle"] / DEGREE, round(of.manoeuvre.begin_s * 100)
    np.testing.assert_allclose(wheel[begin - 1 : begin + 5], [0, 0, 10, 20, 25, 25], atol=1e-6)
    assert rows["vehicle_speed"][begin] * 3.6 == pytest.approx(80.0, abs=0.5)
    L, K_us_g, v = 3.7, 0.40 * DEGREE, 80.0 / 3.6
    front = (25.0 - 1.5) / 19.3 * DEGREE  # beyond half the play
    assert rows["yaw_rate"][begin + 500] == pytest.approx(front * v / (L + K_us_g * v**2), rel=0.03)  # (10)


def test_a_weave_has_its_frequencies_one_after_the_other() -> None:
    of, rows = machine("weave")
    begin_s = of.manoeuvre.begin_s
    for frequency_hz in of.manoeuvre.frequency_hz:
        lasts_s = of.manoeuvre.cycles / frequency_hz
        part = rows[(rows["time"] >= begin_s) & (rows["time"] < begin_s + lasts_s)]
        sine = 20.0 * DEGREE * np.sin(2 * np.pi * frequency_hz * (part["time"] - begin_s))
        np.testing.assert_allclose(part["steering_wheel_angle"], sine, atol=1e-9)
        begin_s += lasts_s + of.manoeuvre.pause_s


@pytest.mark.parametrize(
    ("name", "speed_km_h", "most_deg"), [("low_speed_manoeuvre", 17, 500), ("mid_speed_manoeuvre", 46, 65)]
)
def test_a_profile_is_steered_point_by_point_at_its_speed(name: str, speed_km_h: float, most_deg: float) -> None:
    of, rows = machine(name)
    wheel = rows["steering_wheel_angle"] / DEGREE
    assert np.abs(wheel).max() == pytest.approx(most_deg, abs=1e-6)
    for time_s, angle_deg in zip(of.manoeuvre.time_s, of.manoeuvre.angle_deg, strict=True):
        assert wheel[round(time_s * 100)] == pytest.approx(angle_deg, abs=1e-6)
    during = (rows["time"] > of.manoeuvre.time_s[0]) & (rows["time"] < of.manoeuvre.time_s[-1])
    np.testing.assert_allclose(rows["vehicle_speed"][during] * 3.6, speed_km_h, atol=0.5)
    assert np.abs(rows["lateral_acceleration"]).max() == pytest.approx({17: 2.9, 46: 1.9}[int(speed_km_h)], abs=0.2)
    assert np.isnan(rows["lateral_error"]).all()


# Bases


def test_a_file_with_a_base_contains_only_differences(tmp_path: Path) -> None:
    first, second = tmp_path / "first.toml", tmp_path / "second.toml"
    first.write_text('about = "a"\nbase = "thesis_drive"\n[truck]\nmass_kg = 9000.0\n', encoding="utf-8")
    second.write_text('about = "b"\nbase = "first.toml"\n[drive]\nduration_s = 99.0\n', encoding="utf-8")
    of, thesis = read_scenario(second), read_scenario("thesis_drive")
    assert (of.name, of.about, of.truck.mass_kg, of.drive.duration_s) == ("second", "b", 9000.0, 99.0)
    assert of.truck.wheelbase_m == thesis.truck.wheelbase_m
    assert of.sensors == thesis.sensors


def test_a_base_that_is_unknown_or_leads_back_is_refused(tmp_path: Path) -> None:
    for name, base in (("own", '"own.toml"'), ("lost", '"nowhere"'), ("number", "3"), ("gone", '"gone_base.toml"')):
        file = tmp_path / f"{name}.toml"
        file.write_text(f'about = "x"\nbase = {base}\n', encoding="utf-8")
        with pytest.raises(OncenterError) as refusal:
            read_scenario(file)
        assert refusal.value.exit_code == 2
        assert base.strip('"') in str(refusal.value)


SHELTERED = STEADY_WIND | {"open_share": 0.3, "open_length_m": [150.0, 350.0]}


def test_wind_blows_only_on_its_share_of_the_distance() -> None:
    of = scenario(road=LEVEL_STRAIGHT, driver=EVEN_60, wind=SHELTERED)
    road, rows = laid(of), driven(of)
    assert road.exposure is not None
    assert road.exposure.mean() == pytest.approx(0.3, abs=0.05)
    open_m = lengths_m(road, road.exposure, 1.0)
    assert 149.0 <= open_m.min() < open_m.max() <= 351.0
    exposed = np.interp(rows["station"], np.arange(len(road.exposure)) * road.spacing_m, road.exposure)
    steady = driven(scenario(road=LEVEL_STRAIGHT, driver=EVEN_60, wind=STEADY_WIND))
    assert (rows["wind_force"][exposed == 0.0] == 0.0).all()
    running = exposed[10000:-10000] == 1.0
    assert np.median(rows["wind_force"][10000:-10000][running]) == pytest.approx(
        np.median(steady["wind_force"][10000:-10000]), rel=0.02
    )


# Patches


PATCHES = {
    "spacing_m": [200.0, 400.0],
    "length_m": [100.0, 300.0],
    "front_stiffness_percent": -35.0,
    "rear_stiffness_percent": -25.0,
}


def lengths_m(road: LaidRoad, column: npt.NDArray[np.float64], value: float) -> npt.NDArray[np.float64]:
    """The lengths of whole stretches with that value."""
    turns = np.flatnonzero(np.diff(column)) + 1
    inside = column[turns[:-1]] == value
    return np.diff(turns)[inside] * road.spacing_m


def test_patches_have_their_length_and_spacing_and_do_not_change_the_road() -> None:
    with_patches, without = laid(scenario(road={"patches": PATCHES})), laid(scenario())
    assert with_patches.patch is not None
    for value, (low, high) in ((1.0, (100.0, 300.0)), (0.0, (200.0, 400.0))):
        lengths = lengths_m(with_patches, with_patches.patch, value)
        assert len(lengths) > 50
        assert low - 5.0 <= lengths.min() < lengths.max() <= high + 5.0
    np.testing.assert_array_equal(with_patches.curvature_1_m, without.curvature_1_m)
    np.testing.assert_array_equal(with_patches.speed_m_s, without.speed_m_s)
    assert without.patch is None


def test_on_a_patch_the_truck_has_the_gradient_of_its_softer_tyres() -> None:
    """K_us/g is m_f/C_f + the steering's compliance - m_r/C_r, at 0.65 C_f and 0.75 C_r."""
    patches = PATCHES | {"spacing_m": [400.0, 400.0], "length_m": [400.0, 400.0]}
    circle = LEVEL_STRAIGHT | {"sections": [{"length_m": 5000.0, "turn_deg": 300.0}], "repeat": False}
    of = scenario(
        drive={"duration_s": 250.0},
        road=circle | {"patches": patches},
        driver=EVEN_60,
        steering={"backlash_deg": 0.0},
    )
    rows = run(of, laid(of), *np.zeros((2, tick_count(of))))
    v, r, a_y, patch = (rows[c] for c in ("vehicle_speed", "yaw_rate", "lateral_acceleration", "patch"))
    K = (rows["front_wheel_angle"][6000:] - 3.7 * (r / np.maximum(v, 1.0))[6000:]) / a_y[6000:]
    settled = patch[6000:] == np.roll(patch, 1500)[6000:]
    settled &= patch[6000:] == np.roll(patch, 700)[6000:]
    m_f, m_r = 8100.0 * 2.695 / 3.7, 8100.0 * 1.005 / 3.7
    compliance = 0.43e-3 * DEGREE * 0.06
    for value, front, rear in ((0.0, 1.0, 1.0), (1.0, 0.65, 0.75)):
        expected = m_f * (1.0 / (431e3 * front) + compliance) - m_r / (235e3 * rear)
        assert np.median(K[settled & (patch[6000:] == value)]) == pytest.approx(expected, rel=0.01)
    assert understeer_gradient(on_patch(of.truck, of.road.patches), of.steering) == pytest.approx(expected, rel=1e-9)


# What is refused


@pytest.mark.parametrize(
    ("tables", "names"),
    [
        ({"road": {"kind": "winding"}}, "'kind' must be one of bends, sections, csv, open"),
        ({"road": {"superelevation_max_percent": 12.0}}, "road.superelevation_max_percent"),
        ({"road": {"heading_deg": 360.0}}, "road.heading_deg"),
        ({"road": {**LEVEL_STRAIGHT, "sections": []}}, "road.sections"),
        ({"road": {**LEVEL_STRAIGHT, "sections": [{"length_m": 30.0}]}}, "'sections' number 1"),
        ({"road": {**LEVEL_STRAIGHT, "sections": [{"length_m": 50.0, "turn_deg": 300.0}]}}, "'sections' number 1"),
        ({"road": {**LEVEL_STRAIGHT, "sections": [{"length_m": 50.0, "speed_km_h": 95}]}}, "driver.speed_km_h"),
        ({"road": OPEN}, "manoeuvre"),
        ({"manoeuvre": {"kind": "profile", "time_s": [1, 2], "angle_deg": [0, 9]}}, "road.kind"),
        ({"road": OPEN, "manoeuvre": {"kind": "profile", "time_s": [1, 2], "angle_deg": [0]}}, "angle_deg"),
        ({"road": OPEN, "manoeuvre": {"kind": "profile", "time_s": [2, 1], "angle_deg": [0, 9]}}, "time_s"),
        ({"road": OPEN, "manoeuvre": {"kind": "slalom"}}, "manoeuvre"),
        ({"stops": {"spacing_m": [0.0, 10.0], "duration_s": [1.0, 2.0]}}, "stops.spacing_m"),
        ({"wind": {**STEADY_WIND, "side_area_m2": -9.0}}, "wind.side_area_m2"),
        ({"road": {"patches": PATCHES | {"front_stiffness_percent": -90.0}}}, "road.patches.front_stiffness_percent"),
        ({"road": {"patches": PATCHES | {"length_m": [20.0, 10.0]}}}, "road.patches.length_m"),
        ({"road": OPEN | {"patches": PATCHES}, "manoeuvre": {"kind": "weave"}}, "'patches' cannot be given"),
        ({"wind": {**STEADY_WIND, "open_share": 0.5}}, "open_length_m"),
        ({"wind": {**SHELTERED, "open_share": 0.01}}, "wind.open_share"),
        (
            {"road": OPEN, "wind": SHELTERED, "manoeuvre": {"kind": "profile", "time_s": [1, 2], "angle_deg": [0, 9]}},
            "'wind.open_share' must be 1",
        ),
        (
            {
                "road": OPEN,
                "steering": {"overlay_motor": {"lash_deg": 2.0, "carries_s": [[10.0, 20.0]]}},
                "manoeuvre": {"kind": "profile", "time_s": [1, 2], "angle_deg": [0, 9]},
            },
            "'steering.overlay_motor.carries_s' needs a driver",
        ),
        ({"drive": {"standing_s": [[50.0, 40.0]]}}, "standing_s"),
        ({"drive": {"standing_s": [[5.0, 40.0]]}}, "standing_s"),
    ],
)
def test_an_impossible_road_wind_or_manoeuvre_is_refused_by_name(tables: dict[str, Any], names: str) -> None:
    with pytest.raises(OncenterError, match=re.escape(names)) as refusal:
        scenario(**tables)
    assert refusal.value.exit_code == 2
    assert "\n" not in str(refusal.value)


def test_a_manoeuvre_longer_than_the_drive_is_refused_by_name() -> None:
    late = {"kind": "weave", "begin_s": 20, "amplitude_deg": 9, "frequency_hz": [0.1], "cycles": 20, "pause_s": 0}
    with pytest.raises(OncenterError, match="'manoeuvre' ends at 220 s"):
        driven(scenario(drive=SHORT, road=OPEN, manoeuvre=late))
