"""Where a truck's interval lies to the limit; where it holds the limit, the drive that would narrow it most."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from oncenter.fleet.offset_now import Offset

BEYOND, WITHIN, UNDECIDED = "beyond", "within", "undecided"
_FLANK_S = 2.0  # of lateral force to a side until that flank of the play counts as loaded: core/joint_answer.c


def standing(value: float, sd: float, limit: float) -> str:
    """Of the whole 95 % interval to the limits on both sides; all in one unit."""
    half_width = 1.96 * sd
    if abs(value) - half_width > limit:
        return BEYOND
    return WITHIN if abs(value) + half_width < limit else UNDECIDED


@dataclass(frozen=True)
class Driven:
    """What a truck's drives since the last change left open and showed.

    Attributes:
        sd: of each drive's own part of its interval, deg, above 0.
        left_s, right_s: lateral force clearly to that side, in all of them.
    """

    sd: Sequence[float]
    left_s: float
    right_s: float


def would_decide(offset: Offset, driven: Driven) -> str:
    """For people, by the larger part of the interval: the drives' own, or that which they have in common, a pull or the
    accelerometer's bias."""
    own = sum(sd**-2.0 for sd in driven.sd) ** -0.5 if driven.sd else offset.spread_sd
    in_common = math.sqrt(max(offset.sd**2 - own**2, 0.0))
    if in_common > own:
        if offset.load_would_help:
            return "a drive at another load"
        return "drives on other roads, or a measured pull (pull_m_s2 in the vehicle file)"
    lacking = [side for side in ("left", "right") if getattr(driven, f"{side}_s") < _FLANK_S]
    return f"another drive with bends {f'to the {lacking[0]}' if len(lacking) == 1 else 'both ways'}"
