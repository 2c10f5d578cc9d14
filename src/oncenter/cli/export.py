"""oncenter export: the core for other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from oncenter.cli.completion import vehicle_files
from oncenter.cli.options import VehicleFile
from oncenter.errors import WRONG_USAGE, OncenterError

_EPILOG = "Example: oncenter export {}"

export = typer.Typer(name="export")


@export.callback(invoke_without_command=True)
def _export(context: typer.Context) -> None:
    """Export the core as an FMU or as C."""
    if context.invoked_subcommand is None:
        raise OncenterError(
            "export needs a command: oncenter export fmu, or oncenter export c", code="usage", exit_code=WRONG_USAGE
        )


@export.command(epilog=_EPILOG.format("fmu --vehicle truck.toml --output truck.fmu"))
def fmu(
    vehicle_file: VehicleFile,
    output: Annotated[Path, typer.Option(metavar="F.fmu", help="The FMU to write.")],
    fmi: Annotated[
        Literal["2", "3"],
        typer.Option(help="Version of FMI: 2 for FMI 2.0, which nearly all tools import, or 3 for FMI 3.0."),
    ] = "2",
) -> None:
    """Write an FMU of one truck's monitor.

    It is for co-simulation and holds sources, and binaries for Windows, Linux and macOS.
    """
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


@export.command(epilog=_EPILOG.format("c --vehicle truck.toml --output oncenter_core"))
def c(
    output: Annotated[Path, typer.Option(metavar="DIR", help="The folder to write; it must be new or empty.")],
    vehicle_file: Annotated[
        str | None,
        typer.Option(
            "--vehicle",
            metavar="FILE",
            help="The truck of the program in ecu/: a vehicle file, or the name of a shipped one. Without it the ECU's "
            "calibration sets the truck.",
            autocompletion=vehicle_files,
        ),
    ] = None,
) -> None:
    """Write the core and one truck's monitor as one folder of C.

    The folder has a test and an A2L description, for an ECU project.
    """
    import oncenter as oc
    from oncenter.export import write_c

    truck = None if vehicle_file is None else oc.vehicle(vehicle_file)
    folder = write_c(output, truck)
    about = "" if truck is None else f", {truck.name}"
    typer.echo(f"wrote {folder}{about}: cd there and run make, or see its README.md")
