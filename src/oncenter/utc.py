"""Seconds since 1970 as a date with time."""

from datetime import UTC, datetime, timedelta

EPOCH_S = 1e8  # larger times are s since 1970, smaller ones s since the start of the log
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def utc(time_s: float) -> datetime:
    """The date for years 1 to 9999; on Windows `datetime.fromtimestamp` accepts 1970 to 3000 only.

    Raises:
        OverflowError: the year is outside 1 to 9999.
    """
    return _EPOCH + timedelta(seconds=time_s)
