"""Tables of the records of bench/one_truck.py, of one version or of two side by side."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from one_truck_cases import END, PARTS, PIECES, SECOND
from one_truck_doors import DOORS

Record = dict[str, Any]
Key = tuple[int, int, int, int, int]
BEYOND_DEG = 1.0
LARGE_STEP_DEG = 3.0
SAME = ("folder", "memory", "fleet")  # doors that should print the same


def key_of(record: Record) -> Key:
    """Of one answer; in the order of the cases."""
    part, door = list(PARTS).index(record["part"]), list(DOORS).index(record["door"])
    return part, record["seed"], record["case"], record["drives"], door


def groups(found: Sequence[Record]) -> dict[tuple[str, str, str, str], list[Record]]:
    """By part, row, label and door, in the order of the cases."""
    grouped: dict[tuple[str, str, str, str], list[Record]] = {}
    for record in sorted(found, key=key_of):
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
        "valid held": sum(record["miss"] is False for record in valid),
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
    }


def _median(values: Iterable[float | None]) -> float | None:
    numbers = [value for value in values if value is not None]
    return float(np.median(numbers)) if numbers else None


def same(found: Sequence[Record]) -> dict[tuple[str, str, str], tuple[int, int]]:
    """By part, row and label: how many answers the doors of SAME print alike, of those that two doors gave at least."""
    printed: dict[tuple[str, str, str, int, int, int], list[str]] = {}
    for record in found:
        if record["door"] in SAME:
            for label in record["at"]:
                key = (record["part"], row_of(record), label, record["seed"], record["case"], record["drives"])
                printed.setdefault(key, []).append(record["printed"])
    alike: dict[tuple[str, str, str], tuple[int, int]] = {}
    for key, texts in printed.items():
        if len(texts) > 1:
            equal, count = alike.get(key[:3], (0, 0))
            alike[key[:3]] = (equal + (len(set(texts)) == 1), count + 1)
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


def figures(found: Sequence[Record]) -> Iterator[str]:
    """Of the page: by part and door, each answer once, then what is special of a part, by door."""
    yield (
        "| part | door | trucks | answers | valid | valid, beyond 1 deg | valid, whole interval holds |"
        " whole interval holds | its half-width, median | play valid, wrong by 1 deg | accused | missed |"
    )
    yield f"|---|---|{'--:|' * 10}"
    for part in PARTS:
        for door, some in by_door([record for record in found if record["part"] == part]).items():
            s = summary(some)
            yield (
                f"| {part} | {door} | {len({record['seed'] for record in some})} | {s['n']} | {s['valid']} |"
                f" {s['beyond']} | {s['valid held']} | {_share_that_holds(some, 'miss')} | {_number(s['whole'])} |"
                f" {s['play wrong']} | {s['accused']} | {s['missed']} |"
            )
    yield ""
    yield f"| of a part | {' | '.join(DOORS)} |"
    yield f"|---|{'---|' * len(DOORS)}"
    for name, of_doors in criteria(found):
        if any(of_doors.values()):
            yield f"| {name} | {' | '.join(of_doors.get(door, '') for door in DOORS)} |"


def by_door(found: Sequence[Record]) -> dict[str, list[Record]]:
    return {door: some for door in DOORS if (some := [record for record in found if record["door"] == door])}


def criteria(found: Sequence[Record]) -> Iterator[tuple[str, dict[str, str]]]:
    """What is asked of a truck over time, with the figures by door."""

    def of(chosen: Callable[[Record], bool], figure: Callable[[Sequence[Record]], str]) -> dict[str, str]:
        figures = {door: [r for r in some if chosen(r)] for door, some in by_door(found).items()}
        return {door: figure(some) if some else "" for door, some in figures.items()}

    def part(*names: str) -> Callable[[Record], bool]:
        return lambda record: record["part"] in names

    def none_valid_alone(start: str) -> Callable[[Record], bool]:
        return lambda record: record["row"].startswith(start) and record["valid_alone"] == 0

    def row(start: str, label: str = END) -> Callable[[Record], bool]:
        return lambda record: record["row"].startswith(start) and label in record["at"]

    truck, of_truck = part("steps", "controls", "calibrated", "multibody"), "steps, controls, calibrated, multibody"
    yield f"{of_truck}: valid and beyond 1 deg, of the valid", of(truck, _beyond)
    yield f"{of_truck}: whole interval holds", of(truck, lambda some: _share_that_holds(some, "miss"))
    yield f"{of_truck}: driving's interval holds", of(truck, lambda some: _share_that_holds(some, "miss_own"))
    yield "a step of 3 deg or more: valid with the second drive", of(_second_after_large, _valid)
    yield "healthy: accused", of(lambda r: r["row"].startswith("healthy"), lambda some: _count(some, "accused"))
    for name in ("creeping", "slipping", "relative"):
        yield f"{name} zero: named", of(row(name), _named)
    yield "play: valid and beyond 1 deg, of the valid", of(part("play"), _beyond)
    yield "play: its interval wrong by more than 1 deg", of(part("play"), lambda some: _count(some, "play_wrong"))
    for name in ("a left and a right flank", "a ring road and a right flank"):
        yield f"{name}, none valid alone: covered, valid", of(none_valid_alone(name), _covered_and_valid)
    for name in ("five on the left flank", "five on the right flank", "five on a ring road", "six on one flank"):
        yield f"{name}: covered, valid", of(row(name), _covered_and_valid)
    whole = {(r["door"], r["seed"]): r["own"] for r in found if r["row"] == "whole drive"}
    for count in PIECES:
        chosen = row(f"{count} logs")
        yield (
            f"{count} logs: covered; half-width over the whole drive's",
            of(chosen, lambda some: f"{_share_that_holds(some, 'miss')}; {_of_whole(some, whole)}"),
        )
    for start in ("eight drives", "twelve drives"):
        yield f"three loads, {start}: error without pull, median, worst; covered", of(row(start), _without_pull)
    equal = same(found).values()
    alike = _of(sum(count for count, _ in equal), sum(count for _, count in equal))
    yield "folder, memory and fleet print the same", dict.fromkeys(SAME, alike)


def _second_after_large(record: Record) -> bool:
    return SECOND in record["at"] and record["step"] is not None and abs(record["step"]) >= LARGE_STEP_DEG


def _beyond(some: Sequence[Record]) -> str:
    return _of(sum(record["beyond"] for record in some), sum(record["status"] == "valid" for record in some))


def _share_that_holds(some: Sequence[Record], name: str) -> str:
    holds = [not record[name] for record in some if record[name] is not None]
    return f"{100.0 * sum(holds) / len(holds):.0f} % of {len(holds)}" if holds else ""


def _count(some: Sequence[Record], name: str) -> str:
    return _of(sum(record[name] for record in some), len(some))


def _valid(some: Sequence[Record]) -> str:
    return _of(sum(record["status"] == "valid" for record in some), len(some))


def _named(some: Sequence[Record]) -> str:
    says = [record for record in some if record["zero"]]
    return _of(sum(record["zero"] == record["wanted_zero"] for record in says), len(says))


def _covered_and_valid(some: Sequence[Record]) -> str:
    return f"{_of(sum(record['miss'] is False for record in some), len(some))}, {_valid(some).split()[0]}"


def _of_whole(some: Sequence[Record], whole: Mapping[tuple[str, int], float | None]) -> str:
    ratios = [
        record["own"] / of_whole
        for record in some
        if (of_whole := whole.get((record["door"], record["seed"]))) and record["own"] is not None
    ]
    return f"{np.median(ratios):.2f}" if ratios else "-"


def _without_pull(some: Sequence[Record]) -> str:
    s = summary(some)
    return f"{_number(s['error without'])}, {_number(s['worst without'])}; {_share_that_holds(some, 'miss')}"


def criteria_compared(old: Sequence[Record], new: Sequence[Record]) -> Iterator[str]:
    heads = [f"{door}, {version}" for door in DOORS for version in ("old", "new")]
    yield f"\n| asked | {' | '.join(heads)} |"
    yield f"|---|{'---|' * len(heads)}"
    for (name, before), (_, now) in zip(criteria(old), criteria(new), strict=True):
        if any(before.values()):
            yield f"| {name} | {' | '.join(each.get(door, '') for door in DOORS for each in (before, now))} |"


# -- old and new


COMPARED = ("valid", "beyond", "miss", "miss own", "play wrong", "accused", "missed", "named")


def comparison(old: Sequence[Record], new: Sequence[Record]) -> Iterator[str]:
    """Of the answers that both files have; the old ones say which drives are valid alone."""
    of_new = {key_of(record): record for record in new}
    old = [record for record in old if key_of(record) in of_new]
    new = [of_new[key_of(record)] | {"valid_alone": record["valid_alone"]} for record in old]
    names = " | ".join(f"{name}, old | new" for name in COMPARED)
    head = f"row | at | door | n | {names} | own half-width, old | new | kept | own | whole | same, old | new"
    part_before = ""
    alike = [same(some) for some in (old, new)]
    for key, some in groups(old).items():
        others = [of_new[key_of(record)] for record in some]
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
    yield f"\n{len(old)} answers in both files."
    yield from totals_compared(old, new)
    yield from criteria_compared(old, new)


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
    now = {key_of(record): record for record in new}
    pairs = [(record, now[key_of(record)]) for record in old if record["status"] == "valid" and record["miss"] is False]
    stay = [record["status"] == "valid" and record["miss"] is False for _, record in pairs]
    return f"{_of(sum(stay), len(stay))} | {_ratio(pairs, 'own')} | {_ratio(pairs, 'whole')}"


def _ratio(pairs: Sequence[tuple[Record, Record]], name: str) -> str:
    both = [(old[name], new[name]) for old, new in pairs if old[name] is not None and new[name] is not None]
    if not both:
        return "-"
    old, new = np.median(np.array(both), axis=0)
    return f"{new / old:.2f}"
