"""Rows of drives whose evidence is one normal density, for the tests of a truck's model."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from oncenter.signals import DEGREE
from oncenter.truck.evidence import MODES, Mode, Numbers, merged
from oncenter.truck.row import Row

MONDAY_S, DAY_S = 1_772_434_800.0, 86400.0  # 2026-03-02, 7:00 UTC


def one_mode(mean: Numbers, covariance: Numbers) -> Numbers:
    """The evidence of a drive that measures offset, play and neutral lateral acceleration."""
    information: Numbers = np.linalg.inv(covariance)
    return merged([Mode(0.0, information, np.asarray(information @ mean, np.float64))], MODES)


def drive_row(
    day: float,
    offset_deg: float,
    *,
    play_deg: float = 5.0,
    neutral: float = 0.0,
    sds: tuple[float, float, float] = (0.1, 0.3, 0.02),
    with_play_deg2: float = 0.0,
    with_neutral_deg_m_s2: float = 0.0,
    **more: Any,
) -> Row:
    """A valid drive of twenty minutes, `day` days after a Monday. `sds` of offset and play, deg, and of the neutral
    acceleration, m/s^2."""
    units = np.array([DEGREE, DEGREE, 1.0])
    covariance = np.diag(np.square(sds))
    covariance[0, 1] = covariance[1, 0] = with_play_deg2
    covariance[0, 2] = covariance[2, 0] = with_neutral_deg_m_s2
    mean = np.array([offset_deg, play_deg, neutral]) * units
    values: dict[str, Any] = {
        "modes": one_mode(mean, covariance * np.outer(units, units)),
        "status": "valid",
        "gradient": 0.42 * DEGREE,
        "gradient_sd": 0.02 * DEGREE,
        "wheelbase": 0.0,
        "wheelbase_sd": 0.02,
        "friction": 0.05,
        "creep": 0.0,
        "bank": 0.2,
        "bank_variance": 1e-4,
        "standing": math.nan,
        "measured": True,
        "ratio": 19.3,
        "side": 1.0,
        "start_s": MONDAY_S + DAY_S * day,
        "length_s": 1200.0,
        "used_s": 1000.0,
        "left_s": 100.0,
        "right_s": 100.0,
    }
    return Row(**{**values, **more})
