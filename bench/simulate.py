"""Speed of the simulation relative to real time: road, driver, truck, sensors and table, on one core.

    python bench/simulate.py [--minutes N] [--rounds N] [--json]

The best round counts. Both CPU time of this thread and wall time are given: on a busy machine the former measures the
program, the latter the waiting time.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
import polars as pl
from layouts import THESIS_DRIVE, TRUCKS

from oncenter.simulate import simulate

REQUIRED = {"4x2": 2000.0, "semitrailer": 500.0}  # times real time


def scenario_file(layout: str, minutes: float, folder: Path) -> Path:
    """The thesis drive with another truck and another length, as a separate file."""
    sections = {k: dict(v) if isinstance(v, dict) else v for k, v in THESIS_DRIVE.items()}
    sections["drive"]["duration_s"] = 60.0 * minutes
    sections["truck"] |= TRUCKS[layout]
    file = folder / f"{layout}.toml"
    file.write_text(toml(sections), encoding="utf-8")
    return file


def toml(values: dict[str, object], table: str = "") -> str:
    """TOML of the types used in scenario files: numbers, texts, lists, and nested tables."""
    here = [f"{key} = {json.dumps(value)}" for key, value in values.items() if not isinstance(value, dict)]
    inner = [(f"{table}.{key}".strip("."), value) for key, value in values.items() if isinstance(value, dict)]
    return "\n".join([*here, *(f"\n[{name}]\n{toml(value, name)}" for name, value in inner)])


def times_real_time(file: Path, seconds: float, rounds: int) -> dict[str, float]:
    wall, processor = [], []
    for _ in range(rounds):
        wall_began, processor_began = time.perf_counter(), time.thread_time()
        signals, _ = simulate(file, seed=1)
        wall.append(time.perf_counter() - wall_began)
        processor.append(time.thread_time() - processor_began)
        assert len(signals.table) == round(100 * seconds)
    return {"by_the_wall": seconds / min(wall), "of_processor": seconds / min(processor)}


def main() -> None:
    import tempfile

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=30.0, help="of each drive")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()

    with tempfile.TemporaryDirectory() as folder:
        rows = {
            layout: times_real_time(
                scenario_file(layout, given.minutes, Path(folder)), 60.0 * given.minutes, given.rounds
            )
            for layout in TRUCKS
        }
    if given.json:
        print(json.dumps(rows))
    else:
        print(f"{'truck':12}  {'times real time':>15}  {'of processor':>12}  {'asked':>6}")
        for layout, row in rows.items():
            missed = layout in REQUIRED and row["by_the_wall"] < REQUIRED[layout]
            required = f"{REQUIRED[layout]:6.0f}{' MISSED' if missed else ''}" if layout in REQUIRED else ""
            print(f"{layout:12}  {row['by_the_wall']:15,.0f}  {row['of_processor']:12,.0f}  {required}".rstrip())
        print(f"polars uses {pl.thread_pool_size()} threads, everything else one")


if __name__ == "__main__":
    main()
