"""Priors that a fleet has taught (`oncenter fleet priors`): the keys of their file, and the params that they set."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from oncenter.files.toml_file import read_toml, refusal
from oncenter.nearest_name import did_you_mean

_CODE = "vehicle_file"
TRUCKS_MAX = 10_000_000
# By key: lowest and highest value. Each has its standard error, `..._error_UNIT`.
KEYS: Mapping[str, tuple[float, float]] = {
    "pull_sd_m_s2": (0.0, 1.0),
    "play_deg": (0.0, 30.0),
    "play_sd_deg": (0.0, 30.0),
    "understeer_gradient_deg_m_s2": (0.0, 5.0),
    "understeer_gradient_sd_deg_m_s2": (0.0, 5.0),
    "set_up_probability_1": (0.0, 1.0),
}
_SET_UP_MAX = 0.5  # of the parameter
_UNITS = ("deg_m_s2", "m_s2", "deg", "1")
# of pulls: 200 simulated trucks with an sd of 0.02 taught 0.005 to 0.03, with standard errors of 0.002 to 0.008
_PULL_SD_MIN_M_S2 = 0.02
_SD_MIN_DEG, _SD_MIN_DEG_M_S2 = 0.1, 0.01  # of a play and of a gradient: no drive finds its own beside a smaller one


@dataclass(frozen=True)
class LearnedPriors:
    """The params of a vehicle by the priors of a file, and the words for their source."""

    path: Path
    params: Mapping[str, float]
    source: str


def error_key(key: str) -> str:
    """Of the standard error: "pull_sd_error_m_s2"."""
    unit = next(unit for unit in _UNITS if key.endswith(f"_{unit}"))
    return f"{key.removesuffix(f'_{unit}')}_error_{unit}"


def learned_priors(path: Path, name: str, given: Mapping[str, Any]) -> LearnedPriors:
    """Of the vehicle file `name`, whose own values replace the fleet's: by its type where the fleet has that, else by
    all trucks.

    Raises:
        OncenterError: "vehicle_file", exit code 2, with the file and the key.
    """
    what = f"file of priors {path}"
    values = read_toml(path, what, code=_CODE)
    types = values.get("types", {})
    by_type = isinstance(types, dict) and name in types
    table = types[name] if by_type else values.get("priors")
    where = f"types.{name}" if by_type else "priors"
    if not isinstance(table, dict):
        raise refusal(f"{what} has no table [{where}]: write it with oncenter fleet priors", _CODE)
    keys = ["trucks", *KEYS, *map(error_key, KEYS)]
    for key in table:
        if key not in keys:
            raise refusal(f"{what}: {where}.{key} is not a key{did_you_mean(key, keys)}", _CODE)
    found = {key: _value(table, key, bounds, f"{what}: {where}") for key, bounds in KEYS.items() if key in table}
    errors = {key: _value(table, error_key(key), KEYS[key], f"{what}: {where}") for key in found}
    trucks = _value(table, "trucks", (1.0, float(TRUCKS_MAX)), f"{what}: {where}")
    params: dict[str, float] = {}
    if "pull_sd_m_s2" in found and "pull_m_s2" not in given:
        learned = math.hypot(found["pull_sd_m_s2"], errors["pull_sd_m_s2"])
        params["pull_sd_m_s2"] = max(learned, _PULL_SD_MIN_M_S2)
    if "set_up_probability_1" in found and "set_up_for_crown" not in given:
        likely = found["set_up_probability_1"] + errors["set_up_probability_1"]
        params["set_up_probability_1"] = min(likely, _SET_UP_MAX)
    has_ratio = "steering_ratio" in given  # without it a gradient is not one of the road wheels
    for key, sd, sd_min, applies in (
        ("play_deg", "play_sd_deg", _SD_MIN_DEG, True),
        ("understeer_gradient_deg_m_s2", "understeer_gradient_sd_deg_m_s2", _SD_MIN_DEG_M_S2, has_ratio),
    ):
        if key in found and sd in found and key not in given and applies:
            params[f"known_{key}"] = found[key]
            params[f"known_{sd}"] = max(math.hypot(found[sd], errors[sd], errors[key]), sd_min)
    return LearnedPriors(path, params, f"by {trucks:.0f} trucks of {path.name}")


def _value(table: Mapping[str, Any], key: str, bounds: tuple[float, float], where: str) -> float:
    value, (low, high) = table.get(key), bounds
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not low <= float(value) <= high:  # type: ignore[arg-type]
        shown = "nothing" if value is None else repr(value)
        raise refusal(f"{where}.{key} must be a number from {low:g} to {high:g}, got {shown}", _CODE)
    return float(value)  # type: ignore[arg-type]
