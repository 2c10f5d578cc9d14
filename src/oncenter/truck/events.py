"""Events between a truck's drives that a person states: a calibration, a repair, other parts, another truck."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.signals import DEGREE
from oncenter.utc import LAST_S, iso
from oncenter.vehicle_keys import APPLIED_MAX_DEG

CALIBRATED, REPAIRED, CHANGED, ANOTHER_TRUCK = KINDS = ("calibrated", "repaired", "changed", "another_truck")
_FORM = "write KIND@DATE, or calibrated@DATE=DEG: calibrated@2026-03-02T07:00=-3.4"


@dataclass(frozen=True)
class Event:
    """`time_s` since 1970; drives from then on are after it. `by_rad` is the angle that a calibration added to the
    sensor's reading; None where it is not stated. Kinds: "calibrated", a correction was set; "repaired", play or
    steering; "changed", sensor or wheels; "another_truck", logs from then on are of another one."""

    time_s: float
    kind: str
    by_rad: float | None = None

    def __str__(self) -> str:
        by = "" if self.by_rad is None else f"={self.by_rad / DEGREE:g}"
        return f"{self.kind}@{iso(self.time_s)}{by}"


def parse_event(text: str) -> Event:
    """The event of a text "KIND@DATE" or "calibrated@DATE=DEG".

    Raises:
        OncenterError: "usage", exit code 2: another form, or as `event_of`.
    """
    kind, at, rest = text.partition("@")
    date, has_size, size = rest.partition("=")
    if not at:
        raise _refusal(f"{text!r} is no event: {_FORM}")
    try:
        by_deg = float(size) if has_size else None
    except ValueError:
        raise _refusal(f"{size!r} in {text!r} is not a number of degrees: {_FORM}") from None
    return event_of(kind, date, by_deg)


def event_of(kind: str, date: str, by_deg: float | None = None) -> Event:
    """
    Args:
        kind: of `KINDS`.
        date: ISO 8601, with or without time of day; UTC without a zone. A date alone is its first second.
        by_deg: only of "calibrated".

    Raises:
        OncenterError: "usage", exit code 2: one of them is wrong.
    """
    if kind not in KINDS:
        raise _refusal(f"{kind!r} is no kind of event: {', '.join(KINDS)}")
    try:
        given = datetime.fromisoformat(date)
        time_s = (given if given.tzinfo else given.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        raise _refusal(f"{date!r} is no date: write 2026-03-02, or 2026-03-02T07:00, in UTC or with +01:00") from None
    if not 0.0 <= time_s <= LAST_S:
        raise _refusal(f"{date!r} is no date of a drive: write a year from 1970 to 9891")
    if by_deg is None:
        return Event(time_s, kind)
    if kind != CALIBRATED:
        raise _refusal(f"an angle of {by_deg:g} deg was given with {kind!r}: only 'calibrated' adds one")
    if not abs(by_deg) <= APPLIED_MAX_DEG:
        raise _refusal(f"a calibration adds {-APPLIED_MAX_DEG:g} to {APPLIED_MAX_DEG:g} deg, got {by_deg:g}")
    return Event(time_s, kind, by_deg * DEGREE)


def with_stated(events: Iterable[Event], stated: Iterable[Event]) -> tuple[Event, ...]:
    """In order of time and kind; a newly stated one takes the place of one of the same kind and time."""
    one_each = {(event.time_s, event.kind): event for event in (*events, *stated)}
    return tuple(one_each[key] for key in sorted(one_each))


def is_former(start_s: float | None, events: Iterable[Event]) -> bool:
    """Whether a drive with this start is of a former truck: before the last "another_truck". One without a date is of
    the present truck."""
    since = max((event.time_s for event in events if event.kind == ANOTHER_TRUCK), default=-math.inf)
    return start_s is not None and start_s < since


def _refusal(why: str) -> OncenterError:
    return OncenterError(why, code="usage", exit_code=WRONG_USAGE)
