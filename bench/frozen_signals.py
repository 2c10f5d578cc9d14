"""Signals that are frozen, reversed, doubled, noisy or swapped from some time on: desk, `Monitor` and C compared.

    python bench/frozen_signals.py [--kinds a,b] [--drives N] [--seeds tuning|reported] [--jobs N] [--smoke]

Each of N drives has one fault after another, from the start, from a third and from two thirds of it on. The desk
answers by `oncenter.offset`, `oncenter.Monitor` takes the ticks one by one, and C is `oc_run` with `oc_answer_get`.
Asked: all three end with the same status and reason, and at most 2 of 144 are valid, outside their interval and off by
more than 0.5 deg. All records go to build/accuracy/frozen_signals.json.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import multiprocessing
import sys
import tempfile
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from accuracy import BUILD, REPORTED_FROM, TUNING_FROM, names_of
from said import OFF_DEG

import oncenter as oc
from oncenter import _core
from oncenter.errors import OncenterError
from oncenter.signals import DEGREE, Signals
from oncenter.vehicle import core_of

sys.path.append(str(Path(__file__).parents[1] / "tests"))

from healthy_drive import ANGLE, LATERAL, SPEED, TRUCK, YAW_RATE, Array, healthy_drive

Record = dict[str, Any]
Columns = Mapping[str, Array]
Random = np.random.Generator

RATE_HZ = 50.0  # half of the drives': the monitor steps in Python
FROM = {"start": 0.0, "a third": 1.0 / 3.0, "two thirds": 2.0 / 3.0}
WRONG_MAX = 2  # of 12 kinds, 4 drives and 3 times
_REASONS = ("fault", "suspect", "signal")  # in the names of what an output says beside its status
NOISE = {ANGLE: 10.0 * DEGREE, YAW_RATE: 5.0 * DEGREE}  # standard deviations of a field of other bits


def frozen(column: str) -> Callable[[Columns, int, Random], Columns]:
    return lambda columns, at, random: {column: np.full(len(columns[column]), columns[column][at])}


def scaled(column: str, factor: float) -> Callable[[Columns, int, Random], Columns]:
    return lambda columns, at, random: {column: factor * columns[column]}


def noisy(column: str) -> Callable[[Columns, int, Random], Columns]:
    return lambda columns, at, random: {column: NOISE[column] * random.standard_normal(len(columns[column]))}


def swapped(one: str, other: str) -> Callable[[Columns, int, Random], Columns]:
    return lambda columns, at, random: {one: columns[other], other: columns[one]}


KINDS: Mapping[str, Callable[[Columns, int, Random], Columns]] = {
    "angle frozen": frozen(ANGLE),
    "yaw rate frozen": frozen(YAW_RATE),
    "speed frozen": frozen(SPEED),
    "lateral acceleration frozen": frozen(LATERAL),
    "angle reversed": scaled(ANGLE, -1.0),
    "yaw rate reversed": scaled(YAW_RATE, -1.0),
    "lateral acceleration reversed": scaled(LATERAL, -1.0),
    "angle doubled": scaled(ANGLE, 2.0),
    "yaw rate doubled": scaled(YAW_RATE, 2.0),
    "angle noisy": noisy(ANGLE),
    "yaw rate noisy": noisy(YAW_RATE),
    "yaw rate and lateral acceleration swapped": swapped(YAW_RATE, LATERAL),
}
NONE = "none"


def spoiled(signals: Signals, kind: str, share: float, seed: int) -> Signals:
    """The drive whose signals are others from that share of it on."""
    if kind == NONE:
        return signals
    columns, at = signals.columns, int(share * signals.ticks)
    new = KINDS[kind](columns, at, np.random.default_rng([seed, zlib.crc32(kind.encode())]))
    later = np.arange(signals.ticks) >= at
    series = [pl.Series(name, np.where(later, values, columns[name])) for name, values in new.items()]
    return dataclasses.replace(signals, table=signals.table.with_columns(series))


@dataclasses.dataclass(frozen=True)
class End:
    """Where a drive ends: value and half-width in deg, NaN without one; the reasons by name."""

    status: str
    value: float = math.nan
    half_width: float = math.nan
    reasons: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    first: str = ""  # the first finding or reason in words

    def is_wrong(self, true_deg: float) -> bool:
        error = abs(self.value - true_deg)
        return self.status == "valid" and error > OFF_DEG and error > self.half_width


def _reasons(values: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: value
        for name, value in values.items()
        if any(word in name for word in _REASONS) and isinstance(value, str | tuple | bool | None)
    }


def at_the_desk(signals: Signals) -> End:
    try:
        answer = oc.offset(signals, oc.vehicle(TRUCK))
    except OncenterError as error:
        return End(error.code)
    value, half_width = answer.offset.value, answer.offset_half_width_rad
    found = [finding.code for finding in answer.findings if finding.severity == "error"]
    reasons = _reasons({each.name: getattr(answer, each.name) for each in dataclasses.fields(answer)})
    if value is None or half_width is None:
        return End(answer.offset.status, reasons=reasons, first=found[0] if found else "")
    return End(answer.offset.status, value / DEGREE, half_width / DEGREE, reasons, found[0] if found else "")


def by_monitor(signals: Signals) -> End:
    names = [each.name for each in dataclasses.fields(oc.Tick)]
    columns = [signals.columns[name].tolist() if name in signals.columns else None for name in names]
    given = [name for name, column in zip(names, columns, strict=True) if column is not None]
    monitor = oc.Monitor(oc.vehicle(TRUCK), signals.rate_hz)
    for row in zip(*(column for column in columns if column is not None), strict=True):
        now = monitor.step(oc.Tick(**dict(zip(given, row, strict=True))))
    reasons = _reasons(dataclasses.asdict(now)) | {"reasons": now.reasons}
    if now.offset_rad is None or now.offset_drive_sd_rad is None:
        return End(now.offset_status, reasons=reasons)
    half_width = 1.96 * now.offset_drive_sd_rad / DEGREE
    return End(now.offset_status, now.offset_rad / DEGREE, half_width, reasons)


def by_c(signals: Signals) -> End:
    core = core_of(oc.vehicle(TRUCK), signals.rate_hz, method="joint", params=None)
    outputs = np.zeros(signals.ticks, _core.OUTPUT_DTYPE)
    core.run({name: signals.columns[name] for name in _core.COLUMNS if name in signals.columns}, outputs)
    answer, last = core.answer(), outputs[-1]
    value, half_width = answer["offset"]["value"], 1.96 * answer["offset_parts"]["drive_sd"]
    of_tick = tuple(name for name, bit in _core.REASONS.items() if int(last["reasons"]) & bit)
    reasons = {"sensor_fault": _core.FAULTS[last["fault"]], "reasons": of_tick}
    return End(_core.status_of(answer["offset"]), value / DEGREE, half_width / DEGREE, reasons)


ENDS = {"desk": at_the_desk, "monitor": by_monitor, "C": by_c}


def records(seed: int, kinds: Sequence[str], minutes: float) -> list[Record]:
    """All kinds of one drive at all times; the kind "none" once."""
    with tempfile.TemporaryDirectory() as folder:
        drive = healthy_drive(seed, Path(folder), minutes=minutes)
    signals = dataclasses.replace(drive.signals, table=drive.signals.table.gather_every(2), rate_hz=RATE_HZ)
    wanted = [(kind, since) for kind in kinds for since in (FROM if kind != NONE else ("start",))]
    return [
        _record(spoiled(signals, *_at(kind, since), seed), kind, since, seed, drive.offset_deg)
        for kind, since in wanted
    ]


def _at(kind: str, since: str) -> tuple[str, float]:
    return kind, FROM[since]


def _record(signals: Signals, kind: str, since: str, seed: int, true_deg: float) -> Record:
    ends = {name: end(signals) for name, end in ENDS.items()}
    return {
        "kind": kind,
        "from": since,
        "seed": seed,
        "true": true_deg,
        "ends": {name: dataclasses.asdict(end) for name, end in ends.items()},
        "wrong": [name for name, end in ends.items() if end.is_wrong(true_deg)],
        "same_status": len({end.status for end in ends.values()}) == 1,
        "same_reason": _agree([end.reasons for end in ends.values()]),
    }


def _agree(reasons: Sequence[Mapping[str, Any]]) -> bool:
    """Whether all that have a reason of the same name give it the same value."""
    names = {name for each in reasons for name in each}
    return all(len({str(each[name]) for each in reasons if name in each}) == 1 for name in names)


def run_all(kinds: Sequence[str], seeds: Sequence[int], minutes: float, jobs: int) -> list[Record]:
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        waiting = [pool.submit(records, seed, kinds, minutes) for seed in seeds]
        return [record for future in waiting for record in future.result()]


def lines(found: Sequence[Record]) -> Iterator[str]:
    yield "| signal | cases | desk wrong | monitor wrong | C wrong | same status | same reason | desk / monitor / C |"
    yield "|---|--:|--:|--:|--:|--:|--:|---|"
    faulty = [record for record in found if record["kind"] != NONE]
    for kind in dict.fromkeys(record["kind"] for record in found):
        yield _line(kind, [record for record in found if record["kind"] == kind])
    yield _line("all", faulty)
    yield ""
    for name in ENDS:
        yield f"valid and wrong, {name}: {sum(name in record['wrong'] for record in faulty)} of {len(faulty)}" + (
            f" (asked: at most {WRONG_MAX} of 144)"
        )


def _line(kind: str, some: Sequence[Record]) -> str:
    wrong = [sum(name in record["wrong"] for record in some) for name in ENDS]
    same = [sum(record[key] for record in some) for key in ("same_status", "same_reason")]
    statuses = [sorted(record["ends"][name]["status"] for record in some) for name in ENDS]
    said = " / ".join(", ".join(f"{each} {of.count(each)}" for each in dict.fromkeys(of)) for of in statuses)
    return f"| {kind} | {len(some)} | {' | '.join(map(str, (*wrong, *same)))} | {said} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kinds", default="", help="names separated by commas; default: all")
    parser.add_argument("--drives", type=int, default=4, help="each with all kinds at all times (4)")
    parser.add_argument(
        "--seeds", choices=("tuning", "reported"), default="reported", help="from 1 on, or from 1001 on"
    )
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--smoke", action="store_true", help="one drive of 3 minutes: whether the bench runs")
    given = parser.parse_args()
    first = TUNING_FROM if given.seeds == "tuning" else REPORTED_FROM
    seeds = range(first, first + (1 if given.smoke else given.drives))
    kinds = names_of(given.kinds, [NONE, *KINDS], "kind")
    found = run_all(kinds, seeds, 3.0 if given.smoke else 20.0, given.jobs)
    BUILD.mkdir(parents=True, exist_ok=True)
    (BUILD / "frozen_signals.json").write_text(json.dumps(found, indent=1), encoding="utf-8")
    print("\n".join(lines(found)))


if __name__ == "__main__":
    main()
