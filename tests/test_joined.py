"""`--join`: files of one drive, put together by time."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from asammdf import MDF, Signal
from planted_faults import drive

from oncenter.cli import run
from oncenter.errors import OncenterError
from oncenter.read import read, read_joined
from oncenter.vehicle import vehicle

START_S = 1_714_564_800.0
EPS, ESP = ("steering_wheel_angle_rad",), ("yaw_rate_rad_s", "vehicle_speed_m_s", "lateral_acceleration_m_s2")
TRUCK = "scania_r730_4x2"


@pytest.fixture(scope="module")
def table() -> pl.DataFrame:
    given = drive().table.select("time_s", *EPS, *ESP).drop_nans()
    return given.with_columns(pl.col("time_s") - pl.col("time_s").min() + START_S)


def csv(table: pl.DataFrame, path: Path) -> str:
    table.write_csv(path)
    return str(path)


def answer(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, object]:
    assert run(["offset", *words, "--vehicle", TRUCK, "--json"]) == 0
    given: dict[str, object] = json.loads(capsys.readouterr().out)
    return given


def test_two_buses_give_the_answer_of_one_file(
    table: pl.DataFrame, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = csv(table, tmp_path / "whole.csv")
    eps = csv(table.select("time_s", *EPS), tmp_path / "eps.csv")
    esp = csv(table.select("time_s", *ESP), tmp_path / "esp.csv")
    joined, single = answer(capsys, eps, esp, "--join"), answer(capsys, whole)
    assert joined["offset"]["value"] == pytest.approx(single["offset"]["value"], abs=1e-9)  # type: ignore[index]
    assert joined["log"] == eps
    assert any("eps.csv, esp.csv were put together by time" in note for note in joined["notes"])  # type: ignore[attr-defined]


def test_files_that_overlap_are_named_with_the_option(
    table: pl.DataFrame, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    eps = csv(table.select("time_s", *EPS), tmp_path / "eps.csv")
    esp = csv(table.select("time_s", *ESP), tmp_path / "esp.csv")
    assert run(["offset", eps, esp, "--vehicle", TRUCK]) == 1
    said = capsys.readouterr().err
    assert "eps.csv" in said and "esp.csv overlap in time: if they are files of one drive, give --join" in said


def test_files_that_do_not_overlap_are_not_joined(
    table: pl.DataFrame, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one = csv(table[:7_000], tmp_path / "one.csv")
    other = csv(table[7_000:], tmp_path / "other.csv")
    assert run(["offset", one, other, "--join", "--vehicle", TRUCK]) == 2
    assert "none of the 2 logs overlap in time" in capsys.readouterr().err
    assert run(["offset", one, other, "--join", "--each", "--vehicle", TRUCK]) == 2


def test_parts_of_one_bus_are_joined_beside_the_other_bus(table: pl.DataFrame, tmp_path: Path) -> None:
    parts = [table.select("time_s", *EPS)[:7_000], table.select("time_s", *EPS)[7_000:], table.select("time_s", *ESP)]
    paths = [Path(csv(part, tmp_path / f"{number}.csv")) for number, part in enumerate(parts)]
    found = read_joined(paths, vehicle(TRUCK))
    assert found.ticks == pytest.approx(table.height, abs=2)
    for name in (*EPS, *ESP):
        assert np.allclose(found.columns[name][:-1], table[name].to_numpy()[: found.ticks - 1], atol=1e-3)
    assert found.account is not None
    assert found.account.signals["steering_wheel_angle"].in_file == table.height


def test_formats_may_differ_and_a_file_without_signals_is_a_note(table: pl.DataFrame, tmp_path: Path) -> None:
    time = table["time_s"].to_numpy()
    with MDF() as mdf:
        from datetime import UTC, datetime

        mdf.start_time = datetime.fromtimestamp(START_S, UTC)
        mdf.append([Signal(table[name].to_numpy(), time - START_S, name=name) for name in ESP])
        mdf.save(tmp_path / "esp.mf4")
    eps = Path(csv(table.select("time_s", *EPS), tmp_path / "eps.csv"))
    other = Path(csv(table.select("time_s", pl.lit(20.0).alias("temperature")), tmp_path / "other.csv"))
    found = read_joined([eps, other, tmp_path / "esp.mf4"], vehicle(TRUCK))
    assert np.allclose(found.columns["yaw_rate_rad_s"][:-2], table["yaw_rate_rad_s"][: found.ticks - 2], atol=1e-3)
    assert any("no signal recognised in other.csv" in note for note in found.notes)


def test_a_signal_that_files_disagree_about_is_chosen_by_the_file(table: pl.DataFrame, tmp_path: Path) -> None:
    both = [table, table.with_columns(pl.col("yaw_rate_rad_s") + 0.05)]
    paths = [Path(csv(part, tmp_path / f"can{number}.csv")) for number, part in enumerate(both)]
    with pytest.raises(OncenterError, match=r"in can0\.csv and column yaw_rate_rad_s in can1\.csv disagree"):
        read_joined(paths, vehicle(TRUCK))
    chosen = read_joined(paths, vehicle(TRUCK), take={"yaw_rate": "can1.csv"})
    assert np.allclose(chosen.columns["yaw_rate_rad_s"][:-1], both[1]["yaw_rate_rad_s"][: chosen.ticks - 1], atol=1e-3)


def test_files_with_and_without_a_date_are_refused(table: pl.DataFrame, tmp_path: Path) -> None:
    eps = Path(csv(table.select("time_s", *EPS), tmp_path / "eps.csv"))
    esp = Path(csv(table.select(pl.col("time_s") - START_S, *ESP), tmp_path / "esp.csv"))
    with pytest.raises(OncenterError, match=r"esp\.csv has times since its begin, and eps\.csv since 1970"):
        read_joined([eps, esp], vehicle(TRUCK))
    stated = table.select(pl.col("time_s") - START_S, *ESP, pl.lit(START_S).alias("start_time_s"))
    esp = Path(csv(stated, tmp_path / "esp.csv"))
    assert set(read_joined([eps, esp], vehicle(TRUCK)).sources) == {*read(eps).sources, *read(esp).sources}
