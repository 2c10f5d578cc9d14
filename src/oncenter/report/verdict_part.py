"""The top of the page: the verdict on the offset with the action, then those on free play and sensors."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from oncenter.report.document import joined, typeset
from oncenter.verdict import State, Verdict

# A word and a mark, since a colour alone is not seen by everybody, nor by a printer.
_WORDS: dict[State, tuple[str, str]] = {
    "recalibrate": ("!", "Recalibrate"),
    "within": ("✓", "Within the limit"),
    "over": ("!", "Over the limit"),
    "undecided": ("?", "Undecided"),
    "no_correction": ("–", "No correction"),
    "no_verdict": ("?", "No verdict"),
    "ok": ("✓", "OK"),
    "check": ("!", "Check"),
    "repair": ("!", "Repair"),
}
_NOT_MEASURED = "–", "Not measured"  # of free play and sensors, which nobody decides


def verdict_header(verdicts: Sequence[Verdict], title: str) -> str:
    """`verdicts` as `verdicts_of` gives them; `title` is escaped here."""
    first, *others = verdicts
    return f"""<header class="verdict {first.state}">
<p class="log">{escape(title)}</p>
<p>{_state(first)}</p>
<h1>{_text(_without_state(first.headline))}</h1>
<p class="action">{_text(first.action)}</p>
{f'<p class="note">{_text(first.note)}</p>' if first.note else ""}
<ul class="others">
{joined([_other(verdict) for verdict in others])}
</ul>
</header>"""


def _other(verdict: Verdict) -> str:
    action = "" if verdict.state == "ok" else f" {_text(' '.join(filter(None, (verdict.action, verdict.note))))}"
    name = verdict.about[:1].upper() + verdict.about[1:]
    said = f"<b>{escape(name)}:</b> {_text(_without_state(verdict.headline))}{action}"
    return f"<li>{_state(verdict)} <span>{said}</span></li>"


def _state(verdict: Verdict) -> str:
    is_other = verdict.about != "straight-ahead offset"
    mark, word = _NOT_MEASURED if is_other and verdict.state == "undecided" else _WORDS[verdict.state]
    return f'<span class="state {verdict.state}"><i aria-hidden="true">{mark}</i> {word}</span>'


def _without_state(headline: str) -> str:
    """The mark beside it says "Check" already."""
    state, colon, rest = headline.partition(": ")
    is_state = any(state == word for _, word in _WORDS.values())
    return f"{rest[:1].upper()}{rest[1:]}" if colon and is_state else headline


def _text(text: str) -> str:
    return typeset(text)
