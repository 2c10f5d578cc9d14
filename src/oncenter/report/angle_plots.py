"""The pictures of the angle's page: grey is what the sensor said, blue the estimate with its 95 % interval, orange when
the sensor was at fault or taken away."""

from __future__ import annotations

from typing import Any

import numpy as np
from bokeh.models import BoxAnnotation, Range1d, Span
from bokeh.plotting import figure

from oncenter.report.angle_course import MOVING_M_S, AngleCourse
from oncenter.report.canvas import COLOURS, as_source, caption, plain, range_of
from oncenter.report.thin import Floats, Indices, broken_at_holes, extremes, sample

_BINS = 1200  # a screen's columns
_CLOUD = 4000  # points
_CLASSES = 12  # of speed, of lateral acceleration
_CLASS_MIN = 300  # ticks
_BEFORE_S, _AFTER_S = 20.0, 60.0  # about the moment the sensor goes
_FAULT_MIN_SHARE = 0.002  # of the drive: less is no band that one sees


def angle_figures(course: AngleCourse) -> dict[str, figure]:
    """The figures by name; one that would show nothing is left out."""
    if len(course.time) < 2:
        return {}
    pictures = {
        "angle": _angle(course, 0.0, float(course.time[-1]), 320),
        "takeover": _takeover(course),
        "error": _error(course),
        "by_speed": _by(course, course.speed, "speed (m/s)"),
        "by_acceleration": _by(course, course.lateral_acceleration, "lateral acceleration r·v, left positive (m/s²)"),
    }
    return {name: picture for name, picture in pictures.items() if picture is not None}


def _angle(course: AngleCourse, begin: float, end: float, height: int) -> figure:
    rows = np.flatnonzero((course.time >= begin) & (course.time <= end))
    picture = _over_time(begin, end, "true steering wheel angle (deg)", height)
    shown = [course.angle[rows]] if course.reference is None else [course.angle[rows], course.reference[rows]]
    picture.y_range = range_of(np.concatenate(shown))
    _mark_faults(picture, course, begin, end)
    kept, x, columns = _columns(course, rows, course.angle)
    low, high = course.angle - course.half_width, course.angle + course.half_width
    _band(picture, course, kept, low, high)
    if course.reference is not None:
        _line(picture, course, rows, course.reference, "measured", 2.2)
    picture.line(x, columns["y"], color=COLOURS["estimate"], line_width=1.3)
    return picture


def _takeover(course: AngleCourse) -> figure | None:
    """The moment at which the estimate takes over, as close as one can see it."""
    after = np.flatnonzero(course.without_sensor[1:] & ~course.without_sensor[:-1])
    if not len(after):
        return None
    moment = course.faults[0].since_s if course.faults else float(course.time[after[0]])
    begin, end = max(0.0, moment - _BEFORE_S), min(float(course.time[-1]), moment + _AFTER_S)
    return _angle(course, begin, end, 300) if end > begin else None


def _error(course: AngleCourse) -> figure | None:
    if course.error is None or not np.isfinite(course.error).any():
        return None
    end = float(course.time[-1])
    picture = _over_time(0.0, end, "error (deg)", 240)
    moving = np.where(course.speed > MOVING_M_S, course.error, np.nan)
    rows = np.arange(len(course.time))
    picture.y_range = _symmetric(moving)
    _mark_faults(picture, course, 0.0, end)
    width = np.where(course.without_sensor, course.half_width, np.nan)
    _band(picture, course, _columns(course, rows, width)[0], -width, width)
    _line(picture, course, rows, moving, "measured", 1.2)
    return picture


def _by(course: AngleCourse, against: Floats, label: str) -> figure | None:
    """The error as a cloud, and in classes of equal width its mean and the middle 95 %."""
    if course.error is None:
        return None
    rows = np.flatnonzero(np.isfinite(course.error) & np.isfinite(against) & (course.speed > MOVING_M_S))
    lost = rows[course.without_sensor[rows]]
    rows = lost if len(lost) > _CLASS_MIN else rows
    if len(rows) < _CLASSES * _CLASS_MIN:
        return None
    error = course.error
    picture = plain(
        320, "pan,box_zoom,wheel_zoom,reset,save", x_range=range_of(against[rows], 0.2), y_range=_symmetric(error[rows])
    )
    picture.xaxis.axis_label = label
    picture.yaxis.axis_label = "error (deg)"
    few = sample(rows, _CLOUD)
    picture.scatter(against[few], error[few], size=3, fill_color=COLOURS["measured"], line_color=None, fill_alpha=0.25)
    least, most = np.quantile(against[rows], [0.005, 0.995])
    edges = np.linspace(least, most, _CLASSES + 1)
    of_class = np.clip(np.searchsorted(edges, against[rows], side="right") - 1, 0, _CLASSES - 1)
    members = [rows[of_class == k] for k in range(_CLASSES)]
    members = [some for some in members if len(some) >= _CLASS_MIN]
    x = np.array([against[some].mean() for some in members])
    low, high = np.array([np.quantile(error[some], [0.025, 0.975]) for some in members]).T
    picture.segment(x, low, x, high, color=COLOURS["estimate"], line_width=2.5)
    mean = np.array([error[some].mean() for some in members])
    picture.line(x, mean, color=COLOURS["estimate"], line_width=1.3)
    picture.scatter(x, mean, size=8, fill_color=COLOURS["estimate"], line_color="#ffffff", line_width=1.5)
    return picture


def _over_time(begin: float, end: float, label: str, height: int) -> figure:
    picture = plain(
        height, "xpan,xbox_zoom,xwheel_zoom,reset,save", x_range=Range1d(begin, end, bounds=(begin, max(end, 1e-3)))
    )
    picture.xaxis.axis_label = "time since the log's begin (s)"
    picture.yaxis.axis_label = label
    return picture


def _mark_faults(picture: figure, course: AngleCourse, begin: float, end: float) -> None:
    """A band as long as the sensor is at fault, by name, and a line where it began."""
    for fault in course.faults:
        if fault.until_s < begin or fault.since_s > end:
            continue
        picture.add_layout(
            BoxAnnotation(
                left=fault.found_s,
                right=fault.until_s,
                fill_color=COLOURS["rejected"],
                fill_alpha=0.10,
                line_color=None,
            )
        )
        picture.add_layout(
            Span(location=fault.since_s, dimension="height", line_color=COLOURS["rejected"], line_dash="dashed")
        )
        if fault.until_s - fault.found_s > _FAULT_MIN_SHARE * (end - begin):
            picture.add_layout(
                caption(fault.name.replace("_", " "), x=max(fault.since_s, begin), x_offset=5, y=4, y_units="screen")
            )


def _band(picture: figure, course: AngleCourse, rows: Indices, low: Floats, high: Floats) -> None:
    x, columns = broken_at_holes(course.time, rows, course.holes, {"low": low, "high": high})
    picture.varea("x", "low", "high", source=as_source(x=x, **columns), fill_color=COLOURS["estimate"], fill_alpha=0.25)


def _line(picture: figure, course: AngleCourse, rows: Indices, values: Floats, colour: str, width: float) -> None:
    _, x, columns = _columns(course, rows, values)
    picture.line("x", "y", source=as_source(x=x, **columns), color=COLOURS[colour], line_width=width)


def _columns(course: AngleCourse, rows: Indices, values: Floats) -> tuple[Indices, Floats, dict[str, Any]]:
    """The rows that keep the outline, with their time and values broken at holes."""
    kept = rows[extremes(values[rows], _BINS)]
    return kept, *broken_at_holes(course.time, kept, course.holes, {"y": values})


def _symmetric(values: Floats) -> Range1d:
    """About zero, without the outermost values."""
    finite = np.abs(values[np.isfinite(values)])
    most = float(np.quantile(finite, 0.995)) if len(finite) else 1.0
    return Range1d(-1.3 * most - 0.1, 1.3 * most + 0.1)
