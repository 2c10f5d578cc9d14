"""The steering's parameters from a scenario, and its pull."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from oncenter._native import ffi
from oncenter.signals import DEGREE, STANDARD_GRAVITY
from oncenter.simulate.interventions import within
from oncenter.simulate.truck import steered_force_n, steered_stiffness_n_rad
from oncenter.simulate.truck_sections import OverlayMotor, Steering, Truck

_LASH_FRICTION_N_M = 5.0  # about the king pins: bearings of the column, small against the king pins' own


def set_moment_n_m(truck: Truck, steering: Steering) -> float:
    """Constant moment about the king pins, positive to the left: the pull, and the setting for the road crown."""
    crown = steering.unloads_on_crown_percent / 100.0 * STANDARD_GRAVITY
    return steering.pull_n_m + steering.trail_m * steered_force_n(truck, steering, crown)


def unloading_acceleration_m_s2(truck: Truck, steering: Steering) -> float:
    """Neutral lateral acceleration, without a bend: there the king-pin moment is zero and the play changes its flank.

    0 without trail and without pull; NaN for a pull without trail, which has no such point.
    """
    moment_n_m = set_moment_n_m(truck, steering)
    if moment_n_m == 0.0:
        return 0.0
    per_m_s2 = steering.trail_m * steered_force_n(truck, steering, 1.0)
    return moment_n_m / per_m_s2 if per_m_s2 > 0.0 else float("nan")


def straight_ahead_rad(truck: Truck, steering: Steering, *, load_changed: bool = False) -> float:
    """Steering wheel angle, at mid-play and without column twist, for driving straight on a level road at constant
    speed.

    Zero, except for the pull of the alignment, which looks like a sensor offset but is not, and for a ratio polynomial
    that does not pass through zero. After a load change, the changed ride height adds to it.
    """
    at_wheels_rad = _set_angle_rad(truck, steering) + _compliance_rad_n_m(steering) * set_moment_n_m(truck, steering)
    gear_rad = (0.0 - at_wheels_rad - steering.ratio_polynomial[0]) * steering.ratio_near_centre
    if gear_rad < 0.0:
        gear_rad /= steering.ratio_right_share
    before = gear_rad + _twist_rad(steering, 0.0 - set_moment_n_m(truck, steering))
    return before + _ride_height_steer_rad(truck) if load_changed else before


def hand_torque_n_m_per_m_s2(truck: Truck, steering: Steering) -> float:
    """Torque at the steering wheel per lateral acceleration, on a flank of the play."""
    moment_n_m = steering.trail_m * steered_force_n(truck, steering, 1.0)
    return moment_n_m / (steering.ratio_near_centre * steering.assistance)


def resting_torque_n_m(motor: OverlayMotor, time_s: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Torque at each time of the hand that rests on the rim while the motor steers."""
    return motor.resting_torque_n_m * (1.0 - within(motor.hands_off_s, time_s))


def native_steering(steering: Steering, truck: Truck) -> Any:
    """The steering as a `sim_steering`."""
    return ffi.new(
        "sim_steering *",
        {
            "ratio_terms": len(steering.ratio_polynomial),
            "ratio": steering.ratio_polynomial,
            "right_share": steering.ratio_right_share,
            "ripple": steering.universal_joint_ripple_deg * DEGREE,
            "ripple_phase": steering.universal_joint_phase_deg * DEGREE,
            "trail": steering.trail_m,
            "compliance": _compliance_rad_n_m(steering),
            "set_angle": _set_angle_rad(truck, steering),
            "set_moment": set_moment_n_m(truck, steering),
            "brake_pull": steering.brake_pull_n_m_per_m_s2,
            "torque_steer": steering.torque_steer_n_m_per_m_s2,
            "twist": steering.torsion_bar_twist_deg * DEGREE,
            "twist_half_moment": steering.torsion_bar_half_moment_n_m or 0.0,
            "brake_steer": steering.brake_steer_deg_m_s2 * DEGREE,
            "roll_steer": steering.roll_steer_deg_deg,
            "ride_height_steer": 0.0 - _ride_height_steer_rad(truck) / steering.ratio_near_centre,
            "hands_share": 1.0 / (steering.ratio_near_centre * steering.assistance),
            "column_friction": steering.column_friction_n_m,
            "windup": {"half_width": steering.windup_deg * DEGREE, "friction": 0.0, "creep": 1.0},
            "active_return": steering.active_return_1_s,
            "lash": {
                "half_width": steering.lash_deg * DEGREE / 2.0,
                "friction": _LASH_FRICTION_N_M,
                "creep": steering.creep_deg_s_n_m * DEGREE,
            },
            "backlash": {
                "half_width": steering.backlash_deg * DEGREE / 2.0,
                "friction": steering.king_pin_friction_n_m,
                "creep": steering.creep_deg_s_n_m * DEGREE,
            },
        },
    )


def _twist_rad(steering: Steering, moment_n_m: float) -> float:
    """Twist of the torsion bar: steering wheel angle less gear angle."""
    if steering.torsion_bar_half_moment_n_m is None:
        return 0.0
    return steering.torsion_bar_twist_deg * DEGREE * math.tanh(moment_n_m / steering.torsion_bar_half_moment_n_m)


def _ride_height_steer_rad(truck: Truck) -> float:
    """The steering by the ride height, at the steering wheel."""
    return truck.load_change.ride_height_steer_deg * DEGREE if truck.load_change is not None else 0.0


def _compliance_rad_n_m(steering: Steering) -> float:
    return steering.compliance_deg_kn_m * DEGREE / 1000.0


def _set_angle_rad(truck: Truck, steering: Steering) -> float:
    """Front wheel angle equivalent to the lateral force that the wheels give without slip."""
    return steering.pull_n / steered_stiffness_n_rad(truck, steering)
