"""A truck over time: what each door says of a truck's drives together, where the truth is known.

    python bench/one_truck.py FOLDER [--parts steps,play] [--doors folder,ecu] [--trucks N] [--jobs N] [--tuning]
                              [--output FILE] [--resume] [--smoke]
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
Seeds from 1001 on are for reporting, those from 1 on (--tuning) for tuning.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import numpy as np
from accuracy import REPORTED_FROM, TUNING_FROM, names_of, progress
from one_truck_cases import END, PARTS, TRUCKS_MAX, Case
from one_truck_doors import DOORS, OFFSET, PLAY, SENSOR, Said, answers
from one_truck_drives import Garage

from oncenter import _core
from oncenter.files.whole_file import write_whole
from oncenter.findings import PLAY_STANDARD_DEG
from oncenter.verdict.states import AT_FAULT

OUTPUT = Path(__file__).parents[1] / "build" / "one_truck.json"
BEYOND_DEG = 1.0
LARGE_STEP_DEG = 3.0
SAME = ("folder", "memory", "fleet")  # doors that should print the same
SAVED_EVERY = 10  # trucks
Record = dict[str, Any]
Key = tuple[int, int, int, int, int]


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
        "seconds": said.seconds,
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
    text = json.dumps({"version": _core.version(), "done": done, "records": sorted(found, key=_key)})
    write_whole(output, text + "\n")


def _key(record: Record) -> Key:
    part, door = list(PARTS).index(record["part"]), list(DOORS).index(record["door"])
    return part, record["seed"], record["case"], record["drives"], door


# -- tables


def groups(found: Sequence[Record]) -> dict[tuple[str, str, str, str], list[Record]]:
    """By part, row, label and door, in the order of the cases."""
    grouped: dict[tuple[str, str, str, str], list[Record]] = {}
    for record in sorted(found, key=_key):
        for label in record["at"]:
            grouped.setdefault((record["part"], row_of(record), label, record["door"]), []).append(record)
    parts, doors = list(PARTS), list(DOORS)
    labels = sorted({key[2] for key in grouped}, key=lambda label: (label == END, label))
    rows = list(dict.fromkeys(key[:2] for key in grouped))

    def place(key: tuple[str, str, str, str]) -> tuple[int, int, int, int]:
        return parts.index(key[0]), rows.index(key[:2]), labels.index(key[2]), doors.index(key[3])

    return {key: grouped[key] for key in sorted(grouped, key=place)}


def row_of(record: Record) -> str:
    """Two drives on one flank each give nothing new where one of them is valid alone."""
    if record["part"] != "flanks" or record["drives"] != 2:
        return str(record["row"])
    return f"{record['row']}, {'none' if record['valid_alone'] == 0 else 'one'} valid alone"


def summary(some: Sequence[Record]) -> Record:
    """The counts of a row of the table."""
    valid = [record for record in some if record["status"] == "valid"]
    errors = [abs(record["error"]) for record in some if record["error"] is not None]
    without = [abs(record["error_without"]) for record in some if record["error_without"] is not None]
    large = [record for record in some if record["step"] is not None and abs(record["step"]) >= LARGE_STEP_DEG]
    return {
        "n": len(some),
        "valid": len(valid),
        "beyond": sum(record["beyond"] for record in some),
        "beyond with pull": sum(abs(record["error_with"]) > BEYOND_DEG for record in valid),
        "beyond without": sum(abs(record["error_without"]) > BEYOND_DEG for record in valid),
        "intervals": sum(record["miss"] is not None for record in some),
        "miss": sum(record["miss"] is True for record in some),
        "valid miss": sum(record["miss"] is True for record in valid),
        "miss own": sum(record["miss_own"] is True for record in some),
        "valid miss own": sum(record["miss_own"] is True for record in valid),
        "own": _median(record["own"] for record in some),
        "whole": _median(record["whole"] for record in some),
        "error": _median(errors),
        "error without": _median(without),
        "worst without": max(without, default=None),
        "play valid": sum(record["play_status"] == "valid" for record in some),
        "play wrong": sum(record["play_wrong"] for record in some),
        "accused": sum(record["accused"] for record in some),
        "missed": sum(record["missed"] for record in some),
        "named": sum(record["zero"] == record["wanted_zero"] for record in some),
        "refused": sum(record["status"] == "refused" for record in some),
        "large": len(large),
        "large valid": sum(record["status"] == "valid" for record in large),
        "seconds": sum(record["seconds"] or 0.0 for record in some if END in record["at"]),
    }


def _median(values: Any) -> float | None:
    numbers = [value for value in values if value is not None]
    return float(np.median(numbers)) if numbers else None


def same(found: Sequence[Record]) -> dict[tuple[str, str, str], tuple[int, int]]:
    """By part, row and label: how many answers the doors of SAME print alike, of how many."""
    printed: dict[tuple[str, str, str, int, int, int], set[str]] = {}
    for record in found:
        if record["door"] in SAME:
            for label in record["at"]:
                key = (record["part"], row_of(record), label, record["seed"], record["case"], record["drives"])
                printed.setdefault(key, set()).add(record["printed"])
    alike: dict[tuple[str, str, str], tuple[int, int]] = {}
    for key, texts in printed.items():
        equal, count = alike.get(key[:3], (0, 0))
        alike[key[:3]] = (equal + (len(texts) == 1), count + 1)
    return alike


HEAD = (
    "row | at | door | n | valid | beyond 1 deg (with pull, without) | miss whole (valid) | miss own (valid) |"
    " error, median | without pull | worst | own half-width | whole | play valid | wrong | accused | missed |"
    " zero named | valid after 3 deg | same | refused"
)


def lines(found: Sequence[Record]) -> Iterator[str]:
    alike = same(found)
    part_before = ""
    for (part, row, label, door), some in groups(found).items():
        if part != part_before:
            yield f"\n## {part}\n\n| {HEAD} |\n|---|---|---|{'--:|' * (HEAD.count('|') - 2)}"
            part_before = part
        s = summary(some)
        equal, count = alike.get((part, row, label), (0, 0))
        yield (
            f"| {row} | {label} | {door} | {s['n']} | {s['valid']} |"
            f" {s['beyond']} ({s['beyond with pull']}, {s['beyond without']}) |"
            f" {s['miss']} ({s['valid miss']}) | {s['miss own']} ({s['valid miss own']}) |"
            f" {_number(s['error'])} | {_number(s['error without'])} | {_number(s['worst without'])} |"
            f" {_number(s['own'])} | {_number(s['whole'])} | {s['play valid']} | {s['play wrong']} | {s['accused']} |"
            f" {s['missed']} | {'' if door == 'ecu' else s['named']} | {_of(s['large valid'], s['large'])} |"
            f" {_of(equal, count) if door in SAME else ''} | {s['refused'] or ''} |"
        )


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"


def _of(count: int, whole: int) -> str:
    return f"{count} of {whole}" if whole else ""


def totals(found: Sequence[Record]) -> Iterator[str]:
    """By part and door, each answer once."""
    yield "| part | door | answers | valid | beyond 1 deg | miss whole | miss own | play wrong | accused | missed | s |"
    yield "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
    for part in PARTS:
        for door in DOORS:
            some = [record for record in found if record["part"] == part and record["door"] == door]
            if not some:
                continue
            s = summary(some)
            yield (
                f"| {part} | {door} | {s['n']} | {s['valid']} | {s['beyond']} | {_of(s['miss'], s['intervals'])} |"
                f" {_of(s['miss own'], s['intervals'])} | {s['play wrong']} | {s['accused']} | {s['missed']} |"
                f" {s['seconds']:.0f} |"
            )


# -- old and new


COMPARED = ("valid", "beyond", "miss", "miss own", "play wrong", "accused", "missed", "named")


def comparison(old: Sequence[Record], new: Sequence[Record]) -> Iterator[str]:
    """Of the answers that both files have."""
    common = {_key(record) for record in old} & {_key(record) for record in new}
    old, new = ([record for record in some if _key(record) in common] for some in (old, new))
    of_new = {_key(record): record for record in new}
    names = " | ".join(f"{name}, old | new" for name in COMPARED)
    head = f"row | at | door | n | {names} | own half-width, old | new | kept | own | whole | same, old | new"
    part_before = ""
    alike = [
        same(some) for some in (old, [of_new[_key(record)] | {"valid_alone": record["valid_alone"]} for record in old])
    ]
    for key, some in groups(old).items():
        others = [of_new[_key(record)] for record in some]
        if key[0] != part_before:
            yield f"\n## {key[0]}\n\n| {head} |\n|---|---|---|{'--:|' * (head.count('|') - 2)}"
            part_before = key[0]
        before, now = summary(some), summary(others)
        pairs = " | ".join(f"{before[name]} | {now[name]}" for name in COMPARED)
        equal = [_of(*each.get(key[:3], (0, 0))) if key[3] in SAME else "" for each in alike]
        yield (
            f"| {key[1]} | {key[2]} | {key[3]} | {before['n']} | {pairs} | {_number(before['own'])} |"
            f" {_number(now['own'])} | {kept(some, others)} | {equal[0]} | {equal[1]} |"
        )
    yield f"\n{len(common)} answers in both files."
    yield from totals_compared(old, new)


def totals_compared(old: Sequence[Record], new: Sequence[Record]) -> Iterator[str]:
    names = " | ".join(f"{name}, old | new" for name in COMPARED)
    head = f"part | door | n | {names} | kept | own | whole"
    yield f"\n| {head} |\n|---|---|{'--:|' * (head.count('|') - 1)}"
    for part in PARTS:
        for door in DOORS:
            both = [[r for r in some if r["part"] == part and r["door"] == door] for some in (old, new)]
            if both[0]:
                before, now = map(summary, both)
                pairs = " | ".join(f"{before[name]} | {now[name]}" for name in COMPARED)
                yield f"| {part} | {door} | {before['n']} | {pairs} | {kept(*both)} |"


def kept(old: Sequence[Record], new: Sequence[Record]) -> str:
    """Of the answers that were valid with an interval that held, how many still are, and the ratios of the median
    half-widths, of the driving's part and of the whole."""
    now = {_key(record): record for record in new}
    pairs = [(record, now[_key(record)]) for record in old if record["status"] == "valid" and record["miss"] is False]
    stay = [record["status"] == "valid" and record["miss"] is False for _, record in pairs]
    return f"{_of(sum(stay), len(stay))} | {_ratio(pairs, 'own')} | {_ratio(pairs, 'whole')}"


def _ratio(pairs: Sequence[tuple[Record, Record]], name: str) -> str:
    both = [(old[name], new[name]) for old, new in pairs if old[name] is not None and new[name] is not None]
    if not both:
        return "-"
    old, new = np.median(np.array(both), axis=0)
    return f"{new / old:.2f}"


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
    parser.add_argument("--show", type=Path, metavar="FILE", help="print the tables of such a file")
    parser.add_argument("--compare", type=Path, nargs=2, metavar=("OLD", "NEW"), help="print two files side by side")
    parser.add_argument("--smoke", action="store_true", help="one truck of two parts: whether the bench runs")
    given = parser.parse_args()
    if given.compare:
        print("\n".join(comparison(*(read(file)["records"] for file in given.compare))))
        return
    if given.show:
        found = read(given.show)["records"]
        print("\n".join([*lines(found), "", *totals(found)]))
        return
    if given.folder is None:
        parser.error("FOLDER, of the simulated drives, is missing")
    parts, doors = names_of(given.parts, list(PARTS), "part"), names_of(given.doors, list(DOORS), "door")
    trucks = 1 if given.smoke else given.trucks
    if given.smoke and not given.parts:
        parts = ["calibrated", "pieces"]
    first = given.first or (TUNING_FROM if given.tuning else REPORTED_FROM)
    seeds = {part: range(first, first + min(trucks, TRUCKS_MAX.get(part, trucks))) for part in parts}
    before = read(given.output) if given.resume and given.output.exists() else {}
    found = run(seeds, given.folder, doors, given.jobs, given.output, before)
    print("\n".join([*lines(found), "", *totals(found)]))


if __name__ == "__main__":
    main()
