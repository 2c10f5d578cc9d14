"""Changes since the last night: verdicts, trucks, and logs without an answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypedDict

from oncenter.files.own_file import NOT_A_LOG
from oncenter.fleet.ledger import Ledger

Row = Mapping[str, Any]

KINDS = ("new-calibrate", "new-fault", "unread", "new-unread", "damaged")  # that a run can fail on
_VERDICT, _UNREAD = "verdict", "unread"  # kinds in the ledger
_WATCHED = " watch"
_NAMED_MAX = 1000  # of a kind


class Kind(TypedDict):
    """How many trucks or logs have it, and the names of the first 1,000."""

    count: int
    names: list[str]


@dataclass(frozen=True)
class News:
    """Differences from the last night that ended; at the first night everything is new.

    Attributes:
        is_first_night: no night before it ended, or a former version wrote it.
        calibrate: trucks that are to be calibrated, and were not: verdict recalibrate without watch.
        fault: trucks with a fault at their newest drive, and no such fault before.
        verdicts: trucks whose verdict changed: truck, before, now.
        trucks: trucks that are new.
        unread: logs without an answer that had none of this reason before.
    """

    is_first_night: bool
    calibrate: tuple[str, ...]
    fault: tuple[str, ...]
    verdicts: tuple[dict[str, str], ...]
    trucks: tuple[str, ...]
    unread: tuple[str, ...]


def news_of(ledger: Ledger, ranked: Sequence[Row], unread: Sequence[Row]) -> News:
    """
    Args:
        ranked: rows of `tables.TRUCKS`.
        unread: drives without an answer: log and error_code.
    """
    from oncenter.verdict.states import AT_FAULT  # late: this process only supervises until the tables are written

    before, now = ledger.last_night(_VERDICT), _verdicts(ranked)
    unread_before = ledger.last_night(_UNREAD)
    changed = [truck for truck in now if before.get(truck) != now[truck]]
    return News(
        is_first_night=not before,
        calibrate=tuple(truck for truck in changed if now[truck] == "recalibrate"),
        fault=tuple(truck for truck in changed if _code(now[truck]) in AT_FAULT),
        verdicts=tuple(
            {"truck": truck, "before": _code(before[truck]), "now": _code(now[truck])}
            for truck in changed
            if truck in before and _code(before[truck]) != _code(now[truck])
        ),
        trucks=tuple(truck for truck in now if truck not in before),
        unread=tuple(
            row["log"]
            for row in unread
            if row["error_code"] != NOT_A_LOG and unread_before.get(row["log"]) != row["error_code"]
        ),
    )


def keep_for_next_night(ledger: Ledger, ranked: Sequence[Row], unread: Sequence[Row]) -> None:
    ledger.say({_VERDICT: _verdicts(ranked), _UNREAD: {row["log"]: row["error_code"] for row in unread}})


def kinds_of(news: News, unread: Sequence[Row], damaged: Sequence[str]) -> dict[str, Kind]:
    """By each of `KINDS` the trucks or logs that have it. Files that oncenter wrote are no drives that are missing."""
    found: tuple[Sequence[str], ...] = (
        news.calibrate,
        news.fault,
        [row["log"] for row in unread if row["error_code"] != NOT_A_LOG],
        news.unread,
        damaged,
    )
    return {
        kind: Kind(count=len(names), names=list(names[:_NAMED_MAX])) for kind, names in zip(KINDS, found, strict=True)
    }


def _verdicts(ranked: Sequence[Row]) -> dict[str, str]:
    return {row["truck"]: f"{row['state']}{_WATCHED if row['watch'] else ''}" for row in ranked}


def _code(verdict: str) -> str:
    return verdict.removesuffix(_WATCHED)
