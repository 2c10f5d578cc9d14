"""The offset by halved and by doubled priors: how far an answer depends on what is assumed before any drive."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

from oncenter.param_table import params as param_table
from oncenter.signals import DEGREE

Prior = Literal["pull", "mean_wind", "axle_set_up", "accelerometer_zero"]

PRIORS_IN_WORDS: Mapping[Prior, str] = {
    "pull": "pull",
    "mean_wind": "crosswind",
    "axle_set_up": "an axle set up for the crown",
    "accelerometer_zero": "the accelerometer's zero",
}

INSIDE_DRIVE: tuple[Prior, ...] = ("accelerometer_zero",)  # they change the drive's part of the interval


@dataclass(frozen=True)
class OffsetBy:
    """The offset and both of its intervals, or the moves of all of them by another prior, rad."""

    value: float
    ci95_drive: tuple[float, float]
    ci95: tuple[float, float]

    def __add__(self, moves: OffsetBy) -> OffsetBy:
        return self._with(moves, 1.0)

    def __sub__(self, start: OffsetBy) -> OffsetBy:
        return self._with(start, -1.0)

    def _with(self, other: OffsetBy, sign: float) -> OffsetBy:
        (own_low, own_high), (low, high) = other.ci95_drive, other.ci95
        return OffsetBy(
            self.value + sign * other.value,
            (self.ci95_drive[0] + sign * own_low, self.ci95_drive[1] + sign * own_high),
            (self.ci95[0] + sign * low, self.ci95[1] + sign * high),
        )

    def to_dict(self) -> dict[str, Any]:
        return {
            "value_deg": self.value / DEGREE,
            "ci95_drive": [bound / DEGREE for bound in self.ci95_drive],
            "ci95": [bound / DEGREE for bound in self.ci95],
        }


@dataclass(frozen=True)
class ByPrior:
    """The offset's moves by half and by twice of a prior: of its standard deviation, of an axle set-up its probability.

    `param` is its parameter, `size` the value in force.
    """

    prior: Prior
    param: str
    size: float
    halved: OffsetBy
    doubled: OffsetBy

    @property
    def inside_drive(self) -> bool:
        return self.prior in INSIDE_DRIVE

    def to_dict(self, now: OffsetBy) -> dict[str, Any]:
        return {
            "prior": self.prior,
            "param": self.param,
            "size": self.size,
            "halved": (now + self.halved).to_dict(),
            "doubled": (now + self.doubled).to_dict(),
        }


def by_priors(
    solved: Callable[[Mapping[str, float]], OffsetBy | None],
    params: Mapping[str, float],
    among: Sequence[Prior] = get_args(Prior),
) -> Iterator[ByPrior]:
    """The moves by each prior, where `solved` gives an offset by other params on the same evidence. They are compared
    with the one solved by the priors in force: an answer has equations that were solved seconds before its end."""
    start = solved(params)
    for prior, param in _priors_in(params) if start is not None else ():
        if prior not in among:
            continue
        halved, doubled = (solved(scaled(params, param, factor)) for factor in (0.5, 2.0))
        if start is not None and halved is not None and doubled is not None:
            yield ByPrior(prior, param, params[param], halved - start, doubled - start)


def _priors_in(params: Mapping[str, float]) -> Iterator[tuple[Prior, str]]:
    """The priors with an effect by these params, each with its parameter."""
    measures = bool(params["use_accelerometer"])
    has_pull = params["known_pull_sd_m_s2"] > 0.0  # a configured pull includes the set-up of the axle
    has_zero = params["known_accelerometer_bias_sd_m_s2"] > 0.0
    priors: tuple[tuple[Prior, str, bool], ...] = (
        ("pull", "known_pull_sd_m_s2" if has_pull else "pull_sd_m_s2", True),
        ("mean_wind", "wind_sd_m_s2", True),
        ("axle_set_up", "set_up_probability_1", measures and not has_pull and params["crown_m_s2"] > 0.0),
        (
            "accelerometer_zero",
            "known_accelerometer_bias_sd_m_s2" if has_zero else "accelerometer_bias_sd_m_s2",
            measures,
        ),
    )
    for prior, param, has_effect in priors:
        if has_effect and params[param] > 0.0:
            yield prior, param


def scaled(params: Mapping[str, float], param: str, factor: float) -> dict[str, float]:
    """The params with one prior `factor` times as large, within its range."""
    row = param_table()[param]
    return {**params, param: min(max(factor * params[param], row.low), row.high)}
