"""Logs of one truck with short stops between are one drive, as for `oncenter offset LOGS`.

Each log is answered alone first, in any order and on any machine. Then each drive is answered as a whole. The row of
its last log keeps that answer in `drive`, with the keys of all its logs, and in `rows` the columns of each drive that
was found: a sensor with another zero at a start begins another one.
"""

from __future__ import annotations

import math
from collections.abc import Container, Sequence
from typing import Any

from oncenter.offset.inputs import RATES_ALIKE, stop_in_drive
from oncenter.truck.events import Event

Row = dict[str, Any]

_OWN_CLOCK = ("log", "metadata")  # sources of a start; a file's name or date does not give a stop of minutes
_TOO_SHORT_ALONE = (None, "no_usable_second")


def in_one_drive(rows: Sequence[Row], events: Sequence[Event]) -> list[list[Row]]:
    """A truck's rows without copies, in order of time; those of one drive together."""
    groups: list[list[Row]] = []
    for row in rows:
        if groups and _go_on(groups[-1], row, events):
            groups[-1].append(row)
        else:
            groups.append([row])
    return groups


def _go_on(drive: Sequence[Row], row: Row, events: Sequence[Event]) -> bool:
    both = (drive[-1], row)
    if any(
        each.get("start_source") not in _OWN_CLOCK or each.get("error_code") not in _TOO_SHORT_ALONE for each in both
    ):
        return False
    if any(drive[-1].get(name) != row.get(name) for name in ("vehicle_file", "settings")):
        return False
    rates = [each["rate_hz"] for each in both if each.get("rate_hz")]
    if rates and max(rates) > (1.0 + RATES_ALIKE) * min(rates):
        return False
    spans = [(each["start"], each["start"] + (each.get("span_s") or math.nan)) for each in (drive[0], *both)]
    return stop_in_drive((spans[0][0], spans[1][1]), spans[2], events) >= 0.0


def has_answer(logs: Sequence[Row], again: Container[str] = ()) -> bool:
    """Whether a drive of several logs was answered as a whole, or that was tried without one of these errors."""
    drive = logs[-1].get("drive") or {}
    return drive.get("keys") == [row["key"] for row in logs] and drive.get("error_code") not in again


def as_drives(rows: Sequence[Row], events: Sequence[Event]) -> list[Row]:
    """A row for each drive: its own, or where its logs have no common answer, theirs."""
    drives: list[Row] = []
    for logs in in_one_drive(rows, events):
        answered = (k for k in range(len(logs), 1, -1) if has_answer(logs[:k]) and "rows" in logs[k - 1]["drive"])
        count = next(answered, 0)
        if count:
            whole = logs[count - 1]["drive"]
            drives += [whole | each for each in whole["rows"]]
        drives += logs[count:]
    return drives
