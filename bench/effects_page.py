"""The section "Real-truck effects" of docs/accuracy.md, from the records of bench/effects.py."""

from __future__ import annotations

import math
import textwrap
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl
import sections
from accuracy_rows import DURATION_S
from effects import LOST_AT_S, Record, judged
from effects_rows import AT_SIZE_1, EFFECTS, PULLS, VALID_MIN
from scipy.stats import binom

PAGE = Path(__file__).parents[1] / "docs" / "accuracy.md"

# The requirements; errors in deg.
POOLED_VALID_MIN, POOLED_ALL_MIN = 0.92, 0.88
CLAIMED, CHANCE = 0.95, 0.01  # probability of the binomial distribution, and its quantile that is the minimum
OFF_DEG, FAR_OFF_DEG, DRIVES_PER_OFF = 1.0, 2.0, 60
NONE_MEDIAN_MAX, NONE_P95_MAX = 0.10, 0.30
PLAY_LARGEST_MAX, DRIFT_P95_MAX, THESIS_LARGEST_MAX = 0.5, 0.5, 1.0
OTHERS_MIN, OTHERS_COUNT_MIN = 0.88, 30
ANGLE_COVERED_MIN, ANGLE_RMS_MAX = 0.90, 2.5
ANGLE_ROWS = ("accelerometer_drift", "overlay_motor")
DRIVES_PER_ACCUSED = 200

OTHERS = {  # what it is called, unit and decimals of its error
    "understeer_gradient": ("K_us", "deg/(m/s²)", 3),
    "backlash": ("play", "deg", 2),
    "yaw_rate_bias": ("gyro bias", "deg/s", 3),
}
# By demand and row ("" where all rows count together): why it is missed, as a sentence.
_LAGS = "The bias drifts faster than a hypothesis follows; a faster one forgets the flanks on other rows."
_RUNS = "Nothing is valid there; the intervals are from before the bank closed the gate."
_PLAYS = "Bends to both sides need more angle, as with a wider play."
WHY: dict[tuple[str, str], str] = {
    ("covered", "accelerometer_drift_double"): _LAGS,
    ("covered", "accelerometer_drift_thesis"): _RUNS,
    ("covered", "wind_moment_double"): "A wind of many minutes cannot be separated from a constant bias.",
    ("off", "accelerometer_drift"): "While one flank alone is loaded, drift and wind cannot be separated.",
    ("off", "pull_double"): "The prior of a_0 excludes it: few axles unload so far from the bank.",
    ("valid_share", "overlay_motor"): "Lash that a motor drags along leaves more than 0.5 deg of most drives open.",
    ("valid_share", "fifth_wheel"): "The term of its friction leaves more than 0.5 deg of most drives open.",
    ("valid_share", "combined_trailer"): "The same, by half the friction and other effects.",
    ("understeer_gradient_coverage", "accelerometer_drift_double"): _LAGS,
    ("understeer_gradient_coverage", "fifth_wheel_double"): "The term of the friction has a prior of 1.5 deg (sd).",
    ("understeer_gradient_coverage", "minor_physics_double"): "Gyro scale and uneven ratio are estimated as K_us.",
    ("backlash_coverage", "accelerometer_drift_double"): _LAGS,
    (
        "backlash_coverage",
        "axle_set_up_double",
    ): "Its neutral lateral acceleration is further from the bank than the prior of a_0 allows.",
    ("backlash_coverage", "fifth_wheel_half"): "The friction that its term does not explain is estimated as play.",
    ("backlash_coverage", "slippery_patches"): _PLAYS,
    ("backlash_coverage", "slippery_patches_double"): _PLAYS,
    ("angle_coverage", "accelerometer_drift"): "No drift was detected before the loss, so none is assumed after it.",
    ("accusations", ""): "Most are of rows at double size, or of an accelerometer with a fast drift.",
}


@dataclass(frozen=True)
class Case:
    """`row` is "" where all rows count together; a comparison with NaN is not met."""

    row: str
    met: bool
    figures: str


@dataclass(frozen=True)
class Demand:
    name: str
    about: str
    cases: Sequence[Case]


def write_section(table: pl.DataFrame, summaries: Sequence[Record], seeds: range) -> None:
    page = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    PAGE.write_text(sections.with_section(page, "\n".join(section(table, summaries, seeds))), encoding="utf-8")


def section(table: pl.DataFrame, summaries: Sequence[Record], seeds: range) -> Iterator[str]:
    demands = list(_demands(table, summaries))
    missed = {(demand.name, case.row) for demand in demands for case in demand.cases if not case.met}
    yield from _head(seeds)
    yield from _offsets(summaries, missed)
    yield from _others(summaries, missed)
    yield from _angles(summaries, missed)
    yield from _accusations(table)
    yield "### What is required of these rows"
    yield ""
    for demand in demands:
        yield from _lines(demand)


def _head(seeds: range) -> Iterator[str]:
    yield f"""{sections.EFFECTS}

Written by `bench/effects.py --page`: {len(seeds)} drives a row (seeds {seeds[0]} to {seeds[-1]}), {DURATION_S / 60.0:g}
minutes each. The trucks are simulated. Noise and steps of their sensors are as measured on two real trucks' loggers and
a car. The vehicle file names no traffic side. Each row adds one effect that the usual model lacks; the `combined` rows
add several. A row without a suffix has the effect's full size, `_half` half of it and `_double` double, but
at most 60 % of a load leaves.

{_wrapped(_judged_less_pull())}
"""


def _judged_less_pull() -> str:
    rows = ", ".join(f"`{row}`" for row in EFFECTS if row in PULLS)
    return (
        "A pull cannot be identified from one drive: it moves the estimated offset by i K_us times the pull. Here i is "
        "the steering ratio, K_us the understeer gradient, and the pull the lateral acceleration at which the steering "
        "moment at the king pins is zero. So the rows whose truth has a pull are judged by the error minus i K_us "
        "times the pull. These rows "
        f"are {rows}."
    )


def _wrapped(text: str) -> str:
    return textwrap.fill(text, 120, break_long_words=False, break_on_hyphens=False)


def _demands(table: pl.DataFrame, summaries: Sequence[Record]) -> Iterator[Demand]:
    of = {s["row"]: s for s in summaries}
    yield from _coverage([of[row] for row in AT_SIZE_1 if row in of], summaries)
    yield from _errors(table, of)
    yield Demand(
        "valid_share",
        "Share of valid drives, if a minimum is required",
        [
            Case(s["row"], s["valid"] >= share * s["drives"], f"{s['valid']} of {s['drives']}, required {share:.0%}")
            for s in summaries
            if (share := VALID_MIN.get(s["row"], 0.0))
        ],
    )
    for name, (called, _, _) in OTHERS.items():
        yield Demand(
            f"{name}_coverage",
            f"{called}: at least {OTHERS_MIN:.0%} of the valid intervals contain the truth in each row with at least "
            f"{OTHERS_COUNT_MIN} of them",
            [
                Case(s["row"], held >= OTHERS_MIN * count, _of(held, count))
                for s in summaries
                for held, count, _ in [s[name]]
                if count >= OTHERS_COUNT_MIN
            ],
        )
    yield from _of_angle({row: of[row]["angle"] for row in ANGLE_ROWS if row in of and "angle" in of[row]})
    accused = sum(accused_drives(table).values())
    yield Demand(
        "accusations",
        f"Change, error or sensor fault reported on at most 1 drive in {DRIVES_PER_ACCUSED}",
        [Case("", accused * DRIVES_PER_ACCUSED <= len(table), f"{accused} of {len(table)}")],
    )


def _coverage(at_size_1: Sequence[Record], summaries: Sequence[Record]) -> Iterator[Demand]:
    kinds = (("valid", "covered_valid", POOLED_VALID_MIN), ("drives", "covered", POOLED_ALL_MIN))
    for kind, covered, share in kinds:
        called = "the valid intervals" if kind == "valid" else "all intervals"
        held, count = (sum(s[key] for s in at_size_1) for key in (covered, kind))
        yield Demand(
            f"pooled_{covered}",
            f"Rows at full size and the `combined` rows together: at least {share:.0%} of {called} contain the truth",
            [Case("", held >= share * count, _of(held, count))],
        )
    for kind, covered, _ in kinds:
        called = "valid intervals" if kind == "valid" else "intervals"
        yield Demand(
            covered,
            f"Each row: the number of {called} that contain the truth is not below the {CHANCE:.0%} quantile of a "
            f"binomial distribution with a probability of {CLAIMED:.0%}",
            [
                Case(s["row"], s[covered] >= minimum, f"{s[covered]} of {s[kind]}, required {minimum}")
                for s in summaries
                for minimum in [bound(s[kind])]
            ],
        )


def bound(count: int) -> int:
    """The 1 % quantile of how many of so many 95 % intervals contain the truth."""
    return int(binom.ppf(CHANCE, count, CLAIMED)) if count else 0


def _errors(table: pl.DataFrame, of: Mapping[str, Record]) -> Iterator[Demand]:
    off, far_off = ({row: off_by_more(table, row, limit) for row in of} for limit in (OFF_DEG, FAR_OFF_DEG))
    yield Demand(
        "off",
        f"Each row: at most 1 valid drive in {DRIVES_PER_OFF} has an error above {OFF_DEG:g} deg",
        [Case(row, off[row] * DRIVES_PER_OFF <= s["drives"], f"{off[row]} of {s['valid']}") for row, s in of.items()],
    )
    yield Demand(
        "far_off",
        f"Each row: no valid drive has an error above {FAR_OFF_DEG:g} deg",
        [Case(row, far_off[row] == 0, f"{far_off[row]} of {s['valid']}") for row, s in of.items()],
    )
    limits = (
        ("none_median", ("none",), 0, NONE_MEDIAN_MAX, "the median error of the valid drives"),
        ("none_p95", ("none",), 1, NONE_P95_MAX, "the error of 95 % of the valid drives"),
        ("play_largest", ("play_12", "play_15"), 2, PLAY_LARGEST_MAX, "the largest error of the valid drives"),
        ("drift_p95", ("accelerometer_drift",), 1, DRIFT_P95_MAX, "the error of 95 % of the valid drives"),
    )
    for name, rows, which, limit, called in limits:
        yield Demand(
            name,
            f"{_named(rows)}: {called} is at most {limit:.2f} deg",
            [
                Case(row, value <= limit, f"{value:.2f} deg" if math.isfinite(value) else "no valid drive")
                for row in rows
                if row in of
                for value in [(of[row]["valid_error"] or [math.nan] * 3)[which]]
            ],
        )
    thesis = "accelerometer_drift_thesis"
    yield Demand(
        "thesis_largest",
        f"`{thesis}`: no valid drive has an error above {THESIS_LARGEST_MAX:g} deg",
        [
            Case(row, count == 0, f"{count} of {of[row]['valid']}")
            for row in (thesis,)
            if row in of
            for count in [off_by_more(table, row, THESIS_LARGEST_MAX)]
        ],
    )


def _of_angle(angles: Mapping[str, tuple[float, float]]) -> Iterator[Demand]:
    yield Demand(
        "angle_coverage",
        f"Virtual angle of {_named(ANGLE_ROWS)}: at least {ANGLE_COVERED_MIN:.0%} of the intervals contain the truth",
        [Case(row, covered >= ANGLE_COVERED_MIN, f"{covered:.1%}") for row, (_, covered) in angles.items()],
    )
    yield Demand(
        "angle_rms",
        f"Virtual angle of {_named(ANGLE_ROWS)}: the RMS error is at most {ANGLE_RMS_MAX:g} deg",
        [Case(row, rms <= ANGLE_RMS_MAX, f"{rms:.2f} deg") for row, (rms, _) in angles.items()],
    )


def off_by_more(table: pl.DataFrame, row: str, limit_deg: float) -> int:
    """Valid drives of the row."""
    error = pl.col(judged(row, "offset_error")).cast(pl.Float64).abs()
    return table.filter((pl.col("row") == row) & pl.col("valid") & (error > limit_deg)).height


def accused_drives(table: pl.DataFrame) -> Counter[str]:
    """The drives of each row with a report of a changed offset, of an error or of a sensor fault."""
    return Counter(drive["row"] for drive in table.iter_rows(named=True) if _is_accused(drive))


def _is_accused(drive: Mapping[str, Any]) -> bool:
    return "offset_changed" in drive["findings"] or bool(drive["errors"]) or drive["fault"] != "none"


def _lines(demand: Demand) -> Iterator[str]:
    missed = [case for case in demand.cases if not case.met]
    if not demand.cases:
        yield f"- {demand.about}: no row to judge."
    elif len(demand.cases) == 1:
        (case,) = demand.cases
        yield f"- {demand.about}: {_missed(demand, case) if missed else f'met ({case.figures}).'}"
    elif not missed:
        yield f"- {demand.about}: met by all {len(demand.cases)} rows."
    else:
        yield f"- {demand.about}: **missed** by {len(missed)} of {len(demand.cases)} rows."
        yield from (f"    - `{case.row}`: {_missed(demand, case)}" for case in missed)


def _missed(demand: Demand, case: Case) -> str:
    why = WHY.get((demand.name, case.row), "")
    return f"**missed** ({case.figures}).{' ' if why else ''}{why}"


def _offsets(summaries: Sequence[Record], missed: set[tuple[str, str]]) -> Iterator[str]:
    yield """### Offset with real-truck effects

Error of the valid drives in deg: median / 95th percentile / largest. An interval of 95 % is covered if it contains the
truth. This drive's part (`ci95_drive`) is judged on the error minus the effect of the pull, with the median of that
error over its half-width: 0.34 is expected for a normal error. **Bold** misses a requirement.

| row | what it is | drives | valid | error of the valid | covered of valid | of all | `ci95_drive`: of valid |\
 of all | error / half-width |
|---|---|--:|--:|--:|--:|--:|--:|--:|--:|"""
    requirements = (("none_median",), ("none_p95", "drift_p95"), ("off", "far_off", "play_largest", "thesis_largest"))
    for s in summaries:
        row, errors = s["row"], s["valid_error"]
        cells = ["—"] * 3 if errors is None else [f"{value:.2f}" for value in errors]
        error = " / ".join(_bold(cell, row, missed, *names) for cell, names in zip(cells, requirements, strict=True))
        covered = " | ".join(
            _bold(_of(s[key], s[count]), row, missed, key)
            for key, count in (("covered_valid", "valid"), ("covered", "drives"))
        )
        valid = _bold(str(s["valid"]), row, missed, "valid_share")
        drive = f"{_of(s['drive_covered_valid'], s['valid'])} | {_of(s['drive_covered'], s['drives'])} |"
        said = f"| `{row}` | {EFFECTS[row].about} | {s['drives']} | {valid} | {error} | {covered} | {drive}"
        yield f"{said} {s['drive_ratio']:.2f} |"
    yield ""


def _others(summaries: Sequence[Record], missed: set[tuple[str, str]]) -> Iterator[str]:
    yield """### Understeer gradient, play and gyro bias

Covered: valid intervals of the quantity that contain the truth. Error: median of estimate minus truth, over the same
drives.
"""
    heads = (f"{called}: covered | error, {unit}" for called, unit, _ in OTHERS.values())
    yield f"| row | {' | '.join(heads)} |"
    yield f"|---|{'--:|' * 2 * len(OTHERS)}"
    for s in summaries:
        cells = []
        for name, (_, _, decimals) in OTHERS.items():
            held, count, error = s[name]
            cells.append(_bold(_of(held, count), s["row"], missed, f"{name}_coverage"))
            cells.append(f"{error:+.{decimals}f}" if count else "—")
        yield f"| `{s['row']}` | {' | '.join(cells)} |"
    yield ""


def _angles(summaries: Sequence[Record], missed: set[tuple[str, str]]) -> Iterator[str]:
    yield f"""### Virtual angle with real-truck effects

The steering wheel angle sensor is lost after {LOST_AT_S / 60.0:g} minutes. RMS error from then on, median over the
drives, and the share of ticks whose interval of 95 % contains the truth.

| row | RMS, deg | covered |
|---|--:|--:|"""
    for s in summaries:
        if "angle" in s:
            rms, covered = s["angle"]
            of_rms = _bold(f"{rms:.2f}", s["row"], missed, "angle_rms")
            yield f"| `{s['row']}` | {of_rms} | {_bold(f'{covered:.1%}', s['row'], missed, 'angle_coverage')} |"
    yield ""


def _accusations(table: pl.DataFrame) -> Iterator[str]:
    accused = accused_drives(table)
    rows = ", ".join(f"`{row}` {count}" for row, count in accused.items())
    yield _wrapped(
        f"{sum(accused.values())} of {len(table)} drives have a finding `offset_changed`, a finding of level error or "
        f"a sensor fault{f': {rows}' if rows else ''}. The steering wheel angle sensor is healthy in all rows. In "
        f"rows with a load change, the ride height really changes the straight-ahead offset."
    )
    yield ""


def _bold(cell: str, row: str, missed: set[tuple[str, str]], *names: str) -> str:
    return f"**{cell}**" if any((name, row) in missed for name in names) else cell


def _of(held: int, count: int) -> str:
    return f"{held} of {count}" if count else "—"


def _named(rows: Sequence[str]) -> str:
    return " and ".join(f"`{row}`" for row in rows)
