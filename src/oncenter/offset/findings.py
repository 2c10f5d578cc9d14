"""What is worth telling about a drive beyond its numbers: a finding in words, with a code, a severity, a value.

The table has a row for each finding on an answer of the core; its rule and its text are in `core_findings` or
`joint_findings`. Degrees here: findings are for people and files.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

PLAY_STANDARD_DEG = 15.0  # maintenance standard, thesis 2.1


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


def gravest_first(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Errors, warnings, then infos; within each as given."""
    rank = {"error": 0, "warning": 1, "info": 2}
    return tuple(sorted(findings, key=lambda finding: rank[finding.severity]))


def capitalised(text: str) -> str:
    """As a sentence begins; the name of a file or a signal, where it comes first, stays as it is."""
    first = text.partition(" ")[0].rstrip(",:;")
    return text[:1].upper() + text[1:] if first.replace("-", "").isalpha() else text


class Row(NamedTuple):
    """Of a code: its severity and the unit of its value, unless the rule gives others, and the condition in words."""

    severity: str
    unit: str | None
    condition: str


TABLE = {
    # what the core says by any method
    "steering_wheel_angle_sensor_at_fault": Row("error", None, "the sensor check found a fault: the offset is invalid"),
    "signals_not_available": Row("warning", "s", "a signal is missing for a good part of the duration"),
    "gate_shut": Row("warning", "m/s^2", "fast for long enough, and no second passed the gate"),
    "steering_wheel_angle_offset": Row("warning", "deg", "valid, and its whole interval beyond a healthy sensor's"),
    "yaw_rate_bias": Row("warning", "deg/s", "not small; info where it was corrected and is not large"),
    "yaw_rate_bias_moves": Row("warning", "s", "5.3.1's CUSUM alarmed; info where it passed and nothing rests on it"),
    "lateral_acceleration_at_standstill": Row("warning", "m/s^2", "not small at standstill"),
    "yaw_rate_coarse": Row("warning", "deg/s", "the steps of the yaw rate are coarse"),
    "recorded_slowly": Row("warning", "Hz", "the angle was recorded below 20 Hz, and resampled"),
    "relative_angle_sensor": Row("info", None, "the sensor says that its zero is arbitrary (SPN 1812 = 0)"),
    "not_enough_evidence": Row("info", "s", "fewer seconds were used than the method asks for"),
    # what the methods thesis and wheel-speed lack
    "understeer_gradient_unknown": Row("info", "s", "the gradient is unobservable: taken as zero"),
    "play_not_seen": Row("info", "deg", "whenever seconds were used"),
    # what the joint method alone can say
    "bends_changed": Row("info", "s", "a change that was not one of the offset"),
    "offset_corrected_by_sender": Row("warning", "deg", "the offset changed from large to nearly zero"),
    "straight_ahead_moved": Row("info", "deg", "the offset changed by less than a sensor that was remounted"),
    "offset_changed": Row("warning", "deg", "the offset changed otherwise, by more than its interval"),
    "steering_play": Row("warning", "deg", "valid, and beyond the maintenance standard"),
    "unloading_off_zero": Row("warning", "m/s^2", "valid, and its whole interval away from zero"),
    "roads_fall_to_other_side": Row("warning", "%", "the mean bank is against the vehicle file's traffic side"),
    "lateral_acceleration_moves": Row(
        "warning", "m/s^2", "the bank moves more than roads do; info where only the joint method finds its zero to move"
    ),
    "wheelbase_or_ratio": Row("info", "m", "valid, and its whole interval off the vehicle file's"),
    "one_flank_seen": Row("warning", "s", "evidence enough, but too little side force to a side"),
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
