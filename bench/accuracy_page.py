"""docs/accuracy.md, from the records of bench/accuracy.py."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
from accuracy_figure import ANSWERED_MIN, best_rival, draw
from accuracy_real import OXTS_OFFSET_DEG, RealOffset, real_drives
from accuracy_rows import EVERY_ROW, POPULATED_BY, ROWS
from accuracy_study import LIMITS, STUDIED, TABLE_4, Point, shown, study
from population import (
    BELIEVED,
    CROWN_M_S2,
    CROWN_SD_M_S2,
    CROWN_SHARE_STOOD_ON,
    PLAY_SD_DEG,
    PRIORS,
    PULL_SD_M_S2,
    SET_UP_SHARE,
    WIND_SD_M_S2,
    not_identifiable_m_s2,
    set_up_left_open_m_s2,
)
from sections import COMPARE, EFFECTS, TWO_PARTS, section_of, with_section

from oncenter.estimates.estimates import METHODS
from oncenter.signals import DEGREE

if TYPE_CHECKING:
    from accuracy import Summary

DOCS = Path(__file__).parents[1] / "docs"
STUDY_DRIVES = 20
JUDGED = "joint"  # the method that is required to win
SHORT = ("ordinary", "play_15_aligning", "bypass", "motorway", "country", "town", "trailer_full", "population")
ELSEWHERE = {  # where else than in `population` a prior is drawn, if not everywhere
    "pull_m_s2": "`pull` alone",
    "pull_n": "`pull` alone",
    "wind_m_s": "`wind` and `cross_wind` alone",
    "gust_sd_m_s": "`wind` and `cross_wind` alone",
}
# The requirements.
MEDIAN_MAX_DEG, P95_MAX_DEG = 0.10, 0.30
VALID_MIN_ORDINARY = 0.80
OF_FLOOR_MAX = 1.2
COVERAGE_MIN = 0.85
COVERAGE_OF_POPULATION = (0.92, 0.99)
MINUTES_TO_1_DEG, MINUTES_TO_HALF_DEG = 3.0, 8.0
OFF_ON_REAL_MAX_DEG = 0.2
# Of rows that miss a requirement: why, with the row's own figures.
WHY = {
    "play_15_friction": (
        "the wheels do not move in their play by themselves, so nothing shows the neutral lateral acceleration. Two "
        "trucks with different accelerometer biases, and offset and crown to match, give the same log "
        "(`tests/test_accuracy.py` drives them). The prior decides, so hardly any answer is valid. An estimator with "
        "the true truck, play and gyro bias, and the best prior of the accelerometer bias, has errors of "
        "{exact_data_median:.2f} deg (median) and {exact_data_p95:.2f} (95 %), the joint method {median:.2f} and "
        "{p95:.2f}"
    ),
    "cross_wind": (
        "a motorway loads the other flank of the play for moments only, so the width of the play stays open on some "
        "drives. The interval contains that, the floor does not"
    ),
    "unloads_on_crown": (
        "the axle is set up to unload at the lateral force of the crown, {crown:.2f} m/s², which is "
        "{crown_of_pull:.0f} sd of the prior of a pull. No drive separates it from such an accelerometer bias. It "
        "moves the offset by i K_us {crown:.2f}, here {crown_deg:.2f} deg (median). The joint method has an error "
        "of {median:.2f} deg, because it takes the more probable case, but its interval, ±{half_width:.2f} deg, "
        "contains both. Straight on such a crown no flank of the play is loaded, so a mean is nearer to the middle"
    ),
    "bypass": (
        "only one flank of the play is loaded, so only a prior gives the distance to its middle. The joint method "
        "calls {valid:.0%} valid, its interval is ±{half_width:.2f} deg, and {coverage:.0%} of them contain the truth. "
        "A rival that is nearer guesses as well, without an interval"
    ),
    **dict.fromkeys(
        ("town", "yard"),
        "the roads fall to one side and only sharp bends load the other flank, for seconds. So the neutral lateral "
        "acceleration is hardly identified, and its error moves the offset by i K_us times it: "
        "{mean:+.2f} deg on average",
    ),
}
UNEXPLAINED = "not explained"


def write_page(table: pl.DataFrame, summaries: Sequence[Summary], seeds: range) -> None:
    studied = seeds[:STUDY_DRIVES]
    with tempfile.TemporaryDirectory() as name:
        points = study(studied, Path(name))
        draw(table, summaries, points, DOCS / "accuracy.png", Path(name))
    page = [
        *_head(table, summaries, seeds),
        *_required(table, summaries),
        *_why(table, summaries),
        *_errors(summaries),
        *_how_soon(summaries),
        *_how_sure(table, summaries),
        *_real(list(real_drives())),
        *_spent(summaries),
        *_priors(table),
        *_study(points, studied),
    ]
    file = DOCS / "accuracy.md"
    before = file.read_text(encoding="utf-8") if file.exists() else ""
    text = "\n".join(page) + "\n"
    for heading in (TWO_PARTS, EFFECTS, COMPARE):  # other benches write them
        text = with_section(text, section_of(before, heading))
    file.write_text(text, encoding="utf-8")


def _head(table: pl.DataFrame, summaries: Sequence[Summary], seeds: range) -> Iterator[str]:
    yield f"""# Accuracy

How far from the truth is the offset, and does the interval contain it? In short, after 20 minutes of a simulated drive:

{_short(summaries)}
A `valid` answer leaves at most {_valid_within_deg():g} deg open from this drive. Errors are in deg. [A real
car](#a-real-car) has a measured reference. [Real-truck effects](#real-truck-effects) adds one effect of real trucks
per row.

`make accuracy` writes this page: {len(seeds)} drives per row (seeds {seeds[0]} to {seeds[-1]}),
{len(seeds) * ROWS["population"].times} of `population` (from {seeds[0]} on), 20 minutes each. Each drive has its
own truck, road and sensors. It is simulated, so the truth is given. All methods and rivals get the same drives. No
threshold was chosen on these seeds; `python bench/accuracy.py --tuning` uses those from 1 on.

![Errors by row, errors over time, and the gate's study](accuracy.png)

**What the offset is.** The reading of the sensor at the middle of play and column twist, driving straight without
lateral acceleration: the sensor's own zero error plus the angle that a wrong alignment needs. No log separates the two.

**The floor** is the half-width that no single drive can go below. A pull moves the neutral lateral acceleration as
an accelerometer bias does, and the offset by i K_us times the pull. So pull and wind are in the interval by their
priors. The floor is 1.96 i K_us times the standard deviation of these parts. Two rows have more in it:

- `bypass` loads one flank of the play only. The middle is half a play away, which nothing identifies:
  {0.5 * PLAY_SD_DEG:g} deg (sd). Without this the interval would be {_of_side_force_floor(table, "bypass"):.1f} of
  the floor.
- `unloads_on_crown` has axles that are set up to unload on the crown. The prior of such an axle is one in
  {1 / SET_UP_SHARE:.0f}, which leaves {_set_up()} m/s² (sd) open. Without this the interval would be
  {_of_side_force_floor(table, "unloads_on_crown"):.1f} of the floor.

| prior of the estimator (`core/truck/params.h`) | sd, m/s² |
|---|--:|
| accelerometer bias | {BELIEVED["accelerometer_bias_sd_m_s2"]:g} |
| crown, mean {CROWN_M_S2:g} to the side of traffic | {CROWN_SD_M_S2:g} |
| slope of the ground at standstill, beside {CROWN_SHARE_STOOD_ON:g} of the crown | {_slope_sd()} |
| pull | {PULL_SD_M_S2:g} |
| mean wind | {WIND_SD_M_S2:g} |
| **not separable**, if lateral force crosses the play, which shows bias + pull + wind | {_apart(unloads=True)} |
| **not separable**, without that: bias and wind | {_apart(unloads=False)} |

**Rivals** are written anew from their equations in `bench/rivals/`. `bins` and `rls` are the thesis's own ideas for
the middle of the play (§5.5.1): estimates over 20 s, or least squares with a fading memory, sorted by the side of
the bend. Rivals get more than a vehicle file contains: openpilot's filter starts with the true stiffnesses, mass
and inertia, `bins` and `rls` with the true understeer gradient. The thesis, `bins` and `rls` use the uncorrected
yaw rate. If a rival has no value, that is not counted against it, and the share is given.
"""


def _short(summaries: Sequence[Summary]) -> str:
    """The rows that a reader looks for first."""
    lines = [
        "| drive | valid | error of the valid: median / 95 % / largest | error of all: median / 95 % "
        "| intervals that contain the truth |",
        "|---|--:|--:|--:|--:|",
    ]
    for s in summaries:
        if s.method == JUDGED and s.row in SHORT:
            valid = " / ".join(map(_number, (s.valid_median, s.valid_p95, s.valid_largest)))
            name = f"`{s.row}`: {ROWS[s.row].about}"
            lines.append(f"| {name} | {s.valid:.0%} | {valid} | {_error(s)} | {_share(s.coverage)} |")
    return "\n".join(lines) + "\n"


def _valid_within_deg() -> float:
    return float(BELIEVED["offset_drive_half_width_max_rad"]) / DEGREE


def _of_side_force_floor(table: pl.DataFrame, row: str) -> float:
    """Median of the half-width over what pull and wind alone make of it."""
    of_row = table.filter((pl.col("row") == row) & (pl.col("method") == JUDGED))
    half_widths = 1.96 * of_row["sd_deg"].list.last().to_numpy()
    return float(np.nanmedian(half_widths / of_row["side_force_floor_deg"].to_numpy()))


def _slope_sd() -> str:
    return f"{BELIEVED['standing_slope_sd_m_s2']:g}"


def _set_up() -> str:
    return f"{set_up_left_open_m_s2(stood=True):.3f}"


def _apart(*, unloads: bool) -> str:
    stood, never = (not_identifiable_m_s2(unloads=unloads, stood=stood) for stood in (True, False))
    return f"{stood:.3f}, without a standstill {never:.3f}"


def _priors(table: pl.DataFrame) -> Iterator[str]:
    pushed = {row: _root_mean_square(_of(table, row, "wind_m_s2")) for row in ("population", "cross_wind")}
    yield f"""## Where the drives come from

A row fixes some quantities. All others are drawn from these distributions (`bench/population.py`). The row
`population` draws all of them, on the roads of the scenarios {", ".join(POPULATED_BY)}; one axle in
{1 / SET_UP_SHARE:.0f} of its trucks is set up to unload on 2 %. Over the drives of this page the wind moved the
neutral lateral acceleration by {pushed["population"]:.3f} m/s² (root mean square) in `population` and
{pushed["cross_wind"]:.3f} in `cross_wind`, whose motorway has one direction for a long time. The prior of the
estimator is {WIND_SD_M_S2:g}.

| quantity | prior | in the other rows | |
|---|---|---|---|"""
    for name, (prior, about) in PRIORS.items():
        yield f"| `{name}` | {prior} | {EVERY_ROW.get(name, ELSEWHERE.get(name, 'the same'))} | {about} |"
    yield ""


def _of(table: pl.DataFrame, row: str, column: str) -> Iterable[float]:
    """Once for each drive of the row."""
    of_row = table.filter((pl.col("row") == row) & (pl.col("method") == JUDGED))
    return [float(value) for value in of_row[column]]


def _root_mean_square(values: Iterable[float]) -> float:
    return float(np.sqrt(np.mean(np.square(list(values)))))


def _errors(summaries: Sequence[Summary]) -> Iterator[str]:
    methods = list(dict.fromkeys(s.method for s in summaries))
    yield """## How far off, after 20 minutes

Absolute error in deg, median / 95th percentile of the drives with a value; in brackets their share if not all have
one.
"""
    yield f"| row | | {' | '.join(methods)} |"
    yield f"|---|---|{'--:|' * len(methods)}"
    for row in dict.fromkeys(s.row for s in summaries):
        cells = [_error(s) for s in summaries if s.row == row]
        yield f"| `{row}` | {ROWS[row].about} | {' | '.join(cells)} |"
    yield ""


def _error(s: Summary) -> str:
    share = "" if s.answered == 1.0 else f" ({s.answered:.0%})"
    return f"{_number(s.median)} / {_number(s.p95)}{share}"


def _how_soon(summaries: Sequence[Summary]) -> Iterator[str]:
    methods = list(dict.fromkeys(s.method for s in summaries))
    yield """## How soon

Minutes after which the error stays below 1 deg / below 0.5 deg, median over the drives; — never within the 20.
"""
    yield f"| row | {' | '.join(methods)} |"
    yield f"|---|{'--:|' * len(methods)}"
    for row in dict.fromkeys(s.row for s in summaries):
        of_row = {s.method: s for s in summaries if s.row == row}
        cells = [_soon(s) for s in of_row.values()]
        yield f"| `{row}` | {' | '.join(cells)} |"
    yield ""


def _soon(s: Summary) -> str:
    if not math.isfinite(s.minutes_to_1_deg):
        return "—"
    return f"{_minutes(s.minutes_to_1_deg)} / {_minutes(s.minutes_to_half_deg)}"


def _how_sure(table: pl.DataFrame, summaries: Sequence[Summary]) -> Iterator[str]:
    yield """## How sure

Coverage: the share of the 95 % intervals that contain the truth, with any status. The half-width is the median, in deg,
and relative to the floor.
"""
    yield "| row | method | valid | error of the valid: median / 95 % / largest | coverage | | half-width | / floor |"
    yield f"|---|---|{'--:|' * 6}"
    for s in summaries:
        if s.method in METHODS:
            errors = " / ".join(map(_number, (s.valid_median, s.valid_p95, s.valid_largest)))
            count = "—" if not s.intervals else f"{s.covered} of {s.intervals}"
            interval = f"{count} | {_share(s.coverage)} | {_number(s.half_width)} | {_number(s.of_floor)}"
            yield f"| `{s.row}` | {s.method} | {s.valid:.0%} | {errors} | {interval} |"
    yield ""
    yield "Two rivals give a standard deviation. Over all rows:"
    yield ""
    yield "| rival | coverage | | half-width, median |"
    yield "|---|--:|--:|--:|"
    for method in dict.fromkeys(s.method for s in summaries):
        rows = [s for s in summaries if s.method == method and s.intervals]
        if method not in METHODS and rows:
            covered, intervals = sum(s.covered for s in rows), sum(s.intervals for s in rows)
            width = np.median([s.half_width for s in rows])
            yield f"| {method} | {covered} of {intervals} | {covered / intervals:.0%} | {width:.2f} |"
    yield ""


def _real(offsets: Sequence[RealOffset]) -> Iterator[str]:
    yield f"""## A real car

Two drives of a Hyundai Genesis on a proving ground, {" and ".join(f"`{name}`" for name in OXTS_OFFSET_DEG)}, from the
car's own sensors only. Its gyro has a bias of 0.25 to 0.30 deg/s, its accelerometer of -0.6 m/s². The reference
offset is a fit in bends to the heading of an OxTS GNSS/INS. Required of `{JUDGED}`: within {OFF_ON_REAL_MAX_DEG:g} deg.
"""
    if not offsets:
        yield "**Not run**: the recordings, which are not part of this repository, were not there; `ONCENTER_REAL_DATA`"
        yield "names the folder that has `genesis/`."
        yield ""
        return
    yield "| drive | method | reference | estimate | ± | error | |"
    yield "|---|---|--:|--:|--:|--:|---|"
    for s in offsets:
        if s.value_deg is None:
            yield f"| `{s.drive}` | {s.method} | {s.oxts_deg:.2f} | — | — | — | {s.refusal or s.status} |"
            continue
        off = s.value_deg - s.oxts_deg
        met = abs(off) <= OFF_ON_REAL_MAX_DEG or s.method != JUDGED
        width = "—" if s.half_width_deg is None else f"{s.half_width_deg:.2f}"
        yield (
            f"| `{s.drive}` | {s.method} | {s.oxts_deg:.2f} | {s.value_deg:.2f} | {width} "
            f"| {_met(met, f'{off:+.2f}')} | {s.status} |"
        )
    yield ""


def _spent(summaries: Sequence[Summary]) -> Iterator[str]:
    ordinary = [s for s in summaries if s.row == "ordinary"]
    yield """## Time

Processor time for one tick of all signals, from Python, the answer only, median over the drives of `ordinary` while
the other drives of this page ran on the other cores.
"""
    yield f"| | {' | '.join(s.method for s in ordinary)} |"
    yield f"|---|{'--:|' * len(ordinary)}"
    yield f"| ns | {' | '.join(f'{s.ns_per_sample:.0f}' for s in ordinary)} |"
    yield f"| M ticks/s | {' | '.join(f'{1000.0 / s.ns_per_sample:.1f}' for s in ordinary)} |"
    yield ""


def _required(table: pl.DataFrame, summaries: Sequence[Summary]) -> Iterator[str]:
    low, high = COVERAGE_OF_POPULATION
    yield f"""## What is required of `{JUDGED}`

- Rows judged by the error: median of the valid at most {MEDIAN_MAX_DEG:.2f} deg, 95 % of them at most
  {P95_MAX_DEG:.2f}.
- Rows in which one drive cannot identify everything: a half-width of at most {OF_FLOOR_MAX:g} of the floor.
- Coverage at least {COVERAGE_MIN:.0%}, of the population {low:.0%} to {high:.0%}.
- A median of all drives below that of every rival with a value on at least {ANSWERED_MIN:.0%} of them.

**Bold** is missed, — is not required.

| row | valid | median | 95 % | half-width / floor | coverage | all drives: median, best rival's |
|---|--:|--:|--:|--:|--:|--:|"""
    judged = [s for s in summaries if s.method == JUDGED]
    for s in judged:
        yield f"| `{s.row}` | {s.valid:.0%} | {' | '.join(_demands(s, summaries))} |"
    yield ""
    ordinary = next(s for s in judged if s.row == "ordinary")
    to_1_deg = _met(ordinary.minutes_to_1_deg <= MINUTES_TO_1_DEG, f"{_minutes(ordinary.minutes_to_1_deg)} min")
    to_half_deg = _met(
        ordinary.minutes_to_half_deg <= MINUTES_TO_HALF_DEG, f"{_minutes(ordinary.minutes_to_half_deg)} min"
    )
    valid = _met(ordinary.valid >= VALID_MIN_ORDINARY, f"{ordinary.valid:.0%}")
    yield (
        f"Of the ordinary drives at least {VALID_MIN_ORDINARY:.0%} are valid: {valid}. Within 1 deg after "
        f"{MINUTES_TO_1_DEG:g} minutes: {to_1_deg}; within 0.5 deg after {MINUTES_TO_HALF_DEG:g}: {to_half_deg}."
    )
    population = next(s for s in judged if s.row == "population")
    if population.intervals:
        by_chance = 1.96 * math.sqrt(0.95 * 0.05 / population.intervals)
        yield (
            f"Over the population {population.covered} of {population.intervals} intervals contain the truth, "
            f"{population.coverage:.0%}. For an exact 95 % interval, {0.95 - by_chance:.0%} to "
            f"{min(0.95 + by_chance, 1.0):.0%} are expected with this number of drives."
        )
    yield ""


def _why(table: pl.DataFrame, summaries: Sequence[Summary]) -> Iterator[str]:
    """The explanations that the page owes to rows that miss a requirement, or that a rival wins."""
    lines = [line for s in summaries if s.method == JUDGED and (line := _why_row(table, s, summaries))]
    if lines:
        yield "### Why these rows miss a requirement"
        yield ""
        yield from lines
        yield ""


def _why_row(table: pl.DataFrame, s: Summary, summaries: Sequence[Summary]) -> str:
    """A line for a row that misses a requirement, with the row's figures; "" for the others, and for those whose error
    alone is too large and of which nothing is known that the row's description does not say."""
    lost = []
    if s.row in WHY and ROWS[s.row].required == "error" and not s.valid_p95 <= P95_MAX_DEG:
        lost.append(f"95 % of the valid within {_number(s.valid_p95)} deg" if s.valid else "none valid")
    if ROWS[s.row].required == "interval" and not s.of_floor <= OF_FLOOR_MAX:
        lost.append(f"half-width {s.of_floor:.1f} of the floor")
    best = best_rival(summaries, s.row)
    if best and not s.median < best.median:
        lost.append(f"{best.method} has a median of {best.median:.2f} deg against {_number(s.median)}")
    if s.row != "population" and not s.coverage >= COVERAGE_MIN:
        lost.append(f"{s.covered} of {s.intervals} intervals contain the truth")
    if not lost:
        return ""
    why = WHY.get(s.row, UNEXPLAINED).format_map(_figures(table, s))
    return f"- `{s.row}` ({', '.join(lost)}): {why}."


def _figures(table: pl.DataFrame, s: Summary) -> Mapping[str, float]:
    deg_per_m_s2 = float(np.median(list(_of(table, s.row, "deg_per_m_s2"))))
    of_row = table.filter((pl.col("row") == s.row) & (pl.col("method") == JUDGED))
    errors = of_row["error_deg"].list.last()
    exact_data = of_row["exact_data_deg"].abs()
    return {
        "exact_data_median": _quantile(exact_data, 0.5),
        "exact_data_p95": _quantile(exact_data, 0.95),
        "median": s.median,
        "p95": s.p95,
        "mean": float(np.nanmean(errors.to_numpy())),
        "valid": s.valid,
        "half_width": s.half_width,
        "coverage": s.coverage,
        "crown": CROWN_M_S2,
        "crown_of_pull": CROWN_M_S2 / PULL_SD_M_S2,
        "crown_deg": CROWN_M_S2 * deg_per_m_s2,
    }


def _quantile(values: pl.Series, share: float) -> float:
    return float(np.quantile(values.to_numpy(), share)) if len(values) else math.nan


def _demands(s: Summary, summaries: Sequence[Summary]) -> Iterator[str]:
    """Cells of a row; a comparison with NaN is not met."""
    of_error, of_interval = (ROWS[s.row].required == kind for kind in ("error", "interval"))
    yield _met(s.valid_median <= MEDIAN_MAX_DEG, _number(s.valid_median)) if of_error else "—"
    yield _met(s.valid_p95 <= P95_MAX_DEG, _number(s.valid_p95)) if of_error else "—"
    yield _met(s.of_floor <= OF_FLOOR_MAX, _number(s.of_floor)) if of_interval else "—"
    low, high = COVERAGE_OF_POPULATION if s.row == "population" else (COVERAGE_MIN, 1.0)
    yield _met(low <= s.coverage <= high, _share(s.coverage))
    best = best_rival(summaries, s.row)
    theirs = math.inf if best is None else best.median
    yield f"{_met(s.median < theirs, _number(s.median))}, {best.method if best else 'none'} {_number(theirs)}"


def _met(met: bool, said: str) -> str:
    return said if met else f"**{'none' if said == '—' else said}**"


def _study(points: Sequence[Point], seeds: range) -> Iterator[str]:
    yield f"""## What the gate trades (§5.5.2)

The thesis's method with one limit of Table 4 changed at a time, {len(seeds)} drives each. `flawless` are ordinary
drives without play and sensor bias, so that only the gate has an effect. Seconds of evidence out of 1200 and
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
    return f"{value:.3g}" if math.isfinite(value) else "—"
