"""Seconds since 1970 as a date with time."""

from datetime import UTC, datetime, timedelta

EPOCH_S = 1e8  # larger times are s since 1970, smaller ones s since the start of the log
LAST_S = 2.5e11  # year 9892; a file system can have any time
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def utc(time_s: float) -> datetime:
    """The date for years 1 to 9999; on Windows `datetime.fromtimestamp` accepts 1970 to 3000 only.

    Raises:
        OverflowError: the year is outside 1 to 9999.
    """
    return _EPOCH + timedelta(seconds=time_s)


def iso(time_s: float) -> str:
    """The date as text, to the second: 2026-03-02T07:00:00Z.

    Raises:
        OverflowError: as `utc`.
    """
    return f"{utc(round(time_s)):%Y-%m-%dT%H:%M:%SZ}"
