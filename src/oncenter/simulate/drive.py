"""Runs driver, steering, truck and road in the native loop. The only module of simulate that uses native memory."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from oncenter._native import ffi, lib
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.signals import DEGREE
from oncenter.simulate.driver import native_driver
from oncenter.simulate.interventions import brake_moment_n_m, braked_m_s2, within
from oncenter.simulate.manoeuvre import check_fits, machine_angles_rad
from oncenter.simulate.road import LaidRoad
from oncenter.simulate.scenario import Scenario
from oncenter.simulate.steering import native_steering, resting_torque_n_m
from oncenter.simulate.truck import axle_lift, load_changed, load_changes, native_truck, rear_steer_share
from oncenter.simulate.wind import native_wind

Array = npt.NDArray[np.float64]

RATE_HZ = 100.0
_STEPS_PER_TICK = 4  # 2.5 ms: the stiffest mode, yaw and side slip at 2 m/s, is 40 1/s
_OFF_THE_ROAD_M = 8.0  # from the middle of the lane
_TIPS_OVER_M_S2 = 7.0  # tractor without trailer; trucks with a higher centre of gravity tip over earlier

ROW_DTYPE = np.dtype([(name, np.float64) for name, _ in ffi.typeof("sim_row").fields])
assert ROW_DTYPE.itemsize == ffi.sizeof("sim_row")  # doubles only, as the header promises


def tick_count(scenario: Scenario) -> int:
    return round(scenario.drive.duration_s * RATE_HZ)


def run(
    scenario: Scenario,
    road: LaidRoad,
    lane_normals: Array,
    hand_normals: Array,
    gust_normals: Array | None = None,
    bump_normals: Array | None = None,
) -> npt.NDArray[np.void]:
    """Simulates the whole scenario.

    Args:
        scenario: the truck, its steering and its driver.
        road: from `lay_road`, or mirrored.
        lane_normals: standard normal numbers, one per tick: the driver's intended lateral position.
        hand_normals: one per tick: small corrections of the hands.
        gust_normals: one per tick: gusts; needed for a scenario with wind.
        bump_normals: one per tick: spring travel; needed for a scenario with bump steer.

    Returns:
        `ROW_DTYPE`, one row per tick at `RATE_HZ` from time 0: true values in SI and rad, as `sim_row` in
        native/drive.h.

    Raises:
        OncenterError: "scenario_file", exit code 2: this driver cannot hold this truck on this road, or the road is
            shorter than the drive.
    """
    lent = _Lent()
    drive = _native_drive(scenario, road, lent)
    inputs = ffi.new("sim_inputs *", {"lane_normals": lent(lane_normals), "hand_normals": lent(hand_normals)})
    time_s = np.arange(len(lane_normals) + 1) / RATE_HZ
    if scenario.wind is not None:
        assert gust_normals is not None
        inputs.gust_normals = lent(gust_normals)
    if scenario.steering.bump_steer_sd_deg > 0.0:
        assert bump_normals is not None
        inputs.bump_normals = lent(bump_normals)
    if scenario.truck.lift_axle_up_s:
        inputs.second_truck = lent(axle_lift(scenario.truck, time_s))
    elif scenario.truck.load_change is not None:
        inputs.second_truck = lent(load_changes(scenario.truck, time_s))
    if scenario.steering.carries_s:
        inputs.motor_carries = lent(within(scenario.steering.carries_s, time_s))
    if (motor := scenario.steering.overlay_motor) is not None and motor.resting_torque_n_m != 0.0:
        inputs.resting_torque = lent(resting_torque_n_m(motor, time_s))
    if scenario.interventions:
        inputs.brake_moment = lent(brake_moment_n_m(scenario.interventions, time_s))
        inputs.braked = lent(braked_m_s2(scenario.interventions, time_s))
    if scenario.drive.reverse_s:
        inputs.reverses = lent(within(scenario.drive.reverse_s, time_s))
    if scenario.manoeuvre is not None:
        check_fits(scenario, scenario.manoeuvre)
        inputs.machine_angles = lent(machine_angles_rad(scenario.manoeuvre, time_s))

    rows = np.empty(len(lane_normals), ROW_DTYPE)
    lib.sim_run(drive, inputs, len(rows), ffi.from_buffer("sim_row[]", rows))
    _check_held(scenario, rows)
    _check_upright(scenario, rows)
    _check_long_enough(scenario, road, rows)
    return rows


class _Lent:
    """Keeps columns alive while native memory points into them."""

    def __init__(self) -> None:
        self._kept: list[Array] = []

    def __call__(self, column: Array) -> Any:
        self._kept.append(np.ascontiguousarray(column, np.float64))
        return ffi.from_buffer("double[]", self._kept[-1])


def _native_drive(scenario: Scenario, road: LaidRoad, lent: _Lent) -> Any:
    """Everything that is constant over the drive, as a `sim_drive`."""
    drive = ffi.new("sim_drive *")
    drive.truck = native_truck(scenario.truck, scenario.steering)[0]
    drive.steering = native_steering(scenario.steering, scenario.truck)[0]
    drive.driver = native_driver(scenario, 1.0 / RATE_HZ)[0]
    standing_s = np.asarray(scenario.drive.all_standing_s)
    drive.driver.standing_count = len(standing_s)
    drive.driver.standing_begin, drive.driver.standing_end = lent(standing_s[:, 0]), lent(standing_s[:, 1])
    drive.road = {
        "count": len(road.curvature_1_m),
        "spacing": road.spacing_m,
        "curvature": lent(road.curvature_1_m),
        "cross_slope": lent(road.cross_slope),
        "speed": lent(road.speed_m_s),
        "exposure": ffi.NULL if road.exposure is None else lent(road.exposure),
        "patch": ffi.NULL if road.patch is None else lent(road.patch),
        "stop_count": len(road.stop_station_m),
        "stop_station": lent(road.stop_station_m),
        "stop_duration": lent(road.stop_duration_s),
    }
    if scenario.road.patches is not None:
        drive.patch_front = scenario.road.patches.front_stiffness_percent / 100.0
        drive.patch_rear = scenario.road.patches.rear_stiffness_percent / 100.0
    drive.bump_steer = scenario.steering.bump_steer_sd_deg * DEGREE
    drive.bump_steer_keep = math.exp(-1.0 / (RATE_HZ * scenario.steering.bump_steer_time_s))
    drive.start_heading = (90.0 - scenario.road.heading_deg) * DEGREE
    drive.tick = 1.0 / RATE_HZ
    drive.steps_per_tick = _STEPS_PER_TICK
    if scenario.wind is not None:
        drive.wind = native_wind(scenario.wind, 1.0 / RATE_HZ)[0]
    if scenario.steering.overlay_motor is not None:
        drive.motor_dead_band = scenario.steering.overlay_motor.dead_band_deg * DEGREE
    if scenario.truck.rear_steering is not None:
        drive.rear_share = rear_steer_share(scenario.truck)
        drive.rear_locks_speed = (scenario.truck.rear_steering.locks_above_km_h or 0.0) / 3.6
    if scenario.truck.lift_axle_up_s:
        drive.second = native_truck(scenario.truck, scenario.steering, lifted=True)[0]
    elif scenario.truck.load_change is not None:
        drive.second = native_truck(load_changed(scenario.truck), scenario.steering)[0]
    return drive


def _check_upright(scenario: Scenario, rows: npt.NDArray[np.void]) -> None:
    over = np.abs(rows["lateral_acceleration"]) > _TIPS_OVER_M_S2
    if not over.any():
        return
    raise OncenterError(
        f"scenario {scenario.name}: the truck tips over after {rows['time'][np.argmax(over)]:.1f} s, at a lateral "
        f"acceleration above {_TIPS_OVER_M_S2:g} m/s^2; reduce 'driver.speed_km_h', or give a gentler 'road' or "
        "'manoeuvre'",
        code="scenario_file",
        exit_code=WRONG_USAGE,
    )


def _check_held(scenario: Scenario, rows: npt.NDArray[np.void]) -> None:
    if scenario.manoeuvre is not None and np.isfinite(rows["yaw_rate"]).all():
        return  # there is no lane to leave
    held = np.abs(rows["lateral_error"]) < _OFF_THE_ROAD_M  # false for NaN as well
    if held.all():
        return
    raise OncenterError(
        f"scenario {scenario.name}: the truck leaves the road after {rows['time'][np.argmin(held)]:.1f} s; reduce "
        "'driver.preview_gain', 'steering.backlash_deg' or 'driver.speed_km_h', or change 'truck'",
        code="scenario_file",
        exit_code=WRONG_USAGE,
    )


def _check_long_enough(scenario: Scenario, road: LaidRoad, rows: npt.NDArray[np.void]) -> None:
    on_road = rows["station"] <= road.length_m
    if on_road.all():
        return
    raise OncenterError(
        f"scenario {scenario.name}: 'road' is shorter than the drive: its {road.length_m:g} m end after "
        f"{rows['time'][np.argmin(on_road)]:.1f} s; reduce 'drive.duration_s' or give a longer road",
        code="scenario_file",
        exit_code=WRONG_USAGE,
    )
