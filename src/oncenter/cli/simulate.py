"""oncenter simulate: a drive with its true offset, play and sensor errors."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from oncenter.cli.completion import scenarios
from oncenter.files.log_formats import WRITTEN


def simulate(
    scenario: Annotated[
        str,
        typer.Argument(
            metavar="SCENARIO",
            help="Name of a shipped scenario, such as thesis_drive or heavy_play, or a TOML file.",
            autocompletion=scenarios,
        ),
    ],
    output: Annotated[Path, typer.Option(metavar="LOG", help=f"The log to write: {' '.join(WRITTEN)}")],
    seed: Annotated[
        int, typer.Option(help="Seed of the random numbers, and of the day; the same seed gives the same bytes.")
    ] = 1,
) -> None:
    """Simulate a drive and write its log and its truth.

    The true offset, play and sensor errors are in files beside the log.
    """
    from oncenter.cli.overwriting import spare_inputs
    from oncenter.simulate import simulate_to_log, truth_files
    from oncenter.simulate.scenario import read_scenario

    road = read_scenario(scenario).road
    for path in (output, *truth_files(output)):
        spare_inputs({"--output": path}, [scenario, getattr(road, "file", None)])
    simulate_to_log(scenario, seed, output)
    typer.echo(f"wrote {', '.join(map(str, (output, *truth_files(output))))}")
