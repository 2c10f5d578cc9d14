"""oncenter vehicle: writes, checks and lists vehicle files."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from oncenter.cli.completion import signal_names, vehicle_files
from oncenter.cli.options import Dbc
from oncenter.errors import WRONG_USAGE, OncenterError

_EPILOG = "Example: oncenter vehicle {}"
_SIGNAL = "SIGNAL=NAME[,UNIT[,SIGN]]"

vehicle = typer.Typer(name="vehicle")


@vehicle.callback(invoke_without_command=True)
def _vehicle(context: typer.Context) -> None:
    """Write, check or list vehicle files."""
    if context.invoked_subcommand is None:
        raise OncenterError(
            "vehicle needs a command: oncenter vehicle new truck.toml, oncenter vehicle check truck.toml, or "
            "oncenter vehicle list",
            code="usage",
            exit_code=WRONG_USAGE,
        )


@vehicle.command(epilog=_EPILOG.format("new truck.toml --wheelbase-m 3.7 --steering-ratio 19.3 --traffic-side right"))
def new(
    output: Annotated[Path, typer.Argument(metavar="OUT.toml", help="The vehicle file to write; it must not exist.")],
    name: Annotated[str | None, typer.Option(help="Name of the truck; by default the name of the file.")] = None,
    wheelbase_m: Annotated[
        float | None, typer.Option(metavar="M", help="Distance from the first to the (equivalent) rear axle, m.")
    ] = None,
    steering_ratio: Annotated[
        float | None,
        typer.Option(metavar="RATIO", help="Steering wheel angle per front wheel angle, usually 16 to 24."),
    ] = None,
    axle_layout: Annotated[
        Literal["4x2", "6x2", "6x4", "8x4"] | None, typer.Option(help="Number of wheels x driven wheels.")
    ] = None,
    track_width_front_m: Annotated[
        float | None, typer.Option(metavar="M", help="Between the middles of the front tyres, m.")
    ] = None,
    track_width_rear_m: Annotated[
        float | None, typer.Option(metavar="M", help="Between the middles of the left and right rear tyres, m.")
    ] = None,
    traffic_side: Annotated[
        Literal["right", "left"] | None, typer.Option(help="Side of the road on which the truck is driven.")
    ] = None,
    dbc: Dbc = None,
    signal: Annotated[
        list[str] | None,
        typer.Option(
            metavar=_SIGNAL,
            help="Name of a signal in this truck's logs, e.g. yaw_rate=ESP.YawRate,deg_s,-1. Repeat the "
            "option for several signals.",
            autocompletion=signal_names,
        ),
    ] = None,
    log: Annotated[
        Path | None,
        typer.Option(
            metavar="LOG", help="A log of this truck: with its columns, or with --dbc, signal names are proposed."
        ),
    ] = None,
) -> None:
    """Write a vehicle file in which every key is explained.

    In a terminal it prompts for each value. With --wheelbase-m or --steering-ratio there are no prompts.
    """
    import oncenter as oc
    from oncenter.files.whole_file import check_place, write_whole
    from oncenter.vehicle_file.check import unusual
    from oncenter.vehicle_file.new import new_vehicle_file, proposals_for

    _refuse_existing(output)
    check_place(output)
    given: dict[str, Any] = {
        "name": name,
        "wheelbase_m": wheelbase_m,
        "steering_ratio": steering_ratio,
        "axle_layout": axle_layout,
        "track_width_front_m": track_width_front_m,
        "track_width_rear_m": track_width_rear_m,
        "traffic_side": traffic_side,
        "dbc": [str(path) for path in dbc or ()] or None,
        "signals": _signals_of(signal or ()) or None,
    }
    values: dict[str, Any] = {key: value for key, value in given.items() if value is not None}
    if wheelbase_m is None and steering_ratio is None and sys.stdin is not None and sys.stdin.isatty():
        values = _prompted(output, values)
    databases = [Path(path) for path in values.get("dbc", ())]
    proposed, notes = proposals_for(databases, log, values.get("signals", ()))
    write_whole(output, new_vehicle_file(output, values, proposed))
    for note in [*notes, *unusual(oc.vehicle(output))]:
        typer.echo(f"note: {note}")
    if proposed:
        typer.echo(f"{len(proposed)} signals proposed in [signals]: check name, unit and sign of each")
    if log is not None:
        typer.echo(_product_in(log, str(output)), nl=False)
    by_log = "" if log is None else f" {log}"
    typer.echo(f"wrote {output}: edit it, then check it with: oncenter vehicle check {output}{by_log}")


@vehicle.command(epilog=_EPILOG.format("check truck.toml drive.mf4"))
def check(
    file: Annotated[
        str,
        typer.Argument(
            metavar="FILE", help="A vehicle file, or the name of a shipped one.", autocompletion=vehicle_files
        ),
    ],
    log: Annotated[
        Path | None, typer.Argument(metavar="[LOG]", readable=False, help="A log in which to look for its signals.")
    ] = None,
    dbc: Dbc = None,
) -> None:
    """Check a vehicle file: its values, unusual values, and values that would help.

    With a LOG it also looks for the signals. The exit code is 2 if the file is wrong, or if the log lacks a signal that
    the file names or that the method joint needs.
    """
    import oncenter as oc
    from oncenter.cli.logs import read_log
    from oncenter.vehicle_file.check import checked

    truck = oc.vehicle(file)
    truck.databases()
    drive = None if log is None else read_log(log, truck, dbc or (), {})
    result = checked(truck, drive)
    typer.echo("\n".join(result.lines))
    if not result.is_complete:
        raise typer.Exit(WRONG_USAGE)


@vehicle.command("list", epilog=_EPILOG.format("list"))
def list_() -> None:
    """List the vehicle files that come with oncenter.

    The option --vehicle takes their names.
    """
    import oncenter as oc
    from oncenter.vehicle_file.shipped_files import shipped_files

    files = shipped_files()
    width = max(len(path.stem) for path in files)
    typer.echo(f"{'--vehicle':{width}}  layout  wheelbase  ratio  name")
    for path in files:
        truck = oc.vehicle(path)
        typer.echo(
            f"{path.stem:{width}}  {truck.axle_layout or '-':6}  {truck.wheelbase_m:7.2f} m  "
            f"{truck.ratio_near_centre:5.1f}  {truck.name}"
        )
    typer.echo(f"in {files[0].parent}")


def _refuse_existing(output: Path) -> None:
    """
    Raises:
        OncenterError: "output", exit code 2.
    """
    try:
        exists = output.exists() or output.is_symlink()
    except (OSError, ValueError):  # check_place gives the reason
        exists = False
    if exists:
        raise OncenterError(
            f"{output} exists and is not written over: name another file, or delete it first",
            code="output",
            exit_code=WRONG_USAGE,
        )


def _prompted(output: Path, given: dict[str, Any]) -> dict[str, Any]:
    """Values from the terminal; the prompts go to standard error, as no answer is among them."""
    from oncenter.vehicle_file.questions import answers

    def say(line: str) -> None:
        print(line, file=sys.stderr)

    def ask(prompt: str) -> str:
        print(prompt, end="", file=sys.stderr, flush=True)
        line = sys.stdin.readline()
        if not line:  # Ctrl-D
            raise KeyboardInterrupt
        return line

    say(f"A new vehicle file, {output}. Enter takes the value in brackets; Ctrl-C ends without a file.")
    return {**answers(ask, say, output.stem, given), **given}


def _product_in(log: Path, vehicle_file: str) -> str:
    """A line on steering ratio times wheelbase in the log, for a file that lacks one of them; empty without bends."""
    import oncenter as oc
    from oncenter.cli.logs import read_log

    truck = oc.vehicle(vehicle_file)
    if not truck.assumed:
        return ""
    try:
        found = oc.offset(read_log(log, truck, (), {}), truck).ratio_times_wheelbase
    except OncenterError:  # signals that are still to be assigned: the notes name them
        return ""
    if found.value is None or found.ci95 is None or found.status != "valid":
        return ""
    half_width_m = 0.5 * (found.ci95[1] - found.ci95[0])
    return f"note: the bends of {log} show steering ratio times wheelbase, {found.value:.1f} ±{half_width_m:.1f} m\n"


def _signals_of(given: list[str] | tuple[str, ...]) -> dict[str, dict[str, Any]]:
    """`[signals]` of SIGNAL=NAME[,UNIT[,SIGN]].

    Raises:
        OncenterError: "usage", exit code 2.
    """
    entries: dict[str, dict[str, Any]] = {}
    for each in given:
        signal, equals, rest = each.partition("=")
        name, *others = (part.strip() for part in rest.split(","))
        if not (signal and equals and name) or len(others) > 2 or (len(others) == 2 and others[1] not in ("1", "-1")):
            raise OncenterError(
                f"--signal takes {_SIGNAL}, e.g. yaw_rate=ESP.YawRate,deg_s,-1, got '{each}'",
                code="usage",
                exit_code=WRONG_USAGE,
            )
        entry: dict[str, Any] = {"name": name}
        if others and others[0]:
            entry["unit"] = others[0]
        if len(others) == 2:
            entry["sign"] = int(others[1])
        entries[signal.strip()] = entry
    return entries
