"""One hypothesis: slopes against operators of this test, evidence after changes of sensor, load and bias."""

import math

import numpy as np
import pytest
from one_hypothesis import (
    CREEP_TERM,
    FIFTH_WHEEL_ANGLE,
    FIFTH_WHEEL_TERM,
    FRICTION_TERM,
    GRADIENT,
    GRADIENT_TERM,
    OFFSET,
    ROWS,
    SAMPLES,
    UNEVEN_TERM,
    UNLOADING_TERM,
    UNWINDING_TERM,
    WIDTH_TERM,
    WIND_TERMS,
    WINDUP_TERM,
    WITHIN_PLAY,
    Drive,
    Learner,
    Play,
    driven,
    in_si,
    knots,
    planted,
)

from oncenter._native import ffi, lib
from oncenter.signals import DEGREE


def moved(
    value: float | tuple[float, float], sign: float, by: float | tuple[float, float]
) -> float | tuple[float, ...]:
    if isinstance(value, tuple) and isinstance(by, tuple):
        return tuple(v + sign * b for v, b in zip(value, by, strict=True))
    return value + sign * by


@pytest.mark.parametrize(
    ("term", "change"),
    [
        (WIDTH_TERM, {"half_width": 0.15 * DEGREE}),
        (UNLOADING_TERM, {"unloading": 0.03}),
        (FRICTION_TERM, {"friction": 0.03}),
        (CREEP_TERM, {"creep": 3.0 * DEGREE}),
        (WINDUP_TERM, {"windup": 0.1 * DEGREE}),
        (UNWINDING_TERM, {"unwinding": 0.2}),
        (WIND_TERMS[0], {"wind": (0.03, 0.0)}),
        (WIND_TERMS[1], {"wind": (0.0, 0.03)}),
    ],
    ids=["width", "unloading", "friction", "creep", "windup", "unwinding", "wind", "wind_across"],
)
def test_a_slope_predicts_the_effect_of_a_small_change_of_its_parameter(term: int, change: dict[str, float]) -> None:
    """The difference of two operators of this test, against the core's slope times the change."""
    hypothesis = Play(creep=30.0 * DEGREE, windup=1.5 * DEGREE, unwinding=0.4)
    (name, by), drive = *change.items(), driven(4, Play(creep=30.0 * DEGREE, windup=1.5 * DEGREE), 300)
    more, less = (
        Play(**{**vars(hypothesis), name: moved(getattr(hypothesis, name), sign, by)}).inner(
            drive.angle, drive.lateral_acceleration, drive.wind
        )
        for sign in (1.0, -1.0)
    )
    apart = 0.5 * (less - more).reshape(-1, SAMPLES).mean(axis=1)
    learner = Learner(hypothesis)
    slope = []
    for k in range(len(drive.angle)):
        learner.sample(drive, k)
        if k % SAMPLES == SAMPLES - 1:
            lib.oc_hypothesis_predict(learner.h, learner.design, ffi.new("oc_second *"), SAMPLES)
            slope.append(learner.h.sums[term] / SAMPLES)
    # the core's slopes are per full width and per share of creep; the gradient is still 0: wind acts on the play only
    by = max(by) if isinstance(by, tuple) else by
    by *= {WIDTH_TERM: 2.0, WINDUP_TERM: 2.0, CREEP_TERM: 1.0 / hypothesis.creep}.get(term, 1.0)
    foretold = by * np.array(slope)
    assert np.std(apart) > 1e-5
    # a wind's slope is a_0's times its present share, although the play still holds the effect of earlier wind
    assert np.corrcoef(foretold, apart)[0, 1] > (0.95 if term in WIND_TERMS else 0.97)
    assert np.abs(foretold).sum() == pytest.approx(np.abs(apart).sum(), rel=0.05)


def test_a_rubbing_play_has_a_slope_of_the_width_only() -> None:
    rubbing = Play(friction=-1.0)
    drive = driven(1, rubbing, 20)
    learner = Learner(rubbing)
    for k in range(len(drive.angle)):
        learner.sample(drive, k)
        assert all(learner.h.sums[term] == 0.0 for term in (*WITHIN_PLAY, WINDUP_TERM, UNWINDING_TERM))
    assert learner.h.sums[WIDTH_TERM] != 0.0


@pytest.mark.parametrize("friction", [0.05, -1.0], ids=["creeping", "rubbing"])
def test_a_hypothesis_converges_to_the_play_of_the_drive(friction: float) -> None:
    truth = Play(half_width=4.0 * DEGREE, unloading=0.15 if friction >= 0.0 else 0.0, friction=friction)
    for seed in range(2, 6):
        start = Play(half_width=3.0 * DEGREE, unloading=0.1, friction=friction)
        learner = Learner(start).learn(driven(seed, truth, 900))
        # the fifth wheel's term, without a trailer, increases the error of seed 2 from 0.06 to 0.12 deg
        assert learner.h.offset == pytest.approx(OFFSET, abs=0.15 * DEGREE)
        assert learner.h.gradient == pytest.approx(GRADIENT, abs=0.02 * DEGREE)
        assert 2 * learner.now.half_width == pytest.approx(8.0 * DEGREE, abs=0.2 * DEGREE)
        if friction >= 0.0:
            assert learner.now.unloading == pytest.approx(0.15, abs=0.01)
            assert learner.now.friction == pytest.approx(0.05, abs=0.01)


def test_wind_up_and_play_and_wind_and_neutral_acceleration_are_separated() -> None:
    """4 deg of wind-up in front of 6 deg of play, and a wind of 0.08 m/s^2."""
    truth = Play(windup=2.0 * DEGREE, unloading=0.1, wind=(0.06, -0.05))
    for seed in range(2, 5):
        learner = Learner(Play(unloading=0.05)).learn(driven(seed, truth, 900))
        assert learner.h.offset == pytest.approx(OFFSET, abs=0.15 * DEGREE)
        assert 2 * learner.now.windup == pytest.approx(4.0 * DEGREE, abs=0.5 * DEGREE)
        assert 2 * learner.now.half_width == pytest.approx(6.0 * DEGREE, abs=0.5 * DEGREE)
        assert learner.now.unloading == pytest.approx(0.1, abs=0.015)
        assert learner.now.wind == pytest.approx(truth.wind, abs=0.015)


def test_the_rate_at_which_a_motor_unwinds_the_column_is_identified() -> None:
    truth = Play(windup=2.0 * DEGREE, unwinding=0.8)
    learner = Learner(Play(windup=1.5 * DEGREE)).learn(driven(3, truth, 900))
    assert learner.now.unwinding == pytest.approx(0.8, abs=0.15)
    assert learner.h.offset == pytest.approx(OFFSET, abs=0.15 * DEGREE)


OF_MOTION = [name for name, row in ROWS.items() if "sum" in row]


# The prior of the yaw rate bias is the gyro filter's; a fifth wheel's friction loads the play, too.
@pytest.mark.parametrize("name", sorted(set(OF_MOTION) - {"YAW_RATE_BIAS", "FIFTH_WHEEL"}))
def test_a_term_of_motion_is_estimated_where_it_is_planted(name: str) -> None:
    drive, size, term = driven(3, Play(), 600), in_si(ROWS[name]["prior"][1]), list(ROWS).index(name)
    without, with_it = (Learner(Play()).learn(each) for each in (drive, planted(drive, name, size)))
    found = (with_it.h.terms[term] - without.h.terms[term]) * with_it.scale[term]
    assert found == pytest.approx(size, rel=0.2), "the sum and the weight of its row in core/terms.toml"


def test_uneven_turns_and_offset_are_separated() -> None:
    """2 % of the ratio in bends of 300 m: 0.3 deg, which a mean over bends attributes to the offset."""
    for seed in range(2, 5):
        learner = Learner(Play(unloading=0.05)).learn(driven(seed, Play(), 900, uneven=0.02))
        assert learner.h.terms[UNEVEN_TERM] * learner.scale[UNEVEN_TERM] == pytest.approx(
            0.016, abs=0.005
        )  # its prior's sd is 0.007
        assert learner.h.offset == pytest.approx(OFFSET, abs=0.15 * DEGREE)


def test_a_second_of_lower_weight_has_the_effect_of_a_noisier_one() -> None:
    """A quarter of the weight corresponds to twice the noise: less evidence, the same variance."""
    whole, quarter = Learner(Play()), Learner(Play())
    quarter.second.weight = 0.25
    whole.learn(driven(3, Play(), 400, noise=3.0 * DEGREE))
    quarter.learn(driven(3, Play(), 400, noise=6.0 * DEGREE))
    assert quarter.h.weight == pytest.approx(0.25 * whole.h.weight, rel=0.05)
    assert quarter.h.variance == pytest.approx(whole.h.variance, rel=0.1)


def test_fifth_wheel_friction_and_gradient_and_play_are_separated() -> None:
    """1.35 deg of steering wheel angle to either side, and its load of 0.1 m/s^2 on the play."""
    truth = Play(unloading=0.1, fifth_wheel=0.1)
    for seed in range(2, 5):
        learner = Learner(Play(unloading=0.05)).learn(driven(seed, truth, 900))
        estimated = learner.h.terms[FIFTH_WHEEL_TERM] * learner.scale[FIFTH_WHEEL_TERM]
        assert estimated == pytest.approx(0.1 * FIFTH_WHEEL_ANGLE, abs=0.1 * DEGREE)
        assert learner.now.fifth_wheel == pytest.approx(0.1, abs=0.01)
        assert learner.h.offset == pytest.approx(OFFSET, abs=0.1 * DEGREE)
        assert learner.h.gradient == pytest.approx(GRADIENT, abs=0.02 * DEGREE)
        assert 2 * learner.now.half_width == pytest.approx(6.0 * DEGREE, abs=0.3 * DEGREE)


# The recursion


def test_a_terms_unit_is_the_sd_of_its_prior() -> None:
    sds = [in_si(row["prior"][1]) for row in ROWS.values()]
    assert list(Learner(Play()).scale) == pytest.approx(sds, rel=1e-6)


def test_left_and_right_are_mirrored_to_the_last_bit() -> None:
    truth = Play(unloading=0.15)
    drive = driven(6, truth, 120)
    there = Learner(Play(unloading=0.05), 0.1, crown=0.1).learn(drive)
    back = Learner(Play(unloading=-0.05), -0.1, crown=-0.1).learn(drive.mirrored())
    for name in ("offset", "unloading", "target_mean"):
        assert getattr(back.h, name) == -getattr(there.h, name) != 0.0
    assert (back.h.gradient, back.h.cost) == (there.h.gradient, there.h.cost)
    assert list(back.h.variances.of) == list(there.h.variances.of)
    assert back.h.lean == -there.h.lean != 0.0


def test_the_variance_includes_the_correlation_of_seconds() -> None:
    """The same scatter of seconds, once independent, once slow: only the blocks differ."""
    rng = np.random.default_rng(1)
    noises = {}
    for name, wander in (("anew", rng.standard_normal(600)), ("slow", knots(rng, np.arange(600.0), 15.0) * 1.2)):
        drive = driven(8, Play(), 600)
        drive.residual[:] += 0.2 * DEGREE * np.repeat(wander, SAMPLES)
        noises[name] = lib.oc_hypothesis_noise(Learner(Play(), 0.1).learn(drive).h)
    assert noises["slow"] > 2.0 * noises["anew"]


def test_an_outlier_has_limited_influence() -> None:
    """Ten seconds of 400 with an error of 30 deg move a mean by 0.75 deg, the estimate by a fraction of that."""
    drive = driven(9, Play(), 400)
    undisturbed = Learner(Play(), 0.1).learn(drive).h.offset
    for second in range(45, 400, 36):
        drive.residual[second * SAMPLES : (second + 1) * SAMPLES] += 30.0 * DEGREE
    assert Learner(Play(), 0.1).learn(drive).h.offset == pytest.approx(undisturbed, abs=0.15 * DEGREE)


def no_evidence() -> Drive:
    """One second without any motion."""
    still = driven(0, Play(), 1)
    for column in (still.angle, still.residual, still.lateral_acceleration, still.yaw_acceleration, still.jerk):
        column[:] = 0.0
    still.curvature[:] = still.fifth_wheel[:] = 0.0
    return still


def test_without_evidence_the_priors_decide() -> None:
    """Without samples the width has its prior's sd, and the offset an unbounded one."""
    learner = Learner(Play()).learn(no_evidence())
    of_both = math.hypot(learner.scale[WIDTH_TERM], learner.scale[WINDUP_TERM])
    sds = np.sqrt(list(learner.h.variances.of))
    assert sds[lib.OC_OF_WIDTH] == pytest.approx(of_both, rel=0.01)
    assert sds[lib.OC_OF_GRADIENT] == pytest.approx(learner.scale[GRADIENT_TERM], rel=0.01)
    assert sds[lib.OC_OF_UNLOADING] == pytest.approx(0.15, rel=0.01)


@pytest.mark.parametrize(
    ("deviations", "wider"),
    [(1.5, 1.0), (2.5, (2.5 / 1.8) ** 4), (3.9, 5.0), (5.0, 5.0), (7.0, 1.0)],
    ids=["usual", "far", "farther", "farthest", "no road"],
)
def test_the_prior_of_the_neutral_acceleration_widens_with_the_deviation_at_most_fivefold(
    deviations: float, wider: float
) -> None:
    """docs/method.md, "Regression"; beyond 0.6 m/s^2 no road explains a_0, and the prior holds in full."""
    learner = Learner(Play(unloading=0.0), unloading_mean=0.1 * deviations, unloading_sd=0.1).learn(no_evidence())
    sd = math.sqrt(learner.h.variances.of[lib.OC_OF_UNLOADING])
    assert sd == pytest.approx(0.1 * wider, rel=0.01)


@pytest.mark.parametrize("began_deg", [1.0, 3.0, 6.0])
def test_the_start_of_a_hypothesis_is_the_prior_mean_of_its_play(began_deg: float) -> None:
    """It is so even after the play has changed, while the width has no evidence."""
    learner = Learner(Play(half_width=began_deg * DEGREE)).learn(no_evidence())
    for half_width_deg in (began_deg, 4.0):
        learner.h.play.half_width = half_width_deg * DEGREE
        learner.solve()
        assert learner.total["width"] == pytest.approx(2.0 * began_deg * DEGREE, rel=1e-4)


# Corrections


@pytest.mark.long
def test_a_late_yaw_rate_bias_is_as_good_as_an_early_one() -> None:
    """One drive's yaw rates were corrected by 0.1 deg/s too little: iL/v times that is 0.4 deg of offset."""
    bias = 0.1 * DEGREE
    left, gradients = [], []
    for seed in range(5, 13):
        wrong = Learner(Play(), 0.1).learn(driven(seed, Play(), yaw_rate_bias=bias, speed_swing=0.0))
        right = Learner(Play(), 0.1).learn(driven(seed, Play(), speed_swing=0.0))
        before = abs(wrong.h.offset - right.h.offset)
        lib.oc_hypothesis_correct(wrong.h, wrong.design, bias)
        wrong.solve()
        assert before > 0.3 * DEGREE
        gradients.append(abs(wrong.h.gradient - right.h.gradient))
        left.append(abs(wrong.h.offset - right.h.offset) / before)
    assert np.median(left) < 0.15
    assert np.median(gradients) < 0.03 * DEGREE
    assert max(left) < 0.4  # the play converged along another path


def test_a_remounted_sensor_shifts_only_the_offset_by_its_step() -> None:
    learner = Learner(Play(), 0.1).learn(driven(10, Play(), 300))
    before = learner.h.offset
    others = learner.total, learner.h.gradient
    lib.oc_hypothesis_shift_offset(learner.h, 5.0 * DEGREE, 30.0)
    assert learner.h.offset == pytest.approx(before + 5.0 * DEGREE, abs=1e-5)
    assert (learner.total, learner.h.gradient) == others
    after = driven(11, Play(), 60)
    after.angle[:] += 5.0 * DEGREE
    after.residual[:] += 5.0 * DEGREE
    learner.learn(after)
    assert learner.h.offset == pytest.approx(OFFSET + 5.0 * DEGREE, abs=0.1 * DEGREE)


def test_a_wrong_step_is_soon_corrected() -> None:
    """The step was 5 deg instead of 4.5. Its weight is of so few seconds that a minute of driving corrects it."""
    learner = Learner(Play(), 0.1).learn(driven(10, Play(), 300))
    lib.oc_hypothesis_shift_offset(learner.h, 4.5 * DEGREE, 30.0)
    after = driven(11, Play(), 120)
    after.angle[:] += 5.0 * DEGREE
    after.residual[:] += 5.0 * DEGREE
    learner.learn(after)
    assert learner.h.offset == pytest.approx(OFFSET + 5.0 * DEGREE, abs=0.15 * DEGREE)


def test_a_load_change_keeps_offset_and_play_and_reopens_the_gradient() -> None:
    learner = Learner(Play(), 0.1).learn(driven(12, Play(), 400))
    offset, gradient, sd = learner.h.offset, learner.h.gradient, math.sqrt(learner.h.variances.of[lib.OC_OF_GRADIENT])
    width = learner.total["width"]
    lib.oc_hypothesis_change_load(learner.h)
    learner.learn(driven(13, Play(), 1))
    assert learner.h.offset == pytest.approx(offset, abs=0.05 * DEGREE)
    assert learner.h.gradient == pytest.approx(gradient, abs=0.02 * DEGREE)
    assert learner.total["width"] == pytest.approx(width, abs=0.1 * DEGREE)
    assert math.sqrt(learner.h.variances.of[lib.OC_OF_GRADIENT]) > 5.0 * sd


@pytest.mark.parametrize("to_deg", [2.0, 12.0])
def test_another_play_keeps_offset_and_gradient_and_all_evidence_but_that_of_its_width(to_deg: float) -> None:
    learner = Learner(Play(), 0.1).learn(driven(12, Play(), 400))
    before = learner.h.offset, learner.h.gradient, learner.h.unloading
    sds = [math.sqrt(learner.h.variances.of[k]) for k in range(lib.OC_OF_COUNT)]
    play = ffi.new("oc_play *", {"half_width": 0.5 * to_deg * DEGREE, "friction": 0.06, "creep": 1.0})
    kept = learner.h.play.creep, learner.h.play.friction
    lib.oc_hypothesis_change_play(learner.h, play)
    learner.solve()
    assert (learner.h.offset, learner.h.gradient, learner.h.unloading) == pytest.approx(before, rel=0.02)
    assert (learner.h.play.creep, learner.h.play.friction) == kept
    after = [math.sqrt(learner.h.variances.of[k]) for k in range(lib.OC_OF_COUNT)]
    for k in (lib.OC_OF_GRADIENT, lib.OC_OF_UNLOADING, lib.OC_OF_OFFSET):
        assert after[k] == pytest.approx(sds[k], rel=0.1)
    assert after[lib.OC_OF_WIDTH] > 10.0 * sds[lib.OC_OF_WIDTH]


def test_the_evidence_survives_an_ignition() -> None:
    """The operators restart at the present angle; the estimate does not change."""
    learner = Learner(Play(), 0.1).learn(driven(14, Play(), 200))
    offset, cost = learner.h.offset, learner.h.cost
    lib.oc_hypothesis_restart(learner.h, 1.0)
    assert (learner.h.offset, learner.h.cost) == (offset, cost)
    places = learner.h.places
    assert places.inner == places.played[0] == places.loaded[3] == places.unwound[1] == places.wound_varied[2] == 1.0


def test_a_suspected_second_is_predicted_but_not_learned_from() -> None:
    learner = Learner(Play(), 0.1).learn(driven(15, Play(), 100))
    offset = learner.h.offset
    learner.second.learns = 0
    otherwise = driven(16, Play(), 5)
    otherwise.residual[:] += 3.0 * DEGREE
    learner.learn(otherwise)
    assert learner.h.offset == offset
    assert learner.h.error == pytest.approx(3.0 * DEGREE, abs=0.5 * DEGREE)
