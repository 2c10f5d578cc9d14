"""Drives of trucks whose truth is known, simulated once and kept in a folder, for every code the same.

A drive is `POPULATION_SEED/NUMBER.parquet`, its signals, with two files of its truth: `.json`, and `.place.parquet`,
the place in the play. The populations:

    plain      a truck of bench/drives_that_differ.py, without a pull, 15 minutes a drive
    long       one of its drives, of 30 minutes
    play_N     the same trucks with N deg of play
    left       the same trucks on a ring road of wide left bends, on the left flank of the play
    right      the same trucks on a ring road of right bends, on the right flank but for seconds between two bends
    loads      twelve drives at three loads of a truck with a pull, `logs_three` of bench/truck_drives.py
    eight      eight drives at three loads, `three` there
    multibody  a truck of an independent model, bench/multibody_drives.py, 15 minutes a drive, without a pull
    ROW        a row of bench/accuracy_rows.py or bench/effects_rows.py, one drive of 20 minutes
    scenario_N a shipped scenario with its own truck and sensors, the first 30 minutes
"""

from __future__ import annotations

import dataclasses
import json
import math
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from accuracy_rows import Drive, Row, as_toml, drive, known_of, vehicle_file
from drives_that_differ import Truck, changed, truck
from multibody_drives import multibody_drive
from truck_drives import KINDS, truck_drives

import oncenter as oc
from oncenter.signals import DEGREE, Signals, Source
from oncenter.simulate.scenario import read_scenario
from oncenter.vehicle import Vehicle, vehicle_from

MINUTES, LONG_MINUTES = 15.0, 30.0
DRIVES = 12  # of a truck
FIRST_LONG, FIRST_LEFT, FIRST_RIGHT = 20, 30, 40  # numbers of a truck's drives, which seed their roads
# Narrow enough to be loaded to the right on a crown that falls there, with short straights.
RIGHT_BENDS = {
    "straight_length_m": [1.0, 5.0],
    "bend_radius_m": [450.0, 900.0],
    "bend_angle_deg": [150.0, 180.0],
    "bend_side": "right",
    "clothoid_length_m": [40.0, 60.0],
}
_OF_KIND = {"loads": "logs_three", "eight": "three"}
_OF_VEHICLE = (
    "wheelbase_m",
    "steering_ratio",
    "track_width_front_m",
    "track_width_rear_m",
    "axle_layout",
    "traffic_side",
)
_ANGLE, _PLACE = "steering_wheel_angle_rad", "place_in_play"


@dataclass(frozen=True)
class Driven:
    """A drive and its truth, deg: the straight-ahead offset without the pull, the effect of the pull on the reading,
    the play at the steering wheel. `place_in_play` is that of each tick, 1 on the left flank, -1 on the right one."""

    signals: Signals
    vehicle: Vehicle
    offset_deg: float
    pulled_deg: float
    play_deg: float
    load: int
    pull_m_s2: float  # shift of the neutral lateral acceleration
    place_in_play: np.ndarray[Any, Any]

    def with_offset(self, moved_deg: float) -> Driven:
        """The drive of a truck whose sensor reads more by that angle."""
        turned = changed(self.signals, {_ANGLE: lambda angle: angle + moved_deg * DEGREE})
        return dataclasses.replace(self, signals=turned, offset_deg=self.offset_deg + moved_deg)

    def with_signals(self, signals: Signals) -> Driven:
        return dataclasses.replace(self, signals=signals)

    def at(self, start_s: float, log: str) -> Driven:
        """The drive with a date and a name; its clock begins at zero."""
        table = self.signals.table.with_columns(pl.col("time_s") - pl.col("time_s").first())
        signals = Signals(table, self.signals.sources, self.signals.rate_hz, log, start_s=start_s)
        return dataclasses.replace(self, signals=signals)


@dataclass(frozen=True)
class Garage:
    """The drives of one seed's trucks in a folder; each is simulated when it is first needed."""

    folder: Path
    seed: int

    def plain(self, k: int) -> Driven:
        return self._one("plain", k, lambda place: truck(self.seed).drive(k, place, minutes=MINUTES))

    def long(self) -> Driven:
        return self._one("long", 0, lambda place: truck(self.seed).drive(FIRST_LONG, place, minutes=LONG_MINUTES))

    def with_play(self, play_deg: float, k: int) -> Driven:
        one: Truck = truck(self.seed, backlash_deg=play_deg)
        return self._one(f"play_{play_deg:g}", k, lambda place: one.drive(k, place, minutes=MINUTES))

    def left(self, k: int) -> Driven:
        one = truck(self.seed)
        return self._one("left", k, lambda place: one.drive(FIRST_LEFT + k, place, minutes=MINUTES, base="bypass"))

    def right(self, k: int) -> Driven:
        one = truck(self.seed)
        return self._one(
            "right",
            k,
            lambda place: one.drive(
                FIRST_RIGHT + k, place, minutes=MINUTES, base="bypass", extra={"road": RIGHT_BENDS}
            ),
        )

    def multibody(self, k: int) -> Driven:
        return self._one("multibody", k, lambda place: multibody_drive(self.seed, k, place, MINUTES))

    def of_kind(self, population: str) -> list[Driven]:
        """All drives of a kind of bench/truck_drives.py."""
        name = _OF_KIND[population]
        place = self.folder / f"{population}_{self.seed}"
        count = KINDS[name].drives
        if not _truth(place, count - 1).exists():
            with tempfile.TemporaryDirectory() as temporary:
                for k, (load, _, drive) in enumerate(truck_drives(KINDS[name], name, self.seed, Path(temporary))):
                    _keep(place, k, drive, load)
        return [_kept(place, k) for k in range(count)]

    def of_row(self, row: Row) -> Driven:
        """The drive of a row of bench/accuracy_rows.py with this seed."""
        return self._one(row.name, 0, lambda place: drive(row, self.seed, place))

    def scenario(self, name: str) -> Driven:
        """A shipped scenario with this seed, whose truck never pulls."""
        return self._one(f"scenario_{name}", 0, lambda place: _of_scenario(name, self.seed, place))

    def _one(self, population: str, k: int, simulated: Callable[[Path], Drive]) -> Driven:
        place = self.folder / f"{population}_{self.seed}"
        if not _truth(place, k).exists():
            with tempfile.TemporaryDirectory() as temporary:
                _keep(place, k, simulated(Path(temporary)))
        return _kept(place, k)


def said_of(answer: oc.Answer, offset_deg: float | None, pull_m_s2: float) -> dict[str, Any]:
    """Status and codes of an answer; its error, less the pull's part, and half-width, deg, where it has a value."""
    said: dict[str, Any] = {
        "status": answer.offset.status,
        "codes": sorted(finding.code for finding in answer.findings if finding.severity != "info"),
    }
    if answer.offset.value is not None and answer.offset_half_width_rad is not None:
        said["half_width"] = answer.offset_half_width_rad / DEGREE
        if offset_deg is not None:
            pulled = answer.offset_per_acceleration * pull_m_s2
            said["error"] = (answer.offset.value - pulled) / DEGREE - offset_deg
    return said


def _of_scenario(name: str, seed: int, folder: Path) -> Drive:
    file = folder / f"{name}.toml"
    file.write_text(as_toml({"base": name, "drive": {"duration_s": 60.0 * LONG_MINUTES}}), encoding="utf-8")
    signals, truth = oc.simulate(file, seed)
    scenario = read_scenario(file)
    vehicle = vehicle_file(Row(name, ""), scenario.truck, truth, np.random.default_rng(seed))
    return Drive(
        row=name,
        seed=seed,
        signals=signals,
        vehicle=vehicle,
        known=known_of(vehicle, scenario),
        target_rad=np.array([truth.offset_rad + truth.straight_ahead_rad]),
        exact_data_rad=0.0,
        floor_rad=0.0,
        side_force_floor_rad=0.0,
        angle_per_m_s2=truth.steering_ratio * truth.understeer_gradient,
        wind_m_s2=0.0,
        redrawn=0,
        scenario=scenario,
        truth=truth,
    )


def _table(place: Path, k: int) -> Path:
    return place / f"{k:02d}.parquet"


def _places(place: Path, k: int) -> Path:
    return place / f"{k:02d}.place.parquet"


def _truth(place: Path, k: int) -> Path:
    """Written last: with it the drive is complete."""
    return place / f"{k:02d}.json"


@contextmanager
def _whole(path: Path) -> Iterator[Path]:
    """The path of an unfinished file, which gets its name when it is complete; another process may make the same."""
    unfinished = path.with_suffix(f"{path.suffix}.{os.getpid()}")
    yield unfinished
    unfinished.rename(path)


def _keep(place: Path, k: int, drive: Drive, load: int = 0) -> None:
    pull_m_s2 = drive.truth.unloading_acceleration_m_s2
    pulled = 0.0 if math.isnan(pull_m_s2) else drive.angle_per_m_s2 * pull_m_s2
    truth = {
        "offset_deg": float(drive.target_rad[-1]) / DEGREE,
        "pulled_deg": pulled / DEGREE,
        "pull_m_s2": 0.0 if math.isnan(pull_m_s2) else pull_m_s2,
        "play_deg": (drive.truth.backlash_rad + drive.truth.windup_rad) / DEGREE,
        "load": load,
        "vehicle": {name: getattr(drive.vehicle, name) for name in _OF_VEHICLE},
        "sources": sorted(drive.signals.sources),
        "rate_hz": drive.signals.rate_hz,
    }
    place.mkdir(parents=True, exist_ok=True)
    with _whole(_table(place, k)) as unfinished:
        drive.signals.table.write_parquet(unfinished, compression="zstd")
    with _whole(_places(place, k)) as unfinished:
        drive.truth.table.select(pl.col(_PLACE).round(2).cast(pl.Float32)).write_parquet(unfinished, compression="zstd")
    with _whole(_truth(place, k)) as unfinished:
        unfinished.write_text(json.dumps(truth, indent=1), encoding="utf-8")


def _kept(place: Path, k: int) -> Driven:
    truth: Mapping[str, Any] = json.loads(_truth(place, k).read_text(encoding="utf-8"))
    table = pl.read_parquet(_table(place, k))
    source = Source("simulated", truth["rate_hz"], len(table), 0)
    signals = Signals(table, dict.fromkeys(truth["sources"], source), truth["rate_hz"], place.name)
    given = {name: value for name, value in truth["vehicle"].items() if value is not None}
    vehicle = vehicle_from(given, place.name)
    return Driven(
        signals=signals,
        vehicle=vehicle,
        offset_deg=truth["offset_deg"],
        pulled_deg=truth["pulled_deg"],
        play_deg=truth["play_deg"],
        load=truth["load"],
        pull_m_s2=truth["pull_m_s2"],
        place_in_play=pl.read_parquet(_places(place, k))[_PLACE].to_numpy(),
    )
