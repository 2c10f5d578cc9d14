"""The study of 5.5.2 for the thesis's method: trade-off of the gate of Table 4 between evidence and error.

One limit varies at a time. `flawless` drives have no play and sensors without bias, so the remaining error comes from
the gate; `ordinary` drives are those of the matrix.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from accuracy_rows import ROWS, drive

import oncenter as oc
from oncenter.signals import DEGREE

# For each limit: its name in the thesis, its unit, its format on the page, and its values, including that of Table 4.
LIMITS: dict[str, tuple[str, str, tuple[float, ...]]] = {
    "curvature_max_1_m": ("R_max", "m", (1 / 400, 1 / 600, 1 / 800, 1 / 1200, 1 / 2000)),
    "longitudinal_acceleration_max_m_s2": ("dv/dt_max", "m/s²", (0.1, 0.2, 0.3, 0.5, 1.0)),
    "bank_max_m_s2": ("a_y,max", "m/s²", (0.15, 0.2, 0.3, 0.5, 1.0)),
    "clean_time_s": ("t1", "s", (0.5, 1.0, 2.0, 4.0, 8.0)),
}
TABLE_4 = {
    "curvature_max_1_m": 1 / 800,
    "longitudinal_acceleration_max_m_s2": 0.3,
    "bank_max_m_s2": 0.3,
    "clean_time_s": 2.0,
}
NO_FAULT = {"backlash_deg": 0.0, "yaw_rate_bias_deg_s": 0.0, "lateral_acceleration_bias_m_s2": 0.0}
STUDIED = {
    "flawless": dataclasses.replace(ROWS["ordinary"], name="flawless", fixed=NO_FAULT),
    "ordinary": ROWS["ordinary"],
}


@dataclasses.dataclass(frozen=True)
class Point:
    """One limit at one value on one row: medians over its drives, the error over those with a value."""

    row: str
    limit: str
    value: float
    used_s: float
    answered: float  # share with a value
    error_deg: float  # median of the absolute
    error_p95_deg: float


def shown(limit: str, value: float) -> float:
    """The value in the thesis's form: a radius for a curvature."""
    return 1.0 / value if limit == "curvature_max_1_m" else value


def study(seeds: Sequence[int], folder: Path) -> list[Point]:
    """The points by row, limit and value."""
    points = []
    for name, row in STUDIED.items():
        drives = [drive(row, seed, folder) for seed in seeds]
        for limit, (_, _, values) in LIMITS.items():
            for value in values:
                answers = [
                    (oc.offset(d.signals, d.vehicle, method="thesis", params={limit: value}), d.target_rad[-1])
                    for d in drives
                ]
                errors = [
                    abs(answer.offset.value - target) / DEGREE
                    for answer, target in answers
                    if answer.offset.value is not None
                ]
                points.append(
                    Point(
                        name,
                        limit,
                        value,
                        float(np.median([answer.used_s for answer, _ in answers])),
                        len(errors) / len(drives),
                        float(np.median(errors)) if errors else np.nan,
                        float(np.quantile(errors, 0.95)) if errors else np.nan,
                    )
                )
    return points
