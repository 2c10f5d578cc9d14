"""Speed and memory in one run: the core against scipy and numba, whole logs against python-can.

    python bench/speed.py [--ticks N] [--frames N] [--rounds N] [--json | --readme]

Contenders take turns and the best round counts, so that a busy machine slows all of them equally. Ticks are timed by
CPU time of this thread, logs by wall time. A rival with another answer than the core ends the run.
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

from oncenter._core import OUTPUT_DTYPE, Core

HERE = Path(__file__).parent
OFFSET_AGREES_DEG = 1e-9
README_MARK = "<!-- below: written by speed.py --readme -->\n"
LOG_OFFSETS_AGREE_DEG = 0.01  # the rival interpolates the speed differently
THESIS_MIN_MTICKS_S, JOINT_MIN_MTICKS_S, CANDUMP_MAX_OF_RIVAL = 20.0, 6.0, 0.1  # requirements
ALONE_MIN_OF_NUMBA = 0.7  # the rival has no sensor check
DRIVE_TICKS = 180_000  # 30 minutes

Row = dict[str, Any]


def core() -> Core:
    return Core(drives.WHEELBASE_M, drives.STEERING_RATIO, {}, drives.RATE_HZ)


def contenders(ticks: int) -> dict[tuple[str, str], Callable[[], float]]:
    """By name and output: a function that processes the drive and returns the offset in rad.

    numba has compiled and all shared memory has been touched before.
    """
    import numba_monitor
    import scipy_monitor

    columns = drives.ticks(ticks)
    arrays = list(columns.values())
    coefficients = numba_monitor.coefficients(core())
    outputs, none = np.zeros(ticks, OUTPUT_DTYPE), np.empty(0, numba_monitor.FLAT_OUTPUT)

    def run_core(outputs: Any) -> float:
        one = core()
        one.run(columns, outputs)
        return float(one.answer()["offset"]["value"])

    def run_numba(outputs: Any) -> float:
        return float(numba_monitor.run(coefficients, *arrays, outputs)[0])

    def run_scipy() -> float:
        return float(scipy_monitor.run(coefficients, *arrays)[0])

    outputs["time"] = 0.0  # touches every page
    run_numba(none)
    return {
        ("core through Python", "summary"): lambda: run_core(None),
        ("numba", "summary"): lambda: run_numba(none),
        ("scipy + numpy", "summary"): run_scipy,
        ("core through Python", "outputs"): lambda: run_core(outputs),
        ("numba", "outputs"): lambda: run_numba(outputs.view(numba_monitor.FLAT_OUTPUT)),
    }


def check_agreement(ticks: int) -> None:
    """Compares every output of every tick, and the final result of scipy."""
    import numba_monitor
    import scipy_monitor

    columns = drives.ticks(ticks)
    arrays = list(columns.values())
    ours, theirs = np.zeros(ticks, OUTPUT_DTYPE), np.zeros(ticks, numba_monitor.FLAT_OUTPUT)
    one = core()
    one.run(columns, ours)
    answer = one.answer()
    coefficients = numba_monitor.coefficients(one)
    answers = {
        "numba": numba_monitor.run(coefficients, *arrays, theirs),
        "scipy + numpy": scipy_monitor.run(coefficients, *arrays),
    }
    for name in numba_monitor.FLAT_OUTPUT.names or ():
        np.testing.assert_allclose(
            theirs[name], ours.view(numba_monitor.FLAT_OUTPUT)[name], rtol=0, atol=1e-11, err_msg=f"numba: {name}"
        )
    rejected_s = np.array(answer["rejected"])
    for who, (offset, sd, gradient, rejected, still_yaw_rate, _) in answers.items():
        differs = math.degrees(abs(offset - answer["offset"]["value"]))
        if not differs < OFFSET_AGREES_DEG:
            sys.exit(f"{who} differs from the core by {differs:g} deg")
        np.testing.assert_allclose(sd, answer["offset"]["standard_deviation"], atol=1e-11, err_msg=who)
        np.testing.assert_allclose(gradient, answer["understeer_gradient"]["value"], atol=1e-11, err_msg=who)
        of_thesis = rejected_s[: len(rejected)]  # the other reasons belong to other methods
        np.testing.assert_allclose(rejected / drives.RATE_HZ, of_thesis, atol=1e-6, err_msg=who)
        np.testing.assert_allclose(still_yaw_rate, answer["yaw_rate_bias"]["value"], atol=1e-11, err_msg=who)


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
    check_agreement(min(ticks, 1_000_000))
    field = contenders(ticks)
    memory = {key: peak_beyond_mb(work) for key, work in field.items()}
    best = best_of(field, rounds)
    return [
        {
            "who": who,
            "asked": asked,
            "mticks_s": ticks / seconds / 1e6,
            "core_is_times_faster": seconds / best["core through Python", asked],
            "peak_mb": memory[who, asked],
        }
        for (who, asked), seconds in best.items()
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


def requirements(ticks: list[Row], parts: list[Row], logs: list[Row], readers: list[Row]) -> list[Row]:
    numba = next(row["mticks_s"] for row in ticks if (row["who"], row["asked"]) == ("numba", "summary"))
    of = {row["method"]: row for row in parts}
    candump = next(row["of_rival"] for row in logs if row["log"] == ".log")
    thesis, joint = (of[method]["whole_mticks_s"] for method in ("thesis", "joint"))
    of_numba = of["thesis"]["alone_mticks_s"] / numba
    asked = [
        (f"thesis method at least {THESIS_MIN_MTICKS_S:g} M ticks/s", thesis, thesis >= THESIS_MIN_MTICKS_S),
        (f"joint method at least {JOINT_MIN_MTICKS_S:g} M ticks/s", joint, joint >= JOINT_MIN_MTICKS_S),
        (f"thesis method alone at least {ALONE_MIN_OF_NUMBA:g} of numba", of_numba, of_numba >= ALONE_MIN_OF_NUMBA),
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
            asked.append((f"{row['log']} at least {least:g} M frames a processor second", rate, rate >= least))
    return [{"asked": text, "is": value, "met": met} for text, value, met in asked]


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
        "| one core | asked | M ticks/s | core is times faster | peak beyond its input, MB |",
        "|---|---|--:|--:|--:|",
    ]
    for row in result["core"]:
        lines.append(
            f"| {row['who']} | {row['asked']} | {row['mticks_s']:.1f} | {row['core_is_times_faster']:.2f} "
            f"| {mb(row['peak_mb'])} |"
        )
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
        "requirements": requirements(ticks, parts, logs, readers),
    }
    print(json.dumps(result, indent=2) if given.json else markdown(result))
    if given.readme:
        readme = HERE / "README.md"
        kept = readme.read_text(encoding="utf-8").split(README_MARK)[0]
        readme.write_text(f"{kept}{README_MARK}\n{markdown(result)}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
