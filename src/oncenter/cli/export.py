"""oncenter export: the core for other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from oncenter.cli.options import VehicleFile
from oncenter.errors import WRONG_USAGE, OncenterError

export = typer.Typer(name="export")


@export.callback(invoke_without_command=True)
def _export(context: typer.Context) -> None:
    """The core for other tools: an FMU, or a folder of C."""
    if context.invoked_subcommand is None:
        raise OncenterError(
            "export what: oncenter export fmu, or oncenter export c", code="usage", exit_code=WRONG_USAGE
        )


@export.command()
def fmu(
    vehicle_file: VehicleFile,
    output: Annotated[Path, typer.Option(metavar="F.fmu", help="Where the FMU goes.")],
    fmi: Annotated[Literal["2", "3"], typer.Option(help="FMI 2.0, which nearly all tools import, or 3.0.")] = "2",
) -> None:
    """A co-simulation FMU of one truck's monitor, with sources and binaries for Windows, Linux and macOS."""
    import oncenter as oc
    from oncenter.cli.overwriting import spare_inputs
    from oncenter.export import write_fmu
    from oncenter.export.binaries import ALL_PLATFORMS, has_zig, platforms

    spare_inputs({"--output": output}, [vehicle_file])
    truck = oc.vehicle(vehicle_file)
    version: Literal[2, 3] = 2 if fmi == "2" else 3
    folders = ", ".join(dict.fromkeys(p.folder(version) for p in platforms(version)))
    if has_zig():
        typer.echo(f"compiling for {folders}; the first time takes minutes", err=True)
    path = write_fmu(truck, output, fmi=version)
    typer.echo(f"wrote {path}: FMI {fmi}.0, co-simulation, {truck.name}, for {folders}")
    if not has_zig():
        typer.echo(f"for all platforms: {ALL_PLATFORMS}, then export again", err=True)


@export.command()
def c(
    output: Annotated[Path, typer.Option(metavar="DIR", help="A folder that is new or empty.")],
) -> None:
    """The core as one folder of C with a test, and an A2L description for an ECU project."""
    from oncenter.export import write_c

    folder = write_c(output)
    typer.echo(f"wrote {folder}: cd there and run make, or see its README.md")
