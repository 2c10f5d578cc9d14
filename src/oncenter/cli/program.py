"""The commands as one program: one command a file."""

from __future__ import annotations

from importlib import import_module

import typer

_ABOUT = "Estimate the offset of a truck's steering wheel angle sensor from logs of ordinary driving."
_COMMANDS = {  # each in the module of its name, with an example below its help; a group has several commands
    "offset": "offset drive.mf4 --vehicle truck.toml --report drive.html",
    "compare": "compare before.json after.json",
    "angle": "angle drive.mf4 --vehicle truck.toml --sensor-lost-at 600",
    "reference": "reference both_ways.csv",
    "budget": "budget --vehicle truck.toml --speed-km-h 80",
    "live": "live can0 --vehicle truck.toml --web",
    "signals": "signals drive.mf4 --vehicle truck.toml",
    "explain": "explain steering_play",
    "app": "app",
    "simulate": "simulate heavy_play --output heavy_play.log",
    "demo": "demo",
    "thesis": "thesis --output thesis",
}
_GROUPS = ("vehicle", "export", "fleet")


def program_of(first: str = "") -> typer.Typer:
    """The program; with a command alone where it is the first argument: the others would load in vain."""
    program = typer.Typer(
        name="oncenter",
        help=_ABOUT,
        context_settings={"help_option_names": ["-h", "--help"]},
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
    )
    program.callback(
        help=_ABOUT,
        epilog="First steps: oncenter demo; oncenter vehicle new truck.toml; oncenter signals LOG; oncenter offset LOG "
        "--vehicle truck.toml",
    )(_all)
    every = (*_COMMANDS, *_GROUPS)
    for name in (first,) if first in every else every:
        command = getattr(import_module(f"oncenter.cli.{name}"), name)
        if name in _GROUPS:
            program.add_typer(command)
        else:
            program.command(epilog=f"Example: oncenter {_COMMANDS[name]}")(command)
    return program


def _version(wanted: bool) -> None:
    if wanted:
        from oncenter import _core

        typer.echo(_core.version())
        raise typer.Exit


def _all(
    version: bool = typer.Option(False, "--version", callback=_version, is_eager=True, help="Print the version."),
    debug: bool = typer.Option(False, "--debug", help="Show a traceback on internal errors."),
) -> None:
    pass
