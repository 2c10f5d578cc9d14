"""oncenter budget: what a truck's sensors may cost the offset."""

from __future__ import annotations

from typing import Annotated

import typer

from oncenter.cli.options import Json, VehicleFile


def budget(
    vehicle_file: VehicleFile,
    speed: Annotated[
        float | None, typer.Option("--speed-km-h", help="Mean speed of driving; else Figure 16's.")
    ] = None,
    backlash: Annotated[
        float | None, typer.Option("--backlash-deg", help="The steering's play, full width; else the standard's most.")
    ] = None,
    json: Json = False,
) -> None:
    """What each error of a truck's sensors costs the offset, (47) and (48), and which sensor to improve first."""
    import oncenter as oc
    from oncenter.offset.budget import BACKLASH_RAD, MEAN_SPEED_M_S
    from oncenter.signals import DEGREE

    given = oc.budget(
        oc.vehicle(vehicle_file),
        mean_speed_m_s=MEAN_SPEED_M_S if speed is None else speed / 3.6,
        backlash_rad=BACKLASH_RAD if backlash is None else backlash * DEGREE,
    )
    typer.echo(given.to_json() if json else str(given))
