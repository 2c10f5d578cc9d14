"""A truck over time: what each door says of a truck's drives together, where the truth is known.

    python bench/one_truck.py FOLDER [--parts steps,play] [--doors folder,ecu] [--trucks N] [--jobs N] [--tuning]
                              [--output FILE] [--resume] [--page | --smoke]
    python bench/one_truck.py --show FILE... [--page]
    python bench/one_truck.py --compare OLD.json NEW.json

FOLDER keeps the simulated drives (bench/one_truck_drives.py), so that each code judges the same drives, and a stopped
run continues; with --resume it also keeps the trucks that FILE has. The doors (bench/one_truck_doors.py): `folder`,
`oncenter offset LOGS`; `memory`, one drive after another; `fleet`; `ecu`, the core with an ignition between drives. The
parts (bench/one_truck_cases.py):

    steps       one or two steps of 0.8 to 8 deg at every place of 2 to 12 drives
    controls    no step: healthy, a wrong drive, one flank, a load change, tyres, a puncture; a zero that creeps, slips
                or is relative
    play        from each of 0, 3, 8 and 15 deg to each other
    flanks      a left and a right flank, five drives on one flank
    pieces      half an hour as 5 to 60 logs
    loads       a pull and three loads
    calibrated  one drive or more before a calibration and after it
    multibody   steps and controls of a truck of an independent model

`beyond` counts valid answers whose error is above 1 deg, with or without the effect of the pull, whichever is closer.
`miss` counts intervals without the truth: the whole one without the pull, the driving's with any part of the pull.
Seeds from 1001 on are for reporting, those from 1 on (--tuning) for tuning. --page writes the figures of this run, or
of the shown files together, into docs/truck_over_time_figures.md.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

import numpy as np
from accuracy import REPORTED_FROM, TUNING_FROM, names_of, progress
from one_truck_cases import PARTS, TRUCKS_MAX, Case
from one_truck_doors import DOORS, OFFSET, PLAY, SENSOR, Said, answers
from one_truck_drives import Garage
from one_truck_tables import BEYOND_DEG, Record, comparison, figures, key_of, lines
from sections import between

from oncenter import _core
from oncenter.files.whole_file import write_whole
from oncenter.findings import PLAY_STANDARD_DEG
from oncenter.verdict.states import AT_FAULT

ROOT = Path(__file__).parents[1]
OUTPUT = ROOT / "build" / "one_truck.json"
PAGE = ROOT / "docs" / "truck_over_time_figures.md"
BEGIN, END = "<!-- one truck: written by bench/one_truck.py --page -->", "<!-- one truck: end -->"
SAVED_EVERY = 5  # trucks


# -- one truck


def records(part: str, seed: int, folder: Path, doors: Sequence[str]) -> list[Record]:
    """All answers about one truck of a part."""
    found = []
    for number, case in enumerate(PARTS[part](seed, Garage(folder, seed))):
        by_door = {door: answers(door, case.drives, case.judged) for door in doors}
        for count, labels in case.judged.items():
            about = {"part": part, "row": case.row, "seed": seed, "case": number, "drives": count, "at": list(labels)}
            alone = max((said[count].valid_alone for said in by_door.values()), default=-1)
            about |= {"step": _last_step(case, count), "wanted_zero": case.zero, "valid_alone": alone}
            found += [about | {"door": door, **judged(said[count], case, count)} for door, said in by_door.items()]
    return found


def _last_step(case: Case, count: int) -> float | None:
    """The size of the last planted step so far, deg."""
    so_far = len(set(case.since[:count])) - 1
    return case.steps[so_far - 1] if case.steps and so_far else None


def judged(said: Said, case: Case, count: int) -> Record:
    """An answer on the first drives of a case against their truth; deg, None where there is no number."""
    last, since = case.drives[count - 1], case.since[count - 1]
    pulled = float(np.mean([drive.pulled_deg for drive in case.drives[since:count]]))
    targets = [last.offset_deg + effect for effect in (0.0, last.pulled_deg, pulled)]
    errors = [said.value - target for target in targets]
    error = min(errors, key=abs)
    own_misses = said.own[1] < min(targets) or said.own[0] > max(targets)
    numbers = {
        "value": said.value,
        "error": error,
        "error_without": errors[0],
        "error_with": errors[2],
        "own": 0.5 * (said.own[1] - said.own[0]),
        "whole": 0.5 * (said.whole[1] - said.whole[0]),
        "play": said.play,
        "play_error": said.play - last.play_deg,
    }
    finite = {name: value if math.isfinite(value) else None for name, value in numbers.items()}
    valid = said.status == "valid"
    counts = said.status not in ("invalid", "refused")
    return finite | {
        "status": said.status,
        "refusal": said.refusal,
        "beyond": valid and not abs(error) <= BEYOND_DEG,
        "miss": not _holds(said.whole, targets[0]) if counts and finite["whole"] is not None else None,
        "miss_own": own_misses if counts and finite["own"] is not None else None,
        "play_status": said.play_status,
        "play_wrong": said.play_status == "valid" and _outside(said.play_interval, last.play_deg) > BEYOND_DEG,
        "zero": said.zero,
        "states": dict(said.states),
        "accused": accused(said.states, targets, case, last.play_deg, last.vehicle.offset_limit_deg),
        "missed": said.states.get(OFFSET) == "within"
        and min(map(abs, targets)) > last.vehicle.offset_limit_deg + BEYOND_DEG,
        "printed": said.printed,
    }


def accused(states: Mapping[str, str], targets: Sequence[float], case: Case, play_deg: float, limit: float) -> bool:
    """Whether a verdict names the sensor or the play at fault, or the offset beyond the limit, where the truth is not,
    by 1 deg. A zero that is not fixed is a fault of the sensor."""
    offset = states.get(OFFSET)
    of_sensor = case.zero == "fixed" and (states.get(SENSOR) in AT_FAULT or offset in AT_FAULT)
    of_offset = offset in ("recalibrate", "over") and max(map(abs, targets)) <= limit - BEYOND_DEG
    return of_sensor or of_offset or (states.get(PLAY) == "repair" and play_deg <= PLAY_STANDARD_DEG - BEYOND_DEG)


def _holds(interval: tuple[float, float], target: float) -> bool:
    return interval[0] <= target <= interval[1]


def _outside(interval: tuple[float, float], target: float) -> float:
    return max(interval[0] - target, target - interval[1], 0.0)


# -- all trucks


def run(
    seeds: Mapping[str, range], folder: Path, doors: Sequence[str], jobs: int, output: Path, before: Record
) -> list[Record]:
    """The records of all trucks in order; FILE has those of the trucks that are done."""
    done = {(part, seed) for part, seed in before.get("done", [])}
    found: list[Record] = list(before.get("records", []))
    wanted = [(part, seed) for part, of_part in seeds.items() for seed in of_part if (part, seed) not in done]
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        running = {pool.submit(records, part, seed, folder, doors): (part, seed) for part, seed in wanted}
        for count, future in enumerate(as_completed(running), 1):
            found += future.result()
            done.add(running.pop(future))
            progress(count, len(wanted))
            if count % SAVED_EVERY == 0 or count == len(wanted):
                _save(found, sorted(done), output)
    return found


def _save(found: list[Record], done: list[tuple[str, int]], output: Path) -> None:
    output.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps({"version": _core.version(), "done": done, "records": sorted(found, key=key_of)})
    write_whole(output, text + "\n")


def read(file: Path) -> Record:
    content: Record = json.loads(file.read_text(encoding="utf-8"))
    return content


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", help="of the simulated drives")
    parser.add_argument("--parts", default="", help="names separated by commas; default: all")
    parser.add_argument("--doors", default="", help="names separated by commas; default: all")
    parser.add_argument("--trucks", type=int, default=60, help="of each part (60; multibody 20, loads 12 at most)")
    parser.add_argument("--first", type=int, help="the first seed, in place of 1001 or 1")
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--tuning", action="store_true", help="seeds from 1 on instead of the reported ones")
    parser.add_argument("--output", type=Path, default=OUTPUT, help="the records (build/one_truck.json)")
    parser.add_argument("--resume", action="store_true", help="keep the trucks that this file has")
    parser.add_argument("--show", type=Path, nargs="+", metavar="FILE", help="print the tables of such files together")
    parser.add_argument("--compare", type=Path, nargs=2, metavar=("OLD", "NEW"), help="print two files side by side")
    parser.add_argument("--smoke", action="store_true", help="one truck of two parts: whether the bench runs")
    parser.add_argument("--page", action="store_true", help="write the section of docs/truck_over_time_figures.md")
    given = parser.parse_args()
    if given.page and (given.tuning or given.smoke or given.parts or given.doors or given.compare):
        parser.error("--page reports all parts and doors on the seeds for it")
    parts, doors = names_of(given.parts, list(PARTS), "part"), names_of(given.doors, list(DOORS), "door")

    def chosen(*files: Path) -> list[Record]:
        """Of an answer that several files have, that of the last one."""
        found = {key_of(record): record for file in files for record in read(file)["records"]}
        return [record for record in found.values() if record["part"] in parts and record["door"] in doors]

    if given.compare:
        print("\n".join(comparison(*map(chosen, given.compare))))
        return
    if given.show:
        report(chosen(*given.show), page=given.page)
        return
    if given.folder is None:
        parser.error("FOLDER, of the simulated drives, is missing")
    trucks = 1 if given.smoke else given.trucks
    if given.smoke and not given.parts:
        parts = ["calibrated", "play"]
    first = given.first or (TUNING_FROM if given.tuning else REPORTED_FROM)
    seeds = {part: range(first, first + min(trucks, TRUCKS_MAX.get(part, trucks))) for part in parts}
    before = read(given.output) if given.resume and given.output.exists() else {}
    report(run(seeds, given.folder, doors, given.jobs, given.output, before), page=given.page)


def report(found: list[Record], *, page: bool) -> None:
    text = "\n".join(figures(found))
    print("\n".join(lines(found)), text, sep="\n\n")
    if page:
        if min(record["seed"] for record in found) < REPORTED_FROM:
            sys.exit(f"--page reports on the seeds for it, from {REPORTED_FROM} on")
        PAGE.write_text(between(PAGE.read_text(encoding="utf-8"), BEGIN, END, text), encoding="utf-8")


if __name__ == "__main__":
    main()
