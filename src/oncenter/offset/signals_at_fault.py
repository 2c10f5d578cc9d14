"""Signals that contradict each other: their errors become findings, and estimates that rest on them are invalid."""

from __future__ import annotations

from dataclasses import replace

from oncenter.findings import Finding
from oncenter.offset.answer import Answer
from oncenter.plausibility import faults
from oncenter.verdict.accused import accused_by

_LEARNED = (
    "offset",
    "understeer_gradient",
    "backlash",
    "unloading_acceleration",
    "equivalent_wheelbase",
    "ratio_times_wheelbase",
    "understeer_at_steering_wheel",
)
_ABOUT_SIGNALS = (
    "gate_shut",
    "lateral_acceleration_at_standstill",
    "lateral_acceleration_moves",
    "relative_angle_sensor",
    "signals_not_available",
    "signals_withheld",
    "values_left_out",
    "steering_wheel_angle_sensor_at_fault",
    "yaw_rate_bias",
    "yaw_rate_bias_moves",
)
# Findings that do not depend on the sign or unit of another signal; all others follow from such an error.
_INDEPENDENT = ("lateral_acceleration_at_standstill", "relative_angle_sensor")
_AT_FAULT = "steering_wheel_angle_sensor_at_fault"
_STUCK_SHARE = 0.25  # of the drive: below it, the rest of the drive is enough


def without_faulty_estimates(answer: Answer, *, contradicts: bool) -> Answer:
    """The answer with the errors of its signals as findings, and without values that rest on such a signal.

    Args:
        answer: of one run of the core.
        contradicts: no truck has such an answer.
    """
    if not contradicts:
        return answer
    found_in = [faults(drive, answer.vehicle) for drive in answer.drives]
    found = tuple(dict.fromkeys(fault for of_drive in found_in for fault in of_drive))
    if not any(_leaves_nothing(fault, answer) for fault in found):
        return replace(answer, findings=(*found, *answer.findings))
    explained = any(fault.code != "signal_stuck" for fault in found)
    accuses_angle = any("steering wheel angle" in accused_by(fault) for fault in found)
    # Of a reversed sign, the check of all signals says more than the sensor check, which trusts the yaw rate.
    by_sign = answer.sensor_fault == "wrong_sign" and any(fault.code == "sign_reversed" for fault in found)
    keeps_fault = accuses_angle and not by_sign
    gone = {name: replace(getattr(answer, name), value=None, ci95=None, status="invalid") for name in _LEARNED}
    stands = not any(fault.code == "vehicle_speed_zero" for fault in found)
    about = (_INDEPENDENT if stands else _INDEPENDENT[1:]) if explained else _ABOUT_SIGNALS
    kept = (
        finding for finding in answer.findings if finding.code in about or (finding.code == _AT_FAULT and keeps_fault)
    )
    return replace(
        answer,
        **gone,
        sensor_fault=answer.sensor_fault if accuses_angle else "none",
        offset_ci95_drive=None,
        not_identifiable=(),
        by_priors=(),
        changes=(),
        findings=(*found, *kept),
    )


def _leaves_nothing(fault: Finding, answer: Answer) -> bool:
    """A sign or unit is wrong from the first tick on; a stuck angle sensor leaves the estimates before that."""
    if fault.code != "signal_stuck":
        return True
    return answer.offset.status != "invalid" and (fault.value or 0.0) > _STUCK_SHARE * answer.duration_s
