"""The recursion of one hypothesis against NumPy's least squares over the whole drive."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from one_hypothesis import (
    BIAS_TERM,
    CREEP_MEAN,
    CREEP_TERM,
    FRICTION_MEAN,
    FRICTION_TERM,
    GRADIENT_MEAN,
    GRADIENT_TERM,
    PULL_SD,
    RATIO,
    SAMPLES,
    TERMS,
    UNLOADING_TERM,
    UNWINDING_TERM,
    WHEELBASE_TERM,
    WIDTH_TERM,
    WIND_TERMS,
    WINDUP_MEAN,
    WINDUP_TERM,
    WITHIN_PLAY,
    Array,
    Learner,
    Play,
    driven,
)
from scipy import stats

from oncenter._native import lib
from oncenter.signals import DEGREE
from oncenter.tuned import TUNED


def prior_of(play: Play, learner: Learner) -> tuple[Array, Array]:
    """Means and information of the priors, in units of `scale`.

    The width's mean is the start's play."""
    information = np.ones(len(TERMS))
    information[UNLOADING_TERM] = (learner.scale[UNLOADING_TERM] / learner.unloading_sd) ** 2
    information[BIAS_TERM] = (learner.scale[BIAS_TERM] / learner.yaw_rate_bias_sd) ** 2
    means = np.zeros(len(TERMS))
    means[GRADIENT_TERM] = GRADIENT_MEAN
    means[WIDTH_TERM] = 2 * (learner.play.half_width - play.half_width)
    means[UNLOADING_TERM] = learner.unloading_mean - play.unloading
    means[WIND_TERMS] = [-wind for wind in play.wind]
    if play.friction >= 0.0:
        share = CREEP_MEAN / play.creep
        means[FRICTION_TERM] = FRICTION_MEAN - play.friction
        means[CREEP_TERM] = share - 1.0 if share > 1.0 else 1.0 - 1.0 / share
        means[WINDUP_TERM] = WINDUP_MEAN - 2 * play.windup
        means[UNWINDING_TERM] = -play.unwinding
    return means / learner.scale, information


class Batch:
    """Keeps all seconds as rows about the present play, for NumPy's least squares."""

    def __init__(self) -> None:
        self.terms: list[Array] = []
        self.targets: list[float] = []
        self.weights: list[float] = []

    def add(self, terms: Array, target: float, weight: float, memory_share: float) -> None:
        self.weights = [memory_share * w for w in self.weights] + [weight]
        self.terms.append(terms)
        self.targets.append(target)

    def move(self, before: Play, after: Play, scale: Array) -> None:
        """Shifts the targets to another play; a narrower play has smaller slopes."""
        Z, y = np.array(self.terms), np.array(self.targets)
        y -= Z[:, WIDTH_TERM] * 2 * (after.half_width - before.half_width) / scale[WIDTH_TERM]
        Z[:, WITHIN_PLAY] *= min(after.half_width / before.half_width, 1.0)
        moved = [after.unloading - before.unloading, after.friction - before.friction, after.creep / before.creep - 1.0]
        y -= Z[:, WITHIN_PLAY] @ (moved / scale[WITHIN_PLAY])
        y -= Z[:, WINDUP_TERM] * 2 * (after.windup - before.windup) / scale[WINDUP_TERM]
        Z[:, UNWINDING_TERM] *= min(after.windup / before.windup, 1.0)
        y -= Z[:, UNWINDING_TERM] * (after.unwinding - before.unwinding) / scale[UNWINDING_TERM]
        y -= Z[:, WIND_TERMS] @ (np.subtract(after.wind, before.wind) / scale[WIND_TERMS])
        self.terms, self.targets = list(Z), list(y)

    def solve(self, noise: float, means: Array, information: Array) -> tuple[Array, Array]:
        """Constant and terms, and their covariance."""
        w = np.sqrt(np.array(self.weights) / noise)
        rows = np.column_stack([np.ones(len(self.terms)), np.array(self.terms)]) * w[:, None]
        believed = np.column_stack([np.zeros(len(means)), np.diag(np.sqrt(information))])
        A = np.vstack([rows, believed])
        b = np.concatenate([np.array(self.targets) * w, np.sqrt(information) * means])
        return np.linalg.lstsq(A, b, rcond=None)[0], np.linalg.inv(A.T @ A)


@pytest.mark.parametrize("friction", [0.05, -1.0], ids=["creeping", "rubbing"])
@pytest.mark.parametrize("memory_share", [1.0, 0.99], ids=["all", "forgetting"])
def test_the_recursion_is_least_squares_over_the_whole_drive(friction: float, memory_share: float) -> None:
    """Rows and weights are the core's, all that becomes of them is NumPy's, in double and from plain products.

    The core adds some hundreds of seconds in single precision and relinearises after each, which costs it a few
    hundredths of a standard deviation.
    """
    learner = Learner(Play(friction=friction), 0.05, memory_share=memory_share)
    truth = Play(half_width=3.5 * DEGREE, friction=friction, unloading=0.2 if friction >= 0 else 0.0)
    drive = driven(5, truth, 400)
    batch, h = Batch(), learner.h
    for k in range(len(drive.angle)):
        learner.sample(drive, k)
        if k % SAMPLES < SAMPLES - 1:
            continue
        usual, before = h.variance, learner.now
        learner.whole_second()
        terms, target = np.array(list(h.sums)) * list(learner.design.of_sum) / SAMPLES, h.target_sum / SAMPLES
        weight = min(1.0, 2.0 * math.sqrt(usual) / abs(h.error))
        batch.add(terms, target, weight, memory_share)
        if k < len(drive.angle) - 1:
            batch.move(before, learner.now, learner.scale)
    found, C = batch.solve(lib.oc_hypothesis_noise(h), *prior_of(before, learner))
    constant, terms = found[0], found[1:]
    of_gradient, of_unloading, of_width = (learner.scale[k] for k in (GRADIENT_TERM, UNLOADING_TERM, WIDTH_TERM))
    gradient, a_0 = terms[GRADIENT_TERM] * of_gradient, before.unloading + terms[UNLOADING_TERM] * of_unloading
    offset = constant + RATIO * gradient * a_0
    sd = np.sqrt(np.diag(C))
    assert h.constant == pytest.approx(constant, abs=0.05 * sd[0])
    assert h.gradient == pytest.approx(gradient, abs=0.05 * sd[1 + GRADIENT_TERM] * of_gradient)
    assert h.unloading == pytest.approx(a_0, abs=0.05 * sd[1 + UNLOADING_TERM] * of_unloading)
    variances = np.diag(C)[1:]
    unloading_variance = variances[UNLOADING_TERM] * of_unloading**2
    assert h.variances.of[lib.OC_OF_GRADIENT] == pytest.approx(variances[GRADIENT_TERM] * of_gradient**2, rel=0.02)
    # the published width is play plus wind-up
    both = np.zeros(len(found))
    both[1 + WIDTH_TERM], both[1 + WINDUP_TERM] = of_width, learner.scale[WINDUP_TERM]
    assert h.variances.of[lib.OC_OF_WIDTH] == pytest.approx(both @ C @ both, rel=0.02)
    assert h.variances.of[lib.OC_OF_UNLOADING] == pytest.approx(unloading_variance, rel=0.02)
    # d offset: the constant, the gradient at a_0, a_0 at the gradient
    slope = np.zeros(len(found))
    slope[[0, 1 + GRADIENT_TERM, 1 + UNLOADING_TERM]] = (
        1.0,
        RATIO * a_0 * of_gradient,
        RATIO * gradient * of_unloading,
    )
    of_bias, variance_of_bias = bias_by_prior_and_unloading(learner, unloading_variance)
    of_pull = variance_of_bias - unloading_variance
    offset_variance = slope @ C @ slope
    assert h.variances.of[lib.OC_OF_OFFSET] == pytest.approx(offset_variance, rel=0.02)
    # in addition the part of the bias that pull and wind leave open
    assert h.pull_variance == pytest.approx((RATIO * gradient) ** 2 * of_pull, rel=0.02)
    assert h.lean == pytest.approx(RATIO * gradient * (of_bias - h.unloading), rel=0.02)
    assert h.offset == pytest.approx(offset, abs=0.05 * math.sqrt(offset_variance + h.pull_variance))
    of_offset = slope @ C
    for of_what, covariance in (
        (lib.OC_OF_GRADIENT, of_offset[1 + GRADIENT_TERM] * of_gradient),
        (lib.OC_OF_UNLOADING, of_offset[1 + UNLOADING_TERM] * of_unloading),
        (lib.OC_OF_WIDTH, of_offset @ both),
    ):
        size = math.sqrt(offset_variance * h.variances.of[of_what])
        assert h.offset_covariance[of_what] == pytest.approx(covariance, abs=0.02 * size)


def bias_by_prior_and_unloading(learner: Learner, variance: float) -> tuple[float, float]:
    """Mean and variance of the accelerometer's bias. The drive identifies only bias plus pull; each has a prior. The
    drive's information is the solution's less the prior's."""
    prior, mean = 1.0 / learner.unloading_sd**2, learner.unloading_mean
    shown = 1.0 / variance - prior
    information = np.diag([prior, 1.0 / PULL_SD**2]) + shown
    of_drive = learner.h.unloading / variance - prior * mean
    of_bias, _ = np.linalg.solve(information, [prior * mean + of_drive, of_drive])
    return float(of_bias), float(np.linalg.inv(information)[0, 0])


def total_variance(h: Any) -> float:
    """Variance of the offset: the drive's part, pull and wind, an axle set up for the crown."""
    return float(h.variances.of[lib.OC_OF_OFFSET] + h.pull_variance + h.set_up_variance)


@pytest.mark.parametrize("unloading_sd", [0.09, 0.1, 0.15])
def test_the_interval_includes_an_axle_set_up_for_the_crown(unloading_sd: float) -> None:
    """Coverage of one hypothesis's interval over three causes, each by its prior and by its likelihood of the neutral
    acceleration: none, a set-up for 0.2 m/s^2, an accelerometer zero error of twice the crown."""
    truth, crown = Play(half_width=3.5 * DEGREE, unloading=0.1), 0.2
    learner = Learner(truth, 0.1, unloading_sd=unloading_sd, crown=crown).learn(driven(5, truth, 400))
    h, held = learner.h, []
    for mean in np.linspace(0.2, -0.4, 25):  # prior mean of that zero
        learner.prior.unloading_mean = mean
        learner.solve()
        apart = h.unloading - mean
        variance = unloading_sd**2 + PULL_SD**2 + h.variances.of[lib.OC_OF_UNLOADING]
        shift = crown * np.arange(3.0)
        weights = np.array([0.9, 0.05, 0.05]) * stats.norm.pdf(apart, shift, math.sqrt(variance))
        pull = shift * [0, 1, 0] + (apart - shift) * PULL_SD**2 / variance  # attributed to bias
        of_drive = h.variances.of[lib.OC_OF_OFFSET]
        left = (RATIO * h.gradient) ** 2 * PULL_SD**2 * (1.0 - PULL_SD**2 / variance)
        may_be = stats.norm(-RATIO * h.gradient * pull, math.sqrt(of_drive + left))
        half_width = 1.96 * math.sqrt(total_variance(h))
        within = may_be.cdf(h.lean + half_width) - may_be.cdf(h.lean - half_width)
        held.append(weights @ within / np.sum(weights))
    assert min(held) > 0.90
    assert max(held) < 0.98
    assert np.mean(held) > 0.93


@pytest.mark.parametrize("apart", [0.0, 0.1, 0.3])
def test_pull_and_wind_have_a_tail_that_grows_with_the_distance_from_the_prior(apart: float) -> None:
    """A mixture of two normals: the answer is that of one normal with the mixture's variance, by Bayes."""
    learner = Learner(Play(half_width=3.5 * DEGREE, unloading=0.1), 0.1, unloading_sd=0.1)
    h = learner.learn(driven(5, learner.play, 400)).h
    learner.design.known.pull_tail, wider = 0.1, TUNED["hypothesis_equations.wide_pull"]
    learner.prior.unloading_mean = h.unloading - apart
    learner.solve()
    mixed = (h.lean, h.pull_variance)
    spread = 0.1**2 + h.variances.of[lib.OC_OF_UNLOADING]
    away = h.unloading - learner.prior.unloading_mean
    likely = [
        share * stats.norm.pdf(away, 0.0, math.sqrt(spread + (size * PULL_SD) ** 2))
        for share, size in ((0.9, 1.0), (0.1, wider))
    ]
    wide = likely[1] / sum(likely)
    assert wide > (0.2 if apart == 0.3 else 0.05)
    learner.design.known.pull_tail, learner.design.pull_sd = 0.0, PULL_SD * math.sqrt(1.0 + wide * (wider**2 - 1.0))
    learner.solve()
    assert mixed == pytest.approx((h.lean, h.pull_variance), rel=0.03, abs=1e-9)


def test_of_an_unknown_side_the_interval_reaches_both_offsets_of_an_axle_set_up_for_the_crown() -> None:
    """By Bayes over roads that fall to the right, a set-up axle, and roads that fall to the left. The mean bank less
    the neutral acceleration decides, so an accelerometer's zero error changes nothing."""
    crown, sd = 0.2, 0.1
    learner = Learner(Play(half_width=3.5 * DEGREE, unloading=0.1), 0.1, unloading_sd=0.3, crown=crown)
    h = learner.learn(driven(5, learner.play, 400)).h
    effect = RATIO * h.gradient * crown
    for fell in np.linspace(-0.5, 0.5, 21):  # of the roads, by the mean bank less the neutral acceleration
        learner.prior.bank, learner.prior.bank_sd = h.unloading + fell, sd
        learner.solve()
        spread = math.sqrt(sd**2 + PULL_SD**2 + h.variances.of[lib.OC_OF_UNLOADING])
        likely = np.array([0.475, 0.05, 0.475]) * stats.norm.pdf(fell, [crown, 0.0, -crown], spread)
        probability = likely[1] / likely.sum()
        reach = 1.96 * math.sqrt(h.set_up_variance) / effect
        assert (reach > 0.98) == (probability > 0.075), fell
        assert (reach == 0.0) == (probability < 0.025), fell
        assert reach < 1.1


def test_the_crown_that_superelevation_removes_shows_an_axle_set_up_for_it() -> None:
    """By Bayes over crown and set-up to either side: bends remove a share of the crown, which is the mean bank less the
    neutral acceleration, and more or less than that by the set-up."""
    crown, sd, removed_sd = 0.2, 0.1, TUNED["joint_method.removed_sd"]
    share = TUNED["hypothesis_equations.removed_share"]
    learner = Learner(Play(half_width=3.5 * DEGREE, unloading=0.1), 0.1, unloading_sd=0.3, crown=crown)
    h = learner.learn(driven(5, learner.play, 400)).h
    prior, effect = learner.prior, RATIO * h.gradient * crown
    prior.bank_sd, prior.removed_information = sd, 1.0 / removed_sd**2
    spread = math.sqrt(sd**2 + PULL_SD**2 + h.variances.of[lib.OC_OF_UNLOADING])
    for fell, removed in itertools.product(np.linspace(-0.3, 0.3, 13), np.linspace(-0.2, 0.2, 9)):
        prior.bank, prior.removed = h.unloading + fell, removed
        learner.solve()
        likely = np.array([0.475, 0.025, 0.025, 0.475]) * stats.norm.pdf(fell, [crown, 0.0, 0.0, -crown], spread)
        likely *= stats.norm.pdf(removed, share * (fell + np.array([0.0, crown, -crown, 0.0])), removed_sd)
        probability = (likely[1] + likely[2]) / likely.sum()
        reach = 1.96 * math.sqrt(h.set_up_variance) / effect
        assert reach > 0.98 or probability < 0.15, (fell, removed)  # the core's exp(-x) is larger than that by x^2/64
        assert reach == 0.0 or probability > 0.02, (fell, removed)


def test_an_unlikely_axle_set_up_does_not_widen_the_interval() -> None:
    """The neutral acceleration is slightly on the other side of the accelerometer's zero."""
    learner = Learner(Play(half_width=3.5 * DEGREE, unloading=0.1), 0.1, unloading_sd=0.1, crown=0.2)
    h = learner.learn(driven(5, learner.play, 400)).h
    learner.prior.unloading_mean = 0.15
    intervals = []
    for crown in (0.2, 0.0, -0.2):
        learner.prior.crown = crown
        learner.solve()
        intervals.append((h.lean, total_variance(h)))
    assert intervals[0] == intervals[1]
    assert intervals[2][1] > intervals[1][1]  # likely on roads that fall to the other side


def information_of(h: Any) -> tuple[Array, Array]:
    """Information matrix and vector of the constant and all terms."""
    scatter = np.zeros((len(TERMS), len(TERMS)))
    scatter[np.tril_indices(len(TERMS))] = list(h.scatter)
    scatter += np.tril(scatter, -1).T
    means = np.array([1.0, *h.means])
    matrix = h.weight * np.outer(means, means)
    matrix[1:, 1:] += scatter
    vector = h.weight * h.target_mean * means
    vector[1:] += list(h.target_products)
    noise = lib.oc_hypothesis_noise(h)
    return matrix / noise, vector / noise


def unloading_sd_of(learner: Learner) -> float:
    return math.sqrt(learner.h.variances.of[lib.OC_OF_UNLOADING])


def test_a_load_change_adds_covariance_and_changes_no_mean() -> None:
    """The prediction step of a Kalman filter, in single precision, by another derivation."""
    learner = Learner(Play(), 0.1).learn(driven(12, Play(), 400))
    before, vector = information_of(learner.h)
    lib.oc_hypothesis_change_load(learner.h)
    added = np.zeros(len(before))
    added[1 + GRADIENT_TERM], added[1 + WHEELBASE_TERM] = 0.04, 1.0
    assert_prediction_step(learner, before, vector, np.diag(added))


def test_a_random_walk_of_the_zero_adds_covariance_to_itself_and_the_constant() -> None:
    """The prediction step of a Kalman filter: a_0 changes at random, and the constant by -i K of that. The offset does
    not change."""
    learner = Learner(Play(), 0.1).learn(driven(12, Play(), 400))
    before, vector = information_of(learner.h)
    offset, offset_sd, unloading_sd = learner.h.offset, learner.offset_sd, unloading_sd_of(learner)
    learner.design.wander = 0.03**2
    learner.h.wanders = 1
    learner.h.huber_weight = 0.0  # the second adds no evidence
    learner.second.memory_share, learner.second.block_ends, learner.second.long_block_ends = 1.0, 0, 0
    lib.oc_hypothesis_take_in(learner.h, learner.design, learner.second, SAMPLES)
    along = np.zeros(len(before))
    along[1 + UNLOADING_TERM] = 0.03 / learner.scale[UNLOADING_TERM]
    along[0] = -RATIO * learner.h.gradient * 0.03
    assert_prediction_step(learner, before, vector, np.outer(along, along))
    learner.solve()
    assert learner.h.offset == pytest.approx(offset, abs=0.05 * offset_sd)
    assert unloading_sd_of(learner) > 2.0 * unloading_sd


def assert_prediction_step(learner: Learner, before: Array, vector: Array, added: Array) -> None:
    """Compares the evidence with `before` plus `added` in its covariance, and the same means."""
    after, then = information_of(learner.h)
    expected = np.linalg.inv(np.linalg.inv(before) + added)
    scale = np.sqrt(np.diag(before))
    np.testing.assert_allclose(after / np.outer(scale, scale), expected / np.outer(scale, scale), atol=2e-3)
    mean = expected @ np.linalg.solve(before, vector)
    np.testing.assert_allclose(then / scale, mean / scale, atol=2e-3 * np.abs(vector / scale).max())
