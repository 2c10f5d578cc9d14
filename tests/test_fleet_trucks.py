"""The truck of a log, and the time at which it was driven."""

from __future__ import annotations

import shutil
from pathlib import Path

import polars as pl
import pytest
from drive_frames import Frame, candump, drive, identifier
from test_estimate import steady_drive
from two_trucks import DAY_S, MONDAY_S, VIN

import oncenter as oc
from oncenter.fleet.drive import when
from oncenter.fleet.files import LogFile
from oncenter.fleet.trucks import Truck, Trucks
from oncenter.read.identity import NOT_STATED, Identity
from oncenter.read.identity_of_log import identity_of


def test_a_truck_is_named_by_the_nearest_part_of_the_path_that_a_vehicle_file_describes(
    fleet: Path, tmp_path: Path
) -> None:
    vehicles = shutil.copytree(fleet / "vehicles", tmp_path / "vehicles")
    for stem in ("TGX", "TGX.18.510", f"by {VIN}"):
        shutil.copy(vehicles / "depot-7.toml", vehicles / f"{stem}.toml")
    trucks = Trucks(vehicles)
    model = "YS2R4X2"
    for path, truck in {
        f"/logs/depot-7/{VIN}/day.mf4": Truck(VIN, model),
        f"s3://bucket/{VIN}_2026-03-02.log": Truck(VIN, model),
        "/logs/depot-7_monday.blf": Truck("depot-7", "depot-7"),
        "/logs/depot-7.mf4.parquet": Truck("depot-7", "depot-7"),
        "/logs/depot-70/day.mf4": None,
        "/logs/TGX.18.510/day.mf4": Truck("TGX.18.510", "TGX.18.510"),
        "/logs/TGX.18.510.mf4": Truck("TGX.18.510", "TGX.18.510"),
        "/logs/TGX.18.510_monday.2.csv.gz": Truck("TGX.18.510", "TGX.18.510"),
        "/logs/TGX.18.5100/day.mf4": Truck("TGX", "TGX"),
        f"/logs/by {VIN}.mf4": Truck(f"by {VIN}", f"by {VIN}"),
        f"/logs/depot-7.{VIN}/day.mf4": Truck(VIN, model),
        "/logs/YS2R4X2000123456/day.mf4": None,  # a digit too few
    }.items():
        assert trucks.by_path(path) == truck, path


def test_a_vin_is_read_from_packets_among_other_senders_packets(tmp_path: Path) -> None:
    def packets(text: bytes, address: int, pgn: int) -> list[Frame]:
        count = -(-len(text) // 7)
        announcement = bytes([0x20, *len(text).to_bytes(2, "little"), count, 0xFF, *pgn.to_bytes(3, "little")])
        parts = [bytes([k + 1]) + text[7 * k : 7 * k + 7].ljust(7, b"\xff") for k in range(count)]
        begin = [Frame(1.7e9, identifier(0xECFF, address), announcement)]
        return begin + [Frame(1.7e9, identifier(0xEBFF, address), part) for part in parts]

    vin = packets(f"{VIN}*".encode(), 0x00, 65260)
    other = packets(b"SOFTWARE 1.0*PART 7*", 0x0B, 65242)
    mixed = [frame for pair in zip(vin, other, strict=True) for frame in pair]
    log = tmp_path / "drive.log"
    log.write_text(candump(drive(0.1) + mixed))
    assert identity_of(log).vin == VIN
    log.write_text(candump(drive(0.1) + [frame for frame in mixed if frame is not vin[2]]))
    assert identity_of(log).vin is None


def test_a_table_gives_vin_and_start_in_metadata_or_a_column(tmp_path: Path) -> None:
    table = pl.DataFrame({"time_s": [0.0, 0.01]})
    by_metadata, by_column, silent = (tmp_path / f"{name}.parquet" for name in ("metadata", "column", "silent"))
    table.write_parquet(by_metadata, metadata={"vin": VIN, "start_time": "2026-03-02T08:00:00+01:00"})
    table.with_columns(vin=pl.lit(VIN), start_time=pl.lit("2026-03-02 07:00:00")).write_parquet(by_column)
    table.write_parquet(silent)
    table.with_columns(vin=pl.lit(VIN), start_time=MONDAY_S).write_csv(tmp_path / "column.csv")
    for log in (by_metadata, by_column, tmp_path / "column.csv"):
        assert identity_of(log) == Identity(VIN, MONDAY_S), log
    assert identity_of(silent) == NOT_STATED


def test_a_drive_begins_when_its_stamps_its_metadata_its_name_or_its_file_say(tmp_path: Path) -> None:
    path = tmp_path / "drive.parquet"
    since_start, dated = steady_drive(minutes=1.0), steady_drive(minutes=1.0, start_s=MONDAY_S)
    named = LogFile("s3://fleet/2026-03-02T07-00-00/drive.parquet", "", 1, 5.0e8)
    unnamed = LogFile("/logs/drive.parquet", "", 1, 5.0e8)
    assert when(unnamed, dated) == {"start": MONDAY_S, "start_source": "log"}
    assert when(named, since_start) == {"start": MONDAY_S, "start_source": "name"}
    assert when(unnamed, since_start)["start"] == pytest.approx(5.0e8 - 60.0, abs=0.1)
    since_start.table.write_parquet(path, metadata={"start_time": "2026-03-01T07:00:00Z"})
    assert when(named, oc.read(path)) == {"start": MONDAY_S - DAY_S, "start_source": "metadata"}
    since_start.table.write_parquet(path, metadata={"start_time": "1e300"})
    assert when(named, oc.read(path)) == {"start": MONDAY_S, "start_source": "name"}
    assert when(LogFile("/logs/drive.parquet", "", 1, -1e5), since_start) == {}
