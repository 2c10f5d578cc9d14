"""The offset by halved and doubled priors, and the verdicts that depend on one."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest

import oncenter
from oncenter.estimates.by_priors import ByPrior, OffsetBy, scaled
from oncenter.offset.answer import Answer
from oncenter.signals import DEGREE, Signals
from oncenter.vehicle import Vehicle
from oncenter.verdict import verdicts_of

ON_THE_RIGHT = oncenter.vehicle("scania_r730_4x2").model_copy(update={"traffic_side": "right"})


@cache
def drive() -> Signals:
    return oncenter.simulate("town", seed=3)[0]


@cache
def answer() -> Answer:
    return oncenter.offset(drive(), ON_THE_RIGHT)


def by(name: str) -> ByPrior:
    return next(each for each in answer().by_priors if each.prior == name)


def now(found: Answer) -> OffsetBy:
    assert found.offset_now is not None
    return found.offset_now


def ends(by: OffsetBy) -> list[float]:
    """deg."""
    return [end / DEGREE for end in (*by.ci95_drive, *by.ci95)]


@pytest.mark.parametrize("name", ["pull", "mean_wind", "axle_set_up"])
def test_another_prior_moves_the_interval_as_a_run_of_the_whole_drive_does(name: str) -> None:
    found = by(name)
    for factor, moves in ((0.5, found.halved), (2.0, found.doubled)):
        params = {found.param: scaled(answer().params, found.param, factor)[found.param]}
        rerun = oncenter.offset(drive(), ON_THE_RIGHT, params=params)
        assert ends(now(answer()) + moves) == pytest.approx(ends(now(rerun)), abs=0.02)


def test_a_larger_pull_widens_the_whole_interval_only() -> None:
    own_low, own_high, low, high = ends(by("pull").doubled)
    assert low < -0.1 and high > 0.1
    assert (own_low, own_high) == pytest.approx((0.0, 0.0), abs=0.01)


def test_a_zero_that_may_be_farther_off_widens_the_drives_part_of_the_interval() -> None:
    tight = oncenter.offset(drive(), ON_THE_RIGHT, params={"accelerometer_bias_sd_m_s2": 0.03})
    found = next(each for each in tight.by_priors if each.prior == "accelerometer_zero")
    assert ends(found.halved)[1] < 0.0 and ends(found.doubled)[1] > 0.015


def test_a_given_pull_is_the_prior_that_is_varied_and_holds_the_set_up() -> None:
    given = ON_THE_RIGHT.model_dump(exclude_unset=True) | {"pull_m_s2": 0.05, "pull_sd_m_s2": 0.02}
    found = oncenter.offset(drive(), Vehicle(**given)).by_priors
    assert [(each.prior, each.param) for each in found[:1]] == [("pull", "known_pull_sd_m_s2")]
    assert "axle_set_up" not in [each.prior for each in found]


def test_the_answer_of_several_logs_depends_on_the_priors_of_its_truck() -> None:
    again = oncenter.simulate("town", seed=4)[0]
    found = {each.prior: each for each in oncenter.offset([drive(), again], ON_THE_RIGHT).by_priors}
    assert ends(found["pull"].doubled)[3] > ends(found["pull"].halved)[3] + 0.1


NO_MOVE = OffsetBy(0.0, (0.0, 0.0), (0.0, 0.0))


def within(limit_deg: float, *by_priors: ByPrior) -> Answer:
    vehicle = answer().vehicle.model_copy(update={"offset_limit_deg": limit_deg})
    return replace(answer(), vehicle=vehicle, by_priors=by_priors)


def test_a_prior_of_pull_on_which_the_verdict_depends_is_in_its_second_line_only() -> None:
    limit = ends(now(answer()))[3] + 0.3
    found = ByPrior("pull", "pull_sd_m_s2", 0.05, NO_MOVE, NO_MOVE)
    assert "prior" not in verdicts_of(within(limit, found))[0].words()
    wider = replace(NO_MOVE, ci95=(0.0, 0.5 * DEGREE))
    verdict = verdicts_of(within(limit, replace(found, doubled=wider)))[0]
    assert verdict.state == "within" and "depends on the prior of pull" in verdict.note


def test_a_prior_inside_the_drives_part_makes_the_verdict_undecided() -> None:
    limit = ends(now(answer()))[1] + 0.3
    found = ByPrior("accelerometer_zero", "accelerometer_bias_sd_m_s2", 0.5, NO_MOVE, NO_MOVE)
    assert verdicts_of(within(limit, found))[0].state == "within"
    wider = replace(NO_MOVE, ci95_drive=(0.0, 0.5 * DEGREE), ci95=(0.0, 0.5 * DEGREE))
    verdict = verdicts_of(within(limit, replace(found, doubled=wider)))[0]
    assert verdict.state == "undecided" and "by another prior" in verdict.headline
    assert "the prior of the accelerometer's zero" in verdict.note
