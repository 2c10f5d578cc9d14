"""Priors of a truck's model before its first drive, and the random parts of each drive."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from oncenter import _core
from oncenter.signals import DEGREE
from oncenter.tuned import BETWEEN_DRIVES, PRIORS, TUNED


@dataclass(frozen=True)
class Priors:
    """Standard deviations unless their name says otherwise, SI and rad. Those of the core are its params; the others
    are tuned on seeds 1 to 60 of bench/one_truck.py and bench/trucks.py, which no published figure uses.

    Attributes:
        pull_m_s2, accelerometer_bias_m_s2: means, as configured.
        play_mean_rad, play_sd_rad: of the joint model's WIDTH and WINDUP.
        gradient_mean_rad_m_s2, load_spread_1: of K before the first drive, and between a truck's loads, a share of it.
        compliance_share_1: of K, from steering compliance under the king pins' moment (bench/population.py).
        crown_sd_m_s2: of one drive's mean crown: that of its roads in the region, and that of the region, which all
            drives of a truck share.
        load_steer_sds_rad, load_steer_weights: of the steering effect of ride height at another load, at the road
            wheels: small or large.
        wide_pull, wide_pull_probability: of trucks with a pull so many times as wide, as in the core; where a fleet has
            taught a narrower pull than usual, the wide one stays, or drives at several loads never find an outlier.
        bias_wander_sd_m_s2, *_day_sd_*: of what moves between two drives, at each and with the root of the days.
        offset_noise_sd_rad, play_noise_sd_rad: of a drive, beyond its own; offset_common_sd_rad: of all drives of a
            truck, by limits of the model.
        changes_per_day: of nothing, the offset, the play, both, offset with pull, and all. A truck that is logged is
            one that somebody works on: once in two months. Never per log, so that cutting a log changes nothing.
        new_offset_sd_rad: of an offset after a change.
        zero_probabilities: of a zero that is fixed, moves (by moves_sd_rad from a day to the next), or differs at each
            start (by relative_sd_rad).
        wrong_valid, wrong_other: probability that a drive is wrong, by wrong_sds_rad of its offset and its play: 1 of
            250 valid drives.
    """

    pull_sd_m_s2: float
    wind_sd_m_s2: float
    accelerometer_bias_sd_m_s2: float
    crown_m_s2: float
    crown_sd_m_s2: float
    standing_crown_share_1: float
    standing_slope_sd_m_s2: float
    pull_m_s2: float = 0.0
    accelerometer_bias_m_s2: float = 0.0
    offset_sd_rad: float = 30.0 * DEGREE
    play_mean_rad: float = PRIORS["WIDTH"][0] + PRIORS["WINDUP"][0]
    play_sd_rad: float = math.hypot(PRIORS["WIDTH"][1], PRIORS["WINDUP"][1])
    gradient_mean_rad_m_s2: float = PRIORS["GRADIENT"][0]
    load_spread_1: float = BETWEEN_DRIVES["GRADIENT"][0] / PRIORS["GRADIENT"][0]
    compliance_share_1: float = 0.35
    load_steer_sds_rad: tuple[float, float] = (0.003 * DEGREE, 0.04 * DEGREE)
    load_steer_weights: tuple[float, float] = (0.6, 0.4)
    bias_wander_sd_m_s2: float = BETWEEN_DRIVES["ACCELEROMETER_ZERO"][0]
    offset_noise_sd_rad: float = BETWEEN_DRIVES["OFFSET"][0]
    offset_common_sd_rad: float = 0.055 * DEGREE
    play_noise_sd_rad: float = BETWEEN_DRIVES["PLAY"][0]
    play_day_sd_rad: float = BETWEEN_DRIVES["PLAY"][1]
    bias_day_sd_m_s2: float = BETWEEN_DRIVES["ACCELEROMETER_ZERO"][1]
    pull_day_sd_m_s2: float = BETWEEN_DRIVES["PULL"][1]
    wide_pull: float = TUNED["hypothesis_equations.wide_pull"]
    wide_pull_probability: float = TUNED["setup.pull_tail"]
    changes_per_day: tuple[float, ...] = (0.0, 0.012, 0.002, 0.001, 0.004, 0.0)
    new_offset_sd_rad: float = 6.0 * DEGREE
    zero_probabilities: tuple[float, float, float] = (0.975, 0.015, 0.01)
    moves_sd_rad: float = 0.6 * DEGREE
    relative_sd_rad: float = 8.0 * DEGREE
    stated_sd_rad: float = 0.2 * DEGREE
    wrong_valid: float = 0.004
    wrong_other: float = 0.01
    wrong_sds_rad: tuple[float, float] = (6.0 * DEGREE, 2.5 * DEGREE)

    @property
    def region_sd_m_s2(self) -> float:
        return math.sqrt(self.crown_sd_m_s2**2 - self.road_sd_m_s2**2)

    @property
    def road_sd_m_s2(self) -> float:
        """Of a drive's mean crown within its region."""
        return min(BETWEEN_DRIVES["CROWN"][0], self.crown_sd_m_s2)


# Params of the core that decide about a truck: of its priors, and of whether its offset is valid.
PARAMS = (
    "known_pull_m_s2",
    "known_pull_sd_m_s2",
    "pull_sd_m_s2",
    "wind_sd_m_s2",
    "known_accelerometer_bias_m_s2",
    "known_accelerometer_bias_sd_m_s2",
    "accelerometer_bias_sd_m_s2",
    "crown_m_s2",
    "crown_sd_m_s2",
    "standing_crown_share_1",
    "standing_slope_sd_m_s2",
    "known_play_rad",
    "known_play_sd_rad",
    "use_accelerometer",
    "joint_evidence_min_s",
    "offset_drive_half_width_max_rad",
)


def priors_of(params: Mapping[str, float] | None = None) -> Priors:
    """The priors from the core's params, by default its defaults; configured values of the truck replace priors."""
    used = _core.default_params() | dict(params or {})
    pull_known, bias_known = used["known_pull_sd_m_s2"] > 0.0, used["known_accelerometer_bias_sd_m_s2"] > 0.0
    pull_sd, usual_sd = used["pull_sd_m_s2"], _core.default_params()["pull_sd_m_s2"]
    priors = Priors(
        pull_sd_m_s2=used["known_pull_sd_m_s2"] or pull_sd,
        wind_sd_m_s2=used["wind_sd_m_s2"],
        accelerometer_bias_sd_m_s2=used["known_accelerometer_bias_sd_m_s2"] or used["accelerometer_bias_sd_m_s2"],
        crown_m_s2=used["crown_m_s2"],
        crown_sd_m_s2=used["crown_sd_m_s2"],
        standing_crown_share_1=used["standing_crown_share_1"],
        standing_slope_sd_m_s2=used["standing_slope_sd_m_s2"],
        pull_m_s2=used["known_pull_m_s2"] if pull_known else 0.0,
        accelerometer_bias_m_s2=used["known_accelerometer_bias_m_s2"] if bias_known else 0.0,
        wide_pull=Priors.wide_pull * (max(usual_sd / pull_sd, 1.0) if pull_sd > 0.0 else 1.0),
    )
    if pull_known:
        priors = replace(priors, wide_pull_probability=0.0)
    if used["known_play_sd_rad"] > 0.0:
        return replace(priors, play_mean_rad=used["known_play_rad"], play_sd_rad=used["known_play_sd_rad"])
    return priors
