"""What oncenter writes says so inside, and is no log, whatever its name."""

from __future__ import annotations

import shutil
from pathlib import Path

import polars as pl
import pytest
from test_estimate import steady_drive

import oncenter as oc
from oncenter.cli import run
from oncenter.errors import OncenterError
from oncenter.fleet.drive import Work
from oncenter.fleet.files import LogFile
from oncenter.fleet.trucks import Trucks

TRUCK = "scania_r730_4x2"
NUMBERS = ("--wheelbase-m", "3.7", "--steering-ratio", "19.3")


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory, undisturbed: Path) -> Path:
    """A folder of a log and of files that oncenter wrote about it."""
    folder = tmp_path_factory.mktemp("own")
    log = folder / "drive.parquet"
    assert run(["simulate", "step_steer", "--output", str(log)]) == 0
    for name in ("angle.csv", "angle.parquet"):
        assert run(["angle", str(log), "--vehicle", TRUCK, "--output", str(folder / name)]) == 0
    steady_drive().table.write_parquet(folder / "steady.parquet")
    assert run(["offset", str(folder / "steady.parquet"), "--vehicle", TRUCK, "--memory", str(folder / "m.toml")]) == 0
    answer = oc.offset(oc.read(folder / "steady.parquet"), oc.vehicle(TRUCK)).to_json()
    (folder / "answer.json").write_text(answer)
    (folder / "powershell.json").write_text(answer, encoding="utf-16")
    assert run(["vehicle", "new", str(folder / "truck.toml"), *NUMBERS]) == 0
    for table in ("drives", "trucks", "changes"):
        shutil.copy(undisturbed / f"{table}.parquet", folder)
    pl.read_parquet(undisturbed / "trucks.parquet").drop("tires", strict=False).write_csv(folder / "trucks.csv")
    pl.read_parquet(folder / "drive.truth.parquet").write_csv(folder / "truth.csv")
    return folder


@pytest.mark.parametrize(
    ("name", "what"),
    [
        ("drive.truth.parquet", "true values of a simulated drive"),
        ("truth.csv", "true values of a simulated drive"),
        ("drive.truth.toml", "true values of a simulated drive"),
        ("angle.csv", "oncenter angle"),
        ("angle.parquet", "oncenter angle"),
        ("m.toml", "follows --memory"),
        ("truck.toml", "follows --vehicle"),
        ("answer.json", "oncenter compare"),
        ("powershell.json", "oncenter compare"),
        ("drives.parquet", "oncenter fleet"),
        ("trucks.parquet", "oncenter fleet"),
        ("changes.parquet", "oncenter fleet"),
        ("trucks.csv", "oncenter fleet"),
    ],
)
def test_a_file_of_oncenter_is_refused_as_a_log_whatever_its_name(
    name: str, what: str, own: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    suffix = Path(name).suffix
    renamed = tmp_path / f"monday{suffix if suffix in ('.parquet', '.csv') else '.csv'}"
    shutil.copy(own / name, renamed)
    for path in (own / name, renamed):
        assert run(["offset", str(path), "--vehicle", TRUCK]) == 1
        error = capsys.readouterr().err
        assert f"{path.name} is not a log" in error and what in error, error
        assert len(error.splitlines()) == 1
    with pytest.raises(OncenterError) as refused:
        oc.read(renamed)
    assert refused.value.code == "not_a_log"


def test_the_truth_beside_a_simulated_log_is_left_out_and_named(own: Path, capsys: pytest.CaptureFixture[str]) -> None:
    steady = [str(own / "steady.parquet"), "--vehicle", TRUCK]
    assert run(["offset", *steady]) == 0
    alone = capsys.readouterr().out.splitlines()
    assert run(["offset", str(own / "drive.truth.parquet"), *steady]) == 0
    both = capsys.readouterr().out.splitlines()
    (named,) = [line for line in both if "no_log_left_out" in line]
    assert "info: a file was left out: drive.truth.parquet is not a log" in named
    assert both[0] == alone[0]


def test_a_fleet_counts_the_truth_of_a_simulation_for_no_truck(own: Path, fleet: Path, tmp_path: Path) -> None:
    (tmp_path / "depot-7").mkdir()
    truth = Path(shutil.copy(own / "drive.truth.parquet", tmp_path / "depot-7" / "monday.parquet"))
    row = Work(Trucks(fleet / "vehicles"))(LogFile(str(truth), "", truth.stat().st_size, 1.0))
    assert (row["error_code"], row["truck"]) == ("not_a_log", "")


def test_a_simulated_drive_is_a_log(own: Path) -> None:
    assert oc.read(own / "drive.parquet").ticks > 0
