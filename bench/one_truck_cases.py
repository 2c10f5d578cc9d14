"""Sequences of a truck's drives, by part of bench/one_truck.py: what is planted into them, and when they are judged."""

from __future__ import annotations

import dataclasses
import itertools
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from drives_that_differ import WHEELS, changed, larger
from one_truck_drives import DRIVES, Driven, Garage

from oncenter.signals import Signals

Random = np.random.Generator
DAY_S = 86400.0
FIRST_DAY_S = 1.704e9  # December 2023
FIRST, SECOND, END = "1st after", "2nd after", "end"
STEP_DEG = (0.8, 8.0)
WRONG_DEG, LOAD_CHANGE_DEG, CREEP_DEG, ZERO_SD_DEG, SLIP_DEG = 3.0, 0.5, 0.4, 6.0, (0.5, 1.5)
TYRE_PERCENT, LEAK_PERCENT_H = (0.1, 0.5), (1.0, 4.0)
PLAYS_DEG = (0.0, 3.0, 8.0, 15.0)
PLAY_PAIRS_OF_A_TRUCK = 4  # of the 12
PIECES, GAP_MIN = (5, 10, 20, 60), (1.0, 30.0)
CALIBRATED = {"1 + 3": (1, 3), "1 + 6": (1, 6), "1 + 1": (1, 1)}  # drives before and after
FLANK_S, ON_S_MIN, OFF_COUNTS = 300.0, 60.0, 5.0  # of a piece on one flank; the weight of seconds on the other one


@dataclass(frozen=True)
class Case:
    """Drives in order of time with planted changes.

    Attributes:
        row: of the table; several cases of a truck may belong to one.
        drives: as the doors get them.
        since: for each drive, the first one whose reading belongs to the same offset.
        judged: by the number of drives so far, the labels of the answer then.
        zero: what a door should say of the sensor's zero.
        steps: sizes of planted steps, deg.
    """

    row: str
    drives: tuple[Driven, ...]
    since: tuple[int, ...]
    judged: Mapping[int, tuple[str, ...]]
    zero: str = "fixed"
    steps: tuple[float, ...] = field(default=())


def dated(drives: Sequence[Driven], random: Random, days: tuple[float, float] = (1.0, 5.0)) -> tuple[Driven, ...]:
    """The drives with names, and with dates in this order."""
    between = random.uniform(*days, len(drives)) * DAY_S
    starts = FIRST_DAY_S + np.concatenate(([0.0], np.cumsum(between[1:]))) + random.uniform(0.0, DAY_S)
    return tuple(
        drive.at(round(float(start), 2), f"drive{k:02d}")
        for k, (drive, start) in enumerate(zip(drives, starts, strict=True), 1)
    )


def random_of(seed: int, name: str) -> Random:
    return np.random.default_rng([seed, zlib.crc32(name.encode())])


def moved(drives: Sequence[Driven], by_deg: Sequence[float]) -> list[Driven]:
    return [drive.with_offset(by) if by else drive for drive, by in zip(drives, by_deg, strict=True)]


def since_equal(values: Sequence[float]) -> tuple[int, ...]:
    """For each place, the first of the run of equal values that ends there."""
    since = [0]
    for k in range(1, len(values)):
        since.append(since[-1] if values[k] == values[k - 1] else k)
    return tuple(since)


def after(places: Sequence[int], count: int) -> dict[int, tuple[str, ...]]:
    """Judged at the first and the second drive from each place on, and at the end."""
    labels: dict[int, tuple[str, ...]] = {}
    for place, end in zip(places, (*places[1:], count), strict=True):
        labels |= {place + k: (label,) for k, label in ((1, FIRST), (2, SECOND)) if place + k <= end}
    labels[count] = (*labels.get(count, ()), END)
    return labels


def early(count: int) -> dict[int, tuple[str, ...]]:
    """Judged while there are few drives, and at the end."""
    labels: dict[int, tuple[str, ...]] = {k: (f"{k} drives",) for k in (2, 3, 5) if k <= count}
    labels[count] = (*labels.get(count, ()), END)
    return labels


def window(drives: Callable[[int], Driven], random: Random, count: int) -> list[Driven]:
    """So many successive drives of a truck's twelve."""
    first = int(random.integers(0, DRIVES - count + 1))
    return [drives(k) for k in range(first, first + count)]


def size_of(random: Random, low: float, high: float) -> float:
    return float(random.choice([-1.0, 1.0]) * random.uniform(low, high))


# -- steps

SINGLE = [(count, place) for count in range(2, DRIVES + 1) for place in range(1, count)]
SINGLE_ORDER = np.random.default_rng(67).permutation(len(SINGLE))


def stepped(row: str, drives: Sequence[Driven], places: Sequence[int], random: Random) -> Case:
    sizes = [size_of(random, *STEP_DEG) for _ in places]
    by = [sum(size for size, place in zip(sizes, places, strict=True) if k >= place) for k in range(len(drives))]
    return Case(
        row,
        dated(moved(drives, by), random),
        since_equal(by),
        after(places, len(drives)),
        steps=tuple(sizes),
    )


def steps_of(population: str, drives: Callable[[int], Driven], seed: int, singles: int = 2) -> Iterator[Case]:
    """All pairs of length and place are covered in turn by the seeds."""
    for k in range(singles):
        count, place = SINGLE[int(SINGLE_ORDER[(singles * seed + k) % len(SINGLE)])]
        random = random_of(seed, f"{population} step {k}")
        yield stepped(f"one step, {population}", window(drives, random, count), [place], random)
    random = random_of(seed, f"{population} two steps")
    count = int(random.integers(3, DRIVES + 1))
    places = sorted(random.choice(np.arange(1, count), 2, replace=False).tolist())
    yield stepped(f"two steps, {population}", window(drives, random, count), places, random)


def steps(seed: int, garage: Garage) -> Iterator[Case]:
    yield from steps_of("no pull", garage.plain, seed)
    loads = garage.of_kind("loads")
    yield from steps_of("pull, three loads", loads.__getitem__, seed)


def multibody(seed: int, garage: Garage) -> Iterator[Case]:
    yield from steps_of("multi-body", garage.multibody, seed, singles=4)
    yield healthy("healthy, multi-body", garage.multibody, seed)
    yield wrong_drive("wrong drive, multi-body", garage.multibody, seed)


# -- controls


def healthy(row: str, drives: Callable[[int], Driven], seed: int) -> Case:
    random = random_of(seed, row)
    count = int(random.integers(2, DRIVES + 1))
    return Case(row, dated(window(drives, random, count), random), (0,) * count, early(count))


def wrong_drive(row: str, drives: Callable[[int], Driven], seed: int) -> Case:
    """The middle one; not judged while it is the last, since it then looks like a step."""
    random = random_of(seed, row)
    count = int(random.integers(4, 11))
    middle = count // 2
    by = [size_of(random, WRONG_DEG, WRONG_DEG) if k == middle else 0.0 for k in range(count)]
    cased = dated(moved(window(drives, random, count), by), random)
    return Case(row, cased, (0,) * count, after([middle + 1], count))


def controls(seed: int, garage: Garage) -> Iterator[Case]:
    loads = garage.of_kind("loads")
    yield healthy("healthy, no pull", garage.plain, seed)
    yield healthy("healthy, pull, three loads", loads.__getitem__, seed)
    yield wrong_drive("wrong drive, no pull", garage.plain, seed)
    yield wrong_drive("wrong drive, pull, three loads", loads.__getitem__, seed)
    yield same_flank(seed, garage)
    yield load_change(seed, loads)
    yield larger_tyres(seed, garage)
    yield puncture(seed, garage)
    for row, zero, by in zeros(seed):
        random = random_of(seed, row)
        drives = dated(moved(window(garage.plain, random, len(by)), by), random)
        yield Case(row, drives, since_equal(by), early(len(by)), zero)


def same_flank(seed: int, garage: Garage) -> Case:
    random = random_of(seed, "same flank")
    side = float(random.choice([-1.0, 1.0]))
    drives = dated(flank_pieces(garage, side, 6), random)
    return Case("six on one flank", drives, (0,) * 6, early(6))


def load_change(seed: int, loads: Sequence[Driven]) -> Case:
    """From half on another load, with which the ride height steers."""
    random = random_of(seed, "load change")
    light, heavy = random.permutation(3)[:2]
    half = int(random.integers(2, 5))
    before, behind = ([drive for drive in loads if drive.load == load][:half] for load in (light, heavy))
    by = [0.0] * half + [size_of(random, LOAD_CHANGE_DEG, LOAD_CHANGE_DEG)] * half
    drives = dated(moved([*before, *behind], by), random)
    return Case("load change of 0.5 deg", drives, since_equal(by), after([half], 2 * half))


def larger_tyres(seed: int, garage: Garage) -> Case:
    """From one drive on."""
    random = random_of(seed, "larger tyres")
    count = int(random.integers(3, 9))
    place = int(random.integers(1, count))
    wheels = WHEELS[str(random.choice(list(WHEELS)))]
    percent = size_of(random, *TYRE_PERCENT)
    drives = [
        drive.with_signals(larger(drive.signals, wheels, percent)) if k >= place else drive
        for k, drive in enumerate(window(garage.plain, random, count))
    ]
    return Case("tyres 0.1 to 0.5 % larger", dated(drives, random), (0,) * count, after([place], count))


def puncture(seed: int, garage: Garage) -> Case:
    """In one drive, repaired before the next."""
    random = random_of(seed, "puncture")
    count = int(random.integers(2, 7))
    place = int(random.integers(0, count))
    wheel = str(random.choice(["front_left", "front_right", "rear_left", "rear_right"]))
    percent_h = float(random.uniform(*LEAK_PERCENT_H))
    drives = window(garage.plain, random, count)
    time = drives[place].signals.table["time_s"].to_numpy()
    shrinks = 1.0 - 0.01 * percent_h * np.maximum(time - 300.0, 0.0) / 3600.0
    leaking = changed(drives[place].signals, {f"wheel_speed_{wheel}_m_s": lambda speed: speed / shrinks})
    drives[place] = drives[place].with_signals(leaking)
    labels = {place + 1: ("in it",), count: (END,)} if place + 1 < count else {count: ("in it", END)}
    return Case("puncture", dated(drives, random), (0,) * count, labels)


def zeros(seed: int) -> Iterator[tuple[str, str, list[float]]]:
    """Row, what a door should say, and what the sensor reads more in each drive, deg."""
    random = random_of(seed, "zeros")
    side = float(random.choice([-1.0, 1.0]))
    creeping, relative, slipping = (int(random.integers(6, DRIVES + 1)) for _ in range(3))
    yield "creeping zero", "moves", [side * CREEP_DEG * k for k in range(creeping)]
    yield "relative zero", "relative", random.normal(0.0, ZERO_SD_DEG, relative).tolist()
    slips = [side * random.uniform(*SLIP_DEG) if k % 2 == 0 and k > 0 else 0.0 for k in range(slipping)]
    yield "slipping zero", "moves", np.cumsum(slips).tolist()


# -- play


def play(seed: int, garage: Garage) -> Iterator[Case]:
    pairs = list(itertools.permutations(PLAYS_DEG, 2))
    order = np.random.default_rng(68).permutation(len(pairs))
    for j in range(PLAY_PAIRS_OF_A_TRUCK):
        old, new = pairs[int(order[(PLAY_PAIRS_OF_A_TRUCK * seed + j) % len(pairs)])]
        random = random_of(seed, f"play {old} {new}")
        before, behind = (int(random.integers(1, 6)) for _ in range(2))
        drives = [garage.with_play(old if k < before else new, k) for k in range(before + behind)]
        cased = dated(drives, random)
        row = f"play {old:g} to {new:g} deg"
        yield Case(row, cased, (0,) * len(cased), after([before], len(cased)))


# -- flanks


@dataclass(frozen=True)
class Piece:
    """Five minutes of a drive, with the seconds on the wanted flank and on the other half of the play."""

    drive: Driven
    on_s: float
    off_s: float


def flank_pieces(garage: Garage, side: float, count: int) -> list[Driven]:
    """So many on one flank, 1 left: of ordinary roads those that are never on the other half of the play, else of a
    ring road. On a crown to the right, ordinary roads load the left flank."""
    if side < 0.0:
        return [flank_piece(garage.right(k), side).drive for k in range(count)]
    ordinary = [flank_piece(garage.plain(k), side) for k in range(DRIVES)]
    pieces = [piece.drive for piece in ordinary if piece.off_s == 0.0 and piece.on_s > ON_S_MIN][: count - 1]
    return pieces + [flank_piece(garage.left(k), side).drive for k in range(count - len(pieces))]


def flank_piece(drive: Driven, side: float) -> Piece:
    """The most one-sided piece of a drive."""
    signals = drive.signals
    moves = signals.table["vehicle_speed_m_s"].to_numpy() > 10.0
    place = side * drive.place_in_play
    length = round(FLANK_S * signals.rate_hz)
    begins = np.arange(0, signals.ticks - length, 1000)
    on_s, off_s = (
        (total[begins + length] - total[begins]) / signals.rate_hz
        for total in (np.concatenate(([0], np.cumsum(there))) for there in (moves & (place > 0.9), place < 0.0))
    )
    best = int(np.argmax(on_s - OFF_COUNTS * off_s))
    piece = drive.with_signals(part(signals, int(begins[best]), length))
    return Piece(piece, float(on_s[best]), float(off_s[best]))


def part(signals: Signals, begin: int, length: int) -> Signals:
    return dataclasses.replace(signals, table=signals.table.slice(begin, length))


def flanks(seed: int, garage: Garage) -> Iterator[Case]:
    random = random_of(seed, "flanks")
    lefts, rights = (flank_pieces(garage, side, 5) for side in (1.0, -1.0))
    for row, left in (("a left and a right flank", lefts[0]), ("a ring road and a right flank", garage.left(5))):
        both = [left, rights[0]][:: 1 if random.random() < 0.5 else -1]
        yield Case(row, dated(both, random), (0, 0), {2: (END,)})
    for name, pieces in (("left", lefts), ("right", rights)):
        yield Case(f"five on the {name} flank", dated(pieces, random), (0,) * 5, {5: (END,)})
    ring = dated([garage.left(k) for k in range(5)], random)
    yield Case("five on a ring road", ring, (0,) * 5, {5: (END,)})


# -- pieces of a drive


def pieces(seed: int, garage: Garage) -> Iterator[Case]:
    random = random_of(seed, "pieces")
    whole = garage.long()
    yield Case("whole drive", dated([whole], random), (0,), {1: (END,)})
    ticks = whole.signals.ticks
    for count in PIECES:
        length = ticks // count
        parts = [whole.with_signals(part(whole.signals, k * length, length)) for k in range(count)]
        gaps = np.concatenate(([0.0], random.uniform(*GAP_MIN, count - 1) * 60.0))
        starts = FIRST_DAY_S + np.cumsum(gaps) + np.arange(count) * length / whole.signals.rate_hz
        drives = tuple(drive.at(round(float(starts[k]), 2), f"log{k:02d}") for k, drive in enumerate(parts))
        yield Case(f"{count} logs", drives, (0,) * count, {count: (END,)})


# -- loads, and calibrations


def loads(seed: int, garage: Garage) -> Iterator[Case]:
    for population, about in (("eight", "eight drives, pull sd 0.06"), ("loads", "twelve drives, pull by its prior")):
        drives = dated(garage.of_kind(population), random_of(seed, population))
        yield Case(about, drives, (0,) * len(drives), {len(drives): (END,)})


def calibrated(seed: int, garage: Garage) -> Iterator[Case]:
    """A truck beyond the limit is set to about zero, or one at zero is set wrong."""
    for name, (before, behind) in CALIBRATED.items():
        random = random_of(seed, f"calibrated {name}")
        drives = window(garage.plain, random, before + behind)
        old, new = size_of(random, 2.5, 6.0), float(random.normal(0.0, 0.15))
        if random.random() < 0.5:
            old, new = new, old
        reading = drives[0].offset_deg
        by = [(old if k < before else new) - reading for k in range(before + behind)]
        yield Case(f"calibrated, {name}", dated(moved(drives, by), random), since_equal(by), after([before], len(by)))


PARTS: Mapping[str, Callable[[int, Garage], Iterator[Case]]] = {
    "steps": steps,
    "controls": controls,
    "play": play,
    "flanks": flanks,
    "pieces": pieces,
    "loads": loads,
    "calibrated": calibrated,
    "multibody": multibody,
}
# Trucks of a part that has fewer than the others.
TRUCKS_MAX = {"multibody": 20, "loads": 12}
