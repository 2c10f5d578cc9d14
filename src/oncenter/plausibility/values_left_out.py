"""Values of the log that were left out, from the account of the log: by which reason, and how many."""

from __future__ import annotations

from collections.abc import Sequence

from oncenter.account import FIRST_FROM, NAMED_FROM, WORDS
from oncenter.findings import Finding, Kind, finding
from oncenter.plausibility.check_result import words
from oncenter.signals import Signals


@finding("values_left_out", "warning", "%")
def values_left_out(found: Kind, drive: Signals, names: Sequence[str]) -> list[Finding]:
    """A reason took more than 0.1 % of the samples of a signal; the largest share first. From 5 % on it is a warning,
    and stands before all other findings."""
    if drive.account is None:
        return []
    together: dict[tuple[str, float, int, int], list[str]] = {}
    for name in names:
        account = drive.account.signals.get(name)
        for reason, share in {} if account is None else account.shares().items():
            if share > NAMED_FROM:
                assert account is not None
                together.setdefault((reason, share, account.left_out[reason], account.in_file), []).append(name)
    return [
        found(_text(reason, signals, count, in_file, share), 100.0 * share, severity=_severity(share))
        for (reason, share, count, in_file), signals in sorted(together.items(), key=lambda item: -item[0][1])
    ]


def _severity(share: float) -> str:
    return "warning" if share > FIRST_FROM else "info"


def _text(reason: str, signals: Sequence[str], count: int, in_file: int, share: float) -> str:
    """An info has no action: every sender has no value for some seconds after its start."""
    why, action = WORDS[reason] if share > FIRST_FROM else (WORDS[reason][0], "")
    which = _listed([f"the {words(name)}" for name in signals])
    text = f"{_percent(count, in_file)} of the samples of {which} are left out ({count} of {in_file}): {why}"
    return f"{text}. The offset does not use them. {action}" if action else f"{text}. The offset does not use them"


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _percent(count: int, whole: int) -> str:
    """ "12 %"; 100 % only for all."""
    percent = 100.0 * count / whole
    return "100 %" if count == whole else f"{min(percent, 99.9):.{0 if 10.0 <= percent < 99.0 else 1}f} %"
