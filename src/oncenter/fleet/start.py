"""Start times of drives: a log may hold any number, tables and pages hold the years 1970 to 9999.

A start that is not in the log comes from a name or from the time of the last write. Copies of a log then give several,
of which the drive has the earliest: a copy is younger than its original.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from datetime import UTC, datetime
from pathlib import PurePosixPath
from typing import Any

_EARLIEST_S, _LATEST_S = 0.0, 253_402_300_799.0
_NAME, _MODIFIED = "name", "modified"  # sources outside the log, the better one first
_DATE = re.compile(
    r"(?<!\d)((?:19|20)\d\d)-?([01]\d)-?([0-3]\d)[T_ -]?([0-2]\d)[-:.h]?([0-5]\d)(?:[-:.m]?([0-5]\d))?(?!\d)"
)

Start = tuple[str, float]  # source, and s since 1970


def valid_start(start_s: float | None) -> float | None:
    """A start in s since 1970; None if there is none, or if it is NaN or outside these years."""
    return start_s if start_s is not None and _EARLIEST_S <= start_s <= _LATEST_S else None


def starts_outside(uri: str, modified_s: float, span_s: float | None) -> Iterator[Start]:
    """Starts that the file gives, not its content, the best first: a date with time of day in its name or in that of a
    folder near it (UTC); the time of the last write minus the span of the log's clock, s. All are valid."""
    for part in reversed(PurePosixPath(uri.replace("\\", "/")).parts):
        start_s = valid_start(_dated(part))
        if start_s is not None:
            yield _NAME, start_s
    start_s = None if span_s is None else valid_start(modified_s - span_s)
    if start_s is not None:
        yield _MODIFIED, start_s


def own_outside(row: Mapping[str, Any]) -> list[Start]:
    """The start of a row of `tables.DRIVES` if it is not from the log; else none."""
    return [(row["start_source"], row["start"])] if row.get("start_source") in (_NAME, _MODIFIED) else []


def with_earliest(row: dict[str, Any], others: Iterable[Start]) -> dict[str, Any]:
    """The row with the best of its own start and those of other files with the same content; a start from the log
    stays."""
    if row.get("start") is not None and not own_outside(row):
        return row
    starts = [*own_outside(row), *list(others)[:1]]
    if not starts:
        return row
    source, start_s = min(starts, key=lambda each: (each[0] != _NAME, each[1]))
    return row | {"start": start_s, "start_source": source}


def _dated(name: str) -> float | None:
    found = _DATE.search(name)
    if found is None:
        return None
    try:
        year, month, day, hour, minute, second = (int(part or 0) for part in found.groups())
        return datetime(year, month, day, hour, minute, second, tzinfo=UTC).timestamp()
    except ValueError:
        return None
