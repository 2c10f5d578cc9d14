"""Trucks of every axle layout for the simulator: what goes over the thesis drive's `[truck]`.

Stiffness per load as thesis 2.3 has it: some 13 % per deg in front, 16 to 19 % behind. The rigids carry 12 to 18 t, the
semitrailer 25 t.
"""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from oncenter.simulate.drive import RATE_HZ, run, tick_count
from oncenter.simulate.road import lay_road
from oncenter.simulate.scenario import Scenario, scenario_from
from oncenter.simulate.truck import check_holdable

ROOT = Path(__file__).parents[1]
THESIS_DRIVE = tomllib.loads((ROOT / "scenarios" / "thesis_drive.toml").read_text(encoding="utf-8"))

SEMITRAILER: dict[str, Any] = {
    "hitch_m": 3.1,
    "mass_kg": 6500.0,
    "yaw_inertia_kg_m2": 110000.0,
    "gravity_centre_m": 5.5,
    "axle_count": 3,
    "axles_m": 7.7,
    "axle_spacing_m": 1.31,
    "cornering_stiffness_n_rad": 390000.0,
}
FULL_LOAD = {"mass_kg": 25000.0, "distance_m": 5.3, "length_m": 13.0}

TRUCKS: dict[str, dict[str, Any]] = {
    "4x2": {},
    "6x2": {
        "axle_layout": "6x2",
        "mass_kg": 10500.0,
        "yaw_inertia_kg_m2": 62000.0,
        "wheelbase_m": 4.6,
        "front_axle_distance_m": 2.3,
        "rear_axle_spacing_m": 1.35,
        "last_axle_load_share": 0.4,
        "front_cornering_stiffness_n_rad": 424000.0,
        "rear_cornering_stiffness_n_rad": 480000.0,
        "payload": {"mass_kg": 12000.0, "distance_m": 4.5, "length_m": 7.5},
    },
    "6x4": {
        "axle_layout": "6x4",
        "mass_kg": 11000.0,
        "yaw_inertia_kg_m2": 56000.0,
        "wheelbase_m": 3.9,
        "front_axle_distance_m": 2.2,
        "rear_axle_spacing_m": 1.37,
        "front_cornering_stiffness_n_rad": 418000.0,
        "rear_cornering_stiffness_n_rad": 510000.0,
        "dual_tyre_spacing_m": 0.34,
        "dual_tyre_longitudinal_stiffness_n": 250000.0,
        "payload": {"mass_kg": 14000.0, "distance_m": 4.2, "length_m": 5.5},
    },
    "8x4": {
        "axle_layout": "8x4",
        "mass_kg": 13000.0,
        "yaw_inertia_kg_m2": 76000.0,
        "wheelbase_m": 5.1,
        "front_axle_distance_m": 2.6,
        "front_axle_spacing_m": 1.94,
        "rear_axle_spacing_m": 1.37,
        "front_cornering_stiffness_n_rad": 628000.0,
        "rear_cornering_stiffness_n_rad": 453000.0,
        "dual_tyre_spacing_m": 0.34,
        "dual_tyre_longitudinal_stiffness_n": 250000.0,
        "payload": {"mass_kg": 18000.0, "distance_m": 4.5, "length_m": 5.5},
    },
    "semitrailer": {"trailer": SEMITRAILER | {"payload": FULL_LOAD}},
}


def scenario(changes: dict[str, dict[str, Any]] | None = None, layout: str = "4x2") -> Scenario:
    """The thesis drive with another truck; key=None leaves a key out."""
    changed: dict[str, Any] = {"name": layout}
    for section, values in THESIS_DRIVE.items():
        new = dict(values) if isinstance(values, dict) else values
        if section == "truck":
            new |= TRUCKS[layout]
        if isinstance(new, dict):
            new = {k: v for k, v in (new | (changes or {}).get(section, {})).items() if v is not None}
        changed[section] = new
    changed |= {section: values for section, values in (changes or {}).items() if section not in changed}
    return scenario_from(changed, layout)


def steered_by_machine(
    manoeuvre: dict[str, Any],
    duration_s: float,
    speed_km_h: float,
    changes: dict[str, dict[str, Any]] | None = None,
    layout: str = "4x2",
) -> npt.NDArray[np.void]:
    """What is true at every tick on open, level ground, where a machine steers; braking comes later."""
    of_bends = dict.fromkeys(THESIS_DRIVE["road"])
    given: dict[str, dict[str, Any]] = {
        "drive": {"duration_s": duration_s + 60.0, "standing_at_start_s": 0.0, "standing_at_end_s": 0.0},
        "road": of_bends | {"kind": "open", "crown_percent": 0.0},
        "driver": {"speed_km_h": [speed_km_h, speed_km_h], "acceleration_max_m_s2": 2.0},
        "manoeuvre": manoeuvre,
    }
    for section, values in (changes or {}).items():
        given[section] = given.get(section, {}) | values
    settings = scenario(given, layout)
    check_holdable(settings)
    nobody = np.zeros(tick_count(settings))
    rows = run(settings, lay_road(settings, np.random.default_rng(1)), nobody, nobody)
    return rows[: round(duration_s * RATE_HZ)]
