"""What to do about a truck: verdicts on its straight-ahead offset, its free play and its sensors, from an answer.

Plain English for a workshop, in degrees. `LIMIT_DEG` is the default of the offset from which on a truck is
recalibrated. The thesis gives no service limit; 5.6 gives the accuracy of its method on a well serviced truck, 2 deg.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from oncenter.estimates.estimates import Estimates
from oncenter.vehicle_keys import OFFSET_LIMIT_DEG as LIMIT_DEG
from oncenter.verdict.components import accelerometer, angle_sensor, free_play, yaw_rate_sensor
from oncenter.verdict.numbers import joined
from oncenter.verdict.offset import NO_ACTION, offset
from oncenter.verdict.states import STATES, TO_DO, Code
from oncenter.verdict.verdict import About, Verdict

__all__ = ["LIMIT_DEG", "STATES", "About", "Code", "Verdict", "lines_of", "verdicts_of"]


def verdicts_of(answer: Estimates, limit_deg: float | None = None) -> tuple[Verdict, ...]:
    """One verdict each about the straight-ahead offset, the steering wheel angle sensor, the free play, the yaw rate
    sensor and the accelerometer, in this order.

    Args:
        answer: as `oncenter.offset` gives it.
        limit_deg: an offset of this size or more, either sign, needs a recalibration; the vehicle's `offset_limit_deg`
            where left out.
    """
    limit = answer.vehicle.offset_limit_deg if limit_deg is None else limit_deg
    others = (angle_sensor(answer), free_play(answer), yaw_rate_sensor(answer), accelerometer(answer))
    return (_with_the_others(offset(answer, limit), others), *others)


def lines_of(answer: Estimates) -> list[str]:
    """The verdict on the offset in one or two lines, then those on play and sensors that need work."""
    first, *others = verdicts_of(answer)
    to_do = [f"{each.about}: {each.words()}" for each in others if each.state in TO_DO]
    return [f"{first.headline} {first.action}", *filter(None, [first.note]), *to_do]


def _with_the_others(first: Verdict, others: Sequence[Verdict]) -> Verdict:
    """No "No action." above a verdict that needs one."""
    to_do = [each.about for each in others if each.state in TO_DO]
    if first.action != NO_ACTION or not to_do:
        return first
    return replace(first, action=f"No recalibration is needed; see below about the {joined(to_do)}.")
