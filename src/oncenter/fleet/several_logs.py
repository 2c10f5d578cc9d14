"""Logs of one truck with short stops between are one drive, as for `oncenter offset LOGS`.

Each log is answered alone first, in any order and on any machine. Then each drive is
answered as a whole: the row of its last log keeps that answer, in `drive`, with the keys of all its logs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from oncenter.offset.inputs import is_short, stop_between
from oncenter.truck.events import Event

Row = dict[str, Any]

_OWN_CLOCK = ("log", "metadata")  # sources of a start; a file's name or date does not give a stop of minutes
_TOO_SHORT_ALONE = (None, "no_usable_second")


def in_one_drive(rows: Sequence[Row], events: Sequence[Event]) -> list[list[Row]]:
    """A truck's rows without copies, in order of time; those of one drive together."""
    groups: list[list[Row]] = []
    for row in rows:
        if groups and _continues(groups[-1][-1], row, events):
            groups[-1].append(row)
        else:
            groups.append([row])
    return groups


def _continues(before: Row, row: Row, events: Sequence[Event]) -> bool:
    both = (before, row)
    if any(
        each.get("start_source") not in _OWN_CLOCK or each.get("error_code") not in _TOO_SHORT_ALONE for each in both
    ):
        return False
    alike = all(before.get(name) == row.get(name) for name in ("vehicle_file", "settings"))
    return alike and is_short(stop_between(before["start"] + (before.get("span_s") or math.nan), row["start"], events))


def has_answer(logs: Sequence[Row]) -> bool:
    """Whether a drive of several logs was answered as a whole, or that was tried."""
    return (logs[-1].get("drive") or {}).get("keys") == [row["key"] for row in logs]


def as_drives(rows: Sequence[Row], events: Sequence[Event]) -> list[Row]:
    """A row for each drive: its own, or where its logs have no common answer, theirs."""
    drives: list[Row] = []
    for logs in in_one_drive(rows, events):
        is_one = len(logs) > 1 and has_answer(logs) and logs[-1]["drive"].get("error_code") is None
        drives += [logs[-1]["drive"]] if is_one else logs
    return drives
