"""Trucks of every axle layout for the simulator: replacements for the thesis drive's `[truck]`.

The rigids are those of the thesis's page, the semitrailer carries 25 t.
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
from oncenter.thesis.steady import LAYOUTS

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
    **LAYOUTS,
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
