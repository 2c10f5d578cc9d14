"""The steering wheel angle without its sensor: one run of the core, as a table.

SI and rad. The truck's quantities are estimated while the sensor works; after that the angle is estimated from yaw
rate, lateral acceleration and speeds. The sensor is checked all the time.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from oncenter import _core
from oncenter.angle.from_truck import known_by, teach
from oncenter.angle.lateral_force import lateral_force_notes, uses_yaw_rate
from oncenter.angle.side_slip import with_lateral_speed
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.findings import Finding
from oncenter.offset.assemble import notes_of
from oncenter.offset.inputs import (
    check_without,
    params_of,
    without_contradicted_statuses,
    without_unfit_wheels,
)
from oncenter.offset.rear_axle import WEIGHT as REAR_WEIGHT
from oncenter.offset.traffic_side import with_traffic_side
from oncenter.read.whole_turns import without_whole_turns
from oncenter.signals import DEGREE, Signals, drives_of
from oncenter.truck.events import Event
from oncenter.truck.row import Row
from oncenter.vehicle import Vehicle, core_of, vehicle_of

if TYPE_CHECKING:
    import polars as pl

Method = Literal["observer", "wheel-speed", "wheel-speed-exact", "yaw-rate", "yaw-rate-understeer", "side-slip"]
METHODS: tuple[Method, ...] = get_args(Method)

_MEASURED = "steering_wheel_angle_rad"
_FRONT_WHEELS = ("wheel_speed_front_left", "wheel_speed_front_right")


def angle(
    signals: Signals,
    vehicle: Vehicle | str | os.PathLike[str],
    *,
    sensor_lost_at: float | None = None,
    method: Method = "observer",
    taught_by: Sequence[Signals] = (),
    before: Sequence[Row] = (),
    events: Sequence[Event] = (),
    params: Mapping[str, float] | None = None,
    smooth: bool = False,
    progress: Callable[[float], None] | None = None,
) -> pl.DataFrame:
    """The true steering wheel angle of a drive, from its sensor while that is valid and without it after.

    Args:
        signals: from `oncenter.read` or `oncenter.simulate`. A drive without any angle gets the Ackermann angle, with a
            wide interval.
        vehicle: from `oncenter.vehicle`, or the path of its file; its `[params]` apply.
        sensor_lost_at: s after the drive's first row and before its last; the sensor is ignored from then on.
        method: "observer", the single-track model (13) run backward; or the thesis's: "wheel-speed" (3) and (21),
            "wheel-speed-exact" (2), "yaw-rate" L*r/v, "yaw-rate-understeer" (22) and (31), "side-slip" (23) and (24) by
            GNSS, whose front tyre slip is estimated while there is a sensor. Where most of the time with a sensor has
            no lateral acceleration, yaw rate times speed replaces it, as with `use_accelerometer = 0`.
        taught_by: drives of the same truck before this one, with their sensor.
        before: `Answer.rows` of the truck's former drives: what they say of it holds until this drive shows more.
        events: what a person states of the truck, see `oncenter.truck.events`.
        params: override the vehicle's; names and units as in core/truck/params.h.
        smooth: use later ticks as well, by a Kalman smoother over the whole drive; not possible in a moving truck.
        progress: called with the fraction done.

    Returns:
        One row per row of the drive: `time_s`, `steering_wheel_angle_rad` (the true angle: measured less offset),
        `steering_wheel_angle_rate_rad_s`, `standard_deviation_rad`, `status`, `delay_s` (of an estimated angle, which
        the standard deviation contains), `estimate_rad` (from the motion alone),
        `sensor_fault` ("none", "lost", "stuck", "jumped", "drifting", "wrong_sign", "remounted") with
        `sensor_fault_since_s` and `sensor_fault_confidence`, and, where the drive has it, `measured_rad`, the reading
        of the sensor, also after `sensor_lost_at`.

    Raises:
        OncenterError: "missing_signal" (exit 1); "method", "params", "sensor_lost_at", "track_width" (exit 2).
    """
    vehicle = vehicle_of(vehicle, "angle")
    _check(signals, vehicle, method, sensor_lost_at)
    vehicle, _, _ = with_traffic_side(vehicle, (signals, *taught_by), before, events)
    (signals, *taught_by), unfit = without_unfit_wheels(
        without_contradicted_statuses((signals, *taught_by))[0], vehicle
    )
    if method.startswith("wheel-speed"):
        check_without(unfit, (signals,), _FRONT_WHEELS, vehicle)
    if uses_yaw_rate(signals, taught_by, sensor_lost_at):
        params = {"use_accelerometer": 0.0, **(params or {})}
    used = params_of(vehicle, params)
    params = {**known_by(before, events, used), **(params or {})}
    core = core_of(vehicle, signals.rate_hz, angle_method=method, params=params)
    if method == "side-slip":
        signals, taught_by = with_lateral_speed(signals), [with_lateral_speed(drive) for drive in taught_by]
    for drive in without_whole_turns(tuple(taught_by)):
        core.run(_columns(drive))
        core.restart()
    teach(core, before, events, vehicle, used)
    (drive,) = without_whole_turns((signals,))
    columns = _without_sensor(_columns(drive), sensor_lost_at)
    outputs = np.zeros(len(columns["time_s"]), _core.OUTPUT_DTYPE)
    core.run(columns, outputs)
    if progress is not None:
        progress(1.0)
    values, rates = outputs["angle"]["angle"], outputs["angle"]["rate"]
    if smooth:
        values, rates = core.smoothed(outputs)
        outputs["angle"]["delay"] = 0.0  # the smoother removed it
    original = signals.columns.get(_MEASURED)
    return _table(columns["time_s"], outputs, values, rates, original)


def _without_sensor(
    columns: dict[str, npt.NDArray[np.float64]], from_s: float | None
) -> dict[str, npt.NDArray[np.float64]]:
    """The columns with the sensor lost `from_s` s after the first row."""
    if from_s is None or _MEASURED not in columns:
        return columns
    lost = columns["time_s"] >= columns["time_s"][0] + from_s
    return columns | {_MEASURED: np.where(lost, np.nan, columns[_MEASURED])}


def in_degrees(table: pl.DataFrame) -> pl.DataFrame:
    """The table in the units of files: `_deg` for `_rad`."""
    import polars as pl

    return table.select(
        (pl.col(name) / DEGREE).alias(name.replace("rad", "deg")) if "_rad" in name else pl.col(name)
        for name in table.columns
    )


def findings_on(signals: Signals, vehicle: Vehicle, taught_by: Sequence[Signals]) -> tuple[Finding, ...]:
    """The warnings about wheel speeds and statuses that are not used, and about a side of traffic that is not."""
    drives, contradicted = without_contradicted_statuses((signals, *taught_by))
    of_side = with_traffic_side(vehicle, drives)[1]
    return (*of_side, *contradicted, *without_unfit_wheels(drives, vehicle)[1])


def notes_on(
    signals: Signals, vehicle: Vehicle, taught_by: Sequence[Signals], sensor_lost_at: float | None
) -> tuple[str, ...]:
    """Notes on how the drives were read and on missing signals."""
    read = notes_of(without_whole_turns((*taught_by, signals)))
    steers = vehicle.params.get(REAR_WEIGHT, 0.0) > 0.0
    rear = ("a rear axle steers: the angle without its sensor is not available for this truck",) if steers else ()
    return (*read, *rear, *lateral_force_notes(signals, vehicle, taught_by, sensor_lost_at))


def _check(signals: Signals, vehicle: Vehicle, method: str, sensor_lost_at: float | None) -> None:
    from oncenter.read import require

    if method not in METHODS:
        raise OncenterError(
            f"method '{method}' does not exist; use one of {', '.join(METHODS)}", code="method", exit_code=WRONG_USAGE
        )
    drives_of(signals, "angle")
    if sensor_lost_at is not None:
        _check_within(signals, sensor_lost_at)
    needed: tuple[str, ...] = ("yaw_rate", "vehicle_speed")
    if method.startswith("wheel-speed"):
        needed = (*needed, *_FRONT_WHEELS)
        if vehicle.track_width_front_m is None:
            raise OncenterError(
                f"method '{method}' needs 'track_width_front_m' in the vehicle file",
                code="track_width",
                exit_code=WRONG_USAGE,
                needs=("track_width_front_m",),
            )
    require(signals, needed, vehicle)


def _check_within(signals: Signals, sensor_lost_at: float) -> None:
    """A loss after the drive's end would have no effect, silently."""
    length_s = signals.duration_s
    if math.isfinite(sensor_lost_at) and 0.0 <= sensor_lost_at <= length_s:
        return
    raise OncenterError(
        f"'sensor_lost_at' must be 0 to {length_s:.1f} s after the begin of {Path(signals.log).name}, got "
        f"{sensor_lost_at:g}",
        code="sensor_lost_at",
        exit_code=WRONG_USAGE,
    )


def _columns(drive: Signals) -> dict[str, npt.NDArray[np.float64]]:
    return {name: drive.columns[name] for name in _core.COLUMNS if name in drive.columns}


def _table(
    time: npt.NDArray[np.float64],
    outputs: npt.NDArray[np.void],
    values: npt.NDArray[np.float64],
    rates: npt.NDArray[np.float64],
    measured: npt.NDArray[np.float64] | None,
) -> pl.DataFrame:
    import polars as pl

    found = outputs["fault"] != 0
    columns: dict[str, Any] = {
        "time_s": time,
        _MEASURED: np.ascontiguousarray(values),
        "steering_wheel_angle_rate_rad_s": np.ascontiguousarray(rates),
        "standard_deviation_rad": np.ascontiguousarray(outputs["angle"]["standard_deviation"]),
        "status": np.asarray(_core.STATUSES, dtype=object)[outputs["angle"]["status"]],
        "delay_s": np.ascontiguousarray(outputs["angle"]["delay"]),
        "estimate_rad": np.ascontiguousarray(outputs["angle"]["estimate"]),
        "sensor_fault": np.asarray(_core.FAULTS, dtype=object)[outputs["fault"]],
        "sensor_fault_since_s": np.where(found, outputs["fault_since"], np.nan),
        "sensor_fault_confidence": np.where(found, outputs["fault_confidence"], np.nan),
    }
    if measured is not None:
        columns["measured_rad"] = measured
    text = {"status": pl.Utf8, "sensor_fault": pl.Utf8}
    return pl.DataFrame(columns, schema_overrides=text)
