"""For an undecided truck, the drive that would narrow its interval most."""

from __future__ import annotations

import math

from oncenter.fleet.offset_now import Offset
from oncenter.tuned import TUNED


def would_decide(offset: Offset, left_s: float, right_s: float) -> str:
    """The advice by the part of the interval that decides: the drives' own part, and for an offset that is not valid
    the larger one, which may be the part common to all drives (pull and accelerometer bias).

    Args:
        left_s, right_s: total time with lateral force clearly to that side since the offset's last change.
    """
    if offset.truck.is_ambiguous:
        return "another drive, since the last ones contradict each other"
    in_common = math.sqrt(max(offset.sd**2 - offset.spread_sd**2, 0.0))
    if in_common > offset.spread_sd and not offset.is_valid:
        if offset.truck.load_would_help:
            return "a drive at another load"
        return "drives on other roads, or a measured pull (pull_m_s2 in the vehicle file)"
    flank_s = TUNED["joint_answer.flank_s"]
    lacking = [side for side, seconds in (("left", left_s), ("right", right_s)) if seconds < flank_s]
    return f"another drive with bends {f'to the {lacking[0]}' if len(lacking) == 1 else 'both ways'}"
