"""Seconds since 1970 as a date of day and hour."""

from datetime import UTC, datetime, timedelta

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def utc(time_s: float) -> datetime:
    """Of any year from 1 to 9999; the standard library's own conversion knows those from 1970 to 3000 alone on Windows.

    Raises:
        OverflowError: it is of another year.
    """
    return _EPOCH + timedelta(seconds=time_s)
