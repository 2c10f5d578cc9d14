"""Summary of one drive for its truck's model: some twelve numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from oncenter import _core
from oncenter.signals import DEGREE
from oncenter.tuned import PRIORS
from oncenter.vehicle import Vehicle

Numbers = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Summary:
    """The summary of one drive. SI and rad; NaN where not identified.

    `offset` is the sensor reading at the neutral lateral acceleration, `offset_sd` of this drive's part of its
    uncertainty. `with_unloading` and `with_play` are the offset's covariances with the neutral lateral acceleration and
    with the play. `bank` is the mean of lateral acceleration less r*v while driving, `standing` the mean lateral
    acceleration at standstill. Without an accelerometer the neutral acceleration is not identified. `side` is 1 where
    traffic keeps right, -1 left, 0 not configured.
    """

    offset: float
    offset_sd: float
    gradient: float  # rad/(m/s^2)
    gradient_sd: float
    unloading: float  # m/s^2
    unloading_sd: float
    play: float  # rad
    play_sd: float
    with_unloading: float  # rad m/s^2
    with_play: float  # rad^2
    bank: float  # m/s^2
    standing: float  # m/s^2
    ratio: float
    side: float


def offset_alone(offset: float, offset_sd: float, ratio: float, side: float) -> Summary:
    """The summary of a drive of which only the offset is left."""
    (gradient, gradient_sd), (play, play_sd) = PRIORS["GRADIENT"], PRIORS["WIDTH"]
    lost = math.nan
    return Summary(
        offset=offset,
        offset_sd=offset_sd,
        gradient=gradient,
        gradient_sd=gradient_sd,
        unloading=lost,
        unloading_sd=lost,
        play=play,
        play_sd=play_sd,
        with_unloading=lost,
        with_play=0.0,
        bank=lost,
        standing=lost,
        ratio=ratio,
        side=side,
    )


def summary_of(native: _core.OcAnswer, vehicle: Vehicle, params: Mapping[str, float]) -> Summary:
    """The summary of the joint method's oc_answer. Configured values of pull and accelerometer bias in `params` are
    subtracted, so that those of the truck are zero on average: the core subtracted a configured pull from the
    offset."""
    bias = params["known_accelerometer_bias_m_s2"] if params["known_accelerometer_bias_sd_m_s2"] > 0.0 else 0.0
    pull = params["known_pull_m_s2"] if params["known_pull_sd_m_s2"] > 0.0 else 0.0
    measures = 1.0 if params["use_accelerometer"] else math.nan
    offset, gradient = native["offset"], native["understeer_gradient"]
    unloading, play = native["unloading_acceleration"], native["backlash"]
    standing = native["standstill_lateral_acceleration"]
    stood = _core.status_of(standing) == "valid"
    together = native["offset_covariances"]
    return Summary(
        offset=offset["value"],
        offset_sd=native["offset_parts"]["drive_sd"],
        gradient=gradient["value"],
        gradient_sd=gradient["standard_deviation"],
        unloading=measures * (unloading["value"] - bias - pull),
        unloading_sd=measures * unloading["standard_deviation"],
        play=play["value"],
        play_sd=play["standard_deviation"],
        with_unloading=measures * together["unloading_acceleration"],
        with_play=together["backlash"],
        bank=measures * (native["bank_mean"] - bias) if native["bank_time"] > 0.0 else math.nan,
        standing=measures * (standing["value"] - bias) if stood else math.nan,
        ratio=vehicle.ratio_near_centre,
        side=vehicle.traffic_sign,
    )


GRADIENT_MIN = 0.1 * DEGREE  # rad/(m/s^2): below it play looks like a gradient (finding no_understeer)


def is_usable(status: str, gradient: float) -> bool:
    """Whether a truck's model can use a drive with this status of the offset and this understeer gradient."""
    return status in ("valid", "converging") and gradient >= GRADIENT_MIN


@dataclass(frozen=True)
class Summaries:
    """Summaries of many trucks' drives, each member of shape (trucks, drives), in order of time; NaN after the last
    drive of a truck."""

    offset: Numbers
    offset_sd: Numbers
    gradient: Numbers
    gradient_sd: Numbers
    unloading: Numbers
    unloading_sd: Numbers
    play: Numbers
    play_sd: Numbers
    with_unloading: Numbers
    with_play: Numbers
    bank: Numbers
    standing: Numbers
    ratio: Numbers
    side: Numbers


def together(trucks: Sequence[Sequence[Summary]]) -> Summaries:
    """The tables of trucks with at least one drive each."""
    most = max(len(drives) for drives in trucks)
    table = np.full((len(fields(Summary)), len(trucks), most), math.nan)
    names = [field.name for field in fields(Summary)]
    for n, drives in enumerate(trucks):
        for d, drive in enumerate(drives):
            table[:, n, d] = [getattr(drive, name) for name in names]
    return Summaries(**dict(zip(names, table, strict=True)))
