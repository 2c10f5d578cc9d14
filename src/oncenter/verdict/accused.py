"""The signals that the plausibility checks accuse: the errors among an answer's findings."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from oncenter.offset.answer import Answer
    from oncenter.offset.findings import Finding

_SIGNALS = ("steering wheel angle", "yaw rate", "vehicle speed", "lateral acceleration", "wheel speed")
_BY_SIGNALS = ("sign_reversed", "scale", "signal_stuck", "vehicle_speed_zero", "wheel_speed")  # codes of such errors


def errors_of_signals(answer: Answer) -> list[Finding]:
    return [finding for finding in answer.findings if finding.severity == "error" and finding.code in _BY_SIGNALS]


def accused(answer: Answer) -> list[str]:
    """Names of the signals, in words; the witnesses that an error names after its colon are not accused."""
    found: dict[str, None] = {}
    for finding in errors_of_signals(answer):
        first, _, rest = finding.text.partition(":")
        names = [name for name in _SIGNALS if name in first] or [name for name in _SIGNALS if name in rest]
        found.update(dict.fromkeys(names))
    return list(found)
