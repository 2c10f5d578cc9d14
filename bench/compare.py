"""A change of the offset by two drives of one truck: how often its interval holds the truth, and how wide it is.

    python bench/compare.py [--pairs N] [--jobs N] [--tuning] [--page]

Each pair is one truck of accuracy_rows.py's row `population` (its pull, accelerometer bias and play stay), driven twice
on roads, winds and with gyro biases of their own, with an offset changed by a calibration between the drives. The
change's interval is printed beside the one that both offsets' whole intervals would give. Seeds from 10001 on are for
reporting, those from 20001 on (--tuning) for tuning.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
from accuracy_rows import EVERY_ROW, POPULATED_BY, ROWS, as_toml, laid_over, scenario_values, vehicle_file
from population import draw, wind
from sections import COMPARE, with_section

import oncenter as oc
from oncenter.errors import OncenterError
from oncenter.signals import DEGREE
from oncenter.simulate.scenario import read_scenario

REPORTED_FROM, TUNING_FROM = 10_001, 20_001
BEFORE_SD_DEG, AFTER_SD_DEG = 3.0, 0.3  # of the offset: what calibrations find and leave
GYRO_BIAS_SD_DEG_S = 0.1
ROW = ROWS["population"]
PAGE = Path(__file__).parents[1] / "docs" / "accuracy.md"
Pair = tuple[bool, float, float, float, float]


def pair(seed: int, folder: Path) -> Pair:
    """Whether both offsets are valid, then in deg the change's error, its half-width, the half-width by both whole
    intervals, and the error of the offset after.

    Raises:
        OncenterError: no driver can hold the truck that was drawn.
    """
    random = np.random.default_rng([seed, 40])
    drawn = draw(random, {**EVERY_ROW, **ROW.fixed})
    truck = scenario_values(ROW, drawn, random)
    answers, true_deg = [], []
    for k, sd_deg in enumerate((BEFORE_SD_DEG, AFTER_SD_DEG)):
        of_drive = {
            "base": str(random.choice(POPULATED_BY)),
            "wind": wind(draw(random), random),
            "road": {"heading_deg": random.uniform(0.0, 360.0)},
            "sensors": {
                "steering_wheel_angle": {"offset_deg": random.normal(0.0, sd_deg)},
                "yaw_rate": {"bias_deg_s": random.normal(0.0, GYRO_BIAS_SD_DEG_S)},
            },
        }
        file = folder / f"{seed}_{k}.toml"
        file.write_text(as_toml(laid_over(truck, of_drive)), encoding="utf-8")
        signals, truth = oc.simulate(file, 2 * seed + k)
        vehicle = vehicle_file(ROW, read_scenario(file).truck, truth, random)
        answers.append(oc.offset(signals, vehicle))
        true_deg.append(float(truth.table["steering_wheel_angle_offset_rad"][-1]) / DEGREE)
        file.unlink()
    compared = oc.compare(*answers)
    assert compared.change_deg is not None and compared.half_width_deg is not None
    whole = [0.5 * (ci95[1] - ci95[0]) / DEGREE for ci95 in (answer.offset.ci95 for answer in answers) if ci95]
    return (
        all(answer.offset.status == "valid" for answer in answers),
        compared.change_deg - (true_deg[1] - true_deg[0]),
        compared.half_width_deg,
        math.hypot(*whole),
        (compared.after.value_deg or 0.0) - true_deg[1],
    )


def drawn_pair(seed: int, folder: Path) -> Pair | None:
    """The pair of a drawn truck; None for a truck that no driver can hold."""
    try:
        return pair(seed, folder)
    except OncenterError:
        return None


def table(pairs: Sequence[Pair]) -> Iterator[str]:
    """The table of all pairs and of those with two valid offsets; deg."""
    yield "| pairs | n | change: covered | half-width | error: median / 95 % | half-width by both whole intervals |"
    yield "|---|--:|--:|--:|--:|--:|"
    for name, some in (("all", list(pairs)), ("both valid", [each for each in pairs if each[0]])):
        if not some:
            continue
        _, error, width, whole, _ = map(np.abs, np.array(some, dtype=float).T)
        yield (
            f"| {name} | {len(some)} | {np.mean(error < width):.1%} | {np.median(width):.2f} "
            f"| {np.median(error):.2f} / {np.quantile(error, 0.95):.2f} | {np.median(whole):.2f} |"
        )


def section(pairs: Sequence[Pair]) -> str:
    about = f"""{COMPARE}

Written by `bench/compare.py --page`: {len(pairs)} pairs of drives, seeds from {REPORTED_FROM} on. Each pair is one
truck of `population` on two roads; its sensor is calibrated between the drives. *Covered*: share of true changes in the
interval of `oncenter compare`. Half-widths (medians) and errors are in deg.
"""
    return "\n".join([about, *table(pairs), ""])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=200, help="of drives (200)")
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--tuning", action="store_true", help="seeds from 20001 on instead of the reported ones")
    parser.add_argument("--page", action="store_true", help="write the section of docs/accuracy.md")
    given = parser.parse_args()
    if given.page and given.tuning:
        parser.error("--page reports on the seeds for it")
    first = TUNING_FROM if given.tuning else REPORTED_FROM
    spawn = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory() as name, ProcessPoolExecutor(given.jobs, spawn) as pool:
        found = pool.map(partial(drawn_pair, folder=Path(name)), range(first, first + given.pairs))
        pairs = [each for each in found if each is not None]
    print("\n".join(table(pairs)))
    if given.page:
        before = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(with_section(before, section(pairs)), encoding="utf-8")


if __name__ == "__main__":
    main()
