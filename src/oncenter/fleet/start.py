"""When a drive may have begun: a log can say anything, tables and pages hold the years 1970 to 9999."""

from __future__ import annotations

_EARLIEST_S, _LATEST_S = 0.0, 253_402_300_799.0


def known_start(start_s: float | None) -> float | None:
    """A begin in s since 1970; None where it is none, not a number, or of another year."""
    return start_s if start_s is not None and _EARLIEST_S <= start_s <= _LATEST_S else None
