"""What changed in mid-drive, as the joint method's watch has found it: when, what, by how much."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from oncenter.signals import DEGREE, Signals

_KINDS = ("none", "offset", "bends")  # oc_change_kind
SENSOR_MOVES_BY_DEG = 2.5  # load, ride height and wind move less: bench/effects.py, load_change_double, wind_moment


@dataclass(frozen=True)
class Change:
    """One change that the drive proved; angles in rad, None where the kind has none.

    `kind` is "offset" (the sensor reads more or less at all times: `size_rad` more than before, with its standard
    deviation `sd_rad`), "straight_ahead" (the same, but not surely by SENSOR_MOVES_BY_DEG: load, ride height or wind do
    as much) or "bends" (bends take another angle than before, straights the same). `time_s` is on the clock
    of `log`, the `drive`-th of the answer's drives, and `into_log_s` since that log's begin. A change that came between
    two logs is told at the later one's begin. `offset_after_rad` is the offset at the next change, or at the end.
    """

    kind: str
    drive: int
    log: str
    time_s: float
    into_log_s: float
    offset_before_rad: float
    offset_after_rad: float
    size_rad: float | None
    sd_rad: float | None

    def to_dict(self) -> dict[str, Any]:
        """As files hold it: degrees for radians."""
        told = self.size_rad is not None and self.sd_rad is not None
        size, half_width = (self.size_rad or 0.0) / DEGREE, 1.96 * (self.sd_rad or 0.0) / DEGREE
        return {
            "kind": self.kind,
            "log": self.log,
            "time_s": self.time_s,
            "into_log_s": self.into_log_s,
            "value": size if told else None,
            "ci95": [size - half_width, size + half_width] if told else None,
            "unit": "deg",
            "offset_before": self.offset_before_rad / DEGREE,
            "offset_after": self.offset_after_rad / DEGREE,
        }


def changes_of(native: Mapping[str, Any], found_by: Sequence[int], drives: Sequence[Signals]) -> tuple[Change, ...]:
    """The changes that the core still holds, the first one first.

    Args:
        native: the core's oc_answer as a dict.
        found_by: of each drive, how many changes had been found when it ended.
        drives: in the order in which the core saw them.
    """
    if native["changes"] == 0:
        return ()
    kept = len(native["changed"])
    numbers = range(max(0, native["changes"] - kept), native["changes"])
    found = [native["changed"][number % kept] for number in numbers]
    after = [*(later["before"] for later in found[1:]), native["offset"]["value"]]
    return tuple(
        _change(raw, offset_after, next(k for k, count in enumerate(found_by) if number < count), drives)
        for number, raw, offset_after in zip(numbers, found, after, strict=True)
    )


def _change(raw: Mapping[str, Any], after: float, drive: int, drives: Sequence[Signals]) -> Change:
    kind = _KINDS[int(raw["change"]["kind"])]
    begin = float(drives[drive].table["time_s"][0])
    time = max(raw["time"], begin)
    size = after - raw["before"]
    # what the offset went on to do after the proof counts as doubt of its size, as where it changed bit by bit
    sd = math.hypot(raw["change"]["size_sd"], 0.5 * (size - raw["change"]["size"]))
    of_offset = kind == "offset"
    return Change(
        kind=kind_of_offset(size, sd) if of_offset else kind,
        drive=drive,
        log=drives[drive].log,
        time_s=time,
        into_log_s=time - begin,
        offset_before_rad=raw["before"],
        offset_after_rad=after,
        size_rad=size if of_offset else None,
        sd_rad=sd if of_offset else None,
    )


def kind_of_offset(size: float, sd: float) -> str:
    """Of a change of the offset, rad: "offset" where it is surely more than load, ride height or wind do."""
    return "straight_ahead" if abs(size) - 1.96 * sd < SENSOR_MOVES_BY_DEG * DEGREE else "offset"
