"""The command line: each error becomes one line, an exit code and, with --json, an object.

The commands are loaded late, so that an interruption during loading is reported like any other. The output of a command
goes to standard output in one place.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import sys
from collections.abc import Sequence
from typing import Any, TextIO

from oncenter.errors import INTERRUPTED, LOG_CANNOT_BE_ANSWERED, STATUS_TO_FAIL_ON, WRONG_USAGE, OncenterError
from oncenter.files.child import begin, collect_rarely
from oncenter.files.file_name import printable, printable_json, printable_lines
from oncenter.files.log_formats import READ_HERE, READER
from oncenter.files.packed_names import has_log_name

_READING = ("offset", "angle", "reference", "signals")  # the commands that read logs one by one
_FILE_CANNOT_BE_WRITTEN = 1  # after the answer was printed
_INTERNAL_ERROR = 70

EXIT_CODES = {
    0: "an answer was printed",
    LOG_CANNOT_BE_ANSWERED: "the log cannot be answered; or it was answered, and a file cannot be written",
    WRONG_USAGE: "wrong usage, vehicle file or database; or an output cannot be written",
    STATUS_TO_FAIL_ON: "the offset, or the night of a fleet, has a result that --fail-on names",
    _INTERNAL_ERROR: "internal error; oncenter --debug COMMAND ... shows a traceback",
    INTERRUPTED: "interrupted",
}


def run(arguments: Sequence[str]) -> int:
    """One command line without the program's name; the exit code."""
    _speak_utf8_on_windows()
    if sys.stdout is None:  # closed: the next file that is opened would take its place
        return _fail_to_write("it is closed; use > /dev/null to discard the output")
    output = _Output(sys.stdout, "--json" in arguments)
    with contextlib.redirect_stdout(output):
        try:
            exit_code = _run(arguments, output)
        except KeyboardInterrupt:
            exit_code = _interrupted(output)
        except SystemExit as ended:  # of Typer's shell completion
            exit_code = ended.code if isinstance(ended.code, int) else 0
        output.flush()
    return output.exit_code or exit_code


def _speak_utf8_on_windows() -> None:
    """Files and pipes would otherwise get a code page that lacks some characters and is invalid for JSON."""
    if sys.platform == "win32":
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(encoding="utf-8", errors="backslashreplace")


class _Output(io.StringIO):
    """The output of a command. It goes to standard output when it is flushed, which typer.echo does: an answer is out
    before a report is written, and stays the only object if that report then fails. Names of files, columns and
    trucks may hold characters that control a terminal: they become escapes here, whichever command prints them.

    Attributes:
        as_json: whether an error is printed as an object, too.
        is_begun: whether anything was written to standard output.
        exit_code: 0, or the exit code after standard output failed.
    """

    def __init__(self, out: TextIO, as_json: bool) -> None:
        super().__init__()
        self._out, self.as_json, self.is_begun, self.exit_code = out, as_json, False, 0

    def flush(self) -> None:
        text = printable_json(self.getvalue()) if self.as_json else printable_lines(self.getvalue())
        self.seek(0)
        self.truncate()
        self.is_begun = self.is_begun or bool(text)
        if self.exit_code == 0:
            self.exit_code = _write(text, self._out)


def _run(arguments: Sequence[str], output: _Output) -> int:
    _begin_reader(arguments)
    import typer

    from oncenter.cli.program import program_of
    from oncenter.cli.usage import usage_message

    if arguments[:1] == ["help"]:
        arguments = [*arguments[1:], "--help"]
    try:
        program = program_of(arguments[0] if arguments else "")
        result = program(args=list(arguments) or ["--help"], prog_name="oncenter", standalone_mode=False)
        if result == INTERRUPTED:  # from Typer, after Ctrl-C; a command that exits by itself has 1, 2 or 3
            return _interrupted(output)
        return result if isinstance(result, int) else 0
    except OncenterError as error:
        from oncenter.cli.advice import advised

        message = advised(str(error), error.code, arguments)
        return _fail(message, error.code, error.exit_code, error.needs, output)
    except _usage_error() as error:
        return _fail(usage_message(error), "usage", WRONG_USAGE, (), output)
    except typer.Abort:
        return _interrupted(output)
    except Exception as error:
        if "--debug" in arguments:
            raise
        message = f"internal error: {type(error).__name__}: {error} (oncenter --debug COMMAND ... shows a traceback)"
        return _fail(message, "bug", _INTERNAL_ERROR, (), output)


def _usage_error() -> Any:
    """The base class of all usage errors. Typer has no public name for it before 0.28: first it is click's, then that
    of a click within typer."""
    import typer

    return typer.BadParameter.__base__


def _begin_reader(arguments: Sequence[str]) -> None:
    """Starts the child process that some logs need, so that it loads in parallel."""
    named = [argument.lower() for argument in arguments]
    if {"-h", "--help"} & set(named) or not named or named[0] not in _READING:
        return
    if any(has_log_name(name) and not name.endswith(READ_HERE) for name in named):
        begin(READER)


def _fail(message: str, code: str, exit_code: int, needs: Sequence[str], output: _Output) -> int:
    """The message to stderr; with --json the error object to stdout, unless the answer was printed already.

    After an answer the usage was right: an error then, such as a report on a full disk, is exit code 1.
    """
    one_line = _complain(message)
    if output.is_begun:
        return _FILE_CANNOT_BE_WRITTEN if exit_code == WRONG_USAGE else exit_code
    if output.as_json:
        import json

        error = {"schema": "oncenter/error-1", "code": code, "message": one_line, "needs": list(needs)}
        print(json.dumps(error, ensure_ascii=False))
    return exit_code


def _complain(message: str) -> str:
    """Writes a message to stderr; returns its one line."""
    one_line = printable(" ".join(message.split()))
    with contextlib.suppress(OSError):  # the exit code reports the error, too
        print(f"oncenter: {one_line}", file=sys.stderr)
    return one_line


def _interrupted(output: _Output) -> int:
    return _fail("interrupted", "interrupted", INTERRUPTED, (), output)


def _write(text: str, out: TextIO) -> int:
    """Writes to standard output; returns 0, or an exit code if that fails.

    A file's name may hold bytes that are not text: they become escapes, which JSON has, too.
    """
    encoding = out.encoding or "utf-8"
    try:
        out.write(text.encode(encoding, "backslashreplace").decode(encoding))
        out.flush()
    except OSError as error:
        _discard_the_rest(out)
        if not _is_of_a_reader_that_left(error):
            return _fail_to_write(error.strerror or str(error))
    return 0


def _is_of_a_reader_that_left(error: OSError) -> bool:
    """Whether the reader closed the pipe, as `head` does; Windows reports it as an invalid argument."""
    return isinstance(error, BrokenPipeError) or (sys.platform == "win32" and error.errno == errno.EINVAL)


def _discard_the_rest(out: TextIO) -> None:
    """Otherwise Python writes it again at its exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), out.fileno())


def _fail_to_write(why: str) -> int:
    _complain(f"cannot write to standard output: {why}")
    return WRONG_USAGE


def main() -> None:
    collect_rarely()
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # saves a search through all installed packages
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # no matrix here is large enough for threads
    sys.exit(run(_expanded(sys.argv[1:])))


def _expanded(arguments: Sequence[str]) -> list[str]:
    """The arguments; on Windows with `*.mf4` expanded, where a pattern without a match stays as it is."""
    if sys.platform != "win32":
        return list(arguments)
    import glob

    each = (sorted(glob.glob(argument)) if glob.has_magic(argument) else [] for argument in arguments)
    return [name for argument, found in zip(arguments, each, strict=True) for name in found or [argument]]
