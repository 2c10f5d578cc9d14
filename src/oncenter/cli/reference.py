"""oncenter reference: the offset measured by driving a straight both ways."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from oncenter.cli.logs import read_log
from oncenter.cli.options import Dbc, Json, Source, sources_of


def reference(
    log: Annotated[
        Path,
        typer.Argument(metavar="LOG", readable=False, help="A drive both ways over one straight, with GNSS positions."),
    ],
    vehicle_file: Annotated[
        str | None,
        typer.Option("--vehicle", metavar="FILE", help="For its [signals] and dbc, where the log has other names."),
    ] = None,
    json: Json = False,
    dbc: Dbc = None,
    source: Source = None,
) -> None:
    """The offset measured by driving one straight both ways: without model, gyro or vehicle data."""
    import oncenter as oc

    truck = None if vehicle_file is None else oc.vehicle(vehicle_file)
    drive = read_log(log, truck, dbc or (), sources_of(source))
    measured = oc.reference(drive)
    typer.echo(measured.to_json() if json else str(measured))
