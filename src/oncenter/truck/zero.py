"""The zero of a truck's angle sensor over its drives: whether its offsets agree, and if not, what fits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from oncenter.signals import DEGREE
from oncenter.truck.drives import Numbers

# "fixed": one offset, or one step; "relative": another value at each start; "moves": several steps, or a drift.
Zero = Literal["fixed", "relative", "moves"]

# Tuned on seeds 1 to 60 of bench/drives_that_differ.py.
_DRIVES_MIN = 4
_SURE_RAD = 1.0 * DEGREE  # sd of a drive that can contradict others
_SCATTER_MIN_RAD, _SCATTER_SDS = 0.5 * DEGREE, 4.0  # of the drives about the steps that were found
_OTHER_RAD, _OTHER_SDS = 0.8 * DEGREE, 4.0  # from which two drives have different offsets
_OTHERS_SHARE = 0.45  # of a relative sensor's neighbours that differ
_INDEPENDENT_MIN = 0.35  # von Neumann's ratio: 1 for independent values, 0 for a slow drift
_STEPS_WITHIN, _STEPS_MIN = (
    12,
    2,
)  # drives, and steps in them to one side from which the sensor is loose; a step back is
# a calibration


def zero_of(offsets: Numbers, sds: Numbers, steps: Sequence[int]) -> Zero:
    """
    Args:
        offsets, sds: of one truck's drives in order of time, rad.
        steps: the first drives of new offsets that were found.
    """
    sure = sds < _SURE_RAD
    steps = sorted({int(np.sum(sure[:at])) for at in steps})
    offsets, sds, count = offsets[sure], sds[sure], int(np.sum(sure))
    if count < _DRIVES_MIN:
        return "fixed"
    if _scatters(offsets, sds, steps):
        change = np.diff(offsets)
        differs = np.abs(change) > np.maximum(_OTHER_RAD, _OTHER_SDS * np.hypot(sds[1:], sds[:-1]))
        independent = float(np.mean(change**2) / (2.0 * np.var(offsets)))
        is_relative = np.mean(differs) > _OTHERS_SHARE and independent > _INDEPENDENT_MIN
        return "relative" if is_relative else "moves"
    sizes = np.diff([np.median(part) for part in _parts(offsets, steps)])
    recent = sizes[[at >= count - _STEPS_WITHIN for at in steps if 0 < at < count]]
    goes_on = len(recent) >= _STEPS_MIN and (np.all(recent > 0.0) or np.all(recent < 0.0))
    return "moves" if goes_on or len(recent) > _STEPS_MIN else "fixed"


def _parts(offsets: Numbers, steps: Sequence[int]) -> list[Numbers]:
    return [part for part in np.split(offsets, steps) if len(part)]


def _scatters(offsets: Numbers, sds: Numbers, steps: Sequence[int]) -> bool:
    """Whether the drives differ by more than the steps, without the worst of every eight drives."""
    apart = np.concatenate([part - np.median(part) for part in _parts(offsets, steps)])
    kept = np.argsort(np.abs(apart))[: len(apart) - max(1, len(apart) // 8)]
    scatter = float(np.sqrt(np.mean(apart[kept] ** 2)))
    return scatter > _SCATTER_MIN_RAD and scatter > _SCATTER_SDS * float(np.median(sds))
