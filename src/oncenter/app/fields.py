"""Numbers as people write them: 3,7 m, 3700 mm, 18,5 : 1. An error names its field."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.vehicle_keys import KEYS, Key


class _Field(NamedTuple):
    """`units` are the ones that people write, without spaces, in units of the key."""

    key: Key
    units: Mapping[str, float]


_ANGLES = {"": 1.0, "deg": 1.0, "°": 1.0}
_FIELDS: Mapping[str, _Field] = {
    "wheelbase_m": _Field(
        KEYS["wheelbase_m"],
        {"": 1.0, "m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, '"': 0.0254, "ft": 0.3048},
    ),
    "steering_ratio": _Field(KEYS["steering_ratio"], {"": 1.0, ":1": 1.0}),
    "limit": _Field(KEYS["offset_limit_deg"], _ANGLES),
    "applied": _Field(KEYS["offset_applied_deg"], _ANGLES),
}
NUMBERS = tuple(_FIELDS)
_NUMBER = re.compile(r"(?:1\s*:\s*(?=\d))?([-+]?\d+(?:[.,]\d*)?)\s*(\D*|:\s*1)")  # 1:18,5 is a ratio, too


def number(field: str, form: Mapping[str, Any]) -> float:
    """In the unit of the field's key.

    Args:
        field: of `NUMBERS`.
        form: what was typed, by field.

    Raises:
        OncenterError: "vehicle_file", with the field as its need: it is not a number, or out of the key's range.
    """
    key, units = _FIELDS[field]
    written = str(form[field]).strip()
    found = _NUMBER.fullmatch(written.replace("−", "-"))
    factor = units.get(re.sub(r"\s", "", found[2]).lower()) if found else None
    if found is None or factor is None:
        written_as = " or ".join(f"{key.example:g}{unit}" for unit in list(units)[:3])
        raise wrong(field, f"not a number: {written}; write it as {written_as}")
    value = float(f"{float(found[1].replace(',', '.')) * factor:.9g}")
    if (key.low is not None and value < key.low) or (key.high is not None and value > key.high):
        other = key.other_unit(value)
        read = f"{value:g} {key.unit}".strip()
        raise wrong(field, f"{read} is out of the range {key.range}{f'; {other}' if other else ''}")
    return value


def read_back(field: str, form: Mapping[str, Any]) -> dict[str, str]:
    """The number that was read, and a sentence where trucks hardly have it.

    Raises:
        OncenterError: as `number`.
    """
    key, value = _FIELDS[field].key, number(field, form)
    unusual = f"Unusual: {key.about_unusual(value)}." if key.is_unusual(value) else ""
    return {"read": f"{value:g} {key.unit}".strip(), "unusual": unusual}


def wrong(field: str, message: str) -> OncenterError:
    return OncenterError(message, code="vehicle_file", exit_code=WRONG_USAGE, needs=(field,))
