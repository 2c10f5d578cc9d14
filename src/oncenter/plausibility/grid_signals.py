"""The signals of a drive on one grid, for all checks."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import numpy.typing as npt

from oncenter import _core
from oncenter.plausibility.reversing import Steps, seems_to_reverse
from oncenter.signals import SIGNALS, Signals
from oncenter.tuned import TUNED
from oncenter.vehicle import Vehicle

Column = npt.NDArray[np.float64]

NEEDED = ("steering_wheel_angle", "yaw_rate", "vehicle_speed")
USEFUL = (*NEEDED, "lateral_acceleration")

GRID_HZ = 20.0  # checks use means over 50 ms: less noise, with all of steering and yawing
ROLLING_M_S = 2.0  # from which r/v is a curvature
DRIVING_M_S = 5.0
MIN_TIME_S = 30.0  # for a comparison of two signals
_ABSURD = 1e9  # SI
_DISTURBING = {  # statuses, each up to a speed
    "stability_control_active": np.inf,
    "anti_lock_active": np.inf,
    "reverse": TUNED["monitor.backward_speed_max"],
}


class GridSignals:
    """Signals on the 20 Hz grid; NaN where not available, all NaN where the log lacks a signal."""

    def __init__(self, signals: Signals, vehicle: Vehicle | None) -> None:
        self.signals = signals
        self.vehicle = vehicle
        self.params = {**_core.default_params(), **(vehicle.params if vehicle else {})}
        self.ticks_per_step = max(1, round(signals.rate_hz / GRID_HZ))
        self.step_s = self.ticks_per_step / signals.rate_hz

    @cached_property
    def angle(self) -> Column:
        return self._means("steering_wheel_angle")

    @cached_property
    def yaw_rate(self) -> Column:
        """NaN while the truck seems to reverse: by an unsigned speed it contradicts the others."""
        return np.where(self.seems_to_reverse, np.nan, self._means("yaw_rate"))

    @cached_property
    def seems_to_reverse(self) -> Steps:
        """Never while the log says it: `speed` has none of that time."""
        product = self.ratio_times_wheelbase_m()
        return seems_to_reverse(self.angle, self._means("yaw_rate"), self.speed, self.step_s, product)

    @cached_property
    def speed(self) -> Column:
        """NaN while the truck drives backward or brakes turn it, when signals contradict each other without a fault."""
        speed = self._means("vehicle_speed")
        for status, below_m_s in _DISTURBING.items():
            if self.has(status):
                speed = np.where((self._means(status) > 0.0) & (speed < below_m_s), np.nan, speed)
        return speed

    @cached_property
    def lateral_acceleration(self) -> Column:
        return self._means("lateral_acceleration")

    @cached_property
    def torque(self) -> Column:
        return self._means("steering_wheel_torque")

    @cached_property
    def rear_difference(self) -> Column:
        left, right = self.wheels("rear")
        return self._without_radii(right - left)

    @cached_property
    def wheel_speed(self) -> Column:
        return np.asarray(np.mean([self._means(name) for name in self.wheel_pair()], axis=0))

    @cached_property
    def curvature(self) -> Column:
        rolling = self.speed > ROLLING_M_S
        return np.where(rolling, self.yaw_rate / np.where(rolling, self.speed, 1.0), np.nan)

    @cached_property
    def centripetal(self) -> Column:
        return np.where(self.speed > ROLLING_M_S, self.yaw_rate * self.speed, np.nan)

    def ticks(self, name: str) -> Column:
        """A signal at the table's own rate, NaN where it is not available or absurd."""
        column = self.signals.columns.get(SIGNALS[name].column)
        if column is None:
            return np.full(self.signals.ticks, np.nan)
        return without_absurd(np.asarray(column, dtype=np.float64))

    def has(self, *names: str) -> bool:
        return all(name in self.signals.sources for name in names)

    def driven(self, values: Column) -> Column:
        """A column of the grid, NaN where the vehicle is slow or stands."""
        return np.where(self.speed > DRIVING_M_S, values, np.nan)

    def wheels(self, axle: str) -> tuple[Column, Column]:
        """Left and right."""
        return self._means(f"wheel_speed_{axle}_left"), self._means(f"wheel_speed_{axle}_right")

    def wheel_pair(self) -> tuple[str, str]:
        """Left and right of one axle, so that a bend does not change their mean; the undriven axle first."""
        front, rear = ((f"wheel_speed_{axle}_left", f"wheel_speed_{axle}_right") for axle in ("front", "rear"))
        return front if self.has(*front) else rear

    def ratio_times_wheelbase_m(self) -> float | None:
        """The product by the vehicle file; None where it does not give both."""
        return None if self.vehicle is None or self.vehicle.assumed else self.vehicle.ratio_times_wheelbase_m

    def _without_radii(self, difference: Column) -> Column:
        """Right less left without the part in proportion to speed: unequal tyre wear makes some per mille of it, which
        on straight roads is more than turning makes."""
        columns = np.column_stack([self.speed, self.yaw_rate, difference])
        available = columns[np.isfinite(columns).all(axis=1)]
        if len(available) * self.step_s < MIN_TIME_S:
            return difference
        of_speed, _of_turning = np.linalg.lstsq(available[:, :2], available[:, 2], rcond=None)[0]
        return np.asarray(difference - of_speed * self.speed)

    def _means(self, name: str) -> Column:
        ticks, k = self.ticks(name), self.ticks_per_step
        whole = len(ticks) // k * k
        if not whole:
            return np.full(1, np.nan)  # the log is shorter than one step
        by_place = ticks[:whole].reshape(-1, k)
        total = by_place[:, 0].copy()  # a sum over few columns is faster than a mean over each row
        for place in range(1, k):
            total += by_place[:, place]
        return np.asarray(total / k)


def without_absurd(values: Column) -> Column:
    """NaN in place of impossible numbers from a damaged log: their squares may overflow."""
    beyond = np.abs(values) >= _ABSURD
    return np.where(beyond, np.nan, values) if beyond.any() else values
