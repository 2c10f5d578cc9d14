"""The spellings of units in files, and their factors to SI."""

from __future__ import annotations

import re

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.signals import PURE_NUMBER, SIGNALS, Quantity, SignalName

TIME = Quantity("s", {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "d": 86400.0})

NOMINAL_WHEEL_RADIUS_M = 0.5  # rolling radius of a 295/80 R22.5 tyre, rounded

# Spellings in the form that `_plain` gives.
_SPELLINGS = {
    "°": "deg",
    "degree": "deg",
    "degrees": "deg",
    "grad": "deg",  # German for degree; gon (1/400 turn) is not used for steering
    "degs": "deg",
    "°grad": "deg",
    "unit_degreofarc": "deg",  # as the databases of Volkswagen write units
    "unit_degreofarcpersecon": "deg_s",
    "unit_kilometerperhour": "km_h",
    "unit_meterpersecon": "m_s",
    "unit_meterpersecosquar": "m_s2",
    "unit_meterperseconsquar": "m_s2",
    "unit_forceofgravi": "g",
    "unit_newtometer": "nm",
    "radian": "rad",
    "radians": "rad",
    "deg/s": "deg_s",
    "°/s": "deg_s",
    "grad/s": "deg_s",
    "degree/s": "deg_s",
    "degrees/s": "deg_s",
    "dps": "deg_s",
    "rad/s": "rad_s",
    "radian/s": "rad_s",
    "radians/s": "rad_s",
    "1/s": "rad_s",
    "m/s": "m_s",
    "mps": "m_s",
    "km/h": "km_h",
    "kph": "km_h",
    "kmh": "km_h",
    "kmph": "km_h",
    "km/hr": "km_h",
    "km^h": "km_h",
    "mi/h": "mph",
    "miles/h": "mph",
    "m/s2": "m_s2",
    "m/s/s": "m_s2",
    "mps2": "m_s2",
    "m/ss": "m_s2",
    "nm": "nm",
    "n*m": "nm",
    "n.m": "nm",
    "n-m": "nm",
    "newtonmeter": "nm",
    "newtonmetre": "nm",
    "µs": "us",
    "sec": "s",
    "seconds": "s",
    "minute": "min",
    "minutes": "min",
    "hour": "h",
    "hours": "h",
    "day": "d",
    "days": "d",
    "": "1",
    "-": "1",
}
_ALIKE = str.maketrans({"º": "°", "˚": "°", "²": "2", "·": "*", "⋅": "*", "μ": "µ", "\N{REPLACEMENT CHARACTER}": "°"})
_SECOND = re.compile(r"/(?:sec|second|sek)(?![a-z])")


def _plain(written: str) -> str:
    """A unit without case, blanks and brackets, and with one spelling for degrees, squares and seconds.

    A degree sign or a square may arrive as two characters (UTF-8 decoded as Latin-1, once or twice), or as the
    replacement character of a byte that is not UTF-8.
    """
    text = written.strip().strip("[]()").lower().replace(" ", "")
    for mangled, meant in _MANGLED:
        text = text.replace(mangled, meant)
    if text.startswith("m/s"):
        text = text.replace("\N{REPLACEMENT CHARACTER}", "2")
    text = text.translate(_ALIKE).replace("**", "^").replace("^2", "2")
    for exponent, divided in (("*s^-1", "/s"), ("*s-1", "/s"), ("*s^-2", "/s2"), ("*s-2", "/s2")):
        text = text.replace(exponent, divided)
    return _SECOND.sub("/s", text)


def _encoded_again(sign: str) -> list[str]:
    """Lower-case spellings of a sign whose UTF-8 was decoded as Latin-1 or Windows-1252, twice first, then once."""
    once = sign.encode().decode("latin-1")
    twice = [once.encode().decode(encoding, "replace") for encoding in ("latin-1", "cp1252")]
    return [text.lower() for text in (*twice, once)]


_MANGLED = [(mangled, sign) for sign in "°²µ" for mangled in _encoded_again(sign)]


def factors(signal: str) -> dict[str, float]:
    """The units that files may use for a signal, each with its factor to SI."""
    known = dict(SIGNALS[signal].quantity.factors)
    if signal.startswith("wheel_speed_"):
        known["rad_s"] = NOMINAL_WHEEL_RADIUS_M
    return known


def unit_key(written: str, known: dict[str, float]) -> str | None:
    """The key of `known` for a unit as spelled in a file, or None."""
    text = written.strip()
    for candidate in (text, text.lower(), _plain(text), _SPELLINGS.get(_plain(text), "")):
        if candidate in known:
            return candidate
    return None


def is_unit(written: str) -> bool:
    """Whether it is a unit of any quantity."""
    quantities = (TIME, *(signal.quantity for signal in SIGNALS.values() if signal.quantity is not PURE_NUMBER))
    return any(unit_key(written, dict(quantity.factors)) is not None for quantity in quantities)


def unit_by_suffix(name: str, known: dict[str, float]) -> str | None:
    """The unit that a column's name ends with, the longest that fits, or None."""
    ending = [unit for unit in known if name.lower().endswith("_" + unit)]
    return max(ending, key=len, default=None)


def possible_columns(signal: str) -> tuple[str, ...]:
    """The possible names of a file's column for this signal."""
    if SIGNALS[signal].quantity is PURE_NUMBER:
        return (signal,)
    return tuple(f"{signal}_{unit}" for unit in factors(signal))


def named_unit(signal: str, entry: SignalName, known: dict[str, float], unit_in_file: str | None = None) -> str:
    """The unit of a `[signals]` entry: its own, else the file's, else the suffix of its name.

    Raises:
        OncenterError: there is no unit, or it does not fit the signal.
    """
    choices = " or ".join(f'"{unit}"' for unit in known)
    if entry.unit is not None:
        unit = unit_key(entry.unit, known)
        if unit is None:
            raise OncenterError(
                f"[signals] {signal}: unknown unit {entry.unit!r}, expected {choices}",
                code="unknown_unit",
                exit_code=WRONG_USAGE,
                needs=(signal,),
            )
        return unit
    unit = unit_key(unit_in_file, known) if unit_in_file else unit_by_suffix(entry.name, known)
    if unit is None:
        if list(known) == ["1"]:
            return "1"
        has = f"has unit {unit_in_file!r}, which does not fit: check the name, or" if unit_in_file else "has no unit:"
        raise OncenterError(
            f"[signals] {signal}: {entry.name!r} {has} give unit = {choices}",
            code="unit_missing",
            exit_code=WRONG_USAGE,
            needs=(signal,),
        )
    return unit
