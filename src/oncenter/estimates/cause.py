"""The part of the offset's uncertainty that no single drive identifies: its causes, each with its stated prior."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from oncenter import _core
from oncenter.learned_priors import LearnedPriors
from oncenter.signals import DEGREE

Name = Literal["pull", "mean_wind", "axle_set_up", "axle_layout"]

_PER_ACCELERATION_MIN = 1e-6  # rad/(m/s^2): below it no lateral force changes the offset
_IN_WORDS: Mapping[Name, str] = {
    "pull": "pull",
    "mean_wind": "crosswind",
    "axle_set_up": "axle set up for the crown",
    "axle_layout": "unknown axle layout",
}
_REPORTED_FROM_RAD = 0.05 * DEGREE  # of a half-width: less rounds to zero
_NAMED_FROM = 0.25  # of all causes together
_MEASURED_FROM_DEG = 0.5  # of the offset: the half-width of a valid one, which a smaller pull does not exceed


@dataclass(frozen=True)
class Prior:
    """Standard deviation of a cause before any drive, m/s^2, and its source."""

    sd_m_s2: float
    source: str


@dataclass(frozen=True)
class Cause:
    """A shift of the neutral lateral acceleration beside the accelerometer bias.

    `sd_rad` is the standard deviation of its effect on the offset, `sd_m_s2` that of the shift itself; both follow from
    the prior unless the drive identifies more.
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


@dataclass(frozen=True)
class Pull:
    """A pull that several logs identify, or that the vehicle file gives, m/s^2, with its standard deviation;
    `effect_deg` is the size of its effect on the offset."""

    value: float
    sd: float
    effect_deg: float

    @property
    def is_measured(self) -> bool:
        """Whether the whole 95 % interval of its effect is relevant."""
        sure = abs(self.value) - 1.96 * self.sd
        return sure > 0.0 and self.effect_deg * sure / abs(self.value) > _MEASURED_FROM_DEG

    def words(self) -> str:
        """ "the truck pulls by +0.20 ± 0.05 m/s^2"."""
        return f"the truck pulls by {self.value:+.2f} ± {max(1.96 * self.sd, 0.01):.2f} m/s^2"


def causes_of(
    parts: _core.OcOffsetParts, params: Mapping[str, float], traffic_sign: float, learned: LearnedPriors | None = None
) -> Iterator[Cause]:
    """The causes of the joint method, also where they have no effect on the offset; none whose prior excludes it.

    Args:
        parts: the core's oc_offset_parts as a dict.
        params: in force.
        traffic_sign: 1 where traffic keeps right, -1 left, 0 not configured.
        learned: the fleet's priors that the vehicle file reads.
    """
    per = parts["per_acceleration"]
    has_pull = params["known_pull_sd_m_s2"] > 0.0  # a configured pull includes the set-up of the axle
    pull = "known_pull_sd_m_s2" if has_pull else "pull_sd_m_s2"
    causes: tuple[tuple[Name, float, str, str], ...] = (
        ("pull", parts["pull_sd"], pull, "lateral force by the wheel alignment"),
        ("mean_wind", parts["wind_sd"], "wind_sd_m_s2", "a drive's mean crosswind"),
    )
    for name, sd_rad, param, about in causes:
        prior = Prior(params[param], f"{about}: {_origin(param, params, learned)}")
        if prior.sd_m_s2 > 0.0:
            yield Cause(name, _shift(sd_rad, per, prior), sd_rad, prior)
    crown = params["crown_m_s2"]
    probability = params["set_up_probability_1"]
    if crown > 0.0 and probability > 0.0 and params["use_accelerometer"] and (not has_pull or probability > 0.5):
        sides = 1.0 - probability if traffic_sign != 0.0 else 1.0  # of an unknown side the mean shift is zero
        sd_m_s2 = crown * math.sqrt(probability * sides)
        about = f"{100.0 * probability:g} axles in 100 are set up for a crown of {crown:g} m/s^2"
        prior = Prior(sd_m_s2, f"{about}: {_origin('set_up_probability_1', params, learned)}")
        yield Cause("axle_set_up", _shift(parts["set_up_sd"], per, prior), parts["set_up_sd"], prior)


def by_layout(sd_rad: float, per_acceleration: float) -> Cause:
    """Of a truck whose axle layout is not given: the lateral force of rear axles in bends.

    Args:
        sd_rad: of the offset.
        per_acceleration: change of the offset by a shift of the neutral lateral acceleration.
    """
    shift = sd_rad / max(per_acceleration, _PER_ACCELERATION_MIN)
    prior = Prior(shift, "lateral force of rear axles in bends, from none to that of a 6x4: axle_layout is not given")
    return Cause("axle_layout", shift, sd_rad, prior)


def _shift(sd_rad: float, per_acceleration: float, prior: Prior) -> float:
    return sd_rad / per_acceleration if per_acceleration > _PER_ACCELERATION_MIN else prior.sd_m_s2


def _origin(param: str, params: Mapping[str, float], learned: LearnedPriors | None) -> str:
    if learned is not None and learned.params.get(param) == params[param]:
        return f"learned {learned.source}, parameter {param}"
    is_default = params[param] == _core.default_params()[param]
    return f"{'the default' if is_default else 'given'}, parameter {param}"


def together_rad(causes: Sequence[Cause]) -> float:
    """The standard deviation of the offset by all of them."""
    return math.sqrt(sum(cause.sd_rad**2 for cause in causes))


def in_words(causes: Sequence[Cause]) -> str:
    """Those with a relevant effect, "a pull or crosswind"; empty where there is none."""
    all_rad = together_rad(causes)
    if 1.96 * all_rad < _REPORTED_FROM_RAD:
        return ""
    names = [_IN_WORDS[cause.cause] for cause in causes if cause.sd_rad > _NAMED_FROM * all_rad]
    named = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"
    return f"{'an' if named[0] == 'a' else 'a'} {named}"
