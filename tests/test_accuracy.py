"""The accuracy bench: its drives match their rows, and its figures match their names."""

import dataclasses
import math
import sys
from pathlib import Path

import numpy as np
import polars as pl
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "bench"))

import accuracy
import accuracy_rows
import population
from accuracy_rows import ROWS, drive

import oncenter as oc
from oncenter import _core
from oncenter.estimates.estimate import Estimate
from oncenter.signals import DEGREE

pytestmark = pytest.mark.slow


def test_a_drawn_truck_has_the_understeer_gradient_that_was_drawn() -> None:
    from oncenter.simulate.truck import understeer_gradient
    from oncenter.simulate.truck_sections import Steering, Truck

    random = np.random.default_rng(5)
    for _ in range(20):
        drawn = population.draw(random)
        steering = Steering(**population.steering(drawn, drawn["front_axle_load_kg"], pulls=False))
        truck = Truck(
            **population.truck(drawn), relaxation_length_m=0.5, track_width_front_m=2.05, track_width_rear_m=1.83
        )
        wanted = drawn["understeer_gradient_deg_m_s2"] * DEGREE
        assert understeer_gradient(truck, steering) == pytest.approx(wanted, rel=1e-9)


def test_values_fixed_by_a_row_do_not_change_its_random_values() -> None:
    free = population.draw(np.random.default_rng(3))
    fixed = population.draw(np.random.default_rng(3), {"backlash_deg": 0.0, "trail_m": 0.05})
    assert {name for name in free.numbers if free[name] != fixed[name]} == {"backlash_deg", "trail_m"}


def test_every_row_can_be_driven_and_has_a_truth_for_each_minute(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for row in ROWS.values():
        driven = drive(row, 1, tmp_path)
        assert len(driven.target_rad) == 20
        assert np.isfinite(driven.target_rad).all()
        assert 0.0 < driven.side_force_floor_rad < 4.0 * DEGREE
        assert (driven.floor_rad > driven.side_force_floor_rad) == (row.one_flank or row.set_up)
        assert driven.vehicle.traffic_side == (row.given_side or row.traffic_side)
    assert not list(tmp_path.iterdir())


def test_the_same_row_and_seed_give_the_same_drive(tmp_path: Path) -> None:
    first, again = (drive(ROWS["population"], 7, tmp_path) for _ in range(2))
    assert first.signals.table.equals(again.signals.table, null_equal=True)
    assert first.vehicle == again.vehicle
    assert not first.signals.table.equals(drive(ROWS["population"], 8, tmp_path).signals.table)


def test_a_remounted_sensor_is_judged_by_its_current_offset(tmp_path: Path) -> None:
    remount = {"sensors": {"steering_wheel_angle": {"remounts": [{"begin_s": 630.0, "step_deg": 3.0}]}}}
    row = dataclasses.replace(ROWS["remounted"], extra=lambda random: remount)
    steps = np.diff(drive(row, 1, tmp_path).target_rad)
    assert np.flatnonzero(steps).tolist() == [9]  # between the ends of the 10th and the 11th minute
    assert steps[9] == pytest.approx(3.0 * DEGREE)


def test_ebc2_s_wheel_speeds_are_whole_sixteenths_about_the_front_axle_s(tmp_path: Path) -> None:
    table = drive(ROWS["ebc2"], 1, tmp_path).signals.table[::10]
    wheels = {name: table[f"{name}_m_s"].to_numpy() * 3.6 * 16.0 for name in accuracy_rows.WHEEL_SPEEDS}
    apart = wheels["wheel_speed_rear_left"] - wheels["wheel_speed_rear_right"]
    np.testing.assert_allclose(apart, np.round(apart), atol=1e-6)
    assert np.ptp(apart) > 5.0


def test_the_minimum_interval_comes_from_accelerometer_pull_and_wind() -> None:
    # Bayes' rule as a least squares: unknown bias, crown, pull and wind, each with its prior; the mean bank is bias +
    # crown, the ground stood on bias + a share of it; with play bias + pull + wind is known, and what is sought is the
    # bias, without it bias + wind.
    params = _core.default_params()
    bias, crown, ground = (params[f"{name}_sd_m_s2"] for name in ("accelerometer_bias", "crown", "standing_slope"))
    pull, wind = params["pull_sd_m_s2"], params["wind_sd_m_s2"]
    share = params["standing_crown_share_1"]
    for stood in (False, True):
        bank, standing = np.array([1.0, 1.0, 0.0, 0.0]), np.array([1.0, share, 0.0, 0.0])
        information = np.diag([1 / bias**2, 1 / crown**2, 1 / pull**2, 1 / wind**2])
        information += 1e9 * np.outer(bank, bank) + stood / ground**2 * np.outer(standing, standing)
        unloading = np.array([1.0, 0.0, 1.0, 1.0])
        with_play = math.sqrt(np.linalg.inv(information + 1e9 * np.outer(unloading, unloading))[0, 0])
        covariance = np.linalg.inv(information)
        without = math.sqrt(covariance[0, 0] + covariance[3, 3])
        assert population.not_identifiable_m_s2(unloads=True, stood=stood) == pytest.approx(with_play, rel=1e-4)
        assert population.not_identifiable_m_s2(unloads=False, stood=stood) == pytest.approx(without, rel=1e-4)


def test_the_population_s_pull_and_crown_match_the_estimator_s_priors() -> None:
    params = _core.default_params()
    random = np.random.default_rng(11)
    drawn = [population.draw(random) for _ in range(4000)]
    assert np.std([d["pull_m_s2"] for d in drawn]) == pytest.approx(params["pull_sd_m_s2"], rel=0.05)
    crown = np.array([d["crown_percent"] for d in drawn]) / 100.0 * 9.80665
    assert np.mean(crown) == pytest.approx(params["crown_m_s2"], rel=0.05)
    assert np.std(crown) == pytest.approx(params["crown_sd_m_s2"], rel=0.05)


def test_the_uncertainty_from_the_axle_setup_matches_the_population() -> None:
    """Among many trucks drawn from the priors, those whose neutral lateral acceleration deviates as on the crown."""
    params, random, count = _core.default_params(), np.random.default_rng(3), 2_000_000
    crown, bias_sd = params["crown_m_s2"], population.accelerometer_bias_sd_m_s2(stood=True)
    kind = random.choice(3, count, p=[0.9, 0.05, 0.05])  # as most are, set up, on roads that fall to the other side
    bias = random.normal(crown * np.array([0.0, 0.0, 2.0])[kind], bias_sd)
    pull = random.normal(0.0, np.hypot(params["pull_sd_m_s2"], params["wind_sd_m_s2"]), count) + crown * (kind == 1)
    alike = np.abs(bias + pull - crown) < 0.02
    not_identifiable = population.not_identifiable_m_s2(unloads=True, stood=True)
    left = population.set_up_left_open_m_s2(stood=True)
    assert np.std(pull[alike]) == pytest.approx(np.hypot(not_identifiable, left), rel=0.1)


def test_intervals_contain_the_offset_of_axles_adjusted_for_the_crown(tmp_path: Path) -> None:
    held, beside = 0, 0
    for seed in range(1, 13):
        offset, truth = offset_and_truth("unloads_on_crown", seed, tmp_path)
        assert offset.value is not None and offset.ci95 is not None
        held += offset.ci95[0] <= truth <= offset.ci95[1]
        beside += abs(offset.value - truth) > 0.5 * DEGREE
    assert held >= 10
    assert beside >= 8  # the value is that of an axle which is not


def test_a_row_that_a_rival_wins_gives_the_reason_with_figures() -> None:
    import accuracy_page

    figures = {
        "row": "unloads_on_crown",
        "floor_deg": 0.9,
        "exact_data_deg": 0.3,
        "lean_deg": 0.0,
        "ns_per_sample": 20.0,
    }
    table = pl.DataFrame(
        [
            {**figures, "method": method, "error_deg": [error], "sd_deg": [0.5], "valid": [True], "deg_per_m_s2": 8.0}
            for method, error in (("joint", 1.8), ("openpilot", 1.6))
        ]
    )
    summaries = accuracy.summarise(table)
    (line,) = (x for x in accuracy_page._why(table, summaries) if x.startswith("- "))
    assert "openpilot has a median of 1.60 deg against 1.80" in line
    assert "0 of 1 intervals" in line
    assert "4 sd" in line
    assert "here 1.60 deg" in line  # 0.2 m/s^2 times 8 deg/(m/s^2)
    assert not list(accuracy_page._why(table, accuracy.summarise(table.filter(pl.col("method") == "openpilot"))))


def test_missing_real_drives_are_reported_as_not_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import accuracy_page
    import accuracy_real

    monkeypatch.setattr(accuracy_real, "REAL_DATA", tmp_path)
    said = list(accuracy_real.real_drives())
    assert not said
    assert any("Not run" in line for line in accuracy_page._real(said))


@pytest.mark.parametrize(
    ("error_deg", "minutes"),
    [
        ([0.1, 0.1, 0.1], 1),
        ([3.0, 0.1, 0.1], 2),
        ([0.1, 3.0, 0.1], 3),
        ([np.nan, np.nan, 0.1], 3),
        ([0.1, 0.1, 3.0], np.inf),
        ([0.1, 0.1, np.nan], np.inf),
    ],
)
def test_the_time_to_a_bound_is_when_the_error_stays_below_it(error_deg: list[float], minutes: float) -> None:
    assert accuracy.minutes_until_below(np.array(error_deg), 1.0) == minutes


def test_a_summary_counts_coverage_over_intervals_and_errors_over_values(tmp_path: Path) -> None:
    import polars as pl

    part = pl.DataFrame(
        {
            "error_deg": [[0.5, 0.1], [0.5, -0.4], [0.5, -0.4], [None, None]],
            "sd_deg": [[1.0, 0.1], [1.0, 0.1], [1.0, 0.1], [None, None]],
            "lean_deg": [0.0, 0.0, 0.3, 0.0],
            "valid": [[False, True], [False, False], [False, False], [False, False]],
            "floor_deg": [0.1, 0.1, 0.1, 0.1],
            "ns_per_sample": [30.0, 20.0, 25.0, 25.0],
        }
    )
    summary = accuracy._summary("ordinary", "thesis", part)
    assert (summary.answered, summary.valid) == (0.75, 0.25)
    assert (summary.median, summary.valid_median, summary.largest) == (0.4, 0.1, 0.4)
    # 0.4 lies outside of 1.96 * 0.1, but not where the middle is 0.3 nearer to the truth than the value
    assert (summary.covered, summary.intervals) == (2, 3)
    assert summary.of_floor == pytest.approx(1.96)
    assert summary.minutes_to_half_deg == 2.0
    assert summary.ns_per_sample == 25.0


def offset_and_truth(row: str, seed: int, folder: Path) -> tuple[Estimate, float]:
    driven = drive(ROWS[row], seed, folder)
    return oc.offset(driven.signals, driven.vehicle).offset, driven.target_rad[-1]


def middle_rad(offset: Estimate) -> float:
    assert offset.ci95 is not None
    return 0.5 * (offset.ci95[0] + offset.ci95[1])


def test_for_trucks_with_pull_the_interval_s_centre_is_nearer_to_the_truth(tmp_path: Path) -> None:
    found = [offset_and_truth("pull", seed, tmp_path) for seed in range(1, 61)]
    of_value = np.array([(offset.value or 0.0) - truth for offset, truth in found]) / DEGREE
    of_middle = np.array([middle_rad(offset) - truth for offset, truth in found]) / DEGREE
    assert np.sqrt(np.mean(of_middle**2)) < 0.9 * np.sqrt(np.mean(of_value**2))  # 0.87 by the priors


def test_without_an_accelerometer_the_interval_is_centred_on_the_value(tmp_path: Path) -> None:
    offset, _ = offset_and_truth("no_accelerometer", 1, tmp_path)
    assert middle_rad(offset) == pytest.approx(offset.value, abs=1e-12)


DEG_PER_M_S2 = 7.722064264745321  # i K_us/g of the thesis drive's truck


def machine_driven(folder: Path, *, friction_n_m: float, zero_m_s2: float) -> pl.DataFrame:
    """A truck with another accelerometer bias, offset and crown, such that its readings stay the same."""
    at_s = np.arange(40.0, 200.0, 1.3)
    random = np.random.default_rng(3)
    measured_deg = 12.0 * np.sin(0.7 * np.arange(len(at_s))) + random.normal(0.0, 6.0, len(at_s))
    offset_deg = 2.0 + zero_m_s2 * DEG_PER_M_S2
    file = folder / "machine.toml"
    file.write_text(
        f"""about = "Steered by a machine."
base = "mid_speed_manoeuvre"
[drive]
duration_s = 220.0
[manoeuvre]
kind = "profile"
time_s = {[0.0, *at_s.round(3).tolist()]}
angle_deg = {[0.0, *(measured_deg - offset_deg).tolist()]}
[steering]
backlash_deg = 15.0
king_pin_friction_n_m = {friction_n_m}
[road]
crown_percent = {2.0 - zero_m_s2 / 0.0980665}
[sensors.steering_wheel_angle]
offset_deg = {offset_deg}
[sensors.lateral_acceleration]
bias_m_s2 = {zero_m_s2}
""",
        encoding="utf-8",
    )
    signals, truth = oc.simulate(file, 1)
    assert truth.steering_ratio * truth.understeer_gradient / DEGREE == pytest.approx(DEG_PER_M_S2)
    return signals.table.drop("time_s", "steering_wheel_angle_sensor_type")[5000:]  # what differed at first is over


def test_friction_in_the_play_makes_trucks_with_different_offsets_indistinguishable(tmp_path: Path) -> None:
    """0.8 deg apart, and equal but for single steps of the yaw rate's and the accelerometer's resolution."""
    apart, (holds, gives) = {}, (1e6, 20.0)
    for friction_n_m in (holds, gives):
        one, other = (
            machine_driven(tmp_path, friction_n_m=friction_n_m, zero_m_s2=zero_m_s2).to_numpy()
            for zero_m_s2 in (0.0, 0.1)
        )
        apart[friction_n_m] = np.sqrt(np.nanmean((one - other) ** 2, axis=0)) / np.nanstd(one, axis=0)
    assert apart[holds].max() < 0.02
    assert apart[gives].max() > 0.1  # where side force moves them, the logs are not the same
