"""Speed and memory in one run: the core at each tick, whole logs against python-can.

    python bench/speed.py [--ticks N] [--frames N] [--rounds N] [--json | --readme]

Contenders take turns and the best round counts, so that a busy machine slows all of them equally. Ticks are timed by
CPU time of this thread, logs by wall time. Another answer than that of
tests/oracle.py or of a rival ends the run.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import drives
import numpy as np
import polars as pl
from core_parts import parts_table
from readers import MIN_MFRAMES_S, readers_table
from turns import best_of

from oncenter._core import OUTPUT_DTYPE, Core, default_params

HERE = Path(__file__).parent
OFFSET_AGREES_DEG = 1e-9
README_MARK = "<!-- below: written by speed.py --readme -->\n"
LOG_OFFSETS_AGREE_DEG = 0.01  # the rival interpolates the speed differently
THESIS_MIN_MTICKS_S, JOINT_MIN_MTICKS_S, CANDUMP_MAX_OF_RIVAL = 20.0, 6.0, 0.1  # requirements
DRIVE_TICKS = 180_000  # 30 minutes

Row = dict[str, Any]


def core() -> Core:
    return Core(drives.WHEELBASE_M, drives.STEERING_RATIO, {}, drives.RATE_HZ)


def check_agreement(ticks: int) -> None:
    """Checks the core against the second implementation, the thesis in NumPy."""
    sys.path.append(str(HERE.parent / "tests"))
    import oracle

    columns = drives.ticks(ticks)
    one = core()
    one.run(columns)
    params = default_params()
    theirs = oracle.estimate(columns, drives.WHEELBASE_M, drives.STEERING_RATIO, params, drives.RATE_HZ)
    differs = math.degrees(abs(theirs.offset - one.answer()["offset"]["value"]))
    if not differs < OFFSET_AGREES_DEG:
        sys.exit(f"the core differs from tests/oracle.py by {differs:g} deg")


def peak_beyond_mb(work: Callable[[], object]) -> float | None:
    """Peak memory of `work` above the memory before it; None if the system does not report it."""
    status, forget = Path("/proc/self/status"), Path("/proc/self/clear_refs")
    try:
        forget.write_text("5")  # resets the peak to the current memory
        before = int(status.read_text().split("VmHWM:")[1].split()[0])
        work()
        return (int(status.read_text().split("VmHWM:")[1].split()[0]) - before) / 1024
    except (OSError, IndexError):
        return None


def ticks_table(ticks: int, rounds: int) -> list[Row]:
    """The core through Python: the answer alone, and with the outputs of every tick."""
    check_agreement(min(ticks, DRIVE_TICKS))
    columns = drives.ticks(ticks)
    outputs = np.zeros(ticks, OUTPUT_DTYPE)
    outputs["time"] = 0.0  # touches every page
    field = {"summary": lambda: core().run(columns), "outputs": lambda: core().run(columns, outputs)}
    memory = {name: peak_beyond_mb(work) for name, work in field.items()}
    best = best_of(field, rounds)
    return [
        {"asked": name, "mticks_s": ticks / seconds / 1e6, "peak_mb": memory[name]} for name, seconds in best.items()
    ]


def one_log(who: str, log: Path) -> dict[str, float]:
    done = subprocess.run(
        [sys.executable, HERE / "log_to_answer.py", who, log], capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        sys.exit(f"{who} on {log.name}: {done.stderr}")
    return dict(json.loads(done.stdout.splitlines()[-1]))


def logs_table(frames: int, rounds: int) -> list[Row]:
    import logs

    rows: list[Row] = []
    made = logs.frames(frames)
    with tempfile.TemporaryDirectory() as folder:
        for suffix, write in logs.WRITERS.items():
            log = Path(folder) / f"drive{suffix}"
            write(log, made)
            ran: dict[str, list[dict[str, float]]] = {"ours": [], "rival": []}
            for _ in range(rounds):
                for who, results in ran.items():
                    results.append(one_log(who, log))
            offsets = [result["offset_deg"] for results in ran.values() for result in results]
            if not max(offsets) - min(offsets) < LOG_OFFSETS_AGREE_DEG:
                sys.exit(f"{log.name}: offsets differ, {offsets} deg")
            best = {who: min(results, key=lambda result: result["s"]) for who, results in ran.items()}
            rows.append(
                {
                    "log": suffix,
                    "mb": log.stat().st_size / 1e6,
                    "offset_deg": offsets[0],
                    "s": best["ours"]["s"],
                    "rival_s": best["rival"]["s"],
                    "of_rival": best["ours"]["s"] / best["rival"]["s"],
                    "peak_mb": best["ours"]["peak_mb"],
                    "rival_peak_mb": best["rival"]["peak_mb"],
                    "imported_mb": best["ours"]["imported_mb"],
                }
            )
            log.unlink()
    return rows


def drive_table(rounds: int) -> list[Row]:
    """CPU ms of a 30-minute drive in a fleet's process, which keeps its imports: best of the rounds."""
    import oncenter as oc

    truck = oc.vehicle("scania_r730_4x2")
    best = dict.fromkeys(("read", "offset"), math.inf)
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "drive.parquet"
        pl.DataFrame(drives.ticks(DRIVE_TICKS)).write_parquet(log)
        for _ in range(rounds):
            began = time.process_time()
            signals = oc.read(log)
            read = time.process_time()
            oc.offset(signals, truck)
            best["read"] = min(best["read"], read - began)
            best["offset"] = min(best["offset"], time.process_time() - read)
    return [{"step": step, "cpu_ms": 1000.0 * seconds} for step, seconds in best.items()]


def requirements(parts: list[Row], logs: list[Row], readers: list[Row]) -> list[Row]:
    of = {row["method"]: row for row in parts}
    candump = next(row["of_rival"] for row in logs if row["log"] == ".log")
    thesis, joint = (of[method]["whole_mticks_s"] for method in ("thesis", "joint"))
    required = [
        (f"thesis method at least {THESIS_MIN_MTICKS_S:g} M ticks/s", thesis, thesis >= THESIS_MIN_MTICKS_S),
        (f"joint method at least {JOINT_MIN_MTICKS_S:g} M ticks/s", joint, joint >= JOINT_MIN_MTICKS_S),
        (
            f"candump at most {CANDUMP_MAX_OF_RIVAL:g} of python-can + cantools",
            candump,
            candump <= CANDUMP_MAX_OF_RIVAL,
        ),
    ]
    for row in readers:
        least = MIN_MFRAMES_S.get(row["log"])
        if least is not None:
            rate = row["mframes_cpu_s"]
            required.append((f"{row['log']} at least {least:g} M frames a processor second", rate, rate >= least))
    return [{"asked": text, "is": value, "met": met} for text, value, met in required]


def machine() -> str:
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    name = names[0] if names else platform.machine()
    return f"{name}, {os.cpu_count()} CPUs, Python {platform.python_version()}"


def markdown(result: dict[str, Any]) -> str:
    def mb(value: float | None) -> str:
        return "?" if value is None else f"{value:.1f}"

    lines = [
        f"{result['machine']}; {result['ticks']:,} ticks, {result['frames']:,} frames, best of {result['rounds']}.",
        "",
        "| core through Python | M ticks/s | peak beyond its input, MB |",
        "|---|--:|--:|",
    ]
    lines += [f"| {row['asked']} | {row['mticks_s']:.1f} | {mb(row['peak_mb'])} |" for row in result["core"]]
    lines += [
        "",
        "| method | M ticks/s in the product | without sensor check and angle | these alone |",
        "|---|--:|--:|--:|",
    ]
    for row in result["parts"]:
        rates = (row["whole_mticks_s"], row["alone_mticks_s"], row["angle_mticks_s"])
        lines.append(f"| {row['method']} | {' | '.join(f'{rate:.1f}' for rate in rates)} |")
    cost = ", ".join(f"{row['cpu_ms']:.0f} ms to {row['step']}" for row in result["drive"])
    lines += ["", f"A Parquet drive of 30 minutes costs a fleet's process {cost} (joint method, answer in full)."]
    lines += [
        "",
        "| log to answer | MB | ours, s | python-can + cantools, s | ratio | peak, MB: imports, ours, theirs |",
        "|---|--:|--:|--:|--:|--:|",
    ]
    for row in result["logs"]:
        lines.append(
            f"| {row['log']} | {row['mb']:.0f} | {row['s']:.2f} | {row['rival_s']:.2f} | {row['of_rival']:.3f} "
            f"| {mb(row['imported_mb'])}, {mb(row['peak_mb'])}, {mb(row['rival_peak_mb'])} |"
        )
    lines += ["", "| reader | M frames/s | a processor's | python-can | times faster |", "|---|--:|--:|--:|--:|"]
    for row in result["readers"]:
        rates = f"{row['mframes_s']:.2f} | {row['mframes_cpu_s']:.2f} | {row['rival_mframes_s']:.3f}"
        lines.append(f"| {row['log']} | {rates} | {row['mframes_s'] / row['rival_mframes_s']:.0f} |")
    lines += ["", "| asked | is | |", "|---|--:|---|"]
    for row in result["requirements"]:
        lines.append(f"| {row['asked']} | {row['is']:.3g} | {'met' if row['met'] else 'MISSED'} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ticks", type=int, default=2_000_000, help="rows of the drive, at least 20000")
    parser.add_argument("--frames", type=int, default=1_000_000, help="frames in each log, at least 100000")
    parser.add_argument("--rounds", type=int, default=10, help="of the ticks; logs have two")
    shape = parser.add_mutually_exclusive_group()
    shape.add_argument("--json", action="store_true", help="print an object instead of tables")
    shape.add_argument("--readme", action="store_true", help="write the tables into README.md as well")
    given = parser.parse_args()
    ticks = ticks_table(max(given.ticks, 20_000), given.rounds)
    parts = parts_table(max(given.ticks, 20_000), given.rounds)
    logs = logs_table(max(given.frames, 100_000), min(given.rounds, 2))
    readers = readers_table(max(given.frames, 100_000), given.rounds)
    result = {
        "machine": machine(),
        "ticks": given.ticks,
        "frames": given.frames,
        "rounds": given.rounds,
        "core": ticks,
        "parts": parts,
        "drive": drive_table(given.rounds),
        "logs": logs,
        "readers": readers,
        "requirements": requirements(parts, logs, readers),
    }
    print(json.dumps(result, indent=2) if given.json else markdown(result))
    if given.readme:
        readme = HERE / "README.md"
        kept = readme.read_text(encoding="utf-8").split(README_MARK)[0]
        readme.write_text(f"{kept}{README_MARK}\n{markdown(result)}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
