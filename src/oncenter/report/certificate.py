"""The certificate of a repair: the offsets before and after it on one page, to print, to fill in and to sign."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from html import escape

from oncenter.offset.compare import Comparison, Offset, State
from oncenter.report.document import LINE, SIGNATURES, document, table, typeset
from oncenter.report.truck_part import PLATE
from oncenter.utc import utc
from oncenter.verdict.states import STATES, Code

_CODES: Mapping[State, Code] = {  # with the colour and the mark of each result
    "successful": "within",
    "within_limit": "within",
    "unchanged": "recalibrate",
    "wrong_direction": "recalibrate",
    "not_successful": "recalibrate",
    "undecided": "undecided",
    "no_correction": "no_correction",
}

_STYLE = ".signatures { display: grid; margin-top: 3rem; }"


def certificate(comparison: Comparison, written: datetime) -> str:
    """The page.

    Args:
        comparison: its vehicle, drives and verdict.
        written: now, UTC.
    """
    code = _CODES[comparison.state]
    mark, headline = STATES[code].mark, comparison.headline
    word, _, rest = headline.partition(": ")
    after = comparison.after
    body = f"""<header class="verdict {code}">
<p class="log">{escape(after.vehicle)}</p>
<p><span class="state {code}"><i aria-hidden="true">{mark}</i> {typeset(word.rstrip("."))}</span></p>
<h1>{typeset(rest[:1].upper() + rest[1:] or headline)}</h1>
<p class="action">{typeset(comparison.action)}</p>
</header>
<section>
<h2>Truck</h2>
{table({"Truck": escape(after.vehicle), "VIN": escape(after.vin or "") or LINE, PLATE: LINE, "Mileage": LINE})}
</section>
<section>
<h2>Before and after</h2>
{_drives(comparison)}
<p>Correction that was entered (deg): {LINE}</p>
<p>{typeset(f"{_in_words(comparison)} {comparison.order_note}")}</p>
</section>
<section>
<p class="quiet">oncenter, {written:%Y-%m-%d %H:%M} UTC</p>
{SIGNATURES}
</section>"""
    return document(f"Before and after: {after.vehicle}", body, "", style=_STYLE)


def _drives(comparison: Comparison) -> str:
    rows = "\n".join(
        f"<tr><th scope='row'>{name}</th><td>{escape(offset.log)}</td><td>{_start(offset)}</td>"
        f"<td>{_value(offset, comparison.limit_deg)}</td><td>{STATES[offset.code(comparison.limit_deg)].word}</td></tr>"
        for name, offset in (("Before", comparison.before), ("After", comparison.after))
    )
    head = "".join(f"<th scope='col'>{title}</th>" for title in ("", "Log", "Start", "Offset, 95 %", "Verdict"))
    return f"<table class='drives'>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{rows}\n</tbody></table>"


def _start(offset: Offset) -> str:
    return "" if offset.start_s is None else f"<time>{utc(offset.start_s):%Y-%m-%d %H:%M} UTC</time>"


def _value(offset: Offset, limit_deg: float) -> str:
    return "none" if offset.value_deg is None else typeset(str(offset.shown(limit_deg)))


def _in_words(comparison: Comparison) -> str:
    """The interval for people who do not read ±."""
    after = comparison.after
    if after.value_deg is None:
        return "The drive after has no offset."
    low, high = after.value_deg - after.half_width_deg, after.value_deg + after.half_width_deg
    share = comparison.shared_half_width_deg
    common = f" A pull or a crosswind may add up to {share:.1f} deg to both drives alike." if share >= 0.05 else ""
    return (
        f"It is 95 % certain that the offset after the repair is between {low:+.1f} and {high:+.1f} deg, as "
        f"far as one drive shows it; the limit is {comparison.limit_deg:g} deg to either side.{common}"
    )
