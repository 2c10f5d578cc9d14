"""Sensor faults: their record, and the gaps, failures and stuck values of any sensor."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from oncenter.simulate.chances import named_chances
from oncenter.simulate.drive import RATE_HZ
from oncenter.simulate.sensor_sections import Dropouts, Sensor
from oncenter.simulate.sensors.reading import Array, ticks


@dataclass(frozen=True)
class Fault:
    """A sensor fault: a wrong value, or no value.

    Attributes:
        signal: name without unit; "wheel_speed" and "gnss" for all their signals.
        kind: "offset", "remount", "self_correction", "whole_turns", "hysteresis", "bias", "drift", "random_walk",
            "warm_up", "bank_shift", "tilt", "turned", "ahead_of_gravity_centre", "roll_share", "scale_error",
            "scale_warm_up", "radius_error", "radius_warm_up", "load_transfer", "repeats", "latency", "filter", "hold",
            "stuck", "not_available", "error", "zero_error".
        begin_s, end_s: since the start of the drive; a lasting fault ends with the drive.
        size: maximum addition to the reading in `unit`; a share of the reading for unit "1"; None without a size.
        unit: "rad", "rad_s", "m_s2", "n_m" or "1".
    """

    signal: str
    kind: str
    begin_s: float
    end_s: float
    size: float | None = None
    unit: str = ""


def lasting(signal: str, kind: str, added: Array | float, unit: str, count: int, begin_s: float = 0.0) -> list[Fault]:
    """One fault from `begin_s` to the end of `count` ticks; none if nothing is ever added."""
    course = np.atleast_1d(added)
    size = float(course[np.argmax(np.abs(course))])
    return [Fault(signal, kind, begin_s, count / RATE_HZ, size, unit)] if size != 0.0 else []


def delays(signal: str, sensor: Sensor, count: int) -> list[Fault]:
    """The sensor's delays."""
    late = {"latency": sensor.latency_s, "filter": sensor.filter_time_s, "hold": sensor.hold_s}
    return [Fault(signal, kind, 0.0, count / RATE_HZ) for kind, time_s in late.items() if time_s > 0.0]


def silences(signal: str, sensor: Sensor, count: int, random: np.random.Generator) -> list[Fault]:
    """The times at which the sensor is stuck, fails, or drops out at random."""
    end_s = count / RATE_HZ
    faults = [Fault(signal, "stuck", s.begin_s, _end(s.begin_s, s.length_s, end_s)) for s in sensor.stuck]
    faults += [Fault(signal, f.says, f.begin_s, _end(f.begin_s, f.length_s, end_s)) for f in sensor.failures]
    if sensor.dropouts is not None:
        chances = named_chances(random, f"{signal} dropouts")
        faults += [
            Fault(signal, "not_available", begin_s, _end(begin_s, length_s, end_s))
            for begin_s, length_s in _dropouts(sensor.dropouts, end_s, chances)
        ]
    return faults


def silenced(values: Array, faults: list[Fault]) -> Array:
    """The values with stuck parts held, and NaN in gaps."""
    result = values.copy()
    for fault in faults:
        when = ticks(fault.begin_s, fault.end_s - fault.begin_s)
        if fault.kind == "stuck":
            result[when] = values[when.start : when.start + 1]
    for fault in faults:
        if fault.kind in ("not_available", "error"):
            result[ticks(fault.begin_s, fault.end_s - fault.begin_s)] = np.nan
    return result


def _dropouts(dropouts: Dropouts, end_s: float, random: np.random.Generator) -> Iterator[tuple[float, float]]:
    """Begin and length of each, by a Poisson process."""
    number = random.poisson(dropouts.rate_1_h * end_s / 3600.0)
    begins_s = np.sort(random.uniform(0.0, end_s, number)).round(2)
    lengths_s = random.uniform(*dropouts.length_s, number).round(2)
    yield from zip(begins_s.tolist(), lengths_s.tolist(), strict=True)


def _end(begin_s: float, length_s: float | None, end_s: float) -> float:
    return end_s if length_s is None else min(begin_s + length_s, end_s)
