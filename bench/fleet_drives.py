"""A simulated fleet: trucks driven every working day, some with a remounted sensor, a new alignment or another gyro.

A truck keeps its parameters, pull, accelerometer bias and gyro bias; road, load, wind and crown change with every
drive. Each drive is one Parquet file of its truck's folder, 100 Hz, float32 in SI, time_s since 1970.

    python bench/fleet_drives.py FOLDER --trucks 100 --drives 20 --seed 1
"""

from __future__ import annotations

import argparse
import json
import math
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pyarrow.parquet as pq
from accuracy_rows import ATTEMPTS, EVERY_ROW, as_toml
from population import PRIORS, Draw, Normal, Random, Uniform, draw, sensors, steering, truck, wind

import oncenter as oc
from oncenter.errors import OncenterError
from oncenter.signals import DEGREE

DURATION_S = 1800.0
FIRST_DAY = datetime(2026, 3, 2, 6, 0, tzinfo=UTC)
ROADS = ("thesis_drive", "country", "motorway", "town")
PER_TRUCK = {**EVERY_ROW, "offset_deg": Normal(0.0, 0.5), "backlash_deg": Uniform(2.0, 8.0)}
PER_DRIVE = ("rear_axle_load_kg", "wind_m_s", "gust_sd_m_s", "crown_percent", "rough_bank_sd_percent", "heading_deg")
GYRO_WANDERS_SD_DEG_S = 0.03  # between drives, as by temperature


@dataclass(frozen=True)
class Planted:
    """A change of a truck before drive number `drive` (from 0). `size` in deg; in deg/s for a gyro."""

    truck: str
    kind: str  # "remount", "alignment", "gyro"
    drive: int
    size: float


@dataclass(frozen=True)
class Job:
    """One drive. `offset_deg` and `gyro_deg_s` are the sums planted so far, `aligned_deg` is at the steering wheel."""

    truck: str
    number: int
    start_s: float
    seed: int
    drawn: Draw
    base: str
    offset_deg: float
    aligned_deg: float
    gyro_deg_s: float


def fleet(trucks: int, drives: int, seed: int, *, healthy: bool = False) -> tuple[list[Job], list[Planted]]:
    """All drives of a fleet, truck by truck in order of time, and what was planted.

    Of every ten trucks, three are remounted by 2 to 6 deg, one is aligned by as much, one is remounted by 0.5 to 2 deg,
    one gets another gyro bias, and four do not change. With `healthy`, none changes.
    """
    jobs: list[Job] = []
    planted: list[Planted] = []
    for number in range(trucks):
        random = np.random.default_rng([seed, number])
        name = f"truck-{number:05d}"
        drawn = draw(random, PER_TRUCK)
        change = None if healthy else _change(name, number % 10, drives, random)
        planted += [] if change is None else [change]
        jobs += [_job(name, k, drawn, change, random, [seed, number, k]) for k in range(drives)]
    return jobs, planted


def _change(name: str, kind: int, drives: int, random: Random) -> Planted | None:
    when = int(random.integers(min(3, drives // 2), max(drives - 3, drives // 2 + 1)))
    size = float(random.choice([-1.0, 1.0]) * random.uniform(2.0, 6.0))
    if kind < 4:
        return Planted(name, "alignment" if kind == 3 else "remount", when, size)
    if kind == 4:
        return Planted(name, "remount", when, math.copysign(float(random.uniform(0.5, 2.0)), size))
    return Planted(name, "gyro", when, 0.25 * size) if kind == 5 else None


def _job(name: str, number: int, drawn: Draw, change: Planted | None, random: Random, seeds: list[int]) -> Job:
    numbers = dict(drawn.numbers)
    numbers |= {key: PRIORS[key][0].draw(random) for key in PER_DRIVE if key != "crown_percent"}
    numbers["crown_percent"] = float(random.normal(2.0, 0.5))
    numbers["standing_at_start_s"] = float(random.choice([0.0, random.uniform(2.0, 20.0)]))
    day = FIRST_DAY + timedelta(days=number // 5 * 7 + number % 5, minutes=float(random.uniform(0.0, 480.0)))
    of = {
        kind: change.size if change is not None and change.kind == kind and number >= change.drive else 0.0
        for kind in ("remount", "alignment", "gyro")
    }
    return Job(
        truck=name,
        number=number,
        start_s=round(day.timestamp(), 2),
        seed=int(np.random.SeedSequence(seeds).generate_state(1)[0]),
        drawn=Draw(numbers, drawn.radius_errors_percent),
        base=str(random.choice(ROADS)),
        offset_deg=of["remount"],
        aligned_deg=of["alignment"],
        gyro_deg_s=of["gyro"] + float(random.normal(0.0, GYRO_WANDERS_SD_DEG_S)),
    )


def scenario(job: Job, random: Random) -> dict[str, Any]:
    """The scenario; an alignment is a lateral force of the wheels at zero slip."""
    drawn = job.drawn
    truck_section = truck(drawn)
    steering_section = steering(drawn, drawn["front_axle_load_kg"], pulls=True)
    of_alignment_rad = -job.aligned_deg * DEGREE / drawn["steering_ratio"]
    steering_section["pull_n"] += of_alignment_rad * truck_section["front_cornering_stiffness_n_rad"]
    sensor_section = sensors(drawn)
    sensor_section["steering_wheel_angle"]["offset_deg"] += job.offset_deg
    sensor_section["yaw_rate"]["bias_deg_s"] += job.gyro_deg_s
    return {
        "base": job.base,
        "about": "a day of a fleet",
        "drive": {
            "duration_s": DURATION_S,
            "standing_at_start_s": drawn["standing_at_start_s"],
            "standing_at_end_s": 0.0,
        },
        "truck": truck_section,
        "steering": steering_section,
        "road": {
            "heading_deg": drawn["heading_deg"],
            "crown_percent": drawn["crown_percent"],
            "rough_bank_sd_percent": drawn["rough_bank_sd_percent"],
        },
        "wind": wind(drawn, random),
        "sensors": sensor_section,
    }


def drive(job: Job, folder: Path) -> tuple[pl.DataFrame, float]:
    """Its signals, and the true offset in deg. `folder` is for a temporary file.

    Raises:
        OncenterError: the driver cannot control the truck on any of the roads tried.
    """
    file = folder / f"{job.truck}-{job.number}.toml"
    for attempt in range(ATTEMPTS):
        random = np.random.default_rng([job.seed, attempt])
        file.write_text(as_toml(scenario(job, random)), encoding="utf-8")
        try:
            signals, truth = oc.simulate(file, job.seed + attempt)
        except OncenterError as error:
            refusal = error
            continue
        finally:
            file.unlink()
        time = pl.Series("time_s", np.round(job.start_s + np.arange(signals.table.height) / signals.rate_hz, 2))
        table = signals.table.drop("longitudinal_acceleration_m_s2", "steering_wheel_angle_sensor_type", strict=False)
        table = table.with_columns(pl.exclude("time_s").cast(pl.Float32)).with_columns(time)
        return table, (truth.offset_rad + truth.straight_ahead_rad) / DEGREE
    raise refusal


def _write(job: Job, folder: Path) -> dict[str, Any] | None:
    """Writes the log of a drive; none if the driver cannot control the truck that day."""
    log = folder / "logs" / job.truck / f"{datetime.fromtimestamp(job.start_s, UTC):%Y%m%dT%H%M%SZ}.parquet"
    try:
        table, offset_deg = drive(job, folder)
    except OncenterError:
        return None
    pq.write_table(table.to_arrow(), log)  # Snappy and dictionaries, as pandas writes
    return {"truck": job.truck, "drive": job.number, "start_s": job.start_s, "log": log.name, "offset_deg": offset_deg}


def vehicle_file(drawn: Draw) -> str:
    return as_toml(
        {
            "wheelbase_m": round(drawn["wheelbase_m"], 3),
            "steering_ratio": round(drawn["steering_ratio"], 3),
            "track_width_front_m": 2.05,
            "track_width_rear_m": 1.83,
            "axle_layout": "4x2",
            "traffic_side": "right",
        }
    )


def write_fleet(folder: Path, jobs: list[Job], planted: list[Planted], processes: int) -> None:
    """Writes `logs/TRUCK/DATE.parquet`, `vehicles/TRUCK.toml`, and the truth: `drives.csv`, `planted.json`."""
    (folder / "vehicles").mkdir(parents=True)
    for job in jobs:
        if job.number == 0:
            (folder / "logs" / job.truck).mkdir(parents=True)
            (folder / "vehicles" / f"{job.truck}.toml").write_text(vehicle_file(job.drawn), encoding="utf-8")
    (folder / "planted.json").write_text(json.dumps([asdict(change) for change in planted], indent=1))
    with ProcessPoolExecutor(processes) as pool:
        rows = [row for row in pool.map(partial(_write, folder=folder), jobs, chunksize=4) if row is not None]
    pl.DataFrame(rows).write_csv(folder / "drives.csv")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--trucks", type=int, default=100)
    parser.add_argument("--drives", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--healthy", action="store_true")
    parser.add_argument("--processes", type=int, default=2)
    given = parser.parse_args()
    jobs, planted = fleet(given.trucks, given.drives, given.seed, healthy=given.healthy)
    write_fleet(given.folder, jobs, planted, given.processes)


if __name__ == "__main__":
    main()
