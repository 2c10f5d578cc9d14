"""Ticks per second of the core and of the rivals' filters, each in its own language, over one drive in one thread."""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import drives
from accuracy_rows import known_of
from rivals import MINUTE_TICKS, Known
from rivals.autoware import autoware
from rivals.in_cpp import compiled, compiler
from rivals.openpilot import openpilot
from turns import best_of

import oncenter as oc
from oncenter._core import Core
from oncenter.simulate.scenario import read_scenario

AGREES_DEG = 1e-6  # rounding differences
NO_COMPILER = "There is no g++ here, so Autoware's and openpilot's filters run in numba."

Row = dict[str, Any]


def filters_table(ticks: int, rounds: int) -> list[Row]:
    """M ticks/s by CPU time, best of the rounds. Exits if a rival's offsets in its two languages differ."""
    ticks = max(ticks // MINUTE_TICKS, 4) * MINUTE_TICKS  # the numba rivals give a value at the end of each minute
    columns = drives.ticks(ticks)
    known = known_of(oc.vehicle("scania_r730_4x2"), read_scenario("thesis_drive"))

    def ours(method: str) -> float:
        core = Core(drives.WHEELBASE_M, drives.STEERING_RATIO, {}, drives.RATE_HZ, method=method)
        core.run(columns)
        return float(core.answer()["offset"]["value"])

    field: dict[tuple[str, str], Callable[[], float]] = {
        ("oncenter, thesis", "C99"): lambda: ours("thesis"),
        ("oncenter, joint", "C99"): lambda: ours("joint"),
        ("Autoware", "numba"): lambda: float(autoware(columns, known).value_rad[-1]),
        ("openpilot", "numba"): lambda: float(openpilot(columns, known).value_rad[-1]),
    }
    with tempfile.TemporaryDirectory() as folder:
        field.update(_in_cpp(columns, known, Path(folder)))
        offsets = {key: math.degrees(run()) for key, run in field.items()}  # numba compiles
        _check_agreement(offsets)
        best = best_of(field, rounds)
    ours_s = best["oncenter, joint", "C99"]
    return [
        {"who": who, "language": language, "mticks_s": ticks / seconds / 1e6, "of_joint": ours_s / seconds,
         "offset_deg": offsets[who, language]}
        for (who, language), seconds in best.items()
    ]  # fmt: skip


def _in_cpp(
    columns: dict[str, drives.Column], known: Known, folder: Path
) -> dict[tuple[str, str], Callable[[], float]]:
    if compiler() is None:
        return {}
    native = compiled(folder)
    return {
        ("Autoware", "C++"): lambda: native["autoware"](columns, known),
        ("openpilot", "C++"): lambda: native["openpilot"](columns, known),
    }


def _check_agreement(offsets: dict[tuple[str, str], float]) -> None:
    for (who, language), offset in offsets.items():
        if language == "C++" and not abs(offset - offsets[who, "numba"]) < AGREES_DEG:
            sys.exit(f"{who} gives {offset} deg in C++ and {offsets[who, 'numba']} deg in numba")
