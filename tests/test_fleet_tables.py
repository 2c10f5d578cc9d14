"""The fleet's tables as Parquet files: the same for one part and for many, and never half a file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from oncenter.errors import OncenterError
from oncenter.files.whole_file import remove_unfinished
from oncenter.fleet import tables
from oncenter.fleet.tables import TableFile

COLUMNS = {
    "truck": ("text", "its name"),
    "start": ("time", "of the drive"),
    "offset_deg": ("number", "the offset"),
    "drives": ("count", "all of them"),
    "is_valid": ("truth", "whether it holds"),
}
ROWS: list[dict[str, Any]] = [
    {"truck": f"truck {k}", "start": 1.7e9 + k, "offset_deg": k / 3.0, "drives": k, "is_valid": k % 2 == 0}
    for k in range(25)
]
ROWS[3] = {"truck": "a truck without a drive", "start": None}


def write(path: Path, rows: Sequence[dict[str, Any]]) -> pl.DataFrame:
    with TableFile(path, COLUMNS) as table:
        for row in rows:
            table.add(row)
    return pl.read_parquet(path)


@pytest.mark.parametrize("rows_at_once", [1, 7, 25, 26])
def test_a_table_in_parts_equals_one_that_is_written_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rows_at_once: int
) -> None:
    whole = write(tmp_path / "whole.parquet", ROWS)
    monkeypatch.setattr(tables, "_ROWS_AT_ONCE", rows_at_once)
    assert write(tmp_path / "parts.parquet", ROWS).equals(whole)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["parts.parquet", "whole.parquet"]
    assert whole.schema["start"] == pl.Datetime("ms", "UTC")
    assert whole.to_dicts()[3] == {"truck": "a truck without a drive"} | dict.fromkeys(list(COLUMNS)[1:])
    for path in tmp_path.iterdir():
        assert pl.read_parquet_metadata(path)["oncenter"] == "fleet"


def test_a_table_without_rows_has_its_columns(tmp_path: Path) -> None:
    assert write(tmp_path / "empty.parquet", []).columns == list(COLUMNS)


def test_a_failure_between_two_parts_keeps_the_old_table_and_leaves_nothing_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = write(tmp_path / "drives.parquet", ROWS)
    monkeypatch.setattr(tables, "_ROWS_AT_ONCE", 2)
    with pytest.raises(OncenterError, match=r"cannot write .*drives\.parquet: No space left"):
        write(tmp_path / "drives.parquet", [*ROWS[:5], NoSpace()])
    assert [path.name for path in tmp_path.iterdir()] == ["drives.parquet"]
    assert pl.read_parquet(tmp_path / "drives.parquet").equals(before)


class NoSpace(dict[str, Any]):
    def get(self, *_: object) -> Any:
        raise OSError(28, "No space left on device")


def test_the_parts_of_a_killed_run_are_removed_by_the_next_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tables, "_ROWS_AT_ONCE", 2)
    monkeypatch.setattr(TableFile, "_remove_parts", lambda _: None)
    write(tmp_path / "drives.parquet", ROWS[:5])
    assert len(list(tmp_path.iterdir())) == 4
    remove_unfinished(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["drives.parquet"]
