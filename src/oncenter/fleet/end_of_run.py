"""The words at the end of a run, on a screen or in the mail of a timer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from oncenter.files.file_name import printable
from oncenter.fleet.listing import as_text
from oncenter.fleet.news import News
from oncenter.verdict.states import OF_OFFSET, STATES

if TYPE_CHECKING:
    from oncenter.fleet.night import Summary

_SHOWN = 20  # lines of each part; the rest is in the tables
_STATES_BEFORE_ANY = ("within", "no_offset")


def in_words(summary: Summary) -> str:
    """Counts of the run and of the fleet, what is new, the logs without an answer, and the first trucks."""
    parts = [_counts(summary), list(_new(summary.new)), list(_without_answer(summary)), list(_odd(summary))]
    first = [row for row in summary.worst if row["state"] not in _STATES_BEFORE_ANY or row["watch"]]
    if first:
        parts.append([as_text(first)])
    page, tables = Path(summary.output) / "index.html", f"oncenter fleet trucks --output {summary.output}"
    parts.append([f"wrote {page}; all trucks: {tables}"])
    return "\n\n".join("\n".join(part) for part in parts if part)


def _counts(summary: Summary) -> list[str]:
    counts = [(summary.states.get(code, 0), state.word) for code, state in OF_OFFSET.items()]
    states = ", ".join(f"{count} {word}" for count, word in counts if count)
    unchanged = summary.logs_found - summary.logs_answered - summary.logs_refused - summary.logs_copied
    copied = f"{summary.logs_copied} copied or moved, " if summary.logs_copied else ""
    changes = "change" if summary.changes_of_offset == 1 else "changes"
    copies = f" ({summary.copies} of them copies or parts)" if summary.copies else ""
    return [
        f"{summary.logs_found} logs: {summary.logs_answered} answered now, {summary.logs_refused} without an answer, "
        f"{copied}{unchanged} unchanged; {summary.logs_per_second:.1f} logs/s, {summary.seconds:.0f} s",
        f"{summary.trucks} trucks, {summary.drives} drives{copies}: {states or 'no truck'}; "
        f"{summary.changes_of_offset} {changes} of an offset",
    ]


def _new(news: News) -> Iterator[str]:
    if news.is_first_night:
        return
    lines = [f"{each['truck']}: {_word(each['before'])} → {_word(each['now'])}" for each in news.verdicts]
    lines += [f"{truck}: new truck" for truck in news.trucks]
    if news.unread:
        lines.append(f"{_logs(len(news.unread))} without an answer {'is' if len(news.unread) == 1 else 'are'} new")
    yield "new since last night:" if lines else "new since last night: nothing"
    yield from _first([f"  {line}" for line in lines])


def _word(code: str) -> str:
    return next((state.word for known, state in STATES.items() if known == code), code)


def _without_answer(summary: Summary) -> Iterator[str]:
    """A line for the reason and the log, one for the sentence; new ones are marked."""
    if not summary.refused:
        return
    codes = ", ".join(f"{count} {code}" for code, count in summary.refused.items())
    yield f"logs without an answer: {codes}"
    new = set() if summary.new.is_first_night else {*summary.new.unread}
    rows = sorted(summary.unread, key=lambda row: (row["log"] not in new, row["log"]))
    width = max(len(row["error_code"]) for row in rows)
    for row in rows[:_SHOWN]:
        yield f"  {row['error_code']:{width}}  {row['log']}{'  (new)' if row['log'] in new else ''}"
        yield f"  {'':{width}}  {row['error']}"
    total = sum(summary.refused.values())
    if total > _SHOWN:
        sql = "SELECT error_code, log, error FROM drives WHERE error IS NOT NULL"
        yield f'  and {total - _SHOWN} more: oncenter fleet query "{sql}" --output {summary.output}'
    yield "what a reason means: oncenter explain REASON"


def _odd(summary: Summary) -> Iterator[str]:
    """Damage, logs that count twice, and those that count no longer."""
    lines = [f"damaged in the ledger, set apart and answered again if its log is there: {it}" for it in summary.damaged]
    lines += [
        f"{_copies(each['logs'])} have the same drive, which counts for each: remove the wrong one"
        for each in summary.in_two_trucks
    ]
    lines += [
        f"no longer counts for truck {each['truck']}, since its log was removed: {printable(each['log'])}"
        for each in summary.gone
    ]
    yield from _first(lines)


def _copies(logs: Sequence[Mapping[str, str]]) -> str:
    return " and ".join(f"{printable(each['log'])} of truck {each['truck']}" for each in logs)


def _first(lines: Sequence[str]) -> Iterator[str]:
    yield from lines[:_SHOWN]
    if len(lines) > _SHOWN:
        yield f"  and {len(lines) - _SHOWN} more, see metrics.json"


def _logs(count: int) -> str:
    return "1 log" if count == 1 else f"{count} logs"
