"""The common offset of a truck's drives by their printed answers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from oncenter.offset.inputs import params_of
from oncenter.offset.several_logs import steps_between
from oncenter.truck.drives import offset_alone, together
from oncenter.truck.model import learn
from oncenter.truck.priors import priors_of
from oncenter.truck.zero import Zero
from oncenter.vehicle import Vehicle


@dataclass(frozen=True)
class Reading:
    """Of one drive: its offset and the part of its standard deviation from this drive (rad), and its neutral lateral
    acceleration (m/s^2), NaN where none is identified."""

    offset: float
    offset_sd: float
    neutral: float = math.nan
    neutral_sd: float = math.nan


@dataclass(frozen=True)
class Common:
    """rad. `own_sd` is of these drives, `whole_sd` with a pull and the crown; `since` is the first drive of it."""

    value: float
    own_sd: float
    whole_sd: float
    is_valid: bool
    since: int
    zero: Zero


def common_offset(drives: Sequence[Reading], vehicle: Vehicle) -> Common | None:
    """In order of time; None below two drives."""
    if len(drives) < 2:
        return None
    params = params_of(vehicle, None)
    priors = priors_of(params)
    summaries = [
        replace(
            offset_alone(drive.offset, drive.offset_sd, vehicle.ratio_near_centre, vehicle.traffic_sign),
            unloading=drive.neutral,
            unloading_sd=drive.neutral_sd,
            with_unloading=0.0 * drive.neutral,
        )
        for drive in drives
    ]
    every, changed = range(len(drives)), np.zeros((1, len(drives)), bool)
    for step in steps_between(summaries, every, every, priors):
        changed[0, step.at] = True
    model = learn(together([summaries]), priors, changed)
    own_sd = float(model.spread_sd[0])
    return Common(
        float(model.offset[0]),
        own_sd,
        float(model.offset_sd[0]),
        1.96 * own_sd <= params["offset_drive_half_width_max_rad"],
        model.since[0],
        model.zero[0],
    )
