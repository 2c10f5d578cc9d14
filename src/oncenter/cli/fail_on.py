"""--fail-on: an exit code for scripts, set by the status of the offset."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterable

import typer

from oncenter.errors import STATUS_TO_FAIL_ON, WRONG_USAGE, OncenterError

STATUSES = ("valid", "converging", "unobservable", "invalid")


def statuses_of(given: str | None) -> frozenset[str]:
    """The statuses of a list with commas.

    Raises:
        OncenterError: "usage", exit code 2: a name is not a status.
    """
    if given is None:
        return frozenset()
    named = [part.strip() for part in given.split(",")]
    for status in named:
        if status not in STATUSES:
            raise OncenterError(
                f"--fail-on takes {', '.join(STATUSES)}, separated by commas; got '{status}'",
                code="usage",
                exit_code=WRONG_USAGE,
            )
    return frozenset(named)


def fail_on_status(statuses: Iterable[str], failing: frozenset[str]) -> None:
    """Exits with code 3 if an offset has one of the statuses to fail on, and prints them to standard error."""
    found = Counter(status for status in statuses if status in failing)
    if not found:
        return
    counts = ", ".join(f"{count} {status}" for status, count in found.items())
    print(f"oncenter: --fail-on: {counts}", file=sys.stderr)
    raise typer.Exit(STATUS_TO_FAIL_ON)
