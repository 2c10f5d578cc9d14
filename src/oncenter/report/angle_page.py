"""The angle's page as text: how sure it is without the sensor, what became of the sensor, then the pictures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

import numpy as np

from oncenter import _core
from oncenter.report.angle_course import MOVING_M_S, AngleCourse, Fault
from oncenter.report.angle_plots import angle_figures
from oncenter.report.document import document, duration, embedded, joined, key, nothing, number, table
from oncenter.report.truck_part import of_truck
from oncenter.signals import Signals
from oncenter.vehicle import Vehicle

_SPEEDS = (
    ("above 8 m/s", 8.0, np.inf),
    ("3 to 8 m/s", 3.0, 8.0),
    ("1 to 3 m/s", MOVING_M_S, 3.0),
    ("standing", 0.0, MOVING_M_S),
)
_SAID = {
    "lost": "was lost at",
    "stuck": "was stuck from",
    "jumped": "jumped at",
    "drifting": "drifted from",
    "wrong_sign": "had the wrong sign from",
    "remounted": "sat elsewhere from",
}
_FAST_M_S = 8.0
_OPEN_DEG = 360.0  # wider says nothing


def angle_page(
    course: AngleCourse, signals: Signals, vehicle: Vehicle, method: str, smooth: bool, notes: Sequence[str] = ()
) -> str:
    """The whole HTML document."""
    pictures = angle_figures(course)
    script, divs = embedded(pictures)
    body = joined(
        [
            _header(course, signals, vehicle),
            _figures(course),
            _faults(course),
            _pictures(course, divs),
            _provenance(signals, vehicle, method, smooth, notes),
        ]
    )
    return document(f"Steering wheel angle without its sensor: {signals.log}", body, script)


def _judged(course: AngleCourse) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """The data of the figures: all without the sensor; if it never failed, the estimate from motion alone."""
    return course.without_sensor if course.without_sensor.any() else ~course.without_sensor


def _header(course: AngleCourse, signals: Signals, vehicle: Vehicle) -> str:
    fast = course.without_sensor & (course.speed > _FAST_M_S)
    if fast.any():
        half_width = f"± {np.median(course.half_width[fast]):.1f}"
        standing = f"half of the 95 % interval, median of {duration(_seconds(course, fast))} without sensor above 8 m/s"
    else:
        half_width, standing = "—", "no second without sensor above 8 m/s"
    size = "" if half_width != "—" else " none"
    return f"""<header>
<p class="log">{escape(vehicle.name)} · {escape(signals.log)}</p>
<h1>Steering wheel angle without its sensor</h1>
<p class="offset{size}">{half_width}{"<small>deg</small>" if not size else ""}</p>
<p class="standing">{standing}</p>
<p class="words">{_in_words(course)}</p>
<p class="quiet">The true angle is measured less offset, left positive. Error is estimated less
{"true" if course.by_truth else "measured, the sensor's offset as last learned taken away"}.</p>
</header>"""


def _in_words(course: AngleCourse) -> str:
    if course.without_sensor.all():
        return "The sensor was never valid in this drive: only the Ackermann angle is given."
    if course.faults:
        first = course.faults[0]
        return f"The sensor {_SAID[first.name]} {first.since_s:.1f} s, found at {first.found_s:.1f} s."
    if course.without_sensor.any():
        return "The sensor was missing for parts of the drive."
    return "The sensor was there all the time, and nothing was found wrong with it."


def _figures(course: AngleCourse) -> str:
    judged = _judged(course)
    lines = []
    for name, low, high in _SPEEDS:
        rows = judged & (course.speed >= low) & (course.speed < high)
        if rows.any():
            lines.append(_of_speed(course, name, rows))
    said = "without the sensor" if course.without_sensor.any() else "by motion alone, beside its sensor"
    return f"""<section>
<h2>How far off, {said}</h2>
<table class="quantities">
<thead><tr><th>Speed</th><th class="number">Time</th><th class="number">RMS error</th>
<th class="number">Mean error</th><th class="number">95 % half-width</th><th class="number">Within it</th></tr></thead>
<tbody>
{joined(lines)}
</tbody>
</table>
</section>"""


def _of_speed(course: AngleCourse, name: str, rows: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> str:
    error = np.full(0, np.nan) if course.error is None else course.error[rows]
    known = np.isfinite(error)
    cells = [f"{duration(_seconds(course, rows))}"]
    if known.any():
        cells += [f"{np.sqrt(np.mean(error[known] ** 2)):.2f} deg", f"{number(error[known].mean(), 2, True)} deg"]
    else:
        cells += ["—", "—"]
    # the sensor's interval is not the estimate's
    without_sensor = rows & course.without_sensor
    median = float(np.median(course.half_width[without_sensor])) if without_sensor.any() else np.nan
    width = "—" if not without_sensor.any() else f"{median:.1f} deg" if median < _OPEN_DEG else "open"
    within = np.abs(error[known]) < course.half_width[rows][known]
    cells += [width, f"{100.0 * within.mean():.0f} %" if known.any() and without_sensor.any() else "—"]
    labels = ("Time", "RMS error", "Mean error", "95 % half-width", "Within it")
    return (
        f'<tr><th scope="row">{name}</th>'
        + "".join(
            f'<td class="number" data-label="{label}">{cell}</td>' for label, cell in zip(labels, cells, strict=True)
        )
        + "</tr>"
    )


def _seconds(course: AngleCourse, rows: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> float:
    tick_s = float(np.median(np.diff(course.time))) if len(course.time) > 1 else 0.0
    return tick_s * float(np.sum(rows))


def _faults(course: AngleCourse) -> str:
    if not course.faults:
        return ""
    lines = [
        f'<li class="warning"><b>{escape(fault.name.replace("_", " "))}</b> since {fault.since_s:.1f} s, found at '
        f"{fault.found_s:.1f} s, until {fault.until_s:.1f} s{_how_sure(fault)}.</li>"
        for fault in course.faults
    ]
    return (
        f'<section>\n<h2>What was wrong with the sensor</h2>\n<ul class="findings">\n{joined(lines)}\n</ul>\n</section>'
    )


def _how_sure(fault: Fault) -> str:
    return "" if fault.name == "lost" else f"; at least {math.floor(100.0 * fault.confidence)} % sure"


def _pictures(course: AngleCourse, divs: dict[str, str]) -> str:
    reference = "true, as simulated" if course.by_truth else "measured, less the offset as last learned"
    lines = {"estimate": "estimated, with its 95 % interval"}
    if course.reference is not None:
        lines = {"measured": reference, **lines}
    if course.faults:
        lines["rejected"] = "sensor at fault or lost; dashed: since when"
    error = _error_pictures(divs) if course.error is not None else nothing("The log has no sensor to compare with.")
    return joined(
        [
            "<section>\n<h2>The angle over time</h2>",
            key(**lines) if "angle" in divs else "",
            divs.get("angle", nothing("The drive has no tick.")),
            "<h3>When the estimate takes over</h3>" if "takeover" in divs else "",
            divs.get("takeover", ""),
            "</section>\n<section>\n<h2>The error</h2>",
            error,
            "</section>",
        ]
    )


def _error_pictures(divs: dict[str, str]) -> str:
    if "error" not in divs:
        return nothing("No second with a valid sensor.")
    by = joined([f"<div>{divs[name]}</div>" for name in ("by_speed", "by_acceleration") if name in divs])
    return joined(
        [
            key(measured="estimated less reference, while moving", estimate="what the 95 % interval allows"),
            divs["error"],
            key(measured="ticks", estimate="mean and middle 95 % of a class") if by else "",
            f'<div class="pair">{by}</div>' if by else "",
        ]
    )


def _provenance(signals: Signals, vehicle: Vehicle, method: str, smooth: bool, notes: Sequence[str]) -> str:
    truck = {
        "Vehicle": escape(vehicle.name),
        **of_truck(vehicle),
        "Method": escape(method) + (", smoothed with the future" if smooth else ""),
        "Version": f"oncenter {escape(_core.version())}",
        "Log": f"{escape(signals.log)} <span class=quiet>{signals.ticks} ticks at {signals.rate_hz:g} Hz</span>",
    }
    sources = {escape(name.replace("_", " ")): escape(s.description) for name, s in signals.sources.items()}
    lines = "".join(f"<li>{escape(note)}</li>" for note in notes)
    return f"""<section class="provenance">
<h2>What produced it</h2>
{table(truck)}
<h3>Signals and where they came from</h3>
{table(sources)}
{f"<h3>Notes</h3><ul>{lines}</ul>" if notes else ""}
</section>"""
