"""The driver's parameters from a scenario."""

from __future__ import annotations

import math
from typing import Any

from oncenter._native import ffi
from oncenter.signals import DEGREE
from oncenter.simulate.scenario import Scenario
from oncenter.simulate.truck import equivalent_wheelbase_m, first_axle_distance_m, understeer_gradient

_BACKWARDS_CURVATURE_1_M = 0.05  # the largest correction; a lorry's tightest bend has some 0.1


def native_driver(scenario: Scenario, tick_s: float) -> Any:
    """The driver as a `sim_driver`, without the times of standstill."""
    driver, ratio = scenario.driver, scenario.steering.ratio_near_centre
    wheelbase_m = equivalent_wheelbase_m(scenario.truck, scenario.steering)
    return ffi.new(
        "sim_driver *",
        {
            "angle_per_curvature": ratio * wheelbase_m,
            "angle_per_lateral_acceleration": ratio * understeer_gradient(scenario.truck, scenario.steering),
            "backlash_half_width": scenario.steering.backlash_deg * DEGREE / 2.0,
            "lash_half_width": scenario.steering.lash_deg * DEGREE / 2.0
            + scenario.steering.torsion_bar_twist_deg * DEGREE,
            "backwards_curvature": _BACKWARDS_CURVATURE_1_M,
            "backwards_speed": scenario.drive.reverse_speed_km_h / 3.6,
            "backwards_swing": scenario.drive.reverse_swing_m,
            "turns_behind": wheelbase_m - first_axle_distance_m(scenario.truck),
            "preview_time": driver.preview_time_s,
            "gain": driver.preview_gain,
            "trim_keep": math.exp(-tick_s / driver.trim_time_s),
            "reaction_time": driver.reaction_time_s,
            "reaction_ticks": round(driver.reaction_time_s / tick_s),
            "arm_frequency": driver.arm_frequency_rad_s,
            "lane_wander": driver.lane_wander_sd_m,
            "lane_wander_keep": math.exp(-tick_s / driver.lane_wander_time_s),
            "hand_motion": driver.hand_motion_sd_deg * DEGREE,
            "hand_motion_keep": math.exp(-tick_s / driver.hand_motion_time_s),
            "acceleration_max": driver.acceleration_max_m_s2,
            "deceleration_max": driver.deceleration_max_m_s2,
        },
    )
