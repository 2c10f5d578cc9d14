"""A figure as SVG and PNG files, and as an SVG inside a page, which sets its colours."""

from __future__ import annotations

import io
import re
from typing import Any

import matplotlib
from cycler import cycler
from matplotlib.figure import Figure as Canvas

from oncenter.thesis.figure import FIFTH, GRID, INK, MUTED, OTHER, OURS, PAPER, THESIS, TRUTH, Figure

_PNG_DPI = 200
_STYLE: dict[Any, Any] = {
    "axes.edgecolor": MUTED,
    "axes.facecolor": PAPER,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.labelcolor": INK,
    "axes.labelsize": 9,
    "axes.linewidth": 0.8,
    "axes.prop_cycle": cycler(color=[OURS, THESIS, TRUTH, OTHER, FIFTH, MUTED]),
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlecolor": INK,
    "axes.titlelocation": "left",
    "axes.titlesize": 9,
    "figure.facecolor": PAPER,
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial"],
    "font.size": 9,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "hatch.color": MUTED,
    "legend.edgecolor": GRID,
    "legend.facecolor": PAPER,
    "legend.fontsize": 8,
    "legend.framealpha": 0.85,
    "lines.linewidth": 1.4,
    "patch.edgecolor": INK,
    "path.simplify": True,
    "path.simplify_threshold": 0.3,
    "svg.fonttype": "path",  # the reader's machine may lack the font of the layout
    "text.color": INK,
    "text.parse_math": True,
    "xtick.color": MUTED,
    "xtick.labelcolor": INK,
    "xtick.labelsize": 8,
    "ytick.color": MUTED,
    "ytick.labelcolor": INK,
    "ytick.labelsize": 8,
}
# in a page, the page sets the colours that depend on light and dark
_OF_THE_PAGE = {INK: "var(--text)", MUTED: "var(--muted)", GRID: "var(--grid)", PAPER: "var(--card)"}


def drawn(figure: Figure) -> tuple[str, bytes]:
    """The figure as an SVG document and as a PNG of 200 dots an inch, the same bytes at each run."""
    with matplotlib.rc_context(_STYLE | {"svg.hashsalt": figure.number}):
        canvas = Canvas(figsize=figure.size_in, layout="constrained")
        figure.draw(canvas)
        text = io.StringIO()
        canvas.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
        picture = io.BytesIO()
        canvas.savefig(picture, format="png", dpi=_PNG_DPI, metadata={"Software": None})
    return text.getvalue(), picture.getvalue()


def inline(svg: str, number: str) -> str:
    """An SVG document as an element of a page, as wide as its place; ids do not meet those of other figures."""
    element = svg[svg.index("<svg") :]
    element = re.sub(r"<metadata>.*?</metadata>\s*", "", element, flags=re.DOTALL)
    element = re.sub(r' (width|height)="[\d.]+pt"', "", element, count=2)
    prefix = re.sub(r"\W", lambda other: f"{ord(other[0]):x}", number) + "-"
    element = re.sub(r'\bid="', f'id="f{prefix}', element)
    element = re.sub(r'(xlink:href="#|url\(#)', rf"\g<1>f{prefix}", element)
    for ours, page in _OF_THE_PAGE.items():
        element = element.replace(ours, page)
    return element.replace("<svg ", '<svg role="img" ', 1)
