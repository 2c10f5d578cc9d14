"""An answer whose signals are not what their names say: the fault in place of all that rests on them."""

from __future__ import annotations

from dataclasses import replace

from oncenter.offset.answer import Answer
from oncenter.plausibility.signal_fault import SignalFault, finding_of

_LEARNED = (
    "offset",
    "understeer_gradient",
    "backlash",
    "unloading_acceleration",
    "equivalent_wheelbase",
    "ratio_times_wheelbase",
    "understeer_at_steering_wheel",
)
_STUCK_SHARE_MAX = 0.4  # of the drive: beyond it, the estimates rest on the stuck signal


def without_estimates(answer: Answer, fault: SignalFault) -> Answer:
    """The answer with the fault in place of all that rests on the signals. Before a signal is stuck it is right."""
    if fault.kind == "stuck" and fault.value < _STUCK_SHARE_MAX * answer.duration_s:
        return _from_before(answer, fault)
    gone = {name: replace(getattr(answer, name), value=None, ci95=None, status="invalid") for name in _LEARNED}
    return replace(
        answer,
        **gone,
        sensor_fault=_sensor_fault(fault),
        offset_ci95_drive=None,
        not_identifiable=(),
        by_priors=(),
        changes=(),
        next_driving=(),
        findings=(finding_of(fault), *(each for each in answer.findings if each.code in _INDEPENDENT)),
    )


_SENSOR_FAULTS = {"stuck": "stuck", "reversed": "wrong_sign"}  # that an angle sensor can have as well


def _sensor_fault(fault: SignalFault) -> str:
    return _SENSOR_FAULTS.get(fault.kind, "none") if fault.signals == ("steering_wheel_angle",) else "none"


def _from_before(answer: Answer, fault: SignalFault) -> Answer:
    invalid = {name: replace(getattr(answer, name), status="invalid") for name in _LEARNED}
    return replace(answer, **invalid, sensor_fault=_sensor_fault(fault), findings=(finding_of(fault), *answer.findings))


# Findings that do not rest on another signal.
_INDEPENDENT = ("relative_angle_sensor",)
