"""The true values of a simulated drive, and the two files that contain them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import polars as pl

from oncenter.files.file_name import printable
from oncenter.files.own_file import metadata
from oncenter.files.toml_text import entry
from oncenter.files.whole_file import whole_file, write_whole
from oncenter.signals import DEGREE
from oncenter.simulate.scenario import Scenario
from oncenter.simulate.sensors import Fault, Sensed
from oncenter.simulate.sensors.status import true_statuses
from oncenter.simulate.steering import straight_ahead_rad, unloading_acceleration_m_s2
from oncenter.simulate.truck import (
    equivalent_wheelbase_m,
    load_changed,
    on_patch,
    rear_steer_weight,
    understeer_gradient,
)

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
    "east_m": "east",
    "north_m": "north",
    "heading_rad": "heading",
    "wind_side_force_n": "wind_force",
    "felt_lateral_acceleration_m_s2": "felt_lateral_acceleration",
    "roll_rad": "roll",
    "place_in_windup": "place_in_windup",
    "articulation_rad": "articulation",
    "axle_lift": "second_truck",
}
# The other two statuses are `motor_carries` and, from half of the way up, `axle_lift`.
_STATUS_COLUMNS = ("stability_control_active", "anti_lock_active", "reverse")
_MOTOR_COLUMNS = {"place_in_lash": "place_in_lash", "motor_carries": "motor_carries"}

SCHEMA = "oncenter/truth-1"  # of the summary
_UNITS_IN_FILES = {
    "rad": ("deg", DEGREE),
    "rad_s": ("deg_s", DEGREE),
    "m_s2": ("m_s2", 1.0),
    "n_m": ("n_m", 1.0),
    "1": ("percent", 0.01),
}


@dataclass(frozen=True)
class Truth:
    """The true values that an estimator should find.

    Attributes:
        scenario: its name.
        seed: of its random numbers.
        offset_rad: of the steering wheel angle sensor at the end of the drive: measured less true angle, without the
            whole turns of a relative sensor.
        understeer_gradient: K_us/g of (10) at the road wheel, compliance and roll steer included, rad/(m/s^2).
        equivalent_wheelbase_m: L of (10), Winkler's; equal to the wheelbase for two axles with single tyres.
        lifted_understeer_gradient: K_us/g while the lift axle is up, rad/(m/s^2); None if it never is.
        lifted_equivalent_wheelbase_m: L of (10) while the lift axle is up; None if it never is.
        load_changed_understeer_gradient: K_us/g after the load change, rad/(m/s^2); None without one.
        load_changed_equivalent_wheelbase_m: L of (10) after the load change; None without one.
        patch_understeer_gradient: K_us/g on road patches, with the initial load, rad/(m/s^2); None without patches.
        rear_steer_weight: the curvature is (front - this times rear) / L_e, both road wheel angles, with L_e and K_us/g
            of the locked rear axle; None if it is not steered.
        rear_axle_offset_rad: of the rear axle's angle sensor: measured less true angle; None without one.
        steering_ratio: near the centre, in left turns.
        backlash_rad: full width of the play at the steering wheel while the driver steers: of the gear and, with an
            overlay motor, of the lash in the column.
        windup_rad: full width of the column's twist against friction, which looks like play.
        torsion_bar_rad: full width of the torsion bar's twist, which looks like play if its half moment is small.
        unloading_acceleration_m_s2: neutral lateral acceleration, with zero king-pin moment; NaN without one.
        straight_ahead_rad: true steering wheel angle for driving straight without lateral acceleration, at mid-play and
            without column twist, at the end of the drive: 0, except for wheel alignment and the ride height after a
            load change. The sensor then reads this plus `offset_rad`.
        yaw_rate_bias_rad_s: of the yaw rate sensor at the end of the drive.
        lateral_acceleration_bias_m_s2: of the accelerometer at the end of the drive.
        faults: all sensor faults, in order of time.
        table: one row per tick at 100 Hz, units in the column names: `time_s`, `steering_wheel_angle_rad` (without
            offset), `place_in_play` (-1 to 1), `front_wheel_angle_rad` (set by the steering, without compliance under
            lateral force), the true motion of the centre of gravity, and the road (`road_cross_slope` is the sine of
            the bank, positive for a road that falls to the right). Further columns: the path of the centre of gravity
            from the start (`east_m`, `north_m`), `heading_rad` (counter-clockwise from east, not wrapped),
            `wind_side_force_n` (left positive), `lateral_error_m` (NaN without a lane). Sensor errors at every tick:
            `steering_wheel_angle_offset_rad` (whole turns included), `yaw_rate_bias_rad_s`,
            `lateral_acceleration_bias_m_s2`, `longitudinal_acceleration_bias_m_s2`. An ideal accelerometer on the
            rolling body measures `felt_lateral_acceleration_m_s2`; `roll_rad` is positive with the right side down.
            `place_in_windup` is -1 to 1, `articulation_rad` the truck's heading less the trailer's, `axle_lift` 0 with
            the last axle down and 1 with it up. With an overlay motor, `place_in_lash` is -1 to 1 and `motor_carries` 1
            while the motor steers. With a load change, `load_change` is 1 from then on and `straight_ahead_rad` is the
            straight-ahead angle at every tick. With patches, `road_patch` is 1 on them. With a torque sensor,
            `hand_torque_nm` is the driver's torque, left positive. With a steered rear axle, `rear_axle_angle_rad` is
            the angle of its road wheels. `stability_control_active`, `anti_lock_active` and `reverse` are 1 at
            such ticks of a drive that has some. `vehicle_speed_m_s` is negative backwards.
    """

    scenario: str
    seed: int
    offset_rad: float
    understeer_gradient: float
    equivalent_wheelbase_m: float
    lifted_understeer_gradient: float | None
    lifted_equivalent_wheelbase_m: float | None
    load_changed_understeer_gradient: float | None
    load_changed_equivalent_wheelbase_m: float | None
    patch_understeer_gradient: float | None
    rear_steer_weight: float | None
    rear_axle_offset_rad: float | None
    steering_ratio: float
    backlash_rad: float
    windup_rad: float
    torsion_bar_rad: float
    unloading_acceleration_m_s2: float
    straight_ahead_rad: float
    yaw_rate_bias_rad_s: float
    lateral_acceleration_bias_m_s2: float
    faults: tuple[Fault, ...]
    table: pl.DataFrame


def truth_of(scenario: Scenario, seed: int, rows: npt.NDArray[np.void], sensed: Sensed) -> Truth:
    truck, steering = scenario.truck, scenario.steering
    lifts, patches = bool(truck.lift_axle_up_s), scenario.road.patches
    after = load_changed(truck) if truck.load_change is not None else None
    rear_sensor = scenario.sensors.rear_axle_angle
    return Truth(
        scenario=scenario.name,
        seed=seed,
        offset_rad=sensed.offset_rad,
        understeer_gradient=understeer_gradient(truck, steering),
        equivalent_wheelbase_m=equivalent_wheelbase_m(truck, steering),
        lifted_understeer_gradient=understeer_gradient(truck, steering, lifted=True) if lifts else None,
        lifted_equivalent_wheelbase_m=equivalent_wheelbase_m(truck, steering, lifted=True) if lifts else None,
        load_changed_understeer_gradient=None if after is None else understeer_gradient(after, steering),
        load_changed_equivalent_wheelbase_m=None if after is None else equivalent_wheelbase_m(after, steering),
        patch_understeer_gradient=None if patches is None else understeer_gradient(on_patch(truck, patches), steering),
        rear_steer_weight=None if truck.rear_steering is None else rear_steer_weight(truck, steering),
        rear_axle_offset_rad=None if rear_sensor is None else rear_sensor.offset_deg * DEGREE,
        steering_ratio=steering.ratio_near_centre,
        backlash_rad=(steering.backlash_deg + steering.lash_deg) * DEGREE,
        windup_rad=2.0 * steering.windup_deg * DEGREE,
        torsion_bar_rad=2.0 * steering.torsion_bar_twist_deg * DEGREE,
        unloading_acceleration_m_s2=unloading_acceleration_m_s2(truck, steering),
        straight_ahead_rad=straight_ahead_rad(truck, steering, load_changed=after is not None),
        yaw_rate_bias_rad_s=float(sensed.courses["yaw_rate_bias_rad_s"][-1]),
        lateral_acceleration_bias_m_s2=float(sensed.courses["lateral_acceleration_bias_m_s2"][-1]),
        faults=sensed.faults,
        table=pl.DataFrame(_true_columns(scenario, rows) | dict(sensed.courses)),
    )


def _true_columns(scenario: Scenario, rows: npt.NDArray[np.void]) -> dict[str, npt.NDArray[np.float64]]:
    truck, steering = scenario.truck, scenario.steering
    fields = _COLUMNS | (_MOTOR_COLUMNS if steering.overlay_motor is not None else {})
    fields |= {"hand_torque_nm": "hand_torque"} if scenario.sensors.steering_wheel_torque is not None else {}
    fields |= {"road_patch": "patch"} if scenario.road.patches is not None else {}
    fields |= {"rear_axle_angle_rad": "rear_axle_angle"} if truck.rear_steering is not None else {}
    true = {column: np.ascontiguousarray(rows[field]) for column, field in fields.items()}
    statuses = true_statuses(scenario, rows)
    true |= {name: statuses[name] for name in _STATUS_COLUMNS if statuses[name].any()}
    if truck.load_change is not None:
        angles = [straight_ahead_rad(truck, steering, load_changed=changed) for changed in (False, True)]
        true["axle_lift"] = np.zeros(len(rows))
        true["load_change"] = np.ascontiguousarray(rows["second_truck"])
        true["straight_ahead_rad"] = np.where(true["load_change"] > 0.0, angles[1], angles[0])
    return true


def write_truth(truth: Truth, table: Path, summary: Path) -> None:
    """Writes the table as Parquet, and the other values as TOML with angles in degrees.

    Raises:
        OncenterError: "output", exit code 2: one of them cannot be written.
    """
    with whole_file(table) as unfinished:
        truth.table.write_parquet(unfinished, metadata=metadata("truth"))
    values = {
        "offset_deg": truth.offset_rad / DEGREE,
        "understeer_gradient_deg_m_s2": truth.understeer_gradient / DEGREE,
        "equivalent_wheelbase_m": truth.equivalent_wheelbase_m,
        "steering_ratio": truth.steering_ratio,
        "backlash_deg": truth.backlash_rad / DEGREE,
        "windup_deg": truth.windup_rad / DEGREE,
        "unloading_acceleration_m_s2": truth.unloading_acceleration_m_s2,
        "straight_ahead_deg": truth.straight_ahead_rad / DEGREE,
        "yaw_rate_bias_deg_s": truth.yaw_rate_bias_rad_s / DEGREE,
        "lateral_acceleration_bias_m_s2": truth.lateral_acceleration_bias_m_s2,
    }
    if truth.lifted_understeer_gradient is not None and truth.lifted_equivalent_wheelbase_m is not None:
        values["lifted_understeer_gradient_deg_m_s2"] = truth.lifted_understeer_gradient / DEGREE
        values["lifted_equivalent_wheelbase_m"] = truth.lifted_equivalent_wheelbase_m
    if truth.load_changed_understeer_gradient is not None and truth.load_changed_equivalent_wheelbase_m is not None:
        values["load_changed_understeer_gradient_deg_m_s2"] = truth.load_changed_understeer_gradient / DEGREE
        values["load_changed_equivalent_wheelbase_m"] = truth.load_changed_equivalent_wheelbase_m
    if truth.torsion_bar_rad > 0.0:
        values["torsion_bar_deg"] = truth.torsion_bar_rad / DEGREE
    if truth.rear_steer_weight is not None:
        values["rear_steer_weight"] = truth.rear_steer_weight
    if truth.rear_axle_offset_rad is not None:
        values["rear_axle_offset_deg"] = truth.rear_axle_offset_rad / DEGREE
    if truth.patch_understeer_gradient is not None:
        values["patch_understeer_gradient_deg_m_s2"] = truth.patch_understeer_gradient / DEGREE
    lines = [entry("schema", SCHEMA), entry("scenario", printable(truth.scenario)), entry("seed", truth.seed)]
    lines += [entry(name, _rounded(value)) for name, value in values.items()]
    for fault in truth.faults:
        lines += ["", "[[faults]]", *_fault_lines(fault)]
    write_whole(summary, "\n".join(lines) + "\n")


def _fault_lines(fault: Fault) -> Iterator[str]:
    yield entry("signal", fault.signal)
    yield entry("kind", fault.kind)
    yield entry("begin_s", _rounded(fault.begin_s))
    yield entry("end_s", _rounded(fault.end_s))
    if fault.size is not None:
        unit, factor = _UNITS_IN_FILES[fault.unit]
        yield entry(f"size_{unit}", _rounded(fault.size / factor))


def _rounded(value: float) -> float:
    return float(f"{value:.9g}")
