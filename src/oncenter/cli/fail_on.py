"""--fail-on: an exit code for scripts, set by the status of the offset, or by the result of a fleet's night."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterable, Sequence

import typer

from oncenter.errors import STATUS_TO_FAIL_ON, WRONG_USAGE, OncenterError

STATUSES = ("valid", "converging", "unobservable", "invalid")


def kinds_of(given: str | None, kinds: Sequence[str] = STATUSES) -> frozenset[str]:
    """The kinds of a list with commas.

    Raises:
        OncenterError: "usage", exit code 2: a name is not one of the kinds.
    """
    if given is None:
        return frozenset()
    named = [part.strip() for part in given.split(",")]
    for kind in named:
        if kind not in kinds:
            raise OncenterError(
                f"--fail-on takes {', '.join(kinds)}, separated by commas; got '{kind}'",
                code="usage",
                exit_code=WRONG_USAGE,
            )
    return frozenset(named)


def fail_on_kinds(found_kinds: Iterable[str], failing: frozenset[str]) -> None:
    """Exits with code 3 if one of the kinds to fail on was found, and prints them to standard error."""
    found = Counter(kind for kind in found_kinds if kind in failing)
    if not found:
        return
    counts = ", ".join(f"{count} {kind}" for kind, count in found.items())
    print(f"oncenter: --fail-on: {counts}", file=sys.stderr)
    raise typer.Exit(STATUS_TO_FAIL_ON)
