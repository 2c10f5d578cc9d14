"""Simulates a drive with its true values: scenario -> road -> driver, steering, truck -> sensors -> signals, log."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.whole_file import check_place
from oncenter.signals import Signals
from oncenter.simulate.chances import named_chances
from oncenter.simulate.drive import run, tick_count
from oncenter.simulate.road import lay_road
from oncenter.simulate.scenario import Scenario, read_scenario
from oncenter.simulate.sensors import Fault, Sensed, sense
from oncenter.simulate.truck import check_holdable
from oncenter.simulate.truth import Truth, truth_of, write_truth
from oncenter.simulate.write import format_to_write, require_writer, write_log

__all__ = ["Fault", "Truth", "simulate", "simulate_to_log", "truth_files"]


def simulate(scenario: str | os.PathLike[str], seed: int = 1) -> tuple[Signals, Truth]:
    """Simulates a scenario.

    Args:
        scenario: the name of a shipped scenario, as "thesis_drive", or a TOML file.
        seed: not negative; the same scenario and seed give an identical drive, bit for bit.

    Returns:
        The signals as the truck's sensors report them, at 100 Hz, and the true values.

    Raises:
        OncenterError: "scenario_file", exit code 2: no such scenario, or a value is missing, unknown or invalid.
            "seed", exit code 2: the seed is negative.
    """
    sensed, truth = _simulate(read_scenario(scenario), seed)
    return sensed.signals, truth


def simulate_to_log(scenario: str | os.PathLike[str], seed: int, output: str | os.PathLike[str]) -> Truth:
    """Simulates a scenario and writes its log, with `.truth.parquet` and `.truth.toml` beside it.

    Args:
        scenario: as for `simulate`.
        seed: as for `simulate`.
        output: its suffix is one of `oncenter.files.log_formats.WRITTEN`. A table has the signals at 100 Hz, any other
            log their J1939 frames.

    Raises:
        OncenterError: as `simulate`; "output", exit code 2: unknown suffix, or it cannot be written; "missing_extra":
            the package that writes this format is not installed.
    """
    log = Path(output)
    table, summary = truth_files(log)
    for path in (log, table, summary):
        check_place(path)
    require_writer(log)
    settings = read_scenario(scenario)
    sensed, truth = _simulate(settings, seed)
    write_log(sensed, log, jitter_sd_s=settings.can.jitter_sd_ms / 1000.0, seed=seed)
    write_truth(truth, table, summary)
    return truth


def truth_files(log: Path) -> tuple[Path, Path]:
    """`drive.truth.parquet` and `drive.truth.toml` beside a log `drive.log` or `drive.csv.gz`.

    Raises:
        OncenterError: "output", exit code 2: logs with this suffix cannot be written.
    """
    stem = log.name.removesuffix(format_to_write(log).suffixes[0])
    return log.with_name(f"{stem}.truth.parquet"), log.with_name(f"{stem}.truth.toml")


def _simulate(scenario: Scenario, seed: int) -> tuple[Sensed, Truth]:
    """Road, driver, sensors and wind each have their own random numbers, so that a change in one leaves the others."""
    if seed < 0:
        raise OncenterError(f"'seed' must not be negative, got {seed}", code="seed", exit_code=WRONG_USAGE)
    check_holdable(scenario)
    of_road, of_driver, of_sensors, of_wind = map(np.random.default_rng, np.random.SeedSequence(seed).spawn(4))
    road = lay_road(scenario, of_road)
    lane_normals, hand_normals = of_driver.standard_normal((2, tick_count(scenario)))
    gust_normals = None if scenario.wind is None else of_wind.standard_normal(tick_count(scenario))
    bump_normals = None
    if scenario.steering.bump_steer_sd_deg > 0.0:
        bump_normals = named_chances(of_driver, "bump_steer").standard_normal(tick_count(scenario))
    rows = run(scenario, road, lane_normals, hand_normals, gust_normals, bump_normals)
    sensed = sense(scenario, rows, of_sensors)
    return sensed, truth_of(scenario, seed, rows, sensed)
