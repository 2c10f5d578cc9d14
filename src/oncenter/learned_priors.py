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
SCHEMA = "oncenter/priors-1"
OUTLIERS = "outliers"  # table of trucks by name
TRUCKS_MAX = 10_000_000
_SET_UP = "set_up_probability_1"  # not learned where no side of traffic is given
# By key: lowest and highest value. Each has its standard error, `..._error_UNIT`.
KEYS: Mapping[str, tuple[float, float]] = {
    "pull_sd_m_s2": (0.0, 1.0),
    "play_deg": (0.0, 25.0),
    "play_sd_deg": (0.0, 15.0),
    "understeer_gradient_deg_m_s2": (0.0, 5.0),
    "understeer_gradient_sd_deg_m_s2": (0.0, 1.5),
    _SET_UP: (0.0, 1.0),
}
_UNITS = ("deg_m_s2", "m_s2", "deg", "1")
_SET_UP_MAX = 0.5  # of the parameter: the core prefers an axle that is not set up
# of pulls: 200 trucks with an sd of 0.02 teach 0.01 to 0.03, with a standard error of 0.007 (bench/fleet_pulls.py)
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
    all trucks. The spread of pulls is not that of an outlier.

    Raises:
        OncenterError: "vehicle_file", exit code 2, with the file and the key.
    """
    what = f"file of priors {path}"
    values = read_toml(path, what, code=_CODE)
    where, table = _table(values, name, what)
    learned = [key for key in KEYS if key in table or key != _SET_UP]
    found = {key: _value(table, key, KEYS[key], f"{what}: {where}") for key in learned}
    errors = {key: _value(table, error_key(key), KEYS[key], f"{what}: {where}") for key in learned}
    trucks = _value(table, "trucks", (1.0, float(TRUCKS_MAX)), f"{what}: {where}")
    params: dict[str, float] = {}
    outliers = values.get(OUTLIERS)
    if "pull_m_s2" not in given and not (isinstance(outliers, dict) and name in outliers):
        sd = math.hypot(found["pull_sd_m_s2"], errors["pull_sd_m_s2"])
        params["pull_sd_m_s2"] = max(sd, _PULL_SD_MIN_M_S2)
    if _SET_UP in found and "set_up_for_crown" not in given:
        params[_SET_UP] = min(found[_SET_UP] + errors[_SET_UP], _SET_UP_MAX)
    has_ratio = "steering_ratio" in given  # without it a gradient is not one of the road wheels
    for key, sd_key, sd_min, applies in (
        ("play_deg", "play_sd_deg", _SD_MIN_DEG, True),
        ("understeer_gradient_deg_m_s2", "understeer_gradient_sd_deg_m_s2", _SD_MIN_DEG_M_S2, has_ratio),
    ):
        if key not in given and applies:
            params[f"known_{key}"] = found[key]
            params[f"known_{sd_key}"] = max(math.hypot(found[sd_key], errors[sd_key], errors[key]), sd_min)
    lacks = f", which has no type {name}" if where == "priors" and values.get("types") else ""
    return LearnedPriors(path, params, f"by {trucks:.0f} trucks of {path.name}{lacks}")


def _table(values: Mapping[str, Any], name: str, what: str) -> tuple[str, Mapping[str, Any]]:
    """Name and values of the table of the type `name`, else of all trucks."""
    schema, types = values.get("schema"), values.get("types", {})
    if schema != SCHEMA:
        shown = "nothing" if schema is None else repr(schema)
        why = f"schema must be '{SCHEMA}', got {shown}: write it with oncenter fleet priors of this version"
        raise refusal(f"{what}: {why}", _CODE)
    by_type = isinstance(types, dict) and name in types
    where, table = (f"types.{name}", types[name]) if by_type else ("priors", values.get("priors"))
    if not isinstance(table, dict) or not isinstance(types, dict):
        missing = where if isinstance(types, dict) else "types"
        raise refusal(f"{what} has no table [{missing}]: write it with oncenter fleet priors", _CODE)
    keys = ("trucks", *KEYS, *map(error_key, KEYS))
    for key in sorted(table.keys() - keys):
        raise refusal(f"{what}: {where}.{key} is not a key of such a file{did_you_mean(key, keys)}", _CODE)
    return where, table


def _value(table: Mapping[str, Any], key: str, bounds: tuple[float, float], where: str) -> float:
    value, (low, high) = table.get(key), bounds
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        shown = "nothing" if value is None else repr(value)
        raise refusal(f"{where}.{key} must be a number from {low:g} to {high:g}, got {shown}", _CODE)
    return float(value)
