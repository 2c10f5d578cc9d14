"""Healthy drives on disk: one truck on three roads, each with its own offset, for faults of the file or of a sensor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl

import oncenter as oc
from oncenter.signals import DEGREE, Signals
from oncenter.simulate.truth import Truth

Array = npt.NDArray[np.float64]

TRUCK = "scania_r730_4x2"  # of the scenarios
WHEELBASE_M, STEERING_RATIO = 3.7, 19.3
ROADS = ("thesis_drive", "motorway", "heavy_play")
_HEAVY_PLAY_DEG = 10.0  # the scenario's 15 deg are the maintenance limit: "worn" would be true
ANGLE, YAW_RATE, SPEED = "steering_wheel_angle_rad", "yaw_rate_rad_s", "vehicle_speed_m_s"
LATERAL, LONGITUDINAL, TORQUE = (
    "lateral_acceleration_m_s2",
    "longitudinal_acceleration_m_s2",
    "steering_wheel_torque_nm",
)
WHEELS = tuple(f"wheel_speed_{corner}_m_s" for corner in ("front_left", "front_right", "rear_left", "rear_right"))
SENSOR_TYPE = "steering_wheel_angle_sensor_type"
_OFFSET_MAX_DEG, _YAW_RATE_BIAS_MAX_DEG_S = 6.0, 0.2


@dataclass(frozen=True)
class HealthyDrive:
    """A drive without a fault, its truth, and the torque (N m), which its table lacks. Every second one has no wheel
    speeds."""

    seed: int
    road: str
    signals: Signals
    truth: Truth
    torque_n_m: Array

    @property
    def columns(self) -> dict[str, Array]:
        """A copy of the columns of the table, which may be changed."""
        return {name: values.copy() for name, values in self.signals.columns.items()}

    @property
    def offset_deg(self) -> float:
        """The offset to be found; none of the roads has a truck that pulls."""
        return (self.truth.offset_rad + self.truth.straight_ahead_rad) / DEGREE


def healthy_drive(seed: int, folder: Path, *, minutes: float = 20.0) -> HealthyDrive:
    """The drive with that seed, on the roads in turn. `folder` is for a temporary scenario file."""
    random = np.random.default_rng([seed, 54])
    road = ROADS[seed % len(ROADS)]
    play = f"[steering]\nbacklash_deg = {_HEAVY_PLAY_DEG}\n" if road == "heavy_play" else ""
    file = folder / f"{road}_{seed}.toml"
    file.write_text(
        f'base = "{road}"\n[drive]\nduration_s = {60.0 * minutes}\n'
        f"[sensors.steering_wheel_angle]\noffset_deg = {random.uniform(-_OFFSET_MAX_DEG, _OFFSET_MAX_DEG):.3f}\n"
        "[sensors.yaw_rate]\n"
        f"bias_deg_s = {random.uniform(-_YAW_RATE_BIAS_MAX_DEG_S, _YAW_RATE_BIAS_MAX_DEG_S):.3f}\n"
        f"[sensors.steering_wheel_torque]\n{play}",
        encoding="utf-8",
    )
    signals, truth = oc.simulate(file, seed)
    has_wheels = (seed // len(ROADS)) % 2 == 0
    torque = signals.table[TORQUE].to_numpy()
    return HealthyDrive(seed, road, _without(signals, [TORQUE, *(() if has_wheels else WHEELS)]), truth, torque)


def _without(signals: Signals, columns: list[str]) -> Signals:
    kept = {name: source for name, source in signals.sources.items() if not any(c.startswith(name) for c in columns)}
    return replace(signals, table=signals.table.drop(columns), sources=kept)


def written(columns: Mapping[str, Array], log: Path, **more: Any) -> Path:
    """The columns as a table, Parquet or CSV by the name of the log; `more` are columns with one value."""
    table = pl.DataFrame(dict(columns)).with_columns(**{name: pl.lit(value) for name, value in more.items()})
    if log.suffix == ".parquet":
        table.write_parquet(log)
    else:
        table.write_csv(log)
    return log
