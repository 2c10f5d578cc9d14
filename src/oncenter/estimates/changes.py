"""Changes during a drive, found by the change detection of the joint method: time, kind and size."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from oncenter import _core
from oncenter.signals import DEGREE, Signals

SENSOR_MOVES_BY_DEG = 2.5  # load, ride height and wind change less: bench/effects.py, load_change_double, wind_moment


@dataclass(frozen=True)
class Change:
    """One change found in a drive; angles in rad, None where the kind has none.

    `kind` is "offset" (the sensor reads `size_rad` more than before at all times, with standard deviation `sd_rad`),
    "straight_ahead" (the same, but possibly less than SENSOR_MOVES_BY_DEG, as from load, ride height or wind) or
    "bends" (the angle in bends changed, the one on straights did not). `time_s` is on the clock of `log`, the
    `drive`-th of the answer's drives, and `into_log_s` since that log's begin. A change between two logs is dated to
    the begin of the later one. `offset_after_rad` is the offset at the next change, or at the end.
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
        """The change as in files: degrees instead of radians."""
        has_size = self.size_rad is not None and self.sd_rad is not None
        size, half_width = (self.size_rad or 0.0) / DEGREE, 1.96 * (self.sd_rad or 0.0) / DEGREE
        return {
            "kind": self.kind,
            "log": self.log,
            "time_s": self.time_s,
            "into_log_s": self.into_log_s,
            "value": size if has_size else None,
            "ci95": [size - half_width, size + half_width] if has_size else None,
            "unit": "deg",
            "offset_before": self.offset_before_rad / DEGREE,
            "offset_after": self.offset_after_rad / DEGREE,
        }


def changes_of(
    native: _core.OcAnswer, found_by: Sequence[int], drives: Sequence[Signals], before: int = 0
) -> tuple[Change, ...]:
    """The changes that the core keeps, in order of time.

    Args:
        native: the core's oc_answer as a dict.
        found_by: of each drive, how many changes had been found when it ended.
        drives: in the order of the run.
        before: how many changes had been found before the run.
    """
    if native["changes"] <= before:
        return ()
    kept = len(native["changed"])
    numbers = range(max(before, native["changes"] - kept), native["changes"])
    found = [native["changed"][number % kept] for number in numbers]
    after = [*(later["before"] for later in found[1:]), native["offset"]["value"]]
    return tuple(
        _change(raw, offset_after, next(k for k, count in enumerate(found_by) if number < count), drives)
        for number, raw, offset_after in zip(numbers, found, after, strict=True)
    )


def _change(raw: _core.OcChanged, after: float, drive: int, drives: Sequence[Signals]) -> Change:
    kind = _core.CHANGE_KINDS[raw["change"]["kind"]]
    begin = float(drives[drive].columns["time_s"][0])
    time = max(raw["time"], begin)
    size = after - raw["before"]
    # where the offset went on changing after the detection, as in a gradual change, the size is less certain
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
    """The kind of a change of the offset, rad: "offset" where load, ride height or wind cannot explain its size."""
    return "straight_ahead" if abs(size) - 1.96 * sd < SENSOR_MOVES_BY_DEG * DEGREE else "offset"
