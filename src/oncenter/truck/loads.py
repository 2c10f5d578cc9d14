"""The load of each drive of a truck, by its understeer gradient."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from oncenter.truck.evidence import Numbers
from oncenter.truck.priors import Priors
from oncenter.truck.row import Row

_GRADIENT_ERROR_MIN = 0.02  # share of the prior's mean, of a drive
_GRADIENT_MIN = 0.1  # share of the prior's mean
_NO_GRADIENT_SD = 10.0  # of the prior's mean: it counts for nothing
LOADS_DIFFER = 0.2  # of the largest gradient above the smallest: tuned, twice the scatter of one load
_SURE_GAIN = 0.8  # of a drive's own gradient, from which it is used to compare loads


@dataclass(frozen=True)
class Loads:
    """Loads of one truck; each of shape (drives,), the mean a number.

    `gradient`, rad/(m/s^2), is that of each drive, shrunk to the mean of its truck, with its variance. `load` is its
    distance from that mean, in units of the scatter of loads.
    """

    gradient: Numbers
    variance: Numbers
    mean: float
    load: Numbers
    sure: npt.NDArray[np.bool_]

    def differ_by(self) -> float:
        """The excess of the largest accurate gradient of a drive over the smallest, as a share."""
        sure = self.gradient[self.sure]
        return float(np.max(sure) / np.min(sure)) - 1.0 if len(sure) else 0.0


def loads_of(rows: Sequence[Row], priors: Priors) -> Loads:
    """A drive with an inaccurate gradient, or with none, gets its truck's mean, in which the prior counts as half a
    drive."""
    prior = priors.gradient_mean_rad_m_s2
    value = np.maximum([row.gradient for row in rows], 0.0)
    sd = [row.gradient_sd if row.has_gradient else _NO_GRADIENT_SD * prior for row in rows]
    own = np.maximum(sd, _GRADIENT_ERROR_MIN * prior) ** 2
    at_first = (priors.load_spread_1 * prior) ** 2
    weight, weight_of_prior = 1.0 / (own + at_first), 0.5 / at_first
    mean = float((weight @ value + weight_of_prior * prior) / (weight.sum() + weight_of_prior))
    between = (priors.load_spread_1 * mean) ** 2
    gain = between / (between + own)
    shrunk = np.maximum(mean + gain * (value - mean), _GRADIENT_MIN * prior)
    mean = float(weight @ shrunk / weight.sum())
    return Loads(shrunk, gain * own, mean, (shrunk / mean - 1.0) / priors.load_spread_1, gain > _SURE_GAIN)
