"""The matrix of bench/accuracy.py: the rows, and one drive of a row by its seed.

Truck, road and sensors of a drive are drawn from population.py, except for the values that its row fixes. The reference
is the sensor reading at mid-play and without column twist when driving straight without lateral acceleration: the
sensor's offset plus the angle that a misalignment needs to drive straight (truth.straight_ahead_rad); no log can
separate the two. A pull that is a moment at the king pins also shifts the neutral lateral acceleration; a method that
attributes this shift to the accelerometer bias has an error of i K_us pull.
"""

from __future__ import annotations

import dataclasses
import json
import math
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from population import (
    PLAY_SD_DEG,
    PRIORS,
    SET_UP_SHARE,
    Distribution,
    Draw,
    Normal,
    Random,
    Uniform,
    believed_accelerometer_bias_m_s2,
    draw,
    not_identifiable_m_s2,
    sensors,
    set_up_left_open_m_s2,
    steering,
    truck,
    wind,
)
from rivals import MINUTE_TICKS, Array, Known

import oncenter as oc
from oncenter.errors import OncenterError
from oncenter.signals import DEGREE, Signals
from oncenter.simulate.scenario import Scenario, read_scenario
from oncenter.simulate.truck import steered_stiffness_n_rad
from oncenter.simulate.truck_sections import Truck
from oncenter.simulate.truth import Truth
from oncenter.thesis.steady import LAYOUTS
from oncenter.vehicle import Vehicle, vehicle_from

_REAR_AXLES = {"4x2": "rear", "6x2": "tag"}  # of a vehicle file, by layout
DURATION_S = 1200.0
TORQUE_ZERO_SD_N_M = 0.1  # of the torque sensor
MOVING_M_S = 3.0  # minimum speed of the joint method
STANDING_M_S = 0.1
ATTEMPTS = 20  # a draw that the driver cannot control is repeated

Table = dict[str, Any]
WHEEL_SPEEDS = [f"wheel_speed_{corner}" for corner in ("front_left", "front_right", "rear_left", "rear_right")]


@dataclass(frozen=True)
class Row:
    """A row. `required`: its requirement is on "error", "interval", or "" for coverage only. `times`: multiple of the
    usual number of drives, for a requirement within a few per cent."""

    name: str
    about: str
    required: str = "error"
    base: str = "thesis_drive"
    fixed: Mapping[str, Distribution | float] = dataclasses.field(default_factory=dict)
    extra: Callable[[Random], Table] = lambda random: {}
    front_axle_load_kg: float | None = None  # of a base with its own truck
    wind: bool = False
    pulls: bool = False
    one_flank: bool = False  # only one flank of the play is loaded
    set_up: bool = False  # the axle is adjusted for the crown
    traffic_side: str = "right"
    given_side: str | None = ""  # traffic side in the vehicle file, if different; None: none given
    spoil: Callable[[Signals, Random], Signals] = lambda signals, random: signals
    times: int = 1
    uses_accelerometer: bool = True  # the lateral acceleration is used; rivals always use it
    torque: bool = False  # the truck has a steering wheel torque sensor
    like: str = ""  # another row with the same drives, except for the changes of this one
    vehicle_error: Distribution | None = None  # relative error of wheelbase and ratio in the vehicle file


@dataclass(frozen=True)
class Drive:
    """A drive, the vehicle data for the estimators, and the true values.

    Attributes:
        target_rad: the offset at the end of every minute.
        exact_data_rad: error with exact data of truck, play and gyro, but without the accelerometer bias.
        floor_rad: half-width of a 95 % interval for the part that is not identifiable from one drive: the neutral
            lateral acceleration, and half the play if only one flank is loaded.
        side_force_floor_rad: the first of these two.
        angle_per_m_s2: i K_us, the shift of the offset per error of the neutral lateral acceleration, rad/(m/s^2).
        wind_m_s2: mean shift of the neutral lateral acceleration by wind above the estimators' minimum speed.
        redrawn: number of draws before this one that the driver could not control.
        scenario: the simulated scenario.
        truth: its true values.
    """

    row: str
    seed: int
    signals: Signals
    vehicle: Vehicle
    known: Known
    target_rad: Array
    exact_data_rad: float
    floor_rad: float
    side_force_floor_rad: float
    angle_per_m_s2: float
    wind_m_s2: float
    redrawn: int
    scenario: Scenario
    truth: Truth

    @property
    def columns(self) -> dict[str, Array]:
        return {name: self.signals.table[name].to_numpy() for name in self.signals.table.columns}


def drive(row: Row, seed: int, folder: Path) -> Drive:
    """The row's drive with that seed. `folder` is for a temporary scenario file."""
    random = np.random.default_rng([seed, zlib.crc32((row.like or row.name).encode())])
    scenario, signals, truth, redrawn = _driven(row, seed, random, folder)
    vehicle = vehicle_file(row, scenario.truck, truth, random)
    ends = slice(MINUTE_TICKS - 1, None, MINUTE_TICKS)
    has_play = truth.backlash_rad + truth.windup_rad > 0.0
    unloads = has_play and row.fixed.get("king_pin_friction_m_s2") != FRICTION_NEVER_OVERCOME_M_S2
    stood = bool((truth.table["vehicle_speed_m_s"] < STANDING_M_S).any())
    angle_per_m_s2 = truth.steering_ratio * truth.understeer_gradient
    not_identifiable_rad = angle_per_m_s2 * not_identifiable_m_s2(unloads=unloads, stood=stood)
    flank_rad = 0.5 * PLAY_SD_DEG * DEGREE if row.one_flank else 0.0
    set_up_rad = angle_per_m_s2 * set_up_left_open_m_s2(stood=stood) if row.set_up else 0.0
    return Drive(
        row=row.name,
        seed=seed,
        signals=row.spoil(signals, random),
        vehicle=vehicle,
        known=known_of(vehicle, scenario),
        target_rad=truth.table["steering_wheel_angle_offset_rad"].to_numpy()[ends] + truth.straight_ahead_rad,
        exact_data_rad=angle_per_m_s2 * _accelerometer_bias_error_m_s2(signals, truth, vehicle),
        floor_rad=1.96 * math.hypot(not_identifiable_rad, flank_rad, set_up_rad),
        side_force_floor_rad=1.96 * not_identifiable_rad,
        angle_per_m_s2=angle_per_m_s2,
        wind_m_s2=_unloading_point_moved_by_wind_m_s2(scenario, truth),
        redrawn=redrawn,
        scenario=scenario,
        truth=truth,
    )


def _accelerometer_bias_error_m_s2(signals: Signals, truth: Truth, vehicle: Vehicle) -> float:
    """Best estimate of the accelerometer bias from the mean bank and the ground at standstill, less the true one."""
    table = signals.table.filter(pl.col("lateral_acceleration_m_s2").is_finite() & pl.col("yaw_rate_rad_s").is_finite())
    moving = table.filter(pl.col("vehicle_speed_m_s") > MOVING_M_S)
    standing = table.filter(pl.col("vehicle_speed_m_s") < STANDING_M_S)["lateral_acceleration_m_s2"]
    turning = (moving["yaw_rate_rad_s"] - truth.yaw_rate_bias_rad_s) * moving["vehicle_speed_m_s"]
    bank = float((moving["lateral_acceleration_m_s2"] - turning).to_numpy().mean())
    stood_on = float(standing.to_numpy().mean()) if len(standing) else None
    believed = believed_accelerometer_bias_m_s2(bank, stood_on, vehicle.traffic_sign)
    return believed - truth.lateral_acceleration_bias_m_s2


def _unloading_point_moved_by_wind_m_s2(scenario: Scenario, truth: Truth) -> float:
    """Lateral acceleration with zero force at the front tyres under wind force and moment."""
    if scenario.wind is None:
        return 0.0
    moving = truth.table.filter(pl.col("vehicle_speed_m_s") > MOVING_M_S)["wind_side_force_n"].to_numpy()
    to_rear_m = scenario.truck.wheelbase_m - scenario.truck.front_axle_distance_m
    by_moment = 1.0 + scenario.wind.force_arm_m / to_rear_m
    return float(moving.mean()) / scenario.truck.mass_kg * by_moment if len(moving) else 0.0


def _driven(row: Row, seed: int, random: Random, folder: Path) -> tuple[Scenario, Signals, Truth, int]:
    """Draws until the driver can control the truck; also gives the number of rejected draws."""
    file = folder / f"{row.name}_{seed}.toml"
    for redrawn in range(ATTEMPTS):
        drawn = draw(random, {**EVERY_ROW, **row.fixed})
        file.write_text(as_toml(laid_over(scenario_values(row, drawn, random), row.extra(random))), encoding="utf-8")
        try:
            signals, truth = oc.simulate(file, seed)
        except OncenterError as error:
            refusal = error
            continue
        scenario = read_scenario(file)
        file.unlink()
        return scenario, signals, truth, redrawn
    raise refusal


def vehicle_file(row: Row, truck: Truck, truth: Truth, random: Random) -> Vehicle:
    """Winkler's equivalent wheelbase for a vehicle file: all axles down, without trailer."""
    wheelbase_m = truth.equivalent_wheelbase_m if truck.trailer is None else truck.wheelbase_m
    ratio = truth.steering_ratio
    if row.vehicle_error is not None:
        wheelbase_m *= 1.0 + row.vehicle_error.draw(random)
        ratio *= 1.0 + row.vehicle_error.draw(random)
    given_side = None if row.given_side is None else row.given_side or row.traffic_side
    return vehicle_from(
        {
            "wheelbase_m": round(wheelbase_m, 3),
            "steering_ratio": round(ratio, 3),
            "track_width_front_m": truck.track_width_front_m,
            "track_width_rear_m": truck.track_width_rear_m,
            "axle_layout": truck.axle_layout,
            **({} if truck.rear_steering is None else {"rear_axle_steers": _REAR_AXLES[truck.axle_layout]}),
            **({} if given_side is None else {"traffic_side": given_side}),
            "params": {"use_accelerometer": row.uses_accelerometer},
        },
        row.name,
    )


def known_of(vehicle: Vehicle, scenario: Scenario) -> Known:
    truck = scenario.truck
    return Known(
        wheelbase_m=vehicle.wheelbase_m,
        steering_ratio=vehicle.ratio_near_centre,
        mass_kg=truck.mass_kg,
        yaw_inertia_kg_m2=truck.yaw_inertia_kg_m2,
        front_axle_distance_m=truck.front_axle_distance_m,
        front_cornering_stiffness_n_rad=steered_stiffness_n_rad(truck, scenario.steering),
        rear_cornering_stiffness_n_rad=truck.rear_cornering_stiffness_n_rad,
    )


def scenario_values(row: Row, drawn: Draw, random: Random) -> Table:
    load_kg = row.front_axle_load_kg or drawn["front_axle_load_kg"]
    side = 1.0 if row.traffic_side == "right" else -1.0
    values: Table = {
        "base": row.base,
        "about": row.about,
        "drive": {
            "duration_s": DURATION_S,
            "standing_at_start_s": drawn["standing_at_start_s"],
            "standing_at_end_s": 0.0,
        },
        "steering": steering(drawn, load_kg, pulls=row.pulls),
        "road": {
            "heading_deg": drawn["heading_deg"],
            "crown_percent": side * drawn["crown_percent"],
            "rough_bank_sd_percent": drawn["rough_bank_sd_percent"],
        },
        "sensors": sensors(drawn),
    }
    if row.front_axle_load_kg is None:
        values["truck"] = truck(drawn)
    of_wind = wind(drawn, random)
    if row.wind:
        values["wind"] = of_wind
    if row.torque:
        values["sensors"]["steering_wheel_torque"] = {
            "zero_error_n_m": random.spawn(1)[0].normal(0.0, TORQUE_ZERO_SD_N_M)
        }
    return values


def laid_over(below: Table, above: Table) -> Table:
    result = dict(below)
    for key, value in above.items():
        both = isinstance(value, dict) and isinstance(result.get(key), dict)
        result[key] = laid_over(result[key], value) if both else value
    return result


def as_toml(values: Table, path: tuple[str, ...] = ()) -> str:
    """TOML of tables with numbers, texts and lists, whose JSON form is also valid TOML."""
    plain = [f"{key} = {_inline(value)}" for key, value in values.items() if not isinstance(value, dict)]
    text = "\n".join(([f"[{'.'.join(path)}]"] if path else []) + plain) + "\n"
    return text + "".join(as_toml(value, (*path, key)) for key, value in values.items() if isinstance(value, dict))


def _inline(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {_inline(v)}" for key, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_inline, value)) + "]"
    return json.dumps(value)


def _with_columns(signals: Signals, columns: Mapping[str, Array]) -> Signals:
    table = signals.table.with_columns(**{name: pl.Series(values) for name, values in columns.items()})
    return dataclasses.replace(signals, table=table)


def as_ebc2(signals: Signals, random: Random) -> Signals:
    """Wheel speeds as in EBC2: the front axle in 1/256 km/h, each wheel relative to it in 1/16 km/h, every 100 ms,
    interpolated in between as a reader does."""
    time = signals.table["time_s"].to_numpy()
    wheels = {name: signals.table[f"{name}_m_s"].to_numpy()[::10] for name in WHEEL_SPEEDS}
    axle = _rounded((wheels["wheel_speed_front_left"] + wheels["wheel_speed_front_right"]) / 2.0, 1.0 / 256.0 / 3.6)
    coarse = {name: axle + _rounded(speed - axle, 1.0 / 16.0 / 3.6) for name, speed in wheels.items()}
    fine = {f"{name}_m_s": np.interp(time, time[::10], speed) for name, speed in coarse.items()}
    sources = {
        name: dataclasses.replace(source, description="EBC2 from 0x0B", rate_hz=10.0) if name in wheels else source
        for name, source in signals.sources.items()
    }
    return dataclasses.replace(_with_columns(signals, fine), sources=sources)


def _rounded(values: Array, quantum: float) -> Array:
    return np.round(values / quantum) * quantum


def without_wheel_speeds(signals: Signals, random: Random) -> Signals:
    sources = {name: source for name, source in signals.sources.items() if name not in WHEEL_SPEEDS}
    return dataclasses.replace(
        signals, table=signals.table.drop([f"{name}_m_s" for name in WHEEL_SPEEDS]), sources=sources
    )


def with_kicks(signals: Signals, random: Random) -> Signals:
    """Adds kerbs, potholes and interventions of a stability control: every 40 s, for 0.2 to 1.5 s, half a sine of up to
    40 deg, 6 deg/s and 2 m/s^2 on angle, yaw rate and lateral acceleration, with independent signs."""
    columns = {
        name: signals.table[name].to_numpy().copy()
        for name in ("steering_wheel_angle_rad", "yaw_rate_rad_s", "lateral_acceleration_m_s2")
    }
    largest = {"steering_wheel_angle_rad": 40.0 * DEGREE, "yaw_rate_rad_s": 6.0 * DEGREE}
    count = len(signals.table)
    for begin in random.integers(0, count - 150, round(count / signals.rate_hz / 40.0)):
        shape = np.sin(np.linspace(0.0, np.pi, int(random.integers(20, 150))))
        for name, column in columns.items():
            column[begin : begin + len(shape)] += random.uniform(-1.0, 1.0) * largest.get(name, 2.0) * shape
    return _with_columns(signals, columns)


def _sensor(signal: str, **values: Any) -> Callable[[Random], Table]:
    return lambda random: {"sensors": {signal: values}}


def _remounted(random: Random) -> Table:
    step = float(random.choice([-1.0, 1.0]) * random.uniform(2.0, 6.0))
    begin = float(random.uniform(360.0, 720.0))
    return {"sensors": {"steering_wheel_angle": {"remounts": [{"begin_s": begin, "step_deg": step}]}}}


def _corrected_by_itself(random: Random) -> Table:
    begin = float(random.uniform(360.0, 600.0))
    return {"sensors": {"steering_wheel_angle": {"self_correction": {"begin_s": begin, "length_s": 120.0}}}}


def _never_stands(random: Random) -> Table:
    return {"drive": {"standing_at_start_s": 0.0}}


def _wound_up(random: Random) -> Table:
    return {"steering": {"windup_deg": float(random.uniform(0.5, 3.0))}}


def _wound_up_and_returned(random: Random) -> Table:
    return laid_over(_wound_up(random), {"steering": {"active_return_1_s": float(random.uniform(0.5, 5.0))}})


def _unloads_on_crown(random: Random) -> Table:
    return {"steering": {"unloads_on_crown_percent": 2.0}}


def _rigid(layout: str, about: str, front_axle_load_kg: float) -> Row:
    """A rigid truck with a random load between empty and laden."""

    def loaded(random: Random) -> Table:
        goods = LAYOUTS[layout]["payload"]
        return {"truck": {**LAYOUTS[layout], "payload": {**goods, "mass_kg": random.uniform(0.0, goods["mass_kg"])}}}

    about = f"{layout}, {about}, empty to laden"
    return Row(f"rigid_{layout}", about, base="country", front_axle_load_kg=front_axle_load_kg, extra=loaded)


def _population(random: Random) -> Table:
    standing = _never_stands(random) if random.random() < 0.5 else {}
    road = {"base": str(random.choice(POPULATED_BY))}
    return {**road, **standing, **(_unloads_on_crown(random) if random.random() < SET_UP_SHARE else {})}


# Defaults of a row: play within maintenance limits, moved by the aligning moment, on a road with a crown near the usual
# 2 %.
EVERY_ROW: dict[str, Distribution | float] = {
    "backlash_deg": Uniform(2.0, 8.0),
    "king_pin_friction_m_s2": Uniform(0.02, 0.1),
    "crown_percent": Normal(2.0, 0.5),
}
POPULATED_BY = ("thesis_drive", "country", "motorway", "town")
FRICTION_NEVER_OVERCOME_M_S2 = 10.0
FRONT_OF_THESIS_KG, FRONT_OF_LIFT_AXLE_KG = 5900.0, 6660.0  # front axle loads of the trucks of base scenarios

_ROWS = (
    Row("ordinary", "2 to 8 deg of play, aligning moment"),
    Row("play_15_aligning", "15 deg of play, aligning moment", fixed={"backlash_deg": 15.0}),
    Row(
        "play_15_friction",
        "15 deg of play, king pins that no aligning moment turns",
        fixed={"backlash_deg": 15.0, "king_pin_friction_m_s2": FRICTION_NEVER_OVERCOME_M_S2},
    ),
    Row("no_play", "no play at all", required="interval", fixed={"backlash_deg": 0.0}),
    Row("gyro_3_deg_s", "yaw rate bias 3 deg/s", fixed={"yaw_rate_bias_deg_s": 3.0}),
    Row("gyro_drift", "yaw rate bias drifts by 0.1 deg/s a minute", extra=_sensor("yaw_rate", drift_deg_s_min=0.1)),
    Row("accelerometer_plus", "accelerometer bias +0.3 m/s²", fixed={"lateral_acceleration_bias_m_s2": 0.3}),
    Row("accelerometer_minus", "accelerometer bias -0.3 m/s²", fixed={"lateral_acceleration_bias_m_s2": -0.3}),
    Row("pull", "alignment that pulls, sd 0.05 m/s² and 100 N", required="interval", pulls=True),
    Row("wind", "all roads, in wind", required="interval", wind=True),
    Row("cross_wind", "motorway in wind", required="interval", base="motorway", wind=True),
    Row(
        "bypass",
        "bends to the left only, on a crown to the right: one flank",
        required="interval",
        base="bypass",
        one_flank=True,
    ),
    Row("motorway", "75 to 90 km/h, never stands", base="motorway", extra=_never_stands),
    Row("country", "bends down to 120 m, uneven bank", base="country"),
    Row("town", "25 to 50 km/h, stops", base="town"),
    Row("yard", "11 to 28 km/h, stands twice", base="yard"),
    Row(
        "nothing_shows_gyro",
        "never stands, no wheel speeds",
        required="",
        spoil=without_wheel_speeds,
        extra=_never_stands,
    ),
    Row(
        "lift_axle",
        "6x2, tag axle up for ten minutes",
        base="lift_axle",
        front_axle_load_kg=FRONT_OF_LIFT_AXLE_KG,
        extra=lambda random: {"truck": {"lift_axle_up_s": [[300.0, 900.0]]}},
    ),
    _rigid("6x2", "tag axle down", 6550.0),
    _rigid("6x4", "dual tyres on both rear axles", 6300.0),
    _rigid("8x4", "the same, two axles steered", 10800.0),
    Row("trailer_half", "semitrailer, half laden", base="semitrailer_half", front_axle_load_kg=FRONT_OF_THESIS_KG),
    Row("trailer_full", "semitrailer, laden", base="semitrailer_full", front_axle_load_kg=FRONT_OF_THESIS_KG),
    Row("windup", "column winds up by 0.5 to 3 deg either way", extra=_wound_up),
    Row("active_return", "the same, and a motor unwinds it", extra=_wound_up_and_returned),
    Row("unloads_on_crown", "axle set up to unload on 2 %", required="interval", extra=_unloads_on_crown, set_up=True),
    Row("ebc2", "wheel speeds in 1/16 km/h at 10 Hz, never stands", spoil=as_ebc2, extra=_never_stands),
    Row("no_wheel_speeds", "no wheel speeds on the bus", spoil=without_wheel_speeds),
    Row("no_accelerometer", "lateral acceleration not used, but by rivals", required="", uses_accelerometer=False),
    Row(
        "no_accelerometer_motorway",
        "the same on a motorway, banked in bends",
        required="",
        uses_accelerometer=False,
        base="motorway",
    ),
    Row("torque_pull", "`pull` with a torque sensor", required="interval", pulls=True, torque=True, like="pull"),
    Row(
        "torque_no_accelerometer",
        "`no_accelerometer`, and a torque sensor replaces it",
        required="",
        uses_accelerometer=False,
        torque=True,
        like="no_accelerometer",
    ),
    Row("kicks", "kerbs, and a stability control at work", spoil=with_kicks),
    Row("left_hand", "traffic on the left, crown mirrored", traffic_side="left"),
    Row("wrong_side", "traffic_side is left, roads fall to the right", required="", given_side="left"),
    Row("remounted", "sensor moves by 2 to 6 deg in minute 6 to 12", extra=_remounted),
    Row("self_correction", "sender takes its offset out in two minutes", extra=_corrected_by_itself),
    Row(
        "vehicle_off", "vehicle file 3 % off in wheelbase and ratio (sd)", required="", vehicle_error=Normal(0.0, 0.03)
    ),
    Row(
        "population",
        "all drawn from the priors",
        required="coverage",
        times=4,
        fixed={name: PRIORS[name][0] for name in EVERY_ROW},
        extra=_population,
        wind=True,
        pulls=True,
    ),
)
ROWS = {row.name: row for row in _ROWS}
