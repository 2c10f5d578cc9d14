"""The command line: what may go wrong becomes one line, an exit code and, with --json, an object.

Exit codes: 0 an answer was written; 1 the log cannot be answered; 2 wrong usage, vehicle file or DBC, or nothing can be
written where it was asked for; 70 our own bug; 130 interrupted. The verbs are loaded late, so that an interruption
meanwhile is told as any other. What a verb says to standard output is written in one place, once it is done.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Sequence

from oncenter.child import begin
from oncenter.errors import INTERRUPTED, WRONG_USAGE, OncenterError
from oncenter.log_formats import READ_HERE, READER, SUFFIXES

_READING = ("offset", "angle", "reference", "signals")  # the verbs that read logs one by one
_OUR_OWN_BUG = 70


def run(arguments: Sequence[str]) -> int:
    """One command line without the program's name; the exit code."""
    if sys.stdout is None:  # closed: the next file that is opened would take its place
        return _fail_to_write("it is closed; > /dev/null where nobody reads it")
    as_json = "--json" in arguments
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        try:
            exit_code = _run(arguments, as_json)
        except KeyboardInterrupt:
            exit_code = _interrupted(as_json)
    return _write(said.getvalue()) or exit_code


def _run(arguments: Sequence[str], as_json: bool) -> int:
    _begin_reader(arguments)
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
    except Exception as error:
        if "--debug" in arguments:
            raise
        what = f"a bug of ours: {type(error).__name__}: {error} (oncenter --debug VERB … shows where)"
        return _fail(what, "bug", _OUR_OWN_BUG, (), as_json)


def _begin_reader(arguments: Sequence[str]) -> None:
    """Where a log needs a child process to be read, that loads beside this one."""
    named = [argument.lower() for argument in arguments]
    if "--help" in named or not named or named[0] not in _READING:
        return
    if any(name.endswith(SUFFIXES) and not name.endswith(READ_HERE) for name in named):
        begin(READER)


def _fail(message: str, code: str, exit_code: int, needs: Sequence[str], as_json: bool) -> int:
    """Words to stderr; with --json the error object to stdout."""
    one_line = " ".join(message.split())
    with contextlib.suppress(OSError):  # the exit code says it as well
        print(f"oncenter: {one_line}", file=sys.stderr)
    if as_json:
        import json

        error = {"schema": "oncenter/error-1", "code": code, "message": one_line, "needs": list(needs)}
        print(json.dumps(error, ensure_ascii=False))
    return exit_code


def _interrupted(as_json: bool) -> int:
    return _fail("interrupted", "interrupted", INTERRUPTED, (), as_json)


def _write(text: str) -> int:
    """To standard output; 0, or the exit code where it takes no more.

    A file's name may hold bytes that are no text: they become escapes, which JSON has as well.
    """
    encoding = sys.stdout.encoding or "utf-8"
    try:
        sys.stdout.write(text.encode(encoding, "backslashreplace").decode(encoding))
        sys.stdout.flush()
    except BrokenPipeError:  # its reader has seen enough
        _drop_what_is_left()
    except OSError as error:
        _drop_what_is_left()
        return _fail_to_write(error.strerror or str(error))
    return 0


def _drop_what_is_left() -> None:
    """Else Python would try once more when it ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _fail_to_write(why: str) -> int:
    return _fail(f"cannot write to standard output: {why}", "output", WRONG_USAGE, (), as_json=False)


def main() -> None:
    sys.exit(run(sys.argv[1:]))
