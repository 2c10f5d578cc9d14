"""A truck that changes between two drives, or within one: whether the combined answer holds.

    python bench/drives_that_differ.py [--parts tyres,slips] [--trucks N] [--jobs N] [--tuning] [--page | --smoke]

The parts: `tyres` (other radii in one log, the logs as files, and as ignitions of one core over save and restore),
`puncture`, `quantities` (each that a drive identifies, by its spread in core/between_drives.toml and by three times
that), `zeros` (sensors that are relative, remounted or healthy), `slips` (in one drive), `flanks` (drives that loaded
one flank each), and `plays` (repaired or worn between two ignitions of one core). Seeds from 1001 on are for reporting,
those from 1 on (--tuning) for tuning.
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
import json
import math
import multiprocessing
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from accuracy import BUILD, REPORTED_FROM, TUNING_FROM, names_of
from accuracy_rows import Drive, Row, as_toml, drive, laid_over, vehicle_file
from population import CROWN_M_S2, PERCENT_PER_M_S2, PRIORS, Normal
from sections import between
from truck_drives import CROWN_OF_REGION, OF_DRIVE, OF_TRUCK, ROADS

import oncenter as oc
from oncenter import _core
from oncenter.offset.inputs import params_of, track_widths
from oncenter.signals import DEGREE, Signals
from oncenter.simulate.scenario import read_scenario
from oncenter.tuned import BETWEEN_DRIVES
from oncenter.vehicle import Vehicle, core_of
from oncenter.verdict.states import TO_DO

Record = dict[str, Any]
Columns = Mapping[str, Callable[[np.ndarray[Any, Any]], np.ndarray[Any, Any]]]

LEFT = ("front_left", "rear_left")
WHEELS = {"left side": LEFT, "one wheel": ("rear_left",), "front axle": ("front_left", "front_right")}
LARGER_PERCENT, LAST_MIN, TYRE_SEEDS = (0.1, 0.3, 1.0), (5.0, 12.0, 30.0), 4
PAGE = Path(__file__).parents[1] / "docs" / "truck_over_time_figures.md"
BEGIN, END = (
    "<!-- drives that differ: written by bench/drives_that_differ.py --page -->",
    "<!-- drives that differ: end -->",
)


@dataclasses.dataclass(frozen=True)
class Truck:
    """One truck of the population, by its seed: `fixed` holds for all its drives."""

    seed: int
    fixed: Mapping[str, Any]

    def drive(
        self, k: int, folder: Path, *, minutes: float = 20.0, base: str = "", extra: Record | None = None
    ) -> Drive:
        """Its k-th drive; with `extra` in the scenario."""
        random = np.random.default_rng([self.seed, k, 53])
        chosen = base or str(random.choice(ROADS))
        values = laid_over({"drive": {"duration_s": 60.0 * minutes}}, extra or {})
        row = Row(f"truck{self.seed}_{k}", "", base=chosen, fixed=self.fixed, extra=lambda _: values, wind=True)
        return drive(row, 1000 * self.seed + k, folder)


def truck(seed: int, **fixed: Any) -> Truck:
    """Without a pull, which one drive cannot identify."""
    random = np.random.default_rng([seed, 5353])
    drawn: Record = {
        key: OF_TRUCK.get(key, prior).draw(random) for key, (prior, _) in PRIORS.items() if key not in OF_DRIVE
    }
    drawn |= {"pull_m_s2": 0.0, "pull_n": 0.0}
    drawn["crown_percent"] = Normal(CROWN_OF_REGION.draw(random), CROWN_OF_REGION.sd)
    return Truck(seed, drawn | fixed)


def thesis_drive(seed: int, folder: Path, minutes: float) -> tuple[Signals, Vehicle, float]:
    """The shipped scenario with its own truck and sensors, and its offset, rad."""
    file = folder / f"thesis_{seed}.toml"
    file.write_text(as_toml({"base": "thesis_drive", "drive": {"duration_s": 60.0 * minutes}}), encoding="utf-8")
    signals, truth = oc.simulate(file, seed)
    vehicle = vehicle_file(Row("thesis", ""), read_scenario(file).truck, truth, np.random.default_rng(seed))
    return signals, vehicle, truth.offset_rad + truth.straight_ahead_rad


def changed(signals: Signals, columns: Columns) -> Signals:
    """The signals with other columns; each function gets the old one."""
    new = {name: pl.Series(to(signals.table[name].to_numpy())) for name, to in columns.items()}
    return dataclasses.replace(signals, table=signals.table.with_columns(**new))


def cut(signals: Signals, minutes: float) -> Signals:
    return dataclasses.replace(signals, table=signals.table.head(round(60.0 * minutes * signals.rate_hz)))


def named(signals: Signals, name: str) -> Signals:
    return dataclasses.replace(signals, log=name)


def larger(signals: Signals, wheels: Sequence[str], percent: float) -> Signals:
    """Larger wheels turn more slowly."""
    return changed(signals, {f"wheel_speed_{wheel}_m_s": lambda v: v / (1.0 + percent / 100.0) for wheel in wheels})


def judged(answer: oc.Answer, target: float) -> Record:
    """Of the drives' own interval; deg."""
    value, half_width = answer.offset.value, answer.offset_half_width_rad
    said: Record = {"status": answer.offset.status, "zero": answer.zero}
    said["codes"] = [finding.code for finding in answer.findings]
    said["states"] = {verdict.about: verdict.state for verdict in oc_verdicts(answer)}
    if value is None or half_width is None:
        return said | {"error": math.nan, "half_width": math.nan, "holds": False}
    error, half = (value - target) / DEGREE, half_width / DEGREE
    return said | {"error": error, "half_width": half, "holds": abs(error) < half}


def oc_verdicts(answer: oc.Answer) -> Sequence[Any]:
    from oncenter.verdict import verdicts_of

    return verdicts_of(answer)


def target_of(driven: Drive) -> float:
    """rad: the offset and the effect of the pull, which one drive cannot identify. A mean wind has none: it moves both
    flanks along the lateral acceleration, and the reading between them stays."""
    pull_m_s2 = driven.truth.unloading_acceleration_m_s2
    return float(driven.target_rad[-1]) + driven.angle_per_m_s2 * (0.0 if math.isnan(pull_m_s2) else pull_m_s2)


def one_hour(_before: Signals, _after: Signals) -> float:
    return 3600.0


def over_ignitions(
    logs: Sequence[Signals], vehicle: Vehicle, off_s: Callable[[Signals, Signals], float] = one_hour
) -> Iterator[Record]:
    """The answer after each log by one core that is saved, restored and started again before each.

    `off_s`: s without ignition between two logs.
    """
    params = params_of(vehicle, None)
    widths = track_widths(vehicle, "joint", logs)
    image = b""
    for k, log in enumerate(logs):
        core = core_of(vehicle, log.rate_hz, method="joint", params=params, track_widths=widths)
        if image:
            assert core.restore(image)[0] == "ok"
            core.restart(off_s(logs[k - 1], log))
        core.run({name: log.columns[name] for name in _core.COLUMNS if name in log.columns})
        image = core.save(1)
        yield dict(core.answer())


def by_ignitions(logs: Sequence[Signals], vehicle: Vehicle) -> tuple[float, float, str]:
    """Offset and its own standard deviation, rad, and status after the last one."""
    *_, answer = over_ignitions(logs, vehicle)
    return answer["offset"]["value"], answer["offset_parts"]["drive_sd"], _core.status_of(answer["offset"])


def tyres(seed: int, folder: Path) -> Iterator[Record]:
    drives = [thesis_drive(1000 * seed + k, folder, 30.0) for k in range(3)]
    _, vehicle, target = drives[0]
    for wheels, percent, minutes, count in itertools.product(WHEELS, LARGER_PERCENT, LAST_MIN, (2, 3)):
        for place in (0, count - 1):
            logs = [named(signals, f"log{k}") for k, (signals, _, _) in enumerate(drives[:count])]
            logs[place] = cut(larger(logs[place], WHEELS[wheels], percent), minutes)
            value, sd, status = by_ignitions(logs, vehicle)
            error, half_width = (value - target) / DEGREE, 1.96 * sd / DEGREE
            yield judged(oc.offset(logs, vehicle), target) | {
                "wheels": wheels,
                "percent": percent,
                "minutes": minutes,
                "core_status": status,
                "core_error": error,
                "core_half_width": half_width,
                "core_holds": abs(error) < half_width,
            }


def puncture(seed: int, folder: Path) -> Iterator[Record]:
    """One wheel loses 1 % of its radius in an hour, from the fifth minute on."""
    driven = truck(seed).drive(0, folder, minutes=30.0)
    wheel = str(np.random.default_rng(seed).choice(["front_left", "front_right", "rear_left", "rear_right"]))
    time = driven.signals.table["time_s"].to_numpy()
    shrinks = 1.0 - 0.01 * np.maximum(time - 300.0, 0.0) / 3600.0
    leaking = changed(driven.signals, {f"wheel_speed_{wheel}_m_s": lambda v: v / shrinks})
    answer = oc.offset(leaking, driven.vehicle)
    names = any("tyre pressures" in finding.text for finding in answer.findings)
    yield judged(answer, target_of(driven)) | {"wheel": wheel, "names_pressure": names}


def quantities(seed: int, folder: Path) -> Iterator[Record]:
    """Three drives, the last of them after one quantity has changed."""
    one = truck(seed)
    random = np.random.default_rng([seed, 1])
    sign = {name: float(random.choice([-1.0, 1.0])) for name in BETWEEN_DRIVES}
    drives = [one.drive(k, folder) for k in range(2)]
    for name, times in [(n, t) for n in SIMULATED for t in ((1.0,) if n in ONE_SPREAD else (1.0, 3.0))]:
        at_ignition = params_of(drives[0].vehicle, None)["gyro_bias_ignition_sd_rad_s"]
        size = sign[name] * times * (BETWEEN_DRIVES[name][0] or (0.05 if name == "PULL" else at_ignition))
        if name in OF_SIGNALS:
            last = one.drive(2, folder)
            logs = [d.signals for d in drives] + [OF_SIGNALS[name](last.signals, size)]
            moved = size if name == "OFFSET" else 0.0
        else:
            fixed = {key: value + size * unit for key, value, unit in _of_truck(name, one.fixed)}
            last = Truck(one.seed, dict(one.fixed) | fixed).drive(2, folder)
            logs, moved = [*(d.signals for d in drives), last.signals], 0.0
        named_logs = [named(log, f"log{k}") for k, log in enumerate(logs)]
        target = float(np.mean([target_of(d) for d in (*drives, last)])) + moved / (3.0 if moved else 1.0)
        yield judged(oc.offset(named_logs, last.vehicle), target) | {"quantity": name, "times": times}


# Of BETWEEN_DRIVES all but the wheelbase, which is the load's beside the gradient.
SIMULATED = ("OFFSET", "WHEEL_RADIUS", "YAW_RATE_BIAS", "ACCELEROMETER_ZERO", "PULL", "GRADIENT", "CROWN", "PLAY")
ONE_SPREAD = ("PULL", "ACCELEROMETER_ZERO")
OF_SIGNALS: Mapping[str, Callable[[Signals, float], Signals]] = {
    "OFFSET": lambda s, size: changed(s, {"steering_wheel_angle_rad": lambda v: v + size}),
    "WHEEL_RADIUS": lambda s, size: larger(s, LEFT, 100.0 * size),
    "YAW_RATE_BIAS": lambda s, size: changed(s, {"yaw_rate_rad_s": lambda v: v + size}),
    "ACCELEROMETER_ZERO": lambda s, size: changed(s, {"lateral_acceleration_m_s2": lambda v: v + size}),
}


def _of_truck(name: str, fixed: Mapping[str, Any]) -> list[tuple[str, Any, float]]:
    """Name, value, and units of the scenario per unit of the quantity."""
    if name == "GRADIENT":
        gradient = float(fixed["understeer_gradient_deg_m_s2"])
        return [("understeer_gradient_deg_m_s2", max(gradient, 0.45), 1.0 / DEGREE)]
    if name == "PLAY":
        return [("backlash_deg", max(float(fixed["backlash_deg"]), 3.0), 1.0 / DEGREE)]
    if name == "CROWN":
        return [("crown_percent", CROWN_M_S2 * PERCENT_PER_M_S2, PERCENT_PER_M_S2)]
    return [("pull_m_s2", 0.0, 1.0)]


def zeros(seed: int, folder: Path) -> Iterator[Record]:
    """Eight drives of 20 minutes: as they are, remounted once, another zero at each start, declared or not."""
    one = truck(seed)
    random = np.random.default_rng([seed, 2])
    drives = [one.drive(k, folder) for k in range(8)]
    vehicle = drives[0].vehicle
    at, step = int(random.integers(2, 7)), float(random.choice([-1.0, 1.0]) * random.uniform(2.0, 8.0)) * DEGREE
    starts = random.normal(0.0, 6.0 * DEGREE, len(drives))
    kinds = {
        "healthy": np.zeros(len(drives)),
        "remounted": np.where(np.arange(len(drives)) >= at, step, 0.0),
        "relative": starts,
        "relative, declared": starts,
    }
    for kind, moved in kinds.items():
        logs = [
            named(changed(d.signals, {"steering_wheel_angle_rad": lambda v, by=by: v + by}), f"log{k}")
            for k, (d, by) in enumerate(zip(drives, moved, strict=True))
        ]
        if kind == "relative, declared":
            logs = [
                dataclasses.replace(log, table=log.table.with_columns(steering_wheel_angle_sensor_type=pl.lit(0.0)))
                for log in logs
            ]
        answer = oc.offset(logs, vehicle)
        target = target_of(drives[-1]) + float(moved[-1])
        found = any(c.log == f"log{at}" for c in answer.changes)
        yield judged(answer, target) | {"kind": kind, "found": found}


def slips(seed: int, folder: Path) -> Iterator[Record]:
    """A drive of 24 minutes whose sensor slips 4 or 8 times by 0.5 to 1.5 deg, all to one side."""
    one = truck(seed)
    random = np.random.default_rng([seed, 3])
    driven = one.drive(0, folder, minutes=24.0)
    time = driven.signals.table["time_s"].to_numpy()
    for count in (0, 1, 4, 8):
        at = np.sort(random.uniform(120.0, 1320.0, count))
        size = random.uniform(0.5, 1.5, count) if count != 1 else np.full(1, random.uniform(2.0, 6.0))
        by = random.choice([-1.0, 1.0]) * DEGREE * (size[None, :] * (time[:, None] >= at[None, :])).sum(axis=1)
        slipped = changed(driven.signals, {"steering_wheel_angle_rad": lambda v, by=by: v + by})
        answer = oc.offset(slipped, driven.vehicle)
        yield judged(answer, target_of(driven) + float(by[-1])) | {"slips": count, "end": float(by[-1]) / DEGREE}


def flanks(seed: int, folder: Path) -> Iterator[Record]:
    """Six logs of five minutes, of which every second one has little lateral force to the left, the others to the
    right."""
    one = truck(seed)
    drives = [one.drive(k, folder, minutes=30.0) for k in range(6)]
    logs = [named(one_sided(driven.signals, (-1.0) ** k), f"log{k}") for k, driven in enumerate(drives)]
    target = float(np.mean([target_of(driven) for driven in drives]))
    yield judged(oc.offset(logs, drives[0].vehicle), target)


PLAYS_DEG, BEFORE, AFTER = (0.0, 3.0, 8.0, 15.0), (1, 4), 2


def plays(seed: int, folder: Path) -> Iterator[Record]:
    """Drives of 15 minutes before and after an ignition, at which the play changes or not."""
    count = max(BEFORE) + AFTER
    drives = {
        play: [truck(seed, backlash_deg=play).drive(k, folder, minutes=15.0) for k in range(count)]
        for play in PLAYS_DEG
    }
    for before, after, first in itertools.product(PLAYS_DEG, PLAYS_DEG, BEFORE):
        chain = [*drives[before][:first], *drives[after][-AFTER:]]
        answers = list(over_ignitions([driven.signals for driven in chain], chain[-1].vehicle))
        said = [of_play(answer, driven) for answer, driven in zip(answers, chain, strict=True)][first:]
        valid = [k + 1 for k, one in enumerate(said) if one["status"] == "valid"]
        for k, one in enumerate(said):
            kind = f"{'stays' if before == after else 'changes'} at an ignition, drive {k + 1} after it"
            yield one | {"kind": kind, "first_valid": min(valid, default=None)}


def of_play(answer: Record, driven: Drive) -> Record:
    """Offset by its own interval, and play; deg."""
    error = (answer["offset"]["value"] - target_of(driven)) / DEGREE
    half_width = 1.96 * answer["offset_parts"]["drive_sd"] / DEGREE
    truth = driven.truth.backlash_rad + driven.truth.windup_rad
    beyond = abs(answer["backlash"]["value"] - truth) - 1.96 * answer["backlash"]["standard_deviation"]
    return {
        "status": _core.status_of(answer["offset"]),
        "error": error,
        "half_width": half_width,
        "holds": abs(error) < half_width,
        "play_status": _core.status_of(answer["backlash"]),
        "play_wrong": beyond > 1.0 * DEGREE,
    }


def one_sided(signals: Signals, side: float) -> Signals:
    """The five minutes whose lateral force is most of all to that side, 1 left."""
    force = side * (signals.table["lateral_acceleration_m_s2"].to_numpy() - CROWN_M_S2)
    moves = signals.table["vehicle_speed_m_s"].to_numpy() > 10.0
    there, back = (np.cumsum(moves & (sign * force > 0.3)) for sign in (1.0, -1.0))
    length = round(300.0 * signals.rate_hz)
    begins = np.arange(0, len(force) - length, 3000)
    excess = [(there[b + length] - there[b]) - 5.0 * (back[b + length] - back[b]) for b in begins]
    return dataclasses.replace(signals, table=signals.table.slice(int(begins[int(np.argmax(excess))]), length))


PARTS: Mapping[str, Callable[[int, Path], Iterator[Record]]] = {
    "tyres": tyres,
    "puncture": puncture,
    "quantities": quantities,
    "zeros": zeros,
    "slips": slips,
    "flanks": flanks,
    "plays": plays,
}


def records(part: str, seed: int) -> list[Record]:
    with tempfile.TemporaryDirectory() as folder:
        return [{"part": part, "seed": seed, **said} for said in PARTS[part](seed, Path(folder))]


def run(parts: Sequence[str], seeds: Mapping[str, range], jobs: int) -> dict[str, list[Record]]:
    wanted = [(part, seed) for part in parts for seed in seeds[part]]
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        done = list(pool.map(records, *zip(*wanted, strict=True)))
    return {part: [r for (p, _), some in zip(wanted, done, strict=True) for r in some if p == part] for part in parts}


def lines(found: Mapping[str, Sequence[Record]]) -> Iterator[str]:
    """The page's table."""
    yield "| what differs | cases | held | error, median | largest of the valid | half-width, median | valid | named |"
    yield "|---|--:|--:|--:|--:|--:|--:|---|"
    for part, records_of in found.items():
        for name, some, said in _groups(part, records_of):
            yield _line(name, some, said)


def _groups(part: str, all_of: Sequence[Record]) -> Iterator[tuple[str, list[Record], str]]:
    """Name, records, and what is said of them."""
    key = {"tyres": "percent", "quantities": "quantity", "zeros": "kind", "plays": "kind", "slips": "slips"}.get(part)
    for value in dict.fromkeys(record.get(key) if key else part for record in all_of):
        some = [record for record in all_of if not key or record[key] == value]
        if part == "tyres":
            core = sum(record["core_holds"] for record in some)
            accused = sum(any(state in TO_DO for state in record["states"].values()) for record in some)
            yield (
                f"tyres, {value:g} %",
                some,
                f"a sensor or the play in {accused}; one core over its ignitions holds {core}",
            )
        elif part == "quantities":
            times = sorted({record["times"] for record in some})
            parts = [(t, [record["holds"] for record in some if record["times"] == t]) for t in times]
            said = ", ".join(f"{sum(holds)} of {len(holds)} at {t:g} spread" for t, holds in parts)
            yield f"{str(value).lower().replace('_', ' ')} between two of three drives", some, said
        elif part == "zeros":
            relative, moving = (sum(record["zero"] == zero for record in some) for zero in ("relative", "moves"))
            found_in = sum(record["found"] for record in some)
            of_step = f", its step found in {found_in}" if value == "remounted" else ""
            yield f"eight drives, {value}", some, f"relative {relative}, moving {moving}{of_step}"
        elif part == "slips":
            yield f"{value} slips in a drive", some, f"moving {sum(record['zero'] == 'moves' for record in some)}"
        elif part == "plays":
            valid_plays = [record["play_wrong"] for record in some if record["play_status"] == "valid"]
            yield f"the play {value}", some, f"play valid {len(valid_plays)}, of these wrong {sum(valid_plays)}"
        elif part == "puncture":
            outside = sum(record["status"] == "valid" and not record["holds"] for record in some)
            named = sum(record["names_pressure"] for record in some)
            yield "a wheel loses 1 % in an hour", some, f"the tyre pressures {named}; valid and outside {outside}"
        else:
            yield "six logs of 5 min, one flank each", some, ""


def _line(name: str, some: Sequence[Record], said: str) -> str:
    errors = np.array([abs(record["error"]) for record in some])
    widths = np.array([record["half_width"] for record in some])
    valid = np.array([record["status"] == "valid" for record in some])
    largest = f"{np.nanmax(errors[valid]):.2f}" if valid.any() else "-"
    return (
        f"| {name} | {len(some)} | {sum(record['holds'] for record in some)} | {np.nanmedian(errors):.2f} | {largest} |"
        f" {np.nanmedian(widths):.2f} | {int(valid.sum())} | {said} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", default="", help="names separated by commas; default: all")
    parser.add_argument("--trucks", type=int, default=60, help="of each part (60; tyres: 4)")
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--tuning", action="store_true", help="seeds from 1 on instead of the reported ones")
    parser.add_argument("--smoke", action="store_true", help="one truck, without the tyres: whether the bench runs")
    parser.add_argument("--page", action="store_true", help="write the section of docs/truck_over_time_figures.md")
    given = parser.parse_args()
    if given.page and (given.tuning or given.smoke or given.parts):
        parser.error("--page reports all parts on the seeds for it")
    first = TUNING_FROM if given.tuning else REPORTED_FROM
    parts = names_of(given.parts, list(PARTS), "part")
    if given.smoke:
        parts = [part for part in parts if part != "tyres"]
    trucks = 1 if given.smoke else given.trucks
    seeds = {part: range(first, first + (min(trucks, TYRE_SEEDS) if part == "tyres" else trucks)) for part in parts}
    found = run(parts, seeds, given.jobs)
    BUILD.mkdir(parents=True, exist_ok=True)
    (BUILD / "drives_that_differ.json").write_text(json.dumps(found, indent=1), encoding="utf-8")
    table = "\n".join(lines(found))
    print(table)
    if given.page:
        PAGE.write_text(between(PAGE.read_text(encoding="utf-8"), BEGIN, END, table), encoding="utf-8")


if __name__ == "__main__":
    main()
