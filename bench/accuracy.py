"""Error, interval and convergence time of every method and every rival, on simulated drives, in one run.

    python -m bench.accuracy [--rival module:function] [--drives N] [--rows a,b] [--methods a,b] [--jobs N] [--tuning]
                             [--page]

A row of the matrix (accuracy_rows.py) is N drives of 20 minutes (the population: four times as many), each with its own
truck, road and sensors, drawn from population.py. Seeds from 1001 on are for reporting. Seeds from 1 on (--tuning) are
for tuning a method: no threshold may be chosen on the reported ones. All results go to build/accuracy/. --page, with
all rows and methods, also writes docs/accuracy.md and its picture. --rival compares a function of your own:
docs/howto/compare_estimator.md.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import multiprocessing
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

sys.path.insert(1, str(Path(__file__).parent))  # after the working folder, whose modules --rival takes

from accuracy_rows import ROWS, Drive, drive
from population import PRIORS
from rivals import MINUTE_TICKS, NAMES, Array, Course, RivalError, rival

import oncenter as oc
from oncenter import _core
from oncenter.errors import OncenterError
from oncenter.estimates.estimates import METHODS
from oncenter.offset.run import outputs_of
from oncenter.signals import DEGREE

BUILD = Path(__file__).parents[1] / "build" / "accuracy"
REPORTED_FROM, TUNING_FROM = 1001, 1
BOUNDS_DEG = (1.0, 0.5)  # the times until the error stays below them
NEVER_MIN = np.inf

Record = dict[str, Any]


def courses(drive: Drive, methods: Sequence[str]) -> Iterator[tuple[str, Course, float, str]]:
    """Each method's name, values minute by minute, CPU time per tick in ns, and the reason if it gives no answer."""
    for name in methods:
        if name in METHODS:
            yield name, *our_course(drive, name)
            continue
        their_course, columns = rival(name), drive.columns
        began = time.process_time_ns()
        course = their_course(columns, drive.known)
        yield name, course, (time.process_time_ns() - began) / drive.signals.table.height, ""


def our_course(drive: Drive, method: Any) -> tuple[Course, float, str]:
    """Values minute by minute, ns per tick, and the reason if there is no answer. The last minute is from the answer,
    whose sd is about the centre of its interval; the others are from the trace."""
    minutes = len(drive.target_rad)
    silent = Course(np.full(minutes, np.nan), np.full(minutes, np.nan), np.zeros(minutes, bool))
    began = time.process_time_ns()
    try:
        answer = oc.offset(drive.signals, drive.vehicle, method=method)
    except OncenterError as error:
        return silent, np.nan, str(error)
    spent_ns = (time.process_time_ns() - began) / drive.signals.table.height
    ticks = outputs_of(answer)[MINUTE_TICKS - 1 :: MINUTE_TICKS]
    statuses = np.array(_core.STATUSES)[ticks["offset_status"]]
    says = statuses != "unobservable"
    value = np.where(says, ticks["offset"], np.nan)
    sd = np.where(says, ticks["offset_sd"], np.nan)
    valid = statuses == "valid"
    last = answer.offset
    value[-1] = np.nan if last.value is None else last.value
    sd[-1] = np.nan if last.ci95 is None else (last.ci95[1] - last.ci95[0]) / (2.0 * 1.96)
    valid[-1] = last.status == "valid"
    lean = 0.0 if last.value is None or last.ci95 is None else 0.5 * (last.ci95[0] + last.ci95[1]) - last.value
    return Course(value, sd, valid, lean), spent_ns, ""


def records(row: str, seed: int, methods: Sequence[str], folder: Path) -> list[Record]:
    """One drive, a record per method; angles in deg."""
    driven = drive(ROWS[row], seed, folder)
    return [
        {
            "row": row,
            "seed": seed,
            "method": method,
            "error_deg": ((course.value_rad - driven.target_rad) / DEGREE).tolist(),
            "sd_deg": (course.sd_rad / DEGREE).tolist(),
            "lean_deg": course.lean_rad / DEGREE,
            "valid": course.valid.tolist(),
            "exact_data_deg": driven.exact_data_rad / DEGREE,
            "floor_deg": driven.floor_rad / DEGREE,
            "side_force_floor_deg": driven.side_force_floor_rad / DEGREE,
            "deg_per_m_s2": driven.angle_per_m_s2 / DEGREE,
            "wind_m_s2": driven.wind_m_s2,
            "redrawn": driven.redrawn,
            "ns_per_sample": spent_ns,
            "refusal": refusal,
        }
        for method, course, spent_ns, refusal in courses(driven, methods)
    ]


def run(rows: Sequence[str], seeds: range, methods: Sequence[str], jobs: int) -> pl.DataFrame:
    """All records, in the order of rows, seeds and methods."""
    wanted = [(row, seeds[0] + k) for row in rows for k in range(len(seeds) * ROWS[row].times)]
    done: dict[tuple[str, int], list[Record]] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # The first drive compiles the rivals and touches all memory; it is discarded, because its times include that.
        records(*wanted[0], methods, folder)
        if jobs == 1:
            for key in wanted:
                done[key] = records(*key, methods, folder)
                progress(len(done), len(wanted))
        else:
            # Spawned: polars' threads do not survive a fork.
            with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
                running = {pool.submit(records, *key, methods, folder): key for key in wanted}
                for future in as_completed(running):
                    done[running[future]] = future.result()
                    progress(len(done), len(wanted))
    return pl.DataFrame([record for key in wanted for record in done[key]], infer_schema_length=None)


def progress(done: int, count: int) -> None:
    """Prints a line at each tenth."""
    if done * 10 // count > (done - 1) * 10 // count:
        print(f"{done} of {count} drives", file=sys.stderr, flush=True)


@dataclasses.dataclass(frozen=True)
class Summary:
    """A method in a row after the last minute; angles in deg, NaN without a value."""

    row: str
    method: str
    drives: int
    answered: float  # share with a value
    valid: float  # share called valid
    median: float  # |error| of all with a value
    p95: float
    largest: float
    valid_median: float  # of the valid ones
    valid_p95: float
    valid_largest: float
    intervals: int  # drives with a ci95
    covered: int  # number of those that contain the truth
    coverage: float  # share
    half_width: float  # median
    of_floor: float  # median of half-width over floor
    minutes_to_1_deg: float  # median; inf: never
    minutes_to_half_deg: float
    ns_per_sample: float


def summarise(table: pl.DataFrame) -> list[Summary]:
    """The summaries by row and method, in the order of the table."""
    return [
        _summary(str(row), str(method), part)
        for (row, method), part in table.group_by("row", "method", maintain_order=True)
    ]


def _summary(row: str, method: str, part: pl.DataFrame) -> Summary:
    signed = np.array(part["error_deg"].to_list(), float)
    error, of_middle = np.abs(signed), np.abs(signed[:, -1] + part["lean_deg"].to_numpy())
    half_width = 1.96 * np.array(part["sd_deg"].to_list(), float)[:, -1]
    valid = np.array(part["valid"].to_list(), bool)[:, -1]
    last = error[:, -1]
    says = np.isfinite(last)
    has_interval = says & np.isfinite(half_width)
    good = last[valid & says]
    covered = int(np.sum(of_middle[has_interval] <= half_width[has_interval]))
    median, p95, largest = _quantiles(last[says])
    valid_median, valid_p95, valid_largest = _quantiles(good)
    to_1_deg, to_half_deg = (
        float(np.median([minutes_until_below(course, bound) for course in error])) for bound in BOUNDS_DEG
    )
    any_interval = bool(has_interval.any())
    return Summary(
        row=row,
        method=method,
        drives=len(last),
        answered=float(np.mean(says)),
        valid=float(np.mean(valid)),
        median=median,
        p95=p95,
        largest=largest,
        valid_median=valid_median,
        valid_p95=valid_p95,
        valid_largest=valid_largest,
        intervals=int(has_interval.sum()),
        covered=covered,
        coverage=covered / int(has_interval.sum()) if any_interval else np.nan,
        half_width=float(np.median(half_width[has_interval])) if any_interval else np.nan,
        of_floor=float(np.median((half_width / part["floor_deg"].to_numpy())[has_interval]))
        if any_interval
        else np.nan,
        minutes_to_1_deg=to_1_deg,
        minutes_to_half_deg=to_half_deg,
        ns_per_sample=float(np.median(part["ns_per_sample"].to_numpy())),
    )


def _quantiles(values: Array) -> tuple[float, float, float]:
    if not len(values):
        return np.nan, np.nan, np.nan
    return float(np.median(values)), float(np.quantile(values, 0.95)), float(values.max())


def minutes_until_below(error_deg: Array, bound_deg: float) -> float:
    """The first minute from whose end on the error stays below the bound; infinite if there is none."""
    below = error_deg < bound_deg  # false for NaN as well
    if not below[-1]:
        return NEVER_MIN
    return float(len(below) - np.argmin(below[::-1]) + 1 if not below.all() else 1)


def print_table(summaries: Sequence[Summary]) -> None:
    print(
        f"{'row':20}{'method':12}{'n':>4}{'says':>5}{'valid':>6} |{'med':>6}{'p95':>7}{'max':>7} |"
        f"{'v.med':>6}{'v.p95':>7}{'v.max':>7} |{'cover':>6}{'half':>6}{'/floor':>7} |{'1deg':>5}{'.5deg':>6}{'ns':>6}"
    )
    for s in summaries:
        print(
            f"{s.row:20}{s.method:12}{s.drives:4}{s.answered:5.0%}{s.valid:6.0%} |"
            f"{s.median:6.2f}{s.p95:7.2f}{s.largest:7.2f} |"
            f"{s.valid_median:6.2f}{s.valid_p95:7.2f}{s.valid_largest:7.2f} |"
            f"{s.coverage:6.0%}{s.half_width:6.2f}{s.of_floor:7.2f} |"
            f"{s.minutes_to_1_deg:5.0f}{s.minutes_to_half_deg:6.0f}{s.ns_per_sample:6.0f}"
        )


def print_refusals(table: pl.DataFrame) -> None:
    """Missing answers, once per row and method, with the text of the first."""
    refused = table.filter(pl.col("refusal") != "").group_by("row", "method", maintain_order=True)
    for row, method, count, words in refused.agg(pl.len(), pl.col("refusal").first()).iter_rows():
        print(f"{row}: {method} gives no answer for {count} drives: {words}", file=sys.stderr)


def keep(table: pl.DataFrame, summaries: Sequence[Summary], name: str, settings: Record) -> None:
    """Writes every drive as Parquet, and the summary with its parameters as JSON."""
    BUILD.mkdir(parents=True, exist_ok=True)
    table.write_parquet(BUILD / f"{name}.parquet")
    numbers = [
        {k: None if isinstance(v, float) and not np.isfinite(v) else v for k, v in dataclasses.asdict(s).items()}
        for s in summaries
    ]
    priors = {prior: str(distribution) for prior, (distribution, _) in PRIORS.items()}
    text = json.dumps({"settings": settings, "priors": priors, "rows": numbers}, indent=1, ensure_ascii=False)
    (BUILD / f"{name}.json").write_text(text, encoding="utf-8")


def names_of(text: str, known: Sequence[str], what: str) -> list[str]:
    """The names in a comma-separated list; all for an empty one. Exits on an unknown name."""
    names = text.split(",") if text else list(known)
    unknown = [name for name in names if name not in known]
    if unknown:
        sys.exit(f"no {what} {', '.join(unknown)}; available are {', '.join(known)}")
    return names


def methods_of(text: str, own: Sequence[str]) -> list[str]:
    """The methods of this list, by default oncenter's and the rivals, which need numba; then the own ones.

    Raises:
        RivalError: one of them cannot run.
    """
    methods = names_of(text, [*METHODS, *NAMES], "method")
    compiled = [name for name in methods if name in NAMES]
    if compiled and find_spec("numba") is None:
        needs = f"{', '.join(compiled)} need numba, which is not installed: pip install numba"
        if text:
            raise RivalError(needs)
        print(f"without the rivals of the bench: {needs}", file=sys.stderr)
        methods = [name for name in methods if name not in NAMES]
    for name in own:
        if ":" not in name:
            raise RivalError(f"--rival takes module:function, got {name}")
        rival(name)
    return [*methods, *own]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drives", type=int, default=60, help="of each row (60)")
    parser.add_argument("--rows", default="", help="names separated by commas; default: all")
    parser.add_argument("--methods", default="", help="names separated by commas; default: all")
    parser.add_argument(
        "--rival",
        action="append",
        default=[],
        metavar="MODULE:FUNCTION",
        help="your own estimator; more than one possible",
    )
    parser.add_argument("--jobs", type=int, default=1, help="processes (1)")
    parser.add_argument("--tuning", action="store_true", help="seeds from 1 on instead of the reported ones")
    parser.add_argument("--page", action="store_true", help="write docs/accuracy.md and docs/accuracy.png")
    given = parser.parse_args()
    rows = names_of(given.rows, list(ROWS), "row")
    if given.page and (given.tuning or given.rows or given.methods or given.rival or find_spec("numba") is None):
        parser.error("--page reports all rows and methods, on the seeds for it, and needs numba")
    try:
        compare(given, rows, methods_of(given.methods, given.rival))
    except RivalError as error:
        sys.exit(str(error))


def compare(given: argparse.Namespace, rows: Sequence[str], methods: Sequence[str]) -> None:
    """Runs, prints and keeps the comparison."""
    first = TUNING_FROM if given.tuning else REPORTED_FROM
    seeds = range(first, first + given.drives)
    table = run(rows, seeds, methods, given.jobs)
    summaries = summarise(table)
    print_refusals(table)
    print_table(summaries)
    settings = {"rows": rows, "methods": methods, "first_seed": first, "drives": given.drives}
    keep(table, summaries, "tuning" if given.tuning else "reported", settings)
    if given.page:
        from accuracy_page import write_page

        write_page(table, summaries, seeds)


if __name__ == "__main__":
    main()
