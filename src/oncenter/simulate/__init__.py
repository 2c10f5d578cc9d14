"""A drive whose truth is known: scenario -> road -> driver, steering, truck -> sensors -> signals, log."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.signals import Signals
from oncenter.simulate.can import write_candump
from oncenter.simulate.drive import run, tick_count
from oncenter.simulate.road import lay_road
from oncenter.simulate.scenario import Scenario, read_scenario
from oncenter.simulate.sensors import sense
from oncenter.simulate.truck import check_holdable
from oncenter.simulate.truth import Truth, truth_of, write_truth

__all__ = ["Truth", "simulate", "simulate_to_log"]

_SUFFIXES = (".log", ".csv", ".parquet")


def simulate(scenario: str | os.PathLike[str], seed: int = 1) -> tuple[Signals, Truth]:
    """Drives a scenario.

    Args:
        scenario: the name of a shipped one, as "thesis_drive", or a TOML file.
        seed: not negative; the same scenario and seed give the same drive, bit for bit.

    Returns:
        The signals as the truck's sensors report them, at 100 Hz, and what was true.

    Raises:
        OncenterError: "scenario_file", exit code 2: no such scenario, or a value is missing, unknown or impossible.
            "seed", exit code 2: the seed is negative.
    """
    return _simulate(read_scenario(scenario), seed)


def simulate_to_log(scenario: str | os.PathLike[str], seed: int, output: str | os.PathLike[str]) -> Truth:
    """Drives a scenario and writes its log, with `.truth.parquet` and `.truth.toml` beside it.

    Args:
        scenario, seed: as for `simulate`.
        output: `.log` for a J1939 candump log, `.csv` or `.parquet` for the table of signals at 100 Hz.

    Raises:
        OncenterError: as `simulate`; and "output", exit code 2: another suffix, or it cannot be written.
    """
    log = Path(output)
    if log.suffix not in _SUFFIXES:
        raise OncenterError(
            f"cannot write {log}: its name must end in {', '.join(_SUFFIXES)}", code="output", exit_code=WRONG_USAGE
        )
    settings = read_scenario(scenario)
    signals, truth = _simulate(settings, seed)
    try:
        _write(signals, log, settings, seed)
        write_truth(truth, log)
    except OSError as error:
        raise OncenterError(
            f"cannot write {log}: {error.strerror or error}", code="output", exit_code=WRONG_USAGE
        ) from None
    return truth


def _simulate(scenario: Scenario, seed: int) -> tuple[Signals, Truth]:
    """Each room has its own chances, so that a change in one leaves the others' as they were."""
    if seed < 0:
        raise OncenterError(f"'seed' must not be negative, got {seed}", code="seed", exit_code=WRONG_USAGE)
    check_holdable(scenario)
    of_road, of_driver, of_sensors = (np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(3))
    road = lay_road(scenario, of_road)
    lane_normals, hand_normals = of_driver.standard_normal((2, tick_count(scenario)))
    rows = run(scenario, road, lane_normals, hand_normals)
    return sense(scenario, rows, of_sensors), truth_of(scenario, seed, rows)


def _write(signals: Signals, log: Path, scenario: Scenario, seed: int) -> None:
    if log.suffix == ".parquet":
        signals.table.write_parquet(log)
    elif log.suffix == ".csv":
        signals.table.write_csv(log)
    else:
        write_candump(signals, log, jitter_sd_s=scenario.can.jitter_sd_ms / 1000.0, seed=seed)
