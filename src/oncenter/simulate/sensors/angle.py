"""The steering wheel angle sensor: offset (which may change), whole turns, hysteresis."""

from __future__ import annotations

from itertools import accumulate

import numpy as np

from oncenter.signals import DEGREE
from oncenter.simulate.drive import RATE_HZ
from oncenter.simulate.sensor_sections import RelativeAngle, SteeringWheelAngleSensor
from oncenter.simulate.sensors.faults import Fault, lasting
from oncenter.simulate.sensors.reading import Array, delayed, held, reading, ticks

SIGNAL = "steering_wheel_angle"
_TURN_DEG = 360.0


def sense_angle(
    true_rad: Array, sensor: SteeringWheelAngleSensor, random: np.random.Generator
) -> tuple[Array, Array, Array, list[Fault]]:
    """The measured angle, its offset without and with whole turns, all rad, and the faults."""
    offset_deg, faults = _offset(sensor, len(true_rad))
    turns_deg, of_turns = _whole_turns(sensor.relative, len(true_rad))
    played_deg = delayed(_with_hysteresis(true_rad / DEGREE, sensor.hysteresis_deg), sensor)
    faults += lasting(SIGNAL, "hysteresis", sensor.hysteresis_deg / 2.0 * DEGREE, "rad", len(true_rad))
    read_deg = reading(
        played_deg + (offset_deg + turns_deg), random, sensor.noise_sd_deg, sensor.resolution_deg, sensor.range_deg
    )
    read = held(DEGREE * read_deg, sensor.hold_s)
    return read, DEGREE * offset_deg, DEGREE * (offset_deg + turns_deg), faults + of_turns


def _offset(sensor: SteeringWheelAngleSensor, count: int) -> tuple[Array, list[Fault]]:
    """Offset in deg at every tick, without whole turns, and its faults."""
    offset = np.full(count, sensor.offset_deg)
    faults = lasting(SIGNAL, "offset", sensor.offset_deg * DEGREE, "rad", count)
    for remount in sensor.remounts:
        offset[ticks(remount.begin_s, None)] += remount.step_deg
        faults += lasting(SIGNAL, "remount", remount.step_deg * DEGREE, "rad", count, remount.begin_s)
    if (correction := sensor.self_correction) is not None:
        found = -correction.share * float(offset[round(correction.begin_s * RATE_HZ)])
        since_s = np.arange(count) / RATE_HZ - correction.begin_s
        done = np.clip(since_s / correction.length_s, 0.0, 1.0) if correction.length_s > 0.0 else since_s >= 0.0
        offset += found * done
        faults += lasting(SIGNAL, "self_correction", found * DEGREE, "rad", count, correction.begin_s)
    return offset, faults


def _whole_turns(relative: RelativeAngle | None, count: int) -> tuple[Array, list[Fault]]:
    """Whole turns in deg at every tick, and their faults, with the gaps after ignition."""
    turns = np.zeros(count)
    if relative is None:
        return turns, []
    faults: list[Fault] = []
    ignitions = sorted(relative.ignitions, key=lambda ignition: ignition.begin_s)
    ends_s = [*(ignition.begin_s for ignition in ignitions), count / RATE_HZ]
    for begin_s, end_s, number in zip(
        [0.0, *ends_s], ends_s, [relative.turns, *(ignition.turns for ignition in ignitions)], strict=False
    ):
        turns[ticks(begin_s, end_s - begin_s)] = number * _TURN_DEG
        if number != 0:
            faults.append(Fault(SIGNAL, "whole_turns", begin_s, end_s, number * _TURN_DEG * DEGREE, "rad"))
    for ignition in ignitions:
        silent_until_s = min(ignition.begin_s + ignition.off_s, count / RATE_HZ)
        faults.append(Fault(SIGNAL, "not_available", ignition.begin_s, silent_until_s))
    return turns, faults


def _with_hysteresis(true_deg: Array, width_deg: float) -> Array:
    """The sensor's gear follows the column only beyond its own play, half the width to either side."""
    if width_deg == 0.0:
        return true_deg
    half = width_deg / 2.0
    followed = accumulate(
        true_deg.tolist(),
        lambda inner, outer: outer - half if outer - half > inner else min(inner, outer + half),
    )
    return np.fromiter(followed, np.float64, len(true_deg))
