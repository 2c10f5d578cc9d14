"""The evidence of one drive on its truck, without former estimates: a mixture of the joint method's hypotheses.

Each hypothesis of the core is a free play with its normal equations. Here the equations become information on what the
drives of a truck share, theta = (offset, free play with the wind-up of the column, neutral lateral acceleration). Terms
that belong to the drive are marginalised under their own priors, and theta has no prior. A posterior less its prior
would be no evidence: the answer is a mixture, and a drive on one flank has several modes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from oncenter import _core
from oncenter.signals import DEGREE
from oncenter.tuned import PRIORS, TUNED

Numbers = npt.NDArray[np.float64]

OFFSET, PLAY, NEUTRAL = range(3)
MODES = 4  # kept of a drive: pairs of drives with one flank each are as good as with all twelve (bench/one_truck.py)
TERMS = tuple(PRIORS)
_AT = {name: place for place, name in enumerate(TERMS)}
_WIDTH, _UNLOADING = _AT["WIDTH"], _AT["UNLOADING"]
_LOWER, _LOWER_SHARED = np.tril_indices(len(TERMS)), np.tril_indices(3)
_ALIKE = 0.02  # weight times squared distance over variance, below which two modes become one
_COST_MAX = 18.0  # above the best hypothesis's: others are left out
# s: load until a flank counts. A drive alone needs 2 s (core/joint/joint_answer.c); a few seconds of several drives err
# alike: of six drives on one flank 7 of 10 intervals hold with 2 s, 9 with 4 s, and no more with 20 s.
_FLANK_S = 4.0
_RIDGE_RAD = 60.0 * DEGREE  # an unloaded flank says nothing of the play's width
# sd of a broad prior of theta: rad, rad, m/s^2. A mode's weight is its probability under this prior.
_ANYWHERE = np.array([30.0 * DEGREE, math.hypot(PRIORS["WIDTH"][1], PRIORS["WINDUP"][1]), 0.35])
_ANYWHERE_MEAN = np.array([0.0, PRIORS["WIDTH"][0] + PRIORS["WINDUP"][0], 0.0])


class Mode(NamedTuple):
    """exp(log_weight) times a normal density of theta in information form: `information` (3, 3), `vector` (3,), which
    is information times mean."""

    log_weight: float
    information: Numbers
    vector: Numbers


def modes_of(state: Any, coefficients: Mapping[str, Any], more_variance: float, *, measured: bool) -> Numbers:
    """The evidence of the drive that a core has run over.

    Args:
        state, coefficients: of the core (`_core.Core`), by the joint method.
        more_variance: rad^2, of the offset, by what the hypotheses do not contain.
        measured: an accelerometer measures the bank; without one the neutral acceleration keeps its prior.

    Returns: (modes, 10), SI and rad: of each of at most `MODES` the level, the lower triangle of the information by
        rows, and the vector of exp(level + vector' theta - theta' information theta / 2).
    """
    joint, prior = state["evidence"]["joint"], state["tracking"]["joint"]["prior"]
    design = coefficients["joint"]["hypothesis"]
    # a configured play is a prior of the truck, no evidence of the drive
    own = {**design, "known": {**design["known"], "play_accuracy": 0.0}}
    found = [_mode(*solved, joint, design, prior) for solved in _core.solved_hypotheses(state, own)]
    least = min(cost for cost, _, _ in found)
    found = [(cost - least, information, vector) for cost, information, vector in found if cost - least < _COST_MAX]
    if not measured:
        sd, mean = float(prior["unloading_sd"]), float(prior["unloading_mean"])
        found = [(cost, *_without_neutral(information, vector, mean, sd)) for cost, information, vector in found]
    spread = np.diag([more_variance, 0.0, 0.0])
    total = float(np.logaddexp.reduce([-c for c, _, _ in found]))
    return merged([Mode(-c - total, *widened(i, v, spread)) for c, i, v in found], MODES)


def _mode(h: Any, solved: Any, noise: float, joint: Any, design: Any, prior: Any) -> tuple[float, Numbers, Numbers]:
    """Cost, information and vector of one hypothesis."""
    equations, right = equations_of(h, solved, noise, design, prior)
    linear, constant = of_theta(h, design)
    right = linear.T @ (right - equations @ constant)
    equations = linear.T @ equations @ linear
    share = np.linalg.solve(equations[3:, 3:], equations[3:, :3]).T
    information, vector = equations[:3, :3] - share @ equations[3:, :3], right[:3] - share @ right[3:]
    cost, spread = _flanks(h, joint, noise, float(design["steering_ratio"]))
    spread += np.diag(
        [
            _mismatch_variance(joint) + (TUNED["joint_answer.walk_step"] if h["walks"] else 0.0) ** 2,
            TUNED["joint_answer.width_error"] ** 2,
            TUNED["joint_answer.unloading_error"] ** 2,
        ]
    )
    return (cost, *widened(information, vector, spread))


def equations_of(h: Any, solved: Any, noise: float, design: Any, prior: Any) -> tuple[Numbers, Numbers]:
    """The normal equations of (constant, terms) of a solved hypothesis, without the priors of the terms that drives
    share (core/joint/hypothesis_equations.c, set_up_equations). The core has the factor of those of the terms about
    their means."""
    lower = np.zeros((len(TERMS), len(TERMS)))
    lower[_LOWER] = solved["lower"]
    normal = lower @ lower.T
    right = normal @ h["terms"]
    information, scale, play = solved["information"].astype(float), np.asarray(design["scale"], np.float64), h["play"]
    by_torque = float(prior["zero_information"]) * scale[_UNLOADING] ** 2
    for k, of_prior, mean in (
        (_WIDTH, information[_WIDTH], h["width_mean"] - 2.0 * play["half_width"]),
        (_UNLOADING, information[_UNLOADING] - by_torque, prior["unloading_mean"] - play["unloading"]),
        (_UNLOADING, by_torque, -play["unloading"]),
    ):
        normal[k, k] -= of_prior
        right[k] -= of_prior * mean / scale[k]
    row = np.array([1.0, *h["means"]])
    equations = float(h["weight"]) / noise * np.outer(row, row)
    of_constant = equations[0] * float(h["target_mean"])
    equations[1:, 1:] += normal
    return equations, of_constant + np.array([0.0, *right])


def of_theta(h: Any, design: Any) -> tuple[Numbers, Numbers]:
    """(constant, terms) = linear (theta, own terms) + constant. The gradient and all other terms are the drive's own.

    o = constant + i K a_0, linear about the present K and a_0; B + W = the play with the wind-up of the column.
    """
    scale, play, ratio = np.asarray(design["scale"], np.float64), h["play"], float(design["steering_ratio"])
    gradient, neutral = max(float(h["gradient"]), 0.0), float(h["unloading"])
    own = [k for k in range(1, len(TERMS) + 1) if k - 1 not in (_WIDTH, _UNLOADING)]
    linear, constant = np.zeros((len(TERMS) + 1, 3 + len(own))), np.zeros(len(TERMS) + 1)
    for place, k in enumerate(own):
        linear[k, 3 + place] = 1.0
    linear[0, OFFSET], linear[0, NEUTRAL] = 1.0, -ratio * gradient
    linear[0, -1] = -ratio * neutral * scale[_AT["GRADIENT"]]
    constant[0] = ratio * gradient * neutral
    width, unloading = 1 + _WIDTH, 1 + _UNLOADING
    linear[unloading, NEUTRAL] = 1.0 / scale[_AT["UNLOADING"]]
    constant[unloading] = -float(play["unloading"]) / scale[_AT["UNLOADING"]]
    linear[width, PLAY] = 1.0 / scale[_AT["WIDTH"]]
    constant[width] = -2.0 * float(play["half_width"]) / scale[_AT["WIDTH"]]
    if play["friction"] >= 0.0:
        constant[width] -= 2.0 * float(play["windup"]) / scale[_AT["WIDTH"]]
        linear[width, 3 + own.index(1 + _AT["WINDUP"])] = -scale[_AT["WINDUP"]] / scale[_AT["WIDTH"]]
    return linear, constant


def _lack(share: float) -> float:
    return max(1.0 - share, 0.0)


def _mismatch_variance(joint: Any) -> float:
    """Of the offset, rad^2 (core/joint/joint_answer.c)."""
    noise = joint["second"]["noise"]
    held, by_samples = np.array(noise["held"]), np.array(noise["by_samples"])
    is_held = held > TUNED["sensor_noise.held_share"]
    of_mean = np.where(is_held, by_samples, np.minimum(by_samples, noise["by_ticks"]))
    per = np.array([TUNED["joint_answer.per_acceleration_noise"], TUNED["joint_answer.per_yaw_rate_noise"]])
    return float(TUNED["joint_answer.offset_error"] ** 2 + np.sum(per**2 * of_mean))


def _flanks(h: Any, joint: Any, noise: float, ratio: float) -> tuple[float, Numbers]:
    """Cost of a hypothesis, and the covariance of theta for a flank that was not loaded (core/joint/joint_answer.c).

    While a flank is missing, the costs of two widths do not count: play and offset are a ridge, along which prediction
    errors are artefacts of the model, and five such drives would multiply them. Nor does one flank show the neutral
    acceleration, and the offset is the constant of the equation plus i K times it.
    """
    left_s, right_s = joint["loaded_left_s"], joint["loaded_right_s"]
    rate = math.sqrt(float(h["variance"]) / noise) / _FLANK_S
    loaded = rate * min(left_s - h["left_before"], right_s - h["right_before"])
    of_drive, missing = _lack(rate * min(left_s, right_s)), _lack(loaded)
    little = _lack(2.0 * float(h["play"]["half_width"]) / TUNED["joint_model.little_play"])
    share = max(
        missing**3,
        little * _lack(TUNED["joint_answer.no_play_share"] * loaded),
    )
    variance = share * PRIORS["WIDTH"][1] ** 2 + (missing * _RIDGE_RAD) ** 2
    along = np.array([-0.5 if left_s > right_s else 0.5, 1.0, 0.0])
    by_neutral = np.array([ratio * max(float(h["gradient"]), 0.0), 0.0, 1.0])
    unknown = (missing * _ANYWHERE[NEUTRAL]) ** 2 * np.outer(by_neutral, by_neutral)
    cost = float(h["cost"]) * (1.0 - of_drive) + 2.0 * _core.SECOND_COST_MAX * (missing - of_drive)
    return cost, variance * np.outer(along, along) + unknown


def _without_neutral(information: Numbers, vector: Numbers, mean: float, sd: float) -> tuple[Numbers, Numbers]:
    """Marginalised over the neutral acceleration, which has a prior."""
    total = information[NEUTRAL, NEUTRAL] + sd**-2.0
    share = information[:, NEUTRAL] / total
    share[NEUTRAL] = 1.0
    rest, right = information.copy(), vector.copy()
    rest[NEUTRAL, NEUTRAL], right[NEUTRAL] = total, vector[NEUTRAL] + mean / sd**2
    return rest - np.outer(share, rest[NEUTRAL]), right - share * right[NEUTRAL]


def widened(information: Numbers, vector: Numbers, spread: Numbers) -> tuple[Numbers, Numbers]:
    """The density convolved with a normal one of this covariance."""
    share = np.linalg.inv(np.eye(len(vector)) + information @ spread)
    wider = share @ information
    return 0.5 * (wider + wider.T), share @ vector


def log_integral(information: Numbers, vector: Numbers) -> float:
    """Of exp(vector' x - x' information x / 2), less a constant."""
    return float(0.5 * vector @ np.linalg.solve(information, vector) - 0.5 * np.linalg.slogdet(information)[1])


_BROAD = np.diag(_ANYWHERE**-2.0)
_BROAD_VECTOR = _BROAD @ _ANYWHERE_MEAN
_BROAD_INTEGRAL = log_integral(_BROAD, _BROAD_VECTOR)


def moments(modes: Sequence[Mode]) -> tuple[Numbers, Numbers]:
    """Mean and covariance of a proper mixture."""
    weights = np.exp([mode.log_weight for mode in modes] - np.max([mode.log_weight for mode in modes]))
    weights /= weights.sum()
    covariances = np.linalg.inv([mode.information for mode in modes])
    means = np.array([covariance @ mode.vector for covariance, mode in zip(covariances, modes, strict=True)])
    mean = weights @ means
    apart = means - mean
    return mean, np.einsum("k,kij->ij", weights, covariances + apart[:, :, None] * apart[:, None, :])


def merged(modes: Sequence[Mode], most: int) -> Numbers:
    """At most so many modes, as numbers: the least different ones become one, under the broad prior."""
    with_prior = [Mode(m.log_weight, m.information + _BROAD, m.vector + _BROAD_VECTOR) for m in modes]
    while len(with_prior) > 1:
        pairs = [(a, b) for a in range(len(with_prior)) for b in range(a)]
        difference, a, b = min((_difference(with_prior[a], with_prior[b]), a, b) for a, b in pairs)
        if len(with_prior) <= most and difference > _ALIKE:
            break
        both = [with_prior[a], with_prior[b]]
        mean, covariance = moments(both)
        information = np.asarray(np.linalg.inv(covariance), np.float64)
        one = Mode(float(np.logaddexp(both[0].log_weight, both[1].log_weight)), information, information @ mean)
        with_prior = [m for k, m in enumerate(with_prior) if k not in (a, b)] + [one]
    total = float(np.logaddexp.reduce([m.log_weight for m in with_prior]))
    return np.array([_numbers(m.log_weight - total, m) for m in with_prior])


def _numbers(log_weight: float, with_prior: Mode) -> Numbers:
    """A mode without the broad prior, whose mean under that prior is exp(log_weight)."""
    level = log_weight - log_integral(with_prior.information, with_prior.vector) + _BROAD_INTEGRAL
    information, vector = _not_negative(with_prior.information - _BROAD, with_prior.vector - _BROAD_VECTOR, with_prior)
    return np.array([level, *information[_LOWER_SHARED], *vector])


def _not_negative(information: Numbers, vector: Numbers, with_prior: Mode) -> tuple[Numbers, Numbers]:
    """A joined mode can be wider than the broad prior: no direction has negative information."""
    scaled = information * np.outer(_ANYWHERE, _ANYWHERE)
    values, vectors = np.linalg.eigh(scaled)
    if values[0] >= 0.0:
        return information, vector
    some = (vectors * np.maximum(values, 0.0)) @ vectors.T / np.outer(_ANYWHERE, _ANYWHERE)
    return some, some @ np.linalg.solve(with_prior.information, with_prior.vector)


def _difference(one: Mode, other: Mode) -> float:
    """By how much the mixture changes if the two modes become one."""
    first, second = np.linalg.inv(one.information), np.linalg.inv(other.information)
    apart = first @ one.vector - second @ other.vector
    lighter = math.exp(min(one.log_weight, other.log_weight))
    return lighter * float(np.sum(apart**2 / (np.diag(first) + np.diag(second))))
