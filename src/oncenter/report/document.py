"""Parts of all pages: the document around them, which loads nothing from outside, and its small elements."""

from __future__ import annotations

import re
from collections.abc import Mapping
from html import escape
from importlib.resources import files

from bokeh.embed import components
from bokeh.plotting import figure
from bokeh.resources import Resources

from oncenter.findings import capitalised
from oncenter.report.canvas import COLOURS
from oncenter.verdict.states import style as states_style

_STATUSES = {
    "converging": "not sure enough yet",
    "unobservable": "not observable in this drive",
    "invalid": "a signal is at fault",
}

# The browser fetches nothing, whatever the page or a library in it tries.
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"

_WITHIN_A_NUMBER = re.compile(r"(?<=\d) (?=(?:deg|m|km|s|min|h|Hz)\b|%|±)|(?<=[a-z²]) (?=± ?\d)|(?<=±) (?=\d)")
_RANDOM_NAME = re.compile(r"(?:bk-)?[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}")

LINE = '<span class="line"></span>'  # to write on
SIGNATURES = f'<div class="signatures"><p>{LINE}<br>Place, date</p><p>{LINE}<br>Name, signature</p></div>'


def document(title: str, body: str, script: str, *, style: str = "", program: str = "") -> str:
    """The whole HTML document. `script` is bokeh's for the pictures in the body, empty where there are none.

    A page may bring CSS and, after bokeh's, JavaScript of its own.
    """
    colours = "".join(f"--{name}:{colour};" for name, colour in COLOURS.items())
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta http-equiv="Content-Security-Policy" content="{_POLICY}">
<title>{escape(title)}</title>
<style>:root{{{colours}}}
{states_style()}{_asset("page.css")}{style}</style>
</head>
<body>
<main>
{body}
</main>
{_scripts(script, program) if script else ""}
</body>
</html>
"""


def embedded(pictures: Mapping[str, figure]) -> tuple[str, dict[str, str]]:
    """bokeh's script for all pictures, and the place of each on the page; the same bytes for the same pictures.

    bokeh names document and places at random, and numbers its models through the life of a process.
    """
    if not pictures:
        return "", {}
    script, divs = components(pictures)
    models, mark, places = script.rpartition("const render_items")  # after it there are names only, before it also data
    numbers: dict[str, str] = {}

    def numbered(name: re.Match[str]) -> str:
        return numbers.setdefault(name[0], f"p{len(numbers) + 1}")

    # within data quotes are escaped, so that a truck called p1001 keeps its name
    script = re.sub(r'(?<="id":")p\d+(?=")', numbered, models) + mark + re.sub(r'(?<=")p\d+(?=")', numbered, places)
    divs = {title: re.sub(r'(?<=data-root-id=")p\d+(?=")', numbered, div) for title, div in divs.items()}
    for k, name in enumerate(dict.fromkeys(_RANDOM_NAME.findall(places))):
        script = script.replace(name, f"bokeh-{k}")
        divs = {title: div.replace(name, f"bokeh-{k}") for title, div in divs.items()}
    return script, divs


def _asset(name: str) -> str:
    return files("oncenter.report").joinpath(name).read_text(encoding="utf-8")


def _scripts(plots: str, program: str) -> str:
    library = Resources(mode="inline", minified=True, components=["bokeh"]).render_js()
    return f"<!--\n{_asset('licences.txt')}-->\n{library}\n{plots}\n<script>{_asset('page.js')}{program}</script>"


def key(**entries: str) -> str:
    """The key of a picture: texts by colour, or by colour and form, such as `used_up` or `rejected_dashed`."""
    spans = [
        f'<span><i class="swatch {colour.replace("_", " ")}"></i>{unbroken(text)}</span>'
        for colour, text in entries.items()
    ]
    return f'<p class="key">{" ".join(spans)}</p>'


def nothing(text: str) -> str:
    return f'<p class="nothing">{text}</p>'


def table(entries: Mapping[str, str]) -> str:
    lines = [f'<tr><th scope="row">{key}</th><td>{value}</td></tr>' for key, value in entries.items()]
    return f"<table>\n{joined(lines)}\n</table>"


def number(value: float, digits: int, signed: bool) -> str:
    return f"{value:{'+' if signed else ''}.{digits}f}".replace("-", "−")


def status(status: str) -> str:
    return (
        f'<span class="status {escape(status)}">{escape(status)}</span> '
        f'<span class="quiet">{_STATUSES.get(status, "")}</span>'
    )


def typeset(text: str) -> str:
    return escape(unbroken(re.sub(r"(?<![\w.])-(?=\d)", "−", text.replace("^2", "²").replace("+-", "±"))))


def unbroken(text: str) -> str:
    """No line ends between a number and its unit, or within an interval."""
    return _WITHIN_A_NUMBER.sub("\N{NO-BREAK SPACE}", text)


def sentence(text: str) -> str:
    return typeset(capitalised(text) + ("" if text.endswith((".", "!", "?")) else "."))


def duration(seconds: float) -> str:
    """The duration in the usual words: 45.0 s, 12 min 5 s, 3 h 2 min."""
    if seconds < 60.0:
        return unbroken(f"{seconds:.1f} s")
    minutes, rest = divmod(round(seconds), 60)
    return unbroken(f"{minutes} min {rest} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min")


def joined(lines: list[str]) -> str:
    return "\n".join(lines)
