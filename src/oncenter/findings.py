"""Findings: statements about a drive beyond its numbers, each with a code, a severity, a text and a value.

The text has three parts in this order: the observation with its number and unit, its effect on the straight-ahead
offset, and the action for the user, which an info may leave out. Its first sentence begins in lower case and its last
one has no full stop: `capitalised` and the pages add both. `docs/reference/findings.md` has a section for each code,
which `oncenter explain CODE` prints.

Degrees here: findings are for people and files.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Any, Concatenate, NamedTuple, ParamSpec, TypeVar

from oncenter.files.file_name import printable

P = ParamSpec("P")
Found = TypeVar("Found")  # a finding, or a list of them, or None

PLAY_STANDARD_DEG = 15.0  # maintenance standard, thesis 2.1
_DEMAND_STEP_S = 60.0  # a driver cannot plan seconds


@dataclass(frozen=True)
class Finding:
    """`severity` is info, warning or error; `value` is in `unit`, as files give it; `signals` are those of the log that
    it concerns, by oncenter's names. Nothing is found in the text, which has the user's own names."""

    code: str
    severity: str
    text: str
    value: float | None = None
    unit: str | None = None
    signals: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        return {
            "code": self.code,
            "severity": self.severity,
            "text": self.text,
            "value": self.value,
            "unit": self.unit,
        }

    def line(self) -> str:
        """The line for a terminal, "warning: the steering has ... (steering_play)": the code is the one to explain."""
        return f"{self.severity}: {self.text} ({self.code})"


def large_losses(findings: Iterable[Finding]) -> list[str]:
    """The observation of each large loss: the first words of an answer."""
    return [finding.text.partition(". ")[0] for finding in findings if is_large_loss(finding)]


EXPLAINED = "more about a finding: oncenter explain CODE"  # under a list of such lines


def most_severe_first(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Large losses of values in the log, which may explain all others; then errors, warnings, infos; within each as
    given."""
    rank = {"error": 0, "warning": 1, "info": 2}
    return tuple(sorted(findings, key=lambda finding: (not is_large_loss(finding), rank[finding.severity])))


def is_large_loss(finding: Finding) -> bool:
    """Whether more than 5 % of a signal's samples were left out for one reason: an answer begins with it."""
    return finding.code == "values_left_out" and finding.severity == "warning"


def demand(lacking_s: float) -> str:
    """The driving time to ask for, "60 s": whole minutes, never less than what is lacking."""
    return f"{_DEMAND_STEP_S * math.ceil(lacking_s / _DEMAND_STEP_S):.0f} s"


def bends_demand(lacking_s: dict[str, float]) -> str:
    """ "at least 60 s of right-hand bends", from the seconds that are lacking by side."""
    return "at least " + " and ".join(f"{demand(s)} of {side}-hand bends" for side, s in lacking_s.items())


def capitalised(text: str) -> str:
    """The text with a capital first letter; a file or signal name in first place stays as it is."""
    first = text.partition(" ")[0].rstrip(",:;")
    return text[:1].upper() + text[1:] if first.replace("-", "").isalpha() else text


class Kind(NamedTuple):
    """A code with its usual severity and the unit of its value."""

    code: str
    severity: str
    unit: str | None

    def __call__(
        self,
        text: str,
        value: float | None = None,
        *,
        severity: str | None = None,
        unit: str | None = None,
        signals: tuple[str, ...] = (),
    ) -> Finding:
        """A finding of this kind; `severity` and `unit` where they are not the usual ones. The text may name files."""
        unit = None if value is None else unit or self.unit
        return Finding(self.code, severity or self.severity, printable(text), value, unit, signals)


def finding(
    code: str, severity: str, unit: str | None = None
) -> Callable[[Callable[Concatenate[Kind, P], Found]], Callable[P, Found]]:
    """Gives a function that finds something the kind of its finding, as its first argument.

    Its docstring has the condition. A code may have several functions.
    """

    def registered(finds: Callable[Concatenate[Kind, P], Found]) -> Callable[P, Found]:
        return partial(finds, Kind(code, severity, unit))

    return registered
