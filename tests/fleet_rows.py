"""Trucks of a fleet with drives at several loads, by the equations of oncenter.truck.now written out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from truck_rows import drive_row

from oncenter.signals import DEGREE
from oncenter.truck.row import Row

RATIO = 19.3
OUTLIER_M_S2 = 0.4


@dataclass(frozen=True)
class Driving:
    """`loads` are understeer gradients as shares of the usual one, in turn; `scatter_deg` is that of a drive's offset,
    `steer_deg` the sd of the steering by each load's ride height, at the steering wheel."""

    loads: tuple[float, ...] = (0.75, 1.0, 1.35)
    drives: int = 6
    scatter_deg: float = 0.12
    steer_deg: float = 0.0


THREE_LOADS = Driving()


def fleet_of(
    pull_sd: float, count: int, driving: Driving = THREE_LOADS, *, outliers: int = 0, seed: int = 1
) -> list[list[Row]]:
    """The first trucks are the outliers, whose pulls are 0.4 m/s^2 to the left and to the right in turn."""
    random = np.random.default_rng(seed)
    pulls = random.normal(0.0, pull_sd, count)
    pulls[:outliers] = [OUTLIER_M_S2 * (-1.0) ** k for k in range(outliers)]
    return [_truck(random, float(pull), driving) for pull in pulls]


def _truck(random: np.random.Generator, pull: float, driving: Driving) -> list[Row]:
    bias, region = random.normal(0.0, (0.1, 0.07))
    offset, play = random.normal(0.0, 0.5), random.normal(5.0, 1.5)
    steers = random.normal(0.0, driving.steer_deg, len(driving.loads))
    places: Sequence[int] = [day % len(driving.loads) for day in range(driving.drives)]
    gradients = 0.42 * np.array(driving.loads)[places]  # deg/(m/s^2)
    mean, rows = gradients.mean(), []
    for day, (place, gradient) in enumerate(zip(places, gradients, strict=True)):
        pulled = RATIO * (mean + 0.65 * (gradient - mean))
        wind, error = random.normal(0.0, 0.02, 2)
        rows.append(
            drive_row(
                day,
                offset + steers[place] + pulled * (pull + error) + random.normal(0.0, driving.scatter_deg),
                play_deg=play + random.normal(0.0, 0.4),
                neutral=bias + pull + wind + error,
                sds=(np.hypot(0.08, pulled * 0.02), 0.3, 0.02),
                with_neutral_deg_m_s2=pulled * 0.02**2,
                gradient=(gradient + random.normal(0.0, 0.02)) * DEGREE,
                bank=bias + 0.2 + region + random.normal(0.0, 0.07),
                ratio=RATIO,
            )
        )
    return rows
