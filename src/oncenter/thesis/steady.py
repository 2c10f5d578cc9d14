"""Steady turns of trucks with any row of axles and tyres that saturate, solved for the front wheel angle: (8) to (12).

Solved from the axles alone, independent of the simulator: the lateral forces of the axles balance the lateral
acceleration, their moments balance each other and the scrub of dual tyres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from oncenter.simulate.scenario import read_scenario
from oncenter.simulate.truck import equivalent_wheelbase_m, native_truck, understeer_gradient
from oncenter.simulate.truck_sections import Truck

Array = npt.NDArray[np.float64]

# Rigid trucks as 2.3 has their tyres, some 13 % of the load per deg in front, 16 to 19 % behind; laden 12 to 18 t.
LAYOUTS: dict[str, dict[str, Any]] = {
    "4x2": {},
    "6x2": {
        "axle_layout": "6x2",
        "mass_kg": 10500.0,
        "yaw_inertia_kg_m2": 62000.0,
        "wheelbase_m": 4.6,
        "front_axle_distance_m": 2.3,
        "rear_axle_spacing_m": 1.35,
        "last_axle_load_share": 0.4,
        "front_cornering_stiffness_n_rad": 424000.0,
        "rear_cornering_stiffness_n_rad": 480000.0,
        "payload": {"mass_kg": 12000.0, "distance_m": 4.5, "length_m": 7.5},
    },
    "6x4": {
        "axle_layout": "6x4",
        "mass_kg": 11000.0,
        "yaw_inertia_kg_m2": 56000.0,
        "wheelbase_m": 3.9,
        "front_axle_distance_m": 2.2,
        "rear_axle_spacing_m": 1.37,
        "front_cornering_stiffness_n_rad": 418000.0,
        "rear_cornering_stiffness_n_rad": 510000.0,
        "dual_tyre_spacing_m": 0.34,
        "dual_tyre_longitudinal_stiffness_n": 250000.0,
        "payload": {"mass_kg": 14000.0, "distance_m": 4.2, "length_m": 5.5},
    },
    "8x4": {
        "axle_layout": "8x4",
        "mass_kg": 13000.0,
        "yaw_inertia_kg_m2": 76000.0,
        "wheelbase_m": 5.1,
        "front_axle_distance_m": 2.6,
        "front_axle_spacing_m": 1.94,
        "rear_axle_spacing_m": 1.37,
        "front_cornering_stiffness_n_rad": 628000.0,
        "rear_cornering_stiffness_n_rad": 453000.0,
        "dual_tyre_spacing_m": 0.34,
        "dual_tyre_longitudinal_stiffness_n": 250000.0,
        "payload": {"mass_kg": 18000.0, "distance_m": 4.5, "length_m": 5.5},
    },
}
SATURATING: dict[str, Any] = {"tyres": {"model": "magic_formula", "friction": 0.75, "C": 1.3, "E": -1.0}}

_SLIPS = np.linspace(-0.6, 0.6, 4801)  # rad
_STEP = 1e-7  # rad, of the numerical derivatives


@dataclass(frozen=True)
class SteadyTruck:
    """A truck's axles from first to last.

    Attributes:
        mass_kg: with its payload.
        ahead_m: of each axle, ahead of the centre of gravity.
        steer_share: of the front wheel angle, by axle.
        angles, forces: by axle, the angle between the direction of its wheels and its motion, rad, and the lateral
            force at this angle, N, the steering's compliance included.
        stiffness_n_rad: of each axle at no angle, compliance included.
        scrub_n_m2: yaw moment of dual tyres against a curvature.
        wheelbase_m: from the first axle to the middle of those that are not steered, by their stiffness.
        equivalent_wheelbase_m, understeer_gradient: the simulator's, near zero slip; rad/(m/s^2).
    """

    mass_kg: float
    ahead_m: Array
    steer_share: Array
    angles: tuple[Array, ...]
    forces: tuple[Array, ...]
    stiffness_n_rad: Array
    scrub_n_m2: float
    wheelbase_m: float
    equivalent_wheelbase_m: float
    understeer_gradient: float

    def front_wheel_angle(self, curvature_1_m: float, a_y: float) -> float:
        """rad, in a steady turn of this curvature at this lateral acceleration (m/s^2, on no bank); NaN where the tyres
        cannot give it."""
        return self._solution(curvature_1_m, a_y)[0]

    def side_slip(self, curvature_1_m: float, a_y: float) -> tuple[float, float]:
        """beta of (14) at the centre of gravity, and the front wheel angle, rad."""
        delta, beta = self._solution(curvature_1_m, a_y)
        return beta, delta

    def _unbalanced(self, delta: float, beta: float, curvature: float, a_y: float) -> Array:
        set_angles = self.steer_share * delta - beta - self.ahead_m * curvature
        known = zip(set_angles, self.angles, self.forces, strict=True)
        force = np.array([np.interp(angle, angles, forces) for angle, angles, forces in known])
        return np.array([force.sum() - self.mass_kg * a_y, (force * self.ahead_m).sum() - self.scrub_n_m2 * curvature])

    def _solution(self, curvature: float, a_y: float) -> tuple[float, float]:
        x = self._linear(curvature, a_y)
        for _ in range(60):
            here = self._unbalanced(x[0], x[1], curvature, a_y)
            slopes = np.column_stack(
                [
                    (self._unbalanced(x[0] + _STEP, x[1], curvature, a_y) - here) / _STEP,
                    (self._unbalanced(x[0], x[1] + _STEP, curvature, a_y) - here) / _STEP,
                ]
            )
            if abs(np.linalg.det(slopes)) < 1.0:
                break
            step = np.clip(np.linalg.solve(slopes, here), -0.02, 0.02)
            x = x - step
            if np.abs(step).max() < 1e-11:
                return float(x[0]), float(x[1])
        return float("nan"), float("nan")

    def _linear(self, curvature: float, a_y: float) -> Array:
        """Front wheel angle and side slip of the same truck with tyres that are linear as near zero slip."""
        C, s, x = self.stiffness_n_rad, self.steer_share, self.ahead_m
        balance = np.array([[(C * s).sum(), -C.sum()], [(C * s * x).sum(), -(C * x).sum()]])
        needed = [
            self.mass_kg * a_y + (C * x).sum() * curvature,
            (C * x * x).sum() * curvature + self.scrub_n_m2 * curvature,
        ]
        return np.linalg.solve(balance, np.array(needed))


def steady_truck(layout: str, **changes: Any) -> SteadyTruck:
    """A truck of LAYOUTS with other values of its scenario's `[truck]`."""
    scenario = read_scenario("thesis_drive")
    given = scenario.truck.model_dump(exclude_unset=True) | LAYOUTS[layout] | changes
    truck = Truck.model_validate(given)
    native = native_truck(truck, scenario.steering)
    axles = [native.axles[k] for k in range(native.axle_count)]
    ahead = np.array([axle.distance for axle in axles])
    share = np.array([axle.steer_share for axle in axles])
    tyre_forces = [_tyre_force(axle.tyre, truck) for axle in axles]
    rear = [axle for axle in axles if axle.steer_share == 0.0]
    weights = np.array([axle.tyre.cornering_stiffness for axle in rear])
    return SteadyTruck(
        mass_kg=native.mass,
        ahead_m=ahead,
        steer_share=share,
        angles=tuple(_SLIPS + axle.compliance * force for axle, force in zip(axles, tyre_forces, strict=True)),
        forces=tuple(tyre_forces),
        stiffness_n_rad=np.array([1.0 / (1.0 / axle.tyre.cornering_stiffness + axle.compliance) for axle in axles]),
        scrub_n_m2=sum(axle.scrub_stiffness for axle in axles),
        wheelbase_m=float(ahead[0] - np.average([axle.distance for axle in rear], weights=weights)),
        equivalent_wheelbase_m=equivalent_wheelbase_m(truck, scenario.steering),
        understeer_gradient=understeer_gradient(truck, scenario.steering),
    )


def _tyre_force(tyre: Any, truck: Truck) -> Array:
    """(4), or Pacejka's Magic Formula, over _SLIPS."""
    if truck.tyres is None:
        return np.asarray(tyre.cornering_stiffness * _SLIPS)
    x = tyre.cornering_stiffness / (tyre.C * tyre.D) * _SLIPS
    return np.asarray(tyre.D * np.sin(tyre.C * np.arctan(x - tyre.E * (x - np.arctan(x)))))
