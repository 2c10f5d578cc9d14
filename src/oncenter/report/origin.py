"""Facts about a report beside its answer: the truck's number, the start of each log, the user, the time."""

from __future__ import annotations

import getpass
import time
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING

from oncenter.utc import utc

if TYPE_CHECKING:
    from collections.abc import Sequence

    from oncenter.signals import Signals


@dataclass(frozen=True)
class Origin:
    """`vin` and `start` (UTC, of the first drive) are None where no log gives them, `user` where none has a name."""

    vin: str | None = None
    start: datetime | None = None
    user: str | None = None
    written: datetime | None = None


def origin_of(drives: Sequence[Signals]) -> Origin:
    """The origin of drives; now, by this user."""
    vins = (drive.vin for drive in drives)
    starts = [start for start in map(_start, drives) if start is not None]
    return Origin(next(filter(None, vins), None), min(starts, default=None), _user(), utc(time.time()))


def _start(drive: Signals) -> datetime | None:
    seconds = drive.begin_s
    try:
        return None if seconds is None else utc(seconds)
    except OverflowError:
        return None


def _user() -> str | None:
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):  # a container may have a user without a name
        return None
