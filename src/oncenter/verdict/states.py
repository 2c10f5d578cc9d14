"""The states of a verdict: one code, one word, one mark, one colour each, for all pages, terminals, tables and JSON.

A word and a mark, since a colour alone is not visible to everybody, nor on every printer.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, NamedTuple

Code = Literal[
    "recalibrate",
    "over",
    "within",
    "undecided",
    "repair",
    "signal_or_sensor",
    "check_signal",
    "no_correction",
    "no_offset",
    "ok",
    "check",
    "not_measured",
]


class State(NamedTuple):
    """`colour` is a name of `COLOURS`; `about` completes the word on a page of many trucks."""

    word: str
    mark: str
    colour: str
    about: str


class Colour(NamedTuple):
    """The shades of one colour: as text on a light and on a dark page, and in figures, readable on both.

    Those in figures stay apart without one of the eye's three cones: tests/test_colours.py.
    """

    light: str
    dark: str
    figure: str


COLOURS: Mapping[str, Colour] = {
    "good": Colour("#1d7a54", "#4cc38f", "#4ba391"),
    "open": Colour("#1f66bd", "#6fb0ff", "#496bad"),
    "bad": Colour("#c0372b", "#ff7a6b", "#e35c54"),
    "near": Colour("#a8500f", "#f0985a", "#d28100"),
    "fault": Colour("#7d46b3", "#c39af0", "#9581f4"),
    "warn": Colour("#7f6000", "#dcb73a", "#7f6516"),
    "muted": Colour("#5b626b", "#a0a7b0", "#656876"),
}

OF_OFFSET: Mapping[Code, State] = {
    "recalibrate": State("Recalibrate", "!", "bad", "whole interval beyond the limit"),
    "over": State("Over the limit", "!", "near", "beyond it, but the number must not be set"),
    "repair": State("Repair", "!", "fault", "steering wheel angle sensor"),
    "signal_or_sensor": State("Signal or sensor", "?", "warn", "check both"),
    "check_signal": State("Check the signal", "?", "warn", "the file or the assignment of a signal"),
    "undecided": State("Undecided", "?", "open", "limit inside the interval, or offset not valid"),
    "within": State("Within the limit", "✓", "good", "whole interval within the limit"),
    "no_correction": State("No correction", "–", "muted", "relative sensor: another zero at each start"),
    "no_offset": State("Not determined", "–", "muted", "more driving needed"),
}
OF_PARTS: Mapping[Code, State] = {
    "ok": State("OK", "✓", "good", "no fault found"),
    "check": State("Check", "!", "warn", "whole interval beyond the threshold of a check"),
    "repair": OF_OFFSET["repair"],
    "signal_or_sensor": OF_OFFSET["signal_or_sensor"],
    "check_signal": OF_OFFSET["check_signal"],
    "undecided": OF_OFFSET["undecided"],
    "not_measured": State("Not measured", "–", "muted", "not identified, or not used"),
}
STATES: Mapping[Code, State] = {**OF_OFFSET, **OF_PARTS}

AT_FAULT: tuple[Code, ...] = ("check_signal", "signal_or_sensor", "repair")  # whatever the limit
TO_DO: tuple[Code, ...] = ("check", *AT_FAULT)  # of free play and sensors


def colour_of(code: Code) -> str:
    """The colour in figures, as hexadecimal RGB."""
    return COLOURS[STATES[code].colour].figure


def style() -> str:
    """CSS: each colour as `--NAME`, light, dark and printed; `--state` within an element of a code's class."""
    light, dark = (_shades(place) for place in (0, 1))
    states = "".join(f".{code}{{--state:var(--{state.colour})}}" for code, state in STATES.items())
    shades = f":root{{{light}}}@media (prefers-color-scheme:dark){{:root{{{dark}}}}}@media print{{:root{{{light}}}}}"
    return f"{shades}{states}\n"


def _shades(place: int) -> str:
    return "".join(f"--{name}:{shades[place]};" for name, shades in COLOURS.items())
