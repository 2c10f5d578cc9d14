"""What the single-track truck needs of a scenario, and its understeer gradient by (10).

Steering that gives way under the aligning moment makes the front axle softer, exactly so while tyres are linear:
delta - c*F - alpha = F/C becomes delta - alpha = F*(1/C + c), and the axle's relaxation length shrinks as its stiffness
does (Pacejka's effective axle characteristic).
"""

from __future__ import annotations

from typing import Any

from oncenter._simulate import ffi
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.signals import DEGREE
from oncenter.simulate.scenario import Scenario, Steering, Truck

_SPEED_MARGIN = 0.8  # of the critical speed, above which a driver no longer holds an oversteering truck


def _front_softening(truck: Truck, steering: Steering) -> float:
    """How many times softer the front axle is for its steering's compliance, 1 or more."""
    compliance_rad_n = steering.compliance_deg_kn_m * DEGREE / 1000.0 * steering.trail_m
    return 1.0 + truck.front_cornering_stiffness_n_rad * compliance_rad_n


def understeer_gradient(truck: Truck, steering: Steering) -> float:
    """K_us/g of (10) at the road wheel, steering compliance included, rad/(m/s^2)."""
    m, L, l_f = truck.mass_kg, truck.wheelbase_m, truck.front_axle_distance_m
    C_f = truck.front_cornering_stiffness_n_rad / _front_softening(truck, steering)
    C_r = truck.rear_cornering_stiffness_n_rad
    return m / L * ((L - l_f) / C_f - l_f / C_r)


def check_holdable(scenario: Scenario) -> None:
    """Refuses an oversteering truck that is to be driven near its critical speed or beyond.

    Raises:
        OncenterError: "scenario_file", exit code 2.
    """
    gradient = understeer_gradient(scenario.truck, scenario.steering)
    if gradient >= 0.0:
        return
    critical_km_h = (scenario.truck.wheelbase_m / -gradient) ** 0.5 * 3.6
    if scenario.driver.speed_km_h[1] > _SPEED_MARGIN * critical_km_h:
        raise OncenterError(
            f"scenario {scenario.name}: 'truck' oversteers and cannot be held above {critical_km_h:.0f} km/h; lower "
            "'driver.speed_km_h' or raise 'truck.rear_cornering_stiffness_n_rad'",
            code="scenario_file",
            exit_code=WRONG_USAGE,
        )


def native_truck(truck: Truck, steering: Steering) -> Any:
    """The truck as a `sim_truck`."""
    softening = _front_softening(truck, steering)
    return ffi.new(
        "sim_truck *",
        {
            "mass": truck.mass_kg,
            "yaw_inertia": truck.yaw_inertia_kg_m2,
            "front_axle_distance": truck.front_axle_distance_m,
            "rear_axle_distance": truck.wheelbase_m - truck.front_axle_distance_m,
            "front_cornering_stiffness": truck.front_cornering_stiffness_n_rad / softening,
            "rear_cornering_stiffness": truck.rear_cornering_stiffness_n_rad,
            "front_relaxation_length": truck.relaxation_length_m / softening,
            "rear_relaxation_length": truck.relaxation_length_m,
        },
    )
