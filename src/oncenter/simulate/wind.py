"""The wind's parameters from a scenario."""

from __future__ import annotations

import math
from typing import Any

from oncenter._native import ffi
from oncenter.signals import DEGREE
from oncenter.simulate.road_sections import Wind

AIR_DENSITY_KG_M3 = 1.225  # ISO 2533, at sea level and 15 degrees Celsius


def native_wind(wind: Wind, tick_s: float) -> Any:
    """The wind as a `sim_wind`; converts a compass direction to an angle counter-clockwise from east,
    or one from the truck's nose to an angle counter-clockwise from there."""
    return ffi.new(
        "sim_wind *",
        {
            "mean": wind.mean_m_s,
            "from": ((0.0 if wind.from_side else 90.0) - wind.from_deg) * DEGREE,
            "with_truck": wind.from_side,
            "gust": wind.gust_sd_m_s,
            "gust_keep": math.exp(-tick_s / wind.gust_time_s),
            "force_constant": 0.5 * AIR_DENSITY_KG_M3 * wind.side_area_m2 * wind.side_force_coefficient,
            "arm": wind.force_arm_m,
        },
    )
