"""Findings: statements about a drive beyond its numbers, each with a code, a severity, a text and a value.

The text has three parts in this order: the observation with its number and unit, its effect on the straight-ahead
offset, and the action for the user, which an info may leave out. Its first sentence begins in lower case and its last
one has no full stop: `capitalised` and the pages add both. `docs/reference/findings.md` has a section for each code,
which `oncenter explain CODE` prints.

The table has a row for each finding on an answer of the core; its rule and its text are in `core_findings` or
`joint_findings`. Degrees here: findings are for people and files.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

PLAY_STANDARD_DEG = 15.0  # maintenance standard, thesis 2.1
_DEMAND_STEP_S = 60.0  # a driver cannot plan seconds


@dataclass(frozen=True)
class Finding:
    """`severity` is info, warning or error; `value` is in `unit`, as files give it."""

    code: str
    severity: str
    text: str
    value: float | None = None
    unit: str | None = None

    def to_dict(self) -> dict[str, Any]:
        return {
            "code": self.code,
            "severity": self.severity,
            "text": self.text,
            "value": self.value,
            "unit": self.unit,
        }

    def line(self) -> str:
        """For a terminal, "warning: the steering has ... (steering_play)": the code is the one to explain."""
        return f"{self.severity}: {self.text} ({self.code})"


EXPLAINED = "more about a finding: oncenter explain CODE"  # under a list of such lines


def most_severe_first(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Errors, warnings, then infos; within each as given."""
    rank = {"error": 0, "warning": 1, "info": 2}
    return tuple(sorted(findings, key=lambda finding: rank[finding.severity]))


def demand(lacking_s: float) -> str:
    """The driving time to ask for, "60 s": whole minutes, never less than what is lacking."""
    return f"{_DEMAND_STEP_S * math.ceil(lacking_s / _DEMAND_STEP_S):.0f} s"


def bends_demand(lacking_s: dict[str, float]) -> str:
    """ "at least 60 s of right-hand bends", from the seconds that are lacking by side."""
    return "at least " + " and ".join(f"{demand(s)} of {side}-hand bends" for side, s in lacking_s.items())


def capitalised(text: str) -> str:
    """With a capital first letter; a file or signal name in first place stays as it is."""
    first = text.partition(" ")[0].rstrip(",:;")
    return text[:1].upper() + text[1:] if first.replace("-", "").isalpha() else text


class Row(NamedTuple):
    """Default severity and unit of a code's value, and its condition in words."""

    severity: str
    unit: str | None
    condition: str


TABLE = {
    # of all methods
    "steering_wheel_angle_sensor_at_fault": Row("error", None, "the sensor check found a fault: the offset is invalid"),
    "signals_not_available": Row("warning", "s", "a signal is missing for a good part of the duration"),
    "gate_shut": Row("warning", "m/s^2", "fast for long enough, but no second passed the gate"),
    "steering_wheel_angle_offset": Row("warning", "deg", "valid, and its whole interval beyond a healthy sensor's"),
    "yaw_rate_bias": Row("warning", "deg/s", "not small; info where it was corrected and is not large"),
    "yaw_rate_bias_moves": Row("warning", "s", "alarm of 5.3.1's CUSUM; info where it has passed"),
    "lateral_acceleration_at_standstill": Row("warning", "m/s^2", "not small at standstill"),
    "yaw_rate_coarse": Row("warning", "deg/s", "the steps of the yaw rate are coarse"),
    "recorded_slowly": Row("warning", "Hz", "the angle was recorded below 20 Hz, and resampled"),
    "relative_angle_sensor": Row("info", None, "the sensor reports an arbitrary zero (SPN 1812 = 0)"),
    "not_enough_evidence": Row("info", "s", "fewer usable seconds than the method needs"),
    # limits of the methods thesis and wheel-speed
    "understeer_gradient_unknown": Row("info", "s", "the gradient is unobservable: taken as zero"),
    "play_not_seen": Row("info", "deg", "whenever seconds were used"),
    # of the joint method
    "bends_changed": Row("info", "s", "a change that was not one of the offset"),
    "offset_corrected_by_sender": Row("warning", "deg", "the offset changed from large to nearly zero"),
    "straight_ahead_moved": Row("info", "deg", "a change smaller than that of a remounted sensor"),
    "offset_changed": Row("warning", "deg", "the offset changed otherwise, by more than its interval"),
    "steering_play": Row("warning", "deg", "valid, and beyond the maintenance standard"),
    "unloading_off_zero": Row("warning", "m/s^2", "valid, and its whole interval away from zero"),
    "roads_fall_to_other_side": Row("warning", "%", "the mean bank contradicts the vehicle file's traffic side"),
    "lateral_acceleration_moves": Row(
        "warning", "m/s^2", "the zero moves more than road bank can; info where only the joint method suspects it"
    ),
    "wheelbase_or_ratio": Row("info", "m", "valid, and its whole interval away from the vehicle file's"),
    "one_flank_seen": Row("warning", "s", "evidence enough, but too little lateral force to a side"),
    "no_understeer": Row("warning", "deg/(m/s^2)", "evidence enough, but the gradient is not positive"),
    "another_load_would_help": Row("info", None, "several logs, and their gradients hardly differ"),
    "interval": Row("info", "deg", "whenever the offset is observable"),
}


def from_table(
    code: str, text: str, value: float | None = None, *, severity: str | None = None, unit: str | None = None
) -> Finding:
    """The finding of a row of the table; `severity` and `unit` where they are not the row's."""
    row = TABLE[code]
    return Finding(code, severity or row.severity, text, value, None if value is None else unit or row.unit)
