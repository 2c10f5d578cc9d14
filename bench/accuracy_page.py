"""docs/accuracy.md and docs/accuracy.png, from the records of bench/accuracy.py."""

from __future__ import annotations

import inspect
import math
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
from accuracy_rows import EVERY_ROW, POPULATED_BY, ROWS
from accuracy_study import LIMITS, STUDIED, TABLE_4, Point, shown, study
from population import ACCELEROMETER_BIAS_SD_M_S2, PRIORS, PULL_SD_M_S2, WIND_SD_M_S2, cannot_be_told_apart_m_s2

import oncenter as oc
from oncenter.estimate import METHODS

if TYPE_CHECKING:
    from accuracy import Summary

DOCS = Path(__file__).parents[1] / "docs"
STUDY_DRIVES = 20
JUDGED = str(inspect.signature(oc.offset).parameters["method"].default)  # the method that is asked to win
COLOURS = {  # of methods
    "thesis": "#3584e4",
    "joint": "#26a269",
    "wheel-speed": "#9141ac",
    "autoware": "#e66100",
    "openpilot": "#c01c28",
    "median": "#9a9996",
    "mode": "#986a44",
}
ELSEWHERE = {  # where else than in `population` a prior is drawn, if not everywhere
    "pull_m_s2": "`pull` alone",
    "pull_n": "`pull` alone",
    "wind_m_s": "`cross_wind` alone",
    "gust_sd_m_s": "`cross_wind` alone",
}
# What is asked.
MEDIAN_MAX_DEG, P95_MAX_DEG = 0.10, 0.30
VALID_MIN_ORDINARY = 0.80
OF_FLOOR_MAX = 1.2
COVERAGE_MIN = 0.85
COVERAGE_OF_POPULATION = (0.92, 0.99)
MINUTES_TO_1_DEG, MINUTES_TO_HALF_DEG = 3.0, 8.0


def write_page(table: pl.DataFrame, summaries: Sequence[Summary], seeds: range) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        points = study(seeds[:STUDY_DRIVES], folder)
        draw(table, summaries, points, folder)
    results = [*_errors(summaries), *_ours(summaries), *_asked(summaries), *_study(points, seeds[:STUDY_DRIVES])]
    page = "\n".join([*_head(seeds), *_priors(), *results])
    (DOCS / "accuracy.md").write_text(f"{page}\n", encoding="utf-8")


def _head(seeds: range) -> Iterator[str]:
    with_play, without = cannot_be_told_apart_m_s2(play=True), cannot_be_told_apart_m_s2(play=False)
    yield f"""# Accuracy

Written by `make accuracy`: {len(seeds)} drives a row (seeds {seeds[0]} to {seeds[-1]}), 20 minutes each, every one
with a truck, a road and sensors of its own, simulated, so that the truth is known. Every method and every rival sees
the same drives. No threshold was chosen on these seeds; `python bench/accuracy.py --tuning` drives those from 1 on.

**What counts as the offset**: what the sensor reads at the middle of play and wind-up when driving straight without
lateral acceleration. That is the sensor's own offset and, where the alignment is wrong, what it takes to go straight
all the same: no log parts the two. A pull that is a moment about the king pins also moves the side force at which the
steering unloads; taken for the accelerometer's bias, it moves the offset by i K_us pull. So pull and wind are in the
interval by their priors, and **the floor**, which no method gets below, is 1.96 i K_us times the sd of what cannot be
told apart: {with_play:.3f} m/s² with play, {without:.3f} without, from accelerometer bias
{ACCELEROMETER_BIAS_SD_M_S2:g}, crown 0.2 ± 0.1 as another reading of it, pull {PULL_SD_M_S2:g} and mean wind
{WIND_SD_M_S2:g} m/s².

Rivals are written anew from their equations in `bench/rivals/`. They are told more than a vehicle file says:
openpilot's filter begins with the truck's true stiffnesses, mass and inertia. Where a rival has nothing to say, it does
not count against it, but the share is given where it is not all.

![Errors by row and method, errors over time, and the gate's study](accuracy.png)
"""


def _priors() -> Iterator[str]:
    yield f"""## Whence the drives

What a row does not fix is drawn from these; `bench/population.py` has them. The row `population` draws all of it, on
the roads of the scenarios {', '.join(POPULATED_BY)}.

| quantity | prior | in the other rows | |
|---|---|---|---|"""
    for name, (prior, about) in PRIORS.items():
        yield f"| `{name}` | {prior} | {EVERY_ROW.get(name, ELSEWHERE.get(name, 'the same'))} | {about} |"
    yield ""


def _errors(summaries: Sequence[Summary]) -> Iterator[str]:
    methods = list(dict.fromkeys(s.method for s in summaries))
    yield """## How far off, after 20 minutes

Absolute error in deg, median / 95th percentile of the drives with a value; in brackets their share where not all have
one.
"""
    yield f"| row | | {' | '.join(methods)} |"
    yield f"|---|---|{'--:|' * len(methods)}"
    for row in dict.fromkeys(s.row for s in summaries):
        cells = [_error(s) for s in summaries if s.row == row]
        yield f"| `{row}` | {ROWS[row].about} | {' | '.join(cells)} |"
    spent = [f"{s.ns_per_sample:.0f}" for s in summaries if s.row == "ordinary"]
    yield f"| | ns a tick on `ordinary`, one core, median | {' | '.join(spent)} |"
    yield ""


def _error(s: Summary) -> str:
    share = "" if s.answered == 1.0 else f" ({s.answered:.0%})"
    return f"{_number(s.median)} / {_number(s.p95)}{share}"


def _ours(summaries: Sequence[Summary]) -> Iterator[str]:
    yield """## How sure and how soon

Coverage is the share of 95 % intervals that hold the truth, whatever their status; the half-width is the median, in
deg, and against the floor; minutes are the median of the time after which the error stays below 1 and 0.5 deg.
"""
    columns = "row, method, valid, error of the valid: median / 95 % / largest, coverage, half-width, / floor, to 1 deg"
    yield f"| {' | '.join(columns.split(', '))} | to 0.5 deg |"
    yield f"|---|---|{'--:|' * 7}"
    for s in summaries:
        if s.method in METHODS:
            errors = " / ".join(map(_number, (s.valid_median, s.valid_p95, s.valid_largest)))
            interval = f"{_share(s.coverage)} | {_number(s.half_width)} | {_number(s.of_floor)}"
            times = f"{_minutes(s.minutes_to_1_deg)} | {_minutes(s.minutes_to_half_deg)}"
            yield f"| `{s.row}` | {s.method} | {s.valid:.0%} | {errors} | {interval} | {times} |"
    yield ""
    yield "Of the rivals two claim a spread. Over all rows:"
    yield ""
    yield "| rival | coverage | half-width, median |"
    yield "|---|--:|--:|"
    for method in dict.fromkeys(s.method for s in summaries):
        rows = [s for s in summaries if s.method == method and math.isfinite(s.coverage)]
        if method not in METHODS and rows:
            coverage, width = np.mean([s.coverage for s in rows]), np.median([s.half_width for s in rows])
            yield f"| {method} | {coverage:.0%} | {width:.2f} |"
    yield ""


def _asked(summaries: Sequence[Summary]) -> Iterator[str]:
    low, high = COVERAGE_OF_POPULATION
    yield f"""## What is asked of `{JUDGED}`

Of rows that ask for the error: median of the valid at most {MEDIAN_MAX_DEG:.2f} deg, 95 % of them at most
{P95_MAX_DEG:.2f}. Of rows in which no drive tells all: a half-width of at most {OF_FLOOR_MAX:g} of the floor. Coverage
at least {COVERAGE_MIN:.0%}, of the population {low:.0%} to {high:.0%}. And a median of all drives below every rival's.
**Bold** is missed, — is not asked.

| row | median | 95 % | half-width / floor | coverage | all drives: median, best rival's |
|---|--:|--:|--:|--:|--:|"""
    judged = [s for s in summaries if s.method == JUDGED]
    for s in judged:
        yield f"| `{s.row}` | {' | '.join(_demands(s, summaries))} |"
    yield ""
    ordinary = next(s for s in judged if s.row == "ordinary")
    soon = ordinary.minutes_to_1_deg, ordinary.minutes_to_half_deg
    valid = _met(ordinary.valid >= VALID_MIN_ORDINARY, f"{ordinary.valid:.0%}")
    yield (
        f"Of the ordinary drives at least {VALID_MIN_ORDINARY:.0%} valid: {valid}. Within 1 deg after "
        f"{MINUTES_TO_1_DEG:g} minutes: {_met(soon[0] <= MINUTES_TO_1_DEG, _minutes(soon[0]))}; within 0.5 deg after "
        f"{MINUTES_TO_HALF_DEG:g}: {_met(soon[1] <= MINUTES_TO_HALF_DEG, _minutes(soon[1]))}."
    )


def _demands(s: Summary, summaries: Sequence[Summary]) -> Iterator[str]:
    """Cells of a row; a comparison with NaN is not met."""
    of_error, of_interval = (ROWS[s.row].asked == kind for kind in ("error", "interval"))
    yield _met(s.valid_median <= MEDIAN_MAX_DEG, _number(s.valid_median)) if of_error else "—"
    yield _met(s.valid_p95 <= P95_MAX_DEG, _number(s.valid_p95)) if of_error else "—"
    yield _met(s.of_floor <= OF_FLOOR_MAX, _number(s.of_floor)) if of_interval else "—"
    low, high = COVERAGE_OF_POPULATION if s.row == "population" else (COVERAGE_MIN, 1.0)
    yield _met(low <= s.coverage <= high, _share(s.coverage))
    theirs = [r for r in summaries if r.row == s.row and r.method not in METHODS and math.isfinite(r.median)]
    best = min(theirs, key=lambda r: r.median)
    yield f"{_met(s.median < best.median, _number(s.median))}, {best.method} {best.median:.2f}"


def _met(met: bool, said: str) -> str:
    return said if met else f"**{'none' if said == '—' else said}**"


def _study(points: Sequence[Point], seeds: range) -> Iterator[str]:
    yield f"""
## What the gate trades (§5.5.2)

The thesis's method with one limit of Table 4 moved at a time, {len(seeds)} drives each: `flawless` are ordinary
drives without play and sensor bias, so that what is left is the gate's doing. Seconds of evidence out of 1200 and
absolute error in deg, median / 95th percentile; **bold** is Table 4.

| limit | {" | ".join(f"{row}: used | error" for row in STUDIED)} |
|---|{"--:|--:|" * len(STUDIED)}"""
    for limit, (symbol, unit, values) in LIMITS.items():
        for value in values:
            here = [p for p in points if p.limit == limit and p.value == value]
            cells = [f"{p.used_s:.0f} | {_number(p.error_deg)} / {_number(p.error_p95_deg)}{_few(p)}" for p in here]
            name = f"{symbol} {shown(limit, value):.4g} {unit}"
            yield f"| {f'**{name}**' if value == TABLE_4[limit] else name} | {' | '.join(cells)} |"


def _few(point: Point) -> str:
    return "" if point.answered == 1.0 else f" ({point.answered:.0%})"


def _number(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else "—"


def _share(value: float) -> str:
    return f"{value:.0%}" if math.isfinite(value) else "—"


def _minutes(value: float) -> str:
    return f"{value:.0f} min" if math.isfinite(value) else "never"


def draw(table: pl.DataFrame, summaries: Sequence[Summary], points: Sequence[Point], folder: Path) -> None:
    """One picture: errors by row, over time, and the gate's study below."""
    from bokeh.embed import file_html
    from bokeh.layouts import column, row
    from bokeh.resources import INLINE

    studies = row(*(_gate_plot(limit, points) for limit in LIMITS))
    picture = column(row(_rows_plot(summaries), _time_plot(table)), studies)
    page = folder / "accuracy.html"
    page.write_text(file_html(picture, INLINE, title="accuracy"), encoding="utf-8")
    subprocess.run(
        [
            "chromium",
            *"--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking".split(),
            *"--hide-scrollbars --virtual-time-budget=8000 --window-size=1216,956".split(),
            f"--user-data-dir={folder}/profile",
            f"--screenshot={DOCS / 'accuracy.png'}",
            page.as_uri(),
        ],
        check=True,
        stderr=subprocess.DEVNULL,
    )


def _rows_plot(summaries: Sequence[Summary]) -> Any:
    """A dot at the median, a line on to the 95th percentile, one height for each method within its row."""
    from bokeh.plotting import figure

    rows = list(dict.fromkeys(s.row for s in summaries))
    methods = list(dict.fromkeys(s.method for s in summaries))
    plot = figure(
        width=700,
        height=680,
        toolbar_location=None,
        x_axis_type="log",
        x_range=(0.02, 40.0),
        y_range=(len(rows) - 0.5, -0.5),
        x_axis_label="absolute error after 20 minutes (deg): median, line to the 95th percentile",
    )
    plot.yaxis.ticker = list(range(len(rows)))
    plot.yaxis.major_label_overrides = dict(enumerate(rows))
    plot.ygrid.grid_line_color = None
    for k, method in enumerate(methods):
        said = [s for s in summaries if s.method == method and math.isfinite(s.median)]
        height = [rows.index(s.row) + 0.7 * ((k + 0.5) / len(methods) - 0.5) for s in said]
        middle, far = [max(s.median, 0.02) for s in said], [s.p95 for s in said]
        plot.segment(middle, height, far, height, color=COLOURS[method], line_width=1.5, alpha=0.7)
        plot.scatter(middle, height, size=6, color=COLOURS[method], legend_label=method)
    plot.legend.location = "top_left"
    plot.legend.background_fill_alpha = 0.7
    return plot


def _time_plot(table: pl.DataFrame) -> Any:
    """Of the row `ordinary`: the median of the absolute error, minute by minute."""
    from bokeh.plotting import figure

    plot = figure(
        width=500,
        height=680,
        toolbar_location=None,
        y_axis_type="log",
        x_axis_label="driven (min), row `ordinary`",
        y_axis_label="absolute error (deg), median",
    )
    ordinary = table.filter(pl.col("row") == "ordinary")
    for (method,), part in ordinary.group_by("method", maintain_order=True):
        errors = np.abs(np.array(part["error_deg"].to_list(), float))
        said = np.isfinite(errors).mean(axis=0) > 0.5
        minutes = np.arange(1, errors.shape[1] + 1)[said]
        plot.line(minutes, np.nanmedian(errors[:, said], axis=0), color=COLOURS[str(method)], line_width=2)
    for bound in (1.0, 0.5):
        plot.line([1, 20], [bound, bound], color="#5e5c64", line_dash="dashed")
    return plot


def _gate_plot(limit: str, points: Sequence[Point]) -> Any:
    """Error over evidence as one limit moves: each value a point, Table 4's larger."""
    from bokeh.plotting import figure

    symbol, unit, _ = LIMITS[limit]
    plot = figure(
        width=300,
        height=260,
        toolbar_location=None,
        title=f"{symbol} ({unit})",
        x_range=(0.0, 950.0),
        y_range=(0.005, 10.0),
        y_axis_type="log",
        x_axis_label="evidence (s)",
        y_axis_label="error (deg), median",
    )
    for colour, name in zip(("#26a269", "#3584e4"), STUDIED, strict=True):
        here = [p for p in points if p.limit == limit and p.row == name and math.isfinite(p.error_deg)]
        x, y = [p.used_s for p in here], [p.error_deg for p in here]
        sizes = [9 if p.value == TABLE_4[limit] else 5 for p in here]
        plot.line(x, y, color=colour, alpha=0.5)
        plot.scatter(x, y, size=sizes, color=colour, legend_label=name)
        names = [f"{shown(limit, p.value):.4g}" for p in here]
        plot.text(x, y, text=names, text_font_size="9px", angle=0.9, x_offset=2, y_offset=-5, text_color=colour)
    plot.legend.location = (5, 60)
    plot.legend.label_text_font_size = "9px"
    plot.legend.background_fill_alpha = 0.5
    return plot
