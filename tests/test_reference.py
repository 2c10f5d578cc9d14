"""Chapter 3: a straight driven both ways measures the offset; any other drive is refused with the reason."""

import functools
import json
import math
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from real_data import real_drive

import oncenter as oc
from oncenter.cli import run
from oncenter.signals import DEGREE, Signals, Source

RATE_HZ = 20.0
OFFSET_DEG, CROWN_DEG = -1.2, 1.5  # of the sensor; what the road's fall takes, to either hand
SPEED_M_S = 5.0
LEG_M = 800.0


def course(*legs: tuple[float, float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Positions (m) at every tick along straight lines (from x, y; to x, y), one after the other."""
    parts = []
    for from_x, from_y, to_x, to_y in legs:
        ticks = int(math.hypot(to_x - from_x, to_y - from_y) / SPEED_M_S * RATE_HZ)
        parts.append(np.linspace([from_x, from_y], [to_x, to_y], ticks, endpoint=False))
    return tuple(np.concatenate(parts).T)


def drive(*legs: tuple[float, float, float, float], at_deg: tuple[float, float] = (59.2, 17.6)) -> Signals:
    """A truck along these lines, x east and y north. Eastbound the crown wants CROWN_DEG, westbound as much the other
    way; hands swing by a degree every 8 s."""
    east_m, north_m = course(*legs)
    time = np.arange(len(east_m)) / RATE_HZ
    heading = np.arctan2(np.gradient(east_m), np.gradient(north_m))
    swing_deg = np.sin(2 * math.pi * time / 8.0)
    angle_deg = OFFSET_DEG + CROWN_DEG * np.sign(np.gradient(east_m)) + swing_deg
    latitude_deg = at_deg[0] + north_m / 111_400
    table = pl.DataFrame(
        {
            "time_s": time,
            "steering_wheel_angle_rad": angle_deg * DEGREE,
            "latitude_deg": latitude_deg,
            "longitude_deg": (at_deg[1] + east_m / (111_500 * np.cos(latitude_deg * DEGREE)) + 180) % 360 - 180,
            "heading_deg": np.mod(heading / DEGREE, 360.0),
            "lateral_acceleration_m_s2": 0.1 * np.sign(np.gradient(east_m)),
        }
    )
    names = ("steering_wheel_angle", "latitude", "longitude", "heading", "lateral_acceleration")
    return Signals(table, {name: Source(f"column {name}", RATE_HZ, len(time), 0) for name in names}, RATE_HZ, "made up")


THERE = (0.0, 0.0, LEG_M, 0.0)
ROUND = (LEG_M, 0.0, LEG_M, 90.0), (LEG_M, 90.0, LEG_M + 60.0, 0.0)
BACK = (LEG_M, 0.0, 0.0, 0.0)


@functools.cache
def both_ways() -> tuple[oc.Reference, float]:
    signals, truth = oc.simulate("both_ways", seed=3)
    return oc.reference(signals), truth.offset_rad


def test_chapter_3s_drive_gives_its_two_means_and_their_midpoint() -> None:
    measured, offset_rad = both_ways()
    north_west, south_east = measured.ways
    assert (north_west.compass, south_east.compass) == ("north-west", "south-east")
    assert abs(north_west.mean_rad / DEGREE - 3.60) < 0.2
    assert abs(south_east.mean_rad / DEGREE - 0.48) < 0.2
    low, high = measured.offset.ci95
    assert low < offset_rad < high
    assert high - low < 0.6 * DEGREE
    assert measured.offset.status == "valid"
    assert 1350 < measured.length_m < 1450
    assert north_west.lateral_acceleration_m_s2 > 0.1 and south_east.lateral_acceleration_m_s2 < -0.05


def test_the_midpoint_does_not_depend_on_road_crown_or_place_on_earth() -> None:
    for at_deg in ((59.2, 17.6), (-33.0, 179.999), (0.0, -70.0)):
        measured = oc.reference(drive(THERE, *ROUND, BACK, at_deg=at_deg))
        assert measured.offset.value == pytest.approx(OFFSET_DEG * DEGREE, abs=0.1 * DEGREE)
        assert [way.mean_rad / DEGREE for way in measured.ways] == pytest.approx(
            [OFFSET_DEG + CROWN_DEG, OFFSET_DEG - CROWN_DEG], abs=0.1
        )
        assert measured.residual_sd_m < 0.1
        assert [len(way.passes) for way in measured.ways] == [1, 1]


def test_a_slowly_driven_place_has_no_more_weight() -> None:
    """Half of the way there at a fifth of the speed, with another angle: the mean over the way stays."""
    signals = drive(THERE, *ROUND, BACK)
    first = signals.table.filter(pl.col("time_s") < LEG_M / SPEED_M_S / 2)
    slow = first.select(pl.all().repeat_by(5).explode()).with_columns(
        (pl.col("steering_wheel_angle_rad") + 2.0 * DEGREE).alias("steering_wheel_angle_rad")
    )
    rest = signals.table.filter(pl.col("time_s") >= LEG_M / SPEED_M_S / 2)
    table = pl.concat([slow, rest])
    table = table.with_columns(pl.Series("time_s", np.arange(len(table)) / RATE_HZ))
    measured = oc.reference(Signals(table, signals.sources, RATE_HZ, "made up"))
    assert measured.ways[0].mean_rad / DEGREE == pytest.approx(OFFSET_DEG + CROWN_DEG + 1.0, abs=0.15)


def test_every_pass_over_the_straight_counts_and_reverse_does_not() -> None:
    signals = drive(THERE, *ROUND, BACK, (0.0, 0.0, -50.0, 40.0), (-50.0, 40.0, 0.0, 0.0), THERE, BACK)
    backwards = pl.col("time_s") > signals.table["time_s"][-1] - LEG_M / SPEED_M_S
    turned = (pl.when(backwards).then((pl.col("heading_deg") + 180.0) % 360.0).otherwise("heading_deg")).alias(
        "heading_deg"
    )
    measured = oc.reference(Signals(signals.table.with_columns(turned), signals.sources, RATE_HZ, "made up"))
    assert [len(way.passes) for way in measured.ways] == [2, 1]
    assert measured.notes[-1] == "left out: 1 of 4 passes in reverse"


def test_the_lane_that_was_driven_both_ways_counts_alone() -> None:
    """However often another one was driven one way."""
    other_lane = (0.0, 4.0, LEG_M, 4.0)
    far_back = (LEG_M, 4.0, LEG_M, 90.0), (LEG_M, 90.0, -20.0, 90.0), (-20.0, 90.0, 0.0, 4.0)
    turn = (0.0, 0.0, -50.0, 40.0), (-50.0, 40.0, 0.0, 0.0)
    measured = oc.reference(drive(other_lane, *far_back, other_lane, *far_back, other_lane, *ROUND, BACK, *turn, THERE))
    assert [len(way.passes) for way in measured.ways] == [1, 1]
    assert [way.compass for way in measured.ways] == ["west", "east"]
    assert measured.notes[-1] == "left out: 3 of 5 passes in another lane"
    assert abs(measured.apart_m) < 0.1


def test_a_way_back_in_reverse_does_not_count() -> None:
    signals = drive(THERE, BACK)
    table = signals.table.with_columns(pl.lit(90.0).alias("heading_deg"))
    with pytest.raises(oc.OncenterError, match="one way only") as refusal:
        oc.reference(Signals(table, signals.sources, RATE_HZ, "made up"))
    assert refusal.value.code == "not_both_ways"


@pytest.mark.parametrize(
    ("legs", "code", "words"),
    [
        ([THERE], "not_both_ways", "to the east, was not driven back"),
        ([THERE, *ROUND, (LEG_M, 5.0, 0.0, 5.0)], "not_both_ways", "beside the way there"),
        ([THERE, *ROUND, (LEG_M, 15.0, 0.0, 15.0)], "not_both_ways", "15.0 m beside the way there"),
        ([THERE, *ROUND, (LEG_M, 60.0, 0.0, 60.0)], "not_both_ways", "was not driven back"),
        (
            [(0.0, 0.0, 150.0, 0.0), (150.0, 0.0, 150.0, 150.0), (150.0, 0.0, 0.0, 0.0)],
            "no_straight",
            "there is no straight",
        ),
        ([(0.0, 0.0, 4.0, 0.0)], "no_straight", "there is no straight of 300 m"),
    ],
)
def test_a_drive_without_a_reference_is_refused_in_a_line(legs: list, code: str, words: str) -> None:
    with pytest.raises(oc.OncenterError) as refusal:
        oc.reference(drive(*legs))
    assert (refusal.value.code, refusal.value.exit_code) == (code, 1)
    assert words in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_without_the_angle_on_the_way_back_there_is_no_answer() -> None:
    signals = drive(THERE, *ROUND, BACK)
    gone = pl.when(pl.col("time_s") > 250.0).then(math.nan).otherwise("steering_wheel_angle_rad")
    table = signals.table.with_columns(gone.alias("steering_wheel_angle_rad"))
    with pytest.raises(oc.OncenterError, match=r"no pass in each direction with a steering wheel angle"):
        oc.reference(Signals(table, signals.sources, RATE_HZ, "made up"))


def test_positions_that_are_all_missing_are_refused() -> None:
    signals = drive(THERE, *ROUND, BACK)
    table = signals.table.with_columns(pl.lit(math.nan).alias("latitude_deg"))
    with pytest.raises(oc.OncenterError, match="no position"):
        oc.reference(Signals(table, signals.sources, RATE_HZ, "made up"))


def test_the_interval_contains_the_truth_on_95_of_100_drives(tmp_path: Path) -> None:
    """The straights are short, with play, drawn at random; the seeds are not those that settled how it is computed."""
    random, held = np.random.default_rng(2016), []
    there_and_round = "{ length_m = 26.0, turn_deg = -43.07260321 }, { length_m = 89.0, turn_deg = 266.14520642 }, "
    there_and_round += "{ length_m = 26.0, turn_deg = -43.07260321 }"
    for seed in range(16):
        play_deg, crown_percent, offset_deg = random.uniform([0.0, 0.3, -5.0], [8.0, 2.5, 5.0])
        scenario = tmp_path / "both_ways.toml"
        legs = [f"{{ length_m = 700.0, cross_slope_percent = {sign * crown_percent} }}" for sign in (1, -1)]
        scenario.write_text(
            'about = "short"\nbase = "both_ways"\n[drive]\nduration_s = 330.0\n'
            f"[steering]\nbacklash_deg = {play_deg}\n[sensors.steering_wheel_angle]\noffset_deg = {offset_deg}\n"
            "[driver]\nspeed_km_h = [20.0, 22.0]\n"
            f"[road]\nsections = [{legs[0]}, {there_and_round}, {legs[1]}, {there_and_round}]\n"
        )
        signals, truth = oc.simulate(scenario, seed)
        low, high = oc.reference(signals).offset.ci95
        held.append(low < truth.offset_rad < high)
    assert sum(held) >= 14  # fewer than that happen once in 100 times when it is 95 %


def test_the_verb_prints_what_the_function_gives(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "both.parquet"
    signals = drive(THERE, *ROUND, BACK)
    signals.table.write_parquet(log)
    assert run(["reference", str(log)]) == 0
    assert capsys.readouterr().out.startswith("straight-ahead offset -1.2")
    assert run(["reference", str(log), "--json"]) == 0
    given = json.loads(capsys.readouterr().out)
    assert given["schema"] == "oncenter/reference-1"
    assert given["offset"]["value"] == pytest.approx(OFFSET_DEG, abs=0.1)
    assert [way["compass"] for way in given["ways"]] == ["east", "west"]


def test_a_recorded_drive_without_positions_is_refused_with_their_names(capsys: pytest.CaptureFixture[str]) -> None:
    log = real_drive("genesis/cpg_fast_lap.csv.gz")
    genesis = Path(__file__).parents[1] / "examples" / "genesis.toml"
    assert run(["reference", str(log), "--vehicle", str(genesis), "--json"]) == 1
    given = json.loads(capsys.readouterr().out)
    assert (given["code"], given["needs"]) == ("missing_signal", ["latitude", "longitude"])


def test_a_recorded_minute_one_way_is_refused(comma2k19: Signals) -> None:
    with pytest.raises(oc.OncenterError, match="was not driven back"):
        oc.reference(comma2k19)


@pytest.fixture
def comma2k19() -> Signals:
    """Angle and fused GNSS positions of a recorded minute on a motorway."""
    segment = real_drive("comma2k19_example")
    time = np.load(segment / "global_pose" / "frame_times")
    positions_m = np.load(segment / "global_pose" / "frame_positions")  # WGS 84, earth-centred
    latitude_deg, longitude_deg = geodetic_deg(positions_m)
    angle_time, angle_deg = (
        np.load(segment / "processed_log" / "CAN" / "steering_angle" / file).ravel() for file in ("t", "value")
    )
    table = pl.DataFrame(
        {
            "time_s": time - time[0],
            "steering_wheel_angle_rad": np.interp(time, angle_time, angle_deg) * DEGREE,
            "latitude_deg": latitude_deg,
            "longitude_deg": longitude_deg,
        }
    )
    return Signals(table, {}, 20.0, "comma2k19")


def geodetic_deg(earth_centred_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Latitude by Bowring's formula, and longitude."""
    x, y, z = earth_centred_m.T
    equator_m, flattening = 6_378_137.0, 1 / 298.257223563
    pole_m = equator_m * (1 - flattening)
    first, second = 1 - (pole_m / equator_m) ** 2, (equator_m / pole_m) ** 2 - 1
    radius_m = np.hypot(x, y)
    theta = np.arctan2(z * equator_m, radius_m * pole_m)
    latitude = np.arctan2(z + second * pole_m * np.sin(theta) ** 3, radius_m - first * equator_m * np.cos(theta) ** 3)
    return latitude / DEGREE, np.arctan2(y, x) / DEGREE
