"""Priors of a truck's model before its first drive, and the random parts of each drive."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from oncenter import _core
from oncenter.signals import DEGREE
from oncenter.tuned import BETWEEN_DRIVES, PRIORS


@dataclass(frozen=True)
class Priors:
    """Standard deviations, SI and rad. Those of the core are its params; the others are tuned on seeds 1 to 120 of
    bench/trucks.py, which no published figure uses.

    Attributes:
        pull_mean_m_s2: to the side of traffic: of axles set up for the crown, in the search for them.
        play_mean_rad, play_sd_rad: the joint model's WIDTH.
        gradient_mean_rad_m_s2, load_spread_1: of K before the first drive, and between a truck's loads, a share of it.
        compliance_share_1: of K, from steering compliance under the king pins' moment (bench/population.py).
        crown_sd_m_s2: of one drive's mean crown: that of its roads in the region, and that of the region, which all
            drives of a truck share.
        load_steer_sds_rad, load_steer_weights: of the steering effect of ride height at another load, at the road
            wheels: small or large, weighted by likelihood.
        step_load_steer_sd_rad: the same during the test for steps: a large one would explain steps by loads.
        bias_wander_sd_m_s2: of the accelerometer's bias from one drive to the next.
        offset_noise_sd_rad, play_noise_sd_rad: of a drive, beyond its own; offset_common_sd_rad: of all drives of a
            truck, by limits of the model.
        wide_rad: a drive with this standard deviation of its offset gets half its weight.
    """

    pull_sd_m_s2: float
    wind_sd_m_s2: float
    accelerometer_bias_sd_m_s2: float
    crown_m_s2: float
    crown_sd_m_s2: float
    standing_crown_share_1: float
    standing_slope_sd_m_s2: float
    pull_mean_m_s2: float = 0.0
    play_mean_rad: float = PRIORS["WIDTH"][0]
    play_sd_rad: float = PRIORS["WIDTH"][1]
    gradient_mean_rad_m_s2: float = PRIORS["GRADIENT"][0]
    load_spread_1: float = BETWEEN_DRIVES["GRADIENT"][0] / PRIORS["GRADIENT"][0]
    compliance_share_1: float = 0.35
    load_steer_sds_rad: tuple[float, float] = (0.003 * DEGREE, 0.04 * DEGREE)
    load_steer_weights: tuple[float, float] = (0.6, 0.4)
    step_load_steer_sd_rad: float = 0.01 * DEGREE
    bias_wander_sd_m_s2: float = BETWEEN_DRIVES["ACCELEROMETER_ZERO"][0]
    offset_noise_sd_rad: float = BETWEEN_DRIVES["OFFSET"][0]
    offset_common_sd_rad: float = 0.055 * DEGREE
    play_noise_sd_rad: float = BETWEEN_DRIVES["PLAY"][0]
    wide_rad: float = 1.0 * DEGREE

    @property
    def region_sd_m_s2(self) -> float:
        return math.sqrt(self.crown_sd_m_s2**2 - self.road_sd_m_s2**2)

    @property
    def road_sd_m_s2(self) -> float:
        """Of a drive's mean crown within its region."""
        return min(BETWEEN_DRIVES["CROWN"][0], self.crown_sd_m_s2)


def priors_of(params: Mapping[str, float] | None = None) -> Priors:
    """The priors from the core's params, by default its defaults; configured values of the truck replace priors."""
    used = _core.default_params() | dict(params or {})
    priors = Priors(
        pull_sd_m_s2=used["known_pull_sd_m_s2"] or used["pull_sd_m_s2"],
        wind_sd_m_s2=used["wind_sd_m_s2"],
        accelerometer_bias_sd_m_s2=used["known_accelerometer_bias_sd_m_s2"] or used["accelerometer_bias_sd_m_s2"],
        crown_m_s2=used["crown_m_s2"],
        crown_sd_m_s2=used["crown_sd_m_s2"],
        standing_crown_share_1=used["standing_crown_share_1"],
        standing_slope_sd_m_s2=used["standing_slope_sd_m_s2"],
    )
    if used["known_play_sd_rad"] > 0.0:
        return replace(priors, play_mean_rad=used["known_play_rad"], play_sd_rad=used["known_play_sd_rad"])
    return priors
