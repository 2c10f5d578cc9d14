"""oncenter budget: the contribution of each sensor error to the error of the offset."""

from __future__ import annotations

from typing import Annotated

import typer

from oncenter.cli.options import Json, VehicleFile


def budget(
    vehicle_file: VehicleFile,
    speed: Annotated[
        float | None,
        typer.Option(
            "--speed-km-h", metavar="KM/H", help="Mean speed of the drives; by default that of Figure 16, 54."
        ),
    ] = None,
    backlash: Annotated[
        float | None,
        typer.Option(
            "--backlash-deg",
            metavar="DEG",
            help="Free play of the steering, full width; by default the maximum of the maintenance standard, 15.",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Compute how each sensor error affects the offset.

    The result names the sensor to improve first. The equations are (47) and (48) of the thesis; the sensor errors are
    in the [sensors] table of the vehicle file.
    """
    import oncenter as oc
    from oncenter.offset.budget import BACKLASH_RAD, MEAN_SPEED_M_S
    from oncenter.signals import DEGREE

    given = oc.budget(
        oc.vehicle(vehicle_file),
        mean_speed_m_s=MEAN_SPEED_M_S if speed is None else speed / 3.6,
        backlash_rad=BACKLASH_RAD if backlash is None else backlash * DEGREE,
    )
    typer.echo(given.to_json() if json else str(given))
