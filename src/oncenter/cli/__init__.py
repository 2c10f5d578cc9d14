"""The command line: what may go wrong becomes one line, an exit code and, with --json, an object.

Exit codes: 0 an answer was written; 1 the log cannot be answered, or it was and a report cannot be written; 2 wrong
usage, vehicle file or DBC, or nothing can be written where it was asked for; 3 the offset has a status of --fail-on;
70 our own bug; 130 interrupted. The verbs are loaded late, so that an interruption meanwhile is told as any other. What
a verb says to standard output is written in one place.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import sys
from collections.abc import Sequence
from typing import Any, TextIO

from oncenter.errors import INTERRUPTED, WRONG_USAGE, OncenterError
from oncenter.files.child import begin, collect_rarely
from oncenter.files.log_formats import READ_HERE, READER, SUFFIXES

_READING = ("offset", "angle", "reference", "signals")  # the verbs that read logs one by one
_FILE_CANNOT_BE_WRITTEN = 1  # after the answer was
_OUR_OWN_BUG = 70


def run(arguments: Sequence[str]) -> int:
    """One command line without the program's name; the exit code."""
    _speak_utf8_on_windows()
    if sys.stdout is None:  # closed: the next file that is opened would take its place
        return _fail_to_write("it is closed; > /dev/null where nobody reads it")
    said = _Said(sys.stdout, "--json" in arguments)
    with contextlib.redirect_stdout(said):
        try:
            exit_code = _run(arguments, said)
        except KeyboardInterrupt:
            exit_code = _interrupted(said)
        said.flush()
    return said.exit_code or exit_code


def _speak_utf8_on_windows() -> None:
    """There a file or a pipe would get a code page that lacks signs of ours and in which JSON must not be."""
    if sys.platform == "win32":
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(encoding="utf-8", errors="backslashreplace")


class _Said(io.StringIO):
    """What a verb says. It goes to standard output when it is flushed, which typer.echo does: an answer is out before
    a report is written, and stays the only object where that report then fails.

    Attributes:
        as_json: whether an error is an object as well.
        is_begun: whether anything went out.
        exit_code: 0, or that of a standard output that takes no more.
    """

    def __init__(self, out: TextIO, as_json: bool) -> None:
        super().__init__()
        self._out, self.as_json, self.is_begun, self.exit_code = out, as_json, False, 0

    def flush(self) -> None:
        text = self.getvalue()
        self.seek(0)
        self.truncate()
        self.is_begun = self.is_begun or bool(text)
        if self.exit_code == 0:
            self.exit_code = _write(text, self._out)


def _run(arguments: Sequence[str], said: _Said) -> int:
    _begin_reader(arguments)
    import typer

    from oncenter.cli.app import app

    try:
        result = app(args=list(arguments) or ["--help"], prog_name="oncenter", standalone_mode=False)
        if result == INTERRUPTED:  # what Typer makes of Ctrl-C; a verb that exits by itself has 1 or 3
            return _interrupted(said)
        return result if isinstance(result, int) else 0
    except OncenterError as error:
        return _fail(str(error), error.code, error.exit_code, error.needs, said)
    except _usage_error() as error:
        return _fail(error.format_message(), "usage", WRONG_USAGE, (), said)
    except typer.Abort:
        return _interrupted(said)
    except Exception as error:
        if "--debug" in arguments:
            raise
        what = f"a bug of ours: {type(error).__name__}: {error} (oncenter --debug VERB … shows where)"
        return _fail(what, "bug", _OUR_OWN_BUG, (), said)


def _usage_error() -> Any:
    """The exception of all that is wrong with a command line. Typer has no public name for it before 0.28: it is
    click's first, then that of a click within typer."""
    import typer

    return typer.BadParameter.__base__


def _begin_reader(arguments: Sequence[str]) -> None:
    """Where a log needs a child process to be read, that loads beside this one."""
    named = [argument.lower() for argument in arguments]
    if "--help" in named or not named or named[0] not in _READING:
        return
    if any(name.endswith(SUFFIXES) and not name.endswith(READ_HERE) for name in named):
        begin(READER)


def _fail(message: str, code: str, exit_code: int, needs: Sequence[str], said: _Said) -> int:
    """Words to stderr; with --json the error object to stdout, unless the answer is there already.

    After an answer the usage was right: what fails then, a report on a full disk, is exit code 1.
    """
    one_line = _complain(message)
    if said.is_begun:
        return _FILE_CANNOT_BE_WRITTEN if exit_code == WRONG_USAGE else exit_code
    if said.as_json:
        import json

        error = {"schema": "oncenter/error-1", "code": code, "message": one_line, "needs": list(needs)}
        print(json.dumps(error, ensure_ascii=False))
    return exit_code


def _complain(message: str) -> str:
    """To stderr; what was said there."""
    one_line = " ".join(message.split())
    with contextlib.suppress(OSError):  # the exit code says it as well
        print(f"oncenter: {one_line}", file=sys.stderr)
    return one_line


def _interrupted(said: _Said) -> int:
    return _fail("interrupted", "interrupted", INTERRUPTED, (), said)


def _write(text: str, out: TextIO) -> int:
    """To standard output; 0, or the exit code where it takes no more.

    A file's name may hold bytes that are no text: they become escapes, which JSON has as well.
    """
    encoding = out.encoding or "utf-8"
    try:
        out.write(text.encode(encoding, "backslashreplace").decode(encoding))
        out.flush()
    except OSError as error:
        _drop_what_is_left(out)
        if not _is_of_a_reader_that_left(error):
            return _fail_to_write(error.strerror or str(error))
    return 0


def _is_of_a_reader_that_left(error: OSError) -> bool:
    """It has seen enough; Windows calls the end of a pipe an invalid argument."""
    return isinstance(error, BrokenPipeError) or (sys.platform == "win32" and error.errno == errno.EINVAL)


def _drop_what_is_left(out: TextIO) -> None:
    """Else Python would try once more when it ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), out.fileno())


def _fail_to_write(why: str) -> int:
    _complain(f"cannot write to standard output: {why}")
    return WRONG_USAGE


def main() -> None:
    collect_rarely()
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # else it asks every installed package for one
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # nothing here is worth the start of numpy's threads
    sys.exit(run(_expanded(sys.argv[1:])))


def _expanded(arguments: Sequence[str]) -> list[str]:
    """Windows' shells leave `*.mf4` to the program: the files of that name, or itself where there is none."""
    if sys.platform != "win32":
        return list(arguments)
    import glob

    each = (sorted(glob.glob(argument)) if glob.has_magic(argument) else [] for argument in arguments)
    return [name for argument, found in zip(arguments, each, strict=True) for name in found or [argument]]
