"""Many drives of a truck: they separate pull from accelerometer bias where loads differ, and find what changed."""

from __future__ import annotations

import math
from dataclasses import astuple, fields, replace

import numpy as np
import pytest

from oncenter.signals import DEGREE
from oncenter.truck.drives import Summaries, Summary, together
from oncenter.truck.model import Trucks, learn
from oncenter.truck.priors import Priors, priors_of

RATIO, CROWN_M_S2 = 20.0, 0.2
GRADIENTS = (0.3 * DEGREE, 0.42 * DEGREE, 0.56 * DEGREE)  # rad/(m/s^2), of three loads
LITTLE = replace(priors_of(), load_steer_sds_rad=(0.003 * DEGREE, 0.003 * DEGREE))


def truck(
    random: np.random.Generator,
    *,
    drives: int = 8,
    gradients: tuple[float, ...] = GRADIENTS,
    offset: float = 2.0 * DEGREE,
    pull: float = 0.0,
    bias: float = 0.0,
    play: float = 6.0 * DEGREE,
    sd: float = 0.1 * DEGREE,
    stands: bool = True,
) -> list[Summary]:
    """Summaries of a truck, by the model's equations written out, not by its code: i K p in the offset, b + p in the
    neutral acceleration, bank and standing ground by b and the roads' crown. Without compliance."""
    found = []
    for k in range(drives):
        gradient = gradients[k % len(gradients)]
        crown = random.normal(CROWN_M_S2, 0.1)
        found.append(
            Summary(
                offset=offset + RATIO * gradient * pull + random.normal(0.0, math.hypot(sd, 0.1 * DEGREE)),
                offset_sd=sd,
                gradient=gradient + random.normal(0.0, 0.01 * DEGREE),
                gradient_sd=0.01 * DEGREE,
                unloading=bias + pull + random.normal(0.0, math.hypot(0.01, 0.02)),
                unloading_sd=0.01,
                play=play + random.normal(0.0, math.hypot(0.2, 0.3) * DEGREE),
                play_sd=0.2 * DEGREE,
                with_unloading=0.0,
                with_play=0.0,
                bank=bias + crown,
                standing=bias + 0.5 * CROWN_M_S2 + random.normal(0.0, 0.2) if stands else math.nan,
                ratio=RATIO,
                side=1.0,
            )
        )
    return found


def learned(trucks: list[list[Summary]], priors: Priors = LITTLE) -> Trucks:
    return learn(together(trucks), replace(priors, compliance_share_1=0.0))


def test_loads_separate_a_pull_from_the_accelerometers_bias() -> None:
    """The same pull and bias once at three loads, once at the middle one: no road here says where level is."""
    random = np.random.default_rng(1)
    lost = replace(LITTLE, crown_sd_m_s2=1.4, standing_slope_sd_m_s2=1.0, pull_sd_m_s2=0.2)
    three = [truck(random, pull=0.15, bias=-0.1) for _ in range(100)]
    one = [truck(random, pull=0.15, bias=-0.1, gradients=GRADIENTS[1:2]) for _ in range(100)]
    by_three, by_one = learned(three, lost), learned(one, lost)
    assert abs(np.mean(by_three.pull) - 0.15) < 0.02 and abs(np.mean(by_three.accelerometer_bias) + 0.1) < 0.02
    assert np.median(np.abs(by_three.less_pull - 2.0 * DEGREE)) < 0.25 * DEGREE
    assert np.median(by_three.less_pull_sd) < 0.4 * np.median(by_one.less_pull_sd)
    assert not by_three.load_would_help.any() and by_one.load_would_help.mean() > 0.9


def test_a_trucks_interval_contains_its_offset_at_the_stated_rate() -> None:
    random = np.random.default_rng(2)
    given = [
        truck(random, pull=random.normal(0.0, 0.05), bias=random.normal(0.0, 0.1), stands=k % 2 == 0)
        for k in range(600)
    ]
    answer = learned(given)
    z = (answer.offset - 2.0 * DEGREE) / answer.offset_sd
    assert 0.92 <= np.mean(np.abs(z) < 1.96) <= 0.99
    assert 0.7 <= np.std(z) <= 1.15


def test_a_step_of_a_degree_is_found_within_three_drives_and_none_where_none_is() -> None:
    random = np.random.default_rng(3)
    steady = [truck(random, drives=20, pull=random.normal(0.0, 0.05)) for _ in range(300)]
    assert learned(steady).steps == ()
    at = random.integers(4, 17, len(steady))
    moved = [
        [replace(d, offset=d.offset + 1.0 * DEGREE * (k >= at[n])) for k, d in enumerate(drives)]
        for n, drives in enumerate(steady)
    ]
    steps = learned(moved).steps
    in_time = {step.truck for step in steps if abs(step.at - at[step.truck]) <= 1 and step.found <= at[step.truck] + 2}
    assert len(in_time) >= 0.95 * len(steady) and len(steps) <= 1.02 * len(steady)
    assert np.median([step.size for step in steps]) == pytest.approx(1.0 * DEGREE, abs=0.05 * DEGREE)


def test_a_single_wrong_drive_makes_no_step() -> None:
    random = np.random.default_rng(4)
    for place in range(8):
        drives = truck(random)
        drives[place] = replace(drives[place], offset=drives[place].offset + 8.0 * DEGREE)
        answer = learned([drives])
        assert answer.steps == (), place
        assert abs(answer.offset[0] - 2.0 * DEGREE) < 1.0 * DEGREE, place


def test_a_drive_with_a_wrong_play_has_less_weight_for_the_offset() -> None:
    drives = truck(np.random.default_rng(5), drives=12)
    wrong = [*drives[:-1], replace(drives[-1], play=14.0 * DEGREE, offset=drives[-1].offset - 4.0 * DEGREE)]
    without, answer = learned([drives[:-1]]), learned([wrong])
    assert abs(answer.offset[0] - without.offset[0]) < 0.05 * DEGREE


def test_a_drive_on_one_flank_gets_the_play_from_the_others() -> None:
    """It measures the sum of offset and half the play; alone it identifies neither."""
    random = np.random.default_rng(6)
    drives = truck(random, drives=4, sd=0.6 * DEGREE)
    missed = 3.0 * DEGREE  # of the play's width
    blind = replace(
        drives[0],
        offset=2.0 * DEGREE - 0.5 * missed,
        offset_sd=1.55 * DEGREE,
        play=6.0 * DEGREE + missed,
        play_sd=3.0 * DEGREE,
        with_play=-0.5 * (3.0 * DEGREE) ** 2,
    )
    known, with_blind = learned([drives]), learned([[*drives, blind]])
    assert with_blind.offset_sd[0] < known.offset_sd[0]
    assert abs(with_blind.offset[0] - known.offset[0]) < 0.4 * DEGREE


def test_the_result_of_a_truck_does_not_depend_on_other_trucks() -> None:
    random = np.random.default_rng(7)
    trucks = [truck(random, drives=int(random.integers(1, 60)), pull=random.normal(0.0, 0.05)) for _ in range(40)]
    all_together = learned(trucks)
    for n in range(0, 40, 4):
        alone = learned([trucks[n]])
        for name in ("offset", "offset_sd", "spread_sd", "pull", "accelerometer_bias", "play"):
            assert getattr(alone, name)[0] == getattr(all_together, name)[n]


def test_ride_height_that_steers_with_the_load_is_in_the_interval() -> None:
    random = np.random.default_rng(8)
    given = []
    for _ in range(300):
        by_load = RATIO * 0.03 * DEGREE * random.normal(size=3)
        by_load -= by_load.mean()
        drives = truck(random, drives=9, pull=random.normal(0.0, 0.05), bias=random.normal(0.0, 0.1))
        given.append([replace(d, offset=d.offset + by_load[k % 3]) for k, d in enumerate(drives)])
    answer = learn(together(given), replace(priors_of(), compliance_share_1=0.0))
    assert np.mean(np.abs(answer.offset - 2.0 * DEGREE) < 1.96 * answer.offset_sd) >= 0.88


def test_one_drive_alone_keeps_its_uncertainty_and_has_no_nan() -> None:
    (drive,) = truck(np.random.default_rng(9), drives=1)
    answer = learned([[drive]])
    assert answer.offset_sd[0] >= drive.offset_sd
    assert abs(answer.offset[0] - drive.offset) < 1.96 * answer.offset_sd[0]
    for field in fields(answer):
        if field.name not in ("steps", "zero"):
            assert np.isfinite(getattr(answer, field.name)).all(), field.name


def test_trucks_with_different_numbers_of_drives_are_padded_at_the_end() -> None:
    random = np.random.default_rng(10)
    table = together([truck(random, drives=2), truck(random, drives=5)])
    assert isinstance(table, Summaries)
    assert all(array.shape == (2, 5) for array in astuple(table))
    assert np.isnan(table.offset[0, 2:]).all() and np.isfinite(table.offset[1]).all()


def test_a_wheel_alignment_moves_the_pull_with_the_offset() -> None:
    random = np.random.default_rng(11)
    error, blind = [], []
    for _ in range(30):
        before = truck(random, drives=10, bias=0.1)
        after = truck(random, drives=10, bias=0.1, pull=0.15, offset=5.0 * DEGREE)
        answer = learned([before + after])
        (step,) = answer.steps
        assert abs(step.at - 10) <= 1
        error.append(answer.pull[0] - 0.15)
        blind.append(answer.less_pull[0] - 5.0 * DEGREE)
    assert abs(np.mean(error)) < 0.04
    assert np.median(np.abs(blind)) < 0.35 * DEGREE
