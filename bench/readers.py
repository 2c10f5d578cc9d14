"""Frames per second of the readers for text logs and BLF in one process: oncenter's, and python-can's on fewer
frames."""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable
from itertools import islice
from pathlib import Path
from typing import Any

import logs

SUFFIXES = (".log", ".asc", ".trc", ".blf")
MIN_MFRAMES_S = {".asc": 1.0, ".trc": 1.0, ".blf": 2.5}  # requirements
RIVAL_FRAMES = 20_000

Row = dict[str, Any]


def ours(log: Path) -> int:
    from oncenter.read.frames_of_log import frames_of_log

    return sum(len(frames) for frames in frames_of_log(log, [], lambda fraction: None))


def rival(log: Path) -> int:
    import can

    readers: dict[str, Any] = {
        ".log": can.CanutilsLogReader,
        ".asc": can.ASCReader,
        ".trc": can.TRCReader,
        ".blf": can.BLFReader,
    }
    return sum(1 for _ in islice(readers[log.suffix](log), RIVAL_FRAMES))


def readers_table(frames: int, rounds: int) -> list[Row]:
    """M frames/s by wall time and by CPU time, best of the rounds."""
    rows: list[Row] = []
    made = logs.frames(frames)
    with tempfile.TemporaryDirectory() as folder:
        for suffix in SUFFIXES:
            log = Path(folder) / f"drive{suffix}"
            logs.WRITERS[suffix](log, made)
            count, wall, cpu = _best(ours, log, rounds)
            if count != len(made.time):
                raise SystemExit(f"{count} of {len(made.time)} frames of {log.name}")
            rival_count, rival_wall, _ = _best(rival, log, min(rounds, 2))
            rows.append(
                {
                    "log": suffix,
                    "mframes_s": count / wall / 1e6,
                    "mframes_cpu_s": count / cpu / 1e6,
                    "rival_mframes_s": rival_count / rival_wall / 1e6,
                }
            )
            log.unlink()
    return rows


def _best(read: Callable[[Path], int], log: Path, rounds: int) -> tuple[int, float, float]:
    count, wall, cpu = 0, math.inf, math.inf
    for _ in range(rounds):
        began, used = time.perf_counter(), time.process_time()
        count = read(log)
        wall, cpu = min(wall, time.perf_counter() - began), min(cpu, time.process_time() - used)
    return count, wall, cpu
