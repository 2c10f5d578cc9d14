"""The questions that `oncenter vehicle new` asks in a terminal, one key after the other."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Collection
from typing import Any

from oncenter.errors import OncenterError
from oncenter.vehicle import vehicle_from
from oncenter.vehicle_keys import KEYS, Key

PROMPTED = (
    "name",
    "wheelbase_m",
    "steering_ratio",
    "axle_layout",
    "track_width_front_m",
    "track_width_rear_m",
    "traffic_side",
    "dbc",
    "offset_applied_deg",
)
_MEANING = {"dbc": "CAN database of this truck's logs, for logs that are not J1939: .dbc .kcd .sym .arxml."}
_WIDTH = 100  # characters of a line


def answers(
    ask: Callable[[str], str], say: Callable[[str], None], name: str, given: Collection[str] = ()
) -> dict[str, Any]:
    """The values that a person gives, as a vehicle file holds them.

    Args:
        ask: shows a prompt and returns one line.
        say: shows a line.
        name: the truck's name where the person gives none.
        given: keys that have a value already: no question.
    """
    values: dict[str, Any] = {}
    for key in (KEYS[each] for each in PROMPTED if each not in given):
        say("")
        for text in filter(None, (f"{key.name}: {_MEANING.get(key.name, key.meaning)}", key.where)):
            say(textwrap.fill(text, _WIDTH, subsequent_indent="  "))
        value = _answer(key, name, ask, say)
        if value is not None:
            values[key.name] = value
        elif key.name == "name":
            values["name"] = name
    return values


def _answer(key: Key, name: str, ask: Callable[[str], str], say: Callable[[str], None]) -> Any:
    """The first valid answer; None for an empty one."""
    unusual = None
    while True:
        written = ask(_prompt(key, name)).strip()
        if not written:
            return None
        try:
            value = parsed(key, written)
        except OncenterError as error:
            say(f"  {error}")
            continue
        if value == unusual or not isinstance(value, float) or not key.is_unusual(value):
            return value
        say(f"  {key.about_unusual(value)}; enter it again if it is right")
        unusual = value


def _prompt(key: Key, name: str) -> str:
    unknown = "leave out: estimated from the drive"
    default = {"name": name, "wheelbase_m": unknown, "steering_ratio": unknown}
    empty = default.get(key.name, "leave out")
    unit = f" in {key.unit}" if key.unit else ""
    choices = f" ({', '.join(key.choices)})" if key.choices else ""
    if key.name == "dbc":  # a person names a file from here; the vehicle file gets the path from its own folder
        choices = ", relative to the current folder, several with commas between them"
    return f"{key.name}{unit}{choices} [{empty}]: "


def parsed(key: Key, written: str) -> Any:
    """A value from the text that a person wrote; a comma is a decimal point, except in lists.

    Raises:
        OncenterError: "vehicle_file", exit code 2: a vehicle file does not accept it.
    """
    value = _value(key, written)
    try:
        vehicle_from({key.name: value}, "")
    except OncenterError as error:
        message = str(error).removeprefix("vehicle file : ")
        raise OncenterError(message, code=error.code, exit_code=error.exit_code) from None
    return value


def _value(key: Key, written: str) -> Any:
    if key.name == "dbc":
        return [path.strip() for path in written.split(",") if path.strip()]
    if not isinstance(key.example, float):
        return written
    if key.name == "steering_ratio" and written.startswith("["):
        parts = [_number(part) for part in written.strip("[]").split(",")]
        return parts
    return _number(written.removesuffix(key.unit).strip().replace(",", "."))


def _number(written: str) -> float | str:
    """The number; text that is none as it is, for the vehicle's check to name."""
    try:
        return float(written)
    except ValueError:
        return written
