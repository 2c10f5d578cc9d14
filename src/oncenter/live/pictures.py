"""The live page's figures: offset over time, the gate's last minutes, the two flanks; in the report's colours."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import numpy.typing as npt
from bokeh.models import ColumnDataSource, FactorRange, Range1d, Span
from bokeh.plotting import figure

from oncenter.app.texts import LIVE
from oncenter.live.history import STRIP_S
from oncenter.live.snapshot import Snapshot
from oncenter.report.canvas import COLOURS, plain
from oncenter.report.plots import STRIP_NAMES
from oncenter.signals import DEGREE

_ON_A_FLANK = 0.5  # of half the play, from its middle; as in the report
_ROW_PX, _AXES_PX = 20, 62
_USED = LIVE["strip_used"]
# what changes in a figure, in the order in which the page sets it: a bar needs its row
_CHANGING = {
    FactorRange: ("factors",),
    figure: ("height",),
    Range1d: ("start", "end"),
    Span: ("location", "visible"),
    ColumnDataSource: ("data",),
}


class Pictures:
    """Three figures, the same for all viewers.

    Attributes:
        figures: of Bokeh.
    """

    def __init__(self) -> None:
        self._parts: tuple[_Course | _Strip | _Flanks, ...] = (_Course(), _Strip(), _Flanks())
        self.figures: list[figure] = [part.figure for part in self._parts]
        for drawn in self.figures:
            drawn.toolbar_location = None  # no tools: a narrow toolbar shows a button for those that do not fit
        self._drawn = [(-1, "")] * len(self._parts)
        self._changing = [
            [(model, names) for kind, names in _CHANGING.items() for model in references if isinstance(model, kind)]
            for references in (drawn.references() for drawn in self.figures)
        ]

    def json(self, which: int, now: Snapshot) -> str:
        """The values of one figure that change, by the identifiers of its models; null where not available. Made once
        for all viewers."""
        if self._drawn[which][0] != now.pictures.number:
            self._parts[which].show(now)
            values = {
                model.id: {name: getattr(model, name) for name in names} for model, names in self._changing[which]
            }
            self._drawn[which] = now.pictures.number, json.dumps(values, allow_nan=False, default=_numbers)
        return self._drawn[which][1]


def _numbers(column: npt.NDArray[Any]) -> list[float | None]:
    """Finer than any screen, and short."""
    rounded = column.astype(float).round(4)
    return [value if finite else None for value, finite in zip(rounded.tolist(), np.isfinite(rounded), strict=True)]


class _Course:
    """Offset over the whole drive, with the drive's own part as a band of 95 % within that of both parts."""

    def __init__(self) -> None:
        self.figure = plain(240, "", name="course", x_range=Range1d(0.0, 1.0), y_range=Range1d(-5.0, 5.0))
        self.figure.xaxis.axis_label = LIVE["course_x"]
        self.figure.yaxis.axis_label = LIVE["course_y"]
        self._source = ColumnDataSource(
            data={name: [] for name in ("x", "offset", "low", "high", "inner_low", "inner_high")}
        )
        for low, high, alpha in (("low", "high", 0.18), ("inner_low", "inner_high", 0.3)):
            self.figure.varea("x", low, high, source=self._source, fill_color=COLOURS["estimate"], fill_alpha=alpha)
        self.figure.line("x", "offset", source=self._source, color=COLOURS["estimate"], line_width=2.5)

    def show(self, now: Snapshot) -> None:
        course = now.pictures.course
        minutes = np.array(course.time_s) / 60.0
        offset, low, high = np.array(course.offset_deg), np.array(course.low_deg), np.array(course.high_deg)
        of_drive = np.array(course.half_width_drive_deg)
        inner = {"inner_low": offset - of_drive, "inner_high": offset + of_drive}
        self._source.data = {"x": minutes, "offset": offset, "low": low, "high": high, **inner}
        _span(self.figure.x_range, 0.0, max(now.driven_s / 60.0, 1.0))
        if len(offset):
            later = slice(len(offset) // 4, None)  # the first intervals are wide
            below, above = (1.3 * float(np.median(reach[later])) + 0.3 for reach in (offset - low, high - offset))
            _span(self.figure.y_range, float(offset[later].min()) - below, float(offset[later].max()) + above)


class _Strip:
    """The gate's last two minutes: one row per reason, as opaque as the share of ticks rejected for it."""

    def __init__(self) -> None:
        self._rows = [_USED]
        self.figure = plain(
            _ROW_PX + _AXES_PX,
            "",
            name="strip",
            x_range=Range1d(-float(STRIP_S), 0.0),
            y_range=FactorRange(_USED, range_padding=0.08),
        )
        self.figure.xaxis.axis_label = LIVE["strip_x"]
        self.figure.ygrid.grid_line_color = None
        self.figure.yaxis.major_tick_line_color = None
        self._source = ColumnDataSource(data={"left": [], "right": [], "row": [], "share": [], "colour": []})
        self.figure.hbar(
            "row",
            left="left",
            right="right",
            height=0.8,
            source=self._source,
            fill_color="colour",
            fill_alpha="share",
            line_color=None,
        )

    def show(self, now: Snapshot) -> None:
        strip = now.pictures.strip
        if not strip.begin_s:
            return
        ago = np.array(strip.begin_s) - strip.begin_s[-1] - 1.0
        present = [name for name in STRIP_NAMES if name in strip.rejected]
        self._rows += [STRIP_NAMES[name] for name in present if STRIP_NAMES[name] not in self._rows]
        bars: list[tuple[float, float, str, float, str]] = []
        for row, share, colour in (
            (_USED, strip.clean, COLOURS["used"]),
            *((STRIP_NAMES[name], strip.rejected[name], COLOURS["rejected"]) for name in present),
        ):
            bars += [(low, high, row, alpha, colour) for low, high, alpha in _runs(ago, np.array(share))]
        factors = list(reversed(self._rows))
        if self.figure.y_range.factors != factors:
            self.figure.y_range.factors = factors
            self.figure.height = _ROW_PX * len(factors) + _AXES_PX
        names = ("left", "right", "row", "share", "colour")
        self._source.data = dict(zip(names, map(list, zip(*bars, strict=True)), strict=True))


def _runs(begin_s: npt.NDArray[Any], share: npt.NDArray[Any]) -> list[tuple[float, float, float]]:
    """Start, end and share of runs of cells with equal share; runs of zero are left out."""
    new = np.flatnonzero((np.diff(share) != 0) | (np.diff(begin_s) > 1.5)) + 1
    first, last = np.concatenate(([0], new)), np.concatenate((new, [len(share)])) - 1
    runs = zip(begin_s[first].tolist(), (begin_s[last] + 1.0).tolist(), share[first].tolist(), strict=True)
    return [run for run in runs if run[2] > 0]


class _Flanks:
    """Residual against lateral acceleration: free play gives two parallel lines."""

    def __init__(self) -> None:
        self.figure = plain(300, "", name="flanks", x_range=Range1d(-1.5, 1.5), y_range=Range1d(-5.0, 5.0))
        self.figure.xaxis.axis_label = LIVE["flanks_x"]
        self.figure.yaxis.axis_label = LIVE["flanks_y"]
        self._cloud = ColumnDataSource(data={"x": [], "y": [], "colour": [], "marker": []})
        self._lines = ColumnDataSource(data={"x": [], "upper": [], "lower": []})
        self.figure.scatter(
            "x", "y", source=self._cloud, marker="marker", size=5, fill_color="colour", fill_alpha=0.6, line_color=None
        )
        for flank in ("upper", "lower"):
            self.figure.line("x", flank, source=self._lines, color=COLOURS["estimate"], line_width=2.5)
        self._offset = Span(
            location=0.0, dimension="width", line_color=COLOURS["rejected"], line_width=2, line_dash="dashed"
        )
        self._offset.visible = False
        self.figure.add_layout(self._offset)

    def show(self, now: Snapshot) -> None:
        cloud = now.pictures.cloud
        x, y, place = np.array(cloud.lateral_acceleration_m_s2), np.array(cloud.residual_deg), np.array(cloud.place)
        flank = np.where(np.abs(place) > _ON_A_FLANK, np.sign(place), 0.0).astype(int)
        looks = {1: ("used", "triangle"), -1: ("right", "inverted_triangle"), 0: ("measured", "circle")}
        colours = [COLOURS[looks[each][0]] for each in flank.tolist()]
        self._cloud.data = {"x": x, "y": y, "colour": colours, "marker": [looks[each][1] for each in flank.tolist()]}
        if len(x):
            for axis, values in ((self.figure.x_range, x), (self.figure.y_range, y)):
                low, high = np.percentile(values, [0.5, 99.5])
                air = 0.1 * (high - low) + 0.2
                _span(axis, float(low - air), float(high + air))
        answer = now.known.answer
        if answer is None or answer.offset.value is None:
            return
        offset = answer.offset.value / DEGREE
        self._offset.update(location=offset, visible=True)
        ends = np.array([-20.0, 20.0])
        neutral = answer.unloading_acceleration.value or 0.0
        slope = (answer.understeer_at_steering_wheel.value or 0.0) / DEGREE
        middle = offset + slope * (ends - neutral)
        half_play = 0.5 * (answer.backlash.value or 0.0) / DEGREE
        self._lines.data = {"x": ends, "upper": middle + half_play, "lower": middle - half_play}


def _span(axis: Range1d, low: float, high: float) -> None:
    """Moves an axis only by a visible amount, so that it does not tremble."""
    if max(abs(low - axis.start), abs(high - axis.end)) > 0.04 * (axis.end - axis.start):
        axis.update(start=low, end=high)
