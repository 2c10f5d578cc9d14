"""The drives of bench/angle.py: trucks drawn from population.py, first with the sensor, then without.

A truck with steering lag is derived from one without: the angle at the hands leads the angle at the wheels by lag times
its rate, which is a first-order lag from hands to wheels.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl
from accuracy_rows import as_toml  # same tables as in the accuracy bench
from population import Draw, Uniform, draw, sensors, steering, truck, wind

import oncenter as oc
from oncenter.errors import OncenterError
from oncenter.signals import Signals
from oncenter.simulate.truth import Truth
from oncenter.vehicle import Vehicle, vehicle_from

Array = npt.NDArray[np.float64]
Table = dict[str, Any]

LEARNING_S, WITHOUT_S = 600.0, 3600.0
ROADS = ("thesis_drive", "country", "motorway")
ATTEMPTS = 20
GNSS_SD_M_S = 0.02  # of the lateral speed of a good receiver with inertial sensors


@dataclass(frozen=True)
class AngleDrive:
    """`true_rad` is the steering wheel angle less the angle that a misalignment needs to drive straight."""

    signals: Signals
    true_rad: Array
    speed_m_s: Array
    lateral_acceleration_m_s2: Array
    vehicle: Vehicle


def simulated(values: Table, seed: int, folder: Path, lag_s: float = 0.0) -> AngleDrive:
    """Simulates a scenario given as tables."""
    file = folder / "angle.toml"
    file.write_text(as_toml(values), encoding="utf-8")
    signals, truth = oc.simulate(file, seed)
    return drive_of(signals, truth, lag_s)


def named(scenario: str, seed: int, lag_s: float = 0.0) -> AngleDrive:
    """Simulates a shipped scenario."""
    return drive_of(*oc.simulate(scenario, seed), lag_s)


def drive_of(signals: Signals, truth: Truth, lag_s: float) -> AngleDrive:
    true = truth.table["steering_wheel_angle_rad"].to_numpy() - truth.straight_ahead_rad
    over_ground = truth.table["lateral_speed_m_s"].to_numpy()
    noise = np.random.default_rng(len(true)).normal(0.0, GNSS_SD_M_S, len(true))
    signals = replace(signals, table=signals.table.with_columns(lateral_speed_m_s=pl.Series(over_ground + noise)))
    ahead = lag_s * np.gradient(true) * signals.rate_hz
    if lag_s:
        held = signals.table["steering_wheel_angle_rad"].to_numpy() + ahead
        signals = replace(signals, table=signals.table.with_columns(steering_wheel_angle_rad=pl.Series(held)))
    return AngleDrive(
        signals,
        true + ahead,
        truth.table["vehicle_speed_m_s"].to_numpy(),
        truth.table["lateral_acceleration_m_s2"].to_numpy(),
        vehicle_from(
            {
                "wheelbase_m": round(truth.equivalent_wheelbase_m, 3),
                "steering_ratio": truth.steering_ratio,
                "track_width_front_m": 2.05,
                "track_width_rear_m": 1.83,
                "traffic_side": "right",
            },
            truth.scenario,
        ),
    )


def ordinary(
    seed: int, folder: Path, play_deg: Uniform | float, *, extra: Mapping[str, Any] | None = None
) -> AngleDrive:
    """Ten minutes with and an hour without the sensor, on a random road."""
    random = np.random.default_rng([seed, 5])
    fixed = {"backlash_deg": play_deg, "king_pin_friction_m_s2": Uniform(0.02, 0.1)}
    for _ in range(ATTEMPTS):
        drawn = draw(random, fixed)
        values = scenario_of(drawn, str(random.choice(ROADS)), LEARNING_S + WITHOUT_S)
        for name, table in (extra or {}).items():
            values.setdefault(name, {}).update(table)
        try:
            return simulated(values, seed, folder)
        except OncenterError as error:
            refusal = error
    raise refusal


HEALTHY = ("motorway", "country", "town", "thesis_drive", "windy", "banked", "king-pin friction", "pulling alignment")


def healthy(seed: int, folder: Path) -> AngleDrive:
    """Ten minutes and an hour with a healthy sensor, all HEALTHY kinds of drives in turn."""
    random = np.random.default_rng([seed, 8])
    kind = HEALTHY[seed % len(HEALTHY)]
    for _ in range(ATTEMPTS):
        friction = Uniform(0.2, 0.5) if kind == "king-pin friction" else Uniform(0.02, 0.2)
        drawn = draw(random, {"king_pin_friction_m_s2": friction})
        base = kind if kind in (*ROADS, "town") else str(random.choice(ROADS))
        values = scenario_of(drawn, base, LEARNING_S + WITHOUT_S)
        if kind == "windy":
            values["wind"] = {**wind(drawn, random), "mean_m_s": 8.0, "gust_sd_m_s": 2.0}
        elif kind == "banked":
            values["road"]["rough_bank_sd_percent"] = 1.0
        elif kind == "pulling alignment":
            values["steering"] = steering(drawn, drawn["front_axle_load_kg"], pulls=True)
        try:
            return simulated(values, seed, folder)
        except OncenterError as error:
            refusal = error
    raise refusal


def payload_changed(seed: int, folder: Path) -> tuple[AngleDrive, AngleDrive]:
    """The same truck twice: ten minutes with its payload, and half an hour with 50 % less or more."""
    random = np.random.default_rng([seed, 6])
    drawn = draw(random, {"backlash_deg": Uniform(0.0, 8.0), "king_pin_friction_m_s2": Uniform(0.02, 0.1)})
    goods_kg = float(random.uniform(3000.0, 8000.0))
    factor = float(random.choice([0.5, 1.5]))
    drives = []
    for kg, duration_s in ((goods_kg, LEARNING_S), (factor * goods_kg, 0.5 * WITHOUT_S)):
        values = scenario_of(drawn, "thesis_drive", duration_s)
        values["truck"]["stiffness_load_exponent"] = 0.85
        distance_m = 0.75 * drawn["wheelbase_m"]
        values["truck"]["payload"] = {"mass_kg": kg, "distance_m": distance_m, "length_m": 4.0}
        drives.append(simulated(values, seed, folder))
    return drives[0], drives[1]


def scenario_of(drawn: Draw, base: str, duration_s: float) -> Table:
    return {
        "base": base,
        "about": "drawn",
        "drive": {
            "duration_s": duration_s,
            "standing_at_start_s": drawn["standing_at_start_s"],
            "standing_at_end_s": 0.0,
        },
        "truck": truck(drawn),
        "steering": steering(drawn, drawn["front_axle_load_kg"], pulls=False),
        "road": {
            "heading_deg": drawn["heading_deg"],
            "crown_percent": drawn["crown_percent"],
            "rough_bank_sd_percent": drawn["rough_bank_sd_percent"],
        },
        "sensors": sensors(drawn),
    }


RAMP_BEGIN_S, RAMP_RATE_DEG_S, RAMP_FROM_DEG, RAMP_TO_DEG = 70.23, 260.0, 60.0, -50.0


def hard_turn(seed: int, folder: Path, lag_s: float) -> AngleDrive:
    """Figure 12 with a lag of lag_s from hands to wheels."""
    time_s = np.arange(0.0, 120.0, 0.001)
    ramp = RAMP_FROM_DEG - RAMP_RATE_DEG_S * (time_s - RAMP_BEGIN_S)
    before = RAMP_FROM_DEG * np.clip(time_s - 61.0, 0.0, 1.0)
    hands = np.where(time_s >= RAMP_BEGIN_S, np.maximum(ramp, RAMP_TO_DEG), before)
    wheels = hands.copy()
    if lag_s:
        for k in range(1, len(wheels)):
            wheels[k] = wheels[k - 1] + (hands[k] - wheels[k - 1]) * 0.001 / lag_s
    keep = np.zeros(len(time_s), bool)
    keep[60_000:110_000:500] = keep[61_000:62_500:20] = keep[70_210:71_800:10] = True
    profile = {"kind": "profile", "time_s": time_s[keep].tolist(), "angle_deg": wheels[keep].tolist()}
    return simulated({"base": "hard_turn", "about": "drawn", "manoeuvre": profile}, seed, folder)
