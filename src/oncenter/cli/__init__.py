"""The command line: what may go wrong becomes one line, an exit code and, with --json, an object.

Exit codes: 0 an answer was written; 1 the log cannot be answered; 2 wrong usage, vehicle file or DBC; 70 our own bug;
130 interrupted. The verbs are loaded late, so that an interruption meanwhile is told as any other.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from oncenter.errors import INTERRUPTED, WRONG_USAGE, OncenterError

_OUR_OWN_BUG = 70


def _fail(message: str, code: str, exit_code: int, needs: Sequence[str], as_json: bool) -> int:
    """Words to stderr; with --json the error object to stdout."""
    one_line = " ".join(message.split())
    print(f"oncenter: {one_line}", file=sys.stderr)
    if as_json:
        import json

        error = {"schema": "oncenter/error-1", "code": code, "message": one_line, "needs": list(needs)}
        print(json.dumps(error, ensure_ascii=False))
    return exit_code


def run(arguments: Sequence[str]) -> int:
    """One command line without the program's name; the exit code."""
    as_json = "--json" in arguments
    try:
        return _run(arguments, as_json)
    except KeyboardInterrupt:
        return _interrupted(as_json)


def _run(arguments: Sequence[str], as_json: bool) -> int:
    import typer

    from oncenter.cli.app import app

    try:
        result = app(args=list(arguments) or ["--help"], prog_name="oncenter", standalone_mode=False)
        if result == INTERRUPTED:  # what Typer makes of Ctrl-C; no verb returns a number
            return _interrupted(as_json)
        return result if isinstance(result, int) else 0
    except OncenterError as error:
        return _fail(str(error), error.code, error.exit_code, error.needs, as_json)
    except typer.TyperException as error:
        return _fail(error.format_message(), "usage", WRONG_USAGE, (), as_json)
    except typer.Abort:
        return _interrupted(as_json)
    except BrokenPipeError:  # the reader of our output has seen enough
        sys.stderr.close()
        return 0
    except Exception as error:
        if "--debug" in arguments:
            raise
        what = f"a bug of ours: {type(error).__name__}: {error} (oncenter --debug VERB … shows where)"
        return _fail(what, "bug", _OUR_OWN_BUG, (), as_json)


def _interrupted(as_json: bool) -> int:
    return _fail("interrupted", "interrupted", INTERRUPTED, (), as_json)


def main() -> None:
    sys.exit(run(sys.argv[1:]))
