"""The commands as one program: one command a file."""

from __future__ import annotations

import typer

from oncenter.cli.angle import angle
from oncenter.cli.budget import budget
from oncenter.cli.compare import compare
from oncenter.cli.demo import demo
from oncenter.cli.explain import explain
from oncenter.cli.export import export
from oncenter.cli.fleet import fleet
from oncenter.cli.live import live
from oncenter.cli.offset import offset
from oncenter.cli.reference import reference
from oncenter.cli.signals import signals
from oncenter.cli.simulate import simulate
from oncenter.cli.thesis import thesis
from oncenter.cli.vehicle import vehicle

_ABOUT = "Estimate the offset of a truck's steering wheel angle sensor from logs of ordinary driving."
_COMMANDS = (  # with an example of each, below its help
    (offset, "offset drive.mf4 --vehicle truck.toml --report drive.html"),
    (compare, "compare before.json after.json"),
    (angle, "angle drive.mf4 --vehicle truck.toml --sensor-lost-at 600"),
    (reference, "reference both_ways.csv"),
    (budget, "budget --vehicle truck.toml --speed-km-h 80"),
    (live, "live can0 --vehicle truck.toml --web"),
    (signals, "signals drive.mf4 --vehicle truck.toml"),
    (explain, "explain steering_play"),
    (simulate, "simulate heavy_play --output heavy_play.log"),
    (demo, "demo"),
    (thesis, "thesis --output thesis"),
)

app = typer.Typer(
    name="oncenter",
    help=_ABOUT,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
for command, example in _COMMANDS:
    app.command(epilog=f"Example: oncenter {example}")(command)
app.add_typer(vehicle)
app.add_typer(export)
app.add_typer(fleet)


def _version(wanted: bool) -> None:
    if wanted:
        from oncenter import _core

        typer.echo(_core.version())
        raise typer.Exit


@app.callback(
    help=_ABOUT,
    epilog="First steps: oncenter demo; oncenter vehicle new truck.toml; oncenter signals LOG; oncenter offset LOG "
    "--vehicle truck.toml",
)
def _all(
    version: bool = typer.Option(False, "--version", callback=_version, is_eager=True, help="Print the version."),
    debug: bool = typer.Option(False, "--debug", help="Show a traceback on internal errors."),
) -> None:
    pass
