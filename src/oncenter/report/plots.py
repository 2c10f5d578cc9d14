"""The pictures of the page, as bokeh figures, in one colour language: grey is what the sensors said, blue what was
estimated and its interval, green what was used, orange what was rejected or changed. In the cloud, green triangles and
violet ones upside down are the two flanks of the play."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from bokeh.models import BoxAnnotation, FactorRange, HoverTool, Range1d, Span
from bokeh.plotting import figure

from oncenter import _core
from oncenter.report.canvas import COLOURS, as_source, caption, every, plain, range_of
from oncenter.report.course import Course, Mask
from oncenter.report.thin import Floats, Indices, broken_at_holes, extremes, sample
from oncenter.signals import DEGREE

if TYPE_CHECKING:
    from oncenter.offset.answer import Answer

# A row of the strip: what it is called there, which has no room for more.
STRIP_NAMES = {
    "window": "window",
    "bank": "bank",
    "curvature": "curvature",
    "lateral_acceleration": "side acc.",
    "longitudinal_acceleration": "dv/dt",
    "yaw_rate_bias": "gyro bias",
    "speed": "speed",
    "settling": "settling",
    "gap": "gap",
    "missing_signal": "missing",
    "time": "time",
    "signal_fault": "signal",
    "intervention": "ESC, ABS",
    "reverse": "reverse",
    "steering_assist": "assist",
}

_BINS = 1200  # a screen's columns
_CLOUD = 4000  # points
_FAST_ENOUGH = 0.1  # of the ticks
_ON_A_FLANK = 0.5  # of the way from the play's middle
_BIAS_MOVES_DEG_S = 0.05  # less is no picture
_LIMIT_NEAR = 1.0  # of the range of the course: a limit farther from it would squash the course
_SCATTER_HEIGHT = 380


def figures(answer: Answer, course: Course) -> dict[str, figure]:
    """The figures by name; one that would show nothing is left out. Those over time share their x-axis."""
    if not len(course.time):
        return {}
    end = max(float(course.time[-1]), 1e-3)
    time = Range1d(0.0, end, bounds=(0.0, end))
    pictures = {
        "angle": _angle(answer, course, time),
        "speed": _signal(course, time, course.speed, "speed (m/s)", 170),
        "yaw_rate": _signal(course, time, course.yaw_rate, "yaw rate (deg/s)", 190),
        "lateral_acceleration": _lateral_acceleration(course, time),
        "gate": _gate(course, time),
        "offset": _offset(answer, course, time),
        "yaw_rate_bias": _yaw_rate_bias(course, time),
        "cloud": _flanks(answer, course) if answer.method == "joint" else _cloud(answer, course),
        **_understeer(answer, course, time),
    }
    return {name: picture for name, picture in pictures.items() if picture is not None}


def _angle(answer: Answer, course: Course, time: Range1d) -> figure | None:
    if course.measured is None:
        return None
    picture = _over_time(course, time, "angle (deg)", 260)
    # on-centre driving, not the yard: the yard's angles are outside at first, where there is enough of the former
    fast = np.isfinite(course.expected)
    rows = fast if fast.mean() > _FAST_ENOUGH else np.ones_like(fast)
    picture.y_range = range_of(np.concatenate([course.measured[rows], course.expected[rows]]))
    _line(picture, course, course.measured, "measured")
    _line(picture, course, course.expected, "estimate")
    return picture


def _signal(course: Course, time: Range1d, values: Floats | None, label: str, height: int) -> figure | None:
    if values is None:
        return None
    picture = _over_time(course, time, label, height)
    _line(picture, course, values, "measured")
    return picture


def _lateral_acceleration(course: Course, time: Range1d) -> figure:
    picture = _over_time(course, time, "lateral acc. (m/s²)", 210)
    if course.lateral_acceleration is not None:
        _line(picture, course, course.lateral_acceleration, "measured")
    _line(picture, course, course.yaw_rate_times_speed, "estimate")
    return picture


def _gate(course: Course, time: Range1d) -> figure:
    """One row per reason, as opaque as the share of ticks it rejects, and one for what was used."""
    masks: dict[str, tuple[Mask, str]] = {"used": (course.used, "used")}
    for reason, name in STRIP_NAMES.items():
        if reason == "window":
            rejects = (course.reasons == 0) & ~course.used
        else:
            rejects = (course.reasons & _core.REASONS[reason]) != 0
        if rejects.any():
            masks[name] = (rejects, "rejected")
    picture = _over_time(course, time, None, 58 + 20 * len(masks), FactorRange(*reversed(masks), range_padding=0.08))
    picture.ygrid.grid_line_color = None
    picture.yaxis.major_tick_line_color = None
    bins = np.linspace(0.0, time.end, np.clip(len(course.time) // 2, 1, _BINS) + 1)  # none without a tick
    ticks = np.histogram(course.time, bins)[0]
    _runs(picture, bins, np.where(ticks > 0, 1.0, 0.0), list(masks), "measured", 0.15)
    for name, (mask, colour) in masks.items():
        share = np.histogram(course.time[mask], bins)[0] / np.maximum(ticks, 1)
        strip = _runs(picture, bins, share, [name], colour, 1.0)
        picture.add_tools(
            HoverTool(
                visible=False,
                renderers=[strip],
                tooltips=[(name, "@share{0 %} of the ticks"), ("time", f"$x{{0.00}} {course.time_unit}")],
            )
        )
    return picture


def _runs(picture: figure, bins: Floats, share: Floats, names: list[str], colour: str, alpha: float) -> Any:
    """Bars for runs of bins of like share, in quarters, so that a long drive needs no more of them than a short one."""
    quarters = np.ceil(share * 4.0)
    first = np.flatnonzero(np.diff(quarters, prepend=-1.0))
    last = np.append(first[1:], len(quarters))
    kept = quarters[first] > 0
    left, right, part = bins[first[kept]], bins[last[kept]], quarters[first[kept]] / 4.0
    return picture.hbar(
        y="name",
        left="left",
        right="right",
        fill_alpha="alpha",
        height=0.76,
        color=COLOURS[colour],
        line_color=None,
        source=as_source(
            left=np.tile(left, len(names)),
            right=np.tile(right, len(names)),
            share=np.tile(part, len(names)),
            alpha=np.tile(alpha * (0.25 + 0.75 * part), len(names)),
            name=[n for n in names for _ in left],
        ),
    )


def _offset(answer: Answer, course: Course, time: Range1d) -> figure | None:
    known = np.isfinite(course.offset)
    if not known.any():
        return None
    picture = _over_time(course, time, "offset (deg)", 300)
    low, high = course.offset_low, course.offset_high
    rows = every(len(course.time), 2 * _BINS)
    settled = _settled(course)
    limits = limits_near_course(answer, course)
    picture.y_range = range_of(np.array([low[settled].min(), high[settled].max(), *limits]))
    for limit in limits:
        words, below = f"limit {limit:+g} deg".replace("-", "−"), course.offset[settled][-1] > limit
        picture.add_layout(
            Span(location=limit, dimension="width", line_color=COLOURS["measured"], line_width=1.5, line_dash="dashed")
        )
        picture.add_layout(
            caption(words, x=time.end, x_offset=-4, y=limit, y_offset=-16 if below else 1, text_align="right")
        )
    of_drive = course.offset_half_width_drive
    lines = {"offset": course.offset, "low": low, "high": high}
    lines |= {"of_drive": of_drive, "inner_low": course.offset - of_drive, "inner_high": course.offset + of_drive}
    x, columns = broken_at_holes(course.time, rows, course.holes, lines)
    source = as_source(x=x, **columns)
    bands = (
        [("low", "high", 0.18), ("inner_low", "inner_high", 0.3)]
        if answer.not_identifiable
        else [("low", "high", 0.25)]
    )
    for bottom, top, alpha in bands:
        picture.varea("x", bottom, top, source=source, fill_color=COLOURS["estimate"], fill_alpha=alpha)
    line = picture.line("x", "offset", source=source, color=COLOURS["estimate"], line_width=2)
    picture.add_tools(
        HoverTool(
            visible=False,
            renderers=[line],
            mode="vline",
            tooltips=[
                ("offset", "@offset{0.00} deg"),
                *([("from this drive", "± @of_drive{0.00} deg")] if answer.not_identifiable else []),
                ("95 %", "@low{0.00} to @high{0.00} deg"),
                ("time", f"@x{{0.00}} {course.time_unit}"),
            ],
        )
    )
    for change in course.changes:
        picture.add_layout(
            Span(location=change, dimension="height", line_color=COLOURS["rejected"], line_width=2, line_dash="dashed")
        )
    return picture


def _settled(course: Course) -> Mask:
    """Ticks without the first seconds, whose interval is as wide as a barn, unless it is all there is."""
    known = np.isfinite(course.offset)
    width = course.offset_high - course.offset_low
    settled: Mask = known & (width < 4.0 * width[np.flatnonzero(known)[-1]] + 1.0)
    return settled


def limits_near_course(answer: Answer, course: Course) -> list[float]:
    """The limits of the offset, deg, that are in the picture of its course."""
    settled = _settled(course)
    low, high = course.offset_low[settled].min(), course.offset_high[settled].max()
    limit_deg = answer.vehicle.offset_limit_deg
    return [limit for limit in (-limit_deg, limit_deg) if max(low - limit, limit - high) <= _LIMIT_NEAR * (high - low)]


def _yaw_rate_bias(course: Course, time: Range1d) -> figure | None:
    """Only where it moves: else a number says it."""
    bias, half_width = course.yaw_rate_bias, course.yaw_rate_bias_half_width
    known = np.flatnonzero(np.isfinite(bias))
    if not len(known):
        return None
    settled = np.isfinite(bias) & (half_width < 2.0 * half_width[known[-1]] + 0.02)
    low, high = bias - half_width, bias + half_width
    # by how much one bias for all the time would be outside some of the intervals
    if not settled.any() or low[settled].max() - high[settled].min() < _BIAS_MOVES_DEG_S:
        return None
    picture = _over_time(course, time, "yaw rate bias (deg/s)", 220)
    picture.y_range = range_of(np.concatenate([low[settled], high[settled]]))
    rows = every(len(course.time), 2 * _BINS)
    x, columns = broken_at_holes(course.time, rows, course.holes, {"bias": bias, "low": low, "high": high})
    source = as_source(x=x, **columns)
    picture.varea("x", "low", "high", source=source, fill_color=COLOURS["estimate"], fill_alpha=0.25)
    picture.line("x", "bias", source=source, color=COLOURS["estimate"], line_width=2)
    return picture


def _cloud(answer: Answer, course: Course) -> figure | None:
    clean = np.flatnonzero(course.reasons == 0)
    if not len(clean):
        return None
    picture = _scatter(course.filtered_lateral_acceleration, course.residual, clean, "residual (deg)")
    offset, interval = answer.offset.value, answer.offset.ci95
    if answer.offset.status == "unobservable" or offset is None:
        return picture
    a_y = np.array([picture.x_range.start, picture.x_range.end])
    line = (offset + _slope(answer) * a_y) / DEGREE
    if interval is not None:
        low, high = ((bound - offset) / DEGREE for bound in interval)
        picture.varea(a_y, line + low, line + high, fill_color=COLOURS["estimate"], fill_alpha=0.25)
    picture.line(a_y, line, color=COLOURS["estimate"], line_width=2.5)
    return picture


def _slope(answer: Answer) -> float:
    """rad at the steering wheel per m/s^2."""
    return answer.understeer_at_steering_wheel.value or 0.0


def _flanks(answer: Answer, course: Course) -> figure | None:
    """The play as two lines through the clouds of its flanks, with the neutral lateral acceleration between them."""
    rows = np.flatnonzero((course.reasons == 0) & (course.time >= course.begin_of_offset))
    if not len(rows):
        return None
    a_y, residual = course.filtered_lateral_acceleration, course.residual
    picture = _empty_scatter(a_y, residual, rows, "residual (deg)")
    few = sample(rows, _CLOUD)
    place = course.place[few]
    for colour, there, marker in (
        ("measured", np.abs(place) <= _ON_A_FLANK, "circle"),
        ("used", place > _ON_A_FLANK, "triangle"),
        ("right", place < -_ON_A_FLANK, "inverted_triangle"),
    ):
        _points(picture, a_y, residual, few[there], colour, len(few), marker)
    offset = answer.offset.value
    if offset is None:
        return picture
    ends = np.array([picture.x_range.start, picture.x_range.end])
    middle = (offset + _slope(answer) * (ends - course.unloading_acceleration)) / DEGREE
    half_play = 0.5 * (answer.backlash.value or 0.0) / DEGREE
    for flank in (half_play, -half_play):
        picture.line(ends, middle + flank, color=COLOURS["estimate"], line_width=2.5)
    _unloading_point(answer, course, picture)
    return picture


def _unloading_point(answer: Answer, course: Course, picture: figure) -> None:
    """Offset and neutral acceleration with their 95 % intervals, as a cross with a dot; thick: the drive's part."""
    offset, a_0 = answer.offset, course.unloading_acceleration
    assert offset.value is not None and offset.ci95 is not None
    y = offset.value / DEGREE
    low, high = (bound / DEGREE for bound in offset.ci95)
    left, right = answer.unloading_acceleration.ci95 or (a_0, a_0)
    whiskers = {"line_color": COLOURS["rejected"], "line_width": 3}
    picture.segment([a_0, left], [low, y], [a_0, right], [high, y], **whiskers)
    half_width = (answer.offset_half_width_rad or 0.0) / DEGREE
    picture.segment([a_0], [y - half_width], [a_0], [y + half_width], line_color=COLOURS["rejected"], line_width=8)
    picture.scatter([a_0], [y], size=11, fill_color=COLOURS["rejected"], line_color="#ffffff", line_width=2)


def _understeer(answer: Answer, course: Course, time: Range1d) -> dict[str, figure]:
    """How the gradient was learned and from what: both pictures or none."""
    over_time, bends = _understeer_over_time(answer, course, time), _bends(answer, course)
    return {} if over_time is None or bends is None else {"understeer": over_time, "bends": bends}


def _understeer_over_time(answer: Answer, course: Course, time: Range1d) -> figure | None:
    rows = every(len(course.time), 2 * _BINS)
    is_assumed = "steering_ratio" in answer.vehicle.assumed
    gradient = course.understeer_gradient * (answer.vehicle.ratio_near_centre if is_assumed else 1.0)
    values = gradient[rows]
    if not np.isfinite(values).any():
        return None
    named = "understeer at the steering wheel" if is_assumed else "K_us/g"
    picture = _over_time(course, time, f"{named} (deg/(m/s²))", _SCATTER_HEIGHT)
    interval = (answer.understeer_at_steering_wheel if is_assumed else answer.understeer_gradient).ci95
    bounds = np.array(interval or ()) / DEGREE
    if interval is not None:
        picture.add_layout(
            BoxAnnotation(
                bottom=bounds[0], top=bounds[1], fill_color=COLOURS["estimate"], fill_alpha=0.25, line_color=None
            )
        )
    late = values[np.isfinite(values)]
    picture.y_range = range_of(np.concatenate([late[len(late) // 20 :], bounds]))
    x, columns = broken_at_holes(course.time, rows, course.holes, {"y": gradient})
    picture.line(x, columns["y"], color=COLOURS["estimate"], line_width=2)
    return picture


def _bends(answer: Answer, course: Course) -> figure | None:
    """(38): what is left of the angle in bends once offset and play are taken away, and the line through the point at
    which no lateral force acts."""
    at_wheel, offset = answer.understeer_at_steering_wheel, answer.offset.value
    rows = _bend_rows(answer, course)
    if not len(rows) or at_wheel.value is None or offset is None:
        return None
    played = 0.5 * (answer.backlash.value or 0.0) * course.place
    less = "offset and play" if played.any() else "offset"
    left = course.residual - (offset + played) / DEGREE
    picture = _scatter(course.filtered_lateral_acceleration, left, rows, f"residual less {less} (deg)")
    a_0 = course.unloading_acceleration
    ends = np.array([picture.x_range.start, a_0, picture.x_range.end])
    if at_wheel.ci95 is not None:
        low, high = (bound / DEGREE * (ends - a_0) for bound in at_wheel.ci95)
        picture.varea(ends, low, high, fill_color=COLOURS["estimate"], fill_alpha=0.25)
    picture.line(ends, at_wheel.value / DEGREE * (ends - a_0), color=COLOURS["estimate"], line_width=2.5)
    return picture


def _bend_rows(answer: Answer, course: Course) -> Indices:
    """The data of the gradient."""
    if answer.method == "joint":
        return np.flatnonzero(course.used & (course.time >= course.begin_of_offset))
    a_y = np.abs(course.filtered_lateral_acceleration)
    bend = (a_y > answer.params["understeer_acceleration_min_m_s2"]) & (
        a_y < answer.params["understeer_acceleration_max_m_s2"]
    )
    return np.flatnonzero(bend & ((course.reasons & ~np.uint32(_core.REASONS["curvature"])) == 0))


def _over_time(course: Course, time: Range1d, label: str | None, height: int, y_range: Any = None) -> figure:
    others = {} if y_range is None else {"y_range": y_range}
    picture = plain(height, "xpan,xbox_zoom,xwheel_zoom,reset,save", x_range=time, **others)
    picture.xaxis.axis_label = f"driving time ({course.time_unit})"
    picture.xaxis.axis_label_standoff = 2
    picture.yaxis.axis_label = label
    for start in course.starts[1:]:
        picture.add_layout(Span(location=start, dimension="height", line_color=COLOURS["line"], line_dash="dotted"))
    return picture


def _scatter(x: Floats, y: Floats, rows: Indices, label: str) -> figure:
    """A cloud of one colour."""
    picture = _empty_scatter(x, y, rows, label)
    few = sample(rows, _CLOUD)
    _points(picture, x, y, few, "used", len(few))
    return picture


def _empty_scatter(x: Floats, y: Floats, rows: Indices, label: str) -> figure:
    """Lateral acceleration to the right, an angle upward; the outermost of the points will be outside at first."""
    picture = plain(
        _SCATTER_HEIGHT,
        "pan,box_zoom,wheel_zoom,reset,save",
        x_range=range_of(x[rows], 0.2),
        y_range=range_of(y[rows], 0.2),
    )
    picture.xaxis.axis_label = "lateral acceleration, left positive (m/s²)"
    picture.yaxis.axis_label = label
    return picture


def _points(
    picture: figure, x: Floats, y: Floats, rows: Indices, colour: str, count: int, marker: Any = "circle"
) -> None:
    """A cloud of dots, the paler the more there are."""
    picture.scatter(
        "x",
        "y",
        source=as_source(x=x[rows], y=y[rows]),
        marker=marker,
        size=4 if marker == "circle" else 5,
        fill_color=COLOURS[colour],
        line_color=None,
        fill_alpha=float(np.clip(1800.0 / max(count, 1), 0.45, 0.8)),
    )


def _line(picture: figure, course: Course, values: Floats, colour: str) -> None:
    rows = extremes(values, _BINS)
    x, columns = broken_at_holes(course.time, rows, course.holes, {"y": values})
    picture.line("x", "y", source=as_source(x=x, **columns), color=COLOURS[colour], line_width=1.3)
