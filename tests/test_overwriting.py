"""Users' files are not overwritten: neither an input nor a file in a folder that another program wrote."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from drive_frames import candump, drive
from test_estimate import steady_drive

from oncenter.cli import run

ROOT = Path(__file__).parents[1]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A desk: logs, a vehicle file, a DBC, a scenario with its road, and links to a log."""
    steady_drive(minutes=0.5).table.write_csv(tmp_path / "drive.csv")
    steady_drive(minutes=0.5).table.write_parquet(tmp_path / "drive.parquet")
    (tmp_path / "drive.log").write_text(candump(drive()))
    shutil.copy(ROOT / "vehicles" / "scania_r730_4x2.toml", tmp_path / "truck.toml")
    shutil.copy(tmp_path / "truck.toml", tmp_path / "truck.html")
    shutil.copy(tmp_path / "truck.toml", tmp_path / "truck.fmu")
    shutil.copy(ROOT / "dbc" / "oncenter_j1939.dbc", tmp_path / "bus.html")
    (tmp_path / "road.csv").write_text("station_m,curvature_1_m,cross_slope_1,speed_m_s\n0,0,0,20\n900,0,0,20\n")
    text = 'base = "thesis_drive"\n[road]\nkind = "csv"\nfile = "road.csv"\n'
    (tmp_path / "mine.truth.toml").write_text(text)
    (tmp_path / "link.html").symlink_to("drive.log")
    (tmp_path / "hard.csv").hardlink_to(tmp_path / "drive.csv")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def contents(folder: Path) -> Iterator[tuple[str, bytes]]:
    for path in sorted(folder.rglob("*")):
        if path.is_file():
            yield str(path.relative_to(folder)), path.read_bytes()


@pytest.mark.parametrize(
    "arguments",
    [
        "offset drive.log --vehicle truck.toml --report drive.log",
        "offset drive.csv drive.log --vehicle truck.toml --report ./drive.log",
        "offset drive.log --vehicle truck.toml --report link.html",
        "offset drive.log --vehicle truck.html --report truck.html",
        "offset drive.log --vehicle truck.toml --dbc bus.html --report bus.html",
        "angle drive.csv --vehicle truck.toml --output drive.csv",
        "angle drive.csv --vehicle truck.toml --output hard.csv",
        "angle drive.log --vehicle truck.toml --taught-by drive.parquet --output drive.parquet",
        "angle drive.log --vehicle truck.toml --report drive.log",
        "simulate mine.truth.toml --output mine.log",
        "simulate mine.truth.toml --output road.csv",
        "export fmu --vehicle truck.fmu --output truck.fmu",
        "live --replay drive.log --vehicle truck.parquet --trace truck.parquet",
        "live can0 --vehicle drive.log --record drive.log",
    ],
)
def test_an_output_that_is_an_input_is_refused_before_anything_is_read(
    arguments: str, folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    shutil.copy(folder / "truck.toml", folder / "truck.parquet")
    before = dict(contents(folder))
    assert run(arguments.split()) == 2
    err = capfd.readouterr().err
    assert err.count("\n") == 1
    assert "would overwrite" in err
    assert dict(contents(folder)) == before


def test_the_refusal_is_an_object_with_json(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["offset", "drive.log", "--vehicle", "truck.toml", "--report", "drive.log", "--json"]) == 2
    assert json.loads(capfd.readouterr().out)["code"] == "output"


def test_an_earlier_report_is_replaced(folder: Path) -> None:
    for _ in range(2):
        assert run(["offset", "drive.csv", "--vehicle", "truck.toml", "--report", "page.html"]) == 0


@pytest.mark.parametrize("name", ["drive.log", "report.html", "drive.truth.parquet"])
def test_a_demo_keeps_a_file_of_the_user(name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / name).write_text("mine")
    assert run(["demo", "--output", str(tmp_path)]) == 2
    err = capfd.readouterr().err
    assert err.count("\n") == 1 and name in err
    assert dict(contents(tmp_path)) == {name: b"mine"}


@pytest.mark.slow
def test_a_demo_replaces_a_demo_but_not_a_log_that_the_user_put_there(
    tmp_path: Path,
) -> None:
    demo = ["demo", "--output", str(tmp_path)]
    assert run(demo) == 0
    assert run([*demo, "--seed", "2"]) == 0
    (tmp_path / "drive.log").write_text(candump(drive()))
    assert run(demo) == 2
    assert (tmp_path / "drive.log").read_text() == candump(drive())
