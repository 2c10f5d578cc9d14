"""Drives of a truck of an independent model: the multi-body model of commonroad-vehicle-models (Althoff).

It has 29 states: a sprung mass on two rigid axles with springs, dampers and compliant joints, four wheels that spin,
and four Magic Formula tyres with load transfer. The simulator drives a truck of two states with the same masses and
lengths. The course of its front wheels, its speed and the cross slope of the road are the input of the multi-body
model, whose yaw rate, lateral acceleration and wheel speeds replace those of the simulator below the sensors' errors.
Play, friction, driver and sensors are the simulator's. No wind, and no compliance of the steering, which the model does
not have. tests/test_simulate_multibody.py compares the two models.
"""

from __future__ import annotations

import dataclasses
import math
from collections import namedtuple
from functools import cache
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import numpy as np
import polars as pl
from accuracy_rows import Drive, Row, drive
from drives_that_differ import truck
from vehiclemodels.init_mb import init_mb
from vehiclemodels.parameters_vehicle3 import parameters_vehicle3
from vehiclemodels.utils import tire_model
from vehiclemodels.utils.acceleration_constraints import acceleration_constraints
from vehiclemodels.utils.steering_constraints import steering_constraints
from vehiclemodels.utils.vehicle_dynamics_ks_cog import vehicle_dynamics_ks_cog
from vehiclemodels.vehicle_dynamics_mb import vehicle_dynamics_mb

Array = np.ndarray[Any, np.dtype[np.float64]]
GRAVITY = 9.81  # m/s^2, as the multi-body model has it
STEP_S, PARTS = 0.01, 10  # of a tick; the wheels' spin needs steps of a millisecond
ROADS = ("thesis_drive", "country", "motorway")  # without stops: at standstill the model has no tyres
FROM_M_S = 5.0  # below it, at the start and at the end, the simulator's motion is taken
MASS_SHARE, STIFFNESS_PER_LOAD = (0.9, 1.5), (7.5, 9.5)  # of the sprung mass; 1/rad
SPEED_1_S = 1.0  # gain of the speed control
YAW_RATE, SPEED, SIDEWAYS, ROLL = 5, 3, 10, 6  # places in the state
SPINS = {"front_right": 23, "front_left": 24, "rear_right": 25, "rear_left": 26}  # its y axis points to the right


def truck_like(sprung_share: float = 1.0, stiffness_per_load: float = 8.5) -> Any:
    """The thesis's tractor as parameters of the multi-body model, all tyres of one kind."""
    p = parameters_vehicle3()
    p.m_uf, p.m_ur, p.m_s = 700.0, 1100.0, 6300.0 * sprung_share
    p.m = p.m_s + p.m_uf + p.m_ur
    p.a, p.b = 1.005, 2.695
    p.I_z, p.I_Phi_s, p.I_y_s = 24000.0 * sprung_share, 6000.0 * sprung_share, 20000.0 * sprung_share
    p.K_sf, p.K_sdf, p.K_sr, p.K_sdr = 250e3, 15e3, 250e3, 15e3
    p.T_f, p.T_r = 2.05, 1.83
    p.K_ras, p.K_rad = 2e6, 60e3
    p.K_tsf, p.K_tsr = -100e3, -100e3
    p.K_zt, p.K_lt = 1000e3, 2e-7
    p.h_cg, p.h_s, p.h_raf, p.h_rar = 1.0, 1.15, 0.5, 0.7
    p.I_uf, p.I_ur, p.I_y_w, p.R_w = 450.0, 450.0, 15.0, 0.5
    p.D_f, p.D_r = -2.0 / p.T_f, -2.0 / p.T_r  # rigid axles: no camber from springs
    p.tire.p_ky1, p.tire.p_dy1, p.tire.p_dy3 = -stiffness_per_load, 0.8, 0.0
    for shift in ("p_hx1", "p_vx1", "p_hy1", "p_vy1", "r_hx1", "r_hy1", "r_vy1"):
        setattr(p.tire, shift, 0.0)  # a car tyre's lateral force without slip, which jumps with the sign of its camber
    return p


def single_track_truck(p: Any) -> dict[str, Any]:
    """[truck] of a scenario with the same masses, lengths and stiffness by wheel loads."""
    loads = [GRAVITY * (p.m_s * x / (p.a + p.b) + own) for x, own in ((p.b, p.m_uf), (p.a, p.m_ur))]
    return {
        "mass_kg": p.m,
        "yaw_inertia_kg_m2": p.I_z,
        "wheelbase_m": p.a + p.b,
        "front_axle_distance_m": p.a,
        "front_cornering_stiffness_n_rad": -p.tire.p_ky1 * loads[0],
        "rear_cornering_stiffness_n_rad": -p.tire.p_ky1 * loads[1],
        "relaxation_length_m": 0.0,
        "track_width_front_m": p.T_f,
        "track_width_rear_m": p.T_r,
    }


def multibody_drive(seed: int, k: int, folder: Path, minutes: float) -> Drive:
    """The k-th drive of the truck of that seed."""
    of_truck = np.random.default_rng([seed, 5454])
    p = truck_like(float(of_truck.uniform(*MASS_SHARE)), float(of_truck.uniform(*STIFFNESS_PER_LOAD)))
    base = str(np.random.default_rng([seed, k, 54]).choice(ROADS))
    values = {
        "drive": {"duration_s": 60.0 * minutes},
        "truck": single_track_truck(p),
        "steering": {"compliance_deg_kn_m": 0.0},
    }
    row = Row(f"multibody{seed}_{k}", "", base=base, fixed=truck(seed).fixed, extra=lambda _: values)
    driven = drive(row, 1000 * seed + k, folder)
    return dataclasses.replace(driven, signals=_by_multi_body(driven, p))


def _by_multi_body(driven: Drive, p: Any) -> Any:
    true = driven.truth.table
    speed = true["vehicle_speed_m_s"].to_numpy()
    drives = np.flatnonzero(speed > FROM_M_S)
    now = slice(int(drives[0]), int(drives[-1]))
    states = motion(p, true[now])
    signals = driven.signals
    gravity = -GRAVITY * true["road_cross_slope"].to_numpy()[now]
    yaw_rate, v, sideways = (states[place] for place in (YAW_RATE, SPEED, SIDEWAYS))
    specific = np.gradient(sideways, STEP_S) + yaw_rate * v - gravity
    outward = -states[ROLL]
    more = {
        "yaw_rate_rad_s": yaw_rate - true["yaw_rate_rad_s"].to_numpy()[now],
        "lateral_acceleration_m_s2": specific * np.cos(outward)
        + GRAVITY * np.sin(outward)
        - true["felt_lateral_acceleration_m_s2"].to_numpy()[now],
        "vehicle_speed_m_s": v - speed[now],
    }
    rolled = wheel_speeds(p, true)
    more |= {f"wheel_speed_{c}_m_s": p.R_w * states[place] - rolled[c][now] for c, place in SPINS.items()}
    columns = {}
    for name, difference in more.items():
        column = signals.table[name].to_numpy().copy()
        step = np.diff(np.unique(column)).min()
        column[now] = np.round((column[now] + difference) / step) * step
        columns[name] = pl.Series(column)
    return dataclasses.replace(signals, table=signals.table.with_columns(**columns))


def wheel_speeds(p: Any, true: pl.DataFrame) -> dict[str, Array]:
    """Of the simulator's truck, at the tread."""
    v, r, sideways, angle = (
        true[name].to_numpy()
        for name in ("vehicle_speed_m_s", "yaw_rate_rad_s", "lateral_speed_m_s", "front_wheel_angle_rad")
    )
    across = (sideways + p.a * r) * np.sin(angle)
    return {
        "front_left": (v - 0.5 * p.T_f * r) * np.cos(angle) + across,
        "front_right": (v + 0.5 * p.T_f * r) * np.cos(angle) + across,
        "rear_left": v - 0.5 * p.T_r * r,
        "rear_right": v + 0.5 * p.T_r * r,
    }


def motion(p: Any, true: pl.DataFrame) -> Array:
    """States of the multi-body model (29, ticks), left positive, with the wheels, the speed and the road of a truth."""
    names = ("front_wheel_angle_rad", "vehicle_speed_m_s", "longitudinal_acceleration_m_s2", "road_cross_slope")
    angle, speed, forward, slope = (np.ascontiguousarray(true[name].to_numpy()) for name in names)
    yaw_rate, sideways = (float(true[name][0]) for name in ("yaw_rate_rad_s", "lateral_speed_m_s"))
    start = init_mb([0.0, 0.0, angle[0], speed[0], 0.0, yaw_rate, sideways / speed[0]], p)
    states: Array = _compiled()(np.array(start, np.float64), angle, speed, forward, -GRAVITY * slope, _as_tuple(p))
    assert np.isfinite(states).all()
    return states


@cache
def _compiled() -> Any:
    """The model and Runge-Kutta's method of fourth order, compiled: a drive takes some seconds instead of a quarter of
    an hour. The model's functions are copied, since other callers use them with parameters of another type."""
    from numba import njit  # late import: only a new drive needs it

    tyres = ModuleType("tyres")
    tyres.__dict__.update(vars(tire_model))
    for name in (
        "sign",
        "formula_longitudinal",
        "formula_lateral",
        "formula_longitudinal_comb",
        "formula_lateral_comb",
    ):
        setattr(tyres, name, njit(_copy(getattr(tire_model, name), vars(tyres))))
    names = {"math": math, "tireModel": tyres}
    names |= {f.__name__: njit(_copy(f, {})) for f in (steering_constraints, acceleration_constraints)}
    names["vehicle_dynamics_ks_cog"] = njit(_copy(vehicle_dynamics_ks_cog, dict(names)))
    slope_of = njit(_copy(vehicle_dynamics_mb, names))

    @njit
    def derivative(x: Array, angle: float, rate: float, forward: float, gravity: float, p: Any) -> Array:
        state = x.copy()
        state[2] = angle  # exact, without the drift of its integral
        moved = slope_of(state, [rate, forward], p)
        for place in (10, 15, 20):  # of the body, the front and the rear axle
            moved[place] += gravity
        return np.array(moved)

    @njit
    def run(x: Array, angle: Array, speed: Array, forward: Array, gravity: Array, p: Any) -> Array:
        states = np.empty((len(x), len(angle)))
        states[:, 0] = x
        h = STEP_S / PARTS
        for k in range(len(angle) - 1):
            rate = (angle[k + 1] - angle[k]) / STEP_S
            for part in range(PARTS):
                a0 = angle[k] + rate * part * h
                a1, a2 = a0 + rate * 0.5 * h, a0 + rate * h
                pushed = forward[k] + SPEED_1_S * (speed[k] - x[SPEED])
                k1 = derivative(x, a0, rate, pushed, gravity[k], p)
                k2 = derivative(x + 0.5 * h * k1, a1, rate, pushed, gravity[k], p)
                k3 = derivative(x + 0.5 * h * k2, a1, rate, pushed, gravity[k], p)
                k4 = derivative(x + h * k3, a2, rate, pushed, gravity[k], p)
                x = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            states[:, k + 1] = x
        return states

    return run


def _copy(function: Any, names: dict[str, Any]) -> Any:
    return FunctionType(function.__code__, {"math": math, "__builtins__": __builtins__} | names, function.__name__)


def _as_tuple(p: Any) -> Any:
    """The numbers of the parameters, as a type that can be compiled."""
    values = {name: value for name, value in vars(p).items() if isinstance(value, int | float)}
    parts = {name: _as_tuple(getattr(p, name)) for name in ("tire", "steering", "longitudinal") if hasattr(p, name)}
    values = {name: float(value) for name, value in values.items()} | parts
    return _tuple_type(tuple(values))(**values)


@cache
def _tuple_type(names: tuple[str, ...]) -> Any:
    return namedtuple("Parameters", names)
