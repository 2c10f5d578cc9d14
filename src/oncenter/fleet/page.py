"""The fleet's page: what to do first, then how the fleet stands; trucks and drives a click away, all of it offline."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import quote

from oncenter import _core
from oncenter.files.file_name import file_stem
from oncenter.files.whole_file import write_whole
from oncenter.fleet import pictures
from oncenter.fleet.ranking import SHARE_OF_FALSE_ALARMS
from oncenter.fleet.tables import OFFSET
from oncenter.report.canvas import COLOURS
from oncenter.report.document import document, embedded, joined, key, nothing
from oncenter.utc import utc

_SHOWN, _LISTED = 20, 200  # trucks in the table at first, and when it is opened; all of them open by their name
_VERDICTS = {
    "calibrate": "whole interval beyond the limit",
    "watch": "weaker evidence, or only a change",
    "undecided": "limit inside the interval",
    "fine": "whole interval within the limit",
    "unknown": "no drive told an offset",
}


def write_page(
    path: Path,
    ranked: Sequence[dict[str, Any]],
    changes: Sequence[dict[str, Any]],
    drives: int,
    refused: Mapping[str, int],
    limit_deg: float,
) -> None:
    """`index.html`; `ranked` and `changes` are the rows of the tables, times in s since 1970; `drives` also
    counts those of no truck that is known."""
    write_whole(path, _page(ranked, changes, drives, refused, limit_deg))


def _page(
    ranked: Sequence[dict[str, Any]],
    changes: Sequence[dict[str, Any]],
    drives: int,
    refused: Mapping[str, int],
    limit_deg: float,
) -> str:
    drawn = {
        "distribution": pictures.distribution(ranked, limit_deg),
        "ranking": pictures.ranking(ranked, limit_deg),
        "calendar": pictures.calendar(changes),
        "history": pictures.truck_history(limit_deg),
    }
    script, divs = embedded({name: picture for name, picture in drawn.items() if picture is not None})
    body = f"""{_head(ranked, changes, drives, refused, limit_deg)}
{_truck(divs["history"], ranked)}
{_ranking(ranked, changes, divs)}
{_section("Distribution", _key(pictures.VERDICT_COLOURS) + divs.get("distribution", nothing("No offset yet.")))}
{_section("Changes of the offset", _calendar(divs))}
{_produced(limit_deg)}"""
    colours = json.dumps({name: COLOURS[name] for name in ("estimate", "rejected")})
    return document(
        f"Steering wheel angle offsets of {len(ranked)} trucks",
        body,
        script,
        style=_asset("fleet.css"),
        program=f"const COLOURS = {colours};\n{_asset('fleet.js')}",
        beside=True,  # the trucks' histories
    )


def _asset(name: str) -> str:
    return files("oncenter.fleet").joinpath(name).read_text(encoding="utf-8")


def _section(title: str, inside: str, name: str = "") -> str:
    return f"<section{f' id={name}' if name else ''}>\n<h2>{title}</h2>\n{inside}\n</section>"


def _key(colours: Mapping[str, str]) -> str:
    return key(**{colour: name.replace("_", " ") for name, colour in colours.items()})


def _head(
    ranked: Sequence[dict[str, Any]],
    changes: Sequence[dict[str, Any]],
    drives: int,
    refused: Mapping[str, int],
    limit_deg: float,
) -> str:
    counts = {verdict: sum(row["verdict"] == verdict for row in ranked) for verdict in _VERDICTS}
    days = [row[name] for row in ranked for name in ("first_drive", "last_drive") if row[name] is not None]
    span = f", {_day(min(days))} to {_day(max(days))}" if days else ""
    of_offset = sum(change["quantity"] == "offset" for change in changes)
    wrong = ", ".join(f"{count} {escape(code.replace('_', ' '))}" for code, count in refused.items())
    tiles = "".join(
        f'<div class="tile {verdict}"><b>{count}</b><span>{verdict}</span><small>{_VERDICTS[verdict]}</small></div>'
        for verdict, count in counts.items()
        if count or verdict == "calibrate"
    )
    return f"""<header>
<p class="log">{len(ranked)} trucks · {drives} drives{span}</p>
<h1>Steering wheel angle offsets of the fleet</h1>
<div class="tiles">{tiles}</div>
<p>{of_offset} changes of an offset were found.{f" Logs without an answer: {wrong}." if wrong else ""}</p>
<p class="quiet">The limit is ± {limit_deg:g} deg, and a truck is judged by the 95 % interval of its offset.
Calibrate: all of it is beyond the limit, on such evidence that on average at most {100 * SHARE_OF_FALSE_ALARMS:g} % of
those named are healthy (Benjamini–Hochberg). Watch: the evidence is weaker, or only the last change is larger than the
limit. Undecided: the limit is inside the interval; the table names the drive that would narrow it.</p>
</header>"""


def _truck(picture: str, ranked: Sequence[dict[str, Any]]) -> str:
    names = "".join(_option(str(row["truck"])) for row in ranked)
    keys = (
        '<span><i class="swatch estimate"></i>one drive, 95 % interval; paler while still converging</span>'
        '<span><i class="swatch measured"></i>mean between changes</span>'
        '<span><i class="swatch rejected"></i>change, dashed; a drive before a fault of its sensor</span>'
    )
    return f"""<section id="truck">
<h2>One truck</h2>
<p><label>Truck <input id="name" list="names" placeholder="name or VIN" autocomplete="off"></label>
<datalist id="names">{names}</datalist> <span class="quiet" id="told"></span></p>
<div id="history" hidden>
<p class="key">{keys}</p>
{picture}
<p class="quiet">A click on a drive opens its report where one was written (oncenter fleet run --reports).</p>
<table id="changes"></table>
<details><summary>Drives</summary><table id="drives"></table></details>
</div>
</section>"""


def _option(truck: str) -> str:
    """Its name, and that of its file where it is another."""
    stem = file_stem(truck)
    of_file = "" if stem == truck else f' data-file="{escape(stem, quote=True)}"'
    return f'<option value="{escape(truck, quote=True)}"{of_file}>'


def _ranking(ranked: Sequence[dict[str, Any]], changes: Sequence[dict[str, Any]], divs: Mapping[str, str]) -> str:
    if not ranked:
        return _section("Ranking", nothing("No truck yet."))
    last = {change["truck"]: change for change in changes if change["quantity"] == "offset"}
    lines = [_line(row, last.get(row["truck"])) for row in ranked[:_LISTED]]
    more = f'<p class="quiet">The first {_LISTED} of {len(ranked)}.</p>' if len(ranked) > _LISTED else ""
    rest = f"<details><summary>The next trucks</summary>{_table(lines[_SHOWN:])}{more}</details>"
    plot = _key(pictures.VERDICT_COLOURS) + divs["ranking"] if "ranking" in divs else ""
    return _section("Ranking by evidence", plot + _table(lines[:_SHOWN]) + (rest if len(lines) > _SHOWN else ""))


def _table(lines: Sequence[str]) -> str:
    return f"""<table class="ranking">
<thead><tr><th class="number">Rank</th><th>Truck</th><th>Verdict</th><th class="number">Offset (deg)</th>
<th class="number">95 % interval</th><th>Since</th><th>Last change</th><th class="number">q</th></tr></thead>
<tbody>
{joined(list(lines))}
</tbody></table>"""


def _line(row: dict[str, Any], change: dict[str, Any] | None) -> str:
    truck = escape(str(row["truck"]))
    link = f'<a href="#{quote(str(row["truck"]), safe="")}">{truck}</a>'
    known = row.get("p_value") is not None
    cells = ["—"] * 2
    if known:
        value, half = row[OFFSET.value], 1.96 * row[OFFSET.sd]
        cells = [_signed(value), f"{_signed(value - half)} to {_signed(value + half)}"]
    told = "" if change is None else f"{_signed(change['size'])} deg, {change['cause'].replace('_', ' ')}"
    since = _day(row["since"]) if change is not None and known else ""
    return (
        f'<tr><td class="number">{row["rank"]}</td><th scope="row">{link}</th>'
        f'<td><span class="verdict {row["verdict"]}">{row["verdict"]}</span>{_would_decide(row)}</td>'
        f'<td class="number">{cells[0]}</td>'
        f'<td class="number interval">{cells[1]}</td><td>{since}</td><td>{told}</td>'
        f'<td class="number interval">{_small(row["q_value"]) if known else "—"}</td></tr>'
    )


def _would_decide(row: dict[str, Any]) -> str:
    told = row.get("would_decide")
    return f"<small>would decide: {escape(told)}</small>" if told else ""


def _calendar(divs: Mapping[str, str]) -> str:
    if "calendar" not in divs:
        return nothing("No offset has changed.")
    return (
        "<p>When, by how much, and what else changed with it. A sensor that was remounted and wheels that were aligned "
        f"anew read alike.</p>{_key(pictures.CAUSE_COLOURS)}{divs['calendar']}"
    )


def _produced(limit_deg: float) -> str:
    return _section(
        "What produced it",
        f"<p>oncenter {escape(_core.version())}, limit {limit_deg:g} deg. The numbers are in "
        "<code>drives.parquet</code>, <code>trucks.parquet</code> and <code>changes.parquet</code> beside this page: "
        "<code>oncenter fleet query</code> asks them.</p>",
    )


def _signed(number: float) -> str:
    return f"{number:+.1f}".replace("-", "−").replace("+0.0", "0.0").replace("−0.0", "0.0")


def _small(number: float) -> str:
    return "&lt; 0.001" if number < 0.001 else f"{number:.3f}"


def _day(time_s: float) -> str:
    return f"{utc(time_s):%Y-%m-%d}"
