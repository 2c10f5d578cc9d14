"""An empty picture in the pages' look, and what is drawn on it: colours, ranges, columns."""

from __future__ import annotations

from typing import Any

import numpy as np
from bokeh.models import Label, NoOverlap, Range1d
from bokeh.plotting import figure

from oncenter.report.thin import Floats, Indices

# At least 3 to 1 against a white and a black ground (WCAG 1.4.11), and as far apart as contrast allows, with and
# without each of the eye's three cones: tests/test_colours.py.
COLOURS = {
    "measured": "#949498",
    "estimate": "#638fff",
    "used": "#407445",
    "rejected": "#bf8b1c",
    "right": "#8555a0",
    "line": "#8a8f98",
}

_FONT = "system-ui, sans-serif"
_TOOLBAR_PX = 20  # above the data, which it must not cover; page.css takes them away in print


def plain(height: int, tools: str, **ranges: Any) -> figure:
    """An empty figure that lets the page's ground through; page.js matches text and grid to light and dark."""
    picture = figure(
        height=height + (_TOOLBAR_PX if tools else 0),
        sizing_mode="stretch_width",
        tools=tools,
        active_scroll=None,
        toolbar_location="above",
        min_border_left=78,
        min_border_right=12,
        min_border_top=10,
        background_fill_alpha=0.0,
        border_fill_alpha=0.0,
        outline_line_color=None,
        **ranges,
    )
    picture.toolbar.logo = None
    picture.toolbar.autohide = True
    picture.axis.axis_label_text_font = _FONT
    picture.axis.axis_label_text_font_style = "normal"
    picture.axis.axis_label_text_font_size = "12px"
    picture.axis.major_label_text_font = _FONT
    picture.axis.major_label_text_font_size = "12px"
    picture.axis.minor_tick_line_color = None
    picture.xaxis.major_label_policy = NoOverlap(min_distance=8)
    picture.axis.axis_label_text_color = COLOURS["line"]
    picture.axis.major_label_text_color = COLOURS["line"]
    picture.axis.axis_line_color = COLOURS["line"]
    picture.axis.major_tick_line_color = COLOURS["line"]
    picture.grid.grid_line_color = COLOURS["line"]
    picture.grid.grid_line_alpha = 0.25
    return picture


def caption(text: str, **place: Any) -> Label:
    """Words in a picture; page.js gives them the colour of text."""
    return Label(text=text, text_color=COLOURS["line"], text_font_size="12px", text_font=_FONT, **place)


def as_source(**columns: Any) -> dict[str, Any]:
    """Columns for a glyph, numbers in single precision: half the file, and finer than any screen."""
    return {
        name: column.astype(np.float32) if isinstance(column, np.ndarray) else column
        for name, column in columns.items()
    }


def every(n: int, count: int) -> Indices:
    """Some `count` of n rows, evenly spread, the last among them."""
    return np.unique(np.append(np.arange(0, n, max(1, n // count)), n - 1))


def range_of(values: Floats, outside_percent: float = 0.0) -> Range1d:
    """A range for the finite values with a margin, without the outermost on both sides if a percentage is given."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return Range1d(-1.0, 1.0)
    low, high = np.percentile(finite, [outside_percent, 100.0 - outside_percent])
    air = max(0.08 * (high - low), 0.02 * max(abs(low), abs(high)), 1e-3)
    return Range1d(float(low - air), float(high + air))
