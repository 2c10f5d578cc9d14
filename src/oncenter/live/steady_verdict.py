"""A verdict that does not flip while the interval passes the limit: the hysteresis of the live display."""

from __future__ import annotations

from oncenter.verdict import Verdict
from oncenter.verdict.states import AT_FAULT, Code

# Driving for which another state has to hold: errors of the offset are alike for about a minute and a half, the memory
# of the recent offset in the core (joint_verdict.recent_share), so that a shorter one says nothing new.
HELD_S = 90.0
_NOTHING_SO_FAR: tuple[Code, ...] = ("no_offset",)


class SteadyVerdict:
    """The verdict to show. A fault of a signal or the sensor is shown at once, and so is the first verdict.

    Attributes:
        shown: the verdict, with the numbers at which its state was last confirmed.
        is_changing: another state is not shown so far.
    """

    def __init__(self) -> None:
        self.shown: Verdict | None = None
        self.is_changing = False
        self._next: Code | None = None
        self._since_s = 0.0

    def update(self, now: Verdict | None, driven_s: float) -> None:
        """The newest verdict, after so many seconds of ticks."""
        if now is not None and now.state != self._next:
            self._next, self._since_s = now.state, driven_s
        if now is None or self._is_at_once(now) or driven_s - self._since_s >= HELD_S:
            self.shown = now
        self.is_changing = self.shown is not None and self.shown.state != self._next

    def _is_at_once(self, now: Verdict) -> bool:
        if self.shown is None or now.state == self.shown.state or now.state in AT_FAULT:
            return True
        return self.shown.state in _NOTHING_SO_FAR
