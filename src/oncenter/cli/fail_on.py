"""--fail-on: an exit code for scripts, set by the status of the offset, or by the result of a fleet's night."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence

import typer

from oncenter.errors import STATUS_TO_FAIL_ON, WRONG_USAGE, OncenterError
from oncenter.files.file_name import printable

_NAMED_MAX = 20  # of a kind
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


def fail_on_kinds(
    counts: Mapping[str, int], failing: frozenset[str], named: Mapping[str, Sequence[str]] | None = None
) -> None:
    """Exits with code 3 if one of the kinds to fail on was found, and prints them to standard error, a line each.

    Args:
        named: of each kind the trucks or logs that have it, as far as they are named.
    """
    found = {kind: count for kind, count in counts.items() if count and kind in failing}
    for kind, count in found.items():
        names = (named or {}).get(kind, ())[:_NAMED_MAX]
        more = f" and {count - len(names)} more" if names and count > len(names) else ""
        which = f": {', '.join(map(printable, names))}" if names else ""
        print(f"oncenter: --fail-on: {count} {kind}{which}{more}", file=sys.stderr)
    if found:
        raise typer.Exit(STATUS_TO_FAIL_ON)
