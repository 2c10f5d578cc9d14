"""Trucks, roads and sensors by chance: every distribution in one table, and the scenario that a draw of it makes.

What a row of the accuracy matrix does not fix is drawn from here. What an interval must cover are these priors; those
that the core states as well (params.h) have their numbers from there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from oncenter import _core
from oncenter.signals import DEGREE
from oncenter.tuned import PRIORS, TUNED

Random = np.random.Generator


@dataclass(frozen=True)
class Uniform:
    low: float
    high: float

    def draw(self, random: Random) -> float:
        return float(random.uniform(self.low, self.high))

    def __str__(self) -> str:
        return f"even from {self.low:g} to {self.high:g}"


@dataclass(frozen=True)
class Normal:
    mean: float
    sd: float

    def draw(self, random: Random) -> float:
        return float(random.normal(self.mean, self.sd))

    def __str__(self) -> str:
        return f"normal, mean {self.mean:g}, sd {self.sd:g}"


@dataclass(frozen=True)
class Rayleigh:
    """A plane vector's length whose components are normal with the sd `mode`."""

    mode: float

    def draw(self, random: Random) -> float:
        return float(random.rayleigh(self.mode))

    def __str__(self) -> str:
        return f"Rayleigh, mode {self.mode:g}"


Distribution = Uniform | Normal | Rayleigh

BELIEVED = _core.default_params()  # the estimator's priors
PLAY_SD_DEG = PRIORS["WIDTH"][1] / DEGREE  # of the play's full width, before the drive
PULL_SD_M_S2, WIND_SD_M_S2 = BELIEVED["pull_sd_m_s2"], BELIEVED["wind_sd_m_s2"]
CROWN_M_S2, CROWN_SD_M_S2 = BELIEVED["crown_m_s2"], BELIEVED["crown_sd_m_s2"]
CROWN_SHARE_STOOD_ON = BELIEVED["standing_crown_share_1"]
# Of axles that are adjusted for the crown, and of drives on roads that fall to the other side than in the prior.
SET_UP_SHARE = BELIEVED["set_up_probability_1"]
OTHER_SIDE_SHARE = TUNED["hypothesis_equations.other_side_probability"]
G_M_S2 = 9.80665
PERCENT_PER_M_S2 = 100.0 / G_M_S2  # of a road's cross slope

# Name with unit: distribution, what it is.
PRIORS: dict[str, tuple[Distribution, str]] = {
    "wheelbase_m": (Uniform(3.5, 6.0), "given to the estimator"),
    "steering_ratio": (Uniform(16.0, 24.0), "given to the estimator"),
    "understeer_gradient_deg_m_s2": (Uniform(0.2, 0.8), "K_us/g at the road wheel, compliance included"),
    "compliance_share_1": (Uniform(0.2, 0.5), "share of K_us/g: elasticity of the steering under the aligning moment"),
    "front_axle_load_kg": (Uniform(5000.0, 8000.0), ""),
    "rear_axle_load_kg": (Uniform(2200.0, 11500.0), ""),
    "trail_m": (Uniform(0.04, 0.08), "lever arm of the lateral force about the king pins"),
    "king_pin_friction_m_s2": (Uniform(0.02, 0.2), "as the lateral acceleration that overcomes it"),
    "creep_deg_s_n_m": (Uniform(0.1, 0.5), "speed through the play per moment beyond friction"),
    "backlash_deg": (Uniform(0.0, 15.0), "play, full width at the steering wheel"),
    "offset_deg": (Normal(0.0, 5.0), "of the steering wheel angle sensor"),
    "yaw_rate_bias_deg_s": (Normal(0.0, 0.2), ""),
    "lateral_acceleration_bias_m_s2": (
        Normal(0.0, 0.1),
        "the prior of the estimator is 0.5 (sd), because 0.6 was measured",
    ),
    "pull_m_s2": (
        Normal(0.0, PULL_SD_M_S2),
        "lateral acceleration at which a truck that pulls has no moment at the king pins",
    ),
    "pull_n": (Normal(0.0, 100.0), "lateral force of the alignment without slip"),
    "wind_m_s": (
        Rayleigh(3.0),
        "mean wind, from any direction; moves the population's neutral lateral acceleration by 0.02 m/s^2 (sd)",
    ),
    "gust_sd_m_s": (Uniform(0.5, 2.0), ""),
    "crown_percent": (
        Normal(round(CROWN_M_S2 * PERCENT_PER_M_S2, 1), round(CROWN_SD_M_S2 * PERCENT_PER_M_S2, 1)),
        "cross slope toward the side of the traffic, 0.2 +- 0.1 m/s^2",
    ),
    "rough_bank_sd_percent": (Uniform(0.0, 0.5), ""),
    "heading_deg": (Uniform(0.0, 359.0), "of the road at its start"),
    "wheel_radius_error_percent": (Normal(0.0, 0.3), "of each wheel"),
    "load_transfer_percent_m_s2": (Uniform(0.0, 0.2), "of the radius per lateral acceleration"),
    "standing_at_start_s": (Uniform(2.0, 20.0), "with the engine on; half of the population has no standstill"),
}
REAR_STIFFNESS_SHARE_1_DEG = 0.19  # of the load, per deg of slip, 2.3


@dataclass(frozen=True)
class Draw:
    """One draw of PRIORS by name, of which a row may have fixed some; `[]` gives the number."""

    numbers: Mapping[str, float]
    radius_errors_percent: tuple[float, float, float, float]

    def __getitem__(self, name: str) -> float:
        return self.numbers[name]


def draw(random: Random, fixed: Mapping[str, Distribution | float] | None = None) -> Draw:
    """All of PRIORS in their order, so that what a row fixes does not move the rest."""
    numbers = {}
    for name, (prior, _) in PRIORS.items():
        usual = prior.draw(random)
        of_row = (fixed or {}).get(name, usual)
        numbers[name] = of_row.draw(random) if isinstance(of_row, Distribution) else float(of_row)
    wheel = PRIORS["wheel_radius_error_percent"][0]
    front_left, front_right, rear_left, rear_right = (wheel.draw(random) for _ in range(4))
    return Draw(numbers, (front_left, front_right, rear_left, rear_right))


def truck(drawn: Draw) -> dict[str, Any]:
    """[truck] of a 4x2 with the drawn understeer gradient: what the compliance leaves of it goes to the front tyres."""
    front_kg, rear_kg, L = drawn["front_axle_load_kg"], drawn["rear_axle_load_kg"], drawn["wheelbase_m"]
    mass = front_kg + rear_kg
    front_m = L * rear_kg / mass
    rear_deg = 1.0 / (REAR_STIFFNESS_SHARE_1_DEG * G_M_S2)  # slip per m/s^2
    front_deg = drawn["understeer_gradient_deg_m_s2"] * (1.0 - drawn["compliance_share_1"]) + rear_deg
    return {
        "mass_kg": mass,
        "yaw_inertia_kg_m2": 1.1 * mass * front_m * (L - front_m),
        "wheelbase_m": L,
        "front_axle_distance_m": front_m,
        "front_cornering_stiffness_n_rad": front_kg / (front_deg * DEGREE),
        "rear_cornering_stiffness_n_rad": rear_kg / (rear_deg * DEGREE),
    }


def steering(drawn: Draw, front_axle_load_kg: float, *, pulls: bool) -> dict[str, Any]:
    """[steering]; a lateral acceleration becomes a moment about the king pins through the front axle's load."""
    moment_n_m_per_m_s2 = drawn["trail_m"] * front_axle_load_kg
    soft_deg = drawn["understeer_gradient_deg_m_s2"] * drawn["compliance_share_1"]
    return {
        "steering_ratio": drawn["steering_ratio"],
        "backlash_deg": drawn["backlash_deg"],
        "king_pin_friction_n_m": drawn["king_pin_friction_m_s2"] * moment_n_m_per_m_s2,
        "trail_m": drawn["trail_m"],
        "creep_deg_s_n_m": drawn["creep_deg_s_n_m"],
        "compliance_deg_kn_m": 1000.0 * soft_deg / moment_n_m_per_m_s2,
        "pull_n_m": drawn["pull_m_s2"] * moment_n_m_per_m_s2 if pulls else 0.0,
        "pull_n": drawn["pull_n"] if pulls else 0.0,
    }


def wind(drawn: Draw, random: Random) -> dict[str, Any]:
    """[wind] on a tractor without trailer."""
    return {
        "mean_m_s": drawn["wind_m_s"],
        "from_deg": float(random.uniform(0.0, 360.0)),
        "gust_sd_m_s": drawn["gust_sd_m_s"],
        "gust_time_s": 3.0,
        "side_area_m2": 9.0,
        "side_force_coefficient": 1.1,
        "force_arm_m": 0.4,
    }


def sensors(drawn: Draw) -> dict[str, Any]:
    """[sensors] beyond Table 1's noise and resolution; the wheels' as HRW sends them."""
    corners = ("front_left", "front_right", "rear_left", "rear_right")
    return {
        "steering_wheel_angle": {"offset_deg": drawn["offset_deg"]},
        "yaw_rate": {"bias_deg_s": drawn["yaw_rate_bias_deg_s"]},
        "lateral_acceleration": {"bias_m_s2": drawn["lateral_acceleration_bias_m_s2"]},
        "speed": {"resolution_m_s": 1.0 / 256.0 / 3.6},
        "wheel_speed": {
            "resolution_m_s": 1.0 / 256.0 / 3.6,
            "radius_error_percent": dict(zip(corners, drawn.radius_errors_percent, strict=True)),
            "load_transfer_percent_m_s2": drawn["load_transfer_percent_m_s2"],
        },
    }


def not_identifiable_m_s2(*, unloads: bool, stood: bool) -> float:
    """Standard deviation in lateral acceleration that is not identifiable from one drive: the interval's minimum.

    If lateral force moves the wheels in their play, the drive identifies the sum accelerometer bias + pull + wind by
    the neutral lateral acceleration. Without play, or if friction always holds the wheels, it identifies none of them,
    and bias and wind add to the uncertainty of an offset at zero lateral acceleration. There are three sources for the
    bias: its prior; the mean bank of the roads, whose crown has a prior; and the ground at standstill, if the truck
    stood. The latter contains a share of the crown, so it is independent only in the rest.
    """
    bias = accelerometer_bias_sd_m_s2(stood=stood)
    if not unloads:
        return math.hypot(bias, WIND_SD_M_S2)
    return 1.0 / math.hypot(1.0 / bias, 1.0 / math.hypot(PULL_SD_M_S2, WIND_SD_M_S2))


def set_up_left_open_m_s2(*, stood: bool) -> float:
    """Remaining standard deviation from the axle setup, if the neutral acceleration deviates by the usual crown.

    By Bayes' rule from the prior of the setup and the likelihoods of both cases, with the sd of bias and pull.
    """
    bias = accelerometer_bias_sd_m_s2(stood=stood)
    variance = bias**2 + PULL_SD_M_S2**2 + WIND_SD_M_S2**2
    none = math.exp(-0.5 * CROWN_M_S2**2 / variance)  # as likely as that the roads fall to the other side
    likely = SET_UP_SHARE / (SET_UP_SHARE + (1.0 - SET_UP_SHARE) * none)
    return math.sqrt(likely * (1.0 - likely)) * CROWN_M_S2 * bias**2 / variance


def accelerometer_bias_sd_m_s2(*, stood: bool) -> float:
    """Standard deviation of the bias by its prior, the roads' mean bank and, if the truck stood, that ground."""
    information = [1.0 / BELIEVED["accelerometer_bias_sd_m_s2"], 1.0 / CROWN_SD_M_S2]
    if stood:
        information.append((1.0 - CROWN_SHARE_STOOD_ON) / BELIEVED["standing_slope_sd_m_s2"])
    return 1.0 / math.hypot(*information)


def believed_accelerometer_bias_m_s2(bank_m_s2: float, standing_m_s2: float | None, traffic_side: float) -> float:
    """Best estimate of the accelerometer bias from the mean bank and, if the truck stood, from the reading there.

    Two unknowns, bias and crown, by weighted least squares over their priors and readings; `bank_m_s2` is their sum.
    `traffic_side` is 1 to the right.
    """
    slope_sd = BELIEVED["standing_slope_sd_m_s2"]
    rows = [(1.0, 0.0, 0.0, BELIEVED["accelerometer_bias_sd_m_s2"])]
    rows += [(0.0, 1.0, traffic_side * CROWN_M_S2, CROWN_SD_M_S2), (1.0, 1.0, bank_m_s2, 1e-4)]
    if standing_m_s2 is not None:
        rows.append((1.0, CROWN_SHARE_STOOD_ON, standing_m_s2, slope_sd))
    table = np.array(rows)
    weighted = table / table[:, 3:]
    return float(np.linalg.lstsq(weighted[:, :2], weighted[:, 2], rcond=None)[0][0])
