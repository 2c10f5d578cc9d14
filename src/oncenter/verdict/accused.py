"""An answer's findings, as verdicts need them: one by its code, and the signals that the plausibility checks accuse."""

from __future__ import annotations

from typing import TYPE_CHECKING

from oncenter.offset.signals_at_fault import accused_by

if TYPE_CHECKING:
    from oncenter.offset.answer import Answer
    from oncenter.offset.findings import Finding

_BY_SIGNALS = ("sign_reversed", "scale", "signal_stuck", "vehicle_speed_zero", "wheel_speed")  # codes of such errors


def finding_of(answer: Answer, code: str, severity: str | None = None) -> Finding | None:
    """The first of this code, and of this severity if one is given."""
    matching = (each for each in answer.findings if each.code == code and severity in (None, each.severity))
    return next(matching, None)


def errors_of_signals(answer: Answer) -> list[Finding]:
    return [finding for finding in answer.findings if finding.severity == "error" and finding.code in _BY_SIGNALS]


def accused(answer: Answer) -> list[str]:
    """Names of the signals, in words."""
    return list(dict.fromkeys(name for finding in errors_of_signals(answer) for name in accused_by(finding)))


def is_sensor_fault(answer: Answer) -> bool:
    """A fault of the angle sensor. A reversed sign is none where the signals contradict each other: the mistake may be
    another signal's sign, or an entry of the vehicle file."""
    if answer.sensor_fault == "wrong_sign":
        return not accused(answer)
    return answer.sensor_fault != "none"
