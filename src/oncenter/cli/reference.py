"""oncenter reference: the offset measured by driving a straight both ways."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from oncenter.cli.logs import read_log
from oncenter.cli.options import Dbc, Json, Source, VehicleFileIfAny, sources_of


def reference(
    log: Annotated[
        Path,
        typer.Argument(
            metavar="LOG", readable=False, help="A log of a drive both ways over one straight, with GNSS positions."
        ),
    ],
    vehicle_file: VehicleFileIfAny = None,
    json: Json = False,
    dbc: Dbc = None,
    source: Source = None,
) -> None:
    """Measure the offset by driving one straight both ways.

    This needs GNSS positions, and no model, yaw rate or vehicle data (chapter 3 of the thesis).
    """
    import oncenter as oc

    truck = None if vehicle_file is None else oc.vehicle(vehicle_file)
    drive = read_log(log, truck, dbc or (), sources_of(source))
    measured = oc.reference(drive)
    typer.echo(measured.to_json() if json else str(measured))
