"""One quantity with its interval and status. SI and rad inside; degrees in text and in files."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from oncenter.signals import DEGREE


@dataclass(frozen=True)
class Estimate:
    """A quantity with its 95 % interval and status; `value` and `ci95` are None where the drive gives none.

    `unit` is the SI unit of value and ci95. The interval need not be centred on the value. `evidence_s` are the seconds
    of driving used for it.
    """

    value: float | None
    ci95: tuple[float, float] | None
    status: str
    unit: str
    evidence_s: float = 0.0

    def to_dict(self) -> dict[str, Any]:
        """The estimate as in files: degrees instead of radians."""
        factor, unit = _file_unit(self.unit)
        return {
            "value": None if self.value is None else self.value / factor,
            "unit": unit,
            "ci95": None if self.ci95 is None else [bound / factor for bound in self.ci95],
            "status": self.status,
        }

    def __str__(self) -> str:
        given = self.to_dict()
        if given["value"] is None or given["ci95"] is None:
            return self.status
        low, high = given["ci95"]
        digits = 1 if high - low > 0.4 else 2 if high - low > 0.04 else 3
        value, low, high = (round(number, digits) + 0.0 for number in (given["value"], low, high))  # no -0.0
        return (
            f"{value:.{digits}f} {given['unit']}, {low:.{digits}f} to {high:.{digits}f}"
            f"{'' if self.status == 'valid' else f' ({self.status})'}"
        )


def number(value_rad: float, digits: int) -> str:
    """The angle in degrees as text; never -0.0."""
    return f"{round(value_rad / DEGREE, digits) + 0.0:.{digits}f}"


def _file_unit(unit: str) -> tuple[float, str]:
    """The factor to SI, and the name, of the unit in which files give an SI unit."""
    return (DEGREE, unit.replace("rad", "deg")) if unit.startswith("rad") else (1.0, unit)
