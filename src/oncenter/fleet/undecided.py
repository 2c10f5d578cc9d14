"""A truck's state: its interval against the limit, and for an undecided truck the drive that would narrow it most.

The names of the states are those of `oncenter.verdict`. A single drive's verdict compares a valid offset itself with
the limit; here the whole interval decides, since the truck's next drives narrow it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from oncenter.fleet.offset_now import Offset
from oncenter.tuned import TUNED

RECALIBRATE, WITHIN, UNDECIDED, REPAIR = "recalibrate", "within", "undecided", "repair"
NO_CORRECTION, NO_OFFSET = "no_correction", "no_offset"
STATE_WORDS = {
    RECALIBRATE: "recalibrate",
    REPAIR: "sensor at fault",
    UNDECIDED: "undecided",
    WITHIN: "within the limit",
    NO_CORRECTION: "relative sensor",
    NO_OFFSET: "no offset yet",
}


def standing(value: float, sd: float, limit: float) -> str:
    """Whether the whole 95 % interval is beyond the limit on either side, within it, or neither; all in one unit."""
    half_width = 1.96 * sd
    if abs(value) - half_width > limit:
        return RECALIBRATE
    return WITHIN if abs(value) + half_width < limit else UNDECIDED


@dataclass(frozen=True)
class Driven:
    """A truck's drives since the last change of its offset.

    Attributes:
        sd: of the part of the interval that is each drive's own, deg, above 0.
        left_s, right_s: total time with lateral force clearly to that side.
    """

    sd: Sequence[float]
    left_s: float
    right_s: float


def would_decide(offset: Offset, driven: Driven) -> str:
    """The advice by the larger part of the interval: the drives' own part, or the part common to all drives (pull and
    accelerometer bias)."""
    own = sum(sd**-2.0 for sd in driven.sd) ** -0.5 if driven.sd else offset.spread_sd
    in_common = math.sqrt(max(offset.sd**2 - own**2, 0.0))
    if in_common > own:
        if offset.load_would_help:
            return "a drive at another load"
        return "drives on other roads, or a measured pull (pull_m_s2 in the vehicle file)"
    lacking = [side for side in ("left", "right") if getattr(driven, f"{side}_s") < TUNED["joint_answer.flank_s"]]
    return f"another drive with bends {f'to the {lacking[0]}' if len(lacking) == 1 else 'both ways'}"
