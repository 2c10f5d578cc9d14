"""The page about speed: its limits are of whole files, its seconds where they were spent, its tables narrow."""

from __future__ import annotations

import argparse
import re
import sys
import threading
import time
import zlib
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "bench"))

import cold
import cold_steps
import speed_page
import spent
import warm
from drive_logs import write_logs

COLUMNS_MAX = 5  # on a telephone
PACKED = (".csv.gz", ".blf", ".mf4")


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return write_logs("mid_speed_manoeuvre", tmp_path_factory.mktemp("logs"), (".log", ".csv", ".parquet", *PACKED))


def inflated(suffix: str, data: bytes) -> bytes:
    parts = warm.packed(suffix, data)
    return b"".join(zlib.decompress(part, zlib.MAX_WBITS | 32) for part in parts)


def test_the_limit_of_a_packed_log_inflates_all_of_it(logs: dict[str, Path]) -> None:
    frames = logs[".log"].read_bytes().count(b"\n")
    record = 8 + 1 + 4 + 1 + 1 + 1 + 8 + 4  # as simulate/write/mf4.py lays it out, behind its time
    assert inflated(".csv.gz", logs[".csv.gz"].read_bytes()) == logs[".csv"].read_bytes()
    assert inflated(".blf", logs[".blf"].read_bytes()).count(b"LOBJ") == frames
    assert len(inflated(".mf4", 3 * logs[".mf4"].read_bytes())) == 3 * frames * record  # blocks behind one another


def test_the_limit_of_a_text_finds_each_line_end(logs: dict[str, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warm, "CHUNK_BYTES", 1000)
    data = logs[".csv"].read_bytes()
    assert warm.line_ends(data) == data.count(b"\n")


def test_every_contender_of_a_format_reads_all_of_it(logs: dict[str, Path]) -> None:
    """All but our MF4, which takes the messages it knows."""
    frames = logs[".log"].read_bytes().count(b"\n")
    for suffix in (".log", ".blf"):
        field = warm.contenders(suffix, logs[suffix])
        assert field["frames"]() == field["python-can"]() == frames
    assert warm.contenders(".mf4", logs[".mf4"])["python-can"]() == frames
    rows = logs[".csv"].read_bytes().count(b"\n") - 1
    assert {len(warm.contenders(".csv", logs[".csv"])[who]()) for who in ("polars", "numpy")} == {rows}  # type: ignore[arg-type]


def test_imports_within_imports_count_once_and_those_of_other_threads_not_at_all() -> None:
    def slow_import(name: str) -> None:
        time.sleep(0.02)
        if name == "outer":
            imports("inner")

    imports, began = cold_steps.Imports(slow_import), time.perf_counter()
    imports("outer")
    assert 0.04 <= imports.seconds <= time.perf_counter() - began
    before = imports.seconds
    thread = threading.Thread(target=imports, args=("outer",))
    thread.start()
    thread.join()
    assert imports.seconds == before


def test_imports_during_reading_count_as_start_up() -> None:
    imports, found = SimpleNamespace(seconds=1.0), dict[str, float]()

    def read() -> None:
        time.sleep(0.03)
        imports.seconds += 1000.0

    cold_steps.timed(read, "reading_s", imports, found)()  # type: ignore[arg-type]
    assert -1000.0 < found["reading_s"] < -900.0


def test_the_steps_of_a_cold_process_are_its_whole_time(logs: dict[str, Path], tmp_path: Path) -> None:
    began = time.perf_counter()
    found = cold.steps(logs[".parquet"], tmp_path / "steps.json")
    assert set(found) == set(cold.STEPS)
    assert min(found.values()) > 0.0
    assert sum(found.values()) <= time.perf_counter() - began


def test_the_peak_memory_of_a_process_excludes_its_parent() -> None:
    code = "import sys; sys.path.insert(0, sys.argv[1]); import cold; print(cold.timed('-c', sys.argv[2]).peak_mb)"
    small, large = (
        float(speed_page.subprocess.check_output([sys.executable, "-c", code, str(Path(cold.__file__).parent), work]))
        for work in ("pass", "b'x' * (100 << 20)")
    )
    assert small < 40 < 100 < large < 160


def test_time_goes_to_the_file_that_calls_a_library(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spent, "PACKAGE", "/package/")
    sleep_s = {"/package/short.py": 0.05, "/package/long.py": 0.2, "/elsewhere.py": 0.05}
    works = [compile(f"library({name!r}, {seconds})", name, "exec") for name, seconds in sleep_s.items()]
    library: dict[str, Any] = {"clock": time.perf_counter, "sleep": time.sleep, "took_s": {}}
    sleeps = "def library(name, seconds):\n began = clock()\n sleep(seconds)\n took_s[name] = clock() - began"
    exec(compile(sleeps, "/library.py", "exec"), library)
    shares = defaultdict[str, float](float)
    with spent.looks(shares):
        for work in works:
            exec(work, library)
    took_s = library["took_s"]  # a busy machine sleeps for longer than requested
    assert set(shares) == {"short.py", "long.py", spent.OTHERS}
    for name in ("short.py", "long.py"):
        assert shares[name] == pytest.approx(took_s[f"/package/{name}"], rel=0.2, abs=0.02)


def rows_of(text: str) -> Iterator[list[str]]:
    for line in text.splitlines():
        if line.startswith("|"):
            yield line.strip("|").split("|")


def test_no_table_is_wider_than_a_phone_or_has_uneven_rows() -> None:
    steps = dict.fromkeys(cold.STEPS, 0.1)
    times = {"wall_s": 0.5, "cpu_s": 0.6, "peak_mb": 80.0}
    floors = [{"log": name, "bytes": None, **times} for name in cold.FLOORS]
    of_cold = [*floors, *({"log": log, "bytes": 12_000_000, **times, **steps} for log in (".log", ".csv"))]
    seconds = {"limit": 0.01, "copy": 0.001, "signals": 0.1}
    of_frames = {**seconds, "frames": 0.05, "python-can": 1.0, "python-can + cantools": 2.0}
    of_warm = [
        {"log": ".log", "bytes": 12_000_000, "count": 300_000, "limited_by": "find the line ends", "s": of_frames},
        {"log": ".csv", "bytes": 9_000_000, "count": 180_000, "limited_by": "find the line ends",
         "s": {**seconds, "polars": 0.05}},
    ]  # fmt: skip
    of_filters = [{"who": "Autoware", "language": "C++", "mticks_s": 200.0, "of_joint": 40.0, "offset_deg": 2.0}]
    used = {".log": (0.1, {"read/candump.py": 0.6, "_core.py": 0.4}), ".csv": (0.3, {"read/numbers.py": 1.0})}
    given = argparse.Namespace(scenario="thesis_drive", ticks=1_800_000, rounds=5)
    text = speed_page.page(given, of_cold, of_warm, of_filters, used)
    tables = re.findall(r"(?:^\|.+\n)+", text, re.MULTILINE)
    assert len(tables) == 8
    for table in tables:
        lengths = {len(row) for row in rows_of(table)}
        assert len(lengths) == 1
        assert lengths.pop() <= COLUMNS_MAX
    assert "| .log | 6.00 | 0.30 | 20.0 |" in text  # 300,000 frames in 0.05 s and in 1 s
    assert "| .csv | polars | 1.80 | 3.60 | 0.5 |" in text
    assert "| .log | find the line ends | 10.0 | 100 | 10 |" in text
    assert "300,000 frames" in text
    assert "90% goes to\nreading" in text
    assert "10% to the core" in text
    assert "copy of the bytes runs at 10.5 GB/s" in text  # 21 MB in 2 ms
