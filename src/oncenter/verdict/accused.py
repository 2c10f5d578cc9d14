"""An answer's findings, as verdicts need them: one by its code, and the signals that the plausibility checks accuse."""

from __future__ import annotations

from oncenter.estimates.estimates import Estimates
from oncenter.findings import Finding

_BY_SIGNALS = (  # codes of such errors
    "scale",
    "sign_reversed",
    "signal_clipped",
    "signal_filled",
    "signal_jumps",
    "signal_late",
    "signal_magnitude",
    "signal_noise",
    "signal_stuck",
    "signal_unrelated",
    "vehicle_speed_zero",
    "wheel_speed",
)
_WHEELS = "wheel speed"  # any of an axle's
_SIGNALS = ("steering wheel angle", "yaw rate", "vehicle speed", "lateral acceleration", _WHEELS)
_STUCK = "signal_stuck"  # which a sensor can do as well


def accused_by(fault: Finding) -> list[str]:
    """Names of the signals that an error accuses, in words, in a fixed order."""
    names = {_WHEELS if name.startswith("wheel_speed") else name.replace("_", " ") for name in fault.signals}
    return [name for name in _SIGNALS if name in names]


def finding_of(answer: Estimates, code: str, severity: str | None = None) -> Finding | None:
    """The first of this code, and of this severity if one is given."""
    return next((each for each in answer.findings if each.code == code and severity in (None, each.severity)), None)


def errors_of_signals(answer: Estimates) -> list[Finding]:
    return [finding for finding in answer.findings if finding.severity == "error" and finding.code in _BY_SIGNALS]


def accused(answer: Estimates) -> list[str]:
    """Names of the signals, in words."""
    return list(dict.fromkeys(name for finding in errors_of_signals(answer) for name in accused_by(finding)))


def only_stuck(answer: Estimates) -> bool:
    """Whether no error accuses a signal of more than standing still."""
    return all(finding.code == _STUCK for finding in errors_of_signals(answer))


def with_source(answer: Estimates, signal: str) -> str:
    """The signal with the message or the column that it comes from: "yaw rate (VDC2 from 0x3E)"."""
    name = signal.replace(" ", "_")
    is_of = str.startswith if signal == _WHEELS else str.__eq__
    found = dict.fromkeys(text for key, text in answer.sources.items() if is_of(key, name))
    return f"{signal} ({', '.join(found)})" if found else signal
