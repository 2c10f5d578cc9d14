"""The command line: one verb a file; what may go wrong becomes one line, an exit code and, with --json, an object.

Exit codes: 0 an answer was written; 1 the log cannot be answered; 2 wrong usage, vehicle file or DBC; 70 our own bug;
130 interrupted.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence

import typer

from oncenter.cli.angle import angle
from oncenter.cli.budget import budget
from oncenter.cli.demo import demo
from oncenter.cli.export import export
from oncenter.cli.fleet import fleet
from oncenter.cli.live import live
from oncenter.cli.offset import offset
from oncenter.cli.reference import reference
from oncenter.cli.signals import signals
from oncenter.cli.simulate import simulate
from oncenter.cli.thesis import thesis
from oncenter.errors import WRONG_USAGE, OncenterError

_OUR_OWN_BUG = 70
_INTERRUPTED = 130

app = typer.Typer(
    name="oncenter",
    help="How far a truck's steering wheel angle sensor is off, from ordinary driving.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
for verb in (offset, angle, reference, budget, live, signals, simulate, demo, thesis):
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


def _fail(message: str, code: str, exit_code: int, needs: Sequence[str], as_json: bool) -> int:
    """Words to stderr; with --json the error object to stdout."""
    one_line = " ".join(message.split())
    print(f"oncenter: {one_line}", file=sys.stderr)
    if as_json:
        error = {"schema": "oncenter/error-1", "code": code, "message": one_line, "needs": list(needs)}
        print(json.dumps(error, ensure_ascii=False))
    return exit_code


def run(arguments: Sequence[str]) -> int:
    """One command line without the program's name; the exit code."""
    as_json = "--json" in arguments
    try:
        result = app(args=list(arguments) or ["--help"], prog_name="oncenter", standalone_mode=False)
        return result if isinstance(result, int) else 0
    except OncenterError as error:
        return _fail(str(error), error.code, error.exit_code, error.needs, as_json)
    except typer.TyperException as error:
        return _fail(error.format_message(), "usage", WRONG_USAGE, (), as_json)
    except (typer.Abort, KeyboardInterrupt):
        return _fail("interrupted", "interrupted", _INTERRUPTED, (), as_json)
    except BrokenPipeError:  # the reader of our output has seen enough
        sys.stderr.close()
        return 0
    except Exception as error:
        if "--debug" in arguments:
            raise
        what = f"a bug of ours: {type(error).__name__}: {error} (oncenter --debug VERB … shows where)"
        return _fail(what, "bug", _OUR_OWN_BUG, (), as_json)


def main() -> None:
    sys.exit(run(sys.argv[1:]))
