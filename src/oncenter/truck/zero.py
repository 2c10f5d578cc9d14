"""The kinds of a sensor's zero."""

from __future__ import annotations

from typing import Literal

# "fixed": one offset, or one step; "relative": another value at each start; "moves": creeps or slips.
Zero = Literal["fixed", "relative", "moves"]
