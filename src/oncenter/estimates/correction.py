"""The correction of an offset, together with the correction that the ECU applies already, so that none is added twice.

A logged angle is the sensor's reading plus the applied correction. The offset of a log is therefore the remaining one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from oncenter.signals import DEGREE


@dataclass(frozen=True)
class Correction:
    """A correction in rad, added to the sensor's reading.

    Attributes:
        applied: added by the ECU already.
        remaining: to be added to that.
    """

    applied: float
    remaining: float

    @property
    def total(self) -> float:
        """The angle that the ECU has to add in total."""
        return self.applied + self.remaining

    def to_dict(self) -> dict[str, Any]:
        return {"remaining_deg": self.remaining / DEGREE, "total_deg": self.total / DEGREE}


NO_CORRECTION = {"remaining_deg": None, "total_deg": None}  # where no valid offset is given
