"""What to do about a truck: verdicts on its straight-ahead offset, its free play and its sensors, from an answer.

Plain English for a workshop, in degrees. `LIMIT_DEG` is the default of the offset from which on a truck is
recalibrated. The thesis gives no service limit; 5.6 gives the accuracy of its method on a well serviced truck, 2 deg.
"""

from __future__ import annotations

from oncenter.estimates.estimates import Estimates
from oncenter.vehicle_keys import OFFSET_LIMIT_DEG as LIMIT_DEG
from oncenter.verdict.components import accelerometer, angle_sensor, free_play, yaw_rate_sensor
from oncenter.verdict.offset import offset
from oncenter.verdict.verdict import About, State, Verdict

__all__ = ["LIMIT_DEG", "About", "State", "Verdict", "verdicts_of"]


def verdicts_of(answer: Estimates, limit_deg: float | None = None) -> tuple[Verdict, ...]:
    """One verdict each about the straight-ahead offset, the steering wheel angle sensor, the free play, the yaw rate
    sensor and the accelerometer, in this order.

    Args:
        answer: as `oncenter.offset` gives it.
        limit_deg: an offset of this size or more, either sign, needs a recalibration; the vehicle's `offset_limit_deg`
            where left out.
    """
    limit = answer.vehicle.offset_limit_deg if limit_deg is None else limit_deg
    return (
        offset(answer, limit),
        angle_sensor(answer),
        free_play(answer),
        yaw_rate_sensor(answer),
        accelerometer(answer),
    )
