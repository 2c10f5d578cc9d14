"""What the steering needs of a scenario."""

from __future__ import annotations

from typing import Any

from oncenter._simulate import ffi
from oncenter.signals import DEGREE
from oncenter.simulate.scenario import Steering


def native_steering(steering: Steering) -> Any:
    """The steering as a `sim_steering`."""
    return ffi.new(
        "sim_steering *",
        {
            "ratio": steering.steering_ratio,
            "trail": steering.trail_m,
            "backlash": {
                "half_width": steering.backlash_deg * DEGREE / 2.0,
                "friction": steering.king_pin_friction_n_m,
                "creep": steering.creep_deg_s_n_m * DEGREE,
            },
        },
    )
