"""Start times of drives: a log may hold any number, tables and pages hold the years 1970 to 9999."""

from __future__ import annotations

_EARLIEST_S, _LATEST_S = 0.0, 253_402_300_799.0


def valid_start(start_s: float | None) -> float | None:
    """A start in s since 1970; None if there is none, or if it is NaN or outside these years."""
    return start_s if start_s is not None and _EARLIEST_S <= start_s <= _LATEST_S else None
