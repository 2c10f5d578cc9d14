"""What each tuned constant of the core, each param and each pass does to the answers: which may go?

    python bench/sensitivity.py FOLDER RESULTS [--constants REGEX] [--together A+B] [--values 0,0.5,2] [--judges a,b]
                                [--drives N] [--seeds KIND] [--hours H] [--jobs N] [--show] [--sources] [--smoke]

Each constant of core/tuned.toml, each default of core/params.toml and the sd of each term of core/terms.toml is set to
nothing, half and twice, in a library in which they are variables; each pass of src/oncenter/offset is left out; and all
drives are answered again. The judges are rows of the accuracy and effects benches and of flanks.py; "scenario", the
shipped ones; "log", slow and noisy logs; "fault", drives with faults of sensors (sensor_faults.py); "wrong", drives
with a signal that is wrong throughout; "angle", lost, faulty and healthy angles; "file", logs with a fault of the file
(file_faults.py); "unknown", trucks without a vehicle file; "statement", those of wrong_statements.py. The drives stay
in FOLDER. A run goes on where the last one that wrote RESULTS ended. --show prints the table of all results, one line a
constant, and --sources writes it into the rows of core/tuned.toml that have no other source. Paired by drive, a row's
accuracy is worse where the error grows by more than 2.5 of its standard deviations and 0.02 deg.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import re
import signal
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[1] / "build" / "sensitivity" / "src"))  # before the installed package

from settable import PARAMS, PASSES, ROOT, TERMS, Settable, build

Record = dict[str, Any]
Setting = tuple[str, float]  # of a constant, as a multiple of its value
Array = np.ndarray[Any, Any]
# Rows whose drives differ in what the estimator needs, of each effect one size.
ROWS = (
    "ordinary no_play play_15_friction gyro_drift cross_wind bypass motorway country town yard nothing_shows_gyro "
    "lift_axle trailer_full windup active_return no_wheel_speeds no_accelerometer torque_pull kicks wrong_side "
    "remounted self_correction population effect_accelerometer_drift effect_relearning effect_pull_and_wind "
    "effect_wind_moment effect_fifth_wheel effect_tyres_in_the_sun effect_load_change effect_slippery_patches "
    "effect_minor_physics effect_resting_hand effect_stability_control_with_status "
    "effect_reverse_yard_with_status effect_tag_axle_yard_with_status effect_counter_phase_country_with_status "
    "seldom_mixed_right wide_motorway_right"
).split()
FAULTY_MIN = 12.0
LONGEST_S = 600  # of a setting
LOST_MAX, LOST_SHARE_MAX = 6, 0.05  # right answers, beyond which a setting is plainly worse
FIRST = 2  # drives of a judge that show whether a setting moves its answers at all
FAR_DEG, WORSE_DEG, WORSE_SDS = 1.0, 0.02, 2.5
ANGLE, YAW_RATE, SPEED = "steering_wheel_angle_rad", "yaw_rate_rad_s", "vehicle_speed_m_s"
LATERAL = "lateral_acceleration_m_s2"
WRONG_COLUMNS = (ANGLE, YAW_RATE, SPEED, LATERAL)
WRONG: Mapping[str, Callable[[Array, np.random.Generator], Array]] = {
    "reversed": lambda values, random: -values,
    "magnitude": lambda values, random: np.abs(values),
    "doubled": lambda values, random: 2.0 * values,
    "tenth": lambda values, random: 0.1 * values,
    "filled": lambda values, random: np.where(random.random(len(values)) < 0.1, 0.0, values),
    "late": lambda values, random: np.roll(values, 60),
    "noise": lambda values, random: random.normal(0.0, 0.5, len(values)),
    "other": lambda values, random: 0.3 * np.sin(np.arange(len(values)) / 333.0),
    "clipped": lambda values, random: np.clip(values, *np.quantile(values, (0.05, 0.95))),
}


@dataclass(frozen=True)
class Subject:
    """`ask` answers with the constants of the moment."""

    judge: str
    seed: int
    ask: Callable[[], Record]


def subjects(folder: Path, judges: set[str] | None, seeds: range) -> list[Subject]:
    """All drives of these judges, in memory, the first one of each judge first."""
    import flanks

    def wants(*words: str) -> bool:
        return judges is None or any(judge.startswith(words) for judge in judges)

    rows = ROWS if judges is None else sorted(judges & set(flanks.ALL))
    made = [Subject(row, seed, _of_row(folder, row, seed)) for row in rows for seed in seeds]
    made += [each for seed in seeds for each in _scenarios(seed)] if wants("scenario") else []
    made += [each for seed in seeds for each in _logs(folder, seed)] if wants("log") else []
    made += [each for seed in seeds for each in _faults(seed)] if wants("fault", "wrong") else []
    made += [each for seed in seeds for each in _angles(seed)] if wants("angle") else []
    made += [each for seed in seeds for each in _files(folder, seed)] if wants("file") else []
    made += [each for seed in seeds for each in _unknown(folder, seed)] if wants("unknown") else []
    made += [each for seed in seeds for each in _statements(folder, seed)] if wants("statement") else []
    of_all = [each for each in made if judges is None or {each.judge, each.judge.split(" ")[0]} & judges]
    return sorted(of_all, key=lambda each: (each.seed, each.judge))


def _answered(signals: Any, vehicle: Any, true_deg: float | None = None, pull_m_s2: float = 0.0) -> Record:
    from one_truck_drives import said_of

    import oncenter as oc

    try:
        answer = oc.offset(signals, vehicle)
    except oc.OncenterError as error:
        return {"status": error.code, "codes": [error.code]}
    return said_of(answer, true_deg, pull_m_s2)


def _of_row(folder: Path, row: str, seed: int) -> Callable[[], Record]:
    """Read anew each time: all drives together do not fit into the memory."""
    import flanks
    from one_truck_drives import Garage

    garage = Garage(folder / "effects" if row.startswith("effect_") else folder, seed)

    def ask() -> Record:
        driven = garage.of_row(flanks.ALL[row])
        return _answered(driven.signals, driven.vehicle, driven.offset_deg, driven.pull_m_s2)

    return ask


def _scenarios(seed: int) -> Iterator[Subject]:
    """The shipped scenarios: no other drive weaves."""
    import oncenter as oc

    for file in sorted((ROOT / "scenarios").glob("*.toml")):
        signals, truth = oc.simulate(file, seed=seed)
        ask = partial(_answered, signals, oc.vehicle("scania_r730_4x2"), math.degrees(truth.offset_rad))
        yield Subject(f"scenario {file.stem}", seed, ask)


def _logs(folder: Path, seed: int) -> Iterator[Subject]:
    """Slow and noisy logs."""
    import noisy_logs
    from one_truck_drives import Garage

    import oncenter as oc

    driven = Garage(folder / "logs", seed).scenario("heavy_play")
    for cell in (noisy_logs.Cell(20, 0.2), noisy_logs.Cell(10, 0.4, 0.1), noisy_logs.Cell(20, 0.2, holds=True)):
        signals = oc.from_dataframe(noisy_logs.recorded(driven, cell, seed))
        ask = partial(_answered, signals, driven.vehicle, driven.offset_deg, driven.pull_m_s2)
        yield Subject(f"log of {cell.name}", seed, ask)


def _faults(seed: int) -> Iterator[Subject]:
    """A healthy drive with one fault of a sensor after another, and with one signal wrong throughout."""
    import sensor_faults
    from healthy_drive import TRUCK, healthy_drive

    import oncenter as oc

    vehicle = oc.vehicle(TRUCK)
    with tempfile.TemporaryDirectory() as folder:
        drive = healthy_drive(seed, Path(folder), minutes=FAULTY_MIN)
    for name, fault in sensor_faults.FAULTS.items():
        if fault.column in drive.signals.table.columns:
            signals = sensor_faults.spoiled(drive.signals, name, seed)
            yield Subject(f"fault {name}", seed, partial(_answered, signals, vehicle))
    for column in WRONG_COLUMNS:
        for name, wrong in WRONG.items():
            values = wrong(drive.signals.table[column].to_numpy(), np.random.default_rng(seed))
            signals = replace(drive.signals, table=drive.signals.table.with_columns(pl.Series(column, values)))
            yield Subject(f"wrong {column} {name}", seed, partial(_answered, signals, vehicle))


def _angles(seed: int) -> Iterator[Subject]:
    """Ten minutes with the sensor and an hour without it, with faults of it, and with a healthy one."""
    from angle_drives import LEARNING_S, healthy, ordinary
    from angle_faults import FAULTS
    from population import Uniform

    with tempfile.TemporaryDirectory() as folder:
        usual, wide = (ordinary(seed, Path(folder), Uniform(0.0, most)) for most in (8.0, 15.0))
        well = healthy(seed, Path(folder))
    yield Subject("angle lost", seed, partial(_lost_angle, usual, LEARNING_S))
    random = np.random.default_rng([seed, 7])
    measured = wide.signals.table[ANGLE].to_numpy()
    for name, spoil in FAULTS.items():
        at = int(random.integers(70_000, 200_000))
        table = wide.signals.table.with_columns(pl.Series(ANGLE, spoil(measured, at, random)))
        faulty = replace(wide, signals=replace(wide.signals, table=table))
        yield Subject(f"angle fault {name}", seed, partial(_found_at, faulty, at))
    yield Subject("angle healthy", seed, partial(_found_at, well, 0))


def _files(folder: Path, seed: int) -> Iterator[Subject]:
    """Logs with one fault of the file each."""
    import faulty_logs
    from healthy_drive import healthy_drive

    kept = tempfile.TemporaryDirectory(dir=folder)  # of this process: until no subject needs it
    drive = healthy_drive(seed, Path(kept.name), minutes=FAULTY_MIN)
    for name, fault in faulty_logs.FAULTS.items():
        own = Path(kept.name) / str(name)
        own.mkdir()
        yield Subject(f"file {name}", seed, partial(_of_file, fault.given(drive, own), kept))


def _of_file(given: Any, kept: object) -> Record:
    """`error` where the log has one true offset."""
    import oncenter as oc

    *logs, _, truck = given.arguments
    try:
        vehicle = oc.vehicle(truck)
        signals = [oc.read(log, vehicle=vehicle) for log in logs]
    except oc.OncenterError as error:
        return {"status": error.code, "codes": [error.code]}
    return _answered(signals, vehicle, given.offsets_deg[0] if len(set(given.offsets_deg)) == 1 else None)


def _unknown(folder: Path, seed: int) -> Iterator[Subject]:
    """Drives without a vehicle file, and with its side and layout alone."""
    import unknown_truck
    from one_truck_drives import Garage

    from oncenter.vehicle import Vehicle, vehicle_from

    for name in unknown_truck.NAMES:
        driven = Garage(folder / "unknown", seed).of_row(unknown_truck.row_of(name, seed))
        known = driven.vehicle
        asked = vehicle_from({"traffic_side": known.traffic_side, "axle_layout": known.axle_layout}, "asked for")
        for way, vehicle in (("unknown", Vehicle()), ("unknown but asked", asked)):
            ask = partial(_answered, driven.signals, vehicle, driven.offset_deg, driven.pull_m_s2)
            yield Subject(f"{way} {name}", seed, ask)


def _statements(folder: Path, seed: int) -> Iterator[Subject]:
    """Right and wrong statements of a vehicle file."""
    import wrong_statements
    from one_truck_drives import Garage

    for name, case in wrong_statements.CASES.items():
        driven = Garage(folder / "statements", seed).of_row(case.row)
        for way, (signals, vehicle) in wrong_statements.right_and_wrong(driven, case, seed).items():
            ask = partial(_answered, signals, vehicle, driven.offset_deg)
            yield Subject(f"statement {way}: {name}", seed, ask)


def _lost_angle(drive: Any, learning_s: float) -> Record:
    """`error` is the RMS error, deg."""
    from angle import estimated

    error, sd = estimated(drive, sensor_lost_at=learning_s)
    after = (np.arange(len(error)) >= 100 * learning_s) & (drive.speed_m_s > 5.0)
    rms = float(np.sqrt(np.mean(error[after] ** 2)))
    return {"status": "valid", "codes": [], "error": rms, "half_width": 1.96 * float(np.median(sd[after]))}


def _found_at(drive: Any, at: int) -> Record:
    """The first fault of the angle's sensor from that tick on, and when."""
    import oncenter as oc

    kinds = oc.angle(drive.signals, drive.vehicle)["sensor_fault"].to_numpy()
    found = np.flatnonzero((np.arange(len(kinds)) >= at) & (kinds != "none"))
    named = {str(kind) for kind in kinds[found[:: max(len(found) - 1, 1)]]} if len(found) else set()
    return {
        "status": "found" if len(found) else "none",
        "codes": sorted(named),
        "late_s": (found[0] - at) / 100.0 if len(found) else 3600.0,
    }


def work(given: argparse.Namespace, types: Mapping[str, tuple[str, str]], settings: Sequence[Setting]) -> None:
    """Answers with one setting after another, and appends a line each. One that never ends or crashes ends this
    process: the next one goes on after it."""
    settable = Settable(types, tomllib.loads((ROOT / "core" / "tuned.toml").read_text(encoding="utf-8")))
    known = subjects(given.folder, judges_of(given), seeds_of(given))
    usual = [each.ask() for each in known]
    for name, factor in settings:
        append(given.results, {"name": name, "factor": factor, "begins": True})
        signal.alarm(LONGEST_S)
        settable.set(name, factor)
        append(given.results, {"name": name, "factor": factor, **changed(known, usual)})
        settable.set(name, 1.0)
        signal.alarm(0)
        if time.time() > given.until:
            return


def changed(known: Sequence[Subject], usual: Sequence[Record]) -> Record:
    """The answers that differ from the usual ones, and the number of each judge's drives. A judge whose first drives
    are not moved is not asked further, and nobody is where too many answers are lost."""
    different: list[Record] = []
    asked: Counter[str] = Counter()
    moved: set[str] = set()
    lost = 0
    for each, before in zip(known, usual, strict=True):
        if asked[each.judge] >= FIRST and each.judge not in moved:
            continue
        asked[each.judge] += 1
        now = each.ask()
        if now == before:
            continue
        moved.add(each.judge)
        different.append({"judge": each.judge, "seed": each.seed, "usual": before, "now": now})
        lost += (right(before) - right(now)) if is_healthy(each.judge) else 0
        if lost >= LOST_MAX and lost > LOST_SHARE_MAX * asked.total():
            break
    return {"asked": dict(asked), "changed": different}


def append(file: Path, line: Record) -> None:
    with file.open("a", encoding="utf-8") as lines:
        lines.write(json.dumps(line) + "\n")


def results(file: Path) -> dict[Setting, Record]:
    """By setting; "crashed" where there is only a begin."""
    found: dict[Setting, Record] = {}
    for text in file.read_text(encoding="utf-8").splitlines() if file.exists() else ():
        line = json.loads(text)
        key = (line["name"], line["factor"])
        if "changed" in line or key not in found:
            found[key] = line
    return found


def judges_of(given: argparse.Namespace) -> set[str] | None:
    """None: all."""
    return set(given.judges.split(",")) if given.judges else None


def seeds_of(given: argparse.Namespace) -> range:
    first = 1 if given.seeds == "tuning" else 1001
    return range(first, first + given.drives)


def right(answer: Record) -> bool:
    """Valid, and the interval has the truth."""
    return answer["status"] == "valid" and "error" in answer and holds(answer)


def holds(answer: Record) -> bool:
    return "error" in answer and abs(answer["error"]) < answer["half_width"]


def far(answer: Record) -> bool:
    return answer["status"] == "valid" and "error" in answer and abs(answer["error"]) > FAR_DEG


def is_healthy(judge: str) -> bool:
    return not judge.startswith(("fault ", "wrong ", "angle fault "))


def effect(line: Record) -> Record:
    """What a setting does, summed over all judges; `worst` names those with a significant loss of accuracy."""
    healthy = [each for each in line["changed"] if is_healthy(each["judge"])]
    faulty = [each for each in line["changed"] if not is_healthy(each["judge"])]
    sums: Record = {"asked": sum(line["asked"].values()), "moved": len(line["changed"])}
    for name, of in (("right", right), ("holds", holds), ("far", far)):
        sums[f"{name} lost"] = sum(of(each["usual"]) and not of(each["now"]) for each in healthy)
        sums[f"{name} won"] = sum(of(each["now"]) and not of(each["usual"]) for each in healthy)
    sums["said anew"] = sum(bool(set(each["now"]["codes"]) - set(each["usual"]["codes"])) for each in healthy)
    sums["said no more"] = sum(bool(set(each["usual"]["codes"]) - set(each["now"]["codes"])) for each in healthy)
    sums["faults lost"] = sum(bool(set(each["usual"]["codes"]) - set(each["now"]["codes"])) for each in faulty)
    sums["faults won"] = sum(bool(set(each["now"]["codes"]) - set(each["usual"]["codes"])) for each in faulty)
    late = [each["now"]["late_s"] - each["usual"]["late_s"] for each in faulty if "late_s" in each["now"]]
    sums["late"] = float(np.mean(late)) if late else 0.0
    grown, wider, worst = [], [], []
    for judge, count in line["asked"].items():
        both = [
            each for each in healthy if each["judge"] == judge and "error" in each["usual"] and "error" in each["now"]
        ]
        more = [abs(each["now"]["error"]) - abs(each["usual"]["error"]) for each in both]
        more += [0.0] * (count - len(both))
        grown += more
        wider += [each["now"]["half_width"] - each["usual"]["half_width"] for each in both]
        mean, sd = float(np.mean(more)), float(np.std(more, ddof=1)) / math.sqrt(count) if count > 1 else 0.0
        if mean > max(WORSE_SDS * sd, WORSE_DEG):
            worst.append(f"{judge} {mean:+.2f}")
    sums["error"] = float(np.mean(grown)) if grown else 0.0
    sums["error sd"] = float(np.std(grown) / math.sqrt(len(grown))) if grown else 0.0
    sums["wider"] = float(np.median(wider)) if wider else 0.0
    return sums | {"worst": worst}


def table(found: Mapping[Setting, Record]) -> Iterator[str]:
    heads = "constant, times, moved, error deg, half-width deg, right lost / won, holds lost / won, far more / fewer"
    heads += ", said anew / no more, faults lost / won, later s, worse"
    yield f"| {heads.replace(', ', ' | ')} |"
    yield f"|---|{'--:|' * 10}---|"
    for (name, factor), line in sorted(found.items()):
        if "changed" not in line:
            yield f"| {name} | {factor:g} | no end |{' |' * 9}"
            continue
        of = effect(line)
        cells = [
            f"{of['moved']} of {of['asked']}",
            f"{of['error']:+.3f} ± {of['error sd']:.3f}",
            f"{of['wider']:+.3f}",
            f"{of['right lost']} / {of['right won']}",
            f"{of['holds lost']} / {of['holds won']}",
            f"{of['far won']} / {of['far lost']}",
            f"{of['said anew']} / {of['said no more']}",
            f"{of['faults lost']} / {of['faults won']}",
            f"{of['late']:+.1f}",
            "; ".join(of["worst"]),
        ]
        yield f"| {name} | {factor:g} | {' | '.join(cells)} |"


def evidence(name: str, found: Mapping[Setting, Record]) -> str:
    """What a constant does, in one line; "" where nothing was tried."""
    said = []
    for (other, factor), line in sorted(found.items()):
        if other == name and "changed" in line:
            of = effect(line)
            text = f"{factor:g} times it moves {of['moved']} of {of['asked']} answers"
            for word, of_word in (("right", "right ones"), ("holds", "intervals that hold"), ("faults", "faults")):
                lost, won = of[f"{word} lost"], of[f"{word} won"]
                text += f", {of_word} {lost} lost and {won} won" if lost or won else ""
            said.append(text)
    return f"bench/sensitivity.py, tuning seeds: {'; '.join(said)}" if said else ""


def write_evidence(found: Mapping[Setting, Record]) -> None:
    """Into the rows of core/tuned.toml whose source is none."""
    file = ROOT / "core" / "tuned.toml"
    rows = file.read_text(encoding="utf-8").split("\n[")
    for k, row in enumerate(rows):
        text = evidence(row.split("]")[0].lstrip("["), found)
        if text:
            rows[k] = re.sub(r'source = "none on record[^"]*"', f'source = "{text}"', row)
    file.write_text("\n[".join(rows), encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="of the drives")
    parser.add_argument("results", type=Path, help="file of the results, to which a run adds")
    parser.add_argument("--constants", default="", help="regular expression of file.name; default: all")
    parser.add_argument("--together", nargs="*", default=[], help="instead: names, set together, with + between")
    parser.add_argument("--values", default="0,0.5,2", help="multiples of the value (0,0.5,2)")
    parser.add_argument("--judges", default="", help="names separated by commas; default: all")
    parser.add_argument("--drives", type=int, default=4, help="of each judge (4)")
    parser.add_argument("--seeds", choices=("tuning", "reported"), default="tuning", help="from 1 on, or from 1001 on")
    parser.add_argument("--hours", type=float, default=1.0, help="until it stops (1)")
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument(
        "--smoke", action="store_true", help="one constant, one drive of one row: whether the bench runs"
    )
    parser.add_argument("--show", action="store_true", help="only the table of all results")
    parser.add_argument("--sources", action="store_true", help="the results into core/tuned.toml")
    given = parser.parse_args()
    if given.smoke:
        given.constants, given.values, given.judges, given.drives = "bend_error", "0", "ordinary", 1
    if given.sources:
        write_evidence(results(given.results))
    elif not given.show:
        given.until = time.time() + 3600.0 * given.hours
        ask_all(given, build())
    print("\n".join(table(results(given.results))))


def ask_all(given: argparse.Namespace, types: Mapping[str, tuple[str, str]]) -> None:
    """Until all settings have a result, or the time is over."""
    given.folder.mkdir(parents=True, exist_ok=True)
    steps = [f"pass.{name}" for name in PASSES]
    others = [*(f"term.{name}" for name in TERMS), *(f"param.{name}" for name in PARAMS)]
    single = [name for name in [*steps, *others, *types] if re.search(given.constants, name)]
    names = given.together or single
    wanted = [
        (name, float(value)) for value in given.values.split(",") for name in names if value == "0" or name not in steps
    ]
    context = multiprocessing.get_context("spawn")
    while time.time() < given.until:
        before = results(given.results)
        left = [setting for setting in wanted if setting not in before]
        if not left:
            return
        workers = [context.Process(target=work, args=(given, types, left[k :: given.jobs])) for k in range(given.jobs)]
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()
        done = results(given.results)
        print(f"{len(done)} of {len(wanted)} settings", file=sys.stderr)
        if len(done) == len(before):
            raise SystemExit("no setting was answered")


if __name__ == "__main__":
    main()
