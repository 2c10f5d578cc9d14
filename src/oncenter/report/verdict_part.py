"""The top of the page: the verdict on the offset with the action, then those on free play and sensors."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from oncenter.report.document import joined, typeset
from oncenter.verdict import STATES, Verdict


def verdict_header(verdicts: Sequence[Verdict], title: str) -> str:
    """`verdicts` as `verdicts_of` gives them; `title` is escaped here."""
    first, *others = verdicts
    return f"""<header class="verdict {first.state}">
<p class="log">{escape(title)}</p>
<p>{_state(first)}</p>
<h1>{_text(_capital(first.said))}</h1>
<p class="action">{_text(first.action)}</p>
{f'<p class="note">{_text(first.note)}</p>' if first.note else ""}
<ul class="others">
{joined([_other(verdict) for verdict in others])}
</ul>
</header>"""


def _other(verdict: Verdict) -> str:
    action = "" if verdict.state == "ok" else f" {_text(' '.join(filter(None, (verdict.action, verdict.note))))}"
    name = verdict.about[:1].upper() + verdict.about[1:]
    said = f"<b>{escape(name)}:</b> {_text(_capital(verdict.said))}{action}"
    return f"<li>{_state(verdict)} <span>{said}</span></li>"


def _state(verdict: Verdict) -> str:
    mark = STATES[verdict.state].mark
    return f'<span class="state {verdict.state}"><i aria-hidden="true">{mark}</i> {verdict.word}</span>'


def _capital(said: str) -> str:
    """A sentence of its own: the mark beside it has the word of the state."""
    return f"{said[:1].upper()}{said[1:]}"


def _text(text: str) -> str:
    return typeset(text)
