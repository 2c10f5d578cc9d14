"""Effects of real trucks outside the usual model, one at a time: their influence on answer and intervals.

    python bench/effects.py [--drives N] [--rows a,b | --statuses] [--jobs N] [--tuning] [--page]

A row of effects_rows.py is N drives of 20 minutes; --statuses takes the rows with and without status signals. Seeds
from 1001 on are for reporting, seeds from 1 on (--tuning) for tuning. All records go to build/accuracy/; --page, which
takes all other rows, writes the section "Real-truck effects" of docs/accuracy.md.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from accuracy import BUILD, REPORTED_FROM, TUNING_FROM, names_of, progress
from accuracy_rows import MOVING_M_S, Drive, drive
from effects_rows import EFFECTS, PULLS, STATUS_ROWS, WINDS

import oncenter as oc
from oncenter.estimates.estimate import Estimate
from oncenter.signals import DEGREE
from oncenter.simulate.truck import steered_stiffness_n_rad

LOST_AT_S = 600.0  # the virtual angle has no sensor from here on
FAST_M_S = 8.0
WITH_ANGLE = ("none", "accelerometer_drift", "overlay_motor", "relearning", "wind_moment", "load_change")
ACCUSING = ("offset_changed", "steering_wheel_angle_sensor_at_fault", "signals_at_fault")
OTHERS = ("understeer_gradient", "backlash", "yaw_rate_bias")

Record = dict[str, Any]


def record(row: str, seed: int, folder: Path, with_angle: bool, params: Mapping[str, float]) -> Record:
    """One drive; angles in deg."""
    driven = drive((EFFECTS | STATUS_ROWS)[row], seed, folder)
    answer = oc.offset(driven.signals, driven.vehicle, params=params)
    front = float(driven.target_rad[-1])
    target = front - rear_part_rad(driven)
    offset = answer.combined_offset or answer.offset
    unloads = float(np.nan_to_num(driven.truth.unloading_acceleration_m_s2))
    by_wind = held_against_wind_rad(driven) if row in WINDS else 0.0
    pulled = driven.angle_per_m_s2 * unloads + by_wind
    said: Record = {"row": row, "seed": seed, "valid": offset.status == "valid"}
    said |= _judged("offset", offset, target, target)
    less_pull = _judged("offset", offset, target + pulled, target + pulled)
    said |= {f"less_pull_{key}": value for key, value in less_pull.items()}
    said |= _of_drive(answer, front + answer.offset_per_acceleration * unloads + by_wind)
    for name, truth in _truths(driven).items():
        said |= _judged(name, getattr(answer, name), *truth)
    if answer.rear_axle_offset is not None:
        rear = driven.truth.rear_axle_offset_rad or 0.0
        said |= _judged("front_axle", answer.offset, front, front)
        said |= _judged("rear_axle", answer.rear_axle_offset, rear, rear)
    said["findings"] = [finding.code for finding in answer.findings if finding.severity != "info"]
    said["names_accelerometer"] = any(finding.code == "lateral_acceleration_moves" for finding in answer.findings)
    said["errors"] = [finding.code for finding in answer.findings if finding.severity == "error"]
    said["fault"] = answer.sensor_fault
    said["changes_deg"] = [(change.size_rad or 0.0) / DEGREE for change in answer.changes]
    return said | (_angle(driven) if with_angle else {})


def rear_part_rad(driven: Drive) -> float:
    """The rear axle's part of the offset, where the log has that axle's angle: ratio times weight times its offset."""
    weight = driven.vehicle.params.get("rear_axle_weight_1", 0.0)
    return driven.vehicle.ratio_near_centre * weight * (driven.truth.rear_axle_offset_rad or 0.0)


def held_against_wind_rad(driven: Drive) -> float:
    """Mean steering wheel angle that holds a truck of two axles straight in its wind; i K_us F/m without an arm."""
    scenario, truth = driven.scenario, driven.truth
    truck, wind = scenario.truck, scenario.wind
    assert wind is not None
    moving = truth.table["vehicle_speed_m_s"].to_numpy() > MOVING_M_S
    force_n = float(truth.table["wind_side_force_n"].to_numpy()[moving].mean())
    to_front_m, to_rear_m = truck.front_axle_distance_m, truck.wheelbase_m - truck.front_axle_distance_m
    front_n = -force_n * (to_rear_m + wind.force_arm_m) / truck.wheelbase_m
    rear_n = -force_n * (to_front_m - wind.force_arm_m) / truck.wheelbase_m
    slip_rad = front_n / steered_stiffness_n_rad(truck, scenario.steering)
    return truth.steering_ratio * (slip_rad - rear_n / truck.rear_cornering_stiffness_n_rad)


def _of_drive(answer: oc.Answer, target: float) -> Record:
    """Error of the drive's own interval over its half-width, without the part caused by the pull."""
    if answer.offset.value is None or answer.offset_half_width_rad is None:
        return {"drive_ratio": None}
    return {"drive_ratio": abs(answer.offset.value - target) / answer.offset_half_width_rad}


def _truths(driven: Drive) -> dict[str, tuple[float, float]]:
    """Range of the play at the end of the drive: twist and motor lash act as play only in some motions."""
    truth = driven.truth
    gradient = truth.load_changed_understeer_gradient or truth.understeer_gradient
    motor = driven.scenario.steering.overlay_motor
    lash_rad = 0.0 if motor is None else motor.lash_deg * DEGREE
    play = truth.backlash_rad + truth.windup_rad
    return {
        "understeer_gradient": (gradient, gradient),
        "backlash": (play - lash_rad, play + truth.torsion_bar_rad),
        "yaw_rate_bias": (truth.yaw_rate_bias_rad_s, truth.yaw_rate_bias_rad_s),
    }


def _judged(name: str, said: Estimate, least: float, most: float) -> Record:
    """Error and half-width (in the unit of files), and whether the interval contains the truth or part of its range."""
    if said.value is None or said.ci95 is None:
        return {f"{name}_{key}": None for key in ("error", "half_width", "holds")} | {f"{name}_status": said.status}
    low, high = said.ci95
    return {
        f"{name}_error": (said.value - min(max(said.value, least), most)) / DEGREE,
        f"{name}_half_width": 0.5 * (high - low) / DEGREE,
        f"{name}_holds": low <= most and least <= high,
        f"{name}_status": said.status,
    }


def _angle(driven: Drive) -> Record:
    """The virtual angle after the loss of the sensor: RMS error in deg, and share of ticks within its interval."""
    table = oc.angle(driven.signals, driven.vehicle, sensor_lost_at=LOST_AT_S)
    truth = driven.truth
    true = truth.table["steering_wheel_angle_rad"].to_numpy() - truth.straight_ahead_rad
    error = table["steering_wheel_angle_rad"].to_numpy() - true
    after = (np.arange(len(true)) >= LOST_AT_S * 100) & (truth.table["vehicle_speed_m_s"].to_numpy() > FAST_M_S)
    inside = np.abs(error) < 1.96 * table["standard_deviation_rad"].to_numpy()
    return {
        "angle_rms": float(np.sqrt(np.mean(error[after] ** 2))) / DEGREE,
        "angle_covered": float(np.mean(inside[after])),
    }


def run(rows: Sequence[str], seeds: range, jobs: int, params: Mapping[str, float]) -> pl.DataFrame:
    """All records, in the order of rows and seeds."""
    wanted = [(row, seed) for row in rows for seed in seeds]
    # spawned: polars' threads do not survive a fork
    spawn = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory() as name, ProcessPoolExecutor(jobs, spawn) as pool:
        running = {pool.submit(record, *key, Path(name), key[0] in WITH_ANGLE, params): key for key in wanted}
        done: dict[tuple[str, int], Record] = {}
        for future in as_completed(running):
            done[running[future]] = future.result()
            progress(len(done), len(wanted))
    return pl.DataFrame([done[key] for key in wanted], infer_schema_length=None)


def judged(row: str, name: str) -> str:
    """The column that judges the row's offset: without the pull if its truth has one."""
    return f"less_pull_{name}" if row in PULLS else name


def summary(row: str, part: pl.DataFrame) -> Record:
    """A row's figures; errors in deg."""
    error = part[judged(row, "offset_error")].cast(pl.Float64).abs().to_numpy()
    holds = part[judged(row, "offset_holds")].cast(pl.Boolean).fill_null(False).to_numpy()
    valid = part["valid"].to_numpy()
    said: Record = {"row": row, "drives": len(part), "valid": int(valid.sum()), "covered": int(holds.sum())}
    said["covered_valid"] = int(holds[valid].sum())
    ratio = part["drive_ratio"].cast(pl.Float64).fill_null(np.inf).to_numpy()
    said["drive_covered"], said["drive_covered_valid"] = int(np.sum(ratio < 1.0)), int(np.sum(ratio[valid] < 1.0))
    said["drive_ratio"] = float(np.median(ratio))
    for name, values in (("all", error), ("valid", error[valid])):
        said[name + "_error"] = [float(np.quantile(values, q)) for q in (0.5, 0.95, 1.0)] if len(values) else None
    for name in OTHERS:
        own = part.filter(pl.col(f"{name}_status") == "valid")
        said[name] = (
            int(own[f"{name}_holds"].sum()),
            len(own),
            float(own[f"{name}_error"].cast(pl.Float64).median() or 0),
        )
    findings = [code for codes in part["findings"].to_list() for code in codes]
    said["accused"] = {code: findings.count(code) for code in ACCUSING if code in findings}
    said["changes_deg"] = [round(size, 1) for sizes in part["changes_deg"].to_list() for size in sizes]
    said["names_accelerometer"] = int(part["names_accelerometer"].sum())
    said["faults"] = [fault for fault in part["fault"].to_list() if fault != "none"]
    if "rear_axle_error" in part.columns and part["rear_axle_error"].count() > 0:
        said["both_axles"] = {
            name: (part[f"{name}_error"].count(), int(part[f"{name}_holds"].sum()), float(error.abs().max()))
            for name in ("front_axle", "rear_axle")
            for error in [part[f"{name}_error"].cast(pl.Float64)]
        }
    if "angle_rms" in part.columns and part["angle_rms"].null_count() == 0:
        said["angle"] = (float(part["angle_rms"].median() or 0), float(part["angle_covered"].mean() or 0))
    return said


def print_table(summaries: Sequence[Record]) -> None:
    print(
        f"{'row':28}{'n':>4}{'valid':>6} | {'v.med':>5}{'v.p95':>6}{'v.max':>6} |{'cov.v':>6}{'cov':>5} |"
        f"{'med':>6}{'p95':>6} | K_us, play, gyro: hold of valid, median error"
    )
    for s in summaries:
        good = " ".join(f"{value:5.2f}" for value in s["valid_error"] or [])
        others = "  ".join(f"{s[name][0]:3}/{s[name][1]:<3}{s[name][2]:+.2f}" for name in OTHERS)
        angle = f" angle {s['angle'][0]:.2f} {s['angle'][1]:.0%}" if "angle" in s else ""
        print(
            f"{s['row']:28}{s['drives']:4}{s['valid']:6} | {good:17} |{s['covered_valid']:6}{s['covered']:5} |"
            f"{s['all_error'][0]:6.2f}{s['all_error'][1]:6.2f} | drive {s['drive_covered_valid']:3}"
            f"{s['drive_covered']:4} {s['drive_ratio']:.2f} | {others} "
            f"{s['accused'] or ''} {s['faults'] or ''} {s['changes_deg'] or ''}{angle}"
            f" names accelerometer {s['names_accelerometer']} {s.get('both_axles', '')}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drives", type=int, default=60, help="of each row (60)")
    parser.add_argument("--rows", default="", help="names separated by commas; default: all of the page")
    parser.add_argument("--statuses", action="store_true", help="the rows with and without status signals")
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--tuning", action="store_true", help="seeds from 1 on instead of the reported ones")
    parser.add_argument("--params", default="", help="name=value of core/truck/params.h, separated by commas")
    parser.add_argument("--page", action="store_true", help="write the section of docs/accuracy.md")
    given = parser.parse_args()
    if given.page and (given.tuning or given.rows or given.params or given.statuses):
        parser.error("--page reports all rows with the default parameters, on the seeds for it")
    pairs = (pair.partition("=") for pair in given.params.split(",") if pair)
    params = {name: float(value) for name, _, value in pairs}
    known = EFFECTS | STATUS_ROWS if given.rows else STATUS_ROWS if given.statuses else EFFECTS
    rows = names_of(given.rows, list(known), "row")
    first = TUNING_FROM if given.tuning else REPORTED_FROM
    seeds = range(first, first + given.drives)
    table = run(rows, seeds, given.jobs, params)
    BUILD.mkdir(parents=True, exist_ok=True)
    name = "effects_tuning" if given.tuning else "effects"
    table.write_parquet(BUILD / f"{name}.parquet")
    summaries = [summary(str(row), part) for (row,), part in table.group_by("row", maintain_order=True)]
    print_table(summaries)
    (BUILD / f"{name}.json").write_text(json.dumps(summaries, indent=1), encoding="utf-8")
    if given.page:
        from effects_page import write_section

        write_section(table, summaries, seeds)


if __name__ == "__main__":
    main()
