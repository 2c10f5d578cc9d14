"""Driver, steering, truck and road in one call into the native loop. Alone touches native memory."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from oncenter._simulate import ffi, lib
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.simulate.driver import native_driver
from oncenter.simulate.road import SPACING_M, LaidRoad
from oncenter.simulate.scenario import Scenario
from oncenter.simulate.steering import native_steering
from oncenter.simulate.truck import native_truck

Array = npt.NDArray[np.float64]

RATE_HZ = 100.0
_STEPS_PER_TICK = 4  # 2.5 ms: the stiffest mode, yaw and side slip at 2 m/s, is 40 1/s
_OFF_THE_ROAD_M = 8.0  # from the lane's middle

ROW_DTYPE = np.dtype([(name, np.float64) for name, _ in ffi.typeof("sim_row").fields])
assert ROW_DTYPE.itemsize == ffi.sizeof("sim_row")  # doubles only, as the header promises


def tick_count(scenario: Scenario) -> int:
    return round(scenario.drive.duration_s * RATE_HZ)


def run(scenario: Scenario, road: LaidRoad, lane_normals: Array, hand_normals: Array) -> npt.NDArray[np.void]:
    """Drives the whole scenario.

    Args:
        scenario: the truck, its steering and its driver.
        road: at least as long as the drive.
        lane_normals: standard normal numbers, one a tick: where in the lane the driver means to be.
        hand_normals: as many: the hands' small corrections.

    Returns:
        `ROW_DTYPE`, one a tick at `RATE_HZ` from time 0: what is true, in SI and rad, as `sim_row` in native/drive.h.

    Raises:
        OncenterError: "scenario_file", exit code 2: this driver cannot hold this truck on this road.
    """
    columns = [np.ascontiguousarray(c, np.float64) for c in (road.curvature_1_m, road.cross_slope, road.speed_m_s)]
    curvature, cross_slope, speed = (ffi.from_buffer("double[]", column) for column in columns)
    drive = ffi.new("sim_drive *")
    drive.truck = native_truck(scenario.truck, scenario.steering)[0]
    drive.steering = native_steering(scenario.steering)[0]
    drive.driver = native_driver(scenario, 1.0 / RATE_HZ)[0]
    drive.road = {
        "count": len(columns[0]),
        "spacing": SPACING_M,
        "curvature": curvature,
        "cross_slope": cross_slope,
        "speed": speed,
    }
    drive.tick = 1.0 / RATE_HZ
    drive.steps_per_tick = _STEPS_PER_TICK

    normals = [np.ascontiguousarray(c, np.float64) for c in (lane_normals, hand_normals)]
    rows = np.empty(len(normals[0]), ROW_DTYPE)
    lib.sim_run(
        drive,
        ffi.from_buffer("double[]", normals[0]),
        ffi.from_buffer("double[]", normals[1]),
        len(rows),
        ffi.from_buffer("sim_row[]", rows),
    )
    _check_held(scenario, rows)
    return rows


def _check_held(scenario: Scenario, rows: npt.NDArray[np.void]) -> None:
    held = np.abs(rows["lateral_error"]) < _OFF_THE_ROAD_M  # false for NaN as well
    if held.all():
        return
    raise OncenterError(
        f"scenario {scenario.name}: the truck leaves the road after {rows['time'][np.argmin(held)]:.1f} s; a lower "
        "'driver.preview_gain', 'steering.backlash_deg' or 'driver.speed_km_h', or another 'truck', would hold it",
        code="scenario_file",
        exit_code=WRONG_USAGE,
    )
