"""Remembered values of one truck, and their ageing. SI and rad; times in s since 1970."""

from __future__ import annotations

import math
from dataclasses import dataclass

from oncenter.truck.fingerprint import are_same

DAY_S = 86400.0


@dataclass(frozen=True)
class Remembered:
    """A quantity, its standard deviation, and the time at which both hold."""

    value: float
    sd: float
    date_s: float

    def aged(self, at_s: float, sd_per_root_day: float, sd_between: float = 0.0, sd_min: float = 0.0) -> Remembered:
        """The quantity as the prior of another drive.

        Args:
            at_s: begin of that drive; before `date_s` it counts like after it.
            sd_per_root_day: of a random walk, which grows with the square root of time.
            sd_between: additional difference from drive to drive.
            sd_min: lower limit, since the errors of many drives have a common part.
        """
        days = abs(at_s - self.date_s) / DAY_S
        sd = math.sqrt(self.sd**2 + sd_per_root_day**2 * days + sd_between**2)
        return Remembered(self.value, max(sd, sd_min), at_s)

    def combined(self, other: Remembered) -> Remembered:
        """The combination of two independent values by Bayes; the date is the later one."""
        own, others = 1.0 / self.sd**2, 1.0 / other.sd**2
        total = own + others
        return Remembered(
            (own * self.value + others * other.value) / total, math.sqrt(1.0 / total), max(self.date_s, other.date_s)
        )

    def without(self, prior: Remembered) -> Remembered | None:
        """The result of a drive without the prior that it contains; None where no evidence is left."""
        left = 1.0 / self.sd**2 - 1.0 / prior.sd**2
        if not left > 0.0:
            return None
        value = (self.value / self.sd**2 - prior.value / prior.sd**2) / left
        return Remembered(value, math.sqrt(1.0 / left), self.date_s)


@dataclass(frozen=True)
class Load:
    """The understeer gradient at one load, rad/(m/s^2), and its number of drives."""

    gradient: Remembered
    drives: int


@dataclass(frozen=True)
class PastDrive:
    """A drive in the memory: its fingerprint, its begin and its offset (rad), which is no prior."""

    key: str
    start_s: float
    offset: float | None
    offset_sd: float | None
    status: str


@dataclass(frozen=True)
class TruckMemory:
    """Estimates from the drives of a truck; None where no drive identified a quantity.

    Attributes:
        truck: the vehicle file's name.
        play: rad, full width at the steering wheel, friction hysteresis included.
        yaw_rate_bias: rad/s, at the end of the last drive.
        accelerometer_bias: m/s^2, from standstills; its standard deviation includes the slope of the ground.
        equivalent_wheelbase: m.
        ratio_times_wheelbase: m, of a truck whose vehicle file does not give both.
        loads: gradients, one per load.
        drives: the last ones, oldest first.
        vin: of its drives, where a log has one.
    """

    truck: str
    play: Remembered | None = None
    yaw_rate_bias: Remembered | None = None
    accelerometer_bias: Remembered | None = None
    equivalent_wheelbase: Remembered | None = None
    loads: tuple[Load, ...] = ()
    drives: tuple[PastDrive, ...] = ()
    ratio_times_wheelbase: Remembered | None = None
    vin: str | None = None

    def has(self, key: str) -> bool:
        return any(are_same(key, drive.key) for drive in self.drives)
