"""The fleet's page: the trucks to act on first, then the fleet; each truck's drives a click away. One offline file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import quote

from oncenter import _core
from oncenter.files.whole_file import write_whole
from oncenter.fleet import pictures
from oncenter.fleet.listing import next_lines, offset_words
from oncenter.fleet.page_data import PageData
from oncenter.fleet.ranking import SHARE_OF_FALSE_ALARMS
from oncenter.report.canvas import COLOURS
from oncenter.report.document import document, embedded, joined, key, nothing
from oncenter.utc import utc
from oncenter.verdict.states import AT_FAULT, OF_OFFSET, STATES, colour_of

_NOT_DRAWN = ("check_signal", "no_offset")  # without an offset
_SHOWN, _LISTED = 20, 200  # trucks in the table at first, and when it is opened; every truck opens by its name


@dataclass(frozen=True)
class Contents:
    """The contents of a page.

    Attributes:
        ranked, changes: rows of the tables, times in s since 1970.
        drives: all drives, those without a truck included.
        refused: logs without an answer, by error code.
        data: all trucks' histories.
    """

    ranked: Sequence[dict[str, Any]]
    changes: Sequence[dict[str, Any]]
    drives: int
    refused: Mapping[str, int]
    data: PageData


def write_page(path: Path, contents: Contents) -> None:
    """Writes `index.html`."""
    write_whole(path, _page(contents))


def _page(contents: Contents) -> str:
    ranked, changes = contents.ranked, contents.changes
    drawn = {
        "distribution": pictures.distribution(ranked),
        "ranking": pictures.ranking(ranked),
        "calendar": pictures.calendar(changes),
        "history": pictures.truck_history(),
    }
    script, divs = embedded({name: picture for name, picture in drawn.items() if picture is not None})
    body = f"""{_head(contents)}
{_truck(divs["history"], contents)}
{_at_fault(ranked)}
{_ranking(ranked, changes, divs)}
{_section("Distribution", _states_key() + divs.get("distribution", nothing("No offset yet.")))}
{_section("Changes of the offset", _calendar(divs))}
{_produced(ranked)}
<script type="text/plain" id="data">{contents.data.text()}</script>"""
    colours = json.dumps({name: COLOURS[name] for name in ("estimate", "rejected")})
    return document(
        f"Steering wheel angle offsets of {len(ranked)} trucks",
        body,
        script,
        style=_asset("fleet.css"),
        program=f"const COLOURS = {colours};\n{_asset('fleet.js')}",
    )


def _asset(name: str) -> str:
    return files("oncenter.fleet").joinpath(name).read_text(encoding="utf-8")


def _section(title: str, inside: str) -> str:
    return f"<section>\n<h2>{title}</h2>\n{inside}\n</section>"


def _states_key() -> str:
    swatches = (
        f'<span><i class="swatch" style="background:{colour_of(code)}"></i>{state.word}</span>'
        for code, state in OF_OFFSET.items()
        if code not in _NOT_DRAWN
    )
    return f'<p class="key">{" ".join(swatches)}</p>'


def _head(contents: Contents) -> str:
    ranked = contents.ranked
    counts = {state: sum(row["state"] == state for row in ranked) for state in OF_OFFSET}
    days = [row[name] for row in ranked for name in ("first_drive", "last_drive") if row[name] is not None]
    span = f", {_day(min(days))} to {_day(max(days))}" if days else ""
    of_offset = sum(change["quantity"] == "offset" for change in contents.changes)
    wrong = ", ".join(f"{count} {escape(code.replace('_', ' '))}" for code, count in contents.refused.items())
    found = f"{of_offset} {'change' if of_offset == 1 else 'changes'} of an offset detected."
    tiles = "".join(
        f'<div class="tile {code}"><b>{counts[code]}</b><span>{state.word}</span><small>{state.about}</small></div>'
        for code, state in OF_OFFSET.items()
        if counts[code] or code == "recalibrate"
    )
    return f"""<header>
<p class="log">{len(ranked)} trucks · {contents.drives} drives{span}</p>
<h1>Steering wheel angle offsets of the fleet</h1>
<div class="tiles">{tiles}</div>
<p>{found}{f" Logs without an answer: {wrong}." if wrong else ""}</p>
<p class="quiet">{_limit(ranked)} The 95 % interval of a truck's offset from its drives decides. Recalibrate: the whole
interval is beyond the limit. Within the limit: the whole interval is within it. Undecided: the limit is inside the
interval, or the drives are too few, and the table names the drive that narrows it most. A pull is a second line in the
table. {_evidence(ranked)}</p>
</header>"""


def _limit(ranked: Sequence[dict[str, Any]]) -> str:
    limit_deg = pictures.common_limit_deg(ranked)
    if limit_deg is None:
        return "Each truck has the limit of its vehicle file."
    return f"The limit is ±{limit_deg:g} deg."


def _evidence(ranked: Sequence[dict[str, Any]]) -> str:
    """A warning where some trucks to recalibrate may be healthy because many trucks were tested."""
    weak = sum(row["state"] == "recalibrate" and row["q_value"] > SHARE_OF_FALSE_ALARMS for row in ranked)
    if not weak:
        return ""
    trucks = "truck" if weak == 1 else "trucks"
    return (
        f"{weak} {trucks} to recalibrate may be a false alarm: q, the share of false alarms among the trucks down to "
        f"that rank (Benjamini–Hochberg), is above {100 * SHARE_OF_FALSE_ALARMS:g} %."
    )


def _truck(picture: str, contents: Contents) -> str:
    names = "".join(f'<option value="{escape(str(row["truck"]), quote=True)}">' for row in contents.ranked)
    keys = (
        '<span><i class="swatch estimate"></i>one drive, 95 % interval; paler: still converging</span>'
        '<span><i class="swatch measured"></i>offset by the model of the truck</span>'
        '<span><i class="swatch rejected"></i>change, dashed; a drive before a fault of its sensor</span>'
    )
    return f"""<section id="truck">
<h2>One truck</h2>
<p><label>Truck <input id="name" list="names" placeholder="name or VIN" autocomplete="off"></label>
<datalist id="names">{names}</datalist>
<span class="quiet" id="summary">Click a truck in a table or picture, or type its name.</span></p>
<div id="history" hidden>
<p class="key">{keys}</p>
{picture}
<table id="changes"></table>
<details><summary>Drives</summary><table id="drives"></table></details>
</div>
</section>"""


def _at_fault(ranked: Sequence[dict[str, Any]]) -> str:
    """The trucks whose signal or sensor is at fault: their rank says nothing of that."""
    rows = [row for row in ranked if row["state"] in AT_FAULT]
    if not rows:
        return ""
    items = [f"<li>{_link(row)}: {_state(row)} {_FAULTS[row['state']]}</li>" for row in rows[:_LISTED]]
    more = f'<p class="quiet">The first {_LISTED} of {len(rows)}.</p>' if len(rows) > _LISTED else ""
    action = "<p>An offset from before a fault must not be set.</p>"
    return _section("Signal or sensor at fault", f"{action}<ul>{joined(items)}</ul>{more}")


_FAULTS = {
    "check_signal": "The signals of its newest drive contradict each other: correct the signal that its report names.",
    "signal_or_sensor": "The steering wheel angle of its newest drive is lost, stuck or reversed: check the signal "
    "first, then the sensor.",
    "repair": "A fault of the steering wheel angle sensor at the newest drive, or its zero moves from drive to drive: "
    "check the sensor, its mounting and its connector.",
}


def _state(row: Mapping[str, Any]) -> str:
    return f'<span class="verdict {row["state"]}">{STATES[row["state"]].word}</span>'


def _ranking(ranked: Sequence[dict[str, Any]], changes: Sequence[dict[str, Any]], divs: Mapping[str, str]) -> str:
    if not ranked:
        return _section("Ranking", nothing("No truck yet."))
    last = {change["truck"]: change for change in changes if change["quantity"] == "offset"}
    lines = [_line(row, last.get(row["truck"])) for row in ranked[:_LISTED]]
    more = f'<p class="quiet">The first {_LISTED} of {len(ranked)}.</p>' if len(ranked) > _LISTED else ""
    rest = f"<details><summary>The next trucks</summary>{_table(lines[_SHOWN:])}{more}</details>"
    plot = _states_key() + divs["ranking"] if "ranking" in divs else ""
    return _section("Ranking by evidence", plot + _table(lines[:_SHOWN]) + (rest if len(lines) > _SHOWN else ""))


def _table(lines: Sequence[str]) -> str:
    return f"""<table class="ranking">
<thead><tr><th class="number">Rank</th><th>Truck</th><th>Verdict</th><th class="number">Offset (deg)</th>
<th class="number">95 % interval</th><th>Since</th><th>Last change</th><th class="number">q</th></tr></thead>
<tbody>
{joined(list(lines))}
</tbody></table>"""


def _link(row: dict[str, Any]) -> str:
    return f'<a href="#{quote(str(row["truck"]), safe="")}">{escape(str(row["truck"]))}</a>'


def _line(row: dict[str, Any], change: dict[str, Any] | None) -> str:
    has_offset = row.get("p_value") is not None
    cells = ["—"] * 2
    if has_offset:
        cells = list(map(_minus, offset_words(row)))
    size = "" if change is None else f"{_signed(change['size'])} deg, {change['cause'].replace('_', ' ')}"
    since = _day(row["since"]) if change is not None and has_offset else ""
    return (
        f'<tr><td class="number">{row["rank"]}</td><th scope="row">{_link(row)}</th>'
        f"<td>{_state(row)}{joined([f'<small>{escape(line)}</small>' for line in next_lines(row)])}</td>"
        f'<td class="number{"" if has_offset else " none"}">{cells[0]}</td>'
        f'<td class="number interval">{cells[1]}</td><td class="day">{since}</td><td>{size}</td>'
        f'<td class="number interval">{_small(row["q_value"]) if has_offset else "—"}</td></tr>'
    )


def _calendar(divs: Mapping[str, str]) -> str:
    if "calendar" not in divs:
        return nothing("No offset has changed.")
    return (
        "<p>Time and size of each change, and the quantity that changed with it. A remounted sensor and a new wheel "
        f"alignment give the same change of the offset.</p>{key(**_CAUSES)}{divs['calendar']}"
    )


_CAUSES = {colour: name.replace("_", " ") for name, colour in pictures.CAUSE_COLOURS.items()}


def _produced(ranked: Sequence[dict[str, Any]]) -> str:
    return _section(
        "Provenance",
        f"<p>oncenter {escape(_core.version())}. {_limit(ranked)} This page is complete in itself and can be mailed. "
        "<code>oncenter fleet trucks --csv</code> exports the ranking; <code>oncenter fleet query</code> runs SQL on "
        "all tables.</p>",
    )


def _signed(number: float) -> str:
    return _minus(f"{number:+.1f}").replace("+0.0", "0.0").replace("−0.0", "0.0")


def _minus(text: str) -> str:
    return text.replace("-", "−")


def _small(number: float) -> str:
    return "&lt; 0.001" if number < 0.001 else f"{number:.3f}"


def _day(time_s: float) -> str:
    return f"{utc(time_s):%Y-%m-%d}"
