"""A hypothesis of the core, and drives for its tests.

The drives are random numbers, not simulated: steering wheel angle, lateral acceleration and curvature are independent,
and the residual follows from them by the operators below, an offset, a gradient and a wind.
"""

import math
import tomllib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from oncenter._native import ffi, lib
from oncenter.signals import DEGREE

Array = npt.NDArray[np.float64]

RATIO, RATIO_TIMES_WHEELBASE = 19.3, 19.3 * 3.7
STEP_S, SAMPLES = 0.1, 10
OFFSET, GRADIENT = 2.0 * DEGREE, 0.4 * DEGREE
PULL_SD = 0.05

# The model's terms, in the core's order.
ROWS = tomllib.loads((Path(__file__).parents[1] / "core" / "terms.toml").read_text(encoding="utf-8"))
TERMS = [name.lower() for name in ROWS]
GRADIENT_TERM, BIAS_TERM, WIDTH_TERM, UNLOADING_TERM, FRICTION_TERM, CREEP_TERM = (
    TERMS.index(name) for name in ("gradient", "yaw_rate_bias", "width", "unloading", "friction", "creep")
)
WINDUP_TERM, UNWINDING_TERM, WIND_TERMS = (
    TERMS.index("windup"),
    TERMS.index("unwinding"),
    [TERMS.index("wind"), TERMS.index("wind_across")],
)
WHEELBASE_TERM, FIFTH_WHEEL_TERM, UNEVEN_TERM = (TERMS.index(name) for name in ("wheelbase", "fifth_wheel", "uneven"))
WITHIN_PLAY = [UNLOADING_TERM, FRICTION_TERM, CREEP_TERM]


def in_si(given: str) -> float:
    """`1.5 deg` in rad; other numbers are SI."""
    number, _, unit = given.partition(" ")
    return float(number) * (DEGREE if unit == "deg" else 1.0)


GRADIENT_MEAN, FRICTION_MEAN, CREEP_MEAN, WINDUP_MEAN = (
    in_si(ROWS[name]["prior"][0]) for name in ("GRADIENT", "FRICTION", "CREEP", "WINDUP")
)
# Steering wheel angle per m/s^2 of front tyre force by a fifth wheel's friction.
FIFTH_WHEEL_ANGLE = RATIO * 0.7 * DEGREE


@dataclass(frozen=True)
class Play:
    half_width: float = 3.0 * DEGREE  # rad
    unloading: float = 0.1  # m/s^2
    friction: float = 0.05  # m/s^2; negative: the wheels stay where they rub
    creep: float = 100.0 * DEGREE  # rad/s per m/s^2
    windup: float = 0.3 * DEGREE  # rad, half
    unwinding: float = 0.0  # 1/s
    wind: tuple[float, float] = (0.0, 0.0)  # m/s^2
    fifth_wheel: float = 0.0  # m/s^2, by a fifth wheel's full friction

    def inner(self, angle: Array, lateral_acceleration: Array, blows: Array, centre: float = 0.0) -> Array:
        """Wind-up and play, an independent implementation of docs/method.md. `blows` (n, 2): share of each wind."""
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
    fifth_wheel: Array
    per_speed: Array
    wind: Array

    def mirrored(self) -> "Drive":
        """Left and right exchanged; the winds are unchanged."""
        same = ("per_speed", "wind")
        return Drive(**{name: column if name in same else -column for name, column in vars(self).items()})


def planted(drive: Drive, name: str, size: float) -> Drive:
    """The drive with a term of motion of this size, by its row of core/terms.toml."""
    row = ROWS[name]
    factors = {"ratio_times_wheelbase": RATIO_TIMES_WHEELBASE, "steering_ratio": RATIO}
    regressor = eval(row["sum"].replace("sample->", "drive.").replace("fabsf", "np.abs"), {"drive": drive, "np": np})
    return replace(drive, residual=drive.residual + size * factors.get(row.get("weight"), 1.0) * regressor)


def knots(rng: np.random.Generator, t: Array, every_s: float) -> Array:
    at = np.arange(0.0, t[-1] + 2 * every_s, every_s)
    return np.interp(t, at, rng.standard_normal(len(at)))


def dry_friction(yaw_rate: Array, v: Array) -> Array:
    """The dry friction of a fifth wheel, trailer of 7 m, -1 to 1, by docs/method.md: 0.2 deg from zero to full."""
    articulation = place = 0.0
    course = np.empty_like(yaw_rate)
    for k, (r, speed) in enumerate(zip(yaw_rate, v, strict=True)):
        turned = (r - speed / 7.0 * articulation) * STEP_S
        articulation += turned
        place = min(max(place + turned / (0.2 * DEGREE), -1.0), 1.0)
        course[k] = place
    return course


def driven(
    seed: int,
    play: Play,
    duration_s: int = 600,
    *,
    noise: float = 0.05 * DEGREE,
    yaw_rate_bias: float = 0.0,
    speed_swing: float = 5.0,
    uneven: float = 0.0,
) -> Drive:
    """Bends to both sides on a crowned road. `yaw_rate_bias`: rad/s, not corrected in the residual; `uneven`: share
    by which left turns need more angle, and right ones less."""
    rng = np.random.default_rng(seed)
    t = np.arange(duration_s * SAMPLES) * STEP_S
    v = 18.0 + speed_swing * np.sin(t / 40.0 + seed)
    curvature = 0.0015 * knots(rng, t, 7.0)
    a = v * v * curvature + 0.2
    hands = 0.8 * play.half_width * knots(rng, t, 1.7)
    angle = OFFSET + RATIO_TIMES_WHEELBASE * curvature + hands + 1.5 * play.half_width * knots(rng, t, 6.0)
    heading = np.cumsum(v * curvature) * STEP_S + t / 100.0
    blows = v[:, None] / 20.0 * np.column_stack([np.cos(heading), np.sin(heading)])
    lateral_force = a - play.unloading - blows @ np.array(play.wind)
    fifth_wheel = dry_friction(v * curvature, v)
    by_trailer = play.fifth_wheel * fifth_wheel
    residual = OFFSET + RATIO * GRADIENT * lateral_force + angle - play.inner(angle, a + by_trailer, blows, OFFSET)
    residual += FIFTH_WHEEL_ANGLE * by_trailer + uneven * RATIO_TIMES_WHEELBASE * np.abs(curvature)
    residual += noise * rng.standard_normal(len(t)) - RATIO_TIMES_WHEELBASE * yaw_rate_bias / v
    yaw_acceleration, jerk = np.gradient(v * curvature, STEP_S), np.gradient(a, STEP_S)
    return Drive(angle, residual, a, yaw_acceleration, jerk, curvature, fifth_wheel, 1.0 / v, blows)


@dataclass
class Learner:
    """A hypothesis of the core with its design, priors and second."""

    play: Play
    unloading_mean: float = 0.0
    unloading_sd: float = 0.15
    crown: float = 0.0  # for which the axle may be set up
    set_up_probability: float = 0.05
    yaw_rate_bias_sd: float = 0.02 * DEGREE
    memory_share: float | None = None  # None: short at first, as in the hypothesis set

    def __post_init__(self) -> None:
        self.h = ffi.new("oc_hypothesis *")
        self.design = ffi.new("oc_hypothesis_design *")
        lib.oc_hypothesis_setup(self.design, STEP_S, RATIO, RATIO_TIMES_WHEELBASE, PULL_SD)
        self.design.prior_discount_max = 25.0  # as joint.c has it
        self.design.known.set_up_probability = self.set_up_probability
        self.prior = ffi.new(
            "oc_prior *",
            {
                "unloading_mean": self.unloading_mean,
                "unloading_sd": self.unloading_sd,
                "crown": self.crown,
                "yaw_rate_bias_sd": self.yaw_rate_bias_sd,
            },
        )
        self.second = ffi.new(
            "oc_second *", {"second_s": 1.0, "memory_share": 1.0, "reference": DEGREE**2, "weight": 1.0, "learns": 1}
        )
        self.scale = np.array([self.design.scale[k] for k in range(len(TERMS))])
        self.started = False

    def sample(self, drive: Drive, k: int) -> None:
        if not self.started:
            lib.oc_hypothesis_start(self.h, ffi.new("oc_play *", vars(self.play)), drive.angle[0])
            self.started = True
        row = {name: column[k].tolist() for name, column in vars(drive).items()}
        native = ffi.new("oc_motion_sample *", row | {"force": row["lateral_acceleration"]})
        native.in_second = k % SAMPLES
        lib.oc_hypothesis_sample(self.h, self.design, native)

    def whole_second(self) -> None:
        h, second = self.h, self.second
        ends = round(second.used_s) + 1
        second.block_ends = ends % lib.OC_SECONDS_PER_BLOCK == 0
        second.long_block_ends = ends % lib.OC_SECONDS_PER_LONG_BLOCK == 0
        shortening = 1.0 - 1.0 / (60.0 + 0.5 * second.used_s)
        second.memory_share = shortening if self.memory_share is None else self.memory_share
        lib.oc_hypothesis_predict(h, self.design, second, SAMPLES)
        if second.learns:
            lib.oc_hypothesis_take_in(h, self.design, second, SAMPLES)
            self.solve()
            lib.oc_hypothesis_relinearise(h, self.design)
        second.used_s += 1.0
        second.blocks += second.block_ends
        second.long_blocks += second.long_block_ends

    def solve(self) -> None:
        lib.oc_hypothesis_solve(self.h, self.design, self.prior, self.second, ffi.new("oc_equations *"))

    def learn(self, drive: Drive) -> "Learner":
        for k in range(len(drive.angle)):
            self.sample(drive, k)
            if k % SAMPLES == SAMPLES - 1:
                self.whole_second()
        return self

    @property
    def now(self) -> Play:
        members = {name: getattr(self.h.play, name) for name in vars(self.play)}
        return Play(**{**members, "wind": tuple(members["wind"])})

    @property
    def total(self) -> dict[str, float]:
        """The estimated play, including the remaining solution of its terms."""
        t, now = [self.h.terms[k] * self.scale[k] for k in range(len(TERMS))], self.now
        return {"width": 2 * now.half_width + t[WIDTH_TERM], "unloading": now.unloading + t[UNLOADING_TERM]}

    @property
    def offset_sd(self) -> float:
        return math.sqrt(self.h.variances.of[lib.OC_OF_OFFSET])
