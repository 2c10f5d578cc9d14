"""The part of the offset's uncertainty that no single drive identifies: its causes, each with its stated prior."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from oncenter import _core
from oncenter.signals import DEGREE

Name = Literal["pull", "mean_wind", "axle_set_up"]

_SET_UP_PROBABILITY = 0.05  # core/hypothesis_equations.c, odds_against: one axle in twenty
_PER_ACCELERATION_MIN = 1e-6  # rad/(m/s^2): with less no lateral force moves the offset
_IN_WORDS: Mapping[Name, str] = {"pull": "pull", "mean_wind": "crosswind", "axle_set_up": "axle set up for the crown"}
_WORTH_TELLING_RAD = 0.05 * DEGREE  # of a half-width: less rounds to nothing
_WORTH_NAMING = 0.25  # of what all causes make


@dataclass(frozen=True)
class Prior:
    """What is assumed of a cause before any drive: its standard deviation in m/s^2, and where that is from."""

    sd_m_s2: float
    source: str


@dataclass(frozen=True)
class Cause:
    """What shifts the neutral lateral acceleration beside the accelerometer's bias.

    `sd_rad` is what it does to the offset, `sd_m_s2` the shift that does so, about the value; they are the prior's
    unless the drive says more.
    """

    cause: Name
    sd_m_s2: float
    sd_rad: float
    prior: Prior

    def to_dict(self) -> dict[str, Any]:
        return {
            "cause": self.cause,
            "sd_m_s2": self.sd_m_s2,
            "sd_deg": self.sd_rad / DEGREE,
            "prior": {"sd_m_s2": self.prior.sd_m_s2, "source": self.prior.source},
        }


def causes_of(parts: Mapping[str, float], params: Mapping[str, float], traffic_sign: float) -> tuple[Cause, ...]:
    """Those of the joint method, also where they do nothing to the offset; a cause whose prior excludes it is none.

    Args:
        parts: the core's oc_offset_parts as a dict.
        params: in force.
        traffic_sign: 1 where traffic keeps right, -1 left, 0 unknown.
    """
    return tuple(_causes(parts, params, traffic_sign))


def _causes(parts: Mapping[str, float], params: Mapping[str, float], traffic_sign: float) -> Iterator[Cause]:
    per = parts["per_acceleration"]
    knows_pull = params["known_pull_sd_m_s2"] > 0.0  # which then includes how the axle is set up
    for name, param, about in (
        ("pull", "known_pull_sd_m_s2" if knows_pull else "pull_sd_m_s2", "lateral force by the wheel alignment"),
        ("mean_wind", "wind_sd_m_s2", "a drive's mean crosswind"),
    ):
        prior = Prior(params[param], f"{about}: {_origin(param, params)}")
        sd_rad = parts[{"pull": "pull_sd", "mean_wind": "wind_sd"}[name]]
        if prior.sd_m_s2 > 0.0:
            yield Cause("pull" if name == "pull" else "mean_wind", _shift(sd_rad, per, prior), sd_rad, prior)
    crown = params["crown_m_s2"]
    if traffic_sign != 0.0 and crown > 0.0 and params["use_accelerometer"] and not knows_pull:
        sd_m_s2 = crown * math.sqrt(_SET_UP_PROBABILITY * (1.0 - _SET_UP_PROBABILITY))
        about = f"one axle in twenty is set up to unload on a crown of {crown:g} m/s^2"
        prior = Prior(sd_m_s2, f"{about}: {_origin('crown_m_s2', params)}")
        yield Cause("axle_set_up", _shift(parts["set_up_sd"], per, prior), parts["set_up_sd"], prior)


def _shift(sd_rad: float, per_acceleration: float, prior: Prior) -> float:
    return sd_rad / per_acceleration if per_acceleration > _PER_ACCELERATION_MIN else prior.sd_m_s2


def _origin(param: str, params: Mapping[str, float]) -> str:
    is_default = params[param] == _core.default_params()[param]
    return f"{'the default' if is_default else 'given'}, parameter {param}"


def together_rad(causes: Sequence[Cause]) -> float:
    """The standard deviation of the offset by all of them."""
    return math.sqrt(sum(cause.sd_rad**2 for cause in causes))


def in_words(causes: Sequence[Cause]) -> str:
    """Those that matter, with an article: "a pull or crosswind"; empty where all do next to nothing."""
    all_rad = together_rad(causes)
    if 1.96 * all_rad < _WORTH_TELLING_RAD:
        return ""
    names = [_IN_WORDS[cause.cause] for cause in causes if cause.sd_rad > _WORTH_NAMING * all_rad]
    named = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"
    return f"{'an' if named[0] == 'a' else 'a'} {named}"
