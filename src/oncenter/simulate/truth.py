"""What was true in a simulated drive, and the two files that say so."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import polars as pl

from oncenter.signals import DEGREE
from oncenter.simulate.scenario import Scenario
from oncenter.simulate.truck import understeer_gradient

_COLUMNS = {
    "time_s": "time",
    "steering_wheel_angle_rad": "steering_wheel_angle",
    "place_in_play": "place_in_play",
    "front_wheel_angle_rad": "front_wheel_angle",
    "yaw_rate_rad_s": "yaw_rate",
    "vehicle_speed_m_s": "vehicle_speed",
    "lateral_speed_m_s": "lateral_speed",
    "lateral_acceleration_m_s2": "lateral_acceleration",
    "longitudinal_acceleration_m_s2": "longitudinal_acceleration",
    "front_side_force_n": "front_force",
    "aligning_moment_nm": "aligning_moment",
    "road_curvature_1_m": "curvature",
    "road_cross_slope": "cross_slope",
    "station_m": "station",
    "lateral_error_m": "lateral_error",
}


@dataclass(frozen=True)
class Truth:
    """What an estimator would have to find.

    Attributes:
        scenario: its name.
        seed: of its chances.
        offset_rad: of the steering wheel angle sensor: measured less offset is true.
        understeer_gradient: K_us/g of (10) at the road wheel, steering compliance included, rad/(m/s^2).
        backlash_rad: full width of the play, at the steering wheel.
        yaw_rate_bias_rad_s: of the yaw rate sensor.
        lateral_acceleration_bias_m_s2: of the accelerometer.
        table: one row a tick at 100 Hz, units as the columns say: `time_s`, `steering_wheel_angle_rad` (at the wheel,
            without offset), `place_in_play` (-1 to 1), `front_wheel_angle_rad` (as the steering sets the wheels,
            without what gives way under side force), the motion of the centre of gravity without any sensor, and the
            road (`road_cross_slope` is the sine of the bank, positive where the road falls to the right).
    """

    scenario: str
    seed: int
    offset_rad: float
    understeer_gradient: float
    backlash_rad: float
    yaw_rate_bias_rad_s: float
    lateral_acceleration_bias_m_s2: float
    table: pl.DataFrame


def truth_of(scenario: Scenario, seed: int, rows: npt.NDArray[np.void]) -> Truth:
    sensors = scenario.sensors
    return Truth(
        scenario=scenario.name,
        seed=seed,
        offset_rad=sensors.steering_wheel_angle.offset_deg * DEGREE,
        understeer_gradient=understeer_gradient(scenario.truck, scenario.steering),
        backlash_rad=scenario.steering.backlash_deg * DEGREE,
        yaw_rate_bias_rad_s=sensors.yaw_rate.bias_deg_s * DEGREE,
        lateral_acceleration_bias_m_s2=sensors.lateral_acceleration.bias_m_s2,
        table=pl.DataFrame({column: np.ascontiguousarray(rows[field]) for column, field in _COLUMNS.items()}),
    )


def write_truth(truth: Truth, log: Path) -> None:
    """Writes `drive.truth.parquet` and `drive.truth.toml` beside `drive.log`; angles in the latter in degrees."""
    truth.table.write_parquet(log.with_suffix(".truth.parquet"))
    values = {
        "offset_deg": truth.offset_rad / DEGREE,
        "understeer_gradient_deg_m_s2": truth.understeer_gradient / DEGREE,
        "backlash_deg": truth.backlash_rad / DEGREE,
        "yaw_rate_bias_deg_s": truth.yaw_rate_bias_rad_s / DEGREE,
        "lateral_acceleration_bias_m_s2": truth.lateral_acceleration_bias_m_s2,
    }
    lines = [f"scenario = {json.dumps(truth.scenario)}", f"seed = {truth.seed}"]
    lines += [f"{name} = {float(f'{value:.9g}')!r}" for name, value in values.items()]
    log.with_suffix(".truth.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
