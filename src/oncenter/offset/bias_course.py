"""How far the yaw rate bias moved during a drive, surely: what the alarm of 5.3.1's CUSUM does not measure."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from oncenter.signals import DEGREE

_HALF_WIDTH_MAX_RAD_S = 0.25 * DEGREE  # wider intervals say nothing


class BiasCourse:
    """Takes the core's outputs in order of time. Two times whose 95 % intervals exclude each other have another bias.

    Attributes:
        moved_rad_s: the largest distance of two such intervals, 0 where all have a value in common.
    """

    def __init__(self) -> None:
        self._highest_low, self._lowest_high = -np.inf, np.inf

    def take(self, outputs: npt.NDArray[Any]) -> None:
        """oc_output rows; those without an identified bias are ignored."""
        half_width = 1.96 * outputs["yaw_rate_bias_sd"]
        identified = (half_width > 0.0) & (half_width < _HALF_WIDTH_MAX_RAD_S)
        if not identified.any():
            return
        bias, half_width = outputs["yaw_rate_bias"][identified], half_width[identified]
        self._highest_low = max(self._highest_low, float(np.max(bias - half_width)))
        self._lowest_high = min(self._lowest_high, float(np.min(bias + half_width)))

    @property
    def moved_rad_s(self) -> float:
        return max(self._highest_low - self._lowest_high, 0.0)
