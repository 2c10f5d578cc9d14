"""The fleet page's pictures, in the colours of the verdicts and of a drive's report: blue for estimates, orange for
changes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.models import (
    BoxAnnotation,
    ColumnDataSource,
    CustomJS,
    DatetimeTickFormatter,
    HoverTool,
    NumeralTickFormatter,
    Range1d,
    Span,
    TapTool,
)
from bokeh.plotting import figure

from oncenter.fleet.tables import OFFSET
from oncenter.report.canvas import COLOURS, plain
from oncenter.vehicle_keys import OFFSET_LIMIT_DEG
from oncenter.verdict.states import OF_OFFSET, STATES, colour_of

CAUSES = {  # colour, its form in the key, its marker
    "sensor_or_alignment": ("rejected", "dot", "circle"),
    "wheel_alignment": ("right", "down", "inverted_triangle"),
    "gyro": ("estimate", "square", "square"),
    "play": ("used", "up", "triangle"),
}
_HATCHES = {  # for print without colours; fleet.css has them in the key
    "recalibrate": "right_diagonal_line",
    "over": "left_diagonal_line",
    "repair": "diagonal_cross",
    "signal_or_sensor": "dot",
    "undecided": "horizontal_line",
    "no_correction": "vertical_line",
}
_TOOLS = "pan,box_zoom,wheel_zoom,reset,save"
_RANKED = 40  # trucks that fit into a picture
_BINS = 41
_DAYS_MIN_MS = 7 * 86_400_000.0  # around a single drive or change


def distribution(ranked: Sequence[dict[str, Any]]) -> figure | None:
    """The number of trucks by offset and state."""
    estimated = _with_offset(ranked)
    if not estimated:
        return None
    farthest = max(max(1.25 * row["limit_deg"], 1.05 * abs(row[OFFSET.value])) for row in estimated)
    edges = np.linspace(-farthest, farthest, _BINS + 1)
    picture = plain(280, _TOOLS, x_range=Range1d(-farthest, farthest))
    below = np.zeros(_BINS)
    for state in reversed(list(OF_OFFSET)):
        count = np.histogram([row[OFFSET.value] for row in estimated if row["state"] == state], edges)[0]
        source = {
            "left": edges[:-1],
            "right": edges[1:],
            "bottom": below,
            "top": below + count,
            "count": count,
        }
        hatch: Any = {"hatch_pattern": _HATCHES.get(state, "blank"), "hatch_color": "#ffffff", "hatch_alpha": 0.6}
        bars = picture.quad(
            "left", "right", "top", "bottom", source=source, color=colour_of(state), line_color=None, **hatch
        )
        tips = [(STATES[state].word, "@count trucks"), ("offset", "@left{0.0} to @right{0.0} deg")]
        picture.add_tools(HoverTool(visible=False, renderers=[bars], tooltips=tips))
        below = below + count
    _limits(picture, common_limit_deg(ranked), "height")
    picture.y_range.start = 0
    picture.xaxis.axis_label = "offset now, left positive (deg)"
    picture.yaxis.axis_label = "trucks"
    picture.yaxis.formatter = NumeralTickFormatter(format="0")
    picture.yaxis.ticker.min_interval = 1
    return picture


def ranking(ranked: Sequence[dict[str, Any]]) -> figure | None:
    """The offsets of the first trucks with the intervals that decide, the strongest on top; a tap opens one."""
    first = _with_offset(ranked)[:_RANKED]
    if not first:
        return None
    value = np.array([row[OFFSET.value] for row in first])
    low, high = (np.array([row[f"offset_{end}_deg"] for row in first]) for end in ("low", "high"))
    source = ColumnDataSource(
        {
            "truck": [row["truck"] for row in first],
            "place": np.array([row["rank"] for row in first], float),
            "value": value,
            "low": low,
            "high": high,
            "colour": [colour_of(row["state"]) for row in first],
            "state": [STATES[row["state"]].word for row in first],
        }
    )
    count = len(first)
    farthest = max(1.25 * max(row["limit_deg"] for row in first), 1.03 * float(max(high.max(), -low.min())))
    picture = plain(
        90 + 14 * count, "tap,reset,save", x_range=Range1d(-farthest, farthest), y_range=Range1d(count + 0.8, 0.2)
    )
    _limits(picture, common_limit_deg(ranked), "height")
    picture.hbar(y="place", left="low", right="high", height=0.22, color="colour", alpha=0.5, source=source)
    dots = picture.scatter("value", "place", size=8, color="colour", source=source)
    tips = [("truck", "@truck"), ("offset", "@value{0.00} deg, 95 % @low{0.0} to @high{0.0}"), ("", "@state")]
    picture.add_tools(HoverTool(visible=False, renderers=[dots], tooltips=tips))
    _opens_truck(picture, source)
    picture.xaxis.axis_label = "offset now with its 95 % interval (deg)"
    picture.yaxis.axis_label = "rank"  # short, since the picture of one truck is low
    picture.yaxis.formatter = NumeralTickFormatter(format="0")
    picture.yaxis.ticker.min_interval = 1
    picture.ygrid.grid_line_color = None
    return picture


def calendar(changes: Sequence[dict[str, Any]]) -> figure | None:
    """Changes of the offset by day and size, with their 95 % intervals; a tap opens the truck."""
    shown = [change for change in changes if change["quantity"] == "offset"]
    if not shown:
        return None
    size = np.array([change["size"] for change in shown])
    half = 1.96 * np.array([change["sd"] for change in shown])
    source = ColumnDataSource(
        {
            "truck": [change["truck"] for change in shown],
            "time": np.array([change["by_drive"] for change in shown]) * 1000.0,
            "size": size,
            "low": size - half,
            "high": size + half,
            "colour": [COLOURS[CAUSES[change["cause"]][0]] for change in shown],
            "marker": [CAUSES[change["cause"]][2] for change in shown],
            "cause": [change["cause"].replace("_", " ") for change in shown],
        }
    )
    picture = _over_days(320)
    _intervals(picture, source)
    dots = picture.scatter("time", "size", marker="marker", size=9, color="colour", source=source)
    tips = [
        ("truck", "@truck"),
        ("first drive after", "@time{%F %H:%M}"),
        ("size", "@size{+0.0} deg, 95 % @low{+0.0} to @high{+0.0}"),
        ("with", "@cause"),
    ]
    picture.add_tools(
        HoverTool(visible=False, renderers=[dots], tooltips=tips, formatters={"@time": "datetime"}), TapTool()
    )
    _opens_truck(picture, source)
    picture.add_layout(Span(location=0.0, dimension="width", line_color=COLOURS["line"], line_width=1))
    picture.yaxis.axis_label = "change of the offset (deg)"
    return picture


def truck_history() -> figure:
    """An empty history: fleet.js fills its sources `drives`, `means` and `breaks`, and moves its limits."""
    drives = ColumnDataSource(
        {name: [] for name in ("time", "value", "low", "high", "log", "colour", "marker", "status")}, name="drives"
    )
    means = ColumnDataSource({name: [] for name in ("left", "right", "value")}, name="means")
    breaks = ColumnDataSource({"time": []}, name="breaks")
    picture = _over_days(340)
    _limits(picture, OFFSET_LIMIT_DEG, "width")
    _intervals(picture, drives)
    picture.vspan(x="time", source=breaks, line_color=COLOURS["rejected"], line_dash="dashed", line_width=1.5)
    picture.segment("left", "value", "right", "value", source=means, color=COLOURS["measured"], line_width=2.5)
    dots = picture.scatter("time", "value", marker="marker", size=8, color="colour", source=drives)
    tips = [
        ("drive", "@time{%F %H:%M}"),
        ("offset", "@value{0.00} deg, 95 % @low{0.0} to @high{0.0}"),
        ("status", "@status"),
        ("log", "@log"),
    ]
    picture.add_tools(HoverTool(visible=False, renderers=[dots], tooltips=tips, formatters={"@time": "datetime"}))
    picture.yaxis.axis_label = "offset, left positive (deg)"
    return picture


def _over_days(height: int) -> figure:
    picture = plain(height, _TOOLS, x_axis_type="datetime")
    picture.x_range.default_span = _DAYS_MIN_MS
    picture.xaxis.ticker.desired_num_ticks = 5  # that fit a telephone
    picture.xaxis.formatter = DatetimeTickFormatter(hours="%d %b %H:%M", days="%d %b", months="%b %Y", years="%Y")
    picture.xaxis.axis_label = "start of the drive (UTC)"
    return picture


def _intervals(picture: figure, source: ColumnDataSource) -> None:
    """Segments, not whiskers: an automatic range follows glyphs only."""
    picture.segment("time", "low", "time", "high", source=source, color=COLOURS["line"], line_width=1)


def common_limit_deg(trucks: Sequence[dict[str, Any]]) -> float | None:
    """The limit of all trucks; None where their vehicle files give several."""
    limits = {row["limit_deg"] for row in trucks}
    return limits.pop() if len(limits) == 1 else None


def _with_offset(ranked: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    return [row for row in ranked if row.get("p_value") is not None]


def _limits(picture: figure, limit_deg: float | None, dimension: str) -> None:
    """The band of offsets within the limit, dashed at its ends; fleet.js finds its parts by their names."""
    if limit_deg is None:
        return
    sides = (
        {"left": -limit_deg, "right": limit_deg} if dimension == "height" else {"bottom": -limit_deg, "top": limit_deg}
    )
    picture.add_layout(
        BoxAnnotation(**sides, fill_color=COLOURS["used"], fill_alpha=0.07, line_color=None, name=f"band {dimension}")
    )
    for side, name in ((-limit_deg, "lower"), (limit_deg, "upper")):
        end = Span(location=side, dimension=dimension, line_color=COLOURS["used"], line_dash="dashed", line_width=1)
        end.name = f"{name} {dimension}"
        picture.add_layout(end)


def _opens_truck(picture: figure, source: ColumnDataSource) -> None:
    open_it = CustomJS(
        args={"source": source},
        code="const at = source.selected.indices[0]; if (at === undefined) return;"
        " source.selected.indices = []; location.hash = encodeURIComponent(source.data.truck[at]);",
    )
    source.selected.js_on_change("indices", open_it)
