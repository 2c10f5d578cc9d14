"""The monitor of one truck, fed with signals that arrive one by one; without ROS."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, fields
from pathlib import Path

import oncenter as oc

SIGNALS = tuple(field.name for field in fields(oc.Tick) if field.name != "time_s")
STALE_S = 0.5  # older values are stale; the slowest J1939 messages used come every 0.1 s
CI95 = 1.96  # standard deviations on both sides


@dataclass(frozen=True)
class Published:
    """The values published after a tick; rad, NaN while the offset is unobservable.

    `low_rad` and `high_rad` are the offset's 95 % interval. `status` is "unobservable", "converging", "valid" or
    "invalid"; `sensor_fault` is "none" or the fault of the angle sensor.
    """

    offset_rad: float
    low_rad: float
    high_rad: float
    status: str
    sensor_fault: str


class Estimate:
    """A monitor with the last value of each signal, and its image on disk.

    Args:
        vehicle: from `oncenter.vehicle`.
        rate_hz: of the ticks, 20 to 200.
        image: file that keeps the state over ignition cycles; None keeps nothing.

    Attributes:
        note: whether the image was used at the start, for the log.
    """

    def __init__(self, vehicle: oc.Vehicle, rate_hz: float, image: Path | None) -> None:
        self._monitor = oc.Monitor(vehicle, rate_hz)
        self._image = image
        self._values: dict[str, tuple[float, float]] = {}
        self.note = self._restore()

    def receive(self, signal: str, value: float, at_s: float) -> None:
        """Takes a signal's value (of SIGNALS; SI and rad, left positive) and its time of arrival, s."""
        self._values[signal] = (value, at_s)

    def tick(self, at_s: float) -> Published:
        """Computes one tick from the last values; a missing or stale signal is not available."""
        fresh = {name: value for name, (value, arrived_s) in self._values.items() if 0.0 <= at_s - arrived_s <= STALE_S}
        now = self._monitor.step(oc.Tick(time_s=at_s, **{name: fresh.get(name, math.nan) for name in SIGNALS}))
        if now.offset_rad is None or now.offset_sd_rad is None:
            return Published(math.nan, math.nan, math.nan, now.offset_status, now.sensor_fault)
        half_width = CI95 * now.offset_sd_rad
        offset = now.offset_rad
        return Published(offset, offset - half_width, offset + half_width, now.offset_status, now.sensor_fault)

    def save(self) -> None:
        """Writes the image atomically. Raises OSError if it cannot be written."""
        if self._image is None:
            return
        unfinished = self._image.with_name(f"{self._image.name}.unfinished")
        with unfinished.open("wb") as file:
            file.write(self._monitor.save())
            file.flush()
            os.fsync(file.fileno())
        unfinished.replace(self._image)

    def _restore(self) -> str:
        if self._image is None:
            return "no image file: the estimate is lost at shutdown"
        try:
            image = self._image.read_bytes()
        except FileNotFoundError:
            return f"{self._image} does not exist: estimation starts from zero"
        try:
            self._monitor.restore(image)
        except oc.OncenterError as error:
            return f"{self._image}: {error}"
        self._monitor.restart()  # the ignition was off in between
        return f"continues from {self._image}"
