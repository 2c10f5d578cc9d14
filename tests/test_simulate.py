"""The simulator against closed forms, against its mirror image, and against its own log decoded by hand."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from oncenter.errors import OncenterError
from oncenter.signals import DEGREE, SIGNALS, STANDARD_GRAVITY
from oncenter.simulate import simulate, simulate_to_log
from oncenter.simulate.can import one_byte, two_bytes
from oncenter.simulate.drive import ffi, lib, run, tick_count
from oncenter.simulate.road import lay_road
from oncenter.simulate.scenario import read_scenario
from oncenter.vehicle import vehicle

THESIS_DRIVE = Path(__file__).parents[1] / "scenarios" / "thesis_drive.toml"
STEP_S = 0.0025
STRAIGHT = {"straight_length_m": "[1e6, 1e6]", "duration_s": "200.0", "speed_km_h": "[40.0, 40.0]"}

Variant = Callable[..., Path]


@pytest.fixture
def variant(tmp_path: Path) -> Variant:
    """Writes the thesis drive with some keys changed; key=None leaves the key out."""

    def write(name: str = "variant", extra: str = "", **changes: str | None) -> Path:
        text = THESIS_DRIVE.read_text(encoding="utf-8")
        for key, value in changes.items():
            text, count = re.subn(rf"^{key} = .*$", "" if value is None else f"{key} = {value}", text, flags=re.M)
            assert count >= 1, key
        file = tmp_path / f"{name}.toml"
        file.write_text(extra + text, encoding="utf-8")
        return file

    return write


@pytest.fixture(scope="module")
def thesis_drive() -> Any:
    return simulate("thesis_drive", seed=1)


# The road


def test_the_road_is_linear_between_its_points_and_constant_beyond_its_ends() -> None:
    curvature = ffi.new("double[]", [1.0, 2.0, 4.0])
    road = ffi.new("sim_road *", {"count": 3, "spacing": 5.0, "curvature": curvature})
    for station, expected in ((-1.0, 1.0), (0.0, 1.0), (2.5, 1.5), (6.0, 2.4), (10.0, 4.0), (99.0, 4.0)):
        assert lib.sim_road_at(road, curvature, station) == pytest.approx(expected, rel=1e-12)


# The drive


def test_a_mirrored_drive_is_driven_with_mirrored_angles_to_the_last_bit() -> None:
    scenario = read_scenario("thesis_drive")
    road = lay_road(scenario, np.random.default_rng(3))
    lane, hand = np.random.default_rng(4).standard_normal((2, tick_count(scenario)))
    there, mirrored = run(scenario, road, lane, hand), run(scenario, road.mirrored, -lane, -hand)
    for odd in ("steering_wheel_angle", "place_in_play", "yaw_rate", "lateral_acceleration", "aligning_moment"):
        np.testing.assert_array_equal(mirrored[odd], -there[odd])
    for even in ("vehicle_speed", "station"):
        np.testing.assert_array_equal(mirrored[even], there[even])


def test_there_and_back_on_a_crowned_straight_mirrors_the_acceleration_and_leaves_the_offset(variant: Variant) -> None:
    """Chapter 3 and Figure 9: the effect of the road on the angle cancels, that of the sensor stays."""
    there, truth = simulate(variant("there", crown_percent="2.0", **STRAIGHT))
    back, truth_back = simulate(variant("back", crown_percent="-2.0", **STRAIGHT), seed=2)
    moving = slice(4000, 17000)

    def mean(drive: Any, column: str) -> float:
        return float(drive.table[column].to_numpy()[moving].mean())

    crown = 0.02 * STANDARD_GRAVITY
    bias = truth.lateral_acceleration_bias_m_s2
    assert mean(there, "lateral_acceleration_m_s2") - bias == pytest.approx(crown, abs=0.01)
    assert mean(back, "lateral_acceleration_m_s2") - bias == pytest.approx(-crown, abs=0.01)

    angles = [mean(drive, "steering_wheel_angle_rad") for drive in (there, back)]
    assert sum(angles) / 2 == pytest.approx(truth.offset_rad, abs=0.1 * DEGREE)
    places = [mean(t, "place_in_play") for t in (truth, truth_back)]
    assert places == pytest.approx([1.0, -1.0], abs=0.2)  # on the flank, except for small corrections
    play, slip = (places[0] - places[1]) / 2 * truth.backlash_rad / 2, 19.3 * truth.understeer_gradient * crown
    assert (angles[0] - angles[1]) / 2 == pytest.approx(play + slip, abs=0.05 * DEGREE)


def test_the_thesis_drive_has_the_thesis_s_values(thesis_drive: Any) -> None:
    _, truth = thesis_drive
    table_2, scenario = vehicle("scania_r730_4x2"), read_scenario("thesis_drive")
    assert scenario.truck.wheelbase_m == table_2.wheelbase_m == 3.7
    assert scenario.steering.steering_ratio == table_2.steering_ratio == 19.3
    assert truth.offset_rad == 2.04 * DEGREE
    assert truth.understeer_gradient / DEGREE == pytest.approx(0.4, abs=0.01)

    speed = truth.table["vehicle_speed_m_s"].to_numpy() * 3.6
    assert len(speed) == 180_000
    assert (speed[:1000] == 0).all()
    assert (speed[-950:] == 0).all()
    assert speed.max() < 91
    assert 45 < speed[speed > 0].mean() < 70
    assert np.abs(truth.table["lateral_error_m"].to_numpy()).max() < 1.0


def test_the_understeer_gradient_follows_from_the_drive_s_bends(thesis_drive: Any) -> None:
    _, truth = thesis_drive
    r, v, a_y, wheel, c = (
        truth.table[column].to_numpy()
        for column in (
            "yaw_rate_rad_s",
            "vehicle_speed_m_s",
            "lateral_acceleration_m_s2",
            "steering_wheel_angle_rad",
            "place_in_play",
        )
    )
    bend = (v > 10) & (np.abs(a_y) > 0.3)
    beyond_ackermann = (wheel - c * truth.backlash_rad / 2) / 19.3 - 3.7 * r / np.maximum(v, 1)
    slope = (beyond_ackermann * a_y)[bend].sum() / (a_y**2)[bend].sum()
    assert slope == pytest.approx(truth.understeer_gradient, rel=0.03)


def test_left_is_positive_for_angle_yaw_rate_and_acceleration_and_the_left_wheels_are_the_slower_ones(
    thesis_drive: Any,
) -> None:
    signals, truth = thesis_drive
    table = signals.table
    left = truth.table["road_curvature_1_m"].to_numpy() > 1 / 600
    assert left.sum() > 1000
    for column in ("steering_wheel_angle_rad", "yaw_rate_rad_s", "lateral_acceleration_m_s2"):
        assert table[column].to_numpy()[left].mean() > 0
    turning = truth.table["yaw_rate_rad_s"].to_numpy()[left].mean()
    for axle, track_m in (("front", 2.05), ("rear", 1.83)):
        right_less_left = table[f"wheel_speed_{axle}_right_m_s"] - table[f"wheel_speed_{axle}_left_m_s"]
        assert right_less_left.to_numpy()[left].mean() == pytest.approx(track_m * turning, rel=0.02)


def test_residuals_are_correlated_for_seconds(variant: Variant) -> None:
    signals, _ = simulate(variant(**STRAIGHT))
    wheel = signals.table["steering_wheel_angle_rad"].to_numpy()[4000:17000]
    wheel = wheel - wheel.mean()

    def correlation(lag_s: float) -> float:
        lag = round(lag_s * 100)
        return float((wheel[lag:] * wheel[:-lag]).mean() / wheel.var())

    assert 0.5 * DEGREE < wheel.std() < 2.5 * DEGREE  # Figure 9: 1.19 deg
    assert correlation(0.5) > 0.3
    assert abs(correlation(20.0)) < 0.3


# The sensors


def test_at_standstill_the_sensors_read_their_bias_in_steps_of_their_resolution(thesis_drive: Any) -> None:
    signals, truth = thesis_drive
    table = signals.table[:950]
    yaw_rate = table["yaw_rate_rad_s"].to_numpy() / DEGREE
    a_y = table["lateral_acceleration_m_s2"].to_numpy()
    assert yaw_rate.mean() == pytest.approx(0.05, abs=0.015)
    assert a_y.mean() == pytest.approx(0.02 * STANDARD_GRAVITY + truth.lateral_acceleration_bias_m_s2, abs=0.015)
    for reading, resolution in ((yaw_rate, 0.1), (a_y, 0.01 * STANDARD_GRAVITY)):
        np.testing.assert_allclose(reading / resolution, np.round(reading / resolution), atol=1e-9)
    assert (table["vehicle_speed_m_s"] == 0).all()


def test_the_measured_angle_less_the_offset_is_the_true_angle(thesis_drive: Any) -> None:
    signals, truth = thesis_drive
    measured = signals.table["steering_wheel_angle_rad"].to_numpy()
    error = measured - truth.offset_rad - truth.table["steering_wheel_angle_rad"].to_numpy()
    assert abs(error.mean()) < 0.005 * DEGREE
    assert np.abs(error).max() < 0.2 * DEGREE


# The log

LINE = re.compile(r"\((\d+\.\d{6})\) can0 ([0-9A-F]{8})#([0-9A-F]{16})")


def frames(log: Path) -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """Times and payloads by PGN, decoded from the text alone."""
    by_pgn: dict[int, list[tuple[float, bytes]]] = {}
    for line in log.read_text(encoding="ascii").splitlines():
        match = LINE.fullmatch(line)
        assert match is not None, line
        pgn = int(match[2], 16) >> 8 & 0x3FFFF
        by_pgn.setdefault(pgn, []).append((float(match[1]), bytes.fromhex(match[3])))
    return {
        pgn: (np.array([t for t, _ in rows]), np.frombuffer(b"".join(p for _, p in rows), np.uint8).reshape(-1, 8))
        for pgn, rows in by_pgn.items()
    }


def test_the_log_has_the_sensors_values_within_j1939_s_resolution(variant: Variant, tmp_path: Path) -> None:
    scenario, log = variant(duration_s="120.0"), tmp_path / "drive.log"
    simulate_to_log(scenario, 5, log)
    signals, _ = simulate(scenario, 5)
    table = {name: signals.table[SIGNALS[name].column].to_numpy() for name in signals.sources}
    messages = frames(log)
    counts = {pgn: len(times) for pgn, (times, _) in messages.items()}
    assert counts == {61449: 12000, 65134: 6000, 65265: 1200, 65215: 1200, 61444: 6000}

    def word(payload: np.ndarray, byte: int) -> np.ndarray:
        return payload[:, byte - 1] + 256.0 * payload[:, byte]

    _, vdc2 = messages[61449]
    for byte, name, scale, offset in (
        (1, "steering_wheel_angle", 1 / 1024, -31.374),
        (4, "yaw_rate", 1 / 8192, -3.92),
        (6, "lateral_acceleration", 1 / 2048, -15.687),
    ):
        np.testing.assert_allclose(word(vdc2, byte) * scale + offset, table[name], atol=scale / 2 * 1.001)
    np.testing.assert_allclose(vdc2[:, 7] * 0.1 - 12.5, table["longitudinal_acceleration"], atol=0.05001)
    assert (vdc2[:, 2] >> 6 == 1).all()  # SPN 1812: an absolute sensor

    step_m_s = 1 / 256 / 3.6
    _, ccvs1 = messages[65265]
    np.testing.assert_allclose(word(ccvs1, 2) * step_m_s, table["vehicle_speed"][::10], atol=step_m_s / 2 * 1.001)
    _, hrw = messages[65134]
    _, ebc2 = messages[65215]
    front_axle = word(ebc2, 1) / 256
    for k, corner in enumerate(("front_left", "front_right", "rear_left", "rear_right")):
        wheel = table[f"wheel_speed_{corner}"]
        np.testing.assert_allclose(word(hrw, 2 * k + 1) * step_m_s, wheel[::2], atol=step_m_s / 2 * 1.001)
        relative = ebc2[:, 2 + k] / 16 - 7.8125
        np.testing.assert_allclose(front_axle + relative, wheel[::10] * 3.6, atol=1 / 32 + 1 / 512 + 1e-9)


def test_every_message_has_its_own_rate_and_jitter_in_order_of_time(variant: Variant, tmp_path: Path) -> None:
    log = tmp_path / "drive.log"
    simulate_to_log(variant(duration_s="60.0"), 1, log)
    times = [float(line[1:18]) for line in log.read_text(encoding="ascii").splitlines()]
    assert times == sorted(times)
    for pgn, period in ((61449, 0.01), (65134, 0.02), (65265, 0.1), (65215, 0.1)):
        late = frames(log)[pgn][0] - times[0]
        late = late - np.arange(len(late)) * period
        assert np.ptp(late) < 0.006
        assert 0.0002 < late.std() < 0.0004


def test_values_not_available_or_out_of_range_get_j1939_s_codes() -> None:
    angle = two_bytes(np.array([math.nan, 1e3, -1e3, -31.374, -1.23 * DEGREE]), 1 / 1024, -31.374)
    assert angle.tobytes().hex() == "ffff" + "fffe" * 2 + "0000" + "697d"
    assert one_byte(np.array([math.nan, 99.0, -12.5, 12.5]), 0.1, -12.5).tobytes().hex() == "fffe00fa"


@pytest.mark.parametrize("suffix", ["log", "csv", "parquet"])
def test_the_same_scenario_and_seed_give_the_same_bytes(variant: Variant, tmp_path: Path, suffix: str) -> None:
    scenario = variant(duration_s="40.0")

    def digests(name: str, seed: int) -> list[str]:
        simulate_to_log(scenario, seed, tmp_path / f"{name}.{suffix}")
        files = [tmp_path / f"{name}.{end}" for end in (suffix, "truth.parquet", "truth.toml")]
        return [hashlib.sha256(file.read_bytes()).hexdigest() for file in files]

    assert digests("a", 1) == digests("b", 1)
    assert not set(digests("a", 1)) & set(digests("c", 2))


# What is refused


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        ({"mass_kg": "-8100.0"}, "truck.mass_kg"),
        ({"wheelbase_m": "0.0"}, "truck.wheelbase_m"),
        ({"wheelbase_m": '"long"'}, "truck.wheelbase_m"),
        ({"front_axle_distance_m": "3.7"}, "front_axle_distance_m"),
        ({"steering_ratio": "nan"}, "steering.steering_ratio"),
        ({"backlash_deg": "45.0"}, "steering.backlash_deg"),
        ({"bend_radius_m": "[5.0, 100.0]"}, "bend_radius_m"),
        ({"straight_length_m": "[900.0, 100.0]"}, "road.straight_length_m"),
        ({"speed_km_h": "[0.0, 90.0]"}, "driver.speed_km_h"),
        ({"standing_at_start_s": "1795.0"}, "duration_s"),
        ({"trail_m": None}, "steering.trail_m"),
        ({"rear_cornering_stiffness_n_rad": "80000.0"}, "rear_cornering_stiffness_n_rad"),
        ({"preview_gain": "2.0", "preview_time_s": "0.5"}, "driver.preview_gain"),
        ({"crown_percent": "2.0\ncrown_degrees = 1.0"}, "road.crown_degrees"),
    ],
)
def test_an_impossible_scenario_is_refused_by_name(variant: Variant, changes: dict[str, Any], names: str) -> None:
    with pytest.raises(OncenterError, match=re.escape(names)) as refusal:
        simulate(variant(**changes))
    assert refusal.value.exit_code == 2
    assert "\n" not in str(refusal.value)


def test_an_unknown_scenario_is_refused_with_the_list_of_names(tmp_path: Path) -> None:
    for scenario, says in (("thesis_walk", "thesis_drive"), (tmp_path / "none.toml", "none.toml")):
        with pytest.raises(OncenterError, match=says) as refusal:
            simulate(scenario)
        assert refusal.value.exit_code == 2


def test_an_invalid_scenario_file_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "drive.toml"
    for content in (b"", b"\xff\xfe", b"about = [", b"name = 3"):
        file.write_bytes(content)
        with pytest.raises(OncenterError, match=r"drive\.toml") as refusal:
            simulate(file)
        assert refusal.value.exit_code == 2


def test_an_output_of_unknown_kind_or_place_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    for output in (tmp_path / "drive.xyz", tmp_path / "nowhere" / "drive.log"):
        with pytest.raises(OncenterError, match=re.escape(str(output))) as refusal:
            simulate_to_log("thesis_drive", 1, output)
        assert refusal.value.exit_code == 2
    assert list(tmp_path.iterdir()) == []


def test_a_negative_seed_is_refused() -> None:
    with pytest.raises(OncenterError, match="seed") as refusal:
        simulate("thesis_drive", seed=-1)
    assert refusal.value.exit_code == 2
