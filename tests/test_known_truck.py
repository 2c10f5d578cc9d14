"""Configured values of a truck, from a vehicle file or its memory, narrow the answer and keep it correct."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from one_hypothesis import SAMPLES, WIDTH_TERM, WINDUP_TERM, Learner, Play, driven

import oncenter as oc
from oncenter import _core
from oncenter._native import lib
from oncenter.errors import OncenterError
from oncenter.signals import DEGREE, Signals
from oncenter.simulate import Truth
from oncenter.truck.now import truck_now
from oncenter.truck.priors import priors_of
from oncenter.vehicle import Vehicle, core_of, vehicle_from

TRUCK = {
    "wheelbase_m": 3.7,
    "steering_ratio": 19.3,
    "track_width_front_m": 2.05,
    "track_width_rear_m": 1.83,
    "traffic_side": "right",
}
PULL_M_S2 = -0.085  # of `pulls`, as the simulator has it without noise


def truck(**known: Any) -> Vehicle:
    return vehicle_from({**TRUCK, **known}, "truck.toml")


def drive(folder: Path, base: str, seed: int, duration_s: float, steering: str) -> tuple[Signals, Truth]:
    scenario = folder / "drive.toml"
    scenario.write_text(f'base = "{base}"\n[drive]\nduration_s = {duration_s}\n[steering]\n{steering}\n')
    return oc.simulate(scenario, seed)


def offset_to_find(truth: Truth) -> float:
    """Sensor reading straight ahead, without lateral acceleration."""
    return truth.offset_rad + truth.straight_ahead_rad


def half_width(answer: oc.Answer) -> float:
    assert answer.offset.ci95 is not None
    return 0.5 * (answer.offset.ci95[1] - answer.offset.ci95[0])


def holds(answer: oc.Answer, value: float) -> bool:
    assert answer.offset.ci95 is not None
    return answer.offset.ci95[0] <= value <= answer.offset.ci95[1]


@pytest.mark.slow
@pytest.mark.parametrize(("base", "seeds"), [("motorway", 20), ("bypass", 6)])
def test_a_configured_play_narrows_a_short_drive_on_one_flank_correctly(tmp_path: Path, base: str, seeds: int) -> None:
    """The error of the configured play is one standard deviation."""
    rng = np.random.default_rng(7)
    without, known, held = [], [], 0
    for seed in range(101, 101 + seeds):
        signals, truth = drive(tmp_path, base, seed, 600.0, "backlash_deg = 8.0")
        play_deg = 8.0 + 0.5 * float(rng.standard_normal())
        answer = oc.offset(signals, truck(play_deg=play_deg, play_sd_deg=0.5))
        without.append(half_width(oc.offset(signals, truck())))
        known.append(half_width(answer))
        held += holds(answer, offset_to_find(truth))
    assert np.median(known) < 0.4 * np.median(without)
    assert held >= 0.9 * seeds


def sd_by(name: str, answer: oc.Answer) -> float:
    """The standard deviation of the offset by that cause; 0 where it is none."""
    return next((cause.sd_rad for cause in answer.not_identifiable if cause.cause == name), 0.0)


def test_a_configured_pull_is_subtracted_and_narrows_the_interval(tmp_path: Path) -> None:
    for seed in (1, 2, 3):
        signals, truth = drive(tmp_path, "thesis_drive", seed, 900.0, "backlash_deg = 8.0\npull_n_m = -30.0")
        without, known = oc.offset(signals, truck()), oc.offset(signals, truck(pull_m_s2=PULL_M_S2, pull_sd_m_s2=0.02))
        assert without.offset.value is not None and known.offset.value is not None
        assert abs(without.offset.value - offset_to_find(truth)) > 0.4 * DEGREE
        assert abs(known.offset.value - offset_to_find(truth)) < 0.15 * DEGREE
        assert sd_by("pull", known) < 0.5 * sd_by("pull", without)
        assert holds(known, offset_to_find(truth))
        priors = {cause.cause: cause.prior.sd_m_s2 for cause in known.not_identifiable}
        assert priors["pull"] == 0.02 and "axle_set_up" not in priors


def test_a_configured_pull_of_a_truck_without_play_is_not_subtracted_twice(tmp_path: Path) -> None:
    """Without enough play to identify it, the neutral lateral acceleration is the sum of bias and pull."""
    signals, truth = drive(tmp_path, "thesis_drive", 2, 900.0, "backlash_deg = 0.3\npull_n_m = -70.0")
    pull = truth.unloading_acceleration_m_s2
    known = oc.offset(signals, truck(play_deg=0.5, play_sd_deg=0.3, pull_m_s2=pull, pull_sd_m_s2=0.02))
    assert known.offset.value is not None
    of_pull = 19.3 * abs(pull) * known.rows[0].gradient
    assert of_pull > 1.2 * DEGREE
    assert abs(known.offset.value - offset_to_find(truth)) < 0.4 * of_pull


def test_with_a_configured_pull_no_axle_set_up_for_the_crown_is_assumed(tmp_path: Path) -> None:
    signals, _ = drive(tmp_path, "thesis_drive", 1, 900.0, "backlash_deg = 8.0\nunloads_on_crown_percent = 2.0")
    assert sd_by("axle_set_up", oc.offset(signals, truck())) > 0.3 * DEGREE
    known = oc.offset(signals, truck(pull_m_s2=0.0, pull_sd_m_s2=0.02))
    assert sd_by("axle_set_up", known) == 0.0


def test_an_axle_set_up_for_the_crown_makes_no_valid_offset_until_the_vehicle_file_has_it(tmp_path: Path) -> None:
    """A healthy axle unloads off the mean bank, one that is set up unloads on it: two offsets, an i K of the crown
    apart."""
    signals, truth = drive(tmp_path, "thesis_drive", 1, 900.0, "backlash_deg = 8.0\nunloads_on_crown_percent = 2.0")
    unknown = oc.offset(signals, truck(traffic_side=None))
    assert unknown.offset.status == "converging" and holds(unknown, offset_to_find(truth))
    assert "axle_may_be_set_up" in {finding.code for finding in unknown.findings}
    known = oc.offset(signals, truck(set_up_for_crown=True))
    assert known.offset.status == "valid" and known.offset.value is not None
    assert abs(known.offset.value - offset_to_find(truth)) < 0.3 * DEGREE
    denied = oc.offset(signals, truck(traffic_side=None, set_up_for_crown=False))
    assert "set_up_contradicted" in {finding.code for finding in denied.findings}
    assert denied.offset.status == "converging"
    signals, truth = drive(tmp_path, "thesis_drive", 1, 900.0, "backlash_deg = 8.0")
    healthy = oc.offset(signals, truck(traffic_side=None, set_up_for_crown=False))
    assert healthy.offset.status == "valid" and sd_by("axle_set_up", healthy) == 0.0


def test_a_set_up_for_the_crown_needs_the_side_of_traffic_and_no_pull() -> None:
    with pytest.raises(OncenterError, match="'set_up_for_crown' needs 'traffic_side'"):
        truck(traffic_side=None, set_up_for_crown=True)
    with pytest.raises(OncenterError, match="the pull contains the set-up"):
        truck(set_up_for_crown=True, pull_m_s2=0.1, pull_sd_m_s2=0.02)
    with pytest.raises(OncenterError, match="traffic_side"):
        truck(traffic_side=["right"], set_up_for_crown=True)


def test_the_set_up_of_a_vehicle_file_is_that_of_the_parameters() -> None:
    params = _core.default_params()
    known = truck(set_up_for_crown=True).params
    assert known["known_pull_m_s2"] == params["crown_m_s2"]
    assert known["known_pull_sd_m_s2"] == params["pull_sd_m_s2"]
    assert truck(traffic_side="left", set_up_for_crown=True).params["known_pull_m_s2"] == -params["crown_m_s2"]


def test_a_configured_pull_shifts_the_estimated_angle_like_the_offset(tmp_path: Path) -> None:
    """Otherwise the estimated angle would have an error of i K times the pull."""
    signals, truth = drive(tmp_path, "thesis_drive", 1, 900.0, "backlash_deg = 8.0\npull_n_m = -30.0")
    table = oc.angle(signals, truck(pull_m_s2=PULL_M_S2, pull_sd_m_s2=0.02), sensor_lost_at=600.0)
    true = truth.table["steering_wheel_angle_rad"].to_numpy() - truth.straight_ahead_rad
    later = (table["time_s"].to_numpy() > 620.0) & (signals.table["vehicle_speed_m_s"].to_numpy() > 8.0)
    error = (table["steering_wheel_angle_rad"].to_numpy() - true)[later]
    assert abs(np.nanmean(error)) < 0.3 * DEGREE


def test_a_wrong_configured_play_is_overruled_by_loading_to_both_sides(tmp_path: Path) -> None:
    signals, truth = drive(tmp_path, "thesis_drive", 1, 1800.0, "backlash_deg = 8.0")
    answer = oc.offset(signals, truck(play_deg=3.0, play_sd_deg=0.5))
    assert answer.backlash.value == pytest.approx(8.0 * DEGREE, abs=0.5 * DEGREE)
    assert holds(answer, offset_to_find(truth))


def test_a_value_without_a_standard_deviation_is_not_used(tmp_path: Path) -> None:
    signals, _ = drive(tmp_path, "thesis_drive", 1, 120.0, "backlash_deg = 8.0")
    means = [name for name in _core.default_params() if name.startswith("known_") and "_sd_" not in name]
    assert len(means) == 7
    answer = oc.offset(signals, truck(), params=dict.fromkeys(means, 0.05))
    assert {**answer.to_dict(), "params": {}} == {**oc.offset(signals, truck()).to_dict(), "params": {}}


def still(learner: Learner) -> Learner:
    """The learner without a sample of motion."""
    nothing = driven(0, Play(), 1)
    for column in vars(nothing).values():
        column[:] = 0.0
    return learner.learn(nothing)


def test_without_evidence_the_play_combines_configured_value_and_prior() -> None:
    """Width and friction hysteresis together: the configured sd beside 6 and 2 deg of each alone."""
    learner = Learner(Play(half_width=3.0 * DEGREE))
    learner.design.known.play, learner.design.known.play_accuracy = 9.0 * DEGREE, 1.0 / (0.5 * DEGREE)
    still(learner)
    of_model = learner.scale[WIDTH_TERM] ** 2 + learner.scale[WINDUP_TERM] ** 2
    expected = 1.0 / (1.0 / of_model + 1.0 / (0.5 * DEGREE) ** 2)
    assert learner.h.variances.of[lib.OC_OF_WIDTH] == pytest.approx(expected, rel=0.02)
    for _ in range(60):
        learner.solve()
        lib.oc_hypothesis_relinearise(learner.h, learner.design)
    found = 2.0 * (learner.h.play.half_width + learner.h.play.windup)
    assert found == pytest.approx(9.0 * DEGREE, abs=0.1 * DEGREE)


def test_a_configured_play_does_not_change_the_evidence() -> None:
    """It is added for the factoring only: else it would count anew at each solution."""
    drive_of_both = driven(3, Play(), 60)
    learner, other = Learner(Play()), Learner(Play())
    for each in (learner, other):
        for k in range(len(drive_of_both.angle)):
            each.sample(drive_of_both, k)
            if k % SAMPLES == SAMPLES - 1:
                lib.oc_hypothesis_predict(each.h, each.design, each.second, SAMPLES)
                lib.oc_hypothesis_take_in(each.h, each.design, each.second, SAMPLES)
    learner.design.known.play, learner.design.known.play_accuracy = 9.0 * DEGREE, 1.0 / (0.5 * DEGREE)
    learner.solve()
    assert list(learner.h.scatter) == list(other.h.scatter)
    assert list(learner.h.target_products) == list(other.h.target_products)


def test_configured_gradient_and_wheelbase_replace_missing_bends(tmp_path: Path) -> None:
    signals, _ = drive(tmp_path, "motorway", 1, 60.0, "backlash_deg = 1.0")
    known = {"known_wheelbase_share_1": 0.02, "known_wheelbase_share_sd_1": 0.002}
    gradient = {"understeer_gradient_deg_m_s2": 0.6, "understeer_gradient_sd_deg_m_s2": 0.02}
    core = core_of(truck(**gradient), 100.0, params=known)
    core.run({name: signals.table[name].to_numpy() for name in _core.COLUMNS if name in signals.table.columns})
    answer = core.answer()
    assert answer["understeer_gradient"]["value"] == pytest.approx(0.6 * DEGREE, abs=0.05 * DEGREE)
    assert answer["equivalent_wheelbase"]["value"] == pytest.approx(1.02 * 3.7, abs=0.01 * 3.7)
    assert answer["equivalent_wheelbase"]["standard_deviation"] < 0.003 * 3.7


def test_a_configured_yaw_rate_bias_is_corrected_from_the_first_tick() -> None:
    tick = {"time_s": 0.0, "yaw_rate_rad_s": 0.0, "vehicle_speed_m_s": 20.0, "steering_wheel_angle_rad": 0.0}
    known = truck(yaw_rate_bias_deg_s=0.3, yaw_rate_bias_sd_deg_s=0.05)
    now = core_of(known, 100.0).step({**tick, "lateral_acceleration_m_s2": 0.0})
    assert now["yaw_rate_bias"] == pytest.approx(0.3 * DEGREE)
    assert now["yaw_rate_bias_sd"] == pytest.approx(0.05 * DEGREE)


def test_a_configured_accelerometer_bias_sets_the_neutral_lateral_acceleration(tmp_path: Path) -> None:
    """Without play it is not observable: the interval is i K times its uncertainty."""
    signals, truth = drive(tmp_path, "biased_accelerometer", 2, 900.0, "backlash_deg = 0.5")
    bias = truth.lateral_acceleration_bias_m_s2
    play = {"play_deg": 0.5, "play_sd_deg": 0.3}
    without = oc.offset(signals, truck(**play))
    known = oc.offset(signals, truck(**play, accelerometer_bias_m_s2=bias, accelerometer_bias_sd_m_s2=0.02))
    assert half_width(known) < 0.75 * half_width(without)
    assert holds(known, offset_to_find(truth))
    of_truck = truck_now(known.rows, (), priors_of(known.params))
    assert of_truck.accelerometer_bias == pytest.approx(bias, abs=0.03)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"play_deg": 8.0}, "'play_deg' needs its standard deviation, 'play_sd_deg'"),
        ({"pull_sd_m_s2": 0.1}, "'pull_sd_m_s2' is the standard deviation of 'pull_m_s2', which is missing"),
        ({"play_deg": 8.0, "play_sd_deg": 0.0}, "'play_sd_deg'"),
        ({"play_deg": 8.0, "play_sd_deg": math.nan}, "'play_sd_deg'"),
        ({"play_deg": 10**400, "play_sd_deg": 1.0}, "'play_deg'"),
        ({"play_deg": "8", "play_sd_deg": 1.0}, "'play_deg'"),
        ({"pull_m_s2": 1.0, "pull_sd_m_s2": 0.1}, "'pull_m_s2'"),
        ({"offset_applied_deg": 1e4}, "'offset_applied_deg'"),
    ],
)
def test_an_impossible_configured_value_is_refused_by_name(values: dict[str, float], said: str) -> None:
    with pytest.raises(oc.OncenterError, match=r"vehicle file truck\.toml") as refused:
        truck(**values)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_gradient_alone_is_for_the_error_budget_and_no_prior() -> None:
    assert truck(understeer_gradient_deg_m_s2=0.4).params == {}


def test_a_param_overrides_the_configured_value_of_the_same_file() -> None:
    values = {"play_deg": 8.0, "play_sd_deg": 0.5, "params": {"known_play_deg": 3.0}}
    assert vehicle_from({**TRUCK, **values}, "t.toml").params["known_play_rad"] == pytest.approx(3.0 * DEGREE)
