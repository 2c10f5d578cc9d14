"""Forty pairs of logs that contradict each other, at each door: each is named, and nothing is mixed."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from test_app import FORM, Page, served
from test_estimate import steady_drive

import oncenter as oc
from oncenter.cli import run
from oncenter.fleet import page as fleet_page
from oncenter.fleet import run as night
from oncenter.fleet.end_of_run import in_words
from oncenter.truck.events import parse_event

pytestmark = pytest.mark.usefixtures("answered_here")

TRUCK = "scania_r730_4x2"
VIN, OTHER_VIN = "YS2R4X20001234567", "YS2R4X20007654321"
DATE, LATER = "2026-03-02T07:00:00Z", "2026-03-09T07:00:00Z"

Capture = pytest.CaptureFixture[str]
Pair = tuple[Path, Path]


@pytest.fixture(scope="module")
def tables(tmp_path_factory: pytest.TempPathFactory) -> list[pl.DataFrame]:
    """Two drives."""
    scenario = tmp_path_factory.mktemp("drives") / "drive.toml"
    scenario.write_text('base = "thesis_drive"\ndrive.duration_s = 600\n')
    return [oc.simulate(scenario, seed)[0].table for seed in (1, 2)]


def written(table: pl.DataFrame, path: Path, start: str | None = None, vin: str | None = None) -> Path:
    path.parent.mkdir(exist_ok=True)
    stated = {name: value for name, value in (("start_time", start), ("vin", vin)) if value is not None}
    if path.suffix == ".parquet":
        table.write_parquet(path, metadata=stated)
    else:
        table.with_columns(pl.lit(value).alias(name) for name, value in stated.items()).write_csv(path)
    return path


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    with served(tmp_path_factory.mktemp("app") / "trucks") as page:
        yield page


def in_a_fleet(
    pair: Sequence[Path], folder: Path, truck: str, monkeypatch: pytest.MonkeyPatch
) -> tuple[str, pl.DataFrame]:
    """The words of a night over a truck's folder with the pair, and its drives."""
    monkeypatch.setattr(fleet_page, "_page", lambda contents: "")  # drawing takes long
    (folder / "vehicles").mkdir()
    (folder / "vehicles" / f"{truck}.toml").write_text("wheelbase_m = 3.7\nsteering_ratio = 19.3\n")
    (folder / "fleet" / truck).mkdir(parents=True)
    for log in pair:
        shutil.copy(log, folder / "fleet" / truck)
    summary = night([str(folder / "fleet")], folder / "vehicles", folder / "out")
    drives = pl.read_parquet(folder / "out" / "drives.parquet")
    (row,) = pl.read_parquet(folder / "out" / "trucks.parquet").to_dicts()
    assert row["told"] == len(drives.filter(pl.col("error").is_null() & pl.col("copy_of").is_null()))
    return in_words(summary), drives


def refused(arguments: list[str], capfd: Capture) -> tuple[str, str]:
    """Code and sentence of a command that is refused in one line."""
    capfd.readouterr()
    assert run([*arguments, "--vehicle", TRUCK, "--json"]) == 2
    out, err = capfd.readouterr()
    assert err.count("\n") == 1
    return json.loads(out)["code"], err


# -- two VINs


def offset(pair: Pair, folder: Path, capfd: Capture) -> tuple[str, str]:
    return refused(["offset", *map(str, pair)], capfd)


def a_folder(pair: Pair, folder: Path, capfd: Capture) -> tuple[str, str]:
    return refused(["offset", str(pair[0].parent)], capfd)


def memory(pair: Pair, folder: Path, capfd: Capture) -> tuple[str, str]:
    file = folder / "memory.toml"
    arguments = ["--memory", str(file)]
    assert run(["offset", str(pair[0]), "--vehicle", TRUCK, *arguments]) == 0
    before = file.read_text()
    code, said = refused(["offset", str(pair[1]), *arguments], capfd)
    assert file.read_text() == before and f'vin = "{VIN}"' in before
    return code, said


def compare(pair: Pair, folder: Path, capfd: Capture) -> tuple[str, str]:
    return refused(["compare", *map(str, pair)], capfd)


def python(pair: Pair, folder: Path, capfd: Capture) -> tuple[str, str]:
    with pytest.raises(oc.OncenterError) as error:
        oc.offset(list(map(oc.read, pair)), TRUCK)
    return error.value.code, str(error.value)


@pytest.mark.parametrize("endings", [("csv", "csv"), ("csv", "parquet"), ("parquet", "csv")], ids="-".join)
@pytest.mark.parametrize("door", [offset, a_folder, memory, compare, python])
def test_logs_of_two_vins_are_refused_with_both_vins(
    door: Callable[[Pair, Path, Capture], tuple[str, str]],
    endings: tuple[str, str],
    tables: list[pl.DataFrame],
    tmp_path: Path,
    capfd: Capture,
) -> None:
    code, said = door(of_two_vins(tables, tmp_path, endings), tmp_path, capfd)
    assert code == "different_trucks" and VIN in said and OTHER_VIN in said and "b." in said


REPLACED = "another_truck@2026-03-05"


def offset_since(pair: Pair, folder: Path) -> None:
    assert run(["offset", *map(str, pair), "--vehicle", TRUCK, "--event", REPLACED]) == 0


def python_since(pair: Pair, folder: Path) -> None:
    oc.offset(list(map(oc.read, pair)), TRUCK, events=[parse_event(REPLACED)])


def memory_since(pair: Pair, folder: Path) -> None:
    """The memory takes the new VIN, and no other one from then on."""
    file = folder / "memory.toml"
    command = ["--vehicle", TRUCK, "--memory", str(file)]
    assert run(["offset", str(pair[0]), *command]) == 0
    assert run(["offset", str(pair[1]), *command]) == 2
    assert run(["offset", str(pair[1]), *command, "--event", REPLACED]) == 0
    after = file.read_text()
    assert f'vin = "{OTHER_VIN}"' in after and after.count("[[drives]]") == 2
    third = written(steady_drive().table, folder / "c.csv", "2026-03-10T07:00:00Z", VIN)
    assert run(["offset", str(third), *command]) == 2 and file.read_text() == after
    written(steady_drive().table, third, "2026-03-01T07:00:00Z", VIN)  # of the former truck
    assert run(["offset", str(third), *command]) == 0 and f'vin = "{OTHER_VIN}"' in file.read_text()


def memory_at_once(pair: Pair, folder: Path) -> None:
    """A memory with all logs of both trucks takes the VIN of the present one."""
    file = folder / "memory.toml"
    command = ["--vehicle", TRUCK, "--memory", str(file), "--event", REPLACED]
    assert run(["offset", *map(str, pair), *command]) == 0
    assert f'vin = "{OTHER_VIN}"' in file.read_text()


@pytest.mark.parametrize("door", [offset_since, python_since, memory_since, memory_at_once])
def test_logs_of_two_vins_are_one_before_and_one_after_the_truck_was_replaced(
    door: Callable[[Pair, Path], None], tables: list[pl.DataFrame], tmp_path: Path
) -> None:
    door(of_two_vins(tables, tmp_path, ("csv", "parquet")), tmp_path)


def of_two_vins(tables: list[pl.DataFrame], folder: Path, endings: tuple[str, str]) -> Pair:
    one = written(tables[0], folder / "logs" / f"a.{endings[0]}", DATE, VIN)
    return one, written(tables[1], folder / "logs" / f"b.{endings[1]}", LATER, OTHER_VIN)


AT_NIGHT = [pytest.param(endings, marks=pytest.mark.slow) for endings in (("csv", "csv"), ("csv", "parquet"))]


@pytest.mark.parametrize("endings", [*AT_NIGHT, ("parquet", "csv")], ids="-".join)
def test_the_page_keeps_no_drive_of_another_vin_with_a_truck(
    endings: tuple[str, str], page: Page, tables: list[pl.DataFrame], tmp_path: Path
) -> None:
    name = page.said("POST", "/trucks", FORM | {"name": "-".join(endings)})["name"]
    one, other = (page.drop(log) for log in of_two_vins(tables, tmp_path, endings))
    assert page.answer(one, group="yours", name=name)["state"] == "done"
    answer = page.answer(other, group="yours", name=name)
    assert (answer["state"], answer["said"]["code"]) == ("failed", "different_trucks")
    said = answer["said"]["message"]
    assert VIN in said and OTHER_VIN in said and "-".join(endings) in said
    (kept,) = page.said("GET", f"/trucks/{name}")["drives"]
    page.said("DELETE", f"/trucks/{name}/drives/{kept['drive']}")
    assert page.answer(other, group="yours", name=name)["state"] == "done"


@pytest.mark.parametrize(("truck", "counts"), [("depot-7", 0), (VIN, 1)])
@pytest.mark.parametrize("endings", [("csv", "parquet")], ids="-".join)
def test_a_fleet_names_a_drive_of_another_vin_in_a_truck_s_folder(
    truck: str,
    counts: int,
    endings: tuple[str, str],
    tables: list[pl.DataFrame],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where neither VIN is more frequent, neither drive counts."""
    said, drives = in_a_fleet(of_two_vins(tables, tmp_path, endings), tmp_path, truck, monkeypatch)
    assert len(drives.filter(pl.col("error").is_null())) == counts
    assert f"b.{endings[1]} has VIN {OTHER_VIN}" in said and VIN in said
    assert set(drives["error_code"].drop_nulls()) == {"different_trucks"}


def test_a_fleet_counts_the_vin_of_most_drives_and_another_one_since_a_truck_was_replaced(
    tables: list[pl.DataFrame], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    logs = (*of_two_vins(tables, tmp_path, ("csv", "csv")), tmp_path / "logs" / "c.csv")
    written(steady_drive().table, logs[2], "2026-03-01T07:00:00Z", VIN)
    said, drives = in_a_fleet(logs, tmp_path, "depot-7", monkeypatch)
    assert f"b.csv has VIN {OTHER_VIN}, and 2 drives of truck depot-7 VIN {VIN}" in said
    assert drives.filter(pl.col("error_code") == "different_trucks")["vin"].to_list() == [OTHER_VIN]
    output = ["--output", str(tmp_path / "out")]
    assert run(["fleet", "event", "depot-7", "another_truck", "--date", "2026-03-05", *output]) == 0
    summary = night([str(tmp_path / "fleet")], tmp_path / "vehicles", tmp_path / "out")
    assert summary.refused == {} and summary.events == 1
    (row,) = pl.read_parquet(tmp_path / "out" / "trucks.parquet").to_dicts()
    assert (row["drives"], row["told"]) == (1, 1)


# -- copies


def renamed(table: pl.DataFrame, folder: Path) -> Pair:
    one = written(table, folder / "logs" / "a.parquet", DATE)
    return one, Path(shutil.copy(one, one.with_name("b.parquet")))


def other_format(table: pl.DataFrame, folder: Path) -> Pair:
    return written(table, folder / "logs" / "a.parquet", DATE), written(table, folder / "logs" / "b.csv", DATE)


def without_its_date(table: pl.DataFrame, folder: Path) -> Pair:
    return written(table, folder / "logs" / "a.parquet", DATE), written(table, folder / "logs" / "b.csv")


def a_part(table: pl.DataFrame, folder: Path) -> Pair:
    part = table[: len(table) // 2]
    return written(table, folder / "logs" / "a.parquet", DATE), written(part, folder / "logs" / "b.csv", DATE)


COPIES = pytest.mark.parametrize("copied", [renamed, other_format, without_its_date, a_part])
Copied = Callable[[pl.DataFrame, Path], Pair]


@COPIES
def test_a_copy_counts_once_in_an_answer_that_names_both(
    copied: Copied, tables: list[pl.DataFrame], tmp_path: Path, capfd: Capture
) -> None:
    logs = copied(tables[0], tmp_path)
    assert run(["offset", *map(str, logs), "--vehicle", TRUCK, "--json"]) == 0
    both: dict[str, Any] = json.loads(capfd.readouterr().out)
    assert any("b." in note and "has the same drive as" in note and "a.parquet" in note for note in both["notes"])
    assert run(["offset", str(logs[0]), "--vehicle", TRUCK, "--json"]) == 0
    assert both["offset"] == json.loads(capfd.readouterr().out)["offset"]


@COPIES
def test_a_copy_adds_nothing_to_a_memory_that_has_the_drive(
    copied: Copied, tables: list[pl.DataFrame], tmp_path: Path, capfd: Capture
) -> None:
    logs, file = copied(tables[0], tmp_path), tmp_path / "memory.toml"
    arguments = ["--vehicle", TRUCK, "--memory", str(file)]
    assert run(["offset", str(logs[0]), *arguments]) == 0
    before = file.read_text()
    capfd.readouterr()
    assert run(["offset", str(logs[1]), *arguments]) == 0
    assert "is in the truck's memory already" in capfd.readouterr().out and file.read_text() == before


@COPIES
def test_a_copy_is_no_drive_after_a_repair(
    copied: Copied, tables: list[pl.DataFrame], tmp_path: Path, capfd: Capture
) -> None:
    logs = copied(tables[0], tmp_path)
    code, said = refused(["compare", *map(str, logs), "--in-given-order"], capfd)
    assert code == "usage" and "are of one drive" in said and all(log.name in said for log in logs)


@COPIES
def test_a_copy_does_not_count_for_its_truck_in_a_fleet(
    copied: Copied, tables: list[pl.DataFrame], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, drives = in_a_fleet(copied(tables[0], tmp_path), tmp_path, "depot-7", monkeypatch)
    assert len(drives.filter(pl.col("copy_of").is_null())) == 1
    assert set(drives["copy_of"].drop_nulls()) <= set(drives["key"])


# -- dates


@pytest.mark.parametrize("by", ["logs", "answers", "Python"])
def test_a_drive_before_that_was_driven_later_is_refused_with_both_dates(
    by: str, tables: list[pl.DataFrame], tmp_path: Path, capfd: Capture
) -> None:
    before = written(tables[0], tmp_path / "logs" / "a.parquet", LATER)
    after = written(tables[1], tmp_path / "logs" / "b.parquet", DATE)
    if by == "Python":
        with pytest.raises(oc.OncenterError) as error:
            oc.compare(*(oc.offset(oc.read(log), TRUCK) for log in (before, after)))
        code, said = error.value.code, str(error.value)
    else:
        places = [before, after]
        if by == "answers":
            places = [log.with_suffix(".json") for log in places]
            for log, place in zip((before, after), places, strict=True):
                place.write_text(oc.offset(oc.read(log), TRUCK).to_json())
        code, said = refused(["compare", *map(str, places), "--in-given-order"], capfd)
    assert code == "drive_order" and all(named in said for named in ("a.parquet", LATER, "b.parquet", DATE))
