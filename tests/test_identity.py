"""Truck and start of a table come from the same parser as its signals, so that no two trucks have one answer."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import polars as pl
import pytest
from test_estimate import steady_drive
from two_trucks import MONDAY_S, VIN

import oncenter as oc
from oncenter.cli import run
from oncenter.errors import OncenterError
from oncenter.fleet.drive import Work
from oncenter.fleet.files import LogFile
from oncenter.fleet.trucks import Trucks

OTHER = "WDB96340310123456"
TRUCK = "scania_r730_4x2"


def with_units_row(text: str) -> str:
    """A row of units below the header, and no unit in the names."""
    units = {"rad": "rad", "rad_s": "rad/s", "m_s": "m/s", "m_s2": "m/s^2", "time_s": "s"}
    header, rows = text.split("\n", 1)
    names, below = [], []
    for name in header.split(","):
        unit = next((unit for unit in ("m_s2", "rad_s", "m_s", "rad") if name.endswith(f"_{unit}")), "")
        names.append(name.removesuffix(f"_{unit}") if unit else name)
        below.append("s" if name == "time_s" else units.get(unit, ""))
    return "\n".join([",".join(names), ",".join(below), rows])


def written(name: str, change: Callable[[str], str], encoding: str = "utf-8") -> Callable[[pl.DataFrame, Path], None]:
    def write(table: pl.DataFrame, folder: Path) -> None:
        (folder / name).write_bytes(change(table.write_csv()).encode(encoding))

    return write


ODD = {
    "semicolons": written("odd.csv", lambda text: text.replace(",", ";")),
    "tabs": written("odd.csv", lambda text: text.replace(",", "\t")),
    "UTF-16": written("odd.csv", str, "utf-16"),
    "units": written("odd.csv", with_units_row),
    "comment": written("odd.csv", lambda text: f"# of the depot\n{text}"),
    "Excel": written("odd.csv", lambda text: f"sep=,\n{text}"),
    "upper case": written("odd.csv", lambda text: text.replace("vin", " VIN ", 1)),
    "brackets": written("drive[1].csv", str),
    "star": written("driv*.csv", str),
    "brackets, Parquet": lambda table, folder: table.write_parquet(folder / "drive[1].parquet"),
}


@pytest.mark.parametrize("odd", ODD)
def test_logs_of_two_trucks_are_refused_however_the_table_is_written(
    odd: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The log beside it has the name that the odd one would match as a pattern."""
    table = steady_drive(minutes=1.0).table
    for name in ("drive1.csv", "drive1.parquet"):
        (table.with_columns(vin=pl.lit(VIN)).write_csv if name.endswith("csv") else table.write_parquet)(
            tmp_path / name
        )
    before = {*tmp_path.iterdir()}
    ODD[odd](table.with_columns(vin=pl.lit(OTHER)), tmp_path)
    (log,) = {*tmp_path.iterdir()} - before
    assert run(["offset", str(tmp_path / "drive1.csv"), str(log), "--vehicle", TRUCK]) == 2
    error = capsys.readouterr().err
    assert "of different trucks" in error and VIN in error and OTHER in error


@pytest.mark.parametrize("odd", ODD)
def test_a_fleet_finds_the_truck_of_each_table(odd: str, fleet: Path, tmp_path: Path) -> None:
    ODD[odd](steady_drive(minutes=1.0).table.with_columns(vin=pl.lit(VIN)), tmp_path)
    (log,) = tmp_path.iterdir()
    row = Work(Trucks(fleet / "vehicles"))(LogFile(str(log), "", log.stat().st_size, 1.0))
    assert row["truck"] == VIN and row.get("error_code") != "unknown_truck"


def test_a_signals_table_has_the_start_that_its_file_states(tmp_path: Path) -> None:
    table = steady_drive(minutes=1.0).table
    path = tmp_path / "drive.csv"
    table.with_columns(start_time=pl.lit("2026-03-02 07:00:00")).write_csv(path, separator=";")
    assert oc.read(path).start_s == MONDAY_S
    table.write_parquet(tmp_path / "drive.parquet", metadata={"VIN": VIN, "start_time": str(MONDAY_S)})
    drive = oc.read(tmp_path / "drive.parquet")
    assert (drive.vin, drive.start_s) == (VIN, MONDAY_S)
    frame = oc.from_dataframe(table.with_columns(vin=pl.lit(VIN)))
    assert frame.vin == VIN


def test_the_first_rows_of_a_table_may_lack_the_vin(tmp_path: Path) -> None:
    table = steady_drive(minutes=1.0).table
    late = [None] * 100 + [VIN] * (len(table) - 100)
    table.with_columns(vin=pl.Series(late)).write_csv(tmp_path / "late.csv")
    assert oc.read(tmp_path / "late.csv").vin == VIN


def test_a_table_with_rows_of_two_trucks_is_refused(tmp_path: Path) -> None:
    table = steady_drive(minutes=1.0).table
    half = len(table) // 2
    pooled = table.with_columns(vin=pl.Series([VIN] * half + [OTHER] * (len(table) - half)))
    pooled.write_csv(tmp_path / "pooled.csv")
    with pytest.raises(OncenterError, match="different trucks") as refused:
        oc.read(tmp_path / "pooled.csv")
    assert refused.value.code == "different_trucks"


def test_the_header_comment_of_an_mf4_gives_the_truck(fleet: Path, tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    table = steady_drive(minutes=0.5).table
    log = tmp_path / "drive.mf4"
    with MDF() as mdf:
        time = table["time_s"].to_numpy()
        names = [name for name in table.columns if name != "time_s"]
        mdf.append([Signal(table[name].to_numpy(), time, name=name) for name in names])
        mdf.header.comment = (
            f'<HDcomment><TX/><common_properties><e name="VIN">{VIN}</e></common_properties></HDcomment>'
        )
        mdf.save(log)
    assert oc.read(log).vin == VIN
    row = Work(Trucks(fleet / "vehicles"))(LogFile(str(log), "", log.stat().st_size, 1.0))
    assert row["truck"] == VIN


def test_a_vin_longer_than_a_truck_may_send_is_none(tmp_path: Path) -> None:
    for length, vin in ((200, "V" * 200), (201, None)):
        log = tmp_path / f"{length}.csv"
        rows = "".join(f"{k / 10},{k % 7},{'V' * length}\n" for k in range(50))
        log.write_text(f"time_s,steering_wheel_angle_deg,vin\n{rows}")
        assert oc.read(log).vin == vin
