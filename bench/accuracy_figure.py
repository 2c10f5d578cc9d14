"""Draws docs/accuracy.png from the records of bench/accuracy.py: large letters and few marks, legible at 400 px."""

from __future__ import annotations

import math
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
from accuracy_study import LIMITS, STUDIED, TABLE_4, Point, shown

from oncenter.estimates.estimates import METHODS
from oncenter.report.browser import require_browser

if TYPE_CHECKING:
    from accuracy import Summary

WIDTH_PX, ROWS_HEIGHT_PX, TIME_HEIGHT_PX, GATE_HEIGHT_PX = 800, 1160, 560, 330
LETTERS, SMALL_LETTERS = "21px", "17px"
COLOURS = {
    "thesis": "#3584e4",
    "joint": "#26a269",
    "wheel-speed": "#9141ac",
    "bins": "#1a5fb4",
    "rls": "#62a0ea",
    "autoware": "#e66100",
    "openpilot": "#c01c28",
    "median": "#9a9996",
    "mode": "#986a44",
}
BEST_RIVAL = "best rival"
ANSWERED_MIN = 0.5  # minimum share of a row's drives with a value for a rival to be the best of the row
DASHED = ("bins", "rls")  # in the blues of the thesis, which proposes them


def draw(table: pl.DataFrame, summaries: Sequence[Summary], points: Sequence[Point], file: Path, folder: Path) -> None:
    """Errors by row, errors over time, and the gate study, one below the other; `folder` is for the browser's files."""
    from bokeh.embed import file_html
    from bokeh.layouts import column, row
    from bokeh.resources import INLINE

    gates = [_gate_plot(limit, points) for limit in LIMITS]
    picture = column(_rows_plot(summaries), _time_plot(table), row(*gates[:2]), row(*gates[2:]))
    page = folder / "accuracy.html"
    page.write_text(file_html(picture, INLINE, title="accuracy"), encoding="utf-8")
    size = f"{WIDTH_PX + 16},{ROWS_HEIGHT_PX + TIME_HEIGHT_PX + 2 * GATE_HEIGHT_PX + 16}"
    subprocess.run(
        [
            str(require_browser("accuracy.png", "docs/accuracy.md")),
            *"--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking".split(),
            *"--hide-scrollbars --virtual-time-budget=8000".split(),
            f"--window-size={size}",
            f"--user-data-dir={folder}/profile",
            f"--screenshot={file}",
            page.as_uri(),
        ],
        check=True,
        stderr=subprocess.DEVNULL,
    )


def _figure(height: int, letters: str, **settings: Any) -> Any:
    from bokeh.plotting import figure

    plot = figure(height=height, toolbar_location=None, **settings)
    for axis in plot.axis:
        axis.major_label_text_font_size = letters
        axis.axis_label_text_font_size = letters
        axis.axis_label_text_font_style = "normal"
        axis.minor_tick_line_color = None
    if plot.title:
        plot.title.text_font_size = letters
    return plot


def _legend(plot: Any, letters: str, **settings: Any) -> None:
    plot.legend.label_text_font_size = letters
    plot.legend.background_fill_alpha = 0.8
    plot.legend.padding, plot.legend.spacing = 4, 0
    for name, value in settings.items():
        setattr(plot.legend, name, value)


def _rows_plot(summaries: Sequence[Summary]) -> Any:
    """The joint method, the thesis and the best rival of each row: a dot at the median, a line to the 95th
    percentile."""
    rows = list(dict.fromkeys(s.row for s in summaries))
    plot = _figure(
        ROWS_HEIGHT_PX,
        LETTERS,
        width=WIDTH_PX,
        x_axis_type="log",
        x_range=(0.015, 30.0),
        y_range=(len(rows) - 0.4, -0.6),
        x_axis_label="error after 20 min (deg): median, line to 95 %",
    )
    plot.xaxis.ticker = [0.03, 0.1, 0.3, 1.0, 3.0, 10.0]
    plot.yaxis.ticker = list(range(len(rows)))
    plot.yaxis.major_label_overrides = dict(enumerate(rows))
    plot.ygrid.grid_line_color = None
    for k in range(0, len(rows), 2):
        plot.hbar(y=k, left=0.015, right=30.0, height=1.0, color="#f0efee", level="underlay")
    shown_methods = {
        "joint": [s for s in summaries if s.method == "joint"],
        "thesis": [s for s in summaries if s.method == "thesis"],
        BEST_RIVAL: [best for row in rows if (best := best_rival(summaries, row))],
    }
    for (name, chosen), shift in zip(shown_methods.items(), (-0.25, 0.0, 0.25), strict=True):
        colour = COLOURS.get(name, "#e66100")
        said = [s for s in chosen if math.isfinite(s.median)]
        height = [rows.index(s.row) + shift for s in said]
        middle, far = [max(s.median, 0.016) for s in said], [s.p95 for s in said]
        plot.segment(middle, height, far, height, color=colour, line_width=4, alpha=0.6)
        plot.scatter(middle, height, size=11, color=colour, legend_label=name)
    _legend(plot, LETTERS, orientation="horizontal")
    plot.add_layout(plot.legend[0], "above")
    return plot


def best_rival(summaries: Sequence[Summary], row: str) -> Summary | None:
    """The rival with the smallest median error among those with a value on enough drives of the row."""
    theirs = [s for s in summaries if s.row == row and s.method not in METHODS and s.answered >= ANSWERED_MIN]
    return min(theirs, key=lambda s: s.median, default=None)


def _time_plot(table: pl.DataFrame) -> Any:
    """The median absolute error of the row `ordinary`, minute by minute."""
    plot = _figure(
        TIME_HEIGHT_PX,
        LETTERS,
        width=WIDTH_PX,
        y_axis_type="log",
        x_axis_label="driven (min), ordinary drives",
        y_axis_label="median error (deg)",
    )
    plot.yaxis.ticker = [0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0]
    ordinary = table.filter(pl.col("row") == "ordinary")
    for (method,), part in ordinary.group_by("method", maintain_order=True):
        errors = np.abs(np.array(part["error_deg"].to_list(), float))
        said = np.isfinite(errors).mean(axis=0) > 0.5
        plot.line(
            np.arange(1, errors.shape[1] + 1)[said],
            np.nanmedian(errors[:, said], axis=0),
            color=COLOURS[str(method)],
            line_width=6 if method == "joint" else 3,
            line_dash="dashed" if method in DASHED else "solid",
            legend_label=str(method),
        )
    for bound in (1.0, 0.5):
        plot.line([1, 20], [bound, bound], color="#5e5c64", line_dash="dotted", line_width=2)
    _legend(plot, LETTERS, ncols=5, spacing=12)
    plot.add_layout(plot.legend[0], "above")
    return plot


def _gate_plot(limit: str, points: Sequence[Point]) -> Any:
    """Error over evidence while one limit varies: one point per value, Table 4's larger, both ends labelled."""
    from bokeh.models import BasicTickFormatter

    symbol, unit, values = LIMITS[limit]
    plot = _figure(
        GATE_HEIGHT_PX,
        SMALL_LETTERS,
        width=WIDTH_PX // 2,
        title=f"thesis, {symbol} ({unit})",
        x_range=(-60.0, 1000.0),
        y_range=(0.003, 20.0),
        y_axis_type="log",
        x_axis_label="evidence (s)",
        y_axis_label="error (deg)",
    )
    plot.yaxis.ticker, plot.xaxis.ticker = [0.01, 0.1, 1.0, 10.0], [0, 300, 600, 900]
    plot.yaxis.formatter = BasicTickFormatter()
    for colour, name in zip((COLOURS["joint"], COLOURS["thesis"]), STUDIED, strict=True):
        here = [p for p in points if p.limit == limit and p.row == name and math.isfinite(p.error_deg)]
        x, y = [p.used_s for p in here], [p.error_deg for p in here]
        plot.line(x, y, color=colour, alpha=0.5, line_width=2)
        plot.scatter(x, y, size=[15 if p.value == TABLE_4[limit] else 8 for p in here], color=colour, legend_label=name)
        ends = [p for p in here if p.value in (values[0], values[-1])]
        plot.text(
            [p.used_s for p in ends],
            [p.error_deg for p in ends],
            text=[f"{shown(limit, p.value):.4g}" for p in ends],
            text_font_size=SMALL_LETTERS,
            text_align="center",
            y_offset=-8,
            text_color=colour,
        )
    _legend(plot, SMALL_LETTERS, location="center_left", border_line_color=None)
    plot.legend.background_fill_alpha = 0.0
    return plot
