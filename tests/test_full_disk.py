"""A disk that is full at any one call of a run: every file is the old or the new one, and one line gives the reason."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from full_disk import SUFFIXES, TRUCK
from test_estimate import steady_drive

from oncenter.export.binaries import ALL_PLATFORMS

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("full_disk")]  # one process fills the disk

HERE = Path(__file__).parent
MORE_PLATFORMS = f"for all platforms: {ALL_PLATFORMS}, then export again\n"  # said where zig is not installed
OF_POLARS = "parquet: File out of specification"  # which loses the system's reason in a file's last bytes
CASES = (
    *(f"simulate .{suffix}" for suffix in SUFFIXES),
    *("angle .csv", "angle .parquet", "angle --report", "offset --report", "offset --json --report"),
    *("export fmu", "export c", "fleet run"),
)


@pytest.fixture(scope="module")
def preload(tmp_path_factory: pytest.TempPathFactory) -> str:
    """What makes a disk full, after what is preloaded already: the sanitizers come first or not at all."""
    library = tmp_path_factory.mktemp("full_disk") / "full_disk.so"
    command = ["gcc", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC", "-o", str(library), str(HERE / "full_disk.c")]
    subprocess.run([*command, "-ldl"], check=True)
    return " ".join([*os.environ.get("LD_PRELOAD", "").split(), str(library)])


@pytest.fixture(scope="module")
def seen(preload: str) -> dict[str, list[dict[str, Any]]]:
    environment = {**os.environ, "LD_PRELOAD": preload, "PYTHONPATH": os.pathsep.join([str(HERE), *sys.path])}
    in_memory = Path("/dev/shm")  # where a sync takes no time
    with TemporaryDirectory(dir=in_memory if os.access(in_memory, os.W_OK) else None) as folder:
        command = [sys.executable, str(HERE / "full_disk.py"), folder]
        done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=600)
    assert done.returncode == 0, done.stderr
    given = json.loads(done.stdout)
    assert tuple(given) == CASES
    return given


@pytest.mark.parametrize("case", CASES)
def test_a_disk_full_at_any_call_leaves_the_old_file_or_the_new_one(
    case: str, seen: dict[str, list[dict[str, Any]]]
) -> None:
    undisturbed, *disturbed = seen[case]
    before, new = undisturbed["before"], undisturbed["files"]
    assert (undisturbed["exit_code"], undisturbed["err"].removeprefix(MORE_PLATFORMS)) == (0, "")
    assert before != new
    assert len(disturbed) >= 6  # opened by us and by a writer, written, synced, renamed, the folder synced
    for run in disturbed:
        assert run["failed"] is not None
        for name, content in run["files"].items():
            assert content in (before.get(name), new.get(name)), (run["failed"], name)
        assert before.keys() <= run["files"].keys() <= before.keys() | new.keys(), run["failed"]  # and nothing beside


@pytest.mark.parametrize("case", CASES[:-1])
def test_a_disk_full_at_any_call_is_one_line_that_names_the_path(
    case: str, seen: dict[str, list[dict[str, Any]]]
) -> None:
    undisturbed, *disturbed = seen[case]
    is_answer = case.startswith(("angle", "offset"))
    for run in disturbed:
        path, reason = run["err"].removeprefix("oncenter: cannot write ").split(": ", maxsplit=1)
        assert path.startswith("/") and ".unfinished" not in path, run
        assert reason == "No space left on device\n" or (path.endswith(".parquet") and OF_POLARS in reason), run
        assert run["exit_code"] == (1 if is_answer else 2), run["failed"]
        assert run["out"] == (undisturbed["out"] if is_answer else ""), run["failed"]


def test_a_fleet_run_after_a_full_disk_completes_the_missing_part(seen: dict[str, list[dict[str, Any]]]) -> None:
    """SQLite continues without harm if its index in memory, a last sync or a duplicate write fails."""
    undisturbed, *disturbed = seen["fleet run"]
    tables = {name for name in undisturbed["files"] if name not in ("metrics.json", "index.html")}
    for run in disturbed:
        is_ledger = "ledger.sqlite" in run["failed"] or run["failed"] == "fdatasync /out"
        assert run["exit_code"] == 2 or (is_ledger and run["exit_code"] == 0), run["failed"]
        assert run["err"].count("\n") == (1 if run["exit_code"] else 0), run["failed"]
        assert is_ledger or "No space left on device" in run["err"] or OF_POLARS in run["err"], run["err"]
        assert {name: run["again"][name] for name in tables} == {name: undisturbed["files"][name] for name in tables}


def test_with_json_a_report_on_a_full_disk_leaves_one_object_which_is_the_answer(
    seen: dict[str, list[dict[str, Any]]],
) -> None:
    for run in seen["offset --json --report"]:
        assert json.loads(run["out"])["schema"] == "oncenter/offset-2"


def test_a_separate_process_ends_in_the_same_way(preload: str, tmp_path: Path) -> None:
    """Nothing in that process is replaced, from its first call to its last."""
    steady_drive(minutes=0.5).table.write_parquet(tmp_path / "drive.parquet")
    page = tmp_path / "out" / "page.html"
    page.parent.mkdir()
    command = [sys.executable, "-m", "oncenter", "offset", str(tmp_path / "drive.parquet"), "--vehicle", TRUCK]
    environment = {**os.environ, "LD_PRELOAD": preload, "FULL_DISK_FOLDER": str(page.parent)}
    for call in range(1, 20):
        page.write_text("old")
        environment["FULL_DISK_CALL"] = str(call)
        words = [*command, "--json", "--report", str(page)]
        done = subprocess.run(words, capture_output=True, text=True, env=environment)
        assert json.loads(done.stdout)["schema"] == "oncenter/offset-2"
        assert os.listdir(page.parent) == [page.name]
        if done.returncode == 0:
            break
        assert (done.returncode, done.stderr) == (1, f"oncenter: cannot write {page}: No space left on device\n")
        assert page.read_text() == "old" or page.read_text(encoding="utf-8").rstrip().endswith("</html>")
    assert call == 7
    assert page.read_text(encoding="utf-8").rstrip().endswith("</html>")
