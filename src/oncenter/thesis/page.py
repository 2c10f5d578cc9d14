"""The page as text: figures and tables by their numbers, then every claim beside ours, then the misprints."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from html import escape as _escape
from importlib.resources import files

from oncenter.thesis.drawing import inline
from oncenter.thesis.figure import Claim, Exhibit, Figure, Misprint, Table

# Forbids the browser to load anything.
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


# one letter, perhaps with a hat or a dot, and its subscript
_SUBSCRIPT = re.compile(r"(?<![\w.])([^\W\d_][\u0302\u0307]?)_([A-Za-z0-9]{1,4}(?:,max)?)(?![\w.]\w)")


def escape(text: str) -> str:
    """Text for HTML, K_us and its like with subscripts, m/s^2 with its power."""
    return _SUBSCRIPT.sub(r"\1<sub>\2</sub>", _escape(text)).replace("^2", "²").replace("^-2", "⁻²").replace("^1", "¹")


def in_order(exhibits: Sequence[Exhibit]) -> list[Exhibit]:
    """The exhibits by their numbers: figures, then tables, then equations."""

    def place(exhibit: Exhibit) -> tuple[bool, bool, int, str]:
        digits = re.search(r"\d+", exhibit.number)
        equation = exhibit.number[0] in "(§"
        return isinstance(exhibit, Table), equation, int(digits[0]) if digits else 0, exhibit.number

    return sorted(exhibits, key=place)


def _section(where: str) -> tuple[int, ...]:
    """The section as a sort key: (4, 1) of "4.1, Fig. 10"; other beginnings come last."""
    found = re.match(r"[\d.]+", where)
    return tuple(int(part) for part in found[0].split(".") if part) if found else (99,)


def file_stem(figure: Figure) -> str:
    """The names of the figure's files: "figure-16a", "figure-2-more" for "2+", "equation-26" for "(26)"."""
    if figure.number.startswith("("):
        return "equation-" + figure.number.strip("()")
    return "figure-" + figure.number.replace("+", "-more")


def page(exhibits: Sequence[Exhibit], svgs: Mapping[str, str], version: str) -> str:
    """The whole HTML document; `svgs` has each figure's document by its number."""
    ordered = in_order(exhibits)
    claims = [(exhibit, claim) for exhibit in ordered for claim in exhibit.claims]
    claims.sort(key=lambda pair: _section(pair[1].where))
    misprints = sorted((m for exhibit in ordered for m in exhibit.misprints), key=lambda m: _section(m.where))
    figures = [exhibit for exhibit in ordered if isinstance(exhibit, Figure)]
    tables = [exhibit for exhibit in ordered if isinstance(exhibit, Table)]
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta http-equiv="Content-Security-Policy" content="{_POLICY}">
<title>The thesis, line by line</title>
<style>{files("oncenter.thesis").joinpath("page.css").read_text(encoding="utf-8")}</style>
</head>
<body>
<main>
<header>
<h1>The thesis, line by line</h1>
<p>P. Fejes, <i>Estimation of Steering Wheel Angle in Heavy-Duty Trucks</i> (Uppsala University, UPTEC F16 019, 2016):
its figures, tables and numbers reproduced by <code>oncenter thesis</code>, version {escape(version)}, from the
equations, the simulator and the estimators of this code. All results here are computed. The thesis's own drives
were never published: where it shows a drive, ours is simulated with the truck of its Table 2.</p>
<p class="quiet">{len(figures)} figures, {len(tables)} tables, <a href="#claims">{len(claims)} claims</a> beside ours,
<a href="#misprints">{len(misprints)} misprints</a> with their checks.</p>
<nav>{"".join(_link(exhibit) for exhibit in ordered)}</nav>
</header>
<section>
<h2>Figures</h2>
<div class="pictures">
{"".join(_figure(figure, svgs[figure.number]) for figure in figures)}</div>
</section>
<section>
<h2>Tables and equations</h2>
{"".join(_table(table) for table in tables)}</section>
{_claims(claims)}
{_misprints(misprints)}
</main>
</body>
</html>
"""


def _anchor(exhibit: Exhibit) -> str:
    return ("table-" if isinstance(exhibit, Table) else "figure-") + re.sub(r"[^\w+-]", "", exhibit.number)


def _name(exhibit: Exhibit) -> str:
    if exhibit.number[0] in "(§":
        return f"Equation {exhibit.number}" if isinstance(exhibit, Figure) else exhibit.number
    return f"{type(exhibit).__name__} {exhibit.number}"


def _link(exhibit: Exhibit) -> str:
    return f'<a href="#{_anchor(exhibit)}">{_name(exhibit)}</a>'


def _figure(figure: Figure, svg: str) -> str:
    stem = file_stem(figure)
    return f"""<div class="card" id="{_anchor(figure)}">
<h3><b>{_name(figure)}</b>{escape(figure.title)}</h3>
<div class="figure" tabindex="0" role="group" aria-label="{_name(figure)}">
{inline(svg, figure.number)}
</div>
<p class="caption">{escape(figure.caption)}</p>
{_beside(figure.claims)}<p class="files"><a href="{stem}.svg">SVG</a> <a href="{stem}.png">PNG</a></p>
</div>
"""


def _table(table: Table) -> str:
    head = "".join(f"<th>{escape(column)}</th>" for column in table.columns)
    rows = "".join(
        "<tr>"
        + "".join(
            f'<td data-name="{_escape(column)}">{escape(cell)}</td>' if k else f"<th>{escape(cell)}</th>"
            for k, (column, cell) in enumerate(zip(table.columns, row, strict=True))
        )
        + "</tr>\n"
        for row in table.rows
    )
    return f"""<div class="card" id="{_anchor(table)}">
<h3><b>{_name(table)}</b>{escape(table.title)}</h3>
<table class="rows"><thead><tr>{head}</tr></thead><tbody>
{rows}</tbody></table>
<p class="caption">{escape(table.caption)}</p>
{_beside(table.claims)}</div>
"""


def number(value: float | None) -> str:
    """Three significant digits; a rounding error counts as zero."""
    if value is None:
        return "—"
    if abs(value) < 1e-9:
        return "0"
    text = f"{value:.3g}"
    if "e" in text:
        text = f"{value:.0f}" if 1e3 <= abs(value) < 1e7 else text
    return text.replace("-", "−")


def _with_unit(value: float | None, unit: str) -> str:
    return number(value) + (f' <span class="unit">{escape(unit)}</span>' if unit and value is not None else "")


def _beside(claims: Sequence[Claim]) -> str:
    if not claims:
        return ""
    rows = "".join(
        f'<tr><td>{escape(claim.text)}</td><td class="number printed">{number(claim.thesis)}</td>'
        f'<td class="number ours">{_with_unit(claim.ours, claim.unit)}</td></tr>\n'
        for claim in claims
    )
    return (
        '<table class="beside"><thead><tr><th></th><th class="number">thesis</th><th class="number">ours</th></tr>'
        f"</thead><tbody>\n{rows}</tbody></table>\n"
    )


def _claims(claims: Sequence[tuple[Exhibit, Claim]]) -> str:
    rows = "".join(
        f'<tr><td class="where"><a href="#{_anchor(exhibit)}">{escape(claim.where)}</a></td>'
        f"<td>{escape(claim.text)}</td>"
        f'<td class="number printed" data-name="thesis">{_with_unit(claim.thesis, claim.unit)}</td>'
        f'<td class="number ours" data-name="ours">{_with_unit(claim.ours, claim.unit)}</td>'
        f"<td>{escape(claim.note)}</td></tr>\n"
        for exhibit, claim in claims
    )
    return f"""<section id="claims">
<h2>Every claim with a number</h2>
<div class="wide"><table class="rows"><thead><tr><th>where</th><th>claim</th><th class="number">thesis</th>
<th class="number">ours</th><th>source of our number, and reason for a difference</th></tr></thead><tbody>
{rows}</tbody></table></div>
</section>"""


def _misprints(misprints: Sequence[Misprint]) -> str:
    rows = "".join(
        f'<tr><td class="where">{escape(m.where)}</td><td data-name="printed:">{escape(m.printed)}</td>'
        f'<td data-name="right:">{escape(m.right)}</td><td>{escape(m.check)}</td>'
        f'<td class="{"shown" if m.shown else "unshown"}">{"confirmed" if m.shown else "not confirmed"}</td></tr>\n'
        for m in misprints
    )
    return f"""<section id="misprints">
<h2>Misprints, each checked</h2>
<div class="wide"><table class="rows"><thead><tr><th>where</th><th>printed</th><th>right</th><th>check</th>
<th>result</th></tr></thead><tbody>
{rows}</tbody></table></div>
</section>"""
