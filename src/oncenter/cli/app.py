"""The verbs as one program: one verb a file."""

from __future__ import annotations

import typer

from oncenter.cli.angle import angle
from oncenter.cli.budget import budget
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

app = typer.Typer(
    name="oncenter",
    help="How far a truck's steering wheel angle sensor is off, from ordinary driving.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
for verb in (offset, angle, reference, budget, live, signals, explain, simulate, demo, thesis):
    app.command()(verb)
app.add_typer(export)
app.add_typer(fleet)


def _version(wanted: bool) -> None:
    if wanted:
        from oncenter import _core

        typer.echo(_core.version())
        raise typer.Exit


@app.callback()
def _all(
    version: bool = typer.Option(False, "--version", callback=_version, is_eager=True, help="Print the version."),
    debug: bool = typer.Option(False, "--debug", help="Show the traceback of a bug of ours."),
) -> None:
    """How far a truck's steering wheel angle sensor is off, from ordinary driving."""
