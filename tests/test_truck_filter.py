"""The filter over a truck's drives equals a literal derivation where one is short: products of normal densities, Bayes'
rule over one change, and the distribution of a mixture."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from truck_rows import DAY_S, MONDAY_S, drive_row

from oncenter import _core
from oncenter.signals import DEGREE
from oncenter.truck.events import Event
from oncenter.truck.evidence import Numbers
from oncenter.truck.loads import loads_of
from oncenter.truck.now import priors_of_filter, table_of
from oncenter.truck.priors import Priors, priors_of
from oncenter.truck.row import Row

# One kind of truck, a fixed zero, no change, no wrong drive.
PLAIN = replace(
    priors_of(),
    changes_per_day=(0.0,) * 6,
    zero_probabilities=(1.0, 0.0, 0.0),
    load_steer_weights=(1.0, 0.0),
    wide_pull_probability=0.0,
    wrong_valid=0.0,
)
ROWS = [
    drive_row(0.0, 2.0, neutral=0.1, bank=0.25, standing=0.15, with_play_deg2=0.01, gradient=0.35 * DEGREE),
    drive_row(3.0, 2.4, neutral=0.16, bank=0.28, with_neutral_deg_m_s2=0.001, gradient=0.5 * DEGREE),
]
BIAS, PULL, CROWN = 2, 3, 4


def filtered(rows: list[Row], priors: Priors, events: tuple[Event, ...] = ()) -> Any:
    table = table_of(rows, priors, events, loads_of(rows, priors))
    of_truck = np.array([priors_of_filter(priors, rows)], _core.TRUCK_PRIORS)
    return _core.truck_histories(table, [len(rows)], of_truck)[0]


def literal(rows: list[Row], priors: Priors, renewed: bool = False) -> tuple[Numbers, Numbers, float]:
    """Mean and covariance of the state after all drives, and the log likelihood, from the joint normal density of all
    states and readings; `renewed`: the last drive has another offset, about 0."""
    table = table_of(rows, priors, (), loads_of(rows, priors))
    one = priors_of_filter(priors, rows)
    start = one["variance"].copy()
    start[5:] = one["variant_steer"][0]
    n, k = len(rows), 7
    elapsed, ignitions = np.cumsum(table["days"]), np.cumsum(np.minimum(table["days"], 1.0))
    states = np.zeros((n * k, n * k))
    for i in range(n):
        for j in range(n):
            first = min(i, j)
            variance = start + ignitions[first] * one["at_ignition"] + elapsed[first] * one["per_day"]
            states[i * k : i * k + k, j * k : j * k + k] = np.diag(variance)
    mean = np.tile(one["mean"], n)
    if renewed:
        last = (n - 1) * k
        states[last, :] = states[:, last] = 0.0
        states[last, last] = one["new_variance"]
        mean[last] = 0.0
    views, noises, values, level = [], [], [], 0.0
    for i, (row, drive) in enumerate(zip(rows, table, strict=True)):
        information = np.zeros((3, 3))
        information[np.tril_indices(3)] = row.modes[0, 1:7]
        information = information + np.tril(information, -1).T
        own = np.linalg.inv(information)
        center, vector = own @ row.modes[0, 7:], row.modes[0, 7:]
        level += row.modes[0, 0] + 0.5 * center @ vector + 0.5 * np.linalg.slogdet(own * 2.0 * math.pi)[1]
        view = np.zeros((3, n * k))
        at = i * k
        view[0, [at, at + PULL, at + CROWN, at + 5, at + 6]] = (
            1.0,
            drive["per_pull"],
            drive["per_crown"],
            drive["load"],
            drive["load_bent"],
        )
        view[1, at + 1] = view[2, at + BIAS] = view[2, at + PULL] = 1.0
        views.append(view)
        noises.append(own + np.diag(drive["noise"]))
        values.append(center)
        for bank in (drive["driving"], drive["standing"]):
            if bank["variance"] > 0.0:
                of_bank = np.zeros((1, n * k))
                of_bank[0, [at + BIAS, at + CROWN]] = 1.0, bank["per_crown"]
                views.append(of_bank)
                noises.append(np.array([[bank["variance"]]]))
                values.append(np.array([bank["value"]]))
    view, value = np.vstack(views), np.concatenate(values)
    noise = np.zeros((len(value), len(value)))
    begin = 0
    for each in noises:
        noise[begin : begin + len(each), begin : begin + len(each)] = each
        begin += len(each)
    error, spread = value - view @ mean, view @ states @ view.T + noise
    likelihood = -0.5 * (
        error @ np.linalg.solve(spread, error) + np.linalg.slogdet(spread)[1] + len(error) * math.log(2.0 * math.pi)
    )
    gain = np.linalg.solve(spread, view @ states).T
    of_last = slice((n - 1) * k, n * k)
    covariance = states - gain @ view @ states
    return (mean + gain @ error)[of_last], covariance[of_last, of_last], float(likelihood + level)


@pytest.mark.parametrize("rows", [ROWS[:1], ROWS, [*ROWS, drive_row(3.5, 1.9, neutral=0.12, play_deg=5.5)]])
def test_without_changes_the_filter_is_the_joint_normal_density(rows: list[Row]) -> None:
    found = filtered(rows, PLAIN)
    mean, covariance, likelihood = literal(rows, PLAIN)
    assert found["count"] == 1
    history = found["history"][0]
    assert history["mean"] == pytest.approx(mean, rel=1e-6, abs=1e-9)
    assert history["covariance"].reshape(7, 7) == pytest.approx(covariance, rel=1e-5, abs=1e-12)
    assert found["log_likelihood"] == pytest.approx(likelihood, abs=1e-6)


@pytest.mark.parametrize("moved_deg", [0.0, 0.6, 1.5, 4.0])
def test_one_possible_change_has_the_weight_by_bayes_rule(moved_deg: float) -> None:
    """Both histories have their own likelihoods; the rate of changes is their prior."""
    rows = [ROWS[0], drive_row(3.0, 2.0 + moved_deg, neutral=0.16, bank=0.28, gradient=0.5 * DEGREE)]
    priors = replace(PLAIN, changes_per_day=(0.0, 0.2, 0.0, 0.0, 0.0, 0.0))
    prior = 1.0 - math.exp(-0.2 * (3.0 - rows[0].length_s / DAY_S))
    same, changed = (literal(rows, priors, renewed=renewed)[2] for renewed in (False, True))
    expected = prior * math.exp(changed - same) / (1.0 - prior + prior * math.exp(changed - same))
    found = filtered(rows, priors)
    histories = found["history"][: found["count"]]
    weights = np.exp(histories["log_weight"])
    assert weights.sum() == pytest.approx(1.0)
    assert weights[histories["offset_since"] == 1].sum() == pytest.approx(expected, rel=1e-4, abs=1e-5)
    assert found["log_likelihood"] == pytest.approx(
        same + math.log(1.0 - prior + prior * math.exp(changed - same)), abs=1e-4
    )


def test_a_drive_of_two_modes_is_a_mixture_with_weights_by_bayes_rule() -> None:
    first, second = drive_row(1.0, 1.0), drive_row(1.0, 3.0)
    both = replace(first, modes=np.vstack([first.modes, second.modes]))
    likelihoods = [literal([ROWS[0], one], PLAIN)[2] for one in (first, second)]
    found = filtered([ROWS[0], both], PLAIN)
    weights = np.exp(found["history"]["log_weight"][: found["count"]])
    expected = 1.0 / (1.0 + np.exp(min(likelihoods) - max(likelihoods)))
    assert weights.max() == pytest.approx(expected, rel=1e-6)
    assert found["log_likelihood"] == pytest.approx(np.logaddexp(likelihoods[0], likelihoods[1]), abs=1e-6)


def test_a_wrong_drive_of_little_probability_widens_nothing() -> None:
    """A history without the first drive's evidence is as wide as the prior: joined, it would widen the other."""
    exact, with_doubt = filtered(ROWS, PLAIN), filtered(ROWS, replace(PLAIN, wrong_valid=0.002))
    assert with_doubt["history"][0]["covariance"] == pytest.approx(exact["history"][0]["covariance"], rel=0.02)
    assert with_doubt["log_likelihood"] == pytest.approx(exact["log_likelihood"], abs=0.02)


def test_a_stated_size_moves_the_offset_by_it() -> None:
    """And widens it by the size's error; what was learned before counts on."""
    rows = [drive_row(0.0, 2.0), drive_row(2.0, -1.5, sds=(5.0, 0.3, 0.02))]
    found = filtered(rows, PLAIN, (Event(MONDAY_S + DAY_S, "calibrated", -3.5 * DEGREE),))
    history = found["history"][0]
    assert history["mean"][0] == pytest.approx(-1.5 * DEGREE, abs=0.1 * DEGREE)
    assert math.sqrt(history["covariance"][0]) < 0.6 * DEGREE


def test_a_quantile_of_a_mixture_is_that_of_its_draws() -> None:
    random = np.random.default_rng(1)
    for count in (1, 3, 20):
        weights = random.dirichlet(np.ones(count))
        means, sds = random.normal(0.0, 3.0, count), random.uniform(0.1, 2.0, count)
        chosen = random.choice(count, 400_000, p=weights)
        draws = random.normal(means[chosen], sds[chosen])
        for share in (0.025, 0.3, 0.5, 0.975):
            value = _core.quantile(weights, means, sds, share)
            assert np.mean(draws < value) == pytest.approx(share, abs=0.004)
