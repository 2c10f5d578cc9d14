"""Healthy trucks with healthy sensors: accusations, which are all false, and the share of valid offsets.

    python bench/healthy.py [--drives N] [--rows a,b] [--seeds tuning|reported] [--jobs N] [--against FILE] [--smoke]

The rows are those of accuracy.py and effects.py whose truck, sensors and vehicle file have no fault. A finding of
severity warning or error, or a verdict "check" or "repair", counts as an accusation unless the drawn truck has what it
says. All records go to build/accuracy/healthy.json; --against compares with an earlier copy of that file. Asked: at
most 1 accusation in 300 drives, and no row with 2 drives of 60 fewer valid.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from accuracy import BUILD, REPORTED_FROM, TUNING_FROM, names_of, progress
from accuracy_rows import ROWS, Drive, Row, drive
from effects_rows import EFFECTS
from said import Answer, Statement, statements

import oncenter as oc
from oncenter.errors import OncenterError
from oncenter.findings import PLAY_STANDARD_DEG
from oncenter.signals import DEGREE

Record = dict[str, Any]

ACCUSATIONS_MAX = 1.0 / 300.0
FEWER_VALID_MAX = 2.0 / 60.0

NOT_HEALTHY: Mapping[str, str] = {
    "play_15_aligning": "play at the maintenance standard",
    "play_15_friction": "play at the maintenance standard",
    "gyro_3_deg_s": "yaw rate sensor at the end of its specification",
    "gyro_drift": "yaw rate sensor drifts",
    "accelerometer_plus": "accelerometer zero 0.3 m/s^2 off",
    "accelerometer_minus": "accelerometer zero 0.3 m/s^2 off",
    "pull": "alignment pulls",
    "unloads_on_crown": "axle set up to pull",
    "torque_pull": "alignment pulls",
    "remounted": "angle sensor moves",
    "self_correction": "sender changes the angle",
    "vehicle_off": "vehicle file wrong",
    "wrong_side": "vehicle file wrong",
    "population": "draws all of these",
    "effect play_15": "play at the maintenance standard",
    "effect pull": "alignment pulls",
    "effect pull_half": "alignment pulls",
    "effect pull_double": "alignment pulls",
    "effect pull_and_wind": "alignment pulls",
    "effect combined_sensors": "accelerometer drifts, alignment pulls",
    "effect combined_steering": "accelerometer learns its zero again",
    "effect combined_trailer": "accelerometer drifts",
    **{
        f"effect {name}{size}": why
        for name, why in (
            ("accelerometer_drift", "accelerometer drifts"),
            ("relearning", "accelerometer learns its zero again"),
            ("overlay_motor", "lash of 1.5 to 6 deg in the column, behind the sensor"),
            ("axle_set_up", "axle set up to pull"),
        )
        for size in ("", "_half", "_double")
    },
    "effect accelerometer_drift_thesis": "accelerometer drifts",
}
ALL_ROWS: Mapping[str, Row] = {**ROWS, **{f"effect {name}": row for name, row in EFFECTS.items()}}
HEALTHY = {name: row for name, row in ALL_ROWS.items() if name not in NOT_HEALTHY}

# Warnings that ask for driving, or for nothing, and accuse neither truck nor sensor nor file.
_ASKS_FOR_DRIVING = ("one_flank_seen", "no_understeer", "not_enough_evidence", "gate_shut")
_LARGE_YAW_RATE_BIAS_DEG_S, _HEALTHY_OFFSET_DEG = 0.5, 2.0
_HEALTHY_ACCELEROMETER_M_S2, _NEUTRAL_M_S2 = 0.25, 0.1
_NEAR = 0.8  # of a threshold: a value from there on may be called beyond it


def is_false(said: Statement, driven: Drive) -> bool:
    """Whether an accusation is not of something that the drawn truck has."""
    truth, code = driven.truth, said.code
    if not said.accuses or said.severity == "note" or code in _ASKS_FOR_DRIVING:
        return False
    if "free play" in code or code == "steering_play":
        play = truth.backlash_rad + truth.windup_rad + truth.torsion_bar_rad
        return play / DEGREE < _NEAR * PLAY_STANDARD_DEG
    if code in ("yaw_rate_bias", "yaw rate sensor: check"):
        return abs(truth.yaw_rate_bias_rad_s / DEGREE) < _NEAR * _LARGE_YAW_RATE_BIAS_DEG_S
    if code == "steering_wheel_angle_offset":
        return abs(float(driven.target_rad[-1])) / DEGREE < _NEAR * _HEALTHY_OFFSET_DEG
    if code in ("unloading_off_zero", "accelerometer: check") and "lateral force" in said.text:
        return abs(_neutral_m_s2(driven)) < _NEAR * _NEUTRAL_M_S2
    if code in ("lateral_acceleration_at_standstill", "accelerometer: check"):
        return abs(truth.lateral_acceleration_bias_m_s2) < _NEAR * _HEALTHY_ACCELEROMETER_M_S2
    return True


def _neutral_m_s2(driven: Drive) -> float:
    """The accelerometer's reading without lateral force at the front axle."""
    by_pull = driven.truth.unloading_acceleration_m_s2
    pull = 0.0 if math.isnan(by_pull) else by_pull
    return driven.truth.lateral_acceleration_bias_m_s2 + pull + driven.wind_m_s2


def answered(driven: Drive) -> Answer:
    try:
        return oc.offset(driven.signals, driven.vehicle).to_dict()
    except OncenterError as error:
        return {"code": error.code, "message": str(error)}


def record(name: str, seed: int, folder: Path) -> Record:
    driven = drive(HEALTHY[name], seed, folder)
    answer = answered(driven)
    false = [each for each in statements(answer) if is_false(each, driven)]
    return {
        "row": name,
        "seed": seed,
        "status": answer["offset"]["status"] if "offset" in answer else answer["code"],
        "accusations": sorted({each.code for each in false}),
        "texts": [each.text for each in false],
    }


def run_all(rows: Sequence[str], seeds: Sequence[int], jobs: int) -> list[Record]:
    """All records, in the order of rows and seeds."""
    wanted = [(row, seed) for row in rows for seed in seeds]
    with (
        tempfile.TemporaryDirectory() as name,
        ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool,
    ):
        running = {pool.submit(record, *key, Path(name)): key for key in wanted}
        done: dict[tuple[str, int], Record] = {}
        for future in as_completed(running):
            done[running[future]] = future.result()
            progress(len(done), len(wanted))
    return [done[key] for key in wanted]


def lines(found: Sequence[Record], before: Sequence[Record]) -> Iterator[str]:
    yield "| row | drives | valid | valid before | changed status | accused | of what |"
    yield "|---|--:|--:|--:|--:|--:|---|"
    statuses = {(record["row"], record["seed"]): record["status"] for record in before}
    fewer = []
    for name in [*dict.fromkeys(record["row"] for record in found), "all"]:
        some = [record for record in found if name in (record["row"], "all")]
        valid = sum(record["status"] == "valid" for record in some)
        both = [
            (record["status"], statuses[key]) for record in some if (key := (record["row"], record["seed"])) in statuses
        ]
        valid_before, changed = sum(old == "valid" for _, old in both), sum(new != old for new, old in both)
        if both and valid_before - sum(new == "valid" for new, _ in both) > FEWER_VALID_MAX * len(both):
            fewer.append(name)
        accused = sum(bool(record["accusations"]) for record in some)
        codes = Counter(code for record in some for code in record["accusations"])
        of = ", ".join(f"{code} {count}" for code, count in codes.most_common())
        yield f"| {name} | {len(some)} | {valid} | {valid_before if both else '-'} | {changed} | {accused} | {of} |"
    yield ""
    yield f"accused: {accused} of {len(found)} drives (asked: at most {ACCUSATIONS_MAX * len(found):.1f})"
    if before:
        yield f"rows with fewer valid: {', '.join(fewer) or 'none'}; changed status {changed / max(len(both), 1):.2%}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drives", type=int, default=60, help="of each row (60)")
    parser.add_argument("--rows", default="", help="names separated by commas; default: all")
    parser.add_argument(
        "--seeds", choices=("tuning", "reported"), default="reported", help="from 1 on, or from 1001 on"
    )
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--against", type=Path, help="records of an earlier run")
    parser.add_argument("--smoke", action="store_true", help="one drive of one row: whether the bench runs")
    given = parser.parse_args()
    rows = ["ordinary"] if given.smoke else names_of(given.rows, list(HEALTHY), "row")
    first = TUNING_FROM if given.seeds == "tuning" else REPORTED_FROM
    seeds = range(first, first + (1 if given.smoke else given.drives))
    before = json.loads(given.against.read_text(encoding="utf-8")) if given.against else []
    found = run_all(rows, seeds, given.jobs)
    BUILD.mkdir(parents=True, exist_ok=True)
    (BUILD / "healthy.json").write_text(json.dumps(found, indent=1), encoding="utf-8")
    print("\n".join(lines(found, before)))


if __name__ == "__main__":
    main()
