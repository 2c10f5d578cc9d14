"""Whether the sensors read zero when there is nothing to read: at standstill, on average at speed, straight ahead."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from oncenter.findings import Finding
from oncenter.plausibility.drive import DRIVING_M_S, MIN_TIME_S, NEEDED, Drive
from oncenter.plausibility.verdict import CannotTell, Verdict, lacks, words
from oncenter.signals import DEGREE

_YAW_RATE_ZERO_RAD_S = 0.05 * DEGREE
_VDC2_ZERO_RAD_S = (32127 - 32112.64) / 8192  # SPN 1808: what a sender reads that takes raw 32127 for zero
_VDC2_ZERO_WITHIN_RAD_S = 0.015 * DEGREE  # two bits of 1/8192 rad/s
_STANDING_ACCELERATION_M_S2 = 0.25  # a 2.5 % slope of the ground


def _yaw_rate_zero(drive: Drive) -> Verdict:
    seen = _at_standstill(drive, "yaw_rate")
    if seen is None:
        return CannotTell("zero of the yaw rate", _lacks_standing(drive, "yaw_rate"))
    bias, time_s = seen
    if abs(bias) < _YAW_RATE_ZERO_RAD_S:
        return None
    text = f"the yaw rate reads {bias / DEGREE:+.2f} deg/s at standstill (seen for {time_s:.1f} s)"
    source = drive.signals.sources.get("yaw_rate")
    if source and "VDC2" in source.description and abs(bias - _VDC2_ZERO_RAD_S) < _VDC2_ZERO_WITHIN_RAD_S:
        text += "; a sender that takes raw 32127 for zero in VDC2, where 32112.64 is, reads +0.10 deg/s"
    return Finding("yaw_rate_bias", "warning", text, bias / DEGREE, "deg/s")


def _standing(drive: Drive) -> Verdict:
    seen = _at_standstill(drive, "lateral_acceleration")
    if seen is None:
        return CannotTell("zero of the lateral acceleration", _lacks_standing(drive, "lateral_acceleration"))
    reading, time_s = seen
    if abs(reading) < _STANDING_ACCELERATION_M_S2:
        return None
    text = (
        f"the accelerometer reads {reading:+.2f} m/s^2 at standstill (seen for {time_s:.1f} s): "
        "its bias, or the slope of the ground"
    )
    return Finding("lateral_acceleration_at_standstill", "warning", text, reading, "m/s^2")


def _at_standstill(drive: Drive, name: str) -> tuple[float, float] | None:
    """Mean reading and the time behind it in s."""
    values = drive.ticks(name)[drive.standing]
    values = values[np.isfinite(values)]
    time_s = len(values) / drive.signals.rate_hz
    return (float(values.mean()), time_s) if time_s >= drive.params["standstill_time_min_s"] else None


def _bank(drive: Drive) -> Verdict:
    """(33) averaged over all fast driving: banked bends come and go, a crown is some 0.2 m/s^2, the rest is bias."""
    bank = (drive.lateral_acceleration - drive.centripetal)[drive.speed > drive.params["speed_min_m_s"]]
    bank = bank[np.isfinite(bank)]
    subject = "mean of a_y - r*v"
    if len(bank) * drive.step_s < MIN_TIME_S:
        fast = f"needs {MIN_TIME_S:.0f} s above {drive.params['speed_min_m_s']:g} m/s"
        return CannotTell(subject, lacks(drive, ("lateral_acceleration", "yaw_rate", "vehicle_speed"), fast))
    limit = drive.params["bank_max_m_s2"]
    mean = float(bank.mean())
    if drive.unlike or abs(mean) <= limit:
        return None
    text = (
        f"a_y - r*v averages {mean:+.2f} m/s^2 at speed, beyond the bank limit of {limit:g} m/s^2 (bank_max_m_s2): "
        "an accelerometer bias, with which little or nothing passes the gate"
    )
    return Finding("bank", "warning", text, mean, "m/s^2")


def _relative_sensor(drive: Drive) -> Verdict:
    if not np.any(drive.ticks("steering_wheel_angle_sensor_type") == 0):
        return None
    text = (
        "the angle sensor is a relative one (SPN 1812 = 0): its angle may be off by whole turns after each ignition, "
        "so the offset is told modulo 360 deg"
    )
    return Finding("relative_angle_sensor", "info", text)


_NEARLY_STRAIGHT_1_M = 1 / 500


def _whole_turns(drive: Drive) -> Verdict:
    straight = drive.angle[(drive.speed > DRIVING_M_S) & (np.abs(drive.curvature) < _NEARLY_STRAIGHT_1_M)]
    straight = straight[np.isfinite(straight)]
    if len(straight) * drive.step_s < 2.0:
        return CannotTell("whole turns of the angle", lacks(drive, NEEDED, "needs 2 s of nearly straight driving"))
    middle_deg = float(np.median(straight)) / DEGREE
    if drive.unlike or abs(middle_deg) < 180:
        return None
    text = f"the steering wheel angle reads {middle_deg:+.0f} deg when driving straight: off by a whole turn"
    return Finding("whole_turns", "warning", text, middle_deg, "deg")
