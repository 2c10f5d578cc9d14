"""Healthy trucks with wide play, many nearly always on one flank: is what is sure also right?

    python bench/flanks.py FOLDER [--rows a,b] [--drives N] [--seeds tuning|reported] [--jobs N] [--against FILE]

The rows here have 8 to 15 deg of play, on mixed roads and motorways, with traffic on either side; those named `seldom`
have few bends to the side that takes the wheels off their flank. Any row of accuracy_rows.py and effects_rows.py can be
given as well. The drives stay in FOLDER. Errors are those of the offset less the pull, as far as the drive shows it.
Asked: none valid and more than 1 deg off, offset and play hold in 92 %. All records go to build/accuracy/flanks.json;
--against compares with an earlier copy of that file.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import numpy as np
from accuracy import BUILD, REPORTED_FROM, TUNING_FROM, names_of, progress
from accuracy_rows import ROWS, Row, Table
from effects_rows import EFFECTS, STATUS_ROWS
from one_truck_drives import Garage, said_of
from population import PRIORS, Normal, Random, Uniform

import oncenter as oc
from oncenter.errors import OncenterError
from oncenter.signals import DEGREE

Record = dict[str, Any]
FAR_DEG, RARE, MOVING_M_S = 1.0, (0.01, 0.03), 3.0  # share of the driven time off the usual flank
KEEPS_SIDE, BENDS = 0.93, 150  # probability that a bend leaves the wheels on their flank; bends until the road repeats
FRICTION = "king_pin_friction_m_s2"
WIDE: Table = {"backlash_deg": Uniform(8.0, 15.0), FRICTION: PRIORS[FRICTION][0], "crown_percent": Normal(2.2, 0.6)}


def few_bends_to_one_side(
    side: float, speeds_km_h: tuple[float, float], radii_m: tuple[float, float]
) -> Callable[[Random], Table]:
    """Straights and bends, most of them to `side`."""

    def extra(random: Random) -> Table:
        sections: list[Table] = []
        for _ in range(BENDS):
            speed = {"speed_km_h": round(float(random.uniform(*speeds_km_h)), 1)}
            radius, turn_deg = float(np.exp(random.uniform(*np.log(radii_m)))), float(random.uniform(8.0, 50.0))
            turned = side if random.random() < KEEPS_SIDE else -side
            sections.append({"length_m": round(float(random.uniform(150.0, 900.0))), **speed})
            bend = {"length_m": round(radius * turn_deg * DEGREE + 100.0, 1), "turn_deg": round(turned * turn_deg, 2)}
            sections.append({**bend, **speed})
        return {"road": {"kind": "sections", "clothoid_length_m": 50.0, "repeat": True, "sections": sections}}

    return extra


def _rows() -> Iterator[Row]:
    for side, sign in (("right", 1.0), ("left", -1.0)):
        mixed = few_bends_to_one_side(sign, (45.0, 85.0), (250.0, 1500.0))
        fast = few_bends_to_one_side(sign, (75.0, 90.0), (600.0, 3000.0))
        common: Table = {"fixed": WIDE, "traffic_side": side}
        yield Row(f"wide_mixed_{side}", "mixed roads", **common)
        yield Row(f"wide_motorway_{side}", "motorway", base="motorway", **common)
        yield Row(f"seldom_mixed_{side}", "mixed roads, few bends to one side", extra=mixed, **common)
        yield Row(f"seldom_motorway_{side}", "motorway, few bends to one side", base="motorway", extra=fast, **common)


FLANK_ROWS = {row.name: row for row in _rows()}
ALL: Mapping[str, Row] = {
    **FLANK_ROWS,
    **ROWS,
    **{f"effect_{name}": row for name, row in {**EFFECTS, **STATUS_ROWS}.items()},
}


def record(folder: Path, name: str, seed: int) -> Record:
    """One drive; angles in deg."""
    place = folder / "effects" if name.startswith("effect_") else folder  # some rows of both benches share a name
    driven = Garage(place, seed).of_row(ALL[name])
    moving = driven.signals.table["vehicle_speed_m_s"].to_numpy() > MOVING_M_S
    in_play = driven.place_in_play[moving]
    found: Record = {
        "row": name,
        "seed": seed,
        "rare": float(min(np.mean(in_play > 0.0), np.mean(in_play < 0.0))) if in_play.size else 0.0,
        "play": driven.play_deg,
        "codes": [],
        "states": {},
    }
    try:
        answer = oc.offset(driven.signals, driven.vehicle)
    except OncenterError as error:
        return found | {"status": error.code}
    said = answer.to_dict()
    found["states"] = {each["about"]: each["state"] for each in said["verdicts"]}
    found["said_play"] = said["backlash"]
    return found | said_of(answer, driven.offset_deg, driven.pull_m_s2)


def run(folder: Path, wanted: Sequence[tuple[str, int]], jobs: int) -> list[Record]:
    """All records, in the order asked for."""
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        running = {pool.submit(record, folder, *key): key for key in wanted}
        done: dict[tuple[str, int], Record] = {}
        for future in as_completed(running):
            done[running[future]] = future.result()
            progress(len(done), len(wanted))
    return [done[key] for key in wanted]


def holds(found: Record) -> bool:
    return abs(found["error"]) < found["half_width"]


def holds_play(found: Record) -> bool:
    interval = found["said_play"]["ci95"]
    return interval is None or bool(interval[0] <= found["play"] <= interval[1])


def is_on_one_flank(found: Record) -> bool:
    return RARE[0] <= found["rare"] <= RARE[1]


def lines(found: Sequence[Record]) -> Iterator[str]:
    yield "| row | drives | on one flank | valid | of these beyond 1 deg | hold | play holds | half-width, deg |\
 error / half-width | seems_steered | sensor moves |"
    yield "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
    for name in [*dict.fromkeys(each["row"] for each in found), "all", "all on one flank"]:
        some = [each for each in found if name in (each["row"], "all") or (is_on_one_flank(each) and "one" in name)]
        answered = [each for each in some if "error" in each]
        valid = [each for each in answered if each["status"] == "valid"]
        cells = [
            len(some),
            sum(map(is_on_one_flank, some)),
            len(valid),
            sum(abs(each["error"]) > FAR_DEG for each in valid),
            f"{sum(map(holds, answered))} of {len(answered)}",
            sum(map(holds_play, answered)),
            _median([each["half_width"] for each in valid]),
            _median([abs(each["error"]) / each["half_width"] for each in answered]),
            sum("seems_steered" in each["codes"] for each in some),
            sum("zero_moves" in each["codes"] for each in some),
        ]
        yield f"| {name} | {' | '.join(map(str, cells))} |"


def _median(values: Sequence[float]) -> str:
    return f"{np.median(values):.2f}" if values else "-"


def against(found: Sequence[Record], before: Sequence[Record]) -> Iterator[str]:
    """What became of the valid answers whose interval held."""
    earlier = {(each["row"], each["seed"]): each for each in before}
    pairs = [(earlier[key], each) for each in found if (key := (each["row"], each["seed"])) in earlier]
    held = [(old, new) for old, new in pairs if old["status"] == "valid" and "error" in old and holds(old)]
    still = [new["half_width"] / old["half_width"] for old, new in held if new["status"] == "valid"]
    yield f"of {len(held)} valid that held {len(still)} are valid, half-widths {_median(still)} times as wide (median)"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="of the drives")
    parser.add_argument("--rows", default="", help="names separated by commas; default: those of wide play")
    parser.add_argument("--drives", type=int, default=25, help="of each row (25)")
    parser.add_argument(
        "--seeds", choices=("tuning", "reported"), default="reported", help="from 1 on, or from 1001 on"
    )
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--against", type=Path, help="records of an earlier run")
    parser.add_argument("--smoke", action="store_true", help="one drive of one row: whether the bench runs")
    given = parser.parse_args()
    rows = ["seldom_mixed_right"] if given.smoke else names_of(given.rows, list(ALL), "row")
    rows = rows if given.rows or given.smoke else list(FLANK_ROWS)
    first = TUNING_FROM if given.seeds == "tuning" else REPORTED_FROM
    seeds = range(first, first + (1 if given.smoke else given.drives))
    found = run(given.folder, [(row, seed) for row in rows for seed in seeds], given.jobs)
    BUILD.mkdir(parents=True, exist_ok=True)
    (BUILD / "flanks.json").write_text(json.dumps(found, indent=1), encoding="utf-8")
    print("\n".join(lines(found)))
    if given.against:
        print("\n".join(against(found, json.loads(given.against.read_text(encoding="utf-8")))))


if __name__ == "__main__":
    main()
