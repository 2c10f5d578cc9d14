"""Wrong statements of a user: side of traffic, set-up, statuses, play, ratio and wheelbase, each beside the right one.

    python bench/wrong_statements.py FOLDER [--drives N] [--cases a,b] [--seeds tuning|reported] [--smoke]

A case is N drives (12), each answered twice: with the right statement and with the wrong one. The drives stay in
FOLDER. Errors are those of the straight-ahead offset. A wrong statement does harm if the offset is valid, more than
1 deg off and outside its interval. It does so without a word if no finding names the contradiction. Asked: none without
a word; with right statements, at most 1 drive in 100 has such a finding. All records go to
build/accuracy/wrong_statements.json; --against compares the right statements with those of an earlier run.
"""

from __future__ import annotations

import argparse
import json
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import polars as pl
from accuracy import BUILD, REPORTED_FROM, TUNING_FROM, names_of, progress
from accuracy_rows import ROWS, STANDING_M_S, Row
from effects_rows import STATUS_ROWS
from one_truck_drives import Driven, Garage
from population import Random
from rivals import Array

import oncenter as oc
from oncenter.errors import OncenterError
from oncenter.signals import DEGREE, SIGNALS
from oncenter.vehicle import Vehicle, vehicle_from

HARMFUL_DEG = 1.0
ACCUSED_MAX, FEWER_MAX, WIDER_MAX = 0.01, 2.0 / 60.0, 1.1
PLAY_SD_DEG = 0.5
FLICKERS = 0.02  # share of the ticks at which a status has the other value
BURST_S = 0.2  # two messages of 100 ms

Keys = Mapping[str, Any]
Record = dict[str, Any]
RIGHT: Keys = {"traffic_side": "right"}
LEFT: Keys = {"traffic_side": "left"}
SET_UP, NOT_SET_UP = {**RIGHT, "set_up_for_crown": True}, {**RIGHT, "set_up_for_crown": False}
SET_UP_CODES = ("side_or_set_up",)
ASKS = "axle_may_be_set_up"  # for a statement, and contradicts none
# Codes of findings that name a contradiction between a statement and the drive.
NAMES_STATEMENT = (
    "roads_fall_to_other_side",
    "side_or_set_up",
    "axle_may_be_set_up",
    "set_up_contradicted",
    "play_contradicted",
    "status_contradicted",
    "wheelbase_or_ratio",
    "seems_to_reverse",
)


@dataclass(frozen=True)
class Case:
    """A population, and the keys of a vehicle file or the statuses that are right and wrong."""

    name: str
    about: str
    row: Row
    right: Callable[[Driven], Keys] = lambda driven: {}
    wrong: Callable[[Driven, Random], Keys] = lambda driven, random: {}
    status: str = ""
    spoil: Callable[[Array, Array, Random], Array] = lambda values, speed, random: values  # of the status
    true: tuple[str, ...] = ()  # codes that accuse nothing: of an axle that is set up for the crown


def inverted(values: Array, speed: Array, random: Random) -> Array:
    return 1.0 - values


def inverted_in_motion(values: Array, speed: Array, random: Random) -> Array:
    return np.where(speed > STANDING_M_S, 1.0 - values, np.nan)


def flickers(values: Array, speed: Array, random: Random) -> Array:
    """Half of the wrong ticks alone, half in bursts."""
    wrong = random.random(len(values)) < 0.5 * FLICKERS
    burst = round(BURST_S * 100.0)
    for begin in random.integers(0, len(values), round(0.5 * FLICKERS * len(values) / burst)):
        wrong[begin : begin + burst] = True
    return np.where(wrong, 1.0 - values, values)


def _play(deg: float) -> Keys:
    return {"play_deg": round(max(deg, 0.0), 2), "play_sd_deg": PLAY_SD_DEG}


def _scaled(key: str, percent: float) -> Callable[[Driven, Random], Keys]:
    """The key too large or too small by that share."""

    def wrong(driven: Driven, random: Random) -> Keys:
        factor = 1.0 + percent / 100.0
        return {key: getattr(driven.vehicle, key) * (factor if random.random() < 0.5 else 1.0 / factor)}

    return wrong


def _cases() -> Iterator[Case]:
    roads = ("thesis_drive", "country", "motorway", "town")
    for base in roads:
        ordinary = replace(ROWS["ordinary"], name=f"ordinary_{base}", base=base)
        set_up = replace(ROWS["unloads_on_crown"], name=f"set_up_{base}", base=base)
        yield Case(f"side_{base}", "other side", ordinary, lambda _: RIGHT, lambda *_: LEFT)
        yield Case(
            f"side_set_up_{base}", "the same, axle set up", set_up, lambda _: RIGHT, lambda *_: LEFT, true=SET_UP_CODES
        )
        yield Case(f"set_up_{base}", "set up, and is not", ordinary, lambda _: NOT_SET_UP, lambda *_: SET_UP)
        yield Case(f"not_set_up_{base}", "not set up, and is", set_up, lambda _: SET_UP, lambda *_: NOT_SET_UP)
    rows = {
        "resting_hand": ("steering_assist_active", STATUS_ROWS["resting_hand_with_status"]),
        "stability_control": ("stability_control_active", STATUS_ROWS["stability_control_with_status"]),
        "anti_lock": ("anti_lock_active", STATUS_ROWS["anti_lock_with_status"]),
        "reverse": ("reverse", STATUS_ROWS["reverse_with_status"]),
        "reverse_yard": ("reverse", STATUS_ROWS["reverse_yard_with_status"]),
        "axle_lifted": ("axle_lifted", STATUS_ROWS["axle_lifted_with_status"]),
    }
    for name, (status, row) in rows.items():
        yield Case(f"{name}_inverted", f"{status} is inverted", row, status=status, spoil=inverted)
        yield Case(f"{name}_flickers", f"{status} flickers", row, status=status, spoil=flickers)
    status, row = rows["resting_hand"]
    yield Case("resting_hand_moving", "the same, not sent at standstill", row, status=status, spoil=inverted_in_motion)
    for base in ("thesis_drive", "motorway"):
        ordinary = replace(ROWS["ordinary"], name=f"ordinary_{base}", base=base)
        for size, wrong in PLAYS.items():
            yield Case(f"play_{size}_{base}", f"play: {size}", ordinary, lambda d: _play(d.play_deg), wrong)
    for key in ("steering_ratio", "wheelbase_m"):
        for percent in (10.0, 20.0):
            name = f"{key.split('_')[-1 if key == 'steering_ratio' else 0]}_{percent:.0f}"
            row = replace(ROWS["ordinary"], name="ordinary_thesis_drive")
            yield Case(name, f"{key} {percent:.0f} % off", row, wrong=_scaled(key, percent))


PLAYS: Mapping[str, Callable[[Driven, Random], Keys]] = {
    "half": lambda driven, _: _play(driven.play_deg / 2.0),
    "quarter": lambda driven, _: _play(driven.play_deg / 4.0),
    "double": lambda driven, _: _play(driven.play_deg * 2.0),
    "fourfold": lambda driven, _: _play(min(driven.play_deg * 4.0, 25.0)),
    "8_more": lambda driven, _: _play(driven.play_deg + 8.0),
}
CASES = {case.name: case for case in _cases()}


def _vehicle(driven: Driven, keys: Keys) -> Vehicle:
    own = driven.vehicle
    given = {name: getattr(own, name) for name in own.model_fields_set if name not in ("name", "params")}
    return vehicle_from({**given, **keys}, own.name)


def _spoiled(driven: Driven, case: Case, random: Random) -> oc.Signals:
    if not case.status:
        return driven.signals
    column = SIGNALS[case.status].column
    speed = driven.signals.table["vehicle_speed_m_s"].to_numpy()
    values = case.spoil(driven.signals.table[column].to_numpy(), speed, random)
    return replace(driven.signals, table=driven.signals.table.with_columns(pl.Series(column, values)))


def _answered(signals: oc.Signals, vehicle: Vehicle, target_deg: float, true: tuple[str, ...] = ()) -> Record:
    """Status, error, half-width and findings, deg."""
    try:
        answer = oc.offset(signals, vehicle)
    except OncenterError as error:
        return {"status": error.code, "codes": [], "texts": []}
    found = {
        "status": answer.offset.status,
        "codes": [finding.code for finding in answer.findings if finding.code in NAMES_STATEMENT],
        "accused": any(
            f.code in NAMES_STATEMENT and f.code not in (ASKS, *true) and f.severity != "info" for f in answer.findings
        ),
        "texts": [finding.line() for finding in answer.findings if finding.severity != "info"],
        "fault": answer.sensor_fault,
        "used_s": answer.used_s,
    }
    if answer.offset.value is None or answer.offset.ci95 is None:
        return found
    low, high = (end / DEGREE for end in answer.offset.ci95)
    off = answer.offset.value / DEGREE - target_deg
    return found | {
        "error": off,
        "half_width": 0.5 * (high - low),
        "holds": low <= target_deg <= high,
        "harm": found["status"] == "valid" and abs(off) > HARMFUL_DEG and not low <= target_deg <= high,
    }


def right_and_wrong(driven: Driven, case: Case, seed: int) -> dict[str, tuple[oc.Signals, Vehicle]]:
    """What is asked of a drive with the right statement and with the wrong one."""
    random = np.random.default_rng([seed, zlib.crc32(case.name.encode())])
    right, wrong = case.right(driven), case.wrong(driven, random)
    return {
        "right": (driven.signals, _vehicle(driven, right)),
        "wrong": (_spoiled(driven, case, random), _vehicle(driven, {**right, **wrong})),
    }


def record(case: Case, seed: int, folder: Path) -> Record:
    driven = Garage(folder, seed).of_row(case.row)
    ways = right_and_wrong(driven, case, seed)
    return {
        "case": case.name,
        "seed": seed,
        "right": _answered(*ways["right"], driven.offset_deg, case.true),
        "wrong": _answered(*ways["wrong"], driven.offset_deg),
    }


def lines(found: Sequence[Record], before: Sequence[Record]) -> Iterator[str]:
    yield (
        "| case | drives | right: valid | holds | accused | wrong: valid | holds | named | harm | without a word "
        "| largest error, valid | median half-width, right | wrong |"
    )
    yield "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
    for name in [*dict.fromkeys(record["case"] for record in found), "all"]:
        some = [record for record in found if name in (record["case"], "all")]
        yield f"| {name} | {len(some)} | {' | '.join(_cells(some))} |"
    old = {(record["case"], record["seed"]): record["right"] for record in before}
    both = [(r["right"], old[key]) for r in found if (key := (r["case"], r["seed"])) in old]
    if both:
        yield from ("", *_compared(both))


def _cells(some: Sequence[Record]) -> Iterator[str]:
    right, wrong = [record["right"] for record in some], [record["wrong"] for record in some]
    valid = [answer for answer in wrong if answer["status"] == "valid"]
    yield str(sum(answer["status"] == "valid" for answer in right))
    yield str(sum(answer.get("holds", False) for answer in right))
    yield str(sum(answer.get("accused", False) for answer in right))
    yield str(len(valid))
    yield str(sum(answer.get("holds", False) for answer in wrong))
    yield str(sum(bool(answer["codes"]) for answer in wrong))
    yield str(sum(answer.get("harm", False) for answer in wrong))
    yield str(sum(answer.get("harm", False) and not answer["codes"] for answer in wrong))
    yield f"{max((abs(answer['error']) for answer in valid), default=0.0):.2f}"
    for answers in (right, wrong):
        yield f"{median([answer['half_width'] for answer in answers if 'half_width' in answer] or [0.0]):.2f}"


def _compared(both: Sequence[tuple[Record, Record]]) -> Iterator[str]:
    """Right statements now and before, which must lose nothing."""
    held = [(new, old) for new, old in both if old["status"] == "valid" and old["holds"]]
    stay = [(new, old) for new, old in held if new["status"] == "valid" and new["holds"]]
    wider = median(new["half_width"] / old["half_width"] for new, old in stay)
    accused = sum(new.get("accused", False) for new, _ in both)
    yield f"right statements: {len(stay)} of {len(held)} stay valid and hold (asked: {len(held) * (1 - FEWER_MAX):.0f})"
    yield f"half-widths {wider:.3f} of those before in the median (asked: at most {WIDER_MAX})"
    yield f"accused: {accused} of {len(both)} (asked: at most {ACCUSED_MAX * len(both):.0f})"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="of the drives")
    parser.add_argument("--drives", type=int, default=12, help="of each case (12)")
    parser.add_argument("--cases", default="", help="names separated by commas; default: all")
    parser.add_argument(
        "--seeds", choices=("tuning", "reported"), default="reported", help="from 1 on, or from 1001 on"
    )
    parser.add_argument("--against", type=Path, help="records of an earlier run")
    parser.add_argument("--smoke", action="store_true", help="one drive of two cases: whether the bench runs")
    given = parser.parse_args()
    names = ["side_country", "anti_lock_flickers"] if given.smoke else names_of(given.cases, list(CASES), "case")
    first = TUNING_FROM if given.seeds == "tuning" else REPORTED_FROM
    wanted = [(n, seed) for n in names for seed in range(first, first + (1 if given.smoke else given.drives))]
    found = []
    for name, seed in wanted:
        found.append(record(CASES[name], seed, given.folder))
        progress(len(found), len(wanted))
    BUILD.mkdir(parents=True, exist_ok=True)
    (BUILD / "wrong_statements.json").write_text(json.dumps(found, indent=1), encoding="utf-8")
    before = json.loads(given.against.read_text(encoding="utf-8")) if given.against else []
    print("\n".join(lines(found, before)))


if __name__ == "__main__":
    main()
