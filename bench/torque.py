"""Benefit of a steering wheel torque sensor: the same drives with and without it.

    python bench/torque.py [--drives N] [--rows a,b] [--seconds S]

Rows of accuracy_rows.py and effects_rows.py, tuning seeds from 20001 on. Each drive is evaluated twice, with the
torque signal and without. `--seconds` shortens the drives. The drive's own interval is judged by the error without the
effect of the pull, the total one by the full error.
"""

from __future__ import annotations

import argparse
import dataclasses
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from accuracy_rows import ROWS, Row, drive
from effects_rows import EFFECTS

import oncenter as oc
from oncenter.signals import DEGREE, SIGNALS, Signals

FIRST_SEED = 20_001
TORQUE = "steering_wheel_torque"
DEFAULT_ROWS = (
    "ordinary",
    "pull",
    "wind",
    "no_play",
    "motorway",
    "no_accelerometer",
    "no_accelerometer_motorway",
    "accelerometer_drift",
    "accelerometer_drift_double",
    "relearning_double",
)
HEADINGS = (
    "row",
    "torque",
    "valid",
    "error",
    "95 %",
    "valid 95 %",
    "half-width",
    "drive holds",
    "total",
    "total holds",
)
Figures = tuple[float, ...]


def without_torque(signals: Signals) -> Signals:
    sources = {name: source for name, source in signals.sources.items() if name != TORQUE}
    return dataclasses.replace(signals, table=signals.table.drop(SIGNALS[TORQUE].column), sources=sources)


def figures(row: Row, seed: int, folder: Path, seconds: float | None) -> tuple[Figures, Figures]:
    """One drive without and with torque: valid, error, own error, drive's and total half-width, total error."""
    driven = drive(dataclasses.replace(row, torque=True, like=row.like or row.name), seed, folder)
    signals = driven.signals
    if seconds is not None:
        signals = dataclasses.replace(signals, table=signals.table.head(round(seconds * signals.rate_hz)))
    unloads = driven.truth.unloading_acceleration_m_s2
    shift_m_s2 = 0.0 if np.isnan(unloads) else unloads

    def judged(log: Signals) -> Figures:
        answer = oc.offset(log, driven.vehicle)
        assert answer.offset.value is not None and answer.offset.ci95 is not None
        assert answer.offset_half_width_rad is not None
        target, (low, high) = float(driven.target_rad[-1]), answer.offset.ci95
        error = (answer.offset.value - target) / DEGREE
        own = error - shift_m_s2 * answer.offset_per_acceleration / DEGREE
        valid = float(answer.offset.status == "valid")
        half, middle = 0.5 * (high - low) / DEGREE, (0.5 * (low + high) - target) / DEGREE
        return valid, error, own, answer.offset_half_width_rad / DEGREE, half, middle

    return judged(without_torque(signals)), judged(signals)


def line(name: str, torque: str, drives: Sequence[Figures]) -> list[str]:
    valid, error, own, drive_half, total_half, middle = np.array(drives).T
    chosen = np.abs(error[valid > 0.0])
    return [
        name,
        torque,
        f"{np.mean(valid):.0%}",
        f"{np.median(np.abs(error)):.2f}",
        f"{np.quantile(np.abs(error), 0.95):.2f}",
        f"{np.quantile(chosen, 0.95):.2f}" if len(chosen) else "",
        f"{np.median(drive_half):.2f}",
        f"{np.mean(np.abs(own) < drive_half):.0%}",
        f"{np.median(total_half):.2f}",
        f"{np.mean(np.abs(middle) < total_half):.0%}",
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drives", type=int, default=60, help="of each row (60)")
    parser.add_argument("--rows", default=",".join(DEFAULT_ROWS), help="by name, with commas between")
    parser.add_argument("--seconds", type=float, help="of each drive, from its begin")
    given = parser.parse_args()
    print(f"| {' | '.join(HEADINGS)} |\n|---|---|{'--:|' * (len(HEADINGS) - 2)}", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for name in given.rows.split(","):
            row = ROWS.get(name) or EFFECTS[name]
            seeds = range(FIRST_SEED, FIRST_SEED + given.drives)
            both = [figures(row, seed, Path(folder), given.seconds) for seed in seeds]
            for torque, drives in zip(("no", "yes"), zip(*both, strict=True), strict=True):
                print(f"| {' | '.join(line(name, torque, drives))} |", flush=True)


if __name__ == "__main__":
    main()
