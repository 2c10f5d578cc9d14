"""What the model of a truck believes before its first drive, and what each drive draws anew."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from oncenter import _core

_DEGREE = 0.017453292519943295


@dataclass(frozen=True)
class Priors:
    """Standard deviations, SI and rad. Those that the core has, too, are its params; the other ones are ours, tuned on
    seeds 1 to 120 of bench/trucks.py, of which no figure is.

    Attributes:
        play_mean_rad, play_sd_rad: joint_model.h's WIDTH.
        gradient_mean_rad_m_s2, load_spread_1: of K before the first drive, and between a truck's loads, a share of it.
        compliance_share_1: of K, by what the steering gives way under the king pins' moment (bench/population.py).
        crown_of_truck_sd_m_s2: of the mean of a truck's roads; crown_sd_m_s2 is of one drive's.
        load_steer_sds_rad, load_steer_weights: at the road wheels, of what another load's ride height steers: little,
            or much, weighted by likelihood.
        step_load_steer_sd_rad: the same while steps are sought: much of it would explain them by loads.
        bias_wander_sd_m_s2: of the accelerometer's bias from one drive to the next.
        offset_noise_sd_rad, play_noise_sd_rad: of a drive, beyond its own.
        wide_rad: a drive that leaves so much open is believed half as much as it believes itself.
    """

    pull_sd_m_s2: float
    wind_sd_m_s2: float
    accelerometer_bias_sd_m_s2: float
    crown_m_s2: float
    crown_sd_m_s2: float
    standing_crown_share_1: float
    standing_slope_sd_m_s2: float
    play_mean_rad: float = 4.0 * _DEGREE
    play_sd_rad: float = 6.0 * _DEGREE
    gradient_mean_rad_m_s2: float = 0.4 * _DEGREE
    load_spread_1: float = 0.25
    compliance_share_1: float = 0.35
    crown_of_truck_sd_m_s2: float = 0.03
    load_steer_sds_rad: tuple[float, float] = (0.003 * _DEGREE, 0.04 * _DEGREE)
    load_steer_weights: tuple[float, float] = (0.6, 0.4)
    step_load_steer_sd_rad: float = 0.01 * _DEGREE
    bias_wander_sd_m_s2: float = 0.01
    offset_noise_sd_rad: float = 0.1 * _DEGREE
    play_noise_sd_rad: float = 0.3 * _DEGREE
    wide_rad: float = 1.0 * _DEGREE


def priors_of(params: Mapping[str, float] | None = None) -> Priors:
    """By the core's params, its defaults where there are none; what the truck is known to be replaces its prior."""
    believed = _core.default_params() | dict(params or {})
    priors = Priors(
        pull_sd_m_s2=believed["known_pull_sd_m_s2"] or believed["pull_sd_m_s2"],
        wind_sd_m_s2=believed["wind_sd_m_s2"],
        accelerometer_bias_sd_m_s2=believed["known_accelerometer_bias_sd_m_s2"]
        or believed["accelerometer_bias_sd_m_s2"],
        crown_m_s2=believed["crown_m_s2"],
        crown_sd_m_s2=believed["crown_sd_m_s2"],
        standing_crown_share_1=believed["standing_crown_share_1"],
        standing_slope_sd_m_s2=believed["standing_slope_sd_m_s2"],
    )
    if believed["known_play_sd_rad"] > 0.0:
        return replace(priors, play_mean_rad=believed["known_play_rad"], play_sd_rad=believed["known_play_sd_rad"])
    return priors
