"""Simulated drives for the hypothesis set, with tuning seeds: 15 minutes of the thesis drive with other trucks, sensors
and roads."""

import functools
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from oncenter import _core
from oncenter.simulate import Truth, simulate

Array = npt.NDArray[np.float64]
Columns = dict[str, Array]

RATE_HZ = 100.0
DURATION_S = 900.0
ANGLE, YAW_RATE = "steering_wheel_angle_rad", "yaw_rate_rad_s"
MIRRORED = (ANGLE, YAW_RATE, "lateral_acceleration_m_s2")

CREEPING = "[steering]\nbacklash_deg = 8.0\n"
RUBBING = "[steering]\nbacklash_deg = 8.0\nking_pin_friction_n_m = 300.0\n"
TIGHT = "[steering]\nbacklash_deg = 0.0\n"
LIFTED = 'base = "lift_axle"\n[truck]\nlift_axle_up_s = [[450.0, 900.0]]\n'


def accelerometer_bias(m_s2: float) -> str:
    return f"[sensors.lateral_acceleration]\nbias_m_s2 = {m_s2}\n"


@functools.lru_cache(maxsize=8)  # some 50 MB each
def driven(tables: str = "", seed: int = 1, duration_s: float = DURATION_S) -> tuple[Columns, Truth]:
    """`tables` of TOML over the thesis drive, or over the base that they name."""
    base = "" if tables.startswith("base") else 'base = "thesis_drive"\n'
    first, bracket, rest = tables.partition("[")
    text = f'about = "A drive of the tests."\n{base}{first}[drive]\nduration_s = {duration_s}\n{bracket}{rest}'
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "drive.toml"
        file.write_text(text, encoding="utf-8")
        signals, truth = simulate(file, seed)
    columns = {name: signals.table[name].to_numpy() for name in _core.COLUMNS if name in signals.table.columns}
    return columns, truth


def core_for(
    truth: Truth,
    *,
    rate_hz: float = RATE_HZ,
    traffic_side: float = 1.0,
    method: str = "joint",
    angle_method: str = "observer",
    params: dict[str, float] | None = None,
) -> _core.Core:
    return _core.Core(
        truth.equivalent_wheelbase_m,
        truth.steering_ratio,
        params or {},
        rate_hz,
        track_width_front_m=2.05,
        track_width_rear_m=1.83,
        traffic_side=traffic_side,
        method=method,
        angle_method=angle_method,
    )


def ran(columns: Columns, core: _core.Core) -> npt.NDArray[np.void]:
    outputs = np.zeros(len(columns["time_s"]), _core.OUTPUT_DTYPE)
    core.run(columns, outputs)
    return outputs


def answer_of(columns: Columns, truth: Truth, **kind: Any) -> dict[str, Any]:
    core = core_for(truth, **kind)
    core.run(columns)
    return core.answer()


def status(estimate: dict[str, Any]) -> str:
    return _core.STATUSES[estimate["status"]]


def holds(estimate: dict[str, Any], truth: float) -> bool:
    return bool(abs(estimate["value"] - truth) <= 1.96 * estimate["standard_deviation"])


def state_of(core: _core.Core) -> Any:
    return core.state()


def numbers(values: Any) -> list[float]:
    """All of a struct as one flat list."""
    if isinstance(values, np.void):
        return [number for name in values.dtype.names for number in numbers(values[name])]
    return [number for value in values for number in numbers(value)] if np.ndim(values) else [float(values)]
