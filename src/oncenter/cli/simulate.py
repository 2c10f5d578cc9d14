"""oncenter simulate: a drive whose truth is known."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def simulate(
    scenario: Annotated[str, typer.Argument(help="A shipped scenario's name, or a TOML file.")],
    output: Annotated[
        Path, typer.Option(metavar="LOG", help="Where to write: .log .asc .blf .trc .mf4 .csv .csv.gz .parquet")
    ],
    seed: Annotated[int, typer.Option(help="The same seed gives the same bytes.")] = 1,
) -> None:
    """Drive a truck whose truth is known, and write its log and its truth."""
    from oncenter.cli.overwriting import spare_inputs
    from oncenter.simulate import simulate_to_log, truth_files
    from oncenter.simulate.scenario import read_scenario

    road = read_scenario(scenario).road
    for path in (output, *truth_files(output)):
        spare_inputs({"--output": path}, [scenario, getattr(road, "file", None)])
    simulate_to_log(scenario, seed, output)
    typer.echo(f"wrote {', '.join(map(str, (output, *truth_files(output))))}")
