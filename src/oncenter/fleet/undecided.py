"""For an undecided truck, the drive that would narrow its interval most."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from oncenter.fleet.offset_now import Offset
from oncenter.tuned import TUNED


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
    """The advice by the part of the interval that decides: the drives' own part, and for an offset that is not valid
    the larger one, which may be the part common to all drives (pull and accelerometer bias)."""
    own = sum(sd**-2.0 for sd in driven.sd) ** -0.5 if driven.sd else offset.spread_sd
    in_common = math.sqrt(max(offset.sd**2 - own**2, 0.0))
    if in_common > own and not offset.is_valid:
        if offset.load_would_help:
            return "a drive at another load"
        return "drives on other roads, or a measured pull (pull_m_s2 in the vehicle file)"
    lacking = [side for side in ("left", "right") if getattr(driven, f"{side}_s") < TUNED["joint_answer.flank_s"]]
    return f"another drive with bends {f'to the {lacking[0]}' if len(lacking) == 1 else 'both ways'}"
