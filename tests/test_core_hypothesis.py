"""One hypothesis of how the steering plays: its slopes against operators of its own, its recursion against NumPy's
least squares over the whole drive, and what it must keep when sensor, load or gyro turn out to be others.

The truck here is made of random numbers, not simulated: steering wheel angle, lateral acceleration and curvature go
their ways, and the residual is what the operators below, an offset, a gradient and a wind make of them.
"""

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from oncenter._native import ffi, lib

Array = npt.NDArray[np.float64]

DEGREE = math.pi / 180.0
RATIO, RATIO_TIMES_WHEELBASE = 19.3, 19.3 * 3.7
STEP_S, SAMPLES = 0.1, 10
OFFSET, GRADIENT = 2.0 * DEGREE, 0.4 * DEGREE
PULL_SD = 0.05

# The model's terms, in the core's order.
SOURCE = (Path(__file__).parents[1] / "core" / "hypothesis.c").read_text(encoding="utf-8")
TERMS = re.search(r"/\* The terms, in this order\. \*/\nenum \{ (.+?) \};", SOURCE, re.S)[1]
TERMS = re.split(r",\s+", TERMS.lower())
GRADIENT_TERM, BIAS_TERM, WIDTH_TERM, UNLOADING_TERM, FRICTION_TERM, CREEP_TERM = (
    TERMS.index(name) for name in ("gradient", "yaw_rate_bias", "width", "unloading", "friction", "creep")
)
WINDUP_TERM, UNWINDING_TERM, WIND_TERMS = (
    TERMS.index("windup"),
    TERMS.index("unwinding"),
    [TERMS.index("wind"), TERMS.index("wind_across")],
)
WHEELBASE_TERM = TERMS.index("wheelbase")
WITHIN_PLAY = [UNLOADING_TERM, FRICTION_TERM, CREEP_TERM]
# What trucks are like, docs/method.md.
GRADIENT_MEAN, WIDTH_MEAN, FRICTION_MEAN, CREEP_MEAN = 0.4 * DEGREE, 4.0 * DEGREE, 0.1, 100.0 * DEGREE
WINDUP_MEAN = 1.0 * DEGREE


@dataclass(frozen=True)
class Play:
    half_width: float = 3.0 * DEGREE  # rad
    unloading: float = 0.1  # m/s^2
    friction: float = 0.05  # m/s^2; negative: the wheels stay where they rub
    creep: float = 100.0 * DEGREE  # rad/s per m/s^2
    windup: float = 0.3 * DEGREE  # rad, half
    unwinding: float = 0.0  # 1/s
    wind: tuple[float, float] = (0.0, 0.0)  # m/s^2

    def inner(self, angle: Array, lateral_acceleration: Array, blows: Array, centre: float = 0.0) -> Array:
        """Wind-up and play once more, written from the page. `blows` (n, 2) is the share of each wind."""
        wound = now = float(angle[0])
        course = np.empty_like(angle)
        carried = blows @ np.array(self.wind)
        for k, (outer, a) in enumerate(zip(angle, lateral_acceleration - carried, strict=True)):
            wound -= self.unwinding * (wound - centre) * STEP_S
            wound = min(max(wound, outer - self.windup), outer + self.windup)
            load = a - self.unloading
            if self.friction >= 0.0:
                now -= math.copysign(self.creep * max(abs(load) - self.friction, 0.0) * STEP_S, load)
            now = min(max(now, wound - self.half_width), wound + self.half_width)
            course[k] = now
        return course


@dataclass(frozen=True)
class Drive:
    """Samples each 0.1 s."""

    angle: Array
    residual: Array
    lateral_acceleration: Array
    yaw_acceleration: Array
    jerk: Array
    curvature: Array
    per_speed: Array
    wind: Array

    def mirrored(self) -> "Drive":
        """As seen in a mirror: what is to the left is to the right; the winds are where they were."""
        same = ("per_speed", "wind")
        return Drive(**{name: column if name in same else -column for name, column in vars(self).items()})


def knots(rng: np.random.Generator, t: Array, every_s: float) -> Array:
    at = np.arange(0.0, t[-1] + 2 * every_s, every_s)
    return np.interp(t, at, rng.standard_normal(len(at)))


def driven(
    seed: int,
    play: Play,
    duration_s: int = 600,
    *,
    noise: float = 0.05 * DEGREE,
    yaw_rate_bias: float = 0.0,
    speed_swing: float = 5.0,
) -> Drive:
    """Bends to both sides on a crowned road. `yaw_rate_bias` in rad/s is what the residual was not corrected by."""
    rng = np.random.default_rng(seed)
    t = np.arange(duration_s * SAMPLES) * STEP_S
    v = 18.0 + speed_swing * np.sin(t / 40.0 + seed)
    curvature = 0.0015 * knots(rng, t, 7.0)
    a = v * v * curvature + 0.2
    hands = 0.8 * play.half_width * knots(rng, t, 1.7)
    angle = OFFSET + RATIO_TIMES_WHEELBASE * curvature + hands + 1.5 * play.half_width * knots(rng, t, 6.0)
    heading = np.cumsum(v * curvature) * STEP_S + t / 100.0
    blows = v[:, None] / 20.0 * np.column_stack([np.cos(heading), np.sin(heading)])
    borne = a - play.unloading - blows @ np.array(play.wind)
    residual = OFFSET + RATIO * GRADIENT * borne + angle - play.inner(angle, a, blows, OFFSET)
    residual += noise * rng.standard_normal(len(t)) - RATIO_TIMES_WHEELBASE * yaw_rate_bias / v
    yaw_acceleration, jerk = np.gradient(v * curvature, STEP_S), np.gradient(a, STEP_S)
    return Drive(angle, residual, a, yaw_acceleration, jerk, curvature, 1.0 / v, blows)


@dataclass
class Learner:
    """A hypothesis of the core with what it needs, and the rows that it learned from."""

    play: Play
    unloading_mean: float = 0.0
    unloading_sd: float = 0.15
    yaw_rate_bias_sd: float = 0.02 * DEGREE
    memory_share: float | None = None  # None: short at first, as the bank has it

    def __post_init__(self) -> None:
        self.h = ffi.new("oc_hypothesis *")
        self.design = ffi.new("oc_hypothesis_design *")
        lib.oc_hypothesis_setup(self.design, STEP_S, RATIO, RATIO_TIMES_WHEELBASE, PULL_SD)
        self.prior = ffi.new("oc_prior *", (self.unloading_mean, self.unloading_sd, self.yaw_rate_bias_sd))
        self.second = ffi.new(
            "oc_second *", {"second_s": 1.0, "memory_share": 1.0, "reference": DEGREE**2, "learns": 1}
        )
        self.scale = np.array([self.design.scale[k] for k in range(len(TERMS))])
        self.started = False

    def sample(self, drive: Drive, k: int) -> None:
        if not self.started:
            lib.oc_hypothesis_start(self.h, ffi.new("oc_play *", vars(self.play)), drive.angle[0])
            self.started = True
        row = {name: column[k].tolist() for name, column in vars(drive).items()}
        native = ffi.new("oc_motion_sample *", row)
        native.usable = 1
        lib.oc_hypothesis_sample(self.h, self.design, native, k % SAMPLES == 0)

    def whole_second(self) -> None:
        h, second = self.h, self.second
        ends = round(second.used_s) + 1
        second.block_ends = ends % lib.OC_SECONDS_PER_BLOCK == 0
        second.long_block_ends = ends % lib.OC_SECONDS_PER_LONG_BLOCK == 0
        shortening = 1.0 - 1.0 / (60.0 + 0.5 * second.used_s)
        second.memory_share = shortening if self.memory_share is None else self.memory_share
        lib.oc_hypothesis_foretell(h, self.design, second, SAMPLES)
        if second.learns:
            self.solve(learns=True)
        second.used_s += 1.0
        second.blocks += second.block_ends
        second.long_blocks += second.long_block_ends

    def solve(self, *, learns: bool) -> None:
        solving = ffi.new("oc_solving *", {"learns": learns, "due": 1})
        while not lib.oc_hypothesis_learn(self.h, self.design, self.prior, self.second, SAMPLES, solving):
            pass

    def learn(self, drive: Drive) -> "Learner":
        for k in range(len(drive.angle)):
            self.sample(drive, k)
            if k % SAMPLES == SAMPLES - 1:
                self.whole_second()
        return self

    @property
    def now(self) -> Play:
        told = {name: getattr(self.h.play, name) for name in vars(self.play)}
        return Play(**{**told, "wind": tuple(told["wind"])})

    @property
    def total(self) -> dict[str, float]:
        """What is believed of the play, terms that are still to be followed included."""
        t, now = [self.h.terms[k] * self.scale[k] for k in range(len(TERMS))], self.now
        return {"width": 2 * now.half_width + t[WIDTH_TERM], "unloading": now.unloading + t[UNLOADING_TERM]}

    @property
    def offset_sd(self) -> float:
        return math.sqrt(self.h.offset_variance)


# The model


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
def test_a_slope_foretells_what_a_little_more_of_its_parameter_does(term: int, change: dict[str, float]) -> None:
    """Two operators of the test's own, a little apart, against the core's slope times that little."""
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
            slope.append(learner.h.sums[term] / SAMPLES)
    # the core's are of full widths, and of creep as a share of itself; no gradient is known yet that a wind works on
    by = max(by) if isinstance(by, tuple) else by
    by *= {WIDTH_TERM: 2.0, WINDUP_TERM: 2.0, CREEP_TERM: 1.0 / hypothesis.creep}.get(term, 1.0)
    foretold = by * np.array(slope)
    assert np.std(apart) > 1e-5
    # a wind's is a_0's by the share that acts now, though the play still holds what blew before
    assert np.corrcoef(foretold, apart)[0, 1] > (0.95 if term in WIND_TERMS else 0.97)
    assert np.abs(foretold).sum() == pytest.approx(np.abs(apart).sum(), rel=0.05)


def test_where_side_force_moves_nothing_only_the_width_has_a_slope() -> None:
    rubbing = Play(friction=-1.0)
    drive = driven(1, rubbing, 20)
    learner = Learner(rubbing)
    for k in range(len(drive.angle)):
        learner.sample(drive, k)
        assert all(learner.h.sums[term] == 0.0 for term in (*WITHIN_PLAY, WINDUP_TERM, UNWINDING_TERM))
    assert learner.h.sums[WIDTH_TERM] != 0.0


@pytest.mark.parametrize("friction", [0.05, -1.0], ids=["creeping", "rubbing"])
def test_it_goes_to_the_play_that_made_the_drive(friction: float) -> None:
    truth = Play(half_width=4.0 * DEGREE, unloading=0.15 if friction >= 0.0 else 0.0, friction=friction)
    for seed in range(2, 6):
        start = Play(half_width=3.0 * DEGREE, unloading=0.1, friction=friction)
        learner = Learner(start).learn(driven(seed, truth, 900))
        assert learner.h.offset == pytest.approx(OFFSET, abs=0.1 * DEGREE)
        assert learner.h.gradient == pytest.approx(GRADIENT, abs=0.02 * DEGREE)
        assert 2 * learner.now.half_width == pytest.approx(8.0 * DEGREE, abs=0.2 * DEGREE)
        if friction >= 0.0:
            assert learner.now.unloading == pytest.approx(0.15, abs=0.01)
            assert learner.now.friction == pytest.approx(0.05, abs=0.01)


def test_it_tells_wind_up_from_play_and_a_wind_from_the_unloading_point() -> None:
    """4 deg of wind-up before 6 deg of play, and a wind of 0.08 m/s^2: each by its own signature."""
    truth = Play(windup=2.0 * DEGREE, unloading=0.1, wind=(0.06, -0.05))
    for seed in range(2, 5):
        learner = Learner(Play(unloading=0.05)).learn(driven(seed, truth, 900))
        assert learner.h.offset == pytest.approx(OFFSET, abs=0.15 * DEGREE)
        assert 2 * learner.now.windup == pytest.approx(4.0 * DEGREE, abs=0.5 * DEGREE)
        assert 2 * learner.now.half_width == pytest.approx(6.0 * DEGREE, abs=0.5 * DEGREE)
        assert learner.now.unloading == pytest.approx(0.1, abs=0.015)
        assert learner.now.wind == pytest.approx(truth.wind, abs=0.015)


def test_it_tells_how_fast_a_motor_unwinds_the_column() -> None:
    truth = Play(windup=2.0 * DEGREE, unwinding=0.8)
    learner = Learner(Play(windup=1.5 * DEGREE)).learn(driven(3, truth, 900))
    assert learner.now.unwinding == pytest.approx(0.8, abs=0.15)
    assert learner.h.offset == pytest.approx(OFFSET, abs=0.15 * DEGREE)


# The recursion


def test_the_page_tells_the_priors_that_the_core_has() -> None:
    page = (Path(__file__).parents[1] / "docs" / "method.md").read_text(encoding="utf-8")
    rows = {name: (mean, sd) for name, mean, sd in re.findall(r"^\| (\w+) \| (\S+) \| (\S+) \| [^|]+ \|$", page, re.M)}
    scale = dict(zip(TERMS, Learner(Play()).scale, strict=True))
    plain = ("unloading", "friction", "creep", "wheelbase", "unwinding", "wind", "wind_across")
    unit = dict.fromkeys(TERMS, DEGREE) | dict.fromkeys(plain, 1.0)
    for name in set(TERMS) - {"unloading", "yaw_rate_bias"}:  # whose priors come from elsewhere
        assert float(rows[name][1]) * unit[name] == pytest.approx(scale[name], rel=1e-5), name
    asked = {"gradient": GRADIENT_MEAN / DEGREE, "width": WIDTH_MEAN / DEGREE, "friction": FRICTION_MEAN}
    asked |= {"creep": CREEP_MEAN / DEGREE, "windup": WINDUP_MEAN / DEGREE, "unwinding": 0.0}
    assert {name: float(rows[name][0]) for name in asked} == pytest.approx(asked)


def prior_of(play: Play, learner: Learner) -> tuple[Array, Array]:
    """The terms that the priors ask for, and how surely: their information. In units of `scale`."""
    information = np.ones(len(TERMS))
    information[UNLOADING_TERM] = (learner.scale[UNLOADING_TERM] / learner.unloading_sd) ** 2
    information[BIAS_TERM] = (learner.scale[BIAS_TERM] / learner.yaw_rate_bias_sd) ** 2
    asked = np.zeros(len(TERMS))
    asked[GRADIENT_TERM] = GRADIENT_MEAN
    asked[WIDTH_TERM] = WIDTH_MEAN - 2 * play.half_width
    asked[UNLOADING_TERM] = learner.unloading_mean - play.unloading
    asked[WIND_TERMS] = [-wind for wind in play.wind]
    if play.friction >= 0.0:
        share = CREEP_MEAN / play.creep
        asked[FRICTION_TERM] = FRICTION_MEAN - play.friction
        asked[CREEP_TERM] = share - 1.0 if share > 1.0 else 1.0 - 1.0 / share
        asked[WINDUP_TERM] = WINDUP_MEAN - 2 * play.windup
        asked[UNWINDING_TERM] = -play.unwinding
    return asked / learner.scale, information


class Batch:
    """All seconds kept, each as a row about where the play now is; NumPy does the rest."""

    def __init__(self) -> None:
        self.terms: list[Array] = []
        self.targets: list[float] = []
        self.weights: list[float] = []

    def add(self, terms: Array, target: float, weight: float, memory_share: float) -> None:
        self.weights = [memory_share * w for w in self.weights] + [weight]
        self.terms.append(terms)
        self.targets.append(target)

    def move(self, before: Play, after: Play, scale: Array) -> None:
        """About another play the same drive leaves another target; in a narrower one less happens."""
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

    def solve(self, noise: float, asked: Array, information: Array) -> tuple[Array, Array]:
        """Constant and terms, and their covariance."""
        w = np.sqrt(np.array(self.weights) / noise)
        rows = np.column_stack([np.ones(len(self.terms)), np.array(self.terms)]) * w[:, None]
        believed = np.column_stack([np.zeros(len(asked)), np.diag(np.sqrt(information))])
        A = np.vstack([rows, believed])
        b = np.concatenate([np.array(self.targets) * w, np.sqrt(information) * asked])
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
        terms, target = np.array(list(h.sums)) * list(learner.design.of_sum) / SAMPLES, h.target_sum / SAMPLES
        usual, before = h.variance, learner.now
        learner.whole_second()
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
    assert h.gradient_variance == pytest.approx(variances[GRADIENT_TERM] * of_gradient**2, rel=0.02)
    # the width that is told is play and wind-up together
    both = np.zeros(len(found))
    both[1 + WIDTH_TERM], both[1 + WINDUP_TERM] = of_width, learner.scale[WINDUP_TERM]
    assert h.width_variance == pytest.approx(both @ C @ both, rel=0.02)
    assert h.unloading_variance == pytest.approx(unloading_variance, rel=0.02)
    # d offset: the constant, the gradient at a_0, a_0 at the gradient; pull and wind on top, up to the bias's prior
    slope = np.zeros(len(found))
    slope[[0, 1 + GRADIENT_TERM, 1 + UNLOADING_TERM]] = (
        1.0,
        RATIO * a_0 * of_gradient,
        RATIO * gradient * of_unloading,
    )
    of_pull = max(min(unloading_variance + PULL_SD**2, learner.unloading_sd**2) - unloading_variance, 0.0)
    offset_variance = slope @ C @ slope + (RATIO * gradient) ** 2 * of_pull
    assert h.offset_variance == pytest.approx(offset_variance, rel=0.02)
    assert h.offset == pytest.approx(offset, abs=0.05 * math.sqrt(offset_variance))


def test_left_and_right_are_mirrored_to_the_last_bit() -> None:
    truth = Play(unloading=0.15)
    drive = driven(6, truth, 120)
    there = Learner(Play(unloading=0.05), 0.1).learn(drive)
    back = Learner(Play(unloading=-0.05), -0.1).learn(drive.mirrored())
    for name in ("offset", "unloading", "target_mean"):
        assert getattr(back.h, name) == -getattr(there.h, name) != 0.0
    for name in ("gradient", "offset_variance", "width_variance", "cost"):
        assert getattr(back.h, name) == getattr(there.h, name)


def test_the_variance_knows_when_seconds_resemble_their_neighbours() -> None:
    """The same scatter of a second, once anew each second and once slowly: only the blocks tell them apart."""
    rng = np.random.default_rng(1)
    noises = {}
    for name, wander in (("anew", rng.standard_normal(600)), ("slow", knots(rng, np.arange(600.0), 15.0) * 1.2)):
        drive = driven(8, Play(), 600)
        drive.residual[:] += 0.2 * DEGREE * np.repeat(wander, SAMPLES)
        noises[name] = lib.oc_hypothesis_noise(Learner(Play(), 0.1).learn(drive).h)
    assert noises["slow"] > 2.0 * noises["anew"]


def test_a_kerb_counts_by_its_sign_only() -> None:
    """Ten seconds that are 30 deg off among 400 move a mean by 0.75 deg; here by a fraction of that."""
    drive = driven(9, Play(), 400)
    undisturbed = Learner(Play(), 0.1).learn(drive).h.offset
    for second in range(45, 400, 36):
        drive.residual[second * SAMPLES : (second + 1) * SAMPLES] += 30.0 * DEGREE
    assert Learner(Play(), 0.1).learn(drive).h.offset == pytest.approx(undisturbed, abs=0.15 * DEGREE)


def test_where_the_play_shows_nothing_the_priors_decide() -> None:
    """Without a sample of motion the width's spread is its prior's, and the offset may be anywhere."""
    learner = Learner(Play())
    still = driven(0, Play(), 1)
    for column in (still.angle, still.residual, still.lateral_acceleration, still.yaw_acceleration, still.jerk):
        column[:] = 0.0
    still.curvature[:] = 0.0
    learner.learn(still)
    of_both = math.hypot(learner.scale[WIDTH_TERM], learner.scale[WINDUP_TERM])
    assert math.sqrt(learner.h.width_variance) == pytest.approx(of_both, rel=0.01)
    assert math.sqrt(learner.h.gradient_variance) == pytest.approx(learner.scale[GRADIENT_TERM], rel=0.01)
    assert math.sqrt(learner.h.unloading_variance) == pytest.approx(0.15, rel=0.01)


# What turns out to be otherwise


def test_a_bias_told_late_is_as_good_as_one_told_at_once() -> None:
    """The yaw rates of one drive were corrected by 0.1 deg/s too little: iL times that over v, 0.4 deg of offset."""
    bias = 0.1 * DEGREE
    left, gradients = [], []
    for seed in range(5, 13):
        wrong = Learner(Play(), 0.1).learn(driven(seed, Play(), yaw_rate_bias=bias, speed_swing=0.0))
        right = Learner(Play(), 0.1).learn(driven(seed, Play(), speed_swing=0.0))
        before = abs(wrong.h.offset - right.h.offset)
        lib.oc_hypothesis_correct(wrong.h, wrong.design, bias)
        wrong.solve(learns=False)
        assert before > 0.3 * DEGREE
        gradients.append(abs(wrong.h.gradient - right.h.gradient))
        left.append(abs(wrong.h.offset - right.h.offset) / before)
    assert np.median(left) < 0.15
    assert np.median(gradients) < 0.03 * DEGREE
    assert max(left) < 0.4  # the play went another way meanwhile


def test_a_remounted_sensor_shifts_the_offset_by_its_step_and_nothing_else() -> None:
    learner = Learner(Play(), 0.1).learn(driven(10, Play(), 300))
    before = learner.h.offset
    known = learner.total, learner.h.gradient
    lib.oc_hypothesis_remounted(learner.h, 5.0 * DEGREE, 30.0)
    assert learner.h.offset == pytest.approx(before + 5.0 * DEGREE, abs=1e-5)
    assert (learner.total, learner.h.gradient) == known
    after = driven(11, Play(), 60)
    after.angle[:] += 5.0 * DEGREE
    after.residual[:] += 5.0 * DEGREE
    learner.learn(after)
    assert learner.h.offset == pytest.approx(OFFSET + 5.0 * DEGREE, abs=0.1 * DEGREE)


def test_a_step_told_wrongly_is_soon_put_right() -> None:
    """The step was 5 deg and not 4.5: so few seconds told it that a minute of driving says more."""
    learner = Learner(Play(), 0.1).learn(driven(10, Play(), 300))
    lib.oc_hypothesis_remounted(learner.h, 4.5 * DEGREE, 30.0)
    after = driven(11, Play(), 120)
    after.angle[:] += 5.0 * DEGREE
    after.residual[:] += 5.0 * DEGREE
    learner.learn(after)
    assert learner.h.offset == pytest.approx(OFFSET + 5.0 * DEGREE, abs=0.15 * DEGREE)


def test_a_new_load_keeps_offset_and_play_and_asks_the_gradient_anew() -> None:
    learner = Learner(Play(), 0.1).learn(driven(12, Play(), 400))
    offset, gradient, sd = learner.h.offset, learner.h.gradient, math.sqrt(learner.h.gradient_variance)
    width = learner.total["width"]
    lib.oc_hypothesis_loaded(learner.h)
    learner.learn(driven(13, Play(), 1))
    assert learner.h.offset == pytest.approx(offset, abs=0.05 * DEGREE)
    assert learner.h.gradient == pytest.approx(gradient, abs=0.02 * DEGREE)
    assert learner.total["width"] == pytest.approx(width, abs=0.1 * DEGREE)
    assert math.sqrt(learner.h.gradient_variance) > 5.0 * sd


def information_of(h: Any) -> tuple[Array, Array]:
    """Of the constant and all terms: the evidence as one matrix and vector, whose quotient is what it says of them."""
    scatter = np.zeros((len(TERMS), len(TERMS)))
    scatter[np.tril_indices(len(TERMS))] = list(h.scatter)
    scatter += np.tril(scatter, -1).T
    means = np.array([1.0, *h.means])
    matrix = h.weight * np.outer(means, means)
    matrix[1:, 1:] += scatter
    vector = h.weight * h.target_mean * means
    vector[1:] += list(h.toward)
    noise = lib.oc_hypothesis_noise(h)
    return matrix / noise, vector / noise


def test_a_new_load_adds_to_the_covariance_of_what_was_seen_and_moves_no_mean() -> None:
    """A Kalman filter's step of time: in single precision, by another derivation."""
    learner = Learner(Play(), 0.1).learn(driven(12, Play(), 400))
    before, told = information_of(learner.h)
    lib.oc_hypothesis_loaded(learner.h)
    after, then = information_of(learner.h)
    wandered = np.zeros(len(before))
    wandered[1 + GRADIENT_TERM], wandered[1 + WHEELBASE_TERM] = 0.04, 1.0
    expected = np.linalg.inv(np.linalg.inv(before) + np.diag(wandered))
    scale = np.sqrt(np.diag(before))
    np.testing.assert_allclose(after / np.outer(scale, scale), expected / np.outer(scale, scale), atol=2e-3)
    mean = expected @ np.linalg.solve(before, told)
    np.testing.assert_allclose(then / scale, mean / scale, atol=2e-3 * np.abs(told / scale).max())


def test_what_was_learned_survives_an_ignition() -> None:
    """The operators begin anew where the wheel now is; the belief does not move."""
    learner = Learner(Play(), 0.1).learn(driven(14, Play(), 200))
    offset, cost = learner.h.offset, learner.h.cost
    lib.oc_hypothesis_restart(learner.h, 1.0)
    assert (learner.h.offset, learner.h.cost) == (offset, cost)
    places = learner.h.places
    assert places.inner == places.more[0] == places.less[3] == places.wound_less[1] == 1.0


def test_a_second_in_doubt_is_foretold_and_not_learned_from() -> None:
    learner = Learner(Play(), 0.1).learn(driven(15, Play(), 100))
    offset = learner.h.offset
    learner.second.learns = 0
    otherwise = driven(16, Play(), 5)
    otherwise.residual[:] += 3.0 * DEGREE
    learner.learn(otherwise)
    assert learner.h.offset == offset
    assert learner.h.error == pytest.approx(3.0 * DEGREE, abs=0.5 * DEGREE)
